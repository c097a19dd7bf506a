use super::*;

#[test]
fn names_are_found_again() {
    for &kind in Kind::ALL {
        assert_eq!(Kind::from_name(kind.name()), Some(kind));
    }
    assert_eq!(Kind::from_name("limb"), None);
}

#[test]
fn skies_without_a_limb_have_none_and_show_something() {
    for &kind in Kind::ALL {
        let mut seen = 0;
        for seed in 0..12 {
            let trial = Trial::without_limb(kind, seed).unwrap();
            assert!(!trial.truth.has_limb(), "{trial:?}");
            let picture = trial.render().unwrap();
            assert_eq!(picture, Trial::without_limb(kind, seed).unwrap().render().unwrap());
            let (w, h) = (picture.width(), picture.height());
            let values: Vec<u16> = (0..h)
                .step_by(7)
                .flat_map(|y| (0..w).step_by(7).map(move |x| (x, y)))
                .map(|(x, y)| picture.at(x, y))
                .collect();
            let (low, high) = (values.iter().min().unwrap(), values.iter().max().unwrap());
            seen += u32::from(high - low > 20);
        }
        assert!(seen >= 9, "{}: {seen} of 12 pictures show something", kind.name());
    }
}

#[test]
fn limbs_are_in_view_next_to_artefacts() {
    for &kind in Kind::ALL {
        let trials: Vec<Trial> = (0..12).filter_map(|seed| Trial::with_limb(kind, seed).unwrap()).collect();
        assert!(trials.len() >= 3, "{}: {}", kind.name(), trials.len());
        for trial in trials {
            assert!(trial.truth.has_limb(), "{trial:?}");
        }
    }
}

#[test]
fn a_prior_attitude_is_off_by_its_sigma() {
    let trials = (0..200).map(|seed| Trial::without_limb(Kind::Ring, seed).unwrap());
    let squares: Vec<f64> = trials
        .map(|t| {
            let prior = t.prior(Some(5.0)).fixed_from_camera.unwrap();
            let truth = t.scene.pose.fixed_from_camera().unwrap();
            let z = hzn_core::frames::UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap();
            prior.apply(&z).angle_rad(&truth.apply(&z)).to_degrees().powi(2)
        })
        .collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((6.0..8.2).contains(&rms), "{rms} instead of 5·√2 degrees");
}
