//! Textures that materials of a scene ask for.

use super::Loader;
use crate::color::Spectrum;
use crate::description::Finding;
use crate::description::find_file::case_differs;
use crate::description::find_texture::{FoundTexture, TextureSearch};
use crate::description::mtl::{FileMaterial, MapSlot, default_material};
use crate::description::texture::{TextureKind, TextureRequest, load_textures_within};
use crate::description::{FileError, Severity};
use crate::material::{Map, Material};
use crate::texture::{Channel, TextureId};
use std::path::Path;

impl Loader<'_> {
    /// The material of a file with maps that name requests for textures.
    pub(super) fn textured(&mut self, found: &FileMaterial, obj: &Path) -> Material {
        let mut material = found.material.clone();
        for request in &found.maps {
            let statement = &request.statement;
            let folder = request.place.file.parent().unwrap_or(Path::new(""));
            let (kind, slot) = match statement.slot {
                MapSlot::Diffuse => (TextureKind::Color, &mut material.maps.diffuse),
                MapSlot::Specular => (TextureKind::Color, &mut material.maps.specular),
                MapSlot::Emission => (TextureKind::Color, &mut material.maps.emission),
                MapSlot::Exponent => (TextureKind::Value(Channel::Luminance), &mut material.maps.exponent),
                MapSlot::Opacity => (TextureKind::Value(Channel::Opacity), &mut material.maps.opacity),
                MapSlot::Bump => (TextureKind::Value(Channel::Luminance), &mut material.maps.bump),
                MapSlot::Normal => (TextureKind::Normal, &mut material.maps.normal),
                MapSlot::Roughness => (TextureKind::Value(Channel::Luminance), &mut material.maps.roughness),
                MapSlot::Metallic => (TextureKind::Value(Channel::Luminance), &mut material.maps.metallic),
            };
            let kind = match (kind, statement.mapping.channel) {
                (TextureKind::Value(_), Some(channel)) => TextureKind::Value(channel),
                _ => kind,
            };
            let search = TextureSearch::new(&request.place.file, &self.texture_dirs, obj);
            let found = search
                .find(statement.names(), &mut self.finder)
                .map(|found| match found {
                    FoundTexture::AsNamed(path) => {
                        let is_exact = |name: &str| !case_differs(folder, name, &path) && !name.contains('\\');
                        if !statement.names().any(is_exact) {
                            let found = request.remark(&format!("is found as {}", path.display()));
                            let help = "write the name exactly as the file is called; other systems may not find it";
                            self.findings.add(Severity::Note, "other-case", found.help(help));
                        }
                        path
                    }
                    FoundTexture::Elsewhere(path) => {
                        let place = path.parent().unwrap_or(Path::new(""));
                        let place = (request.place.file.clone(), place.to_path_buf());
                        let found = self.found_elsewhere.entry(place).or_default();
                        if found.iter().all(|(known, _)| known.statement.file != statement.file) {
                            found.push((request.clone(), path.clone()));
                        }
                        path
                    }
                });
            match found {
                Some(path) => {
                    *slot = Some(Map {
                        texture: TextureId(self.textures.len() as u32),
                        mapping: statement.mapping,
                    });
                    let wrap = statement.mapping.wrap;
                    self.textures.push(TextureRequest { path, kind, wrap });
                    self.asked.push(request.clone());
                }
                None => {
                    let is_folder = folder.join(&statement.file).is_dir();
                    let (what, help) = match is_folder {
                        true => ("is a directory", "name a picture file".into()),
                        false => ("is missing", search.help()),
                    };
                    let missing = request.remark(&format!("{what}; the material's constant is used"));
                    self.lacks("missing-texture", missing.help(help));
                    if statement.slot == MapSlot::Diffuse && material.diffuse == Spectrum::ONE {
                        material.diffuse = default_material("").diffuse;
                    }
                }
            }
        }
        material
    }

    /// Tells of textures that lie elsewhere than named, once for each folder.
    fn tell_of_found_elsewhere(&mut self) {
        for found in std::mem::take(&mut self.found_elsewhere).into_values() {
            let Some((first, path)) = found.first() else { continue };
            let others = match found.len() - 1 {
                0 => String::new(),
                1 => ", and another one in that folder".into(),
                n => format!(", and {n} others in that folder"),
            };
            let error = first.remark(&format!("is missing there; {} is used{others}", path.display()));
            let error = error.help("write its path relative to the file that names it");
            let more = found.iter().skip(1).filter_map(|(request, _)| request.place.position);
            let finding = Finding::new(Severity::Note, "found-elsewhere", error);
            self.findings.push(finding.repeated(found.len() as u64, more));
        }
    }

    pub(super) fn load_textures(&mut self) {
        self.tell_of_found_elsewhere();
        self.files
            .extend(self.textures.iter().map(|texture| texture.path.clone()));
        let loaded = match load_textures_within(&self.textures, self.allowance, self.observer) {
            Ok(loaded) => loaded,
            Err(error) => {
                let mut asked = self.asked.iter().zip(&self.textures);
                let request = asked
                    .find(|(_, texture)| texture.path == error.file)
                    .map(|(request, _)| request);
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
        let mut ids = Vec::with_capacity(loaded.ids.len());
        for ((result, request), file) in loaded.ids.into_iter().zip(&self.asked).zip(&self.textures) {
            // Ids are given in the order of the first requests.
            if matches!(result, Ok(TextureId(id)) if id as usize == self.texture_files.len()) {
                self.texture_files.push(file.path.clone());
            }
            if let Err(error) = &result {
                let (place, message) = (error.place(), &error.message);
                // What the system did not give may be sound: it is not replaced.
                let severity = match error.is_unreadable() {
                    true => Severity::Error,
                    false => self.file.load.severity_of_lack(),
                };
                let instead = match severity {
                    Severity::Error => "",
                    _ => "; the material's constant is used",
                };
                let mut unread = request.remark(&format!("cannot be used{instead}: {place}: {message}"));
                unread.help.clone_from(&error.help);
                self.findings.add(severity, "unreadable-texture", unread);
            }
            ids.push(result.ok());
        }
        self.builder.set_textures(loaded.textures, &ids);
        self.builder.texture_filter(self.file.load.parameters.texture_filter());
    }
}
