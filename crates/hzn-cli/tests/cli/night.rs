//! Pictures of the night side with `body.night`.

use crate::common::{Place, angle_deg, axes, cell, without_time};

const SENSOR: &str = "[camera]\nwidth = 480\nheight = 360\nmodel = \"pinhole\"\nfx_px = 700.0\nfy_px = 700.0\n\
                      cx_px = 239.5\ncy_px = 179.5\n[input]\ntone = \"linear\"\n[body]\nkind = \"earth-sphere\"\n";
/// Distance of the camera from the centre of the Earth, km, and angle from the optical axis down to the Earth.
const DISTANCE_KM: f64 = 6771.0088;
const DOWN_DEG: f64 = 72.0;

/// What the picture shows below the sky.
#[derive(Clone, Copy, PartialEq)]
enum Shown {
    /// A layer with its peak at 97 km, 5 km thick, above ground of this brightness.
    Layer(f64),
    /// The same layer above dark ground, but it ends within the picture, as a line of cities does.
    Ends,
    /// The same layer with light that is different from place to place.
    Uneven,
    /// A line of cities as high as the layer: bright without a gap, on ground that is equally dark on both sides.
    Line,
    /// A disc without structure, whose edge has the height of the airglow.
    Disc,
    /// A disc whose edge has the height of the limb by day.
    Day,
}

/// Returns the light along a line of sight with this tangent height.
fn light(tangent_km: f64, shown: Shown) -> f64 {
    let disc = |top_km: f64| f64::from(u8::from(tangent_km < top_km)) * 0.5;
    let ground = match shown {
        Shown::Layer(ground) => ground,
        Shown::Ends | Shown::Uneven => 0.01,
        Shown::Line => return 0.04 + 0.6 * (-((tangent_km - 90.0) / 14.0).powi(2)).exp(),
        Shown::Disc => return disc(102.0),
        Shown::Day => return disc(17.0),
    };
    let emission = |height_km: f64| {
        let z = (height_km - 97.0) / 5.0;
        (1.0 - z - (-z).exp()).exp()
    };
    let way = |km: i32| (6371.0 + tangent_km).hypot(f64::from(km)) - 6371.0;
    // Behind the ground no light is seen: half of the line is left.
    let glow = (0..1600).map(|km| emission(way(km))).sum::<f64>() / 1000.0;
    if tangent_km < 0.0 { glow * 0.5 + ground } else { glow }
}

/// Returns the part of the light that is left in a column of the picture.
fn left(x: u32, shown: Shown) -> f64 {
    match shown {
        Shown::Ends if x < 90 => 0.0,
        Shown::Uneven => 0.6 + 0.4 * (f64::from(x) / 6.0).sin(),
        _ => 1.0,
    }
}

/// Renders a picture, and writes it with a time at this place.
fn place(shown: Shown, utc: &str, keys: &str) -> Place {
    place_with_lens(shown, 700.0, utc, keys)
}

/// Does the same for a focal length in pixels.
fn place_with_lens(shown: Shown, focal_px: f64, utc: &str, keys: &str) -> Place {
    let place = Place::new();
    let profile: Vec<f64> = (-800..300).map(|km| light(f64::from(km), shown)).collect();
    let (sin, cos) = DOWN_DEG.to_radians().sin_cos();
    let pixel = |x: u32, y: u32| {
        let [u, v] = [(f64::from(x) - 239.5) / focal_px, (f64::from(y) - 179.5) / focal_px];
        let along = (v * sin + cos) / (u * u + v * v + 1.0).sqrt();
        let tangent_km = DISTANCE_KM * (1.0 - along * along).sqrt() - 6371.0088;
        let at = tangent_km.clamp(-799.0, 298.0) + 800.0;
        let (k, part) = (at as usize, at.fract());
        let brightness = profile[k] * (1.0 - part) + profile[k + 1] * part;
        image::Luma([(8.0 + 240.0 * (brightness * left(x, shown)).min(1.0)) as u8])
    };
    std::fs::create_dir_all(place.path("in")).unwrap();
    image::GrayImage::from_fn(480, 360, pixel).save(place.path("in/a.png")).unwrap();
    let sensor = SENSOR.replace("700.0", &format!("{focal_px:?}"));
    place.write("in/sensor.toml", format!("{sensor}{keys}").as_bytes());
    place.write("in/frames.csv", format!("file,utc,x_km,y_km,z_km\na.png,{utc},{DISTANCE_KM},0,0\n").as_bytes());
    place
}

const MIDNIGHT: &str = "2026-12-21T00:00:00Z";
const AIRGLOW: &str = "night = \"airglow\"\n";

#[test]
fn the_edge_of_the_airglow_is_answered_where_it_is_asked_for() {
    for ground in [0.01, 0.3] {
        let refused = place(Shown::Layer(ground), MIDNIGHT, "");
        let rows = without_time(&refused.run(&["run", "in"]).expect(0).out);
        assert_eq!(cell(&rows[0], "status"), "rejected");
        let answered = place(Shown::Layer(ground), MIDNIGHT, AIRGLOW);
        let rows = without_time(&answered.run(&["run", "in"]).expect(0).out);
        assert_eq!(["status", "detail", "p_limb"].map(|name| cell(&rows[0], name)), ["ok", "airglow", ""], "{ground}");
        let (sin, cos) = DOWN_DEG.to_radians().sin_cos();
        let error_deg = angle_deg(axes(&answered, &["run", "in"])[0], [0.0, sin, cos]);
        let sigma_deg: f64 = cell(&rows[0], "sigma_max_deg").parse().unwrap();
        assert!(error_deg < 0.06 && (0.05..0.3).contains(&sigma_deg), "{ground}: {error_deg} {sigma_deg}");
        let told = answered.run(&["explain", "in/a.png"]).expect(0).out;
        assert!(told.contains("outer edge of the airglow at 102."), "{told}");
        // The gate on the probability is about sunlit limbs.
        answered.write("in/sensor.toml", format!("{SENSOR}{AIRGLOW}[gates]\nmin_p_limb = 0.9\n").as_bytes());
        assert_eq!(cell(&without_time(&answered.run(&["run", "in"]).expect(0).out)[0], "status"), "ok");
    }
}

#[test]
fn an_edge_that_is_no_layer_is_refused_at_night() {
    let disc = place(Shown::Disc, MIDNIGHT, AIRGLOW);
    let rows = without_time(&disc.run(&["run", "in"]).expect(0).out);
    assert!(cell(&rows[0], "status") == "rejected" && cell(&rows[0], "detail").contains("layer"), "{rows:?}");
    let told = disc.run(&["explain", "in/a.png"]).expect(0).out;
    assert!(told.contains("the light below the edge does not become less"), "{told}");
    // By day, and without a time, the airglow is not looked for.
    for utc in ["2026-12-21T12:00:00Z", ""] {
        let day = place(Shown::Layer(0.01), utc, AIRGLOW);
        let told = day.run(&["explain", "in/a.png"]).expect(0).out;
        assert!(told.contains("limb at 17 +- 4.6 km") && !told.contains("airglow at"), "{told}");
    }
}

#[test]
fn airglow_is_only_for_the_earth_in_visible_light() {
    let thermal = place(Shown::Disc, MIDNIGHT, &format!("{AIRGLOW}limb = \"co2-15um\"\n"));
    thermal.run(&["run", "in"]).expect(2).says("airglow is for the Earth in visible light");
}

/// A long lens sees so little of the curvature that airglow would pass as well; only a time says that it is day.
#[test]
fn a_short_arc_without_a_time_has_a_note_about_airglow() {
    let noon = "2026-12-21T12:00:00Z";
    let told = |focal_px: f64, utc: &str, keys: &str| {
        let ran = place_with_lens(Shown::Day, focal_px, utc, keys).run(&["run", "in"]).expect(0);
        assert_eq!(cell(&without_time(&ran.out)[0], "status"), "ok", "{focal_px} {utc}");
        ran.err.contains("too short to tell the limb from the airglow")
    };
    assert!(told(4000.0, "", ""));
    for (focal_px, utc, keys) in [(4000.0, noon, ""), (300.0, "", ""), (4000.0, "", "sunlit = false\n")] {
        assert!(!told(focal_px, utc, keys), "{focal_px} {utc} {keys}");
    }
}

#[test]
fn a_line_of_cities_is_no_airglow() {
    for shown in [Shown::Ends, Shown::Uneven, Shown::Line] {
        let refused = place(shown, MIDNIGHT, AIRGLOW);
        let rows = without_time(&refused.run(&["run", "in"]).expect(0).out);
        assert_eq!(cell(&rows[0], "status"), "rejected", "{rows:?}");
    }
}
