//! Radiance by tangent height, latitude and season from a user's CSV file.

use serde::Deserialize;

/// Values at heights and latitudes. They are linear between the entries and constant beyond them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    heights_km: Vec<f64>,
    latitudes_deg: Vec<f64>,
    /// Values of one latitude after the other.
    values: Vec<f32>,
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

/// A radiance table: one grid of heights and latitudes for each season.
#[derive(Debug, Clone, PartialEq)]
pub struct Radiance {
    /// Season in degrees, rising from 0 to below 360, and the grid of this season.
    seasons: Vec<(f64, Grid)>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    season_deg: Option<f64>,
    latitude_deg: f64,
    tangent_height_km: f64,
    radiance: f64,
}

impl Radiance {
    /// Reads CSV with the columns `tangent_height_km, latitude_deg, radiance` and, if it depends on the season,
    /// `season_deg`. The rows can be in any order, one for each height at each latitude in each season.
    ///
    /// # Errors
    /// Fails for the first invalid line, for a missing row, and for a table that ends below the limb.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
        // The reader knows the line of a row only while it is at this row.
        let heads = reader.headers().map_err(|e| e.to_string())?.clone();
        let mut rows: Vec<(u64, Row)> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| e.to_string())?;
            let line = record.position().map_or(0, csv::Position::line);
            let row: Row = record.deserialize(Some(&heads)).map_err(|e| match e.kind() {
                csv::ErrorKind::Deserialize { err, .. } => match err.field().and_then(|i| heads.get(i as usize)) {
                    Some(column) => {
                        let value = err.field().and_then(|i| record.get(i as usize)).unwrap_or_default();
                        format!("line {line}: {column} = {value:?}: {}", err.kind())
                    }
                    None => format!("line {line}: {}", err.kind()),
                },
                _ => format!("line {line}: {e}"),
            })?;
            let limits = [
                ("radiance", row.radiance, [0.0, 1.0], "must be 0 to 1, a fraction of full scale"),
                ("latitude_deg", row.latitude_deg, [-90.0, 90.0], "must be -90 to 90"),
                ("tangent_height_km", row.tangent_height_km, [-200.0, 500.0], "must be -200 to 500"),
                ("season_deg", row.season_deg.unwrap_or(0.0), [0.0, 360.0 - 1e-9], "must be 0 to below 360"),
            ];
            if let Some((column, value, _, rule)) = limits.into_iter().find(|l| !(l.1 >= l.2[0] && l.1 <= l.2[1])) {
                return Err(format!("line {line}: {column} = {value}: {rule}"));
            }
            rows.push((line, row));
        }
        let list = |of: fn(&Row) -> f64| {
            let mut all: Vec<f64> = rows.iter().map(|(_, r)| of(r)).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        };
        let season = |r: &Row| r.season_deg.unwrap_or(0.0);
        let (seasons, latitudes, heights) =
            (list(|r| r.season_deg.unwrap_or(0.0)), list(|r| r.latitude_deg), list(|r| r.tangent_height_km));
        if heights.len() < 2 {
            return Err("must have rows at two tangent heights or more".into());
        }
        let key = |r: &Row| [season(r), r.latitude_deg, r.tangent_height_km];
        rows.sort_by(|(n, a), (m, b)| {
            let order = key(a).iter().zip(key(b)).map(|(x, y)| x.total_cmp(&y)).find(|o| o.is_ne());
            order.unwrap_or_else(|| n.cmp(m))
        });
        let said = |[season, lat, h]: [f64; 3]| format!("{h} km at latitude {lat} and season {season} deg");
        if let Some([(first, _), (again, r)]) = rows.array_windows().find(|[(_, a), (_, b)]| key(a) == key(b)) {
            return Err(format!("line {again}: {} is already in line {first}", said(key(r))));
        }
        let wanted = seasons.iter().flat_map(|s| latitudes.iter().flat_map(|l| heights.iter().map(|h| [*s, *l, *h])));
        let mut have = rows.iter().map(|(_, r)| key(r));
        if let Some(missing) = wanted.into_iter().find(|w| have.next() != Some(*w)) {
            return Err(format!("no row for {}: every height is needed at every latitude and season", said(missing)));
        }
        let lowest = |r: &Row| heights.first() == Some(&r.tangent_height_km);
        if let Some((line, r)) = rows.iter().find(|(_, r)| lowest(r) && r.radiance <= 0.0) {
            let rule = "must be above 0 at the lowest tangent height: the limb is where half of this radiance is left";
            return Err(format!("line {line}: radiance = {} at {}: {rule}", r.radiance, said(key(r))));
        }
        let each = latitudes.len() * heights.len();
        let table = Self {
            seasons: seasons
                .iter()
                .zip(rows.chunks(each))
                .map(|(s, rows)| {
                    let values = rows.iter().map(|(_, r)| r.radiance as f32).collect();
                    (*s, Grid { heights_km: heights.clone(), latitudes_deg: latitudes.clone(), values })
                })
                .collect(),
        };
        for (season, grid) in &table.seasons {
            if let Some(lat) = latitudes.iter().find(|lat| grid.half_level_km(**lat).is_none()) {
                return Err(format!(
                    "at latitude {lat} and season {season} deg the radiance at the largest tangent height is still \
                     above half of that at the lowest: the table must reach beyond the limb"
                ));
            }
        }
        Ok(table)
    }

    /// Returns the grid of a season in degrees. It is linear between two seasons, around the year too.
    pub(crate) fn season_grid(&self, season_deg: f64) -> Grid {
        let season = season_deg.rem_euclid(360.0);
        let next = self.seasons.partition_point(|s| s.0 <= season);
        let n = self.seasons.len();
        let [(a, before), (b, after)] = [&self.seasons[(next + n - 1) % n], &self.seasons[next % n]];
        let (apart, from) = ((b - a).rem_euclid(360.0), (season - a).rem_euclid(360.0));
        let t = if apart > 0.0 { (from / apart) as f32 } else { 0.0 };
        let values = before.values.iter().zip(&after.values).map(|(x, y)| x + t * (y - x)).collect();
        Grid { values, ..before.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a table with two latitudes in two seasons; `half` gives the half level.
    fn text(half: impl Fn(f64, f64) -> f64) -> String {
        let mut text = String::from("# ours\nseason_deg, latitude_deg, tangent_height_km, radiance\n");
        for (season, lat) in [(0.0, -90.0), (0.0, 90.0), (180.0, -90.0), (180.0, 90.0)] {
            let h = half(season, lat);
            for height in [0.0, 15.0, 20.0, 25.0, 30.0, 35.0, 60.0] {
                let radiance = (0.5 - (height - h) / 10.0).clamp(0.0, 1.0) * 0.8;
                text.push_str(&format!("{season},{lat},{height},{radiance}\n"));
            }
        }
        text
    }

    #[test]
    fn between_heights_latitudes_and_seasons() {
        let table =
            Radiance::parse(&text(|season, lat| if (season == 0.0) == (lat > 0.0) { 30.0 } else { 20.0 })).unwrap();
        let july = table.season_grid(0.0);
        assert!((july.half_level_km(90.0).unwrap() - 30.0).abs() < 1e-5);
        assert!((july.half_level_km(-90.0).unwrap() - 20.0).abs() < 1e-5);
        assert!((table.season_grid(180.0).half_level_km(90.0).unwrap() - 20.0).abs() < 1e-5);
        assert!(
            (july.interpolate(27.5, 90.0) - 0.6).abs() < 1e-6 && (july.interpolate(27.5, -90.0) - 0.0).abs() < 1e-6
        );
        // The checks are half-way in latitude, half-way in season on both sides of the year, and beyond the ends.
        assert!((july.interpolate(27.5, 0.0) - 0.3).abs() < 1e-6);
        for season in [90.0, 270.0, -90.0] {
            assert!((table.season_grid(season).interpolate(27.5, 90.0) - 0.3).abs() < 1e-6);
        }
        assert_eq!((july.interpolate(-50.0, 10.0), july.interpolate(99.0, 10.0)), (july.interpolate(0.0, 10.0), 0.0));
        assert!((july.lowest_mean() - 0.8).abs() < 1e-6);
    }

    #[test]
    fn one_season_and_one_latitude_are_enough() {
        let table = Radiance::parse("tangent_height_km,latitude_deg,radiance\n0,0,0.5\n40,0,0\n").unwrap();
        assert_eq!(table.season_grid(77.0).half_level_km(60.0), Some(20.0));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let good = "tangent_height_km,latitude_deg,radiance\n0,0,0.5\n40,0,0\n";
        let error = |text: &str| Radiance::parse(text).unwrap_err();
        assert_eq!(
            error(&good.replace("0.5", "1.5")),
            "line 2: radiance = 1.5: must be 0 to 1, a fraction of full scale"
        );
        assert!(error(&good.replace("40,0,0", "40,0,x")).starts_with("line 3: radiance = \"x\": "));
        assert!(error(&good.replace("radiance", "light")).contains("light"));
        assert!(error(&good.replace("40,", "0,")).contains("two tangent heights"));
        assert_eq!(
            error(&format!("{good}0,0,0.4\n")),
            "line 4: 0 km at latitude 0 and season 0 deg is already in line 2"
        );
        assert!(error(&format!("{good}0,10,0.4\n")).starts_with("no row for 40 km at latitude 10 and season 0 deg"));
        assert!(error(&good.replace("40,0,0\n", "40,0,0.4\n")).contains("must reach beyond the limb"));
        assert!(error("").contains("two tangent heights") || error("").contains("line"));
    }
}
