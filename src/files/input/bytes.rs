//! Parses binary data as numbers.

use super::{Fault, coordinate};
use crate::Point;

/// The rest of some binary data.
#[derive(Clone)]
pub(crate) struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

macro_rules! number {
    ($name:ident, $type:ty) => {
        #[doc = concat!("The next number, of type `", stringify!($type), "`.")]
        pub fn $name(&mut self, what: &str) -> Result<$type, Fault> {
            let bytes = self.array(what)?;
            Ok(if self.big_endian { <$type>::from_be_bytes(bytes) } else { <$type>::from_le_bytes(bytes) })
        }
    };
}

impl<'a> Bytes<'a> {
    /// The data from an offset on.
    pub fn new(bytes: &'a [u8], offset: usize, big_endian: bool) -> Self {
        Self { bytes, at: offset.min(bytes.len()), big_endian }
    }

    /// Sets the byte order.
    pub fn set_big_endian(&mut self, big_endian: bool) {
        self.big_endian = big_endian;
    }

    /// The offset of the next byte.
    pub fn offset(&self) -> usize {
        self.at
    }

    /// Continues at another offset.
    pub fn go_to(&mut self, offset: usize) {
        self.at = offset.min(self.bytes.len());
    }

    /// Number of bytes left.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// A fault at the next byte.
    pub fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::byte(self.at, message)
    }

    /// The next bytes.
    pub fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], Fault> {
        if count > self.left() {
            return Err(self.fault(format!("the file ends within {what}")));
        }
        let taken = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Fault> {
        Ok(self.take(N, what)?.try_into().expect("N bytes were taken"))
    }

    number!(u8, u8);
    number!(i8, i8);
    number!(u16, u16);
    number!(i16, i16);
    number!(u32, u32);
    number!(i32, i32);
    number!(u64, u64);
    number!(i64, i64);
    number!(f32, f32);
    number!(f64, f64);

    /// Reads a finite number of double precision.
    pub fn coordinate(&mut self) -> Result<f64, Fault> {
        let number = self.f64("a coordinate")?;
        self.finite(number, 8)
    }

    /// Reads three numbers of single precision as a point.
    pub fn point_f32(&mut self) -> Result<Point, Fault> {
        let mut point = [0.0; 3];
        for x in &mut point {
            let number = f64::from(self.f32("a coordinate")?);
            *x = self.finite(number, 4)?;
        }
        Ok(point.into())
    }

    /// Reads three numbers of double precision as a point.
    pub fn point_f64(&mut self) -> Result<Point, Fault> {
        Ok([self.coordinate()?, self.coordinate()?, self.coordinate()?].into())
    }

    /// Checks a number of `size` bytes that was just read.
    pub fn finite(&self, number: f64, size: usize) -> Result<f64, Fault> {
        coordinate(number).map_err(|message| Fault::byte(self.at - size, message))
    }

    /// Checks that the rest of the data can hold this many items of at least this size.
    pub fn count(&self, count: u64, what: &str, bytes_each: usize) -> Result<usize, Fault> {
        let room = (self.left() / bytes_each.max(1)) as u64;
        if count <= room {
            return Ok(count as usize);
        }
        Err(self.fault(format!(
            "{count} {what} are announced, and what is left of the file has room for {room} at most: \
             the number is wrong or the file is cut off"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_either_order_of_bytes() {
        let mut bytes = Bytes::new(&[0, 0, 1, 0, 1, 0], 2, false);
        assert_eq!(bytes.u16("n"), Ok(1));
        bytes.set_big_endian(true);
        assert_eq!(bytes.u16("n"), Ok(256));
        let error = bytes.u16("a number").unwrap_err();
        assert_eq!(error, Fault::byte(6, "the file ends within a number"));
    }

    #[test]
    fn a_nan_coordinate_is_refused_at_its_offset() {
        let bytes: Vec<u8> = [1.0, f32::NAN, 0.0].into_iter().flat_map(f32::to_le_bytes).collect();
        let error = Bytes::new(&bytes, 0, false).point_f32().unwrap_err();
        assert_eq!(error, Fault::byte(4, "a coordinate is not a finite number: NaN"));
    }

    #[test]
    fn a_count_beyond_what_is_left_is_refused() {
        let bytes = Bytes::new(&[0; 24], 0, false);
        assert_eq!(bytes.count(2, "points", 12), Ok(2));
        assert!(bytes.count(u64::MAX, "points", 12).is_err());
    }
}
