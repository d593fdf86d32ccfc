//! OBJ files. Modules: chunks of text (`counts`, `parse`), statements of a chunk (`chunk`) and
//! contents of the file (`outline`), faces by material (`groups`) or in the order of the file
//! (`faces`), triangulation of polygons (`polygon`), smoothing groups (`smoothing`), material
//! libraries (`libraries`), movement of parts (`moved_parts`), pairs of front and back faces at the
//! same place (`sides`, `twins`), subdivision (`subdivide`) and the edges before it (`cage`), lines
//! and points (`wires`).
//!
//! A text is cut between statements into chunks of a fixed size, which are read in parallel and
//! joined in order. The result is bit-identical for any size of chunks and any number of threads.
//! The same reader is used by renders, which need a mesh, and by `embrasure check`, which needs all
//! errors (`io/finding.rs`).

mod cage;
mod chunk;
mod colors;
mod counts;
mod faces;
mod file_axes;
mod groups;
mod libraries;
mod moved_parts;
mod named_unit;
mod origin;
mod outline;
mod parse;
mod parts;
mod polygon;
mod remarks;
mod sides;
mod smoothing;
mod subdivide;
mod twins;
mod wires;

use super::mtl::{FileMaterial, MapSlot, ObjContext, Signature, key_of_name};
use super::statements::with_line_feeds;
use super::{FileError, Findings, LoadObserver, LoadOptions, Position, Severity};
use crate::files::input;
use crate::files::memory::Allowance;
use crate::geometry::{Mesh, PartNames};
use crate::math::{DVec3, excerpt_of_name};
pub use cage::{Cage, CageNode};
use chunk::DataSelection;
use colors::{Colors, take_colors};
use counts::Chunks;
pub use faces::{Face, FaceMaterial, ObjFaces};
pub use file_axes::{file_axes, first_comment};
use libraries::{find_libraries, load_libraries};
use moved_parts::move_parts;
pub use named_unit::named_unit;
pub(super) use origin::chosen_origin;
pub use origin::origin_of;
use outline::Outline;
use parts::MaterialRules;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use subdivide::subdivide;
use twins::CoincidentFaces;
pub use twins::Twins;
use wires::add_wires;

/// Bytes of text per chunk. With this size, a large file has many chunks, and a chunk has enough
/// work for a parallel task.
const CHUNK_BYTES: usize = 1 << 20;

/// Changes of the positions in a file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Changes {
    /// Point of the file's coordinates that becomes the origin.
    pub origin: DVec3,
    /// True if pairs of front and back faces at the same place are moved apart.
    pub moves_apart: bool,
}

/// Triangles of an OBJ file that share a material and the rules that change it.
#[derive(Debug)]
pub struct Group {
    /// Name in `usemtl`; `None` before the first `usemtl`.
    pub material: Option<String>,
    /// Line of the material's first `usemtl`; 0 if there is none.
    pub line: usize,
    /// Indices of the rules of [`PartFilter`](crate::io::PartFilter) that replace the material for
    /// the parts of the group.
    pub rules: Vec<u32>,
    /// Triangles of the group, in units of the file.
    pub mesh: Mesh,
    /// Pairs of faces of the group that lie on the back of each other. Only fronts emit light, so
    /// these faces are to be moved apart if the material emits. The list is empty if no material of
    /// the library emits and the options do not say that a material may emit.
    pub twins: Twins,
}

/// An OBJ file and its material libraries.
#[derive(Debug)]
pub struct ObjFile {
    /// Groups by material and rules, in the order of first use.
    pub groups: Vec<Group>,
    /// Materials that the libraries define.
    pub materials: Vec<FileMaterial>,
    /// Files of the libraries that were found.
    pub libraries: Vec<PathBuf>,
    /// Names of libraries in the file, found or not.
    pub named_libraries: Vec<String>,
    /// Names of all parts, including hidden parts. Meshes refer to parts by their index in this
    /// list.
    pub parts: PartNames,
    /// True if a mesh has texture coordinates.
    pub has_uvs: bool,
    /// True if a mesh has colours of vertices.
    pub has_colors: bool,
    /// For each name, the index of the last material with this name.
    last_named: HashMap<String, usize>,
    /// For each material name that the file uses but no library defines: the index of the material
    /// whose name is equal except for letter case and separators, if there is only one.
    alike: HashMap<String, usize>,
}

impl ObjFile {
    /// An OBJ file with these groups, materials and paths of libraries.
    pub fn new(groups: Vec<Group>, materials: Vec<FileMaterial>, libraries: Vec<PathBuf>) -> Self {
        let named = materials.iter().enumerate().map(|(i, m)| (m.material.name.clone(), i));
        Self {
            parts: PartNames::default(),
            has_uvs: groups.iter().any(|group| !group.mesh.uvs.is_empty()),
            has_colors: groups.iter().any(|group| !group.mesh.colors.is_empty()),
            groups,
            last_named: named.collect(),
            alike: HashMap::new(),
            materials,
            libraries,
            named_libraries: Vec::new(),
        }
    }

    /// Material with the name `name`. If there are several definitions, the last one is used, as in
    /// a program that reads the library from top to bottom. If there is no definition, the material
    /// whose name equals `name` except for letter case and separators is used, if there is only
    /// one.
    pub fn material(&self, name: &str) -> Option<&FileMaterial> {
        let index = self.last_named.get(name).or_else(|| self.alike.get(name));
        index.and_then(|&i| self.materials.get(i))
    }

    /// Finds materials for names that the groups use but no library defines. The names may differ
    /// in letter case or separators.
    fn with_alike_names(mut self) -> Self {
        let names = self.groups.iter().filter_map(|group| group.material.as_ref());
        let undefined: HashSet<&String> = names.filter(|name| !self.last_named.contains_key(*name)).collect();
        if undefined.is_empty() {
            return self;
        }
        let mut by_key: HashMap<String, Option<usize>> = HashMap::new();
        for (name, &index) in &self.last_named {
            let only = by_key.entry(key_of_name(name)).or_insert(Some(index));
            *only = only.filter(|&first| first == index);
        }
        let alike = undefined.into_iter().filter_map(|name| {
            let index = *by_key.get(&key_of_name(name))?;
            Some((name.clone(), index?))
        });
        self.alike = alike.collect();
        self
    }
}

/// Beginning of the error message for a file without faces.
const NO_FACES: &str = "no faces in this OBJ file";

/// Contents of a file without faces.
#[derive(Default)]
pub(super) struct FacelessFile {
    /// Number of vertices.
    pub vertices: usize,
    /// True if the file has texture coordinates or names materials. Then it was written as a mesh,
    /// not as a point cloud.
    pub is_of_mesh: bool,
    /// True if the last line of the file has no line end.
    pub is_cut: bool,
    /// Description, for a message, of the elements that are not rendered.
    pub skipped: Option<String>,
    /// Line of the first element that is not rendered; 0 if there is none.
    pub skipped_line: usize,
    /// True if lines or points are among the elements that are not rendered.
    pub has_wires: bool,
}

/// Error of a file without faces.
pub(super) fn no_faces(path: &Path, file: FacelessFile) -> FileError {
    let vertices = match file.vertices {
        1 => "1 vertex".to_string(),
        n => format!("{n} vertices"),
    };
    let line = if file.has_wires { 0 } else { file.skipped_line };
    let (message, help) = match file {
        FacelessFile {
            skipped: Some(elements),
            has_wires: false,
            ..
        } => (
            format!("{NO_FACES}: its {elements} are not rendered, the first in this line"),
            "convert free-form curves and surfaces to faces (`f` lines) in the program that made them",
        ),
        FacelessFile {
            skipped: Some(elements),
            ..
        } => (
            format!("{NO_FACES}: its {elements} are skipped"),
            "render lines and points with --line-width, or export a mesh with its faces (`f` lines)",
        ),
        FacelessFile {
            is_of_mesh: true,
            is_cut: true,
            ..
        } => (
            format!("{NO_FACES}: the file is cut off in its last line, after {vertices} and before the faces"),
            "copy or download the file again",
        ),
        FacelessFile {
            is_of_mesh: false,
            vertices: 1..,
            ..
        } => (
            format!("{NO_FACES}: the file is a point cloud of {vertices}"),
            "reconstruct the surface, and export it with faces (`f` lines)",
        ),
        FacelessFile { vertices: 1.., .. } => (
            format!("{NO_FACES}: the file has only the {vertices} of a mesh"),
            "export the mesh with its faces (`f` lines), or copy the file again if it was longer",
        ),
        _ => (NO_FACES.to_string(), "export the mesh with its faces (`f` lines)"),
    };
    let error = FileError::new(path, message).help(help);
    if line > 0 {
        error.at(Position::line(line))
    } else {
        error
    }
}

/// Reads an OBJ file and its libraries with the reader of this module. The option `smooth` is not
/// applied; `load_obj` applies it.
pub(super) fn read_obj(
    path: &Path,
    options: &LoadOptions,
    changes: Changes,
    allowance: Allowance,
    observer: &dyn LoadObserver,
    findings: &mut Findings,
) -> Result<ObjFile, FileError> {
    // Each step estimates its memory before the allocation, and returns an error if there is too
    // little memory.
    let length = fs::metadata(path).map_or(0, |data| data.len());
    allowance.check(path, length)?;
    let text = read_text(path)?;
    let signature = Signature::find(&text);
    observer.begin(&format!("reading {}", path.display()), text.len() as u64);
    let chunks = Chunks::count(&text, CHUNK_BYTES);
    allowance.check(path, chunks.bytes(length))?;
    let selection = DataSelection {
        origin: changes.origin,
        keep_lines: false,
        keep_wires: options.parameters.line_width().is_some(),
        keep_names: true,
        parts: &options.parts,
    };
    let mut outline = parse::parse(path, &chunks, selection, &|bytes| observer.advance(bytes))?;
    drop(chunks);
    let is_cut = !text.ends_with('\n');
    drop(text);
    // If the file has no faces, wrong statements are errors, because nothing can be rendered.
    let has_faces = outline.all_sections().any(|section| section.corner_count() > 0);
    let severity = if has_faces || !options.parts.is_empty() {
        options.severity_of_lack()
    } else {
        Severity::Error
    };
    let listed = outline.wrong.len();
    for error in std::mem::take(&mut outline.wrong) {
        findings.add(severity, "wrong-statement", error);
    }
    findings.add_unlisted(severity, path, outline.wrong_count - listed);
    let is_literal = options.is_literal();
    let used = outline.uses_materials().then(|| outline.used_names());
    let keys = used.iter().flatten().filter(|_| !is_literal);
    let context = ObjContext {
        signature,
        whole_names: outline.whole_names(),
        used_keys: keys.map(|name| key_of_name(name)).collect(),
        used,
    };
    // If the file has no `usemtl` and its library has only one material, this material can be used
    // for all faces.
    let takes_only = !outline.uses_materials() && !is_literal;
    let found = find_libraries(path, &outline.libraries, outline.uses_materials() || takes_only);
    let named_libraries = found.iter().map(|library| library.name.clone()).collect();
    let mut of_libraries = Findings::default();
    let (mut materials, mut libraries) = load_libraries(path, &found, &context, options, &mut of_libraries);
    if takes_only && outline.libraries.is_empty() && materials.len() != 1 {
        (materials, libraries) = (Vec::new(), Vec::new());
    } else {
        findings.extend(of_libraries);
    }
    outline.set_whole_names(&materials.iter().map(|found| found.material.name.as_str()).collect());
    findings.extend(outline.remarks.findings(path));
    let wrong_count = outline.wrong_count;
    let faceless = FacelessFile {
        vertices: outline.vertices.positions.len(),
        is_of_mesh: !outline.vertices.uvs.is_empty() || outline.uses_materials(),
        is_cut,
        skipped: outline.remarks.skipped(),
        skipped_line: outline.remarks.first_skipped_line(),
        has_wires: outline.remarks.skips_wires(),
    };
    let mut of_colors = Vec::new();
    let mut colors = take_colors(path, &mut outline.vertices, &options.parameters, &mut of_colors);
    findings.extend(of_colors);
    move_parts(path, &mut outline, &mut colors, &options.parts)?;
    subdivide(
        path,
        &mut outline,
        &mut colors,
        &options.parameters,
        allowance,
        findings,
    )?;
    let parts = std::mem::take(&mut outline.parts);
    let rules = MaterialRules::new(&options.parts, &parts);
    let mut wires = Vec::new();
    if let Some(width) = options.parameters.line_width() {
        wires = add_wires(path, &outline, &colors, &rules, width, allowance)?;
    }
    let emits = |found: &FileMaterial| {
        let maps = &found.maps;
        !found.material.emission.is_black() || maps.iter().any(|map| map.statement.slot == MapSlot::Emission)
    };
    let search = PairSearch {
        is_on: changes.moves_apart,
        may_emit: options.may_emit || materials.iter().any(emits),
    };
    let (mut groups, pairs) = into_groups(outline, colors, &rules, search);
    groups.append(&mut wires);
    if takes_only {
        give_only_material(path, &mut groups, &materials, findings);
    }
    if pairs > 0 {
        let noun = if pairs == 1 { "face has" } else { "faces have" };
        let message = format!("{pairs} {noun} another material on the back; each side shows its own material");
        findings.add(Severity::Note, "two-sided", FileError::new(path, message));
    }
    // A file without faces is not an error if the user selects parts, because the parts may be in
    // another file.
    if groups.is_empty() && wrong_count == 0 && options.parts.is_empty() {
        return Err(no_faces(path, faceless));
    }
    let file = ObjFile {
        parts,
        named_libraries,
        ..ObjFile::new(groups, materials, libraries)
    };
    Ok(if is_literal { file } else { file.with_alike_names() })
}

/// For a file without `usemtl`: if the library has only one material, assigns it to all faces,
/// unless vertices have colours.
fn give_only_material(path: &Path, groups: &mut [Group], materials: &[FileMaterial], findings: &mut Findings) {
    let [only] = materials else { return };
    if groups.iter().any(|group| !group.mesh.colors.is_empty()) {
        return;
    }
    let name = &only.material.name;
    for group in groups {
        group.material = Some(name.clone());
    }
    let shown = excerpt_of_name(name);
    let message = format!("no face names a material; all faces get `{shown}`, the only material of the library");
    let help = format!("write `usemtl {shown}` before the faces; with --mtl-dialect spec, the faces get no material");
    findings.add(
        Severity::Note,
        "only-material",
        FileError::new(path, message).help(help),
    );
}

fn read_text(path: &Path) -> Result<String, FileError> {
    let mut text = input::read_text(path, "the OBJ file").map(with_line_feeds)?;
    // ZBrush ends files with the NUL of a C string.
    text.truncate(text.trim_end_matches('\0').len());
    Ok(text)
}

/// Opens the file to read its beginning. `None` if the file is not regular, because reading from a
/// pipe would remove data from the pipe.
fn open_regular(path: &Path) -> Option<File> {
    let is_regular = fs::metadata(path).is_ok_and(|data| data.is_file());
    is_regular.then(|| File::open(path).ok()).flatten()
}

/// Search for pairs of faces at the same place.
#[derive(Clone, Copy, Default)]
struct PairSearch {
    /// True if pairs are searched.
    is_on: bool,
    /// True if a material may emit light.
    may_emit: bool,
}

/// Groups of triangles by material, in the order of first use. The second value is the number of
/// pairs of faces at the same place with different materials on the front and on the back.
fn into_groups(
    mut outline: Outline,
    mut colors: Colors,
    rules: &MaterialRules,
    search: PairSearch,
) -> (Vec<Group>, usize) {
    let faces = groups::by_material(&outline.sections, rules);
    smoothing::smooth(&mut outline, faces.iter().flat_map(|f| &f.runs));
    let coincident = if search.is_on {
        sides::separate(&mut outline, &mut colors, &faces, search.may_emit)
    } else {
        CoincidentFaces::default()
    };
    let data = (&outline, &colors);
    let groups = faces
        .into_par_iter()
        .enumerate()
        .map(|(i, faces)| faces.into_group(i, data, rules, &coincident));
    (groups.collect(), coincident.separated())
}

#[cfg(test)]
mod tests;
