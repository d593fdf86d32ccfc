use super::LoadOptions;
use super::mtl::{MtlDialect, MtlMaterial, library_path, load_mtl};
use super::statements::{split_keyword, statements};
use super::{FileError, Position, obj_blame};
use crate::geometry::Mesh;
use crate::math::Vec3;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

/// Triangles of an OBJ file that share a material.
#[derive(Debug)]
pub(super) struct Group {
    /// Name in `usemtl`; `None` before the first one.
    pub material: Option<String>,
    /// The triangles, in the file's units.
    pub mesh: Mesh,
}

/// An OBJ file and its material libraries.
#[derive(Debug)]
pub(super) struct ObjFile {
    /// One group for each material in use, in the order of first use.
    pub groups: Vec<Group>,
    /// Materials that the libraries define.
    pub materials: Vec<MtlMaterial>,
    /// What was missing or assumed, as `file:line: words`.
    pub warnings: Vec<String>,
}

/// Statements that are read before the geometry.
#[derive(Default)]
struct Outline {
    /// Names in `usemtl`, each once, in the order of first use.
    used: Vec<String>,
    /// Names in `mtllib` with their lines.
    libraries: Vec<(String, usize)>,
    /// The statements tobj is to read: a synthetic `mtllib` first, lines and points left out.
    geometry: String,
    /// Faces of fewer than three corners: how many, and the line of the first.
    too_short: (usize, usize),
}

/// Reads an OBJ file and the libraries it names.
///
/// tobj drops the names of materials it finds no definition for, and takes polylines for polygons; so the file's
/// outline is read first, and tobj is given every used name as a material, and faces alone.
pub(super) fn load_obj(path: &Path, options: &LoadOptions) -> Result<ObjFile, FileError> {
    if path.is_dir() {
        return Err(FileError::new(path, "this is a directory, not an OBJ file").help("give the file's name"));
    }
    let bytes = fs::read(path).map_err(|e| FileError::system(path, "cannot read the OBJ file", &e))?;
    let text = String::from_utf8_lossy(&bytes);
    let outline = Outline::read(&text);
    let mut warnings = Vec::new();
    let materials = load_libraries(path, &outline.libraries, options.mtl_dialect, &mut warnings)?;
    if let (count @ 1.., line) = outline.too_short {
        let short = FileError::new(
            path,
            format!("{count} faces of fewer than 3 corners are left out, the first is here"),
        );
        warnings.push(short.at(Position::line(line)).to_string());
    }

    let named = |name: &String| tobj::Material {
        name: name.clone(),
        ..Default::default()
    };
    let placeholders = |_: &Path| {
        let materials = outline.used.iter().map(named).collect();
        Ok((materials, outline.used.iter().cloned().zip(0..).collect()))
    };
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let loaded = tobj::load_obj_buf(&mut outline.geometry.as_bytes(), &options, placeholders);
    let (models, _) = loaded.map_err(|error| obj_blame::blame(path, &text, Some(&error)))?;

    let groups = group_by_material(models, &outline.used);
    if groups.is_empty() {
        return Err(
            FileError::new(path, "no faces in this OBJ file").help("export the mesh with its faces (`f` lines)")
        );
    }
    if groups.iter().any(|g| g.mesh.positions.iter().any(|p| !p.is_finite())) {
        return Err(obj_blame::blame(path, &text, None));
    }
    Ok(ObjFile {
        groups,
        materials,
        warnings,
    })
}

impl Outline {
    fn read(text: &str) -> Self {
        let mut outline = Self::default();
        outline.geometry.reserve(text.len());
        outline.geometry.push_str("mtllib all\n");
        for (line, statement) in statements(text) {
            let (keyword, name) = split_keyword(&statement);
            match keyword {
                "mtllib" => outline.libraries.push((name.into(), line)),
                "usemtl" if !name.is_empty() => {
                    if !outline.used.iter().any(|used| used == name) {
                        outline.used.push(name.into());
                    }
                    outline.geometry.push_str("usemtl ");
                    outline.geometry.push_str(name);
                    outline.geometry.push('\n');
                }
                "f" if name.split_whitespace().nth(2).is_none() => {
                    let (count, first) = outline.too_short;
                    outline.too_short = (count + 1, if count == 0 { line } else { first });
                }
                "v" | "vt" | "vn" | "f" => {
                    outline.geometry.push_str(&statement);
                    outline.geometry.push('\n');
                }
                _ => {}
            }
        }
        outline
    }
}

fn load_libraries(
    obj: &Path,
    libraries: &[(String, usize)],
    dialect: MtlDialect,
    warnings: &mut Vec<String>,
) -> Result<Vec<MtlMaterial>, FileError> {
    let mut materials = Vec::new();
    for (name, line) in libraries {
        // One name with blanks, or several names.
        let whole = library_path(obj, name);
        let paths = if whole.is_file() {
            vec![whole]
        } else {
            name.split_whitespace().map(|part| library_path(obj, part)).collect()
        };
        for path in paths {
            if path.is_file() {
                let (library, remarks) = load_mtl(&path, dialect)?;
                materials.extend(library);
                warnings.extend(remarks);
            } else {
                let missing = FileError::new(obj, format!("material library `{}` is missing", path.display()))
                    .at(Position::line(*line))
                    .help("put the file there; until then its materials are replaced by the default one");
                warnings.push(missing.to_string());
            }
        }
    }
    Ok(materials)
}

/// Joins the models, which tobj cuts at every `usemtl`, into one mesh for each material.
fn group_by_material(models: Vec<tobj::Model>, names: &[String]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut group_of: HashMap<Option<usize>, usize> = HashMap::new();
    for model in models {
        let tobj::Mesh {
            positions,
            indices,
            material_id,
            ..
        } = model.mesh;
        if indices.is_empty() {
            continue;
        }
        let index = *group_of.entry(material_id).or_insert_with(|| {
            groups.push(Group {
                material: material_id.map(|id| names[id].clone()),
                mesh: Mesh::default(),
            });
            groups.len() - 1
        });
        let mesh = &mut groups[index].mesh;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(positions.chunks_exact(3).map(Vec3::from_slice));
        mesh.triangles.extend(
            indices
                .chunks_exact(3)
                .map(|t| [t[0] + first, t[1] + first, t[2] + first]),
        );
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<ObjFile, FileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.obj");
        fs::write(&path, text).unwrap();
        load_obj(&path, &LoadOptions::default())
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn faces_are_grouped_by_material() {
        let text =
            format!("{SQUARE}f 1 2 3\nusemtl a\nf 1 2 3 4\no part\nusemtl b c\nf 1 2 3\nusemtl\ta\nf -4 -3 -2\n");
        let file = load(&text).unwrap();
        let summary: Vec<_> = file
            .groups
            .iter()
            .map(|g| (g.material.as_deref(), g.mesh.triangles.len()))
            .collect();
        assert_eq!(summary, [(None, 1), (Some("a"), 3), (Some("b c"), 1)]);
        let a = &file.groups[1].mesh;
        let corner = |t: usize, i: usize| a.positions[a.triangles[t][i] as usize];
        assert_eq!(
            [corner(1, 0), corner(1, 1), corner(1, 2)],
            [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]
        );
        assert_eq!([corner(2, 0), corner(2, 1)], [Vec3::ZERO, Vec3::X]);
    }

    #[test]
    fn dialects_are_read() {
        let text = format!("\u{feff}{SQUARE}usemtl a # red\nf 1 2 3 # one\nf 1 2 \\\n3 4\nf 1 2\n");
        let file = load(&text).unwrap();
        assert_eq!(file.groups[0].material.as_deref(), Some("a"));
        assert_eq!(file.groups[0].mesh.triangles.len(), 3);
        let warning = &file.warnings[0];
        assert!(warning.contains("t.obj:9: 1 faces of fewer than 3"), "{warning}");
    }

    #[test]
    fn polylines_and_points_are_no_faces() {
        let file = load(&format!("{SQUARE}l 1 2 3 4\np 1\nf 1 2 3\n")).unwrap();
        assert_eq!(file.groups[0].mesh.triangles.len(), 1);
    }

    #[test]
    fn a_missing_library_is_a_warning() {
        let file = load(&format!("{SQUARE}mtllib gone.mtl\nusemtl a\nf 1 2 3\n")).unwrap();
        assert!(
            file.warnings[0].contains("t.obj:5: material library"),
            "{}",
            file.warnings[0]
        );
        assert_eq!(file.groups[0].material.as_deref(), Some("a"));
    }

    #[test]
    fn broken_lines_are_named() {
        let cases = [
            ("f 1 2 9\n", 5, "9"),
            ("f 1 2 0\n", 5, "0"),
            ("f 1 2 -7\n", 5, "-7"),
            ("f 1 2 x\n", 5, "x"),
            ("vn 0 0 1\nf 1//4 2//1 3//1\n", 6, "1//4"),
            ("# c\nv 1 nan 0\nf 1 2 5\n", 6, "nan"),
            ("v 1 2\nf 1 2 3\n", 5, "v 1 2"),
            ("v 1 2 inf\nf 1 2 5\n", 5, "inf"),
            ("v 1 2 a\nf 1 2 3\n", 5, "a"),
            ("vn 0 1\nf 1 2 3\n", 5, "vn 0 1"),
        ];
        for (rest, line, value) in cases {
            let error = load(&format!("{SQUARE}{rest}")).unwrap_err();
            assert_eq!(error.position.map(|p| p.line), Some(line), "{rest:?}: {error}");
            assert!(error.message.contains(value), "{rest:?}: {error}");
            assert!(error.help.is_some(), "{rest:?}: {error}");
        }
    }

    #[test]
    fn nothing_to_render_is_an_error() {
        for text in ["", "# only a comment\n", SQUARE] {
            assert!(load(text).unwrap_err().message.contains("no faces"));
        }
    }
}
