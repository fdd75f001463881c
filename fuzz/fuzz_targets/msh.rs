//! Gmsh 2.x and 4.1, text and binary.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::volume(&["a.msh"], input));
