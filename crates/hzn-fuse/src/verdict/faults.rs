//! Faults that have no size: inverted or exchanged mounts, quaternions in another order, pictures in another
//! orientation, attitudes in another frame. Each changes the problem as if the user had mended it.

use hzn_files::rotations::Written;
use nalgebra::{DVector, Quaternion, UnitQuaternion, Vector3};

use super::problem::{Problem, about_pole};

/// Orientation of pictures that are not as the camera took them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Orientation {
    LeftRight,
    UpDown,
    HalfTurn,
}

/// A fault, and the cameras that have it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Fault {
    InvertedMounts(Vec<usize>),
    /// Quaternions of mounts with the scalar last.
    ScalarLastMounts(Vec<usize>),
    ExchangedMounts(usize, usize),
    Pictures(Vec<usize>, Orientation),
    InvertedTracker,
    ScalarLastTracker,
    /// Attitudes of the star tracker relative to inertial axes.
    InertialTracker,
}

impl Fault {
    /// Returns the faults of the cameras, each alone, pairs exchanged, and all together.
    pub(super) fn of_cameras(cameras: usize) -> Vec<Self> {
        let mut all = Vec::new();
        let mut sets: Vec<Vec<usize>> = (0..cameras).map(|camera| vec![camera]).collect();
        if cameras > 1 {
            sets.push((0..cameras).collect());
        }
        for set in sets {
            all.push(Self::InvertedMounts(set.clone()));
            all.push(Self::ScalarLastMounts(set.clone()));
            let orientations = [Orientation::LeftRight, Orientation::UpDown, Orientation::HalfTurn];
            all.extend(orientations.map(|orientation| Self::Pictures(set.clone(), orientation)));
        }
        for a in 0..cameras {
            all.extend((a + 1..cameras).map(|b| Self::ExchangedMounts(a, b)));
        }
        all
    }

    /// Returns the cameras that have the fault, if it is one of cameras.
    pub(super) fn cameras(&self) -> Option<Vec<usize>> {
        match self {
            Self::InvertedMounts(cameras) | Self::ScalarLastMounts(cameras) | Self::Pictures(cameras, _) => {
                Some(cameras.clone())
            }
            Self::ExchangedMounts(a, b) => Some(vec![*a, *b]),
            Self::InvertedTracker | Self::ScalarLastTracker | Self::InertialTracker => None,
        }
    }

    /// Returns whether the pictures show a mirror image. Pictures that are turned by half a turn look like a camera
    /// that is.
    pub(super) fn is_mirrored(&self) -> bool {
        matches!(self, Self::Pictures(_, Orientation::LeftRight | Orientation::UpDown))
    }

    /// Changes the problem as if the fault were mended.
    pub(super) fn mend(&self, problem: &mut Problem) -> Option<()> {
        match self {
            Self::InvertedMounts(cameras) => each_mount(problem, cameras, UnitQuaternion::inverse),
            Self::ScalarLastMounts(cameras) => each_mount(problem, cameras, with_scalar_first),
            Self::ExchangedMounts(a, b) => {
                let told = |camera: usize| problem.looks.iter().find(|l| l.camera == camera).map(|l| l.mount);
                let (of_a, of_b) = (told(*a)?, told(*b)?);
                each_mount(problem, &[*a], |_| of_b);
                each_mount(problem, &[*b], |_| of_a);
            }
            Self::Pictures(cameras, orientation) => {
                let turned = |v: Vector3<f64>| match orientation {
                    Orientation::LeftRight => Vector3::new(-v.x, v.y, v.z),
                    Orientation::UpDown => Vector3::new(v.x, -v.y, v.z),
                    Orientation::HalfTurn => Vector3::new(-v.x, -v.y, v.z),
                };
                for look in problem.looks.iter_mut().filter(|look| cameras.contains(&look.camera)) {
                    look.measured = turned(look.measured);
                    look.by_height = turned(look.by_height);
                }
            }
            Self::InvertedTracker => each_attitude(problem, |told| told.inverse()),
            Self::ScalarLastTracker => each_attitude(problem, |told| with_scalar_first(&told)),
            Self::InertialTracker => problem.refer_to_fixed_axes()?,
        }
        Some(())
    }

    /// Says what is probably wrong; `name` names the cameras.
    pub(super) fn words(&self, name: &str) -> String {
        match self {
            Self::InvertedMounts(_) => {
                format!("the mount of {name} is probably inverted: it is the rotation from camera to vehicle")
            }
            Self::ScalarLastMounts(_) => {
                format!("the quaternion of the mount of {name} has probably the scalar last: the order is w, x, y, z")
            }
            Self::ExchangedMounts(..) => format!("the mounts or the recordings of {name} are probably exchanged"),
            Self::Pictures(_, Orientation::LeftRight) => format!("the pictures of {name} are probably mirrored"),
            Self::Pictures(_, Orientation::UpDown) => format!("the pictures of {name} are probably upside down"),
            Self::Pictures(_, Orientation::HalfTurn) => {
                format!("the pictures of {name} are probably turned by 180 degrees, or the camera is")
            }
            Self::InvertedTracker => {
                "the star tracker's quaternions are probably inverted: vehicle to ECEF is expected".into()
            }
            Self::ScalarLastTracker => {
                "the star tracker's quaternions have probably the scalar last: the order is qw, qx, qy, qz".into()
            }
            Self::InertialTracker => {
                "the star tracker's attitudes are probably relative to inertial axes (ECI): vehicle to ECEF is expected"
                    .into()
            }
        }
    }
}

/// Returns the rotation that was meant if its quaternion x, y, z, w was read as w, x, y, z.
fn with_scalar_first(read: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let [w, x, y, z] = Written::ScalarLast.meant([read.w, read.i, read.j, read.k]);
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

fn each_mount(problem: &mut Problem, cameras: &[usize], mended: impl Fn(&UnitQuaternion<f64>) -> UnitQuaternion<f64>) {
    for look in problem.looks.iter_mut().filter(|look| cameras.contains(&look.camera)) {
        look.mount = mended(&look.mount);
    }
}

/// Changes the attitudes of the star tracker as the file has them, from the vehicle to ECEF.
fn each_attitude(problem: &mut Problem, mended: impl Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>) {
    for tracked in &mut problem.tracked {
        let turn = about_pole(tracked.time_s);
        tracked.attitude = turn * mended(turn.inverse() * tracked.attitude);
    }
}

/// Steps of the search for the angle between inertial and fixed axes at the time 0, rad: coarse, fine, finest.
const ANGLE_STEPS_RAD: [f64; 3] = [0.1, 0.01, 0.0005];
/// Values on each side of the middle of such a search.
const VALUES: [i32; 3] = [32, 10, 20];

impl Problem {
    /// Turns attitudes that are relative to inertial axes to fixed axes. The angle at the time 0 comes from a search:
    /// the times need not be UTC.
    fn refer_to_fixed_axes(&mut self) -> Option<()> {
        // The problem has its attitudes in axes that do not turn and are those of ECEF at the time 0.
        let told: Vec<_> = self.tracked.iter().map(|t| about_pole(t.time_s).inverse() * t.attitude).collect();
        let turned = |angle_rad: f64| {
            let mut other = self.clone();
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -angle_rad);
            other.tracked.iter_mut().zip(&told).for_each(|(tracked, told)| tracked.attitude = turn * told);
            other
        };
        let cost = |angle_rad: f64| {
            let other = turned(angle_rad);
            let state = other.begin(DVector::zeros(other.shared.len()))?;
            Some((angle_rad, other.cost(&state)))
        };
        let mut middle_rad = 0.0;
        for (step_rad, values) in ANGLE_STEPS_RAD.into_iter().zip(VALUES) {
            let around = (-values..=values).filter_map(|k| cost(middle_rad + step_rad * f64::from(k)));
            middle_rad = around.min_by(|a, b| a.1.total_cmp(&b.1))?.0;
        }
        *self = turned(middle_rad);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scalar_comes_first_again() {
        let meant = UnitQuaternion::from_euler_angles(0.3, -0.8, 2.0);
        let [x, y, z, w]: [f64; 4] = meant.as_ref().coords.into();
        // The columns w, x, y, z hold x, y, z, w.
        let read = UnitQuaternion::new_normalize(Quaternion::new(x, y, z, w));
        assert!(with_scalar_first(&read).angle_to(&meant) < 1e-12);
    }

    #[test]
    fn two_cameras_have_each_fault_alone_and_together() {
        assert_eq!(Fault::of_cameras(1).len(), 5);
        let two = Fault::of_cameras(2);
        assert_eq!(two.len(), 16);
        assert!(two.contains(&Fault::Pictures(vec![0, 1], Orientation::HalfTurn)));
        assert!(two.contains(&Fault::ExchangedMounts(0, 1)));
    }
}
