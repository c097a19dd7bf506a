//! The account that a picture's work is drawn on, by the methods that were chosen.

use crate::config::Config;
use crate::model::work::{POINT, WorkBudget};
use crate::stages::edge_points::SubPixel;

/// With all that a picture may cost, for lists that hold so many border pixels.
pub(super) fn open(config: &Config, pixels: usize) -> WorkBudget {
    WorkBudget::new(&config.limits, pixels, point(config.candidates.sub_pixel, 0))
}

/// What a sub-pixel point with its ray costs, where a look at the mask costs `mask`.
pub(super) fn point(method: SubPixel, mask: u32) -> u32 {
    // Beyond that of the default, and looks at the mask.
    let (more, looks) = match method {
        SubPixel::Linear | SubPixel::None => (0, 0),
        SubPixel::Zernike => (40, 70),
        SubPixel::Erf => (2000, 400),
    };
    POINT + more + looks * mask
}
