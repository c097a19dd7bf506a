//! The pose of a board from the rays of its corners.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, SymmetricEigen, Vector3};

use crate::adjust::{BOW, Block, Observation};

/// Smallest number of corners of a pose. A homography has eight unknowns, so four corners determine it; six leave
/// residuals that show whether it fits.
pub(super) const MIN_CORNERS: usize = 6;

/// A board that is seen from behind, which is the sign of a mirrored picture or of a mirrored numbering of the corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mirrored;

/// Returns the block of a board with its pose. `corners` has places on the board in millimetres, image points in
/// pixels, and rays in the camera frame. The result is `None` if the corners determine no pose.
///
/// A ray s of the corner (X, Y) is parallel to H (X, Y, 1)ᵀ with the homography H = λ [r₁ r₂ t], so that
/// s × H (X, Y, 1)ᵀ = 0. These equations are linear in H, and hold for rays at more than 90° off axis as well. The
/// smallest eigenvector of their normal matrix is H (Hartley & Zisserman 2004, 4.1, with rays in the place of image
/// points). The rotation is the nearest one to [r₁ r₂ r₁×r₂].
pub(super) fn pose_from_rays(corners: &[([f64; 2], [f64; 2], [f64; 3])]) -> Option<Result<Block, Mirrored>> {
    if corners.len() < MIN_CORNERS {
        return None;
    }
    let n = corners.len() as f64;
    let mean = [0, 1].map(|k| corners.iter().map(|(place, ..)| place[k]).sum::<f64>() / n);
    let square = |place: &[f64; 2]| (place[0] - mean[0]).powi(2) + (place[1] - mean[1]).powi(2);
    let scale = (corners.iter().map(|(place, ..)| square(place)).sum::<f64>() / n).sqrt();
    let centred = |place: &[f64; 2]| Vector3::new((place[0] - mean[0]) / scale, (place[1] - mean[1]) / scale, 1.0);
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (place, _, ray) in corners {
        let (p, cross) = (centred(place), Vector3::from(*ray).normalize().cross_matrix());
        for row in cross.row_iter() {
            // The unknowns are the rows of H, one after the other.
            let equation = SVector::<f64, 9>::from_fn(|i, _| row[i / 3] * p[i % 3]);
            normal += equation * equation.transpose();
        }
    }
    let eigen = SymmetricEigen::new(normal);
    let solution = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let mut h = Matrix3::from_fn(|row, column| solution[3 * row + column]);
    let ahead = corners.iter().filter(|(place, _, ray)| (h * centred(place)).dot(&Vector3::from(*ray)) > 0.0).count();
    if 2 * ahead < corners.len() {
        h = -h;
    }
    let size = (h.column(0).norm() * h.column(1).norm()).sqrt();
    let [r1, r2, middle] = [0, 1, 2].map(|k| h.column(k) / size);
    let rough = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    let middle = middle * scale;
    if !(size > 0.0) || !rough.iter().chain(middle.iter()).all(|x| x.is_finite()) {
        return None;
    }
    let rotation = Rotation3::from_matrix_eps(&rough, 1e-12, 100, Rotation3::identity());
    let translation = middle - rotation * Vector3::new(mean[0], mean[1], 0.0);
    // From the front, the third axis of the board points away from the camera.
    if (rotation * Vector3::z()).dot(&middle) <= 0.0 {
        return Some(Err(Mirrored));
    }
    let observation = |(place, at_px, _): &([f64; 2], [f64; 2], [f64; 3])| Observation {
        place: Vector3::new(place[0], place[1], 0.0),
        at_px: *at_px,
        weight: 1.0,
        by_bow: [0.0; BOW],
    };
    let observations = corners.iter().map(observation).collect();
    Some(Ok(Block { rotation, translation: Some(translation), observations }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_rays_give_the_pose() {
        let rotation = Rotation3::from_euler_angles(0.4, -0.7, 0.3);
        // The board is far off axis, so that some rays point backwards.
        let translation = Vector3::new(-400.0, -60.0, 20.0);
        let place = |i: usize| [30.0 * (i % 5) as f64, 30.0 * (i / 5) as f64];
        let ray = |i| (rotation * Vector3::new(place(i)[0], place(i)[1], 0.0) + translation).into();
        let corners: Vec<_> = (0..20).map(|i| (place(i), [0.0; 2], ray(i))).collect();
        let block = pose_from_rays(&corners).unwrap();
        let facing = (rotation * Vector3::z()).dot(&(rotation * Vector3::new(60.0, 45.0, 0.0) + translation)) > 0.0;
        assert!(facing);
        let block = block.unwrap();
        assert!((block.rotation.inverse() * rotation).angle() < 1e-6);
        assert!((block.translation.unwrap() - translation).norm() < 1e-4);
        // The numbering from right to left is that of a mirrored board.
        let mirrored: Vec<_> = (0..20).map(|i| ([120.0 - place(i)[0], place(i)[1]], [0.0; 2], ray(i))).collect();
        assert_eq!(pose_from_rays(&mirrored).unwrap().unwrap_err(), Mirrored);
        assert!(pose_from_rays(&corners[..5]).is_none());
    }
}
