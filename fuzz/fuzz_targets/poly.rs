//! TetGen's `.poly`, with a `.node` beside.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::surface(&["a.poly", "a.node"], input));
