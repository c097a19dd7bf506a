//! The stages seen one by one: by an observer, and called apart, as to replace one of them.

use std::cell::RefCell;

use crate::decisions::{Half, config, draw};
use hzn_core::image::{Grey, Layout};
use hzn_core::{HostHorizon, Observer, Prior};
#[cfg(feature = "_edges")]
use hzn_core::{Sensor, frames::UnitVec3, pipeline::edges::Edges};

/// Keeps candidate, place and weight of each point.
#[derive(Default)]
struct Weights(RefCell<Vec<(u32, u32, f64)>>);

impl Observer<f64> for Weights {
    fn weight(&self, candidate: u32, point: u32, weight: f64) {
        self.0.borrow_mut().push((candidate, point, weight));
    }
}

#[test]
fn an_observer_sees_the_weight_of_every_point() {
    let data = draw(&[Half { centre_px: [300.3, 180.2], wave_px: 0.0 }]);
    let picture = Grey::try_new(&data[..], Layout::packed(640, 360, 1, 8)).unwrap();
    let mut horizon = HostHorizon::boxed(&config()).unwrap();
    let (expected, weights) = (horizon.expect(&Prior::default()).unwrap(), Weights::default());
    let report = horizon.process_observed(&picture, &expected, &weights);
    let answer = report.solution.unwrap();
    let edge = report.candidates.iter().find(|edge| edge.number == answer.candidate).unwrap();
    let seen: Vec<_> = weights.0.into_inner().into_iter().filter(|one| one.0 == answer.candidate).collect();
    assert!(seen.iter().map(|one| one.1).eq(0..edge.points));
    assert_eq!(seen.iter().filter(|one| one.2 > 0.0).count(), answer.inliers as usize);
    assert!(edge.inliers < edge.points);
}

#[cfg(feature = "_edges")]
#[test]
fn the_stages_one_by_one_give_the_answer_of_the_pipeline() {
    let config = config();
    let data = draw(&[Half { centre_px: [300.3, 180.2], wave_px: 0.3 }]);
    let picture = Grey::try_new(&data[..], Layout::packed(640, 360, 1, 8)).unwrap();
    let mut horizon = HostHorizon::boxed(&config).unwrap();
    let expected = horizon.expect(&Prior::default()).unwrap();
    let report = horizon.process(&picture, &expected);
    let answer = report.solution.unwrap();

    let sensor = Sensor::<f64>::new(&config).unwrap();
    let level = sensor.level(&picture, &expected).unwrap().level;
    let borders = sensor.borders(&picture, level, &expected);
    assert_eq!(borders.len(), 1);
    let mut edges = Edges::pick(&sensor, &picture, level, &borders[0]);
    assert_eq!(edges.points().len(), report.counters.edge_points as usize);
    let cone = edges.consensus(&expected, &config.consensus).unwrap();
    let fit = edges.fit(&sensor, &cone, &expected).unwrap();
    let fused = edges.fuse(&sensor, &fit, &expected).unwrap();

    assert_eq!((fit.inliers(), fit.rms_px()), (answer.inliers, answer.rms_px));
    assert_eq!(fused.axis.xyz(), answer.axis.xyz());
    assert_eq!(fused.covariance.rows(), answer.covariance.rows());
    // Each point is where its ray points.
    for ((point, _), ray) in edges.points().zip(edges.rays()) {
        let again = sensor.camera().project(&UnitVec3::try_new(ray).unwrap()).unwrap();
        assert!((again.u - point.u).abs() < 1e-9 && (again.v - point.v).abs() < 1e-9);
    }
}
