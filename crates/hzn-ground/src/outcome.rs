//! The outcome of a telecommand in words.

use hzn_flight::messages::{Acknowledge, Attitude, Code, Function, Navigation};
use hzn_flight::parameters;

/// Returns the code of an acknowledgement, and what was refused, in words.
pub(crate) fn describe(a: &Acknowledge) -> String {
    let code = Code::from_number(a.code);
    let name = code.map_or("unknown code", Code::name);
    let named = |fields: &[&str], place: u16| format!(": {}", fields.get(usize::from(place) - 1).unwrap_or(&"?"));
    let detail = match (code, Function::from_number(a.function), a.detail) {
        (Some(Code::Sequence), _, last) => format!(": the last one taken has {last}"),
        (_, _, 0) => String::new(),
        (_, Some(Function::SetKnown | Function::Navigate), place) => named(Navigation::FIELDS, place),
        (_, Some(Function::SetAttitude), place) => named(Attitude::FIELDS, place),
        (_, _, number) => format!(": parameter {number} {}", parameters::name(number).unwrap_or("?")),
    };
    format!("{name}{detail}")
}
