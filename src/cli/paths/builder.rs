//! Builds a trace from recorded events.

use super::trace::{Contribution, Technique, Trace, Vertex, VertexPlace};
use crate::color::Spectrum;
use crate::film::Filter;
use crate::integrator::PathEvent;
use crate::math::{UVec2, Vec2, Vec3};
use crate::sampler::SampleKey;

/// Builder of a trace. It takes the recorded events of a sample in their order.
struct Builder<'a> {
    trace: Trace,
    pixel: UVec2,
    filter: &'a Filter,
    /// The current path: index of the last vertex of each depth.
    stack: Vec<usize>,
    /// Vertices of the last path from the camera.
    camera: Vec<usize>,
    /// Vertices of the last path from a light.
    light: Vec<usize>,
    /// Technique that finds the next light, unless a later event names another technique.
    technique: Technique,
    /// Parts of the light that the next event `Added` adds: technique, radiance, vertex.
    parts: Vec<(Technique, Spectrum, Option<usize>)>,
    /// True while the events belong to the part of a path that several pixels reuse. Light of this
    /// part reaches a pixel later, by a connection ([`Technique::Shared`]).
    is_shared: bool,
    /// Vertex and index of each light sample whose shadow ray is still to come.
    waiting: Vec<(usize, usize)>,
}

impl Trace {
    /// Builds the trace of the sample `key` from its recorded `events`. The trace has only the
    /// light of `pixel`.
    pub fn new(key: SampleKey, weight: f32, events: &[PathEvent], pixel: UVec2, filter: &Filter) -> Self {
        let mut builder = Builder {
            trace: Self {
                key,
                weight,
                vertices: Vec::new(),
                contributions: Vec::new(),
            },
            pixel,
            filter,
            stack: Vec::new(),
            camera: Vec::new(),
            light: Vec::new(),
            technique: Technique::Other,
            parts: Vec::new(),
            is_shared: false,
            waiting: Vec::new(),
        };
        events.iter().for_each(|event| builder.take(*event));
        builder.trace
    }
}

impl Builder<'_> {
    fn take(&mut self, event: PathEvent) {
        match event {
            PathEvent::Start { p, light, beta, .. } => {
                // Ignore a second start at the camera. A bidirectional integrator starts its path
                // at the camera, although the camera ray has already started the path.
                let is_same = |v: usize| {
                    self.trace.vertices[v].p == p && matches!(self.trace.vertices[v].place, VertexPlace::Camera)
                };
                if light.is_none() && self.stack.len() == 1 && is_same(self.stack[0]) {
                    return;
                }
                let place = light.map_or(VertexPlace::Camera, VertexPlace::Light);
                let first = self.add(None, place, p, beta);
                self.stack = vec![first];
                self.is_shared = false;
                *self.path_of(first) = vec![first];
            }
            PathEvent::Vertex { depth, hit, p, n, beta } => {
                // Index 0 is the start of the path.
                self.stack.truncate(depth as usize + 1);
                let parent = self.stack.last().copied();
                let vertex = self.add(parent, VertexPlace::Surface { hit, n, depth }, p, beta);
                self.stack.push(vertex);
                let root = self.stack[0];
                let path = self.stack.clone();
                *self.path_of(root) = path;
            }
            PathEvent::Emission(emission) => {
                self.technique = Technique::Emission;
                if let Some(vertex) = self.last() {
                    self.trace.vertices[vertex].emissions.push(emission);
                }
            }
            PathEvent::LightSample(sample) => {
                self.technique = Technique::LightSample;
                if let Some(vertex) = self.last() {
                    let samples = &mut self.trace.vertices[vertex].light_samples;
                    samples.push(sample);
                    self.waiting.push((vertex, samples.len() - 1));
                }
            }
            PathEvent::Shadow { transmittance } => {
                self.technique = Technique::LightSample;
                if !self.waiting.is_empty() {
                    let (vertex, sample) = self.waiting.remove(0);
                    self.trace.vertices[vertex].light_samples[sample].transmittance = Some(transmittance);
                }
            }
            PathEvent::Scatter { depth, scattering } => {
                // In a tree of rays, a vertex scatters again after one of its branches has ended.
                // Remove the vertices of this branch from the current path.
                self.stack.truncate(depth as usize + 2);
                if let Some(vertex) = self.last() {
                    self.trace.vertices[vertex].scatterings.push(scattering);
                }
            }
            PathEvent::Connection {
                strategy: (s, t),
                is_merged,
                weight,
                radiance,
                ..
            } => {
                self.technique = if is_merged {
                    Technique::Merging(s, t, weight, radiance)
                } else {
                    Technique::Connection(s, t, weight, radiance)
                };
            }
            PathEvent::Cached => self.technique = Technique::Cache,
            PathEvent::Visited => self.technique = Technique::Chain,
            PathEvent::Photons { count, radius } => {
                self.technique = Technique::Photons;
                if let Some(vertex) = self.last() {
                    self.trace.vertices[vertex].photons.push((count, radius));
                }
            }
            PathEvent::Shared { owner, p } => self.technique = Technique::Shared(owner, p),
            PathEvent::SharedPath => self.is_shared = true,
            PathEvent::Light(radiance) => {
                if !self.is_shared {
                    let part = (self.technique, radiance, self.last());
                    self.parts.push(part);
                }
            }
            PathEvent::Added { film, radiance } => self.add_light(film, radiance),
        }
    }

    fn add(&mut self, parent: Option<usize>, place: VertexPlace, p: Vec3, beta: Spectrum) -> usize {
        self.technique = Technique::Other;
        self.trace.vertices.push(Vertex {
            parent,
            place,
            p,
            beta,
            emissions: Vec::new(),
            light_samples: Vec::new(),
            scatterings: Vec::new(),
            photons: Vec::new(),
        });
        self.trace.vertices.len() - 1
    }

    fn last(&self) -> Option<usize> {
        self.stack.last().copied()
    }

    /// Vertices of the path that starts at `root`.
    fn path_of(&mut self, root: usize) -> &mut Vec<usize> {
        match self.trace.vertices[root].place {
            VertexPlace::Light(_) => &mut self.light,
            _ => &mut self.camera,
        }
    }

    /// Adds light of the pixel as contributions: one for each part in `parts`, or a single one if
    /// `parts` is empty or the light comes from a reused path.
    fn add_light(&mut self, film: Option<Vec2>, radiance: Spectrum) {
        let parts = std::mem::take(&mut self.parts);
        let factor = match film {
            None if self.trace.key.pixel() == self.pixel => self.trace.weight,
            None => 0.0,
            Some(film) => self.filter.eval(film - (self.pixel.as_vec2() + 0.5)),
        };
        if factor == 0.0 {
            return;
        }
        let parts = if parts.is_empty() || matches!(self.technique, Technique::Shared(..)) {
            vec![(self.technique, radiance, self.last())]
        } else {
            parts
        };
        for (technique, radiance, vertex) in parts {
            if radiance.is_black() {
                continue;
            }
            let path = self.path(technique, vertex);
            self.trace.contributions.push(Contribution {
                technique,
                radiance: radiance * factor,
                film,
                vertex,
                path,
            });
        }
        self.technique = Technique::Other;
    }

    /// Indices of the known vertices between the camera and the light.
    fn path(&self, technique: Technique, vertex: Option<usize>) -> Vec<usize> {
        if let Technique::Merging(_, t, ..) = technique {
            return self.camera.iter().take(t).copied().collect();
        }
        if let Technique::Connection(s, t, ..) = technique {
            let camera = self.camera.iter().take(t);
            let light = self
                .light
                .iter()
                .take(if s == 1 { 0 } else { s })
                .copied()
                .collect::<Vec<_>>();
            return camera.copied().chain(light.into_iter().rev()).collect();
        }
        let mut path: Vec<usize> = std::iter::successors(vertex, |v| self.trace.vertices[*v].parent).collect();
        path.reverse();
        path
    }
}
