//! Conversion of tobj's materials to statements of a library.

use super::super::mtl::{FileMaterial, Library, LibraryOptions, ObjContext, Section, read_library};
use super::super::statements::{split_keyword, statements};
use super::super::{FileError, Findings, Position};
use crate::math::excerpt_of_name;
use std::path::Path;

/// Materials of a library that tobj has read. The file is read again for data that tobj does not
/// return: line numbers, and comments, which name the program that wrote the file.
pub(super) fn load(
    path: &Path,
    obj: &ObjContext,
    read: &[tobj::Material],
    options: LibraryOptions,
    findings: &mut Findings,
) -> Vec<FileMaterial> {
    let Some(text) = read_library(path, findings) else {
        return Vec::new();
    };
    let library = Library::new(&text, obj, options);
    let sections = sections(&library, path, &text, read, findings);
    library.materials(path, sections, findings)
}

/// Sections of the materials, with the statements that have usable values. Each section has the
/// line of its `newmtl`.
fn sections(
    library: &Library,
    path: &Path,
    text: &str,
    read: &[tobj::Material],
    findings: &mut Findings,
) -> Vec<Section> {
    let is_first = |statement: &str| split_keyword(statement).0.eq_ignore_ascii_case("newmtl");
    let mut lines = statements(text).filter(|(_, s)| is_first(s)).map(|(line, _)| line);
    let mut sections = Vec::with_capacity(read.len());
    for material in read {
        let line = lines.next().unwrap_or(1);
        let mut section = library.section(&material.name, line);
        for (key, value) in statements_of(material) {
            let place = FileError::new(path, "").at(Position::line(line));
            if let Err((message, help)) = library.read(&mut section, [&key, &value], None, place) {
                let error = FileError::new(
                    path,
                    format!("material `{}`: {message}", excerpt_of_name(&material.name)),
                );
                let error = error.at(Position::line(line)).help(help);
                findings.add(library.wrong_severity, "wrong-statement", error);
            }
        }
        sections.push(section);
    }
    sections
}

/// Keywords and values of the statements of a material. Numbers are written with all digits.
/// Statements that tobj does not support are sorted by name.
fn statements_of(material: &tobj::Material) -> Vec<(String, String)> {
    let color = |c: [f32; 3]| format!("{} {} {}", c[0], c[1], c[2]);
    let number = |n: f32| n.to_string();
    let known = [
        ("Ka", material.ambient.map(color)),
        ("Kd", material.diffuse.map(color)),
        ("Ks", material.specular.map(color)),
        ("Ke", material.emissive.map(color)),
        ("Ns", material.shininess.map(number)),
        ("d", material.dissolve.map(number)),
        ("Ni", material.optical_density.map(number)),
        ("illum", material.illumination_model.map(|n| n.to_string())),
        ("map_Kd", material.diffuse_texture.clone()),
        ("map_Ks", material.specular_texture.clone()),
        ("map_Ns", material.shininess_texture.clone()),
        ("map_d", material.dissolve_texture.clone()),
        ("map_Bump", material.normal_texture.clone()),
    ];
    let mut others: Vec<(String, String)> = material
        .unknown_param
        .iter()
        .filter(|(key, _)| !key.starts_with('#'))
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect();
    others.sort();
    let known = known
        .into_iter()
        .filter_map(|(key, value)| Some((key.to_string(), value?)));
    known.chain(others).collect()
}
