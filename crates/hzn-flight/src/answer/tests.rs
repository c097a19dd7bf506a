use super::*;

fn position() -> Position {
    Position {
        axis_free: [0.1, 0.2, 0.97],
        cov_free: [1.0; 6],
        cos_free: 0.3,
        cos_free_variance: 1e-7,
        cos_free_per_px: 1e-4,
        axis_by_cos: [1.0, 2.0, 3.0],
        position_m: [4e6, 5e6, 6e6],
        pos_cov_m2: [1e9; 6],
        range_m: 7e6,
        range_sigma_m: 8e3,
        body_fixed_m: [9e6, 1e6, 2e6],
    }
}

fn integrity() -> Integrity {
    Integrity { p_limb: 0.97, protection_rad: 2e-3, cov_common: [1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9] }
}

#[test]
fn an_answer_survives_with_every_bit() {
    let edge = Edge { number: 3, length_px: 1900, points: 600, inliers: 590, rms_px: 0.3, verdict: 0 };
    let direction = Direction {
        axis: [0.1, 0.2, 0.97],
        cov: [1e-8, 2e-9, 3e-9, 4e-8, 5e-9, 6e-9],
        axis_fixed: [0.0, 0.6, 0.8],
        axis_vehicle: [1.0, 0.0, 0.0],
        half_angle_rad: 1.2,
        fused_half_angle_rad: 1.21,
        altitude_est_m: 230e3,
        altitude_est_sigma_m: 900.0,
        rms_px: 0.3,
        arc_px: 1888.0,
        inliers: 590,
        candidate: 1,
    };
    let mut edges = [None; MAX_LISTED];
    (edges[0], edges[1]) = (Some(Edge { verdict: 5, ..edge }), Some(edge));
    let outcome = Outcome {
        status: 0,
        stage: 7,
        looks: 3,
        level: 88,
        followed: 2000,
        candidates: 2,
        dropped: 3,
        fallback_points: 4,
        edge_points: 600,
        draws: 20,
        work: 25_000,
        listed: 2,
        solved: 1,
    };
    let solved = PictureAnswer {
        outcome,
        direction: Some(direction),
        position: Some(position()),
        integrity: Some(integrity()),
        edges,
    };
    let empty = PictureAnswer {
        outcome: Outcome { status: 1, solved: 0, listed: 0, ..outcome },
        direction: None,
        position: None,
        integrity: None,
        edges: [None; MAX_LISTED],
    };
    for answer in [solved, empty] {
        let mut bytes = [0; 640];
        let mut out = Writer::new(&mut bytes);
        answer.write(&mut out);
        let n = out.finish().unwrap();
        assert_eq!(PictureAnswer::read(&mut Reader::new(&bytes[..n])), Some(answer));
        for cut in 0..n {
            assert_eq!(PictureAnswer::read(&mut Reader::new(&bytes[..cut])), None);
        }
    }
}
