//! Plays bundles through the core's player, whole frames at a time.
//! Bundles come from `scenes`; pixels and probes go to the tests and to `figures`.

use anyhow::Result;
use cubist_core::{Bundle, ByteOrder, Frame, Indexed8, Player, Probe, Texels};

/// Calls `visit` with every frame number of `frames` and the player that stands at it, of a bundle with a byte a texel.
///
/// # Errors
/// The bundle does not parse, or has texels of another kind.
pub fn visit(bytes: &[u8], frames: impl IntoIterator<Item = u32>, visit: impl FnMut(u32, &mut Player<'_>)) -> Result<()> {
    visit_as::<Indexed8>(bytes, frames, visit)
}

/// Like [`visit`], with a player of texels that `T` names.
///
/// # Errors
/// The bundle does not parse, or has texels of another kind.
pub fn visit_as<T: Texels>(
    bytes: &[u8],
    frames: impl IntoIterator<Item = u32>,
    mut visit: impl FnMut(u32, &mut Player<'_, T>),
) -> Result<()> {
    let bundle = Bundle::parse(bytes)?;
    let mut memory = vec![0; Player::<T>::memory_needed(&bundle)];
    let mut player = Player::<T>::with_texels(&bundle, &mut memory)?;
    for frame in frames {
        player.seek(Frame(frame));
        visit(frame, &mut player);
    }
    Ok(())
}

/// The current frame of `player`: RGB565, row by row.
#[must_use]
pub fn pixels<T: Texels>(player: &mut Player<'_, T>) -> Vec<u16> {
    whole(player, |player, y, out| player.row(y, out))
}

/// Where each pixel of the current frame of `player` comes from, row by row.
#[must_use]
pub fn probes<T: Texels>(player: &mut Player<'_, T>) -> Vec<Probe> {
    whole(player, |player, y, out| player.probe_row(y, out))
}

/// The current frame of `player`, row by row as `row` draws it.
#[must_use]
pub fn whole<P: Clone + Default, T: Texels>(player: &mut Player<'_, T>, row: impl Fn(&mut Player<'_, T>, u32, &mut [P])) -> Vec<P> {
    let (width, height) = player.bundle().size();
    let mut picture = vec![P::default(); (width * height) as usize];
    for (y, out) in (0..).zip(picture.chunks_mut(width as usize)) {
        row(player, y, out);
    }
    picture
}

/// The pixels of `frames`, in that order.
///
/// # Errors
/// The bundle does not parse.
pub fn frames(bytes: &[u8], frames: impl IntoIterator<Item = u32>) -> Result<Vec<Vec<u16>>> {
    let mut pictures = Vec::new();
    visit(bytes, frames, |_, player| pictures.push(pixels(player)))?;
    Ok(pictures)
}

/// One of a player's ways to draw a row.
type Way<'a, T> = fn(&mut Player<'a, T>, u32, &mut [u16]);

/// Frames of `bytes` as a player of `T` draws them, every row in all the ways there are, from memory filled with `fill`; a row is shorter than the
/// screen.
///
/// # Errors
/// The bundle does not parse, or has texels of another kind.
pub fn every_way<T: Texels>(bytes: &[u8], frames: &[u32], fill: u8, order: ByteOrder) -> Result<Vec<u16>> {
    let bundle = Bundle::parse(bytes)?;
    let (width, height) = bundle.size();
    let mut memory = vec![fill; Player::<T>::memory_needed(&bundle)];
    let mut player = Player::<T>::with_texels(&bundle, &mut memory)?;
    player.set_byte_order(order);
    let mut out = Vec::new();
    for &frame in frames {
        player.seek(Frame(frame));
        for y in 0..height {
            let mut row = vec![0; (if y == 7 { width * 3 / 5 } else { width }) as usize];
            let ways: [Way<'_, T>; 5] = [Player::row, Player::smooth_row, Player::dithered_row, Player::bilinear_row, Player::fine_row];
            for way in ways {
                way(&mut player, y, &mut row);
                out.extend(&row);
            }
        }
    }
    Ok(out)
}
