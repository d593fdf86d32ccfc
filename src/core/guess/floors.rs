//! Floors of a scene: flat surfaces with room above them.

use super::scene_tracer::SceneTracer;
use crate::math::{Bounds3, Horizon, Vec3};
use rayon::prelude::*;

/// Number of places along each side of the scene's box at which floors are searched.
pub(super) const PLACES: u32 = 16;
/// Maximum number of surfaces above each other at one place.
const MAX_SURFACES: usize = 24;
/// Minimum cosine between up and the normal of a floor.
const FLAT: f32 = 0.9;
/// Minimum cosine between up and the normal of a floor that makes a scene an interior: the bottom
/// of a pipe is steeper.
const LEVEL: f32 = 0.985;
/// Minimum half width of a floor, as a fraction of the room height above it.
const HALF_WIDTH: f32 = 0.12;
/// Minimum height of a room, as a fraction of the scene's larger extent.
const MIN_ROOM: f32 = 0.04;
/// Maximum difference of nearby floor heights, as a fraction of the room height.
const EVEN: f32 = 0.01;

/// A surface on the vertical line through a place, and the free height above the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Height in the frame of the horizon, in scene units.
    pub y: f32,
    /// Absolute cosine between up and the normal.
    pub slope: f32,
    /// Distance to the surface above, or to the top of the scene.
    pub room: f32,
    /// True if there is a surface above.
    pub is_covered: bool,
    /// True if the front of the surface faces up.
    pub is_front: bool,
}

impl Surface {
    /// Returns true if the slope allows standing.
    pub fn is_flat(&self) -> bool {
        self.slope > FLAT
    }
}

/// Surfaces of the scene along vertical lines. Each line goes through a place of the horizontal
/// plane.
pub(super) struct Floors<'a> {
    pub tracer: &'a SceneTracer<'a>,
    pub horizon: &'a Horizon,
    bounds: Bounds3,
}

impl<'a> Floors<'a> {
    pub fn new(tracer: &'a SceneTracer, horizon: &'a Horizon) -> Self {
        Self {
            tracer,
            horizon,
            bounds: upright_bounds(tracer.region.bounds, horizon),
        }
    }

    /// Box of the region, in the frame of the horizon.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    fn size(&self) -> Vec3 {
        self.bounds.max - self.bounds.min
    }

    /// Larger horizontal extent of the scene.
    pub fn width(&self) -> f32 {
        self.size().x.max(self.size().z)
    }

    /// Height of the scene.
    pub fn height(&self) -> f32 {
        self.size().y
    }

    /// Minimum height of a room.
    pub fn min_room(&self) -> f32 {
        MIN_ROOM * self.height().max(self.width())
    }

    /// A grid of places with `count` along each side.
    pub fn places(&self, count: u32) -> Vec<(f32, f32)> {
        let share = |i: u32| (i as f32 + 0.5) / count as f32;
        let (min, size) = (self.bounds.min, self.size());
        let place = |i: u32| (min.x + size.x * share(i % count), min.z + size.z * share(i / count));
        (0..count * count).map(place).collect()
    }

    /// Surfaces on the vertical line through `x` and `z`, from the top down.
    pub fn at(&self, x: f32, z: f32) -> Vec<Surface> {
        let top = self.bounds.max.y;
        let mut surfaces: Vec<Surface> = Vec::new();
        let mut y = top + 0.01 * self.height();
        while surfaces.len() < MAX_SURFACES {
            let origin = self.horizon.point(Vec3::new(x, y, z));
            let Some(seen) = self.tracer.trace(origin, -self.horizon.up()) else {
                break;
            };
            y -= seen.distance;
            let above = surfaces.last().map(|surface| surface.y);
            surfaces.push(Surface {
                y,
                slope: seen.normal.dot(self.horizon.up()).abs(),
                room: above.unwrap_or(top) - y,
                is_covered: above.is_some(),
                is_front: seen.is_front,
            });
            y -= 1e-4 * self.height();
        }
        surfaces
    }

    /// Returns true if there is a flat surface at the place of `p`.
    pub fn at_any(&self, p: Vec3) -> bool {
        self.at(p.x, p.z).iter().any(Surface::is_flat)
    }

    /// Height of the nearest surface below the point `p`; `None` if there is no surface.
    pub fn below(&self, p: Vec3) -> Option<f32> {
        let seen = self.tracer.trace(self.horizon.point(p), -self.horizon.up())?;
        Some(p.y - seen.distance)
    }

    /// Returns true if there is a floor that is wide compared to the room height above it.
    pub fn has_wide_floor(&self) -> bool {
        self.places(PLACES).par_iter().any(|&(x, z)| {
            let surfaces = self.at(x, z);
            let mut surfaces = surfaces.iter();
            surfaces
                .any(|surface| surface.slope > LEVEL && surface.room > self.min_room() && self.is_wide(x, z, surface))
        })
    }

    fn is_wide(&self, x: f32, z: f32, surface: &Surface) -> bool {
        let half = HALF_WIDTH * surface.room;
        let knee = Vec3::new(x, surface.y + 0.25 * surface.room, z);
        [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z].into_iter().all(|side| {
            let wall = self.tracer.trace(self.horizon.point(knee), self.horizon.point(side));
            let floor = self.below(knee + half * side);
            wall.is_none_or(|wall| wall.distance > half)
                && floor.is_some_and(|y| (y - surface.y).abs() < EVEN * surface.room)
        })
    }

    /// Typical height of the rooms: the median, over all places with a ceiling, of the highest room
    /// at the place. `None` if there are no ceilings.
    pub fn room_height(&self) -> Option<f32> {
        let places = self.places(PLACES);
        let highest = |&(x, z): &(f32, f32)| {
            let rooms = self.at(x, z).into_iter();
            let rooms =
                rooms.filter(|surface| surface.is_covered && surface.is_flat() && surface.room > self.min_room());
            rooms.map(|surface| surface.room).max_by(f32::total_cmp)
        };
        let mut heights: Vec<f32> = places.par_iter().filter_map(highest).collect();
        heights.sort_by(f32::total_cmp);
        heights.get(heights.len() / 2).copied()
    }
}

/// Box of the scene in the frame of `horizon`.
pub(super) fn upright_bounds(bounds: Bounds3, horizon: &Horizon) -> Bounds3 {
    let corner = |i: u32| {
        let pick = |bit: u32, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
        Vec3::new(
            pick(0, bounds.min.x, bounds.max.x),
            pick(1, bounds.min.y, bounds.max.y),
            pick(2, bounds.min.z, bounds.max.z),
        )
    };
    (0..8).map(|i| horizon.coordinates(corner(i))).collect()
}
