//! What any bytes must do: be refused, or play. No panic, every pixel written, the same pixels whatever the memory held and whatever was
//! shown before, and no more work than the bundle's header says.
//! Bundles come from `mutate`, the tests and the fuzzer; broken promises go back as panics.

use cubist_core::grid::Grid;
use cubist_core::{AnyTexels, Bundle, Frame, Player, Work};

/// What to play of a bundle.
#[derive(Clone, Copy, Debug)]
pub struct Dose {
    /// Rows of each frame, at most, evenly spread.
    pub rows: u32,
    /// Pixels of each row, at most.
    pub pixels: usize,
    /// Frames before each that are passed through one by one when it is played the second time.
    pub walk: u32,
    /// Not the first and the last frame alone.
    pub middle: bool,
}

/// Whether `bytes` parse; if so a dose of them is played twice, and all promises are checked.
///
/// # Panics
/// A promise is broken.
#[must_use]
pub fn survives(bytes: &[u8], dose: Dose) -> bool {
    let Ok(bundle) = Bundle::parse(bytes) else { return false };
    let first = play(&bundle, 0, Dose { walk: 0, ..dose });
    assert!(first == play(&bundle, 0xff, dose), "pixels depend on what the memory held, or on what was shown before");
    true
}

fn play(bundle: &Bundle<'_>, fill: u8, dose: Dose) -> Vec<u16> {
    let (width, height) = bundle.size();
    let mut memory = vec![fill; bundle.memory_needed()];
    let Ok(mut player) = Player::<AnyTexels>::with_texels(bundle, &mut memory) else {
        unreachable!("it has the memory that it asked for, and plays any texels");
    };
    let mut pixels = Vec::new();
    let width = (width as usize).min(dose.pixels);
    let (mut row, mut again) = (vec![0; width], vec![0; width]);
    let frames = [0, bundle.frames() / 2, bundle.frames() - 1];
    for frame in frames.into_iter().step_by(if dose.middle { 1 } else { 2 }) {
        for frame in frame.saturating_sub(dose.walk)..=frame {
            player.seek(Frame(frame));
            bounded(bundle, player.work(), 0);
        }
        let mut drawn = 0;
        for y in (0..height).step_by(height.div_ceil(dose.rows.max(1)) as usize) {
            // Two fills: a pixel that is not written keeps both.
            row.fill(0xdead);
            player.row(y, &mut row);
            again.fill(0xbeef);
            player.row(y, &mut again);
            assert!(row == again, "frame {frame}, row {y}: a pixel is left out");
            drawn += 2;
            pixels.extend_from_slice(&row);
        }
        bounded(bundle, player.work(), drawn);
        player.smooth_row(height / 2, &mut row);
        pixels.extend_from_slice(&row);
    }
    pixels
}

/// Checks that `rows` rows, and the seek before them, took no more work than the header says.
fn bounded(bundle: &Bundle<'_>, work: Work, rows: u32) {
    let (limits, path) = (bundle.limits(), bundle.path());
    let grid = Grid::new(path.width, path.height, path.cell_log2);
    let keys = u32::from(limits.seek_keys);
    // Of a record: lists of two intervals at most, and the rows of nodes. A seek may leave one key more half decoded.
    let slices = (2 * grid.rows.div_ceil(4) + grid.node_rows()) as u32;
    // The longest record, and what the decoder reads ahead of each.
    let record = (0..bundle.key_count()).map(|key| bundle.record(key).len()).max().unwrap_or(0) as u32 + 8;
    let layers = u32::from(limits.row_layers);
    // A row counts whole, however much of it is asked for.
    let pixels = rows * u32::from(path.width);
    let good = [
        ("keys", work.keys, keys),
        ("slices", work.slices, (keys + 1).saturating_mul(slices)),
        ("bytes of records", work.record_bytes, (keys + 1).saturating_mul(record)),
        // Rows are drawn apart from each other here: each loads four rows of nodes.
        ("layers", work.layers, rows.saturating_mul(4 * layers)),
        ("pixels", work.smooth_pixels.saturating_add(work.torn_pixels), pixels),
        ("coverage tests", work.coverage_tests, work.torn_pixels.saturating_mul(u32::from(limits.cell_sheets) - 1)),
        ("pixels of four", work.smoothed_pixels, 0),
    ];
    for (what, found, most) in good {
        assert!(found <= most, "{found} {what}, at most {most} by the header: {work:?}, {limits:?}");
    }
}
