//! Reports about textures: missing textures and tiles, textures that were found elsewhere or
//! replaced, and textures of another kind than their statements.

use super::Loader;
use super::materials::names_in_words;
use crate::geometry::{Mesh, PrimId};
use crate::io::Tiles;
use crate::math::Vec2;
use crate::scene_file::mtl::{MapRequest, MapSlot};
use crate::scene_file::texture::TextureKind;
use crate::scene_file::{Finding, Severity};
use std::collections::BTreeSet;
use std::path::Path;

/// Use of a missing texture by a material.
pub(super) struct MissingUse {
    pub request: MapRequest,
    /// Name of the material that uses the texture.
    pub material: String,
    /// State of the file for messages, such as "is missing".
    pub what: &'static str,
    pub help: String,
}

impl Loader<'_> {
    /// Reports pictures that replace missing textures.
    pub(super) fn report_stand_ins(&mut self) {
        for ((_, picture), uses) in std::mem::take(&mut self.stand_ins) {
            let Some(first) = uses.first() else { continue };
            let words = format!(
                "is missing; {} has the name of the OBJ file, and is used",
                picture.display()
            );
            let error = first
                .remark(&words)
                .help("--maps-by-name off does not use this picture");
            let more = uses.iter().skip(1).filter_map(|request| request.place.position);
            let finding = Finding::new(Severity::Note, "maps-by-name", error);
            self.findings.push(finding.repeated(uses.len() as u64, more));
        }
    }

    /// Reports a texture of several tiles, and its missing tiles that triangles of `mesh` need.
    pub(super) fn report_tiles(&mut self, request: &MapRequest, tiles: &Tiles, mesh: &Mesh) {
        let mapping = request.statement.mapping;
        let number = |corners: [Vec2; 3]| {
            let st = mapping.st((corners[0] + corners[1] + corners[2]) / 3.0);
            Tiles::number_at(st.x, st.y)
        };
        let prims = (0..mesh.triangles.len() as u32).map(PrimId);
        let needed: BTreeSet<u32> = prims
            .filter_map(|prim| mesh.corner_uvs(prim))
            .filter_map(number)
            .collect();
        let missing: Vec<String> = needed
            .into_iter()
            .filter(|number| !tiles.has(*number))
            .map(|number| number.to_string())
            .collect();
        let count = tiles.files().count();
        let found = request.remark(&format!("is a texture of {count} tiles (UDIM)"));
        self.findings.add(Severity::Note, "udim-tiles", found);
        if let [first, others @ ..] = missing.as_slice() {
            let words = match others {
                [] => format!("has no tile {first}, where the material's constant is used"),
                _ => format!(
                    "has no tiles {}, where the material's constant is used",
                    missing.join(", ")
                ),
            };
            let help = "put the tiles beside the others, or move the texture coordinates";
            let severity = self.file.load.severity_of_lack();
            self.findings
                .add(severity, "missing-tile", request.remark(&words).help(help));
        }
    }

    /// Reports missing textures, each once with all its uses.
    pub(super) fn report_missing(&mut self) {
        let mut missing: Vec<Vec<MissingUse>> = std::mem::take(&mut self.missing).into_values().collect();
        for uses in &mut missing {
            uses.sort_by_key(|use_| use_.request.place.position.map(|position| position.line));
        }
        missing.sort_by_key(|uses| {
            uses.first().map(|first| {
                (
                    first.request.place.file.clone(),
                    first.request.place.position.map(|p| p.line),
                )
            })
        });
        let severity = self.file.load.severity_of_lack();
        for uses in missing {
            let Some(first) = uses.first() else { continue };
            let words = format!("{}; {}", first.what, words_of_lack(&uses));
            let error = first.request.remark(&words).help(first.help.clone());
            let more = uses.iter().skip(1).filter_map(|use_| use_.request.place.position);
            let finding = Finding::new(severity, "missing-texture", error);
            self.findings.push(finding.repeated(uses.len() as u64, more));
        }
    }

    /// Reports textures found at another path, once for each folder.
    pub(super) fn report_found_elsewhere(&mut self) {
        for found in std::mem::take(&mut self.found_elsewhere).into_values() {
            let Some((first, path)) = found.first() else { continue };
            let others = others(found.len() - 1, "in that folder");
            let here = if path.parent() == Some(Path::new("")) { "./" } else { "" };
            let words = format!("is not where this file says; {here}{} is used{others}", path.display());
            let error = first.remark(&words);
            let error = error.help("write the path of the texture relative to this file");
            let more = found.iter().skip(1).filter_map(|(request, _)| request.place.position);
            let finding = Finding::new(Severity::Note, "found-elsewhere", error);
            self.findings.push(finding.repeated(found.len() as u64, more));
        }
    }
}

/// Text that describes how surfaces appear without their textures, with the materials for each
/// appearance.
fn words_of_lack(uses: &[MissingUse]) -> String {
    let mut appearances: Vec<(&str, Vec<&str>)> = Vec::new();
    for MissingUse { request, material, .. } in uses {
        let appearance = appearance_without(request.statement.slot);
        match appearances.iter_mut().find(|(known, _)| *known == appearance) {
            Some((_, users)) if users.contains(&material.as_str()) => {}
            Some((_, users)) => users.push(material),
            None => appearances.push((appearance, vec![material])),
        }
    }
    let appearances = appearances.into_iter().map(|(appearance, users)| {
        let verb = if users.len() == 1 { "is" } else { "are" };
        format!("{} {verb} rendered {appearance}", names_in_words(users.into_iter()))
    });
    appearances.collect::<Vec<_>>().join("; ")
}

/// Appearance of a surface without the texture of `slot`.
fn appearance_without(slot: MapSlot) -> &'static str {
    match slot {
        MapSlot::Diffuse => "in one plain colour",
        MapSlot::Specular | MapSlot::Exponent | MapSlot::Roughness | MapSlot::Metallic => "with an even gloss",
        MapSlot::Emission => "with an even glow",
        MapSlot::Opacity => "without holes",
        MapSlot::Bump | MapSlot::Normal => "flat, without bumps",
        MapSlot::Displacement => "without displacement",
    }
}

/// Text about a picture that is of another kind than its statement; `None` if the kind is as
/// written.
pub(super) fn words_of_decision(kind: TextureKind, is_moved: bool, has_effect: bool) -> Option<&'static str> {
    Some(match (kind, is_moved, has_effect) {
        (TextureKind::Normal, true, true) => "is a normal map where heights are expected, and is used as a normal map",
        (TextureKind::EncodedNormal, true, true) => {
            "is a normal map where heights are expected, and sRGB-encoded: it is decoded, and used as a normal map"
        }
        (TextureKind::EncodedNormal, false, _) => "is a normal map that is sRGB-encoded: it is decoded",
        (TextureKind::Normal | TextureKind::EncodedNormal, true, false) => {
            "is a normal map where heights are expected, and has no effect beside `norm`"
        }
        (_, true, true) => "is grey where a normal map is expected, and is used as heights",
        (_, true, false) => "is grey where a normal map is expected, and has no effect beside `map_Bump`",
        (_, false, _) => return None,
    })
}

/// Text for `count` further textures that are in `place`.
pub(super) fn others(count: usize, place: &str) -> String {
    match count {
        0 => String::new(),
        1 => format!(", and another one {place}"),
        n => format!(", and {n} others {place}"),
    }
}
