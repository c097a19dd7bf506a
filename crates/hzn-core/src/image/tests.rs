//! Pictures of every kind and shape.

use super::*;

#[test]
fn eight_pixels_at_once_are_as_one_by_one() {
    // This tests every threshold and some that no byte reaches, with samples at it, around it and far from it.
    for level in 0..=300u16 {
        for seed in 0..64u32 {
            let near = |k: usize| match seed.wrapping_mul(0x9E37_79B1).rotate_left(5 * k as u32) % 64 {
                0 => 0,
                1 => 255,
                n => (i32::from(level) + n as i32 / 8 - if seed % 2 == 0 { 7 } else { 0 }).clamp(0, 255) as u8,
            };
            let bytes: [u8; 21] = core::array::from_fn(near);
            let words = bytes.map(u16::from);
            for lit in [false, true] {
                assert_eq!(
                    u8::run_length(&bytes, level, lit),
                    u16::run_length(&words, level, lit),
                    "{bytes:?} at {level}"
                );
            }
        }
    }
    // If the pixels reach beyond the picture's end, the count is 0.
    let picture = Grey::try_new(&[9u8; 10], Layout::packed(10, 1, 1, 8)).unwrap();
    assert_eq!([0, 2, 3, 10].map(|i| picture.run_length(i, 8, 5, true)), [8, 8, 0, 0]);
}

#[test]
fn stride_and_channels_are_honoured() {
    let data = [1u8, 2, 3, 9, 9, 30, 60, 90, 9, 9];
    let l = Layout { width: 1, height: 2, stride: 5, channels: 3, bits: 8 };
    let mean = Colour::try_new(&data, l, Channel::Mean).unwrap();
    assert_eq!((mean.at(0, 0), mean.at(0, 1)), (2, 60));
    let blue = Colour::try_new(&data, l, Channel::Blue).unwrap();
    assert_eq!((blue.at(0, 0), blue.at(0, 1)), (3, 90));
}

#[test]
fn short_or_odd_pictures_are_refused() {
    let data = [0u8; 11];
    assert_eq!(Grey::try_new(&data, Layout::packed(4, 3, 1, 8)).unwrap_err(), ImageError::TooShort);
    assert_eq!(Grey::try_new(&data, Layout::packed(0, 3, 1, 8)).unwrap_err(), ImageError::Size);
    assert_eq!(Grey::try_new(&data, Layout::packed(70_000, 1, 1, 8)).unwrap_err(), ImageError::Size);
    assert_eq!(Grey::try_new(&data, Layout::packed(3, 3, 1, 12)).unwrap_err(), ImageError::Bits);
    let l = Layout { width: 4, height: 2, stride: 3, channels: 1, bits: 8 };
    assert_eq!(Grey::try_new(&data, l).unwrap_err(), ImageError::Stride);
    // The last row need not be padded.
    let l = Layout { width: 1, height: 2, stride: 10, channels: 1, bits: 8 };
    assert!(Grey::try_new(&data, l).is_ok());
}
