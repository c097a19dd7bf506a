//! Samples: rendered flights with their truth, for the first look at the window.

use std::fmt::Write as _;
use std::path::Path;

use hzn_sim::{Flight, Scenario};

use super::job::{Done, JobError, Progress};

/// The file that is written last.
const LAST: &str = "sensor.toml";

/// A flight whose pictures are rendered when it is opened first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sample {
    /// A rocket above clouds: the demo flight.
    Rocket,
    /// The whole Earth, half lit.
    FullDisc,
    /// An infrared sensor in low orbit.
    Infrared,
}

impl Sample {
    /// All samples.
    pub const ALL: [Self; 3] = [Self::Rocket, Self::FullDisc, Self::Infrared];

    /// Returns the name on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rocket => "Rocket (demo flight)",
            Self::FullDisc => "Whole Earth",
            Self::Infrared => "Infrared, low orbit",
        }
    }
    /// Returns the name of its folder.
    pub const fn folder(self) -> &'static str {
        match self {
            Self::Rocket => "demo-flight",
            Self::FullDisc => "sample-full-disc",
            Self::Infrared => "sample-leo-infrared",
        }
    }
    /// Returns one of its pictures, as a small PNG.
    pub const fn thumbnail(self) -> &'static [u8] {
        match self {
            Self::Rocket => include_bytes!("samples/rocket.png"),
            Self::FullDisc => include_bytes!("samples/full-disc.png"),
            Self::Infrared => include_bytes!("samples/leo-infrared.png"),
        }
    }
    /// Returns the scenes of its pictures.
    fn flight(self) -> Result<Flight, String> {
        let builtin = |name: &str, frames: u32| {
            let mut scenario = Scenario::builtin(name).ok_or_else(|| format!("there is no scene {name}"))?;
            scenario.capture.frames = frames;
            scenario.flight().map_err(|e| e.to_string())
        };
        match self {
            Self::Rocket => Ok(hzn_sim::flight::rocket(960, 540, 24, 1)),
            Self::FullDisc => builtin("full-disc", 12),
            Self::Infrared => builtin("leo-infrared", 24),
        }
    }
}

/// Returns true if the flight is in the folder.
pub fn is_complete(folder: &Path) -> bool {
    folder.join(LAST).exists()
}

/// Renders a sample into a folder: pictures, frames.csv, truth.csv and sensor.toml.
///
/// # Errors
/// The folder cannot be written, or the job was stopped.
pub fn render(sample: Sample, folder: &Path, progress: &Progress) -> Result<Done, JobError> {
    render_flight(sample.name(), &sample.flight()?, folder, progress)
}

fn render_flight(name: &str, flight: &Flight, folder: &Path, progress: &Progress) -> Result<Done, JobError> {
    let advice = |path: &Path, e: &std::io::Error| JobError::Failed(hzn_run::disk::advice(path, e));
    let write = |name: &str, bytes: &[u8]| {
        hzn_run::disk::write(&folder.join(name), bytes).map_err(|e| JobError::Failed(e.to_string()))
    };
    std::fs::create_dir_all(folder).map_err(|e| advice(folder, &e))?;
    let mut frames = String::from("file,time_s,x_km,y_km,z_km\n");
    let mut truth = csv::Writer::from_writer(Vec::new());
    for (index, frame) in flight.frames.iter().enumerate() {
        progress.report(index as u64, flight.frames.len() as u64)?;
        let path = folder.join(&frame.file);
        let picture = frame.render().map_err(|e| e.to_string())?;
        write(&frame.file, &picture.encode(&path).map_err(|e| e.to_string())?)?;
        let [x, y, z] = frame.prior().position_m.unwrap_or_default().map(|m| m / 1e3);
        let _ = writeln!(frames, "{},{},{x},{y},{z}", frame.file, frame.time_s);
        truth.serialize(frame.truth().map_err(|e| e.to_string())?).map_err(|e| format!("truth.csv: {e}"))?;
    }
    let truth = truth.into_inner().map_err(|e| format!("truth.csv: {e}"))?;
    write("frames.csv", frames.as_bytes())?;
    write("truth.csv", &truth)?;
    let config = hzn_files::sensor::to_text(&flight.sensor).map_err(|e| e.to_string())?;
    let text = format!("# The sensor of the rendered sample: {name}.\npreset = \"hzn\"\n\n{config}");
    write(LAST, text.as_bytes())?;
    Ok(Done::Rendered(folder.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flight_has_everything_that_the_window_reads() {
        let dir = tempfile::tempdir().unwrap();
        assert!(!is_complete(dir.path()));
        let flight = hzn_sim::flight::rocket(96, 54, 2, 1);
        render_flight("rocket", &flight, dir.path(), &Progress::default()).unwrap();
        assert!(is_complete(dir.path()));
        let truth = hzn_files::truth::load(&dir.path().join("truth.csv")).unwrap();
        let frames = hzn_files::frames::load(&dir.path().join("frames.csv")).unwrap();
        assert_eq!((truth.len(), frames.rows.len()), (2, 2));
        assert!(truth.iter().all(|t| t.axis().is_some()) && frames.rows.iter().all(|r| r.position_km.is_some()));
        let text = std::fs::read_to_string(dir.path().join("sensor.toml")).unwrap();
        assert!(hzn_files::sensor::parse(&text, &dir.path().join("sensor.toml")).is_ok());
    }

    /// After a change of a scene, `HZN_BLESS=1` writes the small pictures again.
    #[test]
    fn thumbnails_are_those_of_the_samples() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/work/samples");
        for (sample, name, frame) in
            [(Sample::Rocket, "rocket", 9), (Sample::FullDisc, "full-disc", 6), (Sample::Infrared, "leo-infrared", 7)]
        {
            let path = folder.join(format!("{name}.png"));
            let picture = sample.flight().unwrap().frames[frame].render().unwrap();
            let bytes = picture.encode(&path).unwrap();
            let small = crate::work::thumbnails::small(&image::load_from_memory(&bytes).unwrap().into_rgb8());
            if std::env::var_os("HZN_BLESS").is_some() {
                small.save(&path).unwrap();
            }
            let kept = image::open(&path).unwrap().into_rgb8();
            assert_eq!(kept.dimensions(), small.dimensions());
            let off: u64 = kept.iter().zip(small.iter()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
            assert!(off < 2 * kept.len() as u64, "{name}: another picture; HZN_BLESS=1 writes it again");
        }
    }

    #[test]
    fn every_sample_has_pictures_and_a_thumbnail_of_its_own() {
        for sample in Sample::ALL {
            let flight = sample.flight().unwrap();
            assert!(flight.frames.len() >= 12, "{}", sample.name());
            let picture = image::load_from_memory(sample.thumbnail()).unwrap().into_luma8();
            assert_eq!(picture.dimensions(), crate::work::thumbnails::SIZE);
            let span = picture.iter().max().unwrap() - picture.iter().min().unwrap();
            assert!(span > 100, "{} shows a limb: {span}", sample.name());
        }
        let folders: std::collections::HashSet<_> = Sample::ALL.iter().map(|sample| sample.folder()).collect();
        assert_eq!(folders.len(), Sample::ALL.len());
    }
}
