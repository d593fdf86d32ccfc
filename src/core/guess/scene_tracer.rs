//! Rays into a scene, traced by the scene's backend, and statistics of the surfaces that they hit.

use super::region::Region;
use super::triangles;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::material::Material;
use crate::math::{Ray, Vec3};
use crate::scene::Scene;
use std::collections::BTreeMap;

/// Maximum number of cutouts that a ray passes; surfaces behind more cutouts are ignored.
const MAX_CUTOUTS: u32 = 16;
/// Number of cells of directions along an edge of a cube's face.
const CELLS: f32 = 3.0;

/// Traces rays in a scene at time 0.
#[derive(Clone, Copy)]
pub(super) struct SceneTracer<'a> {
    pub scene: &'a Scene,
    pub accel: &'a dyn Accel,
    /// Region that contains most of the scene.
    pub region: Region,
}

/// Surface that a ray hits.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceHit {
    /// Ray parameter: scene units if the direction is a unit vector.
    pub distance: f32,
    /// Unit normal of the triangle, from its winding.
    pub normal: Vec3,
    /// True if the ray hits the front of the triangle.
    pub is_front: bool,
    pub material: u32,
    /// Number that identifies the triangle.
    pub triangle: u64,
}

impl SceneTracer<'_> {
    /// The first surface along a ray that is not cut out (opacity below 0.5) and is not the ground.
    pub fn trace(&self, origin: Vec3, direction: Vec3) -> Option<SurfaceHit> {
        let hit = self.first_hit(origin, direction)?;
        Some(self.surface_hit(&hit, direction))
    }

    /// Diffuse colour of the surface that [`Self::trace`] finds, over a width that is `width` at
    /// the distance 1.
    pub fn color(&self, origin: Vec3, direction: Vec3, width: f32) -> Option<Spectrum> {
        let hit = self.first_hit(origin, direction)?;
        Some(self.scene.diffuse_color(&hit, width * hit.t))
    }

    fn first_hit(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let mut ray = Ray::new(origin, direction);
        for _ in 0..MAX_CUTOUTS {
            let hit = self.accel.intersect(&ray)?;
            let is_ground = self.scene.ground().is_some_and(|ground| ground.is_at(&hit));
            if is_ground || self.scene.has_alpha() && self.scene.opacity(&hit) < 0.5 {
                ray.t_min = hit.t;
                continue;
            }
            return Some(hit);
        }
        None
    }

    /// Reflectance of the surface: luminance of its diffuse plus specular colour, at most 1, or 0.5
    /// if textures or vertices define it.
    pub fn reflectance(&self, seen: &SurfaceHit) -> f32 {
        let material = self.material(seen);
        if material.maps.diffuse.is_some() || material.maps.vertex_color {
            0.5
        } else {
            (material.diffuse + material.specular).luminance().min(1.0)
        }
    }

    /// Material of the surface.
    pub fn material(&self, seen: &SurfaceHit) -> &Material {
        &self.scene.materials()[seen.material as usize]
    }

    /// Returns true if a ray leaves the scene, passing only cutouts and mostly clear surfaces such
    /// as window panes.
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

    fn surface_hit(&self, hit: &Hit, direction: Vec3) -> SurfaceHit {
        let [p0, p1, p2] = self.scene.corners(hit, 0.0);
        let normal = crate::geometry::triangle_normal(p0, p1, p2);
        SurfaceHit {
            distance: hit.t,
            normal,
            is_front: normal.dot(direction) < 0.0,
            material: self.scene.shape(hit.geom).material.0,
            triangle: triangles::name(hit.geom, hit.prim, hit.inst),
        }
    }
}

/// Statistics of the surfaces that a bundle of rays hits; all rays have the same weight.
#[derive(Clone, Debug, Default)]
pub(super) struct HitStatistics {
    pub rays: u32,
    pub hits: u32,
    /// Number of hits on fronts.
    pub fronts: u32,
    normals: BTreeMap<u8, u32>,
    materials: BTreeMap<u32, u32>,
    triangles: BTreeMap<u64, u32>,
}

impl HitStatistics {
    /// Adds the result of one ray.
    pub fn add(&mut self, seen: Option<&SurfaceHit>) {
        self.rays += 1;
        let Some(seen) = seen else { return };
        self.hits += 1;
        self.fronts += u32::from(seen.is_front);
        *self.normals.entry(cell_of(seen.normal)).or_default() += 1;
        *self.materials.entry(seen.material).or_default() += 1;
        *self.triangles.entry(seen.triangle).or_default() += 1;
    }

    /// Fraction of the hits that are on the front of a triangle.
    pub fn front_share(&self) -> f32 {
        self.fronts as f32 / self.hits.max(1) as f32
    }

    /// Entropies of three distributions in bits: of the hits over cells of normals, over materials,
    /// and over triangles.
    ///
    /// This is viewpoint entropy (Vázquez, Feixas, Sbert and Heidrich 2001) of three partitions of
    /// the visible surfaces. The entropy of normals does not depend on the tessellation of a
    /// surface.
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

/// Cell of a direction: one of 6 · 3 · 3 on the faces of a cube.
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
