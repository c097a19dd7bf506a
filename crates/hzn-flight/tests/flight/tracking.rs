//! Tests the tracker in the flight loop: the limb of a sequence is looked for where the picture before has it.

use hzn_core::status::Status;
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::Writer;
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Code, Function};

use crate::bench::{Bench, HEIGHT, Rows, WIDTH, command, fly, limb, ready, send, take_sent};

/// Numbers of `track.full_every` and `consensus.threshold_px`.
const FULL_EVERY: u16 = 140;
const THRESHOLD_PX: u16 = 81;

/// A picture, and how many were lost before it.
type Shown = (Vec<u8>, u32);

/// The limb of the bench, lower by some rows, with noise.
fn lower(rows: usize, seed: u32) -> Vec<u8> {
    let mut state = seed;
    let mut draw = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as u8 % 6
    };
    let sky = vec![10; rows * WIDTH];
    sky.into_iter().chain(limb()).take(WIDTH * HEIGHT).map(|p| p + draw()).collect()
}

/// Draws a bright disc, such as the Sun, with its glare.
fn with_sun(mut picture: Vec<u8>, (x, y): (f64, f64), radius_px: f64) -> Vec<u8> {
    for (i, pixel) in picture.iter_mut().enumerate() {
        let far = ((i % WIDTH) as f64 - x).hypot((i / WIDTH) as f64 - y);
        let glare = 255.0 * (-((far - radius_px).max(0.0) / 20.0)).exp();
        *pixel = (f64::from(*pixel) + glare).min(255.0) as u8;
    }
    picture
}

/// Draws dark and bright clouds over the ground, and over the limb itself.
fn with_clouds(mut picture: Vec<u8>, phase: f64) -> Vec<u8> {
    for (i, pixel) in picture.iter_mut().enumerate() {
        let (x, y) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
        let cloud = ((x / 31.0 + phase).sin() + (y / 17.0 - x / 53.0).sin()) / 2.0;
        if *pixel > 60 {
            *pixel = (f64::from(*pixel) * (1.0 + 0.3 * cloud)) as u8;
        }
    }
    picture
}

fn set(f: &mut Flight<'_, Bench>, sequence: u16, (id, value): (u16, f64)) {
    let set = command(sequence, Function::TryParameters, |w: &mut Writer<'_>| {
        w.u8(1);
        w.u16(id);
        w.f64(value);
    });
    // The line is silent for a while, so that the packet is trusted at once.
    f.board().now_us += 200_000;
    assert_eq!(send(f, &set).answers, [(Function::TryParameters as u8, sequence, Code::Done)]);
}

/// Shows pictures in turn and returns their answers.
fn show(f: &mut Flight<'_, Bench>, pictures: &[Shown]) -> Vec<PictureAnswer> {
    f.board().lift_off = true;
    f.board().pictures.extend(pictures.iter().cloned());
    (0..pictures.len()).for_each(|_| f.turn());
    take_sent(f).science.into_iter().map(|(_, answer)| answer).collect()
}

/// Returns the answers to pictures with a full search every so many pictures.
fn answers(full_every: u16, pictures: &[Shown]) -> Vec<PictureAnswer> {
    fly(ready(), |f| {
        set(f, 1, (FULL_EVERY, full_every.into()));
        show(f, pictures)
    })
}

fn is_tracked(answer: &PictureAnswer) -> bool {
    answer.solved == 1 && answer.looks == 0
}

fn tracked(answers: &[PictureAnswer]) -> Vec<usize> {
    (0..answers.len()).filter(|&k| is_tracked(&answers[k])).collect()
}

/// Numbers as text have every bit, and NaN equals NaN.
fn text(x: &PictureAnswer) -> String {
    format!("{x:?}")
}

/// Asserts that a picture that was not tracked has the packets that it has without tracking, and that a tracked one
/// has nearly its direction.
fn assert_like_full_search(with: &[PictureAnswer], without: &[PictureAnswer]) {
    assert_eq!(with.len(), without.len());
    assert_eq!(tracked(without), [0; 0]);
    for (k, (with, without)) in with.iter().zip(without).enumerate() {
        if !is_tracked(with) {
            assert_eq!(text(with), text(without), "picture {k}");
            continue;
        }
        let [a, b] = [with, without].map(|answer| answer.direction.unwrap());
        let apart = a.axis.iter().zip(b.axis).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt();
        let sigma = (a.cov[0] + a.cov[3] + a.cov[5]).sqrt();
        assert!(apart < sigma, "picture {k}: {apart} of {sigma} rad");
        assert!(with.edge_points < 200 && without.edge_points > 300);
    }
}

fn moving(pictures: usize) -> Vec<Shown> {
    (0..pictures).map(|k| (lower(3 * k, k as u32), 0)).collect()
}

#[test]
fn a_limb_is_tracked_between_full_searches() {
    let pictures = moving(12);
    let (with, without) = (answers(5, &pictures), answers(0, &pictures));
    assert_like_full_search(&with, &without);
    assert_eq!(tracked(&with), [1, 2, 3, 4, 6, 7, 8, 9, 11]);
    assert!(with.iter().all(|answer| answer.status == Status::Ok as u8));
    assert!(with[1].to_report().unwrap().is_tracked());
}

#[test]
fn leaps_blanks_the_sun_and_clouds_get_the_answers_of_full_searches() {
    let at = |k: usize, rows: usize| lower(rows, k as u32);
    let blank = || vec![10; WIDTH * HEIGHT];
    let pictures: Vec<Shown> = vec![
        at(0, 40),
        at(1, 42),
        // A leap, and back.
        at(2, 150),
        at(3, 153),
        at(4, 46),
        at(5, 48),
        blank(),
        at(7, 52),
        at(8, 54),
        // The Sun in the sky, at the limb, and as the only light.
        with_sun(at(9, 56), (300.0, 30.0), 8.0),
        with_sun(at(10, 58), (320.0, 130.0), 8.0),
        with_sun(at(11, 60), (500.0, 110.0), 25.0),
        with_sun(blank(), (320.0, 240.0), 30.0),
        at(13, 64),
        with_clouds(at(14, 66), 0.3),
        with_clouds(at(15, 68), 0.9),
        with_clouds(with_sun(at(16, 70), (100.0, 60.0), 10.0), 1.4),
        at(17, 200),
    ]
    .into_iter()
    .map(|picture| (picture, 0))
    .collect();
    let (with, without) = (answers(25, &pictures), answers(0, &pictures));
    assert_like_full_search(&with, &without);
    let found = tracked(&with);
    // After a leap, and after a picture without an answer, the whole picture is searched.
    for k in [0, 2, 4, 6, 7, 12, 13, 17] {
        assert!(!found.contains(&k), "{k}");
    }
    for k in [1, 3, 5, 8] {
        assert!(found.contains(&k), "{k} of {found:?}");
    }
}

/// An answer that is false: the limb of the picture before is not there any more, or only a part of it.
#[test]
fn a_false_answer_before_does_not_change_the_next() {
    let half = |top: usize| {
        let (high, low) = (lower(top, 3), lower(200, 4));
        let row = |y: usize| if y < HEIGHT / 2 { &high } else { &low };
        (0..WIDTH * HEIGHT).map(|i| if i % WIDTH < WIDTH / 2 { row(i / WIDTH)[i] } else { low[i] }).collect()
    };
    let pictures: Vec<Shown> = vec![(lower(20, 1), 0), (lower(200, 2), 0), (lower(20, 1), 0), (half(20), 0)];
    let (with, without) = (answers(25, &pictures), answers(0, &pictures));
    assert_like_full_search(&with, &without);
    assert_eq!(tracked(&with), [0; 0]);
}

#[test]
fn a_gap_ends_the_tracking() {
    fly(ready(), |f| {
        set(f, 1, (FULL_EVERY, 25.0));
        assert_eq!(tracked(&show(f, &moving(3))), [1, 2]);
        // Pictures were lost.
        let lost: Vec<Shown> = vec![(lower(6, 1), 0), (lower(6, 2), 2), (lower(6, 3), 0)];
        assert_eq!(tracked(&show(f, &lost)), [0, 2]);
        // A picture of the wrong size has no packet.
        let part: Vec<Shown> = vec![(vec![7; 1000], 0), (lower(6, 4), 0), (lower(6, 5), 0)];
        assert_eq!(tracked(&show(f, &part)), [1]);
        // The parameters of the sensor change.
        set(f, 2, (THRESHOLD_PX, 2.5));
        assert_eq!(tracked(&show(f, &[(lower(6, 6), 0), (lower(6, 7), 0)])), [1]);
        // The camera is silent.
        f.board().now_us += 5_000_000;
        f.turn();
        take_sent(f);
        assert_eq!(tracked(&show(f, &[(lower(6, 8), 0), (lower(6, 9), 0)])), [1]);
        // A command asks for the edges of a picture: they are those of the whole picture.
        f.board().now_us += 200_000;
        send(f, &command(3, Function::DumpEdges, |_| ()));
        assert_eq!(tracked(&show(f, &[(lower(6, 10), 0), (lower(6, 11), 0)])), [1]);
    });
}

#[test]
fn pictures_on_command_and_rows_are_not_tracked() {
    fly(ready(), |f| {
        set(f, 1, (FULL_EVERY, 25.0));
        for sequence in 2..5 {
            f.board().now_us += 200_000;
            f.board().pictures.push_back((lower(6, 1), 0));
            let sent = send(f, &command(sequence, Function::ProcessOnce, |_| ()));
            assert_eq!((sent.science.len(), is_tracked(&sent.science[0].1)), (1, false));
        }
    });
    let by_rows = Bench { rows: Some(Box::new(Rows::new())), rows_sent: HEIGHT, ..ready() };
    fly(by_rows, |f| {
        set(f, 1, (FULL_EVERY, 25.0));
        let answers = show(f, &moving(4));
        assert_eq!((answers.len(), tracked(&answers)), (4, vec![]));
        assert!(answers[1..].iter().all(|answer| answer.status == Status::Ok as u8));
    });
}
