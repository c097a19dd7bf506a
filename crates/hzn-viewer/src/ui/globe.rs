//! A sphere as it is seen from outside, without perspective.

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, vec2};

/// The sphere on the screen.
pub(super) struct Globe {
    pub(super) centre: Pos2,
    /// Radius of the unit sphere in points.
    pub(super) radius: f32,
    /// The directions to the right, upwards and to the eye.
    axes: [[f64; 3]; 3],
}

impl Globe {
    /// Makes a sphere whose +z axis points downwards on the screen, as that of many vehicles does.
    pub(super) fn downwards(rect: Rect, [azimuth, elevation]: [f32; 2]) -> Self {
        let ((sin_a, cos_a), (sin_e, cos_e)) = (f64::from(azimuth).sin_cos(), f64::from(elevation).sin_cos());
        let eye = [cos_e * cos_a, cos_e * sin_a, -sin_e];
        let right = [sin_a, -cos_a, 0.0];
        let up = [-sin_e * cos_a, -sin_e * sin_a, -cos_e];
        Self::new(rect, [right, up, eye])
    }
    /// Makes a sphere whose +z axis points upwards on the screen, as the north of a planet does. The eye is above the
    /// longitude `azimuth` and the latitude `elevation`.
    pub(super) fn upwards(rect: Rect, [azimuth, elevation]: [f32; 2]) -> Self {
        let ((sin_a, cos_a), (sin_e, cos_e)) = (f64::from(azimuth).sin_cos(), f64::from(elevation).sin_cos());
        let eye = [cos_e * cos_a, cos_e * sin_a, sin_e];
        let right = [-sin_a, cos_a, 0.0];
        let up = [-sin_e * cos_a, -sin_e * sin_a, cos_e];
        Self::new(rect, [right, up, eye])
    }
    fn new(rect: Rect, axes: [[f64; 3]; 3]) -> Self {
        let radius = 0.5 * rect.width().min(rect.height()) - 16.0;
        Self { centre: rect.center(), radius: radius.max(10.0), axes }
    }
    /// Returns the place of a point on the screen, and its distance towards the eye from the middle of the sphere.
    pub(super) fn place(&self, point: [f64; 3]) -> (Pos2, f64) {
        let [x, y, depth] = self.axes.map(|axis| axis.iter().zip(point).map(|(a, b)| a * b).sum::<f64>());
        (self.centre + vec2(x as f32, -y as f32) * self.radius, depth)
    }
    /// Returns the place of a direction on the screen, and whether it is on the near side.
    pub(super) fn at(&self, d: [f64; 3]) -> (Pos2, bool) {
        let (at, depth) = self.place(d);
        (at, depth >= 0.0)
    }
    /// Returns the place of a point on the screen, and whether a ball of this radius in the middle leaves it in view.
    pub(super) fn beyond(&self, point: [f64; 3], ball: f64) -> (Pos2, bool) {
        let (at, depth) = self.place(point);
        let off = f64::from((at - self.centre).length() / self.radius);
        // The surface of the ball is in view on the near side, also after rounding.
        let is_covered = off < ball && depth < 0.97 * (ball * ball - off * off).sqrt();
        (at, !is_covered)
    }
    /// Draws a line, which is faint where it is not in view.
    pub(super) fn line(&self, painter: &Painter, points: &[(Pos2, bool)], width: f32, colour: Color32) {
        for part in points.chunk_by(|a, b| a.1 == b.1) {
            let is_near = part.first().is_some_and(|p| p.1);
            let colour = if is_near { colour } else { colour.gamma_multiply(0.35) };
            painter.add(Shape::line(part.iter().map(|p| p.0).collect(), Stroke::new(width, colour)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_what_lies_behind_the_ball_is_not_in_view() {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(200.0, 200.0));
        let globe = Globe::upwards(rect, [0.0, 0.0]);
        let (north, _) = globe.place([0.0, 0.0, 1.0]);
        assert!(north.y < globe.centre.y - 0.9 * globe.radius && (north.x - globe.centre.x).abs() < 0.01);
        let (east, _) = globe.place([0.0, 1.0, 0.0]);
        assert!(east.x > globe.centre.x + 0.9 * globe.radius, "east of the middle is on the right");
        assert!(globe.beyond([0.5, 0.0, 0.0], 0.5).1 && !globe.beyond([-0.5, 0.0, 0.0], 0.5).1);
        assert!(!globe.beyond([-0.9, 0.1, 0.0], 0.5).1 && globe.beyond([-0.9, 0.6, 0.0], 0.5).1);
        let down = Globe::downwards(rect, [0.4, 0.3]);
        assert!(down.place([0.0, 0.0, 1.0]).0.y > down.centre.y);
    }
}
