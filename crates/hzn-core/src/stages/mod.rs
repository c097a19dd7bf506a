//! The stages, in the order in which data pass through them. A stage imports only earlier stages.

pub mod threshold;

pub mod contour;

pub mod edge_points;

pub(crate) mod rays;

pub mod consensus;

pub mod fit;

pub mod covariance;

pub mod gates;
