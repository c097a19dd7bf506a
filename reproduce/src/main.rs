//! Our numbers beside the published ones, and accuracy and honesty on rendered flights: `cargo xtask reproduce`.
//!
//! A [`studies::Study`] is a name, a title and a function that measures and gives a [`document::Section`]; the list of
//! them is `book/results/reproduction.md`. To add one: a function in `studies`, a line in [`studies::ALL`].
#![forbid(unsafe_code)]

mod document;
mod fly;
mod studies;

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Parser;

use studies::{ALL, Effort};

/// Measures again what book/results/reproduction.md and parts of book/theory/methods.md say, and writes it.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask reproduce")]
struct Args {
    /// Studies; without one, all
    #[arg(value_name = "STUDY")]
    studies: Vec<String>,
    /// Frames a scene instead of each study's own number, for a quick look; no document is written then
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Name the studies
    #[arg(long)]
    list: bool,
    /// The folder of the book
    #[arg(long, value_name = "DIR", default_value = "book")]
    docs: PathBuf,
}

#[allow(clippy::print_stdout, reason = "a program of the workshop")]
fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    if args.list {
        ALL.iter().for_each(|s| println!("{:<14} {}", s.name, s.title));
        return Ok(());
    }
    if let Some(unknown) = args.studies.iter().find(|name| ALL.iter().all(|s| s.name != **name)) {
        let names: Vec<&str> = ALL.iter().map(|s| s.name).collect();
        bail!("no study {unknown:?}; there are {}", names.join(", "));
    }
    if args.frames == Some(0) {
        bail!("--frames: must be 1 or more");
    }
    let effort = Effort { frames: args.frames };
    for study in ALL.iter().filter(|s| args.studies.is_empty() || args.studies.iter().any(|n| n == s.name)) {
        println!("{} ...", study.title);
        let section = (study.run)(&effort).with_context(|| study.name)?;
        let text = section.markdown(study.name, study.title);
        println!("{text}");
        if args.frames.is_some() {
            continue;
        }
        section.write_figures(&args.docs.join("results"))?;
        // After each: what was measured is not lost when a later one is stopped.
        let path = args.docs.join(study.document.file());
        let document = std::fs::read_to_string(&path).unwrap_or_default();
        let document = study.document.put(&document, study, &text)?;
        std::fs::write(&path, document).with_context(|| path.display().to_string())?;
    }
    if args.frames.is_some() {
        println!("--frames: a quick look; the documents are left alone");
    }
    Ok(())
}
