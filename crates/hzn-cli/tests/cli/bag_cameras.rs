//! The calibration of a bag's camera, for `hzn init`.

use std::path::Path;

use crate::common::ros::{self, CameraInfo, Logged, compressed_image};
use crate::common::{Place, limb};

const MATRIX: [f64; 9] = [301.5, 0.0, 160.25, 0.0, 302.5, 119.5, 0.0, 0.0, 1.0];
const DISTORTION: [f64; 5] = [-0.25, 0.0625, 1e-4, -2e-4, 0.0];

fn info() -> CameraInfo<'static> {
    CameraInfo {
        size: [320, 240],
        model: "plumb_bob",
        distortion: &DISTORTION,
        matrix: MATRIX,
        projection: [0.0; 9],
        binning: [0; 2],
        roi: [0; 4],
    }
}

/// Returns a picture of this width on a topic.
fn picture(topic: &'static str, width: u32) -> Logged<'static> {
    let data = compressed_image((5, 0), "cam", &ros::png(&limb(width, 240 * width / 320, 0.0)));
    (1, topic, "CompressedImage", data)
}

fn calibration<'a>(topic: &'a str, info: &CameraInfo<'_>) -> Logged<'a> {
    (1, topic, "CameraInfo", info.message())
}

/// Real pictures of a board with 9 × 6 inner corners.
const BOARDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/boards");

const FRONT: &str = "/front/image_raw/compressed";
const FRONT_INFO: &str = "/front/camera_info";

/// Runs `hzn init` on messages, and returns the camera that it wrote.
fn init(place: &Place, messages: &[Logged<'_>], options: &[&str], says: &str) -> hzn_core::camera::Config {
    ros::write(&place.path("a.mcap"), messages);
    let args = [&["init", "a.mcap", "--altitude", "400", "--force"], options].concat();
    place.run(&args).expect(0).says(says);
    hzn_files::sensor::load(&place.path("sensor.toml")).unwrap().config.camera
}

fn intrinsics(camera: &hzn_core::camera::Config) -> [f64; 4] {
    [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px]
}

#[test]
fn a_start_takes_the_calibration_of_a_bag() {
    let place = Place::new();
    let rear_matrix = [9.0, 0.0, 9.0, 0.0, 9.0, 9.0, 0.0, 0.0, 1.0];
    let rear = CameraInfo { model: "equidistant", distortion: &[0.0; 4], matrix: rear_matrix, ..info() };
    // The first calibration in the file is that of the other camera.
    let both = [picture(FRONT, 320), calibration("/rear/camera_info", &rear), picture(FRONT, 320)];
    let both = [&both[..], &[calibration(FRONT_INFO, &info())]].concat();
    let said = "320 x 240 px, brown-conrady, f = 301.5 px, from /front/camera_info";
    let camera = init(&place, &both, &[], said);
    assert_eq!(intrinsics(&camera), [301.5, 302.5, 160.25, 119.5]);
    assert_eq!((camera.coefficient(0), camera.coefficient(3)), (-0.25, -2e-4));
    place.run(&["run", "a.mcap", "-s", "sensor.toml"]).expect(0);
    // What the command line says about the lens, and what no camera has, is not taken from the bag.
    place.run(&["init", "a.mcap", "--fov", "56", "-o", "fov.toml"]).expect(0).says("56.0 degrees wide");
    let mut short = info().message();
    short.truncate(150);
    let of = |info: CameraInfo<'_>| info.message();
    for (info, what) in [
        (of(CameraInfo { matrix: [0.0; 9], ..info() }), "is all zeros: the camera is not calibrated"),
        (short, "/front/camera_info is not used: the message ends too early"),
    ] {
        ros::write(&place.path("b.mcap"), &[picture(FRONT, 320), (1, FRONT_INFO, "CameraInfo", info)]);
        place.run(&["init", "b.mcap", "-o", "b.toml"]).expect(2).says(what).says("add the field of view");
    }
}

#[test]
fn a_start_takes_the_camera_that_was_asked_for() {
    let place = Place::new();
    let rear = "/rear/image_raw/compressed";
    let rear_info =
        CameraInfo { size: [640, 480], matrix: MATRIX.map(|x| if x == 1.0 { x } else { 2.0 * x }), ..info() };
    let all = [
        picture(FRONT, 320),
        calibration(FRONT_INFO, &info()),
        picture(rear, 640),
        calibration("/rear/camera_info", &rear_info),
    ];
    let camera = init(&place, &all, &[], "from /front/camera_info");
    assert_eq!([camera.width, camera.height], [320, 240]);
    // The other camera is told before its first picture is read.
    let other = "other topics with pictures: /rear/image_raw/compressed";
    place.run(&["init", "a.mcap", "-o", "first.toml"]).expect(0).says(other);
    let camera =
        init(&place, &all, &["--topic", rear], "640 x 480 px, brown-conrady, f = 603.0 px, from /rear/camera_info");
    assert_eq!((intrinsics(&camera), camera.width), ([603.0, 605.0, 320.5, 239.0], 640));
    place.run(&["run", "a.mcap", "--topic", rear, "-s", "sensor.toml"]).expect(0);
    // The limb is that of the pictures of the topic, too.
    let camera = init(&place, &all, &["--topic", rear, "--fov", "56"], "640 x 480 px, pinhole, 56.0 degrees wide");
    assert_eq!(camera.width, 640);
    // The error is that of `hzn run`.
    let what = "a.mcap: no pictures on topic /left; there are some on /front/image_raw/compressed, \
                /rear/image_raw/compressed";
    let board = ["calibrate", "board", "a.mcap", "--board", "9x6", "--square-mm", "20"];
    place.write("tilt.csv", b"file,accel_x_mps2,accel_y_mps2,accel_z_mps2\na.mcap#000000,0,0,9.8\n");
    place.write("front.toml", crate::common::SENSOR.as_bytes());
    let of_board = ["--board", "9x6", "--lens", "front.toml", "--tilt", "tilt.csv"];
    let mount = [&["calibrate", "mount", "board", "a.mcap"][..], &of_board].concat();
    let commands = [&["init", "a.mcap", "-o", "none.toml"][..], &["run", "a.mcap", "-o", "none.csv"], &board, &mount];
    for command in commands {
        place.run(&[command, &["--topic", "/left"]].concat()).expect(2).says(what);
    }
    // Only the other camera sees a board, which has another size than the lens.
    let shown = image::open(Path::new(BOARDS).join("left01.jpg")).unwrap().into_luma8();
    let data = compressed_image((5, 0), "cam", &ros::png(&shown));
    ros::write(&place.path("a.mcap"), &[picture(FRONT, 320), (1, rear, "CompressedImage", data)]);
    let rear_size = "the pictures have 640 x 480 px, the lens 320 x 240";
    place.run(&[&mount[..], &["--topic", rear]].concat()).expect(2).says(rear_size);
    place.run(&mount).expect(1).says(other).says("no picture shows the board");
    place.run(&["init", "in", "--topic", rear]).expect(2).says("only an MCAP has topics");
    place.run(&["init", "--topic", rear]).expect(2);
    place.run(&["init", "--rig", "in", "in", "--topic", rear]).expect(2).says("--topic");
    // The calibration of the other camera is not taken.
    let one = [picture(rear, 640), picture(FRONT, 320), calibration(FRONT_INFO, &info())];
    ros::write(&place.path("a.mcap"), &one);
    let ran = place.run(&["init", "a.mcap", "--topic", rear, "-o", "none.toml"]).expect(2);
    assert!(!ran.err.contains("camera_info"), "{}", ran.err);
}

#[test]
fn binning_and_a_region_of_interest_are_those_of_the_pictures() {
    let place = Place::new();
    let whole = MATRIX.map(|x| if x == 1.0 { x } else { 4.0 * x });
    // Of 1280 x 1000 pixels, 640 x 480 are sent from (200, 100) on, two by two.
    let sent = CameraInfo { size: [1280, 1000], matrix: whole, binning: [2, 2], roi: [200, 100, 640, 480], ..info() };
    let messages = |info: &CameraInfo<'_>| [picture(FRONT, 320), (1, FRONT_INFO, "CameraInfo", info.message())];
    let camera = init(&place, &messages(&sent), &[], "320 x 240 px, brown-conrady, f = 603.0 px");
    assert_eq!(intrinsics(&camera), [603.0, 605.0, (641.0 - 200.0) / 2.0, (478.0 - 100.0) / 2.0]);
    // `hzn camera convert` reads the same message, as ROS prints it, and has the same lens.
    let echoed = format!(
        "height: 1000\nwidth: 1280\ndistortion_model: plumb_bob\nd: {DISTORTION:?}\nk: {whole:?}\nbinning_x: \
         2\nbinning_y: 2\nroi:\n  x_offset: 200\n  y_offset: 100\n  height: 480\n  width: 640\n"
    );
    place.write("info.yaml", echoed.as_bytes());
    place.run(&["camera", "convert", "info.yaml", "-o", "camera.toml"]).expect(0);
    let converted = hzn_files::sensor::parse(&place.read("camera.toml"), &place.path("camera.toml")).unwrap();
    assert_eq!(converted.config.camera, camera);
    // Binning alone, and a region alone.
    let binned = CameraInfo { size: [640, 480], binning: [2, 2], roi: [0; 4], ..sent };
    init(&place, &messages(&binned), &[], "320 x 240 px, brown-conrady, f = 603.0 px");
    let cut = CameraInfo { size: [640, 480], binning: [1, 0], roi: [10, 20, 320, 240], ..binned };
    let camera = init(&place, &messages(&cut), &[], "320 x 240 px, brown-conrady, f = 1206.0 px");
    assert_eq!([camera.cx_px, camera.cy_px], [631.0, 458.0]);
    // What does not fit names the fields.
    for (info, what) in [
        (
            CameraInfo { size: [640, 240], ..info() },
            "width 640, height 240 are for pictures of 640 x 240 px, and these",
        ),
        (
            CameraInfo { binning: [2, 2], ..info() },
            "width 320, height 240, binning_x 2, binning_y 2 are for pictures of 160 x 120 px, and these are 320 x 240",
        ),
        (
            CameraInfo { roi: [0, 40, 320, 200], ..info() },
            "width 320, height 240, roi.y_offset 40, roi.width 320, roi.height 200 are for pictures of 320 x 200 px",
        ),
    ] {
        ros::write(&place.path("b.mcap"), &messages(&info));
        let ran = place.run(&["init", "b.mcap", "--altitude", "400", "-o", "b.toml"]).expect(2);
        ran.says(what).says("ros2 topic echo --once").says("give --fov or --lens");
        assert!(!place.path("b.toml").exists());
    }
    let outside = CameraInfo { roi: [100, 0, 320, 240], ..info() };
    ros::write(&place.path("b.mcap"), &messages(&outside));
    let what = "is not used: roi.x_offset: 320 columns from 100 on do not lie in the whole picture, which has 320";
    place.run(&["init", "b.mcap", "-o", "b.toml"]).expect(2).says(what);
}

#[test]
fn rectified_pictures_have_the_lens_of_the_projection() {
    let place = Place::new();
    let projection = [290.0, 0.0, 158.0, 0.0, 291.0, 121.0, 0.0, 0.0, 1.0];
    let messages = [
        picture("/front/image_rect/compressed", 320),
        (1, FRONT_INFO, "CameraInfo", CameraInfo { projection, ..info() }.message()),
    ];
    let said = "pinhole, f = 290.0 px, from p of /front/camera_info (the pictures are rectified)";
    let camera = init(&place, &messages, &[], said);
    assert_eq!(intrinsics(&camera), [290.0, 291.0, 158.0, 121.0]);
}
