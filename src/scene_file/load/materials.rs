//! Materials of a scene. They come from the scene file or from material libraries; else the default
//! material is used.

use super::beside::offer_in_words;
use super::library_mistakes::add_cut_out;
use super::unmapped::has_textures;
use super::{DEFAULT_MATERIAL, Loader, MaterialSource, UsedMaterial};
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::io::MapsByName;
use crate::material::MaterialId;
use crate::math::excerpt_of_name;
use crate::scene_file::light_group_section::idle_members;
use crate::scene_file::mtl::{FileMaterial, MapSlot, default_material};
use crate::scene_file::obj::{Group, ObjFile};
use crate::scene_file::unknown_key::nearest_names;
use crate::scene_file::{FileError, Finding, Position, SceneFile, Severity};
use std::collections::{BTreeSet, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Maximum number of unused materials that are named in warnings. Further materials are only
/// counted.
const MAX_NAMED: usize = 100;
/// Maximum number of undefined names that are compared with the names of defined materials.
const MAX_COMPARED: usize = 16;

impl Loader<'_> {
    /// Material with the name of the group. It is searched in the scene file, then in the libraries
    /// of the OBJ file; else it is the default material. Patches of the material and of its parts
    /// are applied. `mesh` is the mesh of the group.
    pub(super) fn material_of(&mut self, group: &Group, mesh: &Mesh, path: &Path, obj: &ObjFile) -> MaterialId {
        let file = self.file;
        let (other, parts) = self.material_of_parts(group);
        let name = other.as_ref().map(|name| name.get_ref()).or(group.material.as_ref());
        let name = name.map_or(DEFAULT_MATERIAL, String::as_str);
        let section = file.replacement(name);
        let source = section.is_none().then(|| path.to_path_buf());
        let mut used = UsedMaterial {
            obj: source.clone(),
            name: name.to_string(),
            parts,
            lacks_uvs: mesh.uvs.is_empty(),
        };
        if let Some(id) = self.known_material(&used) {
            self.count_unmapped(id, mesh);
            return id;
        }
        let (found, place) = match section {
            Some((key, section)) => {
                let here = file.error(key.span(), "");
                let place = here.position.map(|position| (here.file, position));
                let found = section.material(name, &file.source).unwrap_or_else(|error| {
                    self.wrong("wrong-material", error);
                    FileMaterial::default_of(name)
                });
                (found, place)
            }
            // If a library defines a name several times, use the last definition, as a program
            // would that reads the file from top to bottom
            None => match obj.material(name) {
                Some(found) => {
                    let place = (found.library.clone(), Position::line(found.line));
                    let mut found = found.clone();
                    if found.material.name != name {
                        let line = group.line * usize::from(other.is_none());
                        self.report_other_name(name, &found, path, line);
                        found.material.name = name.to_string();
                    }
                    (found, Some(place))
                }
                None if other.is_some() => {
                    if let Some(other) = &other {
                        self.refuse_material(other, obj);
                    }
                    (FileMaterial::default_of(name), None)
                }
                None => {
                    let mut found = FileMaterial::default_of(name);
                    if obj.has_colors {
                        // Use a white diffuse colour, because vertex colours multiply it
                        found.material.diffuse = Spectrum::ONE;
                    }
                    (found, None)
                }
            },
        };
        let mut found = found;
        let is_file = section.is_none() && obj.has_uvs;
        let names_maps = self.file.load.parameters.maps_by_name() == MapsByName::Auto;
        if is_file && names_maps && found.maps.is_empty() && !found.material.emits_or_transmits() {
            self.add_named_maps(&mut found, mesh, path, obj);
        }
        let is_undefined = place.is_none() && found.maps.is_empty();
        let plain = found.material.diffuse.max_component();
        if is_file && !self.file.load.is_literal() {
            self.leave_out_color_as_opacity(&mut found);
            add_cut_out(&mut found);
        }
        // A patch defines the material.
        let is_patched = !used.parts.is_empty() || !self.patches.of_material(name).is_empty();
        let mut found = self.patched(found, &used.parts);
        if let Some(name) = group.material.as_ref().filter(|_| is_undefined && !is_patched) {
            let undefined = self.undefined.entry(path.to_path_buf());
            let undefined = undefined.or_insert_with(|| UndefinedMaterials {
                has_library: !obj.libraries.is_empty(),
                diffuse: plain,
                materials: Vec::new(),
                meant: None,
            });
            if undefined.meant.is_none() && undefined.materials.len() < MAX_COMPARED {
                let defined = obj.materials.iter().map(|found| found.material.name.as_str());
                let near = nearest_names(name, defined).first().map(ToString::to_string);
                undefined.meant = near.map(|near| (name.clone(), near));
            }
            undefined.materials.push((name.clone(), group.line));
        }
        if is_file && names_maps {
            let untextured = self.untextured.entry(path.to_path_buf());
            let untextured = untextured.or_insert_with(|| UntexturedMaterials {
                has_one_color: !self.file.load.is_literal() && has_one_color(obj),
                ..UntexturedMaterials::default()
            });
            untextured.has_texture |= !found.maps.is_empty();
            untextured.libraries.clone_from(&obj.libraries);
            untextured.material.get_or_insert_with(|| name.to_string());
        }
        // Without textures, the material is the same for faces with texture coordinates.
        used.lacks_uvs &= has_textures(&found);
        if used.lacks_uvs {
            self.unmap(&mut found, path, mesh);
        }
        let material = self.textured(&mut found, path, (mesh, used.lacks_uvs));
        *self.emits.entry(name.to_string()).or_default() |= !material.emission_factor().is_black();
        let added = self.builder.add_material(material).or_else(|error| {
            let error = match section {
                Some((key, _)) => file.error(key.span(), error.to_string()).help("correct the value"),
                None => FileError::new(path, error.to_string()).help("correct the material in its library"),
            };
            self.wrong("wrong-material", error);
            self.builder.add_material(default_material(name))
        });
        // This cannot fail: the builder accepts a default material
        let id = added.unwrap_or(MaterialId(0));
        if let Some(&group) = self.light_groups.get(name) {
            self.builder.group_material(id, group);
        }
        let name = name.to_string();
        if used.lacks_uvs {
            self.unmapped_materials.insert(id, (path.to_path_buf(), name.clone()));
        }
        self.used.insert(used, id);
        self.materials.push(MaterialSource {
            name,
            obj: source,
            place,
            found,
        });
        self.count_unmapped(id, mesh);
        id
    }

    /// Reports that the OBJ file `path` names a material `name`, and that the material `found` is
    /// used. Its name differs in case or separators. `line` is the line of the OBJ file with the
    /// name; 0 if there is no such line.
    fn report_other_name(&mut self, name: &str, found: &FileMaterial, path: &Path, line: usize) {
        let message = format!(
            "there is no material `{}`; `{}` of the library is used",
            excerpt_of_name(name),
            excerpt_of_name(&found.material.name)
        );
        let error = FileError::new(path, message);
        let error = match line {
            0 => error,
            line => error.at(Position::line(line)),
        };
        let help = "write the name exactly as in `newmtl`; --mtl-dialect spec accepts only exact names";
        self.findings.add(Severity::Note, "found-elsewhere", error.help(help));
    }

    /// Reports materials that no library defines, once for each OBJ file.
    pub(super) fn report_undefined(&mut self) {
        for (path, undefined) in std::mem::take(&mut self.undefined) {
            let is_told = |finding: &Finding| finding.code == "missing-library" && finding.error.file == path;
            let is_library_told = self.findings.iter().any(is_told);
            let names = undefined.materials.iter().map(|(name, _)| name.as_str());
            let (shown, one) = (names_in_words(names), undefined.materials.len() == 1);
            let look = format!("in a plain grey (diffuse {:.1})", undefined.diffuse);
            let (noun, is_not, it_is) = if one {
                ("material", "is", "it is")
            } else {
                ("materials", "are", "they are")
            };
            let words = format!("{noun} {shown} {is_not} not defined; {it_is} rendered {look}");
            let (severity, code, message) = match (undefined.has_library, is_library_told) {
                (true, _) => (Severity::Warning, "missing-material", words),
                // If the library is missing, a warning about it was already given
                (false, true) => (Severity::Note, "missing-material", words),
                (false, false) => {
                    let message =
                        format!("the file names no material library; {noun} {shown} {is_not} rendered {look}");
                    (Severity::Note, "no-library", message)
                }
            };
            // A mesh made in code has no line in a file
            let lines = undefined
                .materials
                .iter()
                .map(|&(_, line)| line)
                .filter(|&line| line > 0);
            let mut places = lines.map(Position::line);
            let error = FileError::new(&path, message);
            let error = match places.next() {
                Some(first) => error.at(first),
                None => error,
            };
            let first = undefined.materials.first().map_or("", |(name, _)| name.as_str());
            let meant = match &undefined.meant {
                Some((name, near)) => {
                    let [name, near] = [name, near].map(|name| excerpt_of_name(name));
                    format!("does `usemtl {name}` mean `{near}`? Otherwise ")
                }
                None => String::new(),
            };
            let help = format!(
                "{meant}define {} in the MTL file, or as [material.\"{}\"] in a scene file",
                if one { "it" } else { "them" },
                excerpt_of_name(first)
            );
            let finding = Finding::new(severity, code, error.help(help));
            self.findings
                .push(finding.repeated(undefined.materials.len() as u64, places));
        }
    }

    /// Offers pictures near an OBJ file that has texture coordinates, if no material of the file
    /// has a texture.
    pub(super) fn report_offers(&mut self) {
        for (path, untextured) in std::mem::take(&mut self.untextured) {
            let Some(material) = untextured.material.filter(|_| !untextured.has_texture) else {
                continue;
            };
            let own: Vec<&Path> = untextured.libraries.iter().map(PathBuf::as_path).collect();
            let offers = self.maps_beside(&path).offers(&own);
            if let Some((names, advice)) = offer_in_words(&material, offers) {
                let message =
                    format!("the file has texture coordinates, but no texture; pictures near the file: {names}");
                let error = FileError::new(&path, message).help(advice);
                self.findings.add(Severity::Note, "unused-pictures", error);
            }
        }
    }

    /// Applies all patches of the material's name in order, and then the patches with the indices
    /// `parts`.
    fn patched(&mut self, mut found: FileMaterial, parts: &[u32]) -> FileMaterial {
        let mut remarks = Vec::new();
        let name = found.material.name.clone();
        let of_name = self.patches.of_material(&name).into_iter().map(|patch| &*patch.section);
        let of_parts = parts.iter().filter_map(|&rule| self.parts.get(rule as usize));
        for section in of_name.chain(of_parts.map(|patch| &patch.section.material)) {
            match section.patched(&found, &self.file.source) {
                Ok((patched, warning)) => {
                    found = patched;
                    self.has_patched = true;
                    remarks.extend(warning.map(|warning| (Severity::Warning, "no-effect", warning)));
                }
                Err(error) => remarks.push((Severity::Error, "wrong-material", error)),
            }
        }
        for (severity, code, error) in remarks {
            self.findings.add(severity, code, error);
        }
        found
    }

    /// Warns of materials and patches of the scene file that have no effect.
    pub(super) fn warn_of_idle_materials(&mut self) {
        let file = self.file;
        let used = self.used.keys().filter(|used| used.obj.is_none());
        let used: HashSet<&str> = used.map(|used| used.name.as_str()).collect();
        let is_unused = |key: &&Spanned<String>| !used.contains(key.get_ref().as_str());
        let replacements = file.material.iter().filter(|(_, section)| !section.is_patch());
        let mut unused: Vec<_> = replacements
            .map(|(key, _)| key)
            .filter(is_unused)
            .map(|key| (key.span(), key.get_ref().clone(), key.get_ref().clone()))
            .collect();
        let patches = self.patches.unused();
        unused.extend(patches.map(|patch| (patch.span.clone(), patch.written.to_string(), patch.glob.literal())));
        let count = unused.len();
        let idle = idle_members(&file.light_group, &self.emits);
        for (span, written, literal) in unused.into_iter().take(MAX_NAMED) {
            let warning = file.error(
                span.clone(),
                format!("no face uses the material `{}`", excerpt_of_name(&written)),
            );
            let names = self.materials.iter().map(|material| material.name.as_str());
            if file.must_match(&span) {
                let error = error_of_pattern(file, span, &literal, names);
                self.wrong("unused-material", error);
                continue;
            }
            let nearest: Vec<String> = nearest_names(&literal, names)
                .into_iter()
                .map(|name| format!("`{}`", excerpt_of_name(name)))
                .collect();
            let help = match nearest.as_slice() {
                [] => "use a name from a `usemtl` line".to_string(),
                [one] => format!("did you mean {one}?"),
                [others @ .., last] => format!("did you mean {} or {last}?", others.join(", ")),
            };
            self.warn("unused-material", warning.help(help));
        }
        self.warn_of_more("unused-material", "no face uses", count);
        for (name, why) in idle.iter().take(MAX_NAMED) {
            let message = format!(
                "material `{}` is in a light group, but {why}",
                excerpt_of_name(name.get_ref())
            );
            let warning = file.error(name.span(), message);
            self.warn("idle-light-group", warning.help("correct or remove the name"));
        }
        self.warn_of_more("idle-light-group", "no light comes from", idle.len());
    }

    /// Warns with the text `words` and the number of materials that exceed `MAX_NAMED`.
    fn warn_of_more(&mut self, code: &'static str, words: &str, count: usize) {
        if count > MAX_NAMED {
            let more = count - MAX_NAMED;
            self.warn(code, self.file.whole(format!("{words} {more} other materials")));
        }
    }
}

/// Materials that an OBJ file uses and no library defines.
#[derive(Debug)]
pub(super) struct UndefinedMaterials {
    /// True if the file has a library.
    has_library: bool,
    /// Diffuse reflectance of surfaces with these materials.
    diffuse: f32,
    /// Names of the materials, each with the line of its first `usemtl`.
    materials: Vec<(String, usize)>,
    /// The first of the names that is similar to the name of a defined material, and this name.
    meant: Option<(String, String)>,
}

/// Returns true if the libraries of a file name one colour texture, once or several times.
fn has_one_color(obj: &ObjFile) -> bool {
    let maps = obj.materials.iter().flat_map(|found| &found.maps);
    let mut colors = maps.filter(|map| map.statement.slot == MapSlot::Diffuse);
    let first = colors.next().map(|map| &map.statement.file);
    first.is_some_and(|first| colors.all(|map| map.statement.file == *first))
}

/// Materials of an OBJ file with texture coordinates.
#[derive(Debug, Default)]
pub(super) struct UntexturedMaterials {
    /// True if a material has a texture.
    has_texture: bool,
    /// True if a picture with the name of the file can replace the only colour texture.
    pub has_one_color: bool,
    /// Material libraries of the OBJ file.
    pub libraries: Vec<PathBuf>,
    /// Name of the OBJ file's first material.
    material: Option<String>,
}

/// Maximum number of materials in one message. Further materials are counted.
const MAX_USERS: usize = 3;

/// Text with the first names of materials, and the number of further names.
pub(super) fn names_in_words<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let more = match names.len().saturating_sub(MAX_USERS) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    let shown: Vec<String> = names
        .take(MAX_USERS)
        .map(|name| format!("`{}`", excerpt_of_name(name)))
        .collect();
    shown.join(", ") + &more
}

/// Maximum number of materials that the error of a pattern lists.
const MAX_LISTED: usize = 20;

/// Error that the pattern of a flag, at `span` of `file`, matches none of the materials `names`.
/// `literal` is the pattern without its wildcards.
fn error_of_pattern<'a>(
    file: &SceneFile,
    span: Range<usize>,
    literal: &str,
    names: impl Iterator<Item = &'a str> + Clone,
) -> FileError {
    let error = file.error(span, "no face uses a material of this name");
    error.help(help_of_names("materials", literal, names))
}

/// Help text with the names nearest to `literal`, and with all names. `things` is the plural noun
/// for the names.
pub(super) fn help_of_names<'a>(things: &str, literal: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    let quoted = |names: Vec<&str>| {
        let quoted: Vec<String> = names
            .into_iter()
            .map(|name| format!("`{}`", excerpt_of_name(name)))
            .collect();
        quoted.join(", ")
    };
    let near = nearest_names(literal, names.clone());
    let meant = if near.is_empty() {
        String::new()
    } else {
        format!("did you mean {}? ", quoted(near))
    };
    let all: BTreeSet<&str> = names.collect();
    let more = match all.len().saturating_sub(MAX_LISTED) {
        0 => String::new(),
        n => format!(" and {n} more (`embrasure info` lists all)"),
    };
    let shown = quoted(all.into_iter().take(MAX_LISTED).collect());
    if shown.is_empty() {
        return format!("the scene has no {things} with names");
    }
    format!("{meant}{things} are {shown}{more}")
}
