//! The strapdown solution without any aid, with its covariance: a filter that takes no measurement.

use hzn_nav::filter::Filter;
use hzn_nav::frames::{Covariance, Fixed};
use hzn_nav::options::{Block, Options};
use hzn_nav::strapdown::Nominal;

use crate::error::Error;

/// Components of its error: state, biases, scales and axes of the inertial unit.
pub(super) const UNAIDED: usize = 27;

/// Returns a filter that integrates the inertial unit from the first state on, with the errors of the unit alone.
pub(super) fn unaided(
    first: &Nominal,
    options: &Options,
    covariance_rad2: &Covariance<Fixed>,
) -> Result<Filter<UNAIDED>, Error> {
    let options = Options { limb_height: Block::OFF, limb_latitude: Block::OFF, ..*options };
    let mut filter = Filter::<UNAIDED>::new(*first, &options, &[]).map_err(Error::unusable)?;
    filter.set_attitude(&first.attitude, covariance_rad2);
    Ok(filter)
}
