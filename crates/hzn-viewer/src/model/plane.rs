//! The plane that the picture is shown in: the camera's plane, or a plane without the distortion of the lens.

use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;

use super::view::Point;

/// Largest half of the field of view that a pinhole can show, in radians.
const MAX_HALF_FIELD_RAD: f64 = 75.0 * std::f64::consts::PI / 180.0;

/// The plane that is shown.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Plane {
    /// The camera's picture as it is.
    #[default]
    Camera,
    /// The picture of a pinhole with the same optical axis, where straight lines are straight.
    Pinhole(Pinhole),
}

/// A pinhole camera with square pixels that looks along the same optical axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pinhole {
    /// Focal length in pixels.
    pub focal_px: f64,
    /// Principal point in pixels, in the shown picture.
    pub centre: Point,
}

impl Pinhole {
    /// Returns the pinhole whose picture has the same size and shows the largest possible part of the camera's picture.
    pub fn new(camera: &Camera<f64>) -> Self {
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let ImagePoint { u, v } = camera.principal_point();
        let far = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].map(|(x, y): (f64, f64)| (x - u).hypot(y - v));
        let reach = far.into_iter().fold(0.0, f64::max);
        let half_field = camera.theta_max_rad().min(MAX_HALF_FIELD_RAD);
        Self { focal_px: reach / half_field.tan(), centre: [u, v] }
    }
}

impl Plane {
    /// Returns where a point of the camera's picture is shown, in pixels of the shown picture; `None` if the plane has
    /// no place for the point.
    pub fn to_shown(&self, camera: &Camera<f64>, p: Point) -> Option<Point> {
        match self {
            Self::Camera => Some(p),
            Self::Pinhole(pinhole) => {
                let [x, y, z] = camera.unproject(ImagePoint { u: p[0], v: p[1] })?.xyz();
                (z > MAX_HALF_FIELD_RAD.cos() * 0.5).then(|| {
                    [pinhole.centre[0] + pinhole.focal_px * x / z, pinhole.centre[1] + pinhole.focal_px * y / z]
                })
            }
        }
    }

    /// Returns the point of the camera's picture that is shown at `p`; `None` outside the field of view of the lens.
    pub fn to_camera(&self, camera: &Camera<f64>, p: Point) -> Option<Point> {
        match self {
            Self::Camera => Some(p),
            Self::Pinhole(pinhole) => {
                let [x, y] = [0, 1].map(|i| (p[i] - pinhole.centre[i]) / pinhole.focal_px);
                let at = camera.project(&UnitVec3::try_new([x, y, 1.0])?)?;
                Some([at.u, at.v])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::{Config, Model};

    fn camera(model: Model, focal_px: f64) -> Camera<f64> {
        Camera::try_new(&Config::ideal(model, 640, 480, focal_px)).unwrap()
    }

    #[test]
    fn there_and_back() {
        let camera = camera(Model::Equidistant, 280.0);
        let plane = Plane::Pinhole(Pinhole::new(&camera));
        for p in [[319.5, 239.5], [100.0, 200.0], [600.0, 450.0]] {
            let back = plane.to_camera(&camera, plane.to_shown(&camera, p).unwrap()).unwrap();
            assert!((back[0] - p[0]).abs() < 1e-6 && (back[1] - p[1]).abs() < 1e-6, "{p:?} {back:?}");
        }
    }

    #[test]
    fn straight_lines_become_straight() {
        let camera = camera(Model::Equidistant, 280.0);
        let plane = Plane::Pinhole(Pinhole::new(&camera));
        // These rays lie in one plane through the camera. They form a straight line for a pinhole and a curve for this
        // lens.
        let shown: Vec<Point> = [-0.6, 0.0, 0.6]
            .iter()
            .map(|&x| {
                let at = camera.project(&UnitVec3::try_new([x, 0.5, 1.0]).unwrap()).unwrap();
                plane.to_shown(&camera, [at.u, at.v]).unwrap()
            })
            .collect();
        assert!(shown.iter().all(|p| (p[1] - shown[0][1]).abs() < 1e-6), "{shown:?}");
    }

    #[test]
    fn a_pinhole_stays_what_it_is() {
        let camera = camera(Model::Pinhole, 500.0);
        let pinhole = Pinhole::new(&camera);
        assert!((pinhole.focal_px - 500.0).abs() < 1.0, "{pinhole:?}");
    }
}
