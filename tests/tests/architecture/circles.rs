//! Who imports whom, and where that leads back to where it began.
//! Sources come in; modules that are in a circle go to `architecture`.

use super::source::{self, Source};
use std::collections::{BTreeMap, BTreeSet};

/// Modules, each with those that it imports.
pub type Imports = BTreeMap<String, BTreeSet<String>>;

/// Those that import what imports them, by whatever way.
#[must_use]
pub fn circles(mut imports: Imports) -> Vec<String> {
    // What imports nothing that is left is in no circle.
    let leaf =
        |left: &Imports| left.iter().find(|(_, named)| named.iter().all(|name| !left.contains_key(name))).map(|(name, _)| name.clone());
    while let Some(name) = leaf(&imports) {
        imports.remove(&name);
    }
    // What imports one is left, too: only what is imported by another of them.
    let circle = imports.keys().filter(|name| imports.values().any(|named| named.contains(*name)));
    circle.map(|name| format!("{name}: imports what imports it: {:?}", imports[name])).collect()
}

/// The imports among the files of `folder`, a folder in it being one of them. `mod` holds what stands in `mod.rs`: it does not import what it only
/// hands on, and who takes that from there imports the file that it comes from.
#[must_use]
pub fn inside(folder: &str, sources: &[Source]) -> Imports {
    let below = || sources.iter().filter_map(|source| source.path.strip_prefix(folder).map(|name| (name.trim_end_matches(".rs"), source)));
    let files: BTreeSet<&str> = below().map(|(name, _)| name.split('/').next().unwrap_or(name)).collect();
    let own = below().find(|(name, _)| *name == "mod").map(|(_, source)| source.code_without_tests()).unwrap_or_default();
    let handed_on: BTreeMap<String, String> = source::reexports(&own).into_iter().collect();
    let home = |name: &str| files.get(name).map_or_else(|| handed_on.get(name).map_or("mod", String::as_str), |file| *file).to_owned();
    let path = format!("crate::{}::", folder.trim_start_matches("baker/src/").trim_end_matches('/').replace('/', "::"));
    let mut imports = Imports::new();
    for (name, source) in below() {
        let (file, inner) = name.split_once('/').unwrap_or((name, ""));
        let code = source.code_without_tests();
        let mut named: BTreeSet<String> = source::imports(&code, &path).iter().map(|name| home(name)).collect();
        if matches!(inner, "" | "mod") {
            named.extend(source::imports(&code, "super::").iter().map(|name| home(name)));
        }
        if name == "mod" {
            named = used(&code)
                .filter_map(|name| files.get(name).map(|file| (*file).to_owned()).or_else(|| handed_on.get(name).cloned()))
                .collect();
        }
        named.remove(file);
        imports.entry(file.to_owned()).or_default().extend(named);
    }
    imports
}

/// What `code` names at the beginning of a path, and what it calls, but for what it hands on.
fn used(code: &str) -> impl Iterator<Item = &str> {
    let statements = code.split_inclusive(';').filter(|statement| source::reexports(statement).is_empty());
    let named = |statement| {
        source::words(statement).filter(move |(at, word): &(usize, &str)| {
            let (before, after) = (&statement[..*at], &statement[at + word.len()..]);
            let called = after.starts_with("::") || after.starts_with('(') || word.starts_with(char::is_uppercase);
            called && !before.ends_with("::") && !before.ends_with('.') && !before.ends_with("fn ")
        })
    };
    statements.flat_map(named).map(|(_, word)| word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_found_by_whatever_way() {
        let file = |name: &str, text: &str| Source { path: format!("baker/src/shop/{name}.rs"), text: text.to_owned() };
        let shop = |door: &str| {
            let inner = "mod door;\nmod goods;\npub use door::Door;\npub struct Till;\n";
            let sources = [
                file("mod", inner),
                file("door", door),
                file("goods/mod", "use super::Till;"),
                file("goods/bread", "use super::oven;\nuse crate::shop::Door;"),
            ];
            circles(inside("baker/src/shop/", &sources))
        };
        assert!(shop("use super::Till; // super::goods").is_empty());
        // What a folder's own files import counts as the folder's.
        assert_eq!(shop("use super::{Till, goods};").len(), 2);
        let calling = [
            file("mod", "mod door;\npub use door::open;\npub fn come() { open(); }\n"),
            file("door", "use super::come;\npub fn open() {}\n"),
        ];
        assert_eq!(circles(inside("baker/src/shop/", &calling)).len(), 2);
    }
}
