//! Arbitrary files: pictures, recordings, results.

use hzn_mcap::{Contents, ImageReader, Index, IndexEntry, Reader};
use hzn_run::sink::{Target, recover_text};
use hzn_run::source::{Payload, Raw, decode};

use crate::input::with_file;

/// A picture file, or a file without a header. The picture has at most the expected size, so that one execution takes
/// about a millisecond. The first byte chooses the kind.
pub(crate) fn picture_file(bytes: &[u8]) {
    let Some((which, rest)) = bytes.split_first() else { return };
    match which % 3 {
        0 => {
            if let Ok(picture) = decode::decode(rest, Some((32, 24))) {
                assert_eq!((picture.layout.width, picture.layout.height), (32, 24));
                picture.to_rgb();
                picture.to_png().expect("a decoded picture can be written");
            }
        }
        1 => {
            // The description of the format ends at the first line end.
            let (text, data) = rest.split_at(rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len()));
            let raw = std::str::from_utf8(text).ok().and_then(|text| text.parse::<Raw>().ok());
            if let Some(raw) = raw.filter(|raw| raw.bytes() < 1 << 20) {
                let _ = raw.decode(data.get(1..).unwrap_or_default());
                let whole: Vec<u8> = (0..raw.bytes()).map(|i| data.get(i).copied().unwrap_or(i as u8)).collect();
                raw.decode(&whole).expect("the right number of bytes");
            }
        }
        _ => with_file("picture", rest, |path, _| {
            let _ = (hzn_run::source::exif_time_s(path), hzn_run::source::exif_lens(path));
        }),
    }
}

/// A recording: the reader, the index, the reader of pictures, and the recovery never lose a frame that another finds.
pub(crate) fn mcap(bytes: &[u8]) {
    with_file("recording.mcap", bytes, |path, out| {
        let frames = |path| {
            let reader = Reader::open(path, Contents::All).ok()?;
            reader.collect::<Result<Vec<_>, _>>().ok().map(|frames| frames.len() as u64)
        };
        let whole = frames(path);
        if let Ok(reader) = Reader::open(path, Contents::WithoutImages) {
            reader.for_each(drop);
        }
        if let Ok(mut index) = Index::open(path) {
            while let Ok(Some(part)) = index.next_part() {
                let Ok(mut pictures) = index.pictures() else { break };
                for entry in &part {
                    if let IndexEntry::Picture(place) = entry
                        && let Ok(picture) = pictures.read(place)
                        && let Ok(image) = picture.image
                    {
                        let _ = Payload::from_recorded(image);
                    }
                }
            }
        }
        if let Ok(images) = ImageReader::open(path, None) {
            images.for_each(drop);
        }
        if let (Ok(_), Some(whole)) = (hzn_mcap::recover(path, out), whole) {
            let kept = frames(out).expect("a recovered recording can be read");
            assert_eq!(kept, whole, "the recovery keeps every frame");
        }
    });
}

/// Results as CSV or JSON Lines. The first byte chooses the kind.
pub(crate) fn results(bytes: &[u8]) {
    let Some((which, rest)) = bytes.split_first() else { return };
    let (kind, target) = if which % 2 == 0 { ("csv", Target::Csv) } else { ("jsonl", Target::Jsonl) };
    with_file(&format!("results.{kind}"), rest, |path, out| {
        let whole: Option<Vec<_>> =
            hzn_run::results::rows(path, kind).ok().and_then(|rows| rows.map(Result::ok).collect());
        if let Ok(recovered) = recover_text(path, out, target) {
            let rows = hzn_run::results::rows(out, kind).expect("a recovered table can be opened");
            let rows: Result<Vec<_>, _> = rows.collect();
            assert_eq!(rows.expect("a recovered table can be read").len() as u64, recovered.rows);
            assert!(whole.is_none_or(|whole| whole.len() as u64 >= recovered.rows));
        }
    });
}
