//! The messages of CCSDS that `hzn fuse` writes.

use std::path::Path;

use crate::fuse::fuse;

/// Compares the last covariance, in km², with that of a row of nav.csv (`states`): the lower triangle of position and
/// velocity.
pub(crate) fn has_the_covariance_of(covariances: &str, states: &str, row: &str) {
    let header = states.lines().next().unwrap();
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

/// The second version of the message has fewer keywords and the same attitudes.
pub(crate) fn second_version_of_the_aem(at: &Path, args: &[&str]) {
    let second = ["-o", "second.csv", "--aem", "second.aem", "--aem-version", "2.0"];
    assert_eq!(fuse(at, &[args, &second].concat()).0, 0);
    let [first, second] = ["nav.aem", "second.aem"].map(|name| std::fs::read_to_string(at.join(name)).unwrap());
    assert!(second.starts_with("CCSDS_AEM_VERS = 2.0\n") && !second.contains("ATTITUDE_DIR"), "{}", &second[..500]);
    let states = |text: &str| text.split_once("DATA_START").unwrap().1.to_owned();
    assert_eq!(states(&first), states(&second));
}
