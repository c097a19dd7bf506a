//! Charts as SVG: lines and dots over two axes.

mod dark;
mod error;

use std::io;
use std::ops::Range;

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

pub use dark::{DARK, with_dark};
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

/// Colours of expected values, and of marks for what has no value.
const IDEAL: RGBColor = RGBColor(150, 150, 150);
const MARKS: RGBColor = RGBColor(110, 110, 110);
/// Height of a row of the legend, its left end, and an estimate of the width of a letter, in pixels.
const LEGEND_ROW: u32 = 18;
const LEGEND_LEFT: u32 = 76;
const LETTER: u32 = 7;
/// Height of the text below the plot, and an estimate of the width of its letters, in pixels.
const FOOT: u32 = 18;
const FOOT_LETTER: u32 = 6;

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
    /// A short grey mark at the lower edge of the plot for each x, for what has no value; y is not used.
    Marks,
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
    /// Small text below the plot, for example what made the chart; empty for none.
    pub foot: String,
}

impl Chart {
    /// Makes an empty chart of the usual size.
    pub fn new(title: impl Into<String>, x: impl Into<String>, y: impl Into<String>) -> Self {
        let size = (640, 360);
        Self { title: title.into(), x: x.into(), y: y.into(), series: Vec::new(), size, foot: String::new() }
    }
    /// Changes width and height, in pixels.
    #[must_use]
    pub fn sized(mut self, size: (u32, u32)) -> Self {
        self.size = size;
        self
    }
    /// Writes a small text below the plot. It is cut where it would leave the chart.
    #[must_use]
    pub fn with_foot(mut self, foot: impl Into<String>) -> Self {
        self.foot = foot.into();
        self
    }
    /// Adds a series.
    #[must_use]
    pub fn with_series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Returns the chart as SVG text, with dark colours for a system that is dark.
    ///
    /// # Errors
    /// There is nothing to draw: no point is finite.
    pub fn svg(&self) -> Result<String, Error> {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        };
        let (marks, valued): (Vec<_>, Vec<_>) = self.series.iter().partition(|s| s.style == Style::Marks);
        let points = || valued.iter().flat_map(|s| &s.points).filter(|p| is_drawable(p));
        let marked = marks.iter().flat_map(|s| &s.points).map(|p| p.0).filter(|x| x.is_finite());
        let y = range(&mut points().map(|p| p.1));
        if !(y.0 <= y.1) {
            return Err(Error::new(&self.title, Kind::Empty));
        }
        let x = margin(range(&mut points().map(|p| p.0).chain(marked)));
        // Values that are never negative, such as errors and sigmas, start at zero, so that small differences do not
        // look large.
        let (low, high) = margin(if y.0 >= 0.0 { (0.0, y.1) } else { y });
        let low = if y.0 >= 0.0 { 0.0 } else { low };
        self.draw(x, low..high)
    }

    fn draw(&self, x: (f64, f64), y: Range<f64>) -> Result<String, Error> {
        let mut out = String::new();
        self.draw_onto(SVGBackend::with_string(&mut out, self.size), x.0..x.1, y)
            .map_err(|e| Error::new(&self.title, Kind::Drawing(e)))?;
        Ok(with_dark(&out))
    }

    fn draw_onto<'a>(&'a self, backend: SVGBackend<'a>, x: Range<f64>, y: Range<f64>) -> Drawn {
        let font = |size: u32| ("sans-serif", size);
        let root = backend.into_drawing_area();
        root.fill(&WHITE)?;
        let named: Vec<(&Series, RGBColor)> = self.coloured().filter(|(s, _)| !s.name.is_empty()).collect();
        let places = legend_places(&named, self.size.0);
        let height = places.last().map_or(0, |[_, y]| y + LEGEND_ROW);
        let (root, foot) = root.split_vertically(self.size.1 - if self.foot.is_empty() { 0 } else { FOOT });
        if !self.foot.is_empty() {
            let faint = BLACK.mix(0.6);
            let style = font(11).into_text_style(&foot).color(&faint);
            foot.draw_text(&shortened(&self.foot, self.size.0 / FOOT_LETTER), &style, (12, 2))?;
        }
        let (legend, plot) = root.titled(&self.title, font(17))?.split_vertically(height);
        for ((series, colour), [x, y]) in named.iter().zip(&places) {
            draw_entry(&legend, series, *colour, [*x, *y])?;
        }
        let (low, high) = (y.start, y.end);
        let mut chart = ChartBuilder::on(&plot)
            .margin(12)
            .margin_top(6)
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
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_label_formatter(&|v| number(*v))
            .y_label_formatter(&|v| number(*v))
            .draw()?;
        for (series, colour) in self.coloured() {
            let points = || series.points.iter().copied();
            match series.style {
                Style::Dots => {
                    let dot = |p| Circle::new(p, 3, colour.mix(0.75).filled());
                    chart.draw_series(points().filter(is_drawable).map(dot))?;
                }
                Style::Marks => {
                    let top = low + 0.05 * (high - low);
                    let mark = |(x, _)| PathElement::new([(x, low), (x, top)], colour.stroke_width(1));
                    chart.draw_series(points().filter(|p| p.0.is_finite()).map(mark))?;
                }
                Style::Line | Style::Ideal => {
                    let width = if series.style == Style::Line { 2 } else { 1 };
                    for part in series.points.split(|p| !is_drawable(p)) {
                        chart.draw_series(LineSeries::new(part.iter().copied(), colour.stroke_width(width)))?;
                    }
                }
            }
        }
        root.present()?;
        Ok(())
    }

    /// Returns the series with their colours: grey for expected values and for marks.
    fn coloured(&self) -> impl Iterator<Item = (&Series, RGBColor)> {
        let mut colours = COLOURS.iter().cycle();
        self.series.iter().map(move |series| match series.style {
            Style::Ideal => (series, IDEAL),
            Style::Marks => (series, MARKS),
            Style::Line | Style::Dots => (series, colours.next().copied().unwrap_or(BLACK)),
        })
    }
}

/// Returns the place of each entry of the legend in the strip between title and plot, row by row, in pixels. The
/// letters of a reader's program are not known, so that the widths are estimates with room to spare.
fn legend_places(named: &[(&Series, RGBColor)], width: u32) -> Vec<[u32; 2]> {
    let [mut x, mut y] = [LEGEND_LEFT, 0];
    let mut places = Vec::new();
    for (series, _) in named {
        let wide = 24 + LETTER * series.name.chars().count() as u32 + 14;
        if x > LEGEND_LEFT && x + wide > width {
            (x, y) = (LEGEND_LEFT, y + LEGEND_ROW);
        }
        places.push([x, y]);
        x += wide;
    }
    places
}

/// Draws an entry of the legend: a sample of the series and its name.
fn draw_entry(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    series: &Series,
    colour: RGBColor,
    at: [u32; 2],
) -> Drawn {
    let [x, y] = at.map(|x| x as i32);
    let middle = y + LEGEND_ROW as i32 / 2;
    match series.style {
        Style::Dots => area.draw(&Circle::new((x + 10, middle), 3, colour.mix(0.75).filled()))?,
        Style::Marks => {
            area.draw(&PathElement::new([(x + 10, middle - 5), (x + 10, middle + 5)], colour.stroke_width(1)))?;
        }
        Style::Line => area.draw(&PathElement::new([(x, middle), (x + 18, middle)], colour.stroke_width(2)))?,
        Style::Ideal => area.draw(&PathElement::new([(x, middle), (x + 18, middle)], colour.stroke_width(1)))?,
    }
    area.draw(&Text::new(series.name.clone(), (x + 24, middle - 6), ("sans-serif", 12)))
}

/// Returns a text, cut where it has more letters than fit.
fn shortened(text: &str, most: u32) -> String {
    match text.char_indices().nth(most as usize) {
        Some((at, _)) => text.get(..at).unwrap_or(text).to_owned() + "…",
        None => text.to_owned(),
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

    fn value(line: &str, key: &str) -> f64 {
        let (_, rest) = line.split_once(&format!(" {key}=\"")).unwrap();
        rest.split('"').next().unwrap().parse().unwrap()
    }

    /// The legend stands between the title and the plot, whatever its length.
    #[test]
    fn the_legend_is_outside_of_the_axes() {
        for count in [1, 3, 6, 20] {
            let dot = |i: u32| Series::new(format!("series {i}"), Style::Dots, [(0.0, 0.0), (9.0, f64::from(i + 1))]);
            let svg = (0..count).fold(Chart::new("t", "x", "y"), |chart, i| chart.with_series(dot(i))).svg().unwrap();
            // The dots of the legend are drawn first.
            let circles: Vec<f64> =
                svg.lines().filter(|line| line.starts_with("<circle")).map(|line| value(line, "cy")).collect();
            let (legend, dots) = circles.split_at(count as usize);
            let lowest = legend.iter().copied().fold(0.0, f64::max);
            assert!(dots.iter().all(|y| *y > lowest + 5.0), "{count}: {circles:?}");
            let names = svg.lines().filter(|line| line.starts_with("series ")).count();
            assert_eq!(names, count as usize, "every name is listed: {svg}");
        }
    }

    #[test]
    fn a_foot_stands_below_the_plot_and_is_cut_at_the_border() {
        let chart = Chart::new("t", "x", "y").with_series(Series::new("s", Style::Dots, [(0.0, 0.0), (1.0, 1.0)]));
        let svg = chart.clone().with_foot("hzn 0.1.0, hzn sensitivity").svg().unwrap();
        let lines: Vec<&str> = svg.lines().collect();
        let at = lines.iter().position(|line| *line == "hzn 0.1.0, hzn sensitivity").unwrap();
        assert!(value(lines[at - 1], "y") > 340.0, "{}", lines[at - 1]);
        let lowest = lines.iter().filter(|l| l.starts_with("<circle")).map(|l| value(l, "cy")).fold(0.0, f64::max);
        assert!(lowest < 342.0 && !chart.svg().unwrap().contains("hzn"));
        let long = chart.with_foot("x".repeat(500)).svg().unwrap();
        assert!(long.contains(&format!("{}…", "x".repeat(106))) && !long.contains(&"x".repeat(107)));
    }

    #[test]
    fn marks_need_no_value_and_take_no_colour() {
        let chart = Chart::new("t", "time", "deg")
            .with_series(Series::new("no answer", Style::Marks, [(3.0, f64::NAN), (12.0, f64::NAN)]))
            .with_series(Series::new("error", Style::Dots, [(0.0, 1.0), (9.0, 2.0)]));
        let svg = chart.svg().unwrap();
        let marks = svg.lines().filter(|line| line.starts_with("<polyline") && line.contains("#6E6E6E")).count();
        assert_eq!(marks, 3, "two marks and the legend's: {svg}");
        assert!(svg.contains("#0072B2"), "the first colour is that of the values: {svg}");
        assert!(!svg.contains("NaN"), "{svg}");
        let none = Chart::new("t", "x", "y").with_series(Series::new("", Style::Marks, [(3.0, 0.0)]));
        assert!(none.svg().unwrap_err().to_string().contains("nothing to draw"));
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
