//! The part of the joint covariance that the next epoch shares, on drawn errors.

use hzn_core::report::FreeCommon;

use super::*;

/// What one head of a flight has: its cone without the common errors, the covariance of these, and their values.
struct Shared {
    camera: Camera,
    /// Covariance of the common error of (δ₁, δ₂, δc), and the error.
    covariance: Matrix3<f64>,
    error: Vector3<f64>,
    turned_rad: Vector3<f64>,
    own_cos: f64,
}

/// 1-sigmas of the common errors of the flights: about each axis of a mount, of the cosine that a head has for itself,
/// and of the tilt of the limb.
const MOUNT_RAD: f64 = 1e-4;
const OWN_COS: f64 = 2e-4;
const TILT_RAD: f64 = 1.5e-4;

fn three(dice: &mut Dice) -> Vector3<f64> {
    Vector3::new(dice.normal(), dice.normal(), dice.normal())
}

impl Shared {
    /// Draws the common errors of a flight. They are `size` times as large as the errors of a single edge.
    fn draw(camera: Camera, size: f64, dice: &mut Dice) -> Self {
        let root = Matrix3::from_fn(|_, _| dice.normal() * size * EDGE_RAD);
        let error = root * three(dice);
        let (turned_rad, own_cos) = (three(dice) * MOUNT_RAD, dice.normal() * OWN_COS);
        Self { camera, covariance: root * root.transpose(), error, turned_rad, own_cos }
    }

    /// Returns the head of an epoch. `noise` is the size of the errors that are new in each epoch.
    fn see(&self, cos: f64, tilt_rad: Vector3<f64>, noise: f64, dice: &mut Dice) -> Free<f64> {
        let Camera { vehicle_from_camera, covariance } = &self.camera;
        let camera = Camera { vehicle_from_camera: *vehicle_from_camera, covariance: covariance * (noise * noise) };
        let free = camera.see(dice, cos + self.own_cos, self.turned_rad + tilt_rad);
        let basis = tangent(&(vehicle_from_camera.inverse() * Vector3::z()));
        let axis = Vector3::from(free.axis.xyz()) + basis[0] * self.error.x + basis[1] * self.error.y;
        let p = &self.covariance;
        let of_axis = p.fixed_view::<2, 2>(0, 0);
        let wide = nalgebra::Matrix3x2::from_columns(&basis);
        let upper = |m: Matrix3<f64>| [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33];
        let common = FreeCommon {
            covariance: Cov3::from_upper(upper(wide * of_axis * wide.transpose())),
            var_cos: p.m33,
            axis_with_cos: (basis[0] * p.m13 + basis[1] * p.m23).into(),
        };
        let sum = |a: [f64; 6], b: [f64; 6]| Cov3::from_upper(std::array::from_fn(|i| a[i] + b[i]));
        let with_cos = Vector3::from(free.axis_with_cos.unwrap()) + Vector3::from(common.axis_with_cos);
        Free {
            axis: unit::<Cam>(axis),
            covariance: sum(free.covariance.upper_rad2, common.covariance.upper_rad2),
            cos: free.cos + self.error.z,
            var_cos: free.var_cos + common.var_cos,
            axis_with_cos: Some(with_cos.into()),
            cos_per_px: free.cos_per_px,
            common: Some(common),
        }
    }

    fn head(&self, free: &Free<f64>) -> Option<Head<f64>> {
        let var = MOUNT_RAD * MOUNT_RAD;
        let mount = rotation(&self.camera.vehicle_from_camera);
        Head::new(free, &mount, &[var, 0.0, 0.0, var, 0.0, var], OWN_COS)
    }
}

/// Draws a flight of `epochs` epochs and returns their joint answers.
fn flight(azimuths_deg: &[f64], epochs: usize, size: f64, noise: f64, dice: &mut Dice) -> Vec<Joint<f64>> {
    let heads: Vec<Shared> = azimuths_deg.iter().map(|&a| Shared::draw(camera(a), size, dice)).collect();
    let tilt_rad = Vector3::new(dice.normal(), dice.normal(), 0.0) * TILT_RAD;
    let joint = |_| {
        // The height of the limb changes from epoch to epoch, which the axis does not see.
        let cos = HALF_ANGLE_RAD.cos() + 0.01 * dice.normal();
        let seen: Vec<_> = heads.iter().map(|head| head.head(&head.see(cos, tilt_rad, noise, dice))).collect();
        rig(1e-9, 1e-4).join(&seen, TILT_RAD).unwrap()
    };
    (0..epochs).map(joint).collect()
}

fn matrix(p: &Cov3<Vehicle, f64>) -> Matrix3<f64> {
    let rows = p.rows();
    Matrix3::from_fn(|i, j| rows[i][j])
}

const RIGS: [&[f64]; 4] = [&[0.0, 180.0], &[0.0, 90.0], &[0.0, 120.0, 240.0], &[0.0, 90.0, 180.0, 270.0]];

#[test]
fn the_common_part_is_never_above_the_whole() {
    let mut dice = Dice::new(21);
    for (trial, azimuths_deg) in (0..400).zip(RIGS.iter().cycle()) {
        let size = 0.01 * 3e3f64.powf(f64::from(trial) / 400.0);
        for joint in flight(azimuths_deg, 1, size, 1.0, &mut dice) {
            let (whole, common) = (matrix(&joint.covariance), matrix(&joint.common.unwrap()));
            let least = (whole - common).symmetric_eigenvalues().min();
            assert!(least >= -1e-12 * whole.trace(), "{azimuths_deg:?} {size}: {least} of {}", whole.trace());
            assert!(common.symmetric_eigenvalues().max() > 0.0 && (whole - common).trace() > 0.0);
        }
    }
}

#[test]
fn without_noise_the_whole_is_common() {
    let mut dice = Dice::new(22);
    for azimuths_deg in RIGS {
        let mut last = 1.0;
        for noise in [1.0, 0.1, 0.01, 1e-3] {
            let joint = flight(azimuths_deg, 1, 1.0, noise, &mut dice).pop().unwrap();
            let (whole, common) = (matrix(&joint.covariance), matrix(&joint.common.unwrap()));
            let rest = (whole - common).trace() / whole.trace();
            assert!(rest < last, "{azimuths_deg:?} {noise}: {rest} after {last}");
            last = rest;
        }
        assert!(last < 1e-4, "{azimuths_deg:?}: {last}");
    }
}

#[test]
fn a_head_with_an_unknown_common_part_leaves_that_of_the_answer_open() {
    let mut dice = Dice::new(23);
    let head = Shared::draw(camera(0.0), 1.0, &mut dice);
    let other = Shared::draw(camera(180.0), 1.0, &mut dice);
    let cos = HALF_ANGLE_RAD.cos();
    let mut free = [&head, &other].map(|own| own.see(cos, Vector3::zeros(), 1.0, &mut dice));
    free[1].common = None;
    let joint = rig(1e-9, 1e-4).join(&[head.head(&free[0]), other.head(&free[1])], 0.0).unwrap();
    assert!(joint.common.is_none());
}

/// Returns the mean NEES of the mean of `n` epochs over many flights, with the common part and without it.
fn nees_of_means(azimuths_deg: &[f64], n: usize, flights: usize) -> [f64; 2] {
    let mut dice = Dice::new(24);
    let mut sums = [0.0; 2];
    for _ in 0..flights {
        let joints = flight(azimuths_deg, n, 1.0, 1.0, &mut dice);
        let (mut mean, mut whole, mut common) = (Vector3::zeros(), Matrix3::zeros(), Matrix3::zeros());
        let per = 1.0 / n as f64;
        for joint in &joints {
            mean += Vector3::from(joint.axis.xyz()) * per;
            whole += matrix(&joint.covariance) * per;
            common += matrix(&joint.common.unwrap()) * per;
        }
        for (sum, p) in sums.iter_mut().zip([common + (whole - common) * per, whole * per]) {
            let [x, y, det] = [mean.x, mean.y, p.m11 * p.m22 - p.m12 * p.m12];
            *sum += (p.m22 * x * x - 2.0 * p.m12 * x * y + p.m11 * y * y) / det;
        }
    }
    sums.map(|sum| sum / flights as f64)
}

#[test]
fn means_of_many_epochs_have_an_honest_covariance_with_the_common_part_only() {
    for azimuths_deg in RIGS {
        for (n, flights) in [(10, 300), (100, 300)] {
            let [with, white] = nees_of_means(azimuths_deg, n, flights);
            assert!((1.6..2.4).contains(&with), "{azimuths_deg:?}, {n} epochs: NEES {with}");
            assert!(white > 0.5 * n as f64, "{azimuths_deg:?}, {n} epochs taken as independent: NEES {white}");
        }
    }
}
