//! Limb height by latitude, with as many rows as the pictures determine.
//!
//! A picture measures a mean over its part of the limb. With hat functions between rows of latitude, this mean is
//! linear in the heights of the rows: d_i = Σ_k a_ik h_k, where a_ik is the mean of hat k over the visible limb. More
//! rows are used only if they reduce Bayes' information criterion (ln n per row) and every row is determined better
//! than the rows differ.

use super::height::{MAX_SIGMA_KM, Measured, Solved, solve};
use super::sighting::Sighting;

/// Numbers of rows that are tried.
const ROWS: [usize; 3] = [2, 3, 5];
/// A row's share of the limb must differ by at least this much between two of the pictures.
const MIN_SPREAD: f64 = 0.5;
/// Fraction of the visible limb that may lie beyond the first and beyond the last row.
const MAX_BEYOND: f64 = 0.02;

/// A limb height with its fit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    /// Latitudes of the rows in degrees, rising; empty if one height holds everywhere.
    pub(super) latitudes_deg: Vec<f64>,
    pub(super) solved: Solved,
}

impl Profile {
    /// Returns the fitted limb height for a picture, in kilometres.
    pub(super) fn fitted_km(&self, sighting: &Sighting) -> f64 {
        let weights = self.weights(sighting);
        weights.iter().zip(self.solved.h.iter()).map(|(a, h)| a * h).sum()
    }

    /// Returns the weight of each parameter in a picture's height.
    pub(super) fn weights(&self, sighting: &Sighting) -> Vec<f64> {
        weights(&self.latitudes_deg, sighting)
    }
}

/// Fits one height, or the number of rows that the pictures can distinguish. The result is `None` if they do not even
/// determine one height.
pub(super) fn fit_profile(sightings: &[&Sighting]) -> Option<Profile> {
    let with = |latitudes_deg: Vec<f64>| {
        let measured: Vec<Measured> = sightings
            .iter()
            .map(|s| Measured {
                km: s.limb_height_km,
                variance_km2: s.sigma_km * s.sigma_km,
                weights: weights(&latitudes_deg, s),
            })
            .collect();
        Some(Profile { solved: solve(&measured)?, latitudes_deg })
    };
    let one = with(Vec::new())?;
    let Some([low, high]) = span_deg(sightings) else { return Some(one) };
    let bic = |p: &Profile| {
        p.solved.minus_two_ln_likelihood + p.latitudes_deg.len().max(1) as f64 * (sightings.len() as f64).ln()
    };
    let tried = ROWS.into_iter().filter_map(|n| {
        let latitude_deg = |k: usize| (low + (high - low) * k as f64 / (n - 1) as f64).round();
        let rows: Vec<f64> = (0..n).map(latitude_deg).collect();
        let rising = rows.windows(2).all(|w| w[0] < w[1]);
        with(rows).filter(|p| rising && sightings.len() >= 4 * n && rows_are_determined(p, sightings))
    });
    let best = tried.min_by(|a, b| bic(a).total_cmp(&bic(b)));
    Some(best.filter(|p| bic(p) < bic(&one)).unwrap_or(one))
}

/// Returns whether the pictures can distinguish the rows. Each row's 1-sigma must be below a third of the range of the
/// heights and below [`MAX_SIGMA_KM`]. Each row's share of the limb must differ by half of the limb or more between
/// two of the pictures, because a share that is equal in all pictures says nothing about latitude.
fn rows_are_determined(profile: &Profile, sightings: &[&Sighting]) -> bool {
    let h = &profile.solved.h;
    let range = h.max() - h.min();
    let weights: Vec<Vec<f64>> = sightings.iter().map(|s| profile.weights(s)).collect();
    let spread = |row: usize| {
        let each = weights.iter().filter_map(|w| w.get(row));
        let ends = each.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        ends.1 - ends.0
    };
    let known = |variance: &f64| 3.0 * variance.sqrt() < range && variance.sqrt() < MAX_SIGMA_KM;
    profile.solved.covariance.diagonal().iter().all(known) && (0..h.len()).all(|row| spread(row) >= MIN_SPREAD)
}

/// Returns the latitudes of the first and the last row, in degrees; `None` if a picture has no latitudes.
fn span_deg(sightings: &[&Sighting]) -> Option<[f64; 2]> {
    let mut latitudes: Vec<(f64, f64)> =
        sightings.iter().flat_map(|s| s.latitudes.iter().map(|(deg, share)| (*deg, share.abs()))).collect();
    if sightings.iter().any(|s| s.latitudes.is_empty()) {
        return None;
    }
    latitudes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = latitudes.iter().map(|s| s.1).sum();
    let below = |part: f64| {
        let mut sum = 0.0;
        latitudes.iter().find(|s| {
            sum += s.1;
            sum >= part * total
        })
    };
    Some([below(MAX_BEYOND)?.0, below(1.0 - MAX_BEYOND)?.0])
}

/// Returns the means of the hat functions over the limb that a picture sees.
fn weights(latitudes_deg: &[f64], sighting: &Sighting) -> Vec<f64> {
    if latitudes_deg.is_empty() {
        return vec![1.0];
    }
    let mut weights = vec![0.0; latitudes_deg.len()];
    for &(deg, share) in &sighting.latitudes {
        for (weight, hat) in weights.iter_mut().zip(hats(latitudes_deg, deg)) {
            *weight += share * hat;
        }
    }
    weights
}

/// Returns the hat functions at one latitude: linear between rows, constant beyond them.
fn hats(rows: &[f64], deg: f64) -> impl Iterator<Item = f64> + '_ {
    let at = |k: usize| rows.get(k).copied();
    (0..rows.len()).map(move |k| {
        let here = at(k).unwrap_or(f64::NAN);
        let (before, after) = (k.checked_sub(1).and_then(at), at(k + 1));
        match (before, after) {
            (Some(before), _) if deg <= here => ((deg - before) / (here - before)).max(0.0),
            (_, Some(after)) if deg >= here => ((after - deg) / (after - here)).max(0.0),
            _ => 1.0,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hats_are_linear_between_rows_and_constant_beyond() {
        let at = |deg: f64| hats(&[-60.0, 0.0, 40.0], deg).collect::<Vec<_>>();
        assert_eq!(at(-80.0), [1.0, 0.0, 0.0]);
        assert_eq!(at(-30.0), [0.5, 0.5, 0.0]);
        assert_eq!(at(0.0), [0.0, 1.0, 0.0]);
        assert_eq!(at(30.0), [0.0, 0.25, 0.75]);
        assert_eq!(at(70.0), [0.0, 0.0, 1.0]);
    }
}
