//! The APIDs of a flight computer, as an argument.

use clap::Args;
use hzn_flight::packet::ApidBase;

/// The argument that says which APIDs a flight computer has.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct ApidArgs {
    /// `line.apid_base` of the flight computer, such as 0x100
    #[arg(long, value_name = "APID", default_value = "0x100", value_parser = parse)]
    pub(crate) apid_base: ApidBase,
}

fn parse(text: &str) -> Result<ApidBase, String> {
    let number = match text.strip_prefix("0x") {
        Some(digits) => u16::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    };
    let (max, step) = (ApidBase::MAX, ApidBase::STEP);
    number.and_then(ApidBase::try_new).ok_or_else(|| format!("it must be a multiple of {step} from 0 to {max:#x}"))
}
