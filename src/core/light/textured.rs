//! Emitting triangles with an emission texture, or with opacity below 1.
//!
//! A point is sampled as on a triangle with constant emission. The emission at the point is looked
//! up in the finest level of the texture, as at a ray hit. In the choice of a light, the weight of
//! the triangle is the mean of the texture over the triangle. A coarse level of the texture may be
//! 0 around a texel that emits. A triangle of weight 0 is never chosen, and light sampling would
//! miss the light of this texel. Triangles that may emit therefore have a small minimum weight.
//!
//! A surface of opacity α emits α Le on average. A ray stops there with probability α and finds Le
//! (`TexturedTriangle::color`). A sampled point has α Le (`TexturedTriangle::mean_color`). Both
//! strategies estimate the same integral, so MIS weights do not depend on α.

use super::bounds::{LightBounds, ReceiverRegion};
use super::{Emission, LightSample, MovingTriangle, TriangleLight};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::uniform_triangle;
use crate::texture::{Mapping, Texture, TextureId};

/// The mean of a texture over a triangle is computed from parts of the triangle. Maximum number of
/// parts along a side.
const PARTS: f32 = 8.0;
/// Minimum weight of a triangle that may emit, in the choice of a light. It is a fraction of the
/// weight that the triangle would have if all its texels were as bright as the brightest texel.
const MIN_SHARE: f32 = 1.0 / 1024.0;

/// Variation of emission and opacity over a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Variation {
    /// Texture coordinates of the mesh's corners.
    pub uvs: [Vec2; 3],
    /// Texture that multiplies the radiance.
    pub emission: Option<(TextureId, Mapping)>,
    /// Opacity, in [0, 1].
    pub opacity: f32,
    /// Texture that multiplies the opacity.
    pub opacity_map: Option<(TextureId, Mapping)>,
    /// Opacities of the mesh's corners, which multiply the opacity too.
    pub alphas: [f32; 3],
}

/// A triangle whose emission varies with textures or opacity. Each point emits the same radiance in
/// every direction of the front side.
///
/// Every lookup uses the finest level, so a light sample and a ray hit at the same point have the
/// same radiance.
#[derive(Clone, Debug)]
pub struct TexturedTriangle {
    /// Triangle with constant emission. The textures multiply its radiance.
    even: UniformTriangle,
    variation: Variation,
    /// Mean over the triangle of the factor that multiplies the radiance of `even`. It includes
    /// opacity. In the choice of a light, the weight of this light is proportional to the mean.
    mean: Spectrum,
}

/// A triangle that emits the same radiance everywhere.
#[derive(Clone, Debug)]
pub(super) enum UniformTriangle {
    /// A triangle that does not move.
    Still(TriangleLight),
    /// A moving triangle.
    Moving(Box<MovingTriangle>),
}

impl TexturedTriangle {
    /// Multiplies the emission of `even` by the textures and the opacity of `variation`. `None` if
    /// the triangle then emits nowhere.
    pub(super) fn new(even: UniformTriangle, variation: Variation, textures: &[Texture]) -> Option<Self> {
        let mut light = Self {
            even,
            variation,
            mean: Spectrum::ZERO,
        };
        light.mean = light.mean_factor(textures);
        (!light.mean.is_black()).then_some(light)
    }

    /// The triangle at `time` with constant emission. Points are sampled on this triangle.
    pub fn at(&self, time: f32) -> TriangleLight {
        match &self.even {
            UniformTriangle::Still(light) => *light,
            UniformTriangle::Moving(light) => light.at(time),
        }
    }

    /// Returns true if the triangle moves.
    pub fn is_moving(&self) -> bool {
        matches!(self.even, UniformTriangle::Moving(_))
    }

    /// Number by which the radiance of the triangle [`TexturedTriangle::at`] is multiplied at the
    /// point with the barycentric coordinates `b1`, `b2` of the mesh's second and third corner.
    /// Opacity is not included.
    pub fn color(&self, b1: f32, b2: f32, textures: &[Texture]) -> Spectrum {
        self.color_at(b1, b2, 0.0, textures)
    }

    /// [`TexturedTriangle::color`] times the opacity at the point, and the opacity. The product is
    /// the mean over rays that stop at the surface and rays that pass through the surface.
    pub fn mean_color(&self, b1: f32, b2: f32, textures: &[Texture]) -> (Spectrum, f32) {
        let opacity = self.opacity_at(b1, b2, 0.0, textures);
        (self.color(b1, b2, textures) * opacity, opacity)
    }

    /// The triangle at `time`, with a radiance that is multiplied by the opacity. `None` if the
    /// emission is not constant over the triangle.
    pub(super) fn without_textures(&self, time: f32) -> Option<TriangleLight> {
        let Variation {
            emission,
            opacity_map,
            alphas,
            ..
        } = &self.variation;
        let is_even = emission.is_none() && opacity_map.is_none() && *alphas == [1.0; 3];
        is_even.then(|| {
            let light = self.at(time);
            light.emitting(light.radiance() * self.mean)
        })
    }

    /// Samples incident light at `p` and `time` from a point of the triangle. `None` if no light
    /// arrives or if the point is black.
    #[cold]
    pub(super) fn sample(&self, p: Vec3, time: f32, u: Vec2, textures: &[Texture]) -> Option<LightSample> {
        let triangle = self.at(time);
        let point = triangle.barycentrics(p, u);
        // `None` if `p` is behind the triangle
        let sample = triangle.sample_at(p, point)?;
        let (b1, b2) = triangle.of_mesh(point);
        let radiance = sample.radiance * self.mean_color(b1, b2, textures).0;
        (!radiance.is_black()).then_some(LightSample { radiance, ..sample })
    }

    /// Samples emitted light at `time`, from points uniform over the area, including black points.
    pub(super) fn sample_emission(
        &self,
        time: f32,
        u_position: Vec2,
        u_direction: Vec2,
        textures: &[Texture],
    ) -> Emission {
        let triangle = self.at(time);
        let point = uniform_triangle(u_position);
        let (b1, b2) = triangle.of_mesh(point);
        let emission = triangle.emission_at(point, u_direction);
        let (color, opacity) = self.mean_color(b1, b2, textures);
        Emission {
            radiance: emission.radiance * color,
            opacity,
            ..emission
        }
    }

    /// Power in watts: `π A L`, with the mean radiance.
    pub(super) fn power(&self) -> f64 {
        match &self.even {
            UniformTriangle::Still(light) => light.emitting(light.radiance() * self.mean).power(),
            UniformTriangle::Moving(light) => light.emitting(light.radiance() * self.mean).power(),
        }
    }

    /// Position, size and emission of a triangle with the mean radiance, for the light tree.
    pub(super) fn bounds(&self) -> LightBounds {
        match &self.even {
            UniformTriangle::Still(light) => light.emitting(light.radiance() * self.mean).bounds(),
            UniformTriangle::Moving(light) => light.emitting(light.radiance() * self.mean).at(0.5).bounds(),
        }
    }

    /// Estimate of the mean irradiance at `region`, without shadows.
    pub(super) fn irradiance(&self, region: &ReceiverRegion) -> f32 {
        match &self.even {
            UniformTriangle::Still(light) => light.emitting(light.radiance() * self.mean).irradiance(region),
            UniformTriangle::Moving(light) => light.emitting(light.radiance() * self.mean).irradiance(region),
        }
    }

    /// Texture coordinates at the barycentric coordinates `b1`, `b2` of the mesh's second and third
    /// corner.
    fn uv(&self, b1: f32, b2: f32) -> Vec2 {
        let [t0, t1, t2] = self.variation.uvs;
        (1.0 - b1 - b2) * t0 + b1 * t1 + b2 * t2
    }

    fn color_at(&self, b1: f32, b2: f32, footprint: f32, textures: &[Texture]) -> Spectrum {
        self.variation.emission.map_or(Spectrum::ONE, |(id, mapping)| {
            mapping.color(&textures[id.0 as usize], self.uv(b1, b2), footprint)
        })
    }

    fn opacity_at(&self, b1: f32, b2: f32, footprint: f32, textures: &[Texture]) -> f32 {
        let share = self.variation.opacity_map.map_or(1.0, |(id, mapping)| {
            mapping.value(&textures[id.0 as usize], self.uv(b1, b2), footprint)
        });
        let [a0, a1, a2] = self.variation.alphas;
        let alpha = (1.0 - b1 - b2) * a0 + b1 * a1 + b2 * a2;
        (self.variation.opacity * share * alpha).clamp(0.0, 1.0)
    }

    /// Mean over the triangle of the factor that multiplies the radiance. It includes opacity. The
    /// triangle is divided into at most 64 parts, if possible of the size of a texel. Each part has
    /// one lookup at its middle.
    ///
    /// The mean is 0 only if no point of the triangle emits. If all lookups are 0, the texels
    /// around the triangle are searched, unless there are too many. If one of these texels emits or
    /// may emit, the mean is a small fraction of the value of the brightest texel.
    fn mean_factor(&self, textures: &[Texture]) -> Spectrum {
        let [t0, t1, t2] = self.variation.uvs;
        let area = 0.5 * (t1 - t0).perp_dot(t2 - t0).abs();
        let maps = [self.variation.emission, self.variation.opacity_map];
        let texels = maps.into_iter().flatten().map(|(id, mapping)| {
            let (width, height) = textures[id.0 as usize].size();
            area * (mapping.scale.x * mapping.scale.y).abs() * width as f32 * height as f32
        });
        let texels = texels.fold(1.0, f32::max);
        // Use `min`, because `clamp` would return NaN for NaN.
        let alphas = self.variation.alphas;
        let n = if alphas != [alphas[0]; 3] {
            PARTS
        } else if texels > 1.0 {
            texels.sqrt().ceil().min(PARTS)
        } else {
            1.0
        };
        let footprint = area.sqrt() / n;
        let factor = |b1, b2| self.color_at(b1, b2, footprint, textures) * self.opacity_at(b1, b2, footprint, textures);
        let mut sum = Spectrum::ZERO;
        for (i, j) in (0..n as u32).flat_map(|i| (0..n as u32 - i).map(move |j| (i as f32, j as f32))) {
            // Add a part oriented like the triangle, and an inverted part beside it
            let third = 1.0 / 3.0;
            sum += factor((i + third) / n, (j + third) / n);
            if i + j + 1.0 < n {
                sum += factor((i + 2.0 * third) / n, (j + 2.0 * third) / n);
            }
        }
        if !sum.is_black() {
            return sum / (n * n);
        }

        // Largest factor of each map within the triangle; 0 if all texels are black
        let largest = |(id, mapping): (TextureId, Mapping)| {
            let texture = &textures[id.0 as usize];
            let Mapping { base, gain, .. } = mapping;
            let corners = self.variation.uvs.map(|uv| mapping.st(uv));
            let [low, high] = [Vec2::min, Vec2::max].map(|of| of(of(corners[0], corners[1]), corners[2]));
            let keeps_black = base <= 0.0 && gain >= 0.0;
            if keeps_black && texture.is_black_within(low, high) {
                0.0
            } else {
                (base + gain * texture.max_value()).max(base).max(0.0)
            }
        };
        let alpha = self.variation.alphas.into_iter().fold(0.0, f32::max);
        let opacity = alpha * self.variation.opacity * self.variation.opacity_map.map_or(1.0, largest);
        let brightest = self.variation.emission.map_or(1.0, largest) * opacity.min(1.0);
        Spectrum::splat(MIN_SHARE * brightest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{AreaLight, Light, TriangleSampling};
    use crate::texture::{Curve, Texels, Wrap};

    /// A texture of 256 × 256 black texels, except the texel in column `x` and row `y`, which emits
    /// 1.
    fn lone_texel(x: usize, y: usize, wrap: Wrap) -> Texture {
        let mut codes = vec![0; 256 * 256];
        codes[y * 256 + x] = 255;
        Texture::new(256, 256, 1, Texels::Bytes(codes, Curve::Srgb), wrap).unwrap()
    }

    fn light(uvs: [[f32; 2]; 3], mapping: Mapping, texture: Texture) -> Light {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let triangle = TriangleLight::new(corners, Spectrum::splat(3.0), TriangleSampling::Area);
        let variation = Variation {
            uvs: uvs.map(Vec2::from),
            emission: Some((TextureId(0), mapping)),
            opacity: 1.0,
            opacity_map: None,
            alphas: [1.0; 3],
        };
        AreaLight::from(triangle).varied(variation, &[texture]).into()
    }

    const LOWER: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    #[test]
    fn power_is_proportional_to_the_mean_texel() {
        // The texture is a ramp from 0 to 1 in u. Its mean over the lower left half of the square
        // is 1/3.
        let ramp = (0..64 * 64).map(|i| (i % 64) as f32 / 63.0).collect();
        let texture = Texture::new(64, 64, 1, Texels::Floats(ramp), Wrap::Clamp).unwrap();
        let power = light(LOWER, Mapping::default(), texture).power(1.0);
        let expected = std::f64::consts::PI * 0.5 * 3.0 / 3.0;
        assert!((power / expected - 1.0).abs() < 0.01, "{power} {expected}");
    }

    #[test]
    fn power_is_proportional_to_opacity() {
        let ramp = || {
            let ramp = (0..64 * 64).map(|i| (i % 64) as f32 / 63.0).collect();
            Texture::new(64, 64, 1, Texels::Floats(ramp), Wrap::Clamp).unwrap()
        };
        let power = |variation: Variation, textures: &[Texture]| {
            let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
            let triangle = TriangleLight::new(corners, Spectrum::splat(3.0), TriangleSampling::Area);
            let light = AreaLight::from(triangle).varied(variation, textures).power();
            light / (std::f64::consts::PI * 0.5 * 3.0)
        };
        let half = Variation {
            uvs: LOWER.map(Vec2::from),
            emission: None,
            opacity: 0.5,
            opacity_map: None,
            alphas: [1.0; 3],
        };
        assert!((power(half, &[]) - 0.5).abs() < 1e-6);
        assert_eq!(power(Variation { opacity: 0.0, ..half }, &[]), 0.0);
        // Means of u and of u² over the triangle: 1/3 and 1/6
        let map = Some((TextureId(0), Mapping::default()));
        let masked = Variation {
            opacity_map: map,
            ..half
        };
        assert!((power(masked, &[ramp()]) - 0.5 / 3.0).abs() < 0.002);
        let both = Variation {
            emission: map,
            ..masked
        };
        assert!((power(both, &[ramp()]) - 0.5 / 6.0).abs() < 0.002);
    }

    #[test]
    fn power_is_zero_only_without_emission() {
        let plain = Mapping::default();
        // The lookups use a coarse level, in which a single texel is too small to appear.
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            assert!(
                light(LOWER, plain, lone_texel(40, 200, wrap)).power(1.0) > 0.0,
                "{wrap:?}"
            );
        }
        // Test small triangles near the emitting texel, which is at u = 40.5/256 and v = 55.5/256,
        // and triangles away from this texel
        let at =
            |x: f32, y: f32, size: f32| [[x, y], [x + size, y], [x, y + size]].map(|[x, y]| [x / 256.0, y / 256.0]);
        for (shift, emits) in [(0.0, true), (-0.9, true), (0.9, true), (6.0, false), (-30.0, false)] {
            for turns in [-2.0, 0.0, 3.0] {
                let uvs = at(40.5 + shift + 256.0 * turns, 55.5, 0.5);
                let light = light(uvs, plain, lone_texel(40, 200, Wrap::Repeat));
                assert_eq!(light.power(1.0) > 0.0, emits, "{shift} {turns}");
                assert_eq!(matches!(light, Light::Area(AreaLight::Triangle(_))), !emits);
            }
        }
        // Test a long triangle whose parts are larger than the texel and only touch it
        let touching = at(1.0, 54.9, 1.2).map(|[u, v]| if u > 0.006 { [0.2, v] } else { [u, v] });
        assert!(light(touching, plain, lone_texel(40, 200, Wrap::Repeat)).power(1.0) > 0.0);
        // The offset of a mapping emits, and a negative offset removes emission.
        let moved = |base, gain| Mapping { base, gain, ..plain };
        let away = at(200.0, 100.0, 1.0);
        let power = |mapping| light(away, mapping, lone_texel(40, 200, Wrap::Repeat)).power(1.0);
        assert!(power(moved(0.5, 1.0)) > 0.0 && power(moved(1.0, -1.0)) > 0.0);
        assert_eq!(power(moved(-1.0, 1.0)), 0.0);
        // Test extreme coordinates
        for wild in [1e30f32, -3e38] {
            let uvs = [[wild, 0.0], [0.0, wild], [wild, -wild]];
            assert!(light(uvs, plain, lone_texel(0, 0, Wrap::Repeat)).power(1.0) > 0.0);
        }
    }
}
