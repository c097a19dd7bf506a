//! A long stream of telecommands with mixed damage, written by another program: tests/python/damaged_packets.py.

use std::collections::VecDeque;

use hzn_flight::flight::Flight;
use hzn_flight::messages::{Acknowledge, Code, EventRecord, Function};
use hzn_flight::packet::OVERHEAD;

use crate::bench::{Bench, command, fly, ready, send, take_sent};

/// Bytes in a millisecond at 115 200 bits a second.
const BYTES_MS: f64 = 11.52;
/// Longest time from the last byte of a good telecommand to its acknowledgement.
const LATE_US: u64 = 1_000_000;

/// A telecommand without an answer after this time has none. Sequence counts repeat later.
const FORGOTTEN_US: u64 = 10_000_000;

/// What the line carries: the kind of damage (0: none), the pause after it, the bytes.
#[derive(Debug)]
struct Piece<'a> {
    kind: u8,
    pause_ms: u8,
    bytes: &'a [u8],
}

fn pieces(mut file: &[u8]) -> impl Iterator<Item = Piece<'_>> {
    std::iter::from_fn(move || {
        let [kind, pause_ms, high, low, rest @ ..] = file else { return None };
        let (bytes, rest) = rest.split_at(usize::from(u16::from_be_bytes([*high, *low])));
        file = rest;
        Some(Piece { kind: *kind, pause_ms: *pause_ms, bytes })
    })
}

/// The ground: what it waits for, and what it has counted.
#[derive(Debug, Default)]
struct Ground {
    /// Sequence counts of good telecommands without an answer, with the time of their last byte.
    open: VecDeque<(u16, u64)>,
    good: u32,
    wrongly_taken: Vec<(u8, u16)>,
    twice: Vec<(u8, u16)>,
    longest_us: u64,
    /// Good telecommands without an answer within [`FORGOTTEN_US`].
    unanswered: Vec<(u16, u64)>,
    received: usize,
    answered: usize,
}

impl Ground {
    fn faults(&self) -> usize {
        self.wrongly_taken.len() + self.twice.len() + self.unanswered.len()
    }

    /// Lets `us` microseconds pass, runs a turn, and judges what the computer sends.
    fn turn(&mut self, f: &mut Flight<'_, Bench>, us: u64) {
        f.board().now_us += us;
        f.turn();
        let (sent, now) = (take_sent(f), f.board().now_us);
        self.answered += sent.answers.len() * (OVERHEAD + Acknowledge::BYTES);
        self.answered += sent.events.len() * (OVERHEAD + EventRecord::BYTES);
        while self.open.front().is_some_and(|&(_, since)| now - since > FORGOTTEN_US) {
            self.unanswered.extend(self.open.pop_front());
        }
        for (function, sequence, code) in sent.answers {
            let is_good = [Function::Ping as u8, Function::Report as u8].contains(&function);
            match self.open.iter().position(|&(n, _)| is_good && n == sequence) {
                Some(place) if code == Code::Done => {
                    let (_, since) = self.open.remove(place).unwrap();
                    self.longest_us = self.longest_us.max(now - since);
                }
                _ if code != Code::Done => {}
                _ if is_good => self.twice.push((function, sequence)),
                _ => self.wrongly_taken.push((function, sequence)),
            }
        }
    }

    /// Sends bytes at the speed of the line, with turns of a millisecond.
    fn send(&mut self, f: &mut Flight<'_, Bench>, piece: &Piece<'_>) {
        let (mut rest, mut room) = (piece.bytes, 0.0);
        while !rest.is_empty() {
            room += BYTES_MS;
            let (now, later) = rest.split_at(rest.len().min(room as usize));
            f.board().line.extend(now);
            (rest, room) = (later, room.fract());
            if rest.is_empty() && piece.kind == 0 {
                let sequence = u16::from_be_bytes([piece.bytes[6], piece.bytes[7]]) & 0x3FFF;
                self.open.push_back((sequence, f.board().now_us));
                self.good += 1;
            }
            self.turn(f, 1000);
        }
        self.received += piece.bytes.len();
        for _ in 0..piece.pause_ms.div_ceil(10) {
            self.turn(f, 1000 * u64::from(piece.pause_ms.min(10)));
        }
    }
}

#[test]
#[ignore = "its file comes from `cargo xtask campaign packets`"]
fn damaged_packets_are_not_taken_and_good_ones_are_not_late() {
    let path = std::env::var("HZN_PACKETS").expect("HZN_PACKETS names the file");
    let file = std::fs::read(path).unwrap();
    fly(ready(), |f| {
        let window = command(0, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(303);
            w.f64(100.0);
        });
        assert_eq!(send(f, &window).answers, [(2, 0, Code::Done)]);
        let (mut ground, mut kinds, mut recent) = (Ground::default(), [0u32; 17], VecDeque::new());
        for piece in pieces(&file) {
            kinds[usize::from(piece.kind)] += 1;
            let faults = ground.faults();
            ground.send(f, &piece);
            recent.push_back(piece);
            if recent.len() > 8 {
                recent.pop_front();
            }
            if ground.faults() > faults {
                println!("{ground:?}; the last bytes:");
                recent.iter().for_each(|piece| println!("  {piece:02x?}"));
            }
        }
        (0..200).for_each(|_| ground.turn(f, 100_000));
        let damaged: u32 = kinds[1..].iter().sum();
        println!("{} good packets, {damaged} others, in {kinds:?}", ground.good);
        println!(
            "wrongly taken {}, taken twice {}, without an answer {}, latest answer after {} ms",
            ground.wrongly_taken.len(),
            ground.twice.len(),
            ground.unanswered.len(),
            ground.longest_us / 1000
        );
        println!("{} bytes of answers to {} bytes", ground.answered, ground.received);
        assert!(ground.good > 100 && damaged > 100, "the file is too short");
        assert_eq!((ground.wrongly_taken, ground.twice), (vec![], vec![]));
        assert!(ground.unanswered.is_empty(), "{:?}", ground.unanswered);
        assert!(ground.longest_us <= LATE_US, "{} us", ground.longest_us);
        assert!(ground.answered <= ground.received + 1024);
    });
}
