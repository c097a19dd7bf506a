//! Errors of the inputs that a position fit does not estimate: limb height, orientation and semi-axes of the body
//! (math.md, 13.4).
//!
//! Each parameter moves the limb in scaled space by an angle dθ. With the outward vector q' = u cos α − e sin α at the
//! limb (a unit vector), the surface point q = U⁻¹q' and the normal U q' in the camera frame, in units of the mean
//! semi-axis:
//!
//! | parameter | dθ / tan α |
//! |---|---|
//! | limb height | ‖U q'‖ |
//! | rotation ψ of the body | (q × U q')·ψ |
//! | semi-axis a_i | (U q')_i q_i/a_i in the axes of the body |
//!
//! The edge of a sunlit body stands at half of the brightness inside of it. That brightness changes from the azimuth of
//! the Sun to the cusps, so that the shift that all points share (`covariance.bias_px`) changes along the limb, too.
//! The term is a first harmonic in the azimuth from the Sun, of the size of the shift.
//!
//! These are the terms of (13.5), written as residuals of the fit in scaled space. The fit converts the residual
//! cos α − σ·e = sin α dθ into errors of axis and half-angle, and those are errors of the position.

use super::part::part;
use super::sandwich::response;
use crate::base::linalg::{M3, V3, basis};
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::Target;
use crate::stages::fit::Fit;

/// Errors of (δ₁₂, δc) for a unit change of each parameter, in units of the mean semi-axis and radians.
pub(crate) struct Sensitivity<T> {
    pub(crate) by_limb: V3<T>,
    /// By a rotation of the body about each axis of the camera.
    pub(crate) by_rotation: [V3<T>; 3],
    /// By each semi-axis.
    pub(crate) by_axis: [V3<T>; 3],
    /// By a shift of one pixel that changes with the azimuth along the limb: its cosine and sine on the tangent basis.
    pub(crate) by_light: [V3<T>; 2],
}

impl<T: Real> Sensitivity<T> {
    /// Sums the signals over a part of the points. `None` if the part does not determine the cone.
    pub(crate) fn new(blocks: &[Block<T>], fit: &Fit<T>, target: &Target<T>) -> Option<Self> {
        let (b1, b2) = basis(&fit.e);
        // The sine comes from 1 − cos α, because for a small disc the cosine is 1 in single precision.
        let sin = (fit.k * (T::one() + fit.c)).max(T::ZERO).sqrt();
        let (tan, zero) = (sin / fit.c, V3::zeros());
        let to_body = target.camera_from_fixed.transpose();
        let mut normal = [T::ZERO; 6];
        let (mut limb, mut rotation, mut axes, mut light) = (zero, [zero; 3], [zero; 3], [zero; 2]);
        // The limb of a sphere does not feel a rotation, and exact semi-axes have no error.
        let turns = !target.scaling.is_uniform();
        let reshapes = target.radii_sigma_m > T::ZERO;
        part(blocks, fit).for_each(|row| {
            // The part has its own normal equations, so that a signal which the cone can follow is fitted completely.
            row.add_to(&mut normal);
            let per = T::one() / (row.x * row.x + row.y * row.y).max(T::from_f64(1e-20)).sqrt();
            let outward = (b1 * row.x + b2 * row.y) * (per * fit.c) - fit.e * sin;
            let n = target.scaling.to * outward;
            let across = row.shift();
            light[0] += across * (row.x * per);
            light[1] += across * (row.y * per);
            let h = row.h * (tan * sin);
            limb += h * n.dot(&n).sqrt();
            if turns {
                let turn = (target.scaling.from * outward).cross(&n);
                rotation.iter_mut().zip(turn.iter()).for_each(|(sum, turn)| *sum += h * *turn);
            }
            if reshapes {
                let (n, q) = (to_body * n, to_body * (target.scaling.from * outward));
                for i in 0..3 {
                    axes[i] += h * (n[i] * q[i] / target.semi_axes[i]);
                }
            }
        });
        let response: M3<T> = response(&fit.sums.with_normal(normal), fit.mean, true)?;
        let error = |sum: V3<T>| response * sum;
        Some(Self {
            by_limb: error(limb),
            by_rotation: rotation.map(error),
            by_axis: axes.map(error),
            by_light: light.map(error),
        })
    }
}
