//! Tests a board without memory for a picture: its rows give the packets that the picture in memory gives.

use hzn_core::status::Status;
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::Writer;
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Code, Event, Function};
use hzn_flight::view::RowMemory;

use crate::bench::{Bench, HEIGHT, Rows, WIDTH, command, fly, limb, ready, send, take_sent};

/// Parameters 50 and 51: `threshold.method` and `threshold.level`.
const FIXED_AT_100: [(u16, f64); 2] = [(50, 1.0), (51, 100.0)];

fn by_rows() -> Bench {
    Bench { rows: Some(Box::new(Rows::new())), rows_sent: HEIGHT, ..ready() }
}

/// Numbers as text have every bit, and NaN equals NaN.
fn text(x: &(impl std::fmt::Debug + ?Sized)) -> String {
    format!("{x:?}")
}

fn set(f: &mut Flight<'_, Bench>, values: &[(u16, f64)]) {
    let set = command(1, Function::SetParameters, |w: &mut Writer<'_>| {
        w.u8(values.len() as u8);
        for &(id, value) in values {
            w.u16(id);
            w.f64(value);
        }
    });
    assert_eq!(send(f, &set).answers, [(Function::SetParameters as u8, 1, Code::Done)]);
}

/// Flies over pictures and returns the answers (without the work and the probability of the limb, which differ in
/// rows), the events, and the pixels of the longest edge of the first picture.
fn fly_over(
    bench: Bench,
    parameters: &[(u16, f64)],
    pictures: &[Vec<u8>],
) -> (Vec<PictureAnswer>, Vec<(Event, u32, u32)>, usize) {
    fly(bench, |f| {
        set(f, parameters);
        send(f, &command(2, Function::DumpEdges, |_| ()));
        take_sent(f);
        f.board().lift_off = true;
        f.board().pictures.extend(pictures.iter().map(|picture| (picture.clone(), 0)));
        (0..=pictures.len()).for_each(|_| f.turn());
        let sent = take_sent(f);
        let mut answers: Vec<PictureAnswer> = sent.science.into_iter().map(|(_, answer)| answer).collect();
        for answer in &mut answers {
            answer.outcome.work = 0;
            // Rows keep no brightness, whose terms the probability of the picture in memory has.
            if let Some(integrity) = &mut answer.integrity {
                assert!((0.0..=1.0).contains(&integrity.p_limb), "{integrity:?}");
                integrity.p_limb = 0.0;
            }
        }
        (answers, sent.events, sent.edge.len())
    })
}

/// The limb with noise of this width in counts.
fn noisy_limb(noise: u32) -> Vec<u8> {
    let mut state = 1u32;
    let mut draw = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % (noise + 1)
    };
    limb().into_iter().map(|p| (u32::from(p) + draw()) as u8).collect()
}

#[test]
fn the_packets_are_those_of_the_picture_in_memory() {
    let pictures = [noisy_limb(0), noisy_limb(5), vec![0; WIDTH * HEIGHT]];
    let in_memory = fly_over(ready(), &FIXED_AT_100, &pictures);
    let by_rows = fly_over(by_rows(), &FIXED_AT_100, &pictures);
    assert_eq!(text(&by_rows), text(&in_memory));
    assert_eq!(by_rows.0.iter().filter(|answer| answer.status == Status::Ok as u8).count(), 2);
    assert!(by_rows.2 > 300, "the edge that was asked for has {} pixels", by_rows.2);
}

#[test]
fn the_first_picture_gives_the_threshold_of_the_next() {
    let pictures = vec![noisy_limb(5); 3];
    let (answers, ..) = fly_over(by_rows(), &[(50, 0.0)], &pictures);
    assert_eq!(answers.iter().map(|a| a.status).collect::<Vec<_>>(), [Status::NoLimb as u8, 0, 0]);
    // The same threshold as of the picture in memory, and so the same direction.
    let (in_memory, ..) = fly_over(ready(), &[(50, 0.0)], &pictures);
    assert_eq!(text(&answers[1..]), text(&in_memory[1..]));
}

#[test]
fn stuck_pixels_at_the_limb_are_noticed_in_rows() {
    let stuck = || {
        let mut picture = noisy_limb(5);
        // The readout hangs at the limb: in every column, twelve pixels from the limb on have the same value.
        for x in 0..WIDTH {
            let limb = (0..HEIGHT).find(|y| picture[y * WIDTH + x] >= 100).unwrap();
            (limb..HEIGHT.min(limb + 12)).for_each(|y| picture[y * WIDTH + x] = 180);
        }
        picture
    };
    for bench in [ready(), by_rows()] {
        let (answers, events, _) = fly_over(bench, &FIXED_AT_100, &[stuck()]);
        assert!(answers.is_empty() && events.iter().any(|(event, ..)| *event == Event::StuckPixels), "{events:?}");
    }
}

#[test]
fn a_camera_that_stops_in_a_picture_is_reported() {
    let bench = Bench { rows_sent: 100, ..by_rows() };
    let (answers, events, _) = fly_over(bench, &FIXED_AT_100, &[limb()]);
    assert!(answers.is_empty());
    assert!(events.contains(&(Event::WrongSize, 100 * WIDTH as u32, (WIDTH * HEIGHT) as u32)), "{events:?}");
}

#[test]
fn the_longest_edge_that_was_asked_for_waits_for_an_answer() {
    let stuck = {
        let mut picture = noisy_limb(5);
        for x in 0..WIDTH {
            let limb = (0..HEIGHT).find(|y| picture[y * WIDTH + x] >= 100).unwrap();
            (limb..HEIGHT.min(limb + 12)).for_each(|y| picture[y * WIDTH + x] = 180);
        }
        picture
    };
    for bad in [vec![9; 100], stuck] {
        let (answers, events, edge) = fly_over(ready(), &FIXED_AT_100, &[bad, noisy_limb(5)]);
        assert!(answers.len() == 1 && events.len() > 1, "{events:?}");
        assert!(edge > 300, "{edge}");
    }
}

#[test]
fn a_picture_that_the_memory_for_rows_does_not_hold_is_refused() {
    // This camera has more rows than the memory.
    let (answers, events, _) = fly_over(by_rows(), &[(2, 481.0), (50, 1.0)], &[vec![9; WIDTH * 481]]);
    assert!(answers.is_empty());
    assert!(events.contains(&(Event::RowsRefused, 2, 0)), "{events:?}");
}

/// The memory for pictures of 640×480 and 1920×1080 pixels in book/guide/porting.md.
#[test]
fn memory_for_rows() {
    assert_eq!(size_of::<RowMemory<{ 32 * 640 }, 480, 8192, 2560>>(), 65_576);
    assert_eq!(size_of::<RowMemory<{ 32 * 1920 }, 1080, 16384, 5120>>(), 153_000);
}
