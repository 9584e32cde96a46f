//! What is cast once for a scene, whatever charts, source images and keys are tried: the rays through all pixels of all frames, and those between them.
//! Scenes come from `job` and the searches; hits go to charting and painting, what lies between them to `tears`.

use crate::gbuffer::Hits;
use crate::scene::Scene;
use crate::trace::Tracer;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Instant;

/// A scene whose rays are cast.
pub struct Cast<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) tracer: Tracer<'a>,
    pub(crate) hits: Hits,
    pub(crate) gaps: Gaps,
    /// Seconds it took, with the tracer if that was made for it.
    pub(crate) seconds: f64,
}

impl<'a> Cast<'a> {
    /// Casts the rays of all frames; `progress` hears what is done, and how much of it, 0..=1.
    #[must_use]
    pub fn new(scene: &'a Scene, progress: &(dyn Fn(&str, f64) + Sync)) -> Self {
        progress("building the hierarchy", 0.0);
        Self::by(Tracer::new(scene), progress)
    }

    /// Likewise, by the tracer of a scene.
    #[must_use]
    pub fn by(tracer: Tracer<'a>, progress: &(dyn Fn(&str, f64) + Sync)) -> Self {
        let (start, scene) = (Instant::now(), tracer.scene());
        let hits = Hits::cast(scene, &tracer, &|done, total| progress("casting rays", done as f64 / total.max(1) as f64));
        let gaps = Gaps::new(&hits);
        let seconds = tracer.seconds + start.elapsed().as_secs_f64();
        Self { scene, tracer, hits, gaps, seconds }
    }
}

/// What is known of the gaps between what neighbouring pixels see. Charts say which of them to look into, but not what is there: of all that are tried
/// on one scene, the first casts the rays.
pub struct Gaps(Vec<AtomicU8>);

/// What is open is known from this many bits further up on.
const KNOWN: u32 = 4;

impl Gaps {
    /// Nothing is known yet.
    fn new(hits: &Hits) -> Self {
        Self(hits.samples.iter().map(|_| AtomicU8::new(0)).collect())
    }

    /// Whether the gap on this `side` of `pixel` is open, which `look` finds out where nobody has yet.
    pub fn open(&self, pixel: usize, side: u8, look: impl FnOnce() -> bool) -> bool {
        // Who looks at the same time sees the same.
        let known = self.0[pixel].load(Ordering::Relaxed);
        if known & side << KNOWN != 0 {
            return known & side != 0;
        }
        let open = look();
        self.0[pixel].fetch_or(side << KNOWN | if open { side } else { 0 }, Ordering::Relaxed);
        open
    }
}
