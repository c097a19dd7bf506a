//! The colours of heads and of what happens to them.

use egui::Color32;

use crate::ui::rig_view::Use;
use crate::ui::theme;

/// Colour of the fourth head.
const FOURTH: Color32 = Color32::from_rgb(160, 130, 240);

/// Returns the colour of a head, which is the same in all parts of the window.
pub(super) fn colour(n: usize, dark: bool) -> Color32 {
    // The lines of plots have three colours, and a rig has up to four heads.
    if n % 4 == 3 { FOURTH } else { theme::line(n % 4, dark) }
}

/// Returns the colour of what an epoch does with a head.
pub(super) fn use_colour(of: Use, dark: bool) -> Color32 {
    match of {
        Use::Used => theme::diff(true, dark),
        Use::Excluded => theme::diff(false, dark),
        Use::Alone => theme::warning(dark),
        Use::Nothing => Color32::GRAY,
    }
}
