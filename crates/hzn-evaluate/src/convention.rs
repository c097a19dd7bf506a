//! A truth in another convention than that of the answers: its errors are large and all alike.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};

use crate::case::Case;

/// Errors are looked at if their median is larger than this many of their sigmas.
pub(crate) const LARGE_SIGMAS: f64 = 3.0;
/// A convention explains the errors if it makes their median smaller by this factor.
pub(crate) const SMALLER: f64 = 5.0;
/// Fewest answers: a rotation has three unknowns, and each answer gives two numbers.
pub(crate) const MIN_ANSWERS: usize = 3;

/// Returns what would make the truth of each body fit its answers, as warnings; none for bodies whose errors are not
/// large, or are not explained by anything simple.
pub fn describe_conventions(cases: &[Case]) -> Vec<String> {
    let bodies: BTreeSet<&str> = cases.iter().map(|case| case.body.as_str()).collect();
    let one = |body: &str| {
        let own: Vec<&Case> = cases.iter().filter(|case| case.body == body).collect();
        Some(format!("{body}: the errors are as if {}", find_convention(&own)?))
    };
    bodies.into_iter().filter_map(one).collect()
}

/// Returns what makes the truth of one body fit the answers, as the end of the sentence "the errors are as if". `None`
/// if the errors are not large, or if nothing simple explains them. `cases` are in the order of the truth.
fn find_convention(cases: &[&Case]) -> Option<String> {
    let pairs: Vec<Pair> = cases.iter().filter_map(|case| Pair::new(case)).collect();
    if pairs.len() < MIN_ANSWERS {
        return None;
    }
    let before = median(pairs.iter().map(|p| angle(&p.answer, &p.truth)));
    let sigma = median(pairs.iter().map(|p| p.sigma_rad));
    if before <= LARGE_SIGMAS * sigma || before == 0.0 {
        return None;
    }
    let explains = |after: f64| after * SMALLER < before && after <= (LARGE_SIGMAS * sigma).max(before / 20.0);
    let told = |what: String, after: f64| {
        let [before, after] = [before, after].map(f64::to_degrees);
        format!("{what}: then their median is {after:.3} deg instead of {before:.3} deg")
    };
    let with = |m: &Matrix3<f64>| median(pairs.iter().map(|p| angle(&p.answer, &(m * p.truth))));
    let mut conventions: Vec<(f64, Axes)> = Axes::all().map(|axes| (with(&axes.matrix()), axes)).collect();
    // Of conventions that explain the same, the one with the fewest changes comes first.
    conventions.sort_by_key(|(_, axes)| axes.changes());
    if let Some((after, axes)) = conventions.into_iter().find(|(after, _)| explains(*after)) {
        return Some(told(axes.describe(), after));
    }
    for (step, what) in [(1, "next"), (-1, "previous")] {
        let after = shifted(cases, step);
        if let Some(after) = after.filter(|after| explains(*after)) {
            return Some(told(format!("each row of the truth belonged to the {what} picture"), after));
        }
    }
    let turn = rotation_between(pairs.iter().map(|p| (p.answer, p.truth)))?;
    let after = with(&turn);
    let (about, angle_rad) = axis_and_angle(&turn)?;
    let angle_deg = angle_rad.to_degrees();
    // The sum with 0 makes a negative zero positive.
    let [x, y, z] = <[f64; 3]>::from(about).map(|x| (100.0 * x).round() / 100.0 + 0.0);
    explains(after).then(|| {
        let what = format!(
            "the truth were turned by {angle_deg:.2} deg about the camera's axis ({x:.2}, {y:.2}, {z:.2}), in all \
             pictures alike (a mount, the principal point, or axes of another camera)"
        );
        told(what, after)
    })
}

/// An answer with its truth.
struct Pair {
    answer: Vector3<f64>,
    truth: Vector3<f64>,
    sigma_rad: f64,
}

impl Pair {
    fn new(case: &Case) -> Option<Self> {
        let miss = case.miss.filter(|_| case.limb)?;
        let unit = |v: [f64; 3]| Vector3::from(v).try_normalize(1e-12);
        let (answer, truth) = (unit(miss.found.axis)?, unit(case.truth_axis)?);
        Some(Self { answer, truth, sigma_rad: miss.sigma_max_deg.to_radians() })
    }
}

/// Returns the median error, if the truth of each picture belonged to the picture `step` later.
fn shifted(cases: &[&Case], step: isize) -> Option<f64> {
    let other = |i: usize| cases.get(i.checked_add_signed(-step)?);
    let both = |(i, case): (usize, &&Case)| Some(angle(&Pair::new(case)?.answer, &Vector3::from(other(i)?.truth_axis)));
    let errors: Vec<f64> = cases.iter().enumerate().filter_map(both).collect();
    (errors.len() >= MIN_ANSWERS).then(|| median(errors.into_iter()))
}

/// Returns axis and angle of a rotation, rad; `None` for one by nothing or by half a turn.
pub(crate) fn axis_and_angle(turn: &Matrix3<f64>) -> Option<(Vector3<f64>, f64)> {
    let about = Vector3::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]);
    Some((about.try_normalize(1e-12)?, ((turn.trace() - 1.0) / 2.0).clamp(-1.0, 1.0).acos()))
}

/// Returns the rotation to the first directions of pairs from the second ones with the least squared errors (Wahba's
/// problem, by singular values).
pub(crate) fn rotation_between(pairs: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>) -> Option<Matrix3<f64>> {
    let attitude_profile: Matrix3<f64> = pairs.map(|(to, from)| to * from.transpose()).sum();
    let svd = attitude_profile.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u.determinant() * v_t.determinant()).signum();
    // The singular values are sorted, so that the last direction is the one that is known least.
    Some(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t)
}

/// Other axes: the truth's axes in another order and with other signs.
struct Axes {
    order: [usize; 3],
    signs: [f64; 3],
}

const NAMES: [&str; 3] = ["x", "y", "z"];

impl Axes {
    /// Returns all but the camera's own.
    fn all() -> impl Iterator<Item = Self> {
        let orders = [[0, 1, 2], [1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]];
        let sign = |bits: usize, which: usize| if bits >> which & 1 == 1 { -1.0 } else { 1.0 };
        let each = move |order| (0..8).map(move |bits| Self { order, signs: [0, 1, 2].map(|i| sign(bits, i)) });
        orders.into_iter().flat_map(each).filter(|axes| axes.changes() > 0)
    }
    /// Returns how unusual the axes are; the opposite sign of all is a single mistake.
    fn changes(&self) -> usize {
        let negative = self.signs.iter().filter(|sign| **sign < 0.0).count();
        let moved = self.order.iter().enumerate().filter(|(i, from)| i != *from).count();
        2 * moved + if negative == 3 { 1 } else { negative }
    }
    fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| if self.order[row] == column { self.signs[row] } else { 0.0 })
    }
    fn describe(&self) -> String {
        let name = |i: usize| format!("{}{}", if self.signs[i] < 0.0 { "-" } else { "" }, NAMES[self.order[i]]);
        let names = [0, 1, 2].map(name).join(", ");
        let camera = "the camera's x points to the right, y down, and z forward";
        let is_in_order = self.order == [0, 1, 2];
        match self.signs.iter().filter(|sign| **sign < 0.0).count() {
            3 if is_in_order => "the truth had the opposite sign (it points away from the body)".to_owned(),
            1 if is_in_order => {
                let which = self.signs.iter().position(|sign| *sign < 0.0).and_then(|i| NAMES.get(i)).unwrap_or(&"");
                format!("the {which} axis of the truth were mirrored ({camera})")
            }
            _ => format!("the axes of the truth were others, ({names}) in the camera's order ({camera})"),
        }
    }
}

pub(crate) fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use hzn_files::truth::Truth;

    use super::*;
    use crate::{Answer, MeasuredDirection, pair};

    /// Returns what is said about answers with a sigma of 0.1 degrees, if the truth is changed so.
    fn said(change: impl Fn(usize, Vector3<f64>) -> Vector3<f64>) -> Option<String> {
        let axis = |i: usize| Vector3::new(0.3 * (i as f64).sin(), 0.8, 0.3 + 0.05 * i as f64).normalize();
        let noisy = |i: usize| (axis(i) + Vector3::new(1e-3 * (7.0 * i as f64).cos(), 0.0, 1e-3)).normalize();
        let mut truth = Vec::new();
        let mut answers = Vec::new();
        for i in 0..8 {
            let file = format!("{i}.png");
            let [axis_x, axis_y, axis_z] = change(i, axis(i)).into();
            let body = "earth".to_owned();
            let half_angle_deg = 70.0;
            let row = Truth {
                file: file.clone(),
                body: body.clone(),
                limb: 1,
                axis_x,
                axis_y,
                axis_z,
                half_angle_deg,
                ..Truth::default()
            };
            truth.push(row);
            let found = Some(MeasuredDirection {
                axis: noisy(i).into(),
                covariance_rad2: [3e-6, 0.0, 0.0, 3e-6, 0.0, 3e-6],
                common_rad2: None,
                half_angle_deg: None,
                protection_deg: None,
            });
            answers.push(Answer { file, body, status: hzn_core::status::Status::Ok, found, position: None });
        }
        let cases = pair(&answers, &truth, None).unwrap();
        find_convention(&cases.iter().collect::<Vec<_>>())
    }

    #[test]
    fn other_conventions_are_named() {
        assert_eq!(said(|_, v| v), None);
        assert!(said(|_, v| -v).unwrap().starts_with("the truth had the opposite sign"));
        assert!(
            said(|_, v| Vector3::new(v.x, -v.y, v.z)).unwrap().starts_with("the y axis of the truth were mirrored")
        );
        let swapped = said(|_, v| Vector3::new(v.z, v.x, v.y)).unwrap();
        assert!(swapped.contains("(y, z, x) in the camera's order"), "{swapped}");
        let turned = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 0.3);
        let turned = said(move |_, v| turned.inverse() * v).unwrap();
        assert!(turned.contains("turned by 17.") && turned.contains("(0.00, 0.00, 1.00)"), "{turned}");
        // Errors of any other kind have no simple cause.
        assert_eq!(
            said(|i, v| (v + Vector3::new((5.0 * i as f64).sin(), (3.0 * i as f64).cos(), 0.0)).normalize()),
            None
        );
    }

    #[test]
    fn a_truth_that_is_shifted_by_a_picture_is_named() {
        let axis = |i: usize| Vector3::new(0.3 * (i as f64).sin(), 0.8, 0.3 + 0.05 * i as f64).normalize();
        assert!(said(|i, _| axis(i + 1)).unwrap().contains("belonged to the next picture"));
        assert!(said(|i, _| axis(i.saturating_sub(1))).unwrap().contains("belonged to the previous picture"));
    }
}
