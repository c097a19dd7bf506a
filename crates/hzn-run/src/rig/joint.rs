//! The joint answer of one epoch, as a row.

use hzn_core::body;
use hzn_core::fit::HalfAngle;
use hzn_core::frames::{Cov3, UnitVec3, Vehicle};
use hzn_core::report::Free;
use hzn_core::rig::{Answered, Common, EpochAnswer, Light, Limb, Mount, NoJoint, Rig, Unanswered};
use hzn_core::status::Status;
use hzn_core::{Config, Sensor};
use hzn_files::rig::{self, JOINT};
use hzn_mcap::{Row, RowMeta, roll_pitch_deg};

use super::seen::Seen;
use super::sync::is_in_sync;
use super::{coarse, mounts};
use crate::engine::Finished;
use crate::error::{Error, unusable};
use crate::record::altitude_km;

/// Joins the answers of the heads about their first body.
pub struct Joiner {
    rig: Rig<f64>,
    common: Common<f64>,
    sync_s: f64,
    names: Vec<String>,
    mounts: Vec<Mount<f64>>,
    limb_groups: Vec<u8>,
    sensors: Vec<Sensor<f64>>,
    body: body::Config,
}

impl Joiner {
    /// Prepares the joint answers of a rig about the first body of its sensors, in the order of the heads.
    ///
    /// # Errors
    /// A value of the rig is out of its limits, see [`hzn_files::rig::check`], a sensor has no lens, the sensors look
    /// for different first bodies, or one of several sensors fits no half-angle.
    pub fn new<'a>(file: &rig::Rig, sensors: impl IntoIterator<Item = &'a Config>) -> Result<Self, Error> {
        rig::check(file).map_err(|(key, what)| unusable(format!("{key}: {what}")))?;
        let (mut own, mut bodies) = (Vec::new(), Vec::new());
        for (head, sensor) in file.heads.iter().zip(sensors) {
            own.push(Sensor::new(sensor).map_err(Error::failed)?);
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
        let mount = |head: &rig::Head| mounts::mount(&file.rig.mount, head.mount.as_ref()?);
        let body = bodies.into_iter().next().map(|(_, body)| body).unwrap_or_default();
        let limb = Limb {
            radius_km: body.mean_radius_km() + body.limb_height_km,
            tilt_sigma_km: file.rig.limb_tilt_sigma_km.or(body.limb_tilt_sigma_km),
            own_sigma_km: file.rig.limb_own_sigma_km,
            own_length_km: file.rig.limb_own_length_km,
        };
        Ok(Self {
            rig: Rig::new(&file.rig.check()).map_err(Error::failed)?,
            common: Common { limb, sigma_rad: file.rig.mount.sigma_deg.to_radians() },
            sync_s: file.rig.sync_s,
            names: file.heads.iter().map(|head| head.name.clone()).collect(),
            mounts: file.heads.iter().filter_map(mount).collect(),
            limb_groups: file.limb_groups(),
            sensors: own,
            body,
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
        if is_in_sync(last_s - first_s, self.sync_s) {
            return Ok(());
        }
        Err(unusable(format!(
            "the picture of {last} was taken {:.3} s after that of {first}, and the pictures of one epoch are at most \
             {} s apart; give time_s if the times in the files are wrong",
            last_s - first_s,
            self.sync_s
        )))
    }

    /// Returns the free cones of the heads at an epoch with the error of the limb's weather, in the cameras' own axes;
    /// `None` for a head without one.
    pub fn cones(&self, heads: &[Seen<'_>]) -> Vec<Option<Free<f64>>> {
        let cone = |(k, head): (usize, &Seen<'_>)| {
            let answered = self.answered(k, head, None)?;
            Some(self.common.limb.with_weather(answered.solution.free.as_ref()?, answered.camera))
        };
        heads.iter().enumerate().map(cone).collect()
    }

    /// Returns the brightness from which on head `k` sees something lit, if this picture has a limb.
    pub(super) fn level(&self, k: usize, frame: Option<&Finished>) -> Option<u16> {
        let (sensor, glimpse) = (self.sensors.get(k)?, frame?.glimpse.as_ref()?);
        let solution = Seen::new(frame, None).solution()?;
        glimpse.level_at_limb(sensor.camera(), &solution.axis, solution.fused_half_angle_rad.cos())
    }

    /// Returns what is known of the limb that all heads see.
    pub fn limb(&self) -> &Limb<f64> {
        &self.common.limb
    }

    /// Returns the rotation from each camera to the vehicle as a quaternion, scalar first.
    pub fn q_vehicle_from_camera_wxyz(&self) -> impl Iterator<Item = [f64; 4]> + '_ {
        self.mounts.iter().map(Mount::q_vehicle_from_camera_wxyz)
    }

    /// Returns the row of an epoch. The axis is in the frame of the vehicle.
    pub fn join(&self, index: u64, heads: &[Seen<'_>]) -> Row {
        // The times in the rows stay as they are; those of the answer count from the first picture.
        let start_s = heads.iter().find_map(|head| head.frame?.time_s);
        let answered: Vec<_> = heads.iter().enumerate().map(|(k, head)| self.answered(k, head, start_s)).collect();
        let epoch = self.rig.join_epoch(&self.common, &answered);
        let time_s = epoch.time_s.zip(start_s).map(|(after_s, start_s)| start_s + after_s).or(start_s);
        let mut row = match epoch.answer {
            Ok(answer) => {
                // Heads of two bands see the body in two lights.
                let sun = Light::Sun(coarse::sun(&self.sensors, &self.mounts, heads));
                let answer = answer.doubted_by(self.unanswered(heads, false), &Light::Own);
                self.answer(index, heads, time_s, &answer.doubted_by(self.unanswered(heads, true), &sun))
            }
            Err(NoJoint::NoHead) => self.nothing(index, heads, time_s),
            Err(why) => {
                let detail = match why {
                    NoJoint::Inconsistent => format!("inconsistent: {why}"),
                    _ => why.to_string(),
                };
                self.row(index, heads, time_s, Status::Rejected, &detail)
            }
        };
        let is_without = |k: &usize| epoch.heads_without_cone >> k & 1 == 1;
        let without = self.names.iter().enumerate().filter(|(k, _)| is_without(k));
        let without: Vec<String> = without.map(|(_, name)| format!("{name}: no free cone")).collect();
        row.detail = join([row.detail, without.join(", ")]);
        row.detail = join([row.detail, self.absences(heads)]);
        let frozen =
            heads.iter().enumerate().filter(|(_, head)| head.repeats.is_some()).fold(0, |set, (k, _)| set | 1 << k);
        row.heads_excluded = self.listed(frozen | self.bits(row.heads_excluded.as_deref()));
        coarse::set(&mut row, &self.sensors, &self.mounts, heads);
        row
    }

    /// Returns head `k` as the joint answer takes it, if it has an answer.
    fn answered<'a>(&'a self, k: usize, head: &Seen<'a>, start_s: Option<f64>) -> Option<Answered<'a, f64>> {
        let solution = head.solution().filter(|_| head.repeats.is_none())?;
        let frame = head.frame?;
        Some(Answered {
            solution,
            camera: self.sensors.get(k)?.camera(),
            mount: self.mounts.get(k)?,
            time_s: frame.time_s.zip(start_s).map(|(own_s, start_s)| own_s - start_s),
            // The picture's data have the rate in the axes of the camera, whether it comes from the table of the
            // vehicle or of the head.
            rate_rad_s: frame.data.as_ref().and_then(|data| data.rate_rad_s),
            limb_group: self.limb_groups.get(k).copied().unwrap_or_default(),
        })
    }

    /// Returns the heads that have a picture of their own without an answer: those that see their body in sunlight, or
    /// the others.
    fn unanswered<'a>(&'a self, heads: &'a [Seen<'_>], in_sunlight: bool) -> impl Iterator<Item = Unanswered<'a, f64>> {
        let all = self.sensors.iter().zip(&self.mounts).zip(heads);
        let of_light = all.filter(move |((sensor, _), _)| coarse::is_sunlit(sensor) == in_sunlight);
        let without = of_light.filter(|(_, head)| head.has_no_limb());
        without.map(|((sensor, mount), _)| Unanswered { camera: sensor.camera(), region: sensor.region(), mount })
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
        if status != Status::NoAltitude {
            return self.row(index, heads, time_s, status, &NoJoint::NoHead.to_string());
        }
        // Several heads find the altitude themselves, so only the heads have this status.
        let detail = format!(
            "{}; set gates.altitude_limits_km in their sensor.toml to search without an altitude",
            NoJoint::NoHead
        );
        self.row(index, heads, time_s, Status::NoLimb, &detail)
    }

    fn answer(&self, index: u64, heads: &[Seen<'_>], time_s: Option<f64>, answer: &EpochAnswer<f64>) -> Row {
        let mut row = self.row(index, heads, time_s, Status::Ok, "");
        self.set_direction(&mut row, &answer.axis, answer.covariance.upper_rad2);
        if let Some(common) = &answer.common {
            [
                row.cov_common_xx,
                row.cov_common_xy,
                row.cov_common_xz,
                row.cov_common_yy,
                row.cov_common_yz,
                row.cov_common_zz,
            ] = common.upper_rad2.map(Some);
        }
        row.half_angle_deg = Some(answer.half_angle_rad.to_degrees());
        let used = heads.iter().enumerate().find(|(k, _)| answer.heads_used >> k & 1 == 1);
        self.set_heights(&mut row, used, answer);
        row.p_limb = answer.p_limb;
        row.protection_deg = answer.protection_rad.map(f64::to_degrees);
        row.heads_used = self.listed(answer.heads_used);
        row.heads_excluded = self.listed(answer.heads_excluded);
        let separation = answer.separation_rad.map(|(moved, allowed)| (moved.to_degrees(), allowed.to_degrees()));
        row.separation_deg = separation.map(|(moved, _)| moved);
        row.separation_limit_deg = separation.map(|(_, allowed)| allowed);
        // The direction in the fixed frame is the same for all heads.
        if let Some(fixed) = used.and_then(|(_, head)| head.solution()?.axis_fixed) {
            [row.axis_e_x, row.axis_e_y, row.axis_e_z] = fixed.xyz().map(Some);
        }
        row
    }

    /// Sets the altitude that follows from the half-angle and the limb height, and the limb height that follows from
    /// the half-angle and the altitude.
    fn set_heights(&self, row: &mut Row, used: Option<(usize, &Seen<'_>)>, answer: &EpochAnswer<f64>) {
        let Some((k, head)) = used else { return };
        let expected = self.sensors.get(k).and_then(|sensor| coarse::expected(sensor, head));
        let Some((expected, sigma)) = expected.zip(answer.cos_sigma) else { return };
        let (cos, var_cos) = (answer.half_angle_rad.cos(), sigma * sigma);
        let km = |found: Option<(f64, f64)>| {
            let found = found.filter(|(m, sigma_m)| m.is_finite() && sigma_m.is_finite());
            (found.map(|(m, _)| m / 1e3), found.map(|(_, sigma_m)| sigma_m / 1e3))
        };
        (row.altitude_est_km, row.altitude_est_sigma_km) = km(expected.altitude(cos, var_cos));
        // The middle of `gates.altitude_limits_km` is no altitude from which a limb height could follow.
        let told = row.altitude_km.and_then(|_| expected.measured_limb_height_m(cos, var_cos));
        (row.limb_height_est_km, row.limb_height_est_sigma_km) = km(told);
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

#[cfg(test)]
mod tests;
