//! A trial that fits a cone of any half-angle to the edges of a picture.

use hzn_core::error::ConfigError;
use hzn_core::image::Pixels;
use hzn_core::verdict::Verdict;
use hzn_core::{Config, consensus, fit};
use hzn_files::FrameData;

use crate::engine::AnySensor;
use crate::engine::trace::{Edge, Traces};

/// A sensor that finds a limb of any half-angle.
pub struct AnyCone {
    sensor: AnySensor,
    /// One body; the sizes of further bodies are known.
    single: bool,
}

impl AnyCone {
    /// Makes the sensor of the trial from that of the pictures.
    ///
    /// # Errors
    /// The first field outside its limits.
    pub fn new(config: &Config, flight: bool) -> Result<Self, ConfigError> {
        let sensor = AnySensor::new(&with_any_cone(config), flight)?;
        Ok(Self { sensor, single: config.each_body().len() == 1 })
    }

    /// Takes another configuration.
    ///
    /// # Errors
    /// The first field outside its limits.
    pub fn reconfigure(&mut self, config: &Config) -> Result<(), ConfigError> {
        self.sensor.reconfigure(&with_any_cone(config))?;
        self.single = config.each_body().len() == 1;
        Ok(())
    }

    /// Returns the longest edge that a cone of any half-angle fits.
    pub fn find<P: Pixels>(&mut self, picture: &P, data: Option<&FrameData>) -> Option<Edge> {
        // A cone of any half-angle goes through many edges; only one that passes every other gate says something.
        longest_fitted(&self.edges(picture, data)?).filter(|e| has_passed(e)).cloned()
    }

    /// Returns the longest edge that a cone of any half-angle fits and that passes every other gate. A longer edge may
    /// be that of a cloud. It is for pictures in which the sensor itself found a limb of another size.
    pub fn find_limb<P: Pixels>(&mut self, picture: &P, data: Option<&FrameData>) -> Option<Edge> {
        let edges = self.edges(picture, data)?;
        let passed = edges.into_iter().filter(|e| has_passed(e) && has_cone(e));
        passed.max_by_key(length_px)
    }

    /// Returns the edges of a picture, each with the cone that fits it.
    fn edges<P: Pixels>(&mut self, picture: &P, data: Option<&FrameData>) -> Option<Vec<Edge>> {
        if !self.single {
            return None;
        }
        let traces = Traces::new(1);
        self.sensor.process_pixels(picture, data, Some(&traces));
        Some(traces.each.first()?.edges().clone())
    }
}

fn has_passed(edge: &Edge) -> bool {
    edge.outcome.is_some_and(|o| o.verdict == Verdict::Passed)
}

fn has_cone(edge: &Edge) -> bool {
    edge.fitted.is_some_and(|f| f.solution.free.is_some())
}

fn length_px(edge: &Edge) -> u32 {
    edge.outcome.map_or(0, |o| o.length_px)
}

/// Returns the configuration of a sensor that fits a cone of any half-angle to each edge.
fn with_any_cone(config: &Config) -> Config {
    let mut config = config.clone();
    config.consensus.method = consensus::Method::Ransac;
    config.fit.half_angle = fit::HalfAngle::Free;
    config.gates.max_half_angle_sigma = 1e6;
    // The first look finds the limb of most pictures. Further looks would cost several times as much.
    config.retry.levels.clear();
    config
}

/// Returns the longest edge with a fit.
fn longest_fitted(edges: &[Edge]) -> Option<&Edge> {
    edges.iter().filter(|e| has_cone(e)).max_by_key(|e| length_px(e))
}

/// Returns the longest edge that the sensor takes for a limb of another size.
pub(super) fn longest_of_other_size(edges: &[Edge]) -> Option<&Edge> {
    let other = |e: &&Edge| e.outcome.is_some_and(|o| o.verdict == Verdict::HalfAngle) && has_cone(e);
    edges.iter().filter(other).max_by_key(|e| length_px(e))
}

/// Returns the longest edge.
pub fn longest_edge(edges: &[Edge]) -> Option<&Edge> {
    edges.iter().max_by_key(|e| length_px(e))
}
