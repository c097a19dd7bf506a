//! Several sensors that are one.

use std::mem::MaybeUninit;
use std::ptr;

use hzn::rig::{HZN_RIG_HEADS, HZN_RIG_SIZE, HznRig};
use hzn::rig::{hzn_rig_join, hzn_rig_open, hzn_rig_process, hzn_rig_usual};
use hzn::types::{HznAnswer, HznPicture, HznRigAnswer, HznRigSetup};
use hzn::{HZN_INTERFACE, HZN_MEMORY, HZN_NO_LIMB, HZN_NOT_OPEN, HZN_NULL, HZN_OK, HZN_REFUSED, HZN_REJECTED};
use hzn::{HZN_OTHER_INTERFACE, HZN_WORKSPACE_SIZE_608, HznSensor, hzn_apply, hzn_open, hzn_process, hzn_set};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
const FX_PX: f64 = 300.0;

#[repr(align(16))]
struct Memory<const BYTES: usize>([MaybeUninit<u8>; BYTES]);

impl<const BYTES: usize> Memory<BYTES> {
    fn new() -> Box<Self> {
        Box::new(Self([MaybeUninit::zeroed(); BYTES]))
    }
    fn start(&mut self) -> *mut u8 {
        self.0.as_mut_ptr().cast()
    }
}

/// The heads are 90 degrees apart about the direction to the body, which is the vehicle's z axis.
fn mount(k: usize, wrong_deg: f64) -> [f32; 4] {
    let (tilt, turn) = ((75.0 + wrong_deg).to_radians() / 2.0, k as f64 * 90f64.to_radians() / 2.0);
    let ((sx, cx), (sz, cz)) = (tilt.sin_cos(), turn.sin_cos());
    [cz * cx, cz * sx, sz * sx, sz * cx].map(|x| x as f32)
}

fn setup(change: impl FnOnce(&mut HznRigSetup)) -> HznRigSetup {
    let mut setup = MaybeUninit::uninit();
    // SAFETY: the pointer is valid, and the call fills the structure.
    let mut setup = unsafe {
        assert_eq!(hzn_rig_usual(setup.as_mut_ptr()), 0);
        setup.assume_init()
    };
    setup.q_vehicle_from_camera_wxyz = std::array::from_fn(|k| mount(k, 0.0));
    change(&mut setup);
    setup
}

/// A limb of a body as wide as the Earth at 230 km.
fn limb() -> Vec<u8> {
    let pixel = |i: usize| {
        let (x, y) = (((i % WIDTH) as f64 - 159.5) / FX_PX, ((i / WIDTH) as f64 - 119.5) / FX_PX);
        let (sin, cos) = 75f64.to_radians().sin_cos();
        let along = (y * sin + cos) / (x * x + y * y + 1.0).sqrt();
        (110.0 + 90.0 * ((along - 74.8f64.to_radians().cos()) * FX_PX).clamp(-1.0, 1.0)) as u8
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

struct Program {
    rig_memory: Box<Memory<HZN_RIG_SIZE>>,
    rig: *mut HznRig,
    _memory: Vec<Box<Memory<HZN_WORKSPACE_SIZE_608>>>,
    sensors: Vec<*mut HznSensor>,
    pixels: Vec<u8>,
}

impl Program {
    fn new(setup: &HznRigSetup) -> Self {
        let (mut rig_memory, mut rig) = (Memory::<HZN_RIG_SIZE>::new(), ptr::null_mut());
        let mut memory: Vec<_> = (0..HZN_RIG_HEADS).map(|_| Memory::<HZN_WORKSPACE_SIZE_608>::new()).collect();
        let mut sensors = vec![ptr::null_mut(); HZN_RIG_HEADS];
        // SAFETY: the memory has the size and the alignment that rig and sensors need.
        unsafe {
            assert_eq!(hzn_rig_open(rig_memory.start(), HZN_RIG_SIZE, HZN_INTERFACE, setup, &mut rig), 0);
            for (memory, sensor) in memory.iter_mut().zip(&mut sensors) {
                assert_eq!(hzn_open(memory.start(), HZN_WORKSPACE_SIZE_608, HZN_INTERFACE, sensor), 0);
                let size = [(1, WIDTH as f64), (2, HEIGHT as f64), (4, FX_PX), (5, FX_PX), (6, 159.5), (7, 119.5)];
                for (number, value) in size.into_iter().chain([(32, 230.0)]) {
                    assert_eq!(hzn_set(*sensor, number, value), 0);
                }
                assert_eq!(hzn_apply(*sensor), 0);
            }
        }
        Self { rig_memory, rig, _memory: memory, sensors, pixels: limb() }
    }

    fn see(&self, k: usize) -> (i32, HznAnswer) {
        let picture = HznPicture {
            pixels: self.pixels.as_ptr(),
            bytes: self.pixels.len(),
            width: WIDTH as u32,
            height: HEIGHT as u32,
            stride: WIDTH,
        };
        // SAFETY: an answer consists of numbers. The pointers are valid, and rig and sensor were opened.
        unsafe {
            let (mut answer, mut alone): (HznAnswer, HznAnswer) = (std::mem::zeroed(), std::mem::zeroed());
            let (sensor, known) = (self.sensors[k], ptr::null());
            let code = hzn_rig_process(self.rig, k as u32, 5.0, sensor, &picture, known, &mut answer);
            // The answer of the head is that of the sensor, to the last bit.
            if code >= 0 {
                assert_eq!(hzn_process(sensor, &picture, known, &mut alone), code);
                assert_eq!(answer.axis.map(f32::to_bits), alone.axis.map(f32::to_bits));
            }
            (code, answer)
        }
    }

    fn join(&self, heads: &[usize]) -> (i32, HznRigAnswer) {
        for &k in heads {
            assert_eq!(self.see(k).0, HZN_OK);
        }
        // SAFETY: an answer consists of numbers. The pointers are valid, and the rig was opened.
        unsafe {
            let mut answer: HznRigAnswer = std::mem::zeroed();
            let code = hzn_rig_join(self.rig, &mut answer);
            (code, answer)
        }
    }
}

fn off_z_deg(answer: &HznRigAnswer) -> f32 {
    let [x, y, _] = answer.axis_vehicle;
    x.hypot(y).to_degrees()
}

#[test]
fn four_sensors_are_one_answer() {
    let program = Program::new(&setup(|_| ()));
    let (code, all) = program.join(&[0, 1, 2, 3]);
    assert_eq!([code, all.status.into()], [HZN_OK; 2]);
    assert_eq!([all.heads_seen, all.heads_answered, all.heads_used, all.heads_excluded], [15, 15, 15, 0]);
    assert!(off_z_deg(&all) < 0.02 && all.separation_rad < all.separation_limit_rad, "{all:?}");
    assert_eq!(all.time_s, 5.0);
    // A head without a picture costs only itself. The epoch before is over.
    let (code, three) = program.join(&[0, 1, 3]);
    assert_eq!((code, three.heads_seen, three.heads_used), (HZN_OK, 0b1011, 0b1011));
    let trace = |answer: &HznRigAnswer| answer.cov_rad2[0] + answer.cov_rad2[3] + answer.cov_rad2[5];
    assert!(trace(&three) > 1.1 * trace(&all) && off_z_deg(&three) < 0.02);
    let (code, none) = program.join(&[]);
    assert_eq!((code, none.heads_seen, none.axis_vehicle[0].is_nan()), (HZN_NO_LIMB, 0, true));
}

#[test]
fn a_wrong_mount_is_excluded_or_there_is_no_answer() {
    let program = Program::new(&setup(|setup| setup.q_vehicle_from_camera_wxyz[2] = mount(2, 5.0)));
    let (code, answer) = program.join(&[0, 1, 2, 3]);
    assert_eq!((code, answer.heads_used, answer.heads_excluded), (HZN_OK, 0b1011, 0b0100));
    let (code, answer) = program.join(&[2, 3]);
    assert_eq!((code, answer.heads_used, answer.axis_vehicle[0].is_nan()), (HZN_REJECTED, 0, true));
    // A head without a mount has an answer of its own.
    let program = Program::new(&setup(|setup| setup.q_vehicle_from_camera_wxyz[2] = [f32::NAN; 4]));
    let (code, answer) = program.join(&[1, 2, 3]);
    assert_eq!((code, answer.heads_seen, answer.heads_answered), (HZN_OK, 0b1110, 0b1010));
}

#[test]
fn a_flipped_bit_is_refused_or_has_no_effect() {
    let mut program = Program::new(&setup(|_| ()));
    let right = program.join(&[0, 1, 2, 3]).1;
    let (mut refused, mut without_effect) = (0, 0);
    // Every 37th bit; 37 has no common factor with the number of bits.
    for bit in (0..8 * HZN_RIG_SIZE).step_by(37) {
        for k in 0..4 {
            assert_eq!(program.see(k).0, HZN_OK);
        }
        let byte = program.rig_memory.0[bit / 8].as_mut_ptr();
        // SAFETY: the memory began as zeros, so that all of its bytes have values.
        unsafe { *byte ^= 1 << (bit % 8) };
        match program.join(&[]) {
            (HZN_NOT_OPEN, answer) => {
                refused += 1;
                assert_eq!((answer.status, answer.axis_vehicle[0].is_nan()), (255, true));
                assert_eq!(program.see(0).0, HZN_NOT_OPEN);
            }
            (code, answer) => {
                without_effect += 1;
                assert_eq!((code, answer.axis_vehicle), (HZN_OK, right.axis_vehicle), "bit {bit}");
                assert_eq!(answer.cov_rad2, right.cov_rad2, "bit {bit}");
            }
        }
        // SAFETY: as above.
        unsafe { *byte ^= 1 << (bit % 8) };
        if program.join(&[]).0 == HZN_NOT_OPEN {
            program = Program::new(&setup(|_| ()));
        }
    }
    assert!(refused > 500, "{refused} refused, {without_effect} without effect");
}

#[test]
fn impossible_calls_are_refused() {
    let (mut memory, mut rig) = (Memory::<HZN_RIG_SIZE>::new(), ptr::null_mut());
    let good = setup(|_| ());
    let refused: [fn(&mut HznRigSetup); 9] = [
        |s| s.false_alarm = 0.7,
        |s| s.misleading = 0.0,
        |s| s.limb_tilt_sigma_km = -1.0,
        |s| s.limb_own_sigma_km = f32::NAN,
        |s| s.limb_own_length_km = 0.0,
        |s| s.sigma_rad = f32::INFINITY,
        |s| s.q_vehicle_from_camera_wxyz[1] = [0.0; 4],
        |s| s.mount_cov_rad2[3][0] = -1.0,
        |s| s.limb_groups[2] = 4,
    ];
    let program = Program::new(&good);
    // SAFETY: pointers are null or valid.
    unsafe {
        for (i, change) in refused.into_iter().enumerate() {
            let bad = setup(change);
            let code = hzn_rig_open(memory.start(), HZN_RIG_SIZE, HZN_INTERFACE, &bad, &mut rig);
            assert_eq!(code, HZN_REFUSED, "{i}");
        }
        let mut open = |memory, bytes, interface| hzn_rig_open(memory, bytes, interface, &good, &mut rig);
        assert_eq!(open(ptr::null_mut(), HZN_RIG_SIZE, HZN_INTERFACE), HZN_NULL);
        assert_eq!(open(memory.start(), 64, HZN_INTERFACE), HZN_MEMORY);
        assert_eq!(open(memory.start().add(1), HZN_RIG_SIZE - 1, HZN_INTERFACE), HZN_MEMORY);
        assert_eq!(open(memory.start(), HZN_RIG_SIZE, HZN_INTERFACE + 1), HZN_OTHER_INTERFACE);
        assert_eq!(hzn_rig_usual(ptr::null_mut()), HZN_NULL);
        let mut answer: HznRigAnswer = std::mem::zeroed();
        assert_eq!(hzn_rig_join(ptr::null_mut(), &mut answer), HZN_NULL);
        assert_eq!(hzn_rig_join(program.rig, ptr::null_mut()), HZN_NULL);
        assert_eq!(hzn_rig_join(memory.start().cast(), &mut answer), HZN_NOT_OPEN);
        let (sensor, null) = (program.sensors[0], ptr::null());
        let mut own: HznAnswer = std::mem::zeroed();
        let mut see = |head, time_s| hzn_rig_process(program.rig, head, time_s, sensor, null, ptr::null(), &mut own);
        assert_eq!([see(4, 0.0), see(0, f64::INFINITY), see(0, 0.0)], [HZN_REFUSED, HZN_REFUSED, HZN_NULL]);
    }
}
