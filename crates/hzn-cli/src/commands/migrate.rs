//! `hzn migrate`: rewrites files that have names of version 0.1.0.

use std::path::PathBuf;

use hzn_files::limited;
use hzn_files::migrate;
use hzn_run::{disk, explain};

use crate::exit::{Exit, Outcome, failed, usage};
use crate::tell;

/// Rewrite old names in sensor.toml, scene.toml and fuse.toml
///
/// Each section and key of version 0.1.0 gets its new name, and the line of a key that is a constant now becomes a
/// comment. Everything else stays as it is. If one of the files cannot be rewritten, none is.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The files to rewrite
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Print what would be changed, and write nothing
    #[arg(short = 'n', long)]
    dry_run: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    let mut rewritten = Vec::new();
    for path in &args.files {
        let text = limited::read_text(path, limited::SETTINGS_BYTES)
            .map_err(|e| usage(format!("{}: cannot be read: {e}", path.display())))?;
        // A link stays a link: the file that it leads to is written.
        let target = path.canonicalize().map_err(|e| failed(format!("{}: {e}", path.display())))?;
        let (new, changes) = migrate::migrate(&text, path).map_err(usage)?;
        rewritten.push((path, target, new, changes));
    }
    for (path, target, new, changes) in &rewritten {
        let name = path.display();
        if changes.is_empty() {
            tell::line(format_args!("{name}: has no old name"));
            continue;
        }
        for one in changes {
            let what = one.new.map_or("a constant; its line is a comment".to_owned(), str::to_owned);
            tell::line(format_args!("{name}:{}: {} is now {what}", one.line, one.field));
        }
        if !args.dry_run {
            disk::write_whole(target, new)?;
            tell::line(format_args!("{name}: {} rewritten", explain::counted(changes.len() as u64, "key")));
        }
    }
    Ok(Exit::Done)
}
