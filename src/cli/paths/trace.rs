//! A recorded sample as vertices and contributions, built by `builder` from its events.

use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::{EmissionRecord, LightSampleRecord, ScatteringRecord};
use crate::light::LightId;
use crate::math::{Vec2, Vec3};
use crate::sampler::SampleKey;

/// Paths of a sample or of a Markov chain, with only the light that reaches the pixel.
pub(in crate::cli) struct Trace {
    pub key: SampleKey,
    /// Filter weight in the sample's own pixel.
    pub weight: f32,
    pub vertices: Vec<Vertex>,
    pub contributions: Vec<Contribution>,
}

/// A vertex of a path.
pub(in crate::cli) struct Vertex {
    /// Previous vertex; `None` at the start of a path.
    pub parent: Option<usize>,
    pub place: VertexPlace,
    pub p: Vec3,
    /// Throughput of the ray that hits the vertex, or that leaves the start of a path.
    pub beta: Spectrum,
    pub emissions: Vec<EmissionRecord>,
    pub light_samples: Vec<LightSampleRecord>,
    /// Scattering events at the vertex; several if the path branches.
    pub scatterings: Vec<ScatteringRecord>,
    /// Number of photons and search radius of each density estimate at the vertex.
    pub photons: Vec<(u32, f32)>,
}

/// Location of a vertex: on the camera, on a light or on a surface.
#[derive(Clone, Copy)]
pub(in crate::cli) enum VertexPlace {
    Camera,
    Light(LightId),
    Surface { hit: Hit, n: Vec3, depth: u32 },
}

/// Technique that found the light.
#[derive(Clone, Copy, PartialEq)]
pub(in crate::cli) enum Technique {
    /// A path hit a light.
    Emission,
    /// A light was sampled.
    LightSample,
    /// Connected subpaths: numbers of vertices from the light and from the camera, MIS weight, and
    /// light without the weight.
    Connection(usize, usize, f32, Spectrum),
    /// A density estimate of photons found the light.
    Photons,
    /// Merged subpaths (vertex merging): they end near each other. The fields have the meaning of
    /// the fields of `Connection`. Both numbers of vertices include the merged vertex.
    Merging(usize, usize, f32, Spectrum),
    /// The irradiance cache returned the light.
    Cache,
    /// A Markov chain found the light.
    Chain,
    /// Path reuse: the first vertex was connected to the end of a path that several pixels share.
    /// The fields are the pixel that traced this path (possibly the pixel of the sample itself),
    /// and the position of the end.
    Shared([u32; 2], Vec3),
    /// Another technique found the light.
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

/// Light added to the pixel.
pub(in crate::cli) struct Contribution {
    pub technique: Technique,
    /// Light in the pixel, including the filter weight.
    pub radiance: Spectrum,
    /// Film position of the light; `None` if it is in the sample's own pixel.
    pub film: Option<Vec2>,
    /// Index of the vertex that found the light.
    pub vertex: Option<usize>,
    /// Indices of recorded vertices of the path, starting at the camera.
    pub path: Vec<usize>,
}

impl Trace {
    /// Sum of all contributions: the light of the sample in the pixel.
    pub fn sum(&self) -> Spectrum {
        self.contributions
            .iter()
            .fold(Spectrum::ZERO, |sum, c| sum + c.radiance)
    }

    /// Removes all vertices that do not belong to a contribution to the pixel.
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
