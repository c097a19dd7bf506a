//! Tests `hzn run` on a recording of `hzn run`.

use crate::common::{Place, SENSOR, cell, without_time};

const TRUTH: &str = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,moon_x,\
                     moon_y,moon_z,qw,qx,qy,qz\n";

/// Returns a folder without a sensor.toml, with pictures and all columns of frames.csv recorded as `out.mcap`.
fn place() -> Place {
    let place = Place::with_pictures(4);
    let mut frames =
        "file,utc,altitude_km,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg,sun_x,sun_y,sun_z\n".to_owned();
    let mut truth = TRUTH.to_owned();
    for i in 0..4 {
        let (sin, cos) = (68.0 + 0.05 * f64::from(i)).to_radians().sin_cos();
        let place = if i % 2 == 0 {
            "390,,,,,,,,,,,"
        } else {
            ",6771.0088,0,0,0.694115,-0.134923,-0.134923,0.694115,0.5,0,-1,0"
        };
        frames.push_str(&format!("{i:04}.png,2020-11-20T08:30:0{i}Z,{place}\n"));
        truth.push_str(&format!(
            "{i:04}.png,{},earth-sphere,1,0,{sin},{cos},70.38,400,,,,,,,1,0,0,0\n",
            1_605_861_000 + i
        ));
    }
    place.write("in/frames.csv", frames.as_bytes());
    place.write("truth.csv", truth.as_bytes());
    place.run(&["run", "in", "-o", "out.mcap"]).expect(0);
    place.run(&["export", "out.mcap", "-o", "out.csv"]).expect(0);
    place
}

#[test]
fn a_recording_is_run_again_with_all_that_it_holds() {
    let place = place();
    place.run(&["run", "out.mcap", "-o", "again.mcap"]).expect(0).says("4 pictures: 4 ok");
    place.run(&["export", "again.mcap", "-o", "again.csv"]).expect(0);
    let rows = without_time(&place.read("out.csv"));
    assert_eq!((cell(&rows[0], "altitude_km"), &cell(&rows[1], "altitude_km")[..5]), ("390.0", "400.0"));
    assert_eq!(without_time(&place.read("again.csv")), rows);
    let evaluated = |results: &str| place.run(&["evaluate", results, "--truth", "truth.csv"]).expect(0).out;
    assert_eq!(evaluated("again.mcap"), evaluated("out.mcap"));
    // Options replace the recorded values.
    place.write("other.toml", SENSOR.replace("altitude_km = 400.0", "altitude_km = 410.0").as_bytes());
    place.write("other.csv", b"file,altitude_km\n0001.png,380\n0003.png,\n");
    let ran = place.run(&["run", "out.mcap", "-s", "other.toml", "--frames", "other.csv"]).expect(0);
    let altitudes = without_time(&ran.out).iter().map(|r| cell(r, "altitude_km").to_owned()).collect::<Vec<_>>();
    assert_eq!(altitudes, ["410.0", "380.0", "410.0", "410.0"]);
    // One picture of the recording is explained by its number.
    let told = place.run(&["explain", "out.mcap", "--index", "1"]).expect(0).out;
    assert!(told.contains("0001.png: 320 x 240") && told.contains("position at 400.00 km given with"), "{told}");
}

#[test]
fn several_bodies_are_one_frame() {
    let place = place();
    let bodies = SENSOR.replace("[body]", "[[bodies]]") + "\n[[bodies]]\nkind = \"moon\"\n";
    place.write("two.toml", bodies.as_bytes());
    place.run(&["run", "in", "-s", "two.toml", "-o", "two.mcap"]).expect(0).says("4 pictures: ");
    place.run(&["run", "two.mcap", "-o", "again.csv"]).expect(0).says("4 pictures: ");
    place.run(&["export", "two.mcap", "-o", "two.csv"]).expect(0);
    assert_eq!(without_time(&place.read("again.csv")), without_time(&place.read("two.csv")));
}

#[test]
fn missing_content_of_a_recording_is_reported() {
    let place = place();
    place.run(&["run", "in", "-o", "bare.mcap", "--no-images"]).expect(0);
    place.run(&["run", "bare.mcap"]).expect(2).says("contains results without their pictures");
    place.write("in/b-empty.png", b"");
    place.run(&["run", "in", "-o", "one.mcap"]).expect(3);
    let ran = place.run(&["run", "one.mcap"]).expect(3).says("the recording does not contain this picture");
    assert_eq!(cell(&without_time(&ran.out)[4], "file"), "b-empty.png");
    // The bytes of a picture in its chunk are damaged, so the picture is lost.
    let whole = std::fs::read(place.path("out.mcap")).unwrap();
    let picture = std::fs::read(place.path("in/0003.png")).unwrap();
    let at = whole.windows(picture.len()).position(|w| w == picture).unwrap();
    let mut damaged = whole.clone();
    damaged[at + 100] ^= 1;
    place.write("damaged.mcap", &damaged);
    place.run(&["run", "damaged.mcap"]).expect(3).says("1 damaged part was left out");
    place.write("cut.mcap", &whole[..at + picture.len() + 100]);
    place.run(&["run", "cut.mcap"]).expect(3).says("was cut off").says("no pictures");
}

#[test]
fn bytes_that_are_not_read_are_counted() {
    let place = place();
    let whole = std::fs::read(place.path("out.mcap")).unwrap();
    place.write("joined.mcap", &[&whole[..], &whole].concat());
    let rest = format!("the last {} bytes were not read", whole.len());
    place.run(&["info", "joined.mcap"]).expect(3).says(&rest);
    place.run(&["export", "joined.mcap", "-o", "joined.csv"]).expect(3).says(&rest);
    place.run(&["recover", "joined.mcap", "-o", "first.mcap"]).expect(0).says(&rest);
    // A hole costs the pictures that it touches, and none after it.
    let picture = std::fs::read(place.path("in/0000.png")).unwrap();
    let at = whole.windows(picture.len()).position(|w| w == picture).unwrap();
    place.write("holed.mcap", &[&whole[..at + 100], &whole[at + 110..]].concat());
    place.run(&["run", "out.mcap", "-o", "all.csv"]).expect(0);
    place.run(&["run", "holed.mcap", "-o", "some.csv"]).expect(3).says("1 damaged part was left out");
    let [all, some] = ["all.csv", "some.csv"].map(|name| place.read(name).lines().count());
    assert!(some + 1 >= all - 1, "{some} of {all}");
}

#[test]
fn an_incomplete_recording_is_reported_wherever_it_is_read() {
    let place = place();
    let whole = std::fs::read(place.path("out.mcap")).unwrap();
    let chunk = |picture: &str| {
        let picture = std::fs::read(place.path(&format!("in/{picture}.png"))).unwrap();
        whole.windows(picture.len()).position(|w| w == picture).unwrap()
    };
    place.write("early.mcap", &whole[..chunk("0000") + 100]);
    place.run(&["run", "early.mcap"]).expect(2).says("ends before its first picture is complete");
    let pictures = chunk("0003") + std::fs::metadata(place.path("in/0003.png")).unwrap().len() as usize;
    place.write("cut.mcap", &whole[..pictures + 100]);
    let mut damaged = whole.clone();
    damaged[chunk("0001") + 100] ^= 1;
    place.write("damaged.mcap", &damaged);
    for (name, what) in [("cut.mcap", "was cut off"), ("damaged.mcap", "1 damaged part was left out")] {
        let told = |args: &[&str]| {
            place.run(args).expect(3).says(&format!("warning: {name}: {what}"));
        };
        told(&["info", name]);
        told(&["run", name]);
        told(&["export", name, "-o", "rows.csv", "--force", "--images", &format!("{name}.pictures")]);
    }
    assert_eq!(
        place.rows("rows.csv").len(),
        place.rows("rows.csv").iter().filter(|r| cell(r, "status") == "ok").count()
    );
    place.run(&["info", "out.mcap"]).expect(0);
    place.run(&["export", "out.mcap", "-o", "rows.csv", "--force"]).expect(0);
    // A recording of another program has only pictures.
    let bare = |bytes: &[u8], name: &str| {
        // Without the name of our attachment, the recording is not one of ours.
        let mut bytes = bytes.to_vec();
        let at = bytes.windows(11).position(|w| w == b"sensor.toml").unwrap();
        bytes[at] = b'S';
        // The record's length is stored before it. Two times and a length precede the name; the checksum is the
        // record's end.
        let start = at - 20;
        let length = u64::from_le_bytes(bytes[start - 8..start].try_into().unwrap()) as usize;
        let checksum = crate::common::crc32(&bytes[start..start + length - 4]).to_le_bytes();
        bytes[start + length - 4..start + length].copy_from_slice(&checksum);
        place.write(name, &bytes);
    };
    bare(&whole, "theirs.mcap");
    place.run(&["run", "theirs.mcap", "-s", "in/sensor.toml"]).expect(0);
    bare(&whole[..pictures + 100], "theirs-cut.mcap");
    place
        .run(&["run", "theirs-cut.mcap", "-s", "in/sensor.toml"])
        .expect(3)
        .says("theirs-cut.mcap: was cut off; the pictures before that were processed");
}
