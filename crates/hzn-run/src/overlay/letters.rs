//! Writes letters with smooth edges into pictures: those of the window, so a drawing is the same on every computer.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use image::{Rgb, RgbImage};

use super::canvas::{Colour, blend};

/// A font, from which letters of every size are drawn.
pub struct Letters {
    font: Option<FontRef<'static>>,
}

impl Default for Letters {
    fn default() -> Self {
        Self { font: FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok() }
    }
}

impl Letters {
    /// Returns width and height of a line of text in pixels, for letters of this size in pixels.
    pub fn measure(&self, text: &str, size_px: f32) -> [f32; 2] {
        let mut width = 0.0;
        self.place(text, size_px, |_, end| width = end);
        let height = self.font.as_ref().map_or(size_px, |font| scaled(font, size_px).height());
        [width, height]
    }

    /// Divides a text into at most `most` lines that are `room_px` wide. A text that is longer ends with `…`.
    pub fn wrap(&self, text: &str, size_px: f32, room_px: f32, most: usize) -> Vec<String> {
        let fits = |line: &str| self.measure(line, size_px)[0] <= room_px;
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace() {
            match lines.last_mut() {
                Some(line) if fits(&format!("{line} {word}")) => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        let is_cut = lines.len() > most;
        lines.truncate(most);
        let count = lines.len();
        for (n, line) in lines.iter_mut().enumerate() {
            let goes_on = is_cut && n + 1 == count;
            if goes_on {
                line.push('…');
            }
            // A word that is longer than a line is cut as well.
            while !fits(line) && line.chars().count() > 1 {
                let without_end = line.trim_end_matches('…').chars().count().saturating_sub(1);
                *line = line.chars().take(without_end).chain(['…']).collect();
            }
        }
        lines
    }

    /// Writes a line of text with its top left corner at `at`, and returns its width in pixels. `size_px` is that of
    /// the letters. What lies outside of the picture is left out.
    pub fn write(&self, image: &mut RgbImage, at: [f32; 2], text: &str, size_px: f32, ink: Colour) -> f32 {
        let Some(font) = &self.font else { return 0.0 };
        let mut width = 0.0;
        self.place(text, size_px, |mut glyph, end| {
            width = end;
            // Letters begin at whole rows, so that their horizontal strokes are sharp.
            glyph.position += point(at[0], at[1].round());
            let Some(outline) = font.outline_glyph(glyph) else { return };
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, covered| {
                let place = [corner.x + x as f32, corner.y + y as f32];
                blend(image, place.map(|x| x as i64), ink, f64::from(covered));
            });
        });
        width
    }

    /// Calls `each` with every letter of a line and the place where the next one begins.
    fn place(&self, text: &str, size_px: f32, mut each: impl FnMut(Glyph, f32)) {
        let Some(font) = &self.font else { return };
        let scaled = scaled(font, size_px);
        let (mut x, mut before) = (0.0, None);
        for letter in text.chars() {
            let id = scaled.glyph_id(letter);
            x += before.map_or(0.0, |before| scaled.kern(before, id));
            let glyph = id.with_scale_and_position(scaled.scale(), point(x, scaled.ascent().round()));
            x += scaled.h_advance(id);
            before = Some(id);
            each(glyph, x);
        }
    }
}

/// Returns the font in a size of its letters in pixels: the em of the font is that high.
fn scaled<'a>(font: &'a FontRef<'static>, size_px: f32) -> ab_glyph::PxScaleFont<&'a FontRef<'static>> {
    let em = font.units_per_em().unwrap_or(1000.0);
    font.as_scaled(PxScale::from(size_px * font.height_unscaled() / em))
}

/// Fills a rectangle; what lies outside of the picture is left out.
pub(super) fn fill(image: &mut RgbImage, [x, y]: [u32; 2], [w, h]: [u32; 2], colour: Colour) {
    for j in y..(y + h).min(image.height()) {
        for i in x..(x + w).min(image.width()) {
            image.put_pixel(i, j, Rgb(colour));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_smooth_edges_and_the_width_that_is_measured() {
        let letters = Letters::default();
        let mut image = RgbImage::new(400, 40);
        let width = letters.write(&mut image, [5.0, 5.0], "3σ 0.0120°, half-angle", 20.0, [255, 255, 255]);
        assert!((width - letters.measure("3σ 0.0120°, half-angle", 20.0)[0]).abs() < 1e-3);
        let inked = |test: fn(u8) -> bool| image.enumerate_pixels().filter(|(_, _, p)| test(p.0[0])).count();
        assert!(inked(|v| v > 200) > 100 && inked(|v| v > 30 && v < 200) > 200, "strokes and smooth edges");
        let right = image.enumerate_pixels().filter(|(_, _, p)| p.0[0] > 30).map(|(x, ..)| x).max().unwrap();
        assert!((right as f32 - 5.0 - width).abs() < 4.0, "{right} {width}");
        // What leaves the picture is cut.
        letters.write(&mut image, [390.0, 30.0], "cut", 30.0, [255, 255, 255]);
        letters.write(&mut image, [-20.0, -10.0], "cut", 30.0, [255, 255, 255]);
    }

    #[test]
    fn long_texts_are_wrapped_and_then_cut() {
        let letters = Letters::default();
        let text = "one two three four five six seven";
        let room = letters.measure("one two three", 16.0)[0];
        let whole = letters.wrap(text, 16.0, room, 9);
        assert_eq!(whole.join(" "), text);
        let cut = letters.wrap(text, 16.0, room, 2);
        assert_eq!(cut.len(), 2);
        assert!(cut[1].ends_with('…'), "{cut:?}");
        let word = letters.wrap(&"x".repeat(200), 16.0, room, 2);
        assert!(word.len() == 1 && word[0].ends_with('…'), "{word:?}");
        for line in whole.iter().chain(&cut).chain(&word) {
            assert!(letters.measure(line, 16.0)[0] <= room, "{line}");
        }
    }
}
