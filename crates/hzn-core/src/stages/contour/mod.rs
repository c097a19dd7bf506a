//! Lazy border following: a pixel is compared with the threshold only when the search or the follower reads it.
//!
//! Edges begin at the border of the region, where dark turns to lit, and are followed until they leave the picture.
//! Closed edges are found on horizontal search lines. The cost therefore grows with the length of the edges, and not
//! with the number of pixels.

pub(crate) mod erode;
mod follow;
mod frame;
mod marks;
mod order;
pub(crate) mod raster;
mod search;
pub(crate) mod sobel;
mod thinned;

pub(crate) use follow::{BinaryPicture, End};
pub(crate) use marks::Marks;
pub(crate) use search::Ranked;
pub(crate) use thinned::Thinned;

use crate::base::error::{ConfigError, Limit, require};
use crate::base::keys::{Section, choices, section};

choices! {
    /// How edges are found.
    pub enum Method {
        /// Edges are followed from the border of the picture and from search lines; no pixel is read without need.
        @- BorderFollowing = "border-following";
        /// Every outer border is followed, pixel by pixel and row by row (Suzuki & Abe 1985, algorithm 2).
        @- Raster = "raster" needs "horace";
        /// Every lit pixel with too few lit ones around it is an edge pixel, whatever it belongs to (Barf 2014, 2.2.3).
        @- Erode = "erode" needs "horace";
        /// Every pixel with a large gradient is an edge pixel, whatever it belongs to (Wang et al. 2022, 2.1).
        @- Sobel = "sobel" needs "zju";
    }
}

section! {
    /// `[contour]` of sensor.toml: the search for edges.
    "contour" pub struct Config: Copy {
        /// How edges are found.
        @- method: Method = Method::BorderFollowing, [choice];
        /// Rows between two search lines for edges that do not touch the border of the picture, px.
        ///
        /// A smaller spacing finds smaller bodies and takes more time.
        @60 line_spacing_px: Option<u16> = None, [1.0 or more] { unset: "from the body's expected size", example: "8" };
        /// For `erode`: side of the square neighbourhood, px.
        @- erode_size_px: u16 = 3, ["odd, 3 to 31"] { needs: "horace" };
        /// For `erode`: a lit pixel with fewer lit pixels in its neighbourhood, itself included, is an edge pixel.
        // With 9 of 3×3 pixels, every lit pixel with a dark neighbour is an edge pixel.
        @- erode_threshold: u16 = 9, ["1 to the square of `erode_size_px`"] { needs: "horace" };
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.check_keys()?;
        let (size, threshold) = (f64::from(self.erode_size_px), f64::from(self.erode_threshold));
        // An even square has no pixel in its middle.
        let odd = (3..=31).contains(&self.erode_size_px) && self.erode_size_px % 2 == 1;
        require(odd, "contour.erode_size_px", size, Limit::Rule("must be an odd number from 3 to 31"))?;
        let limit = Limit::Between(1.0, size * size);
        require(threshold >= 1.0 && threshold <= size * size, "contour.erode_threshold", threshold, limit)
    }
}

#[cfg(test)]
mod tests;
