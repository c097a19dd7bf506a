//! What the pictures of a camera without a calibration say about it, for the sensor.toml to start from
//! ([`hzn_files::start`]).

use hzn_files::FrameData;
use hzn_files::start::{self, CameraFacts, Exif, StartConfig};

use crate::bars::find_bars;
use crate::diagnosis::{AnyCone, FieldOfView, Implied, find_any_fit, find_field_of_view, median_fit};
use crate::error::{Error, unusable};
use crate::image_circle::find_image_circle;
use crate::open::{Request, frames_path, load_frames};
use crate::source::{self, Picture, Source};

/// Number of pictures that are looked at. The error that all pictures share is larger than that of eight pictures.
const PICTURES: u64 = 8;
/// Difference of the field of view that was told from that of the limb that is worth a warning, in sigmas of both. A
/// data sheet that is wrong by that much is worth a look, because its error is the same in every picture.
const DOUBTFUL_SIGMAS: f64 = 1.5;
/// Sigma of the limb's focal length that is a check, in sigmas of the told one: an error of three told sigmas is then
/// [`DOUBTFUL_SIGMAS`] of the limb's.
const ENOUGH: f64 = 2.0;

/// The field of view that the limb in the pictures says.
#[derive(Debug, Clone, PartialEq)]
pub enum LimbSays {
    /// The field of view.
    FieldOfView(FieldOfView),
    /// The limb says another field of view for each kind of lens, and does not tell the kind.
    LensDecides(Vec<FieldOfView>),
    /// The field of view that the limb says is too uncertain to start from.
    Uncertain(FieldOfView),
    /// No altitude is known for any picture, so the limb says nothing.
    NoAltitude,
    /// The limb in this number of pictures does not say it.
    Nothing(usize),
}

/// Returns what the pictures say about their camera: size and tone, EXIF of the first one, the image circle of a
/// fisheye, and black bars.
///
/// # Errors
/// No picture can be read, or the pictures have different sizes.
pub fn read_camera_facts(source: &mut dyn Source) -> Result<CameraFacts, Error> {
    let size_px = one_size(source)?;
    let tone = source::find_tone(source).map(|found| found.tone);
    let pixel_aspect = source.pixel_aspect();
    let readout_s = source.measured().and_then(|measured| measured.readout_s);
    let step = source.total().map_or(1, |total| (total / PICTURES).max(1));
    let mut exif = None;
    let mut pictures: Vec<Picture> = Vec::new();
    let mut index = 0;
    while let Some(item) = source.next() {
        let item = item?;
        exif = exif.or_else(|| Some(item.payload.exif_lens().unwrap_or_default()));
        if index % step == 0 {
            pictures.extend(item.payload.decode(None).map(|(picture, _)| picture));
        }
        index += 1;
        if pictures.len() as u64 >= PICTURES {
            break;
        }
    }
    Ok(CameraFacts {
        exif: exif.unwrap_or_default(),
        tone,
        image_circle_px: find_image_circle(&pictures),
        bars: find_bars(&pictures),
        pixel_aspect,
        readout_s,
        ..CameraFacts::of_size(size_px)
    })
}

/// Returns the size of the pictures. Refuses pictures of different sizes.
fn one_size(source: &dyn Source) -> Result<[u32; 2], Error> {
    let mut sizes = source.sizes();
    let Some((first, (width, height))) = sizes.next() else {
        return Err(unusable("none of the pictures can be read, so their size is not known"));
    };
    match sizes.find(|(_, other)| *other != (width, height)) {
        Some((name, other)) => Err(unusable(format!(
            "{first} is {width}x{height}, but {name} is {}x{}: a sensor.toml is for pictures of one size; give the \
             pictures of one camera and mode",
            other.0, other.1
        ))),
        None => Ok([width, height]),
    }
}

/// The lens that a recording of ROS states beside its pictures.
#[cfg(feature = "recordings")]
#[derive(Debug, Clone, PartialEq)]
pub enum Calibration {
    /// The text of a sensor.toml with this lens.
    Known {
        /// The text.
        text: String,
        /// The camera in it.
        camera: Box<hzn_core::camera::Config>,
        /// The topic that it comes from.
        from: String,
    },
    /// The recording has a calibration that is not used, for this reason.
    Unusable(String),
}

/// Returns the sensor.toml with the calibration that a bag of ROS has beside its pictures; `None` without one, or if
/// the field of view or the kind of the lens was told.
///
/// # Errors
/// A recording cannot be read, or the calibration is for pictures of another size.
#[cfg(feature = "recordings")]
pub fn read_calibration(request: &Request, known: &CameraFacts) -> Result<Option<Calibration>, Error> {
    if known.fov_deg.is_some() || known.lens.is_some() {
        return Ok(None);
    }
    let found = source::find_camera(&request.inputs, request.topic.as_deref())?;
    let Some(source::RecordedCamera { from, camera, size_fields }) = found else { return Ok(None) };
    let camera = match camera {
        Ok(camera) => camera,
        Err(what) => return Ok(Some(Calibration::Unusable(format!("{from} is not used: {what}")))),
    };
    let ([width, height], (w, h)) = (known.size_px, (camera.width, camera.height));
    if [w, h].map(u32::from) != known.size_px {
        return Err(unusable(format!(
            "{from}: {size_fields} are for pictures of {w} x {h} px, and these are {width} x {height} px: the lens \
             does not fit. Write the message into a file (ros2 topic echo --once), correct the fields there and read \
             it with hzn camera convert; or give --fov or --lens, with which the message is not used"
        )));
    }
    let text = start::write_calibrated(known, &camera, &from).map_err(unusable)?;
    Ok(Some(Calibration::Known { text, camera: Box::new(camera), from }))
}

/// Finds the field of view from the limb in some pictures, which have the `known` altitude or one in frames.csv.
///
/// # Errors
/// A file cannot be read.
pub fn measure_field_of_view(request: &Request, known: &CameraFacts) -> Result<LimbSays, Error> {
    let pictures = read_pictures(request, known)?;
    if pictures.is_empty() {
        return Ok(LimbSays::NoAltitude);
    }
    let mut found = find_field_of_view(&pictures, known);
    Ok(match (found.len(), found.pop()) {
        (1, Some(only)) if only.is_certain() => LimbSays::FieldOfView(only),
        (1, Some(only)) => LimbSays::Uncertain(only),
        (0, _) | (_, None) => LimbSays::Nothing(pictures.len()),
        (_, Some(last)) => LimbSays::LensDecides(found.into_iter().chain([last]).collect()),
    })
}

/// Reads some pictures with an altitude, which is `known` or in frames.csv.
fn read_pictures(request: &Request, known: &CameraFacts) -> Result<Vec<(Picture, Option<FrameData>)>, Error> {
    let mut source = source::open(&request.inputs, None, request.topic.as_deref())?;
    let frames = frames_path(request, source.as_ref()).map(|path| load_frames(&path, source.as_ref())).transpose()?;
    let knows = |data: &FrameData| data.position_km.is_some() || data.altitude_km.is_some();
    // The pictures of a folder are spread over it. A sequence of unknown length gives its first ones.
    let step = source.total().map_or(1, |total| (total / PICTURES).max(1));
    let mut pictures: Vec<(Picture, Option<FrameData>)> = Vec::new();
    let mut index = 0;
    while let Some(item) = source.next() {
        let mut item = item?;
        index += 1;
        if (index - 1) % step != 0 {
            continue;
        }
        let data = item.take_prior(frames.as_ref()).filter(knows);
        if known.altitude_km.is_none() && data.is_none() {
            continue;
        }
        if let Ok((picture, _)) = item.payload.decode(None) {
            pictures.push((picture, data));
        }
        if pictures.len() as u64 >= PICTURES {
            break;
        }
    }
    Ok(pictures)
}

/// What would make the limb in some pictures the expected one, if the field of view is right.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FittingAltitude {
    /// The altitude that the pictures were given, the median, km.
    given_km: f64,
    /// The altitude that fits their limb, with its 1-sigma in one picture, km.
    fitting_km: Implied,
    /// Number of pictures with a limb.
    pictures: usize,
}

/// Finds the altitude that fits the limb in some pictures with the field of view of `config`, which is a sensor.toml
/// for them. `None` if they show no limb that says it.
///
/// # Errors
/// A file cannot be read.
fn find_altitude(
    request: &Request,
    known: &CameraFacts,
    config: &hzn_core::Config,
) -> Result<Option<FittingAltitude>, Error> {
    let Ok(mut trial) = AnyCone::new(config, false) else { return Ok(None) };
    let mut found = Vec::new();
    for (picture, data) in read_pictures(request, known)? {
        let Ok(view) = picture.view(config.input.channel) else { continue };
        found.extend(find_any_fit(&mut trial, config, &view, data.as_ref()));
    }
    let fit = median_fit(&found);
    Ok(fit.and_then(|fit| {
        let fitting_km = fit.altitude_km.filter(|altitude| altitude.value > 0.0)?;
        Some(FittingAltitude { given_km: fit.given_altitude_km?, fitting_km, pictures: found.len() })
    }))
}

/// What the limb says about the field of view and the altitude that were told.
#[derive(Debug, Clone, PartialEq)]
pub enum Check {
    /// They agree with the limb.
    Agrees,
    /// The limb contradicts them.
    Contradicted(Doubt),
    /// The limb says too little to check a field of view that was told, in words.
    Unchecked(String),
}

/// A contradiction between the limb and what was told.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    /// What contradicts what, with the values that would fit, in words.
    pub text: String,
    /// 1-sigma in percent that is to be added to that of the focal length: with it, the difference is just not worth a
    /// warning. `None` if one altitude was told for all pictures: it may as well be the wrong value, and with a larger
    /// sigma of the lens it would have more weight.
    pub focal_percent: Option<f64>,
}

/// Finds out whether the limb contradicts the field of view (that was told, or that of the EXIF) or the altitude, and
/// which values would fit. `config` is the sensor that was made from `start`.
///
/// # Errors
/// A file cannot be read.
pub fn check_start(
    request: &Request,
    known: &CameraFacts,
    start: &StartConfig,
    config: &hzn_core::Config,
) -> Result<Check, Error> {
    let without = CameraFacts { fov_deg: None, exif: Exif::default(), lens: Some(start.lens), ..known.clone() };
    let says = measure_field_of_view(request, &without)?;
    let unchecked = say_unchecked(&says, known, start).map_or(Check::Agrees, Check::Unchecked);
    let (LimbSays::FieldOfView(limb) | LimbSays::Uncertain(limb)) = says else { return Ok(unchecked) };
    let Some(focal_percent) = doubt_focal(&limb, known, start) else { return Ok(unchecked) };
    let [kept, seen] = limb.pictures;
    let altitude = find_altitude(request, known, config)?.map(|altitude| {
        let FittingAltitude { given_km, fitting_km: Implied { value, sigma }, pictures } = altitude;
        format!(
            "; if the field of view is right, the altitude is {value:.0} +- {sigma:.0} km (median of {pictures}) and \
             not {given_km:.0} km"
        )
    });
    let focal_percent = known.altitude_km.is_none().then_some(focal_percent);
    let consequence = match focal_percent {
        Some(_) => {
            ". The sigma of the focal length is larger for that, so that answers are possible, but less accurate"
        }
        None => "",
    };
    let text = format!(
        "the limb in {kept} of {seen} pictures contradicts the field of view or the altitude. If the altitude is \
         right, the pictures are {}, not {:.1} degrees{}. Check both, and the kind of lens (the field of view of a \
         fisheye is not 2 atan(width / 2f)); without --fov, that of the limb is taken{consequence}",
        limb.describe(known.size_px[0]),
        start.fov_deg,
        altitude.unwrap_or_default()
    );
    Ok(Check::Contradicted(Doubt { text, focal_percent }))
}

/// Compares the focal length of a sensor with that of the limb. Returns the 1-sigma in percent that would explain the
/// difference, if the sigmas of both do not.
fn doubt_focal(limb: &FieldOfView, known: &CameraFacts, start: &StartConfig) -> Option<f64> {
    let of_limb = start::focal_px(start.lens, f64::from(known.size_px[0]), limb.measured.fov_deg)?;
    let sigma = 0.01 * limb.measured.focal_sigma_percent.hypot(start.focal_sigma_percent);
    let needed = (of_limb / start.focal_px).ln().abs() / DOUBTFUL_SIGMAS;
    (needed > sigma).then(|| 100.0 * (needed * needed - sigma * sigma).sqrt())
}

/// Says that nothing has checked the field of view that was told as well as its sigma says. The camera itself writes
/// an EXIF, which needs no such word. `None` without an altitude: there is nothing to compare with, and another message
/// asks for it.
fn say_unchecked(limb: &LimbSays, known: &CameraFacts, start: &StartConfig) -> Option<String> {
    known.fov_deg?;
    let why = match limb {
        LimbSays::Uncertain(limb) if limb.measured.focal_sigma_percent > ENOUGH * start.focal_sigma_percent => {
            let [kept, seen] = limb.pictures;
            format!(
                "checked only roughly: the limb in {kept} of {seen} pictures says {}",
                limb.describe(known.size_px[0])
            )
        }
        LimbSays::Nothing(seen) => format!("not checked: the limb in {seen} pictures does not say it"),
        _ => return None,
    };
    Some(format!(
        "the field of view of {:.1} degrees and the altitude are {why}. If the field of view is wrong by more than \
         {:.0} %, answers are wrong by more than 3 sigma. More pictures, with the limb in other places, check it",
        start.fov_deg,
        3.0 * start.focal_sigma_percent
    ))
}
