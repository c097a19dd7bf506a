//! Draws lines, points and simple letters on an RGB picture.

use image::{Rgb, RgbImage};

/// A colour: red, green, blue.
pub type Colour = [u8; 3];

/// An RGB picture to draw on, with round pens. Everything is clipped at the picture's border.
pub struct Canvas {
    /// The picture.
    pub image: RgbImage,
}

impl Canvas {
    /// Draws a filled disc; centre and radius are in pixels.
    pub fn disc(&mut self, [u, v]: [f64; 2], radius_px: f64, colour: Colour) {
        let (w, h) = (f64::from(self.image.width()), f64::from(self.image.height()));
        let (x0, x1) = ((u - radius_px).ceil().max(0.0), (u + radius_px).floor().min(w - 1.0));
        let (y0, y1) = ((v - radius_px).ceil().max(0.0), (v + radius_px).floor().min(h - 1.0));
        // This form of the condition draws nothing for NaN.
        if !(x0 <= x1 && y0 <= y1) {
            return;
        }
        for y in y0 as u32..=y1 as u32 {
            for x in x0 as u32..=x1 as u32 {
                if (f64::from(x) - u).hypot(f64::from(y) - v) <= radius_px.max(0.6) {
                    self.image.put_pixel(x, y, Rgb(colour));
                }
            }
        }
    }

    /// Draws a straight line with round ends; all lengths are in pixels.
    pub fn line(&mut self, a: [f64; 2], b: [f64; 2], width_px: f64, colour: Colour) {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        // A line far outside the picture would cost many steps without effect; limbs are clipped to the picture before.
        if !(length <= 1e5) {
            return;
        }
        let step = (width_px / 3.0).max(0.5);
        let n = (length / step).ceil().max(1.0) as u32;
        for i in 0..=n {
            let t = f64::from(i) / f64::from(n);
            self.disc([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])], width_px / 2.0, colour);
        }
    }

    /// Draws a line through several points.
    pub fn polyline(&mut self, points: &[[f64; 2]], width_px: f64, colour: Colour) {
        for pair in points.windows(2) {
            self.line(pair[0], pair[1], width_px, colour);
        }
    }

    /// Darkens a rectangle; the picture remains visible in it.
    pub fn shade(&mut self, x: u32, y: u32, width: u32, height: u32) {
        for y in y..(y + height).min(self.image.height()) {
            for x in x..(x + width).min(self.image.width()) {
                let p = self.image.get_pixel_mut(x, y);
                p.0 = p.0.map(|c| c / 4);
            }
        }
    }

    /// Draws letters of 8 × 8 dots; each dot is `scale` pixels wide.
    pub fn text(&mut self, x: u32, y: u32, text: &str, scale: u32, colour: Colour) {
        use font8x8::UnicodeFonts;
        for (i, letter) in text.chars().enumerate() {
            let Some(rows) = font8x8::BASIC_FONTS.get(letter) else { continue };
            let left = x + i as u32 * 8 * scale;
            for (row, bits) in rows.iter().enumerate() {
                for column in (0..8).filter(|c| bits >> c & 1 == 1) {
                    self.dot(left + column * scale, y + row as u32 * scale, scale, colour);
                }
            }
        }
    }

    fn dot(&mut self, x: u32, y: u32, size: u32, colour: Colour) {
        for y in y..(y + size).min(self.image.height()) {
            for x in x..(x + size).min(self.image.width()) {
                self.image.put_pixel(x, y, Rgb(colour));
            }
        }
    }
}
