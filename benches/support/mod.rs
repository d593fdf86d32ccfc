//! Scenes and rays for several benchmarks.

use embrasure::geometry::{Mesh, PrimId, ray_towards};
use embrasure::material::Material;
use embrasure::math::{Frame, Ray, Vec2, Vec3};
use embrasure::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
use embrasure::sampling::warp::{cosine_hemisphere, uniform_triangle};
use embrasure::scene::{Scene, SceneBuilder};
use embrasure::scene_file::{SceneFile, load_scene};
use std::path::Path;

/// Reproducible random numbers: pair `k` of the item `i`.
pub fn at(i: u32, k: u32) -> Vec2 {
    let mut sampler = Independent::new(1);
    sampler.start(SampleKey::new(i, k, 0));
    sampler.get_2d(Dimension::bounce(0, Bounce::Direction))
}

/// The project's Cornell box if `triangles` is 36, else a bumpy sphere of about `triangles`
/// triangles.
pub fn scene(triangles: u32) -> Scene {
    if triangles == 36 {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
        let file = SceneFile::load(&path).expect("the project's own scene");
        return load_scene(&file, SceneBuilder::new())
            .expect("the project's own scene")
            .scene;
    }
    let n = (triangles as f32 / 2.0).sqrt() as u32;
    let position = |i: u32| {
        let (u, v) = ((i % (n + 1)) as f32 / n as f32, (i / (n + 1)) as f32 / n as f32);
        let (theta, phi) = (std::f32::consts::PI * v, std::f32::consts::TAU * u);
        let bump = 1.0 + 0.1 * (20.0 * theta).sin() * (20.0 * phi).sin();
        bump * Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let quad = |q: u32| {
        let a = q / n * (n + 1) + q % n;
        [[a, a + n + 1, a + 1], [a + 1, a + n + 1, a + n + 2]]
    };
    let mesh = Mesh {
        positions: (0..(n + 1) * (n + 1)).map(position).collect(),
        triangles: (0..n * n).flat_map(quad).collect(),
        ..Mesh::default()
    };
    let mut builder = SceneBuilder::new();
    let material = builder.add_material(Material::default()).expect("a valid material");
    builder.add_mesh(mesh, material).expect("a valid mesh");
    builder.build().expect("a valid scene").0
}

/// Rays that leave random surface points with a cosine distribution, as in path tracing after the
/// first hit.
pub fn bounces(scene: &Scene, n: u32) -> Vec<Ray> {
    let total = scene.triangle_count() as u32;
    let ray = |i: u32| {
        let mut index = (at(i, 0).x * total as f32) as u32 % total;
        let mesh = scene.meshes().iter().find(|mesh| {
            let count = mesh.triangles.len() as u32;
            let inside = index < count;
            index -= if inside { 0 } else { count };
            inside
        });
        let (b1, b2) = uniform_triangle(at(i, 1));
        let point = mesh
            .expect("triangles are counted")
            .surface_point(PrimId(index), b1, b2);
        ray_towards(&point, Frame::from_z(point.ng).to_world(cosine_hemisphere(at(i, 2))))
    };
    (0..n).map(ray).collect()
}
