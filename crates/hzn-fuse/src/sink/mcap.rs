//! Results as a recording for Foxglove: states and innovations as JSON, frames and poses.

use std::path::Path;

use hzn_mcap::{Placed, SeriesWriter};

use super::record::{InnovationRecord, StateRecord, innovations, states};
use crate::error::Error;
use crate::results::Fused;

/// Name of the frame that is fixed in the Earth, as in recordings of `hzn run`.
const FIXED: &str = "fixed";
/// Name of the frame of the vehicle. `camera` is the name of the prior attitude's frame in recordings of `hzn run`.
const VEHICLE: &str = "nav_vehicle";

/// Writes a recording.
///
/// | topic | schema | content |
/// |---|---|---|
/// | `/nav/state`, `/nav/back`, `/nav/smoothed` | `hzn.NavState` (JSON) | the solutions |
/// | `/nav/innovation/SOURCE/KIND` | `hzn.NavInnovation` (JSON) | every innovation |
/// | `/tf` | `foxglove.FrameTransform` | `nav_vehicle` in `fixed`, and `nav_CAMERA` in `nav_vehicle` |
/// | `/nav/pose` | `foxglove.PoseInFrame` | the vehicle in `fixed` |
///
/// # Errors
/// The output cannot be written.
pub fn write_mcap(fused: &Fused, settings_toml: &str, path: &Path) -> Result<(), Error> {
    let mut out = SeriesWriter::create(path).map_err(Error::failed)?;
    write(fused, settings_toml, &mut out).map_err(Error::failed)?;
    out.finish().map_err(Error::failed)
}

/// A message in the order of time.
enum Item {
    State(Box<StateRecord>),
    Innovation(InnovationRecord),
}

fn write(fused: &Fused, settings_toml: &str, out: &mut SeriesWriter) -> Result<(), hzn_mcap::Error> {
    out.attach("fuse.toml", "application/toml", settings_toml)?;
    let mut items: Vec<(f64, Item)> = states(fused).map(|s| (s.time_s, Item::State(Box::new(s)))).collect();
    items.extend(innovations(fused).map(|i| (i.time_s, Item::Innovation(i))));
    items.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (time_s, item) in items {
        match item {
            Item::Innovation(i) => {
                out.json(&format!("/nav/innovation/{}/{}", i.source, i.kind), "hzn.NavInnovation", time_s, &i)?;
            }
            Item::State(s) => state(fused, &s, out)?,
        }
    }
    Ok(())
}

fn state(fused: &Fused, s: &StateRecord, out: &mut SeriesWriter) -> Result<(), hzn_mcap::Error> {
    use super::record::Phase;
    let topic = match s.phase {
        Phase::Back => "/nav/back",
        Phase::Filter => "/nav/state",
        Phase::Smoothed => "/nav/smoothed",
    };
    out.json(topic, "hzn.NavState", s.time_s, s)?;
    if s.phase != Phase::Filter {
        return Ok(());
    }
    let vehicle =
        Placed { frame: FIXED, position_m: [s.x_m, s.y_m, s.z_m], q_frame_from_placed_wxyz: [s.qw, s.qx, s.qy, s.qz] };
    out.transform(s.time_s, VEHICLE, &vehicle)?;
    out.pose("/nav/pose", s.time_s, &vehicle)?;
    let here = fused.epochs.partition_point(|e| e.state.time_s < s.time_s);
    let cameras = fused.epochs.get(here).map(|e| e.cameras.as_slice()).unwrap_or_default();
    for (name, camera) in fused.cameras.iter().zip(cameras) {
        let placed = Placed { frame: VEHICLE, position_m: [0.0; 3], q_frame_from_placed_wxyz: camera.mount.wxyz() };
        out.transform(s.time_s, &format!("nav_{name}"), &placed)?;
    }
    Ok(())
}
