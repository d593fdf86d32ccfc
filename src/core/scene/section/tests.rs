use super::super::{BuildError, Scene, SceneBuilder};
use super::*;
use crate::geometry::PrimId;
use crate::material::Material;
use crate::math::{Affine3A, DVec3};
use half::f16;
use std::f64::consts::{PI, TAU};

const SEGMENTS: u32 = 96;

/// A sphere made of rings of latitude and longitude, with normals and texture coordinates.
fn sphere(center: Vec3, radius: f32) -> Mesh {
    let mut mesh = Mesh::default();
    let rings = SEGMENTS / 2;
    for ring in 0..=rings {
        let (sin, cos) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        for i in 0..SEGMENTS {
            // Vertices of a pole coincide.
            let sin = if ring == 0 || ring == rings { 0.0 } else { sin };
            let (s, c) = (TAU * f64::from(i) / f64::from(SEGMENTS)).sin_cos();
            let n = DVec3::new(sin * c, sin * s, cos).as_vec3a();
            mesh.positions.push(center + radius * n);
            mesh.normals.push(n);
            mesh.uvs.push(Vec2::new(n.x, n.z));
            mesh.colors.push([f16::from_f32(0.5 * (1.0 + n.z)); 3]);
        }
    }
    for ring in 0..rings {
        for i in 0..SEGMENTS {
            let at = |ring: u32, i: u32| ring * SEGMENTS + i % SEGMENTS;
            let [a, b, c, d] = [at(ring, i), at(ring + 1, i), at(ring + 1, i + 1), at(ring, i + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// An axis-aligned box, with its faces turned inwards if `is_hollow`.
fn cuboid(min: Vec3, max: Vec3, is_hollow: bool) -> Mesh {
    let corner = |i: u32| {
        let pick = |bit: u32, axis: usize| if i >> bit & 1 == 0 { min[axis] } else { max[axis] };
        Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
    };
    let quads: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: triangles
            .map(|[a, b, c]| if is_hollow { [a, c, b] } else { [a, b, c] })
            .collect(),
        ..Mesh::default()
    }
}

fn plane(normal: [f64; 3], offset: f64) -> SectionPlane {
    let normal = DVec3::from(normal).normalize();
    SectionPlane::new(normal, offset * normal).unwrap()
}

/// The scene of `meshes` in one object after a cut by `plane`, and the report of the section.
fn cut(meshes: Vec<Mesh>, plane: &SectionPlane) -> (Scene, SectionReport) {
    let mut builder = SceneBuilder::new();
    let [body, cap] = ["body", "cap"].map(|name| {
        let material = Material {
            name: name.into(),
            ..Material::default()
        };
        builder.add_material(material).unwrap()
    });
    builder.begin_object("thing");
    for mesh in meshes {
        builder.add_mesh(mesh, body).unwrap();
    }
    let report = builder.cut(plane, Some(cap), CutLight::Cut).unwrap();
    (builder.build().unwrap().0, report)
}

/// Volume that all triangles enclose, and area of the triangles of material 1, the caps.
fn measures(scene: &Scene) -> (f64, f64) {
    let (mut volume, mut area) = (0.0, 0.0);
    for geom in scene.geom_ids() {
        let mesh = scene.mesh(geom);
        for prim in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(PrimId(prim)).map(Vec3::as_dvec3);
            volume += a.dot(b.cross(c)) / 6.0;
            if scene.shape(geom).material == MaterialId(1) {
                area += 0.5 * (b - a).cross(c - a).length();
            }
        }
    }
    (volume, area)
}

#[test]
fn sphere_caps_are_circles_and_halves_sum_to_the_whole() {
    let center = Vec3::new(0.3, -0.2, 0.7);
    let (whole, _) = cut(vec![sphere(center, 2.0)], &plane([0.0, 0.0, 1.0], 100.0));
    let (volume, no_cap) = measures(&whole);
    assert_eq!(no_cap, 0.0);
    // The section of the mesh is a polygon of n corners on a circle. The polygon has the fraction
    // sin(2π/n) / (2π/n) of the circle's area.
    for (normal, h) in [([0.0, 0.0, 1.0], 0.5), ([0.0, 1.0, 0.0], 1.1), ([1.0, 2.0, -0.5], -0.8)] {
        let through = DVec3::from(normal).normalize().dot(center.as_dvec3());
        let [below, above] = [1.0, -1.0].map(|side| {
            let (scene, report) = cut(
                vec![sphere(center, 2.0)],
                &plane(normal.map(|x| side * x), side * (through + h)),
            );
            assert_eq!(report, SectionReport::default());
            measures(&scene)
        });
        assert!(
            (below.0 + above.0 - volume).abs() < 1e-5 * volume,
            "{below:?} {above:?} {volume}"
        );
        let cap = PI * (4.0 - h * h);
        for area in [below.1, above.1] {
            assert!((area / cap - 1.0).abs() < 4e-3, "{normal:?}: {area}, not {cap}");
        }
        // Volume of a sphere below a plane at height h: π (2r³/3 + r² h − h³/3)
        let expected = PI * (16.0 / 3.0 + 4.0 * h - h * h * h / 3.0);
        assert!((below.0 / expected - 1.0).abs() < 4e-3, "{} {expected}", below.0);
    }
}

#[test]
fn clipped_vertices_have_interpolated_attributes() {
    let (scene, _) = cut(vec![sphere(Vec3::ZERO, 1.0)], &plane([1.0, 0.3, 0.2], 0.4));
    let mut checked = 0;
    for geom in scene
        .geom_ids()
        .filter(|&geom| scene.shape(geom).material == MaterialId(0))
    {
        let mesh = scene.mesh(geom);
        for (i, p) in mesh.positions.iter().enumerate() {
            let n = mesh.normals[i];
            assert!((n.length() - 1.0).abs() < 1e-5 && n.distance(*p) < 3e-3, "{n} {p}");
            assert!(mesh.uvs[i].distance(Vec2::new(p.x, p.z)) < 3e-3);
            assert!((mesh.colors[i][0].to_f32() - 0.5 * (1.0 + p.z)).abs() < 3e-3);
            checked += 1;
        }
    }
    assert!(checked > 1000);
}

/// Cuts of a room with walls of thickness 0.5, of overlapping solids, and of a solid in a hollow.
#[test]
fn hollows_have_no_cap_and_overlapping_solids_have_one() {
    let v = |x: f32| Vec3::splat(x);
    for (meshes, area) in [
        (
            vec![cuboid(v(-2.0), v(2.0), false), cuboid(v(-1.5), v(1.5), true)],
            16.0 - 9.0,
        ),
        (
            vec![
                cuboid(v(-2.0), v(2.0), false),
                cuboid(Vec3::new(1.0, -1.0, -3.0), Vec3::new(3.0, 1.0, 3.0), false),
            ],
            16.0 + 2.0,
        ),
        (
            vec![
                cuboid(v(-2.0), v(2.0), false),
                cuboid(v(-1.5), v(1.5), true),
                cuboid(v(-1.0), v(1.0), false),
            ],
            16.0 - 9.0 + 4.0,
        ),
        // A solid in a room whose walls have no thickness
        (vec![cuboid(v(-2.0), v(2.0), true), cuboid(v(-1.0), v(1.0), false)], 4.0),
    ] {
        for normal in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]] {
            let offset = if normal[1] == 0.0 { 0.25 } else { 0.9 };
            let (scene, report) = cut(meshes.clone(), &plane(normal, offset));
            assert_eq!(report.open, []);
            assert_eq!(report.inward, u64::from(area == 4.0));
            let along_x = normal[0] != 0.0;
            let (_, found) = measures(&scene);
            if !(along_x || normal[1] != 0.0) {
                assert!((found - area).abs() < 1e-5, "{normal:?}: {found}, not {area}");
            }
        }
    }
}

/// If faces have random windings, the even-odd rule fills the outline.
#[test]
fn surfaces_with_mixed_windings_have_caps() {
    let mut mesh = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), false);
    for i in [4, 5, 9] {
        mesh.triangles[i].swap(0, 1);
    }
    let (scene, report) = cut(vec![mesh], &plane([0.0, 0.0, 1.0], 0.3));
    assert_eq!(report.open, []);
    assert!((measures(&scene).1 - 4.0).abs() < 1e-6);
}

#[test]
fn open_surfaces_are_reported_and_have_no_cap() {
    let mut mesh = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), false);
    // Leave out the side x = 1
    mesh.triangles.truncate(10);
    let sheet = Mesh {
        positions: [[4.0, 0.0, -1.0], [5.0, 0.0, -1.0], [4.0, 0.0, 1.0]]
            .map(Vec3::from)
            .to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let solid = cuboid(Vec3::new(-5.0, -1.0, -1.0), Vec3::new(-3.0, 1.0, 1.0), false);
    let (scene, report) = cut(vec![mesh, sheet, solid], &plane([0.0, 0.0, 1.0], 0.3));
    assert_eq!(report.open.len(), 1);
    assert_eq!(report.open[0].name, "thing");
    assert!((f64::from(report.open[0].place.z) - 0.3).abs() < 1e-6);
    assert!((measures(&scene).1 - 4.0).abs() < 1e-6);
}

/// Three planes cut a sphere one after the other. The remaining surface is closed.
#[test]
fn several_sections_leave_closed_surfaces() {
    let mut builder = SceneBuilder::new();
    let material = builder.add_material(Material::default()).unwrap();
    builder.add_mesh(sphere(Vec3::ZERO, 1.0), material).unwrap();
    for (normal, offset) in [([0.0, 0.0, 1.0], 0.1), ([0.3, 1.0, 0.2], 0.15), ([1.0, 0.1, 0.0], 0.3)] {
        let report = builder
            .cut(&plane(normal, offset), Some(material), CutLight::Cut)
            .unwrap();
        assert_eq!(report.open, [], "{normal:?}");
    }
    let (scene, _) = builder.build().unwrap();
    // Area vectors of a closed surface sum to zero.
    let mut sum = DVec3::ZERO;
    for geom in scene.geom_ids() {
        let mesh = scene.mesh(geom);
        for prim in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(PrimId(prim)).map(Vec3::as_dvec3);
            sum += 0.5 * (b - a).cross(c - a);
        }
    }
    assert!(sum.length() < 1e-5, "{sum}");
}

/// Faces that lie in the plane are removed, and the cap replaces these faces.
#[test]
fn faces_in_the_plane_are_replaced_by_the_cap() {
    let solid = || cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), false);
    let (scene, report) = cut(vec![solid()], &plane([0.0, 0.0, 1.0], 1.0));
    assert_eq!(report, SectionReport::default());
    let (volume, area) = measures(&scene);
    assert!((volume - 8.0).abs() < 1e-6 && (area - 4.0).abs() < 1e-6);
    let (_, report) = cut(vec![solid()], &plane([0.0, 0.0, -1.0], -1.0));
    assert!(report.removes_all);
    let (_, report) = cut(vec![solid()], &plane([0.0, 0.0, 1.0], 1.5));
    assert!(report.keeps_all && !report.removes_all);
}

/// Instances that the plane crosses are cut in place. Moving instances are an error.
#[test]
fn crossed_instances_are_cut_unless_they_move() {
    let mut builder = SceneBuilder::new();
    let [body, cap] = [0, 1].map(|_| builder.add_material(Material::default()).unwrap());
    builder.begin_object("box");
    let solid = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), false);
    let prototype = builder.add_prototype(vec![(solid, body)]).unwrap();
    let at = |z: f32| Affine3A::from_translation(Vec3::new(3.0 * z, 0.0, z).into());
    for z in [0.0, 0.5, 4.0, -4.0] {
        builder.add_instance(prototype, Placement::Still(at(z))).unwrap();
    }
    let report = builder
        .cut(&plane([0.0, 0.0, 1.0], 0.25), Some(cap), CutLight::Cut)
        .unwrap();
    assert_eq!(report, SectionReport::default());
    let moving = Placement::Moving([at(-4.0), at(4.0)].into());
    builder.add_instance(prototype, moving).unwrap();
    let error = builder
        .cut(&plane([0.0, 0.0, 1.0], 0.2), Some(cap), CutLight::Cut)
        .unwrap_err();
    assert_eq!(error, BuildError::MovesAcrossSection { object: "box".into() });
    builder.instances.pop();
    builder.instance_objects.pop();
}

/// With [`CutLight::Whole`], light hits every triangle of the whole scene. Camera rays hit only the
/// remaining triangles and the caps.
#[test]
fn light_hits_both_halves_and_camera_rays_one_half() {
    let mut builder = SceneBuilder::new();
    let [body, cap] = [0, 1].map(|_| builder.add_material(Material::default()).unwrap());
    let center = Vec3::new(0.3, -0.2, 0.7);
    builder.add_mesh(sphere(center, 2.0), body).unwrap();
    let solid = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), false);
    let prototype = builder.add_prototype(vec![(solid, body)]).unwrap();
    for z in [-6.0, 6.0] {
        let place = Affine3A::from_translation(Vec3::new(0.0, 0.0, z).into());
        builder.add_instance(prototype, Placement::Still(place)).unwrap();
    }
    for (normal, offset) in [([0.0, 0.0, 1.0], 1.0), ([0.0, 1.0, 0.3], 0.8)] {
        let report = builder.cut(&plane(normal, offset), Some(cap), CutLight::Whole).unwrap();
        assert_eq!(report.open, []);
    }
    let (scene, _) = builder.build().unwrap();
    assert!(scene.hides_from_camera() && scene.lets_light_pass());
    let [mut seen, mut lit] = [0.0; 2];
    for geom in scene.geom_ids().take(scene.world_meshes().len()) {
        let (mesh, material) = (
            scene.mesh(geom),
            &scene.materials()[scene.shape(geom).material.0 as usize],
        );
        assert!(material.camera_visible || material.light_visible);
        for prim in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(PrimId(prim)).map(Vec3::as_dvec3);
            let volume = a.dot(b.cross(c)) / 6.0;
            seen += if material.camera_visible { volume } else { 0.0 };
            lit += if material.light_visible { volume } else { 0.0 };
        }
    }
    let (whole, _) = measures(&cut(vec![sphere(center, 2.0)], &plane([0.0, 0.0, 1.0], 100.0)).0);
    assert!((lit - whole).abs() < 1e-5 * whole, "{lit} {whole}");
    assert!(seen < 0.8 * whole && seen > 0.2 * whole, "{seen} {whole}");
}
