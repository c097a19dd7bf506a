//! Flips every bit of a sensor and of its expected limb in memory. The flight software compares both with their copies
//! before and after every picture, so a flip that the comparison sees reaches no answer.

use hzn_core::{Config, Prior, Sensor, camera};
use hzn_twice::KeptTwice;

/// Flips a bit of a value in memory, as radiation does.
fn flip<T>(value: &mut T, bit: usize) {
    assert!(bit < 8 * size_of::<T>());
    let byte = (&raw mut *value).cast::<u8>().wrapping_add(bit / 8);
    // SAFETY: the byte lies within the value. Until the bit is flipped back, only its bytes are read.
    unsafe { byte.write_volatile(byte.read_volatile() ^ 1 << (bit % 8)) };
}

/// Flips every bit once. Returns how many flips the comparison sees, and how many bits there are.
fn count_seen<T>(value: T) -> (usize, usize) {
    let mut kept = Box::new(KeptTwice::new(value));
    kept.complete();
    let bits = 8 * size_of::<T>();
    let seen = (0..bits).filter(|&bit| {
        flip(kept.value_mut(), bit);
        let is_seen = !kept.is_intact();
        flip(kept.value_mut(), bit);
        is_seen
    });
    let seen = seen.count();
    assert!(kept.is_intact());
    (seen, bits)
}

#[test]
#[cfg_attr(miri, ignore = "a sensor has unused bytes, and this program has no barrier under Miri")]
fn every_flipped_bit_is_seen() {
    let mut config = Config::new(camera::Config::ideal(camera::Model::Pinhole, 160, 120, 150.0));
    config.body.altitude_km = Some(230.0);
    let sensor = Sensor::<f32>::new(&config).unwrap();
    let expected = sensor.expect(&Prior::default()).unwrap();
    for (name, (seen, bits)) in [("sensor", count_seen(sensor)), ("expected limb", count_seen(expected))] {
        println!("{name}: {seen} of {bits} flipped bits are seen");
        assert_eq!(seen, bits, "{name}");
    }
}
