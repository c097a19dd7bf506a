//! The calibration of the lens from pictures of a chessboard, with the code of `hzn calibrate board`.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use hzn_calib::board::{self, Board, Calibrated, Pictures, Searched};
use hzn_calib::corners::Grey;
use hzn_core::camera::{Config, Model};
use hzn_core::image::Channel;
use hzn_run::explain::counted;
use hzn_run::source::{self, Item, Payload};

use super::measured::{Marks, Measured, Steps};

/// Name of the calibration on the screen.
pub const NAME: &str = "Lens from board pictures";

/// What is calibrated.
#[derive(Debug, Clone)]
pub struct Task {
    /// Folder with the pictures of the board.
    pub folder: PathBuf,
    /// The board.
    pub board: Board,
    /// Model of the lens.
    pub model: Model,
    /// The camera of the sensor.
    pub camera: Config,
    /// The text of the sensor.toml.
    pub sensor_toml: String,
}

impl Task {
    /// Calibrates; `None` if it was stopped.
    ///
    /// # Errors
    /// The pictures cannot be read, show no board, are of another size than the sensor's, or do not determine the lens.
    pub fn run(&self, steps: &Steps) -> Result<Option<Measured>, String> {
        let Some(searched) = self.search(steps)? else { return Ok(None) };
        let pictures = Pictures::new(&searched, &self.board).map_err(|why| {
            let details = why.details().iter().map(|line| format!("\n{line}"));
            format!("{why}{}", details.collect::<String>())
        })?;
        let own = [self.camera.width, self.camera.height];
        if pictures.size_px != own {
            let [w, h] = pictures.size_px;
            return Err(format!(
                "The board pictures have {w} x {h} px, the sensor's camera {} x {}: take them with the same settings.",
                own[0], own[1]
            ));
        }
        let found = board::calibrate(self.model, pictures.size_px, &self.board, &pictures.views);
        let found = found.map_err(|why| why.to_string())?;
        self.measured(&found, &pictures).map(Some)
    }

    /// Searches all pictures on all cores but one, which is left for the window.
    fn search(&self, steps: &Steps) -> Result<Option<Vec<Searched>>, String> {
        let mut source = source::open(std::slice::from_ref(&self.folder), None, None).map_err(|e| e.to_string())?;
        let threads = std::thread::available_parallelism().map_or(1, usize::from).saturating_sub(1).max(1);
        let mut all = Vec::new();
        loop {
            let mut batch: Vec<Item> = Vec::new();
            while batch.len() < threads
                && let Some(item) = source.next()
            {
                batch.push(item.map_err(|e| e.to_string())?);
            }
            if batch.is_empty() {
                return Ok(Some(all));
            }
            std::thread::scope(|scope| {
                let each =
                    batch.into_iter().map(|item| scope.spawn(|| search_one(item.name, item.payload, &self.board)));
                let each: Vec<_> = each.collect();
                // A picture that breaks the search is left out, so that the others count.
                all.extend(each.into_iter().filter_map(|thread| thread.join().ok()));
            });
            steps.done.store(all.len() as u64, Ordering::Relaxed);
            (steps.wake)();
            if steps.stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
        }
    }

    fn measured(&self, found: &Calibrated, pictures: &Pictures) -> Result<Measured, String> {
        let used = found.views.iter().filter(|view| view.dropped.is_none()).count() as u64;
        let folder = self.folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let source = format!("{} of {folder}", counted(used, "board picture"));
        let written = board::into_sensor_toml(&self.sensor_toml, &found.camera, &source)?;
        let mut lines = found.lines();
        lines.extend(found.warnings.iter().map(|warning| ("warning".to_owned(), warning.to_string())));
        if let Some([columns, rows]) = pictures.largest_part {
            let words = format!("no picture shows the whole board; the largest part has {columns} x {rows} corners");
            lines.push(("warning".to_owned(), words));
        }
        let left_out = |name: &str, why: &dyn std::fmt::Display| (name.to_owned(), format!("left out: {why}"));
        lines.extend(pictures.reasons.iter().map(|(name, why)| left_out(name, why)));
        let dropped = found.views.iter().filter(|view| !pictures.reasons.contains_key(&view.name));
        lines.extend(dropped.filter_map(|view| Some(left_out(&view.name, &view.dropped?))));
        Ok(Measured {
            lines,
            keys: written.keys,
            text: Ok(written.text),
            heights: Vec::new(),
            height_km: f64::NAN,
            marks: Some(residuals(found)),
        })
    }
}

/// Returns the length of each residual by the distance of its corner from the principal point.
fn residuals(found: &Calibrated) -> Marks {
    let camera = &found.camera;
    let all = found.views.iter().flat_map(|view| &view.residuals);
    let mark = |r: &board::Residual| {
        let [u, v] = r.at_px;
        ([(u - camera.cx_px).hypot(v - camera.cy_px), r.error_px[0].hypot(r.error_px[1])], r.counts)
    };
    Marks {
        title: "Residual of each corner by its distance from the principal point, px",
        points: all.map(mark).collect(),
    }
}

fn search_one(name: String, payload: Payload, board: &Board) -> Searched {
    let grey = || {
        let (picture, _) = payload.decode(None)?;
        let view = picture.view(Channel::Mean).map_err(|e| e.to_string())?;
        Ok::<Grey, String>(Grey::from_pixels(&view))
    };
    Searched::new(name, grey(), board)
}
