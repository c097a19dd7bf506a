//! Whether two of altitude, focal length and limb height are wrong at once.
//!
//! One wrong value gives the same correction in every picture. With two wrong values no single correction fits, but a
//! pair of corrections does: the difference of the half-angles of picture i is Σ s_ik x_k, where s_ik says by how much
//! one unit of the correction x_k changes it. Weighted least squares over all pictures gives the corrections. The
//! weights fall with the residual (least absolute deviations by iteration), because some fits may be of clouds.
//!
//! A half-angle α is no line over the altitude H: sin α = (R + h)/(R + H) for a limb at the height h. The altitude that
//! one picture implies alone is far from the right one if a focal length is wrong, too, so that a slope through it is
//! wrong. Each solution therefore gives new slopes, up to its own corrections.

use super::facts::{FitFacts, Suspect};

/// A value to correct.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remedy {
    /// The quantity.
    pub suspect: Suspect,
    /// The correction: a shift in km, or a factor of the focal lengths.
    pub correction: f64,
    /// 1-sigma of the correction, in its unit.
    pub sigma: f64,
}

/// Two values that together explain the half-angles of all pictures, where no single one does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The corrections.
    pub remedies: [Remedy; 2],
    /// Correlation of the corrections, -1 to 1.
    pub correlation: f64,
    /// Number of pictures.
    pub pictures: usize,
}

impl Pair {
    /// Returns whether the pictures tell the two values apart. Otherwise many pairs of corrections are equally good.
    pub fn is_told_apart(&self) -> bool {
        self.correlation.abs() <= MOST_CORRELATION
    }
}

/// Fewest pictures for a pair. With fewer, the scatter of the limb itself often looks like a second wrong value: in one
/// of ten flights of four pictures.
const ENOUGH: usize = 8;
/// A pair has to lower χ² by as much as one unknown more does by chance with this many sigmas.
const LEAST_SIGMAS: f64 = 3.0;
/// The scatter about the best single value has to be this many times that about the pair. Below, the limb itself, which
/// is not equally high everywhere, may be the reason.
const LEAST_RATIO: f64 = 1.5;
/// Corrections that are more correlated than this cannot be told apart: the sigma of each is three times as large as if
/// the other one were known.
pub const MOST_CORRELATION: f64 = 0.95;
/// A residual counts at most as much as one of this many sigmas.
const MOST_SIGMAS: f64 = 5.0;
const ITERATIONS: usize = 10;

/// Returns the improvement of χ² that is as improbable as [`LEAST_SIGMAS`], if the scatter comes from residuals with
/// this many degrees of freedom: the square of Student's t, by its series in 1/ν (Abramowitz and Stegun, 26.7.5).
fn least_gain(freedom: usize) -> f64 {
    let (z, nu) = (LEAST_SIGMAS, freedom.max(1) as f64);
    let first = (z.powi(3) + z) / (4.0 * nu);
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * nu * nu);
    (z + first + second).powi(2)
}

/// Number of times that the slopes are taken again at the corrections of the last solution.
const RENEWALS: usize = 4;
/// Smallest correction that a slope is taken over, km. Below, the curve is a line.
const LEAST_KM: f64 = 0.1;

/// The half-angle of one picture over the altitude and the limb height.
#[derive(Debug, Clone, Copy)]
struct Curve {
    /// Distances of limb and camera from the centre of the body as the picture was processed, km.
    limb_km: f64,
    camera_km: f64,
}

impl Curve {
    /// Returns the curve through the expected half-angle at the given altitude and the fitted one at the altitude that
    /// it implies, which say the radius of the body.
    fn new(facts: &FitFacts) -> Option<Self> {
        let [expected, fitted] = [facts.expected_deg, facts.fitted_deg].map(|deg| deg.to_radians().sin());
        let (given_km, implied_km) = (facts.given_altitude_km?, facts.altitude_km?.value);
        let radius_km = (fitted * implied_km - expected * given_km) / (expected - fitted);
        let camera_km = radius_km + given_km;
        (radius_km.is_finite() && radius_km > 0.0).then_some(Self { limb_km: expected * camera_km, camera_km })
    }

    /// Returns the slopes over the altitude and the limb height up to these corrections, in degrees per km. Their sum
    /// over both corrections is the change of the half-angle.
    fn slopes(&self, [altitude_km, limb_km]: [f64; 2]) -> Option<[f64; 2]> {
        let far = |km: f64| if km.abs() < LEAST_KM { LEAST_KM } else { km };
        let (by_altitude, by_limb) = (far(altitude_km), far(limb_km));
        let deg = |up: f64, limb: f64| ((self.limb_km + limb) / (self.camera_km + up)).asin().to_degrees();
        let higher = deg(by_altitude, 0.0);
        let slopes =
            [(higher - deg(0.0, 0.0)) / by_altitude, (deg(altitude_km, by_limb) - deg(altitude_km, 0.0)) / by_limb];
        slopes.iter().all(|slope| slope.is_finite()).then_some(slopes)
    }
}

/// The difference of the half-angles of one picture over its 1-sigma, and its change by one unit of each correction.
#[derive(Debug, Clone)]
struct Equation {
    difference: f64,
    slopes: [f64; 3],
    sigma_deg: f64,
    curve: Option<Curve>,
}

impl Equation {
    /// Returns the equation of a picture. `limb_height_km` is the limb height that it was processed with.
    fn new(facts: &FitFacts, limb_height_km: f64) -> Option<Self> {
        let sigma = facts.fitted_sigma_deg;
        let difference = (facts.fitted_deg - facts.expected_deg) / sigma;
        let slope = |suspect: Suspect| {
            let implied = facts.implied(suspect)?;
            let [correction, sigma] = match suspect {
                Suspect::Altitude => [implied.value, implied.sigma],
                Suspect::Focal => [implied.value.ln(), implied.sigma / implied.value],
                Suspect::LimbHeight => [implied.value - limb_height_km, implied.sigma],
            };
            // The correction alone makes the difference zero. In the noise, only its sigma says something.
            let size = if correction.abs() > 2.0 * sigma { (difference / correction).abs() } else { 1.0 / sigma };
            let sign = match suspect {
                // From higher up, the body is smaller.
                Suspect::Altitude => -1.0,
                Suspect::LimbHeight => 1.0,
                // The sign depends on the place of the limb in the picture.
                Suspect::Focal => (difference * correction).signum(),
            };
            Some(sign * size).filter(|s| s.is_finite())
        };
        let [altitude, focal, limb] = Suspect::ALL.map(slope);
        let slopes = [altitude?, focal?, limb?];
        let curve = Curve::new(facts);
        difference.is_finite().then_some(Self { difference, slopes, sigma_deg: sigma, curve })
    }

    /// Returns the equation with the slopes up to these corrections of altitude and limb height, in km.
    fn renewed(&self, corrections_km: [f64; 2]) -> Self {
        let [altitude, focal, limb] = self.slopes;
        let of_curve = self.curve.and_then(|curve| curve.slopes(corrections_km));
        let slopes = of_curve.map_or([altitude, focal, limb], |[altitude, limb]| {
            [altitude / self.sigma_deg, focal, limb / self.sigma_deg]
        });
        Self { slopes, ..self.clone() }
    }
}

/// The best corrections of one or two quantities.
struct Solved {
    corrections: [f64; 2],
    /// Inverse of the normal matrix: variances and covariance for a scatter of 1.
    inverse: [[f64; 2]; 2],
    residuals: Vec<f64>,
}

impl Solved {
    /// Solves for the quantities `which`; two equal ones are one.
    fn new(equations: &[Equation], which: [usize; 2]) -> Option<Self> {
        let mut solved = Self::on_lines(equations, which)?;
        for _ in 0..RENEWALS {
            let of = |suspect: Suspect| {
                let place = which.iter().position(|k| Suspect::ALL.get(*k) == Some(&suspect));
                place.map_or(0.0, |i| solved.corrections[i])
            };
            let corrections_km = [of(Suspect::Altitude), of(Suspect::LimbHeight)];
            let renewed: Vec<Equation> = equations.iter().map(|e| e.renewed(corrections_km)).collect();
            solved = Self::on_lines(&renewed, which)?;
        }
        Some(solved)
    }

    /// Solves with the slopes of the equations.
    fn on_lines(equations: &[Equation], which: [usize; 2]) -> Option<Self> {
        let single = which[0] == which[1];
        let mut weights = vec![1.0; equations.len()];
        let (mut x, mut inverse, mut residuals) = ([0.0; 2], [[0.0; 2]; 2], Vec::new());
        for _ in 0..ITERATIONS {
            let (mut n, mut b) = ([[0.0; 2]; 2], [0.0; 2]);
            for (e, w) in equations.iter().zip(&weights) {
                let row = [e.slopes[which[0]], if single { 0.0 } else { e.slopes[which[1]] }];
                for i in 0..2 {
                    b[i] += w * row[i] * e.difference;
                    for j in 0..2 {
                        n[i][j] += w * row[i] * row[j];
                    }
                }
            }
            if single {
                n[1][1] = 1.0;
            }
            let determinant = n[0][0] * n[1][1] - n[0][1] * n[1][0];
            if !(determinant > 1e-12 * n[0][0] * n[1][1]) {
                return None;
            }
            inverse =
                [[n[1][1] / determinant, -n[0][1] / determinant], [-n[1][0] / determinant, n[0][0] / determinant]];
            x = [0, 1].map(|i| inverse[i][0] * b[0] + inverse[i][1] * b[1]);
            let of = |e: &Equation| {
                let second = if single { 0.0 } else { e.slopes[which[1]] * x[1] };
                e.difference - e.slopes[which[0]] * x[0] - second
            };
            residuals = equations.iter().map(of).collect();
            weights = residuals.iter().map(|r| 1.0 / r.abs().max(1.0)).collect();
        }
        Some(Self { corrections: x, inverse, residuals })
    }

    /// Returns the scatter of the residuals as a 1-sigma, at least that of the edge noise. The residuals are smaller
    /// than the errors by what the unknowns took.
    fn scatter(&self, unknowns: usize) -> f64 {
        let mut sizes: Vec<f64> = self.residuals.iter().map(|r| r.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let freedom = sizes.len().saturating_sub(unknowns).max(1) as f64 / sizes.len().max(1) as f64;
        sizes.get(sizes.len() / 2).map_or(1.0, |median| (1.4826 * median / freedom.sqrt()).max(1.0))
    }

    fn chi2(&self, scatter: f64) -> f64 {
        self.residuals.iter().map(|r| (r / scatter).abs().min(MOST_SIGMAS).powi(2)).sum()
    }

    fn correlation(&self) -> f64 {
        self.inverse[0][1] / (self.inverse[0][0] * self.inverse[1][1]).sqrt()
    }
}

/// The quantities of a solution, as places in [`Suspect::ALL`], and the solution.
type Of = ([usize; 2], Solved);

/// Returns the two values that are wrong, if two of them explain the half-angles of all pictures and no single one
/// does. `limb_height_km` is the limb height that the pictures were processed with, and its 1-sigma: a limb height more
/// than three sigmas away is no explanation. If the pictures do not tell the two values apart
/// ([`Pair::is_told_apart`]), the corrections say nothing one by one.
pub fn find_pair<'a>(facts: impl Iterator<Item = &'a FitFacts>, limb_height_km: [f64; 2]) -> Option<Pair> {
    let [limb_height_km, limb_sigma_km] = limb_height_km;
    let equations: Vec<Equation> = facts.filter_map(|f| Equation::new(f, limb_height_km)).collect();
    if equations.len() < ENOUGH {
        return None;
    }
    let is_possible = |which: [usize; 2], solved: &Solved| {
        which.into_iter().zip(solved.corrections).all(|(k, km)| !is_limb(k) || km.abs() <= 3.0 * limb_sigma_km)
    };
    let solve = |which: [usize; 2]| {
        let solved = Solved::new(&equations, which).filter(|solved| is_possible(which, solved))?;
        Some((which, solved))
    };
    let singles: Vec<Of> = [[0, 0], [1, 1], [2, 2]].into_iter().filter_map(solve).collect();
    let pairs = [[0, 1], [1, 2], [0, 2]].into_iter().filter_map(solve);
    let (apart, alike): (Vec<Of>, Vec<Of>) =
        pairs.partition(|(_, solved)| solved.correlation().abs() <= MOST_CORRELATION);
    let found = [apart, alike].map(|pairs| explain_alone(pairs, &singles, limb_sigma_km));
    let (which, pair) = match found {
        // Values that the pictures tell apart give way only if they explain less.
        [Some(apart), Some(alike)] => {
            let scatter = alike.1.scatter(2);
            let gain = apart.1.chi2(scatter) - alike.1.chi2(scatter);
            if gain > least_gain(equations.len() - 2) { alike } else { apart }
        }
        [apart, alike] => apart.or(alike)?,
    };
    let scatter = pair.scatter(2);
    let remedy = |i: usize| {
        let suspect = *Suspect::ALL.get(which[i])?;
        let (x, sigma) = (pair.corrections[i], scatter * pair.inverse[i][i].sqrt());
        let (correction, sigma) = if suspect == Suspect::Focal { (x.exp(), sigma * x.exp()) } else { (x, sigma) };
        Some(Remedy { suspect, correction, sigma })
    };
    Some(Pair { remedies: [remedy(0)?, remedy(1)?], correlation: pair.correlation(), pictures: equations.len() })
}

fn is_limb(k: usize) -> bool {
    Suspect::ALL.get(k) == Some(&Suspect::LimbHeight)
}

/// Returns the best of some pairs, if no single value explains the pictures nearly as well.
fn explain_alone(pairs: Vec<Of>, singles: &[Of], limb_sigma_km: f64) -> Option<Of> {
    let scatter = pairs.iter().map(|(_, solved)| solved.scatter(2)).reduce(f64::min)?;
    // An altitude and a limb height change the half-angles nearly alike. Only the limb height has an expected value.
    let cost = |(which, solved): &Of| {
        let limb = which.iter().zip(solved.corrections).filter(|(k, _)| is_limb(**k));
        solved.chi2(scatter) + limb.map(|(_, km)| (km / limb_sigma_km).powi(2)).sum::<f64>()
    };
    let best = pairs.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let explains = |single: &Solved| {
        let gain = single.chi2(scatter) - best.1.chi2(scatter);
        gain < least_gain(single.residuals.len() - 2) || single.scatter(1) < LEAST_RATIO * scatter
    };
    (!singles.iter().any(|(_, single)| explains(single))).then_some(best)
}

/// Returns the correlation of the corrections of two quantities if both may be wrong, -1 to 1. Beyond
/// [`MOST_CORRELATION`] the pictures do not tell them apart. `None` with fewer than three pictures.
pub fn correlation<'a>(
    facts: impl Iterator<Item = &'a FitFacts>,
    limb_height_km: f64,
    suspects: [Suspect; 2],
) -> Option<f64> {
    let equations: Vec<Equation> = facts.filter_map(|f| Equation::new(f, limb_height_km)).collect();
    let place = |suspect: Suspect| Suspect::ALL.iter().position(|s| *s == suspect);
    let which = [place(suspects[0])?, place(suspects[1])?];
    // Two equations can always be solved for two unknowns, so that they say nothing about the choice.
    let is_enough = equations.len() > 2 && which[0] != which[1];
    // Corrections that change all half-angles alike have no solution.
    is_enough.then(|| Solved::new(&equations, which).map_or(1.0, |solved| solved.correlation()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::Implied;

    const NOISE_DEG: f64 = 0.02;
    const LIMB_KM: [f64; 2] = [10.0, 7.0];

    /// Returns the facts of a picture whose altitude is wrong by `km` and whose focal length by the factor `focal`.
    /// `bend` says by how many degrees ln f = 1 changes the half-angle, which depends on the place of the limb.
    fn facts(altitude_km: f64, bend: f64, km: f64, focal: f64, noise: f64) -> FitFacts {
        let radius = 6371.0;
        let half_angle = |height: f64| ((radius + 10.0) / (radius + height)).asin().to_degrees();
        let expected = half_angle(altitude_km);
        let by_km = half_angle(altitude_km + 0.5) - half_angle(altitude_km - 0.5);
        let fitted = half_angle(altitude_km + km) + bend * focal.ln() + noise * NOISE_DEG;
        let difference = fitted - expected;
        let implied = |slope: f64| Implied { value: difference / slope, sigma: (NOISE_DEG / slope).abs() };
        let ln_focal = implied(bend);
        let factor = ln_focal.value.exp();
        let sin = fitted.to_radians().sin();
        let altitude = Implied { value: (radius + 10.0) / sin - radius, sigma: (NOISE_DEG / by_km).abs() };
        // One km of limb is about one km of altitude less, near the ground.
        let limb_km = sin * (radius + altitude_km) - radius;
        let limb = Implied { value: limb_km, sigma: altitude.sigma * (radius + altitude_km) / radius };
        FitFacts {
            expected_deg: expected,
            fitted_deg: fitted,
            fitted_sigma_deg: NOISE_DEG,
            expected_sigma_deg: 0.3,
            sigmas: difference / 0.3,
            is_trial: true,
            given_altitude_km: Some(altitude_km),
            altitude_km: Some(altitude),
            focal_factor: Some(Implied { value: factor, sigma: ln_focal.sigma * factor }),
            limb_height_km: Some(limb),
        }
    }

    fn flight(km: f64, focal: f64) -> Vec<FitFacts> {
        let noise = [0.3, -0.9, 1.2, -0.4, 0.1, -1.1, 0.8, 0.5, -0.6, 1.0, -0.2, -0.7];
        let one = |(i, noise): (usize, &f64)| {
            let bend = [40.0, -18.0, 25.0, 9.0][i % 4];
            facts(120.0 + 25.0 * i as f64, bend, km, focal, *noise)
        };
        noise.iter().enumerate().map(one).collect()
    }

    #[test]
    fn two_wrong_values_are_found_together() {
        let mut all = flight(-20.0, 1.06);
        // Two fits are of clouds.
        all[3].fitted_deg += 9.0;
        all[8].fitted_deg -= 7.0;
        let pair = find_pair(all.iter(), LIMB_KM).unwrap();
        let [altitude, focal] = pair.remedies;
        assert_eq!((altitude.suspect, focal.suspect), (Suspect::Altitude, Suspect::Focal));
        assert!((altitude.correction + 20.0).abs() < 3.0 && altitude.sigma < 3.0, "{altitude:?}");
        assert!((focal.correction - 1.06).abs() < 0.01, "{focal:?}");
        assert!(pair.correlation.abs() < 0.95 && pair.pictures == 12);
    }

    /// From one altitude, a focal length is told apart from an altitude by the place of the limb alone.
    #[test]
    fn two_values_are_inseparable_only_above_the_limit_of_the_correlation() {
        let both = [Suspect::Altitude, Suspect::Focal];
        for (spread, limit) in [(0.1, 0.0..0.0), (0.2, 0.0..0.0), (0.6, 0.7..0.95), (2.0, 0.4..0.7)] {
            let one = |i: usize| facts(300.0, 30.0 * (1.0 + spread * [1.0, -1.0, 0.5, -0.5][i % 4]), -40.0, 1.3, 0.0);
            let all: Vec<FitFacts> = (0..12).map(one).collect();
            let pair = find_pair(all.iter(), LIMB_KM).unwrap();
            assert_eq!(pair.remedies.map(|r| r.suspect), both);
            let size = pair.correlation.abs();
            let is_apart = !limit.is_empty();
            assert!(if is_apart { limit.contains(&size) } else { size > 0.95 }, "{spread}: {size}");
            assert_eq!(pair.is_told_apart(), is_apart);
            assert_eq!(correlation(all.iter(), LIMB_KM[0], both), Some(pair.correlation));
        }
        // An altitude and a limb height act nearly alike from all altitudes.
        let limb = [Suspect::Altitude, Suspect::LimbHeight];
        assert!(correlation(flight(-20.0, 1.0).iter(), LIMB_KM[0], limb).unwrap().abs() > MOST_CORRELATION);
        assert_eq!(correlation(flight(-20.0, 1.0)[..2].iter(), LIMB_KM[0], limb), None);
    }

    /// With slopes through what each picture implies alone, the errors are up to 0.5 km and 0.6 % here.
    #[test]
    fn large_corrections_follow_the_curve_of_the_half_angle() {
        for (km, focal) in [(-45.0, 1.1), (40.0, 0.92), (35.0, 1.08), (-40.0, 0.9)] {
            let pair = find_pair(flight(km, focal).iter(), LIMB_KM).unwrap();
            let [altitude, factor] = pair.remedies;
            assert!((altitude.correction - km).abs() < 0.3, "{km} km, {focal}: {altitude:?}");
            assert!((factor.correction / focal - 1.0).abs() < 0.001, "{km} km, {focal}: {factor:?}");
        }
    }

    #[test]
    fn one_wrong_value_is_no_pair() {
        for (km, focal) in [(0.0, 1.0), (-30.0, 1.0), (25.0, 1.0), (0.0, 0.9), (0.0, 1.08)] {
            assert_eq!(find_pair(flight(km, focal).iter(), LIMB_KM), None, "{km} km, {focal}");
        }
        assert_eq!(find_pair(flight(-20.0, 1.06)[..7].iter(), LIMB_KM), None, "seven pictures are too few");
    }

    #[test]
    fn an_uneven_limb_is_rarely_a_pair() {
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal = || (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
        for (pictures, scatter_deg) in [(8, 0.1), (8, 0.3), (12, 0.2)] {
            let mut flight = || -> Vec<FitFacts> {
                let one = |i: usize| {
                    let bend = [40.0, -18.0, 25.0, 9.0][i % 4];
                    facts(120.0 + 25.0 * i as f64, bend, 0.0, 1.0, normal() * scatter_deg / NOISE_DEG)
                };
                (0..pictures).map(one).collect()
            };
            let found = (0..500).filter(|_| find_pair(flight().iter(), LIMB_KM).is_some()).count();
            assert!(found <= 10, "{found} of 500 flights of {pictures} pictures");
        }
    }
}
