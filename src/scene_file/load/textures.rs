//! Textures of the materials of a scene.

use super::Loader;
use super::beside::{PictureMatch, offer_in_words};
use super::picture_names::{has_extension, with_extensions};
use super::texture_reports::{MissingUse, others, words_of_decision};
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::io::{Tiles, path_of_tiles, tile_names};
use crate::material::{Map, Maps, Material, MaterialId};
use crate::math::{Vec2, excerpt_of_name};
use crate::scene_file::Finding;
use crate::scene_file::find_file::case_differs;
use crate::scene_file::find_texture::{FoundTexture, TextureSearch};
use crate::scene_file::mtl::{FileMaterial, MapRequest, MapSlot, MapStatement, default_material};
use crate::scene_file::texture::{TextureKind, TextureRequest, has_alpha, load_textures_within};
use crate::scene_file::{FileError, Severity};
use crate::texture::{Channel, Mapping, TextureId, Wrap};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Request of a material for a texture.
pub(super) struct MaterialTexture {
    request: MapRequest,
    /// Index of the material in the list of materials.
    material: usize,
}

impl MaterialTexture {
    /// The other slot of the request (bump map or normal map), if a texture of `kind` belongs
    /// there. `None` if the written slot is right.
    fn moved_to(&self, kind: TextureKind) -> Option<MapSlot> {
        let other = self.request.other_slot();
        other.filter(|&slot| (slot == MapSlot::Normal) == kind.is_normal())
    }
}

impl Loader<'_> {
    /// Material whose texture ids are numbers of texture requests. Id 2 i is request i in the slot
    /// of its statement. Id 2 i + 1 is the same request in the other slot (bump map or normal map),
    /// for pictures that belong there. `mesh` uses the material. If `is_mean` is true, the means of
    /// the textures are used, because the mesh has no texture coordinates.
    pub(super) fn textured(
        &mut self,
        found: &mut FileMaterial,
        obj: &Path,
        (mesh, is_mean): (&Mesh, bool),
    ) -> Material {
        let mut material = found.material.clone();
        let slots: Vec<MapSlot> = found.maps.iter().map(|request| request.statement.slot).collect();
        let mut colors: Option<(String, PathBuf)> = None;
        // Displacement maps are requested when objects are displaced, not here
        let maps = found.maps.iter_mut();
        for request in maps.filter(|request| request.statement.slot != MapSlot::Displacement) {
            request.path = if request.if_cut_out {
                let of_colors = colors.as_ref().filter(|(file, _)| *file == request.statement.file);
                of_colors.map(|(_, path)| path.clone()).filter(|path| has_alpha(path))
            } else {
                self.find_texture(request, &material.name, obj)
            };
            self.replace_normals_as_color(request);
            if let (MapSlot::Diffuse, Some(path)) = (request.statement.slot, &request.path) {
                colors = Some((request.statement.file.clone(), path.clone()));
            }
            let statement = &request.statement;
            let Some(path) = request.path.clone() else {
                if statement.slot == MapSlot::Diffuse && material.diffuse == Spectrum::ONE {
                    material.diffuse = default_material("").diffuse;
                }
                continue;
            };
            let first = 2 * self.textures.len() as u32;
            let mut mapping = statement.mapping;
            if let Some(tiles) = Tiles::of_path(&path) {
                if !request.if_cut_out {
                    self.report_tiles(request, &tiles, mesh);
                }
                mapping = mapping_of_tiles(mapping, &tiles);
            }
            let map = |id| {
                Some(Map {
                    texture: TextureId(id),
                    mapping,
                })
            };
            let other = request.other_slot().filter(|other| !slots.contains(other));
            for (slot, id) in [(Some(statement.slot), first), (other, first + 1)] {
                if let Some(of_slot) = slot.and_then(|slot| map_of(&mut material.maps, slot)) {
                    *of_slot = map(id);
                }
            }
            self.textures.push(TextureRequest {
                path,
                kind: kind_of(request),
                wrap: mapping.wrap,
                is_mean,
            });
            self.material_textures.push(MaterialTexture {
                request: request.clone(),
                material: self.materials.len(),
            });
        }
        found
            .maps
            .retain(|request| !request.if_cut_out || request.path.is_some());
        material
    }

    /// Path of a texture of `material`; `None` if the file is missing. Missing files, and files
    /// found at another path, are recorded for reports.
    pub(super) fn find_texture(&mut self, request: &MapRequest, material: &str, obj: &Path) -> Option<PathBuf> {
        let statement = &request.statement;
        let folder = request.place.file.parent().unwrap_or(Path::new(""));
        let search = TextureSearch::new(&request.place.file, &self.texture_dirs, obj);
        let names = statement.names().flat_map(|name| match tile_names(name) {
            Some(tiles) => tiles.collect(),
            None => vec![name.to_string()],
        });
        let names: Vec<String> = names.collect();
        let names = names.iter().map(String::as_str);
        match search.find(names.clone(), &mut self.finder) {
            Some(FoundTexture::AsNamed(path)) => {
                let has_case = |name: &str| !case_differs(folder, name, &path);
                if !names.clone().any(|name| has_case(name) && !name.contains('\\')) {
                    let (code, words, help) = if names.clone().any(has_case) {
                        let help = "separate folders by /, which programs on all systems read";
                        ("backslashes", "has backslashes between folders, and is found as", help)
                    } else {
                        let help = "write the name exactly as the file is called; other systems may not find the file";
                        ("other-case", "is found as", help)
                    };
                    let found = request.remark(&format!("{words} {}", path.display()));
                    self.findings.add(Severity::Note, code, found.help(help));
                }
                Some(with_all_tiles(path, statement))
            }
            Some(FoundTexture::Elsewhere(path)) => {
                let place = path.parent().unwrap_or(Path::new(""));
                let place = (request.place.file.clone(), place.to_path_buf());
                let found = self.found_elsewhere.entry(place).or_default();
                if found.iter().all(|(known, _)| known.statement.file != statement.file) {
                    found.push((request.clone(), path.clone()));
                }
                Some(with_all_tiles(path, statement))
            }
            None => {
                let found = self.without_extension(request, obj);
                if let Some(path) = found.or_else(|| self.stand_in(request, obj)) {
                    return Some(path);
                }
                let search = TextureSearch::new(&request.place.file, &self.texture_dirs, obj);
                let (what, mut help) = if folder.join(&statement.file).is_dir() {
                    ("is a directory", "name a picture file".into())
                } else {
                    ("is missing", search.help(&statement.file, &mut self.finder))
                };
                if statement.slot == MapSlot::Diffuse {
                    let offers = self.maps_beside(obj).offers(&[&request.place.file]);
                    if let Some((names, advice)) = offer_in_words(material, offers) {
                        help += &format!("; pictures near the OBJ file: {names}; {advice}");
                    }
                }
                let file = (request.place.file.clone(), statement.file.clone());
                self.missing.entry(file).or_default().push(MissingUse {
                    request: request.clone(),
                    material: material.into(),
                    what,
                    help,
                });
                None
            }
        }
    }

    /// Path of a texture whose name has no extension, as Blockbench writes it. The texture is the
    /// picture with this name, if no other library of the folder names this picture. Else it is the
    /// only picture beside the OBJ file.
    fn without_extension(&mut self, request: &MapRequest, obj: &Path) -> Option<PathBuf> {
        let name = request.statement.file.trim();
        if has_extension(name) || name.is_empty() {
            return None;
        }
        let own = request.place.file.clone();
        let beside = self.maps_beside(obj).files();
        let claimed = beside.claimed(&[&own]);
        let only = beside.only_here(&claimed);
        let search = TextureSearch::new(&own, &self.texture_dirs, obj);
        let names = with_extensions(name);
        let found = search.find(names.iter().map(String::as_str), &mut self.finder);
        let path = match found {
            Some(FoundTexture::AsNamed(path) | FoundTexture::Elsewhere(path)) => Some(path),
            None => None,
        };
        let is_free = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
            !claimed.contains(&name)
        };
        let path = path.filter(is_free).or(only)?;
        let found = request.remark(&format!("has no extension; {} is used", path.display()));
        let help = "write the name with the extension of the picture";
        self.findings.add(Severity::Note, "found-elsewhere", found.help(help));
        Some(path)
    }

    /// Picture with the name of the OBJ file, in place of its only colour texture, which is
    /// missing.
    fn stand_in(&mut self, request: &MapRequest, obj: &Path) -> Option<PathBuf> {
        let library = &request.place.file;
        let is_color = request.statement.slot == MapSlot::Diffuse && tile_names(&request.statement.file).is_none();
        let untextured = self.untextured.get(obj).filter(|_| is_color)?;
        if !untextured.has_one_color || !untextured.libraries.contains(library) {
            return None;
        }
        let PictureMatch::One(picture) = self.maps_beside(obj).files().picture_of_name() else {
            return None;
        };
        let picture = obj.parent().unwrap_or(Path::new("")).join(picture);
        let uses = self.stand_ins.entry((library.clone(), picture.clone())).or_default();
        uses.push(request.clone());
        Some(picture)
    }

    pub(super) fn load_textures(&mut self) {
        self.report_missing();
        self.report_found_elsewhere();
        self.report_stand_ins();
        for texture in &self.textures {
            match Tiles::of_path(&texture.path) {
                Some(tiles) => self.files.extend(tiles.files().map(Path::to_path_buf)),
                None => self.files.push(texture.path.clone()),
            }
        }
        let loaded = match load_textures_within(&self.textures, self.allowance, self.observer) {
            Ok(loaded) => loaded,
            Err(error) => {
                let mut asked = self.material_textures.iter().zip(&self.textures);
                let request = asked
                    .find(|(_, texture)| texture.path == error.file)
                    .map(|(asked, _)| &asked.request);
                let words = format!("cannot be used: {}: {}", error.place(), error.message);
                let placed = request.map(|request| FileError {
                    help: error.help.clone(),
                    ..request.remark(&words)
                });
                return self.wrong("memory", placed.unwrap_or(error));
            }
        };
        for warning in loaded.warnings {
            self.warn("bad-texels", warning);
        }
        for warning in loaded.ignored {
            self.warn("ignored-metadata", warning);
        }
        let asked = std::mem::take(&mut self.material_textures);
        let mut ids = Vec::with_capacity(2 * asked.len());
        let (mut decided, mut cut_outs) = (Vec::new(), Vec::new());
        for ((result, asked), file) in loaded.ids.into_iter().zip(&asked).zip(&self.textures) {
            // Texture ids are assigned in the order of the first requests
            if matches!(result, Ok(TextureId(id)) if id as usize == self.texture_files.len()) {
                self.texture_files.push(file.path.clone());
            }
            if asked.request.if_cut_out {
                ids.extend([result.as_ref().ok().copied(), None]);
                cut_outs.push((asked, result.is_ok()));
                continue;
            }
            if let Err(error) = &result {
                let (place, message) = (error.place(), &error.message);
                // If the system cannot read a file, its contents may be valid: report an error
                // instead of replacing the texture by a constant
                let severity = if error.is_unreadable() {
                    Severity::Error
                } else {
                    self.file.load.severity_of_lack()
                };
                let instead = match severity {
                    Severity::Error => "",
                    _ => "; the material's constant is used instead",
                };
                let words = format!("cannot be used: {place}: {message}{instead}");
                let mut unread = asked.request.remark(&words);
                unread.help.clone_from(&error.help);
                self.findings.add(severity, "unreadable-texture", unread);
            }
            let id = result.ok();
            let kind = id.map(|TextureId(id)| loaded.kinds[id as usize]);
            let is_moved = kind.is_some_and(|kind| asked.moved_to(kind).is_some());
            ids.extend(if is_moved { [None, id] } else { [id, None] });
            decided.extend(kind.map(|kind| (asked, kind)));
        }
        // Find materials whose bump and normal statements name each other's pictures
        let exchanged = exchanged(&decided);
        for (i, asked) in asked.iter().enumerate() {
            if exchanged.contains(&asked.material) && asked.request.other_slot().is_some() {
                ids.swap(2 * i, 2 * i + 1);
            }
        }
        for &material in &exchanged {
            self.builder.exchange_bumps(MaterialId(material as u32));
        }
        self.builder.set_textures(loaded.textures, &ids);
        self.builder.texture_filter(self.file.load.parameters.texture_filter());
        self.move_maps(&decided, &exchanged);
        for (asked, is_cut_out) in cut_outs {
            self.decide_cut_out(asked, is_cut_out);
        }
    }

    /// Decides if the alpha of a colour texture is used as the opacity of its material. The opacity
    /// map stays in the material's source if the picture is a cut-out, and is removed otherwise.
    /// Each cut-out is reported once.
    fn decide_cut_out(&mut self, asked: &MaterialTexture, is_cut_out: bool) {
        let maps = self
            .materials
            .get_mut(asked.material)
            .map(|source| &mut source.found.maps);
        if let Some(maps) = maps {
            maps.retain(|map| is_cut_out || !map.if_cut_out);
            maps.iter_mut().for_each(|map| map.if_cut_out = false);
        }
        if is_cut_out {
            let name = self.materials.get(asked.material).map_or("", |source| &source.name);
            let found = asked
                .request
                .remark("has transparent regions, so its alpha is used as opacity");
            let help = format!(
                "write `map_d` with the picture to confirm this, or ignore the alpha with --material '{}.opacity_map=false'",
                excerpt_of_name(name)
            );
            let found = found.help(help);
            if self.findings.iter().all(|known| known.error.message != found.message) {
                self.findings.add(Severity::Note, "cut-out", found);
            }
        }
    }

    /// Moves textures in the sources of materials to the slots that fit their pictures. Reports
    /// this once for each library and effect.
    fn move_maps(&mut self, decided: &[(&MaterialTexture, TextureKind)], exchanged: &BTreeSet<usize>) {
        for &material in exchanged {
            let source = self.materials.get_mut(material);
            for map in source.into_iter().flat_map(|source| &mut source.found.maps) {
                map.statement.slot = map.other_slot().unwrap_or(map.statement.slot);
            }
        }
        let mut decisions: BTreeMap<(&Path, &str), Vec<&MapRequest>> = BTreeMap::new();
        for &(asked, kind) in decided {
            let MaterialTexture { request, material } = asked;
            let Some(source) = self.materials.get_mut(*material) else {
                continue;
            };
            let slot = asked.moved_to(kind);
            let is_exchanged = exchanged.contains(material);
            let has_effect = is_exchanged || slot.is_none_or(|slot| !source.found.has_map(slot));
            let Some(words) = words_of_decision(kind, slot.is_some(), has_effect) else {
                continue;
            };
            let (maps, written) = (&mut source.found.maps, request.statement.slot);
            if !is_exchanged {
                maps.retain(|map| has_effect || map.statement.slot != written);
                let same = maps.iter_mut().filter(|map| map.statement.slot == written);
                same.for_each(|map| map.statement.slot = slot.unwrap_or(written));
            }
            let alike = decisions.entry((&request.place.file, words)).or_default();
            if alike.iter().all(|known| known.statement.file != request.statement.file) {
                alike.push(request);
            }
        }
        for ((_, words), mut requests) in decisions {
            requests.sort_by_key(|request| request.place.position.map(|position| position.line));
            let Some(first) = requests.first() else { continue };
            let others = others(requests.len() - 1, "of this file");
            let help = "write `norm` for normal maps and `map_Bump` for heights; in a scene file, `normal_map` and `bump_map` \
                        are never exchanged";
            let error = first.remark(&format!("{words}{others}")).help(help);
            let more = requests.iter().skip(1).filter_map(|request| request.place.position);
            let finding = Finding::new(Severity::Note, "heights-or-normals", error);
            self.findings.push(finding.repeated(requests.len() as u64, more));
        }
    }
}

/// Materials whose height map and normal map are exchanged.
fn exchanged(decided: &[(&MaterialTexture, TextureKind)]) -> BTreeSet<usize> {
    let moved = |slot: MapSlot| -> BTreeSet<usize> {
        let moved = decided
            .iter()
            .filter(|(asked, kind)| asked.moved_to(*kind) == Some(slot));
        moved.map(|(asked, _)| asked.material).collect()
    };
    &moved(MapSlot::Bump) & &moved(MapSlot::Normal)
}

/// Path pattern of all tiles, if `found` is one of several tiles (UDIM). This is so if the name in
/// the library is a pattern of tiles, or if other tiles lie beside tile 1001. Else returns `found`.
fn with_all_tiles(found: PathBuf, statement: &MapStatement) -> PathBuf {
    let is_said = statement.names().any(|name| tile_names(name).is_some());
    let is_first = || found.to_string_lossy().contains("1001");
    let Some(path) = path_of_tiles(&found).filter(|_| is_said || is_first()) else {
        return found;
    };
    let count = Tiles::of_path(&path).map_or(0, |tiles| tiles.files().count());
    if is_said || count > 1 { path } else { found }
}

/// Kind of texture that the statement of a request names.
pub(super) fn kind_of(request: &MapRequest) -> TextureKind {
    let MapStatement { slot, mapping, .. } = &request.statement;
    let value = |default| TextureKind::Value(mapping.channel.unwrap_or(default));
    match (slot, request.other_slot()) {
        _ if request.if_cut_out => TextureKind::CutOut,
        (_, Some(MapSlot::Normal)) => TextureKind::HeightsOrNormals,
        (_, Some(_)) => TextureKind::NormalsOrHeights,
        (MapSlot::Diffuse | MapSlot::Specular | MapSlot::Emission, _) => TextureKind::Color,
        (MapSlot::Normal, _) => TextureKind::Normal,
        (MapSlot::Opacity, _) => value(Channel::Opacity),
        (MapSlot::Exponent | MapSlot::Bump | MapSlot::Roughness | MapSlot::Metallic | MapSlot::Displacement, _) => {
            value(Channel::Luminance)
        }
    }
}

/// Mapping for tiles that are joined and read as one picture.
pub(super) fn mapping_of_tiles(mapping: Mapping, tiles: &Tiles) -> Mapping {
    let size = Vec2::from(tiles.size().map(|count| count as f32));
    Mapping {
        scale: mapping.scale / size,
        offset: mapping.offset / size,
        wrap: Wrap::Clamp,
        ..mapping
    }
}

/// The map in the slot `slot`; `None` for slots that are not used during rendering.
fn map_of(maps: &mut Maps, slot: MapSlot) -> Option<&mut Option<Map>> {
    Some(match slot {
        MapSlot::Diffuse => &mut maps.diffuse,
        MapSlot::Specular => &mut maps.specular,
        MapSlot::Emission => &mut maps.emission,
        MapSlot::Exponent => &mut maps.exponent,
        MapSlot::Opacity => &mut maps.opacity,
        MapSlot::Bump => &mut maps.bump,
        MapSlot::Normal => &mut maps.normal,
        MapSlot::Roughness => &mut maps.roughness,
        MapSlot::Metallic => &mut maps.metallic,
        MapSlot::Displacement => return None,
    })
}
