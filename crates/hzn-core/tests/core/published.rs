//! Tests the methods of published systems in the whole pipeline. They find a drawn disc, also in halves and in smaller
//! copies of the picture, and give a sound report for every picture.

use std::cell::{Cell, RefCell};

use crate::common::{KINDS, garbage};
use hzn_core::body::{Kind, Prior};
use hzn_core::camera::{self, Model};
use hzn_core::edge_points::SubPixel;
use hzn_core::error_budget::ErrorBudget;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Border;
use hzn_core::pixel::{ImagePoint, Pixel};
use hzn_core::retry::Combine;
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_core::{Config, Expected, FlightHorizon, HostHorizon, Observer, Preset, Report, Solution};
use hzn_core::{consensus, contour, covariance, fit, gates, retry, threshold};
use proptest::prelude::*;

/// Makes a configuration for a sphere of 20° angular radius and a pinhole with f = 60 px times `scale`. The radius of
/// the disc is 21.8 px times `scale`.
fn config(preset: Preset, scale: u16) -> Config {
    let f = 60.0 * f64::from(scale);
    let mut config = Config::preset(preset, camera::Config::ideal(Model::Pinhole, 96 * scale, 64 * scale, f));
    config.body.kind = Kind::Sphere;
    config.body.radius_km = Some(1000.0);
    config.body.altitude_km = Some(1923.8);
    config.body.limb_height_km = 0.0;
    config.edge_points.min_points = 30;
    // HORACE's values are for its camera and rocket.
    config.input.scale_to_height = None;
    config.gates.altitude_limits_km = Some([1800.0, 2000.0]);
    (config.gates.radius_margin, config.gates.radius_margin_px) = (0.5, 0.0);
    config
}

/// Draws a lit disc about (u, v).
fn disc(config: &Config, u: f64, v: f64, radius_px: f64) -> Vec<u8> {
    let (w, h) = (u32::from(config.camera.width), u32::from(config.camera.height));
    (0..w * h)
        .map(|i| {
            let off = (f64::from(i % w) - u).hypot(f64::from(i / w) - v) - radius_px;
            (210.0 * (0.5 - off).clamp(0.0, 1.0)) as u8 + 10
        })
        .collect()
}

fn answer(config: &Config, data: &[u8], observer: &impl Observer<f64>) -> Report<f64> {
    let layout = Layout::packed(config.camera.width.into(), config.camera.height.into(), 1, 8);
    let mut host = HostHorizon::boxed(config).unwrap();
    let expected = host.expect(&Prior::default()).unwrap();
    host.process_observed(&Grey::try_new(data, layout).unwrap(), &expected, observer)
}

/// Counts thresholds, and collects the positions that the observer gets.
#[derive(Default)]
struct Watch {
    levels: Cell<u32>,
    points: RefCell<Vec<ImagePoint<f64>>>,
    border: RefCell<Vec<Pixel>>,
    read: Cell<(u16, u16)>,
    fits: Cell<u32>,
    budgets: Cell<u32>,
}
impl Observer<f64> for Watch {
    fn wants_fit(&self) -> bool {
        true
    }
    fn fit(&self, _: u32, _: &Solution<f64>, _: &Expected<f64>) {
        self.fits.set(self.fits.get() + 1);
    }
    fn wants_budget(&self) -> bool {
        true
    }
    fn budget(&self, _: u32, _: &ErrorBudget<f64>) {
        self.budgets.set(self.budgets.get() + 1);
    }
    fn level(&self, _: u16, _: f64, _: u32) {
        self.levels.set(self.levels.get() + 1);
    }
    fn pixel(&self, x: u16, y: u16) {
        let (u, v) = self.read.get();
        self.read.set((u.max(x), v.max(y)));
    }
    fn edge(&self, _: u32, border: Border<'_>) {
        self.border.borrow_mut().extend(border.pixels());
    }
    fn point(&self, _: u32, point: ImagePoint<f64>) {
        self.points.borrow_mut().push(point);
    }
}

fn off_deg(report: &Report<f64>, want: [f64; 3]) -> f64 {
    let axis = report.solution.as_ref().unwrap_or_else(|| panic!("{:?} {:?}", report.status, report.candidates)).axis;
    axis.angle_rad(&hzn_core::frames::UnitVec3::try_new(want).unwrap()).to_degrees()
}

const CONTOURS: [contour::Method; 4] =
    [contour::Method::BorderFollowing, contour::Method::Raster, contour::Method::Erode, contour::Method::Sobel];

#[test]
fn every_preset_and_contour_method_finds_a_disc() {
    for preset in [Preset::Hzn, Preset::Dlr2022, Preset::Zju2022, Preset::Horace2014, Preset::Horace2015] {
        for method in CONTOURS {
            let mut config = config(preset, 2);
            config.contour.method = method;
            let radius = 120.0 * 20f64.to_radians().tan();
            let report = answer(&config, &disc(&config, 95.5, 63.5, radius), &Watch::default());
            let off = off_deg(&report, [0.0, 0.0, 1.0]);
            // The limit covers points at whole pixels, and an edge of one to two pixels with erosion.
            assert!(off < 0.3, "{} {method:?}: {off}", preset.name());
        }
    }
}

/// Braun & Barf 2022, section 5: search lines find the Sun's disc, which bloom makes wider. The radius is fitted
/// freely, and their limit for the Sun (7.3) applies.
#[test]
fn braun_barf_on_the_sun() {
    let mut config = Config::preset(Preset::Dlr2022, camera::Config::ideal(Model::Pinhole, 160, 120, 1235.0));
    config.body.kind = Kind::Sun;
    config.body.altitude_km = None;
    config.edge_points.min_points = 16;
    config.covariance.sigma_px = 3.0;
    config.gates.max_section_residual = Some(0.5e-5);
    for (u, v, bloom_px) in [(80.0, 60.0, 0.0), (31.3, 77.6, 1.5), (120.9, 20.2, 3.0)] {
        let radius = 1235.0 * 0.2666f64.to_radians().tan() + bloom_px;
        let data = disc(&config, u, v, radius);
        let report = answer(&config, &data, &Watch::default());
        let off_px = off_deg(&report, [(u - 79.5) / 1235.0, (v - 59.5) / 1235.0, 1.0]).to_radians() * 1235.0;
        assert!(off_px < 0.15, "{u} {v} {bloom_px}: {off_px}");
        let solution = report.solution.unwrap();
        assert!((solution.half_angle_rad * 1235.0 - radius).abs() < 0.3 && solution.altitude_m.is_none());
    }
    // An oval is not the Sun: the points of an ellipse do not lie on any circle.
    let (w, h) = (160u32, 120u32);
    let oval: Vec<u8> = (0..w * h)
        .map(|i| {
            let (x, y) = (f64::from(i % w) - 80.0, f64::from(i / w) - 60.0);
            if (x / 22.0).hypot(y / 9.0) < 1.0 { 220 } else { 10 }
        })
        .collect();
    assert!(answer(&config, &oval, &Watch::default()).solution.is_none());
}

#[test]
fn a_smaller_copy_is_looked_at_in_the_pictures_own_coordinates() {
    let mut config = config(Preset::Horace2015, 4);
    let (u, v, radius) = (200.0, 120.0, 240.0 * 20f64.to_radians().tan());
    let data = disc(&config, u, v, radius);
    let want = [(u - 191.5) / 240.0, (v - 127.5) / 240.0, 1.0];
    let full = off_deg(&answer(&config, &data, &Watch::default()), want);
    config.input.scale_to_height = Some(64);
    let watch = Watch::default();
    let report = answer(&config, &data, &watch);
    let scaled = off_deg(&report, want);
    // A pixel of the copy is about one degree.
    assert!(full < 0.1 && scaled < 0.4, "{full} {scaled}");
    assert!(report.candidates[0].length_px < 200, "{:?}", report.candidates);
    for p in watch.points.borrow().iter() {
        assert!(((p.u - u).hypot(p.v - v) - radius).abs() < 4.0, "{p:?}");
    }
    for p in watch.border.borrow().iter() {
        assert!(((f64::from(p.x) - u).hypot(f64::from(p.y) - v) - radius).abs() < 8.0, "{p:?}");
    }
    let (x, y) = watch.read.get();
    assert!(x > 300 && y > 200, "the whole picture is read: {x} {y}");
    assert!(watch.fits.get() > 0 && watch.budgets.get() > 0, "{} {}", watch.fits.get(), watch.budgets.get());
    // Behind a pointer, an observer receives the same.
    let other = Watch::default();
    let pointed = answer(&config, &data, &(&other as &dyn Observer<f64>));
    assert_eq!(pointed.solution.map(|s| s.axis.xyz()), report.solution.map(|s| s.axis.xyz()));
    let seen = |w: &Watch| (w.levels.get(), w.read.get(), w.fits.get(), w.budgets.get(), w.border.borrow().clone());
    assert_eq!(seen(&other), seen(&watch));
    assert_eq!(*other.points.borrow(), *watch.points.borrow());
    config.input.scale_to_height = Some(300);
    assert_eq!(config.check().unwrap_err().field, "input.scale_to_height");
}

/// Draws a disc, and lit squares over the right half of the picture. The limb runs into them, and only the left parts
/// show a limb.
fn spoilt(config: &Config) -> Vec<u8> {
    let (w, radius) = (u32::from(config.camera.width), 240.0 * 20f64.to_radians().tan());
    let mut data = disc(config, 191.5, 127.5, radius);
    for (i, v) in (0..).zip(data.iter_mut()) {
        let (x, y) = (i % w, i / w);
        if x >= 192 && (x / 24 + y / 24) % 2 == 0 {
            *v = 255;
        }
    }
    data
}

#[test]
fn halves_answer_where_the_whole_does_not() {
    let mut config = config(Preset::Horace2015, 4);
    config.gates.radius_margin = 0.03;
    let data = spoilt(&config);
    config.retry.method = retry::Method::None;
    let report = answer(&config, &data, &Watch::default());
    assert_eq!(report.status, Status::Rejected, "{:?}", report.candidates);
    assert!(report.candidates.iter().any(|c| c.verdict == Verdict::Radius));
    config.retry.method = retry::Method::Division;
    for combine in [Combine::Median, Combine::Mean] {
        config.retry.combine = combine;
        let watch = Watch::default();
        let report = answer(&config, &data, &watch);
        let off = off_deg(&report, [0.0, 0.0, 1.0]);
        assert!(off < 0.5, "{combine:?} {off}");
        assert!(watch.levels.get() > 2);
        // The numbers of the candidates go on from part to part.
        assert!(report.counters.candidates as usize >= report.candidates.len());
        let solution = report.solution.unwrap();
        assert!(solution.covariance.sigma_max_rad() > 0.0 && report.counters.candidates > solution.candidate);
    }
    // No half is large enough to be cut again, so there are the whole picture and two halves.
    config.retry.least_part = 1.0;
    let watch = Watch::default();
    let _ = answer(&config, &data, &watch);
    assert_eq!(watch.levels.get(), 3);
}

/// HORACE's values for its camera are altitude limits of 0 (2014: 20) and 100 km and a margin of 5000 px at 768 rows.
#[test]
fn the_radius_check_of_horace_is_in_pixels() {
    let camera = camera::Config::ideal(Model::Pinhole, 1024, 768, 2133.3);
    let own = Config::preset(Preset::Horace2015, camera);
    assert_eq!(own.threshold.factor, 0.75);
    assert_eq!((own.gates.altitude_limits_km, own.input.scale_to_height), (Some([0.0, 100.0]), Some(400)));
    assert!((own.gates.radius_margin_px * 768.0 / 400.0 - 5000.0).abs() < 1e-9);
    let first = Config::preset(Preset::Horace2014, own.camera.clone());
    assert_eq!((first.gates.altitude_limits_km, first.retry.combine), (Some([20.0, 100.0]), Combine::Median));
    assert!((first.brightness.min_mean, own.brightness.min_mean) == (5.0 / 255.0, 15.0 / 255.0));
    // The radius of the disc is 87.4 px. Limits that begin 3 px above it reject the disc, unless the margin is wider.
    let mut config = config(Preset::Horace2015, 4);
    config.retry.method = retry::Method::None;
    let data = disc(&config, 191.5, 127.5, 240.0 * 20f64.to_radians().tan());
    let altitude_of = |radius_px: f64| 1000.0 / (radius_px / 240.0).atan().sin() - 1000.0;
    config.gates.radius_margin = 0.0;
    config.gates.altitude_limits_km = Some([altitude_of(110.0), altitude_of(90.4)]);
    for (margin_px, passes) in [(0.0, false), (1.5, false), (5.0, true)] {
        config.gates.radius_margin_px = margin_px;
        let report = answer(&config, &data, &Watch::default());
        assert_eq!(report.solution.is_some(), passes, "{margin_px} {:?}", report.candidates);
        assert!(passes || report.candidates.iter().any(|c| c.verdict == Verdict::Radius), "{:?}", report.candidates);
    }
}

/// As printed, (2.39) goes on with the division unless a part is too bright and too dark at once.
#[test]
fn division_ends_at_pictures_that_are_too_dark_or_too_bright() {
    let mut config = config(Preset::Horace2015, 2);
    config.retry.least_part = 1.0 / 64.0;
    for (value, status) in [(0, Status::TooDark), (255, Status::TooBright)] {
        let watch = Watch::default();
        let data = vec![value; 192 * 128];
        let report = answer(&config, &data, &watch);
        assert_eq!((report.status, watch.levels.get()), (status, 0));
    }
    // The whole picture is neither too dark nor too bright, but one half is dark and the other bright: the division
    // ends at both.
    let data: Vec<u8> = (0..192 * 128).map(|i| if i % 192 < 96 { 0 } else { 255 }).collect();
    let watch = Watch::default();
    let report = answer(&config, &data, &watch);
    assert!(report.status != Status::Ok && watch.levels.get() == 1, "{} {}", report.status, watch.levels.get());
}

#[test]
fn a_picture_with_more_pixels_than_bits_is_truncated() {
    let mut config = config(Preset::Horace2015, 4);
    config.retry.method = retry::Method::None;
    let data = disc(&config, 191.5, 127.5, 87.0);
    let mut flight = FlightHorizon::boxed(&config).unwrap();
    let expected = flight.expect(&Prior::default()).unwrap();
    let picture = Grey::try_new(&data, Layout::packed(384, 256, 1, 8)).unwrap();
    assert_eq!(flight.process(&picture, &expected).status, Status::Truncated);
    // A smaller copy that fits gets an answer.
    config.input.scale_to_height = Some(96);
    let mut flight = FlightHorizon::boxed(&config).unwrap();
    let report = flight.process(&picture, &expected);
    assert_eq!(report.status, Status::Ok, "{:?}", report.candidates);
}

#[test]
fn limits_are_checked_by_name() {
    let refused = |change: &dyn Fn(&mut Config)| {
        let mut config = config(Preset::Horace2015, 1);
        change(&mut config);
        config.check().unwrap_err().field
    };
    assert_eq!(refused(&|c| c.contour.erode_size_px = 4), "contour.erode_size_px");
    assert_eq!(refused(&|c| c.contour.erode_threshold = 10), "contour.erode_threshold");
    assert_eq!(refused(&|c| c.contour.erode_threshold = 0), "contour.erode_threshold");
    assert_eq!(refused(&|c| c.gates.altitude_limits_km = Some([5.0, 4.0])), "gates.altitude_limits_km");
    assert_eq!(refused(&|c| c.gates.altitude_limits_km = Some([-1.0, 4.0])), "gates.altitude_limits_km");
    assert_eq!(refused(&|c| c.gates.radius_margin = f64::NAN), "gates.radius_margin");
    assert_eq!(refused(&|c| c.gates.radius_margin_px = -1.0), "gates.radius_margin_px");
    assert_eq!(refused(&|c| c.gates.max_section_residual = Some(0.0)), "gates.max_section_residual");
    assert_eq!(refused(&|c| c.retry.least_part = 0.001), "retry.least_part");
    assert_eq!(refused(&|c| c.input.scale_to_height = Some(8)), "input.scale_to_height");
}

/// Draws two discs; the first limb is half as long as the second one.
fn two_discs(config: &Config) -> Vec<u8> {
    let radius = 240.0 * 20f64.to_radians().tan();
    let small = disc(config, 60.0, 60.0, 0.5 * radius);
    let large = disc(config, 270.0, 150.0, radius);
    small.iter().zip(&large).map(|(a, b)| *a.max(b)).collect()
}

/// In HORACE the longest border is the limb, and the picture has no answer if this border fails. `hzn` would take the
/// border that passes.
#[test]
fn only_the_longest_border_counts() {
    let mut config = config(Preset::Horace2015, 4);
    config.retry.method = retry::Method::None;
    let data = two_discs(&config);
    let altitude_of = |radius_px: f64| 1000.0 / (radius_px / 240.0).atan().sin() - 1000.0;
    let radius = 240.0 * 20f64.to_radians().tan();
    for (part, answers) in [(1.0, true), (0.5, false)] {
        config.gates.radius_margin = 0.03;
        config.gates.altitude_limits_km = Some([altitude_of(part * radius), altitude_of(part * radius)]);
        config.gates.choice = gates::Choice::Longest;
        let report = answer(&config, &data, &Watch::default());
        assert_eq!(report.solution.is_some(), answers, "{part}: {:?}", report.candidates);
        config.gates.choice = gates::Choice::Score;
        let report = answer(&config, &data, &Watch::default());
        assert!(report.solution.is_some(), "{part}: {:?}", report.candidates);
    }
}

/// In Braun & Barf 2022 the edge with the smallest residual (28) is the limb. `hzn` ends its search at the first edge
/// that is good enough, and that is the upper disc, which is a little too large.
#[test]
fn the_smallest_section_residual_chooses() {
    let mut config = config(Preset::Dlr2022, 4);
    config.gates.altitude_limits_km = None;
    let half_angle = 8f64.to_radians();
    config.body.altitude_km = Some(1000.0 / half_angle.sin() - 1000.0);
    let [upper, lower] = [[100.0, 80.0], [290.0, 170.0]];
    let axis = |[u, v]: [f64; 2]| [(u - 191.5) / 240.0, (v - 127.5) / 240.0, 1.0];
    let unit = |place| UnitVec3::<Cam, f64>::try_new(axis(place)).unwrap();
    let w = u32::from(config.camera.width);
    let data: Vec<u8> = (0..w * u32::from(config.camera.height))
        .map(|i| {
            let ray = unit([f64::from(i % w), f64::from(i / w)]);
            let is_within = |place, part: f64| ray.angle_rad(&unit(place)) < part * half_angle;
            if is_within(upper, 1.05) || is_within(lower, 1.0) { 220 } else { 10 }
        })
        .collect();
    for (choice, want) in [(gates::Choice::SectionResidual, lower), (gates::Choice::Score, upper)] {
        config.gates.choice = choice;
        let off = off_deg(&answer(&config, &data, &Watch::default()), axis(want));
        assert!(off < 0.2, "{choice:?}: {off}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn any_picture_gets_a_sound_report(
        kind in 0..KINDS, seed in any::<u64>(), level in any::<u8>(), lens in 0usize..3, circle: bool, mask: bool,
        body in 0usize..4, methods in proptest::array::uniform6(0usize..6), scaled: bool, divided: bool, gates: bool,
    ) {
        let model = [Model::Pinhole, Model::Equidistant, Model::KannalaBrandt][lens];
        let mut config = config(Preset::Horace2015, 1);
        config.camera.model = model;
        config.camera.theta_max_deg = circle.then_some(30.0);
        config.body.kind = [Kind::Earth, Kind::EarthSphere, Kind::Sun, Kind::Moon][body];
        config.body.radius_km = None;
        config.edge_points.min_points = 3;
        config.gates.min_inliers = 3;
        config.gates.limb_in_view = gates;
        config.gates.max_section_residual = gates.then_some(0.025);
        config.gates.altitude_limits_km = gates.then_some([0.0, 5000.0]);
        if mask {
            let triangle = [[10.0, 10.0], [50.0, 5.0], [30.0, 60.0]];
            config.mask.polygons_px.push(triangle.into_iter().collect()).unwrap();
        }
        let pick = methods.map(|m| m % 3);
        config.contour.method = CONTOURS[methods[0] % 4];
        config.consensus.method = [
            consensus::Method::None,
            consensus::Method::Ransac,
            consensus::Method::TwoPoint,
            consensus::Method::RansacPreverify,
            consensus::Method::Mlesac,
        ][methods[1] % 5];
        config.fit.method = [
            fit::Method::Sphere, fit::Method::Direct, fit::Method::Conic, fit::Method::Circle,
            fit::Method::Tls, fit::Method::Wtls,
        ][methods[2]];
        config.fit.half_angle = [
            fit::HalfAngle::Free, fit::HalfAngle::Fused, fit::HalfAngle::Known,
        ][pick[3]];
        config.covariance.method = [covariance::Method::Sandwich, covariance::Method::BraunBarf][pick[4] % 2];
        config.covariance.overbound = pick[5] == 0;
        config.edge_points.sub_pixel =
            [SubPixel::None, SubPixel::Linear, SubPixel::Zernike, SubPixel::Erf][methods[4] % 4];
        use gates::Choice::{Longest, Score, SectionResidual};
        config.gates.choice = [Score, SectionResidual, Longest][methods[5] % 3];
        config.edge_points.blur_px = [0.0, 1.0][methods[5] / 3];
        use threshold::Method::{Dynamic, Fixed, Otsu};
        config.threshold.method = [Otsu, Dynamic, Fixed][pick[5]];
        config.input.scale_to_height = scaled.then_some(33);
        config.retry.method = if divided { retry::Method::Division } else { retry::Method::None };
        let data = garbage(kind, seed, level);
        let report = answer(&config, &data, &Watch::default());
        prop_assert_eq!(report.status == Status::Ok, report.solution.is_some());
        if let Some(s) = &report.solution {
            let n: f64 = s.axis.xyz().iter().map(|v| v * v).sum();
            prop_assert!((n - 1.0).abs() < 1e-9);
            prop_assert!(s.covariance.upper_rad2.iter().all(|v| v.is_finite()));
            prop_assert!(s.covariance.sigma_max_rad() > 0.0);
            prop_assert!(s.half_angle_rad.is_finite() && s.rms_px.is_finite() && s.arc_px.is_finite());
            prop_assert!(s.altitude_m.is_none_or(|(h, sigma)| h.is_finite() && sigma.is_finite()));
        }
        let again = answer(&config, &data, &Watch::default());
        prop_assert_eq!(report.solution.map(|s| s.axis.xyz()), again.solution.map(|s| s.axis.xyz()));
        let mut flight = FlightHorizon::boxed(&config).unwrap();
        let expected = flight.expect(&Prior::default()).unwrap();
        let picture = Grey::try_new(&data, Layout::packed(96, 64, 1, 8)).unwrap();
        if let Some(s) = flight.process(&picture, &expected).solution {
            prop_assert!(s.axis.xyz().iter().all(|v| v.is_finite()));
            prop_assert!(s.covariance.upper_rad2.iter().all(|v| v.is_finite()));
        }
    }
}
