//! The view of an object: its front, and the azimuth around it with the most information.

use super::facing::{facing, is_long_body};
use super::file_axes::{FileAxes, NamedThing};
use super::framing::Framing;
use super::interior::upright_bounds;
use super::named_sides::named_front;
use super::open_house;
use super::scene_tracer::{HitStatistics, SceneTracer, SurfaceHit};
use super::surfaces;
use crate::camera::{Camera, CameraParameters};
use crate::math::{Horizon, UVec2, Vec2, Vec3};
use rayon::prelude::*;

/// Number of rays along a side of the square image in which candidates are compared.
const RAYS: u32 = 64;
/// Fraction of the square's width or height that the object fills in a candidate.
const FILL: f32 = 0.8;
/// Maximum number of triangles that are used to frame a candidate.
const FEW: u64 = 1 << 15;
/// Azimuths of candidates from the front, in degrees. If all scores are equal, the first candidate
/// is used.
const TURNS: [f32; 6] = [30.0, -30.0, 40.0, -40.0, 20.0, -20.0];
/// Minimum ratio of the width of a plate to its depth. Letters, signs and shelves are plates.
const WIDE: f32 = 3.5;
/// Azimuths and elevations of candidates for a plate: from the side its far end is small, and from
/// the side and from above letters are hard to read.
const TURNS_OF_PLATE: [f32; 4] = [20.0, -20.0, 25.0, -25.0];
const PLATE_ELEVATION: [f32; 1] = [15.0];
/// Elevations of candidates, in degrees.
const ELEVATIONS: [f32; 2] = [18.0, 25.0];
/// Ratios of an object's length, towards its front, to its width. Between the first and the second
/// ratio, the additional turn of the view grows from 0 to [`LONG_TURN`]. Objects that are higher
/// than long, such as people, are not turned further.
const LONG: [f32; 2] = [1.5, 2.5];
/// Maximum additional turn of the view of a long object, in degrees: cars show their sides, and a
/// rifle is not seen into its muzzle.
const LONG_TURN: f32 = 30.0;
/// Maximum ratio of a low object's height to its smaller width, and elevations of its candidates in
/// degrees. Clocks, dishes and hills show their tops, and cars are higher.
const LOW: f32 = 0.35;
const LOW_ELEVATIONS: [f32; 2] = [25.0, 32.0];
/// Maximum ratio of a flat object's height to its width.
const FLAT: f32 = 0.1;
/// Elevation of the candidates for a flat object, in degrees.
const FLAT_ELEVATION: [f32; 1] = [40.0];
/// Elevation of the view of a drawing: a sheet with gaps that is at least as wide as deep, in
/// degrees. It is seen from the azimuth of its front, so that letters on a ground can be read.
const DRAWING_ELEVATION: f32 = 60.0;
/// Maximum ratio of the height of a drawing to its depth: city maps are higher.
const SHEET: f32 = 0.02;
/// Maximum fraction of its outline that a drawing covers. A disk covers 0.79.
const DRAWN: f32 = 0.7;
/// Maximum ratio of width to depth of a plate that is seen at its edge. Phones, screens and
/// pictures are not shown from their edges.
const EDGE: f32 = 0.25;
/// Minimum ratio of height to depth of a plate that is seen at its edge. Guitars and guns that
/// stand on their long edge are such plates.
const PLATE: f32 = 0.3;
/// Minimum change of a surface's depth at a step, as a fraction of its distance.
const STEP: f32 = 0.03;
/// Curvature of a side in relief. If no side has as much, the drawings of textures are part of its
/// detail: guitars, boxes and dolls are smooth, and their textures show the front. On other objects
/// a texture is as lively on the back.
const RELIEF: f32 = 32.0;
/// Score, in bits of information, by which a later candidate must exceed an earlier candidate.
/// Rounding errors are smaller, so they do not decide.
const MARGIN: f32 = 0.02;
/// Bonus of azimuth 0, which is the front of many models. It is added to the binary logarithm of
/// the detail of a side, as are all bonuses.
const USUAL_FRONT: f32 = 1.2;
/// Bonus of a side with left-right symmetry: faces, animals, vehicles and furniture are symmetric.
const SYMMETRY: f32 = 0.6;

/// Bonus of the usual front of the program that wrote the file. It replaces the bonus of azimuth 0.
const FRONT_OF_PROGRAM: f32 = 2.5;
/// Bonus of a side that is the front according to the shapes or the names of the object.
const FACING: f32 = 4.0;
/// Penalty of a side that shows only backs of surfaces: the rear of a stair or of a house front.
const BACKS: f32 = 2.0;
/// Penalty of the long sides of a vehicle or an animal.
const LONG_SIDE: f32 = 3.0;
/// A front is clear if its score exceeds the scores of all other sides by this margin. The first
/// margin is for the side that shapes or names show, and for the usual front of the program, or
/// else azimuth 0. The second is for other sides: twice the detail of all other sides alone is
/// found at a wrong side as often as at the front. The score has the unit of the bonuses, and does
/// not include the bonus of azimuth 0.
const CLEAR: [f32; 2] = [1.0, 2.0];
/// Minimum symmetry of the front of a single thing, if shapes or names show it. Otherwise the scene
/// may have several things that face different sides, and the front is not clear.
const OF_ONE: f32 = 0.15;
/// Bonus of names instead of [`FACING`], if the scene may have several things.
const FACING_OF_SEVERAL: f32 = 0.5;

/// Front side of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Front {
    /// Azimuth in degrees: 0, 90, 180 or 270.
    pub azimuth: f32,
    /// True if the file declares the front.
    pub is_declared: bool,
    /// True if detail, shapes or the program show the front. False if it is only the front of most
    /// files.
    pub is_clear: bool,
}

impl Front {
    /// The front that the file declares, or else the side with the most detail and materials: heads
    /// have eyes and a nose in front, and backs are smooth. Seats, feet, azimuth 0 and symmetry add
    /// to the score of a side. The narrow side of a plate is not the front, unless shapes show that
    /// it is: horses are narrow.
    pub fn of(tracer: &SceneTracer, horizon: &Horizon, frame: &Framing, axes: &FileAxes) -> Self {
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
        let points = surfaces::points(tracer);
        let named = named_front(tracer, &points, horizon).and_then(toward);
        let are_letters = axes.thing == Some(NamedThing::Letters);
        let faced = facing(&points, upright_bounds(tracer.region.bounds, horizon), horizon);
        let faced = faced.filter(|_| !are_letters);
        let is_long = is_long_body(&points, upright_bounds(tracer.region.bounds, horizon), horizon);
        let azimuths = [0.0, 180.0, 90.0, 270.0];
        let back = |azimuth: f32| horizon.direction(azimuth, 5.0);
        let pictures: Vec<Option<Picture>> = azimuths
            .par_iter()
            .map(|&azimuth| {
                let side = Side::new(tracer, horizon, azimuth);
                let is_end = side.is_edge() || are_letters && side.width < side.depth;
                let is_shown = faced == Some(azimuth) || !is_end;
                is_shown.then(|| Picture::take(tracer, horizon, frame, back(azimuth)))
            })
            .collect();
        let is_smooth = pictures.iter().flatten().all(|picture| picture.curvature() < RELIEF);
        let evidence: Vec<f32> = azimuths
            .par_iter()
            .zip(&pictures)
            .map(|(&azimuth, picture)| {
                let Some(picture) = picture else {
                    return f32::NEG_INFINITY;
                };
                let drawings = if is_smooth {
                    picture.drawings(&colors(tracer, horizon, frame, back(azimuth)))
                } else {
                    0.0
                };
                let detail = 1.0 + picture.curvature() + drawings;
                let symmetry = picture.symmetry();
                let mut evidence = detail.log2() + picture.materials() + SYMMETRY * symmetry;
                evidence -= BACKS * (1.0 - picture.tally().front_share());
                evidence += if faced == Some(azimuth) { FACING } else { 0.0 };
                let of_name = if symmetry < OF_ONE { FACING_OF_SEVERAL } else { FACING };
                evidence += if named == Some(azimuth) { of_name } else { 0.0 };
                let is_side = is_long && Side::new(tracer, horizon, azimuth).is_long();
                evidence -= if is_side { LONG_SIDE } else { 0.0 };
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
        let margin = evidence[best] - others.fold(f32::NEG_INFINITY, f32::max);
        let azimuth = azimuths[best];
        let [at_usual, elsewhere] = CLEAR;
        let is_usual = azimuth == of_program.unwrap_or(0.0);
        let is_shape = faced == Some(azimuth) || named == Some(azimuth);
        let is_of_one = pictures[best]
            .as_ref()
            .is_some_and(|picture| picture.symmetry() >= OF_ONE);
        let needed = if is_usual || is_shape { at_usual } else { elsewhere };
        Self {
            azimuth,
            is_declared: false,
            is_clear: margin >= needed && (is_of_one || !is_shape),
        }
    }
}

/// Size of an object as seen from one side, scene units.
struct Side {
    width: f32,
    height: f32,
    depth: f32,
}

impl Side {
    /// Returns true if the object is wider than deep from this side.
    fn is_long(&self) -> bool {
        self.width > self.depth
    }

    /// Returns true if the object is a plate that is seen at its edge from this side.
    fn is_edge(&self) -> bool {
        self.width <= EDGE * self.depth && self.height >= PLATE * self.depth
    }

    fn new(tracer: &SceneTracer, horizon: &Horizon, azimuth: f32) -> Self {
        let bounds = upright_bounds(tracer.region.bounds, horizon);
        let size = bounds.max - bounds.min;
        let depth = size.dot(horizon.coordinates(horizon.direction(azimuth, 0.0)).abs());
        Self {
            width: size.x + size.z - depth,
            height: size.y,
            depth,
        }
    }
}

/// Azimuth and elevation, in degrees, of the three-quarter view with the most information. `front`
/// is the azimuth of the object's front.
pub(super) fn three_quarter(
    tracer: &SceneTracer,
    horizon: &Horizon,
    frame: &Framing,
    front: f32,
    axes: &FileAxes,
) -> (f32, f32) {
    let is_of_rooms = axes.thing == Some(NamedThing::Rooms);
    if let Some(angles) = open_house::angles(tracer, horizon, front, is_of_rooms) {
        return angles;
    }
    let side = Side::new(tracer, horizon, front);
    let is_plate = side.width >= WIDE * side.depth;
    let is_flat = side.height <= FLAT * side.width.max(side.depth);
    let is_sheet = side.height <= SHEET * side.depth && side.width >= side.depth;
    if is_sheet && covered(tracer, horizon) <= DRAWN {
        return (front, DRAWING_ELEVATION);
    }
    let elevations: &[f32] = if is_flat {
        &FLAT_ELEVATION
    } else if side.height <= LOW * side.width.min(side.depth) {
        &LOW_ELEVATIONS
    } else if is_plate {
        &PLATE_ELEVATION
    } else {
        &ELEVATIONS
    };
    let [from, to] = LONG.map(|ratio| ratio * side.width);
    let share = (side.depth - from) / (to - from).max(f32::MIN_POSITIVE);
    let more = if side.depth >= side.height {
        (LONG_TURN * share.clamp(0.0, 1.0)).round()
    } else {
        0.0
    };
    let turns: &[f32] = match axes.thing {
        Some(NamedThing::Letters) if is_plate => &TURNS_OF_PLATE[..2],
        _ if is_plate => &TURNS_OF_PLATE,
        _ => &TURNS,
    };
    let turned = |turn: &f32| front + turn + more * turn.signum();
    let candidates: Vec<(f32, f32)> = elevations
        .iter()
        .flat_map(|&elevation| turns.iter().map(move |turn| (turned(turn), elevation)))
        .collect();
    let scores: Vec<f32> = candidates
        .par_iter()
        .map(|&(azimuth, elevation)| {
            Picture::take(tracer, horizon, frame, horizon.direction(azimuth, elevation)).information()
        })
        .collect();
    candidates[first_best(&scores)]
}

/// Fraction of the rays from above the scene's box straight down that hit a surface.
fn covered(tracer: &SceneTracer, horizon: &Horizon) -> f32 {
    let bounds = upright_bounds(tracer.region.bounds, horizon);
    let size = bounds.max - bounds.min;
    let above = bounds.max.y + size.max_element();
    let share = |i: u32| (i as f32 + 0.5) / RAYS as f32;
    let is_hit = |i: &u32| {
        let (x, z) = (share(i % RAYS) * size.x, share(i / RAYS) * size.z);
        let origin = horizon.point(Vec3::new(bounds.min.x + x, above, bounds.min.z + z));
        tracer.trace(origin, -horizon.up()).is_some()
    };
    (0..RAYS * RAYS).filter(is_hit).count() as f32 / (RAYS * RAYS) as f32
}

/// Index of the first score within [`MARGIN`] of the largest.
fn first_best(scores: &[f32]) -> usize {
    let best = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    scores.iter().position(|&score| score >= best - MARGIN).unwrap_or(0)
}

/// Results of `trace` for the rays of a coarse image, row by row, and for the width of a pixel at
/// the distance 1. Empty if the camera is invalid.
fn coarse_image<T>(
    tracer: &SceneTracer,
    horizon: &Horizon,
    frame: &Framing,
    back: Vec3,
    trace: impl Fn(Vec3, Vec3, f32) -> T,
) -> Vec<T> {
    let square = Framing {
        aspect: 1.0,
        fill: FILL,
        ..*frame
    };
    let (position, look_at) = square.place(tracer, FEW, horizon, back);
    let parameters = CameraParameters {
        position,
        look_at,
        up: horizon.image_up(back),
        vertical_fov: frame.fov,
        lens_radius: 0.0,
        focus_distance: 1.0,
    };
    let Ok(camera) = Camera::new(parameters, UVec2::splat(RAYS)) else {
        return Vec::new();
    };
    let width = 2.0 * (0.5 * frame.fov).to_radians().tan() / RAYS as f32;
    let pixel = |i: u32| Vec2::new((i % RAYS) as f32 + 0.5, (i / RAYS) as f32 + 0.5);
    let pixels = (0..RAYS * RAYS).map(|i| {
        let ray = camera.ray(pixel(i), Vec2::splat(0.5), 0.0);
        trace(ray.origin, ray.direction, width)
    });
    pixels.collect()
}

/// Colours in a coarse image, about as displays encode them; black where there is no surface.
fn colors(tracer: &SceneTracer, horizon: &Horizon, frame: &Framing, back: Vec3) -> Vec<Vec3> {
    coarse_image(tracer, horizon, frame, back, |origin, direction, width| {
        let color = tracer.color(origin, direction, width).unwrap_or_default();
        Vec3::from(color.to_array()).clamp(Vec3::ZERO, Vec3::ONE).map(f32::sqrt)
    })
}

/// Surfaces that the rays of a coarse image hit, row by row.
struct Picture(Vec<Option<SurfaceHit>>);

impl Picture {
    fn take(tracer: &SceneTracer, horizon: &Horizon, frame: &Framing, back: Vec3) -> Self {
        let trace = |origin, direction, _| tracer.trace(origin, direction);
        Self(coarse_image(tracer, horizon, frame, back, trace))
    }

    /// Information in the view, in bits: the entropies of normals, of materials, and of triangles.
    /// Modellers tessellate detail more finely, so triangles show detail.
    fn information(&self) -> f32 {
        let [normals, materials, triangles] = self.tally().entropies();
        normals + materials + 0.5 * triangles
    }

    /// Pairs of neighbouring pixels on surfaces: their indices and surfaces. Pairs with a step in
    /// depth are left out, because they are outlines.
    fn neighbors(&self) -> impl Iterator<Item = [(usize, SurfaceHit); 2]> {
        let n = RAYS as usize;
        let at = |i: usize| Some((i, self.0.get(i).copied().flatten()?));
        let first = (0..n - 1).flat_map(move |y| (0..n - 1).map(move |x| y * n + x));
        let pairs = first.flat_map(move |i| [(i, i + 1), (i, i + n)]);
        let found = pairs.filter_map(move |(i, j)| Some([at(i)?, at(j)?]));
        found.filter(|[(_, a), (_, b)]| (a.distance - b.distance).abs() < STEP * a.distance)
    }

    /// Curvature of the surfaces: the sum over neighbours of `1 − cos` of the angle between their
    /// normals.
    fn curvature(&self) -> f32 {
        let bends = self.neighbors().map(|[(_, a), (_, b)]| 1.0 - a.normal.dot(b.normal));
        bends.fold(0.0, |sum, bend| sum + bend)
    }

    /// Drawings of textures: the sum over neighbours of one material of the difference in colour.
    fn drawings(&self, colors: &[Vec3]) -> f32 {
        let of_one = self.neighbors().filter(|[(_, a), (_, b)]| a.material == b.material);
        let steps = of_one.map(|[(i, _), (j, _)]| (colors[i] - colors[j]).abs().max_element());
        steps.fold(0.0, |sum, step| sum + step)
    }

    /// Entropy of the materials, in bits.
    fn materials(&self) -> f32 {
        self.tally().entropies()[1]
    }

    fn tally(&self) -> HitStatistics {
        let mut tally = HitStatistics::default();
        self.0.iter().for_each(|seen| tally.add(seen.as_ref()));
        tally
    }

    /// Similarity of the left and the right half, from 0 to 1: pairs of mirrored pixels with
    /// similar depths.
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
        // Shares up to 0.5 give 0, because most pixels agree in any compact shape.
        if all > 0.0 {
            ((alike / all - 0.5) * 2.0_f32).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}
