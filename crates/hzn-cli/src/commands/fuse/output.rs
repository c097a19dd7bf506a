//! The files that `hzn fuse` writes.

use std::io::BufWriter;
use std::path::{Path, PathBuf};

use hzn_fuse::finding::Level;
use hzn_fuse::input::Inputs;
use hzn_fuse::sink::{self, AemOptions, CkOptions, Utc};
use hzn_fuse::{Fused, Settings};
use hzn_nav::time::are_leap_seconds_known;
use hzn_run::disk::{self, Checked};

use super::args::{Args, names};
use super::page;
use crate::exit::{Stop, failed, usage};
use crate::files;
use crate::origin::sensors;

/// The files that are written.
pub(super) struct Outputs<'a> {
    args: &'a Args,
    results: PathBuf,
    utc: Option<Utc>,
}

impl<'a> Outputs<'a> {
    /// Chooses the files, and refuses those that exist or are read.
    pub(super) fn new(args: &'a Args) -> Result<Self, Stop> {
        let results = args.output.clone().unwrap_or_default();
        let outputs = Self { args, results, utc: args.utc.as_deref().map(Utc::parse).transpose()? };
        if !matches!(outputs.ending().as_str(), "csv" | "mcap") {
            return Err(usage(format!("{}: .mcap or .csv is expected", outputs.results.display())));
        }
        files::check_outputs(&args.inputs(), &outputs.all(), args.force)?;
        Ok(outputs)
    }

    fn ending(&self) -> String {
        self.results.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
    }

    /// Returns the table of the innovations, next to the CSV of the solutions.
    fn innovations(&self) -> PathBuf {
        self.results.with_extension("innovations.csv")
    }

    /// Returns every file that will be written.
    fn all(&self) -> Vec<PathBuf> {
        let args = self.args;
        let mut all = vec![self.results.clone()];
        if self.ending() == "csv" {
            all.push(self.innovations());
        }
        all.extend(args.report.iter().cloned());
        all.extend(self.attitudes());
        all.extend(args.write_frames.iter().map(|(_, file)| PathBuf::from(file)));
        all
    }

    /// Returns the files that carry the solution to other programs.
    pub(super) fn attitudes(&self) -> Vec<PathBuf> {
        let ck = self.args.ck.iter().flat_map(|ck| [ck.clone(), ck.with_extension("tsc"), ck.with_extension("tf")]);
        self.args.aem.iter().chain(&self.args.oem).cloned().chain(ck).collect()
    }

    /// Returns a warning if the UTC of the flight is later than the list of leap seconds.
    pub(super) fn leap_seconds(&self, fused: &Fused) -> Option<String> {
        let end_s = fused.epochs.last().or(fused.smoothed.last()).map(|e| e.state.time_s)?;
        let unix_s = self.utc?.unix_s + end_s;
        (!are_leap_seconds_known(unix_s)).then(|| {
            "the flight is later than 2026-06-28, when the list of leap seconds of this version expires; a leap second \
             after that day is not known, and would shift the clock kernel by a second"
                .to_owned()
        })
    }

    /// Writes everything, and returns the names of the files.
    pub(super) fn write(&self, fused: &Fused, inputs: &Inputs, settings: &Settings) -> Result<Vec<String>, Stop> {
        let args = self.args;
        let settings_toml = toml::to_string(settings).map_err(failed)?;
        if self.ending() == "mcap" {
            sink::write_mcap(fused, &settings_toml, &self.results)?;
        } else {
            sink::write_states(fused, create(&self.results)?)?;
            sink::write_innovations(fused, create(&self.innovations())?)?;
        }
        if let Some(path) = &args.report {
            let page = page::html(
                fused,
                &self.results.display().to_string(),
                &sensors(args.nadir.iter().map(PathBuf::as_path)),
            )?;
            disk::write(path, page)?;
        }
        for (camera, file) in &args.write_frames {
            let found = inputs.recordings.iter().find(|r| r.name == *camera && !r.is_table);
            let recording =
                found.ok_or_else(|| usage(format!("--write-frames {camera}: no such camera; {}", names(inputs))))?;
            sink::write_frames(fused, recording, self.utc, create(Path::new(file))?)?;
        }
        let contradicts = fused.verdict.level() == Level::Contradicts;
        if contradicts && !args.force {
            // Others take an attitude without its verdict.
            return Ok(self.all().iter().filter(|path| !self.attitudes().contains(path)).map(shown).collect());
        }
        if let Some(utc) = self.utc {
            let created = Utc::now().iso(0.0);
            let object_name = args.object.clone();
            let options = AemOptions {
                version: args.aem_version.into(),
                utc,
                object_id: object_name.clone(),
                object_name,
                created,
            };
            args.aem.iter().try_for_each(|path| Ok::<(), Stop>(sink::write_aem(fused, &options, create(path)?)?))?;
            args.oem.iter().try_for_each(|path| Ok::<(), Stop>(sink::write_oem(fused, &options, create(path)?)?))?;
        }
        if let (Some(path), Some(utc)) = (&args.ck, self.utc) {
            sink::write_ck(fused, &CkOptions { utc, spacecraft: args.spacecraft }, path)?;
        }
        Ok(self.all().iter().map(shown).collect())
    }
}

fn shown(path: impl AsRef<Path>) -> String {
    path.as_ref().display().to_string()
}

fn create(path: &Path) -> Result<BufWriter<Checked>, Stop> {
    Checked::create(path).map(BufWriter::new).map_err(|e| Stop::from(disk::cannot_write(path, &e)))
}
