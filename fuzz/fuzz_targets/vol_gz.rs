//! NETGEN's `.vol.gz`.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| tetmill_fuzz::compressed_volume("a.vol.gz", input));
