//! What is drawn of a report: the fitted limb, and with `detail=True` edges and points.

use hzn_core::frames::UnitVec3;
use hzn_mcap::Annotations;

use crate::report::Report;

impl Report {
    /// Returns the annotations of this body.
    pub(crate) fn drawing(&self) -> &Annotations {
        self.drawing.get_or_init(|| {
            if let Some(detail) = &self.detail {
                return detail.drawing.clone();
            }
            let fitted = || {
                if let Some(solution) = &self.placed {
                    return Some(hzn_run::overlay::draw_limb(solution, &self.camera.as_ref()?.lens));
                }
                let axis = UnitVec3::try_new(self.row.axis()?)?;
                Some(hzn_run::overlay::draw_cone(&axis, self.half_angle_rad?, &self.camera.as_ref()?.lens))
            };
            fitted().unwrap_or_default()
        })
    }

    /// Returns the annotations of all bodies.
    pub(crate) fn drawing_of_all(&self) -> Annotations {
        let mut all = Annotations::default();
        self.each().for_each(|r| all.add(r.drawing().clone()));
        all
    }
}
