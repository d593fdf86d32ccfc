//! The cases of `selftest` with their exact results.

use super::scenes::{
    SceneView, block, camera, floor, furnished_room, glass, glowing_room, lamp_behind, matte, quad, scene,
};
use crate::cli::error::CliError;
use crate::color::Spectrum;
use crate::files::Output;
use crate::film::Image;
use crate::io::read_checkpoint;
use crate::material::Material;
use crate::math::{DVec3, Quat, UVec2, Vec3};
use crate::options::{Backend, IntegratorKind, IntegratorOptions, MaxDepth};
use crate::scene::BuildError;
use crate::session::{Session, Settings};
use std::f64::consts::PI;
use std::fmt;

/// A scene, the measurement in its picture, and the exact result.
pub(super) struct Case {
    pub name: &'static str,
    /// Measured quantity, and the source of its exact value.
    pub about: &'static str,
    /// True if `selftest` runs the case without `--full`.
    pub is_quick: bool,
    pub run: fn(&Probe) -> Result<Measurement, CliError>,
}

/// All cases of `embrasure selftest`.
pub(super) const CASES: &[Case] = &[
    Case {
        name: "closed-room",
        about: "radiance in a closed room that emits 1 and reflects 0.5: the geometric series, 1 / (1 - 0.5)",
        is_quick: true,
        run: closed_room,
    },
    Case {
        name: "bounded-paths",
        about: "the same room with three scattering events: 1 + 1/2 + 1/4 + 1/8",
        is_quick: true,
        run: bounded_paths,
    },
    Case {
        name: "furnace",
        about: "a matte block of reflectance 0.8 in uniform light of radiance 1",
        is_quick: true,
        run: furnace,
    },
    Case {
        name: "point-light",
        about: "floor under a point light: reflectance / pi * intensity * cosine / distance^2",
        is_quick: true,
        run: point_light,
    },
    Case {
        name: "rectangle-lamp",
        about: "floor under a rectangular lamp: Lambert's formula (Arvo 1994)",
        is_quick: true,
        run: rectangle_lamp,
    },
    Case {
        name: "window-pane",
        about: "a lamp behind a glass pane turned by 60 degrees: (1 - F) / (1 + F) = 0.836232",
        is_quick: true,
        run: window_pane,
    },
    Case {
        name: "absorbing-glass",
        about: "a lamp behind glass that absorbs, with all inner reflections: (1 - R)^2 a / (1 - R^2 a^2), a by Beer's law",
        is_quick: true,
        run: absorbing_glass,
    },
    Case {
        name: "brute-force",
        about: "mean of a picture, divided by the mean with the backend brute and the same random numbers",
        is_quick: true,
        run: brute_force,
    },
    Case {
        name: "threads",
        about: "values of the picture that differ between one thread and three",
        is_quick: true,
        run: threads,
    },
    Case {
        name: "resumed-render",
        about: "values of the picture that differ between one render and a render resumed from a file",
        is_quick: true,
        run: resumed_render,
    },
    Case {
        name: "bdpt",
        about: "mean of a room by bidirectional path tracing, divided by the mean by path tracing",
        is_quick: false,
        run: |probe| probe.over_path(IntegratorKind::Bidirectional, 256),
    },
    Case {
        name: "pssmlt",
        about: "mean of a room by Metropolis light transport in primary sample space, divided by the mean by path tracing",
        is_quick: false,
        run: |probe| probe.over_path(IntegratorKind::PrimarySpace, 256),
    },
    Case {
        name: "naive",
        about: "mean of a room by paths that meet the lamp by chance, divided by the mean by path tracing",
        is_quick: false,
        run: |probe| probe.over_path(IntegratorKind::Naive, 2048),
    },
];

/// Maximum relative error of a mean. It is this large because a case has few samples.
const TOLERANCE: f64 = 3e-3;

/// A measurement and its exact value.
pub(super) struct Measurement {
    pub value: f64,
    pub expected: f64,
    /// Maximum difference between `value` and `expected`.
    pub tolerance: f64,
}

impl Measurement {
    /// Measurement of a mean over samples, with a relative tolerance.
    pub fn near(value: f64, expected: f64) -> Self {
        let tolerance = TOLERANCE * expected;
        Self {
            value,
            expected,
            tolerance,
        }
    }

    /// Measurement of a count that must be 0.
    pub fn none(count: usize) -> Self {
        Self {
            value: count as f64,
            expected: 0.0,
            tolerance: 0.0,
        }
    }

    pub fn passed(&self) -> bool {
        (self.value - self.expected).abs() <= self.tolerance
    }
}

impl fmt::Display for Measurement {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self {
            value,
            expected,
            tolerance,
        } = self;
        if *tolerance == 0.0 {
            write!(f, "{value} (exactly {expected})")
        } else {
            write!(f, "{value:.5} ({expected:.5} within {tolerance:.5})")
        }
    }
}

impl From<BuildError> for CliError {
    fn from(error: BuildError) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Renders the pictures of the cases with one backend.
pub(super) struct Probe {
    pub backend: Backend,
}

impl Probe {
    /// Settings of a square picture of `side` pixels per side with `spp` samples per pixel.
    fn settings(&self, side: u32, spp: u32) -> Settings {
        Settings {
            resolution: UVec2::splat(side),
            spp,
            backend: self.backend,
            ..Settings::default()
        }
    }

    /// Mean of the red channel. All scenes are grey.
    fn mean(&self, view: SceneView, side: u32, spp: u32) -> Result<f64, CliError> {
        Ok(mean(&picture(view, self.settings(side, spp))?))
    }

    /// Mean of the picture of a room by the integrator `kind`, divided by the mean of the same
    /// picture by path tracing.
    fn over_path(&self, kind: IntegratorKind, spp: u32) -> Result<Measurement, CliError> {
        let by = |kind, spp| {
            let integrator = IntegratorOptions {
                integrator: Some(kind),
                max_depth: Some(MaxDepth(Some(6))),
                ..IntegratorOptions::default()
            };
            let settings = Settings {
                integrator,
                ..self.settings(32, spp)
            };
            picture(furnished_room()?, settings).map(|image| mean(&image))
        };
        Ok(Measurement::near(by(kind, spp)? / by(IntegratorKind::Path, 1024)?, 1.0))
    }
}

/// Renders a picture of a scene.
fn picture((scene, camera): SceneView, settings: Settings) -> Result<Image, CliError> {
    let session = Session::new(scene, camera, settings)?;
    let renderer = session.renderer()?;
    let mut state = renderer.start();
    renderer.render(&mut state, &());
    Ok(renderer.develop(&state))
}

/// Mean of the first channel of `image`.
fn mean(image: &Image) -> f64 {
    let values = &image.channels[0].values;
    values.iter().map(|&value| f64::from(value)).sum::<f64>() / values.len() as f64
}

/// Number of values whose bits differ, in all channels.
fn differences(a: &Image, b: &Image) -> Measurement {
    let values = |image: &Image| -> Vec<u32> {
        let channels = image.channels.iter();
        channels.flat_map(|c| c.values.iter().map(|v| v.to_bits())).collect()
    };
    let (a, b) = (values(a), values(b));
    let common = a.iter().zip(&b).filter(|(a, b)| a != b).count();
    Measurement::none(common + a.len().abs_diff(b.len()))
}

fn closed_room(probe: &Probe) -> Result<Measurement, CliError> {
    let settings = Settings {
        integrator: depth(None),
        ..probe.settings(64, 64)
    };
    Ok(Measurement::near(mean(&picture(glowing_room()?, settings)?), 2.0))
}

fn bounded_paths(probe: &Probe) -> Result<Measurement, CliError> {
    let settings = Settings {
        integrator: depth(Some(3)),
        ..probe.settings(64, 64)
    };
    Ok(Measurement::near(mean(&picture(glowing_room()?, settings)?), 1.875))
}

/// The default integrator with a maximum number of scattering events.
fn depth(max: Option<u32>) -> IntegratorOptions {
    IntegratorOptions {
        max_depth: Some(MaxDepth(max)),
        ..IntegratorOptions::default()
    }
}

fn furnace(probe: &Probe) -> Result<Measurement, CliError> {
    let parts = [(block(Vec3::ZERO, Vec3::ONE), matte(0.8, 0.0))];
    let scene = scene(parts, |builder| builder.add_constant_light(Spectrum::ONE))?;
    // Only the block is in the picture.
    let view = camera(Vec3::new(2.0, 1.7, 3.0), Vec3::ZERO, 10.0);
    Ok(Measurement::near(probe.mean((scene, view), 32, 64)?, 0.8))
}

fn point_light(probe: &Probe) -> Result<Measurement, CliError> {
    let (position, intensity) = (Vec3::new(0.5, 2.0, -0.3), 7.0);
    let view = floor([], |builder| {
        builder.add_point_light(position, Spectrum::splat(intensity))
    })?;
    let to_light = position.as_dvec3();
    let irradiance = f64::from(intensity) * to_light.normalize().y / to_light.length_squared();
    Ok(Measurement::near(probe.mean(view, 8, 16)?, 0.8 / PI * irradiance))
}

fn rectangle_lamp(probe: &Probe) -> Result<Measurement, CliError> {
    let corners = [[-0.5, -0.5], [0.7, -0.5], [0.7, 0.6], [-0.5, 0.6]].map(|[x, z]| Vec3::new(x, 1.5, z));
    let radiance = 3.0;
    let view = floor([(quad(corners), matte(0.0, radiance))], |_| Ok(()))?;
    let expected = 0.8 / PI * f64::from(radiance) * lambert_factor(corners.map(|c| c.as_dvec3()));
    Ok(Measurement::near(probe.mean(view, 16, 256)?, expected))
}

/// Irradiance at the origin, whose normal is +y, from a polygon of radiance 1 above it: `1/2 Σ γᵢ
/// Γᵢ·n` over the edges (Arvo 1994, eq. 4).
fn lambert_factor(corners: [DVec3; 4]) -> f64 {
    let edges = (0..4).map(|i| {
        let [a, b] = [corners[i], corners[(i + 1) % 4]].map(DVec3::normalize);
        a.angle_between(b) * a.cross(b).normalize().y
    });
    0.5 * edges.sum::<f64>().abs()
}

fn window_pane(probe: &Probe) -> Result<Measurement, CliError> {
    let mut pane = block(Vec3::ZERO, Vec3::new(2.0, 1.0, 0.005));
    let turn = Quat::from_rotation_y(60f32.to_radians());
    pane.positions.iter_mut().for_each(|p| *p = turn * *p);
    Ok(Measurement::near(
        probe.mean(lamp_behind(pane, glass())?, 32, 64)?,
        0.836232,
    ))
}

fn absorbing_glass(probe: &Probe) -> Result<Measurement, CliError> {
    let (absorption, half) = (0.7f32, 0.5f32);
    let body = Material {
        absorption: Spectrum::splat(absorption),
        ..glass()
    };
    let view = lamp_behind(block(Vec3::ZERO, Vec3::new(2.0, 2.0, half)), body)?;
    let (r, a) = (0.04, (-2.0 * f64::from(absorption * half)).exp());
    let expected = (1.0 - r) * (1.0 - r) * a / (1.0 - r * r * a * a);
    Ok(Measurement::near(probe.mean(view, 32, 64)?, expected))
}

fn brute_force(probe: &Probe) -> Result<Measurement, CliError> {
    let oracle = Probe {
        backend: Backend::Brute,
    };
    let by = |probe: &Probe| probe.mean(furnished_room()?, 32, 64);
    Ok(Measurement::near(by(probe)? / by(&oracle)?, 1.0))
}

fn threads(probe: &Probe) -> Result<Measurement, CliError> {
    let by = |threads| {
        let settings = Settings {
            threads,
            ..probe.settings(48, 16)
        };
        picture(furnished_room()?, settings)
    };
    Ok(differences(&by(1)?, &by(3)?))
}

fn resumed_render(probe: &Probe) -> Result<Measurement, CliError> {
    let (half, whole) = (probe.settings(48, 64), probe.settings(48, 128));
    let expected = picture(furnished_room()?, whole.clone())?;

    let folder = tempfile::tempdir().map_err(|error| CliError::Failed(format!("no temporary folder: {error}")))?;
    let path = folder.path().join("half.exr");
    let (scene, camera) = furnished_room()?;
    let session = Session::new(scene, camera, half)?;
    let renderer = session.renderer()?;
    let mut state = renderer.start();
    renderer.render(&mut state, &());
    state.keep(&Output::prepare(&path)?, &renderer.metadata(&state, false))?;

    let (scene, camera) = furnished_room()?;
    let session = Session::new(scene, camera, whole)?;
    let renderer = session.renderer()?;
    let mut state = renderer.resume(read_checkpoint(&path)?)?;
    renderer.render(&mut state, &());
    Ok(differences(&renderer.develop(&state), &expected))
}
