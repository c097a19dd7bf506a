//! Writes a small recording: `cargo run -p hzn-mcap --example sample -- out.mcap`.

use hzn_core::camera::{Config, Model};
use hzn_core::status::Status;
use hzn_mcap::{
    Annotations, EncodedImage, Error, FrameRecord, ImageFormat, LogLevel, LogLine, Options, Row, RowMeta, Writer,
};

fn main() -> Result<(), Error> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "sample.mcap".into());
    let options = Options {
        sensor_toml: "preset = \"hzn\"\n".into(),
        camera: Some(Config::ideal(Model::Equidistant, 64, 48, 40.0)),
        force: true,
        ..Options::default()
    };
    let mut writer = Writer::create(&path, &options)?;
    for i in 0..20u32 {
        let meta = RowMeta {
            index: i.into(),
            file: format!("{i:03}"),
            time_s: Some(f64::from(i) * 0.1),
            body: "earth".into(),
            altitude_km: Some(230.0),
        };
        let mut row = Row::unprocessed(&meta, Status::Unreadable, "");
        row.status = Status::Ok;
        (row.axis_x, row.axis_y, row.axis_z) = (Some(0.0), Some(0.6), Some(0.8));
        let limb: Vec<[f64; 2]> = (0..64).map(|x| [f64::from(x), 20.0 + f64::from(i) * 0.5]).collect();
        let mut frame = FrameRecord::new(row);
        frame.image = Some(EncodedImage {
            format: ImageFormat::Mono8 { width: 64, height: 48 },
            bytes: (0..64 * 48u32).map(|k| if k / 64 > 20 + i / 2 { 200 } else { 10 }).collect(),
        });
        frame.annotations =
            Annotations { inliers: limb.clone(), limb: vec![limb], axes: vec![[32.0, 40.0]], ..Annotations::default() };
        frame.log = vec![LogLine { level: LogLevel::Info, message: "a sample".into() }];
        writer.write(&frame)?;
    }
    println!("{}", writer.finish()?.display());
    Ok(())
}
