//! `hzn telemetry`: decodes the telemetry of a flight computer.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use hzn_files::limited;
use hzn_fly::key_file::{Signer, counter_path};
use hzn_fly::link::{Address, Patience};
use hzn_ground::{Commander, Incoming, Station, loaded_files, xtce};
use hzn_run::disk;

use super::ground::show;
use crate::apid::ApidArgs;
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::tell;

/// Decode a flight computer's telemetry, from a file or as it comes
///
/// Answers become rows as `hzn run` writes them; events, acknowledged commands and parameters are
/// printed. Bytes that are not a complete packet are skipped and counted.
/// book/reference/telemetry.md describes the format.
///
/// A line is read until Ctrl-C. It is one of
///   udp:LOCAL[,REMOTE]         datagrams; commands go to REMOTE
///   tcp:HOST:PORT              a connection to the flight computer
///   tcp-listen:HOST:PORT       a connection that the flight computer makes
///   serial:DEVICE[:BAUD]       a serial port, 115200 baud unless given
///
/// Exit codes: 0 every byte of the stream belongs to a packet, or a line was read; 3 the stream has broken packets.
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
    /// The key of the flight computer for the commands (`hzn key`)
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
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
        tell::file(xtce::dictionary(args.apids.apid_base))?;
        return Ok(Exit::Done);
    };
    let name = file.display().to_string();
    let live = if Address::is_address(&name) {
        let address: Address = name.parse().map_err(usage)?;
        Some(Incoming::open(&address, Patience::Fails)?)
    } else if file == Path::new("-") {
        Some(Incoming::stdin()?)
    } else {
        None
    };
    if (args.screen || !args.send.is_empty()) && !live.as_ref().is_some_and(Incoming::can_send) {
        return Err(usage(format!("{name}: --screen and --send need a line, such as tcp:HOST:PORT")));
    }
    let mut read_files = loaded_files(&args.send);
    read_files.extend(args.key.iter().flat_map(|key| [key.clone(), counter_path(key)]));
    if live.is_none() {
        read_files.push(file.to_owned());
    }
    let written: Vec<PathBuf> = [&args.output, &args.housekeeping].into_iter().flatten().cloned().collect();
    disk::refuse_inputs(&read_files, &written)?;
    let bytes = if live.is_some() { Vec::new() } else { read(file)? };
    let (base, output, housekeeping) = (args.apids.apid_base, args.output.as_deref(), args.housekeeping.as_deref());
    let tell = tell::to_stderr();
    let mut station = Station::new(base, output, housekeeping, args.force, tell.clone())?;
    let mut rest = bytes;
    if let Some(live) = live {
        let signer = args.key.as_deref().map(Signer::open).transpose().map_err(usage)?;
        let commander = Commander::new(base, 0, &args.send, tell.clone())?.signed_by(signer);
        rest = if args.screen {
            show(live, &mut station, commander)?
        } else {
            live.listen(&mut station, commander, &stop_flag(), &tell)?
        };
    } else {
        station.take(&mut rest)?;
    }
    let is_whole = station.finish(&rest, &name)?;
    // Noise is usual on a line, and Ctrl-C often ends it within a packet; a stream that was recorded can be sent again.
    Ok(if is_whole || Address::is_address(&name) { Exit::Done } else { Exit::SomeUnreadable })
}

/// Returns a flag that Ctrl-C or a request to terminate sets.
fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = Arc::clone(&flag);
    // Without a handler, Ctrl-C ends the program at once; the output can still be recovered.
    drop(ctrlc::set_handler(move || shared.store(true, Ordering::SeqCst)));
    flag
}

/// Largest stream that is read, in bytes.
const MAX_BYTES: u64 = 1 << 30;

fn read(path: &Path) -> Result<Vec<u8>, Stop> {
    let bytes = limited::read(path, MAX_BYTES).map_err(|e| usage(format!("{}: {e}", path.display())))?;
    if bytes.is_empty() {
        return Err(failed(format!("{}: is empty; was the stream recorded?", path.display())));
    }
    Ok(bytes)
}
