//! Writes the results as tables.

use std::fmt::Write;

use crate::goals;
use crate::results::{Results, median};
use crate::sensors::FEWER;

/// Returns the tables as Markdown.
pub(crate) fn markdown(results: &Results) -> String {
    let mut s = String::from("# Benchmarks\n\n");
    let _ = writeln!(
        s,
        "`cargo xtask bench` writes this page. The times are for one thread of {}; {}. Each case has {} distinct \
         frames. Each frame is measured {} times with flushed caches, from the threshold to the covariance; hzn and \
         the recipe take turns and have the same threshold. A time is the median over the frames of the best time of \
         each frame. Load of the machine at the start: {}.\n",
        results.machine, results.versions, results.frames, results.rounds, results.load
    );
    let _ = writeln!(
        s,
        "| case | hzn f32, µs | f32, {FEWER} points kept, µs | hzn f64, µs | recipe, µs | ratio f32 | ratio f32, \
         {FEWER} points | ratio f64 | f32 warm, µs | pixels read, % | all points, warm, ns per point |\n\
         |---|---|---|---|---|---|---|---|---|---|---|"
    );
    for c in &results.cases {
        let (single, fewer, double) = (c.f32.median(), c.fewer.median(), c.f64.median());
        let theirs = c.opencv.median();
        let _ = writeln!(
            s,
            "| {} | {single:.0} | {fewer:.0} | {double:.0} | {theirs:.0} | {:.1} | {:.1} | {:.1} | {:.0} | {:.2} | \
             {:.0} |",
            c.name,
            theirs / single,
            theirs / fewer,
            theirs / double,
            c.warm.median(),
            median(&c.pixels_percent),
            median(&c.ns_a_point)
        );
    }
    let _ = write!(
        s,
        "\n'Warm' is a second run on the same picture, which is then in the caches. The difference to the first \
         column is memory access: rows of the picture that the limb crosses are far apart in memory, and flushed \
         caches do not hold the program either.\n\nOur goals and the measured values:\n\n{}",
        goals::table(&results.cases)
    );
    s.push_str("\nAngle between answer and truth in degrees, median / worst (frames answered):\n\n");
    let _ = writeln!(s, "| case | hzn f32 | f32, {FEWER} points | hzn f64 | recipe |\n|---|---|---|---|---|");
    for c in &results.cases {
        let _ = writeln!(s, "| {} | {} |", c.name, c.error_cells().join(" | "));
    }
    s.push_str("\nStages, µs (hzn's with an observer, which costs a little):\n\n");
    s.push_str("| case | program | stages |\n|---|---|---|\n");
    for c in &results.cases {
        for (name, times) in [("hzn f32", &c.f32), ("hzn f64", &c.f64), ("recipe", &c.opencv)] {
            let _ = writeln!(s, "| {} | {name} | {} |", c.name, times.stages_text());
        }
    }
    s
}
