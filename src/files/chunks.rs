//! Writes large files: many threads format chunks while the previous ones are written to disk.

use super::WriteError;
use super::output::Output;
use crate::ground::progress::Work;
use rayon::prelude::*;

/// The current chunk of each file.
pub type Chunk<const K: usize> = [Vec<u8>; K];

/// Appends to K files at once, chunk by chunk; `format` makes the text of a chunk for each file.
///
/// The result does not depend on the number of threads; of several errors that of the first chunk
/// is returned. Returns an error if `work` is cancelled.
pub fn write_chunks<const K: usize>(
    mut files: [&mut Output; K],
    chunks: usize,
    work: &Work,
    format: impl Fn(usize, &mut Chunk<K>) -> Result<(), WriteError> + Sync,
) -> Result<(), WriteError> {
    let batch = 2 * rayon::current_num_threads();
    let empty = || -> Vec<Chunk<K>> { (0..batch).map(|_| std::array::from_fn(|_| Vec::new())).collect() };
    let (mut making, mut writing) = (empty(), empty());
    // One extra batch, which only writes.
    for first in (0..chunks + batch).step_by(batch) {
        work.proceed()?;
        let make = || -> Vec<Result<(), WriteError>> {
            let make_one = |(k, texts): (usize, &mut Chunk<K>)| {
                texts.iter_mut().for_each(Vec::clear);
                if first + k < chunks { format(first + k, texts) } else { Ok(()) }
            };
            making.par_iter_mut().enumerate().map(make_one).collect()
        };
        let (written, made) = rayon::join(|| write(&mut files, &writing), make);
        written?;
        made.into_iter().collect::<Result<(), WriteError>>()?;
        std::mem::swap(&mut making, &mut writing);
    }
    Ok(())
}

fn write<const K: usize>(files: &mut [&mut Output; K], chunks: &[Chunk<K>]) -> Result<(), WriteError> {
    chunks
        .iter()
        .try_for_each(|texts| files.iter_mut().zip(texts).try_for_each(|(file, text)| file.write(text)))
}

/// Splits `items` (blocks, for example) with a total of `content` entities into chunks of about
/// `per_chunk` entities: returns the number of chunks, and the items of each but the last.
pub fn split(items: usize, content: u64, per_chunk: u64) -> (usize, usize) {
    let per_item = content.div_ceil(items.max(1) as u64).max(1);
    let items_per_chunk = (per_chunk / per_item).max(1) as usize;
    (items.div_ceil(items_per_chunk), items_per_chunk)
}

/// The items of a chunk.
pub fn items(chunk: usize, items_per_chunk: usize, items: usize) -> std::ops::Range<usize> {
    let start = chunk * items_per_chunk;
    start..items.min(start + items_per_chunk)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn chunks_keep_their_order_for_any_number_of_threads() {
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for chunks in [0, 1, 2, 5, 100] {
                let dir = tempfile::tempdir().unwrap();
                let path = dir.path().join("f");
                let mut file = Output::create(&path).unwrap();
                let format = |k: usize, [text]: &mut Chunk<1>| {
                    text.extend(format!("{k} ").bytes());
                    Ok(())
                };
                pool.install(|| write_chunks([&mut file], chunks, Work::unwatched(), format)).unwrap();
                let expected: String = (0..chunks).map(|k| format!("{k} ")).collect();
                assert_eq!(fs::read_to_string(&path).unwrap(), expected);
            }
        }
    }

    #[test]
    fn the_error_of_the_first_chunk_that_fails_counts() {
        let dir = tempfile::tempdir().unwrap();
        let mut file = Output::create(&dir.path().join("f")).unwrap();
        let format =
            |k: usize, _: &mut Chunk<1>| if k >= 3 { Err(WriteError::EmptyPart(k as u32)) } else { Ok(()) };
        let error = write_chunks([&mut file], 10, Work::unwatched(), format).unwrap_err();
        assert!(matches!(error, WriteError::EmptyPart(3)), "{error}");
    }

    #[test]
    fn each_item_is_in_one_chunk() {
        for (count, content) in [(0, 0), (1, 100), (7, 100), (100, 100), (100, 7), (3, 1_000_000)] {
            let (chunks, per_chunk) = split(count, content, 10);
            let all: Vec<usize> = (0..chunks).flat_map(|k| items(k, per_chunk, count)).collect();
            assert_eq!(all, (0..count).collect::<Vec<_>>());
            assert!((0..chunks).all(|k| !items(k, per_chunk, count).is_empty()));
        }
    }
}
