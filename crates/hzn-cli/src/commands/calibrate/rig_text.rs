//! The mounts of a rig in words and numbers.

use hzn_calib::rig::{Adjusted, Check};
use hzn_files::rig::Head;
use hzn_run::explain::counted;

use crate::tell::one_line;

/// Returns the report of an adjustment.
pub(super) fn report(heads: &[Head], adjusted: &Adjusted) -> String {
    lines(heads, adjusted).iter().map(|(name, value)| format!("{name:<14} {}\n", one_line(value))).collect()
}

/// Says whether the told mounts hold. `refused` says what the joint answers of a run have against them.
fn verdict(heads: &[Head], check: &Check, refused: Option<&str>) -> String {
    match check {
        Check::Holds(_) if refused.is_some() => format!(
            "does not hold: {}. No turn of one head is significant, so the sigmas of the mounts may be too small, or a \
             lens, a clock or pictures of a head are wrong",
            refused.unwrap_or_default()
        ),
        Check::Holds(true) => {
            "holds: the heads see one limb with the mounts of rig.toml, within their sigmas; smaller \
                               turns than those below would not have been noticed"
                .into()
        }
        Check::Holds(false) => {
            "cannot tell: this flight determines no turn; turn the vehicle about other axes, or fly longer".into()
        }
        Check::Turned(k, angle, sigma) => {
            let name = heads.get(*k).map_or("", |head| head.name.as_str());
            let (angle, sigma) = (angle.to_degrees(), sigma.to_degrees());
            format!("does not hold: {name} has turned by {angle:.3}° ± {sigma:.3}° against the other heads")
        }
        Check::Contradict if heads.len() == 2 => {
            "does not hold: the two heads contradict each other, and nothing says which of them has turned".into()
        }
        Check::Contradict => "does not hold: the heads contradict each other, and no single head explains it".into(),
    }
}

/// Says that the pictures contradict the told mounts, which a calibration would hide; `None` if they agree.
pub(super) fn contradicts_told(heads: &[Head], check: &Check) -> Option<String> {
    let does_not_hold = match check {
        Check::Holds(_) => return None,
        Check::Turned(..) | Check::Contradict => verdict(heads, check, None),
    };
    Some(format!(
        "the mount told in rig.toml {does_not_hold}. The wrong lens of a head looks like a turn, too, and with these \
         mounts `hzn run` would not see it: try `hzn calibrate check` with the pictures of each head first"
    ))
}

/// Returns the report of a check: the verdict, and what the pictures say.
/// `noticed` has the turn of each head about each axis of its camera that would have been noticed, radians. `refused`
/// says that the joint answer refuses more epochs than chance explains.
pub(super) fn check_report(
    heads: &[Head],
    adjusted: &Adjusted,
    (check, noticed): (&Check, &[[f64; 3]]),
    refused: Option<&str>,
) -> String {
    let verdict = verdict(heads, check, refused);
    let blind = heads.iter().zip(noticed).filter(|_| *check != Check::Holds(false)).map(|(head, turns)| {
        let [x, y, z] = turns.map(turn_deg);
        format!("{:<14} {}\n", head.name, one_line(format!("about x, y, z of its camera: {x}, {y}, {z}")))
    });
    let blind: String = blind.collect();
    let title = if blind.is_empty() { "" } else { "a turn of one head alone is noticed from these angles on\n" };
    format!("{:<14} {}\n{}{title}{blind}", "mounts", one_line(&verdict), report(heads, adjusted))
}

/// Returns a turn in words. Beyond a quarter of a circle, nothing is small any more.
fn turn_deg(rad: f64) -> String {
    if rad < core::f64::consts::FRAC_PI_2 { format!("{:.2}°", rad.to_degrees()) } else { "never".to_owned() }
}

fn lines(heads: &[Head], adjusted: &Adjusted) -> Vec<(String, String)> {
    let [used, left_out] = adjusted.epochs;
    let left_out = match left_out {
        0 => String::new(),
        several => format!("; {several} more contradict them and do not count"),
    };
    let chi2 = adjusted.chi2;
    let mut lines = vec![
        ("epochs".to_owned(), format!("{} with two or more heads{left_out}", counted(used as u64, "epoch"))),
        ("chi-square".to_owned(), format!("{chi2:.2} a degree of freedom; a value above 1 has widened the sigmas")),
    ];
    for (k, head) in heads.iter().enumerate() {
        let other = usize::from(k == 0);
        let (turn, _) = adjusted.relative(k, other);
        let other = heads.get(other).map_or("", |head| head.name.as_str());
        let sigmas: Vec<String> =
            adjusted.axes(k).iter().map(|(_, sigma_rad, _)| format!("{:.3}°", sigma_rad.to_degrees())).collect();
        let turn_deg = turn.norm().to_degrees();
        let sigmas = sigmas.join(", ");
        lines.push((
            head.name.clone(),
            format!("turned by {turn_deg:.3}° against {other}; 1-sigma about three axes {sigmas}"),
        ));
        for (axis, sigma_rad, is_determined) in adjusted.axes(k) {
            if !is_determined {
                let [x, y, z]: [f64; 3] = axis.into();
                let sigma_deg = sigma_rad.to_degrees();
                lines.push((
                    String::new(),
                    format!(
                        "not determined: a turn about ({x:.2}, {y:.2}, {z:.2}) of the rig, ± {sigma_deg:.1}°; turn the \
                         vehicle about other axes"
                    ),
                ));
            }
        }
        if let Some((km, sigma_km)) = adjusted.heights_km.get(k) {
            lines.push((String::new(), format!("limb {km:+.2} ± {sigma_km:.2} km above the common one")));
        }
    }
    lines
}
