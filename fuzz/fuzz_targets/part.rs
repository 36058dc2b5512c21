//! States of renderings, their checksum put right.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    viewer::untrusted::part(data);
});
