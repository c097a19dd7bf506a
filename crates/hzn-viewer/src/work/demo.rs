//! The demo flight: rendered pictures of a rocket flight with their truth, for the first look at the window.

use std::fmt::Write as _;
use std::path::Path;

use super::job::{Done, JobError, Progress};

/// Number of pictures.
const FRAMES: usize = 24;
/// Size of the pictures in pixels.
const SIZE: (u16, u16) = (960, 540);
/// The file that is written last.
const LAST: &str = "sensor.toml";

/// Returns true if the flight is in the folder.
pub fn is_complete(folder: &Path) -> bool {
    folder.join(LAST).exists()
}

/// Renders the flight into a folder: pictures, frames.csv, truth.csv and sensor.toml.
///
/// # Errors
/// The folder cannot be written, or the job was stopped.
pub fn render(folder: &Path, progress: &Progress) -> Result<Done, JobError> {
    render_frames(folder, SIZE, FRAMES, progress)
}

fn render_frames(
    folder: &Path,
    (width, height): (u16, u16),
    count: usize,
    progress: &Progress,
) -> Result<Done, JobError> {
    let advice = |path: &Path, e: &std::io::Error| JobError::Failed(hzn_run::disk::advice(path, e));
    let write = |name: &str, bytes: &[u8]| {
        hzn_run::disk::write(&folder.join(name), bytes).map_err(|e| JobError::Failed(e.to_string()))
    };
    std::fs::create_dir_all(folder).map_err(|e| advice(folder, &e))?;
    let flight = hzn_sim::flight::rocket(width, height, count, 1);
    let mut frames = String::from("file,time_s,x_km,y_km,z_km\n");
    let mut truth = csv::Writer::from_writer(Vec::new());
    for (index, frame) in flight.frames.iter().enumerate() {
        progress.report(index as u64, count as u64)?;
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
    let text = format!("# The camera of a rendered rocket flight.\npreset = \"hzn\"\n\n{config}");
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
        render_frames(dir.path(), (96, 54), 2, &Progress::default()).unwrap();
        assert!(is_complete(dir.path()));
        let truth = hzn_files::truth::load(&dir.path().join("truth.csv")).unwrap();
        let frames = hzn_files::frames::load(&dir.path().join("frames.csv")).unwrap();
        assert_eq!((truth.len(), frames.rows.len()), (2, 2));
        assert!(truth.iter().all(|t| t.axis().is_some()) && frames.rows.iter().all(|r| r.position_km.is_some()));
        let text = std::fs::read_to_string(dir.path().join("sensor.toml")).unwrap();
        assert!(hzn_files::sensor::parse(&text, &dir.path().join("sensor.toml")).is_ok());
    }
}
