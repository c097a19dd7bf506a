//! The keys of all sections together, and the same keys by their numbers in flight. A number in flight identifies a
//! parameter of the flight computer.

use super::{Config, Input, Mount, retry, track};
use crate::base::keys::{Section, Table};
use crate::geometry::camera;
use crate::image::region;
use crate::model::threshold::Brightness;
use crate::model::{body, edge_noise, threshold, work};
use crate::stages::{consensus, contour, edge_points, fit, gates};

/// Lists every section: its field in [`Config`], and its type.
macro_rules! sections {
    ($($field:ident: $section:ty),+ $(,)?) => {
        /// The sections of sensor.toml with their keys.
        // `[mount]` stands apart because it has no default: a sensor without a mount has no section to read or write.
        pub const SECTIONS: &[Table] = &[$(<$section>::TABLE),+, Mount::TABLE];

        impl Config {
            /// Returns the key of a number in flight, for example `consensus.threshold_px` for 81.
            // The sections are asked one after the other, because one table of all numbers would have to be kept equal
            // to them by hand.
            pub fn path(id: u16) -> Option<&'static str> {
                $(
                    if let Some(path) = <$section>::path(id) {
                        return Some(path);
                    }
                )+
                Mount::path(id)
            }

            /// Returns the numbers in flight of all keys that have one, in the order in which they must be set.
            pub fn numbers() -> impl Iterator<Item = u16> {
                const SECTIONS: &[&[(Option<u16>, u16)]] = &[$(<$section>::NUMBERS),+, Mount::NUMBERS];
                let keys = SECTIONS.iter().copied().flatten();
                keys.filter_map(|(first, count)| first.map(|first| first..first + count)).flatten()
            }

            /// Returns the value of the key with a number in flight: NaN for a value that is left out, `None` for a
            /// number that no key has.
            pub fn number(&self, id: u16) -> Option<f64> {
                $(
                    if let Some(number) = self.$field.number(id) {
                        return Some(number);
                    }
                )+
                Mount::path(id)?;
                Some(self.mount.as_ref().and_then(|mount| mount.number(id)).unwrap_or(f64::NAN))
            }

            /// Sets the value of the key with a number in flight. Returns `None` for a number that no key has,
            /// `Some(false)` for a value that its key cannot have. [`Config::check`] checks whether the values agree
            /// with each other.
            pub fn set_number(&mut self, id: u16, number: f64) -> Option<bool> {
                $(
                    if let Some(taken) = self.$field.set_number(id, number) {
                        return Some(taken);
                    }
                )+
                Mount::path(id)?;
                // NaN unsets the mount, because a flight computer stores NaN for every number of a key that is left
                // out.
                if number.is_nan() {
                    self.mount = None;
                    return Some(true);
                }
                // The four numbers arrive one by one. The zeros are no rotation, so that [`Config::check`] refuses a
                // mount that was set only in part.
                self.mount.get_or_insert(Mount { q_vehicle_from_camera_wxyz: [0.0; 4] }).set_number(id, number)
            }

            /// Returns the first key without a number in flight whose value differs from that of `other`.
            pub fn differing_on_ground(&self, other: &Self) -> Option<&'static str> {
                $(
                    if let Some(path) = self.$field.differing_on_ground(&other.$field) {
                        return Some(path);
                    }
                )+
                (self.bodies != other.bodies).then_some("bodies")
            }
        }
    };
}

sections! {
    camera: camera::Config,
    body: body::Config,
    input: Input,
    brightness: Brightness,
    threshold: threshold::Config,
    mask: region::Config,
    contour: contour::Config,
    edge_points: edge_points::Config,
    consensus: consensus::Config,
    fit: fit::Config,
    covariance: edge_noise::Config,
    gates: gates::Config,
    retry: retry::Config,
    track: track::Config,
    limits: work::Config,
}
