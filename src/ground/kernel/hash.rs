//! A fast hash of a few numbers from trusted sources.

use std::hash::{BuildHasherDefault, Hasher};

/// The hasher for maps keyed by vertex numbers or positions.
pub(crate) type WordHash = BuildHasherDefault<WordHasher>;

/// A hasher that mixes a few words.
///
/// It is much faster than the standard hasher, which also resists keys chosen to collide.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WordHasher(u64);

impl Hasher for WordHasher {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 29)
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.0 = (self.0.rotate_left(23) ^ u64::from_le_bytes(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
    }

    fn write_usize(&mut self, _: usize) {
        // Only lengths of arrays arrive here, which are the same for all keys.
    }
}
