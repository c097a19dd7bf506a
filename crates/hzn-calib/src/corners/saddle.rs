//! Saddles of the brightness: places that may be corners of a chessboard.

use super::grey::Grey;

/// A local maximum of the saddle strength.
#[derive(Debug, Clone, Copy)]
pub(super) struct Saddle {
    pub(super) x: usize,
    pub(super) y: usize,
    /// Negative determinant of the second derivatives, in brightness² per px⁴.
    pub(super) strength: f32,
}

/// Ratio of a saddle's strength to the median strength of positive pixels below which the saddle is noise. For noise
/// alone, the strength has an exponential tail; one pixel in a hundred thousand exceeds 16 times its median.
const MIN_RATIO: f32 = 16.0;
/// Maximum number of saddles; the strongest count.
const MAX_SADDLES: usize = 4000;
/// Distance in pixels within which only the strongest saddle counts.
const REACH: usize = 2;

/// Returns the saddles of a blurred picture, the strongest first.
///
/// At the corner of a chessboard the brightness is a saddle: its second derivatives have a negative determinant,
/// I_xx I_yy − I_xy² < 0, whatever the direction of the edges. On an edge alone it is zero.
pub(super) fn find_saddles(blurred: &Grey) -> Vec<Saddle> {
    let (w, h) = (blurred.width(), blurred.height());
    if w < 16 || h < 16 {
        return Vec::new();
    }
    let mut strength = vec![0.0f32; w * h];
    for y in 1..h - 1 {
        strengths(blurred, y, &mut strength[y * w..(y + 1) * w]);
    }
    let floor = MIN_RATIO * typical(&strength);
    let mut found = Vec::new();
    for y in REACH..h - REACH {
        let row = &strength[y * w..(y + 1) * w];
        for x in REACH..w - REACH {
            let own = row[x];
            if own > floor && is_highest(&strength, w, x, y) {
                found.push(Saddle { x, y, strength: own });
            }
        }
    }
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    found.truncate(MAX_SADDLES);
    found
}

/// Writes the strength of the pixels of a row.
fn strengths(picture: &Grey, y: usize, out: &mut [f32]) {
    let (above, here, below) = (picture.row(y - 1), picture.row(y), picture.row(y + 1));
    let n = out.len();
    let neighbours = above.windows(3).zip(here.windows(3)).zip(below.windows(3));
    for (out, ((a, b), c)) in out[1..n - 1].iter_mut().zip(neighbours) {
        let xx = b[0] + b[2] - 2.0 * b[1];
        let yy = a[1] + c[1] - 2.0 * b[1];
        let xy = 0.25 * (a[0] + c[2] - a[2] - c[0]);
        *out = xy * xy - xx * yy;
    }
}

/// Returns the median of the positive strengths of a sparse sample.
fn typical(strength: &[f32]) -> f32 {
    let step = (strength.len() / 4000).max(1);
    // An odd step does not stay in the same columns.
    let mut sample: Vec<f32> = strength.iter().step_by(step | 1).copied().filter(|s| *s > 0.0).collect();
    let middle = sample.len() / 2;
    if sample.is_empty() { 0.0 } else { *sample.select_nth_unstable_by(middle, f32::total_cmp).1 }
}

fn is_highest(strength: &[f32], w: usize, x: usize, y: usize) -> bool {
    let own = strength[y * w + x];
    (y - REACH..=y + REACH).all(|j| {
        let row = &strength[j * w + x - REACH..=j * w + x + REACH];
        // Of two equal neighbours the first one counts.
        row.iter().enumerate().all(|(i, s)| *s < own || (*s == own && (j, x - REACH + i) >= (y, x)))
    })
}
