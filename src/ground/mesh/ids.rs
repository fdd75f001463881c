//! Ids as types: local ids are `u32`, global ids `u64`.

macro_rules! local_id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The id as an index.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// The id of the entity at `index`.
            ///
            /// # Panics
            /// If `index` exceeds `u32::MAX`; callers check their counts first.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("a local id beyond 2^32"))
            }
        }
    };
}

local_id!(
    /// A vertex of one part.
    VertexId
);
local_id!(
    /// An edge of one part.
    EdgeId
);
local_id!(
    /// A face of one part.
    FaceId
);
local_id!(
    /// A tet of one part.
    TetId
);

/// An id that is the same on every rank.
pub type GlobalId = u64;
