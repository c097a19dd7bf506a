//! Arbitrary pictures, shapes in memory, configurations and priors.

use hzn_core::body::{Kind, Prior};
use hzn_core::camera::{self, Model};
use hzn_core::image::{Channel, Grey, ImageView, Layout};
use hzn_core::pipeline::{ROWS_HELD, RowBuffers};
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::threshold::Method;
use hzn_core::{Config, FlightHorizon, FlightWorkspace, HostHorizon, Preset, Report, Sensor};
use hzn_host::Compiled;

use crate::input::Input;

/// Largest side of a picture, so that one execution takes about a millisecond.
const MAX_SIDE: usize = 96;

/// Takes a configuration: a preset, a lens, a body, and some numbers of any value.
fn config(input: &mut Input<'_>, width: u16, height: u16) -> Config {
    let models = [Model::Pinhole, Model::Equidistant, Model::KannalaBrandt, Model::BrownConrady];
    let camera = camera::Config::ideal(models[input.below(models.len())], width, height, 4.0 + f64::from(input.byte()));
    let mut config = Config::preset(Preset::ALL[input.below(Preset::ALL.len())], camera);
    config.body.kind = [Kind::Earth, Kind::EarthSphere, Kind::Sun, Kind::Moon, Kind::Sphere][input.below(5)];
    config.body.radius_km = (config.body.kind == Kind::Sphere).then_some(1000.0);
    config.body.altitude_km = Some(60.0 + 10.0 * f64::from(input.byte()));
    config.edge_points.min_points = 8;
    config.gates.min_inliers = 8;
    let numbers: Vec<u16> = Config::numbers().collect();
    for _ in 0..input.below(5) {
        let before = config.clone();
        let number = numbers[input.below(numbers.len())];
        let value = if input.byte().is_multiple_of(2) { input.number() } else { f64::from(input.byte()) / 4.0 };
        // A refused value, or values that contradict each other, leave the configuration as it was.
        if config.set_number(number, value) != Some(true) || config.check().is_err() {
            config = before;
        }
    }
    config
}

/// Checks the promises of a report.
fn check<T: Real>(report: &Report<T>) {
    assert_eq!(report.status == Status::Ok, report.solution.is_some());
    let Some(s) = &report.solution else { return };
    let axis = s.axis.xyz().map(|x| x.to_f64());
    assert!((axis.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-5, "the axis has the length 1");
    assert!(s.covariance.upper_rad2.iter().all(|v| v.is_finite()) && s.half_angle_rad.is_finite());
    assert!(s.covariance.sigma_max_rad().to_f64() > 0.0, "sigma is above 0");
}

fn prior<T: Real>(input: &mut Input<'_>) -> Prior<T> {
    let some = |input: &mut Input<'_>| input.byte().is_multiple_of(4).then(|| T::from_f64(input.number()));
    let altitude_m = some(input);
    let attitude_sigma_rad = some(input);
    let vector = |input: &mut Input<'_>| {
        input.byte().is_multiple_of(4).then(|| std::array::from_fn(|_| T::from_f64(input.number())))
    };
    Prior { altitude_m, attitude_sigma_rad, position_m: vector(input), rate_rad_s: vector(input), ..Prior::default() }
}

fn process(config: &Config, picture: &ImageView<'_>, mut input: Input<'_>) {
    if let Ok(mut host) = HostHorizon::boxed(config)
        && let Ok(expected) = host.expect(&prior(&mut input))
    {
        let report = host.find(picture, &expected);
        check(&report);
        let again = host.find(picture, &expected);
        assert_eq!(report.counters, again.counters, "the same picture gives the same report");
        host.find_each(picture, &[expected; 2]).iter().for_each(check);
    }
    if let Ok(mut flight) = FlightHorizon::boxed(config)
        && let Ok(expected) = flight.expect(&prior(&mut input))
    {
        check(&flight.find(picture, &expected));
    }
}

/// Any picture of any shape, with any configuration and prior.
pub(crate) fn any_picture(bytes: &[u8]) {
    let mut input = Input(bytes);
    let (width, height) = (1 + input.below(MAX_SIDE), 1 + input.below(MAX_SIDE));
    let config = config(&mut input, width as u16, height as u16);
    let (channels, bits) = (1 + input.byte() % 4, 7 + input.byte() % 11);
    let stride = (width * usize::from(channels) + input.below(9)).saturating_sub(1);
    let layout = Layout { width: width as u32, height: height as u32, stride, channels, bits };
    let need = stride * height + usize::from(input.byte() % 3);
    let known = Input(input.0.get(..64.min(input.0.len())).unwrap_or_default());
    let channel = [Channel::Mean, Channel::Red, Channel::Blue][input.below(3)];
    let pixels = input.rest();
    if pixels.is_empty() {
        return;
    }
    // Few bytes make a whole picture, so that the fuzzer does not have to write each pixel.
    let sample = |i: usize| pixels[i * 7 / 5 % pixels.len()];
    if bits == 8 {
        let data: Vec<u8> = (0..need).map(sample).collect();
        if let Ok(view) = ImageView::from_bytes(&data, layout, channel) {
            process(&config, &view, known);
        }
    } else {
        let data: Vec<u16> = (0..need).map(|i| u16::from(sample(i)) << 4 | u16::from(sample(i + 1)) >> 4).collect();
        if let Ok(view) = ImageView::from_words(&data, layout, channel) {
            process(&config, &view, known);
        }
    }
}

const WIDTH: usize = 64;
const HEIGHT: usize = 48;
type Rows = RowBuffers<u8, { ROWS_HELD as usize * WIDTH }, HEIGHT, 1024, 1024>;

/// A picture that comes row by row gives the same status as the same picture in memory, unless lists overflow or an
/// edge is wider than the rows in memory. The gates that look at brightness again are off, because only lit and dark
/// pixels are left of rows.
pub(crate) fn any_rows(bytes: &[u8]) {
    let mut input = Input(bytes);
    let mut config = config(&mut input, WIDTH as u16, HEIGHT as u16);
    // The size is one of the numbers.
    (config.camera.width, config.camera.height) = (WIDTH as u16, HEIGHT as u16);
    config.threshold.method = Method::Fixed;
    config.threshold.level = f64::from(1 + input.byte() % 254);
    config.retry.levels.clear();
    config.retry.frame_px = 0;
    let gates = &mut config.gates;
    (gates.max_band, gates.max_departure, gates.max_glow, gates.max_lit_sky) = (1.0, 1e6, 1e6, 1.0);
    let pixels = input.rest();
    let (Ok(sensor), false) = (Sensor::<f32>::new(&config), pixels.is_empty()) else { return };
    let Ok(expected) = sensor.expect(&Prior::default()) else { return };
    let data: Vec<u8> = (0..WIDTH * HEIGHT).map(|i| pixels[i * 7 / 5 % pixels.len()]).collect();
    let mut rows = Box::new(Rows::new());
    let Ok(mut stream) = sensor.rows(&mut rows, 8, &expected) else { return };
    for row in data.chunks(WIDTH) {
        stream.push_row(row).expect("a row of the right length");
    }
    let streamed = stream.finish(&mut Box::new(FlightWorkspace::new()), &hzn_core::observer::Unobserved);
    check(&streamed);
    let whole = Grey::try_new(&data, Layout::packed(WIDTH as u32, HEIGHT as u32, 1, 8)).expect("a whole picture");
    let report = FlightHorizon::boxed(&config).map(|mut flight| flight.find(&whole, &expected));
    if let Ok(report) = report
        && (streamed.counters.dropped, streamed.counters.cut_points) == (0, 0)
        && streamed.status != Status::Truncated
        && report.status != Status::Truncated
    {
        assert_eq!(streamed.status, report.status, "row by row and in memory");
    }
}
