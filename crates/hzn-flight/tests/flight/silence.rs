//! The computer is heard from in every mode.

use hzn_flight::messages::{Code, Event, Function, Mode};

use crate::bench::{Bench, command, fly, limb, ready, send, take_sent};

#[test]
fn every_mode_but_shut_down_sends_a_packet_in_ten_seconds() {
    for mode in [Mode::Standby, Mode::Flight, Mode::Safe] {
        fly(ready(), |f| {
            send(f, &command(1, Function::SetMode, |w| w.u8(mode as u8)));
            let mut last = f.board().now_us;
            for _ in 0..36_000 {
                f.board().now_us += 100_000;
                f.turn();
                let h = take_sent(f);
                if !h.housekeeping.is_empty() {
                    last = f.board().now_us;
                }
                assert!(f.board().now_us - last <= 5_200_000, "{mode:?}");
            }
        });
    }
}

#[test]
fn housekeeping_says_which_program_runs() {
    fly(ready(), |f| {
        take_sent(f);
        assert_eq!(send(f, &command(1, Function::Ping, |_| ())).answers, [(11, 1, Code::Done)]);
        let h = send(f, &command(2, Function::Report, |_| ()));
        let hk = h.housekeeping[0];
        let version = env!("CARGO_PKG_VERSION").split('.').fold(0, |v, n| v << 8 | n.parse::<u32>().unwrap());
        assert_eq!((hk.version, hk.build, hk.image_crc), (version, 7, 0xCAFE_F00D));
    });
}

#[test]
fn a_camera_that_stops_is_told_after_a_second() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let mut told = Vec::new();
        // Ten pictures a second, for one second; then none. The sixth is lost, because a turn lasts too long.
        for tick in 0..300 {
            f.board().now_us += 10_000;
            if (50..60).contains(&tick) {
                continue;
            }
            if tick % 10 == 0 && tick < 100 {
                f.board().pictures.push_back((limb(), u32::from(tick == 60)));
            }
            f.turn();
            let silent = take_sent(f).events.into_iter().filter(|e| e.0 == Event::CameraSilent);
            told.extend(silent.map(|(_, _, picture)| (tick, picture)));
        }
        // The last picture has number 9 and came at tick 90; it is told once.
        assert!(matches!(told[..], [(190..=192, 9)]), "{told:?}");
        assert_eq!(send(f, &command(2, Function::Report, |_| ())).housekeeping[0].flags, 8);
        f.board().pictures.push_back((limb(), 0));
        f.turn();
        assert_eq!(send(f, &command(3, Function::Report, |_| ())).housekeeping.last().unwrap().flags, 0);
    });
    // A camera that never sends anything.
    fly(Bench { ..ready() }, |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let events: Vec<_> = (0..30)
            .flat_map(|_| {
                f.board().now_us += 100_000;
                f.turn();
                take_sent(f).events
            })
            .collect();
        assert!(matches!(events[..], [(Event::CameraSilent, 2000..=2200, 0)]), "{events:?}");
    });
}

#[test]
fn a_camera_with_jitter_is_not_silent() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        take_sent(f);
        // Pictures come every 40 ms, each up to 8 ms early or late, for 80 s; every hundredth is 0.9 s late, because
        // the operating system pauses. Then they come every 100 ms, and every 2 s.
        let mut random = 1u32;
        let mut told = Vec::new();
        for picture in 0..2106u64 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let due_us = match picture {
                0..2000 if picture % 100 == 99 => 40_000 * picture + 900_000,
                0..2000 => 40_000 * picture,
                2000..2100 => 80_000_000 + 100_000 * (picture - 2000),
                _ => 90_000_000 + 2_000_000 * (picture - 2100),
            };
            let at_us = 1_000_000 + due_us + u64::from(random >> 16) * 16_000 / 65_536;
            while f.board().now_us + 1000 < at_us {
                f.board().now_us += 1000;
                f.turn();
            }
            f.board().now_us = at_us;
            f.board().pictures.push_back((limb(), 0));
            f.turn();
            told.extend(take_sent(f).events.into_iter().filter(|e| e.0 == Event::CameraSilent).map(|_| picture));
        }
        // The slowest rate is told once, until its period is known.
        assert_eq!(told, [2101]);
    });
}

#[test]
fn warnings_are_limited_and_counted() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let mut told = 0;
        for _ in 0..1000 {
            f.board().now_us += 10_000;
            f.board().pictures.push_back((vec![0; 5], 0));
            f.turn();
            told += take_sent(f).events.len();
        }
        assert!((17..=19).contains(&told), "eight at once and ten in ten seconds: {told}");
        let hk = send(f, &command(2, Function::Report, |_| ())).housekeeping[0];
        assert_eq!((hk.refused, hk.withheld), (1000, 1000 - told as u32));
    });
}

#[test]
fn the_counters_start_again_but_the_pictures_keep_their_numbers() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        for _ in 0..3 {
            f.board().pictures.push_back((limb(), 0));
            f.turn();
        }
        send(f, &command(2, Function::ResetCounters, |_| ()));
        f.board().pictures.push_back((limb(), 0));
        f.turn();
        let h = take_sent(f);
        assert_eq!(h.science[0].0.picture, 4);
        assert_eq!(send(f, &command(3, Function::Report, |_| ())).housekeeping[0].pictures, 1);
    });
}
