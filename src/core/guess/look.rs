//! Rays into a scene by its own backend, and statistics of the surfaces that they meet.

use super::region::Region;
use super::triangles;
use crate::accel::Accel;
use crate::geometry::Hit;
use crate::material::Material;
use crate::math::{Ray, Vec3};
use crate::scene::Scene;
use std::collections::BTreeMap;

/// Surfaces that a ray passes because they are cut out there; what lies behind more of them is not looked at.
const MAX_CUTOUTS: u32 = 16;
/// Cells of directions on each face of a cube, along an edge.
const CELLS: f32 = 3.0;

/// Looks into a scene, as it is at time 0.
#[derive(Clone, Copy)]
pub(super) struct Looker<'a> {
    pub scene: &'a Scene,
    pub accel: &'a dyn Accel,
    /// The region that holds most of the scene.
    pub region: Region,
}

/// The surface that a ray meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Along the ray, scene units where its direction is a unit vector.
    pub distance: f32,
    /// Unit normal of the triangle by its winding.
    pub normal: Vec3,
    /// Whether the ray meets the front of the triangle.
    pub is_front: bool,
    pub material: u32,
    /// Names the triangle.
    pub triangle: u64,
}

impl Looker<'_> {
    /// The first surface that is not cut out, and not the ground.
    pub fn look(&self, origin: Vec3, direction: Vec3) -> Option<Seen> {
        let mut ray = Ray::new(origin, direction);
        for _ in 0..MAX_CUTOUTS {
            let hit = self.accel.intersect(&ray)?;
            let is_ground = self.scene.ground().is_some_and(|ground| ground.is_at(&hit));
            if is_ground || self.scene.has_alpha() && self.scene.opacity(&hit) < 0.5 {
                ray.t_min = hit.t;
                continue;
            }
            return Some(self.seen(&hit, direction));
        }
        None
    }

    /// Reflectance of what was seen: of its diffuse and specular colours, at most 1, or 0.5 if textures or vertices give them.
    pub fn reflectance(&self, seen: &Seen) -> f32 {
        let material = self.material(seen);
        if material.maps.diffuse.is_some() || material.maps.vertex_color {
            0.5
        } else {
            (material.diffuse + material.specular).luminance().min(1.0)
        }
    }

    /// Material of what was seen.
    pub fn material(&self, seen: &Seen) -> &Material {
        &self.scene.materials()[seen.material as usize]
    }

    /// Whether a ray leaves the scene, at most through cutouts and what is mostly clear, such as window panes.
    pub fn escapes(&self, origin: Vec3, direction: Vec3) -> bool {
        let mut ray = Ray::new(origin, direction);
        for _ in 0..MAX_CUTOUTS {
            let Some(hit) = self.accel.intersect(&ray) else {
                return true;
            };
            let is_clear = self.scene.material(&hit).transmission.luminance() > 0.5;
            if !is_clear && self.scene.opacity(&hit) >= 0.5 {
                return false;
            }
            ray.t_min = hit.t;
        }
        false
    }

    fn seen(&self, hit: &Hit, direction: Vec3) -> Seen {
        let [p0, p1, p2] = self.scene.corners(hit, 0.0);
        let normal = crate::geometry::triangle_normal(p0, p1, p2);
        Seen {
            distance: hit.t,
            normal,
            is_front: normal.dot(direction) < 0.0,
            material: self.scene.shape(hit.geom).material.0,
            triangle: triangles::name(hit.geom, hit.prim, hit.inst),
        }
    }
}

/// Statistics of the surfaces that a bundle of rays meets; all rays have the same weight.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub rays: u32,
    pub hits: u32,
    /// Hits of fronts.
    pub fronts: u32,
    normals: BTreeMap<u8, u32>,
    materials: BTreeMap<u32, u32>,
    triangles: BTreeMap<u64, u32>,
}

impl Tally {
    /// Takes in what one ray saw.
    pub fn add(&mut self, seen: Option<&Seen>) {
        self.rays += 1;
        let Some(seen) = seen else { return };
        self.hits += 1;
        self.fronts += u32::from(seen.is_front);
        *self.normals.entry(cell_of(seen.normal)).or_default() += 1;
        *self.materials.entry(seen.material).or_default() += 1;
        *self.triangles.entry(seen.triangle).or_default() += 1;
    }

    /// Share of the hits that meet the front of a triangle.
    pub fn front_share(&self) -> f32 {
        self.fronts as f32 / self.hits.max(1) as f32
    }

    /// Entropies in bits over the hits: of the cells of normals, of materials, and of triangles.
    ///
    /// This is viewpoint entropy (Vázquez, Feixas, Sbert and Heidrich 2001) of three partitions of what is visible; that of normals does not depend on how
    /// finely a surface is cut.
    pub fn entropies(&self) -> [f32; 3] {
        let normals = entropy(self.normals.values(), self.hits);
        let materials = entropy(self.materials.values(), self.hits);
        let triangles = entropy(self.triangles.values(), self.hits);
        [normals, materials, triangles]
    }
}

/// Entropy of `counts`, which sum to `total`, in bits.
fn entropy<'a>(counts: impl Iterator<Item = &'a u32>, total: u32) -> f32 {
    let total = f64::from(total.max(1));
    let terms = counts.map(|&count| {
        let p = f64::from(count) / total;
        -p * p.log2()
    });
    terms.sum::<f64>() as f32
}

/// The cell of a direction, of 6 · 3 · 3 on the faces of a cube.
fn cell_of(direction: Vec3) -> u8 {
    let size = direction.abs();
    let axis = size.max_position();
    let largest = size[axis].max(f32::MIN_POSITIVE);
    let on_face = |i: usize| {
        let place = 0.5 + 0.5 * direction[(axis + i) % 3] / largest;
        (place * CELLS).clamp(0.0, CELLS - 1.0) as u8
    };
    let face = 2 * axis as u8 + u8::from(direction[axis] < 0.0);
    (face * CELLS as u8 + on_face(1)) * CELLS as u8 + on_face(2)
}
