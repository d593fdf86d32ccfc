//! The view of an object: which of its sides is its front, and from where around it shows most.

use super::facing::{facing, is_long_body};
use super::file_axes::FileAxes;
use super::framing::Frame;
use super::interior::upright_bounds;
use super::look::{Looker, Seen, Tally};
use super::named_sides::named_front;
use super::open_house;
use super::surfaces;
use crate::camera::{Camera, CameraParameters};
use crate::math::{Horizon, UVec2, Vec2, Vec3};
use rayon::prelude::*;

/// Rays along a side of the square through which candidates are compared.
const RAYS: u32 = 64;
/// Share of the square's width or height that the object fills in a candidate.
const FILL: f32 = 0.8;
/// Triangles that candidates are framed by.
const FEW: u64 = 1 << 15;
/// Azimuths from the front, and elevations, of candidates; the first is taken where all show as much.
const TURNS: [f32; 6] = [30.0, -30.0, 40.0, -40.0, 20.0, -20.0];
const ELEVATIONS: [f32; 2] = [18.0, 25.0];
/// Lengths of an object towards its front, over its width, between which it is turned further, and
/// by how much at the second: cars show their sides, and a rifle is not seen into its muzzle.
/// Objects that are higher than long, such as people, are not turned.
const LONG: [f32; 2] = [1.5, 2.5];
const LONG_TURN: f32 = 30.0;
/// Height of an object over its width up to which it is flat, and the elevation of its candidates.
const FLAT: f32 = 0.1;
const FLAT_ELEVATION: [f32; 1] = [40.0];
/// Width of an object over its depth up to which a side is the edge of a plate, and its minimum
/// height: phones, screens and pictures are not seen from there.
const EDGE: f32 = 0.25;
const PLATE: f32 = 0.5;
/// Share of its distance by which the depth of a surface changes at a step.
const STEP: f32 = 0.03;
/// Bits by which another candidate must show more to be preferred to one before it, so that roundings do not decide.
const MARGIN: f32 = 0.02;
/// Doublings of detail that azimuth 0 counts more than other sides: many models face it.
const USUAL_FRONT: f32 = 1.2;
/// Doublings of detail that a side counts more whose left and right are mirror images: faces, animals, vehicles and furniture are made so.
const SYMMETRY: f32 = 0.6;

/// Doublings of detail that the usual front of the program which wrote the file counts more, in
/// place of azimuth 0.
const FRONT_OF_PROGRAM: f32 = 2.5;
/// Doublings of detail that a side counts more if shapes tell that it is the front.
const FACING: f32 = 4.0;
/// Doublings of detail that the long sides of a vehicle or an animal count less.
const LONG_SIDE: f32 = 3.0;
/// Doublings of detail by which the front must be ahead of all other sides to be no guess, if
/// azimuth 0 counts no more than they do.
const CLEAR: f32 = 1.0;

/// The side of an object that is its front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Front {
    /// Degrees: 0, 90, 180 or 270.
    pub azimuth: f32,
    /// True if the file declares it.
    pub is_declared: bool,
    /// True if detail, shapes or the program tell it, and not the habit of most files alone.
    pub is_clear: bool,
}

impl Front {
    /// The side that the file declares, or else the one with the most detail and materials: faces
    /// have eyes and noses, backs are smooth. Seats, feet, azimuth 0 and symmetry count for
    /// something, and edges of plates are no fronts.
    pub fn of(looker: &Looker, horizon: &Horizon, frame: &Frame, axes: &FileAxes) -> Self {
        let toward = |side: Vec3| {
            let azimuth = horizon.azimuth(side)?;
            Some((azimuth / 90.0).round().rem_euclid(4.0) * 90.0)
        };
        let declared = axes.declared.and_then(|axes| toward(axes.front));
        if let Some(azimuth) = declared {
            return Self {
                azimuth,
                is_declared: true,
                is_clear: true,
            };
        }
        let of_program = axes.usual_front.and_then(toward);
        let points = surfaces::points(looker);
        let named = named_front(looker, &points, horizon).and_then(toward);
        let told = facing(&points, upright_bounds(looker.region.bounds, horizon), horizon);
        let is_long = is_long_body(&points, upright_bounds(looker.region.bounds, horizon), horizon);
        let azimuths = [0.0, 180.0, 90.0, 270.0];
        let evidence: Vec<f32> = azimuths
            .par_iter()
            .map(|&azimuth| {
                let side = Side::new(looker, horizon, azimuth);
                if side.width <= EDGE * side.depth && side.height >= PLATE * side.depth {
                    return f32::NEG_INFINITY;
                }
                let picture = Picture::take(looker, horizon, frame, horizon.direction(azimuth, 5.0));
                let mut evidence = picture.detail().log2() + picture.materials() + SYMMETRY * picture.symmetry();
                evidence += if told == Some(azimuth) { FACING } else { 0.0 };
                evidence += if named == Some(azimuth) { FACING } else { 0.0 };
                evidence -= if is_long && side.is_long() { LONG_SIDE } else { 0.0 };
                evidence
                    + if of_program == Some(azimuth) {
                        FRONT_OF_PROGRAM
                    } else {
                        0.0
                    }
            })
            .collect();
        let usual = |azimuth: f32| {
            if azimuth == 0.0 && of_program.is_none() {
                USUAL_FRONT
            } else {
                0.0
            }
        };
        let scores: Vec<f32> = evidence
            .iter()
            .zip(azimuths)
            .map(|(evidence, azimuth)| evidence + usual(azimuth))
            .collect();
        let best = first_best(&scores);
        let others = (0..azimuths.len()).filter(|&i| i != best).map(|i| evidence[i]);
        Self {
            azimuth: azimuths[best],
            is_declared: false,
            is_clear: evidence[best] - others.fold(f32::NEG_INFINITY, f32::max) >= CLEAR,
        }
    }
}

/// Size of an object as it is seen from one side.
struct Side {
    width: f32,
    height: f32,
    depth: f32,
}

impl Side {
    /// Returns true if the object is wider than deep from here.
    fn is_long(&self) -> bool {
        self.width > self.depth
    }

    fn new(looker: &Looker, horizon: &Horizon, azimuth: f32) -> Self {
        let bounds = upright_bounds(looker.region.bounds, horizon);
        let size = bounds.max - bounds.min;
        let depth = size.dot(horizon.coordinates(horizon.direction(azimuth, 0.0)).abs());
        Self {
            width: size.x + size.z - depth,
            height: size.y,
            depth,
        }
    }
}

/// Azimuth and elevation, in degrees, of the three-quarter view that shows most of an object whose front is at `front`.
pub(super) fn three_quarter(looker: &Looker, horizon: &Horizon, frame: &Frame, front: f32) -> (f32, f32) {
    if let Some(azimuth) = open_house::azimuth(looker, horizon, front) {
        return (azimuth, open_house::ELEVATION);
    }
    let side = Side::new(looker, horizon, front);
    let elevations: &[f32] = match side.height <= FLAT * side.width.max(side.depth) {
        true => &FLAT_ELEVATION,
        false => &ELEVATIONS,
    };
    let [from, to] = LONG.map(|ratio| ratio * side.width);
    let share = (side.depth - from) / (to - from).max(f32::MIN_POSITIVE);
    let more = match side.depth >= side.height {
        true => (LONG_TURN * share.clamp(0.0, 1.0)).round(),
        false => 0.0,
    };
    let candidates: Vec<(f32, f32)> = elevations
        .iter()
        .flat_map(|&elevation| TURNS.map(|turn: f32| (front + turn + more * turn.signum(), elevation)))
        .collect();
    let scores: Vec<f32> = candidates
        .par_iter()
        .map(|&(azimuth, elevation)| {
            Picture::take(looker, horizon, frame, horizon.direction(azimuth, elevation)).information()
        })
        .collect();
    candidates[first_best(&scores)]
}

/// The first of the largest scores, up to [`MARGIN`].
fn first_best(scores: &[f32]) -> usize {
    let best = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    scores.iter().position(|&score| score >= best - MARGIN).unwrap_or(0)
}

/// Surfaces that the rays of a coarse picture meet, row by row.
struct Picture(Vec<Option<Seen>>);

impl Picture {
    fn take(looker: &Looker, horizon: &Horizon, frame: &Frame, back: Vec3) -> Self {
        let square = Frame {
            aspect: 1.0,
            fill: FILL,
            ..*frame
        };
        let (position, look_at) = square.place(looker, FEW, horizon, back);
        let parameters = CameraParameters {
            position,
            look_at,
            up: horizon.image_up(back),
            vertical_fov: frame.fov,
            lens_radius: 0.0,
            focus_distance: 1.0,
        };
        // A camera that cannot be sees nothing.
        let Ok(camera) = Camera::new(parameters, UVec2::splat(RAYS)) else {
            return Self(Vec::new());
        };
        let pixel = |i: u32| Vec2::new((i % RAYS) as f32 + 0.5, (i / RAYS) as f32 + 0.5);
        let seen = (0..RAYS * RAYS).map(|i| {
            let ray = camera.ray(pixel(i), Vec2::splat(0.5), 0.0);
            looker.look(ray.origin, ray.direction)
        });
        Self(seen.collect())
    }

    /// Information in the view, in bits: of shapes, of materials, and of detail, for which modellers cut surfaces more finely.
    fn information(&self) -> f32 {
        let [normals, materials, triangles] = self.tally().entropies();
        normals + materials + 0.5 * triangles
    }

    /// Curvature of the surfaces: the sum over neighbouring pixels of `1 − cos` of the angle between their normals, without steps in depth, which are
    /// outlines; at least 1.
    fn detail(&self) -> f32 {
        let n = RAYS as usize;
        let at = |x: usize, y: usize| self.0.get(y * n + x).copied().flatten();
        let mut sum = 1.0;
        for (y, x) in (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| (y, x))) {
            let Some(a) = at(x, y) else { continue };
            for b in [at(x + 1, y), at(x, y + 1)].into_iter().flatten() {
                if (a.distance - b.distance).abs() < STEP * a.distance {
                    sum += 1.0 - a.normal.dot(b.normal);
                }
            }
        }
        sum
    }

    /// Entropy of the materials, in bits.
    fn materials(&self) -> f32 {
        self.tally().entropies()[1]
    }

    fn tally(&self) -> Tally {
        let mut tally = Tally::default();
        self.0.iter().for_each(|seen| tally.add(seen.as_ref()));
        tally
    }

    /// How alike its left and its right half are, from 0 to 1: mirrored pixels that both see nothing, or surfaces that face mirrored ways.
    fn symmetry(&self) -> f32 {
        let rows = self.0.chunks_exact(RAYS as usize);
        let (mut alike, mut all) = (0.0, 0.0);
        for row in rows {
            for (a, b) in row.iter().zip(row.iter().rev()).take(RAYS as usize / 2) {
                match (a, b) {
                    (None, None) => {}
                    (Some(a), Some(b)) => {
                        all += 1.0;
                        alike += f32::from(u8::from((a.distance - b.distance).abs() < STEP * a.distance));
                    }
                    _ => all += 1.0,
                }
            }
        }
        // Most pixels agree in any compact shape.
        if all > 0.0 {
            ((alike / all - 0.5) * 2.0_f32).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}
