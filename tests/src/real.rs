//! Loads photographs with their sensor.toml, and draws the fitted limb over them.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use hzn_core::Config;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::image::{Channel, ImageView, Layout};
use hzn_core::observer::{Border, Observer};
use hzn_core::pixel::ImagePoint;
use hzn_core::real::Real;
use image::RgbImage;
use nalgebra::Vector3;

use crate::Answer;

/// Photograph, with the sensor that is assumed to have taken it.
#[derive(Debug, Clone)]
pub struct Photograph {
    /// Name of the file, with `-` instead of `/` and `.`.
    pub name: String,
    /// Configuration from the `.toml` of the picture.
    pub sensor: Config,
    /// The picture.
    pub rgb: RgbImage,
}

/// Reads a picture file. The decoders of memory are compiled in `image`, those of `image::open` would be compiled in
/// each crate that calls it.
///
/// # Panics
/// Panics if the file cannot be read.
pub fn read_picture(path: &Path) -> image::DynamicImage {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    image::load_from_memory(&bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

impl Photograph {
    /// Loads the picture `file` of the folder `tests/data/real`, and the `.toml` of the same name next to it.
    ///
    /// # Panics
    /// Panics if one of them cannot be read.
    pub fn load(file: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/real").join(file);
        let sensor = hzn_files::sensor::load(&path.with_extension("toml")).unwrap_or_else(|e| panic!("{e}"));
        let rgb = read_picture(&path).into_rgb8();
        Self { name: file.replace('/', "-").replace(['.'], "-"), sensor: sensor.config, rgb }
    }

    /// Returns the picture as hzn-core reads it.
    ///
    /// # Panics
    /// Never panics: a decoded picture has as many bytes as its size needs.
    pub fn view(&self) -> ImageView<'_> {
        let layout = Layout::packed(self.rgb.width(), self.rgb.height(), 3, 8);
        ImageView::from_bytes(self.rgb.as_raw(), layout, Channel::Mean).expect("a decoded picture is whole")
    }

    /// Returns the mean of the colours at a pixel, 0 to 255.
    pub fn brightness(&self, x: u32, y: u32) -> f64 {
        self.rgb.get_pixel(x, y).0.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0
    }

    /// Writes the picture to `target/overlays` with the fitted limb (red) and the edge points (inliers green, outliers
    /// yellow) drawn over it, for visual inspection.
    ///
    /// # Panics
    /// Panics if the folder cannot be written.
    pub fn write_overlay(&self, answer: Option<&Answer>, points: &Points) {
        let dir = overlay_folder();
        std::fs::create_dir_all(&dir).expect("the target folder is writable");
        let mut out = self.rgb.clone();
        let size = i64::from(self.rgb.width() / 1600);
        let mut dot = |p: [f64; 2], r: i64, colour: [u8; 3]| {
            for (dx, dy) in (-r..=r).flat_map(|dx| (-r..=r).map(move |dy| (dx, dy))) {
                let (x, y) = (p[0].round() as i64 + dx, p[1].round() as i64 + dy);
                if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
                    && let Some(pixel) = out.get_pixel_mut_checked(x, y)
                {
                    pixel.0 = colour;
                }
            }
        };
        if let Some(a) = answer {
            for &(p, weight) in &points.chosen {
                dot(p, 1 + size, if weight > 0.0 { [0, 255, 0] } else { [255, 255, 0] });
            }
            for p in limb_points(&self.sensor, a) {
                dot(p, size / 2, [255, 0, 0]);
            }
        }
        out.save(dir.join(format!("{}.png", self.name))).expect("the target folder is writable");
    }
}

/// Returns how far above (negative) or below the fitted limb the picture is steepest, in pixels. Each value is the
/// median over an eighth of the width; it is NaN where there is no limb. The search goes `reach` pixels up and down,
/// and does not depend on thresholds, candidates or inliers.
pub fn steepest_offset_px(photograph: &Photograph, answer: &Answer, reach: u32) -> [f64; 8] {
    let mut found: [Vec<f64>; 8] = Default::default();
    let (w, h) = photograph.rgb.dimensions();
    for [x, y] in limb_points(&photograph.sensor, answer) {
        let (column, row) = (x as u32, y.round() as u32);
        if row < reach + 6 || row + reach + 6 >= h || column < 3 || column + 4 > w {
            continue;
        }
        // The mean of five columns and of five rows on each side suppresses noise and grain.
        let mean = |y: u32| (column - 2..=column + 2).map(|x| photograph.brightness(x, y)).sum::<f64>();
        let step = |y: u32| (1..=5).map(|d| mean(y + d) - mean(y - d)).sum::<f64>();
        let best = (row - reach..=row + reach).max_by(|&a, &b| step(a).total_cmp(&step(b))).unwrap_or(row);
        found[(column * 8 / w) as usize].push(f64::from(best) - y);
    }
    found.map(|mut eighth| {
        eighth.sort_by(f64::total_cmp);
        eighth.get(eighth.len() / 2).copied().unwrap_or(f64::NAN)
    })
}

/// Returns the folder that overlays are written to.
pub fn overlay_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/overlays")
}

/// Returns points (x, y) of the fitted limb in the picture in pixels, less than a pixel apart.
///
/// # Panics
/// Panics if the lens is refused.
pub fn limb_points(sensor: &Config, answer: &Answer) -> Vec<[f64; 2]> {
    let camera = Camera::<f64>::try_new(&sensor.camera).expect("the lens is valid");
    let e = Vector3::from(answer.axis);
    let b1 = e.cross(&e.map(|v| if v.abs() < 0.6 { 1.0 } else { 0.0 })).normalize();
    let b2 = e.cross(&b1);
    let (sin, cos) = answer.half_angle_rad.sin_cos();
    let steps = (8.0 * camera.focal_px().0 * sin) as usize;
    (0..steps)
        .filter_map(|i| {
            let (s, c) = (std::f64::consts::TAU * i as f64 / steps as f64).sin_cos();
            let ray = e * cos + (b1 * c + b2 * s) * sin;
            let p = camera.project(&UnitVec3::try_new(ray.into())?)?;
            let inside =
                p.u >= 0.0 && p.v >= 0.0 && p.u < f64::from(camera.width()) && p.v < f64::from(camera.height());
            inside.then_some([p.u, p.v])
        })
        .collect()
}

/// Edge points of the last candidate that passed every gate, with their weights.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// Position (x, y) in pixels and weight of each point; inliers have a weight above 0.
    pub chosen: Vec<([f64; 2], f64)>,
}

impl Points {
    /// Returns the share of the picture's width that has inliers, in strips of 16 pixels.
    pub fn width_with_inliers(&self, width: u32) -> f64 {
        let mut has_inliers = vec![false; (width as usize).div_ceil(16)];
        for &([x, _], weight) in &self.chosen {
            if let Some(strip) = has_inliers.get_mut((x.max(0.0) / 16.0) as usize) {
                *strip |= weight > 0.0;
            }
        }
        has_inliers.iter().filter(|&&h| h).count() as f64 / has_inliers.len() as f64
    }
}

/// Observer that collects the points of candidates.
#[derive(Debug, Default)]
pub struct PointRecorder {
    all: RefCell<Vec<([f64; 2], f64)>>,
    best: RefCell<Points>,
}

impl PointRecorder {
    /// Returns the collected points.
    pub fn points(self) -> Points {
        self.best.into_inner()
    }
}

impl<T: Real> Observer<T> for PointRecorder {
    fn edge(&self, _: u32, _: Border<'_>) {
        self.all.borrow_mut().clear();
    }
    fn point(&self, _: u32, p: ImagePoint<T>) {
        self.all.borrow_mut().push(([p.u.to_f64(), p.v.to_f64()], 0.0));
    }
    fn weight(&self, _: u32, point: u32, weight: T) {
        if let Some(p) = self.all.borrow_mut().get_mut(point as usize) {
            p.1 = weight.to_f64();
        }
    }
    fn verdict(&self, _: u32, _: &hzn_core::report::Candidate<T>, solution: Option<&hzn_core::report::Solution<T>>) {
        if solution.is_some() {
            self.best.borrow_mut().chosen.clone_from(&self.all.borrow());
        }
    }
}
