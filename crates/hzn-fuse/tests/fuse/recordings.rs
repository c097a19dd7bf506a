//! What the filter takes from the results of `hzn run`.

use hzn_core::Config;
use hzn_core::camera::{Config as Camera, Model};
use hzn_core::status::Status;
use hzn_fuse::input::{Recording, recording};
use hzn_mcap::{Row, RowMeta};

/// A limb straight below, by a head of a rig, its joint answer, or a single camera.
fn row(index: u64, head: Option<&str>) -> Row {
    let meta = RowMeta {
        index,
        file: format!("{index}.png"),
        time_s: Some(index as f64),
        body: "earth".into(),
        altitude_km: Some(400.0),
    };
    let mut row = Row::unprocessed(&meta, Status::Ok, "");
    [row.axis_x, row.axis_y, row.axis_z] = [0.0, 0.0, 1.0].map(Some);
    [row.cov_xx, row.cov_xy, row.cov_xz] = [1e-6, 0.0, 0.0].map(Some);
    [row.cov_yy, row.cov_yz, row.cov_zz] = [1e-6, 0.0, 0.0].map(Some);
    // The heads of a rig have other common parts than its joint answer.
    let common = if head == Some("rig") { 4e-7 } else { 9e-7 };
    [row.cov_common_xx, row.cov_common_xy, row.cov_common_xz] = [common, 0.0, 0.0].map(Some);
    [row.cov_common_yy, row.cov_common_yz, row.cov_common_zz] = [common, 0.0, 0.0].map(Some);
    row.head = head.map(str::to_owned);
    row
}

#[test]
fn a_rig_is_one_sensor_in_the_axes_of_the_vehicle() {
    let rows = (0..3).flat_map(|i| [Some("left"), Some("right"), Some("rig")].map(|head| row(i, head))).collect();
    let rig = Recording::new("flight".into(), rows, None).unwrap();
    assert_eq!(rig.seen.len(), 3);
    assert!(rig.rows.iter().all(|row| row.head.as_deref() == Some("rig")));
    // Slow error and white noise.
    assert!(rig.seen.iter().all(|seen| {
        let [slow, white] = seen.largest_variances_rad2();
        (slow - 4e-7).abs() < 1e-18 && (white - 6e-7).abs() < 1e-18
    }));
    assert!(rig.mount.unwrap().into_inner().angle() < 1e-12);
    let heads = vec![row(0, Some("left"))];
    let why = Recording::new("flight".into(), heads, None).unwrap_err().to_string();
    assert!(why.contains("without its joint answers"), "{why}");
}

/// A table has no sensor.toml in it. The sigma of the limb height then comes from the one that was told.
#[test]
fn a_table_takes_the_limb_height_of_a_told_sensor() {
    let folder = tempfile::tempdir().unwrap();
    let [table, sensor] = ["cam.csv", "sensor.toml"].map(|name| folder.path().join(name));
    let mut out = csv::Writer::from_path(&table).unwrap();
    (0..3).for_each(|i| out.serialize(row(i, None)).unwrap());
    out.flush().unwrap();
    let mut config = Config::new(Camera::ideal(Model::Pinhole, 640, 480, 500.0));
    config.body.limb_height_sigma_km = 2.5;
    std::fs::write(&sensor, hzn_files::sensor::to_text(&config).unwrap()).unwrap();
    assert_eq!(recording(&table, None).unwrap().limb_sigma_km, None);
    let told = recording(&table, Some(&sensor)).unwrap();
    assert_eq!((told.limb_sigma_km, told.seen.len()), (Some(2.5), 3));
    assert!(told.camera.is_some());
}
