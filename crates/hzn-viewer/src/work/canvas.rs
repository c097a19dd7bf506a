//! A picture that plotters draws on. Its letters are those of the window, so a drawing is the same on every computer.

use std::convert::Infallible;

use hzn_run::overlay::letters::Letters;
use hzn_run::overlay::runs::{self, Ink};
use image::RgbImage;
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

    fn stroke(&mut self, from: BackendCoord, to: BackendCoord, radius: f64, colour: BackendColor) {
        let [a, b] = [from, to].map(|(x, y)| [f64::from(x), f64::from(y)]);
        runs::stroke(self.image, [a, b], radius, ink(colour));
    }
}

fn ink(colour: BackendColor) -> Ink {
    let (r, g, b) = colour.rgb;
    Ink { colour: [r, g, b], opacity: colour.alpha }
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
        let [x, y] = [x, y].map(i64::from);
        runs::fill_row(self.image, y, [x, x], ink(colour));
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

    fn draw_rect<S: BackendStyle>(&mut self, a: BackendCoord, b: BackendCoord, style: &S, fill: bool) -> Drawn {
        let corners = [(a.0, a.1), (b.0, a.1), (b.0, b.1), (a.0, b.1), (a.0, a.1)];
        if !fill {
            return self.draw_path(corners, style);
        }
        // The rows outside of the picture are many in a large area.
        let last = i64::from(self.image.height());
        let [left, right] = [a.0.min(b.0), a.0.max(b.0)].map(i64::from);
        let [top, bottom] = [a.1.min(b.1), a.1.max(b.1)].map(i64::from);
        let ink = ink(style.color());
        (top.max(0)..=bottom.min(last)).for_each(|y| runs::fill_row(self.image, y, [left, right], ink));
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
