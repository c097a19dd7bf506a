//! Tests that dark skies with artefacts instead of a limb are not answered, and that limbs next to artefacts are
//! answered. Every check takes a few pictures of each kind; `cargo xtask test --all` takes 15, and
//! `cargo xtask reproduce artefacts` 200.

use hzn_core::observer::Unobserved;
use hzn_core::{Config, HostHorizon, camera};
use hzn_tests::artefact::{Kind, Outcome, PriorKnowledge, Trial, process_trial};

/// First seed; the campaign has other seeds.
const FIRST_SEED: u64 = 5_000_000;

/// Returns every kind with the seeds of its pictures.
fn trials() -> Vec<(Kind, u64)> {
    let pictures = std::env::var("HZN_ARTEFACTS").ok().and_then(|n| n.parse().ok()).unwrap_or(3);
    Kind::ALL.iter().flat_map(|&kind| (FIRST_SEED..FIRST_SEED + pictures).map(move |seed| (kind, seed))).collect()
}

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

/// An attitude with the sigma of the campaign.
const ATTITUDE: PriorKnowledge = PriorKnowledge { attitude_sigma_deg: Some(5.0) };

/// Returns the number of pictures without a limb, at three thresholds, and those that are answered.
fn false_answers(prior: PriorKnowledge) -> (usize, Vec<String>) {
    let mut horizon = horizon();
    let (mut pictures, mut wrong) = (0, Vec::new());
    for (kind, seed) in trials() {
        let trial = Trial::without_limb(kind, seed).unwrap();
        for o in outcomes(&mut horizon, &trial, &[None, Some(1.0), Some(1.5)], prior) {
            pictures += 1;
            if o.is_false() && !o.matching_disc {
                wrong.push(format!("{} {seed}: {:?}", kind.name(), o.found.map(|f| f.miss.angle_deg)));
            }
        }
    }
    println!("{} of {pictures} pictures have a false answer", wrong.len());
    (pictures, wrong)
}

#[test]
fn no_artefact_is_mistaken_for_a_limb() {
    let (_, wrong) = false_answers(ATTITUDE);
    assert!(wrong.is_empty(), "{} false answers: {wrong:#?}", wrong.len());
}

/// The campaign has 1.1 % false answers where no attitude is given.
#[test]
fn few_artefacts_are_mistaken_for_a_limb_without_an_attitude() {
    let (pictures, wrong) = false_answers(PriorKnowledge::default());
    assert!(20 * wrong.len() <= pictures, "{} false answers in {pictures}: {wrong:#?}", wrong.len());
}

/// The campaign has an answer for 98 % of the limbs. A ghost that fills much of the sky hides the limb.
#[test]
fn limbs_next_to_artefacts_are_found() {
    let mut horizon = horizon();
    let (mut pictures, mut answered) = (0, 0);
    for (kind, seed) in trials() {
        let Some(trial) = Trial::with_limb(kind, seed).unwrap() else { continue };
        for o in outcomes(&mut horizon, &trial, &[None], ATTITUDE) {
            pictures += 1;
            answered += u32::from(o.found.is_some());
            assert!(!o.is_false(), "{} {seed}: {:?}", kind.name(), o.found);
        }
    }
    println!("{answered} of {pictures} limbs are answered");
    assert!(pictures >= 20 && 10 * answered >= 9 * pictures, "{answered} of {pictures}");
}
