//! `[gates]` of sensor.toml: the gates that an answer must pass, and the choice among answers.

use crate::base::error::{ConfigError, between};
use crate::base::keys::{Section, choices, section};

choices! {
    /// Treatment of an answer whose edge stays in the picture while the vehicle turns.
    pub enum FixedEdge {
        /// The answer is refused with the verdict `fixed`.
        @0 Refuse = "refuse";
        /// The answer stays; the column `detail` says `suspect: fixed in the picture`, and the flight software sends an
        /// event.
        @1 Warn = "warn";
        /// Answers are not compared with the turn.
        @2 Off = "off";
    }
}

choices! {
    /// The answer among several edges.
    pub enum Choice {
        /// The edge with the smallest residual for the part of the limb in view that it covers; answers in different
        /// directions that are nearly as good make the picture `ambiguous`.
        @- Score = "score";
        /// The edge with the smallest mean square distance from its conic section (Braun & Barf 2022, (28)); no picture
        /// is `ambiguous`.
        @- SectionResidual = "section-residual" needs "dlr";
        /// The longest edge, and no other one even if it fails (HORACE).
        @- Longest = "longest" needs "horace";
    }
}

section! {
    /// `[gates]` of sensor.toml: the gates that an answer must pass, and the choice among answers.
    "gates" pub struct Config: Copy {
        /// Fewest inliers; a small body or picture needs fewer.
        ///
        /// A larger value refuses shorter limbs; with a smaller value more edges pass by chance. For a small disc, one
        /// third of its circumference in pixels is enough; in a picture of fewer than 80 rows or columns, one third of
        /// its shorter side is enough.
        @110 min_inliers: u16 = 24, [3.0 or more];
        /// Shortest length of edge that inliers must cover, px.
        ///
        /// A smaller value answers pictures with less limb in view, but many curves fit a short edge.
        @111 min_arc_px: Option<f64> = None, [0.0 to 1e6] {
            unset: "a tenth of the diagonal, or a third of the body's circumference if less",
            example: "60.0",
        };
        /// Largest weighted RMS distance of the inliers from the limb, px; where `consensus.noise_sigma` raises the
        /// largest distance of an inlier, this limit is raised by the same factor.
        ///
        /// A larger value answers pictures with a poor calibration or a rough limb, and may let edges pass that are no
        /// limb. For a disc with a radius below 46 px the limit is smaller in proportion to the radius, down to a
        /// quarter: an outline that departs from a circle by 4 % of its radius is a polygon or a patch of light.
        @112 max_rms_px: f64 = 2.0, [above 0.0];
        /// Largest difference between the fitted and the expected half-angle, in standard deviations.
        ///
        /// The bounds are the exact half-angles at this many standard deviations of altitude and limb height, widened
        /// by the standard deviation of the fitted half-angle. If the lower altitude is below the limb, any wider limb
        /// passes. A smaller value refuses more edges that are no limb, and also limbs whose altitude or limb height is
        /// worse than its sigma says.
        @113 max_half_angle_sigma: f64 = 3.0, [above 0.0];
        /// Largest standard deviation of an answer in its worst direction, degrees.
        ///
        /// Set a smaller value if your filter has no use for rough answers.
        @114 max_sigma_deg: f64 = 10.0, [above 0.0 to 180.0];
        /// Smallest part of the fitted limb in view that edge points must cover.
        ///
        /// A limb goes on where the edge of a mast or of a cloud ends. A larger value refuses more of these edges, and
        /// also limbs that are lit only in part.
        @115 min_support: f64 = 0.4, [0.0 to 1.0];
        /// Largest part of the sky beyond the fitted limb that may be lit.
        ///
        /// Beyond the edge of a cloud are other clouds, so a smaller value refuses more clouds. Ghosts in the sky next
        /// to a limb light up to a quarter of this sky, so a smaller value also refuses limbs next to ghosts.
        @116 max_lit_sky: f64 = 0.3, [0.0 to 1.0];
        /// For Sun and Moon, and for a position without a known range: brightness from which a place in the sky counts
        /// as lit, as a fraction of the threshold.
        ///
        /// These bodies stand in a dark sky. A glare fades outwards and does not count. A bright spot of a cloud may
        /// have the size of the Sun, but it lies among other clouds; a smaller value refuses more of these spots, and
        /// discs in stray light.
        @- dark_sky: f64 = 0.25, [above 0.0 to 1.0];
        /// Smallest part of an edge's points that must be inliers if the edge winds; 0 turns the check off.
        ///
        /// An edge winds if the path along its inliers is more than three times as long as the limb that they cover. A
        /// cloud's edge winds, and a part of it may lie on a limb by chance.
        @- whole_edge: f64 = 0.8, [0.0 to 1.0];
        /// Largest ratio of the cone's RMS residual to that of a circle of the image or of up to four straight pieces;
        /// 1e6 turns this test off.
        ///
        /// Lens flares are circles of the image; an iris and a vehicle have straight edges. A smaller value refuses
        /// more of them, and limbs that clouds make rough. If the residuals are noise, the ratio is about 1. A ratio of
        /// 2 is a likelihood ratio of 4 to the power of half the number of independent points.
        @- max_rival_ratio: f64 = 2.0, [1.0 to 1e6];
        /// Smallest evidence for the limb over a straight line, and largest evidence for a rival shape over the limb:
        /// twice the logarithm of the likelihood ratio; −1e6 turns these tests off.
        ///
        /// A value of 9 is three standard deviations. A larger value refuses more edges that are nearly straight, but
        /// fewer circles and polygons. Points with correlated residuals count once.
        @- min_evidence: f64 = 9.0, [-1e6 to 1e6];
        /// Floor of the noise in the second test of the half-angle, px; this test takes the noise from the residuals,
        /// even if the told noise is larger. With 0 the test is off, and with 1e4 it uses the told noise.
        ///
        /// The limit is `max_half_angle_sigma`. A larger value refuses fewer edges. A disc with a radius below 46.5 px
        /// is compared with a circle only if its residuals exceed `max_rival_ratio` times this floor.
        @- residual_floor_px: f64 = 0.1, [0.0 to 1e4];
        /// Longest smooth continuation of an edge next to the fitted limb, as a part of its longest run of inliers; 1e6
        /// turns the gate off.
        ///
        /// The edge of a panel or of an iris goes on smoothly where it leaves the fitted limb. A continuation counts
        /// where it keeps 0.6 of the limb's contrast. A smaller value refuses more of these edges, and limbs that touch
        /// another bright edge.
        @- max_departure: f64 = 0.2, [0.0 to 1e6];
        /// Smallest part of the fitted limb in view that edge points must cover if the edge leaves the limb without a
        /// loss of contrast; 0 turns the gate off.
        ///
        /// The corner of an iris and the crossing of two flares end an edge in this way. The default is 0, because 0.7
        /// also refuses half-lit discs and crescents.
        @- min_support_abrupt: f64 = 0.0, [0.0 to 1.0];
        /// Largest brightness high above the limb, as a part of the brightness step at the limb; 1e6 turns the gate
        /// off.
        ///
        /// The brightness is read at a height above the limb that is the sum of three standard deviations of the limb
        /// height, 4.8 scale heights of the air and four pixels. Sunlit air leaves a fifteenth there in an sRGB
        /// picture. Airglow and aurora reach higher, and their edge is not the limb. A larger value answers pictures
        /// with more light above the limb, and takes the risk that their edge is airglow. Bodies without known air are
        /// not checked, and nor is a camera that is below the airglow: 3σ of its altitude below 85 km.
        @- max_glow: f64 = 0.125, [0.0 to 1e6];
        /// Largest part of the inliers at which a second edge inside the limb leads back to the brightness of the sky;
        /// 1 turns the gates `band` and `faint` off.
        ///
        /// A smaller value refuses more bands, such as rings and streaks of light. The gate `band` is only for a body
        /// that does not fit into the picture, because a crescent is a band, too.
        @- max_band: f64 = 0.5, [0.0 to 1.0];
        /// Smallest probability that the edge of an answer is the limb (column `p_limb`); 0 turns the gate off.
        ///
        /// Set it to 0.75 if a false answer costs as much as three right answers, and to 0.9 if it costs as much as
        /// nine. With a larger value fewer false answers pass, and more limbs are refused, such as drawn ones without
        /// air. Bodies without known air, Sun and Moon have no such probability.
        // An answer is worth giving if (1 − p) C < p, so p > C/(1 + C) with the cost C of a false answer: 3 gives 0.75.
        @135 min_p_limb: f64 = 0.0, [0.0 to 1.0];
        /// Odds that an edge that passes all other gates is the limb, before its evidence is weighed.
        ///
        /// The default is for a camera that sees a limb in half of its pictures: the other gates let about one in fifty
        /// pictures without a limb pass. Set a smaller value if limbs are rarer, for example 5 for one picture in ten.
        @136 prior_odds: f64 = 50.0, [above 0.0 to 1e9];
        /// Largest angle between the axis and the axis that a given attitude and position predict, in combined standard
        /// deviations of the answer and of that attitude.
        ///
        /// A smaller value refuses more false answers, and right answers whose attitude is worse than its sigma says.
        @130 max_attitude_sigma: f64 = 4.0, [above 0.0 to 1e6];
        /// Largest rate of rotation of the vehicle, degrees per second; an axis that is farther from the previous
        /// answer is refused.
        ///
        /// Set it to the largest rate that the vehicle can reach: a smaller value refuses right answers. Pictures are
        /// then processed in order.
        @132 max_rate_deg_s: Option<f64> = None, [above 0.0 to 1e6] { unset: "any", example: "100.0" };
        /// Treatment of an answer whose edge stays in the picture while the vehicle turns: the edge belongs to the
        /// window, the lens or the vehicle.
        ///
        /// The turn comes from the columns `rate_x` to `rate_z` of frames.csv, or from an attitude; without both,
        /// nothing is compared. The first picture of a sequence has nothing to be compared with, and nor has a vehicle
        /// that turns more slowly than an orbit turns the direction to the body, 0.07° per second.
        ///
        /// `hzn run` and `hzn fly` treat a picture in the same way that is one of the 32 before to the last bit
        /// although its time is told and another one: the camera or its recorder stands still.
        @133 fixed_edge: FixedEdge = FixedEdge::Refuse, [choice];
        /// Evidence for an edge that is fixed in the picture from which `fixed_edge` acts, in standard deviations.
        ///
        /// A larger value refuses fewer right answers by chance, and needs a larger turn. With 3, at most 0.14 % of
        /// right answers are refused if the covariance is right.
        @134 fixed_edge_sigma: f64 = 3.0, [above 0.0 to 1e3];
        /// Largest part of the inliers that the given Sun does not light; 1 turns the gate off, and so does
        /// `body.sunlit = false`, which is for a thermal camera.
        ///
        /// A Sun more than 18° below the horizon does not light a point. With the column `utc` and a position the Sun
        /// is known, too: at night no limb of the Earth counts. It is night where the Sun is 18° plus the dip of the
        /// horizon below the horizon of the point below the camera. An attitude then gives the direction of the Sun, if
        /// the columns `sun_x` to `sun_z` are empty.
        @131 max_unlit: f64 = 0.5, [0.0 to 1.0];
        /// Which of several edges that pass is the answer.
        ///
        /// Every value but `score` examines every edge of the picture, which takes more time.
        @- choice: Choice = Choice::Score, [choice];
        /// Whether a part of the expected limb must lie in the picture: the limb with the expected half-angle about the
        /// fitted axis.
        @- limb_in_view: bool = false, ["true or false"] { needs: "dlr" };
        /// Largest mean square distance of the points from the expected conic section, focal lengths squared.
        ///
        /// The distance is measured along the section's principal axis.
        @- max_section_residual: Option<f64> = None, [above 0.0] { needs: "dlr", unset: "any", example: "0.025" };
        /// [lowest, highest] altitude, km: the radius of the fitted circle must be that of a limb between them.
        ///
        /// Wider limits refuse fewer circles; at altitude 0 the radius has no upper limit. If no altitude is given,
        /// neither in `[body]` nor with the picture, the limb is searched between them: the expected altitude is their
        /// middle, with half of their distance as 1σ. The answer to a short arc is then coarse, but that of several
        /// cameras (`hzn run rig.toml`) is not.
        @- altitude_limits_km: Option<[f64; 2]> = None, [0.0 to 1e9]
            { needs: "horace", unset: "any", example: "[0.0, 1000.0]" };
        /// With `altitude_limits_km`: the radius may lie beyond its limits by this fraction of each limit.
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
        (self.max_glow, self.min_p_limb) = (1e6, 0.0);
        self.max_attitude_sigma = 1e6;
        self.fixed_edge = FixedEdge::Off;
    }
}
