//! The file next to an output that says of each picture which one was processed, and that its rows are those that were
//! written: `NAME.part.chain`.
//!
//! It has sixteen bytes for each picture (each epoch of a rig): what tells the picture from another one, see
//! [`Payload::identity`](crate::source::Payload), or 0; and a digest of this number, of the checksums of the rows, and
//! of the digest before. A row that was changed together with its checksum therefore breaks the chain, and so does one
//! of another run. Such a file is no part of the results. It is there only until a run has ended by itself, and a run
//! can be continued without it: the times of the files then decide which pictures were changed.
//!
//! A power cut can leave an end of zeros, or an earlier file. Zeros say nothing, and an earlier file breaks the chain:
//! the pictures are then processed again and compared. A file that is wrong costs time, and nothing else.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::disk::{chain_path, run_advice};
use crate::error::{Error, failed};
use crate::source::identity::digest;

/// First bytes of the file, which also say its version.
const MAGIC: [u8; 16] = *b"hzn chain 1\n\0\0\0\0";
/// Number of bytes of a picture.
const LINK: usize = 16;

/// What a file says of the pictures of an output.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Links {
    /// For each picture: what tells it from another one, or 0 if this is not known, and the digest.
    each: Vec<[u64; 2]>,
    /// The first picture whose rows are not those that were written.
    contradicted_from: Option<u64>,
}

impl Links {
    /// Reads the file next to an output, and compares it with the rows of the pictures that the output contains.
    /// `sums` returns the checksums of the rows of a picture. Without a file, nothing is known.
    pub(super) fn read<'a>(path: &Path, frames: u64, sums: impl Fn(u64) -> &'a [u32]) -> Self {
        let mut links = Self::default();
        let bytes = std::fs::read(chain_path(path)).unwrap_or_default();
        let each = bytes.strip_prefix(&MAGIC).unwrap_or_default().chunks_exact(LINK);
        for (n, link) in (0..frames).zip(each) {
            let number = |at: usize| link.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |b| u64::from_le_bytes(*b));
            let (identity, told) = (number(0), number(8));
            if told == 0 {
                break;
            }
            if told != links.add(identity, sums(n)) {
                links.each.pop();
                links.contradicted_from = Some(n);
                break;
            }
        }
        links
    }

    /// Returns what tells a picture from another one, if it is known.
    pub(super) fn identity(&self, n: u64) -> Option<u64> {
        self.each.get(n as usize).map(|[identity, _]| *identity).filter(|identity| *identity != 0)
    }

    pub(super) fn contradicted_from(&self) -> Option<u64> {
        self.contradicted_from
    }

    /// Adds a picture with the checksums of its rows. Returns its digest.
    fn add(&mut self, identity: u64, sums: &[u32]) -> u64 {
        let link = next(self.each.last().map_or(0, |[_, last]| *last), identity, sums);
        self.each.push([identity, link]);
        link
    }
}

/// Returns the digest of a picture after that of the picture before.
fn next(last: u64, identity: u64, sums: &[u32]) -> u64 {
    digest([last, identity].into_iter().chain(sums.iter().map(|sum| u64::from(*sum))))
}

/// The file while a run writes it.
pub(super) struct Chain {
    path: PathBuf,
    /// What is known of the pictures of earlier runs, until the file is open.
    before: Links,
    /// The digest of the last picture.
    last: u64,
    /// The file. It is opened for the first picture that this run writes, so that a refused run changes nothing.
    file: Option<BufWriter<File>>,
}

impl Chain {
    /// Prepares the file next to an output that contains these pictures. `before` was [read](Links::read) of it.
    pub(super) fn new<'a>(path: &Path, mut before: Links, frames: u64, sums: impl Fn(u64) -> &'a [u32]) -> Self {
        // Of these, only the times of the files are known.
        for n in before.each.len() as u64..frames {
            before.add(0, sums(n));
        }
        let last = before.each.last().map_or(0, |[_, last]| *last);
        Self { path: chain_path(path), before, last, file: None }
    }

    /// Adds a picture with the checksums of its rows.
    pub(super) fn add(&mut self, identity: Option<u64>, sums: &[u32]) -> Result<(), Error> {
        let identity = identity.unwrap_or(0);
        self.last = next(self.last, identity, sums);
        let bytes = link_bytes([identity, self.last]);
        let written = match &mut self.file {
            Some(file) => file.write_all(&bytes),
            None => self.open().and_then(|mut file| {
                file.write_all(&bytes)?;
                self.file = Some(file);
                Ok(())
            }),
        };
        written.map_err(|e| failed(run_advice(&self.path, &e)))
    }

    /// Opens the file with the pictures before this run. They are written over what the file has, which is the same.
    fn open(&mut self) -> io::Result<BufWriter<File>> {
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(&self.path)?;
        let before = std::mem::take(&mut self.before).each;
        file.set_len((MAGIC.len() + LINK * before.len()) as u64)?;
        let mut file = BufWriter::new(file);
        file.write_all(&MAGIC)?;
        before.iter().try_for_each(|link| file.write_all(&link_bytes(*link)))?;
        Ok(file)
    }

    /// Passes what was added to the system. It does not wait for the disk: the file is of no use without the rows.
    pub(super) fn flush(&mut self) -> Result<(), Error> {
        self.file.as_mut().map_or(Ok(()), Write::flush).map_err(|e| failed(run_advice(&self.path, &e)))
    }

    /// Removes the file: the run is over. If that fails, the file is of no harm.
    pub(super) fn remove(self) {
        drop(self.file);
        let _ = std::fs::remove_file(&self.path);
    }
}

fn link_bytes(link: [u64; 2]) -> [u8; LINK] {
    let mut bytes = [0; LINK];
    bytes.chunks_exact_mut(8).zip(link).for_each(|(bytes, number)| bytes.copy_from_slice(&number.to_le_bytes()));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn links(path: &Path, sums: &[u32]) -> Links {
        Links::read(path, sums.len() as u64, |n| &sums[n as usize..][..1])
    }

    fn chain(path: &Path, sums: &[u32]) -> Chain {
        Chain::new(path, links(path, sums), sums.len() as u64, |n| &sums[n as usize..][..1])
    }

    fn read(path: &Path, sums: &[u32]) -> (Vec<Option<u64>>, Option<u64>) {
        let links = links(path, sums);
        ((0..sums.len() as u64).map(|n| links.identity(n)).collect(), links.contradicted_from())
    }

    #[test]
    fn a_changed_row_breaks_the_chain_from_its_picture_on() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.csv");
        assert_eq!(read(&path, &[1, 2]), (vec![None; 2], None), "without a file, nothing is known");
        let mut chain = self::chain(&path, &[]);
        assert!(!chain_path(&path).exists());
        for (identity, sum) in [(Some(10), 1), (None, 2), (Some(30), 3)] {
            chain.add(identity, &[sum]).unwrap();
        }
        chain.flush().unwrap();
        assert_eq!(read(&path, &[1, 2, 3]), (vec![Some(10), None, Some(30)], None));
        assert_eq!(read(&path, &[1, 2]).1, None, "a crash lost rows");
        assert_eq!(read(&path, &[1, 2, 3, 4]), (vec![Some(10), None, Some(30), None], None));
        assert_eq!(read(&path, &[1, 9, 3]), (vec![Some(10), None, None], Some(1)));
        assert_eq!(read(&path, &[9, 2, 3]).1, Some(0));
        // A continued run writes the same, and goes on. What it does not know of pictures stays unknown.
        let whole = std::fs::read(chain_path(&path)).unwrap();
        for kept in [vec![1, 2], vec![1, 2, 3, 4]] {
            let mut chain = self::chain(&path, &kept);
            (kept.len()..5).for_each(|n| chain.add(Some(10 * (n as u64 + 1)), &[n as u32 + 1]).unwrap());
            chain.flush().unwrap();
            let fourth = (kept.len() < 4).then_some(40);
            let known = vec![Some(10), None, Some(30), fourth, Some(50)];
            assert_eq!(read(&path, &[1, 2, 3, 4, 5]), (known, None));
            assert!(std::fs::read(chain_path(&path)).unwrap().starts_with(&whole));
            chain.remove();
            std::fs::write(chain_path(&path), &whole).unwrap();
        }
        // A power cut left zeros, or a part of the last picture.
        std::fs::write(chain_path(&path), [&whole[..32], &[0; 32]].concat()).unwrap();
        assert_eq!(read(&path, &[1, 2, 3]), (vec![Some(10), None, None], None));
        std::fs::write(chain_path(&path), &whole[..60]).unwrap();
        assert_eq!(read(&path, &[1, 2, 3]).1, None);
    }
}
