//! The report as one page of HTML that needs no other file and no network.

use base64::Engine;
use hzn_evaluate::{Case, Evaluation, Integrity, Miss};
use hzn_plot::{Chart, Series, Style};

use super::report::Report;
use super::text;
use super::worst::Drawn;
use crate::html::{DARK, escape, provenance};

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:1360px;margin:2rem auto;padding:0 1rem;color:#222}\
h1{font-size:1.5rem;margin-bottom:.2rem}h2{font-size:1.2rem;border-bottom:1px solid #ddd;margin-top:2rem}\
table{border-collapse:collapse;margin:1rem 0}td,th{padding:.2rem .8rem;text-align:right;border-bottom:1px solid #eee}\
th:first-child,td:first-child{text-align:left}.sum td{text-align:left}.sub{color:#666}\
.plots,.worst{display:grid;gap:1rem;grid-template-columns:repeat(auto-fit,minmax(420px,1fr))}\
.plots svg{width:100%;height:auto;border:1px solid #eee}\
figure{margin:1rem 0}figure img{max-width:100%}figcaption{color:#444}";

pub(super) fn html(report: &Report, worst: &[Drawn]) -> anyhow::Result<String> {
    let mut body = format!(
        "<h1>Horizon sensor against the truth</h1><p class=\"sub\">{} against {}</p>",
        escape(&report.results),
        escape(&report.truth)
    );
    for e in &report.evaluations {
        body.push_str(&format!("<h2>{}</h2><table class=\"sum\">", escape(&e.body)));
        for (name, value) in text::lines(e) {
            body.push_str(&format!("<tr><td>{}</td><td>{}</td></tr>", escape(name), escape(&value)));
        }
        body.push_str("</table><div class=\"plots\">");
        for chart in charts(e, &report.frames) {
            body.push_str(&chart.svg()?);
        }
        body.push_str("</div>");
        for group in &e.groups {
            let head: String = text::COLUMNS.iter().map(|c| format!("<th>{}</th>", escape(c))).collect();
            body.push_str(&format!("<table><tr><th>{} [{}]</th>{head}</tr>", group.name, group.unit));
            for (range, cells) in text::cells(group) {
                let cells: String = cells.iter().map(|c| format!("<td>{}</td>", escape(c))).collect();
                body.push_str(&format!("<tr><td>{}</td>{cells}</tr>", escape(&range)));
            }
            body.push_str("</table>");
        }
        if let Some(integrity) = &e.integrity {
            body.push_str(&stanford_table(integrity));
        }
    }
    if !worst.is_empty() {
        body.push_str("<h2>Worst pictures</h2><div class=\"worst\">");
        for frame in worst {
            let picture = match &frame.jpeg {
                Some(jpeg) => {
                    let data = base64::engine::general_purpose::STANDARD.encode(jpeg);
                    format!("<img alt=\"{}\" src=\"data:image/jpeg;base64,{data}\">", escape(&frame.caption))
                }
                None => "<p class=\"sub\">the picture is neither in the recording nor next to the truth</p>".into(),
            };
            body.push_str(&format!("<figure>{picture}<figcaption>{}</figcaption></figure>", escape(&frame.caption)));
        }
        body.push_str("</div>");
    }
    let head = format!("<meta charset=\"utf-8\"><title>hzn evaluate</title><style>{STYLE}{DARK}</style>");
    Ok(format!(
        "<!doctype html><html lang=\"en\"><head>{head}</head><body>{body}{}</body></html>\n",
        provenance(&report.sensors)
    ))
}

/// Returns the charts of one body.
fn charts(e: &Evaluation, frames: &[Case]) -> Vec<Chart> {
    let cases: Vec<(&Case, Miss)> =
        frames.iter().filter(|c| c.body == e.body && c.limb).filter_map(|c| Some((c, c.miss?))).collect();
    if cases.is_empty() {
        return Vec::new();
    }
    let dots = |name: &str, x: &dyn Fn(&Case) -> Option<f64>, y: &dyn Fn(&Miss) -> f64| {
        Series::new(name, Style::Dots, cases.iter().filter_map(|(c, m)| Some((x(c)?, y(m)))))
    };
    // Pictures that show the limb and have no answer have no error either; their places are marked.
    let missed = |x: &dyn Fn(&Case) -> Option<f64>| {
        let without = frames.iter().filter(|c| c.body == e.body && c.limb && c.miss.is_none());
        let marks: Vec<(f64, f64)> = without.filter_map(|c| Some((x(c)?, f64::NAN))).collect();
        // An empty name is not listed.
        let name = if marks.is_empty() { String::new() } else { format!("no answer ({})", marks.len()) };
        Series::new(name, Style::Marks, marks)
    };
    let mut out = Vec::new();
    // A truth may have no times.
    if cases.iter().any(|(c, _)| c.time_s.is_some()) {
        out.extend([
            Chart::new("Error and claimed sigma over time", "time [s]", "deg")
                .with_series(dots("error", &|c| c.time_s, &|m| m.angle_deg))
                .with_series(dots("largest sigma", &|c| c.time_s, &|m| m.sigma_max_deg))
                .with_series(missed(&|c| c.time_s)),
            Chart::new("Error about the camera's axes", "time [s]", "deg")
                .with_series(dots("about x", &|c| c.time_s, &|m| m.about_deg[0]))
                .with_series(dots("about y", &|c| c.time_s, &|m| m.about_deg[1]))
                .with_series(dots("about z", &|c| c.time_s, &|m| m.about_deg[2]))
                .with_series(missed(&|c| c.time_s)),
        ]);
    }
    out.push(distribution(&cases));
    out.extend(calibration(&cases));
    out.extend(stanford(e, frames));
    for group in &e.groups {
        let x: &dyn Fn(&Case) -> Option<f64> = match group.name {
            "altitude" => &|c| c.altitude_km,
            "off nadir" | "off axis" => &|c| Some(c.off_axis_deg),
            _ => &|c| c.limb_in_view_px,
        };
        out.push(
            Chart::new(format!("Error by {}", group.name), format!("{} [{}]", group.name, group.unit), "deg")
                .with_series(dots("error", x, &|m| m.angle_deg))
                .with_series(dots("largest sigma", x, &|m| m.sigma_max_deg))
                .with_series(missed(x)),
        );
    }
    out
}

/// Plots the share of answers whose error is at most the value on the x axis.
fn distribution(cases: &[(&Case, Miss)]) -> Chart {
    let mut errors: Vec<f64> = cases.iter().map(|(_, m)| m.angle_deg).collect();
    errors.sort_by(f64::total_cmp);
    let n = errors.len() as f64;
    let steps = errors.iter().enumerate().flat_map(|(i, &e)| [(e, i as f64 / n), (e, (i as f64 + 1.0) / n)]);
    Chart::new("Share of the answers up to an error", "error [deg]", "share").with_series(Series::new(
        "",
        Style::Line,
        steps,
    ))
}

/// Plots the distance of answers from the truth in sigma against the expected distance. The points lie on the diagonal
/// if sigma is right.
fn calibration(cases: &[(&Case, Miss)]) -> Option<Chart> {
    let mut distances: Vec<f64> = cases.iter().filter_map(|(_, m)| Some(m.nees?.sqrt())).collect();
    distances.sort_by(f64::total_cmp);
    let n = distances.len() as f64;
    // This is the quantile of a distance in two dimensions: 1 − exp(−k²/2) = p.
    let points: Vec<(f64, f64)> =
        distances.iter().enumerate().map(|(i, &d)| ((-2.0 * (1.0 - (i as f64 + 0.5) / n).ln()).sqrt(), d)).collect();
    let far = points.last()?.0;
    Some(
        Chart::new("Calibration of sigma (above the line: too small)", "expected distance [sigma]", "distance [sigma]")
            .with_series(Series::new("right", Style::Ideal, [(0.0, 0.0), (far, far)]))
            .with_series(Series::new("answers", Style::Dots, points)),
    )
}

/// Returns the numbers of the Stanford diagram.
fn stanford_table(integrity: &Integrity) -> String {
    let row = |tag: &str, cells: [&str; 3]| {
        let cells: String = cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
        format!("<tr>{cells}</tr>")
    };
    let rows: String =
        text::stanford(integrity).iter().map(|cells| row("td", cells.each_ref().map(String::as_str))).collect();
    format!("<table>{}{rows}</table>", row("th", text::STANFORD))
}

/// Plots the protection level against the error, as the integrity of satellite navigation is drawn (the Stanford
/// diagram). Answers below the line are misleading. An answer without a limb in view has an error, too.
fn stanford(e: &Evaluation, frames: &[Case]) -> Option<Chart> {
    let answers: Vec<(bool, f64, f64)> = frames
        .iter()
        .filter(|c| c.body == e.body)
        .filter_map(|c| c.miss.and_then(|m| Some((c.limb, m.angle_deg, m.found.protection_deg?))))
        .collect();
    let far = answers.iter().map(|(_, error, level)| error.max(*level)).reduce(f64::max)?;
    let dots = |name: &str, of: &dyn Fn(bool, f64, f64) -> bool| {
        let shown = answers.iter().filter(|(limb, error, level)| of(*limb, *error, *level));
        Series::new(name, Style::Dots, shown.map(|(_, error, level)| (*error, *level)).collect::<Vec<_>>())
    };
    Some(
        Chart::new("Protection level against error (below the line: misleading)", "error [deg]", "level [deg]")
            .with_series(Series::new("error = level", Style::Ideal, [(0.0, 0.0), (far, far)]))
            .with_series(dots("limb in view", &|limb, error, level| limb && error <= level))
            .with_series(dots("misleading", &|limb, error, level| limb && error > level))
            .with_series(dots("no limb in view", &|limb, _, _| !limb)),
    )
}
