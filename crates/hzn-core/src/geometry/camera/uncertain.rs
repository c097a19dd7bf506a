//! The effect of calibration errors: 1-sigma modes of the intrinsic parameters, and the motion of a ray's image point
//! with each parameter.
//!
//! Changes of parameters are relative: those of a focal length are fractions of it, those of the principal point are in
//! focal lengths. In these units a rectangle of the picture and a scaled picture have the same numbers.

use super::config::Config;
use super::intrinsic::{INTRINSICS, Intrinsic};
use super::temperature;
use crate::base::error::{ConfigError, Limit, require};
use crate::base::real::Real;

/// 1-sigma changes of all parameters at once. The modes are independent of each other; their outer products add up to
/// the covariance.
// Independent modes replace the matrix, so that each one moves the fit once and the covariance adds up squares.
pub(super) type Modes<T> = heapless::Vec<[T; INTRINSICS], INTRINSICS>;

/// Returns the modes of a calibration, and last that of a temperature that is not told.
pub(super) fn modes<T: Real>(config: &Config) -> Result<Modes<T>, ConfigError> {
    let mut modes = modes_of_calibration(config)?;
    if let Some(mode) = temperature::mode(config.temperature, [config.fx_px, config.fy_px]) {
        // There is room: the check of the configuration refuses a sigma next to a covariance of all parameters.
        let _ = modes.push(mode);
    }
    Ok(modes)
}

/// Returns the modes of a calibration, from its covariance or, without one, from its scalar sigmas. There are none when
/// all sigmas are 0.
fn modes_of_calibration<T: Real>(config: &Config) -> Result<Modes<T>, ConfigError> {
    let mut modes = Modes::new();
    if let Some(given) = &config.covariance {
        let order = &given.order;
        let field = "camera.covariance.order";
        let places = order.iter().map(|i| config.model.index_of(*i));
        for (n, place) in places.clone().enumerate() {
            let rule = "this lens model does not have the parameter";
            require(place.is_some(), field, n as f64, Limit::Rule(rule))?;
            require(
                // A parameter that is listed twice would have two variances, and the second would silently replace the
                // first.
                !places.clone().take(n).any(|p| p == place),
                field,
                n as f64,
                Limit::Rule("the parameter is listed twice"),
            )?;
        }
        let n = order.len();
        let square = given.rows.len() == n && given.rows.iter().all(|row| row.len() == n);
        let field = "camera.covariance.rows";
        let rule = "must be a square matrix with one row and one column for each name in order";
        require(square && n > 0, field, given.rows.len() as f64, Limit::Rule(rule))?;
        for column in triangle(&given.rows)?.iter().take(n) {
            let mut mode = [T::ZERO; INTRINSICS];
            for ((value, intrinsic), place) in column.iter().zip(order).zip(places.clone()) {
                if let Some(slot) = place.and_then(|p| mode.get_mut(p)) {
                    *slot = T::from_f64(value / unit(*intrinsic, config));
                }
            }
            // There is room for one mode per parameter.
            let _ = modes.push(mode);
        }
        return Ok(modes);
    }
    let focal = config.focal_sigma_percent * 0.01;
    let mut push = |mode: [(usize, f64); 2]| {
        if mode.iter().any(|(_, sigma)| *sigma > 0.0) {
            let _ = modes.push(core::array::from_fn(|i| {
                T::from_f64(mode.iter().filter(|(place, _)| *place == i).map(|(_, sigma)| *sigma).sum())
            }));
        }
    };
    // Both focal lengths change by the same factor: a distance or a temperature causes a change of scale.
    push([(0, focal), (1, focal)]);
    push([(2, config.centre_sigma_px / config.fx_px), (2, 0.0)]);
    push([(3, config.centre_sigma_px / config.fy_px), (3, 0.0)]);
    Ok(modes)
}

/// A pivot of the decomposition counts as 0 when it is at most this fraction of its diagonal element.
// A semidefinite matrix has pivots of 0, for example for two focal lengths that are fully correlated. Rounding of the
// file makes them slightly negative.
const ROUNDING: f64 = 1e-9;

/// Returns the columns of the lower triangle L with L Lᵀ = `rows`. A matrix that is not symmetric or not positive
/// semidefinite is refused.
fn triangle(rows: &[heapless::Vec<f64, INTRINSICS>]) -> Result<[[f64; INTRINSICS]; INTRINSICS], ConfigError> {
    let field = "camera.covariance.rows";
    let at = |i: usize, j: usize| rows.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0);
    let refused = |value: f64, rule: &'static str| require(false, field, value, Limit::Rule(rule));
    let mut columns = [[0.0f64; INTRINSICS]; INTRINSICS];
    let n = rows.len().min(INTRINSICS);
    for j in 0..n {
        for i in 0..n {
            require(at(i, j).is_finite(), field, at(i, j), Limit::Finite)?;
            let scale = libm::sqrt((at(i, i) * at(j, j)).abs());
            // The margin is for printed digits. A larger difference would be a typing error, or a triangle without its
            // other half.
            if (at(i, j) - at(j, i)).abs() > 1e-6 * scale {
                refused(at(i, j), "must be symmetric")?;
            }
        }
    }
    for j in 0..n {
        let left = |columns: &[[f64; INTRINSICS]; INTRINSICS], i: usize| {
            at(i, j) - columns.iter().take(j).map(|c| c[i] * c[j]).sum::<f64>()
        };
        let pivot = left(&columns, j);
        let rule = "must be positive semidefinite";
        if !(pivot >= -ROUNDING * at(j, j).abs()) || at(j, j) < 0.0 {
            refused(pivot, rule)?;
        }
        let is_zero = pivot <= ROUNDING * at(j, j);
        let root = if is_zero { 0.0 } else { libm::sqrt(pivot) };
        for i in j..n {
            let value = left(&columns, i);
            // With a variance of 0 the covariances must be 0, too; otherwise the matrix has a negative eigenvalue.
            if is_zero && value.abs() > libm::sqrt(ROUNDING * at(i, i).abs() * at(j, j)) {
                refused(value, rule)?;
            }
            columns[j][i] = if is_zero { 0.0 } else { value / root };
        }
    }
    Ok(columns)
}

/// Returns the size of one relative unit of a parameter, in the parameter's own unit.
fn unit(which: Intrinsic, config: &Config) -> f64 {
    match which {
        Intrinsic::FxPx | Intrinsic::CxPx => config.fx_px,
        Intrinsic::FyPx | Intrinsic::CyPx => config.fy_px,
        _ => 1.0,
    }
}
