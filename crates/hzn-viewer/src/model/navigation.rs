//! Results of `hzn fuse` over time: the attitude with its sigmas, and the innovations.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use hzn_fuse::read_back::{Solution, State};
use hzn_fuse::sink::Phase;

/// Name of the plot of innovations.
pub const INNOVATIONS: &str = "Nav: innovations";

/// Sources of innovations that are no cameras.
const OTHER_SOURCES: [&str; 2] = ["gnss", "star-tracker"];

/// Largest difference between a measurement and its picture, as a part of the time between two pictures. Of times that
/// have nothing to do with each other, a fifth is this close.
const SAME_TIME: f64 = 0.1;
/// The difference that two files of one flight may have by rounding, s.
const LEAST_ROOM_S: f64 = 1e-3;

/// Function that returns a value of a solution.
pub type StateValue = fn(&State) -> Option<f64>;

/// A quantity of the solutions that can be plotted over time.
#[derive(Debug, Clone, Copy)]
pub struct NavQuantity {
    /// Name of the quantity.
    pub name: &'static str,
    /// Unit of the quantity.
    pub unit: &'static str,
    /// Lines of the plot: the name and the value of each.
    pub lines: &'static [(&'static str, StateValue)],
}

/// All quantities of the solutions that can be plotted.
pub const NAV_QUANTITIES: &[NavQuantity] = &[
    NavQuantity {
        name: "Nav: attitude",
        unit: "°",
        lines: &[("yaw", |s| Some(s.yaw_deg)), ("pitch", |s| Some(s.pitch_deg)), ("roll", |s| Some(s.roll_deg))],
    },
    NavQuantity {
        name: "Nav: attitude 3σ",
        unit: "°",
        lines: &[
            ("x", |s| Some(3.0 * s.sigma_x_deg?)),
            ("y", |s| Some(3.0 * s.sigma_y_deg?)),
            ("z", |s| Some(3.0 * s.sigma_z_deg?)),
        ],
    },
    NavQuantity {
        name: "Nav: position 3σ",
        unit: "m",
        lines: &[("largest component", |s| Some(3.0 * s.position_sigma_m?))],
    },
    NavQuantity {
        name: "Nav: limb height error",
        unit: "km",
        lines: &[("error", |s| s.limb_height_km), ("3σ", |s| Some(3.0 * s.limb_height_sigma_km?))],
    },
];

/// A component of an innovation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Time, s.
    pub time_s: f64,
    /// The component over its 1-sigma.
    pub sigmas: f64,
    /// Whether the filter took the measurement.
    pub taken: bool,
}

/// The innovations of one source and kind.
#[derive(Debug, Clone, PartialEq)]
pub struct InnovationSeries {
    /// Source and kind, for example `left limb`.
    pub name: String,
    /// Components in the order of time.
    pub components: Vec<Component>,
}

/// Results of a flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Navigation {
    /// Name of the file.
    pub file: String,
    /// Folder of the file.
    pub folder: PathBuf,
    /// Names of the cameras.
    pub cameras: Vec<String>,
    /// Times at which the filter used a direction of a camera, s.
    camera_times_s: Vec<f64>,
    filter: Vec<State>,
    smoothed: Vec<State>,
    back: Vec<State>,
    /// Innovations by source and kind.
    pub innovations: Vec<InnovationSeries>,
}

impl Navigation {
    /// Sorts results by their origin.
    pub fn new(path: &Path, solution: &Solution) -> Self {
        let of = |phase| {
            let mut all: Vec<State> = solution.states.iter().filter(|s| s.phase == phase).copied().collect();
            all.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
            all
        };
        let mut innovations: Vec<InnovationSeries> = Vec::new();
        for i in &solution.innovations {
            let name = format!("{} {}", i.source, i.kind);
            let components = i.sigmas().map(|sigmas| Component { time_s: i.time_s, sigmas, taken: i.taken });
            match innovations.iter_mut().find(|s| s.name == name) {
                Some(series) => series.components.extend(components),
                None => innovations.push(InnovationSeries { name, components: components.collect() }),
            }
        }
        for series in &mut innovations {
            series.components.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        }
        innovations.sort_by(|a, b| a.name.cmp(&b.name));
        let of_cameras = || solution.innovations.iter().filter(|i| !OTHER_SOURCES.contains(&i.source.as_str()));
        let cameras: BTreeSet<&str> = of_cameras().map(|i| i.source.as_str()).collect();
        Self {
            file: path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
            folder: path.parent().map(Path::to_owned).unwrap_or_default(),
            cameras: cameras.into_iter().map(str::to_owned).collect(),
            camera_times_s: of_cameras().map(|i| i.time_s).collect(),
            filter: of(Phase::Filter),
            smoothed: of(Phase::Smoothed),
            back: of(Phase::Back),
            innovations,
        }
    }

    /// Returns the solutions of one origin in the order of time.
    pub fn states(&self, phase: Phase) -> &[State] {
        match phase {
            Phase::Filter => &self.filter,
            Phase::Smoothed => &self.smoothed,
            Phase::Back => &self.back,
        }
    }

    /// Returns the solution of the filter that is nearest to a time, s.
    pub fn nearest(&self, time_s: f64) -> Option<&State> {
        let after = self.filter.partition_point(|s| s.time_s < time_s);
        let candidates = self.filter.get(after.saturating_sub(1)..(after + 1).min(self.filter.len()))?;
        candidates.iter().min_by(|a, b| (a.time_s - time_s).abs().total_cmp(&(b.time_s - time_s).abs()))
    }

    /// Returns true if the results are of these pictures: a camera has the name `camera`, or the cameras took pictures
    /// when these were taken. Flights of one scene last as long as each other, so that a common span alone says little.
    /// Results without any direction of a camera are of these pictures if they have a time in common.
    pub fn is_of(&self, camera: &str, times_s: &[f64]) -> bool {
        if self.cameras.iter().any(|name| name == camera) {
            return true;
        }
        let mut sorted = times_s.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (Some(first), Some(last), Some([from, to])) = (sorted.first(), sorted.last(), self.span_s()) else {
            return false;
        };
        let step = (last - first) / (sorted.len().max(2) - 1) as f64;
        if self.cameras.is_empty() {
            return from <= last + step && *first <= to + step;
        }
        // Pictures that are far apart must not take the times of a camera that takes many meanwhile.
        let mut own = self.camera_times_s.clone();
        own.sort_by(f64::total_cmp);
        own.dedup();
        let own_step = own.last().zip(own.first()).filter(|_| own.len() > 1);
        let own_step = own_step.map_or(step, |(last, first)| (last - first) / (own.len() - 1) as f64);
        let room = (SAME_TIME * step.min(own_step)).max(LEAST_ROOM_S);
        let during = || self.camera_times_s.iter().filter(|t| (first - room..=last + room).contains(*t));
        let is_at_a_picture = |t: &&f64| {
            let after = sorted.partition_point(|x| x < *t);
            let near = &sorted[after.saturating_sub(1)..(after + 1).min(sorted.len())];
            near.iter().any(|x| (x - **t).abs() <= room)
        };
        let at_pictures = during().filter(is_at_a_picture).count();
        at_pictures > 0 && 2 * at_pictures > during().count()
    }

    /// Returns the first and the last time of all solutions, s.
    pub fn span_s(&self) -> Option<[f64; 2]> {
        let all = [&self.filter, &self.smoothed, &self.back];
        let first = all.iter().filter_map(|s| s.first()).map(|s| s.time_s).reduce(f64::min)?;
        let last = all.iter().filter_map(|s| s.last()).map(|s| s.time_s).reduce(f64::max)?;
        Some([first, last])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a solution of some seconds: half a degree of 1-sigma, and one refused direction of the camera `left`.
    fn solution(times: &[f64]) -> Solution {
        let state = |phase: &str, t: &f64| {
            serde_json::from_value(serde_json::json!({
                "time_s": t, "phase": phase, "yaw_deg": 10.0 * t, "pitch_deg": 1.0, "roll_deg": -1.0,
                "sigma_x_deg": 0.5, "sigma_y_deg": 0.5, "sigma_z_deg": 0.5, "position_sigma_m": null,
                "limb_height_km": 1.0, "limb_height_sigma_km": 2.0,
            }))
            .unwrap()
        };
        let innovation = |(n, t): (usize, &f64)| {
            serde_json::from_value(serde_json::json!({
                "time_s": t, "source": "left", "kind": "limb", "first": 0.2, "second": 0.1, "third": null,
                "first_sigma": 0.1, "second_sigma": null, "third_sigma": null, "unit": "deg", "nis": 1.0,
                "taken": n > 0,
            }))
            .unwrap()
        };
        Solution {
            states: times.iter().rev().map(|t| state("filter", t)).chain([state("smoothed", &times[0])]).collect(),
            innovations: times.iter().enumerate().map(innovation).collect(),
        }
    }

    #[test]
    fn results_are_sorted_by_origin_and_time() {
        let nav = Navigation::new(Path::new("a/nav.mcap"), &solution(&[1.0, 2.0, 4.0]));
        let times = |phase| nav.states(phase).iter().map(|s| s.time_s).collect::<Vec<_>>();
        assert_eq!((times(Phase::Filter), times(Phase::Smoothed)), (vec![1.0, 2.0, 4.0], vec![1.0]));
        assert_eq!((nav.file.as_str(), nav.span_s()), ("nav.mcap", Some([1.0, 4.0])));
        let at = |t| nav.nearest(t).map(|s| s.time_s);
        assert_eq!([at(-9.0), at(1.4), at(3.5), at(99.0)], [1.0, 1.0, 4.0, 4.0].map(Some));
        let series = &nav.innovations[0];
        assert_eq!((series.name.as_str(), series.components.len()), ("left limb", 3), "a component needs a sigma");
        assert_eq!(series.components[0], Component { time_s: 1.0, sigmas: 2.0, taken: false });
        let empty = Navigation::default();
        assert!(empty.nearest(1.0).is_none() && empty.span_s().is_none());
    }

    #[test]
    fn results_belong_to_pictures_of_their_times_or_name() {
        let nav = Navigation::new(Path::new("a/nav.mcap"), &solution(&[60.0, 70.0, 80.0, 90.0]));
        assert_eq!((nav.cameras.as_slice(), nav.folder.as_path()), (&["left".to_owned()][..], Path::new("a")));
        assert!(nav.is_of("flight", &[60.5, 70.0, 80.0, 90.0]) && nav.is_of("left", &[7.0]));
        // The ends are the same, and the pictures between them are others.
        assert!(!nav.is_of("flight", &[60.0, 67.5, 75.0, 82.5, 90.0]));
        // The cameras took several pictures about the time of the first of these.
        assert!(!nav.is_of("flight", &[60.0, 5060.0, 10060.0]));
        assert!(!nav.is_of("flight", &[560.0, 570.0]) && !nav.is_of("flight", &[]));
        let without = Navigation::new(Path::new("nav.csv"), &Solution { innovations: Vec::new(), ..solution(&[5.0]) });
        assert!(without.is_of("flight", &[4.0, 6.0]) && !without.is_of("flight", &[40.0, 41.0]));
    }

    #[test]
    fn names_differ_from_those_of_the_results_of_pictures() {
        let mut names: Vec<&str> = NAV_QUANTITIES.iter().map(|q| q.name).chain([INNOVATIONS]).collect();
        names.extend(crate::model::quantity::QUANTITIES.iter().map(|q| q.name));
        let distinct: std::collections::HashSet<_> = names.iter().collect();
        assert_eq!(distinct.len(), names.len());
    }
}
