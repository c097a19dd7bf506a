//! Several outputs of one run.

use std::path::{Path, PathBuf};

use hzn_mcap::{FrameRecord, Row};

use super::chain::{Chain, Links};
use super::{Existing, Output, Settings, StoredResults, Target, on_stdout, open, rows, target};
use crate::checked_row::sum;
use crate::engine::{Finished, Sink};
use crate::error::{Error, Remedy, unusable};

/// The name of standard output among the outputs.
const STDOUT: &str = "-";

/// All outputs of a run. Each gets every picture.
pub struct Outputs {
    each: Vec<One>,
    /// Number of the picture that is written next.
    next: u64,
    /// Number of the first epoch of a rig that is processed again, for comparison.
    again_from: u64,
    /// Whether this run has written something.
    has_written: bool,
}

struct One {
    output: Output,
    name: String,
    /// The results that it contained before this run. Its pictures are compared, not written again.
    stored: StoredResults,
    /// The file next to it that says which pictures were processed; not for stdout.
    chain: Option<Chain>,
}

impl Outputs {
    /// Opens the outputs; `-` is stdout, and without any path a table on stdout is the only output. `format` is that
    /// of stdout. Also returns the results that all of them contain already: those of the shortest output.
    ///
    /// # Errors
    /// Two outputs are the same, several are recordings, two contain different results, or one cannot be opened.
    pub fn open(
        paths: &[PathBuf],
        format: Target,
        existing: Existing,
        settings: Settings<'_>,
    ) -> Result<(Self, StoredResults), Error> {
        Self::check(paths, existing)?;
        let mut outputs = Self { each: Vec::new(), next: 0, again_from: 0, has_written: false };
        for path in order(paths) {
            match One::open(path, format, existing, settings) {
                Ok(one) => outputs.each.push(one),
                Err(error) => {
                    outputs.put_back()?;
                    return Err(error);
                }
            }
        }
        let shortest = outputs.each.iter().map(|one| &one.stored).min_by_key(|stored| stored.frames).cloned();
        let shortest = shortest.unwrap_or_default();
        let differs = |one: &&One| !one.stored.sums.starts_with(&shortest.sums);
        if let Some(other) = outputs.each.iter().find(differs) {
            let what = "contains other results than the other outputs, so they are not of one run";
            let error = unusable(format!("{}: {what}", other.name)).with_remedy(Remedy::Restart);
            outputs.put_back()?;
            return Err(error);
        }
        outputs.next = shortest.frames;
        Ok((outputs, shortest))
    }

    /// Refuses outputs that contradict each other, before anything is opened.
    ///
    /// # Errors
    /// Two outputs are the same, several are recordings, an ending is not known, or stdout is to be continued.
    pub fn check(paths: &[PathBuf], existing: Existing) -> Result<(), Error> {
        let files: Vec<&PathBuf> = paths.iter().filter(|path| *path != Path::new(STDOUT)).collect();
        if files.len() < paths.len() && existing == Existing::Resume {
            return Err(unusable("a table on standard output cannot be continued; leave out --resume"));
        }
        for (i, path) in paths.iter().enumerate() {
            if paths.iter().take(i).any(|before| before == path) {
                return Err(unusable(format!("{}: is given twice as an output", path.display())));
            }
        }
        let targets = files.iter().map(|path| target(path)).collect::<Result<Vec<_>, _>>()?;
        if targets.iter().filter(|target| **target == Target::Mcap).count() > 1 {
            return Err(unusable("only one of the outputs can be a recording (.mcap); copy it when it is complete"));
        }
        Ok(())
    }

    /// Returns whether an output stores the edges and points of pictures.
    pub fn want_trace(paths: &[PathBuf]) -> bool {
        paths.iter().any(|path| Output::wants_trace(Some(path)))
    }

    /// Lets a continued run of a rig begin at an earlier epoch than the first that is missing. The epochs in between
    /// are compared with what the outputs contain.
    pub fn run_again_from(&mut self, epoch: u64) {
        (self.next, self.again_from) = (epoch, epoch);
    }

    /// Returns whether anything was written to an output since it was opened.
    pub fn has_written(&self) -> bool {
        self.has_written
    }

    /// Appends the records of an epoch of a rig, as [`Output::write_heads`] does. `identity` tells its pictures from
    /// others. An output that contains the epoch already must have the same rows.
    ///
    /// # Errors
    /// The disk fails, or an output contains another result.
    pub(crate) fn write_heads(&mut self, heads: &[Vec<FrameRecord>], identity: Option<u64>) -> Result<(), Error> {
        // The joint answer also depends on the epoch before.
        let with_joint = self.next == 0 || self.next > self.again_from;
        for one in &mut self.each {
            if self.next < one.stored.frames {
                one.compare_epoch(self.next, heads, with_joint)?;
            } else {
                if let Some(chain) = &mut one.chain {
                    chain.add(identity, &sums(heads.iter().flatten().map(|record| &record.row))?)?;
                }
                one.output.write_heads(heads)?;
                self.has_written = true;
            }
        }
        self.next += 1;
        Ok(())
    }

    /// Closes the files and gives them their final names. `is_over` says that the run has ended by itself; otherwise
    /// what is known of the pictures stays next to them, for the run that continues this one.
    ///
    /// # Errors
    /// The disk fails. The other outputs are finished all the same.
    pub fn finish(mut self, is_over: bool) -> Result<(), Error> {
        if !is_over {
            self.flush_chains()?;
        }
        self.close(|one| {
            one.output.finish()?;
            one.chain.into_iter().filter(|_| is_over).for_each(Chain::remove);
            Ok(())
        })
    }

    /// Closes outputs that were opened to be continued, without further results. Their names and the times of their
    /// last writes stay.
    ///
    /// # Errors
    /// The disk fails.
    pub fn put_back(self) -> Result<(), Error> {
        self.close(|one| one.output.put_back(one.stored.written))
    }

    fn close(self, how: impl Fn(One) -> Result<(), Error>) -> Result<(), Error> {
        let closed: Vec<_> = self.each.into_iter().map(how).collect();
        closed.into_iter().collect()
    }

    fn flush_chains(&mut self) -> Result<(), Error> {
        self.each.iter_mut().filter_map(|one| one.chain.as_mut()).try_for_each(Chain::flush)
    }
}

impl One {
    fn open(path: &Path, format: Target, existing: Existing, settings: Settings<'_>) -> Result<Self, Error> {
        let name = path.display().to_string();
        if path == Path::new(STDOUT) {
            let output = on_stdout(format, settings.config)?;
            return Ok(Self { output, name, stored: StoredResults::default(), chain: None });
        }
        let (output, mut stored) = open(path, existing, settings)?;
        let (frames, links) = (stored.frames, Links::read(path, stored.frames, |n| stored.sums_of(n)));
        let chain = Some(Chain::new(path, links.clone(), frames, |n| stored.sums_of(n)));
        stored.links = links;
        Ok(Self { output, name, stored, chain })
    }
}

impl One {
    /// Compares the rows of a picture with those that the output contains.
    fn compare(&self, frame: &Finished) -> Result<(), Error> {
        let found = sums(&rows(frame, &self.output.config))?;
        let first = frame.index as usize * found.len();
        if self.stored.sums.get(first..first + found.len()) == Some(found.as_slice()) {
            return Ok(());
        }
        let what = format!("contains another result of its picture {}, {}", frame.index, frame.name);
        Err(unusable(format!("{}: {what}", self.name)).with_remedy(Remedy::Restart))
    }
}

impl One {
    /// Compares the rows of an epoch with those that the output contains, with or without the joint answer, which is
    /// the first.
    fn compare_epoch(&self, index: u64, heads: &[Vec<FrameRecord>], with_joint: bool) -> Result<(), Error> {
        let rows = || heads.iter().flatten().map(|record| &record.row);
        let found = sums(rows())?;
        let stored = self.stored.sums_of_epoch(index);
        let is_same = |(k, (a, b)): (usize, (&u32, &u32))| a == b || (k == 0 && !with_joint);
        if stored.len() == found.len() && stored.iter().zip(&found).enumerate().all(is_same) {
            return Ok(());
        }
        let file = rows().map(|row| row.file.as_str()).next().unwrap_or_default();
        Err(unusable(format!(
            "{}: its epoch {index}, {file}, now gives another result; give the rig.toml, sensors, tables, pictures and \
             options that it was begun with",
            self.name
        ))
        .with_remedy(Remedy::Restart))
    }
}

impl Sink for Outputs {
    fn write(&mut self, frame: &mut Finished) -> Result<(), Error> {
        for one in &mut self.each {
            if self.next < one.stored.frames {
                one.compare(frame)?;
            } else {
                if let Some(chain) = &mut one.chain {
                    chain.add(frame.identity, &sums(&rows(frame, &one.output.config))?)?;
                }
                one.output.write(frame)?;
            }
        }
        self.next += 1;
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        // First, so that each row in an output is known here.
        self.flush_chains()?;
        self.each.iter_mut().try_for_each(|one| one.output.flush())
    }
}

/// Returns the checksums of rows.
fn sums<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Result<Vec<u32>, Error> {
    rows.into_iter().map(sum).collect()
}

/// Returns the outputs in the order in which a picture is written. A recording comes last, because the pixels and the
/// drawing are moved into it.
fn order(paths: &[PathBuf]) -> Vec<&Path> {
    if paths.is_empty() {
        return vec![Path::new(STDOUT)];
    }
    let mut ordered: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    ordered.sort_by_key(|path| Output::wants_trace(Some(path)));
    ordered
}
