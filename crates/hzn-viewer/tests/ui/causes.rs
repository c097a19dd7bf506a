//! The diagnosis finds a wrong altitude and a wrong focal length in flights whose seeds occur nowhere else.

use std::fmt::Write as _;
use std::path::Path;

use egui_kittest::kittest::{NodeT, Queryable};
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_sim::Scenario;
use hzn_sim::flight::{Flight, rocket};
use hzn_viewer::model::cause::Reason;
use hzn_viewer::model::diagnosis::{self, Consensus, Suspect};

use super::window::{HEIGHT, WIDTH, Window, answer, folder, frame_view, settled, until, window_on};

/// A value of the sensor or of the priors that is changed.
#[derive(Debug, Clone, Copy)]
enum Wrong {
    /// All altitudes are higher by this many km.
    Altitude(f64),
    /// Both focal lengths are larger by this factor.
    Focal(f64),
    /// The threshold is this many times as high as Otsu's.
    Threshold(f64),
    /// The mask does not cover the payload.
    Unmasked,
}

const ALL: [Wrong; 6] = [
    Wrong::Altitude(-25.0),
    Wrong::Altitude(20.0),
    Wrong::Altitude(45.0),
    Wrong::Focal(0.85),
    Wrong::Focal(0.95),
    Wrong::Focal(1.1),
];

/// Writes the sensor and the priors with wrong values. Without positions, the altitude has no second source.
fn write(flight: &Flight, wrong: &[Wrong], folder: &Path) {
    let mut sensor = flight.sensor.clone();
    let mut shift_km = 0.0;
    for one in wrong {
        match one {
            Wrong::Altitude(km) => shift_km = *km,
            Wrong::Focal(factor) => {
                sensor.camera.fx_px *= factor;
                sensor.camera.fy_px *= factor;
            }
            Wrong::Threshold(scale) => sensor.threshold.scale = *scale,
            Wrong::Unmasked => sensor.mask.polygons_px.clear(),
        }
    }
    let mut table = "file,time_s,altitude_km\n".to_owned();
    for frame in &flight.frames {
        writeln!(table, "{},{},{}", frame.file, frame.time_s, frame.row().altitude_km + shift_km).unwrap();
    }
    std::fs::write(folder.join("frames.csv"), table).unwrap();
    std::fs::write(folder.join("sensor.toml"), hzn_files::sensor::to_text(&sensor).unwrap()).unwrap();
}

/// Returns what the frames say in the window, the best cause first.
fn consensus(folder: &Path, frames: usize) -> Vec<Consensus> {
    let mut window = window_on(folder);
    until(&mut window, "not processed", |v| v.processed() == frames && !v.is_working());
    diagnosis::summarise(window.state().results().fits(0))
}

/// Returns the number of flights that HZN_PAIRS asks for.
fn flights_or(few: u64) -> u64 {
    std::env::var("HZN_PAIRS").ok().and_then(|n| n.parse().ok()).unwrap_or(few)
}

#[test]
fn wrong_values_are_measured_in_new_flights() {
    let (mut altitude_km, mut focal) = (0.0f64, 0.0f64);
    for seed in 9201..9201 + flights_or(1) {
        let dir = tempfile::tempdir().unwrap();
        let flight = rocket(960, 540, 14, seed);
        flight.frames.iter().for_each(|f| f.render().unwrap().save(&dir.path().join(&f.file)).unwrap());
        for wrong in ALL {
            write(&flight, &[wrong], dir.path());
            let all = consensus(dir.path(), flight.frames.len());
            println!("seed {seed}, {wrong:?}");
            all.iter().for_each(|c| {
                println!("    {:?} {:.4} ± {:.4}, {:.2} σ", c.suspect, c.value, c.scatter, c.disagreement)
            });
            let of = |suspect| all.iter().find(|c| c.suspect == suspect).unwrap();
            match wrong {
                Wrong::Altitude(km) => altitude_km = altitude_km.max((of(Suspect::Altitude).value + km).abs()),
                Wrong::Focal(factor) => {
                    focal = focal.max((of(Suspect::Focal).value * factor - 1.0).abs());
                    assert_eq!(all[0].suspect, Suspect::Focal, "seed {seed}, {wrong:?}");
                }
                Wrong::Threshold(_) | Wrong::Unmasked => {}
            }
        }
    }
    println!("largest errors: altitude {altitude_km:.1} km, focal length {:.1} %", 100.0 * focal);
    assert!(altitude_km < 5.0 && focal < 0.02);
}

/// Number of clicks that may be needed for two wrong values.
const MOST_CLICKS: usize = 4;

/// Clicks on what the window offers first until it offers nothing. Returns the number of clicks.
fn click_cures(window: &mut Window) -> usize {
    for clicks in 0..MOST_CLICKS {
        window.run_steps(3);
        let cures = ["Use Otsu's threshold", "Apply both", "Mask this", "Apply focal length", "Try altitude"];
        let offered = |name: &&str| window.query_by_label(name).is_some_and(|b| !b.accesskit_node().is_disabled());
        let Some(cure) = cures.into_iter().find(offered) else { return clicks };
        println!("    {cure}");
        window.get_by_label(cure).click_accesskit();
        window.run_steps(2);
        until(window, "not processed again", |v| v.is_settled() && !v.is_working());
    }
    MOST_CLICKS
}

/// Renders a flight with wrong values, and shows a refused picture of it.
fn window_with(flight: &Flight, wrong: &[Wrong], folder: &Path) -> Window {
    flight.frames.iter().for_each(|f| f.render().unwrap().save(&folder.join(&f.file)).unwrap());
    write(flight, wrong, folder);
    let mut window = window_on(folder);
    until(&mut window, "not processed", |v| v.processed() == 14 && !v.is_working());
    // Any refused picture that shows a limb shows the same table.
    let refused = (0..14).find(|i| {
        let cause = window.state().results().cause(*i, 0);
        cause.is_some_and(|c| c.status != Status::Ok && c.reason.is_some())
    });
    window.state_mut().go(refused.unwrap_or(0));
    settled(&mut window);
    window.run_steps(3);
    window
}

/// Returns what is left of the wrong values: of the altitude in km, and of the focal length as a part.
fn left(window: &Window, flight: &Flight, km: f64) -> [f64; 2] {
    let focal_px = window.state().session().unwrap().number("camera", "fx_px", 0).unwrap();
    [km + window.state().sequence().altitude_shift_km, focal_px / flight.sensor.camera.fx_px - 1.0]
}

/// The cause hides the limb, or adds other edges: the list of what to do has both, and calls no limb another edge.
#[test]
fn a_wrong_lens_is_found_behind_another_fault() {
    let (mut mended, flights) = (0, flights_or(1));
    for seed in 9701..9701 + flights {
        let factor = [0.92, 1.06, 0.95, 1.09][(seed % 4) as usize];
        let km = [20.0, -25.0, 35.0][(seed % 3) as usize];
        let threshold = [Wrong::Threshold([2.6, 3.2][(seed % 2) as usize]), Wrong::Focal(factor)];
        let payload = [Wrong::Altitude(km), Wrong::Focal(factor), Wrong::Unmasked];
        for wrong in [&threshold[..], &payload[..]] {
            let dir = tempfile::tempdir().unwrap();
            let flight = rocket(960, 540, 14, seed);
            let is_masked = wrong.len() == 2;
            let flight = if is_masked { flight } else { flight.with_payload() };
            let mut window = window_with(&flight, wrong, dir.path());
            println!("seed {seed}, {wrong:?}");
            assert!(window.query_all_by_label_contains("probably not the limb").next().is_none(), "seed {seed}");
            if is_masked {
                let threshold = window.get_by_label_contains("1. Use Otsu's threshold of").rect();
                let lens = window.get_by_label_contains("2. ").rect();
                assert!(threshold.bottom() <= lens.top(), "what hides the rest comes first");
            }
            let clicks = click_cures(&mut window);
            let [km, part] = left(&window, &flight, if is_masked { 0.0 } else { km });
            println!("    {clicks} clicks leave {km:.1} km and {:.2} %", 100.0 * part);
            mended += u64::from(part.abs() < 0.01 && km.abs() < 3.0);
        }
    }
    println!("{mended} of {} flights are mended", 2 * flights);
    assert!(3 * mended >= 4 * flights, "{mended} of {}", 2 * flights);
}

/// Returns how many pictures that show a limb have words that call it another edge. The picture that was shown is shown
/// again.
fn wrong_advice(window: &mut Window, flight: &Flight) -> usize {
    let shown = frame_view(window).index;
    let mut count = 0;
    for (i, frame) in flight.frames.iter().enumerate() {
        window.state_mut().go(i);
        settled(window);
        window.run_steps(3);
        let says = window.query_all_by_label_contains("probably not the limb").next().is_some();
        count += usize::from(says && frame.truth().unwrap().limb == 1);
    }
    window.state_mut().go(shown);
    settled(window);
    window.run_steps(3);
    count
}

/// Returns errors of a flight that depend on its seed alone: of the altitude, 12 to 50 km up or down, and a factor of
/// the focal length from 0.90 to 0.97 or from 1.03 to 1.12.
fn errors_of(seed: u64) -> (f64, f64) {
    // SplitMix64: neighbouring seeds give unrelated numbers.
    let mut state = seed;
    let mut part = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let sign = if part() < 0.5 { -1.0 } else { 1.0 };
    let km = sign * (12.0 + 38.0 * part());
    let factor = 0.90 + 0.16 * part();
    (km, if factor > 0.97 { factor + 0.06 } else { factor })
}

/// Two values are wrong at once. HZN_PAIRS sets the number of flights.
#[test]
fn two_wrong_values_are_corrected_together() {
    let flights = flights_or(2);
    let first: u64 = std::env::var("HZN_FIRST_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(9501);
    let (mut mended, mut not_the_limb, mut inseparable) = (0, 0, 0);
    for seed in first..first + flights {
        let dir = tempfile::tempdir().unwrap();
        let flight = rocket(960, 540, 14, seed);
        let (km, factor) = errors_of(seed);
        let mut window = window_with(&flight, &[Wrong::Altitude(km), Wrong::Focal(factor)], dir.path());
        // The words stand only where the correlation says it.
        let (facts, limb_km) = (window.state().results().fits(0), flight.sensor.body.limb_height_km);
        let both = diagnosis::correlation(facts, limb_km, [Suspect::Altitude, Suspect::Focal]);
        let says =
            window.query_all_by_label_contains("altitude and focal length cannot be told apart").next().is_some();
        assert!(!says || both.is_some_and(|r| r.abs() > 0.95), "seed {seed}: {both:?}");
        inseparable += usize::from(says);
        let before = wrong_advice(&mut window, &flight);
        let clicks = click_cures(&mut window);
        let [left_km, left] = left(&window, &flight, km);
        let wrong = before + wrong_advice(&mut window, &flight);
        let is_mended = left.abs() < 0.01 && left_km.abs() < 3.0;
        println!(
            "seed {seed}: {km:.1} km, factor {factor:.3}: {clicks} clicks leave {left_km:.1} km and {:.2} %, wrong \
             advice in {wrong} pictures",
            100.0 * left
        );
        mended += usize::from(is_mended);
        not_the_limb += wrong;
    }
    println!("{mended} of {flights} flights are mended; in {not_the_limb} pictures the limb is called another edge");
    println!("{inseparable} times altitude and focal length are called inseparable");
    assert_eq!(not_the_limb, 0);
    assert!(3 * mended >= 2 * flights as usize, "{mended} of {flights}");
}

#[test]
fn a_refused_picture_has_the_table_also_if_a_cloud_is_longer_than_the_limb() {
    let dir = tempfile::tempdir().unwrap();
    let mut scenario = Scenario::builtin("rocket-clean").unwrap();
    scenario.capture.frames = 12;
    let mut flight = scenario.flight().unwrap();
    flight.frames.truncate(1);
    flight.frames.iter().for_each(|f| f.render().unwrap().save(&dir.path().join(&f.file)).unwrap());
    // The limb height and the noise of the scene, as `hzn simulate` measures them.
    (flight.sensor.body.limb_height_km, flight.sensor.body.limb_height_sigma_km) = (18.434, 0.31);
    (flight.sensor.covariance.sigma_px, flight.sensor.covariance.tilt_px) = (0.001, 0.0);
    (flight.sensor.covariance.bias_px, flight.sensor.covariance.correlation_px) = (0.0, 0.0);
    write(&flight, &[Wrong::Altitude(30.0)], dir.path());
    let mut window = window_on(dir.path());
    until(&mut window, "not processed", |v| v.processed() == 1 && !v.is_working());
    window.run_steps(3);
    let view = frame_view(&window);
    let (config, body) = (&view.answers[0].config, &view.answers[0].bodies[0]);
    assert_eq!(body.cause.and_then(|c| c.reason), Some(Reason::Verdict(Verdict::HalfAngle)));
    let picture = view.picture.as_ref().unwrap().view(config.input.channel).unwrap();
    let mut any_cone = diagnosis::AnyCone::new(config, false).unwrap();
    assert!(any_cone.find(&picture, view.data.as_ref()).is_none(), "the longest edge is that of a cloud");
    let limb = any_cone.find_limb(&picture, view.data.as_ref()).unwrap();
    // The picture itself says by how much the altitude is wrong.
    let altitude = body.fit.unwrap().implied(Suspect::Altitude).unwrap();
    assert!((altitude.value + 30.0).abs() < 5.0 && !limb.points.is_empty(), "{altitude:?}");
    assert!(window.query_by_label("Try altitude").is_some());
}

#[test]
fn a_single_frame_with_another_disc_is_not_blamed_on_the_sensor() {
    let (_dir, pictures) = folder();
    // A body of half the Earth's half-angle.
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 260.0)).unwrap();
    let axis = [0.1, 0.75f64.sin(), 0.75f64.cos()];
    let disc = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
        let ray = camera.unproject(ImagePoint { u: x.into(), v: y.into() }).unwrap().xyz();
        let cos: f64 = ray.iter().zip(axis).map(|(a, b)| a * b).sum::<f64>() / (1.0 + 0.01f64).sqrt();
        let inside_px = (0.65 - cos.acos()) * 260.0;
        image::Luma([(8.0 + 190.0 / (1.0 + (-inside_px / 0.6).exp())) as u8])
    });
    disc.save(pictures.join("4.png")).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 5 && !v.is_working());
    window.state_mut().go(4);
    settled(&mut window);
    window.run_steps(3);
    assert_ne!(answer(&window).0, Status::Ok);
    let words = "so this edge is probably not the limb";
    assert!(window.query_all_by_label_contains(words).next().is_some());
    assert!(window.query_by_label("Apply altitude").is_none());
    // The fourth picture is dark.
    window.state_mut().go(3);
    settled(&mut window);
    window.run_steps(3);
    assert!(window.query_all_by_label_contains("probably out of view, or hidden").next().is_some());
}
