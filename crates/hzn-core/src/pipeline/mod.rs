//! The whole: stages in order, nothing runs back.
//!
//! One candidate after another goes from its border to a verdict. Edges are looked at in the order in which they are
//! likely to be the limb: those beside the longest dark stretches of the border first, then every other edge that
//! begins at the border, then the closed ones. The picture is done as soon as an edge passes every gate and is beyond
//! doubt; otherwise the best of all that begin at the border is taken, and closed ones are looked at when none is. A
//! picture without an answer is looked at again, at other levels (`[recover]`).

mod account;
#[cfg(any(test, feature = "_edges"))]
pub mod edges;
mod found_limb;
mod further_looks;
mod horizon;
mod row_stream;
mod search;
mod sensor;
#[cfg(feature = "horace")]
mod subdivide;
mod workspace;

#[cfg(test)]
mod golden;

pub use horizon::{FlightHorizon, Horizon, HostHorizon};
pub use row_stream::{ROWS_HELD, RowBuffers, RowStream, RowStreamError};
pub use sensor::Sensor;
pub use workspace::{FlightWorkspace, HostWorkspace, Workspace};
