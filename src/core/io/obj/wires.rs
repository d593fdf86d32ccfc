//! Lines and points of an OBJ file as round tubes and spheres. Both are made of triangles, so that
//! all backends trace the same shapes.
//!
//! The cross-section of a tube is a regular polygon with the area of the circle. Shading normals
//! are the normals of the round tube. Spheres close the ends and the bends of tubes.

use super::Group;
use super::colors::Colors;
use super::groups::{Faces, by_material};
use super::outline::Outline;
use super::parts::MaterialRules;
use super::twins::Twins;
use crate::files::memory::Allowance;
use crate::files::{MemoryLimit, in_words};
use crate::geometry::Mesh;
use crate::io::FileError;
use crate::math::DVec3;
use std::collections::HashSet;
use std::f64::consts::TAU;
use std::path::Path;

/// Number of sides of a tube.
const SIDES: u32 = 16;

/// Maximum number of spheres of 320 triangles. If there are more spheres, all spheres have 80
/// triangles.
const MANY_SPHERES: usize = 20_000;

/// Memory per triangle, including the acceleration structure, in bytes.
const BYTES_OF_TRIANGLE: u64 = 170;

/// Makes tubes and spheres of the diameter `width` for the lines and points of a file. Returns one
/// group for each material and list of rules. Returns an error if the triangles need too much
/// memory.
pub(super) fn add_wires(
    path: &Path,
    outline: &Outline,
    colors: &Colors,
    rules: &MaterialRules,
    width: f32,
    allowance: Allowance,
) -> Result<Vec<Group>, FileError> {
    let groups = by_material(&outline.wires, rules);
    let vertices: u64 = outline.wires.iter().map(|section| section.corner_count() as u64).sum();
    let elements: u64 = outline.wires.iter().map(|section| section.face_count() as u64).sum();
    let sphere = Sphere::new(vertices as usize);
    let triangles = (vertices - elements) * u64::from(2 * SIDES) + vertices * sphere.triangles.len() as u64;
    let bytes = triangles * BYTES_OF_TRIANGLE;
    let total = allowance.kept.saturating_add(bytes);
    let is_over = triangles >= u64::from(u32::MAX) / 3;
    let too_many = is_over.then(|| "more than 32-bit indices can distinguish".to_string());
    if let Some(why) = too_many.or_else(|| MemoryLimit::refusal(allowance.limit, total, bytes)) {
        let message = format!(
            "lines and points become {triangles} triangles, which take about {}: {why}",
            in_words(bytes)
        );
        return Err(
            FileError::new(path, message).help("leave some lines and points out, or render without --line-width")
        );
    }
    let builder = WireBuilder {
        outline,
        colors,
        sphere,
        radius: 0.5 * f64::from(width),
    };
    Ok(groups.into_iter().map(|faces| builder.group(faces, rules)).collect())
}

/// A unit sphere of triangles.
struct Sphere {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Sphere {
    /// Creates a sphere from an icosahedron whose faces are divided into four, twice. If the number
    /// of spheres `count` is above [`MANY_SPHERES`], they are divided only once.
    fn new(count: usize) -> Self {
        let golden = 0.5 * (1.0 + 5f64.sqrt());
        let mut points = Vec::new();
        for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            points.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
        }
        let points: Vec<DVec3> = points.into_iter().map(DVec3::normalize).collect();
        // Edges of the icosahedron have the length 1.05. All other distances between corners are
        // larger
        let is_near = |a: usize, b: usize| points[a].distance(points[b]) < 1.1;
        let mut triangles = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    if is_near(a, b) && is_near(b, c) && is_near(a, c) {
                        triangles.push([a, b, c].map(|i| i as u32));
                    }
                }
            }
        }
        let mut sphere = Self { points, triangles };
        for _ in 0..if count > MANY_SPHERES { 1 } else { 2 } {
            sphere.divide();
        }
        for triangle in &mut sphere.triangles {
            let [a, b, c] = triangle.map(|i| sphere.points[i as usize]);
            if (b - a).cross(c - a).dot(a) < 0.0 {
                triangle.swap(1, 2);
            }
        }
        sphere
    }

    fn divide(&mut self) {
        let mut middles: Vec<([u32; 2], u32)> = Vec::new();
        let mut fine = Vec::with_capacity(4 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]| {
                let key = [a.min(b), a.max(b)];
                if let Some(&(_, known)) = middles.iter().find(|(known, _)| *known == key) {
                    return known;
                }
                let new = self.points.len() as u32;
                let middle = self.points[a as usize] + self.points[b as usize];
                self.points.push(middle.normalize());
                middles.push((key, new));
                new
            });
            fine.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        self.triangles = fine;
    }
}

struct WireBuilder<'a> {
    outline: &'a Outline,
    colors: &'a Colors,
    sphere: Sphere,
    radius: f64,
}

impl WireBuilder<'_> {
    /// Tubes and spheres of the lines and points of one material.
    fn group(&self, faces: Faces, rules: &MaterialRules) -> Group {
        let (mut mesh, mut parts) = (Mesh::default(), Vec::new());
        let mut has_sphere: HashSet<u32> = HashSet::new();
        for run in &faces.runs {
            let section = &self.outline.wires[run.section];
            for (corners, part) in section.faces(&run.faces).zip(section.parts(&run.faces)) {
                let vertices = section.positions(corners);
                for pair in vertices.windows(2) {
                    self.add_tube(&mut mesh, [pair[0], pair[1]]);
                }
                for &vertex in vertices {
                    if has_sphere.insert(vertex) {
                        self.add_sphere(&mut mesh, vertex);
                    }
                }
                parts.resize(mesh.triangles.len(), part);
            }
        }
        mesh.set_parts(parts);
        Group {
            rules: rules.list(faces.rules).to_vec(),
            material: faces.material,
            line: faces.line,
            mesh,
            twins: Twins::default(),
        }
    }

    fn position(&self, vertex: u32) -> DVec3 {
        self.outline.vertices.positions[vertex as usize].as_dvec3()
    }

    /// Adds a vertex to `mesh`, at `offset` from the vertex `vertex` of the file and with its
    /// colour.
    fn add_point(&self, mesh: &mut Mesh, vertex: u32, offset: DVec3, normal: DVec3) {
        mesh.positions.push((self.position(vertex) + offset).as_vec3a());
        mesh.normals.push(normal.as_vec3a());
        mesh.colors.extend(self.colors.rgb.get(vertex as usize));
        mesh.alphas.extend(self.colors.alpha.get(vertex as usize));
    }

    fn add_sphere(&self, mesh: &mut Mesh, vertex: u32) {
        let first = mesh.positions.len() as u32;
        for &normal in &self.sphere.points {
            self.add_point(mesh, vertex, normal * self.radius, normal);
        }
        let moved = self.sphere.triangles.iter().map(|t| t.map(|i| first + i));
        mesh.triangles.extend(moved);
    }

    fn add_tube(&self, mesh: &mut Mesh, ends: [u32; 2]) {
        let [a, b] = ends.map(|vertex| self.position(vertex));
        let Some(axis) = (b - a).try_normalize() else {
            return;
        };
        let (x, y) = axis.any_orthonormal_pair();
        // A polygon with the area of the circle
        let angle = TAU / f64::from(SIDES);
        let radius = self.radius * (angle / angle.sin()).sqrt();
        let first = mesh.positions.len() as u32;
        for i in 0..SIDES {
            let (sin, cos) = (angle * f64::from(i)).sin_cos();
            let normal = x * cos + y * sin;
            for vertex in ends {
                self.add_point(mesh, vertex, normal * radius, normal);
            }
        }
        for i in 0..SIDES {
            let [a, c] = [i, (i + 1) % SIDES].map(|i| first + 2 * i);
            let [b, d] = [a + 1, c + 1];
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{PrimId, triangle_area, triangle_normal};
    use crate::io::load_obj::load_obj;
    use crate::io::{Findings, LoadOptions};
    use crate::math::Vec3;
    use std::f64::consts::PI;
    use std::fs;

    fn groups(text: &str, width: Option<f32>) -> Result<Vec<Group>, FileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        fs::write(&path, text).unwrap();
        let mut options = LoadOptions::default();
        options.parameters.line_width = width;
        let file = load_obj(&path, &options, Allowance::of_system(), &(), &mut Findings::default())?;
        Ok(file.groups)
    }

    /// Bounds of a mesh.
    fn extent(mesh: &Mesh) -> [Vec3; 2] {
        let min = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let max = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        [min, max]
    }

    fn area(mesh: &Mesh) -> f64 {
        let prims = (0..mesh.triangles.len() as u32).map(PrimId);
        let areas = prims.map(|prim| {
            let [a, b, c] = mesh.corners(prim);
            triangle_area(a, b, c)
        });
        areas.sum()
    }

    #[test]
    fn points_are_spheres_and_lines_are_tubes() {
        let text = "v 1 2 3\nv 1 2 13\nusemtl a\np 1\nusemtl b\nl 1 2 -1\n";
        let groups = groups(text, Some(2.0)).unwrap();
        let names: Vec<Option<&str>> = groups.iter().map(|group| group.material.as_deref()).collect();
        assert_eq!(names, [Some("a"), Some("b")]);
        let [point, line] = [&groups[0].mesh, &groups[1].mesh];
        assert!((area(point) / (4.0 * PI) - 1.0).abs() < 0.03, "{}", area(point));
        let whole = 2.0 * PI * 10.0 + 8.0 * PI;
        assert!((area(line) / whole - 1.0).abs() < 0.03, "{}", area(line));
        let near = |a: Vec3, b: Vec3| a.distance(b) < 0.06;
        let [min, max] = extent(line);
        assert!(
            near(min, Vec3::new(0.0, 1.0, 2.0)) && near(max, Vec3::new(2.0, 3.0, 14.0)),
            "{min} {max}"
        );
        for mesh in [point, line] {
            for prim in (0..mesh.triangles.len() as u32).map(PrimId) {
                let [a, b, c] = mesh.corners(prim);
                let facet = triangle_normal(a, b, c);
                for n in mesh.normals_at(prim, 0.0).unwrap() {
                    assert!(n.dot(facet) > 0.9, "{n} {facet}");
                }
            }
        }
    }

    #[test]
    fn wires_keep_parts_and_colors() {
        let text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\no face\nf 1 2 3\no wire\nl 1 2\ng dots\np 3\n";
        let groups = groups(text, Some(0.1)).unwrap();
        assert_eq!(groups.len(), 2);
        let (faces, wires) = (&groups[0].mesh, &groups[1].mesh);
        assert_eq!(faces.triangles.len(), 1);
        assert_eq!(wires.colors.len(), wires.positions.len());
        let parts: Vec<u32> = (0..wires.triangles.len() as u32)
            .map(|i| wires.part(PrimId(i)))
            .collect();
        let (first, last) = (parts[0], parts[parts.len() - 1]);
        assert!(first != last && first != faces.part(PrimId(0)));
        assert!(parts.iter().all(|&part| part == first || part == last));
    }

    #[test]
    fn wrong_elements_are_left_out() {
        assert!(groups("v 0 0 0\nv 1 0 0\nl 1 2\n", None).is_err());
        let left = groups("v 0 0 0\nv 1 0 0\nl 1\nl 1 9\nl\np\np x\nl 1 1\nl 1/7 2/8\n", Some(1.0)).unwrap();
        // A line of length 0 is a sphere.
        assert_eq!(left[0].mesh.triangles.len(), 2 * 320 + 2 * SIDES as usize);
    }

    #[test]
    fn many_spheres_are_coarser() {
        assert_eq!(Sphere::new(1).triangles.len(), 320);
        assert_eq!(Sphere::new(1).points.len(), 162);
        assert_eq!(Sphere::new(30_000).triangles.len(), 80);
    }
}
