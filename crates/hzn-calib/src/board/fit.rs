//! The stages of a calibration: guess, robust adjustment, removal of outliers.

use hzn_core::camera::{Camera, Config, Equation, Model};
use hzn_core::pixel::ImagePoint;

use super::layout::{PlanarPoint, PlanarView};
use super::pose::{MIN_CORNERS, Mirrored, pose_from_rays};
use crate::adjust::{Adjusted, Block, adjust_pose};
use crate::calibrated::{Dropped, Refusal};
use crate::ideal;
use crate::robust;
use crate::staged::{adjust_in_stages, remove_outliers};

/// Smallest number of pictures. Each of them determines two of the intrinsic parameters of a pinhole (Zhang 2000),
/// which has four.
pub(super) const MIN_VIEWS: usize = 3;
/// Number of rounds of robust weights for a pose. Each round reduces the effect of an outlier by a large factor.
const POSE_ROUNDS: usize = 5;
/// A view's pose for the guessed lens.
type Pose = Option<Result<Block, Mirrored>>;

/// A fitted lens with the pictures.
pub(super) struct Fitted {
    pub(super) adjusted: Adjusted,
    /// For each view its place in `adjusted.blocks`, or the reason why it is not there.
    pub(super) places: Vec<Result<usize, Dropped>>,
}

/// Fits lens and poses.
pub(super) fn fit(model: Model, size_px: [u16; 2], views: &[PlanarView]) -> Result<Fitted, Refusal> {
    check(views)?;
    let mut places: Vec<Result<usize, Dropped>> = views.iter().map(|_| Err(Dropped::NoPose)).collect();
    for (place, view) in places.iter_mut().zip(views) {
        let found = view.points.len();
        if found < MIN_CORNERS {
            *place = Err(Dropped::TooFew { found, min: MIN_CORNERS });
        }
    }
    let usable: Vec<usize> = (0..views.len()).filter(|n| views[*n].points.len() >= MIN_CORNERS).collect();
    refuse_too_few(usable.len(), views.len())?;
    let seen: Vec<PlanarView> = usable.iter().map(|n| views[*n].clone()).collect();
    let Some((config, poses)) = guess(model, size_px, &seen) else {
        let flip = |p: &PlanarPoint| PlanarPoint { place_mm: [-p.place_mm[0], p.place_mm[1]], ..*p };
        let flipped = |v: &PlanarView| PlanarView { points: v.points.iter().map(flip).collect(), ..v.clone() };
        let flipped: Vec<PlanarView> = seen.iter().map(flipped).collect();
        let is_mirrored = guess(model, size_px, &flipped).is_some();
        return Err(if is_mirrored { Refusal::Mirrored } else { Refusal::NoLens });
    };
    let posed: Vec<Block> = poses.iter().filter_map(block_of).cloned().collect();
    let mut rough = adjust_in_stages(&config, &posed).ok_or(Refusal::NoLens)?;
    let mut blocks = Vec::new();
    for ((n, block), view) in usable.iter().zip(poses).zip(&seen) {
        match find_pose(&rough.config, block, view) {
            Ok(block) => {
                places[*n] = Ok(blocks.len());
                blocks.push(block);
            }
            Err(dropped) => places[*n] = Err(dropped),
        }
    }
    refuse_too_few(blocks.len(), views.len())?;
    rough.blocks = blocks;
    let adjusted = remove_outliers(rough, &mut places, MIN_VIEWS).ok_or(Refusal::NoLens)?;
    refuse_too_few(adjusted.blocks.len(), views.len())?;
    Ok(Fitted { adjusted, places })
}

fn check(views: &[PlanarView]) -> Result<(), Refusal> {
    let is_finite = |p: &PlanarPoint| p.at_px.iter().chain(&p.place_mm).all(|x| x.is_finite());
    match views.iter().find(|view| !view.points.iter().all(is_finite)) {
        Some(view) => Err(Refusal::NotFinite { view: view.name.clone() }),
        None => Ok(()),
    }
}

fn refuse_too_few(usable: usize, of: usize) -> Result<(), Refusal> {
    if usable < MIN_VIEWS { Err(Refusal::TooFewViews { usable, min: MIN_VIEWS, of }) } else { Ok(()) }
}

fn block_of(pose: &Pose) -> Option<&Block> {
    pose.as_ref()?.as_ref().ok()
}

/// Guesses the lens and the poses; `None` if no lens explains half of the views.
fn guess(model: Model, size_px: [u16; 2], views: &[PlanarView]) -> Option<(Config, Vec<Pose>)> {
    let pose = |config: &Config, view: &PlanarView| {
        let point = |p: &PlanarPoint| (p.place_mm, p.at_px, ideal::unproject(config, p.at_px));
        pose_from_rays(&view.points.iter().map(point).collect::<Vec<_>>())
    };
    // A board from behind counts as one without a pose: another focal length may explain it.
    ideal::guess(model, size_px, |config| views.iter().map(|v| pose(config, v)).collect(), block_of)
}

/// Returns the block of a view with the pose for this lens, from the guess's pose or anew from the rays of the lens.
fn find_pose(config: &Config, guessed: Option<Result<Block, Mirrored>>, view: &PlanarView) -> Result<Block, Dropped> {
    let refine = |block: Block| adjust_pose_robustly(config, block);
    let anew = || {
        let camera = Camera::<f64>::try_new(config).ok()?;
        let ray = |p: &PlanarPoint| {
            let ray = camera.unproject(ImagePoint { u: p.at_px[0], v: p.at_px[1] })?;
            Some((p.place_mm, p.at_px, ray.xyz()))
        };
        pose_from_rays(&view.points.iter().filter_map(ray).collect::<Vec<_>>())
    };
    match anew() {
        Some(Err(Mirrored)) => return Err(Dropped::Mirrored),
        // Rays beyond the lens's limits leave corners out; the guess has all of them.
        Some(Ok(block)) if block.observations.len() == view.points.len() => {
            if let Some(refined) = refine(block) {
                return Ok(refined);
            }
        }
        _ => {}
    }
    match guessed {
        Some(Ok(block)) => refine(block).ok_or(Dropped::NoPose),
        Some(Err(Mirrored)) => Err(Dropped::Mirrored),
        None => Err(Dropped::NoPose),
    }
}

/// Adjusts the pose of a view with robust weights, so that a single wrong corner does not move all others.
fn adjust_pose_robustly(config: &Config, block: Block) -> Option<Block> {
    let mut block = adjust_pose(config, &block)?;
    for _ in 0..POSE_ROUNDS {
        robust::weigh(config, std::slice::from_mut(&mut block));
        block = adjust_pose(config, &block)?;
    }
    Some(block)
}

/// Returns the residuals of a block, and their RMS over the observations that count, px.
pub(super) fn residuals_px(config: &Config, block: &Block) -> (Vec<[f64; 2]>, f64) {
    let residuals = block.residuals_px(&Equation::new(config));
    let counted = || residuals.iter().zip(&block.observations).filter(|(_, o)| o.weight > 0.0);
    let squares: f64 = counted().map(|([u, v], _)| u * u + v * v).sum();
    let rms = (squares / counted().count() as f64).sqrt();
    (residuals, rms)
}
