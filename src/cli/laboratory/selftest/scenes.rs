//! Scenes of the cases, made in code.

use crate::camera::CameraParameters;
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::material::Material;
use crate::math::Vec3;
use crate::scene::{BuildError, Scene, SceneBuilder};

/// A scene and its camera.
pub(super) type SceneView = (Scene, CameraParameters);

/// A pinhole camera.
pub(super) fn camera(position: Vec3, look_at: Vec3, vertical_fov: f32) -> CameraParameters {
    CameraParameters {
        position,
        look_at,
        up: Vec3::Y,
        vertical_fov,
        lens_radius: 0.0,
        focus_distance: 1.0,
    }
}

/// A matte surface with `reflectance` and emitted `radiance`.
pub(super) fn matte(reflectance: f32, radiance: f32) -> Material {
    Material {
        diffuse: Spectrum::splat(reflectance),
        emission: Spectrum::splat(radiance),
        ..Material::default()
    }
}

/// Clear glass of index 1.5.
pub(super) fn glass() -> Material {
    Material {
        transmission: Spectrum::ONE,
        ..Material::default()
    }
}

/// A box whose front faces are outside.
pub(super) fn block(center: Vec3, half: Vec3) -> Mesh {
    let sign = |bit: usize| if bit & 1 == 1 { 1.0 } else { -1.0 };
    let corner = |i: usize| center + half * Vec3::new(sign(i), sign(i >> 1), sign(i >> 2));
    let quads: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    }
}

/// A room from -1 to 1 whose front faces are inside.
pub(super) fn room() -> Mesh {
    let mut mesh = block(Vec3::ZERO, Vec3::ONE);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// A quad. Seen from the front, its corners run counter-clockwise.
pub(super) fn quad(corners: [Vec3; 4]) -> Mesh {
    Mesh {
        positions: corners.into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A scene of meshes with materials, and lights added by `light`.
pub(super) fn scene(
    parts: impl IntoIterator<Item = (Mesh, Material)>,
    light: impl FnOnce(&mut SceneBuilder) -> Result<(), BuildError>,
) -> Result<Scene, BuildError> {
    let mut builder = SceneBuilder::new();
    for (mesh, material) in parts {
        let id = builder.add_material(material)?;
        builder.add_mesh(mesh, id)?;
    }
    light(&mut builder)?;
    Ok(builder.build()?.0)
}

/// A closed room whose walls reflect half the light and emit 1.
pub(super) fn glowing_room() -> Result<SceneView, BuildError> {
    let view = camera(Vec3::new(0.1, -0.2, 0.3), Vec3::new(1.0, 0.2, 0.5), 90.0);
    Ok((scene([(room(), matte(0.5, 1.0))], |_| Ok(()))?, view))
}

/// A matte room with a lamp and a block. It has direct light, indirect light and shadows.
pub(super) fn furnished_room() -> Result<SceneView, BuildError> {
    let lamp = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, z]| Vec3::new(x, 0.95, z));
    let parts = [
        (room(), matte(0.5, 0.0)),
        (quad(lamp), matte(0.0, 4.0)),
        (block(Vec3::new(0.2, -0.7, -0.1), Vec3::splat(0.3)), matte(0.8, 0.0)),
    ];
    let view = camera(Vec3::new(-0.3, 0.3, 0.95), Vec3::new(0.0, -0.4, 0.0), 80.0);
    Ok((scene(parts, |_| Ok(()))?, view))
}

/// A wide matte floor of reflectance 0.8 at y = 0, below the meshes `above` and the lights of
/// `light`. The camera sees only the origin.
pub(super) fn floor(
    above: impl IntoIterator<Item = (Mesh, Material)>,
    light: impl FnOnce(&mut SceneBuilder) -> Result<(), BuildError>,
) -> Result<SceneView, BuildError> {
    const SIZE: f32 = 50.0;
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]].map(|[x, z]| SIZE * Vec3::new(x, 0.0, z));
    let parts = std::iter::once((quad(corners), matte(0.8, 0.0))).chain(above);
    Ok((scene(parts, light)?, camera(Vec3::new(0.4, 0.7, 1.0), Vec3::ZERO, 0.01)))
}

/// A lamp of radiance 1 on the z axis behind `mesh`. The camera sees the lamp through `mesh`.
pub(super) fn lamp_behind(mesh: Mesh, material: Material) -> Result<SceneView, BuildError> {
    let lamp = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vec3::new(0.3 * x, 0.3 * y, -3.0));
    let parts = [(mesh, material), (quad(lamp), matte(0.0, 1.0))];
    Ok((
        scene(parts, |_| Ok(()))?,
        camera(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 1.0),
    ))
}
