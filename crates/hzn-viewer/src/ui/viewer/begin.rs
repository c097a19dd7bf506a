//! The first minute: a first sensor.toml, and the demo flight.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hzn_core::Config;
use hzn_files::start::Exif;
use hzn_files::truth::Truth;

use super::Viewer;
use super::changes::Leave;
use crate::model::{Place, Session, autosave};
use crate::ui::board_form::BoardForm;
use crate::ui::calibration_window::CalibrationWindow;
use crate::ui::path_dialog::{PathDialog, Purpose};
use crate::ui::wizard_form::Wizard;
use crate::work::board;
use crate::work::calibration::{self, Calibration, Kind};
use crate::work::demo::{self, Sample};
use crate::work::lens_from_limb::LensFromLimb;
use crate::work::open::Request;
use crate::work::study::{Study, Task};
use crate::work::thumbnails::Thumbnail;

impl Viewer {
    /// Opens the form for a first sensor.toml, for the picture that the user chose. If another one is still shown, the
    /// form waits for it: size and EXIF have to come from the same picture.
    pub(in crate::ui) fn open_wizard(&mut self) {
        self.wizard_is_due = true;
        self.open_due_wizard();
    }

    /// Opens the form once its picture is shown.
    pub(super) fn open_due_wizard(&mut self) {
        let shown = self.frame_view.as_ref().filter(|shown| shown.index == self.playback.frame());
        let Some(shown) = shown.filter(|_| std::mem::take(&mut self.wizard_is_due)) else { return };
        let Some(size) = shown.size() else {
            return self.add_note("This picture cannot be read. Choose another one for the form.");
        };
        let exif = match self.sequence.entries.get(shown.index).map(|e| &e.place) {
            Some(Place::File(path)) => hzn_run::source::exif_lens(path).unwrap_or_default(),
            _ => Exif::default(),
        };
        let has_altitudes = self.sequence.has_altitudes();
        let name = shown.name.clone();
        self.wizard = Some(Wizard { name, ..Wizard::new(size.map(|x| x as u32), exif, has_altitudes) });
    }

    /// Starts the measurement of the lens in the pictures, for the form.
    pub(in crate::ui) fn measure_lens(&self, wizard: &mut Wizard) {
        let request = Request { inputs: self.sequence.inputs.clone(), ..self.request.clone() };
        wizard.no_lens = None;
        wizard.measuring = Some(LensFromLimb::start(request, wizard.facts_without_lens(), &self.wake));
    }

    /// Takes the lens that the limb says: the form ends with a sensor.toml, or says why there is none.
    pub(super) fn poll_lens(&mut self) {
        let Some(wizard) = &mut self.wizard else { return };
        let Some(end) = wizard.measuring.as_ref().and_then(LensFromLimb::end) else { return };
        wizard.measuring = None;
        match end {
            Ok(found) => {
                self.wizard = None;
                self.begin_session(&found.start.text, found.start.warnings);
                self.add_note(found.says);
            }
            Err(why) => wizard.no_lens = Some(why),
        }
    }

    /// Begins a session with a text that is not saved yet.
    pub(in crate::ui) fn begin_session(&mut self, text: &str, warnings: Vec<String>) {
        let home = autosave::absolute(&self.sequence.folder.join("sensor.toml"));
        // The text differs from the empty file, so it counts as a change that can be saved.
        let mut session = Session::new("", &home, None);
        session.set_text(text);
        self.set_session(session);
        warnings.into_iter().for_each(|w| self.add_note(w));
        self.add_note(format!("Save the sensor.toml to keep it: {}", home.display()));
    }

    /// Returns true while a calibration runs.
    pub fn is_calibrating(&self) -> bool {
        self.calibration.as_ref().is_some_and(|window| window.running.is_some())
    }

    /// Starts a calibration on the pictures.
    pub(in crate::ui) fn calibrate(&mut self, kind: Kind) {
        let Some(session) = &self.session else { return self.add_note("Open a sensor.toml first.") };
        let (Some(config), None) = (session.config().map(Arc::clone), session.problem()) else {
            return self.add_note("The sensor.toml has an error; mend it first.");
        };
        let version = session.version();
        let sensor_toml = session.sheet().text().to_owned();
        let task =
            calibration::Task { kind, sequence: self.sequence.clone(), config, sensor_toml, flight: self.flight };
        let running = Some(Calibration::start(task, Arc::clone(&self.wake)));
        self.calibration = Some(CalibrationWindow { name: kind.name(), form: None, running, result: None, version });
    }

    /// Asks for the board whose pictures calibrate the lens.
    pub(in crate::ui) fn ask_board(&mut self) {
        let Some(session) = &self.session else { return self.add_note("Open a sensor.toml first.") };
        let (Some(config), None) = (session.config(), session.problem()) else {
            return self.add_note("The sensor.toml has an error; mend it first.");
        };
        let (form, version) = (Some(BoardForm::new(config.camera.model)), session.version());
        self.calibration = Some(CalibrationWindow { name: board::NAME, form, running: None, result: None, version });
    }

    /// Asks for the folder with the pictures of the board.
    pub(in crate::ui) fn ask_board_pictures(&mut self) {
        let mut dialog = PathDialog::new(Purpose::Boards, &self.sequence.folder);
        if self.native_dialogs {
            dialog.browse_only(true);
        }
        self.path_dialog = Some(dialog);
    }

    /// Calibrates the lens from the pictures in a folder.
    pub(in crate::ui) fn calibrate_board(&mut self, folder: PathBuf) {
        let (Some(window), Some(session)) = (&mut self.calibration, &self.session) else { return };
        let (Some(form), Some(config)) = (window.form, session.config()) else { return };
        let task = board::Task {
            folder,
            board: form.board(),
            model: form.model,
            camera: config.camera.clone(),
            sensor_toml: session.sheet().text().to_owned(),
        };
        (window.version, window.result) = (session.version(), None);
        window.running = Some(Calibration::start_board(task, Arc::clone(&self.wake)));
    }

    /// Returns the folder of the settings, if they are kept.
    pub(in crate::ui) fn settings_folder(&self) -> Option<PathBuf> {
        self.store.as_deref().and_then(Path::parent).map(Path::to_owned)
    }

    /// Returns the small picture of a file or folder.
    pub(in crate::ui) fn thumbnail(&mut self, path: &Path) -> Thumbnail {
        let kept = self.settings_folder().map(|folder| folder.join("thumbnails"));
        self.textures.thumbnails.of(path, kept.as_deref(), &self.wake)
    }

    /// Returns the folder of a sample: next to the settings, or in the folder for temporary files.
    fn sample_folder(&self, sample: Sample) -> PathBuf {
        self.settings_folder().unwrap_or_else(|| std::env::temp_dir().join("hzn")).join(sample.folder())
    }

    /// Opens a sample. Its pictures are rendered the first time.
    pub(in crate::ui) fn open_sample(&mut self, sample: Sample) {
        let folder = self.sample_folder(sample);
        if demo::is_complete(&folder) {
            let request = Request { inputs: vec![folder], fps: self.request.fps, ..Request::default() };
            self.leave(Leave::Sequence(Box::new(request)), None);
        } else {
            self.start_job("Rendering the sample", move |progress| demo::render(sample, &folder, progress));
        }
    }

    /// Starts the sweep of a parameter with these values and configurations.
    pub(in crate::ui) fn start_study(&self, values: Vec<(f64, Arc<Config>)>) -> Study {
        let body =
            self.session.as_ref().and_then(|s| s.config()).and_then(|c| c.each_body().get(self.body).map(|b| b.kind));
        let name = body.map_or("earth", |kind| kind.name());
        let axis = |(file, all): (&String, &Vec<Truth>)| {
            let truth = all.iter().find(|t| t.body == name)?;
            Some((file.clone(), truth.axis()?.xyz()))
        };
        let truth = self.truth.iter().filter_map(axis).collect();
        let task = Task { sequence: self.sequence.clone(), values, truth, body: self.body, flight: self.flight };
        Study::start(task, Arc::clone(&self.wake))
    }
}
