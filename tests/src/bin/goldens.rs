//! Makes the golden checksums anew: bakes and plays every built-in scene at the reduced setting, writes
//! `fixtures/golden/<scene>.json`, and says on stderr which of them changed.

use anyhow::{Context, Result};
use cubist_baker::scene::builtin;
use cubist_tests::golden;

fn main() -> Result<()> {
    for name in builtin::NAMES {
        let file = golden::file(name);
        let text = serde_json::to_string_pretty(&golden::make(name)?)? + "\n";
        let same = std::fs::read_to_string(&file).is_ok_and(|old| old == text);
        eprintln!("{name}: {}", if same { "as it was" } else { "new" });
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).with_context(|| format!("make {}", folder.display()))?;
        }
        std::fs::write(&file, text).with_context(|| format!("write {}", file.display()))?;
    }
    Ok(())
}
