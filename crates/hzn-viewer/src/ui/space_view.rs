//! The view from space: the globe with the camera's path, what the camera sees, and what it measured.

use egui::{Align2, Color32, FontId, Painter, Rect, Sense, Stroke, Ui, vec2};
use hzn_core::body::Kind as Body;

use super::dialogs::escape;
use super::globe::Globe;
use super::space_eye::SpaceEye;
use super::viewer::Viewer;
use super::{placement, theme};
use crate::work::space::{self, Kind, Scene};

/// Side of the view in points, when it opens.
const SIDE: f32 = 330.0;
/// The ground of the view: space is black, in the light theme too.
const SPACE: Color32 = Color32::from_rgb(14, 17, 24);
const FRUSTUM: Color32 = Color32::from_rgb(220, 220, 220);
const PATH: Color32 = Color32::from_rgb(86, 180, 233);

/// Draws the window while it is open.
pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context, picture: Rect) {
    let Some(mut eye) = viewer.panels.space else { return };
    let mut is_open = true;
    let side = SIDE.min(picture.width() - 60.0).min(picture.height() - 90.0).max(120.0);
    let window = egui::Window::new("View from space").open(&mut is_open).default_pos(placement::beside(picture));
    window.default_size(vec2(side, side + 46.0)).show(ctx, |ui| contents(viewer, ui, &mut eye));
    viewer.panels.space = (is_open && !escape(ctx)).then_some(eye);
}

/// Returns the scene of the shown picture.
fn scene(viewer: &Viewer) -> Option<Scene> {
    let view = viewer.frame_view.as_ref()?;
    let body = view.answers.first().map(|outcome| &outcome.config.body);
    let path = viewer.sequence.entries.iter().filter_map(|entry| entry.data.as_ref()?.position_km);
    Some(space::scene(
        view.data.as_ref(),
        body.and_then(|body| body.figure_km()),
        body.is_some_and(|body| matches!(body.kind, Body::Earth | Body::EarthSphere)),
        view.camera.as_deref(),
        viewer.answer().and_then(|answer| answer.solution()),
        path.collect(),
    ))
}

fn contents(viewer: &Viewer, ui: &mut Ui, eye: &mut SpaceEye) {
    let Some(scene) = scene(viewer) else {
        ui.weak("No picture is shown yet.");
        return;
    };
    let size = vec2(ui.available_width(), (ui.available_height() - 40.0).max(120.0));
    let (response, painter) = ui.allocate_painter(size, Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Scene in space"));
    let at = eye.beside(scene.camera);
    eye.turn(at, response.drag_delta());
    if response.contains_pointer() {
        let (zoom, scroll) = ui.input(|i| (i.zoom_delta(), i.smooth_scroll_delta.y));
        eye.scale(eye.zoom(scene.reach, scene.sight), zoom * (0.004 * scroll).exp());
    }
    if response.double_clicked() {
        *eye = SpaceEye::default();
    }
    painter.rect_filled(response.rect, 4, SPACE);
    draw(&painter, response.rect, &scene, *eye);
    let times =
        if scene.sigma_times > 1.0 { format!(", drawn {:.0} times larger", scene.sigma_times) } else { String::new() };
    let words = match scene.missing {
        Some(missing) => missing.to_owned(),
        None => format!("Cone: half-angle; narrow cone: 3σ of the axis{times}. Drag to turn, wheel to zoom."),
    };
    ui.add(egui::Label::new(egui::RichText::new(words).weak().size(11.5)).wrap());
}

fn draw(painter: &Painter, rect: Rect, scene: &Scene, eye: SpaceEye) {
    let painter = painter.with_clip_rect(rect);
    let mut globe = Globe::upwards(rect, eye.beside(scene.camera));
    let ball = scene.globe.map_or(0.0, |radius| radius / scene.reach);
    let scaled = |p: [f64; 3]| p.map(|x| x / scene.reach);
    let zoom = eye.zoom(scene.reach, scene.sight);
    globe.radius *= zoom;
    if let Some(camera) = scene.camera.filter(|_| zoom > 1.0) {
        // The more the scene is enlarged, the nearer the camera is to the middle.
        let (at, _) = globe.place(scaled(camera));
        globe.centre -= (at - globe.centre) * (zoom - 1.0).min(1.0);
    }
    if scene.globe.is_some() {
        let stroke = Stroke::new(1.0, theme::GRID.gamma_multiply(0.5));
        painter.circle(globe.centre, globe.radius * ball as f32, Color32::from_rgb(24, 36, 54), stroke);
    }
    for line in &scene.lines {
        let (width, colour) = match line.kind {
            Kind::Grid => (0.7, theme::GRID.gamma_multiply(0.35)),
            Kind::Coast => (0.9, theme::COAST.gamma_multiply(0.7)),
            Kind::Path => (2.0, PATH),
            Kind::Frustum => (1.2, FRUSTUM),
            Kind::Cone => (1.0, theme::LIMB.gamma_multiply(0.75)),
            Kind::Axis => (2.0, theme::AXIS),
            Kind::Sigma => (1.2, theme::AXIS),
        };
        // The axis ends within the globe. It is drawn as if the globe were of glass.
        let ball = if matches!(line.kind, Kind::Axis | Kind::Sigma) { 0.0 } else { ball };
        let points: Vec<_> = line.points.iter().map(|p| globe.beyond(scaled(*p), ball)).collect();
        // The far side of the ground would be confused with the near one.
        let is_ground = matches!(line.kind, Kind::Grid | Kind::Coast);
        for part in points.chunk_by(|a, b| a.1 == b.1) {
            if part.first().is_some_and(|p| p.1) || !is_ground {
                globe.line(&painter, part, width, colour);
            }
        }
    }
    if let Some(camera) = scene.camera {
        let (at, is_seen) = globe.beyond(scaled(camera), ball);
        let colour = if is_seen { Color32::WHITE } else { Color32::from_gray(120) };
        painter.circle_filled(at, 3.5, colour);
        painter.text(at + vec2(6.0, -4.0), Align2::LEFT_BOTTOM, "camera", FontId::proportional(11.0), colour);
    }
}
