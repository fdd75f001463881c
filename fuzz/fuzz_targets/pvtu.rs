//! VTK's index file, with two pieces.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::volume(&["a.pvtu", "1.vtu", "2.vtu"], input));
