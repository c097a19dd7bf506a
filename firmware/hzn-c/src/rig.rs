//! Several sensors that are one: their answers at one epoch, joined in the axes of the vehicle.

use core::mem::{align_of, size_of};
use core::ptr;

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::rig::{Answered, Common, Config, Limb, MOST_HEADS, Mount, NoJoint, Rig};
use hzn_core::status::Status;
use hzn_twice::KeptTwice;

use crate::types::{HznAnswer, HznKnown, HznPicture, HznRigAnswer, HznRigSetup, NO_RIG_ANSWER};
use crate::{HZN_INTERFACE, HZN_MEMORY, HZN_NO_LIMB, HZN_NOT_OPEN, HZN_NULL, HZN_OTHER_INTERFACE, HZN_REJECTED};
use crate::{HZN_OK, HZN_REFUSED, HZN_WORKSPACE_ALIGN, HznSensor, find_limb, open_sensor};

/// Bytes that a rig needs in addition to its sensors, on every machine; it has the alignment of a sensor.
pub const HZN_RIG_SIZE: usize = 16384;
/// Largest number of heads of a rig.
pub const HZN_RIG_HEADS: usize = 4;

const _: () = {
    assert!(size_of::<HznRig>() <= HZN_RIG_SIZE && align_of::<HznRig>() <= HZN_WORKSPACE_ALIGN);
    assert!(HZN_RIG_HEADS == MOST_HEADS);
};

/// Is in an open rig.
const MAGIC: u64 = 0x687A_6E20_7269_6773;

/// A rig. Its content is hidden: only pointers to it are passed.
// Any bytes are a valid rig, so a bit that flips between two calls makes none invalid.
#[derive(Debug)]
pub struct HznRig {
    magic: u64,
    kept: KeptTwice<Kept>,
}

/// What outlives a call.
#[derive(Debug)]
struct Kept {
    rig: Rig<f32>,
    common: Common<f32>,
    mounts: [Option<Mount<f32>>; MOST_HEADS],
    limb_groups: [u8; MOST_HEADS],
    heads: [Option<Head>; MOST_HEADS],
}

/// The picture of a head in the epoch.
#[derive(Debug)]
struct Head {
    solution: Option<Solution<f32>>,
    camera: Camera<f32>,
    radius_km: f32,
    time_s: f64,
    rate_rad_s: Option<[f32; 3]>,
}

/// Returns the rig at a pointer, or the error. Compares what outlives a call with its copy.
///
/// # Safety
/// `rig` is null or points to readable and writable memory of the size of a rig.
unsafe fn open_rig<'a>(rig: *mut HznRig) -> Result<&'a mut HznRig, i32> {
    if rig.is_null() {
        return Err(HZN_NULL);
    }
    if !rig.is_aligned() {
        return Err(HZN_MEMORY);
    }
    // SAFETY: the caller guarantees that the memory is readable; a number may have any value.
    if unsafe { (&raw const (*rig).magic).read() } != MAGIC {
        return Err(HZN_NOT_OPEN);
    }
    // SAFETY: `hzn_rig_open` has made a rig here, and any bytes are one.
    let rig = unsafe { &mut *rig };
    if rig.kept.is_intact() { Ok(rig) } else { Err(HZN_NOT_OPEN) }
}

/// Writes the usual values to `setup`: those of a rig.toml that has none, with exact mounts. The quaternions are NaN: a
/// head without one has no part in the joint answer.
///
/// # Safety
/// `setup` is null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_rig_usual(setup: *mut HznRigSetup) -> i32 {
    if setup.is_null() {
        return HZN_NULL;
    }
    if !setup.is_aligned() {
        return HZN_MEMORY;
    }
    let Config { false_alarm, misleading } = Config::DEFAULT;
    let usual = HznRigSetup {
        false_alarm,
        misleading,
        limb_tilt_sigma_km: f32::NAN,
        limb_own_sigma_km: Limb::<f32>::OWN_SIGMA_KM as f32,
        limb_own_length_km: Limb::<f32>::OWN_LENGTH_KM as f32,
        sigma_rad: 0.0,
        q_vehicle_from_camera_wxyz: [[f32::NAN; 4]; HZN_RIG_HEADS],
        mount_cov_rad2: [[0.0; 6]; HZN_RIG_HEADS],
        limb_groups: [0; HZN_RIG_HEADS],
    };
    // SAFETY: the pointer is neither null nor unaligned, and the caller guarantees the rest.
    unsafe { setup.write(usual) };
    0
}

/// Makes a rig in `memory` and writes a pointer to it to `out`. `interface` is [`HZN_INTERFACE`]. The sensors of the
/// heads are opened by [`hzn_open`](crate::hzn_open), each in memory of its own. A setup with an impossible number is
/// refused.
///
/// # Safety
/// `memory` is null or has `bytes` writable bytes that nothing else uses as long as the rig is used. `setup` is null or
/// readable. `out` is null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_rig_open(
    memory: *mut u8,
    bytes: usize,
    interface: u32,
    setup: *const HznRigSetup,
    out: *mut *mut HznRig,
) -> i32 {
    let place = memory.cast::<HznRig>();
    if place.is_null() || setup.is_null() || out.is_null() {
        return HZN_NULL;
    }
    if bytes < size_of::<HznRig>() || !place.is_aligned() || !setup.is_aligned() || !out.is_aligned() {
        return HZN_MEMORY;
    }
    if interface != HZN_INTERFACE {
        return HZN_OTHER_INTERFACE;
    }
    // SAFETY: the pointer is neither null nor unaligned, and the caller guarantees the rest.
    let Some(kept) = Kept::new(unsafe { &*setup }) else { return HZN_REFUSED };
    // SAFETY: `memory` is aligned and has room, as checked. A rig consists of a number and of bytes that are not read
    // before they are written.
    let opened = unsafe {
        ptr::write_bytes(place, 0, 1);
        &mut *place
    };
    opened.kept.set(kept);
    opened.kept.complete();
    opened.magic = MAGIC;
    // SAFETY: the pointer is neither null nor unaligned, and the caller guarantees the rest.
    unsafe { out.write(place) };
    0
}

/// Finds the limb in the picture of head `head`, 0 to 3, as [`hzn_process`](crate::hzn_process) does, and keeps the
/// answer for the epoch; it replaces an earlier one of this head. `time_s` is the middle of the exposure in seconds
/// from any instant that all heads share; NaN: it is not known, and the picture counts as triggered with the others.
///
/// # Safety
/// `rig` is null or from `hzn_rig_open`. The others are as for `hzn_process`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_rig_process(
    rig: *mut HznRig,
    head: u32,
    time_s: f64,
    sensor: *mut HznSensor,
    picture: *const HznPicture,
    known: *const HznKnown,
    out: *mut HznAnswer,
) -> i32 {
    // SAFETY: the caller guarantees it.
    let rig = match unsafe { open_rig(rig) } {
        Ok(rig) => rig,
        Err(code) => return code,
    };
    if head as usize >= MOST_HEADS || time_s.is_infinite() {
        return HZN_REFUSED;
    }
    // SAFETY: the caller guarantees it.
    let (report, rate_rad_s) = match unsafe { find_limb(sensor, picture, known, out) } {
        Ok(found) => found,
        Err(code) => return code,
    };
    // SAFETY: the caller guarantees it.
    let sensor = match unsafe { open_sensor(sensor) } {
        Ok(opened) => &opened.kept.get().sensor,
        Err(code) => return code,
    };
    let body = &sensor.config().body;
    let own = Head {
        solution: report.solution.filter(|_| report.status == Status::Ok),
        camera: sensor.camera().clone(),
        radius_km: (body.mean_radius_km() + body.limb_height_km) as f32,
        time_s,
        rate_rad_s,
    };
    rig.kept.change(|kept| {
        if let Some(place) = kept.heads.get_mut(head as usize) {
            *place = Some(own);
        }
    });
    report.status as i32
}

/// Joins the answers of the heads since the last call and begins the next epoch. Returns 0 and the direction in `out`;
/// 1 if no head has an answer; 6 if the heads contradict each other or do not determine a direction.
///
/// # Safety
/// `rig` is null or from `hzn_rig_open`. `out` is null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_rig_join(rig: *mut HznRig, out: *mut HznRigAnswer) -> i32 {
    if out.is_null() {
        return HZN_NULL;
    }
    if !out.is_aligned() {
        return HZN_MEMORY;
    }
    // SAFETY: the pointer is neither null nor unaligned, and the caller guarantees the rest.
    let out = unsafe { &mut *out };
    *out = NO_RIG_ANSWER;
    // SAFETY: the caller guarantees it.
    let rig = match unsafe { open_rig(rig) } {
        Ok(rig) => rig,
        Err(code) => return code,
    };
    rig.kept.get().join(out);
    rig.kept.change(|kept| kept.heads = [const { None }; MOST_HEADS]);
    i32::from(out.status)
}

impl Kept {
    /// `None` if a number is impossible.
    fn new(setup: &HznRigSetup) -> Option<Self> {
        let sigmas = [setup.limb_own_sigma_km, setup.sigma_rad];
        let is_good = |x: &f32| x.is_finite() && *x >= 0.0;
        let tilt = (!setup.limb_tilt_sigma_km.is_nan()).then_some(setup.limb_tilt_sigma_km);
        let is_length_good = setup.limb_own_length_km.is_finite() && setup.limb_own_length_km >= 1.0;
        let limb_groups = setup.limb_groups.map(|group| u8::try_from(group).unwrap_or(u8::MAX));
        let are_groups_good = limb_groups.iter().all(|group| usize::from(*group) < MOST_HEADS);
        if !sigmas.iter().chain(&tilt).all(is_good) || !is_length_good || !are_groups_good {
            return None;
        }
        let mut mounts = [None; MOST_HEADS];
        let given = setup.q_vehicle_from_camera_wxyz.iter().zip(&setup.mount_cov_rad2);
        for (place, (q, covariance)) in mounts.iter_mut().zip(given) {
            if q.iter().all(|x| x.is_nan()) {
                continue;
            }
            let [xx, _, _, yy, _, zz] = covariance;
            if !covariance.iter().all(|x| x.is_finite()) || ![*xx, *yy, *zz].iter().all(is_good) {
                return None;
            }
            *place = Some(Mount::new([1.0, 0.0, 0.0, 0.0], *q, covariance)?);
        }
        let limb = Limb {
            radius_km: 0.0,
            tilt_sigma_km: tilt,
            own_sigma_km: setup.limb_own_sigma_km,
            own_length_km: setup.limb_own_length_km,
        };
        Some(Self {
            rig: Rig::new(&Config { false_alarm: setup.false_alarm, misleading: setup.misleading }).ok()?,
            common: Common { limb, sigma_rad: setup.sigma_rad },
            mounts,
            limb_groups,
            heads: [const { None }; MOST_HEADS],
        })
    }

    fn join(&self, out: &mut HznRigAnswer) {
        let start_s = self.heads.iter().flatten().map(|head| head.time_s).find(|time_s| !time_s.is_nan());
        let mut answered = [None; MOST_HEADS];
        let groups = self.mounts.iter().zip(self.limb_groups);
        for ((place, head), (mount, limb_group)) in answered.iter_mut().zip(&self.heads).zip(groups) {
            let Some((head, mount)) = head.as_ref().zip(mount.as_ref()) else { continue };
            *place = head.solution.as_ref().map(|solution| Answered {
                solution,
                camera: &head.camera,
                mount,
                time_s: start_s.map(|start_s| (head.time_s - start_s) as f32).filter(|time_s| !time_s.is_nan()),
                rate_rad_s: head.rate_rad_s,
                limb_group,
            });
        }
        let set = |members: [bool; MOST_HEADS]| {
            members.iter().enumerate().fold(0, |set, (k, is_in)| set | u8::from(*is_in) << k)
        };
        out.heads_seen = set(self.heads.each_ref().map(Option::is_some));
        out.heads_answered = set(answered.each_ref().map(Option::is_some));
        let mut common = self.common;
        common.limb.radius_km = self.heads.iter().flatten().next().map_or(0.0, |head| head.radius_km);
        let epoch = self.rig.join_epoch(&common, &answered);
        out.time_s = start_s.zip(epoch.time_s).map_or(f64::NAN, |(start_s, after_s)| start_s + f64::from(after_s));
        let status = match epoch.answer {
            Ok(answer) => {
                out.axis_vehicle = answer.axis.xyz();
                out.cov_rad2 = answer.covariance.upper_rad2;
                out.half_angle_rad = answer.half_angle_rad;
                (out.heads_used, out.heads_excluded) = (answer.heads_used, answer.heads_excluded);
                (out.separation_rad, out.separation_limit_rad) = answer.separation_rad.unwrap_or((f32::NAN, f32::NAN));
                out.protection_rad = answer.protection_rad.unwrap_or(f32::NAN);
                HZN_OK
            }
            Err(NoJoint::NoHead) => HZN_NO_LIMB,
            Err(NoJoint::Undetermined | NoJoint::Inconsistent) => HZN_REJECTED,
        };
        out.status = status as u8;
    }
}
