//! Pictures with everything drawn over them that led to the answer.
//!
//! The colours are those of a recording's annotations. What is said about a picture stands below it, so that nothing
//! hides the limb.

pub mod canvas;
#[cfg(feature = "recordings")]
pub mod caption;
mod colours;
#[cfg(feature = "recordings")]
pub mod letters;
pub mod limb;
#[cfg(feature = "recordings")]
pub mod runs;
pub mod undistorted;

use std::path::{Path, PathBuf};

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;
use image::RgbImage;

use canvas::Canvas;
pub use colours::edge_colour;
use hzn_mcap::Annotations;
use hzn_mcap::palette::{AXIS, INLIER, LIMB, REJECTED};
#[cfg(feature = "recordings")]
use {caption::Caption, letters::Letters};

use crate::error::{Error, failed};
use crate::terminal::is_obeyed;

/// The folder into which a run draws every picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OverlayFolder {
    /// The folder; it must exist.
    pub path: PathBuf,
    /// Last line of the captions, see [`crate::provenance::line`].
    pub provenance: String,
}

/// Returns the file name of the overlay of a picture: its name, with `.png` added unless it ends in it. Two pictures
/// never get the same name, so what separates folders, and `%` itself, is written as `%` and two hexadecimal digits.
pub fn file_name(name: &str) -> String {
    let flat = flat_name(name);
    match flat.rsplit_once('.') {
        // A second ending, as in `a.jpg.png`, would be that of the overlay of `a.jpg`.
        Some((stem, ending)) if ending.eq_ignore_ascii_case("png") && !stem.contains('.') => flat,
        Some(_) => format!("{flat}.png"),
        // The overlay of `a` must not be that of `a.png`.
        None => format!("{flat}%.png"),
    }
}

/// Longest name that is used as a file name, in bytes. File systems allow 255, of which an ending takes some.
const MAX_NAME_BYTES: usize = 200;

/// Returns the name of a picture as a file name: without separators of folders and without characters that a terminal
/// obeys or a file system refuses. A long name is cut and gets a checksum. Different names stay different.
pub fn flat_name(name: &str) -> String {
    let mut flat = String::with_capacity(name.len());
    for c in name.chars() {
        if matches!(c, '%' | '/' | '\\' | ':') || is_obeyed(c) {
            flat.extend(c.encode_utf8(&mut [0; 4]).bytes().map(|byte| format!("%{byte:02X}")));
        } else {
            flat.push(c);
        }
    }
    if flat.len() > MAX_NAME_BYTES {
        let ending = flat.rsplit_once('.').map(|(_, ending)| format!(".{ending}")).filter(|e| e.len() <= 6);
        // `%~` occurs in no other name. A cut within `%2F` is no fault, because nothing reads the name back.
        let end = format!("%~{:016x}{}", fnv_1a(name.as_bytes()), ending.unwrap_or_default());
        let fits = |at: &usize| at + end.len() <= MAX_NAME_BYTES;
        flat.truncate(flat.char_indices().map(|(at, _)| at).take_while(fits).last().unwrap_or_default());
        flat.push_str(&end);
    }
    flat
}

/// Returns a checksum of 64 bits. Two of a million names have the same less than once in 10⁷ runs. Source: Fowler, Noll
/// and Vo, FNV-1a.
fn fnv_1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Draws annotations (pixel centres at integers) and the true limb, with a caption below the picture.
#[cfg(feature = "recordings")]
pub fn draw(image: RgbImage, drawing: &Annotations, true_limb: &[Vec<[f64; 2]>], caption: &Caption) -> RgbImage {
    caption::add(&Letters::default(), &draw_plain(image, drawing, true_limb), caption)
}

/// Draws annotations and the true limb without a caption.
pub fn draw_plain(image: RgbImage, drawing: &Annotations, true_limb: &[Vec<[f64; 2]>]) -> RgbImage {
    let mut canvas = Canvas { image };
    let (w, h) = (canvas.image.width(), canvas.image.height());
    // The pen is wide enough to be visible when the whole picture is shown on a screen of about 1600 px.
    let pen = (f64::from(w.max(h)) / 800.0).max(1.0);
    for (candidate, edge) in drawing.edges.iter().enumerate() {
        for p in edge {
            canvas.disc(*p, pen * 0.8, edge_colour(candidate));
        }
    }
    for limb in &drawing.limb {
        // In a small picture, points that lie densely would cover a thinner line.
        canvas.polyline(limb, (pen * 3.4).max(5.0), LIMB);
    }
    for limb in true_limb {
        canvas.polyline(limb, pen * 1.2, colours::TRUTH);
    }
    // Points are drawn over the line and are narrower, so that both remain visible.
    for p in &drawing.rejected {
        canvas.disc(*p, pen * 1.6, REJECTED);
    }
    for p in &drawing.inliers {
        canvas.disc(*p, pen, INLIER);
    }
    for &[u, v] in &drawing.axes {
        let arm = pen * 14.0;
        for (dx, dy) in [(arm, 0.0), (0.0, arm)] {
            canvas.line([u - dx, v - dy], [u + dx, v + dy], pen * 5.0, [0, 0, 0]);
            canvas.line([u - dx, v - dy], [u + dx, v + dy], pen * 2.5, AXIS);
        }
    }
    canvas.image
}

/// Returns the drawing for a fitted cone: its limb as lines, broken where it leaves the picture, and its axis.
/// Coordinates are in pixels.
pub fn draw_cone(axis: &UnitVec3<Cam, f64>, half_angle_rad: f64, camera: &Camera<f64>) -> Annotations {
    draw_axis_and(axis, limb::lines(axis.xyz(), half_angle_rad, camera), camera)
}

/// Returns the drawing for an answer, as [`draw_cone`]. If the answer has a position, the limb is that of the
/// ellipsoid.
pub fn draw_limb(solution: &Solution<f64>, camera: &Camera<f64>) -> Annotations {
    match &solution.position {
        None => draw_cone(&solution.axis, solution.fused_half_angle_rad, camera),
        Some(position) => {
            let lines = limb::lines_along(|angle_rad| Some(position.limb_direction(angle_rad)), camera);
            draw_axis_and(&solution.axis, lines, camera)
        }
    }
}

fn draw_axis_and(axis: &UnitVec3<Cam, f64>, limb: Vec<Vec<[f64; 2]>>, camera: &Camera<f64>) -> Annotations {
    let inside = |p: &ImagePoint<f64>| {
        (-0.5..=f64::from(camera.width()) - 0.5).contains(&p.u)
            && (-0.5..=f64::from(camera.height()) - 0.5).contains(&p.v)
    };
    Annotations {
        limb,
        axes: camera.project(axis).filter(inside).map(|p| [p.u, p.v]).into_iter().collect(),
        ..Annotations::default()
    }
}

/// Writes a PNG.
///
/// # Errors
/// The file cannot be written.
pub fn save(image: &RgbImage, path: &Path) -> Result<(), Error> {
    // The picture is encoded in memory first, because the encoder has its own words for a full disk.
    let bytes = png(image).map_err(|e| failed(format!("{}: {e}", path.display())))?;
    crate::disk::write(path, bytes)
}

/// Encodes a picture as PNG.
///
/// # Errors
/// The picture has no pixels.
pub fn png(image: &RgbImage) -> Result<Vec<u8>, Error> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut bytes = Vec::new();
    image
        .write_with_encoder(PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Sub))
        .map_err(Error::failed)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn different_pictures_have_different_overlays() {
        assert_eq!(file_name("0001.png"), "0001.png");
        assert_eq!(file_name("0001.jpg"), "0001.jpg.png");
        assert_eq!(file_name("a/x.png"), "a%2Fx.png");
        assert_eq!(flat_name("日没\0\x1b[2J\u{202e}.png"), "日没%00%1B[2J%E2%80%AE.png");
        let long = file_name(&("日".repeat(300) + "\0.jpg"));
        assert!(long.len() <= MAX_NAME_BYTES + 4 && long.ends_with(".jpg.png"), "{long}");
        let long = ["a", "b"].map(|c| c.repeat(300));
        let parts = ["a", "a_", "a/", "a\\", "a:", "a%2F", "a%", "", "a\0", "a%00", "a\x1b", &long[0], &long[1]];
        let ends = ["x.png", "x.PNG", "x.jpg", "x.jpg.png", "x", "x%.png", "x..png", ".png", "_x.png"];
        let names: Vec<String> = parts.iter().flat_map(|p| ends.iter().map(move |e| format!("{p}{e}"))).collect();
        let mut given: Vec<String> = names.clone();
        given.sort();
        given.dedup();
        let mut drawn: Vec<String> = given.iter().map(|name| file_name(name)).collect();
        drawn.sort();
        drawn.dedup();
        assert_eq!(drawn.len(), given.len());
    }
}
