//! Two half pictures that are taken one after the other and put together, as thermal arrays do.

use serde::{Deserialize, Serialize};

use crate::detector::Plane;
use crate::pose::Pose;

/// Pixels of the two half pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Like the fields of a chess board: neighbouring pixels are in different halves.
    Chess,
    /// Every other row.
    Rows,
}

/// A picture of two halves between which the camera turns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Halves {
    /// Pixels of the two halves. The pixel in the upper left corner is in the first half.
    pub order: Order,
    /// Time from the first half to the second, seconds. The pose of the picture is that in the middle between them.
    pub apart_s: f64,
    /// Rate of the camera relative to ECEF, in the camera frame, rad/s.
    pub rate_radps: [f64; 3],
}

impl Halves {
    /// Returns the poses of the first and of the second half.
    pub(crate) fn poses(&self, pose: &Pose) -> [Pose; 2] {
        [-0.5, 0.5].map(|part| pose.disturbed(self.rate_radps.map(|rate| rate * self.apart_s * part)))
    }

    /// Puts the light of the second half into the planes of the first one.
    pub(crate) fn interleave(&self, first: &mut [Plane], second: &[Plane]) {
        for (first, second) in first.iter_mut().zip(second) {
            let width = first.width.max(1);
            for (i, (light, later)) in first.data.iter_mut().zip(&second.data).enumerate() {
                let is_later = match self.order {
                    Order::Chess => (i % width + i / width) % 2 == 1,
                    Order::Rows => (i / width) % 2 == 1,
                };
                if is_later {
                    *light = *later;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_order_has_its_pixels() {
        let plane = |value| vec![Plane { width: 3, data: vec![value; 6] }];
        let mixed = |order| {
            let mut planes = plane(0.0);
            Halves { order, apart_s: 0.25, rate_radps: [0.0; 3] }.interleave(&mut planes, &plane(1.0));
            planes.remove(0).data
        };
        assert_eq!(mixed(Order::Chess), [0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
        assert_eq!(mixed(Order::Rows), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    }
}
