//! Everything that is known about one frame: what the window draws and says.

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
use hzn_run::engine::{AnySensor, BodyOutcome, Finished, Traces, Watch};
use hzn_run::source::Picture;
use hzn_run::{explain, overlay, sink};

use super::paint::Recipe;
use crate::model::view::Point;

/// One frame as the parameters make it.
#[derive(Debug, Clone)]
pub struct FrameView {
    /// Its place in the sequence.
    pub index: usize,
    /// Name of its picture.
    pub name: String,
    /// Time in seconds, where it is known.
    pub time_s: Option<f64>,
    /// What was known about it.
    pub data: Option<FrameData>,
    /// The picture, or why there is none.
    pub picture: Result<Arc<Picture>, String>,
    /// The picture as it is shown; the same `Arc` as before when it has not changed.
    pub image: Option<Arc<Shown>>,
    /// The lens, when there is a sensor.
    pub camera: Option<Arc<Camera<f64>>>,
    /// What was made of it: by the session, and by what it is compared with.
    pub answers: Vec<Arc<Outcome>>,
    /// Which version of the session this is.
    pub changes: u64,
    /// Time to read and decode, when it was not at hand.
    pub decoding: Option<Duration>,
    /// From the wish to the answer.
    pub latency: Duration,
}

/// A picture on its way to the screen.
#[derive(Debug)]
pub struct Shown {
    /// Which frame, and how it is shown.
    pub of: (usize, Recipe),
    /// The pixels.
    pub image: Arc<ColorImage>,
}

/// What one configuration made of a frame.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The configuration.
    pub config: Arc<Config>,
    /// Each body, in order.
    pub bodies: Vec<BodyResult>,
    /// Why nothing was made of it: the picture has another size, or the like.
    pub refused: Option<String>,
    /// Pixels that were read, white in a transparent picture; only when it was asked for.
    pub touched: Option<Arc<ColorImage>>,
    /// Number of different pixels that were read.
    pub touched_pixels: Option<usize>,
}

/// What was made of one body.
#[derive(Debug, Clone)]
pub struct BodyResult {
    /// Which body.
    pub kind: body::Kind,
    /// The result as files hold it.
    pub row: Row,
    /// The report, or why there is none.
    pub report: Result<Report<f64>, String>,
    /// Candidate edges, in the order in which they were followed.
    pub edges: Vec<Edge>,
    /// Mean and number of pixels of the sample that gave the level.
    pub sample: Option<(f64, u32)>,
    /// Time of each stage while watched.
    pub times: Vec<(Stage, Duration)>,
    /// Time without being watched.
    pub elapsed: Duration,
    /// Half-angle that was expected, radians; or why nothing could be.
    pub expected_rad: Option<f64>,
    /// The fitted limb, in lines that end where the picture does.
    pub limb: Vec<Vec<Point>>,
    /// Where the axis meets the picture.
    pub axis: Option<Point>,
    /// Outline of the axis's 3-sigma ellipse in the picture.
    pub ellipse: Vec<Point>,
    /// Distance of the chosen edge's points from the fitted limb.
    pub residuals: Vec<Residual>,
}

/// One edge point beside the fitted limb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Angle about the axis in degrees, -180 to 180, from image x towards image y.
    pub azimuth_deg: f64,
    /// Distance in pixels, positive outside of the fitted limb.
    pub distance_px: f64,
    /// Weight in the fit, 0 to 1.
    pub weight: f64,
    /// The point.
    pub at: Point,
}

impl Residual {
    /// The rejected one that is nearest to a point of the picture, within `reach_px`.
    pub fn rejected_at(all: &[Self], p: Point, reach_px: f64) -> Option<&Self> {
        let apart = |r: &&Self| (r.at[0] - p[0]).hypot(r.at[1] - p[1]);
        let rejected = all.iter().filter(|r| r.weight <= 0.0 && apart(r) <= reach_px);
        rejected.min_by(|a, b| apart(a).total_cmp(&apart(b)))
    }
}

impl BodyResult {
    /// The solution, when there is one.
    pub fn solution(&self) -> Option<&Solution<f64>> {
        self.report.as_ref().ok()?.solution.as_ref()
    }
    /// The edge that gave the answer.
    pub fn chosen(&self) -> Option<&Edge> {
        let candidate = self.solution()?.candidate;
        self.edges.iter().find(|e| e.candidate == candidate)
    }
}

/// Pixels that were read, beside everything else that is watched.
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
    fn body(&self, which: u8) {
        Observer::<T>::body(&self.traces, which);
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

/// A frame before a sensor looks at it.
#[derive(Debug, Clone, Copy)]
pub struct FrameInput<'a> {
    /// Place in the sequence.
    pub index: usize,
    /// Name of the picture.
    pub name: &'a str,
    /// Time in seconds, where it is known.
    pub time_s: Option<f64>,
    /// What is known about it.
    pub data: Option<&'a FrameData>,
    /// The picture.
    pub picture: &'a Picture,
}

/// Processes a frame and gathers what there is to see. With `touched`, the pixels that were read too.
pub fn look(subject: FrameInput<'_>, config: &Arc<Config>, sensor: &mut AnySensor, touched: bool) -> Outcome {
    let FrameInput { index, name, time_s, data, picture } = subject;
    let mut outcome =
        Outcome { config: Arc::clone(config), bodies: Vec::new(), refused: None, touched: None, touched_pixels: None };
    let (w, h) = (picture.layout.width, picture.layout.height);
    let (own_w, own_h) = (u32::from(config.camera.width), u32::from(config.camera.height));
    if (w, h) != (own_w, own_h) {
        outcome.refused = Some(format!(
            "the picture is {w} x {h} px, the sensor's camera {own_w} x {own_h}: open the sensor.toml of this camera, \
             or set camera.width and height and scale focal lengths and centre with them"
        ));
        return outcome;
    }
    let view = match picture.view(config.input.channel) {
        Ok(view) => view,
        Err(why) => {
            outcome.refused = Some(format!("{why} (input.channel)"));
            return outcome;
        }
    };
    let bodies = config.each_body();
    let watch = PixelTraces { traces: Traces::new(bodies.len()), pixels: touched.then(RefCell::default) };
    let watched = sensor.process_watched(&view, data, &watch);
    // Again for the time alone; but not where the level would come from the first look.
    let plain = if config.tracks() { watched } else { sensor.process(&view, data, None) };
    let finished = Finished {
        index: index as u64,
        name: name.to_owned(),
        time_s,
        data: data.cloned(),
        outcomes: plain.into_iter().map(BodyOutcome::from).collect(),
        drawing: hzn_mcap::Annotations::default(),
        picture: None,
        traces: None,
        tip: None,
        pages: 1,
    };
    let rows = sink::rows(&finished, config);
    let half_angles = sensor.expected_half_angles_rad(data);
    // Drawn where each row sees it.
    let camera = &sensor.camera().turning(data.and_then(|d| d.rate_rad_s));
    let each = bodies.iter().zip(finished.outcomes).zip(rows).zip(half_angles).zip(&watch.traces.each);
    for ((((body, found), row), expected), trace) in each {
        let solution = found.report.as_ref().ok().and_then(|r| r.solution.as_ref()).copied();
        let edges = trace.edges().clone();
        let chosen = solution.and_then(|s| edges.iter().find(|e| e.candidate == s.candidate));
        outcome.bodies.push(BodyResult {
            kind: body.kind,
            row,
            sample: trace.level().map(|(_, mean, n)| (mean, n)),
            times: trace.times().to_vec(),
            elapsed: found.elapsed,
            expected_rad: expected.ok(),
            limb: solution
                .map(|s| overlay::draw_cone(&s.axis, s.fused_half_angle_rad, camera).limb)
                .unwrap_or_default(),
            axis: solution.and_then(|s| camera.project(&s.axis)).map(|p| [p.u, p.v]),
            ellipse: solution.map(|s| ellipse(&s, camera)).unwrap_or_default(),
            residuals: solution.zip(chosen).map(|(s, edge)| residuals(&s, edge, camera)).unwrap_or_default(),
            report: found.report.map_err(|e| e.why),
            edges,
        });
    }
    if let Some(pixels) = watch.pixels {
        let pixels = pixels.into_inner();
        outcome.touched_pixels = Some(pixels.len());
        outcome.touched = Some(Arc::new(touched_image(&view, &pixels)));
    }
    outcome
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

/// Image x and y carried to the axis the short way: two unit vectors across it.
fn across([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    let q = 1.0 / (1.0 + z).max(1e-9);
    [[1.0 - x * x * q, -x * y * q, -x], [-x * y * q, 1.0 - y * y * q, -y]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A direction `angle_rad` from the axis, at an azimuth from image x towards image y.
fn beside(axis: [f64; 3], angle_rad: f64, azimuth_rad: f64) -> Option<UnitVec3<hzn_core::frames::Cam, f64>> {
    let [b1, b2] = across(axis);
    let ((s, c), (sa, ca)) = (angle_rad.sin_cos(), azimuth_rad.sin_cos());
    UnitVec3::try_new(std::array::from_fn(|i| c * axis[i] + s * (ca * b1[i] + sa * b2[i])))
}

fn ellipse(s: &Solution<f64>, camera: &Camera<f64>) -> Vec<Point> {
    const STEPS: usize = 72;
    let ([major, minor], angle) = explain::principal_sigmas(s);
    let point = |i: usize| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / STEPS as f64).sin_cos();
        let (a, b) = (3.0 * major * cos, 3.0 * minor * sin);
        let p = camera.project(&beside(s.axis.xyz(), a.hypot(b), b.atan2(a) + angle)?)?;
        Some([p.u, p.v])
    };
    (0..=STEPS).map(point).collect::<Option<_>>().unwrap_or_default()
}

fn residuals(s: &Solution<f64>, edge: &Edge, camera: &Camera<f64>) -> Vec<Residual> {
    let axis = s.axis.xyz();
    let [b1, b2] = across(axis);
    let residual = |(at, weight): (&Point, &f64)| {
        let ray = camera.unproject(ImagePoint { u: at[0], v: at[1] })?.xyz();
        let (x, y) = (dot(ray, b1), dot(ray, b2));
        let azimuth = y.atan2(x);
        let limb = camera.project(&beside(axis, s.fused_half_angle_rad, azimuth)?)?;
        let outside = x.hypot(y).atan2(dot(ray, axis)) - s.fused_half_angle_rad;
        let distance = (at[0] - limb.u).hypot(at[1] - limb.v);
        Some(Residual {
            azimuth_deg: azimuth.to_degrees(),
            distance_px: distance.copysign(outside),
            weight: *weight,
            at: *at,
        })
    };
    edge.points.iter().zip(&edge.weights).filter_map(residual).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_rejected_point_is_found() {
        let at = |x: f64, weight: f64| Residual { azimuth_deg: 0.0, distance_px: x, weight, at: [x, 0.0] };
        let all = [at(1.0, 0.0), at(2.0, 1.0), at(3.0, 0.0)];
        let found = |x: f64| Residual::rejected_at(&all, [x, 0.0], 1.5).map(|r| r.distance_px);
        assert_eq!((found(2.2), found(0.0), found(9.0)), (Some(3.0), Some(1.0), None));
    }
}
