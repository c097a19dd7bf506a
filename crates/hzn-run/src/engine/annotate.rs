//! The drawing of what the pipeline found in a picture.

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_mcap::Annotations;

use super::trace::Trace;
use crate::overlay;

/// Returns the drawing for a picture: the edges, the points of the chosen edge, and the fitted limb. Coordinates are in
/// pixels.
pub fn annotate(trace: &Trace, solution: Option<&Solution<f64>>, camera: &Camera<f64>) -> Annotations {
    let mut out = Annotations::default();
    for edge in trace.edges().iter() {
        out.edges.push(edge.border.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect());
        if solution.is_some_and(|s| s.candidate == edge.candidate) {
            for (point, weight) in edge.points.iter().zip(&edge.weights) {
                if *weight > 0.0 { out.inliers.push(*point) } else { out.rejected.push(*point) }
            }
        }
    }
    if let Some(s) = solution {
        out.add(overlay::draw_limb(s, camera));
    }
    out
}
