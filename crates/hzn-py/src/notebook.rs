//! Reports in a notebook: the numbers as a table, next to the picture.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use hzn_mcap::Row;
use pyo3::prelude::*;

use crate::errors;

/// Longest side of a picture in a notebook, in pixels.
const MAX_SIDE_PX: u32 = 960;
/// Quality of its JPEG, of 100. A notebook keeps every output, and a PNG of a noisy picture has a megabyte.
const QUALITY: u8 = 80;

/// Returns the table of these rows, next to the picture if there is one.
pub(crate) fn to_html<'a>(jpeg: Option<Vec<u8>>, rows: impl Iterator<Item = &'a Row>) -> String {
    let mut html = String::from("<div style=\"display:flex;gap:1em;align-items:start\">");
    if let Some(jpeg) = jpeg {
        html += &format!("<img style=\"max-width:60%\" src=\"data:image/jpeg;base64,{}\">", STANDARD.encode(jpeg));
    }
    html += "<table>";
    for row in rows {
        for (name, value) in cells(row) {
            html += &format!("<tr><th style=\"text-align:left\">{name}</th><td>{}</td></tr>", escape(&value));
        }
    }
    html + "</table></div>"
}

/// Returns the text of a report, with its status or those of several bodies.
pub(crate) fn to_text(title: &str, r: &Row) -> String {
    match (r.axis(), r.sigma_max_deg, r.inliers) {
        (Some([x, y, z]), Some(sigma), Some(inliers)) => format!(
            "Report({title}, axis [{x:.6}, {y:.6}, {z:.6}], sigma {sigma:.4} deg, {inliers} inliers, rms {:.2} px)",
            r.rms_px.unwrap_or(f64::NAN)
        ),
        _ => format!("Report({title}: {})", r.detail),
    }
}

/// Returns names and values of the numbers of a row.
fn cells(r: &Row) -> Vec<(&'static str, String)> {
    let mut rows =
        vec![(if r.body.is_empty() { "status" } else { "body, status" }, format!("{} {}", r.body, r.status.name()))];
    if !r.detail.is_empty() {
        rows.push(("detail", r.detail.clone()));
    }
    if let Some([x, y, z]) = r.axis() {
        rows.push(("axis (camera)", format!("{x:.6}, {y:.6}, {z:.6}")));
    }
    let numbers = [
        ("sigma", r.sigma_max_deg, 4, "°"),
        ("half-angle, free", r.half_angle_deg, 4, "°"),
        ("altitude, free", r.altitude_est_km, 1, "km"),
        ("... its sigma", r.altitude_est_sigma_km, 1, "km"),
        ("rms", r.rms_px, 2, "px"),
        ("inliers", r.inliers.map(f64::from), 0, ""),
        ("edge points", r.edge_points.map(f64::from), 0, ""),
        ("time", r.elapsed_us, 0, "µs"),
    ];
    rows.extend(numbers.into_iter().filter_map(|(n, v, digits, unit)| Some((n, format!("{:.digits$} {unit}", v?)))));
    rows
}

/// Encodes a picture as JPEG; a large one is made smaller.
pub(crate) fn to_jpeg(picture: &image::RgbImage) -> PyResult<Vec<u8>> {
    let (w, h) = picture.dimensions();
    let small = (w.max(h) > MAX_SIDE_PX).then(|| {
        let scale = f64::from(MAX_SIDE_PX) / f64::from(w.max(h));
        let side = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
        image::imageops::resize(picture, side(w), side(h), image::imageops::FilterType::Triangle)
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    let shown = small.as_ref().unwrap_or(picture);
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    shown.write_with_encoder(encoder).map_err(errors::other)?;
    Ok(bytes.into_inner())
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
