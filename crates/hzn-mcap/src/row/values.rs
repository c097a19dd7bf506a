//! Cells of a row that belong together, as vectors and matrices.

use hzn_core::frames::{Cam, Cov3};

use super::Row;

impl Row {
    /// Returns the axis (camera frame); `None` if there is no answer.
    pub fn axis(&self) -> Option<[f64; 3]> {
        Some([self.axis_x?, self.axis_y?, self.axis_z?])
    }

    /// Returns the covariance of [`Self::axis`] in rad² (camera frame): xx, xy, xz, yy, yz, zz; `None` without an axis.
    pub fn covariance(&self) -> Option<[f64; 6]> {
        Some([self.cov_xx?, self.cov_xy?, self.cov_xz?, self.cov_yy?, self.cov_yz?, self.cov_zz?])
    }

    /// Returns the part of the covariance that the next picture shares, as [`Self::covariance`]; `None` if it is not
    /// known.
    pub fn common_covariance(&self) -> Option<[f64; 6]> {
        Some([
            self.cov_common_xx?,
            self.cov_common_xy?,
            self.cov_common_xz?,
            self.cov_common_yy?,
            self.cov_common_yz?,
            self.cov_common_zz?,
        ])
    }

    /// Returns the larger standard deviation of the errors that the next picture does not share, in radians, see
    /// [`Solution::noise_rad`](hzn_core::Solution::noise_rad); `None` without an axis.
    pub fn noise_rad(&self) -> Option<f64> {
        let common = self.common_covariance().unwrap_or_default();
        let all = self.covariance()?;
        let noise = std::array::from_fn(|i| all[i] - common[i]);
        Some(Cov3::<Cam, f64>::from_upper(noise).sigma_max_rad())
    }

    /// Returns the position of the body's centre from the camera, in km (camera frame); `None` if there is none.
    pub fn position_km(&self) -> Option<[f64; 3]> {
        Some([self.position_x_km?, self.position_y_km?, self.position_z_km?])
    }

    /// Returns the covariance of [`Self::position_km`] in km² (camera frame): xx, xy, xz, yy, yz, zz.
    pub fn position_covariance_km2(&self) -> Option<[f64; 6]> {
        Some([
            self.pos_cov_xx_km2?,
            self.pos_cov_xy_km2?,
            self.pos_cov_xz_km2?,
            self.pos_cov_yy_km2?,
            self.pos_cov_yz_km2?,
            self.pos_cov_zz_km2?,
        ])
    }

    /// Returns the unit vector in the picture towards the body (right, down) and its standard deviation in radians;
    /// `None` without an answer, and for a body straight ahead.
    pub fn picture_direction(&self) -> Option<([f64; 2], f64)> {
        Some(([self.picture_x?, self.picture_y?], self.picture_sigma?))
    }
}
