use super::{Instance, Scene, Shape};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::geometry::{GeomId, InstanceId, Mesh, PlacedTriangle, Placement, PrimId, triangle_area};
use crate::light::{
    ConstantLight, DirectionalLight, EnvironmentLight, LatLongImage, Light, LightId, LightSelection, MovingTriangle,
    PointLight, SelectionMode, SpotLight, TriangleLight, TriangleSampling,
};
use crate::material::{Gloss, Map, Material, MaterialId};
use crate::math::{Affine3A, Bounds3, Quat, Vec3};
use crate::texture::{Texture, TextureFilter, TextureId};
use thiserror::Error;

/// Largest coordinate that is accepted; Embree leaves out triangles beyond some 1.8e18 without a word.
const MAX_COORDINATE: f32 = 1e18;

/// Why a scene cannot be built.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum BuildError {
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} uses vertex {index}, but the mesh has {vertices} vertices")]
    IndexOutOfRange {
        /// Triangle within its mesh.
        triangle: usize,
        /// The index it holds.
        index: u32,
        /// Number of vertices there are.
        vertices: usize,
    },
    /// A vertex is NaN, infinite or beyond what backends can represent.
    #[error("vertex {vertex} is at ({}, {}, {}): coordinates must be finite and below 1e18", position.x, position.y, position.z)]
    BadVertex {
        /// Vertex within its mesh.
        vertex: usize,
        /// Where it claims to be.
        position: Vec3,
    },
    /// A mesh that changes its shape has not as many vertices at time 1.
    #[error("the mesh has {open} vertices at first and {close} in the end")]
    OtherVertices {
        /// At time 0.
        open: usize,
        /// At time 1.
        close: usize,
    },
    /// An instance is flattened, turned inside out on its way, or beyond what backends can represent.
    #[error("instance {instance} {problem}")]
    BadPlacement {
        /// In the order of adding.
        instance: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// A vertex attribute is not there for every vertex, or has a value that it cannot have.
    #[error("vertex {vertex} has no {attribute} that is finite{}", if *.attribute == "normal" { " and not zero" } else { "" })]
    BadAttribute {
        /// Vertex within its mesh.
        vertex: usize,
        /// Normal or texture coordinate.
        attribute: &'static str,
    },
    /// A material has a value that no surface can have.
    #[error("material `{material}`: {key} is {value}, but must be {rule}")]
    BadMaterial {
        /// Its name.
        material: String,
        /// The quantity.
        key: &'static str,
        /// What it was set to.
        value: String,
        /// What it should be.
        rule: &'static str,
    },
    /// A light has a value that no light can have.
    #[error("{light} light: {key} is {value}, but {rule}")]
    BadLight {
        /// Its type.
        light: &'static str,
        /// The quantity.
        key: &'static str,
        /// What it was set to.
        value: String,
        /// What it should be.
        rule: &'static str,
    },
    /// More meshes, triangles or lights than 32-bit ids can name.
    #[error("more than 2^32 - 2 {0} in one scene")]
    TooMany(&'static str),
}

/// What the builder left out or assumed; every entry is worth a word to the user.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneReport {
    /// Triangles without area, left out.
    pub degenerate_triangles: u64,
    /// Materials whose lobes summed to more than 1 in some channel and were scaled down: name and largest channel.
    pub scaled_materials: Vec<(String, f32)>,
    /// Nothing emitted, so a constant environment of radiance 1 was added.
    pub default_light: bool,
}

/// Names a prototype: meshes that instances put into the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrototypeId(u32);

/// Collects validated parts and freezes them into a [`Scene`].
#[derive(Debug, Default)]
pub struct SceneBuilder {
    meshes: Vec<(Mesh, MaterialId)>,
    prototypes: Vec<Vec<(Mesh, MaterialId)>>,
    instances: Vec<(PrototypeId, Placement)>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    texture_filter: TextureFilter,
    lights: Vec<Light>,
    selection: SelectionMode,
    triangle_sampling: TriangleSampling,
    report: SceneReport,
}

impl SceneBuilder {
    /// A builder that holds nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a material; lobes that sum to more than 1 in some channel are scaled down and reported, unless textures vary them: then that is done
    /// where they are looked up.
    pub fn add_material(&mut self, mut material: Material) -> Result<MaterialId, BuildError> {
        check_material(&material)?;
        let scattered = material.scattered();
        let varies = material.maps.varies_bsdf();
        if !varies {
            material.scale_to_one();
        }
        // Parts that sum to 1 up to rounding are what was meant.
        if scattered > 1.0 + 4.0 * f32::EPSILON && !varies {
            self.report.scaled_materials.push((material.name.clone(), scattered));
        }
        self.materials.push(material);
        Ok(MaterialId(self.materials.len() as u32 - 1))
    }

    /// Adds triangles of one material that stand in the world. Triangles without area are left out and reported.
    pub fn add_mesh(&mut self, mesh: Mesh, material: MaterialId) -> Result<(), BuildError> {
        let mesh = self.checked(mesh)?;
        if !mesh.triangles.is_empty() {
            self.meshes.push((mesh, material));
        }
        Ok(())
    }

    /// Adds meshes that are kept once and put into the world by [`SceneBuilder::add_instance`], as often as one likes.
    pub fn add_prototype(&mut self, meshes: Vec<(Mesh, MaterialId)>) -> Result<PrototypeId, BuildError> {
        let mut checked = Vec::with_capacity(meshes.len());
        for (mesh, material) in meshes {
            let mesh = self.checked(mesh)?;
            if !mesh.triangles.is_empty() {
                checked.push((mesh, material));
            }
        }
        self.prototypes.push(checked);
        Ok(PrototypeId(self.prototypes.len() as u32 - 1))
    }

    /// Puts a prototype into the world.
    pub fn add_instance(&mut self, prototype: PrototypeId, placement: Placement) -> Result<(), BuildError> {
        let bad = |problem| {
            Err(BuildError::BadPlacement {
                instance: self.instances.len(),
                problem,
            })
        };
        let determinants = || placement.steps().iter().map(|step| step.matrix3.determinant());
        if !placement.steps().iter().all(|step| step.is_finite()) || !determinants().all(|d| d.is_finite() && d != 0.0)
        {
            return bad("is flattened, or its placement is not finite");
        }
        if determinants().any(|d| d < 0.0) && determinants().any(|d| d > 0.0) {
            return bad("is turned inside out on its way");
        }
        if placement.is_moving() && !(2..=Placement::MOST_STEPS).contains(&placement.steps().len()) {
            return bad("has too few or too many steps on its way");
        }
        let bounds = placement.bounds(bounds_of(&self.prototypes[prototype.0 as usize]));
        let within = |p: Vec3| p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all();
        if ![bounds.min, bounds.max]
            .into_iter()
            .all(|p| bounds.is_empty() || within(p))
        {
            return bad("reaches beyond coordinates of 1e18");
        }
        if self.instances.len() >= u32::MAX as usize - 1 {
            return Err(BuildError::TooMany("instances"));
        }
        self.instances.push((prototype, placement));
        Ok(())
    }

    /// The mesh without triangles that have no area at any time.
    fn checked(&mut self, mut mesh: Mesh) -> Result<Mesh, BuildError> {
        let vertices = mesh.positions.len();
        if vertices > u32::MAX as usize - 1 {
            return Err(BuildError::TooMany("vertices"));
        }
        if mesh.deforms() && mesh.positions_close.len() != vertices {
            return Err(BuildError::OtherVertices {
                open: vertices,
                close: mesh.positions_close.len(),
            });
        }
        let bad = |p: &Vec3| !p.is_finite() || p.abs().max_element() > MAX_COORDINATE;
        for positions in [&mesh.positions, &mesh.positions_close] {
            if let Some(vertex) = positions.iter().position(bad) {
                return Err(BuildError::BadVertex {
                    vertex,
                    position: positions[vertex],
                });
            }
        }
        check_attributes(&mut mesh)?;
        for (triangle, corners) in mesh.triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
                return Err(BuildError::IndexOutOfRange {
                    triangle,
                    index,
                    vertices,
                });
            }
        }

        let before = mesh.triangles.len();
        let Mesh {
            positions,
            positions_close,
            triangles,
            ..
        } = &mut mesh;
        triangles.retain(|corners| {
            let has_area = |positions: &[Vec3]| {
                let [p0, p1, p2] = corners.map(|i| positions[i as usize]);
                triangle_area(p0, p1, p2) > 0.0
            };
            has_area(positions) || (!positions_close.is_empty() && has_area(positions_close))
        });
        self.report.degenerate_triangles += (before - mesh.triangles.len()) as u64;
        Ok(mesh)
    }

    /// How lights are chosen; by power if this is not called.
    pub fn light_selection(&mut self, mode: SelectionMode) {
        self.selection = mode;
    }

    /// How emitting triangles are sampled; by area if this is not called.
    pub fn triangle_sampling(&mut self, sampling: TriangleSampling) {
        self.triangle_sampling = sampling;
    }

    /// Adds a point light of `intensity` W/sr.
    pub fn add_point_light(&mut self, position: Vec3, intensity: Spectrum) -> Result<(), BuildError> {
        check_position("point", position)?;
        check_light("point", "intensity", intensity)?;
        self.lights.push(Light::Point(PointLight { position, intensity }));
        Ok(())
    }

    /// Adds an environment of the same `radiance` in every direction.
    pub fn add_constant_light(&mut self, radiance: Spectrum) -> Result<(), BuildError> {
        check_light("constant", "radiance", radiance)?;
        self.lights.push(Light::Constant(ConstantLight { radiance }));
        Ok(())
    }

    /// Adds parallel light that travels in `direction`, of `irradiance` W·m⁻² on a surface that faces it.
    pub fn add_directional_light(&mut self, direction: Vec3, irradiance: Spectrum) -> Result<(), BuildError> {
        let direction = unit("directional", direction)?;
        check_light("directional", "irradiance", irradiance)?;
        self.lights
            .push(Light::Directional(DirectionalLight { direction, irradiance }));
        Ok(())
    }

    /// Adds a point light of `intensity` W/sr that shines into the cone around `direction` of half-angle `angle`, and falls off
    /// from half-angle `falloff` on; degrees, `falloff` ≤ `angle` ≤ 90.
    pub fn add_spot_light(
        &mut self,
        position: Vec3,
        direction: Vec3,
        intensity: Spectrum,
        angle: f32,
        falloff: f32,
    ) -> Result<(), BuildError> {
        check_position("spot", position)?;
        let direction = unit("spot", direction)?;
        check_light("spot", "intensity", intensity)?;
        let bad = |key, value: f32, rule| BuildError::BadLight {
            light: "spot",
            key,
            value: value.to_string(),
            rule,
        };
        if !(angle > 0.0 && angle <= 90.0) {
            return Err(bad("angle", angle, "must be above 0 and 90 degrees at most"));
        }
        if !(falloff >= 0.0 && falloff <= angle) {
            return Err(bad("falloff", falloff, "must lie between 0 and the angle"));
        }
        self.lights.push(Light::Spot(SpotLight {
            position,
            direction,
            intensity,
            cos_inner: falloff.to_radians().cos(),
            cos_outer: angle.to_radians().cos(),
        }));
        Ok(())
    }

    /// How textures are looked up; by mip levels if this is not called.
    pub fn texture_filter(&mut self, filter: TextureFilter) {
        self.texture_filter = filter;
    }

    /// Adds an environment whose radiance is that of `image` times `scale`, turned by `rotation`.
    pub fn add_environment(&mut self, image: LatLongImage, scale: f32, rotation: Quat) -> Result<(), BuildError> {
        let bad = |key, value: f32, rule| BuildError::BadLight {
            light: "environment",
            key,
            value: value.to_string(),
            rule,
        };
        if !(scale.is_finite() && scale >= 0.0) {
            return Err(bad("scale", scale, "must be a finite number, 0 or more"));
        }
        if !rotation.is_finite() {
            return Err(bad("rotate", f32::NAN, "must be finite"));
        }
        if image.texels.is_empty() || image.texels.len() != image.width * image.height {
            return Err(bad(
                "image",
                image.texels.len() as f32,
                "must have a texel in each row and column",
            ));
        }
        if let Some(texel) = image.texels.iter().find(|t| !t.is_valid()) {
            return Err(BuildError::BadLight {
                light: "environment",
                key: "image",
                value: format!("{:?}", texel.to_array()),
                rule: "every texel must be finite and 0 or more",
            });
        }
        let light = EnvironmentLight::new(image, scale, rotation);
        self.lights.push(Light::Environment(Box::new(light)));
        Ok(())
    }

    /// The scene's textures. Until now the maps of materials named places in `ids`, where they are told which texture that is; those that
    /// are told `None` are left out.
    pub fn set_textures(&mut self, textures: Vec<Texture>, ids: &[Option<TextureId>]) {
        place_textures(&mut self.materials, |id| ids.get(id.0 as usize).copied().flatten());
        self.textures = textures;
    }

    /// Freezes the scene. One in which nothing emits is lit by a constant environment of radiance 1.
    pub fn build(mut self) -> Result<(Scene, SceneReport), BuildError> {
        // A map of a texture that is not there is none.
        let count = self.textures.len() as u32;
        place_textures(&mut self.materials, |id| (id.0 < count).then_some(id));
        // What emits has no holes: light is sampled all over it.
        for material in self.materials.iter_mut().filter(|m| !m.emission_factor().is_black()) {
            material.opacity = 1.0;
            material.maps.opacity = None;
        }
        let count = self.meshes.len() + self.prototypes.iter().map(Vec::len).sum::<usize>();
        if count >= u32::MAX as usize {
            return Err(BuildError::TooMany("meshes"));
        }
        let mut scene = Scene {
            bounds: self.bounds(),
            meshes: Vec::with_capacity(count),
            prototypes: Vec::with_capacity(self.prototypes.len()),
            instances: Vec::with_capacity(self.instances.len()),
            facets: Vec::with_capacity(count),
            shapes: Vec::with_capacity(count),
            bsdfs: self.materials.iter().map(Material::bsdf).collect(),
            has_holes: self
                .materials
                .iter()
                .any(|m| m.opacity < 1.0 || m.maps.opacity.is_some()),
            is_compact: false,
            is_moving: false,
            textures: self.textures,
            texture_filter: self.texture_filter,
            materials: self.materials,
            lights: Vec::new(),
            infinite_lights: Vec::new(),
            light_selection: LightSelection::new(self.selection, &[], Bounds3::EMPTY, 0.0),
        };

        // Emitting triangles are the first lights: those of one mesh, and of one instance, have consecutive ids.
        let mut emitting = 0;
        for (mesh, material) in self.meshes {
            scene.add_shape(mesh, material, true, &mut emitting);
        }
        let mut of_instances = 0;
        let mut of_prototypes = Vec::with_capacity(self.prototypes.len());
        for meshes in self.prototypes {
            let first = scene.meshes.len() as u32;
            let mut emitting = 0;
            for (mesh, material) in meshes {
                scene.add_shape(mesh, material, false, &mut emitting);
            }
            scene.prototypes.push(first..scene.meshes.len() as u32);
            of_prototypes.push(emitting);
        }
        for (prototype, placement) in self.instances {
            scene.instances.push(Instance {
                prototype: prototype.0,
                placement,
                first_light: LightId((emitting + of_instances).min(u32::MAX as u64) as u32),
            });
            of_instances += of_prototypes[prototype.0 as usize];
        }
        if emitting + of_instances + self.lights.len() as u64 >= u32::MAX as u64 {
            return Err(BuildError::TooMany("lights"));
        }
        let moves = |i: &Instance| i.placement.is_moving();
        scene.is_moving = scene.instances.iter().any(moves) || scene.meshes.iter().any(Mesh::deforms);
        scene.add_triangle_lights(self.triangle_sampling);
        scene.lights.append(&mut self.lights);
        if scene.lights.iter().all(|light| light.power(1.0) == 0.0) {
            self.report.default_light = true;
            scene.lights.push(Light::Constant(ConstantLight {
                radiance: Spectrum::ONE,
            }));
        }

        let ids = (0..scene.lights.len() as u32).map(LightId);
        scene.infinite_lights = ids
            .filter(|id| matches!(scene.lights[id.0 as usize], Light::Constant(_) | Light::Environment(_)))
            .collect();
        // A scene without extent still has a sky of some power.
        let radius = Some(scene.bounds.radius()).filter(|&r| r > 0.0).unwrap_or(1.0);
        scene.light_selection = LightSelection::new(self.selection, &scene.lights, scene.bounds, radius);
        Ok((scene, self.report))
    }
}

impl SceneBuilder {
    /// Box around all that is ever in the world.
    fn bounds(&self) -> Bounds3 {
        let standing = self.meshes.iter().flat_map(|(m, _)| used_positions(m));
        let mut bounds: Bounds3 = standing.collect();
        let of_prototypes: Vec<Bounds3> = self.prototypes.iter().map(|p| bounds_of(p)).collect();
        for (prototype, placement) in &self.instances {
            let placed = placement.bounds(of_prototypes[prototype.0 as usize]);
            bounds.extend(placed.min);
            bounds.extend(placed.max);
        }
        bounds
    }
}

impl Scene {
    /// Adds a mesh that stands in the world, or is part of a prototype. `emitting` counts the triangles that emit.
    fn add_shape(&mut self, mesh: Mesh, material: MaterialId, is_standing: bool, emitting: &mut u64) {
        let surface = &self.materials[material.0 as usize];
        let keeps_place = is_standing && !mesh.deforms();
        let varies = surface.maps.varies_bsdf() || surface.maps.has_relief() || surface.is_anisotropic();
        let is_uniform = mesh.normals.is_empty() && !varies;
        let first_light = (!surface.emission_factor().is_black()).then_some(LightId(*emitting as u32));
        if first_light.is_some() {
            *emitting += mesh.triangles.len() as u64;
        }
        // Where triangles move, what their points share does so too.
        let prims = 0..mesh.triangles.len() as u32;
        self.facets.push(match keeps_place {
            true => prims.map(|prim| mesh.facet(PrimId(prim))).collect(),
            false => Vec::new(),
        });
        self.meshes.push(mesh);
        self.shapes.push(Shape {
            material,
            is_plain: keeps_place && is_uniform,
            first_light,
        });
    }

    /// Makes a light of each emitting triangle, in the order of their ids.
    fn add_triangle_lights(&mut self, sampling: TriangleSampling) {
        for geom in self.standing() {
            self.add_lights_of(GeomId(geom), InstanceId::NONE, sampling);
        }
        for inst in 0..self.instances.len() {
            for geom in self.prototypes[self.instances[inst].prototype as usize].clone() {
                self.add_lights_of(GeomId(geom), InstanceId(inst as u32), sampling);
            }
        }
    }

    fn add_lights_of(&mut self, geom: GeomId, inst: InstanceId, sampling: TriangleSampling) {
        let shape = self.shape(geom);
        if shape.first_light.is_none() {
            return;
        }
        let material = &self.materials[shape.material.0 as usize];
        let radiance = material.emission_factor();
        let mesh = &self.meshes[geom.0 as usize];
        let placement = self.instance(inst).map(|i| &i.placement);
        let is_moving = mesh.deforms() || placement.is_some_and(Placement::is_moving);
        let light = |prim| match placement {
            _ if is_moving => {
                let ends = [0.0, 1.0].map(|time| mesh.corners_at(prim, time));
                let placement = placement.cloned().unwrap_or(Placement::Still(Affine3A::IDENTITY));
                Light::MovingTriangle(Box::new(MovingTriangle::new(ends, placement, radiance, sampling)))
            }
            None => Light::Triangle(TriangleLight::new(mesh.corners(prim), radiance, sampling)),
            Some(placement) => {
                let placed = PlacedTriangle::new(mesh.corners(prim), None, Some(placement.at(0.0)));
                Light::Triangle(TriangleLight::placed(&placed, radiance, sampling))
            }
        };
        let varied = |prim| match material.maps.emission {
            Some(Map { texture, mapping }) => {
                let uvs = mesh.corner_uvs(prim).unwrap_or_default();
                light(prim).textured(uvs, texture, mapping, &self.textures)
            }
            None => light(prim),
        };
        let lights: Vec<Light> = (0..mesh.triangles.len() as u32).map(PrimId).map(varied).collect();
        self.lights.extend(lights);
    }
}

/// Gives every map the texture that `place` says, or none.
fn place_textures(materials: &mut [Material], place: impl Fn(TextureId) -> Option<TextureId>) {
    for map in materials.iter_mut().flat_map(|m| m.maps.iter_mut()) {
        *map = map.and_then(|map| place(map.texture).map(|texture| Map { texture, ..map }));
    }
}

fn check_position(light: &'static str, position: Vec3) -> Result<(), BuildError> {
    if position.is_finite() {
        return Ok(());
    }
    Err(BuildError::BadLight {
        light,
        key: "position",
        value: format!("{:?}", position.to_array()),
        rule: "coordinates must be finite",
    })
}

fn unit(light: &'static str, direction: Vec3) -> Result<Vec3, BuildError> {
    direction.try_normalize().ok_or(BuildError::BadLight {
        light,
        key: "direction",
        value: format!("{:?}", direction.to_array()),
        rule: "must be finite and not zero",
    })
}

fn check_material(material: &Material) -> Result<(), BuildError> {
    let bad = |key, value: String, rule| BuildError::BadMaterial {
        material: material.name.clone(),
        key,
        value,
        rule,
    };
    for (key, color) in [
        ("diffuse", material.diffuse),
        ("specular", material.specular),
        ("transmission", material.transmission),
        ("emission", material.emission),
        ("sheen", material.sheen),
    ] {
        if !color.is_valid() {
            let value = format!("{:?}", color.to_array());
            return Err(bad(key, value, "finite and 0 or more in every channel"));
        }
    }
    for (key, share) in [
        ("opacity", material.opacity),
        ("anisotropy", material.anisotropy),
        ("clearcoat", material.clearcoat),
        ("clearcoat_roughness", material.clearcoat_roughness),
        ("sheen", material.sheen.max_component()),
    ] {
        if !(0.0..=1.0).contains(&share) {
            return Err(bad(key, share.to_string(), "between 0 and 1"));
        }
    }
    if !material.anisotropy_rotation.is_finite() {
        let value = material.anisotropy_rotation.to_string();
        return Err(bad("anisotropy_rotation", value, "finite"));
    }
    let (exponent, fresnel) = match material.gloss {
        Gloss::Phong(n) => (n, Fresnel::Full),
        Gloss::Blinn(n, fresnel) => (n, fresnel),
        Gloss::Ggx(fresnel) | Gloss::Mirror(fresnel) => (0.0, fresnel),
        Gloss::Metallic(_) => (0.0, Fresnel::Full),
    };
    let metallic = match material.gloss {
        Gloss::Metallic(metallic) => metallic,
        _ => 0.0,
    };
    for (key, share) in [("roughness", material.roughness), ("metallic", metallic)] {
        if !(0.0..=1.0).contains(&share) {
            return Err(bad(key, share.to_string(), "a number from 0 to 1"));
        }
    }
    if !(exponent.is_finite() && exponent >= 0.0) {
        return Err(bad("exponent", exponent.to_string(), "finite and 0 or more"));
    }
    if let Fresnel::Schlick { f0 } = fresnel {
        if !f0.iter().all(|f0| (0.0..=1.0).contains(f0)) {
            return Err(bad("f0", format!("{f0:?}"), "numbers from 0 to 1"));
        }
    }
    let (eta, k) = match fresnel {
        Fresnel::Full | Fresnel::Schlick { .. } => ([1.0; 3], [0.0; 3]),
        Fresnel::Dielectric { eta } => ([eta; 3], [0.0; 3]),
        Fresnel::Conductor { eta, k } => (eta, k),
    };
    for (key, index) in [("ior", [material.ior; 3]), ("eta", eta)] {
        if !index.iter().all(|n| n.is_finite() && *n > 0.0) {
            return Err(bad(key, format!("{index:?}"), "finite and above 0"));
        }
    }
    if !k.iter().all(|n| n.is_finite() && *n >= 0.0) {
        return Err(bad("k", format!("{k:?}"), "finite and 0 or more"));
    }
    Ok(())
}

/// Normals are made unit vectors. Attributes are there for every vertex or for none.
fn check_attributes(mesh: &mut Mesh) -> Result<(), BuildError> {
    let vertices = mesh.positions.len();
    let bad = |attribute, vertex| Err(BuildError::BadAttribute { vertex, attribute });
    if !mesh.uvs.is_empty() {
        let wrong = mesh.uvs.iter().position(|uv| !uv.is_finite());
        let missing = (mesh.uvs.len() != vertices).then_some(mesh.uvs.len().min(vertices));
        if let Some(vertex) = wrong.or(missing) {
            return bad("texture coordinate", vertex);
        }
    }
    if !mesh.normals.is_empty() {
        for (vertex, normal) in mesh.normals.iter_mut().enumerate() {
            match normal.try_normalize() {
                Some(unit) => *normal = unit,
                None => return bad("normal", vertex),
            }
        }
        if mesh.normals.len() != vertices {
            return bad("normal", mesh.normals.len().min(vertices));
        }
    }
    // Without normals at one end there are none at the other.
    if mesh.normals.is_empty() || mesh.normals_close.len() != vertices {
        mesh.normals_close = Vec::new();
    }
    for normal in &mut mesh.normals_close {
        *normal = normal.normalize_or_zero();
    }
    Ok(())
}

fn check_light(light: &'static str, key: &'static str, value: Spectrum) -> Result<(), BuildError> {
    if value.is_valid() {
        return Ok(());
    }
    Err(BuildError::BadLight {
        light,
        key,
        value: format!("{:?}", value.to_array()),
        rule: "every channel must be a finite number, 0 or more",
    })
}

fn used_positions(mesh: &Mesh) -> impl Iterator<Item = Vec3> {
    let places = [&mesh.positions, &mesh.positions_close];
    let used = mesh.triangles.iter().flatten();
    used.flat_map(move |&i| places.into_iter().filter_map(move |p| p.get(i as usize).copied()))
}

fn bounds_of(meshes: &[(Mesh, MaterialId)]) -> Bounds3 {
    meshes.iter().flat_map(|(m, _)| used_positions(m)).collect()
}

impl Scene {
    /// Id of each mesh.
    pub fn geom_ids(&self) -> impl Iterator<Item = GeomId> {
        (0..self.meshes.len() as u32).map(GeomId)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(diffuse: f32, emission: f32) -> Material {
        Material {
            name: "m".into(),
            diffuse: Spectrum::splat(diffuse),
            emission: Spectrum::splat(emission),
            ..Material::default()
        }
    }

    fn mesh(triangles: Vec<[u32; 3]>) -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(2.0, 0.0, 0.0)],
            triangles,
            ..Mesh::default()
        }
    }

    #[test]
    fn bad_input_is_named() {
        let mut b = SceneBuilder::new();
        let m = b.add_material(material(0.5, 0.0)).unwrap();
        let error = b.add_mesh(mesh(vec![[0, 1, 2], [0, 1, 4]]), m).unwrap_err();
        assert_eq!(
            error,
            BuildError::IndexOutOfRange {
                triangle: 1,
                index: 4,
                vertices: 4
            }
        );
        for bad in [f32::NAN, f32::INFINITY, 1e19] {
            let mut broken = mesh(vec![[0, 1, 2]]);
            broken.positions[2].y = bad;
            assert!(matches!(
                b.add_mesh(broken, m),
                Err(BuildError::BadVertex { vertex: 2, .. })
            ));
        }
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            assert!(b.add_material(material(bad, 0.0)).is_err());
            assert!(b.add_material(material(0.5, bad)).is_err());
            assert!(b.add_constant_light(Spectrum::splat(bad)).is_err());
            assert!(b.add_point_light(Vec3::ZERO, Spectrum::splat(bad)).is_err());
        }
        assert!(b.add_point_light(Vec3::NAN, Spectrum::ONE).is_err());
    }

    #[test]
    fn materials_that_cannot_be_are_refused() {
        let mut b = SceneBuilder::new();
        let base = Material::default;
        let metal = |eta, k| {
            Gloss::Mirror(Fresnel::Conductor {
                eta: [eta; 3],
                k: [k; 3],
            })
        };
        for (bad, key) in [
            (
                Material {
                    specular: Spectrum::splat(-0.1),
                    ..base()
                },
                "specular",
            ),
            (
                Material {
                    transmission: Spectrum::splat(f32::NAN),
                    ..base()
                },
                "transmission",
            ),
            (Material { ior: 0.0, ..base() }, "ior"),
            (
                Material {
                    gloss: Gloss::Phong(-1.0),
                    ..base()
                },
                "exponent",
            ),
            (
                Material {
                    gloss: Gloss::Blinn(f32::INFINITY, Fresnel::Full),
                    ..base()
                },
                "exponent",
            ),
            (
                Material {
                    gloss: metal(0.0, 1.0),
                    ..base()
                },
                "eta",
            ),
            (
                Material {
                    gloss: metal(1.0, -1.0),
                    ..base()
                },
                "k",
            ),
            (
                Material {
                    gloss: Gloss::Metallic(1.5),
                    ..base()
                },
                "metallic",
            ),
            (
                Material {
                    roughness: f32::NAN,
                    ..base()
                },
                "roughness",
            ),
            (
                Material {
                    clearcoat: 1.5,
                    ..base()
                },
                "clearcoat",
            ),
            (
                Material {
                    clearcoat_roughness: f32::NAN,
                    ..base()
                },
                "clearcoat_roughness",
            ),
            (
                Material {
                    sheen: Spectrum::rgb(0.0, 1.5, 0.0),
                    ..base()
                },
                "sheen",
            ),
            (
                Material {
                    anisotropy: -0.5,
                    ..base()
                },
                "anisotropy",
            ),
            (
                Material {
                    anisotropy_rotation: f32::INFINITY,
                    ..base()
                },
                "anisotropy_rotation",
            ),
            (
                Material {
                    gloss: Gloss::Ggx(Fresnel::Schlick { f0: [0.5, -0.1, 0.5] }),
                    ..base()
                },
                "f0",
            ),
        ] {
            let error = b.add_material(bad).unwrap_err();
            assert!(error.to_string().contains(&format!("{key} is")), "{error}");
        }
    }

    #[test]
    fn mixtures_keep_their_energy() {
        let mut b = SceneBuilder::new();
        let glossy = Material {
            specular: Spectrum::splat(0.6),
            transmission: Spectrum::rgb(0.6, 0.0, 0.0),
            ..material(0.8, 0.0)
        };
        b.add_material(glossy).unwrap();
        let (scene, report) = b.build().unwrap();
        assert_eq!(report.scaled_materials, [("m".to_string(), 2.0)]);
        let m = &scene.materials()[0];
        assert_eq!((m.diffuse, m.specular.to_array()[1]), (Spectrum::splat(0.4), 0.3));
        assert_eq!(scene.bsdfs[0].lobes().count(), 3);
    }

    #[test]
    fn a_coat_and_its_base_share_the_light() {
        let mut b = SceneBuilder::new();
        let white = Material::metallic_roughness(Spectrum::ONE, 0.5, 0.3);
        b.add_material(white.clone()).unwrap();
        b.add_material(Material {
            transmission: Spectrum::ONE,
            ..white
        })
        .unwrap();
        let (scene, report) = b.build().unwrap();
        assert_eq!(report.scaled_materials, [(String::new(), 2.0)]);
        assert_eq!(scene.materials()[0].diffuse, Spectrum::ONE);
        assert_eq!(scene.materials()[1].specular, Spectrum::splat(0.5));
    }

    #[test]
    fn repairs_are_reported() {
        let mut b = SceneBuilder::new();
        let m = b.add_material(material(2.0, 0.0)).unwrap();
        b.add_mesh(mesh(vec![[0, 1, 2], [0, 0, 2], [0, 1, 3]]), m).unwrap();
        let (scene, report) = b.build().unwrap();
        assert_eq!(report.degenerate_triangles, 2);
        assert_eq!(report.scaled_materials, [("m".to_string(), 2.0)]);
        assert!(report.default_light);
        assert_eq!(scene.materials()[0].diffuse, Spectrum::ONE);
        assert_eq!((scene.triangle_count(), scene.lights().len()), (1, 1));
        assert_eq!(scene.bounds().max, Vec3::new(1.0, 1.0, 0.0));
    }

    #[test]
    fn emitting_triangles_have_consecutive_ids() {
        let mut b = SceneBuilder::new();
        let dark = b.add_material(material(0.5, 0.0)).unwrap();
        let lit = b.add_material(material(0.5, 3.0)).unwrap();
        b.add_point_light(Vec3::Z, Spectrum::ONE).unwrap();
        b.add_mesh(mesh(vec![[0, 1, 2], [2, 1, 3]]), lit).unwrap();
        b.add_mesh(mesh(vec![[0, 1, 2]]), dark).unwrap();
        b.add_mesh(mesh(vec![[0, 1, 2]]), lit).unwrap();
        let (scene, report) = b.build().unwrap();
        assert!(!report.default_light);
        let first: Vec<_> = scene
            .geom_ids()
            .map(|g| scene.shape(g).first_light.map(|l| l.0))
            .collect();
        assert_eq!(first, [Some(0), None, Some(2)]);
        assert_eq!(scene.lights().len(), 4);
        let receiver = crate::light::Receiver::any_side(Vec3::ONE);
        let total: f32 = (0..4)
            .map(|i| scene.light_selection().pmf(scene.lights(), &receiver, LightId(i)))
            .sum();
        assert!((total - 1.0).abs() < 1e-6);
    }
}
