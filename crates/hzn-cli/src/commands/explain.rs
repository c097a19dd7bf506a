//! `hzn explain`: one frame, stage by stage.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use hzn_calib::FrameData;
use hzn_core::pipeline::Verdict;
use hzn_core::status::{Stage, Status};
use hzn_core::{Config, Report, Solution, body};
use hzn_mcap::Annotations;

use crate::engine::{AnySensor, Trace, Traces};
use crate::exit::{Exit, Outcome, usage};
use crate::input::Picture;
use crate::setup::{InputArgs, SensorArgs, need_altitude};
use crate::tell;
use crate::{output, overlay};

/// Show what happens to one frame: what was kept, what was dropped, and why
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A picture; or a folder, video or MCAP together with --index
    frame: PathBuf,
    /// Number of the frame in a sequence, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    index: u64,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    source: InputArgs,
    /// Draw what was found over the picture, as PNG
    #[arg(long, value_name = "PNG")]
    overlay: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Outcome {
    let mut source = args.source.open(std::slice::from_ref(&args.frame))?;
    let folder = source.folder();
    let sensor = args.sensor.load(&folder)?;
    let frames = args.source.frames(&folder, &sensor, args.sensor.flight)?;
    need_altitude(&sensor, frames.as_ref())?;
    let mut item = None;
    for n in 0..=args.index {
        item = source.next().transpose()?;
        if item.is_none() {
            return Err(usage(format!("--index {}: the sequence has {n} frames, numbered from 0", args.index)));
        }
    }
    let Some(item) = item else { return Err(usage("the sequence is empty")) };
    let config = &sensor.config;
    let data = frames.as_ref().and_then(|f| f.get(&item.name));
    let size = (u32::from(config.camera.width), u32::from(config.camera.height));
    let decoding = Instant::now();
    let picture = match item.payload.decode(Some(size)) {
        Ok((picture, _)) => picture,
        Err(why) => {
            tell::result(format_args!("{}: unreadable: {why}\n", item.name))?;
            return Ok(Exit::SomeUnreadable);
        }
    };
    let decoding = decoding.elapsed();
    let flight = args.sensor.flight;
    let mut sensor = AnySensor::new(config, flight).map_err(usage)?;
    let half_angles = sensor.expected_half_angles_rad(data);
    let view = picture.view(config.input.channel).map_err(|e| usage(format!("input.channel: {e}")))?;
    // Once to warm up: the first picture of a process pays for memory that is touched for the first time.
    sensor.process(&view, data, None);
    let times = sensor.process(&view, data, None);
    let traces = Traces::new(config.each_body().len());
    let mut drawing = Annotations::default();
    let mut statuses = Vec::new();
    let several = config.each_body().len() > 1;
    let processed = sensor.process(&view, data, Some(&traces)).into_iter().zip(times);
    for (which, ((processed, time), half_angle)) in processed.zip(half_angles).enumerate() {
        let (Some(body), Some(trace)) = (config.each_body().get(which), traces.each.get(which)) else { continue };
        let report = processed.report.map_err(usage)?;
        let told = Told {
            name: &item.name,
            config,
            body,
            data,
            picture: &picture,
            trace,
            report: &report,
            half_angle: half_angle.map_err(usage)?,
        };
        tell::result(format_args!("{}{}", if which > 0 { "\n" } else { "" }, told.text(decoding, time.elapsed)))?;
        drawing.add(output::annotations(trace, report.solution.as_ref(), sensor.camera()));
        let name = hzn_mcap::body_name(body.kind);
        statuses.push(if several { format!("{name} {}", report.status) } else { report.status.name().to_owned() });
    }
    if let Some(path) = &args.overlay {
        overlay::save(&overlay::draw_annotations(picture.to_rgb(), &drawing, &statuses.join(", ")), path)?;
        tell::line(format_args!("overlay: {}", path.display()));
    }
    Ok(Exit::Done)
}

/// Everything that is known about the frame.
struct Told<'a> {
    name: &'a str,
    config: &'a Config,
    body: &'a body::Config,
    data: Option<&'a FrameData>,
    picture: &'a Picture,
    trace: &'a Trace,
    report: &'a Report<f64>,
    half_angle: f64,
}

impl Told<'_> {
    fn text(&self, decoding: Duration, elapsed: Duration) -> String {
        let mut out = String::new();
        let mut line = |name: &str, value: String| {
            out.push_str(format!("{name:<11} {value}").trim_end());
            out.push('\n');
        };
        let l = self.picture.layout;
        let colours = if l.channels >= 3 {
            format!(", brightness: {:?}", self.config.input.channel).to_lowercase()
        } else {
            String::new()
        };
        line(
            "picture",
            format!(
                "{}: {} x {} px, {} channel(s) of {} bits{colours}",
                self.name, l.width, l.height, l.channels, l.bits
            ),
        );
        line("expected", self.expected());
        let r = self.report;
        let c = r.counters;
        let reached = |stage: Stage| r.stage >= stage;
        line("binarize", self.level());
        if reached(Stage::Contour) {
            let masks = self.config.mask.polygons_px.len();
            let masked = if masks > 0 { format!(", {masks} masked areas left out") } else { String::new() };
            line("contour", format!("{} border pixels followed{masked}", c.followed));
            let dropped = if c.dropped > 0 {
                format!("; {} border pixels dropped because a list was full", c.dropped)
            } else {
                String::new()
            };
            line(
                "candidates",
                format!("{} edges of at least {} px{dropped}", c.candidates, self.config.candidates.min_points),
            );
        }
        if !r.candidates.is_empty() {
            line("", "   #   length   points  inliers   rms px  verdict".into());
            for (i, k) in r.candidates.iter().enumerate() {
                let rms = if k.rms_px.is_finite() { format!("{:.3}", k.rms_px) } else { "-".into() };
                line(
                    "",
                    format!(
                        "{i:>4} {:>8} {:>8} {:>8} {rms:>8}  {}: {}",
                        k.length_px,
                        k.points,
                        k.inliers,
                        k.verdict.name(),
                        self.why(k.verdict)
                    ),
                );
            }
            let more = (c.candidates as usize).saturating_sub(r.candidates.len());
            if more > 0 {
                line("", format!("and {more} further ones that are not listed"));
            }
        }
        if c.fallback_points > 0 {
            line(
                "sub-pixel",
                format!(
                    "{} of {} points stand at the global level, because their local one was not found",
                    c.fallback_points, c.edge_points
                ),
            );
        }
        if reached(Stage::Reject) {
            line(
                "reject",
                format!(
                    "{} draws; points up to {} px from the limb can belong to it",
                    c.draws, self.config.reject.threshold_px
                ),
            );
        }
        line("work", format!("{} (limits.max_work bounds it)", c.work));
        line("status", r.status.name().to_owned());
        match &r.solution {
            Some(s) => self.answer(s, &mut line),
            None => advice(r, &mut line),
        }
        let us = |d: Duration| d.as_nanos() as f64 / 1e3;
        line(
            "time",
            format!(
                "{:.0} us in all, after {:.1} ms of decoding; by stage, while watched (which takes time too):",
                us(elapsed),
                decoding.as_secs_f64() * 1e3
            ),
        );
        for (stage, time) in self.trace.times() {
            if time > Duration::ZERO {
                line("", format!("{:<11} {:>9.1} us", stage.name(), us(time)));
            }
        }
        out
    }

    fn expected(&self) -> String {
        let body = self.body;
        let given = self.data.and_then(|d| d.altitude_km).or(body.altitude_km);
        let from = match self.data {
            Some(d) if d.position_km.is_some() => {
                let at = |p| hzn_calib::frames::altitude_at_km(p, body.kind, body.mean_radius_km());
                let km = d.position_km.and_then(at);
                let at = km.map(|km| format!(" at {km:.2} km")).unwrap_or_default();
                format!("position{at} from frames.csv")
            }
            Some(d) if d.altitude_km.is_some() => format!("altitude {} km from frames.csv", given.unwrap_or_default()),
            _ => given.map_or("no altitude needed".to_owned(), |km| format!("altitude {km} km")),
        };
        format!(
            "{}, cone of {:.4} deg half-angle ({from}, limb at {} +- {} km)",
            hzn_mcap::body_name(body.kind),
            self.half_angle.to_degrees(),
            body.limb_height_km,
            body.limb_height_sigma_km
        )
    }

    fn level(&self) -> String {
        let method = format!("{:?}", self.body.binarize.unwrap_or(self.config.binarize).method).to_lowercase();
        let full = (1u32 << self.picture.layout.bits) - 1;
        match (self.trace.level(), self.report.status) {
            (_, Status::TooDark | Status::TooBright) => {
                let g = &self.config.gate;
                format!("mean brightness is outside of {} to {} of full scale", g.min_mean, g.max_mean)
            }
            (Some((level, mean, n)), _) => {
                format!("level {level} of {full} ({method}), mean {mean:.1} over a sample of {n} pixels")
            }
            (None, _) => format!("level {} of {full} ({method})", self.report.level),
        }
    }

    fn answer(&self, s: &Solution<f64>, line: &mut impl FnMut(&str, String)) {
        let [x, y, z] = s.axis.xyz();
        line(
            "axis",
            format!(
                "{x:.7}, {y:.7}, {z:.7} in the camera (x right, y down, z forward): {:.4} deg off the optical axis",
                z.clamp(-1.0, 1.0).acos().to_degrees()
            ),
        );
        let (sigma, direction) = principal(s);
        line(
            "sigma",
            format!("{:.5} deg along {}, {:.5} deg across", sigma[0].to_degrees(), direction, sigma[1].to_degrees()),
        );
        if let Some(e) = s.axis_ecef {
            let [x, y, z] = e.xyz();
            line("axis, ECEF", format!("{x:.7}, {y:.7}, {z:.7} (the same direction, from the position)"));
        }
        if let Some(b) = s.axis_body {
            let [roll, pitch] = hzn_mcap::roll_pitch_deg(&b);
            line("attitude", format!("roll {roll:.4} deg, pitch {pitch:.4} deg"));
        }
        line("fit", format!("{} inliers over {:.0} px of edge, rms {:.3} px", s.inliers, s.arc_px, s.rms_px));
        line(
            "half-angle",
            format!(
                "{:.4} deg fitted freely, {:.4} deg after fusing (expected {:.4})",
                s.half_angle_rad.to_degrees(),
                s.fused_half_angle_rad.to_degrees(),
                self.half_angle.to_degrees()
            ),
        );
        if let Some((h, sigma)) = s.altitude_m {
            line("altitude", format!("{:.2} +- {:.2} km from the free fit", h / 1e3, sigma / 1e3));
        }
    }

    fn why(&self, verdict: Verdict) -> String {
        let s = &self.config.select;
        match verdict {
            Verdict::Chosen => "the answer".into(),
            Verdict::Passed => "passed every gate, but another fits better".into(),
            Verdict::NoConsensus => "no limb goes through enough of its points".into(),
            Verdict::FewInliers => format!("fewer than {} inliers (select.min_inliers)", s.min_inliers),
            Verdict::ShortArc => match s.min_arc_px {
                Some(px) => format!("inliers cover less than {px} px (select.min_arc_px)"),
                None => "inliers cover less than a tenth of the picture's diagonal (select.min_arc_px)".into(),
            },
            Verdict::Residuals => format!("rms above {} px (select.max_rms_px)", s.max_rms_px),
            Verdict::HalfAngle => format!(
                "half-angle more than {} sigma from the expected one (select.max_half_angle_sigma)",
                s.max_half_angle_sigma
            ),
            Verdict::Uncertain => format!("sigma above {} deg (select.max_sigma_deg)", s.max_sigma_deg),
            Verdict::NoFit => "the fit did not converge".into(),
            Verdict::Indistinct => {
                "many of its points lie close beside the fitted limb: a curve through clutter".into()
            }
            Verdict::NoSky => "what lies beyond the fitted limb is no sky (select.max_lit_sky)".into(),
            Verdict::Taken => "it is the limb of another body, found before".into(),
            Verdict::OutOfView => {
                "the limb that is expected about the fitted axis is not in the picture (select.limb_in_view)".into()
            }
            Verdict::Straight => "too short or too rough an edge to tell on which side of it the body is".into(),
            Verdict::Radius => "the limb is not that wide at any altitude allowed (select.altitude_limits_km)".into(),
            Verdict::Unsupported => "the fitted limb goes on where the picture shows none".into(),
        }
    }
}

/// Standard deviations along the two principal axes, and the direction of the larger one in the picture.
fn principal(s: &Solution<f64>) -> ([f64; 2], String) {
    let [x, y, z] = s.axis.xyz();
    // Image x and y carried to the axis the short way, as for the rays.
    let q = 1.0 / (1.0 + z).max(1e-9);
    let b1 = [1.0 - x * x * q, -x * y * q, -x];
    let b2 = [-x * y * q, 1.0 - y * y * q, -y];
    let rows = s.covariance.rows();
    let form =
        |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (0..3).map(|j| a[i] * rows[i][j] * b[j]).sum::<f64>()).sum::<f64>();
    let (p11, p12, p22) = (form(b1, b1), form(b1, b2), form(b2, b2));
    let half = (p11 + p22) / 2.0;
    let root = ((p11 - p22) / 2.0).hypot(p12);
    let angle = (2.0 * p12).atan2(p11 - p22) / 2.0;
    let direction = format!("{:.0} deg from image x towards y", angle.to_degrees());
    ([(half + root).max(0.0).sqrt(), (half - root).max(0.0).sqrt()], direction)
}

/// What to try when there is no answer.
fn advice(r: &Report<f64>, line: &mut impl FnMut(&str, String)) {
    let has = |v: Verdict| r.candidates.iter().any(|c| c.verdict == v);
    let mut tips: Vec<&str> = Vec::new();
    match r.status {
        Status::TooDark => tips.push("the picture is darker than gate.min_mean allows: lower it, or expose longer"),
        Status::TooBright => tips.push("the picture is brighter than gate.max_mean allows: raise it, or expose shorter"),
        Status::TooFewPoints => tips.push("edges were found, but all are short: lower candidates.min_points"),
        Status::Truncated => tips.push("the picture has more edges than it may cost to look at: raise limits.max_work, mask structure in view, or set a level above the clouds (binarize.method = \"fixed\")"),
        Status::Ambiguous => tips.push("two directions fit about equally well: mask structure in view (mask.polygons_px)"),
        _ => {}
    }
    if r.candidates.is_empty() && matches!(r.status, Status::NoLimb) {
        tips.push(
            "no edge is long enough: is the limb in view? try another level (binarize.scale, or method = \"fixed\")",
        );
    }
    if has(Verdict::NoConsensus) || has(Verdict::FewInliers) {
        tips.push("no candidate has the form of the expected limb: check altitude_km, the focal length and the lens model; a larger reject.threshold_px forgives a poor calibration");
    }
    if has(Verdict::HalfAngle) {
        tips.push("a limb was found, but larger or smaller than expected: check altitude and focal length, or raise body.limb_height_sigma_km");
    }
    if has(Verdict::Residuals) {
        tips.push("the edge does not follow the limb closely: check the calibration, or raise select.max_rms_px");
    }
    if has(Verdict::ShortArc) || has(Verdict::Uncertain) {
        tips.push("too little of the limb is in view for a good answer: lower select.min_arc_px or raise select.max_sigma_deg if a poor one will do");
    }
    if has(Verdict::Unsupported) {
        tips.push("an edge fits by chance (cloud, structure): mask what belongs to the vehicle, or try another level");
    }
    if tips.is_empty() {
        tips.push("look at the edges that were found: --overlay out.png");
    }
    for (i, tip) in tips.iter().enumerate() {
        line(if i == 0 { "try" } else { "" }, (*tip).to_owned());
    }
}
