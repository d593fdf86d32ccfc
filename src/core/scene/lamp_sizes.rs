//! Sizes of the lamps of a scene, by material. They show users which surfaces light the scene.

use super::Scene;
use crate::geometry::GeomId;
use crate::light::LightId;
use crate::material::MaterialId;
use std::collections::BTreeMap;

/// Total size of the emitting surfaces of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LampSize {
    /// Number of lights: emitting triangles, rectangles, spheres and disks.
    pub lights: u64,
    /// Emitting area, in square scene units.
    pub area: f64,
    /// Luminance-weighted power, in watts.
    pub power: f64,
}

impl Scene {
    /// Sizes of the emitting surfaces of each material, in the order of the materials. Each copy of
    /// a prototype counts. Lights without surface are not included.
    pub fn lamp_sizes(&self) -> BTreeMap<MaterialId, LampSize> {
        let placed = self.instances.iter().flat_map(|instance| {
            let geoms = self.prototypes[instance.prototype as usize].clone();
            geoms.map(|geom| (geom, instance.first_light.0))
        });
        let mut lamps: BTreeMap<MaterialId, LampSize> = BTreeMap::new();
        for (geom, before) in self.world_meshes().map(|geom| (geom, 0)).chain(placed) {
            let shape = self.shape(GeomId(geom));
            let Some(LightId(first)) = shape.first_light else {
                continue;
            };
            let lamp = lamps.entry(shape.material).or_default();
            let ids = (before + first) as usize..(before + first + shape.light_count) as usize;
            for light in self.lights.get(ids).unwrap_or_default() {
                lamp.lights += 1;
                lamp.area += light.area();
                lamp.power += light.power(0.0);
            }
        }
        lamps
    }
}
