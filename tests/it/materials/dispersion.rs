//! Dispersion: glass with a refractive index for each wavelength.

use crate::support::program::{done, folder, refused, split};
use crate::support::statistics::{Mean, assert_means_within, assert_same_mean};
use crate::support::*;
use embrasure::color::Spectrum;
use embrasure::integrator::{NaiveIntegrator, OneSampleIntegrator, Roulette};
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec3};
use embrasure::sampling::Wavelength;
use embrasure::scene::{Scene, SceneBuilder};
use std::f64::consts::PI;

fn flint(ior: f32, abbe: Option<f32>) -> Material {
    Material {
        ior,
        abbe,
        ..glass([1.0; 3], false)
    }
}

type Plane = [f64; 2];

fn dot(a: Plane, b: Plane) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Direction of `d` after refraction at a plane with the unit normal `n` (Snell's law), and the
/// Fresnel transmittance. `n` is on the side of the incoming ray. `eta` is the index behind the
/// plane divided by the index in front.
fn refract(d: Plane, n: Plane, eta: f64) -> (Plane, f64) {
    let cos = -dot(d, n);
    let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let along = cos / eta - cos_t;
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    let reflected = 0.5 * (parallel.powi(2) + perpendicular.powi(2));
    ([d[0] / eta + along * n[0], d[1] / eta + along * n[1]], 1.0 - reflected)
}

/// A narrow sun behind a prism. A camera ray sees the sun only at wavelengths that Snell's law
/// refracts towards the disc of the sun.
#[test]
fn prism_deflects_wavelengths_by_snells_law() {
    let half_apex = 20f64.to_radians();
    let normals = [[-half_apex.cos(), half_apex.sin()], [half_apex.cos(), half_apex.sin()]];
    let material = flint(1.7, Some(20.0));
    // Direction behind the prism, and transmittance of both faces
    let through = |nanometers: f64| {
        let index = f64::from(material.ior_at(nanometers as f32));
        let (inside, first) = refract([1.0, 0.0], normals[0], index);
        let back = [-normals[1][0], -normals[1][1]];
        let (outside, second) = refract(inside, back, 1.0 / index);
        (outside, first * second)
    };
    for (middle, edge) in [(450.0, 440.0), (550.0, 535.0), (620.0, 600.0)] {
        let (to, rim) = (through(middle).0, through(edge).0);
        let half_angle = dot(to, rim).min(1.0).acos();
        let mut b = SceneBuilder::new();
        let [w, h] = [half_apex.tan() as f32, 1.0];
        let outline = [[0.0, h], [-2.0 * w, -h], [2.0 * w, -h]];
        let mut prism = embrasure::geometry::Mesh::default();
        for z in [-5.0, 5.0] {
            prism.positions.extend(outline.map(|[x, y]| Vec3::new(x, y, z)));
        }
        prism.triangles = vec![
            [0, 1, 4],
            [0, 4, 3],
            [1, 2, 5],
            [1, 5, 4],
            [2, 0, 3],
            [2, 3, 5],
            [0, 2, 1],
            [3, 4, 5],
        ];
        // Faces point outwards.
        let volume: f32 = prism
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| prism.positions[i as usize]);
                a.dot(b.cross(c))
            })
            .sum();
        if volume < 0.0 {
            prism.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        add(&mut b, prism, material.clone());
        let direction = -Vec3::new(to[0] as f32, to[1] as f32, 0.0);
        let angle = 2.0 * half_angle.to_degrees();
        b.add_sun(
            direction,
            Spectrum::splat((PI * half_angle.sin().powi(2)) as f32),
            angle as f32,
        )
        .unwrap();
        let scene = b.build().unwrap().0;
        assert!(scene.is_dispersive());
        let film = render_film(
            &scene,
            pinhole(Vec3::new(-8.0, 0.0, 0.0), Vec3::ZERO, 1e-4),
            [8, 8],
            16384,
            Some(2),
        );

        let mut expected = [0.0f64; 3];
        const PARTS: u32 = 200;
        for (nanometers, share) in Wavelength::bands() {
            for part in 0..PARTS {
                let place = (f64::from(part) + 0.5) / f64::from(PARTS) - 0.5;
                let (out, passed) = through(f64::from(nanometers) + 5.0 * place);
                if dot(out, to).min(1.0).acos() <= half_angle {
                    for (sum, share) in expected.iter_mut().zip(share) {
                        *sum += f64::from(share) * passed / f64::from(PARTS);
                    }
                }
            }
        }
        for (c, expected) in expected.into_iter().enumerate() {
            // The cosine of the disc's rim is an f32, whose rounding error changes the width of the
            // disc.
            let allowed = 3e-3 * expected.max(0.02);
            let what = format!("{middle} nm, channel {c}");
            assert_means_within(what, Mean::of_film(&film, c), Mean::exact(expected), allowed);
        }
    }
}

/// A room with two lamps, and with a ball and a block of glass.
fn glass_room(ior: f32, abbe: Option<f32>) -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    let lamp = [[-0.6, -0.6], [0.6, -0.6], [0.6, 0.6], [-0.6, 0.6]].map(|[x, z]| Vec3::new(x, 0.95, z));
    add(&mut b, polygon(&lamp), material(0.0, 3.0));
    let stripes = [[-0.9, -0.2], [-0.5, -0.2], [-0.5, 0.2], [-0.9, 0.2]].map(|[x, y]| Vec3::new(x, y, -0.98));
    add(&mut b, polygon(&stripes), material(0.0, 5.0));
    add(&mut b, sphere(0.4, Vec3::new(-0.3, -0.3, 0.0), 3), flint(ior, abbe));
    add(
        &mut b,
        slab(Vec3::new(0.5, -0.5, -0.3), Vec3::new(0.3, 0.5, 0.2)),
        flint(ior, abbe),
    );
    b.build().unwrap().0
}

/// Each path has one random wavelength. The mean equals a weighted sum of renders with the
/// refractive index of one wavelength each. The weight is the contribution of this wavelength to a
/// channel.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn dispersed_light_is_mean_over_wavelengths() {
    let (ior, abbe, resolution) = (1.6, 6.0, UVec2::splat(12));
    let camera = pinhole(Vec3::new(0.1, 0.0, 0.95), Vec3::new(-0.2, -0.25, 0.0), 75.0);
    let index = flint(ior, Some(abbe));
    let quarter = |x: u32, y: u32| usize::from(x >= 6) + 2 * usize::from(y >= 6);
    // Means and squared errors of the quarters of a film, for each channel
    let regions = |film: &embrasure::film::Film| {
        let mut regions = [[[0.0; 2]; 3]; 4];
        for (pixel, sums) in film.pixels() {
            for (c, region) in regions[quarter(pixel.x, pixel.y)].iter_mut().enumerate() {
                region[0] += sums.mean(c) / 36.0;
                region[1] += sums.variance_of_mean(c) / (36.0 * 36.0);
            }
        }
        regions
    };
    let mut expected = [[[0.0f64; 2]; 3]; 4];
    for (band, (nanometers, share)) in (0..).zip(Wavelength::bands()) {
        let scene = glass_room(index.ior_at(nanometers), None);
        let film = with_world(&scene, camera, resolution, |world| {
            film_of(&path_tracer(world, Some(6)), resolution, budget(256), 1000 + band)
        });
        for (sum, region) in expected
            .iter_mut()
            .flatten()
            .zip(regions(&film).into_iter().flatten())
            .enumerate()
            .map(|(i, pair)| {
                let c = i % 3;
                let share = f64::from(share[c]);
                (pair.0, [share * pair.1[0], share * share * pair.1[1]])
            })
        {
            *sum = [sum[0] + region[0], sum[1] + region[1]];
        }
    }
    let scene = glass_room(ior, Some(abbe));
    let plain = glass_room(ior, None);
    let mut farthest = 0.0f64;
    for what in ["path", "naive", "one sample"] {
        let of = |scene: &Scene| {
            with_world(scene, camera, resolution, |world| match what {
                "path" => film_of(&path_tracer(world, Some(6)), resolution, budget(4096), 5),
                "one sample" => {
                    let integrator = OneSampleIntegrator {
                        world,
                        direct_probability: 0.4,
                        max_depth: Some(6),
                    };
                    film_of(&integrator, resolution, budget(16384), 7)
                }
                _ => film_of(
                    &NaiveIntegrator::new(world, Some(6), Roulette::default()),
                    resolution,
                    budget(32768),
                    6,
                ),
            })
        };
        let (found, without) = (regions(&of(&scene)), regions(&of(&plain)));
        for (i, (((mean, variance), (expected, other)), plain)) in found
            .into_iter()
            .flatten()
            .map(|[m, v]| (m, v))
            .zip(expected.into_iter().flatten().map(|[m, v]| (m, v)))
            .zip(without.into_iter().flatten().map(|[m, _]| m))
            .enumerate()
        {
            let error = (variance + other).sqrt();
            let means = [(mean, variance), (expected, other)].map(|(mean, variance)| Mean::new(mean, variance.sqrt()));
            assert_same_mean(format!("{what}, region {i}"), means[0], means[1]);
            assert!(
                error < 0.02 * slack() * expected,
                "{what}, region {i}: {mean} ± {error} says too little"
            );
            farthest = farthest.max(((plain - expected) / error).abs());
        }
    }
    println!("without dispersion: {farthest:.1} standard errors at most");
}

/// An integrator without dispersion is refused, and the error lists the integrators that support
/// dispersion. The path tracer switches path reuse off.
#[test]
fn integrators_without_dispersion_are_errors() {
    let toml = "version = 1\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n[image]\nwidth = 8\nheight = 8\n[render]\nsamples = 2\n[[object]]\nobj = 'a.obj'\n[material.g]\ntransmission = 1.0\nior = 1.6\nabbe = 30.0\n[[light]]\ntype = 'constant'\nradiance = [1, 1, 1]\n";
    let obj = "usemtl g\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";
    let folder = folder(&[("a.obj", obj), ("s.toml", toml)]);
    for integrator in [
        "path",
        "naive",
        "one-sample",
        "area",
        "whitted",
        "distributed",
        "direct",
        "ao",
    ] {
        done(
            folder.path(),
            &split(&format!("render s.toml -q -o x.exr --integrator {integrator}")),
        );
    }
    for integrator in ["bdpt", "vcm", "mlt", "sppm", "light", "photon-map"] {
        let words = refused(
            folder.path(),
            &split(&format!("render s.toml -q -o x.exr --integrator {integrator}")),
            2,
        );
        assert!(
            words.contains("abbe") && words.contains("path, naive, one-sample"),
            "{words}"
        );
    }
    let rough = split("render s.toml -q -o x.exr --set material.g.roughness=0.5");
    let words = refused(folder.path(), &rough, 1);
    assert!(words.contains("smooth glass"), "{words}");
}
