//! Gives the input to one of the readers of the program: the first byte chooses.
#![no_main]

use libfuzzer_sys::fuzz_target;
use viewer::untrusted::READERS;

fuzz_target!(|data: &[u8]| {
    if let Some((choice, rest)) = data.split_first() {
        let (_, reader) = READERS[usize::from(*choice) % READERS.len()];
        reader(rest);
    }
});
