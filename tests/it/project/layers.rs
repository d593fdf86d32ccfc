//! Imports have one direction: a module may use only modules below it (docs/architecture.md).

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, Macro, Meta, UseTree};

/// Modules of both crates from the bottom up; modules of one row do not depend on each other.
const ROWS: &[&[&str]] = &[
    &["math", "files"],
    &["sampling", "color", "parameter"],
    &["bsdf", "geometry", "sampler", "texture"],
    &["material", "light", "camera", "light_paths"],
    &["light_sampling", "film"],
    &["scene", "denoise", "compare"],
    &["accel"],
    &["integrator", "guess"],
    &["options"],
    &["io", "render"],
    &["pipeline", "lint"],
    &["scene_file"],
    &["session"],
    &["view"],
    &["cli"],
];

/// Full name of a module or item, without `crate`.
type Name = Vec<String>;

/// Imports of the files of src, without tests.
struct Imports {
    /// Names mentioned by each module, with `crate`, `self` and `super` resolved.
    mentions: BTreeMap<Name, Vec<Name>>,
    /// Names that `use` adds to each module: short name and full name.
    aliases: BTreeMap<Name, BTreeMap<String, Name>>,
    /// Modules that write Debug text, except in failures of the program itself.
    debug_writers: BTreeSet<Name>,
}

impl Imports {
    fn read() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut imports = Self {
            mentions: BTreeMap::new(),
            aliases: BTreeMap::new(),
            debug_writers: BTreeSet::new(),
        };
        let is_code = |file: &PathBuf| file.extension().is_some_and(|extension| extension == "rs");
        for file in files(&root).into_iter().filter(is_code) {
            let mut name: Name = file
                .strip_prefix(&root)
                .unwrap()
                .with_extension("")
                .iter()
                .map(|part| part.to_str().unwrap().to_string())
                .collect();
            // The renderer is a separate crate. The main crate has its modules under the same
            // names.
            if name.first().is_some_and(|first| first == "core") {
                name.remove(0);
            }
            if name == ["build"] {
                continue;
            }
            if name.last().is_some_and(|last| last == "mod") {
                name.pop();
            }
            if name == ["main"] || name == ["lib"] {
                name.clear();
            }
            let code = syn::parse_file(&fs::read_to_string(&file).unwrap())
                .unwrap_or_else(|error| panic!("{}: {error}", file.display()));
            let mut reader = Reader {
                module: name.clone(),
                mentions: Vec::new(),
                aliases: BTreeMap::new(),
                writes_debug: false,
            };
            reader.visit_file(&code);
            if reader.writes_debug {
                imports.debug_writers.insert(name.clone());
            }
            imports
                .mentions
                .entry(name.clone())
                .or_default()
                .extend(reader.mentions);
            imports.aliases.entry(name).or_default().extend(reader.aliases);
        }
        imports
    }

    /// Module that defines the item `name`.
    fn home(&self, name: &[String], depth: usize) -> Name {
        let mut module = Name::new();
        for (i, part) in name.iter().enumerate() {
            let child = [&module[..], std::slice::from_ref(part)].concat();
            if self.mentions.contains_key(&child) {
                module = child;
                continue;
            }
            let aliases = self.aliases.get(&module).filter(|_| depth < 10);
            if let Some(full) = aliases.and_then(|aliases| aliases.get(part)) {
                return self.home(&[full, &name[i + 1..]].concat(), depth + 1);
            }
            break;
        }
        module
    }
}

/// Collects the names in one file that start with `crate`, `self` or `super`.
struct Reader {
    module: Name,
    mentions: Vec<Name>,
    aliases: BTreeMap<String, Name>,
    writes_debug: bool,
}

impl Reader {
    /// Full name of a path, if it is in this crate.
    fn resolve(&self, path: &[String]) -> Option<Name> {
        let mut full = match path.first()?.as_str() {
            "crate" => Name::new(),
            "self" | "super" => self.module.clone(),
            _ => return None,
        };
        for part in path {
            match part.as_str() {
                "crate" | "self" => {}
                "super" => drop(full.pop()),
                _ => full.push(part.clone()),
            }
        }
        Some(full)
    }

    fn mention(&mut self, path: &[String]) {
        // In methods, `self` is a value.
        let is_value = path == ["self"];
        self.mentions.extend(self.resolve(path).filter(|_| !is_value));
    }

    /// All paths of a `use` tree, with their short names.
    fn leaves(tree: &UseTree, prefix: Name, leaves: &mut Vec<(String, Name)>) {
        let with = |part: &syn::Ident| [&prefix[..], &[part.to_string()]].concat();
        match tree {
            UseTree::Path(path) => Self::leaves(&path.tree, with(&path.ident), leaves),
            UseTree::Group(group) => group
                .items
                .iter()
                .for_each(|tree| Self::leaves(tree, prefix.clone(), leaves)),
            UseTree::Name(name) if name.ident == "self" => {
                leaves.push((prefix.last().cloned().unwrap_or_default(), prefix));
            }
            UseTree::Name(name) => leaves.push((name.ident.to_string(), with(&name.ident))),
            UseTree::Rename(rename) => leaves.push((rename.rename.to_string(), with(&rename.ident))),
            UseTree::Glob(_) => leaves.push(("*".into(), prefix)),
        }
    }
}

impl<'ast> Visit<'ast> for Reader {
    fn visit_item(&mut self, item: &'ast Item) {
        // Tests may import any module.
        if attributes(item).iter().any(is_for_tests) {
            return;
        }
        visit::visit_item(self, item);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let mut leaves = Vec::new();
        Self::leaves(&item.tree, Name::new(), &mut leaves);
        for (short, path) in leaves {
            // A path `part::Item` without a prefix is a submodule or another crate.
            let full = self.resolve(&path).unwrap_or([&self.module[..], &path].concat());
            self.mention(&path);
            self.aliases.insert(short, full);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let parts: Name = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.mention(&parts);
        visit::visit_path(self, path);
    }

    /// Arguments of macros are not parsed into a syntax tree, so paths are searched in their text.
    fn visit_macro(&mut self, call: &'ast Macro) {
        visit::visit_macro(self, call);
        let text = call.tokens.to_string().replace(' ', "");
        let name = call
            .path
            .segments
            .last()
            .map_or(String::new(), |last| last.ident.to_string());
        let is_failure = name.contains("assert") || matches!(name.as_str(), "panic" | "unreachable");
        self.writes_debug |= !is_failure && has_debug_format(&text);
        for start in ["crate::", "super::"] {
            for (i, _) in text.match_indices(start) {
                let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
                let path = text[i..].split(|c| !is_part(c)).next().unwrap();
                let parts: Name = path.split("::").filter(|p| !p.is_empty()).map(String::from).collect();
                self.mention(&parts);
            }
        }
    }
}

/// Returns true if a format string has Debug text, such as `{:?}` and `{value:.3?}`.
fn has_debug_format(text: &str) -> bool {
    text.match_indices("?}").any(|(end, _)| {
        let format = text[..end].rsplit('{').next().unwrap();
        let is_part = |c: char| c.is_alphanumeric() || "_:.#$".contains(c);
        format.contains(':') && format.chars().all(is_part)
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Returns true for `#[cfg(test)]`.
fn is_for_tests(attribute: &Attribute) -> bool {
    match &attribute.meta {
        Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string() == "test",
        _ => false,
    }
}

/// Returns true for a file of a module declared as `#[cfg(test)] mod tests;`.
fn is_test_file(path: &Path) -> bool {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut parts = path.strip_prefix(&root).into_iter().flatten();
    path.ends_with("tests.rs") || parts.any(|part| part == "tests")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries
        .flat_map(|p| if p.is_dir() { files(&p) } else { vec![p] })
        .filter(|path| !is_test_file(path))
        .collect()
}

#[test]
fn imports_run_downwards() {
    let imports = Imports::read();
    let level = |room: &str| ROWS.iter().position(|row| row.contains(&room));
    let mut checked = 0;
    for (module, mentions) in &imports.mentions {
        let Some(room) = module.first() else { continue };
        let own = level(room).unwrap_or_else(|| panic!("src/{room} has no row in this test"));
        for name in mentions {
            let Some(other) = name.first() else { continue };
            let Some(other_level) = level(other) else { continue };
            checked += usize::from(other != room);
            assert!(
                other == room || other_level < own,
                "{} uses {}",
                module.join("::"),
                name.join("::")
            );
        }
    }
    assert!(checked > 500, "only {checked} imports were seen");
}

/// Imports after the first `#[cfg(test)]` of a file are also found.
#[test]
fn imports_behind_tests_are_seen() {
    let mut reader = Reader {
        module: vec!["color".into(), "spectrum".into()],
        mentions: Vec::new(),
        aliases: BTreeMap::new(),
        writes_debug: false,
    };
    let code = "#[cfg(test)] mod tests; #[cfg(test)] use crate::cli; use super::srgb;
        fn f() { crate::math::g(); assert!(super::tone::h() == crate::io::i::J); }";
    reader.visit_file(&syn::parse_file(code).unwrap());
    let names: Vec<String> = reader.mentions.iter().map(|name| name.join("::")).collect();
    assert_eq!(names, ["color::srgb", "math::g", "io::i::J", "color::tone::h"]);
}

/// Modules of one folder do not import each other in a cycle, directly or indirectly. A module and
/// its submodules may import each other.
#[test]
fn sibling_modules_have_no_import_cycles() {
    let imports = Imports::read();
    // Collect the imports between the modules of each folder
    let mut folders: BTreeMap<Name, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (module, mentions) in &imports.mentions {
        for name in mentions {
            let home = imports.home(name, 0);
            let common = module.iter().zip(&home).take_while(|(a, b)| a == b).count();
            if let (Some(from), Some(to)) = (module.get(common), home.get(common)) {
                let folder = folders.entry(module[..common].to_vec()).or_default();
                folder.entry(from.clone()).or_default().insert(to.clone());
            }
        }
    }
    let edges: usize = folders.values().flat_map(BTreeMap::values).map(BTreeSet::len).sum();
    assert!(edges > 100, "{edges} imports between the modules of one folder");
    let circles: Vec<String> = folders
        .iter()
        .flat_map(|(folder, edges)| circles(edges).map(|circle| format!("{}: {circle}", folder.join("::"))))
        .collect();
    assert!(
        circles.is_empty(),
        "modules import each other in a circle: {circles:#?}"
    );
}

/// Groups of modules that import each other in a cycle, each as its names.
fn circles(edges: &BTreeMap<String, BTreeSet<String>>) -> impl Iterator<Item = String> {
    let reached: BTreeMap<&String, BTreeSet<&String>> =
        edges.keys().map(|from| (from, reachable(edges, from))).collect();
    let mut found = BTreeSet::new();
    for (from, to) in &reached {
        let is_mutual = |other: &&&String| reached.get(**other).is_some_and(|back| back.contains(from));
        if to.contains(from) {
            let circle: Vec<&str> = to.iter().filter(is_mutual).map(|name| name.as_str()).collect();
            found.insert(circle.join(" "));
        }
    }
    found.into_iter()
}

#[test]
fn circles_are_found() {
    let edges = |pairs: &[(&str, &str)]| {
        let mut edges: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (from, to) in pairs {
            edges.entry(from.to_string()).or_default().insert(to.to_string());
        }
        edges
    };
    let found = |pairs: &[(&str, &str)]| circles(&edges(pairs)).collect::<Vec<_>>();
    assert_eq!(
        found(&[("a", "b"), ("b", "c"), ("c", "a"), ("c", "d"), ("e", "a")]),
        ["a b c"]
    );
    assert_eq!(found(&[("a", "b"), ("b", "a"), ("c", "d"), ("d", "c")]), ["a b", "c d"]);
    assert!(found(&[("a", "b"), ("b", "c"), ("a", "c")]).is_empty());
}

/// All modules that `from` imports, directly or indirectly.
fn reachable<'a>(edges: &'a BTreeMap<String, BTreeSet<String>>, from: &str) -> BTreeSet<&'a String> {
    let mut reached = BTreeSet::new();
    let mut next: Vec<&String> = edges.get(from).into_iter().flatten().collect();
    while let Some(module) = next.pop() {
        if reached.insert(module) {
            next.extend(edges.get(module).into_iter().flatten());
        }
    }
    reached
}

/// Files, hashes and users get no Debug text of Rust, because this text changes with the names of
/// types.
#[test]
fn debug_text_is_only_in_failures() {
    let writers = Imports::read().debug_writers;
    assert!(writers.is_empty(), "{writers:?}");
}

/// The render commands use only the interface of the library. These commands do not import
/// lower modules.
#[test]
fn command_line_uses_the_library_only() {
    let imports = Imports::read();
    let allowed = [
        "accel::Auditor",
        "accel::BackendInfo",
        "camera",
        "session",
        "io",
        "files",
        "render",
        "compare",
        "film",
        "color",
        "denoise",
        "scene_file",
        "cli",
    ];
    for file in [
        "run",
        "outputs",
        "outputs/images",
        "stop",
        "summary",
        "checkpointer",
        "merge",
        "tev",
        "clock",
        "progress",
    ] {
        let module: Name = ["cli"].into_iter().chain(file.split('/')).map(String::from).collect();
        let mentions = &imports.mentions[&module];
        assert!(!mentions.is_empty());
        for name in mentions {
            let name = name.join("::");
            let is_allowed = allowed
                .iter()
                .any(|a| name == *a || name.starts_with(&format!("{a}::")));
            assert!(is_allowed, "cli/{file}.rs uses {name}");
        }
    }
}

/// Commands outside of the laboratory do not import it. `cli/mod.rs` calls its commands.
#[test]
fn commands_do_not_use_the_laboratory() {
    let imports = Imports::read();
    let is_inside = |name: &Name| name.len() > 1 && name[..2] == ["cli", "laboratory"];
    assert!(imports.mentions.keys().filter(|module| is_inside(module)).count() > 5);
    for (module, mentions) in imports.mentions.iter().filter(|(module, _)| !is_inside(module)) {
        let used = mentions.iter().find(|name| is_inside(&imports.home(name, 0)));
        assert!(used.is_none(), "{} uses {used:?}", module.join("::"));
    }
}

/// The lint `unsafe_code` is denied everywhere except in the folder of Embree.
#[test]
fn unsafe_code_is_allowed_in_one_folder() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = fs::read_to_string(root.join("Cargo.toml")).unwrap();
    assert!(manifest.contains("unsafe_code = \"deny\""));
    let folders = ["src", "tests", "benches", "examples"].map(|name| root.join(name));
    let allowing: Vec<PathBuf> = folders
        .iter()
        .flat_map(|folder| files(folder))
        .filter(|path| path.extension().is_some_and(|e| e == "rs") && !path.ends_with("layers.rs"))
        .filter(|path| fs::read_to_string(path).unwrap().contains("unsafe_code"))
        .collect();
    assert_eq!(allowing, [root.join("src/core/accel/embree/mod.rs")]);
    // These two folders are outside the lints of the workspace: the macros of pyo3 make unsafe
    // code, and fuzz targets are a separate workspace.
    for path in ["python/src", "tests/fuzz"]
        .iter()
        .flat_map(|folder| files(&root.join(folder)))
    {
        let is_code = path.extension().is_some_and(|e| e == "rs");
        assert!(
            !is_code || !fs::read_to_string(&path).unwrap().contains("unsafe"),
            "{}",
            path.display()
        );
    }
}
