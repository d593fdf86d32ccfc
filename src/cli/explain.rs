use super::error::CliError;
use super::estimator::Estimator;
use crate::accel::{Accel, Answer, Recorder};
use crate::camera::Camera;
use crate::color::Spectrum;
use crate::film::{FirstSurface, Rect};
use crate::integrator::{RayKind, Sink, World};
use crate::sampler::{SampleKey, Sampler};
use crate::scene::Scene;

/// Traces one sample and prints every ray with its answer, and what it added to the pixel.
pub(super) fn explain<A: Accel>(
    estimator: &Estimator,
    (scene, accel, camera): (&Scene, &A, &Camera),
    sampler: &mut impl Sampler,
    key: SampleKey,
) {
    let recorder = Recorder::new(accel);
    let mut told = Telling {
        recorder: &recorder,
        scene,
        kinds: Vec::new(),
        radiance: Spectrum::ZERO,
        lines: Vec::new(),
    };
    let world = World {
        scene,
        accel: &recorder,
        camera,
    };
    estimator.sample(world, key, sampler, &mut told);
    told.take_rays();
    println!(
        "sample {} of pixel {},{}: {}",
        key.sample,
        key.x,
        key.y,
        estimator.settings()
    );
    told.lines.iter().for_each(|line| println!("{line}"));
    println!("radiance {:?}", told.radiance.to_array());
}

/// The pixel and sample that `--pixel` and `--sample` name.
pub(super) fn key([x, y]: [u32; 2], sample: u32, crop: Rect) -> Result<SampleKey, CliError> {
    let inside = (crop.min.x..crop.max.x).contains(&x) && (crop.min.y..crop.max.y).contains(&y);
    if inside {
        return Ok(SampleKey::new(x, y, sample));
    }
    Err(CliError::Usage(format!(
        "--pixel {x},{y} is outside the image\n  help: columns {} to {}, rows {} to {}",
        crop.min.x,
        crop.max.x - 1,
        crop.min.y,
        crop.max.y - 1
    )))
}

/// Puts the rays, their purpose and what they gave in one order.
struct Telling<'a, A> {
    recorder: &'a Recorder<'a, A>,
    scene: &'a Scene,
    kinds: Vec<RayKind>,
    radiance: Spectrum,
    lines: Vec<String>,
}

impl<A: Accel> Telling<'_, A> {
    /// Rays that were answered since the last time.
    fn take_rays(&mut self) {
        for (kind, (query, answer)) in self.kinds.drain(..).zip(self.recorder.take()) {
            let kind = match kind {
                RayKind::Camera => "camera",
                RayKind::Bounce => "bounce",
                RayKind::Shadow => "shadow",
            };
            let (o, d) = (query.ray.origin, query.ray.direction);
            let answer = match answer {
                Answer::Closest(Some(h)) => {
                    let material = &self.scene.material(&h).name;
                    format!(
                        "t {} on triangle {} of mesh {}, b1 {} b2 {}, material `{material}`",
                        h.t, h.prim.0, h.geom.0, h.b1, h.b2
                    )
                }
                Answer::Closest(None) => "nothing".into(),
                Answer::Occlusion(true) => "occluded".into(),
                Answer::Occlusion(false) => "free".into(),
            };
            self.lines.push(format!("  {kind} from {o} along {d}: {answer}"));
        }
    }
}

impl<A: Accel> Sink for Telling<'_, A> {
    fn radiance(&mut self, radiance: Spectrum) {
        self.take_rays();
        self.lines.push(format!("  adds {:?}", radiance.to_array()));
        self.radiance += radiance;
    }

    fn first_surface(&mut self, s: FirstSurface) {
        self.take_rays();
        self.lines.push(format!(
            "  first surface: albedo {:?}, normal {}, depth {}",
            s.albedo.to_array(),
            s.normal,
            s.depth
        ));
    }

    fn ray(&mut self, kind: RayKind) {
        self.kinds.push(kind);
    }
}
