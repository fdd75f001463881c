//! Geomview's OFF.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::surface(&["a.off"], input));
