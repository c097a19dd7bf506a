//! The metadata track of a video of an action camera: its payloads, and the metadata of the whole file.
//!
//! ffmpeg is not asked, because it hands out this track without the times of the payloads. Only the boxes that say
//! where the payloads are and when they were taken are read (ISO/IEC 14496-12); their names are those of the standard.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Largest box with the index of a file. Ten hours of video need about 50 MB.
const MAX_INDEX_BYTES: u64 = 256 << 20;
/// Most boxes beside the index. A camera writes a few; a file that was made to take time has millions.
const MAX_BOXES: usize = 100_000;
/// Largest payload. A second of measurements has about 20 kB.
const MAX_PAYLOAD_BYTES: u64 = 4 << 20;
/// Most payloads: eleven days, with one a second.
const MAX_PAYLOADS: usize = 1_000_000;
/// Most bytes of all payloads.
const MAX_BYTES: u64 = 512 << 20;

/// What a camera measured during a part of the video.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Payload {
    /// Time of the beginning, in seconds on the clock of the video.
    pub(super) time_s: f64,
    /// Duration in seconds.
    pub(super) duration_s: f64,
    pub(super) bytes: Vec<u8>,
}

/// The metadata of a video.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Metadata {
    pub(super) payloads: Vec<Payload>,
    /// The metadata of the whole file.
    pub(super) global: Vec<u8>,
}

/// Reads the metadata of a video; `None` if the file has none, or is no MP4 or MOV.
///
/// # Errors
/// The file cannot be read.
pub(super) fn read(path: &Path) -> io::Result<Option<Metadata>> {
    let mut file = File::open(path)?;
    let Some(index) = read_index(&mut file)? else { return Ok(None) };
    let global = child(&index, &[b"udta", b"GPMF"]).unwrap_or_default().to_vec();
    let track = boxes(&index).filter(|(kind, _)| kind == b"trak").find_map(|(_, track)| Track::new(track));
    let payloads = track.map(|track| track.read(&mut file)).transpose()?.unwrap_or_default();
    Ok((!payloads.is_empty() || !global.is_empty()).then_some(Metadata { payloads, global }))
}

/// Reads the box `moov`, which has the index of a file; `None` if there is none.
fn read_index(file: &mut File) -> io::Result<Option<Vec<u8>>> {
    let end = file.metadata()?.len();
    let mut at = 0u64;
    for _ in 0..MAX_BOXES {
        if at >= end {
            break;
        }
        file.seek(SeekFrom::Start(at))?;
        let mut head = Vec::new();
        file.take(16).read_to_end(&mut head)?;
        let Some((size, head_bytes)) = box_size(&head, end - at) else { return Ok(None) };
        if head.get(4..8) == Some(b"moov") {
            let bytes = size - head_bytes;
            if bytes > MAX_INDEX_BYTES {
                return Ok(None);
            }
            file.seek(SeekFrom::Start(at + head_bytes))?;
            let mut index = Vec::new();
            file.take(bytes).read_to_end(&mut index)?;
            return Ok(Some(index));
        }
        at = at.saturating_add(size);
    }
    Ok(None)
}

/// Returns the size of a box and of its head, bytes. `rest` is the number of bytes from its beginning on.
fn box_size(head: &[u8], rest: u64) -> Option<(u64, u64)> {
    let (size, head_bytes) = match u64::from(be32(head, 0)?) {
        0 => (rest, 8),
        1 => (be64(head, 8)?, 16),
        size => (size, 8),
    };
    (size >= head_bytes).then_some((size, head_bytes))
}

/// Returns the boxes in some bytes, with their kinds. A box that is cut off ends the list.
fn boxes(mut bytes: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    std::iter::from_fn(move || {
        let (size, head_bytes) = box_size(bytes, bytes.len() as u64)?;
        let (kind, body) = (bytes.get(4..8)?, bytes.get(head_bytes as usize..usize::try_from(size).ok()?)?);
        bytes = bytes.get(usize::try_from(size).ok()?..)?;
        Some((kind, body))
    })
}

/// Returns the first box at the end of a path of kinds.
fn child<'a>(bytes: &'a [u8], path: &[&[u8; 4]]) -> Option<&'a [u8]> {
    let (kind, rest) = path.split_first()?;
    let mut bodies = boxes(bytes).filter(|(found, _)| found == *kind).map(|(_, body)| body);
    if rest.is_empty() { bodies.next() } else { bodies.find_map(|body| child(body, rest)) }
}

/// Where the payloads of a track are, and when.
struct Track<'a> {
    /// Units of time in a second.
    per_s: f64,
    table: &'a [u8],
}

impl<'a> Track<'a> {
    /// Returns the track if its samples are GPMF.
    fn new(track: &'a [u8]) -> Option<Self> {
        let media = child(track, &[b"mdia"])?;
        let table = child(media, &[b"minf", b"stbl"])?;
        // Version and flags, number of entries, and then the size and the kind of the first one.
        (child(table, &[b"stsd"])?.get(12..16)? == b"gpmd").then_some(())?;
        let header = child(media, &[b"mdhd"])?;
        let per_s = be32(header, if header.first() == Some(&1) { 20 } else { 12 })?;
        (per_s > 0).then(|| Self { per_s: per_s.into(), table })
    }

    fn read(&self, file: &mut File) -> io::Result<Vec<Payload>> {
        let end = file.metadata()?.len();
        let (mut payloads, mut total) = (Vec::new(), 0u64);
        for (place, time) in self.places().into_iter().zip(self.times()) {
            let (offset, size) = place;
            total = total.saturating_add(size);
            // A file that was cut off has no further payloads.
            if offset.saturating_add(size) > end || size > MAX_PAYLOAD_BYTES || total > MAX_BYTES {
                break;
            }
            file.seek(SeekFrom::Start(offset))?;
            let mut bytes = vec![0; size as usize];
            file.read_exact(&mut bytes)?;
            let (begin, duration) = time;
            payloads.push(Payload { time_s: begin / self.per_s, duration_s: duration / self.per_s, bytes });
        }
        Ok(payloads)
    }

    /// Returns offset and size of each payload, bytes.
    fn places(&self) -> Vec<(u64, u64)> {
        let find = |kind: &[u8; 4]| child(self.table, &[kind]).unwrap_or_default();
        let (sizes, chunks) = (find(b"stsz"), find(b"stsc"));
        let same = be32(sizes, 4).unwrap_or_default();
        let mut sizes = (0..be32(sizes, 8).unwrap_or_default() as usize).map_while(|i| match same {
            0 => be32(sizes, 12 + 4 * i).map(u64::from),
            same => Some(same.into()),
        });
        let wide = find(b"co64");
        let offset = |i: usize| match wide {
            [] => be32(find(b"stco"), 8 + 4 * i).map(u64::from),
            wide => be64(wide, 8 + 8 * i),
        };
        // An entry holds from its first chunk on, which is counted from 1.
        let mut entries = (0..).map_while(|i| Some((be32(chunks, 8 + 12 * i)?, be32(chunks, 12 + 12 * i)?))).peekable();
        let (mut places, mut in_chunk) = (Vec::new(), 0);
        for (number, mut at) in (0..).map_while(offset).enumerate() {
            while let Some((_, count)) = entries.next_if(|(first, _)| *first as usize <= number + 1) {
                in_chunk = count;
            }
            for size in sizes.by_ref().take(in_chunk as usize) {
                if places.len() == MAX_PAYLOADS {
                    return places;
                }
                places.push((at, size));
                at = at.saturating_add(size);
            }
        }
        places
    }

    /// Returns the beginning and the duration of each payload, in units of the track.
    fn times(&self) -> impl Iterator<Item = (f64, f64)> {
        let table = child(self.table, &[b"stts"]).unwrap_or_default();
        let runs = (0..).map_while(|i| Some((be32(table, 8 + 8 * i)?, be32(table, 12 + 8 * i)?)));
        let durations = runs.flat_map(|(count, duration)| std::iter::repeat_n(f64::from(duration), count as usize));
        let mut begin = 0.0;
        durations.map(move |duration| {
            begin += duration;
            (begin - duration, duration)
        })
    }
}

fn be32(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|b| u32::from_be_bytes(*b))
}

fn be64(bytes: &[u8], at: usize) -> Option<u64> {
    bytes.get(at..)?.first_chunk().map(|b| u64::from_be_bytes(*b))
}
