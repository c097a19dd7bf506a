//! The barrier of hzn-twice under Miri, as a library of the machine.
//!
//! `cargo xtask test "undefined behaviour"` builds it.
//!
//! Miri cannot run assembly. It can call a function of such a library, about which it assumes what the assembly says:
//! that it has written every byte of the place that it gets.

/// Does nothing. Miri calls it with a place that stays valid.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_twice_barrier(_: *mut u8) {}
