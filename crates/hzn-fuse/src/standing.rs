//! Channels of the inertial unit that stand still: at their limit, or because the unit repeats an old sample.
//!
//! A log rarely has a column that says so. The numbers say it without any model of the motion: a channel whose noise is
//! larger than its step does not show one value again and again. Two samples with noise σ and step q are equal with a
//! probability of at most q / (σ √(2π)).
//!
//! Right inputs repeat, too: a rest or a constant rate with coarse steps, and a simulated unit without noise. Their
//! noise next to the repeats is below the step, or there is none, so nothing is concluded from them.

use nalgebra::Vector3;

use crate::input::Sample;
use crate::results::Counts;

/// How often a right flight may be found to stand still.
const FALSE_ALARM: f64 = 1e-6;
/// Fewest equal samples in a row that show a limit: two are a coincidence of a log.
const FEWEST_IN_A_ROW: usize = 3;
/// Fewest samples at one value that show a limit if they are not in a row.
const FEWEST_AT_VALUE: usize = 20;
/// By how much they must outnumber those on the next levels below. A vibration, whose density has its pole at the
/// extreme, has half as many on the first level as on the next eight together.
const PILE: usize = 5;
/// The next levels below, in steps.
const NEXT_LEVELS: f64 = 8.5;
/// Fewest differences of values that show the step.
const FEWEST_STEPS: usize = 5;
/// Samples before and after a repeat that show the noise there.
const AROUND: usize = 16;
/// Samples of a block whose noise is measured at once.
const BLOCK: usize = 32;
/// Fewest third differences that show a noise.
const FEWEST_DIFFERENCES: usize = 8;
/// A unit of 24 bits has no smaller step; smaller differences are the rounding of a calculation.
const SMALLEST_STEP: f64 = 1.0 / (1 << 24) as f64;
/// Names and units of the channels.
const CHANNELS: [(&str, &str); 6] = [
    ("gyro x", "rad/s"),
    ("gyro y", "rad/s"),
    ("gyro z", "rad/s"),
    ("accelerometer x", "m/s2"),
    ("accelerometer y", "m/s2"),
    ("accelerometer z", "m/s2"),
];

/// Marks the samples of channels that stand still as saturated: how the vehicle moved there is not known.
pub(crate) fn mark(samples: &mut [Sample], max_step_s: f64, counts: &mut Counts, notes: &mut Vec<String>) {
    let mut marked = vec![false; samples.len()];
    for triad in [0, 3] {
        let rows: Vec<Vector3<f64>> = samples.iter().map(|s| three(s, triad)).collect();
        let times_s: Vec<f64> = samples.iter().map(|s| s.imu.time_s).collect();
        for [from, to] in frozen(&rows, &times_s, max_step_s) {
            // The first sample is the one that the unit repeats.
            let repeated = from + 1..to;
            counts.frozen += repeated.len();
            marked.get_mut(repeated.clone()).into_iter().flatten().for_each(|m| *m = true);
            let span_s = times_s.get(to - 1).zip(times_s.get(from)).map_or(0.0, |(last, first)| last - first);
            notes.push(format!(
                "imu: all three {} repeat to the last digit for {span_s:.2} s from {:.3} s on ({} samples), though \
                 they have noise elsewhere: the unit stood still; this counts as a gap",
                if triad == 0 { "rates" } else { "specific forces" },
                times_s.get(from).copied().unwrap_or_default(),
                to - from
            ));
        }
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let Some(Limit { value, in_a_row }) = limit(&rows, axis, sign) else { continue };
                let at: Vec<usize> = (0..rows.len()).filter(|i| rows[*i][axis] == value).collect();
                let new: Vec<usize> = at.iter().copied().filter(|i| !samples[*i].saturated && !marked[*i]).collect();
                if new.is_empty() {
                    continue;
                }
                counts.saturated += new.len();
                let (name, unit) = CHANNELS[triad + axis];
                notes.push(format!(
                    "imu: {} samples of {name} are {value:.9} {unit} to the last digit, up to {in_a_row} in a row, and \
                     none is {}: this is its limit; they count as saturated, as with the column saturated",
                    at.len(),
                    if sign > 0.0 { "larger" } else { "smaller" }
                ));
                new.into_iter().for_each(|i| marked[i] = true);
            }
        }
    }
    samples.iter_mut().zip(marked).for_each(|(sample, marked)| sample.saturated |= marked);
}

/// Returns the rates (0) or the specific forces (3) of a sample.
fn three(sample: &Sample, triad: usize) -> Vector3<f64> {
    let imu = &sample.imu;
    *(if triad == 0 { imu.gyro_rad_s.as_inner() } else { imu.accel_m_s2.as_inner() })
}

/// A limit of a channel.
struct Limit {
    value: f64,
    /// Most samples in a row that are there while another channel moves.
    in_a_row: usize,
}

/// Returns the limit at which a channel stands in one direction; `None` if its extreme value is an ordinary one.
fn limit(rows: &[Vector3<f64>], axis: usize, sign: f64) -> Option<Limit> {
    // A row that repeats the one before is no new sample: a log may be faster than its unit.
    let mut rows: Vec<Vector3<f64>> = rows.to_vec();
    rows.dedup();
    let values: Vec<f64> = rows.iter().map(|row| sign * row[axis]).collect();
    let value = values.iter().copied().reduce(f64::max)?;
    if !(value > 0.0) {
        return None;
    }
    let step = step(&values)?;
    let is_at: Vec<bool> = values.iter().map(|v| *v == value).collect();
    let runs = runs(&is_at);
    let sigma = noise(&around(&values, &is_at, &runs))?;
    if sigma < step {
        return None;
    }
    let needed = in_a_row_needed(&[sigma / step], rows.len()).max(FEWEST_IN_A_ROW);
    let moving = runs.iter().filter(|run| others_move(&rows, axis, **run));
    let in_a_row = moving.map(|[from, to]| to - from).max().unwrap_or(0);
    let at = is_at.iter().filter(|at| **at).count();
    let below = values.iter().filter(|v| **v < value && **v > value - NEXT_LEVELS * step).count();
    let is_pile = at >= FEWEST_AT_VALUE && at >= PILE * below;
    (in_a_row >= needed || is_pile).then_some(Limit { value: sign * value, in_a_row: in_a_row.max(1) })
}

/// Returns the step of a channel, or more: the fifth smallest difference of its values, because some rows may be those
/// of another source. The extreme values do not count: a limit may lie between two steps.
pub(crate) fn step(values: &[f64]) -> Option<f64> {
    let mut all = values.to_vec();
    all.sort_by(f64::total_cmp);
    all.dedup();
    let largest = all.iter().fold(0f64, |a, v| a.max(v.abs()));
    let inner = all.get(1..all.len().saturating_sub(1))?;
    let mut steps: Vec<f64> = inner.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    Some(steps.get(FEWEST_STEPS - 1)?.max(largest * SMALLEST_STEP))
}

/// Returns from where to where something holds without a break.
fn runs(holds: &[bool]) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for (i, _) in holds.iter().enumerate().filter(|(_, holds)| **holds) {
        match runs.last_mut() {
            Some([_, to]) if *to == i => *to += 1,
            _ => runs.push([i, i + 1]),
        }
    }
    runs
}

/// Returns the pieces of the values just before and after each run, up to the next run.
fn around<'a>(values: &'a [f64], is_at: &[bool], runs: &[[usize; 2]]) -> Vec<&'a [f64]> {
    let free = |i: &usize| !is_at.get(*i).copied().unwrap_or(true);
    let mut pieces = Vec::new();
    let mut done = 0;
    for [from, to] in runs {
        let before = (done..*from).rev().take_while(free).take(AROUND).last().unwrap_or(*from);
        let after = (*to..values.len()).take_while(free).take(AROUND).last().map_or(*to, |last| last + 1);
        pieces.extend(values.get(before..*from));
        pieces.extend(values.get(*to..after));
        done = after;
    }
    pieces
}

/// Returns the 1-sigma of white noise, from third differences: slow motion has none. `None` where there are too few
/// of them, and where they are not those of white noise, which change their sign in 77 of 100 samples.
fn noise(pieces: &[&[f64]]) -> Option<f64> {
    let each: Vec<Vec<f64>> = pieces.iter().map(|piece| third_differences(piece)).collect();
    let pairs: usize = each.iter().map(|d| d.len().saturating_sub(1)).sum();
    let changes: usize = each.iter().map(|d| d.windows(2).filter(|d| d[0] * d[1] < 0.0).count()).sum();
    if changes * 5 < pairs * 3 {
        return None;
    }
    sigma(&each.concat())
}

fn third_differences(values: &[f64]) -> Vec<f64> {
    values.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).collect()
}

/// Returns the 1-sigma of the noise that has these third differences.
fn sigma(differences: &[f64]) -> Option<f64> {
    let mut sizes: Vec<f64> = differences.iter().map(|d| d.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).filter(|_| sizes.len() >= FEWEST_DIFFERENCES)?;
    // The variance of a third difference of white noise is 20 times its own; the median is 0.6745 sigma.
    Some(median / (0.6745 * 20f64.sqrt()))
}

/// Returns how many equal samples in a row do not come from noise of these sizes, in steps, in `n` samples.
fn in_a_row_needed(steps: &[f64], n: usize) -> usize {
    let each = steps.iter().map(|sigma| (sigma * std::f64::consts::TAU.sqrt()).ln()).sum::<f64>();
    let repeats = (n as f64 / FALSE_ALARM).ln() / each;
    1 + repeats.ceil() as usize
}

/// Returns whether another axis changes from sample to sample in a run, as its noise makes it: less than 3 in 10 are
/// equal to the one before.
fn others_move(rows: &[Vector3<f64>], axis: usize, [from, to]: [usize; 2]) -> bool {
    let run = rows.get(from..to).unwrap_or_default();
    let pairs = run.len().saturating_sub(1);
    (0..3).filter(|other| *other != axis).any(|other| {
        let equal = run.windows(2).filter(|w| w[0][other] == w[1][other]).count();
        equal * 10 < pairs * 3
    })
}

/// Returns the runs of equal rows that last longer than a step of the filter, though the noise does not repeat.
fn frozen(rows: &[Vector3<f64>], times_s: &[f64], max_step_s: f64) -> Vec<[usize; 2]> {
    let repeats: Vec<bool> = std::iter::once(false).chain(rows.windows(2).map(|w| w[0] == w[1])).collect();
    let lasts = |[from, to]: &[usize; 2]| {
        let ends = times_s.get(from.saturating_sub(1)).zip(times_s.get(to - 1));
        ends.is_some_and(|(first, last)| last - first > max_step_s)
    };
    let mut still = runs(&repeats);
    still.retain(lasts);
    still.iter_mut().for_each(|[from, _]| *from = from.saturating_sub(1));
    if still.is_empty() {
        return still;
    }
    let mut is_still = vec![false; rows.len()];
    still.iter().for_each(|[from, to]| is_still.get_mut(*from..*to).into_iter().flatten().for_each(|s| *s = true));
    let elsewhere: Vec<bool> = is_still.iter().map(|s| !s).collect();
    let free = runs(&elsewhere);
    let quiet: Vec<f64> = (0..3).filter_map(|axis| quietest(rows, axis, &free)).collect();
    still.retain(|[from, to]| {
        let Some(row) = rows.get(*from) else { return false };
        // Coarse steps bring the same three values again.
        let again = rows.iter().zip(&elsewhere).filter(|(other, free)| **free && *other == row).count();
        let steps = (0..3).filter_map(|axis| {
            let values: Vec<f64> = rows.iter().map(|row| row[axis]).collect();
            Some(quiet.get(axis)? / step(&values)?)
        });
        let steps: Vec<f64> = steps.collect();
        let is_noisy = steps.len() == 3 && steps.iter().all(|sigma| *sigma >= 1.0);
        again == 0 && is_noisy && to - from >= in_a_row_needed(&steps, rows.len())
    });
    still
}

/// Returns the noise of an axis in its quietest block, without the twentieth part of the blocks. `None` without white
/// noise.
fn quietest(rows: &[Vector3<f64>], axis: usize, runs: &[[usize; 2]]) -> Option<f64> {
    let values: Vec<f64> = rows.iter().map(|row| row[axis]).collect();
    let pieces: Vec<&[f64]> = runs.iter().filter_map(|[from, to]| values.get(*from..*to)).collect();
    noise(&pieces)?;
    let blocks = pieces.iter().flat_map(|piece| piece.chunks_exact(BLOCK));
    let mut sizes: Vec<f64> = blocks.filter_map(|block| sigma(&third_differences(block))).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 20).copied()
}
