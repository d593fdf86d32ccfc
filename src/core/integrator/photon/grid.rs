//! A hash grid of the photons of one iteration.
//!
//! A counting sort fills the table in the order of the photons, so its contents do not depend on
//! threads. The table has cells of several widths: the cell of a photon is two to four times as
//! wide as the search radius at the photon. The level of a cell is the base-2 logarithm of its
//! width. A lookup at a point reads one or two levels, because search radii near the point differ
//! little. So the grid suits near and far surfaces, and a lookup reads at most some dozens of
//! cells.

use super::photons::Photon;
use crate::integrator::search_radius::Radii;
use crate::math::Vec3;
use crate::math::float::gamma;
use crate::math::hash::mix;

/// An item of a [`PhotonGrid`], which has a position.
pub trait GridItem: Copy {
    /// Position in world space.
    fn place(&self) -> Vec3;
}

impl GridItem for Photon {
    fn place(&self) -> Vec3 {
        self.p()
    }
}

/// Photons, or other items, sorted by position: a hash table of the cells of regular grids.
///
/// The cell of a photon is two to four times as wide as the search radius at the photon. Cells of
/// equal width form a level. Radii change slowly with position. So a search visits one or two
/// levels and few of their cells, even if radii elsewhere are very different.
#[derive(Debug)]
pub struct PhotonGrid<T = Photon> {
    /// Photons sorted by the bucket of their cell. Within a bucket they keep their original order.
    photons: Vec<T>,
    cells: Vec<Cell>,
    /// Index of the first photon of each bucket, and the end of the last bucket.
    starts: Vec<u32>,
    /// Maximum change of the search radius per unit of distance.
    slope: f32,
}

/// A cell of the grid: a cube of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell {
    /// Base-2 logarithm of the width of the cell in scene units.
    level: i32,
    place: [i32; 3],
}

impl Cell {
    fn of(p: Vec3, level: i32) -> Self {
        let place = (p * (1.0 / width(level))).floor();
        Self {
            level,
            place: place.to_array().map(|v| v as i32),
        }
    }

    fn hash(&self) -> u64 {
        let [x, y, z] = self.place.map(|v| v as u32 as u64);
        mix(mix(x << 32 | y) ^ (z << 32 | self.level as u32 as u64))
    }
}

/// Level of the cell of a photon at which the search radius is `radius`. A cell is two to four
/// times as wide as the radius.
fn level(radius: f32) -> i32 {
    (radius.log2().floor() as i32).clamp(-100, 100) + 2
}

/// Width of the cells of a level, in scene units.
fn width(level: i32) -> f32 {
    f32::exp2(level as f32)
}

impl<T: GridItem> PhotonGrid<T> {
    /// Grid of `photons`. Searches use the search radii `radii` at `time`.
    pub fn new(photons: Vec<T>, radii: &Radii, time: f32) -> Self {
        // Sort photons by bucket, with a counting sort
        let cell = |photon: &T| Cell::of(photon.place(), level(radii.at(photon.place(), time)));
        let cells: Vec<Cell> = photons.iter().map(cell).collect();
        let buckets = photons.len().next_power_of_two();
        let bucket = |cell: &Cell| cell.hash() as usize & (buckets - 1);
        let mut starts = vec![0; buckets + 1];
        for cell in &cells {
            starts[bucket(cell) + 1] += 1;
        }
        for i in 0..buckets {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut order = vec![0; cells.len()];
        for (i, cell) in cells.iter().enumerate() {
            let place = &mut next[bucket(cell)];
            order[*place as usize] = i;
            *place += 1;
        }
        Self {
            photons: order.iter().map(|&i| photons[i]).collect(),
            cells: order.iter().map(|&i| cells[i]).collect(),
            starts,
            slope: radii.slope(),
        }
    }

    /// Number of items in the grid.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// Returns `true` if the grid has no items.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Calls `found` with each photon within the distance `radius` of `p`. `radius` must be the
    /// search radius at `p`.
    pub fn each_within(&self, p: Vec3, radius: f32, mut found: impl FnMut(&T)) {
        // Find the levels of photons within the radius. The levels depend on the search radii at
        // the photons
        let change = self.slope * radius * (1.0 + gamma(64)) + radius * gamma(64);
        let levels = level(radius - change)..=level(radius + change);
        // Make the reach larger than `radius` by more than rounding errors
        let reach = radius * (1.0 + gamma(8)) + gamma(8) * p.abs().max_element();
        for level in levels {
            let (first, last) = (Cell::of(p - reach, level).place, Cell::of(p + reach, level).place);
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        let cell = Cell {
                            level,
                            place: [x, y, z],
                        };
                        self.each_in(cell, |photon| {
                            if photon.place().distance_squared(p) <= radius * radius {
                                found(photon);
                            }
                        });
                    }
                }
            }
        }
    }

    /// Calls `found` with each photon in `cell`. The bucket of the cell may also contain photons of
    /// other cells.
    fn each_in(&self, cell: Cell, mut found: impl FnMut(&T)) {
        let bucket = cell.hash() as usize & (self.starts.len() - 2);
        let bounds = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
        for (photon, at) in self.photons[bounds.clone()].iter().zip(&self.cells[bounds]) {
            if *at == cell {
                found(photon);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, CameraParameters};
    use crate::color::Spectrum;
    use crate::integrator::SearchRadius;
    use crate::light::LightId;
    use crate::math::{Ball, UVec2};
    use crate::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};

    /// The grid finds the same photons as a linear search, and each photon once. Tests radii in
    /// pixels, far and near, steep and flat, fixed radii, positions far from the origin, and many
    /// photons at one position.
    #[test]
    fn grid_finds_same_photons_as_linear_search() {
        let mut sampler = Independent::new(1);
        let mut at = |i: u32| {
            sampler.start(SampleKey::new(i, 0, 0));
            let xy = sampler.get_2d(Dimension::bounce(0, Bounce::Direction));
            let zs = sampler.get_2d(Dimension::bounce(1, Bounce::Direction));
            // Positions at different distances from the camera, from 10⁻³ on
            let scale = (zs.y * 9.0 - 7.0).exp();
            scale * (Vec3::new(xy.x, xy.y, zs.x) - 0.5)
        };
        let places: Vec<Vec3> = (0..3000).map(&mut at).collect();
        let mut all = 0;
        for (offset, side, radius, factor) in [
            (0.0, 512, SearchRadius::Pixels(3.0), 1.0),
            (0.0, 512, SearchRadius::Pixels(30.0), 0.5),
            (0.0, 2, SearchRadius::Pixels(3.0), 1.0),
            (0.0, 64, SearchRadius::Fixed(0.3), 1.0),
            (0.0, 64, SearchRadius::Fixed(1e-30), 1.0),
            (0.0, 64, SearchRadius::Fixed(f32::MAX), 1.0),
            (1e4, 128, SearchRadius::Pixels(8.0), 1.0),
            (1e4, 128, SearchRadius::Fixed(0.01), 1.0),
        ] {
            let offset = Vec3::splat(offset);
            let camera = CameraParameters {
                position: offset,
                look_at: offset + Vec3::Z,
                up: Vec3::Y,
                vertical_fov: 60.0,
                lens_radius: 0.0,
                focus_distance: 1.0,
            };
            let camera = Camera::new(camera, UVec2::splat(side)).unwrap();
            let ball = Ball {
                center: offset,
                radius: 10.0,
            };
            let radii = Radii::new(radius, factor, &camera, &ball);
            let photon = |p: &Vec3| Photon::new(LightId(0), offset + *p, Vec3::Z, Vec3::Z, Spectrum::ONE);
            let mut photons: Vec<Photon> = places.iter().map(photon).collect();
            photons.extend([photons[7]; 20]);
            let grid = PhotonGrid::new(photons.clone(), &radii, 0.0);
            assert_eq!(grid.len(), photons.len());
            let key = |photon: &Photon| photon.p().to_array().map(f32::to_bits);
            for p in places.iter().step_by(7).map(|p| offset + *p * 1.01) {
                let r = radii.at(p, 0.0);
                let near = |photon: &&Photon| photon.p().distance_squared(p) <= r * r;
                let mut expected: Vec<_> = photons.iter().filter(near).map(key).collect();
                let mut found = Vec::new();
                grid.each_within(p, r, |photon| found.push(key(photon)));
                expected.sort_unstable();
                found.sort_unstable();
                assert_eq!(found, expected, "{radius:?} at {p}");
                all += found.len();
            }
        }
        assert!(all > 10_000, "{all}");
    }

    #[test]
    fn an_empty_grid_finds_nothing() {
        let camera = CameraParameters {
            position: Vec3::ZERO,
            look_at: Vec3::Z,
            up: Vec3::Y,
            vertical_fov: 60.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
        };
        let camera = Camera::new(camera, UVec2::ONE).unwrap();
        let ball = Ball {
            center: Vec3::ZERO,
            radius: 1.0,
        };
        let grid = PhotonGrid::new(
            Vec::<Photon>::new(),
            &Radii::new(SearchRadius::Fixed(1.0), 1.0, &camera, &ball),
            0.0,
        );
        assert!(grid.is_empty());
        grid.each_within(Vec3::ZERO, 1.0, |_| panic!("an empty grid found a photon"));
    }
}
