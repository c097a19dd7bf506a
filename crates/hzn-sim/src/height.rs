//! The height of the visible limb, which may depend on latitude.

use crate::scene::Scene;

/// Limb height by latitude, as a sorted table.
#[derive(Debug, Clone)]
pub(crate) struct LimbHeight {
    /// Limb height of the scene's body, metres. It applies if there is no table, and the scene's globe is raised by it.
    pub(crate) reference_m: f64,
    /// (latitude in radians, height in metres), in rising order of latitude.
    table: Vec<(f64, f64)>,
}

impl LimbHeight {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut table: Vec<(f64, f64)> =
            scene.limb_height_by_latitude_km.iter().map(|[lat_deg, km]| (lat_deg.to_radians(), km * 1e3)).collect();
        table.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { reference_m: scene.body.limb_height_km * 1e3, table }
    }

    /// Returns the height in metres at a geodetic latitude; it is constant beyond the ends of the table.
    pub(crate) fn height_m(&self, lat_rad: f64) -> f64 {
        let after = self.table.partition_point(|row| row.0 < lat_rad);
        match (after.checked_sub(1).and_then(|i| self.table.get(i)), self.table.get(after)) {
            (Some(&(l0, h0)), Some(&(l1, h1))) => h0 + (h1 - h0) * (lat_rad - l0) / (l1 - l0),
            (Some(&(_, h)), None) | (None, Some(&(_, h))) => h,
            (None, None) => self.reference_m,
        }
    }

    pub(crate) fn is_variable(&self) -> bool {
        !self.table.is_empty()
    }

    /// Returns the largest distance of the table's heights from the reference height, in metres.
    pub(crate) fn largest_departure_m(&self) -> f64 {
        self.table.iter().fold(0.0, |m, row| (row.1 - self.reference_m).abs().max(m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_and_beyond_the_rows() {
        let h = LimbHeight { reference_m: 1.0, table: vec![(-1.0, 10.0), (0.0, 20.0), (1.0, 40.0)] };
        let got = [-2.0, -1.0, -0.5, 0.0, 0.25, 1.0, 1.5].map(|lat| h.height_m(lat));
        assert_eq!(got, [10.0, 10.0, 15.0, 20.0, 25.0, 40.0, 40.0]);
        assert_eq!(h.largest_departure_m(), 39.0);
        assert_eq!(LimbHeight { reference_m: 7.0, table: Vec::new() }.height_m(0.3), 7.0);
    }
}
