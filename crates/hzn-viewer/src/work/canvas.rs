//! A picture that plotters draws on. Its letters are those of the window, so a drawing is the same on every computer.

use std::convert::Infallible;

use hzn_run::overlay::letters::Letters;
use image::{Rgb, RgbImage};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind};

/// A picture that plotters draws on.
pub(super) struct Canvas<'a> {
    image: &'a mut RgbImage,
    letters: Letters,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl<'a> Canvas<'a> {
    pub(super) fn new(image: &'a mut RgbImage) -> Self {
        Self { image, letters: Letters::default() }
    }

    fn blend(&mut self, [x, y]: [i64; 2], colour: BackendColor) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        let Some(Rgb(pixel)) = self.image.get_pixel_mut_checked(x, y) else { return };
        let (r, g, b) = colour.rgb;
        for (channel, to) in pixel.iter_mut().zip([r, g, b]) {
            *channel = (f64::from(*channel) * (1.0 - colour.alpha) + f64::from(to) * colour.alpha).round() as u8;
        }
    }

    /// Draws all pixels whose distance from a segment is at most `radius`.
    fn stroke(&mut self, from: BackendCoord, to: BackendCoord, radius: f64, colour: BackendColor) {
        let [a, b] = [from, to].map(|(x, y)| [f64::from(x), f64::from(y)]);
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let size = [self.image.width(), self.image.height()].map(f64::from);
        let span = |k: usize| {
            let (low, high) = (a[k].min(b[k]) - radius, a[k].max(b[k]) + radius);
            (low.floor().max(0.0) as i64, high.ceil().min(size[k]) as i64)
        };
        let ((left, right), (top, bottom)) = (span(0), span(1));
        for y in top..=bottom {
            for x in left..=right {
                let p = [x as f64 - a[0], y as f64 - a[1]];
                let part =
                    if square > 0.0 { ((p[0] * along[0] + p[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
                if (p[0] - part * along[0]).hypot(p[1] - part * along[1]) <= radius {
                    self.blend([x, y], colour);
                }
            }
        }
    }
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.image.dimensions()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        self.blend([x, y].map(i64::from), colour);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.stroke(from, to, f64::from(style.stroke_width().max(1)) / 2.0, style.color());
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        let mut last = None;
        for to in path {
            if let Some(from) = last.replace(to) {
                self.draw_line(from, to, style)?;
            }
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(&mut self, centre: BackendCoord, radius: u32, style: &S, _: bool) -> Drawn {
        self.stroke(centre, centre, f64::from(radius), style.color());
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, (x, y): BackendCoord) -> Drawn {
        let (width, height) = self.estimate_text_size(text, style)?;
        let part = |begins: bool, middle: bool| if begins { 0.0 } else { 1.0 - 0.5 * f32::from(u8::from(middle)) };
        let anchor = style.anchor();
        let left = part(matches!(anchor.h_pos, HPos::Left), matches!(anchor.h_pos, HPos::Center));
        let above = part(matches!(anchor.v_pos, VPos::Top), matches!(anchor.v_pos, VPos::Center));
        let at = [x as f32 - left * width as f32, y as f32 - above * height as f32];
        let (r, g, b) = style.color().rgb;
        self.letters.write(self.image, at, text, style.size() as f32, [r, g, b]);
        Ok(())
    }

    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        text: &str,
        style: &T,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let [width, height] = self.letters.measure(text, style.size() as f32).map(|x| x.ceil() as u32);
        Ok((width, height))
    }
}
