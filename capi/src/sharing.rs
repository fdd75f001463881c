//! Vertices that are shared with other parts.

use crate::fault::{Fault, Status, guard};
use crate::geometry::out_of_range;
use crate::group::{on_ranks, own};
use crate::mesh::Mesh;
use crate::part::Part;
use crate::pointers::{array, array_mut, given, store, store_array};
use std::sync::{Mutex, PoisonError};
use tetmill::mesh::{MeshStream, Sharing};

/// The shared vertices of a part as plain arrays.
pub struct SharingArrays {
    pub sharing: Sharing,
    /// The owner of each vertex of the part.
    owners: Vec<u32>,
    /// The start of the ranks of each shared vertex, and the end of the last.
    offsets: Vec<u64>,
    ranks: Vec<u32>,
    /// The ranks that this one shares vertices with.
    neighbours: Vec<u32>,
}

impl SharingArrays {
    pub fn of(part: &dyn MeshStream) -> Self {
        let sharing = Sharing::of(part);
        let mut owners = vec![part.rank(); part.counts().vertices as usize];
        let (mut offsets, mut ranks) = (vec![0], Vec::new());
        for &vertex in sharing.vertices() {
            owners[vertex as usize] = sharing.owner(vertex);
            ranks.extend_from_slice(sharing.holders(vertex));
            offsets.push(ranks.len() as u64);
        }
        let neighbours = sharing.neighbours().iter().map(|neighbour| neighbour.rank).collect();
        Self { sharing, owners, offsets, ranks, neighbours }
    }
}

/// The rank that owns each vertex: one of the ranks that share it.
///
/// All of them know the owner. Sums over the whole mesh count a vertex on its owner only.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_owners(
    part: Option<&Part>,
    ranks: *mut *const u32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.sharing().owners, ranks, count, "ranks") })
}

/// The shared vertices, and the ranks that share each of them, this one included.
///
/// Vertex `vertices[k]`, a local index, is shared by the ranks `ranks[offsets[k]]` to
/// `ranks[offsets[k + 1] - 1]`, ascending, for k from 0 to `count - 1`. Vertices ascend.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_sharing(
    part: Option<&Part>,
    vertices: *mut *const u32,
    offsets: *mut *const u64,
    ranks: *mut *const u32,
    count: *mut usize,
) -> Status {
    guard(|| {
        let arrays = given(part, "part")?.sharing();
        // SAFETY: the contract of the header.
        unsafe {
            store(offsets, arrays.offsets.as_ptr(), "offsets")?;
            store(ranks, arrays.ranks.as_ptr(), "ranks")?;
            store_array(arrays.sharing.vertices(), vertices, count, "vertices")
        }
    })
}

/// The ranks that this part shares vertices with, ascending.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_neighbours(
    part: Option<&Part>,
    ranks: *mut *const u32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.sharing().neighbours, ranks, count, "ranks") })
}

/// The vertices shared with a neighbour, by its index in tetmill_part_neighbours: local indices, in
/// the same order on both ranks.
///
/// So values of these vertices can be sent without ids.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_neighbour_vertices(
    part: Option<&Part>,
    neighbour: usize,
    vertices: *mut *const u32,
    count: *mut usize,
) -> Status {
    guard(|| {
        let all = given(part, "part")?.sharing().sharing.neighbours();
        let found = all.get(neighbour).ok_or_else(|| out_of_range("neighbour", neighbour, all.len()))?;
        // SAFETY: the contract of the header.
        unsafe { store_array(&found.vertices, vertices, count, "vertices") }
    })
}

/// *Collective.* Replaces the value of each shared vertex by the sum of the values on its ranks:
/// assembles what tets of several parts contribute.
///
/// `values[k]` has one value for each vertex of part k of this process, shared or not. Sums are
/// added in rank order, so all copies get the same bits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_sum(mesh: Option<&Mesh>, values: *const *mut f64) -> Status {
    guard(|| {
        let Mesh { parts, group, .. } = given(mesh, "mesh")?;
        // SAFETY: the contract of the header.
        let values = unsafe { of_parts(parts, values) }?;
        on_ranks(group, |comm| {
            let part = own(parts, comm.rank(), Part::rank);
            let mut values = own_values(parts, &values, comm.rank());
            Ok(part.sharing().sharing.sum(comm, &mut values)?)
        })?;
        Ok(())
    })
}

/// *Collective.* Sets the flag of each shared vertex to 1 on all its ranks if it is not 0 on any.
///
/// A part may have a vertex on a boundary without a triangle there. `flags[k]` has one flag for
/// each vertex of part k of this process, shared or not.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_any(mesh: Option<&Mesh>, flags: *const *mut u8) -> Status {
    guard(|| {
        let Mesh { parts, group, .. } = given(mesh, "mesh")?;
        // SAFETY: the contract of the header.
        let flags = unsafe { of_parts(parts, flags) }?;
        on_ranks(group, |comm| {
            let part = own(parts, comm.rank(), Part::rank);
            let mut flags = own_values(parts, &flags, comm.rank());
            let mut bools: Vec<bool> = flags.iter().map(|&flag| flag != 0).collect();
            part.sharing().sharing.any(comm, &mut bools)?;
            flags.iter_mut().zip(bools).for_each(|(flag, any)| *flag = u8::from(any));
            Ok(())
        })?;
        Ok(())
    })
}

/// The arrays of the parts of this process; each is used by its rank only.
type OfParts<'a, T> = Vec<Mutex<&'a mut [T]>>;

/// # Safety
/// `values` points to a pointer for each part, each to a value for each vertex, that nobody else
/// uses during `'a`.
unsafe fn of_parts<'a, T>(parts: &[Part], values: *const *mut T) -> Result<OfParts<'a, T>, Fault> {
    // SAFETY: the caller's promise.
    let pointers = unsafe { array(values, parts.len(), "values") }?;
    let mut sorted = pointers.to_vec();
    sorted.sort_unstable();
    if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(Fault::usage("two parts have the same array of values: each needs its own"));
    }
    let parts = parts.iter().zip(pointers);
    // SAFETY: the caller's promise; the arrays are different ones.
    parts
        .map(|(part, &pointer)| Ok(Mutex::new(unsafe { array_mut(pointer, part.vertex_count(), "values")? })))
        .collect()
}

fn own_values<'a, 'b, T>(
    parts: &[Part],
    values: &'a OfParts<'b, T>,
    rank: u32,
) -> std::sync::MutexGuard<'a, &'b mut [T]> {
    let place = (rank - parts[0].rank()) as usize;
    values[place].lock().unwrap_or_else(PoisonError::into_inner)
}
