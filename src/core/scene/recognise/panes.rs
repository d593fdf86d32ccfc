//! Panes: flat slabs of clear glass, which become thin dielectrics when the scene is frozen.
//!
//! Files model a window pane as a slab: two parallel faces and a narrow rim. Light is refracted at
//! both faces and leaves the slab in its original direction, but a straight shadow ray cannot
//! follow this path. The slab is replaced by a thin dielectric in its middle, with the same index
//! of refraction. The thin dielectric has the transmittance of both faces, including all
//! reflections between the faces. Light passes through it without a change of direction
//! (`material/thin_surface.rs`). The sideways shift of light in the slab is neglected: `d sin θ (1
//! − cos θ / √(n² − sin² θ))` for a thickness d. The rim is left out.
//!
//! Only slabs that fulfil all of these conditions are replaced, so that bottles, lenses, bowls and
//! thick tables do not change:
//!
//! - The material only refracts: smooth, without textures, alpha, emission or other lobes.
//! - The connected component is closed and its faces point outwards. Almost all of its area lies in
//!   two parallel planes, half of it in each plane, and all points lie between the planes. Vertices
//!   at the same position count as one vertex.
//! - Vertex normals, if any, are the normals of the planes.
//! - The thickness is at most 1/20 of the width, and at most 1/100 of the scene's radius.
//!
//! Two separate faces with the same outline that point away from each other are also a pane: a slab
//! without its rim. A single face of refracting glass is not a pane, because it may be the surface
//! of water.

use super::components::{components, welded};
use crate::bsdf::{Bsdf, Lobe};
use crate::geometry::{Mesh, PrimId, retain_triangles};
use crate::material::{Material, MaterialId};
use crate::math::{Bounds3, DVec3};
use std::collections::HashMap;

/// Treatment of thin glass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Panes {
    /// Light passes through thin glass without a change of direction, also along shadow rays. Flat
    /// panes of solid glass are treated as thin glass.
    #[default]
    Straight,
    /// Light passes through thin glass only if a path scatters there. Panes of solid glass stay
    /// solid bodies.
    Refract,
}

impl Panes {
    /// Names of the variants on the command line and in scene files.
    pub const NAMES: &[(&str, Self)] = &[("straight", Self::Straight), ("refract", Self::Refract)];
}

/// Maximum ratio of a pane's thickness to its width.
const MAX_THICKNESS: f64 = 1.0 / 20.0;
/// Maximum ratio of a pane's thickness to the radius of the scene.
const MAX_SHARE_OF_SCENE: f64 = 1.0 / 100.0;
/// Maximum sine of the angle between a plane of the pane and the triangles in the plane.
const MAX_SINE: f64 = 0.01;
/// Cosine of the maximum angle, 5 degrees, between the normal of a plane and the vertex normals.
const MIN_NORMAL_COS: f64 = 0.996;
/// Maximum distance of a point from the plane of its face, as a fraction of the thickness.
const MAX_UNEVENNESS: f64 = 0.02;
/// Maximum area of a rim, projected along the normal of the pane, as a fraction of the area of the
/// pane.
const MAX_RIM: f64 = 0.05;
/// Maximum relative difference of the areas of two faces. Also the maximum difference of their
/// positions, as a fraction of their width.
const MAX_DIFFERENCE: f64 = 0.02;

/// A pane found in a mesh.
struct Pane {
    /// Triangles of one of the two faces.
    face: Vec<u32>,
    /// All other triangles of the pane.
    rest: Vec<u32>,
    /// Vector from the face in `face` to the middle of the slab.
    shift: DVec3,
}

/// A flat face of a connected component.
#[derive(Clone)]
struct Face {
    triangles: Vec<u32>,
    /// Unit normal, according to the winding.
    n: DVec3,
    area: f64,
    centroid: DVec3,
    /// Maximum distance of a point of the face from the centroid.
    radius: f64,
    /// Minimum and maximum coordinate of the points along `n`.
    offsets: [f64; 2],
}

/// Shape of a connected component.
enum Component {
    Slab(Pane),
    /// A flat face without an opposite face in the same component.
    Face(Face),
    Other,
}

/// Maximum thickness of a pane in a scene with these bounds.
pub(in crate::scene) fn max_thickness(bounds: Bounds3) -> f64 {
    MAX_SHARE_OF_SCENE * f64::from(bounds.radius())
}

/// Replaces panes by thin dielectrics, and stores their materials.
#[derive(Default)]
pub(in crate::scene) struct FlatPanes {
    /// For each material seen so far, true if it is clear glass.
    is_clear: HashMap<MaterialId, bool>,
    /// Material of the panes of each glass: a thin dielectric. The key is the material of the glass
    /// body.
    thin: HashMap<MaterialId, MaterialId>,
    /// Number of panes that were replaced.
    pub count: u64,
}

impl FlatPanes {
    /// Separates the panes from `mesh`. Returns the mesh without panes and a mesh of the flattened
    /// panes. A mesh without triangles is left out.
    pub fn split(
        &mut self,
        mut mesh: Mesh,
        material: MaterialId,
        max_thickness: f64,
        materials: &mut Vec<Material>,
    ) -> Vec<(Mesh, MaterialId)> {
        let is_clear = self
            .is_clear
            .entry(material)
            .or_insert_with(|| materials.get(material.0 as usize).is_some_and(is_clear_glass));
        let panes = if *is_clear && !mesh.deforms() {
            panes_of(&mesh, max_thickness)
        } else {
            Vec::new()
        };
        if panes.is_empty() {
            return vec![(mesh, material)];
        }
        self.count += panes.len() as u64;
        let thin = *self.thin.entry(material).or_insert_with(|| {
            materials.push(thin_pane_of(&materials[material.0 as usize]));
            MaterialId(materials.len() as u32 - 1)
        });
        let flat = faces_in_the_middle(&mesh, &panes);
        let mut is_left = vec![true; mesh.triangles.len()];
        for &triangle in panes.iter().flat_map(|pane| pane.face.iter().chain(&pane.rest)) {
            is_left[triangle as usize] = false;
        }
        let mut left = is_left.into_iter();
        retain_triangles(&mut mesh.triangles, &mut mesh.parts, |_| left.next().unwrap_or(true));
        let parts = [(mesh, material), (flat, thin)];
        parts
            .into_iter()
            .filter(|(mesh, _)| !mesh.triangles.is_empty())
            .collect()
    }
}

/// Returns true if `material` is clear glass: a smooth boundary that only reflects and refracts.
fn is_clear_glass(material: &Material) -> bool {
    let maps = &material.maps;
    let varies = maps.varies_bsdf() || maps.has_bumps() || maps.varies_opacity();
    let is_body = !material.absorption.is_black() || material.abbe.is_some();
    let is_there = !is_body && material.opacity == 1.0 && material.emission_factor().is_black();
    is_there && !varies && matches!(material.bsdf(), Bsdf::Single(Lobe::Dielectric(_)))
}

/// Thin dielectric for a pane of the material `body`, with the transmission of both faces.
fn thin_pane_of(body: &Material) -> Material {
    Material {
        name: format!("{} (pane)", body.name),
        transmission: body.transmission * body.transmission,
        thin: true,
        ..body.clone()
    }
}

/// Mesh with one face of each pane, moved to the middle of its slab.
fn faces_in_the_middle(mesh: &Mesh, panes: &[Pane]) -> Mesh {
    let mut flat = Mesh::default();
    let mut parts = Vec::new();
    for pane in panes {
        let mut moved: HashMap<u32, u32> = HashMap::new();
        for &triangle in &pane.face {
            let corners = mesh.triangles[triangle as usize].map(|vertex| {
                *moved.entry(vertex).or_insert_with(|| {
                    let p = mesh.positions[vertex as usize].as_dvec3() + pane.shift;
                    flat.positions.push(p.as_vec3a());
                    flat.positions.len() as u32 - 1
                })
            });
            flat.triangles.push(corners);
            parts.push(mesh.part(PrimId(triangle)));
        }
    }
    flat.set_parts(parts);
    flat
}

/// The panes of a mesh of clear glass. `max_thickness` is the maximum thickness of a pane.
fn panes_of(mesh: &Mesh, max_thickness: f64) -> Vec<Pane> {
    let (mut panes, mut faces) = (Vec::new(), Vec::new());
    let welded = welded(mesh);
    for triangles in components(mesh, welded.clone()) {
        match component(mesh, (&triangles, &welded), max_thickness) {
            Component::Slab(pane) => panes.push(pane),
            Component::Face(face) => faces.push(face),
            Component::Other => {}
        }
    }
    panes.extend(pairs(faces, max_thickness));
    panes
}

/// Shape of the connected component with the triangles `triangles`. `welded` maps each vertex to
/// the first vertex at the same position.
fn component(mesh: &Mesh, (triangles, welded): (&[u32], &[u32]), max_thickness: f64) -> Component {
    let areas: Vec<DVec3> = triangles.iter().map(|&t| area_vector(mesh, t)).collect();
    let largest = areas.iter().fold(DVec3::ZERO, |largest, &area| {
        if area.length_squared() > largest.length_squared() {
            area
        } else {
            largest
        }
    });
    let Some(n) = largest.try_normalize() else {
        return Component::Other;
    };
    let (mut front, mut back, mut rim) = (Vec::new(), Vec::new(), 0.0);
    for (&triangle, area) in triangles.iter().zip(&areas) {
        let along = area.dot(n);
        match area.cross(n).length() <= MAX_SINE * area.length() {
            true if along > 0.0 => front.push(triangle),
            true => back.push(triangle),
            false => rim += along.abs(),
        }
    }
    let front = Face::new(mesh, front, n);
    if front.triangles.len() == triangles.len() {
        let is_flat = front.offsets[1] - front.offsets[0] <= MAX_UNEVENNESS * max_thickness;
        return if is_flat && front.has_its_normals(mesh) {
            Component::Face(front)
        } else {
            Component::Other
        };
    }
    let back = Face::new(mesh, back, -n);
    let has_narrow_rim = rim <= MAX_RIM * front.area;
    let have_their_normals = front.has_its_normals(mesh) && back.has_its_normals(mesh);
    let Some(thickness) = thickness(&front, &back, max_thickness).filter(|_| has_narrow_rim && have_their_normals)
    else {
        return Component::Other;
    };
    // Maximum distance of a point outside of the two planes
    let slack = MAX_UNEVENNESS * thickness;
    let [low, high] = [-back.offsets[0] - slack, front.offsets[1] + slack];
    let is_between = corners(mesh, triangles).all(|p| (low..=high).contains(&p.dot(n)));
    if !is_between || !is_closed(mesh, triangles, welded) {
        return Component::Other;
    }
    let is_front = |triangle: &u32| front.triangles.binary_search(triangle).is_ok();
    Component::Slab(Pane {
        rest: triangles
            .iter()
            .copied()
            .filter(|triangle| !is_front(triangle))
            .collect(),
        shift: n * (-0.5 * thickness),
        face: front.triangles,
    })
}

/// Pairs of faces that are the two sides of a slab without a rim.
fn pairs(mut faces: Vec<Face>, max_thickness: f64) -> Vec<Pane> {
    // Sort the faces by the coordinate of their centroids along the axis with the largest spread,
    // so that few faces have similar coordinates. The centroids of both faces of a pane differ by
    // little more than the thickness on any axis.
    let spread: Bounds3 = faces.iter().map(|face| face.centroid.as_vec3a()).collect();
    let axis = (spread.max - spread.min).max_position();
    faces.sort_by(|a, b| a.centroid[axis].total_cmp(&b.centroid[axis]));
    let mut is_taken = vec![false; faces.len()];
    let mut panes = Vec::new();
    for i in 0..faces.len() {
        let reach = |face: &&Face| face.centroid[axis] - faces[i].centroid[axis] <= 2.0 * max_thickness;
        let count = faces[i + 1..].iter().take_while(reach).count();
        if is_taken[i] {
            continue;
        }
        let mut others = (i + 1..=i + count).filter(|&j| !is_taken[j]);
        let partner = others.find_map(|j| Some((j, thickness(&faces[i], &faces[j], max_thickness)?)));
        if let Some((j, thickness)) = partner {
            is_taken[j] = true;
            panes.push(Pane {
                shift: faces[i].n * (-0.5 * thickness),
                face: faces[i].triangles.clone(),
                rest: faces[j].triangles.clone(),
            });
        }
    }
    panes
}

/// Thickness of the slab between two faces that point away from each other; `None` if the faces are
/// not the two sides of a pane.
fn thickness(a: &Face, b: &Face, max_thickness: f64) -> Option<f64> {
    let apart = a.centroid - b.centroid;
    let thickness = apart.dot(a.n);
    let aside = apart - a.n * thickness;
    let unevenness = [a, b].map(|face| face.offsets[1] - face.offsets[0]);
    let differ = |x: f64, y: f64| (x - y).abs() > MAX_DIFFERENCE * x.max(y);
    let is_pane = a.n.dot(b.n) < 0.0
        && a.n.cross(b.n).length() <= MAX_SINE
        && thickness > 0.0
        && thickness <= max_thickness
        && thickness <= MAX_THICKNESS * a.width()
        && unevenness[0].max(unevenness[1]) <= MAX_UNEVENNESS * thickness
        && aside.length() <= MAX_DIFFERENCE * a.width()
        && !differ(a.area, b.area)
        && !differ(a.radius, b.radius);
    is_pane.then_some(thickness)
}

/// Area vector of a triangle: half the cross product of two edges, in the direction of the normal.
fn area_vector(mesh: &Mesh, triangle: u32) -> DVec3 {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.positions[i as usize].as_dvec3());
    0.5 * (b - a).cross(c - a)
}

/// Positions of the corners of `triangles`, one triangle after the other.
fn corners<'a>(mesh: &'a Mesh, triangles: &'a [u32]) -> impl Iterator<Item = DVec3> + 'a {
    let vertices = triangles.iter().flat_map(|&t| mesh.triangles[t as usize]);
    vertices.map(|i| mesh.positions[i as usize].as_dvec3())
}

/// Returns true if the triangles are closed: each edge belongs to two triangles that have it in
/// opposite directions.
fn is_closed(mesh: &Mesh, triangles: &[u32], welded: &[u32]) -> bool {
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for &triangle in triangles {
        let [a, b, c] = mesh.triangles[triangle as usize].map(|vertex| welded[vertex as usize]);
        edges.extend([(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), a > b)));
    }
    edges.sort_unstable();
    let mut edges = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    edges.all(|same| matches!(same, [a, b] if a.2 != b.2))
}

impl Face {
    /// The face that consists of `triangles`, whose normals are near `n`.
    fn new(mesh: &Mesh, triangles: Vec<u32>, n: DVec3) -> Self {
        let (mut area, mut centroid) = (0.0, DVec3::ZERO);
        for (&triangle, of) in triangles.iter().zip(triangles.chunks(1)) {
            let part = area_vector(mesh, triangle).length();
            area += part;
            centroid += part * (corners(mesh, of).sum::<DVec3>() / 3.0);
        }
        centroid /= area.max(f64::MIN_POSITIVE);
        let (mut radius, mut offsets) = (0.0f64, [f64::INFINITY, f64::NEG_INFINITY]);
        for p in corners(mesh, &triangles) {
            radius = radius.max((p - centroid).length());
            offsets = [offsets[0].min(p.dot(n)), offsets[1].max(p.dot(n))];
        }
        Self {
            triangles,
            n,
            area,
            centroid,
            radius,
            offsets,
        }
    }

    /// Mean width of the face: its area divided by its maximum length.
    fn width(&self) -> f64 {
        self.area / (2.0 * self.radius).max(f64::MIN_POSITIVE)
    }

    /// Returns true if the vertex normals are near the normal of the face, or if the mesh has no
    /// vertex normals.
    fn has_its_normals(&self, mesh: &Mesh) -> bool {
        let mut vertices = self.triangles.iter().flat_map(|&t| mesh.triangles[t as usize]);
        mesh.normals.is_empty()
            || vertices.all(|i| mesh.normals[i as usize].as_dvec3().dot(self.n).abs() >= MIN_NORMAL_COS)
    }
}

#[cfg(test)]
mod tests;
