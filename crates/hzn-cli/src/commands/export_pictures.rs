//! `hzn export --images` of a bag, of a recording of another program, or of a video.

use std::path::Path;

use hzn_mcap::{Contents, Reader};
use hzn_run::source::{self, Source, ending};
use hzn_run::{disk, explain, overlay};

use crate::exit::{Exit, Outcome, Stop, usage};
use crate::tell;

/// Opens an input that has pictures and no rows of hzn; `None` for another one. A recording is opened only if
/// `only_pictures` says that nothing else is wanted.
// A recording of hzn that lost its rows looks like one of another program. The reader of rows says what was lost.
pub(super) fn open(file: &Path, topics: &[String], only_pictures: bool) -> Result<Option<Box<dyn Source>>, Stop> {
    if let [_, second, ..] = topics {
        return Err(usage(format!("--topic {second}: the pictures of one topic are written at a time")));
    }
    let open = || source::open(std::slice::from_ref(&file.to_owned()), None, topics.first().map(String::as_str));
    if source::is_bag(file) || source::is_video(file) {
        return Ok(Some(open()?));
    }
    // What cannot be opened is told by the reader of rows.
    let is_recording = only_pictures && file.is_file() && ending(file) == "mcap";
    Ok((is_recording && !has_rows(file)).then(|| open().ok()).flatten())
}

fn has_rows(file: &Path) -> bool {
    Reader::open(file, Contents::WithoutImages).is_ok_and(|mut reader| reader.next().is_some())
}

/// Writes the pictures as PNG into a folder.
pub(super) fn run(source: &mut dyn Source, folder: &Path, force: bool) -> Outcome {
    std::fs::create_dir_all(folder).map_err(|e| disk::cannot_write(folder, &e))?;
    let (mut written, mut unread) = (0u64, 0u64);
    while let Some(item) = source.next().transpose()? {
        let name = item.name;
        let png = item.payload.decode(None).and_then(|(picture, _)| picture.to_png());
        match png {
            Ok(png) => {
                let path = folder.join(picture_name(&name, "png"));
                disk::refuse_existing(&path, force)?;
                disk::write(&path, png)?;
                written += 1;
            }
            Err(why) => {
                unread += 1;
                tell::warning(format_args!("{name}: {why}"));
            }
        }
    }
    let lost = source.describe_loss();
    lost.iter().for_each(tell::warning);
    tell::line(explain::counted(written, "picture"));
    Ok(if unread > 0 || lost.is_some() { Exit::SomeUnreadable } else { Exit::Done })
}

/// Returns the file name for a picture: its own name, with an ending that fits its bytes.
pub(super) fn picture_name(name: &str, ending: &str) -> String {
    let flat = overlay::flat_name(name);
    let same = |e: &str| e == ending || (ending == "jpg" && matches!(e, "jpeg" | "jpe"));
    if same(&source::ending(Path::new(&flat))) { flat } else { format!("{flat}.{ending}") }
}
