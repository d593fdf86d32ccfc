//! Estimates of irradiance and its gradients from rays over a stratified hemisphere.

use super::record::Gradients;
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, sin_cos_turns};
use std::array::from_fn;
use std::f32::consts::PI;

/// A hemisphere divided into strata of equal projected solid angle: rows from the normal (the local
/// +z) to the horizon, columns around the normal (Ward and Heckbert 1992, "Irradiance Gradients").
#[derive(Clone, Copy, Debug)]
pub struct Strata {
    rows: u32,
    columns: u32,
}

/// Result of a hemisphere ray: radiance and distance.
#[derive(Clone, Copy, Debug)]
pub struct HemisphereHit {
    /// Radiance along the ray.
    pub radiance: Spectrum,
    /// Distance of the hit, in scene units; infinite if the ray hits no surface.
    pub distance: f32,
}

impl HemisphereHit {
    /// Result of a ray that finds no light and no surface.
    pub const NOTHING: Self = Self {
        radiance: Spectrum::ZERO,
        distance: f32::INFINITY,
    };
}

/// Irradiance from a whole hemisphere, with its gradients.
#[derive(Clone, Copy, Debug)]
pub struct GatheredHemisphere {
    /// Irradiance, W·m⁻².
    pub irradiance: Spectrum,
    /// Gradients of the irradiance, in the local frame.
    pub gradients: Gradients,
    /// Cosine-weighted harmonic mean of the distances of the hits, in scene units; infinite if no
    /// ray hits a surface.
    pub distance: f32,
    /// Number of effective rays: `(Σ L)² / Σ L²` with the luminance L of each ray; infinite if
    /// there is no light.
    pub effective_rays: f32,
}

impl Strata {
    /// Strata for about `rays` rays. There are π times as many columns as rows, so that strata
    /// halfway between normal and horizon are about as wide as high.
    pub fn new(rays: u32) -> Self {
        let rows = (rays as f32 / PI).sqrt().round().max(2.0);
        Self {
            rows: rows as u32,
            columns: (rays as f32 / rows).round().max(4.0) as u32,
        }
    }

    /// Number of rays: one for each stratum.
    pub fn rays(&self) -> u32 {
        self.rows * self.columns
    }

    /// Unit direction of the ray `index`, in the local frame. `u` is the position of the ray within
    /// its stratum, in [0, 1)².
    pub fn direction(&self, index: u32, u: Vec2) -> Vec3 {
        let (row, column) = (index / self.columns, index % self.columns);
        let squared = (row as f32 + u.x) / self.rows as f32;
        let (sin, cos) = sin_cos_turns((column as f32 + u.y) / self.columns as f32);
        let r = squared.sqrt();
        Vec3::new(r * cos, r * sin, (1.0 - squared).max(0.0).sqrt())
    }

    /// Computes irradiance and gradients from the results `seen` of the rays, in the order of the
    /// strata. A missing ray counts as a ray that finds no light and no surface.
    pub fn gather(&self, seen: &[HemisphereHit]) -> GatheredHemisphere {
        let count = self.rays() as f32;
        let radiance = seen.iter().fold(Spectrum::ZERO, |sum, ray| sum + ray.radiance);
        let squares: f64 = seen.iter().map(|ray| (ray.radiance.luminance() as f64).powi(2)).sum();
        let nearness: f32 = seen.iter().map(|ray| 1.0 / ray.distance).sum();
        GatheredHemisphere {
            irradiance: radiance * (PI / count),
            gradients: Gradients {
                rotational: self.rotational(seen),
                translational: self.translational(seen),
            },
            distance: count / nearness,
            effective_rays: if squares > 0.0 {
                ((radiance.luminance() as f64).powi(2) / squares) as f32
            } else {
                f32::INFINITY
            },
        }
    }

    /// Rotational gradient (Ward and Heckbert 1992, the rotation gradient). The axis that rotates
    /// the normal towards a direction lies a quarter turn beyond the azimuth of the direction. A
    /// small rotation increases the cosine between normal and direction in proportion to the sine
    /// of their angle.
    fn rotational(&self, seen: &[HemisphereHit]) -> [Vec3; 3] {
        let Self { rows, columns } = *self;
        let mut sums = [Vec3::ZERO; 3];
        for column in 0..columns {
            let mut sum = Spectrum::ZERO;
            for row in 0..rows {
                let squared = (row as f32 + 0.5) / rows as f32;
                let tan = (squared / (1.0 - squared)).sqrt();
                if let Some(ray) = seen.get((row * columns + column) as usize) {
                    sum += ray.radiance * tan;
                }
            }
            let axis = self.tangent(column as f32 + 0.5, 0.25);
            add(&mut sums, sum * (PI / (rows * columns) as f32), axis);
        }
        sums
    }

    /// Translational gradient (Ward and Heckbert 1992, the translation gradient). Radiance differs
    /// across the boundary between two strata. If the point moves, the boundary moves in the
    /// opposite direction, and faster if the boundary is nearer. The distance of the boundary is
    /// the distance of the nearer side, which hides the other side.
    fn translational(&self, seen: &[HemisphereHit]) -> [Vec3; 3] {
        let Self { rows, columns } = *self;
        let ray = |row: u32, column: u32| {
            seen.get((row * columns + column) as usize)
                .unwrap_or(&HemisphereHit::NOTHING)
        };
        let sin_to = |row: u32| (row as f32 / rows as f32).sqrt();
        let mut sums = [Vec3::ZERO; 3];
        for column in 0..columns {
            // Sum over boundaries between rows. These boundaries move towards the normal if the
            // point moves along the azimuth
            let mut along = Spectrum::ZERO;
            for row in 1..rows {
                let (inner, outer) = (ray(row - 1, column), ray(row, column));
                let sin = sin_to(row);
                let rate = 2.0 * PI / columns as f32 * sin * (1.0 - sin * sin) / inner.distance.min(outer.distance);
                along += (outer.radiance - inner.radiance) * rate;
            }
            add(&mut sums, along, self.tangent(column as f32 + 0.5, 0.0));

            // Sum over boundaries with the previous column. These boundaries rotate away if the
            // point moves across the azimuth
            let mut across = Spectrum::ZERO;
            let before = (column + columns - 1) % columns;
            for row in 0..rows {
                let (last, next) = (ray(row, before), ray(row, column));
                let rate = (sin_to(row + 1) - sin_to(row)) / last.distance.min(next.distance);
                across += (next.radiance - last.radiance) * rate;
            }
            add(&mut sums, across, self.tangent(column as f32, 0.25));
        }
        sums
    }

    /// Unit tangent vector at the azimuth of `column` plus `turns` full turns.
    fn tangent(&self, column: f32, turns: f32) -> Vec3 {
        let (sin, cos) = sin_cos_turns(column / self.columns as f32 + turns);
        Vec3::new(cos, sin, 0.0)
    }
}

/// Adds `direction`, multiplied by the channels of `factor`, to the sums of the channels.
fn add(sums: &mut [Vec3; 3], factor: Spectrum, direction: Vec3) {
    let factor = factor.to_array();
    *sums = from_fn(|c| sums[c] + direction * factor[c]);
}
