//! The receiver reads the slices in the order in which the sender wrote them. Types are not
//! encoded, so the two functions of a pair are kept next to each other.
//!
//! Small numbers, such as differences of ascending ids, may be encoded as **varints** (LEB128):
//! seven bits per byte, the lowest first; the eighth bit is set if more follow.

use bytemuck::{Pod, cast_slice, cast_slice_mut};

/// Appends `values` to the message.
pub fn put<T: Pod>(message: &mut Vec<u8>, values: &[T]) {
    let bytes: &[u8] = cast_slice(values);
    message.reserve(size_of::<u64>() + bytes.len());
    message.extend_from_slice(bytemuck::bytes_of(&(values.len() as u64)));
    message.extend_from_slice(bytes);
}

/// The numbers whose bytes these are.
///
/// # Panics
/// If the bytes are not those of a whole count of them.
pub fn numbers<T: Pod>(bytes: &[u8]) -> Vec<T> {
    let mut values = vec![T::zeroed(); bytes.len() / size_of::<T>()];
    cast_slice_mut(&mut values).copy_from_slice(bytes);
    values
}

/// Takes the next slice from the front of the message.
///
/// # Panics
/// If the message ends before it: sender and receiver do not agree on what is sent.
pub fn take<T: Pod>(message: &mut &[u8]) -> Vec<T> {
    let (length, rest) = message.split_at(size_of::<u64>());
    let length: u64 = bytemuck::pod_read_unaligned(length);
    let (values, rest) = rest.split_at(length as usize * size_of::<T>());
    *message = rest;
    numbers(values)
}

/// Appends a number as a varint: one byte below 128, two below 16384, ten at most.
#[inline]
pub fn put_varint(message: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        message.push(value as u8 | 0x80);
        value >>= 7;
    }
    message.push(value as u8);
}

/// Takes the next varint from the front of the message.
///
/// # Panics
/// If the message ends within it: sender and receiver do not agree on what is sent.
#[inline]
pub fn take_varint(message: &mut &[u8]) -> u64 {
    let mut value = 0;
    for (place, byte) in message.iter().enumerate() {
        value |= u64::from(byte & 0x7f) << (7 * place);
        if *byte < 0x80 {
            *message = &message[place + 1..];
            return value;
        }
    }
    panic!("a message ends within a number");
}

/// Appends ascending numbers (equal ones allowed) as varints of their differences, the first
/// relative to 0.
pub fn put_ascending(message: &mut Vec<u8>, values: impl IntoIterator<Item = u64>) {
    let mut previous = 0;
    for value in values {
        put_varint(message, value - previous);
        previous = value;
    }
}

/// Takes `count` numbers that [`put_ascending`] put.
///
/// # Panics
/// As [`take_varint`].
pub fn take_ascending(message: &mut &[u8], count: usize) -> impl Iterator<Item = u64> {
    let mut previous = 0;
    (0..count).map(move |_| {
        previous += take_varint(message);
        previous
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_come_out_as_they_went_in() {
        let mut message = Vec::new();
        put(&mut message, &[7u8]);
        put(&mut message, &[1.5f64, -0.0]);
        put::<u32>(&mut message, &[]);
        put(&mut message, &[[1u64, 2], [3, u64::MAX]]);
        let mut rest = &message[..];
        assert_eq!(take::<u8>(&mut rest), [7]);
        let floats = take::<f64>(&mut rest);
        assert_eq!((floats[0], floats[1].to_bits()), (1.5, (-0.0f64).to_bits()));
        assert!(take::<u32>(&mut rest).is_empty());
        assert_eq!(take::<[u64; 2]>(&mut rest), [[1, 2], [3, u64::MAX]]);
        assert!(rest.is_empty());
    }

    #[test]
    fn varints_come_out_as_they_went_in_and_small_ones_are_short() {
        let mut message = Vec::new();
        let values = [0, 1, 127, 128, 16_383, 16_384, u64::MAX];
        values.into_iter().for_each(|value| put_varint(&mut message, value));
        assert_eq!(message.len(), 1 + 1 + 1 + 2 + 2 + 3 + 10);
        put_ascending(&mut message, [5, 5, 9]);
        let mut rest = &message[..];
        assert!(values.into_iter().all(|value| take_varint(&mut rest) == value));
        assert_eq!(take_ascending(&mut rest, 3).collect::<Vec<_>>(), [5, 5, 9]);
        assert!(rest.is_empty());
    }
}
