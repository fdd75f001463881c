//! Fast formatting of numbers as text.

use std::io::Write;

/// Length of the longest text of [`Line::float`]: sign, 17 digits, point, `e-308`.
pub const FLOAT_CHARS: usize = 24;

/// Two decimal digits of each number below 100.
const PAIRS: [[u8; 2]; 100] = {
    let mut pairs = [[0; 2]; 100];
    let mut k = 0;
    while k < 100 {
        pairs[k] = [b'0' + (k / 10) as u8, b'0' + (k % 10) as u8];
        k += 1;
    }
    pairs
};

/// A line under construction, of at most a few dozen numbers.
pub struct Line {
    text: [u8; Self::CAPACITY],
    len: usize,
}

impl Default for Line {
    fn default() -> Self {
        Self { text: [0; Self::CAPACITY], len: 0 }
    }
}

impl Line {
    /// Capacity for 24 numbers of any length.
    const CAPACITY: usize = 24 * (FLOAT_CHARS + 1);

    /// Appends a number.
    #[inline]
    pub fn int(&mut self, mut number: u64) -> &mut Self {
        let mut digits = [0; 20];
        let mut at = digits.len();
        while number >= 100 {
            at -= 2;
            digits[at..at + 2].copy_from_slice(&PAIRS[(number % 100) as usize]);
            number /= 100;
        }
        if number >= 10 {
            at -= 2;
            digits[at..at + 2].copy_from_slice(&PAIRS[number as usize]);
        } else {
            at -= 1;
            digits[at] = b'0' + number as u8;
        }
        self.bytes(&digits[at..])
    }

    /// Appends a number in the fewest digits that read back bitwise equal: `0.1`, `12`, `1e-7`.
    #[inline]
    pub fn float(&mut self, number: f64) -> &mut Self {
        // Outside these magnitudes plain digits are longer than the exponent form.
        let plain = number == 0.0 || (1e-5..1e16).contains(&number.abs());
        let mut rest = &mut self.text[self.len..];
        let room = rest.len();
        let done = if plain { write!(rest, "{number}") } else { write!(rest, "{number:e}") };
        done.expect("a line has room for its numbers");
        self.len += room - rest.len();
        self
    }

    /// Appends a number like [`float`](Self::float), but rounded to as many digits as fit into
    /// `most` characters if the shortest text is longer.
    pub fn float_within(&mut self, number: f64, most: usize) -> &mut Self {
        let begin = self.len;
        self.float(number);
        if self.len - begin > most {
            let rounded = |digits: usize| format!("{number:.digits$e}");
            if let Some(text) = (0..16).rev().map(rounded).find(|text| text.len() <= most) {
                self.len = begin;
                self.bytes(text.as_bytes());
            }
        }
        self
    }

    /// Appends text.
    #[inline]
    pub fn bytes(&mut self, text: &[u8]) -> &mut Self {
        self.text[self.len..self.len + text.len()].copy_from_slice(text);
        self.len += text.len();
        self
    }

    /// Appends a blank.
    #[inline]
    pub fn blank(&mut self) -> &mut Self {
        self.bytes(b" ")
    }

    /// Ends the line, appends it to `text` and clears it.
    #[inline]
    pub fn end(&mut self, text: &mut Vec<u8>) {
        self.bytes(b"\n").move_to(text);
    }

    /// Appends the line so far to `text` and clears it.
    #[inline]
    pub fn move_to(&mut self, text: &mut Vec<u8>) {
        text.extend_from_slice(&self.text[..self.len]);
        self.len = 0;
    }
}

/// The number of decimal digits.
pub fn digits(number: u64) -> usize {
    number.checked_ilog10().unwrap_or(0) as usize + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn int_text(number: u64) -> String {
        let mut text = Vec::new();
        Line::default().int(number).end(&mut text);
        String::from_utf8(text).unwrap().trim_end().to_string()
    }

    fn float_text(number: f64) -> String {
        let mut text = Vec::new();
        Line::default().float(number).end(&mut text);
        String::from_utf8(text).unwrap().trim_end().to_string()
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            rng_seed: proptest::test_runner::RngSeed::Fixed(1),
            failure_persistence: None,
            ..Default::default()
        })]

        #[test]
        fn a_whole_number_is_written_as_the_standard_library_does(number: u64, shift in 0_u32..64) {
            let number = number >> shift;
            prop_assert_eq!(int_text(number), number.to_string());
            prop_assert_eq!(digits(number), number.to_string().len());
        }

        #[test]
        fn a_float_reads_back_to_the_same_bits(number in any::<f64>()) {
            let text = float_text(number);
            prop_assert!(text.len() <= FLOAT_CHARS, "{}", text);
            prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), number.to_bits());
        }
    }

    #[test]
    fn floats_are_short() {
        let texts = [0.0, 0.1, -12.0, 1e-7, 123456.75, 1e15, 1e22].map(float_text);
        assert_eq!(texts, ["0", "0.1", "-12", "1e-7", "123456.75", "1000000000000000", "1e22"]);
    }
}
