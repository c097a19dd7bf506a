//! The report of a calibrated lens as one page of HTML that needs no other file.

use std::fmt::Write;

use hzn_calib::board::{Calibrated, Residual, ViewResult};
use hzn_core::camera::{Config, Equation, Intrinsic};
use hzn_plot::{Chart, Series, Style};

use super::lens_text::Reasons;
use crate::html::{DARK, STYLE, escape, provenance};

/// Width of the pictures of the frame, in pixels of the page.
const WIDTH: f64 = 640.0;
/// Length on the page of an arrow for an error of the RMS, in pixels of the page.
const ARROW: f64 = 14.0;
/// Columns and rows of the coverage map.
const CELLS: [usize; 2] = [16, 12];
/// Number of segments of a plotted curve. The plots round to whole pixels, so that more segments show as stairs.
const SEGMENTS: i32 = 24;

/// Rules of style in addition to those of all reports.
const MORE_STYLE: &str = ".warning{background:#fff3d6;padding:.5rem 1rem}figure{margin:0}\
.plots{grid-template-columns:repeat(auto-fit,minmax(520px,1fr));margin:1.5rem 0}\
th{text-align:left;padding:.2rem .8rem;border-bottom:2px solid #ccc}.number{text-align:right}.left-out{color:#888}";

/// Rules of style for the drawings of the frame on a dark system, in addition to those of charts.
const DARK_FRAME: &str = "@media(prefers-color-scheme:dark){svg rect[fill='#fafafa']{fill:#1c1f24}\
svg rect[fill='#f3c1b0']{fill:#7a3b2a}svg [stroke='#444']{stroke:#9aa3ad}svg [stroke='#fff']{stroke:#15171b}}";

/// Returns the page. `reasons` says why pictures were left out before the fit.
pub(super) fn html(calibrated: &Calibrated, reasons: &Reasons, pictures: &str) -> anyhow::Result<String> {
    let row = |(name, value): &(String, String)| format!("<tr><td>{name}</td><td>{}</td></tr>", escape(value));
    let lens: String = calibrated.lines().iter().map(row).collect();
    let views: String = calibrated.views.iter().map(|view| view_row(view, reasons)).collect();
    let warnings: String =
        calibrated.warnings.iter().map(|w| format!("<p class=\"warning\">{}</p>", escape(&w.to_string()))).collect();
    Ok(format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Camera calibration</title>\
         <style>{STYLE}{MORE_STYLE}{DARK}</style>\
         <h1>Camera calibration: {}</h1>{warnings}<table>{lens}</table><div class=\"plots\"><figure>{}\
         <figcaption><b>Residuals</b>, measured minus projected, enlarged. The orange line in the corner is {:.3} px \
         long; grey points are outliers. Neighbours that point the same way show an error of the lens model.\
         </figcaption></figure><figure>{}<figcaption><b>Coverage</b>: number of points in each part of the picture. \
         A red cell has none.</figcaption></figure>{}{}{}</div><h2>Pictures</h2><table><tr><th>picture</th>\
         <th>points</th><th>outliers</th><th>RMS [px]</th><th>tilt [deg]</th><th></th></tr>{views}</table>{}</html>\n",
        escape(pictures),
        quiver(calibrated),
        calibrated.rms_px,
        coverage(calibrated),
        radial(calibrated).svg()?,
        uncertainty(calibrated).svg()?,
        by_distance(calibrated).svg()?,
        provenance(&[]),
    ))
}

/// Returns the row of a picture.
fn view_row(view: &ViewResult, reasons: &Reasons) -> String {
    let name = escape(&view.name);
    let why = reasons.get(&view.name).cloned().or_else(|| view.dropped.map(|why| why.to_string()));
    if let Some(why) = why {
        return format!(
            "<tr class=\"left-out\"><td>{name}</td><td></td><td></td><td></td><td></td><td>left out: {}</td></tr>",
            escape(&why)
        );
    }
    let outliers = view.residuals.iter().filter(|r| !r.counts).count();
    let tilt = view.tilt_deg.map(|deg| format!("{deg:.0}")).unwrap_or_default();
    let numbers = [view.residuals.len().to_string(), outliers.to_string(), format!("{:.3}", view.rms_px), tilt];
    let cells: String = numbers.iter().map(|n| format!("<td class=\"number\">{n}</td>")).collect();
    format!("<tr><td>{name}</td>{cells}<td></td></tr>")
}

/// Returns the residuals of all pictures.
fn residuals(calibrated: &Calibrated) -> impl Iterator<Item = &Residual> {
    calibrated.views.iter().filter(|v| v.dropped.is_none()).flat_map(|v| &v.residuals)
}

/// Begins a drawing of the picture's frame. The unit is the pixel of the picture.
fn frame(camera: &Config) -> (String, f64) {
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    let scale = w / WIDTH;
    let begin = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{0} {0} {w} {h}\" width=\"{WIDTH}\">\
         <style>{2}{DARK_FRAME}</style>\
         <rect x=\"{0}\" y=\"{0}\" width=\"{w}\" height=\"{h}\" fill=\"#fafafa\" stroke=\"#444\" \
         stroke-width=\"{1}\"/>",
        -0.5,
        2.0 * scale,
        hzn_plot::DARK
    );
    (begin, scale)
}

/// Draws every residual as an arrow from its corner, all enlarged by the same factor.
fn quiver(calibrated: &Calibrated) -> String {
    let (mut svg, scale) = frame(&calibrated.camera);
    let factor = ARROW * scale / calibrated.rms_px.max(1e-9);
    for r in residuals(calibrated) {
        let [u, v] = r.at_px;
        if !r.counts {
            let _ = write!(svg, "<circle cx=\"{u:.1}\" cy=\"{v:.1}\" r=\"{:.1}\" fill=\"#aaa\"/>", 2.0 * scale);
            continue;
        }
        let [x, y] = [u + factor * r.error_px[0], v + factor * r.error_px[1]];
        let _ = write!(
            svg,
            "<line x1=\"{u:.1}\" y1=\"{v:.1}\" x2=\"{x:.1}\" y2=\"{y:.1}\" stroke=\"#0072B2\" stroke-width=\"{:.2}\"/>\
             <circle cx=\"{u:.1}\" cy=\"{v:.1}\" r=\"{:.1}\" fill=\"#0072B2\"/>",
            scale,
            1.3 * scale
        );
    }
    let (x, y) = (12.0 * scale, 12.0 * scale);
    let _ = write!(
        svg,
        "<line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{y:.1}\" stroke=\"#d55e00\" \
         stroke-width=\"{:.1}\"/></svg>",
        x + ARROW * scale,
        2.5 * scale
    );
    svg
}

/// Draws the number of points in each part of the picture.
fn coverage(calibrated: &Calibrated) -> String {
    let camera = &calibrated.camera;
    let size = [f64::from(camera.width), f64::from(camera.height)];
    let mut counts = vec![0usize; CELLS[0] * CELLS[1]];
    for r in residuals(calibrated).filter(|r| r.counts) {
        let cell = [0, 1].map(|k| ((r.at_px[k] + 0.5) / size[k] * CELLS[k] as f64).max(0.0) as usize);
        if let Some(count) = counts.get_mut(cell[1].min(CELLS[1] - 1) * CELLS[0] + cell[0].min(CELLS[0] - 1)) {
            *count += 1;
        }
    }
    let largest = counts.iter().copied().max().unwrap_or(1).max(1);
    let (mut svg, scale) = frame(camera);
    let [w, h] = [size[0] / CELLS[0] as f64, size[1] / CELLS[1] as f64];
    for (n, count) in counts.iter().enumerate() {
        let (x, y) = ((n % CELLS[0]) as f64 * w - 0.5, (n / CELLS[0]) as f64 * h - 0.5);
        let fill = match count {
            0 => "#f3c1b0".to_owned(),
            n => format!("rgba(0,114,178,{:.2})", 0.15 + 0.75 * (*n as f64 / largest as f64)),
        };
        let _ = write!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"{fill}\" stroke=\"#fff\" \
             stroke-width=\"{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{:.1}\" text-anchor=\"middle\" \
             font-family=\"sans-serif\">{count}</text>",
            scale,
            x + 0.5 * w,
            y + 0.62 * h,
            12.0 * scale
        );
    }
    svg.push_str("</svg>");
    svg
}

/// Plots the distance from the principal point by the angle off axis.
fn radial(calibrated: &Calibrated) -> Chart {
    let camera = &calibrated.camera;
    let lens = Equation::new(camera);
    let radius_px = |deg: f64| {
        let (sin, cos) = deg.to_radians().sin_cos();
        lens.project([sin, 0.0, cos]).map_or(f64::NAN, |p| p.point.u - camera.cx_px)
    };
    let curve =
        |from: f64, to: f64| (0..=SEGMENTS).map(move |n| from + (to - from) * f64::from(n) / f64::from(SEGMENTS));
    let covered = calibrated.covered_deg;
    let end = calibrated.corner_deg.max(covered);
    let points = |degrees: Vec<f64>| degrees.into_iter().map(|deg| (deg, radius_px(deg))).collect::<Vec<_>>();
    Chart::new("Radial curve", "angle off axis [deg]", "distance from the principal point [px]")
        .with_series(Series::new("extrapolated", Style::Ideal, points(curve(covered, end).collect())))
        .with_series(Series::new("covered by points", Style::Line, points(curve(0.0, covered).collect())))
}

/// Returns the 1-sigma of the distance from the principal point at an angle off axis, px, along the rows.
fn radius_sigma_px(camera: &Config, lens: &Equation, deg: f64) -> Option<f64> {
    let covariance = camera.covariance.as_ref()?;
    let (sin, cos) = deg.to_radians().sin_cos();
    let by = lens.project([sin, 0.0, cos])?.by_intrinsics[0];
    // The distance from the principal point does not change with the principal point.
    let moves = |which: &Intrinsic| !matches!(which, Intrinsic::CxPx | Intrinsic::CyPx);
    let by = camera.model.intrinsics().iter().zip(by).map(|(which, by)| if moves(which) { by } else { 0.0 });
    let by: Vec<f64> = by.collect();
    let along = |row: &[f64]| row.iter().zip(&by).map(|(c, by)| c * by).sum::<f64>();
    let variance: f64 = covariance.rows.iter().zip(&by).map(|(row, by)| by * along(row)).sum();
    Some(variance.max(0.0).sqrt())
}

/// Plots the 1-sigma of the radial curve. It is too small to be seen as a band around the curve.
fn uncertainty(calibrated: &Calibrated) -> Chart {
    let camera = &calibrated.camera;
    let lens = Equation::new(camera);
    let (covered, end) = (calibrated.covered_deg, calibrated.corner_deg.max(calibrated.covered_deg));
    let curve = |from: f64, to: f64| {
        let degrees = (0..=SEGMENTS).map(move |n| from + (to - from) * f64::from(n) / f64::from(SEGMENTS));
        degrees.map(|deg| (deg, radius_sigma_px(camera, &lens, deg).unwrap_or(f64::NAN))).collect::<Vec<_>>()
    };
    Chart::new("1 sigma of the radial curve", "angle off axis [deg]", "1 sigma of the distance [px]")
        .with_series(Series::new("extrapolated, if the model holds", Style::Ideal, curve(covered, end)))
        .with_series(Series::new("covered by points", Style::Line, curve(0.0, covered)))
}

/// Plots the radial part of the residuals by the distance from the principal point. A model that fits leaves no trend.
fn by_distance(calibrated: &Calibrated) -> Chart {
    let camera = &calibrated.camera;
    let radial = |r: &Residual| {
        let (x, y) = (r.at_px[0] - camera.cx_px, r.at_px[1] - camera.cy_px);
        let distance = x.hypot(y).max(1e-9);
        (distance, (r.error_px[0] * x + r.error_px[1] * y) / distance)
    };
    let dots: Vec<(f64, f64)> = residuals(calibrated).filter(|r| r.counts).map(radial).collect();
    Chart::new("Radial residuals", "distance from the principal point [px]", "residual outwards [px]")
        .with_series(Series::new("", Style::Dots, dots))
}
