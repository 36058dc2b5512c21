//! Changes to the state of a rendering that goes on.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    viewer::untrusted::state(data);
});
