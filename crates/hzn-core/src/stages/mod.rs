//! The stages, in the order of the data's way. A stage knows those before it.

pub mod threshold;

pub mod contour;

pub mod edge_points;

pub(crate) mod rays;

pub mod consensus;

pub mod fit;

pub mod covariance;

pub mod gates;
