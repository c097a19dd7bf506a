//! What navigation sends, and what of it a picture was processed with. The messages have these records.

use crate::record::record;

record! {
    /// Arguments of [`Function::Navigate`](crate::messages::Function::Navigate). NaN means that a value is not known;
    /// all three numbers of a vector are known, or none.
    Navigation {
        /// Time of the values: µs since the start of the computer (the first byte is then 0), or a time code
        /// ([`crate::cuc`]).
        epoch: u64,
        /// The values are not used for exposures that are further from `epoch` than this, s; NaN: they do not
        /// expire.
        expires_s: f32,
        /// Altitude, m.
        altitude_m: f32,
        /// Position in ECEF, m.
        position_x_m: f32,
        /// y of the position.
        position_y_m: f32,
        /// z of the position.
        position_z_m: f32,
        /// Velocity in ECEF, m/s: the position is moved to the exposure.
        velocity_x_m_s: f32,
        /// y of the velocity.
        velocity_y_m_s: f32,
        /// z of the velocity.
        velocity_z_m_s: f32,
        /// Rate of rotation of the camera in its own axes, rad/s.
        rate_x_rad_s: f32,
        /// y of the rate.
        rate_y_rad_s: f32,
        /// z of the rate.
        rate_z_rad_s: f32,
    }
}

record! {
    /// The values from navigation that a picture was processed with. NaN means that a value is not known.
    NavigationState {
        /// Number of the picture.
        picture: u32,
        /// 1: the values were used. 2: they have expired and were not used.
        state: u8,
        /// Time from the values to the exposure, s; NaN: the values have no time.
        age_s: f32,
        /// Altitude, m.
        altitude_m: f32,
        /// Position of the camera at the exposure in ECEF, m.
        position_m: [f32; 3],
        /// Velocity of the camera in ECEF, m/s, at the time of the values.
        velocity_m_s: [f32; 3],
        /// Rate of rotation of the camera in its own axes, rad/s.
        rate_rad_s: [f32; 3],
    }
}

impl NavigationState {
    /// [`Self::state`]: the values were used.
    pub const USED: u8 = 1;
    /// [`Self::state`]: the values have expired and were not used.
    pub const EXPIRED: u8 = 2;
}

record! {
    /// Arguments of [`Function::SetAttitude`](crate::messages::Function::SetAttitude). NaN means that a value is not
    /// known; all numbers of the quaternion and of the direction are known, or none.
    Attitude {
        /// Time of the values, as in [`Navigation`].
        epoch: u64,
        /// The values are not used for exposures that are further from `epoch` than this, s.
        // It is required, because an old attitude of a turning vehicle lets the gates refuse every right answer.
        expires_s: f32,
        /// Unit quaternion from the axes of the camera to those of the body (for the Earth ECEF): its scalar part.
        q_w: f32,
        /// x of the quaternion.
        q_x: f32,
        /// y of the quaternion.
        q_y: f32,
        /// z of the quaternion.
        q_z: f32,
        /// 1-sigma of the attitude about the worst axis, rad; NaN: 5 degrees.
        sigma_rad: f32,
        /// Direction to the Sun in the axes of the camera, of any length.
        sun_x: f32,
        /// y of this direction.
        sun_y: f32,
        /// z of this direction.
        sun_z: f32,
    }
}

record! {
    /// The attitude and the Sun that a picture was processed with. NaN means that a value is not known.
    AttitudeState {
        /// Number of the picture.
        picture: u32,
        /// 1: the values were used. 2: they have expired and were not used; then they are as they were sent.
        state: u8,
        /// Time from the values to the exposure, s.
        age_s: f32,
        /// Unit quaternion from the axes of the camera at the exposure to those of the body (for the Earth ECEF),
        /// scalar first.
        q: [f32; 4],
        /// 1-sigma of the attitude, rad.
        sigma_rad: f32,
        /// Direction to the Sun at the exposure in the axes of the camera.
        sun: [f32; 3],
    }
}

impl AttitudeState {
    /// [`Self::state`]: the values were used.
    pub const USED: u8 = NavigationState::USED;
    /// [`Self::state`]: the values have expired and were not used.
    pub const EXPIRED: u8 = NavigationState::EXPIRED;
}
