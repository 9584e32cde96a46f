//! A hundred thousand hostile bundles, each changed where its format has a number: refused, or played within the work that its header says.
//! Bundles come from `cubist_tests::mutate`; what must hold stands in `cubist_tests::survive`. The fuzzer goes the same ways for longer.

use cubist_tests::mutate::{Edit, mutated, seeds};
use cubist_tests::random::Random;
use cubist_tests::survive::{Dose, survives};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bundles in all.
const BUNDLES: u64 = 100_000;

#[test]
fn a_hundred_thousand_hostile_bundles_are_refused_or_play() {
    let dose = Dose { rows: 2, pixels: 32, walk: 2, middle: false };
    let seeds = seeds().expect("they bake");
    assert!(seeds.iter().all(|seed| survives(seed, dose)), "the seeds play");
    let played: usize = (0..BUNDLES)
        .into_par_iter()
        .map(|round| {
            let mut random = Random(round << 20);
            let count = 1 + random.below(3) * random.below(3);
            let edits: Vec<Edit> = (0..count).map(|_| Edit::by_lot(&mut random)).collect();
            // Unpacking takes most of the time where there is something to unpack.
            let seed = &seeds[[0, 0, 0, 1, 2, 3, 3, 3][random.below(8)]];
            let bytes = mutated(seed, &edits).expect("a sound envelope");
            // Who reads that a promise is broken wants to know of which bundle.
            let told = Told(round, &edits);
            let played = survives(&bytes, dose);
            std::mem::forget(told);
            usize::from(played)
        })
        .sum();
    println!("{played} of {BUNDLES} play");
    // If nearly all were refused, or none, the test would say little.
    assert!((30_000..90_000).contains(&played), "{played} of {BUNDLES} play");
}

/// Says which bundle broke a promise, when it is dropped by the panic.
struct Told<'e>(u64, &'e [Edit]);

impl Drop for Told<'_> {
    fn drop(&mut self) {
        static SAID: AtomicUsize = AtomicUsize::new(0);
        if SAID.fetch_add(1, Ordering::Relaxed) == 0 {
            eprintln!("bundle {}: {:?}", self.0, self.1);
        }
    }
}

#[test]
fn every_cut_of_every_seed_is_refused_sealed_or_not() {
    for seed in seeds().expect("they bake") {
        for length in 0..seed.len() {
            let mut cut = seed[..length].to_vec();
            assert!(cubist_core::Bundle::parse(&cut).is_err(), "{length} bytes parse");
            cubist_tests::tamper::seal(&mut cut);
            assert!(cubist_core::Bundle::parse(&cut).is_err(), "{length} bytes parse with a checksum of their own");
        }
    }
}
