//! Measures how often an artefact is taken for a limb in pictures without a limb, and whether limbs next to artefacts
//! are still found.

use std::collections::BTreeMap;

use hzn_core::{Config, HostHorizon};
use hzn_core::{observer::Unobserved, verdict::Verdict};
use hzn_tests::artefact::{FALSE_SIGMAS, GROSS_DEG, Kind, Outcome, PriorKnowledge, Trial, process_trial};
use rayon::prelude::*;

use super::setup::Effort;
use crate::section::Section;

/// Values of `consensus.threshold_px` in addition to the default, in pixels.
const THRESHOLDS_PX: [f64; 6] = [0.5, 1.0, 1.5, 2.0, 3.0, 5.0];
/// Error of the prior attitude, 1σ about each axis in degrees.
const ATTITUDE_DEG: f64 = 5.0;
/// Number of pictures of each kind.
const PICTURES_PER_KIND: usize = 200;
/// First seed; no gate was developed on these pictures.
const FIRST_SEED: u64 = 8_000_000;
/// Number of false answers that are listed one by one.
const MAX_LISTED: usize = 24;

/// Returns a sensor with default settings except for its consensus threshold in pixels; `None` is the default.
fn sensor(trial: &Trial, threshold_px: Option<f64>) -> Config {
    let mut config = Config::new(trial.scene.camera.clone());
    if let Some(px) = threshold_px {
        config.consensus.threshold_px = px;
    }
    config
}

/// Kind of artefact, with the outcomes of limbs next to artefacts and of limbs alone.
type LimbOutcomes = (Kind, Vec<Outcome>, Vec<Outcome>);

/// Consensus threshold of the sensor in pixels, and whether the prior has an attitude.
#[derive(Clone, Copy, PartialEq)]
struct Setting {
    threshold_px: Option<f64>,
    attitude: bool,
}

impl Setting {
    const DEFAULT: Self = Self { threshold_px: None, attitude: false };

    fn all() -> Vec<Self> {
        let thresholds = || std::iter::once(None).chain(THRESHOLDS_PX.map(Some));
        let with = |attitude| thresholds().map(move |threshold_px| Self { threshold_px, attitude });
        with(false).chain(with(true)).collect()
    }
    fn name(self) -> String {
        let px = self.threshold_px.map_or("default".into(), |px| format!("{px} px"));
        if self.attitude { format!("{px}, attitude") } else { px }
    }
}

/// Runs a picture through a sensor in several settings.
fn process_in_settings(horizon: &mut HostHorizon, trial: &Trial, settings: &[Setting]) -> anyhow::Result<Vec<Outcome>> {
    let picture = trial.render()?;
    let one = |s: &Setting| {
        let prior = PriorKnowledge { attitude_sigma_deg: s.attitude.then_some(ATTITUDE_DEG) };
        Ok(process_trial(horizon, &sensor(trial, s.threshold_px), trial, &picture, prior, &Unobserved)?)
    };
    settings.iter().map(one).collect()
}

/// Calls `measure` for every trial on all cores and returns the results. Trials that cannot be drawn are left out.
fn for_each_trial<T: Send>(
    trials: Vec<(Kind, u64)>,
    measure: impl Fn(&mut HostHorizon, Kind, u64) -> anyhow::Result<Option<T>> + Sync,
) -> anyhow::Result<Vec<T>> {
    let make = || HostHorizon::boxed(&Config::new(hzn_core::camera::Config::ideal(Default::default(), 64, 48, 60.0)));
    make()?;
    let all: Vec<Option<T>> = trials
        .into_par_iter()
        .map_init(make, |horizon, (kind, seed)| measure(horizon.as_mut().map_err(|e| *e)?, kind, seed))
        .collect::<anyhow::Result<_>>()?;
    Ok(all.into_iter().flatten().collect())
}

fn seeds(count: usize) -> Vec<(Kind, u64)> {
    Kind::ALL.iter().flat_map(|&kind| (0..count as u64).map(move |i| (kind, FIRST_SEED + i))).collect()
}

pub(super) fn campaign(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(PICTURES_PER_KIND);
    let mut s = Section::default();
    s.text(format!(
        "{} pictures without a limb, {count} of each kind, of 480×360 to 1280×960 pixels through pinholes (27° to 110° \
         wide), equidistant lenses (to 140°) and lenses of Kannala and Brandt (60° to 150°), from 60 to 600 km, 8 \
         bits, with noise of 0.2 to 2.5 % of full scale; `hzn_tests::artefact` has the ranges of each kind. The sensor \
         knows the camera and the position; for the second table it also has an attitude that is wrong by \
         {ATTITUDE_DEG}° (1σ about each axis). Every setting but `consensus.threshold_px` has its default. The table \
         counts the pictures that are answered. If the half-angle of a disc is within three sigmas of the expected \
         one, its shape cannot distinguish it from a limb; these discs have a row of their own.",
        Kind::ALL.len() * count
    ));
    add_skies(&mut s, count)?;
    add_limbs(&mut s, count)?;
    Ok(s)
}

/// Measures pictures without a limb.
fn add_skies(s: &mut Section, count: usize) -> anyhow::Result<()> {
    let settings = Setting::all();
    let trials = for_each_trial(seeds(count), |horizon, kind, seed| {
        let trial = Trial::without_limb(kind, seed)?;
        Ok(Some((kind, seed, process_in_settings(horizon, &trial, &settings)?)))
    })?;
    let skies = Skies { settings, trials };
    for (attitude, title) in [(false, "no attitude"), (true, "with attitude")] {
        skies.add_false_answers(s, attitude, title);
    }
    skies.add_matching_discs(s);
    skies.list_false_answers(s);
    skies.add_verdicts(s);
    Ok(())
}

/// Pictures without a limb: kind and seed of each, with its outcomes in every setting.
struct Skies {
    settings: Vec<Setting>,
    trials: Vec<(Kind, u64, Vec<Outcome>)>,
}

impl Skies {
    /// Returns whether the picture shows a disc of the expected half-angle.
    fn is_matching(outcomes: &[Outcome]) -> bool {
        outcomes.iter().any(|o| o.matching_disc)
    }

    /// Adds the numbers of false answers by kind and threshold, with or without an attitude in the prior.
    fn add_false_answers(&self, s: &mut Section, attitude: bool, title: &str) {
        let counts = |is_chosen: &dyn Fn(Kind, &[Outcome]) -> bool| {
            let chosen: Vec<&Vec<Outcome>> =
                self.trials.iter().filter(|(k, _, o)| is_chosen(*k, o)).map(|(.., o)| o).collect();
            let count =
                |i: usize| chosen.iter().filter(|o| o.get(i).is_some_and(Outcome::is_false)).count().to_string();
            let columns =
                self.settings.iter().enumerate().filter(|(_, s)| s.attitude == attitude).map(|(i, _)| count(i));
            std::iter::once(chosen.len().to_string()).chain(columns).collect::<Vec<_>>()
        };
        let row = |name: &str, cells: Vec<String>| std::iter::once(name.to_owned()).chain(cells).collect();
        let mut rows: Vec<Vec<String>> = Vec::new();
        for &kind in Kind::ALL {
            rows.push(row(kind.name(), counts(&|k, o| k == kind && !Self::is_matching(o))));
        }
        rows.push(row("**all of these**", counts(&|_, o| !Self::is_matching(o))));
        rows.push(row("discs of the expected half-angle", counts(&|_, o| Self::is_matching(o))));
        let thresholds = self.settings.iter().take(7).map(|s| s.name());
        s.table([title.to_owned(), "pictures".into()].into_iter().chain(thresholds), rows);
    }

    fn add_matching_discs(&self, s: &mut Section) {
        let discs = self.trials.iter().filter(|(k, ..)| k.is_disc()).count();
        let answered = |i: usize| {
            let is_answered = |o: &[Outcome]| Self::is_matching(o) && o.get(i).is_some_and(Outcome::is_false);
            self.trials.iter().filter(|(_, _, o)| is_answered(o)).count()
        };
        let worst = (0..THRESHOLDS_PX.len() + 1).map(answered).max().unwrap_or(0);
        s.text(format!(
            "Discs of the expected half-angle that are answered, at the worst threshold and without an attitude: \
             {worst} of {discs} pictures with discs ({:.1} %).",
            100.0 * worst as f64 / discs.max(1) as f64
        ));
    }

    /// Lists false answers to pictures without a disc of the expected half-angle.
    fn list_false_answers(&self, s: &mut Section) {
        let mut listed: Vec<String> = Vec::new();
        for (kind, seed, outcomes) in self.trials.iter().filter(|(.., o)| !Self::is_matching(o)) {
            let wrong = self.settings.iter().zip(outcomes).filter(|(_, o)| o.is_false());
            let mut names: Vec<String> = wrong.map(|(s, _)| s.name()).collect();
            names.dedup();
            if !names.is_empty() {
                listed.push(format!("{} {seed} ({})", kind.name(), names.join("; ")));
            }
        }
        let more = listed.len().saturating_sub(MAX_LISTED);
        listed.truncate(MAX_LISTED);
        if !listed.is_empty() {
            let rest = if more > 0 { format!(", and {more} more") } else { String::new() };
            s.text(format!("False answers by kind and seed: {}{rest}.", listed.join(", ")));
        }
    }

    /// Adds the numbers of edges by the gate that they fail, at the default threshold.
    fn add_verdicts(&self, s: &mut Section) {
        let rows = Kind::ALL.iter().map(|&kind| {
            let mut refused: BTreeMap<&str, usize> = BTreeMap::new();
            let at_default = self.trials.iter().filter(|(k, ..)| *k == kind).filter_map(|(.., o)| o.first());
            for candidate in at_default.flat_map(|o| &o.candidates) {
                if !matches!(candidate.verdict, Verdict::Chosen | Verdict::Passed) {
                    *refused.entry(candidate.verdict.name()).or_default() += 1;
                }
            }
            let mut by: Vec<(usize, &str)> = refused.into_iter().map(|(name, n)| (n, name)).collect();
            by.sort_by(|a, b| b.cmp(a));
            let by: Vec<String> = by.into_iter().map(|(n, name)| format!("{name} {n}")).collect();
            vec![kind.name().to_owned(), by.join(", ")]
        });
        s.table(["kind", "verdicts on its edges at the default"], rows);
    }
}

/// Measures clean limbs next to the same artefacts.
fn add_limbs(s: &mut Section, count: usize) -> anyhow::Result<()> {
    let per_kind = count.div_ceil(2);
    let settings = [Setting::DEFAULT, Setting { attitude: true, ..Setting::DEFAULT }];
    // Some seeds have no room for both limb and artefact, so 50 % more seeds are tried.
    let all = for_each_trial(seeds(per_kind + per_kind / 2), |horizon, kind, seed| {
        let Some(trial) = Trial::with_limb(kind, seed)? else { return Ok(None) };
        let with = process_in_settings(horizon, &trial, &settings)?;
        let alone = process_in_settings(horizon, &trial.cleaned(), &settings[..1])?;
        Ok(Some((kind, with, alone)))
    })?;
    s.text(format!(
        "Clean limbs with the same artefacts next to them: the body is lit everywhere, and the limb crosses the \
         picture over at least half its width, at a height of 12 to 22 km, and falls off exponentially. The artefact \
         leaves at least 90 % of the limb free and half of the sky dark. An answer more than {FALSE_SIGMAS}σ or \
         {GROSS_DEG}° from the truth is false. 'Alone' means the same pictures without the artefact."
    ));
    let row = |name: &str, is_chosen: &dyn Fn(Kind) -> bool| {
        let chosen: Vec<_> = all.iter().filter(|(k, ..)| is_chosen(*k)).collect();
        let n = chosen.len();
        let share = |test: &dyn Fn(&LimbOutcomes) -> bool| {
            format!("{:.1} %", 100.0 * chosen.iter().filter(|c| test(c)).count() as f64 / n.max(1) as f64)
        };
        let has = |o: &[Outcome], i: usize, test: fn(&Outcome) -> bool| o.get(i).is_some_and(test);
        let answered = |o: &Outcome| o.found.is_some();
        vec![
            name.to_owned(),
            n.to_string(),
            share(&|(_, _, alone)| has(alone, 0, answered)),
            share(&|(_, with, _)| has(with, 0, answered)),
            share(&|(_, with, _)| has(with, 1, answered)),
            chosen.iter().filter(|(_, _, alone)| has(alone, 0, Outcome::is_false)).count().to_string(),
            chosen.iter().filter(|(_, with, _)| has(with, 0, Outcome::is_false)).count().to_string(),
            chosen.iter().filter(|(_, with, _)| has(with, 1, Outcome::is_false)).count().to_string(),
        ]
    };
    let mut rows: Vec<Vec<String>> = Kind::ALL.iter().map(|&kind| row(kind.name(), &|k| k == kind)).collect();
    rows.push(row("**all**", &|_| true));
    s.table(
        [
            "limb next to",
            "pictures",
            "answered alone",
            "answered",
            "answered, with attitude",
            "false alone",
            "false",
            "false, with attitude",
        ],
        rows,
    );
    Ok(())
}
