//! Finds, reads and takes results of other commands that belong to the sequence.

use std::path::Path;
use std::sync::Arc;

use crossbeam_channel::TryRecvError;

use super::Viewer;
use super::companions::Companions;
use crate::model::settings::Layer;
use crate::work::companion::{self, Companion};

impl Viewer {
    /// Forgets the files of the last sequence, and looks for those of this one: in its folder, and next to a folder of
    /// pictures.
    pub(super) fn search_companions(&mut self) {
        let beside = self.sequence.default_output_path("nav.mcap");
        let folders = [Some(self.sequence.folder.as_path()), beside.parent()];
        let folders = folders.into_iter().flatten().map(Path::to_owned).collect();
        let reading = vec![companion::search(folders, Arc::clone(&self.wake))];
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
                Companion::Navigation(navigation) => {
                    self.add_note(format!("{}: the plots “Nav: …” show these results of hzn fuse.", navigation.file));
                    self.companions.navigation = Some(navigation);
                }
                Companion::Residuals(residuals) => {
                    let what = "the overlay “Lens residuals” shows these residuals of a calibration";
                    self.add_note(format!("{}: {what}.", residuals.file));
                    self.companions.residuals = Some(residuals);
                }
                Companion::Failed(why) => self.add_problem(why),
            }
        }
    }
}
