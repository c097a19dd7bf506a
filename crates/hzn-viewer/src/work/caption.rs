//! The caption below an exported picture: file, time, status and reason, the legend and a scale. The letters are those
//! of the window, in the resolution of the picture.

use egui::epaint::text::{FontDefinitions, Fonts, TextOptions};
use egui::{Color32, FontId};
use image::{Rgb, RgbImage};

/// Number of lines below the picture.
const LINES: u32 = 3;
const GROUND: Rgb<u8> = Rgb([16, 18, 22]);
const INK: Color32 = Color32::from_rgb(236, 238, 242);

/// An entry of the legend: its name and its colour.
pub type Entry = (String, [u8; 3]);

/// A caption.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Caption {
    /// Sentence about the picture; it takes up to two lines.
    pub text: String,
    /// Entries of the legend.
    pub legend: Vec<Entry>,
    /// Length of a bar in pixels, and what it stands for.
    pub scale: Option<(f64, String)>,
}

/// Returns the height of a line in pixels for a picture of this size.
fn line_px(width: u32, height: u32) -> u32 {
    (width.max(height) / 48).clamp(15, 96)
}

/// Returns the height that a caption adds to a picture, in pixels.
pub fn height_px(width: u32, height: u32) -> u32 {
    LINES * line_px(width, height) + line_px(width, height) / 2
}

/// Draws text into pictures.
pub struct Writer {
    fonts: Fonts,
}

impl Default for Writer {
    fn default() -> Self {
        Self { fonts: Fonts::new(TextOptions::default(), FontDefinitions::default()) }
    }
}

impl Writer {
    /// Returns the picture with the caption below it.
    pub fn add(&mut self, picture: &RgbImage, caption: &Caption) -> RgbImage {
        let (w, h) = picture.dimensions();
        let line = line_px(w, h);
        let mut out = RgbImage::from_pixel(w, h + height_px(w, h), GROUND);
        image::imageops::replace(&mut out, picture, 0, 0);
        let left = line / 3;
        let room = (w.saturating_sub(2 * left)) as f32;
        let place = |x: u32, y: u32| [x as f32, y as f32];
        let size = line as f32 * 0.74;
        self.write(&mut out, place(left, h + line / 4), &caption.text, size, room, INK);
        let y = h + line / 4 + 2 * line;
        let mut x = left;
        for (name, colour) in &caption.legend {
            let box_px = line / 2;
            fill(&mut out, [x, y + line / 4], [box_px, box_px], *colour);
            let [r, g, b] = *colour;
            let colour = Color32::from_rgb(r, g, b);
            let width = self.write(&mut out, place(x + box_px + line / 5, y), name, size, room, colour);
            x += box_px + width + line;
        }
        if let Some((length, what)) = &caption.scale {
            let length = (length.round() as u32).min(w / 4);
            let x = x.max(w.saturating_sub(length + 6 * line));
            fill(&mut out, [x, y + line / 2], [length, (line / 10).max(2)], [236, 238, 242]);
            self.write(&mut out, place(x + length + line / 4, y), what, size, room, INK);
        }
        out
    }

    /// Returns width and height of a line of text in pixels, for letters of this size in pixels.
    pub(super) fn measure(&mut self, text: &str, size: f32) -> [u32; 2] {
        let font = FontId::proportional(size);
        let galley = self.fonts.with_pixels_per_point(1.0).layout(text.to_owned(), font, INK, f32::INFINITY);
        [galley.size().x, galley.size().y].map(|x| x.ceil() as u32)
    }

    /// Writes text with its top left corner at `at`, wrapped at `room` pixels, and returns its width in pixels. `size`
    /// is that of the letters in pixels.
    pub(super) fn write(
        &mut self,
        image: &mut RgbImage,
        at: [f32; 2],
        text: &str,
        size: f32,
        room: f32,
        ink: Color32,
    ) -> u32 {
        let galley =
            self.fonts.with_pixels_per_point(1.0).layout(text.to_owned(), FontId::proportional(size), ink, room);
        let atlas = self.fonts.image();
        for row in galley.rows.iter().take(2) {
            for glyph in row.row.visuals.mesh.vertices.chunks_exact(4) {
                let least = |of: fn(&egui::epaint::Vertex) -> f32| glyph.iter().map(of).fold(f32::INFINITY, f32::min);
                let most = |of: fn(&egui::epaint::Vertex) -> f32| glyph.iter().map(of).fold(0.0, f32::max);
                let size = [most(|v| v.uv.x) - least(|v| v.uv.x), most(|v| v.uv.y) - least(|v| v.uv.y)];
                let uv = [least(|v| v.uv.x), least(|v| v.uv.y)].map(|v| v.round() as usize);
                let to = [row.pos.x + least(|v| v.pos.x), row.pos.y + least(|v| v.pos.y)].map(f32::round);
                for y in 0..size[1].round() as usize {
                    for x in 0..size[0].round() as usize {
                        let Some(alpha) = atlas.pixels.get((uv[1] + y) * atlas.size[0] + uv[0] + x) else { continue };
                        let place = [at[0] + to[0] + x as f32, at[1] + to[1] + y as f32];
                        blend(image, place, ink, alpha.a());
                    }
                }
            }
        }
        galley.size().x.ceil() as u32
    }
}

fn blend(image: &mut RgbImage, [x, y]: [f32; 2], ink: Color32, alpha: u8) {
    if x < 0.0 || y < 0.0 || alpha == 0 {
        return;
    }
    let Some(pixel) = image.get_pixel_mut_checked(x as u32, y as u32) else { return };
    let part = u16::from(alpha);
    for (channel, to) in pixel.0.iter_mut().zip([ink.r(), ink.g(), ink.b()]) {
        *channel = ((u16::from(*channel) * (255 - part) + u16::from(to) * part) / 255) as u8;
    }
}

fn fill(image: &mut RgbImage, [x, y]: [u32; 2], [w, h]: [u32; 2], colour: [u8; 3]) {
    for j in y..y + h {
        for i in x..x + w {
            if let Some(pixel) = image.get_pixel_mut_checked(i, j) {
                *pixel = Rgb(colour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_and_legend_are_below_the_picture() {
        let picture = RgbImage::from_pixel(640, 480, Rgb([7, 7, 7]));
        let caption = Caption {
            text: "flight/0001.png, 12.500 s: rejected, half-angle".into(),
            legend: vec![("fitted limb".into(), [240, 228, 66])],
            scale: Some((87.0, "5°".into())),
        };
        let out = Writer::default().add(&picture, &caption);
        assert_eq!(out.dimensions(), (640, 480 + height_px(640, 480)));
        assert!((0..480).all(|y| (0..640).all(|x| out.get_pixel(x, y).0 == [7, 7, 7])), "the picture stays");
        let below = |test: fn(&Rgb<u8>) -> bool| out.rows().skip(480).flatten().filter(|p| test(p)).count();
        assert!(below(|p| p.0[0] > 200 && p.0[2] > 200) > 300, "letters");
        assert!(below(|p| p.0 == [240, 228, 66]) > 30, "legend");
        assert!(below(|p| p.0[0] > 60 && p.0[0] < 180) > 100, "the letters have smooth edges");
        // A caption of a tiny picture stays within it.
        let tiny = RgbImage::new(30, 20);
        assert_eq!(Writer::default().add(&tiny, &caption).width(), 30);
    }
}
