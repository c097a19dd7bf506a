//! Reads camera files that other tools wrote, and writes them in every format.

use std::path::{Path, PathBuf};

use hzn_core::camera::{Config, Model};
use hzn_files::camera_file::{self, Choice, Foreign, Format, Loaded};

const FORMATS: [Format; 7] = [
    Format::Kalibr,
    Format::OpenCv,
    Format::OpenCvXml,
    Format::OpenCvJson,
    Format::Euroc,
    Format::Ros,
    Format::Foxglove,
];

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/camera_files").join(name)
}

fn load(name: &str) -> Config {
    camera_file::load(&path(name), None).unwrap_or_else(|e| panic!("{e}"))
}

/// Writes a lens in every format that has it, reads it back, and compares it to the last bit.
fn round_trips(camera: &Config) {
    for format in FORMATS {
        let Ok(text) = camera_file::write(camera, format) else { continue };
        let back = camera_file::parse(&text, Path::new("camera"), None).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let numbers = |c: &Config| (c.width, c.height, [c.fx_px, c.fy_px, c.cx_px, c.cy_px]);
        let k = |c: &Config| core::array::from_fn::<f64, 5, _>(|i| c.coefficient(i));
        assert_eq!((back.model, numbers(&back), k(&back)), (camera.model, numbers(camera), k(camera)), "{text}");
    }
}

#[test]
fn opencv_tells_its_lenses_by_word_or_shape() {
    for ending in ["yaml", "xml", "json"] {
        for kind in ["word", "shape"] {
            let fisheye = load(&format!("one-{kind}.{ending}"));
            assert_eq!((fisheye.model, fisheye.width, fisheye.height), (Model::KannalaBrandt, 640, 480));
            assert_eq!([fisheye.fx_px, fisheye.fy_px, fisheye.cx_px, fisheye.cy_px], [431.25, 430.0625, 321.5, 238.75]);
            assert_eq!(fisheye.k.as_slice(), [-0.0431, 0.0123, -0.0057, 1e-5]);
            round_trips(&fisheye);
            let plane = load(&format!("two-{kind}.{ending}"));
            assert_eq!(plane.model, Model::BrownConrady);
            assert_eq!(plane.k.as_slice(), [-0.3376, 0.1116, -0.000218, -3e-5, 0.02]);
            round_trips(&plane);
        }
    }
}

#[test]
fn a_word_is_stronger_than_the_shape() {
    let text = std::fs::read_to_string(path("one-word.xml")).unwrap();
    let text = text.replace("<fisheye_model>1<", "<fisheye_model>0<");
    assert_eq!(camera_file::parse(&text, Path::new("c.xml"), None).unwrap().model, Model::BrownConrady);
}

#[test]
fn foxglove_and_ros() {
    for name in ["foxglove-json.json", "foxglove-proto.json"] {
        assert_eq!(load(name), load("one-word.yaml"), "{name}");
    }
    let ros = load("camera_info_manager.yaml");
    assert_eq!([ros.fx_px, ros.fy_px, ros.cx_px, ros.cy_px], [1168.68, 1169.01, 295.015, 252.247]);
    assert_eq!(
        (ros.model, ros.k.as_slice()),
        (Model::BrownConrady, &[-1.04482, 1.59252, -0.0196308, 0.0287906, 0.0][..])
    );
    round_trips(&ros);
}

#[test]
fn kalibrs_example() {
    let first = load("kalibr.yaml");
    assert_eq!((first.model, first.fx_px, first.k.len()), (Model::BrownConrady, 461.629, 4));
    round_trips(&first);
    let refused = camera_file::load(&path("kalibr.yaml"), Some("cam1")).unwrap_err().to_string();
    assert!(refused.contains("omni with distortion is a lens that hzn does not have"), "{refused}");
    let omni = camera_file::load_any(&path("kalibr.yaml"), Choice { camera: Some("cam1"), size_px: None }).unwrap();
    assert!(matches!(omni.lens, Loaded::Foreign(Foreign::Omni(_))));
    // Without distortion it is an eucm to the last digits.
    let text = std::fs::read_to_string(path("kalibr.yaml")).unwrap();
    let plain = text.replace("[-0.33518750, 0.13211436, 0.00055967, 0.00057686]", "[0, 0, 0, 0]");
    let eucm = camera_file::parse(&plain, Path::new("k.yaml"), Some("cam1")).unwrap();
    assert_eq!((eucm.model, eucm.coefficient(1)), (Model::Eucm, 1.0));
    round_trips(&eucm);
}

#[test]
fn broken_files_are_named_with_the_place() {
    for name in ["one-shape.yaml", "one-shape.xml", "one-shape.json", "foxglove-json.json", "kalibr.yaml"] {
        let text = std::fs::read_to_string(path(name)).unwrap();
        // A file that ends early has no lens, or one with fewer keys; nothing panics.
        for end in (0..text.len()).step_by(7).filter(|end| text.is_char_boundary(*end)) {
            if let Err(problem) = camera_file::parse(&text[..end], Path::new("cut"), None) {
                assert!(problem.to_string().starts_with("cut"), "{problem}");
            }
        }
    }
    let read = |text: &str| camera_file::parse(text, Path::new("c.xml"), None).unwrap_err().to_string();
    assert!(read("<a><b>1</b></a>").contains("with the root <a>; OpenCV's XML has the root <opencv_storage>"));
    assert!(read("<opencv_storage>\n<K>\n").starts_with("c.xml:1:1: not valid XML"));
    let xml = std::fs::read_to_string(path("two-word.xml")).unwrap();
    assert!(read(&xml.replace("image_width", "columns")).contains("image_width: missing"));
    assert!(read(&xml.replace("431.25 0. 321.5", "431.25 2.5 321.5")).contains("camera_matrix: has a skew of 2.5 px"));
    assert!(
        read(&xml.replace("431.25 0. 321.5", "x 0. 321.5")).contains("camera_matrix: a 3x3 matrix of finite numbers")
    );
}
