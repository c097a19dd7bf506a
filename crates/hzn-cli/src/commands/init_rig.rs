//! `hzn init --rig`: writes a rig.toml to start from.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use hzn_files::camera_file;
use hzn_files::rig::{self, Head, HeadMount, Rig};
use hzn_run::disk;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use crate::exit::{Exit, Outcome, Stop, usage};
use crate::refusals::quoted_path;
use crate::tell;

/// 1-sigma of a mount that somebody writes down, degrees: a drawing or a bracket is right to about a degree.
const WRITTEN_SIGMA_DEG: f64 = 1.0;

/// The rotation from a camera to the rig, scalar first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mount([f64; 4]);

impl FromStr for Mount {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
        let numbers = numbers.ok().and_then(|numbers| <[f64; 4]>::try_from(numbers).ok());
        numbers.map(Self).ok_or_else(|| "expected the four numbers W,X,Y,Z of a quaternion".to_owned())
    }
}

/// Reads the mounts of the cameras of a camchain of Kalibr: the rig has the axes of the first camera.
pub(super) fn of_camchain(file: &Path) -> Result<Vec<Mount>, Stop> {
    let quaternion = |(_, rows): (String, [[f64; 3]; 3])| {
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(|i, j| rows[i][j]));
        // Kalibr's digits leave a matrix that is not quite a rotation.
        let q = UnitQuaternion::from_rotation_matrix(&rotation).into_inner().normalize();
        Mount([q.w, q.i, q.j, q.k])
    };
    Ok(camera_file::chain_mounts(file)?.into_iter().map(quaternion).collect())
}

/// Writes the rig.toml for folders of pictures, one for each head.
pub(super) fn run(folders: &[PathBuf], mounts: &[Mount], output: &Path) -> Outcome {
    if mounts.len() != folders.len() {
        return Err(usage(format!(
            "--rig: {} folders and {} mounts: give --mount W,X,Y,Z for each folder in the same order, the rotation \
             from the camera to the rig as a quaternion, scalar first. It comes from the drawing, from Kalibr's \
             T_cn_cnm1 (--camchain reads it), or from `hzn calibrate mount`. Some degrees are good enough to begin \
             with: `hzn calibrate rig` then finds the mounts from the limbs that the heads see together",
            folders.len(),
            mounts.len()
        )));
    }
    if output.parent().is_some_and(|folder| !folder.as_os_str().is_empty()) {
        let what = "the paths in it are relative to its folder; go there, and give its name alone";
        return Err(usage(format!("{}: {what}", output.display())));
    }
    let heads = folders.iter().zip(mounts).map(head).collect::<Result<_, Stop>>()?;
    let rig = Rig { rig: rig::Common::default(), heads };
    rig::check(&rig).map_err(|(key, what)| usage(format!("{key}: {what}")))?;
    let text = rig::to_text(&rig).map_err(usage)?;
    let note =
        format!("# The sigmas of the mounts are a guess: {WRITTEN_SIGMA_DEG} degree, until they are calibrated.\n");
    disk::write_whole(output, &(note + &text))?;
    let name = output.display();
    tell::line(format_args!(
        "{name} written; hzn calibrate rig {name} -o calibrated.toml  finds the mounts in a flight"
    ));
    for folder in folders.iter().filter(|folder| !folder.join("sensor.toml").exists()) {
        let shown = quoted_path(folder);
        tell::line(format_args!(
            "note: {} has no sensor.toml yet, and each head needs one: \
             hzn init {shown} --fov DEG -o {shown}/sensor.toml",
            folder.display()
        ));
    }
    Ok(Exit::Done)
}

fn head((folder, Mount(q)): (&PathBuf, &Mount)) -> Result<Head, Stop> {
    if !folder.is_dir() {
        return Err(usage(format!("{}: is no folder; each head has its pictures in a folder", folder.display())));
    }
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mount = HeadMount { q_rig_from_camera_wxyz: *q, sigma_deg: WRITTEN_SIGMA_DEG, covariance_deg2: None };
    Ok(Head { name, sensor: None, pictures: folder.clone(), mount: Some(mount), limb_group: None })
}
