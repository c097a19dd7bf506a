//! Rolling shutter: the rows are exposed one after the other while the camera turns.
//!
//! The picture's time is that of its middle row. At the time t after it, the camera sees a static direction along the
//! ray s_t in its current frame. With the camera's rate ω in its own axes, the same direction is exp([ω t]×) s_t in the
//! camera frame at the picture's time, where t = readout · (row/(h − 1) − ½). All rays are returned in that frame.

use super::ray::{Ray, tangent};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::pixel::ImagePoint;

/// The rotation of the camera from row to row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turning<T> {
    /// Rotation from one row to the next, radians, in the camera's axes.
    // The rotation is kept for one row, because rate and readout time always appear as this product.
    per_row: V3<T>,
    /// The row that is exposed at the picture's time.
    middle: T,
}

/// Number of iterations that find the row of a direction. Each reduces the error, about 50 px at first, to a twentieth
/// or less.
const ROW_ITERATIONS: usize = 4;

impl<T: Real> Turning<T> {
    /// Makes the rotation for a rate in rad/s, in the camera's axes. `row_s` is the time from one row to the next, and
    /// `middle` is the row that is exposed at the picture's time.
    pub(super) fn new(rate_rad_s: [T; 3], row_s: T, middle: T) -> Self {
        Self { per_row: V3::from(rate_rad_s) * row_s, middle }
    }

    /// Converts a ray of row `v` to the camera frame at the picture's time.
    // One copy in flash.
    #[inline(never)]
    pub(super) fn to_frame_time(self, ray: &Ray<T>, v: T) -> Ray<T> {
        let angle = self.per_row * (v - self.middle);
        let s = rotate(&ray.s, &angle);
        // The derivative is converted from the tangent basis at the one ray to that at the other. The turn itself adds
        // a derivative by the row.
        let [[a, b], [c, d]] = [tangent(&ray.s), tangent(&s)];
        let (a, b) = (rotate(&a, &angle), rotate(&b, &angle));
        let by_row = self.per_row.cross(&s);
        let [au, av, bu, bv] = ray.m;
        let (du, dv) = (a * au + b * bu, a * av + b * bv + by_row);
        Ray { s, m: [c.dot(&du), c.dot(&dv), d.dot(&du), d.dot(&dv)] }
    }

    /// Returns the image point of a direction in the camera frame at the picture's time, at the row that sees the
    /// direction. `in_row_frame` projects a direction in the camera frame at the time of its row.
    pub(super) fn project(
        &self,
        s: &V3<T>,
        in_row_frame: impl Fn(&V3<T>) -> Option<ImagePoint<T>>,
    ) -> Option<ImagePoint<T>> {
        let mut p = in_row_frame(s)?;
        // The count is fixed, so that the time does not depend on the rate and a hopeless rate ends.
        for _ in 0..ROW_ITERATIONS {
            // The row of the image point decides the rotation, and the rotation decides the row; therefore it is an
            // iteration.
            p = in_row_frame(&rotate(s, &(self.per_row * (self.middle - p.v))))?;
        }
        Some(p)
    }
}

/// Turns `s` by the rotation vector `angle`, with tan(φ/2) to third order: the error is below 1e-6 rad up to 15°.
fn rotate<T: Real>(s: &V3<T>, angle: &V3<T>) -> V3<T> {
    let square = angle.dot(angle);
    // Sine and cosine would be exact, but this runs for every edge point, and a turn within a readout is small.
    let half = angle * (T::from_f64(0.5) + square * T::from_f64(1.0 / 24.0));
    let first = half.cross(s);
    s + (first + half.cross(&first)) * (T::from_f64(2.0) / (T::one() + half.dot(&half)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::Camera;
    use crate::geometry::camera::{Config, Model};
    use crate::geometry::frames::UnitVec3;

    #[test]
    fn a_static_direction_has_one_ray_whatever_row_sees_it() {
        let config = Config { readout_s: 0.03, ..Config::ideal(Model::Pinhole, 1280, 960, 900.0) };
        let still = Camera::<f64>::try_new(&config).unwrap();
        let rate = [0.4, -1.1, 2.0];
        let camera = still.with_rate(Some(rate));
        for (u, v) in [(10.0, 0.0), (600.0, 479.5), (1200.0, 959.0)] {
            let p = ImagePoint { u, v };
            let ray = camera.ray(p).unwrap();
            // The expected ray follows from the definition of the rotation.
            let t = 0.03 * (v / 959.0 - 0.5);
            let turn = nalgebra::Rotation3::new(V3::from(rate) * t);
            let want = turn * V3::from(still.ray(p).unwrap().direction().xyz());
            assert!((ray.s - want).norm() < 1e-6);
            let back = camera.project(&UnitVec3::assume_unit(ray.s)).unwrap();
            assert!((back.u - u).abs() < 1e-3 && (back.v - v).abs() < 1e-3, "{back:?}");
            for (k, (du, dv)) in [(0, (1e-4, 0.0)), (1, (0.0, 1e-4))] {
                let next = camera.ray(ImagePoint { u: u + du, v: v + dv }).unwrap();
                let by = ray.jacobian().map(|row| row[k]);
                assert!(((next.s - ray.s) / 1e-4 - V3::from(by)).norm() < 1e-7);
            }
        }
        assert!(camera.has_rolling_shutter() && still.with_rate(None).turning.is_none());
    }
}
