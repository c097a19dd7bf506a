//! The folders into which a run writes pictures: overlays, masks, and copies of FITS files.

use std::path::{Path, PathBuf};

use hzn_run::disk;
use hzn_run::engine::Finished;
use hzn_run::mask::MaskOutcome;
use hzn_run::source::Source;

use super::Args;
use crate::exit::{Stop, usage};
use crate::files;
use crate::progress::Progress;
use crate::tell;

/// Returns the folders with the options that name them.
fn given(args: &Args) -> impl Iterator<Item = (&'static str, &Path)> {
    let folders = [("--overlay", &args.overlay), ("--mask-pictures", &args.mask_pictures), ("--wcs", &args.wcs)];
    folders.into_iter().filter_map(|(option, folder)| Some((option, folder.as_deref()?)))
}

/// Refuses folders whose pictures would replace others of this run, and returns the pictures that can be replaced.
pub(super) fn check(args: &Args, source: &dyn Source) -> Result<Vec<PathBuf>, Stop> {
    for (option, folder) in given(args) {
        if disk::is_same(folder, &source.folder()) {
            let what = "is the folder of the pictures, and they would be replaced; choose another folder";
            return Err(usage(format!("{option} {}: {what}", folder.display())));
        }
    }
    if let (Some(drawn), Some(masks)) = (&args.overlay, &args.mask_pictures)
        && (drawn == masks || disk::is_same(drawn, masks))
    {
        let what = "is the folder of --overlay, and the pictures have the same names; choose another folder";
        return Err(usage(format!("--mask-pictures {}: {what}", masks.display())));
    }
    Ok(given(args).flat_map(|(_, folder)| files::pictures_in(folder)).collect())
}

/// Makes the folders. With `--force` or `--resume` they may already contain files.
pub(super) fn prepare(args: &Args) -> Result<(), Stop> {
    given(args).try_for_each(|(option, folder)| {
        std::fs::create_dir_all(folder).map_err(|e| disk::cannot_write(folder, &e))?;
        let has_files = std::fs::read_dir(folder).map_err(|e| disk::cannot_write(folder, &e))?.next().is_some();
        if has_files && !(args.force || args.resume) {
            let what = "contains files already; choose another folder, or --force replaces files of the same name";
            return Err(usage(format!("{option} {}: {what}", folder.display())));
        }
        Ok(())
    })
}

/// Number of pictures without a mask that are named.
const MAX_LISTED: u64 = 20;

/// Counts the pictures whose masks are missing or incomplete.
#[derive(Default)]
pub(super) struct Masks {
    missing: u64,
    /// For each body of the sensor's further ones: the number of masks without it.
    without: Vec<(&'static str, u64)>,
}

impl Masks {
    /// Counts a picture, and names it if it has no mask.
    pub(super) fn count(&mut self, frame: &Finished, progress: &Progress) {
        match &frame.mask {
            Some(MaskOutcome::Missing(why)) => {
                self.missing += 1;
                // A picture without an answer has a status, which says more.
                let answered =
                    frame.outcomes.first().filter(|found| found.report.as_ref().is_ok_and(|r| r.solution.is_some()));
                let status = frame.outcomes.first().map_or("", |found| found.status().name());
                let why = if answered.is_some() { why } else { status };
                if self.missing <= MAX_LISTED {
                    let further = if self.missing == MAX_LISTED { " (further ones are only counted)" } else { "" };
                    progress.say(&format!("no mask: {}: {why}{further}", frame.name));
                }
            }
            Some(MaskOutcome::Written(without)) => {
                for body in without.iter().map(|kind| kind.name()) {
                    match self.without.iter_mut().find(|(name, _)| *name == body) {
                        Some((_, masks)) => *masks += 1,
                        None => self.without.push((body, 1)),
                    }
                }
            }
            None => {}
        }
    }

    /// Tells how many masks are missing, and which are without a body.
    pub(super) fn tell(&self) {
        if self.missing > 0 {
            let pictures = hzn_run::explain::counted(self.missing, "picture");
            tell::line(format_args!("note: {pictures} without a mask: the limb was not found there, see the statuses"));
        }
        for (body, masks) in &self.without {
            let masks = hzn_run::explain::counted(*masks, "mask");
            tell::line(format_args!(
                "note: {masks} without {body}, which was not found, and its direction is not known"
            ));
        }
    }
}
