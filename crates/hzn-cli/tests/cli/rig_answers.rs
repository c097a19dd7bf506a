//! What the joint answers of a rig say: the covariance.

use hzn_core::frames::Cov3;
use nalgebra::Matrix3;

use crate::common::cell;
use crate::rig::{ring, run};

fn number(row: &[(String, String)], name: &str) -> f64 {
    cell(row, name).parse().unwrap_or_else(|_| panic!("{name}: {:?}", cell(row, name)))
}

/// Returns the covariance in the columns with this name.
fn covariance(row: &[(String, String)], name: &str) -> Matrix3<f64> {
    let upper = ["xx", "xy", "xz", "yy", "yz", "zz"].map(|end| number(row, &format!("{name}_{end}")));
    let rows = Cov3::<hzn_core::frames::Vehicle, f64>::from_upper(upper).rows();
    Matrix3::from_fn(|i, j| rows[i][j])
}

#[test]
fn joint_answers_tell_a_filter_what_the_next_epoch_shares() {
    let (joint, heads) = run(&ring(), &[], 0);
    for row in &joint {
        let (whole, common) = (covariance(row, "cov"), covariance(row, "cov_common"));
        // The tilt and the weather of the limb are most of the error, and the noise is a part of it.
        assert!(common.trace() > 0.5 * whole.trace(), "{whole} {common}");
        let rest = (whole - common).symmetric_eigenvalues();
        assert!(rest.max() > 0.0 && rest.min() > -1e-9 * whole.trace(), "{rest}");
    }
    // A head alone shares its limb height with the next picture, which is far more.
    for row in &heads {
        assert!(covariance(row, "cov_common").trace() > covariance(&joint[0], "cov_common").trace());
    }
}
