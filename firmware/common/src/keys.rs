//! The keys of telecommands: `key1.bin` and `key2.bin` of the host, and `counter1.bin` and `counter2.bin`.

use core::ffi::CStr;

use crate::host::File;

/// Reads the key at a place, from 0 on. Without a file all bytes are 0xFF, as in erased memory, which is no key.
pub fn read(place: u8, into: &mut [u8]) {
    into.fill(0xFF);
    if let Some(mut file) = File::open(if place == 0 { c"key1.bin" } else { c"key2.bin" }) {
        let _ = file.read(into);
    }
}

/// Reads the counter of the key at a place.
pub fn read_counter(place: u8) -> Option<u64> {
    let mut bytes = [0; 8];
    File::open(counter(place))?.read(&mut bytes).then(|| u64::from_be_bytes(bytes))
}

/// Writes the counter of the key at a place. Returns false if the host refuses.
pub fn write_counter(place: u8, counter_now: u64) -> bool {
    File::create(counter(place)).is_some_and(|mut file| file.write(&counter_now.to_be_bytes()))
}

fn counter(place: u8) -> &'static CStr {
    if place == 0 { c"counter1.bin" } else { c"counter2.bin" }
}
