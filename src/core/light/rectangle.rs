//! Rectangles that emit on one side.
//!
//! Directions are uniform over the solid angle (`sampling/spherical_rectangle.rs`) if the rectangle
//! is near. A rectangle that is far away, or is seen from near its plane, is sampled by area.

use super::bounds::{LightBounds, ReceiverRegion};
use super::{Emission, LightSample, area_pdf};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, encode_fields, float::gamma};
use crate::sampling::spherical_rectangle::SphericalRectangle;
use crate::sampling::warp::cosine_hemisphere_pdf;
use std::f64::consts::PI;

/// A rectangle that emits the same radiance in every direction of its front side.
#[derive(Clone, Copy, Debug)]
pub struct RectangleLight {
    corner: Vec3,
    /// Unit vectors along the edges.
    axes: [Vec3; 2],
    /// Lengths of the edges.
    lengths: [f32; 2],
    /// Unit normal of the front.
    normal: Vec3,
    radiance: Spectrum,
    /// Distance of ray origins from the surface of the rectangle, scene units.
    ray_offset: f32,
}

encode_fields!(RectangleLight {
    corner,
    axes,
    lengths,
    normal,
    radiance,
    ray_offset,
});

impl RectangleLight {
    /// The rectangle with the corner `corner` and two orthogonal edges, emitting `radiance`,
    /// W·sr⁻¹·m⁻². The cross product of the edges points to the front.
    pub fn new(corner: Vec3, edges: [Vec3; 2], radiance: Spectrum) -> Self {
        let [a, b] = edges;
        let corners = [corner, corner + a, corner + a + b, corner + b];
        let largest = corners
            .iter()
            .fold(Vec3::ZERO, |largest, corner| largest.max(corner.abs()));
        Self {
            corner,
            axes: edges.map(|edge| edge.normalize_or(Vec3::X)),
            lengths: edges.map(Vec3::length),
            normal: edges[0].cross(edges[1]).normalize_or(Vec3::Z),
            radiance,
            // Bound the rounding errors of a corner and of a vector to the corner
            ray_offset: gamma(32) * largest.max_element(),
        }
    }

    /// Unit normal of the front.
    pub(super) fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Radiance of the front.
    pub(super) fn radiance(&self) -> Spectrum {
        self.radiance
    }

    /// Edges at the corner.
    fn edges(&self) -> [Vec3; 2] {
        let ([a, b], [width, height]) = (self.axes, self.lengths);
        [width * a, height * b]
    }

    /// Corners, in the order of the winding.
    pub(super) fn corners(&self) -> [Vec3; 4] {
        let ([a, b], p) = (self.edges(), self.corner);
        [p, p + a, p + a + b, p + b]
    }

    /// Radiance that leaves the rectangle in direction `w`.
    pub fn emitted(&self, w: Vec3) -> Spectrum {
        if w.dot(self.normal) > 0.0 {
            self.radiance
        } else {
            Spectrum::ZERO
        }
    }

    /// Solid angle that the rectangle has at `p`. `None` if the rectangle is sampled by area for
    /// the receiving point `p`. The rectangle is sampled by solid angle only if the distance
    /// between `p` and the middle of the rectangle is at most the length of the diagonal. Farther
    /// away, the lower error is not worth the time (docs/notebook/2026-11.md, "Rectangles").
    #[inline(always)]
    fn seen(&self, p: Vec3) -> Option<SphericalRectangle> {
        let [width, height] = self.lengths;
        if p.distance_squared(self.point(Vec2::splat(0.5))) > width * width + height * height {
            return None;
        }
        SphericalRectangle::new(self.corner, self.axes, self.lengths, p).filter(SphericalRectangle::is_accurate)
    }

    fn point(&self, u: Vec2) -> Vec3 {
        self.corner + u.x * self.lengths[0] * self.axes[0] + u.y * self.lengths[1] * self.axes[1]
    }

    /// Samples incident light at `p` from a point of the rectangle.
    #[inline(never)]
    pub(super) fn sample(&self, p: Vec3, u: Vec2) -> Option<LightSample> {
        let [sample] = self.draw(p, [u]);
        sample
    }

    /// Samples incident light at `p` from four points, like four calls of
    /// [`RectangleLight::sample`].
    #[inline(never)]
    pub(crate) fn sample_four(&self, p: Vec3, u: [Vec2; 4]) -> [Option<LightSample>; 4] {
        self.draw(p, u)
    }

    #[inline(always)]
    fn draw<const N: usize>(&self, p: Vec3, u: [Vec2; N]) -> [Option<LightSample>; N] {
        if (p - self.corner).dot(self.normal) <= 0.0 {
            return [None; N];
        }
        let mut samples = [None; N];
        let sample = |q, wi, pdf| LightSample {
            wi,
            radiance: self.radiance,
            pdf,
            is_delta: false,
            target: Some(q + self.normal * self.ray_offset),
        };
        if let Some(seen) = self.seen(p) {
            let pdf = 1.0 / seen.solid_angle();
            for (drawn, (to, wi)) in samples.iter_mut().zip(seen.sample(u)) {
                *drawn = Some(sample(p + to, wi, pdf));
            }
        } else {
            let area = self.area();
            for (drawn, u) in samples.iter_mut().zip(u) {
                let q = self.point(u);
                let Some(wi) = (q - p).try_normalize() else { continue };
                let pdf = area_pdf(p, q, wi, self.normal, area);
                *drawn = (pdf > 0.0).then(|| sample(q, wi, pdf));
            }
        }
        samples
    }

    /// Density per solid angle with which the direction `wi` from `p` to the point `q` of the
    /// rectangle is sampled. 0 if `p` is behind the rectangle.
    pub fn pdf(&self, p: Vec3, q: Vec3, wi: Vec3) -> f32 {
        if (p - self.corner).dot(self.normal) <= 0.0 {
            return 0.0;
        }
        match self.seen(p) {
            Some(seen) => 1.0 / seen.solid_angle(),
            None => area_pdf(p, q, wi, self.normal, self.area()),
        }
    }

    /// Samples emitted light: a point uniform over the area, and a direction with a density
    /// proportional to the cosine.
    pub(super) fn sample_emission(&self, u_position: Vec2, u_direction: Vec2) -> Emission {
        let p = self.point(u_position);
        let pdf_position = (1.0 / self.area()) as f32;
        Emission::of_surface(
            p,
            self.normal,
            self.ray_offset,
            self.radiance,
            pdf_position,
            u_direction,
        )
    }

    /// Densities of emission sampling: per area for the start point, and per solid angle for the
    /// unit direction `w` if the normal is `ng`.
    pub(super) fn emission_pdfs(&self, ng: Vec3, w: Vec3) -> [f32; 2] {
        [(1.0 / self.area()) as f32, cosine_hemisphere_pdf(w.dot(ng))]
    }

    /// Bounding sphere and emission of the light, for distant points.
    pub(super) fn bounds(&self) -> LightBounds {
        let [a, b] = self.edges();
        LightBounds {
            center: self.point(Vec2::splat(0.5)),
            radius: 0.5 * (a + b).length(),
            intensity: self.area() as f32 * self.radiance.luminance(),
            axis: self.normal,
            spread: 0.0,
        }
    }

    /// Estimate of the mean irradiance at `region`: the mean over a grid of points on the
    /// rectangle.
    pub(super) fn irradiance(&self, region: &ReceiverRegion) -> f32 {
        const N: u32 = 4;
        let whole = self.bounds();
        let places = (0..N * N).map(|i| (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32);
        let at = |u| {
            region.irradiance(&LightBounds {
                center: self.point(u),
                radius: 0.0,
                ..whole
            })
        };
        places.map(at).sum::<f32>() / (N * N) as f32
    }

    /// Area in square scene units.
    pub(super) fn area(&self) -> f64 {
        f64::from(self.lengths[0]) * f64::from(self.lengths[1])
    }

    /// Power in watts: `π A L`.
    pub(super) fn power(&self) -> f64 {
        PI * self.area() * f64::from(self.radiance.luminance())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests points near the rectangle (sampled by solid angle), far from it, and behind it.
    #[test]
    fn four_samples_are_bit_identical_to_single_samples() {
        let edges = [Vec3::new(0.8, 0.6, 0.0), Vec3::new(-0.9, 1.2, 0.0)];
        let light = RectangleLight::new(Vec3::new(-0.4, 0.3, 1.5), edges, Spectrum::ONE);
        let u = [[0.1, 0.2], [0.9, 0.3], [0.0, 0.999], [0.5, 0.5]].map(Vec2::from);
        for (height, expected) in [(2.0, 4), (40.0, 4), (1.0, 0)] {
            let p = Vec3::new(0.1, 0.9, height);
            let four = light.sample_four(p, u);
            assert_eq!(four.iter().flatten().count(), expected, "{height}");
            for (of_four, u) in four.iter().zip(u) {
                assert_eq!(format!("{of_four:?}"), format!("{:?}", light.sample(p, u)));
            }
        }
    }
}
