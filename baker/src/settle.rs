//! Settling: which sheet of a torn cell shows where. What a field has to tell depends on the sheets in front of its own, and which order and tests
//! show least wrong depends on what fields tell: each is chosen for what the other is, by turns.
//! Sheets come from `sheets`, positions from `fit`; order, tests and fields go to `encode`.

use crate::fields::{self, Fields};
use crate::order::{self, Evidence, Looks};
use crate::polish;
use crate::sheets::Sheets;

/// Turns that go on from the fields of the last one. On fast paths around five models and through streets all turns but the first made .1 to .8 dB beside
/// the antialiased truth with softened outlines, for half to two thirds as much time for fitting again; three more made .0 to .3, for as much.
const TURNS: usize = 2;

/// Sorts `sheets` front to back, and chooses their tests and the fields that these ask for.
#[must_use]
pub fn settle(evidence: &Evidence<'_>, sheets: &mut Sheets) -> Fields {
    let &Evidence { gbuffer, grid, image, layers, .. } = evidence;
    let looks = Looks::new(evidence, sheets);
    order::sort(evidence, &looks, None, sheets);
    let mut fields = fields::solve(gbuffer, grid, sheets, layers, image.labels.len());
    order::sort(evidence, &looks, Some(&fields), sheets);
    // What no test asks for would hold fields back that some tests do.
    fields = fields.tested(gbuffer, grid, sheets, layers);
    for _ in 0..TURNS {
        order::sort(evidence, &looks, Some(&fields), sheets);
        fields = fields.settled(gbuffer, grid, sheets, layers);
    }
    let fields = polish::polish(fields, gbuffer, grid, sheets, layers);
    order::sort(evidence, &looks, Some(&fields), sheets);
    fields
}
