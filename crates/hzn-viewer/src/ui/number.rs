//! Fields for numbers: all of them read a decimal comma, and say so if they cannot read a text.

use egui::{Context, DragValue, Id, Key, Response, Slider, Ui};

/// Returns the number of a text. A decimal comma counts as a point, and spaces divide thousands. `None` if the text is
/// no number, or if it has points and commas: `1.234,5` and `1,234.5` have opposite meanings in different countries.
fn parse(text: &str) -> Option<f64> {
    let plain: String = text
        .chars()
        .filter(|c| !c.is_whitespace())
        .map(|c| match c {
            '−' => '-',
            ',' => '.',
            c => c,
        })
        .collect();
    // Two separators are no number, so `parse` refuses them.
    plain.parse().ok().filter(|x: &f64| x.is_finite())
}

/// The text that a field could not read, and the field. The text is empty if the field could read it.
#[derive(Clone, Default)]
struct Typed {
    text: String,
    field: Option<Id>,
}

/// The key of [`Typed`] in the memory of the window.
fn typed() -> Id {
    Id::unique("typed number")
}

/// Reads a text for a field, and remembers it if it is no number. A field calls this after each letter, and once more
/// when it has lost the focus.
fn keep(ctx: &Context, text: &str) -> Option<f64> {
    let number = parse(text);
    let focused = ctx.memory(egui::Memory::focused);
    ctx.data_mut(|data| {
        let field = data.remove_temp::<Typed>(typed()).map_or(focused, |before| before.field);
        let text = if number.is_none() { text.trim().to_owned() } else { String::new() };
        data.insert_temp(typed(), Typed { text, field });
    });
    number
}

/// Adds a field for a number.
pub(super) fn drag(ui: &mut Ui, field: DragValue<'_>) -> Response {
    let ctx = ui.ctx().clone();
    ui.add(field.custom_parser(|text| keep(&ctx, text)))
}

/// Adds a slider with a field for its number.
pub(super) fn slide(ui: &mut Ui, slider: Slider<'_>) -> Response {
    let ctx = ui.ctx().clone();
    ui.add(slider.custom_parser(|text| keep(&ctx, text)))
}

/// Returns the text that the user left in a field, if it is no number. The field keeps its value then.
pub(super) fn take_unread(ctx: &Context) -> Option<String> {
    let focused = ctx.memory(egui::Memory::focused);
    let cancelled = ctx.input(|i| i.key_pressed(Key::Escape));
    let left = ctx.data_mut(|data| {
        let is_left = data.get_temp::<Typed>(typed()).is_some_and(|t| t.field != focused);
        is_left.then(|| data.remove_temp::<Typed>(typed())).flatten()
    });
    left.map(|t| t.text).filter(|text| !text.is_empty() && !cancelled)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_comma_is_a_decimal_point() {
        let read = ["88,5", "88.5", " 1 234,5", "−3,25", "1e-3", "7,"].map(parse);
        assert_eq!(read, [88.5, 88.5, 1234.5, -3.25, 1e-3, 7.0].map(Some));
    }

    #[test]
    fn a_text_with_two_meanings_is_refused() {
        assert_eq!(["1.234,5", "1,234.5", "1,2,3", "", "nan", "inf", "8 km"].map(parse), [None; 7]);
    }
}
