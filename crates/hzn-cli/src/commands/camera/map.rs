//! A map of the picture: degrees a pixel in colours, and lines of equal angle off axis.

use hzn_core::camera::{Camera, Config, Equation};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_run::overlay::canvas::{Canvas, Colour};
use hzn_run::overlay::letters::Letters;
use image::{Rgb, RgbImage};

use super::field::{end_rad, field_of_view};
use super::monotone;
use crate::exit::{Stop, usage};

/// Longer side of the drawn picture in pixels.
const SIDE_PX: f64 = 1000.0;
/// Space above the picture, for the bar of colours at its right, and for a line of the legend below it, in pixels.
const TOP_PX: u32 = 56;
const RIGHT_PX: u32 = 170;
const LINE_PX: u32 = 24;
/// Largest number of lines of the legend.
const LEGEND: u32 = 5;
/// Size of the letters in pixels.
const LETTER_PX: f32 = 17.0;
/// Size of the letters of the last line in pixels.
const SMALL_PX: f32 = 14.0;

const WHITE: Colour = [255, 255, 255];
const BLACK: Colour = [0, 0, 0];
const FAINT: Colour = [160, 166, 176];
const CIRCLE: Colour = [213, 94, 0];
const LIMIT: Colour = [255, 0, 200];
const OUTSIDE: Colour = [70, 70, 70];
/// Colours from small to large values, evenly spaced: dark blue to yellow, whose brightness increases.
const SCALE: [Colour; 5] = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/// The map with its scale from the camera's pixels to those of the map.
struct Map<'a> {
    config: &'a Config,
    canvas: Canvas,
    letters: Letters,
    scale: f64,
    width: u32,
    height: u32,
}

/// Draws the map of a calibration. `provenance` is the last line.
pub(super) fn draw(config: &Config, title: &str, provenance: &str) -> Result<RgbImage, Stop> {
    let camera = Camera::<f64>::try_new(config).map_err(usage)?;
    let scale = SIDE_PX / f64::from(config.width.max(config.height));
    let side = |pixels: u16| ((f64::from(pixels) * scale).round() as u32).max(1);
    let (width, height) = (side(config.width), side(config.height));
    let below = (LEGEND + 1) * LINE_PX + 12;
    let image = RgbImage::from_pixel(width + RIGHT_PX, height + TOP_PX + below, Rgb([20, 20, 20]));
    let mut map = Map { config, canvas: Canvas { image }, letters: Letters::default(), scale, width, height };
    map.fill(&camera);
    map.contours(&camera);
    let limit_deg = monotone::limit_deg(config);
    let mut legend = vec![format!("field of view {}", field_of_view(config, &camera)), "+ principal point".into()];
    if let Some(deg) = config.theta_max_deg {
        map.ring(deg, CIRCLE, 4.0);
        legend.push(format!("orange: image circle {deg:.1} deg"));
    }
    if let Some(deg) = config.theta_min_deg {
        map.ring(deg, CIRCLE, 4.0);
        legend.push(format!("orange: blind centre {deg:.1} deg"));
    }
    legend.push(match limit_deg {
        Some(deg) if map.ring(deg, LIMIT, 3.0) => format!("pink: monotone up to {deg:.1} deg"),
        Some(deg) => format!("monotone up to {deg:.1} deg, outside the picture"),
        None => "monotone everywhere".to_owned(),
    });
    let centre = map.place(camera.principal_point());
    for (dx, dy) in [(10.0, 0.0), (0.0, 10.0)] {
        map.canvas.line([centre[0] - dx, centre[1] - dy], [centre[0] + dx, centre[1] + dy], 2.0, WHITE);
    }
    map.text_centred(title, 14);
    for (i, line) in legend.iter().enumerate() {
        let y = TOP_PX + height + 12 + LINE_PX * i as u32;
        map.text(8, y, &map.shorten(line, width + RIGHT_PX));
    }
    let room = (width + RIGHT_PX).saturating_sub(16) as f32;
    let last = map.letters.wrap(provenance, SMALL_PX, room, 1).concat();
    let y = (TOP_PX + height + 12 + LINE_PX * LEGEND) as f32;
    map.letters.write(&mut map.canvas.image, [8.0, y], &last, SMALL_PX, FAINT);
    Ok(map.canvas.image)
}

impl Map<'_> {
    /// Shortens a text to a width in pixels.
    fn shorten(&self, text: &str, width: u32) -> String {
        self.letters.wrap(text, LETTER_PX, width.saturating_sub(16) as f32, 1).concat()
    }

    /// Writes a text with its top left corner at a place.
    fn text(&mut self, x: u32, y: u32, text: &str) {
        self.letters.write(&mut self.canvas.image, [x as f32, y as f32], text, LETTER_PX, WHITE);
    }

    /// Returns the place of an image point on the map.
    fn place(&self, p: ImagePoint<f64>) -> [f64; 2] {
        [(p.u + 0.5) * self.scale - 0.5, (p.v + 0.5) * self.scale - 0.5 + f64::from(TOP_PX)]
    }

    /// Fills the picture with the colours of degrees a pixel, and draws the bar of colours.
    fn fill(&mut self, camera: &Camera<f64>) {
        let point = |x: u32, y: u32| ImagePoint {
            u: (f64::from(x) + 0.5) / self.scale - 0.5,
            v: (f64::from(y) + 0.5) / self.scale - 0.5,
        };
        let values: Vec<Option<f64>> = (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| degrees_a_pixel(camera, point(x, y)))
            .collect();
        let (mut min, mut max) = (f64::INFINITY, 0.0f64);
        for value in values.iter().flatten() {
            (min, max) = (min.min(*value), max.max(*value));
        }
        let span = (max - min).max(1e-12);
        for (i, value) in values.iter().enumerate() {
            let (x, y) = (i as u32 % self.width, i as u32 / self.width);
            let colour = value.map_or(OUTSIDE, |value| colour((value - min) / span));
            self.canvas.image.put_pixel(x, y + TOP_PX, Rgb(colour));
        }
        self.bar(min, max);
    }

    fn bar(&mut self, min: f64, max: f64) {
        let (left, rows) = (self.width + 16, self.height.min(500));
        for y in 0..rows {
            let part = 1.0 - f64::from(y) / f64::from(rows.max(2) - 1);
            for x in left..left + 24 {
                self.canvas.image.put_pixel(x, TOP_PX + y, Rgb(colour(part)));
            }
        }
        for i in 0..=4u32 {
            let part = f64::from(i) / 4.0;
            let y = TOP_PX + ((1.0 - part) * f64::from(rows.saturating_sub(16))) as u32;
            self.text(left + 32, y, &format!("{:.4}", min + part * (max - min)));
        }
        self.text(left, TOP_PX - 24, "deg a px");
    }

    /// Draws lines of equal angle off axis, with labels.
    fn contours(&mut self, camera: &Camera<f64>) {
        let far = end_rad(self.config, camera).to_degrees();
        let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0];
        let step = steps.into_iter().find(|step| far / step <= 8.0).unwrap_or(30.0);
        let count = (far / step - 1e-9).ceil().max(1.0) as u32;
        for i in 1..count.max(2) {
            let deg = step * f64::from(i);
            let ring: Vec<[f64; 2]> = (0..=360)
                .filter_map(|azimuth| {
                    let (sin_a, cos_a) = f64::from(azimuth).to_radians().sin_cos();
                    let (sin, cos) = deg.to_radians().sin_cos();
                    let ray = UnitVec3::try_new([sin * cos_a, sin * sin_a, cos])?;
                    Some(self.place(camera.project(&ray)?))
                })
                .collect();
            self.lines(&ring, WHITE, 1.2);
            self.label(&ring, &format!("{} deg", (deg * 10.0).round() / 10.0));
        }
    }

    /// Writes a label where a ring has most space in the picture.
    fn label(&mut self, ring: &[[f64; 2]], text: &str) {
        let [width, height] = self.letters.measure(text, LETTER_PX).map(f64::from);
        let (letter, half) = (height, 0.5 * width);
        let (right, bottom) = (f64::from(self.width), f64::from(TOP_PX + self.height));
        let room =
            |p: &&[f64; 2]| (p[0] - half).min(right - p[0] - half).min(p[1] - f64::from(TOP_PX)).min(bottom - p[1]);
        // Below the axis first, as the labels then stand in one column.
        let below = ring.get(90).filter(|p| room(p) > letter);
        let Some(p) = below.or_else(|| ring.iter().max_by(|a, b| room(a).total_cmp(&room(b)))) else { return };
        if room(&p) < letter {
            return;
        }
        let (x, y) = ((p[0] - half) as u32, (p[1] - 0.5 * letter) as u32);
        self.canvas.shade(x.saturating_sub(3), y.saturating_sub(1), width as u32 + 6, letter as u32 + 2);
        self.text(x, y, text);
    }

    /// Draws a ring at an angle off axis from the equation of the lens. Returns whether it is in the picture.
    fn ring(&mut self, deg: f64, colour: Colour, pen_px: f64) -> bool {
        let equation = Equation::new(self.config);
        let (sin, cos) = deg.to_radians().sin_cos();
        let at = |azimuth: i32| {
            let (sin_a, cos_a) = f64::from(azimuth).to_radians().sin_cos();
            equation.project([sin * cos_a, sin * sin_a, cos]).map(|p| self.place(p.point))
        };
        let ring: Vec<[f64; 2]> = (0..=360).filter_map(at).collect();
        self.lines(&ring, BLACK, pen_px + 2.0) && self.lines(&ring, colour, pen_px)
    }

    /// Draws the lines inside the picture. Returns whether any is.
    fn lines(&mut self, points: &[[f64; 2]], colour: Colour, pen_px: f64) -> bool {
        let inside = |p: &[f64; 2]| {
            (0.0..f64::from(self.width)).contains(&p[0])
                && (f64::from(TOP_PX)..f64::from(TOP_PX + self.height)).contains(&p[1])
        };
        let pairs: Vec<[[f64; 2]; 2]> =
            points.windows(2).map(|w| [w[0], w[1]]).filter(|[a, b]| inside(a) && inside(b)).collect();
        for [a, b] in &pairs {
            self.canvas.line(*a, *b, pen_px, colour);
        }
        !pairs.is_empty()
    }

    fn text_centred(&mut self, text: &str, y: u32) {
        let text = self.shorten(text, self.width);
        let width = self.letters.measure(&text, LETTER_PX)[0] as u32;
        self.text(self.width.saturating_sub(width) / 2, y, &text);
    }
}

/// Returns the degrees that a pixel covers along a side of equal area; `None` where the camera has no ray.
fn degrees_a_pixel(camera: &Camera<f64>, point: ImagePoint<f64>) -> Option<f64> {
    let j = camera.ray(point)?.jacobian();
    let [a, b] = [0, 1].map(|k| [j[0][k], j[1][k], j[2][k]]);
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    Some(cross.iter().map(|x| x * x).sum::<f64>().sqrt().sqrt().to_degrees())
}

/// Returns the colour of a value from 0 to 1.
fn colour(part: f64) -> Colour {
    let place = part.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let first = (place as usize).min(SCALE.len() - 2);
    let rest = place - first as f64;
    core::array::from_fn(|i| {
        let [low, high] = [SCALE[first][i], SCALE[first + 1][i]].map(f64::from);
        (low + rest * (high - low)).round() as u8
    })
}
