//! Textures that no library names: `NAME_basecolor.png`, `NAME_roughness.png` and so on. They lie
//! beside the OBJ file or in its texture folders, with names as in Sketchfab, Substance, ambientCG
//! and Poly Haven.
//!
//! A material without any texture gets the textures of a set if exactly one set fits its name.
//! [`Fit`] has the rules. Without any library, one picture can be the colour of all materials
//! ([`NearbyFiles::picture_of_file`]). Pictures that this program wrote are not textures.

use super::Loader;
use super::beside::{Image, NearbyFiles, stem_of, without_sizes, words_of};
use crate::color::Spectrum;
use crate::description::mtl::{FileMaterial, MapRequest, MapSlot, MapStatement};
use crate::description::obj::ObjFile;
use crate::description::{FileError, Position, Severity};
use crate::material::Gloss;
use crate::math::excerpt_of_name;
use crate::texture::{Channel, Mapping};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Roughness of a surface whose texture set has a metallic map, but no roughness map.
const ROUGHNESS: f32 = 0.5;

/// Property that a texture defines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    Color,
    Roughness,
    /// Glossiness: 1 − roughness.
    Gloss,
    Metallic,
    /// Roughness in the green channel and metallic in the blue channel, as in glTF.
    Packed,
    Normal,
    /// Normal map whose green channel points down, as in DirectX.
    DirectXNormal,
    Opacity,
    Emission,
    Height,
    Occlusion,
}

/// Words at the end of file names that name a role. They are in lower case, without separators.
const WORDS: &[(Role, &[&str])] = &[
    (
        Role::Color,
        &[
            "basecolor",
            "basecolour",
            "albedo",
            "diffuse",
            "diff",
            "dif",
            "color",
            "colour",
            "col",
            "texture",
        ],
    ),
    (Role::Roughness, &["roughness", "rough", "rgh"]),
    (Role::Gloss, &["glossiness", "gloss", "smoothness"]),
    (Role::Metallic, &["metallic", "metalness", "metal"]),
    (
        Role::Packed,
        &["metallicroughness", "occlusionroughnessmetallic", "orm", "arm"],
    ),
    (
        Role::Normal,
        &[
            "normal",
            "normals",
            "normalgl",
            "normalopengl",
            "norm",
            "nor",
            "norgl",
            "nrm",
        ],
    ),
    (Role::DirectXNormal, &["normaldx", "normaldirectx", "nordx"]),
    (Role::Opacity, &["opacity", "alpha"]),
    (Role::Emission, &["emissive", "emission"]),
    (Role::Height, &["height", "displacement", "disp"]),
    (Role::Occlusion, &["ambientocclusion", "occlusion", "ao", "mixedao"]),
];

/// Paths of textures by texture set and role. The name of a set is the part of the file name before
/// the words of the role.
type Sets = BTreeMap<String, BTreeMap<Role, PathBuf>>;

/// Texture sets near an OBJ file.
#[derive(Clone, Debug, Default)]
pub(super) struct NamedMaps {
    /// Texture sets with a colour texture.
    sets: Sets,
    /// Texture sets with an emission texture and without a colour texture.
    glows: Sets,
    /// Files near the OBJ file.
    beside: NearbyFiles,
}

/// Reasons why a texture set belongs to a material. The best reason is first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    /// The set has the name of the material, alone or after the name of the OBJ file or of its
    /// library.
    Material,
    /// The set has the name of the OBJ file, and the file has only this material.
    File,
    /// The folder has only this set and only this OBJ file, and the file has only this material.
    Only,
}

impl NamedMaps {
    /// Finds the texture sets near the OBJ file `path`.
    pub fn beside(path: &Path) -> Self {
        let beside = NearbyFiles::of(path);
        let mut sets = Sets::new();
        for image in &beside.images {
            if let Some((set, role)) = role_of(&stem_of(&image.path)) {
                if !beside.is_rendering(image) {
                    let files = sets.entry(set).or_default();
                    files.entry(role).or_insert_with(|| image.path.clone());
                }
            }
        }
        let has = |files: &BTreeMap<Role, PathBuf>, role| files.contains_key(&role);
        let mut glows = sets.clone();
        glows.retain(|_, files| has(files, Role::Emission) && !has(files, Role::Color));
        sets.retain(|_, files| has(files, Role::Color));
        Self { sets, glows, beside }
    }

    /// Files near the OBJ file.
    pub fn files(&self) -> &NearbyFiles {
        &self.beside
    }

    /// Textures by role of the set that fits the material `name` of the OBJ file `path`; `None` if
    /// no set fits.
    fn of_material(&self, name: &str, path: &Path, obj: &ObjFile) -> Option<BTreeMap<Role, PathBuf>> {
        let (materials, stem) = (obj.groups.len(), stem_of(path));
        let [material, file] = [name, &*stem].map(|text| words_of(text).concat());
        let plain_file = without_sizes(&words_of(&stem)).concat();
        let libraries = obj.named_libraries.iter().map(|name| {
            let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
            words_of(&stem_of(Path::new(name))).concat()
        });
        let libraries: Vec<String> = libraries.filter(|name| !name.is_empty()).collect();
        let is_of_material = |set: &str| {
            let before = set.strip_suffix(&*material);
            before.is_some_and(|before| before.is_empty() || before == file || libraries.iter().any(|l| l == before))
        };
        let fit = |set: &str| {
            if !set.is_empty() && !material.is_empty() && is_of_material(set) {
                Some(Fit::Material)
            } else if materials == 1 && (set == file || !set.is_empty() && set == plain_file) {
                Some(Fit::File)
            } else if materials == 1 && self.beside.is_alone() && self.sets.len() == 1 {
                Some(Fit::Only)
            } else {
                None
            }
        };
        let mut fits: Vec<(Fit, &BTreeMap<Role, PathBuf>)> = self
            .sets
            .iter()
            .filter_map(|(set, files)| Some((fit(set)?, files)))
            .collect();
        fits.sort_by_key(|(fit, _)| *fit);
        match fits.as_slice() {
            [(_, files)] => return Some((*files).clone()),
            [(first, files), (second, _), ..] if first < second => return Some((*files).clone()),
            [_, ..] => return None,
            [] => {}
        }
        if !obj.materials.is_empty() {
            return None;
        }
        let color = |picture| BTreeMap::from([(Role::Color, picture)]);
        let has_no_other_role = |image: &Image| {
            let role = role_of(&stem_of(&image.path));
            role.is_none_or(|(_, role)| role == Role::Color)
        };
        if let Some(picture) = self.beside.picture_of_file(has_no_other_role) {
            return Some(color(picture));
        }
        let mut glows = self.glows.values();
        let glow = glows.next().filter(|_| glows.next().is_none());
        glow.filter(|_| materials == 1 && self.beside.is_alone()).cloned()
    }
}

/// Name of the texture set of a picture, and role of the picture, from its name without extension.
fn role_of(stem: &str) -> Option<(String, Role)> {
    let words = words_of(stem);
    let words = without_sizes(&words);
    // Find the longest end of the name that is a role
    for count in (1..=words.len().min(3)).rev() {
        let (set, end) = words.split_at(words.len() - count);
        let end = end.concat();
        if let Some((role, _)) = WORDS.iter().find(|(_, words)| words.contains(&&*end)) {
            return Some((without_sizes(set).concat(), *role));
        }
    }
    None
}

impl Loader<'_> {
    /// Texture sets near the OBJ file `path`. They are searched only once.
    pub(super) fn maps_beside(&mut self, path: &Path) -> &NamedMaps {
        let beside = self.named_maps.entry(path.to_path_buf());
        beside.or_insert_with(|| NamedMaps::beside(path))
    }

    /// Adds to the material `found` of the OBJ file `path` the textures of the set that fits.
    /// `found` must not have textures.
    pub(super) fn add_named_maps(&mut self, found: &mut FileMaterial, path: &Path, obj: &ObjFile) {
        let Some(files) = self.maps_beside(path).of_material(&found.material.name, path, obj) else {
            return;
        };
        let place = FileError::new(path, "");
        let mut used = Vec::new();
        let mut add = |role: Role, slot: MapSlot, mapping: Mapping| {
            if let Some(file) = files.get(&role) {
                found.maps.push(MapRequest {
                    statement: MapStatement {
                        slot,
                        file: file.to_string_lossy().into_owned(),
                        whole_file: None,
                        mapping,
                        ignored: Vec::new(),
                    },
                    place: place.clone(),
                    is_literal: true,
                    if_cut_out: false,
                    path: None,
                });
                used.push(role);
            }
        };
        let has = |role: Role| files.contains_key(&role);
        let plain = Mapping::default();
        let of = |channel| Mapping {
            channel: Some(channel),
            ..plain
        };
        let inverse = Mapping {
            base: 1.0,
            gain: -1.0,
            ..plain
        };
        add(Role::Color, MapSlot::Diffuse, plain);
        if has(Role::Roughness) {
            add(Role::Roughness, MapSlot::Roughness, plain);
        } else if has(Role::Packed) {
            add(Role::Packed, MapSlot::Roughness, of(Channel::Green));
        } else {
            add(Role::Gloss, MapSlot::Roughness, inverse);
        }
        if has(Role::Metallic) {
            add(Role::Metallic, MapSlot::Metallic, plain);
        } else {
            add(Role::Packed, MapSlot::Metallic, of(Channel::Blue));
        }
        if has(Role::Normal) {
            add(Role::Normal, MapSlot::Normal, plain);
        } else if has(Role::DirectXNormal) {
            let flipped = Mapping {
                flips_green: true,
                ..plain
            };
            add(Role::DirectXNormal, MapSlot::Normal, flipped);
        } else {
            add(Role::Height, MapSlot::Bump, plain);
        }
        add(Role::Opacity, MapSlot::Opacity, plain);
        add(Role::Emission, MapSlot::Emission, plain);

        let name = |role: &Role| files[role].display().to_string();
        let mut names: Vec<String> = used.iter().map(name).collect();
        names.dedup();
        let unused: Vec<String> = files.keys().filter(|role| !used.contains(role)).map(name).collect();
        let mut message = format!(
            "material `{}` names no texture; by their names it has {}",
            excerpt_of_name(&found.material.name),
            names.join(", ")
        );
        if !unused.is_empty() {
            let verb = if unused.len() == 1 { "has" } else { "have" };
            message += &format!("; {} {verb} no effect", unused.join(", "));
        }
        let error = match found.line {
            0 => FileError::new(path, message),
            line => FileError::new(&found.library, message).at(Position::line(line)),
        };
        let error = error.help("--maps-by-name off ignores them");
        self.findings.add(Severity::Note, "maps-by-name", error);

        let used_color = has(Role::Color);
        let material = &mut found.material;
        if used_color {
            material.diffuse = Spectrum::ONE;
        }
        let has_slot = |slot| found.maps.iter().any(|map| map.statement.slot == slot);
        if has_slot(MapSlot::Roughness) || has_slot(MapSlot::Metallic) {
            let metallic = if has_slot(MapSlot::Metallic) { 1.0 } else { 0.0 };
            material.gloss = Gloss::Metallic(metallic);
            material.specular = Spectrum::ONE;
            material.roughness = if has_slot(MapSlot::Roughness) { 1.0 } else { ROUGHNESS };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_a_set_and_a_role() {
        for (stem, set, role) in [
            ("chair_BaseColor", "chair", Role::Color),
            ("Chair_Leg_Base_Color", "chairleg", Role::Color),
            ("Bricks052_1K-JPG_NormalDX", "bricks052", Role::DirectXNormal),
            ("rock_wall_nor_gl_4k", "rockwall", Role::Normal),
            ("rock_wall_arm_4k", "rockwall", Role::Packed),
            ("material_0_metallicRoughness", "material", Role::Packed),
            ("Cigarette_1001_Roughness", "cigarette", Role::Roughness),
            ("albedo", "", Role::Color),
            ("Wood AO", "wood", Role::Occlusion),
            ("Woman_posed_001_dif_2k", "womanposed", Role::Color),
            ("Woman_posed_001_norm_2k", "womanposed", Role::Normal),
        ] {
            assert_eq!(role_of(stem), Some((set.to_string(), role)), "{stem}");
        }
        for stem in ["", "photo", "colorful", "normal_map_of_x", "1001"] {
            assert_eq!(role_of(stem), None, "{stem}");
        }
    }
}
