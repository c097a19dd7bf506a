//! The places of the errors that last the whole flight.
//!
//! The filter has places for all of them but those of the lenses: it takes the lens as a part of each direction's
//! covariance, because an error of a lens shows only over the whole picture and the whole flight.

use hzn_nav::layout::{Layout, Place};
use hzn_nav::options::{CameraOptions, Options};

/// Places of the unknowns of a lens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LensPlaces {
    /// The focal length.
    pub focal: Option<Place>,
    /// The principal point: x and y.
    pub centre: Option<Place>,
}

impl LensPlaces {
    /// Returns the places with the number of the first parameter of each: focal length, principal point x and y.
    pub(super) fn each(self) -> impl Iterator<Item = (usize, Place)> {
        [(0, self.focal), (1, self.centre)].into_iter().filter_map(|(first, place)| Some((first, place?)))
    }
}

/// Places of all unknowns. The first ones are those of the filter.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// Those of the filter. The length counts the lenses, too.
    pub filter: Layout,
    /// The lenses, in the order of the cameras.
    pub lenses: Vec<LensPlaces>,
}

impl Places {
    /// Returns the places of all errors with a sigma above 0. `lenses` says for each camera whether its focal length
    /// and its principal point are unknown.
    pub(super) fn new(options: &Options, cameras: &[CameraOptions], lenses: &[[bool; 2]]) -> Self {
        let mut filter = Layout::new(options, cameras);
        let mut place = |is_unknown: bool, len: usize| {
            let place = Place { first: filter.len, len, considered: false };
            is_unknown.then(|| {
                filter.len += len;
                place
            })
        };
        let lenses =
            lenses.iter().map(|[focal, centre]| LensPlaces { focal: place(*focal, 1), centre: place(*centre, 2) });
        let lenses = lenses.collect();
        Self { filter, lenses }
    }

    /// Returns the number of unknowns that last the whole flight.
    pub fn shared(&self) -> usize {
        self.filter.len - Layout::VEHICLE
    }
}
