//! Writes the results as tables.

use std::fmt::Write;

use crate::results::{HZN, RECIPE, Results, median};
use crate::sensors::MOVED_PX;
use crate::state::State;
use crate::{goals, growth};

/// Returns the page as Markdown.
pub(crate) fn markdown(results: &Results) -> String {
    let mut s = String::from("# Benchmarks\n\n");
    let _ = writeln!(
        s,
        "`cargo xtask bench` writes this page. The times are for one thread of {}; {}; the profile `dist`, as it is \
         shipped. Each case has {} distinct frames. Each frame is measured {} times in each state, from the threshold \
         to the covariance; hzn and the recipe take turns and have the same threshold. A time is the median over the \
         frames of the best time of each frame; the recipe's is processor time, so that interruptions of its longer \
         runs do not count against it. Load of the machine at the start: {}.\n",
        results.machine, results.versions, results.frames, results.rounds, results.load
    );
    s.push_str(
        "| state | what the caches hold |\n|---|---|\n\
         | all flushed | neither the picture nor the program: a program that runs once a second, between others |\n\
         | picture flushed | the program, which has just processed another frame: a camera has written the picture |\n\
         | warm | the program and the picture, which it has just processed |\n\n",
    );
    s.push_str(&pages(results));
    let _ = write!(
        s,
        "\nThe recipe solves its least squares with `numpy.linalg.lstsq`, as one usually does; a row of its own shows \
         it with the normal equations. An expert looks at every 8th pixel first, and then measures the crossings of \
         the threshold between them; this recipe takes every crossing for the limb. In a sequence, hzn has found the \
         limb in the picture before, {MOVED_PX} pixels away (`track.full_every`). The ratio is the time of the recipe \
         with `lstsq` divided by the time of the row. The error is the angle between answer and truth, median / worst \
         (frames answered); the points are those of the edges that the program used.\n\n",
    );
    s.push_str(&times(results));
    let _ = write!(s, "\nOur goals and the measured values:\n\n{}", goals::table(&results.cases));
    if !results.growth.is_empty() {
        let _ = write!(
            s,
            "\n## Growth\n\nThe time in µs against the size of the picture, with everything flushed; 3 frames of each \
             size. `hostile` is a pattern of dots in which every dot is an edge and none is a limb: the work budget \
             ends it, so its time does not grow. The recipe takes the longest edge, whether it is a limb or not.\n\n\
             ![Time of a picture, everything flushed](figures/growth.svg)\n\n{}",
            growth::table(&results.growth)
        );
    }
    s.push_str(&stages(results));
    s
}

/// Says on which pages of memory the frames lie.
fn pages(results: &Results) -> String {
    let mut s = String::from("Both programs ask for pages of 2 MiB for their frames (`madvise`):");
    for c in &results.cases {
        let [ours, theirs] = c.large_mib;
        let comma = if std::ptr::eq(c, &results.cases[0]) { "" } else { ";" };
        let _ = write!(
            s,
            "{comma} {}: {:.0} MiB of frames, {ours:.0} MiB (hzn) and {theirs:.0} MiB (recipe, with its binary \
             picture) on such pages",
            c.title, c.frames_mib
        );
    }
    s + ".\n"
}

/// Returns the table of times: a row for each case and program.
fn times(results: &Results) -> String {
    let mut s = String::from(
        "| case | program | points | all flushed, µs | picture flushed, µs | warm, µs | ratio, all flushed | picture \
         flushed | warm | error, degrees |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---|\n",
    );
    for c in &results.cases {
        for (i, p) in c.programs.iter().enumerate() {
            let _ = write!(s, "| {} | {} | {:.0} |", c.title, p.name, p.points());
            State::ALL.iter().for_each(|&state| _ = write!(s, " {:.0} |", p.median_us(state)));
            State::ALL.iter().for_each(|&state| _ = write!(s, " {:.1} |", c.ratio(i, state)));
            let _ = writeln!(s, " {} |", p.error_cell());
        }
    }
    s.push_str("\n| case | pixels read, % | every point kept, changing frames, ns a point |\n|---|---:|---:|\n");
    for c in &results.cases {
        let (read, point) = (median(&c.pixels_percent), median(&c.ns_a_point));
        let _ = writeln!(s, "| {} | {read:.2} | {point:.0} |", c.title);
    }
    s
}

/// Returns the times of the stages.
fn stages(results: &Results) -> String {
    let mut s = String::from("\n## Stages\n\nTimes in µs; hzn's with an observer, which costs a little.\n\n");
    s.push_str("| case | program | state | stages |\n|---|---|---|---|\n");
    for c in &results.cases {
        for p in [HZN, RECIPE].iter().filter_map(|&i| c.programs.get(i)) {
            for state in State::ALL {
                let _ = writeln!(s, "| {} | {} | {} | {} |", c.title, p.name, state.name(), p.stages_text(state));
            }
        }
    }
    s
}
