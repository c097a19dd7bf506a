//! Tests that dark skies with artefacts instead of a limb are not answered, and that limbs next to artefacts are
//! answered. `cargo xtask reproduce artefacts` is the campaign with about ten times as many pictures.

use hzn_core::observer::Unobserved;
use hzn_core::{Config, HostHorizon, camera};
use hzn_tests::artefact::{Kind, Outcome, PriorKnowledge, Trial, process_trial};

/// Number of pictures of each kind.
const PICTURES_PER_KIND: u64 = 15;
/// First seed; the campaign has other seeds.
const FIRST_SEED: u64 = 5_000_000;

fn horizon() -> Box<HostHorizon> {
    HostHorizon::boxed(&Config::new(camera::Config::ideal(camera::Model::Pinhole, 64, 48, 60.0))).unwrap()
}

/// Returns the outcomes of a trial at each consensus threshold in pixels; `None` is the default.
fn outcomes(
    horizon: &mut HostHorizon,
    trial: &Trial,
    thresholds_px: &[Option<f64>],
    prior: PriorKnowledge,
) -> Vec<Outcome> {
    let picture = trial.render().unwrap();
    let mut outcome = |threshold_px: &Option<f64>| {
        let mut config = Config::new(trial.scene.camera.clone());
        config.consensus.threshold_px = threshold_px.unwrap_or(config.consensus.threshold_px);
        process_trial(horizon, &config, trial, &picture, prior, &Unobserved).unwrap()
    };
    thresholds_px.iter().map(&mut outcome).collect()
}

#[test]
#[ignore = "some artefacts are still taken for a limb; the campaign lists them"]
fn no_artefact_is_mistaken_for_a_limb() {
    let mut horizon = horizon();
    let mut wrong = Vec::new();
    for (kind, seed) in
        Kind::ALL.iter().flat_map(|&k| (FIRST_SEED..FIRST_SEED + PICTURES_PER_KIND).map(move |s| (k, s)))
    {
        let trial = Trial::without_limb(kind, seed).unwrap();
        for o in outcomes(&mut horizon, &trial, &[None, Some(1.0), Some(1.5)], PriorKnowledge::default()) {
            if o.is_false() && !o.matching_disc {
                wrong.push(format!("{} {seed}: {:?}", kind.name(), o.found.map(|f| f.miss.angle_deg)));
            }
        }
    }
    assert!(wrong.is_empty(), "{} false answers: {wrong:#?}", wrong.len());
}

#[test]
#[ignore = "a ghost that fills much of the sky still hides the limb"]
fn limbs_next_to_artefacts_are_found() {
    let mut horizon = horizon();
    let (mut pictures, mut answered) = (0, 0);
    for (kind, seed) in
        Kind::ALL.iter().flat_map(|&k| (FIRST_SEED..FIRST_SEED + PICTURES_PER_KIND).map(move |s| (k, s)))
    {
        let Some(trial) = Trial::with_limb(kind, seed).unwrap() else { continue };
        for o in outcomes(&mut horizon, &trial, &[None], PriorKnowledge { attitude_sigma_deg: Some(5.0) }) {
            pictures += 1;
            answered += u32::from(o.found.is_some());
            assert!(!o.is_false(), "{} {seed}: {:?}", kind.name(), o.found);
        }
    }
    assert!(pictures >= 80 && f64::from(answered) >= 0.96 * f64::from(pictures), "{answered} of {pictures}");
}
