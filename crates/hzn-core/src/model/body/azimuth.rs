//! The shape of the limb of an ellipsoid: how far it is from the mean cone at each azimuth about the axis.

use super::Expected;
use crate::base::real::Real;
use crate::geometry::cone::Azimuth;
use crate::geometry::ellipsoid::LimbCone;
use crate::geometry::frames::{Cam, UnitVec3};

impl<T: Real> Expected<T> {
    /// Returns the correction by azimuth for an ellipsoid; `None` if the body is no ellipsoid or the attitude is
    /// unknown.
    pub(crate) fn azimuth(&self) -> Option<Azimuth<T>> {
        let cone = self.ellipsoid.as_ref()?;
        // Without an attitude the direction of east is unknown; the mean cone is then used, and the covariance has the
        // difference.
        let to_cam = self.fixed_from_camera?.inverse();
        let (east, axis) = (to_cam.apply(&cone.east), to_cam.apply(&cone.axis));
        Some(Azimuth {
            north: east.v().cross(axis.v()),
            harmonics_cos: self.harmonics_cos,
            east: *east.v(),
            cot2_east: cone.cot2_east,
            cot2_meridian: cone.cot2_meridian,
            mean_cos: self.cos,
        })
    }

    /// Returns the cone of the ellipsoid for a limb whose mean cone has another half-angle, with this cosine and sine:
    /// both of its half-angles change as the mean one does, so that the shape about it stays.
    pub(super) fn ellipsoid_at(&self, cos: T, sin: T) -> Option<LimbCone<T>> {
        let cot2 = |cos: T, sin: T| cos * cos / (sin * sin);
        let change = cot2(cos, sin) - cot2(self.cos, self.sin);
        let moved = |cot2: T| (cot2 + change).max(T::ZERO);
        self.ellipsoid.map(|cone| LimbCone {
            cot2_east: moved(cone.cot2_east),
            cot2_meridian: moved(cone.cot2_meridian),
            ..cone
        })
    }

    /// Returns how far the limb is outside the mean cone about `axis`, at the azimuth of the direction `ray`; radians.
    /// It is 0 for a round body, without an attitude or position, and for a body whose position is fitted: such a
    /// [`Position`](crate::report::Position) has its own limb.
    pub fn limb_offset_rad(&self, axis: &UnitVec3<Cam, T>, ray: &UnitVec3<Cam, T>) -> T {
        self.azimuth().map_or(T::ZERO, |azimuth| {
            let east_along = azimuth.east.dot(axis.v());
            // A larger cosine is a smaller half-angle.
            -azimuth.offset(ray.xyz(), ray.dot(axis), east_along) / self.sin
        })
    }

    /// Returns the 1-sigma of the distance of the limb from the shape that [`Self::limb_offset_rad`] describes,
    /// radians: the azimuth of the shape, or the latitude of the camera, is not known. The error of the half-angle
    /// itself is not part of it.
    pub fn uneven_rad(&self) -> T {
        let [first, second] = self.unknown_harmonics_cos;
        (first + second) / self.sin
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::linalg::basis;
    use crate::geometry::ellipsoid::LimbCone;
    use crate::geometry::ellipsoid::{WGS84_A_M, WGS84_B_M};
    use crate::geometry::frames::Rotation;
    use crate::model::body::{Config, Prior};

    #[test]
    fn clipping_raises_the_limb_all_around_and_keeps_its_shape() {
        let body = Config { clipped_height_km: 25.0, ..Config::default() };
        let attitude = Rotation::assume_from_quaternion([0.5, -0.5, 0.5, 0.5]).unwrap();
        let frame = Prior {
            position_m: Some([4.9e6, 1.0e6, 4.6e6]),
            fixed_from_camera: Some(attitude),
            attitude_sigma_rad: Some(0.01),
            ..Prior::default()
        };
        let expected = Expected::<f64>::new(&body, &frame).unwrap();
        let clipped = expected.clipped(1.0);
        let raised_rad = clipped.half_angle_rad() - expected.half_angle_rad();
        assert!(raised_rad > 0.008, "{raised_rad}");
        let cone = expected.ellipsoid.unwrap();
        let axis = attitude.inverse().apply(&cone.axis);
        let east = attitude.inverse().apply(&cone.east);
        let north = UnitVec3::assume_unit(east.v().cross(axis.v()));
        for ray in [&east, &north] {
            let [before, after] = [expected, clipped].map(|expected| expected.limb_offset_rad(&axis, ray));
            assert!(before.abs() > 1e-4 && (after - before).abs() < 0.05 * before.abs(), "{before} {after}");
        }
    }

    #[test]
    fn the_offset_is_that_of_the_ellipsoids_cone() {
        let body = Config { limb_height_km: 0.0, limb: super::super::Limb::Height, ..Config::default() };
        let attitude = Rotation::assume_from_quaternion([0.5, -0.5, 0.5, 0.5]).unwrap();
        let position_m = [4.9e6, 1.0e6, 4.6e6];
        let frame = Prior {
            position_m: Some(position_m),
            fixed_from_camera: Some(attitude),
            attitude_sigma_rad: Some(0.0),
            ..Prior::default()
        };
        let expected = Expected::<f64>::new(&body, &frame).unwrap();
        let cone = LimbCone::<f64>::try_new(position_m, WGS84_A_M, WGS84_B_M).unwrap();
        let axis = attitude.inverse().apply(&cone.axis);
        let east = attitude.inverse().apply(&cone.east);
        let north = UnitVec3::assume_unit(east.v().cross(axis.v()));
        let (at_east, at_north) = (expected.limb_offset_rad(&axis, &east), expected.limb_offset_rad(&axis, &north));
        let (wide, narrow) = cone.half_angles_rad();
        assert!((at_east - at_north - (wide - narrow)).abs() < 2e-6, "{at_east} {at_north} {wide} {narrow}");
        assert!(at_east > 0.0 && at_north < 0.0);
        // Without an attitude the shape is within two sigmas of the mean cone.
        let unknown = Expected::<f64>::new(&body, &Prior { fixed_from_camera: None, ..frame }).unwrap();
        let (b1, _) = basis(axis.v());
        assert_eq!(unknown.limb_offset_rad(&axis, &UnitVec3::assume_unit(b1)), 0.0);
        assert!(at_east.max(-at_north) < 2.0 * unknown.uneven_rad() && unknown.uneven_rad() > expected.uneven_rad());
    }
}
