//! What would make refused pictures answers: the sentences for the end of a run.

use hzn_calib::noise;
use hzn_calib::sky::{self, LimbPrior, View};
use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::image::region::Region;
use hzn_core::{Config, Prior, Solution};
use hzn_evaluate::{Sighting, find_attitude_convention};
use hzn_files::FrameData;
use hzn_run::bars::find_bars;
use hzn_run::diagnosis::{self, AnyCone, FitFacts, RateFault, RateTrial, Said};
use hzn_run::engine::AnySensor;
use hzn_run::engine::trace::Traces;
use hzn_run::open::{Request, open};
use hzn_run::record;
use hzn_run::source::Picture;

use crate::doubts::{Answer, Rates};

/// What refused pictures say about the size of the limb.
pub(crate) struct WhatFits {
    /// What would fit them, in words.
    pub(crate) text: String,
    /// Number of pictures with a limb of another size than expected.
    pub(crate) pictures: usize,
}

/// What a second look at refused pictures found.
#[derive(Default)]
pub(crate) struct Again {
    /// The bars that no mask covers, in words.
    pub(crate) bars: Option<String>,
    pub(crate) fits: Option<WhatFits>,
}

/// Fewest pictures that can show two wrong values ([`diagnosis::find_pair`]); a look at fewer is in vain.
const FEWEST_FOR_TWO: usize = 8;
/// 1-sigma of an attitude whose cell is empty, degrees.
const ATTITUDE_SIGMA_DEG: f64 = 5.0;

/// Some pictures of a sequence, to look at again.
pub(crate) struct ReadAgain {
    each: Vec<Look>,
}

/// A picture with its number, its name and its data.
struct Look {
    index: u64,
    name: String,
    picture: Picture,
    data: Option<FrameData>,
    time_s: Option<f64>,
}

impl ReadAgain {
    /// Reads the pictures with these numbers.
    pub(crate) fn read(request: &Request, config: &Config, indices: &[u64]) -> Option<Self> {
        // A sentence at the end of a run must not make the run fail, so that an error here only leaves it out.
        let last = *indices.iter().max()?;
        let mut opened = open(request).ok()?;
        let mut each = Vec::new();
        for index in 0..=last {
            let mut item = opened.source.next()?.ok()?;
            if !indices.contains(&index) {
                continue;
            }
            let data = item.take_prior(opened.frames.as_ref());
            let time_s = data.as_ref().and_then(|data| data.time_s);
            if let Ok((picture, _)) = item.payload.decode(Some(config)) {
                each.push(Look { index, name: item.name, picture, data, time_s });
            }
        }
        Some(Self { each })
    }

    /// Says what is wrong with the rates of pictures that a rolling shutter took; `None` if nothing is.
    pub(crate) fn rate_fault(&self, request: &Request, config: &Config) -> Option<String> {
        let mut trial = RateTrial::new(config, request.flight).ok()?;
        let mut gains = Vec::new();
        for Look { picture, data, .. } in &self.each {
            let (Ok(view), Some(data)) = (picture.view(config.input.channel), data) else { continue };
            gains.extend(trial.compare(&view, data));
        }
        let (fault, better) = diagnosis::find_rate_fault(&gains)?;
        let cause = match fault {
            RateFault::TooLarge => {
                "rates that are 57 times smaller. Are they in degrees per second? rate_x, rate_y, rate_z are rad/s. \
                 Large rates about other axes, or of other times, look alike"
            }
            RateFault::Negated => {
                "the opposite rates. Do they or camera.readout_s have the wrong sign? rate_x, rate_y, rate_z are the \
                 rotation of the camera, in its own axes"
            }
        };
        Some(format!("{better} of {} pictures that were processed again fit better with {cause}", gains.len()))
    }

    /// Returns the answer to each picture without its attitude, for the first body.
    fn answers(&self, request: &Request, config: &Config) -> Vec<(&Look, &FrameData, Solution<f64>)> {
        let Ok(mut sensor) = AnySensor::new(config, request.flight) else { return Vec::new() };
        let bodies = config.each_body().len();
        let mut all = Vec::new();
        for look in &self.each {
            let (Ok(view), Some(data)) = (look.picture.view(config.input.channel), &look.data) else { continue };
            // An answer that was refused says nothing about the next one.
            sensor.remember(&vec![None; bodies]);
            let free = FrameData { q_fixed_from_camera_wxyz: None, ..data.clone() };
            let processed = sensor.process(&view, Some(&free), None);
            let report = processed.into_iter().next().and_then(|first| first.report.ok());
            all.extend(report.and_then(|report| report.solution).map(|solution| (look, data, solution)));
        }
        all
    }

    /// Says in which convention the attitudes or positions of the pictures are that contradict their limbs; `None` if
    /// nothing simple explains it.
    pub(crate) fn attitude_convention(&self, request: &Request, config: &Config) -> Option<String> {
        let sighting = |(look, data, solution): &(&Look, &FrameData, Solution<f64>)| {
            let told_deg = data.attitude_sigma_deg.unwrap_or(ATTITUDE_SIGMA_DEG);
            Some(Sighting {
                axis: solution.axis.xyz(),
                sigma_rad: solution.covariance.sigma_max_rad().hypot(told_deg.to_radians()),
                time_s: look.time_s.unwrap_or(0.0),
                q_fixed_from_camera_wxyz: data.q_fixed_from_camera_wxyz?,
                position_km: data.position_km?,
            })
        };
        let all: Vec<Sighting> = self.answers(request, config).iter().filter_map(sighting).collect();
        let mount = config.mount.map(|mount| mount.q_vehicle_from_camera_wxyz);
        let is_earth = config.each_body().first()?.kind == Kind::Earth;
        find_attitude_convention(&all, mount, is_earth)
    }

    /// Says what is wrong with the rates of pictures that were refused because their edge does not move as the rates
    /// say; `None` if nothing is.
    pub(crate) fn turn_fault(&self, request: &Request, config: &Config) -> Option<String> {
        let answer = |(look, data, solution): &(&Look, &FrameData, Solution<f64>)| {
            let (time_s, rate_rad_s) = (look.time_s?, data.rate_rad_s?.into());
            let (axis, noise_rad) = (solution.axis.xyz().into(), solution.noise_rad());
            Some((look.index, Answer { time_s, rate_rad_s, axis, noise_rad }))
        };
        let all: Vec<(u64, Answer)> = self.answers(request, config).iter().filter_map(answer).collect();
        let mut rates = Rates::default();
        for pair in all.windows(2) {
            let [(before, a), (after, b)] = pair else { continue };
            if before + 1 == *after {
                rates.add(a, b);
            }
        }
        rates.contradiction(config.mount.map(|mount| mount.q_vehicle_from_camera_wxyz))
    }

    /// Says which altitude or lens the half-angles of all answers together show; `None` if they agree with those told.
    pub(crate) fn contradiction(&self, request: &Request, config: &Config) -> Option<String> {
        let mut sensor = AnySensor::new(config, request.flight).ok()?;
        let camera = Camera::try_new(&config.camera).ok()?;
        let bodies = config.each_body();
        let (mut said, mut altitudes_km) = (Vec::new(), Vec::new());
        for Look { picture, data, .. } in &self.each {
            let Ok(view) = picture.view(config.input.channel) else { continue };
            let traces = Traces::new(bodies.len());
            let processed = sensor.process(&view, data.as_ref(), Some(&traces));
            let report = processed.first().and_then(|processed| processed.report.as_ref().ok());
            let Some((report, trace)) = report.zip(traces.each.first()) else { continue };
            said.extend(Said::of(report, &trace.edges(), &config.camera, data.as_ref()));
            altitudes_km.extend(record::altitude_km(data.as_ref(), bodies.first()?));
        }
        altitudes_km.sort_by(f64::total_cmp);
        let altitude_km = altitudes_km.get(altitudes_km.len() / 2).copied();
        let found = diagnosis::contradictions(&said);
        let what = diagnosis::contradiction(&found, altitude_km, &camera, config.camera.width)?;
        Some(format!("each of {} answers agrees with the limb that is expected, but {what}", said.len()))
    }

    /// Says where the limb in different places of the pictures shows the principal point, if that is not where it was
    /// told to be. It is the test of `hzn calibrate check`, at the same limit.
    pub(crate) fn centre_fault(&self, request: &Request, config: &Config) -> Option<String> {
        let limb = LimbPrior::of_sensor(config, false)?;
        // Answers must not be refused because of an error of the lens that is to be found.
        let mut used = noise::config_for_calibration(config)?;
        used.camera.covariance = None;
        used.camera.focal_sigma_percent = config.camera.focal_sigma_percent.max(10.0 * sky::DEFAULT_DETECT_PERCENT);
        let mut sensor = AnySensor::new(&used, request.flight).ok()?;
        let view = |Look { name, picture, data, .. }: &Look| {
            let traces = Traces::new(1);
            let view = picture.view(config.input.channel).ok()?;
            let processed = sensor.process(&view, data.as_ref(), Some(&traces));
            let solution = processed.first()?.report.as_ref().ok()?.solution.as_ref()?;
            let edges = traces.each.first()?.edges();
            let edge = edges.iter().find(|edge| edge.candidate == solution.candidate)?;
            let points = edge.points.iter().copied().zip(edge.weights.iter().copied()).collect();
            let prior = data.as_ref().map_or_else(Prior::default, |data| data.to_prior(None));
            Some(View::new(name, points, prior, solution))
        };
        let views: Vec<View> = self.each.iter().filter_map(view).collect();
        let check = sky::check(&config.camera, &used.body, &views, limb, sky::DEFAULT_DETECT_PERCENT).ok()?;
        // A focal length or a limb height that disagrees moves the principal point, too.
        if check.focal.is_significant() {
            return None;
        }
        let camera = &config.camera;
        let told = [("cx_px", camera.cx_px), ("cy_px", camera.cy_px)].into_iter().zip(&check.centre_px);
        let wrong = told.filter(|(_, found)| found.is_significant());
        let ((key, told_px), found) = wrong.max_by(|a, b| a.1.sigmas.abs().total_cmp(&b.1.sigmas.abs()))?;
        Some(format!(
            "the limb, at different places of {} pictures, shows the principal point at {key} = {:.1} ± {:.1}, and \
             {told_px:.1} is told ({:.1} sigma). Are the pictures a part of larger ones (cropped, a window of the \
             detector)? cx_px and cy_px are then those of the larger picture, minus the first column and row of the \
             part. `hzn calibrate check` says more",
            views.len(),
            told_px + found.value,
            found.sigma,
            found.sigmas.abs()
        ))
    }

    /// Looks for a limb of any size, and says what would fit the median of the pictures. `None` if no picture shows a
    /// limb, or if those that do show one of the expected size.
    pub(crate) fn what_fits(&self, request: &Request, config: &Config) -> Option<WhatFits> {
        let camera = Camera::try_new(&config.camera).ok()?;
        let mut found = self.any_fits(request, config)?;
        found.retain(|fit| diagnosis::is_misfit(fit, config));
        if let Some(text) = contradicting(&found, self.each.len()) {
            return Some(WhatFits { text, pictures: found.len() });
        }
        let fits = diagnosis::what_fits(&diagnosis::median_fit(&found)?, &camera, config.camera.width);
        let text = match (self.each.as_slice(), found.len()) {
            ([Look { name, .. }], _) => format!("in {name} {fits}"),
            (each, n) => format!("in {n} of {} refused pictures that were looked at (median), {fits}", each.len()),
        };
        Some(WhatFits { text, pictures: found.len() })
    }

    /// Says which two values are wrong, if two of altitude, focal length and limb height explain the limbs in the
    /// pictures with these numbers and no single one does. They have to come from the whole run, because pictures that
    /// follow each other are alike.
    pub(crate) fn two_values(request: &Request, config: &Config, indices: &[u64]) -> Option<WhatFits> {
        if indices.len() < FEWEST_FOR_TWO {
            return None;
        }
        let body = config.each_body().first()?;
        let found = Self::read(request, config, indices)?.any_fits(request, config)?;
        let pair = diagnosis::find_pair(found.iter(), [body.limb_height_km, body.limb_height_sigma_km])?;
        let words = diagnosis::two_values(&pair, config.camera.fx_px);
        let pictures = found.iter().filter(|fit| diagnosis::is_misfit(fit, config)).count();
        Some(WhatFits { text: format!("two values are wrong: {words}"), pictures })
    }

    /// Looks for a limb of any size in each picture.
    fn any_fits(&self, request: &Request, config: &Config) -> Option<Vec<FitFacts>> {
        let mut trial = AnyCone::new(config, request.flight).ok()?;
        let mut find = |look: &Look| {
            let view = look.picture.view(config.input.channel).ok()?;
            diagnosis::find_any_fit(&mut trial, config, &view, look.data.as_ref())
        };
        Some(self.each.iter().filter_map(&mut find).collect())
    }

    /// Says which bars the pictures have that no mask covers.
    pub(crate) fn bars(&self, config: &Config) -> Option<String> {
        let pictures: Vec<Picture> = self.each.iter().map(|look| look.picture.clone()).collect();
        let bars = find_bars(&pictures)?;
        let (width, height) = (config.camera.width, config.camera.height);
        let region = Region::<f64>::new(&config.mask, &Camera::try_new(&config.camera).ok()?);
        let inside = |px: u32| px.saturating_sub(1) as u16;
        let (right, bottom) = (width.checked_sub(1)?, height.checked_sub(1)?);
        let sides = [
            (bars.left_px, inside(bars.left_px), height / 2),
            (bars.right_px, right.saturating_sub(inside(bars.right_px)), height / 2),
            (bars.top_px, width / 2, inside(bars.top_px)),
            (bars.bottom_px, width / 2, bottom.saturating_sub(inside(bars.bottom_px))),
        ];
        let is_free = sides.iter().any(|(px, x, y)| *px > 0 && region.contains(*x, *y) && !region.masked(*x, *y));
        is_free.then(|| {
            format!(
                "the refused pictures have {}, whose borders are edges; mask them, as hzn init does: \
                 [mask] polygons_px = {}",
                bars.describe(),
                bars.polygons_px([width, height].map(u32::from))
            )
        })
    }
}

/// Says that the limbs of some pictures are larger than expected and those of others smaller; `None` if a third of them
/// at most contradicts the others, which may be clouds.
// The median of such pictures is that of nothing: its half-angle and its altitude came from different pictures.
fn contradicting(found: &[FitFacts], looked_at: usize) -> Option<String> {
    let larger = found.iter().filter(|fit| fit.sigmas > 0.0).count();
    let smaller = found.len() - larger;
    (3 * larger.min(smaller) > found.len()).then(|| {
        format!(
            "the limb is larger than expected in {larger} of {looked_at} refused pictures that were looked at, and \
             smaller in {smaller}: no altitude fits both. Check the field of view, the kind of the lens, and the \
             altitude of each picture"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::contradicting;
    use hzn_run::diagnosis::FitFacts;

    fn fit(sigmas: f64) -> FitFacts {
        FitFacts {
            expected_deg: 77.0,
            fitted_deg: 77.0 + sigmas,
            fitted_sigma_deg: 1.0,
            expected_sigma_deg: 0.1,
            sigmas,
            is_trial: true,
            given_altitude_km: None,
            altitude_km: None,
            focal_factor: None,
            limb_height_km: None,
        }
    }

    #[test]
    fn limbs_that_contradict_each_other_have_no_median() {
        let told = contradicting(&[fit(5.0), fit(-4.0)], 5).unwrap();
        assert!(told.contains("in 1 of 5 refused pictures") && told.contains("smaller in 1:"), "{told}");
        assert!(contradicting(&[fit(5.0), fit(4.0), fit(-4.0)], 5).is_none(), "one picture may show a cloud");
        assert!(contradicting(&[fit(5.0), fit(4.0), fit(-4.0), fit(-6.0)], 5).is_some());
        assert!(contradicting(&[fit(5.0)], 1).is_none() && contradicting(&[], 0).is_none());
    }
}
