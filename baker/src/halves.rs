//! Texels of half a byte: what a finished bundle would come to with them, for the report. `job` hands in the bundle; nothing changes but its source image.

use crate::atlas::{self, SourceImage};
use crate::bake::BakeError;
use crate::repaint::Painter;
use crate::seen::Seen;
use crate::terminal::grouped;
use cubist_core::format::TexelKind;
use serde::{Deserialize, Serialize};

/// A bundle with texels of half a byte, as many as there were whole ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Its bytes.
    pub bytes: usize,
    /// Mean PSNR against the antialiased scene, dB.
    pub psnr: f64,
    /// What detail is to be worth for as many texels, since they take fewer bytes; none where it makes no difference.
    pub detail: Option<f64>,
}

/// What `bundle` and its source `image`, which `settings` made, come to in the 16 colours that suit best what is played; `None` where that takes no
/// fewer bytes. `weighed`: detail was weighed against bytes.
///
/// # Errors
/// Those of the player.
pub(crate) fn tried(
    bundle: &[u8],
    image: &SourceImage,
    settings: &atlas::Settings,
    weighed: bool,
    (painter, seen): (&Painter, &Seen<'_>),
) -> Result<Option<Trial>, BakeError> {
    let texels = TexelKind::Indexed4;
    let halved = painter.recoloured(bundle, image, &atlas::Settings { texels, ..*settings })?.filter(|halved| halved.len() < bundle.len());
    let detail = settings.detail * atlas::texel_bytes(texels) / atlas::texel_bytes(settings.texels);
    let detail = Some(detail).filter(|detail| weighed && detail.is_finite());
    halved.map(|halved| Ok(Trial { bytes: halved.len(), psnr: seen.psnr(&halved)?, detail })).transpose()
}

/// The same in a line.
#[must_use]
pub fn reason(trial: Trial) -> String {
    let detail = trial.detail.map(|detail| format!(" --detail {detail:.4}")).unwrap_or_default();
    format!(
        "half a byte a texel: {} B, {:.2} dB against truth, or about that, by --texels 4{detail}; a device draws them slower",
        grouped(trial.bytes),
        trial.psnr
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Family;
    use crate::job::bake_scene;
    use crate::options::Options;
    use crate::tune::tests::small;

    #[test]
    fn a_report_tells_of_half_a_byte() {
        let scene = small("street");
        let report = |options| bake_scene(&scene, &options, &|_, _| {}).unwrap().1;
        let usual = report(Options::default());
        let told = usual.source_image.halves.unwrap();
        // The scene brings its charts: there are as many texels either way.
        let halved = report(Options { texels: Some(TexelKind::Indexed4), ..Options::default() });
        let (bytes, psnr) = (halved.bytes.bundle, halved.quality_vs_truth.unwrap().psnr_mean);
        assert!(told.bytes < usual.bytes.bundle * 3 / 4 && told.bytes.abs_diff(bytes) < bytes / 20, "{told:?} {bytes}");
        // Here few pixels show a texel, so that the colour it had before counts.
        assert!((told.psnr - psnr).abs() < 1.0, "{told:?} {psnr}");
        assert_eq!(told.detail, None);
        // Where the baker cuts charts, as many texels take detail that is worth less: five ninths, with the mask.
        let cut = report(Options { charts: Some(Family::Planes.into()), ..Options::default() });
        let trial = cut.source_image.halves.unwrap();
        assert_eq!(trial.detail, Some(0.03 * 5.0 / 9.0));
        assert!(reason(trial).contains("--texels 4 --detail 0.0167"), "{}", reason(trial));
        // Where it is said what texels are, or that there are more colours, or that nothing is to be tried or painted, nothing is told.
        assert_eq!(halved.source_image.halves, None);
        let few = atlas::Settings { colours: 64, ..atlas::Settings::default() };
        for options in
            [Options::default().quick(), Options { plain: true, ..Options::default() }, Options { source: few, ..Options::default() }]
        {
            assert_eq!(report(options).source_image.halves, None);
        }
    }
}
