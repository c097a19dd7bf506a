//! `hzn explain`: explains the processing of one picture, stage by stage.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hzn_core::camera::Camera;
use hzn_core::status::{Stage, Status};
use hzn_core::{Config, Report, Solution, body, threshold};
use hzn_files::FrameData;
use hzn_mcap::Annotations;
use hzn_run::diagnosis::{self, AnyCone};
use hzn_run::engine::{AnySensor, Trace, Traces, Unprocessed};
use hzn_run::open::Opened;
use hzn_run::source::{self, Item, Picture, Source};
use hzn_run::{engine, explain, overlay, sink};

use crate::exit::{Exit, Outcome, Stop, usage};
use crate::files;
use crate::setup::{self, InputArgs, SensorArgs};
use crate::tell::{self, one_line};

/// Show what happens to one picture: what is kept, what is dropped, and why
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A picture; or a folder, video or MCAP together with --index
    frame: PathBuf,
    /// Number of the picture in a sequence, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    index: u64,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    source: InputArgs,
    /// Draw the result over the picture, into this PNG
    #[arg(long, value_name = "PNG")]
    overlay: Option<PathBuf>,
    /// Replace the PNG if it exists
    #[arg(long, requires = "overlay")]
    force: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    if let Some(path) = &args.overlay {
        check_overlay(path)?;
    }
    let inputs = std::slice::from_ref(&args.frame);
    let opened = setup::open(inputs, &args.sensor, &args.source)?;
    opened.notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    opened.check_altitude()?;
    let Opened { mut source, sensor, frames, .. } = opened;
    if let Some(path) = &args.overlay {
        let request = setup::request(inputs, &args.sensor, &args.source)?;
        let read = files::of_sequence(source.as_ref(), &request);
        files::check_outputs(&read, std::slice::from_ref(path), args.force)?;
    }
    let mut item = item(source.as_mut(), args.index)?;
    let config = &sensor.config;
    let data = item.take_prior(frames.as_ref());
    let decoding = Instant::now();
    let picture = match item.payload.decode(Some(config)) {
        Ok((picture, _)) => picture,
        Err(why) => {
            tell::result(format_args!("{}\n", one_line(format_args!("{}: unreadable: {why}", item.name))))?;
            return Ok(Exit::SomeUnreadable);
        }
    };
    let decoding = decoding.elapsed();
    if picture.pages > 1 {
        let what = "pictures; only the first is explained";
        tell::line(format_args!("note: {} contains {} {what}", item.name, picture.pages));
    }
    let picture = PictureWithPrior { name: &item.name, config, data: data.as_ref(), picture: &picture };
    picture.explain(args, decoding)
}

/// Refuses an overlay that is not a PNG.
fn check_overlay(path: &Path) -> Result<(), Stop> {
    if source::ending(path) == "png" {
        return Ok(());
    }
    Err(usage(format!("{}: the overlay's ending must be .png", path.display())))
}

/// Returns picture number `index` of a sequence, counted from 0.
fn item(source: &mut dyn Source, index: u64) -> Result<Item, Stop> {
    let mut item = None;
    for n in 0..=index {
        item = source.next().transpose()?;
        if item.is_none() {
            return Err(usage(format!("--index {index}: the sequence has {n} pictures, numbered from 0")));
        }
    }
    item.ok_or_else(|| usage("the sequence is empty"))
}

/// A picture with its prior.
struct PictureWithPrior<'a> {
    name: &'a str,
    config: &'a Config,
    data: Option<&'a FrameData>,
    picture: &'a Picture,
}

impl PictureWithPrior<'_> {
    /// Processes the picture and explains each body; draws the overlay.
    fn explain(&self, args: &Args, decoding: Duration) -> Outcome {
        let Self { name: file, config, data, picture } = *self;
        let mut sensor = AnySensor::new(config, args.sensor.flight).map_err(usage)?;
        let half_angles = sensor.expected_half_angles_rad(data);
        let view = picture.view(config.input.channel).map_err(|e| usage(format!("input.channel: {e}")))?;
        // The first pass warms up: the first picture of a process also pays for the first access to its memory.
        sensor.process(&view, data, None);
        let times = sensor.process(&view, data, None);
        let traces = Traces::new(config.each_body().len());
        let mut drawing = Annotations::default();
        let mut statuses = Vec::new();
        let several = config.each_body().len() > 1;
        let processed = sensor.process(&view, data, Some(&traces)).into_iter().zip(times);
        let mut exit = Exit::Done;
        for (which, ((processed, time), half_angle)) in processed.zip(half_angles).enumerate() {
            let (Some(body), Some(trace)) = (config.each_body().get(which), traces.each.get(which)) else { continue };
            let between = if which > 0 { "\n" } else { "" };
            let name = body.kind.name();
            let (report, half_angle) = match (processed.report, half_angle) {
                (Ok(report), Ok(half_angle)) => (report, half_angle),
                (Err(why), _) | (_, Err(why)) => {
                    let Unprocessed { status, why, .. } = why.into();
                    let text = one_line(format_args!("{file}: {name}: {status}: {why}"));
                    tell::result(format_args!("{between}{text}\n"))?;
                    statuses.push(if several { format!("{name} {status}") } else { status.name().to_owned() });
                    exit = Exit::SomeUnreadable;
                    continue;
                }
            };
            let levels = config.threshold_of(which as u8);
            let fits = self.what_fits(&report, sensor.camera(), args.sensor.flight);
            let is_dark = report.solution.is_none() && self.is_answered_inverted(&mut sensor, which)?;
            let explained = Explained {
                name: file,
                config,
                body,
                levels,
                data,
                picture,
                trace,
                report: &report,
                half_angle,
                fits,
                is_dark,
            };
            tell::result(format_args!("{between}{}", explained.text(decoding, time.elapsed)))?;
            // The camera includes the rate of rotation, so that the drawing fits each row of a rolling shutter.
            let camera = sensor.camera().with_rate(data.and_then(|d| d.rate_rad_s));
            drawing.add(engine::annotate(trace, report.solution.as_ref(), &camera));
            let status = report.status;
            statuses.push(if several { format!("{name} {status}") } else { status.name().to_owned() });
        }
        if let Some(path) = &args.overlay {
            overlay::save(&overlay::draw_annotations(picture.to_rgb(), &drawing, &statuses.join(", ")), path)?;
            tell::line(format_args!("overlay: {}", path.display()));
        }
        Ok(exit)
    }

    /// Says what would fit a limb of another size than the expected one, if the picture has no answer but such a limb.
    fn what_fits(&self, report: &Report<f64>, camera: &Camera<f64>, flight: bool) -> Option<String> {
        let Self { config, data, picture, .. } = *self;
        if report.solution.is_some() {
            return None;
        }
        let view = picture.view(config.input.channel).ok()?;
        let mut trial = AnyCone::new(config, flight).ok()?;
        let fit = diagnosis::find_misfit(&mut trial, config, &view, data)?;
        Some(diagnosis::what_fits(&fit, camera, config.camera.width))
    }

    /// Returns whether the picture has an answer for a body if dark and bright are exchanged: the border of a dark hole
    /// then fits the limb.
    fn is_answered_inverted(&self, sensor: &mut AnySensor, which: usize) -> Result<bool, Stop> {
        if self.config.input.invert {
            return Ok(false);
        }
        let inverted = self.picture.clone().inverted();
        let view = inverted.view(self.config.input.channel).map_err(|e| usage(format!("input.channel: {e}")))?;
        let processed = sensor.process(&view, self.data, None);
        Ok(processed.get(which).is_some_and(|one| one.report.as_ref().is_ok_and(|report| report.solution.is_some())))
    }
}

/// Everything that is known about the picture and one body in it. The half-angle is in radians.
struct Explained<'a> {
    name: &'a str,
    config: &'a Config,
    body: &'a body::Config,
    levels: &'a threshold::Config,
    data: Option<&'a FrameData>,
    picture: &'a Picture,
    trace: &'a Trace,
    report: &'a Report<f64>,
    half_angle: f64,
    /// What would fit a limb of another size.
    fits: Option<String>,
    /// Whether the inverted picture has an answer.
    is_dark: bool,
}

impl Explained<'_> {
    fn text(&self, decoding: Duration, elapsed: Duration) -> String {
        let mut out = String::new();
        let mut line = |name: &str, value: String| {
            out.push_str(format!("{name:<11} {}", one_line(value)).trim_end());
            out.push('\n');
        };
        line("picture", self.layout());
        line("expected", self.expected());
        line("threshold", self.threshold());
        self.further_looks(&mut line);
        self.edges(&mut line);
        self.candidates(&mut line);
        self.points(&mut line);
        explain::evidence(self.trace, self.report, &self.config.gates).for_each(|(name, text)| line(name, text));
        line("work", format!("{} (limits.max_work bounds it)", self.report.counters.work));
        line("status", self.report.status.name().to_owned());
        match &self.report.solution {
            Some(s) => self.answer(s, &mut line),
            None => {
                self.fits.iter().for_each(|fits| line("fits", fits.clone()));
                self.advice(&mut line);
            }
        }
        self.times(decoding, elapsed, &mut line);
        out
    }

    fn layout(&self) -> String {
        let l = self.picture.layout;
        let colours = if l.channels >= 3 {
            format!(", brightness: {:?}", self.config.input.channel).to_lowercase()
        } else {
            String::new()
        };
        let channels = explain::counted(l.channels.into(), "channel");
        format!("{}: {} x {} px, {channels} of {} bits{colours}", self.name, l.width, l.height, l.bits)
    }

    /// Prints the further looks, and the width of a dark border that was left out.
    fn further_looks(&self, line: &mut impl FnMut(&str, String)) {
        let further = self.trace.further_thresholds();
        if !further.is_empty() {
            let levels: Vec<String> = further.iter().map(u16::to_string).collect();
            let looks = self.report.counters.looks;
            line(
                "looks",
                format!("{looks}: there was no answer at this threshold, so further looks used {}", levels.join(", ")),
            );
        }
        if self.trace.border_px() > 0 {
            line("border", format!("a dark border of {} px around the picture is left out", self.trace.border_px()));
        }
    }

    fn edges(&self, line: &mut impl FnMut(&str, String)) {
        if self.report.stage < Stage::Contour {
            return;
        }
        let c = self.report.counters;
        let masks = self.config.mask.polygons_px.len();
        let masked = if masks > 0 { format!(", {masks} masked areas left out") } else { String::new() };
        line("contour", format!("{} border pixels followed{masked}", c.followed));
        let dropped = match c.dropped {
            0 => String::new(),
            n => format!("; {n} border pixels dropped because a list was full"),
        };
        let shortest = self.config.edge_points.min_points;
        line("candidates", format!("{} edges of at least {shortest} px{dropped}", c.candidates));
    }

    /// Prints the table of candidates, with the verdict of each.
    fn candidates(&self, line: &mut impl FnMut(&str, String)) {
        let r = self.report;
        if r.candidates.is_empty() {
            return;
        }
        line("", "   #   length   points  inliers   rms px  verdict".into());
        for k in &r.candidates {
            let rms = if k.rms_px.is_finite() { format!("{:.3}", k.rms_px) } else { "-".into() };
            let numbers = format!("{:>4} {:>8} {:>8} {:>8} {rms:>8}", k.number, k.length_px, k.points, k.inliers);
            line(
                "",
                format!("{numbers}  {}: {}", k.verdict.name(), explain::verdict_text(k.verdict, &self.config.gates)),
            );
        }
        let more = (r.counters.candidates as usize).saturating_sub(r.candidates.len());
        if more > 0 {
            line("", format!("{more} further edges are not listed"));
        }
    }

    fn points(&self, line: &mut impl FnMut(&str, String)) {
        let c = self.report.counters;
        if c.fallback_points > 0 {
            let what = "points are at the global threshold, because no local mid-level was found";
            line("sub-pixel", format!("{} of {} {what}", c.fallback_points, c.edge_points));
        }
        if self.report.stage >= Stage::Consensus {
            let consensus = &self.config.consensus;
            let noisy = match consensus.noise_sigma {
                0.0 => String::new(),
                sigmas => format!(", and on a noisy edge up to {sigmas} times its noise"),
            };
            let px = consensus.threshold_px;
            line("consensus", format!("{} draws; points up to {px} px from the limb can belong to it{noisy}", c.draws));
        }
    }

    fn times(&self, decoding: Duration, elapsed: Duration, line: &mut impl FnMut(&str, String)) {
        let us = |d: Duration| d.as_nanos() as f64 / 1e3;
        let (all, ms) = (us(elapsed), decoding.as_secs_f64() * 1e3);
        let by_stage = "by stage, with an observer (which takes time too):";
        line("time", format!("{all:.0} us in all, after {ms:.1} ms of decoding; {by_stage}"));
        for (stage, time) in self.trace.times() {
            if time > Duration::ZERO {
                line("", format!("{:<11} {:>9.1} us", stage.name(), us(time)));
            }
        }
    }

    fn expected(&self) -> String {
        let cone = format!("{}, cone of {:.4} deg half-angle", self.body.kind.name(), self.half_angle.to_degrees());
        let Some(km) = sink::altitude_km(self.data, self.body) else {
            return format!("{cone}, as seen from near the Earth");
        };
        let from = match self.data {
            Some(d) if d.position_km.is_some() => format!("position at {km:.2} km given with the picture"),
            Some(d) if d.altitude_km.is_some() => format!("altitude {km} km given with the picture"),
            _ => format!("altitude {km} km"),
        };
        let limb = crate::limb_words::limb_in_words(self.body, &self.config.input, km);
        format!("{cone} ({from}, {limb})")
    }

    fn threshold(&self) -> String {
        let method = format!("{:?}", self.levels.method).to_lowercase();
        let full = (1u32 << self.picture.layout.bits) - 1;
        match (self.trace.level(), self.report.status) {
            (_, Status::TooDark | Status::TooBright) => {
                let g = &self.config.brightness;
                format!("mean brightness is outside of {} to {} of full scale", g.min_mean, g.max_mean)
            }
            (Some((level, mean, n)), _) => {
                format!("threshold {level} of {full} ({method}), mean {mean:.1} over a sample of {n} pixels")
            }
            (None, Status::NoLimb) if self.report.level == 0 => {
                let places = self.report.counters.sampled;
                format!("no bright pixel in the sample of {places}: no threshold ({method})")
            }
            (None, _) => format!("threshold {} of {full} ({method})", self.report.level),
        }
    }

    /// Returns the sources of error of the answer with their sigmas, in degrees. Each sigma is along the worst
    /// direction of its own term.
    fn budget(&self, candidate: u32) -> Vec<(&'static str, f64)> {
        let edges = self.trace.edges();
        let terms = edges.iter().find(|e| e.candidate == candidate).map_or(&[][..], |e| &e.budget_rad);
        terms
            .iter()
            .filter(|(_, rad)| *rad > 0.0)
            .map(|(term, rad)| (explain::term_text(*term), rad.to_degrees()))
            .collect()
    }

    /// Returns how the rolling shutter was treated; `None` without a rolling shutter.
    fn shutter(&self) -> Option<String> {
        let readout_s = self.config.camera.readout_s;
        let rate = self.data.and_then(|d| d.rate_rad_s);
        let drift = |rate: [f64; 3]| rate.map(|r| (r * readout_s).to_degrees());
        (readout_s != 0.0).then(|| match rate.map(drift) {
            Some([x, y, z]) => {
                format!("the rows are corrected by the rate: {x:.3}, {y:.3}, {z:.3} deg from the first to the last")
            }
            None => "no rate of rotation is known: the rows are not corrected, and sigma does not include this error"
                .to_owned(),
        })
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
        let (sigma, angle_rad) = explain::principal_sigmas(s);
        let ([along, across], angle_deg) = (sigma.map(f64::to_degrees), angle_rad.to_degrees());
        let from_x = format!("{angle_deg:.0} deg from image x towards y");
        line("sigma", format!("{along:.5} deg along {from_x}, {across:.5} deg across"));
        for (name, sigma) in self.budget(s.candidate) {
            line("", format!("{sigma:.5} deg from {name}"));
        }
        if s.p_limb.is_some() && self.body.is_seen_in_sunlight() {
            let noise = self.body.covariance.as_ref().unwrap_or(&self.config.covariance);
            let (level_deg, probability) = (along * noise.protection_factor(), noise.protection_probability);
            line("protection", format!("the error exceeds {level_deg:.5} deg with probability {probability}"));
        }
        if let Some(what) = self.shutter() {
            line("shutter", what);
        }
        if let Some(e) = s.axis_fixed {
            let [x, y, z] = e.xyz();
            line("axis, ECEF", format!("{x:.7}, {y:.7}, {z:.7} (the same direction, from the position)"));
        }
        if let Some(b) = s.axis_vehicle {
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

    /// Prints advice for a picture without an answer.
    fn advice(&self, line: &mut impl FnMut(&str, String)) {
        let dark = "the border of a dark hole fits the limb: if the body is darker than the sky, as in an infrared \
                    picture with white cold or before a corona, set invert = true in [input] of sensor.toml";
        let mut tips: Vec<String> = self.is_dark.then(|| dark.to_owned()).into_iter().collect();
        tips.extend(explain::tips(self.report).into_iter().map(Cow::into_owned));
        tips.extend(self.picture.unused_bits());
        if tips.is_empty() {
            tips.push("look at the edges that were found, with --overlay out.png".to_owned());
        }
        for (i, tip) in tips.into_iter().enumerate() {
            line(if i == 0 { "try" } else { "" }, tip);
        }
    }
}
