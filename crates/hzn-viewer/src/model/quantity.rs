//! The quantities that can be plotted over time.

use hzn_evaluate::{MeasuredDirection, MeasuredPosition, Miss, PositionMiss};
use hzn_files::truth::Truth;
use hzn_mcap::Row;

/// A quantity that can be plotted over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Name of the quantity.
    pub name: &'static str,
    /// Unit of the quantity.
    pub unit: &'static str,
    /// Lines of the plot: the name and the value of each.
    pub lines: &'static [(&'static str, RowValue)],
    /// True if only some sequences have values; without values it is not offered.
    pub is_optional: bool,
    /// Range in which nearly all values of a right sensor lie.
    pub band: Option<[f64; 2]>,
}

impl Quantity {
    const fn with_band(self, band: [f64; 2]) -> Self {
        Self { band: Some(band), ..self }
    }
}

const fn always(name: &'static str, unit: &'static str, lines: &'static [(&'static str, RowValue)]) -> Quantity {
    Quantity { name, unit, lines, is_optional: false, band: None }
}

const fn optional(name: &'static str, unit: &'static str, lines: &'static [(&'static str, RowValue)]) -> Quantity {
    Quantity { name, unit, lines, is_optional: true, band: None }
}

/// Function that returns a value of a result, possibly compared with the truth.
pub type RowValue = fn(&Row, Option<&Truth>) -> Option<f64>;

/// All quantities that can be plotted.
pub const QUANTITIES: &[Quantity] = &[
    always("Axis", "", &[("x", |r, _| r.axis_x), ("y", |r, _| r.axis_y), ("z", |r, _| r.axis_z)]),
    always("3 sigma", "°", &[("3σ", |r, _| Some(3.0 * r.sigma_max_deg?))]),
    optional("Error (truth)", "°", &[("error", error_deg), ("3σ", |r, t| t.and(Some(3.0 * r.sigma_max_deg?)))]),
    // The error has no sign, because it is the root of the NEES.
    optional("Error over σ (truth)", "", &[("error/σ", error_sigmas)]).with_band([0.0, 3.0]),
    always("RMS", "px", &[("rms", |r, _| r.rms_px)]),
    optional("Probability of the limb", "", &[("p", |r, _| r.p_limb)]),
    optional(
        "Protection level",
        "°",
        &[("level", |r, _| r.protection_deg), ("error", |r, t| r.protection_deg.and(error_deg(r, t)))],
    ),
    always(
        "Points",
        "",
        &[("edge points", |r, _| r.edge_points.map(f64::from)), ("inliers", |r, _| r.inliers.map(f64::from))],
    ),
    always("Half-angle", "°", &[("fitted", |r, _| r.half_angle_deg)]),
    always("Altitude", "km", &[("estimated", |r, _| r.altitude_est_km), ("given", |r, _| r.altitude_km)]),
    optional("Fit − expected over σ", "", &[("altitude", altitude_sigmas)]).with_band([-3.0, 3.0]),
    optional(
        "Position",
        "km",
        &[("x", |r, _| r.position_x_km), ("y", |r, _| r.position_y_km), ("z", |r, _| r.position_z_km)],
    ),
    optional("Range", "km", &[("to the centre of the body", range_km)]),
    optional("Position 3σ", "km", &[("range", range_3sigma_km), ("cross-range", cross_range_3sigma_km)]),
    optional(
        "Range error (truth)",
        "km",
        &[
            ("error", |r, t| Some(position_miss(r, t)?.range_km)),
            ("3σ", |r, t| position_miss(r, t).and(range_3sigma_km(r, t))),
        ],
    ),
    optional(
        "Cross-range error (truth)",
        "km",
        &[
            ("error", |r, t| Some(position_miss(r, t)?.cross_range_km)),
            ("3σ", |r, t| position_miss(r, t).and(cross_range_3sigma_km(r, t))),
        ],
    ),
    optional("Third axis", "°", &[("rotation", |r, _| r.yaw_deg), ("3σ", |r, _| Some(3.0 * r.yaw_sigma_deg?))]),
    always("Threshold", "counts", &[("threshold", |r, _| r.level.map(f64::from))]),
    always("Roll, pitch", "°", &[("roll", |r, _| r.roll_deg), ("pitch", |r, _| r.pitch_deg)]),
    always("Processing", "µs", &[("processing", |r, _| r.elapsed_us)]),
];

/// Returns by how many sigmas the altitude from the free half-angle differs from the given one. The half-angle depends
/// on the altitude alone, so its difference from the expected one counts as many sigmas.
fn altitude_sigmas(row: &Row, _: Option<&Truth>) -> Option<f64> {
    let sigma_km = row.altitude_est_sigma_km.filter(|sigma| *sigma > 0.0)?;
    Some((row.altitude_est_km? - row.altitude_km?) / sigma_km)
}

/// Returns the distance to the centre of the body, from a result with a position.
fn range_km(row: &Row, _: Option<&Truth>) -> Option<f64> {
    let [x, y, z] = row.position_km()?;
    Some((x * x + y * y + z * z).sqrt())
}

fn position(row: &Row) -> Option<MeasuredPosition> {
    Some(MeasuredPosition { centre_km: row.position_km()?, covariance_km2: row.position_covariance_km2()? })
}

/// Returns 3-sigma of [`range_km`].
fn range_3sigma_km(row: &Row, _: Option<&Truth>) -> Option<f64> {
    Some(3.0 * position(row)?.sigmas_km()?[0])
}

/// Returns 3-sigma of the position in the worst direction perpendicular to the line to the body.
fn cross_range_3sigma_km(row: &Row, _: Option<&Truth>) -> Option<f64> {
    Some(3.0 * position(row)?.sigmas_km()?[1])
}

/// Returns the errors of a position, if there is a truth.
fn position_miss(row: &Row, truth: Option<&Truth>) -> Option<PositionMiss> {
    PositionMiss::new(&position(row)?, truth?.position_km()?)
}

/// Returns the angle between an answer and the truth, in degrees.
pub fn error_deg(row: &Row, truth: Option<&Truth>) -> Option<f64> {
    Some(angle_deg(row.axis()?, truth?.axis()?.xyz()))
}

/// Returns the error of an answer over its 1-sigma in the direction of the error, as `hzn evaluate` counts it: the root
/// of the NEES. `None` without a truth.
pub fn error_sigmas(row: &Row, truth: Option<&Truth>) -> Option<f64> {
    sigmas_from(row, truth?.axis()?.xyz())
}

/// Returns the angle from an answer to a direction, over the 1-sigma of the answer in this direction.
fn sigmas_from(row: &Row, right: [f64; 3]) -> Option<f64> {
    let found = MeasuredDirection {
        axis: row.axis()?,
        covariance_rad2: row.covariance()?,
        common_rad2: None,
        half_angle_deg: None,
        protection_deg: None,
    };
    // The half-angle has no part in the error of the direction.
    Miss::new(&found, right, 1.0)?.nees.map(f64::sqrt)
}

/// Returns true if the truth lies outside of the 3-sigma of an answer.
pub fn misses_truth(row: &Row, truth: Option<&Truth>) -> bool {
    error_sigmas(row, truth).is_some_and(|sigmas| sigmas > 3.0)
}

/// An RMS of the residuals that is this many times as large as expected is marked. The RMS of many points hardly
/// scatters, so that a larger one is another edge, a wrong lens, or clouds.
const MOST_RMS: f64 = 3.0;

/// A told noise below this is no expectation of an RMS, px: no camera shows the places of edges so well.
/// `hzn calibrate noise` writes 0.001 if other keys have the whole error.
const LEAST_TOLD_PX: f64 = 0.01;

/// The RMS of residuals that is expected of an answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExpectedRms {
    /// sensor.toml tells it (`covariance.sigma_px`), px.
    Told(f64),
    /// The median of all answers, px: a noise that is a default says nothing about the camera.
    Typical(f64),
}

impl ExpectedRms {
    /// Returns the told one, or else that of these results; `None` without answers.
    pub fn new<'a>(told_px: Option<f64>, rows: impl Iterator<Item = &'a Row>) -> Option<Self> {
        if let Some(px) = told_px.filter(|px| *px >= LEAST_TOLD_PX) {
            return Some(Self::Told(px));
        }
        let mut all: Vec<f64> = rows.filter_map(|row| row.rms_px.filter(|_| row.axis().is_some())).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().map(Self::Typical)
    }

    /// Says that the RMS of an answer is too large; `None` if it is not.
    pub fn exceeded_by(self, row: &Row) -> Option<String> {
        let (expected_px, whose) = match self {
            Self::Told(px) => (px, "that sensor.toml tells"),
            Self::Typical(px) => (px, "that are usual in these pictures"),
        };
        let times = row.rms_px.filter(|_| row.axis().is_some())? / expected_px;
        (times > MOST_RMS).then(|| format!("The RMS is {times:.1} times the {expected_px:.2} px {whose}."))
    }
}

/// Returns the angle between two directions, in degrees. It is also accurate for small angles.
pub fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    cross.iter().map(|c| c * c).sum::<f64>().sqrt().atan2(dot).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_have_their_sigmas_along_and_across_the_line_of_sight() {
        let meta =
            hzn_mcap::RowMeta { index: 0, file: "a".into(), time_s: None, body: "earth".into(), altitude_km: None };
        let mut row = Row::unprocessed(&meta, hzn_core::status::Status::Ok, "");
        assert_eq!(range_km(&row, None), None);
        (row.position_x_km, row.position_y_km, row.position_z_km) = (Some(0.0), Some(300.0), Some(400.0));
        assert_eq!(range_km(&row, None), Some(500.0));
        (row.pos_cov_xx_km2, row.pos_cov_xy_km2, row.pos_cov_xz_km2) = (Some(100.0), Some(0.0), Some(0.0));
        (row.pos_cov_yy_km2, row.pos_cov_yz_km2, row.pos_cov_zz_km2) = (Some(4.0), Some(0.0), Some(4.0));
        assert!((range_3sigma_km(&row, None).unwrap() - 6.0).abs() < 1e-12);
        // Across the line of sight, x has the largest sigma.
        assert!((cross_range_3sigma_km(&row, None).unwrap() - 30.0).abs() < 1e-12);
        assert!(position_miss(&row, None).is_none());
    }

    /// The error is along the smaller sigma: 4 of it, and 0.4 of the larger one.
    #[test]
    fn an_error_counts_in_the_sigma_of_its_direction() {
        let meta =
            hzn_mcap::RowMeta { index: 0, file: "a".into(), time_s: None, body: "earth".into(), altitude_km: None };
        let mut row = Row::unprocessed(&meta, hzn_core::status::Status::Ok, "");
        (row.axis_x, row.axis_y, row.axis_z, row.sigma_max_deg) = (Some(0.0), Some(0.0), Some(1.0), Some(0.573));
        (row.cov_xx, row.cov_xy, row.cov_xz) = (Some(1e-4), Some(0.0), Some(0.0));
        (row.cov_yy, row.cov_yz, row.cov_zz) = (Some(1e-6), Some(0.0), Some(0.0));
        let e = 0.004f64;
        assert!((sigmas_from(&row, [0.0, e.sin(), e.cos()]).unwrap() - 4.0).abs() < 1e-6);
        assert!((sigmas_from(&row, [e.sin(), 0.0, e.cos()]).unwrap() - 0.4).abs() < 1e-6);
    }

    #[test]
    fn the_free_fit_counts_in_its_own_sigma() {
        let meta = hzn_mcap::RowMeta {
            index: 0,
            file: "a".into(),
            time_s: None,
            body: "earth".into(),
            altitude_km: Some(240.0),
        };
        let mut row = Row::unprocessed(&meta, hzn_core::status::Status::Ok, "");
        assert_eq!(altitude_sigmas(&row, None), None);
        (row.altitude_est_km, row.altitude_est_sigma_km) = (Some(228.0), Some(4.0));
        assert_eq!(altitude_sigmas(&row, None), Some(-3.0));
    }

    #[test]
    fn an_rms_is_compared_with_the_told_noise_or_with_other_answers() {
        let row = |rms_px| {
            let meta =
                hzn_mcap::RowMeta { index: 0, file: "a".into(), time_s: None, body: "earth".into(), altitude_km: None };
            let mut row = Row::unprocessed(&meta, hzn_core::status::Status::Ok, "");
            (row.axis_x, row.axis_y, row.axis_z, row.rms_px) = (Some(0.0), Some(0.0), Some(1.0), Some(rms_px));
            row
        };
        let all = [row(0.3), row(0.35), row(1.2)];
        let typical = ExpectedRms::new(None, all.iter()).unwrap();
        assert_eq!(typical, ExpectedRms::Typical(0.35));
        assert!(typical.exceeded_by(&all[2]).unwrap().contains("3.4 times the 0.35 px that are usual"));
        assert_eq!(typical.exceeded_by(&all[0]), None);
        let told = ExpectedRms::new(Some(0.1), all.iter()).unwrap();
        assert!(told.exceeded_by(&all[1]).unwrap().contains("3.5 times the 0.10 px that sensor.toml tells"));
        assert_eq!(ExpectedRms::new(Some(0.001), all.iter()), Some(typical), "the floor that a calibration writes");
        assert_eq!(ExpectedRms::new(None, [].iter()), None);
    }

    #[test]
    fn small_angles_are_exact() {
        let e = 1e-9f64;
        assert!((angle_deg([0.0, 0.0, 1.0], [e.sin(), 0.0, e.cos()]) / e.to_degrees() - 1.0).abs() < 1e-6);
        assert!((angle_deg([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]) - 180.0).abs() < 1e-12);
    }

    #[test]
    fn every_quantity_has_a_line_and_an_own_name() {
        let names: std::collections::HashSet<_> = QUANTITIES.iter().map(|q| q.name).collect();
        assert_eq!(names.len(), QUANTITIES.len());
        assert!(QUANTITIES.iter().all(|q| !q.lines.is_empty()));
    }
}
