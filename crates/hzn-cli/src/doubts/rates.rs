//! Compares the rates of frames.csv with the turns of the answers from picture to picture. A table with attitudes is
//! compared with these when it is read; without them, only the answers can contradict its rates.

use hzn_run::engine::Finished;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::other_axes::{Turn, best_axes};
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

/// Rates with the opposite sign or about other axes explain the turns if they leave less than this share of what the
/// told ones leave.
const EXPLAINED: f64 = 1.0 / 3.0;

/// An answer with time and rate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Answer {
    pub(crate) time_s: f64,
    pub(crate) rate_rad_s: Vector3<f64>,
    pub(crate) axis: Vector3<f64>,
    pub(crate) noise_rad: f64,
}

/// Collects the turns of the first body's answers.
#[derive(Default)]
pub(crate) struct Rates {
    last: Option<Answer>,
    turns: Vec<Turn>,
    /// The time of each turn, s.
    after_s: Vec<f64>,
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

    pub(crate) fn add(&mut self, before: &Answer, now: &Answer) {
        let after_s = now.time_s - before.time_s;
        if !(after_s > 0.0) {
            return;
        }
        // The camera turns, so a direction at rest turns back in its axes.
        let told = (before.rate_rad_s + now.rate_rad_s) * (-0.5 * after_s);
        self.turns.push(Turn { before: before.axis, after: now.axis, told });
        self.after_s.push(after_s);
        self.sigmas.push(before.noise_rad.hypot(now.noise_rad));
    }

    /// Returns what is wrong with the rates; `None` if the answers turn as they say, or too little to tell. `mount` is
    /// that of sensor.toml.
    pub(crate) fn contradiction(&self, mount: Option<[f64; 4]>) -> Option<String> {
        if self.turns.len() < MIN_PAIRS {
            return None;
        }
        let own = Rotation3::identity();
        let of = |axes: &Rotation3<f64>, factor: f64| median(self.turns.iter().map(|t| t.rest(axes, factor)).collect());
        let orbit = self.turns.iter().zip(&self.after_s);
        let told = median(orbit.map(|(t, after_s)| (t.rest(&own, 1.0) - ORBIT_RAD_S * after_s).max(0.0)).collect());
        let none = of(&own, 0.0);
        let sigma = median(self.sigmas.clone());
        if told <= MIN_SIGMAS * sigma {
            return None;
        }
        let by_rates = median(self.turns.iter().map(|t| t.told.norm()).collect());
        // An axis that does not turn, as that of a picture that stands still, fits rates about itself.
        let turns = none > MIN_SIGMAS * sigma && by_rates <= MAX_TURN_RAD;
        let explains = |axes: &Rotation3<f64>| turns && of(axes, 1.0) < EXPLAINED * told.min(none);
        let of_vehicle = mount.map(to_camera).filter(explains);
        let other = || best_axes(&self.turns).filter(explains);
        let is_worse = told > MAX_REST * none;
        let cause = if is_worse && MAX_REST * of(&own, 1f64.to_radians()) < none {
            "are they in degrees per second? rate_x, rate_y, rate_z are rad/s".to_owned()
        } else if is_worse && by_rates > MAX_TURN_RAD {
            return None;
        } else if is_worse && of(&own, -1.0) < EXPLAINED * none {
            "do they have the opposite sign? They are the rotation of the camera, in its own axes".to_owned()
        } else if of_vehicle.is_some() {
            "rates about the axes of the vehicle, turned by [mount], explain it: rate_x, rate_y, rate_z are about the \
             axes of the camera"
                .to_owned()
        } else if let Some(axes) = other() {
            format!(
                "rates of the same size about axes that are turned by {:.0} deg explain it: are they about the axes of \
                 the vehicle? rate_x, rate_y, rate_z are about those of the camera (x to the right, y down, z forward)",
                axes.angle().to_degrees()
            )
        } else if is_worse {
            "are they rad/s about the axes of the camera, and at the times of the pictures?".to_owned()
        } else {
            return None;
        };
        Some(format!(
            "the axis turns by {:.2} deg from answer to answer, and the rates miss that by {:.2} deg (medians): \
             {cause}",
            none.to_degrees(),
            told.to_degrees()
        ))
    }

    pub(crate) fn tell(&self, mount: Option<[f64; 4]>) {
        self.contradiction(mount).iter().for_each(tell::warning);
    }
}

/// Returns the rotation from the axes of the vehicle to those of the camera.
fn to_camera([w, x, y, z]: [f64; 4]) -> Rotation3<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).inverse().to_rotation_matrix()
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
        rates.contradiction(None)
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
        // A camera that looks along another axis, whose table has the rates of the vehicle.
        let mount = UnitQuaternion::from_euler_angles(1.9, -0.7, 0.4);
        for (rate_deg_s, has_mount) in [([2.0, -1.0, 0.5], true), ([0.3, 4.0, 1.0], false), ([9.0, 5.0, 0.0], false)] {
            let mut rates = Rates::default();
            let rate_rad_s = Vector3::from(rate_deg_s.map(f64::to_radians));
            let at = |i: u32| {
                let time_s = 2.0 * f64::from(i);
                let axis = Rotation3::new(-rate_rad_s * time_s) * Vector3::new(0.3, 0.1, 0.95).normalize();
                Answer { time_s, rate_rad_s: mount * rate_rad_s, axis, noise_rad: 1e-4 }
            };
            (0..10).for_each(|i| rates.add(&at(i), &at(i + 1)));
            let said = rates.contradiction(has_mount.then_some([mount.w, mount.i, mount.j, mount.k])).unwrap();
            assert!(said.contains("axes of the vehicle"), "{said}");
            assert_eq!(said.contains("[mount]"), has_mount, "{said}");
        }
        let axis = Vector3::new(0.0, 0.3, 0.95).normalize();
        // A picture that stands still while the vehicle turns says nothing about the rates' axes.
        let mut frozen = Rates::default();
        let still = Answer { time_s: 0.0, rate_rad_s: Vector3::new(0.02, 0.01, 0.0), axis, noise_rad: 1e-4 };
        let moment = |i: u32| Answer { time_s: f64::from(i), ..still };
        (0..20).for_each(|i| frozen.add(&moment(i), &moment(i + 1)));
        assert!(!frozen.contradiction(None).unwrap_or_default().contains("vehicle"));
        // A satellite that keeps the Earth in view has the rate of its orbit, and its axis does not turn.
        let mut orbit = Rates::default();
        let at = |time_s| Answer { time_s, rate_rad_s: Vector3::new(1.1e-3, 0.0, 0.0), axis, noise_rad: 1e-4 };
        (0..20).for_each(|i| orbit.add(&at(60.0 * f64::from(i)), &at(60.0 * f64::from(i + 1))));
        assert_eq!(orbit.contradiction(None), None);
    }
}
