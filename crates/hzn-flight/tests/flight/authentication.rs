//! Telecommands of strangers, replays, and damaged keys.

use hzn_flight::authentication::{KEY_BYTES, Key, RESERVED};
use hzn_flight::bytes::Writer;
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Code, Function, Mode};
use hzn_flight::packet::{self, Apid, ApidBase, MAX_BYTES};

use crate::bench::{Bench, KeyMemory, command, fly, ready, send, take_sent};

fn key(number: u8) -> Key {
    Key { spacecraft: 42, number, secret: [number ^ 0x5A; 32] }
}

/// A board with the key 1 and the next key, 2.
fn with_keys() -> Bench {
    let stored = [1, 2].map(|number| key(number).to_bytes());
    Bench { keys: Some(KeyMemory { stored, counters: [Some(0); 2], ..KeyMemory::default() }), ..ready() }
}

fn sealed(
    key: &Key,
    counter: u64,
    sequence: u16,
    function: Function,
    arguments: impl FnOnce(&mut Writer<'_>),
) -> Vec<u8> {
    let plain = command(sequence, function, arguments);
    let packet::Scan::Packet { packet, .. } = packet::scan(&plain) else { panic!() };
    let mut user = [0; MAX_BYTES];
    user[..packet.user.len()].copy_from_slice(packet.user);
    let n = key.seal(ApidBase::DEFAULT, sequence, counter, packet.user.len(), &mut user).unwrap();
    let mut out = [0; MAX_BYTES];
    let bytes =
        packet::write(&mut out, ApidBase::DEFAULT, Apid::Command, sequence, None, |w| w.bytes(&user[..n])).unwrap();
    out[..bytes].to_vec()
}

/// Sends a telecommand that would end standby, and returns its outcome and the mode after it. Standby returns.
fn try_mode(f: &mut Flight<'_, Bench>, bytes: &[u8]) -> (Code, bool) {
    let code = send(f, bytes).answers[0].2;
    (code, f.mode() == Mode::Safe)
}

fn mode(key: &Key, counter: u64) -> Vec<u8> {
    sealed(key, counter, 1, Function::SetMode, |w| w.u8(Mode::Safe as u8))
}

#[test]
fn only_the_owner_of_a_key_commands() {
    fly(with_keys(), |f| {
        take_sent(f);
        let plain = command(1, Function::SetMode, |w| w.u8(Mode::Safe as u8));
        assert_eq!(try_mode(f, &plain), (Code::NoTrailer, false));
        assert_eq!(try_mode(f, &mode(&key(3), 1)), (Code::Stranger, false));
        let other_craft = Key { spacecraft: 43, ..key(1) };
        assert_eq!(try_mode(f, &mode(&other_craft, 1)), (Code::Stranger, false));
        // Everybody may ask whether the computer is there.
        let h = send(f, &command(2, Function::Report, |_| ()));
        assert_eq!((&h.answers[..], h.housekeeping.len()), (&[(12, 2, Code::Done)][..], 1));
        assert_eq!(send(f, &command(3, Function::Ping, |_| ())).answers, [(11, 3, Code::Done)]);
        assert_eq!(try_mode(f, &mode(&key(1), 1)), (Code::Done, true));
    });
    // Without keys, a board takes every telecommand, as before.
    fly(ready(), |f| {
        take_sent(f);
        assert_eq!(send(f, &command(1, Function::SetMode, |w| w.u8(2))).answers[0].2, Code::Done);
    });
}

#[test]
fn a_packet_with_another_apid_or_sequence_count_is_refused() {
    fly(with_keys(), |f| {
        take_sent(f);
        let good = mode(&key(1), 1);
        let packet::Scan::Packet { packet, .. } = packet::scan(&good) else { panic!() };
        let mut moved = [0; MAX_BYTES];
        let n = packet::write(&mut moved, ApidBase::DEFAULT, Apid::Command, 9, None, |w| w.bytes(packet.user));
        assert_eq!(try_mode(f, &moved[..n.unwrap()]), (Code::Stranger, false));
        assert_eq!(try_mode(f, &good), (Code::Done, true));
    });
}

#[test]
fn a_replay_is_refused_also_after_a_reset() {
    let keys = fly(with_keys(), |f| {
        take_sent(f);
        let ping = |counter, sequence| sealed(&key(1), counter, sequence, Function::ResetCounters, |_| ());
        assert_eq!(send(f, &ping(5, 1)).answers[0].2, Code::Done);
        assert_eq!(send(f, &ping(5, 1)).answers[0].2, Code::Replay);
        assert_eq!(send(f, &ping(4, 2)).answers[0].2, Code::Replay);
        // The other key has a counter of its own.
        assert_eq!(send(f, &sealed(&key(2), 1, 3, Function::ResetCounters, |_| ())).answers[0].2, Code::Done);
        // The memory is written once for as many telecommands as are reserved.
        for counter in 6..5 + RESERVED {
            assert_eq!(send(f, &ping(counter, counter as u16)).answers[0].2, Code::Done);
        }
        assert_eq!(f.board().keys.as_ref().unwrap().writes, 2);
        f.board().keys.clone()
    });
    fly(Bench { keys, ..ready() }, |f| {
        take_sent(f);
        let at = |counter| mode(&key(1), counter);
        for counter in [5, 6, 4 + RESERVED, 5 + RESERVED] {
            assert_eq!(try_mode(f, &at(counter)), (Code::Replay, false), "{counter}");
        }
        assert_eq!(try_mode(f, &at(6 + RESERVED)), (Code::Done, true));
    });
}

#[test]
fn damaged_memory_closes_the_line() {
    let damages: [fn(&mut KeyMemory); 5] = [
        |keys| keys.stored = [[0xFF; KEY_BYTES]; 2],
        |keys| {
            keys.stored[0][20] ^= 1;
            keys.stored[1][44] ^= 1;
        },
        |keys| keys.counters[0] = None,
        |keys| keys.is_write_protected = true,
        |keys| keys.forgets = true,
    ];
    for (place, damage) in damages.into_iter().enumerate() {
        let mut bench = with_keys();
        damage(bench.keys.as_mut().unwrap());
        fly(bench, |f| {
            take_sent(f);
            let (code, is_safe) = try_mode(f, &mode(&key(1), 1));
            assert_eq!((code, is_safe), (Code::Closed, false), "damage {place}");
            let plain = command(2, Function::SetMode, |w| w.u8(Mode::Safe as u8));
            assert!(!try_mode(f, &plain).1, "damage {place}");
            assert_eq!(send(f, &command(3, Function::Ping, |_| ())).answers, [(11, 3, Code::Done)]);
        });
    }
    // One damaged key leaves the other one.
    let mut bench = with_keys();
    bench.keys.as_mut().unwrap().stored[0] = [0; KEY_BYTES];
    fly(bench, |f| {
        take_sent(f);
        assert_eq!(try_mode(f, &mode(&key(1), 1)), (Code::Stranger, false));
        assert_eq!(try_mode(f, &mode(&key(2), 1)), (Code::Done, true));
    });
}

#[test]
fn strangers_neither_move_the_sequence_window_nor_flood_the_line() {
    fly(with_keys(), |f| {
        take_sent(f);
        let set_window = |w: &mut Writer<'_>| {
            w.u8(1);
            w.u16(303);
            w.f64(10.0);
        };
        assert_eq!(send(f, &sealed(&key(1), 1, 1, Function::SetParameters, set_window)).answers[0].2, Code::Done);
        send(f, &command(5000, Function::Ping, |_| ()));
        send(f, &mode(&key(3), 2));
        let next = sealed(&key(1), 2, 2, Function::ResetCounters, |_| ());
        assert_eq!(send(f, &next).answers, [(6, 2, Code::Done)]);
        // Answers have no more bytes than what came, and those at the start.
        let (mut received, mut sent) = (0, 0);
        for _ in 0..200 {
            let ping = command(1, Function::Report, |_| ());
            received += ping.len();
            f.board().line.extend(ping);
            f.turn();
            sent += std::mem::take(&mut f.board().sent).len();
        }
        assert!(sent < received + 3000, "{sent} for {received}");
    });
}
