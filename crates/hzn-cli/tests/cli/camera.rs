//! `hzn camera`, through the binary.

use crate::common::Place;

#[test]
fn calibrations_of_other_tools_come_and_go() {
    let place = Place::new();
    let fisheye = crate::common::SENSOR.replace("\"pinhole\"", "\"kannala-brandt\"\nk = [0.01, 2e-5, -1e-6, 0.0]");
    place.write("a.toml", fisheye.as_bytes());
    let forms = [
        ("kalibr", "kalibr.yaml", "distortion_model: equidistant"),
        ("opencv", "opencv.yaml", "fisheye_model: 1"),
        ("opencv", "opencv.xml", "<fisheye_model>1</fisheye_model>"),
        ("opencv", "opencv.json", "\"fisheye_model\": 1"),
        ("euroc", "euroc.yaml", "sensor_type: camera"),
        ("ros", "ros.yaml", "distortion_model: equidistant"),
        ("foxglove", "foxglove.json", "\"distortion_model\": \"kannala_brandt\""),
    ];
    for (form, file, word) in forms {
        let ran = place.run(&["camera", "convert", "a.toml", "--to", form, "-o", file]).expect(0);
        ran.says("hzn camera show");
        assert!(place.read(file).contains(word), "{}", place.read(file));
        let back = place.run(&["camera", "convert", file]).expect(0).out;
        let straight = place.run(&["camera", "convert", "a.toml"]).expect(0).out;
        assert_eq!(back, straight);
        let refused = place.run(&["camera", "convert", "a.toml", "--to", form, "-o", file]);
        refused.expect(2).says("--force replaces it");
        place.run(&["camera", "show", file]).expect(0);
    }
    place.run(&["camera", "convert", "kalibr.yaml", "-o", "b.toml"]).expect(0);
    place.run(&["camera", "show", "b.toml"]).expect(0);
    place
        .run(&["camera", "convert", "kalibr.yaml", "-o", "b.yaml"])
        .expect(2)
        .says("--to kalibr, opencv, euroc, ros or foxglove");
    place.run(&["camera", "convert", "a.toml", "--to", "foxglove", "-o", "b.yaml"]).expect(2).says("ends in .json");
    place.run(&["camera", "convert", "kalibr.yaml", "--camera", "cam7"]).expect(2).says("did you mean cam0?");
    place.run(&["camera", "convert", "nowhere.yaml"]).expect(2).says("cannot be read");
}

#[test]
fn another_lens_is_fitted_over_the_picture() {
    let place = Place::new();
    let lens =
        crate::common::SENSOR.replace("\"pinhole\"", "\"double-sphere\"\nk = [-0.2, 0.55]\nfocal_sigma_percent = 0.2");
    place.write("ds.toml", lens.as_bytes());
    let refused = place.run(&["camera", "convert", "ds.toml", "--to", "opencv"]);
    refused.expect(2).says("OpenCV YAML cannot express the double sphere lens; --model fits");
    let ran = place.run(&["camera", "convert", "ds.toml", "--model", "kannala-brandt", "-o", "kb.toml"]).expect(0);
    ran.says("kannala-brandt fitted over the picture up to").says("maximum error 0.0");
    let written = place.read("kb.toml");
    assert!(written.contains("# kannala-brandt fitted") && written.contains("focal_sigma_percent = 0.2"), "{written}");
    place
        .run(&["camera", "convert", "kb.toml", "--to", "ros"])
        .expect(0)
        .says("focal_sigma_percent = 0.2 has no place");
    place.run(&["camera", "convert", "ds.toml", "--model", "fish"]).expect(2).says("the models are");
}

#[test]
fn a_map_of_the_picture() {
    let place = Place::new();
    place.write("a.toml", crate::common::SENSOR.as_bytes());
    place.run(&["camera", "show", "a.toml", "--picture", "map.jpg"]).expect(2).says("a map ends in .png");
    let plain = place.run(&["camera", "show", "a.toml"]).expect(0).out;
    assert_eq!(place.run(&["camera", "show", "a.toml", "--picture", "map.png"]).expect(0).out, plain);
    place.run(&["camera", "show", "a.toml", "--picture", "map.png"]).expect(2).says("exists already");
    let map = image::open(place.path("map.png")).unwrap().to_rgb8();
    // An ideal pinhole has the most degrees a pixel on its axis: the middle is yellow, the corner is dark blue.
    let sensor = hzn_files::sensor::parse(crate::common::SENSOR, std::path::Path::new("a.toml")).unwrap().config.camera;
    let scale = 1000.0 / f64::from(sensor.width.max(sensor.height));
    let at = |u: f64, v: f64| map.get_pixel((u * scale) as u32, 56 + (v * scale) as u32).0;
    assert!(at(2.0, 2.0)[1] < 40, "{:?}", at(2.0, 2.0));
    let near = at(sensor.cx_px + 8.0, sensor.cy_px + 8.0);
    assert!(near[0] > 200 && near[2] < 60, "{near:?}");
    // The last line says where the map comes from, in grey letters.
    let last = map.rows().skip(map.height() as usize - 36).flatten();
    let ink = last.filter(|p| p.0[0] > 90 && p.0[2] > p.0[0]).count();
    assert!(ink > 200, "{ink}");
}

#[test]
fn the_coefficients_of_braun_and_barf() {
    let place = Place::new();
    let lens = ["--size", "1920x1080", "--centre", "963.2,536.7", "--braun-barf"];
    let convert = |kappa: &str| place.run(&[&["camera", "convert"], &lens[..], &[kappa]].concat());
    let out = convert("1000,-55,11,-3.5,0.25").expect(0).out;
    assert!(out.contains("fx_px = 1000.0\n") && out.contains("k = [-0.055, 0.011, -0.0035, 0.00025]"), "{out}");
    convert("1000,-55").expect(2).says("5 numbers with commas");
    convert("-1,0,0,0,0").expect(2).says("above 0");
    convert("1000,-900,0,0,0").expect(2).says("monotone");
}

#[test]
fn the_farthest_corner_of_any_lens() {
    let place = Place::new();
    let corner = |sensor: &str| {
        place.write("c.toml", sensor.as_bytes());
        let shown = place.run(&["camera", "show", "c.toml"]).expect(0).out;
        let text = shown.split("farthest corner ").nth(1).unwrap().split(' ').next().unwrap().to_owned();
        let last = shown.trim_end().lines().last().unwrap().split_whitespace().next().unwrap().to_owned();
        assert_eq!(text, last, "{shown}");
        text.parse::<f64>().unwrap()
    };
    // The picture has 320 x 240 px, with a focal length of 300 px.
    let exact = (200.0f64 / 300.0).atan().to_degrees();
    assert!((corner(crate::common::SENSOR) - exact).abs() < 0.006);
    let brown = crate::common::SENSOR.replace("\"pinhole\"", "\"brown-conrady\"\nk = [0.0, 0.0, 0.0, 0.0, 0.0]");
    assert!((corner(&brown) - exact).abs() < 0.006);
}

#[test]
fn cameras_of_a_stereo_file_are_listed_and_chosen() {
    let place = Place::new();
    let matrix = |name: &str, f: f64| format!("{name}: [[{f}, 0, 320], [0, {f}, 240], [0, 0, 1]]\n");
    let k = |name: &str, k: &str| format!("{name}: [{k}]\n");
    let eight = "0.5, -2.6, 0, 0, 1.5, 0.4, -2.4, 1.4";
    let text = matrix("M1", 600.0) + &k("D1", "-0.1, 0, 0, 0, 0") + &matrix("M2", 610.0) + &k("D2", eight);
    place.write("intrinsics.yml", text.as_bytes());
    let convert = |more: &[&str]| place.run(&[&["camera", "convert", "intrinsics.yml"], more].concat());
    convert(&[]).expect(2).says("has the cameras 1, 2; choose one with --camera 1");
    convert(&["--camera", "1"]).expect(2).says("1.image_width: missing").says("--size WIDTHxHEIGHT");
    let out = convert(&["--camera", "1", "--size", "640x480"]).expect(0).out;
    assert!(out.contains("fx_px = 600.0") && out.contains("model = \"brown-conrady\""), "{out}");
    let second = ["--camera", "2", "--size", "640x480"];
    convert(&second).expect(2).says("OpenCV's lens with more than five coefficients").says("--model brown-conrady");
    let fitted = [&second[..], &["--model", "brown-conrady", "--end", "25", "-o", "two.toml"]].concat();
    convert(&fitted).expect(0).says("brown-conrady fitted over the picture up to").says("maximum error");
    assert!(place.read("two.toml").contains("theta_max_deg = "));
    place.write("sized.yml", format!("image_size: [640, 480]\nrms: 7.5\n{text}").as_bytes());
    place.run(&["camera", "show", "sized.yml"]).expect(2).says("has the cameras 1, 2");
    place.run(&["camera", "show", "sized.yml", "--camera", "1"]).expect(0).says("the reprojection error is 7.500 px");
    let other = ["camera", "convert", "sized.yml", "--camera", "1", "--size", "320x240"];
    place.run(&other).expect(2).says("sized.yml says 640x480; leave out --size");
    // A sensor.toml chooses a camera in the same way, and passes the doubt on.
    place.write("s.toml", b"preset = \"hzn\"\n[camera]\nfile = \"sized.yml\"\ncamera = \"1\"\n");
    place.run(&["camera", "show", "s.toml"]).expect(0);
    place.run(&["info", "s.toml"]).expect(0).says("the reprojection error is 7.500 px");
}
