use super::*;

/// A cube from -1 to 1 of six quads.
const CUBE: [[u32; 4]; 6] = [
    [0, 2, 3, 1],
    [4, 5, 7, 6],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
];

fn cube_corners() -> Vec<Vec3> {
    let side = |bit: usize, i: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    (0..8).map(|i| Vec3::new(side(0, i), side(1, i), side(2, i))).collect()
}

/// A square of `n` × `n` quads, or of twice as many triangles, in the plane z = 2x + y/2 + 1.
fn plane(n: u32, is_quads: bool) -> (Vec<Vec3>, Vec<u32>, Vec<u32>) {
    let at = |i: u32| {
        let (x, y) = ((i % (n + 1)) as f32, (i / (n + 1)) as f32);
        Vec3::new(x, y, 2.0 * x + 0.5 * y + 1.0)
    };
    let positions = (0..(n + 1) * (n + 1)).map(at).collect();
    let (mut sizes, mut corners) = (Vec::new(), Vec::new());
    for i in 0..n * n {
        let a = i / n * (n + 1) + i % n;
        let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
        if is_quads {
            sizes.push(4);
            corners.extend([a, b, c, d]);
        } else {
            sizes.extend([3, 3]);
            corners.extend([a, b, c, a, c, d]);
        }
    }
    (positions, sizes, corners)
}

/// An icosahedron around the origin.
fn icosahedron() -> (Vec<Vec3>, Vec<u32>) {
    let golden = 0.5 * (1.0 + 5f32.sqrt());
    let mut positions = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        positions.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    let near = |a: usize, b: usize| (positions[a].distance(positions[b]) - 2.0).abs() < 1e-3;
    let mut corners = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outside = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
                    let is_front = outside.dot(positions[a]) > 0.0;
                    let [b, c] = if is_front { [b, c] } else { [c, b] };
                    corners.extend([a, b, c].map(|i| i as u32));
                }
            }
        }
    }
    (positions, corners)
}

/// Euler characteristic: number of vertices, minus edges, plus faces.
fn euler_characteristic(triangles: &[[u32; 3]]) -> i64 {
    let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    vertices.len() as i64 - edges.len() as i64 + triangles.len() as i64
}

/// Returns true if each side of a triangle is a side of exactly one other triangle, in the opposite
/// direction.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.collect();
    sides.sort_unstable();
    let is_once = sides.windows(2).all(|two| two[0] != two[1]);
    is_once && sides.iter().all(|&[a, b]| sides.binary_search(&[b, a]).is_ok())
}

/// Limit positions of the corners, edges and faces of a cube, computed by hand: one step of
/// subdivision, then the limit masks (Halstead et al. 1993). Further steps must not change these
/// positions.
#[test]
fn cube_matches_closed_forms() {
    let positions = cube_corners();
    let corners = CUBE.as_flattened();
    let mesh = ControlMesh {
        positions: &positions,
        sizes: &[4; 6],
        corners,
        ..ControlMesh::default()
    };
    assert_eq!(mesh.scheme(), Scheme::CatmullClark);
    for steps in 1..=4 {
        let fine = mesh.subdivided(steps);
        assert_eq!(fine.triangles.len() as u64, mesh.triangles(steps));
        assert_eq!(euler_characteristic(&fine.triangles), 2);
        assert!(is_closed(&fine.triangles));
        let has = |expected: Vec3| {
            let place = fine.positions.iter().position(|p| p.distance(expected) < 1e-6);
            assert!(place.is_some(), "{expected} after {steps} steps");
            let normal = fine.normals[place.unwrap()];
            assert!(normal.distance(expected.normalize()) < 1e-6, "{normal} at {expected}");
        };
        // After a step, corners have the coordinates ±5/9 on three axes, edges ±3/4 on two axes,
        // and faces ±1 on one axis. Then apply the limit masks of valence 3, (9 v + 4 Σe + Σf)/24,
        // and of valence 4, (16 v + 4 Σe + Σf)/36:
        let (c, e, f) = (5.0 / 9.0, 0.75, 1.0);
        // Corner: edges are (e, e, 0) in three orders, faces (f, 0, 0)
        let corner = (9.0 * c + 4.0 * 2.0 * e + f) / 24.0;
        // Edge (e, e, 0): neighbours are corners (c, c, ±c), faces (f, 0, 0) and (0, f, 0);
        // diagonals are edges (e, 0, ±e) and (0, e, ±e)
        let edge = (16.0 * e + 4.0 * (2.0 * c + f) + 2.0 * e) / 36.0;
        // Face (f, 0, 0): neighbours are four edges at e, diagonals four corners at c
        let face = (16.0 * f + 4.0 * 4.0 * e + 4.0 * c) / 36.0;
        has(Vec3::splat(corner));
        has(Vec3::new(edge, -edge, 0.0));
        has(Vec3::new(0.0, 0.0, face));
    }
}

/// With Loop's scheme, the vertices of an icosahedron converge to a sphere of known radius.
#[test]
fn icosahedron_matches_closed_form() {
    let (positions, corners) = icosahedron();
    assert_eq!(corners.len(), 60);
    let mesh = ControlMesh {
        positions: &positions,
        sizes: &[3; 20],
        corners: &corners,
        ..ControlMesh::default()
    };
    assert_eq!(mesh.scheme(), Scheme::Loop);
    let fine = mesh.subdivided(3);
    assert_eq!(fine.triangles.len() as u64, mesh.triangles(3));
    assert_eq!(euler_characteristic(&fine.triangles), 2);
    assert!(is_closed(&fine.triangles));
    // Valence 5, β = 3/40: limit (1 − 5χ) v + χ Σe with χ = 1/(5 + 3/(8 β)) = 1/10; the neighbours
    // of an icosahedron's vertex v sum to √5 v.
    let factor = 0.5 + 5f32.sqrt() / 10.0;
    for (p, (limit, normal)) in positions.iter().zip(fine.positions.iter().zip(&fine.normals)) {
        assert!(limit.distance(*p * factor) < 1e-6);
        assert!(normal.distance(p.normalize()) < 1e-6);
    }
}

#[test]
fn planes_stay_planes() {
    for is_quads in [true, false] {
        let (positions, sizes, corners) = plane(4, is_quads);
        let mesh = ControlMesh {
            positions: &positions,
            sizes: &sizes,
            corners: &corners,
            // Two corners of the square belong to two triangles each. Only the crease angle pins
            // these corners
            crease_angle: Some(30.0).filter(|_| !is_quads),
            ..ControlMesh::default()
        };
        let fine = mesh.subdivided(3);
        let normal = Vec3::new(-2.0, -0.5, 1.0).normalize();
        for p in &fine.positions {
            assert!((p.z - (2.0 * p.x + 0.5 * p.y + 1.0)).abs() < 2e-6, "{p}");
        }
        for n in &fine.normals {
            assert!(n.distance(normal) < 1e-6, "{n}");
        }
        // The four corners keep their positions, and the boundary is straight.
        for corner in [0, 4, 20, 24] {
            assert_eq!(fine.positions[corner], positions[corner]);
        }
        let inside = |x: f32| (0.0..=4.0).contains(&x);
        assert!(fine.positions.iter().all(|p| inside(p.x) && inside(p.y)));
        assert_eq!(euler_characteristic(&fine.triangles), 1);
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| fine.positions[i as usize]);
            (b - a).cross(c - a).z as f64 / 2.0
        };
        let sum: f64 = fine.triangles.iter().map(area).sum();
        assert!((sum - 16.0).abs() < 1e-5, "{sum}");
    }
}

/// A mesh of quads, a triangle and a pentagon keeps its Euler characteristic.
#[test]
fn polygons_of_any_size_become_quads() {
    let positions: Vec<Vec3> = (0..5)
        .map(|i| i as f32 * 1.2566)
        .map(|angle| Vec3::new(angle.cos(), angle.sin(), 0.0))
        .chain([Vec3::Z])
        .collect();
    let sizes = [5, 3, 3, 3, 3, 3];
    let corners = [4, 3, 2, 1, 0, 0, 1, 5, 1, 2, 5, 2, 3, 5, 3, 4, 5, 4, 0, 5];
    let mesh = ControlMesh {
        positions: &positions,
        sizes: &sizes,
        corners: &corners,
        ..ControlMesh::default()
    };
    let fine = mesh.subdivided(2);
    assert_eq!(fine.triangles.len(), 20 * 8);
    assert_eq!(euler_characteristic(&fine.triangles), 2);
    assert!(is_closed(&fine.triangles));
    // The normals of the triangles agree with the normals of the limit surface
    for (triangle, normals) in fine.triangles.iter().zip(&fine.normal_triangles) {
        let [a, b, c] = triangle.map(|i| fine.positions[i as usize]);
        let facet = (b - a).cross(c - a).normalize();
        for n in normals.map(|i| fine.normals[i as usize]) {
            assert!(n.dot(facet) > 0.5, "{n} {facet}");
        }
    }
}

/// With sharp edges, a cube stays a cube, with three normals at each corner.
#[test]
fn creases_by_angle_stay_sharp() {
    let positions = cube_corners();
    let mesh = ControlMesh {
        positions: &positions,
        sizes: &[4; 6],
        corners: CUBE.as_flattened(),
        crease_angle: Some(30.0),
        ..ControlMesh::default()
    };
    let fine = mesh.subdivided(3);
    assert!(is_closed(&fine.triangles));
    for (triangle, normals) in fine.triangles.iter().zip(&fine.normal_triangles) {
        let [a, b, c] = triangle.map(|i| fine.positions[i as usize]);
        let facet = (b - a).cross(c - a).normalize();
        assert!(normals.iter().all(|&i| fine.normals[i as usize].distance(facet) < 1e-6));
        // All points lie on the cube, in a regular grid
        for p in [a, b, c] {
            assert_eq!(p.abs().max_element(), 1.0);
            assert_eq!((p * 4.0).fract(), Vec3::ZERO);
        }
    }
}

/// An edge of three faces stays straight, and is counted as irregular.
#[test]
fn edges_that_are_not_manifold_stay_sharp() {
    let positions = [
        Vec3::ZERO,
        Vec3::X,
        Vec3::new(0.0, 1.0, 0.0),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(0.0, -1.0, 0.5),
        Vec3::new(1.0, -1.0, 0.5),
        Vec3::new(0.0, 0.0, 1.0),
        Vec3::new(1.0, 0.0, 1.0),
    ];
    let corners = [0, 1, 3, 2, 1, 0, 4, 5, 0, 1, 7, 6];
    let mesh = ControlMesh {
        positions: &positions,
        sizes: &[4; 3],
        corners: &corners,
        ..ControlMesh::default()
    };
    let fine = mesh.subdivided(3);
    let expected = IrregularEdges {
        non_manifold: 1,
        flipped: 0,
    };
    assert_eq!(fine.irregular, expected);
    for i in 0..=8 {
        let p = Vec3::new(i as f32 / 8.0, 0.0, 0.0);
        assert!(fine.positions.contains(&p), "{p}");
    }
    let flipped = [0, 1, 3, 2, 0, 1, 5, 4];
    let mesh = ControlMesh {
        sizes: &[4; 2],
        corners: &flipped,
        ..mesh
    };
    assert_eq!(mesh.subdivided(1).irregular.flipped, 1);
}

/// Seams of texture coordinates do not move positions, and islands keep their boundaries.
#[test]
fn uv_seams_do_not_move_positions() {
    let positions = cube_corners();
    let plain = ControlMesh {
        positions: &positions,
        sizes: &[4; 6],
        corners: CUBE.as_flattened(),
        ..ControlMesh::default()
    };
    let square = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let uv_corners: Vec<u32> = (0..24).map(|i| i % 4).collect();
    let mesh = ControlMesh {
        uvs: &square,
        uv_corners: &uv_corners,
        ..plain
    };
    let (fine, uvless) = (mesh.subdivided(3), plain.subdivided(3));
    assert_eq!(
        (&fine.positions, &fine.triangles),
        (&uvless.positions, &uvless.triangles)
    );
    assert!(uvless.uv_triangles.is_empty());
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| fine.uvs[i as usize]);
        (b - a).perp_dot(c - a) / 2.0
    };
    for face in fine.uv_triangles.chunks(128) {
        let sum: f32 = face.iter().map(area).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        assert!(face.iter().all(|t| area(t) > 0.0));
    }
    // A face without texture coordinates has none after all steps.
    let mut some = uv_corners.clone();
    some[5] = u32::MAX;
    let fine = ControlMesh {
        uv_corners: &some,
        ..mesh
    }
    .subdivided(2);
    for (i, face) in fine.uv_triangles.chunks(32).enumerate() {
        let has_all = face.iter().flatten().all(|&uv| (uv as usize) < fine.uvs.len());
        assert_eq!(has_all, i != 1);
        assert!(i != 1 || face.iter().flatten().all(|&uv| uv == u32::MAX));
    }
}

/// A mesh with a separate vertex for each corner, as many programs write meshes, has the same
/// surface as with common vertices.
#[test]
fn vertices_at_one_place_are_joined() {
    let positions = cube_corners();
    let split: Vec<Vec3> = CUBE.as_flattened().iter().map(|&i| positions[i as usize]).collect();
    let corners: Vec<u32> = (0..24).collect();
    let mesh = ControlMesh {
        positions: &split,
        sizes: &[4; 6],
        corners: &corners,
        ..ControlMesh::default()
    };
    let fine = mesh.subdivided(2);
    assert!(is_closed(&fine.triangles));
    assert!(
        fine.positions
            .iter()
            .take(24)
            .all(|p| p.max_element() < 1.0 || split.contains(p))
    );
    // Two sheets back to back are not joined, because each joined edge would have four faces.
    let (sheet, sizes, corners) = plane(2, true);
    let two: Vec<Vec3> = sheet.iter().chain(&sheet).copied().collect();
    let back: Vec<u32> = corners.iter().rev().map(|i| i + 9).collect();
    let all: Vec<u32> = corners.iter().copied().chain(back).collect();
    let mesh = ControlMesh {
        positions: &two,
        sizes: &sizes.repeat(2),
        corners: &all,
        ..ControlMesh::default()
    };
    let fine = mesh.subdivided(2);
    assert_eq!(fine.irregular, IrregularEdges::default());
    assert_eq!(euler_characteristic(&fine.triangles), 2);
}

/// Colours are means, and stay in the range of the input.
#[test]
fn colors_are_means() {
    let positions = cube_corners();
    let colors: Vec<[f32; 4]> = positions
        .iter()
        .map(|p| [p.x.max(0.0), p.y.max(0.0), 1.0, 0.5])
        .collect();
    let mesh = ControlMesh {
        positions: &positions,
        colors: &colors,
        sizes: &[4; 6],
        corners: CUBE.as_flattened(),
        ..ControlMesh::default()
    };
    let fine = mesh.subdivided(2);
    assert_eq!(fine.colors.len(), fine.positions.len());
    assert_eq!(fine.colors[..8], colors);
    let in_range = |c: &[f32; 4]| c[..2].iter().all(|c| (0.0..=1.0).contains(c)) && c[2..] == [1.0, 0.5];
    assert!(fine.colors.iter().all(in_range));
}

#[test]
fn invalid_faces_do_not_panic() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let mut state = 1u64;
    let mut random = |n: u64| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) % n
    };
    for round in 0..300 {
        let max_size = if round % 2 == 0 { 1 } else { 4 };
        let sizes: Vec<u32> = (0..1 + random(6)).map(|_| 3 + random(max_size) as u32).collect();
        let total: u32 = sizes.iter().sum();
        let corners: Vec<u32> = (0..total).map(|_| random(5) as u32).collect();
        let uv_corners: Vec<u32> = (0..total).map(|_| random(3) as u32).collect();
        let mesh = ControlMesh {
            positions: &positions,
            uvs: &[Vec2::ZERO, Vec2::X],
            sizes: &sizes,
            corners: &corners,
            uv_corners: &uv_corners,
            crease_angle: Some(40.0).filter(|_| round % 3 == 0),
            ..ControlMesh::default()
        };
        let fine = mesh.subdivided(3);
        assert_eq!(fine.triangles.len() as u64, mesh.triangles(3));
        assert!(fine.positions.iter().chain(&fine.normals).all(|p| p.is_finite()));
    }
}
