//! Coastlines of the Earth.

use hzn_core::body::{self, Kind};
use hzn_core::camera::Camera;
use hzn_files::FrameData;

use super::ground::{self, Grid, Pose};
use crate::model::view::Point;

/// The lines; README.md describes the format and the origin.
const COAST: &[u8] = include_bytes!("coast.bin");
/// Largest step between two points that are drawn, degrees, so that lines follow the curvature.
const STEP_DEG: f64 = 1.0;

/// Returns latitudes and longitudes of a body in a picture whose position and attitude are given, and the coastlines if
/// the body is the Earth; `None` without position and attitude.
pub fn grid(data: &FrameData, body: &body::Config, camera: &Camera<f64>) -> Option<Grid> {
    let figure_km = body.figure_km()?;
    let mut grid = ground::grid(data, figure_km, camera)?;
    if matches!(body.kind, Kind::Earth | Kind::EarthSphere) {
        let pose = Pose::new(data, figure_km)?;
        grid.coasts = lines().flat_map(|line| in_picture(&pose, &line, camera)).collect();
    }
    Some(grid)
}

/// Returns the lines as latitudes and longitudes in degrees.
pub(super) fn lines() -> impl Iterator<Item = Vec<[f64; 2]>> {
    let mut rest = COAST;
    std::iter::from_fn(move || {
        let (count, after) = rest.split_first_chunk::<2>()?;
        let (line, after) = after.split_at_checked(4 * usize::from(u16::from_le_bytes(*count)))?;
        rest = after;
        let degrees = |[a, b]: [u8; 2]| f64::from(i16::from_le_bytes([a, b])) / 100.0;
        let point = |bytes: &[u8]| match *bytes {
            [a, b, c, d] => Some([degrees([a, b]), degrees([c, d])]),
            _ => None,
        };
        Some(line.chunks_exact(4).filter_map(point).collect())
    })
}

/// Returns the parts of a line that the camera sees, in pixels.
fn in_picture(pose: &Pose, line: &[[f64; 2]], camera: &Camera<f64>) -> Vec<Vec<Point>> {
    let fine = line.iter().zip(line.iter().skip(1)).flat_map(|(from, to)| {
        let by = [0, 1].map(|i| to[i] - from[i]);
        let steps = (by[0].abs().max(by[1].abs()) / STEP_DEG).ceil().max(1.0);
        (0..=steps as u32).map(move |n| [0, 1].map(|i| from[i] + by[i] * f64::from(n) / steps))
    });
    ground::parts(fine.map(|[lat, lon]| pose.project(lat.to_radians(), lon.to_radians(), camera)))
}

#[cfg(test)]
mod tests {
    use hzn_core::camera::{Config, Model};

    use super::*;

    #[test]
    fn capes_lie_on_the_coast_and_oceans_do_not() {
        let all: Vec<[f64; 2]> = lines().flatten().collect();
        assert!(all.len() > 4000 && all.iter().all(|[lat, lon]| lat.abs() <= 90.0 && lon.abs() <= 180.0));
        let away_deg = |lat: f64, lon: f64| {
            let away = |p: &[f64; 2]| (p[0] - lat).hypot((p[1] - lon) * lat.to_radians().cos());
            all.iter().map(away).fold(f64::INFINITY, f64::min)
        };
        // Cape Agulhas, the Strait of Gibraltar, the north of Madagascar.
        for (lat, lon) in [(-34.83, 20.0), (36.0, -5.6), (-12.3, 49.3)] {
            assert!(away_deg(lat, lon) < 0.7, "{lat} {lon}: {}", away_deg(lat, lon));
        }
        assert!(away_deg(0.0, -140.0) > 10.0, "the middle of the Pacific");
    }

    /// A camera above the Gulf of Guinea that looks down, with the top of its picture to the north.
    #[test]
    fn a_camera_above_a_gulf_sees_land_to_the_north_and_to_the_east() {
        let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 640, 480, 400.0)).unwrap();
        // The optical axis is -x, right is east (+y), and down is south (-z): these are the columns of the rotation.
        let data = FrameData {
            position_km: Some([6378.137 + 2000.0, 0.0, 0.0]),
            q_fixed_from_camera_wxyz: Some([0.5, -0.5, -0.5, 0.5]),
            ..FrameData::default()
        };
        let body = body::Config { kind: Kind::Earth, ..body::Config::default() };
        let grid = grid(&data, &body, &camera).unwrap();
        let below = grid.below_deg;
        assert!(below[0].abs() < 1e-6 && below[1].abs() < 1e-6, "{below:?}");
        let points: Vec<Point> = grid.coasts.iter().flatten().copied().collect();
        assert!(!points.is_empty());
        // The coast of Ghana is 5 degrees north, that of Gabon 9 degrees east; the south-west is the ocean.
        assert!(points.iter().any(|p| p[1] < 200.0) && points.iter().any(|p| p[0] > 500.0), "{points:?}");
        assert!(!points.iter().any(|p| p[0] < 300.0 && p[1] > 250.0));
    }
}
