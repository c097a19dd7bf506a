//! Calibrations from corners of simulated boards.

use hzn_core::camera::{Camera, Config, Equation, Model};
use hzn_core::frames::UnitVec3;
use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::draws::Draws;
use crate::lens_error::differences_px;

const BOARD: Board = Board { columns: 9, rows: 6, square_mm: 30.0 };
const SIZE: [u16; 2] = [1280, 960];

/// Returns a lens of each model, with a shape that real lenses have.
fn lenses() -> Vec<Config> {
    let lens = |model, focal_px, k: &[f64]| {
        let mut config = Config::ideal(model, SIZE[0], SIZE[1], focal_px);
        (config.fy_px, config.cx_px, config.cy_px) = (focal_px * 1.003, 648.3, 471.8);
        config.k = k.iter().copied().collect();
        config
    };
    vec![
        lens(Model::KannalaBrandt, 1235.0, &[-0.055, 0.011, -0.0035, 0.0002]),
        lens(Model::KannalaBrandt, 480.0, &[0.02, -0.01, 0.003, -0.0005]),
        lens(Model::Equidistant, 500.0, &[]),
        lens(Model::Pinhole, 1100.0, &[]),
        lens(Model::BrownConrady, 1000.0, &[-0.28, 0.09, 0.0004, -0.0003, -0.01]),
        lens(Model::DoubleSphere, 520.0, &[-0.18, 0.59]),
        lens(Model::Eucm, 480.0, &[0.63, 1.04]),
    ]
}

/// A fault that a test draws into a set of pictures.
#[derive(Clone, Copy, Default)]
struct Faults {
    /// Depth of the ends of a row and of a column behind their middle, mm.
    bow_mm: [f64; 2],
    /// 1-sigma of the focal length from picture to picture, as a part of it: a lens that focuses again.
    focus: f64,
    /// By how much the rows of the print are longer than its columns, as a part.
    stretch: f64,
}

/// Returns views of a flat board all over the picture. A corner outside the picture is not seen.
fn views(lens: &Config, count: usize, noise_px: f64, draws: &mut Draws) -> Vec<View> {
    faulty_views(lens, count, noise_px, Faults::default(), draws)
}

/// Returns the same views with faults.
fn faulty_views(lens: &Config, count: usize, noise_px: f64, faults: Faults, draws: &mut Draws) -> Vec<View> {
    let camera = Camera::<f64>::try_new(lens).unwrap();
    let mut views = Vec::new();
    while views.len() < count {
        let focus = if faults.focus > 0.0 { 1.0 + faults.focus * draws.normal() } else { 1.0 };
        let equation = Equation::new(&Config { fx_px: lens.fx_px * focus, fy_px: lens.fy_px * focus, ..lens.clone() });
        // The middle of the board projects to a place in the picture; its size is about a third of the picture.
        let place = [0, 1].map(|axis| f64::from(SIZE[axis]) * (0.05 + 0.9 * draws.uniform()));
        let Some(ray) = camera.unproject(hzn_core::pixel::ImagePoint { u: place[0], v: place[1] }) else { continue };
        let ray = Vector3::from(ray.xyz());
        let distance_mm = 270.0 * lens.fx_px / 640.0 * (0.8 + 0.8 * draws.uniform());
        let facing = Rotation3::rotation_between(&Vector3::z(), &ray).unwrap();
        let tilt = Vector3::new(draws.uniform() - 0.5, draws.uniform() - 0.5, 0.6 * (draws.uniform() - 0.5)) * 1.7;
        let rotation = facing * Rotation3::new(tilt);
        let corner = |n: u16| {
            let (column, row) = (n % BOARD.columns, n / BOARD.columns);
            let [x, y] = BOARD.place_mm(column, row);
            let depth_mm = faults.bow_mm[0] * (x / 120.0 - 1.0).powi(2) + faults.bow_mm[1] * (y / 75.0 - 1.0).powi(2);
            let along = (x - 120.0) * (1.0 + faults.stretch);
            let point = rotation * Vector3::new(along, y - 75.0, depth_mm) + ray * distance_mm;
            let p = equation.project(point.into())?.point;
            camera.project(&UnitVec3::try_new(point.into())?)?;
            let inside = p.u > 0.0 && p.v > 0.0 && p.u < f64::from(SIZE[0]) - 1.0 && p.v < f64::from(SIZE[1]) - 1.0;
            inside.then_some((column, row, [p.u, p.v]))
        };
        let seen: Vec<_> = (0..BOARD.corners() as u16).filter_map(corner).collect();
        if seen.len() >= 30 {
            let noisy = |(column, row, at): (u16, u16, [f64; 2])| Corner {
                column,
                row,
                at_px: at.map(|x| x + noise_px * draws.normal()),
            };
            let corners = seen.into_iter().map(noisy).collect();
            views.push(View { name: format!("view-{:02}", views.len()), corners });
        }
    }
    views
}

/// Returns the errors of all parameters over their sigmas.
fn normalised_errors(found: &Calibrated, truth: &Config) -> Vec<f64> {
    let covariance = found.camera.covariance.as_ref().unwrap();
    let error = |(n, which): (usize, &hzn_core::camera::Intrinsic)| {
        let off = found.camera.intrinsic(*which).unwrap() - truth.intrinsic(*which).unwrap();
        off / covariance.rows[n][n].sqrt()
    };
    covariance.order.iter().enumerate().map(error).collect()
}

#[test]
fn every_lens_is_found_exactly_without_noise() {
    for (n, lens) in lenses().iter().enumerate() {
        let views = views(lens, 8, 0.0, &mut Draws(n as u64));
        let found = calibrate(lens.model, SIZE, &BOARD, &views).unwrap();
        assert!(found.rms_px < 1e-5, "{lens:?}: {}", found.rms_px);
        let camera = Camera::try_new(lens).unwrap();
        let worst = differences_px(&camera, &found.camera).into_iter().fold(0.0, f64::max);
        assert!(worst < 1e-3, "{lens:?}: {worst} px");
        assert!(found.views.iter().all(|v| v.dropped.is_none()));
    }
}

/// Tests every third lens, and all with `cargo xtask test --all`.
#[test]
fn errors_agree_with_their_sigmas() {
    let step = if std::env::var_os("HZN_ALL").is_some() { 1 } else { 3 };
    for lens in lenses().into_iter().step_by(step) {
        let mut errors = Vec::new();
        for set in 0..60 {
            let views = views(&lens, 10, 0.15, &mut Draws(1000 + set));
            let found = calibrate(lens.model, SIZE, &BOARD, &views).unwrap();
            errors.extend(normalised_errors(&found, &lens));
            assert!((found.sigma_px / 0.15 - 1.0).abs() < 0.15, "{}", found.sigma_px);
        }
        let n = errors.len() as f64;
        let within = errors.iter().filter(|e| e.abs() < 3.0).count() as f64 / n;
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
        println!("{}: {:.1} % within 3 sigma, RMS {rms:.2} sigma", lens.model.name(), 100.0 * within);
        assert!(within >= 0.97 && (0.8..1.25).contains(&rms), "{lens:?}: {within} {rms}");
    }
}

/// Returns the RMS of the errors over their sigmas in sets of pictures with faults, and all calibrations.
fn errors_with_faults(lens: &Config, sets: u64, faults: Faults) -> (f64, Vec<Calibrated>) {
    let calibrate = |set| {
        let views = faulty_views(lens, 16, 0.1, faults, &mut Draws(5000 + set));
        calibrate(lens.model, SIZE, &BOARD, &views).unwrap()
    };
    let found: Vec<Calibrated> = (0..sets).map(calibrate).collect();
    let errors: Vec<f64> = found.iter().flat_map(|c| normalised_errors(c, lens)).collect();
    ((errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt(), found)
}

/// Tests a lens whose focal length changes from picture to picture: the corners alone promise too much.
#[test]
fn pictures_that_disagree_make_the_lens_uncertain() {
    for lens in [&lenses()[0], &lenses()[4]] {
        let (rms, found) = errors_with_faults(lens, 30, Faults { focus: 0.01, ..Faults::default() });
        let ratio = found.iter().map(|c| c.between_sigma_px.unwrap() / c.alone_sigma_px).sum::<f64>() / 30.0;
        let warned = |c: &&Calibrated| c.warnings.iter().any(|w| matches!(w, Warning::Between { .. }));
        let warned = found.iter().filter(warned).count();
        println!("{}: RMS {rms:.2} sigma, ratio {ratio:.2}, {warned} of 30 warn", lens.model.name());
        assert!((0.6..1.4).contains(&rms) && ratio > 2.0 && warned > 20, "{rms} {ratio} {warned}");
    }
}

#[test]
fn a_bent_board_is_found() {
    let lens = &lenses()[0];
    let bow_mm = [0.6, -0.3];
    let (rms, found) = errors_with_faults(lens, 20, Faults { bow_mm, ..Faults::default() });
    assert!((0.7..1.3).contains(&rms), "{rms}");
    for found in found {
        let bow = found.bow.unwrap();
        let off = |k: usize| (bow.depth_mm[k] - bow_mm[k]) / bow.sigma_mm[k];
        assert!(off(0).abs() < 4.0 && off(1).abs() < 4.0, "{bow:?}");
        assert!((found.sigma_px / 0.1 - 1.0).abs() < 0.1, "{}", found.sigma_px);
    }
    // A flat board stays flat: the limit lets one of a thousand through.
    let (_, flat) = errors_with_faults(lens, 20, Faults::default());
    assert!(flat.iter().filter(|c| c.bow.is_some()).count() <= 1);
}

/// A print that is longer in one direction gives a camera with square pixels two focal lengths.
#[test]
fn a_print_that_is_longer_in_one_direction_is_named() {
    let square = Config { fy_px: lenses()[1].fx_px, ..lenses()[1].clone() };
    let named = |stretch: f64, set| {
        let faults = Faults { stretch, ..Faults::default() };
        let found = calibrate(square.model, SIZE, &BOARD, &faulty_views(&square, 12, 0.1, faults, &mut Draws(set)));
        let words: Vec<String> = found.unwrap().warnings.iter().map(ToString::to_string).collect();
        words.iter().any(|w| w.contains("whose squares are longer in one direction"))
    };
    let stretched = (0..4).filter(|set| named(0.03, 7000 + set)).count();
    let right = (0..8).filter(|set| named(0.0, 7100 + set)).count();
    assert!(stretched == 4 && right <= 1, "{stretched} of 4, {right} of 8");
}

#[test]
fn outliers_and_bad_pictures_are_left_out() {
    let lens = &lenses()[0];
    let mut draws = Draws(77);
    let mut views = views(lens, 10, 0.1, &mut draws);
    let mut wrong = 0;
    for view in &mut views {
        for corner in &mut view.corners {
            if draws.uniform() < 0.05 {
                corner.at_px = corner.at_px.map(|x| x + 20.0 * draws.normal());
                wrong += 1;
            }
        }
    }
    // In one picture the numbering is turned by 180° for half of the rows.
    for corner in views[3].corners.iter_mut().filter(|c| c.row % 2 == 0) {
        corner.column = BOARD.columns - 1 - corner.column;
    }
    views.push(View { name: "nearly empty".into(), corners: views[0].corners[..4].to_vec() });
    let found = calibrate(lens.model, SIZE, &BOARD, &views).unwrap();
    let dropped = |n: usize| found.views[n].dropped.map(|d| d.to_string()).unwrap_or_default();
    assert_eq!(dropped(10), "it has 4 points, but a pose needs 6");
    assert!(!dropped(3).is_empty() && (0..10).filter(|n| !dropped(*n).is_empty()).count() == 1, "{:?}", found.views[3]);
    let rejected = found.views.iter().flat_map(|v| &v.residuals).filter(|r| !r.counts).count();
    assert!(wrong > 10 && rejected + 8 > wrong * 9 / 10, "{rejected} of {wrong}");
    assert!(normalised_errors(&found, lens).iter().all(|e| e.abs() < 3.5), "{:?}", normalised_errors(&found, lens));
    assert!((found.sigma_px / 0.1 - 1.0).abs() < 0.1, "{}", found.sigma_px);
    assert!((found.held_out_rms_px.unwrap() / found.rms_px - 1.0).abs() < 0.3, "{found:?}");
}

/// Tests that one wrong corner does not cost its picture, however small the noise of the others is.
#[test]
fn one_wrong_corner_is_left_out_alone() {
    let lens = &lenses()[0];
    let mut views = views(lens, 6, 0.02, &mut Draws(123));
    views[2].corners[7].at_px[0] += 30.0;
    let found = calibrate(lens.model, SIZE, &BOARD, &views).unwrap();
    let outliers: Vec<usize> = found.views.iter().map(|v| v.residuals.iter().filter(|r| !r.counts).count()).collect();
    assert_eq!(outliers, [0, 0, 1, 0, 0, 0], "{:?}", found.views[2].dropped);
    assert!(!found.views[2].residuals[7].counts);
}

#[test]
fn what_does_not_determine_the_lens_is_refused() {
    let lens = &lenses()[3];
    let refused = |views: &[View]| calibrate(lens.model, SIZE, &BOARD, views).unwrap_err();
    let good = views(lens, 6, 0.1, &mut Draws(5));
    assert_eq!(refused(&good[..2]), Refusal::TooFewViews { usable: 2, min: 3, of: 2 });
    let mut mirrored = good.clone();
    mirrored.iter_mut().flat_map(|v| &mut v.corners).for_each(|c| c.column = BOARD.columns - 1 - c.column);
    assert_eq!(refused(&mirrored), Refusal::Mirrored);
    let mut one = good.clone();
    one[1].corners.iter_mut().for_each(|c| c.row = BOARD.rows - 1 - c.row);
    let found = calibrate(lens.model, SIZE, &BOARD, &one).unwrap();
    assert_eq!(found.views[1].dropped, Some(Dropped::Mirrored));
    one[1].corners[0].row = 6;
    assert_eq!(
        refused(&one).to_string(),
        "view-01: the corner (0, 6) is not on a board with 9 x 6 inner corners, which are counted from 0"
    );
    one[1].corners[0] = Corner { column: 0, row: 0, at_px: [f64::NAN, 0.0] };
    assert_eq!(refused(&one), Refusal::NotFinite { view: "view-01".into() });
    // Frontal boards at any distance: the picture shows f over the distance.
    let frontal = |n: u16| {
        let corner = |i: u16| {
            let (column, row) = (i % BOARD.columns, i / BOARD.columns);
            let scale = 0.8 + 0.2 * f64::from(n);
            let at = BOARD.place_mm(column, row).map(|mm| 300.0 + 40.0 * f64::from(n) + scale * mm);
            let mut draws = Draws(u64::from(100 * n + i));
            Corner { column, row, at_px: at.map(|x| x + 0.1 * draws.normal()) }
        };
        View { name: n.to_string(), corners: (0..BOARD.corners() as u16).map(corner).collect() }
    };
    let frontal: Vec<View> = (0..5).map(frontal).collect();
    assert!(matches!(refused(&frontal), Refusal::NotDetermined { .. }), "{}", refused(&frontal));
    // Boards of the wrong size have no pose at all.
    let mut wrong = good.clone();
    wrong.iter_mut().flat_map(|v| &mut v.corners).for_each(|c| {
        let n = c.row * BOARD.columns + c.column;
        (c.column, c.row) = (n % 6, n / 9);
    });
    let error = refused(&wrong).to_string();
    assert!(error.contains("no lens") || error.contains("can be used"), "{error}");
}

/// Returns views whose corners lie in the middle of the picture only.
fn central_views(lens: &Config) -> Vec<View> {
    let mut views = views(lens, 14, 0.1, &mut Draws(9));
    views.iter_mut().for_each(|v| {
        v.corners.retain(|c| (c.at_px[0] - 640.0).hypot(c.at_px[1] - 480.0) < 420.0);
    });
    views
}

#[test]
fn corners_that_boards_do_not_reach_raise_a_warning() {
    let lens = &lenses()[6];
    let found = calibrate(lens.model, SIZE, &BOARD, &central_views(lens)).unwrap();
    let text: Vec<String> = found.warnings.iter().map(|w| w.to_string()).collect();
    assert!(text.iter().any(|w| w.starts_with("the points reach") && w.contains("near the corners")), "{text:?}");
    assert!(found.corner_sigma_px > 3.0 * found.lens_sigma_px, "{found:?}");
    // Four coefficients from the middle of a narrow picture are not monotone outside it.
    let found = calibrate(Model::KannalaBrandt, SIZE, &BOARD, &central_views(&lenses()[0])).unwrap();
    let circle = found.camera.theta_max_deg.unwrap();
    assert!((found.covered_deg - circle).abs() < 2.2, "{circle} {}", found.covered_deg);
    assert!(found.warnings.iter().any(|w| matches!(w, Warning::CircleSet { .. })));
}

/// A lens of the right model is hardly ever called one of another, and a decentred lens is.
#[test]
fn another_model_is_named_beyond_chance() {
    let is_named = |found: &Calibrated| found.warnings.iter().any(|w| matches!(w, Warning::OtherModel { .. }));
    let lenses: Vec<Config> = lenses();
    let mut alarms = Vec::new();
    for set in 0..30_u64 {
        let lens = &lenses[set as usize % lenses.len()];
        let views = views(lens, 8 + set as usize % 13, 0.05, &mut Draws(40_000 + set));
        let found = calibrate(lens.model, SIZE, &BOARD, &views).unwrap();
        if is_named(&found) {
            alarms.push((set, lens.model, found.warnings));
        }
    }
    assert!(alarms.is_empty(), "{alarms:?}");
    // The default model on a lens that is decentred more and more.
    let decentred = |part: f64| {
        let mut lens = lenses[4].clone();
        lens.k = [-0.28, 0.09, 8e-4 * part, -5e-4 * part, -0.01].into_iter().collect();
        lens
    };
    for (part, must_name) in [(0.25, false), (1.0, true)] {
        let lens = decentred(part);
        let (mut named, mut squares) = (0, 0.0);
        for set in 0..4 {
            let views = views(&lens, 12, 0.03, &mut Draws(50_000 + set));
            let found = calibrate(Model::KannalaBrandt, SIZE, &BOARD, &views).unwrap();
            named += usize::from(is_named(&found));
            // Focal lengths and centre; the coefficients are of another model.
            let covariance = found.camera.covariance.as_ref().unwrap();
            let off = |n: usize| {
                let which = covariance.order[n];
                found.camera.intrinsic(which).unwrap() - lens.intrinsic(which).unwrap()
            };
            squares += (0..4).map(|n| off(n).powi(2) / covariance.rows[n][n]).sum::<f64>() / 16.0;
            println!("{part}: RMS {:.3} px, lens {:.3} px, {:?}", found.rms_px, found.lens_sigma_px, found.warnings);
        }
        println!("{part}: named {named} of 4, NEES per parameter {squares:.2}");
        assert!(!must_name || named == 4, "{part}: {named}");
        assert!(squares < 4.0, "{part}: {squares}");
    }
}
