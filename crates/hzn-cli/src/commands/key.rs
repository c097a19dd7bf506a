//! `hzn key`: makes the key of telecommands, shows it without its secret, or writes its counter.

use std::path::PathBuf;

use hzn_fly::key_file;

use crate::exit::{Exit, Outcome, failed, usage};
use crate::tell;

/// Make the key that a flight computer asks for in telecommands, or show what it is for
///
/// With --spacecraft, a key with a random secret is written to FILE, and its counter 0 to FILE.counter. Only the owner
/// of the files can read them. Copy both to the flight computer (`hzn fly --key FILE`), over a way that nobody else
/// reads, and keep both on the ground (`hzn telecommand --key FILE`). Without --spacecraft, FILE is shown without its
/// secret. book/reference/telemetry.md says what a key protects and what it does not.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The file of the key
    file: PathBuf,
    /// Make a key for the spacecraft of this number
    #[arg(long, value_name = "N")]
    spacecraft: Option<u32>,
    /// Number of the new key; the next key of a spacecraft gets another one
    #[arg(long, value_name = "N", default_value_t = 1, requires = "spacecraft")]
    number: u8,
    /// Write the counter of the key anew, when it was lost: a number above all that were used
    #[arg(long, value_name = "N", conflicts_with = "spacecraft")]
    counter: Option<u64>,
}

pub(super) fn run(args: &Args) -> Outcome {
    let Args { file, spacecraft, number, counter } = args;
    let refuse = |e: hzn_fly::Error| if e.is_usage { usage(e) } else { failed(e) };
    let key = match spacecraft {
        Some(spacecraft) => key_file::create(file, *spacecraft, *number).map_err(refuse)?,
        None => key_file::read(file).map_err(refuse)?,
    };
    if let Some(counter) = counter {
        let written = key_file::counter_path(file);
        if let Some(last) = key_file::read_counter(file).filter(|last| last > counter) {
            return Err(usage(format!("--counter {counter}: {} has {last}, which is larger", written.display())));
        }
        key_file::write_counter(file, *counter).map_err(|e| failed(format!("{}: {e}", written.display())))?;
    }
    let count = match key_file::read_counter(file) {
        Some(counter) => counter.to_string(),
        None => format!("missing or damaged ({})", key_file::counter_path(file).display()),
    };
    tell::line(format!("key {} of spacecraft {}; counter {count}", key.number, key.spacecraft));
    Ok(Exit::Done)
}
