//! The picture, and everything that is drawn over it.

use std::sync::Arc;

use egui::{
    Align2, Color32, ColorImage, FontId, Mesh, Painter, PointerButton, Pos2, Rect, Response, Sense, Shape, Stroke,
    TextureFilter, TextureHandle, TextureOptions, Ui, Vec2, pos2, vec2,
};
use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;

use super::viewer::Viewer;
use super::{Command, theme};
use crate::model::mask::MaskEdit;
use crate::model::settings::Layer;
use crate::model::view::{Area, Point};
use crate::model::{Plane, View, rows};
use crate::work::paint;
use crate::work::sight::{Answer, Outcome, Shown, Sight};

/// Screen points a picture pixel from which single pixels show their values.
const VALUES_FROM: f64 = 34.0;
/// How near the pointer must be to a corner, screen points.
const REACH: f64 = 9.0;

/// The mask is being drawn.
pub(super) type MaskTool = MaskEdit;

/// Pictures on the graphics card.
#[derive(Default)]
pub(super) struct Textures {
    shown: Option<(Arc<Shown>, TextureHandle)>,
    touched: Option<(Arc<ColorImage>, TextureHandle)>,
}

impl Textures {
    /// Takes what is new in the sight.
    pub(super) fn take(&mut self, sight: Option<&Sight>, ctx: &egui::Context) {
        // Single pixels stay squares, a large picture is smoothed.
        let smooth = TextureOptions {
            magnification: TextureFilter::Nearest,
            minification: TextureFilter::Linear,
            mipmap_mode: Some(TextureFilter::Linear),
            ..TextureOptions::LINEAR
        };
        match sight.and_then(|s| s.image.as_ref()) {
            None => self.shown = None,
            Some(new) => match &mut self.shown {
                Some((old, _)) if Arc::ptr_eq(old, new) => {}
                Some((old, texture)) => {
                    texture.set(Arc::clone(&new.image), smooth);
                    *old = Arc::clone(new);
                }
                none => *none = Some((Arc::clone(new), ctx.load_texture("picture", Arc::clone(&new.image), smooth))),
            },
        }
        match sight.and_then(|s| s.answers.first()?.touched.as_ref()) {
            None => self.touched = None,
            Some(new) => match &mut self.touched {
                Some((old, _)) if Arc::ptr_eq(old, new) => {}
                slot => {
                    let options = TextureOptions { mipmap_mode: None, ..smooth };
                    *slot = Some((Arc::clone(new), ctx.load_texture("touched", Arc::clone(new), options)));
                }
            },
        }
    }
}

/// Where a picture of this size lies, and in which plane.
struct Stage<'a> {
    view: View,
    area: Area,
    size: Point,
    plane: Plane,
    camera: Option<&'a Camera<f64>>,
}

impl Stage<'_> {
    fn screen(&self, p: Point) -> Option<Pos2> {
        let p = match (&self.plane, self.camera) {
            (Plane::Camera, _) | (_, None) => p,
            (plane, Some(camera)) => plane.show(camera, p)?,
        };
        Some(self.place(p))
    }
    fn place(&self, p: Point) -> Pos2 {
        let [x, y] = self.view.to_screen(self.area, self.size, p);
        pos2(x as f32, y as f32)
    }
    /// The point of the camera's picture under a point of the screen.
    fn picture(&self, at: Pos2) -> Option<Point> {
        let p = self.view.to_picture(self.area, self.size, [at.x.into(), at.y.into()]);
        match (&self.plane, self.camera) {
            (Plane::Camera, _) | (_, None) => Some(p),
            (plane, Some(camera)) => plane.of(camera, p),
        }
    }
    fn scale(&self) -> f64 {
        self.view.scale(self.area, self.size)
    }
}

fn area(rect: Rect) -> Area {
    Area {
        min: [rect.min.x.into(), rect.min.y.into()],
        size: [rect.width().max(1.0).into(), rect.height().max(1.0).into()],
    }
}

fn size_of(sight: &Sight) -> Option<Point> {
    let layout = sight.picture.as_ref().ok()?.layout;
    Some([layout.width.into(), layout.height.into()])
}

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    egui::CentralPanel::no_frame().show(ui, |ui| {
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0, ui.visuals().extreme_bg_color);
        if viewer.sequence.title.is_empty() {
            return welcome(viewer, ui);
        }
        let Some(sight) = viewer.sight.clone() else {
            ui.centered_and_justified(|ui| ui.weak(if viewer.sequence.is_empty() { "" } else { "…" }));
            return;
        };
        let panes = if viewer.other.is_some() { 2 } else { 1 };
        let width = rect.width() / panes as f32;
        for pane in 0..panes {
            let left = rect.left() + width * pane as f32;
            let inner = Rect::from_min_size(pos2(left, rect.top()), vec2(width, rect.height())).shrink2(vec2(1.0, 0.0));
            one(viewer, ui, &sight, inner, pane);
        }
    });
}

fn welcome(viewer: &mut Viewer, ui: &mut Ui) {
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.28);
        ui.heading("hzn viewer");
        ui.add_space(6.0);
        ui.label("Drop a recording (.mcap), a folder of pictures, a picture or a video here.");
        ui.add_space(10.0);
        if ui.button("Open…").clicked() {
            viewer.run(Command::Open, &ui.ctx().clone());
        }
        ui.add_space(14.0);
        let recent = viewer.settings.recent.clone();
        for path in recent {
            if ui.link(path.display().to_string()).clicked() {
                viewer.open_paths(vec![path]);
            }
        }
    });
}

fn one(viewer: &mut Viewer, ui: &mut Ui, sight: &Sight, rect: Rect, pane: usize) {
    let response = ui.interact(rect, ui.scope_id().with(("picture", pane)), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("Picture {}", sight.name)));
    let painter = ui.painter_at(rect);
    let Some(size) = size_of(sight) else {
        let why = sight.picture.as_ref().err().cloned().unwrap_or_default();
        let text = format!("{}\ncannot be shown: {why}", sight.name);
        painter.text(
            rect.center(),
            Align2::CENTER_CENTER,
            text,
            FontId::proportional(15.0),
            ui.visuals().warn_fg_color,
        );
        return;
    };
    let plane = sight.image.as_ref().map(|s| s.of.1.plane.clone()).unwrap_or_default();
    let mut stage = Stage { view: viewer.view, area: area(rect), size, plane, camera: sight.camera.as_deref() };
    if pointer(viewer, ui, &response, &mut stage) {
        viewer.view = stage.view;
    }
    if let Some((_, texture)) = &viewer.textures.shown {
        let at = Rect::from_min_max(stage.place([-0.5, -0.5]), stage.place([size[0] - 0.5, size[1] - 0.5]));
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), at, uv, Color32::WHITE);
        if pane == 0
            && viewer.settings.shows(Layer::Touched)
            && !viewer.layers_hidden
            && stage.plane == Plane::Camera
            && let Some((_, touched)) = &viewer.textures.touched
        {
            painter.image(touched.id(), at, uv, Color32::WHITE);
        }
    }
    values(&painter, sight, &stage, rect);
    let outcome = sight.answers.get(pane);
    if let Some(outcome) = outcome.filter(|_| !viewer.layers_hidden) {
        overlays(viewer, &painter, sight, outcome, &stage);
    }
    if let (Some(tool), 0) = (&viewer.mask, pane) {
        draw_tool(tool, viewer, &painter, &stage, ui);
    }
    if let Some(name) = viewer.other.as_ref().map(|(name, _)| name.clone()) {
        let title = if pane == 0 { "session".to_owned() } else { name };
        label(&painter, rect.left_top() + vec2(10.0, 10.0), Align2::LEFT_TOP, &title);
    }
    if let Some(refused) = outcome.and_then(|o| o.refused.as_deref()) {
        notice(&painter, rect, refused, ui.visuals().warn_fg_color);
    }
    if let Some(at) = response.hover_pos()
        && let Some(text) = read_out(sight, outcome.map(|o| &**o), viewer.body, &stage, at)
    {
        label(&painter, rect.left_bottom() + vec2(10.0, -10.0), Align2::LEFT_BOTTOM, &text);
    }
}

/// Zoom and pan, or the mask's tool. True when the view has changed.
fn pointer(viewer: &mut Viewer, ui: &Ui, response: &Response, stage: &mut Stage<'_>) -> bool {
    let before = stage.view;
    if let Some(at) = response.hover_pos() {
        let at = [at.x.into(), at.y.into()];
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let factor = (f64::from(scroll) / 240.0).exp() * f64::from(pinch);
        if (factor - 1.0).abs() > 1e-6 {
            stage.view.zoom(stage.area, stage.size, at, factor);
        }
    }
    let drawing = viewer.mask.is_some() && draw_mask(viewer, ui, response, stage);
    let by = response.drag_delta();
    if by != Vec2::ZERO && (!drawing || response.dragged_by(PointerButton::Middle)) {
        stage.view.pan(stage.area, stage.size, [by.x.into(), by.y.into()]);
    }
    if viewer.mask.is_none() && response.double_clicked() {
        if stage.view.is_fit() {
            let at = response.interact_pointer_pos().unwrap_or(response.rect.center());
            let factor = 4.0 / stage.scale();
            stage.view.zoom(stage.area, stage.size, [at.x.into(), at.y.into()], factor.max(2.0));
        } else {
            stage.view = View::FIT;
        }
    }
    if response.dragged() && viewer.mask.is_none() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
    }
    stage.view != before
}

/// The mask's tool; true while it holds a corner.
fn draw_mask(viewer: &mut Viewer, ui: &Ui, response: &Response, stage: &Stage<'_>) -> bool {
    let (Some(mut tool), Some(session)) = (viewer.mask.take(), viewer.session.as_mut()) else { return false };
    let polygons = session.polygons();
    let reach = REACH / stage.scale();
    let at = response.interact_pointer_pos().or(response.hover_pos()).and_then(|p| stage.picture(p));
    let mut new = None;
    if let Some(p) = at {
        if response.drag_started_by(PointerButton::Primary) {
            let from = ui.input(|i| i.pointer.press_origin()).and_then(|p| stage.picture(p)).unwrap_or(p);
            tool.grab(&polygons, from, reach);
        }
        if response.dragged_by(PointerButton::Primary) {
            new = tool.drag(&polygons, p);
        }
        if response.clicked_by(PointerButton::Primary) {
            new = tool.click(&polygons, p, reach);
        }
        if response.clicked_by(PointerButton::Secondary) && tool.open.is_empty() {
            new = tool.remove(&polygons, p, reach);
        }
    }
    let held = tool.holds();
    if response.drag_stopped() {
        tool.release();
        session.settle();
    }
    let (enter, back, escape) = ui.input(|i| {
        (i.key_pressed(egui::Key::Enter), i.key_pressed(egui::Key::Backspace), i.key_pressed(egui::Key::Escape))
    });
    if enter {
        new = new.or_else(|| tool.close(&polygons));
    }
    let leave = escape && tool.open.is_empty();
    if back {
        tool.back();
    }
    if escape {
        tool.open.clear();
    }
    if let Some(new) = new {
        session.set_polygons(&new);
        if !held {
            session.settle();
        }
    }
    viewer.mask = (!leave).then_some(tool);
    held
}

fn draw_tool(tool: &MaskTool, viewer: &Viewer, painter: &Painter, stage: &Stage<'_>, ui: &Ui) {
    let stroke = Stroke::new(2.0, theme::TRUTH);
    for corner in viewer.session.iter().flat_map(|s| s.polygons()).flatten() {
        painter.extend(stage.screen(corner).map(|p| Shape::circle_filled(p, 4.5, theme::TRUTH)));
    }
    let mut line: Vec<Pos2> = tool.open.iter().filter_map(|p| stage.screen(*p)).collect();
    painter.extend(line.iter().map(|p| Shape::circle_filled(*p, 4.5, theme::TRUTH)));
    if !line.is_empty() {
        line.extend(ui.ctx().pointer_hover_pos());
    }
    painter.add(Shape::line(line, stroke));
    let text = "Mask: click corners, close on the first one or with Enter. Drag a corner to move it; right-click removes a corner or an area. Backspace: one corner back. Esc: done.";
    let rect = painter.clip_rect();
    label(painter, rect.center_top() + vec2(0.0, 10.0), Align2::CENTER_TOP, text);
}

pub(super) fn toggle_mask(viewer: &mut Viewer) {
    viewer.mask = match viewer.mask.take() {
        Some(_) => None,
        None if viewer.session.is_some() => Some(MaskTool::default()),
        None => None,
    };
}

/// Zoom by key or menu, about the middle of the window.
pub(super) fn zoom(viewer: &mut Viewer, command: Command, ctx: &egui::Context) {
    let Some(size) = viewer.sight.as_ref().and_then(size_of) else { return };
    let rect = ctx.content_rect();
    let area = area(rect);
    match command {
        Command::Fit => viewer.view = View::FIT,
        Command::Actual => viewer.view.set_scale(area, size, 1.0 / f64::from(ctx.pixels_per_point())),
        _ => {
            let factor = if command == Command::ZoomIn { 1.5 } else { 1.0 / 1.5 };
            let middle = rect.center();
            viewer.view.zoom(area, size, [middle.x.into(), middle.y.into()], factor);
        }
    }
}

fn overlays(viewer: &Viewer, painter: &Painter, sight: &Sight, outcome: &Outcome, stage: &Stage<'_>) {
    let on = |layer| viewer.settings.shows(layer);
    if on(Layer::Mask) {
        for polygon in &outcome.config.mask.polygons_px {
            let outline: Vec<Pos2> = polygon.iter().filter_map(|p| stage.screen(*p)).collect();
            hatch(painter, &outline);
        }
    }
    if on(Layer::Circle)
        && let Some((centre, a, b)) = stage.camera.and_then(|c| c.image_circle_px())
        && stage.plane == Plane::Camera
    {
        let at = |i: usize| {
            let (s, c) = (i as f64 * std::f64::consts::TAU / 256.0).sin_cos();
            stage.screen([centre.u + a * c, centre.v + b * s])
        };
        painter.add(Shape::dashed_line(
            &(0..=256).filter_map(at).collect::<Vec<_>>(),
            Stroke::new(1.5, theme::CIRCLE),
            7.0,
            5.0,
        ));
    }
    for answer in &outcome.bodies {
        body(viewer, painter, answer, stage);
    }
    if on(Layer::Truth) {
        for truth in viewer.truth.get(&sight.name).into_iter().flatten() {
            let (Some(camera), Some(axis)) = (stage.camera, truth.axis()) else { continue };
            let limb = hzn_cli::overlay::limb::lines(axis.xyz(), truth.half_angle_deg.to_radians(), camera);
            lines(painter, stage, &limb, Stroke::new(1.5, theme::TRUTH));
            if let Some(p) = camera.project(&axis).and_then(|p| stage.screen([p.u, p.v])) {
                cross(painter, p, 8.0, Stroke::new(1.5, theme::TRUTH));
            }
        }
    }
    if on(Layer::Sky) {
        for (name, at) in sky(viewer, sight, stage) {
            painter.circle_stroke(at, 11.0, Stroke::new(1.5, theme::SKY));
            painter.text(at + vec2(14.0, 0.0), Align2::LEFT_CENTER, name, FontId::proportional(12.0), theme::SKY);
        }
    }
}

/// Where Sun and Moon should be: from the time, the position and the attitude, or from frames.csv or the truth.
fn sky(viewer: &Viewer, sight: &Sight, stage: &Stage<'_>) -> Vec<(&'static str, Pos2)> {
    let Some(camera) = stage.camera else { return Vec::new() };
    let mut out = Vec::new();
    let mut add = |name, direction: Option<[f64; 3]>| {
        let found = direction.and_then(hzn_core::frames::UnitVec3::try_new).and_then(|d| camera.project(&d));
        if let Some(at) = found.and_then(|p| stage.screen([p.u, p.v])) {
            out.push((name, at));
        }
    };
    let truth = viewer.truth.get(&sight.name).and_then(|t| t.first());
    let given = sight.data.as_ref();
    let sun = given.and_then(|d| d.sun_camera).or_else(|| Some([truth?.sun_x?, truth?.sun_y?, truth?.sun_z?]));
    add("Sun", sun.or_else(|| from_ephemeris(given?, hzn_sim::ephemeris::sun)));
    let moon = truth.and_then(|t| Some([t.moon_x?, t.moon_y?, t.moon_z?]));
    add("Moon", moon.or_else(|| from_ephemeris(given?, hzn_sim::ephemeris::moon)));
    out
}

fn from_ephemeris(data: &hzn_calib::FrameData, place: impl Fn(f64) -> hzn_sim::ephemeris::Place) -> Option<[f64; 3]> {
    use hzn_core::frames::{Cam, Ecef, Rotation, UnitVec3};
    let turn = Rotation::<Cam, Ecef, f64>::assume_from_quaternion(data.camera_to_ecef_wxyz?)?.inverse();
    let seen = place(data.utc_s?).seen_from(data.position_km?.map(|km| km * 1e3));
    Some(turn.apply(&UnitVec3::try_new(seen.direction)?).xyz())
}

fn body(viewer: &Viewer, painter: &Painter, answer: &Answer, stage: &Stage<'_>) {
    let on = |layer| viewer.settings.shows(layer);
    let dot = (stage.scale() as f32 * 0.5).clamp(0.9, 5.0);
    if on(Layer::Edges) {
        for edge in &answer.edges {
            let pointed = viewer.pointed == Some(edge.candidate);
            let colour = theme::edge(edge.candidate);
            let radius = if pointed { dot + 1.6 } else { dot };
            let points = edge.border.iter().map(|p| [f64::from(p.x), f64::from(p.y)]);
            dots(painter, points.filter_map(|p| stage.screen(p)), radius, colour);
        }
    }
    if on(Layer::Limb) {
        // A dark line below keeps it visible on clouds.
        lines(painter, stage, &answer.limb, Stroke::new(6.0, Color32::from_black_alpha(120)));
        lines(painter, stage, &answer.limb, Stroke::new(3.4, theme::LIMB));
    }
    let points = |kept: bool| {
        answer.residuals.iter().filter(move |r| (r.weight > 0.0) == kept).filter_map(|r| stage.screen(r.at))
    };
    if on(Layer::Rejected) {
        dots(painter, points(false), dot + 0.6, theme::REJECTED);
    }
    if on(Layer::Inliers) {
        // Narrower than the limb's line, so that both are seen.
        dots(painter, points(true), dot, theme::INLIER);
    }
    let inside = |p: &Point| (0..2).all(|i| (-0.5..stage.size[i] - 0.5).contains(&p[i]));
    if on(Layer::Axis) && answer.axis.filter(inside).is_none() {
        arrow(painter, stage, answer);
    }
    if on(Layer::Axis)
        && let Some(at) = answer.axis.filter(inside).and_then(|p| stage.screen(p))
    {
        cross(painter, at, 13.0, Stroke::new(4.0, Color32::from_black_alpha(140)));
        cross(painter, at, 12.0, Stroke::new(2.0, theme::AXIS));
        let outline: Vec<Pos2> = answer.ellipse.iter().filter_map(|p| stage.screen(*p)).collect();
        if outline.len() > 2 {
            painter.add(Shape::closed_line(outline, Stroke::new(1.5, theme::AXIS)));
        }
    }
}

/// An axis that is not in the picture: an arrow at its border, towards it.
fn arrow(painter: &Painter, stage: &Stage<'_>, answer: &Answer) {
    let (Some(s), Some(camera)) = (answer.solution(), stage.camera) else { return };
    let [x, y, _] = s.axis.xyz();
    let length = x.hypot(y);
    if length < 1e-9 {
        return;
    }
    let way = vec2((x / length) as f32, (y / length) as f32);
    let centre = camera.principal_point();
    let from = stage.place([centre.u, centre.v]);
    let frame = painter.clip_rect().shrink(16.0).intersect(Rect::from_min_max(
        stage.place([-0.5, -0.5]),
        stage.place([stage.size[0] - 0.5, stage.size[1] - 0.5]),
    ));
    // As far as the frame lets it go.
    let far = |at: f32, way: f32, low: f32, high: f32| if way > 0.0 { (high - at) / way } else { (low - at) / way };
    let reach = [far(from.x, way.x, frame.left(), frame.right()), far(from.y, way.y, frame.top(), frame.bottom())];
    let reach = reach.into_iter().filter(|r| r.is_finite()).fold(f32::INFINITY, f32::min);
    if !(reach > 0.0 && reach.is_finite()) {
        return;
    }
    let tip = from + way * (reach - 6.0);
    let (back, side) = (tip - way * 22.0, vec2(-way.y, way.x) * 5.5);
    let head = vec![tip, tip - way * 10.0 + side, tip - way * 10.0 - side];
    painter.line_segment([back, tip - way * 8.0], Stroke::new(5.0, Color32::from_black_alpha(150)));
    painter.line_segment([back, tip - way * 8.0], Stroke::new(2.5, theme::AXIS));
    painter.add(Shape::convex_polygon(head, theme::AXIS, Stroke::new(1.0, Color32::from_black_alpha(150))));
    let degrees = s.axis.xyz()[2].clamp(-1.0, 1.0).acos().to_degrees();
    let text = format!("axis, {degrees:.1}° off the optical axis");
    let galley = painter.layout_no_wrap(text, FontId::proportional(12.0), theme::AXIS);
    // Behind the arrow, on the side that it comes from.
    let align = match way {
        w if w.x > 0.4 => Align2::RIGHT_CENTER,
        w if w.x < -0.4 => Align2::LEFT_CENTER,
        w if w.y > 0.0 => Align2::CENTER_BOTTOM,
        _ => Align2::CENTER_TOP,
    };
    let rect = align.anchor_size(back - way * 8.0, galley.size() + vec2(10.0, 4.0));
    let inward = |low: f32, high: f32, min: f32, max: f32| (min - low).max(0.0) - (high - max).max(0.0);
    let rect = rect.translate(vec2(
        inward(rect.left(), rect.right(), frame.left(), frame.right()),
        inward(rect.top(), rect.bottom(), frame.top(), frame.bottom()),
    ));
    painter.rect_filled(rect, 4, Color32::from_black_alpha(170));
    painter.galley(rect.min + vec2(5.0, 2.0), galley, theme::AXIS);
}

fn cross(painter: &Painter, at: Pos2, arm: f32, stroke: Stroke) {
    painter.line_segment([at - vec2(arm, 0.0), at + vec2(arm, 0.0)], stroke);
    painter.line_segment([at - vec2(0.0, arm), at + vec2(0.0, arm)], stroke);
}

fn lines(painter: &Painter, stage: &Stage<'_>, lines: &[Vec<Point>], stroke: Stroke) {
    for line in lines {
        // A point that the plane does not show ends the line.
        for part in line.split(|p| stage.screen(*p).is_none()) {
            painter.add(Shape::line(part.iter().filter_map(|p| stage.screen(*p)).collect(), stroke));
        }
    }
}

/// Thousands of points as one mesh of squares.
fn dots(painter: &Painter, points: impl Iterator<Item = Pos2>, radius: f32, colour: Color32) {
    let clip = painter.clip_rect().expand(radius);
    let mut mesh = Mesh::default();
    for p in points.filter(|p| clip.contains(*p)) {
        mesh.add_colored_rect(Rect::from_center_size(p, Vec2::splat(2.0 * radius)), colour);
    }
    painter.add(mesh);
}

/// A masked area: its outline, and lines across it.
fn hatch(painter: &Painter, outline: &[Pos2]) {
    if outline.len() < 3 {
        return;
    }
    let stroke = Stroke::new(1.0, theme::MASK);
    let bounds = Rect::from_points(outline).intersect(painter.clip_rect());
    let polygon: Vec<Point> = outline.iter().map(|p| [p.x.into(), p.y.into()]).collect();
    let mut y = (bounds.top() - bounds.width()).floor() - (bounds.top() - bounds.width()).floor() % 9.0;
    while y < bounds.bottom() {
        // Along a falling diagonal, the parts that are inside.
        let steps = (bounds.width() / 2.0).max(1.0) as usize;
        let mut from: Option<Pos2> = None;
        for i in 0..=steps {
            let p = pos2(bounds.left() + 2.0 * i as f32, y + 2.0 * i as f32);
            let inside = bounds.contains(p) && crate::model::mask::inside(&polygon, [p.x.into(), p.y.into()]);
            match (inside, from) {
                (true, None) => from = Some(p),
                (false, Some(start)) => {
                    painter.line_segment([start, p], stroke);
                    from = None;
                }
                (true, Some(start)) if i == steps => {
                    painter.line_segment([start, p], stroke);
                }
                _ => {}
            }
        }
        y += 9.0;
    }
    painter.add(Shape::closed_line(outline.to_vec(), Stroke::new(1.5, theme::MASK)));
}

/// Values of single pixels, when they are large enough.
fn values(painter: &Painter, sight: &Sight, stage: &Stage<'_>, rect: Rect) {
    let (Ok(picture), Plane::Camera) = (&sight.picture, &stage.plane) else { return };
    if stage.scale() < VALUES_FROM {
        return;
    }
    let channel = sight.answers.first().map_or(Default::default(), |o| o.config.input.channel);
    let (Some(a), Some(b)) = (stage.picture(rect.min), stage.picture(rect.max)) else { return };
    for y in (a[1].round().max(0.0) as u16)..=(b[1].round().clamp(0.0, stage.size[1] - 1.0) as u16) {
        for x in (a[0].round().max(0.0) as u16)..=(b[0].round().clamp(0.0, stage.size[0] - 1.0) as u16) {
            let Some((value, _)) = paint::read(picture, channel, x, y) else { continue };
            let bright = f64::from(value) > 0.5 * f64::from((1u32 << picture.layout.bits) - 1);
            let colour = if bright { Color32::from_black_alpha(200) } else { Color32::from_white_alpha(170) };
            let at = stage.place([f64::from(x), f64::from(y)]);
            painter.text(at, Align2::CENTER_CENTER, value.to_string(), FontId::monospace(11.0), colour);
        }
    }
}

/// What is under the pointer.
fn read_out(sight: &Sight, outcome: Option<&Outcome>, body: usize, stage: &Stage<'_>, at: Pos2) -> Option<String> {
    let p = stage.picture(at)?;
    let (x, y) = (p[0].round(), p[1].round());
    if !(0.0..stage.size[0]).contains(&x) || !(0.0..stage.size[1]).contains(&y) {
        return None;
    }
    let picture = sight.picture.as_ref().ok()?;
    let channel = outcome.map_or(Default::default(), |o| o.config.input.channel);
    let (value, samples) = paint::read(picture, channel, x as u16, y as u16)?;
    let mut text = format!("({x:.0}, {y:.0})   {value}");
    if samples.len() > 1 {
        let each: Vec<String> = samples.iter().map(u16::to_string).collect();
        text += &format!(" of ({})", each.join(", "));
    }
    let ray = stage.camera.and_then(|c| c.unproject(ImagePoint { u: p[0], v: p[1] }));
    let Some([rx, ry, rz]) = ray.map(|r| r.xyz()) else {
        return Some(text + if stage.camera.is_some() { "   outside of the image circle" } else { "" });
    };
    text += &format!("   ray ({rx:.4}, {ry:.4}, {rz:.4})   {:.3}° off axis", rz.clamp(-1.0, 1.0).acos().to_degrees());
    if let Some(s) = outcome.and_then(|o| o.bodies.get(body)).and_then(Answer::solution) {
        let angle = rows::angle_deg([rx, ry, rz], s.axis.xyz());
        let beyond = angle - s.fused_half_angle_rad.to_degrees();
        let side = if beyond > 0.0 { "outside of" } else { "inside" };
        text += &format!("   {angle:.3}° from the body's axis, {:.3}° {side} the limb", beyond.abs());
    }
    Some(text)
}

/// A line of text that can be read on any picture.
fn label(painter: &Painter, at: Pos2, align: Align2, text: &str) {
    let width = painter.clip_rect().width() - 30.0;
    let galley = painter.layout(text.to_owned(), FontId::proportional(12.5), Color32::from_rgb(236, 238, 242), width);
    let rect = align.anchor_size(at, galley.size() + vec2(14.0, 8.0));
    painter.rect_filled(rect, 5, Color32::from_black_alpha(190));
    painter.galley(rect.min + vec2(7.0, 4.0), galley, Color32::WHITE);
}

/// Something that is wrong with what is shown, across its middle.
fn notice(painter: &Painter, rect: Rect, text: &str, colour: Color32) {
    let galley = painter.layout(text.to_owned(), FontId::proportional(14.0), colour, (rect.width() - 60.0).min(640.0));
    let place = Align2::CENTER_CENTER.anchor_size(rect.center(), galley.size() + vec2(24.0, 16.0));
    painter.rect_filled(place, 6, Color32::from_black_alpha(210));
    painter.galley(place.min + vec2(12.0, 8.0), galley, colour);
}
