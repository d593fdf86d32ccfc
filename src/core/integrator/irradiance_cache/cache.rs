use super::record::Record;
use crate::color::Spectrum;
use crate::film::Points;
use crate::math::{Bounds3, Vec3};

/// Irradiance records in an octree, and interpolation between the records (Ward, Rubinstein and
/// Clear 1988).
#[derive(Clone, Debug)]
pub struct IrradianceCache {
    /// Centre of the root cube, and half its side, in scene units.
    center: Vec3,
    half: f32,
    /// Maximum relative error at which a record is used: Ward's `a`.
    error: f32,
    records: Vec<Record>,
    nodes: Vec<Node>,
    /// Root node of each layer. A layer has the records for one number of scattering events before
    /// the surface.
    roots: Vec<u32>,
}

/// A cube of the octree.
#[derive(Clone, Debug, Default)]
struct Node {
    /// Index of the child in each octant, by the signs of x, y and z; 0 if there is no child.
    children: [u32; 8],
    /// Indices of the records whose reach overlaps the cube, and is between half the side and the
    /// whole side of the cube. The reach of a record is the maximum distance at which the record is
    /// used.
    records: Vec<u32>,
}

/// A cube during a search of the octree.
struct Cube {
    /// Index of the cube's node.
    node: usize,
    /// Centre of the cube, world space.
    center: Vec3,
    /// Half the side of the cube, in scene units.
    half: f32,
}

/// Fraction of the maximum error. A point needs a new record if the errors of all existing records
/// are above this fraction. So records overlap, and few points of the image have no valid record.
const COVERED: f32 = 0.7;

/// Maximum distance between neighbouring records, relative to the larger of their reaches.
/// Neighbours limit each other's radius.
const NEIGHBOURHOOD: f32 = 2.0;

/// Maximum number of levels of the octree: floats cannot resolve smaller cubes.
const MAX_LEVELS: u32 = 24;

impl IrradianceCache {
    /// An empty cache for points inside `bounds`. `error` is the maximum relative error at which a
    /// record is used.
    pub fn new(error: f32, bounds: Bounds3) -> Self {
        Self {
            center: bounds.center(),
            half: bounds.radius(),
            error,
            records: Vec::new(),
            nodes: Vec::new(),
            roots: Vec::new(),
        }
    }

    /// Number of records.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Returns `true` if the cache has no records.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Records in the order of insertion.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// Irradiance at the point `p` with unit normal `n`, interpolated between the records of layer
    /// `layer`. `None` if no record is valid at the point.
    ///
    /// The weight of a record falls linearly to 0 at the maximum error, so that no edge is visible
    /// where the influence of the record ends (Tabellion and Lamorlette 2004).
    pub fn irradiance(&self, p: Vec3, n: Vec3, layer: u32) -> Option<Spectrum> {
        let mut sum = Spectrum::ZERO;
        let mut weights = 0.0;
        self.visit(p, layer, |record| {
            if let Some(error) = record.error(p, n, self.error) {
                let weight = 1.0 - error / self.error;
                sum += record.at(p, n) * weight;
                weights += weight;
            }
        });
        (weights > 0.0).then(|| (sum / weights).max(Spectrum::ZERO))
    }

    /// Statistics of the records of layer `layer` that are valid at the point `p` with unit normal
    /// `n`: their number, mean reach and mean gradient. In the result, `dot` is 1 if one of these
    /// records is at most the distance `dot` away, else 0.
    pub fn points(&self, p: Vec3, n: Vec3, layer: u32, dot: f32) -> Points {
        let mut points = Points::default();
        let (mut gradient, mut weights) = (Vec3::ZERO, 0.0);
        self.visit(p, layer, |record| {
            if let Some(error) = record.error(p, n, self.error) {
                let weight = 1.0 - error / self.error;
                gradient += weight * record.gradients.of_luminance();
                weights += weight;
                points.count += 1.0;
                points.radius += self.error * record.radius;
                if record.p.distance_squared(p) <= dot * dot {
                    points.dot = 1.0;
                }
            }
        });
        points.radius /= points.count.max(1.0);
        if weights > 0.0 {
            points.gradient = (gradient / weights).length();
        }
        points
    }

    /// Fraction of records that are doubtful: most of their light comes from few of their rays.
    pub fn doubtful_share(&self) -> f64 {
        let doubtful = self.records.iter().filter(|record| record.is_doubtful()).count();
        doubtful as f64 / self.len().max(1) as f64
    }

    /// Returns `true` if existing records of `layer` are so near that the point `p` with unit
    /// normal `n` needs no new record.
    pub fn covers(&self, p: Vec3, n: Vec3, layer: u32) -> bool {
        let mut is_covered = false;
        self.visit(p, layer, |record| {
            is_covered |= record.error(p, n, self.error * COVERED).is_some();
        });
        is_covered
    }

    /// Calls `visit` with all records of `layer` that may be valid at the point `p`.
    #[inline(always)]
    fn visit(&self, p: Vec3, layer: u32, mut visit: impl FnMut(&Record)) {
        let (mut center, mut half) = (self.center, self.half);
        let mut next = self.roots.get(layer as usize).copied();
        while let Some(node) = next.and_then(|node| self.nodes.get(node as usize)) {
            for &index in &node.records {
                visit(&self.records[index as usize]);
            }
            let octant = octant_of(p - center);
            half *= 0.5;
            center = child_center(center, half, octant);
            next = Some(node.children[octant]).filter(|&child| child != 0);
        }
    }

    /// Adds `record` to the records of `layer`. The radius of the record is limited to the radius
    /// of each neighbour plus the distance to that neighbour, and the radii of the neighbours are
    /// limited in the same way. The reason is that one of two neighbours may find nearby surfaces
    /// that the other missed (Křivánek, Bouatouch, Pattanaik and Žára 2006, "Making Radiance and
    /// Irradiance Caching Practical: Adaptive Caching and Neighbor Clamping"). A record with an
    /// invalid position or radius is not added.
    pub fn insert(&mut self, mut record: Record, layer: u32) {
        if !(record.radius > 0.0 && record.radius.is_finite() && record.p.is_finite()) {
            return;
        }
        while self.roots.len() <= layer as usize {
            self.roots.push(self.nodes.len() as u32);
            self.nodes.push(Node::default());
        }
        let root = self.roots[layer as usize] as usize;

        // Limit the radii of the record and of its neighbours
        let mut neighbours = Vec::new();
        let cube = Cube {
            node: root,
            center: self.center,
            half: self.half,
        };
        self.find_neighbours(&cube, &record, &mut neighbours);
        let way = |index: u32| self.records[index as usize].p.distance(record.p);
        let ways: Vec<f32> = neighbours.iter().map(|&index| way(index)).collect();
        for (&index, way) in neighbours.iter().zip(&ways) {
            record.radius = record.radius.min(self.records[index as usize].radius + way);
        }
        for (&index, way) in neighbours.iter().zip(&ways) {
            let other = &mut self.records[index as usize];
            other.radius = other.radius.min(record.radius + way);
        }

        // Insert the record into all cubes that overlap its reach. Use the level of the octree at
        // which cubes are about as large as the reach
        let index = self.records.len() as u32;
        self.records.push(record);
        self.insert_into(&cube, index, 0);
    }

    fn insert_into(&mut self, cube: &Cube, index: u32, level: u32) {
        let &Cube { node, center, half } = cube;
        let record = &self.records[index as usize];
        let (p, reach) = (record.p, self.error * record.radius);
        if half <= reach || level == MAX_LEVELS {
            self.nodes[node].records.push(index);
            return;
        }
        let half = 0.5 * half;
        for octant in 0..8 {
            let center = child_center(center, half, octant);
            if distance_to_cube(p, center, half) > reach {
                continue;
            }
            let mut child = self.nodes[node].children[octant] as usize;
            if child == 0 {
                child = self.nodes.len();
                self.nodes.push(Node::default());
                self.nodes[node].children[octant] = child as u32;
            }
            let cube = Cube {
                node: child,
                center,
                half,
            };
            self.insert_into(&cube, index, level + 1);
        }
    }

    /// Finds the records that are near enough to `record` to limit its radius. A record may be
    /// found several times.
    fn find_neighbours(&self, cube: &Cube, record: &Record, found: &mut Vec<u32>) {
        let &Cube { node, center, half } = cube;
        // Records that are stored in the cube or in its children have a reach of at most the side
        // of the cube.
        let reach = (self.error * record.radius).max(2.0 * half);
        if distance_to_cube(record.p, center, half) > NEIGHBOURHOOD * reach {
            return;
        }
        let node = &self.nodes[node];
        let is_near = |other: &Record| {
            let reach = self.error * record.radius.max(other.radius);
            other.p.distance_squared(record.p) <= (NEIGHBOURHOOD * reach).powi(2) && other.n.dot(record.n) > 0.0
        };
        found.extend(node.records.iter().filter(|&&i| is_near(&self.records[i as usize])));
        let half = 0.5 * half;
        for (octant, &child) in node.children.iter().enumerate().filter(|(_, child)| **child != 0) {
            let cube = Cube {
                node: child as usize,
                center: child_center(center, half, octant),
                half,
            };
            self.find_neighbours(&cube, record, found);
        }
    }
}

/// Index of the octant of a cube that contains a point. `d` is the vector from the centre of the
/// cube to the point.
#[inline(always)]
fn octant_of(d: Vec3) -> usize {
    d.cmpge(Vec3::ZERO).bitmask() as usize
}

/// Centre of the octant `octant` of a cube with centre `center`. `half` is half the side of the
/// octant.
#[inline(always)]
fn child_center(center: Vec3, half: f32, octant: usize) -> Vec3 {
    let sign = |bit: usize| if octant >> bit & 1 == 1 { half } else { -half };
    center + Vec3::new(sign(0), sign(1), sign(2))
}

/// Distance of `p` from the cube with centre `center` and half side `half`; 0 inside the cube.
fn distance_to_cube(p: Vec3, center: Vec3, half: f32) -> f32 {
    ((p - center).abs() - Vec3::splat(half)).max(Vec3::ZERO).length()
}

#[cfg(test)]
mod tests {
    use super::super::record::Gradients;
    use super::*;
    use crate::sampler::{Dimension, Independent, SampleKey, Sampler};
    use crate::sampling::warp::uniform_sphere;

    const BOUNDS: Bounds3 = Bounds3 {
        min: Vec3::NEG_ONE,
        max: Vec3::ONE,
    };

    /// Random points in `BOUNDS`, each with a random normal and a random number in [0, 1).
    fn places(seed: u64, count: u32) -> impl Iterator<Item = (Vec3, Vec3, f32)> {
        (0..count).map(move |i| {
            let mut sampler = Independent::new(seed);
            sampler.start(SampleKey::new(0, 0, i));
            let (xy, z) = (sampler.get_2d(Dimension::PIXEL), sampler.get_1d(Dimension::TIME));
            let n = uniform_sphere(sampler.get_2d(Dimension::LENS));
            (
                2.0 * xy.extend(z).to_vec3a() - Vec3::ONE,
                n,
                sampler.get_1d(Dimension::bounce(0, crate::sampler::Bounce::Lobe)),
            )
        })
    }

    fn record(p: Vec3, n: Vec3, radius: f32, irradiance: Spectrum) -> Record {
        Record {
            p,
            n,
            radius,
            irradiance,
            gradients: Gradients::default(),
            effective_rays: 1000.0,
        }
    }

    /// A cache of 3000 records of different sizes, with three normals, in two layers. Calls `visit`
    /// after each insertion.
    fn full_cache(mut visit: impl FnMut(&IrradianceCache)) -> IrradianceCache {
        let mut cache = IrradianceCache::new(0.3, BOUNDS);
        for (i, (p, _, u)) in places(1, 3000).enumerate() {
            let n = [Vec3::X, Vec3::Y, Vec3::Z][i % 3];
            cache.insert(record(p, n, 0.01 + u * u, Spectrum::splat(u)), i as u32 % 2);
            visit(&cache);
        }
        cache
    }

    /// The octree finds the same records as a search of all records.
    #[test]
    fn octree_finds_all_valid_records() {
        let cache = full_cache(|_| ());
        let mut found = 0;
        for (p, _, _) in places(2, 5000) {
            for layer in 0..2 {
                let n = Vec3::Y;
                let mut visited = Vec::new();
                cache.visit(p, layer, |record| visited.push(record.p));
                let mine = (layer as usize..cache.len()).step_by(2).map(|i| &cache.records[i]);
                for record in mine.filter(|record| record.error(p, n, cache.error).is_some()) {
                    assert!(visited.contains(&record.p), "{record:?} at {p}");
                    found += 1;
                }
                assert!(
                    visited.iter().enumerate().all(|(i, p)| !visited[..i].contains(p)),
                    "twice at {p}"
                );
            }
        }
        assert!(found > 300, "{found}");
    }

    /// The radii of neighbours differ by at most their distance, in any order of insertion.
    #[test]
    fn radii_of_neighbours_differ_by_at_most_their_distance() {
        let mut looked = 0;
        full_cache(|cache| {
            let Some((a, others)) = cache.records.split_last() else {
                return;
            };
            let reach = |b: &Record| cache.error * a.radius.max(b.radius);
            let is_near = |b: &&Record| a.n == b.n && a.p.distance(b.p) < NEIGHBOURHOOD * reach(b);
            // Records of the other layer have no influence.
            for b in others.iter().rev().skip(1).step_by(2).filter(is_near) {
                looked += 1;
                assert!((a.radius - b.radius).abs() <= a.p.distance(b.p) * 1.0001, "{a:?} {b:?}");
            }
        });
        assert!(looked > 300, "{looked}");
    }

    /// A linear field of irradiance is interpolated exactly at all points, because the gradients
    /// describe the field.
    #[test]
    fn linear_fields_are_interpolated_exactly() {
        let field = |p: Vec3| 3.0 + p.x - 0.5 * p.y;
        let mut cache = IrradianceCache::new(0.2, BOUNDS);
        let on_plane = |(p, ..): (Vec3, Vec3, f32)| Vec3::new(p.x, p.y, 0.0);
        for p in places(3, 2000).map(on_plane) {
            if !cache.covers(p, Vec3::Z, 0) {
                let gradients = Gradients {
                    translational: [Vec3::new(1.0, -0.5, 0.0); 3],
                    ..Gradients::default()
                };
                let irradiance = Spectrum::splat(field(p));
                cache.insert(
                    Record {
                        gradients,
                        ..record(p, Vec3::Z, 1.0, irradiance)
                    },
                    0,
                );
            }
        }
        assert!(cache.len() < 400, "{}", cache.len());
        let mut known = 0;
        for p in places(4, 500).map(on_plane) {
            if let Some(irradiance) = cache.irradiance(p, Vec3::Z, 0) {
                assert!((irradiance.mean() - field(p)).abs() < 1e-5, "{p}: {irradiance:?}");
                known += 1;
            }
            // No record is valid on the other side, on another plane or in another layer.
            assert_eq!(cache.irradiance(p, Vec3::NEG_Z, 0), None);
            assert_eq!(cache.irradiance(p - 0.5 * Vec3::Z, Vec3::Z, 0), None);
            assert_eq!(cache.irradiance(p, Vec3::Z, 1), None);
        }
        assert!(known > 490, "{known}");
    }

    /// Records with an extreme or invalid radius are not found, and cause no panic.
    #[test]
    fn records_with_invalid_radius_are_ignored() {
        for bounds in [BOUNDS, Bounds3::EMPTY] {
            let mut cache = IrradianceCache::new(1.0, bounds);
            for radius in [0.0, 1e-38, 1e38, f32::INFINITY, f32::NAN] {
                cache.insert(record(Vec3::ZERO, Vec3::Z, radius, Spectrum::ONE), 3);
                cache.insert(record(Vec3::splat(f32::NAN), Vec3::Z, radius, Spectrum::ONE), 3);
            }
            cache.irradiance(Vec3::ONE, Vec3::Z, 3);
            assert_eq!(cache.irradiance(Vec3::ONE, Vec3::Z, u32::MAX), None);
        }
    }
}
