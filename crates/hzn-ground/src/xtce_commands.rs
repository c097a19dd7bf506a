//! The telecommands of the dictionary, from the tables that the flight software reads.
//!
//! Every telecommand has a fixed size here: `set`, `try`, `stage` and `read` have one parameter. A ground system fills
//! in the sequence count and appends the checksum, as it does for every CCSDS packet.

use std::collections::BTreeMap;
use std::fmt::Write;

use hzn_flight::messages::{Attitude, Function, Mode, Navigation};
use hzn_flight::packet::{Apid, ApidBase, OVERHEAD, SYNC};
use hzn_flight::record::{Field, Kind};
use hzn_flight::{Parameters, parameters};

use crate::xtce_text::{enumeration_list, plain, type_name, unit_of, unit_set};

/// How long a verifier waits for the acknowledgement: the loop takes one telecommand a turn, after at most one picture.
const WAIT: &str = "PT10S";

/// A part of the user data of a telecommand, after the number of its function.
enum Part {
    /// Bytes that are always the same.
    Fixed(&'static [u8]),
    /// A number.
    Number { name: &'static str, kind: Kind, initial: Option<&'static str>, about: &'static str },
    /// One of several values.
    Choice { name: &'static str, ty: &'static str, kind: Kind, about: &'static str },
}

/// Types of choices.
const MODE: &str = "mode";
const PARAMETER: &str = "parameter";
const MOMENT: &str = "moment";

/// Returns the parts that a record has. Floats may be unknown.
fn record(table: &'static [Field]) -> Vec<Part> {
    let part = |field: &Field| Part::Number {
        name: field.name,
        kind: field.kind,
        initial: matches!(field.kind, Kind::Float(_)).then_some("NaN"),
        about: field.description,
    };
    table.iter().map(part).collect()
}

const fn number(name: &'static str, kind: Kind, about: &'static str) -> Part {
    Part::Number { name, kind, initial: None, about }
}

/// Returns the parts of a telecommand.
fn parts(function: Function) -> Vec<Part> {
    let parameter =
        || Part::Choice { name: "parameter", ty: PARAMETER, kind: Kind::Unsigned(2), about: "The parameter." };
    match function {
        Function::SetMode => {
            vec![Part::Choice { name: "mode", ty: MODE, kind: Kind::Unsigned(1), about: "The new mode." }]
        }
        Function::SetParameters | Function::TryParameters | Function::StageParameters => {
            let value = number("value", Kind::Float(8), "Its value; NaN: not set.");
            // The count of one parameter comes first.
            vec![Part::Fixed(&[1]), parameter(), value]
        }
        Function::ReadParameters => vec![Part::Fixed(&[1]), parameter()],
        Function::CommitParameters => {
            vec![number("count", Kind::Unsigned(2), "Number of the parameters that are kept.")]
        }
        // The first number of a record for `known` is the altitude; it has neither time nor velocity.
        Function::SetKnown => {
            let fields = Navigation::TABLE
                .iter()
                .filter(|field| ["altitude", "position", "rate"].iter().any(|name| field.name.starts_with(name)));
            fields.flat_map(|field| record(std::slice::from_ref(field))).collect()
        }
        Function::Navigate => record(Navigation::TABLE),
        Function::SetAttitude => {
            let mut parts = record(Attitude::TABLE);
            // An attitude always expires: a value that is unknown is refused.
            for part in &mut parts {
                if let Part::Number { name: "expires_s", initial, .. } = part {
                    *initial = None;
                }
            }
            parts
        }
        Function::SetTime => vec![
            // The P-field of TAI since 1958.
            Part::Fixed(&[0x1F]),
            number("seconds", Kind::Unsigned(4), "Whole seconds since 1958-01-01, TAI."),
            number("fraction", Kind::Unsigned(3), "Fraction of the second, in 2^-24 s."),
            Part::Choice { name: "moment", ty: MOMENT, kind: Kind::Unsigned(1), about: "When it was this time." },
        ],
        Function::ProcessOnce
        | Function::DumpEdges
        | Function::ResetCounters
        | Function::Ping
        | Function::Report
        | Function::ArmShutDown => Vec::new(),
    }
}

/// Returns the labels of a type of choices.
fn labels(ty: &str) -> Vec<(u64, String)> {
    match ty {
        MODE => Mode::ALL.iter().map(|&mode| (mode as u64, mode.name().to_owned())).collect(),
        MOMENT => vec![(0, "arrival of the telecommand".to_owned()), (1, "last pulse".to_owned())],
        _ => parameter_labels(),
    }
}

/// Returns the parameters that every computer has. A name with several numbers gets their places.
fn parameter_labels() -> Vec<(u64, String)> {
    let defaults = Parameters::defaults();
    let ids: Vec<u16> = defaults.numbers().collect();
    let name = |id: u16| parameters::name(id).unwrap_or("?");
    let label = |&id: &u16| {
        let name_of = name(id);
        let same: Vec<u16> = ids.iter().copied().filter(|&other| name(other) == name_of).collect();
        let place = same.iter().position(|&other| other == id).unwrap_or_default();
        let label = if same.len() > 1 { format!("{name_of} {place}") } else { name_of.to_owned() };
        (u64::from(id), label)
    };
    ids.iter().map(label).collect()
}

/// The telecommands in the making.
#[derive(Default)]
struct Commands {
    types: BTreeMap<String, String>,
    text: String,
}

impl Commands {
    /// Adds the type of numbers of a kind, and returns its name.
    fn number_type(&mut self, kind: Kind, unit: &str) -> String {
        let bits = 8 * kind.bytes();
        let units = unit_set(unit);
        let (name, text) = match kind {
            Kind::Unsigned(_) => {
                let name = type_name(&format!("u{bits}"), unit);
                let text = format!(
                    "<IntegerArgumentType name=\"{name}\" signed=\"false\" sizeInBits=\"{bits}\">{units}\
                     <IntegerDataEncoding encoding=\"unsigned\" sizeInBits=\"{bits}\"/></IntegerArgumentType>"
                );
                (name, text)
            }
            Kind::Float(_) => {
                let name = type_name(&format!("f{bits}"), unit);
                let text = format!(
                    "<FloatArgumentType name=\"{name}\" sizeInBits=\"{bits}\">{units}\
                     <FloatDataEncoding encoding=\"IEEE754_1985\" sizeInBits=\"{bits}\"/></FloatArgumentType>"
                );
                (name, text)
            }
        };
        self.types.insert(name.clone(), text);
        name
    }

    fn choice_type(&mut self, ty: &str, kind: Kind) -> String {
        let text = format!(
            "<EnumeratedArgumentType name=\"{ty}\"><UnitSet/>\
             <IntegerDataEncoding encoding=\"unsigned\" sizeInBits=\"{}\"/>{}</EnumeratedArgumentType>",
            8 * kind.bytes(),
            enumeration_list(&labels(ty))
        );
        self.types.insert(ty.to_owned(), text);
        ty.to_owned()
    }

    /// Adds a telecommand.
    fn add(&mut self, function: Function, base: ApidBase) {
        let (mut arguments, mut entries, mut bytes) = (String::new(), String::new(), 1);
        for part in parts(function) {
            let (name, ty, kind, initial, about) = match part {
                Part::Fixed(value) => {
                    entries += &fixed("", value);
                    bytes += value.len();
                    continue;
                }
                Part::Number { name, kind, initial, about } => {
                    (name, self.number_type(kind, unit_of(name)), kind, initial, about)
                }
                Part::Choice { name, ty, kind, about } => (name, self.choice_type(ty, kind), kind, None, about),
            };
            let initial = initial.map_or(String::new(), |value| format!(" initialValue=\"{value}\""));
            let _ = write!(
                arguments,
                "\n          <Argument name=\"{name}\" argumentTypeRef=\"{ty}\"{initial}>\
                 <LongDescription>{}</LongDescription></Argument>",
                plain(about)
            );
            entries += &format!("\n            <ArgumentRefEntry argumentRef=\"{name}\"/>");
            bytes += kind.bytes();
        }
        if !arguments.is_empty() {
            arguments = format!("\n        <ArgumentList>{arguments}\n        </ArgumentList>");
        }
        let name = function.name();
        let _ = write!(
            self.text,
            "\n      <MetaCommand name=\"{name}\">{arguments}\n        <CommandContainer name=\"{name}_packet\">\n\
             \x20         <EntryList>{}{}{entries}\n          </EntryList>\n        </CommandContainer>\n{}\n\
             \x20     </MetaCommand>",
            header(bytes, base),
            fixed("function", &[function as u8]),
            verifiers(function)
        );
    }
}

/// Returns an entry with fixed bytes.
fn fixed(name: &str, value: &[u8]) -> String {
    let name = if name.is_empty() { String::new() } else { format!(" name=\"{name}\"") };
    let hex: String = value.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("\n            <FixedValueEntry{name} binaryValue=\"{hex}\" sizeInBits=\"{}\"/>", 8 * value.len())
}

/// Returns the entries of both headers of a telecommand with this number of bytes of user data.
fn header(user_bytes: usize, base: ApidBase) -> String {
    // Version 0, type telecommand, with a secondary header.
    let first = 0x1800 | base.apid(Apid::Command);
    let length = (OVERHEAD - SYNC.len() - 6 + user_bytes - 1) as u16;
    fixed("packet_identification", &first.to_be_bytes())
        + &fixed("packet_sequence", &[0xC0, 0])
        + &fixed("packet_length", &length.to_be_bytes())
        + &fixed("packet_time", &[0; 8])
}

/// The two answers to a telecommand: the name of the verifier, its element, and how the code compares with 0.
const ANSWERS: [(&str, &str, &str); 2] = [("done", "CompleteVerifier", "=="), ("refused", "FailedVerifier", "!=")];

/// Returns the name of the acknowledgement with this answer.
fn answer_name(function: Function, answer: &str) -> String {
    format!("{}_{answer}", function.name())
}

/// Returns the acknowledgements that the verifiers wait for: a name, and the comparisons that choose the packet.
///
/// A verifier that compares the parameters itself would also take an older acknowledgement, whose values a ground
/// system keeps. A container is a packet that arrives.
pub(crate) fn answers() -> impl Iterator<Item = (String, String)> {
    let choose = |function: Function, operator: &str| {
        format!(
            "<ComparisonList><Comparison parameterRef=\"acknowledgement_function\" value=\"{}\"/>\
             <Comparison parameterRef=\"acknowledgement_code\" comparisonOperator=\"{operator}\" value=\"0\" \
             useCalibratedValue=\"false\"/></ComparisonList>",
            function as u8
        )
    };
    Function::ALL.iter().flat_map(move |&function| {
        ANSWERS.map(|(answer, _, operator)| (answer_name(function, answer), choose(function, operator)))
    })
}

/// Returns the verifiers of a telecommand: its acknowledgement, with the code 0 or another one.
fn verifiers(function: Function) -> String {
    let verifier = |(name, element, _): (&str, &str, &str)| {
        format!(
            "          <{element} name=\"{name}\">\n            <ContainerRef containerRef=\"{}\"/>\n\
             \x20           <CheckWindow timeToStopChecking=\"{WAIT}\" timeWindowIsRelativeTo=\"commandRelease\"/>\n\
             \x20         </{element}>\n",
            answer_name(function, name)
        )
    };
    format!("        <VerifierSet>\n{}        </VerifierSet>", ANSWERS.map(verifier).concat())
}

/// Returns the telecommands of a computer with these APIDs.
pub(crate) fn command_meta_data(base: ApidBase) -> String {
    let mut commands = Commands::default();
    Function::ALL.iter().for_each(|&function| commands.add(function, base));
    let types: String = commands.types.values().map(|ty| format!("      {ty}\n")).collect();
    format!(
        "  <CommandMetaData>\n    <ArgumentTypeSet>\n{types}    </ArgumentTypeSet>\n    <MetaCommandSet>{}\n\
         \x20   </MetaCommandSet>\n  </CommandMetaData>\n",
        commands.text
    )
}
