//! Charts as SVG: lines and dots over two axes.

mod error;

use std::io;
use std::ops::Range;

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

pub use error::{Error, Kind};

/// The colours of Okabe and Ito, in the order in which they are used. Colour-blind people can distinguish them.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

/// The outcome of drawing onto a text.
type Drawn = Result<(), DrawingAreaErrorKind<io::Error>>;

/// The style of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A line through the points. A point that is not finite interrupts it.
    Line,
    /// A thin grey line, for expected values.
    Ideal,
    /// One dot for each point.
    Dots,
}

/// Points with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; a series with an empty name is not listed.
    pub name: String,
    /// Style of the series.
    pub style: Style,
    /// (x, y).
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// Makes a series from points, a name and a style.
    pub fn new(name: impl Into<String>, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { name: name.into(), style, points: points.into_iter().collect() }
    }
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title above the chart.
    pub title: String,
    /// Label below the x axis, with its unit.
    pub x: String,
    /// Label next to the y axis, with its unit.
    pub y: String,
    /// The series that are drawn.
    pub series: Vec<Series>,
    /// Width and height in pixels.
    pub size: (u32, u32),
}

impl Chart {
    /// Makes an empty chart of the usual size.
    pub fn new(title: impl Into<String>, x: impl Into<String>, y: impl Into<String>) -> Self {
        let size = (640, 360);
        Self { title: title.into(), x: x.into(), y: y.into(), series: Vec::new(), size }
    }
    /// Changes width and height, in pixels.
    #[must_use]
    pub fn sized(mut self, size: (u32, u32)) -> Self {
        self.size = size;
        self
    }
    /// Adds a series.
    #[must_use]
    pub fn with_series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Returns the chart as SVG text.
    ///
    /// # Errors
    /// There is nothing to draw: no point is finite.
    pub fn svg(&self) -> Result<String, Error> {
        let range = |value: fn(&(f64, f64)) -> f64| {
            let values = self.series.iter().flat_map(|s| &s.points).filter(|p| is_drawable(p)).map(value);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        };
        let (x, y) = (range(|p| p.0), range(|p| p.1));
        if !(x.0 <= x.1) {
            return Err(Error::new(&self.title, Kind::Empty));
        }
        let x = margin(x);
        // The legend has the top of the chart to itself.
        let named = self.series.iter().filter(|s| !s.name.is_empty()).count();
        // The share of the plot that the legend covers, of which 90 px of the picture are no part. Room is in shares of
        // the values, so it is larger: the values have only what the legend leaves.
        let share = ((named as f64 * 18.0 + 10.0) / f64::from(self.size.1.max(100) - 90)).min(0.7);
        let room = if named > 0 { share / (1.0 - share) } else { 0.0 };
        // Values that are never negative, such as errors and sigmas, start at zero, so that small differences do not
        // look large.
        let (low, high) = margin(if y.0 >= 0.0 { (0.0, y.1) } else { y });
        let low = if y.0 >= 0.0 { 0.0 } else { low };
        self.draw(x, low..high + room * (high - low))
    }

    fn draw(&self, x: (f64, f64), y: Range<f64>) -> Result<String, Error> {
        let mut out = String::new();
        self.draw_onto(SVGBackend::with_string(&mut out, self.size), x.0..x.1, y)
            .map_err(|e| Error::new(&self.title, Kind::Drawing(e)))?;
        Ok(out)
    }

    fn draw_onto<'a>(&'a self, backend: SVGBackend<'a>, x: Range<f64>, y: Range<f64>) -> Drawn {
        let font = |size: u32| ("sans-serif", size);
        let root = backend.into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, font(17))
            .margin(12)
            .margin_right(20)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(&self.x)
            .y_desc(&self.y)
            .axis_desc_style(font(14))
            .label_style(font(12))
            .light_line_style(WHITE)
            .bold_line_style(BLACK.mix(0.1))
            .x_label_formatter(&|v| number(*v))
            .y_label_formatter(&|v| number(*v))
            .draw()?;
        let mut colours = COLOURS.iter().cycle();
        for series in &self.series {
            let (style, dots) = match series.style {
                Style::Ideal => (BLACK.mix(0.45).stroke_width(1), false),
                Style::Line => (colours.next().unwrap_or(&BLACK).stroke_width(2), false),
                Style::Dots => (colours.next().unwrap_or(&BLACK).mix(0.75).filled(), true),
            };
            let annotation = if dots {
                chart.draw_series(series.points.iter().filter(|p| is_drawable(p)).map(|p| Circle::new(*p, 3, style)))?
            } else {
                for part in series.points.split(|p| !is_drawable(p)) {
                    chart.draw_series(LineSeries::new(part.iter().copied(), style))?;
                }
                // All parts of a line share one legend entry.
                chart.draw_series(LineSeries::new([], style))?
            };
            if !series.name.is_empty() {
                annotation.label(series.name.as_str()).legend(move |(x, y)| {
                    if dots {
                        Circle::new((x + 8, y), 3, style).into_dyn()
                    } else {
                        PathElement::new([(x, y), (x + 16, y)], style).into_dyn()
                    }
                });
            }
        }
        if self.series.iter().any(|s| !s.name.is_empty()) {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::UpperRight)
                .label_font(font(12))
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.2))
                .draw()?;
        }
        root.present()?;
        Ok(())
    }
}

/// Returns whether a point can be drawn.
fn is_drawable(&(x, y): &(f64, f64)) -> bool {
    x.is_finite() && y.is_finite()
}

/// Widens a range a little at both ends, also a range of length zero.
fn margin((low, high): (f64, f64)) -> (f64, f64) {
    let room = if high > low { 0.04 * (high - low) } else { (0.1 * high.abs()).max(0.5) };
    (low - room, high + room)
}

/// Formats the number of a tick, rounded to five significant digits.
fn number(v: f64) -> String {
    let digits = format!("{v:.4e}");
    let v: f64 = digits.parse().unwrap_or(v);
    // Differences of ticks are not exact.
    let v = if v.abs() < 1e-14 { 0.0 } else { v };
    if v != 0.0 && (v.abs() < 1e-3 || v.abs() >= 1e6) { format!("{v:e}") } else { format!("{v}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_names_everything_and_breaks_lines() {
        let chart = Chart::new("Error & sigma", "altitude [km]", "error [deg]")
            .with_series(Series::new("measured", Style::Dots, [(70.0, 0.01), (240.0, 0.02)]))
            .with_series(Series::new(
                "expected",
                Style::Line,
                [(70.0, 0.02), (100.0, f64::NAN), (200.0, 0.1), (240.0, 0.2)],
            ));
        let svg = chart.svg().unwrap();
        for text in ["<svg", "Error &amp; sigma", "altitude [km]", "error [deg]", "measured", "expected", "</svg>"] {
            assert!(svg.contains(text), "{text} in {svg}");
        }
        assert!(!svg.contains("NaN"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 3, "two points and the legend's");
    }

    /// The largest value of many series is at the right, where the legend is.
    #[test]
    fn the_legend_covers_no_value() {
        for count in [1, 3, 5, 6] {
            let dot = |i: u32| Series::new(format!("series {i}"), Style::Dots, [(0.0, 0.0), (9.0, f64::from(i + 1))]);
            let svg = (0..count).fold(Chart::new("t", "x", "y"), |chart, i| chart.with_series(dot(i))).svg().unwrap();
            let value = |line: &str, key: &str| -> f64 {
                let (_, rest) = line.split_once(&format!(" {key}=\"")).unwrap();
                rest.split('"').next().unwrap().parse().unwrap()
            };
            let circles = || svg.lines().filter(|line| line.starts_with("<circle"));
            // The dots of the legend are in the picture, too: they are the last ones.
            let dots = circles().take(2 * count as usize).map(|line| value(line, "cy")).fold(f64::INFINITY, f64::min);
            let frame = svg.lines().rev().find(|line| line.starts_with("<rect")).unwrap();
            let legend = value(frame, "y") + value(frame, "height");
            assert!(dots > legend, "{count}: {dots} and {legend}");
        }
    }

    #[test]
    fn nothing_is_an_error_and_one_point_is_drawn() {
        assert!(Chart::new("t", "x", "y").svg().unwrap_err().to_string().contains("nothing to draw"));
        let one = Chart::new("t", "x", "y").with_series(Series::new("", Style::Dots, [(3.0, 0.0)]));
        assert!(one.svg().unwrap().contains("<circle"));
    }

    #[test]
    fn ticks_are_short() {
        let shown = [0.1 + 0.2, 0.00002, 1500.0, 0.0].map(number);
        assert_eq!(shown, ["0.3", "2e-5", "1500", "0"]);
    }
}
