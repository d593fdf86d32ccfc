//! Background of camera rays that no surface stops, and the shadow-catching ground.
//!
//! Only camera rays see the background, including camera rays that passed straight through surfaces
//! of opacity below 1. Mirrors and glass show the lights instead. So a change of the background
//! changes only the pixels that show the background.
//!
//! An integrator passes the background or the ground that the camera ray sees (`CameraView`) to its
//! sink, and the sink uses this view to finish the sample. The light of a sample is linear in the
//! throughput at the first vertex. So the sink can multiply all light of a sample on the ground by
//! one factor, and path reuse, roulette and MIS weights do not depend on the ground.

use super::{FoundLight, LightSource};
use crate::color::Spectrum;
use crate::film::Backing;
use crate::math::Vec3;
use crate::math::float::smooth_step;

/// Background for camera rays that leave the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// The environment lights of the scene.
    #[default]
    Light,
    /// Transparent: the image has an alpha channel.
    Transparent,
    /// Constant radiance, W·sr⁻¹·m⁻².
    Color(Spectrum),
    /// Backdrop that darkens towards the top. The value is the radiance at the bottom, W·sr⁻¹·m⁻².
    Gradient(Spectrum),
}

/// The background of camera rays, and its orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backdrop {
    /// Background of camera rays.
    pub background: Background,
    /// Unit vector that points up.
    pub up: Vec3,
}

impl Default for Backdrop {
    /// Environment lights as background, with y up.
    fn default() -> Self {
        Self {
            background: Background::Light,
            up: Vec3::Y,
        }
    }
}

/// Elevations, in degrees, between which the radiance of a gradient falls from its full value to
/// [`TOP`].
const FALL: [f32; 2] = [-15.0, 50.0];
/// Radiance at the top of a gradient, as a fraction of its full radiance.
const TOP: f32 = 0.3;

impl Background {
    /// Default radiance of a gradient: light grey, below the clipping level of displays.
    pub const GRADIENT: Spectrum = Spectrum::splat(0.8);

    /// The backing (the background of pictures for display) that looks the same as this background.
    /// `None` if no backing looks the same.
    pub fn backing(self) -> Option<Backing> {
        match self {
            Self::Transparent => Some(Backing::Transparent),
            Self::Color(color) => Some(Backing::Color(color)),
            Self::Light | Self::Gradient(_) => None,
        }
    }

    /// Radiance in the unit direction `w`, with `up` as the upward direction. `None` if the
    /// background depends on the lights or is transparent.
    pub fn radiance(&self, w: Vec3, up: Vec3) -> Option<Spectrum> {
        match *self {
            Self::Light | Self::Transparent => None,
            Self::Color(radiance) => Some(radiance),
            Self::Gradient(radiance) => {
                // A smooth step has no edge at either end, so no band is visible.
                let elevation = w.dot(up).clamp(-1.0, 1.0).asin().to_degrees();
                let [low, high] = FALL;
                let t = smooth_step((elevation - low) / (high - low));
                Some(radiance * (1.0 - t * (1.0 - TOP)))
            }
        }
    }
}

/// Background or ground that a camera ray sees first.
#[derive(Clone, Debug)]
pub enum CameraView {
    /// The background. The value is the transmittance of the surfaces in front of it.
    Background(Spectrum),
    /// The ground. It shows the background, multiplied by the fraction of unshadowed light.
    Ground(Shadow),
}

/// The ground at a point that a camera ray sees.
///
/// The fraction of unshadowed light is `reflected · factor + base`, where `reflected` is the light
/// that the sample finds. The ground is a diffuse surface of albedo ρ and irradiance E, which
/// reflects ρ E / π. `factor` is π / (ρ E₀), with the irradiance E₀ that the ground has without
/// objects.
#[derive(Clone, Debug)]
pub struct Shadow {
    /// Factor that converts reflected light to the fraction of unshadowed light.
    pub factor: Spectrum,
    /// Constant term of the fraction of unshadowed light.
    pub base: Spectrum,
    /// Light of the background that the ground shows. `None` if the background is transparent.
    pub background: Option<BackgroundLight>,
}

/// Radiance of the background along a camera ray.
#[derive(Clone, Debug)]
pub enum BackgroundLight {
    /// Radiance that does not come from lights of the scene.
    Plain(Spectrum),
    /// Radiance of each light of the scene.
    Lights(Vec<(Spectrum, LightSource)>),
}

impl BackgroundLight {
    /// Sum of the radiance over all sources.
    pub fn radiance(&self) -> Spectrum {
        match self {
            Self::Plain(radiance) => *radiance,
            Self::Lights(lights) => {
                let mut sum = Spectrum::default();
                lights.iter().for_each(|(radiance, _)| sum += *radiance);
                sum
            }
        }
    }

    /// Radiance of each source of the background, times `factor`.
    pub fn lights(&self, factor: Spectrum) -> impl Iterator<Item = FoundLight<'static>> + '_ {
        let (plain, lights) = match self {
            Self::Plain(radiance) => (Some((*radiance, LightSource::BACKGROUND)), &[][..]),
            Self::Lights(lights) => (None, &lights[..]),
        };
        plain
            .into_iter()
            .chain(lights.iter().copied())
            .map(move |(radiance, source)| FoundLight {
                radiance: radiance * factor,
                source: Some(source),
                scatterings: 0,
                events: &[],
            })
    }
}

impl CameraView {
    /// Finishes a sample that found the light `radiance`. Returns the light of the sample, and the
    /// fraction of the sample that shows the background, per channel. `None` if a value is not
    /// finite. On the ground both may be negative, because a sample may find less light than the
    /// unshadowed light that is subtracted.
    pub fn finish(&self, radiance: Spectrum) -> Option<(Spectrum, Spectrum)> {
        let (radiance, share) = match self {
            Self::Background(share) => (radiance, *share),
            Self::Ground(shadow) => shadow.seen(radiance),
        };
        let mut values = radiance.to_array().into_iter().chain(share.to_array());
        values.all(f32::is_finite).then_some((radiance, share))
    }
}

impl Shadow {
    /// Factor for the light that the sample finds. It is 0 if the background is transparent.
    pub fn light_factor(&self) -> Spectrum {
        let light = self.background.as_ref().map(BackgroundLight::radiance);
        light.map_or(Spectrum::ZERO, |light| self.factor * light)
    }

    /// Final light of a sample that found the light `radiance`, and the fraction of the sample that
    /// shows the background, per channel.
    fn seen(&self, radiance: Spectrum) -> (Spectrum, Spectrum) {
        let share = radiance * self.factor + self.base;
        let Some(background) = self.background.as_ref().map(BackgroundLight::radiance) else {
            return (Spectrum::default(), share);
        };
        let mut seen = radiance * (self.factor * background);
        seen += background * self.base;
        (seen, share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_fall_towards_the_top() {
        let gradient = Background::Gradient(Spectrum::splat(0.5));
        let at = |degrees: f32| {
            let (y, x) = degrees.to_radians().sin_cos();
            gradient.radiance(Vec3::new(x, y, 0.0), Vec3::Y).unwrap().mean()
        };
        assert_eq!((at(-90.0), at(-20.0)), (0.5, 0.5));
        assert!((at(90.0) - 0.15).abs() < 1e-6 && (at(60.0) - 0.15).abs() < 1e-6);
        let falls = (-15..50).all(|degrees| at(degrees as f32) >= at(degrees as f32 + 1.0));
        assert!(falls && at(0.0) > at(20.0));
        // The caller defines which direction is up.
        let up = gradient.radiance(Vec3::Z, Vec3::Z).unwrap().mean();
        assert!((up - 0.15).abs() < 1e-6);
    }

    #[test]
    fn ground_shows_background_times_unshadowed_light() {
        let shadow = |background: Option<Spectrum>| {
            CameraView::Ground(Shadow {
                factor: Spectrum::splat(4.0),
                base: Spectrum::splat(0.25),
                background: background.map(BackgroundLight::Plain),
            })
        };
        let blue = Spectrum::rgb(0.0, 0.5, 1.0);
        let (seen, uncovered) = shadow(Some(blue)).finish(Spectrum::splat(0.125)).unwrap();
        assert_eq!(seen, Spectrum::rgb(0.0, 0.375, 0.75));
        assert_eq!(uncovered, Spectrum::splat(0.75));
        let (seen, uncovered) = shadow(None).finish(Spectrum::splat(0.125)).unwrap();
        assert!(seen.is_black() && uncovered == Spectrum::splat(0.75));
        let behind = CameraView::Background(blue);
        assert_eq!(behind.finish(Spectrum::ONE), Some((Spectrum::ONE, blue)));
        // Light of a sample may be negative.
        let (seen, _) = shadow(Some(blue)).finish(Spectrum::splat(-0.125)).unwrap();
        assert_eq!(seen, Spectrum::rgb(0.0, -0.125, -0.25));
        for wrong in [f32::NAN, f32::INFINITY] {
            assert_eq!(shadow(None).finish(Spectrum::splat(wrong)), None);
            assert_eq!(shadow(Some(blue)).finish(Spectrum::splat(wrong)), None);
        }
    }
}
