//! A grey picture as single-precision numbers.

use hzn_core::image::Pixels;

/// A grey picture. The brightness has any scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Grey {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Grey {
    /// Makes a picture from rows of brightness; `None` if the number of values is not `width` × `height`.
    pub fn try_new(width: usize, height: usize, values: Vec<f32>) -> Option<Self> {
        (width * height == values.len()).then_some(Self { width, height, values })
    }

    /// Makes a copy of a picture of any kind.
    pub fn from_pixels(picture: &impl Pixels) -> Self {
        let (width, height) = (usize::from(picture.width()), usize::from(picture.height()));
        let row = |y: u16| (0..picture.width()).map(move |x| f32::from(picture.at(x, y)));
        Self { width, height, values: (0..picture.height()).flat_map(row).collect() }
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns a row; empty if there is none.
    pub(super) fn row(&self, y: usize) -> &[f32] {
        self.values.get(y * self.width..(y + 1) * self.width).unwrap_or_default()
    }

    /// Returns the brightness of a pixel; 0 outside the picture.
    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.row(y).get(x).copied().unwrap_or(0.0)
    }

    /// Returns the brightness between pixels, by bilinear interpolation; 0 outside the picture.
    pub(super) fn between(&self, u: f32, v: f32) -> f32 {
        if !(u >= 0.0 && v >= 0.0) {
            return 0.0;
        }
        let (x, y) = (u as usize, v as usize);
        let (a, b) = (u - x as f32, v - y as f32);
        let (upper, lower) = (self.row(y), self.row(y + 1));
        match (upper.get(x..x + 2), lower.get(x..x + 2)) {
            (Some([p, q]), Some([r, s])) => (p + (q - p) * a) * (1.0 - b) + (r + (s - r) * a) * b,
            _ => 0.0,
        }
    }

    /// Returns a copy of half the size; each pixel is the mean of four. The middle of pixel (x, y) of the copy is at
    /// (2 x + ½, 2 y + ½) of this picture.
    pub(super) fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            let (upper, lower) = (self.row(2 * y), self.row(2 * y + 1));
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            values.extend(pairs.map(|(p, q)| 0.25 * (p[0] + p[1] + q[0] + q[1])));
        }
        Self { width, height, values }
    }

    /// Returns a copy that is blurred with the binomial filter [1 4 6 4 1]/16 in both directions (a standard deviation
    /// of one pixel). Beyond the border, the picture goes on with its last pixels.
    pub(super) fn blurred(&self) -> Self {
        let (w, h) = (self.width, self.height);
        let mut across = vec![0.0f32; w * h];
        for (y, out) in across.chunks_exact_mut(w.max(1)).enumerate() {
            blur_row(self.row(y), out);
        }
        let mut values = vec![0.0f32; w * h];
        let row = |y: isize| {
            let y = y.clamp(0, h as isize - 1) as usize;
            &across[y * w..(y + 1) * w]
        };
        for (y, out) in values.chunks_exact_mut(w.max(1)).enumerate() {
            let [a, b, c, d, e] = [-2, -1, 0, 1, 2].map(|k| row(y as isize + k));
            let below = a.iter().zip(b).zip(c).zip(d).zip(e);
            for (out, ((((a, b), c), d), e)) in out.iter_mut().zip(below) {
                *out = (a + e + 4.0 * (b + d) + 6.0 * c) * (1.0 / 16.0);
            }
        }
        Self { width: w, height: h, values }
    }
}

fn blur_row(row: &[f32], out: &mut [f32]) {
    let n = row.len();
    for (out, five) in out.iter_mut().skip(2).zip(row.windows(5)) {
        *out = (five[0] + five[4] + 4.0 * (five[1] + five[3]) + 6.0 * five[2]) * (1.0 / 16.0);
    }
    let at = |x: isize| row[x.clamp(0, n as isize - 1) as usize];
    for x in (0..n.min(2)).chain(n.saturating_sub(2).max(n.min(2))..n) {
        let [a, b, c, d, e] = [-2, -1, 0, 1, 2].map(|k| at(x as isize + k));
        out[x] = (a + e + 4.0 * (b + d) + 6.0 * c) * (1.0 / 16.0);
    }
}
