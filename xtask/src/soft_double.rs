//! Checks that no loop over pixels or points computes in double precision. On a core without a double-precision unit, a
//! sum of two doubles costs about sixty instructions. The disassembly shows which of the functions that process a
//! picture use doubles.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::machine::output;
use crate::steps::{Outcome, Trouble};

/// Modules that process a picture.
const STAGES: [&str; 11] = [
    "geometry::block",
    "geometry::camera::Camera",
    "pipeline::search",
    "stages::consensus",
    "stages::contour",
    "stages::covariance",
    "stages::edge_points",
    "stages::fit",
    "stages::gates",
    "stages::rays",
    "stages::threshold",
];
/// Functions that convert values of the configuration to single precision, once per picture or per candidate. Each has
/// the number of places that may do so, the larger one of the images `chain` and `measure`.
const ALLOWED_CONVERSIONS: [(&str, usize); 19] = [
    ("hzn_core::pipeline::search::edge::<impl hzn_core::pipeline::search::Search<T,O>>::candidate", 35),
    ("hzn_core::pipeline::search::edge::<impl hzn_core::pipeline::search::Search<T,O>>::judge_edge", 40),
    ("hzn_core::stages::consensus::inliers::Threshold<T>::new", 3),
    ("hzn_core::stages::consensus::find", 2),
    ("hzn_core::stages::covariance::fuse", 5),
    ("hzn_core::stages::fit::fit", 4),
    ("hzn_core::stages::gates::evidence::weigh", 1),
    ("hzn_core::stages::gates::glow::is_likely", 1),
    ("hzn_core::stages::gates::lens::Rows<T>::fit", 1),
    ("hzn_core::stages::gates::lens::unbend", 1),
    ("hzn_core::stages::gates::shape::Residuals<T>::new", 4),
    ("hzn_core::stages::gates::size::is_possible_size", 7),
    ("hzn_core::stages::gates::size::min_arc", 1),
    ("hzn_core::stages::gates::sky::measure_sky", 1),
    ("hzn_core::stages::threshold::histogram::Histogram::mean", 2),
    ("hzn_core::stages::threshold::histogram::Histogram::otsu", 3),
    ("hzn_core::stages::threshold::level::fixed_level", 4),
    ("hzn_core::stages::threshold::sample::Sample::decide", 8),
    ("hzn_core::stages::threshold::small_body::split_small_body", 1),
];
/// Number of places of a gate that may do so. A gate converts its limits, once per candidate.
const CONVERSIONS_OF_A_GATE: usize = 8;
/// Loops that must be found in the image; without them the check would prove nothing.
const LOOPS: [&str; 3] = ["contour::follow", "edge_points::", "fit::sums::pass"];

/// Checks an image for a core that has single precision only.
pub(crate) fn check(image: &Path) -> Outcome {
    let text = output(Command::new("arm-none-eabi-objdump").args(["-d", "-C", "--no-show-raw-insn"]).arg(image))
        .ok_or_else(|| Trouble::Failed(format!("{} cannot be disassembled", image.display())))?;
    let calls = calls_by_function(&text);
    for part in LOOPS {
        if !calls.keys().any(|f| f.contains(part)) {
            return Err(Trouble::Failed(format!("soft double: the image has no separate function of {part}")));
        }
    }
    for (function, &count) in &calls {
        let staged = STAGES.iter().any(|s| function.contains(&format!("hzn_core::{s}")));
        // Checks of a configuration, and of the bytes of a prepared sensor, once before the first picture.
        let checks = function.contains("::check")
            || function.contains("keys::Section>")
            || function.contains("base::packed::Packed>")
            || function.contains("Camera<T>::try_new");
        let allowed = allowed_conversions(function);
        if staged && !checks && count > allowed {
            return Err(Trouble::Failed(format!(
                "{function} computes with soft doubles in {count} places, {allowed} are allowed"
            )));
        }
    }
    println!("soft double: none in a loop over pixels or points; {} functions checked", calls.len());
    Ok(())
}

/// Returns the number of places of a function that may convert values of the configuration.
fn allowed_conversions(function: &str) -> usize {
    let is_gate = function.starts_with("hzn_core::stages::gates::") && function.ends_with("::refuse");
    let listed = || ALLOWED_CONVERSIONS.iter().find(|(name, _)| *name == function).map_or(0, |(_, n)| *n);
    if is_gate { CONVERSIONS_OF_A_GATE } else { listed() }
}

/// Returns every function with the number of its calls to double-precision routines.
fn calls_by_function(disassembly: &str) -> BTreeMap<String, usize> {
    let mut calls = BTreeMap::new();
    let mut function = None;
    for line in disassembly.lines() {
        if let Some((_, name)) = line.strip_suffix(">:").and_then(|l| l.split_once(" <")) {
            function = Some(name.to_owned());
            calls.entry(name.to_owned()).or_insert(0);
        } else if let (Some(function), Some((_, target))) = (&function, line.rsplit_once('<'))
            && is_double(target.trim_end_matches('>'))
        {
            *calls.entry(function.clone()).or_insert(0) += 1;
        }
    }
    calls
}

/// Returns whether this is a routine of the run-time ABI with a double in its name, for example `__aeabi_dadd`,
/// `__aeabi_f2d` or `__aeabi_cdcmple`.
fn is_double(target: &str) -> bool {
    target.strip_prefix("__aeabi_").is_some_and(|n| n.starts_with('d') || n.starts_with("cd") || n.ends_with("2d"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_are_counted_by_function() {
        let text = "00000400 <hzn_core::consensus::find>:\n     400:\tbl\t28642 <__aeabi_dmul>\n     404:\tb.w\t100 \
                    <__aeabi_f2d>\n\
                    \n00000500 <other>:\n     500:\tbl\t400 <hzn_core::consensus::find>\n     504:\tbl\t3 \
                    <__aeabi_fadd>\n";
        let calls = calls_by_function(text);
        assert_eq!(calls, [("hzn_core::consensus::find".to_owned(), 2), ("other".to_owned(), 0)].into());
    }
}
