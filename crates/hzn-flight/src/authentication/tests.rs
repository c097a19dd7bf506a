use std::vec::Vec;

use super::*;

fn hmac(secret: &[u8], data: &[u8]) -> Vec<u8> {
    let mut code = <Hmac<Sha256> as KeyInit>::new_from_slice(secret).unwrap();
    code.update(data);
    code.finalize().into_bytes().to_vec()
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap()).collect()
}

/// RFC 4231, test cases 1 to 4, 6 and 7, and the truncated case 5.
#[test]
fn the_code_is_that_of_the_standard() {
    let long =
        b"This is a test using a larger than block-size key and a larger than block-size data. The key needs to \
                 be hashed before being used by the HMAC algorithm.";
    let fourth: Vec<u8> = (1..=25).collect();
    let cases: [(&[u8], &[u8], &str); 7] = [
        (&[0x0b; 20], b"Hi There", "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7"),
        (b"Jefe", b"what do ya want for nothing?", "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843"),
        (&[0xaa; 20], &[0xdd; 50], "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe"),
        (&fourth, &[0xcd; 50], "82558a389a443c0ea4cc819899f2083a85f0faa3e578f8077a2e3ff46729665b"),
        (&[0x0c; 20], b"Test With Truncation", "a3b6167473100ee06e0c796c2955552b"),
        (
            &[0xaa; 131],
            b"Test Using Larger Than Block-Size Key - Hash Key First",
            "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54",
        ),
        (&[0xaa; 131], long, "9b09ffa71b942fcb27635fbcd5b0e944bfdc63644f0713938a7f51535c3a35e2"),
    ];
    for (secret, data, expected) in cases {
        let expected = bytes(expected);
        assert_eq!(hmac(secret, data)[..expected.len()], expected);
    }
}

/// The layout, computed by hand from the documentation of the module.
#[test]
fn the_code_covers_all_that_the_documentation_names() {
    let key = Key { spacecraft: 0x0102_0304, number: 9, secret: *b"0123456789abcdef0123456789abcdef" };
    let mut user = [0; 3 + TRAILER_BYTES];
    user[..3].copy_from_slice(&[2, 0, 7]);
    assert_eq!(key.seal(ApidBase::DEFAULT, 0x1234, 0x1122_3344_5566_7788, 3, &mut user), Some(28));
    // Telecommand with a secondary header and the APID 0x1C0; unsegmented; 8 bytes of time, 28 of data, 2 of checksum.
    let header = [0x19, 0xC0, 0xD2, 0x34, 0, 8 + 28 + 2 - 1];
    let counter = [0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88];
    let covered = [&[1, 2, 3, 4, 1][..], &header, &[2, 0, 7, 9], &counter].concat();
    assert_eq!(user[3..12], [&[9][..], &counter].concat());
    assert_eq!(user[12..], hmac(&key.secret, &covered)[..16]);
    // The header is that of the packet.
    let mut packet = [0; packet::MAX_BYTES];
    packet::write(&mut packet, ApidBase::DEFAULT, Apid::Command, 0x1234, None, |w| w.bytes(&user)).unwrap();
    assert_eq!(packet[4..10], header);
}

#[test]
fn every_changed_bit_is_refused() {
    let key = Key { spacecraft: 1, number: 2, secret: [0xC3; 32] };
    let mut user = [7; 5 + TRAILER_BYTES];
    key.seal(ApidBase::DEFAULT, 8, 1, 5, &mut user).unwrap();
    // A code is long in Miri.
    for bit in (0..8 * user.len()).step_by(if cfg!(miri) { 19 } else { 1 }) {
        let mut changed = user;
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(!key.is_right(ApidBase::DEFAULT, 8, &changed), "{bit}");
    }
    let other = |spacecraft, secret| Key { spacecraft, secret, ..key.clone() };
    for other in [other(2, [0xC3; 32]), other(1, [0xC2; 32])] {
        assert!(!other.is_right(ApidBase::DEFAULT, 8, &user));
    }
    let swapped = ApidBase::try_new(0x200).unwrap();
    assert!(key.is_right(ApidBase::DEFAULT, 8, &user) && !key.is_right(swapped, 8, &user));
    // A telecommand with a trailer is no longer than a packet.
    let mut user = [0; packet::MAX_BYTES];
    let most = packet::MAX_BYTES - packet::OVERHEAD - TRAILER_BYTES;
    assert!(key.seal(ApidBase::DEFAULT, 8, 1, most, &mut user[..most + TRAILER_BYTES - 1]).is_none());
}

#[test]
fn a_stored_key_comes_back_and_a_damaged_one_does_not() {
    let key = Key { spacecraft: 77, number: 1, secret: core::array::from_fn(|i| i as u8) };
    let stored = key.to_bytes();
    assert_eq!(Key::from_bytes(&stored), Some(key.clone()));
    for bit in 0..8 * KEY_BYTES {
        let mut changed = stored;
        changed[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(Key::from_bytes(&changed), None, "{bit}");
    }
    assert_eq!([[0; KEY_BYTES], [0xFF; KEY_BYTES]].map(|erased| Key::from_bytes(&erased)), [None, None]);
    assert_eq!(std::format!("{key:?}"), "Key { spacecraft: 77, number: 1 }");
}
