//! What `hzn explain` draws over the picture.

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_mcap::Annotations;
use hzn_run::engine::Trace;
use hzn_run::overlay::caption::{Caption, legend};
use hzn_run::overlay::undistorted::Undistorted;
use hzn_run::source::Picture;
use hzn_run::{engine, explain, overlay};

use crate::exit::{Stop, usage};
use crate::tell;

/// What is drawn over the picture.
#[derive(Default)]
pub(super) struct Drawing {
    annotations: Annotations,
    answers: Vec<Solution<f64>>,
}

impl Drawing {
    /// Adds the edges, the points and the answer of a body.
    pub(super) fn add(&mut self, trace: &Trace, solution: Option<&Solution<f64>>, camera: &Camera<f64>) {
        self.annotations.add(engine::annotate(trace, solution, camera));
        self.answers.extend(solution.copied());
    }

    /// Returns the picture with the drawing, without the distortion of the lens if there is a lens. Says what kind of
    /// conic section each limb is, and which axis is out of view.
    pub(super) fn over(
        &self,
        picture: &Picture,
        lens: Option<&Camera<f64>>,
        caption: &Caption,
    ) -> Result<image::RgbImage, Stop> {
        let Some(lens) = lens else {
            let caption = Caption { legend: legend(&self.annotations), ..caption.clone() };
            return Ok(overlay::draw(picture.to_rgb(), &self.annotations, &[], &caption));
        };
        let axes: Vec<_> = self.answers.iter().map(|s| s.axis).collect();
        let undistorted = Undistorted::new(lens, &axes)
            .ok_or_else(|| usage("--undistorted: the camera sees nothing within 75 deg of its optical axis"))?;
        let mut drawing = undistorted.points(&self.annotations);
        for answer in &self.answers {
            let limb = undistorted.answer(answer);
            tell::line(format_args!("undistorted: {}", explain::section_text(answer, !limb.axes.is_empty())));
            drawing.add(limb);
        }
        // A pinhole has another scale than the lens.
        let caption = Caption { legend: legend(&drawing), scale: None, ..caption.clone() };
        Ok(overlay::draw(undistorted.picture(&picture.to_rgb()), &drawing, &[], &caption))
    }
}
