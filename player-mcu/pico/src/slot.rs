//! The bundle to play: the one linked in, or else the one that lies at a fixed address of the flash, where it can be replaced without building
//! anything. What is found goes to `main`; the bytes are checked by [`Bundle::parse_first`] and by nothing before it.

use cubist_core::{Bundle, BundleError};

/// Where a bundle lies in flash: halfway into the Pico's 2 MB. `memory.x` keeps the firmware below.
const ADDRESS: usize = 0x1010_0000;
/// The flash from there to its end.
const ROOM: usize = 1 << 20;

/// The bundle that was linked in; empty: none was.
static LINKED: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.cubist"));

/// Puts the bundle to play into its place.
///
/// # Errors
/// Those of [`Bundle::parse_first`]; `NotABundle` where the flash holds none.
pub fn open(place: &mut Option<Bundle<'static>>) -> Result<(), BundleError> {
    parse(place, if LINKED.is_empty() { flash() } else { LINKED })
}

/// Puts the bundle that `bytes` begin with into its place: nothing but itself says how long one in flash is. A function of its own: what it takes of the stack is free again afterwards.
///
/// # Errors
/// Those of [`Bundle::parse_first`].
#[inline(never)]
pub fn parse(place: &mut Option<Bundle<'static>>, bytes: &'static [u8]) -> Result<(), BundleError> {
    // With `?` the bundle would be on the stack twice.
    match Bundle::parse_first(bytes) {
        Ok(bundle) => {
            *place = Some(bundle);
            Ok(())
        }
        Err(error) => Err(error),
    }
}

#[expect(unsafe_code, reason = "flash that belongs to no object of the program; the HAL has no view of it")]
fn flash() -> &'static [u8] {
    // SAFETY: the RP2040 maps its flash at 0x1000_0000, readable at every address below 0x1100_0000 whatever the chip's size, so that all of the
    // range can be read at any time. Nothing here writes to flash, and the linker places nothing there (memory.x). Any bytes are valid `u8`.
    unsafe { core::slice::from_raw_parts(core::ptr::with_exposed_provenance(ADDRESS), ROOM) }
}
