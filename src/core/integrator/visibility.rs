//! Learns which part of the sky is visible from surfaces, before the first sample.
//! `light_sampling/visibility_grid.rs` uses the learned visibility to sample directions of the sky.
//!
//! First some camera paths are traced, as in the render, to find surface points. If enough rays of
//! these paths leave the scene, sampling the sky by radiance is good enough, and nothing is
//! learned. Otherwise rays are traced from each grid cell with surfaces, one ray through each bin
//! of sky directions. They start at the points that the paths found. The number of rays is limited
//! to a few percent of the rays of an image with 16 samples per pixel.
//!
//! The random numbers do not depend on samples, settings, the crop or the seed, so all parts of a
//! render learn the same visibility.

use super::vertex::Vertex;
use super::{RayKind, RaySink, World};
use crate::accel::Accel;
use crate::geometry::{Side, SurfacePoint};
use crate::light::Light;
use crate::light_sampling::{RAYS_A_CLUSTER, SelectionMode, VisibilityGrid, VisibilityTarget};
use crate::material::BsdfSlot;
use crate::math::{Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler, Stream};
use crate::scene::Scene;

/// Number of pixels of the image for each path that finds surfaces.
const PIXELS_A_PATH: u64 = 8;
/// Minimum and maximum number of paths that find surfaces.
const PATHS: [u64; 2] = [128, 32_768];
/// Number of paths in a work item.
const PATHS_A_WORK_ITEM: u32 = 256;
/// Maximum number of scattering events of a path.
const MAX_DEPTH: u32 = 8;
/// Maximum probability that a path continues.
const MAX_SURVIVAL: f32 = 0.9;
/// Maximum number of learning rays per pixel. They take about 4 % of the time of 16 samples.
const RAYS_A_PIXEL: u64 = 2;
/// Minimum and maximum number of learning rays.
const RAYS: [u64; 2] = [1 << 11, 1 << 20];
/// If at least this fraction of the rays from surfaces leave the scene, learned visibility does not
/// reduce the noise.
const OPEN: f64 = 0.4;
/// Maximum number of surface points from which a cell traces rays.
const SITES_A_CELL: usize = 64;
/// Maximum number of surface points of a cell that are tried until one of them faces the target.
const TRIES: usize = 16;
/// Number of cells in a work item.
const CELLS_A_WORK_ITEM: usize = 16;

/// Learns which part of the sky is visible from the surfaces that the camera sees, directly or
/// indirectly.
#[derive(Debug)]
pub struct VisibilityLearner<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
}

/// A surface point that receives light, from which visibility is traced.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    point: SurfacePoint,
    /// Normal on the side that receives light; zero if both sides receive light.
    n: Vec3,
}

/// Surface points that paths have found.
#[derive(Clone, Debug, Default)]
pub struct Sites {
    /// Surface points, path by path.
    pub sites: Vec<Site>,
    /// Number of counted rays: rays that left a surface by a smooth lobe.
    rays: u64,
    /// Number of counted rays that left the scene.
    escaped: u64,
}

/// Surface points, sorted into the cells of the grid and into groups of cells.
#[derive(Clone, Debug)]
pub struct SitesByCell {
    cells: Vec<Vec<Site>>,
    groups: Vec<Vec<Site>>,
    /// Index of the group of each grid cell.
    group_of: Vec<usize>,
    /// Number of points that paths found in each cell.
    counts: Vec<usize>,
}

impl SitesByCell {
    /// Number of groups of cells.
    pub fn groups(&self) -> usize {
        self.groups.len()
    }

    /// Number of points that paths found in each cell.
    pub fn counts(&self) -> &[usize] {
        &self.counts
    }
}

/// Returns `true` if the selection mode `mode` needs the visibility of the lights of `scene`.
fn learns_visibility(scene: &Scene, mode: SelectionMode) -> bool {
    let is_sky = |light: &Light| matches!(light, Light::Constant(_) | Light::Environment(_));
    let is_enabled = match mode {
        SelectionMode::Visibility => true,
        // With lamps only, learned visibility does not reduce the noise (docs/notebook/2026-11.md).
        SelectionMode::Auto => scene.lights().iter().any(is_sky),
        SelectionMode::Power | SelectionMode::Place | SelectionMode::Uniform | SelectionMode::All => false,
    };
    // A shadow-catching ground needs the blocked light, which comes from directions that are not
    // visible.
    is_enabled && scene.ground().is_none()
}

impl<A: Accel> VisibilityLearner<'_, A> {
    /// Returns `true` if visibility must be learned and is not learned yet.
    pub fn is_needed(&self) -> bool {
        let selection = self.world.light_selection;
        learns_visibility(self.world.scene, selection.mode()) && !selection.is_learned()
    }

    fn pixels(&self) -> u64 {
        let resolution = self.world.camera.resolution();
        u64::from(resolution.x) * u64::from(resolution.y)
    }

    fn paths(&self) -> u32 {
        (self.pixels() / PIXELS_A_PATH).clamp(PATHS[0], PATHS[1]) as u32
    }

    /// Number of work items that find surfaces.
    pub fn site_work_items(&self) -> u32 {
        self.paths().div_ceil(PATHS_A_WORK_ITEM)
    }

    /// Traces the paths of work item `index`, and returns the surface points that they find.
    pub fn find_sites(&self, index: u32, out: &mut impl RaySink) -> Sites {
        let mut found = Sites::default();
        let first = index * PATHS_A_WORK_ITEM;
        for path in first..(first + PATHS_A_WORK_ITEM).min(self.paths()) {
            if out.is_cancelled() {
                break;
            }
            self.follow(path, &mut found, out);
        }
        found
    }

    fn follow(&self, path: u32, found: &mut Sites, out: &mut impl RaySink) {
        let world = &self.world;
        let mut sampler = Independent::new(0);
        sampler.start(SampleKey::of_stream(Stream::Visibility, path, 0));
        let film = evenly(path) * world.camera.resolution().as_vec2();
        let mut ray = world.ray_through(film, world.time(&sampler), &sampler);
        let mut kind = RayKind::Camera;
        let mut is_delta = true;
        for depth in 0..=MAX_DEPTH {
            let (hit, _) = world.intersect(&ray, kind, out);
            found.rays += u64::from(!is_delta);
            let Some(hit) = hit else {
                found.escaped += u64::from(!is_delta);
                return;
            };
            let slot = BsdfSlot::new();
            let vertex = world.vertex(&hit, &ray, None, &slot);
            if !vertex.bsdf.is_delta() {
                found.sites.push(Site::new(&vertex));
            }
            let number = |what| Dimension::bounce(depth, what);
            let (u_lobe, u) = (
                sampler.get_1d(number(Bounce::Lobe)),
                sampler.get_2d(number(Bounce::Direction)),
            );
            let Some(sample) = vertex.sample(u_lobe, u) else { return };
            let survival = sample.weight.max_component().min(MAX_SURVIVAL);
            if survival.is_nan() || sampler.get_2d(number(Bounce::Decisions)).y >= survival {
                return;
            }
            is_delta = sample.is_delta();
            ray = self.world.ray_along(&vertex, sample.wi);
            kind = RayKind::Bounce;
        }
    }

    /// Joins the results of all work items, in the order of their indices.
    pub fn join(&self, work_items: Vec<Sites>) -> Sites {
        let mut all = Sites::default();
        for work_item in work_items {
            all.sites.extend(work_item.sites);
            all.rays += work_item.rays;
            all.escaped += work_item.escaped;
        }
        all
    }

    /// Makes a grid of cells for the surface points `found`. `None` if learned visibility would not
    /// reduce the noise.
    pub fn grid(&self, found: &Sites) -> Option<VisibilityGrid> {
        let scene = self.world.scene;
        let is_open = found.escaped as f64 >= OPEN * found.rays as f64;
        if is_open && self.world.light_selection.mode() != SelectionMode::Visibility {
            return None;
        }
        let rays = (self.pixels() * RAYS_A_PIXEL).clamp(RAYS[0], RAYS[1]) as usize;
        let points: Vec<Vec3> = found.sites.iter().map(|site| site.point.p).collect();
        self.world
            .light_selection
            .visibility_grid(scene.lights(), &points, rays)
    }

    /// Sorts `sites` into the cells of `grid` and into groups of cells, and keeps their order. If a
    /// cell or a group has too many sites, an evenly spaced selection is kept. The counts of the
    /// cells include all sites.
    pub fn places(&self, grid: &VisibilityGrid, sites: &[Site]) -> SitesByCell {
        let group_of = grid.groups();
        let mut places = SitesByCell {
            cells: vec![Vec::new(); grid.cells()],
            groups: vec![Vec::new(); group_of.iter().max().map_or(0, |last| last + 1)],
            counts: Vec::new(),
            group_of,
        };
        for site in sites {
            if let Some(cell) = grid.cell(site.point.p) {
                places.cells[cell].push(*site);
                places.groups[places.group_of[cell]].push(*site);
            }
        }
        places.counts = places.cells.iter().map(Vec::len).collect();
        for sites in places.cells.iter_mut().chain(&mut places.groups) {
            let step = sites.len().div_ceil(SITES_A_CELL).max(1);
            *sites = sites.iter().step_by(step).copied().collect();
        }
        places
    }

    /// Number of work items that trace the rays of `count` cells or groups of cells.
    pub fn trace_work_items(&self, count: usize) -> u32 {
        count.div_ceil(CELLS_A_WORK_ITEM) as u32
    }

    /// Traces work item `index` of the groups: one ray from each group through each bin of the sky.
    /// Returns the transmittance of each ray.
    pub fn trace_from_groups(
        &self,
        grid: &VisibilityGrid,
        places: &SitesByCell,
        index: u32,
        out: &mut impl RaySink,
    ) -> Vec<f32> {
        let first = index as usize * CELLS_A_WORK_ITEM;
        let mut shares = Vec::new();
        for group in first..(first + CELLS_A_WORK_ITEM).min(places.groups.len()) {
            for bin in 0..grid.bins() {
                let share = self.trace_to(
                    grid,
                    &places.groups[group],
                    VisibilityTarget::Bin(bin),
                    group as u32,
                    2 * bin as u32 + 1,
                    out,
                );
                shares.push(share.unwrap_or(0.0));
            }
        }
        shares
    }

    /// Traces work item `index` of the cells. Returns the mean transmittance from each cell to each
    /// target. `groups` has the transmittances that [`VisibilityLearner::trace_from_groups`]
    /// returned.
    pub fn trace_from_cells(
        &self,
        grid: &VisibilityGrid,
        places: &SitesByCell,
        groups: &[f32],
        index: u32,
        out: &mut impl RaySink,
    ) -> Vec<f32> {
        let first = index as usize * CELLS_A_WORK_ITEM;
        let mut shares = Vec::new();
        for cell in first..(first + CELLS_A_WORK_ITEM).min(grid.cells()) {
            let group = &groups[places.group_of[cell] * grid.bins()..][..grid.bins()];
            for (number, target) in (0..).zip(grid.targets()) {
                let mut mean = |count: u32| {
                    let rays = (0..count).map(|i| 2 * (number * RAYS_A_CLUSTER + i) + 2);
                    let shares =
                        rays.filter_map(|ray| self.trace_to(grid, &places.cells[cell], target, cell as u32, ray, out));
                    shares.sum::<f32>() / count as f32
                };
                shares.push(match target {
                    VisibilityTarget::Bin(bin) if grid.bins_around(bin).all(|near| group[near] == 0.0) => 0.0,
                    VisibilityTarget::Bin(bin) => 0.5 * (mean(1) + group[bin]),
                    VisibilityTarget::Cluster(_) => mean(RAYS_A_CLUSTER),
                });
            }
        }
        shares
    }

    /// Transmittance along one ray from one of the `sites` to `target`. `None` if no site faces the
    /// target. `column` and `index` select the random numbers.
    fn trace_to(
        &self,
        grid: &VisibilityGrid,
        sites: &[Site],
        target: VisibilityTarget,
        column: u32,
        index: u32,
        out: &mut impl RaySink,
    ) -> Option<f32> {
        if out.is_cancelled() {
            return None;
        }
        let mut sampler = Independent::new(0);
        sampler.start(SampleKey::of_stream(Stream::Visibility, column, index));
        let scene = self.world.scene;
        let u = sampler.get_2d(Dimension::PIXEL);
        let start = (sampler.get_1d(Dimension::TECHNIQUE) * sites.len() as f32) as usize;
        let (before, after) = sites.split_at(start.min(sites.len()));
        // Try several sites. A direction of the sky is the same from every site.
        let mut tries = after.iter().chain(before).take(TRIES);
        let (site, sample) = tries.find_map(|site| {
            let sample = grid.sample_target(
                scene.lights(),
                target,
                site.point.p,
                site.point.time,
                u,
                scene.textures(),
            )?;
            site.faces(sample.wi).then_some((site, sample))
        })?;
        let side = Side::of(sample.wi.dot(site.point.ns));
        let ray = sample
            .shadow_ray(self.world.origin_on(&site.point, side, sample.wi))
            .when(site.point.time);
        Some(self.world.transmittance(&ray, out).color().mean())
    }
}

impl Site {
    fn new(vertex: &Vertex) -> Self {
        Self {
            point: vertex.point,
            n: vertex.light_context().n,
        }
    }

    /// Returns `true` if the surface receives light from the unit direction `wi` (world frame).
    fn faces(&self, wi: Vec3) -> bool {
        self.n == Vec3::ZERO || self.n.dot(wi) > 0.0
    }
}

/// Point `index` of a sequence that fills the unit square evenly from its first points on: the
/// additive recurrence of the plastic number (Roberts 2018, "The Unreasonable Effectiveness of
/// Quasirandom Sequences").
fn evenly(index: u32) -> Vec2 {
    let at = |step: f64| (0.5 + step * f64::from(index)).fract() as f32;
    Vec2::new(at(0.754_877_666_246_692_7), at(0.569_840_290_998_053_2)).min(Vec2::splat(crate::math::float::ALMOST_ONE))
}
