//! Measures our numbers to compare them with the published ones, and measures accuracy and honesty on rendered flights:
//! `cargo xtask reproduce`. A sensor is honest if its errors are as large as its covariance says (NEES).
//!
//! A [`studies::Study`] has a name, a title and a function that measures and returns a [`section::Section`]. The
//! sections make up `book/results/reproduction.md`. To add a study, write a function in `studies` and a line in
//! [`studies::ALL`].
#![forbid(unsafe_code)]

mod document;
mod fly;
mod section;
mod studies;

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Parser;

use studies::{ALL, Effort, names_in};

/// Measures the numbers of book/results/reproduction.md and of parts of book/theory/methods.md again, and writes them;
/// writes book/results/papers.md from the tables in reproduce/papers
#[derive(Debug, Parser)]
#[command(name = "cargo xtask reproduce")]
struct Args {
    /// Studies to run; all studies if none is named
    #[arg(value_name = "STUDY")]
    studies: Vec<String>,
    /// Frames per scene instead of each study's own number, for a quick look; no document is written then
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Folder that keeps the results of the pictures of atek and orbit. A flight that is there is not rendered again:
    /// use it to change the filter, never after a change of the sensor or of the simulator
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// List the names and titles of the studies
    #[arg(long)]
    list: bool,
    /// Folder of the book
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
        bail!("unknown study {unknown:?}; the studies are {}", names.join(", "));
    }
    if args.frames == Some(0) {
        bail!("--frames: must be 1 or more");
    }
    let effort = Effort { frames: args.frames, recordings: args.recordings.clone() };
    for study in ALL.iter().filter(|s| args.studies.is_empty() || args.studies.iter().any(|n| n == s.name)) {
        println!("{} ...", study.title);
        let section = (study.run)(&effort).with_context(|| study.name)?;
        let text = section.markdown(study.name, study.title);
        println!("{text}");
        if args.frames.is_some() {
            continue;
        }
        section.write_figures(&args.docs.join("results"))?;
        // The document is written after each study, so that no result is lost when a later study is stopped.
        let path = args.docs.join(study.document.file());
        let document = std::fs::read_to_string(&path).unwrap_or_default();
        let document = study.document.put(&document, &names_in(study.document), study.name, &text)?;
        std::fs::write(&path, document).with_context(|| path.display().to_string())?;
    }
    if args.frames.is_some() {
        println!("--frames is set, so no document is written");
    }
    Ok(())
}
