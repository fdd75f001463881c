//! Several slices of plain numbers in one message.
//!
//! ```text
//! length of a (u64) | bytes of a | length of b (u64) | bytes of b | ...
//! ```
//! The receiver takes them in the order in which the sender put them. Nothing says their types:
//! the two functions of a pair stand beside each other.

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
}
