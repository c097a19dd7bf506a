//! The first sensor.toml of a camera whose lens nobody knows: the limb in the pictures says the field of view.

use std::sync::Arc;

use crossbeam_channel::{Receiver, bounded};
use hzn_files::start::{self, CameraFacts, Exif, StartConfig};
use hzn_run::explain::counted;
use hzn_run::open;
use hzn_run::source;
use hzn_run::start::{LimbSays, measure_field_of_view, read_camera_facts};

use super::Wake;
use super::open::Request;

/// A sensor.toml with the lens that the limb says.
#[derive(Debug)]
pub struct LimbStart {
    /// The sensor.toml.
    pub start: StartConfig,
    /// What the limb says, in words.
    pub says: String,
}

/// A measurement in progress, on a separate thread.
#[derive(Debug)]
pub struct LensFromLimb {
    end: Receiver<Result<LimbStart, String>>,
}

impl LensFromLimb {
    /// Starts the measurement in the pictures of `request`; `known` says altitude and body. `wake` is called at its
    /// end.
    pub fn start(request: Request, known: CameraFacts, wake: &Wake) -> Self {
        let (send, end) = bounded(1);
        let wake = Arc::clone(wake);
        std::thread::spawn(move || {
            let _ = send.send(measure(&request, &known));
            wake();
        });
        Self { end }
    }

    /// Returns the result once the measurement has ended, and only once.
    pub fn end(&self) -> Option<Result<LimbStart, String>> {
        self.end.try_recv().ok()
    }
}

fn measure(request: &Request, known: &CameraFacts) -> Result<LimbStart, String> {
    let mut source = source::open(&request.inputs, request.raw, None).map_err(|e| e.to_string())?;
    let of_pictures = read_camera_facts(source.as_mut()).map_err(|e| e.to_string())?;
    // The user says that the lens is not known, so the focal length of the EXIF does not count.
    let (exif, altitude_km, body) = (Exif::default(), known.altitude_km, known.body);
    let mut facts = CameraFacts { exif, altitude_km, body, ..of_pictures };
    let inputs = open::Request {
        inputs: request.inputs.clone(),
        raw: request.raw,
        frames: request.frames.clone(),
        ..open::Request::default()
    };
    let width = facts.size_px[0];
    let found = match measure_field_of_view(&inputs, &facts).map_err(|e| e.to_string())? {
        LimbSays::FieldOfView(found) => found,
        LimbSays::LensDecides(found) => {
            let each: Vec<String> = found.iter().map(|one| one.describe(width)).collect();
            return Err(format!(
                "The limb does not tell the kind of lens. It says: {}. Choose “from the field of view”, with the kind \
                 that the lens probably is.",
                each.join(", but ")
            ));
        }
        LimbSays::Uncertain(found) => {
            return Err(format!(
                "What the limb says is too uncertain to start from: {}. Add more pictures, or choose “from the field \
                 of view”.",
                found.describe(width)
            ));
        }
        LimbSays::NoAltitude => {
            return Err("No picture has an altitude, and without one the limb says nothing about the lens. Choose \
                        “one for all pictures”, or add the column altitude_km to frames.csv."
                .into());
        }
        LimbSays::Nothing(pictures) => {
            return Err(format!(
                "The limb in {} does not say it: it is not in the picture, or too straight. Choose “from the field of \
                 view”.",
                counted(pictures as u64, "picture")
            ));
        }
    };
    (facts.lens, facts.measured) = (Some(found.lens), Some(found.measured));
    let [kept, seen] = found.pictures;
    let says = format!("The limb in {kept} of {seen} pictures says: {}.", found.describe(width));
    Ok(LimbStart { start: start::write_sensor_toml(&facts)?, says })
}
