//! Whether the half-angles of all answers of a flight agree with what was told of altitude and lens.
//!
//! A picture alone compares its half-angle with the expected one, and an error of up to three sigmas is no surprise.
//! All pictures together say more, because most of these sigmas is the same error in all of them: one lens, one source
//! of altitudes. A wrong altitude and a wrong lens move the half-angles by amounts that depend on the place of the limb
//! in the picture, each in its own way. The difference of picture i is
//!
//! d_i = Σ_k g_ik ξ_k + e_i η + r_i + h_i x
//!
//! with the errors ξ_k of the lens as its covariance states them and the error η of altitude and limb height, each with
//! the 1-sigma 1; the rest r_i of the picture's own noise; and the fault x in question. Weighted least squares gives x.
//! Whether the rests of several pictures are alike is not known, so that the sigma of x is that of the worst case.

use hzn_core::Report;
use hzn_core::camera::{Camera, Config as CameraConfig, Intrinsic};
use hzn_files::FrameData;

use super::implied::{cos_change, fit_facts};
use crate::engine::trace::Edge;

/// What may be wrong with the values of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The altitude.
    Altitude,
    /// Both focal lengths, that is the field of view.
    FieldOfView,
    /// The ratio of the focal lengths, as in pictures that were scaled to another shape.
    Aspect,
}

impl Fault {
    /// All faults.
    pub const ALL: [Self; 3] = [Self::Altitude, Self::FieldOfView, Self::Aspect];
}

/// Step of the derivatives by the logarithm of a focal length.
const STEP: f64 = 0.01;
/// Steps of the derivatives by an error of the lens, in its sigmas, if those of one sigma to both sides are not
/// possible.
const STEPS: [f64; 4] = [1.0, -1.0, 0.1, -0.1];
/// Root mean square of the square of a normal number, √3. The sigmas of a guessed lens are so large that its errors
/// bend the half-angles: they also move them by their squares.
const RMS_OF_SQUARE: f64 = 1.732_050_807_568_877_2;
/// The part of the variance of a half-angle that is at least a picture's own.
const LEAST_OWN: f64 = 0.05;

/// What the half-angle of one answer says.
#[derive(Debug, Clone, PartialEq)]
pub struct Said {
    /// Cosine of the fitted half-angle, minus that of the expected one.
    pub difference: f64,
    /// Its 1-sigma from altitude and limb height.
    pub expected_sigma: f64,
    /// Its 1-sigma from all but the lens, altitude and limb height.
    pub own_sigma: f64,
    /// Its change by one sigma of each independent error of the lens, and by the square of that error.
    pub lens: Vec<f64>,
    /// Its change by one unit of each fault: 1 km, and 1 of the logarithm of a focal length or of their ratio.
    pub by_fault: [f64; Fault::ALL.len()],
}

impl Said {
    /// Returns what an answer says; `None` without an answer whose half-angle was fitted.
    pub fn of(report: &Report<f64>, edges: &[Edge], config: &CameraConfig, data: Option<&FrameData>) -> Option<Self> {
        let solution = report.solution.as_ref()?;
        let edge = edges.iter().find(|edge| edge.candidate == solution.candidate)?;
        let fitted = edge.fitted.as_ref()?;
        let free = fitted.solution.free?;
        let camera_of = |config: &CameraConfig| {
            let exact = CameraConfig { covariance: None, ..config.clone() };
            Some(Camera::<f64>::try_new(&exact).ok()?.with_rate(data.and_then(|d| d.rate_rad_s)))
        };
        let camera = camera_of(config)?;
        let by = |other: CameraConfig| cos_change(edge, free.axis.xyz(), &camera, &camera_of(&other)?);
        let is_lens = |mode: &Mode, step: f64| camera_of(&changed(config, mode, step)).is_some();
        let by_mode = |mode: Mode| {
            let at = |step: f64| by(changed(config, &mode, step));
            // Not every lens of one sigma is a lens. The same steps are possible in all pictures.
            if is_lens(&mode, 1.0) && is_lens(&mode, -1.0) {
                let (more, less) = (at(1.0)?, at(-1.0)?);
                return Some([0.5 * (more - less), RMS_OF_SQUARE * 0.5 * (more + less)]);
            }
            let step = STEPS.into_iter().find(|step| is_lens(&mode, *step))?;
            Some([at(step)? / step, 0.0])
        };
        let lens: Vec<[f64; 2]> = modes(config).into_iter().map(by_mode).collect::<Option<_>>()?;
        let lens = lens.concat();
        let scaled = |x: f64, y: f64| {
            let (fx_px, fy_px) = (config.fx_px * (x * STEP).exp(), config.fy_px * (y * STEP).exp());
            by(CameraConfig { fx_px, fy_px, ..config.clone() }).map(|change| change / STEP)
        };
        let altitude = fit_facts(edge, fitted, &camera, None, false)?.altitude_km?;
        let by_lens: f64 = lens.iter().step_by(2).map(|g| g * g).sum();
        Some(Self {
            difference: free.cos - fitted.expected_cos,
            expected_sigma: fitted.expected_sigma_cos,
            own_sigma: (free.var_cos - by_lens).max(LEAST_OWN * free.var_cos).sqrt(),
            lens,
            by_fault: [free.var_cos.sqrt() / altitude.sigma, scaled(1.0, 1.0)?, scaled(0.5, -0.5)?],
        })
    }
}

/// Independent errors of a lens, each of one sigma.
type Mode = Vec<(Intrinsic, f64)>;

/// Returns the errors of a lens that its covariance or its two sigmas state: the columns of the triangular root of the
/// covariance.
fn modes(config: &CameraConfig) -> Vec<Mode> {
    let Some(given) = &config.covariance else {
        let focal = 0.01 * config.focal_sigma_percent;
        return vec![
            vec![(Intrinsic::FxPx, focal * config.fx_px), (Intrinsic::FyPx, focal * config.fy_px)],
            vec![(Intrinsic::CxPx, config.centre_sigma_px)],
            vec![(Intrinsic::CyPx, config.centre_sigma_px)],
        ];
    };
    let rows: Vec<Vec<f64>> = given.rows.iter().map(|row| row.to_vec()).collect();
    let name = |column: Vec<f64>| given.order.iter().copied().zip(column).collect();
    root(&rows).into_iter().map(name).collect()
}

/// Returns the columns of the triangular root of a positive semidefinite matrix.
fn root(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let at = |i: usize, j: usize| rows.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0);
    let mut columns: Vec<Vec<f64>> = Vec::with_capacity(rows.len());
    for j in 0..rows.len() {
        let of = |column: &[f64], i: usize| column.get(i).copied().unwrap_or(0.0);
        let before = |i: usize| columns.iter().map(|c| of(c, i) * of(c, j)).sum::<f64>();
        let pivot = at(j, j) - before(j);
        let scale = if pivot > 1e-12 * at(j, j) { pivot.sqrt().recip() } else { 0.0 };
        columns.push((0..rows.len()).map(|i| if i < j { 0.0 } else { (at(i, j) - before(i)) * scale }).collect());
    }
    columns
}

/// Returns the lens with an error of `step` sigmas.
fn changed(config: &CameraConfig, mode: &Mode, step: f64) -> CameraConfig {
    let mut changed = config.clone();
    for (which, by) in mode {
        if let Some(value) = config.intrinsic(*which) {
            changed.set_intrinsic(*which, value + step * by);
        }
    }
    changed
}

/// A fault that explains the half-angles of all answers better than their sigmas do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// The fault.
    pub fault: Fault,
    /// Its size: km to add to the altitudes, or the logarithm of the factor of the focal lengths or of fx/fy.
    pub size: f64,
    /// Its size over its 1-sigma, without sign.
    pub sigmas: f64,
}

/// Fewest answers that contradict anything together.
const ENOUGH: usize = 3;
/// Size of a fault in its sigmas that is a contradiction. In at most 1 % of the right flights one of three normal
/// numbers is beyond it.
const LIMIT: f64 = 2.94;

/// Returns the faults that the answers of a flight show, the most certain first.
pub fn contradictions(said: &[Said]) -> Vec<Contradiction> {
    if said.len() < ENOUGH {
        return Vec::new();
    }
    let one = |(i, fault): (usize, Fault)| {
        let (size, sigmas) =
            size_of_fault(said, &said.iter().map(|s| s.by_fault.get(i).copied()).collect::<Option<Vec<_>>>()?)?;
        // A lens that is larger by x moves the fitted half-angle, not the expected one.
        let size = if fault == Fault::Altitude { size } else { -size };
        Some(Contradiction { fault, size, sigmas }).filter(|found| found.sigmas > LIMIT)
    };
    let mut found: Vec<Contradiction> = Fault::ALL.into_iter().enumerate().filter_map(one).collect();
    found.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
    found
}

/// Returns the size of a fault that changes the differences by `by`, and its distance from zero in its sigmas.
fn size_of_fault(said: &[Said], by: &[f64]) -> Option<(f64, f64)> {
    let shared = |a: &Said, b: &Said| {
        a.lens.iter().zip(&b.lens).map(|(x, y)| x * y).sum::<f64>() + a.expected_sigma * b.expected_sigma
    };
    let row = |(i, a): (usize, &Said)| {
        let own = |j: usize| if i == j { a.own_sigma.powi(2) } else { 0.0 };
        said.iter().enumerate().map(|(j, b)| shared(a, b) + own(j)).collect::<Vec<f64>>()
    };
    let covariance: Vec<Vec<f64>> = said.iter().enumerate().map(row).collect();
    let weights = solve(&root(&covariance), by)?;
    let sum = |values: &mut dyn Iterator<Item = f64>| values.zip(&weights).map(|(value, w)| value * w).sum::<f64>();
    let difference = sum(&mut said.iter().map(|s| s.difference));
    let modes = said.iter().map(|s| s.lens.len()).min()?;
    let lens: f64 = (0..modes).map(|k| sum(&mut said.iter().filter_map(|s| s.lens.get(k).copied())).powi(2)).sum();
    let expected = sum(&mut said.iter().map(|s| s.expected_sigma)).powi(2);
    // In the worst case, the rests of all pictures are one error.
    let own: f64 = said.iter().zip(&weights).map(|(s, w)| (w * s.own_sigma).abs()).sum();
    let sigma = (lens + expected + own * own).sqrt();
    let size = difference / sum(&mut by.iter().copied());
    (size.is_finite() && sigma > 0.0).then_some((size, difference.abs() / sigma))
}

/// Solves L Lᵀ x = b. `columns` are those of the triangular L; `None` if it is singular.
fn solve(columns: &[Vec<f64>], b: &[f64]) -> Option<Vec<f64>> {
    let mut x = b.to_vec();
    for (j, column) in columns.iter().enumerate() {
        let value = *x.get(j)? / column.get(j).filter(|pivot| **pivot > 0.0)?;
        *x.get_mut(j)? = value;
        for (x, l) in x.iter_mut().zip(column).skip(j + 1) {
            *x -= l * value;
        }
    }
    for (j, column) in columns.iter().enumerate().rev() {
        let after: f64 = x.iter().zip(column).skip(j + 1).map(|(x, l)| x * l).sum();
        let value = (x.get(j)? - after) / column.get(j)?;
        *x.get_mut(j)? = value;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal numbers from a fixed seed.
    struct Normal(u64);

    impl Normal {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
        fn draw(&mut self) -> f64 {
            (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
        }
    }

    /// Returns the answers of a flight with errors drawn from their sigmas. `alike` is the part of each picture's own
    /// error that is the same in all of them; `km` is the error of the altitude. The limb is above and below the
    /// middle of the picture by turns, as the lens has it.
    fn flight(normal: &mut Normal, pictures: usize, alike: f64, km: f64) -> Vec<Said> {
        let errors: [f64; 4] = std::array::from_fn(|_| normal.draw());
        let one = |i: usize| {
            let side = if i.is_multiple_of(2) { 1.0 } else { -0.7 } * (1.0 + 0.1 * (i % 5) as f64);
            let (lens, expected_sigma) = (vec![0.02 * side, 0.008 * side * side], 0.004);
            let (own_sigma, by_km) = (0.004 + 0.003 * (i % 3) as f64, 2.7e-4);
            let own = alike.sqrt() * errors[3] + (1.0 - alike).sqrt() * normal.draw();
            let difference = lens[0] * errors[0] + lens[1] * errors[1] + expected_sigma * errors[2] + own_sigma * own;
            let by_fault = [by_km, 0.3, if i % 4 < 2 { 0.4 } else { -0.3 }];
            Said { difference: difference + by_km * km, expected_sigma, own_sigma, lens, by_fault }
        };
        (0..pictures).map(one).collect()
    }

    #[test]
    fn a_wrong_altitude_is_found_and_right_flights_are_kept() {
        let mut normal = Normal(7);
        for (pictures, alike) in [(3, 0.0), (8, 0.0), (8, 1.0), (30, 0.0), (30, 0.97)] {
            let doubted = |normal: &mut Normal, km: f64| {
                let flights = (0..400).map(|_| contradictions(&flight(normal, pictures, alike, km)));
                flights.filter(|found| !found.is_empty()).count()
            };
            let (right, wrong) = (doubted(&mut normal, 0.0), doubted(&mut normal, 200.0));
            assert!(right <= 4, "{right} right flights of {pictures} pictures, {alike}");
            assert!(pictures < 8 || wrong >= 300, "{wrong} wrong flights of {pictures} pictures, {alike}");
        }
        let found = contradictions(&flight(&mut normal, 20, 0.5, 200.0));
        let altitude = found.iter().find(|found| found.fault == Fault::Altitude).unwrap();
        assert!((altitude.size - 200.0).abs() < 80.0, "{found:?}");
    }

    #[test]
    fn a_root_gives_its_matrix_and_solves_it() {
        let matrix = [[4.0, 2.0, 2.0], [2.0, 5.0, 3.0], [2.0, 3.0, 6.0]].map(Vec::from);
        let columns = root(&matrix);
        for (i, row) in matrix.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let again: f64 = columns.iter().map(|c| c[i] * c[j]).sum();
                assert!((again - value).abs() < 1e-12);
            }
        }
        let x = solve(&columns, &[8.0, 10.0, 11.0]).unwrap();
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12), "{x:?}");
        // Equal errors of both focal lengths are one error.
        let equal = root(&[[9.0, 9.0], [9.0, 9.0]].map(Vec::from));
        assert_eq!(equal, [[3.0, 3.0], [0.0, 0.0]]);
    }
}
