//! placeholder
use crate::bake::{BakeError, Progress};
use crate::job::{Chosen, Goal, Options};
use crate::scene::Scene;
pub(crate) fn search(_: &Scene, _: &Options, _: Goal, _: Progress<'_>) -> Result<Chosen, BakeError> {
    Err(BakeError::Cell(0))
}
