//! The camera: focal lengths that are linked, and the image circle.

use egui::Ui;

use super::picture;
use super::viewer::Viewer;
use crate::model::Session;

/// Draws the switch that links both focal lengths, and the tool of the image circle.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let hint = "A change of fx_px or fy_px changes the other one by the same factor, so that pixels keep their shape";
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut viewer.linked_focal, "Link fx and fy").on_hover_text(hint);
        let dragging = viewer.circle.is_some();
        if ui.selectable_label(dragging, if dragging { "Done" } else { "Drag the image circle" }).clicked() {
            viewer.toggle_circle();
        }
        if let Some(session) = &mut viewer.session
            && session.number("camera", "theta_max_deg", 0).is_some()
            && ui.button("No image circle").on_hover_text("Removes camera.theta_max_deg").clicked()
        {
            picture::remove_circle(session);
        }
    });
}

/// Changes a focal length and, if they are linked, the other one by the same factor. Both are one step.
pub(super) fn set_focal(session: &mut Session, name: &str, value: f64, linked: bool) {
    let other = if name == "fx_px" { "fy_px" } else { "fx_px" };
    let before = session.number("camera", name, 0).filter(|x| *x > 0.0);
    let pair = linked.then(|| session.number("camera", other, 0)).flatten().zip(before);
    let Some((other_value, before)) = pair else {
        return session.set("camera", name, 0, Some(Session::tidy_value(value)));
    };
    let factor = value / before;
    session.set_gesture(
        "camera.focal",
        &[
            ("camera", name, Some(Session::tidy_value(value))),
            ("camera", other, Some(Session::tidy_value(other_value * factor))),
        ],
    );
}

/// Fits the camera to pictures of another size of the same field of view: focal lengths and centre are scaled.
pub(super) fn scale_to(session: &mut Session, [width, height]: [u32; 2]) {
    let number = |name| session.number("camera", name, 0).filter(|x| *x > 0.0);
    let (Some(w), Some(h)) = (number("width"), number("height")) else { return };
    let (sx, sy) = (f64::from(width) / w, f64::from(height) / h);
    let mut values = vec![
        ("camera", "width", Some((i64::from(width)).into())),
        ("camera", "height", Some((i64::from(height)).into())),
    ];
    // Pixel centres are at integers, so the border of the picture is at -0.5.
    let scaled = [
        ("fx_px", number("fx_px").map(|f| f * sx)),
        ("fy_px", number("fy_px").map(|f| f * sy)),
        ("cx_px", session.number("camera", "cx_px", 0).map(|c| (c + 0.5) * sx - 0.5)),
        ("cy_px", session.number("camera", "cy_px", 0).map(|c| (c + 0.5) * sy - 0.5)),
    ];
    values.extend(scaled.into_iter().filter_map(|(name, x)| Some(("camera", name, Some(Session::tidy_value(x?))))));
    session.set_all(&values, 0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const CAMERA: &str = "[camera]\nwidth = 640\nheight = 480\nmodel = \"pinhole\"\nfx_px = 500.0\nfy_px = 510.0\n\
                          cx_px = 319.5\ncy_px = 239.5\n";

    fn session() -> Session {
        Session::new(CAMERA, Path::new("s.toml"), None)
    }

    fn numbers(s: &Session) -> Vec<f64> {
        ["width", "height", "fx_px", "fy_px", "cx_px", "cy_px"].map(|n| s.number("camera", n, 0).unwrap()).to_vec()
    }

    #[test]
    fn linked_focal_lengths_change_together_and_in_one_step() {
        let mut s = session();
        set_focal(&mut s, "fx_px", 550.0, true);
        set_focal(&mut s, "fx_px", 600.0, true);
        assert_eq!(numbers(&s)[2..4], [600.0, 612.0]);
        s.undo();
        assert_eq!(numbers(&s)[2..4], [500.0, 510.0]);
        set_focal(&mut s, "fy_px", 600.0, false);
        assert_eq!(numbers(&s)[2..4], [500.0, 600.0]);
    }

    #[test]
    fn a_camera_is_scaled_to_the_size_of_the_pictures() {
        let mut s = session();
        scale_to(&mut s, [320, 240]);
        assert_eq!(numbers(&s), [320.0, 240.0, 250.0, 255.0, 159.5, 119.5]);
        assert!(s.problem().is_none());
        s.undo();
        assert!(!s.is_changed(), "it is one step");
    }
}
