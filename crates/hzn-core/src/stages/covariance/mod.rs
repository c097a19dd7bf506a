//! Covariance of the fit with correlated errors of neighbouring edge points, in one pass.
//!
//! Pixel errors in x and y are independent Gauss-Markov processes along the edge, with variance R and the correlation ρ
//! = exp(−Δs/L) from point to point. Let q = w h (the row in the normal equations) and b = q gᵀ. The covariance of the
//! fit is P = N⁻¹ (R X) N⁻¹, with X = Σ Σ b ρ… bᵀ over all pairs. The double sum reduces to a recursion: with c₁ = b₁
//! and c_{j+1} = ρ_j c_j + b_{j+1}, X = Σ (1 − ρ_j²) c_j c_jᵀ, where the last ρ is 0. With independent errors instead,
//! sigma would be about twenty times too small.
//!
//! R and L come from the configuration or from the residuals ([`Noise`]). Errors that all points of the edge share do
//! not appear in the residuals; each of them adds a term. Last, the expected half-angle is fused.

mod answer;
pub(crate) mod braun_barf;
mod common;
pub(crate) mod consider;
mod elliptic;
mod fusion;
mod gauss_markov;
mod light;
mod noise;
mod part;
pub(crate) mod position;
pub mod reml;
mod sandwich;
mod terminator;
mod third_axis;
mod uneven;
mod weather;

use crate::base::linalg::M3;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::camera::Camera;
use crate::model::body::Expected;
use crate::stages::fit::{self, Fit};

pub use crate::model::edge_noise::{Config, Method, Noise};
pub use crate::model::error_budget::{ErrorBudget, Term};
use answer::ConeCovariance;
pub(crate) use answer::Fused;
#[cfg(all(test, feature = "position"))]
pub(crate) use answer::Located;
use fusion::fused;
pub(crate) use gauss_markov::correlated;
pub(crate) use noise::measured_length_px;
pub(crate) use position::place;
pub(crate) use sandwich::{response, sandwich};

/// Computes the covariance of the fit from all sources of error, and then fuses the expected half-angle. The noise is
/// never below the values of the configuration. The contribution of each source is recorded in `budget`.
pub(crate) fn fuse<T: Real>(
    blocks: &[Block<T>],
    fit: &Fit<T>,
    expected: &Expected<T>,
    config: &Config,
    fit_config: &fit::Config,
    camera: &Camera<T>,
    mut budget: Option<&mut ErrorBudget<T>>,
) -> Option<Fused<T>> {
    if cfg!(feature = "dlr") && config.method == Method::BraunBarf {
        return braun_barf::fused(blocks, fit, config);
    }
    let noise = noise::EdgeNoiseModel::new(fit, config);
    if let Some(quadric) = fit.quadric() {
        let p = elliptic::covariance(blocks, quadric, noise.length_px) * noise.variance;
        let edge = noise.edge(p.m33);
        // Only the errors of the edge points are known here.
        let covariance = ConeCovariance { whole: p, common: M3::zeros(), late: M3::zeros() };
        return fused(fit, &covariance, edge, expected, fit_config, budget);
    }
    let response = response(&fit.sums, fit.mean, fit.free)?;
    let p = sandwich(&response, &noise.correlated(blocks, fit, expected));
    let mut add = |term: Term, more: &M3<T>| {
        if let Some(budget) = budget.as_deref_mut() {
            budget.record(term, more);
        }
    };
    add(Term::EdgeNoise, &p);
    // The part of the edge noise is taken before the other terms are added, because a gate replaces this part alone.
    let mut edge = noise.edge(p.m33);
    let mut p = ConeCovariance { whole: p, common: M3::zeros(), late: M3::zeros() };
    add_to(&mut p, blocks, fit, expected, &noise, camera, |term, more| {
        if term == Term::Lens {
            edge.lens_var_cos = more.m33;
        }
        add(term, more);
    })?;
    // Only of a disc, both sides can be in view.
    if fit.free && expected.is_in_sunlight && expected.sun_seen.is_none() && expected.fits_into(camera) {
        terminator::widen(blocks, fit, expected, &mut p);
    }
    if let Some(target) = expected.target().filter(|_| fit.free) {
        let mut fused = position::fused(blocks, fit, &p, edge, expected, target, fit_config, budget)?;
        if let Some(located) = &mut fused.located {
            let limit_rad = fit_config.yaw_limit_deg.to_radians();
            located.turn = third_axis::measured(blocks, fit, expected, target, config, camera, limit_rad);
        }
        return Some(fused);
    }
    fused(fit, &p, edge, expected, fit_config, budget)
}

/// Adds the errors that all points share to the covariance of the edge noise, and calls `add` with each of them.
fn add_to<T: Real>(
    p: &mut ConeCovariance<T>,
    blocks: &[Block<T>],
    fit: &Fit<T>,
    expected: &Expected<T>,
    noise: &noise::EdgeNoiseModel<T>,
    camera: &Camera<T>,
    mut add: impl FnMut(Term, &M3<T>),
) -> Option<()> {
    // Variance of the axis that the residuals add for a tilt and a bend.
    let mut shown = T::ZERO;
    let light = common::add_terms(blocks, fit, expected, noise, camera, |term, more| {
        if term == Term::CommonBend {
            // Half of the bend looks like another half-angle. If it were added before the fusion, the expected
            // half-angle would get more weight in every picture.
            p.late += *more;
        } else {
            p.whole += *more;
            p.common += *more;
        }
        if matches!(term, Term::CommonTilt | Term::CommonBend) {
            shown += more.m11 + more.m22;
        }
        add(term, more);
    })?;
    if expected.weather_m > T::ZERO {
        let more = weather::covariance(blocks, fit, expected)?;
        p.whole += more;
        p.common += more;
        add(Term::Weather, &more);
    }
    uneven::add_terms(fit, expected, shown, light, |term, more| {
        p.late += *more;
        add(term, more);
    });
    Some(())
}
