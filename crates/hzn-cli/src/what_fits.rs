//! What would fit a limb of another size than expected: the sentence for the end of a run.

use hzn_core::Config;
use hzn_run::diagnosis::{self, AnyCone, FitFacts};
use hzn_run::open::{Request, open};

/// What refused pictures say about the size of the limb.
pub(crate) struct WhatFits {
    /// What would fit in the middle one of the pictures, in words.
    pub(crate) text: String,
    /// Number of pictures with a limb of another size than expected.
    pub(crate) pictures: usize,
}

/// Looks for a limb of any size in some refused pictures of a sequence, and says what would fit in the middle one of
/// them. `None` if the pictures show no limb, or one of the expected size.
pub(crate) fn in_pictures(request: &Request, config: &Config, indices: &[u64]) -> Option<WhatFits> {
    // A sentence at the end of a run must not make the run fail, so that an error here only leaves it out.
    let mut opened = open(request).ok()?;
    let mut trial = AnyCone::new(config, request.flight).ok()?;
    let camera = hzn_core::camera::Camera::try_new(&config.camera).ok()?;
    let mut found: Vec<(String, FitFacts)> = Vec::new();
    for index in 0..=*indices.iter().max()? {
        let mut item = opened.source.next()?.ok()?;
        if !indices.contains(&index) {
            continue;
        }
        let data = item.take_prior(opened.frames.as_ref());
        let Ok((picture, _)) = item.payload.decode(Some(config)) else { continue };
        let Ok(view) = picture.view(config.input.channel) else { continue };
        let fit = diagnosis::find_misfit(&mut trial, config, &view, data.as_ref());
        found.extend(fit.map(|fit| (item.name, fit)));
    }
    found.sort_by(|(_, a), (_, b)| a.fitted_deg.total_cmp(&b.fitted_deg));
    let (name, fit) = found.get(found.len().checked_sub(1)? / 2)?;
    let text = format!("in {name} {}", diagnosis::what_fits(fit, &camera, config.camera.width));
    Some(WhatFits { text, pictures: found.len() })
}
