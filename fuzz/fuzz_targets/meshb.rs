//! Medit, binary.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::volume(&["a.meshb"], input));
