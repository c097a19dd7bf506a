//! The compiled pipelines of `hzn-host`: every kind of picture, with an observer and without, in both precisions.

use hzn_core::image::{Channel, ImageView, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::status::Status;
use hzn_core::{Expected, Prior};
use hzn_host::{Clock, Compiled, Task};
use hzn_sim::{Samples, flight};
use hzn_tests::Sensors;

/// Returns the reports of a sensor without an observer, with one, for several bodies, and how many times were measured.
fn reports<H: Compiled>(horizon: &mut H, view: ImageView<'_>, expected: &Expected<H::Scalar>) -> ([String; 3], usize)
where
    H::Scalar: std::fmt::Debug,
{
    let clock = Clock::default();
    let plain = format!("{:?}", horizon.find(view, expected));
    let observed = format!("{:?}", horizon.find_observed(&view, expected, &Unobserved));
    let each = horizon.perform(view, Task::Each(std::slice::from_ref(expected)), &clock);
    ([plain, observed, format!("{:?}", each[0])], clock.times().len())
}

#[test]
fn every_kind_of_picture_has_the_same_report_with_an_observer() {
    let flight = flight::rocket(320, 180, 3, 1);
    let picture = flight.frames[1].render().unwrap();
    let Samples::Bytes(bytes) = picture.samples() else { panic!("8 bits are bytes") };
    let words: Vec<u16> = bytes.iter().map(|&b| u16::from(b) * 16).collect();
    let colours: Vec<u8> = bytes.iter().flat_map(|&b| [b, b, b]).collect();
    let colour_words: Vec<u16> = words.iter().flat_map(|&w| [w, w, w]).collect();
    let packed = |channels, bits| Layout::packed(320, 180, channels, bits);
    let views = [
        ImageView::from_bytes(bytes, packed(1, 8), Channel::Mean),
        ImageView::from_words(&words, packed(1, 12), Channel::Mean),
        ImageView::from_bytes(&colours, packed(3, 8), Channel::Mean),
        ImageView::from_words(&colour_words, packed(3, 12), Channel::Mean),
    ]
    .map(Result::unwrap);
    for (i, view) in views.into_iter().enumerate() {
        // The first picture gives the threshold that the sensor remembers for the ones after it.
        let mut sensors = Sensors::new(&flight.sensor);
        let prior = flight.frames[1].prior();
        let expected = sensors.host.expect(&prior).unwrap();
        assert_eq!(sensors.host.find(view, &expected).status, Status::Ok, "{i}");
        let (host, times) = reports(&mut *sensors.host, view, &expected);
        assert!(host.iter().all(|r| *r == host[0]) && times == 1, "{i}: {host:?}");
        let single = |v: [f64; 3]| v.map(|x| x as f32);
        let prior = Prior {
            altitude_m: prior.altitude_m.map(|m| m as f32),
            position_m: prior.position_m.map(single),
            rate_rad_s: prior.rate_rad_s.map(single),
            ..Prior::default()
        };
        let expected = sensors.flight.expect(&prior).unwrap();
        assert_eq!(sensors.flight.find(view, &expected).status, Status::Ok, "{i}");
        let (flight, times) = reports(&mut *sensors.flight, view, &expected);
        assert!(flight.iter().all(|r| *r == flight[0]) && times == 1, "{i}: {flight:?}");
    }
}
