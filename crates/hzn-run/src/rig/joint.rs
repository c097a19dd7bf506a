//! The joint answer of one epoch, as a row.

use hzn_core::body;
use hzn_core::camera::Camera;
use hzn_core::fit::HalfAngle;
use hzn_core::frames::{Cam, Cov3, Rotation, UnitVec3, Vehicle};
use hzn_core::rig::{Head, Joint, MOST_HEADS, NoJoint, Rig};
use hzn_core::status::Status;
use hzn_core::{Config, Solution};
use hzn_files::rig::{self, Common, JOINT};
use hzn_mcap::{Row, RowMeta, roll_pitch_deg};

use super::mounts::{Mount, form};
use super::weather::with_weather;
use crate::engine::Finished;
use crate::error::{Error, unusable};
use crate::record::altitude_km;

/// Joins the answers of the heads about their first body.
pub struct Joiner {
    rig: Rig<f64>,
    common: Common,
    names: Vec<String>,
    mounts: Vec<Mount>,
    cameras: Vec<Camera<f64>>,
    body: body::Config,
}

/// The picture of a head in an epoch, as the joint answer needs it.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    frame: Option<&'a Finished>,
    repeats: Option<Repeat>,
}

/// Another picture with the same bytes. The noise of a camera never repeats, so it is not a picture of this head at
/// this time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Repeat {
    /// The picture of the epoch before.
    Before,
    /// The picture of another head.
    OtherHead,
}

impl<'a> Seen<'a> {
    /// Takes a processed picture; `None` if the head has none in this epoch. `repeats` says that it is another picture.
    pub fn new(frame: Option<&'a Finished>, repeats: Option<Repeat>) -> Self {
        Self { frame, repeats }
    }

    fn solution(&self) -> Option<&'a Solution<f64>> {
        let report = self.frame?.outcomes.first()?.report.as_ref().ok()?;
        report.solution.as_ref().filter(|_| report.status == Status::Ok)
    }

    /// Returns the head as number `k` of the joint answer, if it has an answer.
    fn answer(&self, k: usize) -> Option<Answered<'a>> {
        let solution = self.solution().filter(|_| self.repeats.is_none())?;
        Some(Answered { k, solution, frame: self.frame? })
    }

    /// Returns why the head has no part in the joint answer; `None` if it has an answer.
    fn absence(&self) -> Option<String> {
        let Some(frame) = self.frame else { return Some("no picture".into()) };
        match self.repeats {
            Some(Repeat::Before) => return Some("the picture of the epoch before".into()),
            Some(Repeat::OtherHead) => return Some("the picture of another head".into()),
            None => {}
        }
        match frame.outcomes.first() {
            Some(outcome) if self.solution().is_none() => Some(outcome.status().name().into()),
            Some(_) => None,
            None => Some(Status::NoLimb.name().into()),
        }
    }
}

/// A head that has an answer.
#[derive(Clone, Copy)]
struct Answered<'a> {
    k: usize,
    solution: &'a Solution<f64>,
    frame: &'a Finished,
}

impl Joiner {
    /// Prepares the joint answers of a rig about the first body of its sensors, in the order of the heads.
    ///
    /// # Errors
    /// A value of the rig is out of its limits, see [`hzn_files::rig::check`], a sensor has no lens, the sensors look
    /// for different first bodies, or one of several sensors fits no half-angle.
    pub fn new<'a>(file: &rig::Rig, sensors: impl IntoIterator<Item = &'a Config>) -> Result<Self, Error> {
        rig::check(file).map_err(|(key, what)| unusable(format!("{key}: {what}")))?;
        let (mut cameras, mut bodies) = (Vec::new(), Vec::new());
        for (head, sensor) in file.heads.iter().zip(sensors) {
            cameras.push(Camera::try_new(&sensor.camera).map_err(Error::failed)?);
            let body = sensor.each_body().first().cloned().unwrap_or_default();
            if file.heads.len() > 1 && sensor.fit.half_angle == HalfAngle::Known && !body.half_angle_is_free() {
                return Err(unusable(format!(
                    "head {}: fit.half_angle is \"known\" in its sensor.toml, so its answers have no half-angle of \
                     their own and cannot be joined with those of other heads; choose \"fused\" or \"free\"",
                    head.name
                )));
            }
            bodies.push((&head.name, body));
        }
        check_bodies(&bodies)?;
        let mount = |head: &rig::Head| head.mount.map(|mount| Mount::new(&file.rig.mount, &mount));
        Ok(Self {
            rig: Rig::new(&file.rig.check()).map_err(Error::failed)?,
            common: file.rig,
            names: file.heads.iter().map(|head| head.name.clone()).collect(),
            mounts: file.heads.iter().filter_map(mount).collect(),
            cameras,
            body: bodies.into_iter().next().map(|(_, body)| body).unwrap_or_default(),
        })
    }

    /// Refuses pictures whose times are further apart than those of one epoch.
    ///
    /// # Errors
    /// The times of two heads, and how far they are apart.
    pub fn check_times(&self, heads: &[Seen<'_>]) -> Result<(), Error> {
        let times = || self.names.iter().zip(heads).filter_map(|(name, head)| Some((name, head.frame?.time_s?)));
        let first = times().min_by(|a, b| a.1.total_cmp(&b.1));
        let last = times().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some(((first, first_s), (last, last_s))) = first.zip(last) else { return Ok(()) };
        if last_s - first_s <= self.common.sync_s {
            return Ok(());
        }
        Err(unusable(format!(
            "the picture of {last} was taken {:.3} s after that of {first}, and the pictures of one epoch are at most \
             {} s apart; give time_s if the times in the files are wrong",
            last_s - first_s,
            self.common.sync_s
        )))
    }

    /// Returns the rotation from each camera to the vehicle as a quaternion, scalar first.
    pub fn q_vehicle_from_camera_wxyz(&self) -> impl Iterator<Item = [f64; 4]> + '_ {
        self.mounts.iter().map(|mount| mount.q_vehicle_from_camera_wxyz)
    }

    /// Returns the row of an epoch. The axis is in the frame of the vehicle.
    pub fn join(&self, index: u64, heads: &[Seen<'_>]) -> Row {
        let answered: Vec<_> = heads.iter().enumerate().filter_map(|(k, head)| head.answer(k)).collect();
        let time_s = middle_s(&answered).or_else(|| heads.iter().find_map(|head| head.frame?.time_s));
        let mut row = match answered.as_slice() {
            [] => self.nothing(index, heads, time_s),
            [one] => self.single(index, heads, time_s, one),
            several => self.joint(index, heads, time_s, several),
        };
        row.detail = join([row.detail, self.absences(heads)]);
        let frozen =
            heads.iter().enumerate().filter(|(_, head)| head.repeats.is_some()).fold(0, |set, (k, _)| set | 1 << k);
        row.heads_excluded = self.listed(frozen | self.bits(row.heads_excluded.as_deref()));
        row
    }

    fn row(&self, index: u64, heads: &[Seen<'_>], time_s: Option<f64>, status: Status, detail: &str) -> Row {
        let first = heads.iter().find_map(|head| head.frame);
        let meta = RowMeta {
            index,
            file: first.map(|frame| frame.name.clone()).unwrap_or_default(),
            time_s,
            body: self.body.kind.name().to_owned(),
            altitude_km: altitude_km(first.and_then(|frame| frame.data.as_ref()), &self.body),
        };
        Row { head: Some(JOINT.to_owned()), ..Row::unprocessed(&meta, status, detail) }
    }

    /// Returns the row of an epoch in which no head answers. Its status is that of the heads if they agree.
    fn nothing(&self, index: u64, heads: &[Seen<'_>], time_s: Option<f64>) -> Row {
        let mut statuses = heads.iter().filter_map(|head| Some(head.frame?.outcomes.first()?.status()));
        let first = statuses.next().filter(|status| *status != Status::Ok);
        let status = first.filter(|first| statuses.all(|other| other == *first)).unwrap_or(Status::NoLimb);
        self.row(index, heads, time_s, status, &NoJoint::NoHead.to_string())
    }

    /// Returns the rotation from a head to the axes that the vehicle has at the time of the epoch. The picture's data
    /// have the rate, in the axes of the camera, whether it comes from the table of the vehicle or of the head.
    fn mount(&self, head: &Answered<'_>, time_s: Option<f64>) -> Option<Rotation<Cam, Vehicle, f64>> {
        let after_s = time_s.zip(head.frame.time_s).map_or(0.0, |(epoch_s, own_s)| epoch_s - own_s);
        let mount = self.mounts.get(head.k)?;
        let rate_rad_s = head.frame.data.as_ref().and_then(|data| data.rate_rad_s);
        mount.after(after_s, rate_rad_s.and_then(|rate| mount.to_vehicle(rate)))
    }

    /// Returns the answer of the only head, in the axes of the vehicle. It keeps the expected half-angle, which several
    /// heads do not need.
    fn single(&self, index: u64, heads: &[Seen<'_>], time_s: Option<f64>, head: &Answered<'_>) -> Row {
        let (Some(mount), Some(own)) = (self.mount(head, time_s), self.mounts.get(head.k)) else {
            return self.row(index, heads, time_s, Status::Rejected, &NoJoint::Undetermined.to_string());
        };
        let mut row = self.row(index, heads, time_s, Status::Ok, "");
        let axis = mount.apply(&head.solution.axis);
        let turned = turn(&mount, &head.solution.covariance);
        let var = self.common.mount.sigma_deg.to_radians().powi(2);
        let levers = across(&axis, &own.covariance_rad2);
        let rig = across(&axis, &[var, 0.0, 0.0, var, 0.0, var]);
        let sum = |i: usize| turned[i] + levers[i] + rig[i];
        self.set_direction(&mut row, &axis, std::array::from_fn(sum));
        if let Some(common) = &head.solution.common {
            let turned = turn(&mount, common);
            let sum: [f64; 6] = std::array::from_fn(|i| turned[i] + levers[i] + rig[i]);
            [
                row.cov_common_xx,
                row.cov_common_xy,
                row.cov_common_xz,
                row.cov_common_yy,
                row.cov_common_yz,
                row.cov_common_zz,
            ] = sum.map(Some);
        }
        row.half_angle_deg = Some(head.solution.half_angle_rad.to_degrees());
        set_fixed(&mut row, head.solution);
        row.heads_used = self.listed(1 << head.k);
        row
    }

    fn joint(&self, index: u64, heads: &[Seen<'_>], time_s: Option<f64>, answered: &[Answered<'_>]) -> Row {
        let cones = self.cones(answered, time_s);
        let is_without = |head: &&Answered<'_>| cones.get(head.k).is_some_and(Option::is_none);
        let without = answered.iter().filter(is_without).filter_map(|head| self.names.get(head.k));
        let without: Vec<String> = without.map(|name| format!("{name}: no free cone")).collect();
        let mut row = self.join_cones(index, heads, time_s, answered, &cones);
        row.detail = join([row.detail, without.join(", ")]);
        row
    }

    /// Returns the free cones of these heads at this time, in the places of the heads.
    fn cones(&self, answered: &[Answered<'_>], time_s: Option<f64>) -> [Option<Head<f64>>; MOST_HEADS] {
        let mut cones = [None; MOST_HEADS];
        for head in answered {
            if let Some(place) = cones.get_mut(head.k) {
                *place = self.cone(head, time_s);
            }
        }
        cones
    }

    /// Moves a joint answer to the middle of the exposures that it uses, if heads were excluded from it. While the
    /// vehicle turns, an excluded head that is late would otherwise move the time, but not the direction.
    fn at_the_used(
        &self,
        joint: Joint<f64>,
        time_s: Option<f64>,
        answered: &[Answered<'_>],
        tilt_rad: f64,
    ) -> (Joint<f64>, Option<f64>) {
        let used: Vec<_> = answered.iter().filter(|head| joint.heads_used >> head.k & 1 == 1).copied().collect();
        let own_s = middle_s(&used);
        if own_s == time_s {
            return (joint, time_s);
        }
        match self.rig.join(&self.cones(&used, own_s), tilt_rad) {
            Ok(Joint { axis, covariance, cos, heads_used, .. }) if heads_used == joint.heads_used => {
                (Joint { axis, covariance, cos, ..joint }, own_s)
            }
            _ => (joint, time_s),
        }
    }

    fn join_cones(
        &self,
        index: u64,
        heads: &[Seen<'_>],
        time_s: Option<f64>,
        answered: &[Answered<'_>],
        cones: &[Option<Head<f64>>; MOST_HEADS],
    ) -> Row {
        // The largest limb counts: its tilt moves the axis most.
        let cos = answered.iter().filter_map(|head| Some(head.solution.free?.cos)).fold(1.0, f64::min);
        let rig_rad = self.common.mount.sigma_deg.to_radians();
        let tilt_rad = self.tilt_rad(cos).hypot(rig_rad);
        match self.rig.join(cones, tilt_rad) {
            Ok(joint) => {
                let (joint, time_s) = self.at_the_used(joint, time_s, answered, tilt_rad);
                let mut row = self.row(index, heads, time_s, Status::Ok, "");
                self.set_joint(&mut row, &joint);
                if let Some(used) = answered.iter().find(|head| joint.heads_used >> head.k & 1 == 1) {
                    set_fixed(&mut row, used.solution);
                }
                row
            }
            Err(why) => {
                let detail = match why {
                    NoJoint::Inconsistent => format!("inconsistent: {why}"),
                    _ => why.to_string(),
                };
                self.row(index, heads, time_s, Status::Rejected, &detail)
            }
        }
    }

    /// Returns the free cone of a head in the axes of the vehicle.
    fn cone(&self, head: &Answered<'_>, time_s: Option<f64>) -> Option<Head<f64>> {
        let limb_km = self.body.mean_radius_km() + self.body.limb_height_km;
        let free = with_weather(&head.solution.free?, self.cameras.get(head.k)?, limb_km, &self.common);
        let mount = self.mount(head, time_s)?;
        Head::new(&free, &mount, &self.mounts.get(head.k)?.covariance_rad2, 0.0)
    }

    /// Returns the 1σ of the axis that a tilt of the limb causes, in radians: the tilt times the derivative of the
    /// half-angle by the height, tan α/(R + d).
    fn tilt_rad(&self, cos: f64) -> f64 {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let limb_km = self.body.mean_radius_km() + self.body.limb_height_km;
        let km = self.common.limb_tilt_km(sin.atan2(cos).to_degrees());
        if cos > 0.0 && limb_km > 0.0 { km * sin / (cos * limb_km) } else { 0.0 }
    }

    fn set_joint(&self, row: &mut Row, joint: &Joint<f64>) {
        self.set_direction(row, &joint.axis, joint.covariance.upper_rad2);
        let (cos, _) = joint.cos;
        row.half_angle_deg = Some((1.0 - cos * cos).max(0.0).sqrt().atan2(cos).to_degrees());
        row.protection_deg = joint.protection_rad.map(f64::to_degrees);
        row.heads_used = self.listed(joint.heads_used);
        row.heads_excluded = self.listed(joint.heads_excluded);
        let separation = joint.separation_rad.map(|(moved, allowed)| (moved.to_degrees(), allowed.to_degrees()));
        row.separation_deg = separation.map(|(moved, _)| moved);
        row.separation_limit_deg = separation.map(|(_, allowed)| allowed);
    }

    fn set_direction(&self, row: &mut Row, axis: &UnitVec3<Vehicle, f64>, upper_rad2: [f64; 6]) {
        [row.axis_x, row.axis_y, row.axis_z] = axis.xyz().map(Some);
        [row.axis_v_x, row.axis_v_y, row.axis_v_z] = axis.xyz().map(Some);
        [row.cov_xx, row.cov_xy, row.cov_xz, row.cov_yy, row.cov_yz, row.cov_zz] = upper_rad2.map(Some);
        let sigma_rad = Cov3::<Vehicle, f64>::from_upper(upper_rad2).sigma_max_rad();
        row.sigma_max_deg = Some(sigma_rad.to_degrees());
        let [roll, pitch] = roll_pitch_deg(axis);
        (row.roll_deg, row.pitch_deg) = (Some(roll), Some(pitch));
    }

    /// Returns which heads have no part in the answer, with the reasons.
    fn absences(&self, heads: &[Seen<'_>]) -> String {
        let absent = |(name, head): (&String, &Seen<'_>)| Some(format!("{name}: {}", head.absence()?));
        self.names.iter().zip(heads).filter_map(absent).collect::<Vec<_>>().join(", ")
    }

    /// Returns the names of a set of heads; `None` if it is empty.
    fn listed(&self, set: u8) -> Option<String> {
        let named = self.names.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1).map(|(_, name)| name.as_str());
        Some(named.collect::<Vec<_>>().join(" ")).filter(|names| !names.is_empty())
    }

    fn bits(&self, listed: Option<&str>) -> u8 {
        let place = |name: &str| self.names.iter().position(|own| own == name);
        listed.unwrap_or_default().split(' ').filter_map(place).fold(0, |set, k| set | 1 << k)
    }
}

/// Refuses heads that look for different first bodies.
fn check_bodies(bodies: &[(&String, body::Config)]) -> Result<(), Error> {
    let Some(((first, body), rest)) = bodies.split_first() else { return Ok(()) };
    match rest.iter().find(|(_, other)| other.kind != body.kind) {
        Some((other, other_body)) => Err(unusable(format!(
            "{first} looks for {} and {other} for {}: the heads of a {JOINT} must look for the same first body",
            body.kind.name(),
            other_body.kind.name()
        ))),
        None => Ok(()),
    }
}

fn join(texts: [String; 2]) -> String {
    texts.into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join("; ")
}

/// Returns the middle of the exposures that are used.
fn middle_s(answered: &[Answered<'_>]) -> Option<f64> {
    let times = || answered.iter().filter_map(|head| head.frame.time_s);
    let (first, last) = (times().reduce(f64::min)?, times().reduce(f64::max)?);
    Some(0.5 * (first + last))
}

/// Copies the direction in the fixed frame, which is the same for all heads.
fn set_fixed(row: &mut Row, solution: &Solution<f64>) {
    if let Some(fixed) = &solution.axis_fixed {
        [row.axis_e_x, row.axis_e_y, row.axis_e_z] = fixed.xyz().map(Some);
    }
}

/// Returns a covariance in the axes of the vehicle.
fn turn(mount: &Rotation<Cam, Vehicle, f64>, covariance: &Cov3<Cam, f64>) -> [f64; 6] {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let in_camera = axes.map(|axis| UnitVec3::try_new(axis).map_or(axis, |axis| mount.inverse().apply(&axis).xyz()));
    form(covariance.upper_rad2, in_camera)
}

/// Returns the covariance of a direction whose axes are turned by a small rotation with this covariance: the direction
/// moves by θ × e.
fn across(axis: &UnitVec3<Vehicle, f64>, rotation_rad2: &[f64; 6]) -> [f64; 6] {
    let [x, y, z] = axis.xyz();
    // The components of θ × e along x, y and z are (e × x)·θ, (e × y)·θ and (e × z)·θ.
    form(*rotation_rad2, [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
}

#[cfg(test)]
mod tests;
