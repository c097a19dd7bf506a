use super::*;
use proptest::prelude::*;

fn lenses() -> [Config; 5] {
    let kb = |k: &[f64], theta: Option<f64>| Config {
        k: heapless::Vec::from_slice(k).unwrap(),
        theta_max_deg: theta,
        ..Config::ideal(Model::KannalaBrandt, 1920, 1080, 600.0)
    };
    [
        kb(&[0.05, -0.01, 0.004, -0.001], Some(110.0)),
        kb(&[-0.05, -0.004, 0.001, -0.0001], Some(110.0)),
        Config::ideal(Model::Equidistant, 384, 288, 92.0),
        Config::ideal(Model::Pinhole, 1920, 1080, 889.0),
        Config {
            k: heapless::Vec::from_slice(&[-0.28, 0.07, 0.0002, 0.00002, 0.0]).unwrap(),
            ..Config::ideal(Model::BrownConrady, 752, 480, 460.0)
        },
    ]
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
    fn derivative_equals_central_difference(which in 0usize..5, fx in 0.02..0.98f64, fy in 0.02..0.98f64) {
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
