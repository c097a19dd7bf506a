//! Values from navigation that have a time, a velocity and an expiry.

use hzn_flight::bytes::Writer;
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Code, Event, Function, Mode, Navigation};

use crate::bench::{Bench, command, fly, limb, ready, send, take_sent};

const NAN: f32 = f32::NAN;

fn unknown() -> Navigation {
    Navigation {
        epoch: 0,
        expires_s: NAN,
        altitude_m: NAN,
        position_x_m: NAN,
        position_y_m: NAN,
        position_z_m: NAN,
        velocity_x_m_s: NAN,
        velocity_y_m_s: NAN,
        velocity_z_m_s: NAN,
        rate_x_rad_s: NAN,
        rate_y_rad_s: NAN,
        rate_z_rad_s: NAN,
    }
}

fn navigate(f: &mut Flight<'_, Bench>, values: Navigation) -> Code {
    send(f, &command(1, Function::Navigate, |w: &mut Writer<'_>| values.write(w))).answers[0].2
}

/// Processes a picture, and returns the axis in ECEF and the altitude that it was given.
fn picture(f: &mut Flight<'_, Bench>) -> ([f32; 3], f32) {
    f.board().pictures.push_back((limb(), 0));
    f.turn();
    let science = take_sent(f).science;
    (science[0].1.direction.unwrap().axis_fixed, science[0].0.altitude_m)
}

#[test]
fn a_position_moves_on_to_the_exposure() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let values = Navigation {
            epoch: f.board().now_us,
            position_x_m: 6_608e3,
            position_y_m: 0.0,
            position_z_m: 0.0,
            velocity_x_m_s: 0.0,
            velocity_y_m_s: 7300.0,
            velocity_z_m_s: 0.0,
            ..unknown()
        };
        assert_eq!(navigate(f, values), Code::Done);
        let angle = |axis: [f32; 3]| (-axis[1]).atan2(-axis[0]).to_degrees();
        let first = angle(picture(f).0);
        f.board().now_us += 10_000_000;
        let later = angle(picture(f).0);
        // 73 km in ten seconds at 6608 km are 0.633 degrees.
        assert!(first.abs() < 1e-3 && (later - 0.633).abs() < 2e-3, "{first} {later}");
    });
}

#[test]
fn values_that_have_expired_are_not_used_and_told_once() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let values = |epoch| Navigation { epoch, expires_s: 5.0, altitude_m: 231e3, ..unknown() };
        let now_us = f.board().now_us;
        assert_eq!(navigate(f, values(now_us)), Code::Done);
        assert_eq!(picture(f).1, 231e3);
        f.board().now_us += 6_000_000;
        f.board().pictures.extend([(limb(), 0), (limb(), 0)]);
        (0..2).for_each(|_| f.turn());
        let h = take_sent(f);
        assert_eq!(h.science[1].0.altitude_m, 230e3, "the altitude of the parameters");
        assert!(matches!(h.events[..], [(Event::KnownExpired, 6000..=6100, 0)]), "{:?}", h.events);
        let now_us = f.board().now_us;
        assert_eq!(navigate(f, values(now_us)), Code::Done);
        assert_eq!(picture(f).1, 231e3);
    });
}

#[test]
fn impossible_values_are_refused() {
    fly(ready(), |f| {
        let now = f.board().now_us;
        let at = |values: Navigation| Navigation { epoch: now, ..values };
        let placed = Navigation { position_x_m: 6_608e3, position_y_m: 0.0, position_z_m: 0.0, ..at(unknown()) };
        let refused = [
            Navigation { epoch: now + 3_700_000_000, altitude_m: 2e5, ..unknown() },
            Navigation { expires_s: 0.0, altitude_m: 2e5, ..at(unknown()) },
            Navigation { expires_s: f32::INFINITY, altitude_m: 2e5, ..at(unknown()) },
            Navigation { velocity_x_m_s: 3e4, velocity_y_m_s: 0.0, velocity_z_m_s: 0.0, ..placed },
            // A velocity without a position.
            Navigation {
                velocity_x_m_s: 0.0,
                velocity_y_m_s: 0.0,
                velocity_z_m_s: 0.0,
                altitude_m: 2e5,
                ..at(unknown())
            },
            Navigation { altitude_m: -9e3, ..at(unknown()) },
        ];
        for values in refused {
            assert_eq!(navigate(f, values), Code::Refused, "{values:?}");
        }
        assert_eq!(navigate(f, Navigation { velocity_y_m_s: 5.0, ..placed }), Code::Missing);
        assert_eq!(send(f, &command(1, Function::Navigate, |w| w.u64(5))).answers[0].2, Code::Arguments);
        assert_eq!(navigate(f, placed), Code::Done);
    });
}

#[test]
fn a_number_that_is_missing_or_impossible_is_named() {
    fly(ready(), |f| {
        let epoch = f.board().now_us;
        let placed = Navigation { epoch, position_x_m: 6_608e3, position_y_m: 0.0, position_z_m: 0.0, ..unknown() };
        let cases = [
            (Navigation { position_y_m: NAN, ..placed }, Code::Missing, "position_y_m"),
            (Navigation { velocity_z_m_s: 1.0, ..placed }, Code::Missing, "velocity_x_m_s"),
            (Navigation { rate_x_rad_s: 1.0, rate_y_rad_s: 1.0, ..placed }, Code::Missing, "rate_z_rad_s"),
            (Navigation { position_z_m: f32::INFINITY, ..placed }, Code::Refused, "position_z_m"),
            (Navigation { altitude_m: f32::INFINITY, ..placed }, Code::Refused, "altitude_m"),
            (Navigation { expires_s: -1.0, ..placed }, Code::Refused, "expires_s"),
            (Navigation { epoch: epoch + 3_700_000_000, ..placed }, Code::Refused, "epoch"),
            (Navigation { epoch: 0x77 << 56, ..placed }, Code::Refused, "epoch"),
        ];
        for (values, code, name) in cases {
            let h = send(f, &command(1, Function::Navigate, |w| values.write(w)));
            assert_eq!(h.answers[0].2, code, "{name}");
            assert_eq!(Navigation::FIELDS[usize::from(h.details[0]) - 1], name);
        }
    });
}

/// The picture shows the same limb again and again, while navigation says that the camera turns.
#[test]
fn an_edge_that_stays_while_the_vehicle_turns_is_refused_and_told() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let mut see = |rate: f32| {
            let still = Navigation { epoch: f.board().now_us, altitude_m: 230e3, ..unknown() };
            let values = Navigation { rate_x_rad_s: rate, rate_y_rad_s: 0.0, rate_z_rad_s: 0.0, ..still };
            assert_eq!(navigate(f, values), Code::Done);
            f.board().now_us += 1_000_000;
            f.board().pictures.push_back((limb(), 0));
            f.turn();
            let sent = take_sent(f);
            (sent.science[0].1.outcome.status, sent.events)
        };
        let rejected = hzn_core::status::Status::Rejected as u8;
        assert_eq!(see(0.1), (0, vec![]));
        // New values from navigation do not make the computer forget the picture before.
        let (status, events) = see(0.1);
        assert_eq!(status, rejected);
        assert!(events.contains(&(Event::FixedEdge, 2, 0)), "{events:?}");
        assert_eq!(see(0.1).0, rejected);
    });
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let values = Navigation { rate_x_rad_s: 0.0, rate_y_rad_s: 0.0, rate_z_rad_s: 0.0, ..unknown() };
        let values = Navigation { epoch: f.board().now_us, altitude_m: 230e3, ..values };
        assert_eq!(navigate(f, values), Code::Done);
        for _ in 0..3 {
            f.board().now_us += 1_000_000;
            f.board().pictures.push_back((limb(), 0));
            f.turn();
            assert_eq!(take_sent(f).science[0].1.outcome.status, 0);
        }
    });
}

#[test]
fn the_lens_follows_the_thermometer_of_the_camera() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let mut direction = |temperature_c: Option<f32>| {
            f.board().camera_temperature_c = temperature_c;
            f.board().pictures.push_back((limb(), 0));
            f.turn();
            let sent = take_sent(f);
            (sent.science[0].1.direction.unwrap().axis, sent.events)
        };
        // Without the section a temperature changes nothing.
        let plain = direction(None);
        assert_eq!(direction(Some(-10.0)), plain);
        let parameters = [(24, 20.0), (25, 300.0), (26, 0.0), (27, 0.02), (28, 0.0)];
        let set = command(1, Function::SetParameters, |w| {
            w.u8(parameters.len() as u8);
            parameters.iter().for_each(|&(id, value): &(u16, f64)| {
                w.u16(id);
                w.f64(value);
            });
        });
        assert_eq!(send(f, &set).answers[0].2, Code::Done);
        let mut direction = |temperature_c: Option<f32>| {
            f.board().camera_temperature_c = temperature_c;
            f.board().pictures.push_back((limb(), 0));
            f.turn();
            let sent = take_sent(f);
            (sent.science[0].1.direction.unwrap().axis, sent.events)
        };
        let (reference, _) = direction(None);
        assert_eq!((reference, direction(Some(20.0)).0), (plain.0, plain.0));
        let (cold, events) = direction(Some(-10.0));
        let off = (0..3).map(|i| (cold[i] - reference[i]).powi(2)).sum::<f32>().sqrt();
        // 30 K move the image by up to 0.6 px and 0.9 % of its coordinates; the focal length is 600 px.
        assert!((3e-4..0.02).contains(&off) && events.is_empty(), "{off} {events:?}");
        // A thermometer that counts in kelvin, or is broken, costs an event and not the answer.
        let (broken, events) = direction(Some(-273.0));
        assert_eq!((broken, &events[..]), (reference, &[(Event::KnownRefused, 1, 0)][..]));
    });
}
