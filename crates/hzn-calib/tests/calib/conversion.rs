//! Converts the lens of a camera file into another model.

use std::path::Path;

use hzn_calib::conversion;
use hzn_core::camera::{Camera, Model};
use hzn_files::camera_file;

#[test]
fn kalibrs_omni_lens_becomes_one_of_hzn() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/camera_files/kalibr.yaml");
    let omni = camera_file::load_any(&path, Some("cam1")).unwrap();
    let fitted = conversion::convert(&omni, Model::KannalaBrandt).unwrap();
    assert!(fitted.max_px < 1.0, "{fitted:?}");
    assert_eq!(fitted.camera.model, Model::KannalaBrandt);
    Camera::<f64>::try_new(&fitted.camera).unwrap();
}
