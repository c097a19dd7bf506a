//! `hzn export`: writes results in another form.

use std::path::{Path, PathBuf};

use hzn_mcap::{Contents, FrameRecord, ImageFormat, Reader};
use hzn_run::instruments::Instrument;
use hzn_run::overlay::caption::Caption;
use hzn_run::sink::{self, Existing, RowFile};
use hzn_run::source::{self, Source};
use hzn_run::{disk, explain, overlay, results};

use super::export_pictures::picture_name;
use super::{export_instruments, export_pictures};
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::files;
use crate::kind_of_file;
use crate::origin::Origin;
use crate::setup::TableFormat;
use crate::tell;

/// Turn a recording into a table, pictures, or pictures with overlay
///
/// From a recording of ROS 2, or from a video of a GoPro, --imu and --gnss write the tables of inertial unit and
/// receiver that `hzn fuse` reads.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// An MCAP of hzn; for tables also a .csv or .jsonl; for --imu and --gnss a recording or bag folder of
    /// ROS 2, or a video of a GoPro
    file: PathBuf,
    /// A table: .csv, .jsonl, or - for stdout
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Format of the table on stdout; without it, csv
    #[arg(long, value_name = "FORMAT")]
    format: Option<TableFormat>,
    /// The folder for the recorded pictures, also those of a bag, of another program, or of a video
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,
    /// The folder for the recorded pictures with everything drawn over them, as PNG
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// A table of the inertial unit for `hzn fuse --imu`, from the messages sensor_msgs/Imu of ROS 2, or from a video
    #[arg(long, value_name = "CSV")]
    imu: Option<PathBuf>,
    /// A table of the receiver for `hzn fuse --gnss`, from the messages sensor_msgs/NavSatFix of ROS 2, or from a
    /// video
    #[arg(long, value_name = "CSV")]
    gnss: Option<PathBuf>,
    /// The topic for --imu, --gnss or --images, if there are several; may be given twice
    #[arg(long, value_name = "TOPIC")]
    topic: Vec<String>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

impl Args {
    fn wants_only_pictures(&self) -> bool {
        self.images.is_some() && self.output.is_none() && self.overlay.is_none()
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    let tables = [(Instrument::Imu, &args.imu), (Instrument::Gnss, &args.gnss)];
    let tables: Vec<(Instrument, &Path)> =
        tables.into_iter().filter_map(|(which, path)| Some((which, path.as_deref()?))).collect();
    if tables.is_empty() {
        TableFormat::tell_unused(args.format, args.output.iter());
        return match export_pictures::open(&args.file, &args.topic, args.wants_only_pictures())? {
            Some(source) => export_pictures_of_others(args, source),
            None => export_rows(args),
        };
    }
    if args.output.is_some() || args.images.is_some() || args.overlay.is_some() {
        return Err(usage(
            "--imu and --gnss are for recordings of ROS 2 and videos, the other outputs for recordings of hzn",
        ));
    }
    export_instruments::run(&args.file, &tables, &args.topic, args.force)
}

/// Writes the pictures of an input that has no rows.
fn export_pictures_of_others(args: &Args, mut source: Box<dyn Source>) -> Outcome {
    let name = args.file.display();
    match &args.images {
        Some(folder) if args.wants_only_pictures() => export_pictures::run(source.as_mut(), folder, args.force),
        _ => Err(usage(format!(
            "{name}: has pictures and no rows of hzn: --images DIR writes the pictures, and \
             `hzn run {name} -o out.csv` makes rows"
        ))),
    }
}

/// Writes the rows and the pictures of a recording of hzn.
fn export_rows(args: &Args) -> Outcome {
    let file = &args.file;
    let (kind, _) = source::check_exists(file)?;
    kind_of_file::refuse_other_table(file)?;
    let pictures = args.images.is_some() || args.overlay.is_some();
    if args.output.is_none() && !pictures {
        return Err(usage(
            "nothing to export: give -o out.csv, -o out.jsonl, --images DIR or --overlay DIR; or --imu imu.csv, --gnss \
             gnss.csv for a recording of ROS 2 or a video",
        ));
    }
    let to_file = args.output.as_ref().filter(|path| !source::is_stdin(path));
    if let Some(path) = to_file
        && sink::target(path)? == sink::Target::Mcap
    {
        return Err(usage(format!("{}: a table must end in .csv or .jsonl", path.display())));
    }
    if kind != "mcap" && pictures {
        return Err(usage(format!("{}: only a recording (.mcap) contains pictures", file.display())));
    }
    let folders = [&args.images, &args.overlay].into_iter().flatten();
    let written = to_file.into_iter().cloned().chain(folders.clone().flat_map(|folder| files::pictures_in(folder)));
    disk::refuse_inputs(std::slice::from_ref(file), &written.collect::<Vec<_>>())?;
    for folder in folders {
        std::fs::create_dir_all(folder).map_err(|e| disk::cannot_write(folder, &e))?;
    }
    let existing = if args.force { Existing::Replace } else { Existing::Refuse };
    let mut table = args.output.as_deref().map(|path| open_table(args, path, existing)).transpose()?;
    let (mut rows, mut images, mut lost) = (0u64, 0u64, None);
    if kind == "mcap" {
        let contents = if pictures { Contents::All } else { Contents::WithoutImages };
        let mut reader = Reader::open(file, contents).map_err(failed)?;
        let mut origin = Origin::default();
        while let Some(frame) = reader.next().transpose().map_err(failed)? {
            rows += 1;
            if let Some(table) = &mut table {
                table.write(&frame.row)?;
            }
            if pictures {
                let line = origin.of(&reader, frame.row.head.as_deref());
                images += u64::from(write_pictures(args, frame, &line)?);
            }
        }
        lost = source::describe_recording_loss(&reader, file, "exported");
        if pictures && images == 0 {
            tell::warning(format_args!("{}: contains no pictures (was it recorded with --no-images?)", file.display()));
        }
    } else {
        for row in results::rows(file, &kind)? {
            rows += 1;
            if let Some(table) = &mut table {
                table.write(&row?)?;
            }
        }
    }
    table.map(RowFile::finish).transpose()?;
    tell::line(counts_text(args, rows, images));
    lost.iter().for_each(tell::warning);
    Ok(if lost.is_some() { Exit::SomeUnreadable } else { Exit::Done })
}

/// Says how much was written.
fn counts_text(args: &Args, rows: u64, images: u64) -> String {
    let mut written: Vec<String> = args.output.iter().map(|_| explain::counted(rows, "row")).collect();
    written.extend(args.images.iter().map(|_| explain::counted(images, "picture")));
    written.extend(args.overlay.iter().map(|_| explain::counted(images, "overlay")));
    written.join(", ")
}

fn open_table(args: &Args, path: &Path, existing: Existing) -> Result<RowFile, Stop> {
    let is_stdout = source::is_stdin(path);
    Ok(if is_stdout { RowFile::on_stdout(TableFormat::or_csv(args.format))? } else { RowFile::create(path, existing)? })
}

/// Writes the picture of a frame. `provenance` is the last line of the caption of an overlay.
fn write_pictures(args: &Args, frame: FrameRecord, provenance: &str) -> Result<bool, Stop> {
    let Some(image) = frame.image else { return Ok(false) };
    let name = frame.row.file.clone();
    // The pictures of two heads of a rig may have the same names.
    let own = |folder: &Path| -> Result<PathBuf, Stop> {
        let Some(head) = &frame.row.head else { return Ok(folder.to_owned()) };
        let folder = folder.join(overlay::flat_name(head));
        std::fs::create_dir_all(&folder).map_err(|e| disk::cannot_write(&folder, &e))?;
        Ok(folder)
    };
    if let Some(folder) = &args.images {
        let (bytes, ending) = match &image.format {
            ImageFormat::Png => (image.bytes.clone(), "png"),
            ImageFormat::Jpeg => (image.bytes.clone(), "jpg"),
            _ => (decode(&image, &name)?.to_png().map_err(failed)?, "png"),
        };
        let path = own(folder)?.join(picture_name(&name, ending));
        disk::refuse_existing(&path, args.force)?;
        disk::write(&path, bytes)?;
    }
    if let Some(folder) = &args.overlay {
        let path = own(folder)?.join(overlay::file_name(&name));
        disk::refuse_existing(&path, args.force)?;
        let picture = decode(&image, &name)?;
        let rows = std::slice::from_ref(&frame.row);
        let caption = Caption::new(&name, frame.row.time_s, rows, &frame.annotations).with_provenance(provenance);
        let drawn = overlay::draw(picture.to_rgb(), &frame.annotations, &[], &caption);
        overlay::save(&drawn, &path)?;
    }
    Ok(true)
}

fn decode(image: &hzn_mcap::EncodedImage, name: &str) -> Result<hzn_run::source::Picture, Stop> {
    let decoded = hzn_run::source::Payload::from_recorded(image.clone()).decode(None);
    decoded.map(|(picture, _)| picture).map_err(|why| failed(format!("{name}: {why}")))
}
