//! `hzn export --imu --gnss`: the tables of `hzn fuse` from a recording of ROS 2, or from a video of an action camera.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_run::explain::counted;
use hzn_run::instruments::{self, Exported, Instrument};
use hzn_run::source;

use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::files;
use crate::tell::{self, one_line};

/// Writes the tables.
pub(super) fn run(input: &Path, tables: &[(Instrument, &Path)], wanted: &[String], force: bool) -> Outcome {
    if source::is_video(input) {
        return of_video(input, tables, wanted, force);
    }
    let recordings = instruments::recordings(input)?;
    let written: Vec<PathBuf> = tables.iter().map(|(_, path)| path.to_path_buf()).collect();
    files::check_outputs(&recordings, &written, force)?;
    let topics = instruments::topics(&recordings)?;
    if let Some(unknown) = wanted.iter().find(|topic| !topics.contains_key(*topic)) {
        let list = topics.keys().cloned().collect::<Vec<_>>().join(", ");
        let known = if list.is_empty() { "there are none".to_owned() } else { format!("there are {list}") };
        return Err(usage(format!("--topic {unknown}: no instrument has this topic; {known}")));
    }
    let chosen = tables.iter().map(|(which, _)| choose(input, *which, &topics, wanted));
    let chosen = chosen.collect::<Result<Vec<&str>, Stop>>()?;
    let mut is_cut = false;
    for ((which, table), topic) in tables.iter().zip(chosen) {
        let exported = instruments::write_table(&recordings, *which, topic, table)?;
        is_cut |= !exported.cut.is_empty();
        report(*which, table, &exported)?;
    }
    Ok(if is_cut { Exit::SomeUnreadable } else { Exit::Done })
}

/// Writes the tables of a video of an action camera.
fn of_video(input: &Path, tables: &[(Instrument, &Path)], wanted: &[String], force: bool) -> Outcome {
    let name = input.display();
    if let Some(topic) = wanted.first() {
        return Err(usage(format!("--topic {topic}: a video has no topics")));
    }
    let written: Vec<PathBuf> = tables.iter().map(|(_, path)| path.to_path_buf()).collect();
    files::check_outputs(&[input.to_owned()], &written, force)?;
    let measured = source::measured::read(input).map_err(|e| failed(format!("{name}: cannot be read: {e}")))?;
    let what = "the video has no measurements of its camera in GPMF, the format of GoPro; those of other cameras are \
                not read";
    let measured = measured.ok_or_else(|| failed(format!("{name}: {what}")))?;
    let is_missing = |(which, _): &(Instrument, &Path)| match which {
        Instrument::Imu => measured.rates.is_empty(),
        Instrument::Gnss => measured.fixes.is_empty(),
    };
    if tables.iter().any(is_missing) {
        return Err(failed(format!("{name}: {}", measured.describe())));
    }
    for (which, table) in tables {
        let rows = instruments::write_measured(&measured, *which, table)?;
        tell::line(one_line(format!("{}: {} of {}", table.display(), counted(rows, "row"), measured.camera)));
    }
    if tables.iter().any(|(which, _)| *which == Instrument::Imu) {
        tell::line("note: the axes are those of the camera: x to the right, y down, z along the line of sight");
    }
    if measured.without_fix > 0 {
        tell::warning(format_args!("{} without a fix were left out", counted(measured.without_fix, "position")));
    }
    Ok(Exit::Done)
}

/// Chooses the topic of an instrument: the one that was asked for, or the only one.
fn choose<'a>(
    input: &Path,
    which: Instrument,
    topics: &'a BTreeMap<String, String>,
    wanted: &[String],
) -> Result<&'a str, Stop> {
    let own = || topics.iter().filter(|(_, schema)| *schema == which.schema()).map(|(topic, _)| topic.as_str());
    let asked: Vec<&str> = own().filter(|topic| wanted.iter().any(|w| w == topic)).collect();
    let all: Vec<&str> = if asked.is_empty() { own().collect() } else { asked };
    match all.as_slice() {
        [only] => Ok(only),
        [] => Err(failed(format!("{}: there are no messages {}", input.display(), which.schema()))),
        several => Err(usage(format!(
            "{}: several topics have {}: {}; choose one with --topic",
            input.display(),
            which.schema(),
            several.join(", ")
        ))),
    }
}

/// Says how many rows were written, which axes `hzn fuse` takes theirs for, and which messages were left out.
fn report(which: Instrument, table: &Path, exported: &Exported) -> Result<(), Stop> {
    let Exported { rows, topic, frame_id, left_out, without_stamp, is_log_time, cut } = exported;
    tell::line(one_line(format!("{}: {} of {topic}", table.display(), counted(*rows, "row"))));
    if which == Instrument::Imu && !frame_id.is_empty() {
        let what = "hzn fuse takes these axes for those of the vehicle";
        tell::line(one_line(format!("note: the rates are about the axes of the frame {frame_id}; {what}")));
    }
    if *left_out > 0 {
        let what = match which {
            Instrument::Imu => "end too early",
            Instrument::Gnss => "have no fix, or end too early",
        };
        tell::warning(format_args!("{} of {topic} {what}, and were left out", counted(*left_out, "message")));
    }
    if *is_log_time && *without_stamp > 0 {
        let what = "the stamps in the headers are all 0, so the times are those of the log, which are later";
        tell::warning(format_args!("{topic}: {what}"));
    } else if *without_stamp > 0 {
        let what = "have the stamp 0 while others have a time, and were left out";
        tell::warning(format_args!("{} of {topic} {what}", counted(*without_stamp, "message")));
    }
    for path in cut {
        tell::warning(format_args!("{}: was cut off or is damaged; what comes before was written", path.display()));
    }
    if *rows == 0 {
        return Err(failed(format!("{topic}: no message has a measurement")));
    }
    Ok(())
}
