//! Rates about other axes than the camera's: the rotation that explains the turns of the answers.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Steps of the fit from each start; a step of Gauss and Newton halves the error at least.
const STEPS: usize = 12;
/// Step of a derivative, rad.
const STEP_RAD: f64 = 1e-5;
/// Most turns that are fitted.
const MOST: usize = 200;

/// The turn between two answers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// The axis of the limb before and after it, in the camera frame.
    pub(super) before: Vector3<f64>,
    pub(super) after: Vector3<f64>,
    /// The turn of a direction at rest by the told rates, rad.
    pub(super) told: Vector3<f64>,
}

impl Turn {
    /// Returns how far the axis is from where rates about turned axes, times a factor, put it, rad.
    pub(super) fn rest(&self, axes: &Rotation3<f64>, factor: f64) -> f64 {
        (Rotation3::new(axes * self.told * factor) * self.before).angle(&self.after)
    }
}

/// Returns the rotation of the rates that leaves least of the turns; `None` without turns.
pub(super) fn best_axes(turns: &[Turn]) -> Option<Rotation3<f64>> {
    // Some turns tell as much as those of a long flight.
    let some: Vec<Turn> = turns.iter().step_by(turns.len().div_ceil(MOST).max(1)).copied().collect();
    let turns = some.as_slice();
    let cost = |axes: &Rotation3<f64>| turns.iter().map(|turn| turn.rest(axes, 1.0).powi(2)).sum::<f64>();
    let fitted = starts().into_iter().filter_map(|start| fit(turns, start));
    fitted.min_by(|a, b| cost(a).total_cmp(&cost(b)))
}

/// Returns the 24 rotations that exchange axes.
fn starts() -> Vec<Rotation3<f64>> {
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];
    let signs = (0..8).map(|bits| [0, 1, 2].map(|i| if bits >> i & 1 == 1 { -1.0 } else { 1.0 }));
    let all = signs.flat_map(|sign| {
        orders.map(|order| Matrix3::from_fn(|row, column| if order[row] == column { sign[row] } else { 0.0 }))
    });
    all.filter(|m| m.determinant() > 0.0).map(Rotation3::from_matrix_unchecked).collect()
}

fn fit(turns: &[Turn], start: Rotation3<f64>) -> Option<Rotation3<f64>> {
    let mut axes = start;
    for _ in 0..STEPS {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for turn in turns {
            let by = |axes: &Rotation3<f64>| Rotation3::new(axes * turn.told) * turn.before;
            let here = by(&axes);
            let column = |axis: usize| {
                let mut small = Vector3::zeros();
                small[axis] = STEP_RAD;
                (by(&(Rotation3::new(small) * axes)) - here) / STEP_RAD
            };
            let jacobian = Matrix3::from_columns(&[column(0), column(1), column(2)]);
            normal += jacobian.transpose() * jacobian;
            right += jacobian.transpose() * (turn.after - here);
        }
        // Rates that never change leave the turn about themselves open.
        normal += Matrix3::identity() * (1e-6 * normal.trace()).max(f64::MIN_POSITIVE);
        axes = Rotation3::new(normal.cholesky()?.solve(&right)) * axes;
    }
    Some(UnitQuaternion::from_rotation_matrix(&axes).to_rotation_matrix())
}
