use super::*;
use proptest::prelude::*;
use std::vec;
use std::vec::Vec;

fn lenses() -> Vec<Config> {
    let kb = |k: &[f64], theta: Option<f64>| Config {
        k: heapless::Vec::from_slice(k).unwrap(),
        theta_max_deg: theta,
        ..Config::ideal(Model::KannalaBrandt, 1920, 1080, 600.0)
    };
    #[allow(unused_mut, reason = "a build without the feature has no more lenses")]
    let mut lenses = vec![
        kb(&[0.05, -0.01, 0.004, -0.001], Some(110.0)),
        kb(&[-0.05, -0.004, 0.001, -0.0001], Some(110.0)),
        Config::ideal(Model::Equidistant, 384, 288, 92.0),
        Config::ideal(Model::Pinhole, 1920, 1080, 889.0),
        Config {
            k: heapless::Vec::from_slice(&[-0.28, 0.07, 0.0002, 0.00002, 0.0]).unwrap(),
            ..Config::ideal(Model::BrownConrady, 752, 480, 460.0)
        },
    ];
    #[cfg(feature = "kalibr")]
    lenses.extend([
        with(Model::DoubleSphere, &[-0.18, 0.59], 157.0),
        with(Model::DoubleSphere, &[0.3, 0.45], 460.0),
        with(Model::Eucm, &[0.63, 1.04], 160.0),
        with(Model::Eucm, &[0.4, 0.8], 460.0),
    ]);
    lenses
}

#[cfg(feature = "kalibr")]
fn with(model: Model, k: &[f64], focal_px: f64) -> Config {
    Config {
        k: heapless::Vec::from_slice(k).unwrap(),
        theta_max_deg: Some(80.0),
        ..Config::ideal(model, 752, 480, focal_px)
    }
}

/// Compares the lenses with the papers' equations in space, for rays of any length.
#[cfg(feature = "kalibr")]
#[test]
fn kalibr_lenses_project_as_their_papers_say() {
    let double_sphere = |[xi, alpha]: [f64; 2], [x, y, z]: [f64; 3]| {
        let d1 = (x * x + y * y + z * z).sqrt();
        let d2 = (x * x + y * y + (xi * d1 + z) * (xi * d1 + z)).sqrt();
        let below = alpha * d2 + (1.0 - alpha) * (xi * d1 + z);
        [x / below, y / below]
    };
    let eucm = |[alpha, beta]: [f64; 2], [x, y, z]: [f64; 3]| {
        let d = (beta * (x * x + y * y) + z * z).sqrt();
        let below = alpha * d + (1.0 - alpha) * z;
        [x / below, y / below]
    };
    for config in lenses().iter().filter(|c| c.k.len() == 2) {
        let camera = Camera::<f64>::try_new(config).unwrap();
        let k = [config.k[0], config.k[1]];
        for ray in [[0.0, 0.0, 2.0], [0.3, -0.2, 1.0], [-2.0, 1.0, 3.0], [0.4, 0.9, 1.2], [0.0, -1e-7, 1.0]] {
            let [x, y] = if config.model == Model::Eucm { eucm(k, ray) } else { double_sphere(k, ray) };
            let Some(p) = camera.project(&UnitVec3::try_new(ray).unwrap()) else {
                panic!("{:?} {ray:?} is beyond the image circle", config.model)
            };
            let off = (p.u - config.cx_px - config.fx_px * x).abs() + (p.v - config.cy_px - config.fy_px * y).abs();
            assert!(off < 1e-9, "{:?} {ray:?}: {off:e}", config.model);
        }
    }
}

/// The point in the middle of the picture has a ray and a derivative, though sin θ/ρ is 0/0 there.
#[test]
fn the_middle_of_the_picture_has_a_derivative() {
    for config in lenses() {
        let camera = Camera::<f64>::try_new(&config).unwrap();
        let middle = ImagePoint { u: config.cx_px, v: config.cy_px };
        let near = ImagePoint { u: config.cx_px + 1e-4, v: config.cy_px };
        let (a, b) = (camera.ray(middle).unwrap().jacobian(), camera.ray(near).unwrap().jacobian());
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((a - b).abs() < 1e-6, "{:?}: {a} {b}", config.model);
        }
    }
}

fn round_trip<T: Real>(tolerance_rad: f64) {
    for config in lenses() {
        let camera = Camera::<T>::try_new(&config).unwrap();
        for i in 0..500 {
            let theta = camera.theta_max_rad().to_f64() * 0.995 * f64::from(i) / 500.0;
            let (sp, cp) = libm::sincos(f64::from(i) * 2.4);
            let (st, ct) = libm::sincos(theta);
            let d = UnitVec3::try_new([T::from_f64(st * cp), T::from_f64(st * sp), T::from_f64(ct)]).unwrap();
            let p = camera.project(&d).unwrap();
            // A Brown-Conrady corner may be cut by the tangential terms.
            let Some(back) = camera.unproject(p) else { continue };
            let off = back.angle_rad(&d).to_f64();
            assert!(off < tolerance_rad, "{:?} theta {theta}: {off:e}", config.model);
        }
    }
}

#[test]
fn there_and_back() {
    round_trip::<f64>(1e-11);
    round_trip::<f32>(2e-6);
}

proptest! {
    #[test]
    fn derivative_equals_central_difference(which in 0usize..lenses().len(), fx in 0.02..0.98f64, fy in 0.02..0.98f64) {
        let config = &lenses()[which];
        let camera = Camera::<f64>::try_new(config).unwrap();
        let p = ImagePoint { u: fx * f64::from(config.width), v: fy * f64::from(config.height) };
        let h = 1e-3;
        let at = |du: f64, dv: f64| camera.unproject(ImagePoint { u: p.u + du, v: p.v + dv }).map(|d| d.xyz());
        let near = [at(h, 0.), at(-h, 0.), at(0., h), at(0., -h)];
        let (Some(ray), [Some(r), Some(l), Some(d), Some(u)]) = (camera.ray(p), near) else {
            return Ok(());
        };
        let j = ray.jacobian();
        for i in 0..3 {
            prop_assert!((j[i][0] - (r[i] - l[i]) / (2.0 * h)).abs() < 2e-8, "{:?} {j:?}", config.model);
            prop_assert!((j[i][1] - (d[i] - u[i]) / (2.0 * h)).abs() < 2e-8);
        }
    }
}

#[test]
fn folded_lens_is_refused_with_its_limit() {
    let mut config = lenses()[0].clone();
    config.theta_max_deg = None;
    let error = Camera::<f64>::try_new(&config);
    // 1920 × 1080 at f = 600 px ends before the lens folds; a longer picture does not.
    assert!(error.is_ok());
    config.width = 4000;
    config.cx_px = 2000.0;
    let error = Camera::<f64>::try_new(&config).unwrap_err();
    assert_eq!(error.field, "camera.k");
    let Limit::Monotone(deg) = error.limit else { panic!("{error}") };
    assert!((deg - 117.6309).abs() < 1e-3, "{deg}");
    config.theta_max_deg = Some(116.0);
    assert_eq!(Camera::<f64>::try_new(&config).unwrap_err().field, "camera.theta_max_deg");
    config.theta_max_deg = Some(115.0);
    assert!(Camera::<f64>::try_new(&config).is_ok());
}

#[test]
fn nonsense_is_refused_by_field() {
    let good = Config::ideal(Model::Pinhole, 640, 480, 500.0);
    let refused = |change: fn(&mut Config)| {
        let mut c = good.clone();
        change(&mut c);
        Camera::<f32>::try_new(&c).unwrap_err().field
    };
    assert_eq!(refused(|c| c.fx_px = 0.0), "camera.fx_px");
    assert_eq!(refused(|c| c.fy_px = f64::NAN), "camera.fy_px");
    assert_eq!(refused(|c| c.cx_px = 1e6), "camera.cx_px");
    assert_eq!(refused(|c| c.width = 0), "camera.width");
    assert_eq!(refused(|c| c.k.push(0.1).unwrap()), "camera.k");
    assert_eq!(refused(|c| c.theta_max_deg = Some(89.5)), "camera.theta_max_deg");
}

/// Compares the equation with the checked camera, and its derivatives with differences.
#[test]
fn the_equation_agrees_with_the_camera() {
    for config in lenses() {
        let camera = Camera::<f64>::try_new(&config).unwrap();
        let lens = Equation::new(&config);
        for direction in [[0.0, 0.0, 2.0], [0.3, -0.2, 1.0], [-0.4, 0.1, 0.9], [0.0, 1e-9, 1.0], [0.9, 0.4, 1.1]] {
            let Some(point) = camera.project(&UnitVec3::try_new(direction).unwrap()) else { continue };
            let projected = lens.project(direction).unwrap();
            assert!((projected.point.u - point.u).abs() < 1e-9 && (projected.point.v - point.v).abs() < 1e-9);
            let difference = |changed: &Equation, moved: [f64; 3], step: f64| {
                let p = changed.project(moved).unwrap().point;
                [(p.u - point.u) / step, (p.v - point.v) / step]
            };
            let agrees = |by: [f64; 2], expected: [f64; 2]| {
                let error = (by[0] - expected[0]).hypot(by[1] - expected[1]);
                assert!(error < 1e-3 * (1.0 + by[0].hypot(by[1])), "{config:?} {direction:?}: {by:?} {expected:?}");
            };
            for axis in 0..3 {
                let mut moved = direction;
                moved[axis] += 1e-6;
                agrees([0, 1].map(|row| projected.by_direction[row][axis]), difference(&lens, moved, 1e-6));
            }
            for (place, which) in config.model.intrinsics().iter().enumerate() {
                let mut changed = config.clone();
                changed.set_intrinsic(*which, config.intrinsic(*which).unwrap() + 1e-6);
                agrees(
                    [0, 1].map(|row| projected.by_intrinsics[row][place]),
                    difference(&Equation::new(&changed), direction, 1e-6),
                );
            }
        }
        assert!(lens.project([0.0; 3]).is_none());
    }
}
