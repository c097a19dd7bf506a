//! The covariances of an orbit ephemeris message.

/// Compares the last covariance, in km², with that of a row of nav.csv: the lower triangle of position and velocity.
pub(crate) fn has_the_covariance_of(covariances: &str, header: &str, row: &str) {
    let cell = |name: &str| {
        let column = header.split(',').position(|n| n == name).unwrap();
        row.split(',').nth(column).unwrap().parse::<f64>().unwrap()
    };
    let lines: Vec<&str> = covariances.lines().collect();
    // A covariance has its time, its frame and six rows.
    let times = lines.iter().filter(|line| line.starts_with("EPOCH = ")).count();
    assert!(times > 0 && lines.len() == 8 * times + 1, "{times} of {}", lines.len());
    assert_eq!(lines.last(), Some(&"COVARIANCE_STOP"));
    let triangle = &lines[lines.len() - 7..lines.len() - 1];
    for (n, name) in [(0, "position_cov_xx_m2"), (2, "position_cov_zz_m2"), (3, "velocity_cov_xx_m2ps2")] {
        let numbers: Vec<f64> = triangle[n].split(' ').map(|word| word.parse().unwrap()).collect();
        assert_eq!(numbers.len(), n + 1);
        assert!((numbers[n] * 1e6 / cell(name) - 1.0).abs() < 1e-3, "{name}: {numbers:?} {}", cell(name));
    }
}
