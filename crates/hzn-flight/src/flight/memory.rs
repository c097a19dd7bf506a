//! Bits that changed in memory: the values are made anew, and an answer that was calculated with them is not sent.

use hzn_core::body::Expected;
use hzn_twice::KeptTwice;

use super::Flight;
use super::known::Known;
use super::self_check::NO_PARAMETERS;
use crate::board::Board;
use crate::messages::{Event, Mode};
use crate::store::{self, Choice};

/// What changed, as in [`Event::Repaired`].
const SENSOR: u32 = 1;
const KNOWN: u32 = 2;
const OPERATIONS: u32 = 3;

impl<B: Board> Flight<'_, B> {
    /// Returns whether no bit changed in the values of a picture: sensor, values from navigation, expected limb if
    /// there is one. Changed values are made anew.
    #[inline(never)]
    pub(super) fn check_memory(&mut self, expected: Option<&mut KeptTwice<Expected<f32>>>) -> bool {
        // Two copies show that a bit changed, but not in which of them. Therefore neither is used any more.
        let is_sensor_intact = self.sensor.is_intact();
        let is_known_intact = self.known.is_intact() && expected.is_none_or(KeptTwice::is_intact);
        // Both are compared before one is repaired, so that each of them has its event.
        if is_sensor_intact && is_known_intact {
            return true;
        }
        if !is_sensor_intact {
            self.reload_parameters();
            self.report_repair(SENSOR);
        }
        if !is_known_intact {
            // These values are stored nowhere else. Until navigation sends others, those of the parameters are used.
            self.known.set(Known::default());
            self.known.complete();
            self.report_repair(KNOWN);
        }
        false
    }

    /// Replaces changed parameters of the flight software by the stored ones, and a changed APID base of the line. It
    /// runs at every turn, because these parameters also act without a picture.
    pub(super) fn check_operations(&mut self) {
        if !self.operations.is_intact() {
            self.reload_parameters();
            self.report_repair(OPERATIONS);
        }
        self.buffers.line.set_base(self.operations.get().base());
    }

    /// Reads the stored parameters again, and makes the sensor anew. Parameters that were not stored are lost.
    #[inline(never)]
    fn reload_parameters(&mut self) {
        // The copy that was in use, because after resets by the watchdog it may be the older one.
        let used = self.state.parameter_copy;
        // The buffer of the table is written.
        self.staged = 0;
        let loaded = store::load(&mut self.board, &mut self.buffers.table, Choice::Copy(used));
        // The parameters were checked when they were read, so they make a sensor.
        // Sensor and parameters of the flight software are stored together, so both are replaced.
        if self.renew_sensor(&loaded.parameters) {
            self.sensor.complete();
            self.operations.set(loaded.parameters.operations.clone());
            self.operations.complete();
            (self.state.parameter_copy, self.state.parameter_generation) = (loaded.copy, loaded.generation);
            (self.stored, self.is_not_stored) = (loaded.digest(), loaded.copy == 0);
        }
        // Only the copy that was in use: it was valid when the computer started.
        for (copy, why) in (1u8..).zip(loaded.broken_codes()).filter(|&(copy, why)| copy == used && why > 0) {
            self.send_event(Event::CopyBroken, copy.into(), why);
        }
        if loaded.copy == 0 {
            self.lack_parameters();
        }
    }

    /// Enters safe mode, because the sensor of the default parameters is of no use: another camera has it.
    fn lack_parameters(&mut self) {
        self.send_event(Event::Defaults, 0, 0);
        self.state.self_check |= NO_PARAMETERS;
        self.send_event(Event::SelfCheck, self.state.self_check.into(), 0);
        self.enter_mode(Mode::Safe);
    }

    fn report_repair(&mut self, what: u32) {
        self.state.repairs = self.state.repairs.saturating_add(1);
        self.send_event(Event::Repaired, what, self.state.repairs.into());
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;
    use std::collections::VecDeque;
    use std::vec::Vec;

    use hzn_core::{Prior, Sensor};

    use super::*;
    use crate::answer::PictureAnswer;
    use crate::board::Picture;
    use crate::bytes::{Reader, Writer};
    use crate::flight::{Buffers, Lists};
    use crate::messages::{Exposure, Function};
    use crate::packet::{self, Apid, ApidBase, Scan};
    use crate::parameters::Parameters;
    use crate::table;
    use crate::view::Viewer;

    /// A board that has a picture of a limb at every turn.
    struct Still {
        now_us: u64,
        picture: Vec<u8>,
        line: VecDeque<u8>,
        copies: [Vec<u8>; 2],
        sent: Vec<u8>,
    }

    impl Board for Still {
        fn now_us(&mut self) -> u64 {
            self.now_us += 1000;
            self.now_us
        }
        fn receive(&mut self) -> Option<u8> {
            self.line.pop_front()
        }
        fn send(&mut self, bytes: &[u8]) {
            self.sent.extend(bytes);
        }
        fn lift_off(&mut self) -> bool {
            false
        }
        fn power_fails(&mut self) -> bool {
            false
        }
        fn was_watchdog_reset(&mut self) -> bool {
            false
        }
        fn feed_watchdog(&mut self) {}
        fn camera_answers(&mut self) -> bool {
            true
        }
        fn next_picture(&mut self) -> Option<Picture> {
            Some(Picture { bytes: self.picture.len(), exposure_us: self.now_us, lost: 0 })
        }
        fn show(&mut self, viewer: &mut Viewer<'_>) {
            viewer.see(&self.picture);
        }
        fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
            into.fill(0xFF);
            let kept = &self.copies[usize::from(copy) - 1];
            into[..kept.len()].copy_from_slice(kept);
        }
        fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
            self.copies[usize::from(copy) - 1] = bytes.to_vec();
            true
        }
        fn stack_bytes(&mut self) -> u32 {
            0
        }
    }

    fn small() -> Parameters {
        let mut p = Parameters::defaults();
        for (id, value) in [(1, 160.0), (2, 120.0), (4, 150.0), (5, 150.0), (6, 79.5), (7, 59.5), (304, 1.0)] {
            p.set(id, value).unwrap();
        }
        p
    }

    fn stored(parameters: &Parameters, generation: u32) -> Vec<u8> {
        let mut copy = std::vec![0; table::MAX_BYTES];
        let n = table::write(parameters, generation, &mut copy).unwrap();
        copy.truncate(n);
        copy
    }

    fn board() -> Still {
        // The limb of a body as wide as the Earth at 230 km, 75 degrees below the optical axis.
        let pixel = |i: i32| {
            let (x, y) = ((f64::from(i % 160) - 79.5) / 150.0, (f64::from(i / 160) - 59.5) / 150.0);
            let (sin, cos) = 75f64.to_radians().sin_cos();
            let along = (y * sin + cos) / (x * x + y * y + 1.0).sqrt();
            (100.0 + 90.0 * ((along - 74.8f64.to_radians().cos()) * 150.0).clamp(-1.0, 1.0)) as u8
        };
        let picture = (0..160 * 120).map(pixel).collect();
        let copies = [stored(&small(), 1), Vec::new()];
        Still { now_us: 0, picture, line: VecDeque::new(), copies, sent: Vec::new() }
    }

    /// Runs a turn. Returns the axis, if there is an answer, and whether there is an event.
    fn turn(flight: &mut Flight<'_, Still>) -> (Option<[f32; 3]>, bool) {
        flight.board().sent.clear();
        flight.turn();
        let (mut rest, mut axis, mut event) = (&flight.board.sent[..], None, false);
        while let Scan::Packet { end, packet } = packet::scan(rest) {
            event |= packet.apid == Apid::Event as u16;
            if packet.apid == Apid::Science as u16 {
                let from = &mut Reader::new(packet.user);
                Exposure::read(from).unwrap();
                axis = PictureAnswer::read_science(from).unwrap().direction.map(|direction| direction.axis);
            }
            rest = &rest[end..];
        }
        (axis, event)
    }

    #[test]
    fn a_changed_bit_is_repaired_before_the_next_picture() {
        let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
        let mut flight = Flight::start(board(), &mut buffers, &mut lists).unwrap();
        let right = turn(&mut flight).0;
        assert_eq!(flight.mode, Mode::Flight);
        assert!(right.is_some());
        let mut flips = 0u16;
        for id in small().sensor_numbers() {
            for bit in 0..64 {
                let mut changed = small();
                let value = changed.get(id).unwrap();
                let flipped = f64::from_bits(value.to_bits() ^ 1 << bit);
                if changed.set(id, flipped).is_err() || changed == small() {
                    continue;
                }
                let Ok(sensor) = Sensor::new(&changed.sensor) else { continue };
                *flight.sensor.value_mut() = sensor;
                flight.limiter = crate::flight::Limiter::new();
                assert_eq!(turn(&mut flight), (right, true), "parameter {id}, bit {bit}");
                flips += 1;
                assert_eq!(flight.state.repairs, flips);
            }
        }
        assert!(flips > 400, "{flips}");
        // Wrong values from navigation are not used; the altitude of the parameters replaces them.
        flight.known.value_mut().navigation.prior.altitude_m = Some(5e5);
        assert_eq!(turn(&mut flight), (right, true));
        assert_eq!(turn(&mut flight), (right, false));
    }

    #[test]
    fn a_changed_parameter_of_the_flight_software_is_repaired_before_it_acts() {
        let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
        let mut flight = Flight::start(board(), &mut buffers, &mut lists).unwrap();
        let right = turn(&mut flight).0;
        let stored = flight.operations.get().clone();
        let mut flips = 0u16;
        for &id in crate::operations::Operations::NUMBERS {
            for bit in 0..64 {
                // Whole numbers get every flip that is a value of them, the others smaller values.
                let mut changed = stored.clone();
                let value = stored.get(id).unwrap();
                let value = if value.is_nan() { 1.0 } else { value };
                let flipped = if id < 305 { (value as u64 ^ 1 << bit) as f64 } else { value * 0.5f64.powi(bit) };
                if changed.set(id, flipped) != Some(true) || changed == stored {
                    continue;
                }
                *flight.operations.value_mut() = changed;
                flight.limiter = crate::flight::Limiter::new();
                assert_eq!(turn(&mut flight), (right, true), "parameter {id}, bit {bit}");
                assert_eq!((flight.operations.get(), flight.mode), (&stored, Mode::Flight));
                flips += 1;
                assert_eq!(flight.state.repairs, flips);
            }
        }
        assert!(flips > 150, "{flips}");
        // The line has a copy of the APID base.
        flight.buffers.line.set_base(crate::packet::ApidBase::try_new(512).unwrap());
        assert_eq!(turn(&mut flight), (right, false));
        assert_eq!(flight.buffers.line.base(), stored.base());
    }

    /// Sends a telecommand after a pause and runs two turns, so that the computer sees the pause after it.
    fn send(flight: &mut Flight<'_, Still>, function: Function, arguments: impl Fn(&mut Writer<'_>)) {
        let mut out = [0; packet::MAX_BYTES];
        let user = |w: &mut Writer<'_>| {
            w.u8(function as u8);
            arguments(w);
        };
        let n = packet::write(&mut out, ApidBase::DEFAULT, Apid::Command, 0, None, user).unwrap();
        flight.board.line.extend(&out[..n]);
        let commands = flight.state.commands;
        for _ in 0..2 {
            turn(flight);
            flight.board.now_us += 200_000;
        }
        assert_eq!(flight.state.commands, commands + 1, "{function:?}");
    }

    /// The number of a parameter that a test sets, and its value.
    fn one_pair(w: &mut Writer<'_>) {
        w.u8(1);
        w.u16(81);
        w.f64(2.5);
    }

    #[test]
    fn no_telecommand_copies_a_changed_bit() {
        for mode in [Mode::Flight, Mode::Standby, Mode::Safe] {
            for function in [Function::SetParameters, Function::TryParameters] {
                let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
                let mut flight = Flight::start(board(), &mut buffers, &mut lists).unwrap();
                send(&mut flight, Function::SetMode, |w| w.u8(mode as u8));
                let mut changed = small();
                changed.set(32, 486.0).unwrap();
                *flight.sensor.value_mut() = Sensor::new(&changed.sensor).unwrap();
                flight.known.value_mut().navigation.prior.altitude_m = Some(5e5);
                send(&mut flight, function, one_pair);
                assert_eq!(flight.state.repairs, 2, "{function:?} in {mode:?}");
                let mut right = small();
                right.set(81, 2.5).unwrap();
                assert_eq!(*flight.sensor.get().config(), right.sensor, "{function:?} in {mode:?}");
                assert_eq!(flight.known.get().navigation.prior.altitude_m, None);
                let newest = table::read(&flight.board.copies[1]).map(|(parameters, _)| parameters);
                assert_eq!(newest.ok(), (function == Function::SetParameters).then_some(right));
            }
            let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
            let mut flight = Flight::start(board(), &mut buffers, &mut lists).unwrap();
            send(&mut flight, Function::SetMode, |w| w.u8(mode as u8));
            for function in [Function::SetKnown, Function::Navigate, Function::SetAttitude] {
                flight.known.value_mut().level = Some(7);
                send(&mut flight, function, |w| {
                    if function == Function::SetAttitude {
                        w.u64(0);
                        return [f32::NAN; 9].into_iter().for_each(|x| w.f32(x));
                    }
                    if function == Function::Navigate {
                        w.u64(0);
                        w.f32(f32::NAN);
                    }
                    w.f32(230e3);
                    let unknown = if function == Function::Navigate { 9 } else { 3 };
                    (0..unknown).for_each(|_| w.f32(f32::NAN));
                });
                assert_ne!(flight.known.get().level, Some(7), "{function:?} in {mode:?}");
            }
        }
    }

    #[test]
    fn memory_is_compared_in_every_mode_before_housekeeping() {
        for mode in [Mode::Flight, Mode::Standby, Mode::Safe] {
            let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
            let mut flight = Flight::start(board(), &mut buffers, &mut lists).unwrap();
            send(&mut flight, Function::SetMode, |w| w.u8(mode as u8));
            flight.known.value_mut().navigation.prior.altitude_m = Some(5e5);
            flight.board.now_us += 5_000_000;
            assert!(turn(&mut flight).1, "{mode:?}");
            assert_eq!((flight.state.repairs, flight.mode), (1, mode));
        }
    }

    /// Flips a bit of the sensor with these copies in memory, and runs a turn.
    fn flip_with(copies: [Vec<u8>; 2], flight: &mut Flight<'_, Still>) {
        // The first turn makes the second copies in memory.
        turn(flight);
        flight.board.copies = copies;
        let mut changed = small();
        changed.set(32, 486.0).unwrap();
        *flight.sensor.value_mut() = Sensor::new(&changed.sensor).unwrap();
        turn(flight);
        assert_eq!(flight.state.repairs, 1);
    }

    #[test]
    fn a_repair_uses_the_other_copy_if_that_in_use_is_broken() {
        let mut older = small();
        older.set(81, 2.5).unwrap();
        for used in [1usize, 2] {
            let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
            let mut copies = [stored(&older, 7), stored(&older, 7)];
            copies[used - 1] = stored(&small(), 8);
            let mut flight =
                Flight::start(Still { copies: copies.clone(), ..board() }, &mut buffers, &mut lists).unwrap();
            assert_eq!(usize::from(flight.state.parameter_copy), used);
            copies[used - 1][40] ^= 1;
            flip_with(copies, &mut flight);
            let now = (flight.state.parameter_copy, flight.state.parameter_generation, flight.mode);
            assert_eq!(now, (3 - used as u8, 7, Mode::Flight));
            assert_eq!(*flight.sensor.get().config(), older.sensor);
        }
    }

    #[test]
    fn a_repair_without_a_valid_copy_ends_in_safe_mode() {
        let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
        let mut flight = Flight::start(board(), &mut buffers, &mut lists).unwrap();
        flip_with([Vec::new(), Vec::new()], &mut flight);
        assert_eq!((flight.mode, flight.state.self_check), (Mode::Safe, 4));
        assert_eq!(flight.state.pictures, 1, "no picture is processed with the default sensor");
        assert_eq!(turn(&mut flight).0, None);
        // No repair ends the mode shut-down.
        flight.enter_mode(Mode::ShutDown);
        flight.operations.value_mut().housekeeping_every = 11;
        turn(&mut flight);
        assert_eq!(flight.mode, Mode::ShutDown);
    }

    #[test]
    fn an_expected_limb_that_changed_is_noticed() {
        let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
        let mut flight = Flight::start(board(), &mut buffers, &mut lists).unwrap();
        let expect = |h: f32| flight.sensor.get().expect(&Prior { altitude_m: Some(h), ..Prior::default() }).unwrap();
        let (mut expected, other) = (KeptTwice::new(expect(230e3)), expect(231e3));
        expected.complete();
        assert!(flight.check_memory(Some(&mut expected)));
        *expected.value_mut() = other;
        assert!(!flight.check_memory(Some(&mut expected)));
    }
}
