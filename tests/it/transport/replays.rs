//! Scenes from public bug reports about light in path tracers. Each scene has a known value. If
//! another test covers a report, the report is not repeated here.

use crate::support::program::{done, folder, split};
use crate::support::*;
use embrasure::bsdf::Fresnel;
use embrasure::color::Spectrum;
use embrasure::geometry::Mesh;
use embrasure::integrator::{DirectLight, PathIntegrator, Roulette, Strategy};
use embrasure::light::LatLongImage;
use embrasure::material::{Gloss, Material};
use embrasure::math::{Quat, UVec2, Vec3};
use embrasure::scene::{Scene, SceneBuilder};
use std::f64::consts::{PI, TAU};

fn assert_close(what: &str, value: f64, expected: f64, tolerance: f64) {
    let difference = (value / expected - 1.0).abs();
    assert!(difference < tolerance, "{what}: {value}, expected {expected}");
}

/// Floor at y = 0 of half width `half`, facing up.
fn floor(half: f32) -> Mesh {
    let corner = |x: f32, z: f32| Vec3::new(half * x, 0.0, half * z);
    polygon(&[
        corner(-1.0, -1.0),
        corner(-1.0, 1.0),
        corner(1.0, 1.0),
        corner(1.0, -1.0),
    ])
}

fn floor_below(light: impl FnOnce(&mut SceneBuilder)) -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, floor(50.0), material(0.5, 0.0));
    light(&mut b);
    b.build().unwrap().0
}

/// Mean radiance of a small part of the floor around (x, 0, 0).
fn floor_radiance(scene: &Scene, x: f32, direct: DirectLight, spp: u32) -> f64 {
    let camera = pinhole(Vec3::new(x, 0.05, 0.0), Vec3::new(x, 0.0, 0.0), 1.0);
    let size = UVec2::splat(8);
    with_world(scene, camera, size, |world| {
        let path = PathIntegrator {
            strategy: Strategy {
                direct,
                ..Strategy::default()
            },
            ..path_tracer(world, Some(1))
        };
        film_mean(&film_of(&path, size, spp, 5), 1)
    })
}

/// Smooth glass of index 1.5 without absorption.
fn clear() -> Material {
    Material {
        transmission: Spectrum::ONE,
        ior: 1.5,
        ..material(0.0, 0.0)
    }
}

/// Meshes in a white sky.
fn in_white_sky(meshes: impl IntoIterator<Item = (Mesh, Material)>) -> Scene {
    let mut b = SceneBuilder::new();
    meshes
        .into_iter()
        .for_each(|(mesh, material)| add(&mut b, mesh, material));
    b.add_constant_light(Spectrum::ONE).unwrap();
    b.build().unwrap().0
}

/// Coarse ball: 8 triangles, subdivided `levels` times, with the normals of the ball.
fn coarse_ball(levels: u32) -> Mesh {
    let mesh = sphere(1.0, Vec3::ZERO, levels);
    Mesh {
        normals: mesh.positions.clone(),
        ..mesh
    }
}

/// Without absorption, a ball of each material is as bright as its surroundings. A coarse mesh with
/// the smooth normals of a ball must not have black rims.
#[test]
fn coarse_balls_in_a_white_sky_are_white() {
    let mirror = Material {
        specular: Spectrum::ONE,
        gloss: Gloss::Mirror(Fresnel::Full),
        ..material(0.0, 0.0)
    };
    let thin = Material { thin: true, ..clear() };
    for (name, material) in [("glass", clear()), ("thin glass", thin), ("mirror", mirror)] {
        for levels in [2, 3] {
            let scene = in_white_sky([(coarse_ball(levels), material.clone())]);
            let camera = pinhole(Vec3::new(0.4, 0.9, 4.0), Vec3::ZERO, 34.0);
            let film = render_film(&scene, camera, [32, 32], 64, Some(100));
            let what = format!("{name}, level {levels}");
            assert_close(&what, film_mean(&film, 1), 1.0, 0.008);
            let darkest = film.pixels().map(|(_, sums)| sums.mean(1)).fold(f64::MAX, f64::min);
            assert!(darkest > 0.5, "{what}: a pixel of {darkest}");
        }
    }
}

/// An air bubble in a ball of glass neither absorbs nor adds light.
#[test]
fn air_bubble_in_a_white_sky_is_white() {
    let mut bubble = sphere(0.5, Vec3::new(0.2, 0.0, 0.1), 3);
    bubble.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let scene = in_white_sky([(sphere(1.0, Vec3::ZERO, 3), clear()), (bubble, clear())]);
    let camera = pinhole(Vec3::new(0.3, 0.5, 4.0), Vec3::ZERO, 25.0);
    let film = render_film(&scene, camera, [32, 32], 128, Some(200));
    assert_close("bubble", film_mean(&film, 1), 1.0, 0.004);
}

/// Radiance divided by the squared index is constant along a ray (Veach 1997, §5.2). A camera in
/// glass therefore sees n² times the radiance of the sky.
#[test]
fn radiance_inside_glass_is_scaled_by_squared_index() {
    let scene = in_white_sky([(sphere(1.0, Vec3::ZERO, 3), clear())]);
    let camera = pinhole(Vec3::new(0.1, 0.05, 0.02), Vec3::new(1.0, 0.3, 0.2), 60.0);
    let film = render_film(&scene, camera, [24, 24], 256, Some(300));
    assert_close("inside glass", film_mean(&film, 1), 2.25, 0.004);
}

/// A deep white well in a white sky is white. Its paths of hundreds of vertices need more than 1024
/// dimensions of the sampler.
#[test]
fn deep_white_well_in_a_white_sky_is_white() {
    let mut well = room();
    // The side of z = 1 is open.
    let positions = well.positions.clone();
    well.triangles
        .retain(|t| t.iter().any(|&i| positions[i as usize].z < 0.0));
    assert_eq!(well.triangles.len(), 10);
    well.positions.iter_mut().for_each(|p| p.z *= 4.0);
    let scene = in_white_sky([(well, material(1.0, 0.0))]);
    let camera = pinhole(Vec3::new(0.2, 0.1, -2.0), Vec3::new(0.0, 0.0, -4.0), 60.0);
    let size = UVec2::splat(24);
    let film = with_world(&scene, camera, size, |world| {
        let path = PathIntegrator {
            roulette: Roulette::after(1000),
            ..path_tracer(world, Some(512))
        };
        film_by(&sobol(3), &path, size, 64)
    });
    assert_close("well", film_mean(&film, 1), 1.0, 0.004);
}

/// Scenes of size 10⁻⁶ to 10⁸ give the same image as size 1.
#[test]
fn pictures_do_not_depend_on_the_scale() {
    let mean = |scale: f32| {
        let mut b = SceneBuilder::new();
        let scaled = |mut mesh: Mesh| {
            mesh.positions.iter_mut().for_each(|p| *p *= scale);
            mesh
        };
        add(&mut b, scaled(floor(2.0)), material(0.5, 0.0));
        let ball = sphere(0.5, Vec3::new(0.0, 0.5, 0.0), 2);
        add(&mut b, scaled(ball), material(0.7, 0.0));
        let mut lamp = panel(0.0, 0.5);
        lamp.positions
            .iter_mut()
            .for_each(|p| *p = Vec3::new(p.x + 0.7, 2.0, p.y));
        add(&mut b, scaled(lamp), material(0.0, 3.0));
        let scene = b.build().unwrap().0;
        let camera = pinhole(scale * Vec3::new(0.0, 1.2, 3.0), scale * Vec3::new(0.0, 0.4, 0.0), 40.0);
        film_mean(&render_film(&scene, camera, [24, 24], 64, Some(4)), 1)
    };
    let expected = mean(1.0);
    for scale in [1e-6, 1e-3, 1e3, 1e8] {
        assert_close(&format!("scale {scale:e}"), mean(scale), expected, 0.003);
    }
}

/// Bilinear value of the image `texels` of `width` × `height` in a direction. +y is the top row, −z
/// the middle column, and +x is to the right of the middle.
fn bilinear(texels: &[f64], width: usize, height: usize, [x, y, z]: [f64; 3]) -> f64 {
    let s = (0.5 + x.atan2(-z) / TAU) * width as f64 - 0.5;
    let t = y.clamp(-1.0, 1.0).acos() / PI * height as f64 - 0.5;
    let texel = |column: f64, row: f64| {
        let row = row.clamp(0.0, height as f64 - 1.0) as usize;
        texels[row * width + column.rem_euclid(width as f64) as usize]
    };
    let (column, row) = (s.floor(), t.floor());
    let (u, v) = (s - column, t - row);
    let of_row = |row: f64| (1.0 - u) * texel(column, row) + u * texel(column + 1.0, row);
    (1.0 - v) * of_row(row) + v * of_row(row + 1.0)
}

/// Irradiance of the floor, by the midpoint rule over the sky, in the frame of the image. `up` is
/// the normal of the floor in this frame.
fn irradiance(texels: &[f64], width: usize, height: usize, up: Vec3) -> f64 {
    let (rows, columns) = (720, 1440);
    let up = up.to_array().map(f64::from);
    let mut sum = 0.0;
    for row in 0..rows {
        let (sin, cos) = (PI * (row as f64 + 0.5) / rows as f64).sin_cos();
        for column in 0..columns {
            let phi = TAU * (column as f64 + 0.5) / columns as f64 - PI;
            let w = [sin * phi.sin(), cos, -sin * phi.cos()];
            let cosine: f64 = w.iter().zip(up).map(|(a, b)| a * b).sum();
            if cosine > 0.0 {
                sum += bilinear(texels, width, height, w) * cosine * sin;
            }
        }
    }
    sum * (PI / rows as f64) * (TAU / columns as f64)
}

/// Environments with a single bright texel: in the middle, at the seam, and at both poles. The
/// environments are also rotated. Light samples, scattered rays, and both together find the same
/// irradiance.
#[test]
fn environment_texels_give_exact_irradiance() {
    let (width, height) = (32, 16);
    let turned = Quat::from_rotation_x(0.5) * Quat::from_rotation_y(0.9) * Quat::from_rotation_z(1.2);
    for (column, row, rotation) in [
        (5, 5, Quat::IDENTITY),
        (0, 6, Quat::IDENTITY),
        (31, 6, Quat::IDENTITY),
        (9, 0, Quat::IDENTITY),
        (9, 15, Quat::from_rotation_x(std::f32::consts::PI)),
        (20, 7, Quat::from_rotation_y(std::f32::consts::FRAC_PI_2)),
        (12, 4, turned),
    ] {
        let mut texels = vec![0.1; width * height];
        texels[row * width + column] = 8.0;
        let expected = 0.5 / PI * irradiance(&texels, width, height, rotation.inverse() * Vec3::Y);
        let scene = floor_below(|b| {
            let texels = texels.iter().map(|&v| Spectrum::splat(v as f32)).collect();
            let image = LatLongImage { width, height, texels };
            b.add_environment(image, 1.0, rotation).unwrap();
        });
        let what = format!("texel {column}, {row}");
        for (direct, spp, tolerance) in [
            (DirectLight::Mis, 512, 0.01),
            (DirectLight::Light, 512, 0.01),
            (DirectLight::None, 2048, 0.03),
        ] {
            let value = floor_radiance(&scene, 0.0, direct, spp);
            assert_close(&format!("{what}, {direct:?}"), value, expected, tolerance);
        }
    }
}

#[test]
fn odd_environment_sizes_give_exact_irradiance() {
    for (width, height) in [(1, 1), (2, 1), (1, 2), (5, 7)] {
        let texels: Vec<f64> = (0..width * height).map(|i| 0.3 + 0.4 * ((i * 5) % 3) as f64).collect();
        let expected = 0.5 / PI * irradiance(&texels, width, height, Vec3::Y);
        let scene = floor_below(|b| {
            let texels = texels.iter().map(|&v| Spectrum::splat(v as f32)).collect();
            let image = LatLongImage { width, height, texels };
            b.add_environment(image, 1.0, Quat::IDENTITY).unwrap();
        });
        let value = floor_radiance(&scene, 0.0, DirectLight::Mis, 1024);
        assert_close(&format!("{width} × {height}"), value, expected, 0.005);
    }
}

/// The intensity of a spot light at the angle θ is a smooth step of cos θ between the inner and the
/// outer cone.
#[test]
fn spots_fall_off_by_a_smooth_step() {
    let (angle, falloff) = (40.0f32, 20.0f32);
    let scene = floor_below(|b| {
        let intensity = Spectrum::splat(7.0);
        b.add_spot_light(2.0 * Vec3::Y, -Vec3::Y, intensity, angle, falloff)
            .unwrap();
    });
    for degrees in [0.0f64, 15.0, 22.0, 30.0, 37.0] {
        let cosine = degrees.to_radians().cos();
        let [inner, outer] = [falloff, angle].map(|degrees| f64::from(degrees).to_radians().cos());
        let x = ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0);
        let expected = 0.5 / PI * 7.0 * x * x * (3.0 - 2.0 * x) * cosine.powi(3) / 4.0;
        let place = 2.0 * degrees.to_radians().tan();
        let value = floor_radiance(&scene, place as f32, DirectLight::Mis, 16);
        assert_close(&format!("{degrees} degrees"), value, expected, 0.005);
    }
    let outside = 2.0 * 41f32.to_radians().tan();
    assert_eq!(floor_radiance(&scene, outside, DirectLight::Mis, 16), 0.0);
}

/// Irradiance from a square lamp of radiance 1 and half width `half`, at `height` below its centre.
fn below_square(half: f64, height: f64) -> f64 {
    let a = half / height;
    let root = (1.0 + a * a).sqrt();
    // The square is four quarters. Each quarter is a sum of two equal terms, divided by 2 (Howell,
    // configuration factors, B-3).
    4.0 * a / root * (a / root).atan()
}

/// If vertex normals are opposite to the triangle normals, the front of a lamp and its density do
/// not change.
#[test]
fn reversed_vertex_normals_keep_the_lamp_front() {
    let expected = 0.5 / PI * 2.0 * below_square(0.5, 1.0);
    for is_mirrored in [false, true] {
        let mut lamp = panel(0.0, 0.5);
        lamp.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, 1.0, p.y));
        if is_mirrored {
            // A mirrored lamp with reversed winding, so that it faces down again.
            lamp.positions.iter_mut().for_each(|p| p.x = -p.x);
            lamp.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        lamp.normals = vec![Vec3::Y; lamp.positions.len()];
        let scene = floor_below(|b| add(b, lamp, material(0.0, 2.0)));
        for (direct, spp) in [
            (DirectLight::Mis, 512),
            (DirectLight::Light, 512),
            (DirectLight::None, 4096),
        ] {
            let what = format!("mirrored {is_mirrored}, {direct:?}");
            assert_close(&what, floor_radiance(&scene, 0.0, direct, spp), expected, 0.02);
        }
    }
}

/// In the channel of normals, faces of both windings face the camera. Emitters are opaque. Depth is
/// exact even out of focus.
#[test]
fn feature_layers_are_exact_out_of_focus() {
    let folder = folder(&[
        ("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 3 3 3\n"),
        (
            "a.obj",
            "mtllib a.mtl\nv -3 -3 0\nv 0 -3 0\nv 0 3 0\nv -3 3 0\nv 3 -3 0\nv 3 3 0\n\
             usemtl m\nf 4 3 2 1\nusemtl lamp\nf 2 5 6 3\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nvertical_fov = 20\n\
             lens_radius = 0.5\nfocus_distance = 3\n[image]\nwidth = 16\nheight = 16\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ]);
    done(
        folder.path(),
        &split("render s.toml -q --spp 16 --background transparent -o a.exr"),
    );
    let path = folder.path().join("a.exr");
    for (channel, expected) in [("N.X", 0.0), ("N.Y", 0.0), ("N.Z", 1.0), ("Z", 4.0), ("A", 1.0)] {
        for value in read_channel(&path, channel) {
            assert!(
                (value - expected).abs() < 1e-4,
                "{channel}: {value}, expected {expected}"
            );
        }
    }
}
