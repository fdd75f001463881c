//! TetGen's `.node`, `.ele` and `.face`.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::volume(&["a.node", "a.ele", "a.face"], input));
