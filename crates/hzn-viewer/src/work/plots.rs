//! Writes plots over time as SVG, for documents.

use std::path::Path;

use plotters::prelude::*;

use super::job::{Done, JobError};
use crate::model::atomic_file;

/// Width of the drawing, and heights of a plot and of the heading, in pixels.
const WIDTH: u32 = 900;
const PLOT: u32 = 190;
const HEADING: u32 = 34;
/// Width of the labels left of a plot, and height of those below the last one.
const LEFT: u32 = 76;
const BELOW: u32 = 46;
/// The colours of Okabe and Ito, which colour-blind people can distinguish.
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115), RGBColor(204, 121, 167)];
const REFUSED: RGBColor = RGBColor(150, 150, 150);

/// Points of a line; a missing value begins a new part.
pub type Parts = Vec<Vec<[f64; 2]>>;

/// A plot of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotRow {
    /// The quantity and its unit.
    pub title: String,
    /// Name and points of each line.
    pub lines: Vec<(String, Parts)>,
}

/// Plots with the same horizontal axis.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotSheet {
    /// The text above the plots: the name of the sequence.
    pub heading: String,
    /// Label of the horizontal axis.
    pub axis: &'static str,
    /// First and last place on the horizontal axis.
    pub ends: [f64; 2],
    /// Pictures without an answer, from and to.
    pub refused: Vec<[f64; 2]>,
    /// The plots from top to bottom.
    pub rows: Vec<PlotRow>,
}

/// Writes the plots as SVG.
///
/// # Errors
/// The name does not end in `.svg`, no plot has a value, or the file cannot be written.
pub fn save(sheet: &PlotSheet, path: &Path) -> Result<Done, JobError> {
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("svg")) {
        return Err(JobError::Failed(format!("{}: the file name of plots must end in .svg", path.display())));
    }
    let text = svg(sheet).map_err(JobError::Failed)?;
    atomic_file::write(path, text.as_bytes())?;
    Ok(Done::Written(path.to_owned()))
}

/// Returns the drawing.
fn svg(sheet: &PlotSheet) -> Result<String, String> {
    let count = sheet.rows.len() as u32;
    if count == 0 {
        return Err("no chosen plot has a value".into());
    }
    let mut out = String::new();
    {
        let root = SVGBackend::with_string(&mut out, (WIDTH, HEADING + count * PLOT + BELOW)).into_drawing_area();
        draw(sheet, &root).map_err(|e| format!("the plots cannot be drawn: {e}"))?;
    }
    Ok(out)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw(sheet: &PlotSheet, root: &Area<'_>) -> Result<(), Box<dyn std::error::Error>> {
    root.fill(&WHITE)?;
    let (heading, mut rest) = root.split_vertically(HEADING);
    heading.draw_text(&sheet.heading, &("sans-serif", 16).into_text_style(root), (LEFT as i32, 10))?;
    for (n, row) in sheet.rows.iter().enumerate() {
        let is_last = n + 1 == sheet.rows.len();
        let (area, below) = rest.split_vertically(if is_last { PLOT + BELOW } else { PLOT });
        draw_row(sheet, row, &area, is_last)?;
        rest = below;
    }
    root.present()?;
    Ok(())
}

fn draw_row(
    sheet: &PlotSheet,
    row: &PlotRow,
    area: &Area<'_>,
    is_last: bool,
) -> Result<(), Box<dyn std::error::Error>> {
    let values = row.lines.iter().flat_map(|(_, parts)| parts.iter().flatten()).map(|p| p[1]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let room = (0.08 * (high - low)).max(1e-6 * high.abs()).max(1e-9);
    let [first, last] = sheet.ends;
    let mut chart = ChartBuilder::on(area)
        .caption(&row.title, ("sans-serif", 14))
        .margin_right(16)
        .y_label_area_size(LEFT)
        .x_label_area_size(if is_last { BELOW } else { 0 })
        .build_cartesian_2d(first..last, low - room..high + room)?;
    chart.draw_series(
        sheet
            .refused
            .iter()
            .map(|[from, to]| Rectangle::new([(*from, low - room), (*to, high + room)], REFUSED.mix(0.25).filled())),
    )?;
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(TRANSPARENT).y_labels(5).label_style(("sans-serif", 12));
    mesh.x_desc(if is_last { sheet.axis } else { "" }).draw()?;
    for (n, (name, parts)) in row.lines.iter().enumerate() {
        let colour = COLOURS[n % COLOURS.len()];
        for (k, part) in parts.iter().enumerate() {
            let points = part.iter().map(|p| (p[0], p[1]));
            if let [one] = part.as_slice() {
                chart.draw_series([Circle::new((one[0], one[1]), 2, colour.filled())])?;
            }
            let line = chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
            if k == 0 && row.lines.len() > 1 {
                line.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
            }
        }
    }
    if row.lines.len() > 1 {
        let mut legend = chart.configure_series_labels();
        legend.background_style(WHITE.mix(0.85)).border_style(BLACK.mix(0.2)).label_font(("sans-serif", 12)).draw()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drawing_has_every_plot_and_line() {
        let row = |title: &str, lines: &[&str]| PlotRow {
            title: title.into(),
            lines: lines
                .iter()
                .map(|name| ((*name).into(), vec![vec![[0.0, 1.0], [1.0, 2.0]], vec![[3.0, 1.5]]]))
                .collect(),
        };
        let rows = vec![row("3 sigma [°]", &["3σ"]), row("Axis", &["x", "y"])];
        let sheet = PlotSheet {
            heading: "flight.mcap".into(),
            axis: "time, s",
            ends: [0.0, 4.0],
            refused: vec![[1.5, 2.5]],
            rows,
        };
        let text = svg(&sheet).unwrap();
        for word in ["flight.mcap", "3 sigma [°]", "Axis", "time, s"] {
            assert!(text.contains(word), "{word}");
        }
        let drawn = |colour: &str| text.matches(&format!("stroke=\"{colour}\"")).count();
        // Two parts in each of two plots and an entry in one legend; then two parts in one plot and an entry.
        assert_eq!((drawn("#0072B2"), drawn("#D55E00")), (5, 3), "{text}");
        let circles = text.matches("<circle").count();
        assert_eq!(circles, 3, "a part of one point is a dot");
        assert_eq!(svg(&PlotSheet { rows: Vec::new(), ..sheet }), Err("no chosen plot has a value".into()));
    }
}
