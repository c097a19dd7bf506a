//! The report as one page of HTML that needs no other file.

use hzn_calib::noise::{self, Calibration};
use hzn_core::Config;
use hzn_plot::{Chart, Series, Style};
use hzn_run::explain::counted;

use crate::html::{DARK, STYLE, escape, provenance};

/// Returns the hash of the sensor that a calibration began with.
fn hash(sensor: &Config) -> Vec<String> {
    hzn_run::provenance::hash(sensor).into_iter().collect()
}

/// Returns a page with a title, lines of name and value, and plots.
pub(super) fn simple(
    title: &str,
    lines: &[(String, String)],
    charts: &[Chart],
    sensor: &Config,
) -> anyhow::Result<String> {
    let row =
        |(name, value): &(String, String)| format!("<tr><td>{}</td><td>{}</td></tr>", escape(name), escape(value));
    let rows: String = lines.iter().map(row).collect();
    let plots = charts.iter().map(Chart::svg).collect::<Result<String, _>>()?;
    Ok(format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>{0}</title><style>{STYLE}{DARK}</style>\
         <h1>{0}</h1><table>{rows}</table><div class=\"plots\">{plots}</div>{1}</html>\n",
        escape(title),
        provenance(&hash(sensor))
    ))
}

pub(super) fn html(calibration: &Calibration, pictures: u64, flight: &str, sensor: &Config) -> anyhow::Result<String> {
    let camera = &sensor.camera;
    let rows: String = noise::lines(calibration, &counted(pictures, "picture"), camera)
        .iter()
        .map(|(name, value)| format!("<tr><td>{name}</td><td>{}</td></tr>", escape(value)))
        .collect();
    let alarm = calibration.alarm().map(|a| format!("<p><b>{}</b></p>", escape(&a.to_string()))).unwrap_or_default();
    Ok(format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Limb height and \
            noise</title><style>{STYLE}{DARK}</style>\
         <h1>Limb height and noise: {}</h1>{alarm}<table>{rows}</table><div class=\"plots\">{}{}</div>{}</html>\n",
        escape(flight),
        heights(calibration).svg()?,
        correlation(calibration).svg()?,
        provenance(&hash(sensor))
    ))
}

/// Plots the limb height of each picture with its errors.
fn heights(calibration: &Calibration) -> Chart {
    let each = || calibration.pictures.iter().enumerate().map(|(i, p)| (i as f64, p));
    let dots = |counts: bool| each().filter(move |(_, p)| p.counts == counts).map(|(x, p)| (x, p.km));
    let bars = each().flat_map(|(x, p)| [(x, p.km - p.sigma_km), (x, p.km + p.sigma_km), (x, f64::NAN)]);
    let mut chart = Chart::new("Limb height of each picture", "picture", "limb height [km]")
        .with_series(Series::new("1 sigma from edge noise", Style::Ideal, bars))
        .with_series(Series::new("measured", Style::Dots, dots(true)))
        .with_series(Series::new("calibration", Style::Line, each().map(|(x, p)| (x, p.explained_km))));
    if calibration.pictures.iter().any(|p| !p.counts) {
        chart = chart.with_series(Series::new("left out", Style::Dots, dots(false)));
    }
    chart
}

/// Plots the correlation of the residuals along the edge.
fn correlation(calibration: &Calibration) -> Chart {
    let e = calibration.edge;
    let last = calibration.correlation.last().map_or(1.0, |p| p.0);
    let model = (0..=100).map(|k| {
        let px = last * f64::from(k) / 100.0;
        (px, (1.0 - e.white) * (-px / e.length_px).exp())
    });
    Chart::new("Correlation of the residuals along the limb", "distance [px]", "correlation")
        .with_series(Series::new("model, before three parameters are fitted", Style::Ideal, model))
        .with_series(Series::new("residuals", Style::Line, calibration.correlation.iter().copied()))
}
