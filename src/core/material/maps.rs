use super::{Gloss, Material};
use crate::bsdf::Bsdf;
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, encode_fields};
use crate::texture::{Mapping, Texture, TextureId};

/// A texture and the mapping of the texture on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Map {
    /// Id of the texture.
    pub texture: TextureId,
    /// Mapping of the texture on the surface.
    pub mapping: Mapping,
}

/// Textures of a material. A texture multiplies the constant of the material with the same name.
/// Bump and normal maps change the shading normal instead.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Maps {
    /// Texture of the diffuse reflectance.
    pub diffuse: Option<Map>,
    /// Texture of the specular factor.
    pub specular: Option<Map>,
    /// Texture of the emission.
    pub emission: Option<Map>,
    /// Texture of the exponent of a glossy lobe.
    pub exponent: Option<Map>,
    /// Texture of the roughness.
    pub roughness: Option<Map>,
    /// Texture of the fraction of metal in the metallic-roughness model.
    pub metallic: Option<Map>,
    /// Texture of the opacity.
    pub opacity: Option<Map>,
    /// Texture of heights. The unit of height is the width of a texel of the finest level.
    pub bump: Option<Map>,
    /// Texture of normals in the frame of the texture coordinates (tangent space). A component c is
    /// stored as (c + 1)/2. If given, `bump` is not used.
    pub normal: Option<Map>,
    /// True if colours of vertices multiply the diffuse reflectance.
    pub vertex_color: bool,
    /// True if opacities of vertices multiply the opacity.
    pub vertex_alpha: bool,
}

encode_fields!(Map { texture, mapping });
encode_fields!(Maps {
    diffuse,
    specular,
    emission,
    exponent,
    roughness,
    metallic,
    opacity,
    bump,
    normal,
    vertex_color,
    vertex_alpha,
});

/// Surface point at which textures are looked up.
#[derive(Clone, Copy, Debug)]
pub struct Spot<'a> {
    /// The scene's textures, by [`TextureId`].
    pub textures: &'a [Texture],
    /// Texture coordinates of the surface.
    pub uv: Vec2,
    /// Width of the ray's footprint, in units of the texture coordinates.
    pub footprint: f32,
    /// Interpolated colour of the vertices.
    pub color: Spectrum,
    /// Interpolated opacity of the vertices.
    pub alpha: f32,
}

impl Map {
    fn texture<'a>(&self, spot: &Spot<'a>) -> &'a Texture {
        &spot.textures[self.texture.0 as usize]
    }

    fn color(&self, spot: &Spot) -> Spectrum {
        self.mapping.color(self.texture(spot), spot.uv, spot.footprint)
    }

    fn value(&self, spot: &Spot) -> f32 {
        self.mapping.value(self.texture(spot), spot.uv, spot.footprint)
    }

    fn normal(&self, spot: &Spot) -> Vec3 {
        self.mapping.normal(self.texture(spot), spot.uv, spot.footprint)
    }
}

impl Maps {
    /// All textures, in the order of the fields.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Option<Map>> {
        let Self {
            diffuse,
            specular,
            emission,
            exponent,
            roughness,
            metallic,
            opacity,
            bump,
            normal,
            vertex_color: _,
            vertex_alpha: _,
        } = self;
        let colors = [diffuse, specular, emission].into_iter();
        colors.chain([exponent, roughness, metallic, opacity, bump, normal])
    }

    /// All textures, each with its key in scene files.
    pub fn by_key(&self) -> [(&'static str, Option<Map>); 9] {
        [
            ("diffuse_map", self.diffuse),
            ("specular_map", self.specular),
            ("emission_map", self.emission),
            ("exponent_map", self.exponent),
            ("roughness_map", self.roughness),
            ("metallic_map", self.metallic),
            ("opacity_map", self.opacity),
            ("bump_map", self.bump),
            ("normal_map", self.normal),
        ]
    }

    /// Values of the textures at `spot`, each with the key of the texture in scene files. A value
    /// has one number or three.
    pub fn texels(&self, spot: &Spot) -> Vec<(&'static str, Vec<f32>)> {
        let texel = |(key, map): (&'static str, Option<Map>)| {
            let map = map?;
            let texel = match key {
                "diffuse_map" | "specular_map" | "emission_map" => map.color(spot).to_array().to_vec(),
                "normal_map" => map.normal(spot).to_array().to_vec(),
                _ => vec![map.value(spot)],
            };
            Some((key, texel))
        };
        let texels = self.by_key().into_iter().filter_map(texel);
        let color = self
            .vertex_color
            .then(|| ("vertex_color", spot.color.to_array().to_vec()));
        let alpha = self.vertex_alpha.then(|| ("vertex_alpha", vec![spot.alpha]));
        texels.chain(color).chain(alpha).collect()
    }

    /// Returns true if the BSDF varies over the surface.
    pub fn varies_bsdf(&self) -> bool {
        let maps = [
            self.diffuse,
            self.specular,
            self.exponent,
            self.roughness,
            self.metallic,
        ];
        self.vertex_color || maps.iter().any(Option::is_some)
    }

    /// Returns true if the opacity varies over the surface.
    pub fn varies_opacity(&self) -> bool {
        self.vertex_alpha || self.opacity.is_some()
    }

    /// Returns true if a map changes the shading normal.
    pub fn has_bumps(&self) -> bool {
        self.bump.is_some() || self.normal.is_some()
    }

    /// Direction of the shading normal that a bump or normal map gives, not normalised. The axes of
    /// the frame are the tangents along u and v, and the shading normal without the map.
    pub fn bumped_normal(&self, spot: &Spot) -> Vec3 {
        if let Some(map) = &self.normal {
            let n = map.normal(spot);
            // A normal that points into the surface is invalid.
            return Vec3::new(n.x, n.y, n.z.max(1e-3));
        }
        let Some(map) = &self.bump else { return Vec3::Z };
        // The unit of height is a texel, so that a picture gives the same slopes on large and small
        // walls. Blinn 1978, "Simulation of Wrinkled Surfaces", and MTL do not define the unit.
        let texture = map.texture(spot);
        let (width, height) = texture.size();
        let texels = Vec2::new(width as f32, height as f32) * map.mapping.scale.abs();
        let slope = map.mapping.gradient(texture, spot.uv, spot.footprint) / texels;
        // With a scale of 0, the texture is constant, so the slope is 0.
        let slope = if slope.is_finite() { slope } else { Vec2::ZERO };
        Vec3::new(-slope.x, -slope.y, 1.0)
    }
}

impl Material {
    /// BSDF at `spot`, for a material that varies over the surface.
    pub fn bsdf_at(&self, spot: &Spot) -> Bsdf {
        let maps = &self.maps;
        let color = |factor: Spectrum, map: &Option<Map>| map.map_or(factor, |map| factor * map.color(spot));
        let value = |factor: f32, map: &Option<Map>| map.map_or(factor, |map| factor * map.value(spot));
        let mut here = Self {
            name: String::new(),
            maps: Maps::default(),
            diffuse: self.diffuse_at(spot),
            specular: color(self.specular, &maps.specular),
            roughness: value(self.roughness, &maps.roughness).clamp(0.0, 1.0),
            gloss: match self.gloss {
                Gloss::Phong(n) => Gloss::Phong(value(n, &maps.exponent).max(0.0)),
                Gloss::Blinn(n, fresnel) => Gloss::Blinn(value(n, &maps.exponent).max(0.0), fresnel),
                Gloss::Metallic(share) => Gloss::Metallic(value(share, &maps.metallic).clamp(0.0, 1.0)),
                gloss => gloss,
            },
            ..*self
        };
        // Values of textures may make the material scatter more light than it receives.
        here.scale_to_one();
        here.bsdf()
    }

    /// Diffuse colour at `spot`.
    pub fn diffuse_at(&self, spot: &Spot) -> Spectrum {
        self.maps
            .diffuse
            .map_or(self.diffuse, |map| self.diffuse * map.color(spot))
            * spot.color
    }

    /// Opacity at `spot`.
    pub fn opacity_at(&self, spot: &Spot) -> f32 {
        let share = self.maps.opacity.map_or(1.0, |map| map.value(spot));
        (self.opacity * share * spot.alpha).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_maps_have_keys() {
        let mut maps = Maps::default();
        assert_eq!(maps.iter_mut().count(), maps.by_key().len());
        for (i, map) in (0..).zip(maps.iter_mut()) {
            *map = Some(Map {
                texture: TextureId(i),
                mapping: Mapping::default(),
            });
        }
        let ids = maps.by_key().map(|(_, map)| map.map(|map| map.texture.0));
        assert_eq!(ids, [0, 1, 2, 3, 4, 5, 6, 7, 8].map(Some));
    }
}
