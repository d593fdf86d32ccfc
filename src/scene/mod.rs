//! The frozen scene: arrays and typed ids, made by one validating builder.

mod builder;

pub use builder::{BuildError, SceneBuilder, SceneReport};

use crate::bsdf::Bsdf;
use crate::color::Spectrum;
use crate::geometry::{Facet, GeomId, Hit, Mesh, SurfacePoint};
use crate::light::{Light, LightId, LightSelection};
use crate::material::{Material, MaterialId};
use crate::math::{Bounds3, Vec3};

/// What a mesh is, besides its triangles.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Material of all its triangles.
    pub material: MaterialId,
    /// Light of its first triangle, if they emit; the other triangles follow in order.
    pub first_light: Option<LightId>,
}

/// Everything that light meets; immutable once built.
#[derive(Clone, Debug)]
pub struct Scene {
    meshes: Vec<Mesh>,
    /// What the points of each mesh's triangles share.
    facets: Vec<Vec<Facet>>,
    shapes: Vec<Shape>,
    materials: Vec<Material>,
    /// The BSDF of each material; none varies over a surface.
    bsdfs: Vec<Bsdf>,
    lights: Vec<Light>,
    infinite_lights: Vec<LightId>,
    light_selection: LightSelection,
    bounds: Bounds3,
}

impl Scene {
    /// Meshes, by [`GeomId`].
    pub fn meshes(&self) -> &[Mesh] {
        &self.meshes
    }

    /// Materials, by [`MaterialId`].
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Lights, by [`LightId`].
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// How next-event estimation chooses a light.
    pub fn light_selection(&self) -> &LightSelection {
        &self.light_selection
    }

    /// Box around all vertices.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> u64 {
        self.meshes.iter().map(|m| m.triangles.len() as u64).sum()
    }

    /// Bytes of the scene's own arrays, acceleration structures not counted.
    pub fn bytes(&self) -> u64 {
        let meshes: usize = self
            .meshes
            .iter()
            .map(|m| size_of_val(m.positions.as_slice()) + size_of_val(m.triangles.as_slice()))
            .sum();
        let facets: usize = self.facets.iter().map(|n| size_of_val(n.as_slice())).sum();
        let maps: usize = self
            .lights
            .iter()
            .map(|light| match light {
                Light::Environment(light) => light.bytes(),
                _ => 0,
            })
            .sum();
        (meshes + facets + maps + size_of_val(self.lights.as_slice())) as u64
    }

    /// The shape that mesh `geom` is part of.
    pub fn shape(&self, geom: GeomId) -> &Shape {
        &self.shapes[geom.0 as usize]
    }

    /// The point that was hit.
    #[inline(always)]
    pub fn surface_point(&self, hit: &Hit) -> SurfacePoint {
        let geom = hit.geom.0 as usize;
        let facet = self.facets[geom][hit.prim.0 as usize];
        SurfacePoint::new(self.meshes[geom].corners(hit.prim), facet, hit.b1, hit.b2)
    }

    /// Material of the surface that was hit.
    pub fn material(&self, hit: &Hit) -> &Material {
        &self.materials[self.shape(hit.geom).material.0 as usize]
    }

    /// Scattering at the surface that was hit.
    #[inline(always)]
    pub fn bsdf(&self, hit: &Hit) -> &Bsdf {
        &self.bsdfs[self.shape(hit.geom).material.0 as usize]
    }

    /// What the surface at `hit`, whose point is `q`, sends to `p` against the unit direction `wi` from `p`.
    ///
    /// The density is that of sampling this direction by its light, choice of the light included.
    pub fn emitted(&self, hit: &Hit, p: Vec3, q: Vec3, wi: Vec3) -> Option<Incident> {
        let first = self.shape(hit.geom).first_light?;
        let id = LightId(first.0 + hit.prim.0);
        let Light::Triangle(light) = &self.lights[id.0 as usize] else {
            return None;
        };
        Some(Incident {
            radiance: light.emitted(-wi),
            pdf: self.light_selection.pmf(id) * light.pdf(p, q, wi),
        })
    }

    /// What infinitely distant lights send against the unit direction `wi` of a ray that leaves the scene, light by light.
    pub fn escaped(&self, wi: Vec3) -> impl Iterator<Item = Incident> {
        self.infinite_lights.iter().filter_map(move |&id| {
            let (radiance, pdf) = match &self.lights[id.0 as usize] {
                Light::Constant(light) => (light.radiance, light.pdf()),
                Light::Environment(light) => (light.radiance(wi), light.pdf(wi)),
                Light::Triangle(_) | Light::Point(_) | Light::Directional(_) | Light::Spot(_) => return None,
            };
            let pdf = self.light_selection.pmf(id) * pdf;
            Some(Incident { radiance, pdf })
        })
    }
}

/// Light met by following a ray.
#[derive(Clone, Copy, Debug)]
pub struct Incident {
    /// Radiance that arrives.
    pub radiance: Spectrum,
    /// Density, per solid angle, with which light sampling would have drawn this direction.
    pub pdf: f32,
}
