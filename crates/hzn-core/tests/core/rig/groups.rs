//! Heads that see limbs of different heights, such as an infrared and a visible one.

use nalgebra::Vector3;

use super::*;

/// Draws one epoch of heads in groups, in which head 0 is turned by `turned_rad`. Each group has a half-angle of its
/// own, drawn from a wide range.
fn epoch_of_groups(
    cameras: &[Camera],
    groups: &[u8],
    dice: &mut Dice,
    turned_rad: Vector3<f64>,
) -> Vec<Option<Head<f64>>> {
    let cos = [0; 4].map(|_| HALF_ANGLE_RAD.cos() + 0.01 * dice.normal());
    let turn = |k: usize| if k == 0 { turned_rad } else { Vector3::zeros() };
    let see = |(k, (camera, &group)): (usize, (&Camera, &u8))| {
        let head = camera.head(&camera.see(dice, cos[usize::from(group)], turn(k)), 0.0)?;
        Some(head.in_limb_group(group))
    };
    cameras.iter().zip(groups).enumerate().map(see).collect()
}

const SETS: [(&[f64], &[u8]); 5] = [
    (&[0.0, 180.0], &[0, 1]),
    (&[0.0, 120.0, 240.0], &[0, 0, 1]),
    (&[0.0, 120.0, 240.0], &[2, 1, 0]),
    (&[0.0, 90.0, 180.0, 270.0], &[0, 1, 0, 1]),
    (&[0.0, 90.0, 180.0, 270.0], &[1, 0, 0, 0]),
];

#[test]
fn groups_of_different_heights_have_an_honest_covariance() {
    let rig = rig(1e-9, 1e-4);
    for (azimuths_deg, groups) in SETS {
        let (cameras, mut dice, trials) = (cameras(azimuths_deg), Dice::new(21), 4000);
        let mut sum = 0.0;
        for _ in 0..trials {
            let heads = epoch_of_groups(&cameras, groups, &mut dice, Vector3::zeros());
            let joint = rig.join(&heads, 0.0).unwrap();
            assert_eq!((joint.heads_used, joint.heads_excluded), ((1 << groups.len()) - 1, 0));
            sum += nees(&joint);
        }
        let nees = sum / f64::from(trials);
        assert!((nees - 2.0).abs() < 0.1, "{groups:?}: NEES {nees}");
    }
}

#[test]
fn limbs_of_different_heights_contradict_each_other_in_one_group() {
    let (cameras, rig) = (cameras(&[0.0, 90.0, 180.0, 270.0]), rig(1e-3, 1e-4));
    let mut dice = Dice::new(22);
    let (mut refused, trials) = (0, 200);
    for _ in 0..trials {
        let heads = epoch_of_groups(&cameras, &[0, 1, 0, 1], &mut dice, Vector3::zeros());
        let as_one: Vec<_> = heads.iter().map(|head| head.map(|head| head.in_limb_group(0))).collect();
        refused += u32::from(rig.join(&as_one, 0.0).is_err());
    }
    assert!(refused > trials / 2, "{refused} of {trials}");
}

#[test]
fn the_number_of_the_only_group_has_no_effect() {
    let (cameras, rig) = (cameras(&[0.0, 120.0, 240.0]), rig(1e-3, 1e-4));
    let heads = epoch(&cameras, &mut Dice::new(23), Vector3::zeros());
    let first = rig.join(&heads, 1e-4).unwrap();
    for group in [1, 3, 200] {
        let heads: Vec<_> = heads.iter().map(|head| head.map(|head| head.in_limb_group(group))).collect();
        let joint = rig.join(&heads, 1e-4).unwrap();
        assert_eq!((joint.axis, joint.covariance, joint.cos), (first.axis, first.covariance, first.cos));
        assert_eq!((joint.separation_rad, joint.protection_rad), (first.separation_rad, first.protection_rad));
    }
}

#[test]
fn good_groups_alarm_as_often_as_allowed() {
    let rig = rig(1e-2, 1e-4);
    for (azimuths_deg, groups) in SETS {
        let (cameras, mut dice, trials) = (cameras(azimuths_deg), Dice::new(25), 8000);
        let is_alarm = |heads: &[Option<Head<f64>>]| !rig.join(heads, 0.0).is_ok_and(|j| j.heads_excluded == 0);
        let mut draw = || epoch_of_groups(&cameras, groups, &mut dice, Vector3::zeros());
        let alarms = (0..trials).filter(|_| is_alarm(&draw())).count();
        let share = alarms as f64 / f64::from(trials);
        // The heads are compared with each other, so that their alarms come together: at least the part of one head.
        assert!(share > 0.002 && share < 0.0125, "{groups:?}: {share}");
    }
}

#[test]
fn a_turned_head_is_noticed_whatever_its_group() {
    let rig = rig(1e-3, 1e-4);
    for (azimuths_deg, groups) in SETS {
        let (cameras, mut dice, trials) = (cameras(azimuths_deg), Dice::new(27), 400);
        let (mut noticed, mut wrong) = (0, 0);
        for _ in 0..trials {
            // The turn is about an axis across the direction to the body, and larger than what a head alone can hide.
            let heads = epoch_of_groups(&cameras, groups, &mut dice, Vector3::new(0.0, 5f64.to_radians(), 0.0));
            match rig.join(&heads, 0.0) {
                Ok(joint) => {
                    noticed += u32::from(joint.heads_excluded != 0);
                    wrong += u32::from(joint.heads_excluded & !0b0001 != 0);
                }
                Err(reason) => {
                    assert_eq!(reason, NoJoint::Inconsistent);
                    noticed += 1;
                }
            }
        }
        println!("{groups:?}: noticed {noticed} of {trials}, another head is excluded {wrong}");
        assert!(noticed >= 396 && wrong <= 2, "{groups:?}: noticed {noticed}, wrong {wrong}");
    }
}

#[test]
fn errors_of_groups_stay_within_the_protection_level() {
    let rig = rig(1e-3, 1e-2);
    for (azimuths_deg, groups) in SETS {
        let (cameras, mut dice) = (cameras(azimuths_deg), Dice::new(29));
        let (mut answers, mut beyond) = (0, 0);
        for trial in 0..6000 {
            let size = 0.05 * 100f64.powf(f64::from(trial % 20) / 19.0);
            let axis = Vector3::new(dice.normal(), dice.normal(), dice.normal()).normalize();
            let heads = epoch_of_groups(&cameras, groups, &mut dice, axis * size.to_radians());
            let Ok(joint) = rig.join(&heads, 0.0) else { continue };
            answers += 1;
            beyond += u32::from(error_rad(&joint) > joint.protection_rad.expect("several heads"));
        }
        println!("{groups:?}: {beyond} of {answers} beyond");
        assert!(answers > 1000 && f64::from(beyond) <= 0.01 * f64::from(answers), "{groups:?}: {beyond} of {answers}");
    }
}
