//! Writes the seeds of the corpora: one valid input of each kind, from which the fuzzer starts.
//!
//! `cargo run -p hzn-fuzz --example seeds`

use std::fs;
use std::io::Cursor;
use std::path::Path;

use hzn_flight::bytes::Writer;
use hzn_flight::messages::Housekeeping;
use hzn_flight::packet::{self, Apid};
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
        for (shape, pixels) in
            [("step", vec![10; 900]), ("noise", (0..900u32).map(|i| (i * i * 31 >> 3) as u8).collect())]
        {
            let mut bytes = vec![63, 0, 47, 0, preset % 4, 0, 60, preset, 0, 0, 0, 24, 0, 0, 1, 0, 1, 0, 0, 0];
            bytes.extend(&pixels);
            bytes.extend(vec![200u8; 900]);
            seeds.push((format!("picture/seed-{preset}-{shape}"), bytes.clone()));
            seeds.push((format!("rows/seed-{preset}-{shape}"), bytes));
        }
    }
    seeds
}

fn texts() -> Seeds {
    let mut seeds: Seeds = vec![
        ("sensor_toml/seed-template".into(), hzn_calib::template::SENSOR_TOML.replace("file", "fil").into()),
        (
            "sensor_toml/seed-small".into(),
            b"preset = \"moon\"\n[camera]\nwidth = 64\nheight = 48\nfx_px = 60\nfy_px = 60\ncx_px = 31.5\ncy_px = 23.5\n".into(),
        ),
        (
            "sensor_toml/seed-bodies".into(),
            b"[camera]\nwidth = 9\nheight = 9\nmodel = \"equidistant\"\nfx_px = 6\nfy_px = 6\ncx_px = 4\ncy_px = 4\n[[bodies]]\nkind = \"sun\"\n[[bodies]]\naltitude_km = 300\n[mask]\npolygons_px = [[[1, 2], [3, 4], [5, 1]]]\n".into(),
        ),
        (
            "frames_csv/seed-all".into(),
            b"file,time_s,utc,altitude_km,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg,sun_x,sun_y,sun_z,rate_x,rate_y,rate_z\na.png,1.5,2020-11-20T08:30:00Z,400,6778,0,0,1,0,0,0,5,0,0,1,0.1,0,0\nb.png,,,,,,,,,,,,,,,,,\n".into(),
        ),
        ("frames_csv/seed-few".into(), b"file,altitude_km\n\"a, \"\"b\"\".png\",230\nc,1e3\n# a comment\nd,\n".into()),
        ("frames_csv/seed-wrong".into(), b"name;altitude\na;1\n".into()),
    ];
    for (name, _, text) in hzn_sim::scenario::BUILTIN {
        seeds.push((format!("scene_toml/seed-{name}"), text.replace("file", "fil").into()));
    }
    let kalibr = "cam0:\n  camera_model: pinhole\n  intrinsics: [300.0, 301.0, 320.0, 240.0]\n  distortion_model: equidistant\n  distortion_coeffs: [0.01, 0.0, 0.0, 0.0]\n  resolution: [640, 480]\ncam1:\n  camera_model: ds\n  intrinsics: [-0.2, 0.6, 300, 300, 320, 240]\n  distortion_model: none\n  distortion_coeffs: []\n  resolution: [640, 480]\n";
    let opencv = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n  rows: 3\n  cols: 3\n  dt: d\n  data: [300., 0., 320., 0., 300., 240., 0., 0., 1.]\ndistortion_coefficients: !!opencv-matrix\n  rows: 1\n  cols: 5\n  dt: d\n  data: [0.1, 0., 0., 0., 0.]\n";
    let xml = "<?xml version=\"1.0\"?>\n<opencv_storage><image_width>64</image_width><image_height>48</image_height><camera_matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>60 0 32 0 60 24 0 0 1</data></camera_matrix></opencv_storage>\n";
    let json =
        "{\"image_width\": 64, \"image_height\": 48, \"camera_matrix\": [[60, 0, 32], [0, 60, 24], [0, 0, 1]]}\n";
    let cameras = [("kalibr", kalibr), ("opencv", opencv), ("xml", xml), ("json", json)];
    seeds.extend(cameras.map(|(name, text)| (format!("camera_file/seed-{name}"), text.into())));
    let tables = [
        (
            "imu",
            "time_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2,saturated\n0,0,0,0,0,0,9.8,0\n0.01,0,0,0.1,0,0,9.8,0\n",
        ),
        ("gnss", "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n0,6.4e6,0,0,0,0,0\n1,6.4e6,1,0,,,\n"),
        ("attitudes", "time_s,qw,qx,qy,qz,sigma_deg\n0,1,0,0,0,0.1\n"),
        (
            "truth",
            "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,qw,qx,qy,qz\na.png,0,earth,1,0,0,1,70,400,1,0,0,0\n",
        ),
        ("points", "file,u_px,v_px,azimuth_deg,elevation_deg\na,1,2,3,4\n"),
        ("fuse", "[imu]\n"),
    ];
    seeds.extend(
        (0..).zip(tables).map(|(which, (name, text))| kind(&format!("tables/seed-{name}"), which, text.as_bytes())),
    );
    seeds
}

fn files() -> Result<Seeds, Box<dyn std::error::Error>> {
    let mut seeds = Seeds::new();
    let picture = GrayImage::from_fn(32, 24, |x, y| Luma([if y > 10 { 200 } else { (x * 7 % 20) as u8 }]));
    let formats = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Tiff, ImageFormat::Pnm, ImageFormat::Bmp];
    for format in formats {
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
    let rows: Vec<_> = hzn_run::results::read(&path)?.0;
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
    let n = packet::write(&mut packet, Apid::Housekeeping, 1, 2, |w: &mut Writer<'_>| Housekeeping::default().write(w));
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
