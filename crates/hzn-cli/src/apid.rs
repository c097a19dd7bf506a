//! The APIDs of a flight computer, as an argument.

use clap::Args;
use hzn_flight::packet::ApidBase;

/// The argument that says which APIDs a flight computer has.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct ApidArgs {
    /// `line.apid_base` of the flight computer, such as 0x100
    #[arg(long, value_name = "APID", default_value = "0x100")]
    pub(crate) apid_base: ApidBase,
}
