//! Surfaces with varying materials or normals: textures, opacity, interpolated normals, bump maps.

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::color::Spectrum;
use embrasure::film::Film;
use embrasure::geometry::Mesh;
use embrasure::integrator::{
    DebugIntegrator, DebugView, DirectLight, Directions, NaiveIntegrator, PathIntegrator, Roulette, Strategy,
};
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec2, Vec3};
use embrasure::scene::{Scene, SceneBuilder};
use std::fs;

fn holed(diffuse: f32, opacity: f32) -> Material {
    Material {
        opacity,
        ..material(diffuse, 0.0)
    }
}

#[test]
fn transmission_is_one_minus_opacity() {
    let mut b = SceneBuilder::new();
    add(&mut b, panel(0.0, 2.0), holed(0.0, 0.3));
    add(&mut b, panel(-1.0, 3.0), holed(0.0, 0.6));
    b.add_constant_light(Spectrum::ONE).unwrap();
    let scene = b.build().unwrap().0;
    let film = render_film(&scene, from_front(), [64, 64], 256, Some(4));
    let mean = Mean::of_film(&film, 0);
    assert_same_mean("two sheets", mean, Mean::exact(0.7 * 0.4));
    assert!(mean.error() < 1e-3, "{mean}");
}

#[test]
fn shadow_transmittance_follows_opacity() {
    let lit = |opacities: &[f32]| {
        let mut b = SceneBuilder::new();
        add(&mut b, panel(0.0, 2.0), material(0.5, 0.0));
        for (i, &opacity) in opacities.iter().enumerate() {
            add(&mut b, panel(20.0 + i as f32, 30.0), holed(0.0, opacity));
        }
        b.add_point_light(Vec3::new(1.0, 2.0, 30.0), Spectrum::splat(1e3))
            .unwrap();
        let film = render_film(&b.build().unwrap().0, from_front(), [8, 8], 4, Some(1));
        film_mean(&film, 0)
    };
    let open = lit(&[]);
    assert!(open > 0.1);
    for opacities in [&[0.25][..], &[0.5, 0.2], &[0.0], &[1.0], &[0.5, 1.0]] {
        let share: f64 = opacities.iter().map(|o| 1.0 - *o as f64).product();
        let got = lit(opacities) / open;
        assert!((got - share).abs() < 1e-5, "{opacities:?}: {got}, not {share}");
    }
}

/// A table under a canopy of opacity 0.4, with a lamp and a sky. Rays of every kind go through the
/// canopy.
fn canopy() -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, panel(0.0, 2.0), material(0.6, 0.0));
    add(&mut b, panel(0.7, 1.0), holed(0.8, 0.4));
    let mut lamp = panel(1.5, 0.6);
    lamp.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    add(&mut b, lamp, material(0.0, 4.0));
    b.add_constant_light(Spectrum::splat(0.3)).unwrap();
    b.build().unwrap().0
}

/// Rays pass through partly opaque surfaces by a random choice, by a factor (the transmittance), or
/// by both. All estimators have the same mean. Errors are computed from renders with different
/// seeds, because pixels with path reuse have correlated errors.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn estimators_agree_on_opacity() {
    let scene = canopy();
    let camera = pinhole(Vec3::new(3.0, 2.0, 2.5), Vec3::new(0.0, 0.0, 0.4), 50.0);
    let resolution = UVec2::splat(32);
    const SEEDS: u64 = 24;
    let statistics = |render: &dyn Fn(u64) -> Film| {
        Mean::of(&(0..SEEDS).map(|seed| film_mean(&render(seed), 0)).collect::<Vec<f64>>())
    };
    with_world(&scene, camera, resolution, |world| {
        let path = |direct, reuse| PathTracer {
            path: PathIntegrator {
                strategy: Strategy {
                    direct,
                    ..Strategy::default()
                },
                ..path_tracer(world, Some(4))
            },
            reuse,
        };
        let naive = NaiveIntegrator::new(world, Some(4), Roulette::default());
        let by = |path: PathTracer<'_>, spp| statistics(&|seed| film_of(&path, resolution, spp, seed));
        let all = [
            ("mis", by(path(DirectLight::Mis, false), 64)),
            ("light", by(path(DirectLight::Light, false), 64)),
            ("followed", by(path(DirectLight::None, false), 128)),
            ("shared", by(path(DirectLight::Mis, true), 64)),
            ("naive", statistics(&|seed| film_of(&naive, resolution, 256, seed))),
        ];
        let (_, expected) = all[0];
        for (name, mean) in &all[1..] {
            assert_same_mean(name, *mean, expected);
            assert!(
                (mean.value / expected.value - 1.0).abs() < 0.01,
                "{name}: {mean} against {expected}"
            );
        }
    });
}

/// Renders a square in uniform light. Its texture has four texels: red and green at the top, blue
/// and grey at the bottom.
fn textured(mtl: &str, smooth_normals: &str) -> Film {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write_png(
        &folder.path().join("four.png"),
        2,
        &[[255, 0, 0], [0, 255, 0], [0, 0, 255], [188, 188, 188]],
    );
    file("s.mtl", mtl);
    file(
        "s.obj",
        &format!(
            "mtllib s.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n{smooth_normals}\
             usemtl m\nf 1/1 2/2 3/3 4/4\n"
        ),
    );
    let scene = load(&folder.path().join("s.obj"));
    with_world(&scene, from_front(), UVec2::splat(8), |world| {
        // In uniform light every scattered ray has the same radiance.
        let path = PathIntegrator {
            strategy: Strategy {
                direct: DirectLight::None,
                ..Strategy::default()
            },
            ..path_tracer(world, Some(1))
        };
        film_of(&path, UVec2::splat(8), 16, 0)
    })
}

/// Colour at the middle of each quarter, row by row from the top.
fn quarters(film: &Film) -> [[f64; 3]; 4] {
    [[1, 1], [6, 1], [1, 6], [6, 6]].map(|[x, y]| {
        let (_, sums) = film.pixels().find(|(p, _)| *p == UVec2::new(x, y)).unwrap();
        [0, 1, 2].map(|c| sums.mean(c))
    })
}

#[test]
fn texture_options_place_texels() {
    let near = |got: [[f64; 3]; 4], expected: [[f64; 3]; 4], tolerance: f64| {
        let pairs = got.as_flattened().iter().zip(expected.as_flattened());
        assert!(
            pairs.clone().all(|(a, b)| (a - b).abs() < tolerance),
            "{got:?}, not {expected:?}"
        );
    };
    // The sRGB code 188 is half of the light.
    let (r, g, b, w) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5029; 3]);
    near(
        quarters(&textured("newmtl m\nmap_Kd -clamp on four.png\n", "")),
        [r, g, b, w],
        2e-3,
    );
    near(
        quarters(&textured("newmtl m\nKd 0.5 1 1\nmap_Kd -clamp on FOUR.PNG\n", "")),
        [[0.5, 0.0, 0.0], g, b, [0.25145, w[1], w[2]]],
        2e-3,
    );
    // The texture is shifted right by half of its width, and flipped
    let shifted = textured("newmtl m\nmap_Kd -o 0.5 -s 1 -1 four.png\n", "");
    // Where the texture repeats, a neighbouring texel covers an eighth of the pixel in each
    // direction.
    near(quarters(&shifted), [w, b, g, r], 0.25);
    // If a texture is missing, the constant is used.
    near(
        quarters(&textured("newmtl m\nKd 0.25\nmap_Kd five.png\n", "")),
        [[0.25; 3]; 4],
        2e-3,
    );
}

/// Where the opacity map is black, the sky of radiance 1 is visible.
#[test]
fn opacity_map_cuts_out_black_texels() {
    let film = textured("newmtl m\nKd 0\nmap_d -imfchan b -clamp on four.png\n", "");
    let [red, green, blue, white] = quarters(&film).map(|c| c[0]);
    assert!((red, green, blue) == (1.0, 1.0, 0.0), "{red} {green} {blue}");
    // The opacity is 188/255, because opacities are linear data.
    assert!((white - (1.0 - 188.0 / 255.0)).abs() < 0.3, "{white}");
}

/// A sphere of 128 triangles with the normals of the true sphere.
fn coarse_sphere(diffuse: f32) -> (Mesh, Material) {
    let mut mesh = sphere(1.0, Vec3::ZERO, 2);
    mesh.normals = mesh.positions.clone();
    (mesh, material(diffuse, 0.0))
}

fn sphere_camera() -> embrasure::camera::CameraParameters {
    pinhole(Vec3::new(0.0, 0.0, 8.0), Vec3::ZERO, 16.0)
}

/// Point of the unit sphere that the centre of pixel `p` of 64 × 64 sees, if any.
fn seen_point(p: UVec2) -> Option<Vec3> {
    let scale = 2.0 * 8f32.to_radians().tan() / 64.0;
    let at = (p.as_vec2() + 0.5 - 32.0) * scale * Vec2::new(1.0, -1.0);
    let (o, d) = (Vec3::new(0.0, 0.0, 8.0), Vec3::new(at.x, at.y, -1.0).normalize());
    let b = o.dot(d);
    let root = b * b - (64.0 - 1.0);
    (root > 0.0).then(|| o + d * (-b - root.sqrt()))
}

#[test]
fn interpolated_normals_match_the_sphere() {
    let (mesh, matte) = coarse_sphere(0.5);
    let mut b = SceneBuilder::new();
    add(&mut b, mesh, matte);
    let scene = b.build().unwrap().0;
    let film = with_world(&scene, sphere_camera(), UVec2::splat(64), |world| {
        let view = DebugView::Normals;
        film_of(&DebugIntegrator { world, view }, UVec2::splat(64), 4, 0)
    });
    let mut seen = 0;
    for (pixel, sums) in film.pixels() {
        let Some(n) = seen_point(pixel).filter(|n| n.z > 0.6) else {
            continue;
        };
        let got = Vec3::from_array([0, 1, 2].map(|c| 2.0 * sums.mean(c) as f32 - 1.0));
        // Triangles are 22° wide, so their normals differ from the normals of the sphere by up to
        // 0.2. The camera also sees slightly different points on a triangle and on the sphere.
        assert!(got.distance(n) < 0.13, "{pixel}: {got} instead of {n}");
        seen += 1;
    }
    assert!(seen > 1000, "{seen}");
}

/// A coarse sphere under light from the side looks like a sphere: shadows of single triangles are
/// not visible (Hanika 2021), and the side away from the light is dark.
#[test]
fn terminator_matches_the_sphere() {
    let (mesh, matte) = coarse_sphere(1.0);
    let mut b = SceneBuilder::new();
    add(&mut b, mesh, matte);
    let to_light = Vec3::new(0.8, 0.6, 0.0);
    b.add_directional_light(-to_light, Spectrum::splat(std::f32::consts::PI))
        .unwrap();
    let film = render_film(&b.build().unwrap().0, sphere_camera(), [64, 64], 16, Some(1));
    for (pixel, sums) in film.pixels() {
        let Some(n) = seen_point(pixel).filter(|n| n.z > 0.6) else {
            continue;
        };
        let (expected, got) = (n.dot(to_light).max(0.0) as f64, sums.mean(0));
        assert!((got - expected).abs() < 0.08, "{pixel}: {got} instead of {expected}");
    }
}

/// Interpolated normals lose and add a little energy, but the rim is neither black nor bright.
#[test]
fn coarse_white_sphere_is_even_in_a_furnace() {
    let (mesh, matte) = coarse_sphere(1.0);
    let mut b = SceneBuilder::new();
    add(&mut b, mesh, matte);
    b.add_constant_light(Spectrum::ONE).unwrap();
    let film = render_film(&b.build().unwrap().0, sphere_camera(), [64, 64], 256, None);
    let mean = film_mean(&film, 0);
    assert!((mean - 1.0).abs() < 0.02, "{mean}");
    for (pixel, sums) in film.pixels() {
        assert!((0.7..1.2).contains(&sums.mean(0)), "{pixel}: {}", sums.mean(0));
    }
}

/// Wrong normals do not let light through a closed wall.
#[test]
fn curved_normals_do_not_leak() {
    let mut mesh = room();
    mesh.normals = mesh
        .positions
        .iter()
        .map(|p| (*p + Vec3::new(0.3, -0.9, 0.2)).normalize())
        .collect();
    let mut b = SceneBuilder::new();
    add(&mut b, mesh, material(0.9, 0.0));
    b.add_constant_light(Spectrum::ONE).unwrap();
    let scene = b.build().unwrap().0;
    let resolution = UVec2::splat(32);
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.3), Vec3::new(1.0, 0.2, 0.5), 90.0);
    with_world(&scene, camera, resolution, |world| {
        for (directions, reuse) in [
            (Directions::Bsdf, false),
            (Directions::Uniform, false),
            (Directions::Bsdf, true),
        ] {
            let path = PathIntegrator {
                strategy: Strategy {
                    directions,
                    ..Strategy::default()
                },
                ..path_tracer(world, Some(8))
            };
            let film = film_of(&PathTracer { path, reuse }, resolution, 64, 0);
            let brightest = film.pixels().map(|(_, a)| a.mean(0)).fold(0.0, f64::max);
            assert_eq!(brightest, 0.0, "{directions:?}, {reuse}");
        }
    });
}

/// A surface with heights that rise to the right faces to the left.
#[test]
fn bump_normals_tilt_downhill() {
    let normals = |mtl: &str| {
        let folder = tempfile::tempdir().unwrap();
        // The right column is higher.
        write_png(&folder.path().join("h.png"), 2, &[[0; 3], [255; 3], [0; 3], [255; 3]]);
        fs::write(folder.path().join("s.mtl"), mtl).unwrap();
        let obj = "mtllib s.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";
        fs::write(folder.path().join("s.obj"), obj).unwrap();
        let scene = load(&folder.path().join("s.obj"));
        with_world(&scene, from_front(), UVec2::splat(8), |world| {
            let view = DebugView::Normals;
            let film = film_of(&DebugIntegrator { world, view }, UVec2::splat(8), 4, 0);
            let (_, sums) = film.pixels().find(|(p, _)| *p == UVec2::new(4, 3)).unwrap();
            [0, 1, 2].map(|c| 2.0 * sums.mean(c) - 1.0)
        })
    };
    // Between the texel centres, the height rises by the width of one texel. This is a slope of
    // 45°, or less with -bm. The pixel includes some of the flat border.
    let close = |got: [f64; 3], expected: [f64; 3]| {
        let is_near = got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.07);
        assert!(is_near, "{got:?}, not {expected:?}");
    };
    let half = 0.5f64.sqrt();
    close(normals("newmtl m\nmap_bump -clamp on h.png\n"), [-half, 0.0, half]);
    let steep = (1.0 + 0.04f64).sqrt();
    close(
        normals("newmtl m\nbump -bm 0.2 -clamp on h.png\n"),
        [-0.2 / steep, 0.0, 1.0 / steep],
    );
    // In a normal map, black is −1 and white +1, in all three channels.
    let normal = normals("newmtl m\nnorm -clamp on h.png\n");
    assert!(normal[2] > 0.0, "{normal:?}");
    close(normals("newmtl m\n"), [0.0, 0.0, 1.0]);
}
