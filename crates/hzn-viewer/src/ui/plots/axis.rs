//! Axes and lines of the plots.

use std::ops::RangeInclusive;

use egui_plot::{GridInput, GridMark};

/// Returns the labels along an axis. The very end has none, because the border of the window would cut it.
pub(super) fn axis_labels(unit: &'static str) -> impl Fn(GridMark, &RangeInclusive<f64>) -> String {
    move |mark, range| {
        let room = 0.04 * (range.end() - range.start());
        let label = || tick_label(mark.value, mark.step_size) + unit;
        if mark.value > range.end() - room { String::new() } else { label() }
    }
}

/// Returns about `count` grid lines, at 1, 2 or 5 times a power of ten. A single line would not show the scale, so
/// there are up to about `most` of them then.
pub(super) fn ticks(input: GridInput, count: f64, most: f64) -> Vec<GridMark> {
    let marks = grid(input.bounds, count);
    if marks.len() == 1 { grid(input.bounds, most.max(count)) } else { marks }
}

fn grid((low, high): (f64, f64), count: f64) -> Vec<GridMark> {
    let rough = (high - low) / count;
    if !(rough > 0.0 && rough.is_finite()) {
        return Vec::new();
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|k| k * power).find(|s| *s >= rough).unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    (first..first + 12)
        .map(|i| i as f64 * step)
        .take_while(|y| *y <= high)
        .map(|value| GridMark { value, step_size: step })
        .collect()
}

/// Formats the value of a tick with enough digits to differ from its neighbours.
pub(super) fn tick_label(value: f64, step: f64) -> String {
    let digits = (-(step * 1.000_001).log10().floor()).clamp(0.0, 12.0) as usize;
    // A zero has no minus sign.
    let value = if value.abs() < step * 1e-6 { 0.0 } else { value };
    format!("{value:.digits$}")
}

/// Returns rows of points; a missing point starts a new row. Within the same `column` (a width; 0 for none) only about
/// the lowest and the highest points are kept. More cannot be seen, and a column may have thousands of pictures.
pub(super) fn polylines(count: usize, column: f64, point: impl Fn(usize) -> Option<[f64; 2]>) -> Vec<Vec<[f64; 2]>> {
    let mut out: Vec<Vec<[f64; 2]>> = Vec::new();
    let (mut open, mut last, mut in_last) = (false, f64::NAN, 0);
    for p in (0..count).map(point) {
        let Some(p) = p else {
            open = false;
            continue;
        };
        let here = if column > 0.0 { (p[0] / column).floor() } else { f64::NAN };
        let part = match out.last_mut() {
            Some(part) if open => part,
            _ => out.push_mut(Vec::new()),
        };
        in_last = if open && here == last { in_last + 1 } else { 1 };
        (open, last) = (true, here);
        match part.as_mut_slice() {
            [.., a, b] if in_last > 2 => {
                let between =
                    |x: &[f64; 2], y: [f64; 2], z: [f64; 2]| (x[1].min(z[1])..=x[1].max(z[1])).contains(&y[1]);
                if between(a, p, *b) {
                    continue;
                }
                if !between(a, *b, p) {
                    *a = *b;
                }
                *b = p;
            }
            _ => part.push(p),
        }
    }
    out
}

/// Returns the ends of the y axis for these values: a little more than the values, also if there is only one.
pub(super) fn value_range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return None;
    }
    let pad = 0.08 * (high - low);
    let largest = low.abs().max(high.abs());
    // The axis of a single value has round numbers.
    let part = if low == high { 0.1 } else { 1e-3 };
    let least = if largest > 0.0 { part * largest } else { 1.0 };
    Some([low - pad.max(least), high + pad.max(least)])
}

/// Returns the ends of the y axis for values of which a few may be far from the others. Values farther from the middle
/// eight tenths than four times their span lie outside: that is 11 sigmas of normally distributed values, so that only
/// values of another kind are left out.
pub(super) fn robust_range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut all: Vec<f64> = values.collect();
    let tenth = all.len() / 10;
    if tenth == 0 {
        return value_range(all.into_iter());
    }
    let (_, low, _) = all.select_nth_unstable_by(tenth, f64::total_cmp);
    let low = *low;
    let last = all.len() - 1 - tenth;
    let (_, high, _) = all.select_nth_unstable_by(last, f64::total_cmp);
    let (high, room) = (*high, 4.0 * (*high - low));
    // If most values are equal, the others are what there is to see.
    let inside = |v: &f64| room == 0.0 || (low - room..=high + room).contains(v);
    value_range(all.iter().copied().filter(inside))
}

/// Returns a range that is as large as both, but at most three times as large as the first one: a bad comparison does
/// not make the curve flat that it is compared with.
pub(super) fn widen([low, high]: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    let span = high - low;
    [low.min(other[0]).max(low - span), high.max(other[1]).min(high + span)]
}

/// Returns angles in degrees without the jumps of 360°: a value that differs from the one before by more than half a
/// turn has gone around.
pub(super) fn unwrap_deg(angles_deg: impl Iterator<Item = Option<f64>>) -> Vec<Option<f64>> {
    let mut last: Option<f64> = None;
    let step = |angle: Option<f64>| {
        let angle = angle?;
        let turns = last.map_or(0.0, |last| ((last - angle) / 360.0).round());
        last = Some(angle + 360.0 * turns);
        last
    };
    angles_deg.map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_far_values_do_not_make_the_others_flat() {
        let near = || (0..95).map(|i| f64::from(i % 10) * 0.1);
        let [low, high] = robust_range(near().chain([600.0, -600.0, 590.0])).unwrap();
        assert!(low > -0.2 && low < 0.0 && high > 0.9 && high < 1.1, "{low} {high}");
        // Two levels are no outliers, and neither is a single step.
        assert!(robust_range((0..40).map(|i| if i < 20 { 1.0 } else { 50.0 })).unwrap()[1] > 50.0);
        assert!(robust_range((0..100).map(|i| if i < 97 { 1.0 } else { 50.0 })).unwrap()[1] > 50.0);
        assert_eq!(robust_range(std::iter::empty()), None);
    }

    #[test]
    fn a_comparison_widens_a_range_within_bounds() {
        assert_eq!(widen([0.0, 1.0], [-0.5, 1.2]), [-0.5, 1.2]);
        assert_eq!(widen([0.0, 1.0], [-900.0, 0.5]), [-1.0, 1.0]);
        assert_eq!(widen([0.0, 1.0], [40.0, 90.0]), [0.0, 2.0]);
    }

    #[test]
    fn an_angle_goes_around_without_a_jump() {
        let wrapped = [Some(170.0), Some(-175.0), None, Some(-10.0), Some(178.0), Some(160.0)];
        let whole = [Some(170.0), Some(185.0), None, Some(350.0), Some(178.0), Some(160.0)];
        assert_eq!(unwrap_deg(wrapped.into_iter()), whole);
    }

    #[test]
    fn ticks_are_round_numbers() {
        let tick_values = |low: f64, high: f64| -> Vec<f64> {
            ticks(GridInput { bounds: (low, high), base_step_size: 0.0 }, 4.0, 8.0).iter().map(|m| m.value).collect()
        };
        assert_eq!(tick_values(0.0, 10.0), [0.0, 5.0, 10.0]);
        assert_eq!(tick_values(-0.9, 7.2), [0.0, 5.0]);
        // One line at 0 would not show the scale.
        let few = ticks(GridInput { bounds: (-190.0, 190.0), base_step_size: 0.0 }, 2.0, 4.0);
        assert_eq!(few.iter().map(|m| m.value).collect::<Vec<_>>(), [-100.0, 0.0, 100.0]);
        assert_eq!(tick_values(100.0, 103.5), [100.0, 101.0, 102.0, 103.0]);
        assert!(tick_values(1.0, 1.0).is_empty() && tick_values(f64::NAN, 1.0).is_empty());
    }

    /// A label is 15 points high in a plot of 46 points.
    #[test]
    fn a_low_plot_has_lines_that_leave_room_for_labels() {
        for (low, high) in (0..200).map(|n| (0.05 * f64::from(n % 17), 0.9 + 0.037 * f64::from(n))) {
            let marks = ticks(GridInput { bounds: (low, high), base_step_size: 0.0 }, 3.0, 46.0 / 15.0);
            let apart = marks.first().map(|m| 46.0 * m.step_size / (high - low));
            assert!(apart.is_some_and(|points| points >= 15.0), "{low} {high}: {apart:?}");
        }
    }

    #[test]
    fn no_two_ticks_read_the_same() {
        for (low, high) in [(0.08, 0.13), (100.2, 100.3), (0.0, 1.0), (-3e-5, 4e-5), (0.0, 2400.0)] {
            let marks = ticks(GridInput { bounds: (low, high), base_step_size: 0.0 }, 4.0, 8.0);
            let labels: Vec<String> = marks.iter().map(|m| tick_label(m.value, m.step_size)).collect();
            let distinct: std::collections::HashSet<_> = labels.iter().collect();
            assert!(labels.len() > 1 && distinct.len() == labels.len(), "{labels:?}");
        }
        assert_eq!((tick_label(0.1, 0.02).as_str(), tick_label(-1e-17, 5.0).as_str()), ("0.10", "0"));
        let label = |value: f64| axis_labels(" s")(GridMark { value, step_size: 10.0 }, &(0.0..=101.0));
        assert_eq!((label(90.0).as_str(), label(100.0).as_str()), ("90 s", ""));
    }

    #[test]
    fn a_single_value_has_an_axis_around_it() {
        assert_eq!(value_range(std::iter::empty()), None);
        let [low, high] = value_range([0.012].into_iter()).unwrap();
        assert!(low < 0.0115 && high > 0.0125 && high - low < 0.004, "{low} {high}");
        assert_eq!(value_range([0.0].into_iter()), Some([-1.0, 1.0]));
        let [low, high] = value_range([1.0, 3.0, 2.0].into_iter()).unwrap();
        assert!(low < 1.0 && low > 0.5 && high > 3.0 && high < 3.5);
    }

    #[test]
    fn lines_are_broken_where_values_are_missing() {
        let value = |i: usize| (!i.is_multiple_of(4)).then_some([i as f64, 1.0]);
        for column in [0.0, 0.5, f64::NAN] {
            let lengths: Vec<usize> = polylines(10, column, value).iter().map(Vec::len).collect();
            assert_eq!(lengths, [3, 3, 1]);
        }
        assert!(polylines(3, 0.0, |_| None).is_empty());
    }

    #[test]
    fn what_a_column_cannot_show_is_left_out_and_its_extremes_are_not() {
        let value = |i: usize| Some([i as f64, ((i * 7919) % 1000) as f64]);
        let all: Vec<[f64; 2]> = (0..10_000).filter_map(value).collect();
        let thin = polylines(all.len(), 100.0, value).concat();
        assert_eq!(thin.len(), 200);
        assert!(thin.is_sorted_by(|a, b| a[0] < b[0]));
        for (these, those) in all.chunks(100).zip(thin.chunks(2)) {
            let ends = |points: &[[f64; 2]]| {
                let y = || points.iter().map(|p| p[1]);
                (y().fold(f64::INFINITY, f64::min), y().fold(f64::NEG_INFINITY, f64::max))
            };
            assert_eq!(ends(these), ends(those));
        }
    }
}
