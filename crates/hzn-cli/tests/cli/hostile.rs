//! Files that are made to do harm: pictures that take the memory, names that no file system takes, circles of links.

use crate::common::{Place, SENSOR, cell, crc32, limb, rows, without_time};

/// Returns a chunk of a PNG.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [&kind[..], data].concat();
    [&(data.len() as u32).to_be_bytes()[..], &body, &crc32(&body).to_be_bytes()].concat()
}

/// Returns a grey PNG of 8 bits. It contains `before`, then `pixels` in compressed form.
fn png(width: u32, height: u32, before: &[u8], pixels: &[u8]) -> Vec<u8> {
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let (start, end) = (chunk(b"IHDR", &header), chunk(b"IEND", b""));
    [b"\x89PNG\r\n\x1a\n", &start[..], before, &chunk(b"IDAT", pixels), &end].concat()
}

/// Returns the stream of zlib that an encoder makes of so many zeros: it takes that of a PNG apart.
fn compressed_zeros(bytes: u32) -> Vec<u8> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut file = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::NoFilter);
    let side = bytes / 16_384;
    let image = image::GrayImage::new(16_383, side);
    image.write_with_encoder(encoder).unwrap();
    let mut streams = Vec::new();
    let mut at = 8;
    while let Some(head) = file.get(at..at + 8) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        if &head[4..] == b"IDAT" {
            streams.extend_from_slice(&file[at + 8..at + 8 + length]);
        }
        at += length + 12;
    }
    streams
}

/// Returns a TIFF with one directory. An entry is a tag, a type, a number of values and a value; `u32::MAX` stands for
/// the place of `data`.
fn tiff(entries: &[(u16, u16, u32, u32)], data: &[u8]) -> Vec<u8> {
    let begin = 8 + 2 + 12 * entries.len() as u32 + 4;
    let entry = |(tag, kind, count, value): &(u16, u16, u32, u32)| {
        let value = if *value == u32::MAX { begin } else { *value };
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), &value.to_le_bytes()].concat()
    };
    let directory: Vec<u8> = entries.iter().flat_map(entry).collect();
    [b"II*\0\x08\0\0\0", &(entries.len() as u16).to_le_bytes()[..], &directory, &[0; 4], data].concat()
}

/// Returns a BMP of 8 bits whose pixels are compressed as runs.
fn bmp(width: i32, height: i32, runs: &[u8]) -> Vec<u8> {
    let palette: Vec<u8> = (0..=255).flat_map(|i| [i, i, i, 0]).collect();
    let begin = 54 + palette.len() as u32;
    let number = |n: u32| n.to_le_bytes();
    let file = [&b"BM"[..], &number(begin + runs.len() as u32), &[0; 4], &number(begin)].concat();
    let size = [number(40), width.to_le_bytes(), height.to_le_bytes()].concat();
    let planes = [&[1, 0, 8, 0][..], &number(1), &number(runs.len() as u32), &[0; 8], &number(256), &[0; 4]].concat();
    [file, size, planes, palette, runs.to_vec()].concat()
}

/// Returns a progressive JPEG of one grey picture, whose last scan is repeated.
fn progressive_jpeg(width: u16, height: u16, scans: usize) -> Vec<u8> {
    let segment =
        |marker: u8, data: &[u8]| [&[0xff, marker][..], &(data.len() as u16 + 2).to_be_bytes(), data].concat();
    let size = [&[8][..], &height.to_be_bytes(), &width.to_be_bytes(), &[1, 1, 0x11, 0]].concat();
    // One code of one bit: the value 0. All coefficients are zero, so a block is one bit.
    let table = |class: u8| segment(0xc4, &[&[class, 1][..], &[0; 15], &[0]].concat());
    let blocks = usize::from(width.div_ceil(8)) * usize::from(height.div_ceil(8));
    let scan = |data: &[u8]| [segment(0xda, data), vec![0; blocks.div_ceil(8)]].concat();
    let start = [vec![0xff, 0xd8], segment(0xdb, &[&[0][..], &[1; 64]].concat()), segment(0xc2, &size)].concat();
    let first = scan(&[1, 1, 0, 0, 0, 0]);
    let other = scan(&[1, 1, 0, 1, 63, 0]);
    [start, table(0), table(0x10), first, other.repeat(scans - 1), vec![0xff, 0xd9]].concat()
}

/// Returns the bombs with their names. Each is small, and would take hundreds of megabytes.
fn bombs() -> Vec<(&'static str, Vec<u8>)> {
    let zeros = compressed_zeros(256 << 20);
    assert!(zeros.len() < 1 << 20, "{}", zeros.len());
    let grey = [(258, 3, 1, 8), (259, 3, 1, 8), (262, 3, 1, 1)];
    let tiff_of = |width: u32, height: u32, parts: &[(u16, u16, u32, u32)], data: &[u8]| {
        tiff(&[&[(256, 4, 1, width), (257, 4, 1, height)], &grey[..], parts].concat(), data)
    };
    let length = zeros.len() as u32;
    let here = u32::MAX;
    let strip = [(273, 4, 1, here), (277, 3, 1, 1), (278, 4, 1, 240), (279, 4, 1, length)];
    let tile =
        |side: u32| [(277, 3, 1, 1), (322, 4, 1, side), (323, 4, 1, side), (324, 4, 1, here), (325, 4, 1, length)];
    let page = tiff_of(320, 240, &strip, &zeros);
    // The directories form a circle, so that the file has pages without an end.
    let mut pages = page.clone();
    pages[8 + 2 + 12 * 9..][..4].copy_from_slice(&8u32.to_le_bytes());
    vec![
        ("profile.png", png(320, 240, &chunk(b"iCCP", &[b"a\0\0", &zeros[..]].concat()), &zeros)),
        ("text.png", png(320, 240, &chunk(b"zTXt", &[b"a\0\0", &zeros[..]].concat()), &zeros)),
        ("rows.png", png(320, 240, b"", &zeros)),
        ("scans.jpg", progressive_jpeg(320, 240, 5000)),
        ("strip.tif", page),
        ("tile.tif", tiff_of(320, 240, &tile(16_000), &zeros)),
        ("tiles.tif", tiff_of(320, 240, &tile(1 << 31), &zeros)),
        (
            "strips.tif",
            tiff_of(320, 240, &[(273, 4, 1 << 28, 8), (277, 3, 1, 1), (278, 4, 1, 1), (279, 4, 1 << 28, 8)], &zeros),
        ),
        ("pages.tif", pages),
        ("runs.bmp", bmp(320, 240, &[255, 7].repeat(1 << 19))),
        ("huge.png", png(20_000, 20_000, b"", &zeros)),
        ("huge.bmp", bmp(20_000, 20_000, &[255, 7, 0, 1])),
        ("huge.tif", tiff_of(20_000, 20_000, &strip, &zeros)),
        ("huge.jpg", progressive_jpeg(20_000, 20_000, 2)),
        ("huge.pgm", b"P5 20000 20000 255\n123".to_vec()),
        ("endless.pgm", b"P2 99999999999 240 255\n1 2 3".to_vec()),
    ]
}

/// Runs a command and returns its exit code, and the largest resident memory that was seen, in kB.
#[cfg(target_os = "linux")]
fn peak_memory_kb(command: &mut std::process::Command) -> (Option<i32>, u64) {
    let (code, kb, _) = cost(command);
    (code, kb)
}

/// Runs a command and returns its exit code, the largest resident memory that was seen, in kB, and its processor time
/// in seconds.
#[cfg(target_os = "linux")]
fn cost(command: &mut std::process::Command) -> (Option<i32>, u64, f64) {
    let mut child = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
    let [status, stat] = ["status", "stat"].map(|name| format!("/proc/{}/{name}", child.id()));
    let (mut peak, mut ticks) = (0, 0);
    loop {
        // The kernel keeps the largest value, so a look now and then sees it.
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let kb = |line: &str| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok();
        peak = peak.max(text.lines().find_map(kb).unwrap_or(0));
        ticks = ticks.max(crate::campaign::processor_ticks(&stat).unwrap_or(0));
        if let Some(status) = child.try_wait().unwrap() {
            // Linux counts a hundred ticks a second for programs, whatever its own clock is.
            return (status.code(), peak, ticks as f64 / 100.0);
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn eight_bombs_at_eight_threads_stay_small() {
    for (name, bomb) in bombs() {
        let place = Place::with_pictures(1);
        let ending = name.rsplit_once('.').unwrap().1;
        for i in 0..8 {
            place.write(&format!("in/b{i}.{ending}"), &bomb);
        }
        let (code, peak) = peak_memory_kb(&mut place.command(&["run", "in", "--jobs", "8", "-o", "out.csv"]));
        assert!(peak > 0 && peak < 200_000, "{name}: {peak} kB");
        assert!(matches!(code, Some(0 | 3)), "{name}: {code:?}");
        // The picture beside them has its answer, and each bomb has a row.
        let rows = without_time(&place.read("out.csv"));
        assert_eq!((rows.len(), cell(&rows[0], "status")), (9, "ok"), "{name}");
        println!("{name}: {} bytes, {peak} kB, {} {}", bomb.len(), cell(&rows[8], "status"), cell(&rows[8], "detail"));
        if name.starts_with("huge") || name == "scans.jpg" {
            assert_eq!(cell(&rows[8], "status"), "unreadable", "{name}");
        }
        // Only the picture that is asked for is decoded, and not the bombs beside it.
        let (code, peak) = peak_memory_kb(&mut place.command(&["run", "in/0000.png", "--jobs", "8", "-o", "one.csv"]));
        assert!(code == Some(0) && peak > 0 && peak < 200_000, "{name} beside the picture: {code:?}, {peak} kB");
        let rows = without_time(&place.read("one.csv"));
        assert_eq!((rows.len(), cell(&rows[0], "status")), (1, "ok"), "{name}");
    }
}

/// A TIFF of the right size may have one compressed strip of any size. Its decoder may take the samples twice and
/// 16 MiB, so the strip may take the samples and 16 MiB.
#[test]
fn a_strip_has_at_most_the_memory_of_its_picture() {
    let zeros = compressed_zeros(1 << 20);
    let place = Place::with_pictures(0);
    for (name, length) in [("a.tif", 320 * 240 + (16 << 20)), ("b.tif", 320 * 240 + (16 << 20) + 1)] {
        let kind = [(256, 4, 1, 320), (257, 4, 1, 240), (258, 3, 1, 8), (259, 3, 1, 8), (262, 3, 1, 1)];
        let strip = [(273, 4, 1, u32::MAX), (277, 3, 1, 1), (278, 4, 1, 240), (279, 4, 1, length)];
        let mut data = zeros.clone();
        data.resize(length as usize, 0);
        place.write(&format!("in/{name}"), &tiff(&[&kind[..], &strip].concat(), &data));
    }
    let rows = rows(&place.run(&["run", "in"]).expect(3).out);
    assert_eq!(rows.iter().map(|row| cell(row, "status")).collect::<Vec<_>>(), ["no-limb", "unreadable"]);
    let why = "TIFF needs more memory than a picture of its size should: above 16 MB";
    assert_eq!(cell(&rows[1], "detail"), why);
}

/// Without the memory that all threads share, eight pictures take eight times the memory of one.
#[test]
#[cfg(target_os = "linux")]
fn large_pictures_wait_for_each_other() {
    let place = Place::with_pictures(0);
    let sensor = SENSOR.replace("width = 320", "width = 12000").replace("height = 240", "height = 10000");
    place.write("in/sensor.toml", sensor.as_bytes());
    let picture = png(12_000, 10_000, b"", &compressed_zeros(12_000 * 10_000 + 16_384 * 8));
    for i in 0..8 {
        place.write(&format!("in/{i}.png"), &picture);
    }
    // Each picture takes 120 MB.
    let (code, peak) = peak_memory_kb(&mut place.command(&["run", "in", "--jobs", "8", "-o", "out.csv"]));
    assert_eq!(code, Some(0));
    assert!(peak < 620_000, "{peak} kB");
    assert!(place.rows("out.csv").iter().all(|row| cell(row, "status") == "no-limb"));
}

#[test]
fn a_progressive_jpeg_has_at_most_100_scans() {
    let place = Place::with_pictures(0);
    place.write("in/a.jpg", &progressive_jpeg(320, 240, 100));
    place.write("in/b.jpg", &progressive_jpeg(320, 240, 101));
    let rows = rows(&place.run(&["run", "in"]).expect(3).out);
    assert_eq!(rows.iter().map(|row| cell(row, "status")).collect::<Vec<_>>(), ["no-limb", "unreadable"]);
    assert_eq!(cell(&rows[1], "detail"), "JPEG of 101 scans is above the limit of 100: save it again");
}

/// Honest pictures of each kind fit into the memory of their size.
#[test]
fn honest_pictures_are_decoded() {
    let place = Place::with_pictures(0);
    let sensor = SENSOR.replace("width = 320", "width = 3000").replace("height = 240", "height = 2500");
    place.write("in/sensor.toml", sensor.as_bytes());
    let colour = image::DynamicImage::ImageLuma8(limb(3000, 2500, 0.0)).to_rgb16();
    let grey = limb(3000, 2500, 0.0);
    for ending in ["png", "tif"] {
        colour.save(place.path(&format!("in/colour.{ending}"))).unwrap();
    }
    for ending in ["png", "tif", "bmp", "jpg", "pgm"] {
        grey.save(place.path(&format!("in/grey.{ending}"))).unwrap();
    }
    // One strip that is not compressed: 45 MB.
    let words: Vec<u8> = colour.as_raw().iter().flat_map(|word| word.to_le_bytes()).collect();
    let kind = [(256, 4, 1, 3000), (257, 4, 1, 2500), (258, 3, 1, 16), (259, 3, 1, 1), (262, 3, 1, 1)];
    let green: Vec<u8> = words.chunks_exact(6).flat_map(|pixel| pixel[2..4].to_vec()).collect();
    let strip = [(273, 4, 1, u32::MAX), (277, 3, 1, 1), (278, 4, 1, 2500), (279, 4, 1, green.len() as u32)];
    place.write("in/strip.tif", &tiff(&[&kind[..], &strip].concat(), &green));
    // The coefficients of all blocks take twice as much as the samples.
    place.write("in/progressive.jpg", &progressive_jpeg(3000, 2500, 10));
    let ran = place.run(&["run", "in", "-j", "4"]).expect(0);
    assert_eq!(rows(&ran.out).len(), 9);
    assert!(rows(&ran.out).iter().all(|row| cell(row, "status") != "unreadable"), "{}", ran.out);
}

/// The rows of other pictures are counted, and take no memory. Ten times as many rows take about ten times as long.
#[test]
#[cfg(target_os = "linux")]
fn a_table_of_other_pictures_takes_neither_time_nor_memory() {
    let place = Place::with_pictures(2);
    let tail = ",2019-06-13T10:31:00.000Z,400,,,,,,,,,0.001,0.002,0.003\n";
    let header = "file,time_s,utc,altitude_km,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg,rate_x,rate_y,rate_z\n";
    let most = if std::env::var_os("HZN_ALL").is_some() { 1_900_000 } else { 300_000 };
    let [few_s, many_s] = [most / 10, most].map(|count| {
        let others: String = (0..count).map(|i| format!("other_{i:07}.png,{i}{tail}")).collect();
        place.write("in/frames.csv", format!("{header}{others}0000.png,5{tail}0001.png,6{tail}").as_bytes());
        let (code, peak, seconds) = cost(&mut place.command(&["run", "in", "-o", &format!("out{count}.csv")]));
        println!("{count} rows of other pictures: {seconds:.2} s of processor time, {peak} kB");
        assert!(code == Some(0) && peak < 60_000, "{code:?}, {peak} kB");
        seconds
    });
    // A search of all rows for each row would take a hundred times as long. The computer's own speed is in both times.
    assert!(many_s < 30.0 * few_s, "{few_s} s, then {many_s} s");
    let times: Vec<String> =
        place.rows(&format!("out{most}.csv")).iter().map(|row| cell(row, "time_s").into()).collect();
    assert_eq!(times, ["5.0", "6.0"]);
    place
        .run(&["run", "in", "-q"])
        .expect(0)
        .says(&format!("{} further rows without a picture in the folder", most - 3));
}

#[test]
fn names_that_no_file_system_takes_get_overlays() {
    let place = Place::with_pictures(1);
    let long = format!("{}.png", "a".repeat(247));
    std::fs::rename(place.path("in/0000.png"), place.path(&format!("in/{long}"))).unwrap();
    place.run(&["run", "in", "-o", "out.mcap", "--overlay", "drawn"]).expect(0);
    let mut names = vec!["nul\0.png".to_owned(), "a".repeat(5000), "\x1b]52;c;aGk=\x07.png".into(), long];
    let options = hzn_mcap::Options { sensor_toml: SENSOR.into(), ..hzn_mcap::Options::default() };
    let mut writer = hzn_mcap::Writer::create(place.path("names.mcap"), &options).unwrap();
    let recorded = hzn_mcap::Reader::open(place.path("out.mcap"), hzn_mcap::Contents::All).unwrap();
    let first = recorded.map(Result::unwrap).next().unwrap();
    for (index, name) in names.iter().enumerate() {
        let mut record = first.clone();
        (record.row.file, record.row.index) = (name.clone(), index as u64);
        writer.write(&record).unwrap();
    }
    writer.finish().unwrap();
    place.run(&["run", "names.mcap", "-o", "again.csv", "--overlay", "again"]).expect(0);
    place.run(&["export", "names.mcap", "--images", "images", "--overlay", "overlays"]).expect(0);
    for folder in ["drawn", "again", "images", "overlays"] {
        let made: Vec<String> = std::fs::read_dir(place.path(folder))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        assert_eq!(made.len(), if folder == "drawn" { 1 } else { names.len() }, "{made:?}");
        assert!(made.iter().all(|name| name.len() < 220 && !name.contains(char::is_control)), "{made:?}");
    }
    // The results have the names as they were recorded.
    let found: Vec<String> = place.rows("again.csv").iter().map(|row| cell(row, "file").to_owned()).collect();
    names.truncate(found.len());
    assert_eq!(found, names);
}

#[test]
fn texts_that_a_spreadsheet_would_compute_begin_with_an_apostrophe() {
    let place = Place::with_pictures(2);
    let names = ["=1+1.png", "-2.png"];
    for (i, name) in names.iter().enumerate() {
        std::fs::rename(place.path(&format!("in/{i:04}.png")), place.path(&format!("in/{name}"))).unwrap();
    }
    place.run(&["run", "in", "-o", "out.csv"]).expect(0);
    place.run(&["run", "in", "-o", "out.jsonl"]).expect(0);
    let files = |table: &str| place.rows(table).iter().map(|row| cell(row, "file").to_owned()).collect::<Vec<_>>();
    let mut written = files("out.csv");
    written.sort();
    assert_eq!(written, ["'-2.png", "'=1+1.png"]);
    assert!(place.read("out.jsonl").contains("\"file\":\"=1+1.png\""));
    // Whoever reads the table with hzn gets the names of the pictures.
    place.run(&["export", "out.csv", "-o", "copy.jsonl"]).expect(0);
    assert!(place.read("copy.jsonl").contains("\"file\":\"=1+1.png\""));
    place.run(&["run", "in", "-o", "out.csv", "--resume"]).expect(0).says("that were finished before");
    // The names of a simulation are in frames.csv and truth.csv, which are never guarded.
    let scene = place.run(&["simulate", "enceladus", "--show"]).expect(0).out;
    place.write("scene.toml", scene.replace("name = \"", "name = \"-").as_bytes());
    place.run(&["simulate", "scene.toml", "-o", "sim"]).expect(2).says("and not begin with '-'");
}

/// hzn writes only some of the texts, but a recording of somebody else may have anything in all of them.
#[test]
fn no_text_of_a_recording_is_a_formula_in_its_table() {
    let place = Place::with_pictures(0);
    let texts = ["=1+1", "+a", "-b", "@c", "\t=d", "'=e"];
    let mut writer = hzn_mcap::Writer::create(place.path("a.mcap"), &hzn_mcap::Options::default()).unwrap();
    for first in 0..texts.len() {
        let mut row = hzn_mcap::Row::unprocessed(&hzn_mcap::RowMeta::default(), hzn_core::status::Status::Ok, "");
        (row.index, row.head) = (first as u64, Some(String::new()));
        (row.heads_used, row.heads_excluded) = (row.head.clone(), row.head.clone());
        let mut at = first;
        row.change_texts(|text| {
            *text = texts[at % texts.len()].to_owned();
            at += 1;
        });
        writer.write(&hzn_mcap::FrameRecord::new(row)).unwrap();
    }
    writer.finish().unwrap();
    place.run(&["export", "a.mcap", "-o", "a.csv"]).expect(0).says("6 rows");
    let mut table = csv::Reader::from_path(place.path("a.csv")).unwrap();
    let cells: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let written = |text: &str| cells.iter().flatten().filter(|cell| *cell == text).count();
    for text in texts {
        assert_eq!((written(text), written(&format!("'{text}"))), (0, 6), "{text:?}");
    }
    // Whoever reads the table with hzn gets the recorded texts.
    place.run(&["export", "a.mcap", "-o", "a.jsonl"]).expect(0);
    place.run(&["export", "a.csv", "-o", "b.jsonl"]).expect(0);
    assert_eq!(place.read("a.jsonl"), place.read("b.jsonl"));
}

#[test]
#[cfg(unix)]
fn a_circle_of_links_ends() {
    let place = Place::with_pictures(2);
    std::fs::create_dir_all(place.path("in/a/b")).unwrap();
    std::fs::rename(place.path("in/0001.png"), place.path("in/a/b/0001.png")).unwrap();
    for link in ["in/a/up", "in/a/b/up", "in/a/b/again"] {
        std::os::unix::fs::symlink(place.path("in"), place.path(link)).unwrap();
    }
    let ran = place.run(&["run", "in/**/*.png", "-s", "in/sensor.toml", "-o", "out.csv"]).expect(0);
    assert!(!ran.err.contains("left out"), "{}", ran.err);
    let rows = place.rows("out.csv");
    assert_eq!(rows.iter().map(|row| cell(row, "file")).collect::<Vec<_>>(), ["in/0000.png", "in/a/b/0001.png"]);
}

/// Makes a library that lets calls of the system fail when it is loaded before the program. Returns `false` without a C
/// compiler.
#[cfg(target_os = "linux")]
fn make_failing_calls(place: &Place) -> bool {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/failing_calls.c");
    let mut cc = std::process::Command::new("cc");
    cc.args(["-shared", "-fPIC", "-O1", "-o"]).arg(place.path("calls.so")).arg(source).arg("-ldl");
    match cc.status() {
        Ok(status) => assert!(status.success()),
        Err(e) => eprintln!("failed calls left out: no C compiler: {e}"),
    }
    place.path("calls.so").exists()
}

/// A table is cut behind its last complete row before it is continued.
#[test]
#[cfg(target_os = "linux")]
fn a_failed_truncation_is_told() {
    let place = Place::with_pictures(3);
    if !make_failing_calls(&place) {
        return;
    }
    place.run(&["run", "in/0000.png", "in/0001.png", "-o", "whole.csv"]).expect(0);
    let whole = place.read("whole.csv");
    for part in ["out.csv.part", "out.csv.part.chain"] {
        place.write("out.csv.part", &whole.as_bytes()[..whole.len() - 5]);
        let mut command = place.command(&["run", "in", "-o", "out.csv", "--resume"]);
        command.env("LD_PRELOAD", place.path("calls.so")).env("HZN_FAILING_TRUNCATE", format!("/{part}"));
        let ran = crate::common::Ran::from_output(&command.output().unwrap(), &place.path(""));
        ran.expect(1).says(&format!("{part}: the disk is full"));
        assert!(!place.path("out.csv").exists());
        // Nothing is lost.
        place.run(&["run", "in", "-o", "out.csv", "--resume"]).expect(0).says("1 that were finished before");
        assert_eq!(without_time(&place.read("out.csv"))[..2], without_time(&whole));
        std::fs::remove_file(place.path("out.csv")).unwrap();
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_failed_close_is_told() {
    let place = Place::with_pictures(2);
    if !make_failing_calls(&place) {
        return;
    }
    place.run(&["run", "in", "-o", "ready.mcap"]).expect(0);
    for (written, args) in [
        ("out.csv", vec!["run", "in", "-o", "out.csv"]),
        ("out.jsonl", vec!["run", "in", "-o", "out.jsonl"]),
        ("out.mcap", vec!["run", "in", "-o", "out.mcap"]),
        ("drawn/0001.png", vec!["run", "in", "--overlay", "drawn"]),
        ("copy.csv", vec!["export", "ready.mcap", "-o", "copy.csv"]),
        ("images/0000.png", vec!["export", "ready.mcap", "--images", "images"]),
        ("new.toml", vec!["init", "-o", "new.toml"]),
        ("table.csv", vec!["sensitivity", "--fov", "60:90", "--altitude", "200", "-o", "table.csv"]),
        ("packet.bin", vec!["telecommand", "ping", "-o", "packet.bin"]),
    ] {
        let mut command = place.command(&args);
        command.env("LD_PRELOAD", place.path("calls.so")).env("HZN_FAILING_CLOSE", written);
        let ran = crate::common::Ran::from_output(&command.output().unwrap(), &place.path(""));
        assert!(ran.code == 1 && ran.err.contains("error: "), "{args:?}: {} {}", ran.code, ran.err);
    }
}
