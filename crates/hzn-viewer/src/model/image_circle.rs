//! The image circle of the lens, and its editing with the mouse: the centre is the principal point, and the radius is
//! an angle off the optical axis.

use hzn_core::camera::{Camera, Config, Equation};

use super::view::Point;

/// Step of the search for an angle, degrees. The radius grows smoothly, so that a bisection ends the search.
const STEP_DEG: f64 = 0.25;
/// Limits of `camera.theta_max_deg`, degrees.
const LIMITS_DEG: [f64; 2] = [0.1, 175.0];

/// The part of the circle that is dragged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grip {
    /// The centre: the principal point.
    Centre,
    /// The rim: the largest angle off the optical axis.
    Rim,
}

/// Editing state: the part that is being dragged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CircleEdit {
    /// The part that is being dragged; `None` between two drags.
    pub grip: Option<Grip>,
}

/// An image circle in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, px.
    pub centre: Point,
    /// Semi-axes along x and y, px.
    pub radii: Point,
    /// True if sensor.toml has this circle and a part of it is in the picture; otherwise it is the largest one within
    /// the picture, to begin with.
    pub is_set: bool,
}

impl Circle {
    /// Returns the circle of a camera.
    pub fn new(config: &Config) -> Self {
        let centre = [config.cx_px, config.cy_px];
        let size = [f64::from(config.width), f64::from(config.height)];
        // Distances of the centre from the two borders on each axis, px.
        let gaps = [0, 1].map(|axis| [centre[axis] + 0.5, size[axis] - 0.5 - centre[axis]]);
        let farthest = gaps.map(|[a, b]| a.max(b));
        let corner = (farthest[0] / config.fx_px).hypot(farthest[1] / config.fy_px);
        let set = config.theta_max_deg.and_then(|deg| radius(&Equation::new(config), config, deg));
        let set = set.filter(|rho| *rho < corner);
        let inside = || {
            let nearest = gaps.map(|[a, b]| a.min(b));
            (nearest[0] / config.fx_px).min(nearest[1] / config.fy_px).max(0.0)
        };
        let rho = set.unwrap_or_else(inside);
        Self { centre, radii: [rho * config.fx_px, rho * config.fy_px], is_set: set.is_some() }
    }

    /// Returns the point of the rim in a direction from the centre, radians from x towards y.
    pub fn rim(&self, azimuth_rad: f64) -> Point {
        let (sin, cos) = azimuth_rad.sin_cos();
        [self.centre[0] + self.radii[0] * cos, self.centre[1] + self.radii[1] * sin]
    }

    /// Returns the part within `reach` pixels of a point.
    pub fn grip_at(&self, p: Point, reach: f64) -> Option<Grip> {
        let offset = [0, 1].map(|axis| p[axis] - self.centre[axis]);
        if offset[0].hypot(offset[1]) <= reach {
            return Some(Grip::Centre);
        }
        let azimuth = (offset[1] / self.radii[1].max(1e-9)).atan2(offset[0] / self.radii[0].max(1e-9));
        let rim = self.rim(azimuth);
        ((p[0] - rim[0]).hypot(p[1] - rim[1]) <= reach).then_some(Grip::Rim)
    }
}

/// Returns the radius of the picture of an angle off axis, in focal lengths. Tangential terms of the lens cancel, as in
/// the sensor.
fn radius(lens: &Equation, config: &Config, deg: f64) -> Option<f64> {
    let (sin, cos) = deg.to_radians().sin_cos();
    let column = |x: f64| Some(lens.project([x, 0.0, cos])?.point.u);
    Some((column(sin)? - column(-sin)?) / (2.0 * config.fx_px)).filter(|rho| rho.is_finite())
}

/// Returns the angle off axis whose circle goes through a point, in degrees: an angle that the sensor accepts. A point
/// beyond the largest one gives the largest one.
pub fn angle_deg(config: &Config, p: Point) -> Option<f64> {
    let wanted = ((p[0] - config.cx_px) / config.fx_px).hypot((p[1] - config.cy_px) / config.fy_px);
    let lens = Equation::new(config);
    let [mut low, mut high] = [LIMITS_DEG[0], LIMITS_DEG[0]];
    let mut last = radius(&lens, config, low)?;
    while last < wanted && high < LIMITS_DEG[1] {
        let next = (high + STEP_DEG).min(LIMITS_DEG[1]);
        // The lens ends where its radius no longer grows.
        let Some(rho) = radius(&lens, config, next).filter(|rho| *rho > last) else { break };
        (low, high, last) = (high, next, rho);
    }
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        match radius(&lens, config, middle) {
            Some(rho) if rho < wanted => low = middle,
            _ => high = middle,
        }
    }
    let found = if last < wanted { high } else { (low + high) / 2.0 };
    let accepted = |deg: &f64| is_accepted(&Config { theta_max_deg: Some(*deg), ..config.clone() });
    // The sensor needs a margin before the end of the lens.
    (0..40).map(|n| found - STEP_DEG * f64::from(n)).filter(|deg| *deg >= LIMITS_DEG[0]).find(accepted)
}

/// Returns the camera with another principal point; `None` if the sensor would refuse it.
pub fn moved(config: &Config, centre: Point) -> Option<Config> {
    let moved = Config { cx_px: centre[0], cy_px: centre[1], ..config.clone() };
    is_accepted(&moved).then_some(moved)
}

fn is_accepted(config: &Config) -> bool {
    Camera::<f64>::try_new(config).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::Model;

    fn cameras() -> Vec<Config> {
        let k = |k: &[f64]| k.iter().copied().collect();
        let ideal = |model, focal| Config::ideal(model, 640, 480, focal);
        vec![
            ideal(Model::Pinhole, 300.0),
            ideal(Model::Equidistant, 180.0),
            Config { k: k(&[-0.055, 0.011, -0.0035, 0.0002]), ..ideal(Model::KannalaBrandt, 250.0) },
            Config { k: k(&[-0.1, 0.01, 0.002, -0.001, 0.0]), fy_px: 505.0, ..ideal(Model::BrownConrady, 500.0) },
        ]
    }

    #[test]
    fn a_dragged_rim_lies_under_the_pointer_as_the_sensor_draws_it() {
        for mut config in cameras() {
            let pointer = [config.cx_px + 120.0, config.cy_px - 90.0];
            let deg = angle_deg(&config, pointer).unwrap();
            config.theta_max_deg = Some(deg);
            let circle = Circle::new(&config);
            let (centre, a, b) = Camera::<f64>::try_new(&config).unwrap().image_circle_px().unwrap();
            assert!((circle.radii[0] - a).abs() < 0.2 && (circle.radii[1] - b).abs() < 0.2, "{:?}", config.model);
            assert_eq!(circle.centre, [centre.u, centre.v]);
            assert_eq!(circle.grip_at(pointer, 0.3), Some(Grip::Rim), "{:?} {circle:?}", config.model);
        }
    }

    #[test]
    fn centre_rim_and_nothing_are_told_apart() {
        let circle = Circle { centre: [100.0, 80.0], radii: [60.0, 50.0], is_set: true };
        assert_eq!(circle.grip_at([103.0, 78.0], 6.0), Some(Grip::Centre));
        assert_eq!(circle.grip_at([100.0, 132.0], 6.0), Some(Grip::Rim));
        assert_eq!(circle.grip_at([130.0, 80.0], 6.0), None);
    }

    #[test]
    fn a_camera_without_a_circle_begins_with_the_largest_one_within_the_picture() {
        let mut config = Config::ideal(Model::Equidistant, 640, 480, 200.0);
        config.cx_px = 300.0;
        let circle = Circle::new(&config);
        assert!(!circle.is_set && (circle.radii[0] - 240.0).abs() < 1e-9, "{circle:?}");
        // A circle beyond the corners cannot be seen, so it cannot be grabbed either.
        config.theta_max_deg = Some(160.0);
        assert_eq!(Circle::new(&config), circle);
    }

    #[test]
    fn no_drag_makes_a_camera_that_is_refused() {
        // This lens ends at 58.6°; the corner of the picture is farther.
        let k = [-0.32].into_iter().collect();
        let config = Config { k, theta_max_deg: Some(40.0), ..Config::ideal(Model::KannalaBrandt, 640, 480, 250.0) };
        let deg = angle_deg(&config, [5000.0, 5000.0]).unwrap();
        assert!(deg > 50.0 && is_accepted(&Config { theta_max_deg: Some(deg), ..config.clone() }), "{deg}");
        assert!(angle_deg(&config, [config.cx_px, config.cy_px]).unwrap() < 0.2);
        assert!(moved(&config, [100.0, 200.0]).is_some());
        assert!(moved(&config, [1e9, 0.0]).is_none());
    }
}
