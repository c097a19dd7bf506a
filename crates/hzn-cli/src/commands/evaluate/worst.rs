//! Selects and draws the worst pictures.

use std::collections::HashMap;
use std::path::Path;

use hzn_core::camera::Camera;
use hzn_evaluate::Case;
use hzn_files::truth::Truth;
use hzn_mcap::{Annotations, Contents, Reader};
use hzn_run::overlay::caption::{self, Caption};
use hzn_run::overlay::{self, limb};
use hzn_run::source::{Payload, ending};
use image::RgbImage;

use super::text::worst_line;
use crate::exit::{Stop, failed};

/// Width of the drawn pictures: large enough to show an error of a pixel, small enough for a file that is sent.
const WIDTH_PX: u32 = 960;

/// Returns the worst cases first: answers without a limb in view, then missed pictures, then answers by their error.
pub(super) fn select(cases: &[Case], count: usize) -> Vec<&Case> {
    let badness = |c: &&Case| match (&c.miss, c.limb) {
        (Some(_), false) => 2e3,
        (None, true) => 1e3,
        (Some(m), true) => m.angle_deg,
        (None, false) => -1.0,
    };
    let mut sorted: Vec<&Case> = cases.iter().filter(|c| badness(c) >= 0.0).collect();
    // The sort is stable: equally bad cases stay in the order of the sequence.
    sorted.sort_by(|a, b| badness(b).total_cmp(&badness(a)));
    sorted.truncate(count);
    sorted
}

/// One of the worst pictures, for the page.
pub(super) struct Drawn {
    /// The error of the picture in words.
    pub(super) caption: String,
    /// The drawing as JPEG, if the picture is available.
    pub(super) jpeg: Option<Vec<u8>>,
}

/// Draws pictures with the result and the true limb. Pictures come from the recording, otherwise from the truth's
/// folder.
pub(super) fn draw(
    worst: &[&Case],
    results: &Path,
    folder: &Path,
    truth: &[Truth],
    camera: Option<&Camera<f64>>,
) -> Result<Vec<Drawn>, Stop> {
    let mut recorded = Recorded::default();
    if ending(results) == "mcap" && !worst.is_empty() {
        recorded.read(results, worst)?;
    }
    let mut draw_case = |case: &&Case| -> Result<Drawn, Stop> {
        let drawing = recorded.drawings.remove(&(case.file.clone(), case.body.clone())).unwrap_or_default();
        let read_file = || {
            let path = folder.join(&case.file);
            let read = path.is_file().then(|| Payload::File(path).decode(None).ok()).flatten();
            read.map(|(picture, _)| picture.to_rgb())
        };
        let true_cone = truth.iter().find(|t| t.file == case.file && t.body == case.body);
        let true_limb = true_cone.filter(|_| case.limb).zip(camera).map_or_else(Vec::new, |(t, camera)| {
            limb::lines([t.axis_x, t.axis_y, t.axis_z], t.half_angle_deg.to_radians(), camera)
        });
        let jpeg = match recorded.pictures.get(&case.file).cloned().or_else(read_file) {
            Some(image) => {
                let text = format!("{}; {}: {}", case.file, case.body, case.status);
                let caption = Caption { text, legend: caption::legend(&drawing), ..Caption::default() };
                let caption = if true_limb.is_empty() { caption } else { caption.with_truth() };
                Some(encode(overlay::draw(image, &drawing, &true_limb, &caption))?)
            }
            None => None,
        };
        Ok(Drawn { caption: worst_line(case), jpeg })
    };
    worst.iter().map(&mut draw_case).collect()
}

/// What a recording has of the worst pictures.
#[derive(Default)]
struct Recorded {
    /// Pictures by file name.
    pictures: HashMap<String, RgbImage>,
    /// Drawings by file name and body.
    drawings: HashMap<(String, String), Annotations>,
}

impl Recorded {
    fn read(&mut self, recording: &Path, worst: &[&Case]) -> Result<(), Stop> {
        let base = |file: &str| file.rsplit(['/', '\\']).next().unwrap_or(file).to_owned();
        for frame in Reader::open(recording, Contents::All).map_err(failed)? {
            let frame = frame.map_err(failed)?;
            let file = base(&frame.row.file);
            // A picture of several bodies is recorded once, with one of them.
            if let Some(image) = frame.image.filter(|_| worst.iter().any(|c| c.file == file))
                && let Ok((picture, _)) = Payload::from_recorded(image).decode(None)
            {
                self.pictures.insert(file.clone(), picture.to_rgb());
            }
            if worst.iter().any(|c| c.file == file && c.body == frame.row.body) {
                self.drawings.insert((file, frame.row.body), frame.annotations);
            }
        }
        Ok(())
    }
}

fn encode(image: RgbImage) -> Result<Vec<u8>, Stop> {
    let image = if image.width() > WIDTH_PX {
        let height = (u64::from(image.height()) * u64::from(WIDTH_PX) / u64::from(image.width())).max(1) as u32;
        image::imageops::resize(&image, WIDTH_PX, height, image::imageops::FilterType::Triangle)
    } else {
        image
    };
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 88);
    image.write_with_encoder(encoder).map_err(failed)?;
    Ok(bytes)
}
