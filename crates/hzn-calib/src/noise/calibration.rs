//! All pictures of a flight together.

use hzn_core::Config;
use hzn_core::body::{self, Kind};

use super::bend;
use super::edge::{LEAST_PX, LENGTHS_PX, WHITE};
use super::height::Solved;
use super::lag;
use super::latitude::{Profile, profile};
use super::refusal::Refusal;
use super::sighting::Sighting;

/// So many pictures with an answer are needed: the scatter of fewer is not known to a quarter.
pub const LEAST_PICTURES: usize = 12;
/// The limb height must come out better than this from the pictures' own errors, kilometres: half of the sigma that a
/// sensor assumes of a limb nobody measured.
pub(super) const MOST_SIGMA_KM: f64 = 3.5;
/// Blur and level move the middle of an edge by parts of a pixel however smooth it is: less than the default of
/// `covariance.sigma_px` is not believed, pixels.
const LEAST_SHIFT_PX: f64 = 0.1;
/// A mean square of the residuals over their variances above this is an alarm.
const ALARM: f64 = 2.0;
/// A picture so many sigma from the middle of all has another edge.
const APART: f64 = 6.0;
/// More pictures that are apart than this part are no exceptions.
const MOST_APART: f64 = 0.2;
/// The limb height that a sensor looks with while it is calibrated, and its 1-sigma: wide enough for any limb.
const WIDE_KM: [f64; 2] = [15.0, 30.0];
/// Any direction counts then, however uncertain, degrees.
const ANY_SIGMA_DEG: f64 = 90.0;

/// The sensor as it looks at the pictures that calibrate it: the limb's height is wide open. It looks for one body, the
/// first whose half-angle tells a height; `None` when there is none.
pub fn looks_with(sensor: &Config) -> Option<Config> {
    let which = sensor.each_body().iter().position(|b| !b.half_angle_is_free())?;
    let mut wide = sensor.clone();
    wide.body = sensor.each_body().get(which)?.clone();
    wide.bodies.clear();
    [wide.body.limb_height_km, wide.body.limb_height_sigma_km] = WIDE_KM;
    wide.body.limb_height_by_latitude_km.clear();
    wide.select.max_sigma_deg = ANY_SIGMA_DEG;
    Some(wide)
}

/// A limb height in kilometres with its sigma, and what that is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Height {
    /// The height; of rows by latitude their mean over what was seen.
    pub km: f64,
    /// The 1-sigma to tell a sensor: the root of the squares of the five that follow.
    pub sigma_km: f64,
    /// From edge noise, over all pictures.
    pub statistical_km: f64,
    /// Scatter from picture to picture beyond edge noise.
    pub scatter_km: f64,
    /// A shift of all edges by the residuals' RMS, and 0.1 pixels at least: level and blur do that, alike in every
    /// picture.
    pub shift_km: f64,
    /// A bend that all edges share, which the fit reads as another height: as strong as the next shapes along the edge
    /// that the residuals show in the mean.
    pub bend_km: f64,
    /// The local radius, where no position tells it.
    pub radius_km: f64,
    /// Rows of (geodetic latitude in degrees, height, 1-sigma from edge noise and scatter); empty when one height
    /// explains all pictures as well.
    pub by_latitude: Vec<[f64; 3]>,
}

/// Edge noise of all pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// 1-sigma of an edge point, pixels: the RMS of the residuals.
    pub sigma_px: f64,
    /// Length over which errors of this sigma stay alike, pixels: a process of one exponential then says of a fit what
    /// the pictures' own models say of it.
    pub correlation_px: f64,
    /// L of the likeliest model of all pictures together, pixels.
    pub length_px: f64,
    /// ν of it, the white part of the variance.
    pub white: f64,
    /// 1-sigma of what shifts all points of an edge alike, pixels: as large as the residuals' RMS, and 0.1 at least.
    pub bias_px: f64,
}

/// What the flight says about the focal length. It is told, never applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focal {
    /// By how much the focal length is longer than the sensor.toml says, percent.
    pub percent: f64,
    /// Its 1-sigma, percent, with the limb height unknown.
    pub sigma_percent: f64,
    /// Limb height that 0.1 % of focal length makes, kilometres, on average.
    pub km_per_permille: f64,
}

/// One picture in the calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Its name.
    pub name: String,
    /// The limb height that it measures, kilometres.
    pub km: f64,
    /// 1-sigma from edge noise.
    pub sigma_km: f64,
    /// What the calibration says of the limb that it saw.
    pub explained_km: f64,
    /// Whether it counts: it is not apart from the others.
    pub counts: bool,
}

/// Limb height and noise of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Which body.
    pub body: Kind,
    /// Its limb.
    pub height: Height,
    /// Edge noise.
    pub edge: Edge,
    /// Mean square of the pictures' heights about the fitted ones over their variances, without the scatter: about 1
    /// when edge noise explains them.
    pub chi2: f64,
    /// What the flight says about the focal length; `None` where the pictures do not tell it from the limb height.
    pub focal: Option<Focal>,
    /// The pictures, in order.
    pub pictures: Vec<Picture>,
    /// Correlation of the residuals by distance along the edge: (pixels, correlation).
    pub correlation: Vec<(f64, f64)>,
}

impl Calibration {
    /// Of the sightings of a flight; `body` is what the sensor looks for.
    ///
    /// # Errors
    /// What they do not tell.
    pub fn new(body: &body::Config, sightings: &[Sighting]) -> Result<Self, Refusal> {
        let few = |answered: usize| Refusal::TooFew { answered, least: LEAST_PICTURES };
        if sightings.len() < LEAST_PICTURES {
            return Err(few(sightings.len()));
        }
        let together: Vec<&Sighting> = together(sightings);
        let apart = sightings.len() - together.len();
        if apart as f64 > MOST_APART * sightings.len() as f64 {
            return Err(Refusal::Apart { apart, pictures: sightings.len() });
        }
        let vague = |sigma_km: f64| Refusal::TooVague { sigma_km, most_km: MOST_SIGMA_KM, pictures: together.len() };
        let profile = profile(&together).ok_or(vague(f64::INFINITY))?;
        let height = height(&profile, &together);
        if height.statistical_km > MOST_SIGMA_KM {
            return Err(vague(height.statistical_km));
        }
        let counts = |s: &Sighting| together.iter().any(|t| std::ptr::eq(*t, s));
        let picture = |s: &Sighting| Picture {
            name: s.name.clone(),
            km: s.limb_height_km,
            sigma_km: s.sigma_km,
            explained_km: profile.explains_km(s),
            counts: counts(s),
        };
        Ok(Self {
            body: body.kind,
            height,
            edge: edge(&together),
            chi2: profile.solved.chi2,
            focal: focal(&profile, &together),
            pictures: sightings.iter().map(picture).collect(),
            correlation: lag::correlation(together.iter().map(|s| &s.lags)),
        })
    }

    /// That the pictures do not agree with each other.
    pub fn alarm(&self) -> Option<Refusal> {
        (self.chi2 > ALARM).then_some(Refusal::Alarm { chi2: self.chi2, most: ALARM })
    }

    /// Writes the numbers into a sensor that looks for the body, as [`super::into_sensor_toml`] does into its file.
    pub fn apply(&self, sensor: &mut Config) {
        let several = !sensor.bodies.is_empty();
        let noise = hzn_core::covariance::Config {
            sigma_px: digits(self.edge.sigma_px),
            correlation_px: digits(self.edge.correlation_px),
            bias_px: digits(self.edge.bias_px),
            ..sensor.covariance
        };
        let Some(body) = sensor.each_body_mut().iter_mut().find(|b| b.kind == self.body) else { return };
        body.limb_height_km = digits(self.height.km);
        body.limb_height_sigma_km = digits(self.height.sigma_km);
        // The measured height is already that of clipped limbs.
        body.clipped_height_km = 0.0;
        body.limb_height_by_latitude_km =
            self.height.by_latitude.iter().map(|[deg, km, _]| [*deg, digits(*km)]).collect();
        if several {
            body.covariance = Some(noise);
        } else {
            sensor.covariance = noise;
        }
    }
}

/// As many digits as are written.
pub(super) fn digits(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

/// The sightings without those that are apart from all others.
fn together(all: &[Sighting]) -> Vec<&Sighting> {
    let middle_km = median(all.iter().map(|s| s.limb_height_km));
    let usual_km = 1.4826 * median(all.iter().map(|s| (s.limb_height_km - middle_km).abs()));
    let is_near = |s: &&Sighting| (s.limb_height_km - middle_km).abs() <= APART * usual_km.hypot(s.sigma_km).max(0.1);
    all.iter().filter(is_near).collect()
}

fn height(profile: &Profile, sightings: &[&Sighting]) -> Height {
    let Solved { h, covariance, scatter2, .. } = &profile.solved;
    let (n, parameters) = (sightings.len() as f64, h.len());
    // What all pictures saw together.
    let mut seen = vec![0.0; parameters];
    for s in sightings {
        seen.iter_mut().zip(profile.parts(s)).for_each(|(sum, part)| *sum += part / n);
    }
    let km = seen.iter().zip(h.iter()).map(|(a, h)| a * h).sum();
    let of = |i: usize, j: usize| seen.get(i).zip(seen.get(j)).map_or(0.0, |(a, b)| a * b);
    let mean_variance: f64 = (0..parameters)
        .flat_map(|i| (0..parameters).map(move |j| (i, j)))
        .map(|(i, j)| of(i, j) * covariance[(i, j)])
        .sum();
    let mean_square = |of: &dyn Fn(&Sighting) -> f64| sightings.iter().map(|s| of(s).powi(2)).sum::<f64>() / n;
    let (statistical_km, scatter_km) = (mean_variance.sqrt(), scatter2.sqrt());
    let shift_km = mean_square(&|s| s.rms_px.max(LEAST_SHIFT_PX) * s.km_per_px).sqrt();
    let bend_km = bend::common_px(sightings) * mean_square(&|s| s.km_per_bend_px).sqrt();
    let radius_km = mean_square(&|s| s.radius_sigma_km).sqrt();
    let rows = profile.latitudes_deg.iter().enumerate();
    let row = |(k, deg): (usize, &f64)| [*deg, h[k], covariance[(k, k)].sqrt()];
    Height {
        km,
        sigma_km: (mean_variance + scatter2 + [shift_km, bend_km, radius_km].map(|km| km * km).iter().sum::<f64>())
            .sqrt(),
        statistical_km,
        scatter_km,
        shift_km,
        bend_km,
        radius_km,
        by_latitude: rows.map(row).collect(),
    }
}

/// Sigma and length; and the likeliest (L, ν) of all pictures together, each with its own σ.
fn edge(sightings: &[&Sighting]) -> Edge {
    let n = sightings.len() as f64;
    let unlikely = |i: usize, j: usize| sightings.iter().map(|s| s.scores[i][j].unlikely).sum::<f64>();
    let models = (0..LENGTHS_PX.len()).flat_map(|i| (0..WHITE.len()).map(move |j| (i, j)));
    let (i, j) = models.min_by(|a, b| unlikely(a.0, a.1).total_cmp(&unlikely(b.0, b.1))).unwrap_or_default();
    let rms_px = (sightings.iter().map(|s| s.rms_px * s.rms_px).sum::<f64>() / n).sqrt();
    Edge {
        sigma_px: rms_px.max(LEAST_PX),
        correlation_px: median(sightings.iter().map(|s| s.correlation_px)),
        length_px: LENGTHS_PX[i],
        white: WHITE[j],
        bias_px: rms_px.max(LEAST_SHIFT_PX),
    }
}

/// d_i = A_i h − D_i ε: ε beside the heights, with the scatter that was found.
fn focal(profile: &Profile, sightings: &[&Sighting]) -> Option<Focal> {
    use super::height::{Measured, solve};
    let measured: Vec<Measured> = sightings
        .iter()
        .map(|s| {
            let mut of = profile.parts(s);
            of.push(-s.km_per_focal * 1e-2);
            Measured { km: s.limb_height_km, variance_km2: s.sigma_km * s.sigma_km, of }
        })
        .collect();
    let solved = solve(&measured)?;
    let place = solved.h.len().checked_sub(1)?;
    let mean = sightings.iter().map(|s| s.km_per_focal).sum::<f64>() / sightings.len() as f64;
    let sigma_percent = solved.covariance[(place, place)].sqrt();
    sigma_percent.is_finite().then_some(Focal { percent: solved.h[place], sigma_percent, km_per_permille: mean * 1e-3 })
}

/// The middle value.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
