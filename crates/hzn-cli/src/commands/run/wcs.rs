//! `hzn run --wcs`: copies of FITS files with the centre of the body and the plate scale in their headers.

use std::path::{Path, PathBuf};

use hzn_core::camera::{self, Camera};
use hzn_core::config::Orient;
use hzn_core::{Config, Solution};
use hzn_files::FrameData;
use hzn_run::engine::{AnySensor, Finished};
use hzn_run::source::{Payload, Source};
use hzn_run::wcs::{Centre, is_fits};
use hzn_run::{disk, explain, overlay};

use super::Args;
use crate::exit::{Stop, usage};
use crate::tell;

/// Number of pictures without a copy that are named.
const MAX_LISTED: usize = 20;

/// Refuses `--wcs` for pictures that are no FITS files as the detector delivered them.
pub(super) fn check(args: &Args, source: &dyn Source, orient: Orient) -> Result<(), Stop> {
    let Some(folder) = &args.wcs else { return Ok(()) };
    let refuse = |why: String| Err(usage(format!("--wcs {}: {why}", folder.display())));
    if !matches!(orient, Orient::AsStored | Orient::Exif) {
        return refuse("the pictures are turned (input.orient); set input.orient = \"as-stored\"".to_owned());
    }
    // The pictures of a watched folder arrive later.
    match source.path(0) {
        Some(first) if !is_fits(&first) => {
            refuse(format!("{} is no FITS file, and only FITS has world coordinates", first.display()))
        }
        None if !args.watch => refuse("the pictures are no files, and only FITS has world coordinates".to_owned()),
        _ => Ok(()),
    }
}

/// The centres of a run, for the copies that are written at its end.
pub(super) struct Copies {
    folder: Option<PathBuf>,
    config: Config,
    camera: Option<Camera<f64>>,
    found: Vec<Found>,
}

/// A picture with the centre of its body, or why it has none.
struct Found {
    index: u64,
    name: String,
    data: Option<FrameData>,
    centre: Result<Centre, String>,
}

impl Copies {
    /// Makes copies into a folder, if there is one.
    pub(super) fn new(folder: Option<&Path>, config: &Config) -> Self {
        let camera = folder.and_then(|_| Camera::try_new(&config.camera).ok());
        Self { folder: folder.map(Path::to_owned), config: config.clone(), camera, found: Vec::new() }
    }

    /// Takes the first body of a picture.
    pub(super) fn count(&mut self, frame: &Finished) {
        let Some(first) = frame.outcomes.first().filter(|_| self.folder.is_some()) else { return };
        let solution = first.report.as_ref().ok().and_then(|report| report.solution.as_ref());
        let centre = match solution {
            Some(solution) => self.centre(solution, frame.data.as_ref()),
            None => Err(first.status().name().to_owned()),
        };
        self.found.push(Found { index: frame.index, name: frame.name.clone(), data: frame.data.clone(), centre });
    }

    fn centre(&self, solution: &Solution<f64>, data: Option<&FrameData>) -> Result<Centre, String> {
        let camera = self.camera.clone().ok_or("the lens is refused")?;
        let camera = camera.with_temperature(data.and_then(|data| data.camera_temperature_c));
        let attitude = data.and_then(|data| data.q_fixed_from_camera_wxyz);
        Centre::find(solution, &camera, self.config.body.kind, attitude).map_err(str::to_owned)
    }

    /// Returns a sensor that takes its lens for exact. An error of the lens turns the direction to the body, but it
    /// does not move the body in the picture.
    fn exact_sensor(&self, flight: bool) -> Option<AnySensor> {
        let exact = camera::Config {
            covariance: None,
            focal_sigma_percent: 0.0,
            centre_sigma_px: 0.0,
            ..self.config.camera.clone()
        };
        AnySensor::new(&Config { camera: exact, ..self.config.clone() }, flight).ok()
    }

    /// Returns the centre with the sigmas of the picture alone; `None` if it is only an answer because the lens is
    /// uncertain.
    fn exact_centre(&self, sensor: &mut AnySensor, path: &Path, data: Option<&FrameData>) -> Option<Centre> {
        let (picture, _) = Payload::File(path.to_owned()).decode(Some(&self.config)).ok()?;
        let view = picture.view(self.config.input.channel).ok()?;
        let report = sensor.process(&view, data, None).into_iter().next()?.report.ok()?;
        self.centre(report.solution.as_ref()?, data).ok()
    }

    /// Writes the copies, and tells which pictures have none.
    pub(super) fn write(&self, source: &dyn Source, args: &Args) -> Result<(), Stop> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let mut sensor = self.exact_sensor(args.sensor.flight);
        let (mut written, mut missing) = (0u64, Vec::new());
        for Found { index, name, data, centre } in &self.found {
            let mut copy = |centre: &Centre| {
                let path = source.path(*index).ok_or("is no file")?;
                let bytes = std::fs::read(&path).map_err(|e| format!("cannot be read: {e}"))?;
                let exact = sensor.as_mut().and_then(|sensor| self.exact_centre(sensor, &path, data.as_ref()));
                exact.as_ref().unwrap_or(centre).write_into(&bytes)
            };
            match centre.as_ref().map_err(Clone::clone).and_then(&mut copy) {
                Ok(bytes) => {
                    disk::write(&folder.join(overlay::flat_name(name)), bytes)?;
                    written += 1;
                }
                Err(why) => missing.push((name, why)),
            }
        }
        for (name, why) in missing.iter().take(MAX_LISTED) {
            tell::warning(format_args!("no world coordinates: {name}: {why}"));
        }
        if missing.len() > MAX_LISTED {
            tell::warning(format_args!("no world coordinates: {} further pictures", missing.len() - MAX_LISTED));
        }
        if args.quiet {
            return Ok(());
        }
        let copies = if written == 1 { "1 copy".to_owned() } else { format!("{written} copies") };
        let of = explain::counted(self.found.len() as u64, "picture");
        tell::line(format_args!("{copies} of {of} with world coordinates in {}", folder.display()));
        Ok(())
    }
}
