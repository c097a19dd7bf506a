//! A board with several cameras that are made of vectors.

use std::cell::RefCell;
use std::collections::VecDeque;

use hzn_core::Report;
use hzn_flight::Parameters;
use hzn_flight::answer::PictureAnswer;
use hzn_flight::assembly::Assembly;
use hzn_flight::board::{Board, Picture, RETAINED_WORDS};
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::flight::rig::{Heads, Rig, RigBoard, RigBuffers, Setup, fingerprint};
use hzn_flight::flight::{HeadBuffers, Lists};
use hzn_flight::joint::RigAnswer;
use hzn_flight::messages::{Acknowledge, AttitudeState, Code, Event, EventRecord, Exposure, Function, Mode};
use hzn_flight::packet::{self, Apid, ApidBase, Scan};
use hzn_flight::table;
use hzn_flight::view::Viewer;

use crate::bench::limb;

/// The heads are 90 degrees apart about the direction to the body, which is the vehicle's z axis.
pub(crate) fn mount(k: usize) -> [f64; 4] {
    let (tilt, turn) = (75f64.to_radians() / 2.0, k as f64 * 90f64.to_radians() / 2.0);
    // About the camera's x axis, so that the body is along z; then about z.
    let ((sx, cx), (sz, cz)) = (tilt.sin_cos(), turn.sin_cos());
    [cz * cx, cz * sx, sz * sx, sz * cx]
}

pub(crate) fn parameters(k: usize) -> Parameters {
    let mut p = Parameters::defaults();
    p.set(302, f64::from(base(k).number())).unwrap();
    set_mount(&mut p, mount(k));
    p
}

pub(crate) fn set_mount(p: &mut Parameters, q: [f64; 4]) {
    let first = Parameters::number_of("mount.q_vehicle_from_camera_wxyz").unwrap();
    (first..).zip(q).for_each(|(id, x)| p.set(id, x).unwrap());
}

pub(crate) fn base(k: usize) -> ApidBase {
    ApidBase::try_new(0x110 + 0x10 * k as u16).unwrap()
}

pub(crate) fn setup() -> Setup {
    Setup::new(ApidBase::DEFAULT)
}

/// The picture of a limb with noise, which never repeats.
pub(crate) fn picture(seed: u32) -> Vec<u8> {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
    let noisy = |pixel: u8| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        pixel.saturating_add((state >> 30) as u8)
    };
    limb().into_iter().map(noisy).collect()
}

pub(crate) struct Taken {
    pub(crate) ready_us: u64,
    pub(crate) exposure_us: u64,
    pub(crate) pixels: Vec<u8>,
}

#[derive(Default)]
pub(crate) struct Camera {
    pub(crate) pictures: VecDeque<Taken>,
    pub(crate) pixels: Vec<u8>,
    pub(crate) copies: [Vec<u8>; 2],
    pub(crate) retained: [u32; RETAINED_WORDS],
}

#[derive(Default)]
pub(crate) struct Bench {
    pub(crate) now_us: u64,
    pub(crate) line: VecDeque<u8>,
    pub(crate) sent: Vec<u8>,
    pub(crate) head: usize,
    pub(crate) power_fails: bool,
    pub(crate) cameras: Vec<Camera>,
}

/// The board, which the test holds, too.
pub(crate) struct Shared<'a>(pub(crate) &'a RefCell<Bench>);

impl Board for Shared<'_> {
    fn now_us(&mut self) -> u64 {
        let this = &mut *self.0.borrow_mut();
        this.now_us += 10;
        this.now_us
    }
    fn receive(&mut self) -> Option<u8> {
        let this = &mut *self.0.borrow_mut();
        this.line.pop_front()
    }
    fn send(&mut self, bytes: &[u8]) {
        let this = &mut *self.0.borrow_mut();
        this.sent.extend(bytes);
    }
    fn lift_off(&mut self) -> bool {
        true
    }
    fn power_fails(&mut self) -> bool {
        let this = &mut *self.0.borrow_mut();
        this.power_fails
    }
    fn was_watchdog_reset(&mut self) -> bool {
        false
    }
    fn feed_watchdog(&mut self) {}
    fn camera_answers(&mut self) -> bool {
        true
    }
    fn next_picture(&mut self) -> Option<Picture> {
        let this = &mut *self.0.borrow_mut();
        let camera = &mut this.cameras[this.head];
        camera.pictures.front().filter(|taken| taken.ready_us <= this.now_us)?;
        let taken = camera.pictures.pop_front()?;
        camera.pixels = taken.pixels;
        Some(Picture { bytes: camera.pixels.len(), exposure_us: taken.exposure_us, lost: 0 })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        let this = &mut *self.0.borrow_mut();
        viewer.see(&this.cameras[this.head].pixels);
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        let this = &mut *self.0.borrow_mut();
        into.fill(0xFF);
        let kept = &this.cameras[this.head].copies[usize::from(copy) - 1];
        into[..kept.len()].copy_from_slice(kept);
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        let this = &mut *self.0.borrow_mut();
        this.cameras[this.head].copies[usize::from(copy) - 1] = bytes.to_vec();
        true
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        let this = &mut *self.0.borrow_mut();
        this.cameras[this.head].retained
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        let this = &mut *self.0.borrow_mut();
        this.cameras[this.head].retained = words;
    }
    fn keep_answer(&mut self, _exposure: &Exposure, _report: &Report<f32>) -> bool {
        true
    }
}

impl RigBoard for Shared<'_> {
    fn select_head(&mut self, head: u8) {
        let this = &mut *self.0.borrow_mut();
        this.head = head.into();
    }
    fn picture_checksum(&mut self) -> Option<u32> {
        let this = &mut *self.0.borrow_mut();
        Some(fingerprint(&this.cameras[this.head].pixels))
    }
}

/// Returns a board whose heads have these parameters.
pub(crate) fn board(heads: &[Parameters]) -> RefCell<Bench> {
    let camera = |p: &Parameters| {
        let mut bytes = vec![0; table::MAX_BYTES];
        let n = table::write(p, 1, &mut bytes).unwrap();
        Camera { copies: [bytes[..n].to_vec(), Vec::new()], ..Camera::default() }
    };
    // The line is silent for a while, so that a packet after it is trusted at once.
    RefCell::new(Bench { now_us: 200_000, cameras: heads.iter().map(camera).collect(), ..Bench::default() })
}

/// What was sent.
#[derive(Default)]
pub(crate) struct Sent {
    pub(crate) rig: Vec<RigAnswer>,
    /// The answers of the heads, with the number of the head.
    pub(crate) science: Vec<(usize, PictureAnswer)>,
    pub(crate) attitude: Vec<(usize, AttitudeState)>,
    /// Code, with the base of the computer that answers.
    pub(crate) answers: Vec<(u16, Code)>,
    pub(crate) events: Vec<(u16, Event)>,
}

pub(crate) fn take_sent(board: &RefCell<Bench>) -> Sent {
    let bytes = std::mem::take(&mut board.borrow_mut().sent);
    let (mut rest, mut out) = (&bytes[..], Sent::default());
    let mut assemblies = [const { None::<Assembly> }; 4];
    while let Scan::Packet { end, packet } = packet::scan(rest) {
        rest = &rest[end..];
        let from = &mut Reader::new(packet.user);
        let base = ApidBase::try_new(packet.apid & !0xF).unwrap();
        match base.subject(&packet).unwrap() {
            Apid::Rig => {
                assert_eq!(base, setup().base);
                out.rig.push(RigAnswer::read(from).unwrap());
                assert!(from.rest().is_empty());
            }
            Apid::Acknowledge => {
                out.answers.push((base.number(), Code::from_number(Acknowledge::read(from).unwrap().code).unwrap()));
            }
            Apid::Event => {
                let event = EventRecord::read(from).unwrap();
                out.events.push((base.number(), Event::from_number(event.number).unwrap()));
            }
            apid => {
                let k = usize::from((base.number() - 0x110) / 0x10);
                let assembly = assemblies[k].get_or_insert_default();
                if let Some(Some(picture)) = assembly.take(apid, packet.user) {
                    out.science.push((k, picture.answer));
                    out.attitude.extend(picture.attitude.map(|attitude| (k, attitude)));
                }
            }
        }
    }
    assert!(rest.is_empty());
    out
}

/// Makes a rig of four heads, and lets it fly.
pub(crate) fn fly<R>(board: &RefCell<Bench>, turns: impl FnOnce(&mut Rig<'_, '_, Shared<'_>, 4>) -> R) -> R {
    let (setup, mut rig_buffers, mut lists) = (setup(), RigBuffers::new(), Box::new(Lists::new()));
    let mut buffers = Box::new([const { HeadBuffers::new() }; 4]);
    let (mut cameras, mut heads) = (Shared(board), Box::new(Heads::new()));
    let own = (&mut rig_buffers, &mut *buffers);
    let mut rig = Rig::new(&mut cameras, setup.check().unwrap(), &mut heads, own, &mut lists);
    // The first turn makes the heads, and the second one begins to listen.
    rig.turn();
    rig.turn();
    for k in 0..4 {
        assert_eq!(rig.mode(k), Some(Mode::Flight), "lift-off was seen");
    }
    take_sent(board);
    turns(&mut rig)
}

/// Gives a head a picture that was exposed now and arrives after a time.
pub(crate) fn expose(board: &RefCell<Bench>, k: usize, seed: u32, late_us: u64) {
    let mut board = board.borrow_mut();
    let exposure_us = board.now_us;
    let ready_us = exposure_us + late_us;
    board.cameras[k].pictures.push_back(Taken { ready_us, exposure_us, pixels: picture(seed) });
}

pub(crate) fn expose_all(board: &RefCell<Bench>, seed: u32) {
    (0..4).for_each(|k| expose(board, k, 4 * seed + k as u32, 0));
}

pub(crate) fn ready() -> RefCell<Bench> {
    board(&[0, 1, 2, 3].map(parameters))
}

pub(crate) fn off_z_deg(answer: &RigAnswer) -> f32 {
    let [x, y, _] = answer.axis;
    x.hypot(y).to_degrees()
}

/// Sends a telecommand to a base.
pub(crate) fn send(
    board: &RefCell<Bench>,
    base: u16,
    sequence: u16,
    function: Function,
    arguments: impl Fn(&mut Writer<'_>),
) {
    let mut out = [0; packet::MAX_BYTES];
    let user = |w: &mut Writer<'_>| {
        w.u8(function as u8);
        arguments(w);
    };
    let base = ApidBase::try_new(base).unwrap();
    let n = packet::write(&mut out, base, Apid::Command, sequence, None, user).unwrap();
    board.borrow_mut().line.extend(&out[..n]);
}

/// Runs a turn after a pause of the line.
pub(crate) fn quiet_turn(board: &RefCell<Bench>, rig: &mut Rig<'_, '_, Shared<'_>, 4>) {
    board.borrow_mut().now_us += 200_000;
    rig.turn();
}
