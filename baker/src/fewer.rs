//! Fewer sheets: a bundle of all sheets comes from `job`; one without those that show less than they take goes back if that is worth more.

use crate::bake::{BakeError, Flat, Progress, Settings};
use crate::made::Made;
use crate::metrics;
use crate::scene::Scene;

/// `made`, or what is made of the scene in the same cells with all sheets, or without those that take more than they are worth there, if that is worth more.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn anew(scene: &Scene, flat: &Flat, made: Made, progress: Progress<'_>) -> Result<Made, BakeError> {
    progress("pruning sheets", 0.0);
    // All sheets of smaller cells may be more than a bundle can hold.
    let Some(all) = Made::tried(scene, flat, Settings { error: 0.0, ..made.settings })? else { return Ok(made) };
    let picture = made.picture(flat);
    let other = choose(scene, flat, all, progress)?;
    Ok(if other.worth(picture) > made.worth(picture) { other } else { made })
}

/// `all`, or what is made of the scene without the sheets that take more than they are worth at the quality of `all`, if that is worth more.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(scene: &Scene, flat: &Flat, all: Made, progress: Progress<'_>) -> Result<Made, BakeError> {
    progress("pruning sheets", 0.0);
    let fewer = Made::new(scene, flat, Settings { error: metrics::mse(all.quality.psnr_mean), ..all.settings })?;
    progress("pruning sheets", 1.0);
    let picture = all.picture(flat);
    Ok(if fewer.worth(picture) > all.worth(picture) { fewer } else { all })
}
