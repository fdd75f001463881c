//! The order of elements.

/// The order of the elements of a mesh: the degree of the map from the reference tet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Order {
    /// Tets of four nodes with straight edges and plane faces.
    #[default]
    First,
    /// Tets of ten nodes: the corners, and one node on each edge. Edges are parabolas.
    Second,
}

impl Order {
    /// The order with this degree, if there is one.
    pub fn of_degree(degree: u32) -> Option<Self> {
        match degree {
            1 => Some(Self::First),
            2 => Some(Self::Second),
            _ => None,
        }
    }

    /// The degree: 1 or 2. The nodes cut an edge into this many pieces.
    pub fn degree(self) -> u32 {
        match self {
            Self::First => 1,
            Self::Second => 2,
        }
    }

    /// The number of nodes of a tet: 4 or 10.
    pub fn tet_nodes(self) -> usize {
        match self {
            Self::First => 4,
            Self::Second => 10,
        }
    }

    /// The number of nodes of a triangle: 3 or 6.
    pub fn triangle_nodes(self) -> usize {
        match self {
            Self::First => 3,
            Self::Second => 6,
        }
    }
}
