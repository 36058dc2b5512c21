//! Scripts of the window.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    viewer::untrusted::script(data);
});
