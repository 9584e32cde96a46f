//! All tests of this folder in one program: they share what is linked, and both processors.

mod ahead;
mod architecture;
mod backdrop;
mod borrow;
mod determinism;
mod differential;
mod edges;
mod format;
mod golden;
mod hard;
mod hard_numbers;
mod hard_stability;
mod hostile;
mod hostile_many;
mod lists;
mod packed;
mod texels;
mod unusual;
mod views;
