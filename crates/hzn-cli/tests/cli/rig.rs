//! `hzn run rig.toml`: several cameras that are one sensor.

use std::fs;

use crate::common::{Place, cell, without_time};
use crate::rig_scene::{Rows, ring, run};

const HEADS: [&str; 4] = ["front", "right", "back", "left"];

/// Returns the rows of a head, without the columns that only a rig or its order gives.
fn of_head(rows: &[Vec<(String, String)>], head: &str) -> Rows {
    let own = rows.iter().filter(|row| cell(row, "head") == head || head.is_empty()).cloned();
    own.map(|row| row.into_iter().filter(|(name, _)| name != "head" && name != "crc32").collect()).collect()
}

#[test]
fn a_simulated_rig_runs_at_once_and_its_answers_fit_the_truth() {
    let place = ring();
    let (joint, heads) = run(&place, &["-j", "1"], 0);
    assert_eq!((joint.len(), heads.len()), (4, 16));
    for row in &joint {
        assert_eq!((cell(row, "status"), cell(row, "heads_used")), ("ok", "front right back left"), "{row:?}");
        let number = |name: &str| cell(row, name).parse::<f64>().unwrap();
        assert!(number("separation_deg") < number("separation_limit_deg") && number("protection_deg") < 1.0);
        // The body is below the vehicle, but for its tilt of 2 to 3 degrees.
        assert!(number("axis_z") > 0.99 && cell(row, "axis_v_z") == cell(row, "axis_z"));
    }
    assert_eq!(run(&place, &["-j", "3"], 0), (joint, heads));
    place.run(&["run", "ring/rig.toml", "-o", "out.csv", "-q"]).expect(0);
    place.run(&["run", "ring/rig.toml", "-o", "out.mcap", "-q"]).expect(0);
    let info = place.run(&["info", "out.mcap"]).expect(0).out;
    assert!(info.contains("recording of hzn run with a rig\n") && info.contains("--images DIR"), "{info}");
    let from_table = place.run(&["evaluate", "out.csv", "--truth", "ring", "-o", "r.json"]).expect(0).out;
    let json: serde_json::Value = serde_json::from_str(&place.read("r.json")).unwrap();
    let rms = json["evaluations"][0]["errors"]["rms_deg"].as_f64().unwrap();
    assert!(json["evaluations"][0]["answered"] == 4 && rms < 0.02, "{rms}");
    assert_eq!(
        place.run(&["evaluate", "out.mcap", "--truth", "ring"]).expect(0).out.lines().skip(1).collect::<Vec<_>>(),
        from_table.lines().skip(1).collect::<Vec<_>>()
    );
    // The recording has the pictures, the calibration and the axis of each head on topics of its own.
    let recording = fs::read(place.path("out.mcap")).unwrap();
    let has = |text: &str| recording.windows(text.len()).any(|bytes| bytes == text.as_bytes());
    for topic in ["/left/camera/image", "/front/camera/calibration", "/back/hzn/axis", "/hzn/report", "rig.toml"] {
        assert!(has(topic), "{topic}");
    }
    place.run(&["export", "out.mcap", "--images", "images", "--overlay", "drawn"]).expect(0);
    for head in HEADS {
        let picture = |folder: &str| fs::read(place.path(&format!("{folder}/{head}/{head}-00003.png"))).unwrap();
        assert_eq!(picture("images"), picture("ring"), "{head}");
        assert_ne!(picture("drawn"), picture("ring"), "{head}");
    }
    let left = place.run(&["evaluate", "out.csv", "--truth", "ring/left", "--head", "left"]).expect(0).out;
    assert!(left.contains("4 of 4 pictures"), "{left}");
    place
        .run(&["evaluate", "out.csv", "--truth", "ring", "--head", "lft"])
        .expect(2)
        .says("back, front, left, rig, right");
}

#[test]
fn a_heads_row_is_that_of_its_sensor_and_one_head_alone_is_turned_by_the_mount() {
    let place = ring();
    fs::remove_file(place.path("ring/frames.csv")).unwrap();
    let (_, heads) = run(&place, &[], 0);
    for head in HEADS {
        let alone = without_time(&place.run(&["run", &format!("ring/{head}"), "-q"]).expect(0).out);
        assert_eq!(of_head(&heads, head), of_head(&alone, ""), "{head}");
    }
    let text = place.read("ring/rig.toml");
    let [start, first, ..] = text.split("[[head]]").collect::<Vec<_>>()[..] else { panic!("{text}") };
    place.write("ring/rig.toml", format!("{start}[[head]]{first}").as_bytes());
    let (joint, alone) = run(&place, &[], 0);
    assert_eq!(of_head(&alone, "front"), of_head(&heads, "front"));
    for (joint, own) in joint.iter().zip(&alone) {
        assert_eq!((cell(joint, "heads_used"), cell(joint, "protection_deg")), ("front", ""));
        for column in ["axis_v_x", "axis_v_y", "axis_v_z"] {
            let [a, b] = [joint, own].map(|row| cell(row, column).parse::<f64>().unwrap());
            assert!((a - b).abs() < 1e-12, "{column} {a} {b}");
        }
        let [a, b] = [joint, own].map(|row| cell(row, "sigma_max_deg").parse::<f64>().unwrap());
        assert!((a - b).abs() < 1e-9 * a, "{a} {b}");
    }
}

#[test]
fn a_lost_head_costs_only_itself_and_a_frozen_one_is_excluded() {
    let place = ring();
    let (_, good) = run(&place, &[], 0);
    let file = |head: &str, n: usize| place.path(&format!("ring/{head}/{head}-{n:05}.png"));
    fs::remove_file(file("front", 0)).unwrap();
    fs::write(file("right", 1), "no picture").unwrap();
    image::ImageBuffer::<image::Luma<u16>, _>::new(320, 240).save(file("back", 2)).unwrap();
    fs::copy(file("left", 2), file("left", 3)).unwrap();
    let (joint, heads) = run(&place, &[], 3);
    let used: Vec<&str> = joint.iter().map(|row| cell(row, "heads_used")).collect();
    assert_eq!(used, ["right back left", "front back left", "front right left", "front right back"]);
    assert!(joint.iter().all(|row| cell(row, "status") == "ok"));
    let details: Vec<&str> = joint.iter().map(|row| cell(row, "detail")).collect();
    let dark = details[2].strip_prefix("back: ").unwrap();
    assert!(["no-limb", "too-dark"].contains(&dark), "{dark}");
    assert_eq!(
        [details[0], details[1], details[3]],
        ["front: no picture", "right: unreadable", "left: the picture of the epoch before"]
    );
    assert_eq!(cell(&joint[3], "heads_excluded"), "left");
    // All other rows are the same.
    let same = |head: &str, n: &str| {
        let own = |rows: &Rows| of_head(rows, head).into_iter().find(|row| cell(row, "index") == n);
        own(&heads) == own(&good) && own(&good).is_some()
    };
    assert!(same("right", "0") && same("back", "0") && same("front", "1") && same("left", "2") && same("right", "3"));
    assert_eq!(heads.len(), 15);
    // A dark picture has no noise: the second of two is dark, too, and not frozen.
    fs::copy(file("back", 2), file("back", 3)).unwrap();
    let (joint, _) = run(&place, &[], 3);
    assert!(cell(&joint[3], "detail").contains(&format!("back: {dark}")), "{}", cell(&joint[3], "detail"));
    assert_eq!(cell(&joint[3], "heads_excluded"), "left");
}

/// Pictures, mounts and clocks that belong to another head are told.
#[test]
fn what_belongs_to_another_head_is_told() {
    let place = ring();
    let good = place.read("ring/rig.toml");
    place.write("ring/rig.toml", good.replace("pictures = \"right\"", "pictures = \"./front\"").as_bytes());
    let ran = place.run(&["run", "ring/rig.toml", "-o", "r.csv"]).expect(2);
    ran.says("head right: ./front: these are the pictures of head front, too");
    place.write("ring/rig.toml", good.as_bytes());
    for n in 0..4 {
        let file = |head: &str| place.path(&format!("ring/{head}/{head}-{n:05}.png"));
        fs::copy(file("front"), file("right")).unwrap();
    }
    let (joint, _) = run(&place, &[], 0);
    assert_eq!(cell(&joint[0], "heads_used"), "back left");
    assert_eq!(cell(&joint[0], "heads_excluded"), "front right");
    assert_eq!(cell(&joint[0], "detail"), "front: the picture of another head, right: the picture of another head");
    place.run(&["run", "ring/rig.toml", "-o", "r.csv"]).expect(0).says("note: head right was excluded in 4 epochs");
    // A mount that contradicts the one of the head's sensor.toml.
    let sensor = place.read("ring/left/sensor.toml");
    let (start, mount) = sensor.split_once("q_vehicle_from_camera_wxyz = ").unwrap();
    let rest = mount.split_once('\n').unwrap().1;
    let other = format!("{start}q_vehicle_from_camera_wxyz = [1.0, 0.0, 0.0, 0.0]\n{rest}");
    place.write("ring/left/sensor.toml", other.as_bytes());
    // A clock that is another one.
    let frames = place.read("ring/back/frames.csv").replace(".0,2021-07-15", ".0,2021-07-16");
    let late = frames.lines().map(|line| match line.split_once(".0,2021") {
        Some((start, end)) => {
            let (file, time_s) = start.rsplit_once(',').unwrap();
            format!("{file},{}.0,2021{end}\n", time_s.parse::<f64>().unwrap() + 86400.0)
        }
        None => format!("{line}\n"),
    });
    place.write("ring/back/frames.csv", late.collect::<String>().as_bytes());
    let ran = place.run(&["run", "ring/rig.toml", "-o", "r.csv", "--force"]).expect(3);
    ran.says("left: [mount] of its sensor.toml is").says("no picture of back was taken at most");
}

#[test]
fn a_turned_mount_is_named_and_two_heads_only_notice_it() {
    let place = ring();
    let text = place.read("ring/rig.toml");
    let mount = text.split("q_rig_from_camera_wxyz = [").nth(2).unwrap().split(']').next().unwrap().to_owned();
    let q: Vec<f64> = mount.split(',').filter_map(|x| x.trim().parse().ok()).collect();
    // A turn of one degree about the camera's x axis moves the limb in the picture of the second head.
    let (sin, cos) = 0.5f64.to_radians().sin_cos();
    let turned = [q[0] * cos - q[1] * sin, q[1] * cos + q[0] * sin, q[2] * cos + q[3] * sin, q[3] * cos - q[2] * sin];
    let wrong = text.replace(&mount, &turned.map(|x| format!("{x}")).join(", "));
    place.write("ring/rig.toml", wrong.as_bytes());
    let (joint, _) = run(&place, &[], 0);
    assert!(joint.iter().all(|row| cell(row, "status") == "ok" && cell(row, "heads_excluded") == "right"), "{joint:?}");
    let [start, first, second, ..] = wrong.split("[[head]]").collect::<Vec<_>>()[..] else { panic!("{wrong}") };
    place.write("ring/rig.toml", format!("{start}[[head]]{first}[[head]]{second}").as_bytes());
    let (joint, _) = run(&place, &[], 0);
    let refused = |row: &Vec<(String, String)>| {
        cell(row, "status") == "rejected"
            && cell(row, "detail").starts_with("inconsistent")
            && cell(row, "axis_x").is_empty()
    };
    assert!(joint.iter().all(refused), "{joint:?}");
    let ran = place.run(&["run", "ring/rig.toml", "-o", "two.csv"]).expect(0);
    // There is no other answer that could be doubtful.
    assert!(!ran.err.contains("far more often than by chance"), "{}", ran.err);
    ran.says("note: 4 epochs rejected as inconsistent: the heads contradict each other");
}

#[test]
fn errors_name_the_head_and_no_input_is_an_output() {
    let place = ring();
    place
        .run(&["run", "ring/rig.toml", "--overlay", "drawn"])
        .expect(2)
        .says("--overlay is not possible with a rig.toml");
    for read in ["ring/rig.toml", "ring/frames.csv", "ring/left/frames.csv", "ring/left/sensor.toml"] {
        fs::hard_link(place.path(read), place.path("same.csv")).unwrap();
        place.run(&["run", "ring/rig.toml", "-o", "same.csv", "--force"]).expect(2).says("is the input");
        fs::remove_file(place.path("same.csv")).unwrap();
    }
    let text = place.read("ring/rig.toml");
    place.write("ring/rig.toml", text.replace("sync_s", "sinc_s").as_bytes());
    place.run(&["run", "ring/rig.toml"]).expect(2).says("[rig] sinc_s: unknown key; did you mean sync_s?");
    place.write("ring/rig.toml", text.as_bytes());
    let sensor = place.read("ring/back/sensor.toml");
    place.write("ring/back/sensor.toml", sensor.replace("kind = \"earth\"", "kind = \"eart\"").as_bytes());
    place.run(&["run", "ring/rig.toml"]).expect(2).says("head back: ring/back/sensor.toml");
    place.write("ring/back/sensor.toml", sensor.as_bytes());
    fs::remove_dir_all(place.path("ring/right")).unwrap();
    place.run(&["run", "ring/rig.toml"]).expect(2).says("head right: ");
}

/// Changes the cells of a column of a table: `change` gets the row's number and the cell.
fn edit(place: &Place, path: &str, column: &str, change: impl Fn(usize, &str) -> String) {
    let text = place.read(path);
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let k = header.split(',').position(|name| name == column).unwrap();
    let mut out = format!("{header}\n");
    for (i, line) in lines.enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[k] = change(i, &cells[k]);
        out.push_str(&(cells.join(",") + "\n"));
    }
    place.write(path, out.as_bytes());
}

fn shifted(cell: &str, by: f64) -> String {
    format!("{}", cell.parse::<f64>().unwrap() + by)
}

#[test]
fn pictures_without_times_are_not_paired_by_their_count() {
    let place = ring();
    fs::remove_file(place.path("ring/left/frames.csv")).unwrap();
    fs::remove_file(place.path("ring/left/left-00001.png")).unwrap();
    let says = "head left: the pictures have no times, which a rig needs to pair them; give a frames.csv with time_s";
    place.run(&["run", "ring/rig.toml", "-o", "out.csv"]).expect(2).says(says);
    assert!(!place.path("out.csv").exists() && !place.path("out.csv.part").exists());
}

#[test]
fn a_vehicle_table_with_another_clock_is_told() {
    let place = ring();
    edit(&place, "ring/frames.csv", "time_s", |_, cell| shifted(cell, 0.4));
    let ran = place.run(&["run", "ring/rig.toml", "-q"]).expect(3);
    ran.says("16 pictures of the heads front, right, back, left had no row in ring/frames.csv at most 0.1 s away")
        .says("the smallest distance is 0.400 s")
        .says("of 16 pictures: 16 without an altitude, not processed");
    // One row that fits is used.
    edit(&place, "ring/frames.csv", "time_s", |i, cell| shifted(cell, if i == 2 { -0.45 } else { 0.0 }));
    let ran = place.run(&["run", "ring/rig.toml", "-q"]).expect(3);
    ran.says("12 pictures of the heads");
}

#[test]
fn a_time_out_of_order_costs_only_the_pair_of_its_picture() {
    let place = ring();
    let (good, _) = run(&place, &[], 0);
    let table = place.read("ring/left/frames.csv");
    let end: f64 = table.lines().nth(4).unwrap().split(',').nth(1).unwrap().parse().unwrap();
    // A time that is too early at the end and between others, and one that is far too late.
    for (row, time_s) in [(3, 0.5 * end), (2, 1.0), (1, 10.0 * end), (0, 20.0 * end)] {
        place.write("ring/left/frames.csv", table.as_bytes());
        edit(
            &place,
            "ring/left/frames.csv",
            "time_s",
            |i, cell| if i == row { time_s.to_string() } else { cell.into() },
        );
        let ran = place.run(&["run", "ring/rig.toml", "-o", "out.csv", "--force"]).expect(3);
        ran.says("head left: 1 picture out of the order of time, first left-0000")
            .says("such a picture is paired with none");
        let rows = place.rows("out.csv");
        let joint: Vec<_> = rows.iter().filter(|row| cell(row, "head") == "rig").collect();
        assert_eq!((joint.len(), rows.len()), (5, 16 + 5));
        let full = joint.iter().filter(|row| cell(row, "heads_used") == "front right back left").count();
        assert_eq!(full, 3, "{row}");
        let same = |row: &&Vec<(String, String)>| good.iter().any(|other| cell(other, "axis_x") == cell(row, "axis_x"));
        assert_eq!(joint.iter().filter(|row| same(row)).count(), 3);
    }
}

#[test]
fn a_head_without_a_half_angle_of_its_own_is_refused() {
    let place = ring();
    let sensor = place.read("ring/back/sensor.toml");
    let fit = if sensor.contains("[fit]") {
        sensor.replace("[fit]", "[fit]\nhalf_angle = \"known\"")
    } else {
        format!("{sensor}\n[fit]\nhalf_angle = \"known\"\n")
    };
    place.write("ring/back/sensor.toml", fit.as_bytes());
    place.run(&["run", "ring/rig.toml"]).expect(2).says("head back: fit.half_angle is \"known\"");
    // One head alone needs no half-angle of its own.
    let text = place.read("ring/rig.toml");
    let parts: Vec<&str> = text.split("[[head]]").collect();
    place.write("ring/rig.toml", format!("{}[[head]]{}", parts[0], parts[3]).as_bytes());
    let (joint, _) = run(&place, &[], 0);
    assert!(joint.iter().all(|row| cell(row, "heads_used") == "back"));
}

#[test]
fn a_heads_own_rate_turns_its_answer_to_the_time_of_the_epoch() {
    let place = ring();
    // The pictures of a head are 0.08 s after those of the others, on a vehicle that turns about its z axis.
    edit(&place, "ring/left/frames.csv", "time_s", |_, cell| shifted(cell, 0.08));
    let still = place.read("ring/frames.csv");
    fs::remove_file(place.path("ring/frames.csv")).unwrap();
    let (without, _) = run(&place, &[], 0);
    // The vehicle turns at 0.02 rad/s about its x axis.
    place.write("ring/frames.csv", still.as_bytes());
    let (untold, _) = run(&place, &[], 0);
    for (column, rate) in [("rate_x", "0.02"), ("rate_y", "0"), ("rate_z", "0")] {
        edit(&place, "ring/frames.csv", column, |_, _| rate.to_owned());
    }
    let (told, _) = run(&place, &[], 0);
    // The same rate in the axes of each camera, which its mount gives.
    fs::remove_file(place.path("ring/frames.csv")).unwrap();
    let text = place.read("ring/rig.toml");
    for (k, head) in HEADS.iter().enumerate() {
        let mount = text.split("q_rig_from_camera_wxyz = [").nth(k + 1).unwrap().split(']').next().unwrap();
        let q: Vec<f64> = mount.split(',').map(|x| x.trim().parse().unwrap()).collect();
        let [w, x, y, z] = [q[0], q[1], q[2], q[3]];
        // The first row of the rotation from the camera to the vehicle.
        let own = [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)];
        for (column, part) in ["rate_x", "rate_y", "rate_z"].into_iter().zip(own) {
            edit(&place, &format!("ring/{head}/frames.csv"), column, |_, _| format!("{}", 0.02 * part));
        }
    }
    let (own, _) = run(&place, &[], 0);
    let axis = |row: &Vec<(String, String)>| {
        ["axis_x", "axis_y", "axis_z"].map(|name| cell(row, name).parse::<f64>().unwrap())
    };
    // The tables of the heads and of the vehicle give slightly different answers, but both rates turn them alike.
    let moved = |to: &Rows, from: &Rows, n: usize| {
        let (to, from) = (axis(&to[n]), axis(&from[n]));
        [0, 1, 2].map(|i| to[i] - from[i])
    };
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    for n in 0..4 {
        let (own, told) = (moved(&own, &without, n), moved(&told, &untold, n));
        let away = length([0, 1, 2].map(|i| own[i] - told[i]));
        assert!(length(own) > 1e-4 && away < 0.05 * length(own), "{own:?} {told:?}");
    }
}

#[test]
fn the_truth_of_another_frame_is_refused_with_the_right_command() {
    let place = ring();
    place.run(&["run", "ring/rig.toml", "-o", "out.csv", "-q"]).expect(0);
    let refused = |args: &[&str], why: &str| {
        place.run(&[&["evaluate", "out.csv", "--truth"], args].concat()).expect(2).says(why);
    };
    refused(
        &["ring/front"],
        "this is the truth of the head front, and the joint answers are in the frame of the vehicle",
    );
    refused(&["ring/front"], "give --head front, or --truth ring/front/..");
    refused(&["ring", "--head", "front"], "not of the head front: give --truth ring/front");
    refused(&["ring/front", "--head", "left"], "this is the truth of the head front, not of left: give --head front");
    let told = place.run(&["evaluate", "out.csv", "--truth", "ring"]).expect(0);
    assert!(!told.err.contains("of another sequence"), "{}", told.err);
    place.run(&["evaluate", "out.csv", "--truth", "ring/front", "--head", "front"]).expect(0);
    // The truth of a later flight has the same names.
    let later = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[1] = cells[1].parse::<f64>().map_or(cells[1].clone(), |t| (t + 1e6).to_string());
        cells.join(",") + "\n"
    };
    let late: String = place.read("ring/truth.csv").lines().map(later).collect();
    place.write("late.csv", late.as_bytes());
    place.run(&["evaluate", "out.csv", "--truth", "late.csv"]).expect(0).says("this is the truth of another sequence");
}

#[test]
fn the_time_is_that_of_the_heads_that_are_used() {
    let place = ring();
    // The mount of the last head is wrong by 10 degrees about x, and its pictures are 0.06 s late.
    let text = place.read("ring/rig.toml");
    let (start, last) = text.rsplit_once("q_rig_from_camera_wxyz = ").unwrap();
    let (right, end) = last.split_once('\n').unwrap();
    assert!(right.starts_with("[0.82903757"), "{right}");
    let half = 39f64.to_radians();
    let wrong = format!("{start}q_rig_from_camera_wxyz = [{}, {}, 0.0, 0.0]\n{end}", half.cos(), half.sin());
    place.write("ring/rig.toml", wrong.as_bytes());
    let late = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(time_s) = cells[1].parse::<f64>() {
            cells[1] = (time_s + 0.06).to_string();
            cells[2].clear();
        }
        cells.join(",") + "\n"
    };
    let table: String = place.read("ring/left/frames.csv").lines().map(late).collect();
    place.write("ring/left/frames.csv", table.as_bytes());
    let (joint, heads) = run(&place, &[], 0);
    let own: Vec<&str> =
        heads.iter().filter(|row| cell(row, "head") == "front").map(|row| cell(row, "time_s")).collect();
    let mut excluded = 0;
    for (row, own) in joint.iter().zip(own) {
        if cell(row, "heads_used") == "front right back" {
            excluded += 1;
            assert_eq!(cell(row, "time_s"), own, "{row:?}");
        }
    }
    assert!(excluded > 0, "{joint:?}");
}

#[test]
fn the_heads_of_an_epoch_are_explained_with_their_joint_answer() {
    let place = ring();
    let out = place.run(&["explain", "ring/rig.toml", "--index", "2", "--overlay", "o.png"]).expect(0).out;
    for head in HEADS {
        let text = out.split(&format!("head {head}\n")).nth(1).unwrap();
        assert!(text.contains(&format!("{head}-00002.png")) && text.contains("contour"), "{text}");
    }
    assert!(out.contains("rig: ok") && out.contains("used: front right back left"), "{out}");
    // The joint answer is that of the run, which also knows the epochs before.
    let (joint, _) = run(&place, &[], 0);
    let number = |name: &str| cell(&joint[2], name).parse::<f64>().unwrap();
    let [x, y, z] = ["axis_x", "axis_y", "axis_z"].map(number);
    assert!(out.contains(&format!("{x:+.6} {y:+.6} {z:+.6} in the axes of the vehicle")), "{out}");
    assert!(out.contains(&format!("the limit is {:.4} deg", number("separation_limit_deg"))), "{out}");
    // Two pictures of 320 x 240 lie side by side, and two below them; each has its caption below it.
    let drawn = image::open(place.path("o.png")).unwrap();
    assert_eq!((drawn.width(), drawn.height()), (648, 704));
    place.run(&["explain", "ring/rig.toml", "--index", "4"]).expect(2).says("the rig has 4 epochs, numbered from 0");
    place.run(&["explain", "ring/rig.toml", "--overlay", "o.png"]).expect(2).says("--force replaces it");
    let input = ["explain", "ring/rig.toml", "--overlay", "ring/left/left-00000.png", "--force"];
    place.run(&input).expect(2).says("is the input itself");
    place
        .run(&["explain", "ring/rig.toml", "--sensor", "ring/left/sensor.toml"])
        .expect(2)
        .says("write it into rig.toml");
}
