//! Bad input to positions: each case is named with its limit, and no picture stops a run.

use crate::common::{Place, cell};

/// Jupiter in a picture of 64 pixels: a lit disc of 24 px across.
fn disc() -> image::GrayImage {
    image::GrayImage::from_fn(64, 64, |x, y| {
        let r = (f64::from(x) - 31.5).hypot(f64::from(y) - 31.5);
        image::Luma([(200.0 / (1.0 + ((r - 12.0) * 3.0).exp())) as u8 + 10])
    })
}

/// 24 px are 71 492 km at a million kilometres.
fn sensor(body: &str) -> String {
    format!(
        "[camera]\nwidth = 64\nheight = 64\nmodel = \"pinhole\"\nfx_px = 168\nfy_px = 168\ncx_px = 31.5\ncy_px = 31.5\n\
         [body]\n{body}\n"
    )
}

fn place(body: &str, pictures: &[(&str, image::GrayImage)]) -> Place {
    let place = Place::new();
    for (name, picture) in pictures {
        picture.save(place.path("in").join(name)).unwrap();
    }
    place.write("in/sensor.toml", sensor(body).as_bytes());
    place
}

#[test]
fn impossible_shapes_are_refused() {
    for (body, what) in [
        ("kind = \"ellipsoid\"\nradii_km = [71492, 0, 66854]", "radii_km: 0 is refused: must be above 0"),
        ("kind = \"ellipsoid\"\nradii_km = [71492, -1.5, 66854]", "radii_km: -1.5 is refused: must be above 0"),
        ("kind = \"ellipsoid\"\nradii_km = [71492, inf, 66854]", "radii_km: inf is refused: must be a finite number"),
        ("kind = \"ellipsoid\"\nradii_km = [71492, nan, 66854]", "radii_km: nan is refused: must be a finite number"),
        ("kind = \"ellipsoid\"", "an ellipsoid needs its three semi-axes in km"),
        ("kind = \"jupiter\"\nradii_km = [1, 1, 1]", "only body.kind = \"ellipsoid\" may have semi-axes"),
        ("kind = \"jupiter\"\nrange_km = 1e6", "body.range_km needs its 1-sigma in km"),
        ("kind = \"jupiter\"\nrange_km = -1\nrange_sigma_km = 1", "range_km: -1 is refused: must be above 0"),
    ] {
        let place = place(body, &[("a.png", disc())]);
        place.run(&["run", "in"]).expect(2).says(what);
    }
}

#[test]
fn an_impossible_frame_is_a_row_and_the_run_goes_on() {
    // Name, row, and what its message says.
    let cases = [
        ("good", "1,0,0,0,0.1,,,,1000000,50000,,,", "ok"),
        ("no-rotation", "2,0,0,0,0.1,,,,1000000,50000,,,", "the quaternion's length must be 1 within 0.01"),
        ("inside", "1,0,0,0,0.1,,,,60000,50,,,", "the camera is 60000 km from the centre, inside the body (66935 km)"),
        (
            "inside-by-position",
            "1,0,0,0,0.1,,,,,,0,0,-60000",
            "the camera is 60000 km from the centre, inside the body (66935 km)",
        ),
        ("small", "1,0,0,0,0.1,,,,4000000,50000,,,", "px wide at this distance; the smallest is 8 px"),
        (
            "contradiction",
            "1,0,0,0,0.1,,,,1000000,100,0,0,-900000",
            "range_km is 1000000 but x_km, y_km, z_km lie 900000 km from the centre; they may differ by 5 \
             range_sigma_km",
        ),
        ("no-sigma", "1,0,0,0,0.1,,,,1000000,,,,", "range_km needs range_sigma_km"),
        ("negative", "1,0,0,0,0.1,,,,-5,50,,,", "range_km must be a finite number above 0"),
        ("fills", "1,0,0,0,0.1,,,,,,0,0,-72000", "the body fills the picture: its limb, "),
        ("uniform", "1,0,0,0,0.1,,,,1000000,50000,,,", "the body fills the picture or is not in it"),
        ("last", "1,0,0,0,0.1,,,,1000000,50000,,,", "ok"),
    ];
    let pictures: Vec<_> = cases
        .iter()
        .map(|(name, ..)| {
            let grey = image::GrayImage::from_pixel(64, 64, image::Luma([180]));
            (format!("{name}.png"), if *name == "uniform" { grey } else { disc() })
        })
        .collect();
    let pictures: Vec<_> = pictures.iter().map(|(name, picture)| (name.as_str(), picture.clone())).collect();
    let place = place("kind = \"jupiter\"\nlimb_height_km = 81\nlimb_height_sigma_km = 81", &pictures);
    let mut frames = String::from(
        "file,qw,qx,qy,qz,attitude_sigma_deg,pole_x,pole_y,pole_z,range_km,range_sigma_km,x_km,y_km,z_km\n",
    );
    for (name, row, _) in &cases {
        frames.push_str(&format!("{name}.png,{row}\n"));
    }
    place.write("in/frames.csv", frames.as_bytes());
    // 3: the run finished, but some pictures were not processed.
    let ran = place.run(&["run", "in", "-o", "out.csv"]).expect(3);
    ran.says("8 with values that allow no search, not processed (status no-altitude); the first is");
    let rows = place.rows("out.csv");
    assert_eq!(rows.len(), cases.len());
    for (name, _, what) in &cases {
        let row = rows.iter().find(|row| cell(row, "file").ends_with(&format!("{name}.png"))).unwrap();
        let (status, detail) = (cell(row, "status"), cell(row, "detail"));
        let said = if *what == "ok" { status == "ok" } else { status != "ok" && detail.contains(what) };
        assert!(said, "{name}: {status}, {detail}");
        assert_eq!(cell(row, "position_x_km").is_empty(), *what != "ok", "{name}");
    }
}

#[test]
fn a_pole_orients_only_a_body_of_revolution() {
    let frames = b"file,pole_x,pole_y,pole_z,range_km,range_sigma_km\na.png,0,-1,0,1000000,50000\n";
    let tri_axial = place("kind = \"ellipsoid\"\nradii_km = [71492, 70000, 66854]", &[("a.png", disc())]);
    tri_axial.write("in/frames.csv", frames);
    tri_axial.run(&["run", "in", "-o", "out.csv"]).expect(3);
    let detail = &tri_axial.rows("out.csv")[0];
    assert!(cell(detail, "detail").contains("do not orient a body with three different radii"), "{detail:?}");
    // A pole for a body without a shape is not used, and a warning says what to do.
    let sphere = place("kind = \"sphere\"\nradius_km = 71492\naltitude_km = 900000", &[("a.png", disc())]);
    sphere.write("in/frames.csv", b"file,pole_x,pole_y,pole_z\na.png,0,-1,0\n");
    sphere.run(&["run", "in"]).expect(0).says("pole_x, pole_y, pole_z is used only for a position");
}
