//! Arguments with a grammar of their own.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    viewer::untrusted::arguments(data);
});
