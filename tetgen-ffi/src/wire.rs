//! Messages between a test and the worker, in little-endian bytes.
//!
//! A list is its length as `u64` and its numbers. An answer starts with [`MARK`], because TetGen
//! prints to the same pipe before it.

use crate::TetgenMesh;

/// Start of an answer.
pub const MARK: &[u8; 16] = b"\0tetgen answers\0";

/// Status of a worker built without TetGen. TetGen's own are small numbers.
pub const NO_TETGEN: i32 = i32::MIN;

/// Encodes a request: switches, coordinates, vertices of the facets.
pub fn request(points: &[[f64; 3]], facets: &[[u32; 3]], switches: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    put(&mut bytes, switches.len(), switches.bytes().map(|byte| [byte]));
    put(&mut bytes, 3 * points.len(), points.as_flattened().iter().map(|x| x.to_le_bytes()));
    put(&mut bytes, 3 * facets.len(), facets.as_flattened().iter().map(|v| v.to_le_bytes()));
    bytes
}

/// Decodes a request; `None` if it is truncated.
pub fn read_request(mut bytes: &[u8]) -> Option<(Vec<u8>, Vec<f64>, Vec<i32>)> {
    let switches = take(&mut bytes, |[byte]: [u8; 1]| byte)?;
    let coordinates = take(&mut bytes, f64::from_le_bytes)?;
    let vertices = take(&mut bytes, i32::from_le_bytes)?;
    Some((switches, coordinates, vertices))
}

/// Encodes an answer: a mesh, or the code that TetGen threw.
pub fn answer(result: &Result<TetgenMesh, i32>) -> Vec<u8> {
    let mut bytes = MARK.to_vec();
    match result {
        Err(code) => bytes.extend(code.to_le_bytes()),
        Ok(TetgenMesh { points, tets, regions }) => {
            bytes.extend(0i32.to_le_bytes());
            put(&mut bytes, 3 * points.len(), points.as_flattened().iter().map(|x| x.to_le_bytes()));
            put(&mut bytes, 4 * tets.len(), tets.as_flattened().iter().map(|v| v.to_le_bytes()));
            put(&mut bytes, regions.len(), regions.iter().map(|r| r.to_le_bytes()));
        }
    }
    bytes
}

/// Decodes TetGen's output and the answer; `None` if the answer is incomplete.
pub fn read_answer(bytes: &[u8]) -> Option<(String, Result<TetgenMesh, i32>)> {
    let at = bytes.windows(MARK.len()).position(|window| window == MARK)?;
    let printed = String::from_utf8_lossy(&bytes[..at]).trim().to_string();
    let (status, mut rest) = bytes[at + MARK.len()..].split_first_chunk()?;
    let status = i32::from_le_bytes(*status);
    if status != 0 {
        return Some((printed, Err(status)));
    }
    let points: Vec<f64> = take(&mut rest, f64::from_le_bytes)?;
    let tets: Vec<u32> = take(&mut rest, u32::from_le_bytes)?;
    let regions = take(&mut rest, i32::from_le_bytes)?;
    let (points, tets) = (points.as_chunks().0.to_vec(), tets.as_chunks().0.to_vec());
    Some((printed, Ok(TetgenMesh { points, tets, regions })))
}

fn put<const N: usize>(bytes: &mut Vec<u8>, length: usize, numbers: impl Iterator<Item = [u8; N]>) {
    bytes.extend((length as u64).to_le_bytes());
    numbers.for_each(|number| bytes.extend(number));
}

fn take<T, const N: usize>(bytes: &mut &[u8], number: impl Fn([u8; N]) -> T) -> Option<Vec<T>> {
    let (length, rest) = bytes.split_first_chunk()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?.checked_mul(N)?;
    let (numbers, rest) = rest.split_at_checked(length)?;
    *bytes = rest;
    Some(numbers.as_chunks().0.iter().map(|&chunk| number(chunk)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_found_behind_what_tetgen_says() {
        let mesh = TetgenMesh { points: vec![[0.1, -2.0, 3e9]], tets: vec![[3, 2, 1, 0]], regions: vec![-5] };
        let mut bytes = b"Warning: ...\n".to_vec();
        bytes.extend(answer(&Ok(mesh.clone())));
        assert_eq!(read_answer(&bytes), Some(("Warning: ...".into(), Ok(mesh))));
        assert_eq!(read_answer(&answer(&Err(3))), Some((String::new(), Err(3))));
    }

    #[test]
    fn what_is_cut_short_is_no_message() {
        let request = request(&[[1.0; 3]], &[[0; 3]], "pQ");
        assert!(read_request(&request).is_some());
        let answer = answer(&Ok(TetgenMesh { points: vec![[1.0; 3]], ..TetgenMesh::default() }));
        assert!(read_answer(&answer).is_some());
        assert!((0..request.len()).all(|end| read_request(&request[..end]).is_none()));
        assert!((0..answer.len()).all(|end| read_answer(&answer[..end]).is_none()));
    }
}
