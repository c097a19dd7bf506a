//! The unknowns of an adjustment.

use nalgebra::{DVector, UnitQuaternion, Vector3};

/// The order of the errors that all windows share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shared {
    pub(super) cameras: usize,
}

impl Shared {
    pub(super) fn mount(self, camera: usize) -> usize {
        3 * camera
    }
    pub(super) fn clock(self, camera: usize) -> usize {
        3 * self.cameras + camera
    }
    /// Clock of all cameras together, s.
    pub(super) fn clocks(self) -> usize {
        4 * self.cameras
    }
    /// Rotation of the axes of the inertial unit, or of all mounts together, rad.
    pub(super) fn unit(self) -> usize {
        self.clocks() + 1
    }
    pub(super) fn bias(self) -> usize {
        self.clocks() + 4
    }
    pub(super) fn scale(self) -> usize {
        self.clocks() + 7
    }
    pub(super) fn height(self) -> usize {
        self.clocks() + 10
    }
    /// Time by which the UTC of the recordings is late, s.
    pub(super) fn utc(self) -> usize {
        self.clocks() + 11
    }
    pub(super) fn tracker(self) -> usize {
        self.clocks() + 12
    }
    /// The two coefficients of the limb height's change with the latitude, km.
    pub(super) fn latitude(self) -> usize {
        self.clocks() + 15
    }
    pub(super) fn len(self) -> usize {
        self.clocks() + 17
    }
}

/// Estimates of an adjustment.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// Rotations from the frame of the first sample to that of the references, one for each window.
    pub(super) windows: Vec<UnitQuaternion<f64>>,
    pub(super) shared: DVector<f64>,
}

/// A direction at a state.
pub(super) struct Sighted {
    /// In the frame of the first sample.
    pub(super) direction: Vector3<f64>,
    pub(super) on_vehicle: Vector3<f64>,
    pub(super) in_camera: Vector3<f64>,
    pub(super) attitude: UnitQuaternion<f64>,
    pub(super) mount: UnitQuaternion<f64>,
}
