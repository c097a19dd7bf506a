//! Draws the limb of a cone in the picture.

use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, UnitVec3};

use crate::tangent::basis;

/// Number of steps around the cone in the search for the parts in view.
const STEPS: usize = 4096;

/// Returns the limb of a cone as lines in pixels. The cone has the axis `axis` (unit vector, camera frame) and this
/// half-angle. The lines are broken where the limb leaves the picture or the image circle.
pub fn lines(axis: [f64; 3], half_angle_rad: f64, camera: &Camera<f64>) -> Vec<Vec<[f64; 2]>> {
    lines_with_steps(axis, half_angle_rad, camera, STEPS)
}

/// Returns the same as [`lines`] with another number of steps around the cone. Fewer steps take less time; an arc of
/// less than two steps is not found.
pub fn lines_with_steps(axis: [f64; 3], half_angle_rad: f64, camera: &Camera<f64>, steps: usize) -> Vec<Vec<[f64; 2]>> {
    let (b1, b2) = basis(axis);
    let (sin, cos) = half_angle_rad.sin_cos();
    let ray = |angle_rad: f64| {
        let (s, c) = angle_rad.sin_cos();
        UnitVec3::try_new(std::array::from_fn(|i| cos * axis[i] + sin * (c * b1[i] + s * b2[i])))
    };
    along(ray, camera, steps)
}

/// Returns any closed limb as lines in pixels, as [`lines`]. `direction` gives its direction (camera frame) for an
/// angle about its axis in radians.
pub fn lines_along(direction: impl Fn(f64) -> Option<UnitVec3<Cam, f64>>, camera: &Camera<f64>) -> Vec<Vec<[f64; 2]>> {
    along(direction, camera, STEPS)
}

fn along(
    direction: impl Fn(f64) -> Option<UnitVec3<Cam, f64>>,
    camera: &Camera<f64>,
    steps: usize,
) -> Vec<Vec<[f64; 2]>> {
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    let point = |step: usize| -> Option<[f64; 2]> {
        let p = camera.project(&direction(step as f64 * std::f64::consts::TAU / steps as f64)?)?;
        // Half a pixel around the picture is included, because the edge of a line is still visible there.
        ((-1.0..=w).contains(&p.u) && (-1.0..=h).contains(&p.v)).then_some([p.u, p.v])
    };
    // The loop starts outside the picture, so that a line across the first step is not cut there.
    let start = (0..steps).find(|&i| point(i).is_none()).unwrap_or(0);
    let mut out = Vec::new();
    let mut line = Vec::new();
    for step in start..=start + steps {
        match point(step % steps) {
            Some(p) => line.push(p),
            None if line.len() > 1 => out.push(std::mem::take(&mut line)),
            None => line.clear(),
        }
    }
    if line.len() > 1 {
        out.push(line);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::{Config, Model};

    #[test]
    fn a_disc_is_closed_and_an_arc_is_one_line() {
        let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 640, 480, 500.0)).unwrap();
        let disc = lines([0.0, 0.0, 1.0], 0.1, &camera);
        assert_eq!(disc.len(), 1);
        assert_eq!(disc[0].first(), disc[0].last());
        let radius = |p: &[f64; 2]| (p[0] - 319.5).hypot(p[1] - 239.5);
        assert!(disc[0].iter().all(|p| (radius(p) - 500.0 * 0.1f64.tan()).abs() < 1e-9));
        // The half-angle is about 70 degrees, and the body is straight below the camera's horizon: one arc crosses the
        // picture.
        let down = 1.25f64;
        let arc = lines([0.0, down.sin(), down.cos()], 1.2, &camera);
        assert_eq!(arc.len(), 1, "{arc:?}");
        assert!(arc[0].len() > 20);
        assert!(lines([0.0, 0.0, -1.0], 0.3, &camera).is_empty());
    }
}
