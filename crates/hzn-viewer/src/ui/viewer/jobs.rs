//! Starts and ends the work on files and on the whole sequence, which runs on other threads.

use std::path::PathBuf;
use std::sync::Arc;

use super::Viewer;
use crate::model::settings::Layer;
use crate::work::export::{self, Video};
use crate::work::job::{Done, Job, JobError, Progress};
use crate::work::plots;
use crate::work::sweep::{self, Sweep};

impl Viewer {
    /// Processes all pictures into a new recording.
    pub(in crate::ui) fn run_into(&mut self, output: PathBuf) {
        let Some(session) = &self.session else {
            self.add_note("Open a sensor.toml first.");
            return;
        };
        let Some(config) = session.config().map(Arc::clone) else { return };
        let task = sweep::Task {
            sequence: self.sequence.clone(),
            config,
            version: session.version(),
            sensor_toml: session.sheet().text().to_owned(),
            flight: self.flight,
            output: Some(output),
        };
        self.sweep = Some(Sweep::start(task, Arc::clone(&self.wake)));
    }

    /// Saves the picture with its overlays.
    pub(in crate::ui) fn export_picture(&mut self, path: PathBuf) {
        let Some(frame_view) = self.frame_view.clone() else { return };
        let layers = self.layers_drawn();
        let truth = self.truth.get(&frame_view.name).and_then(|all| all.first()).cloned();
        self.start_job("Saving the picture", move |_| {
            export::save_picture(&frame_view, truth.as_ref(), &layers, &path)
        });
    }

    /// Saves the newest results of all pictures.
    pub(in crate::ui) fn export_table(&mut self, path: PathBuf) {
        let rows: Vec<_> = self.rows.all().cloned().collect();
        self.start_job("Saving results", move |progress| export::save_table(&rows, &path, progress));
    }

    /// Saves the chosen plots over time.
    pub(in crate::ui) fn export_plots(&mut self, path: PathBuf) {
        let sheet = crate::ui::plots::sheet(self);
        self.start_job("Saving the plots", move |progress| plots::save(&sheet, &path, progress));
    }

    /// Saves all pictures with their overlays as a video.
    pub(in crate::ui) fn export_video(&mut self, path: PathBuf) {
        let Some(config) = self.session.as_ref().and_then(|s| s.config().map(Arc::clone)) else { return };
        let fps = self.sequence.duration_s(0).filter(|d| *d > 0.0).map_or(25.0, |d| (1.0 / d).clamp(1.0, 60.0));
        let (sequence, layers, flight) = (self.sequence.clone(), self.layers_drawn(), self.flight);
        let video = Video { sequence, config, flight, truth: self.truth.clone(), layers, fps };
        self.start_job("Saving the video", move |progress| video.write(&path, progress));
    }

    /// Recovers a recording that was cut off; the recovered recording is then opened.
    pub(in crate::ui) fn recover(&mut self, path: PathBuf) {
        self.start_job("Recovering the recording", move |progress| export::recover(&path, progress));
    }

    fn layers_drawn(&self) -> Vec<Layer> {
        if self.layers_hidden { Vec::new() } else { self.settings.layers.clone() }
    }

    pub(super) fn start_job(
        &mut self,
        name: &'static str,
        work: impl FnOnce(&Progress) -> Result<Done, JobError> + Send + 'static,
    ) {
        self.jobs.push(Job::start(name, &self.wake, work));
    }

    /// Takes the results of finished jobs.
    pub(super) fn take_finished_jobs(&mut self) {
        let mut ends = Vec::new();
        self.jobs.retain(|job| job.end().map(|end| ends.push((job.name, end))).is_none());
        for (name, end) in ends {
            match end {
                Ok(Done::Written(path)) => self.add_note(format!("Written: {}", path.display())),
                Ok(Done::Rendered(folder)) => self.open_paths(vec![folder]),
                Ok(Done::Recovered { path, frames }) => {
                    self.open_paths(vec![path.clone()]);
                    self.add_note(format!("{frames} pictures recovered into {}", path.display()));
                }
                Err(JobError::Stopped) => self.add_note(format!("{name} was stopped; no file was written.")),
                Err(JobError::Failed(why)) => self.add_problem(why),
            }
        }
    }
}
