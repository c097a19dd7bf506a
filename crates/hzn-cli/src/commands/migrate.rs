//! `hzn migrate`: rewrites files that have names of version 0.1.0.

use std::path::PathBuf;

use hzn_files::limited;
use hzn_files::migrate;
use hzn_run::{disk, explain};

use crate::exit::{Exit, Outcome, failed, usage};
use crate::tell;

/// Rewrite old names in sensor.toml, scene.toml and fuse.toml
///
/// Each section and key of version 0.1.0 gets its new name; everything else stays as it is, comments too. If one of the
/// files cannot be rewritten, none is.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The files to rewrite
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Print what would be renamed, and write nothing
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
        let (new, renamed) = migrate::migrate(&text, path).map_err(usage)?;
        rewritten.push((path, target, new, renamed));
    }
    for (path, target, new, renamed) in &rewritten {
        let name = path.display();
        if renamed.is_empty() {
            tell::line(format_args!("{name}: has no old name"));
            continue;
        }
        for one in renamed {
            tell::line(format_args!("{name}:{}: {} is now {}", one.line, one.field, one.new));
        }
        if !args.dry_run {
            disk::write_whole(target, new)?;
            tell::line(format_args!("{name}: {} renamed", explain::counted(renamed.len() as u64, "name")));
        }
    }
    Ok(Exit::Done)
}
