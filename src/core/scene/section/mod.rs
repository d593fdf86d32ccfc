//! Sections: planes that cut the scene when it is loaded. Backends and integrators get the cut
//! scene, as if it had been modelled with the cut.
//!
//! Triangles are clipped (`clip`). The edges along which the plane cuts the surfaces of an object
//! form outlines (`outline`), which are filled with caps (`fill`). Instances that a plane crosses
//! become meshes that are not part of a prototype. Other instances do not change.
//!
//! Optionally, light interacts with the whole scene ([`CutLight::Whole`]): the removed parts are
//! then hidden from the camera, and only camera rays hit the caps (`integrator/opacity.rs`).

mod clip;
mod fill;
mod outline;
mod plane;
#[cfg(test)]
mod tests;

pub use plane::SectionPlane;

use super::builder::{PrototypeId, SceneBuilder, bounds_of, used_positions};
use super::recognise::Panes;
use super::validate::{BuildError, remove_degenerate};
use crate::geometry::{Mesh, PartNames, Placement, UNNAMED};
use crate::material::{Material, MaterialId};
use crate::math::{Bounds3, DVec2, Vec2, Vec3, excerpt_of_name};
use clip::{CutEdge, clip};
use fill::fill;
use outline::outlines;
use std::collections::HashMap;

/// Part of the scene with which light interacts if sections cut the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CutLight {
    /// Light interacts with the remaining scene.
    #[default]
    Cut,
    /// Light interacts with the whole scene: sections affect only camera rays.
    Whole,
}

impl CutLight {
    /// Names of the values on the command line and in scene files.
    pub const NAMES: &[(&str, Self)] = &[("cut", Self::Cut), ("whole", Self::Whole)];
}

/// Report of a cut by a section plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SectionReport {
    /// Open surfaces that the plane cuts. They get no cap.
    pub open: Vec<OpenShell>,
    /// Number of closed surfaces that face inwards and are not hollows of a solid, such as rooms
    /// whose walls have no thickness. The plane cuts these surfaces, but they get no cap.
    pub inward: u64,
    /// True if the plane removes the whole scene.
    pub removes_all: bool,
    /// True if the plane removes nothing.
    pub keeps_all: bool,
}

/// An open surface that the plane cuts, which gets no cap.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenShell {
    /// Name of the surface's part, or of its object if the part has no name.
    pub name: String,
    /// A point at which the plane cuts the surface, world space.
    pub place: Vec3,
}

/// Location of a mesh relative to the plane.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PlaneSide {
    Kept,
    Removed,
    Crossed,
}

impl SectionPlane {
    /// Location of `points` relative to the plane. For moving meshes, `points` has the positions at
    /// shutter open and at shutter close.
    fn place(&self, mut points: impl Iterator<Item = Vec3>) -> PlaneSide {
        let Some(first) = points.next() else {
            return PlaneSide::Removed;
        };
        let is_kept = |p: Vec3| self.distance(p) < 0.0;
        let side = is_kept(first);
        if points.any(|p| is_kept(p) != side) {
            PlaneSide::Crossed
        } else if side {
            PlaneSide::Kept
        } else {
            PlaneSide::Removed
        }
    }

    fn place_of_box(&self, bounds: Bounds3) -> PlaneSide {
        if bounds.is_empty() {
            return PlaneSide::Removed;
        }
        self.place(bounds.corners().into_iter())
    }
}

/// Meshes after a section that are not part of a prototype, and the object index of each mesh.
#[derive(Default)]
struct RemainingMeshes {
    meshes: Vec<(Mesh, MaterialId)>,
    objects: Vec<u32>,
}

impl RemainingMeshes {
    fn push(&mut self, mesh: Mesh, material: MaterialId, object: u32) {
        if !mesh.triangles.is_empty() {
            self.meshes.push((mesh, material));
            self.objects.push(object);
        }
    }
}

/// Edges along which a plane cuts one object or one instance.
struct CutObject {
    object: u32,
    edges: Vec<CutEdge>,
}

/// Treatment of all meshes of a material by a section.
#[derive(Clone, Copy)]
struct Treatment {
    /// True if light still hits the removed parts.
    keeps_removed: bool,
    /// True if the section does not cut meshes of this material.
    is_exempt: bool,
    /// True if the cuts are closed by caps.
    has_caps: bool,
}

impl SceneBuilder {
    /// Cuts all parts that were added before. If `cap` is given, cuts of closed surfaces are closed
    /// with caps of this material. With [`CutLight::Whole`], the removed parts are hidden from the
    /// camera, and caps are black and visible only to the camera.
    ///
    /// # Errors
    ///
    /// The plane crosses a moving object.
    pub fn cut(
        &mut self,
        plane: &SectionPlane,
        cap: Option<MaterialId>,
        light: CutLight,
    ) -> Result<SectionReport, BuildError> {
        // Replace panes of glass before the cut, because half a pane would not be recognised as a
        // pane
        if self.panes == Panes::Straight {
            self.flatten_panes(self.bounds());
        }
        let mut report = SectionReport {
            removes_all: true,
            keeps_all: true,
            ..SectionReport::default()
        };
        let mut remaining = RemainingMeshes::default();
        let mut cut: Vec<CutObject> = Vec::new();
        let meshes = std::mem::take(&mut self.meshes).into_iter();
        let objects = std::mem::take(&mut self.mesh_objects);
        for ((mesh, material), object) in meshes.zip(objects) {
            let treatment = self.treatment(material, light);
            let place = plane.place(used_positions(&mesh));
            if treatment.is_exempt {
                remaining.push(mesh, material, object);
                continue;
            }
            report.note(place);
            match place {
                PlaneSide::Kept => remaining.push(mesh, material, object),
                PlaneSide::Removed if treatment.keeps_removed => {
                    remaining.push(mesh, self.hidden_material(material), object);
                }
                PlaneSide::Removed => {}
                PlaneSide::Crossed if mesh.deforms() => return Err(self.moves_across(object)),
                PlaneSide::Crossed => {
                    if cut.last().is_none_or(|last| last.object != object) {
                        cut.push(CutObject {
                            object,
                            edges: Vec::new(),
                        });
                    }
                    let edges = cut.last_mut().map(|last| &mut last.edges);
                    self.add_halves((&mesh, material, object), plane, treatment, edges, &mut remaining);
                }
            }
        }
        let bounds: Vec<Bounds3> = self.prototypes.iter().map(|meshes| bounds_of(meshes)).collect();
        let instances = std::mem::take(&mut self.instances).into_iter();
        let objects = std::mem::take(&mut self.instance_objects);
        let mut hidden: HashMap<u32, PrototypeId> = HashMap::new();
        for ((prototype, placement), object) in instances.zip(objects) {
            let place = plane.place_of_box(placement.bounds(bounds[prototype.0 as usize]));
            let meshes = &self.prototypes[prototype.0 as usize];
            let mut materials = meshes.iter().map(|(_, material)| *material);
            if materials.all(|material| self.treatment(material, light).is_exempt) {
                self.instances.push((prototype, placement));
                self.instance_objects.push(object);
                continue;
            }
            report.note(place);
            match (place, &placement) {
                (PlaneSide::Kept, _) => {
                    self.instances.push((prototype, placement));
                    self.instance_objects.push(object);
                }
                (PlaneSide::Removed, _) if light == CutLight::Whole => {
                    let hidden = *hidden
                        .entry(prototype.0)
                        .or_insert_with(|| self.hidden_prototype(prototype));
                    self.instances.push((hidden, placement));
                    self.instance_objects.push(object);
                }
                (PlaneSide::Removed, _) => {}
                (PlaneSide::Crossed, Placement::Moving(_)) => return Err(self.moves_across(object)),
                (PlaneSide::Crossed, Placement::Still(transform)) => {
                    let mut edges = Vec::new();
                    for (mesh, material) in self.prototypes[prototype.0 as usize].clone() {
                        if mesh.deforms() {
                            return Err(self.moves_across(object));
                        }
                        let mesh = mesh.transformed(*transform);
                        let treatment = self.treatment(material, light);
                        if treatment.is_exempt {
                            remaining.push(mesh, material, object);
                        } else {
                            let edges = Some(&mut edges);
                            self.add_halves((&mesh, material, object), plane, treatment, edges, &mut remaining);
                        }
                    }
                    cut.push(CutObject { object, edges });
                }
            }
        }
        if let Some(cap) = cap {
            let cap = match light {
                CutLight::Cut => cap,
                CutLight::Whole => self.black_cap(cap),
            };
            for CutObject { object, edges } in cut {
                let outlines = outlines(&edges, plane);
                let name = self.objects.get(object as usize).map_or("", String::as_str);
                report.add_open(name, &self.parts, &outlines.open);
                report.inward += outlines.inward;
                remaining.push(cap_mesh(&fill(&outlines.closed), plane), cap, object);
            }
        }
        (self.meshes, self.mesh_objects) = (remaining.meshes, remaining.objects);
        Ok(report)
    }

    fn treatment(&self, material: MaterialId, light: CutLight) -> Treatment {
        let material = &self.materials[material.0 as usize];
        let is_whole = light == CutLight::Whole;
        Treatment {
            keeps_removed: is_whole && material.light_visible,
            is_exempt: is_whole && !material.camera_visible,
            // Thin glass has no thickness, so its cuts have no caps. Caps of earlier sections are
            // surfaces of the solid, so their cut edges are part of the outline.
            has_caps: material.camera_visible && !material.thin,
        }
    }

    /// Cuts a mesh that the plane crosses. Adds its halves to the scene, and its cut edges to
    /// `edges`.
    fn add_halves(
        &mut self,
        (mesh, material, object): (&Mesh, MaterialId, u32),
        plane: &SectionPlane,
        treatment: Treatment,
        edges: Option<&mut Vec<CutEdge>>,
        remaining: &mut RemainingMeshes,
    ) {
        let mut halves = clip(mesh, plane);
        for half in [&mut halves.kept, &mut halves.removed] {
            remove_degenerate(half);
        }
        remaining.push(halves.kept, material, object);
        if treatment.keeps_removed {
            remaining.push(halves.removed, self.hidden_material(material), object);
        }
        if let Some(edges) = edges.filter(|_| treatment.has_caps) {
            edges.append(&mut halves.edges);
        }
    }

    /// Adds a copy of the prototype with materials that are hidden from the camera. Returns the
    /// copy.
    fn hidden_prototype(&mut self, prototype: PrototypeId) -> PrototypeId {
        let mut meshes = self.prototypes[prototype.0 as usize].clone();
        for (_, material) in &mut meshes {
            *material = self.hidden_material(*material);
        }
        self.prototypes.push(meshes);
        PrototypeId(self.prototypes.len() as u32 - 1)
    }

    /// Black material for caps that only camera rays hit. Light interacts with the whole solid, so
    /// no light reaches the cap inside the solid.
    fn black_cap(&mut self, cap: MaterialId) -> MaterialId {
        let name = self.materials[cap.0 as usize].name.clone();
        let is_cap = |material: &Material| !material.light_visible && material.name == name;
        if let Some(index) = self.materials.iter().position(is_cap) {
            return MaterialId(index as u32);
        }
        self.materials.push(Material {
            name,
            light_visible: false,
            ..Material::default()
        });
        MaterialId(self.materials.len() as u32 - 1)
    }

    fn moves_across(&self, object: u32) -> BuildError {
        let name = self.objects.get(object as usize).map_or("", String::as_str);
        BuildError::MovesAcrossSection {
            object: excerpt_of_name(name).into_owned(),
        }
    }
}

impl SectionReport {
    fn note(&mut self, place: PlaneSide) {
        self.keeps_all &= place == PlaneSide::Kept;
        self.removes_all &= place == PlaneSide::Removed;
    }

    /// Reports the open surfaces of `object` that the plane cuts, one entry per part.
    fn add_open(&mut self, object: &str, names: &PartNames, edges: &[CutEdge]) {
        let mut parts: Vec<u32> = Vec::new();
        for edge in edges {
            if parts.contains(&edge.part) {
                continue;
            }
            parts.push(edge.part);
            let name = if edge.part == UNNAMED {
                object.to_string()
            } else {
                names.name(edge.part).into_owned()
            };
            self.open.push(OpenShell { name, place: edge.from });
        }
    }
}

/// Mesh of triangles in the plane. Texture coordinates are the coordinates in the plane, in scene
/// units.
fn cap_mesh(triangles: &[[DVec2; 3]], plane: &SectionPlane) -> Mesh {
    let mut mesh = Mesh::default();
    for corners in triangles {
        let first = mesh.positions.len() as u32;
        for &corner in corners {
            mesh.positions.push(plane.point(corner));
            mesh.uvs.push(Vec2::new(corner.x as f32, corner.y as f32));
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    remove_degenerate(&mut mesh);
    mesh
}
