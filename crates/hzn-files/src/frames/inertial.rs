//! Finds positions that are relative to inertial axes instead of the Earth's.
//!
//! A vehicle in free fall has the acceleration of gravity only in axes that do not turn. In the axes of the Earth that
//! of Coriolis and the centrifugal one come to it, about 1 m/s² in low orbit.

use super::check::median;
use super::data::Frames;
use crate::Problem;

/// Gravitational parameter of the Earth, km³/s².
const MU_KM3_S2: f64 = 398_600.44;
/// Rate of the Earth, rad/s.
const RATE_RAD_S: f64 = 7.292_115e-5;
/// Time between the outer of three positions, s: longer ones bend, and shorter ones move the difference of the
/// accelerations less than a receiver errs.
const SPAN_S: std::ops::RangeInclusive<f64> = 15.0..=240.0;
/// Fewest triples of positions.
const FEWEST: usize = 3;
/// What the positions leave of the acceleration in inertial axes, relative to that in the Earth's axes.
const RATIO: f64 = 0.2;
/// Smallest acceleration that the Earth's axes must leave, m/s². Drag and the harmonics of gravity are below 0.03 m/s²
/// above 150 km.
const LEAST_M_S2: f64 = 0.2;
/// Most places that are looked at.
const MOST: usize = 200;
/// Radius of the equator, km.
const EARTH_KM: f64 = 6378.0;
/// Lowest altitude with free fall, km.
const LOWEST_KM: f64 = 120.0;

type Vector = [f64; 3];

fn sum(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|i| a[i] + b[i])
}

fn scaled(a: Vector, by: f64) -> Vector {
    a.map(|x| x * by)
}

fn norm(a: Vector) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A position, km, at a time, s.
type Known = (f64, Vector);

/// Returns the accelerations, m/s², that three positions leave in axes that do not turn and in those of the Earth.
fn left_m_s2((first_s, first): Known, (middle_s, middle): Known, (last_s, last): Known) -> [f64; 2] {
    let [before_s, after_s] = [middle_s - first_s, last_s - middle_s];
    let difference = |a: Vector, b: Vector, dt_s: f64| scaled(sum(b, scaled(a, -1.0)), 1.0 / dt_s);
    let [before, after] = [difference(first, middle, before_s), difference(middle, last, after_s)];
    let span_s = before_s + after_s;
    let acceleration = scaled(sum(after, scaled(before, -1.0)), 2.0 / span_s);
    // The velocity at the middle, from both differences.
    let [vx, vy, _] = scaled(sum(scaled(before, after_s), scaled(after, before_s)), 1.0 / span_s);
    let [x, y, _] = middle;
    let gravity = scaled(middle, -MU_KM3_S2 / norm(middle).powi(3));
    // Minus 2 w x v and w x (w x r), with w along z.
    let by_turn =
        [2.0 * RATE_RAD_S * vy + RATE_RAD_S.powi(2) * x, -2.0 * RATE_RAD_S * vx + RATE_RAD_S.powi(2) * y, 0.0];
    let inertial = sum(acceleration, scaled(gravity, -1.0));
    [norm(inertial) * 1e3, norm(sum(inertial, scaled(by_turn, -1.0))) * 1e3]
}

impl Frames {
    /// Returns one warning if the positions move as in axes that do not turn with the Earth.
    pub(super) fn suspect_inertial_positions(&self) -> Option<Problem> {
        let known: Vec<Known> = self.rows.iter().filter_map(|r| Some((r.time_s?, r.position_km?))).collect();
        let triple = |i: usize| {
            let first = *known.get(i)?;
            // The widest pair from this position on that is not too wide, with a position near its middle.
            let later = known.get(i + 1..)?.iter().take_while(|(t, _)| t - first.0 <= *SPAN_S.end());
            let last = *later.last().filter(|(t, _)| SPAN_S.contains(&(t - first.0)))?;
            let away = |(t, _): &Known| (t - 0.5 * (first.0 + last.0)).abs();
            let between = known.get(i + 1..)?.iter().take_while(|(t, _)| *t < last.0);
            let middle = between.min_by(|a, b| away(a).total_cmp(&away(b)))?;
            (away(middle) < 0.25 * (last.0 - first.0)).then(|| left_m_s2(first, *middle, last))
        };
        // Some places tell as much as all, and a long table would take long.
        let step = known.len().div_ceil(MOST).max(1);
        let both: Vec<[f64; 2]> = (0..known.len()).step_by(step).filter_map(triple).collect();
        let is_low = known.iter().any(|(_, p)| norm(*p) < EARTH_KM + LOWEST_KM);
        if is_low || both.len() < FEWEST {
            return None;
        }
        let [inertial, fixed] = [0, 1].map(|i| median(both.iter().filter_map(|pair| pair.get(i).copied()).collect()));
        if fixed < LEAST_M_S2 || inertial > RATIO * fixed {
            return None;
        }
        let row = self.rows.iter().find(|row| row.position_km.is_some())?;
        let what = "x_km, y_km, z_km move as in axes that do not turn with the Earth (ECI): ECEF (WGS-84) is expected. \
                    The columns axis_e_x, axis_e_y, axis_e_z of the answers, day and night, and all that depends on \
                    the place are wrong with them";
        Some(self.problem(row, what))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::frames::parse;

    /// Returns what is said of an orbit with positions in axes that turn by a part of the Earth's rate.
    fn said(turns: f64, step_s: f64, altitude_km: f64, noise_km: f64) -> Option<String> {
        let radius_km = EARTH_KM + altitude_km;
        let rate = (MU_KM3_S2 / radius_km.powi(3)).sqrt();
        let row = |i: u32| {
            let t = step_s * f64::from(i);
            let (sin, cos) = (rate * t).sin_cos();
            let (tilt_sin, tilt_cos) = 0.9f64.sin_cos();
            let inertial = [cos, sin * tilt_cos, sin * tilt_sin];
            let (turn_sin, turn_cos) = (1.1 - turns * RATE_RAD_S * t).sin_cos();
            let [x, y, z] = scaled(inertial, radius_km);
            let shaken = scaled([(7.0 * t).sin(), (11.0 * t).cos(), (13.0 * t).sin()], noise_km);
            let [x, y, z] = sum([turn_cos * x - turn_sin * y, turn_sin * x + turn_cos * y, z], shaken);
            format!("{i}.png,{t},{x},{y},{z}\n")
        };
        let text = "file,time_s,x_km,y_km,z_km\n".to_owned() + &(0..60).map(row).collect::<String>();
        parse(&text, Path::new("frames.csv")).unwrap().suspect_inertial_positions().map(|w| w.to_string())
    }

    #[test]
    fn positions_in_inertial_axes_are_told() {
        for (step_s, altitude_km) in [(0.6, 400.0), (5.0, 400.0), (10.0, 880.0), (60.0, 1500.0)] {
            assert_eq!(said(1.0, step_s, altitude_km, 0.005), None, "{step_s} {altitude_km}");
            let told = said(0.0, step_s, altitude_km, 0.005).unwrap_or_default();
            assert!(told.starts_with("frames.csv:2: 0.png: x_km, y_km, z_km move as in axes"), "{told}");
        }
        // Positions that err by kilometres do not tell it, and single pictures neither.
        assert_eq!(said(0.0, 0.6, 400.0, 2.0), None);
        assert_eq!(said(0.0, 300.0, 400.0, 0.0), None);
        assert_eq!(said(1.0, 0.6, 400.0, 2.0), None);
    }
}
