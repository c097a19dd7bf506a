//! Counts in QEMU what the bytes of a line cost the flight software. `cargo xtask test firmware` builds the images and
//! runs the test.

use std::process::Stdio;

use hzn_flight::messages::Function;
use hzn_flight::packet::{self, Apid, ApidBase, SYNC};
use hzn_tests::emulated::{Board, instructions};

/// Number of bytes of a measurement.
const BYTES: usize = 64 << 10;
/// Most instructions for a byte.
const MOST: f64 = 60.0;
/// Most instructions for a turn without a picture.
///
/// Measured: 36 000 for the bytes of a turn at most (markers alone, Cortex-M7), and 12 900 more in the turn of a
/// housekeeping packet, 12 100 of them to compare the two copies of the sensor, 8048 bytes each. Both may fall into one
/// turn, and with headers inside headers, where the loop's limit of the work ends a turn, a turn takes 41 500.
const MOST_IN_A_TURN: u32 = 50_000;
/// Bytes that are dearer, because many of them begin a packet that must be refused. The work of a turn bounds them.
const DEARER: [&str; 2] = ["markers alone", "headers inside headers"];

/// Returns repeatable bytes without a pattern.
fn noise() -> Vec<u8> {
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
        (state >> 56) as u8
    };
    (0..BYTES).map(|_| next()).collect()
}

/// Returns a packet for another computer with these data.
fn foreign(data: &[u8]) -> Vec<u8> {
    let mut out = [0; packet::MAX_BYTES];
    let base = ApidBase::try_new(512).unwrap();
    let n = packet::write(&mut out, base, Apid::Command, 1, None, |w| {
        w.u8(Function::Ping as u8);
        w.bytes(data);
    });
    out[..n.unwrap()].to_vec()
}

/// Repeats bytes until there are enough.
fn repeated(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().copied().cycle().take(BYTES).collect()
}

/// Returns what may arrive on a line, with names.
fn lines() -> Vec<(&'static str, Vec<u8>)> {
    let long = foreign(&[7; 980]);
    let mut damaged = long.clone();
    damaged[500] ^= 1;
    // A header that claims the greatest length, in which the next one begins after each header.
    let header = [&SYNC[..], &[0x19, 0xC0, 0xC0, 0x00, 0x03, 0xE0]].concat();
    vec![
        ("noise", noise()),
        (DEARER[0], repeated(&SYNC)),
        ("markers without their last byte", repeated(&SYNC[..3])),
        (DEARER[1], repeated(&header)),
        ("long packets for others", repeated(&long)),
        ("short packets for others", repeated(&foreign(&[]))),
        ("long damaged packets", repeated(&damaged)),
    ]
}

/// Returns the instructions of all bytes, and the most of a turn.
fn cost(board: Board, bytes: &[u8]) -> (u32, u32) {
    let dir = tempfile::tempdir().unwrap();
    let input = [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    std::fs::write(dir.path().join("line.bin"), input).unwrap();
    let mut command = board.qemu(&board.image("line"), 10);
    let status = command.args(["-serial", "null"]).current_dir(dir.path()).stdin(Stdio::null()).status().unwrap();
    assert!(status.success(), "{}: {status}", board.name());
    let cost = std::fs::read(dir.path().join("cost.bin")).unwrap();
    let [with_bytes, most, without] = std::array::from_fn(|i| {
        let ticks = u32::from_le_bytes(*cost[4 * i..].first_chunk().expect("the image wrote three numbers"));
        instructions(ticks.into()) as u32
    });
    (with_bytes - without, most)
}

#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn a_byte_of_the_line_costs_at_most_sixty_instructions() {
    let mut dear = Vec::new();
    for board in Board::with_pictures() {
        for (name, bytes) in lines() {
            let (all, most) = cost(board, &bytes);
            let each = f64::from(all) / bytes.len() as f64;
            eprintln!("{}: {name}: {each:.1} instructions a byte, at most {most} in a turn", board.core());
            if !DEARER.contains(&name) && each > MOST || most > MOST_IN_A_TURN {
                dear.push((board, name));
            }
        }
    }
    assert!(dear.is_empty(), "{dear:?}");
}
