//! Warnings about invisible surfaces. They explain why a picture is empty.

use super::materials::names_in_words;
use crate::color::Spectrum;
use crate::lint::MaterialSource;
use crate::material::Material;
use crate::math::excerpt_of_name;
use crate::scene::{Scene, SceneReport};
use crate::scene_file::{FileError, Finding, Findings, Position, SceneFile, Severity};
use crate::texture::Texture;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Warns if all triangles were skipped, or if all materials are invisible. Otherwise warns of
/// materials that their library makes invisible, once for each library and reason.
pub(super) fn report_unseen(
    file: &SceneFile,
    scene: &Scene,
    report: &SceneReport,
    materials: &[MaterialSource],
    findings: &mut Findings,
) {
    let shapes = scene.geom_ids().map(|geom| scene.shape(geom));
    let used = shapes.map(|shape| shape.material.0 as usize);
    // Leave out the material of the ground, which is not in `materials`
    let used: BTreeSet<usize> = used.filter(|&id| id < materials.len()).collect();
    let count = used.len();
    let reason = |id: usize| {
        let other = materials.get(id).and_then(|source| source.found.opacity?.other);
        Some((id, reason_unseen(&scene.materials()[id], scene.textures(), other)?))
    };
    let reasons: Vec<(usize, Reason)> = used.into_iter().filter_map(reason).collect();
    if reasons.len() < count {
        let mut alike: BTreeMap<(&Path, &str, &str), Vec<usize>> = BTreeMap::new();
        for (id, reason) in &reasons {
            // Do not warn if the user has made the material invisible
            if let Some(source) = materials.get(*id).filter(|source| source.found.opacity.is_some()) {
                let kind = (&*source.found.library, reason.words, &*reason.help);
                alike.entry(kind).or_default().push(*id);
            }
        }
        for ((_, words, help), ids) in alike {
            let Some(first) = ids.first() else { continue };
            let names = names_in_words(ids.iter().map(|id| &*scene.materials()[*id].name));
            let message = match ids.len() {
                1 => format!("material {names} is invisible, {words}"),
                n => {
                    let words = words.replace(" its ", " their ");
                    format!("{n} materials are invisible, {words}: {names}")
                }
            };
            let help = match ids.len() {
                1 => help.to_string(),
                _ => help.replace("its `", "their `"),
            };
            let error = placed(file, materials.get(*first), message).help(help);
            let lines = ids
                .iter()
                .filter_map(|id| Some(materials.get(*id)?.found.opacity?.line));
            let finding = Finding::new(Severity::Warning, "invisible-material", error);
            findings.push(finding.repeated(ids.len() as u64, lines.skip(1).map(Position::line)));
        }
        return;
    }
    let error = match reasons.first() {
        Some((id, reason)) => {
            let others = match reasons.len() - 1 {
                0 => String::new(),
                1 => ", and so is another material".into(),
                n => format!(", and so are {n} other materials"),
            };
            let name = excerpt_of_name(&scene.materials()[*id].name);
            let message = format!(
                "no face can be seen: material `{name}` is invisible, {}{others}",
                reason.words
            );
            placed(file, materials.get(*id), message).help(&*reason.help)
        }
        None if report.degenerate_triangles > 0 => {
            let message = match report.degenerate_triangles {
                1 => "no face can be seen: the only triangle has no area".into(),
                n => format!("no face can be seen: none of the {n} triangles has an area"),
            };
            let help = "export the mesh again: the corners of each face lie on a line";
            file.whole(message).help(help)
        }
        None => return,
    };
    findings.add(Severity::Warning, "no-visible-face", error);
}

/// Error at the opacity statement of the material; at the material if there is no such statement.
fn placed(file: &SceneFile, source: Option<&MaterialSource>, message: String) -> FileError {
    let opacity = source.and_then(|source| {
        let line = source.found.opacity?.line;
        Some((&source.found.library, Position::line(line)))
    });
    let material = source.and_then(|source| source.place.as_ref().map(|(file, place)| (file, *place)));
    match opacity.or(material) {
        Some((file, place)) => FileError::new(file, message).at(place),
        None => file.whole(message),
    }
}

/// Reason why a surface is invisible, with help.
struct Reason {
    words: &'static str,
    help: Cow<'static, str>,
}

/// Reason why a surface of this material is invisible; `None` if it is visible. `other` is advice
/// on another reading of the statement that sets the opacity.
fn reason_unseen(material: &Material, textures: &[Texture], other: Option<&str>) -> Option<Reason> {
    let maps = &material.maps;
    if material.opacity == 0.0 {
        let (words, help) = if maps.opacity.is_some() {
            let help = "write `d 1` in its library, so that `map_d` alone gives the opacity";
            (
                "since its opacity is 0, which multiplies the texture of its opacity",
                help,
            )
        } else {
            let help = "write `d 1` in its library, or set its `opacity` with --material";
            ("since its opacity is 0", help)
        };
        let help = match other {
            Some(other) => format!("{help}; {other}").into(),
            None => help.into(),
        };
        return Some(Reason { words, help });
    }
    let is_zero = |texture: &Texture| texture.max_value() == 0.0;
    let map = maps.opacity.filter(|map| map.mapping.base <= 0.0);
    if map
        .and_then(|map| textures.get(map.texture.0 as usize))
        .is_some_and(is_zero)
    {
        return Some(Reason {
            words: "since the texture of its opacity is 0 everywhere",
            help: "correct the picture, or delete `map_d` in its library".into(),
        });
    }
    let emits = !material.emission_factor().is_black();
    let is_dark = !emits && material.diffuse.is_black() && material.specular.is_black() && material.sheen.is_black();
    let is_clear = material.thin && material.ior == 1.0 && material.transmission == Spectrum::ONE;
    (is_dark && is_clear && material.clearcoat == 0.0).then_some(Reason {
        words: "since all light passes straight through it",
        help: "write `Tf 0 0 0` and a `Kd` in its library, or set its `transmission` with --material".into(),
    })
}
