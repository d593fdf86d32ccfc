//! Builder of scenes, which validates all parts. `freeze.rs` makes the scene from the validated
//! parts.

use super::duplicates::{CoincidentEmitters, TriangleSamples, remove_repeated_triangles};
use super::ground::GroundPlane;
use super::recognise::Panes;
use super::validate::{BuildError, check_extent, check_material, check_mesh, check_placement, remove_degenerate};
use crate::color::Spectrum;
use crate::geometry::{Mesh, PartNames, Placement};
use crate::light::{AreaLight, EnvironmentLight, Light, LightGroupId, TriangleSampling};
use crate::material::{Map, Material, MaterialId};
use crate::math::{Bounds3, Vec3};
use crate::texture::{Texture, TextureFilter, TextureId};
use std::collections::HashMap;

/// Parts that the builder left out, and assumptions that it made. Each nonzero entry should be
/// reported to the user.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneReport {
    /// Number of triangles without area, which are left out.
    pub degenerate_triangles: u64,
    /// Materials that were scaled down because their lobes summed to more than 1 in some channel.
    /// Each entry has the material's name, and the largest sum over all channels.
    pub scaled_materials: Vec<(String, f32)>,
    /// True if nothing emitted light, so that a constant environment of radiance 1 was added.
    pub default_light: bool,
    /// Number of triangles that are bit-identical to another triangle of their mesh. They are left
    /// out.
    pub repeated_triangles: u64,
    /// Number of instances that are bit-identical to another instance. They are left out.
    pub repeated_instances: u64,
    /// Emitting triangles that coincide with other emitting triangles.
    pub coincident_emitters: CoincidentEmitters,
    /// Largest number of triangles of different meshes that coincide at one place. 0 if this number
    /// is below [`MANY_COINCIDENT`](super::MANY_COINCIDENT).
    pub coincident_triangles: u64,
    /// Number of triangles without area whose material emits. They are left out.
    pub degenerate_emitters: u64,
    /// True if no light emits, although the input has lights or emitting triangles. Triangles
    /// without area, which are left out, count too.
    pub is_dark: bool,
    /// Number of panes of glass that became thin dielectrics. Panes of a prototype count once.
    pub panes: u64,
    /// Number of rectangles of two emitting triangles that became one light each.
    pub rectangles: u64,
}

/// Index of a prototype. A prototype is a group of meshes that instances place in the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrototypeId(pub(super) u32);

/// Collects validated parts and freezes them into a [`Scene`](super::Scene).
#[derive(Debug, Default)]
pub struct SceneBuilder {
    /// Names of objects. New meshes and instances belong to the last object.
    pub(super) objects: Vec<String>,
    /// Object names in use, each with the last number that was appended to make it unique.
    object_names: HashMap<String, u32>,
    /// Names of the parts of all meshes.
    pub(super) parts: PartNames,
    pub(super) meshes: Vec<(Mesh, MaterialId)>,
    /// Index of the object of each mesh.
    pub(super) mesh_objects: Vec<u32>,
    pub(super) prototypes: Vec<Vec<(Mesh, MaterialId)>>,
    pub(super) instances: Vec<(PrototypeId, Placement)>,
    /// Index of the object of each instance.
    pub(super) instance_objects: Vec<u32>,
    pub(super) materials: Vec<Material>,
    /// Copies of materials that are hidden from the camera. The key is the original material.
    pub(super) hidden: HashMap<MaterialId, MaterialId>,
    pub(super) textures: Vec<Texture>,
    pub(super) texture_filter: TextureFilter,
    /// Lights, each with its group if it has one.
    pub(super) lights: Vec<(Light, Option<LightGroupId>)>,
    /// Environment light of each sky. The key has the bits of two f32 numbers: the sun's elevation
    /// and the turbidity.
    pub(super) skies: HashMap<[u32; 2], EnvironmentLight>,
    /// Names of light groups.
    pub(super) light_groups: Vec<String>,
    pub(super) light_group: Option<LightGroupId>,
    /// Light group of each emitting material that has a group.
    pub(super) material_groups: HashMap<MaterialId, LightGroupId>,
    /// Lights whose surface is a whole mesh, such as sphere lights. The key is the material of the
    /// mesh.
    pub(super) lamps: HashMap<MaterialId, AreaLight>,
    pub(super) triangle_sampling: TriangleSampling,
    pub(super) ground: Option<GroundPlane>,
    pub(super) panes: Panes,
    /// Hashes of some triangles of all meshes, to find coincident triangles.
    pub(super) samples: TriangleSamples,
    pub(super) report: SceneReport,
}

impl SceneBuilder {
    /// Copy of this builder without meshes and textures.
    pub(super) fn without_parts(&self) -> Self {
        Self {
            objects: self.objects.clone(),
            object_names: self.object_names.clone(),
            parts: PartNames::default(),
            meshes: Vec::new(),
            mesh_objects: self.mesh_objects.clone(),
            prototypes: Vec::new(),
            instances: self.instances.clone(),
            instance_objects: self.instance_objects.clone(),
            materials: self.materials.clone(),
            hidden: self.hidden.clone(),
            textures: Vec::new(),
            texture_filter: self.texture_filter,
            lights: self.lights.clone(),
            skies: self.skies.clone(),
            light_groups: self.light_groups.clone(),
            light_group: self.light_group,
            material_groups: self.material_groups.clone(),
            lamps: self.lamps.clone(),
            triangle_sampling: self.triangle_sampling,
            ground: self.ground,
            panes: self.panes,
            samples: self.samples.clone(),
            report: self.report.clone(),
        }
    }

    /// An empty builder.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a material. If its lobes sum to more than 1 in some channel, they are scaled down, and
    /// the report lists the material. If textures vary the lobes, they are scaled at each lookup
    /// instead.
    pub fn add_material(&mut self, mut material: Material) -> Result<MaterialId, BuildError> {
        check_material(&material)?;
        let scattered = material.scattered();
        let varies = material.maps.varies_bsdf();
        if !varies {
            material.scale_to_one();
        }
        // Do not report a sum that is above 1 only because of rounding
        if scattered > 1.0 + 4.0 * f32::EPSILON && !varies {
            self.report.scaled_materials.push((material.name.clone(), scattered));
        }
        self.materials.push(material);
        Ok(MaterialId(self.materials.len() as u32 - 1))
    }

    /// Adds triangles of one material to the world. Triangles without area and repeated triangles
    /// are left out and reported.
    pub fn add_mesh(&mut self, mesh: Mesh, material: MaterialId) -> Result<(), BuildError> {
        let mesh = self.checked(mesh, material)?;
        self.add_checked_mesh(mesh, material);
        Ok(())
    }

    /// Adds a mesh that was checked before.
    pub(super) fn add_checked_mesh(&mut self, mesh: Mesh, material: MaterialId) {
        if !mesh.triangles.is_empty() {
            self.meshes.push((mesh, material));
            self.mesh_objects.push(self.object());
        }
    }

    /// Starts an object. All parts that are added before the next call belong to this object. If
    /// the name is in use, a number is appended.
    pub fn begin_object(&mut self, name: &str) {
        // Continue after the last number of this name, so that thousands of equal names take no
        // longer than different names
        let mut number = self.object_names.get(name).copied().unwrap_or(0);
        let unique = loop {
            number += 1;
            let candidate = match number {
                1 => name.to_string(),
                n => format!("{name}.{n}"),
            };
            if !self.object_names.contains_key(&candidate) {
                break candidate;
            }
        };
        self.object_names.insert(name.to_string(), number);
        self.object_names.entry(unique.clone()).or_insert(1);
        self.objects.push(unique);
    }

    /// Adds names of parts to the scene. Before the call, the part of each triangle of `meshes` is
    /// an index into `names`. The call replaces it by an index into the names of the scene. Equal
    /// names become the same part.
    pub fn add_parts<'m>(&mut self, names: PartNames, meshes: impl Iterator<Item = &'m mut Mesh>) {
        if self.parts.is_empty() {
            self.parts = names;
            return;
        }
        let numbers = self.parts.append(&names);
        for part in meshes.flat_map(|mesh| &mut mesh.parts) {
            *part = numbers[*part as usize];
        }
    }

    /// Names of the parts of all meshes that were added.
    pub fn part_names(&self) -> &PartNames {
        &self.parts
    }

    /// Index of the object to which new meshes and instances belong.
    fn object(&self) -> u32 {
        self.objects.len().saturating_sub(1) as u32
    }

    /// Adds a prototype: meshes that are stored once. [`SceneBuilder::add_instance`] can place the
    /// prototype in the world any number of times.
    pub fn add_prototype(&mut self, meshes: Vec<(Mesh, MaterialId)>) -> Result<PrototypeId, BuildError> {
        let mut checked = Vec::with_capacity(meshes.len());
        for (mesh, material) in meshes {
            let mesh = self.checked(mesh, material)?;
            if !mesh.triangles.is_empty() {
                checked.push((mesh, material));
            }
        }
        check_extent("an object that is instanced", bounds_of(&checked))?;
        self.prototypes.push(checked);
        Ok(PrototypeId(self.prototypes.len() as u32 - 1))
    }

    /// Places a prototype in the world.
    pub fn add_instance(&mut self, prototype: PrototypeId, placement: Placement) -> Result<(), BuildError> {
        let bounds = bounds_of(&self.prototypes[prototype.0 as usize]);
        check_placement(self.instances.len(), &placement, bounds)?;
        if self.instances.len() >= u32::MAX as usize - 1 {
            return Err(BuildError::TooMany("instances"));
        }
        self.instances.push((prototype, placement));
        self.instance_objects.push(self.object());
        Ok(())
    }

    /// Checks the mesh. Removes repeated triangles, and triangles that have no area at any time.
    fn checked(&mut self, mut mesh: Mesh, material: MaterialId) -> Result<Mesh, BuildError> {
        check_mesh(&mut mesh)?;
        let removed = remove_degenerate(&mut mesh);
        self.report.degenerate_triangles += removed;
        self.report.repeated_triangles += remove_repeated_triangles(&mut mesh, &mut self.samples);
        let material = self.materials.get(material.0 as usize);
        if material.is_some_and(|material| !material.emission_factor().is_black()) {
            self.report.degenerate_emitters += removed;
        }
        Ok(mesh)
    }

    /// Adds a plane that catches shadows. The scene's bounds and report do not include the plane.
    pub fn set_ground(&mut self, plane: GroundPlane) -> Result<(), BuildError> {
        plane.check()?;
        self.ground = Some(plane);
        Ok(())
    }

    /// Returns true if the diffuse or base colour of `material` has a texture.
    pub fn has_diffuse_map(&self, material: MaterialId) -> bool {
        let material = self.materials.get(material.0 as usize);
        material.is_some_and(|material| material.maps.diffuse.is_some())
    }

    /// Returns true if `material` emits light and is opaque everywhere.
    pub fn is_opaque_lamp(&self, material: MaterialId) -> bool {
        let material = self.materials.get(material.0 as usize);
        material.is_some_and(|material| {
            let is_opaque = material.opacity == 1.0 && material.maps.opacity.is_none() && !material.maps.vertex_alpha;
            is_opaque && !material.emission_factor().is_black()
        })
    }

    /// Returns true if `material` emits light, and no light enters its surface.
    pub fn is_lamp_without_transmission(&self, material: MaterialId) -> bool {
        let material = self.materials.get(material.0 as usize);
        material.is_some_and(|material| !material.emission_factor().is_black() && material.transmission.is_black())
    }

    /// Number of materials added.
    pub fn material_count(&self) -> usize {
        self.materials.len()
    }

    /// Sets the treatment of thin glass. By default, light passes through thin glass without a
    /// change of direction.
    pub fn panes(&mut self, panes: Panes) {
        self.panes = panes;
    }

    /// Sets the filter of texture lookups; the default is mip levels.
    pub fn texture_filter(&mut self, filter: TextureFilter) {
        self.texture_filter = filter;
    }

    /// Returns a copy of the material `id` that is hidden from the camera, or `id` if the material
    /// is already hidden.
    pub fn hidden_material(&mut self, id: MaterialId) -> MaterialId {
        if let Some(&hidden) = self.hidden.get(&id) {
            return hidden;
        }
        let material = &self.materials[id.0 as usize];
        if !material.camera_visible {
            return id;
        }
        let material = Material {
            camera_visible: false,
            ..material.clone()
        };
        let hidden = MaterialId(self.materials.len() as u32);
        self.materials.push(material);
        self.hidden.insert(id, hidden);
        if let Some(&group) = self.material_groups.get(&id) {
            self.material_groups.insert(hidden, group);
        }
        hidden
    }

    /// The material from which [`SceneBuilder::hidden_material`] made the copy `hidden`. `None` if
    /// this function did not make `hidden`.
    pub fn copied_material(&self, hidden: MaterialId) -> Option<MaterialId> {
        let mut copies = self.hidden.iter();
        copies.find(|(_, copy)| **copy == hidden).map(|(id, _)| *id)
    }

    /// Sets the opacity of a material and of its hidden copy.
    pub fn set_opacity(&mut self, id: MaterialId, opacity: f32) {
        for id in [Some(id), self.hidden.get(&id).copied()].into_iter().flatten() {
            if let Some(material) = self.materials.get_mut(id.0 as usize) {
                material.opacity = opacity;
            }
        }
    }

    /// Sets the diffuse colour of a material and of its hidden copy.
    pub fn set_diffuse(&mut self, id: MaterialId, diffuse: Spectrum) {
        for id in [Some(id), self.hidden.get(&id).copied()].into_iter().flatten() {
            if let Some(material) = self.materials.get_mut(id.0 as usize) {
                material.diffuse = diffuse;
            }
        }
    }

    /// Exchanges the bump map and the normal map of a material, for files that confuse both kinds
    /// of map. Each map keeps its mapping of texture coordinates.
    pub fn exchange_bumps(&mut self, id: MaterialId) {
        for id in [Some(id), self.hidden.get(&id).copied()].into_iter().flatten() {
            if let Some(material) = self.materials.get_mut(id.0 as usize) {
                let maps = &mut material.maps;
                std::mem::swap(&mut maps.bump, &mut maps.normal);
            }
        }
    }

    /// Sets the scene's textures. Before this call, the texture id of each map is an index into
    /// `ids`. This call replaces it by the id that is stored there. If that id is `None`, the map
    /// is removed.
    pub fn set_textures(&mut self, textures: Vec<Texture>, ids: &[Option<TextureId>]) {
        place_textures(&mut self.materials, |id| ids.get(id.0 as usize).copied().flatten());
        self.textures = textures;
    }
}

/// Replaces the texture of every map by the result of `place`. If the result is `None`, the map is
/// removed.
pub(super) fn place_textures(materials: &mut [Material], place: impl Fn(TextureId) -> Option<TextureId>) {
    for map in materials.iter_mut().flat_map(|m| m.maps.iter_mut()) {
        *map = map.and_then(|map| place(map.texture).map(|texture| Map { texture, ..map }));
    }
}

/// Positions of the vertices that triangles of `mesh` use, at shutter open and at shutter close.
pub(super) fn used_positions(mesh: &Mesh) -> impl Iterator<Item = Vec3> {
    let places = [&mesh.positions, &mesh.positions_close];
    let used = mesh.triangles.iter().flatten();
    used.flat_map(move |&i| places.into_iter().filter_map(move |p| p.get(i as usize).copied()))
}

/// Box around `meshes` at all times.
pub(super) fn bounds_of(meshes: &[(Mesh, MaterialId)]) -> Bounds3 {
    meshes.iter().flat_map(|(m, _)| used_positions(m)).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::light::LightId;

    pub(in crate::scene) fn material(diffuse: f32, emission: f32) -> Material {
        Material {
            name: "m".into(),
            diffuse: Spectrum::splat(diffuse),
            emission: Spectrum::splat(emission),
            ..Material::default()
        }
    }

    pub(in crate::scene) fn mesh(triangles: Vec<[u32; 3]>) -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(2.0, 0.0, 0.0)],
            triangles,
            ..Mesh::default()
        }
    }

    #[test]
    fn invalid_input_is_an_error() {
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
    fn lobes_above_one_are_scaled_down() {
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
    fn coat_and_base_are_scaled_with_transmission_only() {
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
        let context = crate::light_sampling::LightSampleContext::any_side(Vec3::ONE);
        let selection = scene.light_selection(crate::light_sampling::LightChoice::default());
        let total: f32 = (0..4)
            .map(|i| selection.pmf(scene.lights(), &context, LightId(i)))
            .sum();
        assert!((total - 1.0).abs() < 1e-6);
    }

    #[test]
    fn equal_object_names_get_numbers() {
        let mut b = SceneBuilder::new();
        for name in ["a", "a.3", "a", "b", "a", "a.3"] {
            b.begin_object(name);
        }
        assert_eq!(b.objects, ["a", "a.3", "a.2", "b", "a.4", "a.3.2"]);
    }
}
