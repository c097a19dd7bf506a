//! The dictionary of telemetry and telecommands as XTCE (OMG XTCE 1.2, CCSDS 660.1-G), from the tables of the records.

use std::collections::BTreeMap;
use std::fmt::Write;

use hzn_core::status::{Stage, Status};
use hzn_core::verdict::Verdict;
use hzn_flight::joint::Outcome;
use hzn_flight::layout::user_data;
use hzn_flight::messages::{Code, Event, Mode, Severity};
use hzn_flight::packet::{Apid, ApidBase};
use hzn_flight::record::{Field, Kind};

use crate::xtce_commands::{answers, command_meta_data};
use crate::xtce_text::{enumeration_list, escape, plain, type_name, unit_of, unit_set};

/// The fields before the user data, with their bits.
const HEADERS: [(&str, usize, &str); 10] = [
    ("packet_version", 3, "Version of the packet, 0."),
    ("packet_type", 1, "0: telemetry."),
    ("packet_has_secondary_header", 1, "1: there is a secondary header, which is the time."),
    ("packet_apid", 11, "Application process identifier: the subject of the packet."),
    ("packet_sequence_flags", 2, "3: the packet is not a segment."),
    ("packet_sequence_count", 14, "Count of the packets with this APID."),
    ("packet_length", 16, "Number of bytes after this field, minus 1."),
    (
        "time_p_field",
        8,
        "P-field of the time (CUC, CCSDS 301.0-B): 31 TAI since 1958, 47 since the start of the computer.",
    ),
    ("time_seconds", 32, "Whole seconds of the time: TAI, or with the P-field 47 since the start of the computer."),
    ("time_fraction", 24, "The time with its fraction of a second, which is in 2^-24 s."),
];
const CHECKSUM: (&str, usize, &str) = ("packet_crc", 16, "CRC-16 of the packet (CCITT: polynomial 1021, start FFFF).");

/// A number of a packet.
struct Number {
    name: String,
    ty: String,
    description: String,
}

/// Returns the labels of a field whose numbers have names.
fn labels(packet: Apid, field: &str) -> Option<Vec<(u64, String)>> {
    macro_rules! named {
        ($list:expr) => {
            Some($list.iter().map(|&x| (x as u64, x.name().to_owned())).collect())
        };
    }
    let status = || Status::ALL.iter().map(|&s| (s as u64, s.name().to_owned()));
    match (packet, field) {
        (Apid::Housekeeping, "mode") => named!(Mode::ALL),
        (Apid::Housekeeping, "last_status") => Some(status().chain([(255, "none".to_owned())]).collect()),
        (Apid::Science | Apid::Rig, "status") => Some(status().collect()),
        (Apid::Rig, "outcome") => named!(Outcome::ALL),
        (Apid::Science, "stage") => named!(Stage::ALL),
        (Apid::Candidate, "verdict") => named!(Verdict::ALL),
        (Apid::Event, "number") => named!(Event::ALL),
        (Apid::Event, "severity") => named!(Severity::ALL),
        (Apid::Acknowledge, "code") => named!(Code::ALL),
        _ => None,
    }
}

/// Severity of an alarm.
#[derive(Clone, Copy)]
enum Level {
    Warning,
    Critical,
}

impl Level {
    const fn name(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Critical => "critical",
        }
    }
}

/// Returns the labels of a field that are alarms.
fn alarms(packet: Apid, field: &str) -> &'static [(&'static str, Level)] {
    match (packet, field) {
        (Apid::Housekeeping, "mode") => const { &[(Mode::Safe.name(), Level::Critical)] },
        (Apid::Event, "severity") => {
            const { &[(Severity::Warning.name(), Level::Warning), (Severity::Error.name(), Level::Critical)] }
        }
        _ => &[],
    }
}

/// Returns the highest value of a field that is no alarm. Counters of what a flight may have, such as lost pictures,
/// have no limit that holds for every mission.
fn highest(packet: Apid, field: &str) -> Option<(u32, Level)> {
    match (packet, field) {
        (Apid::Housekeeping, "self_check") => Some((0, Level::Critical)),
        // From three resets in a row the older parameters are in use.
        (Apid::Housekeeping, "watchdog_resets") => Some((2, Level::Critical)),
        (Apid::Housekeeping, "repairs") => Some((0, Level::Warning)),
        // 1: the values were used.
        (Apid::Navigation | Apid::Attitude, "state") => Some((1, Level::Warning)),
        _ => None,
    }
}

/// A dictionary in the making.
#[derive(Default)]
struct Dictionary {
    /// The types by their names.
    types: BTreeMap<String, String>,
    parameters: String,
    containers: String,
}

impl Dictionary {
    fn integer(&mut self, bits: usize, unit: &str) -> String {
        let name = type_name(&format!("u{bits}"), unit);
        let text = format!(
            "<IntegerParameterType name=\"{name}\" signed=\"false\" sizeInBits=\"{bits}\">{}\
             <IntegerDataEncoding encoding=\"unsigned\" sizeInBits=\"{bits}\"/></IntegerParameterType>",
            unit_set(unit)
        );
        self.types.insert(name.clone(), text);
        name
    }

    fn float(&mut self, bits: usize, unit: &str) -> String {
        let name = type_name(&format!("f{bits}"), unit);
        let text = format!(
            "<FloatParameterType name=\"{name}\" sizeInBits=\"{bits}\">{}\
             <FloatDataEncoding encoding=\"IEEE754_1985\" sizeInBits=\"{bits}\"/></FloatParameterType>",
            unit_set(unit)
        );
        self.types.insert(name.clone(), text);
        name
    }

    fn enumeration(&mut self, name: String, bits: usize, labels: &[(u64, String)], alarms: &[(&str, Level)]) -> String {
        let alarm = |(label, level): &(&str, Level)| {
            format!("<EnumerationAlarm alarmLevel=\"{}\" enumerationLabel=\"{}\"/>", level.name(), escape(label))
        };
        let list: String = alarms.iter().map(alarm).collect();
        let alarms = match list.is_empty() {
            true => String::new(),
            false => format!("<DefaultAlarm><EnumerationAlarmList>{list}</EnumerationAlarmList></DefaultAlarm>"),
        };
        let text = format!(
            "<EnumeratedParameterType name=\"{name}\"><UnitSet/>\
             <IntegerDataEncoding encoding=\"unsigned\" sizeInBits=\"{bits}\"/>{}{alarms}</EnumeratedParameterType>",
            enumeration_list(labels)
        );
        self.types.insert(name.clone(), text);
        name
    }

    /// Adds the type of a counter that should not be above `highest`.
    fn watched(&mut self, name: String, bits: usize, highest: u32, level: Level) -> String {
        let element = match level {
            Level::Warning => "WarningRange",
            Level::Critical => "CriticalRange",
        };
        let text = format!(
            "<IntegerParameterType name=\"{name}\" signed=\"false\" sizeInBits=\"{bits}\"><UnitSet/>\
             <IntegerDataEncoding encoding=\"unsigned\" sizeInBits=\"{bits}\"/>\
             <DefaultAlarm><StaticAlarmRanges><{element} maxInclusive=\"{highest}\"/>\
             </StaticAlarmRanges></DefaultAlarm>\
             </IntegerParameterType>"
        );
        self.types.insert(name.clone(), text);
        name
    }

    /// Adds the type of one of the two parts of the time, in units of `scale` seconds.
    fn time(&mut self, name: &str, bits: usize, scale: f64, reference: &str) -> String {
        let ty = format!("{name}_type");
        let text = format!(
            "<AbsoluteTimeParameterType name=\"{ty}\"><Encoding units=\"seconds\" scale=\"{scale:?}\">\
             <IntegerDataEncoding encoding=\"unsigned\" sizeInBits=\"{bits}\"/></Encoding>\
             <ReferenceTime>{reference}</ReferenceTime></AbsoluteTimeParameterType>"
        );
        self.types.insert(ty.clone(), text);
        ty
    }

    fn type_of(&mut self, packet: Apid, field: &Field) -> String {
        let (name, bits) = (format!("{}_{}", packet.name(), field.name), 8 * field.kind.bytes());
        if let Some(labels) = labels(packet, field.name) {
            return self.enumeration(name, bits, &labels, alarms(packet, field.name));
        }
        if let Some((highest, level)) = highest(packet, field.name) {
            return self.watched(name, bits, highest, level);
        }
        let unit = unit_of(field.name);
        match field.kind {
            Kind::Unsigned(bytes) => self.integer(8 * bytes, unit),
            Kind::Float(bytes) => self.float(8 * bytes, unit),
        }
    }

    /// Returns the numbers of a packet, in their order.
    fn numbers(&mut self, packet: Apid) -> Vec<Number> {
        let mut numbers = Vec::new();
        for part in user_data(packet).unwrap_or_default() {
            for time in 0..part.times {
                let index = if part.times > 1 { format!("_{time:02}") } else { String::new() };
                for field in part.table {
                    let ty = self.type_of(packet, field);
                    numbers.extend(field.parts.iter().map(|part| Number {
                        name: format!("{}_{}{part}{index}", packet.name(), field.name),
                        ty: ty.clone(),
                        description: plain(field.description),
                    }));
                }
            }
        }
        numbers
    }

    fn add_parameter(&mut self, number: &Number) {
        let Number { name, ty, description } = number;
        let _ = writeln!(
            self.parameters,
            "      <Parameter name=\"{name}\" parameterTypeRef=\"{ty}\">\
             <LongDescription>{}</LongDescription></Parameter>",
            description
        );
    }

    /// Adds a container with its entries; `base` is what makes it a packet of an APID.
    fn add_container(&mut self, name: &str, is_abstract: bool, entries: &[&str], base: &str) {
        let abstraction = if is_abstract { " abstract=\"true\"" } else { "" };
        let _ =
            writeln!(self.containers, "      <SequenceContainer name=\"{name}\"{abstraction}>\n        <EntryList>");
        for entry in entries {
            let _ = writeln!(self.containers, "          <ParameterRefEntry parameterRef=\"{entry}\"/>");
        }
        let _ = writeln!(self.containers, "        </EntryList>{base}\n      </SequenceContainer>");
    }
}

/// Returns what makes a container a kind of another one.
fn part_of(base: &str, comparisons: &str) -> String {
    format!(
        "\n        <BaseContainer containerRef=\"{base}\"><RestrictionCriteria>{comparisons}\
         </RestrictionCriteria></BaseContainer>"
    )
}

/// Returns the dictionary of a computer with these APIDs. The packets are those between the sync markers of the line.
pub fn dictionary(base: ApidBase) -> String {
    let mut d = Dictionary::default();
    for (name, bits, description) in HEADERS.into_iter().chain([CHECKSUM]) {
        let ty = match name {
            // The name, not the date 1958-01-01: a date does not say that leap seconds count.
            "time_seconds" => d.time(name, bits, 1.0, "<Epoch>TAI</Epoch>"),
            "time_fraction" => d.time(name, bits, 2f64.powi(-24), "<OffsetFrom parameterRef=\"time_seconds\"/>"),
            _ => d.integer(bits, ""),
        };
        d.add_parameter(&Number { name: name.to_owned(), ty, description: plain(description) });
    }
    d.add_container("CCSDSPacket", true, &HEADERS.map(|(name, ..)| name), "");
    for &apid in Apid::ALL.iter().filter(|&&apid| apid != Apid::Command) {
        let numbers = d.numbers(apid);
        numbers.iter().for_each(|number| d.add_parameter(number));
        let entries: Vec<&str> = numbers.iter().map(|n| n.name.as_str()).chain([CHECKSUM.0]).collect();
        let number = format!(
            "<Comparison parameterRef=\"packet_apid\" value=\"{}\" useCalibratedValue=\"false\"/>",
            base.apid(apid)
        );
        d.add_container(apid.name(), false, &entries, &part_of("CCSDSPacket", &number));
    }
    for (name, comparisons) in answers() {
        d.add_container(&name, false, &[], &part_of(Apid::Acknowledge.name(), &comparisons));
    }
    let types: String = d.types.values().map(|ty| format!("      {ty}\n")).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <SpaceSystem name=\"hzn\" xmlns=\"http://www.omg.org/spec/XTCE/20180204\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
         xsi:schemaLocation=\"http://www.omg.org/spec/XTCE/20180204 \
         https://www.omg.org/spec/XTCE/20180204/SpaceSystem.xsd\" \
         shortDescription=\"Telemetry and telecommands of the hzn horizon sensor\">\n\
         \x20 <Header version=\"{}\" validationStatus=\"Released\"/>\n\
         \x20 <TelemetryMetaData>\n    <ParameterTypeSet>\n{types}    </ParameterTypeSet>\n\
         \x20   <ParameterSet>\n{}    </ParameterSet>\n    <ContainerSet>\n{}    </ContainerSet>\n\
         \x20 </TelemetryMetaData>\n{}</SpaceSystem>\n",
        env!("CARGO_PKG_VERSION"),
        d.parameters,
        d.containers,
        command_meta_data(base)
    )
}
