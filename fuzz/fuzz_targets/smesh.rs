//! TetGen's `.smesh`, with a `.node` beside.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::surface(&["a.smesh", "a.node"], input));
