//! `hzn recover`: closes a file that a crash left unfinished.

use std::path::{Path, PathBuf};

use hzn_mcap::part_path;
use hzn_run::{disk, explain, sink, source};

use crate::exit::{Exit, Outcome, failed, unreadable, usage};
use crate::tell;

/// Close a file that a crash left unfinished
///
/// The complete parts of the file are kept: all complete batches of pictures of a recording, all complete rows of a
/// table. The incomplete end is dropped: at most the pictures of the last quarter of a second. To continue the run
/// instead, use `hzn run --resume`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The unfinished file, such as out.mcap.part
    file: PathBuf,
    /// Name of the result; if not given, the file's name without .part (or with .recovered, if it does not end in
    /// .part)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an output that exists
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    let file = &args.file;
    let (kind, unfinished) = source::check_exists(file)?;
    if !matches!(kind.as_str(), "mcap" | "csv" | "jsonl") {
        let what = "is not a file of results (.mcap, .csv or .jsonl, followed by .part if it is unfinished)";
        return Err(usage(format!("{}: {what}", file.display())));
    }
    let path = match &args.output {
        Some(path) => path.clone(),
        None if unfinished => file.with_extension(""),
        None => {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            file.with_file_name(format!("{stem}.recovered.{kind}"))
        }
    };
    let target = sink::target(&path)?;
    let mut written = vec![path.clone()];
    match target {
        sink::Target::Mcap => written.extend([recovering(&path), part_path(&recovering(&path))]),
        // A table is finished in place.
        _ if *file == part_path(&path) => {}
        _ => written.push(part_path(&path)),
    }
    disk::refuse_inputs_exactly(std::slice::from_ref(file), &written)?;
    if path.exists() && !args.force {
        let what = "exists already; choose another name with -o, or --force replaces it";
        return Err(usage(format!("{}: {what}", path.display())));
    }
    let written = std::fs::metadata(file).and_then(|data| data.modified());
    let kept = match target {
        sink::Target::Mcap => recording(file, &path)?,
        target => table(file, &path, target)?,
    };
    // A run that continues the file compares the pictures with the time at which the results were written.
    if let Ok(written) = written {
        sink::set_written(&path, written)?;
    }
    let dropped = match kept.dropped_bytes {
        0 => String::new(),
        bytes => format!(", {bytes} bytes without whole pictures dropped"),
    };
    tell::line(format_args!("{}: {} kept{dropped}", path.display(), explain::counted(kept.rows, "row")));
    if kept.unread_reports > 0 {
        // The messages are kept, but the new file has no results in their place, so the old one stays.
        tell::warning(source::describe_unread(&path, kept.unread_reports));
        return Ok(Exit::SomeUnreadable);
    }
    if unfinished && args.output.is_none() && file.exists() {
        // Its results are in the new file. Next to it, the old file would look like another unfinished run.
        std::fs::remove_file(file)?;
    }
    Ok(Exit::Done)
}

/// What a recovery kept.
struct Kept {
    rows: u64,
    dropped_bytes: u64,
    /// Messages that are in the place of results and cannot be read.
    unread_reports: u64,
}

/// Recovers a table.
fn table(file: &Path, path: &Path, target: sink::Target) -> Result<Kept, crate::exit::Stop> {
    let found = sink::recover_text(file, path, target).map_err(|e| match e.kind() {
        std::io::ErrorKind::InvalidData => failed(format!("{}: {e}", file.display())),
        _ => disk::cannot_write(path, &e).into(),
    })?;
    if let Some(damage) = found.damage {
        tell::warning(format_args!("{}: {damage}; only the rows before it are kept", file.display()));
    }
    Ok(Kept { rows: found.rows, dropped_bytes: found.dropped_bytes, unread_reports: 0 })
}

/// Returns where a recording is recovered. The library never replaces a file; therefore the result is written next to
/// it and then renamed.
fn recovering(path: &Path) -> PathBuf {
    path.with_extension("recovering.mcap")
}

/// Recovers a recording.
fn recording(file: &Path, path: &Path) -> Result<Kept, crate::exit::Stop> {
    let recovering = recovering(path);
    if recovering.exists() {
        std::fs::remove_file(&recovering)?;
    }
    let found = hzn_mcap::recover(file, &recovering).map_err(|e| match e {
        hzn_mcap::Error::DiskFull { folder, .. } => {
            let what = "free some space, or choose another folder with -o";
            failed(format!(
                "no space is left on the disk of {}: {what}; {} is unchanged",
                folder.display(),
                file.display()
            ))
        }
        e @ hzn_mcap::Error::Compression { .. } => unreadable(e),
        e => failed(e),
    })?;
    let had_results = || hzn_mcap::Index::open(file).is_ok_and(|index| index.has_reports());
    if found.frames == 0 && found.broken_chunks > 0 && had_results() {
        std::fs::remove_file(&recovering)?;
        let parts = explain::counted(found.broken_chunks, "damaged part");
        return Err(unreadable(format!("{}: no result is left, because the file has {parts}", file.display())));
    }
    hzn_mcap::rename(&recovering, path)?;
    if found.broken_chunks > 0 {
        tell::warning(format_args!("{} damaged parts were left out; their pictures are missing", found.broken_chunks));
    }
    if found.bytes_after_end > 0 {
        tell::warning(source::describe_rest(file, found.bytes_after_end));
    }
    Ok(Kept { rows: found.frames, dropped_bytes: found.dropped_bytes, unread_reports: found.unread_reports })
}
