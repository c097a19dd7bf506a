//! The noise model of a scenario: the height of its limb, and the scatter of edge points about it.
//!
//! Pictures of the same scenario with other seeds (other clouds, another drift) go through the sensor. The edge points
//! that the sensor keeps are compared with the exact limb. Their mean height is the limb height, and the scatter of the
//! pictures' means is its sigma.
//!
//! For a limb, the noise of each picture comes from its own residuals (`covariance.noise = "rms"`). The reason is that
//! one picture may be far worse than the others, and it may not be among the measured ones. If the residuals alone give
//! covariances that are too small, the model below is their floor.
//!
//! For Sun and Moon the sensor gets a fixed model: a process along the edge with a variance and an integral length. Of
//! the tested lengths, the likeliest one is taken. For each length, the variance is chosen so that the errors of the
//! answers are as large as their covariance. (The points themselves do not determine the length. The error that turns
//! an answer is the same along the whole edge, and it is small compared with the noise of a point.)

use hzn_calib::noise::{PointRecorder, WeightedPoints};
use hzn_core::body::{self, Kind};
use hzn_core::camera::{self, Camera};
use hzn_core::covariance::{self, Noise};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_core::{Config, HostHorizon};
use hzn_host::Compiled;
use nalgebra::{Matrix3, Vector3};

use super::{Scenario, ScenarioError};
use crate::flight::FlightFrame;
use crate::globe::{Globe, View};
use crate::picture::Picture;
use crate::scene::World;

/// Measured noise model of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The body.
    pub body: Kind,
    /// Effective limb height in kilometres; 0 for Sun and Moon.
    pub limb_height_km: f64,
    /// Standard deviation of the limb heights of the pictures, kilometres.
    pub limb_height_sigma_km: f64,
    /// Source of the noise: the two values below for every picture, or the residuals of each picture.
    pub noise: Noise,
    /// Standard deviation of an edge point in pixels; with [`Noise::Rms`] it is a floor.
    pub sigma_px: f64,
    /// Integral length of the errors along the limb in pixels; with [`Noise::Rms`] it is a floor.
    pub correlation_px: f64,
    /// Mean NEES with this model; 2 is ideal.
    pub nees: f64,
    /// Number of pictures with an answer, and number of examined pictures.
    pub frames: [usize; 2],
}

/// Step from one seed of the measured pictures to the next. The first seed is one step above the scenario's seed.
const OTHER_SEED: u64 = 7919;
/// Number of other seeds that are measured.
const SEEDS: u64 = 16;
/// Default number of pictures on which a [`Fit`] is measured.
pub const FIT_PICTURES: u32 = 32;
/// Integral lengths that are tested, pixels.
const LENGTHS_PX: [f64; 7] = [10.0, 20.0, 40.0, 80.0, 160.0, 320.0, 640.0];
/// Largest mean NEES of a settled model: 2 times the square of 1.15.
const MAX_NEES: f64 = 2.645;
/// Smallest sigma of an edge point, pixels.
const MIN_SIGMA_PX: f64 = 0.02;
/// Largest number of times that the sigmas are scaled.
const MAX_ROUNDS: u32 = 4;
/// An answer with a larger error is wrong, not noisy: 2 degrees.
const GROSS_RAD: f64 = std::f64::consts::PI / 90.0;

impl Fit {
    /// Measures the noise model on `pictures` pictures of the scenario, spread over sixteen other seeds. `progress` is
    /// called after every picture. There is one fit per body, except for bodies with too few answered pictures. A scene
    /// with an ellipsoid has no fit: the limb height follows from the scene, and the noise from each picture.
    ///
    /// # Errors
    /// Fails like [`crate::Scene::render`].
    pub fn measure(
        scenario: &Scenario,
        pictures: u32,
        progress: &dyn Fn(usize, usize),
    ) -> Result<Vec<Self>, ScenarioError> {
        let mut flights = Vec::new();
        if scenario.ellipsoid().is_some() {
            return Ok(Vec::new());
        }
        for i in 1..=SEEDS {
            let other = Scenario { seed: scenario.seed.wrapping_add(i * OTHER_SEED), ..scenario.clone() };
            // With another drift the limb may stay out of view; such a seed is skipped.
            flights.extend(other.flight_with_times(&picture_times_s(scenario.span_s(), i - 1, pictures)).ok());
        }
        let frames: Vec<&FlightFrame> = flights.iter().flat_map(|f| &f.frames).collect();
        let mut rendered = Vec::with_capacity(frames.len());
        for frame in &frames {
            rendered.push(frame.render().map_err(|e| ScenarioError::new("[trajectory]", e.to_string()))?);
            progress(rendered.len(), frames.len());
        }
        Ok(Self::measure_pictures(scenario, &frames.into_iter().zip(&rendered).collect::<Vec<_>>()))
    }

    /// Measures the noise model, like [`Fit::measure`], on pictures that are already rendered, each with its frame.
    pub fn measure_pictures(scenario: &Scenario, pictures: &[(&FlightFrame, &Picture)]) -> Vec<Self> {
        let sensor = scenario.sensor();
        let for_body =
            |body: &body::Config| Config { body: body.clone(), bodies: Default::default(), ..sensor.clone() };
        sensor.each_body().iter().filter_map(|body| Self::new(scenario, &for_body(body), pictures)).collect()
    }

    /// Measures the noise model of the one body that the sensor looks for.
    fn new(scenario: &Scenario, one_body: &Config, pictures: &[(&FlightFrame, &Picture)]) -> Option<Self> {
        let kind = one_body.body.kind;
        // In the first pass the limb height is unknown, and the points scatter by a pixel.
        let mut sensor = one_body.clone();
        sensor.body.limb_height_sigma_km = 8.0;
        let first = process_all(scenario, &sensor, pictures);
        // Wrong answers would add points that are not on the limb.
        let max_rad = 4.0 * median(first.iter().map(|l| l.error_rad));
        let answered: Vec<&Processed> = first.iter().filter(|l| l.error_rad <= max_rad.min(0.02)).collect();
        if answered.len() < 4 {
            return None;
        }
        let mut edges: Vec<EdgeErrors> =
            answered.iter().filter_map(|l| EdgeErrors::new(kind, l, sensor.body.limb_height_km)).collect();
        // A picture whose mean is far from all others has an answer on another edge; its direction is right by chance.
        let middle = median(edges.iter().map(|p| p.mean_km));
        let usual = median(edges.iter().map(|p| (p.mean_km - middle).abs()));
        edges.retain(|p| (p.mean_km - middle).abs() <= 6.0 * usual.max(0.1));
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        let heights: Vec<f64> = edges.iter().map(|p| p.mean_km).collect();
        let height_km = mean(&heights);
        let spread_km =
            (heights.iter().map(|h| (h - height_km) * (h - height_km)).sum::<f64>() / heights.len() as f64).sqrt();
        let variance = mean(&edges.iter().map(|p| p.variance_px2).collect::<Vec<_>>());
        let is_disc = matches!(kind, Kind::Sun | Kind::Moon);
        let fit = Self {
            body: kind,
            limb_height_km: if is_disc { 0.0 } else { sensor.body.limb_height_km + height_km },
            limb_height_sigma_km: if is_disc { 0.0 } else { spread_km.max(0.2) },
            noise: Noise::Given,
            sigma_px: variance.sqrt().max(MIN_SIGMA_PX),
            correlation_px: f64::NAN,
            nees: f64::NAN,
            frames: [answered.len(), pictures.len()],
        };
        // The sigma of the limb height contains the error that the points of a picture share. The only floor left is
        // the floor for rounding.
        let by_picture = Self { noise: Noise::Rms, sigma_px: MIN_SIGMA_PX, correlation_px: 0.0, ..fit };
        let noise = if is_disc { Noise::Given } else { Noise::Rms };
        let by_itself = (!is_disc).then(|| by_picture.settle(scenario, one_body, pictures)).flatten();
        let by_itself = by_itself.filter(|(fit, _)| fit.nees <= MAX_NEES);
        // Errors that the residuals do not show, for example light that clips along the limb, need a floor.
        by_itself.map(|(fit, _)| fit).or_else(|| {
            let floors = LENGTHS_PX.map(|length| Self { noise, correlation_px: length, ..fit });
            let settled = floors.into_iter().map(|model| model.settle(scenario, one_body, pictures));
            settled.flatten().min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(fit, _)| fit)
        })
    }

    /// Scales the sigmas until the errors of the answers are as large as their covariance. Also returns how unlikely
    /// these errors are: twice the mean negative log-likelihood, without a constant.
    fn settle(
        mut self,
        scenario: &Scenario,
        one_body: &Config,
        pictures: &[(&FlightFrame, &Picture)],
    ) -> Option<(Self, f64)> {
        let mut unlikely = f64::NAN;
        for round in 0..=MAX_ROUNDS {
            let mut sensor = one_body.clone();
            self.apply(&mut sensor);
            let processed = process_all(scenario, &sensor, pictures);
            let usable: Vec<&Processed> =
                processed.iter().filter(|l| l.nees.is_finite() && l.error_rad < GROSS_RAD).collect();
            if usable.len() < 4 {
                return None;
            }
            let mean =
                |value: &dyn Fn(&Processed) -> f64| usable.iter().map(|l| value(l)).sum::<f64>() / usable.len() as f64;
            self.nees = mean(&|l| l.nees);
            unlikely = mean(&|l| l.log_det) + self.nees;
            let scale = (self.nees / 2.0).sqrt().clamp(0.5, 2.5);
            // The reported values belong to the last model, settled or not.
            if (0.85..1.15).contains(&scale) || round == MAX_ROUNDS {
                break;
            }
            self.sigma_px *= scale;
            if self.limb_height_sigma_km > 0.0 {
                self.limb_height_sigma_km *= scale.max(1.0);
            }
        }
        Some((self, unlikely))
    }

    /// Writes the model of the body into a sensor that looks for it.
    pub fn apply(&self, sensor: &mut Config) {
        // The values keep two digits more than are significant. Rows by latitude move up or down with the mean.
        let digits = |x: f64| (x * 1e3).round() / 1e3;
        let noise = covariance::Config {
            method: sensor.covariance.method,
            noise: self.noise,
            ..covariance::Config::given(digits(self.sigma_px), digits(self.correlation_px))
        };
        let several = !sensor.bodies.is_empty();
        let Some(body) = sensor.each_body_mut().iter_mut().find(|b| b.kind == self.body) else { return };
        if body.kind == Kind::Earth {
            for row in &mut body.limb_height_by_latitude_km {
                row[1] = digits(row[1] + self.limb_height_km - body.limb_height_km);
            }
            let [height_km, sigma_km] = [self.limb_height_km, self.limb_height_sigma_km].map(digits);
            if body.limb.thermal_km().is_some() {
                body.tell_limb_height(height_km, sigma_km);
            }
            (body.limb_height_km, body.limb_height_sigma_km) = (height_km, sigma_km);
            // The measured height already includes clipped limbs. What clipping adds to one of them differs.
            body.clipped_height_km = 0.0;
        }
        if several {
            body.covariance = Some(noise);
        } else {
            sensor.covariance = noise;
        }
    }
}

/// Returns the median RMS of the residuals of a sensor that looks for one body, in pixels, on `pictures` pictures of
/// the scenario with another seed. `None` if no picture has an answer.
///
/// # Errors
/// Fails like [`crate::Scene::render`].
pub fn median_rms_px(scenario: &Scenario, sensor: &Config, pictures: u32) -> Result<Option<f64>, ScenarioError> {
    let other = Scenario { seed: scenario.seed.wrapping_add((SEEDS + 1) * OTHER_SEED), ..scenario.clone() };
    let [from_s, to_s] = scenario.span_s();
    let time_s = |i: u32| from_s + (to_s - from_s) * (f64::from(i) + 0.5) / f64::from(pictures);
    let flight = other.flight_with_times(&(0..pictures).map(time_s).collect::<Vec<_>>())?;
    let mut rendered = Vec::with_capacity(flight.frames.len());
    for frame in &flight.frames {
        rendered.push(frame.render().map_err(|e| ScenarioError::new("[trajectory]", e.to_string()))?);
    }
    let pairs: Vec<_> = flight.frames.iter().zip(&rendered).collect();
    let processed = process_all(scenario, sensor, &pairs);
    Ok((!processed.is_empty()).then(|| median(processed.iter().map(|p| p.rms_px))))
}

/// Returns the times of the pictures of seed number `seed_index` (from 0). The pictures of all seeds together are
/// `pictures`, spread evenly over the whole span. The pictures of one seed are far apart.
fn picture_times_s([from_s, to_s]: [f64; 2], seed_index: u64, pictures: u32) -> Vec<f64> {
    let count = u64::from(pictures).div_ceil(SEEDS).max(2);
    let fraction = |k: u64| ((k * SEEDS + seed_index) as f64 + 0.5) / (count * SEEDS) as f64;
    (0..count).map(|k| from_s + (to_s - from_s) * fraction(k)).collect()
}

/// Returns the middle value.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// The sensor's answer to one picture, compared with the truth.
struct Processed<'a> {
    frame: &'a FlightFrame,
    /// Edge points of the answer with their weights, in order.
    points: WeightedPoints,
    error_rad: f64,
    /// RMS of the residuals, pixels.
    rms_px: f64,
    nees: f64,
    /// Logarithm of the covariance's determinant.
    log_det: f64,
}

fn process_all<'a>(
    scenario: &Scenario,
    sensor: &Config,
    pictures: &[(&'a FlightFrame, &Picture)],
) -> Vec<Processed<'a>> {
    let Ok(mut horizon) = HostHorizon::boxed(sensor) else { return Vec::new() };
    let mut processed = Vec::new();
    for (frame, picture) in pictures {
        let Ok(truth) = frame.scene.body_truth(sensor.body.kind, &frame.file, frame.time_s) else { continue };
        let prior = match scenario.known.attitude_sigma_deg {
            Some(deg) => frame.prior_with_attitude(deg.to_radians()),
            None => frame.prior(),
        };
        let Ok(expected) = horizon.expect(&prior) else { continue };
        let points = PointRecorder::default();
        let report = horizon.find_observed(&picture.view(), &expected, &points);
        let (Some(solution), Some(axis), true) = (report.solution, truth.axis(), truth.has_limb()) else { continue };
        let points = points.candidate_points(solution.candidate);
        let p = solution.covariance.rows();
        let e = Vector3::from(solution.axis.xyz());
        // The covariance has rank 2, so its null direction is filled before the inversion.
        let scale = p[0][0] + p[1][1] + p[2][2];
        let full = Matrix3::from_fn(|i, j| p[i][j] + scale * e[i] * e[j]);
        let d = Vector3::from(axis.xyz()) - e;
        processed.push(Processed {
            frame,
            points: points.into_iter().filter(|p| p.1 > 0.0).collect(),
            error_rad: solution.axis.angle_rad(&axis),
            rms_px: solution.rms_px,
            nees: full.try_inverse().map_or(f64::NAN, |inverse| d.dot(&(inverse * d))),
            log_det: (full.determinant() / scale).ln(),
        });
    }
    processed
}

/// Errors of the edge points of one picture.
struct EdgeErrors {
    /// Mean height above the assumed limb, kilometres.
    mean_km: f64,
    /// Mean square of the errors along the normal, without their mean.
    variance_px2: f64,
}

impl EdgeErrors {
    fn new(kind: Kind, processed: &Processed<'_>, limb_height_km: f64) -> Option<Self> {
        let scene = &processed.frame.scene;
        let readout_s = scene.motion.map_or(0.0, |motion| motion.readout_s);
        let camera = Camera::<f64>::try_new(&camera::Config { readout_s, ..scene.camera.clone() }).ok()?;
        // The rays are for the time of the middle row, because the truth holds for that time.
        let camera = camera.with_rate(processed.frame.prior().rate_rad_s);
        let view = View::try_new(Globe::new(&scene.body).raised(limb_height_km * 1e3), &scene.pose)?;
        let truth = scene.body_truth(kind, "", 0.0).ok()?;
        let axis: UnitVec3<_, f64> = truth.axis()?;
        let is_disc = matches!(kind, Kind::Sun | Kind::Moon);
        // `higher_km` is the height of the scene's limb at a latitude above the mean limb.
        let levels = match &scene.world {
            World::Infrared(world) => Some((world.half_levels(), world.mean_half_level_km())),
            World::Plain | World::Visible(_) | World::Ellipsoid(_) => None,
        };
        let higher_km = |up: &Vector3<f64>| {
            let latitude_deg = libm::asin(up.z.clamp(-1.0, 1.0)).to_degrees();
            levels.as_ref().map_or(0.0, |(half_level_km, mean_km)| half_level_km(latitude_deg) - mean_km)
        };
        // (distance outside the limb, the same per pixel, weight)
        let off: Vec<(f64, f64, f64)> = processed
            .points
            .iter()
            .filter_map(|&([u, v], weight)| {
                let ray = camera.ray(ImagePoint { u, v })?;
                let jacobian = ray.jacobian();
                if is_disc {
                    let s = ray.direction();
                    let by: [f64; 2] = [0, 1].map(|c| (0..3).map(|i| jacobian[i][c] * axis.xyz()[i]).sum::<f64>());
                    let angle = s.angle_rad(&axis);
                    let slope = libm::hypot(by[0], by[1]) / libm::sin(angle).max(1e-9);
                    return Some((angle - truth.half_angle_deg.to_radians(), slope, weight));
                }
                let hit = view.intersect(ray.direction().xyz());
                let [gu, gv] = view.tangent_height_gradient(&hit, &jacobian);
                let off_km = view.tangent_height_m(&hit) * 1e-3 - higher_km(&view.normal(&view.point(&hit)));
                Some((off_km, libm::hypot(gu, gv) * 1e-3, weight))
            })
            .collect();
        if off.len() < 20 {
            return None;
        }
        let sum: f64 = off.iter().map(|(_, _, w)| w).sum();
        let mean_km = off.iter().map(|(h, _, w)| w * h).sum::<f64>() / sum;
        let square_px = |(h, g, w): &(f64, f64, f64)| w * ((h - mean_km) / g.max(1e-12)).powi(2);
        Some(Self { mean_km, variance_px2: off.iter().map(square_px).sum::<f64>() / sum })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_spread_over_the_whole_capture() {
        let mut all: Vec<f64> = (0..SEEDS).flat_map(|i| picture_times_s([60.0, 380.0], i, FIT_PICTURES)).collect();
        all.sort_by(f64::total_cmp);
        assert_eq!(all.len(), FIT_PICTURES as usize);
        assert!(all.windows(2).all(|w| (w[1] - w[0] - 10.0).abs() < 1e-9), "{all:?}");
        assert_eq!((all[0], all[31]), (65.0, 375.0));
        assert_eq!(picture_times_s([0.0, 32.0], 3, 1), [3.5, 19.5], "at least two a seed");
    }

    /// The start sigma is so large that four scalings do not bring it down to the errors.
    #[test]
    fn a_fit_that_does_not_settle_says_what_holds_with_it() {
        let mut scenario: Scenario = toml::from_str(crate::scenario::BUILTIN[2].2).unwrap();
        scenario.capture.frames = 8;
        let flight = scenario.flight().unwrap();
        let pictures: Vec<_> = flight.frames.iter().map(|f| f.render().unwrap()).collect();
        let pairs: Vec<_> = flight.frames.iter().zip(&pictures).collect();
        let mut sensor = scenario.sensor();
        // Open gates accept the answers for every covariance.
        sensor.gates.max_sigma_deg = 90.0;
        sensor.gates.max_half_angle_sigma = 1e6;
        let start = Fit {
            body: sensor.body.kind,
            limb_height_km: sensor.body.limb_height_km,
            limb_height_sigma_km: 0.05,
            noise: Noise::Given,
            sigma_px: 4.0,
            correlation_px: 40.0,
            nees: f64::NAN,
            frames: [8, 8],
        };
        let (fit, _) = start.settle(&scenario, &sensor, &pairs).unwrap();
        assert!(fit.nees < 1.4, "{fit:?} settled");
        let mut fitted = sensor.clone();
        fit.apply(&mut fitted);
        let processed = process_all(&scenario, &fitted, &pairs);
        let nees: Vec<f64> =
            processed.iter().filter(|l| l.error_rad < GROSS_RAD).map(|l| l.nees).filter(|n| n.is_finite()).collect();
        assert_eq!(fit.nees, nees.iter().sum::<f64>() / nees.len() as f64);
    }
}
