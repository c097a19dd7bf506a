//! `[gates]` of sensor.toml: the gates that an answer must pass, and the choice among answers.

use crate::base::error::{ConfigError, between};
use crate::base::keys::{Section, section};

section! {
    /// `[gates]` of sensor.toml: the gates that an answer must pass, and the choice among answers.
    "gates" pub struct Config: Copy {
        /// Fewest inliers; a small body or picture needs fewer.
        ///
        /// For a small disc, one third of its circumference in pixels is enough; in a picture of fewer than 80 rows or
        /// columns, one third of its shorter side.
        @110 min_inliers: u16 = 24, [8.0 or more];
        /// Shortest length of edge that inliers must cover, px.
        ///
        /// Many curves fit a shorter edge.
        @111 min_arc_px: Option<f64> = None, [0.0 to 1e6] {
            unset: "a tenth of the diagonal, or a third of the body's circumference if less",
            example: "60.0",
        };
        /// Largest weighted RMS distance of the inliers from the limb, px; it grows as `consensus.noise_sigma` raises
        /// the largest distance of an inlier.
        @112 max_rms_px: f64 = 2.0, [above 0.0];
        /// Largest difference between the fitted and the expected half-angle, in standard deviations.
        @113 max_half_angle_sigma: f64 = 3.0, [above 0.0];
        /// Largest standard deviation of an answer, degrees.
        @114 max_sigma_deg: f64 = 10.0, [above 0.0 to 180.0];
        /// Smallest part of the fitted limb in view that edge points must cover.
        ///
        /// A limb goes on where the edge of a mast or of a cloud ends.
        @115 min_support: f64 = 0.4, [0.0 to 1.0];
        /// Largest part of the sky beyond the fitted limb that may be lit.
        ///
        /// Beyond the edge of a cloud are other clouds. Ghosts in the sky next to a limb light up to a quarter of it.
        @116 max_lit_sky: f64 = 0.3, [0.0 to 1.0];
        /// For Sun and Moon: a place in the sky counts as lit from this part of the threshold on.
        ///
        /// Sun and Moon stand in a dark sky. A glare fades outwards and does not count. A bright spot of a cloud has
        /// the same size, but it lies among other clouds.
        @- dark_sky: f64 = 0.25, [above 0.0 to 1.0];
        /// Where at least this part of an edge's points are inliers, the edge may wind; 0 turns the check off.
        ///
        /// The path along the inliers of any other edge may be three times as long as the limb that they cover. A
        /// cloud's edge winds, and a part of it may lie on a limb by chance.
        @- whole_edge: f64 = 0.8, [0.0 to 1.0];
        /// Largest ratio of the cone's residual to that of a circle of the image or of four straight pieces; 1e6 turns
        /// the gate off.
        ///
        /// Lens flares are circles of the image; an iris and a vehicle have straight edges. Where residuals are noise
        /// the ratio is about 1. A ratio of 2 is a likelihood ratio of 4 to the power of half the number of independent
        /// points.
        @- max_rival_ratio: f64 = 2.0, [1.0 to 1e6];
        /// Smallest evidence for the limb over a straight line, and largest evidence for a rival shape over the limb:
        /// twice the logarithm of the likelihood ratio; −1e6 turns the gate off.
        ///
        /// A value of 9 is three standard deviations. Points with correlated residuals count once.
        @- min_evidence: f64 = 9.0, [-1e6 to 1e6];
        /// Floor of an edge's noise in the gate of the half-angle, where the residuals are smaller than the given
        /// noise, px; with 1e4 the gate uses the told noise.
        @- residual_floor_px: f64 = 0.1, [0.0 to 1e4];
        /// Longest smooth continuation of an edge next to the fitted limb, as a part of its longest run of inliers; 1e6
        /// turns the gate off.
        ///
        /// A continuation counts where it keeps 0.6 of the limb's contrast.
        @- max_departure: f64 = 0.2, [0.0 to 1e6];
        /// Smallest part of the fitted limb in view that edge points must cover, where the edge leaves the limb without
        /// a loss of contrast; 0 turns the gate off.
        ///
        /// The corner of an iris and the crossing of two flares end an edge in this way. The default is 0, because 0.7
        /// also refuses half-lit discs and crescents.
        @- min_support_abrupt: f64 = 0.0, [0.0 to 1.0];
        /// Largest brightness high above the limb, as a part of the brightness step at the limb; 1e6 turns the gate
        /// off.
        ///
        /// It is read three standard deviations of the limb height, 4.8 scale heights of the air and four pixels above
        /// the limb. Sunlit air leaves a fifteenth there in an sRGB picture. Airglow and aurora reach higher, and their
        /// edge is not the limb. Bodies without known air are not checked.
        @- max_glow: f64 = 0.125, [0.0 to 1e6];
        /// Largest part of the inliers at which a second edge inside the limb leads back to the brightness of the sky;
        /// 1 turns the gate off.
        ///
        /// The gate is only for a body that does not fit into the picture, because a crescent is a band, too.
        @- max_band: f64 = 0.5, [0.0 to 1.0];
        /// Largest angle between the axis and the axis that a given attitude and position predict, in standard
        /// deviations.
        @- max_attitude_sigma: f64 = 4.0, [above 0.0 to 1e6];
        /// Largest rate of rotation of the vehicle, degrees per second; an axis that is farther from the previous
        /// answer is refused.
        ///
        /// Pictures are then processed in order.
        @- max_rate_deg_s: Option<f64> = None, [above 0.0 to 1e6] { unset: "any", example: "100.0" };
        /// Largest part of the inliers that the given Sun does not light; 1 turns the gate off, and so does
        /// `body.sunlit = false`.
        @- max_unlit: f64 = 0.5, [0.0 to 1.0];
        /// Whether a part of the limb with the expected half-angle about the fitted axis must lie in the picture.
        @- limb_in_view: bool = false, ["true or false"] { needs: "dlr" };
        /// Largest mean square distance of the points from the expected conic section, focal lengths squared.
        ///
        /// The distance is measured along the section's principal axis.
        @- max_section_residual: Option<f64> = None, [above 0.0] { needs: "dlr", unset: "any", example: "0.025" };
        /// [lowest, highest] altitude, km: the radius of the fitted circle must be that of a limb between them.
        ///
        /// At altitude 0 the limb is infinitely wide.
        @- altitude_limits_km: Option<[f64; 2]> = None, [0.0 to 1e9]
            { needs: "horace", unset: "any", example: "[0.0, 1000.0]" };
        /// With `altitude_limits_km`: the radius may lie beyond its limits by this fraction of the limits.
        @- radius_margin: f64 = 0.1, [0.0 to 1000.0] { needs: "horace" };
        /// With `altitude_limits_km`: the radius may lie beyond its limits by this length, px.
        ///
        /// HORACE's margin is 5000 px (Barf 2014, (2.35)).
        @- radius_margin_px: f64 = 0.0, [0.0 to 1e6] { needs: "horace" };
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.check_keys()?;
        if let Some([low, high]) = self.altitude_limits_km {
            between("gates.altitude_limits_km", high, low, 1e9)?;
        }
        Ok(())
    }

    /// Turns off every gate that compares an edge with shapes other than a limb. This is for the presets that rebuild
    /// published systems.
    pub(crate) fn trust_every_shape(&mut self) {
        (self.max_rival_ratio, self.min_evidence, self.residual_floor_px) = (1e6, -1e6, 1e4);
        (self.min_support_abrupt, self.whole_edge) = (0.0, 0.0);
        (self.max_departure, self.max_band, self.max_unlit) = (1e6, 1.0, 1.0);
        self.max_glow = 1e6;
        self.max_attitude_sigma = 1e6;
    }
}
