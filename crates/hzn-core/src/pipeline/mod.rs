//! The whole chain: the stages run in order and never go back.
//!
//! Each candidate goes from its border to a verdict before the next one begins. Edges are examined in the order in
//! which they are likely to be the limb: first those next to the longest dark stretches of the border, then every other
//! edge that begins at the border, then closed edges. The search ends when an edge passes every gate and is certain
//! (`CERTAIN_SUPPORT`, `CERTAIN_SHARE` in `search/edge.rs`). Otherwise the best of all edges that begin at the border
//! is chosen; closed edges are examined only if none of these edges gives an answer. A picture without an answer is
//! examined again, at other thresholds (`[retry]`).

mod budget;
mod division;
#[cfg(any(test, feature = "_edges"))]
pub mod edge_position;
#[cfg(any(test, feature = "_edges"))]
pub mod edges;
mod further_looks;
mod horizon;
mod look;
mod place;
pub mod prepared;
mod process;
mod reference;
mod row_stream;
mod search;
mod sensor;
mod sequence;
mod track;
mod workspace;

#[cfg(test)]
#[path = "../../tests/unit/golden/mod.rs"]
mod golden;

pub use horizon::{FlightHorizon, Horizon, HostHorizon};
pub use place::SensorPlace;
pub use reference::Step;
pub use row_stream::{ROWS_HELD, RowBuffers, RowStream, RowStreamError};
pub use sensor::Sensor;
pub use sequence::Sequence;
pub use track::Tracker;
pub use workspace::{FlightWorkspace, HostWorkspace, Workspace};
