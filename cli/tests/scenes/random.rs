//! Random numbers with few digits, as in hand-written files.

/// The generator of Steele, Lea and Flood (2014), Fast splittable pseudorandom number generators,
/// section 4.
pub struct Random(u64);

impl Random {
    /// Starts the sequence of a seed.
    pub fn new(seed: u64) -> Self {
        // One step ahead, so that the sequences of neighbouring seeds differ.
        Self(Self(seed).next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number from 0 to `count` - 1.
    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number with four decimals in a range.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        ((low + (high - low) * self.unit()) * 1e4).round() / 1e4
    }
}

/// The van der Corput sequence in a base; three bases give Halton's points (Halton 1960).
pub fn van_der_corput(mut index: u64, base: u64) -> f64 {
    let (mut value, mut part) = (0.0, 1.0 / base as f64);
    while index > 0 {
        value += part * (index % base) as f64;
        index /= base;
        part /= base as f64;
    }
    value
}
