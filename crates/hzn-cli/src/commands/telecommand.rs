//! `hzn telecommand`: writes commands for a flight computer, as the bytes that are sent to it, or sends them.

use std::path::PathBuf;

use hzn_fly::key_file::{Signer, counter_path};
use hzn_fly::link::{Address, Patience};
use hzn_ground::{Commander, Incoming, encode, loaded_files, write_packet};
use hzn_run::disk;

use crate::apid::ApidArgs;
use crate::exit::{Exit, Outcome, failed, usage};
use crate::files;
use crate::tell;

/// Write telecommands for a flight computer, or send them over a line
///
/// Each command is one argument:
///   "mode standby|flight|safe|shut-down"
///   "set NAME VALUE [NAME VALUE]..."   names as in sensor.toml, or numbers; all or none
///                                      (NaN: left out)
///   "try NAME VALUE [NAME VALUE]..."   as set, but a reset brings the stored values back
///   "load sensor.toml"                 every parameter of a sensor; all or none, in as many packets as needed
///   "read NAME [NAME]..."
///   "known ALTITUDE_KM [X_KM Y_KM Z_KM [RATE_X RATE_Y RATE_Z]]"   rates in rad/s; NaN: not known
///   "navigate EPOCH EXPIRES_S ALTITUDE_KM X_KM Y_KM Z_KM VX_M_S VY_M_S VZ_M_S [RATE_X RATE_Y RATE_Z]"
///                                      as known, with time (UTC, or seconds since the computer's
///                                      start), velocity and expiry; NaN: not known
///   "attitude EPOCH EXPIRES_S QW QX QY QZ SIGMA_DEG [SUN_X SUN_Y SUN_Z]"
///                                      quaternion from the camera to ECEF, and the direction to the Sun in the
///                                      camera frame; NaN: not known
///   "time UTC [pulse]"                 correlates the clock: UTC when the command arrives, or at the last pulse
///   "process-once", "dump-edges", "reset-counters", "ping", "report" (sends housekeeping)
///   "arm"                              allows "mode shut-down" for ten seconds
/// The bytes go to standard output unless -o is given. book/reference/telemetry.md describes the format.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Args {
    /// The commands, in order
    #[arg(required = true, value_name = "COMMAND")]
    commands: Vec<String>,
    /// The file to write
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Send the commands over this line and wait for each acknowledgement: udp:LOCAL,REMOTE, tcp:HOST:PORT,
    /// tcp-listen:HOST:PORT or serial:DEVICE[:BAUD]
    #[arg(long, value_name = "LINE", conflicts_with_all = ["output", "force"])]
    to: Option<Address>,
    /// Sequence count of the first command, 0 to 16383
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..16384))]
    sequence: u16,
    /// The key of the flight computer (`hzn key`); its counter is kept beside it. With -o or standard output, counters
    /// that a reset of the computer may have reserved are left out
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    #[command(flatten)]
    apids: ApidArgs,
    /// Replace an output that exists
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    let tell = tell::to_stderr();
    let mut read = loaded_files(&args.commands);
    read.extend(args.key.iter().flat_map(|key| [key.clone(), counter_path(key)]));
    if let Some(path) = &args.output {
        files::check_outputs(&read, std::slice::from_ref(path), args.force)?;
    }
    let mut signer = args.key.as_deref().map(Signer::open).transpose().map_err(usage)?;
    if let Some(address) = &args.to {
        let commander = Commander::new(args.apids.apid_base, args.sequence, &args.commands, tell.clone());
        let commander = commander.inspect_err(|_| {
            if args.commands.len() > 1 {
                tell::line("note: no command was sent: all of them are checked first");
            }
        })?;
        let commander = commander.signed_by(signer);
        let is_done = Incoming::open(address, Patience::Fails)?.command(commander, &tell)?;
        return Ok(if is_done { Exit::Done } else { Exit::Failed });
    }
    if let Some(signer) = &mut signer {
        signer.skip_reserved().map_err(failed)?;
    }
    let mut out = Vec::new();
    let mut sequence = args.sequence;
    for command in &args.commands {
        for user in encode(command, &tell)? {
            let user = match &mut signer {
                Some(signer) => signer.seal(args.apids.apid_base, sequence, &user).map_err(failed)?,
                None => user,
            };
            out.extend(write_packet(args.apids.apid_base, sequence, command, &user)?);
            sequence = (sequence + 1) & 0x3FFF;
        }
    }
    match &args.output {
        Some(path) => {
            disk::write(path, out)?;
            Ok(Exit::Done)
        }
        None => {
            tell::bytes(&out)?;
            Ok(Exit::Done)
        }
    }
}
