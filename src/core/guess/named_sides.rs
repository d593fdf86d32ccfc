//! The front of an object from the names of its materials and parts: eyes, teeth and headlights are
//! at the front, tails and tail lamps at the back.

use super::scene_tracer::SceneTracer;
use super::surfaces::{Point, levels_of_names, side_of};
use super::triangles::for_each_triangle;
use crate::geometry::UNNAMED;
use crate::math::{Horizon, Vec3};

/// Maximum number of triangles that are used, evenly spread over the scene's triangles.
const MAX_TRIANGLES: u64 = 1 << 20;
/// Words in names of things at the front.
const FRONT: [&str; 33] = [
    "beak",
    "button",
    "cornea",
    "dial",
    "display",
    "eye",
    "eyeball",
    "eyebrow",
    "eyelash",
    "eyelid",
    "face",
    "front",
    "grill",
    "grille",
    "headlamp",
    "headlight",
    "iris",
    "keyboard",
    "keypad",
    "knob",
    "lip",
    "mouth",
    "muzzle",
    "nose",
    "pupil",
    "sclera",
    "screen",
    "snout",
    "teeth",
    "tongue",
    "tooth",
    "windscreen",
    "windshield",
];
/// Words in names of things at the back.
const BACK: [&str; 9] = [
    "backlight",
    "backpack",
    "brakelight",
    "exhaust",
    "rear",
    "rearlight",
    "tail",
    "taillamp",
    "taillight",
];
/// Margin of the band of heights in which named parts and the object are compared, as a fraction of
/// the object's height.
const BAND: f32 = 0.02;
/// Minimum number of points in the band.
const MIN_POINTS: usize = 40;
/// Minimum distance of the named parts from the middle of the band, as a fraction of the band's
/// extent.
const OFF_MIDDLE: f32 = 0.12;
/// The vector to the named parts has two horizontal coordinates. The larger must be at least this
/// multiple of the smaller, because a vector to a corner shows no front.
const STRAIGHT: f32 = 2.0;

/// Direction of the front by names, of any length; `None` if names do not show it. `points` are
/// spread over the surfaces.
pub(super) fn named_front(tracer: &SceneTracer, points: &[Point], horizon: &Horizon) -> Option<Vec3> {
    let scene = tracer.scene;
    let materials: Vec<Option<bool>> = scene.materials().iter().map(|m| is_front(&m.name)).collect();
    let names = scene.part_names();
    let parts: Vec<u32> = std::iter::once(UNNAMED).chain(names.parts()).collect();
    let parts = levels_of_names(names, &parts, is_front);
    if materials.iter().chain(&parts).all(Option::is_none) {
        return None;
    }
    let (mut front, mut back) = (SideSums::default(), SideSums::default());
    for_each_triangle(scene, MAX_TRIANGLES, |triangle| {
        let of = |sides: &[Option<bool>], i: u32| sides.get(i as usize).copied().flatten();
        let side = of(&materials, triangle.material).or(of(&parts, triangle.part));
        let corners = triangle.corners.map(|p| horizon.coordinates(p));
        match side {
            Some(true) => front.add(corners, triangle.area as f32),
            Some(false) => back.add(corners, triangle.area as f32),
            None => {}
        }
    });
    let points: Vec<Vec3> = points.iter().map(|point| horizon.coordinates(point.p)).collect();
    let of_front = front.offset(&points);
    let offset = of_front.or(back.offset(&points).map(|offset| -offset))?;
    Some(horizon.point(offset))
}

/// Sums over the triangles whose names belong to one side, in the frame of the horizon.
struct SideSums {
    /// Sum of the triangles' centroids, weighted by area, and total area.
    sum: Vec3,
    area: f32,
    /// Lowest and highest corner.
    heights: [f32; 2],
}

impl Default for SideSums {
    fn default() -> Self {
        Self {
            sum: Vec3::ZERO,
            area: 0.0,
            heights: [f32::INFINITY, f32::NEG_INFINITY],
        }
    }
}

impl SideSums {
    fn add(&mut self, corners: [Vec3; 3], area: f32) {
        self.sum += area / 3.0 * corners.into_iter().sum::<Vec3>();
        self.area += area;
        for p in corners {
            self.heights = [self.heights[0].min(p.y), self.heights[1].max(p.y)];
        }
    }

    /// Horizontal vector to the named parts, from the middle of the object at their height; `None`
    /// if the vector is short or points to a corner.
    fn offset(&self, points: &[Vec3]) -> Option<Vec3> {
        let middle = self.sum / self.area;
        let ends = |values: &mut dyn Iterator<Item = f32>| {
            values.fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), x| {
                (min.min(x), max.max(x))
            })
        };
        let (bottom, top) = ends(&mut points.iter().map(|p| p.y));
        let margin = BAND * (top - bottom);
        let is_in = |p: &&Vec3| p.y >= self.heights[0] - margin && p.y <= self.heights[1] + margin;
        let band: Vec<Vec3> = points.iter().filter(is_in).copied().collect();
        if band.len() < MIN_POINTS || !middle.is_finite() {
            return None;
        }
        let [(left, right), (back, front)] = [0, 2].map(|axis: usize| ends(&mut band.iter().map(|p| p[axis])));
        let center = Vec3::new(0.5 * (left + right), middle.y, 0.5 * (back + front));
        let offset = middle - center;
        let [x, z] = [offset.x.abs(), offset.z.abs()];
        let is_far = x > OFF_MIDDLE * (right - left) || z > OFF_MIDDLE * (front - back);
        (is_far && x.max(z) >= STRAIGHT * x.min(z)).then_some(offset)
    }
}

/// Returns `Some(true)` if the name belongs to a thing at the front, `Some(false)` if it belongs to
/// a thing at the back, and `None` otherwise.
fn is_front(name: &str) -> Option<bool> {
    side_of(name, &FRONT, &BACK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_in_names_show_front_or_back() {
        for (name, expected) in [
            ("Eyes", Some(true)),
            ("Head_Teeth.001", Some(true)),
            ("tailLights", Some(false)),
            ("Rear_Wheel", Some(false)),
            ("tv_Screen.001", Some(true)),
            ("headlamps", Some(true)),
            ("brakelights", Some(false)),
            ("teeth and tail", None),
            ("surface", None),
            ("", None),
        ] {
            assert_eq!(is_front(name), expected, "{name}");
        }
    }
}
