//! Sound bundles, changed where their format has a number: refused, or played within the work that their header says.
//! Edits come from libFuzzer's bytes through `arbitrary`; what must hold stands in `cubist_tests::survive`.
#![no_main]

use arbitrary::{Arbitrary, Unstructured};
use cubist_tests::mutate::{Edit, mutated, seeds};
use cubist_tests::survive::{Dose, survives};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static SEEDS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| seeds().expect("they bake"));

/// A seed and what is done to it.
#[derive(Debug)]
struct Recipe {
    seed: u8,
    edits: Vec<Edit>,
    dose: Dose,
}

impl<'a> Arbitrary<'a> for Recipe {
    fn arbitrary(bytes: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let seed = bytes.arbitrary()?;
        let dose = Dose { rows: 1 + bytes.int_in_range(0..=5)?, pixels: 64, walk: bytes.int_in_range(0..=4)?, middle: true };
        let mut edits = Vec::new();
        while !bytes.is_empty() && edits.len() < 12 {
            edits.push(edit(bytes)?);
        }
        Ok(Self { seed, edits, dose })
    }
}

fn edit(bytes: &mut Unstructured<'_>) -> arbitrary::Result<Edit> {
    Ok(match bytes.int_in_range(0..=12)? {
        0 => Edit::Flip { section: bytes.arbitrary()?, at: bytes.arbitrary()?, bits: bytes.arbitrary()? },
        1 => Edit::Noise { section: bytes.arbitrary()?, at: bytes.arbitrary()?, length: bytes.arbitrary()?, seed: bytes.arbitrary()? },
        2 => Edit::Cut { section: bytes.arbitrary()?, length: bytes.arbitrary()? },
        3 => Edit::Drop(bytes.arbitrary()?),
        4 => Edit::First(bytes.arbitrary()?),
        5 => Edit::Limit(bytes.arbitrary()?, bytes.arbitrary()?),
        6 => Edit::Header(bytes.arbitrary()?, bytes.arbitrary()?),
        7 => Edit::Frames(bytes.arbitrary()?),
        8 => Edit::Key { at: bytes.arbitrary()?, what: bytes.arbitrary()?, by: bytes.arbitrary()? },
        9 => Edit::Label(bytes.arbitrary()?, bytes.arbitrary()?, bytes.arbitrary()?),
        10 => Edit::Image(bytes.arbitrary()?, bytes.arbitrary()?),
        11 => Edit::Vector(bytes.arbitrary()?, bytes.arbitrary()?),
        _ => Edit::Records(bytes.arbitrary()?, bytes.arbitrary()?),
    })
}

fuzz_target!(|recipe: Recipe| {
    let seed = &SEEDS[usize::from(recipe.seed) % SEEDS.len()];
    let bytes = mutated(seed, &recipe.edits).expect("a sound envelope");
    let _ = survives(&bytes, recipe.dose);
});
