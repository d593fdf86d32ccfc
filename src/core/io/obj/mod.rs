//! OBJ files: statements (`parse`) and what they say (`outline`), faces by material (`groups`) or as they are written (`faces`), polygons (`polygon`),
//! smoothing groups (`smoothing`).
//!
//! A text is cut between statements into chunks of a fixed size, which are read in parallel and joined in order: neither chunks nor threads change a
//! bit. One reader serves renders, which want a mesh, and `embrasure check`, which wants all mistakes (`io/finding.rs`).

mod faces;
mod groups;
mod outline;
mod parse;
mod polygon;
mod remarks;
mod smoothing;

use super::find_file::{FileFinder, case_differs, count_alike};
use super::input;
use super::memory::Allowance;
use super::mtl::{FileMaterial, Signature, library_path, load_mtl};
use super::statements::with_line_feeds;
use super::{FileError, Findings, LoadObserver, LoadOptions, Position, Severity};
use crate::geometry::Mesh;
use crate::math::excerpt_of_path;
pub use faces::{Face, FaceMaterial, ObjFaces};
use outline::Outline;
use parse::Chunks;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Bytes of text that one task reads: many tasks in a large file, and work enough in each.
const CHUNK_BYTES: usize = 1 << 20;

/// Triangles of an OBJ file that share a material.
#[derive(Debug)]
pub struct Group {
    /// Name in `usemtl`; `None` before the first one.
    pub material: Option<String>,
    /// Line of its first `usemtl`; 0 where there is none.
    pub line: usize,
    /// The triangles, in the file's units.
    pub mesh: Mesh,
}

/// An OBJ file and its material libraries.
#[derive(Debug)]
pub struct ObjFile {
    /// One group for each material in use, in the order of first use.
    pub groups: Vec<Group>,
    /// Materials that the libraries define.
    pub materials: Vec<FileMaterial>,
    /// Files of the libraries that were found.
    pub libraries: Vec<PathBuf>,
    /// The last of each name among them.
    last_named: HashMap<String, usize>,
}

impl ObjFile {
    /// What a reader makes of a file and its libraries.
    pub fn new(groups: Vec<Group>, materials: Vec<FileMaterial>, libraries: Vec<PathBuf>) -> Self {
        let named = materials.iter().enumerate().map(|(i, m)| (m.material.name.clone(), i));
        Self {
            groups,
            last_named: named.collect(),
            materials,
            libraries,
        }
    }

    /// The material of this name; the last definition counts.
    pub fn material(&self, name: &str) -> Option<&FileMaterial> {
        self.last_named.get(name).and_then(|&i| self.materials.get(i))
    }
}

/// The error of a file without faces.
pub(super) fn no_faces(path: &Path) -> FileError {
    FileError::new(path, "no faces in this OBJ file").help("export the mesh with its faces (`f` lines)")
}

/// Reads an OBJ file and its libraries by the reader of this module, without the options that change what was read.
pub(super) fn read_obj(
    path: &Path,
    options: &LoadOptions,
    allowance: Allowance,
    observer: &dyn LoadObserver,
    findings: &mut Findings,
) -> Result<ObjFile, FileError> {
    // What it takes is known, and refused where that is too much, step by step before it is taken.
    let length = fs::metadata(path).map_or(0, |data| data.len());
    allowance.check(path, length)?;
    let text = read_text(path)?;
    let signature = Signature::find(&text);
    observer.begin(&format!("reading {}", path.display()), text.len() as u64);
    let chunks = Chunks::count(&text, CHUNK_BYTES);
    allowance.check(path, chunks.bytes(length))?;
    let mut outline = parse::parse(path, &chunks, false, &|bytes| observer.advance(bytes))?;
    drop(chunks);
    drop(text);
    // Without a face there is no picture.
    let has_faces = outline.sections.iter().any(|section| section.corner_count() > 0);
    let severities = match has_faces {
        true => [options.severity_of_lack(), Severity::Error],
        false => [Severity::Error; 2],
    };
    let told = [0, 1].map(|i| outline.wrong[i].len());
    let wrong = std::mem::take(&mut outline.wrong).into_iter().zip(severities);
    let mut wrong: Vec<_> = wrong
        .flat_map(|(errors, severity)| errors.into_iter().map(move |error| (severity, error)))
        .collect();
    wrong.sort_by_key(|(_, error)| error.position.map(|place| place.line));
    for (severity, error) in wrong {
        findings.add(severity, "wrong-statement", error);
    }
    for i in [0, 1] {
        findings.add_untold(severities[i], path, outline.wrong_count[i] - told[i]);
    }
    let (materials, libraries) = load_libraries(path, &outline, signature.as_ref(), options, findings);
    findings.extend(outline.remarks.findings(path));
    let wrong_count = outline.wrong_count;
    let groups = into_groups(outline);
    if groups.is_empty() && wrong_count == [0; 2] {
        return Err(no_faces(path));
    }
    Ok(ObjFile::new(groups, materials, libraries))
}

fn read_text(path: &Path) -> Result<String, FileError> {
    input::read_text(path, "the OBJ file").map(with_line_feeds)
}

/// The triangles of each material, in the order of first use.
fn into_groups(mut outline: Outline) -> Vec<Group> {
    let faces = groups::by_material(&outline.sections);
    smoothing::smooth(&mut outline, faces.iter().flat_map(|f| &f.runs));
    faces.into_par_iter().map(|f| f.into_group(&outline)).collect()
}

/// The materials of the libraries, each read once, in the order of the lines that name them, and the files of the libraries.
fn load_libraries(
    obj: &Path,
    outline: &Outline,
    signature: Option<&Signature>,
    options: &LoadOptions,
    findings: &mut Findings,
) -> (Vec<FileMaterial>, Vec<PathBuf>) {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let mut seen = HashSet::new();
    let (mut materials, mut files) = (Vec::new(), Vec::new());
    let mut finder = FileFinder::default();
    for (named, line) in &outline.libraries {
        // One name with blanks, or several names.
        let names = match finder.find(folder, named) {
            Some(_) => vec![named.clone()],
            None => split_names(named),
        };
        for name in names {
            if !seen.insert(name.clone()) {
                continue;
            }
            let remark = |message: String| FileError::new(obj, message).at(Position::line(*line));
            let Some(path) = finder.find(folder, &name) else {
                let missing = remark(format!(
                    "material library `{}` is missing",
                    excerpt_of_path(&library_path(obj, &name).to_string_lossy())
                ));
                let help = "put the file there; until then the default material replaces its materials";
                findings.add(options.severity_of_lack(), "missing-library", missing.help(help));
                continue;
            };
            if case_differs(folder, &name, &path) {
                let others = match count_alike(&path) {
                    0 | 1 => String::new(),
                    n => format!(", the first of {n} files whose names differ by case"),
                };
                let other_case = remark(format!(
                    "the file of material library `{}` is called `{}`{others}",
                    excerpt_of_path(&name),
                    path.display()
                ));
                let help = "write the name exactly as the file is called; other systems may not find it";
                findings.add(Severity::Warning, "other-case", other_case.help(help));
            } else if name.contains('\\') {
                let error = remark(format!(
                    "material library `{}` is found as `{}`",
                    excerpt_of_path(&name),
                    path.display()
                ));
                findings.add(Severity::Note, "other-case", error.help("separate folders by /"));
            }
            materials.extend(load_mtl(&path, signature, options.library_options(), findings));
            files.push(path);
        }
    }
    (materials, files)
}

/// Names of libraries between blanks; a `\` before a blank makes it a part of the name.
pub(super) fn split_names(names: &str) -> Vec<String> {
    let hidden = names.replace("\\ ", "\0");
    hidden.split_whitespace().map(|name| name.replace('\0', " ")).collect()
}

#[cfg(test)]
mod tests;
