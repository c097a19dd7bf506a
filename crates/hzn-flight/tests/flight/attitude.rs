//! The attitude and the Sun by telecommand.

use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Attitude, AttitudeState, Code, Event, Function, Mode, Navigation};

use crate::bench::{Bench, Sent, command, fly, limb, ready, send, take_sent};

const NAN: f32 = f32::NAN;

/// Direction to the body in the picture of `limb`, in the camera frame.
fn axis() -> [f64; 3] {
    let (sin, cos) = 75f64.to_radians().sin_cos();
    [0.0, sin, cos]
}

/// Returns the attitude of a camera at +x of ECEF that sees the body's centre at `axis`: the shortest rotation from
/// there to −x.
fn attitude(axis: [f64; 3]) -> Attitude {
    let [x, y, z] = axis;
    let q = [1.0 - x, 0.0, -z, y];
    let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    let [q_w, q_x, q_y, q_z] = q.map(|v| (v / length) as f32);
    Attitude { expires_s: 60.0, q_w, q_x, q_y, q_z, sigma_rad: 0.05, ..unknown() }
}

fn unknown() -> Attitude {
    Attitude {
        epoch: 0,
        expires_s: NAN,
        q_w: NAN,
        q_x: NAN,
        q_y: NAN,
        q_z: NAN,
        sigma_rad: NAN,
        sun_x: NAN,
        sun_y: NAN,
        sun_z: NAN,
    }
}

fn orient(f: &mut Flight<'_, Bench>, values: Attitude) -> (Code, u16) {
    let sent = send(f, &command(1, Function::SetAttitude, |w| values.write(w)));
    (sent.answers[0].2, sent.details[0])
}

/// Sends a position on the x axis, and a rate of rotation if it is one.
fn place(f: &mut Flight<'_, Bench>, rate: f32) {
    let values = Navigation {
        epoch: f.board().now_us,
        expires_s: NAN,
        altitude_m: NAN,
        position_x_m: 6_608_137.0,
        position_y_m: 0.0,
        position_z_m: 0.0,
        velocity_x_m_s: NAN,
        velocity_y_m_s: NAN,
        velocity_z_m_s: NAN,
        rate_x_rad_s: rate,
        rate_y_rad_s: if rate.is_nan() { NAN } else { 0.0 },
        rate_z_rad_s: if rate.is_nan() { NAN } else { 0.0 },
    };
    let sent = send(f, &command(1, Function::Navigate, |w| values.write(w)));
    assert_eq!(sent.answers[0].2, Code::Done);
}

fn picture(f: &mut Flight<'_, Bench>) -> Sent {
    f.board().pictures.push_back((limb(), 0));
    f.turn();
    take_sent(f)
}

/// Returns the status of a picture, and the verdict on its first candidate.
fn verdict(sent: &Sent) -> (u8, u8) {
    let answer = &sent.science[0].1;
    (answer.status, answer.edges[0].unwrap().verdict)
}

/// Returns the telecommand that sets a parameter.
fn set(number: u16, value: f64) -> Vec<u8> {
    command(1, Function::SetParameters, |w| {
        w.u8(1);
        w.u16(number);
        w.f64(value);
    })
}

const CHOSEN: (u8, u8) = (Status::Ok as u8, Verdict::Chosen as u8);

#[test]
fn an_edge_where_the_attitude_has_no_limb_is_refused() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        // The attitude jumps here, and the edge does not: the gate of an edge that stays in the picture is off.
        assert_eq!(send(f, &set(133, 2.0)).answers[0].2, Code::Done);
        place(f, NAN);
        let sent = picture(f);
        assert_eq!((verdict(&sent), sent.attitude.len()), (CHOSEN, 0));
        let epoch = f.board().now_us;
        assert_eq!(orient(f, Attitude { epoch, ..attitude(axis()) }), (Code::Done, 0));
        let sent = picture(f);
        assert_eq!(verdict(&sent), CHOSEN);
        let shown = &sent.attitude[0];
        assert_eq!((shown.picture, shown.state, shown.q[0]), (2, AttitudeState::USED, attitude(axis()).q_w));
        assert!(shown.sun.iter().all(|x| x.is_nan()) && (0.0..0.1).contains(&shown.age_s), "{shown:?}");
        // The body is in the other direction: what is in the picture is no limb.
        let [x, y, z] = axis();
        assert_eq!(orient(f, Attitude { epoch, ..attitude([x, -y, z]) }), (Code::Done, 0));
        let rejected = (Status::Rejected as u8, Verdict::Attitude as u8);
        assert_eq!(verdict(&picture(f)), rejected);
        // New values of the position leave the attitude as it is.
        place(f, NAN);
        assert_eq!(verdict(&picture(f)), rejected);
        // The limit of the gate is a parameter.
        assert_eq!(send(f, &set(130, 1e6)).answers[0].2, Code::Done);
        assert_eq!(verdict(&picture(f)), CHOSEN);
        assert_eq!(send(f, &set(130, 4.0)).answers[0].2, Code::Done);
        // Values that are all unknown remove it.
        assert_eq!(orient(f, unknown()), (Code::Done, 0));
        assert_eq!(verdict(&picture(f)), CHOSEN);
    });
}

#[test]
fn an_attitude_turns_on_with_the_rate_and_expires() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        // The camera turns up at 5° a second: 8 s ago it looked 40° further down.
        let rate = 5f32.to_radians();
        let (sin, cos) = 35f64.to_radians().sin_cos();
        let before = attitude([0.0, sin, cos]);
        let epoch = f.board().now_us;
        place(f, rate);
        assert_eq!(orient(f, Attitude { epoch, ..before }), (Code::Done, 0));
        f.board().now_us = epoch + 7_990_000;
        assert_eq!(verdict(&picture(f)), CHOSEN, "moved by the rate");
        place(f, NAN);
        assert_eq!(verdict(&picture(f)).1, Verdict::Attitude as u8, "without a rate it stays");
        f.board().now_us = epoch + 61_000_000;
        let sent = picture(f);
        assert_eq!(verdict(&sent), CHOSEN, "it has expired");
        let expired: Vec<_> = sent.events.iter().filter(|event| event.0 == Event::KnownExpired).collect();
        assert!(matches!(expired[..], [(_, 61_000..=61_100, 1)]), "{expired:?}");
        assert_eq!((sent.attitude[0].state, sent.attitude[0].q[0]), (AttitudeState::EXPIRED, before.q_w));
        assert!(picture(f).events.is_empty(), "once");
    });
}

#[test]
fn a_limb_that_the_sun_does_not_light_is_refused() {
    fly(ready(), |f| {
        send(f, &command(1, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let [x, y, z] = axis().map(|v| v as f32);
        let mut see = |sun: [f32; 3]| {
            let [sun_x, sun_y, sun_z] = sun;
            let epoch = f.board().now_us;
            assert_eq!(
                orient(f, Attitude { epoch, expires_s: 60.0, sun_x, sun_y, sun_z, ..unknown() }),
                (Code::Done, 0)
            );
            verdict(&picture(f))
        };
        // The Sun is above the camera, and then behind the body.
        assert_eq!(see([-2.0 * x, -2.0 * y, -2.0 * z]), CHOSEN);
        assert_eq!(see([x, y, z]), (Status::Rejected as u8, Verdict::Sun as u8));
    });
}

#[test]
fn what_is_missing_or_impossible_is_named() {
    fly(ready(), |f| {
        let epoch = f.board().now_us;
        let good = Attitude { epoch, sun_x: 0.0, sun_y: 0.0, sun_z: 1.0, ..attitude(axis()) };
        let cases = [
            (Attitude { expires_s: NAN, ..good }, Code::Missing, "expires_s"),
            (Attitude { expires_s: -1.0, ..good }, Code::Refused, "expires_s"),
            (Attitude { epoch: epoch + 3_700_000_000, ..good }, Code::Refused, "epoch"),
            (Attitude { q_y: NAN, ..good }, Code::Missing, "q_y"),
            (Attitude { q_w: 3.0, ..good }, Code::Refused, "q_w"),
            (Attitude { sigma_rad: -0.1, ..good }, Code::Refused, "sigma_rad"),
            (Attitude { sun_y: NAN, ..good }, Code::Missing, "sun_y"),
            (Attitude { sun_z: 0.0, ..good }, Code::Refused, "sun_x"),
        ];
        for (values, code, name) in cases {
            let (refused, place) = orient(f, values);
            assert_eq!((refused, Attitude::FIELDS[usize::from(place) - 1]), (code, name));
        }
        assert_eq!(send(f, &command(1, Function::SetAttitude, |w| w.u64(5))).answers[0].2, Code::Arguments);
        assert_eq!(orient(f, good), (Code::Done, 0));
    });
}
