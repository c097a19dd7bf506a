//! Rows of a receiver or star tracker that say again what an earlier row said. They are no new measurement: taken
//! twice, an error counts as two independent ones.

use crate::input::{Attitude, Fix, Inputs};
use crate::results::Counts;
use crate::settings::Settings;

/// Speed in its sigmas from which a receiver that moves cannot have the same position again.
const MOVES: f64 = 5.0;

/// Returns the inputs without repeated rows, counts these and says how many; `None` if no row is repeated.
pub(crate) fn without(
    inputs: &Inputs,
    settings: &Settings,
    counts: &mut Counts,
    notes: &mut Vec<String>,
) -> Option<Inputs> {
    let of_fixes = fixes(&inputs.gnss, settings);
    let of_attitudes = attitudes(&inputs.attitudes);
    let number = |all: &[Row], kind: Row| all.iter().filter(|row| **row == kind).count();
    for (name, all) in [("gnss", &of_fixes), ("attitude", &of_attitudes)] {
        let (copies, held) = (number(all, Row::Copy), number(all, Row::Held));
        counts.add_unusable(name, "another row has the same time and numbers", copies);
        counts.add_unusable(name, "the row repeats the numbers of the one before at a later time", held);
        if copies > 0 {
            notes.push(format!("{name}: {copies} of {} rows are copies of others; each counts once", all.len()));
        }
        if held > 0 {
            notes.push(format!(
                "{name}: {held} of {} rows repeat the numbers of the row before at a later time, though the vehicle \
                 moves: the log is faster than the receiver, so only the first of each counts",
                all.len()
            ));
        }
    }
    let is_new = |all: &[Row]| all.iter().all(|row| *row == Row::New);
    if is_new(&of_fixes) && is_new(&of_attitudes) {
        return None;
    }
    Some(Inputs {
        gnss: new_ones(&inputs.gnss, &of_fixes),
        attitudes: new_ones(&inputs.attitudes, &of_attitudes),
        ..inputs.clone()
    })
}

/// What a row is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Row {
    /// A measurement.
    New,
    /// The same numbers at the same time.
    Copy,
    /// The same numbers at a later time, though they cannot be the same.
    Held,
}

fn new_ones<T: Copy>(all: &[T], rows: &[Row]) -> Vec<T> {
    all.iter().zip(rows).filter(|(_, row)| **row == Row::New).map(|(one, _)| *one).collect()
}

/// Says of each fix what it is. A vehicle at rest may have the same position again.
fn fixes(all: &[Fix], settings: &Settings) -> Vec<Row> {
    let numbers = |i: usize| all.get(i).map_or([f64::NAN; 6], six);
    let mut rows = vec![Row::New; all.len()];
    let order = by_time(all.len(), |i| all.get(i).map_or(f64::NAN, |fix| fix.time_s), numbers);
    let groups: Vec<&[usize]> = order.chunk_by(|a, b| are_same(&numbers(*a), &numbers(*b))).collect();
    for (number, group) in groups.iter().enumerate() {
        let next = groups.get(number + 1).and_then(|next| all.get(*next.first()?));
        let first = group.first().and_then(|first| all.get(*first));
        let moves = first.is_some_and(|fix| moves(fix, next, settings));
        for pair in group.windows(2) {
            let [before, this] = [pair[0], pair[1]].map(|i| all.get(i).map(|fix| fix.time_s));
            let row = if before == this {
                Row::Copy
            } else if moves {
                Row::Held
            } else {
                Row::New
            };
            rows.get_mut(pair[1]).into_iter().for_each(|place| *place = row);
        }
    }
    rows
}

fn six(fix: &Fix) -> [f64; 6] {
    let ([x, y, z], [vx, vy, vz]) = (fix.position_m.xyz(), fix.velocity_m_s.xyz());
    [x, y, z, vx, vy, vz]
}

/// Returns whether the vehicle moves at a fix: by its velocity, or else by the next other position.
fn moves(fix: &Fix, next: Option<&Fix>, settings: &Settings) -> bool {
    let [position_m, velocity_m_s] = settings.fix_sigmas(fix);
    if fix.velocity_m_s.is_finite() {
        return fix.velocity_m_s.norm() > MOVES * velocity_m_s;
    }
    next.is_some_and(|next| (next.position_m - fix.position_m).norm() > MOVES * position_m)
}

/// Says of each attitude what it is.
fn attitudes(all: &[Attitude]) -> Vec<Row> {
    let numbers = |i: usize| all.get(i).and_then(|a| a.fixed_from_vehicle).map_or([f64::NAN; 4], |q| q.wxyz());
    let time_s = |i: usize| all.get(i).map_or(f64::NAN, |a| a.time_s);
    let mut rows = vec![Row::New; all.len()];
    for pair in by_time(all.len(), time_s, numbers).windows(2) {
        let [before, this] = [pair[0], pair[1]];
        let is_copy = time_s(before) == time_s(this) && numbers(before) == numbers(this);
        rows.get_mut(this).into_iter().filter(|_| is_copy).for_each(|place| *place = Row::Copy);
    }
    rows
}

/// Returns the rows with a finite time in the order of time; those of one time in the order of their numbers.
fn by_time<const N: usize>(n: usize, time_s: impl Fn(usize) -> f64, numbers: impl Fn(usize) -> [f64; N]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).filter(|i| time_s(*i).is_finite()).collect();
    order.sort_by(|a, b| {
        let by_numbers = || {
            let (a, b) = (numbers(*a), numbers(*b));
            let mut each = a.iter().zip(&b).map(|(a, b)| a.total_cmp(b));
            each.find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        };
        time_s(*a).total_cmp(&time_s(*b)).then_with(by_numbers)
    });
    order
}

/// Returns whether all numbers are equal; a missing one is equal to a missing one.
fn are_same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}
