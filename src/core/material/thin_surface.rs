//! Surfaces that transmit light without refraction: thin glass and coloured filters.
//!
//! A ray that hits such a surface stops there or passes through, by a random choice, as with alpha.
//! `integrator/opacity.rs` traces these rays. A light sample behind the surface is multiplied by
//! the probability that a ray passes. For all other code, the surface does not exist if a ray
//! passes, so MIS, connections, photons and path reuse need no changes.
//!
//! The probability must be the same for both directions of a path. Otherwise, estimators that trace
//! from lights would differ from estimators that trace from the camera. Two kinds of surface have
//! such a probability:
//!
//! - a thin dielectric without other lobes. It stops the fraction `r = 2R / (1 + R)` of the rays,
//!   which is its reflectance. The reflectance is the same for a direction and its mirror
//!   direction;
//! - a filter, which is a thin dielectric of index 1 with additional reflecting lobes. It stops the
//!   same fraction of the rays for all directions.
//!
//! A thin dielectric of another index that also has diffuse or glossy lobes, a coat or a texture
//! has no such probability. It is a usual surface, at which rays scatter and shadow rays stop.

use super::Material;
use crate::bsdf::{Bsdf, Fresnel, Lobe, Mirror, ThinDielectric};
use crate::color::Spectrum;

/// A surface that transmits light without refraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinSurface {
    /// Factor of the transmitted light.
    pub tint: Spectrum,
    /// Probability that a ray passes, without the reflection at the interfaces. Below 1 if the
    /// surface has other lobes.
    share: f32,
    ior: f32,
}

impl ThinSurface {
    /// Probability of passing for a ray with this cosine to the shading normal. Light that passes
    /// is multiplied by this probability and by `tint`.
    pub fn pass_probability(&self, cos: f32) -> f32 {
        if self.ior == 1.0 {
            self.share
        } else {
            self.share * (1.0 - ThinDielectric::reflected_share(cos, self.ior))
        }
    }

    /// For a filter, the probability that it stops a ray, which is the same for all directions. For
    /// a thin dielectric without other lobes, 1.
    pub fn scattered_share(&self) -> f32 {
        if self.share < 1.0 { 1.0 - self.share } else { 1.0 }
    }
}

impl Material {
    /// Returns the thin surface of the material. `None` if the material refracts, is opaque or
    /// emits light, or if the transmission varies over the surface.
    pub fn thin_surface(&self) -> Option<ThinSurface> {
        let varies = self.maps.varies_bsdf() || self.maps.has_bumps();
        let has_layers = self.clearcoat > 0.0 || !self.sheen.is_black();
        // Exclude lamps: light sampling assumes that rays always hit them
        let emits = !self.emission_factor().is_black();
        if !self.thin || self.transmission.is_black() || varies || has_layers || emits {
            return None;
        }
        let reflected = self.opaque_part().scattered();
        if reflected == 0.0 {
            return Some(ThinSurface {
                tint: self.transmission,
                share: 1.0,
                ior: self.ior,
            });
        }
        let passed = self.transmission.max_component();
        let share = passed / (passed + reflected);
        (self.ior == 1.0).then(|| ThinSurface {
            tint: self.transmission / share,
            share,
            ior: self.ior,
        })
    }

    /// BSDF at which rays scatter that do not pass. `None` if the material has no [`ThinSurface`].
    pub fn stopped_bsdf(&self) -> Option<Bsdf> {
        let surface = self.thin_surface()?;
        if surface.share == 1.0 {
            let reflectance = Spectrum::splat(self.transmission.max_component());
            let fresnel = Fresnel::Full;
            return Some(Bsdf::Single(Lobe::Mirror(Mirror { reflectance, fresnel })));
        }
        let mut rest = self.opaque_part();
        rest.diffuse = rest.diffuse / surface.scattered_share();
        rest.specular = rest.specular / surface.scattered_share();
        Some(rest.bsdf())
    }

    /// The material without its transmission.
    fn opaque_part(&self) -> Self {
        Self {
            name: String::new(),
            transmission: Spectrum::ZERO,
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::TransportMode;
    use crate::math::Vec3;

    fn thin(transmission: Spectrum, ior: f32) -> Material {
        Material {
            transmission,
            ior,
            thin: true,
            ..Material::default()
        }
    }

    /// Rays that pass by chance, and the mirror for all other rays, together equal the thin
    /// dielectric lobe: in their directions and in the fractions of the light.
    #[test]
    fn passing_and_mirror_equal_the_thin_dielectric() {
        let glass = thin(Spectrum::rgb(0.9, 0.8, 0.5), 1.5);
        let (surface, stopped) = (glass.thin_surface().unwrap(), glass.stopped_bsdf().unwrap());
        for cos in [1.0f32, 0.7, 0.5, 0.2, 0.05] {
            let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let pass = surface.pass_probability(cos);
            let [reflected, passed]: [Spectrum; 2] = [wo.with_x(-wo.x), -wo].map(|wi| {
                let bsdf = glass.bsdf();
                let mut all = bsdf.delta_directions(wo, TransportMode::Radiance);
                let sample = all.find(|sample| (sample.wi - wi).length() < 1e-6).unwrap();
                sample.f * sample.wi.z.abs()
            });
            let mirror = stopped.delta_directions(wo, TransportMode::Radiance).next().unwrap();
            let by_chance = [mirror.f * mirror.wi.z.abs() * (1.0 - pass), surface.tint * pass];
            for (a, b) in by_chance.into_iter().zip([reflected, passed]) {
                let difference = a + b * -1.0;
                assert!(
                    difference.to_array().iter().all(|d| d.abs() < 1e-6),
                    "{a:?} {b:?} at {cos}"
                );
            }
        }
    }

    #[test]
    fn filter_stops_the_share_that_its_lobes_reflect() {
        let filter = Material {
            diffuse: Spectrum::splat(0.2),
            ..thin(Spectrum::rgb(0.6, 0.3, 0.0), 1.0)
        };
        let (surface, stopped) = (filter.thin_surface().unwrap(), filter.stopped_bsdf().unwrap());
        assert!((surface.pass_probability(0.3) - 0.75).abs() < 1e-6);
        assert!((surface.scattered_share() - 0.25).abs() < 1e-6);
        let [r, g, b] = (surface.tint * 0.75).to_array();
        assert!((r - 0.6).abs() < 1e-6 && (g - 0.3).abs() < 1e-6 && b == 0.0);
        assert!((stopped.albedo().mean() * 0.25 - 0.2).abs() < 1e-6);
    }

    #[test]
    fn other_materials_have_no_pass_probability() {
        let glass = thin(Spectrum::splat(0.5), 1.5);
        let changes: [fn(&mut Material); 6] = [
            |m| m.thin = false,
            |m| m.transmission = Spectrum::ZERO,
            |m| m.diffuse = Spectrum::splat(0.1),
            |m| m.clearcoat = 1.0,
            |m| m.sheen = Spectrum::ONE,
            |m| m.emission = Spectrum::ONE,
        ];
        assert!(glass.thin_surface().is_some());
        for (i, change) in changes.iter().enumerate() {
            let mut material = glass.clone();
            change(&mut material);
            assert!(
                material.thin_surface().is_none() && material.stopped_bsdf().is_none(),
                "change {i}"
            );
        }
    }
}
