//! A rig of four heads: its joint answer, its telecommands, and heads that fail.

use std::cell::RefCell;

use hzn_core::Prior;
use hzn_core::Sensor;
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::rig::{Answered, Common, Limb, Mount};
use hzn_core::status::Status;
use hzn_flight::Parameters;
use hzn_flight::bytes::Writer;
use hzn_flight::flight::Lists;
use hzn_flight::flight::rig::{Rig, Setup};
use hzn_flight::joint::{Outcome, RigAnswer};
use hzn_flight::messages::{Code, Event, Function, Mode};
use hzn_flight::packet::{self, Apid, Scan};
use hzn_flight::table;

use crate::bench::{HEIGHT, WIDTH};
use crate::rig_bench::{
    Bench, Shared, Taken, board, expose, expose_all, fly, mount, off_z_deg, parameters, picture, quiet_turn, ready,
    send, set_mount, setup, take_sent,
};

#[test]
fn four_heads_are_one_answer() {
    let board = ready();
    fly(&board, |rig| {
        expose_all(&board, 1);
        rig.turn();
        let sent = take_sent(&board);
        assert_eq!(sent.science.iter().map(|(k, _)| *k).collect::<Vec<_>>(), [0, 1, 2, 3]);
        let [answer] = sent.rig[..] else { panic!("{:?}", sent.rig) };
        assert_eq!((answer.status, answer.outcome), (Status::Ok as u8, Outcome::Answer as u8));
        assert_eq!(
            [answer.heads_expected, answer.heads_seen, answer.heads_used, answer.heads_excluded],
            [15, 15, 15, 0]
        );
        assert_eq!([answer.picture_0, answer.picture_1, answer.picture_2, answer.picture_3], [1; 4]);
        assert!(off_z_deg(&answer) < 0.01, "{answer:?}");
        assert!(answer.separation_rad < answer.separation_limit_rad && answer.protection_rad < 0.01);

        // The same pictures, without the flight software.
        let sensors = [0, 1, 2, 3].map(|k| Sensor::<f32>::new(&parameters(k).sensor).unwrap());
        let prior = Prior::default();
        let mut lists = Box::new(Lists::new());
        let reports: Vec<_> = (0..4)
            .map(|k| {
                let (pixels, sensor) = (picture(4 + k as u32), &sensors[k]);
                let grey = Grey::try_new(&pixels[..], Layout::packed(WIDTH as u32, HEIGHT as u32, 1, 8)).unwrap();
                sensor.process(&mut lists, &grey, &sensor.expect(&prior).unwrap(), &Unobserved)
            })
            .collect();
        for ((_, answer), report) in sent.science.iter().zip(&reports) {
            assert_eq!(answer.direction.unwrap().axis, report.solution.unwrap().axis.xyz(), "the row of one head");
        }
        let zero = [0.0; 6];
        let mounts = [0, 1, 2, 3].map(|k| Mount::new([1.0, 0.0, 0.0, 0.0], mount(k).map(|x| x as f32), &zero).unwrap());
        let answered: Vec<_> = (0..4)
            .map(|k| {
                Some(Answered {
                    solution: reports[k].solution.as_ref().unwrap(),
                    camera: sensors[k].camera(),
                    mount: &mounts[k],
                    time_s: Some(0.0),
                    rate_rad_s: None,
                    limb_group: 0,
                })
            })
            .collect();
        let body = &sensors[0].config().body;
        let limb = Limb {
            radius_km: (body.mean_radius_km() + body.limb_height_km) as f32,
            tilt_sigma_km: None,
            own_sigma_km: 1.5,
            own_length_km: 1000.0,
        };
        let core = hzn_core::rig::Rig::new(&hzn_core::rig::Config::default()).unwrap();
        let epoch = core.join_epoch(&Common { limb, sigma_rad: 0.0 }, &answered);
        assert_eq!(answer, answer.with(&epoch), "the rig of the core, to the last bit");
        let trace = |cov: [f32; 6]| cov[0] + cov[3] + cov[5];
        assert!(trace(answer.cov_common) > 0.0 && trace(answer.cov_common) < trace(answer.cov), "{answer:?}");
    });
}

#[test]
fn a_silent_late_blinded_or_frozen_head_costs_only_itself() {
    let board = ready();
    fly(&board, |rig| {
        expose_all(&board, 1);
        rig.turn();
        let all = take_sent(&board).rig[0];
        // The vehicle does not turn. The next epoch begins after the wait for the silent head.
        let next = |rig: &mut Rig<'_, '_, Shared<'_>, 4>| {
            rig.turn();
            let at_once = take_sent(&board);
            board.borrow_mut().now_us += 600_000;
            rig.turn();
            let after_wait = take_sent(&board);
            (at_once.rig, after_wait.rig, after_wait.science.len())
        };
        // Head 1 has no picture.
        [0, 2, 3].iter().for_each(|&k| expose(&board, k, 40 + k as u32, 0));
        let (at_once, after_wait, _) = next(rig);
        assert_eq!((at_once.len(), after_wait.len()), (0, 1), "the rig waits for it");
        let silent = after_wait[0];
        assert_eq!([silent.heads_expected, silent.heads_seen, silent.heads_used], [0b1111, 0b1101, 0b1101]);
        // The covariance is that of the heads that remain.
        let trace = |answer: &RigAnswer| answer.cov[0] + answer.cov[3] + answer.cov[5];
        assert!(trace(&silent) > 1.1 * trace(&all) && off_z_deg(&silent) < 0.01);

        // The picture of head 1 comes after the wait: it has its own row and no part in the joint answer.
        (0..4).for_each(|k| expose(&board, k, 50 + k as u32, if k == 1 { 650_000 } else { 0 }));
        let (_, after_wait, own) = next(rig);
        assert_eq!((after_wait.len(), own), (1, 0));
        assert_eq!([after_wait[0].heads_seen, after_wait[0].heads_used], [0b1101, 0b1101]);
        board.borrow_mut().now_us += 100_000;
        rig.turn();
        let late = take_sent(&board);
        assert_eq!((late.rig.len(), late.science[0].0), (0, 1));

        // Head 2 sees nothing but light.
        expose_all(&board, 15);
        board.borrow_mut().cameras[2].pictures[0].pixels.fill(255);
        rig.turn();
        let blinded = take_sent(&board).rig[0];
        assert_eq!([blinded.heads_seen, blinded.heads_answered, blinded.heads_used], [0b1111, 0b1011, 0b1011]);
        assert!(off_z_deg(&blinded) < 0.01);

        // Head 3 sends the picture of the epoch before.
        expose_all(&board, 16);
        board.borrow_mut().cameras[3].pictures[0].pixels = picture(4 * 15 + 3);
        rig.turn();
        let frozen = take_sent(&board).rig[0];
        assert_eq!([frozen.heads_seen, frozen.heads_repeated], [0b1111, 0b1000]);
        assert_eq!([frozen.heads_used, frozen.heads_excluded], [0b0111, 0b1000]);
    });
}

#[test]
fn a_head_that_is_switched_off_costs_only_itself() {
    let board = ready();
    fly(&board, |rig| {
        send(&board, 0x120, 1, Function::SetMode, |w| w.u8(Mode::Standby as u8));
        send(&board, 0x130, 2, Function::SetMode, |w| w.u8(Mode::Standby as u8));
        send(&board, 0x140, 3, Function::SetMode, |w| w.u8(Mode::Standby as u8));
        (0..4).for_each(|_| quiet_turn(&board, rig));
        take_sent(&board);
        expose_all(&board, 17);
        rig.turn();
        let sent = take_sent(&board);
        assert_eq!(sent.science.len(), 1, "the other heads are switched off");
        assert_eq!([sent.rig[0].heads_expected, sent.rig[0].heads_used, sent.rig[0].outcome], [1, 1, 0]);
        assert!(sent.rig[0].protection_rad.is_nan() && off_z_deg(&sent.rig[0]) < 0.1);
    });
}

#[test]
fn a_head_with_a_wrong_mount_is_excluded() {
    let mut heads = [0, 1, 2, 3].map(parameters);
    // Turned by three degrees about the camera's x axis, across its limb.
    let ([w, x, y, z], (sin, cos)) = (mount(2), 1.5f64.to_radians().sin_cos());
    set_mount(&mut heads[2], [w * cos - x * sin, w * sin + x * cos, y * cos + z * sin, z * cos - y * sin]);
    let board = board(&heads);
    fly(&board, |rig| {
        for seed in 1..4 {
            expose_all(&board, seed);
            rig.turn();
            let sent = take_sent(&board);
            let answer = sent.rig[0];
            assert_eq!([answer.heads_answered, answer.heads_used, answer.heads_excluded], [15, 0b1011, 0b0100]);
            assert!(off_z_deg(&answer) < 0.01, "{answer:?}");
        }
        // Three heads of which one is wrong; then two, which cannot say which of them is.
        send(&board, 0x110, 1, Function::SetMode, |w| w.u8(Mode::Standby as u8));
        quiet_turn(&board, rig);
        send(&board, 0x120, 1, Function::SetMode, |w| w.u8(Mode::Standby as u8));
        quiet_turn(&board, rig);
        take_sent(&board);
        expose_all(&board, 9);
        rig.turn();
        let answer = take_sent(&board).rig[0];
        assert_eq!((answer.status, answer.outcome), (Status::Rejected as u8, Outcome::Inconsistent as u8));
        assert!(answer.axis[0].is_nan());
    });
}

#[test]
fn telecommands_mean_one_head_or_all() {
    let board = ready();
    fly(&board, |rig| {
        let one = |w: &mut Writer<'_>| {
            w.u8(1);
            w.u16(81);
            w.f64(2.5);
        };
        send(&board, 0x120, 1, Function::SetParameters, one);
        quiet_turn(&board, rig);
        assert_eq!(take_sent(&board).answers, [(0x120, Code::Done)]);
        let value = |k: usize| table::read(&board.borrow().cameras[k].copies[1]).map(|(p, _)| p.get(81).unwrap());
        assert_eq!([value(0).ok(), value(1).ok(), value(2).ok()], [None, Some(2.5), None]);
        // The parameters of all heads are not the same, so that the rig refuses them.
        send(&board, 0x100, 2, Function::SetParameters, one);
        quiet_turn(&board, rig);
        assert_eq!(take_sent(&board).answers, [(0x100, Code::OneHead)]);
        // A base of another computer would make two of one address, and 0 is that of time packets.
        for (base, refused) in [(0x130, true), (0x100, true), (0, true), (0x110, false)] {
            send(&board, 0x110, 9, Function::TryParameters, |w| {
                w.u8(1);
                w.u16(302);
                w.f64(f64::from(base));
            });
            quiet_turn(&board, rig);
            let code = if refused { Code::Refused } else { Code::Done };
            assert_eq!(take_sent(&board).answers, [(0x110, code)], "{base:#x}");
        }
        send(&board, 0x100, 3, Function::SetMode, |w| w.u8(Mode::Standby as u8));
        quiet_turn(&board, rig);
        let sent = take_sent(&board);
        assert_eq!(sent.answers, [(0x100, Code::Done)]);
        assert_eq!(sent.events.iter().filter(|(_, event)| *event == Event::ModeChanged).count(), 4);
        assert_eq!([0, 1, 2, 3].map(|k| rig.mode(k)), [Some(Mode::Standby); 4]);
        // A packet of another computer gets no answer.
        send(&board, 0x200, 4, Function::Ping, |_| ());
        quiet_turn(&board, rig);
        assert_eq!(take_sent(&board).answers, []);
        // Nothing is written while power is being cut, and nothing is answered afterwards.
        let before = board.borrow().cameras[0].copies.clone();
        board.borrow_mut().power_fails = true;
        for base in [0x110, 0x100] {
            send(&board, base, 5, Function::SetParameters, one);
            (0..3).for_each(|_| quiet_turn(&board, rig));
            assert_eq!(take_sent(&board).answers, []);
        }
        assert_eq!((&board.borrow().cameras[0].copies, rig.mode(0)), (&before, Some(Mode::ShutDown)));
    });
}

#[test]
fn a_replay_after_a_reset_is_refused() {
    let window = Parameters::number_of("line.sequence_window").unwrap();
    let board = board(&[0, 1, 2, 3].map(|k| {
        let mut p = parameters(k);
        p.set(window, 100.0).unwrap();
        p
    }));
    // A head has a count of its own.
    for (count, own) in [(7, Code::Done), (8, Code::Sequence), (9, Code::Sequence)] {
        fly(&board, |rig| {
            let answer = |rig: &mut Rig<'_, '_, Shared<'_>, 4>, base: u16, count: u16| {
                send(&board, base, count, Function::Ping, |_| ());
                quiet_turn(&board, rig);
                take_sent(&board).answers
            };
            assert_eq!(answer(rig, 0x100, count), [(0x100, Code::Done)]);
            assert_eq!(answer(rig, 0x100, count), [(0x100, Code::Sequence)]);
            assert_eq!(answer(rig, 0x110, 3), [(0x110, own)]);
        });
        // The computer is reset, and somebody sends the last telecommand again.
        fly(&board, |rig| {
            send(&board, 0x100, count, Function::Ping, |_| ());
            quiet_turn(&board, rig);
            assert_eq!(take_sent(&board).answers, [(0x100, Code::Sequence)]);
        });
    }
}

#[test]
fn attitude_and_sun_are_given_once_in_the_axes_of_the_vehicle() {
    let board = ready();
    fly(&board, |rig| {
        // The vehicle's axes are turned by 90 degrees about the body's x axis, and the Sun is along the vehicle's x.
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let now_us = board.borrow().now_us + 200_000;
        send(&board, 0x100, 1, Function::SetAttitude, |w| {
            w.u64(now_us);
            [100.0, half, half, 0.0, 0.0, 0.01, 1.0, 0.0, 0.0].into_iter().for_each(|x| w.f32(x));
        });
        quiet_turn(&board, rig);
        assert_eq!(take_sent(&board).answers, [(0x100, Code::Done)]);
        expose_all(&board, 1);
        rig.turn();
        let sent = take_sent(&board);
        assert_eq!(sent.attitude.len(), 4);
        for (k, attitude) in &sent.attitude {
            let turn = |q: [f32; 4], v: [f32; 3]| {
                use hzn_core::frames::{Cam, Rotation, UnitVec3, Vehicle};
                Rotation::<Cam, Vehicle, f32>::assume_from_quaternion(q).unwrap().apply(&UnitVec3::try_new(v).unwrap())
            };
            let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
            let mount = mount(*k).map(|x| x as f32);
            assert!(near(turn(mount, attitude.sun).xyz(), [1.0, 0.0, 0.0]), "head {k}: {attitude:?}");
            // The axis of the camera in the axes of the body, by the attitude of the head and by way of the vehicle.
            let boresight = [0.0, 0.0, 1.0];
            let by_vehicle = turn([half, half, 0.0, 0.0], turn(mount, boresight).xyz()).xyz();
            assert!(near(turn(attitude.q, boresight).xyz(), by_vehicle), "head {k}: {attitude:?}");
        }
    });
}

#[test]
fn a_turning_vehicle_moves_late_exposures_to_the_epoch() {
    const RATE_RAD_S: f64 = 0.5;
    const LATER_US: u64 = 20_000;
    // The vehicle turns about its x axis, so that the body is along z only at the middle of the exposures. The mounts
    // are turned instead of the pictures.
    let turned = |k: usize| {
        let after_s = (k as f64 - 1.5) * LATER_US as f64 * 1e-6;
        let ((sin, cos), [w, x, y, z]) = ((-0.5 * RATE_RAD_S * after_s).sin_cos(), mount(k));
        let mut p = parameters(k);
        set_mount(&mut p, [w * cos - x * sin, w * sin + x * cos, y * cos - z * sin, z * cos + y * sin]);
        p
    };
    for is_told in [true, false] {
        let board = board(&[0, 1, 2, 3].map(turned));
        fly(&board, |rig| {
            let now_us = board.borrow().now_us + 200_000;
            let rate = if is_told { [RATE_RAD_S as f32, 0.0, 0.0] } else { [f32::NAN; 3] };
            send(&board, 0x100, 1, Function::Navigate, |w| {
                w.u64(now_us);
                [100.0, 230e3].into_iter().chain([f32::NAN; 6]).chain(rate).for_each(|x| w.f32(x));
            });
            quiet_turn(&board, rig);
            assert_eq!(take_sent(&board).answers, [(0x100, Code::Done)]);
            let first_us = board.borrow().now_us;
            for k in 0..4 {
                let exposure_us = first_us + k as u64 * LATER_US;
                let pixels = picture(70 + k as u32);
                board.borrow_mut().cameras[k].pictures.push_back(Taken { ready_us: 0, exposure_us, pixels });
            }
            board.borrow_mut().now_us += 4 * LATER_US;
            rig.turn();
            let answer = take_sent(&board).rig[0];
            if is_told {
                assert_eq!([answer.outcome, answer.heads_used], [0, 15]);
                assert!(off_z_deg(&answer) < 0.01, "{answer:?}");
                assert!(answer.exposure_us.abs_diff(first_us + 30_000) <= 1);
            } else {
                assert!(answer.heads_used != 15, "the heads are up to 0.86 degrees from each other");
            }
        });
    }
}

#[test]
fn an_impossible_setup_is_refused() {
    let bad = Setup { sigma_rad: -1.0, ..setup() };
    let refused = bad.check().map(drop).unwrap_err();
    assert_eq!((refused.field, refused.value), ("rig.mount.sigma_deg", -1.0));
}

/// The packet of the rig is outside the bit budget of its heads, so the line has to have room for one at each epoch.
#[test]
fn a_rig_packet_has_the_same_size_at_every_epoch() {
    let sizes = |board: &RefCell<Bench>| {
        let bytes = std::mem::take(&mut board.borrow_mut().sent);
        let (mut rest, mut sizes) = (&bytes[..], Vec::new());
        while let Scan::Packet { end, packet } = packet::scan(rest) {
            if setup().base.subject(&packet) == Some(Apid::Rig) {
                sizes.push(end);
            }
            rest = &rest[end..];
        }
        sizes
    };
    // A bit a second: the heads send one picture after the start, and none after it.
    let heads = [0, 1, 2, 3].map(|k| {
        let mut parameters = parameters(k);
        parameters.operations.science_bits_s = Some(1.0);
        parameters
    });
    let board = board(&heads);
    fly(&board, |rig| {
        for epoch in 1..5 {
            expose_all(&board, epoch);
            if epoch == 3 {
                board.borrow_mut().cameras.iter_mut().for_each(|camera| camera.pictures[0].pixels.fill(epoch as u8));
            }
            rig.turn();
            assert_eq!(sizes(&board), [134], "epoch {epoch}");
        }
    });
}
