//! The report of `hzn fuse` as one page of HTML that needs no other file.

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use hzn_fuse::Fused;
use hzn_fuse::input::Body;
use hzn_fuse::results::{CameraState, Epoch, Innovation, Kind, Triad};
use hzn_plot::{Chart, Series, Style};
use nalgebra::Vector3;

use super::summary;
use crate::html::{DARK, STYLE, escape, provenance};

/// Rules of style in addition to those of all reports.
const MORE_STYLE: &str = ".plots{grid-template-columns:repeat(auto-fit,minmax(520px,1fr));margin:1.5rem 0}\
.plots svg{width:100%;height:auto}td{text-align:left}";

/// Axes of a frame.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns the page. `sensors` are the hashes of the sensors of the cameras.
pub(super) fn html(fused: &Fused, results: &str, sensors: &[String]) -> anyhow::Result<String> {
    let row =
        |(name, value): (String, String)| format!("<tr><td>{}</td><td>{}</td></tr>", escape(&name), escape(&value));
    let table: String = summary::lines(fused, None).into_iter().map(row).collect();
    let findings = fused.verdict.findings.iter().map(|f| &f.what);
    let notes: String = findings.chain(&fused.notes).map(|note| format!("<p>{}</p>", escape(note))).collect();
    let mut plots = String::new();
    // A chart without a point is left out: a flight without Sun has no TRIAD.
    for chart in charts(fused).iter().filter(|c| c.series.iter().any(|s| !s.points.is_empty())) {
        plots.push_str(&chart.svg()?);
    }
    Ok(format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>hzn fuse</title>\
         <style>{STYLE}{MORE_STYLE}{DARK}</style><h1>Attitude and position: {}</h1>{notes}<table>{table}</table>\
         <div class=\"plots\">{plots}</div>{}</html>\n",
        escape(results),
        provenance(sensors)
    ))
}

fn charts(fused: &Fused) -> Vec<Chart> {
    let mut all = vec![attitude_sigma(fused), angles(fused), triads(fused), direction_sigma(fused)];
    all.extend([height(fused), rates(fused), unaided(fused)]);
    for camera in 0..fused.cameras.len() {
        all.push(mount(fused, camera));
    }
    all.push(clocks(fused));
    let deg = |v: Vector3<f64>| v.map(|x| x.to_degrees() * 3600.0);
    all.push(bias(
        fused,
        "Bias of the gyros (thin: 3 sigma)",
        "deg/h",
        &|e| deg(*e.corrections.gyro_bias.as_inner()),
        &|e| deg(e.gyro_bias_sigma_rad_s),
    ));
    all.push(bias(
        fused,
        "Bias of the accelerometers (thin: 3 sigma)",
        "m/s²",
        &|e| *e.corrections.accel_bias.as_inner(),
        &|e| e.accel_bias_sigma_m_s2,
    ));
    all.extend(innovations(fused));
    all
}

/// Makes a chart over time.
fn over_time(title: impl Into<String>, unit: &str) -> Chart {
    Chart::new(title, "time [s]", unit).sized((720, 360))
}

/// Makes a line over the solutions.
fn line(fused: &Fused, name: &str, style: Style, value: impl Fn(&Epoch) -> f64) -> Series {
    Series::new(name, style, fused.epochs.iter().map(|e| (e.state.time_s, value(e))))
}

fn attitude_sigma(fused: &Fused) -> Chart {
    let mut chart = over_time("Attitude, 3 sigma about the axes of the vehicle ([BB] figures 37 to 44)", "deg");
    for (i, axis) in AXES.iter().enumerate() {
        chart = chart.with_series(line(fused, axis, Style::Line, |e| 3.0 * e.attitude_sigma_rad()[i].to_degrees()));
    }
    let smoothed = fused.smoothed.iter().map(|e| (e.state.time_s, 3.0 * e.attitude_sigma_rad().max().to_degrees()));
    if fused.smoothed.is_empty() {
        return chart;
    }
    chart.with_series(Series::new("smoothed, largest", Style::Line, smoothed))
}

/// The bodies with their names in the charts.
const BODIES: [(Body, &str); 4] =
    [(Body::Limb, "limb"), (Body::Sun, "Sun"), (Body::Moon, "Moon"), (Body::Other, "direction")];

fn directions(fused: &Fused, body: Body) -> impl Iterator<Item = &Innovation> {
    fused.innovations.iter().filter(move |i| i.kind == Kind::Direction(body))
}

fn angles(fused: &Fused) -> Chart {
    let mut chart = over_time("Angle between measured directions and the solution ([BB] figures 37 to 44)", "deg");
    for (body, name) in BODIES {
        if directions(fused, body).next().is_none() {
            continue;
        }
        let points = |angle: fn(&Innovation) -> Option<f64>| {
            directions(fused, body).filter_map(move |i| Some((i.time_s, angle(i)?.to_degrees()))).collect::<Vec<_>>()
        };
        chart = chart
            .with_series(Series::new(format!("{name}, aided"), Style::Dots, points(|i| i.angle_rad)))
            .with_series(Series::new(format!("{name}, unaided"), Style::Dots, points(|i| i.unaided_rad)));
    }
    chart
}

fn triads(fused: &Fused) -> Chart {
    let points =
        |angle: fn(&Triad) -> f64| fused.triads.iter().map(|t| (t.time_s, angle(t).to_degrees())).collect::<Vec<_>>();
    over_time("Angle between TRIAD (two directions alone) and the solution ([BB] figures 37 to 44)", "deg")
        .with_series(Series::new("aided", Style::Dots, points(|t| t.angle_rad)))
        .with_series(Series::new("unaided", Style::Dots, points(|t| t.unaided_rad)))
}

/// Returns the height above WGS-84.
fn height(fused: &Fused) -> Chart {
    let km = |e: &Epoch| geodetic(e.state.position_m.into_inner().into(), WGS84_A_M, WGS84_B_M).0 / 1e3;
    // The star tracker alone gives no position: the state then has that of the Earth's centre.
    let points = fused.epochs.iter().filter(|e| e.state.position_m.into_inner().norm() > 1e6);
    over_time("Height above WGS-84", "km").with_series(Series::new(
        "",
        Style::Line,
        points.map(|e| (e.state.time_s, km(e))),
    ))
}

fn rates(fused: &Fused) -> Chart {
    let rate = |i: usize| move |e: &Epoch| e.rate_rad_s.xyz()[i].to_degrees();
    let lines = AXES.iter().enumerate().map(|(i, axis)| line(fused, axis, Style::Line, rate(i)));
    lines.fold(over_time("Rate of the vehicle against the Earth", "deg/s"), Chart::with_series)
}

/// Returns how far the solution without any aid after the first attitude turns away from the aided one.
fn unaided(fused: &Fused) -> Chart {
    let turned = |i: usize| {
        move |e: &Epoch| {
            let turned =
                e.unaided.map(|unaided| (unaided.attitude.inverse() * e.state.attitude).scaled_axis().xyz()[i]);
            turned.map_or(f64::NAN, f64::to_degrees)
        }
    };
    let lines = AXES.iter().enumerate().map(|(i, axis)| line(fused, axis, Style::Line, turned(i)));
    lines.fold(
        over_time("Rotation from the unaided to the aided attitude, axes of the vehicle", "deg"),
        Chart::with_series,
    )
}

fn direction_sigma(fused: &Fused) -> Chart {
    let mut chart = over_time("3 sigma of the directions, as the sensors tell it ([BB] figure 37)", "deg");
    for (camera, name) in fused.cameras.iter().enumerate() {
        for (body, what) in BODIES {
            let points: Vec<(f64, f64)> = directions(fused, body)
                .filter(|i| i.camera == Some(camera))
                .filter_map(|i| Some((i.time_s, 3.0 * i.sensor_sigma_rad?.to_degrees())))
                .collect();
            if !points.is_empty() {
                chart = chart.with_series(Series::new(format!("{name}, {what}"), Style::Dots, points));
            }
        }
    }
    chart
}

fn mount(fused: &Fused, camera: usize) -> Chart {
    let name = fused.cameras.get(camera).cloned().unwrap_or_default();
    let of = |e: &Epoch, value: &dyn Fn(&CameraState) -> f64| e.cameras.get(camera).map_or(f64::NAN, value);
    let mut chart = over_time(format!("Mount of {name}: estimate against the told one (thin: 3 sigma)"), "deg");
    for (i, axis) in AXES.iter().enumerate() {
        chart =
            chart.with_series(line(fused, axis, Style::Line, |e| of(e, &|c| c.misalignment_rad.xyz()[i].to_degrees())));
        for sign in [-3.0, 3.0] {
            let bound =
                |c: &CameraState| (c.misalignment_rad.xyz()[i] + sign * c.misalignment_sigma_rad[i]).to_degrees();
            chart = chart.with_series(line(fused, "", Style::Ideal, |e| of(e, &bound)));
        }
    }
    chart
}

fn clocks(fused: &Fused) -> Chart {
    let mut chart = over_time("Clocks of the cameras (thin: 3 sigma)", "s");
    for (camera, name) in fused.cameras.iter().enumerate() {
        let is_known = fused.epochs.iter().any(|e| e.cameras.get(camera).is_some_and(|c| c.clock_sigma_s > 0.0));
        if !is_known {
            continue;
        }
        let of = |e: &Epoch, sign: f64| e.cameras.get(camera).map_or(f64::NAN, |c| c.clock_s + sign * c.clock_sigma_s);
        chart = chart.with_series(line(fused, name, Style::Line, |e| of(e, 0.0)));
        for sign in [-3.0, 3.0] {
            chart = chart.with_series(line(fused, "", Style::Ideal, |e| of(e, sign)));
        }
    }
    chart
}

fn bias(
    fused: &Fused,
    title: &str,
    unit: &str,
    value: &dyn Fn(&Epoch) -> Vector3<f64>,
    sigma: &dyn Fn(&Epoch) -> Vector3<f64>,
) -> Chart {
    let mut chart = over_time(title, unit);
    for (i, axis) in AXES.iter().enumerate() {
        chart = chart.with_series(line(fused, axis, Style::Line, |e| value(e)[i]));
        for sign in [-3.0, 3.0] {
            chart = chart.with_series(line(fused, "", Style::Ideal, |e| value(e)[i] + sign * sigma(e)[i]));
        }
    }
    chart
}

/// Returns a chart for each source and kind: innovations, those that were refused, and three sigma.
fn innovations(fused: &Fused) -> Vec<Chart> {
    let mut kinds: Vec<(Option<usize>, Kind)> = fused.innovations.iter().map(|i| (i.camera, i.kind)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds.into_iter().map(|(camera, kind)| innovation(fused, camera, kind)).collect()
}

fn innovation(fused: &Fused, camera: Option<usize>, kind: Kind) -> Chart {
    let (unit, scale) = match kind {
        Kind::Direction(_) | Kind::Attitude => ("deg", 1f64.to_degrees()),
        Kind::Centre | Kind::Position => ("m", 1.0),
        Kind::Velocity => ("m/s", 1.0),
    };
    let name = camera.and_then(|c| fused.cameras.get(c)).map(|name| format!("{name}, ")).unwrap_or_default();
    let of = || fused.innovations.iter().filter(move |i| i.camera == camera && i.kind == kind);
    let points = |taken: bool| {
        let one = move |i: &Innovation| -> Vec<(f64, f64)> { i.value.iter().map(|x| (i.time_s, x * scale)).collect() };
        of().filter(|i| i.taken == taken).flat_map(one).collect::<Vec<_>>()
    };
    let sigma = |i: &Innovation| scale * i.sigma.iter().copied().fold(0.0, f64::max);
    let mut sigmas: Vec<f64> = of().map(sigma).collect();
    sigmas.sort_unstable_by(f64::total_cmp);
    // At the start the sigmas are so large that they would hide all others.
    let largest = 4.0 * sigmas.get(sigmas.len() / 2).copied().unwrap_or(f64::INFINITY);
    let bound = |sign: f64| {
        let shown = of().filter(|i| sigma(i) <= largest);
        shown.map(|i| (i.time_s, sign * sigma(i))).collect::<Vec<_>>()
    };
    let mut chart = over_time(format!("Innovations of {name}{} (thin: 3 sigma)", kind.name()), unit)
        .with_series(Series::new("taken", Style::Dots, points(true)));
    let refused = points(false);
    if !refused.is_empty() {
        chart = chart.with_series(Series::new("refused", Style::Dots, refused));
    }
    chart.with_series(Series::new("", Style::Ideal, bound(3.0))).with_series(Series::new("", Style::Ideal, bound(-3.0)))
}
