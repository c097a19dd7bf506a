//! The answers of the heads at one epoch, joined in the axes of the vehicle.

use super::check::Rig;
use super::head::{Head, MOST_HEADS, symmetric, upper};
use super::joint::{Joint, NoJoint};
use super::mount::Mount;
use super::weather::Limb;
use crate::base::linalg::M3;
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, Cov3, Rotation, UnitVec3, Vehicle};
use crate::model::report::Solution;

/// A head that has an answer.
#[derive(Debug, Clone, Copy)]
pub struct Answered<'a, T> {
    /// The answer.
    pub solution: &'a Solution<T>,
    /// The camera of the head.
    pub camera: &'a Camera<T>,
    /// Its attitude on the vehicle.
    pub mount: &'a Mount<T>,
    /// Time of the exposure in seconds from any instant that all heads share; `None` if it is not known. Choose an
    /// instant near the epoch, because `T` has few digits.
    pub time_s: Option<T>,
    /// Rate of rotation of the camera in its own axes, rad/s.
    pub rate_rad_s: Option<[T; 3]>,
    /// Group of heads that see one limb, from 0 to 3, see [`Head::in_limb_group`].
    pub limb_group: u8,
}

/// What the heads share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Common<T> {
    /// The limb.
    pub limb: Limb<T>,
    /// 1σ of the attitude of the rig on the vehicle about each axis, rad.
    pub sigma_rad: T,
}

/// The outcome of an epoch.
#[derive(Debug, Clone, Copy)]
pub struct Epoch<T> {
    /// The middle of the exposures that are used; without an answer, of those of all heads that answer.
    pub time_s: Option<T>,
    /// Heads whose answer has no free cone, if several heads answer: bit k for head k.
    pub heads_without_cone: u8,
    /// The answer.
    pub answer: Result<EpochAnswer<T>, NoJoint>,
}

/// The answer of an epoch.
#[derive(Debug, Clone, Copy)]
pub struct EpochAnswer<T> {
    /// Direction to the body in the axes of the vehicle.
    pub axis: UnitVec3<Vehicle, T>,
    /// Covariance of `axis`, rad², rank 2.
    pub covariance: Cov3<Vehicle, T>,
    /// The part of `covariance` whose error is the same in the next epoch while the geometry stays, rad², rank 2:
    /// the common part of each head's free fit, the weather of the limb, the mounts, the tilt of the limb, and the
    /// attitude of the rig. A mean of n such answers has the covariance common + (covariance − common)/n. `None` if it
    /// is not known of a head.
    pub common: Option<Cov3<Vehicle, T>>,
    /// Probability that the edge of the answer is the limb: the largest of the heads that are used. Heads that agree
    /// are further evidence, which is not counted, because what they share may deceive all of them. See
    /// [`doubted_by`](Self::doubted_by) for heads without an answer. `None` if no head knows it.
    pub p_limb: Option<T>,
    /// Half-angle of the limb, rad; with several limb groups that of the first used head.
    pub half_angle_rad: T,
    /// 1σ of the cosine of that half-angle; `None` if the half-angle was not fitted.
    pub cos_sigma: Option<T>,
    /// The heads that are in the answer: bit k for head k.
    pub heads_used: u8,
    /// The heads that the check excluded.
    pub heads_excluded: u8,
    /// See [`Joint::separation_rad`].
    pub separation_rad: Option<(T, T)>,
    /// See [`Joint::protection_rad`].
    pub protection_rad: Option<T>,
}

type Heads<'h, 'a, T> = &'h [Option<Answered<'a, T>>];
type Cones<T> = [Option<Head<T>>; MOST_HEADS];

impl<T: Real> Rig<T> {
    /// Joins the heads of an epoch, at most four, `None` for a head without an answer.
    ///
    /// One head keeps its answer, with the expected half-angle, which several heads do not need; only its axes change.
    /// The heads need not be triggered together: a known rate turns each to the middle of the exposures that are used.
    pub fn join_epoch(&self, common: &Common<T>, heads: &[Option<Answered<'_, T>>]) -> Epoch<T> {
        let heads = heads.get(..MOST_HEADS).unwrap_or(heads);
        let all = set_of(heads.iter().map(Option::is_some));
        let time_s = middle_s(heads, all);
        match (all.count_ones(), heads.iter().zip(0u8..).find_map(|(head, k)| Some((head.as_ref()?, k)))) {
            (_, None) => Epoch { time_s, heads_without_cone: 0, answer: Err(NoJoint::NoHead) },
            (1, Some((head, k))) => {
                Epoch { time_s, heads_without_cone: 0, answer: single(common, head, k).ok_or(NoJoint::Undetermined) }
            }
            (_, Some(_)) => self.several(common, heads, all, time_s),
        }
    }

    fn several(&self, common: &Common<T>, heads: Heads<'_, '_, T>, all: u8, time_s: Option<T>) -> Epoch<T> {
        let cones = cones(common, heads, all, time_s);
        let heads_without_cone = all & !set_of(cones.iter().map(Option::is_some));
        // The largest limb counts: its tilt moves the axis most.
        let free = heads.iter().filter_map(|head| head.as_ref()?.solution.free.as_ref());
        let cos = free.fold(T::one(), |least, free| least.min(free.cos));
        let (tilt, rig) = (common.limb.tilt_rad(cos), common.sigma_rad);
        let tilt_rad = (tilt * tilt + rig * rig).sqrt();
        let joint = match self.join(&cones, tilt_rad) {
            Ok(joint) => joint,
            Err(why) => return Epoch { time_s, heads_without_cone, answer: Err(why) },
        };
        let (joint, time_s) = self.at_the_used(common, heads, joint, time_s, tilt_rad);
        let cos = joint.cos.0;
        let answer = EpochAnswer {
            axis: joint.axis,
            covariance: joint.covariance,
            common: joint.common,
            p_limb: p_limb(heads, joint.heads_used),
            half_angle_rad: (T::one() - cos * cos).max(T::ZERO).sqrt().atan2(cos),
            cos_sigma: Some(joint.cos.1),
            heads_used: joint.heads_used,
            heads_excluded: joint.heads_excluded,
            separation_rad: joint.separation_rad,
            protection_rad: joint.protection_rad,
        };
        Epoch { time_s, heads_without_cone, answer: Ok(answer) }
    }

    /// Moves a joint answer to the middle of the exposures that it uses, if heads were excluded from it. While the
    /// vehicle turns, an excluded head that is late would otherwise move the time, but not the direction.
    fn at_the_used(
        &self,
        common: &Common<T>,
        heads: Heads<'_, '_, T>,
        joint: Joint<T>,
        time_s: Option<T>,
        tilt_rad: T,
    ) -> (Joint<T>, Option<T>) {
        let own_s = middle_s(heads, joint.heads_used);
        if own_s == time_s {
            return (joint, time_s);
        }
        match self.join(&cones(common, heads, joint.heads_used, own_s), tilt_rad) {
            Ok(Joint { axis, covariance, common, cos, heads_used, .. }) if heads_used == joint.heads_used => {
                (Joint { axis, covariance, common, cos, ..joint }, own_s)
            }
            _ => (joint, time_s),
        }
    }
}

/// Returns the answer of the only head, in the axes of the vehicle.
fn single<T: Real>(common: &Common<T>, head: &Answered<'_, T>, k: u8) -> Option<EpochAnswer<T>> {
    let (mount, solution) = (head.mount.after(T::ZERO, None)?, head.solution);
    let axis = mount.apply(&solution.axis);
    let var = common.sigma_rad * common.sigma_rad;
    let [x, y, z] = axis.xyz();
    // The components of θ × e along x, y and z are (e × x)·θ, (e × y)·θ and (e × z)·θ.
    let lever = M3::new(T::ZERO, z, -y, -z, T::ZERO, x, y, -x, T::ZERO);
    let turns = symmetric(head.mount.covariance_rad2()) + M3::identity() * var;
    let added = lever * turns * lever.transpose();
    let in_vehicle = |covariance: &Cov3<Cam, T>| Cov3::from_upper(upper(&(turned(&mount, covariance) + added)));
    Some(EpochAnswer {
        axis,
        covariance: in_vehicle(&solution.covariance),
        common: solution.common.as_ref().map(in_vehicle),
        p_limb: solution.p_limb,
        half_angle_rad: solution.half_angle_rad,
        cos_sigma: solution.free.as_ref().map(|free| free.var_cos.max(T::ZERO).sqrt()),
        heads_used: 1 << k,
        heads_excluded: 0,
        separation_rad: None,
        protection_rad: None,
    })
}

/// Returns the free cones of a set of heads at a time, in the places of the heads.
fn cones<T: Real>(common: &Common<T>, heads: Heads<'_, '_, T>, set: u8, time_s: Option<T>) -> Cones<T> {
    let mut cones = [None; MOST_HEADS];
    for (k, (head, place)) in heads.iter().zip(&mut cones).enumerate() {
        *place = head.as_ref().filter(|_| set >> k & 1 == 1).and_then(|head| cone(common, head, time_s));
    }
    cones
}

fn cone<T: Real>(common: &Common<T>, head: &Answered<'_, T>, time_s: Option<T>) -> Option<Head<T>> {
    let free = common.limb.with_weather(head.solution.free.as_ref()?, head.camera);
    let after_s = time_s.zip(head.time_s).map_or(T::ZERO, |(epoch_s, own_s)| epoch_s - own_s);
    let mount = head.mount.after(after_s, head.rate_rad_s)?;
    let cone = Head::new(&free, &mount, head.mount.covariance_rad2(), T::ZERO)?;
    Some(cone.in_limb_group(head.limb_group))
}

/// Returns the largest probability of the limb in a set of heads.
fn p_limb<T: Real>(heads: Heads<'_, '_, T>, set: u8) -> Option<T> {
    let of_set = heads.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1);
    of_set.filter_map(|(_, head)| head.as_ref()?.solution.p_limb).reduce(T::max)
}

/// Returns the middle of the exposures of a set of heads.
fn middle_s<T: Real>(heads: Heads<'_, '_, T>, set: u8) -> Option<T> {
    let of_set = heads.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1);
    let mut times = of_set.filter_map(|(_, head)| head.as_ref()?.time_s);
    let first = times.next()?;
    let (first, last) = times.fold((first, first), |(first, last), t| (first.min(t), last.max(t)));
    Some((first + last) * T::from_f64(0.5))
}

fn set_of(members: impl Iterator<Item = bool>) -> u8 {
    members.enumerate().fold(0, |set, (k, is_in)| set | u8::from(is_in) << k)
}

/// Returns a covariance in the axes of the vehicle.
fn turned<T: Real>(mount: &Rotation<Cam, Vehicle, T>, covariance: &Cov3<Cam, T>) -> M3<T> {
    let turn = mount.to_matrix();
    turn * symmetric(&covariance.upper_rad2) * turn.transpose()
}
