//! Each gate that compares numbers passes an edge at its limit and refuses one just beyond it.

use std::vec::Vec;

use super::case::Case;
use super::view::Cover;
use super::*;
use crate::base::linalg::{V3, basis};
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::{self, Camera, Model};
use crate::geometry::frames::UnitVec3;
use crate::geometry::pixel::ImagePoint;
use crate::image::region::Region;
use crate::model::body::{self, Expected, LOWEST_SUN_DEG, Last, Prior};
use crate::model::evidence::{Evidence, Term};
use crate::model::found_limb::FoundLimb;
use crate::model::work::WorkBudget;
use crate::pipeline::edges::Edges;
use crate::stages::covariance::{self, Fused};
use crate::stages::fit::{self, Fit};
use crate::stages::{consensus, gates};

/// Sigma of the answer, and that of another axis; together 0.005 rad.
const SIGMAS_RAD: [f64; 2] = [0.003, 0.004];

/// A limb of the Earth with everything that a gate asks about it.
pub(super) struct Limb {
    camera: Camera<f64>,
    region: Region<f64>,
    expected: Expected<f64>,
    blocks: Vec<Block<f64>>,
    points: u32,
    fit: Fit<f64>,
    fused: Fused<f64>,
    fit_config: fit::Config,
    config: gates::Config,
    cover: Cover<f64>,
    taken: Vec<FoundLimb<f64>>,
    min_inlier_share: f64,
}

impl Limb {
    /// Fits the limb from 400 km, 640×480 px. `place` returns the point of the edge for a point of the limb.
    fn new(place: impl Fn(ImagePoint<f64>) -> ImagePoint<f64>) -> Self {
        let camera = Camera::try_new(&camera::Config::ideal(Model::Pinhole, 640, 480, 554.0)).unwrap();
        let prior = Prior { altitude_m: Some(400e3), ..Prior::default() };
        let body = body::Config {
            kind: body::Kind::Sphere,
            radius_km: Some(6371.0),
            limb_height_km: 0.0,
            altitude_sigma_km: 0.5,
            ..body::Config::default()
        };
        let expected = Expected::new(&body, &prior).unwrap();
        let (sin, cos) = (expected.sin, expected.cos);
        // The limb passes through the middle of the picture, level.
        let e = V3::new(0.0, sin, cos);
        let (b1, b2) = basis(&e);
        let mut points: Vec<_> = (0..24_000)
            .filter_map(|i| {
                let (s, c) = libm::sincos(f64::from(i) * core::f64::consts::TAU / 24_000.0);
                camera.project(&UnitVec3::assume_unit(e * cos + (b1 * c + b2 * s) * sin))
            })
            .filter(|p| (0.0..639.0).contains(&p.u) && (0.0..479.0).contains(&p.v))
            .collect();
        points.sort_by(|a, b| a.u.total_cmp(&b.u));
        let mut thinned: Vec<ImagePoint<f64>> = Vec::new();
        for point in points {
            if thinned.last().is_none_or(|last| point.u - last.u >= 2.0) {
                thinned.push(point);
            }
        }
        let points: Vec<_> = thinned.into_iter().map(place).collect();
        let mut blocks = Edges::new(&camera, &points, &UnitVec3::assume_unit(e)).blocks;
        let (fit_config, noise) = (fit::Config::default(), covariance::Config::default());
        let config = consensus::Config::default();
        let threshold = consensus::Threshold::from_config(&config);
        let mut work = WorkBudget::unlimited();
        let (fx, _) = camera.focal_px();
        let count = points.len() as u32;
        let start = consensus::find(&mut blocks, count, &expected, fx, threshold, &config, &mut work).unwrap();
        let fit = fit::fit(&mut blocks, &start, &expected, &camera, config.threshold_px, &fit_config, &noise).unwrap();
        let fused = covariance::fuse(&blocks, &fit, &expected, &noise, &fit_config, &camera, None).unwrap();
        let region = Region::whole(640, 480);
        let cover = Cover::new(&fit, &fused, &blocks, &camera, &region);
        Self {
            camera,
            region,
            expected,
            blocks,
            points: count,
            fit,
            fused,
            fit_config,
            config: gates::Config::default(),
            cover,
            taken: Vec::new(),
            min_inlier_share: 0.5,
        }
    }

    pub(super) fn exact() -> Self {
        Self::new(|point| point)
    }

    pub(super) fn case(&self) -> Case<'_, f64> {
        Case {
            number: 0,
            fit: &self.fit,
            fused: &self.fused,
            sigma_max_rad: SIGMAS_RAD[0],
            expected: &self.expected,
            taken: &self.taken,
            blocks: &self.blocks,
            points: self.points,
            fallback: 0,
            min_inlier_share: self.min_inlier_share,
            raised: 1.0,
            width_px: 3.0,
            camera: &self.camera,
            region: &self.region,
            fit_config: &self.fit_config,
            config: &self.config,
            cover: self.cover,
        }
    }

    /// Returns what a gate says after a change.
    fn after(
        change: impl FnOnce(&mut Self),
        gate: impl FnOnce(&Case<'_, f64>) -> Result<(), Verdict>,
    ) -> Result<(), Verdict> {
        let mut limb = Self::exact();
        change(&mut limb);
        gate(&limb.case())
    }

    /// Returns an axis at an angle from the answer.
    fn axis_at(&self, angle_rad: f64) -> V3<f64> {
        let (sin, cos) = libm::sincos(angle_rad);
        self.fused.e * cos + basis(&self.fused.e).0 * sin
    }
}

type Gate = fn(&Case<'_, f64>) -> Result<(), Verdict>;

/// The gates that ask neither the picture nor the residuals.
const BY_NUMBERS: [Gate; 17] = [
    no_consensus::refuse,
    few_inliers::refuse,
    short_arc::refuse,
    residuals::refuse,
    half_angle::refuse,
    uncertain::refuse,
    unsupported::refuse,
    indistinct::refuse,
    night::refuse,
    sun::refuse,
    attitude::refuse,
    rate::refuse,
    curvature::refuse,
    out_of_view::refuse,
    section::refuse,
    radius::refuse,
    side::refuse,
];

#[test]
fn a_limb_passes() {
    let limb = Limb::exact();
    for (i, gate) in BY_NUMBERS.iter().enumerate() {
        assert_eq!(gate(&limb.case()), Ok(()), "gate {i}");
    }
}

#[test]
fn limits_of_length_and_number_are_allowed_and_less_is_refused() {
    let inliers = |n: u32| Limb::after(|limb| limb.fit.inliers = n, few_inliers::refuse);
    assert_eq!((inliers(24), inliers(23)), (Ok(()), Err(Verdict::FewInliers)));
    let arc = |px: f64| {
        let change = |limb: &mut Limb| (limb.config.min_arc_px, limb.cover.length_px) = (Some(75.0), px);
        Limb::after(change, short_arc::refuse)
    };
    assert_eq!((arc(75.0), arc(74.9)), (Ok(()), Err(Verdict::ShortArc)));
    let share = |share: f64| Limb::after(|limb| limb.cover.share = share, unsupported::refuse);
    let least = size::min_support(&gates::Config::default(), &Limb::exact().expected);
    assert_eq!((share(least), share(least - 1e-6)), (Ok(()), Err(Verdict::Unsupported)));
    let nearby = |n: u32| Limb::after(|limb| (limb.fit.inliers, limb.fit.nearby) = (30, n), indistinct::refuse);
    assert_eq!((nearby(10), nearby(11)), (Ok(()), Err(Verdict::Indistinct)));
    let sigma = |deg: f64| Limb::after(|limb| limb.config.max_sigma_deg = deg, uncertain::refuse);
    let own = SIGMAS_RAD[0].to_degrees();
    assert_eq!((sigma(own * 1.001), sigma(own * 0.999)), (Ok(()), Err(Verdict::Uncertain)));
}

#[test]
fn a_winding_edge_is_refused_unless_it_is_whole() {
    let path = |times: f64, whole: bool| {
        let change = |limb: &mut Limb| {
            limb.fit.arc_px = times * limb.cover.length_px;
            limb.points = if whole { limb.fit.inliers } else { 2 * limb.fit.inliers };
        };
        Limb::after(change, indistinct::refuse)
    };
    assert_eq!((path(2.9, false), path(3.1, false)), (Ok(()), Err(Verdict::Indistinct)));
    assert_eq!(path(3.1, true), Ok(()));
}

#[test]
fn a_long_terminator_beside_a_third_of_the_circle_is_allowed() {
    // 45 of 100 points are inliers: too few, unless the rest may be a terminator.
    let circle = |part: f64, phases: bool| {
        let change = |limb: &mut Limb| {
            (limb.fit.inliers, limb.points, limb.expected.phases) = (45, 100, phases);
            let (fx, _) = limb.camera.focal_px();
            limb.cover.length_px = part * core::f64::consts::TAU * fx * limb.expected.sin;
        };
        Limb::after(change, no_consensus::refuse)
    };
    assert_eq!((circle(0.34, true), circle(0.33, true)), (Ok(()), Err(Verdict::NoConsensus)));
    assert_eq!(circle(0.34, false), Err(Verdict::NoConsensus));
}

#[test]
fn the_limit_of_the_residuals_shrinks_with_a_small_disc() {
    let rms = |radius_px: Option<f64>, rms_px: f64| {
        let change = |limb: &mut Limb| {
            limb.fit.rms_px = rms_px;
            if let Some(radius_px) = radius_px {
                limb.fit.k = 1.0 - libm::cos(libm::asin(radius_px / limb.camera.focal_px().0));
            }
        };
        Limb::after(change, residuals::refuse)
    };
    let refused = Err(Verdict::Residuals);
    assert_eq!((rms(None, 1.99), rms(None, 2.01), rms(None, f64::NAN)), (Ok(()), refused, refused));
    // 4.3 % of the radius, but at least a quarter of the whole limit.
    assert_eq!((rms(Some(30.0), 1.28), rms(Some(30.0), 1.30)), (Ok(()), refused));
    assert_eq!((rms(Some(5.0), 0.49), rms(Some(5.0), 0.51)), (Ok(()), refused));
}

#[test]
fn a_half_angle_may_differ_by_three_sigmas() {
    let differs = |sigmas: f64| {
        let change = |limb: &mut Limb| {
            let variance = limb.expected.variance_towards(limb.fit.c, 3.0).unwrap() + 1e-6;
            limb.fused.var_free_cos = Some(1e-6);
            limb.fit.c = limb.expected.cos + sigmas * variance.sqrt();
            limb.fused.chi2 = sigmas * sigmas;
        };
        Limb::after(change, half_angle::refuse)
    };
    for sign in [1.0, -1.0] {
        assert_eq!(differs(2.9 * sign), Ok(()), "{sign}");
        assert_eq!(differs(3.2 * sign), Err(Verdict::HalfAngle), "{sign}");
    }
}

#[test]
fn a_smooth_edge_knows_its_half_angle_better_than_the_told_noise() {
    let d = 0.02;
    let with = |rms_px: f64| {
        let change = |limb: &mut Limb| {
            limb.expected.sigma_cos = 1e-5;
            limb.fit.rms_px = rms_px;
            limb.fit.c = limb.expected.cos + d;
            // With the told noise, the difference is two sigmas.
            let scale = d * d / (4.0 * limb.fused.edge.var_cos);
            limb.fused.edge.var_cos *= scale;
            limb.fused.edge.sigma_px *= scale.sqrt();
            limb.fused.var_free_cos = Some(limb.fused.edge.var_cos);
        };
        Limb::after(change, curvature::refuse)
    };
    assert_eq!((with(0.0), with(1e3)), (Err(Verdict::HalfAngle), Ok(())));
}

#[test]
fn an_edge_must_know_on_which_side_of_it_the_body_is() {
    // The variance of the half-angle may be a sixteenth of 4 c c₀.
    let known = |part: f64| {
        let change = |limb: &mut Limb| {
            limb.fit_config.half_angle = fit::HalfAngle::Fused;
            limb.fused.var_free_cos = Some(part * 4.0 * limb.fit.c * limb.expected.cos / 16.0);
        };
        Limb::after(change, side::refuse)
    };
    assert_eq!((known(0.99), known(1.01)), (Ok(()), Err(Verdict::Straight)));
    assert_eq!(Limb::after(|limb| limb.fused.var_free_cos = None, side::refuse), Err(Verdict::Straight));
}

#[test]
fn an_axis_may_differ_from_the_attitude_by_four_sigmas_of_both() {
    let at = |angle_rad: f64, limit: f64| {
        let change = |limb: &mut Limb| {
            limb.config.max_attitude_sigma = limit;
            limb.expected.predicted = Some((limb.axis_at(angle_rad), SIGMAS_RAD[1]));
        };
        Limb::after(change, attitude::refuse)
    };
    assert_eq!((at(0.0199, 4.0), at(0.0201, 4.0)), (Ok(()), Err(Verdict::Attitude)));
    assert_eq!((at(0.0099, 2.0), at(0.0101, 2.0)), (Ok(()), Err(Verdict::Attitude)));
}

#[test]
fn an_axis_may_turn_by_the_rate_and_four_sigmas_of_both() {
    let turned = |angle_rad: f64, age_s: f64| {
        let change = |limb: &mut Limb| {
            limb.config.max_rate_deg_s = Some(1.0);
            let axis = UnitVec3::assume_unit(limb.axis_at(angle_rad));
            limb.expected.last = Some(Last { axis, sigma_rad: SIGMAS_RAD[1], age_s });
        };
        Limb::after(change, rate::refuse)
    };
    let most = 10f64.to_radians() + 0.02;
    for age_s in [10.0, -10.0] {
        assert_eq!(turned(most - 1e-4, age_s), Ok(()));
        assert_eq!(turned(most + 1e-4, age_s), Err(Verdict::Rate));
    }
}

#[test]
fn at_night_and_on_the_dark_side_there_is_no_limb() {
    let at = |elevation_rad: f64, max_unlit: f64| {
        let change = |limb: &mut Limb| {
            limb.config.max_unlit = max_unlit;
            limb.expected.sun_elevation_rad = Some(elevation_rad);
        };
        Limb::after(change, night::refuse)
    };
    assert_eq!((at(-0.9, 0.5), at(-0.5, 0.5), at(-0.9, 1.0)), (Err(Verdict::Night), Ok(()), Ok(())));
    // One point of the limb counts. Its surface normal is n, and t is a tangent of the surface.
    let sun = |elevation_deg: f64| {
        let change = |limb: &mut Limb| {
            let place = limb.blocks.len() / 2;
            for (i, block) in limb.blocks.iter_mut().enumerate() {
                (0..LANES).for_each(|lane| block.weight[lane] = f64::from(i == place && lane == 0));
            }
            let (s, c) = (limb.blocks[place].ray(0), limb.fused.c);
            let n = (s * c - limb.fused.e) / (1.0 - c * c).sqrt();
            let t = s.cross(&n).normalize();
            let (sin, cos) = libm::sincos(elevation_deg.to_radians());
            limb.expected.sun_seen = Some(n * sin + t * cos);
        };
        Limb::after(change, sun::refuse)
    };
    assert_eq!((sun(LOWEST_SUN_DEG + 1.0), sun(LOWEST_SUN_DEG - 1.0)), (Ok(()), Err(Verdict::Sun)));
}

#[test]
fn a_planet_hides_the_sun_behind_it() {
    let hidden = |free: bool, cos: f64| {
        let change = |limb: &mut Limb| {
            limb.expected.free = free;
            limb.taken.push(FoundLimb::circular(limb.axis_at(0.5), cos));
        };
        Limb::after(change, hidden::refuse)
    };
    let beyond = libm::cos(0.4);
    let before = libm::cos(0.6);
    assert_eq!((hidden(true, before), hidden(true, beyond)), (Err(Verdict::NoSky), Ok(())));
    assert_eq!(hidden(false, before), Ok(()));
}

#[test]
fn the_evidence_must_be_strong_enough() {
    let mut evidence = Evidence::<f64>::new();
    evidence.set(Term::Gaps, 1.0);
    let p = evidence.p_limb(50.0);
    let asked = |least: f64| {
        let mut limb = Limb::exact();
        limb.config.min_p_limb = least;
        unlikely::refuse(&limb.case(), Some(&evidence))
    };
    assert_eq!((asked(p), asked(p + 1e-6)), (Ok(Some(p)), Err(Verdict::Unlikely)));
}

#[test]
fn half_of_the_limb_has_twice_the_score() {
    let (mut limb, mut half) = (Limb::exact(), Limb::exact());
    (limb.fit.rms_px, half.fit.rms_px) = (0.5, 0.5);
    (limb.cover.share, half.cover.share) = (0.8, 0.4);
    assert!((score(&half.case()) / score(&limb.case()) - 2.0).abs() < 1e-12);
}

#[test]
fn a_sun_has_its_size_and_a_little_bloom() {
    let camera = Limb::exact().camera;
    let config = body::Config { kind: body::Kind::Sun, ..body::Config::default() };
    let sun = Expected::<f64>::new(&config, &Prior::default()).unwrap();
    let fits = |times: f64| size::is_possible_size(&libm::cos(libm::asin(sun.sin * times)), &sun, &camera);
    assert!(fits(1.0) && fits(11.0));
    assert!(!fits(0.3) && !fits(13.0));
}

/// Edges that are no limb: the straight edge that is next to the limb, and a circle of the image.
#[test]
fn rival_shapes_are_refused_until_every_shape_is_trusted() {
    let judge = |limb: &Limb| {
        let curve = Curve::new(&limb.fit, limb.expected.azimuth());
        let mut shape = Shape::new();
        collect_inliers(&limb.blocks, &limb.fit, &curve, &limb.camera, &mut shape);
        rivals::refuse(&limb.case(), &mut Residuals::new(&curve, &mut shape, &limb.config))
    };
    assert_eq!(judge(&Limb::exact()), Ok(()));
    let mut straight = Limb::new(|point| ImagePoint { u: point.u, v: 239.5 + 0.02 * (point.u - 320.0) });
    assert_eq!(judge(&straight), Err(Verdict::Straight));
    straight.config.trust_every_shape();
    assert_eq!(judge(&straight), Ok(()));
}

#[cfg(feature = "horace")]
#[test]
fn the_altitude_of_a_circle_is_within_its_limits() {
    let limits = |km: [f64; 2]| {
        let change = |limb: &mut Limb| (limb.config.altitude_limits_km, limb.config.radius_margin) = (Some(km), 0.0);
        Limb::after(change, radius::refuse)
    };
    assert_eq!(limits([390.0, 410.0]), Ok(()));
    assert_eq!((limits([100.0, 390.0]), limits([410.0, 800.0])), (Err(Verdict::Radius), Err(Verdict::Radius)));
}

#[cfg(feature = "dlr")]
#[test]
fn the_expected_limb_is_in_the_picture_and_on_its_section() {
    // The camera sees 23° below its middle, where the limb is.
    let turned = |angle_deg: f64| {
        let change = |limb: &mut Limb| {
            limb.config.limb_in_view = true;
            let (sin, cos) = libm::sincos(limb.expected.half_angle_rad() + angle_deg.to_radians());
            limb.fit.e = V3::new(0.0, sin, cos);
        };
        Limb::after(change, out_of_view::refuse)
    };
    assert_eq!((turned(20.0), turned(40.0)), (Ok(()), Err(Verdict::OutOfView)));
    // Points without a weight do not count.
    let section = |weight: f64| {
        let change = |limb: &mut Limb| {
            limb.config.max_section_residual = Some(1e-6);
            limb.blocks[0].s[1][0] += 0.1;
            limb.blocks[0].weight[0] = weight;
        };
        Limb::after(change, section::refuse)
    };
    assert_eq!((section(0.0), section(1.0)), (Ok(()), Err(Verdict::Residuals)));
    // The same residual is the score of an edge with this choice.
    let mut limb = Limb::exact();
    limb.config.choice = Choice::SectionResidual;
    limb.blocks[0].s[1][0] += 0.1;
    assert_eq!(Some(score(&limb.case())), section::residual(&limb.case()).filter(|residual| *residual > 1e-6));
}
