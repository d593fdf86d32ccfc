//! A photographer's studio as an environment image: three soft lamps around the subject in front of
//! a dim wall.
//!
//! A large key lamp is high to the left of the camera. A wider and weaker fill lamp is low to the
//! right. A tall narrow rim lamp is high behind the subject, on the side of the fill lamp. It
//! lights the edge of the subject's shadow side. Each lamp is a rounded rectangle with a soft
//! border. It lies in the plane that touches the unit sphere of directions at the lamp's middle. A
//! surface that faces the middle of a lamp receives the irradiance [`STUDIO_IRRADIANCE`] from this
//! lamp. The wall becomes brighter upwards. A grey Lambertian subject of albedo 0.5 has a radiance
//! of about 0.5 where it faces the key lamp, and of 0.05 to 0.15 in its shadow. So no exposure is
//! needed.

use super::LatLongImage;
use crate::color::Spectrum;
use crate::math::{Horizon, Vec3};
use std::f64::consts::{PI, TAU};

/// Columns and rows of the image.
pub const STUDIO_SIZE: [usize; 2] = [256, 128];
/// Irradiance by the key, the fill and the rim lamp, W·m⁻², each on a surface that faces this lamp.
/// The rim lamp is the brightest. It is behind the subject, so the surfaces that it lights and that
/// the camera sees are lit at grazing angles.
pub const STUDIO_IRRADIANCE: [f64; 3] = [3.2, 0.3, 4.0];

/// Radiance of the wall at the nadir, at the horizon and at the zenith.
const WALL: [f64; 3] = [0.02, 0.05, 0.10];

/// A lamp: azimuth in degrees from the camera's azimuth, elevation in degrees above the horizon,
/// and half of the lamp's width and height at distance 1 from the subject.
struct Lamp {
    azimuth: f32,
    elevation: f32,
    half: [f64; 2],
}

const LAMPS: [Lamp; 3] = [
    Lamp {
        azimuth: -55.0,
        elevation: 45.0,
        half: [0.25, 0.25],
    },
    Lamp {
        azimuth: 65.0,
        elevation: 10.0,
        half: [0.5, 0.6],
    },
    Lamp {
        azimuth: 150.0,
        elevation: 35.0,
        half: [0.3, 0.7],
    },
];

/// Width of the soft border of a lamp, as a fraction of `half`.
const BORDER: f64 = 0.3;

impl Lamp {
    /// Brightness of the lamp in the unit direction `w`, from 0 to 1. `frame` is [`Lamp::frame`].
    fn shape(&self, frame: &[[f64; 3]; 3], w: [f64; 3]) -> f64 {
        let [right, up, towards] = frame.map(|axis| axis.iter().zip(w).map(|(a, b)| a * b).sum::<f64>());
        if towards <= 0.0 {
            return 0.0;
        }
        let inside = |x: f64, half: f64| {
            let t = ((1.0 - x.abs() / (towards * half)) / BORDER).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        inside(right, self.half[0]) * inside(up, self.half[1])
    }

    /// Unit vectors of the lamp: right, up and towards its middle. The frame has +y up and the
    /// camera at azimuth 0.
    fn frame(&self) -> [[f64; 3]; 3] {
        let horizon = Horizon::new(Vec3::Y);
        let [right, up, towards] = [
            horizon.direction(self.azimuth + 90.0, 0.0),
            horizon.direction(self.azimuth + 180.0, 90.0 - self.elevation),
            horizon.direction(self.azimuth, self.elevation),
        ];
        [right, up, towards].map(|axis| axis.to_array().map(f64::from))
    }
}

/// The studio as a latitude-longitude image whose top is up, for a camera at azimuth 0: +z.
pub fn studio_image() -> LatLongImage {
    let [width, height] = STUDIO_SIZE;
    let directions = (0..width * height).map(|i| {
        let (sin, cos) = (PI * ((i / width) as f64 + 0.5) / height as f64).sin_cos();
        let (sin_phi, cos_phi) = (TAU * (((i % width) as f64 + 0.5) / width as f64 - 0.5)).sin_cos();
        ([sin * sin_phi, cos, -sin * cos_phi], sin)
    });
    let mut values: Vec<f64> = directions.clone().map(|(w, _)| wall(w[1])).collect();
    let solid_angle = (PI / height as f64) * (TAU / width as f64);
    for (lamp, irradiance) in LAMPS.iter().zip(STUDIO_IRRADIANCE) {
        let frame = lamp.frame();
        let shapes: Vec<f64> = directions.clone().map(|(w, _)| lamp.shape(&frame, w)).collect();
        // Irradiance by the lamp's texels if its radiance is 1
        let unit: f64 = directions
            .clone()
            .zip(&shapes)
            .map(|((w, sin), shape)| {
                let cos: f64 = frame[2].iter().zip(w).map(|(a, b)| a * b).sum();
                shape * cos * sin * solid_angle
            })
            .sum();
        for (value, shape) in values.iter_mut().zip(&shapes) {
            *value += irradiance / unit * shape;
        }
    }
    LatLongImage {
        width,
        height,
        texels: values.into_iter().map(|v| Spectrum::splat(v as f32)).collect(),
    }
}

/// Radiance of the wall at an elevation with the sine `sin`, linear from nadir to horizon and from
/// horizon to zenith.
fn wall(sin: f64) -> f64 {
    let [nadir, horizon, zenith] = WALL;
    if sin < 0.0 {
        horizon + (horizon - nadir) * sin
    } else {
        horizon + (zenith - horizon) * sin
    }
}

#[cfg(test)]
mod tests {
    use super::super::EnvironmentLight;
    use super::*;
    use crate::math::Quat;

    /// Irradiance on a surface with the unit normal `n`, from the texels of the image.
    fn irradiance(image: &LatLongImage, n: Vec3) -> f64 {
        let light = EnvironmentLight::new(image.clone(), 1.0, Quat::IDENTITY);
        let (columns, rows) = (2 * image.width, 2 * image.height);
        let mut sum = 0.0;
        for row in 0..rows {
            let (sin, cos) = (PI * (row as f64 + 0.5) / rows as f64).sin_cos();
            for column in 0..columns {
                let (sin_phi, cos_phi) = (TAU * (column as f64 + 0.5) / columns as f64).sin_cos();
                let w = Vec3::from([sin * sin_phi, cos, sin * cos_phi].map(|x| x as f32));
                sum += f64::from(light.radiance(w).max_component() * w.dot(n).max(0.0)) * sin;
            }
        }
        sum * (PI / rows as f64) * (TAU / columns as f64)
    }

    /// A surface that faces a lamp receives the stated irradiance, and a little light of the wall
    /// and the other lamps.
    #[test]
    fn lamps_are_as_bright_as_stated() {
        let image = studio_image();
        let horizon = Horizon::new(Vec3::Y);
        for (lamp, stated) in LAMPS.iter().zip(STUDIO_IRRADIANCE) {
            let n = horizon.direction(lamp.azimuth, lamp.elevation);
            let all = irradiance(&image, n);
            // The wall adds an irradiance of 0.2 to 0.45.
            assert!(all > stated + 0.15 && all < stated + 1.1, "{}: {all}", lamp.azimuth);
        }
        let [key, fill, rim] = STUDIO_IRRADIANCE;
        assert!((key / fill - 32.0 / 3.0).abs() < 1e-9 && (rim / key - 1.25).abs() < 1e-9);
    }

    /// The bright side, front, shadow side and top of a grey sphere are within the display's range,
    /// in this order.
    #[test]
    fn grey_subject_is_well_exposed() {
        let image = studio_image();
        let horizon = Horizon::new(Vec3::Y);
        let radiance = |n: Vec3| 0.5 * irradiance(&image, n) / PI;
        let bright = radiance(horizon.direction(-45.0, 45.0));
        let front = radiance(Vec3::Z);
        let shadow = radiance(horizon.direction(75.0, -20.0));
        let below = radiance(Vec3::NEG_Y);
        assert!((0.4..0.6).contains(&bright), "{bright}");
        assert!((0.25..0.45).contains(&front), "{front}");
        assert!((0.05..0.15).contains(&shadow), "{shadow}");
        assert!((0.01..0.08).contains(&below), "{below}");
    }

    #[test]
    fn the_key_is_to_the_left_of_the_camera_and_the_wall_is_dim() {
        let light = EnvironmentLight::new(studio_image(), 1.0, Quat::IDENTITY);
        let at = |azimuth, elevation| {
            let w = Horizon::new(Vec3::Y).direction(azimuth, elevation);
            f64::from(light.radiance(w).max_component())
        };
        // Seen from +z towards −z, left is −x: azimuth −90.
        assert!(at(-55.0, 45.0) > 2.0 && at(65.0, 10.0) > 0.15 && at(150.0, 35.0) > 2.0);
        // Test the view of the camera behind the subject
        for azimuth in [-170.0, 180.0, 170.0] {
            for elevation in [-30.0, -10.0, 5.0] {
                assert!((0.03..0.1).contains(&at(azimuth, elevation)), "{azimuth} {elevation}");
            }
        }
        assert!(at(0.0, 90.0) < 0.4 && at(0.0, -90.0) < at(0.0, 0.0));
    }
}
