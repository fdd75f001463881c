//! Elmer's files, serial and of a part.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::elmer(input));
