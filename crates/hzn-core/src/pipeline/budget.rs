//! The work budget of a picture, which depends on the chosen methods.

use crate::config::Config;
use crate::model::work::{POINT, WorkBudget};
use crate::stages::edge_points::SubPixel;

/// Returns the whole work budget of a picture, for lists that hold `pixels` border pixels.
pub(super) fn new(config: &Config, pixels: usize) -> WorkBudget {
    WorkBudget::new(&config.limits, pixels, point_cost(config.edge_points.sub_pixel, 0))
}

/// Returns the cost of a sub-pixel point with its ray, in steps of the border follower. `mask` is the cost of one look
/// at the mask.
pub(super) fn point_cost(method: SubPixel, mask: u32) -> u32 {
    // The cost above that of the default method, and the number of looks at the mask.
    let (more, looks) = match method {
        SubPixel::Linear | SubPixel::None => (0, 0),
        SubPixel::Zernike => (40, 70),
        // A blurred step takes about 250 error functions a point, so it costs a hundred points of the default method.
        SubPixel::Erf => (2000, 400),
    };
    POINT + more + looks * mask
}
