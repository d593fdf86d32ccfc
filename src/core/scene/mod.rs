//! The frozen scene: arrays and typed ids. A builder (`builder`) checks its input (`validate`) and
//! makes the scene from it (`freeze`).
//!
//! A frozen scene takes 36 bytes per triangle of a mesh with positions only: 12 of indices, 8 of
//! vertices and 16 of its facet. A compact scene (`--compact`) does not store facets, but computes
//! the facet at each hit. The image is bit-identical. docs/notebook/2026-11.md, "Memory", has
//! measurements of both.

mod absorption;
mod builder;
mod duplicates;
mod freeze;
mod ground;
mod incident;
mod lamp_hulls;
mod lamp_sizes;
mod light_checks;
mod lights_and_groups;
mod made_lights;
mod part_sizes;
mod passing;
mod rebuilt;
mod recognise;
mod section;
mod validate;

pub use builder::{PrototypeId, SceneBuilder, SceneReport};
pub use duplicates::{CoincidentEmitters, MANY_COINCIDENT};
pub use ground::{Ground, GroundPlane};
pub use incident::Incident;
pub(crate) use lamp_hulls::HullHit;
pub use lamp_sizes::LampSize;
pub use made_lights::{
    DiskParameters, LAMP_KINDS, RectangleParameters, SkyParameters, SphereParameters, StudioParameters, lamp_name,
};
pub use part_sizes::PartSize;
pub use rebuilt::UnlitBuilder;
pub use recognise::Panes;
pub use section::{CutLight, OpenShell, SectionPlane, SectionReport};
pub use validate::BuildError;

use crate::bsdf::Bsdf;
use crate::color::Spectrum;
use crate::geometry::{
    Facet, GeomId, Hit, InstanceId, Mesh, PartNames, PlacedTriangle, Placement, SurfacePoint, UNNAMED,
};
use crate::light::{AreaLight, Light, LightGroups, LightId, TexturedTriangle};
use crate::light_sampling::{EmissionSelection, Lamps, LightChoice, LightSelection};
use crate::material::{Material, MaterialId, Spot, ThinSurface};
use crate::math::{Ball, Bounds3, Frame, Vec2, Vec3};
use crate::texture::{Texture, TextureFilter};
use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::HashSet;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Properties of a mesh, apart from its triangles.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Material of all triangles.
    pub material: MaterialId,
    /// True if the mesh is not part of a prototype, does not deform, and has constant normals and a
    /// constant material on each triangle.
    pub is_plain: bool,
    /// Index of the mesh's object in [`Scene::objects`], if the mesh is not part of a prototype.
    pub object: u32,
    /// First light of the mesh, if the mesh emits. The other lights of the mesh have the next
    /// higher ids. In a prototype, the id is relative to [`Instance::first_light`].
    pub first_light: Option<LightId>,
    /// Number of lights of the mesh.
    pub light_count: u32,
    /// Map from each triangle to its light.
    pub numbering: LightNumbering,
}

/// Map from the triangles of a shape to the shape's lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightNumbering {
    /// Each triangle is a light.
    Triangles,
    /// All triangles are the same light.
    One,
    /// Some triangles belong to the same light. This is the index of a list in [`Scene`] with the
    /// light number of each triangle.
    Listed(u32),
}

/// Placement of a prototype in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index of the prototype, in the order of [`Scene::prototypes`].
    pub prototype: u32,
    /// Placement of the instance.
    pub placement: Placement,
    /// Index of the instance's object in [`Scene::objects`].
    pub object: u32,
    /// First light of the instance's triangles, if any triangle emits.
    pub first_light: LightId,
}

/// Geometry, materials and lights; immutable once built.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Meshes that are not part of a prototype, then the meshes of the prototypes. Acceleration
    /// structures read the same arrays, and can outlive the scene.
    meshes: Arc<Vec<Mesh>>,
    /// Range of the mesh ids of each prototype.
    prototypes: Vec<Range<u32>>,
    instances: Vec<Instance>,
    /// Precomputed triangle data for hit points, by mesh. Empty for meshes that move or belong to
    /// prototypes, and in compact scenes.
    facets: Vec<Vec<Facet>>,
    shapes: Vec<Shape>,
    objects: Vec<String>,
    /// Names of the parts of all meshes.
    parts: PartNames,
    materials: Vec<Material>,
    /// BSDF of each material without its textures. It does not include rays that pass through the
    /// surface in a straight line.
    bsdfs: Vec<Bsdf>,
    /// Thin surface of each material that has one. A ray can pass through a thin surface in a
    /// straight line, without scattering.
    thin_surfaces: Vec<Option<ThinSurface>>,
    is_compact: bool,
    has_alpha: bool,
    /// True if there is a surface that is hidden from camera rays but not from other rays.
    hides_from_camera: bool,
    /// True if there is a surface that only camera rays hit.
    hides_from_light: bool,
    /// True if a mesh has surfaces without a back.
    hides_backs: bool,
    has_thin_surfaces: bool,
    has_lamp_hulls: bool,
    has_absorption: bool,
    is_dispersive: bool,
    /// Absorption coefficient of the body behind surfaces of each material, per scene unit.
    absorptions: Vec<Spectrum>,
    panes: u64,
    is_moving: bool,
    textures: Vec<Texture>,
    texture_filter: TextureFilter,
    lights: Vec<Light>,
    /// For each shape with [`LightNumbering::Listed`]: light number of each triangle within the
    /// shape.
    light_numbers: Vec<Vec<u32>>,
    infinite_lights: Vec<LightId>,
    /// Selection of the light from which a light path starts, computed at the first request.
    emission_selection: OnceLock<EmissionSelection>,
    light_groups: LightGroups,
    bounds: Bounds3,
    ground: Option<Ground>,
}

impl Scene {
    /// Meshes, by [`GeomId`].
    pub fn meshes(&self) -> &[Mesh] {
        &self.meshes
    }

    /// The meshes, for code that can outlive a borrow of the scene.
    #[cfg_attr(not(feature = "embree"), allow(dead_code))]
    pub(crate) fn shared_meshes(&self) -> Arc<Vec<Mesh>> {
        Arc::clone(&self.meshes)
    }

    /// If both scenes have equal meshes and placements, frees the meshes of this scene, which then
    /// shares the meshes of `other`. Returns true if the meshes are shared now.
    pub fn share_meshes(&mut self, other: &Self) -> bool {
        let places = |scene: &Self| -> Vec<(u32, Placement)> {
            let instances = scene.instances.iter();
            instances.map(|i| (i.prototype, i.placement.clone())).collect()
        };
        let is_same = self.is_compact == other.is_compact
            && self.prototypes == other.prototypes
            && places(self) == places(other)
            && self.meshes == other.meshes;
        if is_same {
            self.meshes = Arc::clone(&other.meshes);
        }
        is_same
    }

    /// The mesh `geom`.
    pub fn mesh(&self, geom: GeomId) -> &Mesh {
        &self.meshes[geom.0 as usize]
    }

    /// Ids of all meshes.
    pub fn geom_ids(&self) -> impl Iterator<Item = GeomId> {
        (0..self.meshes.len() as u32).map(GeomId)
    }

    /// Materials, by [`MaterialId`].
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Lights, by [`LightId`].
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Makes the selection of lights for next-event estimation. `choice` is the method of
    /// selection.
    pub fn light_selection(&self, choice: LightChoice) -> LightSelection {
        // Use a radius of 1 for a scene without extent, so that its sky has power
        let radius = Some(self.bounds.radius()).filter(|&r| r > 0.0).unwrap_or(1.0);
        let selection = LightSelection::new(choice.mode, &self.lights, self.bounds, radius);
        selection.with_lamps(|| {
            let lamps = self.lamps().into_iter();
            Lamps::new(lamps, &self.lights, radius, choice.lamp_samples.max(1))
        })
    }

    /// Selection of the light from which a light path starts, computed at the first request.
    pub fn emission_selection(&self) -> &EmissionSelection {
        self.emission_selection
            .get_or_init(|| EmissionSelection::new(&self.lights, self.ball().radius))
    }

    /// Light groups of the scene.
    pub fn light_groups(&self) -> &LightGroups {
        &self.light_groups
    }

    /// The plane that catches shadows, if any. The scene's bounds do not include the plane.
    #[inline(always)]
    pub fn ground(&self) -> Option<&Ground> {
        self.ground.as_ref()
    }

    /// Box around all vertices, at all times.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Ball that contains all vertices at all times. Its radius is 1 if the vertices have no
    /// extent.
    pub fn ball(&self) -> Ball {
        Ball::around(self.bounds)
    }

    /// Converts the scene to a compact scene, which needs less memory. Facets of triangles are then
    /// computed at each hit, also by acceleration structures.
    pub fn into_compact(mut self) -> Self {
        self.facets.iter_mut().for_each(|facets| *facets = Vec::new());
        self.is_compact = true;
        self
    }

    /// Returns true if the scene is compact, which needs less memory and more time.
    pub fn is_compact(&self) -> bool {
        self.is_compact
    }

    /// Number of stored triangles; triangles of a prototype count once.
    pub fn triangle_count(&self) -> u64 {
        self.meshes.iter().map(|m| m.triangles.len() as u64).sum()
    }

    /// Number of triangles in the world; triangles of a prototype count once per instance.
    pub fn placed_triangle_count(&self) -> u64 {
        let count = |ids: &Range<u32>| -> u64 {
            let meshes = &self.meshes[ids.start as usize..ids.end as usize];
            meshes.iter().map(|m| m.triangles.len() as u64).sum()
        };
        let of_prototypes: Vec<u64> = self.prototypes.iter().map(count).collect();
        let of_instances = self.instances.iter().map(|i| of_prototypes[i.prototype as usize]);
        count(&self.world_meshes()) + of_instances.sum::<u64>()
    }

    /// Ids of the meshes that are not part of a prototype.
    pub fn world_meshes(&self) -> Range<u32> {
        0..self.prototypes.first().map_or(self.meshes.len() as u32, |p| p.start)
    }

    /// Ids of the meshes of each prototype.
    pub fn prototypes(&self) -> &[Range<u32>] {
        &self.prototypes
    }

    /// Instances, by [`InstanceId`].
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The instance of a hit; `None` if the mesh is not part of a prototype.
    pub fn instance(&self, id: InstanceId) -> Option<&Instance> {
        self.instances.get(id.0 as usize)
    }

    /// Returns true if anything in the scene moves.
    #[inline(always)]
    pub fn is_moving(&self) -> bool {
        self.is_moving
    }

    /// Returns true if the surface at `hit` moves.
    pub fn moves(&self, hit: &Hit) -> bool {
        let is_placed_anew = |instance: &Instance| instance.placement.is_moving();
        self.is_moving && (self.instance(hit.inst).is_some_and(is_placed_anew) || self.mesh(hit.geom).deforms())
    }

    /// Size of the scene's arrays in bytes, without acceleration structures.
    pub fn bytes(&self) -> u64 {
        let meshes: usize = self.meshes.iter().map(Mesh::bytes).sum();
        let facets: usize = self.facets.iter().map(|n| size_of_val(n.as_slice())).sum();
        // Count each image once: skies may share images
        let mut pictures = HashSet::new();
        let maps: usize = self
            .lights
            .iter()
            .map(|light| match light {
                Light::Environment(light) if !pictures.insert(std::ptr::from_ref(light.image()) as usize) => 0,
                Light::Environment(light) => light.bytes(),
                Light::Area(AreaLight::Textured(_)) => size_of::<TexturedTriangle>(),
                _ => 0,
            })
            .sum();
        let textures: usize = self.textures.iter().map(Texture::bytes).sum();
        let instances = size_of_val(self.instances.as_slice());
        let selection = self.emission_selection.get().map_or(0, EmissionSelection::bytes);
        let numbers: usize = self.light_numbers.iter().map(|n| size_of_val(n.as_slice())).sum();
        let lights = size_of_val(self.lights.as_slice()) + numbers + self.light_groups.bytes();
        let lights = lights + selection;
        (meshes + self.parts.bytes() + facets + instances + maps + textures + lights) as u64
    }

    /// The shape of mesh `geom`.
    pub fn shape(&self, geom: GeomId) -> &Shape {
        &self.shapes[geom.0 as usize]
    }

    /// The hit point at `time`.
    pub fn surface_point(&self, hit: &Hit, time: f32) -> SurfacePoint {
        let geom = hit.geom.0 as usize;
        let mesh = &self.meshes[geom];
        let point = if hit.inst != InstanceId::NONE || mesh.deforms() {
            self.placed(hit, time).point(hit.b1, hit.b2)
        } else {
            mesh.surface_point_on(self.facet(hit), hit.prim, hit.b1, hit.b2)
        };
        SurfacePoint { time, ..point }
    }

    /// Facet (precomputed data) of the triangle that was hit. The mesh of the triangle must not be
    /// part of a prototype.
    #[inline(always)]
    fn facet(&self, hit: &Hit) -> Facet {
        let geom = hit.geom.0 as usize;
        match self.facets[geom].get(hit.prim.0 as usize) {
            Some(facet) => *facet,
            None => self.facet_anew(hit),
        }
    }

    #[inline(never)]
    fn facet_anew(&self, hit: &Hit) -> Facet {
        self.mesh(hit.geom).facet(hit.prim)
    }

    /// The triangle that was hit, placed at `time`.
    pub fn placed(&self, hit: &Hit, time: f32) -> PlacedTriangle {
        let mesh = &self.meshes[hit.geom.0 as usize];
        let placement = self.instance(hit.inst).map(|i| i.placement.at(time));
        PlacedTriangle::new(
            mesh.corners_at(hit.prim, time),
            mesh.normals_at(hit.prim, time),
            placement,
        )
    }

    /// Corners of the triangle that was hit, placed at `time`, in the order of the mesh.
    pub fn corners(&self, hit: &Hit, time: f32) -> [Vec3; 3] {
        let corners = self.meshes[hit.geom.0 as usize].corners_at(hit.prim, time);
        match self.instance(hit.inst).map(|i| i.placement.at(time)) {
            Some(placement) => corners.map(|p| placement.transform_point3a(p)),
            None => corners,
        }
    }

    /// Names of the objects of the scene.
    pub fn objects(&self) -> &[String] {
        &self.objects
    }

    /// Index in [`Scene::objects`] of the object that was hit.
    pub fn object(&self, hit: &Hit) -> u32 {
        match self.instance(hit.inst) {
            Some(instance) => instance.object,
            None => self.shape(hit.geom).object,
        }
    }

    /// Names of the parts of meshes.
    pub fn part_names(&self) -> &PartNames {
        &self.parts
    }

    /// Index of the part that was hit. The first parts are the objects, in the order of
    /// [`Scene::objects`]. Triangles without a part name belong to the part of their object. The
    /// parts of [`Scene::part_names`] follow.
    pub fn part(&self, hit: &Hit) -> u32 {
        match self.mesh(hit.geom).part(hit.prim) {
            UNNAMED => self.object(hit),
            part => self.objects.len() as u32 + part - 1,
        }
    }

    /// Name of the part with the index `part`, as returned by [`Scene::part`].
    pub fn part_name(&self, part: u32) -> Cow<'_, str> {
        let objects = self.objects.len() as u32;
        match self.objects.get(part as usize) {
            Some(object) => object.into(),
            None => self.parts.name(part - objects + 1),
        }
    }

    /// Texture coordinates at `hit`, if the mesh has any.
    pub fn uv(&self, hit: &Hit) -> Option<Vec2> {
        self.mesh(hit.geom).uv(hit.prim, hit.b1, hit.b2)
    }

    /// Index in [`Scene::materials`] of the material that was hit.
    pub fn material_id(&self, hit: &Hit) -> u32 {
        self.shape(hit.geom).material.0
    }

    /// Material that was hit.
    pub fn material(&self, hit: &Hit) -> &Material {
        &self.materials[self.shape(hit.geom).material.0 as usize]
    }

    /// The hit point at `time` and its BSDF; `None` if [`Shape::is_plain`] is false for the mesh.
    #[inline(always)]
    pub fn plain_surface(&self, hit: &Hit, time: f32) -> Option<(SurfacePoint, &Bsdf)> {
        let shape = self.shape(hit.geom);
        if !shape.is_plain {
            return None;
        }
        let corners = self.mesh(hit.geom).corners(hit.prim);
        let point = SurfacePoint::new(corners, self.facet(hit), hit.b1, hit.b2);
        Some((SurfacePoint { time, ..point }, &self.bsdfs[shape.material.0 as usize]))
    }

    /// BSDF at the hit. If the BSDF varies over the surface, it is stored in `slot`. `footprint` is
    /// the size, in scene units, of the surface region that the viewer sees as one point.
    pub fn bsdf<'a>(&'a self, hit: &Hit, time: f32, footprint: f32, slot: &'a OnceCell<Bsdf>) -> &'a Bsdf {
        let material = self.material(hit);
        if material.maps.varies_bsdf() {
            slot.get_or_init(|| material.bsdf_at(&self.spot(hit, time, footprint)))
        } else {
            &self.bsdfs[self.shape(hit.geom).material.0 as usize]
        }
    }

    /// Returns true if the index of refraction of any glass depends on the wavelength.
    #[inline(always)]
    pub fn is_dispersive(&self) -> bool {
        self.is_dispersive
    }

    /// The BSDF at a hit for a wavelength in nanometres; `None` if the BSDF does not depend on the
    /// wavelength.
    pub fn bsdf_of_wavelength(&self, hit: &Hit, nanometers: f32) -> Option<Bsdf> {
        let material = self.shape(hit.geom).material.0 as usize;
        self.materials[material].dispersed(&self.bsdfs[material], nanometers)
    }

    /// BSDF at a hit. The result is owned if a texture varies the BSDF, else borrowed.
    pub fn bsdf_at(&self, hit: &Hit, time: f32, footprint: f32) -> Cow<'_, Bsdf> {
        let material = self.material(hit);
        if material.maps.varies_bsdf() {
            Cow::Owned(material.bsdf_at(&self.spot(hit, time, footprint)))
        } else {
            Cow::Borrowed(&self.bsdfs[self.shape(hit.geom).material.0 as usize])
        }
    }

    /// Unfiltered values of all textures of the material at `hit`. Each entry has the texture's key
    /// in scene files, and one or three values.
    pub fn texels_at(&self, hit: &Hit) -> Vec<(&'static str, Vec<f32>)> {
        self.material(hit).maps.texels(&self.spot(hit, 0.0, 0.0))
    }

    /// Textures, by [`TextureId`](crate::texture::TextureId).
    pub fn textures(&self) -> &[Texture] {
        &self.textures
    }

    /// Filter of texture lookups.
    pub fn texture_filter(&self) -> TextureFilter {
        self.texture_filter
    }

    /// The surface point `point` at `hit`, with the shading normal that bump and normal maps
    /// define.
    pub fn with_bumps(&self, hit: &Hit, point: SurfacePoint, footprint: f32) -> SurfacePoint {
        let maps = &self.material(hit).maps;
        if !maps.has_bumps() {
            return point;
        }
        let corners = self.corners(hit, point.time);
        match self.meshes[hit.geom.0 as usize].tangents(hit.prim, corners) {
            Some(tangents) => point.with_bumps(tangents, maps.bumped_normal(&self.spot(hit, point.time, footprint))),
            None => point,
        }
    }

    /// Local frame at the surface point `point` at `hit`. If the material is anisotropic and the
    /// mesh has texture coordinates, the tangent is aligned to the direction of anisotropy.
    /// Otherwise the tangent is arbitrary.
    pub fn frame(&self, hit: &Hit, point: &SurfacePoint) -> Frame {
        let material = self.material(hit);
        if !material.is_anisotropic() {
            return Frame::from_z(point.ns);
        }
        let corners = self.corners(hit, point.time);
        let tangents = self.meshes[hit.geom.0 as usize].tangents(hit.prim, corners);
        let angle = material.anisotropy_rotation.to_radians();
        let frame = tangents.and_then(|[du, _]| Frame::from_zx(point.ns, du, angle));
        frame.unwrap_or_else(|| Frame::from_z(point.ns))
    }

    /// Diffuse colour of the surface at `hit` at time 0, over `footprint`, in scene units.
    pub fn diffuse_color(&self, hit: &Hit, footprint: f32) -> Spectrum {
        self.material(hit).diffuse_at(&self.spot(hit, 0.0, footprint))
    }

    /// Location for texture lookups at `hit` at `time`. `footprint` is in scene units. If the mesh
    /// has no texture coordinates, the location is (0, 0).
    fn spot(&self, hit: &Hit, time: f32, footprint: f32) -> Spot<'_> {
        let mesh = &self.meshes[hit.geom.0 as usize];
        Spot {
            textures: &self.textures,
            uv: mesh.uv(hit.prim, hit.b1, hit.b2).unwrap_or_default(),
            color: mesh.color(hit.prim, hit.b1, hit.b2),
            alpha: mesh.alpha(hit.prim, hit.b1, hit.b2),
            footprint: match self.texture_filter {
                TextureFilter::Mip => footprint * mesh.uv_per_length(hit.prim, self.corners(hit, time)),
                TextureFilter::Bilinear => 0.0,
            },
        }
    }
}
