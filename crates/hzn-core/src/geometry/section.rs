//! The limb as a conic section of the plane z = 1, which a pinhole camera sees (Braun & Barf 2022, section 2).
//!
//! With the unit axis e in the camera frame, c = cos α and Δ = e_x² + e_y² − c², the picture of the cone s·e = c is an
//! ellipse for Δ < 0 and a hyperbola for Δ > 0. In the principal frame of the curve, whose x axis points along
//! (e_x, e_y), the equation is Δ x² − c² y² = c² sin²α/Δ. Lengths are in focal lengths.

use crate::base::real::Real;
use crate::geometry::frames::{Cam, UnitVec3};

/// The kind of curve that the limb is on the plane z = 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A closed curve.
    Ellipse,
    /// One branch of an open curve (or a parabola, the limiting case).
    Hyperbola,
}

/// The limb of one cone on the plane z = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section<T> {
    /// Δ of the module's equations.
    delta: T,
    /// Unit vector along the projected axis.
    along: [T; 2],
    /// e_z √(e_x² + e_y²): Δ times the offset of the principal frame's origin along its x axis.
    offset: T,
    cos: T,
    sin: T,
}

impl<T: Real> Section<T> {
    /// Returns the limb of a body in the direction `axis` whose half-angle has the cosine `cos`, between 0 and 1.
    /// `None` when there is no limb in front of the camera: the axis points behind the camera and the cone does not
    /// reach around it. The equations still give an ellipse there, but it belongs to the other nappe.
    pub fn new(axis: &UnitVec3<Cam, T>, cos: T) -> Option<Self> {
        let [x, y, z] = axis.xyz();
        let one = T::one();
        if !(cos > T::ZERO && cos < one) {
            return None;
        }
        let flat2 = x * x + y * y;
        let flat = flat2.sqrt();
        let delta = flat2 - cos * cos;
        // An ellipse behind the camera solves the same equation, because the squared cone has a second nappe.
        if z < T::ZERO && delta <= T::ZERO {
            return None;
        }
        // Straight ahead, any direction will do.
        let along = if flat > T::from_f64(1e-12) { [x / flat, y / flat] } else { [one, T::ZERO] };
        Some(Self { delta, along, offset: z * flat, cos, sin: (one - cos * cos).sqrt() })
    }

    /// Returns whether the limb is an ellipse or a hyperbola.
    pub fn kind(&self) -> Kind {
        if self.delta < T::ZERO { Kind::Ellipse } else { Kind::Hyperbola }
    }

    /// Returns the semi-axes (along the projected axis, across it) in focal lengths: c sin α/|Δ| and sin α/√|Δ|. Figure
    /// 16 of the paper leaves out the absolute value in the second one, which makes it imaginary for hyperbolae. Both
    /// are infinite for a parabola.
    pub fn semi_axes(&self) -> [T; 2] {
        let d = self.delta.abs();
        [self.cos * self.sin / d, self.sin / d.sqrt()]
    }

    /// Converts a point (x, y) of the plane to the principal frame. The paper's (27) prints the shift as a stack of
    /// three terms; it is the fraction e_z √(e_x² + e_y²)/Δ along x. The result is not finite for a parabola, whose
    /// frame lies at infinity.
    pub fn to_principal(&self, [x, y]: [T; 2]) -> [T; 2] {
        let [a, b] = self.along;
        [a * x + b * y + self.offset / self.delta, a * y - b * x]
    }

    /// Returns the distance of a point of the plane from the limb along the principal x axis, in focal lengths: (28)
    /// for one point. For a hyperbola it is positive on the side to which the branch opens. The paper takes the
    /// absolute value of x, so that points of the wrong branch pass. It also adds up the distances, so that short edges
    /// pass.
    ///
    /// x − a √(1 ± y²/b²) is a difference of large numbers for a nearly parabolic limb. The code multiplies and divides
    /// this difference by the sum of the two terms. The result is the value of the conic divided by that sum, which is
    /// also accurate for a nearly parabolic limb. If an ellipse has no point at this principal y, the distance is the
    /// principal x itself, because the ellipse ends at x = 0.
    pub fn distance(&self, [x, y]: [T; 2]) -> T {
        let [a, b] = self.along;
        let (u, v) = (a * x + b * y, a * y - b * x);
        // Δ times the principal x.
        let lever = self.delta * u + self.offset;
        let radicand = self.sin * self.sin + self.delta * v * v;
        // Without this branch the root would be NaN, and a point far to the side would have no distance.
        if radicand < T::ZERO {
            return lever / self.delta;
        }
        let root = self.cos * radicand.sqrt();
        // Near the wrong branch the quotient below would be small, because the conic is 0 on both branches.
        if self.delta > T::ZERO && lever < T::ZERO {
            // The point lies near the branch that the camera does not see.
            return (lever - root) / self.delta;
        }
        // The sign is that of the lever, so that the two terms of the divisor never cancel.
        let root = if lever < T::ZERO { -root } else { root };
        let c2 = self.cos * self.cos;
        // (p·e)² − c² |p|² is Δ u² + 2 offset u + (e_z² − c²) − c² v², with e_z² − c² = sin²α − c² − Δ.
        let value =
            self.delta * (u * u - T::one()) + (self.offset + self.offset) * u + self.sin * self.sin - c2 - c2 * v * v;
        value / (lever + root)
    }
}

/// Returns whether a camera with this field of view (full angle, radians) can see an elliptic limb of this half-angle
/// (radians) in any attitude: γ > 4α − π. The paper's section 2.7 exchanges this condition and the next one.
pub fn ellipse_can_be_seen<T: Real>(field_of_view_rad: T, half_angle_rad: T) -> bool {
    field_of_view_rad > half_angle_rad * T::from_f64(4.0) - T::from_f64(core::f64::consts::PI)
}

/// Returns whether a hyperbolic limb can be seen: γ > π − 4α. Both angles are in radians.
pub fn hyperbola_can_be_seen<T: Real>(field_of_view_rad: T, half_angle_rad: T) -> bool {
    field_of_view_rad > T::from_f64(core::f64::consts::PI) - half_angle_rad * T::from_f64(4.0)
}

/// Returns whether the whole disc can be seen: γ > 2α. Both angles are in radians.
pub fn disc_can_be_seen<T: Real>(field_of_view_rad: T, half_angle_rad: T) -> bool {
    field_of_view_rad > half_angle_rad + half_angle_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::linalg::{V3, basis};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Returns points of the limb in front of the camera, on the plane, `off` radians outside.
    fn limb(axis: &UnitVec3<Cam, f64>, alpha: f64, off: f64) -> Vec<[f64; 2]> {
        let (b1, b2) = basis(axis.v());
        let (sin, cos) = libm::sincos(alpha + off);
        (0..720)
            .map(|i| {
                let (s, c) = libm::sincos(f64::from(i).to_radians() / 2.0);
                axis.v() * cos + (b1 * c + b2 * s) * sin
            })
            .filter(|s: &V3<f64>| s.z > 0.1)
            .map(|s| [s.x / s.z, s.y / s.z])
            .collect()
    }

    proptest! {
        /// Limb points lie on the section, in both forms of the equation, in every attitude of the camera.
        #[test]
        fn limb_points_lie_on_the_section(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in -0.3..1.0f64, alpha in 0.1..1.5f64,
        ) {
            prop_assume!(x * x + y * y + z * z > 0.1);
            let axis = UnitVec3::try_new([x, y, z]).unwrap();
            let Some(section) = Section::new(&axis, libm::cos(alpha)) else { return Ok(()) };
            for p in limb(&axis, alpha, 0.0) {
                prop_assert!(section.distance(p).abs() < 1e-6 * (1.0 + p[0] * p[0] + p[1] * p[1]), "{p:?}: \
                    {}", section.distance(p));
                let [px, py] = section.to_principal(p);
                let [a, b] = section.semi_axes();
                if a < 1e3 {
                    let sign = if section.kind() == Kind::Ellipse { 1.0 } else { -1.0 };
                    let value = (px / a).powi(2) + sign * (py / b).powi(2) - 1.0;
                    prop_assert!(value.abs() < 1e-4 * (1.0 + (px / a).powi(2)), "{value}");
                    // The visible branch of a hyperbola has positive x.
                    prop_assert!(section.kind() == Kind::Ellipse || px > 0.0);
                }
            }
        }
    }

    /// With |x|, as printed, (28) is zero on the branch that no camera sees; the correct distance there is large.
    #[test]
    fn the_other_branch_is_far_away() {
        let axis = UnitVec3::try_new([0.0, 0.94, 0.34]).unwrap();
        let section = Section::new(&axis, 0.2f64).unwrap();
        assert_eq!(section.kind(), Kind::Hyperbola);
        let [a, b] = section.semi_axes();
        let shift = 0.94 * 0.34 / (0.94 * 0.94 + 0.34 * 0.34) / (0.94 * 0.94 / (0.94 * 0.94 + 0.34 * 0.34) - 0.04);
        let y = 0.3;
        let x = a * libm::sqrt(1.0 + y * y / (b * b));
        // The point lies along the projected axis (down) by −x − shift: its principal x is −x.
        let wrong = [-y, -x - shift];
        let printed = section.to_principal(wrong)[0].abs() - x;
        assert!(printed.abs() < 1e-9, "{printed}");
        assert!((section.distance(wrong) + 2.0 * x).abs() < 1e-9);
    }

    /// (27) as printed adds the numerator of the shift without its denominator.
    #[test]
    fn the_principal_shift_is_a_fraction() {
        let axis = UnitVec3::try_new([0.3, 0.5, 0.7]).unwrap();
        let (alpha, [ex, ey, ez]) = (1.1f64, axis.xyz());
        let section = Section::new(&axis, libm::cos(alpha)).unwrap();
        let [a, b] = section.semi_axes();
        let flat = libm::sqrt(ex * ex + ey * ey);
        for p in limb(&axis, alpha, 0.0) {
            let right = section.to_principal(p);
            let delta = flat * flat - libm::cos(alpha).powi(2);
            let printed = right[0] - flat * ez / delta + flat * ez;
            let value = |x: f64| (x / a).powi(2) - (right[1] / b).powi(2) - 1.0;
            assert!(value(right[0]).abs() < 1e-9 * (1.0 + (right[0] / a).powi(2)));
            assert!(value(printed).abs() > 1e-3, "{}", value(printed));
        }
        // Figure 16: without the absolute value, b² = −F'/C' with C' = −c² is negative for this hyperbola.
        assert!(section.kind() == Kind::Hyperbola && b.is_finite());
    }

    #[test]
    fn no_section_behind_the_camera() {
        let behind = UnitVec3::try_new([0.1, 0.2, -0.9]).unwrap();
        assert!(Section::new(&behind, 0.9f64).is_none());
        let axis = UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap();
        assert!(Section::new(&axis, f64::NAN).is_none() && Section::new(&axis, 1.0).is_none());
        // Straight ahead: a circle of radius tan α.
        let section = Section::new(&axis, libm::cos(0.4f64)).unwrap();
        assert_eq!(section.kind(), Kind::Ellipse);
        for p in limb(&axis, 0.4, 0.0) {
            assert!(section.distance(p).abs() < 1e-7);
        }
        let [a, b] = section.semi_axes();
        assert!((a - libm::tan(0.4)).abs() < 1e-12 && (b - a).abs() < 1e-12);
    }

    /// Distances have the right size: here half a degree outside the limb.
    #[test]
    fn distance_is_signed_and_of_the_right_size() {
        for axis in [[0.0, 0.94, 0.34], [0.1, 0.3, 0.95]] {
            let axis = UnitVec3::try_new(axis).unwrap();
            let section = Section::new(&axis, libm::cos(0.6f64)).unwrap();
            let near = |off: f64| {
                let sum: f64 = limb(&axis, 0.6, off).iter().map(|p| section.distance(*p).abs()).sum();
                sum / limb(&axis, 0.6, off).len() as f64
            };
            assert!(near(0.0) < 1e-9 && (0.005..0.1).contains(&near(0.0087)), "{}", near(0.0087));
        }
    }

    /// Compares the conditions with brute force over all tilts: a limb point lies within half the field of view of the
    /// boresight while the section is of the given kind.
    #[test]
    fn visibility_by_brute_force() {
        for altitude_km in [80.0, 238.0, 800.0, 6000.0] {
            let alpha = libm::asin(6371.0 / (6371.0 + altitude_km));
            let seen = |kind: Kind, field: f64| {
                (1..18_000).any(|i| {
                    let tilt = f64::from(i) * 1e-2_f64.to_radians();
                    let axis = UnitVec3::try_new([libm::sin(tilt), 0.0, libm::cos(tilt)]).unwrap();
                    Section::new(&axis, libm::cos(alpha)).is_some_and(|s| s.kind() == kind)
                        && (tilt - alpha).abs() < field / 2.0
                })
            };
            for deg in (4..176).map(f64::from) {
                let field = deg.to_radians();
                let edge = |x: f64| (field - x).abs() < 0.1_f64.to_radians();
                let pi = core::f64::consts::PI;
                if !edge(4.0 * alpha - pi) {
                    assert_eq!(ellipse_can_be_seen(field, alpha), seen(Kind::Ellipse, field), "{altitude_km} {deg}");
                }
                if !edge(pi - 4.0 * alpha) {
                    assert_eq!(
                        hyperbola_can_be_seen(field, alpha),
                        seen(Kind::Hyperbola, field),
                        "{altitude_km} {deg}"
                    );
                }
            }
        }
        // The paper's example: at 238 km an ellipse needs 118.3°. The printed condition says that every camera sees an
        // ellipse.
        let alpha = libm::asin(6371.0f64 / 6609.0);
        assert!(
            !ellipse_can_be_seen(118.2f64.to_radians(), alpha) && ellipse_can_be_seen(118.4f64.to_radians(), alpha)
        );
        assert!(disc_can_be_seen(2.0 * alpha + 0.01, alpha) && !disc_can_be_seen(2.0 * alpha - 0.01, alpha));
    }
}
