//! All facts about one picture that the window draws and prints.

use std::cell::RefCell;
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use egui::{Color32, ColorImage};
use hzn_calib::FrameData;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::image::ImageView;
use hzn_core::pixel::{ImagePoint, Pixel};
use hzn_core::real::Real;
use hzn_core::report::Candidate;
use hzn_core::status::Stage;
use hzn_core::{Config, Observer, Report, Solution, body};
use hzn_mcap::Row;
use hzn_run::engine::trace::Edge;
use hzn_run::engine::{AnySensor, BodyOutcome, Finished, Trace, Traces, Watch};
use hzn_run::source::Picture;
use hzn_run::{explain, overlay, sink};

use super::paint::Recipe;
use crate::model::view::Point;

/// One picture, processed with the current parameters.
#[derive(Debug, Clone)]
pub struct FrameView {
    /// Index of the picture in the sequence.
    pub index: usize,
    /// Name of the picture.
    pub name: String,
    /// Time in seconds, if it is known.
    pub time_s: Option<f64>,
    /// Data of the picture that were known before it was processed.
    pub data: Option<FrameData>,
    /// The picture, or the reason why there is none.
    pub picture: Result<Arc<Picture>, String>,
    /// The picture as it is shown. It is the same `Arc` as before if it has not changed.
    pub image: Option<Arc<Shown>>,
    /// The camera, if there is a sensor.
    pub camera: Option<Arc<Camera<f64>>>,
    /// Results: of the session, then of the configuration that it is compared with.
    pub answers: Vec<Arc<Outcome>>,
    /// Version number of the session's configuration.
    pub version: u64,
    /// Time to read and decode the picture; `None` if it was already decoded.
    pub decoding: Option<Duration>,
    /// Time from the request to the answer.
    pub latency: Duration,
}

impl FrameView {
    /// Returns width and height of the picture in pixels, if it could be read.
    pub fn size(&self) -> Option<Point> {
        let layout = self.picture.as_ref().ok()?.layout;
        Some([layout.width.into(), layout.height.into()])
    }
}

/// A picture for the screen.
#[derive(Debug)]
pub struct Shown {
    /// Index and recipe of the picture that the pixels were painted for.
    pub key: (usize, Recipe),
    /// The pixels.
    pub image: Arc<ColorImage>,
}

/// Result of one configuration for a picture.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The configuration.
    pub config: Arc<Config>,
    /// Results of the bodies, in order.
    pub bodies: Vec<BodyResult>,
    /// Reason why the picture was not processed, for example because it has another size.
    pub refused: Option<String>,
    /// Pixels that were read, white in a transparent picture; only on request.
    pub touched: Option<Arc<ColorImage>>,
    /// Number of different pixels that were read.
    pub touched_pixels: Option<usize>,
}

impl Outcome {
    /// Returns the outcome of a picture that is not processed yet.
    pub(super) fn new(config: &Arc<Config>) -> Self {
        Self { config: Arc::clone(config), bodies: Vec::new(), refused: None, touched: None, touched_pixels: None }
    }
}

/// Result for one body.
#[derive(Debug, Clone)]
pub struct BodyResult {
    /// Kind of the body.
    pub kind: body::Kind,
    /// The result as it is written to files.
    pub row: Row,
    /// The report, or the reason why there is none.
    pub report: Result<Report<f64>, String>,
    /// Candidate edges, in the order in which they were followed.
    pub edges: Vec<Edge>,
    /// Mean and number of the sampled pixels that the threshold was computed from.
    pub sample: Option<(f64, u32)>,
    /// Time of each stage while an observer watches.
    pub times: Vec<(Stage, Duration)>,
    /// Total time, without an observer unless the sensor tracks the threshold.
    pub elapsed: Duration,
    /// Expected half-angle in radians; `None` if none can be computed.
    pub expected_rad: Option<f64>,
    /// The fitted limb, as lines that end at the border of the picture.
    pub limb: Vec<Vec<Point>>,
    /// Picture point of the limb axis.
    pub axis: Option<Point>,
    /// Outline of the 3-sigma ellipse of the axis, in the picture.
    pub ellipse: Vec<Point>,
    /// Residuals of the chosen edge's points.
    pub residuals: Vec<Residual>,
}

/// Residual of one edge point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Angle about the limb axis in degrees, -180 to 180, from image x towards image y.
    pub azimuth_deg: f64,
    /// Distance from the fitted limb in pixels, positive outside.
    pub distance_px: f64,
    /// Weight in the fit, 0 to 1.
    pub weight: f64,
    /// The edge point, in pixels.
    pub point: Point,
}

impl Residual {
    /// Returns the rejected point that is nearest to a point of the picture, within `reach_px`.
    pub fn rejected_at(all: &[Self], p: Point, reach_px: f64) -> Option<&Self> {
        let distance = |r: &&Self| (r.point[0] - p[0]).hypot(r.point[1] - p[1]);
        let rejected = all.iter().filter(|r| r.weight <= 0.0 && distance(r) <= reach_px);
        rejected.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

impl BodyResult {
    /// Collects the result for a body. `camera` is the camera that the limb is drawn with.
    fn new(
        kind: body::Kind,
        outcome: BodyOutcome,
        row: Row,
        expected_rad: Option<f64>,
        trace: &Trace,
        camera: &Camera<f64>,
    ) -> Self {
        let solution = outcome.report.as_ref().ok().and_then(|r| r.solution.as_ref()).copied();
        let edges = trace.edges().clone();
        let chosen = solution.and_then(|s| edges.iter().find(|e| e.candidate == s.candidate));
        Self {
            kind,
            row,
            sample: trace.level().map(|(_, mean, n)| (mean, n)),
            times: trace.times().to_vec(),
            elapsed: outcome.elapsed,
            expected_rad,
            limb: solution
                .map(|s| overlay::draw_cone(&s.axis, s.fused_half_angle_rad, camera).limb)
                .unwrap_or_default(),
            axis: solution.and_then(|s| camera.project(&s.axis)).map(|p| [p.u, p.v]),
            ellipse: solution.map(|s| ellipse(&s, camera)).unwrap_or_default(),
            residuals: solution.zip(chosen).map(|(s, edge)| residuals(&s, edge, camera)).unwrap_or_default(),
            report: outcome.report.map_err(|e| e.why),
            edges,
        }
    }
    /// Returns the solution, if there is one.
    pub fn solution(&self) -> Option<&Solution<f64>> {
        self.report.as_ref().ok()?.solution.as_ref()
    }
    /// Returns the edge that the answer was computed from.
    pub fn chosen(&self) -> Option<&Edge> {
        let candidate = self.solution()?.candidate;
        self.edges.iter().find(|e| e.candidate == candidate)
    }
}

/// Observer that records the pixels that were read, in addition to the traces.
struct PixelTraces {
    traces: Traces,
    pixels: Option<RefCell<HashSet<(u16, u16)>>>,
}

impl Watch for PixelTraces {
    fn times(&self) -> Vec<Duration> {
        self.traces.times()
    }
}

impl<T: Real + Into<f64>> Observer<T> for PixelTraces {
    fn body(&self, index: u8) {
        Observer::<T>::body(&self.traces, index);
    }
    fn enter(&self, stage: Stage) {
        Observer::<T>::enter(&self.traces, stage);
    }
    fn leave(&self) {
        Observer::<T>::leave(&self.traces);
    }
    fn pixel(&self, x: u16, y: u16) {
        if let Some(pixels) = &self.pixels {
            pixels.borrow_mut().insert((x, y));
        }
    }
    fn level(&self, level: u16, mean: T, samples: u32) {
        Observer::<T>::level(&self.traces, level, mean, samples);
    }
    fn edge(&self, candidate: u32, border: impl Iterator<Item = Pixel>, stride: u32) {
        Observer::<T>::edge(&self.traces, candidate, border, stride);
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.traces.point(candidate, point);
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.traces.weight(candidate, point, weight);
    }
    fn verdict(&self, candidate: u32, outcome: &Candidate<T>, solution: Option<&Solution<T>>) {
        self.traces.verdict(candidate, outcome, solution);
    }
}

/// A picture before a sensor processes it.
#[derive(Debug, Clone, Copy)]
pub struct FrameInput<'a> {
    /// Index of the picture in the sequence.
    pub index: usize,
    /// Name of the picture.
    pub name: &'a str,
    /// Time in seconds, if it is known.
    pub time_s: Option<f64>,
    /// Data of the picture that are known.
    pub data: Option<&'a FrameData>,
    /// The picture.
    pub picture: &'a Picture,
}

impl FrameInput<'_> {
    /// Returns the processed picture, from the outcomes of its bodies.
    fn finish(&self, outcomes: Vec<BodyOutcome>) -> Finished {
        Finished {
            index: self.index as u64,
            name: self.name.to_owned(),
            time_s: self.time_s,
            data: self.data.cloned(),
            outcomes,
            drawing: hzn_mcap::Annotations::default(),
            picture: None,
            traces: None,
            tip: None,
            pages: 1,
        }
    }
}

/// Processes a picture and returns all facts to show. With `touched`, the result includes the pixels that were read.
pub fn process_frame(input: FrameInput<'_>, config: &Arc<Config>, sensor: &mut AnySensor, touched: bool) -> Outcome {
    let mut outcome = Outcome::new(config);
    let view = match checked_view(input.picture, config) {
        Ok(view) => view,
        Err(why) => {
            outcome.refused = Some(why);
            return outcome;
        }
    };
    let bodies = config.each_body();
    let watch = PixelTraces { traces: Traces::new(bodies.len()), pixels: touched.then(RefCell::default) };
    let watched = sensor.process_watched(&view, input.data, &watch);
    // A second run measures the time without the observer. It is left out if the sensor tracks the threshold, because
    // the threshold would then come from the first run.
    let plain = if config.tracks() { watched } else { sensor.process(&view, input.data, None) };
    let finished = input.finish(plain.into_iter().map(BodyOutcome::from).collect());
    let rows = sink::rows(&finished, config);
    let half_angles = sensor.expected_half_angles_rad(input.data);
    // The drawing takes the rotation rate into account, so every row is drawn where the sensor saw it.
    let camera = &sensor.camera().with_rate(input.data.and_then(|d| d.rate_rad_s));
    let each = bodies.iter().zip(finished.outcomes).zip(rows).zip(half_angles).zip(&watch.traces.each);
    for ((((body, found), row), expected), trace) in each {
        outcome.bodies.push(BodyResult::new(body.kind, found, row, expected.ok(), trace, camera));
    }
    if let Some(pixels) = watch.pixels {
        let pixels = pixels.into_inner();
        outcome.touched_pixels = Some(pixels.len());
        outcome.touched = Some(Arc::new(touched_image(&view, &pixels)));
    }
    outcome
}

/// Returns the picture for the sensor, or the reason why the sensor cannot process it.
fn checked_view<'a>(picture: &'a Picture, config: &Config) -> Result<ImageView<'a>, String> {
    let (w, h) = (picture.layout.width, picture.layout.height);
    let (own_w, own_h) = (u32::from(config.camera.width), u32::from(config.camera.height));
    if (w, h) != (own_w, own_h) {
        return Err(format!(
            "the picture is {w} x {h} px, the sensor's camera {own_w} x {own_h}: open the sensor.toml of this camera, \
             or set camera.width and height and scale focal lengths and centre with them"
        ));
    }
    picture.view(config.input.channel).map_err(|why| format!("{why} (input.channel)"))
}

fn touched_image(view: &ImageView<'_>, pixels: &HashSet<(u16, u16)>) -> ColorImage {
    use hzn_core::image::Pixels;
    let (w, h) = match view {
        ImageView::Grey8(p) => (p.width(), p.height()),
        ImageView::Grey16(p) => (p.width(), p.height()),
        ImageView::Colour8(p) => (p.width(), p.height()),
        ImageView::Colour16(p) => (p.width(), p.height()),
    };
    let mut image = ColorImage::filled([usize::from(w), usize::from(h)], Color32::TRANSPARENT);
    for &(x, y) in pixels {
        if let Some(pixel) = image.pixels.get_mut(usize::from(y) * usize::from(w) + usize::from(x)) {
            *pixel = Color32::WHITE;
        }
    }
    image
}

/// Returns two unit vectors perpendicular to the axis (camera frame): image x and y, turned with the optical axis onto
/// the limb axis by the shortest rotation.
fn tangent_basis([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    let q = 1.0 / (1.0 + z).max(1e-9);
    [[1.0 - x * x * q, -x * y * q, -x], [-x * y * q, 1.0 - y * y * q, -y]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the direction at `angle_rad` from the axis (camera frame). The azimuth counts from image x towards image y.
fn direction_at(axis: [f64; 3], angle_rad: f64, azimuth_rad: f64) -> Option<UnitVec3<hzn_core::frames::Cam, f64>> {
    let [b1, b2] = tangent_basis(axis);
    let ((s, c), (sa, ca)) = (angle_rad.sin_cos(), azimuth_rad.sin_cos());
    UnitVec3::try_new(std::array::from_fn(|i| c * axis[i] + s * (ca * b1[i] + sa * b2[i])))
}

fn ellipse(s: &Solution<f64>, camera: &Camera<f64>) -> Vec<Point> {
    const STEPS: usize = 72;
    let ([major, minor], angle) = explain::principal_sigmas(s);
    let point = |i: usize| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / STEPS as f64).sin_cos();
        let (a, b) = (3.0 * major * cos, 3.0 * minor * sin);
        let p = camera.project(&direction_at(s.axis.xyz(), a.hypot(b), b.atan2(a) + angle)?)?;
        Some([p.u, p.v])
    };
    (0..=STEPS).map(point).collect::<Option<_>>().unwrap_or_default()
}

fn residuals(s: &Solution<f64>, edge: &Edge, camera: &Camera<f64>) -> Vec<Residual> {
    let axis = s.axis.xyz();
    let [b1, b2] = tangent_basis(axis);
    let residual = |(at, weight): (&Point, &f64)| {
        let ray = camera.unproject(ImagePoint { u: at[0], v: at[1] })?.xyz();
        let (x, y) = (dot(ray, b1), dot(ray, b2));
        let azimuth = y.atan2(x);
        let limb = camera.project(&direction_at(axis, s.fused_half_angle_rad, azimuth)?)?;
        let outside = x.hypot(y).atan2(dot(ray, axis)) - s.fused_half_angle_rad;
        let distance = (at[0] - limb.u).hypot(at[1] - limb.v);
        Some(Residual {
            azimuth_deg: azimuth.to_degrees(),
            distance_px: distance.copysign(outside),
            weight: *weight,
            point: *at,
        })
    };
    edge.points.iter().zip(&edge.weights).filter_map(residual).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_rejected_point_is_found() {
        let at = |x: f64, weight: f64| Residual { azimuth_deg: 0.0, distance_px: x, weight, point: [x, 0.0] };
        let all = [at(1.0, 0.0), at(2.0, 1.0), at(3.0, 0.0)];
        let found = |x: f64| Residual::rejected_at(&all, [x, 0.0], 1.5).map(|r| r.distance_px);
        assert_eq!((found(2.2), found(0.0), found(9.0)), (Some(3.0), Some(1.0), None));
    }
}
