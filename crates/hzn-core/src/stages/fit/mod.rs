//! Gauss-Newton on the sphere: fits the cone s·e = cos α to the edge points.
//!
//! The state is the unit axis e and k = 1 − cos α. For a small disc, k keeps its precision while cos α loses it; for
//! the same reason 1 − s·e is computed as |s − e|²/2. In the following, c = cos α. For each point, r = c − s·e is the
//! residual and g = ∂(s·e)/∂(u, v). Then |r|/|g| is the distance from the limb in pixels, so that w = 1/|g|² weighs by
//! pixels. Let h = [Bᵀs − m, −1], where B is the tangent basis at e and m is the mean of Bᵀs. A step solves
//! (Σ w h hᵀ) δ = Σ w r h. Subtracting the means keeps the sums well-conditioned in single precision; the third unknown
//! is then δc' = δc − m·δ₁₂.
//!
//! In the robust iterations, the expected half-angle is one more row. Its weight takes into account that the errors of
//! the edge are *correlated*. Then the half-angle is fitted freely with the weights that were found: for the
//! covariance, for the altitude estimate, and for the test of the candidate. `covariance` fuses the two half-angles.

#[cfg(feature = "horace")]
mod circle;
#[cfg(feature = "dlr")]
pub(crate) mod conic;
#[cfg(feature = "dlr")]
pub(crate) mod direct;
#[cfg(feature = "zju")]
mod quadric;

use crate::base::keys::{choices, section};
use crate::base::linalg::{M3, V3, basis, invert_spd2, invert_spd3, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, HALF_LANES, LANES, sum};
use crate::geometry::camera::Camera;
use crate::geometry::cone::Azimuth;
use crate::model::body::Expected;
use crate::model::edge_noise;
use crate::stages::consensus::Consensus;
#[cfg(feature = "zju")]
pub(crate) use quadric::Quadric;

choices! {
    /// Which half-angle the fitted cone has.
    pub enum HalfAngle {
        /// The half-angle is fitted freely, then fused with the expected one by their covariances; the result is never
        /// worse than the better of the two.
        @0 Fused = "fused";
        /// The half-angle is the expected one, exactly.
        @1 Known = "known";
        /// The half-angle is fitted; the expected one is only a start.
        @2 Free = "free";
    }
}

choices! {
    /// How the cone is fitted.
    pub enum Method {
        /// Gauss-Newton on the sphere, with Tukey's weights and the expected half-angle.
        @- Sphere = "sphere";
        /// Linear least squares on the plane z = 1, half-angle free (Braun & Barf 2022, (24)).
        @- Direct = "direct" needs "dlr";
        /// The axis of the ellipse or hyperbola through the points (Braun & Barf 2022, (17), (18) corrected).
        @- Conic = "conic" needs "dlr";
        /// An elliptic cone by total least squares (Wang et al. 2022, (10) to (17)).
        @- Tls = "tls" needs "zju";
        /// An elliptic cone by total least squares; every point is weighed by the angle of a pixel at its place (Wang
        /// et al. 2022, (18) to (21)).
        @- Wtls = "wtls" needs "zju";
        /// Centre and radius of a circle, right for a camera that points at the body (Barf 2014, 2.2.4).
        @- Circle = "circle" needs "horace";
    }
}

section! {
    /// `[estimate]` of sensor.toml: the fit of the cone.
    "estimate" pub struct Config: Copy {
        /// How the cone is fitted.
        @- method: Method = Method::Sphere, [choice];
        /// Which half-angle the fitted cone has.
        @90 half_angle: HalfAngle = HalfAngle::Fused, [choice];
        /// For `wtls`: points are weighed where the axis is farther off the optical axis than this, degrees; 0 always
        /// weighs them.
        @- weigh_above_deg: f64 = 0.0, [0.0 to 180.0] { needs: "zju" };
    }
}

/// A fitted cone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit<T> {
    /// Unit axis, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the (mean) half-angle.
    pub(crate) c: T,
    /// 1 − cos of the half-angle, with the full relative precision.
    pub(crate) k: T,
    /// The half-angle was fitted, too; otherwise it is the expected one.
    pub(crate) free: bool,
    /// Weighted RMS distance of the points from the limb in pixels.
    pub(crate) rms_px: T,
    /// Number of points with a weight.
    pub(crate) inliers: u32,
    /// Total length of the edge between adjacent points that both have a weight, in pixels.
    pub(crate) arc_px: T,
    /// Number of points beyond the cut-off of the weights, but within three times the cut-off.
    pub(crate) nearby: u32,
    /// Normal equations at the cone, about `mean`.
    pub(crate) sums: Sums<T>,
    /// Means of Bᵀs.
    pub(crate) mean: [T; 2],
    /// The elliptic cone of the methods that fit one. Its covariance is not the one of the normal equations.
    #[cfg(feature = "zju")]
    pub(crate) quadric: Option<Quadric<T>>,
}

/// Tukey's constant: it gives 95 % efficiency for Gaussian errors.
const TUKEY: f64 = 4.685;
/// Largest number of robust iterations. `SETTLE` is the largest number of iterations with fixed weights.
const ROBUST: usize = 10;
/// Number of blocks that the first robust iterations use.
const PART: usize = 24;
const SETTLE: usize = 5;

/// Returns the correction by azimuth for an ellipsoid; `None` if the body is no ellipsoid or the attitude is unknown.
pub(crate) fn azimuth<T: Real>(expected: &Expected<T>) -> Option<Azimuth<T>> {
    let cone = expected.ellipsoid.as_ref()?;
    let to_cam = expected.cam_to_ecef?.inverse();
    let (east, axis) = (to_cam.apply(&cone.east), to_cam.apply(&cone.axis));
    Some(Azimuth {
        north: east.v().cross(axis.v()),
        harmonics_cos: expected.harmonics_cos,
        east: *east.v(),
        cot2_east: cone.cot2_east,
        cot2_meridian: cone.cot2_meridian,
        mean_cos: expected.cos,
    })
}

/// Fits the cone, and stores the weight of each point in its block. The result is `None` if the points do not determine
/// a cone.
pub(crate) fn fit<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    expected: &Expected<T>,
    camera: &Camera<T>,
    threshold_px: T,
    config: &Config,
    noise: &edge_noise::Config,
) -> Option<Fit<T>> {
    #[cfg(not(feature = "horace"))]
    let _ = camera;
    let cone = match config.method {
        #[cfg(feature = "dlr")]
        Method::Direct => fit_by(blocks, start, threshold_px, direct::fit)?,
        #[cfg(feature = "dlr")]
        Method::Conic => fit_by(blocks, start, threshold_px, conic::fit)?,
        #[cfg(feature = "zju")]
        Method::Tls => elliptic(blocks, start, threshold_px, HALF_TURN_RAD)?,
        #[cfg(feature = "zju")]
        Method::Wtls => elliptic(blocks, start, threshold_px, config.weigh_above_deg.to_radians())?,
        #[cfg(feature = "horace")]
        Method::Circle => fit_by(blocks, start, threshold_px, |blocks| circle::fit(blocks, camera))?,
        // `Config::check` refuses a method that is not built in.
        _ => sphere(blocks, start, expected, threshold_px, config, noise)?,
    };
    Some(count_points(blocks, cone))
}

/// Makes the fit of a cone, and counts its points.
fn count_points<T: Real>(blocks: &[Block<T>], cone: Cone<T>) -> Fit<T> {
    let (mut inliers, mut arc) = ([T::ZERO; LANES], [T::ZERO; LANES]);
    let mut before = T::ZERO;
    for block in blocks.iter() {
        let on = block.weight.map(|w| if w > T::ZERO { T::one() } else { T::ZERO });
        for l in 0..LANES {
            inliers[l] += on[l];
            arc[l] += on[l] * before * block.step_px[l];
            before = on[l];
        }
    }
    let (inliers, arc) = (sum(&inliers).to_i32() as u32, sum(&arc));
    let Cone { at, mean, sums, free, .. } = cone;
    Fit {
        e: at.e,
        c: at.c(),
        k: at.k,
        free,
        rms_px: (sums.cost / sums.weight).sqrt(),
        inliers,
        arc_px: arc,
        nearby: at.nearby,
        sums,
        mean,
        #[cfg(feature = "zju")]
        quadric: cone.quadric,
    }
}

/// Result of every method.
struct Cone<T> {
    at: State<T>,
    /// Means about which `sums` are formed.
    mean: [T; 2],
    sums: Sums<T>,
    free: bool,
    #[cfg(feature = "zju")]
    quadric: Option<Quadric<T>>,
}

/// Fits the cone in robust iterations with the expected half-angle, then fits the half-angle freely with the weights
/// that were found.
fn sphere<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    expected: &Expected<T>,
    threshold_px: T,
    config: &Config,
    noise: &edge_noise::Config,
) -> Option<Cone<T>> {
    let azimuth = azimuth(expected);
    let azimuth = azimuth.as_ref();
    let known = config.half_angle == HalfAngle::Known && !expected.free;
    let (robust, sums) = robust(blocks, start, expected, threshold_px, known, config, noise, azimuth)?;
    let freely = if known { None } else { settle(blocks, robust, Some(sums), true, azimuth) };
    let ((at, mean, sums), free) = match freely {
        Some(settled) => (settled, true),
        // For Sun and Moon there is no expected half-angle to use instead.
        None if expected.free => return None,
        None => (settle(blocks, State { k: T::one() - expected.cos, ..robust }, None, false, azimuth)?, false),
    };
    Some(Cone {
        at,
        mean,
        sums,
        free,
        #[cfg(feature = "zju")]
        quadric: None,
    })
}

/// Fits the cone by another method, `find`, and adds the normal equations at this cone. Weights, gates and covariance
/// are therefore the same as for the default method. The method uses the points within `threshold_px` of the consensus,
/// or all points if `start.all` is set. `find` receives the blocks with weights 0 and 1, and returns the axis and the
/// cos of the half-angle.
#[cfg(any(feature = "dlr", feature = "zju", feature = "horace"))]
#[allow(dead_code, reason = "for the estimators behind features")]
fn fit_by<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    threshold_px: T,
    find: impl FnOnce(&[Block<T>]) -> Option<(V3<T>, T)>,
) -> Option<Cone<T>> {
    if !start.all {
        let limit2 = threshold_px * threshold_px;
        for b in blocks.iter_mut() {
            let g = b.gradient(&start.e);
            for l in 0..LANES {
                let r = start.c - b.ray(l).dot(&start.e);
                if !(r * r <= limit2 * (g[0][l] * g[0][l] + g[1][l] * g[1][l])) {
                    b.weight[l] = T::ZERO;
                }
            }
        }
    }
    let (e, c) = find(blocks)?;
    cone_at(blocks, e, c)
}

/// Returns the fit at a given cone, with the weights that the points have.
#[cfg(any(test, feature = "_edges"))]
#[allow(dead_code, reason = "behind a feature")]
pub(crate) fn fit_at<T: Real>(blocks: &mut [Block<T>], e: V3<T>, c: T) -> Option<Fit<T>> {
    let cone = cone_at(blocks, e, c)?;
    Some(count_points(blocks, cone))
}

/// Returns a cone with the normal equations at it.
#[cfg(any(test, feature = "dlr", feature = "zju", feature = "horace", feature = "_edges"))]
fn cone_at<T: Real>(blocks: &mut [Block<T>], e: V3<T>, c: T) -> Option<Cone<T>> {
    let e = unit(&e)?;
    if !(c.abs() < T::one()) {
        return None;
    }
    let (b1, b2) = basis(&e);
    let mean = means(blocks, &b1, &b2);
    let sums = pass(blocks, &e, &b1, &b2, T::one() - c, mean, &Weights::Kept, None);
    // This test also refuses NaN.
    (sums.weight > T::from_f64(2.5) && sums.cost >= T::ZERO).then_some(Cone {
        at: State { e, k: T::one() - c, mean, nearby: 0 },
        mean,
        sums,
        free: true,
        #[cfg(feature = "zju")]
        quadric: None,
    })
}

/// Largest possible angle between the axis and the optical axis, in radians.
#[cfg(feature = "zju")]
const HALF_TURN_RAD: f64 = core::f64::consts::PI;

/// Fits an elliptic cone to the points. `rms_px` uses the distances from this cone, and the covariance comes from
/// `quadric`.
#[cfg(feature = "zju")]
fn elliptic<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    threshold_px: T,
    weigh_above_rad: f64,
) -> Option<Cone<T>> {
    let mut quadric = None;
    let cone = fit_by(blocks, start, threshold_px, |blocks| {
        let found = Quadric::fit(blocks, T::from_f64(weigh_above_rad))?;
        quadric = Some(found);
        Some((found.e, found.c))
    })?;
    let found = quadric?;
    let sums = Sums { weight: found.weight, cost: found.cost, ..cone.sums };
    Some(Cone { sums, quadric, ..cone })
}

/// State of the iterations.
#[derive(Clone, Copy)]
struct State<T> {
    e: V3<T>,
    /// 1 − cos of the half-angle.
    k: T,
    /// Means of Bᵀs.
    mean: [T; 2],
    nearby: u32,
}

impl<T: Real> State<T> {
    /// cos of the half-angle.
    fn c(&self) -> T {
        T::one() - self.k
    }
    /// sin of the half-angle.
    fn sin(&self) -> T {
        (self.k * (T::one() + self.c())).max(T::ZERO).sqrt()
    }
    /// Does a step and returns its size in radians; `None` if the new axis has no direction.
    fn step(&mut self, b1: &V3<T>, b2: &V3<T>, ([d1, d2], dc): ([T; 2], T), sums: &Sums<T>) -> Option<T> {
        self.e = unit(&(self.e + b1 * d1 + b2 * d2))?;
        self.k -= dc;
        self.mean = sums.means(self.mean);
        Some(d1.abs() + d2.abs() + dc.abs())
    }
}

/// Does the iterations with Tukey's weights. The cut-off begins at three thresholds and then follows the residuals,
/// between half a threshold and two thresholds. The function stores the last weights in the points, and returns the
/// sums with them.
fn robust<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    expected: &Expected<T>,
    threshold_px: T,
    known: bool,
    config: &Config,
    noise: &edge_noise::Config,
    azimuth: Option<&Azimuth<T>>,
) -> Option<(State<T>, Sums<T>)> {
    let (widest, narrowest) = (threshold_px * T::from_f64(2.0), threshold_px * T::from_f64(0.5));
    let mut cutoff = threshold_px * T::from_f64(3.0);
    let prior = HalfAngleRow::new(blocks, expected, config, noise);
    let e = unit(&start.e)?;
    let (b1, b2) = basis(&e);
    let k = T::one() - if known { expected.cos } else { start.c };
    let mut at = State { e, k, mean: means(blocks, &b1, &b2), nearby: 0 };
    // A part of the points brings the cone near; the last iterations use all points.
    let mut every = blocks.len().div_ceil(PART).max(1);
    for _ in 0..ROBUST {
        let (b1, b2) = basis(&at.e);
        let weights = Weights::Tukey { cutoff2: cutoff * cutoff, every };
        let sums = pass(blocks, &at.e, &b1, &b2, at.k, at.mean, &weights, azimuth);
        let free = if known { None } else { sums.step(at.mean, prior.as_ref(), at.c()) };
        let step = match free {
            Some(step) => step,
            None => sums.step_known(at.mean)?,
        };
        let size = at.step(&b1, &b2, step, &sums)?;
        at.k = clamp(at.k);
        let spread = (sums.cost / sums.weight.max(T::from_f64(1e-20))).sqrt() * T::from_f64(1.2);
        let next = (spread * T::from_f64(TUKEY)).max(narrowest).min(widest);
        // With all points, the next step is much smaller than this one. With a part of the points, the cone is only as
        // good as this part, so more iterations would not help.
        let small = T::from_f64(if every == 1 { 5e-4 } else { 1e-4 });
        let settled = (next - cutoff).abs() < cutoff * T::from_f64(0.05) && size < small * at.sin();
        cutoff = next;
        // The iterations with fixed weights give the last digits, with all points.
        if settled {
            break;
        }
        if size < T::from_f64(1e-3) * at.sin() {
            every = 1;
        }
    }
    let (b1, b2) = basis(&at.e);
    let weights = Weights::Last { cutoff2: cutoff * cutoff };
    let last = pass(blocks, &at.e, &b1, &b2, at.k, at.mean, &weights, azimuth);
    at.nearby = last.nearby.to_i32() as u32;
    (last.weight > T::from_f64(3.0)).then_some((at, last))
}

/// Iterates with fixed weights until convergence, and returns the normal equations there with the means about which
/// they are formed. The result is `None` if the points do not determine the cone; for a free half-angle, this happens
/// if the arc is too short. `first` are the sums at the start, if they are known.
fn settle<T: Real>(
    blocks: &mut [Block<T>],
    start: State<T>,
    mut first: Option<Sums<T>>,
    free: bool,
    azimuth: Option<&Azimuth<T>>,
) -> Option<(State<T>, [T; 2], Sums<T>)> {
    let mut at = start;
    let mut end = None;
    for _ in 0..SETTLE {
        let (b1, b2) = basis(&at.e);
        let mean = at.mean;
        let known = first.take();
        let mut sums = known.unwrap_or_else(|| pass(blocks, &at.e, &b1, &b2, at.k, mean, &Weights::Kept, azimuth));
        let step = if free { sums.step(mean, None, at.c())? } else { sums.step_known(mean)? };
        sums.cost = (sums.cost - sums.gain(mean, step)).max(T::ZERO);
        let size = at.step(&b1, &b2, step, &sums)?;
        // An axis more than 20° from the robust solution belongs to another cone.
        if !(at.k > T::ZERO && at.k < T::from_f64(2.0)) || at.e.dot(&start.e) < T::from_f64(0.94) {
            return None;
        }
        end = Some((at, mean, sums));
        // Convergence is quadratic: after a step this small nothing remains to be corrected, and the sums are the final
        // ones.
        if size * size < T::EPSILON * T::from_f64(2.0) * at.sin() {
            break;
        }
    }
    end
}

/// Limits 1 − cos to its valid range.
fn clamp<T: Real>(k: T) -> T {
    k.max(T::from_f64(1e-9)).min(T::from_f64(2.0 - 1e-6))
}

/// The expected half-angle as a row of the normal equations.
struct HalfAngleRow<T> {
    cos: T,
    weight: T,
}

impl<T: Real> HalfAngleRow<T> {
    /// Weighs the row by the number of independent errors of the edge: one error per two correlation lengths.
    fn new(blocks: &[Block<T>], expected: &Expected<T>, config: &Config, noise: &edge_noise::Config) -> Option<Self> {
        if expected.free || config.half_angle == HalfAngle::Free {
            return None;
        }
        let (mut points, mut arc) = (T::ZERO, T::ZERO);
        for block in blocks {
            points += sum(&block.weight);
            arc += sum(&block.step_px);
        }
        let correlation = T::from_f64(2.0 * noise.correlation_px);
        let each =
            if correlation > T::ZERO { (points * correlation / arc.max(correlation)).max(T::one()) } else { T::one() };
        let sigma = T::from_f64(noise.sigma_px);
        let floor = expected.sin * T::from_f64(1e-6);
        let sigma_c = expected.sigma_cos.max(floor);
        Some(Self { cos: expected.cos, weight: sigma * sigma * each / (sigma_c * sigma_c) })
    }
}

/// Sums of one pass over the points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sums<T> {
    /// Upper triangle of Σ w h hᵀ.
    pub(crate) n: [T; 6],
    g: [T; 3],
    /// Σ of the robust weights. `cost` is Σ of the squared distances multiplied by these weights, px².
    pub(crate) weight: T,
    pub(crate) cost: T,
    /// Number of points beyond Tukey's cut-off, but within three times the cut-off. Only the last pass counts them.
    nearby: T,
}

impl<T: Real> Sums<T> {
    /// Returns the reduction of the cost by a step, to the second order.
    fn gain(&self, mean: [T; 2], ([d1, d2], dc): ([T; 2], T)) -> T {
        let [g1, g2, g3] = self.g;
        g1 * d1 + g2 * d2 + g3 * (dc - mean[0] * d1 - mean[1] * d2)
    }

    /// Returns the step (δ₁₂, δc) with a free half-angle, or with its prior.
    fn step(&self, mean: [T; 2], prior: Option<&HalfAngleRow<T>>, c: T) -> Option<([T; 2], T)> {
        let [mut n11, mut n12, mut n13, mut n22, mut n23, mut n33] = self.n;
        let [mut g1, mut g2, mut g3] = self.g;
        if let Some(p) = prior {
            // The prior adds the row [m, 1] for (δ₁₂, δc'), with the value c₀ − c.
            let (w, [m1, m2], v) = (p.weight, mean, p.cos - c);
            n11 += w * m1 * m1;
            n12 += w * m1 * m2;
            n13 += w * m1;
            n22 += w * m2 * m2;
            n23 += w * m2;
            n33 += w;
            g1 += w * m1 * v;
            g2 += w * m2 * v;
            g3 += w * v;
        }
        let p = invert_spd3(&[n11, n12, n13, n22, n23, n33])?;
        let d = p * V3::new(g1, g2, g3);
        Some(([d.x, d.y], d.z + mean[0] * d.x + mean[1] * d.y))
    }

    /// Returns the step with a fixed half-angle: δc = 0, and therefore δc' = −m·δ₁₂.
    fn step_known(&self, mean: [T; 2]) -> Option<([T; 2], T)> {
        let [a, b, d] = invert_spd2(self.normal_fixed(mean))?;
        let [g1, g2, g3] = self.g;
        let (g1, g2) = (g1 - mean[0] * g3, g2 - mean[1] * g3);
        Some(([a * g1 + b * g2, b * g1 + d * g2], T::ZERO))
    }

    /// Returns the upper triangle of Σ w (Bᵀs)(Bᵀs)ᵀ.
    pub(crate) fn normal_fixed(&self, [m1, m2]: [T; 2]) -> [T; 3] {
        let [n11, n12, n13, n22, n23, n33] = self.n;
        // h₁₂ + m times (h₃ = −1): Bᵀs = h₁₂ − m h₃.
        [
            n11 - m1 * n13 - m1 * n13 + m1 * m1 * n33,
            n12 - m1 * n23 - m2 * n13 + m1 * m2 * n33,
            n22 - m2 * n23 - m2 * n23 + m2 * m2 * n33,
        ]
    }

    /// Returns the weighted RMS of |g|: the change of cos α if every point moves by one pixel across the limb, in 1/px.
    pub(crate) fn cos_per_px(&self) -> T {
        (self.weight / self.n[5].max(T::from_f64(1e-20))).sqrt()
    }

    /// Replaces the normal equations by those of a part of the points.
    pub(crate) fn with_normal(&self, n: [T; 6]) -> Self {
        Self { n, ..*self }
    }

    /// Returns the means of Bᵀs, from the sums about the old means.
    pub(crate) fn means(&self, [m1, m2]: [T; 2]) -> [T; 2] {
        let w = self.n[5].max(T::from_f64(1e-20));
        [m1 - self.n[2] / w, m2 - self.n[4] / w]
    }
}

/// Returns the means of Bᵀs over all points with a weight.
pub(crate) fn means<T: Real>(blocks: &[Block<T>], b1: &V3<T>, b2: &V3<T>) -> [T; 2] {
    let (mut n, mut x, mut y) = ([T::ZERO; LANES], [T::ZERO; LANES], [T::ZERO; LANES]);
    for b in blocks {
        for l in 0..LANES {
            let w = b.weight[l];
            n[l] += w;
            x[l] += w * (b.s[0][l] * b1.x + b.s[1][l] * b1.y + b.s[2][l] * b1.z);
            y[l] += w * (b.s[0][l] * b2.x + b.s[1][l] * b2.y + b.s[2][l] * b2.z);
        }
    }
    let n = sum(&n).max(T::one());
    [sum(&x) / n, sum(&y) / n]
}

/// Weights of the points in a pass, in addition to 1/|g|².
pub(crate) enum Weights<T> {
    /// The weights that the points have.
    Kept,
    /// Tukey's weights. Only every `every`-th block is used, and represents the others.
    Tukey { cutoff2: T, every: usize },
    /// Tukey's weights, which are also stored in the points.
    Last { cutoff2: T },
}

/// Does one pass over the points: sums at (e, k), about `mean`.
pub(crate) fn pass<T: Real>(
    blocks: &mut [Block<T>],
    e: &V3<T>,
    b1: &V3<T>,
    b2: &V3<T>,
    k: T,
    mean: [T; 2],
    weights: &Weights<T>,
    azimuth: Option<&Azimuth<T>>,
) -> Sums<T> {
    let (inverse, every, last) = match *weights {
        Weights::Kept => (T::ZERO, 1, false),
        Weights::Tukey { cutoff2, every } => (T::one() / cutoff2, every, false),
        Weights::Last { cutoff2 } => (T::one() / cutoff2, 1, true),
    };
    let mut totals = [[T::ZERO; HALF_LANES]; 11];
    let mut nearby = [T::ZERO; LANES];
    let half = T::from_f64(0.5);
    let east_along = azimuth.map_or(T::ZERO, |a| a.east.dot(e));
    for b in blocks.iter_mut().step_by(every.max(1)) {
        let grad = b.gradient(e);
        let mut target = [-k; LANES];
        if let Some(a) = azimuth {
            for l in 0..LANES {
                let s = [b.s[0][l], b.s[1][l], b.s[2][l]];
                let d = s[0] * e.x + s[1] * e.y + s[2] * e.z;
                target[l] += a.offset(s, d, east_along);
            }
        }
        let [mut robust, mut parts] = [[T::ZERO; LANES]; 2];
        for l in 0..HALF_LANES {
            let mut terms = |l: usize| {
                let (x, y, z) = (b.s[0][l] - e.x, b.s[1][l] - e.y, b.s[2][l] - e.z);
                let r = target[l] + (x * x + y * y + z * z) * half;
                let g2 = (grad[0][l] * grad[0][l] + grad[1][l] * grad[1][l]).max(T::from_f64(1e-20));
                let per = T::one() / g2;
                let d2 = r * r * per;
                parts[l] = d2 * inverse;
                let u = (T::one() - parts[l]).max(T::ZERO);
                robust[l] = b.weight[l] * u * u;
                let w = robust[l] * per;
                let h1 = x * b1.x + y * b1.y + z * b1.z - mean[0];
                let h2 = x * b2.x + y * b2.y + z * b2.z - mean[1];
                let (w1, w2) = (w * h1, w * h2);
                [w1 * h1, w1 * h2, w1, w2 * h2, w2, w, w1 * r, w2 * r, w * r, robust[l], robust[l] * d2]
            };
            let (one, other) = (terms(l), terms(l + HALF_LANES));
            for (total, (a, b)) in totals.iter_mut().zip(one.iter().zip(&other)) {
                total[l] += *a + *b;
            }
        }
        if last {
            for l in 0..LANES {
                let beside = parts[l] > T::one() && parts[l] <= T::from_f64(9.0);
                nearby[l] += if beside { b.weight[l] } else { T::ZERO };
            }
            b.weight = robust;
        }
    }
    let times = T::from_i32(every as i32);
    let [n11, n12, n13, n22, n23, n33, g1, g2, g3, weight, cost] =
        totals.map(|[a, b, c, d]| ((a + b) + (c + d)) * times);
    Sums { n: [n11, n12, -n13, n22, -n23, n33], g: [g1, g2, -g3], weight, cost, nearby: sum(&nearby) * times }
}

/// Returns the inverse of the normal equations for a free half-angle, about `mean`.
pub(crate) fn inverse<T: Real>(sums: &Sums<T>) -> Option<M3<T>> {
    invert_spd3(&sums.n)
}
