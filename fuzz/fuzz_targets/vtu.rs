//! VTK, with a boundary file beside.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::volume(&["a.vtu", "a.boundary.vtu"], input));
