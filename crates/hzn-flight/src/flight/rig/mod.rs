//! One to four heads, each with a loop of its own, and their joint answer.
//!
//! A head is a whole flight loop ([`Flight`]) with its own parameters, mode, telecommands and packets, which
//! `line.apid_base` of its parameters tells apart on the line. Its packets are those of a computer with one camera, to
//! the last bit. A camera that is silent, late or blinded, and a head that is switched off by its mode, therefore cost
//! only themselves. The rig has an APID base of its own: it sends a packet with the joint answer of each epoch
//! ([`RigAnswer`]), and it takes the telecommands that are meant for all heads.
//!
//! | telecommand to the rig's base | what it does |
//! |---|---|
//! | `mode`, `time`, `process-once`, `reset-counters`, `report`, `arm` | each head carries it out |
//! | `known`, `navigate`, `attitude` | the same; rate, attitude and Sun are in the axes of the vehicle, see below |
//! | `ping` | the rig answers |
//! | others, such as `set` | refused, because they are meant for one head: send them to its base |
//!
//! The mount of a head is `mount.q_vehicle_from_camera_wxyz` of its parameters. Each head turns rate, attitude and Sun
//! from the vehicle's axes to its own. A head without a mount works on, but has no part in the joint answer.

mod commands;
mod epoch;
mod head_board;

use core::array;

use hzn_core::error::{ConfigError, Limit};
use hzn_core::rig::{self, Answered, Common, Limb, MOST_HEADS, Mount};
use hzn_twice::KeptTwice;

use super::line::Line;
use super::uplink::Uplink;
use super::{Flight, HeadBuffers, Lists};
use crate::board::Board;
use crate::joint::RigAnswer;
use crate::messages::Mode;
use crate::packet::{Apid, ApidBase};
use epoch::{Pending, Place};
pub use head_board::{HeadBoard, RigBoard, fingerprint};

/// What the heads share. Keep it in flash.
#[derive(Debug, Clone)]
pub struct Setup {
    /// APID base of the rig. That of each head is in its parameters; all must differ.
    pub base: ApidBase,
    /// Longest time between two exposures of one epoch, µs.
    pub sync_us: u64,
    /// Time after the first exposure of an epoch at which it ends without the heads that are late, µs. Allow for the
    /// calculation of all heads.
    pub wait_us: u64,
    /// Probabilities of the check of each head by the others.
    pub check: rig::Config,
    /// 1σ of a tilt of the limb, km; `None` derives it from the half-angle.
    pub limb_tilt_sigma_km: Option<f64>,
    /// 1σ of the limb height that each head has for itself, km.
    pub limb_own_sigma_km: f64,
    /// Distance along the limb at which the correlation of that height has fallen to exp(−½), km.
    pub limb_own_length_km: f64,
    /// 1σ of the attitude of the rig on the vehicle about each axis, rad.
    pub sigma_rad: f64,
    /// Covariance of the mount of each head: xx, xy, xz, yy, yz, zz of a small rotation about the axes of the vehicle,
    /// rad².
    pub mounts_rad2: [[f32; 6]; MOST_HEADS],
    /// Number of the limb that each head sees, 0 to 3: heads of different bands see limbs of different heights.
    pub limb_groups: [u8; MOST_HEADS],
}

impl Setup {
    /// The values of a rig.toml that has none, for cameras that are triggered together. Its mounts are exact.
    pub const fn new(base: ApidBase) -> Self {
        Self {
            base,
            sync_us: 100_000,
            wait_us: 500_000,
            check: rig::Config::DEFAULT,
            limb_tilt_sigma_km: None,
            limb_own_sigma_km: Limb::<f32>::OWN_SIGMA_KM,
            limb_own_length_km: Limb::<f32>::OWN_LENGTH_KM,
            sigma_rad: 0.0,
            mounts_rad2: [[0.0; 6]; MOST_HEADS],
            limb_groups: [0; MOST_HEADS],
        }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// A number is out of its limits, which are those of rig.toml.
    pub fn check(&self) -> Result<CheckedSetup<'_>, ConfigError> {
        Ok(CheckedSetup { joining: self.joining()?, setup: self })
    }

    fn joining(&self) -> Result<Joining, ConfigError> {
        let numbers = [
            ("rig.limb_tilt_sigma_km", self.limb_tilt_sigma_km.unwrap_or(0.0), 0.0, 100.0),
            ("rig.limb_own_sigma_km", self.limb_own_sigma_km, 0.0, 100.0),
            ("rig.limb_own_length_km", self.limb_own_length_km, 1.0, 1e6),
            ("rig.mount.sigma_deg", self.sigma_rad, 0.0, 1.0),
        ];
        if let Some((field, value, low, high)) = numbers.iter().find(|(_, x, low, high)| !(low..=high).contains(&x)) {
            return Err(ConfigError { field, value: *value, limit: Limit::Between(*low, *high), body: None });
        }
        let limb = Limb {
            radius_km: 0.0,
            tilt_sigma_km: self.limb_tilt_sigma_km.map(|x| x as f32),
            own_sigma_km: self.limb_own_sigma_km as f32,
            own_length_km: self.limb_own_length_km as f32,
        };
        let common = Common { limb, sigma_rad: self.sigma_rad as f32 };
        Ok(Joining { rig: rig::Rig::new(&self.check)?, common })
    }
}

/// A setup whose numbers are possible.
#[derive(Debug, Clone, Copy)]
pub struct CheckedSetup<'a> {
    setup: &'a Setup,
    joining: Joining,
}

/// The check of the heads and what they share, ready for use.
#[derive(Debug, Clone, Copy)]
struct Joining {
    rig: rig::Rig<f32>,
    common: Common<f32>,
}

/// The memory of the rig in addition to that of its heads; keep it in a `static`.
#[derive(Debug)]
pub struct RigBuffers {
    line: Line,
    uplink: Uplink,
}

impl Default for RigBuffers {
    fn default() -> Self {
        Self::new()
    }
}

impl RigBuffers {
    /// Makes buffers of all zeros.
    pub const fn new() -> Self {
        Self { line: Line::new(), uplink: Uplink::new() }
    }
}

/// The loops of the heads, 15 KB each; keep them in a `static`.
#[derive(Debug)]
pub struct Heads<'a, B, const N: usize> {
    // Not an array of options, which would not be all zeros and would take flash.
    loops: heapless::Vec<Flight<'a, HeadBoard<'a, B>>, N>,
}

impl<B, const N: usize> Default for Heads<'_, B, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<B, const N: usize> Heads<'_, B, N> {
    /// Makes room for the heads, of all zeros.
    pub const fn new() -> Self {
        const { assert!(N >= 1 && N <= MOST_HEADS, "a rig has one to four heads") };
        Self { loops: heapless::Vec::new() }
    }
}

/// The flight software of a rig with `N` heads, 1 to 4. Keep it where it is once it has made a turn.
#[derive(Debug)]
pub struct Rig<'h, 'a, B, const N: usize> {
    /// `None` while it is lent to a head.
    board: Option<&'a mut B>,
    setup: &'a Setup,
    buffers: &'a mut RigBuffers,
    lists: Option<&'a mut Lists>,
    /// The buffers of the heads, until the first turn.
    start: Option<&'a mut [HeadBuffers; N]>,
    heads: &'h mut Heads<'a, B, N>,
    // Kept twice like the sensors: they outlive a turn.
    joining: KeptTwice<Joining>,
    pending: KeptTwice<Pending>,
    /// Number of the last epoch.
    number: u32,
    repairs: u16,
}

impl<'h, 'a, B: RigBoard, const N: usize> Rig<'h, 'a, B, N> {
    /// Makes a rig. The first turn loads the parameters of the heads and runs their self-checks.
    pub fn new(
        board: &'a mut B,
        setup: CheckedSetup<'a>,
        heads: &'h mut Heads<'a, B, N>,
        buffers: (&'a mut RigBuffers, &'a mut [HeadBuffers; N]),
        lists: &'a mut Lists,
    ) -> Self {
        let (buffers, start) = buffers;
        buffers.line.set_base(setup.setup.base);
        Self {
            board: Some(board),
            setup: setup.setup,
            buffers,
            lists: Some(lists),
            start: Some(start),
            heads,
            joining: KeptTwice::new(setup.joining),
            pending: KeptTwice::new(Pending::NONE),
            number: 0,
            repairs: 0,
        }
    }

    /// Makes the loops of the heads, one after the other, so that the stack holds one of them.
    #[inline(never)]
    fn load(&mut self, buffers: &'a mut [HeadBuffers; N]) {
        // A second call of `new` with the same heads begins anew.
        self.heads.loops.clear();
        for (buffers, head) in buffers.iter_mut().zip(0u8..) {
            let flight = Flight::start_with(HeadBoard::new(head, self.board.take()), buffers, None, None);
            // There is room for all of them.
            if let Some(flight) = flight {
                let _ = self.heads.loops.push(flight);
            }
            self.board = self.heads.loops.last_mut().and_then(|flight| flight.board.lent.take());
        }
    }

    /// Returns the board.
    pub fn board(&mut self) -> Option<&mut B> {
        self.board.as_deref_mut()
    }

    /// Lends the board and the lists to a head for a call. `None` if there is no such head.
    fn with_head<R>(&mut self, k: usize, call: impl FnOnce(&mut Flight<'a, HeadBoard<'a, B>>) -> R) -> Option<R> {
        let flight = self.heads.loops.get_mut(k)?;
        (flight.board.lent, flight.workspace) = (self.board.take(), self.lists.take());
        let result = call(flight);
        (self.board, self.lists) = (flight.board.lent.take(), flight.workspace.take());
        Some(result)
    }

    /// Returns the loops of the heads.
    fn loops(&self) -> impl Iterator<Item = &Flight<'a, HeadBoard<'a, B>>> {
        self.heads.loops.iter()
    }

    /// Returns the mode of a head; `None` before the first turn, or if there is no such head.
    pub fn mode(&self, head: usize) -> Option<Mode> {
        self.heads.loops.get(head).map(Flight::mode)
    }

    /// Runs one turn of every head, with at most one telecommand and one picture of each. Call it for ever.
    pub fn turn(&mut self) {
        match self.start.take() {
            Some(buffers) => self.load(buffers),
            // No telecommand comes before the self-checks, or writes parameters while power is being cut.
            None if self.is_powered() => self.listen(),
            None => {}
        }
        self.joining.complete();
        self.pending.complete();
        for k in 0..N {
            self.with_head(k, Flight::turn);
        }
        self.check_memory();
        for k in 0..N {
            if let Some(answer) = self.with_head(k, take_answer).flatten() {
                self.add(k, answer);
            }
        }
        let Some(opened_us) = self.pending.get().opened_us() else { return };
        let is_complete = self.expected() & !self.pending.get().seen() == 0;
        if is_complete || self.now_us().saturating_sub(opened_us) >= self.setup.wait_us {
            self.close();
        }
    }

    fn is_powered(&mut self) -> bool {
        let fails = self.board().is_some_and(B::power_fails);
        !fails && self.loops().any(|flight| flight.mode != Mode::ShutDown)
    }

    fn now_us(&mut self) -> u64 {
        self.board().map_or(0, B::now_us)
    }

    /// Adds the answer of a head to its epoch. An answer that comes after its epoch has no part in a joint answer.
    fn add(&mut self, k: usize, answer: head_board::HeadAnswer) {
        let place = |pending: &Pending| pending.place(k, answer.exposure_us, self.setup.sync_us);
        match place(self.pending.get()) {
            Place::Late => return,
            Place::Next => self.close(),
            Place::Here => {}
        }
        self.pending.change(|pending| pending.add(k, answer));
    }

    /// Returns the heads that should have a picture.
    fn expected(&self) -> u8 {
        let is_expected = |flight: &Flight<'_, _>| flight.mode == Mode::Flight && !flight.camera.is_silent();
        self.loops().enumerate().fold(0, |set, (k, flight)| set | u8::from(is_expected(flight)) << k)
    }

    /// Replaces values whose bits changed in memory. The epoch is lost.
    fn check_memory(&mut self) {
        let is_pending_intact = self.pending.is_intact();
        if self.joining.is_intact() && is_pending_intact {
            return;
        }
        // They were accepted at the start.
        if let Ok(joining) = self.setup.joining() {
            self.joining.set(joining);
        }
        self.pending.set(Pending::NONE);
        self.joining.complete();
        self.pending.complete();
        self.repairs = self.repairs.saturating_add(1);
    }

    /// Joins the answers of the epoch and sends the joint answer.
    #[inline(never)]
    fn close(&mut self) {
        let heads_expected = self.expected();
        let epoch = self.pending.change(Pending::close);
        let Some(opened_us) = epoch.opened_us() else { return };
        let Joining { rig, mut common } = *self.joining.get();
        let Some(first) = self.loops().next() else { return };
        let body = &first.sensor.get().config().body;
        common.limb.radius_km = (body.mean_radius_km() + body.limb_height_km) as f32;
        let mounts: [Option<Mount<f32>>; MOST_HEADS] = array::from_fn(|k| self.mount(k));
        let answered: [Option<Answered<'_, f32>>; MOST_HEADS] = array::from_fn(|k| {
            let head = epoch.heads.get(k)?.as_ref().filter(|_| epoch.repeated >> k & 1 == 0)?;
            // A head that looks for another body sees another direction.
            let sensor = self.heads.loops.get(k)?.sensor.get();
            Some(Answered {
                solution: head.solution.as_ref().filter(|_| sensor.config().body.kind == body.kind)?,
                camera: sensor.camera(),
                mount: mounts.get(k)?.as_ref()?,
                time_s: Some((head.exposure_us - opened_us) as f32 * 1e-6),
                rate_rad_s: head.rate_rad_s,
                limb_group: self.setup.limb_groups.get(k).copied().unwrap_or_default(),
            })
        });
        let joint = rig.join_epoch(&common, &answered);
        self.number = self.number.wrapping_add(1);
        let exposure_us = opened_us + (joint.time_s.unwrap_or(0.0) * 1e6) as u64;
        let picture = |k: usize| epoch.heads.get(k).and_then(|head| Some(head.as_ref()?.picture)).unwrap_or(0);
        let record = RigAnswer {
            epoch: self.number,
            exposure_us,
            status: epoch.status() as u8,
            heads_expected,
            heads_seen: epoch.seen(),
            heads_answered: answered.iter().enumerate().fold(0, |set, (k, head)| set | u8::from(head.is_some()) << k),
            heads_excluded: epoch.repeated,
            heads_repeated: epoch.repeated,
            repairs: self.repairs,
            picture_0: picture(0),
            picture_1: picture(1),
            picture_2: picture(2),
            picture_3: picture(3),
            ..RigAnswer::default()
        };
        let record = record.with(&joint);
        self.send(exposure_us, Apid::Rig, |out| record.write(out));
        if let Some(board) = self.board() {
            board.keep_joint(&record);
        }
    }

    fn mount(&self, k: usize) -> Option<Mount<f32>> {
        let q = self.heads.loops.get(k)?.vehicle_from_camera()?;
        Mount::new([1.0, 0.0, 0.0, 0.0], q, self.setup.mounts_rad2.get(k)?)
    }

    /// Sends a packet of the rig with a time on the board's clock. Its time code is that of the first head.
    fn send(&mut self, clock_us: u64, apid: Apid, user: impl FnOnce(&mut crate::bytes::Writer<'_>)) {
        let Some(time) = self.loops().next().map(|first| first.buffers.line.clock.at(clock_us)) else { return };
        if let Some(board) = self.board.as_deref_mut() {
            self.buffers.line.send(board, apid, time, user);
        }
    }
}

/// Takes the answer of this turn, with the rate that its picture was processed with.
fn take_answer<B: RigBoard>(flight: &mut Flight<'_, HeadBoard<'_, B>>) -> Option<head_board::HeadAnswer> {
    let answer = flight.board.answer.take()?;
    let rate_rad_s = flight.known.get().at(answer.exposure_us, flight.body()).rate_rad_s;
    Some(head_board::HeadAnswer { rate_rad_s, ..answer })
}

impl<B: Board> Flight<'_, B> {
    /// Returns the rotation from the camera to the vehicle, scalar first; `None` without a mount.
    fn vehicle_from_camera(&self) -> Option<[f32; 4]> {
        self.sensor.get().config().mount.map(|mount| mount.q_vehicle_from_camera_wxyz.map(|x| x as f32))
    }
}

#[cfg(test)]
mod tests;
