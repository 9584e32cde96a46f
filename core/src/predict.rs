//! How the positions of a chain are coded: what is already known predicts each, the rest is a residual.
//! Chains come from `nodes`; positions go into the key, what they say about their neighbours into traces.
//!
//! Every chain says what its positions are told from ([`Base`]): the plane of its label, the two keys before, or the nodes around. Planes and time are
//! corrected by how far they were off at the nodes west and north that were told likewise. How large residuals were there chooses the contexts of the
//! next.

use crate::coder::{self, Bits, NUMBER_CONTEXTS, Probability};
use crate::fixed::{KEY_MAX, KEY_MIN, KeyUv};
use crate::format::LabelRecord;
use crate::key::{self, Base, Chain, Key, Line, Setting, Source};
use crate::plane::Across;

/// Classes of how large the residuals were around a layer.
const NOISE_CLASSES: usize = 9;
/// Contexts of residuals.
const RESIDUALS: usize = NOISE_CLASSES * 2 * NUMBER_CONTEXTS;
/// Contexts of the base where one is expected: whether it is each of them, but for the last.
const BASES: usize = Base::ALL.len() - 1;
/// Contexts positions are coded with: those of residuals, then those of bases, for each that may be expected.
pub const CONTEXTS: usize = RESIDUALS + Base::ALL.len() * BASES;

/// Codes the positions of the layers of `chain`, in row `row` of `key`, in `contexts` ([`CONTEXTS`] of them): what they are told from, and for each a
/// residual. Their `traces` have their marks.
#[expect(clippy::too_many_arguments, reason = "the key's state, its memory and the chain's place are three different owners")]
#[inline(never)]
pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &mut Key<'_>,
    traces: &mut [Trace],
    row: usize,
    chain: Chain,
    source: &mut S,
) {
    let Some((residuals, bases)) = contexts.split_at_mut_checked(RESIDUALS) else { return };
    let expected = expected(key, traces, row, chain);
    let wanted = source.base(expected, |source, base| {
        walk(&mut Trial, residuals, setting, key, traces, (row, base), chain, source);
    });
    let base = tell(bits, bases, expected, wanted);
    walk(bits, residuals, setting, key, traces, (row, base), chain, source);
}

/// The bits of a trial go nowhere, and teach nothing: they are what an encoder says.
pub(crate) struct Trial;

impl Bits for Trial {
    fn bit(&mut self, _: &mut Probability, bit: bool) -> bool {
        bit
    }

    fn flat(&mut self, _: u32, value: u32) -> u32 {
        value
    }
}

/// The base of the layer above the first of `chain` that there is one above.
#[inline(always)]
fn expected(key: &Key<'_>, traces: &[Trace], row: usize, chain: Chain) -> Base {
    let above = row.checked_sub(1).map_or(&[][..], |row| key.chains(row));
    let (even, odd) = traces.split_at(traces.len() / 2);
    let start = above.first().map_or(0, |first| usize::from(first.at));
    let layer = Line::new(above, chain.label as u8).first_in(chain.first..chain.end);
    let trace = layer.and_then(|layer| if row & 1 == 0 { odd } else { even }.get(layer.wrapping_sub(start)));
    let marks = trace.map_or(0, |trace| trace.word & BASE);
    Base::ALL.into_iter().find(|&base| marks_of(base) == marks).unwrap_or_default()
}

/// Codes a base: whether it is the `expected` one, and if not which of the others, one after the other.
fn tell<B: Bits>(bits: &mut B, contexts: &mut [Probability], expected: Base, wanted: Base) -> Base {
    let contexts = contexts.chunks_exact_mut(BASES).nth(expected as usize).unwrap_or_default();
    let others = Base::ALL.into_iter().filter(|&base| base != expected);
    let mut last = expected;
    for (base, context) in core::iter::once(expected).chain(others).zip(contexts.iter_mut().map(Some).chain(core::iter::once(None))) {
        last = base;
        // The last needs no flag that it is.
        if context.is_some_and(|context| !bits.bit(context, wanted != base)) {
            break;
        }
    }
    last
}

/// Codes the positions of a chain as told from a base.
#[expect(clippy::too_many_arguments, reason = "the key's state, its memory and the chain's place are three different owners")]
#[inline(always)]
fn walk<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &mut Key<'_>,
    traces: &mut [Trace],
    (row, base): (usize, Base),
    chain: Chain,
    source: &mut S,
) {
    let label = chain.label as u8;
    let Key { row: rows, chain: chains, uv: positions, .. } = key;
    let line = |row: usize| key::of_row(rows, chains, row);
    let (even, odd) = traces.split_at_mut(traces.len() / 2);
    let (above, here) = if row & 1 == 0 { (&*odd, even) } else { (&*even, odd) };
    let start = line(row).first().map_or(0, |first| first.at);
    let mut known = Known::new(setting, row.checked_sub(1).map_or(&[][..], line), (row, base), chain);
    let mut near = known.at(positions, above, chain.first);
    let here = here.get_mut(usize::from(chain.at.wrapping_sub(start))..).unwrap_or(&mut []);
    let mut node = row.wrapping_mul(setting.grid.node_columns()).wrapping_add(chain.first.into());
    for ((trace, layer), column) in here.iter_mut().zip(usize::from(chain.at)..).zip(chain.first..chain.end) {
        near.ahead = known.over(positions, above, column.wrapping_add(1));
        let sum = near.sum();
        let told = known.told(column);
        let predicted = match told {
            Some(told) => near.corrected(told, base, sum),
            None => {
                let far_north = || position(positions, Line::new(line(row.checked_sub(2)?), label).layer(column)?);
                near.around(far_north).unwrap_or_else(|| near.guess(&(setting.label)(label), setting.key_bits))
            }
        };
        let round = |x: i32| {
            let half = (1i32 << setting.step_log2) >> 1;
            (x.clamp(KEY_MIN, KEY_MAX).wrapping_add(half)) >> setting.step_log2 << setting.step_log2
        };
        let predicted = predicted.map(round);
        let at = sum.noise_class().wrapping_mul(2 * NUMBER_CONTEXTS);
        let Some((along_u, rest)) = contexts.get_mut(at..).and_then(|c| c.split_at_mut_checked(NUMBER_CONTEXTS)) else { break };
        let Some((along_v, _)) = rest.split_at_mut_checked(NUMBER_CONTEXTS) else { break };
        let [u, v] = source.residual(node, label, predicted, [along_u, along_v]);
        let residual = [coder::number(bits, along_u, u), coder::number(bits, along_v, v)];
        let [[u, v], [du, dv]] = [predicted, residual];
        let uv = KeyUv::new(u.wrapping_add(du.wrapping_shl(setting.step_log2)), v.wrapping_add(dv.wrapping_shl(setting.step_log2)));
        trace.leave(residual, told.map(|told| (marks_of(base), minus(pair(uv), told))));
        if let Some(slot) = positions.get_mut(layer) {
            *slot = uv.0;
        }
        near.step(pair(uv), *trace);
        node = node.wrapping_add(1);
    }
}

/// What the coding of a layer leaves behind for its neighbours, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Trace {
    /// How large the residual was, steps, up to [`MOST_NOISE`]; and marks. Of four neighbours all are added up at once.
    word: u32,
    /// Position less what it is told from, stored units, saturating.
    offset: [i16; 2],
}

/// As large a residual as this, of one neighbour of four, makes for the last class.
const MOST_NOISE: i32 = 127;
/// Bits that the noise of four neighbours takes.
const NOISE: u32 = 0x1ff;
/// The layer is coded. In three bits each, up to four of these marks are counted.
const THERE: u32 = 1 << 16;
/// It is told from its plane.
const FLAT: u32 = 1 << 19;
/// It is told from the keys before.
const TEMPORAL: u32 = 1 << 22;
/// It is told from either without a correction.
const PLAIN: u32 = 1 << 25;
/// Marks of what it is told from.
const BASE: u32 = FLAT | TEMPORAL | PLAIN;
/// Some cell tests the layer's fields. Of this no count is kept.
const TESTED: u32 = 1 << 31;

/// The marks of layers that are told from `base`.
#[inline(always)]
const fn marks_of(base: Base) -> u32 {
    match base {
        Base::Around => 0,
        Base::Plane => FLAT | PLAIN,
        Base::PlaneCorrected => FLAT,
        Base::Time => TEMPORAL | PLAIN,
        Base::TimeCorrected => TEMPORAL,
    }
}

impl Trace {
    /// That of a layer that is not coded yet.
    pub(crate) const NONE: Self = Self { word: 0, offset: [0; 2] };

    /// Some cell tests the layer's fields: says so.
    pub(crate) const fn test(&mut self) {
        self.word |= TESTED;
    }

    /// Some cell tests the layer's fields.
    pub(crate) const fn tested(&self) -> bool {
        self.word & TESTED != 0
    }

    #[inline(always)]
    const fn there(&self) -> bool {
        self.word & THERE != 0
    }

    /// The layer is coded: its residual, and where it was told from a base that one's marks and how far off it was.
    #[inline(always)]
    fn leave(&mut self, [u, v]: [i32; 2], told: Option<(u32, [i32; 2])>) {
        self.offset = [0; 2];
        // Residuals are below 2^18.
        let noise = u.wrapping_abs().wrapping_add(v.wrapping_abs()).clamp(0, MOST_NOISE) as u32;
        self.word = self.word & TESTED | THERE | noise;
        if let Some((marks, off)) = told {
            self.word |= marks;
            self.offset = off.map(|x| x.clamp(-32_768, 32_767) as i16);
        }
    }
}

/// What is known of a chain's label as its nodes are walked.
struct Known<'k> {
    /// The row above, and where its layers start.
    north: Line<'k>,
    start: usize,
    /// What positions are told from.
    told: Told<'k>,
}

/// What positions are told from, as it is looked up.
enum Told<'k> {
    Around,
    /// Where the label's plane is seen.
    Plane(Across),
    /// The key before, and the one before that with how far things move on from there (see [`Setting::before_that`]).
    Time {
        held: (Line<'k>, &'k [u32]),
        older: (Line<'k>, &'k [u32]),
        ratio: i32,
    },
}

/// A layer of the same label at a neighbouring node; one that has left no trace is not there.
#[derive(Clone, Copy)]
struct Neighbour {
    uv: [i32; 2],
    trace: Trace,
}

impl Neighbour {
    const NONE: Self = Self { uv: [0; 2], trace: Trace::NONE };
}

/// The neighbours that are already coded, and one further west.
struct Neighbours {
    west: Neighbour,
    north: Neighbour,
    /// To the north-east.
    ahead: Neighbour,
    /// To the north-west.
    behind: Neighbour,
    far_west: Option<[i32; 2]>,
}

fn pair(uv: KeyUv) -> [i32; 2] {
    [uv.u(), uv.v()]
}

#[inline(always)]
fn position(positions: &[u32], layer: usize) -> Option<[i32; 2]> {
    positions.get(layer).map(|&uv| pair(KeyUv(uv)))
}

impl<'k> Known<'k> {
    /// What is known of `chain` in `row`, given the chains of the row `above`.
    fn new<L>(setting: &Setting<'k, '_, L>, above: &'k [Chain], (row, base): (usize, Base), chain: Chain) -> Self {
        let label = chain.label as u8;
        let of =
            |key: Option<&'k Key<'_>>| key.map_or((Line::new(&[], label), &[][..]), |key| (Line::new(key.chains(row), label), &*key.uv));
        let view = || setting.views.get(setting.planes.binary_search_by_key(&label, |[label, ..]| *label).ok()?);
        let told = match base {
            Base::Around => Told::Around,
            Base::Plane | Base::PlaneCorrected => view().map_or(Told::Around, |view| Told::Plane(view.across(chain.first.into(), row))),
            Base::Time | Base::TimeCorrected => Told::Time {
                held: of(setting.before),
                older: of(setting.before_that.map(|(key, _)| key)),
                ratio: setting.before_that.map_or(0, |(_, ratio)| ratio),
            },
        };
        Self { north: Line::new(above, label), start: above.first().map_or(0, |first| first.at.into()), told }
    }

    /// The layer north of the node in `column`, given the key's `positions` and the traces of the row `above`.
    #[inline(always)]
    fn over(&mut self, positions: &[u32], above: &[Trace], column: u16) -> Neighbour {
        let Some(layer) = self.north.layer(column) else { return Neighbour::NONE };
        let trace = above.get(layer.wrapping_sub(self.start));
        trace.zip(position(positions, layer)).map_or(Neighbour::NONE, |(&trace, uv)| Neighbour { uv, trace })
    }

    /// The neighbours of the first node, in `column`.
    #[inline(never)]
    fn at(&mut self, positions: &[u32], above: &[Trace], column: u16) -> Neighbours {
        let behind = column.checked_sub(1).map_or(Neighbour::NONE, |column| self.over(positions, above, column));
        let north = self.over(positions, above, column);
        Neighbours { west: Neighbour::NONE, north, ahead: Neighbour::NONE, behind, far_west: None }
    }

    /// What the base says about the next node, which is in `column`.
    #[inline(always)]
    fn told(&mut self, column: u16) -> Option<[i32; 2]> {
        match &mut self.told {
            Told::Around => None,
            Told::Plane(across) => across.advance(),
            Told::Time { held: (held, positions), older: (older, older_positions), ratio } => {
                let older = older.layer(column).and_then(|layer| position(older_positions, layer));
                let held = position(positions, held.layer(column)?)?;
                // Positions differ by less than 2^16 and the ratio is at most 2^12: the product fits 2^28.
                Some(older.map_or(held, |older| plus(held, minus(held, older).map(|d| d.wrapping_mul(*ratio) >> 8))))
            }
        }
    }
}

/// Sums over a node's neighbours: of noise, and of marks.
#[derive(Clone, Copy)]
struct Sum(u32);

impl Sum {
    /// How many neighbours have such a `mark`.
    #[inline(always)]
    const fn count(self, mark: u32) -> u32 {
        self.0 >> mark.trailing_zeros() & 7
    }

    /// The class of how noisy the neighbours were.
    #[inline(always)]
    fn noise_class(self) -> usize {
        let (noise, count) = (self.0 & NOISE, self.count(THERE));
        // Twice the mean noise is at least a limit where twice the noise is at least as many times the limit.
        match count {
            0 => NOISE_CLASSES - 1,
            _ => [1, 2, 4, 8, 14, 26, 60].iter().take_while(|&&limit| noise.wrapping_mul(2) >= count.wrapping_mul(limit)).count(),
        }
    }
}

fn plus(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    let ([a, b], [c, d]) = (a, b);
    [a.wrapping_add(c), b.wrapping_add(d)]
}

fn minus(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    let ([a, b], [c, d]) = (a, b);
    [a.wrapping_sub(c), b.wrapping_sub(d)]
}

/// The mean of `count` values of that `sum`, rounded towards minus infinity; of three the `first` counts twice, since small processors do not divide.
#[inline(always)]
fn mean(sum: [i32; 2], first: [i32; 2], count: u32) -> Option<[i32; 2]> {
    match count {
        0 => None,
        1 => Some(sum),
        2 => Some(sum.map(|x| x >> 1)),
        3 => Some(plus(sum, first).map(|x| x >> 2)),
        _ => Some(sum.map(|x| x >> 2)),
    }
}

impl Neighbours {
    #[inline(always)]
    const fn all(&self) -> [&Neighbour; 4] {
        [&self.west, &self.north, &self.ahead, &self.behind]
    }

    #[inline(always)]
    fn sum(&self) -> Sum {
        Sum(self.all().into_iter().fold(0, |sum, neighbour| sum.wrapping_add(neighbour.trace.word)))
    }

    /// The answer of a base that a layer is `told` from, corrected if it says so: by the mean of how far off it was around.
    #[inline(always)]
    fn corrected(&self, told: [i32; 2], base: Base, sum: Sum) -> [i32; 2] {
        let mark = match base {
            Base::PlaneCorrected => FLAT,
            Base::TimeCorrected => TEMPORAL,
            _ => return told,
        };
        let off = |neighbour: &Neighbour| {
            let told = neighbour.trace.word & mark != 0;
            neighbour.trace.offset.map(|x| if told { x.into() } else { 0 })
        };
        let [west, north, ahead, behind] = self.all().map(off);
        let first = if self.west.trace.word & mark != 0 { west } else { north };
        plus(told, mean(plus(plus(west, north), plus(ahead, behind)), first, sum.count(mark)).unwrap_or_default())
    }

    /// Where the neighbours' positions lead.
    #[inline(never)]
    fn around(&self, far_north: impl FnOnce() -> Option<[i32; 2]>) -> Option<[i32; 2]> {
        let Self { west, north, behind, .. } = self;
        if west.trace.there() && north.trace.there() && behind.trace.there() {
            return Some(minus(plus(west.uv, north.uv), behind.uv));
        }
        let line = |near: &Neighbour, far: [i32; 2]| minus(plus(near.uv, near.uv), far);
        let across = self.far_west.map(|far| line(west, far));
        let down = if north.trace.there() { far_north().map(|far| line(north, far)) } else { None };
        across.zip(down).map(|(a, b)| plus(a, b).map(|x| x >> 1)).or(across).or(down)
    }

    /// Where a layer may be that nothing has an answer for: the mean of its neighbours, or without any the middle of its chart.
    #[inline(never)]
    fn guess(&self, record: &LabelRecord, key_bits: u32) -> [i32; 2] {
        let there = || self.all().into_iter().filter(|neighbour| neighbour.trace.there()).map(|neighbour| neighbour.uv);
        let sum = there().fold([0; 2], plus);
        mean(sum, there().next().unwrap_or_default(), there().count() as u32).unwrap_or_else(|| {
            let middle = |a: u16, b: u16| i32::from(a).wrapping_add(i32::from(b)).wrapping_shl(key_bits) >> 1;
            [middle(record.left, record.right), middle(record.top, record.bottom)]
        })
    }

    /// On to the next node, from one whose layer is at `uv` and has left `trace`.
    #[inline(always)]
    fn step(&mut self, uv: [i32; 2], trace: Trace) {
        self.far_west = self.west.trace.there().then_some(self.west.uv);
        self.west = Neighbour { uv, trace };
        (self.behind, self.north) = (self.north, self.ahead);
    }
}

#[cfg(test)]
mod tests {
    use super::{BASES, Base, Bits, Probability, tell};
    use heapless::Vec;

    /// Bits as they are written, or, once they are `kept`, read again.
    #[derive(Default)]
    struct Tape {
        bits: Vec<bool, 8>,
        kept: Option<usize>,
    }

    impl Bits for Tape {
        fn bit(&mut self, _: &mut Probability, bit: bool) -> bool {
            match &mut self.kept {
                None => self.bits.push(bit).is_ok() && bit,
                Some(at) => {
                    let bit = self.bits.get(*at).copied().unwrap_or_default();
                    *at = at.wrapping_add(1);
                    bit
                }
            }
        }

        fn flat(&mut self, _: u32, value: u32) -> u32 {
            value
        }
    }

    #[test]
    fn any_base_can_be_told_whatever_is_expected() {
        for expected in Base::ALL {
            for wanted in Base::ALL {
                let mut contexts = [Probability::NEW; BASES * Base::ALL.len()];
                let mut tape = Tape::default();
                assert_eq!(tell(&mut tape, &mut contexts, expected, wanted), wanted);
                let length = tape.bits.len();
                assert!(
                    if wanted == expected { length == 1 } else { (2..=BASES).contains(&length) },
                    "{expected:?} {wanted:?}: {length} bits"
                );
                tape.kept = Some(0);
                assert_eq!(tell(&mut tape, &mut contexts, expected, Base::default()), wanted);
                assert_eq!(tape.kept, Some(length));
            }
        }
    }
}
