//! The functions that JavaScript calls. The page writes a request into the memory of the module, and reads the answer
//! from there. No function reads through a pointer: only addresses leave the module.
#![allow(unsafe_code, reason = "a function with a name for JavaScript counts as unsafe; there is no unsafe block")]
#![allow(unreachable_pub, reason = "they are reached by name")]

use std::cell::RefCell;

thread_local! {
    static REQUEST: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static ANSWER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Makes room for a request of this number of bytes, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_request(bytes: usize) -> *mut u8 {
    REQUEST.with_borrow_mut(|request| {
        *request = vec![0; bytes];
        request.as_mut_ptr()
    })
}

/// Answers the request, and returns the number of bytes of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_call() -> usize {
    let answer = crate::answer(&REQUEST.take());
    ANSWER.with_borrow_mut(|place| {
        *place = answer;
        place.len()
    })
}

/// Returns the address of the answer. It is valid until the next request.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_answer() -> *const u8 {
    ANSWER.with_borrow(|answer| answer.as_ptr())
}
