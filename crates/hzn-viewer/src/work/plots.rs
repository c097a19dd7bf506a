//! Writes plots over time as SVG or PNG, for documents.

use std::path::Path;

use hzn_run::overlay::runs;
use image::RgbImage;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::canvas::Canvas;
use super::job::{Done, JobError, Progress};
use crate::model::atomic_file;

/// Width of the drawing, and heights of a plot and of the heading, in units: a unit is a pixel of the SVG.
const WIDTH: u32 = 900;
const PLOT: u32 = 190;
const HEADING: u32 = 34;
/// Width of the labels left of a plot, and height of those below the last one.
const LEFT: u32 = 76;
const BELOW: u32 = 46;
/// Height of the line about version, command and sensor.
const FOOT: u32 = 22;
/// Height of the title of a plot and of a row of its legend, width of a sample, and an estimate of the width of a
/// letter: those of a reader's program are not known.
const TITLE: u32 = 20;
const LEGEND_ROW: u32 = 16;
const SAMPLE: u32 = 18;
const LETTER: u32 = 7;
/// Letters of the last line that fit into the width.
const FOOT_LETTERS: usize = 130;
/// Pixels of a PNG in a unit: 2700 pixels are 300 per inch on a page that is 23 cm wide.
const PNG_SCALE: u32 = 3;
/// The PNG is drawn this much larger and then made smaller, which gives lines and letters smooth edges.
const OVERSAMPLING: u32 = 2;
/// Step of the progress in which the PNG is made smaller.
const SMOOTHING: u64 = 1;
/// The colours of Okabe and Ito, which colour-blind people can distinguish.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(140, 140, 140),
];
const REFUSED: RGBColor = RGBColor(150, 150, 150);
const BAND: RGBColor = RGBColor(0, 158, 115);

/// Points of a line; a missing value begins a new part.
pub type Parts = Vec<Vec<[f64; 2]>>;

/// A plot of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotRow {
    /// The quantity and its unit.
    pub title: String,
    /// Name and points of each line.
    pub lines: Vec<(String, Parts)>,
    /// Range in which nearly all values of a right sensor lie.
    pub band: Option<[f64; 2]>,
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
    /// Version, command and sensor, below the plots.
    pub provenance: String,
    /// Pictures without an answer, from and to.
    pub refused: Vec<[f64; 2]>,
    /// The plots from top to bottom.
    pub rows: Vec<PlotRow>,
}

/// Writes the plots as SVG or as PNG, depending on the ending.
///
/// # Errors
/// The name has another ending, no plot has a value, the file cannot be written, or the job was stopped.
pub fn save(sheet: &PlotSheet, path: &Path, progress: &Progress) -> Result<Done, JobError> {
    let is = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    let bytes = if is("svg") {
        svg(sheet)?.into_bytes()
    } else if is("png") {
        let picture = png(sheet, progress)?;
        progress.report(sheet.rows.len() as u64 + SMOOTHING, steps(sheet))?;
        hzn_run::overlay::png(&picture).map_err(|e| format!("{}: {e:#}", path.display()))?
    } else {
        return Err(JobError::Failed(format!("{}: the file name of plots must end in .svg or .png", path.display())));
    };
    progress.report(steps(sheet), steps(sheet))?;
    atomic_file::write(path, &bytes)?;
    Ok(Done::Written(path.to_owned()))
}

/// Returns the number of steps of a PNG: each plot, the smoothing, and the compression, which take about as long.
fn steps(sheet: &PlotSheet) -> u64 {
    sheet.rows.len() as u64 + SMOOTHING + 1
}

/// Returns the size of the drawing in units.
fn size(sheet: &PlotSheet) -> Result<[u32; 2], String> {
    match sheet.rows.len() as u32 {
        0 => Err("no chosen plot has a value".into()),
        count => Ok([WIDTH, HEADING + count * PLOT + BELOW + FOOT]),
    }
}

/// Returns the drawing as SVG, with dark colours for a system that is dark.
fn svg(sheet: &PlotSheet) -> Result<String, String> {
    let [w, h] = size(sheet)?;
    let mut out = String::new();
    draw(sheet, &SVGBackend::with_string(&mut out, (w, h)).into_drawing_area(), 1, &mut |_| true)?;
    Ok(hzn_plot::with_dark(&out))
}

/// Returns the drawing as a picture.
fn png(sheet: &PlotSheet, progress: &Progress) -> Result<RgbImage, JobError> {
    let [w, h] = size(sheet)?.map(|x| x * PNG_SCALE);
    let (large_w, large_h) = (w * OVERSAMPLING, h * OVERSAMPLING);
    let mut large = RgbImage::new(large_w, large_h);
    let mut is_stopped = false;
    let mut goes_on = |row: usize| {
        is_stopped = progress.report(row as u64, steps(sheet)).is_err();
        !is_stopped
    };
    draw(sheet, &Canvas::new(&mut large).into_drawing_area(), PNG_SCALE * OVERSAMPLING, &mut goes_on)?;
    if is_stopped {
        return Err(JobError::Stopped);
    }
    progress.report(sheet.rows.len() as u64, steps(sheet))?;
    Ok(runs::halve(&large))
}

type Area<B> = DrawingArea<B, Shift>;

/// Draws everything, with `scale` pixels in a unit. It ends before a plot for whose number `goes_on` returns false.
fn draw<B: DrawingBackend>(
    sheet: &PlotSheet,
    root: &Area<B>,
    scale: u32,
    goes_on: &mut dyn FnMut(usize) -> bool,
) -> Result<(), String> {
    let mut all = || -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        root.fill(&WHITE)?;
        let (heading, mut rest) = root.split_vertically(HEADING * scale);
        let place = [LEFT, 10].map(|x| (x * scale) as i32);
        heading.draw_text(&sheet.heading, &("sans-serif", 16 * scale).into_text_style(root), place.into())?;
        for (n, row) in sheet.rows.iter().enumerate() {
            if !goes_on(n) {
                return Ok(());
            }
            let is_last = n + 1 == sheet.rows.len();
            let (area, below) = rest.split_vertically(if is_last { PLOT + BELOW } else { PLOT } * scale);
            draw_row(sheet, row, &area, is_last, scale)?;
            rest = below;
        }
        let faint = BLACK.mix(0.6);
        let foot = ("sans-serif", 11 * scale).into_text_style(root).color(&faint);
        rest.draw_text(&shortened(&sheet.provenance), &foot, ((LEFT * scale) as i32, 0))?;
        root.present()
    };
    all().map_err(|e| format!("the plots cannot be drawn: {e}"))
}

fn draw_row<B: DrawingBackend>(
    sheet: &PlotSheet,
    row: &PlotRow,
    area: &Area<B>,
    is_last: bool,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let of_lines = row.lines.iter().flat_map(|(_, parts)| parts.iter().flatten()).map(|p| p[1]);
    let values = of_lines.chain(row.band.into_iter().flatten());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let room = (0.08 * (high - low)).max(1e-6 * high.abs()).max(1e-9);
    let [first, last] = sheet.ends;
    let font = |size: u32| ("sans-serif", size * scale);
    let entries = legend(row);
    let height = entries.last().map_or(TITLE, |[_, y]| y + LEGEND_ROW + 4);
    let (title, plot) = area.split_vertically(height * scale);
    title.draw_text(&row.title, &font(14).into_text_style(&title), ((LEFT * scale) as i32, 2 * scale as i32))?;
    for (n, ((name, _), [x, y])) in row.lines.iter().zip(&entries).enumerate() {
        let [x, y] = [x, y].map(|v| (v * scale) as i32);
        let (middle, end) = (y + (LEGEND_ROW * scale / 2) as i32, x + (SAMPLE * scale) as i32);
        let style = COLOURS[n % COLOURS.len()].stroke_width(2 * scale);
        title.draw(&PathElement::new([(x, middle), (end, middle)], style))?;
        title.draw_text(name, &font(12).into_text_style(&title), (end + 6 * scale as i32, y + scale as i32))?;
    }
    let mut chart = ChartBuilder::on(&plot)
        .margin_right(16 * scale)
        .y_label_area_size(LEFT * scale)
        .x_label_area_size(if is_last { BELOW * scale } else { 0 })
        .build_cartesian_2d(first..last, low - room..high + room)?;
    chart.draw_series(
        sheet
            .refused
            .iter()
            .map(|[from, to]| Rectangle::new([(*from, low - room), (*to, high + room)], REFUSED.mix(0.25).filled())),
    )?;
    if let Some([from, to]) = row.band {
        chart.draw_series([Rectangle::new([(first, from), (last, to)], BAND.mix(0.16).filled())])?;
    }
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(TRANSPARENT).y_labels(5).label_style(font(12));
    mesh.axis_style(BLACK.stroke_width(scale)).bold_line_style(BLACK.mix(0.15).stroke_width(scale));
    mesh.set_all_tick_mark_size(5 * scale);
    mesh.x_desc(if is_last { sheet.axis } else { "" }).draw()?;
    for (n, (_, parts)) in row.lines.iter().enumerate() {
        let style = COLOURS[n % COLOURS.len()].stroke_width(2 * scale);
        for part in parts {
            let points = part.iter().map(|p| (p[0], p[1]));
            if let [one] = part.as_slice() {
                chart.draw_series([Circle::new((one[0], one[1]), 2 * scale, style.filled())])?;
            }
            chart.draw_series(LineSeries::new(points, style))?;
        }
    }
    Ok(())
}

/// Returns the place of each entry of the legend, which stands behind the title and above the plot, in units. One line
/// needs no legend.
fn legend(row: &PlotRow) -> Vec<[u32; 2]> {
    if row.lines.len() < 2 {
        return Vec::new();
    }
    let width = |text: &str| LETTER * text.chars().count() as u32;
    let first = LEFT + width(&row.title) + 3 * SAMPLE;
    let [mut x, mut y] = [first, 2];
    let mut places = Vec::new();
    for (name, _) in &row.lines {
        let wide = SAMPLE + 6 + width(name) + 14;
        if x > first && x + wide > WIDTH {
            (x, y) = (first, y + LEGEND_ROW);
        }
        places.push([x, y]);
        x += wide;
    }
    places
}

/// Returns the last line, cut where it would leave the drawing.
fn shortened(line: &str) -> String {
    match line.char_indices().nth(FOOT_LETTERS) {
        Some((at, _)) => line.get(..at).unwrap_or(line).to_owned() + "…",
        None => line.to_owned(),
    }
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
            band: None,
        };
        let rows = vec![row("3 sigma [°]", &["3σ"]), row("Axis", &["x", "y"])];
        let sheet = PlotSheet {
            heading: "flight.mcap".into(),
            axis: "time, s",
            ends: [0.0, 4.0],
            provenance: "hzn 0.1.0, sensor 0123456789ab, hzn view flight.mcap".into(),
            refused: vec![[1.5, 2.5]],
            rows,
        };
        let text = svg(&sheet).unwrap();
        for word in ["flight.mcap", "3 sigma [°]", "Axis", "time, s", "sensor 0123456789ab"] {
            assert!(text.contains(word), "{word}");
        }
        let drawn = |colour: &str| text.matches(&format!("stroke=\"{colour}\"")).count();
        // Two parts in each of two plots and an entry in one legend; then two parts in one plot and an entry.
        assert_eq!((drawn("#0072B2"), drawn("#D55E00")), (5, 3), "{text}");
        assert!(text.contains(hzn_plot::DARK) && drawn("#FFFFFF") == 0, "{text}");
        let circles = text.matches("<circle").count();
        assert_eq!(circles, 3, "a part of one point is a dot");
        let banded = PlotRow { band: Some([-3.0, 3.0]), ..row("Error over σ", &["error/σ"]) };
        let text = svg(&PlotSheet { rows: vec![banded], ..sheet.clone() }).unwrap();
        assert_eq!(text.to_lowercase().matches("#009e73").count(), 1, "the band is one area: {text}");
        let empty = PlotSheet { rows: Vec::new(), ..sheet.clone() };
        assert_eq!(svg(&empty), Err("no chosen plot has a value".into()));
        assert!(png(&empty, &Progress::default()).is_err());

        // The picture has the same lines in the same colours, and letters above and below them.
        let picture = png(&sheet, &Progress::default()).unwrap();
        assert_eq!(picture.dimensions(), (3 * WIDTH, 3 * (HEADING + 2 * PLOT + BELOW + FOOT)));
        let has = |colour: RGBColor| picture.pixels().filter(|p| p.0 == [colour.0, colour.1, colour.2]).count();
        assert!(has(COLOURS[0]) > 1000 && has(COLOURS[1]) > 1000, "{} {}", has(COLOURS[0]), has(COLOURS[1]));
        let ink = |from: u32, to: u32| {
            let rows = picture.rows().skip(from as usize).take((to - from) as usize);
            rows.flatten().filter(|p| p.0.iter().all(|c| *c < 90)).count()
        };
        assert!(ink(0, 3 * HEADING) > 300, "the heading");
        assert!(ink(picture.height() - 60, picture.height()) > 300, "the label of the axis");
    }

    #[test]
    fn a_png_reports_each_plot_and_stops_when_it_is_told() {
        let values: Vec<[f64; 2]> = (0..400).map(|i| [f64::from(10 * i), f64::from(i * 7919 % 1000)]).collect();
        let row = PlotRow { title: "Axis".into(), lines: vec![("x".into(), vec![values])], band: Some([100.0, 900.0]) };
        let sheet = PlotSheet {
            heading: "flight.mcap".into(),
            axis: "time, s",
            ends: [0.0, 4000.0],
            provenance: String::new(),
            refused: vec![[0.0, 1500.0], [2000.0, 3999.0]],
            rows: vec![row; 3],
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("plots.png");
        let (progress, begin) = (Progress::default(), std::time::Instant::now());
        save(&sheet, &path, &progress).unwrap();
        println!("three plots of 400 values: {:.2} s", begin.elapsed().as_secs_f64());
        assert_eq!(progress.fraction(), 1.0);
        std::fs::remove_file(&path).unwrap();
        progress.stop();
        assert_eq!(save(&sheet, &path, &progress), Err(JobError::Stopped));
        assert_eq!((progress.fraction(), path.exists()), (0.0, false), "it stops before the first plot");
    }
}
