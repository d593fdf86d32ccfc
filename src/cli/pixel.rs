//! `render --pixel`: the rays of one sample as text or as JSON.

use super::error::CliError;
use super::paths;
use crate::accel::{Accel, Answer, Recorder};
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::integrator::{CameraView, FoundLight, RayKind, RaySink, Sink};
use crate::math::list;
use crate::sampler::SampleKey;
use crate::scene::Scene;
use crate::session::{Preparation, RenderContext, Renderer, Session};
use std::cell::RefCell;
use std::process::ExitCode;

/// Traces one sample, and prints every ray with its result and the light that it adds to the pixel.
/// If `as_json` is true, prints the vertices, densities, weights and contributions of
/// `embrasure paths` instead.
pub(super) fn trace(renderer: &Renderer, pixel: [u32; 2], sample: u32, as_json: bool) -> Result<ExitCode, CliError> {
    let [x, y] = pixel;
    renderer.session().check_one_view("pixel", &format!("{x},{y}"))?;
    if as_json {
        let traces = paths::traces(renderer, pixel, sample..sample.saturating_add(1))?;
        outln!("{:#}", paths::facts(renderer, pixel, &traces));
        return Ok(ExitCode::SUCCESS);
    }
    let session = renderer.session();
    let key = paths::key(pixel, sample, session.settings().crop())?;
    renderer.prepare();
    let prepared = renderer.prepared();
    if print_sample(session, prepared, renderer.accel().as_dyn(), key) {
        return Ok(ExitCode::SUCCESS);
    }
    Err(CliError::Usage(format!(
        "--pixel: light of --integrator {} falls on any pixel, so no sample belongs to one pixel\n  help: add --json, or use `embrasure paths`; both trace a whole iteration",
        session.settings().chosen_integrator().name()
    )))
}

/// Traces the sample and prints it. Returns false if the integrator has no samples of single
/// pixels.
fn print_sample(session: &Session, prepared: &Preparation, accel: &dyn Accel, key: SampleKey) -> bool {
    let settings = session.settings();
    let recorder = Recorder::new(&accel);
    let log = RefCell::new(RayLog {
        recorder: &recorder,
        scene: session.scene(),
        kinds: Vec::new(),
        weight: 1.0,
        radiance: Spectrum::ZERO,
        view: None,
        lines: Vec::new(),
    });
    let recorded: &dyn Accel = &recorder;
    let context = RenderContext {
        world: session.world(&recorded),
        prepared,
    };
    let listener = |is_requested| -> Box<dyn Sink + '_> {
        Box::new(Listener {
            log: &log,
            is_requested,
        })
    };
    let mut sampler = settings.random_numbers();
    let integrator = settings.chosen_integrator();
    if !integrator.sample(context, (settings.resolution, key), &mut sampler, &listener) {
        return false;
    }
    let mut log = log.into_inner();
    log.take_rays();
    outln!(
        "sample {} of pixel {},{}: {}",
        key.sample,
        key.x,
        key.y,
        integrator.describe()
    );
    log.lines.iter().for_each(|line| outln!("{line}"));
    if let Some((radiance, background)) = log.view.and_then(|view| view.finish(log.radiance)) {
        outln!(
            "seen {}, share of the background {}",
            list(&radiance.to_array()),
            list(&background.to_array())
        );
        log.radiance = radiance;
    }
    if log.weight != 1.0 {
        outln!("times the filter's weight, {}", log.weight);
    }
    outln!("radiance {}", list(&(log.radiance * log.weight).to_array()));
    true
}

/// Rays with their kinds and results, in order.
struct RayLog<'a> {
    recorder: &'a Recorder<'a, &'a dyn Accel>,
    scene: &'a Scene,
    /// Rays since the last call of `take_rays`: the kind, and true if the ray belongs to the
    /// requested sample.
    kinds: Vec<(RayKind, bool)>,
    weight: f32,
    radiance: Spectrum,
    /// Background or ground that the camera ray hits.
    view: Option<CameraView>,
    lines: Vec<String>,
}

impl RayLog<'_> {
    /// Adds a line for each ray since the last call.
    fn take_rays(&mut self) {
        for ((kind, is_requested), (query, answer)) in self.kinds.drain(..).zip(self.recorder.take()) {
            if !is_requested {
                continue;
            }
            let kind = match kind {
                RayKind::Camera => "camera",
                RayKind::Bounce => "bounce",
                RayKind::Shadow => "shadow",
            };
            let (o, d) = (query.ray.origin, query.ray.direction);
            let answer = match answer {
                Answer::Closest(Some(h)) => {
                    let material = &self.scene.material(&h).name;
                    let part = self.scene.part_name(self.scene.part(&h));
                    format!(
                        "t {} on triangle {} of mesh {}, b1 {} b2 {}, part `{part}`, material `{material}`",
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

/// Listener to one sample of a packet. All samples of a packet are traced together.
struct Listener<'a, 'b> {
    log: &'a RefCell<RayLog<'b>>,
    /// True for the sample of `--sample`.
    is_requested: bool,
}

impl Sink for Listener<'_, '_> {
    fn weight(&mut self, weight: f32) {
        if self.is_requested {
            self.log.borrow_mut().weight = weight;
        }
    }

    fn light(&mut self, light: FoundLight) {
        let radiance = light.radiance;
        let mut log = self.log.borrow_mut();
        log.take_rays();
        if self.is_requested {
            log.lines.push(format!("  adds {}", list(&radiance.to_array())));
            log.radiance += radiance;
        }
    }

    fn camera_view(&mut self, view: CameraView) {
        let mut log = self.log.borrow_mut();
        log.take_rays();
        if self.is_requested {
            log.lines.push(match &view {
                CameraView::Background(_) => "  sees the background".into(),
                CameraView::Ground(shadow) => {
                    let (factor, base) = (list(&shadow.factor.to_array()), list(&shadow.base.to_array()));
                    format!(
                        "  sees the ground: the light of the sample times {factor} plus {base} is the fraction of light that arrives there"
                    )
                }
            });
            log.view = Some(view);
        }
    }

    fn first_surface(&mut self, s: FirstSurface) {
        let mut log = self.log.borrow_mut();
        log.take_rays();
        if self.is_requested {
            let (albedo, normal, depth) = (list(&s.albedo.to_array()), s.normal, s.depth);
            let line = format!("  first surface: albedo {albedo}, normal {normal}, depth {depth}");
            log.lines.push(line);
        }
    }
}

impl RaySink for Listener<'_, '_> {
    fn ray(&mut self, kind: RayKind) {
        self.log.borrow_mut().kinds.push((kind, self.is_requested));
    }

    fn cut_walk(&mut self) {}
}
