//! Checks of a scene: materials (`definitions`), faces (`faces`), connected components that emit or
//! refract (`components`), lamps that face the wrong way (`backward_lamps`), the view of the camera
//! (`view`), and the scattering of a material (`preview`, `profile`).
//!
//! Readers of files also report findings, which are not repeated here. `lint` reads OBJ files once
//! more as `ObjFaces`: the polygons before triangulation, each with its line number. A render does
//! not store this. Faces are compared and joined by position and not by index, because exporters
//! split vertices. All faults of one kind in a file are one finding, with the lines of the first
//! faults.

mod backward_lamps;
mod components;
mod darkness;
mod definitions;
mod faces;
mod inspection;
mod preview;
mod profile;
mod tally;
mod view;

pub use backward_lamps::inspect_lamps;
pub use darkness::{dark_lamps, reason_for_darkness, reason_for_emptiness};
pub use inspection::{DEFAULT_MATERIAL, Inspection, MaterialSource, ObjSource};
pub use preview::{LobeAlbedo, PREVIEW_CAMERA, albedos, directional_albedo, preview_scene};
pub use profile::{DeltaDirection, LobeProfile, Profile, direction_at};
pub use view::{inspect_extent, inspect_place, inspect_view};

use crate::io::{FileError, Finding, ObjFaces};
use crate::material::Material;
use crate::math::Vec3;
use crate::scene::Scene;
use faces::FaceLint;
use std::collections::HashMap;
use std::path::Path;

/// Function that makes an error from a message about the scene as a whole.
pub type SceneErrorMaker<'a> = &'a dyn Fn(String) -> FileError;

/// Finds likely mistakes in the materials and meshes of a scene. OBJ files are read once more, one
/// at a time, for the lines of their faces. `eye` is the position of the camera, if the scene file
/// has one.
pub fn inspect(inspection: &Inspection, eye: Option<Vec3>, whole: SceneErrorMaker) -> Vec<Finding> {
    let mut findings = definitions::inspect(inspection);
    findings.extend(inspection.scene.iter().flat_map(|scene| inspect_extent(scene, whole)));
    // A component around the camera may face inwards, such as the walls of a room that emit.
    let contains = |scene: &Scene, p: Vec3| scene.bounds().min.cmple(p).all() && scene.bounds().max.cmpge(p).all();
    let is_inside = eye
        .zip(inspection.scene.as_ref())
        .is_some_and(|(eye, scene)| contains(scene, eye));
    for obj in &inspection.objs {
        // The reader has already reported files that cannot be read.
        let defined = obj.materials.iter().map(|(name, ..)| name.as_str()).collect();
        let Ok(faces) = ObjFaces::read(&obj.path, &inspection.parts, &defined) else {
            continue;
        };
        let uses = uses(inspection, &obj.path, &faces);
        let lint = FaceLint::new(&obj.path, &faces, &uses);
        findings.extend(lint.findings());
        let is_around = is_inside && inspection.objs.len() == 1;
        findings.extend(components::inspect(&obj.path, &faces, &uses, lint.points(), is_around));
    }
    findings
}

/// Properties of a material that matter for the checks of its faces.
#[derive(Clone, Debug, Default)]
struct Use {
    name: String,
    emits: bool,
    is_opaque: bool,
    /// True if light enters the surface.
    transmits: bool,
    /// True if light enters the body that the faces enclose.
    refracts: bool,
    has_maps: bool,
}

impl Use {
    /// Returns true if one duplicate face with opposite winding is right. If the material emits,
    /// loading moves both faces apart, and both sides emit. This excludes lamps that transmit light
    /// and are not opaque.
    fn is_same_from_behind(&self) -> bool {
        !self.refracts && (!self.emits || self.is_opaque || !self.transmits)
    }
}

/// Properties of the materials of an OBJ file, in the order of `faces.materials()`.
fn uses(inspection: &Inspection, path: &Path, faces: &ObjFaces) -> Vec<Use> {
    let materials = inspection.scene.as_ref().map_or(&[][..], |scene| scene.materials());
    let is_here = |source: &MaterialSource| source.obj.as_deref().is_none_or(|obj| obj == path);
    let sources = inspection.materials.iter().zip(materials).filter(|(s, _)| is_here(s));
    let by_name: HashMap<&str, &Material> = sources.map(|(s, m)| (s.name.as_str(), m)).collect();
    let names = faces
        .materials()
        .iter()
        .map(|m| m.name.as_deref().unwrap_or(DEFAULT_MATERIAL));
    names
        .map(|name| by_name.get(name).map_or_else(Use::default, |m| Use::of(m)))
        .collect()
}

impl Use {
    fn of(material: &Material) -> Self {
        let maps = &material.maps;
        Self {
            name: material.name.clone(),
            emits: !material.emission_factor().is_black(),
            is_opaque: material.opacity == 1.0 && maps.opacity.is_none() && !maps.vertex_alpha,
            transmits: !material.transmission.is_black(),
            refracts: !material.transmission.is_black() && !material.thin,
            has_maps: maps.by_key().iter().any(|(_, map)| map.is_some()),
        }
    }
}
