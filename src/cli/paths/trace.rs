//! A recorded sample as vertices and contributions; `builder` makes it of its events.

use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::{EmissionRecord, LightSampleRecord, ScatteringRecord};
use crate::light::LightId;
use crate::math::{Vec2, Vec3};
use crate::sampler::SampleKey;

/// One sample, or one Markov chain, as far as it lights the pixel.
pub(in crate::cli) struct Trace {
    pub key: SampleKey,
    /// Factor of the light in the sample's own pixel.
    pub weight: f32,
    pub vertices: Vec<Vertex>,
    pub contributions: Vec<Contribution>,
}

/// A vertex of a path.
pub(in crate::cli) struct Vertex {
    /// The vertex before it, `None` where a path begins.
    pub parent: Option<usize>,
    pub place: Place,
    pub p: Vec3,
    /// Throughput of the ray that meets it, or that leaves the start of a path.
    pub beta: Spectrum,
    pub emissions: Vec<EmissionRecord>,
    pub light_samples: Vec<LightSampleRecord>,
    /// Ways on: several in trees of rays.
    pub scatterings: Vec<ScatteringRecord>,
    /// Number and radius of photons of density estimates.
    pub photons: Vec<(u32, f32)>,
}

/// What a vertex lies on.
#[derive(Clone, Copy)]
pub(in crate::cli) enum Place {
    Camera,
    Light(LightId),
    Surface { hit: Hit, n: Vec3, depth: u32 },
}

/// How light was found.
#[derive(Clone, Copy, PartialEq)]
pub(in crate::cli) enum Technique {
    /// A path met a light.
    Emission,
    /// A light was sampled.
    LightSample,
    /// Subpaths were connected: vertices from the light and from the camera, MIS weight, light without it.
    Connection(usize, usize, f32, Spectrum),
    /// The density of photons.
    Photons,
    /// Photons or subpaths that end near each other: vertices from the light and from the camera, both with the end, MIS weight, light without it.
    Merging(usize, usize, f32, Spectrum),
    /// The cache of irradiance.
    Cache,
    /// A Markov chain.
    Chain,
    /// The path of another pixel, or the own one, which pixels share: its pixel, and the end that they see.
    Shared([u32; 2], Vec3),
    /// None of these.
    Other,
}

impl Technique {
    pub fn name(self) -> &'static str {
        match self {
            Self::Emission => "emission",
            Self::LightSample => "light sample",
            Self::Connection(..) => "connection",
            Self::Photons => "photons",
            Self::Merging(..) => "merging",
            Self::Cache => "irradiance cache",
            Self::Chain => "Markov chain",
            Self::Shared(..) => "shared path",
            Self::Other => "other",
        }
    }
}

/// Light that is added to the pixel.
pub(in crate::cli) struct Contribution {
    pub technique: Technique,
    /// Light in the pixel, the filter's factor included.
    pub radiance: Spectrum,
    /// The light's place on the film, where that is not in the sample's own pixel.
    pub film: Option<Vec2>,
    /// The vertex at which it was found.
    pub vertex: Option<usize>,
    /// Vertices of the path by which the light comes, from the camera on, as far as they were recorded.
    pub path: Vec<usize>,
}

impl Trace {
    /// Sum of all contributions: the light of the sample in the pixel.
    pub fn sum(&self) -> Spectrum {
        self.contributions
            .iter()
            .fold(Spectrum::ZERO, |sum, c| sum + c.radiance)
    }

    /// Leaves out the paths that do not light the pixel: of other samples, and of chains.
    pub fn keep_what_counts(&mut self) {
        let mut is_kept = vec![false; self.vertices.len()];
        for contribution in &self.contributions {
            let mut mark = |mut vertex: Option<usize>| {
                while let Some(v) = vertex.filter(|v| !is_kept[*v]) {
                    is_kept[v] = true;
                    vertex = self.vertices[v].parent;
                }
            };
            mark(contribution.vertex);
            contribution.path.iter().for_each(|v| mark(Some(*v)));
        }
        let mut next = 0;
        let places: Vec<Option<usize>> = is_kept
            .iter()
            .map(|is_kept| {
                is_kept.then(|| {
                    next += 1;
                    next - 1
                })
            })
            .collect();
        let place = |v: usize| places[v];
        let mut kept = is_kept.iter();
        self.vertices.retain(|_| *kept.next().unwrap_or(&false));
        for vertex in &mut self.vertices {
            vertex.parent = vertex.parent.and_then(place);
        }
        for contribution in &mut self.contributions {
            contribution.vertex = contribution.vertex.and_then(place);
            contribution.path = contribution.path.iter().filter_map(|v| place(*v)).collect();
        }
    }
}
