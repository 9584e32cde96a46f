//! An inspection as lines of text, for people: a paragraph for each part of the bundle.

use super::{ImageInfo, Inspection, MaskInfo, PlaneInfo};
use cubist_core::format::TexelKind;

/// Lines of text.
struct Lines(String);

impl Lines {
    /// Adds one, without blanks at its end.
    fn add(&mut self, line: &str) {
        self.0.push_str(line.trim_end());
        self.0.push('\n');
    }
}

impl Inspection {
    /// The inspection as lines of text.
    #[must_use]
    pub fn text(&self) -> String {
        let mut lines = Lines(String::new());
        self.tell_sections(&mut lines);
        self.tell_path(&mut lines);
        self.tell_image(&mut lines);
        self.tell_labels(&mut lines);
        self.tell_limits(&mut lines);
        lines.0
    }

    fn tell_sections(&self, lines: &mut Lines) {
        lines.add(&format!("Cubist bundle, format version {}, {} bytes, checksum {}", self.version, self.bytes, self.checksum));
        if let Some(info) = &self.info {
            lines.add(&format!("  about  {}", info.escape_debug()));
        }
        lines.add("");
        lines.add(&format!("{:>8} {:>9}  {:7}  holds", "offset", "bytes", "section"));
        for s in &self.sections {
            let note = if s.required { "" } else { " (a player may skip it)" };
            lines.add(&format!("{:>8} {:>9}  {:7}  {}{note}", s.offset, s.bytes, s.tag.escape_debug(), s.holds));
        }
        lines.add(&format!("{:>8} {:>9}  {:7}  magic, version, section headers, checksum", "", self.envelope_bytes, ""));
        lines.add("");
    }

    /// The path, its keys and its planes.
    fn tell_path(&self, lines: &mut Lines) {
        let (p, [width, height]) = (&self.path, self.path.size);
        let looping = if p.looping { "yes" } else { "no" };
        lines.add(&format!("PATH  {} frames of {width} x {height} at {} frames/s, looping: {looping}", p.frames, p.fps));
        lines.add(&format!(
            "      grid: {} x {} cells of {} pixels; time: {}; space: {}; coordinates in 1/{} texel",
            p.cells[0], p.cells[1], p.cell, p.time, p.space, p.steps_a_texel
        ));
        lines.add(&format!(
            "      keys: {}, table {} bytes, planes {} bytes, cameras {} bytes, records {} bytes, {:.1} bytes a frame",
            self.keys.len(),
            p.table_bytes,
            p.plane_bytes,
            p.camera_bytes,
            p.record_bytes,
            self.key_bytes() as f64 / f64::from(p.frames)
        ));
        let vector = |[x, y, z]: [i32; 3]| format!("({x}, {y}, {z})");
        for (index, key) in self.keys.iter().enumerate() {
            lines.add(&format!(
                "      key {index:>4} at frame {:>5} {:>8} bytes  {:11}{}",
                key.frame,
                key.bytes,
                if key.independent { "independent" } else { "" },
                key.eye.map_or_else(String::new, |eye| format!("  eye {}", vector(eye)))
            ));
        }
        for plane in &self.planes {
            let PlaneInfo { label, shift, origin, along_u, along_v } = *plane;
            let (origin, u, v) = (vector(origin), vector(along_u), vector(along_v));
            lines.add(&format!("      plane of label {label:>3}  {origin} + u {u} + v {v}; u, v in 1/{} texel", 1u64 << shift.min(63)));
        }
    }

    /// The source image, its mask and its palette.
    fn tell_image(&self, lines: &mut Lines) {
        let image = &self.image;
        let texels = f64::from(image.size[0] * image.size[1]);
        let covered = image.mask.map_or_else(
            || "all".to_owned(),
            |mask| format!("{}, {:.1} %", mask.covered_texels, 100.0 * mask.covered_texels as f64 / texels),
        );
        lines.add(&format!("ATLS  {} x {} texels, {}; covered: {covered}", image.size[0], image.size[1], image.texel()));
        lines.add(&format!("      {}", image.storage()));
        if let Some(MaskInfo { bits_a_texel: bits, tiles, blocks, .. }) = image.mask {
            lines.add(&format!("      mask: {bits} x {bits} bits a texel; {blocks} different blocks in {tiles} tiles of 8 x 8 bits"));
        }
        for (index, row) in self.palette.chunks(12).enumerate() {
            lines.add(&format!("      colours from {:>3}  {}", index * 12, row.join(" ")));
        }
    }

    fn tell_labels(&self, lines: &mut Lines) {
        lines.add(&format!("LABL  {} labels", self.labels.len()));
        for (index, label) in self.labels.iter().enumerate() {
            let [x0, y0, x1, y1] = label.rect;
            let fixed = match (label.origin, label.step) {
                (Some([u, v]), Some([du, dv])) => format!("  fixed to the screen: ({u:.3}, {v:.3}) + ({du:.5}, {dv:.5}) a pixel"),
                _ => String::new(),
            };
            lines.add(&format!(
                "      label {index:>3}  {x0:>4}..{x1:<4} x {y0:>4}..{y1:<4}{}{}{fixed}",
                if label.masked { "  masked" } else { "" },
                if label.strip { "  strip" } else { "" }
            ));
        }
    }

    /// What playing takes.
    fn tell_limits(&self, lines: &mut Lines) {
        let l = &self.limits;
        lines.add(&format!("Memory  {} bytes of working memory and a row of {} bytes", self.workspace, self.path.size[0] * 2));
        lines.add(&format!(
            "Limits  a key: {} layers in {} chains, room for {} with {} fields, {} bytes of sheet lists; a row: {} layers in {} chains, {} sheets; a \
             cell: {} sheets; a seek: {} keys",
            l.key_layers,
            l.key_chains,
            l.key_fields,
            l.fields,
            l.list_bytes,
            l.row_layers,
            l.row_chains,
            l.row_sheets,
            l.cell_sheets,
            l.seek_keys
        ));
    }
}

impl ImageInfo {
    /// What a texel is.
    fn texel(&self) -> String {
        match self.texels {
            TexelKind::Indexed8 => format!("8 bits each, {} colours", self.colours),
            TexelKind::Indexed4 => format!("4 bits each, {} colours", self.colours),
            TexelKind::Direct565 => "RGB565 each, no palette".to_owned(),
        }
    }

    /// How the image is stored, and what that takes.
    fn storage(&self) -> String {
        let Self { packed, stored_bytes, raw_bytes, .. } = *self;
        if packed {
            let percent = 100.0 * stored_bytes as f64 / raw_bytes.max(1) as f64;
            format!("packed: {stored_bytes} bytes with the mask, {percent:.1} % of the {raw_bytes} that it takes in working memory")
        } else {
            format!("raw: {raw_bytes} bytes with the mask, read where they lie, no working memory")
        }
    }
}
