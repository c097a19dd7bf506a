//! The form about a chessboard, before its pictures are chosen.

use egui::{ComboBox, DragValue, Ui};
use hzn_calib::board::Board;
use hzn_core::camera::Model;

use super::number;

/// The answers of the user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BoardForm {
    pub(super) columns: u16,
    pub(super) rows: u16,
    pub(super) square_mm: f64,
    pub(super) model: Model,
}

impl BoardForm {
    /// Begins with the board of many kits, and with the model of the sensor if it has coefficients.
    pub(super) fn new(model: Model) -> Self {
        let is_bare = matches!(model, Model::Pinhole | Model::Equidistant);
        let model = if is_bare { Model::KannalaBrandt } else { model };
        Self { columns: 9, rows: 6, square_mm: 25.0, model }
    }
    pub(super) fn board(&self) -> Board {
        Board { columns: self.columns, rows: self.rows, square_mm: self.square_mm }
    }
    /// Draws the form; returns true if the pictures are to be chosen.
    pub(super) fn show(&mut self, ui: &mut Ui) -> bool {
        ui.weak(
            "Print a chessboard, fix it to something flat, and take 10 to 20 pictures of it, tilted in all directions.",
        );
        egui::Grid::new("board").num_columns(2).show(ui, |ui| {
            let mut corners = |name: &str, value: &mut u16| {
                let label = ui.label(name);
                number::drag(ui, DragValue::new(value).range(3..=100)).labelled_by(label.id);
                ui.end_row();
            };
            corners("inner corners along a row", &mut self.columns);
            corners("inner corners along a column", &mut self.rows);
            let label = ui.label("side of a square");
            number::drag(ui, DragValue::new(&mut self.square_mm).range(0.1..=1000.0).suffix(" mm"))
                .labelled_by(label.id);
            ui.end_row();
            ui.label("model of the lens");
            ComboBox::from_id_salt("board model").selected_text(self.model.name()).show_ui(ui, |ui| {
                for model in Model::ALL.iter().copied() {
                    ui.selectable_value(&mut self.model, model, model.name());
                }
            });
            ui.end_row();
        });
        ui.weak("Inner corners are one fewer than squares.");
        ui.button("Choose the board pictures…").clicked()
    }
}
