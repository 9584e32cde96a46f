//! Joins: sets that grow by joining, each told by one of its members (union-find).
//! `folds` joins pixels to parts, `chart` faces to charts.

/// Follows joins from `i` to the member that stands for its set: its own parent. Halves the way for the next time.
pub(crate) fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}
