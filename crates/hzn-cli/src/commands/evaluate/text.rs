//! The report as text.

use hzn_evaluate::{Case, Evaluation, Group, Honesty, Integrity, IntegrityRange, Means, PictureError};

use super::report::Report;
use crate::tell::one_line;

pub(super) fn report(report: &Report, worst: &[&Case]) -> String {
    let mut out = String::new();
    for e in &report.evaluations {
        out.push_str(&format!("{}\n", one_line(&e.body)));
        for (name, value) in lines(e) {
            out.push_str(&format!("  {name:<18} {}\n", one_line(value)));
        }
        for group in &e.groups {
            out.push('\n');
            out.push_str(&table(group));
        }
        if let Some(integrity) = &e.integrity {
            out.push('\n');
            out.push_str(&stanford_table(integrity));
        }
        out.push('\n');
    }
    if !worst.is_empty() {
        out.push_str("worst pictures\n");
        for case in worst {
            out.push_str(&format!("  {}\n", one_line(worst_line(case))));
        }
    }
    out
}

/// Returns the numbers of one body with their names.
pub(crate) fn lines(e: &Evaluation) -> Vec<(&'static str, String)> {
    let mut out = Vec::new();
    let mut line = |name, value| out.push((name, value));
    let mut answered = format!("{} of {} pictures with a limb in view", e.answered, e.with_limb);
    if e.with_limb > 0 {
        answered.push_str(&format!(" ({})", percent(e.answered_share())));
    }
    line("answered", answered);
    if !e.unanswered.is_empty() {
        let parts: Vec<String> = e.unanswered.iter().map(|(status, n)| format!("{n} {status}")).collect();
        line("not answered", parts.join(", "));
    }
    let without = e.frames - e.with_limb;
    line(
        "false answers",
        match without {
            0 => "not tested: every picture shows a limb".into(),
            n => format!("{} of {n} pictures without a limb", e.false_answers),
        },
    );
    if let Some(x) = &e.errors {
        line(
            "error of the axis",
            format!(
                "{} deg RMS, {} median, {} for 95 %, {} at worst",
                deg(x.rms_deg),
                deg(x.median_deg),
                deg(x.p95_deg),
                deg(x.worst_deg)
            ),
        );
        let three = |v: [f64; 3]| v.map(deg).join(", ");
        line(
            "about x, y, z",
            format!("{} deg RMS, mean {} (camera axes)", three(x.rms_about_deg), three(x.mean_about_deg)),
        );
    }
    if let Some(h) = &e.honesty {
        line("covariance (NEES)", format!("{}, {}", nees(h), verdict(h)));
        let parts = h.within.map(|w| format!("{} within {} sigma", percent(w.share), w.sigma));
        let ideal = h.within.map(|w| format!("{:.1}", 100.0 * w.expected)).join(", ");
        line("sigma", format!("{} ({ideal} % when right)", parts.join(", ")));
    }
    out.extend(picture_line(e).into_iter().chain(means_line(e)).chain(integrity_line(e)).chain(position_lines(e)));
    let mut line = |name, value| out.push((name, value));
    if e.with_limb > 0 {
        let positives = e.horace.false_positives.map(|p| format!(", false positives {}", percent(p)));
        line(
            "HORACE criteria",
            format!(
                "{} right within 10 %; false negatives {} (goal: below 10 %){}",
                percent(e.horace.success),
                percent(e.horace.false_negatives),
                positives.unwrap_or_default()
            ),
        );
    }
    out
}

/// Returns the error of the two-dimensional direction; `None` if no answer has one.
fn picture_line(e: &Evaluation) -> Option<(&'static str, String)> {
    let p: PictureError = e.errors.as_ref()?.picture?;
    let (sum, mean, sigma) = (deg(p.mean_and_sigma_deg()), deg(p.mean_deg.abs()), deg(p.sigma_deg));
    Some(("in the picture", format!("{sum} deg = |mean| {mean} + sigma {sigma} of the 2-D direction")))
}

/// Returns the NEES of means over consecutive answers; `None` if no answer can tell.
fn means_line(e: &Evaluation) -> Option<(&'static str, String)> {
    e.honesty.as_ref()?;
    let part = |m: &Means| {
        let groups = if m.groups == 1 { "group" } else { "groups" };
        let (n, independent) = (m.answers, m.nees_if_independent);
        format!("{:.2} of {n} answers ({} {groups}; {independent:.2} if independent)", m.nees, m.groups)
    };
    let parts: Vec<String> = e.means.iter().map(part).collect();
    let none = "not tested: no three consecutive answers have the columns cov_common_*";
    Some(("means (NEES)", if parts.is_empty() { none.into() } else { parts.join(", ") + "; 2 is ideal" }))
}

/// Returns the protection level against the errors; `None` if no answer has one.
fn integrity_line(e: &Evaluation) -> Option<(&'static str, String)> {
    let i = e.integrity.as_ref()?;
    let [low, high] = i.interval.map(|share| format!("{:.2} %", 100.0 * share));
    let level = format!("{} deg median, {:.2} sigma", deg(i.median_deg), i.median_sigmas);
    let above = format!("{} of {} errors are above it ({low} to {high}, 95 %)", i.misleading, i.answers);
    Some(("protection level", format!("{level}; {above}")))
}

/// Columns of the table of errors against protection levels.
pub(super) const STANFORD: [&str; 3] = ["error over protection level", "with a limb", "without"];

/// Returns the rows of the table of errors against protection levels: the cells of [`STANFORD`].
pub(super) fn stanford(i: &Integrity) -> Vec<[String; 3]> {
    let row = |r: &IntegrityRange| {
        let name = match r.up_to {
            Some(most) => format!("{} to {most}", r.above),
            None => format!("above {}: misleading", r.above),
        };
        [name, r.with_limb.to_string(), r.without_limb.to_string()]
    };
    i.ranges.iter().map(row).collect()
}

fn stanford_table(i: &Integrity) -> String {
    let line = |[range, with, without]: [&str; 3]| format!("  {range:<28} {with:>12} {without:>9}\n");
    let rows = stanford(i);
    let cells = rows.iter().map(|cells| line(cells.each_ref().map(String::as_str)));
    [line(STANFORD)].into_iter().chain(cells).collect()
}

/// Returns the numbers about the position and the error classes of star sensors with their names.
fn position_lines(e: &Evaluation) -> Vec<(&'static str, String)> {
    let mut out = Vec::new();
    if let Some(p) = &e.position {
        let share = |x: f64| format!("{:+.3} %", 100.0 * x);
        out.push((
            "range",
            format!(
                "{:.3} % RMS ({:.3} km), mean {}, {:.3} % at worst; {:.2} sigma RMS, mean {:+.2}",
                100.0 * p.range_share_rms,
                p.range_rms_km,
                share(p.range_share_mean),
                100.0 * p.range_share_worst,
                p.range_sigmas_rms,
                p.range_sigmas_mean
            ),
        ));
        out.push(("cross-range", format!("{:.3} km RMS, {:.3} median", p.cross_range_rms_km, p.cross_range_median_km)));
        let [low, high] = p.nees_interval;
        out.push((
            "position (NEES)",
            format!(
                "{:.2} of {} positions; expected mean {low:.2} to {high:.2} (95 %), 3 is ideal",
                p.nees, p.positions
            ),
        ));
    }
    if let Some([x, y]) = &e.classes {
        let both = |f: fn(&hzn_evaluate::ErrorClasses) -> f64| format!("{}, {}", deg(f(x)), deg(f(y)));
        out.push((
            "ECSS classes",
            format!(
                "bias {}; field of view {}; pixel {}; temporal {} deg about x, y",
                both(|c| c.bias_deg),
                both(|c| c.field_of_view_deg),
                both(|c| c.pixel_deg),
                both(|c| c.temporal_deg)
            ),
        ));
    }
    out
}

/// Returns the meaning of the mean NEES in words.
pub(super) fn verdict(h: &Honesty) -> &'static str {
    match h {
        h if h.is_within_interval() && is_few(h) => "nothing speaks against sigma",
        h if h.is_within_interval() => "covariance is right",
        h if h.nees > h.interval[1] => "sigma is too small",
        _ => "sigma is larger than it needs to be",
    }
}

/// Returns whether the answers say less about their covariance than half of them would if they were independent.
fn is_few(h: &Honesty) -> bool {
    h.independent < 0.5 * h.answers as f64
}

fn nees(h: &Honesty) -> String {
    let [low, high] = h.interval;
    let common = format!("; errors in common: as {:.1} independent answers", h.independent);
    let few = if is_few(h) { common.as_str() } else { "" };
    format!("{:.2}; expected mean {low:.2} to {high:.2} (95 %{few})", h.nees)
}

/// Columns of a group's table.
pub(super) const COLUMNS: [&str; 7] = ["pictures", "answered", "RMS deg", "median", "95 %", "worst", "NEES (95 %)"];

/// Returns the rows of a group: the range, then the cells of [`COLUMNS`].
pub(super) fn cells(group: &Group) -> Vec<(String, [String; 7])> {
    let none = || "-".to_owned();
    let row = |r: &hzn_evaluate::GroupRow| {
        let e = |of: fn(&hzn_evaluate::Errors) -> f64| r.errors.as_ref().map_or_else(none, |e| deg(of(e)));
        let honesty = r.honesty.as_ref();
        let n = honesty.map_or_else(none, |h| format!("{:.2} ({:.2}-{:.2})", h.nees, h.interval[0], h.interval[1]));
        let cells = [
            r.with_limb.to_string(),
            r.answered.to_string(),
            e(|e| e.rms_deg),
            e(|e| e.median_deg),
            e(|e| e.p95_deg),
            e(|e| e.worst_deg),
            n,
        ];
        (format!("{} to {}", short(r.range[0]), short(r.range[1])), cells)
    };
    group.rows.iter().map(row).collect()
}

fn table(group: &Group) -> String {
    let head = format!("{} [{}]", group.name, group.unit);
    let mut out = format!("  {head:<20}");
    let width = |i: usize| if i == 6 { 18 } else { 9 };
    for (i, c) in COLUMNS.iter().enumerate() {
        out.push_str(&format!(" {c:>w$}", w = width(i)));
    }
    out.push('\n');
    for (range, cells) in cells(group) {
        out.push_str(&format!("  {range:<20}"));
        for (i, c) in cells.iter().enumerate() {
            out.push_str(&format!(" {c:>w$}", w = width(i)));
        }
        out.push('\n');
    }
    out
}

/// Describes one of the worst pictures in a line.
pub(super) fn worst_line(case: &Case) -> String {
    let what = match (&case.miss, case.limb) {
        (Some(m), true) => {
            let sigmas = m.nees.map_or_else(String::new, |n| format!(", {:.1} sigma", n.sqrt()));
            format!("{} deg off{sigmas}", deg(m.angle_deg))
        }
        (Some(_), false) => "answered without a limb in view".into(),
        (None, _) => format!("not answered: {}", case.status),
    };
    let altitude = case.altitude_km.map(|km| format!("{km:.0} km, ")).unwrap_or_default();
    let place = format!("{altitude}{:.0} deg {}", case.off_axis_deg, case.off_axis_name());
    format!("{} ({}): {what}; {place}", case.file, case.body)
}

/// Formats an angle in degrees with four decimals; from 1e-7 to below 1e-3, with an exponent and two digits.
pub(super) fn deg(x: f64) -> String {
    if (1e-7..1e-3).contains(&x.abs()) { format!("{x:.1e}") } else { format!("{x:.4}") }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn short(x: f64) -> String {
    // Ranges are multiples of a step that is not exact in binary; rounding removes the surplus digits.
    format!("{}", (x * 1e9).round() / 1e9)
}
