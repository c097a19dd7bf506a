//! The times of packets, and values from navigation at times of TAI.

use hzn_flight::cuc::{Cuc, Epoch};
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Code, Event, Function, Housekeeping, Mode, Navigation};
use hzn_flight::packet::{Apid, OVERHEAD};

use crate::bench::{Bench, command, fly, limb, ready, send, take_sent};

/// 2026-10-29 or so.
const TAI_US: u64 = 2_171_923_200_000_000;

fn set_time(f: &mut Flight<'_, Bench>, us: u64, at_pulse: u8) -> (Code, Vec<(Event, u32, u32)>) {
    let set = command(1, Function::SetTime, |w| {
        w.u64(u64::from_be_bytes(Cuc::tai(us).to_bytes()));
        w.u8(at_pulse);
    });
    let h = send(f, &set);
    (h.answers[0].2, h.events)
}

#[test]
fn packets_have_the_time_of_the_exposure_since_the_start_or_in_tai() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let picture = |f: &mut Flight<'_, Bench>| {
            f.board().pictures.push_back((limb(), 0));
            f.turn();
            let h = take_sent(f);
            let of_picture = h.times.iter().filter(|(apid, _)| *apid != Apid::Housekeeping);
            let times: Vec<Cuc> = of_picture.map(|(_, time)| *time).collect();
            assert!(times.len() >= 3 && times.iter().all(|t| *t == times[0]), "{:?}", h.times);
            (h.science[0].0.exposure_us, times[0])
        };
        let (exposure_us, time) = picture(f);
        assert_eq!(time, Cuc::since_start(exposure_us));
        let report = send(f, &command(2, Function::Report, |_| ()));
        assert_eq!(report.housekeeping[0].clock, 0);

        let (code, events) = set_time(f, TAI_US, 0);
        assert_eq!((code, events), (Code::Done, vec![(Event::ClockSet, 2_171_923_200, u32::MAX)]));
        let now_us = f.board().now_us;
        let (exposure_us, time) = picture(f);
        assert_eq!(time.epoch, Epoch::Tai);
        assert!(time.us.abs_diff(TAI_US + exposure_us - now_us) < 100, "{time:?}");
        assert_eq!(send(f, &command(2, Function::Report, |_| ())).housekeeping[0].clock, 1);
        assert_eq!(set_time(f, TAI_US + 5_000_000, 1).0, Code::NoPulse);
    });
}

#[test]
fn a_pulse_makes_the_time_exact() {
    fly(ready(), |f| {
        let pulse = f.board().now_us + 5;
        f.board().pulse_us = Some(pulse);
        f.board().now_us += 400_000;
        assert_eq!(set_time(f, TAI_US + 1, 1).0, Code::Refused, "a pulse comes at a whole second");
        assert_eq!(set_time(f, TAI_US, 1).0, Code::Done);
        // The clock of the board is 0.01 % too slow.
        for second in 1..=100 {
            f.board().pulse_us = Some(pulse + second * 999_900);
            f.board().now_us = pulse + second * 999_900 + 1000;
            f.turn();
        }
        take_sent(f);
        let h = send(f, &command(2, Function::Report, |_| ()));
        assert_eq!(h.housekeeping[0].clock, 2);
        let time = h.times[0].1;
        assert!((TAI_US + 100_001_000..TAI_US + 100_001_200).contains(&time.us), "{time:?}");
    });
}

#[test]
fn values_from_navigation_can_have_a_time_of_tai() {
    let values = |time: Cuc| Navigation {
        epoch: u64::from_be_bytes(time.to_bytes()),
        expires_s: f32::NAN,
        altitude_m: f32::NAN,
        position_x_m: 6_608e3,
        position_y_m: 0.0,
        position_z_m: 0.0,
        velocity_x_m_s: 0.0,
        velocity_y_m_s: 7300.0,
        velocity_z_m_s: 0.0,
        rate_x_rad_s: f32::NAN,
        rate_y_rad_s: f32::NAN,
        rate_z_rad_s: f32::NAN,
    };
    let navigate = |f: &mut Flight<'_, Bench>, time| {
        send(f, &command(1, Function::Navigate, |w| values(time).write(w))).answers[0].2
    };
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        assert_eq!(navigate(f, Cuc::tai(TAI_US)), Code::NoClock);
        assert_eq!(set_time(f, TAI_US + 10_000_000, 0).0, Code::Done);
        // The values are ten seconds old.
        assert_eq!(navigate(f, Cuc::tai(TAI_US)), Code::Done);
        f.board().pictures.push_back((limb(), 0));
        f.turn();
        let h = take_sent(f);
        let state = h.navigation[0];
        assert_eq!((state.picture, state.state), (1, 1));
        assert!((state.age_s - 10.0).abs() < 1e-2, "{state:?}");
        assert!((state.position_m[1] - 73e3).abs() < 100.0, "{state:?}");
        let axis = h.science[0].1.direction.unwrap().axis_fixed;
        assert!(((-axis[1]).atan2(-axis[0]).to_degrees() - 0.633).abs() < 2e-3, "{axis:?}");
    });
}

#[test]
fn the_bits_of_pictures_stay_within_their_budget() {
    let budget = |rate: f64| {
        fly(ready(), |f| {
            send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
            let set = command(1, Function::SetParameters, |w| {
                w.u8(1);
                w.u16(306);
                w.f64(rate);
            });
            assert_eq!(send(f, &set).answers[0].2, Code::Done);
            let (mut bytes, mut pictures) = (0, 0);
            for _ in 0..200 {
                f.board().now_us += 100_000;
                f.board().pictures.push_back((limb(), 0));
                f.turn();
                let sent = f.board().sent.len();
                let h = take_sent(f);
                if h.science.is_empty() {
                    continue;
                }
                let answer = &h.science[0].1;
                assert!(answer.position.is_some() && answer.integrity.is_some(), "a picture is sent whole");
                pictures += 1;
                bytes += sent - h.housekeeping.len() * (OVERHEAD + Housekeeping::BYTES);
            }
            let report = send(f, &command(2, Function::Report, |_| ()));
            assert_eq!(report.housekeeping[0].decimated, 200 - pictures);
            (bytes, pictures)
        })
    };
    let (all_bytes, all) = budget(f64::NAN);
    assert_eq!(all, 200);
    // Twenty seconds.
    let (bytes, some) = budget(10_000.0);
    assert!(8 * bytes <= 20 * 10_000 + 10_000 && some > 20, "{bytes} bytes, {some} pictures of {all_bytes} bytes");
    // The numbers of the documents: the picture has a free fit, and a direction.
    let mut without = 0;
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let set = command(1, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(308);
            w.f64(0.0);
        });
        assert_eq!(send(f, &set).answers[0].2, Code::Done);
        f.board().pictures.push_back((limb(), 0));
        f.turn();
        without = f.board().sent.len();
        let (_, answer) = take_sent(f).science[0];
        assert!(answer.direction.is_some() && answer.integrity.is_none());
    });
    assert_eq!((all_bytes, without), (200 * 417, 361));
    println!("a picture has {} bytes; {some} of 200 pictures in 20 s with 10 000 bit/s", all_bytes / 200);
}
