//! The keywords of the language, and suggestions for misspelled words.

/// Keywords that begin a statement.
pub(super) const STATEMENTS: [&str; 11] = [
    "solid",
    "tlo",
    "curve2d",
    "curve3d",
    "boundingbox",
    "point",
    "identify",
    "singular",
    "boundarycondition",
    "boundaryconditionname",
    "define",
];

/// Keywords of solids with arguments.
pub(super) const PRIMITIVES: [&str; 16] = [
    "plane",
    "sphere",
    "cylinder",
    "cone",
    "ellipticcylinder",
    "ellipticcone",
    "ellipsoid",
    "orthobrick",
    "torus",
    "polyhedron",
    "extrusion",
    "revolution",
    "translate",
    "rotate",
    "multitranslate",
    "multirotate",
];

/// The other keywords. NETGEN reserves `tube` and `gencyl` without a meaning.
const OTHERS: [&str; 12] = [
    "algebraic3d",
    "or",
    "and",
    "not",
    "edge",
    "face",
    "closesurfaces",
    "closeedges",
    "periodic",
    "constant",
    "tube",
    "gencyl",
];

/// Whether `word` is a keyword and cannot be a name.
pub(super) fn is_reserved(word: &str) -> bool {
    STATEMENTS.contains(&word) || PRIMITIVES.contains(&word) || OTHERS.contains(&word)
}

/// Whether `word` is a keyword that begins a statement.
pub(super) fn begins_statement(word: &str) -> bool {
    STATEMENTS.contains(&word)
}

/// A help line with the nearest of `candidates`, or an empty string if none is near.
///
/// ```
/// use csg::language::did_you_mean;
/// assert_eq!(did_you_mean("wal", ["inlet", "wall"]), "did you mean `wall`?");
/// assert_eq!(did_you_mean("outlet", ["wall"]), "");
/// ```
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    // Up to a third of the letters may differ (at least one): `spere` suggests `sphere`, but `box`
    // does not suggest `cone`.
    let allowed = (word.chars().count() / 3).max(1);
    let distance = |candidate: &&str| edits(&word.to_lowercase(), &candidate.to_lowercase());
    let nearest = candidates.into_iter().map(|c| (distance(&c), c)).min();
    match nearest {
        Some((edits, candidate)) if edits <= allowed => format!("did you mean `{candidate}`?"),
        _ => String::new(),
    }
}

/// The restricted Damerau-Levenshtein distance: insertions, deletions, replacements and swaps of
/// neighboring letters.
///
/// Words longer than `LONGEST` are only compared for equality.
fn edits(a: &str, b: &str) -> usize {
    const LONGEST: usize = 64;
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    if a.len().max(b.len()) > LONGEST {
        return if a == b { 0 } else { LONGEST };
    }
    let mut rows = vec![(0..=b.len()).collect::<Vec<usize>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_count_single_letters() {
        assert_eq!(edits("sphere", "sphere"), 0);
        assert_eq!(edits("spere", "sphere"), 1);
        assert_eq!(edits("pshere", "sphere"), 1);
        assert_eq!(edits("", "abc"), 3);
    }

    #[test]
    fn only_similar_words_are_suggested() {
        assert_eq!(did_you_mean("Sphere", PRIMITIVES), "did you mean `sphere`?");
        assert_eq!(did_you_mean("cilinder", PRIMITIVES), "did you mean `cylinder`?");
        assert_eq!(did_you_mean("box", PRIMITIVES), "");
    }

    #[test]
    fn a_name_that_only_begins_like_a_keyword_is_a_name() {
        assert!(is_reserved("plane") && is_reserved("gencyl") && !is_reserved("plane1"));
    }
}
