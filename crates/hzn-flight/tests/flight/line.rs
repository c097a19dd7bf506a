//! A line that is not perfect: noise, damage, other computers, echoes and replays.

use hzn_flight::bytes::Writer;
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Acknowledge, Code, Event, EventRecord, Function};
use hzn_flight::packet::{self, Apid, ApidBase, OVERHEAD, SYNC};
use hzn_flight::{Parameters, table};

use crate::bench::{Bench, Sent, command, fly, ready, send, take_sent};

/// Lets time pass without bytes, and returns what was sent.
fn pause(f: &mut Flight<'_, Bench>, us: u64) -> Sent {
    f.board().now_us += us;
    f.turn();
    take_sent(f)
}

/// A telecommand of another kind: type, sequence flags and APID as given.
fn packet_with(id: u16, flags: u16) -> Vec<u8> {
    let mut bytes = command(3, Function::Ping, |_| ());
    bytes[4..6].copy_from_slice(&id.to_be_bytes());
    bytes[6..8].copy_from_slice(&(flags << 14 | 3).to_be_bytes());
    seal(&mut bytes);
    bytes
}

/// Writes the checksum anew.
fn seal(bytes: &mut [u8]) {
    let end = bytes.len() - 2;
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_IBM_3740).checksum(&bytes[4..end]);
    bytes[end..].copy_from_slice(&crc.to_be_bytes());
}

/// A telecommand to another subsystem whose data are a whole telecommand for this one, as an upload of a file has it.
fn with_command_inside(apid: u16, inside: &[u8]) -> Vec<u8> {
    let mut bytes = command(1, Function::Ping, |w| w.bytes(&[&[9; 12], inside, &[7; 20]].concat()));
    bytes[4..6].copy_from_slice(&(0x1800 | apid).to_be_bytes());
    seal(&mut bytes);
    bytes
}

#[test]
fn what_is_no_whole_telecommand_for_this_computer_is_counted_and_not_answered() {
    fly(ready(), |f| {
        take_sent(f);
        // Type telemetry; a first, a middle and a last segment; another APID of telecommands.
        let foreign = [(0x09C0, 3), (0x19C0, 1), (0x19C0, 0), (0x19C0, 2), (0x19C1, 3), (0x1855, 3)];
        for (id, flags) in foreign {
            let h = send(f, &packet_with(id, flags));
            assert!(h.answers.is_empty() && h.events.is_empty(), "{id:#x} {flags}: {h:?}");
        }
        // The packet that is like a telecommand in all of this is taken.
        assert_eq!(send(f, &packet_with(0x19C0, 3)).answers, [(11, 3, Code::Done)]);
        let h = send(f, &command(4, Function::Report, |_| ()));
        assert_eq!(h.housekeeping[0].foreign, foreign.len() as u32);
    });
}

#[test]
fn an_echo_dies_at_once() {
    fly(ready(), |f| {
        take_sent(f);
        f.board().line.extend(command(1, Function::SetMode, |w| w.u8(9)));
        let mut bytes = Vec::new();
        for _ in 0..50 {
            f.turn();
            let sent = std::mem::take(&mut f.board().sent);
            f.board().line.extend(&sent);
            bytes.push(sent.len());
        }
        assert!(bytes[0] > 0 && bytes[1..].iter().all(|&n| n == 0), "{bytes:?}");
    });
}

#[test]
fn two_computers_on_one_line_do_not_answer_each_other() {
    // With the same base and with another one: each computer hears all that the other one sends.
    for base in [256.0, 512.0] {
        let mut other = Parameters::defaults();
        other.set(302, base).unwrap();
        let mut table = vec![0; table::MAX_BYTES];
        let n = table::write(&other, 1, &mut table).unwrap();
        table.truncate(n);
        let bench = Bench { copies: [table, Vec::new()], ..Bench::default() };
        fly(ready(), |a| {
            fly(bench, |b| {
                take_sent(a);
                b.board().sent.clear();
                // Everybody hears a command that is refused, and one for the first computer.
                let commands =
                    [command(1, Function::SetMode, |w| w.u8(9)), command(2, Function::Ping, |_| ())].concat();
                a.board().line.extend(&commands);
                b.board().line.extend(&commands);
                let mut bytes = Vec::new();
                for _ in 0..50 {
                    a.turn();
                    b.turn();
                    let from_a = std::mem::take(&mut a.board().sent);
                    let from_b = std::mem::take(&mut b.board().sent);
                    a.board().line.extend(&from_b);
                    b.board().line.extend(&from_a);
                    bytes.push(from_a.len() + from_b.len());
                }
                assert!(bytes[0] > 0 && bytes[3..].iter().all(|&n| n == 0), "{base}: {bytes:?}");
            });
        });
    }
}

#[test]
fn a_command_inside_a_damaged_packet_is_not_carried_out() {
    let inside = command(7, Function::SetMode, |w| w.u8(2));
    let outer = with_command_inside(0x123, &inside);
    let after = command(8, Function::Ping, |_| ());
    // Undamaged, the packet of the other subsystem is one foreign packet.
    fly(ready(), |f| {
        take_sent(f);
        assert_eq!(send(f, &[&outer[..], &after].concat()).answers, [(11, 8, Code::Done)]);
    });
    // One, two or three telecommands side by side: the marker of the next one is in the damaged packet, too.
    let ours = |sequence| command(sequence, Function::SetMode, |w| w.u8(2));
    let several: [Vec<u8>; 3] = [inside, [ours(7), ours(9)].concat(), [ours(7), ours(9), ours(10)].concat()];
    for inside in &several {
        let outer = with_command_inside(0x123, inside);
        for bit in 0..8 * outer.len() {
            fly(ready(), |f| {
                take_sent(f);
                let mut damaged = outer.clone();
                damaged[bit / 8] ^= 0x80 >> (bit % 8);
                // The embedded packets are whole also if the bit is behind them.
                f.board().line.extend(damaged.iter().chain(&after));
                let mut answers = Vec::new();
                for _ in 0..20 {
                    answers.extend(pause(f, 60_000).answers);
                }
                // The packet behind the damaged one counts, within 1.2 seconds. The embedded ones do not.
                assert_eq!(answers, [(11, 8, Code::Done)], "bit {bit} of {}", outer.len());
            });
        }
    }
}

#[test]
fn telecommands_after_a_damaged_packet_are_taken_without_a_pause_between_them() {
    // Many telecommands one after the other, without a pause: those that begin more than 1024 bytes after the damaged
    // packet end the wait for a pause.
    let commands: Vec<u8> = (0..100).flat_map(|n| command(n, Function::Ping, |_| ())).collect();
    let mut damaged = with_command_inside(0x123, &[7; 9]);
    damaged[20] ^= 1;
    for count in [1, 2, 30, 60, 100] {
        fly(ready(), |f| {
            take_sent(f);
            let one = commands.len() / 100;
            f.board().line.extend(damaged.iter().chain(&commands[..count * one]));
            let answers: Vec<_> = (0..150).flat_map(|_| pause(f, 10_000).answers).collect();
            assert_eq!(answers.len(), count);
        });
    }
}

#[test]
fn a_marker_without_one_of_its_bytes_also_begins_a_damaged_packet() {
    let outer = with_command_inside(0x123, &command(7, Function::SetMode, |w| w.u8(2)));
    for lost in 0..SYNC.len() {
        fly(ready(), |f| {
            take_sent(f);
            let mut damaged = outer.clone();
            damaged.remove(lost);
            f.board().line.extend(&damaged);
            let answers: Vec<_> = (0..20).flat_map(|_| pause(f, 60_000).answers).collect();
            assert_eq!(answers, [], "byte {lost}");
        });
    }
}

#[test]
fn a_damaged_length_holds_commands_back_for_a_second_at_most() {
    fly(ready(), |f| {
        take_sent(f);
        let mut long = command(1, Function::Ping, |_| ());
        long[8..10].copy_from_slice(&1013u16.to_be_bytes());
        f.board().line.extend(long);
        let (mut sent, mut received) = (Vec::new(), Vec::new());
        for n in 0..60u16 {
            // A command every 100 ms; it is answered at the latest 1.1 s later.
            f.board().line.extend(command(100 + n, Function::Ping, |_| ()));
            sent.push(f.board().now_us);
            for _ in 0..4 {
                let answers = pause(f, 25_000).answers;
                let now = f.board().now_us;
                received.extend(answers.iter().map(|&(_, sequence, _)| (sequence, now)));
            }
        }
        assert_eq!(received.len(), 60);
        for (n, &(sequence, at)) in received.iter().enumerate() {
            assert_eq!(usize::from(sequence), 100 + n);
            assert!(at - sent[n] <= 1_300_000, "command {n}: {} us", at - sent[n]);
        }
    });
}

#[test]
fn a_replay_is_refused_if_the_window_is_set() {
    fly(ready(), |f| {
        take_sent(f);
        let ping = |sequence| command(sequence, Function::Ping, |_| ());
        let code = |f: &mut Flight<'_, Bench>, sequence: u16| send(f, &ping(sequence)).answers[0].2;
        assert_eq!([code(f, 5), code(f, 5)], [Code::Done; 2], "without a window, any count is taken");
        let window = command(16_380, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(303);
            w.f64(10.0);
        });
        assert_eq!(send(f, &window).answers[0].2, Code::Done);
        assert_eq!(code(f, 16_380), Code::Sequence);
        // The count wraps after 16 383; lost telecommands are no error.
        assert_eq!([code(f, 16_382), code(f, 16_382), code(f, 3)], [Code::Done, Code::Sequence, Code::Done]);
        assert_eq!([code(f, 14), code(f, 3), code(f, 13)], [Code::Sequence, Code::Sequence, Code::Done]);
        assert_eq!(send(f, &ping(3)).details, [13], "a refusal says the last count");
        assert_eq!(send(f, &command(14, Function::Report, |_| ())).housekeeping[0].last_sequence, 14);
    });
}

#[test]
fn a_replay_is_refused_also_after_a_reset() {
    let mut with_window = Parameters::defaults();
    with_window.set(303, 10.0).unwrap();
    let mut table = vec![0; table::MAX_BYTES];
    let n = table::write(&with_window, 1, &mut table).unwrap();
    table.truncate(n);
    let bench = |retained| Bench { copies: [table.clone(), Vec::new()], retained, ..Bench::default() };
    for watchdog_reset in [false, true] {
        let retained = fly(bench([0; 4]), |f| {
            assert_eq!(send(f, &command(0, Function::Ping, |_| ())).answers, [(11, 0, Code::Done)]);
            assert_eq!(send(f, &command(7, Function::Ping, |_| ())).answers, [(11, 7, Code::Done)]);
            f.board().retained
        });
        fly(Bench { watchdog_reset, ..bench(retained) }, |f| {
            assert_eq!(take_sent(f).housekeeping[0].last_sequence, 7);
            assert_eq!(send(f, &command(7, Function::Ping, |_| ())).answers, [(11, 7, Code::Sequence)]);
            assert_eq!(send(f, &command(8, Function::Ping, |_| ())).answers, [(11, 8, Code::Done)]);
        });
        // After power-on, the words are random or zeros.
        fly(bench([0; 4]), |f| {
            assert_eq!(send(f, &command(7, Function::Ping, |_| ())).answers, [(11, 7, Code::Done)]);
        });
    }
}

#[test]
fn answers_are_never_longer_than_what_came_in() {
    let mut state = 7u32;
    let mut draw = move |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % below
    };
    fly(ready(), |f| {
        take_sent(f);
        let (mut received, mut answered) = (0usize, 0usize);
        for _ in 0..20_000 {
            let mut bytes = match draw(4) {
                0 => command(draw(9999) as u16, Function::ProcessOnce, |w| w.u8(1)),
                1 => SYNC.to_vec(),
                2 => [&SYNC[..], &[0x19, 0xC0, 0xC0, 0, 0, 9 + draw(30) as u8]].concat(),
                _ => (0..draw(40)).map(|_| draw(256) as u8).collect(),
            };
            if draw(3) == 0 && !bytes.is_empty() {
                let n = bytes.len() as u32;
                bytes[draw(n) as usize] ^= 1 << draw(8);
            }
            received += bytes.len();
            let h = send(f, &bytes);
            answered += h.answers.len() * (OVERHEAD + Acknowledge::BYTES);
            answered += h.events.len() * (OVERHEAD + EventRecord::BYTES);
            f.board().now_us += u64::from(draw(300_000));
            assert!(answered <= received + 1024, "{answered} of {received}");
        }
        println!("{answered} bytes of answers to {received} bytes");
        assert!(answered > 100_000 && answered < received);
    });
}

#[test]
fn a_turn_reads_a_thousand_bytes_and_the_rest_waits() {
    fly(ready(), |f| {
        take_sent(f);
        f.board().line.extend([0x55; 5000]);
        let mut left = Vec::new();
        for _ in 0..6 {
            f.turn();
            left.push(f.board().line.len());
        }
        assert_eq!(left, [3976, 2952, 1928, 904, 0, 0]);
    });
}

#[test]
fn headers_inside_headers_do_not_hold_a_turn() {
    // Every ten bytes a packet begins that claims a thousand: each byte belongs to a hundred packets.
    fly(ready(), |f| {
        take_sent(f);
        let header: Vec<u8> = SYNC.into_iter().chain([0x19, 0xC0, 0xC0, 0, 3, 0xF0]).collect();
        f.board().line.extend(header.iter().cycle().take(20_000));
        let mut turns = 0;
        while !f.board().line.is_empty() {
            f.turn();
            turns += 1;
            assert!(turns < 20_000);
        }
        // Two of the longest packets are examined in a turn, and each frees the ten bytes of its header.
        assert!(turns > 200, "{turns}");
        f.board().now_us += 2_000_000;
        (0..200).for_each(|_| f.turn());
        take_sent(f);
        assert_eq!(send(f, &command(1, Function::Ping, |_| ())).answers, [(11, 1, Code::Done)]);
    });
}

#[test]
fn a_cut_off_packet_does_not_cost_the_next() {
    fly(ready(), |f| {
        take_sent(f);
        let good = command(1, Function::Ping, |_| ());
        f.board().line.extend(&good[..9]);
        f.board().line.extend(&good);
        let answers: Vec<_> = (0..20).flat_map(|_| pause(f, 60_000).answers).collect();
        assert_eq!(answers, [(11, 1, Code::Done)]);
        // A command that is cut off and followed by nothing is given up after a second.
        f.board().line.extend(&good[..15]);
        let events: Vec<_> = (0..20).flat_map(|_| pause(f, 60_000).events).collect();
        assert_eq!(events, [(Event::CommandRejected, Code::Broken as u32, 0)]);
        assert_eq!(send(f, &good).answers, [(11, 1, Code::Done)]);
    });
}

#[test]
fn another_base_moves_every_apid() {
    fly(ready(), |f| {
        take_sent(f);
        let base = command(1, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(302);
            w.f64(f64::from(0x240));
        });
        assert_eq!(send(f, &base).answers, [(2, 1, Code::Done)], "the acknowledgement comes from the old base");
        assert!(send(f, &command(2, Function::Ping, |_| ())).answers.is_empty());
        let mut out = [0; 64];
        let ping = |w: &mut Writer<'_>| w.u8(Function::Ping as u8);
        let n = packet::write(&mut out, ApidBase::try_new(0x240).unwrap(), Apid::Command, 3, None, ping).unwrap();
        f.board().line.extend(&out[..n]);
        f.turn();
        let sent = std::mem::take(&mut f.board().sent);
        assert_eq!(sent[4..6], [0x0A, 0x43]);
    });
}
