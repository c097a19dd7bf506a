//! The flight of a rig: several cameras (heads) that are one sensor.

use std::fs::{self, File};
use std::io::{self, Read};
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hzn_core::config::Mount;
use hzn_core::rig::MOST_HEADS;
use hzn_files::rig::{self as file, turn_after};
use hzn_flight::Parameters;
use hzn_flight::flight::rig::{Heads, Rig, RigBuffers, Setup};
use hzn_flight::flight::{HeadBuffers, Lists};
use hzn_flight::messages::Mode;
use hzn_flight::packet::ApidBase;
use hzn_run::rig::{OpenHead, Request};
use hzn_run::source::raw::{Format, Raw};

use crate::board::Linux;
use crate::camera::{Camera, Capture, DeviceCamera, Pipe, Recording, Samples, V4l2};
use crate::error::Error;
use crate::flash::{self, Flash};
use crate::flight::{Settings, Summary, check_input, check_raw, end, open_parts};
use crate::head::{Feed, Head};
use crate::keeper::Keeper;
use crate::log::{Sensors, Spare};
use crate::prepare::{parameters_for, prepare_parameters, store_base};
use crate::signals::Lines;
use crate::tell::Tell;

/// Time that passes in a turn after the last picture, µs, until the last epoch ends.
const AFTER_US: u64 = 20_000;

/// A head before the flight.
struct Prepared {
    name: String,
    pictures: PathBuf,
    parameters: Parameters,
    /// The key of its sensor.toml, which is no parameter.
    limb_tilt_sigma_km: Option<f64>,
    flash: Flash,
    /// Pictures that were taken before; without them, `pictures` is a device or a named pipe.
    recorded: Option<OpenHead>,
}

/// Flies the heads of a rig.toml until the pictures of all of them end or a signal stops the program.
pub(crate) fn fly(path: &Path, settings: &Settings, lines: Arc<Lines>, tell: &Tell) -> Result<Summary, Error> {
    let rig = file::load(path).map_err(|e| Error::usage(e.to_string()))?;
    let mut prepared = prepare(path, &rig, settings, tell)?;
    let mut setup = setup(&rig);
    setup.limb_tilt_sigma_km = setup.limb_tilt_sigma_km.or(prepared.first().and_then(|head| head.limb_tilt_sigma_km));
    separate_bases(&mut prepared, setup.base, tell)?;
    let text = fs::read_to_string(path).map_err(|e| Error::failed(format!("{}: {e}", path.display())))?;
    let sensors = Sensors {
        configs: prepared.iter().map(|head| head.parameters.sensor.clone()).collect(),
        rig: Some((prepared.iter().map(|head| head.name.clone()).collect(), text)),
    };
    let spare = Spare::default();
    let (heads, begin_s) = open_heads(prepared, settings, &spare, tell)?;
    let board = Linux::new(open_parts(settings, sensors, spare, lines, tell)?, heads, begin_s);
    match rig.heads.len() {
        1 => run::<1>(board, &setup),
        2 => run::<2>(board, &setup),
        3 => run::<3>(board, &setup),
        _ => run::<4>(board, &setup),
    }
}

/// Returns what the heads share, for the loop.
fn setup(rig: &file::Rig) -> Setup {
    let common = &rig.rig;
    let us = |s: f64| (s * 1e6).round() as u64;
    let mut setup = Setup {
        sync_us: us(common.sync_s),
        wait_us: us(common.wait_s),
        check: common.check(),
        limb_tilt_sigma_km: common.limb_tilt_sigma_km,
        limb_own_sigma_km: common.limb_own_sigma_km,
        limb_own_length_km: common.limb_own_length_km,
        sigma_rad: common.mount.sigma_deg.to_radians(),
        ..Setup::new(ApidBase::DEFAULT)
    };
    for (place, head) in setup.mounts_rad2.iter_mut().zip(&rig.heads) {
        let mount = head.mount.as_ref();
        *place = mount.map_or([0.0; 6], |mount| mount.covariance_rad2().map(|x| x as f32));
    }
    for (place, group) in setup.limb_groups.iter_mut().zip(rig.limb_groups()) {
        *place = group;
    }
    setup
}

/// Returns the base of a head that has no other one: those after the base of the rig.
fn base_of(k: usize) -> u16 {
    ApidBase::DEFAULT.number() + ApidBase::STEP * (1 + k as u16)
}

/// Gives a head another base if the line cannot tell it apart from an earlier head or from the rig: a telecommand may
/// have set it, and one head must not keep the others from flying.
fn separate_bases(heads: &mut [Prepared], rig: ApidBase, tell: &Tell) -> Result<(), Error> {
    let base = |head: &Prepared| head.parameters.operations.apid_base;
    for k in 0..heads.len() {
        let (before, rest) = heads.split_at_mut(k);
        let Some((head, after)) = rest.split_first_mut() else { break };
        let other = before.iter().find(|other| base(other) == base(head)).map(|other| other.name.as_str());
        let Some(other) = other.or_else(|| (base(head) == rig.number()).then_some("the rig")) else { continue };
        let is_free =
            |wanted: &u16| *wanted != rig.number() && before.iter().chain(&*after).all(|h| base(h) != *wanted);
        let Some(free) = (k..).map(base_of).take(2 * MOST_HEADS + 1).find(is_free) else { continue };
        let (folder, old) = (head.flash.folder().display().to_string(), base(head));
        tell(&format!("warning: {folder}: line.apid_base = {old} is also that of {other}; {free} is stored instead"));
        store_base(&mut head.parameters, free, &head.flash)?;
    }
    Ok(())
}

/// Opens the sensors of the heads, and stores their parameters if there are none.
fn prepare(path: &Path, rig: &file::Rig, settings: &Settings, tell: &Tell) -> Result<Vec<Prepared>, Error> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut prepared = Vec::new();
    for (k, (head, recorded)) in rig.heads.iter().zip(open_recorded(path, rig, settings, tell)?).enumerate() {
        let sensor = match &recorded {
            Some(recorded) => recorded.sensor.config.clone(),
            None => live_sensor(head, folder)?,
        };
        let state = settings.state.join(&head.name);
        let own = head.sensor.iter().map(|path| folder.join(path));
        let read: Vec<PathBuf> = std::iter::once(path.to_owned()).chain(own).collect();
        hzn_run::disk::refuse_inputs(&read, &flash::files(&state)).map_err(|e| Error::usage(e.to_string()))?;
        let flash = Flash::open(&state).map_err(|e| flash::refused(&state, &e))?;
        let limb_tilt_sigma_km = sensor.body.limb_tilt_sigma_km;
        let mut given = parameters_for(sensor);
        given.operations.apid_base = base_of(k);
        given.sensor.mount = head.mount.as_ref().map(|mount| Mount {
            q_vehicle_from_camera_wxyz: turn_after(rig.rig.mount.q_vehicle_from_rig_wxyz, mount.q_rig_from_camera_wxyz),
        });
        let replaces = (settings.replaces_parameters, "rig.toml and its sensor.toml");
        let parameters = prepare_parameters(Some(&given), replaces, &flash, tell).map_err(|e| e.in_head(&head.name))?;
        let (name, pictures) = (head.name.clone(), folder.join(&head.pictures));
        prepared.push(Prepared { name, pictures, parameters, limb_tilt_sigma_km, flash, recorded });
    }
    Ok(prepared)
}

/// Opens the pictures of all heads if they are recorded; returns `None` for each head if they come from cameras.
fn open_recorded(
    path: &Path,
    rig: &file::Rig,
    settings: &Settings,
    tell: &Tell,
) -> Result<Vec<Option<OpenHead>>, Error> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let live: Vec<bool> = rig.heads.iter().map(|head| is_live(&folder.join(&head.pictures))).collect();
    if !live.contains(&true) {
        let request = Request { rig: path.to_owned(), raw: settings.raw, flight: true, ..Request::default() };
        let opened = hzn_run::rig::open(&request).map_err(|e| Error::usage(e.to_string()))?;
        opened.warnings.iter().for_each(|warning| tell(&format!("warning: {warning}")));
        return Ok(opened.heads.into_iter().map(Some).collect());
    }
    match rig.heads.iter().zip(&live).find(|(_, is_live)| !**is_live) {
        Some((head, _)) => Err(Error::usage(format!(
            "head {}: {}: is no device and no named pipe, as that of another head is: the heads of a flight are all \
             cameras, or all of them are recorded",
            head.name,
            head.pictures.display()
        ))),
        None => Ok(rig.heads.iter().map(|_| None).collect()),
    }
}

/// Reads the sensor of a head whose pictures are taken now.
fn live_sensor(head: &file::Head, folder: &Path) -> Result<hzn_core::Config, Error> {
    let Some(sensor) = &head.sensor else {
        let what = "a head with a camera needs the key sensor in rig.toml, with the path of its sensor.toml";
        return Err(Error::usage(format!("head {}: {what}", head.name)));
    };
    let sensor = hzn_files::sensor::load(&folder.join(sensor)).map_err(|e| Error::usage(e.to_string()))?;
    check_input(Some(&sensor.config))?;
    Ok(sensor.config)
}

/// Returns whether pictures come from a camera or a named pipe, so that they are taken now.
fn is_live(pictures: &Path) -> bool {
    fs::metadata(pictures).is_ok_and(|meta| meta.file_type().is_char_device() || meta.file_type().is_fifo())
}

/// Opens the pictures of the heads. Also returns the time in seconds at which the clock of the flight begins if they
/// are recorded.
fn open_heads(
    prepared: Vec<Prepared>,
    settings: &Settings,
    spare: &Spare,
    tell: &Tell,
) -> Result<(Vec<Head>, Option<f64>), Error> {
    let mut heads = Vec::new();
    for Prepared { name, pictures, parameters, flash, recorded, .. } in prepared {
        let config = parameters.sensor;
        let keeper = settings.kept_pictures.map(|kept| Keeper::open(kept, &flash, &config, spare, tell)).transpose()?;
        let feed = match recorded {
            Some(OpenHead { source, frames, sensor, .. }) => {
                let opened = Recording::open(name.clone(), source, frames, sensor.config, tell.clone());
                Feed::Recording(Box::new(opened.map_err(Error::usage)?))
            }
            None => {
                let camera = open_camera(&pictures, settings, &config, tell)?;
                Feed::Camera(Capture::start(camera).map_err(Error::failed)?)
            }
        };
        heads.push(Head::new(Some(name), feed, flash, keeper, tell.clone()));
    }
    let first_s = heads.iter().filter_map(Head::upcoming_s).reduce(f64::min);
    let begin_s = first_s.and_then(|first_s| heads.iter_mut().filter_map(|head| head.begin_at(first_s)).last());
    Ok((heads, begin_s))
}

fn open_camera(
    path: &Path,
    settings: &Settings,
    config: &hzn_core::Config,
    tell: &Tell,
) -> Result<Box<dyn Camera>, Error> {
    let (width, height) = (u32::from(config.camera.width), u32::from(config.camera.height));
    let in_pictures = |e: std::io::Error| Error::failed(format!("{}: {e}", path.display()));
    if fs::metadata(path).is_ok_and(|meta| meta.file_type().is_char_device()) {
        let camera = DeviceCamera::open(Box::new(V4l2::new(path, width, height)), tell.clone());
        return Ok(Box::new(camera.map_err(in_pictures)?));
    }
    let raw = settings.raw.unwrap_or(Raw { width, height, format: Format::Mono8 });
    check_raw(raw, config, tell)?;
    let pipe = NamedPipe { path: path.to_owned(), file: None };
    Ok(Box::new(Pipe::new(pipe, Samples::Raw(raw))))
}

/// A named pipe. It is opened by the thread that reads it, because that waits for the program before it.
struct NamedPipe {
    path: PathBuf,
    file: Option<File>,
}

impl Read for NamedPipe {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let file = match &mut self.file {
            Some(file) => file,
            None => self.file.insert(File::open(&self.path)?),
        };
        file.read(into)
    }
}

fn run<const N: usize>(mut board: Linux, setup: &Setup) -> Result<Summary, Error> {
    let checked = setup.check().map_err(|e| Error::usage(format!("rig.toml: {e}")))?;
    let (mut buffers, mut lists) = (Box::new(RigBuffers::new()), Box::new(Lists::new()));
    let mut own: Box<[HeadBuffers; N]> = Box::new([const { HeadBuffers::new() }; N]);
    let mut heads = Box::new(Heads::<_, N>::new());
    let mut rig = Rig::new(&mut board, checked, &mut heads, (&mut buffers, &mut own), &mut lists);
    rig.turn();
    let mut modes = [None; N];
    let mut is_ready = false;
    // Time that has passed since the last picture.
    let mut after_us = 0;
    let is_shut_down = loop {
        let now: [Option<Mode>; N] = std::array::from_fn(|k| rig.mode(k));
        let Some(board) = rig.board() else { break false };
        if !std::mem::replace(&mut is_ready, true) {
            board.parts().notify.ready();
        }
        if now != modes {
            tell_modes(board, &now, &modes);
            modes = now;
        }
        if now.iter().all(|mode| *mode == Some(Mode::ShutDown)) {
            break true;
        }
        let takes_pictures = |k: usize| now.get(k) == Some(&Some(Mode::Flight));
        if board.ended(takes_pictures).is_none() {
            board.wait(takes_pictures);
        } else if after_us < setup.wait_us {
            // The last epoch ends without the heads that are late.
            board.pass_us(AFTER_US);
            after_us += AFTER_US;
        } else {
            break false;
        }
        rig.turn();
    };
    let board = rig.board().ok_or_else(|| Error::failed("a head has kept the board"))?;
    Ok(end(board, is_shut_down))
}

/// Tells which heads have another mode.
fn tell_modes(board: &mut Linux, now: &[Option<Mode>], before: &[Option<Mode>]) {
    let names: Vec<String> = board.heads().iter().filter_map(|head| head.name.clone()).collect();
    let mut texts = Vec::new();
    for (name, (now, before)) in names.iter().zip(now.iter().zip(before)) {
        let Some(mode) = now else { continue };
        let text = format!("{name}: {} mode", mode.name());
        if Some(mode) != before.as_ref() {
            (board.parts().tell)(&text);
        }
        texts.push(text);
    }
    board.parts().notify.status(&texts.join(", "));
}
