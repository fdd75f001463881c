//! NETGEN's mesh-size files.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::size(input));
