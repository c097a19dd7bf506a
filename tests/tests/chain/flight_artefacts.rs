//! Skies with ghosts instead of a limb, through the flight software: answered as a limb without an attitude, and never
//! with one.

use std::collections::VecDeque;

use hzn_core::Config;
use hzn_flight::assembly::Assembly;
use hzn_flight::board::{Board, Picture};
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::messages::{Acknowledge, Attitude, Event, EventRecord, Function, Mode, Navigation};
use hzn_flight::packet::{self, Apid, ApidBase, Scan};
use hzn_flight::view::Viewer;
use hzn_flight::{Parameters, table};
use hzn_tests::artefact::{Kind, Trial};

/// First seed; the campaign and the other tests have other seeds.
const FIRST_SEED: u64 = 6_000_000;
/// 1σ of the attitude, degrees, as in the campaign.
const ATTITUDE_SIGMA_DEG: f64 = 5.0;

/// A board with one picture.
#[derive(Default)]
struct Desk {
    now_us: u64,
    line: VecDeque<u8>,
    sent: Vec<u8>,
    pixels: Vec<u8>,
    is_taken: bool,
    copy: Vec<u8>,
}

impl Board for Desk {
    fn now_us(&mut self) -> u64 {
        self.now_us += 10;
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
        let is_new = !std::mem::replace(&mut self.is_taken, true);
        is_new.then_some(Picture { bytes: self.pixels.len(), exposure_us: self.now_us, lost: 0 })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        viewer.see(&self.pixels);
    }
    fn read_copy(&mut self, _: u8, into: &mut [u8]) {
        into.fill(0xFF);
        into[..self.copy.len()].copy_from_slice(&self.copy);
    }
    fn write_copy(&mut self, _: u8, _: &[u8]) -> bool {
        false
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
}

fn command(function: Function, arguments: impl FnOnce(&mut Writer<'_>)) -> Vec<u8> {
    let mut out = [0; packet::MAX_BYTES];
    let user = |w: &mut Writer<'_>| {
        w.u8(function as u8);
        arguments(w);
    };
    let n = packet::write(&mut out, ApidBase::DEFAULT, Apid::Command, 1, None, user).unwrap();
    out[..n].to_vec()
}

/// Returns the telecommand with a position, in metres.
pub(crate) fn navigate(position_m: [f64; 3]) -> Vec<u8> {
    let [position_x_m, position_y_m, position_z_m] = position_m.map(|x| x as f32);
    let unknown = f32::NAN;
    let values = Navigation {
        epoch: 0,
        expires_s: unknown,
        altitude_m: unknown,
        position_x_m,
        position_y_m,
        position_z_m,
        velocity_x_m_s: unknown,
        velocity_y_m_s: unknown,
        velocity_z_m_s: unknown,
        rate_x_rad_s: unknown,
        rate_y_rad_s: unknown,
        rate_z_rad_s: unknown,
    };
    command(Function::Navigate, |w| values.write(w))
}

/// Returns the telecommand with an attitude of a trial, with the error of its 1σ.
fn orient(trial: &Trial) -> Vec<u8> {
    let [q_w, q_x, q_y, q_z] = trial.attitude_wxyz(ATTITUDE_SIGMA_DEG).map(|x| x as f32);
    let (sun_x, sun_y, sun_z) = (f32::NAN, f32::NAN, f32::NAN);
    let sigma_rad = ATTITUDE_SIGMA_DEG.to_radians() as f32;
    let values = Attitude { epoch: 0, expires_s: 60.0, q_w, q_x, q_y, q_z, sigma_rad, sun_x, sun_y, sun_z };
    command(Function::SetAttitude, |w| values.write(w))
}

/// Shows the flight software a picture after these telecommands. Returns what it sends.
pub(crate) fn fly(sensor: Config, pixels: Vec<u8>, commands: &[Vec<u8>]) -> Vec<u8> {
    let mut copy = vec![0; table::MAX_BYTES];
    let n = table::write(&Parameters::new(sensor), 1, &mut copy).unwrap();
    copy.truncate(n);
    let board = Desk { copy, pixels, now_us: 1, ..Desk::default() };
    let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
    let mut flight = Flight::start(board, &mut buffers, &mut lists).unwrap();
    // The line is silent for a while, so that a packet after it is trusted at once.
    flight.board().now_us += 200_000;
    flight.turn();
    let mode = command(Function::SetMode, |w| w.u8(Mode::Flight as u8));
    for command in commands.iter().chain([&mode]) {
        flight.board().line.extend(command);
        flight.turn();
    }
    std::mem::take(&mut flight.board().sent)
}

/// Returns whether the flight software answers the picture after these telecommands.
fn is_answered(trial: &Trial, commands: &[Vec<u8>]) -> bool {
    let picture = trial.render().unwrap();
    let (width, height) = (picture.width(), picture.height());
    let pixels =
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| picture.at(x, y) as u8).collect();
    let sent = fly(Config::new(trial.scene.camera.clone()), pixels, commands);
    let (mut rest, mut assembly, mut answer, mut events) = (&sent[..], Assembly::default(), None, Vec::new());
    while let Scan::Packet { end, packet } = packet::scan(rest) {
        rest = &rest[end..];
        match Apid::from_number(packet.apid).unwrap() {
            Apid::Event => events.extend(EventRecord::read(&mut Reader::new(packet.user))),
            Apid::Acknowledge => {
                let code = Acknowledge::read(&mut Reader::new(packet.user)).map(|a| (a.code, a.detail));
                assert_eq!(code, Some((0, 0)), "{trial:?}");
            }
            apid => answer = assembly.take(apid, packet.user).flatten().or(answer),
        }
    }
    let Some(answer) = answer else {
        // The search for stuck pixels refuses some ghosts, too.
        assert!(events.iter().any(|event| event.number == Event::StuckPixels as u16), "{trial:?}: {events:?}");
        return false;
    };
    assert!(answer.navigation.is_some() && answer.attitude.is_some() == (commands.len() == 2), "{trial:?}");
    answer.answer.direction.is_some()
}

#[test]
fn a_ghost_is_answered_as_a_limb_only_without_an_attitude() {
    let pictures: Option<u64> = std::env::var("HZN_ARTEFACTS").ok().and_then(|n| n.parse().ok());
    // Without the variable only one kind, whose first 20 pictures have a false answer.
    let kinds =
        Kind::ALL.iter().filter(|&&kind| if pictures.is_some() { kind.is_disc() } else { kind == Kind::Vignetted });
    let pictures = pictures.unwrap_or(20);
    let (mut shown, mut without, mut with) = (0, 0, 0);
    for &kind in kinds {
        for seed in FIRST_SEED..FIRST_SEED + pictures {
            let trial = Trial::without_limb(kind, seed).unwrap();
            shown += 1;
            let position = navigate(trial.prior(None).position_m.unwrap());
            if is_answered(&trial, std::slice::from_ref(&position)) {
                println!("{} {seed} without", kind.name());
                without += 1;
            }
            if is_answered(&trial, &[position, orient(&trial)]) {
                println!("{} {seed} with", kind.name());
                with += 1;
            }
        }
    }
    println!("{shown} pictures: {without} are answered without an attitude, {with} with one");
    assert!(without > 0 && with == 0, "{shown} pictures: {without} without an attitude, {with} with one");
}
