//! The view of a picture: a board shows its pixels, or its rows one by one, and the view finds the limb.
//!
//! | part | idea |
//! |---|---|
//! | `viewer` | the two ways to show a picture |
//! | `row_readout` | the data of each row that the search for stuck pixels needs |
//! | `stuck` | pixels that do not change from one to the next |
//! | `edge_watch` | the edges of a picture, watched for stuck pixels and for the longest one |

mod edge_watch;
mod row_readout;
mod stuck;
mod viewer;

pub(crate) use edge_watch::LongestEdge;
pub use hzn_core::pipeline::ROWS_HELD;
pub(crate) use stuck::StuckPlaces;
pub(crate) use viewer::{Before, Seen};
pub use viewer::{Lists, RowMemory, RowView, Viewer};
