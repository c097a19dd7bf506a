//! Arbitrary streams to and from a flight computer.

use hzn_flight::answer::PictureAnswer;
use hzn_flight::assembly::Assembly;
use hzn_flight::board::{Board, Picture};
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::messages::{Acknowledge, EdgePart, EventRecord, Exposure, Housekeeping};
use hzn_flight::packet::{self, Apid, ApidBase, Scan};
use hzn_flight::view::Viewer;
use hzn_flight::{Parameters, table};

use crate::input::Input;

/// A stream from the flight computer: every packet in it is read as every kind of message.
pub(crate) fn telemetry(bytes: &[u8]) {
    let mut rest = bytes;
    let mut assembly = Assembly::default();
    loop {
        let before = rest.len();
        let skip = match packet::scan(rest) {
            Scan::Packet { end, packet } => {
                read_messages(packet.user);
                if let Some(apid) = ApidBase::DEFAULT.subject(&packet) {
                    let _ = assembly.take(apid, packet.user);
                }
                end
            }
            Scan::Bad { skip } => skip,
            Scan::More { .. } => break,
        };
        rest = rest.get(skip..).expect("the scan stays within the bytes");
        assert!(rest.len() < before, "the scan goes on");
    }
    read_messages(bytes);
}

fn read_messages(user: &[u8]) {
    let from = || Reader::new(user);
    let _ = (Housekeeping::read(&mut from()), Acknowledge::read(&mut from()), EventRecord::read(&mut from()));
    let _ = (Exposure::read(&mut from()), EdgePart::read(&mut from()));
    if let Some(answer) = PictureAnswer::read(&mut from()) {
        let mut out = [0; packet::MAX_BYTES];
        let mut writer = Writer::new(&mut out);
        answer.write(&mut writer);
        let n = writer.finish().expect("an answer fits into a packet");
        let again = PictureAnswer::read(&mut Reader::new(&out[..n])).expect("a written answer can be read");
        let bytes = |answer: &PictureAnswer| {
            let mut out = [0; packet::MAX_BYTES];
            let mut writer = Writer::new(&mut out);
            answer.write(&mut writer);
            out
        };
        assert_eq!(bytes(&answer), bytes(&again), "an answer comes back with every bit");
        let _ = answer.to_report();
    }
}

/// A board whose line gives the bytes and whose camera gives small pictures.
struct Ground<'a> {
    line: Input<'a>,
    now_us: u64,
    pixels: Vec<u8>,
    copies: [Vec<u8>; 2],
}

impl Board for Ground<'_> {
    fn now_us(&mut self) -> u64 {
        self.now_us += 10;
        self.now_us
    }
    fn receive(&mut self) -> Option<u8> {
        if self.line.0.is_empty() { None } else { Some(self.line.byte()) }
    }
    fn send(&mut self, bytes: &[u8]) {
        assert!(matches!(packet::scan(bytes), Scan::Packet { .. }), "every packet that is sent is valid");
    }
    fn lift_off(&mut self) -> bool {
        self.now_us.is_multiple_of(77)
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
        let bytes = self.pixels.len();
        self.now_us.is_multiple_of(3).then_some(Picture { bytes, exposure_us: self.now_us, lost: 0 })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        viewer.see(&self.pixels);
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        let kept = &self.copies[usize::from(copy) % 2];
        into.fill(0xFF);
        into.iter_mut().zip(kept).for_each(|(to, from)| *to = *from);
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        self.copies[usize::from(copy) % 2] = bytes.to_vec();
        true
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
}

/// A stream to the flight computer. Each part that begins with a length is sent as the arguments of a valid packet, so
/// that the fuzzer does not have to find the CRC; the rest is sent as it is.
pub(crate) fn telecommand(bytes: &[u8]) {
    let mut input = Input(bytes);
    let mut line = Vec::new();
    for sequence in 0..input.below(6) as u16 {
        let length = usize::from(input.byte()).min(input.0.len());
        let (user, rest) = input.0.split_at(length);
        input.0 = rest;
        let mut out = [0; packet::MAX_BYTES];
        let n = packet::write(&mut out, ApidBase::default(), Apid::Command, sequence, None, |w| w.bytes(user));
        line.extend_from_slice(&out[..n.unwrap_or(0)]);
    }
    line.extend_from_slice(input.rest());
    let pixels = (0..640 * 480).map(|i| if i > 640 * 200 { 200 } else { 10 }).collect();
    let board = Ground { line: Input(&line), now_us: 0, pixels, copies: [Vec::new(), Vec::new()] };
    let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
    let mut flight = Flight::start(board, &mut buffers, &mut lists).expect("the defaults can fly");
    for _ in 0..16 {
        flight.turn();
    }
}

/// A stored table of parameters, and parameters of any number and value.
pub(crate) fn parameters(bytes: &[u8]) {
    let _ = table::generation(bytes);
    if let Ok((parameters, generation)) = table::read(bytes) {
        let mut out = vec![0; table::MAX_BYTES];
        let n = table::write(&parameters, generation, &mut out).expect("a table that was read fits");
        let (again, same) = table::read(&out[..n]).expect("a table that was written can be read");
        assert_eq!((again, same), (parameters, generation));
    }
    let (mut input, mut parameters) = (Input(bytes), Parameters::defaults());
    while !input.0.is_empty() {
        let (number, value) = (input.word() % 400, input.number());
        if parameters.set(number, value).is_ok() {
            let found = parameters.get(number).expect("a parameter that was set");
            // NaN is the value of an optional parameter that is not set.
            let same = (found - value).abs() <= 1e-6 * value.abs() || found == value;
            assert!(same || value.is_nan() && found.is_nan(), "{number}: {value} {found}");
        }
    }
    if parameters.check().is_ok() {
        let _ = hzn_core::Sensor::<f32>::new(&parameters.sensor);
    }
}
