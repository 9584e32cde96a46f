//! Where a bundle comes from: what a report and its warnings are told from.
//! A finished bake puts it together in `job`.

use crate::bake::{Encoded, Flat, Settings};
use crate::bends::Bends;
use crate::halves;
use crate::outlines;
use crate::scene::Scene;
use crate::straight;

/// Where a bundle comes from.
pub(crate) struct Origin<'a> {
    pub scene: &'a Scene,
    pub flat: &'a Flat,
    pub encoded: &'a Encoded,
    pub settings: &'a Settings,
    /// Kinds of space that were tried.
    pub spaces: Vec<straight::Trial>,
    /// How surfaces bend, where that tells anything.
    pub bends: Option<Bends>,
    /// Why it has other cells or intervals than usual.
    pub why: Option<String>,
    /// Outlines that were tried.
    pub outlines: Vec<outlines::Trial>,
    /// What texels of half a byte would come to, where that was tried.
    pub halves: Option<halves::Trial>,
    /// Texels were coloured by the pixels that show them.
    pub repainted: bool,
}
