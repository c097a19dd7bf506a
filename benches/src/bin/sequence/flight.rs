//! The sequences: one rendered rocket flight for each size, stored in three kinds of files.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use hzn_run::source::Raw;

/// Kinds of files: name in the table, ending of the files.
const KINDS: [(&str, &str); 3] = [("PNG", "png"), ("JPEG", "jpg"), ("headerless, 8 bits", "raw")];

/// Quality of the JPEG files, from 1 to 100.
const JPEG_QUALITY: u8 = 90;

/// A folder with pictures of one kind and size, with sensor.toml and frames.csv.
pub(crate) struct Sequence {
    pub(crate) kind: &'static str,
    pub(crate) folder: PathBuf,
    pub(crate) megabytes: f64,
    /// Form of the pictures, if they have no header.
    pub(crate) raw: Option<Raw>,
}

/// Renders `frames` pictures of `size` if they do not exist in `parent`, and stores them in every kind of file.
pub(crate) fn render(parent: &Path, size: (u16, u16), frames: usize) -> Result<Vec<Sequence>, String> {
    let (width, height) = size;
    let flight = hzn_sim::flight::rocket(width, height, frames, 5);
    let sensor = toml::to_string(&flight.sensor).map_err(|e| e.to_string())?;
    let mut sequences = Vec::new();
    for (kind, ending) in KINDS {
        let folder = parent.join(format!("run-{width}x{height}-{frames}-{ending}"));
        fs::create_dir_all(&folder).map_err(|e| explain(&folder, &e))?;
        let raw = (ending == "raw").then(|| format!("{width}x{height}:mono8").parse()).transpose()?;
        sequences.push(Sequence { kind, folder, megabytes: 0.0, raw });
    }
    let name = |file: &str, ending: &str| format!("{}.{ending}", file.trim_end_matches(".png"));
    let mut known: Vec<String> = vec!["file,time_s,x_km,y_km,z_km\n".into(); KINDS.len()];
    for frame in &flight.frames {
        let paths: Vec<PathBuf> =
            sequences.iter().zip(KINDS).map(|(s, (_, ending))| s.folder.join(name(&frame.file, ending))).collect();
        if !paths.iter().all(|path| path.exists()) {
            let picture = frame.render().map_err(|e| e.to_string())?;
            for path in &paths {
                write(path, &picture)?;
            }
        }
        let [x, y, z] = frame.prior().position_m.unwrap_or_default().map(|m| m / 1e3);
        for (i, path) in paths.iter().enumerate() {
            sequences[i].megabytes += fs::metadata(path).map_err(|e| explain(path, &e))?.len() as f64 / 1e6;
            let _ = writeln!(known[i], "{},{},{x},{y},{z}", name(&frame.file, KINDS[i].1), frame.time_s);
        }
    }
    for (sequence, rows) in sequences.iter().zip(known) {
        for (file, text) in [("frames.csv", rows.as_str()), ("sensor.toml", sensor.as_str())] {
            let path = sequence.folder.join(file);
            fs::write(&path, text).map_err(|e| explain(&path, &e))?;
        }
    }
    Ok(sequences)
}

/// Writes a rendered picture as the kind of file that the path's ending names.
fn write(path: &Path, picture: &hzn_sim::Picture) -> Result<(), String> {
    let hzn_sim::Samples::Bytes(bytes) = picture.samples() else {
        return Err(format!("{}: the flight's camera has more than 8 bits", path.display()));
    };
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("raw") => fs::write(path, bytes).map_err(|e| explain(path, &e)),
        Some("jpg") => {
            let file = picture.encode_jpeg(JPEG_QUALITY).map_err(|e| explain(path, &e))?;
            fs::write(path, file).map_err(|e| explain(path, &e))
        }
        _ => picture.save(path).map_err(|e| explain(path, &e)),
    }
}

fn explain(path: &Path, error: &impl std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}
