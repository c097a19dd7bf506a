//! Lazy border following: a pixel is compared with the level only when the search or the follower touches it.
//!
//! Edges begin at the border of the region, where dark turns to lit; they are followed until they leave the picture. Edges that close on themselves are found on horizontal search lines. So the cost grows
//! with the length of the edges, not with the number of pixels.

#[cfg(feature = "horace")]
pub(crate) mod erode;
mod follow;
mod frame;
mod marks;
#[cfg(any(feature = "horace", feature = "zju"))]
mod order;
#[cfg(feature = "horace")]
pub(crate) mod raster;
mod search;
#[cfg(feature = "zju")]
pub(crate) mod sobel;
mod thinned;

pub(crate) use follow::{BinaryPicture, End};
pub(crate) use marks::Marks;
pub(crate) use thinned::Thinned;

use crate::base::error::{ConfigError, Limit, require};

/// How edges are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// From the border of the picture and from search lines along the edges; no pixel is looked at without need.
    #[default]
    BorderFollowing,
    /// Every outer border, pixel by pixel and row by row (Suzuki & Abe 1985, algorithm 2).
    #[cfg(feature = "horace")]
    Raster,
    /// Every lit pixel with too few lit ones around it, whatever it belongs to (Barf 2014, 2.2.3).
    #[cfg(feature = "horace")]
    Erode,
    /// Every pixel with a large gradient, whatever it belongs to (Wang et al. 2022, 2.1).
    #[cfg(feature = "zju")]
    Sobel,
}

/// `[contour]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// How edges are found.
    pub method: Method,
    /// Rows between two search lines for closed edges, 1 or more. Left out: from the body's expected size.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub line_spacing_px: Option<u16>,
    /// For `erode`: side of the square neighbourhood in pixels, odd, 3 to 31.
    #[cfg(feature = "horace")]
    pub erode_size_px: u16,
    /// For `erode`: a lit pixel with fewer lit ones in its neighbourhood, itself counted, is edge; 1 to the square of
    /// the size.
    #[cfg(feature = "horace")]
    pub erode_threshold: u16,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            method: Method::BorderFollowing,
            line_spacing_px: None,
            #[cfg(feature = "horace")]
            erode_size_px: 3,
            #[cfg(feature = "horace")]
            erode_threshold: 9,
        }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        if let Some(n) = self.line_spacing_px {
            require(n >= 1, "contour.line_spacing_px", f64::from(n), Limit::AtLeast(1.0))?;
        }
        #[cfg(feature = "horace")]
        {
            let (size, least) = (f64::from(self.erode_size_px), f64::from(self.erode_threshold));
            let odd = (3..=31).contains(&self.erode_size_px) && self.erode_size_px % 2 == 1;
            require(odd, "contour.erode_size_px", size, Limit::Rule("must be an odd number from 3 to 31"))?;
            require(
                least >= 1.0 && least <= size * size,
                "contour.erode_threshold",
                least,
                Limit::Between(1.0, size * size),
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
