//! A calibration from the sky in words and numbers.

use hzn_core::camera::Intrinsic;

use super::check::{Check, Deviation, Verdict};
use super::estimate::{Estimate, MIN_PICTURES};
use super::mount::{Mount, MountRefusal};
use super::observable::Observability;
use super::parameters::Determined;
use super::track::Track;
use crate::words::above;

/// A mount, or why there is none.
type MountResult = Result<Mount, MountRefusal>;

/// Returns the lines of a report on an estimate: name and value. `pictures` is the number of all pictures in words.
pub fn lines(estimate: &Estimate, pictures: &str, mount: Option<&MountResult>) -> Vec<(String, String)> {
    let outliers: Vec<&str> = estimate.pictures.iter().filter(|p| !p.counts).map(|p| p.name.as_str()).collect();
    let left_out = match outliers.as_slice() {
        [] => String::new(),
        several => format!(", {} outliers left out: {}", several.len(), several.join(", ")),
    };
    let answered = estimate.pictures.len();
    let mut lines = Lines::default();
    lines.add("pictures", format!("{pictures}, {answered} with a limb{left_out}"));
    let [percent, sigma] = estimate.focal_percent;
    lines.add(
        "focal length",
        format!(
            "{percent:+.3} % ± {sigma:.3} % against sensor.toml{}",
            focal_px(&estimate.parameters, estimate.focal_percent)
        ),
    );
    add_parameters(&mut lines, &estimate.parameters);
    add_limb(&mut lines, estimate);
    add_observability(&mut lines, &estimate.observability);
    if let Some(mount) = mount {
        add_mount(&mut lines, mount);
    }
    lines.0
}

/// Returns the focal length in pixels with its sigma.
fn focal_px(parameters: &[Determined], [percent, sigma]: [f64; 2]) -> String {
    let before = parameters.iter().find(|p| p.which == Intrinsic::FxPx).map(|p| p.before);
    before.map_or_else(String::new, |fx| {
        let sigma_px = 0.01 * sigma * fx;
        let fx_px = fx * (1.0 + 0.01 * percent);
        format!(", fx = {} px ± {} px", number(fx_px, sigma_px), number(sigma_px, sigma_px))
    })
}

/// Lines of a report.
#[derive(Default)]
struct Lines(Vec<(String, String)>);

impl Lines {
    fn add(&mut self, name: &str, value: String) {
        self.0.push((name.to_owned(), value));
    }
}

/// Adds a line for each parameter.
fn add_parameters(lines: &mut Lines, parameters: &[Determined]) {
    for p in parameters {
        let by = if p.stated { "stated" } else { "assumed" };
        let what = if p.determined {
            format!(
                "{} ± {} (before {} ± {}, {by}); 1 sigma moves the corner by {:.2} px",
                number(p.value, p.sigma),
                number(p.sigma, p.sigma),
                number(p.before, p.sigma),
                number(p.sigma_before, p.sigma_before),
                p.corner_px
            )
        } else {
            format!(
                "not determined: ± {} after the flight, ± {} before ({by}); it keeps {}",
                number(p.sigma, p.sigma),
                number(p.sigma_before, p.sigma_before),
                number(p.before, p.sigma)
            )
        };
        lines.add(p.which.name(), what);
    }
}

/// Returns the lines of the report on a track.
pub fn track_lines(track: &Track, pictures: &str) -> Vec<(String, String)> {
    let mut lines = Lines::default();
    let left_out = match track.left_out.as_slice() {
        [] => String::new(),
        several => format!(", {} outliers left out: {}", several.len(), several.join(", ")),
    };
    lines.add("pictures", format!("{pictures}, {} discs with a direction{left_out}", track.pictures));
    let [percent, sigma] = track.focal_percent;
    let px = focal_px(&track.parameters, track.focal_percent);
    lines.add("focal length", format!("{percent:+.3} % ± {sigma:.3} % against sensor.toml{px}"));
    add_parameters(&mut lines, &track.parameters);
    lines.add("discs", format!("± {:.3} px for each coordinate of a centre", track.sigma_px));
    let [[x, sx], [y, sy], [z, sz]] = track.correction_deg;
    lines.add(
        "mount",
        format!("rotated by ({x:+.3}, {y:+.3}, {z:+.3})° ± ({sx:.3}, {sy:.3}, {sz:.3})° in the camera frame"),
    );
    lines.0
}

fn add_limb(lines: &mut Lines, estimate: &Estimate) {
    let [km, sigma] = estimate.height_km;
    let before = estimate.limb_before;
    let known = if before.sigma_km.is_finite() {
        format!("{:.2} km ± {:.2} km before, with the error of the altitude", before.km, before.sigma_km)
    } else {
        "free".to_owned()
    };
    lines.add("limb height", format!("{km:.2} km ± {sigma:.2} km ({known})"));
    lines.add(
        "",
        match estimate.scatter_km {
            Some(km) => format!("{km:.2} km of scatter between pictures beyond edge noise"),
            None => "too few pictures to measure the scatter between them; the sigma of the limb height stands for it"
                .to_owned(),
        },
    );
    let [before_px, after_px] = estimate.shift_sigma_px;
    lines
        .add("common shift", format!("of all edges: ± {before_px:.2} px assumed, ± {after_px:.2} px after the flight"));
    if let Some(chi2) = estimate.chi2 {
        let [chi2, limit] = above(chi2, estimate.max_chi2);
        lines.add("chi-square", format!("{chi2} a degree of freedom; 1 is ideal, a value above {limit} is an alarm"));
    }
    let c = &estimate.conflict;
    let [chi2, limit] = above(c.chi2, c.max_chi2);
    lines.add(
        "priors",
        format!(
            "focal length {:+.1} and limb height {:+.1} of their sigmas before the flight; the sum of the squares is \
             {chi2}, and a value above {limit} is an alarm",
            c.focal_sigmas, c.height_sigmas
        ),
    );
}

fn add_observability(lines: &mut Lines, o: &Observability) {
    lines.add("observability", format!("focal length ± {:.3} % if the limb height is known", o.known_limb_percent));
    lines.add(
        "",
        format!(
            "focal length ± {:.3} % and limb height ± {:.2} km if both are free; their correlation is {:+.2}",
            o.free_limb_percent, o.free_limb_km, o.correlation
        ),
    );
    lines.add("", format!("1 km of limb height looks like {:+.3} % of focal length", o.percent_per_km));
}

fn add_mount(lines: &mut Lines, mount: &MountResult) {
    match mount {
        Ok(m) => {
            let [x, y, z] = m.correction_deg;
            let [sx, sy, sz] = m.sigma_deg;
            lines.add(
                "mount",
                format!("rotated by ({x:+.3}, {y:+.3}, {z:+.3})° ± ({sx:.3}, {sy:.3}, {sz:.3})° in the camera frame"),
            );
            lines.add("", format!("{} pictures, {:.3}° RMS after the correction", m.pictures, m.residual_deg));
        }
        Err(why) => lines.add("mount", why.to_string()),
    }
}

/// Returns the lines of a report on a check. The first one is the verdict. `pictures` is the number of all pictures in
/// words.
pub fn check_lines(check: &Check, pictures: &str) -> Vec<(String, String)> {
    let mut lines = Lines::default();
    let focal = &check.focal;
    let verdict = check.verdict.name();
    lines.add(
        "verdict",
        match check.verdict {
            Verdict::Holds => format!(
                "{verdict}: no difference is significant, and {:.2} % of focal length would have been found",
                check.detect_percent
            ),
            Verdict::DoesNotHold => format!("{verdict}: {}", significant(check)),
            Verdict::CannotTell => format!(
                "{verdict}: no difference is significant, but only an error of {} of the focal length would have been \
                 found; {}",
                detectable(focal),
                remedy(check)
            ),
        },
    );
    lines.add("focal length", format!("{}; an error is found from {} on", describe(focal, "%"), detectable(focal)));
    for (name, deviation) in ["cx_px", "cy_px"].into_iter().zip(&check.centre_px) {
        lines.add(name, describe(deviation, "px"));
    }
    if let Some(chi2) = check.chi2 {
        let [chi2, limit] = above(chi2, check.max_chi2);
        lines.add(
            "chi-square",
            format!("{chi2} a degree of freedom; 1 is ideal; above {limit} the pictures contradict each other"),
        );
    }
    let [counted_pictures, left_out] = check.pictures;
    lines.add("pictures", format!("{pictures}, {counted_pictures} count, {left_out} outliers left out"));
    let [km, sigma] = check.height_km;
    lines.add("limb height", format!("{km:.2} km ± {sigma:.2} km after the flight"));
    add_observability(&mut lines, &check.observability);
    lines.0
}

fn describe(d: &Deviation, unit: &str) -> String {
    format!(
        "{:+.3} {unit} ± {:.3} {unit} (calibration ± {:.3} {unit}): {:.1} sigmas, p = {:.2e}",
        d.value,
        d.sigma,
        d.calibration_sigma,
        d.sigmas.abs(),
        d.p_value
    )
}

/// Returns the smallest error of the focal length that is found with a probability of 95 %.
fn detectable(focal: &Deviation) -> String {
    if focal.detectable < 100.0 { format!("{:.2} %", focal.detectable) } else { "100 %".to_owned() }
}

/// Names the most significant difference, or the contradiction between the pictures.
fn significant(check: &Check) -> String {
    let [u, v] = &check.centre_px;
    let differs = [&check.focal, u, v].iter().any(|d| d.is_significant());
    if let Some(chi2) = check.contradiction().filter(|_| !differs) {
        let [chi2, limit] = above(chi2, check.max_chi2);
        return format!(
            "the pictures contradict each other: chi-square is {chi2} per degree of freedom, but at most {limit} is \
             consistent, so that no lens explains all of them. Possible reasons: a lens that focuses or zooms, a \
             rolling shutter (camera.readout_s and rates), altitudes or times of other pictures"
        );
    }
    let each = [("the focal length", "%", &check.focal), ("cx_px", "px", u), ("cy_px", "px", v)];
    let strongest = each.into_iter().max_by(|a, b| a.2.sigmas.abs().total_cmp(&b.2.sigmas.abs()));
    strongest.map_or_else(String::new, |(name, unit, d)| {
        let how = if d.value > 0.0 { "larger" } else { "smaller" };
        format!(
            "{name} is {how} in flight by {:.3} {unit} ± {:.3} {unit} ({:.1} sigmas, p = {:.1e})",
            d.value.abs(),
            d.sigma,
            d.sigmas.abs(),
            d.p_value
        )
    })
}

/// Says what would help a flight that cannot tell.
fn remedy(check: &Check) -> String {
    let (focal, o) = (&check.focal, &check.observability);
    let [counted, _] = check.pictures;
    if counted < MIN_PICTURES {
        return format!(
            "the number of pictures that count is {counted}, and their scatter needs at least {MIN_PICTURES}"
        );
    }
    let needed = check.detect_percent * focal.sigma / focal.detectable;
    let what = if focal.calibration_sigma > needed {
        "the calibration itself is not better known (focal_sigma_percent, covariance)".to_owned()
    } else if o.known_limb_percent < needed {
        let km = (needed * needed - o.known_limb_percent.powi(2)).sqrt() / o.percent_per_km.abs().max(1e-12);
        format!(
            "state limb height and altitude together to ± {km:.1} km (limb_height_sigma_km and altitude_sigma_km of \
             [body]), or use a wider range of altitudes and directions"
        )
    } else {
        "use more pictures, or pictures with a longer limb".to_owned()
    };
    format!("the sigma is {:.3} %, and {needed:.3} % is needed: {what}", focal.sigma)
}

/// Formats a value with two digits of its sigma.
fn number(value: f64, sigma: f64) -> String {
    let decimals = if sigma > 0.0 { (1 - sigma.log10().floor() as i32).clamp(0, 12) as usize } else { 3 };
    format!("{value:.decimals$}")
}
