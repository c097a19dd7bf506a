//! The quantities that can be plotted over time.

use hzn_mcap::Row;
use hzn_sim::truth::Truth;

/// A quantity that can be plotted over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Name of the quantity.
    pub name: &'static str,
    /// Unit of the quantity.
    pub unit: &'static str,
    /// Lines of the plot: the name and the value of each.
    pub lines: &'static [(&'static str, RowValue)],
}

/// Function that returns a value of a result, possibly compared with the truth.
pub type RowValue = fn(&Row, Option<&Truth>) -> Option<f64>;

/// All quantities that can be plotted.
pub const QUANTITIES: &[Quantity] = &[
    Quantity {
        name: "Axis",
        unit: "",
        lines: &[("x", |r, _| r.axis_x), ("y", |r, _| r.axis_y), ("z", |r, _| r.axis_z)],
    },
    Quantity { name: "3 sigma", unit: "°", lines: &[("3σ", |r, _| Some(3.0 * r.sigma_max_deg?))] },
    Quantity {
        name: "Error (truth)",
        unit: "°",
        lines: &[("error", error_deg), ("3σ", |r, t| t.and(Some(3.0 * r.sigma_max_deg?)))],
    },
    Quantity { name: "RMS", unit: "px", lines: &[("rms", |r, _| r.rms_px)] },
    Quantity {
        name: "Points",
        unit: "",
        lines: &[("edge points", |r, _| r.edge_points.map(f64::from)), ("inliers", |r, _| r.inliers.map(f64::from))],
    },
    Quantity { name: "Half-angle", unit: "°", lines: &[("fitted", |r, _| r.half_angle_deg)] },
    Quantity {
        name: "Altitude",
        unit: "km",
        lines: &[("estimated", |r, _| r.altitude_est_km), ("given", |r, _| r.altitude_km)],
    },
    Quantity { name: "Range", unit: "km", lines: &[("to the centre of the body", range_km), ("3σ", range_3sigma_km)] },
    Quantity { name: "Threshold", unit: "counts", lines: &[("threshold", |r, _| r.level.map(f64::from))] },
    Quantity { name: "Roll, pitch", unit: "°", lines: &[("roll", |r, _| r.roll_deg), ("pitch", |r, _| r.pitch_deg)] },
    Quantity { name: "Processing", unit: "µs", lines: &[("processing", |r, _| r.elapsed_us)] },
];

/// Returns the distance to the centre of the body, from a result with a position.
fn range_km(row: &Row, _: Option<&Truth>) -> Option<f64> {
    let [x, y, z] = row.position_km()?;
    Some((x * x + y * y + z * z).sqrt())
}

/// Returns 3-sigma of [`range_km`]: the covariance of the position along its own direction.
fn range_3sigma_km(row: &Row, truth: Option<&Truth>) -> Option<f64> {
    let range = range_km(row, truth)?;
    let [x, y, z] = row.position_km()?.map(|v| v / range);
    let [xx, xy, xz, yy, yz, zz] = row.position_covariance_km2()?;
    let variance = x * x * xx + y * y * yy + z * z * zz + 2.0 * (x * y * xy + x * z * xz + y * z * yz);
    Some(3.0 * variance.max(0.0).sqrt())
}

/// Returns the angle between an answer and the truth, in degrees.
pub fn error_deg(row: &Row, truth: Option<&Truth>) -> Option<f64> {
    Some(angle_deg(row.axis()?, truth?.axis()?.xyz()))
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
    fn the_range_has_the_sigma_along_the_line_of_sight() {
        let meta =
            hzn_mcap::RowMeta { index: 0, file: "a".into(), time_s: None, body: "earth".into(), altitude_km: None };
        let mut row = Row::unprocessed(&meta, hzn_core::status::Status::Ok, "");
        assert_eq!(range_km(&row, None), None);
        (row.position_x_km, row.position_y_km, row.position_z_km) = (Some(0.0), Some(300.0), Some(400.0));
        assert_eq!(range_km(&row, None), Some(500.0));
        (row.pos_cov_xx_km2, row.pos_cov_xy_km2, row.pos_cov_xz_km2) = (Some(100.0), Some(0.0), Some(0.0));
        (row.pos_cov_yy_km2, row.pos_cov_yz_km2, row.pos_cov_zz_km2) = (Some(4.0), Some(0.0), Some(4.0));
        assert!((range_3sigma_km(&row, None).unwrap() - 6.0).abs() < 1e-12);
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
