//! `hzn telemetry`: decodes the telemetry of a flight computer.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_calib::limited;
use hzn_core::body::Kind;
use hzn_flight::answer::Position;
use hzn_flight::assembly::{Assembled, Assembly};
use hzn_flight::bytes::Reader;
use hzn_flight::cuc::{Cuc, Epoch};
use hzn_flight::messages::{
    Acknowledge, Code, EdgePart, EdgePixel, Event, EventRecord, Function, Housekeeping, Mode, Navigation,
    NavigationState, ParameterValue, Severity,
};
use hzn_flight::packet::{self, Apid, ApidBase, OVERHEAD, Packet, Scan};
use hzn_flight::{Parameters, parameters};
use hzn_mcap::{Annotations, CandidateEdge, FrameRecord, LogLevel, LogLine, Row, RowMeta};
use hzn_run::disk;
use hzn_run::sink::{self, Existing, RowFile, Target};

use hzn_fly::link::Address;

use super::ground::{Commander, Incoming, screen};
use super::xtce;
use crate::apid::ApidArgs;
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::tell;

/// Decode a flight computer's telemetry, from a file or as it comes
///
/// Answers become rows as `hzn run` writes them; events, acknowledged commands and parameters are printed. Bytes that
/// are not a complete packet are skipped and counted. book/reference/telemetry.md describes the format.
///
/// A line is read until Ctrl-C. It is one of
///   udp:LOCAL[,REMOTE]         datagrams; commands go to REMOTE
///   tcp:HOST:PORT              a connection to the flight computer
///   tcp-listen:HOST:PORT       a connection that the flight computer makes
///   serial:DEVICE[:BAUD]       a serial port, 115200 baud unless given
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Args {
    /// The stream as it was received; - for standard input; or a line
    #[arg(value_name = "FILE|LINE", required_unless_present = "xtce")]
    file: Option<PathBuf>,
    /// Print the dictionary of the packets as XTCE, for other ground systems
    #[arg(long, conflicts_with_all = ["file", "output", "housekeeping"])]
    xtce: bool,
    /// Show the state of the flight computer on the whole terminal, and send commands from there
    #[arg(long)]
    screen: bool,
    /// A command to send, as for `hzn telecommand`; each waits for the acknowledgement of the one before
    #[arg(long, value_name = "COMMAND")]
    send: Vec<String>,
    /// The file for the answers: .csv, .jsonl or .mcap
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// The file for the housekeeping, as a table: .csv
    #[arg(long, value_name = "FILE")]
    housekeeping: Option<PathBuf>,
    #[command(flatten)]
    apids: ApidArgs,
    /// Replace outputs that exist
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    let Some(file) = args.file.as_deref().filter(|_| !args.xtce) else {
        tell::result(xtce::dictionary(args.apids.apid_base))?;
        return Ok(Exit::Done);
    };
    let name = file.display().to_string();
    let live = if Address::is_address(&name) {
        let address: Address = name.parse().map_err(usage)?;
        Some(Incoming::open(&address)?)
    } else if file == Path::new("-") {
        Some(Incoming::stdin()?)
    } else {
        None
    };
    if (args.screen || !args.send.is_empty()) && !live.as_ref().is_some_and(Incoming::can_send) {
        return Err(usage(format!("{name}: --screen and --send need a line, such as tcp:HOST:PORT")));
    }
    let bytes = if live.is_some() { Vec::new() } else { read(file)? };
    let existing = if args.force { Existing::Replace } else { Existing::Refuse };
    let mut station = Station {
        sink: args.output.as_deref().map(|path| Sink::create(path, existing)).transpose()?,
        housekeeping: args.housekeeping.as_deref().map(|path| table(path, args.force)).transpose()?,
        counts: StreamCounts { base: args.apids.apid_base, ..StreamCounts::default() },
    };
    let mut rest = bytes;
    if let Some(live) = live {
        let commander = Commander::new(args.apids.apid_base, 0, &args.send)?;
        rest = if args.screen {
            screen::show(live, &mut station, commander)?
        } else {
            live.listen(&mut station, commander)?
        };
    } else {
        station.take(&mut rest)?;
    }
    station.finish(&rest, &name)
}

/// What becomes of the packets.
pub(super) struct Station {
    pub(super) counts: StreamCounts,
    sink: Option<Sink>,
    housekeeping: Option<csv::Writer<std::fs::File>>,
}

impl Station {
    /// Makes a station without outputs.
    pub(super) fn quiet(base: ApidBase) -> Self {
        let counts = StreamCounts { base, is_quiet: true, ..StreamCounts::default() };
        Self { counts, sink: None, housekeeping: None }
    }

    /// Takes the whole packets at the beginning of the bytes out of them.
    pub(super) fn take(&mut self, bytes: &mut Vec<u8>) -> Result<(), Stop> {
        let counts = &mut self.counts;
        let mut rest = &bytes[..];
        loop {
            match packet::scan(rest) {
                Scan::More { .. } => break,
                Scan::Bad { skip } => {
                    counts.cut += 1;
                    counts.skipped += skip as u64;
                    rest = rest.get(skip..).unwrap_or_default();
                }
                Scan::Packet { end, packet } => {
                    counts.skipped += end.saturating_sub(packet.user.len() + OVERHEAD) as u64;
                    counts.take(&packet, &mut self.sink, &mut self.housekeeping)?;
                    rest = rest.get(end..).unwrap_or_default();
                }
            }
        }
        let taken = bytes.len() - rest.len();
        bytes.drain(..taken);
        Ok(())
    }

    /// Passes finished answers to the disk if their time has come.
    pub(super) fn flush_if_due(&mut self) -> Result<(), Stop> {
        match &mut self.sink {
            Some(Sink::Mcap(writer)) => writer.flush_if_due().map_err(failed),
            _ => Ok(()),
        }
    }

    /// Closes the outputs. `rest` are the bytes after the last packet.
    fn finish(self, rest: &[u8], name: &str) -> Outcome {
        let Self { mut counts, sink, housekeeping } = self;
        let skip = match packet::scan(rest) {
            Scan::More { skip } => skip,
            _ => 0,
        };
        counts.skipped += rest.len() as u64;
        // The rest is an incomplete packet, or noise.
        counts.cut += u64::from(rest.len() > skip + packet::SYNC.len());
        if let Some(sink) = sink {
            sink.finish()?;
        }
        if let Some(mut table) = housekeeping {
            table.flush()?;
        }
        counts.summary();
        if counts.packets == 0 && counts.skipped > 0 {
            let what = "no packet was found; is this the stream of a flight computer? (book/reference/telemetry.md)";
            return Err(failed(format!("{name}: {what}")));
        }
        Ok(Exit::Done)
    }
}

/// Largest stream that is read, in bytes.
const MAX_BYTES: u64 = 1 << 30;

fn read(path: &Path) -> Result<Vec<u8>, Stop> {
    limited::read(path, MAX_BYTES).map_err(|e| usage(format!("{}: {e}", path.display())))
}

fn table(path: &Path, force: bool) -> Result<csv::Writer<std::fs::File>, Stop> {
    disk::refuse_existing(path, force)?;
    let mut table = csv::Writer::from_path(path).map_err(|e| failed(format!("{}: {e}", path.display())))?;
    let columns = ["time_s"].into_iter().chain(Housekeeping::FIELDS.iter().copied());
    table.write_record(columns).map_err(failed)?;
    Ok(table)
}

/// The output for answers.
enum Sink {
    Rows(RowFile),
    Mcap(Box<hzn_mcap::Writer>),
}

impl Sink {
    fn create(path: &Path, existing: Existing) -> Result<Self, Stop> {
        if sink::target(path)? != Target::Mcap {
            return Ok(Self::Rows(RowFile::create(path, existing)?));
        }
        let metadata = [("program".to_owned(), format!("hzn {}", env!("CARGO_PKG_VERSION")))].into();
        let options = hzn_mcap::Options { metadata, force: existing == Existing::Replace, ..Default::default() };
        let writer = hzn_mcap::Writer::create(path, &options).map_err(usage)?;
        Ok(Self::Mcap(Box::new(writer)))
    }
    fn write(&mut self, record: FrameRecord) -> Result<(), Stop> {
        match self {
            Self::Rows(rows) => Ok(rows.write(&record.row)?),
            Self::Mcap(writer) => writer.write(&record).map_err(failed),
        }
    }
    fn finish(self) -> Result<(), Stop> {
        match self {
            Self::Rows(rows) => Ok(rows.finish()?),
            Self::Mcap(writer) => writer.finish().map(drop).map_err(failed),
        }
    }
}

/// What the ground sees in the packets.
pub(super) enum Seen {
    /// An answer to a picture.
    Answer(Exposure, Box<PictureAnswer>),
    /// The state of the computer.
    Housekeeping(Box<Housekeeping>),
    /// The outcome of a telecommand.
    Acknowledge(Acknowledge),
    /// A message, with the time of its packet.
    Note(LogLevel, String),
}

/// Counts of a stream, and the log lines for the next answer.
#[derive(Default)]
pub(super) struct StreamCounts {
    base: ApidBase,
    pub(super) packets: u64,
    pub(super) answers: u64,
    pub(super) cut: u64,
    skipped: u64,
    /// Number of lost packets, from the gaps in the sequence counts.
    pub(super) lost: u64,
    next: BTreeMap<u16, u16>,
    log: Vec<LogLine>,
    /// What was seen since somebody looked.
    pub(super) seen: Vec<Seen>,
    /// Whether messages are not printed, because a screen shows them.
    pub(super) is_quiet: bool,
    /// The packets of a picture whose science packet has not come.
    assembly: Assembly,
    /// Packets of the first version of telemetry.
    old: u64,
    /// Candidates and values of pictures whose packets did not come.
    incomplete: u64,
}

/// Most log lines that wait for an answer.
const MAX_LOG: usize = 1000;

impl StreamCounts {
    fn take(
        &mut self,
        packet: &Packet<'_>,
        sink: &mut Option<Sink>,
        housekeeping: &mut Option<csv::Writer<std::fs::File>>,
    ) -> Result<(), Stop> {
        self.packets += 1;
        self.count_lost(packet);
        let subject = self.base.subject(packet);
        let is_telemetry = subject.is_some_and(|apid| apid != Apid::Command);
        let Some(time) = packet.time.filter(|_| is_telemetry) else {
            self.old += u64::from(is_telemetry);
            if !is_telemetry {
                self.not_understood(packet);
            }
            return Ok(());
        };
        let from = &mut Reader::new(packet.user);
        let is_understood = match subject {
            Some(apid @ (Apid::Science | Apid::Candidate | Apid::Position | Apid::Navigation)) => {
                match self.assembly.take(apid, packet.user) {
                    Some(Some(picture)) => {
                        self.picture(&picture, sink)?;
                        true
                    }
                    part => part.is_some(),
                }
            }
            Some(Apid::Housekeeping) => match Housekeeping::read(from) {
                Some(record) => {
                    self.seen.push(Seen::Housekeeping(Box::new(record)));
                    write_housekeeping(time, &record, housekeeping)?;
                    true
                }
                None => false,
            },
            Some(Apid::Event) => EventRecord::read(from).map(|record| self.event(time, &record)).is_some(),
            Some(Apid::Acknowledge) => Acknowledge::read(from).map(|a| self.acknowledge(time, &a)).is_some(),
            Some(Apid::Parameters) => ParameterValue::read(from).map(|value| self.parameter(time, value)).is_some(),
            Some(Apid::Edge) => EdgePart::read(from).map(|part| self.edge(time, &part, from)).is_some(),
            Some(Apid::Command) | None => false,
        };
        if !is_understood {
            self.not_understood(packet);
        }
        Ok(())
    }

    fn not_understood(&mut self, packet: &Packet<'_>) {
        let name = self.base.subject(packet).map_or(String::new(), |a| format!(" ({})", a.name()));
        let what = format!("a packet of APID {:#x}{name} with {} bytes", packet.apid, packet.user.len());
        let time = packet.time.unwrap_or(Cuc::since_start(0));
        self.note(time, LogLevel::Warning, &format!("{what} is not understood"));
    }

    /// Counts the packets that are missing before this one, from its sequence count.
    fn count_lost(&mut self, packet: &Packet<'_>) {
        if let Some(next) = self.next.insert(packet.apid, (packet.sequence + 1) & 0x3FFF) {
            // A count of 0 means that the computer has restarted.
            if packet.sequence != next && packet.sequence != 0 {
                self.lost += u64::from(packet.sequence.wrapping_sub(next) & 0x3FFF);
            }
        }
    }

    fn event(&mut self, time: Cuc, record: &EventRecord) {
        let level = match Severity::from_number(record.severity) {
            Some(Severity::Information) => LogLevel::Info,
            Some(Severity::Warning) => LogLevel::Warning,
            Some(Severity::Error) | None => LogLevel::Error,
        };
        self.note(time, level, &describe_event(record));
    }

    fn acknowledge(&mut self, time: Cuc, a: &Acknowledge) {
        self.seen.push(Seen::Acknowledge(*a));
        let function = Function::from_number(a.function).map_or("?", Function::name);
        let code = Code::from_number(a.code).map_or("?", Code::name);
        let level = if a.code == 0 { LogLevel::Info } else { LogLevel::Warning };
        let detail = match (Function::from_number(a.function), a.detail) {
            (_, 0) => String::new(),
            (Some(Function::SetKnown | Function::Navigate), place) => {
                let name = Navigation::FIELDS.get(usize::from(place) - 1).unwrap_or(&"?");
                format!(": {name}")
            }
            (_, number) => format!(": parameter {number} {}", parameters::name(number).unwrap_or("?")),
        };
        self.note(time, level, &format!("command {} ({function}): {code}{detail}", a.sequence));
    }

    fn parameter(&mut self, time: Cuc, ParameterValue { number, value }: ParameterValue) {
        let name = parameters::name(number).unwrap_or("?");
        self.note(time, LogLevel::Info, &format!("parameter {number} {name} = {value}"));
    }

    fn edge(&mut self, time: Cuc, part: &EdgePart, from: &mut Reader<'_>) {
        let pixels = std::iter::from_fn(|| EdgePixel::read(from).map(|p| format!("{},{}", p.x, p.y)));
        let list: Vec<String> = pixels.take(part.count.into()).collect();
        let EdgePart { picture, candidate, first, total, stride, .. } = part;
        let what = format!("edge of picture {picture}, candidate {candidate}, stride {stride}");
        self.note(time, LogLevel::Info, &format!("{what}, {first} of {total}: {}", list.join(" ")));
    }

    fn picture(&mut self, picture: &Assembled, sink: &mut Option<Sink>) -> Result<(), Stop> {
        let Assembled { exposure, answer, navigation, missing_candidates } = picture;
        let (time, time_s) = (Cuc::since_start(exposure.exposure_us), exposure.exposure_us as f64 * 1e-6);
        self.incomplete += u64::from(*missing_candidates > 0);
        if navigation.is_some_and(|n| n.state == NavigationState::EXPIRED) {
            let what = format!("picture {}: the values from navigation have expired", exposure.picture);
            self.log.push(LogLine { level: LogLevel::Warning, message: what });
        }
        let Some(report) = answer.to_report() else {
            self.note(time, LogLevel::Warning, &format!("picture {}: invalid numbers", exposure.picture));
            return Ok(());
        };
        self.answers += 1;
        self.seen.push(Seen::Answer(*exposure, Box::new(answer.clone())));
        let Some(sink) = sink else { return Ok(()) };
        let body = Parameters::body(exposure.body);
        let altitude_km = (!exposure.altitude_m.is_nan()).then(|| f64::from(exposure.altitude_m) * 1e-3);
        let meta = RowMeta {
            index: u64::from(exposure.picture).saturating_sub(1),
            file: format!("picture-{:06}", exposure.picture),
            time_s: Some(time_s),
            body: body.map_or("?", hzn_core::body::Kind::name).to_owned(),
            altitude_km: altitude_km.filter(|_| !matches!(body, Some(Kind::Sun | Kind::Moon))),
        };
        let mut row = Row::from_report(&meta, &report, Some(f64::from(exposure.calculation_us)));
        if let Some(position) = &answer.position {
            set_position(&mut row, position);
        }
        let mut record = FrameRecord::new(row);
        record.candidates = CandidateEdge::from_report(&report);
        record.annotations = Annotations::default();
        record.log = std::mem::take(&mut self.log);
        sink.write(record)
    }

    fn note(&mut self, time: Cuc, level: LogLevel, message: &str) {
        let line = format!("{}  {message}", describe_time(time));
        if !self.is_quiet {
            tell::line(&line);
        }
        self.seen.push(Seen::Note(level, line));
        if self.log.len() < MAX_LOG {
            self.log.push(LogLine { level, message: message.to_owned() });
        }
    }

    fn summary(&self) {
        let Self { packets, answers, lost, cut, skipped, incomplete, old, .. } = self;
        let mut text = format!("{packets} packets, {answers} answers");
        if *lost > 0 {
            text += &format!(", {lost} packets lost on the way");
        }
        if *cut > 0 || *skipped > 0 {
            text += &format!(", {cut} broken packets, {skipped} bytes skipped");
        }
        if *incomplete > 0 {
            text += &format!(", {incomplete} answers without some of their candidates");
        }
        if *old > 0 {
            text += &format!(
                ", {old} packets of version 1 (times in microseconds), which this program does not read; use the \
                 program of the same version as the flight software"
            );
        }
        tell::line(&text);
    }
}

/// Fills the columns of the position, which is no part of a report that came by telemetry.
fn set_position(row: &mut Row, position: &Position) {
    if position.position_m.iter().all(|x| x.is_finite()) {
        let body_fixed_m = position.body_fixed_m.map(f64::from);
        let body_fixed_m = body_fixed_m.iter().all(|x| x.is_finite()).then_some(body_fixed_m);
        row.set_position_m(position.position_m.map(f64::from), position.pos_cov_m2.map(f64::from), body_fixed_m);
    }
}

/// Returns a time in words: seconds since the start of the computer, or UTC.
fn describe_time(time: Cuc) -> String {
    match time.epoch {
        Epoch::Start => format!("{:12.6} s", time.us as f64 * 1e-6),
        Epoch::Tai => crate::tai::utc_text(time.us),
    }
}

fn write_housekeeping(
    time: Cuc,
    record: &Housekeeping,
    table: &mut Option<csv::Writer<std::fs::File>>,
) -> Result<(), Stop> {
    if let Some(table) = table {
        // The time of a correlated clock counts from 1958; the column `clock` says which time it is.
        let values = std::iter::once(time.us as f64 * 1e-6).chain(record.values());
        table.write_record(values.map(|v| v.to_string())).map_err(failed)?;
    }
    Ok(())
}

/// Returns an event in words.
fn describe_event(record: &EventRecord) -> String {
    let EventRecord { number, a, b, .. } = *record;
    let mode = |n: u32| u8::try_from(n).ok().and_then(Mode::from_number).map_or("?", Mode::name);
    match Event::from_number(number) {
        Some(Event::ModeChanged) => format!("{} to {} mode", mode(a), mode(b)),
        Some(Event::Started) => format!("started with copy {a} of the parameters, generation {b}"),
        Some(Event::CommandRejected) => {
            let code = u8::try_from(a).ok().and_then(Code::from_number).map_or("?", Code::name);
            format!("telecommand rejected: {code} (function {b})")
        }
        Some(Event::Stored) => format!("parameters stored in copy {a}, generation {b}"),
        Some(Event::ClockSet) => {
            let change = if b == u32::MAX { String::new() } else { format!(", changed by {b} ms") };
            format!("clock correlated with {}{change}", crate::tai::utc_text(u64::from(a) * 1_000_000))
        }
        Some(Event::CameraSilent) => {
            format!("the camera sends no pictures: the last one, number {b}, came {:.1} s ago", f64::from(a) * 1e-3)
        }
        Some(Event::Repaired) => {
            let what = if a == 1 { "sensor, made anew from the stored parameters" } else { "values from navigation" };
            format!("memory error number {b} was repaired: {what}")
        }
        Some(e) => format!("{} ({a}, {b})", e.name()),
        None => format!("event {number} ({a}, {b})"),
    }
}
