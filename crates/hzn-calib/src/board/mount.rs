//! The mount of a camera from pictures of a board that does not move, and the direction of gravity in each.
//!
//! Camera and accelerometers are fixed to the vehicle, which stands still in a different tilt for each picture. With
//! the rotation Bᵢ from the board to the camera, the direction up g on the board, and the direction up uᵢ along the
//! vehicle's axes, M Bᵢ g = uᵢ. The unknowns are the mount M (vehicle from camera) and g, five numbers; a board needs
//! neither to be level nor upright. A start for g is looked for on the sphere, where M follows from Wahba's problem;
//! the Gauss-Newton method ends the search.

use std::fmt;

use hzn_core::camera::{Camera, Config};
use hzn_core::pixel::ImagePoint;
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, SymmetricEigen, Vector3};

use super::layout::{Board, View};
use super::pose::pose_from_rays;
use crate::adjust::adjust_pose;

/// Smallest number of pictures: ten residuals for five unknowns leave five that show the scatter.
pub const MIN_TILTS: usize = 5;
/// Number of directions on the sphere at which the search begins. They are 7° apart, and the method converges from far
/// larger errors.
const STARTS: usize = 800;
const ITERATIONS: usize = 30;
/// Number of times that the numbering of the corners is looked at again.
const ROUNDS: usize = 5;
/// Largest sigma of a mount that is worth writing, degrees: more than a careful look at the vehicle gives.
const MAX_SIGMA_DEG: f64 = 5.0;

/// A picture with the direction up along the vehicle's axes, of any length.
#[derive(Debug, Clone, PartialEq)]
pub struct Tilt {
    /// The corners of the board.
    pub view: View,
    /// The direction up: the specific force of accelerometers at rest.
    pub up: [f64; 3],
}

/// The mount of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardMount {
    /// Rotation from the camera to the vehicle.
    pub vehicle_from_camera: Rotation3<f64>,
    /// Covariance of the rotation vector of its error, about the axes of the camera, rad².
    pub covariance_rad2: Matrix3<f64>,
    /// RMS of the angle between the direction up of the accelerometers and that of the board, per axis, rad.
    pub rms_rad: f64,
    /// Largest angle of a direction up from the mean of all, rad: how far the vehicle was tilted.
    pub largest_tilt_rad: f64,
    /// Name and angle of each picture, rad.
    pub residuals_rad: Vec<(String, f64)>,
    /// Names of the pictures whose board has no pose.
    pub without_pose: Vec<String>,
}

/// Names of the vehicle's axes, with their directions.
const AXES: [(&str, [f64; 3]); 6] = [
    ("+x", [1.0, 0.0, 0.0]),
    ("-x", [-1.0, 0.0, 0.0]),
    ("+y", [0.0, 1.0, 0.0]),
    ("-y", [0.0, -1.0, 0.0]),
    ("+z", [0.0, 0.0, 1.0]),
    ("-z", [0.0, 0.0, -1.0]),
];

impl BoardMount {
    /// Says where the camera looks in the axes of the vehicle, and where the top of its picture is.
    ///
    /// A reader must compare this with the vehicle. A table of accelerations with left-handed axes (two of them
    /// exchanged, or one with the wrong sign) fits as well as a right one: mirrored directions up are turned ones with
    /// the opposite direction up on the board, which is unknown. The mount is then wrong by half a turn.
    pub fn axes_in_words(&self) -> String {
        let towards = |axis: Vector3<f64>| {
            let in_vehicle = self.vehicle_from_camera * axis;
            let (name, cos) = AXES
                .map(|(name, direction)| (name, in_vehicle.dot(&Vector3::from(direction))))
                .into_iter()
                .fold(("", f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best });
            format!("{name} ({:.0} deg from it)", cos.clamp(-1.0, 1.0).acos().to_degrees())
        };
        format!(
            "in the axes of the vehicle, the camera looks along {}, and the top of the picture is towards {}",
            towards(Vector3::z()),
            towards(-Vector3::y())
        )
    }
}

/// Returns the largest angle of a direction up from the mean of all, in rad.
fn largest_tilt_rad(poses: &[Pose]) -> f64 {
    let mean: Vector3<f64> = poses.iter().map(|p| p.up).sum();
    poses.iter().map(|p| p.up.angle(&mean)).fold(0.0, f64::max)
}

/// Why there is no mount.
#[derive(Debug, Clone, PartialEq)]
pub enum MountRefusal {
    /// The lens is not valid.
    Lens(String),
    /// Too few pictures have a pose.
    TooFew(usize),
    /// The tilts do not determine the mount.
    NotDetermined {
        /// Largest 1-sigma of the mount, degrees; `None` if it is infinite.
        sigma_deg: Option<f64>,
    },
}

impl fmt::Display for MountRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let advice = "tilt the vehicle by 20 degrees or more, about two different axes";
        match self {
            Self::Lens(why) => write!(f, "the lens is not valid: {why}"),
            Self::TooFew(n) => write!(f, "{n} pictures have a board and a tilt, but at least {MIN_TILTS} are needed"),
            Self::NotDetermined { sigma_deg: Some(deg) } => {
                write!(f, "the tilts leave the mount unknown by {deg:.1} degrees; {advice}")
            }
            Self::NotDetermined { sigma_deg: None } => write!(f, "the tilts do not determine the mount; {advice}"),
        }
    }
}

impl std::error::Error for MountRefusal {}

/// A picture in the adjustment.
struct Pose {
    name: String,
    camera_from_board: Rotation3<f64>,
    up: Vector3<f64>,
}

/// Returns the mount. `bias_rad` is the 1-sigma of the direction up that all pictures share: the bias of the
/// accelerometers over gravity. It widens the covariance, because no picture shows it.
///
/// # Errors
/// See [`MountRefusal`].
pub fn mount(lens: &Config, board: &Board, tilts: &[Tilt], bias_rad: f64) -> Result<BoardMount, MountRefusal> {
    let camera = Camera::<f64>::try_new(lens).map_err(|e| MountRefusal::Lens(e.to_string()))?;
    let (mut poses, mut without_pose) = (Vec::new(), Vec::new());
    for tilt in tilts {
        match pose(lens, &camera, board, tilt) {
            Some(pose) => poses.push(pose),
            None => without_pose.push(tilt.view.name.clone()),
        }
    }
    if poses.len() < MIN_TILTS {
        return Err(MountRefusal::TooFew(poses.len()));
    }
    let (vehicle_from_camera, on_board) = solve(&mut poses).ok_or(MountRefusal::NotDetermined { sigma_deg: None })?;
    let (normal, _, squares) = equations(&poses, &vehicle_from_camera, &on_board);
    let freedom = (2 * poses.len() - 5) as f64;
    let inverse = normal.try_inverse().ok_or(MountRefusal::NotDetermined { sigma_deg: None })?;
    let covariance = inverse.fixed_view::<3, 3>(0, 0) * (squares / freedom);
    let covariance_rad2 = covariance + Matrix3::identity() * bias_rad * bias_rad;
    let sigma_deg = SymmetricEigen::new(covariance_rad2).eigenvalues.max().sqrt().to_degrees();
    if !(sigma_deg < MAX_SIGMA_DEG) {
        return Err(MountRefusal::NotDetermined { sigma_deg: Some(sigma_deg).filter(|deg| deg.is_finite()) });
    }
    let angle = |p: &Pose| (p.name.clone(), (vehicle_from_camera * p.camera_from_board * on_board).angle(&p.up));
    Ok(BoardMount {
        vehicle_from_camera,
        covariance_rad2,
        rms_rad: (squares / freedom).sqrt(),
        largest_tilt_rad: largest_tilt_rad(&poses),
        residuals_rad: poses.iter().map(angle).collect(),
        without_pose,
    })
}

fn pose(lens: &Config, camera: &Camera<f64>, board: &Board, tilt: &Tilt) -> Option<Pose> {
    let rays = tilt.view.corners.iter().filter_map(|c| {
        let ray = camera.unproject(ImagePoint { u: c.at_px[0], v: c.at_px[1] })?;
        Some((board.place_mm(c.column, c.row), c.at_px, ray.xyz()))
    });
    let block = pose_from_rays(&rays.collect::<Vec<_>>())?.ok()?;
    let block = adjust_pose(lens, &block)?;
    let up = Vector3::from(tilt.up).try_normalize(1e-12)?;
    Some(Pose { name: tilt.view.name.clone(), camera_from_board: block.rotation, up })
}

/// Returns the mount, and the direction up on the board.
fn solve(poses: &mut [Pose]) -> Option<(Rotation3<f64>, Vector3<f64>)> {
    // A board looks the same after half a turn, except for its colours; the numbering begins at the upper left of the
    // picture, so a camera that is turned by more than a right angle sees it from the other end. The tilts are smaller
    // than a right angle, or the residuals tell.
    let half_turn = Rotation3::from_axis_angle(&Vector3::z_axis(), core::f64::consts::PI);
    let first = poses.first()?.camera_from_board;
    turn_where(poses, &half_turn, |_, r| first.angle_to(r));
    let mut best = search(poses)?;
    for _ in 0..ROUNDS {
        best = refine(poses, best.0, best.1);
        if !turn_where(poses, &half_turn, |up, r| (best.0 * r * best.1).angle(up)) {
            return Some(best);
        }
        best = search(poses)?;
    }
    Some(refine(poses, best.0, best.1))
}

/// Turns the boards by half a turn where that makes a cost smaller, and returns whether one was turned.
fn turn_where(
    poses: &mut [Pose],
    half_turn: &Rotation3<f64>,
    cost: impl Fn(&Vector3<f64>, &Rotation3<f64>) -> f64,
) -> bool {
    let mut changed = false;
    for p in poses {
        let turned = p.camera_from_board * half_turn;
        if cost(&p.up, &turned) < cost(&p.up, &p.camera_from_board) {
            (p.camera_from_board, changed) = (turned, true);
        }
    }
    changed
}

/// Returns the start with the smallest residuals among directions that are spread over the sphere.
fn search(poses: &[Pose]) -> Option<(Rotation3<f64>, Vector3<f64>)> {
    let golden = core::f64::consts::PI * (3.0 - 5f64.sqrt());
    let start = |i: usize| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / STARTS as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let on_board = Vector3::new(across * cos, across * sin, z);
        let attitude =
            poses.iter().fold(Matrix3::zeros(), |sum, p| sum + p.up * (p.camera_from_board * on_board).transpose());
        let rotation = Rotation3::from_matrix_eps(&wahba(attitude)?, 1e-12, 50, Rotation3::identity());
        Some((equations(poses, &rotation, &on_board).2, rotation, on_board))
    };
    let best = (0..STARTS).filter_map(start).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, rotation, on_board)| (rotation, on_board))
}

/// Returns the rotation that fits best (Markley 1988): with B = U S Vᵀ it is U diag(1, 1, det U det V) Vᵀ.
fn wahba(attitude: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = attitude.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?);
    // The last singular value may be any of the three.
    let mut signs = Vector3::repeat(1.0);
    signs[svd.singular_values.imin()] = (u.determinant() * v.determinant()).signum();
    Some(u * Matrix3::from_diagonal(&signs) * v)
}

/// Ends the search by the Gauss-Newton method.
fn refine(poses: &[Pose], rotation: Rotation3<f64>, on_board: Vector3<f64>) -> (Rotation3<f64>, Vector3<f64>) {
    let (mut rotation, mut on_board) = (rotation, on_board);
    for _ in 0..ITERATIONS {
        let (normal, right, _) = equations(poses, &rotation, &on_board);
        let Some(step) = normal.cholesky().map(|c| c.solve(&right)) else { break };
        rotation *= Rotation3::new(Vector3::new(step[0], step[1], step[2]));
        rotation.renormalize();
        let [a, b] = across(&on_board);
        on_board = (on_board + a * step[3] + b * step[4]).normalize();
        if step.norm() < 1e-12 {
            break;
        }
    }
    (rotation, on_board)
}

/// Returns two unit vectors across a direction.
fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = if direction.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = direction.cross(&axis).normalize();
    [first, direction.cross(&first)]
}

/// Returns the normal matrix, the right side, and the sum of squares. The unknowns are a rotation about the camera's
/// axes and two components of the direction up on the board.
fn equations(
    poses: &[Pose],
    rotation: &Rotation3<f64>,
    on_board: &Vector3<f64>,
) -> (SMatrix<f64, 5, 5>, SVector<f64, 5>, f64) {
    let (mut normal, mut right, mut squares) = (SMatrix::zeros(), SVector::zeros(), 0.0);
    let by_board = across(on_board);
    for p in poses {
        let in_camera = p.camera_from_board * on_board;
        let predicted = rotation * in_camera;
        for axis in across(&p.up) {
            // M (1 + [δ×]) v changes by M (δ × v) = −M [v×] δ.
            let by_rotation = -(rotation.matrix() * in_camera.cross_matrix()).transpose() * axis;
            let by = by_board.map(|b| axis.dot(&(rotation * p.camera_from_board * b)));
            let row = SVector::<f64, 5>::new(by_rotation.x, by_rotation.y, by_rotation.z, by[0], by[1]);
            let residual = -axis.dot(&predicted);
            normal += row * row.transpose();
            right += row * residual;
            squares += residual * residual;
        }
        // Behind the plane across `up` the two components are small again.
        squares += predicted.dot(&p.up).min(0.0).powi(2) * 4.0;
    }
    (normal, right, squares)
}

#[cfg(test)]
mod tests {
    use super::super::layout::Corner;
    use super::*;
    use crate::draws::Draws;
    use hzn_core::camera::{Equation, Model};

    const BOARD: Board = Board { columns: 9, rows: 6, square_mm: 30.0 };

    /// Pictures of a board in tilts of `tilt` radians, with noise of the corners and of the direction up.
    fn tilts(true_mount: &Rotation3<f64>, lens: &Config, n: usize, tilt: f64, draws: &mut Draws) -> Vec<Tilt> {
        let equation = Equation::new(lens);
        // A board that leans against a wall, in axes with z up.
        let board = Rotation3::from_euler_angles(1.3, 0.2, 0.4);
        let level = Rotation3::from_euler_angles(1.35, 0.15, 0.3).inverse();
        let mut out = Vec::new();
        for i in 0..n {
            let angle = core::f64::consts::TAU * i as f64 / n as f64;
            let lean =
                Rotation3::new(Vector3::new(tilt * angle.cos(), tilt * angle.sin(), 0.7 * tilt * (2.0 * angle).sin()));
            let camera_from_world = lean * level;
            let rotation = camera_from_world * board;
            let middle = Vector3::new(120.0, 75.0, 0.0);
            let shift = Vector3::new(40.0 * draws.normal(), 40.0 * draws.normal(), 900.0) - rotation * middle;
            let corner = |(column, row): (u16, u16)| {
                let [x, y] = BOARD.place_mm(column, row);
                let p = equation.project((rotation * Vector3::new(x, y, 0.0) + shift).into()).unwrap().point;
                Corner { column, row, at_px: [p.u + 0.1 * draws.normal(), p.v + 0.1 * draws.normal()] }
            };
            let corners = (0..6).flat_map(|row| (0..9).map(move |column| (column, row))).map(corner).collect();
            let up = true_mount * camera_from_world * Vector3::z();
            let noise = Vector3::from_fn(|_, _| 1e-3 * draws.normal());
            out.push(Tilt { view: View { name: i.to_string(), corners }, up: ((up + noise) * 9.81).into() });
        }
        out
    }

    #[test]
    fn rendered_tilts_give_the_mount_within_its_sigma() {
        let lens = Config::ideal(Model::Equidistant, 1280, 960, 700.0);
        let mut draws = Draws(5);
        let (mut squares, runs) = (0.0, 60);
        for _ in 0..runs {
            let vector = Vector3::from_fn(|_, _| draws.normal());
            let truth = Rotation3::new(vector);
            let found = mount(&lens, &BOARD, &tilts(&truth, &lens, 12, 0.4, &mut draws), 0.0).unwrap();
            let error = (truth.inverse() * found.vehicle_from_camera).scaled_axis();
            squares += (error.transpose() * found.covariance_rad2.try_inverse().unwrap() * error)[(0, 0)];
            assert!(error.norm() < 0.02, "{error:?}");
        }
        // χ² with 3 degrees of freedom; the scatter of few residuals makes it a little larger.
        let nees = squares / f64::from(runs);
        assert!((2.0..4.5).contains(&nees), "{nees}");
    }

    #[test]
    fn small_tilts_have_a_sigma_that_is_right() {
        let lens = Config::ideal(Model::Equidistant, 1280, 960, 700.0);
        let (mut draws, mut squares, mut written) = (Draws(6), 0.0, 0);
        for _ in 0..60 {
            let truth = Rotation3::new(Vector3::from_fn(|_, _| draws.normal()));
            let Ok(found) = mount(&lens, &BOARD, &tilts(&truth, &lens, 12, 0.06, &mut draws), 0.0) else { continue };
            let error = (truth.inverse() * found.vehicle_from_camera).scaled_axis();
            squares += (error.transpose() * found.covariance_rad2.try_inverse().unwrap() * error)[(0, 0)];
            written += 1;
            assert!((0.03..0.1).contains(&found.largest_tilt_rad), "{}", found.largest_tilt_rad);
        }
        let nees = squares / f64::from(written);
        assert!(written > 30 && (2.0..4.5).contains(&nees), "{nees} of {written}");
    }

    /// The residuals of left-handed accelerations are those of right ones; only the words show the difference.
    #[test]
    fn left_handed_accelerations_show_in_the_words_alone() {
        let lens = Config::ideal(Model::Equidistant, 1280, 960, 700.0);
        // The camera looks along the vehicle's x, with the top of the picture towards z.
        let truth = Rotation3::from_matrix(&Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0));
        let right = tilts(&truth, &lens, 12, 0.4, &mut Draws(7));
        let left = right.iter().map(|t| Tilt { up: [-t.up[0], t.up[1], t.up[2]], ..t.clone() }).collect::<Vec<_>>();
        let [right, left] = [right, left].map(|tilts| mount(&lens, &BOARD, &tilts, 0.0).unwrap());
        assert!((left.rms_rad / right.rms_rad - 1.0).abs() < 1e-3, "{} {}", left.rms_rad, right.rms_rad);
        let words = [&right, &left].map(BoardMount::axes_in_words);
        assert!(words[0].contains("looks along +x (0 deg") && words[0].contains("towards +z (0 deg"), "{words:?}");
        assert!(words[1].contains("looks along +x (0 deg") && words[1].contains("towards -z (0 deg"), "{words:?}");
    }

    #[test]
    fn what_the_tilts_do_not_show_is_refused_or_wide() {
        let lens = Config::ideal(Model::Equidistant, 1280, 960, 700.0);
        let truth = Rotation3::new(Vector3::new(0.3, -2.0, 0.9));
        let few = tilts(&truth, &lens, 4, 0.4, &mut Draws(2));
        assert_eq!(mount(&lens, &BOARD, &few, 0.0).unwrap_err(), MountRefusal::TooFew(4));
        let level = tilts(&truth, &lens, 10, 0.002, &mut Draws(2));
        let refused = mount(&lens, &BOARD, &level, 0.0).unwrap_err();
        assert!(refused.to_string().contains("about two different axes"), "{refused}");
        let good = tilts(&truth, &lens, 10, 0.4, &mut Draws(2));
        let sigma = |bias| mount(&lens, &BOARD, &good, bias).unwrap().covariance_rad2[(0, 0)].sqrt();
        assert!(sigma(0.01) > 0.01 && sigma(0.01).hypot(1e-9) < sigma(0.0).hypot(0.0101));
    }
}
