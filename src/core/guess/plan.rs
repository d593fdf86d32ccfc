//! The plan of an interior: the scene below a horizontal cut, seen from above.

use super::floors::Floors;
use super::scale::Scale;
use super::scene_tracer::SceneTracer;
use super::triangles::for_each_triangle;
use crate::film::RgbImage;
use crate::light::Light;
use crate::math::{Bounds3, Horizon, Vec2, Vec3};
use rayon::prelude::*;

/// Height of the cut above the floor, in metres.
const CUT: f32 = 1.2;
/// Margin around the plan, as a fraction of its larger extent.
const MARGIN: f32 = 0.04;
/// Maximum number of triangles whose section is drawn.
const MAX_TRIANGLES: u64 = 1 << 23;
/// Linear colour of places without a floor.
const EMPTY: [f32; 3] = [0.75, 0.77, 0.8];
/// Linear colour of the inside of cut bodies.
const BODY: [f32; 3] = [0.035, 0.035, 0.04];
/// Linear colour of the lines in which the cut intersects surfaces.
const SECTION: [f32; 3] = [0.0, 0.0, 0.0];
/// Brightness of a surface at the height of the floor; it rises to 1 at the cut.
const LOWEST: f32 = 0.65;
/// Linear colour of openings to the outside.
const OPENING: [f32; 3] = [0.05, 0.35, 0.9];
/// Half width in pixels of the marks of openings.
const OPENING_WIDTH: i32 = 2;
/// Minimum depth of a room behind an opening, as a multiple of the height of the cut. Places below
/// eaves are less deep.
const ROOM_DEPTH: f32 = 1.0;
/// Linear colour of the sun and of its arrow.
const SUN: [f32; 3] = [1.0, 0.6, 0.0];
/// Radius of the sun's disk, length of its arrow, and length of the arrow's head, in pixels.
const SUN_SIZE: [f32; 3] = [9.0, 44.0, 10.0];
/// Reflectance of textured surfaces.
const TEXTURED: [f32; 3] = [0.45, 0.42, 0.38];

/// A plan with positions of cameras.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The image, linear; azimuth 0 is at the bottom, azimuth 90° on the right.
    pub image: RgbImage,
    /// Cameras, in the given order.
    pub cameras: Vec<PlanCamera>,
    /// True if the image has marks of openings.
    pub has_openings: bool,
    /// True if the image has an arrow along the light of the sun.
    pub has_sun: bool,
    /// Top left, top right and bottom left corners, in the scene.
    pub corners: [Vec3; 3],
}

/// A camera on a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanCamera {
    /// Position in pixels from the top left corner.
    pub at: Vec2,
    /// View direction: a vector of length at most 1, shorter if the camera looks up or down.
    pub direction: Vec2,
}

/// Plane of the cut, in the frame of the horizon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    floor: f32,
    height: f32,
}

impl Cut {
    /// The cut above a floor.
    pub fn above(floor: f32, scale: &Scale) -> Self {
        Self {
            floor,
            height: scale.length(CUT),
        }
    }

    fn y(&self) -> f32 {
        self.floor + self.height
    }
}

/// The part of the scene that a plan shows, and its pixels.
struct Sheet {
    /// Position of the left and the top edge, scene units.
    corner: Vec2,
    /// Length of a pixel's edge, scene units.
    pixel: f32,
    width: usize,
    height: usize,
}

impl Sheet {
    /// A sheet that shows the box `bounds`, `size` pixels along its larger edge.
    fn of(bounds: &Bounds3, size: usize) -> Self {
        let [min, max] = [bounds.min, bounds.max].map(|p| Vec2::new(p.x, p.z));
        let margin = MARGIN * (max - min).max_element().max(f32::MIN_POSITIVE);
        let extent = max - min + Vec2::splat(2.0 * margin);
        let pixel = extent.max_element() / size.max(1) as f32;
        let count = |x: f32| ((x / pixel).ceil() as usize).clamp(1, size.max(1));
        Self {
            corner: min - Vec2::splat(margin),
            pixel,
            width: count(extent.x),
            height: count(extent.y),
        }
    }

    /// Pixel position of a point of the scene.
    fn at(&self, p: Vec3) -> Vec2 {
        (Vec2::new(p.x, p.z) - self.corner) / self.pixel
    }

    /// The point in the middle of pixel `i`, at the height `y`.
    fn point(&self, i: usize, y: f32) -> Vec3 {
        let (column, row) = ((i % self.width) as f32, (i / self.width) as f32);
        let p = self.corner + self.pixel * Vec2::new(column + 0.5, row + 0.5);
        Vec3::new(p.x, y, p.y)
    }
}

/// Draws the plan of the region of `floors` at `cut`, `size` pixels along its larger edge.
/// `cameras` are positions and targets.
pub(super) fn plan(floors: &Floors, cut: Cut, cameras: &[(Vec3, Vec3)], size: usize) -> Plan {
    let (tracer, horizon) = (floors.tracer, floors.horizon);
    let mut bounds = floors.bounds();
    let cameras: Vec<[Vec3; 2]> = cameras
        .iter()
        .map(|&(position, target)| [position, target].map(|p| horizon.coordinates(p)))
        .collect();
    cameras.iter().for_each(|&[position, _]| bounds.extend(position));
    let sheet = Sheet::of(&bounds, size);
    let shade = |i: usize| shade(tracer, horizon, cut, sheet.point(i, cut.y()));
    let mut image = RgbImage {
        width: sheet.width,
        height: sheet.height,
        pixels: (0..sheet.width * sheet.height).into_par_iter().map(shade).collect(),
    };
    for_each_triangle(tracer.scene, MAX_TRIANGLES, |triangle| {
        let corners = triangle.corners.map(|p| horizon.coordinates(p));
        if let Some([a, b]) = section(corners, cut.y()) {
            draw_line(&mut image, sheet.at(a), sheet.at(b), SECTION);
        }
    });
    let openings = openings(tracer, horizon, cut, &sheet);
    openings.iter().for_each(|&i| draw_opening(&mut image, i));
    let sun = direction_of_sun(tracer, horizon);
    sun.into_iter().for_each(|way| draw_sun(&mut image, way));
    let cameras = cameras.iter().map(|&[position, target]| {
        let way = (target - position).normalize_or_zero();
        PlanCamera {
            at: sheet.at(position),
            direction: Vec2::new(way.x, way.z),
        }
    });
    let far = sheet.corner + sheet.pixel * Vec2::new(sheet.width as f32, sheet.height as f32);
    let corners = [
        sheet.corner,
        Vec2::new(far.x, sheet.corner.y),
        Vec2::new(sheet.corner.x, far.y),
    ];
    Plan {
        cameras: cameras.collect(),
        has_openings: !openings.is_empty(),
        has_sun: sun.is_some(),
        image,
        corners: corners.map(|p| horizon.point(Vec3::new(p.x, cut.y(), p.y))),
    }
}

/// Colour of the surface below the point `p` of the cut.
fn shade(tracer: &SceneTracer, horizon: &Horizon, cut: Cut, p: Vec3) -> [f32; 3] {
    let Some(seen) = tracer.trace(horizon.point(p), -horizon.up()) else {
        return EMPTY;
    };
    if !seen.is_front {
        return BODY;
    }
    let material = tracer.material(&seen);
    let color = match material.maps.diffuse {
        Some(_) => TEXTURED,
        None => material.diffuse.to_array().map(|v| v.clamp(0.05, 0.9)),
    };
    let height = 1.0 - (seen.distance / cut.height).clamp(0.0, 1.0);
    let facing = 0.4 + 0.6 * seen.normal.dot(horizon.up()).max(0.0);
    color.map(|v| v * facing * (LOWEST + (1.0 - LOWEST) * height))
}

/// The line in which a triangle intersects the plane at height `y`.
fn section(corners: [Vec3; 3], y: f32) -> Option<[Vec3; 2]> {
    let crossing = |a: Vec3, b: Vec3| ((a.y > y) != (b.y > y)).then(|| a.lerp(b, (y - a.y) / (b.y - a.y)));
    let [a, b, c] = corners;
    let mut points = [crossing(a, b), crossing(b, c), crossing(c, a)].into_iter().flatten();
    Some([points.next()?, points.next()?])
}

/// Pixels in which a room ends at an opening to the outside, at the height of `cut`: the pixel is
/// below a ceiling and a neighbour is not, no opaque surface is on the horizontal ray from the
/// pixel over this neighbour, and the room behind is deep.
fn openings(tracer: &SceneTracer, horizon: &Horizon, cut: Cut, sheet: &Sheet) -> Vec<usize> {
    let point = |i: usize| horizon.point(sheet.point(i, cut.y()));
    let is_below_ceiling = |i: usize| tracer.trace(point(i), horizon.up()).is_some_and(|seen| seen.is_front);
    let count = sheet.width * sheet.height;
    let covered: Vec<bool> = (0..count).into_par_iter().map(is_below_ceiling).collect();
    let is_opening = |i: &usize| {
        let (column, row) = (i % sheet.width, i / sheet.width);
        let neighbours = [
            (column > 0).then(|| i - 1),
            (column + 1 < sheet.width).then_some(i + 1),
            (row > 0).then(|| i - sheet.width),
            (row + 1 < sheet.height).then_some(i + sheet.width),
        ];
        let leads_outside = |neighbour: usize| {
            let (from, way) = (point(*i), (point(neighbour) - point(*i)).normalize_or_zero());
            let depth = tracer.trace(from, -way).map_or(0.0, |wall| wall.distance);
            depth > ROOM_DEPTH * cut.height && tracer.escapes(from, way)
        };
        let outside = |neighbour: &usize| !covered[*neighbour];
        covered[*i] && neighbours.into_iter().flatten().filter(outside).any(leads_outside)
    };
    (0..count).into_par_iter().filter(is_opening).collect()
}

/// Horizontal direction of the light of the only sun, in the frame of the horizon; `None` without a
/// sun, or with several.
fn direction_of_sun(tracer: &SceneTracer, horizon: &Horizon) -> Option<Vec2> {
    let mut suns = tracer.scene.lights().iter().filter_map(|light| match light {
        Light::Sun(sun) => Some(horizon.coordinates(sun.direction())),
        _ => None,
    });
    let way = suns.next().filter(|_| suns.next().is_none())?;
    Vec2::new(way.x, way.z).try_normalize()
}

/// Marks pixel `i` and the pixels around it.
fn draw_opening(image: &mut RgbImage, i: usize) {
    let (column, row) = ((i % image.width) as i32, (i / image.width) as i32);
    for y in row - OPENING_WIDTH..=row + OPENING_WIDTH {
        for x in column - OPENING_WIDTH..=column + OPENING_WIDTH {
            draw_point(image, Vec2::new(x as f32, y as f32), OPENING);
        }
    }
}

/// Draws a disk near the edge from which the light of the sun comes, and an arrow along `way`, the
/// direction of the light.
fn draw_sun(image: &mut RgbImage, way: Vec2) {
    let [radius, length, head] = SUN_SIZE;
    let middle = 0.5 * Vec2::new(image.width as f32, image.height as f32);
    // Distance from the middle to the edge of the image, along the direction to the sun
    let room = middle - Vec2::splat(radius + 3.0);
    let far = (room / way.abs().max(Vec2::splat(1e-6))).min_element().max(0.0);
    let (sun, across) = (middle - far * way, Vec2::new(-way.y, way.x));
    let tip = sun + length * way;
    for shift in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let shift = shift * across;
        draw_line(image, sun + shift, tip + shift, SUN);
        for side in [-0.6, 0.6] {
            draw_line(image, tip + shift, tip + shift - head * (way + side * across), SUN);
        }
    }
    let reach = radius as i32;
    for y in -reach..=reach {
        for x in -reach..=reach {
            let p = Vec2::new(x as f32, y as f32);
            if p.length() <= radius {
                draw_point(image, sun + p, SUN);
            }
        }
    }
}

/// Draws a line as points at most half a pixel apart.
fn draw_line(image: &mut RgbImage, a: Vec2, b: Vec2, color: [f32; 3]) {
    let size = Vec2::new(image.width as f32, image.height as f32);
    let steps = (2.0 * a.distance(b)).ceil().clamp(1.0, 4.0 * size.max_element());
    for i in 0..=steps as u32 {
        draw_point(image, a.lerp(b, i as f32 / steps), color);
    }
}

/// Colours the pixel at `p`, if it is in the image.
fn draw_point(image: &mut RgbImage, p: Vec2, color: [f32; 3]) {
    let size = Vec2::new(image.width as f32, image.height as f32);
    if p.cmpge(Vec2::ZERO).all() && p.cmplt(size).all() {
        image.pixels[p.y as usize * image.width + p.x as usize] = color;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_cut_at_a_height() {
        let [a, b, c] = [Vec3::ZERO, Vec3::new(2.0, 2.0, 0.0), Vec3::new(0.0, 2.0, 4.0)];
        let [p, q] = section([a, b, c], 1.0).unwrap();
        assert_eq!([p, q], [Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.0, 1.0, 2.0)]);
        assert!(section([a, b, c], 3.0).is_none());
        // A triangle in the plane of the cut has no line; its neighbours have the line.
        assert!(section([Vec3::Y, Vec3::X + Vec3::Y, Vec3::Y + Vec3::Z], 1.0).is_none());
    }

    #[test]
    fn lines_end_at_the_edge() {
        let mut image = RgbImage {
            width: 4,
            height: 3,
            pixels: vec![EMPTY; 12],
        };
        draw_line(&mut image, Vec2::new(1.5, -10.0), Vec2::new(1.5, 10.0), SECTION);
        let dark: Vec<usize> = (0..12).filter(|&i| image.pixels[i] == SECTION).collect();
        assert_eq!(dark, [1, 5, 9]);
    }

    /// Light that travels to the right comes from the left edge, and the arrow points to the right.
    #[test]
    fn sun_is_at_the_edge_from_which_its_light_comes() {
        let mut image = RgbImage {
            width: 200,
            height: 100,
            pixels: vec![EMPTY; 200 * 100],
        };
        draw_sun(&mut image, Vec2::X);
        let colored = |x: usize| (0..100).filter(|y| image.pixels[y * 200 + x] == SUN).count();
        assert!((17..=19).contains(&colored(12)), "{}", colored(12));
        assert!(colored(40) == 3 && colored(48) > 6 && colored(60) == 0);
        assert_eq!((0..200).rev().find(|&x| colored(x) > 0), Some(56));
    }
}
