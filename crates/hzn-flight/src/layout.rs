//! The packets of telemetry as lists of records: what a ground system needs to decode them. Every packet has a fixed
//! size.

use crate::answer::{Direction, Edge, Outcome, Position};
use crate::integrity::Integrity;
use crate::joint::RigAnswer;
use crate::messages::{
    Acknowledge, AttitudeState, EDGE_PIXELS, EdgePart, EdgePixel, EventRecord, Exposure, Housekeeping, NavigationState,
    ParameterValue,
};
use crate::packet::Apid;
use crate::record::{Field, Kind};

/// A part of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// The fields.
    pub table: &'static [Field],
    /// How often they follow one another.
    pub times: usize,
}

const fn once(table: &'static [Field]) -> Part {
    Part { table, times: 1 }
}

/// The number of the picture, in packets whose record does not have it.
const PICTURE: &[Field] =
    &[Field { name: "picture", parts: &[""], kind: Kind::Unsigned(4), description: " Number of the picture." }];

/// Returns the user data of a packet of telemetry; `None` for telecommands, whose arguments differ.
pub fn user_data(apid: Apid) -> Option<&'static [Part]> {
    Some(match apid {
        Apid::Housekeeping => const { &[once(Housekeeping::TABLE)] },
        Apid::Science => const { &[once(Exposure::TABLE), once(Outcome::TABLE), once(Direction::TABLE)] },
        Apid::Event => const { &[once(EventRecord::TABLE)] },
        Apid::Acknowledge => const { &[once(Acknowledge::TABLE)] },
        Apid::Parameters => const { &[once(ParameterValue::TABLE)] },
        Apid::Edge => const { &[once(EdgePart::TABLE), Part { table: EdgePixel::TABLE, times: EDGE_PIXELS }] },
        Apid::Candidate => const { &[once(PICTURE), once(Edge::TABLE)] },
        Apid::Position => const { &[once(PICTURE), once(Position::TABLE)] },
        Apid::Navigation => const { &[once(NavigationState::TABLE)] },
        Apid::Attitude => const { &[once(AttitudeState::TABLE)] },
        Apid::Integrity => const { &[once(PICTURE), once(Integrity::TABLE)] },
        Apid::Rig => const { &[once(RigAnswer::TABLE)] },
        Apid::Command => return None,
    })
}

/// Returns the number of bytes of the user data of a packet; `None` for telecommands.
// The sizes come from the tables, so that the bit budget counts the bytes that are really sent.
pub fn user_bytes(apid: Apid) -> Option<usize> {
    let bytes = |field: &Field| field.kind.bytes() * field.parts.len();
    let part = |part: &Part| part.times * part.table.iter().map(bytes).sum::<usize>();
    Some(user_data(apid)?.iter().map(part).sum())
}
