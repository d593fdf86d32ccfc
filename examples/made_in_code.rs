//! Renders a scene made in code, rings on water under a sky and a lamp:
//!
//! ```text
//! cargo run --release --example made_in_code -- out/rings.png
//! ```

use embrasure::prelude::*;
use std::error::Error;

/// Number of squares along a side of the water.
const SIDE: u32 = 400;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("an argument is expected: the PNG file to write")?;
    let mut settings = Settings::default();
    settings.resolution = UVec2::new(640, 360);

    // Materials and meshes. The builder rejects invalid values, and reports skipped triangles.
    let mut builder = SceneBuilder::new();
    let water = builder.add_material(Material {
        diffuse: Spectrum::rgb(0.02, 0.08, 0.10),
        specular: Spectrum::splat(0.35),
        gloss: Gloss::Phong(2000.0),
        ..Material::default()
    })?;
    let lamp = builder.add_material(Material {
        emission: Spectrum::rgb(60.0, 40.0, 20.0),
        ..Material::default()
    })?;
    builder.add_mesh(rings(), water)?;
    let corner = |x: f32, z: f32| Vec3::new(1.0 + x, 2.5, -1.0 + z);
    let shade = Mesh {
        positions: vec![
            corner(-0.3, -0.3),
            corner(0.3, -0.3),
            corner(0.3, 0.3),
            corner(-0.3, 0.3),
        ],
        // A surface emits light on the side from which its corners run counter-clockwise.
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    builder.add_mesh(shade, lamp)?;
    builder.add_constant_light(Spectrum::rgb(0.25, 0.35, 0.55))?;
    let (scene, report) = builder.build()?;
    if report.degenerate_triangles > 0 {
        eprintln!(
            "warning: {} triangles have no area and are left out",
            report.degenerate_triangles
        );
    }

    let camera = CameraParameters {
        position: Vec3::new(0.0, 1.6, 4.5),
        look_at: Vec3::new(0.0, 0.0, 0.0),
        up: Vec3::Y,
        vertical_fov: 40.0,
        lens_radius: 0.0,
        focus_distance: 1.0,
    };
    let output = Output::prepare(path)?;
    let session = Session::new(scene, camera, settings)?;
    let renderer = session.renderer()?;
    let mut state = renderer.start();
    renderer.render(&mut state, &());
    let (image, metadata) = (renderer.develop(&state), renderer.metadata(&state, true));
    let tone = session.settings().tone;
    output.write_image(&Format::Png(tone), &image, None, &metadata)?;
    Ok(())
}

/// A square of water, with rings around its middle.
fn rings() -> Mesh {
    let point = |column: u32, row: u32| {
        let [x, z] = [column, row].map(|i| 6.0 * (i as f32 / SIDE as f32 - 0.5));
        let r = x.hypot(z);
        Vec3::new(x, 0.06 * (14.0 * r).cos() * (-0.8 * r).exp(), z)
    };
    let rows = || (0..=SIDE).flat_map(|row| (0..=SIDE).map(move |column| (column, row)));
    let index = |column: u32, row: u32| row * (SIDE + 1) + column;
    let squares = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
    let triangles = squares.flat_map(|(c, r)| {
        let [a, b, d, e] = [index(c, r), index(c + 1, r), index(c, r + 1), index(c + 1, r + 1)];
        [[a, d, e], [a, e, b]]
    });
    Mesh {
        positions: rows().map(|(column, row)| point(column, row)).collect(),
        triangles: triangles.collect(),
        ..Mesh::default()
    }
}
