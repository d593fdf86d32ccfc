//! Search for files whose names were written on other operating systems.

use super::input::decoded;
use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Finds the file that another file, in `folder`, refers to by `name`.
///
/// Names from other systems are accepted. If no file has the exact name, `\` separates folders like
/// `/`, letter case is ignored, and blanks match underscores. The bytes of a file name may be UTF-8
/// or Windows-1252. If several files or folders match, the first in the order of their names is
/// returned.
pub fn find_file(folder: &Path, name: &str) -> Option<PathBuf> {
    FileFinder::default().find(folder, name)
}

/// Name of the file in a path of any operating system: the last part of the path. `None` if the
/// path ends in `/` or `\`, as paths of drives and folders do.
pub fn base_name(name: &str) -> Option<&str> {
    let base = name.rsplit(['/', '\\']).next();
    base.filter(|base| !base.is_empty() && *base != "..")
}

/// Returns the name without the quotes around it.
pub fn unquoted(name: &str) -> &str {
    let inner = ['"', '\''].map(|quote| name.strip_prefix(quote)?.strip_suffix(quote));
    inner.into_iter().flatten().next().unwrap_or(name).trim()
}

/// Parent folder of `folder`.
pub fn folder_above(folder: &Path) -> PathBuf {
    match folder.components().next_back() {
        Some(Component::Normal(_)) => folder.parent().unwrap_or(Path::new("")).to_path_buf(),
        _ => folder.join(".."),
    }
}

/// Finds files like [`find_file`], but lists each folder only once for all searches.
#[derive(Debug, Default)]
pub struct FileFinder {
    /// For each folder, the names of its entries. The key of a name is the name in lower case. If
    /// several names have the same key, the first in alphabetical order is stored.
    listings: HashMap<PathBuf, HashMap<String, OsString>>,
    /// For each folder, the result of [`FileFinder::folders_within`].
    folders: HashMap<PathBuf, Vec<PathBuf>>,
}

/// Maximum number of entries of a folder that are read.
const MAX_ENTRIES: usize = 10_000;
/// Maximum number of subfolders of a folder of a single model. A folder with more subfolders is not
/// searched.
const MAX_FOLDERS: usize = 32;

impl FileFinder {
    /// Finds the file that another file, in `folder`, refers to by `name`.
    pub fn find(&mut self, folder: &Path, name: &str) -> Option<PathBuf> {
        let exact = folder.join(name);
        if is_there(&exact) {
            return Some(exact);
        }
        let mut path = folder.to_path_buf();
        for component in Path::new(&with_slashes(name)).components() {
            path = match component {
                Component::Normal(part) => self.find_entry(&path, part)?,
                other => path.join(other),
            };
        }
        is_there(&path).then_some(path)
    }

    /// Subfolders of `folder` that may belong to the same model, sorted by name. Hidden folders are
    /// excluded, and so are folders of other models, which contain an OBJ or MTL file. The result
    /// is empty for the root, for the folder of temporary files, and for a folder with more than 32
    /// subfolders.
    pub fn folders_within(&mut self, folder: &Path) -> &[PathBuf] {
        let found = self.folders.entry(folder.to_path_buf());
        found.or_insert_with(|| {
            let whole = listed(folder).canonicalize().unwrap_or_default();
            if whole.parent().is_none() || std::env::temp_dir().canonicalize().is_ok_and(|temp| temp == whole) {
                return Vec::new();
            }
            let is_visible = |path: &PathBuf| path.file_name().is_some_and(|name| !lowercase(name).starts_with('.'));
            let mut folders: Vec<PathBuf> = entries_of(folder)
                .filter(|path| is_visible(path) && path.is_dir())
                .collect();
            if folders.len() > MAX_FOLDERS {
                return Vec::new();
            }
            let is_model = |path: PathBuf| {
                let extension = path.extension().map(lowercase);
                extension.is_some_and(|extension| matches!(&*extension, "obj" | "mtl"))
            };
            folders.retain(|folder| !entries_of(folder).any(is_model));
            folders.sort_unstable();
            folders
        })
    }

    /// Finds the entry of `folder` with the name `name`. Letter case is ignored, and blanks match
    /// underscores.
    fn find_entry(&mut self, folder: &Path, name: &OsStr) -> Option<PathBuf> {
        let exact = folder.join(name);
        if exact.exists() {
            return Some(exact);
        }
        if !self.listings.contains_key(folder) {
            self.listings.insert(folder.to_path_buf(), listing(folder));
        }
        let entries = self.listings.get(folder)?;
        let wanted = lowercase(name);
        let found = entries.get(&wanted).or_else(|| {
            // Blanks match underscores, in both directions.
            let is_alike =
                |entry: &&String| entry.len() == wanted.len() && entry.replace(' ', "_") == wanted.replace(' ', "_");
            entries.get(entries.keys().filter(is_alike).min()?)
        })?;
        Some(folder.join(found))
    }
}

/// Names of the entries of `folder`. The key of a name is the name in lower case. If several names
/// have the same key, the first in alphabetical order is stored. Empty if the folder cannot be
/// read.
fn listing(folder: &Path) -> HashMap<String, OsString> {
    let mut entries: HashMap<String, OsString> = HashMap::new();
    for entry in fs::read_dir(listed(folder)).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let first = entries.entry(lowercase(&name)).or_insert_with(|| name.clone());
        if name < *first {
            *first = name;
        }
    }
    entries
}

/// Paths of at most `MAX_ENTRIES` entries of `folder`. Empty if the folder cannot be read.
fn entries_of(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(listed(folder)).into_iter().flatten().flatten();
    let names = entries.take(MAX_ENTRIES).map(|entry| entry.file_name());
    names.map(move |name| folder.join(name))
}

fn lowercase(name: &OsStr) -> String {
    decoded(name.as_encoded_bytes()).to_lowercase()
}

/// Returns true if `path` exists and is not a folder. The file may be unreadable.
fn is_there(path: &Path) -> bool {
    path.metadata().is_ok_and(|metadata| !metadata.is_dir())
}

/// Returns true if `name` differs from the name of `found`, for example in letter case. `found` is
/// the file that [`find_file`] returned for `name`. Slashes and backslashes count as equal.
pub fn case_differs(folder: &Path, name: &str, found: &Path) -> bool {
    found != folder.join(name) && found != folder.join(with_slashes(name))
}

/// Number of files in the folder of `found` whose names equal the name of `found` if letter case is
/// ignored.
pub(crate) fn count_alike(found: &Path) -> usize {
    let Some(wanted) = found.file_name().map(lowercase) else {
        return 0;
    };
    let entries = fs::read_dir(listed(found.parent().unwrap_or(Path::new(""))));
    let names = entries
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.file_name()));
    names.filter(|name| lowercase(name) == wanted).count()
}

/// Path of the folder that `read_dir` accepts: `.` in place of an empty path.
fn listed(folder: &Path) -> &Path {
    if folder == Path::new("") {
        Path::new(".")
    } else {
        folder
    }
}

fn with_slashes(name: &str) -> String {
    name.replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_a_base_and_folders_a_parent() {
        for (name, base) in [
            ("C:\\a\\b.mtl", Some("b.mtl")),
            ("a/b.mtl", Some("b.mtl")),
            ("b", Some("b")),
            ("a/", None),
        ] {
            assert_eq!(base_name(name), base, "{name}");
        }
        for (name, inner) in [
            ("\"a b\"", "a b"),
            ("' a'", "a"),
            ("\"a", "\"a"),
            ("\"", "\""),
            ("a", "a"),
        ] {
            assert_eq!(unquoted(name), inner, "{name}");
        }
        for (folder, above) in [("", ".."), ("a", ""), ("a/b", "a"), ("..", "../.."), (".", "./..")] {
            assert_eq!(folder_above(Path::new(folder)), Path::new(above), "{folder}");
        }
    }

    #[test]
    fn names_of_other_systems_find_their_file() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        fs::create_dir_all(folder.join("Textures/inner")).unwrap();
        for name in [
            "a.mtl",
            "Textures/Brick.PNG",
            "Textures/inner/x y.png",
            "B.mtl",
            "b.MTL",
        ] {
            fs::write(folder.join(name), name).unwrap();
        }
        // Name, expected file, and true if the name differs from the file in letter case. On
        // systems that ignore letter case, the last value is false.
        let cases = [
            ("a.mtl", Some("a.mtl"), false),
            ("./a.mtl", Some("a.mtl"), false),
            (".\\Textures\\Brick.PNG", Some("Textures/Brick.PNG"), false),
            ("textures\\brick.png", Some("Textures/Brick.PNG"), true),
            ("TEXTURES/inner\\X Y.png", Some("Textures/inner/x y.png"), true),
            ("Textures/inner/x_y.png", Some("Textures/inner/x y.png"), true),
            ("Textures/../A.MTL", Some("a.mtl"), true),
            ("b.mtl", Some("B.mtl"), true),
            ("b.MTL", Some("b.MTL"), false),
            ("Textures", None, false),
            ("gone/a.mtl", None, false),
            ("", None, false),
            ("..", None, false),
            ("a\0b", None, false),
        ];
        for (name, file, differs) in cases {
            let found = find_file(folder, name);
            let content = found.as_ref().map(|path| fs::read_to_string(path).unwrap());
            if !folder.join("A.MTL").exists() {
                assert_eq!(content.as_deref(), file, "{name}");
                assert!(
                    found.is_none_or(|path| case_differs(folder, name, &path) == differs),
                    "{name}"
                );
            }
        }
        if !folder.join("A.MTL").exists() {
            let counts = ["a.mtl", "b.MTL", "gone.mtl"].map(|name| count_alike(&folder.join(name)));
            assert_eq!(counts, [1, 2, 0]);
        }
        let absolute = folder.join("A.mtl");
        assert!(find_file(Path::new("elsewhere"), absolute.to_str().unwrap()).is_some());
        assert_eq!(find_file(Path::new(""), "CARGO.toml"), Some("Cargo.toml".into()));
    }
}
