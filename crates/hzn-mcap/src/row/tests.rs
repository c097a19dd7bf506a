use super::*;
use hzn_core::frames::Cov3;
use hzn_core::report::Counters;
use hzn_core::status::Stage;

fn meta() -> RowMeta {
    RowMeta { index: 3, file: "a,b.png".into(), time_s: Some(1.5), body: "earth".into(), altitude_km: Some(230.0) }
}

fn report<T: Real>(status: Status) -> Report<T> {
    let number = T::from_f64;
    let solution = Solution {
        axis: UnitVec3::try_new([number(0.0), number(0.6), number(0.8)]).unwrap(),
        covariance: Cov3::from_upper([number(4e-8), number(0.0), number(0.0), number(1e-8), number(0.0), number(0.0)]),
        common: Some(Cov3::from_upper([number(3e-8), number(0.0), number(0.0), number(0.0), number(0.0), number(0.0)])),
        axis_fixed: None,
        axis_vehicle: UnitVec3::try_new([number(-0.5), number(0.0), number(0.75f64.sqrt())]),
        half_angle_rad: number(1.3),
        fused_half_angle_rad: number(1.3),
        altitude_m: Some((number(240e3), number(1e3))),
        free: None,
        axis_by_cos: None,
        position: None,
        p_limb: Some(number(0.875)),
        is_airglow: false,
        rms_px: number(f64::NAN),
        inliers: 500,
        arc_px: number(900.0),
        candidate: 0,
    };
    Report {
        status,
        stage: Stage::Gates,
        level: 80,
        next_level: None,
        counters: Counters { edge_points: 600, candidates: 2, ..Counters::default() },
        candidates: Default::default(),
        solution: Some(solution),
        is_suspect: false,
    }
}

fn converts<T: Real>(tolerance: f64) {
    let row = Row::from_report::<T>(&meta(), &report(Status::Ok), Some(45.0));
    let near = |x: Option<f64>, y: f64| assert!((x.unwrap() / y - 1.0).abs() < tolerance, "{x:?} {y}");
    near(row.axis_z, 0.8);
    near(row.cov_common_xx, 3e-8);
    near(row.p_limb, 0.875);
    assert_eq!(row.protection_deg, None);
    near(row.clone().with_protection(Some(6.0)).protection_deg, 6.0 * 2e-4f64.to_degrees());
    // Without an edge that can be the limb there is no level, and without an answer neither.
    assert_eq!(Row { p_limb: None, ..row.clone() }.with_protection(Some(6.0)).protection_deg, None);
    assert_eq!(row.clone().with_protection(None).protection_deg, None);
    assert_eq!(Row::unprocessed(&meta(), Status::Unreadable, "").with_protection(Some(6.0)).protection_deg, None);
    // The axis is straight down in the picture, where only the error along x turns the vector: 2e-4 of 0.6.
    assert_eq!((row.picture_x, row.picture_y), (Some(0.0), Some(1.0)));
    near(row.picture_sigma, 2e-4 / 0.6);
    near(row.sigma_max_deg, 2e-4f64.to_degrees());
    near(row.half_angle_deg, 1.3f64.to_degrees());
    near(row.altitude_est_km, 240.0);
    near(row.pitch_deg, 30.0);
    near(row.axis_v_x, -0.5);
    near(row.axis_v_z, 0.75f64.sqrt());
    assert_eq!(row.axis_v_y, Some(0.0));
    assert_eq!((row.roll_deg, row.rms_px, row.axis_e_x), (Some(0.0), None, None));
    assert_eq!((row.level, row.inliers, row.detail.as_str()), (Some(80), Some(500), ""));
}

#[test]
fn units_are_degrees_and_kilometres() {
    converts::<f64>(1e-12);
    converts::<f32>(1e-6);
}

#[test]
fn only_ok_has_an_axis() {
    for status in Status::ALL {
        let row = Row::from_report::<f64>(&meta(), &report(status), None);
        assert_eq!(row.axis().is_some(), status == Status::Ok);
        assert_eq!(row.detail.is_empty(), status == Status::Ok);
    }
    let counters = Counters { looks: 4, ..Counters::default() };
    let again = Report { counters, ..report::<f64>(Status::NoLimb) };
    assert_eq!(Row::from_report(&meta(), &again, None).detail, "ended at gates in 4 looks");
    let row = Row::unprocessed(&meta(), Status::Unreadable, "cut off");
    assert_eq!((row.status, row.axis(), row.edge_points), (Status::Unreadable, None, None));
}

#[test]
fn roll_and_pitch_have_the_signs_they_are_documented_with() {
    let at = |x: f64, y: f64, z: f64| roll_pitch_deg(&UnitVec3::<Vehicle, f64>::try_new([x, y, z]).unwrap());
    assert_eq!(at(0.0, 0.0, 1.0), [0.0, -0.0]);
    // With the right side down, the body is to the right. With the nose up, it is behind.
    assert!((at(0.0, 1.0, 1.0)[0] - 45.0).abs() < 1e-12);
    assert!((at(-1.0, 0.0, 1.0)[1] - 45.0).abs() < 1e-12);
    assert!((at(0.0, 0.0, -1.0)[0].abs() - 180.0).abs() < 1e-12);
}

#[test]
fn csv_and_json_keep_every_cell() {
    let rows = [
        Row::from_report::<f64>(&meta(), &report(Status::Ok), Some(12.5)),
        Row::from_report::<f32>(&meta(), &report(Status::Rejected), None),
        Row::unprocessed(&meta(), Status::Unreadable, "says \"no\",\nand more"),
    ];
    let mut out = csv::Writer::from_writer(Vec::new());
    for row in &rows {
        out.serialize(row).unwrap();
    }
    let text = String::from_utf8(out.into_inner().unwrap()).unwrap();
    assert_eq!(text.lines().next().unwrap(), Row::COLUMNS.join(","));
    let back: Vec<Row> = csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect();
    assert_eq!(back, rows);
    for row in &rows {
        let line = serde_json::to_string(row).unwrap();
        assert_eq!(&serde_json::from_str::<Row>(&line).unwrap(), row);
    }
}
