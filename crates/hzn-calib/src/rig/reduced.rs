//! The normal equations of one epoch, with its axis and its cosine eliminated.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x4, Rotation3, Vector3};

use super::epoch::{Epoch, Sighting, tangent};

/// Number of unknowns of a head: three rotations, and a height of its own.
pub(super) const OF_HEAD: usize = 4;

/// Number of steps that find the common cone of an epoch. Each leaves an error of the second order in the angle between
/// the cones.
const STEPS: usize = 4;

/// The mounts and heights at which the equations are linear.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) mounts: Vec<Rotation3<f64>>,
    pub(super) heights_km: Vec<f64>,
    /// Distance of the limb from the centre of the body, kilometres.
    pub(super) radius_km: f64,
}

/// The part of an epoch in the equations of the mounts and heights.
pub(super) struct Reduced {
    pub(super) normal: DMatrix<f64>,
    pub(super) right: DVector<f64>,
    /// Sum of the squared residuals over their covariance.
    pub(super) chi2: f64,
    pub(super) freedom: usize,
}

/// The common cone of an epoch.
struct Cone {
    e: Vector3<f64>,
    cos: f64,
}

/// What a head says about the cone: residual, and derivatives by the cone and by the unknowns of the head.
struct Rows {
    residual: Vector3<f64>,
    by_cone: Matrix3<f64>,
    by_head: Matrix3x4<f64>,
}

impl Place {
    fn rows(&self, k: usize, sighting: &Sighting, cone: &Cone, [b1, b2]: &[Vector3<f64>; 2]) -> Rows {
        let sin2 = (1.0 - cone.cos * cone.cos).max(0.0);
        // cos α falls by sin² α/(cos α (R + d)) for each kilometre of limb height.
        let by_km = -sin2 / (cone.cos.max(1e-3) * self.radius_km);
        let mount = self.mounts[k];
        // The common axis in the axes that the rig has at the time of the picture.
        let e = sighting.late.inverse() * cone.e;
        let h = sighting.basis.map(|c| mount * c);
        let late = h.map(|h| sighting.late * h);
        let turn = h.map(|h| h.cross(&e));
        let cos = sighting.cos - cone.cos - by_km * self.heights_km[k];
        let mut by_head = Matrix3x4::zeros();
        for (i, turn) in turn.iter().enumerate() {
            by_head.fixed_view_mut::<1, 3>(i, 0).copy_from(&turn.transpose());
        }
        by_head[(2, 3)] = by_km;
        Rows {
            residual: Vector3::new(-h[0].dot(&e), -h[1].dot(&e), cos),
            by_cone: Matrix3::new(
                late[0].dot(b1),
                late[0].dot(b2),
                0.0, //
                late[1].dot(b1),
                late[1].dot(b2),
                0.0, //
                0.0,
                0.0,
                1.0,
            ),
            by_head,
        }
    }

    /// Returns the equations of an epoch; `None` with fewer than two heads, or if they do not determine a cone.
    pub(super) fn reduce(&self, epoch: &Epoch) -> Option<Reduced> {
        let seen: Vec<(usize, &Sighting)> =
            epoch.iter().enumerate().filter_map(|(k, s)| Some((k, s.as_ref()?))).collect();
        let (first, sighting) = seen.first().filter(|_| seen.len() > 1)?;
        let mut cone = Cone { e: sighting.late * (self.mounts[*first] * sighting.axis), cos: sighting.cos };
        for _ in 0..STEPS {
            let basis = tangent(&cone.e);
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for (k, sighting) in &seen {
                let rows = self.rows(*k, sighting, &cone, &basis);
                let weighted = rows.by_cone.transpose() * sighting.information;
                normal += weighted * rows.by_cone;
                right += weighted * rows.residual;
            }
            let step = normal.cholesky()?.solve(&right);
            cone = Cone { e: (cone.e + basis[0] * step.x + basis[1] * step.y).normalize(), cos: cone.cos + step.z };
        }
        self.eliminate(&seen, &cone)
    }

    fn eliminate(&self, seen: &[(usize, &Sighting)], cone: &Cone) -> Option<Reduced> {
        let size = OF_HEAD * self.mounts.len();
        let basis = tangent(&cone.e);
        let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let mut cross = DMatrix::zeros(size, 3);
        let (mut own, mut own_right, mut chi2) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (k, sighting) in seen {
            let rows = self.rows(*k, sighting, cone, &basis);
            let at = OF_HEAD * k;
            let weighted = rows.by_head.transpose() * sighting.information;
            normal.view_mut((at, at), (OF_HEAD, OF_HEAD)).copy_from(&(weighted * rows.by_head));
            right.rows_mut(at, OF_HEAD).copy_from(&(weighted * rows.residual));
            cross.view_mut((at, 0), (OF_HEAD, 3)).copy_from(&(weighted * rows.by_cone));
            let weighted = rows.by_cone.transpose() * sighting.information;
            own += weighted * rows.by_cone;
            own_right += weighted * rows.residual;
            chi2 += rows.residual.dot(&(sighting.information * rows.residual));
        }
        let inverse = own.cholesky()?.inverse();
        let gain = &cross * inverse;
        normal -= &gain * cross.transpose();
        right -= gain * own_right;
        // Three residuals of each head, and three unknowns of the cone.
        Some(Reduced { normal, right, chi2, freedom: 3 * seen.len() - 3 })
    }
}
