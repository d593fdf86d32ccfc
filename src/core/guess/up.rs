//! The upright axis of a scene.
//!
//! Six directions compete. Each has a score in natural logarithms of odds: the frequency of the
//! direction in OBJ files, plus a weighted sum of evidence (`OUTSIDE` and `INSIDE`). The measures
//! come from `surfaces`; for an interior, also from rays from its rooms. Close scores are decided
//! by other files of the folder (`SiblingFiles`).
//!
//! Weights of objects are a logistic regression with fixed odds of the directions, with a ridge
//! penalty. It was fitted to 173 public files, whose upright axis was identified by eye, and with a
//! weight of 0.3 to turned copies of them with other axes up. Evidence was kept if it lowered the
//! loss in a cross-validation by repository. Weights of bodies of revolution and of other files
//! were fitted later, with all other weights fixed, and weights of grounds, tips and cut bases were
//! set by hand. Weights of interiors were set by hand on 9 files and on 5 rooms in four positions.
//! Wrong directions before cut bases were added: 6 of the 183 files, and 5 of 147 files of 45 other
//! repositories, for which nothing was fitted. Without bodies of revolution and other files they
//! were 7 and 7; with an earlier version with 6 kinds of evidence 16 and 21.

use super::file_axes::{FileAxes, NamedThing};
use super::scene_tracer::SceneTracer;
use super::surfaces::{Direction, Surfaces};
use crate::math::Vec3;

/// Scores of the directions in objects: most programs write +y up, some +z. In the order of
/// [`Direction::ALL`].
const USUAL: [f32; 6] = [-1.5, -1.5, 2.5, -0.6, 1.0, -0.6];
/// Scores of the directions in interiors, whose evidence is clearer.
const USUAL_INSIDE: [f32; 6] = [-0.3, -0.3, 0.3, 0.0, 0.2, 0.0];
/// Score of the usual up axis of the program that wrote the file, if the scene is an object. It is
/// lower than the fitted score, because meshes that were read and written by MeshLab often have +y
/// up.
const USUAL_FOR_PROGRAM: f32 = 1.5;
/// This score replaces [`USUAL_FOR_PROGRAM`] for Blender, whose users rarely change the axis. It
/// was set by hand. It changes the axis of 3 of 501 public files, in 2 of them from a wrong axis to
/// the right axis.
const USUAL_FOR_KEEPING_PROGRAM: f32 = 2.5;
/// Score of the usual up axis of the program that wrote the file, if the scene is an interior.
const USUAL_FOR_PROGRAM_INSIDE: f32 = 0.2;
/// Score of the direction opposite to the usual up axis of the program: its settings offer other
/// axes, but models upside down are mistakes. It is larger than the evidence of one flat end
/// (`is_cut_base`), because the flat end of a gem is its top.
const AGAINST_PROGRAM: f32 = -4.5;
/// Score of the axis perpendicular to a flat scene with the name of a building, of rooms or of
/// land.
const LIES: f32 = 4.0;
/// Score of an axis along which a thing with this name does not stand: the shortest axis of a
/// door, or the longest axis of a car. Of 78 public files with such a name, the rule excludes the
/// right axis of 2.
const NOT_BY_NAME: f32 = -4.0;
/// Score of the direction of the tops of flat letters. It is subtracted for the axis along which
/// the letters are thin.
const LETTERS: f32 = 4.0;
const Y: Direction = Direction::ALL[2];
const Z: Direction = Direction::ALL[4];
const MINUS_Z: Direction = Direction::ALL[5];
/// Minimum and maximum ratio of a plate's thickness to its smaller width. Sheets are thinner.
const PLATE: [f32; 2] = [0.01, 0.1];
/// Score by which another direction must be better than +y.
const MARGIN: f32 = 0.02;

/// Evidence that a direction is up.
type Evidence = fn(&Surfaces, Direction) -> f32;

/// Weights of the evidence in objects.
const OUTSIDE: [(f32, Evidence); 17] = [
    (5.5, rests),
    (2.6, stands_on_parts),
    (6.5, faces_up),
    (2.7, is_open),
    (1.9, is_on_zero),
    (3.6, is_off_center),
    (12.0, is_balanced),
    (2.7, is_turned),
    (-1.6, is_mirrored),
    (2.5, is_lathe),
    (2.5, is_vessel),
    (4.1, has_upright_textures),
    (10.0, is_named),
    (10.0, has_face),
    (5.0, is_ground),
    (-2.5, is_on_tip),
    (4.0, is_cut_base),
];
/// Weights of the evidence in interiors.
const INSIDE: [(f32, Evidence); 4] = [
    (1.5, stands_on_parts),
    (0.5, is_on_zero),
    (0.7, has_upright_textures),
    (2.0, is_named),
];
/// Weight of the evidence from rays in interiors that rooms are low.
const LOW_ROOMS: f32 = 0.8;
/// Weight of the evidence from rays in interiors that there is less clutter above than below.
const CLEAR_ABOVE: f32 = 1.0;

/// An object has a wide contact with the ground, but not with the ceiling. A base wider than `WIDE`
/// is not better: rims and table tops are wide too.
fn rests(surfaces: &Surfaces, up: Direction) -> f32 {
    const WIDE: f32 = 0.3;
    let contact = |up| surfaces.measures(up).contact.min(WIDE);
    contact(up) - contact(up.opposite())
}

/// Most parts stand on other parts, and few hang from them.
fn stands_on_parts(surfaces: &Surfaces, up: Direction) -> f32 {
    surfaces.measures(up).standing
}

/// More surfaces face up than down: terrain, plates and houses have no underside.
fn faces_up(surfaces: &Surfaces, up: Direction) -> f32 {
    (surfaces.measures(up).faces_up - surfaces.measures(up.opposite()).faces_up).clamp(-0.15, 0.15)
}

/// More surfaces have open sky above than open space below.
fn is_open(surfaces: &Surfaces, up: Direction) -> f32 {
    (surfaces.measures(up).open - surfaces.measures(up.opposite()).open).clamp(-0.2, 0.2)
}

/// Objects are modelled on the ground, at height 0.
fn is_on_zero(surfaces: &Surfaces, up: Direction) -> f32 {
    let is = |up| f32::from(u8::from(surfaces.measures(up).is_on_zero));
    is(up) - is(up.opposite())
}

/// The origin is in the middle from left to right and from front to back, but not in height.
fn is_off_center(surfaces: &Surfaces, up: Direction) -> f32 {
    over_others(surfaces.off_center, up)
}

/// The surfaces' centre is off the middle from front to back more often than in height.
fn is_balanced(surfaces: &Surfaces, up: Direction) -> f32 {
    -surfaces.off_balance[up.axis].min(0.15)
}

/// Towers, bottles and trees look similar if they are turned. So do plates: tiles lie, but emblems,
/// clocks and windows stand.
fn is_turned(surfaces: &Surfaces, up: Direction) -> f32 {
    if (0..3).any(|axis| is_plate(surfaces, axis)) {
        0.0
    } else {
        over_others(surfaces.turn, up)
    }
}

/// Returns true if the scene is a plate that is thin along the axis `axis`.
fn is_plate(surfaces: &Surfaces, axis: usize) -> bool {
    let [thin, thick] = PLATE;
    (thin..=thick).contains(&surfaces.slimness[axis])
}

/// The left and right halves are similar, and often the front and back halves. The top and bottom
/// halves are not.
fn is_mirrored(surfaces: &Surfaces, up: Direction) -> f32 {
    over_others(surfaces.mirror, up)
}

/// Bottles, lamps and pawns stand on their axis of revolution. Wheels and coins may also lie flat.
fn is_lathe(surfaces: &Surfaces, up: Direction) -> f32 {
    const FLAT: f32 = 0.5;
    revolves(surfaces, up) * (surfaces.slimness[up.axis] / FLAT).min(1.0)
}

/// Vessels are open at the top.
fn is_vessel(surfaces: &Surfaces, up: Direction) -> f32 {
    let depth = |up| surfaces.measures(up).depth;
    revolves(surfaces, up) * (depth(up) - depth(up.opposite()))
}

/// Similarity to a body of revolution around this axis only, 0 to 1.
fn revolves(surfaces: &Surfaces, up: Direction) -> f32 {
    ((over_others(surfaces.round, up) - 0.25) / 0.35).clamp(0.0, 1.0)
}

/// Pictures on walls, clothes and faces are upright: v increases upwards.
fn has_upright_textures(surfaces: &Surfaces, up: Direction) -> f32 {
    surfaces.v.dot(up.vector())
}

/// Materials and parts with names such as roof, hair or leaves are above those with names such as
/// floor, shoe or wheel.
fn is_named(surfaces: &Surfaces, up: Direction) -> f32 {
    surfaces.named.dot(up.vector()).clamp(-0.5, 0.5)
}

/// Eyes and teeth are not at the bottom. They are at the top of people, and in front.
fn has_face(surfaces: &Surfaces, up: Direction) -> f32 {
    surfaces.face.dot(up.vector()).clamp(-0.5, 0.1)
}

/// Flat sheets of grass, dirt or asphalt lie with their fronts up.
fn is_ground(surfaces: &Surfaces, up: Direction) -> f32 {
    const THIN: f32 = 1e-3;
    const LOW: f32 = 0.5;
    let is_flat = surfaces.extent[up.axis] <= THIN * surfaces.extent.max_element();
    let shows_front = surfaces.measures(up).faces_up > surfaces.measures(up.opposite()).faces_up;
    if is_flat && shows_front && surfaces.low > LOW {
        surfaces.low
    } else {
        0.0
    }
}

/// Slender bodies with symmetric sides do not stand on a tip: fish, ships and planes.
fn is_on_tip(surfaces: &Surfaces, up: Direction) -> f32 {
    const SLENDER: f32 = 1.8;
    const TIP: f32 = 0.01;
    const ALIKE: f32 = 0.85;
    const ROUND: f32 = 0.3;
    let across = [(up.axis + 1) % 3, (up.axis + 2) % 3];
    let width = surfaces.extent[across[0]].max(surfaces.extent[across[1]]);
    let is_slender = surfaces.extent[up.axis] >= SLENDER * width;
    let has_sides = across.iter().any(|&axis| surfaces.mirror[axis] >= ALIKE);
    let is_round = over_others(surfaces.round, up) >= ROUND;
    let is = is_slender && has_sides && !is_round && surfaces.measures(up).contact <= TIP;
    f32::from(u8::from(is))
}

/// A head or a figure of round surfaces has one flat end, at which it is cut or stands. The end
/// opposite to a table top or a car roof has feet, which contact the ground too. Flat ends of
/// pencils and keys are narrow. The two sides of a plate are not ends.
fn is_cut_base(surfaces: &Surfaces, up: Direction) -> f32 {
    const WIDE: f32 = 0.2;
    const OTHER: f32 = 0.25;
    const CONTACT: f32 = 0.2;
    const SLENDER: f32 = 2.5;
    let flat_end = |up| surfaces.measures(up).flat_end;
    let others = Direction::ALL.into_iter().filter(|&other| other != up);
    let is_only = others.map(flat_end).all(|other| other <= OTHER * flat_end(up));
    let has_feet = surfaces.measures(up.opposite()).contact >= CONTACT;
    let is_body = surfaces.slimness[up.axis] <= SLENDER && !is_plate(surfaces, up.axis);
    if is_only && !has_feet && is_body {
        (flat_end(up) / WIDE).min(1.0)
    } else {
        0.0
    }
}

/// Returns true if a scene with this `extent` is flat, and lies on the ground if `up` is up.
fn lies(extent: Vec3, up: Direction) -> bool {
    const FLAT: f32 = 0.25;
    let across = extent[(up.axis + 1) % 3].min(extent[(up.axis + 2) % 3]);
    !up.is_negative && extent[up.axis] <= FLAT * across
}

/// Returns true if a thing of the kind `thing` with this `extent` does not stand along the axis of
/// `up`. Limits: axes with similar extents are not distinguished.
fn is_excluded(thing: Option<NamedThing>, extent: Vec3, up: Direction) -> bool {
    const SHORT: f32 = 0.6;
    const LONG: f32 = 1.3;
    let height = extent[up.axis];
    let across = [extent[(up.axis + 1) % 3], extent[(up.axis + 2) % 3]];
    match thing {
        Some(NamedThing::Tall) => height < SHORT * across[0].max(across[1]),
        Some(NamedThing::Standing) => height < SHORT * across[0].min(across[1]),
        Some(NamedThing::Long) => height > LONG * across[0].max(across[1]),
        _ => false,
    }
}

/// Score of a direction for flat letters: they stand. If a program with +y up wrote them in the
/// plane of x and z, they were modelled lying on the ground, and their tops are at −z.
fn stands_as_letters(axes: &FileAxes, extent: Vec3, up: Direction) -> f32 {
    if axes.thing != Some(NamedThing::Letters) {
        return 0.0;
    }
    let (thin, top) = if lies(extent, Z) {
        (Z, Y)
    } else if lies(extent, Y) && axes.usual_up == Some(Y.vector()) {
        (Y, MINUS_Z)
    } else {
        return 0.0;
    };
    if up == top {
        LETTERS
    } else if up.axis == thin.axis {
        -LETTERS
    } else {
        0.0
    }
}

/// Value of an axis, minus the larger value of both other axes.
fn over_others(values: [f32; 3], up: Direction) -> f32 {
    values[up.axis] - values[(up.axis + 1) % 3].max(values[(up.axis + 2) % 3])
}

/// Scores of the directions as the upright axis of a scene, in the order of `Direction::ALL`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpScores([f32; 6]);

impl UpScores {
    /// Scores from the scene's shapes and the comments of its file; for an interior, also from
    /// points inside of its rooms.
    pub(super) fn new(tracer: &SceneTracer, rooms: Option<&[Vec3]>, axes: &FileAxes) -> Self {
        let usual = axes.usual_up;
        let of_program = if axes.keeps_usual_up {
            USUAL_FOR_KEEPING_PROGRAM
        } else {
            USUAL_FOR_PROGRAM
        };
        let surfaces = Surfaces::new(tracer);
        let weighed = |evidence: &[(f32, Evidence)], up| -> f32 {
            evidence
                .iter()
                .map(|(weight, evidence)| weight * evidence(&surfaces, up))
                .sum()
        };
        let written = |up: Direction| f32::from(u8::from(usual == Some(up.vector())));
        let of_file = |up: Direction| {
            let is_against = usual == Some(up.opposite().vector());
            let is_of_land = matches!(axes.thing, Some(NamedThing::Rooms | NamedThing::Land));
            let lies_as_land = is_of_land && lies(surfaces.extent, up);
            let is_excluded = is_excluded(axes.thing, surfaces.extent, up);
            AGAINST_PROGRAM * f32::from(u8::from(is_against))
                + LIES * f32::from(u8::from(lies_as_land))
                + NOT_BY_NAME * f32::from(u8::from(is_excluded))
                + stands_as_letters(axes, surfaces.extent, up)
        };
        Self(match rooms {
            None => Direction::ALL
                .map(|up| USUAL[up.index()] + of_program * written(up) + of_file(up) + weighed(&OUTSIDE, up)),
            Some(rooms) => {
                let rays = Direction::ALL.map(|up| FreeRays::along(tracer, rooms, up.vector()));
                Direction::ALL.map(|up| {
                    USUAL_INSIDE[up.index()]
                        + USUAL_FOR_PROGRAM_INSIDE * written(up)
                        + of_file(up)
                        + weighed(&INSIDE, up)
                        + LOW_ROOMS * is_low(&rays, up)
                        + CLEAR_ABOVE * is_clear(&rays, up)
                })
            }
        })
    }

    /// The direction with the highest score.
    pub(super) fn best(&self) -> Vec3 {
        let mut best = (Vec3::Y, f32::NEG_INFINITY);
        for (up, &score) in Direction::ALL.into_iter().zip(&self.0) {
            let score = score + if up.vector() == Vec3::Y { MARGIN } else { 0.0 };
            if score > best.1 {
                best = (up.vector(), score);
            }
        }
        best.0
    }

    /// The direction to try if the best direction is wrong: +y or +z, because other directions are
    /// rarely up, even if their score is the second highest.
    pub(super) fn alternative(&self) -> Vec3 {
        let [y, z] = [Y, Z].map(|up| self.0[up.index()]);
        let best = self.best();
        if best == Y.vector() || best != Z.vector() && z > y {
            Z.vector()
        } else {
            Y.vector()
        }
    }

    /// Returns true if other files of the folder can change the best direction.
    pub(super) fn are_close(&self) -> bool {
        self.margin() <= SiblingFiles::LARGEST
    }

    /// Score of the best direction, minus the score of the second best.
    pub(super) fn margin(&self) -> f32 {
        let mut scores = self.0;
        scores.sort_by(f32::total_cmp);
        scores[5] - scores[4]
    }

    /// The scores with the evidence of other files.
    pub(super) fn with(&self, siblings: &SiblingFiles) -> Self {
        let max = siblings.0.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let evidence = |i: usize| (siblings.0[i] - max).max(-SiblingFiles::LARGEST);
        Self(std::array::from_fn(|i| self.0[i] + evidence(i)))
    }
}

/// Evidence of other OBJ files of the same folder, most of which have the same upright axis. For
/// each direction, it is the sum over these files of the logarithm of the probability that the
/// direction is up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SiblingFiles([f32; 6]);

impl SiblingFiles {
    /// Maximum change of scores by all files together.
    const LARGEST: f32 = 2.0;
    /// Probability that the axis of a file does not depend on the other files.
    const OTHER: f32 = 0.2;

    /// Adds the evidence of a file with the scores `scores`.
    pub fn add(&mut self, scores: &UpScores) {
        let max = scores.0.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let odds = scores.0.map(|score| (score - max).exp());
        let all: f32 = odds.iter().sum();
        for (sum, odds) in self.0.iter_mut().zip(odds) {
            *sum += ((1.0 - Self::OTHER) * odds / all + Self::OTHER).ln();
        }
    }
}

/// Rooms are wider than high.
fn is_low(rays: &[FreeRays; 6], up: Direction) -> f32 {
    let length = |axis: usize| (rays[2 * axis].mean + rays[2 * axis + 1].mean).max(f32::MIN_POSITIVE);
    let across = (length((up.axis + 1) % 3) * length((up.axis + 2) % 3)).sqrt();
    (across / length(up.axis)).ln().clamp(-0.8, 0.8)
}

/// There is less clutter below ceilings than above floors.
fn is_clear(rays: &[FreeRays; 6], up: Direction) -> f32 {
    (rays[up.index()].clear - rays[up.opposite().index()].clear).clamp(-0.15, 0.15)
}

/// Rays from points inside of an interior in one direction.
struct FreeRays {
    /// Mean length, to the scene's box if nothing is hit.
    mean: f32,
    /// Fraction of the rays that hit only the outermost surfaces.
    clear: f32,
}

impl FreeRays {
    /// Fraction of the extent that contains the outermost surfaces.
    const OUTERMOST: f32 = 0.05;

    fn along(tracer: &SceneTracer, rooms: &[Vec3], direction: Vec3) -> Self {
        let bounds = tracer.region.bounds;
        let axis = direction.abs().max_position();
        let end = if direction[axis] > 0.0 {
            bounds.max[axis]
        } else {
            bounds.min[axis]
        };
        let extent = bounds.max[axis] - bounds.min[axis];
        let (mut sum, mut clear, mut count) = (0.0, 0.0, 0.0f32);
        for &p in rooms {
            let rest = (end - p[axis]).abs();
            let length = tracer.trace(p, direction).map_or(rest, |seen| seen.distance.min(rest));
            sum += length;
            clear += f32::from(u8::from(rest - length <= Self::OUTERMOST * extent));
            count += 1.0;
        }
        Self {
            mean: sum / count.max(1.0),
            clear: clear / count.max(1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alternative_is_y_or_z() {
        for (scores, alternative) in [
            ([0.0, 0.0, 1.0, 0.0, 4.0, 3.0], Vec3::Y),
            ([3.0, 0.0, 4.0, 3.5, -1.0, 0.0], Vec3::Z),
            ([0.0, 0.0, 2.0, 3.5, 1.0, 4.0], Vec3::Y),
            ([4.0, 3.0, 0.0, 0.0, 1.0, 0.0], Vec3::Z),
        ] {
            assert_eq!(UpScores(scores).alternative(), alternative, "{scores:?}");
        }
    }
}
