//! Finds, reads and takes results of other commands that belong to the sequence.

use std::path::Path;
use std::sync::Arc;

use crossbeam_channel::TryRecvError;

use super::Viewer;
use super::companions::Companions;
use crate::model::Navigation;
use crate::model::settings::Layer;
use crate::work::companion::{self, Companion};

impl Viewer {
    /// Forgets the files of the last sequence, and looks for those of this one: in its folder, and next to a folder of
    /// pictures.
    pub(super) fn search_companions(&mut self) {
        let beside = self.sequence.default_output_path("nav.mcap");
        let folders = [Some(self.sequence.folder.as_path()), beside.parent()];
        let folders = folders.into_iter().flatten().map(Path::to_owned).collect();
        // Only a folder of pictures is theirs alone; next to a recording lie others.
        let is_folder = self.sequence.inputs.iter().any(|input| input.is_dir());
        let own = is_folder.then(|| self.sequence.folder.clone());
        let reading = vec![companion::search(folders, own, Arc::clone(&self.wake))];
        self.companions = Companions { reading, ..Companions::default() };
    }

    /// Reads a file that the user opened next to the sequence.
    pub(super) fn attach(&mut self, path: &Path) {
        if self.sequence.title.is_empty() {
            let what = "holds results and no pictures; open the pictures or a recording first, then this file";
            return self.add_problem(format!("{}: {what}", path.display()));
        }
        // The user opened it to see it.
        self.settings.show(Layer::Lens, true);
        self.companions.reading.push(companion::load(path.to_owned(), Arc::clone(&self.wake)));
    }

    /// Takes the files that were read.
    pub(super) fn poll_companions(&mut self) {
        let mut read = Vec::new();
        self.companions.reading.retain(|receiver| {
            loop {
                match receiver.try_recv() {
                    Ok(companion) => read.push(companion),
                    Err(why) => return why == TryRecvError::Empty,
                }
            }
        });
        for companion in read {
            match companion {
                Companion::Navigation(navigation, true) => self.companions.doubtful = Some(navigation),
                Companion::Navigation(navigation, false) => self.take_navigation(navigation),
                Companion::Residuals(residuals) => {
                    let what = "the overlay “Lens residuals” shows these residuals of a calibration";
                    self.add_note(format!("{}: {what}.", residuals.file));
                    self.companions.residuals = Some(residuals);
                }
                Companion::Failed(why) => self.add_problem(why),
            }
        }
        // The times of a recording are known when all of it is listed.
        if self.sequence.complete
            && let Some(navigation) = self.companions.doubtful.take()
        {
            self.take_if_of_these(navigation);
        }
    }

    fn take_navigation(&mut self, navigation: Navigation) {
        let what = "the plots “Nav: …” show these results of hzn fuse";
        self.add_note(format!("{}: {what}{}.", navigation.file, of_cameras(&navigation)));
        self.companions.navigation = Some(navigation);
    }

    /// Takes results that lie among those of other pictures, if they are of these.
    fn take_if_of_these(&mut self, navigation: Navigation) {
        let times_s: Vec<f64> = self.sequence.entries.iter().filter_map(|e| e.time_s).collect();
        if navigation.is_of(self.sequence.stem(), &times_s) {
            return self.take_navigation(navigation);
        }
        let (file, folder, cameras) = (&navigation.file, navigation.folder.display(), of_cameras(&navigation));
        // A name without a folder is that of a file in the folder in which the window was started.
        let place = if navigation.folder.as_os_str().is_empty() { String::new() } else { format!(" in {folder}") };
        let span = navigation.span_s().map(|[from, to]| format!(", {from:.1} to {to:.1} s")).unwrap_or_default();
        self.add_note(format!(
            "{file}{place}{cameras}{span} is of other pictures than these and is not shown. To see it, open it \
             (File, Open file…)."
        ));
    }
}

/// Returns the cameras of results in words.
fn of_cameras(navigation: &Navigation) -> String {
    match navigation.cameras.as_slice() {
        [] => String::new(),
        [one] => format!(" (camera {one})"),
        all => format!(" (cameras {})", all.join(", ")),
    }
}
