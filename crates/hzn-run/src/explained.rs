//! The processing of one picture in words, stage by stage.

use std::borrow::Cow;
use std::time::Duration;

use hzn_core::status::{Stage, Status};
use hzn_core::{Config, Report, Solution, body, threshold};
use hzn_files::FrameData;
use hzn_mcap::roll_pitch_deg;

use crate::advice::{self, Subject};
use crate::diagnosis::{self, AnyCone};
use crate::engine::{AnySensor, ExpectedLimb, Trace};
use crate::error::{Error, unusable};
use crate::explain;
use crate::limb_words::limb_in_words;
use crate::record::altitude_km;
use crate::source::Picture;
use crate::terminal::one_line;

/// A picture that is explained, with its prior.
#[derive(Debug, Clone, Copy)]
pub struct PictureToExplain<'a> {
    /// Name of the picture.
    pub name: &'a str,
    /// The sensor.
    pub config: &'a Config,
    /// The prior of the picture.
    pub data: Option<&'a FrameData>,
    /// The picture.
    pub picture: &'a Picture,
    /// Whether the sensor is that of the flight computer.
    pub flight: bool,
}

/// What the sensor did for one body in the picture.
#[derive(Debug, Clone, Copy)]
pub struct Work<'a> {
    /// Place of the body in the sensor, from 0.
    pub which: usize,
    /// The record of the work.
    pub trace: &'a Trace,
    /// The report.
    pub report: &'a Report<f64>,
    /// The half-angle that was expected, in radians.
    pub half_angle_rad: f64,
    /// Times of decoding and of processing without an observer; `None` if there was no clock.
    pub times: Option<[Duration; 2]>,
}

impl PictureToExplain<'_> {
    /// Explains what the sensor did for one body; `None` if the sensor has no such body. If there is no answer, the
    /// picture is processed again in other ways, to say what would give one.
    ///
    /// # Errors
    /// The picture does not have the channel that the sensor uses.
    pub fn explain(&self, sensor: &mut AnySensor, work: &Work<'_>) -> Result<Option<String>, Error> {
        let Self { name, config, data, picture, .. } = *self;
        let Work { which, trace, report, half_angle_rad: half_angle, times } = *work;
        let Some(body) = config.each_body().get(which) else { return Ok(None) };
        let levels = config.threshold_of(which as u8);
        let fits = self.what_fits(report, sensor);
        let is_dark = report.solution.is_none() && self.is_answered_inverted(sensor, which)?;
        let limb = sensor.expected_limbs(data).into_iter().nth(which).and_then(Result::ok);
        let explained =
            Explained { name, config, body, levels, data, picture, trace, report, half_angle, limb, fits, is_dark };
        Ok(Some(explained.text(times)))
    }

    /// Says what would fit a limb of another size than the expected one, if the picture has no answer but such a limb.
    fn what_fits(&self, report: &Report<f64>, sensor: &AnySensor) -> Option<String> {
        let Self { config, data, picture, flight, .. } = *self;
        if report.solution.is_some() {
            return None;
        }
        let view = picture.view(config.input.channel).ok()?;
        let mut trial = AnyCone::new(config, flight).ok()?;
        let fit = diagnosis::find_misfit(&mut trial, config, &view, data)?;
        Some(diagnosis::what_fits(&fit, sensor.camera(), config.camera.width))
    }

    /// Returns whether the picture has an answer for a body if dark and bright are exchanged: the border of a dark hole
    /// then fits the limb.
    fn is_answered_inverted(&self, sensor: &mut AnySensor, which: usize) -> Result<bool, Error> {
        if self.config.input.invert {
            return Ok(false);
        }
        let inverted = self.picture.clone().inverted();
        let view = inverted.view(self.config.input.channel).map_err(|e| unusable(format!("input.channel: {e}")))?;
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
    /// The limb that was expected.
    limb: Option<ExpectedLimb>,
    /// What would fit a limb of another size.
    fits: Option<String>,
    /// Whether the inverted picture has an answer.
    is_dark: bool,
}

impl Explained<'_> {
    fn text(&self, times: Option<[Duration; 2]>) -> String {
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
        if let Some([decoding, elapsed]) = times {
            self.times(decoding, elapsed, &mut line);
        }
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
        let kind = self.body.kind;
        line("", "   #   length   points  inliers   rms px  verdict".into());
        for k in &r.candidates {
            let rms = if k.rms_px.is_finite() { format!("{:.3}", k.rms_px) } else { "-".into() };
            let numbers = format!("{:>4} {:>8} {:>8} {:>8} {rms:>8}", k.number, k.length_px, k.points, k.inliers);
            line(
                "",
                format!(
                    "{numbers}  {}: {}",
                    k.verdict.name(),
                    explain::verdict_text(k.verdict, &self.config.gates, kind)
                ),
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
        let answer = self.report.solution.as_ref().map(|solution| solution.candidate);
        if let Some(edge) = self.trace.edges().iter().find(|e| Some(e.candidate) == answer && e.clipped > 0.0) {
            let percent = (100.0 * edge.clipped).ceil();
            line(
                "clipped",
                format!("{percent} % of the limb is next to light at full scale, and appears higher there"),
            );
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
        line("time", format!("{all:.0} us, after {ms:.1} ms of decoding"));
        let times = self.trace.times();
        let observed = us(times.iter().map(|(_, time)| *time).sum());
        line("", format!("a second run, in which hzn notes what it sees, takes {observed:.0} us:"));
        for (stage, time) in times {
            if time > Duration::ZERO {
                line("", format!("{:<11} {:>9.1} us", stage.name(), us(time)));
            }
        }
    }

    fn expected(&self) -> String {
        let cone = format!("{}, cone of {:.4} deg half-angle", self.body.kind.name(), self.half_angle.to_degrees());
        let limits_km = self.config.gates.altitude_limits_km.filter(|_| !self.body.half_angle_is_free());
        let Some(km) = altitude_km(self.data, self.body) else {
            return match limits_km {
                Some([low, high]) => {
                    format!(
                        "{cone} (no altitude is known: searched from {low} to {high} km, [gates] altitude_limits_km)"
                    )
                }
                None => format!("{cone}, as seen from near the Earth"),
            };
        };
        let from = match self.data {
            Some(d) if d.position_km.is_some() => format!("position at {km:.2} km given with the picture"),
            Some(d) if d.altitude_km.is_some() => format!("altitude {km} km given with the picture"),
            _ => format!("altitude {km} km"),
        };
        let limb = limb_in_words(self.body, &self.config.input, self.limb, km);
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
            let [roll, pitch] = roll_pitch_deg(&b);
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
        let subject = Subject::new(self.body, Some(self.half_angle));
        tips.extend(advice::tips(self.report, subject).into_iter().map(Cow::into_owned));
        tips.extend(self.picture.doubt_samples());
        if tips.is_empty() {
            tips.push("look at the edges that were found, with --overlay out.png".to_owned());
        }
        for (i, tip) in tips.into_iter().enumerate() {
            line(if i == 0 { "try" } else { "" }, tip);
        }
    }
}
