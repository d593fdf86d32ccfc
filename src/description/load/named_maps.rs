//! Textures that no library names: `NAME_basecolor.png`, `NAME_roughness.png` and so on, beside the
//! OBJ file or in its folders of textures, as Sketchfab, Substance, ambientCG and Poly Haven call them.
//!
//! A material without any texture gets the textures of a set if exactly one set fits its name. The
//! rules are those of [`Fit`]. Without any library, a single picture of the file's own name, such
//! as `raptor.jpg` for `raptor.obj`, is the colour of all materials. Pictures that this program
//! wrote are no textures.

use super::Loader;
use crate::color::Spectrum;
use crate::description::find_texture::texture_folders;
use crate::description::mtl::{FileMaterial, MapRequest, MapSlot, MapStatement};
use crate::description::obj::ObjFile;
use crate::description::{FileError, Position, Severity};
use crate::material::Gloss;
use crate::math::excerpt_of_name;
use crate::texture::{Channel, Mapping};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Files of a folder that are looked at.
const MAX_FILES: usize = 10_000;
/// Ends of the names of pictures.
const EXTENSIONS: [&str; 13] = [
    "png", "jpg", "jpeg", "tga", "tif", "tiff", "webp", "bmp", "exr", "hdr", "dds", "gif", "jfif",
];
/// Begin of the names of metadata that this program writes into pictures.
const METADATA: &[u8] = b"embrasure.";
/// Bytes of a picture that are searched for them.
const METADATA_BYTES: u64 = 1 << 16;
/// Roughness of a surface whose set has a map of metal and none of roughness.
const ROUGHNESS: f32 = 0.5;

/// The property that a texture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    Color,
    Roughness,
    /// 1 − roughness.
    Gloss,
    Metallic,
    /// Roughness in green and metal in blue, as glTF has them.
    Packed,
    Normal,
    /// A normal map whose green points down.
    DirectXNormal,
    Opacity,
    Emission,
    Height,
    Occlusion,
}

/// Last words of a name without separators, in lower case, by role.
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

/// Textures by set, and role; a set has the words of a name before its role.
type Sets = BTreeMap<String, BTreeMap<Role, PathBuf>>;

/// Textures beside an OBJ file.
#[derive(Clone, Debug, Default)]
pub(super) struct NamedMaps {
    sets: Sets,
    /// Pictures of the name of the OBJ file.
    of_file: Vec<PathBuf>,
    /// True if the folder has one OBJ file.
    is_alone: bool,
}

/// The reason why a set belongs to a material, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    /// The set has the name of the material, or those of the file and the material.
    Material,
    /// The set has the name of the file, whose only material this is.
    File,
    /// It is the only set, beside the only OBJ file of the folder, whose only material this is.
    Only,
}

impl NamedMaps {
    /// Textures of the folders beside the OBJ file `path`.
    fn beside(path: &Path) -> Self {
        let here = path.parent().unwrap_or(Path::new(""));
        let file = words_of(&stem_of(path)).concat();
        let mut found = Self::default();
        let mut objs = 0;
        for folder in texture_folders() {
            let listed = here.join(&folder);
            let listed = if listed.as_os_str().is_empty() {
                Path::new(".")
            } else {
                &listed
            };
            let entries = fs::read_dir(listed).into_iter().flatten().flatten();
            let mut names: Vec<PathBuf> = entries.take(MAX_FILES).map(|entry| entry.file_name().into()).collect();
            names.sort_unstable();
            for name in names {
                let extension = name.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
                objs += usize::from(extension == "obj" && folder.as_os_str().is_empty());
                if !EXTENSIONS.contains(&&*extension) {
                    continue;
                }
                let stem = stem_of(&name);
                let is_of_file = words_of(&stem).concat() == file;
                let set_and_role = role_of(&stem);
                if (is_of_file || set_and_role.is_some()) && is_rendering(&listed.join(&name)) {
                    continue;
                }
                if is_of_file {
                    found.of_file.push(folder.join(&name));
                }
                if let Some((set, role)) = set_and_role {
                    let files = found.sets.entry(set).or_default();
                    files.entry(role).or_insert_with(|| folder.join(&name));
                }
            }
        }
        found.sets.retain(|_, files| files.contains_key(&Role::Color));
        found.is_alone = objs == 1;
        found
    }

    /// The textures that fit the material `name` of the file `path`.
    fn of_material(&self, name: &str, path: &Path, obj: &ObjFile) -> Option<BTreeMap<Role, PathBuf>> {
        let (materials, stem) = (obj.groups.len(), stem_of(path));
        let [material, file] = [name, &*stem].map(|text| words_of(text).concat());
        let plain_file = without_sizes(&words_of(&stem)).concat();
        let fit = |set: &str| {
            if !set.is_empty() && (set == material || set == format!("{file}{material}")) {
                Some(Fit::Material)
            } else if materials == 1 && (set == file || !set.is_empty() && set == plain_file) {
                Some(Fit::File)
            } else if materials == 1 && self.is_alone && self.sets.len() == 1 {
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
        match (fits.as_slice(), self.of_file.as_slice()) {
            ([(_, files)], _) => Some((*files).clone()),
            ([(first, files), (second, _), ..], _) if first < second => Some((*files).clone()),
            ([], [picture]) if obj.materials.is_empty() => Some(BTreeMap::from([(Role::Color, picture.clone())])),
            _ => None,
        }
    }
}

/// Words of a name in lower case: letters and digits between separators, and between small and capital
/// letters.
fn words_of(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in name.chars() {
        if c.is_alphanumeric() {
            let begins = !before.is_alphanumeric() || before.is_lowercase() && c.is_uppercase();
            if begins {
                words.push(String::new());
            }
            if let Some(word) = words.last_mut() {
                word.extend(c.to_lowercase());
            }
        }
        before = c;
    }
    words
}

/// Returns true for a word that says how large a picture is, or how it is kept: `2k`, `1001`, `jpg`.
fn is_about_size(word: &str) -> bool {
    let digits = word.strip_suffix('k').unwrap_or(word);
    (!digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit())) || matches!(word, "jpg" | "png" | "exr")
}

/// The words without those about size at their end.
fn without_sizes(words: &[String]) -> &[String] {
    let end = words.iter().rposition(|word| !is_about_size(word));
    &words[..end.map_or(0, |end| end + 1)]
}

/// Returns true for a picture that this program wrote, such as `model.png` of an earlier render of
/// `model.obj`. Its metadata precede its pixels.
fn is_rendering(path: &Path) -> bool {
    let mut begin = Vec::new();
    let read = File::open(path).and_then(|file| file.take(METADATA_BYTES).read_to_end(&mut begin));
    read.is_ok() && begin.windows(METADATA.len()).any(|window| window == METADATA)
}

/// Name of a file without its extension.
fn stem_of(path: &Path) -> Cow<'_, str> {
    path.file_stem().unwrap_or_default().to_string_lossy()
}

/// The set and the role of a picture, by its name without extension.
fn role_of(stem: &str) -> Option<(String, Role)> {
    let words = words_of(stem);
    let words = without_sizes(&words);
    // The longest end that is a role
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
    /// Gives `found`, which has no texture, those of a set that fits it. It is a material of the
    /// file `path`.
    pub(super) fn add_named_maps(&mut self, found: &mut FileMaterial, path: &Path, obj: &ObjFile) {
        let beside = self.named_maps.entry(path.to_path_buf());
        let beside = beside.or_insert_with(|| NamedMaps::beside(path));
        let Some(files) = beside.of_material(&found.material.name, path, obj) else {
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

        let material = &mut found.material;
        material.diffuse = Spectrum::ONE;
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
