//! Settling: which sheet of a torn cell shows where, by the order of its sheets, the test of each, and the fields that tests ask.
//! Sheets come from `sheets`, positions from `fit`; order, tests and fields go to `encode`.
//!
//! Fields and order depend on each other. A field has to tell its sheet only from what no sheet in front covers, and which order and which tests show
//! least wrong is a matter of the fields. So they are chosen by turns, each for what the other is.

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
