//! Radiance by tangent height, latitude and season from a user's CSV file.

mod grid;

pub(crate) use grid::{Grid, mean_over_globe};

use serde::Deserialize;

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

impl Row {
    fn season_deg(&self) -> f64 {
        self.season_deg.unwrap_or(0.0)
    }

    /// Returns season, latitude and height. The rows of a table are ordered by them.
    fn key(&self) -> [f64; 3] {
        [self.season_deg(), self.latitude_deg, self.tangent_height_km]
    }

    /// Fails for the first value that is out of its limits.
    fn check(&self) -> Result<(), String> {
        let limits = [
            ("radiance", self.radiance, [0.0, 1.0], "must be 0 to 1, a fraction of full scale"),
            ("latitude_deg", self.latitude_deg, [-90.0, 90.0], "must be -90 to 90"),
            ("tangent_height_km", self.tangent_height_km, [-200.0, 500.0], "must be -200 to 500"),
            ("season_deg", self.season_deg(), [0.0, 360.0 - 1e-9], "must be 0 to below 360"),
        ];
        match limits.into_iter().find(|(_, value, [min, max], _)| !(value >= min && value <= max)) {
            Some((column, value, _, rule)) => Err(format!("{column} = {value}: {rule}")),
            None => Ok(()),
        }
    }
}

/// A row and its line in the file.
type NumberedRow = (u64, Row);

/// Reads the rows of a CSV file and checks each of them.
fn read_rows(text: &str) -> Result<Vec<NumberedRow>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(hzn_files::unix_lines::UnixLines::new(text.as_bytes()));
    // The reader knows the line of a row only while it is at this row.
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| e.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let row: Row = record.deserialize(Some(&header)).map_err(|e| match e.kind() {
            csv::ErrorKind::Deserialize { err, .. } => match err.field().and_then(|i| header.get(i as usize)) {
                Some(column) => {
                    let value = err.field().and_then(|i| record.get(i as usize)).unwrap_or_default();
                    format!("line {line}: {column} = {value:?}: {}", err.kind())
                }
                None => format!("line {line}: {}", err.kind()),
            },
            _ => format!("line {line}: {e}"),
        })?;
        row.check().map_err(|e| format!("line {line}: {e}"))?;
        rows.push((line, row));
    }
    Ok(rows)
}

/// The values of each key that occur in a table, in rising order.
struct Axes {
    seasons_deg: Vec<f64>,
    latitudes_deg: Vec<f64>,
    heights_km: Vec<f64>,
}

impl Axes {
    fn from_rows(rows: &[NumberedRow]) -> Self {
        let values = |key: usize| {
            let mut all: Vec<f64> = rows.iter().map(|(_, row)| row.key()[key]).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        };
        Self { seasons_deg: values(0), latitudes_deg: values(1), heights_km: values(2) }
    }

    /// Returns the keys of a complete table, in order.
    fn keys(&self) -> impl Iterator<Item = [f64; 3]> {
        let Self { seasons_deg, latitudes_deg, heights_km } = self;
        seasons_deg.iter().flat_map(|s| latitudes_deg.iter().flat_map(|l| heights_km.iter().map(|h| [*s, *l, *h])))
    }

    /// Checks that the sorted rows have each key once, and radiance at the lowest height.
    fn check(&self, rows: &[NumberedRow]) -> Result<(), String> {
        if let Some([(first, _), (again, r)]) =
            rows.windows(2).find(|two| matches!(two, [(_, a), (_, b)] if a.key() == b.key()))
        {
            return Err(format!("line {again}: {} is already in line {first}", describe(r.key())));
        }
        let mut keys = rows.iter().map(|(_, r)| r.key());
        if let Some(missing) = self.keys().find(|key| keys.next() != Some(*key)) {
            let what = describe(missing);
            return Err(format!("no row for {what}: every height is needed at every latitude and season"));
        }
        let is_lowest = |r: &Row| self.heights_km.first() == Some(&r.tangent_height_km);
        if let Some((line, r)) = rows.iter().find(|(_, r)| is_lowest(r) && r.radiance <= 0.0) {
            let rule = "must be above 0 at the lowest tangent height: the limb is where half of this radiance is left";
            return Err(format!("line {line}: radiance = {} at {}: {rule}", r.radiance, describe(r.key())));
        }
        Ok(())
    }
}

/// Returns a key in words.
fn describe([season_deg, latitude_deg, height_km]: [f64; 3]) -> String {
    format!("{height_km} km at latitude {latitude_deg} and season {season_deg} deg")
}

impl Radiance {
    /// Reads CSV with the columns `tangent_height_km, latitude_deg, radiance` and, if it depends on the season,
    /// `season_deg`. The rows can be in any order, one for each height at each latitude in each season.
    ///
    /// # Errors
    /// Fails for the first invalid line, for a missing row, and for a table that ends below the limb.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut rows = read_rows(text)?;
        let axes = Axes::from_rows(&rows);
        if axes.heights_km.len() < 2 {
            return Err("must have rows at two tangent heights or more".into());
        }
        rows.sort_by(|(n, a), (m, b)| {
            let order = a.key().iter().zip(b.key()).map(|(x, y)| x.total_cmp(&y)).find(|o| o.is_ne());
            order.unwrap_or_else(|| n.cmp(m))
        });
        axes.check(&rows)?;
        let rows_per_season = axes.latitudes_deg.len() * axes.heights_km.len();
        let grid = |rows: &[NumberedRow]| Grid {
            heights_km: axes.heights_km.clone(),
            latitudes_deg: axes.latitudes_deg.clone(),
            values: rows.iter().map(|(_, r)| r.radiance as f32).collect(),
        };
        let seasons = axes.seasons_deg.iter().copied().zip(rows.chunks(rows_per_season).map(grid)).collect();
        let table = Self { seasons };
        table.check_half_levels()?;
        Ok(table)
    }

    /// Checks that the table reaches beyond the limb at every latitude in every season.
    fn check_half_levels(&self) -> Result<(), String> {
        for (season, grid) in &self.seasons {
            if let Some(lat) = grid.latitudes_deg.iter().find(|lat| grid.half_level_km(**lat).is_none()) {
                return Err(format!(
                    "at latitude {lat} and season {season} deg the radiance at the largest tangent height is still \
                     above half of that at the lowest: the table must reach beyond the limb"
                ));
            }
        }
        Ok(())
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
