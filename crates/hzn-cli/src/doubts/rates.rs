//! Compares the rates of frames.csv with the turns of the answers from picture to picture. A table with attitudes is
//! compared with these when it is read; without them, only the answers can contradict its rates.

use hzn_run::engine::Finished;
use nalgebra::{Rotation3, Vector3};

use crate::tell;

/// Fewest pairs of answers that say something about the rates. With a faster turn than half a circle from picture to
/// picture, a few may disagree by chance.
const MIN_PAIRS: usize = 5;
/// Right rates leave less of the turns than no rates do, and rates with a wrong sign twice as much. The limit lies in
/// the middle.
const MAX_REST: f64 = 1.5;
/// The rates are doubted only if the turn that they leave exceeds this many sigma of the noise of both answers.
const MIN_SIGMAS: f64 = 3.0;
/// Largest turn between two answers that is compared, rad. The rates at two pictures do not say how the camera turned
/// through a larger one.
const MAX_TURN_RAD: f64 = core::f64::consts::FRAC_PI_2;
/// Fastest turn of the direction to a body in an orbit, rad/s, see `hzn_core::Sequence`: no rate of a camera says it.
const ORBIT_RAD_S: f64 = 1.24e-3;

/// The turn of the axis between two answers, rad, after the rates, times a factor, are taken out of it.
struct Rest {
    /// With the rates as they are.
    told: f64,
    in_degrees: f64,
    negated: f64,
    /// With nothing taken out.
    none: f64,
    /// The turn that the rates say.
    by_rates: f64,
}

/// An answer with time and rate.
#[derive(Clone, Copy)]
struct Answer {
    time_s: f64,
    rate_rad_s: Vector3<f64>,
    axis: Vector3<f64>,
    noise_rad: f64,
}

/// Collects the turns of the first body's answers.
#[derive(Default)]
pub(crate) struct Rates {
    last: Option<Answer>,
    turns: Vec<Rest>,
    /// Sigma of each turn from the noise of its answers, rad.
    sigmas: Vec<f64>,
}

impl Rates {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let answer = answer_of(frame);
        if let Some((before, now)) = self.last.zip(answer) {
            self.add(&before, &now);
        }
        self.last = answer;
    }

    fn add(&mut self, before: &Answer, now: &Answer) {
        let after_s = now.time_s - before.time_s;
        if !(after_s > 0.0) {
            return;
        }
        // The camera turns, so a direction at rest turns back in its axes.
        let turn = (before.rate_rad_s + now.rate_rad_s) * (-0.5 * after_s);
        let rest = |factor: f64| (Rotation3::new(turn * factor) * before.axis).angle(&now.axis);
        let (told, none) = ((rest(1.0) - ORBIT_RAD_S * after_s).max(0.0), rest(0.0));
        self.turns.push(Rest {
            told,
            in_degrees: rest(1f64.to_radians()),
            negated: rest(-1.0),
            none,
            by_rates: turn.norm(),
        });
        self.sigmas.push(before.noise_rad.hypot(now.noise_rad));
    }

    /// Returns what is wrong with the rates; `None` if the answers turn as they say, or too little to tell.
    fn contradiction(&self) -> Option<String> {
        if self.turns.len() < MIN_PAIRS {
            return None;
        }
        let of = |what: fn(&Rest) -> f64| median(self.turns.iter().map(what).collect());
        let (told, none) = (of(|r| r.told), of(|r| r.none));
        if told <= MAX_REST * none || told <= MIN_SIGMAS * median(self.sigmas.clone()) {
            return None;
        }
        let cause = if MAX_REST * of(|r| r.in_degrees) < none {
            "are they in degrees per second? rate_x, rate_y, rate_z are rad/s"
        } else if of(|r| r.by_rates) > MAX_TURN_RAD {
            return None;
        } else if MAX_REST * of(|r| r.negated) < none {
            "do they have the opposite sign? They are the rotation of the camera, in its own axes"
        } else {
            "are they rad/s about the axes of the camera, and at the times of the pictures?"
        };
        Some(format!(
            "the axis turns by {:.2} deg from answer to answer, and the rates miss that by {:.2} deg (medians): \
             {cause}",
            none.to_degrees(),
            told.to_degrees()
        ))
    }

    pub(crate) fn tell(&self) {
        if let Some(what) = self.contradiction() {
            tell::warning(what);
        }
    }
}

/// Returns the answer of the first body with its rate; `None` without one of them, or if the table has an attitude.
fn answer_of(frame: &Finished) -> Option<Answer> {
    let data = frame.data.as_ref().filter(|data| data.q_fixed_from_camera_wxyz.is_none())?;
    let solution = frame.outcomes.first()?.report.as_ref().ok()?.solution.as_ref()?;
    Some(Answer {
        time_s: frame.time_s?,
        rate_rad_s: data.rate_rad_s?.into(),
        axis: solution.axis.xyz().into(),
        noise_rad: solution.noise_rad(),
    })
}

/// Returns the median; the values must not be empty.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns what is said of a camera that turns with a rate for ten pictures, two seconds apart, if the table says
    /// `factor` times the rate.
    fn said(rate_deg_s: [f64; 3], factor: f64, noise_rad: f64) -> Option<String> {
        let rate_rad_s = Vector3::from(rate_deg_s.map(f64::to_radians));
        let mut rates = Rates::default();
        let answers: Vec<Answer> = (0..10)
            .map(|i| {
                let time_s = 2.0 * f64::from(i);
                let shaken = Vector3::new(0.0, noise_rad * f64::from(i % 3 - 1), 0.0);
                let axis = Rotation3::new(-rate_rad_s * time_s) * Vector3::new(0.3, 0.1, 0.95) + shaken;
                Answer { time_s, rate_rad_s: rate_rad_s * factor, axis: axis.normalize(), noise_rad }
            })
            .collect();
        answers.windows(2).for_each(|pair| rates.add(&pair[0], &pair[1]));
        rates.contradiction()
    }

    #[test]
    fn right_rates_are_not_doubted_and_wrong_ones_are_named() {
        for rate in [[0.0; 3], [2.0, -1.0, 0.5], [30.0, 5.0, 0.0], [0.01, 0.0, 0.0], [0.0, 1800.0, 20.0]] {
            assert_eq!(said(rate, 1.0, 1e-3), None, "{rate:?}");
        }
        for rate in [[2.0, -1.0, 0.5], [9.0, 5.0, 0.0], [0.0, 20.0, 3.0]] {
            let degrees = said(rate, 1f64.to_degrees(), 1e-3).unwrap();
            assert!(degrees.contains("degrees per second"), "{rate:?}: {degrees}");
            let negated = said(rate, -1.0, 1e-3).unwrap();
            assert!(negated.contains("opposite sign"), "{rate:?}: {negated}");
        }
        // The rates at two pictures do not say how the camera turned by three quarters of a circle.
        assert_eq!(said([0.0, 135.0, 3.0], -1.0, 1e-3), None);
        // A satellite that keeps the Earth in view has the rate of its orbit, and its axis does not turn.
        let mut orbit = Rates::default();
        let axis = Vector3::new(0.0, 0.3, 0.95).normalize();
        let at = |time_s| Answer { time_s, rate_rad_s: Vector3::new(1.1e-3, 0.0, 0.0), axis, noise_rad: 1e-4 };
        (0..20).for_each(|i| orbit.add(&at(60.0 * f64::from(i)), &at(60.0 * f64::from(i + 1))));
        assert_eq!(orbit.contradiction(), None);
    }
}
