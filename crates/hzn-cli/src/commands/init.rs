//! `hzn init`: writes a sensor.toml to start from.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use hzn_core::Config;
use hzn_core::camera::Model;
use hzn_files::start::{self, CameraFacts, ImageCircle, StartConfig};
use hzn_files::{Problem, plausible};
use hzn_run::diagnosis::FieldOfView;
use hzn_run::open::{self, Request};
use hzn_run::source::{self, Source};
use hzn_run::start::{
    Calibration, Check, LimbSays, check_start, measure_field_of_view, read_calibration, read_camera_facts,
};
use hzn_run::{disk, explain};

use super::init_rig;
use crate::exit::{Exit, Outcome, Stop, usage};
use crate::files;
use crate::tell;

/// Write a sensor.toml to start from
///
/// With pictures: the file is for the camera that took them. The focal length comes from a field of view (--fov), from
/// their EXIF, or else from the curvature of the limb in them, for which an altitude must be known. Its sigmas are
/// large, because these values are rough; with an altitude the file works at once.
/// Without pictures: the file has every key with its default and a comment, and only the camera must be filled in.
/// With --rig: the file is a rig.toml for several cameras, each with a folder for its pictures and its sensor.toml.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Pictures of the camera: files, a folder, a glob, a video, or a recording
    #[arg(value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    /// Field of view over the whole width, degrees
    #[arg(long, value_name = "DEG", requires = "pictures")]
    fov: Option<f64>,
    /// Kind of lens [default: pinhole, up to a field of view of 90 degrees]
    #[arg(long, requires = "pictures")]
    lens: Option<Lens>,
    /// The body in the pictures; the Moon as seen from an orbit or a flight around it, the Sun as a disc in the sky
    #[arg(long, value_name = "NAME", default_value = "earth", value_parser = body_parser(), requires = "pictures")]
    body: start::Body,
    /// Altitude of all pictures above WGS-84, or above the mean radius of another body, kilometres, if no frames.csv
    /// gives one
    #[arg(long, value_name = "KM", requires = "pictures")]
    altitude: Option<f64>,
    /// Topic of the pictures in an MCAP; without it, the first topic with pictures
    #[arg(long, value_name = "TOPIC", requires = "pictures")]
    topic: Option<String>,
    /// Write a rig.toml for several cameras (heads); the pictures are a folder for each head
    #[arg(long, requires = "pictures", conflicts_with_all = ["fov", "lens", "altitude", "topic"])]
    rig: bool,
    /// With --rig: rotation from the camera to the rig as a quaternion, scalar first; once for each folder, in order
    #[arg(long, value_name = "W,X,Y,Z", requires = "rig", allow_hyphen_values = true)]
    mount: Vec<init_rig::Mount>,
    /// With --rig: the mounts from a camchain of Kalibr (T_cn_cnm1) instead of --mount; its cameras are the folders, in
    /// order, and the rig has the axes of the first camera
    #[arg(long, value_name = "YAML", requires = "rig", conflicts_with = "mount")]
    camchain: Option<PathBuf>,
    /// The file to write [default: sensor.toml, with --rig rig.toml]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
}

/// Returns whether a body has no air.
fn has_no_air(body: start::Body) -> bool {
    match body {
        start::Body::Earth | start::Body::Sun => false,
        start::Body::Moon => true,
        start::Body::Other(kind) => kind.planet().is_some_and(|planet| planet.scale_height_km == 0.0),
    }
}

/// Reads the name of a body.
fn body_parser() -> impl TypedValueParser<Value = start::Body> {
    PossibleValuesParser::new(start::Body::all().map(start::Body::name))
        .try_map(|name| start::Body::from_name(&name).ok_or("no such body"))
}

/// The projection of the lens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Lens {
    /// Straight lines stay straight
    Pinhole,
    /// Equidistant: the radius is proportional to the angle off axis
    Fisheye,
}

impl From<Lens> for Model {
    fn from(lens: Lens) -> Self {
        match lens {
            Lens::Pinhole => Self::Pinhole,
            Lens::Fisheye => Self::Equidistant,
        }
    }
}

impl Args {
    /// Returns the file to write.
    fn output(&self) -> &Path {
        self.output.as_deref().unwrap_or(Path::new(if self.rig { "rig.toml" } else { "sensor.toml" }))
    }
    /// Opens the pictures.
    fn open(&self) -> Result<Box<dyn Source>, Stop> {
        Ok(source::open(&self.pictures, None, self.topic.as_deref())?)
    }
    /// Returns the mounts of the heads of a rig.
    fn mounts(&self) -> Result<Vec<init_rig::Mount>, Stop> {
        self.camchain.as_deref().map_or_else(|| Ok(self.mount.clone()), init_rig::of_camchain)
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    if args.rig {
        let read: Vec<PathBuf> = args.camchain.iter().cloned().collect();
        files::check_outputs(&read, &[args.output().to_owned()], args.force)?;
        return init_rig::run(&args.pictures, &args.mounts()?, args.output());
    }
    if let Some(file) = args.pictures.iter().find(|p| source::ending(p) == "toml") {
        let name = file.display();
        return Err(usage(format!("{name}: is a file to write, not a picture; name it with -o:  hzn init -o {name}")));
    }
    let name = args.output().display();
    let source = if args.pictures.is_empty() { None } else { Some(args.open()?) };
    let read = source.as_ref().map(|source| source.files()).unwrap_or_default();
    disk::refuse_inputs(&read, &[args.output().to_owned()])?;
    if args.output().exists() && !args.force {
        return Err(usage(format!("{name}: exists already; choose another name with -o, or --force replaces it")));
    }
    let write = |text: &str| disk::write(args.output(), text);
    let Some(mut source) = source else {
        write(hzn_files::template::SENSOR_TOML)?;
        tell::line(format_args!("{name} written; fill in [camera], then look at it with  hzn camera show {name}"));
        return Ok(Exit::Done);
    };
    let mut known = known(args, source.as_mut())?;
    if let Some(text) = calibrated(args, &known)? {
        write(&text)?;
        return finish(args, &text, &known);
    }
    let found = if known.has_focal() { None } else { limb_fov(args, &known)? };
    if let Some(found) = &found {
        (known.lens, known.measured) = (Some(found.lens), Some(found.measured));
    }
    let (start, doubt) = checked_start(args, &mut known)?;
    write(&start.text)?;
    start.warnings.iter().for_each(tell::warning);
    tell_turn(&known);
    doubt.iter().for_each(tell::warning);
    if let Some(found) = &found {
        let [kept, seen] = found.pictures;
        tell::line(format_args!("the limb in {kept} of {seen} pictures says: {}", found.describe(known.size_px[0])));
    }
    tell_start(args, &known, &start);
    tell_circle(&start);
    tell_width(args, &known, start.lens);
    finish(args, &start.text, &known)
}

/// Returns the file to start from, and what the limb contradicts of it, or that the limb cannot check it. A
/// contradiction makes its sigma larger.
fn checked_start(args: &Args, known: &mut CameraFacts) -> Result<(StartConfig, Option<String>), Stop> {
    let write = |known: &CameraFacts| -> Result<_, Stop> {
        let start = start::write_sensor_toml(known).map_err(usage)?;
        // What the file says is checked before it is written: a refused file helps nobody.
        let parsed = hzn_files::sensor::parse(&start.text, args.output())?;
        Ok((start, parsed.config))
    };
    let (start, config) = write(known)?;
    let check = if known.has_focal() { check_start(&request(args), known, &start, &config)? } else { Check::Agrees };
    match check {
        Check::Agrees => Ok((start, None)),
        Check::Unchecked(text) => Ok((start, Some(text))),
        Check::Contradicted(doubt) => {
            known.doubt_percent = doubt.focal_percent;
            Ok((write(known)?.0, Some(doubt.text)))
        }
    }
}

fn tell_start(args: &Args, known: &CameraFacts, start: &StartConfig) {
    tell::line(format_args!(
        "{} written: {} x {} px, {}, {:.1} degrees wide, f = {:.0} px +- {:.1} %, k1 = 0 +- {:.2}",
        args.output().display(),
        known.size_px[0],
        known.size_px[1],
        start.lens.name(),
        start.fov_deg,
        start.focal_px,
        start.focal_sigma_percent,
        start.k1_sigma,
    ));
}

/// Says that the width is that of the stored picture, if the camera was turned.
fn tell_turn(known: &CameraFacts) {
    if known.exif.turned {
        tell::warning(
            "the camera was turned by 90 degrees (EXIF Orientation): the width is that of the stored picture",
        );
    }
}

/// Says which image circle the file has.
fn tell_circle(start: &StartConfig) {
    match start.image_circle {
        Some(ImageCircle::Seen { theta_max_deg }) => tell::line(format_args!(
            "all pictures are dark beyond {theta_max_deg:.1} degrees off axis: taken as the rim of the image circle \
             (theta_max_deg), which is masked; if it is the whole Earth in a camera that looks at the nadir, remove \
             that line"
        )),
        Some(ImageCircle::Assumed { theta_max_deg }) => tell::line(format_args!(
            "the corners lie too far off axis to be in the image: theta_max_deg = {theta_max_deg:.1} masks what is \
             beyond the sides"
        )),
        None => {}
    }
}

/// Says what the field of view refers to, if there are bars beside the content.
fn tell_width(args: &Args, known: &CameraFacts, lens: Model) {
    let width = known.size_px[0];
    let whole = |fov| known.bars?.whole_width_deg(lens, width, fov).map(|whole| (fov, whole));
    if let Some((fov, whole)) = args.fov.and_then(whole) {
        tell::warning(format_args!(
            "--fov {fov} is the field of view over all {width} columns, with the bars; if it is that between the \
             bars, write --fov {whole:.1}"
        ));
    }
}

/// Says what looks wrong in the written file, and what it needs.
fn finish(args: &Args, text: &str, known: &CameraFacts) -> Outcome {
    // The commands that read the file say the same, but then it is not clear which option was wrong.
    let sensor = hzn_files::sensor::parse(text, args.output())?;
    let is_known = |text: &String| known.pixel_aspect != 1.0 && text.contains(plausible::NOT_SQUARE);
    sensor.warnings.iter().map(Problem::to_string).filter(|text| !is_known(text)).for_each(tell::warning);
    if let Some(bars) = known.bars {
        tell::line(format_args!("all pictures have {}: they are masked (mask.polygons_px)", bars.describe()));
    }
    if known.pixel_aspect != 1.0 {
        tell::line(format_args!("the pixels are {:.3} times as wide as high, as the video says", known.pixel_aspect));
    }
    if has_no_air(args.body) {
        tell::line(
            "this body has no air, whose light tells a limb from other edges: answers have no p_limb and no \
             protection_deg. Test sigma_max_deg and rms_px instead, and give an attitude in frames.csv if there is \
             one: it refuses edges that are elsewhere (gates.max_attitude_sigma)",
        );
    }
    if !knows_altitudes(args, &sensor.config)? {
        tell::line(
            "every picture needs an altitude: give a frames.csv next to them (columns file, altitude_km), or \
             --altitude KM",
        );
    }
    Ok(Exit::Done)
}

/// Returns the text of the file with the calibration that a bag of ROS has beside its pictures; `None` without one, or
/// if the command line says what the lens is.
fn calibrated(args: &Args, known: &CameraFacts) -> Result<Option<String>, Stop> {
    match read_calibration(&request(args), known)? {
        None => Ok(None),
        Some(Calibration::Unusable(why)) => {
            tell::warning(why);
            Ok(None)
        }
        Some(Calibration::Known { text, camera, from }) => {
            tell::line(format_args!(
                "{} written: {} x {} px, {}, f = {:.1} px, from {from}",
                args.output().display(),
                camera.width,
                camera.height,
                camera.model.name(),
                camera.fx_px
            ));
            Ok(Some(text))
        }
    }
}

/// Returns whether the sensor, or a frames.csv next to the pictures, gives altitudes.
fn knows_altitudes(args: &Args, config: &Config) -> Result<bool, Stop> {
    let request = request(args);
    let source = args.open()?;
    let path = open::frames_path(&request, source.as_ref());
    let frames = path.map(|path| open::load_frames(&path, source.as_ref())).transpose()?;
    Ok(open::check_altitude(source.as_ref(), config, frames.as_ref()).is_ok())
}

fn request(args: &Args) -> Request {
    Request { inputs: args.pictures.clone(), topic: args.topic.clone(), ..Request::default() }
}

/// Finds the field of view from the limb, if an altitude is known.
fn limb_fov(args: &Args, known: &CameraFacts) -> Result<Option<FieldOfView>, Stop> {
    match measure_field_of_view(&request(args), known)? {
        LimbSays::FieldOfView(found) => Ok(Some(found)),
        LimbSays::NoAltitude => Ok(None),
        LimbSays::LensDecides(found) if found.iter().any(FieldOfView::is_certain) => Err(usage(format!(
            "the field of view is not known (no --fov, no usable EXIF), and the limb says {}; add --lens fisheye or \
             --lens pinhole, more pictures, or the field of view over the whole width, for example --fov 60",
            in_words(&found, known)
        ))),
        // The kind of the lens alone would be refused as well.
        LimbSays::LensDecides(found) => Err(too_uncertain(&in_words(&found, known))),
        LimbSays::Uncertain(found) => Err(too_uncertain(&in_words(&[found], known))),
        LimbSays::Nothing(pictures) => Err(usage(format!(
            "the field of view is not known (no --fov, no usable EXIF), and the limb in {} does not say it; \
             add the field of view over the whole width, for example --fov 60, and --lens fisheye or --lens pinhole",
            explain::counted(pictures as u64, "picture")
        ))),
    }
}

/// Returns fields of view in words.
fn in_words(found: &[FieldOfView], known: &CameraFacts) -> String {
    found.iter().map(|one| one.describe(known.size_px[0])).collect::<Vec<_>>().join(", but ")
}

fn too_uncertain(what: &str) -> Stop {
    usage(format!(
        "the field of view is not known (no --fov, no usable EXIF), and what the limb says is too uncertain to start \
         from: {what}; add more pictures, or the field of view over the whole width, for example --fov 60"
    ))
}

/// Collects what the pictures and the command line say about the camera.
fn known(args: &Args, source: &mut dyn Source) -> Result<CameraFacts, Stop> {
    source.notes().iter().for_each(tell::warning);
    if let Some(km) = args.altitude.filter(|km| !(*km > 0.0 && km.is_finite())) {
        return Err(usage(format!("--altitude {km}: must be above 0 km")));
    }
    if args.body == start::Body::Sun && args.altitude.is_some() {
        return Err(usage("--altitude: the disc of the Sun has one size from everywhere near the Earth; leave it out"));
    }
    Ok(CameraFacts {
        fov_deg: args.fov,
        lens: args.lens.map(Model::from),
        altitude_km: args.altitude,
        body: args.body,
        ..read_camera_facts(source)?
    })
}
