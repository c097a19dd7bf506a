//! Writes packets of telemetry with random contents, and their numbers, so that other decoders can be compared:
//! `telemetry_packets FOLDER` writes `packets.bin`, with the sync markers of the line, and `values.jsonl`, a line with
//! APID, time and numbers for each packet. Numbers that are not finite are `null`.

use std::io::Write;
use std::path::PathBuf;

use hzn_flight::answer::{Direction, Edge, Outcome, Position};
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::cuc::Cuc;
use hzn_flight::integrity::Integrity;
use hzn_flight::joint::RigAnswer;
use hzn_flight::layout::user_bytes;
use hzn_flight::messages::{
    Acknowledge, AttitudeState, Code, EDGE_PIXELS, EdgePart, EdgePixel, Event, EventRecord, Exposure, Housekeeping,
    NavigationState, ParameterValue,
};
use hzn_flight::packet::{self, Apid, ApidBase};

const PACKETS: usize = 10_000;

/// A generator of random bits: SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}

/// Returns the numbers of a packet by the records, which write packets in flight.
fn values(apid: Apid, user: &[u8]) -> Option<Vec<f64>> {
    let from = &mut Reader::new(user);
    let mut out = Vec::new();
    match apid {
        Apid::Housekeeping => out.extend(Housekeeping::read(from)?.values()),
        Apid::Science => {
            out.extend(Exposure::read(from)?.values());
            out.extend(Outcome::read(from)?.values());
            out.extend(Direction::read(from)?.values());
        }
        Apid::Event => out.extend(EventRecord::read(from)?.values()),
        Apid::Acknowledge => out.extend(Acknowledge::read(from)?.values()),
        Apid::Parameters => out.extend(ParameterValue::read(from)?.values()),
        Apid::Edge => {
            out.extend(EdgePart::read(from)?.values());
            for _ in 0..EDGE_PIXELS {
                out.extend(EdgePixel::read(from)?.values());
            }
        }
        Apid::Candidate => {
            out.push(f64::from(from.u32()?));
            out.extend(Edge::read(from)?.values());
        }
        Apid::Position => {
            out.push(f64::from(from.u32()?));
            out.extend(Position::read(from)?.values());
        }
        Apid::Integrity => {
            out.push(f64::from(from.u32()?));
            out.extend(Integrity::read(from)?.values());
        }
        Apid::Navigation => out.extend(NavigationState::read(from)?.values()),
        Apid::Attitude => out.extend(AttitudeState::read(from)?.values()),
        Apid::Rig => out.extend(RigAnswer::read(from)?.values()),
        Apid::Command => return None,
    }
    from.rest().is_empty().then_some(out)
}

/// Gives the fields that are choices a number that they can have.
fn limit_choices(apid: Apid, user: &mut [u8], draw: u8) {
    match apid {
        Apid::Housekeeping => (user[0], user[3]) = (draw % 4, if draw.is_multiple_of(5) { 255 } else { draw % 10 }),
        Apid::Science => (user[Exposure::BYTES], user[Exposure::BYTES + 1]) = (draw % 10, draw % 8),
        Apid::Event => (user[0], user[1], user[2]) = (0, 1 + draw % Event::ALL.len() as u8, draw % 3),
        Apid::Acknowledge => user[3] = draw % Code::ALL.len() as u8,
        Apid::Rig => (user[12], user[13]) = (draw % 10, draw % 4),
        Apid::Candidate => user[4 + Edge::BYTES - 1] = draw % 23,
        _ => {}
    }
}

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    std::fs::create_dir_all(&folder)?;
    let mut packets = std::fs::File::create(folder.join("packets.bin"))?;
    let mut lines = std::io::BufWriter::new(std::fs::File::create(folder.join("values.jsonl"))?);
    let mut random = Random(22);
    let kinds: Vec<Apid> = Apid::ALL.iter().copied().filter(|&apid| apid != Apid::Command).collect();
    for n in 0..PACKETS {
        let apid = kinds[n % kinds.len()];
        let mut user = vec![0; user_bytes(apid).expect("telemetry has a layout")];
        user.iter_mut().for_each(|byte| *byte = random.next() as u8);
        limit_choices(apid, &mut user, random.next() as u8);
        let us = random.next() % 4_294_967_295_000_000;
        let time = if n % 3 == 0 { Cuc::since_start(us) } else { Cuc::tai(us) };
        let mut bytes = [0; packet::MAX_BYTES];
        let write = |w: &mut Writer<'_>| w.bytes(&user);
        let length = packet::write(&mut bytes, ApidBase::DEFAULT, apid, (n / kinds.len()) as u16, Some(time), write);
        packets.write_all(&bytes[..length.expect("a packet fits")])?;
        let numbers = values(apid, &user).expect("the records and the layout have one size");
        let text: Vec<String> =
            numbers.iter().map(|x| if x.is_finite() { format!("{x:?}") } else { "null".to_owned() }).collect();
        writeln!(lines, "{{\"apid\": {}, \"us\": {us}, \"values\": [{}]}}", apid as u16, text.join(", "))?;
    }
    lines.flush()
}
