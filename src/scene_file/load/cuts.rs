//! Cuts all objects of a scene by its sections, and closes the cuts with caps.

use super::{Loader, SubdividedFile};
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::io::CutCaps;
use crate::lint::MaterialSource;
use crate::material::{Material, MaterialId};
use crate::math::excerpt_of_name;
use crate::scene::SectionReport;
use crate::scene_file::mtl::FileMaterial;
use crate::scene_file::obj::{Group, ObjFile, Twins};
use crate::scene_file::{CutSection, FileError, Finding, Severity};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the default material of caps.
const CAP: &str = "section";
/// Reflectance of the default material of caps: a dark grey, as cut walls have in drawings.
const CAP_REFLECTANCE: f32 = 0.05;
/// Maximum number of open surfaces that a message names.
const MAX_NAMED: usize = 4;

impl Loader<'_> {
    /// Cuts the objects by one section after the other.
    pub(super) fn cut_sections(&mut self, objs: &BTreeMap<SubdividedFile, ObjFile>) {
        let mut usual = None;
        let parameters = &self.file.load.parameters;
        let light = parameters.cut_light();
        // Set the treatment of panes before the cut, because panes are detected before it
        self.builder.panes(parameters.panes());
        for section in &self.file.section {
            if self.is_over() {
                return;
            }
            let plane = match section.plane(&self.file.source, self.builder.bounds()) {
                Ok(plane) => plane,
                Err(error) => {
                    self.wrong("wrong-section", error);
                    continue;
                }
            };
            let cap = match &section.material {
                _ if parameters.cut_caps() == CutCaps::Off => None,
                Some(name) => {
                    let group = Group {
                        material: Some(name.get_ref().clone()),
                        line: 0,
                        rules: Vec::new(),
                        mesh: Mesh::default(),
                        twins: Twins::default(),
                    };
                    Some(self.material_in(&group, objs))
                }
                None => {
                    usual = usual.or_else(|| Some(self.usual_cap()));
                    usual
                }
            };
            match self.builder.cut(&plane, cap, light) {
                Ok(report) => self.report_section(section, &report),
                Err(error) => {
                    let error = self.file.error(section.span(), error.to_string());
                    let help = "keep the object on one side of the plane, or let it stand still";
                    self.wrong("wrong-section", error.help(help));
                }
            }
            self.list_materials();
        }
    }

    /// Adds entries to the list of materials for materials that are not in files: hidden copies,
    /// panes and caps.
    pub(super) fn list_materials(&mut self) {
        for index in self.materials.len()..self.builder.material_count() {
            let original = self.builder.copied_material(MaterialId(index as u32));
            let source = original.and_then(|id| self.materials.get(id.0 as usize)).cloned();
            self.materials.push(source.unwrap_or_else(|| MaterialSource {
                name: CAP.into(),
                obj: None,
                place: None,
                found: FileMaterial::default_of(CAP),
            }));
        }
    }

    /// Material of a group of triangles that was made in code. The material is in the scene file,
    /// or in the libraries of the scene's objects.
    pub(super) fn material_in(&mut self, group: &Group, objs: &BTreeMap<SubdividedFile, ObjFile>) -> MaterialId {
        let name = group.material.as_ref();
        let defines = |obj: &ObjFile| name.is_some_and(|name| obj.material(name).is_some());
        match objs.iter().find(|(_, obj)| defines(obj)) {
            Some((shape, obj)) => self.material_of(group, &group.mesh, &shape.path, obj),
            None => {
                let none = ObjFile::new(Vec::new(), Vec::new(), Vec::new());
                self.material_of(group, &group.mesh, self.file.path().unwrap_or(Path::new("")), &none)
            }
        }
    }

    fn usual_cap(&mut self) -> MaterialId {
        let material = Material {
            name: CAP.into(),
            diffuse: Spectrum::splat(CAP_REFLECTANCE),
            ..Material::default()
        };
        // This cannot fail: the builder accepts a material with these values
        let id = self.builder.add_material(material).unwrap_or(MaterialId(0));
        self.list_materials();
        id
    }

    fn report_section(&mut self, section: &CutSection, report: &SectionReport) {
        let words = section.words();
        let here = |message: String| self.file.error(section.span(), message);
        if report.removes_all {
            let error = here(format!("the section {words} leaves nothing of the scene"));
            self.wrong("wrong-section", error.help(help_of_side(&words)));
            return;
        }
        if report.keeps_all {
            let error = here(format!("the section {words} cuts nothing off"));
            self.findings
                .add(Severity::Warning, "idle-section", error.help(help_of_side(&words)));
        }
        if report.inward > 0 {
            let noun = if report.inward == 1 {
                "surface that faces"
            } else {
                "surfaces that face"
            };
            let error = here(format!(
                "the section {words} makes no cap in {} closed {noun} inwards, as rooms do",
                report.inward
            ));
            let error =
                error.help("if these are solids, turn their faces outwards; walls get caps if they have a thickness");
            self.findings.add(Severity::Note, "inward-surface", error);
        }
        if report.open.is_empty() {
            return;
        }
        let named = report.open.iter().take(MAX_NAMED).map(|shell| {
            let [x, y, z] = shell.place.to_array();
            format!("`{}` at {x},{y},{z}", excerpt_of_name(&shell.name))
        });
        let mut names: Vec<String> = named.collect();
        let count = report.open.len() as u64;
        if report.open.len() > MAX_NAMED {
            names.push(format!("{} more", report.open.len() - MAX_NAMED));
        }
        let noun = if count == 1 {
            "surface, which is"
        } else {
            "surfaces, which are"
        };
        let error: FileError = here(format!(
            "the section {words} makes no cap on {count} cut {noun} not closed: {}",
            names.join(", ")
        ));
        let error =
            error.help("close these surfaces in a modelling program; sheets without a thickness have no inside");
        self.findings
            .push(Finding::new(Severity::Warning, "open-section", error).repeated(count, []));
    }
}

fn help_of_side(words: &str) -> &str {
    if words.starts_with('-') {
        "the minus before the axis keeps the part above the plane; `embrasure info` prints the box of the scene"
    } else {
        "the part below the plane is kept, or with a minus before the axis the part above; `embrasure info` prints the box of the scene"
    }
}
