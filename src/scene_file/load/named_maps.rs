//! Textures that no library names: `NAME_basecolor.png`, `NAME_roughness.png` and so on. They lie
//! beside the OBJ file or in its texture folders, with names as in Sketchfab, Substance, ambientCG
//! and Poly Haven.
//!
//! A material without any texture gets the textures of a set if exactly one set fits its name.
//! [`Fit`] has the rules. Without any library, one picture can be the colour of all materials
//! ([`NearbyFiles::picture_of_name`], [`NearbyFiles::picture_like_name`],
//! [`NearbyFiles::only_picture`]). Names of the file and the material have priority over role
//! words: a set with the name of another thing is not used. Pictures that this program wrote are
//! not textures.

use super::Loader;
use super::beside::{Image, NearbyFiles, Offers, PictureMatch, is_claimed};
use super::picture_names::{are_alike, is_generic, stem_of, without_sizes, words_of};
use super::picture_roles::{Role, role_of};
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::material::Gloss;
use crate::math::excerpt_of_name;
use crate::scene_file::mtl::{FileMaterial, MapRequest, MapSlot, MapStatement};
use crate::scene_file::obj::ObjFile;
use crate::scene_file::{FileError, Position, Severity};
use crate::texture::{Channel, Mapping};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

/// Roughness of a surface whose texture set has a metallic map, but no roughness map.
const ROUGHNESS: f32 = 0.5;

/// Textures whose names differ by the role.
#[derive(Clone, Debug, Default)]
struct TextureSet {
    /// Words of the file names before the role.
    words: Vec<String>,
    /// Textures by role.
    files: BTreeMap<Role, PathBuf>,
}

/// Texture sets by their names: the words of a name, joined without separators.
type TextureSets = BTreeMap<String, TextureSet>;

/// Texture sets near an OBJ file.
#[derive(Clone, Debug, Default)]
pub(super) struct NamedMaps {
    /// Texture sets with a colour texture.
    sets: TextureSets,
    /// Texture sets with an emission texture and without a colour texture.
    glows: TextureSets,
    /// Files near the OBJ file.
    beside: NearbyFiles,
}

/// Reasons why a set certainly belongs to a material, the best reason first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    /// The set has the name of the material, alone or after the name of the OBJ file or of its
    /// library.
    Material,
    /// The set has the name of the OBJ file, and the file has only this material.
    File,
}

/// Textures of a material.
#[derive(Debug, PartialEq, Eq)]
struct MaterialMaps {
    /// Textures by role.
    files: BTreeMap<Role, PathBuf>,
    /// True if the textures have exactly the name of the material or of the OBJ file. False if the
    /// names are only similar, or if the textures are the only pictures near the file: these
    /// textures may belong to another model.
    is_certain: bool,
}

impl MaterialMaps {
    fn certain(files: &BTreeMap<Role, PathBuf>) -> Option<Self> {
        let (files, is_certain) = (files.clone(), true);
        Some(Self { files, is_certain })
    }

    fn likely(files: &BTreeMap<Role, PathBuf>) -> Option<Self> {
        let (files, is_certain) = (files.clone(), false);
        Some(Self { files, is_certain })
    }
}

impl NamedMaps {
    /// Finds the texture sets near the OBJ file `path`.
    pub fn beside(path: &Path) -> Self {
        let beside = NearbyFiles::of(path);
        let mut sets = TextureSets::new();
        for image in &beside.images {
            if let Some((words, role)) = role_of(&stem_of(&image.path)) {
                if !beside.is_rendering(image) {
                    let set = sets.entry(words.concat()).or_default();
                    set.words = words;
                    set.files.entry(role).or_insert_with(|| image.path.clone());
                }
            }
        }
        let has = |set: &TextureSet, role| set.files.contains_key(&role);
        let mut glows = sets.clone();
        glows.retain(|_, set| has(set, Role::Emission) && !has(set, Role::Color));
        sets.retain(|_, set| has(set, Role::Color));
        Self { sets, glows, beside }
    }

    /// Files near the OBJ file.
    pub fn files(&self) -> &NearbyFiles {
        &self.beside
    }

    /// Pictures to suggest to the user as textures of the file: [`NearbyFiles::offers`]. If there
    /// is only one texture set, its colour texture is among them.
    pub fn offers(&self, own: &[&Path]) -> Offers {
        let mut sets = self.sets.values();
        let only = sets.next().filter(|_| sets.next().is_none());
        let color = only.and_then(|set| set.files.get(&Role::Color));
        self.beside.offers(own, color.map(PathBuf::as_path))
    }

    /// Textures that fit the material `name` of the file `path`. `mesh` has this material, and
    /// `parts` are names of parts of the file.
    fn of_material(
        &self,
        name: &str,
        mesh: &Mesh,
        path: &Path,
        obj: &ObjFile,
        parts: &[String],
    ) -> Option<MaterialMaps> {
        let (is_single, stem) = (obj.groups.len() == 1, stem_of(path));
        let [material, file] = [name, &*stem].map(|text| words_of(text).concat());
        let plain_file = without_sizes(&words_of(&stem)).concat();
        let libraries = obj.named_libraries.iter().map(|name| {
            let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
            words_of(&stem_of(Path::new(name)))
        });
        let libraries: Vec<Vec<String>> = libraries.filter(|name| !name.is_empty()).collect();
        // Many models have a material `default`. Beside several OBJ files, textures with this name
        // belong to one of them only
        let is_any = is_generic(&words_of(name)) && !self.beside.is_alone();
        let is_of_material = |set: &str| {
            let before = set.strip_suffix(&*material);
            let is_library = |before: &str| libraries.iter().any(|library| library.concat() == before);
            before.is_some_and(|before| match before {
                "" => !is_any,
                _ => before == file || is_library(before),
            })
        };
        let fit = |set: &str| {
            if !set.is_empty() && !material.is_empty() && is_of_material(set) {
                Some(Fit::Material)
            } else if is_single && (set == file || !set.is_empty() && set == plain_file) {
                Some(Fit::File)
            } else {
                None
            }
        };
        let mut fits: Vec<(Fit, &TextureSet)> = self
            .sets
            .iter()
            .filter_map(|(name, set)| Some((fit(name)?, set)))
            .collect();
        fits.sort_by_key(|(fit, _)| *fit);
        match fits.as_slice() {
            [(_, set)] => return MaterialMaps::certain(&set.files),
            [(first, set), (second, _), ..] if first < second => return MaterialMaps::certain(&set.files),
            [_, ..] => return None,
            [] => {}
        }
        // A library that defines none of the materials in use is of no help
        let mut used = obj
            .groups
            .iter()
            .filter_map(|group| group.material.as_deref())
            .peekable();
        let is_unnamed = used.peek().is_none();
        let has_library = !obj.materials.is_empty() && (is_unnamed || used.any(|name| obj.material(name).is_some()));
        let color = |picture| BTreeMap::from([(Role::Color, picture)]);
        let mut preview = None;
        if !has_library {
            match self.beside.picture_of_name() {
                PictureMatch::Nothing => {}
                PictureMatch::Several => return None,
                PictureMatch::One(picture) if self.beside.is_preview(&picture, mesh) => preview = Some(picture),
                PictureMatch::One(picture) => return MaterialMaps::certain(&color(picture)),
            }
        }
        if has_library && !is_single {
            return None;
        }
        // Sets whose names are only similar to the name of the material or of the file
        let is_alone = self.beside.is_alone();
        let own: Vec<&Path> = obj.libraries.iter().map(PathBuf::as_path).collect();
        let claimed = if is_single {
            self.beside.claimed(&own)
        } else {
            HashSet::new()
        };
        let is_free = |set: &TextureSet| !set.files.values().any(|file| is_claimed(&claimed, file));
        let words = words_of(name);
        let is_like = |set: &TextureSet| {
            let is_like_material = !is_generic(&words) && are_alike(&set.words, &words);
            is_like_material || self.beside.is_like_file(&set.words)
        };
        let is_near = |set: &TextureSet| {
            let names = parts.iter().map(|part| words_of(part));
            let mut names = names.chain(libraries.iter().cloned());
            let is_like_other = names.any(|name| !is_generic(&name) && are_alike(&set.words, &name));
            is_generic(&set.words) || is_like_other || self.beside.is_like_folder(&set.words)
        };
        let only = |sets: &TextureSets| sets.values().next().filter(|_| sets.len() == 1).cloned();
        if is_single && !has_library {
            let mut like = self.sets.values().filter(|set| is_free(set) && is_like(set));
            if let Some(set) = like.next().filter(|_| like.next().is_none()) {
                return MaterialMaps::likely(&set.files);
            }
        }
        let has_no_other_role = |image: &Image| {
            let role = role_of(&stem_of(&image.path));
            role.is_none_or(|(_, role)| role == Role::Color) && preview.as_ref() != Some(&image.path)
        };
        if !has_library {
            match self.beside.picture_like_name(has_no_other_role, is_single) {
                PictureMatch::Nothing => {}
                PictureMatch::Several => return None,
                PictureMatch::One(picture) => return MaterialMaps::likely(&color(picture)),
            }
        }
        let is_right = |set: &TextureSet| is_single && is_alone && is_free(set) && (is_like(set) || is_near(set));
        if let Some(set) = only(&self.sets).filter(is_right) {
            return MaterialMaps::likely(&set.files);
        }
        if has_library {
            return None;
        }
        // A picture beside several OBJ files is the texture of all of them.
        let is_foreign = |image: &Image| {
            let set = role_of(&stem_of(&image.path)).and_then(|(words, _)| self.sets.get(&words.concat()));
            is_alone && set.is_some_and(|set| !is_like(set) && !is_near(set))
        };
        let may_be = |image: &Image| has_no_other_role(image) && !is_foreign(image);
        if let Some(picture) = self.beside.only_picture(may_be, parts) {
            return MaterialMaps::likely(&color(picture));
        }
        only(&self.glows)
            .filter(is_right)
            .and_then(|set| MaterialMaps::likely(&set.files))
    }
}

impl Loader<'_> {
    /// Texture sets near the OBJ file `path`. They are searched only once.
    pub(super) fn maps_beside(&mut self, path: &Path) -> &NamedMaps {
        let beside = self.named_maps.entry(path.to_path_buf());
        beside.or_insert_with(|| NamedMaps::beside(path))
    }

    /// Adds to the material `found` of the OBJ file `path` the textures of the set that fits. The
    /// mesh `mesh` has the material. `found` must not have textures.
    pub(super) fn add_named_maps(&mut self, found: &mut FileMaterial, mesh: &Mesh, path: &Path, obj: &ObjFile) {
        let parts = self.part_names.get(path).cloned().unwrap_or_default();
        let maps = self.maps_beside(path);
        let Some(MaterialMaps { files, is_certain }) = maps.of_material(&found.material.name, mesh, path, obj, &parts)
        else {
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
            "material `{}` names no texture; by the file names it {}has {}",
            excerpt_of_name(&found.material.name),
            if is_certain { "" } else { "probably " },
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
        let error = error.help("--maps-by-name off ignores these textures");
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
