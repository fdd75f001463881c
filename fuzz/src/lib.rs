//! Common parts of the fuzz targets: each reads arbitrary bytes as files of one format.
//!
//! A target fails on a panic, an input that takes longer than `-timeout`, or memory out of
//! proportion to the input.

use flate2::{Compression, write::GzEncoder};
use std::alloc::{GlobalAlloc, Layout, System};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use tetmill::files::{elmer, mesh_size, surface, volume};

/// Bytes that a reader may hold at once for inputs of a few kilobytes, which these targets get.
const MOST_BYTES: usize = 64 << 20;

/// The system's allocator, which ends the process if more than [`MOST_BYTES`] are held at once.
///
/// libFuzzer's own `-malloc_limit_mb` needs a sanitizer, and its `-rss_limit_mb` does not count
/// memory that is reserved and never used.
struct Limited;

#[global_allocator]
static ALLOCATOR: Limited = Limited;

static HELD: AtomicUsize = AtomicUsize::new(0);

// SAFETY: all requests are passed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Limited {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(place, layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.realloc(place, layout, size) }
    }
}

fn count(size: usize) {
    let held = HELD.fetch_add(size, Ordering::Relaxed).saturating_add(size);
    if size > MOST_BYTES || held > MOST_BYTES {
        // Count no further: the message needs memory itself.
        HELD.store(0, Ordering::Relaxed);
        panic!("{size} bytes are requested, {held} held in all");
    }
}

/// A folder of this process, in memory if the system has such a file system.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let parent = if memory.is_dir() { memory.to_path_buf() } else { std::env::temp_dir() };
    let folder = parent.join(format!("tetmill-fuzz-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for the inputs");
    folder
});

/// Separates the files of a format of several files.
const BETWEEN: &[u8] = b"\n%%%%\n";

/// Writes the input into files of these names. If it has fewer files the last ones are missing, and
/// what follows the last separator is part of the last file.
fn write(names: &[&str], input: &[u8]) {
    let mut rest = Some(input);
    for (k, name) in names.iter().enumerate() {
        let path = FOLDER.join(name);
        let Some(content) = rest else {
            let _ = fs::remove_file(path);
            continue;
        };
        let end = content.windows(BETWEEN.len()).position(|window| window == BETWEEN);
        let end = end.filter(|_| k + 1 < names.len());
        rest = end.map(|end| &content[end + BETWEEN.len()..]);
        fs::write(path, &content[..end.unwrap_or(content.len())]).expect("a file for the input");
    }
}

/// Reads the input as a surface: the file is the first of these names.
pub fn surface(names: &[&str], input: &[u8]) {
    write(names, input);
    let Ok(surface) = surface::read(&FOLDER.join(names[0])) else { return };
    assert_eq!(surface.triangles.len(), surface.group.len());
    assert_eq!(surface.groups.len(), surface.group_numbers.len());
    assert!(surface.group.iter().all(|&group| (group as usize) < surface.groups.len()));
    let count = surface.points.len();
    assert!(surface.triangles.iter().flatten().all(|&vertex| (vertex as usize) < count));
    assert!(surface.triangles.iter().all(|[a, b, c]| a != b && b != c && c != a));
    let points = surface.points.iter().chain(&surface.loose_points);
    assert!(points.flat_map(|point| point.iter()).all(|x| x.is_finite()));
}

/// Reads the input as a mesh: the file is the first of these names.
pub fn volume(names: &[&str], input: &[u8]) {
    write(names, input);
    check_volume(&FOLDER.join(names[0]));
}

fn check_volume(path: &Path) {
    let Ok(read) = volume::read(path) else { return };
    let mesh = &read.mesh;
    assert!(!mesh.tets.is_empty(), "a mesh without tets");
    assert_eq!(mesh.tets.len(), mesh.bodies.len());
    let corners = mesh.tets.iter().flatten().chain(mesh.triangles.iter().flat_map(|t| &t.vertices));
    assert!(corners.into_iter().all(|vertex| vertex.index() < mesh.points.len()));
    assert!(mesh.points.iter().flat_map(|point| point.iter()).all(|x| x.is_finite()));
    assert!(read.edge_points.is_empty() || read.edge_points.len() == mesh.tets.len());
    assert!(read.edge_points.iter().flatten().flatten().all(|x| x.is_finite()));
    assert!(mesh.bodies.iter().all(|body| body.index() < read.names.bodies.len()));
    assert!(mesh.triangles.iter().all(|triangle| triangle.patch.index() < read.names.patches.len()));
}

/// Reads the input as a compressed mesh. The first byte selects what is compressed: nothing, because
/// the input is the file; all of it; or all of it, with damage to one byte behind that (its place in
/// two bytes, and the bits to invert).
pub fn compressed_volume(name: &str, input: &[u8]) {
    let path = FOLDER.join(name);
    let bytes = match input {
        [0, file @ ..] => file.to_vec(),
        [1, high, low, bits, text @ ..] => {
            let mut bytes = compressed(text);
            let at = (usize::from(*high) << 8 | usize::from(*low)) % bytes.len();
            bytes[at] ^= bits;
            // Some of the files are cut off instead.
            if *bits == 0 {
                bytes.truncate(at);
            }
            bytes
        }
        [_, text @ ..] => compressed(text),
        [] => return,
    };
    fs::write(&path, bytes).expect("a file for the input");
    check_volume(&path);
}

fn compressed(text: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(text).expect("memory can be written to");
    encoder.finish().expect("memory can be written to")
}

/// Reads the input as the files of an Elmer mesh, serial and of one part, and checks it.
pub fn elmer(input: &[u8]) {
    const SERIAL: [&str; 6] =
        ["mesh.header", "mesh.nodes", "mesh.elements", "mesh.boundary", "mesh.names", "mesh.periodic"];
    const PART: [&str; 6] = [
        "part.1.header",
        "part.1.nodes",
        "part.1.elements",
        "part.1.boundary",
        "part.1.shared",
        "mesh.periodic",
    ];
    // The first byte selects the layout.
    let Some((first, input)) = input.split_first() else { return };
    let (names, others) = if first & 1 == 0 { (SERIAL, PART) } else { (PART, SERIAL) };
    others.iter().for_each(|name| drop(fs::remove_file(FOLDER.join(name))));
    write(&names, input);
    check_volume(&FOLDER);
    let _ = elmer::check_elmer(&FOLDER);
}

/// Reads the input as a mesh-size file.
pub fn size(input: &[u8]) {
    write(&["a.msz"], input);
    let Ok(sources) = mesh_size::read(&FOLDER.join("a.msz")) else { return };
    let is_finite = |x: f64| x.is_finite();
    assert!(sources.iter().all(|source| source.point.iter().all(|&x| is_finite(x)) && source.size > 0.0));
}
