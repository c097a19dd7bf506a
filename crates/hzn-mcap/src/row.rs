//! The flat result: one row per picture and body, the same in CSV, JSON Lines and MCAP.

mod cell;
mod detail;
mod values;

use hzn_core::frames::{UnitVec3, Vehicle};
use hzn_core::real::Real;
use hzn_core::report::Position;
use hzn_core::status::Status;
use hzn_core::{Report, Solution};

use cell::Cell;
use detail::{describe, describe_answer};
use serde::{Deserialize, Serialize};

use crate::status_name;

/// The data of a picture before it is processed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowMeta {
    /// Place in the sequence, from 0.
    pub index: u64,
    /// Name of the picture as the user gave it.
    pub file: String,
    /// Time of the picture in seconds, in the sequence's own epoch; `None` if it is unknown.
    pub time_s: Option<f64>,
    /// Name of the body; see [`Kind::name`](hzn_core::body::Kind::name).
    pub body: String,
    /// Altitude of the position, else the altitude from the picture's prior or from sensor.toml, in kilometres.
    pub altitude_km: Option<f64>,
}

/// The columns of the results. Structure, names, JSON schema and empty row come from one entry per column. A column
/// `as` a module is written and read by that module.
macro_rules! columns {
    (
        $(#[doc = $about:literal])+
        pub struct Row {
            $($(#[doc = $doc:literal])+ $name:ident: $ty:ty $(as $with:literal)?,)+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub struct Row {
            $(
                $(#[doc = $doc])+
                $(#[serde(with = $with)])?
                pub $name: $ty,
            )+
        }

        impl Row {
            /// Names of the columns, in order.
            pub const COLUMNS: [&'static str; [$(stringify!($name)),+].len()] = [$(stringify!($name)),+];

            #[cfg(feature = "recordings")]
            /// Every column: (name, JSON type, whether every row has a value, meaning).
            pub(crate) const CELLS: &'static [(&'static str, &'static str, bool, &'static str)] =
                &[$((stringify!($name), <$ty as Cell>::JSON, <$ty as Cell>::ALWAYS, concat!($($doc),+))),+];

            /// Creates a row with empty cells.
            fn empty_cells() -> Self {
                Self { $($name: Cell::empty(),)+ }
            }

            /// Returns the texts of the row, in the order of the columns. A recording that others wrote may have any
            /// text in each of them.
            pub fn texts(&self) -> impl Iterator<Item = &str> {
                [$(self.$name.text(),)+].into_iter().flatten()
            }

            /// Changes each of [`Self::texts`].
            pub fn change_texts(&mut self, mut change: impl FnMut(&mut String)) {
                $(self.$name.text_mut().into_iter().for_each(&mut change);)+
            }
        }
    };
}

columns! {
    /// The result of one picture and body. The fields are the columns, in order; an empty cell is `None`.
    ///
    /// With the `csv` crate, `serialize` writes a row and `deserialize` reads it; with `serde_json` one row is one
    /// line. Angles of the vehicle follow [`roll_pitch_deg`].
    pub struct Row {
        /// Place in the sequence, from 0.
        index: u64,
        /// Name of the picture.
        file: String,
        /// Time in seconds, if it is known.
        time_s: Option<f64>,
        /// Name of the body: a value of `body.kind`, for example `earth`.
        body: String,
        /// Outcome, by its name, for example `no-limb`.
        status: Status as "status_name",
        /// Unit vector to the body in the camera frame, x; only with the status `ok`. This also holds for the columns
        /// up to `rms_px` (except `altitude_km`), `inliers`, `roll_deg`, `pitch_deg` and those after `detail`.
        axis_x: Option<f64>,
        /// Unit vector to the body in the camera frame, y.
        axis_y: Option<f64>,
        /// Unit vector to the body in the camera frame, z.
        axis_z: Option<f64>,
        /// Covariance of the axis, xx, rad².
        cov_xx: Option<f64>,
        /// Covariance of the axis, xy, rad².
        cov_xy: Option<f64>,
        /// Covariance of the axis, xz, rad².
        cov_xz: Option<f64>,
        /// Covariance of the axis, yy, rad².
        cov_yy: Option<f64>,
        /// Covariance of the axis, yz, rad².
        cov_yz: Option<f64>,
        /// Covariance of the axis, zz, rad².
        cov_zz: Option<f64>,
        /// Larger of the axis's two standard deviations, degrees.
        sigma_max_deg: Option<f64>,
        /// The same direction in the fixed frame of the body (for the Earth ECEF), x; only if the position is known.
        axis_e_x: Option<f64>,
        /// The same direction in the fixed frame, y.
        axis_e_y: Option<f64>,
        /// The same direction in the fixed frame, z.
        axis_e_z: Option<f64>,
        /// Half-angle of the fit with a free half-angle, degrees.
        half_angle_deg: Option<f64>,
        /// Altitude of the position, else the given altitude, kilometres; with every status.
        altitude_km: Option<f64>,
        /// Altitude from the fit with a free half-angle, kilometres.
        altitude_est_km: Option<f64>,
        /// Standard deviation of that altitude, kilometres.
        altitude_est_sigma_km: Option<f64>,
        /// Weighted RMS distance of the inliers from the fitted limb, pixels.
        rms_px: Option<f64>,
        /// Number of sub-pixel edge points that were measured.
        edge_points: Option<u32>,
        /// Number of inliers: edge points that the answer is fitted to.
        inliers: Option<u32>,
        /// Number of edges that were examined as candidates.
        candidates: Option<u32>,
        /// Number of border pixels that were dropped because a list was full.
        dropped: Option<u32>,
        /// Threshold between dark and lit, in the picture's counts.
        level: Option<u16>,
        /// Roll of the vehicle, degrees; only with a mounting.
        roll_deg: Option<f64>,
        /// Pitch of the vehicle, degrees; only with a mounting.
        pitch_deg: Option<f64>,
        /// Processing time, microseconds, without decoding.
        elapsed_us: Option<f64>,
        /// Why there is no answer, in words; with the status `ok` empty, or why the answer is suspect
        /// (`gates.fixed_edge`).
        detail: String,
        /// Axis of the fit with a free half-angle (camera frame, unit vector), x; only if the half-angle was fitted.
        axis_free_x: Option<f64>,
        /// Axis of the fit with a free half-angle, y.
        axis_free_y: Option<f64>,
        /// Axis of the fit with a free half-angle, z.
        axis_free_z: Option<f64>,
        /// Covariance of that axis, xx, rad²: all terms except that of the expected half-angle.
        cov_free_xx: Option<f64>,
        /// Covariance of that axis, xy, rad².
        cov_free_xy: Option<f64>,
        /// Covariance of that axis, xz, rad².
        cov_free_xz: Option<f64>,
        /// Covariance of that axis, yy, rad².
        cov_free_yy: Option<f64>,
        /// Covariance of that axis, yz, rad².
        cov_free_yz: Option<f64>,
        /// Covariance of that axis, zz, rad².
        cov_free_zz: Option<f64>,
        /// Derivative of the axis by the cosine of the expected half-angle (camera frame), x. A wrong limb height moves
        /// this cosine in all pictures alike.
        axis_by_cos_x: Option<f64>,
        /// Derivative of the axis by the cosine of the expected half-angle, y.
        axis_by_cos_y: Option<f64>,
        /// Derivative of the axis by the cosine of the expected half-angle, z.
        axis_by_cos_z: Option<f64>,
        /// Position of the body's centre in the camera frame, x, kilometres; only with
        /// `fit.position`.
        position_x_km: Option<f64>,
        /// Position of the body's centre in the camera frame, y, kilometres; only with
        /// `fit.position`.
        position_y_km: Option<f64>,
        /// Position of the body's centre in the camera frame, z, kilometres; only with
        /// `fit.position`.
        position_z_km: Option<f64>,
        /// Covariance of that position, xx, km².
        pos_cov_xx_km2: Option<f64>,
        /// Covariance of that position, xy, km².
        pos_cov_xy_km2: Option<f64>,
        /// Covariance of that position, xz, km².
        pos_cov_xz_km2: Option<f64>,
        /// Covariance of that position, yy, km².
        pos_cov_yy_km2: Option<f64>,
        /// Covariance of that position, yz, km².
        pos_cov_yz_km2: Option<f64>,
        /// Covariance of that position, zz, km².
        pos_cov_zz_km2: Option<f64>,
        /// Position of the camera in the axes of the body, x, kilometres.
        body_fixed_x_km: Option<f64>,
        /// Position of the camera in the axes of the body, y, kilometres.
        body_fixed_y_km: Option<f64>,
        /// Position of the camera in the axes of the body, z, kilometres.
        body_fixed_z_km: Option<f64>,
        /// Rotation of the body about the line to it, relative to the given orientation, degrees; right-handed about
        /// the direction to the body. Only if its 1σ is below `fit.yaw_limit_deg`.
        yaw_deg: Option<f64>,
        /// 1σ of that rotation, degrees.
        yaw_sigma_deg: Option<f64>,
        /// Unit vector in the picture towards the body, to the right; empty for a body straight ahead.
        picture_x: Option<f64>,
        /// Unit vector in the picture towards the body, down.
        picture_y: Option<f64>,
        /// Standard deviation of that vector, which is its angle in the picture in radians.
        picture_sigma: Option<f64>,
        /// Probability that the edge of the answer is the limb; only for bodies with air.
        p_limb: Option<f64>,
        /// Protection level, degrees: the angle that the error of the axis exceeds with the probability
        /// `covariance.protection_probability` if the edge is the limb; only with `p_limb`. Of a rig: with its
        /// probability `misleading`, if at most one head is wrong.
        protection_deg: Option<f64>,
        /// The part of the axis's covariance whose error is the same in the next picture while the geometry stays, xx,
        /// rad². The mean of n such answers has the covariance common + (cov − common)/n.
        cov_common_xx: Option<f64>,
        /// The common part of the axis's covariance, xy, rad².
        cov_common_xy: Option<f64>,
        /// The common part of the axis's covariance, xz, rad².
        cov_common_xz: Option<f64>,
        /// The common part of the axis's covariance, yy, rad².
        cov_common_yy: Option<f64>,
        /// The common part of the axis's covariance, yz, rad².
        cov_common_yz: Option<f64>,
        /// The common part of the axis's covariance, zz, rad².
        cov_common_zz: Option<f64>,
        /// Whether the limb was found where the answer to the picture before put it (`track.full_every`); empty if the
        /// whole picture was searched.
        tracked: Option<bool>,
        /// The axis in the vehicle's frame, x; only with a mounting. Roll and pitch belong to this direction.
        axis_v_x: Option<f64>,
        /// The axis in the vehicle's frame, y.
        axis_v_y: Option<f64>,
        /// The axis in the vehicle's frame, z.
        axis_v_z: Option<f64>,
        /// With a rig: the name of the head, or `rig` for the joint answer, whose axis is in the vehicle's frame.
        head: Option<String>,
        /// Names of the heads that the joint answer uses, with spaces between them.
        heads_used: Option<String>,
        /// Names of the heads that the rig's own check excluded.
        heads_excluded: Option<String>,
        /// Angle by which the joint axis moves without the head that agrees least, degrees.
        separation_deg: Option<f64>,
        /// The largest such angle that the covariances allow, degrees.
        separation_limit_deg: Option<f64>,
        /// Coarse direction to the body in the vehicle's frame, x, if a rig has no answer: from what its heads see of
        /// body and sky. It is never an answer.
        coarse_x: Option<f64>,
        /// Coarse direction to the body, y.
        coarse_y: Option<f64>,
        /// Coarse direction to the body, z.
        coarse_z: Option<f64>,
        /// RMS of the angles between that direction and the directions that fit what the heads see, degrees.
        coarse_sigma_deg: Option<f64>,
        /// Height of the limb that explains the half-angle of a rig's answer at the given altitude, kilometres.
        limb_height_est_km: Option<f64>,
        /// 1σ of that height, from the half-angle and the altitude, kilometres.
        limb_height_est_sigma_km: Option<f64>,
        /// Covariance of the axis with the cosine of the half-angle in the fit with a free half-angle, x, rad; not of
        /// a flight computer.
        cov_free_cos_x: Option<f64>,
        /// Covariance of that axis with the cosine, y, rad.
        cov_free_cos_y: Option<f64>,
        /// Covariance of that axis with the cosine, z, rad.
        cov_free_cos_z: Option<f64>,
        /// Variance of the cosine of the half-angle in that fit; not of a flight computer.
        var_free_cos: Option<f64>,
    }
}

impl Row {
    /// Creates the row of a processed picture. `elapsed_us` is the run time of `process` in microseconds, if it was
    /// measured.
    pub fn from_report<T: Real>(meta: &RowMeta, report: &Report<T>, elapsed_us: Option<f64>) -> Self {
        let c = &report.counters;
        let mut row = Self {
            edge_points: Some(c.edge_points),
            candidates: Some(c.candidates),
            dropped: Some(c.dropped),
            level: (report.level > 0).then_some(report.level),
            elapsed_us,
            ..Self::without_answer(meta, report.status)
        };
        match (&report.solution, report.status) {
            (Some(solution), Status::Ok) => {
                row.set_answer(solution);
                row.tracked = report.is_tracked().then_some(true);
                row.detail = describe_answer(report, solution);
            }
            _ => row.detail = describe(report),
        }
        row
    }

    /// Creates the row of a picture that was not processed, for example because it could not be read.
    pub fn unprocessed(meta: &RowMeta, status: Status, reason: impl Into<String>) -> Self {
        Self { detail: reason.into(), ..Self::without_answer(meta, status) }
    }

    /// Creates a row with the data of the picture and the status.
    fn without_answer(meta: &RowMeta, status: Status) -> Self {
        Self {
            index: meta.index,
            file: meta.file.clone(),
            time_s: meta.time_s,
            body: meta.body.clone(),
            status,
            altitude_km: meta.altitude_km.and_then(finite),
            ..Self::empty_cells()
        }
    }

    /// Sets the protection level of an answer with `p_limb`, from its multiple of `sigma_max_deg`; a body without one
    /// has none.
    #[must_use]
    pub fn with_protection(self, factor: Option<f64>) -> Self {
        let sigma_deg = self.p_limb.and(self.sigma_max_deg);
        Self { protection_deg: sigma_deg.zip(factor).and_then(|(sigma, factor)| finite(sigma * factor)), ..self }
    }

    /// Leaves out what the packets of a flight computer do not have: the correlation of the free axis with its
    /// half-angle. A picture then has the same row by telemetry and by a run in the flight computer's precision.
    #[must_use]
    pub fn as_sent(self) -> Self {
        Self { cov_free_cos_x: None, cov_free_cos_y: None, cov_free_cos_z: None, var_free_cos: None, ..self }
    }

    fn set_answer<T: Real>(&mut self, s: &Solution<T>) {
        let number = |x: T| finite(x.to_f64());
        let deg = |x: T| finite(x.to_f64().to_degrees());
        [self.axis_x, self.axis_y, self.axis_z] = s.axis.xyz().map(number);
        [self.cov_xx, self.cov_xy, self.cov_xz, self.cov_yy, self.cov_yz, self.cov_zz] =
            s.covariance.upper_rad2.map(number);
        if let Some(common) = &s.common {
            [
                self.cov_common_xx,
                self.cov_common_xy,
                self.cov_common_xz,
                self.cov_common_yy,
                self.cov_common_yz,
                self.cov_common_zz,
            ] = common.upper_rad2.map(number);
        }
        self.sigma_max_deg = deg(s.covariance.sigma_max_rad());
        if let Some(e) = &s.axis_fixed {
            [self.axis_e_x, self.axis_e_y, self.axis_e_z] = e.xyz().map(number);
        }
        self.half_angle_deg = deg(s.half_angle_rad);
        if let Some((altitude_m, sigma_m)) = s.altitude_m {
            let km = |x: T| finite(x.to_f64() / 1e3);
            (self.altitude_est_km, self.altitude_est_sigma_km) = (km(altitude_m), km(sigma_m));
        }
        if let Some(free) = &s.free {
            [self.axis_free_x, self.axis_free_y, self.axis_free_z] = free.axis.xyz().map(number);
            [
                self.cov_free_xx,
                self.cov_free_xy,
                self.cov_free_xz,
                self.cov_free_yy,
                self.cov_free_yz,
                self.cov_free_zz,
            ] = free.covariance.upper_rad2.map(number);
            if let Some(with_cos) = free.axis_with_cos {
                [self.cov_free_cos_x, self.cov_free_cos_y, self.cov_free_cos_z] = with_cos.map(number);
                self.var_free_cos = number(free.var_cos);
            }
        }
        if let Some(by) = s.axis_by_cos {
            [self.axis_by_cos_x, self.axis_by_cos_y, self.axis_by_cos_z] = by.map(number);
        }
        if let Some(position) = &s.position {
            self.set_position(position);
        }
        if let Some((direction, sigma)) = s.picture_direction() {
            [self.picture_x, self.picture_y] = direction.map(number);
            self.picture_sigma = number(sigma);
        }
        self.rms_px = number(s.rms_px);
        self.p_limb = s.p_limb.and_then(number);
        self.inliers = Some(s.inliers);
        if let Some(body) = &s.axis_vehicle {
            [self.axis_v_x, self.axis_v_y, self.axis_v_z] = body.xyz().map(number);
            let [roll, pitch] = roll_pitch_deg(body);
            (self.roll_deg, self.pitch_deg) = (finite(roll), finite(pitch));
        }
    }

    fn set_position<T: Real>(&mut self, p: &Position<T>) {
        let widen = |x: T| x.to_f64();
        self.set_position_m(p.centre_m.map(widen), p.covariance_m2.map(widen), p.body_fixed_m.map(|v| v.map(widen)));
        if let Some(yaw) = p.yaw_rad {
            let deg = |x: T| finite(x.to_f64().to_degrees());
            (self.yaw_deg, self.yaw_sigma_deg) = (deg(yaw.0), deg(yaw.1));
        }
    }

    /// Fills the columns of the position: of the body's centre from the camera in metres (camera frame), with its
    /// covariance in m² (xx, xy, xz, yy, yz, zz), and of the camera in the axes of the body in metres, if it is known.
    pub fn set_position_m(&mut self, centre_m: [f64; 3], covariance_m2: [f64; 6], body_fixed_m: Option<[f64; 3]>) {
        let km = |x: f64| finite(x / 1e3);
        [self.position_x_km, self.position_y_km, self.position_z_km] = centre_m.map(km);
        [
            self.pos_cov_xx_km2,
            self.pos_cov_xy_km2,
            self.pos_cov_xz_km2,
            self.pos_cov_yy_km2,
            self.pos_cov_yz_km2,
            self.pos_cov_zz_km2,
        ] = covariance_m2.map(|x| finite(x / 1e6));
        if let Some(body_fixed) = body_fixed_m {
            [self.body_fixed_x_km, self.body_fixed_y_km, self.body_fixed_z_km] = body_fixed.map(km);
        }
    }
}

/// Returns roll and pitch of the vehicle, in degrees, from the direction to the body in the vehicle's frame.
///
/// The vehicle's axes are x forward, y right, z down. If the body is along +z, both angles are 0. Positive roll puts
/// the right side (+y) down, −180 to 180. Positive pitch puts the nose (+x) up, −90 to 90. In the order yaw, pitch,
/// roll the direction is (−sin p, sin r cos p, cos r cos p).
pub fn roll_pitch_deg<T: Real>(to_body: &UnitVec3<Vehicle, T>) -> [f64; 2] {
    let [x, y, z] = to_body.xyz().map(Real::to_f64);
    [y.atan2(z).to_degrees(), (-x).atan2(y.hypot(z)).to_degrees()]
}

/// Returns the number if it is finite, because a table has no other numbers.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

#[cfg(test)]
mod tests;
