//! The plots that a sequence offers. Some quantities exist only in some sequences: a truth, positions, the third axis,
//! and the results of `hzn fuse`.

use super::residuals::RESIDUALS;
use super::sigma_parts::SIGMA_PARTS;
use crate::model::navigation::{INNOVATIONS, NAV_QUANTITIES};
use crate::model::quantity::{QUANTITIES, Quantity};
use crate::ui::offered::Offered;
use crate::ui::viewer::Viewer;

/// Returns the names of all plots of the sequence.
pub(super) fn names(viewer: &mut Viewer) -> Vec<&'static str> {
    let key = (viewer.rows.generation(), viewer.body, viewer.truth.is_empty());
    if viewer.offered.of != Some(key) {
        let has = |q: &&Quantity| !q.is_optional || has_value(viewer, q);
        let mut names: Vec<&str> = QUANTITIES.iter().filter(has).map(|q| q.name).collect();
        names.extend(viewer.rows.has_sigma_parts(viewer.body).then_some(SIGMA_PARTS));
        viewer.offered = Offered { of: Some(key), names };
    }
    let mut names = viewer.offered.names.clone();
    if let Some(nav) = &viewer.companions.navigation {
        names.extend(NAV_QUANTITIES.iter().map(|q| q.name));
        names.extend((!nav.innovations.is_empty()).then_some(INNOVATIONS));
    }
    names.push(RESIDUALS);
    names
}

fn has_value(viewer: &Viewer, quantity: &Quantity) -> bool {
    if quantity.name == "Error (truth)" {
        return !viewer.truth.is_empty();
    }
    let rows = (0..viewer.sequence.len()).filter_map(|i| viewer.rows.newest(i, viewer.body));
    rows.into_iter().any(|row| {
        let truth = viewer.truth_of(&row.file, &row.body);
        quantity.lines.iter().any(|(_, value_of)| value_of(row, truth).is_some())
    })
}
