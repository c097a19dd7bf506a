//! Charts: which conic is visible from which altitude, and the error of treating the Earth as a sphere.

use hzn_plot::{Chart, Series, Style};
use hzn_sim::sensitivity::chart::{Vertical, Visibility};

use super::args::Args;
use super::body::{Body, doubt_altitudes};
use super::study::Study;
use super::table::Table;
use crate::exit::{Stop, usage};

/// Computes fields of view by altitude (Braun & Barf 2022, figures 6 and 7).
pub(super) fn visibility(args: &Args) -> Result<Study, Stop> {
    let body = match args.bodies()?.as_slice() {
        [one] => *one,
        _ => return Err(usage("--body: give one body for this chart")),
    };
    let altitudes =
        args.altitude.as_ref().map_or_else(|| (1..=60).map(|i| 50.0 * f64::from(i)).collect(), |v| v.0.clone());
    doubt_altitudes(&[body], &altitudes);
    let limb_height_km = match args.limb_height.as_ref().map(|v| v.0.as_slice()) {
        None => body.limb_height_km,
        Some([one]) => *one,
        Some(_) => return Err(usage("--limb-height: give one value for this chart")),
    };
    let mut rows = Vec::new();
    for km in altitudes {
        if !(km > limb_height_km) {
            return Err(usage(format!("--altitude: {km} km is not above the limb at {limb_height_km} km")));
        }
        let sin = (body.radius_km + limb_height_km) / (body.radius_km + km);
        rows.push((km, Visibility::new(sin.asin())));
    }
    let mut table = Table::default();
    table.column("altitude_km", "altitude_km", rows.iter().map(|(km, _)| Some(*km)));
    type Pick = fn(&Visibility) -> f64;
    let columns: [(&str, &str, &str, Pick); 4] = [
        ("half_angle_deg", "half-angle", "", |v| v.half_angle_deg),
        ("ellipse_from_deg", "ellipse from", "arc of an ellipse", |v| v.ellipse_deg),
        ("hyperbola_from_deg", "hyperbola from", "arc of a hyperbola", |v| v.hyperbola_deg),
        ("disc_from_deg", "whole disc from", "whole disc", |v| v.disc_deg),
    ];
    let mut chart =
        Chart::new("Field of view from which on a limb can be seen", "altitude [km]", "field of view [deg]");
    for (name, head, label, value) in columns {
        table.column(name, head, rows.iter().map(|(_, v)| Some(value(v))));
        if !label.is_empty() {
            chart = chart.with_series(Series::new(label, Style::Line, rows.iter().map(|(km, v)| (*km, value(v)))));
        }
    }
    let chart = (rows.len() > 1).then_some(chart);
    Ok(Study { table, chart, notes: Vec::new() })
}

/// Computes angles by latitude and altitude (Braun & Barf 2022, figure 8, and the angle that remains with the limb
/// axis).
pub(super) fn spherical_earth(args: &Args) -> Result<Study, Stop> {
    if !args.body.is_empty() {
        return Err(usage("--body: this chart is for the Earth (WGS-84); leave --body out"));
    }
    let earth = args.limb.map(|limb| Body::earth().with_limb(limb)).transpose()?;
    let altitudes = args.altitude.as_ref().map_or_else(|| vec![100.0, 240.0, 600.0, 2000.0], |v| v.0.clone());
    doubt_altitudes(&[Body::earth()], &altitudes);
    let own = earth.map_or(0.0, |body| body.limb_height_km);
    let limb_height_km = args.limb_height.as_ref().map_or(Ok(own), |v| match v.0.as_slice() {
        [one] => Ok(*one),
        _ => Err(usage("--limb-height: give one value for this chart")),
    })?;
    let mut rows = Vec::new();
    for &km in &altitudes {
        for i in 0..=18 {
            let latitude = 5.0 * f64::from(i);
            let refused = || usage(format!("--altitude: {km} km is not above the limb at {limb_height_km} km"));
            rows.push((latitude, km, Vertical::from_position(latitude, km, limb_height_km).ok_or_else(refused)?));
        }
    }
    let mut table = Table::default();
    table.column("altitude_km", "altitude_km", rows.iter().map(|r| Some(r.1)));
    table.column("latitude_deg", "latitude_deg", rows.iter().map(|r| Some(r.0)));
    type Pick = fn(&Vertical) -> f64;
    let columns: [(&str, &str, Pick); 4] = [
        ("geocentric_to_axis_deg", "centre to limb axis", |v| v.geocentric_to_axis_deg),
        ("geocentric_to_geodetic_deg", "centre to vertical", |v| v.geocentric_to_geodetic_deg),
        ("geodetic_to_axis_deg", "vertical to limb axis", |v| v.geodetic_to_axis_deg),
        ("half_angle_spread_deg", "spread of half-angle", |v| v.half_angle_spread_deg),
    ];
    for (name, head, value) in columns {
        table.column(name, head, rows.iter().map(|r| Some(value(&r.2))));
    }
    let title = "Error of treating the Earth as a sphere: centre to limb axis";
    let mut chart = Chart::new(title, "latitude [deg]", "deg");
    for km in altitudes {
        let points = rows.iter().filter(|r| r.1 == km).map(|r| (r.0, r.2.geocentric_to_axis_deg));
        chart = chart.with_series(Series::new(format!("{km} km"), Style::Line, points));
    }
    Ok(Study { table, chart: Some(chart), notes: Vec::new() })
}
