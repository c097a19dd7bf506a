//! Writes the seeds of the corpora: one valid input of each kind, from which the fuzzer starts.
//!
//! `cargo run -p hzn-fuzz --example seeds`

use std::fs;
use std::io::Cursor;
use std::path::Path;

use hzn_flight::bytes::Writer;
use hzn_flight::cuc::Cuc;
use hzn_flight::messages::Housekeeping;
use hzn_flight::packet::{self, Apid, ApidBase};
use hzn_flight::{Parameters, table};
use image::{GrayImage, ImageFormat, Luma};

type Seeds = Vec<(String, Vec<u8>)>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let groups = [pictures(), texts(), files()?, streams()];
    let seeds: Seeds = groups.into_iter().flatten().collect();
    for (name, bytes) in &seeds {
        let path = corpora.join(name);
        fs::create_dir_all(path.parent().unwrap_or(&corpora))?;
        fs::write(path, bytes)?;
    }
    println!("{} seeds", seeds.len());
    Ok(())
}

/// Returns a seed with a byte in front that chooses the kind.
fn kind(name: &str, which: u8, bytes: &[u8]) -> (String, Vec<u8>) {
    (name.to_owned(), [&[which], bytes].concat())
}

fn pictures() -> Seeds {
    let mut seeds = Seeds::new();
    for preset in 0..6u8 {
        let noise: Vec<u8> = (0..900u32).map(|i| ((i * i * 31) >> 3) as u8).collect();
        for (shape, pixels) in [("step", vec![10; 900]), ("noise", noise)] {
            let mut bytes = vec![63, 0, 47, 0, preset % 4, 0, 60, preset, 0, 0, 0, 24, 0, 0, 1, 0, 1, 0, 0, 0];
            bytes.extend(&pixels);
            bytes.extend(vec![200u8; 900]);
            seeds.push((format!("picture/seed-{preset}-{shape}"), bytes.clone()));
            seeds.push((format!("rows/seed-{preset}-{shape}"), bytes));
        }
    }
    seeds
}

/// Returns the texts that the program itself has. Texts of other kinds are seeds without a generator.
fn texts() -> Seeds {
    // The targets leave out texts that name another file.
    let without_files = |text: &str| text.replace("file", "fil").into_bytes();
    let mut seeds = vec![("sensor_toml/seed-template".into(), without_files(hzn_files::template::SENSOR_TOML))];
    for (name, _, text) in hzn_sim::scenario::BUILTIN {
        seeds.push((format!("scene_toml/seed-{name}"), without_files(text)));
    }
    seeds
}

fn files() -> Result<Seeds, Box<dyn std::error::Error>> {
    let mut seeds = Seeds::new();
    let picture = GrayImage::from_fn(32, 24, |x, y| Luma([if y > 10 { 200 } else { (x * 7 % 20) as u8 }]));
    let [png, webp] = [ImageFormat::Png, ImageFormat::WebP];
    for format in [png, ImageFormat::Jpeg, ImageFormat::Tiff, ImageFormat::Pnm, ImageFormat::Bmp, webp] {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format)?;
        let name = format!("{format:?}").to_lowercase();
        seeds.push(kind(&format!("picture_file/seed-{name}"), 0, bytes.get_ref()));
        seeds.push(kind(&format!("picture_file/seed-{name}-header"), 2, bytes.get_ref()));
    }
    for format in ["4x2:bayer8", "8x3:mono10p", "5x5:mono12p", "6x4:mono16", "3x3:mono8"] {
        let name = format.replace(':', "-");
        seeds.push(kind(&format!("picture_file/seed-raw-{name}"), 1, format!("{format}\n0123456789").as_bytes()));
    }
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.mcap");
    recording(&path)?;
    let recording = fs::read(&path)?;
    seeds.push(("mcap/seed-whole".into(), recording.clone()));
    seeds.push(("mcap/seed-cut".into(), recording[..recording.len() * 2 / 3].to_vec()));
    seeds.push(("mcap/seed-head".into(), recording[..64.min(recording.len())].to_vec()));
    let rows: Vec<_> = hzn_run::results::read(&path)?.rows;
    for (which, ending) in [(0, "csv"), (1, "jsonl")] {
        let table = folder.path().join(format!("a.{ending}"));
        let mut file = hzn_run::sink::RowFile::create(&table, hzn_run::sink::Existing::Replace)?;
        rows.iter().try_for_each(|row| file.write(row))?;
        file.finish()?;
        let bytes = fs::read(&table)?;
        seeds.push(kind(&format!("results/seed-{ending}"), which, &bytes));
        seeds.push(kind(&format!("results/seed-{ending}-cut"), which, &bytes[..bytes.len() * 2 / 3]));
    }
    Ok(seeds)
}

/// Writes a recording of three small pictures.
fn recording(path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let options = hzn_mcap::Options { sensor_toml: "preset = \"hzn\"\n".into(), force: true, ..Default::default() };
    let mut writer = hzn_mcap::Writer::create(path, &options)?;
    for index in 0..3 {
        let meta = hzn_mcap::RowMeta {
            index,
            file: format!("{index}, \"a\".png"),
            time_s: Some(index as f64),
            body: "earth".into(),
            altitude_km: Some(400.0),
        };
        let row = hzn_mcap::Row::unprocessed(&meta, hzn_core::status::Status::Unreadable, "file is empty");
        let mut frame = hzn_mcap::FrameRecord::new(row);
        frame.image = Some(hzn_mcap::EncodedImage {
            format: hzn_mcap::ImageFormat::Mono8 { width: 4, height: 2 },
            bytes: vec![1, 2, 3, 4, 5, 6, 7, 8],
        });
        writer.write(&frame)?;
        writer.flush()?;
    }
    writer.finish()?;
    Ok(())
}

fn streams() -> Seeds {
    let mut seeds = Seeds::new();
    let mut stored = vec![0; table::MAX_BYTES];
    let n = table::write(&Parameters::defaults(), 7, &mut stored).unwrap_or(0);
    seeds.push(("parameters/seed-table".into(), stored[..n].to_vec()));
    seeds.push(("parameters/seed-set".into(), [&33u16.to_le_bytes()[..], &5f64.to_le_bytes()].concat()));
    seeds.push(("parameters/seed-short".into(), vec![1, 2, 3]));
    let mut packet = [0; packet::MAX_BYTES];
    let n = packet::write(
        &mut packet,
        ApidBase::default(),
        Apid::Housekeeping,
        1,
        Some(Cuc::since_start(2)),
        |w: &mut Writer<'_>| Housekeeping::default().write(w),
    );
    let packet = &packet[..n.unwrap_or(0)];
    seeds.push(("telemetry/seed-housekeeping".into(), packet.to_vec()));
    seeds.push(("telemetry/seed-two".into(), [packet, b"noise", packet].concat()));
    seeds.push(("telemetry/seed-cut".into(), packet[..packet.len() / 2].to_vec()));
    for function in 1..12u8 {
        let mut bytes = vec![2, 0, 16, function];
        bytes.extend([1, 33, 0, 0, 0, 0, 0, 0, 0, 20, 64, 0, 0, 0, 0, 3, 2, 1, 2]);
        seeds.push((format!("telecommand/seed-{function:02}"), bytes));
    }
    seeds
}
