//! A board that is made of vectors, and the ground that talks to it.

use std::collections::VecDeque;

use hzn_core::{Config, Report, pixel};
use hzn_flight::authentication::{KEY_BYTES, KEYS};
use hzn_flight::board::{Board, Image, Picture, RETAINED_WORDS};
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::cuc::Cuc;
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::messages::{
    Acknowledge, AttitudeState, Code, EDGE_PIXELS, EdgePart, EdgePixel, Event, EventRecord, Exposure, Function,
    Housekeeping, NavigationState, ParameterValue,
};
use hzn_flight::packet::{self, Apid, ApidBase, Scan};
use hzn_flight::view::{ROWS_HELD, RowMemory, Viewer};
use hzn_flight::{Parameters, answer::PictureAnswer, assembly::Assembly, layout, table};

pub(crate) const WIDTH: usize = 640;
pub(crate) const HEIGHT: usize = 480;

/// Memory for the rows of a picture.
pub(crate) type Rows = RowMemory<{ ROWS_HELD as usize * WIDTH }, HEIGHT, 8192, 2560>;

/// The memory of a board for keys.
#[derive(Clone)]
pub(crate) struct KeyMemory {
    pub(crate) stored: [[u8; KEY_BYTES]; KEYS],
    pub(crate) counters: [Option<u64>; KEYS],
    pub(crate) is_write_protected: bool,
    /// Whether the memory says that it has written, and keeps the old counter.
    pub(crate) forgets: bool,
    pub(crate) writes: u32,
}

impl Default for KeyMemory {
    fn default() -> Self {
        Self {
            stored: [[0xFF; KEY_BYTES]; KEYS],
            counters: [None; KEYS],
            is_write_protected: false,
            forgets: false,
            writes: 0,
        }
    }
}

#[derive(Default)]
pub(crate) struct Bench {
    pub(crate) now_us: u64,
    pub(crate) line: VecDeque<u8>,
    pub(crate) sent: Vec<u8>,
    pub(crate) pictures: VecDeque<(Vec<u8>, u32)>,
    pub(crate) pixels: Vec<u8>,
    /// The memory for rows of a board that has none for a picture.
    pub(crate) rows: Option<Box<Rows>>,
    /// Whether the log of answers cannot be written.
    pub(crate) log_fails: bool,
    /// Number of rows that the camera sends.
    pub(crate) rows_sent: usize,
    pub(crate) copies: [Vec<u8>; 2],
    /// Bytes that can still be written before power is cut.
    pub(crate) power: Option<usize>,
    pub(crate) pulse_us: Option<u64>,
    pub(crate) lift_off: bool,
    pub(crate) power_fails: bool,
    pub(crate) camera_is_dead: bool,
    pub(crate) fed: u32,
    pub(crate) watchdog_reset: bool,
    pub(crate) retained: [u32; RETAINED_WORDS],
    pub(crate) camera_temperature_c: Option<f32>,
    /// The parameters of the sensor that is in use.
    pub(crate) noted: Option<Config>,
    /// Number of writes of a copy of the parameters.
    pub(crate) writes: u32,
    /// `None`: the board never had keys.
    pub(crate) keys: Option<KeyMemory>,
}

impl Board for Bench {
    fn now_us(&mut self) -> u64 {
        self.now_us += 10;
        self.now_us
    }
    fn pulse_us(&mut self) -> Option<u64> {
        self.pulse_us
    }
    fn receive(&mut self) -> Option<u8> {
        self.line.pop_front()
    }
    fn send(&mut self, bytes: &[u8]) {
        self.sent.extend(bytes);
    }
    fn lift_off(&mut self) -> bool {
        self.lift_off
    }
    fn power_fails(&mut self) -> bool {
        self.power_fails
    }
    fn was_watchdog_reset(&mut self) -> bool {
        self.watchdog_reset
    }
    fn feed_watchdog(&mut self) {
        self.fed += 1;
    }
    fn camera_answers(&mut self) -> bool {
        !self.camera_is_dead
    }
    fn camera_temperature_c(&mut self) -> Option<f32> {
        self.camera_temperature_c
    }
    fn next_picture(&mut self) -> Option<Picture> {
        let (pixels, lost) = self.pictures.pop_front()?;
        self.pixels = pixels;
        Some(Picture { bytes: self.pixels.len(), exposure_us: self.now_us, lost })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        let Some(memory) = &mut self.rows else { return viewer.see(&self.pixels) };
        let Some(mut rows) = viewer.rows(memory) else { return };
        self.pixels.chunks(WIDTH).take(self.rows_sent).for_each(|row| rows.push(row));
        rows.finish();
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        into.fill(0xFF);
        let kept = &self.copies[usize::from(copy) - 1];
        into[..kept.len()].copy_from_slice(kept);
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        let n = self.power.unwrap_or(bytes.len()).min(bytes.len());
        self.writes += 1;
        // The memory is erased before it is written.
        self.copies[usize::from(copy) - 1] = bytes[..n].to_vec();
        n == bytes.len()
    }
    fn has_keys(&mut self) -> bool {
        self.keys.is_some()
    }
    fn read_key(&mut self, place: u8, into: &mut [u8; KEY_BYTES]) {
        if let Some(keys) = &self.keys {
            *into = keys.stored[usize::from(place)];
        }
    }
    fn read_counter(&mut self, place: u8) -> Option<u64> {
        self.keys.as_ref()?.counters[usize::from(place)]
    }
    fn write_counter(&mut self, place: u8, counter: u64) -> bool {
        let Some(keys) = &mut self.keys else { return false };
        keys.writes += 1;
        if !keys.is_write_protected && !keys.forgets {
            keys.counters[usize::from(place)] = Some(counter);
        }
        !keys.is_write_protected
    }
    fn note_sensor(&mut self, config: &Config) {
        self.noted = Some(config.clone());
    }
    fn stack_bytes(&mut self) -> u32 {
        1234
    }
    fn image(&mut self) -> Image {
        Image { build: 7, crc: 0xCAFE_F00D }
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        self.retained
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        self.retained = words;
    }
    fn keep_answer(&mut self, _exposure: &Exposure, _report: &Report<f32>) -> bool {
        !self.log_fails
    }
}

/// Draws sky above and ground below the limb of a body as wide as the Earth at 230 km.
pub(crate) fn limb() -> Vec<u8> {
    (0..WIDTH * HEIGHT)
        .map(|i| {
            let (x, y) = ((i % WIDTH) as f64 - 319.5, (i / WIDTH) as f64 - 239.5);
            // The axis is 75 degrees below the optical axis, and the half-angle is 74.8 degrees.
            let (sin, cos) = 75f64.to_radians().sin_cos();
            let ray = [x / 600.0, y / 600.0, 1.0];
            let along = (ray[1] * sin + cos) / (ray[0] * ray[0] + ray[1] * ray[1] + 1.0).sqrt();
            let edge = ((along - 74.8f64.to_radians().cos()) * 600.0).clamp(-1.0, 1.0);
            (100.0 + 90.0 * edge) as u8
        })
        .collect()
}

pub(crate) fn stored(generation: u32) -> Vec<u8> {
    let mut p = Parameters::defaults();
    p.set(33, f64::from(generation)).unwrap();
    let mut bytes = vec![0; table::MAX_BYTES];
    let n = table::write(&p, generation, &mut bytes).unwrap();
    bytes.truncate(n);
    bytes
}

pub(crate) fn ready() -> Bench {
    Bench { copies: [stored(1), stored(2)], ..Bench::default() }
}

pub(crate) fn fly<R>(bench: Bench, turns: impl FnOnce(&mut Flight<'_, Bench>) -> R) -> R {
    let (mut buffers, mut workspace) = (Box::new(Buffers::new()), Box::new(Lists::new()));
    let mut flight = Flight::start(bench, &mut buffers, &mut workspace).unwrap();
    // The line is silent for a while, so that a packet after it is trusted at once.
    flight.board().now_us += 200_000;
    let pictures = std::mem::take(&mut flight.board().pictures);
    flight.turn();
    flight.board().pictures = pictures;
    turns(&mut flight)
}

pub(crate) fn command(sequence: u16, function: Function, arguments: impl FnOnce(&mut Writer<'_>)) -> Vec<u8> {
    let mut out = [0; packet::MAX_BYTES];
    let user = |w: &mut Writer<'_>| {
        w.u8(function as u8);
        arguments(w);
    };
    let n = packet::write(&mut out, ApidBase::DEFAULT, Apid::Command, sequence, None, user).unwrap();
    out[..n].to_vec()
}

#[derive(Debug, Default)]
pub(crate) struct Sent {
    pub(crate) housekeeping: Vec<Housekeeping>,
    pub(crate) science: Vec<(Exposure, PictureAnswer)>,
    pub(crate) navigation: Vec<NavigationState>,
    pub(crate) attitude: Vec<AttitudeState>,
    /// The times of the packets, in their order.
    pub(crate) times: Vec<(Apid, Cuc)>,
    /// What was refused, of every acknowledgement.
    pub(crate) details: Vec<u16>,
    pub(crate) events: Vec<(Event, u32, u32)>,
    pub(crate) answers: Vec<(u8, u16, Code)>,
    pub(crate) parameters: Vec<(u16, f64)>,
    pub(crate) edge: Vec<pixel::Pixel>,
}

/// Returns everything that was sent since the last call.
pub(crate) fn take_sent(flight: &mut Flight<'_, Bench>) -> Sent {
    let sent = std::mem::take(&mut flight.board().sent);
    let (mut rest, mut out) = (&sent[..], Sent::default());
    let mut assembly = Assembly::default();
    while !rest.is_empty() {
        let Scan::Packet { end, packet } = packet::scan(rest) else { panic!("{rest:?}") };
        rest = &rest[end..];
        let mut r = Reader::new(packet.user);
        let apid = Apid::from_number(packet.apid).unwrap();
        assert_eq!(Some(packet.user.len()), layout::user_bytes(apid), "every packet has a fixed size");
        out.times.push((apid, packet.time.unwrap()));
        match apid {
            Apid::Housekeeping => out.housekeeping.push(Housekeeping::read(&mut r).unwrap()),
            Apid::Science | Apid::Candidate | Apid::Position | Apid::Integrity | Apid::Navigation | Apid::Attitude => {
                if let Some(picture) = assembly.take(apid, packet.user).unwrap() {
                    assert_eq!(picture.missing_candidates, 0);
                    out.navigation.extend(picture.navigation);
                    out.attitude.extend(picture.attitude);
                    out.science.push((picture.exposure, picture.answer));
                }
                continue;
            }
            Apid::Event => {
                let e = EventRecord::read(&mut r).unwrap();
                out.events.push((Event::from_number(e.number).unwrap(), e.a, e.b));
            }
            Apid::Acknowledge => {
                let a = Acknowledge::read(&mut r).unwrap();
                out.details.push(a.detail);
                out.answers.push((a.function, a.sequence, Code::from_number(a.code).unwrap()));
            }
            Apid::Parameters => {
                let ParameterValue { number, value } = ParameterValue::read(&mut r).unwrap();
                out.parameters.push((number, value));
            }
            Apid::Edge => {
                let part = EdgePart::read(&mut r).unwrap();
                assert_eq!(usize::from(part.first), out.edge.len());
                let pixels = (0..EDGE_PIXELS).map(|_| EdgePixel::read(&mut r).unwrap());
                let pixels: Vec<_> = pixels.map(|p| pixel::Pixel { x: p.x, y: p.y }).collect();
                out.edge.extend(&pixels[..part.count.into()]);
            }
            Apid::Rig | Apid::Command => panic!("a flight computer with one head sends none"),
        }
        assert!(r.rest().is_empty(), "{packet:?}");
    }
    out
}

/// Sends bytes to the flight computer, runs a turn and returns everything that was sent back.
pub(crate) fn send(flight: &mut Flight<'_, Bench>, bytes: &[u8]) -> Sent {
    flight.board().line.extend(bytes);
    flight.turn();
    take_sent(flight)
}
