//! The figures of each kind of artefact.

use hzn_core::camera;
use hzn_sim::error::SceneError;

use super::circle::Circle;
use super::clouds::Clouds;
use super::dice::Dice;
use super::glare::Glare;
use super::kind::Kind;
use super::lights::Lights;
use super::moon::Moon;
use super::panel::Panel;
use super::polygon::Polygon;
use super::shape::{Canvas, Shape};
use super::solid::ProjectedSolid;
use super::streak::Streak;
use super::vignetted::Vignetted;
use super::window::Window;

/// Figures, and the circles among them (middle and radius in pixels).
#[derive(Default)]
pub(super) struct Figures {
    pub(super) shapes: Vec<Box<dyn Shape>>,
    pub(super) discs: Vec<([f64; 2], f64)>,
}

impl Figures {
    /// Returns true if a point in pixels is lit or covered.
    pub(super) fn is_bright(&self, x: f64, y: f64) -> bool {
        self.shapes.iter().map(|s| s.sample(x as f32, y as f32)).any(|s| s.light > 0.05 || s.cover > 0.5)
    }

    fn add(&mut self, shape: impl Shape + 'static) {
        self.shapes.push(Box::new(shape));
    }
    fn add_vignetted(&mut self, ghost: Vignetted) {
        self.discs.extend(ghost.circles());
        self.add(ghost);
    }
    fn add_disc(&mut self, circle: Circle) {
        self.discs.push(circle.middle_and_radius());
        self.add(circle);
    }
}

/// Draws the figures of a kind: one figure, or two for one in four of the flares. A chain has three to eight figures.
pub(super) fn draw(
    kind: Kind,
    seed: u64,
    dice: &mut Dice,
    canvas: &Canvas,
    camera: &camera::Config,
) -> Result<Figures, SceneError> {
    let mut figures = Figures::default();
    let flare = matches!(kind, Kind::Ring | Kind::Disc | Kind::Polygon | Kind::Streak);
    for _ in 0..if flare && dice.chance(0.25) { 2 } else { 1 } {
        match kind {
            Kind::Ring => figures.add(Circle::ring(dice, canvas)),
            Kind::Disc => figures.add_disc(Circle::disc(dice, canvas)),
            Kind::Polygon => figures.add(Polygon::draw(dice, canvas)),
            Kind::Streak => figures.add(Streak::draw(dice, canvas)),
            Kind::FarDisc => figures.add_disc(Circle::far_disc(dice, canvas)),
            Kind::Chain => draw_chain(&mut figures, dice, canvas),
            Kind::Glare => figures.add(Glare::draw(dice, canvas)),
            Kind::Panel => figures.add(ProjectedSolid::try_new(Panel::draw(dice, canvas), camera)?),
            Kind::Window => figures.add(ProjectedSolid::try_new(Window::draw(dice, canvas), camera)?),
            Kind::Moon => figures.add(Moon::draw(dice, canvas)),
            Kind::Clouds => figures.add(Clouds::draw(dice, canvas, seed)),
            Kind::Lights => figures.add(Lights::draw(dice, canvas)),
            Kind::Vignetted => figures.add_vignetted(Vignetted::draw(dice, canvas)),
        }
    }
    Ok(figures)
}

/// Draws three to eight discs, rings and polygons of 0.01 to 0.6 diagonals, like reflections of the surfaces of a lens.
/// They are on the line from a source of light through the principal point, with a light of 0.03 to 0.6 each.
fn draw_chain(figures: &mut Figures, dice: &mut Dice, canvas: &Canvas) {
    let source = [dice.between(-0.4, 1.4) * canvas.width, dice.between(-0.4, 1.4) * canvas.height];
    let [cx, cy] = canvas.centre;
    for _ in 0..dice.count(3, 8) {
        let along = dice.between(-1.8, 0.9);
        let middle = [(cx + along * (source[0] - cx)) as f32, (cy + along * (source[1] - cy)) as f32];
        let radius = dice.between_log(0.01, 0.6) * canvas.diagonal;
        let light = (0.03, 0.6);
        match dice.count(0, 3) {
            0 => figures.add(Circle::ring_around(dice, middle, radius, light)),
            1 => figures.add(Polygon::draw_around(dice, middle, radius, light)),
            _ => figures.add_disc(Circle::disc_around(dice, middle, radius, light)),
        }
    }
    figures.add(Glare::source(dice, canvas, source.map(|v| v as f32)));
}
