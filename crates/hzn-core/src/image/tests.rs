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

#[test]
fn every_small_layout_is_read_as_its_definition_says() {
    let data: [u8; 30] = core::array::from_fn(|i| (i * 83 % 251) as u8);
    let mut accepted = 0;
    for (width, height, channels) in
        (0..4u32).flat_map(|w| (0..4u32).flat_map(move |h| (0..5u8).map(move |c| (w, h, c))))
    {
        for (stride, length, bits) in
            (0..12usize).flat_map(|s| (0..=data.len()).flat_map(move |n| [7, 8, 9].map(move |b| (s, n, b))))
        {
            let layout = Layout { width, height, stride, channels, bits };
            let (w, h, c) = (width as usize, height as usize, usize::from(channels));
            let data = &data[..length];
            let fits = w > 0 && h > 0 && c > 0 && bits == 8 && stride >= w * c && length >= (h - 1) * stride + w * c;
            let view = ImageView::from_bytes(data, layout, Channel::Mean);
            assert_eq!(view.is_ok(), fits, "{layout:?}, {length} bytes");
            let Ok(view) = view else { continue };
            accepted += 1;
            for (x, y) in (0..width as u16).flat_map(|x| (0..height as u16).map(move |y| (x, y))) {
                let place = usize::from(y) * stride + usize::from(x) * c;
                let pixel = &data[place..place + c];
                // Grey and grey with transparency have one colour.
                let colours = if c < 3 { &pixel[..1] } else { &pixel[..3] };
                let mean = colours.iter().map(|&v| u16::from(v)).sum::<u16>() / colours.len() as u16;
                assert_eq!(view.at(x, y), mean, "{layout:?} at ({x}, {y})");
            }
            // Beyond the end there is nothing, and no panic.
            assert_eq!([0, 1, 1000].map(|k| view.read(length + k)), [0; 3]);
        }
    }
    assert!(accepted > 1000, "{accepted} layouts were accepted");
}
