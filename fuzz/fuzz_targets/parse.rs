//! Any bytes: refused or parsed, and whatever parses is told about and played a little.
//! Bytes come from libFuzzer, which changes them as it likes; the checksum at their end is put right afterwards, so that it hides nothing.
#![no_main]

use cubist_core::Bundle;
use cubist_tests::survive::{Dose, survives};
use cubist_tests::tamper::seal;
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

fuzz_mutator!(|bytes: &mut [u8], size: usize, most: usize, _seed: u32| {
    let size = fuzzer_mutate(bytes, size, most);
    seal(&mut bytes[..size]);
    size
});

fuzz_target!(|bytes: &[u8]| {
    // As it is, and sealed: seeds that nothing has changed yet come unsealed too.
    let _ = Bundle::parse(bytes).map_err(|error| error.to_string());
    let mut bytes = bytes.to_vec();
    seal(&mut bytes);
    match Bundle::parse(&bytes) {
        Err(error) => drop(error.to_string()),
        Ok(bundle) => {
            // Every accessor is total, past the end too.
            for at in [0, bundle.key_count() / 2, bundle.key_count(), usize::MAX] {
                let _ = (bundle.key(at), bundle.record(at).len(), bundle.camera(at));
            }
            let _ = (0..=u8::MAX).map(|label| bundle.label(label).right).max();
            let _ = (bundle.moment(bundle.frames() - 1), bundle.memory_needed(), bundle.sections().count());
            assert!(survives(&bytes, Dose { rows: 2, pixels: 64, walk: 2, middle: true }));
        }
    }
});
