//! `stack_bound IMAGE...` prints the bound of the stack of each firmware image, and the functions of its deepest path.

use std::path::Path;
use std::process::ExitCode;

use hzn_tests::stack_bound::stack_bound;

fn main() -> ExitCode {
    for image in std::env::args().skip(1) {
        match stack_bound(Path::new(&image)) {
            Ok(bound) => {
                println!(
                    "{image}: at most {} bytes of stack, {} of them exceptions",
                    bound.bytes, bound.exception_bytes
                );
                for (function, bytes) in bound.path {
                    println!("{bytes:>8}  {function}");
                }
            }
            Err(why) => {
                eprintln!("error: {image}: {why}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}
