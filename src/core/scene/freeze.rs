//! Makes the frozen scene from the parts of the builder: arrays of meshes, and the lights of
//! emitting surfaces.

use super::builder::{SceneBuilder, SceneReport, bounds_of, place_textures, used_positions};
use super::duplicates::remove_repeated_instances;
use super::ground::Ground;
use super::recognise::{self, EmitterShape, FlatPanes, Panes, max_thickness};
use super::validate::{BuildError, check_extent, check_reach};
use super::{Instance, LightNumbering, Scene, Shape};
use crate::color::Spectrum;
use crate::geometry::{Facet, GeomId, InstanceId, Mesh, PlacedTriangle, Placement, PrimId};
use crate::light::{
    AreaLight, ConstantLight, Light, LightGroupId, LightGroups, LightId, MovingTriangle, RectangleLight, RoundLight,
    TriangleLight, TriangleSampling, Variation,
};
use crate::material::{Map, Material, MaterialId, ThinSurface};
use crate::math::{Affine3A, Bounds3};
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// Name of the object of a scene for which [`SceneBuilder::begin_object`] was never called.
const ONLY_OBJECT: &str = "scene";

/// Bytes of memory for an emitting triangle, including its entry in the light selection and the
/// unused capacity of growing lists.
const BYTES_OF_A_LIGHT: u64 = 3 * size_of::<Light>() as u64 + 100;

/// Two maps from a material: to the light group of its surfaces, and to the light whose surface is
/// a whole mesh of this material.
type LightsOfMaterials<'a> = (
    &'a HashMap<MaterialId, LightGroupId>,
    &'a HashMap<MaterialId, AreaLight>,
);

impl SceneBuilder {
    /// Freezes the scene. If a scene has no lights and no emitting surfaces, a constant environment
    /// of radiance 1 is added. A scene whose lights emit nothing stays dark.
    pub fn build(mut self) -> Result<(Scene, SceneReport), BuildError> {
        // Remove maps of missing textures.
        let count = self.textures.len() as u32;
        place_textures(&mut self.materials, |id| (id.0 < count).then_some(id));
        for (mesh, material) in self.meshes.iter().chain(self.prototypes.iter().flatten()) {
            let maps = &mut self.materials[material.0 as usize].maps;
            maps.vertex_color |= !mesh.colors.is_empty();
            maps.vertex_alpha |= !mesh.alphas.is_empty();
        }
        let count = self.meshes.len() + self.prototypes.iter().map(Vec::len).sum::<usize>();
        if count >= u32::MAX as usize {
            return Err(BuildError::TooMany("meshes"));
        }
        let objects = &mut self.instance_objects;
        self.report.repeated_instances =
            remove_repeated_instances(&mut self.instances, objects, |prototype| prototype.0);
        // Compare the triangles of each prototype with each other, and the triangles of all other
        // meshes with each other. Placed instances are not compared
        let groups = self.prototypes.iter().chain([&self.meshes]);
        self.report.coincident_triangles = self.samples.largest_coincidence(groups.map(Vec::as_slice));
        self.widen_hulls();
        let bounds = self.bounds();
        check_extent("the scene", bounds)?;
        if self.panes == Panes::Straight {
            self.flatten_panes(bounds);
        }
        let ground = self.ground.map(|plane| plane.place(bounds)).transpose()?;
        let ground = ground.map(|plane| (plane, self.add_ground(plane.material())));
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        for (i, (_, placement)) in self.instances.iter().enumerate() {
            check_reach(i, placement, largest)?;
        }
        let is_straight = self.panes == Panes::Straight;
        let surface = |material: &Material| material.thin_surface().filter(|_| is_straight);
        let thin_surfaces: Vec<Option<ThinSurface>> = self.materials.iter().map(surface).collect();
        let stopped = |material: &Material| material.stopped_bsdf().filter(|_| is_straight);
        let bsdf = |material: &Material| stopped(material).unwrap_or_else(|| material.bsdf());
        let absorptions: Vec<Spectrum> = self.materials.iter().map(Material::absorption_of_body).collect();
        self.parts.shrink_to_fit();
        let mut scene = Scene {
            bounds,
            ground: None,
            meshes: Arc::new(Vec::with_capacity(count)),
            prototypes: Vec::with_capacity(self.prototypes.len()),
            instances: Vec::with_capacity(self.instances.len()),
            facets: Vec::with_capacity(count),
            shapes: Vec::with_capacity(count),
            bsdfs: self.materials.iter().map(bsdf).collect(),
            is_dispersive: self.materials.iter().any(Material::is_dispersive),
            has_absorption: absorptions.iter().any(|absorption| !absorption.is_black()),
            absorptions,
            has_lamp_hulls: self.lamps.values().any(|light| light.round().is_some()),
            has_thin_surfaces: thin_surfaces.iter().any(Option::is_some),
            thin_surfaces,
            panes: self.report.panes,
            has_alpha: self
                .materials
                .iter()
                .any(|m| m.opacity < 1.0 || m.maps.varies_opacity()),
            hides_from_camera: self.materials.iter().any(|m| !m.camera_visible),
            hides_from_light: self.materials.iter().any(|m| !m.light_visible),
            hides_backs: false,
            is_compact: false,
            is_moving: false,
            textures: self.textures,
            texture_filter: self.texture_filter,
            objects: if self.objects.is_empty() {
                vec![ONLY_OBJECT.into()]
            } else {
                self.objects
            },
            parts: self.parts,
            materials: self.materials,
            lights: Vec::new(),
            light_numbers: Vec::new(),
            infinite_lights: Vec::new(),
            emission_selection: OnceLock::new(),
            light_groups: LightGroups::new(self.light_groups),
        };

        // The lights of emitting triangles come first. Lights of one mesh, or of one instance, have
        // consecutive ids.
        let mut emitting = 0;
        for ((mesh, material), object) in self.meshes.into_iter().zip(self.mesh_objects) {
            scene.add_shape(
                mesh,
                material,
                Some(object),
                (&self.lamps, self.triangle_sampling, &mut emitting),
            );
        }
        // The ground is the last mesh in the world, before the meshes of prototypes.
        let ground_geom = GeomId(scene.meshes.len() as u32);
        if let Some((plane, (material, object))) = ground {
            scene.add_shape(
                plane.mesh(),
                material,
                Some(object),
                (&self.lamps, self.triangle_sampling, &mut emitting),
            );
        }
        let mut of_instances = 0;
        let mut of_prototypes = Vec::with_capacity(self.prototypes.len());
        for meshes in self.prototypes {
            let first = scene.meshes.len() as u32;
            let mut emitting = 0;
            for (mesh, material) in meshes {
                scene.add_shape(
                    mesh,
                    material,
                    None,
                    (&self.lamps, self.triangle_sampling, &mut emitting),
                );
            }
            scene.prototypes.push(first..scene.meshes.len() as u32);
            of_prototypes.push(emitting);
        }
        for ((prototype, placement), object) in self.instances.into_iter().zip(self.instance_objects) {
            scene.instances.push(Instance {
                prototype: prototype.0,
                placement,
                object,
                first_light: LightId((emitting + of_instances).min(u32::MAX as u64) as u32),
            });
            of_instances += of_prototypes[prototype.0 as usize];
        }
        if emitting + of_instances + self.lights.len() as u64 >= u32::MAX as u64 {
            return Err(BuildError::TooMany("lights"));
        }
        let moves = |i: &Instance| i.placement.is_moving();
        scene.hides_backs = scene.meshes.iter().any(|mesh| mesh.is_front_only);
        scene.is_moving = scene.instances.iter().any(moves) || scene.meshes.iter().any(Mesh::deforms);
        scene.add_lights_of_meshes(self.triangle_sampling, (&self.material_groups, &self.lamps));
        let is_meant_to_shine =
            !self.lights.is_empty() || !self.lamps.is_empty() || self.report.degenerate_emitters > 0;
        for (light, group) in self.lights {
            scene.lights.push(light);
            scene.light_groups.push(group, 1);
        }
        let is_dark = scene.lights.iter().all(|light| light.power(1.0) == 0.0);
        self.report.is_dark = is_dark && is_meant_to_shine;
        if is_dark && !is_meant_to_shine {
            self.report.default_light = true;
            scene.lights.push(Light::Constant(ConstantLight {
                radiance: Spectrum::ONE,
            }));
            scene.light_groups.push(None, 1);
        }

        let ids = (0..scene.lights.len() as u32).map(LightId);
        scene.infinite_lights = ids
            .filter(|id| {
                let light = &scene.lights[id.0 as usize];
                matches!(light, Light::Constant(_) | Light::Sun(_) | Light::Environment(_))
            })
            .collect();
        let merged = scene.light_numbers.iter();
        self.report.rectangles = merged
            .map(|numbers| numbers.windows(2).filter(|n| n[0] == n[1]).count() as u64)
            .sum();
        self.report.coincident_emitters = scene.coincident_emitters();
        if let Some((plane, _)) = ground {
            scene.ground = Some(Ground::new(ground_geom, plane, &scene.lights)?);
        }
        Ok((scene, self.report))
    }

    /// Replaces panes of glass by thin dielectrics. `bounds` is the box of the scene, which limits
    /// the thickness of a pane.
    pub(super) fn flatten_panes(&mut self, bounds: Bounds3) {
        let max_thickness = max_thickness(bounds);
        let mut flat_panes = FlatPanes::default();
        let meshes = std::mem::take(&mut self.meshes).into_iter();
        let objects = std::mem::take(&mut self.mesh_objects);
        for ((mesh, material), object) in meshes.zip(objects) {
            for part in flat_panes.split(mesh, material, max_thickness, &mut self.materials) {
                self.meshes.push(part);
                self.mesh_objects.push(object);
            }
        }
        // Find the largest scale factor over the instances of each prototype. With it, decide if
        // slabs of glass in the prototype are thin enough to be panes
        let mut scales = vec![0.0f64; self.prototypes.len()];
        for (prototype, placement) in &self.instances {
            let lengths = placement.steps().iter().flat_map(|step| {
                let m = step.matrix3;
                [m.x_axis, m.y_axis, m.z_axis].map(|axis| f64::from(axis.length()))
            });
            let scale = &mut scales[prototype.0 as usize];
            *scale = lengths.fold(*scale, f64::max);
        }
        for (prototype, scale) in self.prototypes.iter_mut().zip(scales) {
            let meshes = std::mem::take(prototype).into_iter();
            let split = |(mesh, material)| flat_panes.split(mesh, material, max_thickness / scale, &mut self.materials);
            *prototype = meshes.flat_map(split).collect();
        }
        self.report.panes += flat_panes.count;
    }

    /// Approximate number of bytes that [`SceneBuilder::build`] needs: for facets of meshes that
    /// are not part of a prototype, and for emitting triangles, including their entries in the
    /// light selection.
    pub fn building_bytes(&self) -> u64 {
        let emits = |material: MaterialId| {
            let material = self.materials.get(material.0 as usize);
            material.is_some_and(|material| !material.emission_factor().is_black())
        };
        let lights = |meshes: &[(Mesh, MaterialId)]| -> u64 {
            let emitting = meshes.iter().filter(|(_, material)| emits(*material));
            emitting.map(|(mesh, _)| mesh.triangles.len() as u64).sum()
        };
        let facets: u64 = self.meshes.iter().map(|(mesh, _)| mesh.triangles.len() as u64).sum();
        let of_prototypes: Vec<u64> = self.prototypes.iter().map(|meshes| lights(meshes)).collect();
        let placed: u64 = self.instances.iter().map(|(p, _)| of_prototypes[p.0 as usize]).sum();
        facets * size_of::<Facet>() as u64 + (lights(&self.meshes) + placed) * BYTES_OF_A_LIGHT
    }

    /// Adds the material and the object of the ground. Returns the ids of both.
    fn add_ground(&mut self, material: Material) -> (MaterialId, u32) {
        if self.objects.is_empty() {
            self.begin_object(ONLY_OBJECT);
        }
        self.begin_object(Ground::NAME);
        self.materials.push(material);
        (
            MaterialId(self.materials.len() as u32 - 1),
            self.objects.len() as u32 - 1,
        )
    }

    /// Box around the world at all times.
    pub fn bounds(&self) -> Bounds3 {
        let positions = self.meshes.iter().flat_map(|(m, _)| used_positions(m));
        let mut bounds: Bounds3 = positions.collect();
        let of_prototypes: Vec<Bounds3> = self.prototypes.iter().map(|p| bounds_of(p)).collect();
        for (prototype, placement) in &self.instances {
            let placed = placement.bounds(of_prototypes[prototype.0 as usize]);
            // An instance without triangles has an empty box
            if !placed.is_empty() {
                bounds.extend(placed.min);
                bounds.extend(placed.max);
            }
        }
        bounds
    }
}

impl Scene {
    /// Adds a mesh to `object`, or to a prototype if `object` is `None`. Also adds the number of
    /// lights of the mesh to `emitting`. A mesh whose material is in `lamps` is one light; in other
    /// meshes, each emitting triangle or rectangle is a light.
    fn add_shape(
        &mut self,
        mesh: Mesh,
        material: MaterialId,
        object: Option<u32>,
        (lamps, sampling, emitting): (&HashMap<MaterialId, AreaLight>, TriangleSampling, &mut u64),
    ) {
        let surface = &self.materials[material.0 as usize];
        let keeps_place = object.is_some() && !mesh.deforms();
        let varies = surface.maps.varies_bsdf() || surface.maps.has_bumps() || surface.is_anisotropic();
        let is_uniform = mesh.normals.is_empty() && !varies;
        let lamp = lamps.get(&material);
        let is_curved = lamp.and_then(AreaLight::round).is_some_and(RoundLight::is_curved);
        // A light whose surface is a whole mesh has an id even if it does not emit
        let emits = lamp.is_some() || !surface.emission_factor().is_black();
        let first_light = emits.then_some(LightId(*emitting as u32));
        let (light_count, numbering) = match (emits, lamp) {
            (false, _) => (0, LightNumbering::Triangles),
            (true, Some(_)) => (1, LightNumbering::One),
            (true, None) => self.number_lights(&mesh, keeps_place && !varies_emission(surface), sampling),
        };
        *emitting += u64::from(light_count);
        // Store facets only for meshes in world space that do not deform. The facets of other
        // meshes change with the placement or with time
        let prims = 0..mesh.triangles.len() as u32;
        self.facets.push(if keeps_place {
            prims.map(|prim| mesh.facet(PrimId(prim))).collect()
        } else {
            Vec::new()
        });
        // `make_mut` does not copy the meshes, because no other code shares them yet
        Arc::make_mut(&mut self.meshes).push(mesh);
        self.shapes.push(Shape {
            material,
            object: object.unwrap_or(0),
            is_plain: keeps_place && is_uniform && !is_curved,
            first_light,
            light_count,
            numbering,
        });
    }

    /// Returns the number of lights of an emitting mesh, and the map from triangles to lights. If
    /// `is_plain` is true, which means that the mesh emits evenly and does not move, each rectangle
    /// of two triangles is one light.
    fn number_lights(&mut self, mesh: &Mesh, is_plain: bool, sampling: TriangleSampling) -> (u32, LightNumbering) {
        let count = mesh.triangles.len() as u32;
        if is_plain && sampling == TriangleSampling::Area {
            let (parts, numbers) = recognise::parts(mesh);
            if parts.len() < numbers.len() {
                self.light_numbers.push(numbers);
                return (
                    parts.len() as u32,
                    LightNumbering::Listed(self.light_numbers.len() as u32 - 1),
                );
            }
        }
        (count, LightNumbering::Triangles)
    }

    /// Makes the lights of all emitting meshes, in the order of the light ids: one light for each
    /// triangle or rectangle, or one light for a whole mesh such as the hull of a sphere light.
    fn add_lights_of_meshes(&mut self, sampling: TriangleSampling, of_materials: LightsOfMaterials) {
        for geom in self.world_meshes() {
            self.add_lights_of(GeomId(geom), InstanceId::NONE, sampling, of_materials);
        }
        for inst in 0..self.instances.len() {
            for geom in self.prototypes[self.instances[inst].prototype as usize].clone() {
                self.add_lights_of(GeomId(geom), InstanceId(inst as u32), sampling, of_materials);
            }
        }
    }

    /// Light ids of each lamp. A lamp is a connected component of an emitting mesh, in the world or
    /// in an instance, or a light that is not part of a mesh.
    pub(super) fn lamps(&self) -> Vec<Vec<LightId>> {
        let mut lamps = Vec::new();
        let mut end = 0;
        let placed = (self.instances.iter()).flat_map(|i| {
            self.prototypes[i.prototype as usize]
                .clone()
                .map(|geom| (geom, i.first_light.0))
        });
        for (geom, before) in self.world_meshes().map(|geom| (geom, 0)).chain(placed) {
            let Some(first) = self.shape(GeomId(geom)).first_light else {
                continue;
            };
            let (mesh, shape) = (&self.meshes[geom as usize], self.shape(GeomId(geom)));
            let components = match shape.numbering {
                LightNumbering::One => vec![vec![0]],
                _ => recognise::components(mesh, recognise::welded(mesh)),
            };
            for triangles in components {
                let number = |prim| self.number_of_light(shape, PrimId(prim));
                let mut ids: Vec<_> = (triangles.into_iter())
                    .map(|prim| LightId(before + first.0 + number(prim)))
                    .collect();
                // Remove repeated ids: both triangles of a rectangle are the same light
                ids.sort_unstable();
                ids.dedup();
                lamps.push(ids);
            }
            end = end.max(before + first.0 + shape.light_count);
        }
        lamps.extend((end..self.lights.len() as u32).map(|id| vec![LightId(id)]));
        lamps
    }

    fn add_lights_of(
        &mut self,
        geom: GeomId,
        inst: InstanceId,
        sampling: TriangleSampling,
        (groups, lamps): LightsOfMaterials,
    ) {
        let shape = self.shape(geom);
        if shape.first_light.is_none() {
            return;
        }
        let group = groups.get(&shape.material).copied();
        if let Some(lamp) = lamps.get(&shape.material) {
            self.light_groups.push(group, 1);
            self.lights.push(lamp.clone().into());
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
                AreaLight::MovingTriangle(Box::new(MovingTriangle::new(ends, placement, radiance, sampling)))
            }
            None => AreaLight::Triangle(TriangleLight::new(mesh.corners(prim), radiance, sampling)),
            Some(placement) => {
                let placed = PlacedTriangle::new(mesh.corners(prim), None, Some(placement.at(0.0)));
                AreaLight::Triangle(TriangleLight::placed(&placed, radiance, sampling))
            }
        };
        let placed = |map: Option<Map>| map.map(|Map { texture, mapping }| (texture, mapping));
        let varied = |prim| {
            if varies_emission(material) {
                let variation = Variation {
                    uvs: mesh.corner_uvs(prim).unwrap_or_default(),
                    emission: placed(material.maps.emission),
                    opacity: material.opacity,
                    opacity_map: placed(material.maps.opacity),
                    alphas: mesh.corner_alphas(prim),
                };
                light(prim).varied(variation, &self.textures)
            } else {
                light(prim)
            }
        };
        let lights: Vec<AreaLight> = match shape.numbering {
            LightNumbering::Listed(_) => recognise::parts(mesh)
                .0
                .into_iter()
                .map(|part| match part {
                    EmitterShape::Triangle(prim) => varied(prim),
                    EmitterShape::Rectangle(corner, edges) => {
                        AreaLight::Rectangle(RectangleLight::new(corner, edges, radiance))
                    }
                })
                .collect(),
            _ => (0..mesh.triangles.len() as u32).map(PrimId).map(varied).collect(),
        };
        self.light_groups.push(group, lights.len());
        self.lights.extend(lights.into_iter().map(Light::Area));
    }
}

/// Returns true if textures or opacity vary the emission of a surface of `material`.
fn varies_emission(material: &Material) -> bool {
    material.maps.emission.is_some() || material.maps.varies_opacity() || material.opacity < 1.0
}
