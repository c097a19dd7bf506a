//! `hzn sensitivity`: computes the accuracy of a camera before it is bought.

mod args;
mod body;
mod charts;
mod grid;
mod noise;
mod rig;
mod sigma;
mod study;
mod sweep;
mod table;
mod yaw;

use hzn_run::source::ending;
use hzn_run::{disk, provenance};

use crate::exit::{Exit, Outcome, usage};
use crate::files;
use crate::tell;
pub(super) use args::Args;
use args::What;
use study::Study;

pub(super) fn run(args: &Args) -> Outcome {
    for path in &args.output {
        match ending(path).as_str() {
            "csv" | "svg" => {}
            _ => return Err(usage(format!("{}: a table ends in .csv, a plot in .svg", path.display()))),
        }
    }
    let read = args.sensor.as_deref().map(hzn_files::files_of_sensor).unwrap_or_default();
    files::check_outputs(&read, &args.output, args.force)?;
    let Study { table, chart, notes } = match args.what {
        What::Sigma => sigma::compute(args)?,
        What::Yaw => yaw::compute(args)?,
        What::Visibility => charts::visibility(args)?,
        What::SphericalEarth => charts::spherical_earth(args)?,
        What::Rig => rig::compute(args)?,
    };
    for path in &args.output {
        let bytes = if ending(path) == "csv" {
            table.csv()
        } else {
            let Some(chart) = &chart else {
                let what = "there is no range to plot over: give one, for example --fov 60:150";
                return Err(usage(format!("{}: {what}", path.display())));
            };
            let hash = sensor_hash(args);
            let foot = provenance::line(hash.as_deref(), &provenance::command("hzn"));
            chart.clone().with_foot(foot).svg()?.into_bytes()
        };
        disk::write(path, bytes)?;
    }
    tell::result(table.text())?;
    notes.iter().for_each(tell::line);
    Ok(Exit::Done)
}

/// Returns the hash of the sensor whose design is studied, if one was given.
fn sensor_hash(args: &Args) -> Option<String> {
    provenance::hash(&hzn_files::sensor::load(args.sensor.as_deref()?).ok()?.config)
}
