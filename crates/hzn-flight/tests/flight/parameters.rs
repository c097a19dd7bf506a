//! Parameters that are tried, loaded in parts, or not changed at all.

use hzn_flight::bytes::Writer;
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Code, Event, Function};
use hzn_flight::{Parameters, table};

use crate::bench::{Bench, Sent, command, fly, ready, send, stored, take_sent};

fn pairs(pairs: &[(u16, f64)]) -> impl Fn(&mut Writer<'_>) {
    let pairs = pairs.to_vec();
    move |w| {
        w.u8(pairs.len() as u8);
        for &(id, value) in &pairs {
            w.u16(id);
            w.f64(value);
        }
    }
}

fn do_it(f: &mut Flight<'_, Bench>, function: Function, arguments: impl Fn(&mut Writer<'_>)) -> Code {
    send(f, &command(1, function, arguments)).answers[0].2
}

fn read(f: &mut Flight<'_, Bench>, id: u16) -> f64 {
    let arguments = |w: &mut Writer<'_>| {
        w.u8(1);
        w.u16(id);
    };
    send(f, &command(1, Function::ReadParameters, arguments)).parameters[0].1
}

#[test]
fn memory_is_written_only_for_a_change() {
    fly(ready(), |f| {
        take_sent(f);
        assert_eq!(do_it(f, Function::SetParameters, pairs(&[])), Code::Arguments);
        let now = read(f, 81);
        for _ in 0..100 {
            assert_eq!(do_it(f, Function::SetParameters, pairs(&[(81, now)])), Code::Done);
        }
        assert_eq!(f.board().writes, 0);
        assert_eq!(do_it(f, Function::SetParameters, pairs(&[(81, 2.0)])), Code::Done);
        assert_eq!(f.board().writes, 1);
    });
}

#[test]
fn the_only_valid_copy_is_not_written() {
    // The copy in use is damaged while the computer runs, so that the other one holds the only parameters.
    for used in [1usize, 2] {
        let mut copies = [stored(1), stored(1)];
        copies[used - 1] = stored(2);
        let copies = fly(Bench { copies, ..Bench::default() }, |f| {
            take_sent(f);
            f.board().copies[used - 1][40] ^= 1;
            let set = command(1, Function::SetParameters, pairs(&[(81, 2.0)]));
            assert_eq!(send(f, &set).events, [(Event::Stored, used as u32, 3)]);
            f.board().copies.clone()
        });
        assert_eq!(copies[2 - used], stored(1));
        fly(Bench { copies, ..Bench::default() }, |f| {
            assert_eq!(take_sent(f).events[0], (Event::Started, used as u32, 3));
            assert_eq!(read(f, 81), 2.0);
        });
    }
}

#[test]
fn a_stored_limit_that_is_too_high_is_refused_at_the_start() {
    let mut free = Parameters::defaults();
    free.sensor.limits.max_work = Some(1_000_000_000);
    let mut bytes = vec![0; table::MAX_BYTES];
    let n = table::write(&free, 9, &mut bytes).unwrap();
    bytes.truncate(n);
    fly(Bench { copies: [bytes, stored(1)], ..Bench::default() }, |f| {
        let events = take_sent(f).events;
        assert!(events.contains(&(Event::CopyBroken, 1, 3)) && events.contains(&(Event::Started, 2, 1)), "{events:?}");
    });
}

#[test]
fn a_tried_parameter_is_gone_after_a_reset() {
    let copies = fly(ready(), |f| {
        take_sent(f);
        assert_eq!(do_it(f, Function::TryParameters, pairs(&[(81, 2.0)])), Code::Done);
        assert_eq!((read(f, 81), f.board().writes), (2.0, 0));
        assert_eq!(send(f, &command(1, Function::Report, |_| ())).housekeeping[0].flags, 1);
        f.board().copies.clone()
    });
    fly(Bench { copies, ..Bench::default() }, |f| {
        take_sent(f);
        assert_eq!(read(f, 81), 3.0);
        // A tried value is stored when it is set, although it is in use already.
        assert_eq!(do_it(f, Function::TryParameters, pairs(&[(81, 2.0)])), Code::Done);
        let h = send(f, &command(1, Function::SetParameters, pairs(&[(81, 2.0)])));
        assert_eq!((h.answers[0].2, h.events[0].0), (Code::Done, Event::Stored));
        assert_eq!(send(f, &command(1, Function::Report, |_| ())).housekeeping[0].flags, 0);
        // A try back to the stored value is no difference any more, so that a set of this value writes nothing.
        let writes = f.board().writes;
        for (value, flags) in [(2.5, 1), (2.0, 0)] {
            assert_eq!(do_it(f, Function::TryParameters, pairs(&[(81, value)])), Code::Done);
            assert_eq!(send(f, &command(1, Function::Report, |_| ())).housekeeping[0].flags, flags);
        }
        assert_eq!(do_it(f, Function::SetParameters, pairs(&[(81, 2.0)])), Code::Done);
        assert_eq!(f.board().writes, writes);
        // The board knows the sensor that is in use.
        assert_eq!(f.board().noted.as_ref().map(|sensor| sensor.consensus.threshold_px), Some(2.0));
    });
}

#[test]
fn a_large_mask_is_loaded_in_parts_and_stored_once() {
    // Four polygons of eight corners: 68 parameters, more than a mask with one `set` can have.
    let corner = |polygon: u16, corner: u16| {
        let (sin, cos) = (f64::from(corner) * std::f64::consts::TAU / 8.0).sin_cos();
        let (x, y) = (1000 + 32 * polygon + 2 * corner, 1001 + 32 * polygon + 2 * corner);
        [(x, 80.0 + 150.0 * f64::from(polygon) + 40.0 * cos), (y, 200.0 + 40.0 * sin)]
    };
    let mut all: Vec<(u16, f64)> = (0..4).map(|p| (200 + p, 8.0)).collect();
    all.extend((0..4).flat_map(|p| (0..8).flat_map(move |c| corner(p, c))));
    fly(ready(), |f| {
        take_sent(f);
        for part in all.chunks(20) {
            assert_eq!(do_it(f, Function::StageParameters, pairs(part)), Code::Done);
        }
        assert_eq!((read(f, 200), f.board().writes), (0.0, 0), "nothing is in use before the commit");
        assert_eq!(do_it(f, Function::CommitParameters, |w| w.u16(68)), Code::Done);
        assert_eq!((read(f, 203), read(f, all[67].0), f.board().writes), (8.0, all[67].1, 1));
        // If a part is lost, the count is wrong, and nothing changes.
        assert_eq!(do_it(f, Function::StageParameters, pairs(&all[..4])), Code::Done);
        assert_eq!(do_it(f, Function::CommitParameters, |w| w.u16(68)), Code::Arguments);
        assert_eq!(do_it(f, Function::CommitParameters, |w| w.u16(4)), Code::Arguments, "nothing is kept any more");
        // A part can be thrown away, and there is an end to what is kept.
        assert_eq!(do_it(f, Function::StageParameters, pairs(&[(81, 1.5)])), Code::Done);
        assert_eq!(do_it(f, Function::StageParameters, pairs(&[])), Code::Done);
        let codes: Vec<_> = (0..8).map(|_| do_it(f, Function::StageParameters, pairs(&[(81, 1.5); 80]))).collect();
        assert_eq!(codes, [[Code::Done; 5].as_slice(), &[Code::Refused; 3]].concat());
    });
}

#[test]
fn limits_that_a_table_cannot_exceed() {
    fly(ready(), |f| {
        take_sent(f);
        for (id, value) in [(120, 1e9), (120, 983_041.0), (300, 0.0), (301, 0.0), (302, 0x101.into()), (304, 2.0)] {
            assert_eq!(do_it(f, Function::SetParameters, pairs(&[(id, value)])), Code::Refused, "{id} {value}");
        }
        assert_eq!(do_it(f, Function::SetParameters, pairs(&[(120, 983_040.0)])), Code::Done);
        // Corners that enclose nothing are refused.
        let corners = [(200, 4.0), (1000, 5.0), (1001, 5.0), (1002, 9.0), (1003, 9.0)];
        assert_eq!(do_it(f, Function::SetParameters, pairs(&corners[..1])), Code::Refused);
        assert_eq!(do_it(f, Function::SetParameters, pairs(&corners)), Code::Refused);
    });
}

#[test]
fn one_number_that_is_missing_is_refused_by_name() {
    fly(ready(), |f| {
        take_sent(f);
        let known = |numbers: &[f32]| {
            let numbers = numbers.to_vec();
            command(1, Function::SetKnown, move |w| numbers.iter().for_each(|&x| w.f32(x)))
        };
        let nan = f32::NAN;
        let refused = |h: &Sent| (h.answers[0].2, h.details[0]);
        assert_eq!(refused(&send(f, &known(&[2e5, 6.5e6, nan, 1e5]))), (Code::Missing, 5));
        assert_eq!(refused(&send(f, &known(&[2e5, nan, nan, nan, 0.1, nan, 0.0]))), (Code::Missing, 11));
        assert_eq!(send(f, &known(&[2e5, nan, nan, nan])).answers[0].2, Code::Done);
    });
}
