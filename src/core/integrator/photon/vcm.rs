//! Vertex connection and merging: `bdpt` with one additional strategy at each vertex of the camera
//! path. This strategy merges the camera path with a light path that ends near the vertex.
//!
//! `bidirectional/connection/weights.rs` computes the MIS weights and explains the term of merging.
//! Merging and connections use different light paths. The light paths for merging are stored for a
//! whole iteration, about 500 bytes per vertex, so in a large image their number is smaller than
//! the number of pixels.

use super::density::is_one_surface;
use super::grid::{GridItem, PhotonGrid};
use super::photons::{PhotonTracer, PhotonWorkItem};
use crate::accel::Accel;
use crate::integrator::bidirectional::connection::{Connector, Merging};
use crate::integrator::bidirectional::subpath::PathVertex;
use crate::integrator::search_radius::{ProgressiveRadius, Radii};
use crate::integrator::{FoundLight, Heuristic, IterationIntegrator, PathEvent, RaySink, Roulette, SplatSink, World};
use crate::math::Vec3;
use crate::sampler::{SampleKey, Sampler};
use std::f32::consts::PI;

/// Vertex connection and merging (Georgiev, Křivánek, Davidovič and Slusallek 2012; Hachisuka,
/// Pantaleoni and Jensen 2012): bidirectional path tracing with one additional strategy for each
/// vertex. This strategy merges the camera path with a light path that ends near the vertex.
///
/// Merging uses a light path that ends within a radius of a vertex as if it ended at the vertex.
/// The density of the merged path is the density of both subpaths, times `π r² n` for n light
/// paths. MIS combines merging with the other strategies. Together they find light that connections
/// cannot find, such as caustics seen in mirrors. The light from merging has the bias of
/// [`crate::integrator::ProgressivePhotonIntegrator`]; radii shrink in the same way.
///
/// Each sample has a separate light path for connections. The light paths for merging are stored
/// for the time of an iteration. Their number may be smaller than the number of pixels, because
/// they take about 500 bytes per vertex.
#[derive(Debug)]
pub struct VertexMergingIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// MIS heuristic of the strategies.
    pub heuristic: Heuristic,
    /// Maximum number of scattering events. `None`: the maximum of a path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette of the subpaths.
    pub roulette: Roulette,
    /// Number of light paths for merging in an iteration. `None`: the number of pixels, at most
    /// 65536.
    pub photons: Option<u32>,
    /// Search radius of merging.
    pub radius: ProgressiveRadius,
}

/// Default maximum number of light paths for merging.
pub const MAX_MERGED_PATHS: u32 = 1 << 16;

/// Light paths for merging of one work item, and their time.
#[derive(Debug)]
pub struct WorkItemPaths<'a> {
    time: f32,
    paths: Vec<Vec<PathVertex<'a>>>,
}

/// Light paths that camera paths of an iteration merge with, and a grid of the vertices of these
/// paths.
#[derive(Debug)]
pub struct MergedPaths<'a> {
    paths: Vec<Vec<PathVertex<'a>>>,
    grid: PhotonGrid<Visit>,
    radii: Radii<'a>,
    time: f32,
}

/// Item of the grid: a vertex of a light path.
#[derive(Clone, Copy, Debug)]
struct Visit {
    p: [f32; 3],
    path: u32,
    vertex: u32,
}

impl GridItem for Visit {
    fn place(&self) -> Vec3 {
        Vec3::from_array(self.p)
    }
}

impl<'a, A: Accel> VertexMergingIntegrator<'a, A> {
    fn paths(&self) -> u32 {
        let size = self.world.camera.resolution();
        let usual = || size.x.saturating_mul(size.y).min(MAX_MERGED_PATHS);
        self.photons.unwrap_or_else(usual).max(1)
    }

    fn radii(&self, iteration: u32) -> Radii<'a> {
        self.radius
            .of_iteration(iteration, self.world.camera, &self.world.scene.ball())
    }

    /// Connector that also merges subpaths within the search radii `radii`.
    fn connector<'w>(&'w self, radii: &'w Radii<'w>) -> Connector<'w, 'a, A> {
        Connector {
            merging: Some(Merging {
                paths: self.paths() as f32,
                radii,
            }),
            ..Connector::new(&self.world, self.heuristic, self.roulette, self.max_depth)
        }
    }
}

impl<'a, A: Accel> IterationIntegrator for VertexMergingIntegrator<'a, A> {
    type PreparationPart = WorkItemPaths<'a>;
    type Preparation = MergedPaths<'a>;

    fn preparations(&self) -> u32 {
        PhotonTracer::<A>::work_items(self.paths())
    }

    fn prepare<S: Sampler>(
        &self,
        iteration: u32,
        index: u32,
        sampler: &mut S,
        out: &mut impl RaySink,
    ) -> Self::PreparationPart {
        let tracer = PhotonTracer {
            world: self.world,
            max_depth: self.max_depth,
            roulette: self.roulette,
            min_scatterings: 0,
        };
        let time = self.world.time_of_iteration(iteration, sampler);
        let radii = self.radii(iteration);
        let connector = self.connector(&radii);
        let mut paths = Vec::new();
        let item = PhotonWorkItem {
            iteration,
            index,
            paths: self.paths(),
        };
        tracer.each_path(item, Some(time), sampler, out, |mut path| {
            connector.sum_light(&mut path, time);
            // Free unused memory, because the path is stored for the whole iteration.
            path.shrink_to_fit();
            paths.push(path);
        });
        WorkItemPaths { time, paths }
    }

    fn join(&self, iteration: u32, parts: Vec<Self::PreparationPart>) -> Self::Preparation {
        let time = parts.first().map_or(0.0, |part| part.time);
        let radii = self.radii(iteration);
        let paths: Vec<Vec<PathVertex>> = parts.into_iter().flat_map(|part| part.paths).collect();
        let mut visits = Vec::new();
        for (path, vertices) in paths.iter().enumerate() {
            for (i, vertex) in vertices.iter().enumerate() {
                if vertex.surface().is_some_and(|surface| !surface.bsdf.is_delta()) {
                    visits.push(Visit {
                        p: vertex.p.to_array(),
                        path: path as u32,
                        vertex: i as u32,
                    });
                }
            }
        }
        MergedPaths {
            paths,
            grid: PhotonGrid::new(visits, &radii, time),
            radii,
            time,
        }
    }

    fn repeats(&self) -> bool {
        self.world.camera.repeats()
    }

    fn sends_light(&self) -> bool {
        true
    }

    fn sample<S: Sampler>(
        &self,
        prepared: &Self::Preparation,
        key: SampleKey,
        sampler: &mut S,
        out: &mut impl SplatSink,
    ) {
        let scene = self.world.scene;
        let connector = self.connector(&prepared.radii);
        // Trace both subpaths
        let ray = self.world.camera_ray(key, Some(prepared.time), sampler, out);
        let mut paths = connector.subpaths(ray, sampler, out);
        if let Some(first) = paths.first_seen(&self.world, out) {
            out.first_surface(first);
        }

        // Connect both subpaths by all strategies
        let mut found = Vec::new();
        connector.all(&mut paths, sampler, out, |contribution| found.push(contribution));
        for c in found {
            c.add_to(scene, out);
        }

        // Merge light paths that end near a vertex of the camera path
        let camera = &paths.camera;
        for t in 2..=camera.len() {
            let last = &camera[t - 1];
            let Some(surface) = last.surface().filter(|surface| !surface.bsdf.is_delta()) else {
                continue;
            };
            let radius = prepared.radii.at(last.p, prepared.time);
            let density = 1.0 / (PI * radius * radius * self.paths() as f32);
            prepared.grid.each_within(last.p, radius, |visit| {
                let path = &prepared.paths[visit.path as usize];
                let (before, end) = (&path[..visit.vertex as usize], &path[visit.vertex as usize]);
                let Some(arrived) = end.surface().filter(|_| t + before.len() <= connector.max_vertices()) else {
                    return;
                };
                let wi = arrived.back;
                let f = surface.scattered_arrival(scene, surface.back, wi) * (1.0 / wi.dot(end.ng).abs());
                let radiance = last.beta * f * end.beta * (density * arrived.over_opacity(scene));
                if is_one_surface(last.ng, end.ng) && radiance.is_valid() && !radiance.is_black() {
                    let weight = connector.merging_weight(&camera[..t], before, prepared.time);
                    if out.records() {
                        out.record(PathEvent::Connection {
                            strategy: (before.len() + 1, t),
                            is_merged: true,
                            light: path[0].light_id(),
                            weight,
                            radiance,
                        });
                    }
                    let scatterings = (before.len() + t - 1) as u32;
                    out.light(FoundLight::of(
                        radiance * weight,
                        path[0].light_id(),
                        scene,
                        scatterings,
                    ));
                }
            });
        }
    }
}
