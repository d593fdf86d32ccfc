use super::record::Gradients;
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use std::array::from_fn;
use std::f32::consts::PI;

/// Rows of cells, from the normal to the horizon, between which gradients are differences, about. More rays make cells less noisy, not more: the noise
/// of a difference between single rays would not fall with their number.
const GRADIENT_ROWS: f32 = 6.0;

/// A hemisphere cut into strata of equal projected solid angle: rows from the normal (the local +z) to the horizon, columns about it (Ward and
/// Heckbert 1992, "Irradiance Gradients").
#[derive(Clone, Copy, Debug)]
pub struct Strata {
    /// Rows and columns of cells, over which gradients are taken.
    cells: [u32; 2],
    /// Rows and columns of rays in a cell.
    side: u32,
}

/// What a ray has met.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Radiance that comes from there.
    pub radiance: Spectrum,
    /// How far away that is, scene units; infinite where nothing is.
    pub distance: f32,
}

/// What a whole hemisphere sends.
#[derive(Clone, Copy, Debug)]
pub struct Gathered {
    /// Irradiance, W·m⁻².
    pub irradiance: Spectrum,
    /// How it changes, in the local frame.
    pub gradients: Gradients,
    /// Harmonic mean of the distances, cosine-weighted; infinite where nothing is near.
    pub distance: f32,
}

impl Strata {
    /// For about so many rays: cells are about as wide as high at half height, which takes π times as many columns as rows.
    pub fn new(rays: u32) -> Self {
        let rows = (rays as f32 / PI).sqrt();
        let side = (rows / GRADIENT_ROWS).round().max(1.0);
        let cell_rows = (rows / side).round().max(2.0);
        let columns = rays as f32 / (cell_rows * side * side);
        Self {
            cells: [cell_rows as u32, columns.round().max(4.0) as u32],
            side: side as u32,
        }
    }

    /// Number of rays.
    pub fn rays(&self) -> u32 {
        self.cells[0] * self.cells[1] * self.side * self.side
    }

    /// The local direction of the ray `index`, at `u` within its stratum.
    pub fn direction(&self, index: u32, u: Vec2) -> Vec3 {
        let [rows, columns] = self.cells.map(|n| n * self.side);
        let (row, column) = (index / columns, index % columns);
        let squared = (row as f32 + u.x) / rows as f32;
        let (sin, cos) = (2.0 * PI * (column as f32 + u.y) / columns as f32).sin_cos();
        let r = squared.sqrt();
        Vec3::new(r * cos, r * sin, (1.0 - squared).max(0.0).sqrt())
    }

    /// Sums up what the rays have `seen`, in their order, of which there must be [`Strata::rays`].
    pub fn gather(&self, seen: &[Seen]) -> Gathered {
        // The mean of each cell, and the mean over all
        let cells = self.cell_means(seen);
        let count = cells.len() as f32;
        let mut radiance = Spectrum::ZERO;
        let mut nearness = 0.0;
        for cell in &cells {
            radiance += cell.radiance;
            nearness += 1.0 / cell.distance;
        }
        Gathered {
            irradiance: radiance * (PI / count),
            gradients: Gradients {
                rotational: self.rotational(&cells),
                translational: self.translational(&cells),
            },
            distance: count / nearness,
        }
    }

    /// Of each cell, row by row, the mean radiance and the harmonic mean distance.
    fn cell_means(&self, seen: &[Seen]) -> Vec<Seen> {
        let ([rows, columns], side) = (self.cells, self.side);
        let mean = |row: u32, column: u32| {
            let mut radiance = Spectrum::ZERO;
            let mut nearness = 0.0;
            for r in row * side..(row + 1) * side {
                let first = (r * columns + column) * side;
                for ray in seen.iter().skip(first as usize).take(side as usize) {
                    radiance += ray.radiance;
                    nearness += 1.0 / ray.distance;
                }
            }
            let count = (side * side) as f32;
            Seen {
                radiance: radiance / count,
                distance: count / nearness,
            }
        };
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        places.map(|(row, column)| mean(row, column)).collect()
    }

    /// The change by turns (Ward and Heckbert 1992, eq. 3). The axis that turns the normal towards a direction is a quarter of a turn beyond its azimuth,
    /// and the cosine of the angle with it grows by its sine.
    fn rotational(&self, cells: &[Seen]) -> [Vec3; 3] {
        let [rows, columns] = self.cells;
        let mut sums = [Vec3::ZERO; 3];
        for column in 0..columns {
            let mut sum = Spectrum::ZERO;
            for row in 0..rows {
                let squared = (row as f32 + 0.5) / rows as f32;
                let tan = (squared / (1.0 - squared)).sqrt();
                sum += cells[(row * columns + column) as usize].radiance * tan;
            }
            let axis = self.tangent(column as f32 + 0.5, 0.25);
            add(&mut sums, sum * (PI / (rows * columns) as f32), axis);
        }
        sums
    }

    /// The change by moves (Ward and Heckbert 1992, eq. 4): what is seen on the two sides of the boundary between cells differs, and the boundary wanders
    /// against the move, the faster the nearer it is. It belongs to the nearer side, which hides the other one.
    fn translational(&self, cells: &[Seen]) -> [Vec3; 3] {
        let [rows, columns] = self.cells;
        let cell = |row: u32, column: u32| &cells[(row * columns + column) as usize];
        let sin_to = |row: u32| (row as f32 / rows as f32).sqrt();
        let mut sums = [Vec3::ZERO; 3];
        for column in 0..columns {
            // Boundaries between rows, which moves along the azimuth bring nearer to the normal
            let mut along = Spectrum::ZERO;
            for row in 1..rows {
                let (inner, outer) = (cell(row - 1, column), cell(row, column));
                let sin = sin_to(row);
                let rate = 2.0 * PI / columns as f32 * sin * (1.0 - sin * sin) / inner.distance.min(outer.distance);
                along += (outer.radiance - inner.radiance) * rate;
            }
            add(&mut sums, along, self.tangent(column as f32 + 0.5, 0.0));

            // Boundaries with the column before, which moves across it turn away
            let mut across = Spectrum::ZERO;
            let before = (column + columns - 1) % columns;
            for row in 0..rows {
                let (last, next) = (cell(row, before), cell(row, column));
                let rate = (sin_to(row + 1) - sin_to(row)) / last.distance.min(next.distance);
                across += (next.radiance - last.radiance) * rate;
            }
            add(&mut sums, across, self.tangent(column as f32, 0.25));
        }
        sums
    }

    /// The unit vector in the surface at the azimuth of `column`, so many `turns` on.
    fn tangent(&self, column: f32, turns: f32) -> Vec3 {
        let (sin, cos) = (2.0 * PI * (column / self.cells[1] as f32 + turns)).sin_cos();
        Vec3::new(cos, sin, 0.0)
    }
}

/// Adds `direction` to each channel's sum, times what is in the channel.
fn add(sums: &mut [Vec3; 3], factor: Spectrum, direction: Vec3) {
    let factor = factor.to_array();
    *sums = from_fn(|c| sums[c] + direction * factor[c]);
}
