//! Tests of the sensor through its public interface.

mod architecture;
mod common;
mod decisions;
mod dice;
#[cfg(all(feature = "dlr", feature = "erf", feature = "position", feature = "zju"))]
mod digits;
mod drawn;
#[cfg(feature = "position")]
mod lit_side;
mod long;
mod precision;
mod prepared;
#[cfg(all(feature = "dlr", feature = "erf", feature = "horace", feature = "zju"))]
mod published;
mod rig;
mod rows;
mod stages;
mod total;
mod track;
mod uncertain_lens;
#[cfg(all(
    feature = "dlr",
    feature = "erf",
    feature = "horace",
    feature = "kalibr",
    feature = "position",
    feature = "reml",
    feature = "zju"
))]
mod varied;
