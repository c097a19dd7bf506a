//! The misalignment as Braun & Barf 2022 print it diverges: equation (48) has the error in the camera frame, and (50)
//! corrects the mount as if it were in the body frame.

use crate::common::Draws;
use hzn_nav::filter::predict_direction;
use hzn_nav::frames::{Cam, Fixed, Rotation, Vector, Vehicle};
use nalgebra::{SMatrix, SVector, UnitQuaternion};

const DEG: f64 = core::f64::consts::PI / 180.0;
/// 1-sigma of a direction, rad.
const NOISE: f64 = 0.05 * DEG;
/// Attitude in ECEF, and the misalignments of two cameras in their frames.
const N: usize = 9;

/// How a correction of a mount is applied.
#[derive(Clone, Copy)]
enum Feedback {
    /// R_bc exp[ψ×], with the error in the camera frame, as its derivative has it.
    Camera,
    /// exp[ψ×] R_bc, as (50) is printed.
    Printed,
}

/// A vehicle that turns with known rates sees nadir and Sun with two cameras for 300 s. Returns the error of the
/// attitude at the end, rad.
fn fly(seed: u64, feedback: Feedback) -> f64 {
    let mut draws = Draws(seed);
    let told = [UnitQuaternion::from_euler_angles(1.9, 0.1, -0.4), UnitQuaternion::from_euler_angles(-0.3, 1.2, 0.7)];
    let told = told.map(Rotation::<Cam, Vehicle>::from);
    let mounts = told.map(|m| m * Rotation::from_scaled_axis(draws.vector(DEG)));
    let references = [Vector::<Fixed>::new(-0.4, -0.2, -0.9).normalize(), Vector::new(0.3, -0.8, 0.5).normalize()];
    let mut truth = Rotation::<Vehicle, Fixed>::identity() * Rotation::from_scaled_axis(draws.vector(2.0));
    let mut attitude = Rotation::from_scaled_axis(draws.vector(2.0 * DEG)) * truth;
    let mut estimated = told;
    let mut p = SMatrix::<f64, N, N>::zeros();
    for i in 0..N {
        p[(i, i)] = if i < 3 { (2.0 * DEG).powi(2) } else { DEG.powi(2) };
    }
    for second in 0..300 {
        let t = f64::from(second);
        let turn = Rotation::from_scaled_axis(Vector::new(0.10 * (0.3 * t).sin(), 0.08 * (0.3 * t).cos(), 0.15));
        (truth, attitude) = (truth * turn, attitude * turn);
        for (camera, reference) in references.iter().enumerate() {
            let seen = (truth * mounts[camera]).inverse() * *reference + draws.vector(NOISE);
            let (predicted, by_attitude, by_mount) = predict_direction(&attitude, &estimated[camera], reference);
            let mut h = SMatrix::<f64, 3, N>::zeros();
            h.fixed_view_mut::<3, 3>(0, 0).copy_from(&by_attitude);
            h.fixed_view_mut::<3, 3>(0, 3 + 3 * camera).copy_from(&by_mount);
            let noise = SMatrix::<f64, 3, 3>::identity() * NOISE.powi(2);
            let s = h * p * h.transpose() + noise;
            let k = p * h.transpose() * s.try_inverse().unwrap();
            let error: SVector<f64, N> = k * (seen - predicted).into_inner();
            let left = SMatrix::<f64, N, N>::identity() - k * h;
            p = left * p * left.transpose() + k * noise * k.transpose();
            let part = |first: usize| error.fixed_rows::<3>(first).into_owned();
            attitude = Rotation::from_scaled_axis(part(0).into()) * attitude;
            for (i, mount) in estimated.iter_mut().enumerate() {
                let turn = part(3 + 3 * i);
                *mount = match feedback {
                    Feedback::Camera => *mount * Rotation::from_scaled_axis(turn.into()),
                    Feedback::Printed => Rotation::from_scaled_axis(turn.into()) * *mount,
                };
            }
        }
    }
    attitude.angle_to(&truth)
}

#[test]
fn the_printed_feedback_of_the_misalignment_diverges() {
    let rms = |feedback: Feedback| {
        let errors = (0..20).map(|seed| fly(500 + seed, feedback).powi(2));
        (errors.sum::<f64>() / 20.0).sqrt() / DEG
    };
    let (right, printed) = (rms(Feedback::Camera), rms(Feedback::Printed));
    assert!(right < 0.2, "{right}°");
    assert!(printed > 5.0, "{printed}°");
}
