//! Where the camera looks: latitudes and longitudes of the body below, and the local vertical.

use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_files::FrameData;
use hzn_run::overlay::limb;

use crate::model::view::Point;

/// Distances between the lines that can be chosen, degrees.
const STEPS_DEG: [f64; 8] = [0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0];
/// Wanted number of lines from the point below the camera to the limb.
const LINES: f64 = 4.0;
/// Number of points from one line to the next. The curves between them are straight to a hundredth of a pixel.
const FINE: usize = 24;
/// Room around the picture in pixels within which points are kept, so that lines reach its border.
const ROOM_PX: f64 = 20.0;
/// Steps of the ladder, degrees.
const RUNG_DEG: i32 = 10;
/// Points around a rung.
const RUNG_POINTS: usize = 1440;

/// A line over the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedLine {
    /// Its name, for example `40° N`.
    pub name: String,
    /// Its value in degrees: north and east are positive.
    pub value_deg: f64,
    /// Its parts in the picture, in pixels.
    pub parts: Vec<Vec<Point>>,
}

/// Latitudes and longitudes on the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Lines of one latitude.
    pub parallels: Vec<NamedLine>,
    /// Lines of one longitude.
    pub meridians: Vec<NamedLine>,
    /// Latitude (along the normal of the surface) and longitude of the point below the camera, degrees.
    pub below_deg: [f64; 2],
    /// Coastlines, if the body has them.
    pub coasts: Vec<Vec<Point>>,
}

/// The local vertical at the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertical {
    /// Place of the nadir, if it is in the picture.
    pub nadir: Option<Point>,
    /// Rungs: lines of one elevation above the local horizontal plane.
    pub rungs: Vec<NamedLine>,
    /// The vertical plane through the optical axis.
    pub plane: Vec<Vec<Point>>,
    /// Elevation of the optical axis above the horizontal plane, degrees.
    pub elevation_deg: f64,
    /// Angle by which the camera is turned about its optical axis, clockwise as seen from behind it, degrees; `None` if
    /// the optical axis is vertical.
    pub roll_deg: Option<f64>,
    /// The vertical comes from the measured axis, because no attitude is given.
    pub is_measured: bool,
}

/// Position of the camera and its attitude, in the axes of the body.
pub(super) struct Pose {
    position_km: [f64; 3],
    camera_from_fixed: Rotation<Fixed, Cam, f64>,
    figure_km: [f64; 3],
}

impl Pose {
    pub(super) fn new(data: &FrameData, figure_km: [f64; 3]) -> Option<Self> {
        let camera_from_fixed =
            Rotation::<Cam, Fixed, f64>::assume_from_quaternion(data.q_fixed_from_camera_wxyz?)?.inverse();
        Some(Self { position_km: data.position_km?, camera_from_fixed, figure_km })
    }

    /// Returns the normal of the surface below the camera, which points up.
    fn up(&self) -> Option<[f64; 3]> {
        let Self { position_km: p, figure_km: a, .. } = self;
        // The foot is p·a² / (a² + t). Its distance from the surface falls with t and is convex, so that Newton's
        // method from t = 0 never overshoots.
        let scaled = |i: usize, t: f64| a[i] * p[i] / (a[i] * a[i] + t);
        let mut t = 0.0;
        for _ in 0..60 {
            let value: f64 = (0..3).map(|i| scaled(i, t).powi(2)).sum::<f64>() - 1.0;
            let slope: f64 = (0..3).map(|i| -2.0 * scaled(i, t).powi(2) / (a[i] * a[i] + t)).sum();
            if value <= 1e-13 {
                break;
            }
            t -= value / slope;
        }
        let is_outside = t > 0.0 && t.is_finite();
        is_outside.then(|| unit(std::array::from_fn(|i| p[i] / (a[i] * a[i] + t)))).flatten()
    }

    /// Returns the point of the surface whose normal has this latitude and longitude, and the normal.
    fn surface(&self, lat_rad: f64, lon_rad: f64) -> ([f64; 3], [f64; 3]) {
        let ((sl, cl), (so, co)) = (lat_rad.sin_cos(), lon_rad.sin_cos());
        let normal = [cl * co, cl * so, sl];
        let scale = (0..3).map(|i| (self.figure_km[i] * normal[i]).powi(2)).sum::<f64>().sqrt();
        (std::array::from_fn(|i| self.figure_km[i].powi(2) * normal[i] / scale), normal)
    }

    /// Returns the place of a point of the surface in the picture, if the camera sees it.
    pub(super) fn project(&self, lat_rad: f64, lon_rad: f64, camera: &Camera<f64>) -> Option<Point> {
        let (point, normal) = self.surface(lat_rad, lon_rad);
        let to_point: [f64; 3] = std::array::from_fn(|i| point[i] - self.position_km[i]);
        if dot(to_point, normal) >= 0.0 {
            return None;
        }
        let seen = self.camera_from_fixed.apply(&UnitVec3::try_new(to_point)?);
        let p = camera.project(&seen)?;
        let is_near = |x: f64, size: u16| (-ROOM_PX..f64::from(size) + ROOM_PX).contains(&x);
        (is_near(p.u, camera.width()) && is_near(p.v, camera.height())).then_some([p.u, p.v])
    }
}

/// Returns the grid of a picture whose position and attitude are given; `None` without them. `figure_km` are the
/// semi-axes of the body.
pub fn grid(data: &FrameData, figure_km: [f64; 3], camera: &Camera<f64>) -> Option<Grid> {
    let pose = Pose::new(data, figure_km)?;
    let up = pose.up()?;
    let (lat, lon) = (up[2].asin().to_degrees(), up[1].atan2(up[0]).to_degrees());
    // The limb is this far from the point below the camera, with some room for the flattening.
    let range = pose.position_km.iter().map(|x| x * x).sum::<f64>().sqrt();
    let cap_deg = (figure_km[0].max(figure_km[2]) / range).min(1.0).acos().to_degrees() + 1.5;
    let step = STEPS_DEG.into_iter().find(|step| step * LINES >= cap_deg).unwrap_or(30.0);
    let fine = step / FINE as f64;
    let south = ((lat - cap_deg) / step).ceil().max(-90.0 / step) as i64;
    let north = ((lat + cap_deg) / step).floor().min(90.0 / step) as i64;
    // Near a pole all meridians are in view.
    let widest = if lat.abs() + cap_deg < 85.0 {
        (cap_deg.to_radians().sin() / lat.to_radians().cos()).min(1.0).asin().to_degrees()
    } else {
        180.0
    };
    let (west, east) = if cap_deg >= 80.0 || widest > 170.0 {
        ((-180.0 / step) as i64 + 1, (180.0 / step) as i64)
    } else {
        (((lon - widest) / step).ceil() as i64, ((lon + widest) / step).floor() as i64)
    };
    let along = |from: f64, to: f64, point: &dyn Fn(f64) -> Option<Point>| {
        let count = ((to - from) / fine).ceil().max(1.0) as usize;
        parts((0..=count).map(|i| point((from + (to - from) * i as f64 / count as f64).to_radians())))
    };
    let (west_deg, east_deg) = (lon - widest, lon + widest);
    let parallel = |n: i64| {
        let value_deg = n as f64 * step;
        let point = |lon_rad: f64| pose.project(value_deg.to_radians(), lon_rad, camera);
        NamedLine { name: degrees(value_deg, ["S", "N"]), value_deg, parts: along(west_deg, east_deg, &point) }
    };
    let meridian = |n: i64| {
        let value_deg = (n as f64 * step + 180.0).rem_euclid(360.0) - 180.0;
        let point = |lat_rad: f64| pose.project(lat_rad, value_deg.to_radians(), camera);
        let (from, to) = ((lat - cap_deg).max(-90.0), (lat + cap_deg).min(90.0));
        NamedLine { name: degrees(value_deg, ["W", "E"]), value_deg, parts: along(from, to, &point) }
    };
    let seen = |line: &NamedLine| !line.parts.is_empty();
    Some(Grid {
        // The poles are points.
        parallels: (south..=north).filter(|n| (*n as f64 * step).abs() < 90.0).map(parallel).filter(seen).collect(),
        meridians: (west..=east).map(meridian).filter(seen).collect(),
        below_deg: [lat, lon],
        coasts: Vec::new(),
    })
}

/// Returns the local vertical of a picture: from the given position and attitude, or else from the measured axis, which
/// points to the centre of the body.
pub fn vertical(
    data: Option<&FrameData>,
    figure_km: Option<[f64; 3]>,
    axis: Option<[f64; 3]>,
    camera: &Camera<f64>,
) -> Option<Vertical> {
    let given = || {
        let pose = Pose::new(data?, figure_km?)?;
        let down = UnitVec3::try_new(pose.up()?.map(|x| -x))?;
        Some(pose.camera_from_fixed.apply(&down).xyz())
    };
    let given = given();
    let down = given.or(axis)?;
    let [x, y, z] = down;
    let project = |direction: [f64; 3]| {
        let p = camera.project(&UnitVec3::try_new(direction)?)?;
        let is_inside = |x: f64, size: u16| (-0.5..f64::from(size) - 0.5).contains(&x);
        (is_inside(p.u, camera.width()) && is_inside(p.v, camera.height())).then_some([p.u, p.v])
    };
    let rung = |elevation: i32| NamedLine {
        name: format!("{elevation}°"),
        value_deg: elevation.into(),
        parts: limb::lines_with_steps(down, f64::from(90 + elevation).to_radians(), camera, RUNG_POINTS),
    };
    let rungs = (-80..=80).step_by(RUNG_DEG as usize).map(rung).filter(|line| !line.parts.is_empty());
    let tilt = x.hypot(y);
    let across = (tilt > 1e-6).then(|| [x / tilt, y / tilt]);
    let plane = across.map_or_else(Vec::new, |[a, b]| {
        let direction = |angle: f64| UnitVec3::try_new([angle.sin() * a, angle.sin() * b, angle.cos()]);
        limb::lines_along(direction, camera)
    });
    Some(Vertical {
        nadir: project(down),
        rungs: rungs.collect(),
        plane,
        elevation_deg: -z.clamp(-1.0, 1.0).asin().to_degrees(),
        // The y axis of the picture points down. A camera that is turned clockwise sees the ground turned
        // anticlockwise.
        roll_deg: across.map(|[a, b]| a.atan2(b).to_degrees()),
        is_measured: given.is_none(),
    })
}

/// Returns the parts of a line: it is broken where a point is not in view.
pub(super) fn parts(points: impl Iterator<Item = Option<Point>>) -> Vec<Vec<Point>> {
    let mut parts = vec![Vec::new()];
    for point in points {
        match (point, parts.last_mut()) {
            (Some(point), Some(part)) => part.push(point),
            _ => parts.push(Vec::new()),
        }
    }
    parts.retain(|part| part.len() > 1);
    parts
}

/// Returns an angle with its letter, for example `40° N`.
fn degrees(value_deg: f64, [negative, positive]: [&str; 2]) -> String {
    let letter = match value_deg {
        v if v == 0.0 || v == -180.0 => "",
        v if v < 0.0 => negative,
        _ => positive,
    };
    format!("{}° {letter}", value_deg.abs()).trim_end().to_owned()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    Some(UnitVec3::<Fixed, f64>::try_new(v)?.xyz())
}

#[cfg(test)]
mod tests {
    use hzn_core::camera::{Config, Model};
    use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic};
    use hzn_core::pixel::ImagePoint;

    use super::*;

    const EARTH_KM: [f64; 3] = [WGS84_A_M / 1e3, WGS84_A_M / 1e3, WGS84_B_M / 1e3];

    fn camera() -> Camera<f64> {
        Camera::try_new(&Config::ideal(Model::Pinhole, 640, 480, 400.0)).unwrap()
    }

    /// Returns the data of a camera at a place, turned at random.
    fn data(lat_deg: f64, lon_deg: f64, altitude_km: f64, q: [f64; 4]) -> FrameData {
        let [lat, lon] = [lat_deg, lon_deg].map(f64::to_radians);
        let position_m = from_geodetic(lat, lon, altitude_km * 1e3, WGS84_A_M, WGS84_B_M);
        FrameData {
            position_km: Some(position_m.map(|x| x / 1e3)),
            q_fixed_from_camera_wxyz: Some(q),
            ..FrameData::default()
        }
    }

    /// Returns the quaternion of a camera that looks down, with the top of its picture to the north.
    fn looking_down(lat_deg: f64, lon_deg: f64) -> [f64; 4] {
        let ((sl, cl), (so, co)) = (lat_deg.to_radians().sin_cos(), lon_deg.to_radians().sin_cos());
        // The columns are x (east), y (south) and z (down).
        let (x, y, z) = ([-so, co, 0.0], [sl * co, sl * so, -cl], [-cl * co, -cl * so, -sl]);
        let w = (1.0 + x[0] + y[1] + z[2]).max(0.0).sqrt() / 2.0;
        if w > 0.1 {
            return [w, (y[2] - z[1]) / (4.0 * w), (z[0] - x[2]) / (4.0 * w), (x[1] - y[0]) / (4.0 * w)];
        }
        let a = (1.0 + x[0] - y[1] - z[2]).max(0.0).sqrt() / 2.0;
        [(y[2] - z[1]) / (4.0 * a), a, (y[0] + x[1]) / (4.0 * a), (z[0] + x[2]) / (4.0 * a)]
    }

    #[test]
    fn the_point_below_is_the_nadir() {
        for (lat, lon, km) in [(0.3, 12.0, 230.0), (48.2, -170.0, 700.0), (-89.2, 30.0, 400.0), (51.0, 0.0, 36_000.0)] {
            let data = data(lat, lon, km, looking_down(lat, lon));
            let grid = grid(&data, EARTH_KM, &camera()).unwrap();
            assert!((grid.below_deg[0] - lat).abs() < 1e-9 && (grid.below_deg[1] - lon).abs() < 1e-7, "{grid:?}");
            let level = vertical(Some(&data), Some(EARTH_KM), None, &camera()).unwrap();
            let [u, v] = level.nadir.unwrap();
            assert!((u - 319.5).abs() < 1e-4 && (v - 239.5).abs() < 1e-4, "{u} {v}");
            assert!((level.elevation_deg + 90.0).abs() < 1e-4 && !level.is_measured);
        }
    }

    #[test]
    fn every_point_of_the_grid_has_its_latitude_or_longitude() {
        // The rays of the points are intersected with the Earth, which the grid does not do.
        let camera = camera();
        let mut looked_at = 0;
        let poses: [(f64, f64, f64, [f64; 4]); 4] = [
            (10.0, 20.0, 230.0, [0.3, 0.8, -0.2, 0.4]),
            (78.0, -110.0, 500.0, [0.1, 0.9, 0.3, -0.3]),
            (-35.0, 179.0, 1200.0, [0.7, -0.1, 0.6, 0.2]),
            (5.0, -60.0, 36_000.0, looking_down(5.0, -60.0)),
        ];
        for (lat, lon, km, q) in poses {
            // Towards the ground, and then turned a little.
            let down = looking_down(lat, lon);
            let tilted = if km > 1e4 { q } else { turned(down, [1.0, q[1] * 0.4, q[2] * 0.4, q[3]]) };
            let data = data(lat, lon, km, tilted);
            let grid = grid(&data, EARTH_KM, &camera).unwrap();
            let lines = [grid.parallels.len(), grid.meridians.len()];
            assert!(lines.iter().all(|n| *n >= 1) && lines.iter().sum::<usize>() >= 4, "{lat} {lon}: {lines:?}");
            let fixed = Rotation::<Cam, Fixed, f64>::assume_from_quaternion(tilted).unwrap();
            let lines = grid.parallels.iter().map(|l| (l, true)).chain(grid.meridians.iter().map(|l| (l, false)));
            for (line, is_parallel) in lines {
                for point in line.parts.iter().flatten() {
                    let Some(ray) = camera.unproject(ImagePoint { u: point[0], v: point[1] }) else { continue };
                    let Some(hit) = hit(data.position_km.unwrap(), fixed.apply(&ray).xyz()) else { continue };
                    let (_, lat_rad) = hzn_core::ellipsoid::geodetic(hit.map(|x| x * 1e3), WGS84_A_M, WGS84_B_M);
                    let lon_deg = hit[1].atan2(hit[0]).to_degrees();
                    // A pole has every longitude.
                    if !is_parallel && lat_rad.abs() > 1.57 {
                        continue;
                    }
                    let off =
                        if is_parallel { lat_rad.to_degrees() - line.value_deg } else { lon_deg - line.value_deg };
                    let off = (off + 180.0).rem_euclid(360.0) - 180.0;
                    assert!(off.abs() < 2e-3, "{} {off}", line.name);
                    looked_at += 1;
                }
            }
        }
        assert!(looked_at > 1000, "{looked_at}");
    }

    /// Returns the product of two quaternions.
    fn turned([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 4] {
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ]
    }

    /// Returns the nearer point in which a ray meets the Earth, km.
    fn hit(from_km: [f64; 3], ray: [f64; 3]) -> Option<[f64; 3]> {
        let scaled = |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| v[i] / EARTH_KM[i]) };
        let (p, d) = (scaled(from_km), scaled(ray));
        let (a, b, c) = (dot(d, d), dot(p, d), dot(p, p) - 1.0);
        let root = b * b - a * c;
        (root > 0.0).then(|| {
            let t = (-b - root.sqrt()) / a;
            std::array::from_fn(|i| from_km[i] + t * ray[i])
        })
    }

    #[test]
    fn the_grid_lies_where_the_simulator_puts_the_ground() {
        // Poses, lens and rays are those of the simulator. The rays are intersected with the Earth, and the place that
        // they hit is compared with the name of the line.
        let flight = hzn_sim::flight::rocket(960, 540, 9, 7705);
        let (mut most_px, mut looked_at) = (0.0f64, 0);
        for frame in &flight.frames {
            let pose = frame.scene.pose;
            let camera = Camera::<f64>::try_new(&flight.sensor.camera).unwrap();
            let data = FrameData {
                position_km: Some(pose.position_m.map(|x| x / 1e3)),
                q_fixed_from_camera_wxyz: Some(pose.q_fixed_from_camera_wxyz),
                ..FrameData::default()
            };
            let grid = grid(&data, EARTH_KM, &camera).unwrap();
            let fixed = pose.fixed_from_camera().unwrap();
            let own = Pose::new(&data, EARTH_KM).unwrap();
            let lines = grid.parallels.iter().map(|l| (l, true)).chain(grid.meridians.iter().map(|l| (l, false)));
            for (line, is_parallel) in lines {
                for point in line.parts.iter().flatten() {
                    let Some(ray) = camera.unproject(ImagePoint { u: point[0], v: point[1] }) else { continue };
                    let Some(hit) = hit(data.position_km.unwrap(), fixed.apply(&ray).xyz()) else { continue };
                    let (_, lat) = hzn_core::ellipsoid::geodetic(hit.map(|x| x * 1e3), WGS84_A_M, WGS84_B_M);
                    let lon = hit[1].atan2(hit[0]);
                    let value = line.value_deg.to_radians();
                    let (lat, lon) = if is_parallel { (value, lon) } else { (lat, value) };
                    let Some([u, v]) = own.project(lat, lon, &camera) else { continue };
                    most_px = most_px.max((u - point[0]).hypot(v - point[1]));
                    looked_at += 1;
                }
            }
        }
        println!("{looked_at} points of the grid, at most {most_px:.2e} px from the simulator's ground");
        assert!(looked_at > 500 && most_px < 1.0, "{looked_at} {most_px}");
    }

    #[test]
    fn the_ladder_has_the_angles_of_the_optical_axis() {
        for (azimuth, depression, roll) in [(0.3, 0.5, 0.4), (-2.0, -0.2, -1.1), (1.0, 1.2, 3.0)] {
            let look = hzn_sim::Look { azimuth_rad: azimuth, depression_rad: depression, roll_rad: roll };
            let pose = hzn_sim::Pose::looking(hzn_sim::pose::position_m(47.0, 15.0, 220.0), look);
            let data = FrameData {
                position_km: Some(pose.position_m.map(|x| x / 1e3)),
                q_fixed_from_camera_wxyz: Some(pose.q_fixed_from_camera_wxyz),
                ..FrameData::default()
            };
            let level = vertical(Some(&data), Some(EARTH_KM), None, &camera()).unwrap();
            assert!((level.elevation_deg + depression.to_degrees()).abs() < 1e-6, "{level:?}");
            assert!((level.roll_deg.unwrap() - roll.to_degrees()).abs() < 1e-6, "{:?}", level.roll_deg);
        }
    }

    #[test]
    fn without_an_attitude_the_measured_axis_gives_the_vertical() {
        let (tilt, roll) = (60f64.to_radians(), 25f64.to_radians());
        let axis = [tilt.sin() * roll.sin(), tilt.sin() * roll.cos(), tilt.cos()];
        let level = vertical(None, None, Some(axis), &camera()).unwrap();
        assert!((level.elevation_deg + 30.0).abs() < 1e-9 && (level.roll_deg.unwrap() - 25.0).abs() < 1e-9);
        assert!(level.is_measured && level.nadir.is_none() && !level.plane.is_empty());
        let names: Vec<&str> = level.rungs.iter().map(|line| line.name.as_str()).collect();
        assert!(names.contains(&"-30°") && names.contains(&"-10°") && !names.contains(&"80°"), "{names:?}");
        for rung in &level.rungs {
            for [u, v] in rung.parts.iter().flatten() {
                let ray = camera().unproject(ImagePoint { u: *u, v: *v }).unwrap().xyz();
                let elevation = -dot(ray, axis).asin().to_degrees();
                assert!((elevation - rung.value_deg).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn nothing_is_drawn_without_a_position_and_an_attitude() {
        let empty = FrameData::default();
        assert!(grid(&empty, EARTH_KM, &camera()).is_none());
        assert!(vertical(Some(&empty), Some(EARTH_KM), None, &camera()).is_none());
        // A position inside the body is none.
        let inside = FrameData { position_km: Some([10.0, 0.0, 0.0]), ..data(0.0, 0.0, 1.0, [1.0, 0.0, 0.0, 0.0]) };
        assert!(grid(&inside, EARTH_KM, &camera()).is_none());
    }
}
