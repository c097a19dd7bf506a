//! Probabilities of deviations, with few degrees of freedom.

/// Returns the number of sigmas of a normal law with the same probability as the value `t` of Student's law. The
/// approximation of Wallace (1959) has an error below 2 % of a sigma from 5 degrees of freedom on.
pub(super) fn normal_sigmas(t: f64, freedom: f64) -> f64 {
    let z = (freedom * (t * t / freedom).ln_1p()).sqrt() * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
    z * t.signum()
}

/// Returns the value of Student's law with the same probability as `z` sigmas of a normal law.
pub(super) fn student_t(z: f64, freedom: f64) -> f64 {
    let scaled = z * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    (freedom * (scaled * scaled / freedom).exp_m1()).sqrt() * z.signum()
}

/// Returns the probability that a normal deviate is farther from 0 than `z` sigmas.
pub(super) fn two_sided(z: f64) -> f64 {
    libm::erfc(z.abs() / core::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn students_law_has_wider_tails() {
        // The two-sided 0.27 % point of Student's law is 3.957 for 10 degrees of freedom, and 3.277 for 30.
        assert!((student_t(3.0, 10.0) - 3.957).abs() < 0.03, "{}", student_t(3.0, 10.0));
        assert!((student_t(3.0, 30.0) - 3.270).abs() < 0.02, "{}", student_t(3.0, 30.0));
        assert!((normal_sigmas(student_t(-2.5, 8.0), 8.0) + 2.5).abs() < 1e-12);
        assert!((two_sided(3.0) - 0.0027).abs() < 1e-5);
    }
}
