use super::*;
use crate::honesty::interval;
use crate::quantile::quantile;
use crate::summary::nice_step;
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::status::Status;
use hzn_files::truth::Truth;
use hzn_sim::counter::{Counter, Stream};

/// The limb axis points down, along the picture's y axis; the half-angle is 60°.
fn truth(file: &str, limb: u8) -> Truth {
    Truth {
        file: file.into(),
        body: "earth".into(),
        limb,
        axis_y: 1.0,
        half_angle_deg: 60.0,
        altitude_km: 100.0,
        qw: 1.0,
        ..Truth::default()
    }
}

/// The answer is off by a turn of `x_deg` about x and of `z_deg` about z. Its sigmas are 0.1° (about x) and 0.2°
/// (about z).
fn answer(file: &str, x_deg: f64, z_deg: f64) -> Answer {
    let (x, z) = (x_deg.to_radians(), z_deg.to_radians());
    // The truth is the answer turned by (x, 0, z). To first order, answer = (0, 1, 0) − (x, 0, z) × (0, 1, 0).
    let axis = [z, 1.0, -x];
    let (a, b) = (0.1f64.to_radians(), 0.2f64.to_radians());
    // A turn about z moves the x component, and a turn about x moves the z component.
    let covariance_rad2 = [b * b, 0.0, 0.0, 0.0, 0.0, a * a];
    let found = MeasuredDirection {
        axis,
        covariance_rad2,
        common_rad2: None,
        half_angle_deg: Some(60.0),
        protection_deg: None,
    };
    Answer { file: file.into(), body: "earth".into(), status: Status::Ok, found: Some(found), position: None }
}

fn none(file: &str, status: Status) -> Answer {
    Answer { status, found: None, ..answer(file, 0.0, 0.0) }
}

#[test]
fn errors_by_axis_and_their_sigmas() {
    let cases = pair(&[answer("a", 0.1, -0.4)], &[truth("a", 1)], None).unwrap();
    let m = cases[0].miss.unwrap();
    assert!((m.angle_deg - 0.17f64.sqrt()).abs() < 1e-5, "{m:?}");
    assert!((m.about_deg[0] - 0.1).abs() < 1e-5 && (m.about_deg[2] + 0.4).abs() < 1e-5 && m.about_deg[1].abs() < 1e-5);
    // The error is one sigma about x and two sigma about z: 1 + 4.
    assert!((m.nees.unwrap() - 5.0).abs() < 1e-3 && (m.sigma_max_deg - 0.2).abs() < 1e-5);
    assert_eq!((m.half_angle_ratio, cases[0].off_axis_deg), (Some(1.0), 90.0));
}

/// The error in the picture is that of the direction from its middle: an error along this direction does not count, and
/// near the middle an angle in space is a larger one in the picture.
#[test]
fn the_error_in_the_picture_has_two_dimensions() {
    let truth = |file: &str| Truth { axis_x: 0.0, axis_y: 0.5, axis_z: 0.75f64.sqrt(), ..truth(file, 1) };
    let turned = |file: &str, across_deg: f64, along_deg: f64| {
        let (a, b) = (across_deg.to_radians(), (30.0 + along_deg).to_radians());
        let axis = [b.sin() * a.sin(), b.sin() * a.cos(), b.cos()];
        let found = MeasuredDirection { axis, ..answer(file, 0.0, 0.0).found.unwrap() };
        Answer { found: Some(found), ..answer(file, 0.0, 0.0) }
    };
    let answers = [turned("a", 3.0, 0.0), turned("b", 1.0, 5.0)];
    let cases = pair(&answers, &[truth("a"), truth("b")], None).unwrap();
    let [e] = Evaluation::by_body(&cases).try_into().unwrap();
    let picture = e.errors.unwrap().picture.unwrap();
    assert!((picture.mean_deg - 2.0).abs() < 1e-9 && (picture.sigma_deg - 1.0).abs() < 1e-9, "{picture:?}");
    assert!((picture.mean_and_sigma_deg() - 3.0).abs() < 1e-9);
    let ahead = Answer {
        found: Some(MeasuredDirection { axis: [0.0, 0.0, 1.0], ..answers[0].found.unwrap() }),
        ..answers[0].clone()
    };
    let cases = pair(&[ahead], &[truth("a")], None).unwrap();
    assert_eq!(Evaluation::by_body(&cases)[0].errors.unwrap().picture, None);
}

#[test]
fn a_singular_covariance_has_no_nees_and_a_large_error_is_an_arc() {
    let mut opposite = answer("a", 0.0, 0.0);
    let (axis, covariance_rad2) = ([0.0, 0.0, 1.0], [0.0; 6]);
    opposite.found = Some(MeasuredDirection {
        axis,
        covariance_rad2,
        common_rad2: None,
        half_angle_deg: None,
        protection_deg: None,
    });
    let m = pair(&[opposite], &[truth("a", 1)], None).unwrap()[0].miss.unwrap();
    assert!((m.angle_deg - 90.0).abs() < 1e-9 && m.nees.is_none());
    let found = MeasuredDirection {
        axis: [0.0, 0.0, 1.0],
        covariance_rad2: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        common_rad2: None,
        half_angle_deg: None,
        protection_deg: None,
    };
    let m = Miss::new(&found, [0.0, 1.0, 0.0], 60.0).unwrap();
    assert!((m.nees.unwrap() - core::f64::consts::FRAC_PI_2.powi(2)).abs() < 1e-9);
    assert!(Miss::new(&found, [0.0; 3], 60.0).is_none());
}

#[test]
fn shares_count_every_picture() {
    let truths = [truth("a", 1), truth("b", 1), truth("c", 1), truth("d", 1), truth("e", 0), truth("f", 0)];
    let answers = [
        answer("x/a", 0.3, 0.0),
        answer("x/b", 0.0, 0.4),
        none("x/c", Status::NoLimb),
        // An error of 8° at a half-angle of 60° is more than a tenth.
        answer("x/d", 8.0, 0.0),
        answer("x/e", 0.0, 0.0),
        none("x/f", Status::NoLimb),
    ];
    let cases = pair(&answers, &truths, None).unwrap();
    let [e] = Evaluation::by_body(&cases).try_into().unwrap();
    assert_eq!((e.frames, e.with_limb, e.answered, e.false_answers), (6, 4, 3, 1));
    assert_eq!(e.answered_share(), 0.75);
    assert_eq!(e.unanswered.into_iter().collect::<Vec<_>>(), [("no-limb", 1)]);
    assert_eq!((e.horace.success, e.horace.false_negatives, e.horace.false_positives), (0.5, 0.5, Some(0.5)));
    let errors = e.errors.unwrap();
    assert!((errors.median_deg - 0.4).abs() < 1e-4 && (errors.worst_deg - 8.0).abs() < 0.06);
    // The answer without a limb in view is not part of the errors.
    assert_eq!((errors.answers, e.honesty.unwrap().answers), (3, 3));
}

#[test]
fn a_wrong_radius_is_no_success_of_horace() {
    let mut a = answer("a", 0.0, 0.0);
    a.found.as_mut().unwrap().half_angle_deg = Some(67.0);
    let cases = pair(&[a], &[truth("a", 1)], None).unwrap();
    assert_eq!(Evaluation::by_body(&cases)[0].horace.success, 0.0);
}

#[test]
fn the_suns_size_is_no_measure() {
    let mut a = Answer { body: "sun".into(), ..answer("a", 0.0, 0.0) };
    a.found.as_mut().unwrap().half_angle_deg = Some(90.0);
    let cases = pair(&[a], &[Truth { body: "sun".into(), ..truth("a", 1) }], None).unwrap();
    assert_eq!(cases[0].miss.unwrap().half_angle_ratio, None);
    assert_eq!(Evaluation::by_body(&cases)[0].horace.success, 1.0);
}

#[test]
fn what_does_not_belong_together_is_named() {
    let (t, a) = (truth("a", 1), answer("a", 0.0, 0.0));
    let says = |answers: &[Answer], truths: &[Truth]| pair(answers, truths, None).unwrap_err().to_string();
    let other = Answer { file: "z/b".into(), ..a.clone() };
    assert!(says(&[a.clone(), other], std::slice::from_ref(&t)).starts_with("b (earth) is among the results but"));
    assert!(
        says(std::slice::from_ref(&a), &[t.clone(), truth("b", 0)]).starts_with("b (earth) has a row in the truth")
    );
    assert!(says(&[a.clone(), a.clone()], std::slice::from_ref(&t)).ends_with("twice among the results"));
    assert!(says(std::slice::from_ref(&a), &[t.clone(), t.clone()]).ends_with("twice in the truth"));
    let moon = Answer { body: "moon".into(), ..a.clone() };
    assert!(says(&[moon], std::slice::from_ref(&t)).contains("are about moon, the truth about earth"));
    assert_eq!(says(&[], &[t]), "there are no results");
}

#[test]
fn bodies_are_evaluated_apart_and_unasked_ones_passed_over() {
    let body = |b: &str| Truth { body: b.into(), ..truth("a", 1) };
    let answer_about = |b: &str, x: f64| Answer { body: b.into(), ..answer("a", x, 0.0) };
    let cases = pair(
        &[answer_about("earth", 0.1), answer_about("moon", 0.5)],
        &[body("earth"), body("sun"), body("moon")],
        None,
    )
    .unwrap();
    let all = Evaluation::by_body(&cases);
    assert_eq!(all.iter().map(|e| (e.body.as_str(), e.frames)).collect::<Vec<_>>(), [("earth", 1), ("moon", 1)]);
    // The Moon has no nadir, and the camera has no altitude above it.
    let names: Vec<_> = cases.iter().map(|c| (c.altitude_km.is_some(), c.off_axis_name())).collect();
    assert_eq!(names, [(true, "off nadir"), (false, "off axis")]);
}

#[test]
fn groups_have_nice_ranges_and_hold_every_case() {
    let many: Vec<Truth> =
        (0..24).map(|i| Truth { altitude_km: 70.0 + 7.0 * f64::from(i), ..truth(&i.to_string(), 1) }).collect();
    let answers: Vec<Answer> = many.iter().map(|t| answer(&t.file, 0.01, 0.0)).collect();
    let cases = pair(&answers, &many, None).unwrap();
    let e = &Evaluation::by_body(&cases)[0];
    // The angle off nadir is the same for all pictures and the camera is not known, so only the altitude varies.
    let [by_altitude] = e.groups.as_slice() else { panic!("{:?}", e.groups) };
    assert_eq!((by_altitude.name, by_altitude.rows.first().unwrap().range), ("altitude", [50.0, 100.0]));
    assert_eq!(by_altitude.rows.iter().map(|r| r.with_limb).sum::<usize>(), 24);
}

#[test]
fn intervals_are_those_of_chi_square() {
    // Tables give 9.591 and 34.170 for χ² of 20 degrees of freedom at 2.5 % and 97.5 %; n = 10.
    let [low, high] = interval(10.0);
    assert!((low - 0.9591).abs() < 1e-4 && (high - 3.4170).abs() < 1e-4, "{low} {high}");
    let h = Honesty::from_nees(&[2.0; 10], 0.0).unwrap();
    assert!(h.is_within_interval() && (h.sigma_scale - 1.0).abs() < 1e-12);
    assert_eq!(h.within.map(|w| w.share), [0.0, 1.0, 1.0]);
    assert!((h.within[1].expected - 0.8647).abs() < 1e-4);
    assert!(
        !Honesty::from_nees(&[8.0; 10], 0.0).unwrap().is_within_interval() && Honesty::from_nees(&[], 0.0).is_none()
    );
}

#[test]
fn quantiles_and_steps() {
    assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), 2.0);
    assert_eq!(quantile(&[1.0, 2.0], 0.5), 1.5);
    assert!(quantile(&[], 0.5).is_nan());
    assert_eq!([0.3, 1.0, 28.0, 90.0].map(|x| nice_step(x).unwrap()), [0.5, 1.0, 50.0, 100.0]);
    assert!(nice_step(0.0).is_none());
}

#[test]
fn limb_in_view_is_the_circumference_of_a_whole_disc() {
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 640, 480, 500.0)).unwrap();
    let whole = limb_in_view_px(&camera, [0.0, 0.0, 1.0], 0.1);
    assert!((whole - core::f64::consts::TAU * 500.0 * 0.1f64.tan()).abs() < 0.01);
    assert_eq!(limb_in_view_px(&camera, [0.0, 0.0, -1.0], 0.1), 0.0);
    // Half of the disc is beyond the left border; a pinhole camera stretches the picture towards its corners.
    let half = limb_in_view_px(&camera, [-320.0, 0.0, 500.0], 0.1);
    assert!(half > 0.55 * whole && half < 0.7 * whole, "{half} {whole}");
}

#[test]
fn a_position_has_range_and_cross_range() {
    let position = MeasuredPosition { centre_km: [3.0, 0.0, 1004.0], covariance_km2: [9.0, 0.0, 0.0, 9.0, 0.0, 16.0] };
    let miss = PositionMiss::new(&position, [0.0, 0.0, 1000.0]).unwrap();
    assert!((miss.cross_range_km - 3.0).abs() < 1e-9 && (miss.nees.unwrap() - 2.0).abs() < 1e-9);
    assert!((miss.range_km - 4.0045).abs() < 1e-3 && (miss.range_sigmas - 1.0).abs() < 0.01, "{miss:?}");
    let mut a = answer("a", 0.0, 0.0);
    a.position = Some(position);
    let [x, y, z] = [0.0, 0.0, 1000.0].map(Some);
    let t = Truth { position_x_km: x, position_y_km: y, position_z_km: z, ..truth("a", 1) };
    let cases = pair(&[a], &[t], None).unwrap();
    let found = Evaluation::new(&[&cases[0]]).position.unwrap();
    assert!((found.nees - 2.0).abs() < 1e-9 && found.positions == 1 && found.nees_interval[0] < 1.0);
}

#[test]
fn the_classes_are_those_that_were_put_in() {
    // A wave over 400 pictures, one over 8, and an alternating error, whose differences are twice its size.
    let wave = |i: usize, period: f64| (i as f64 * core::f64::consts::TAU / period).sin() * 2f64.sqrt();
    let slow: Vec<f64> = (0..1200).map(|i| 0.5 + 0.3 * wave(i, 400.0)).collect();
    let classes = ErrorClasses::new(&slow).unwrap();
    assert!((classes.bias_deg - 0.5).abs() < 1e-9 && (classes.field_of_view_deg - 0.3).abs() < 0.01);
    assert!(classes.temporal_deg < 0.01 && classes.pixel_deg < 0.03, "{classes:?}");
    let middle: Vec<f64> = (0..1200).map(|i| 0.3 * wave(i, 16.0)).collect();
    let classes = ErrorClasses::new(&middle).unwrap();
    assert!(classes.pixel_deg > classes.field_of_view_deg && classes.pixel_deg > classes.temporal_deg, "{classes:?}");
    let draws = Counter::new(7, Stream::Encounter);
    let noise: Vec<f64> = (0..1200).map(|i| 0.2 * draws.normal(i)).collect();
    let classes = ErrorClasses::new(&noise).unwrap();
    assert!((classes.temporal_deg - 0.2).abs() < 0.02 && classes.field_of_view_deg < 0.05, "{classes:?}");
    assert!(ErrorClasses::new(&noise[..20]).is_none());
}

/// Answers with the same error of one sigma about x, of which three quarters of the variance are common.
fn alike(frames: usize) -> Vec<Answer> {
    let one = |i: usize| {
        let mut answer = answer(&format!("{i:03}"), 0.1, 0.0);
        let found = answer.found.as_mut().unwrap();
        found.common_rad2 = Some(found.covariance_rad2.map(|v| 0.75 * v));
        answer
    };
    (0..frames).map(one).collect()
}

fn means(answers: &[Answer]) -> Vec<Means> {
    let truths: Vec<Truth> = answers.iter().map(|a| truth(&a.file, 1)).collect();
    Evaluation::by_body(&pair(answers, &truths, None).unwrap())[0].means.clone()
}

#[test]
fn what_is_common_stays_in_a_mean() {
    let means = means(&alike(200));
    assert_eq!(means.iter().map(|m| (m.answers, m.groups)).collect::<Vec<_>>(), [(3, 66), (10, 20), (100, 2)]);
    for m in means {
        let n = m.answers as f64;
        assert!((m.nees * (0.75 + 0.25 / n) - 1.0).abs() < 1e-4, "{m:?}");
        assert!((m.nees_if_independent / n - 1.0).abs() < 1e-4, "{m:?}");
        assert_eq!(m.beyond_3_sigma, 0.0);
    }
}

/// 200 answers with the same error say little about its sigma: three quarters of the variance are one error.
#[test]
fn answers_with_common_errors_count_as_few() {
    let honesty = |answers: &[Answer]| {
        let truths: Vec<Truth> = answers.iter().map(|a| truth(&a.file, 1)).collect();
        Evaluation::by_body(&pair(answers, &truths, None).unwrap())[0].honesty.clone().unwrap()
    };
    let mut answers = alike(200);
    let h = honesty(&answers);
    assert!((h.independent - 200.0 / (1.0 + 199.0 * 0.5625)).abs() < 1e-6 && h.is_within_interval(), "{h:?}");
    answers.iter_mut().filter_map(|a| a.found.as_mut()).for_each(|f| f.common_rad2 = None);
    let h = honesty(&answers);
    assert!(h.independent == 200.0 && !h.is_within_interval(), "{h:?}");
}

#[test]
fn a_mean_is_of_consecutive_answers() {
    let mut answers = alike(103);
    answers[50] = none("050", Status::NoLimb);
    assert_eq!(means(&answers).iter().map(|m| (m.answers, m.groups)).collect::<Vec<_>>(), [(3, 33), (10, 10)]);
    // Results without the columns say nothing about means.
    answers.iter_mut().filter_map(|a| a.found.as_mut()).for_each(|f| f.common_rad2 = None);
    assert!(means(&answers).is_empty());
}

#[test]
fn an_error_above_the_protection_level_is_misleading() {
    let with_level = |file: &str, error_deg: f64, level_deg: Option<f64>| {
        let mut answer = answer(file, error_deg, 0.0);
        answer.found.as_mut().unwrap().protection_deg = level_deg;
        answer
    };
    let answers = [
        with_level("a", 0.3, Some(0.5)),
        with_level("b", 0.6, Some(0.5)),
        with_level("c", 0.0, Some(0.7)),
        with_level("d", 9.0, Some(0.5)),
        with_level("e", 9.0, None),
    ];
    let truths: Vec<Truth> = answers.iter().map(|a| truth(&a.file, u8::from(a.file != "d"))).collect();
    let evaluate = |answers: &[Answer]| Evaluation::by_body(&pair(answers, &truths, None).unwrap())[0].clone();
    let found = evaluate(&answers).integrity.unwrap();
    assert_eq!((found.answers, found.misleading, found.interval), (3, 1, share_interval(1, 3)));
    assert!((found.share - 1.0 / 3.0).abs() < 1e-12 && (found.median_deg - 0.5).abs() < 1e-12);
    // The larger sigma of every answer is 0.2 degrees.
    assert!((found.median_sigmas - 2.5).abs() < 1e-9, "{}", found.median_sigmas);
    let counts: Vec<_> = found.ranges.iter().map(|r| (r.up_to, r.with_limb, r.without_limb)).collect();
    assert_eq!(counts[..3], [(Some(0.25), 1, 0), (Some(0.5), 0, 0), (Some(0.75), 1, 0)]);
    assert_eq!(counts[3..], [(Some(1.0), 0, 0), (None, 1, 1)]);
    let without_level = answers.map(|a| with_level(&a.file, 0.1, None));
    assert!(evaluate(&without_level).integrity.is_none());
}
