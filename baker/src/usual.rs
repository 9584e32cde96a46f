//! What is baked where nothing is asked for, beside what a search found: a search tries more ways to reach its goal, the usual way makes more of the one
//! that it takes. `job` hands in both; the one that reaches the goal better goes back.

use crate::atlas::Storage;
use crate::bake::BakeError;
use crate::baked::Baked;
use crate::options::{Goal, Limits};
use crate::seen::Seen;
use crate::tune::MOST_MEMORY;
use cubist_core::format::TexelKind;

/// What a search for `goal` `found`, or the `usual` bundle, stored as it has to be, where that reaches the goal better: within a budget of bytes with more
/// quality beside what is `seen`, or a quality with fewer bytes. Beyond `limits`, or in memory that searches would not take either, it is no answer.
/// `asked`: how it is stored, and of which texels, where nothing has to give.
///
/// # Errors
/// What the search came to, where the usual bundle does not reach the goal either; those of the player.
pub(crate) fn or_found(
    (goal, limits, asked): (Goal, Limits, (Storage, TexelKind)),
    seen: &Seen<'_>,
    found: Result<Baked, BakeError>,
    usual: impl FnOnce((Storage, TexelKind)) -> Result<Baked, BakeError>,
) -> Result<Baked, BakeError> {
    let found = match found {
        // Whatever else is wrong is wrong with both.
        Err(error @ (BakeError::Psnr { .. } | BakeError::Ram { .. })) => {
            return usual(asked).ok().filter(|usual| reaches(goal, limits, usual)).ok_or(error);
        }
        found => found?,
    };
    let Some(stored) = found.contested else { return Ok(found) };
    let Ok(usual) = usual(stored) else { return Ok(found) };
    let most = limits.memory.unwrap_or(found.report.memory.workspace.max(MOST_MEMORY));
    let wins = reaches(goal, Limits { memory: Some(most), ..limits }, &usual) && better(goal, seen, &usual, &found)?;
    Ok(if wins { usual } else { found })
}

/// Whether the `usual` bundle keeps within `limits`, and is as good as `goal` asks for.
pub(crate) fn reaches(goal: Goal, limits: Limits, usual: &Baked) -> bool {
    let good = if let Goal::Psnr(least) = goal { usual.report.quality.psnr_mean >= least } else { true };
    good && limits.over(usual.bundle.len() as u64, usual.report.memory.workspace) == 0
}

/// Whether `usual` is a better answer than `found`; both reach the goal.
fn better(goal: Goal, seen: &Seen<'_>, usual: &Baked, found: &Baked) -> Result<bool, BakeError> {
    match goal {
        Goal::Psnr(_) => Ok(usual.bundle.len() < found.bundle.len()),
        _ => Ok(seen.psnr(&usual.bundle)? > seen.psnr(&found.bundle)?),
    }
}
