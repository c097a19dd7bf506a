//! The noise model that fits a scenario: how high its limb stands, and how edge points scatter about it.
//!
//! Pictures of the same scenario with other seeds (other clouds, another drift) go through the sensor. Edge points that
//! it holds for limb are compared with the exact limb: their mean height is the limb height, the scatter of the pictures'
//! means its sigma; what is left is a process along the limb with a variance and an integral length. At last
//! both are scaled so that the answers' errors are as large as they are said to be.

use core::cell::RefCell;

use hzn_core::body::{self, Kind};
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::pipeline::{Candidate, Observer, Solution};
use hzn_core::pixel::{ImagePoint, Pixel};
use hzn_core::{Config, HostHorizon, covariance};
use nalgebra::{Matrix3, Vector3};

use super::{Scenario, ScenarioError};
use crate::flight::FlightFrame;
use crate::globe::{Globe, View};
use crate::picture::Picture;
use crate::scene::World;

/// What was measured of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Which.
    pub body: Kind,
    /// Effective limb height in kilometres; 0 for Sun and Moon.
    pub limb_height_km: f64,
    /// Standard deviation of the pictures' own limb heights, kilometres.
    pub limb_height_sigma_km: f64,
    /// Standard deviation of an edge point in pixels.
    pub sigma_px: f64,
    /// Integral length of the errors along the limb in pixels.
    pub correlation_px: f64,
    /// Mean squared error over covariance with this model; 2 is ideal.
    pub nees: f64,
    /// Pictures with an answer, and how many were looked at.
    pub frames: [usize; 2],
}

/// What is added to the scenario's seed, again and again, for the pictures that are measured; and how many seeds.
const OTHER_SEED: u64 = 7919;
const SEEDS: u64 = 4;
/// Pictures that a [`Fit`] is measured on where nobody says otherwise.
pub const MEASURED: u32 = 32;
/// Bins of the autocovariance: width in pixels, and how many.
const BIN_PX: f64 = 6.0;
const BINS: usize = 200;
/// Shortest integral length that is told apart from none.
const LEAST_PX: f64 = 10.0;
/// A NEES beyond this is a wrong answer, not a noisy one.
const NEES_MOST: f64 = 20.0;

impl Fit {
    /// Measures `pictures` pictures of the scenario, spread over four other seeds; `progress` hears of every one. One fit a
    /// body, but for those of which too few pictures are answered to say anything.
    ///
    /// # Errors
    /// As [`crate::Scene::render`].
    pub fn measure(
        scenario: &Scenario,
        pictures: u32,
        progress: &dyn Fn(usize, usize),
    ) -> Result<Vec<Self>, ScenarioError> {
        let mut flights = Vec::new();
        for i in 1..=SEEDS {
            let mut other = scenario.clone();
            other.seed = scenario.seed.wrapping_add(i * OTHER_SEED);
            other.capture.frames = pictures.div_ceil(SEEDS as u32).max(2);
            // With another drift the limb may stay out of view: nothing to measure there.
            flights.extend(other.flight().ok());
        }
        let total = flights.iter().map(|f| f.frames.len()).sum();
        let mut seen = Vec::with_capacity(total);
        for frame in flights.iter().flat_map(|f| &f.frames) {
            let picture = frame.render().map_err(|e| ScenarioError::new("[trajectory]", e.to_string()))?;
            seen.push((frame, picture));
            progress(seen.len(), total);
        }
        let sensor = scenario.sensor();
        let alone = |body: &body::Config| Config { body: body.clone(), bodies: Default::default(), ..sensor.clone() };
        Ok(sensor.each_body().iter().filter_map(|body| Self::of(scenario, &alone(body), &seen)).collect())
    }

    /// Of the one body that the sensor looks for.
    fn of(scenario: &Scenario, alone: &Config, seen: &[(&FlightFrame, Picture)]) -> Option<Self> {
        let kind = alone.body.kind;
        // At first nothing is known of the limb's height, and points scatter by a pixel.
        let mut sensor = alone.clone();
        sensor.body.limb_height_sigma_km = 8.0;
        let first = look(scenario, &sensor, seen);
        // Wrong answers would bring points that are not of the limb.
        let most = 4.0 * median(first.iter().map(|l| l.error_rad));
        let answered: Vec<&Looked> = first.iter().filter(|l| l.error_rad <= most.min(0.02)).collect();
        if answered.len() < 4 {
            return None;
        }
        let mut pictures: Vec<Edge> =
            answered.iter().filter_map(|l| Edge::of(kind, l, sensor.body.limb_height_km)).collect();
        // A picture far from all others is an answer on another edge: its direction is right by chance.
        let middle = median(pictures.iter().map(|p| p.mean_km));
        let usual = median(pictures.iter().map(|p| (p.mean_km - middle).abs()));
        pictures.retain(|p| (p.mean_km - middle).abs() <= 6.0 * usual.max(0.1));
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        let heights: Vec<f64> = pictures.iter().map(|p| p.mean_km).collect();
        let height_km = mean(&heights);
        let spread_km =
            (heights.iter().map(|h| (h - height_km) * (h - height_km)).sum::<f64>() / heights.len() as f64).sqrt();
        let (mut variance, mut length) = autocovariance(&pictures);
        // Only their product counts where the edge is much longer; a length of a few pixels says no more than that.
        if length < LEAST_PX {
            variance *= length / LEAST_PX;
            length = LEAST_PX;
        }
        let disc = matches!(kind, Kind::Sun | Kind::Moon);
        let mut fit = Self {
            body: kind,
            limb_height_km: if disc { 0.0 } else { sensor.body.limb_height_km + height_km },
            limb_height_sigma_km: if disc { 0.0 } else { spread_km.max(0.2) },
            sigma_px: variance.sqrt().max(0.02),
            correlation_px: length,
            nees: f64::NAN,
            frames: [answered.len(), seen.len()],
        };
        for _ in 0..4 {
            let mut sensor = alone.clone();
            fit.apply(&mut sensor);
            let nees: Vec<f64> =
                look(scenario, &sensor, seen).iter().map(|l| l.nees.min(NEES_MOST)).filter(|n| n.is_finite()).collect();
            fit.nees = mean(&nees);
            let scale = (fit.nees / 2.0).sqrt().clamp(0.5, 2.5);
            if nees.len() < 4 || (0.85..1.15).contains(&scale) {
                break;
            }
            fit.sigma_px *= scale;
            if !disc {
                fit.limb_height_sigma_km *= scale.max(1.0);
            }
        }
        Some(fit)
    }

    /// Writes the model of the body into a sensor that looks for it.
    pub fn apply(&self, sensor: &mut Config) {
        // Two digits more than are known. Rows by latitude go up or down with the mean.
        let digits = |x: f64| (x * 1e3).round() / 1e3;
        let noise = covariance::Config {
            sigma_px: digits(self.sigma_px),
            correlation_px: digits(self.correlation_px),
            ..sensor.covariance
        };
        let several = !sensor.bodies.is_empty();
        let Some(body) = sensor.each_body_mut().iter_mut().find(|b| b.kind == self.body) else { return };
        if body.kind == Kind::Earth {
            for row in &mut body.limb_height_by_latitude_km {
                row[1] = digits(row[1] + self.limb_height_km - body.limb_height_km);
            }
            body.limb_height_km = digits(self.limb_height_km);
            body.limb_height_sigma_km = digits(self.limb_height_sigma_km);
        }
        if several {
            body.covariance = Some(noise);
        } else {
            sensor.covariance = noise;
        }
    }
}

/// The middle value.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// What the sensor says to one picture, beside the truth.
struct Looked<'a> {
    frame: &'a FlightFrame,
    /// Edge points of the answer with their weights, in their order.
    points: Weighted,
    error_rad: f64,
    nees: f64,
}

fn look<'a>(scenario: &Scenario, sensor: &Config, seen: &'a [(&'a FlightFrame, Picture)]) -> Vec<Looked<'a>> {
    let config = sensor.clone();
    // A host sensor is some megabytes, and made on the stack before it is moved: more than a thread may have.
    let make = move || HostHorizon::new(&config).map(Box::new);
    let made = std::thread::Builder::new().stack_size(64 << 20).spawn(make).map(std::thread::JoinHandle::join);
    let Ok(Ok(Ok(mut horizon))) = made else { return Vec::new() };
    let mut out = Vec::new();
    for (frame, picture) in seen {
        let Ok(truth) = frame.scene.truth_of(sensor.body.kind, &frame.file, frame.time_s) else { continue };
        let known = match scenario.known.attitude_sigma_deg {
            Some(deg) => frame.known_with_attitude(deg.to_radians()),
            None => frame.known(),
        };
        let Ok(expected) = horizon.expect(&known) else { continue };
        let watch = Watch::default();
        let report = horizon.process_observed(&picture.view(), &expected, &watch);
        let (Some(solution), Some(axis), true) = (report.solution, truth.axis(), truth.has_limb()) else { continue };
        let points = watch.candidates.borrow().get(solution.candidate as usize).cloned().unwrap_or_default();
        let p = solution.covariance.rows();
        let e = Vector3::from(solution.axis.xyz());
        // Rank 2: the null direction is filled up before inverting.
        let scale = p[0][0] + p[1][1] + p[2][2];
        let full = Matrix3::from_fn(|i, j| p[i][j] + scale * e[i] * e[j]);
        let d = Vector3::from(axis.xyz()) - e;
        out.push(Looked {
            frame,
            points: points.into_iter().filter(|p| p.1 > 0.0).collect(),
            error_rad: solution.axis.angle_rad(&axis),
            nees: full.try_inverse().map_or(f64::NAN, |inverse| d.dot(&(inverse * d))),
        });
    }
    out
}

/// Points with their weights.
type Weighted = Vec<(ImagePoint<f64>, f64)>;

/// Collects the points of every candidate.
#[derive(Default)]
struct Watch {
    candidates: RefCell<Vec<Weighted>>,
}

impl Observer<f64> for Watch {
    fn edge(&self, candidate: u32, _: impl Iterator<Item = Pixel>, _: u32) {
        let mut all = self.candidates.borrow_mut();
        let at = candidate as usize;
        if all.len() <= at {
            all.resize(at + 1, Vec::new());
        }
        if let Some(points) = all.get_mut(at) {
            points.clear();
        }
    }
    fn point(&self, candidate: u32, point: ImagePoint<f64>) {
        if let Some(points) = self.candidates.borrow_mut().get_mut(candidate as usize) {
            points.push((point, 0.0));
        }
    }
    fn weight(&self, candidate: u32, point: u32, weight: f64) {
        if let Some(points) = self.candidates.borrow_mut().get_mut(candidate as usize)
            && let Some(p) = points.get_mut(point as usize)
        {
            p.1 = weight;
        }
    }
    fn verdict(&self, _: u32, _: &Candidate<f64>, _: Option<&Solution<f64>>) {}
}

/// Errors of the edge points of one picture.
struct Edge {
    /// Mean height above the assumed limb, kilometres.
    mean_km: f64,
    /// (point, error along the normal in pixels without the mean, weight), in order along the edge.
    errors: Vec<(ImagePoint<f64>, f64, f64)>,
}

impl Edge {
    fn of(kind: Kind, looked: &Looked<'_>, limb_height_km: f64) -> Option<Self> {
        let scene = &looked.frame.scene;
        let camera = Camera::<f64>::try_new(&scene.camera).ok()?;
        let view = View::try_new(Globe::of(&scene.body).raised(limb_height_km * 1e3), &scene.pose)?;
        let truth = scene.truth_of(kind, "", 0.0).ok()?;
        let axis: UnitVec3<_, f64> = truth.axis()?;
        let disc = matches!(kind, Kind::Sun | Kind::Moon);
        // How much higher the limb is over this latitude than on average, as the scene has it.
        let levels = match &scene.world {
            World::Infrared(world) => Some((world.half_levels(), world.mean_half_level_km())),
            World::Plain | World::Visible(_) => None,
        };
        let higher_km = |up: &Vector3<f64>| {
            let latitude_deg = libm::asin(up.z.clamp(-1.0, 1.0)).to_degrees();
            levels.as_ref().map_or(0.0, |(half_level_km, mean_km)| half_level_km(latitude_deg) - mean_km)
        };
        // (point, off the limb outward, the same a pixel, weight)
        let off: Vec<(ImagePoint<f64>, f64, f64, f64)> = looked
            .points
            .iter()
            .filter_map(|&(point, weight)| {
                let ray = camera.ray(point)?;
                let jacobian = ray.jacobian();
                if disc {
                    let s = ray.direction();
                    let by: [f64; 2] = [0, 1].map(|c| (0..3).map(|i| jacobian[i][c] * axis.xyz()[i]).sum::<f64>());
                    let angle = s.angle_rad(&axis);
                    let slope = libm::hypot(by[0], by[1]) / libm::sin(angle).max(1e-9);
                    return Some((point, angle - truth.half_angle_deg.to_radians(), slope, weight));
                }
                let sight = view.look(ray.direction().xyz());
                let [gu, gv] = view.tangent_height_gradient(&sight, &jacobian);
                let off_km = view.tangent_height_m(&sight) * 1e-3 - higher_km(&view.normal(&view.point(&sight)));
                Some((point, off_km, libm::hypot(gu, gv) * 1e-3, weight))
            })
            .collect();
        if off.len() < 20 {
            return None;
        }
        let sum: f64 = off.iter().map(|o| o.3).sum();
        let mean = off.iter().map(|o| o.3 * o.1).sum::<f64>() / sum;
        let errors = off.into_iter().map(|(p, h, g, w)| (p, (h - mean) / g.max(1e-12), w)).collect();
        Some(Self { mean_km: mean, errors })
    }
}

/// Variance in px², and the integral length in pixels: the area under the autocorrelation up to its first zero.
fn autocovariance(pictures: &[Edge]) -> (f64, f64) {
    let (mut sum, mut count) = (vec![0.0f64; BINS], vec![0.0f64; BINS]);
    let (mut square, mut n) = (0.0, 0.0);
    for edge in pictures {
        for (i, (p, e, w)) in edge.errors.iter().enumerate() {
            square += w * e * e;
            n += w;
            let (mut arc, mut last) = (0.0, *p);
            for (q, f, v) in &edge.errors[i + 1..] {
                arc += libm::hypot(q.u - last.u, q.v - last.v);
                last = *q;
                let bin = (arc / BIN_PX) as usize;
                if bin >= BINS {
                    break;
                }
                sum[bin] += w * v * e * f;
                count[bin] += w * v;
            }
        }
    }
    let variance = square / f64::max(n, 1.0);
    let mut length = 0.0;
    for (s, c) in sum.iter().zip(&count).filter(|(_, c)| **c > 0.0) {
        let correlation = s / c / variance.max(1e-12);
        if correlation <= 0.0 {
            break;
        }
        length += correlation * BIN_PX;
    }
    (variance, length)
}
