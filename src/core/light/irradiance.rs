//! Irradiance of a plane without occlusion, in closed form or by quadrature. The ground compares
//! the arriving light with this irradiance (`scene/ground.rs`).

use super::environment::EnvironmentLight;
use super::triangle::TriangleLight;
use super::{DiskLight, Light, LightSample, SunLight};
use crate::color::Spectrum;
use crate::math::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

impl Light {
    /// Returns true if the light is infinitely far away and so sends the same light to all points.
    pub fn is_infinite(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Directional(_) | Self::Sun(_) | Self::Environment(_) => true,
            Self::Area(_) | Self::Point(_) | Self::Spot(_) => false,
        }
    }

    /// Unoccluded irradiance, W·m⁻², at the point `p` of a surface with unit normal `n` at `time`;
    /// `None` if unknown.
    pub fn irradiance_at(&self, p: Vec3, n: Vec3, time: f32) -> Option<Spectrum> {
        let of_point = |sample: Option<LightSample>| {
            sample.map_or(Spectrum::ZERO, |light| light.radiance * light.wi.dot(n).max(0.0))
        };
        match self {
            Self::Constant(light) => Some(light.radiance * PI as f32),
            Self::Directional(light) => Some(of_point(Some(light.sample()))),
            Self::Sun(light) => Some(of_sun(light, n)),
            Self::Environment(light) => Some(of_environment(light, n)),
            Self::Point(light) => Some(of_point(light.sample(p))),
            Self::Spot(light) => Some(of_point(light.sample(p))),
            Self::Area(light) => light.irradiance_at(p, n, time),
        }
    }
}

/// Number of quadrature points along each side of the unit square, which is mapped to the sun's
/// disc.
const DISC_PLACES: usize = 256;

/// `∫ L (w · n)⁺ dw` over the disc of a sun: in closed form if the whole disc is above the surface,
/// else by the midpoint rule.
fn of_sun(light: &SunLight, n: Vec3) -> Spectrum {
    let (towards, sin) = light.cone();
    let cos = towards.dot(n);
    if cos >= sin {
        return light.facing_irradiance() * cos;
    }
    let place = |i: usize| (i as f32 + 0.5) / DISC_PLACES as f32;
    let samples = (0..DISC_PLACES * DISC_PLACES).map(|i| {
        let LightSample { wi, radiance, pdf, .. } =
            light.sample(Vec2::new(place(i % DISC_PLACES), place(i / DISC_PLACES)));
        let weight = f64::from(wi.dot(n).max(0.0)) / f64::from(pdf);
        radiance.to_array().map(|channel| f64::from(channel) * weight)
    });
    let sum = samples.fold([0.0; 3], |sum: [f64; 3], sample| {
        std::array::from_fn(|c| sum[c] + sample[c])
    });
    Spectrum::from(sum.map(|sum| (sum / (DISC_PLACES * DISC_PLACES) as f64) as f32))
}

/// Minimum number of quadrature points along the longer side of an environment's image.
const PLACES: usize = 1024;

/// `∫ L(w) (w · n)⁺ dw` by the midpoint rule over the image. Radiance is linear between texel
/// centres. If the number of quadrature cells per texel is even, texel centres are borders of
/// cells, so radiance is linear within each cell.
fn of_environment(light: &EnvironmentLight, n: Vec3) -> Spectrum {
    let [width, height] = light.size();
    let places = match width.max(height) {
        long if long >= 2 * PLACES => 1,
        long => 2 * PLACES.div_ceil(2 * long.max(1)),
    };
    let (columns, rows) = (width * places, height * places);
    let mut sum = [0.0f64; 3];
    for y in 0..rows {
        let theta = PI * (y as f64 + 0.5) / rows as f64;
        // Compute the exact solid angle of a row's cells
        let [above, below] = [y, y + 1].map(|y| (PI * y as f64 / rows as f64).cos());
        let solid_angle = 2.0 * PI / columns as f64 * (above - below);
        for x in 0..columns {
            let (w, radiance) = light.at((x as f64 + 0.5) / columns as f64, theta / PI);
            let weight = solid_angle * w.dot(n).max(0.0) as f64;
            if weight > 0.0 {
                for (sum, value) in sum.iter_mut().zip(radiance.to_array()) {
                    *sum += weight * value as f64;
                }
            }
        }
    }
    Spectrum::from(sum.map(|v| v as f32))
}

/// Irradiance at `p` by a triangle of constant radiance: `E = L / 2 · Σ βᵢ n · (rᵢ × rᵢ₊₁) / |rᵢ ×
/// rᵢ₊₁|`, where rᵢ is the vector from `p` to corner i, and βᵢ the angle between rᵢ and rᵢ₊₁
/// (Lambert 1760; Arvo 1995, "Analytic Methods for Simulated Light Transport", §4.2). The sum is
/// over the corners of the part of the triangle that is above the horizon.
pub(super) fn of_triangle(light: &TriangleLight, p: Vec3, n: Vec3) -> Spectrum {
    light.radiance() * of_polygon(&light.corners(), light.normal(), p, n)
}

/// Sides of the polygon that approximates a disk.
const DISK_SIDES: u32 = 128;

/// Irradiance at `p` by a disk.
pub(super) fn of_disk(light: &DiskLight, p: Vec3, n: Vec3) -> Spectrum {
    let corners: Vec<Vec3> = light.polygon(DISK_SIDES).collect();
    light.radiance() * of_polygon(&corners, light.normal(), p, n)
}

/// Irradiance divided by radiance, at the point `p` with unit normal `n`, of a convex polygon whose
/// front has the unit normal `front`.
pub(super) fn of_polygon(corners: &[Vec3], front: Vec3, p: Vec3, n: Vec3) -> f32 {
    let (p, n) = (p.as_dvec3(), n.as_dvec3());
    let corners: Vec<DVec3> = corners.iter().map(|corner| corner.as_dvec3() - p).collect();
    // The point must be in front of the light: a corner is then behind the plane through `p`.
    if corners[0].dot(front.as_dvec3()) >= 0.0 {
        return 0.0;
    }
    // Clip the polygon to the part above the horizon (Sutherland and Hodgman 1974)
    let mut above: Vec<DVec3> = Vec::with_capacity(corners.len() + 1);
    for i in 0..corners.len() {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha > 0.0 {
            above.push(a);
        }
        if (ha > 0.0) != (hb > 0.0) {
            above.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    let edge = |i: usize| {
        let (a, b) = (above[i], above[(i + 1) % above.len()]);
        let cross = a.cross(b);
        let length = cross.length();
        if length > 0.0 {
            length.atan2(a.dot(b)) * n.dot(cross) / length
        } else {
            0.0
        }
    };
    let sum: f64 = (0..above.len()).map(edge).sum();
    // The sign depends on the winding.
    (0.5 * sum.abs()) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{ConstantLight, LatLongImage, PointLight, TriangleSampling};
    use crate::math::Frame;
    use crate::math::{Quat, Vec2};
    use crate::sampling::warp::cosine_hemisphere;

    fn irradiance(light: &Light, p: Vec3, n: Vec3) -> f32 {
        light.irradiance_at(p, n, 0.0).unwrap().mean()
    }

    #[test]
    fn uniform_light_is_pi() {
        let constant = Light::Constant(ConstantLight {
            radiance: Spectrum::ONE,
        });
        assert_eq!(irradiance(&constant, Vec3::ZERO, Vec3::Y), PI as f32);
        for (width, height) in [(1, 1), (7, 3), (64, 32)] {
            let image = LatLongImage {
                width,
                height,
                texels: vec![Spectrum::splat(0.5); width * height],
            };
            let light = EnvironmentLight::new(image, 2.0, Quat::from_rotation_x(0.7));
            for n in [Vec3::Y, Vec3::new(1.0, 2.0, -0.5).normalize()] {
                let found = irradiance(&Light::Environment(Box::new(light.clone())), Vec3::ONE, n);
                assert!((found / PI as f32 - 1.0).abs() < 2e-5, "{width}x{height}, {n}: {found}");
            }
        }
    }

    /// The irradiance by an environment is π times the mean radiance of cosine-weighted directions.
    #[test]
    fn environments_are_integrated() {
        let (width, height) = (16, 8);
        let texel = |i: usize| Spectrum::splat(if i % 37 == 20 { 50.0 } else { (i % 5) as f32 });
        let image = LatLongImage {
            width,
            height,
            texels: (0..width * height).map(texel).collect(),
        };
        let light = EnvironmentLight::new(image, 1.0, Quat::from_rotation_y(0.4));
        let n = Vec3::new(0.3, 0.8, -0.2).normalize();
        let frame = Frame::from_z(n);
        const N: usize = 1200;
        let place = |i: usize| (i as f32 + 0.5) / N as f32;
        let points = (0..N * N).map(|i| Vec2::new(place(i % N), place(i / N)));
        let sum: f64 = points
            .map(|u| light.radiance(frame.to_world(cosine_hemisphere(u))).mean() as f64)
            .sum();
        let expected = PI * sum / (N * N) as f64;
        let found = irradiance(&Light::Environment(Box::new(light)), Vec3::ZERO, n) as f64;
        assert!((found / expected - 1.0).abs() < 3e-4, "{found}, {expected}");
    }

    #[test]
    fn triangle_irradiance_is_the_mean_of_its_samples() {
        let corners = [
            Vec3::new(-1.0, 2.0, 0.5),
            Vec3::new(2.0, 1.0, -1.0),
            Vec3::new(0.5, -1.0, 1.5),
        ];
        for turned in [false, true] {
            let [a, b, c] = corners;
            let corners = if turned { [a, c, b] } else { [a, b, c] };
            let light = TriangleLight::new(corners, Spectrum::splat(3.0), TriangleSampling::Area);
            let light = Light::from(light);
            for (p, n) in [
                (Vec3::ZERO, Vec3::Y),
                (Vec3::new(0.0, -2.0, 0.0), Vec3::Y),
                (Vec3::new(0.4, 0.2, 2.0), Vec3::new(0.5, -1.0, -1.0).normalize()),
            ] {
                const N: usize = 500;
                let place = |i: usize| (i as f32 + 0.5) / N as f32;
                let mut sum = 0.0;
                for i in 0..N * N {
                    let u = Vec2::new(place(i % N), place(i / N));
                    if let Some(sample) = light.sample(p, 0.0, u, &[]) {
                        let cos = sample.wi.dot(n).max(0.0);
                        sum += (sample.radiance.mean() * cos / sample.pdf) as f64;
                    }
                }
                let expected = sum / (N * N) as f64;
                let found = irradiance(&light, p, n) as f64;
                assert!(
                    (found - expected).abs() < 2e-3 * expected.max(0.01),
                    "{p}, {n}: {found}, {expected}"
                );
            }
        }
    }

    #[test]
    fn points_fall_off() {
        let light = Light::Point(PointLight {
            position: Vec3::new(3.0, 4.0, 0.0),
            intensity: Spectrum::splat(50.0),
        });
        assert!((irradiance(&light, Vec3::ZERO, Vec3::Y) - 1.6).abs() < 1e-5);
        assert_eq!(irradiance(&light, Vec3::ZERO, Vec3::NEG_Y), 0.0);
    }
}
