//! Combines all pictures of a flight.

use hzn_core::Config;
use hzn_core::body::{self, Kind};
use hzn_core::camera::INTRINSICS;
use hzn_core::covariance;

use super::bend;
use super::edge::{self, LENGTHS_PX, MIN_SIGMA_PX, WHITE};
use super::height::{MAX_SIGMA_KM, Measured, Solved, solve};
use super::lag;
use super::latitude::{Profile, fit_profile};
use super::refusal::Refusal;
use super::sighting::Sighting;
use super::slow;
use crate::limb_prior::{LimbPrior, TWO_SIDED, has_air};

/// Smallest number of pictures with an answer. With fewer pictures the scatter is not known to a quarter.
pub const MIN_PICTURES: usize = 12;
/// 1-sigma that a sensor assumes for an unmeasured limb, in kilometres. A height that is less certain is no gain.
const DEFAULT_SIGMA_KM: f64 = 2.0 * MAX_SIGMA_KM;
/// Floor of the slow part of the errors along an edge and thus of its common shift, in pixels: the default of
/// `covariance.sigma_px`. Blur and threshold move the middle of an edge by fractions of a pixel, even if it is smooth.
const MIN_SHIFT_PX: f64 = 0.1;
/// Smallest common bend of the edges, as a part of their shift. It is an assumption: what shifts all edges may change
/// along them by half, and not be visible in the residuals. On the nine flights of `rocket`, `rocket-clean` and
/// `horace-wide` in `cargo xtask reproduce defaults`, bends with an RMS of 0.05 px explain the errors of the limb
/// heights. This is half of the smallest shift.
const MIN_BEND: f64 = 0.5;
/// Value of a tilt at the ends of an edge if its RMS along the edge is 1: √3.
const TILT_END_PER_RMS: f64 = 1.732_050_807_568_877_2;
/// Largest distance of a picture's limb height from the median of all, in sigmas. A picture farther away has another
/// edge and is excluded.
const MAX_DEVIATION_SIGMAS: f64 = 6.0;
/// Largest fraction of excluded pictures. With more of them the calibration is refused.
const MAX_INCONSISTENT: f64 = 0.2;
/// Limb height and 1-sigma of the sensor during the calibration, in kilometres: wide enough for any limb.
const WIDE_KM: [f64; 2] = [15.0, 30.0];
/// Largest sigma of a direction during the calibration, in degrees: every direction counts.
const ANY_SIGMA_DEG: f64 = 90.0;

/// Returns the configuration for the pictures of a calibration: the sensor with a very wide prior of the limb height.
/// It looks for one body, the first whose half-angle depends on the limb height. The result is `None` if there is no
/// such body.
pub fn config_for_calibration(sensor: &Config) -> Option<Config> {
    let which = sensor.each_body().iter().position(|b| !b.half_angle_is_free())?;
    let mut wide = sensor.clone();
    wide.body = sensor.each_body().get(which)?.clone();
    wide.bodies.clear();
    let [km, sigma_km] = WIDE_KM;
    wide.body.tell_limb_height(km, sigma_km);
    wide.body.limb_height_by_latitude_km.clear();
    wide.gates.max_sigma_deg = ANY_SIGMA_DEG;
    Some(wide)
}

/// A limb height with its sigma and the parts of the sigma, in kilometres.
#[derive(Debug, Clone, PartialEq)]
pub struct Height {
    /// Height; with rows by latitude it is their mean over the visible limb.
    pub km: f64,
    /// 1-sigma for the sensor: the root sum of squares of the seven parts.
    pub sigma_km: f64,
    /// Part from edge noise, over all pictures.
    pub statistical_km: f64,
    /// Part from the scatter between pictures that edge noise does not explain.
    pub scatter_km: f64,
    /// Part from the height that clipping at full scale adds; 0 if no picture is clipped.
    pub clipping_km: f64,
    /// The height that clipping adds to a limb all of which is clipped, with its 1-sigma, in kilometres; `None` if no
    /// picture is clipped.
    pub clipped_km: Option<[f64; 2]>,
    /// Part from a shift of all edges by the slow part of the residuals, at least 0.1 px. Threshold and blur cause it,
    /// and it is the same in every picture.
    pub shift_km: f64,
    /// Part from a bend that all edges have in common, which the fit takes for another height. It is assumed to be as
    /// strong as the next shapes along the edge in the mean of the residuals.
    pub bend_km: f64,
    /// Part from the lens: what its sigmas in sensor.toml change in all pictures alike.
    pub lens_km: f64,
    /// Part from the local radius if no position is known.
    pub radius_km: f64,
    /// Rows of (geodetic latitude in degrees, height, 1-sigma from edge noise and scatter); empty if one height
    /// explains all pictures equally well.
    pub by_latitude: Vec<[f64; 3]>,
}

impl Height {
    /// Returns the largest part of the sigma with its name.
    fn largest_part_km(&self) -> (&'static str, f64) {
        let parts = [
            ("scatter between pictures", self.scatter_km),
            ("light that is clipped at full scale", self.clipping_km),
            ("a common shift of all edges", self.shift_km),
            ("a bend that all edges share", self.bend_km),
            ("the lens", self.lens_km),
            ("the local radius, because no position is known", self.radius_km),
        ];
        let noise = ("edge noise", self.statistical_km);
        parts.into_iter().fold(noise, |most, part| if part.1 > most.1 { part } else { most })
    }
}

/// Edge noise of all pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// 1-sigma of an edge point, in pixels: the RMS of the residuals.
    pub sigma_px: f64,
    /// Correlation length of the errors, in pixels, if all of them were correlated. An exponential process with this
    /// sigma and this length gives a fit the same variance as the noise models of the pictures.
    pub correlation_px: f64,
    /// Length L of the most likely model of all pictures together, in pixels.
    pub length_px: f64,
    /// White part ν of the variance in that model.
    pub white: f64,
    /// 1-sigma of the part of the errors that averages out over [`Self::slow_px`], in pixels: all but the slow part.
    pub white_px: f64,
    /// Correlation length of the slow part, in pixels: L, and at least the length that the sensor assumes without a
    /// calibration.
    pub slow_px: f64,
    /// 1-sigma of a common shift of all points of an edge, in pixels: the RMS of the slow part, at least 0.1.
    pub bias_px: f64,
    /// 1-sigma of a common tilt of an edge at its ends, in pixels. The fit takes a tilt for another direction, so that
    /// the residuals do not show it; its RMS is assumed to be that of the shift.
    pub tilt_px: f64,
}

/// The focal length that the flight measures. It is reported but never applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focal {
    /// Difference from the focal length of the sensor.toml, in percent; positive if the measured one is longer.
    pub percent: f64,
    /// 1-sigma of the difference, in percent, with the limb height unknown.
    pub sigma_percent: f64,
    /// Mean change of the limb height for 0.1 % of focal length, in kilometres.
    pub km_per_permille: f64,
}

/// One picture in the calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Name of the picture.
    pub name: String,
    /// Limb height that it measures, in kilometres.
    pub km: f64,
    /// 1-sigma from edge noise, in kilometres.
    pub sigma_km: f64,
    /// Limb height that the calibration gives for the visible limb, in kilometres.
    pub explained_km: f64,
    /// Whether the picture counts, because its height agrees with the others.
    pub counts: bool,
}

/// Limb height and noise of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The body.
    pub body: Kind,
    /// Its limb height.
    pub height: Height,
    /// Edge noise.
    pub edge: Edge,
    /// Mean square of the pictures' heights about the fitted heights over their variances, without the scatter. It is
    /// about 1 if edge noise explains the heights.
    pub chi2: f64,
    /// Largest mean square without an alarm: 2, and more for few pictures, so that 0.3 % of right flights exceed it.
    pub max_chi2: f64,
    /// The focal length; `None` if the pictures cannot separate it from the limb height.
    pub focal: Option<Focal>,
    /// The pictures, in order.
    pub pictures: Vec<Picture>,
    /// Correlation of the residuals by distance along the edge: (pixels, correlation).
    pub correlation: Vec<(f64, f64)>,
    /// Why the height is not to be believed; `None` before [`Self::compare_with`], or if it may be right.
    doubt: Option<Refusal>,
}

impl Calibration {
    /// Combines the sightings of a flight; `body` is the body that the sensor looks for.
    ///
    /// # Errors
    /// The flight does not determine limb height and noise: see [`Refusal`].
    pub fn new(body: &body::Config, sightings: &[Sighting]) -> Result<Self, Refusal> {
        let few = |answered: usize| Refusal::TooFew { answered, min_pictures: MIN_PICTURES };
        if sightings.len() < MIN_PICTURES {
            return Err(few(sightings.len()));
        }
        let clipped_km = [body.clipped_height_km, body.clipped_sigma_km];
        let consistent = find_consistent(sightings, clipped_km);
        let inconsistent = sightings.len() - consistent.len();
        if inconsistent as f64 > MAX_INCONSISTENT * sightings.len() as f64 {
            return Err(Refusal::Inconsistent { inconsistent, pictures: sightings.len() });
        }
        let vague = |sigma_km: f64| Refusal::TooVague { sigma_km, max_km: MAX_SIGMA_KM, pictures: consistent.len() };
        let profile = fit_profile(&consistent, clipped_km).ok_or(vague(f64::INFINITY))?;
        let edge = combine_edges(&consistent);
        let height = combine_heights(&profile, &consistent, &edge);
        if height.statistical_km > MAX_SIGMA_KM {
            return Err(vague(height.statistical_km));
        }
        if height.lens_km > MAX_SIGMA_KM {
            return Err(Refusal::Lens { lens_km: height.lens_km, max_km: MAX_SIGMA_KM });
        }
        let counts = |s: &Sighting| consistent.iter().any(|t| std::ptr::eq(*t, s));
        let picture = |s: &Sighting| Picture {
            name: s.name.clone(),
            km: s.limb_height_km,
            sigma_km: s.sigma_km,
            explained_km: profile.fitted_km(s),
            counts: counts(s),
        };
        Ok(Self {
            body: body.kind,
            height,
            edge,
            chi2: profile.solved.chi2,
            max_chi2: profile.solved.max_chi2,
            focal: fit_focal(&profile, &consistent),
            pictures: sightings.iter().map(picture).collect(),
            correlation: lag::correlation(consistent.iter().map(|s| &s.lags)),
            doubt: None,
        })
    }

    /// Compares the height with the air of the body, and with what `sensor` tells of the limb height. The flight was
    /// measured with a far wider prior ([`config_for_calibration`]). [`Self::alarm`] then has the result.
    ///
    /// A limb below the surface of a body with air is not possible, whatever its sigma. A height that differs from the
    /// told one by more than 2.58 sigmas of both together happens to one right flight in a hundred.
    pub fn compare_with(&mut self, sensor: &Config) {
        let Some(body) = sensor.each_body().iter().find(|b| b.kind == self.body) else { return };
        let Some(told) = LimbPrior::of_sensor(sensor, false) else { return };
        let Height { km, sigma_km, .. } = self.height;
        let sigmas = (km - told.km).abs() / sigma_km.hypot(told.sigma_km).max(1e-9);
        let high_km = told.possible_km(body)[1];
        self.doubt = if has_air(body) && km < 0.0 {
            Some(Refusal::BelowSurface { km, sigma_km, high_km })
        } else if sigmas > TWO_SIDED {
            Some(Refusal::Told { km: [km, sigma_km], told_km: [told.km, told.sigma_km], sigmas })
        } else {
            None
        };
    }

    /// Returns the alarm if the pictures do not agree with each other or with what was known before, or if the height
    /// is no gain.
    pub fn alarm(&self) -> Option<Refusal> {
        if self.chi2 > self.max_chi2 {
            return Some(Refusal::Alarm { chi2: self.chi2, max_chi2: self.max_chi2 });
        }
        if self.doubt.is_some() {
            return self.doubt;
        }
        let (sigma_km, largest) = (self.height.sigma_km, self.height.largest_part_km());
        (sigma_km > DEFAULT_SIGMA_KM).then_some(Refusal::NoBetter { sigma_km, largest, max_km: DEFAULT_SIGMA_KM })
    }

    /// Writes the values into a sensor that looks for the body, as [`super::into_sensor_toml`] does for the file.
    pub fn apply(&self, sensor: &mut Config) {
        let several = !sensor.bodies.is_empty();
        let noise = covariance::Config {
            sigma_px: round_to_written_digits(self.edge.sigma_px),
            correlation_px: round_to_written_digits(self.edge.slow_px),
            white_px: round_to_written_digits(self.edge.white_px),
            bias_px: round_to_written_digits(self.edge.bias_px),
            tilt_px: round_to_written_digits(self.edge.tilt_px),
            ..sensor.covariance
        };
        let Some(body) = sensor.each_body_mut().iter_mut().find(|b| b.kind == self.body) else { return };
        let [km, sigma_km] = [self.height.km, self.height.sigma_km].map(round_to_written_digits);
        body.tell_limb_height(km, sigma_km);
        if let Some(km) = self.clipped_height_km() {
            body.clipped_height_km = km;
        }
        body.limb_height_by_latitude_km =
            self.height.by_latitude.iter().map(|[deg, km, _]| [*deg, round_to_written_digits(*km)]).collect();
        if several {
            body.covariance = Some(noise);
        } else {
            sensor.covariance = noise;
        }
    }

    /// Returns the height that clipping adds, in kilometres, as it is written; `None` if no picture is clipped.
    /// Clipping cannot lower a limb.
    pub(super) fn clipped_height_km(&self) -> Option<f64> {
        self.height.clipped_km.map(|[km, _]| round_to_written_digits(km.max(0.0)))
    }
}

/// Rounds to the three decimals that are written.
pub(super) fn round_to_written_digits(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

/// Returns the sightings without those whose height disagrees with all others. `clipped_km` is the height that clipping
/// adds, with its 1-sigma.
fn find_consistent(all: &[Sighting], [clipped_km, clipped_sigma_km]: [f64; 2]) -> Vec<&Sighting> {
    let unclipped_km = |s: &Sighting| s.limb_height_km - clipped_km * s.clipped;
    let middle_km = median(all.iter().map(unclipped_km));
    let typical_km = 1.4826 * median(all.iter().map(|s| (unclipped_km(s) - middle_km).abs()));
    let is_near = |s: &&Sighting| {
        let own_km = s.sigma_km.hypot(clipped_sigma_km * s.clipped);
        (unclipped_km(s) - middle_km).abs() <= MAX_DEVIATION_SIGMAS * typical_km.hypot(own_km).max(0.1)
    };
    all.iter().filter(is_near).collect()
}

fn combine_heights(profile: &Profile, sightings: &[&Sighting], edge: &Edge) -> Height {
    let Solved { h, covariance, scatter2, .. } = &profile.solved;
    let (n, rows) = (sightings.len() as f64, profile.rows());
    // The mean weights of the heights over all pictures: that of the clipping is left out.
    let mut mean_weights = vec![0.0; rows];
    for s in sightings {
        mean_weights.iter_mut().zip(profile.weights(s)).for_each(|(sum, weight)| *sum += weight / n);
    }
    let km = mean_weights.iter().zip(h.iter()).map(|(a, h)| a * h).sum();
    let weight = |i: usize, j: usize| mean_weights.get(i).zip(mean_weights.get(j)).map_or(0.0, |(a, b)| a * b);
    let [mean_variance, by_clipping] = (0..rows)
        .flat_map(|i| (0..rows).map(move |j| (i, j)))
        .map(|(i, j)| profile.covariance_km2(i, j).map(|km2| weight(i, j) * km2))
        .fold([0.0; 2], |sum, term| [sum[0] + term[0], sum[1] + term[1]]);
    // What all edges have in common changes the height by as much as the pictures that determine it. A picture with a
    // short arc has a large change and hardly any weight.
    let mean = |value: &dyn Fn(&Sighting) -> f64| weighted_mean(profile, sightings, value);
    let mean_square = |value: &dyn Fn(&Sighting) -> f64| mean(&|s| value(s).powi(2));
    let statistical_km = (mean_variance - by_clipping).max(0.0).sqrt();
    // Noise that is new at every point averages out along an edge; only the slow part can be a shift.
    let shift_km = edge.bias_px * mean_square(&|s| s.km_per_px).sqrt();
    let bend_px = bend::common_bend_px(sightings.iter().map(|s| &s.shapes_px), MIN_BEND * edge.bias_px);
    let bend_km = bend_px * mean_square(&|s| s.km_per_bend_px).sqrt();
    let radius_km = mean_square(&|s| s.radius_sigma_km).sqrt();
    // The lens is the same in all pictures, so that its modes change the mean height and average out in nothing.
    let lens_km = (0..INTRINSICS).map(|k| mean(&|s| s.km_by_lens[k]).powi(2)).sum::<f64>().sqrt();
    let by_latitude = profile.latitudes_deg.iter().enumerate();
    let row = |(k, deg): (usize, &f64)| [*deg, h[k], covariance[(k, k)].sqrt()];
    Height {
        km,
        sigma_km: (mean_variance
            + scatter2
            + [shift_km, bend_km, lens_km, radius_km].map(|km| km * km).iter().sum::<f64>())
        .sqrt(),
        statistical_km,
        scatter_km: scatter2.sqrt(),
        clipping_km: by_clipping.sqrt(),
        clipped_km: profile.clipped_km(),
        shift_km,
        bend_km,
        lens_km,
        radius_km,
        by_latitude: by_latitude.map(row).collect(),
    }
}

/// Returns the mean of a value of the pictures, with the weights that they have in the height.
fn weighted_mean(profile: &Profile, sightings: &[&Sighting], value: &dyn Fn(&Sighting) -> f64) -> f64 {
    let weight = |s: &Sighting| 1.0 / (s.sigma_km * s.sigma_km + profile.solved.scatter2);
    let (sum, weights) = sightings.iter().fold((0.0, 0.0), |(sum, weights), s| {
        let weight = weight(s);
        (sum + weight * value(s), weights + weight)
    });
    sum / weights
}

/// Computes sigma and length, the slow part, and the most likely (L, ν) of all pictures together, each picture with its
/// own σ.
fn combine_edges(sightings: &[&Sighting]) -> Edge {
    let n = sightings.len() as f64;
    let cost = |i: usize, j: usize| sightings.iter().map(|s| s.scores[i][j].minus_two_ln_likelihood).sum::<f64>();
    let models = (0..LENGTHS_PX.len()).flat_map(|i| (0..WHITE.len()).map(move |j| (i, j)));
    let (i, j) = models.min_by(|a, b| cost(a.0, a.1).total_cmp(&cost(b.0, b.1))).unwrap_or_default();
    let rms_px = (sightings.iter().map(|s| s.rms_px * s.rms_px).sum::<f64>() / n).sqrt();
    let arc_px = sightings.iter().map(|s| s.arc_px).sum::<f64>() / n;
    let bias_px = slow::sigma_px(sightings.iter().map(|s| s.slow_px2), rms_px).max(MIN_SHIFT_PX);
    Edge {
        sigma_px: rms_px.max(MIN_SIGMA_PX),
        correlation_px: median(sightings.iter().map(|s| s.correlation_px)),
        length_px: LENGTHS_PX[i],
        white: WHITE[j],
        slow_px: LENGTHS_PX[i].max(edge::window_px(arc_px)),
        white_px: (rms_px * rms_px - bias_px * bias_px).max(0.0).sqrt(),
        bias_px,
        tilt_px: bias_px * TILT_END_PER_RMS,
    }
}

/// Fits d_i = A_i h − D_i ε: the relative focal length error ε together with the heights and the scatter.
fn fit_focal(profile: &Profile, sightings: &[&Sighting]) -> Option<Focal> {
    let measured: Vec<Measured> = sightings
        .iter()
        .map(|s| {
            let mut weights = profile.weights(s);
            weights.push(-s.km_per_focal * 1e-2);
            Measured { km: s.limb_height_km, variance_km2: s.sigma_km * s.sigma_km, weights }
        })
        .chain(profile.clipping.clone().map(|mut prior| {
            prior.weights.push(0.0);
            prior
        }))
        .collect();
    let solved = solve(&measured)?;
    let last = solved.h.len().checked_sub(1)?;
    let mean = weighted_mean(profile, sightings, &|s| s.km_per_focal);
    let sigma_percent = solved.covariance[(last, last)].sqrt();
    sigma_percent.is_finite().then_some(Focal { percent: solved.h[last], sigma_percent, km_per_permille: mean * 1e-3 })
}

/// Returns the median; for an even number of values it is the upper of the two middle values.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
