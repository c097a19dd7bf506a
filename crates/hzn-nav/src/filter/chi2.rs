//! Limits of chi-square for the gates.
//!
//! The inverse has no closed form for one and three degrees of freedom, so the limit is found by bisection. A table
//! would fix the probabilities, which are an option of the filter.

/// Returns the value that chi-square with 1, 2 or 3 degrees of freedom exceeds with this probability.
pub fn chi2_limit(freedom: usize, probability: f64) -> f64 {
    let probability = probability.clamp(1e-15, 0.5);
    // 100 is above every limit, because three degrees of freedom exceed only 73 with the smallest probability.
    let (mut low, mut high) = (0.0, 100.0);
    // The count is fixed, so that the loop always ends. Eighty halvings of 100 are more than a double resolves.
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if exceeds(freedom, middle) > probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Returns the probability that chi-square is above a value.
fn exceeds(freedom: usize, x: f64) -> f64 {
    let root = libm::sqrt(0.5 * x);
    match freedom {
        1 => libm::erfc(root),
        2 => libm::exp(-0.5 * x),
        _ => libm::erfc(root) + libm::sqrt(2.0 * x / core::f64::consts::PI) * libm::exp(-0.5 * x),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_tables() {
        for (freedom, probability, limit) in [
            (1, 0.05, 3.841),
            (2, 0.05, 5.991),
            (3, 0.05, 7.815),
            (1, 1e-3, 10.828),
            (2, 1e-3, 13.816),
            (3, 1e-3, 16.266),
        ] {
            assert!((chi2_limit(freedom, probability) - limit).abs() < 1e-3, "{freedom} {probability}");
        }
    }
}
