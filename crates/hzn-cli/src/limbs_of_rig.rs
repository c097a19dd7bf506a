//! The limbs that the heads of a rig see together, as the adjustment of their mounts takes them.

use hzn_calib::rig::{Adjusted, Check, Epoch, Refused, Settings, Sighting, adjust, check};
use hzn_files::rig::{Common, Head, Rig};
use hzn_run::engine;
use hzn_run::rig::{FinishedEpoch, Joiner, Seen};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// Speed of the point below a vehicle in low orbit, km/s, with which the limb passes its weather.
const GROUND_SPEED_KM_S: f64 = 7.0;
/// 1-sigma of the difference of two bands' limb heights, kilometres: a limb is at up to 45 km in the band of carbon
/// dioxide, and between 0 and 25 km in visible light.
const BAND_SIGMA_KM: f64 = 20.0;
/// 1-sigma of each mount about each axis before the adjustment, degrees.
pub(crate) const PRIOR_DEG: f64 = 5.0;

/// The limbs of a run, epoch by epoch.
#[derive(Debug, Clone)]
pub(crate) struct LimbsOfRig {
    heads: Vec<Head>,
    rig: Common,
    /// Number of each head's limb group; the first head has 0.
    limb_groups: Vec<u8>,
    radius_km: f64,
    epochs: Vec<Epoch>,
    times_s: Vec<f64>,
    /// One of this number of epochs is kept.
    every: usize,
    seen: usize,
}

impl LimbsOfRig {
    /// Begins without an epoch.
    pub(crate) fn new(file: &Rig, joiner: &Joiner) -> Self {
        let radius_km = joiner.limb().radius_km;
        let (heads, rig, limb_groups) = (file.heads.clone(), file.rig, file.limb_groups());
        Self { heads, rig, limb_groups, radius_km, epochs: Vec::new(), times_s: Vec::new(), every: 1, seen: 0 }
    }

    /// Adds an epoch. With `without_excluded`, a head that the joint answer excludes does not count.
    pub(crate) fn add(&mut self, epoch: &FinishedEpoch, joiner: &Joiner, without_excluded: bool) {
        let is_kept = self.seen.is_multiple_of(self.every);
        self.seen += 1;
        if !is_kept {
            return;
        }
        let mut limbs = sightings(epoch, joiner, &self.heads);
        if without_excluded {
            let excluded = epoch.joint.heads_excluded.as_deref().unwrap_or_default();
            for (head, limb) in self.heads.iter().zip(&mut limbs) {
                limb.take_if(|_| excluded.split(' ').any(|name| name == head.name));
            }
        }
        self.epochs.push(limbs);
        self.times_s.extend(epoch.joint.time_s);
    }

    /// Keeps every second epoch if there are more than `most`.
    pub(crate) fn thin_out(&mut self, most: usize) {
        if self.epochs.len() > most {
            let half = |kept: usize| (0..kept).map(|i| i.is_multiple_of(2));
            let mut keep = half(self.epochs.len());
            self.epochs.retain(|_| keep.next().unwrap_or(false));
            let mut keep = half(self.times_s.len());
            self.times_s.retain(|_| keep.next().unwrap_or(false));
            self.every *= 2;
        }
    }

    /// Adjusts the mounts to the limbs.
    pub(crate) fn adjust(&self, prior_deg: f64) -> Result<Adjusted, Refused> {
        let settings = Settings {
            told: self.heads.iter().map(told).collect(),
            prior_rad: prior_deg.to_radians(),
            own_sigma_km: self.limb_groups.iter().map(|group| self.own_sigma_km(*group)).collect(),
            radius_km: self.radius_km,
            independent: independent(&self.times_s, self.rig.limb_own_sigma_km, self.rig.limb_own_length_km),
        };
        adjust(&settings, &self.epochs)
    }

    /// Returns the 1-sigma of the height that a head's limb has besides that of the first head.
    fn own_sigma_km(&self, group: u8) -> f64 {
        let band_km = if group == 0 { 0.0 } else { BAND_SIGMA_KM };
        self.rig.limb_own_sigma_km.hypot(band_km)
    }

    /// Returns the covariance of each told mount about the axes of the rig, rad².
    pub(crate) fn told_rad2(&self) -> Vec<Matrix3<f64>> {
        self.heads.iter().map(told_rad2).collect()
    }

    /// Says how the limbs of the whole run contradict the told mounts; `None` if they do not, or do not tell it.
    pub(crate) fn contradiction(&self) -> Option<String> {
        let name = |k: usize| self.heads.get(k).map_or("", |head| head.name.as_str());
        let names: Vec<&str> = self.heads.iter().map(|head| head.name.as_str()).collect();
        match self.adjust(PRIOR_DEG) {
            Ok(adjusted) => match check(&adjusted, &self.told_rad2()) {
                Check::Holds(_) => None,
                Check::Turned(k, angle_rad, sigma_rad) => Some(format!(
                    "{} has turned by {:.2} +- {:.2} deg against the other heads",
                    name(k),
                    angle_rad.to_degrees(),
                    sigma_rad.to_degrees()
                )),
                Check::Contradict => Some("their mounts differ from rig.toml by more than its sigmas".to_owned()),
            },
            Err(why @ Refused::Contradict { .. }) => Some(why.describe(&names)),
            Err(_) => None,
        }
    }
}

/// Returns what the heads see at an epoch, at the time of its first picture.
fn sightings(epoch: &FinishedEpoch, joiner: &Joiner, mounts: &[Head]) -> Epoch {
    let frames = epoch.heads.iter().zip(&epoch.repeats);
    let seen: Vec<Seen<'_>> = frames.map(|(frame, repeats)| Seen::new(frame.as_ref(), *repeats)).collect();
    let start_s = epoch.heads.iter().find_map(|frame| frame.as_ref()?.time_s);
    let cones = joiner.cones(&seen).into_iter();
    let one = |((cone, frame), head): ((Option<_>, &Option<engine::Finished>), &Head)| {
        let frame = frame.as_ref()?;
        let rate = frame.data.as_ref().and_then(|data| data.rate_rad_s).map_or_else(Vector3::zeros, Vector3::from);
        let late_s = start_s.zip(frame.time_s).map_or(0.0, |(start_s, own_s)| start_s - own_s);
        // A direction that stays where it is turns backwards in the axes of the rig.
        Sighting::new(&cone?, Rotation3::new(told(head) * rate * -late_s))
    };
    cones.zip(&epoch.heads).zip(mounts).map(one).collect()
}

fn told(head: &Head) -> Rotation3<f64> {
    let [w, x, y, z] = head.mount.map_or([1.0, 0.0, 0.0, 0.0], |mount| mount.q_rig_from_camera_wxyz);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix()
}

fn told_rad2(head: &Head) -> Matrix3<f64> {
    let [xx, xy, xz, yy, yz, zz] = head.mount.map_or([0.0; 6], |mount| mount.covariance_rad2());
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Returns which part of the epochs is independent: those within one length of the limb's weather see the same one.
fn independent(times_s: &[f64], sigma_km: f64, length_km: f64) -> f64 {
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    match steps.get(steps.len() / 2) {
        Some(step) if sigma_km > 0.0 => (step * GROUND_SPEED_KM_S / length_km).min(1.0),
        _ => 1.0,
    }
}
