use super::*;
use crate::color::Spectrum;
use crate::geometry::Placement;
use crate::material::Gloss;
use crate::math::{Affine3A, Quat, Vec3};
use crate::scene::{Scene, SceneBuilder};

fn glass() -> Material {
    Material {
        name: "g".into(),
        transmission: Spectrum::rgb(0.9, 1.0, 0.5),
        ..Material::default()
    }
}

/// The solid between `outline` at z = 0 and the same outline at z = −thickness. The outline is
/// counter-clockwise as seen from +z.
fn prism(outline: &[[f32; 2]], thickness: f32) -> Mesh {
    let n = outline.len() as u32;
    let at = |z: f32| outline.iter().map(move |[x, y]| Vec3::new(*x, *y, z));
    let fan = (1..n - 1).flat_map(|i| [[0, i, i + 1], [n, n + i + 1, n + i]]);
    let sides = (0..n).flat_map(|i| {
        let j = (i + 1) % n;
        [[i, n + i, n + j], [i, n + j, j]]
    });
    Mesh {
        positions: at(0.0).chain(at(-thickness)).collect(),
        triangles: fan.chain(sides).collect(),
        ..Mesh::default()
    }
}

fn rectangle(width: f32, height: f32) -> Vec<[f32; 2]> {
    let [x, y] = [0.5 * width, 0.5 * height];
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}

/// A window of 1 by 1.5 units with a thickness of 6 mm.
fn window() -> Mesh {
    prism(&rectangle(1.0, 1.5), 0.006)
}

/// The mesh with separate vertices for each triangle.
fn unwelded(mesh: &Mesh) -> Mesh {
    let corners = mesh.triangles.iter().flatten();
    Mesh {
        positions: corners.map(|&i| mesh.positions[i as usize]).collect(),
        triangles: (0..mesh.triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        ..Mesh::default()
    }
}

fn moved(mut mesh: Mesh, transform: Affine3A) -> Mesh {
    mesh.positions
        .iter_mut()
        .for_each(|p| *p = transform.transform_point3a(*p));
    mesh
}

fn turned() -> Affine3A {
    let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(-0.4);
    Affine3A::from_rotation_translation(turn, Vec3::new(3.0, 1.0, -2.0).into())
}

fn joined(meshes: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    for mesh in meshes {
        let first = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.triangles
            .extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    all
}

/// `mesh` with only the triangles for whose index `keeps` returns true.
fn only(mut mesh: Mesh, keeps: impl Fn(usize) -> bool) -> Mesh {
    let mut i = 0;
    mesh.triangles.retain(|_| {
        i += 1;
        keeps(i - 1)
    });
    mesh
}

fn inside_out(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// Builds the scene of a room of 10 by 10 by 10 units that contains `mesh`, made of `material`.
/// Returns the scene and its number of panes.
fn frozen(mesh: Mesh, material: Material, panes: Panes) -> (Scene, u64) {
    let mut b = SceneBuilder::new();
    b.panes(panes);
    let [glass, wall] = [material, Material::default()].map(|m| b.add_material(m).unwrap());
    b.add_mesh(prism(&rectangle(10.0, 10.0), 10.0), wall).unwrap();
    b.add_mesh(mesh, glass).unwrap();
    let (scene, report) = b.build().unwrap();
    (scene, report.panes)
}

fn count(mesh: Mesh) -> u64 {
    frozen(mesh, glass(), Panes::Straight).1
}

#[test]
fn flat_slabs_are_panes() {
    let window = window();
    let octagon: Vec<[f32; 2]> = (0..8)
        .map(|i| (i as f32 * 0.25 * std::f32::consts::PI).sin_cos())
        .map(|(y, x)| [x, y])
        .collect();
    // A slanted pane, as in the balustrade of a stair
    let slanted = [[0.0, 0.0], [3.0, 1.5], [3.0, 2.5], [0.0, 1.0]];
    for (what, mesh, expected) in [
        ("window", window.clone(), 1),
        ("turned", moved(window.clone(), turned()), 1),
        ("unwelded", unwelded(&moved(window.clone(), turned())), 1),
        ("octagon", prism(&octagon, 0.02), 1),
        ("slanted", prism(&slanted, 0.02), 1),
        ("two", joined(&[window.clone(), moved(window.clone(), turned())]), 2),
        ("two faces without a rim", only(window.clone(), |i| i < 4), 1),
        (
            "one face of two triangles",
            only(window.clone(), |i| matches!(i, 0 | 2)),
            0,
        ),
    ] {
        assert_eq!(count(mesh), expected, "{what}");
    }
}

#[test]
fn solid_bodies_are_not_panes() {
    let window = window();
    let front = only(window.clone(), |i| matches!(i, 0 | 2));
    let behind = Affine3A::from_translation((Vec3::Z * -0.006).into());
    let same_way = joined(&[front.clone(), moved(front, behind)]);
    let mut wedge = window.clone();
    wedge.positions[0].z += 0.003;
    wedge.positions[3].z += 0.003;
    // A hollow box that is open at the top
    let aquarium = joined(&[
        only(prism(&rectangle(1.0, 0.6), 0.5), |i| i != 0 && i != 2),
        inside_out(only(prism(&rectangle(0.98, 0.58), 0.49), |i| i != 0 && i != 2)),
    ]);
    let sheared = Mesh {
        normals: (0..8)
            .map(|i| Vec3::new(0.6, 0.0, if i < 4 { 0.8 } else { -0.8 }))
            .collect(),
        ..window.clone()
    };
    let deforming = Mesh {
        positions_close: window.positions.iter().map(|p| *p + Vec3::X).collect(),
        ..window.clone()
    };
    for (what, mesh) in [
        ("a thick table", prism(&rectangle(1.0, 0.6), 0.04)),
        ("a slab too thick for the room", prism(&rectangle(8.0, 8.0), 0.2)),
        ("a tumbler's wall", prism(&rectangle(0.05, 0.05), 0.006)),
        ("inside out", inside_out(window.clone())),
        ("a slab with a gap in its rim", only(window.clone(), |i| i != 7)),
        ("a slab of which one face is open", only(window.clone(), |i| i != 1)),
        ("a wedge", wedge),
        ("an aquarium", aquarium),
        ("two faces that look the same way", same_way),
        (
            "two faces that look at each other",
            inside_out(only(window.clone(), |i| i < 4)),
        ),
        ("smoothed as if it were round", sheared),
        ("what deforms", deforming),
        ("a block", prism(&rectangle(1.0, 1.0), 1.0)),
    ] {
        assert_eq!(count(mesh), 0, "{what}");
    }
}

#[test]
fn only_clear_glass_makes_panes() {
    type Change = (&'static str, fn(&mut Material));
    let changes: [Change; 6] = [
        ("rough", |m| m.roughness = 0.5),
        ("diffuse", |m| m.diffuse = Spectrum::splat(0.1)),
        ("alpha", |m| m.opacity = 0.5),
        ("emission", |m| m.emission = Spectrum::ONE),
        ("mirror", |m| {
            (m.specular, m.gloss) = (Spectrum::splat(0.1), Gloss::Mirror(crate::bsdf::Fresnel::Full))
        }),
        ("thin", |m| m.thin = true),
    ];
    assert_eq!(frozen(window(), glass(), Panes::Straight).1, 1);
    for (what, change) in changes {
        let mut material = glass();
        change(&mut material);
        assert_eq!(frozen(window(), material, Panes::Straight).1, 0, "{what}");
    }
    assert_eq!(frozen(window(), glass(), Panes::Refract).1, 0);
}

#[test]
fn pane_becomes_one_face_in_its_middle() {
    let ball = moved(prism(&rectangle(0.3, 0.3), 0.3), turned());
    let (scene, panes) = frozen(joined(&[window(), ball]), glass(), Panes::Straight);
    assert!(panes == 1 && scene.has_thin_surfaces());
    // Expect the room, the unchanged block, and the pane
    assert_eq!(scene.meshes().len(), 3);
    assert_eq!(scene.meshes()[1].triangles.len(), 12);
    let flat = &scene.meshes()[2];
    assert_eq!((flat.triangles.len(), flat.positions.len()), (2, 4));
    assert!(flat.positions.iter().all(|p| (p.z + 0.003).abs() < 1e-7));
    let material = &scene.materials()[scene.shape(crate::geometry::GeomId(2)).material.0 as usize];
    assert_eq!(
        (material.name.as_str(), material.thin, material.ior),
        ("g (pane)", true, 1.5)
    );
    // Light passes two faces, so the transmission is squared.
    let squared = Spectrum::rgb(0.9 * 0.9, 1.0, 0.25);
    assert_eq!(material.transmission, squared);
    let refracting = frozen(window(), glass(), Panes::Refract).0;
    assert!(!refracting.has_thin_surfaces());
    assert_eq!(refracting.meshes()[1].triangles.len(), 12);
}

/// The thickness of panes in instances is measured in world space.
#[test]
fn panes_of_instances_are_measured_in_world_space() {
    let window = prism(&rectangle(1.0, 1.5), 0.03);
    for (scale, expected) in [(1.0, 1), (2.0, 1), (10.0, 0)] {
        let mut b = SceneBuilder::new();
        let glass = b.add_material(glass()).unwrap();
        let wall = b.add_material(Material::default()).unwrap();
        b.add_mesh(prism(&rectangle(10.0, 10.0), 10.0), wall).unwrap();
        let prototype = b.add_prototype(vec![(window.clone(), glass)]).unwrap();
        for x in [0.0, 3.0] {
            let (size, to) = (Vec3::splat(scale), Vec3::new(x, 0.0, 0.0));
            let place = Affine3A::from_scale_rotation_translation(size.into(), Quat::IDENTITY, to.into());
            b.add_instance(prototype, Placement::Still(place)).unwrap();
        }
        let (scene, report) = b.build().unwrap();
        assert_eq!(
            (report.panes, scene.has_thin_surfaces()),
            (expected, expected > 0),
            "{scale}"
        );
    }
}
