//! The navigation filter in orbit: a tumbling satellite that passes through eclipse, and an infrared sensor whose limb
//! height changes with the latitude.

mod infrared;
mod tumble;
mod vehicle;

use super::setup::Effort;
use crate::section::Section;

pub(super) fn navigation(effort: &Effort) -> anyhow::Result<Section> {
    let mut section = Section::default();
    tumble::study(effort, &mut section)?;
    infrared::study(effort, &mut section)?;
    Ok(section)
}
