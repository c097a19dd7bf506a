//! The key of telecommands as a file, with its counter in a second file beside it. The ground and the flight computer
//! each have a copy of both: the ground counts what it sent, the computer what it reserved.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hzn_flight::authentication::{KEY_BYTES, Key, RESERVED};
use hzn_flight::bytes::Writer;
use hzn_flight::packet::{self, ApidBase};
use hzn_mcap::{part_path, publish};

use crate::error::Error;

/// Returns the file with the counter of a key.
pub fn counter_path(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".counter");
    name.into()
}

/// Makes a key with a random secret, and its counter 0. Only their owner can read the files.
///
/// # Errors
/// One of the files exists, or cannot be written.
pub fn create(path: &Path, spacecraft: u32, number: u8) -> Result<Key, Error> {
    let in_file = |path: &Path, e: &dyn std::fmt::Display| Error::failed(format!("{}: {e}", path.display()));
    let counter = counter_path(path);
    if let Some(path) = [path, &counter].into_iter().find(|path| path.symlink_metadata().is_ok()) {
        let what = "exists; a key is never replaced, so choose another name";
        return Err(Error::usage(format!("{}: {what}", path.display())));
    }
    let mut secret = [0; 32];
    getrandom::fill(&mut secret).map_err(|e| Error::failed(format!("the system gives no random numbers: {e}")))?;
    let key = Key { spacecraft, number, secret };
    write(path, &key.to_bytes()).map_err(|e| in_file(path, &e))?;
    write_counter(path, 0).map_err(|e| in_file(&counter, &e))?;
    Ok(key)
}

/// Reads a key.
///
/// # Errors
/// The file cannot be read, others than its owner may read or write it, or it is no key.
pub fn read(path: &Path) -> Result<Key, Error> {
    let refuse = |what: &dyn std::fmt::Display| Error::usage(format!("{}: {what}", path.display()));
    if is_open_to_others(path).map_err(|e| refuse(&e))? {
        return Err(refuse(&format!("others may read or write this key; type chmod 600 {}", path.display())));
    }
    // One byte more than a key has shows that the file is something else.
    let bytes = hzn_files::limited::read(path, KEY_BYTES as u64 + 1).map_err(|e| refuse(&e))?;
    let key = bytes.as_slice().try_into().ok().and_then(Key::from_bytes);
    key.ok_or_else(|| refuse(&"is no key, or is damaged; `hzn key` makes one"))
}

/// Returns whether others than the owner of a file have a right to it.
fn is_open_to_others(path: &Path) -> io::Result<bool> {
    let metadata = fs::metadata(path)?;
    #[cfg(unix)]
    return Ok(std::os::unix::fs::PermissionsExt::mode(&metadata.permissions()) & 0o077 != 0);
    #[cfg(not(unix))]
    return Ok(metadata.is_dir());
}

/// Reads the counter of a key; `None` if it is missing or damaged.
pub fn read_counter(key: &Path) -> Option<u64> {
    let text = String::from_utf8(hzn_files::limited::read(&counter_path(key), 64).ok()?).ok()?;
    // The checksum shows a file that was cut off: its number would be too small.
    let (number, crc) = text.trim_end().split_once(' ')?;
    (u32::from_str_radix(crc, 16).ok()? == crc32fast::hash(number.as_bytes())).then(|| number.parse().ok())?
}

/// Writes the counter of a key. Afterwards it is on the disk.
///
/// # Errors
/// The disk fails or is full. The earlier counter is then unchanged.
pub fn write_counter(key: &Path, counter: u64) -> io::Result<()> {
    let number = counter.to_string();
    write(&counter_path(key), format!("{number} {:08x}\n", crc32fast::hash(number.as_bytes())).as_bytes())
}

/// Writes a file that only its owner may read, completely or not at all.
fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let part = part_path(path);
    let mut options = File::options();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let written = options
        .open(&part)
        .and_then(|mut file| file.write_all(bytes).map(|()| file))
        .and_then(|file| publish(&file, &part, path));
    written.inspect_err(|_| {
        let _ = fs::remove_file(&part);
    })
}

/// A key that signs telecommands on the ground.
#[derive(Debug)]
pub struct Signer {
    path: PathBuf,
    key: Key,
    counter: u64,
}

impl Signer {
    /// Opens a key and its counter.
    ///
    /// # Errors
    /// The key cannot be used, or its counter is missing or damaged.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let key = read(path)?;
        let counter = read_counter(path).ok_or_else(|| {
            let what = "is missing or damaged; `hzn key FILE --counter N` writes one above all that were used";
            Error::usage(format!("{}: {what}", counter_path(path).display()))
        })?;
        Ok(Self { path: path.to_owned(), key, counter })
    }

    /// Returns the user data of a telecommand with a trailer, whose counter is the next one.
    ///
    /// # Errors
    /// The counter cannot be kept, or the telecommand does not fit into a packet.
    pub fn seal(&mut self, base: ApidBase, sequence: u16, user: &[u8]) -> Result<Vec<u8>, Error> {
        let counter = self.counter.saturating_add(1);
        // Before it is sent: a counter that was used may not come again.
        self.keep(counter)?;
        let mut sealed = vec![0; packet::MAX_BYTES];
        let mut out = Writer::new(&mut sealed);
        out.bytes(user);
        let too_long = || Error::usage("the command is too long for one packet with a trailer; split it".to_owned());
        let bytes = out.finish().ok_or_else(too_long)?;
        let end = self.key.seal(base, sequence, counter, bytes, &mut sealed).ok_or_else(too_long)?;
        sealed.truncate(end);
        Ok(sealed)
    }

    /// Leaves out the counters that the flight computer may have reserved before a reset.
    ///
    /// # Errors
    /// The counter cannot be kept.
    pub fn skip_reserved(&mut self) -> Result<(), Error> {
        self.keep(self.counter.saturating_add(RESERVED))
    }

    fn keep(&mut self, counter: u64) -> Result<(), Error> {
        let in_file = |e| Error::failed(format!("{}: {e}", counter_path(&self.path).display()));
        write_counter(&self.path, counter).map_err(in_file)?;
        self.counter = counter;
        Ok(())
    }
}

/// The keys of a flight computer.
#[cfg(target_os = "linux")]
#[derive(Debug, Default)]
pub(crate) struct Keys {
    paths: Vec<PathBuf>,
}

#[cfg(target_os = "linux")]
impl Keys {
    /// Takes the files of the keys. `tell` gets what is wrong with them: the flight begins, because a sensor that flies
    /// without commands is better than none.
    pub(crate) fn new(paths: &[PathBuf], tell: &crate::tell::Tell) -> Self {
        for path in paths {
            let what = match (read(path), read_counter(path)) {
                (Err(e), _) => e.to_string(),
                (Ok(_), None) => format!("{}: is missing or damaged", counter_path(path).display()),
                (Ok(_), Some(_)) => continue,
            };
            tell(&format!("warning: {what}; telecommands with this key are refused"));
        }
        Self { paths: paths.to_owned() }
    }

    pub(crate) fn is_used(&self) -> bool {
        !self.paths.is_empty()
    }
    fn path(&self, place: u8) -> Option<&Path> {
        Some(self.paths.get(usize::from(place))?.as_path())
    }
    pub(crate) fn read(&self, place: u8, into: &mut [u8; KEY_BYTES]) {
        if let Some(key) = self.path(place).and_then(|path| read(path).ok()) {
            *into = key.to_bytes();
        }
    }
    pub(crate) fn counter(&self, place: u8) -> Option<u64> {
        read_counter(self.path(place)?)
    }
    pub(crate) fn write_counter(&self, place: u8, counter: u64) -> bool {
        self.path(place).is_some_and(|path| write_counter(path, counter).is_ok())
    }
}

#[cfg(test)]
mod tests {
    use hzn_flight::authentication::TRAILER_BYTES;

    use super::*;

    #[test]
    fn a_key_is_made_once_and_only_its_owner_reads_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("vehicle.key");
        let key = create(&path, 42, 1).unwrap();
        assert_eq!((read(&path).unwrap(), read_counter(&path)), (key.clone(), Some(0)));
        assert_ne!(key.secret, create(&dir.path().join("other.key"), 42, 1).unwrap().secret);
        assert!(create(&path, 42, 1).unwrap_err().to_string().contains("never replaced"));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
            assert_eq!((mode(&path), mode(&counter_path(&path))), (0o600, 0o600));
            fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
            assert!(read(&path).unwrap_err().to_string().contains("chmod 600"));
            fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        }
        let bytes = fs::read(&path).unwrap();
        for damaged in [&bytes[..47], &[&bytes[..], b"\n"].concat(), b"secret"] {
            fs::write(&path, damaged).unwrap();
            assert!(read(&path).unwrap_err().to_string().contains("is no key"), "{}", damaged.len());
        }
    }

    #[test]
    fn a_counter_goes_on_and_a_damaged_one_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("k");
        let key = create(&path, 1, 3).unwrap();
        for counter in [1, 2] {
            let sealed = Signer::open(&path).unwrap().seal(ApidBase::DEFAULT, 5, &[11]).unwrap();
            assert_eq!((sealed.len(), read_counter(&path)), (1 + TRAILER_BYTES, Some(counter)));
            assert!(key.is_right(ApidBase::DEFAULT, 5, &sealed));
        }
        Signer::open(&path).unwrap().skip_reserved().unwrap();
        assert_eq!(read_counter(&path), Some(2 + RESERVED));
        for damaged in ["25", "258 00000000\n", "", "x y"] {
            fs::write(counter_path(&path), damaged).unwrap();
            assert_eq!(read_counter(&path), None, "{damaged}");
        }
        assert!(Signer::open(&path).unwrap_err().to_string().contains("k.counter: is missing or damaged"));
    }
}
