//! The height of the limb in the band of CO₂, computed line by line by `reproduce/limb_heights/limb_heights.py`.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::setup::Effort;
use crate::section::Section;
use anyhow::{Context, bail, ensure};

const SCRIPT: &str = "reproduce/limb_heights/limb_heights.py";
const ENVIRONMENT: &str = "target/venv/limb-heights";
const TABLE: &str = "crates/hzn-core/src/model/body/band_table.rs";
const PACKAGES: [&str; 3] = ["numpy==2.4.6", "scipy==1.17.1", "pymsis==0.13.0"];

/// What the script prints: heights by month and latitude, and by filter and by model.
#[derive(Default)]
struct Heights {
    table: Vec<Vec<f64>>,
    filters: Vec<Vec<String>>,
    models: Vec<Vec<String>>,
}

impl Heights {
    fn read(printed: &str) -> anyhow::Result<Self> {
        let mut heights = Self::default();
        for line in printed.lines() {
            let cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            match cells.split_first() {
                Some((kind, rest)) if kind == "table" => {
                    heights.table.push(rest.iter().map(|cell| cell.parse()).collect::<Result<_, _>>()?);
                }
                Some((kind, rest)) if kind == "filter" => heights.filters.push(rest.to_vec()),
                Some((kind, rest)) if kind == "model" => heights.models.push(rest.to_vec()),
                _ => bail!("{SCRIPT}: unexpected line {line:?}"),
            }
        }
        Ok(heights)
    }
}

/// Computes the table, writes it into hzn-core, and shows what the height depends on.
pub(crate) fn table(effort: &Effort) -> anyhow::Result<Section> {
    let printed = output(Command::new(environment()?).arg(SCRIPT))?;
    let heights = Heights::read(&printed).context(SCRIPT)?;
    ensure!(
        heights.table.len() == 12 && heights.table.iter().all(|row| row.len() == 13),
        "{SCRIPT}: no 12 by 13 table"
    );
    if effort.frames.is_none() {
        std::fs::write(TABLE, rust(&heights.table)).context(TABLE)?;
    }
    let mut section = Section::default();
    section.text(
        "Height of the limb in the band of CO₂ (14 to 16 µm, soft edges) in km: where the radiance is half of its \
         largest value. [The model](../theory/limb.md#carbon-dioxide-at-15-micrometres) uses the air of NRLMSIS 2.1.",
    );
    let latitudes = (0..13).map(|i| format!("{}°", i * 15 - 90));
    let rows = heights.table.iter().enumerate();
    section.table(
        std::iter::once("month".to_owned()).chain(latitudes),
        rows.map(|(i, row)| {
            std::iter::once((i + 1).to_string()).chain(row.iter().map(|h| format!("{h:.1}"))).collect()
        }),
    );
    section.text("Means over four months and three latitudes, by the filter of the camera:");
    section.table(["filter", "height, km"], heights.filters);
    section.text("In April at 30° north, by the model:");
    section.table(["model", "height, km"], heights.models);
    Ok(section)
}

/// Returns the table as the source of hzn-core.
fn rust(table: &[Vec<f64>]) -> String {
    let row = |row: &Vec<f64>| row.iter().map(|h| format!("{:.0}", h * 100.0)).collect::<Vec<_>>().join(", ");
    let rows: Vec<String> = table.iter().map(|r| format!("    [{}],\n", row(r))).collect();
    format!(
        "//! The height of the limb in the band of CO₂ at 15 µm. `cargo xtask reproduce limb-heights` writes this \
         file.\n\n/// Heights in units of 10 m: one row for the middle of each month, with latitudes from −90° to 90° \
         in steps of 15°.\npub(super) const CO2_HEIGHTS: [[u16; 13]; 12] = [\n{}];\n",
        rows.concat()
    )
}

/// Returns the interpreter of an environment with the packages, which it makes if it is missing.
fn environment() -> anyhow::Result<PathBuf> {
    let python = Path::new(ENVIRONMENT).join("bin/python");
    let has_all = || output(Command::new(&python).args(["-c", "import numpy, scipy, pymsis"])).is_ok();
    if !has_all() {
        let advice = "limb-heights needs python3 with venv, and a package index with numpy, scipy and pymsis";
        output(Command::new("python3").args(["-m", "venv", ENVIRONMENT])).context(advice)?;
        output(Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(PACKAGES)).context(advice)?;
    }
    Ok(python)
}

fn output(command: &mut Command) -> anyhow::Result<String> {
    let done = command.output().with_context(|| format!("{command:?}"))?;
    if !done.status.success() {
        bail!("{command:?}: {}", String::from_utf8_lossy(&done.stderr).trim());
    }
    Ok(String::from_utf8(done.stdout)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the committed heights, km.
    fn committed(root: &Path) -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(root.join(TABLE)).unwrap();
        let rows = text.lines().filter_map(|line| line.trim().strip_prefix('[')?.strip_suffix("],"));
        rows.map(|row| row.split(", ").map(|h| h.parse::<f64>().unwrap() / 100.0).collect()).collect()
    }

    #[test]
    fn the_committed_table_is_what_the_study_writes() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let table = committed(root);
        assert_eq!(rust(&table), std::fs::read_to_string(root.join(TABLE)).unwrap());
        let python = root.join(ENVIRONMENT).join("bin/python");
        if !python.exists() {
            println!(
                "not compared with the script: {ENVIRONMENT} is missing; `cargo xtask reproduce limb-heights` makes it"
            );
            return;
        }
        for (month, latitude) in [(1, -90), (7, 75)] {
            let cell = [month, latitude].map(|x: i32| x.to_string());
            let height = output(Command::new(&python).arg(root.join(SCRIPT)).arg("--cell").args(cell)).unwrap();
            let want = table[month as usize - 1][((latitude + 90) / 15) as usize];
            assert!((height.trim().parse::<f64>().unwrap() - want).abs() < 0.02, "{month} {latitude}: {height}");
        }
    }
}
