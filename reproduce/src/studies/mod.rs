//! Lists the studies in the order of the document.

mod airglow;
mod artefacts;
mod atek;
mod atek_largest;
mod controller;
mod defaults;
mod design;
mod effects;
mod estimators;
mod horace;
mod infrared;
mod lens;
mod limb_heights;
mod looks;
mod orbit;
mod papers;
mod position;
mod presets;
mod real;
mod recordings;
mod residuals;
mod scenes;
mod setup;
mod spin;
mod suns;
mod yaw;

use crate::document::Document;
use crate::section::Section;

pub(crate) use setup::Effort;

/// Study with its section of a document.
pub(crate) struct Study {
    /// Name on the command line and in marks.
    pub(crate) name: &'static str,
    /// Heading of the section.
    pub(crate) title: &'static str,
    /// Document that contains the section.
    pub(crate) document: Document,
    /// Function that measures.
    pub(crate) run: fn(&Effort) -> anyhow::Result<Section>,
}

/// All studies.
pub(crate) const ALL: &[Study] = &[
    reproduced("sensitivity", "Covariance by design: [BB] figures 19 to 22", design::sensitivity),
    reproduced("visibility", "Which conic is seen: [BB] figures 6 and 7", design::visibility),
    reproduced("spherical-earth", "Error of a spherical Earth: [BB] figure 8", design::spherical_earth),
    reproduced("infrared", "Infrared Earth sensor: [W] figures 5 to 8", infrared::off_nadir),
    reproduced("estimators", "Estimators and noisy points: [W] figures 7 and 8, step 6", estimators::figures_7_and_8),
    reproduced("thresholds", "The controller of the threshold: [B14], 6", controller::thresholds_of_a_flight),
    reproduced("horace", "Criteria of HORACE: [B14], [H15]", horace::criteria),
    reproduced("leo-infrared", "Accuracy and honesty: infrared in low orbit", infrared::flight),
    reproduced("limb-heights", "Height of the limb at 15 µm", limb_heights::table),
    reproduced("rocket", "Accuracy and honesty: sounding rocket", scenes::rocket),
    reproduced("scenes", "Accuracy and honesty: the other scenes", scenes::others),
    reproduced("position", "Positions: rendered bodies of every size and phase", position::rendered),
    reproduced("artefacts", "False answers: artefacts instead of a limb", artefacts::campaign),
    reproduced("airglow", "False answers: airglow and aurora on the night side", airglow::night_side),
    reproduced("suns", "False answers: clouds and reflections instead of the Sun", suns::false_suns),
    reproduced("defaults", "Honesty with default settings", defaults::default_settings),
    reproduced("lens-from-limb", "The lens from the limb", lens::from_the_limb),
    reproduced("atek", "Navigation: the flight of ATEK, [BB] figures 37 to 44", atek::navigation),
    reproduced("atek-largest", "Navigation: ATEK in the paper's statistics", atek_largest::statistics),
    reproduced("spin", "Navigation: five turns a second, the motive of [BB]", spin::navigation_through_spin),
    reproduced("orbit", "Navigation: orbits through eclipse and infrared orbits", orbit::navigation),
    reproduced("effects", "What moves the limb in the scenes", effects::switched_off_effects),
    reproduced("lost-discs", "Discs under an image circle", looks::lost_discs),
    reproduced("second-look", "One look and several", looks::second_look),
    reproduced("yaw", "The third axis from the shape of the limb", yaw::orbits),
    reproduced("real-pictures", "Photographs at many settings", looks::real_pictures),
    reproduced("real", "Photographs with truth", real::suite),
    Study { name: "presets", title: "Presets compared", document: Document::Methods, run: presets::compare_presets },
    // The last one, because it compares its numbers with those of the other sections.
    Study { name: "papers", title: "Printed and measured", document: Document::Papers, run: papers::compare },
];

const fn reproduced(name: &'static str, title: &'static str, run: fn(&Effort) -> anyhow::Result<Section>) -> Study {
    Study { name, title, document: Document::Reproduction, run }
}

/// Returns the names of the sections of a document, in their order.
pub(crate) fn names_in(document: Document) -> Vec<&'static str> {
    ALL.iter().filter(|study| study.document == document).map(|study| study.name).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::document::find_section;

    #[test]
    fn the_documents_hold_every_study_and_its_figures() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../book");
        let text = |document: Document| std::fs::read_to_string(docs.join(document.file())).unwrap();
        for study in ALL {
            let document = text(study.document);
            let section = find_section(&document, study.name).unwrap_or_else(|| panic!("{} was not run", study.name));
            assert!(section.contains(study.title), "{}", study.name);
        }
        for figure in text(Document::Reproduction).split("](figures/").skip(1) {
            let file = figure.split(')').next().unwrap();
            assert!(docs.join("results/figures").join(file).is_file(), "{file}");
        }
    }

    /// The page is made from tables, so it can be compared as a whole. Every row of the tables is checked on the way.
    #[test]
    fn the_page_of_the_papers_is_that_of_the_tables() {
        let papers = ALL.iter().find(|study| study.document == Document::Papers).unwrap();
        let section = (papers.run)(&Effort { frames: None, recordings: None }).unwrap();
        let section = section.markdown(papers.name, papers.title);
        let page = Document::Papers.put("", &names_in(Document::Papers), papers.name, &section).unwrap();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../book").join(Document::Papers.file());
        let committed = std::fs::read_to_string(path).unwrap();
        let different = page.lines().zip(committed.lines()).find(|(new, old)| new != old);
        assert_eq!(different, None, "`cargo xtask reproduce papers` writes the page");
        assert_eq!(page.len(), committed.len());
    }
}
