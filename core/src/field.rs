//! How the fields of a layer are coded: each is told from the key before and the nodes west and north of it.
//! Layers come from `nodes`, which says whether a cell tests them; codes go into the key.

use crate::coder::{self, Bits, NUMBER_CONTEXTS, Probability};
use crate::fixed::{MAX_FIELD, field_code};
use crate::format::{LabelRecord, STRIP};
use crate::key::{Key, Setting, Source, Spot};

/// Ways a field can be told: from time and neighbours, from time, from neighbours, from nothing.
const CLASSES: usize = 4;
/// Contexts fields are coded with.
pub const CONTEXTS: usize = CLASSES * NUMBER_CONTEXTS;

/// Codes the fields of the layer at `spot` in `contexts` ([`CONTEXTS`] of them), or clears them where no cell `tested` them.
pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &mut Key<'_>,
    spot: &Spot,
    tested: bool,
    source: &mut S,
) {
    let strip = (setting.label)(spot.label).flags & STRIP != 0;
    for which in 0..2usize {
        let wanted = tested && (which == 0 || strip);
        let code = if wanted { one(bits, contexts, setting, key, spot, which, source) } else { 0 };
        if let Some(slot) = key.fields.get_mut(which).and_then(|codes| codes.get_mut(spot.layer)) {
            *slot = code;
        }
    }
}

/// Codes one field of a layer, told from the key before and how the same field changed at the nodes west and north of it.
fn one<B: Bits, S: Source, L>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &Key<'_>,
    spot: &Spot,
    which: usize,
    source: &mut S,
) -> i8 {
    let width = setting.grid.node_columns();
    // A field of zero is one that nothing is known about: its layer was not tested.
    let known = |key: &Key<'_>, node: Option<usize>| {
        let distance = key.field(key.find(node?, spot.label)?).get(which).copied()?;
        (distance != 0).then_some(distance)
    };
    let west = (spot.column > 0).then(|| spot.node.wrapping_sub(1));
    let north = (spot.row > 0).then(|| spot.node.wrapping_sub(width));
    let north_west = west.and(north).map(|node| node.wrapping_sub(1));
    let before = |node: Option<usize>| setting.before.and_then(|key| known(key, node));
    let held = before(Some(spot.node));
    let change = |node: Option<usize>| known(key, node).zip(before(node)).map(|(now, then)| now.wrapping_sub(then));
    let average = |a: Option<i32>, b: Option<i32>| match (a, b) {
        (Some(a), Some(b)) => Some(a.wrapping_add(b) >> 1),
        (one, other) => one.or(other),
    };
    let moved = average(change(west), change(north));
    let beside = match (known(key, west), known(key, north), known(key, north_west)) {
        (Some(w), Some(n), Some(nw)) => Some(w.wrapping_add(n).wrapping_sub(nw)),
        (w, n, _) => average(w, n),
    };
    let (predicted, class) = match (held, moved, beside) {
        (Some(held), Some(moved), _) => (held.wrapping_add(moved), 0usize),
        (Some(held), None, _) => (held, 1),
        (None, _, Some(beside)) => (beside, 2),
        (None, _, None) => (0, 3),
    };
    let predicted = i32::from(field_code(predicted));
    let wanted = i32::from(source.field(spot.node, spot.label, which));
    let at = class.wrapping_mul(NUMBER_CONTEXTS);
    let Some(contexts) = contexts.get_mut(at..) else { return 0 };
    let code = predicted.wrapping_add(coder::number(bits, contexts, wanted.wrapping_sub(predicted)));
    code.clamp(-MAX_FIELD, MAX_FIELD) as i8
}
