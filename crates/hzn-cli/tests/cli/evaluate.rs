//! `hzn evaluate` on a few pictures whose truth is known by construction.

use crate::common::{Place, SENSOR, assert_provenance};
use crate::dark::assert_drawings_are_readable;

const HEADER: &str = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,moon_x,\
                      moon_y,moon_z,qw,qx,qy,qz\n";

/// Returns a folder with the results and the truth of six pictures; the last picture is black.
fn place() -> Place {
    let place = Place::with_pictures(5);
    image::GrayImage::new(320, 240).save(place.path("in/black.png")).unwrap();
    let mut truth = HEADER.to_owned();
    let mut row = |file: &str, time: usize, limb: u8, shift: f64| {
        let (sin, cos) = (68.0 + 0.05 * shift).to_radians().sin_cos();
        truth.push_str(&format!("{file},{time},earth-sphere,{limb},0,{sin},{cos},70.38,400,,,,,,,1,0,0,0\n"));
    };
    (0..5).for_each(|i| row(&format!("{i:04}.png"), i, 1, i as f64));
    row("black.png", 5, 0, 0.0);
    place.write("in/truth.csv", truth.as_bytes());
    place.run(&["run", "in", "-o", "out.mcap", "-q"]).expect(0);
    place.run(&["export", "out.mcap", "-o", "out.csv"]).expect(0);
    place
}

#[test]
fn a_run_against_its_truth_as_text_json_and_page() {
    let place = place();
    let args = ["evaluate", "out.mcap", "--truth", "in/truth.csv", "-o", "r.json", "-o", "r.html"];
    let ran = place.run(&args).expect(0);
    for text in [
        "answered           5 of 5 pictures",
        "false answers      0 of 1 pictures",
        "in the picture",
        "HORACE criteria",
        "6.15 sigma; 0 of 5 errors are above it (0.00 % to 52.18 %, 95 %)",
        "above 1: misleading                     0         0",
    ] {
        assert!(ran.out.contains(text), "{text} in {}", ran.out);
    }
    // The folder of the truth is sufficient, and a table gives the same report as the recording.
    let again = place.run(&["evaluate", "out.csv", "--truth", "in"]).expect(0);
    assert_eq!(again.out, ran.out);

    let json: serde_json::Value = serde_json::from_str(&place.read("r.json")).unwrap();
    let e = &json["evaluations"][0];
    assert_eq!((e["with_limb"].as_u64(), e["answered"].as_u64()), (Some(5), Some(5)));
    let rms = e["errors"]["rms_deg"].as_f64().unwrap();
    assert!(rms > 0.0 && rms < 0.2, "{rms}");
    assert_eq!(json["frames"].as_array().unwrap().len(), 6);
    let ranges = e["integrity"]["ranges"].as_array().unwrap();
    assert_eq!(ranges.iter().map(|r| r["with_limb"].as_u64().unwrap()).sum::<u64>(), 5);

    let page = place.read("r.html");
    let command = "<code>hzn evaluate out.mcap --truth in/truth.csv -o r.json -o r.html</code>";
    assert!(page.contains(command));
    assert_provenance(&page, true, "hzn evaluate out.mcap");
    let facts: serde_json::Value =
        serde_json::from_str(&place.run(&["info", "out.mcap", "--json"]).expect(0).out).unwrap();
    let sensor = facts["sensor_hash"].as_str().unwrap();
    assert!(page.contains(&format!("sensor {sensor}, {command}")), "the sensor of the recording is named");
    assert!(page.contains("prefers-color-scheme:dark"), "the page has dark colours");
    assert!(assert_drawings_are_readable(&page) > 100);
    assert!(page.matches("<svg").count() >= 4 && page.contains("data:image/jpeg;base64,"));
    // The Stanford diagram as picture and table.
    for text in ["below the line: misleading", "<td>above 1: misleading</td><td>0</td><td>0</td>"] {
        assert!(page.contains(text), "{text}");
    }
    // The page loads nothing from elsewhere.
    assert!(!page.contains("src=\"http") && !page.contains("href") && !page.contains("@import"));
    place.run(&args).expect(2).says("r.json: exists already; --force replaces it");
}

#[test]
fn missed_and_false_answers_are_the_worst_frames() {
    let place = place();
    let truth = place.read("in/truth.csv");
    let lies = truth
        .replace("0001.png,1,earth-sphere,1", "0001.png,1,earth-sphere,0")
        .replace("black.png,5,earth-sphere,0", "black.png,5,earth-sphere,1");
    place.write("lies.csv", lies.as_bytes());
    let out = place
        .run(&["evaluate", "out.csv", "--truth", "lies.csv", "--worst", "2", "-s", "in/sensor.toml", "-o", "lies.html"])
        .expect(0)
        .out;
    assert!(out.contains("answered           4 of 5") && out.contains("false answers      1 of 1"), "{out}");
    let worst: Vec<&str> = out.lines().skip_while(|l| !l.starts_with("worst")).skip(1).collect();
    assert!(worst[0].contains("0001.png") && worst[0].contains("answered without a limb in view"), "{out}");
    assert!(worst[1].contains("black.png") && worst[1].contains("not answered: no-limb"), "{out}");
    assert_eq!(worst.len(), 2);
    // The charts mark the picture that shows the limb and has no answer.
    assert!(place.read("lies.html").contains("no answer (1)"));
    assert_drawings_are_readable(&place.read("lies.html"));
}

#[test]
fn what_does_not_fit_is_named() {
    let place = place();
    let truth = place.read("in/truth.csv");
    let against = |text: &str| {
        place.write("t.csv", text.as_bytes());
        place.run(&["evaluate", "out.csv", "--truth", "t.csv"]).expect(2)
    };
    against(&truth.replace("0003.png", "0009.png"))
        .says("t.csv does not match out.csv: 0003.png (earth-sphere) is among the results but has no row in the truth");
    against(&format!("{truth}more.png,6,earth-sphere,1,0,0,1,70,400,,,,,,,1,0,0,0\n"))
        .says("more.png (earth-sphere) has a row in the truth but none among the results");
    against(&truth.replace("earth-sphere", "moon")).says("the results are about earth-sphere, the truth about moon");
    // A sphere is any body whose radius sensor.toml tells, as `hzn init --body moon` writes it.
    let sensor = place.read("in/sensor.toml").replace("\"earth-sphere\"", "\"sphere\"\nradius_km = 6371.0");
    place.write("sphere.toml", sensor.as_bytes());
    place.run(&["run", "in", "-s", "sphere.toml", "-o", "sphere.csv", "-q"]);
    place.write("moon.csv", truth.replace("earth-sphere", "moon").as_bytes());
    place.run(&["evaluate", "sphere.csv", "--truth", "moon.csv"]).expect(0);
    place
        .run(&["evaluate", "sphere.csv", "--truth", "in"])
        .expect(2)
        .says("about sphere, the truth about earth-sphere");
    against(&truth.replace("70.38", "wide")).says("t.csv:2: half_angle_deg: invalid float literal");
    against(&truth.replace("axis_y", "axis")).says("t.csv:1: axis_y: this column is missing");
    against(&truth.replace("axis_y", "axis").replace("limb", "edge")).says("of which limb, axis_y are missing");
    against(HEADER).says("t.csv: has no rows");
    place.run(&["evaluate", "out.csv", "--truth", "nowhere.csv"]).expect(2).says("nowhere.csv: no such file");
    place.run(&["evaluate", "nothing.csv", "--truth", "in"]).expect(2).says("nothing.csv: no such file");
    place.run(&["evaluate", "in/0000.png", "--truth", "in"]).expect(2).says("results of `hzn run` are expected");
    place.run(&["evaluate", "out.csv", "--truth", "in", "-o", "r.pdf"]).expect(2).says("ends in .json or .html");
}

#[test]
fn other_times_and_a_missing_sensor_are_reported() {
    let place = place();
    let truth = place.read("in/truth.csv").replace("0002.png,2,", "0002.png,2.5,");
    place.write("t.csv", truth.as_bytes());
    let ran = place.run(&["evaluate", "out.csv", "--truth", "t.csv"]).expect(0);
    assert!(!ran.out.contains("limb in view [px]"), "{}", ran.out);
    ran.says("warning: 0002.png: at 2 s in the results, at 2.5 s in the truth")
        .says("note: no sensor.toml is available");
    place.write("bad.toml", SENSOR.replace("pinhole", "pinhol").as_bytes());
    place.run(&["evaluate", "out.csv", "--truth", "t.csv", "-s", "bad.toml"]).expect(2).says("did you mean pinhole");
}

#[test]
fn a_truth_of_directions_is_sufficient() {
    let place = place();
    let with_all = place.run(&["evaluate", "out.csv", "--truth", "in"]).expect(0).out;
    let names: Vec<&str> = HEADER.trim().split(',').collect();
    let keep = |name: &str| ["file", "body", "limb", "half_angle_deg"].contains(&name) || name.starts_with("axis_");
    let kept = |line: &str| {
        let cells = line.split(',').zip(&names).filter(|(_, name)| keep(name)).map(|(cell, _)| cell);
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    let few: String = place.read("in/truth.csv").lines().map(kept).collect();
    place.write("few.csv", few.as_bytes());
    let args =
        ["evaluate", "out.csv", "--truth", "few.csv", "-s", "in/sensor.toml", "-o", "few.json", "-o", "few.html"];
    let with_few = place.run(&args).expect(0).out;
    let numbers = |text: &str| text.lines().take_while(|line| !line.is_empty()).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(numbers(&with_few), numbers(&with_all));
    let json: serde_json::Value = serde_json::from_str(&place.read("few.json")).unwrap();
    assert!(json["frames"][0]["time_s"].is_null() && json["frames"][0]["altitude_km"].is_null());
    place.write("semicolons.csv", few.replace(',', ";").as_bytes());
    place
        .run(&["evaluate", "out.csv", "--truth", "semicolons.csv"])
        .expect(2)
        .says("columns are separated by commas here, not by semicolons");
}

#[test]
fn a_truth_of_another_convention_is_named() {
    let place = place();
    // Answers that differ, so that the conventions do.
    let truth = place.read("in/truth.csv");
    let told = |change: fn([f64; 3]) -> [f64; 3]| {
        let line = |line: &str| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            let axis = [4, 5, 6].map(|i| cells[i].parse::<f64>());
            if let [Ok(x), Ok(y), Ok(z)] = axis {
                for (i, value) in change([x, y, z]).iter().enumerate() {
                    cells[4 + i] = value.to_string();
                }
            }
            cells.join(",") + "\n"
        };
        place.write("t.csv", truth.lines().map(line).collect::<String>().as_bytes());
        place.run(&["evaluate", "out.csv", "--truth", "t.csv", "-s", "in/sensor.toml"]).expect(0).err
    };
    assert!(!told(|axis| axis).contains("as if"));
    let opposite = told(|axis| axis.map(|x| -x));
    assert!(opposite.contains("earth-sphere: the errors are as if the truth had the opposite sign"), "{opposite}");
    let mirrored = told(|[x, y, z]| [x, -y, z]);
    assert!(mirrored.contains("as if the y axis of the truth were mirrored"), "{mirrored}");
}

#[test]
fn other_files_are_named_with_the_command_that_reads_them() {
    let place = place();
    place.write("vehicle.csv", b"time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,qw,qx,qy,qz\n0,7e6,0,0,0,7e3,0,1,0,0,0\n");
    place
        .run(&["explain", "out.csv"])
        .expect(2)
        .says("out.csv: has results of hzn run, and a picture")
        .says("hzn info");
    place.run(&["run", "in/truth.csv"]).expect(2).says("has the truth of pictures (truth.csv)").says("hzn evaluate");
    let vehicle = "has the truth of a vehicle (vehicle.csv), and a file of results of hzn run is needed here";
    place.run(&["export", "vehicle.csv", "-o", "v.jsonl"]).expect(2).says(vehicle).says("hzn fuse --truth");
    place.run(&["evaluate", "vehicle.csv", "--truth", "nowhere.csv"]).expect(2).says(vehicle);
    place.run(&["evaluate", "in", "--truth", "nowhere.csv"]).expect(2).says("in: is a folder; results of `hzn run`");
    place.run(&["evaluate", "in/sensor.toml", "--truth", "nowhere.csv"]).expect(2).says("results of `hzn run` are");
    let described = place.run(&["info", "vehicle.csv"]).expect(0).out;
    assert!(
        described.contains("the truth of a vehicle") && described.contains("hzn fuse --truth reads it"),
        "{described}"
    );
}

/// A row that another program wrote is no answer if its numbers cannot be those of one.
#[test]
fn impossible_answers_are_refused_with_their_column() {
    let place = place();
    let table = place.read("out.csv");
    let columns: Vec<&str> = table.lines().next().unwrap().split(',').filter(|name| *name != "crc32").collect();
    let column = |name: &str| columns.iter().position(|n| *n == name).unwrap();
    let cases = [
        ("axis_x", "1e308", "axis_x, axis_y, axis_z are"),
        ("axis_x", "nan", "axis_x, axis_y, axis_z are NaN"),
        ("axis_z", "0.9", "axis_x, axis_y, axis_z are"),
        ("cov_xx", "-1", "cov_xx is -1, and a variance is a number that is not negative"),
        ("p_limb", "2", "p_limb is 2, and a probability is 0 to 1"),
        ("detail", "", ""),
    ];
    for (name, value, why) in cases {
        let row = |(number, line): (usize, &str)| {
            let mut cells: Vec<&str> = line.split(',').take(columns.len()).collect();
            if number == 2 {
                cells[column(name)] = value;
            }
            cells.join(",") + "\n"
        };
        let spoiled: String = table.lines().enumerate().map(row).collect();
        place.write("other.csv", spoiled.as_bytes());
        let args = ["evaluate", "other.csv", "--truth", "in"];
        if why.is_empty() {
            place.run(&args).expect(0);
        } else {
            place.run(&args).expect(2).says(why).says("other.csv:3: ");
        }
    }
}
