//! Functions of the scene builder that add lights without a mesh, and groups of lights.
//! `made_lights` adds skies and lights with a surface.

use super::builder::SceneBuilder;
use super::light_checks::{check_environment, check_light, check_position, check_spot, unit};
use super::validate::{BuildError, check_group_name};
use crate::color::Spectrum;
use crate::light::{
    ConstantLight, DirectionalLight, EnvironmentLight, LatLongImage, Light, LightGroupId, LightGroups, PointLight,
    SpotLight, TriangleSampling,
};
use crate::material::MaterialId;
use crate::math::{Quat, Vec3};

impl SceneBuilder {
    /// Sets the sampling of emitting triangles. The default is by area.
    pub fn triangle_sampling(&mut self, sampling: TriangleSampling) {
        self.triangle_sampling = sampling;
    }

    /// Returns the light group with this name. Adds the group if it does not exist.
    pub fn light_group(&mut self, name: &str) -> Result<LightGroupId, BuildError> {
        check_group_name(name)?;
        let found = self.light_groups.iter().position(|known| known == name);
        let index = found.unwrap_or(self.light_groups.len());
        // Leave an index for the group of lights without a group
        if index >= LightGroups::MAX_GROUPS - 1 {
            return Err(BuildError::TooManyLightGroups);
        }
        if found.is_none() {
            self.light_groups.push(name.into());
        }
        Ok(LightGroupId(index as u8))
    }

    /// Sets the group of all lights that are added before the next call; `None` means no group.
    pub fn begin_light_group(&mut self, group: Option<LightGroupId>) {
        self.light_group = group;
    }

    /// Group to which new lights belong.
    pub(super) fn current_light_group(&self) -> Option<LightGroupId> {
        self.light_group
    }

    /// Assigns the emission of all surfaces of `material` to a light group.
    pub fn group_material(&mut self, material: MaterialId, group: LightGroupId) {
        self.material_groups.insert(material, group);
    }

    pub(super) fn add_light(&mut self, light: Light) {
        self.lights.push((light, self.light_group));
    }

    /// Adds a point light with `intensity`, W/sr.
    pub fn add_point_light(&mut self, position: Vec3, intensity: Spectrum) -> Result<(), BuildError> {
        check_position("point", position)?;
        check_light("point", "intensity", intensity)?;
        self.add_light(Light::Point(PointLight { position, intensity }));
        Ok(())
    }

    /// Adds an environment with constant `radiance`, W·sr⁻¹·m⁻².
    pub fn add_constant_light(&mut self, radiance: Spectrum) -> Result<(), BuildError> {
        check_light("constant", "radiance", radiance)?;
        self.add_light(Light::Constant(ConstantLight { radiance }));
        Ok(())
    }

    /// Adds parallel light that travels in `direction`. `irradiance`, W·m⁻², is the irradiance of a
    /// surface that faces the light.
    pub fn add_directional_light(&mut self, direction: Vec3, irradiance: Spectrum) -> Result<(), BuildError> {
        let direction = unit("directional", direction)?;
        check_light("directional", "irradiance", irradiance)?;
        self.add_light(Light::Directional(DirectionalLight { direction, irradiance }));
        Ok(())
    }

    /// Adds a spot light: a point light with `intensity`, W/sr, in the cone around `direction` with
    /// the half-angle `angle`. The intensity falls off between the half-angles `falloff` and
    /// `angle`. Angles in degrees, `falloff` ≤ `angle` ≤ 90.
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
        check_spot(angle, falloff)?;
        self.add_light(Light::Spot(SpotLight {
            position,
            direction,
            intensity,
            cos_inner: falloff.to_radians().cos(),
            cos_outer: angle.to_radians().cos(),
        }));
        Ok(())
    }

    /// Adds an environment with the radiance of `image` times `scale`, rotated by `rotation`.
    pub fn add_environment(&mut self, image: LatLongImage, scale: f32, rotation: Quat) -> Result<(), BuildError> {
        check_environment("environment", &image, scale, rotation)?;
        let light = EnvironmentLight::new(image, scale, rotation);
        self.add_light(Light::Environment(Box::new(light)));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::builder::tests::{material, mesh};
    use super::*;
    use crate::geometry::Placement;
    use crate::light::LightId;

    #[test]
    fn lights_are_in_the_groups_of_their_materials() {
        let mut b = SceneBuilder::new();
        let [dark, lamp, screen] = [0.0, 3.0, 1.0].map(|e| b.add_material(material(0.5, e)).unwrap());
        let sky = b.light_group("sky").unwrap();
        let lamps = b.light_group("lamps").unwrap();
        assert_eq!(b.light_group("sky"), Ok(sky));
        b.group_material(lamp, lamps);
        b.group_material(dark, sky);
        let two = || mesh(vec![[0, 1, 2], [2, 1, 3]]);
        for material in [screen, dark, lamp] {
            b.add_mesh(two(), material).unwrap();
        }
        // Equal triangles in instances
        let prototype = b.add_prototype(vec![(two(), lamp), (two(), screen)]).unwrap();
        let still = Placement::Still(crate::math::Affine3A::from_translation(Vec3::Z.into()));
        b.add_instance(prototype, still).unwrap();
        b.begin_light_group(Some(sky));
        b.add_constant_light(Spectrum::ONE).unwrap();
        b.begin_light_group(None);
        b.add_point_light(Vec3::Z, Spectrum::ONE).unwrap();
        let (scene, _) = b.build().unwrap();
        let groups = scene.light_groups();
        assert_eq!(groups.names(), ["sky", "lamps", "default"]);
        let of_lights: Vec<usize> = (0..scene.lights().len() as u32)
            .map(|id| groups.of(LightId(id)))
            .collect();
        assert_eq!(of_lights, [2, 2, 1, 1, 1, 1, 2, 2, 0, 2]);
    }
}
