//! Material libraries of an OBJ file: their paths and their materials.
//!
//! If a library is not at its path in the OBJ file, its base name is searched beside the OBJ file
//! and in the parent folder. If no library is found at all, a library with the name of the OBJ file
//! is used.

use crate::files::find_file::{FileFinder, base_name, case_differs, count_alike, folder_above, unquoted};
use crate::io::mtl::{FileMaterial, ObjContext, library_path, load_mtl};
use crate::io::statements::possible_names;
use crate::io::{FileError, Findings, LoadOptions, Position, Severity};
use crate::math::excerpt_of_path;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// A `mtllib` statement.
#[derive(Clone, Debug)]
pub(in crate::io) struct LibraryName {
    /// Text after the keyword.
    pub text: String,
    /// Text after the keyword, including text that begins with `#`. The `#` may begin a comment or
    /// be part of a name. `None` if the line has no such text.
    pub whole: Option<String>,
    /// Line of the statement.
    pub line: usize,
}

/// A library of an OBJ file.
#[derive(Debug)]
pub(in crate::io) struct ObjLibrary {
    /// Name in the OBJ file; empty if the file names no library.
    pub name: String,
    /// Line that names the library; 0 if no line names it.
    pub line: usize,
    /// Path of the file, if it exists.
    pub path: Option<PathBuf>,
    /// True if the file is not in the place that the OBJ file names, or has another name.
    is_elsewhere: bool,
}

/// Libraries that an OBJ file names, each once. If no library is found and `may_use` is true, the
/// library with the name of the OBJ file is used.
pub(in crate::io) fn find_libraries(obj: &Path, named: &[LibraryName], may_use: bool) -> Vec<ObjLibrary> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let mut finder = FileFinder::default();
    let mut seen = HashSet::new();
    let mut all = Vec::new();
    for statement in named {
        for name in names(&mut finder, folder, statement) {
            if !seen.insert(name.clone()) {
                continue;
            }
            let found = find_near(&mut finder, folder, &name);
            let (path, is_elsewhere) = found.map_or((None, false), |(path, is)| (Some(path), is));
            let line = statement.line;
            all.push(ObjLibrary {
                name,
                line,
                path,
                is_elsewhere,
            });
        }
    }
    let is_any_found = all.iter().any(|library| library.path.is_some());
    let of_same_name = (!is_any_found && may_use).then(|| find_of_same_name(&mut finder, obj));
    if let Some(path) = of_same_name.flatten() {
        let first = all.into_iter().next();
        let (name, line) = first.map_or((String::new(), 0), |library| (library.name, library.line));
        return vec![ObjLibrary {
            name,
            line,
            path: Some(path),
            is_elsewhere: true,
        }];
    }
    all
}

/// Names of libraries in a statement: one name, or several names separated by blanks. A name may
/// also contain blanks.
fn names(finder: &mut FileFinder, folder: &Path, statement: &LibraryName) -> Vec<String> {
    let mut is_there = |name: &str| finder.find(folder, name).is_some();
    let whole = statement.whole.iter().flat_map(|whole| possible_names(whole));
    if let Some(name) = whole.chain([statement.text.as_str()]).find(|name| is_there(name)) {
        return vec![name.to_string()];
    }
    let parts = split_names(&statement.text);
    let mut names = Vec::with_capacity(parts.len());
    for part in parts {
        let words: Vec<String> = part.split_whitespace().map(str::to_string).collect();
        let count = words.iter().filter(|word| is_there(word)).count();
        // A text with blanks that ends in `.mtl` is one name, unless at least two of its words are
        // names of files.
        let is_one = count < 2 && ends_in_mtl(&part);
        let are_words = words.len() > 1 && count > 0 && !is_one && !is_there(&part);
        names.extend(if are_words { words } else { vec![part] });
    }
    names
}

/// Splits `text` into names of libraries. A name is in quotes, which are kept, or ends with `.mtl`.
/// A blank after a `\` is part of the name.
fn split_names(text: &str) -> Vec<String> {
    let hidden = text.replace("\\ ", "\0");
    let mut names = Vec::new();
    for (index, part) in hidden.split('"').enumerate() {
        if index % 2 == 1 {
            names.push(format!("\"{part}\""));
            continue;
        }
        let mut words: Vec<&str> = Vec::new();
        for word in part.split_whitespace() {
            words.push(word);
            if ends_in_mtl(word) {
                names.push(words.join(" "));
                words.clear();
            }
        }
        names.push(words.join(" "));
    }
    names.retain(|name| !unquoted(name).is_empty());
    names.into_iter().map(|name| name.replace('\0', " ")).collect()
}

fn ends_in_mtl(name: &str) -> bool {
    name.to_ascii_lowercase().ends_with(".mtl")
}

/// Finds the file with the name `name`. If there is none, searches for its base name beside the OBJ
/// file and in the parent folder. Then searches for each word of `name` beside the OBJ file. The
/// second value is true if the file has not exactly this name.
fn find_near(finder: &mut FileFinder, folder: &Path, name: &str) -> Option<(PathBuf, bool)> {
    if let Some(path) = finder.find(folder, name) {
        return Some((path, false));
    }
    let (plain, above) = (unquoted(name), folder_above(folder));
    let base = base_name(plain)?;
    let mut places = [(folder, plain), (folder, base), (&above, base)].into_iter();
    let found = places.find_map(|(folder, name)| finder.find(folder, name));
    let words = plain.split_whitespace().filter(|_| plain == name && ends_in_mtl(name));
    let found = found.or_else(|| words.rev().find_map(|word| finder.find(folder, word)));
    found.map(|path| (path, true))
}

/// The library of `x.obj` with the file name `x.mtl` or `x.obj.mtl`.
fn find_of_same_name(finder: &mut FileFinder, obj: &Path) -> Option<PathBuf> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let [stem, name] = [obj.file_stem()?, obj.file_name()?].map(|name| format!("{}.mtl", name.to_string_lossy()));
    finder.find(folder, &stem).or_else(|| finder.find(folder, &name))
}

/// Materials of the libraries, and paths of the libraries that were read, in the order of the lines
/// that name the libraries. Each library is read once.
pub(super) fn load_libraries(
    obj: &Path,
    libraries: &[ObjLibrary],
    context: &ObjContext,
    options: &LoadOptions,
    findings: &mut Findings,
) -> (Vec<FileMaterial>, Vec<PathBuf>) {
    let (mut materials, mut files) = (Vec::new(), Vec::new());
    for library in libraries {
        remark(obj, library, options, findings);
        if let Some(path) = library.path.as_ref().filter(|path| !files.contains(*path)) {
            materials.extend(load_mtl(path, context, options.library_options(), findings));
            files.push(path.clone());
        }
    }
    (materials, files)
}

/// Adds a finding if a library is missing, or is not at the path that the OBJ file names.
fn remark(obj: &Path, library: &ObjLibrary, options: &LoadOptions, findings: &mut Findings) {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let ObjLibrary { name, line, .. } = library;
    let shown = excerpt_of_path(name);
    let at_line = |message: String| {
        let error = FileError::new(obj, message);
        if *line == 0 {
            error
        } else {
            error.at(Position::line(*line))
        }
    };
    let Some(path) = &library.path else {
        let missing = at_line(format!(
            "material library `{}` is missing",
            excerpt_of_path(&library_path(obj, name).to_string_lossy())
        ));
        let help = "put the file there; until then the default material replaces its materials";
        return findings.add(options.severity_of_lack(), "missing-library", missing.help(help));
    };
    let found = path.display();
    if library.is_elsewhere {
        let what = match name.as_str() {
            "" => "the file names no material library".to_string(),
            _ => format!("material library `{shown}` is missing"),
        };
        let elsewhere = at_line(format!("{what}; `{found}` is used"));
        let help = "write `mtllib` with the name of the file relative to the OBJ file";
        findings.add(Severity::Note, "found-elsewhere", elsewhere.help(help));
    } else if case_differs(folder, name, path) {
        let others = match count_alike(path) {
            0 | 1 => String::new(),
            n => format!(", the first of {n} files whose names differ by case"),
        };
        let other_case = at_line(format!(
            "the file of material library `{shown}` is called `{found}`{others}"
        ));
        let help = "write the name exactly as the file is called; other systems may not find the file";
        findings.add(Severity::Warning, "other-case", other_case.help(help));
    } else if name.contains('\\') {
        let error = at_line(format!(
            "material library `{shown}` has backslashes between folders, and is found as `{found}`"
        ));
        let help = "separate folders by /, which programs on all systems read";
        findings.add(Severity::Note, "backslashes", error.help(help));
    }
}
