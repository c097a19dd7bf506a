//! The truth about a scene.

mod ellipsoid;
mod in_view;
mod scene;

pub use in_view::{LIMB_IN_VIEW_PX, OUTLINE_SHARE, SIDE_SHARE};

#[cfg(test)]
mod tests {
    use crate::pose::{Look, Pose, position_m};
    use crate::scene::{Light, Scene};
    use hzn_core::camera::{Config, Model};

    fn scene(look: Look) -> Scene {
        Scene::new(Config::ideal(Model::Pinhole, 640, 480, 400.0), Pose::looking(position_m(0.0, 0.0, 200.0), look))
    }

    #[test]
    fn straight_down_at_the_equator() {
        let t = scene(Look::off_nadir(0.0, 0.0, 0.0)).truth("a.png", 1.5).unwrap();
        assert!((t.axis_z - 1.0).abs() < 1e-12 && (t.altitude_km - 200.0).abs() < 1e-6);
        assert_eq!((t.limb, t.body.as_str(), t.file.as_str(), t.time_s), (0, "earth", "a.png", 1.5));
        // sin α = (R + 17 km)/(R + 200 km). The radius R lies between the two radii of curvature of the ellipsoid.
        let alpha = |r: f64| ((r + 17.0) / (r + 200.0)).asin().to_degrees();
        assert!(t.half_angle_deg > alpha(6330.0) && t.half_angle_deg < alpha(6380.0));
    }

    #[test]
    fn level_camera_sees_the_limb_and_the_axis_below() {
        let t = scene(Look { depression_rad: 0.2, ..Look::default() }).truth("", 0.0).unwrap();
        assert!(t.has_limb() && t.axis_y > 0.97 && t.axis_z > 0.19 && t.sun_x.is_none());
        // A camera that looks up sees no limb.
        assert!(!scene(Look { depression_rad: -0.8, ..Look::default() }).truth("", 0.0).unwrap().has_limb());
    }

    #[test]
    fn an_unlit_limb_does_not_count() {
        let mut s = scene(Look { depression_rad: 0.2, ..Look::default() });
        s.light = Light::Sun { direction: [-1.0, 0.0, 0.0], twilight_rad: 0.1 };
        let t = s.truth("", 0.0).unwrap();
        assert!(!t.has_limb() && t.sun_y.is_some_and(|y| y > 0.97));
    }
}
