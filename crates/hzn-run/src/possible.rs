//! Whether the numbers of an answer that was read can be those of an answer.
//!
//! A row without the column `crc32` may come from any program. A wrong number in it would count as an answer: an axis
//! is made a unit vector, and a covariance that is none drops out of the statistics.

use hzn_mcap::Row;

/// Largest error of the length of an axis that was computed in single precision: a sum of a few terms.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;
/// Share of the largest variance by which single precision can make a variance negative: the limit of the filter.
const ROUNDING_SHARE: f64 = 1e-5;
/// Largest difference of a length from 1, whatever number of digits was written: as for the attitudes of frames.csv.
const MAX_LENGTH_ERROR: f64 = 0.01;

/// Returns half of the last decimal place with which a number is written, which is the error of its rounding. Zeros at
/// the end are not seen, so that the place is never too fine.
fn rounding(x: f64) -> f64 {
    let text = format!("{x:e}");
    let Some((digits, exponent)) = text.split_once('e') else { return 0.0 };
    let places = digits.split_once('.').map_or(0, |(_, fraction)| fraction.len() as i32);
    exponent.parse::<i32>().map_or(0.0, |exponent| 0.5 * 10f64.powi(exponent - places))
}

/// Returns the columns and what is wrong with them if a row with the status `ok` has a number that no answer has: an
/// axis that is not a unit vector, a covariance with a negative variance or a correlation above 1, or a probability
/// outside of 0 to 1. Empty cells are no fault.
pub fn find_impossible(row: &Row) -> Option<String> {
    if row.status != hzn_core::status::Status::Ok {
        return None;
    }
    let axes = [
        ("axis", [row.axis_x, row.axis_y, row.axis_z]),
        ("axis_e", [row.axis_e_x, row.axis_e_y, row.axis_e_z]),
        ("axis_free", [row.axis_free_x, row.axis_free_y, row.axis_free_z]),
        ("axis_v", [row.axis_v_x, row.axis_v_y, row.axis_v_z]),
    ];
    let axis = axes.into_iter().find_map(|(name, cells)| not_unit(name, cells));
    let variances = || {
        let free =
            [row.cov_free_xx, row.cov_free_xy, row.cov_free_xz, row.cov_free_yy, row.cov_free_yz, row.cov_free_zz];
        let all = [
            ("cov", "", [row.cov_xx, row.cov_xy, row.cov_xz, row.cov_yy, row.cov_yz, row.cov_zz]),
            ("cov_free", "", free),
            ("cov_common", "", row.common_covariance().map_or([None; 6], |common| common.map(Some))),
            ("pos_cov", "_km2", row.position_covariance_km2().map_or([None; 6], |covariance| covariance.map(Some))),
        ];
        all.into_iter().find_map(|(name, unit, cells)| not_covariance(name, unit, cells))
    };
    let probability = || {
        let p = row.p_limb.filter(|p| !(0.0..=1.0).contains(p))?;
        Some(format!("p_limb is {p}, and a probability is 0 to 1"))
    };
    axis.or_else(variances).or_else(probability)
}

fn not_unit(name: &str, cells: [Option<f64>; 3]) -> Option<String> {
    let [Some(x), Some(y), Some(z)] = cells else { return None };
    let axis = [x, y, z];
    let length = x.hypot(y).hypot(z);
    let written: f64 = axis.iter().map(|x| x.abs() * rounding(*x)).sum();
    let is_unit = (length - 1.0).abs() <= (written + ROUNDING).min(MAX_LENGTH_ERROR);
    (!is_unit).then(|| format!("{name}_x, {name}_y, {name}_z are {x}, {y}, {z}, and an axis has the length 1"))
}

fn not_covariance(name: &str, unit: &str, cells: [Option<f64>; 6]) -> Option<String> {
    let [Some(xx), Some(xy), Some(xz), Some(yy), Some(yz), Some(zz)] = cells else { return None };
    let largest = xx.abs().max(yy.abs()).max(zz.abs());
    // A variance along the axis is zero but for the rounding of the others.
    let error = |x: f64| rounding(x) + ROUNDING_SHARE * largest;
    let variances = [("xx", xx), ("yy", yy), ("zz", zz)];
    if let Some((place, v)) = variances.into_iter().find(|(_, v)| !(v.is_finite() && *v >= -error(*v))) {
        return Some(format!("{name}_{place}{unit} is {v}, and a variance is a number that is not negative"));
    }
    let pairs = [("xy", xy, xx, yy), ("xz", xz, xx, zz), ("yz", yz, yy, zz)];
    let is_possible = |c: f64, a: f64, b: f64| c.abs() - error(c) <= (a + error(a)).sqrt() * (b + error(b)).sqrt();
    let (place, c, ..) = pairs.into_iter().find(|(_, c, a, b)| !is_possible(*c, *a, *b))?;
    Some(format!("{name}_{place}{unit} is {c}, which is more than the variances beside it allow"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::status::Status;
    use hzn_mcap::RowMeta;

    fn row() -> Row {
        Row {
            status: Status::Ok,
            axis_x: Some(0.48),
            axis_y: Some(0.6),
            axis_z: Some(0.64),
            cov_xx: Some(2e-6),
            cov_xy: Some(-1e-6),
            cov_xz: Some(-5e-7),
            cov_yy: Some(1e-6),
            cov_yz: Some(-1e-7),
            cov_zz: Some(1e-6),
            p_limb: Some(0.9),
            ..Row::unprocessed(&RowMeta::default(), Status::Ok, "")
        }
    }

    #[test]
    fn impossible_numbers_are_named_by_their_column() {
        assert_eq!(find_impossible(&row()), None);
        let told = |change: fn(&mut Row)| {
            let mut row = row();
            change(&mut row);
            find_impossible(&row).unwrap_or_default()
        };
        for wrong in [1e308, f64::NAN, f64::INFINITY, 0.7, -1.0] {
            let row = Row { axis_x: Some(wrong), ..row() };
            assert!(
                find_impossible(&row).is_some_and(|what| what.starts_with("axis_x, axis_y, axis_z are")),
                "{wrong}"
            );
        }
        assert!(told(|row| row.cov_xx = Some(-1.0)).starts_with("cov_xx is -1,"));
        assert!(told(|row| row.cov_zz = Some(f64::NAN)).starts_with("cov_zz is NaN"));
        assert!(told(|row| row.cov_yz = Some(3e-6)).starts_with("cov_yz is 0.000003"));
        assert!(told(|row| row.p_limb = Some(2.0)).starts_with("p_limb is 2,"));
        assert!(told(|row| row.p_limb = Some(f64::NAN)).starts_with("p_limb is NaN"));
        // Only an answer has an axis.
        assert_eq!(told(|row| (row.axis_x, row.status) = (Some(9.0), Status::NoLimb)), "");
    }

    /// A program that writes fewer digits writes the same answers.
    #[test]
    fn rounded_numbers_are_possible() {
        for (places, is_single) in [3, 4, 6, 9, 17].into_iter().flat_map(|p| [(p, false), (p, true)]) {
            for step in 0..500 {
                let (sin, cos) = (f64::from(step) * 0.731).sin_cos();
                let (low, high) = (f64::from(step) * 0.0173).sin_cos();
                let write = |x: f64| {
                    let x = if is_single { f64::from(x as f32) } else { x };
                    format!("{x:.places$}").parse::<f64>().ok()
                };
                let [axis_x, axis_y, axis_z] = [high * cos, high * sin, low].map(write);
                let row = Row { axis_x, axis_y, axis_z, ..row() };
                assert_eq!(find_impossible(&row), None, "{places} digits");
            }
        }
    }
}
