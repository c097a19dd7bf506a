//! The place of a corner from a model of its brightness.
//!
//! Near a corner the brightness is c + g·p + A S(d₁/w) S(d₂/w), where p is the place relative to the corner, d₁ and d₂
//! are the distances from the two edges, S is a step of width w from −1 to 1, and g is a slope of the light. The edges
//! may be bent: d = n·p − ½ κ (t·p)². All eleven parameters are fitted to the pixels by the Levenberg-Marquardt method.
//! With the curvature κ the window may be large in pictures of a fisheye lens too; with few pixels the noise would move
//! the corner more.

use nalgebra::{SMatrix, SVector};

use super::grey::Grey;

/// Number of parameters: corner (2), directions (2) and curvatures (2) of the edges, c, A, g (2), w.
const N: usize = 11;
/// Length of a row of derivatives; a multiple of four, so that the compiler uses vector instructions.
const ROW: usize = 12;
type Row = [f32; ROW];
type Vector = SVector<f32, N>;
type Matrix = SMatrix<f32, N, N>;

/// Maximum number of steps, and the step of the corner in pixels at which they end. Each step is several times shorter
/// than the one before, so that the way that is left is far below the errors of a corner, 0.01 px at best.
const STEPS: usize = 25;
const END_PX: f32 = 2e-3;
/// Damping of the first step, and the largest one.
const FIRST_DAMPING: f32 = 1e-3;
const MAX_DAMPING: f32 = 1e3;

/// A fitted corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted {
    /// Place in the picture, px.
    pub(super) at: [f32; 2],
    /// RMS difference between the pixels and the model, in units of the brightness.
    pub(super) misfit: f32,
}

/// A pixel of the window: its place relative to the start, and its brightness.
type Pixel = ([f32; 2], f32);

/// Fits the model to the pixels within `radius` of `start`, whose edges have the directions `axes` (unit vectors). The
/// result is `None` if the window leaves the picture, the fit does not converge, or the corner moves by more than
/// `reach_px`.
pub(super) fn fit(picture: &Grey, start: [f32; 2], axes: [[f32; 2]; 2], radius: f32, reach_px: f32) -> Option<Fitted> {
    let pixels = window(picture, start, radius)?;
    let mut state = first_state(&pixels, axes)?;
    let (mut normal, mut right, mut cost) = equations(&pixels, &state);
    let mut damping = FIRST_DAMPING;
    for _ in 0..STEPS {
        let mut damped = normal;
        (0..N).for_each(|i| damped[(i, i)] *= 1.0 + damping);
        let step = damped.cholesky()?.solve(&right);
        let next = state + step;
        let is_possible = next[10] > 0.3 && next[10] < 2.0 * radius;
        let tried = is_possible.then(|| equations(&pixels, &next)).filter(|t| t.2 <= cost);
        match tried {
            Some(tried) => {
                state = next;
                (normal, right, cost) = tried;
                damping *= 0.1;
                if step[0].hypot(step[1]) < END_PX {
                    let is_near = state[0].hypot(state[1]) <= reach_px;
                    let at = [start[0] + state[0], start[1] + state[1]];
                    return is_near.then_some(Fitted { at, misfit: (cost / pixels.len() as f32).sqrt() });
                }
            }
            None => {
                damping *= 10.0;
                if damping > MAX_DAMPING {
                    return None;
                }
            }
        }
    }
    None
}

/// Returns the pixels of a disc; `None` if it leaves the picture.
fn window(picture: &Grey, [u, v]: [f32; 2], radius: f32) -> Option<Vec<Pixel>> {
    let (left, top) = ((u - radius).ceil(), (v - radius).ceil());
    let (right, bottom) = ((u + radius).floor(), (v + radius).floor());
    if left < 0.0 || top < 0.0 || right >= picture.width() as f32 || bottom >= picture.height() as f32 {
        return None;
    }
    let mut pixels = Vec::with_capacity((4.0 * radius * radius) as usize);
    for y in top as usize..=bottom as usize {
        for (x, value) in picture.row(y).iter().enumerate().take(right as usize + 1).skip(left as usize) {
            let p = [x as f32 - u, y as f32 - v];
            if p[0] * p[0] + p[1] * p[1] <= radius * radius {
                pixels.push((p, *value));
            }
        }
    }
    Some(pixels)
}

/// Returns the first guess: straight edges of one blur width, and brightness and contrast by least squares.
fn first_state(pixels: &[Pixel], axes: [[f32; 2]; 2]) -> Option<Vector> {
    let mut state = Vector::zeros();
    state[2] = axes[0][1].atan2(axes[0][0]);
    state[3] = axes[1][1].atan2(axes[1][0]);
    state[10] = 2.0;
    // With c = 0 and A = 1 the model is the step itself.
    state[7] = 1.0;
    let turns = turns(&state);
    let (mut n, mut m, mut mm, mut v, mut mv) = (0.0f32, 0.0f32, 0.0f32, 0.0f32, 0.0f32);
    for (p, value) in pixels {
        let model = evaluate(&state, &turns, *p).0;
        n += 1.0;
        m += model;
        mm += model * model;
        v += value;
        mv += model * value;
    }
    let det = n * mm - m * m;
    state[7] = (n * mv - m * v) / det;
    state[6] = (v - state[7] * m) / n;
    state.iter().all(|x| x.is_finite()).then_some(state)
}

/// Returns the normal equations and the sum of the squared residuals.
fn equations(pixels: &[Pixel], state: &Vector) -> (Matrix, Vector, f32) {
    let (mut normal, mut right, mut cost) = ([[0.0; ROW]; N], [0.0; ROW], 0.0);
    let mut plain = Plain::default();
    let turns = turns(state);
    for (p, value) in pixels {
        let local = [p[0] - state[0], p[1] - state[1]];
        let edges = [0, 1].map(|n| Edge::new(turns[n], state[4 + n], local));
        let width = state[10];
        if edges.iter().all(|edge| edge.distance.abs() >= width) {
            cost += plain.add(state, edges[0].distance * edges[1].distance, local, *value);
            continue;
        }
        let (model, by) = combine(state, &edges, local);
        let residual = value - model;
        cost += residual * residual;
        for (row, one) in normal.iter_mut().zip(by) {
            row.iter_mut().zip(by).for_each(|(sum, other)| *sum += one * other);
        }
        right.iter_mut().zip(by).for_each(|(sum, other)| *sum += other * residual);
    }
    let mut normal = Matrix::from_fn(|i, j| normal[i][j]);
    let mut right = Vector::from_fn(|i, _| right[i]);
    plain.add_to(state, &mut normal, &mut right);
    (normal, right, cost)
}

/// The sums over the pixels off both edges, which are the most. Their derivatives are four functions alone: 1 (c, and
/// the corner by the slope of the light), the sign of the square (A), and the place (g).
#[derive(Default)]
struct Plain {
    normal: SMatrix<f32, 4, 4>,
    right: SVector<f32, 4>,
}

impl Plain {
    /// Adds a pixel; `sign` is positive in the squares where the model has +A. Returns its squared residual.
    fn add(&mut self, state: &Vector, sign: f32, [x, y]: [f32; 2], value: f32) -> f32 {
        let sign = sign.signum();
        let residual = value - (state[6] + state[7] * sign + state[8] * x + state[9] * y);
        let by = SVector::<f32, 4>::new(1.0, sign, x, y);
        self.normal += by * by.transpose();
        self.right += by * residual;
        residual * residual
    }

    /// Adds the sums to the normal equations of all parameters.
    fn add_to(&self, state: &Vector, normal: &mut Matrix, right: &mut Vector) {
        let mut by = SMatrix::<f32, N, 4>::zeros();
        (by[(0, 0)], by[(1, 0)]) = (-state[8], -state[9]);
        (0..4).for_each(|k| by[(6 + k, k)] = 1.0);
        *normal += by * self.normal * by.transpose();
        *right += by * self.right;
    }
}

/// Returns sine and cosine of the directions of the edges.
fn turns(state: &Vector) -> [(f32, f32); 2] {
    [state[2].sin_cos(), state[3].sin_cos()]
}

/// The place of a pixel relative to an edge.
#[derive(Clone, Copy)]
struct Edge {
    turn: (f32, f32),
    bend: f32,
    /// Place along the straight edge and off it.
    along: f32,
    off: f32,
    /// Distance from the bent edge, px.
    distance: f32,
}

impl Edge {
    fn new(turn: (f32, f32), bend: f32, [x, y]: [f32; 2]) -> Self {
        let (sin, cos) = turn;
        let (along, off) = (cos * x + sin * y, cos * y - sin * x);
        Self { turn, bend, along, off, distance: off - 0.5 * bend * along * along }
    }

    /// Returns the step, and its derivatives by the corner (2), the direction, the curvature and the width.
    fn step(&self, width: f32) -> (f32, [f32; 5]) {
        let ((sin, cos), bend, along) = (self.turn, self.bend, self.along);
        let (s, slope) = step(self.distance / width);
        let by_d = slope / width;
        let by = [
            by_d * (sin + bend * along * cos),
            by_d * (bend * along * sin - cos),
            by_d * (-along - bend * along * self.off),
            by_d * (-0.5 * along * along),
            -by_d * self.distance / width,
        ];
        (s, by)
    }
}

/// Returns the model at a place relative to the start, and its derivatives.
fn evaluate(state: &Vector, turns: &[(f32, f32); 2], [x, y]: [f32; 2]) -> (f32, Row) {
    let local = [x - state[0], y - state[1]];
    combine(state, &[0, 1].map(|n| Edge::new(turns[n], state[4 + n], local)), local)
}

/// Returns the model at a place relative to the corner, and its derivatives.
fn combine(state: &Vector, edges: &[Edge; 2], [x, y]: [f32; 2]) -> (f32, Row) {
    let ((s1, by1), (s2, by2)) = (edges[0].step(state[10]), edges[1].step(state[10]));
    let contrast = state[7];
    let (a1, a2) = (contrast * s2, contrast * s1);
    let by = [
        a1 * by1[0] + a2 * by2[0] - state[8],
        a1 * by1[1] + a2 * by2[1] - state[9],
        a1 * by1[2],
        a2 * by2[2],
        a1 * by1[3],
        a2 * by2[3],
        1.0,
        s1 * s2,
        x,
        y,
        a1 * by1[4] + a2 * by2[4],
        0.0,
    ];
    (state[6] + state[8] * x + state[9] * y + contrast * s1 * s2, by)
}

/// A step from −1 to 1 between x = −1 and x = 1, with its slope: the edge of a square under a blur of finite width.
fn step(x: f32) -> (f32, f32) {
    if x.abs() >= 1.0 {
        return (x.signum(), 0.0);
    }
    (x * (1.5 - 0.5 * x * x), 1.5 * (1.0 - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> Vector {
        Vector::from_column_slice(&[0.2, -0.3, 0.4, 1.9, 0.03, -0.02, 90.0, 60.0, 0.5, -0.4, 1.9])
    }

    #[test]
    fn derivatives_are_those_of_the_model() {
        let state = state();
        for p in [[0.5, 0.9], [-1.0, 0.3], [2.0, -3.0], [-4.0, -1.0]] {
            let (model, by) = evaluate(&state, &turns(&state), p);
            let largest = by.iter().fold(0.0f32, |a, b| a.max(b.abs()));
            for n in 0..N {
                let mut moved = state;
                moved[n] += 1e-2;
                let difference = (evaluate(&moved, &turns(&moved), p).0 - model) / 1e-2;
                assert!((difference - by[n]).abs() < 0.03 * (1.0 + largest), "{p:?} {n}: {difference} {}", by[n]);
            }
        }
    }

    #[test]
    fn the_short_sums_off_the_edges_equal_the_long_ones() {
        let state = state();
        let pixels: Vec<Pixel> =
            (0..29 * 29).map(|n| ([(n % 29) as f32 - 14.0, (n / 29) as f32 - 14.0], (n % 7) as f32)).collect();
        let (normal, right, cost) = equations(&pixels, &state);
        let (mut long, mut long_right, mut long_cost) = (Matrix::zeros(), Vector::zeros(), 0.0);
        for (p, value) in &pixels {
            let (model, by) = evaluate(&state, &turns(&state), *p);
            let by = Vector::from_column_slice(&by[..N]);
            long += by * by.transpose();
            long_right += by * (value - model);
            long_cost += (value - model).powi(2);
        }
        assert!((normal - long).abs().max() < 1e-4 * long.abs().max());
        assert!((right - long_right).abs().max() < 1e-4 * long_right.abs().max());
        assert!((cost / long_cost - 1.0).abs() < 1e-4);
    }
}
