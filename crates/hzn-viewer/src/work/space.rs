//! The scene of the view from space: the globe, the camera, what it sees and measures, and its path.

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_core::pixel::ImagePoint;
use hzn_files::FrameData;

use super::coast;

/// Distance between two parallels and two meridians, degrees.
const STEP_DEG: u32 = 30;
/// Points around a circle.
const AROUND: u32 = 90;
/// Rays of the cone from the camera to the limb.
const RAYS: u32 = 12;
/// Smallest angle of a drawn sigma cone, degrees. A narrower one would be a line, so it is drawn larger by a power of
/// ten, which the view tells.
const LEAST_SIGMA_DEG: f64 = 0.7;

/// What a line of the scene shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Parallels and meridians.
    Grid,
    /// Coastlines.
    Coast,
    /// The positions of all pictures, in order.
    Path,
    /// The borders of the picture, from the camera outwards.
    Frustum,
    /// The cone of the measured half-angle.
    Cone,
    /// The measured axis.
    Axis,
    /// The cone of 3 sigma around the measured axis.
    Sigma,
}

/// A line of the scene. Its points are km in the axes of the body; without a position they have the unit of the scene's
/// `reach`, in the axes of the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// What it shows.
    pub kind: Kind,
    /// Its points.
    pub points: Vec<[f64; 3]>,
}

/// The scene of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// All lines.
    pub lines: Vec<Line>,
    /// Where the camera is.
    pub camera: Option<[f64; 3]>,
    /// Radius of the globe; `None` without a globe.
    pub globe: Option<f64>,
    /// Distance of the farthest point from the middle.
    pub reach: f64,
    /// How far the cone is drawn: the distance of the limb.
    pub sight: f64,
    /// By how much the cone of 3 sigma is drawn larger.
    pub sigma_times: f64,
    /// What the view lacks, in words.
    pub missing: Option<&'static str>,
}

/// Returns the scene of a picture. `figure_km` are the semi-axes of the body, `path_km` the positions of all pictures.
pub fn scene(
    data: Option<&FrameData>,
    figure_km: Option<[f64; 3]>,
    is_earth: bool,
    camera: Option<&Camera<f64>>,
    solution: Option<&Solution<f64>>,
    path_km: Vec<[f64; 3]>,
) -> Scene {
    let position = data.and_then(|d| d.position_km);
    let attitude = data.and_then(|d| Rotation::<Cam, Fixed, f64>::assume_from_quaternion(d.q_fixed_from_camera_wxyz?));
    let mut scene = Scene {
        lines: Vec::new(),
        camera: position,
        globe: None,
        reach: 1.0,
        sight: 1.0,
        sigma_times: 1.0,
        missing: None,
    };
    let Some((p, figure_km)) = position.zip(figure_km) else {
        scene.missing = Some("There is no position (x_km, y_km, z_km in frames.csv): this is the view of the camera.");
        scene.camera = Some([0.0; 3]);
        scene.add_camera([0.0; 3], 0.8, camera, solution, |d| d);
        return scene;
    };
    let radius = figure_km[0].max(figure_km[2]);
    scene.globe = Some(radius);
    scene.reach = path_km.iter().chain([&p]).map(|x| length(*x)).fold(radius, f64::max);
    scene.add_globe(figure_km, is_earth);
    scene.lines.push(Line { kind: Kind::Path, points: path_km });
    match attitude {
        // The limb is this far away.
        Some(turn) => {
            let far = (length(p).powi(2) - radius * radius).max(0.0).sqrt();
            let turned = |d: [f64; 3]| UnitVec3::try_new(d).map_or(d, |d| turn.apply(&d).xyz());
            scene.sight = far.max(0.02 * radius);
            scene.add_camera(p, scene.sight, camera, solution, turned);
        }
        None => {
            scene.sight = scene.reach;
            scene.missing =
                Some("There is no attitude (qw, qx, qy, qz in frames.csv), so the camera's directions are not known.");
        }
    }
    scene
}

impl Scene {
    fn add(&mut self, kind: Kind, points: impl Iterator<Item = [f64; 3]>) {
        self.lines.push(Line { kind, points: points.collect() });
    }

    fn add_globe(&mut self, figure_km: [f64; 3], is_earth: bool) {
        let at = |lat_deg: f64, lon_deg: f64| {
            let ((sl, cl), (so, co)) = (lat_deg.to_radians().sin_cos(), lon_deg.to_radians().sin_cos());
            // The latitude of the parameter differs from that of the normal by up to 0.2°, which is not seen here.
            [figure_km[0] * cl * co, figure_km[1] * cl * so, figure_km[2] * sl]
        };
        let part = |n: u32| 360.0 * f64::from(n) / f64::from(AROUND);
        for lat in (STEP_DEG..180).step_by(STEP_DEG as usize) {
            self.add(Kind::Grid, (0..=AROUND).map(|n| at(f64::from(lat) - 90.0, part(n))));
        }
        for lon in (0..180).step_by(STEP_DEG as usize) {
            self.add(Kind::Grid, (0..=AROUND).map(|n| at(part(n), f64::from(lon))));
        }
        if is_earth {
            for line in coast::lines() {
                self.add(Kind::Coast, line.into_iter().map(|[lat, lon]| at(lat, lon)));
            }
        }
    }

    /// Adds the picture's border and what is measured in it, as far as `far`. `turn` turns directions of the camera.
    fn add_camera(
        &mut self,
        from: [f64; 3],
        far: f64,
        camera: Option<&Camera<f64>>,
        solution: Option<&Solution<f64>>,
        turn: impl Fn([f64; 3]) -> [f64; 3],
    ) {
        let along = |d: [f64; 3], by: f64| {
            let d = turn(d);
            [0, 1, 2].map(|i| from[i] + by * d[i])
        };
        if let Some(camera) = camera {
            let corners: Vec<[f64; 3]> = corners(camera).map(|d| along(d, 0.6 * far)).collect();
            for corner in &corners {
                self.add(Kind::Frustum, [from, *corner].into_iter());
            }
            let closed = corners.iter().chain(corners.first()).copied();
            self.add(Kind::Frustum, closed);
        }
        let Some(s) = solution else { return };
        let (axis, half_angle_rad) = (s.axis.xyz(), s.fused_half_angle_rad);
        let rim: Vec<[f64; 3]> = around(axis, half_angle_rad).map(|d| along(d, far)).collect();
        for point in rim.iter().step_by((AROUND / RAYS) as usize) {
            self.add(Kind::Cone, [from, *point].into_iter());
        }
        self.add(Kind::Cone, rim.into_iter());
        self.add(Kind::Axis, [from, along(axis, far)].into_iter());
        let sigma_deg = 3.0 * s.covariance.sigma_max_rad().to_degrees();
        if !(sigma_deg > 0.0 && sigma_deg.is_finite()) {
            return;
        }
        self.sigma_times = 10f64.powf((LEAST_SIGMA_DEG / sigma_deg).log10().ceil().max(0.0));
        let drawn = (sigma_deg * self.sigma_times).min(89.0).to_radians();
        let rim: Vec<[f64; 3]> = around(axis, drawn).map(|d| along(d, far)).collect();
        for point in rim.iter().step_by((AROUND / 4) as usize) {
            self.add(Kind::Sigma, [from, *point].into_iter());
        }
        self.add(Kind::Sigma, rim.into_iter());
    }
}

/// Returns the directions of the picture's corners. A corner outside of the image circle is moved towards the middle.
fn corners(camera: &Camera<f64>) -> impl Iterator<Item = [f64; 3]> {
    let [w, h] = [camera.width(), camera.height()].map(|x| f64::from(x) - 0.5);
    let middle = camera.principal_point();
    let corner = move |[u, v]: [f64; 2]| {
        (0..20).find_map(|n| {
            let part = 1.0 - f64::from(n) / 20.0;
            let p = ImagePoint { u: middle.u + part * (u - middle.u), v: middle.v + part * (v - middle.v) };
            camera.unproject(p).map(|d| d.xyz())
        })
    };
    [[-0.5, -0.5], [w, -0.5], [w, h], [-0.5, h]].into_iter().filter_map(corner)
}

/// Returns directions around a cone, the first one again at the end.
fn around(axis: [f64; 3], half_angle_rad: f64) -> impl Iterator<Item = [f64; 3]> {
    let [x, y, z] = axis;
    // A vector perpendicular to the axis, and one perpendicular to both.
    let first = if x.abs() < 0.7 { [0.0, z, -y] } else { [-z, 0.0, x] };
    let a = first.map(|v| v / length(first));
    let b = [y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]];
    let (sin, cos) = half_angle_rad.sin_cos();
    (0..=AROUND).map(move |n| {
        let (s, c) = (std::f64::consts::TAU * f64::from(n) / f64::from(AROUND)).sin_cos();
        [0, 1, 2].map(|i| cos * axis[i] + sin * (c * a[i] + s * b[i]))
    })
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use hzn_core::body::Kind as Body;
    use hzn_core::camera::{Config, Model};

    use super::*;
    use crate::work::answers::answer;

    const FIGURE_KM: [f64; 3] = [6378.137, 6378.137, 6356.752];

    fn camera() -> Camera<f64> {
        Camera::try_new(&Config::ideal(Model::Pinhole, 640, 480, 500.0)).unwrap()
    }

    /// The camera is on the x axis and looks down: its optical axis is -x.
    fn data(km: f64) -> FrameData {
        FrameData {
            position_km: Some([km, 0.0, 0.0]),
            q_fixed_from_camera_wxyz: Some([0.5, -0.5, -0.5, 0.5]),
            ..FrameData::default()
        }
    }

    fn of(scene: &Scene, kind: Kind) -> Vec<&Line> {
        scene.lines.iter().filter(|line| line.kind == kind).collect()
    }

    #[test]
    fn the_cone_of_a_right_answer_touches_the_globe_and_its_axis_leads_to_the_centre() {
        let half_angle = (FIGURE_KM[0] / 7378.137).asin();
        let body = answer(Body::EarthSphere, [0.0, 0.0, 1.0], half_angle, 1000.0);
        let path = vec![[7378.137, -300.0, 0.0], [7378.137, 0.0, 0.0]];
        let scene = scene(Some(&data(7378.137)), Some(FIGURE_KM), true, Some(&camera()), body.solution(), path.clone());
        assert_eq!(scene.missing, None);
        assert_eq!(of(&scene, Kind::Path)[0].points, path);
        let rim = of(&scene, Kind::Cone).into_iter().max_by_key(|line| line.points.len()).unwrap();
        // The rim is a circle on the sphere of the equator's radius.
        assert!(rim.points.iter().all(|p| (length(*p) - FIGURE_KM[0]).abs() < 1.0), "{rim:?}");
        let [from, to] = of(&scene, Kind::Axis)[0].points[..] else { panic!("the axis is one segment") };
        assert_eq!(from, path[1]);
        assert!(to[0] < from[0] && to[1].abs() < 1e-6 && to[2].abs() < 1e-6, "{to:?}");
        assert!(!of(&scene, Kind::Coast).is_empty());
        assert_eq!(of(&scene, Kind::Frustum).len(), 5, "four edges and the border");
        // Each corner has the angle of the lens from the axis of the camera.
        let corner = of(&scene, Kind::Frustum)[0].points[1];
        let across = corner[1].hypot(corner[2]) / (from[0] - corner[0]);
        assert!((across - 320f64.hypot(240.0) / 500.0).abs() < 1e-6, "{across}");
    }

    #[test]
    fn a_narrow_sigma_is_drawn_larger_and_its_factor_is_a_power_of_ten() {
        let body = answer(Body::EarthSphere, [0.0, 0.0, 1.0], 1.0, 1000.0);
        let scene = scene(Some(&data(7378.137)), Some(FIGURE_KM), false, None, body.solution(), Vec::new());
        let s = body.solution().unwrap();
        let sigma_deg = 3.0 * s.covariance.sigma_max_rad().to_degrees() * scene.sigma_times;
        assert!((0.7..7.0).contains(&sigma_deg) && scene.sigma_times.log10().fract().abs() < 1e-9, "{sigma_deg}");
        let rim = of(&scene, Kind::Sigma).into_iter().max_by_key(|line| line.points.len()).unwrap();
        let axis = of(&scene, Kind::Axis)[0].points[1];
        let from = scene.camera.unwrap();
        let to = |p: [f64; 3]| [0, 1, 2].map(|i| p[i] - from[i]);
        let cos = to(rim.points[0]).iter().zip(to(axis)).map(|(a, b)| a * b).sum::<f64>()
            / (length(to(rim.points[0])) * length(to(axis)));
        assert!((cos.acos().to_degrees() - sigma_deg).abs() < 1e-6);
        assert!(of(&scene, Kind::Coast).is_empty(), "the body is not the Earth");
    }

    #[test]
    fn what_is_not_known_is_named() {
        let body = answer(Body::EarthSphere, [0.0, 0.0, 1.0], 1.0, 1000.0);
        let none = scene(None, Some(FIGURE_KM), true, Some(&camera()), body.solution(), Vec::new());
        assert!(none.globe.is_none() && none.missing.is_some_and(|words| words.contains("x_km")));
        assert!(!of(&none, Kind::Cone).is_empty(), "the cone is known in the camera");
        let turned = FrameData { q_fixed_from_camera_wxyz: None, ..data(7000.0) };
        let without = scene(Some(&turned), Some(FIGURE_KM), true, Some(&camera()), body.solution(), Vec::new());
        assert!(without.missing.is_some_and(|words| words.contains("qw")) && without.globe.is_some());
        assert!(of(&without, Kind::Cone).is_empty());
    }
}
