//! Finds the valid name that a misspelt name probably means.

use crate::rotations::{conversion, form};

/// Returns the candidate nearest to `name`; `None` if none is near enough to be a misspelling of it.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let scored = candidates.into_iter().map(|c| {
        let typo = strsim::damerau_levenshtein(&name, c);
        // `threshold` for `threshold_px`: a missing unit counts as one typing error.
        let cut = name.len() >= 3 && (c.starts_with(&name) || name.starts_with(c));
        (if cut { typo.min(1) } else { typo }, c)
    });
    scored.min_by_key(|(distance, _)| *distance).filter(|(distance, c)| *distance <= 1 + c.len() / 4).map(|(_, c)| c)
}

/// Returns `; did you mean x?`, what to do with a rotation that is written in another way, or the list of valid names.
pub fn suggestion(name: &str, valid: &[&str]) -> String {
    // Before the nearest name: whoever only renames a quaternion x, y, z, w gets another rotation.
    if let Some(conversion) = conversion(name, valid) {
        return format!("; {conversion}");
    }
    match (nearest(name, valid.iter().copied()), form(name, valid), valid) {
        (_, _, []) => String::new(),
        (Some(best), ..) => format!("; did you mean {best}?"),
        (None, Some(form), _) => format!("; {form}"),
        (None, None, _) => format!("; valid here: {}", valid.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_and_left_out_units_are_recognised() {
        let keys = ["method", "threshold_px", "seed", "max_draws"];
        assert_eq!(nearest("threshold_pxx", keys), Some("threshold_px"));
        assert_eq!(nearest("threshold", keys), Some("threshold_px"));
        assert_eq!(nearest("Metod", keys), Some("method"));
        assert_eq!(nearest("colour", keys), None);
    }

    #[test]
    fn rotations_in_another_order_or_form_get_their_conversion() {
        let mount = ["q_vehicle_from_camera_wxyz"];
        let cases = [
            ("q_vehicle_from_camera_xyzw", "the last number of yours becomes the first"),
            ("vehicle_from_camera", "its first number is w, the cosine of half the angle"),
            ("q_camera_to_vehicle", "its first number is w, the cosine of half the angle"),
            ("q_camera_from_vehicle_wxyz", "x, y and z of yours are negated"),
            ("q_camera_from_vehicle_xyzw", "the last number of yours becomes the first, and the others are negated"),
        ];
        for (name, what) in cases {
            assert_eq!(suggestion(name, &mount), format!("; write q_vehicle_from_camera_wxyz; {what}"));
        }
        assert!(
            suggestion("rotation_matrix", &mount).contains("from the axes of the camera into those of the vehicle")
        );
        // A slip in another key of the same table is a slip.
        assert_eq!(suggestion("rotaton_s", &["q_a_from_b_wxyz", "rotation_s"]), "; did you mean rotation_s?");
        assert_eq!(suggestion("colour", &mount), "; valid here: q_vehicle_from_camera_wxyz");
    }
}
