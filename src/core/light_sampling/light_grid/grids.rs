//! Cells of the light grid: concentric grids. Each grid is twice as large as the grid within it.

use crate::math::{Bounds3, Vec3};

/// Cells along the longest side of a grid.
const RESOLUTION: u32 = 24;
/// Maximum number of grids.
const MAX_LEVELS: u32 = 16;
/// Maximum number of places with lights around a cell that is not dense.
const PLACES: usize = 12;
/// Number of divisions of a cell along each axis. Lights in the same division are in one place.
const DIVISIONS: u32 = 4;

/// Concentric grids. Each grid is twice as large as the grid within it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grids {
    center: Vec3,
    /// Half the side lengths of the innermost grid.
    half: Vec3,
    /// Number of cells along each side of a grid.
    counts: [u32; 3],
    levels: u32,
}

impl Grids {
    /// Grids for lights with the middles `lights`, in a scene within `bounds`.
    pub fn new(lights: &[Vec3], bounds: Bounds3, scene_radius: f32) -> Self {
        // Extend the box of the lights by half its size
        let of_lights: Bounds3 = lights.iter().copied().collect();
        let mut inner = of_lights;
        if !of_lights.is_empty() {
            let margin = (0.5 * (of_lights.max - of_lights.min).max_element()).max(scene_radius / 64.0);
            inner.min = (of_lights.min - Vec3::splat(margin)).max(bounds.min);
            inner.max = (of_lights.max + Vec3::splat(margin)).min(bounds.max);
        }
        if inner.is_empty() {
            inner = bounds;
        }
        // The margins are unusual fractions of the size. Walls often have round coordinates or are
        // the scene's bounds, so borders between cells then do not lie on walls. On a border,
        // rounding errors would decide the cell of a point.
        let margins =
            [0.013, 0.029].map(|share| share * (inner.max - inner.min).max_element().max(scene_radius / 64.0));
        inner.min -= margins[0];
        inner.max += margins[1];
        let extent = inner.max - inner.min;
        let size = extent.max_element() / RESOLUTION as f32;
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        let counts = extent
            .to_array()
            .map(|e| ((e / size).ceil() as u32).clamp(1, RESOLUTION));
        let half = 0.5 * size * Vec3::from_array(counts.map(|n| n as f32));
        let center = inner.center();
        let reach = ((bounds.max - center).max(center - bounds.min) / half).max_element();
        let levels = 1 + level_of(reach).min(MAX_LEVELS - 1);
        Self {
            center,
            half,
            counts,
            levels,
        }
    }

    /// For each cell of the innermost grid, true if many of the `lights` are in the cell or around
    /// it. The result is empty if this is so for no cell. Lights in one place, such as the
    /// triangles of a lamp, count once.
    pub fn dense_cells(&self, lights: &[Vec3]) -> Vec<bool> {
        let inner = lights.iter().map(|&p| self.place(p)).filter(|(level, ..)| *level == 0);
        let division = |x: f32| ((x * DIVISIONS as f32) as u32).min(DIVISIONS - 1);
        let mut places: Vec<(usize, [u32; 3])> = inner
            .map(|(_, cell, within)| (self.index(0, cell), within.to_array().map(division)))
            .collect();
        places.sort_unstable();
        places.dedup();
        let mut counts = vec![0; self.cells_of_level()];
        places.iter().for_each(|(cell, _)| counts[*cell] += 1);
        let around = self.sums_around(&counts);
        if around.iter().any(|&count| count > PLACES) {
            around.iter().map(|&count| count > PLACES).collect()
        } else {
            Vec::new()
        }
    }

    /// For each cell of the innermost grid, the sum of `values` over the cell and the cells that
    /// share a face, an edge or a corner with it.
    fn sums_around(&self, values: &[usize]) -> Vec<usize> {
        let [nx, ny, nz] = self.counts;
        let around = |i: u32, n: u32| i.saturating_sub(1)..(i + 2).min(n);
        let sum = |[i, j, k]: [u32; 3]| {
            let rows = around(k, nz).flat_map(|k| around(j, ny).map(move |j| (j, k)));
            let cells = rows.flat_map(|(j, k)| around(i, nx).map(move |i| [i, j, k]));
            cells.map(|cell| values[self.index(0, cell)]).sum()
        };
        let rows = (0..nz).flat_map(|k| (0..ny).map(move |j| (j, k)));
        rows.flat_map(|(j, k)| (0..nx).map(move |i| [i, j, k]))
            .map(sum)
            .collect()
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.levels as usize * self.cells_of_level()
    }

    fn cells_of_level(&self) -> usize {
        self.counts.iter().map(|&n| n as usize).product()
    }

    /// Grid and cell of `p`, and the position of `p` within the cell, from 0 to 1. If `p` is
    /// outside, the nearest cell.
    #[inline(always)]
    fn place(&self, p: Vec3) -> (u32, [u32; 3], Vec3) {
        let x = (p - self.center) / self.half;
        let level = level_of(x.abs().max_element()).min(self.levels - 1);
        let shrunk = x * f32::from_bits((127 - level) << 23);
        let [nx, ny, nz] = self.counts;
        let scaled = |x: f32, n: u32| (0.5 * x + 0.5) * n as f32;
        let at = [scaled(shrunk.x, nx), scaled(shrunk.y, ny), scaled(shrunk.z, nz)];
        let digit = |x: f32, n: u32| (x as u32).min(n - 1);
        let cell = [digit(at[0], nx), digit(at[1], ny), digit(at[2], nz)];
        let within = Vec3::from_array(at) - Vec3::from_array(cell.map(|i| i as f32));
        (level, cell, within)
    }

    #[inline(always)]
    fn index(&self, level: u32, [i, j, k]: [u32; 3]) -> usize {
        let [nx, ny, nz] = self.counts;
        (((level * nz + k) * ny + j) * nx + i) as usize
    }

    /// The cell of `p`; the nearest cell if `p` is outside.
    #[inline(always)]
    pub fn cell(&self, p: Vec3) -> usize {
        let (level, cell, _) = self.place(p);
        self.index(level, cell)
    }

    /// Middle of a cell, and the radius of a ball that encloses it.
    pub fn ball(&self, cell: usize) -> (Vec3, f32) {
        let [nx, ny, nz] = self.counts.map(|n| n as usize);
        let index = [cell % nx, cell / nx % ny, cell / (nx * ny) % nz];
        let scale = 2f32.powi((cell / self.cells_of_level()) as i32);
        let counts = Vec3::from_array(self.counts.map(|n| n as f32));
        let x = (Vec3::from_array(index.map(|i| i as f32)) + 0.5) / counts * 2.0 - 1.0;
        let size = 2.0 * self.half / counts * scale;
        (self.center + x * self.half * scale, 0.5 * size.length())
    }

    /// Middle of all grids, and the radius of a ball that encloses them.
    pub fn ball_of_all(&self) -> (Vec3, f32) {
        let half = self.half * 2f32.powi(self.levels as i32 - 1);
        (self.center, half.length())
    }
}

/// Smallest integer k ≥ 0 for which 2ᵏ is larger than `x`.
#[inline(always)]
fn level_of(x: f32) -> u32 {
    (x.to_bits() >> 23).saturating_sub(126)
}
