//! Tests the flight software on a board that is made of vectors.

mod attitude;
mod authentication;
mod bench;
mod clock;
mod damage;
mod flips;
mod line;
mod navigation;
mod parameters;
mod recovery;
mod rig;
mod rig_bench;
mod rows;
mod silence;
mod tracking;

use hzn_core::status::Status;
use hzn_flight::Parameters;
use hzn_flight::bytes::Writer;
use hzn_flight::messages::{Code, Event, Function, Mode};
use hzn_flight::packet::{self, Apid, ApidBase};

use bench::{Bench, HEIGHT, WIDTH, command, fly, limb, ready, send, stored, take_sent};

#[test]
fn starts_with_the_newer_copy_and_waits() {
    fly(ready(), |f| {
        let h = take_sent(f);
        assert_eq!(h.events, [(Event::Started, 2, 2)]);
        let hk = h.housekeeping[0];
        assert_eq!((hk.mode, hk.parameter_copy, hk.parameter_generation, hk.last_status), (0, 2, 2, 255));
        f.board().pictures.push_back((limb(), 0));
        f.turn();
        assert_eq!(take_sent(f).science, [], "standby processes nothing by itself");
    });
}

#[test]
fn without_a_limit_every_point_that_fits_is_kept() {
    fly(ready(), |f| {
        let keep_all = |w: &mut Writer<'_>| {
            w.u8(1);
            w.u16(71);
            w.f64(0.0);
        };
        let h = send(f, &command(1, Function::SetParameters, keep_all));
        assert_eq!(h.answers[0].2, Code::Done);
        f.board().pictures.push_back((limb(), 0));
        let h = send(f, &command(2, Function::ProcessOnce, |_| ()));
        let answer = &h.science[0].1;
        assert_eq!(answer.status, Status::Ok as u8);
        // The edge has 640 pixels, and every second one fits.
        assert!((300..=608).contains(&answer.edge_points), "{}", answer.edge_points);
    });
}

#[test]
fn flies_at_lift_off_and_stops_before_power_is_cut() {
    fly(ready(), |f| {
        take_sent(f);
        f.board().lift_off = true;
        f.board().pictures.extend((0..12).map(|_| (limb(), 0)));
        (0..12).for_each(|_| f.turn());
        let h = take_sent(f);
        assert_eq!(h.events[0], (Event::ModeChanged, Mode::Standby as u32, Mode::Flight as u32));
        assert_eq!(h.science.len(), 12);
        for (n, (exposure, answer)) in h.science.iter().enumerate() {
            assert_eq!(exposure.picture, n as u32 + 1);
            assert!(exposure.done_us >= exposure.exposure_us);
            assert_eq!(answer.status, Status::Ok as u8);
            let axis = answer.direction.unwrap().axis;
            assert!((axis[1] - 75f32.to_radians().sin()).abs() < 2e-3, "{axis:?}");
        }
        // Housekeeping packets follow the change of mode and the tenth picture.
        assert_eq!(h.housekeeping.len(), 2);
        assert_eq!((h.housekeeping[1].pictures, h.housekeeping[1].answers), (10, 10));
        f.board().power_fails = true;
        f.turn();
        assert_eq!(f.mode(), Mode::ShutDown);
        take_sent(f);
        f.board().pictures.push_back((limb(), 0));
        let set = command(1, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(32);
            w.f64(200.0);
        });
        let before = f.board().copies.clone();
        assert!(send(f, &set).answers.is_empty());
        assert_eq!(f.board().copies, before, "nothing is written any more");
    });
}

#[test]
fn a_log_that_cannot_be_written_is_reported_once() {
    fly(ready(), |f| {
        f.board().lift_off = true;
        let mut events_with = |log_fails| {
            take_sent(f);
            f.board().log_fails = log_fails;
            f.board().pictures.extend((0..3).map(|_| (limb(), 0)));
            (0..4).for_each(|_| f.turn());
            let sent = take_sent(f);
            assert_eq!(sent.science.len(), 3);
            sent.events.iter().filter(|(event, ..)| *event == Event::AnswersNotKept).count()
        };
        assert_eq!([false, true, true, false, true].map(&mut events_with), [0, 1, 0, 0, 1]);
    });
}

#[test]
fn parameters_are_set_read_and_stored() {
    let copies = fly(ready(), |f| {
        take_sent(f);
        let set = command(7, Function::SetParameters, |w| {
            w.u8(2);
            for (id, value) in [(32, 200.0), (81, 2.5)] {
                w.u16(id);
                w.f64(value);
            }
        });
        let h = send(f, &set);
        assert_eq!(h.answers, [(2, 7, Code::Done)]);
        assert_eq!(h.events, [(Event::Stored, 1, 3)]);
        let read = command(8, Function::ReadParameters, |w| {
            w.u8(2);
            w.u16(81);
            w.u16(32);
        });
        assert_eq!(send(f, &read).parameters, [(81, 2.5), (32, 200.0)]);
        // All parameters are set or none: here the second is refused.
        for (id, value, code) in
            [(4, -1.0, Code::Refused), (9999, 1.0, Code::UnknownParameter), (3, 0.5, Code::Refused)]
        {
            let set = command(9, Function::SetParameters, |w| {
                w.u8(2);
                w.u16(81);
                w.f64(1.5);
                w.u16(id);
                w.f64(value);
            });
            assert_eq!(send(f, &set).answers, [(2, 9, code)]);
            assert_eq!(send(f, &read).parameters, [(81, 2.5), (32, 200.0)]);
        }
        f.board().copies.clone()
    });
    // The computer starts again after a reset.
    fly(Bench { copies, ..Bench::default() }, |f| {
        assert_eq!(take_sent(f).events, [(Event::Started, 1, 3)]);
        let read = command(8, Function::ReadParameters, |w| {
            w.u8(1);
            w.u16(32);
        });
        assert_eq!(send(f, &read).parameters, [(32, 200.0)]);
    });
}

#[test]
fn a_power_cut_at_any_byte_of_a_write_costs_the_change_only() {
    let length = stored(3).len();
    for cut in 0..=length {
        let copies = fly(Bench { power: Some(cut), ..ready() }, |f| {
            let set = command(7, Function::SetParameters, |w| {
                w.u8(1);
                w.u16(33);
                w.f64(0.25);
            });
            let h = send(f, &set);
            let done = cut == length;
            assert_eq!(h.answers[0].2, if done { Code::Done } else { Code::NotStored }, "{cut}");
            f.board().copies.clone()
        });
        fly(Bench { copies, ..Bench::default() }, |f| {
            let events = take_sent(f).events;
            let read = command(8, Function::ReadParameters, |w| {
                w.u8(1);
                w.u16(33);
            });
            let now = send(f, &read).parameters[0].1;
            if cut == length {
                assert_eq!((events[0], now), ((Event::Started, 1, 3), 0.25));
            } else {
                // The copy that was not written stays in use.
                assert_eq!((events[0], now), ((Event::Started, 2, 2), 2.0), "{cut}");
                assert!(matches!(events[1], (Event::CopyBroken, 1, _)));
            }
        });
    }
}

#[test]
fn broken_copies_end_in_the_defaults_and_in_safe_mode() {
    let mut flipped = stored(2);
    flipped[30] ^= 4;
    fly(Bench { copies: [stored(1)[..50].to_vec(), flipped], ..Bench::default() }, |f| {
        let h = take_sent(f);
        let expected = [
            (Event::Started, 0, 0),
            (Event::CopyBroken, 1, 2),
            (Event::CopyBroken, 2, 2),
            (Event::Defaults, 0, 0),
            (Event::SelfCheck, 4, 0),
            (Event::ModeChanged, 0, 2),
        ];
        assert_eq!(h.events, expected);
        assert_eq!(f.mode(), Mode::Safe);
        // When its parameters are set again, the self-check of the parameters passes.
        let set = command(1, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(32);
            w.f64(240.0);
        });
        assert_eq!(send(f, &set).answers, [(2, 1, Code::Done)]);
        let h = send(f, &command(2, Function::SetMode, |w| w.u8(Mode::Standby as u8)));
        assert_eq!(h.housekeeping[0].self_check, 0);
    });
    fly(Bench { camera_is_dead: true, ..ready() }, |f| {
        assert!(take_sent(f).events.contains(&(Event::SelfCheck, 1, 0)));
    });
}

#[test]
fn bad_commands_are_rejected_with_a_code() {
    fly(ready(), |f| {
        take_sent(f);
        let good = command(1, Function::ProcessOnce, |_| {});
        assert_eq!(send(f, &command(2, Function::ProcessOnce, |w| w.u8(1))).answers, [(4, 2, Code::Arguments)]);
        assert_eq!(send(f, &command(3, Function::SetMode, |w| w.u8(9))).answers, [(1, 3, Code::Arguments)]);
        assert_eq!(send(f, &command(4, Function::SetParameters, |w| w.u8(3))).answers, [(2, 4, Code::Arguments)]);
        let mut out = [0; 64];
        let n = packet::write(&mut out, ApidBase::DEFAULT, Apid::Command, 5, None, |w| w.u8(200)).unwrap();
        assert_eq!(send(f, &out[..n]).answers, [(200, 5, Code::Unknown)]);
        let h = send(f, &command(9, Function::SetMode, |w| w.u8(Mode::Safe as u8)));
        assert_eq!(h.answers, [(1, 9, Code::Done)]);
        assert_eq!(send(f, &good).answers, [(4, 1, Code::Mode)]);
        assert_eq!(send(f, &command(10, Function::ResetCounters, |_| {})).answers, [(6, 10, Code::Done)]);
    });
}

#[test]
fn any_bytes_on_the_line_leave_it_in_order() {
    fly(ready(), |f| {
        let mut state = 1u32;
        for _ in 0..200 {
            let noise: Vec<u8> = (0..97)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    // Some of the bytes are sync markers.
                    packet::SYNC.get((state >> 29) as usize).copied().unwrap_or((state >> 16) as u8)
                })
                .collect();
            f.board().line.extend(noise);
            f.turn();
        }
        while !f.board().line.is_empty() {
            f.turn();
        }
        f.board().now_us += 2_000_000;
        (0..400).for_each(|_| f.turn());
        take_sent(f);
        let answers = send(f, &command(1, Function::ResetCounters, |_| {})).answers;
        assert_eq!(answers, [(6, 1, Code::Done)]);
    });
}

#[test]
fn every_picture_gets_a_status_or_an_event_and_the_next_is_processed() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let noise = (0..WIDTH * HEIGHT).map(|i| (i as u32).wrapping_mul(2_654_435_761).to_be_bytes()[0]).collect();
        let pictures = [vec![0; 100], vec![], vec![0; WIDTH * HEIGHT], vec![255; WIDTH * HEIGHT], noise, limb()];
        f.board().pictures.extend(pictures.map(|p| (p, 0)));
        f.board().pictures[5].1 = 3;
        (0..6).for_each(|_| f.turn());
        let h = take_sent(f);
        let expected = WIDTH as u32 * HEIGHT as u32;
        assert_eq!(
            h.events,
            [(Event::WrongSize, 100, expected), (Event::WrongSize, 0, expected), (Event::Overrun, 3, 0)]
        );
        let status: Vec<u8> = h.science.iter().map(|(_, a)| a.status).collect();
        assert_eq!(status[..2], [Status::NoLimb as u8, Status::TooBright as u8]);
        assert!(status[2] != Status::Ok as u8 && status[3] == Status::Ok as u8, "{status:?}");
        assert!(f.board().fed >= 7);
    });
}

#[test]
fn a_picture_is_processed_on_command_and_its_edge_sent() {
    fly(ready(), |f| {
        take_sent(f);
        f.board().pictures.push_back((limb(), 0));
        let known = command(1, Function::SetKnown, |w| {
            [231e3, f32::NAN, f32::NAN, f32::NAN].map(|v| w.f32(v)).into_iter().collect()
        });
        assert_eq!(send(f, &known).answers, [(7, 1, Code::Done)]);
        let turning = command(1, Function::SetKnown, |w| {
            [231e3, f32::NAN, f32::NAN, f32::NAN, 0.1, 0.0, -0.2].map(|v| w.f32(v)).into_iter().collect()
        });
        assert_eq!(send(f, &turning).answers, [(7, 1, Code::Done)]);
        let cut = command(1, Function::SetKnown, |w| {
            [231e3, f32::NAN, f32::NAN, f32::NAN, 0.1].map(|v| w.f32(v)).into_iter().collect()
        });
        assert_eq!(send(f, &cut).answers, [(7, 1, Code::Arguments)]);
        let wrong = command(2, Function::SetKnown, |w| {
            [-5.0, f32::NAN, f32::NAN, f32::NAN].map(|v| w.f32(v)).into_iter().collect()
        });
        assert_eq!(send(f, &wrong).answers, [(7, 2, Code::Refused)]);
        assert_eq!(send(f, &command(3, Function::DumpEdges, |_| {})).answers, [(5, 3, Code::Done)]);
        let h = send(f, &command(4, Function::ProcessOnce, |_| {}));
        assert_eq!(h.science.len(), 1);
        assert_eq!(h.science[0].0.altitude_m, 231e3);
        // The limb crosses the whole picture.
        assert!(h.edge.len() > 300 && h.edge.len() <= 512, "{}", h.edge.len());
        assert!(h.edge.iter().all(|p| p.y > 200 && p.y < 480));
        assert!(h.edge.iter().any(|p| p.x < 5) && h.edge.iter().any(|p| p.x > 630));
        // The command processes one picture only.
        f.board().pictures.push_back((limb(), 0));
        f.turn();
        assert!(take_sent(f).science.is_empty());
    });
}

#[test]
fn every_body_gets_an_answer_to_its_picture() {
    // Values that are kept twice must not be NaN, because NaN is never equal to itself.
    for (body, radius_km) in [(0, f64::NAN), (1, f64::NAN), (2, f64::NAN), (3, f64::NAN), (4, 1737.4)] {
        fly(ready(), |f| {
            let set = command(1, Function::SetParameters, |w| {
                w.u8(2);
                w.u16(30);
                w.f64(f64::from(body));
                w.u16(31);
                w.f64(radius_km);
            });
            assert_eq!(send(f, &set).answers[0].2, Code::Done, "{body}");
            f.board().pictures.push_back((limb(), 0));
            let h = send(f, &command(2, Function::ProcessOnce, |_| ()));
            assert_eq!((h.science.len(), h.events.len()), (1, 0), "{body}: {h:?}");
        });
    }
}

#[test]
fn the_defaults_are_valid() {
    Parameters::defaults().check().unwrap();
}
