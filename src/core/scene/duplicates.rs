//! Repeated triangles and instances: triangles with bit-identical corners, and instances with
//! bit-identical placements.
//!
//! A ray that hits one of n equal triangles is tested with all of them, so n rays need n² tests.
//! Light sampling would add the light of each of n equal emitters, but a ray that BSDF sampling
//! traces hits only one of them. So the builder keeps only the first of several equal triangles of
//! a mesh, with its texture coordinates and normals, and only the first of several equal instances.
//! Triangles that differ in winding are different.
//!
//! To save memory, the hash of each item first sets a bit in a bit set, which takes 2 to 4 bytes
//! per item. Only if the bit was already set, items with this hash are compared.
//!
//! Equal triangles of different meshes are kept, because their materials differ. They are reported
//! if many of them coincide. To find them, the hash of every eighth triangle is stored
//! ([`TriangleSamples`]). Triangles are counted only if their hash is stored several times.

use super::{LightNumbering, Scene};
use crate::geometry::{GeomId, Hit, InstanceId, Mesh, Placement, PrimId, retain_triangles};
use crate::material::MaterialId;
use crate::math::hash::{GOLDEN_GAMMA, mix};
use crate::math::{Affine3A, Vec3};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};

/// Bits of a triangle's corners at shutter open and close. The corner with the smallest bits is
/// first.
type TriangleKey = [[u32; 9]; 2];

/// Coincident triangles of different meshes are reported if there are at least this many. A ray
/// that hits one of them is tested with all of them.
pub const MANY_COINCIDENT: u64 = 32;

/// Minimum number of triangles of a task.
const MIN_TASK: usize = 4096;

/// Hashes of every [`TriangleSamples::STRIDE`]th triangle of all meshes.
#[derive(Clone, Debug, Default)]
pub(super) struct TriangleSamples {
    /// Number of triangles that were added, including triangles whose hash is not stored.
    seen: usize,
    hashes: Vec<u64>,
}

impl TriangleSamples {
    const STRIDE: usize = 8;
    /// Minimum number of times that a stored hash occurs. Triangles with a less frequent hash are
    /// not counted. If [`MANY_COINCIDENT`] equal meshes are added one after another, at least one
    /// hash occurs this number of times.
    const MIN: usize = MANY_COINCIDENT as usize / Self::STRIDE;

    fn add(&mut self, triangles: &[[u32; 3]], hash: impl Fn(&[u32; 3]) -> u64) {
        let before = self.seen.next_multiple_of(Self::STRIDE) - self.seen;
        let sampled = triangles.iter().skip(before).step_by(Self::STRIDE);
        self.hashes.extend(sampled.map(hash));
        self.seen += triangles.len();
    }

    /// Stored hashes that occur at least [`Self::MIN`] times.
    fn frequent(&self) -> SetOfHashes {
        let mut hashes = self.hashes.clone();
        hashes.sort_unstable();
        let runs = hashes.chunk_by(|a, b| a == b);
        runs.filter(|run| run.len() >= Self::MIN).map(|run| run[0]).collect()
    }

    /// Size of the largest set of equal triangles; 0 if it is below [`MANY_COINCIDENT`]. Triangles
    /// are compared within each of the `groups` of meshes, but not between groups.
    pub fn largest_coincidence<'m>(&self, groups: impl Iterator<Item = &'m [(Mesh, MaterialId)]>) -> u64 {
        let frequent = self.frequent();
        if frequent.is_empty() {
            return 0;
        }
        let largest = |meshes: &[(Mesh, MaterialId)]| {
            let mut counts: HashMap<TriangleKey, u64> = HashMap::new();
            for (mesh, _) in meshes {
                let corners = mesh.triangles.iter();
                let corners = corners.map(|corners| Corners::in_mesh(&mesh.positions, &mesh.positions_close, corners));
                for corners in corners.filter(|corners| frequent.contains(&corners.hash())) {
                    *counts.entry(corners.key()).or_insert(0) += 1;
                }
            }
            counts.into_values().max().unwrap_or(0)
        };
        let count = groups.map(largest).max().unwrap_or(0);
        if count < MANY_COINCIDENT { 0 } else { count }
    }
}

/// Corners of a triangle at shutter open, and at shutter close if it moves.
#[derive(Clone, Copy)]
struct Corners {
    open: [Vec3; 3],
    close: Option<[Vec3; 3]>,
}

impl Corners {
    /// Corners of the triangle with the vertex indices `corners`. `positions_close` are the
    /// vertices at shutter close; empty without motion.
    fn in_mesh(positions: &[Vec3], positions_close: &[Vec3], corners: &[u32; 3]) -> Self {
        let of = |positions: &[Vec3]| corners.map(|i| positions[i as usize]);
        Self {
            open: of(positions),
            close: (!positions_close.is_empty()).then(|| of(positions_close)),
        }
    }

    /// Hash of the corners, which is computed faster than the key. It is a sum over the directed
    /// edges. So it depends on the winding, but not on which corner is first.
    fn hash(&self) -> u64 {
        let mut hashes = self.open.map(|p| hash_of_point(p, GOLDEN_GAMMA));
        if let Some(close) = self.close {
            for (hash, p) in hashes.iter_mut().zip(close) {
                *hash = hash.wrapping_add(hash_of_point(p, GOLDEN_GAMMA.rotate_left(32) | 1));
            }
        }
        let [a, b, c] = hashes;
        let edge = |from: u64, to: u64| mix(from.wrapping_sub(to.rotate_left(32)));
        edge(a, b).wrapping_add(edge(b, c)).wrapping_add(edge(c, a))
    }

    fn key(&self) -> TriangleKey {
        let corners = self.open.map(|p| p.to_array().map(bits));
        let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        let key = |corners: [[u32; 3]; 3]| {
            let mut key = [0; 9];
            for (i, corner) in key.chunks_exact_mut(3).enumerate() {
                corner.copy_from_slice(&corners[(first + i) % 3]);
            }
            key
        };
        let close = self.close.unwrap_or([Vec3::ZERO; 3]);
        [key(corners), key(close.map(|p| p.to_array().map(bits)))]
    }
}

/// Hash of the bits of `p`: a polynomial in the odd number `base`.
fn hash_of_point(p: Vec3, base: u64) -> u64 {
    p.to_array()
        .map(bits)
        .into_iter()
        .fold(0u64, |hash, bits| hash.wrapping_add(u64::from(bits)).wrapping_mul(base))
}

/// Removes triangles that repeat another triangle of the mesh, and returns the number of removed
/// triangles. Adds the hash of every eighth triangle to `samples`.
pub(super) fn remove_repeated_triangles(mesh: &mut Mesh, samples: &mut TriangleSamples) -> u64 {
    let before = mesh.triangles.len();
    let Mesh {
        positions,
        positions_close,
        triangles,
        parts,
        ..
    } = mesh;
    let corners_of = |corners: &[u32; 3]| Corners::in_mesh(positions, positions_close, corners);
    let hash = |corners: &[u32; 3]| corners_of(corners).hash();
    samples.add(triangles, hash);
    let repeated = repeated(triangles.par_iter().with_min_len(MIN_TASK).map(hash), before);
    if repeated.is_empty() {
        return 0;
    }

    // Compare the few triangles whose hashes are repeated
    let all = triangles.par_iter().with_min_len(MIN_TASK).enumerate();
    let candidates = all.filter(|(_, corners)| repeated.contains(&hash(corners)));
    let candidates: Vec<usize> = candidates.map(|(i, _)| i).collect();
    let mut known = HashSet::new();
    let is_copy = |&i: &usize| !known.insert(corners_of(&triangles[i]).key());
    let copies: Vec<usize> = candidates.into_iter().filter(is_copy).collect();
    if !copies.is_empty() {
        let (mut i, mut next) = (0, copies.iter().peekable());
        retain_triangles(triangles, parts, |_| {
            i += 1;
            next.next_if_eq(&&(i - 1)).is_none()
        });
    }
    copies.len() as u64
}

/// Removes instances that repeat another instance, and their entries in `objects`. Returns the
/// number of removed instances. `id` returns the index of a prototype.
pub(super) fn remove_repeated_instances<P>(
    instances: &mut Vec<(P, Placement)>,
    objects: &mut Vec<u32>,
    id: impl Fn(&P) -> u32,
) -> u64 {
    let before = instances.len();
    let key = |(prototype, placement): &(P, Placement)| -> Vec<u32> {
        // A placement without motion has one step, a motion has two or more.
        let steps = placement.steps().iter().flat_map(Affine3A::to_cols_array);
        std::iter::once(id(prototype)).chain(steps.map(bits)).collect()
    };
    let hashes = instances.iter().map(|instance| hash_of(&key(instance)));
    let repeated = repeated(hashes.collect::<Vec<u64>>().into_par_iter(), before);
    if repeated.is_empty() {
        return 0;
    }
    let mut known = HashSet::new();
    let all = std::mem::take(instances).into_iter().zip(std::mem::take(objects));
    let kept = all.filter(|(instance, _)| {
        let key = key(instance);
        !repeated.contains(&hash_of(&key)) || known.insert(key)
    });
    (*instances, *objects) = kept.unzip();
    (before - instances.len()) as u64
}

/// Emitting triangles that coincide with emitting triangles of another mesh or instance, with the
/// front on the same side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoincidentEmitters {
    /// Number of triangles, without the first of each set of coincident triangles.
    pub triangles: u64,
    /// Maximum number of triangles that coincide.
    pub max_at_one_place: u64,
}

impl Scene {
    /// Counts the emitting triangles that are bit-identical to another emitting triangle at shutter
    /// open.
    pub(super) fn coincident_emitters(&self) -> CoincidentEmitters {
        let emitters = || {
            self.emitters()
                .map(|(geom, prim, inst)| self.corners_at_open(geom, prim, inst))
        };
        let hashes: Vec<u64> = emitters().map(|corners| corners.hash()).collect();
        let repeated = repeated(hashes.into_par_iter(), self.lights.len());
        let mut counts: HashMap<TriangleKey, u64> = HashMap::new();
        for corners in emitters().filter(|corners| repeated.contains(&corners.hash())) {
            *counts.entry(corners.key()).or_insert(0) += 1;
        }
        let several = || counts.values().filter(|count| **count > 1);
        CoincidentEmitters {
            triangles: several().map(|count| count - 1).sum(),
            max_at_one_place: several().copied().max().unwrap_or(0),
        }
    }

    /// Emitting triangles, in the world and in instances. The hull meshes of sphere and disk lights
    /// are not included.
    fn emitters(&self) -> impl Iterator<Item = (GeomId, PrimId, InstanceId)> {
        let world_meshes = self.world_meshes().map(|geom| (geom, InstanceId::NONE));
        let placed = (0..).zip(&self.instances).flat_map(move |(inst, instance)| {
            let meshes = self.prototypes[instance.prototype as usize].clone();
            meshes.map(move |geom| (geom, InstanceId(inst)))
        });
        world_meshes.chain(placed).flat_map(move |(geom, inst)| {
            let shape = self.shape(GeomId(geom));
            let emits = shape.first_light.is_some() && shape.numbering != LightNumbering::One;
            let count = if emits {
                self.mesh(GeomId(geom)).triangles.len() as u32
            } else {
                0
            };
            (0..count).map(move |prim| (GeomId(geom), PrimId(prim), inst))
        })
    }

    fn corners_at_open(&self, geom: GeomId, prim: PrimId, inst: InstanceId) -> Corners {
        let hit = Hit::at_corner(geom, prim, inst);
        Corners {
            open: self.placed(&hit, 0.0).corners,
            close: None,
        }
    }
}

/// Bits of `value`. The bits of +0 and −0 are the same.
fn bits(value: f32) -> u32 {
    (value + 0.0).to_bits()
}

fn hash_of(words: &[u32]) -> u64 {
    words.chunks(2).fold(0, |hash, pair| {
        let pair = pair.iter().fold(0, |pair, &word| (pair << 32) | u64::from(word));
        mix(hash ^ pair)
    })
}

/// Set of hashes.
type SetOfHashes = HashSet<u64, BuildHasherDefault<SameHash>>;

/// Hasher of a number that is a hash: returns the number.
#[derive(Clone, Copy, Debug, Default)]
struct SameHash(u64);

impl Hasher for SameHash {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.0 = self.0 << 8 | u64::from(byte));
    }

    fn write_u64(&mut self, hash: u64) {
        self.0 = hash;
    }
}

/// Hashes that occur more than once. The set also contains a few hashes that occur once, because
/// another hash had set the same bit. These depend on the order of the threads. `count` is the
/// number of all hashes.
fn repeated(hashes: impl ParallelIterator<Item = u64>, count: usize) -> SetOfHashes {
    let bits = (16 * count as u64).next_power_of_two();
    let words = (bits / 64).max(1);
    let seen: Vec<AtomicU64> = (0..words).map(|_| AtomicU64::new(0)).collect();
    let is_repeated = |hash: &u64| {
        let bit = hash & (bits - 1);
        let mask = 1 << (bit % 64);
        seen[(bit / 64) as usize].fetch_or(mask, Ordering::Relaxed) & mask != 0
    };
    let repeated: Vec<u64> = hashes.filter(is_repeated).collect();
    repeated.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::super::SceneBuilder;
    use super::*;
    use crate::color::Spectrum;
    use crate::material::Material;

    fn quad(copies: usize) -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y, Vec3::ZERO],
            triangles: [[0, 1, 2], [4, 2, 3]].repeat(copies),
            ..Mesh::default()
        }
    }

    fn emitting(builder: &mut SceneBuilder, radiance: f32) -> crate::material::MaterialId {
        let material = Material {
            emission: Spectrum::splat(radiance),
            ..Material::default()
        };
        builder.add_material(material).unwrap()
    }

    #[test]
    fn first_of_equal_triangles_stays() {
        let mut mesh = quad(10_000);
        // Triangles with a different first corner, with the opposite winding, and with a different
        // motion
        mesh.triangles.extend([[2, 0, 1], [0, 2, 1]]);
        assert_eq!(
            remove_repeated_triangles(&mut mesh, &mut TriangleSamples::default()),
            19_999
        );
        assert_eq!(mesh.triangles, [[0, 1, 2], [4, 2, 3], [0, 2, 1]]);
        let mut moving = Mesh {
            positions_close: (0..5).map(|i| Vec3::Z * i as f32).collect(),
            ..quad(2)
        };
        moving.triangles.push([4, 1, 2]);
        assert_eq!(
            remove_repeated_triangles(&mut moving, &mut TriangleSamples::default()),
            2
        );
        assert_eq!(moving.triangles.len(), 3);
        assert_eq!(
            remove_repeated_triangles(&mut quad(1), &mut TriangleSamples::default()),
            0
        );
    }

    /// `copies` equal quads in separate meshes. Each has a separate triangle behind it.
    fn quads_of_materials(copies: usize) -> Vec<(Mesh, MaterialId)> {
        let mut meshes = Vec::new();
        for i in 0..copies {
            let mut elsewhere = quad(1);
            elsewhere
                .positions
                .iter_mut()
                .for_each(|p| *p += Vec3::Z * (1 + i) as f32);
            elsewhere.triangles.truncate(1);
            meshes.extend([(quad(1), MaterialId(0)), (elsewhere, MaterialId(0))]);
        }
        meshes
    }

    #[test]
    fn many_coincident_triangles_of_other_meshes_are_counted() {
        let largest = |copies: usize, is_instanced: bool| {
            let mut builder = SceneBuilder::new();
            emitting(&mut builder, 0.0);
            let meshes = quads_of_materials(copies);
            if is_instanced {
                let prototype = builder.add_prototype(meshes).unwrap();
                builder
                    .add_instance(prototype, Placement::Still(Affine3A::IDENTITY))
                    .unwrap();
            } else {
                meshes
                    .into_iter()
                    .for_each(|(mesh, material)| builder.add_mesh(mesh, material).unwrap());
            }
            builder.build().unwrap().1.coincident_triangles
        };
        assert_eq!(largest(500, false), 500);
        assert_eq!(largest(500, true), 500);
        assert_eq!(largest(40, false), 40);
        assert_eq!((largest(31, false), largest(1, false)), (0, 0));
    }

    #[test]
    fn first_of_equal_instances_stays() {
        let mut builder = SceneBuilder::new();
        let lamp = emitting(&mut builder, 2.0);
        let prototypes = [1, 1].map(|n| builder.add_prototype(vec![(quad(n), lamp)]).unwrap());
        let still = |x: f32| Placement::Still(Affine3A::from_translation((Vec3::X * x).into()));
        for _ in 0..5000 {
            builder.add_instance(prototypes[0], still(0.0)).unwrap();
        }
        builder.add_instance(prototypes[0], still(2.0)).unwrap();
        let (scene, report) = builder.build().unwrap();
        assert_eq!((scene.instances().len(), report.repeated_instances), (2, 4999));
        assert_eq!(scene.lights().len(), 4);
        assert_eq!(report.coincident_emitters, CoincidentEmitters::default());
    }

    #[test]
    fn coincident_emitters_of_other_meshes_are_counted() {
        let mut builder = SceneBuilder::new();
        let lamps = [1.0, 2.0, 3.0].map(|radiance| emitting(&mut builder, radiance));
        for lamp in lamps {
            builder.add_mesh(quad(1), lamp).unwrap();
        }
        // Two quads, back to back
        let mut back = quad(1);
        back.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        builder.add_mesh(back, lamps[0]).unwrap();
        let (_, report) = builder.build().unwrap();
        let CoincidentEmitters {
            triangles,
            max_at_one_place,
        } = report.coincident_emitters;
        assert_eq!((triangles, max_at_one_place, report.repeated_triangles), (4, 3, 0));
    }
}
