//! Lights that the builder makes from parameters: skies, studios, suns with an angular size,
//! spheres, disks and rectangles.

use super::SceneBuilder;
use super::lamp_hulls::{around_disk, around_sphere};
use super::light_checks::{bad_light, check_angle, check_environment, check_light, check_number, unit, unit_of};
use super::validate::{BuildError, MAX_COORDINATE};
use crate::color::Spectrum;
use crate::geometry::{Mesh, triangle_area};
use crate::light::sky::{Sky, TURBIDITIES};
use crate::light::{
    AreaLight, DiskLight, EnvironmentKind, EnvironmentLight, LatLongImage, Light, RectangleLight, SphereLight,
    SunLight, studio_image,
};
use crate::material::Material;
use crate::math::{Horizon, Quat, Vec3, list};

/// Types of the lights that the builder makes with a surface.
pub const LAMP_KINDS: [&str; 3] = ["rectangle", "sphere", "disk"];

/// Name of the material and the object of a light of the type `kind`, one of [`LAMP_KINDS`].
pub fn lamp_name(kind: &str) -> String {
    format!("{kind} light")
}

/// A daylight sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyParameters {
    /// Azimuth of the sun around `up`, and elevation from −90 to 90, both in degrees ([`Horizon`]).
    pub sun: [f32; 2],
    /// Turbidity (haze) of the air, within [`TURBIDITIES`].
    pub turbidity: f32,
    /// Direction of the zenith, of any length.
    pub up: Vec3,
    /// Factor by which the radiance is multiplied.
    pub scale: f32,
}

/// Studio: soft lamps around a subject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StudioParameters {
    /// Direction upwards, of any length.
    pub up: Vec3,
    /// Azimuth of the camera around `up`, in degrees ([`Horizon`]).
    pub front: f32,
    /// Factor by which the radiance is multiplied.
    pub scale: f32,
}

/// A rectangle that emits on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RectangleParameters {
    /// Centre, world space.
    pub position: Vec3,
    /// Normal of the side that emits, of any length.
    pub direction: Vec3,
    /// Width and height, scene units.
    pub size: [f32; 2],
    /// Direction of the rectangle's height, of any length. If it is `None`, the direction is +y, or
    /// +z if `direction` is along +y.
    pub up: Option<Vec3>,
    /// Radiance of the emitting side, W·sr⁻¹·m⁻².
    pub radiance: Spectrum,
}

/// A sphere that emits from its outer side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereParameters {
    /// Centre, world space.
    pub position: Vec3,
    /// Radius, scene units.
    pub radius: f32,
    /// Radiance of the outer side, W·sr⁻¹·m⁻².
    pub radiance: Spectrum,
}

/// A disk that emits on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiskParameters {
    /// Centre, world space.
    pub position: Vec3,
    /// Normal of the side that emits, of any length.
    pub direction: Vec3,
    /// Radius, scene units.
    pub radius: f32,
    /// Radiance of the emitting side, W·sr⁻¹·m⁻².
    pub radiance: Spectrum,
}

/// Environment light from an image that the program made.
fn environment_of(
    kind: EnvironmentKind,
    image: LatLongImage,
    scale: f32,
    rotation: Quat,
) -> Result<EnvironmentLight, BuildError> {
    check_environment(kind.name(), &image, scale, rotation)?;
    Ok(EnvironmentLight::new(image, scale, rotation).of_kind(kind))
}

impl SceneBuilder {
    /// Adds light that comes from a disc at infinity and travels in `direction`. `irradiance`,
    /// W·m⁻², is the irradiance of a surface that faces the light. `angle`, the angular diameter of
    /// the disc, is 0.01 to 180 degrees, or 0 for the parallel light of
    /// [`SceneBuilder::add_directional_light`].
    pub fn add_sun(&mut self, direction: Vec3, irradiance: Spectrum, angle: f32) -> Result<(), BuildError> {
        check_angle(angle)?;
        if angle == 0.0 {
            return self.add_directional_light(direction, irradiance);
        }
        let direction = unit("directional", direction)?;
        check_light("directional", "irradiance", irradiance)?;
        self.add_light(Light::Sun(SunLight::new(direction, irradiance, angle)));
        Ok(())
    }

    /// Adds a daylight sky without the sun's disc, and the ground below it ([`crate::light::sky`]).
    pub fn add_sky(&mut self, sky: &SkyParameters) -> Result<(), BuildError> {
        let up = unit_of("sky", "up", sky.up)?;
        let [azimuth, elevation] = sky.sun;
        if !(azimuth.is_finite() && (-90.0..=90.0).contains(&elevation)) {
            let rule = "the azimuth must be finite, and the elevation lie between -90 and 90 degrees";
            return Err(bad_light("sky", "sun", list(&sky.sun), rule));
        }
        let [min, max] = TURBIDITIES;
        if !(min..=max).contains(&sky.turbidity) {
            let rule = "must lie between 2 (very clear) and 10 (hazy)";
            return Err(bad_light("sky", "turbidity", sky.turbidity.to_string(), rule));
        }
        // In the image, the sun is above −z, which is azimuth 180.
        let turn = Quat::from_rotation_y((azimuth.rem_euclid(360.0) - 180.0).to_radians());
        let rotation = Horizon::new(up).rotation() * turn;
        // Making an image takes 15 ms. Skies that differ only in scale, azimuth and up direction
        // share one image.
        let key = [elevation, sky.turbidity].map(f32::to_bits);
        let light = match self.skies.get(&key) {
            Some(known) => {
                check_environment(EnvironmentKind::Sky.name(), known.image(), sky.scale, rotation)?;
                known.placed(sky.scale, rotation)
            }
            None => {
                let image = Sky::new(elevation, sky.turbidity).image();
                environment_of(EnvironmentKind::Sky, image, sky.scale, rotation)?
            }
        };
        self.skies.entry(key).or_insert_with(|| light.clone());
        self.add_light(Light::Environment(Box::new(light)));
        Ok(())
    }

    /// Adds the lamps and the wall of a studio ([`studio_image`]).
    pub fn add_studio(&mut self, studio: &StudioParameters) -> Result<(), BuildError> {
        let up = unit_of("studio", "up", studio.up)?;
        check_number("studio", "front", studio.front)?;
        let turn = Quat::from_rotation_y(studio.front.rem_euclid(360.0).to_radians());
        let rotation = Horizon::new(up).rotation() * turn;
        let light = environment_of(EnvironmentKind::Studio, studio_image(), studio.scale, rotation)?;
        self.add_light(Light::Environment(Box::new(light)));
        Ok(())
    }

    /// Adds a rectangle light to the current light group. The rectangle emits on one side. It is a
    /// separate object, whose material reflects nothing.
    pub fn add_rectangle(&mut self, rectangle: &RectangleParameters) -> Result<(), BuildError> {
        const NAME: &str = "rectangle";
        let direction = unit(NAME, rectangle.direction)?;
        let [width, height] = rectangle.size;
        if ![width, height].iter().all(|side| side.is_finite() && *side > 0.0) {
            let rule = "width and height must be finite and above 0";
            return Err(bad_light(NAME, "size", list(&rectangle.size), rule));
        }
        check_light(NAME, "radiance", rectangle.radiance)?;
        let across = |up: Vec3| {
            up.cross(direction)
                .try_normalize()
                .filter(|_| up.cross(direction).length() > 1e-4)
        };
        let right = match rectangle.up {
            Some(up) => {
                let bad = || bad_light(NAME, "up", list(&up.to_array()), "must not be along the direction");
                across(unit_of(NAME, "up", up)?).ok_or_else(bad)?
            }
            None => across(Vec3::Y).or_else(|| across(Vec3::Z)).unwrap_or(Vec3::X),
        };
        let (right, up) = (0.5 * width * right, 0.5 * height * direction.cross(right));
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let corners = corners.map(|[x, y]| rectangle.position + x * right + y * up);
        let is_within = |corner: &Vec3| corner.is_finite() && corner.abs().max_element() <= MAX_COORDINATE;
        if !corners.iter().all(is_within) {
            let value = list(&rectangle.position.to_array());
            return Err(bad_light(
                NAME,
                "position",
                value,
                "the corners must have coordinates of at most 1e10",
            ));
        }
        let mesh = Mesh {
            positions: corners.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let has_area = |[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| corners[*i as usize]);
            triangle_area(a, b, c) > 0.0
        };
        if !mesh.triangles.iter().all(has_area) {
            let rule = "is too small for 32-bit floats at this position; enlarge the light, or use a point light";
            return Err(bad_light(NAME, "size", list(&rectangle.size), rule));
        }
        let light = RectangleLight::new(corners[0], [2.0 * right, 2.0 * up], rectangle.radiance);
        self.add_lamp(NAME, light, rectangle.radiance, mesh)
    }

    /// Adds a sphere light to the current light group. The sphere emits from its outer side. It is
    /// a separate object, whose material reflects nothing.
    pub fn add_sphere(&mut self, sphere: &SphereParameters) -> Result<(), BuildError> {
        const NAME: &str = "sphere";
        check_radius(NAME, sphere.radius)?;
        check_light(NAME, "radiance", sphere.radiance)?;
        check_place(NAME, sphere.position, sphere.radius)?;
        let light = SphereLight::new(sphere.position, sphere.radius, sphere.radiance);
        let hull = around_sphere(&light, 0.0);
        self.add_lamp(NAME, light, sphere.radiance, hull)
    }

    /// Adds a disk light to the current light group. The disk emits on one side. It is a separate
    /// object, whose material reflects nothing.
    pub fn add_disk(&mut self, disk: &DiskParameters) -> Result<(), BuildError> {
        const NAME: &str = "disk";
        let normal = unit(NAME, disk.direction)?;
        check_radius(NAME, disk.radius)?;
        check_light(NAME, "radiance", disk.radiance)?;
        check_place(NAME, disk.position, disk.radius)?;
        let light = DiskLight::new(disk.position, normal, disk.radius, disk.radiance);
        let hull = around_disk(&light, 0.0);
        self.add_lamp(NAME, light, disk.radiance, hull)
    }

    /// Adds a light of the type `kind` to the current light group. The surface of the light is
    /// `mesh`, in a new object with a new material ([`lamp_name`]).
    fn add_lamp(
        &mut self,
        kind: &str,
        light: impl Into<AreaLight>,
        radiance: Spectrum,
        mesh: Mesh,
    ) -> Result<(), BuildError> {
        debug_assert!(LAMP_KINDS.contains(&kind));
        let name = lamp_name(kind);
        let material = self.add_material(Material {
            name: name.clone(),
            emission: radiance,
            ..Material::default()
        })?;
        if let Some(group) = self.current_light_group() {
            self.group_material(material, group);
        }
        self.lamps.insert(material, light.into());
        self.begin_object(&name);
        self.add_checked_mesh(mesh, material);
        Ok(())
    }
}

fn check_radius(light: &'static str, radius: f32) -> Result<(), BuildError> {
    if radius > 0.0 && radius.is_finite() {
        Ok(())
    } else {
        Err(bad_light(
            light,
            "radius",
            radius.to_string(),
            "must be finite and above 0",
        ))
    }
}

/// Returns an error if a light around `position` is too far away. `reach` is the largest distance
/// of the light's points from `position`.
fn check_place(light: &'static str, position: Vec3, reach: f32) -> Result<(), BuildError> {
    let farthest = position.abs().max_element() + 2.0 * reach;
    if position.is_finite() && farthest <= MAX_COORDINATE {
        Ok(())
    } else {
        let value = list(&position.to_array());
        Err(bad_light(
            light,
            "position",
            value,
            "must keep the whole light within coordinates of 1e10",
        ))
    }
}
