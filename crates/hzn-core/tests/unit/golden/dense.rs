//! Compares the covariance with dense matrices.

use super::*;

/// Compares with `covariance.json`, which comes from dense matrices. `tangent` is evaluated at the true nadir with the
/// rays themselves.
fn sandwich<T: Real>(tolerance: f64) {
    for case in load(include_str!("../../golden/covariance.json")) {
        let camera = Camera::<T>::try_new(&camera_config(&case["camera"])).unwrap();
        let e = direction::<T>(triple(&case["nadir_c"]));
        let points: Vec<(f64, f64)> =
            case["pixels"].as_array().unwrap().iter().map(|p| (num(&p[0]), num(&p[1]))).collect();
        let mut blocks = blocks(&camera, &points, &e);
        for (i, step) in case["step_px"].as_array().unwrap().iter().enumerate() {
            blocks[(i + 1) / LANES].step_px[(i + 1) % LANES] = T::from_f64(num(step));
        }
        let (b1, b2) = basis(e.v());
        let c = T::from_f64(num(&case["cos_alpha"]));
        let mean = fit::means(&blocks, &b1, &b2);
        let sums = fit::pass(&mut blocks, e.v(), &b1, &b2, T::one() - c, mean, &fit::Weights::Kept, None);
        let x = covariance::correlated(&blocks, e.v(), &b1, &b2, mean, T::from_f64(num(&case["L_px"])));
        let variance = T::from_f64(num(&case["R_px2"]));
        let [known, free] = [false, true]
            .map(|free| covariance::sandwich(&covariance::response(&sums, mean, free).unwrap(), &x) * variance);
        let known = [known.m11, known.m12, known.m22];
        let compare = |name: &str, got: [T; 3]| {
            let got = Cov3::<Cam, T>::from_tangent(&b1, &b2, got).rows();
            let want = rows(&case["tangent"][name]);
            let scale = want.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
            for i in 0..3 {
                for j in 0..3 {
                    let off = (got[i][j].to_f64() - want[i][j]).abs() / scale;
                    assert!(off < tolerance, "{} {name} [{i}][{j}]: {off:e}", case["id"]);
                }
            }
        };
        compare("wls_sandwich", known);
        compare("free_alpha_wls_sandwich", [free.m11, free.m12, free.m22]);
        let want = num(&case["tangent"]["var_cos_alpha_free"]);
        assert!((free.m33.to_f64() / want - 1.0).abs() < tolerance, "{}: var cos", case["id"]);
    }
}

#[test]
fn covariance_equals_the_dense_product() {
    sandwich::<f64>(1e-8);
    sandwich::<f32>(1e-4);
}

/// Computes P = N⁻¹ (Hᵀ W G R Gᵀ W H) N⁻¹ with whole matrices, where R is the correlation of every pair of points.
/// Returns P of (δ₁, δ₂, δc), and P of δ₁₂ with c fixed.
fn dense<T: Real>(
    blocks: &[Block<T>],
    count: usize,
    [e, b1, b2]: [&V3<T>; 3],
    length_px: f64,
) -> (nalgebra::Matrix3<f64>, nalgebra::Matrix2<f64>) {
    use nalgebra::{DMatrix, Matrix2, Matrix3};
    let lane = |i: usize| (&blocks[i / LANES], i % LANES);
    let mut along = 0.0;
    let arc: Vec<f64> = (0..count)
        .map(|i| {
            let (block, l) = lane(i);
            along += if i == 0 { 0.0 } else { block.step_px[l].to_f64() };
            along
        })
        .collect();
    // Rows w h for both components, (u, v), of the error of every point.
    let mut wh = [DMatrix::<f64>::zeros(count, 3), DMatrix::<f64>::zeros(count, 3)];
    let mut n = Matrix3::<f64>::zeros();
    for i in 0..count {
        let (block, l) = lane(i);
        let g = block.gradient_at(l, e).map(Real::to_f64);
        let s = block.ray(l);
        let h = nalgebra::Vector3::new(s.dot(b1).to_f64(), s.dot(b2).to_f64(), -1.0);
        let w = block.weight[l].to_f64() / (g[0] * g[0] + g[1] * g[1]);
        n += h * h.transpose() * w;
        for k in 0..2 {
            wh[k].set_row(i, &(h * (w * g[k])).transpose());
        }
    }
    let r = DMatrix::from_fn(count, count, |i, j| libm::exp(-(arc[i] - arc[j]).abs() / length_px));
    let x = wh.iter().map(|b| b.transpose() * &r * b).fold(DMatrix::zeros(3, 3), |a, b| a + b);
    let x = Matrix3::from_iterator(x.iter().copied());
    let inverse = n.try_inverse().unwrap();
    let known: Matrix2<f64> = n.fixed_view::<2, 2>(0, 0).into_owned().try_inverse().unwrap();
    (inverse * x * inverse, known * x.fixed_view::<2, 2>(0, 0) * known)
}

/// Compares the recursion with the dense product of the same numbers, on an edge as long as in real pictures.
fn recursion<T: Real>(tolerance: f64) {
    let (camera, e) = rocket_camera();
    let c = 0.157;
    // The steps are one pixel and more, as on a thinned border.
    let mut rng = crate::base::rng::Rng::new(11);
    let points: Vec<_> = limb(&camera, &e, c, 1.0).into_iter().filter(|_| rng.below(3) > 0).collect();
    let camera =
        Camera::<T>::try_new(&CameraConfig::ideal(Model::Pinhole, camera.width(), camera.height(), 888.97)).unwrap();
    let e = direction::<T>(e.xyz());
    let (b1, b2) = basis(e.v());
    for length_px in [3.0, 300.0, 1e4] {
        let mut blocks = blocks(&camera, &points, &e);
        let mean = fit::means(&blocks, &b1, &b2);
        let weights = fit::Weights::Kept;
        let sums = fit::pass(&mut blocks, e.v(), &b1, &b2, T::from_f64(1.0 - c), mean, &weights, None);
        let x = covariance::correlated(&blocks, e.v(), &b1, &b2, mean, T::from_f64(length_px));
        let [known, free] =
            [false, true].map(|free| covariance::sandwich(&covariance::response(&sums, mean, free).unwrap(), &x));
        let [a, b, d] = [known.m11, known.m12, known.m22];
        let (want, want_known) = dense(&blocks, points.len(), [e.v(), &b1, &b2], length_px);
        let mut worst: f64 = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                let scale = libm::sqrt(want[(i, i)] * want[(j, j)]);
                worst = worst.max((free[(i, j)].to_f64() - want[(i, j)]).abs() / scale);
            }
        }
        let scale = want_known.trace();
        for (got, want) in [(a, want_known[(0, 0)]), (b, want_known[(0, 1)]), (d, want_known[(1, 1)])] {
            worst = worst.max((got.to_f64() - want).abs() / scale);
        }
        assert!(worst < tolerance, "{} points, {length_px} px: {worst:e}", points.len());
    }
}

#[test]
fn the_recursion_equals_the_dense_product() {
    recursion::<f64>(1e-10);
    recursion::<f32>(1e-4);
}
