//! One picture of a flight, as the calibration uses it.

use hzn_core::{Prior, Solution};

use crate::noise::WeightedPoints;

/// The edge points of one picture, with the prior of the picture and the answer where the fit starts.
#[derive(Debug, Clone)]
pub struct View {
    /// Name of the picture.
    pub name: String,
    /// Edge points (u, v) in pixels with their weights, in their order along the edge.
    pub points: WeightedPoints,
    /// Unit vector of the limb axis in the camera frame: the pipeline's answer.
    pub axis: [f64; 3],
    /// Half-angle of the limb in the pipeline's answer, in radians.
    pub half_angle_rad: f64,
    /// Altitude, position, attitude and rates of the picture.
    pub prior: Prior<f64>,
}

impl View {
    /// Creates a view from a picture's answer and its edge points.
    pub fn new(name: &str, points: WeightedPoints, prior: Prior<f64>, solution: &Solution<f64>) -> Self {
        Self {
            name: name.to_owned(),
            points,
            axis: solution.axis.xyz(),
            half_angle_rad: solution.half_angle_rad,
            prior,
        }
    }
}
