//! What has changed since it was last tried: changes of a part of the mesh need not try the rest
//! again, and what was tried in vain would be in vain again.

/// Times of changes and trials; a change is later than all trials before it.
#[derive(Default)]
pub(super) struct Changes {
    now: u64,
    /// When each vertex, or one of its triangles, changed last.
    changed: Vec<u64>,
    /// When a move of each vertex was last tried in vain.
    moves: Vec<u64>,
    /// When the last flips of all edges began.
    flips: u64,
    /// When the last collapses of all short edges began.
    collapses: u64,
    /// When each triangle was last compared with its facets, and whether it follows them.
    fits: Vec<(u64, bool)>,
}

impl Changes {
    /// All vertices are new.
    pub fn new(vertices: usize) -> Self {
        Self { now: 1, changed: vec![1; vertices], moves: vec![0; vertices], ..Self::default() }
    }

    pub fn add_vertex(&mut self) {
        self.now += 1;
        self.changed.push(self.now);
        self.moves.push(0);
    }

    /// Notes that a vertex, or one of its triangles, changes.
    pub fn change(&mut self, v: u32) {
        self.now += 1;
        self.changed[v as usize] = self.now;
    }

    /// Whether one of these vertices, or of their triangles, has changed since a time.
    pub fn is_since(&self, when: u64, v: &[u32]) -> bool {
        v.iter().any(|&v| self.changed[v as usize] > when)
    }

    /// Whether a move was tried in vain since the last change of the vertices of its triangles.
    pub fn is_move_in_vain(&self, v: u32, mut vertices: impl Iterator<Item = u32>) -> bool {
        let when = self.moves[v as usize];
        vertices.all(|w| self.changed[w as usize] <= when)
    }

    pub fn move_was_in_vain(&mut self, v: u32) {
        self.moves[v as usize] = self.now;
    }

    /// Whether the flip of an edge between these four vertices was tried in vain since their last
    /// change.
    pub fn is_flip_in_vain(&self, vertices: [u32; 4]) -> bool {
        !self.is_since(self.flips, &vertices)
    }

    /// Whether one of these vertices, or of their triangles, has changed since the flips of all
    /// edges were tried last.
    pub fn is_since_flips(&self, vertices: &[u32]) -> bool {
        self.is_since(self.flips, vertices)
    }

    /// Whether the collapse of an edge was tried in vain since the last change of these vertices,
    /// which are all those of the triangles at its ends.
    pub fn is_collapse_in_vain(&self, mut vertices: impl Iterator<Item = u32>) -> bool {
        vertices.all(|v| self.changed[v as usize] <= self.collapses)
    }

    pub fn now(&self) -> u64 {
        self.now
    }

    /// Notes that the flips of all edges were tried, from this time on.
    pub fn all_flips_since(&mut self, began: u64) {
        self.flips = began;
    }

    /// Notes that the collapses of all short edges were tried, from this time on.
    pub fn all_collapses_since(&mut self, began: u64) {
        self.collapses = began;
    }

    /// Whether a triangle follows its facets, if that is known.
    pub fn fit(&self, t: u32, vertices: [u32; 3]) -> Option<bool> {
        let &(when, fits) = self.fits.get(t as usize)?;
        (when > 0 && !self.is_since(when, &vertices)).then_some(fits)
    }

    pub fn set_fit(&mut self, t: u32, fits: bool) {
        let t = t as usize;
        if self.fits.len() <= t {
            self.fits.resize(t + 1, (0, false));
        }
        self.fits[t] = (self.now, fits);
    }
}
