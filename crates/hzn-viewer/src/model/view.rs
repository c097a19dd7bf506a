//! Where the picture lies on the screen: zoom and pan.

/// A point on the screen or in the picture, (x, y).
pub type Point = [f64; 2];

/// Largest scale in screen points per picture pixel; single pixels are then large squares.
const MAX_SCALE: f64 = 64.0;

/// Placement of the picture in its area of the screen.
///
/// Pixel centres are at integers: the picture reaches from -0.5 to its width - 0.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Picture point in the middle of the screen area, and the scale in screen points per pixel; `None` shows the whole
    /// picture.
    centre: Option<(Point, f64)>,
}

/// An area of the screen: its top left corner and its size, in screen points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Top left corner.
    pub min: Point,
    /// Width and height.
    pub size: Point,
}

impl Area {
    fn middle(&self) -> Point {
        [self.min[0] + self.size[0] / 2.0, self.min[1] + self.size[1] / 2.0]
    }
}

impl Default for View {
    fn default() -> Self {
        Self::FIT
    }
}

impl View {
    /// Shows the whole picture, as large as it fits.
    pub const FIT: Self = Self { centre: None };

    /// Returns true if the whole picture is shown, as large as it fits.
    pub fn is_fit(&self) -> bool {
        self.centre.is_none()
    }

    /// Returns the scale in screen points per pixel, for a picture of this size.
    pub fn scale(&self, area: Area, picture: Point) -> f64 {
        match self.centre {
            Some((_, scale)) => scale,
            None => fit(area, picture),
        }
    }

    /// Returns the screen point of a picture point.
    pub fn to_screen(&self, area: Area, picture: Point, p: Point) -> Point {
        let (centre, scale) = self.centre_and_scale(area, picture);
        let middle = area.middle();
        [middle[0] + (p[0] - centre[0]) * scale, middle[1] + (p[1] - centre[1]) * scale]
    }

    /// Returns the picture point of a screen point.
    pub fn to_picture(&self, area: Area, picture: Point, s: Point) -> Point {
        let (centre, scale) = self.centre_and_scale(area, picture);
        let middle = area.middle();
        [centre[0] + (s[0] - middle[0]) / scale, centre[1] + (s[1] - middle[1]) / scale]
    }

    /// Enlarges the picture by `factor` and keeps the picture point under `pointer` (a screen point) in place. The
    /// picture does not get smaller than the whole picture; at this limit the view becomes [`View::FIT`].
    pub fn zoom(&mut self, area: Area, picture: Point, pointer: Point, factor: f64) {
        let before = self.to_picture(area, picture, pointer);
        let smallest = fit(area, picture);
        let scale = (self.scale(area, picture) * factor).min(MAX_SCALE.max(smallest));
        if !(scale > smallest * 1.0001) {
            *self = Self::FIT;
            return;
        }
        let middle = area.middle();
        let centre = [before[0] - (pointer[0] - middle[0]) / scale, before[1] - (pointer[1] - middle[1]) / scale];
        self.centre = Some((clamp_to(centre, picture), scale));
    }

    /// Moves the picture by `delta` screen points. The middle of the area stays within the picture.
    pub fn pan(&mut self, area: Area, picture: Point, delta: Point) {
        let (centre, scale) = self.centre_and_scale(area, picture);
        if self.centre.is_some() {
            self.centre =
                Some((clamp_to([centre[0] - delta[0] / scale, centre[1] - delta[1] / scale], picture), scale));
        }
    }

    /// Moves a point of the picture into the middle, with at least `scale` screen points per pixel.
    pub fn look_at(&mut self, picture: Point, p: Point, scale: f64) {
        let scale = self.centre.map_or(scale, |(_, now)| now.max(scale));
        self.centre = Some((clamp_to(p, picture), scale));
    }

    /// Sets the scale to `scale` screen points per pixel and keeps the middle in place.
    pub fn set_scale(&mut self, area: Area, picture: Point, scale: f64) {
        let factor = scale / self.scale(area, picture);
        self.zoom(area, picture, area.middle(), factor);
    }

    fn centre_and_scale(&self, area: Area, picture: Point) -> (Point, f64) {
        self.centre.unwrap_or_else(|| ([(picture[0] - 1.0) / 2.0, (picture[1] - 1.0) / 2.0], fit(area, picture)))
    }
}

fn fit(area: Area, picture: Point) -> f64 {
    (area.size[0] / picture[0].max(1.0)).min(area.size[1] / picture[1].max(1.0)).max(1e-3)
}

fn clamp_to(p: Point, picture: Point) -> Point {
    [p[0].clamp(-0.5, picture[0] - 0.5), p[1].clamp(-0.5, picture[1] - 0.5)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { min: [100.0, 50.0], size: [800.0, 600.0] };
    const PICTURE: Point = [1920.0, 1080.0];

    fn near(a: Point, b: Point) {
        assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9, "{a:?} {b:?}");
    }

    #[test]
    fn a_whole_picture_fills_the_narrower_side() {
        let view = View::FIT;
        near(view.to_screen(AREA, PICTURE, [-0.5, 539.5]), [100.0, 350.0]);
        near(view.to_screen(AREA, PICTURE, [1919.5, 539.5]), [900.0, 350.0]);
        assert_eq!(view.scale(AREA, PICTURE), 800.0 / 1920.0);
    }

    #[test]
    fn there_and_back() {
        let mut view = View::FIT;
        view.zoom(AREA, PICTURE, [300.0, 200.0], 7.3);
        view.pan(AREA, PICTURE, [13.0, -40.0]);
        for p in [[0.0, 0.0], [12.25, 900.0], [1919.0, 1079.0]] {
            near(view.to_picture(AREA, PICTURE, view.to_screen(AREA, PICTURE, p)), p);
        }
    }

    #[test]
    fn what_is_under_the_pointer_stays_there() {
        let mut view = View::FIT;
        let pointer = [420.0, 333.0];
        let under = view.to_picture(AREA, PICTURE, pointer);
        for factor in [1.5, 2.0, 1.7, 0.6, 3.0] {
            view.zoom(AREA, PICTURE, pointer, factor);
            near(view.to_picture(AREA, PICTURE, pointer), under);
        }
    }

    #[test]
    fn zoom_ends_at_single_pixels_and_at_the_whole_picture() {
        let mut view = View::FIT;
        for _ in 0..100 {
            view.zoom(AREA, PICTURE, [400.0, 300.0], 1.5);
        }
        assert_eq!(view.scale(AREA, PICTURE), MAX_SCALE);
        for _ in 0..100 {
            view.zoom(AREA, PICTURE, [420.0, 310.0], 0.5);
        }
        assert!(view.is_fit());
        view.pan(AREA, PICTURE, [50.0, 50.0]);
        assert!(view.is_fit(), "a whole picture is not moved");
    }

    #[test]
    fn what_is_looked_at_comes_into_the_middle() {
        let mut view = View::FIT;
        view.look_at(PICTURE, [300.0, 200.0], 8.0);
        near(view.to_screen(AREA, PICTURE, [300.0, 200.0]), AREA.middle());
        assert_eq!(view.scale(AREA, PICTURE), 8.0);
        // A larger scale is kept. A point outside the picture moves to the nearest point of the picture.
        view.set_scale(AREA, PICTURE, 20.0);
        view.look_at(PICTURE, [9999.0, 100.0], 8.0);
        near(view.to_picture(AREA, PICTURE, AREA.middle()), [1919.5, 100.0]);
        assert_eq!(view.scale(AREA, PICTURE), 20.0);
    }

    #[test]
    fn the_picture_is_not_lost() {
        let mut view = View::FIT;
        view.set_scale(AREA, PICTURE, 4.0);
        view.pan(AREA, PICTURE, [1e6, -1e6]);
        near(view.to_picture(AREA, PICTURE, [500.0, 350.0]), [-0.5, 1079.5]);
        // A picture that is far smaller than the area can exceed the largest scale from the start.
        assert!(View::FIT.scale(AREA, [4.0, 3.0]) > MAX_SCALE);
        let mut small = View::FIT;
        small.zoom(AREA, [4.0, 3.0], [400.0, 300.0], 2.0);
        assert!(small.is_fit());
    }
}
