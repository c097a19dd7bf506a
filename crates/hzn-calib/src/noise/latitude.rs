//! Limb height by latitude, with as many rows as the pictures determine.
//!
//! A picture measures a mean over its part of the limb. With hat functions between rows of latitude, this mean is
//! linear in the heights of the rows: d_i = Σ_k a_ik h_k, where a_ik is the mean of hat k over the visible limb. More
//! rows are used only if they reduce Bayes' information criterion (ln n per row) and every row is determined better
//! than the rows differ.
//!
//! Full scale cuts the light of an overexposed limb off, so that the limb appears higher there. The height is
//! proportional to the part of the edge that is clipped, which differs between the pictures. It is one more parameter,
//! and has the sensor's own value as its prior.

use super::height::{MAX_SIGMA_KM, Measured, Solved, solve};
use super::sighting::Sighting;

/// Numbers of rows that are tried.
const ROWS: [usize; 3] = [2, 3, 5];
/// A row's share of the limb must differ by at least this much between two of the pictures.
const MIN_SPREAD: f64 = 0.5;
/// Smallest sigma of the prior height of the clipping, in kilometres, so that its weight is a number.
const MIN_CLIPPED_SIGMA_KM: f64 = 1e-3;
/// Fraction of the visible limb that may lie beyond the first and beyond the last row.
const MAX_BEYOND: f64 = 0.02;

/// A limb height with its fit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    /// Latitudes of the rows in degrees, rising; empty if one height holds everywhere.
    pub(super) latitudes_deg: Vec<f64>,
    /// The height that clipping adds before the flight. It is the last parameter; `None` if no picture is clipped.
    pub(super) clipping: Option<Measured>,
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
        weights(&self.latitudes_deg, self.clipping.is_some(), sighting)
    }

    /// Returns the number of heights, without that of the clipping.
    pub(super) fn rows(&self) -> usize {
        self.latitudes_deg.len().max(1)
    }

    /// Returns the height that clipping adds to a limb all of which is clipped, with its 1-sigma; `None` if no picture
    /// is clipped.
    pub(super) fn clipped_km(&self) -> Option<[f64; 2]> {
        let last = self.rows();
        self.clipping.as_ref().map(|_| [self.solved.h[last], self.solved.covariance[(last, last)].sqrt()])
    }

    /// Returns the covariance of two heights, and the part of it that the unknown height of the clipping causes.
    pub(super) fn covariance_km2(&self, i: usize, j: usize) -> [f64; 2] {
        let (covariance, last) = (&self.solved.covariance, self.rows());
        let by_clipping = if self.clipping.is_some() {
            covariance[(i, last)] * covariance[(j, last)] / covariance[(last, last)]
        } else {
            0.0
        };
        [covariance[(i, j)], by_clipping]
    }
}

/// Fits one height, or the number of rows that the pictures can distinguish. The result is `None` if they do not even
/// determine one height. `clipped_km` is the height that clipping adds to a limb all of which is clipped, with its
/// 1-sigma, before the flight.
pub(super) fn fit_profile(sightings: &[&Sighting], clipped_km: [f64; 2]) -> Option<Profile> {
    let clips = sightings.iter().any(|s| s.clipped > 0.0);
    let with = |latitudes_deg: Vec<f64>| {
        let each = sightings.iter().map(|s| Measured {
            km: s.limb_height_km,
            variance_km2: s.sigma_km * s.sigma_km,
            weights: weights(&latitudes_deg, clips, s),
        });
        let [km, sigma_km] = clipped_km;
        let clipping = clips.then(|| Measured {
            km,
            variance_km2: sigma_km.max(MIN_CLIPPED_SIGMA_KM).powi(2),
            weights: (0..latitudes_deg.len().max(1)).map(|_| 0.0).chain([1.0]).collect(),
        });
        let measured: Vec<Measured> = each.chain(clipping.clone()).collect();
        Some(Profile { solved: solve(&measured)?, clipping, latitudes_deg })
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
    let rows = profile.rows();
    let h = profile.solved.h.rows(0, rows);
    let range = h.max() - h.min();
    let weights: Vec<Vec<f64>> = sightings.iter().map(|s| profile.weights(s)).collect();
    let spread = |row: usize| {
        let each = weights.iter().filter_map(|w| w.get(row));
        let ends = each.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        ends.1 - ends.0
    };
    let known = |variance: &f64| 3.0 * variance.sqrt() < range && variance.sqrt() < MAX_SIGMA_KM;
    let variances = profile.solved.covariance.diagonal();
    variances.iter().take(rows).all(known) && (0..rows).all(|row| spread(row) >= MIN_SPREAD)
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

/// Returns the means of the hat functions over the limb that a picture sees, and the part of it that is clipped.
fn weights(latitudes_deg: &[f64], clips: bool, sighting: &Sighting) -> Vec<f64> {
    let mut weights = vec![0.0; latitudes_deg.len()];
    for &(deg, share) in &sighting.latitudes {
        for (weight, hat) in weights.iter_mut().zip(hats(latitudes_deg, deg)) {
            *weight += share * hat;
        }
    }
    if latitudes_deg.is_empty() {
        weights.push(1.0);
    }
    weights.extend(clips.then_some(sighting.clipped));
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
    use hzn_core::Config;

    use super::*;
    use crate::noise::tests::{Noise, camera, earth, flight};
    use crate::noise::{Calibration, into_sensor_toml};

    #[test]
    fn hats_are_linear_between_rows_and_constant_beyond() {
        let at = |deg: f64| hats(&[-60.0, 0.0, 40.0], deg).collect::<Vec<_>>();
        assert_eq!(at(-80.0), [1.0, 0.0, 0.0]);
        assert_eq!(at(-30.0), [0.5, 0.5, 0.0]);
        assert_eq!(at(0.0), [0.0, 1.0, 0.0]);
        assert_eq!(at(30.0), [0.0, 0.25, 0.75]);
        assert_eq!(at(70.0), [0.0, 0.0, 1.0]);
    }

    /// Light that full scale cuts off raises the limb, in each picture by its own part.
    #[test]
    fn what_clipping_adds_is_told_from_the_height_of_the_limb() {
        let part_of = |k: usize, parts: [f64; 3]| parts[k % parts.len()];
        let of_parts = |parts: [f64; 3], seed: u64| {
            let clear = flight(24, 90.0, 18.7, 0.0, Noise(0.1, 20.0, 0.5), seed);
            let clipped = clear.into_iter().enumerate().map(|(k, s)| {
                let part = part_of(k, parts);
                Sighting { limb_height_km: s.limb_height_km + 5.0 * part, ..s }.with_clipped(part)
            });
            Calibration::new(&earth(), &clipped.collect::<Vec<_>>()).unwrap()
        };
        let written = |c: &Calibration| {
            let mut sensor = Config::new(camera(90.0));
            sensor.body = earth();
            c.apply(&mut sensor);
            let text = into_sensor_toml("[body]\nkind = \"earth-sphere\"\n", c, "a flight").unwrap();
            assert_eq!(text.keys.iter().any(|key| key.contains("clipped_height_km")), c.height.clipped_km.is_some());
            sensor.body
        };
        // The part differs between the pictures: both heights are measured.
        let c = of_parts([0.0, 0.4, 0.9], 21);
        let [km, sigma_km] = c.height.clipped_km.unwrap();
        assert!((km - 5.0).abs() < 2.5 * sigma_km && sigma_km < 1.5, "{km} ± {sigma_km}");
        assert!((c.height.km - 18.7).abs() < 2.0 * c.height.sigma_km && c.height.clipping_km < 1.5, "{:?}", c.height);
        assert_eq!(written(&c).clipped_height_km, (km * 1e3).round() / 1e3);
        // The same part in all pictures: only the sum is measured, and the height has the sigma of the prior.
        let c = of_parts([0.8; 3], 22);
        let [km, sigma_km] = c.height.clipped_km.unwrap();
        assert!((c.height.km + 0.8 * km - 18.7 - 4.0).abs() < 0.5, "{:?}", c.height);
        assert!((sigma_km - 4.5).abs() < 0.1 && (c.height.clipping_km - 0.8 * 4.5).abs() < 0.1, "{:?}", c.height);
        assert!(c.height.statistical_km < 1.0 && c.alarm().is_none(), "{:?}", c.height);
        // Without a clipped picture the sensor keeps what it assumes of one.
        let c = of_parts([0.0; 3], 23);
        assert_eq!((c.height.clipped_km, c.height.clipping_km), (None, 0.0));
        assert_eq!(written(&c).clipped_height_km, earth().clipped_height_km);
    }
}
