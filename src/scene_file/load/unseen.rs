//! Warnings about invisible surfaces. They explain why a picture is empty.

use crate::color::Spectrum;
use crate::lint::MaterialSource;
use crate::material::Material;
use crate::math::excerpt_of_name;
use crate::scene::{Scene, SceneReport};
use crate::scene_file::{FileError, Findings, Position, SceneFile, Severity};
use crate::texture::Texture;
use std::collections::BTreeSet;

/// Warns if all triangles were skipped, or if all materials are invisible. Otherwise warns of each
/// material that its library makes invisible.
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
    let reason = |id: usize| Some((id, reason_unseen(&scene.materials()[id], scene.textures())?));
    let reasons: Vec<(usize, Reason)> = used.into_iter().filter_map(reason).collect();
    if reasons.len() < count {
        for (id, reason) in reasons {
            let source = materials.get(id);
            // Do not warn if the user has made the material invisible
            if source.is_some_and(|source| source.found.opacity_line.is_some()) {
                let name = excerpt_of_name(&scene.materials()[id].name);
                let message = format!("material `{name}` is invisible, {}", reason.words);
                let error = placed(file, source, message).help(reason.help);
                findings.add(Severity::Warning, "invisible-material", error);
            }
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
            placed(file, materials.get(*id), message).help(reason.help)
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
        let line = source.found.opacity_line?;
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
    help: &'static str,
}

/// Reason why a surface of this material is invisible; `None` if it is visible.
fn reason_unseen(material: &Material, textures: &[Texture]) -> Option<Reason> {
    let maps = &material.maps;
    if material.opacity == 0.0 {
        return Some(Reason {
            words: "since its opacity is 0",
            help: "write `d 1` in its library, or set its `opacity` with --material",
        });
    }
    let is_zero = |texture: &Texture| texture.max_value() == 0.0;
    let map = maps.opacity.filter(|map| map.mapping.base <= 0.0);
    if map
        .and_then(|map| textures.get(map.texture.0 as usize))
        .is_some_and(is_zero)
    {
        return Some(Reason {
            words: "since the texture of its opacity is 0 everywhere",
            help: "correct the picture, or delete `map_d` in its library",
        });
    }
    let emits = !material.emission_factor().is_black();
    let is_dark = !emits && material.diffuse.is_black() && material.specular.is_black() && material.sheen.is_black();
    let is_clear = material.thin && material.ior == 1.0 && material.transmission == Spectrum::ONE;
    (is_dark && is_clear && material.clearcoat == 0.0).then_some(Reason {
        words: "since all light passes straight through it",
        help: "write `Tf 0 0 0` and a `Kd` in its library, or set its `transmission` with --material",
    })
}
