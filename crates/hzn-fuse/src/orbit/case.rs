//! A flight with what is known about its instruments, and its most probable orbit.

use std::collections::HashMap;

use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::options::{Mode, Options, StartSigmas};
use nalgebra::{DVector, Vector3};

use super::adjust::{Adjusted, adjust};
use super::estimates::{Estimates, FASTER, OneCamera, Places};
use super::problem::Problem;
use super::sights::{self, Attitudes, Sight};
use super::start;
use crate::error::Error;
use crate::input::{Attitude, Inputs, Recording};
use crate::results::Counts;
use crate::settings::Settings;
use crate::solve::lenses;
use crate::solve::slow::Link;

/// A flight with what is known about its instruments.
pub(super) struct Case<'a> {
    pub(super) inputs: &'a Inputs,
    pub(super) settings: &'a Settings,
    pub(super) mounts: &'a [Rotation<Cam, Vehicle>],
    cameras: Vec<OneCamera<'a>>,
    pub(super) places: Places,
}

/// The most probable orbit with what it was made from.
pub(super) struct Solution {
    pub(super) sights: Vec<Sight>,
    pub(super) attitudes: Attitudes,
    pub(super) adjusted: Adjusted,
}

impl<'a> Case<'a> {
    /// # Errors
    /// The settings have a sigma for a lens that is not known.
    pub(super) fn new(
        inputs: &'a Inputs,
        settings: &'a Settings,
        mounts: &'a [Rotation<Cam, Vehicle>],
    ) -> Result<Self, Error> {
        let limb_sigma_km = inputs.recordings.iter().filter_map(|r| r.limb_sigma_km).reduce(f64::max);
        let options: Options = settings.options(limb_sigma_km, StartSigmas::default());
        let recordings = inputs.recordings.iter().zip(mounts).zip(lenses(&inputs.recordings, settings)?);
        let camera = |((recording, mount), lens): ((&'a Recording, &Rotation<Cam, Vehicle>), _)| {
            let name = recording.name.as_str();
            OneCamera { name, options: settings.camera_options(name, *mount, 1), lens }
        };
        let cameras: Vec<OneCamera<'a>> = recordings.map(camera).collect();
        let places = Places::new(&options, &cameras, settings);
        Ok(Self { inputs, settings, mounts, cameras, places })
    }

    /// Returns whether each camera has a slow error.
    fn has_slow(&self) -> Vec<bool> {
        self.cameras.iter().map(|camera| camera.options.slow_error != Mode::Off).collect()
    }

    /// Finds the most probable orbit for attitudes.
    pub(super) fn solve(&self, attitudes: &[Attitude], counts: &mut Counts) -> Result<Solution, Error> {
        let attitudes = Attitudes::new(attitudes, counts);
        let has_slow = self.has_slow();
        let lenses: Vec<_> = self.cameras.iter().map(|camera| camera.lens.as_ref()).collect();
        let sights = sights::sights(self.inputs, &attitudes, (&has_slow, &lenses), counts);
        let (times_s, knots) = start::knots(&sights, &attitudes, self.mounts)?;
        let begin_s = times_s.first().copied().unwrap_or_default();
        let sights: Vec<Sight> = sights.into_iter().filter(|sight| sight.time_s >= begin_s).collect();
        let (links, slow) = self.slow_errors(&sights);
        let problem = self.problem(&sights, &attitudes, (&links, &slow));
        let first = Estimates {
            times_s,
            knots,
            shared: DVector::zeros(self.places.len()),
            slow: vec![Vector3::zeros(); links.len()],
            attitudes: vec![Vector3::zeros(); attitudes.rows.len()],
        };
        let adjusted = adjust(&problem, first)?;
        Ok(Solution { sights, attitudes, adjusted })
    }

    /// Returns the slow errors that follow each other, and the first of the two of each sight.
    fn slow_errors(&self, sights: &[Sight]) -> (Vec<Link>, Vec<Option<usize>>) {
        let has_slow = self.has_slow();
        let time_s = self.settings.orbit.slow_error_time_s;
        let mut last: HashMap<usize, (usize, f64)> = HashMap::new();
        let mut links: Vec<Link> = Vec::new();
        let mut slow = Vec::with_capacity(sights.len());
        for sight in sights {
            if !has_slow.get(sight.camera).copied().unwrap_or(false) {
                slow.push(None);
                continue;
            }
            let first = links.len();
            let before = last.insert(sight.camera, (first, sight.time_s));
            links.extend([time_s, time_s / FASTER].into_iter().enumerate().map(|(part, correlation_s)| Link {
                before: before.map(|(i, time_s)| (i + part, (sight.time_s - time_s) / correlation_s)),
                index: first + part,
            }));
            slow.push(Some(first));
        }
        (links, slow)
    }

    fn problem<'b>(
        &'b self,
        sights: &'b [Sight],
        attitudes: &'b Attitudes,
        (links, slow): (&'b [Link], &'b [Option<usize>]),
    ) -> Problem<'b> {
        Problem {
            sights,
            attitudes,
            told: self.mounts,
            places: &self.places,
            links,
            slow,
            density: self.settings.orbit.accel_noise_mps2_rthz,
            ballistic_m2_kg: self.settings.orbit.ballistic_m2_kg,
            gate_probability: self.settings.gate_probability,
        }
    }
}
