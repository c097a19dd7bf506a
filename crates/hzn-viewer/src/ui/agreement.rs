//! Which of the possible causes agrees with all pictures.

use crate::model::diagnosis::{self, Consensus, Suspect};

/// Number of frames that together say something about a cause.
pub(super) const ENOUGH: usize = 3;

/// Which of the plausible causes agrees with all pictures.
pub(super) struct Agreement {
    /// The reason in words.
    pub(super) words: String,
    /// What to do.
    pub(super) step: String,
    /// The causes that agree with all pictures.
    pub(super) open: Vec<Suspect>,
}

impl Agreement {
    /// Compares the causes. `shift_km` is the shift that is on trial, if the frames have altitudes of their own, and
    /// `correlation` that of two causes.
    pub(super) fn new(
        plausible: &[Consensus],
        impossible: &[Consensus],
        shift_km: Option<f64>,
        correlation: &dyn Fn([Suspect; 2]) -> Option<f64>,
    ) -> Option<Self> {
        let (best, others) = plausible.split_first()?;
        if best.pictures < ENOUGH || others.len() + impossible.len() == 0 {
            return None;
        }
        let words = |c: &Consensus| format!("{} {:.1}", c.suspect.name(), c.disagreement);
        let none = |c: &Consensus| format!("{} impossible ({:.0} km)", c.suspect.name(), c.value);
        let all: Vec<String> = plausible.iter().map(words).chain(impossible.iter().map(none)).collect();
        let what =
            format!("The true cause has the same value in every picture. Scatter over {} pictures", best.pictures);
        let what = format!("{what}, divided by σ: {}; 1 is only noise.", all.join(", "));
        // A wrong cause scatters more. Below 1 the scatter is the noise of the edges, and says nothing.
        let scatters = |c: &Consensus| c.disagreement > 2.0 * best.disagreement.max(1.0);
        if others.iter().all(scatters) {
            let name = best.suspect.name();
            let wrong_km = shift_km.filter(|_| best.suspect == Suspect::Altitude).map(|shift| best.value + shift);
            let where_to = wrong_km.map(|km| {
                let side = if km < 0.0 { "high" } else { "low" };
                format!(" The given altitudes are {:.1} km too {side}; correct them where they come from.", km.abs())
            });
            let words = format!("{what} So the {name} is the likely cause.{}", where_to.unwrap_or_default());
            let step = format!("Correct the {name}: its row of the table has the button.");
            return Some(Self { words, step, open: vec![best.suspect] });
        }
        let open: Vec<Suspect> = plausible.iter().filter(|c| !scatters(c)).map(|c| c.suspect).collect();
        let names = open.iter().map(|suspect| suspect.name()).collect::<Vec<_>>().join(", ");
        let pairs = open.iter().enumerate().flat_map(|(i, a)| open.iter().skip(i + 1).map(move |b| [*a, *b]));
        let alike = |two| {
            let r = correlation(two).filter(|r| r.abs() > diagnosis::MOST_CORRELATION)?;
            Some(format!("In these pictures {}.", diagnosis::inseparable(two, r)))
        };
        let alike: Vec<String> = pairs.filter_map(alike).collect();
        let end = if alike.is_empty() {
            "Each explains the pictures nearly as well. Pictures from other altitudes, or with the limb at other \
             places, decide."
                .to_owned()
        } else {
            alike.join(" ")
        };
        let words = format!("{what} So the cause is one of these: {names}. {end}");
        let step = format!("Check these, and correct the one that is wrong: {names}.");
        Some(Self { words, step, open })
    }
}
