//! Comparison of both readers of OBJ and MTL files: the own one, and that of the tobj crate.
//!
//! Files are read by both. Triangles are matched face by face, and positions, normals, texture coordinates, materials of faces and numbers of materials
//! are compared as bits. A difference is explained by a documented kind ([`Kind`]) only where that is verified: statements that tobj does not know are
//! replaced by their plain equivalents (`plain`) and the file is read by tobj again; polygons that are cut otherwise must have the same corners and area;
//! normals of smoothing groups stand where a group is on and the file has no normal. Whatever is left is unexplained. docs/guide/reference/readers.md has the kinds.

mod kind;
mod libraries;
mod plain;
mod shape;

use super::input::Input;
use super::memory::Allowance;
use super::obj::{self, ObjFaces, ObjFile};
use super::tobj_reader::{Part, read_parts};
use super::{FileError, Findings, LoadOptions};
pub use kind::{Kind, Lines, Notes};
use libraries::Libraries;
use plain::{ObjNames, plain_obj, plain_text};
use std::collections::BTreeSet;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Differences without an explanation that are told one by one.
const MAX_TOLD: usize = 20;

/// A file that was read by both readers.
#[derive(Clone, Debug)]
pub struct ComparedFile {
    /// The file.
    pub path: PathBuf,
    /// Faces of an OBJ file, of three corners and more, as tobj reads them.
    pub faces: u64,
    /// Triangles that were compared.
    pub triangles: u64,
    /// Materials of a library.
    pub materials: u64,
    /// The first wrong statement for the own reader, or why it refuses the file.
    pub refused_by_own: Option<String>,
    /// Why tobj refuses the file as it is, where it does.
    pub refused_by_tobj: Option<String>,
    /// Differences that are explained.
    pub explained: Notes,
    /// Differences that are not, the first ones.
    pub unexplained: Vec<Unexplained>,
    /// Number of all of them.
    pub unexplained_count: u64,
}

/// A difference between both readers that no documented one explains.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unexplained {
    /// The line of the OBJ or MTL file; 0 for the file as a whole.
    pub line: usize,
    /// What differs, with both values.
    pub message: String,
}

impl ComparedFile {
    fn new(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            faces: 0,
            triangles: 0,
            materials: 0,
            refused_by_own: None,
            refused_by_tobj: None,
            explained: Notes::default(),
            unexplained: Vec::new(),
            unexplained_count: 0,
        }
    }

    fn differs(&mut self, line: usize, message: String) {
        self.unexplained_count += 1;
        if self.unexplained.len() < MAX_TOLD {
            self.unexplained.push(Unexplained { line, message });
        }
    }
}

/// Lines of a file with statements that are wrong for the own reader.
struct Wrong {
    lines: BTreeSet<usize>,
    /// Whether there are more than its findings name.
    has_more: bool,
    first: Option<String>,
}

impl Wrong {
    fn of(path: &Path, findings: &Findings) -> Self {
        let errors = || {
            let errors = findings.iter().filter(|f| f.code == "wrong-statement");
            errors.map(|f| &f.error).filter(|error| error.file == path)
        };
        Self {
            lines: errors().filter_map(|error| Some(error.position?.line)).collect(),
            has_more: errors().any(|error| error.position.is_none()),
            first: errors()
                .next()
                .map(|error| format!("{}: {}", error.place(), error.message)),
        }
    }

    fn is_wrong(&self) -> bool {
        self.first.is_some()
    }

    fn has(&self, lines: impl std::ops::RangeBounds<usize>) -> bool {
        self.has_more || self.lines.range(lines).next().is_some()
    }
}

/// Reads an OBJ file and its libraries by both readers, and compares what they read. The OBJ file comes first in the result.
///
/// # Errors
///
/// The system does not give the file's bytes.
pub fn compare_readers(path: &Path, options: &LoadOptions) -> Result<Vec<ComparedFile>, FileError> {
    compare(path, options, &mut |_| ())
}

/// [`compare_readers`], where `plant` may change the result of the own reader, so that tests see that it is noticed.
fn compare(
    path: &Path,
    options: &LoadOptions,
    plant: &mut dyn FnMut(&mut ObjFile),
) -> Result<Vec<ComparedFile>, FileError> {
    let mut report = ComparedFile::new(path);
    let mut notes = Notes::default();
    let text = plain_text(path, "the OBJ file", &mut notes)?;
    let mut names = ObjNames::of(&text);
    let found = Libraries::find(path, &mut names);
    let mut plain = plain_obj(&text, &names.whole_names, &mut notes);
    if found.iter().any(|library| library.line == 0) {
        plain.text.insert_str(0, "mtllib 0\n");
    }

    let mut findings = Findings::default();
    let as_written = obj::Changes::default();
    let own = obj::read_obj(path, options, as_written, Allowance::of_system(), &(), &mut findings);
    let wrong = Wrong::of(path, &findings);
    report.refused_by_own.clone_from(&wrong.first);
    let mut own = match own {
        Ok(own) => own,
        Err(error) if error.is_unreadable() => return Err(error),
        Err(error) => {
            if !error.message.starts_with(obj::NO_FACES) {
                report.refused_by_own = Some(format!("{}: {}", error.place(), error.message));
            }
            ObjFile::new(Vec::new(), Vec::new(), Vec::new())
        }
    };
    plant(&mut own);

    let libraries = Libraries::compare(path, &names, found, options, &mut notes);
    let by_name = |name: &Path| libraries.by_very_name(name);
    let mut input = BufReader::new(Input::open(path, "the OBJ file")?);
    let first = read_parts(&mut input, &by_name).map(|(parts, _)| parts);
    drop(input);
    report.refused_by_tobj = first.as_ref().err().cloned();
    let read = match notes.0.is_empty() && !libraries.have_notes() {
        true => first,
        false => {
            let by_rule = |name: &Path| libraries.plain(name);
            let read = read_parts(&mut plain.text.as_bytes(), &by_rule).map(|(parts, _)| parts);
            // What has no effect is no difference.
            if let (Ok(first), Ok(read)) = (&first, &read) {
                if are_same(first, read) {
                    notes = Notes::default();
                }
            }
            read
        }
    };
    match read {
        Err(refusal) if report.refused_by_own.is_none() => {
            report.differs(0, format!("tobj refuses the file: {refusal}"));
        }
        // Both refuse it.
        Err(_) => {}
        Ok(parts) => {
            report.explained = notes;
            let defined = own.materials.iter().map(|found| found.material.name.as_str()).collect();
            let faces = ObjFaces::read(path, &defined)?;
            shape::Shape {
                own: &own,
                faces: &faces,
                plain: &plain,
                wrong: &wrong,
                are_libraries_refused: libraries.are_refused(),
            }
            .compare(&parts, &mut report);
            report.faces = plain.faces.len() as u64;
        }
    }
    let mut all = vec![report];
    all.extend(libraries.into_reports());
    Ok(all)
}

/// Whether both are the same to the bit.
fn are_same(a: &[Part], b: &[Part]) -> bool {
    let bits = |part: &Part| {
        let mesh = &part.mesh;
        let vectors = mesh.positions.iter().chain(&mesh.normals);
        let vectors = vectors.flat_map(|v| v.to_array()).map(f32::to_bits);
        let uvs = mesh.uvs.iter().flat_map(|uv| uv.to_array()).map(f32::to_bits);
        let indices = mesh.triangles.iter().flatten().copied();
        (vectors.chain(uvs).collect::<Vec<u32>>(), indices.collect::<Vec<u32>>())
    };
    let is_same = |(a, b): (&Part, &Part)| a.material == b.material && bits(a) == bits(b);
    a.len() == b.len() && a.iter().zip(b).all(is_same)
}

#[cfg(test)]
mod tests;
