//! Resets, lift-off and shut-down.

use hzn_flight::messages::{Code, Event, Function, Mode};
use hzn_flight::{Parameters, table};

use crate::bench::{Bench, command, fly, ready, send, stored, take_sent};

fn stored_with(generation: u32, pairs: &[(u16, f64)]) -> Vec<u8> {
    let mut p = Parameters::defaults();
    p.set(33, f64::from(generation)).unwrap();
    pairs.iter().for_each(|&(id, value)| p.set(id, value).unwrap());
    let mut bytes = vec![0; table::MAX_BYTES];
    let n = table::write(&p, generation, &mut bytes).unwrap();
    bytes.truncate(n);
    bytes
}

/// Resets the computer `resets` times by its watchdog, and returns the mode, the copy and the events of each start.
fn starts(first: Bench, resets: usize) -> Vec<(Mode, u8, Vec<Event>)> {
    let mut out = Vec::new();
    let mut bench = first;
    for _ in 0..=resets {
        let copies = bench.copies.clone();
        let retained = fly(bench, |f| {
            let h = take_sent(f);
            let hk = *h.housekeeping.last().unwrap();
            out.push((f.mode(), hk.parameter_copy, h.events.iter().map(|e| e.0).collect()));
            assert_eq!(usize::from(hk.starts), out.len());
            f.board().retained
        });
        bench = Bench { copies, retained, watchdog_reset: true, ..Bench::default() };
    }
    out
}

#[test]
fn a_loop_of_resets_leads_to_the_older_parameters_and_then_to_safe_mode() {
    let flying = Bench { copies: [stored_with(1, &[(304, 1.0)]), stored_with(2, &[(304, 1.0)])], ..Bench::default() };
    let starts = starts(flying, 7);
    let modes: Vec<_> = starts.iter().map(|(mode, copy, _)| (*mode, *copy)).collect();
    let (newer, older, safe) = ((Mode::Flight, 2), (Mode::Flight, 1), (Mode::Safe, 1));
    assert_eq!(modes, [newer, newer, newer, older, older, older, safe, safe]);
    assert!(!starts[0].2.contains(&Event::Watchdog) && starts[1].2.contains(&Event::Watchdog));
    assert!(starts[3].2.contains(&Event::OlderParameters) && !starts[3].2.contains(&Event::SafeAfterResets));
    assert!(starts[6].2.contains(&Event::SafeAfterResets));
}

#[test]
fn resets_after_lift_off_do_not_silence_a_rocket() {
    // 307 is `boot.safe_after_resets`: never, before lift-off, always.
    for (safe, lift_off, last) in [
        (0.0, false, Mode::Flight),
        (0.0, true, Mode::Flight),
        (1.0, false, Mode::Safe),
        (1.0, true, Mode::Flight),
        (2.0, true, Mode::Safe),
    ] {
        let copy = |generation| stored_with(generation, &[(304, 1.0), (307, safe)]);
        let starts = starts(Bench { copies: [copy(1), copy(2)], lift_off, ..Bench::default() }, 7);
        let modes: Vec<_> = starts.iter().map(|(mode, ..)| *mode).collect();
        assert_eq!(modes[..6], [Mode::Flight; 6]);
        assert_eq!(modes[6..], [last; 2], "{safe}, {lift_off}");
        // The older parameters are kept, because the newer ones may be the cause.
        assert_eq!(starts[7].1, 1);
        assert_eq!(starts[6].2.contains(&Event::SafeAfterResets), last == Mode::Safe);
    }
}

#[test]
fn a_minute_without_a_reset_ends_the_count() {
    let retained = fly(Bench { watchdog_reset: true, ..ready() }, |f| {
        f.board().now_us += 61_000_000;
        f.turn();
        f.board().retained
    });
    fly(Bench { watchdog_reset: true, retained, ..ready() }, |f| {
        assert_eq!(take_sent(f).housekeeping[0].watchdog_resets, 1);
    });
    // After power-on the words are random.
    fly(Bench { retained: [0x0009_0007, 5, 6, 7], ..ready() }, |f| {
        let hk = take_sent(f).housekeeping[0];
        assert_eq!((hk.starts, hk.watchdog_resets, hk.since_lift_off_s), (1, 0, u32::MAX));
    });
}

#[test]
fn new_parameters_replace_those_that_were_left() {
    let retained = fly(Bench { watchdog_reset: true, ..ready() }, |f| f.board().retained);
    let retained = fly(Bench { watchdog_reset: true, retained, ..ready() }, |f| f.board().retained);
    let copies = fly(Bench { watchdog_reset: true, retained, ..ready() }, |f| {
        assert_eq!(take_sent(f).housekeeping.last().unwrap().parameter_copy, 1);
        let set = command(1, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(81);
            w.f64(2.0);
        });
        assert_eq!(send(f, &set).events, [(Event::Stored, 2, 2)]);
        f.board().copies.clone()
    });
    assert_eq!(copies[0], stored(1));
}

#[test]
fn a_commanded_standby_lasts_although_the_line_shows_lift_off() {
    fly(Bench { lift_off: true, ..ready() }, |f| {
        // The line showed lift-off at the start: a reset during flight.
        assert_eq!(f.mode(), Mode::Flight);
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Standby as u8)));
        (0..5).for_each(|_| f.turn());
        assert_eq!(f.mode(), Mode::Standby);
        f.board().lift_off = false;
        f.turn();
        f.board().lift_off = true;
        f.turn();
        assert_eq!(f.mode(), Mode::Flight);
    });
}

#[test]
fn shut_down_follows_lift_off_also_across_a_reset() {
    let timed = || Bench { copies: [stored(1), stored_with(2, &[(305, 590.0)])], ..Bench::default() };
    let retained = fly(Bench { lift_off: true, ..timed() }, |f| {
        f.board().now_us += 300_000_000;
        f.turn();
        f.board().retained
    });
    // The line does not show lift-off any more, but the computer knows that it flies.
    fly(Bench { retained, watchdog_reset: true, ..timed() }, |f| {
        assert_eq!(f.mode(), Mode::Flight);
        f.board().now_us += 285_000_000;
        f.turn();
        let since = take_sent(f).housekeeping.last().unwrap().since_lift_off_s;
        assert!(f.mode() == Mode::Flight && (580..590).contains(&since), "{since}");
        f.board().now_us += 10_000_000;
        f.turn();
        assert_eq!(f.mode(), Mode::ShutDown);
    });
}

#[test]
fn shut_down_by_command_must_be_armed() {
    fly(ready(), |f| {
        take_sent(f);
        let shut_down = command(1, Function::SetMode, |w| w.u8(Mode::ShutDown as u8));
        let arm = command(2, Function::ArmShutDown, |_| ());
        assert_eq!(send(f, &shut_down).answers[0].2, Code::NotArmed);
        assert_eq!(send(f, &arm).answers[0].2, Code::Done);
        f.board().now_us += 10_000_000;
        assert_eq!(send(f, &shut_down).answers[0].2, Code::NotArmed);
        assert_eq!(send(f, &arm).answers[0].2, Code::Done);
        assert_eq!(send(f, &shut_down).answers[0].2, Code::Done);
        assert_eq!(f.mode(), Mode::ShutDown);
    });
}
