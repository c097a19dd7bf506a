//! The truth about the vehicle, for vehicle.csv.

use hzn_files::vehicle::VehicleRow;

use super::path::Path;

/// Most rows a second in vehicle.csv.
pub const MAX_RATE_HZ: f64 = 10.0;

impl Path {
    /// Returns the truth about the vehicle at a time in seconds.
    pub fn vehicle(&self, time_s: f64) -> VehicleRow {
        let state = self.state(time_s);
        let (x, v, q) = (state.position_m, state.velocity_mps, state.fixed_from_vehicle);
        VehicleRow {
            time_s,
            x_m: x.x,
            y_m: x.y,
            z_m: x.z,
            vx_mps: v.x,
            vy_mps: v.y,
            vz_mps: v.z,
            qw: q.w,
            qx: q.i,
            qy: q.j,
            qz: q.k,
        }
    }

    /// Returns the truth about the vehicle from the first to the last time, at most [`MAX_RATE_HZ`] times a second.
    pub fn vehicle_rows(&self, span_s: [f64; 2], rate_hz: f64) -> impl Iterator<Item = VehicleRow> {
        super::instruments::times(rate_hz.min(MAX_RATE_HZ), span_s).map(|(_, time_s)| self.vehicle(time_s))
    }
}
