//! Values by height and latitude, with linear interpolation.

/// Values at heights and latitudes. They are linear between the entries and constant beyond them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    pub(super) heights_km: Vec<f64>,
    pub(super) latitudes_deg: Vec<f64>,
    /// Values of one latitude after the other.
    pub(super) values: Vec<f32>,
}

/// Returns the entry before a value in a rising list, and the position between this entry and the next one, 0 to 1.
fn bracket(list: &[f64], x: f64) -> (usize, f32) {
    let i = list.partition_point(|v| *v <= x).clamp(1, list.len().max(2) - 1) - 1;
    match (list.get(i), list.get(i + 1)) {
        (Some(a), Some(b)) => (i, ((x - a) / (b - a)).clamp(0.0, 1.0) as f32),
        _ => (0, 0.0),
    }
}

impl Grid {
    /// Makes a grid; `value` gets a height in kilometres and a latitude in degrees.
    pub(crate) fn from_function(
        heights_km: Vec<f64>,
        latitudes_deg: Vec<f64>,
        value: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let values = latitudes_deg.iter().flat_map(|lat| heights_km.iter().map(|h| value(*h, *lat) as f32)).collect();
        Self { heights_km, latitudes_deg, values }
    }

    /// Returns the value at a height and a latitude.
    pub(crate) fn interpolate(&self, height_km: f64, latitude_deg: f64) -> f32 {
        let ((i, fr), (k, fc)) = (bracket(&self.latitudes_deg, latitude_deg), bracket(&self.heights_km, height_km));
        let cell = |i: usize, k: usize| {
            let (i, k) = (i.min(self.latitudes_deg.len() - 1), k.min(self.heights_km.len() - 1));
            self.values.get(i * self.heights_km.len() + k).copied().unwrap_or(0.0)
        };
        let by_height = |i: usize| cell(i, k) + fc * (cell(i, k + 1) - cell(i, k));
        by_height(i) + fr * (by_height(i + 1) - by_height(i))
    }

    /// Returns the mean over the globe of the value at the lowest height.
    pub(crate) fn lowest_mean(&self) -> f32 {
        let lowest = self.heights_km.first().copied().unwrap_or(0.0);
        mean_over_globe(|lat| f64::from(self.interpolate(lowest, lat))) as f32
    }

    /// Returns the outermost height in kilometres at which half of the value at the lowest height is left. Returns
    /// `None` if more than half is left at the largest height.
    pub(crate) fn half_level_km(&self, latitude_deg: f64) -> Option<f64> {
        let lowest = self.heights_km.first()?;
        let half = 0.5 * self.interpolate(*lowest, latitude_deg);
        let inside = self.heights_km.iter().rposition(|h| self.interpolate(*h, latitude_deg) > half)?;
        let (h0, h1) = (self.heights_km.get(inside)?, self.heights_km.get(inside + 1)?);
        let [v0, v1] = [h0, h1].map(|h| self.interpolate(*h, latitude_deg));
        Some(h0 + (h1 - h0) * f64::from((v0 - half) / (v0 - v1)))
    }
}

/// Returns the mean over a sphere of a value that depends on latitude in degrees.
pub(crate) fn mean_over_globe(value: impl Fn(f64) -> f64) -> f64 {
    const BELTS: u32 = 90;
    // All belts have the same area.
    let sum: f64 =
        (0..BELTS).map(|i| value(libm::asin((2.0 * f64::from(i) + 1.0) / f64::from(BELTS) - 1.0).to_degrees())).sum();
    sum / f64::from(BELTS)
}
