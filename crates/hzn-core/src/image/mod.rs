//! The input picture. It is checked once; after that no read can fail.
//!
//! A picture is a borrowed slice of 8- or 16-bit samples, grey or interleaved colour, with any row stride. The pipeline
//! is generic over [`Pixels`]. Each kind of picture gets its own compiled copy, and a flight computer links only the
//! one that it uses.

mod colour;
mod cropped;
mod grey;
mod indirect;
mod layout;
mod pixels;
mod profile;
pub mod region;
mod sample;
#[cfg(test)]
mod tests;
mod view;

pub use colour::{Channel, Colour};
pub(crate) use cropped::Cropped;
pub use grey::Grey;
pub use indirect::Indirect;
pub use layout::{ImageError, Layout};
pub use pixels::{Pixels, StreamedPoint};
pub(crate) use profile::{Profile, Profiles};
pub use sample::Sample;
pub use view::ImageView;
