//! Time against the size of the picture.

use std::fmt::Write;

use plotters::prelude::*;

use crate::cases::Case;
use crate::opencv::{Recipe, SOLVERS};
use crate::results::{Grown, median};
use crate::sensors::{self, Measured};
use crate::state::State;

/// Kinds of frames, in the order of the table.
const KINDS: [&str; 3] = ["clean", "cloudy", "hostile"];
/// Their colours; colour-blind people can distinguish them (Okabe and Ito).
const COLOURS: [RGBColor; 3] = [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115)];

/// Measures one case with everything flushed: hzn in f32, and the recipe in turns with it.
pub(crate) fn measure(case: &Case, rounds: usize, recipe: &mut Recipe) -> Result<Grown, String> {
    let mut sensor = sensors::flight_sensor(&case.sensor)?;
    let mut best = vec![[f64::INFINITY; 2]; case.frames.len()];
    for _ in 0..rounds {
        for (i, [ours, theirs]) in best.iter_mut().enumerate() {
            let run = sensor.measure(case, i, State::AllFlushed)?;
            let answer = recipe.measure(&case.name, i, run.level.max(1), SOLVERS[0], State::AllFlushed)?;
            (*ours, *theirs) = (ours.min(run.elapsed_us), theirs.min(answer.total_us));
        }
    }
    let of = |which: usize| median(&best.iter().map(|b| b[which]).collect::<Vec<_>>());
    Ok(Grown { title: case.title.clone(), pixels: case.pixels(), hzn_us: of(0), recipe_us: of(1) })
}

/// Returns the sizes with the times of a kind.
fn of_kind<'a>(growth: &'a [Grown], kind: &'a str) -> impl Iterator<Item = &'a Grown> {
    growth.iter().filter(move |g| g.title.starts_with(kind))
}

fn megapixels(grown: &Grown) -> f64 {
    grown.pixels as f64 / 1e6
}

/// Returns the chart as SVG: both axes are logarithmic.
pub(crate) fn chart(growth: &[Grown]) -> Result<String, String> {
    let mut svg = String::new();
    draw(SVGBackend::with_string(&mut svg, (640, 480)), growth).map_err(|e| e.to_string())?;
    Ok(svg)
}

fn draw<'a>(
    backend: SVGBackend<'a>,
    growth: &'a [Grown],
) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>> {
    let font = |size: u32| ("sans-serif", size);
    let root = backend.into_drawing_area();
    root.fill(&WHITE)?;
    let (low, high) = growth
        .iter()
        .flat_map(|g| [g.hzn_us, g.recipe_us])
        .filter(|us| us.is_finite())
        .fold((f64::INFINITY, 0.0f64), |(low, high), us| (low.min(us), high.max(us)));
    let mut chart = ChartBuilder::on(&root)
        .caption("Time of a picture, everything flushed", font(17))
        .margin(12)
        .margin_right(20)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d((0.06..60.0).log_scale(), (low / 1.5..high * 1.5).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("picture, million pixels")
        .y_desc("time, µs")
        .axis_desc_style(font(14))
        .label_style(font(12))
        .light_line_style(WHITE)
        .bold_line_style(BLACK.mix(0.1))
        .draw()?;
    for (kind, colour) in KINDS.into_iter().zip(COLOURS) {
        let points = |time: fn(&Grown) -> f64| of_kind(growth, kind).map(move |g| (megapixels(g), time(g)));
        chart
            .draw_series(LineSeries::new(points(|g| g.hzn_us), colour.stroke_width(2)).point_size(3))?
            .label(format!("hzn, {kind}"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        chart
            .draw_series(points(|g| g.recipe_us).map(|at| TriangleMarker::new(at, 5, colour.mix(0.7))))?
            .label(format!("recipe, {kind}"))
            .legend(move |(x, y)| TriangleMarker::new((x + 8, y), 5, colour.mix(0.7)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .label_font(font(12))
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.2))
        .draw()?;
    root.present()
}

/// Returns the table as Markdown: a row for each size.
pub(crate) fn table(growth: &[Grown]) -> String {
    let mut s = String::from("| million pixels |");
    KINDS.iter().for_each(|kind| _ = write!(s, " hzn, {kind} | recipe, {kind} |"));
    let _ = writeln!(s, "\n|---:|{}", "---:|".repeat(2 * KINDS.len()));
    let mut sizes: Vec<u64> = growth.iter().map(|g| g.pixels).collect();
    sizes.dedup();
    for pixels in sizes {
        let _ = write!(s, "| {:.2} |", pixels as f64 / 1e6);
        for kind in KINDS {
            match of_kind(growth, kind).find(|g| g.pixels == pixels) {
                Some(g) => _ = write!(s, " {:.0} | {:.0} |", g.hzn_us, g.recipe_us),
                None => s.push_str(" | |"),
            }
        }
        s.push('\n');
    }
    s
}
