//! Limb, Sun and stars one after the other, against one adjustment of all three.

use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

use super::tests::{DEFAULT, Flight, lens};
use super::{Sight, Unknowns, View, estimate, estimate_track, fit, track};
use crate::draws::Draws;
use crate::points::{Point, Points, calibrate};

/// Stars in six pictures, with white noise of their places.
fn stars(real: &Config, noise_px: f64, draws: &mut Draws) -> Vec<Points> {
    let camera = Camera::<f64>::try_new(real).unwrap();
    let mut picture = |n: u32| {
        let turn = Rotation3::from_euler_angles(f64::from(n), 0.3 * f64::from(n), 2.0);
        let mut star = || {
            let at = [959.0 * draws.uniform(), 719.0 * draws.uniform()];
            let ray = camera.unproject(ImagePoint { u: at[0], v: at[1] }).unwrap();
            let direction = (turn * Vector3::from(ray.xyz())).into();
            Point { at_px: at.map(|x| x + noise_px * draws.normal()), direction }
        };
        Points { name: format!("{n}.png"), points: (0..40).map(|_| star()).collect() }
    };
    (0..6).map(&mut picture).collect()
}

/// Discs of the Sun all over the picture, with white noise of their centres.
fn suns(real: &Config, noise_px: f64, draws: &mut Draws) -> Vec<Sight> {
    let camera = Camera::<f64>::try_new(real).unwrap();
    let turn = Rotation3::new(Vector3::new(0.01, -0.02, 0.015));
    let one = |k: usize| {
        let (u, v) = (20.0 + 920.0 * draws.uniform(), 20.0 + 680.0 * draws.uniform());
        let ray = camera.unproject(ImagePoint { u, v }).unwrap();
        let point_px = [u + noise_px * draws.normal(), v + noise_px * draws.normal()];
        Sight { name: k.to_string(), point_px, direction: (turn * Vector3::from(ray.xyz())).into() }
    };
    (0..60).map(one).collect()
}

/// One camera that saw limb, Sun and stars.
struct Camera3 {
    real: Config,
    flight: Flight,
    views: Vec<View>,
    suns: Vec<Sight>,
    /// The calibration from the stars.
    by_stars: Config,
}

impl Camera3 {
    fn new(seed: u64, stars_px: f64, suns_px: f64) -> Self {
        let mut draws = Draws(seed);
        let real = lens(90.0);
        let flight = Flight::new(real.clone(), seed);
        let by_stars = calibrate(Model::KannalaBrandt, [960, 720], &stars(&real, stars_px, &mut draws)).unwrap().camera;
        let views = flight.views();
        Self { suns: suns(&real, suns_px, &mut draws), views, flight, by_stars, real }
    }

    fn with_limb(&self, before: &Config) -> Config {
        estimate(&Unknowns::new(before, &[]), &self.flight.body(), &self.views, DEFAULT).unwrap().camera
    }

    fn with_sun(&self, before: &Config) -> Config {
        estimate_track(&Unknowns::new(before, &[]), &self.suns).unwrap().camera
    }

    /// Returns the values and the covariance of one adjustment: the information of each part adds.
    fn at_once(&self, unknowns: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        let prior = inverse(&unknowns.covariance);
        let n = unknowns.list.len();
        let limb = fit::Fit::new(unknowns, &self.flight.body(), &self.views, DEFAULT).unwrap();
        let first = limb.layout.first_intrinsic();
        let of_limb = inverse(&limb.solution.covariance.view((first, first), (n, n)).into_owned());
        let right_limb = &of_limb * limb.changes();
        // What edges have in common is an error of this flight: its information is smaller by it.
        let own = &of_limb - &prior;
        let common = limb.systematic(unknowns) + DMatrix::identity(n, n) * 1e-18;
        let smaller = (DMatrix::identity(n, n) + &own * &common).try_inverse().unwrap();
        let sights: Vec<&Sight> = self.suns.iter().collect();
        let sun = track::Fit::new(unknowns, &sights).unwrap();
        let of_sun = inverse(&sun.covariance.view((3, 3), (n, n)).into_owned());
        let right_sun = &of_sun * &sun.changes;
        let covariance = inverse(&(&prior + &smaller * own + (of_sun - &prior)));
        let changes = &covariance * (smaller * right_limb + right_sun);
        let before = DVector::from_iterator(n, unknowns.list.iter().map(|i| unknowns.before.intrinsic(*i).unwrap()));
        (before + changes, covariance)
    }
}

fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let scale = DMatrix::from_diagonal(&matrix.diagonal().map(|d| 1.0 / d.sqrt()));
    let inverse = (&scale * matrix * &scale).try_inverse().unwrap();
    let whole = &scale * inverse * &scale;
    (&whole + whole.transpose()) * 0.5
}

/// The camera file has the whole covariance, so one after the other is one adjustment: in either order the values are
/// the same within a fraction of a sigma, and so are the sigmas.
#[test]
fn limb_and_sun_follow_the_stars_in_either_order() {
    let seeds = if std::env::var_os("HZN_ALL").is_some() { 8 } else { 2 };
    for (name, stars_px, suns_px) in [
        ("stars 0.05 px, Sun 0.1 px", 0.05, 0.1),
        ("stars 0.5 px, Sun 0.1 px", 0.5, 0.1),
        ("stars 2 px, Sun 0.05 px", 2.0, 0.05),
        ("stars 2 px, Sun 2 px", 2.0, 2.0),
    ] {
        let (mut off, mut ratio, mut between, mut truth) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for seed in 1..=seeds {
            let camera = Camera3::new(8100 + seed, stars_px, suns_px);
            let unknowns = Unknowns::new(&camera.by_stars, &[]);
            let (want, covariance) = camera.at_once(&unknowns);
            let limb_first = camera.with_sun(&camera.with_limb(&camera.by_stars));
            let sun_first = camera.with_limb(&camera.with_sun(&camera.by_stars));
            for (i, which) in unknowns.list.iter().enumerate() {
                let sigma = covariance[(i, i)].sqrt();
                let values = [&limb_first, &sun_first].map(|c| c.intrinsic(*which).unwrap());
                let sigmas = [&limb_first, &sun_first].map(|c| {
                    let given = c.covariance.as_ref().unwrap();
                    let place = given.order.iter().position(|i| i == which).unwrap();
                    given.rows[place][place].sqrt()
                });
                off.extend(values.map(|value| (value - want[i]).abs() / sigma));
                ratio.extend(sigmas.map(|s| s / sigma));
                between.push((values[0] - values[1]).abs() / sigmas[0].min(sigmas[1]));
                let real = camera.real.intrinsic(*which).unwrap_or(0.0);
                truth.extend([0, 1].map(|k| ((values[k] - real) / sigmas[k]).powi(2)));
            }
        }
        let most = |all: &[f64]| all.iter().copied().fold(0.0, f64::max);
        let least = ratio.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        let rms = (off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64).sqrt();
        println!(
            "{name}: from the joint value {rms:.2} sigma RMS, at most {:.2}, sigma over the joint one {least:.2} to \
             {:.2}, between the orders at most {:.2} sigma, mean square of errors over variances {mean:.2}",
            most(&off),
            most(&ratio),
            most(&between)
        );
        // Information that makes no sigma smaller by a tenth is not written: half a sigma.
        assert!(rms < 0.5 && most(&off) < 1.2 && most(&between) < 1.2, "{name}: {rms} {off:?} {between:?}");
        assert!(least > 0.95 && most(&ratio) < 1.13, "{name}: {ratio:?}");
        // The eight parameters of two cameras are few independent errors.
        let [lowest, highest] = if seeds < 8 { [0.1, 3.0] } else { [0.5, 2.0] };
        assert!((lowest..highest).contains(&mean), "{name}: {mean}");
    }
}
