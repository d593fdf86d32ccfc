//! Renders against closed forms.

use crate::support::statistics::{Mean, assert_means_within};
use crate::support::*;
use embrasure::camera::{Aperture, Camera};
use embrasure::color::Spectrum;
use embrasure::film::{Film, Filter, FilterKind, Rect};
use embrasure::integrator::{AmbientOcclusion, DirectLight, PathIntegrator, Roulette, Strategy, Survival, World};
use embrasure::light_sampling::LightChoice;
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec3};
use embrasure::scene::{Scene, SceneBuilder};
use std::f64::consts::PI;

/// A room of reflectance `rho` whose walls emit `e`.
fn glowing_room(rho: f32, e: f32) -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(rho, e));
    b.build().unwrap().0
}

#[test]
fn closed_box_shows_the_geometric_series() {
    let scene = glowing_room(0.5, 1.0);
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.3), Vec3::new(1.0, 0.2, 0.5), 90.0);
    for (max_depth, expected) in [
        (Some(0), 1.0),
        (Some(1), 1.5),
        (Some(3), 1.875),
        (Some(6), 2.0 - 0.5f64.powi(6)),
        (None, 2.0),
    ] {
        // With fewer samples, means are too far from normal.
        let film = render_film(&scene, camera, [24, 24], budget(2048).max(512), max_depth);
        assert_unbiased(&format!("max_depth {max_depth:?}"), &film, expected);
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn roulette_keeps_the_mean_of_long_paths() {
    // The radiance is e / (1 − ρ) = 10. Nearly all of this light comes from paths after roulette
    // starts.
    let scene = glowing_room(0.9, 1.0);
    let camera = pinhole(Vec3::ZERO, Vec3::new(1.0, 0.3, -0.2), 90.0);
    let film = render_film(&scene, camera, [24, 24], budget(2048), None);
    assert_unbiased("ρ = 0.9", &film, 10.0);
}

/// The radiance in a closed room does not depend on the roulette depth.
#[test]
fn roulette_at_depth_0_keeps_the_mean() {
    let scene = glowing_room(0.5, 1.0);
    let camera = pinhole(Vec3::ZERO, Vec3::new(1.0, 0.3, -0.2), 90.0);
    let resolution = UVec2::splat(96);
    let film = with_world(&scene, camera, resolution, |world| {
        let integrator = PathIntegrator {
            roulette: Roulette::after(0),
            ..path_tracer(world, None)
        };
        film_of(&integrator, resolution, 256, 0)
    });
    // The radiance of the room is e / (1 - ρ)
    assert_unbiased("roulette from 0", &film, 2.0);
}

/// A path that survives each scattering with the probability p has the value Σ (ρ/p)ᵏ, summed up to
/// the scattering N that ends the path. P(N ≥ k) is pᵏ. If the walls of a room emit 1, the mean is
/// 1 / (1 − ρ), and the second moment is (1 + ρ) / ((1 − ρ²/p) (1 − ρ)).
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn constant_survival_has_its_variance() {
    let resolution = UVec2::splat(96);
    let (rho, p) = (0.5, 0.8);
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.3), Vec3::new(1.0, 0.2, 0.5), 90.0);
    let film = with_world(&glowing_room(rho as f32, 1.0), camera, resolution, |world| {
        let integrator = PathIntegrator {
            strategy: Strategy {
                direct: DirectLight::None,
                ..Strategy::default()
            },
            roulette: Roulette {
                depth: 0,
                survival: Survival::Constant(p as f32),
            },
            ..path_tracer(world, None)
        };
        film_by(&independent(0), &integrator, resolution, 256)
    });
    assert_unbiased("constant survival", &film, 1.0 / (1.0 - rho));
    let pixels: Vec<f64> = film
        .pixels()
        .map(|(_, sums)| 256.0 * sums.variance_of_mean(0))
        .collect();
    let variance = pixels.iter().sum::<f64>() / pixels.len() as f64;
    let expected = (1.0 + rho) / ((1.0 - rho * rho / p) * (1.0 - rho)) - (1.0 - rho).powi(-2);
    // The standard error of the estimate is 0.06 %.
    assert!(
        (variance / expected - 1.0).abs() < 0.003,
        "{variance}, expected {expected}"
    );
}

/// A glass box in uniform light: reflection, refraction and total reflection sum to the light
/// behind it.
#[test]
fn glass_box_in_uniform_light_is_invisible() {
    let mut b = SceneBuilder::new();
    let glass = Material {
        transmission: Spectrum::ONE,
        ior: 1.5,
        ..material(0.0, 0.0)
    };
    let mut cube = room();
    cube.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    add(&mut b, cube, glass);
    b.add_constant_light(Spectrum::ONE).unwrap();
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(2.0, 1.7, 3.0), Vec3::ZERO, 45.0);
    let film = render_film(&scene, camera, [64, 64], 256, None);
    let mean = film_mean(&film, 0);
    assert!((mean - 1.0).abs() < 2e-3, "mean {mean}");
    // Inside the glass, radiance is η² times the radiance outside. No pixel may contain this
    // factor.
    for value in &film.develop().channels[0].values {
        assert!(*value < 1.2, "a pixel of {value}");
    }
}

#[test]
fn paths_without_absorption_end() {
    let camera = pinhole(Vec3::ZERO, Vec3::new(1.0, 0.3, -0.2), 90.0);
    let resolution = UVec2::splat(8);
    let (film, statistics) = with_world(&glowing_room(1.0, 1.0), camera, resolution, |world| {
        let mut film = Film::new(resolution, Rect::full(resolution));
        let statistics = render_into(&mut film, &path_tracer(world, None), &independent(0), 16);
        (film, statistics)
    });
    assert!(film.pixels().all(|(_, sums)| sums.mean(0).is_finite()));
    let rays = statistics.rays.total() as f64 / (16.0 * 64.0);
    assert!(rays < 500.0, "{rays} rays a path");
}

// The backend `brute` would take minutes.
#[cfg(any(feature = "embree", feature = "obvhs"))]
#[test]
fn white_furnace_hides_a_white_object() {
    let mut b = SceneBuilder::new();
    add(&mut b, sphere(1.0, Vec3::ZERO, 3), material(1.0, 0.0));
    b.add_constant_light(Spectrum::ONE).unwrap();
    let scene = b.build().unwrap().0;
    let film = render_film(
        &scene,
        pinhole(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO, 50.0),
        [64, 64],
        512,
        None,
    );
    assert_unbiased("furnace", &film, 1.0);
}

/// Adds a large floor at y = 0 of reflectance `rho`, facing up.
fn floor(b: &mut SceneBuilder, rho: f32) {
    let s = 50.0;
    let corners = [
        Vec3::new(-s, 0.0, s),
        Vec3::new(s, 0.0, s),
        Vec3::new(s, 0.0, -s),
        Vec3::new(-s, 0.0, -s),
    ];
    add(b, polygon(&corners), material(rho, 0.0));
}

/// Radiance of the floor at `p`, seen through a tiny field of view, with its standard error.
fn floor_radiance(scene: &Scene, p: Vec3, spp: u32) -> Mean {
    let camera = pinhole(p + Vec3::new(0.4, 0.7, 1.0), p, 0.01);
    Mean::of_film(&render_film(scene, camera, [8, 8], spp, Some(1)), 0)
}

#[test]
fn irradiance_under_a_point_light() {
    let (rho, intensity, position) = (0.6, 7.0, Vec3::new(0.5, 2.0, -0.3));
    let mut b = SceneBuilder::new();
    floor(&mut b, rho);
    b.add_point_light(position, Spectrum::splat(intensity)).unwrap();
    let scene = b.build().unwrap().0;
    for p in [
        Vec3::new(0.5, 0.0, -0.3),
        Vec3::new(2.0, 0.0, 1.0),
        Vec3::new(-6.0, 0.0, 3.0),
    ] {
        let to_light = (position - p).as_dvec3();
        let cosine = to_light.normalize().y;
        let expected = rho as f64 / PI * intensity as f64 * cosine / to_light.length_squared();
        let radiance = floor_radiance(&scene, p, 16).value;
        assert!(
            (radiance / expected - 1.0).abs() < 1e-3,
            "{p}: {radiance}, expected {expected}"
        );
    }
}

/// Irradiance at `p` on a surface of normal +y from a uniform polygonal emitter above the surface:
/// Lambert's formula, `E = L/2 Σ γᵢ Γᵢ·n` over the edges (Arvo 1994, eq. 4).
fn lambert_irradiance(p: Vec3, corners: &[Vec3], radiance: f64) -> f64 {
    let edges = (0..corners.len()).map(|i| {
        let [a, b] = [corners[i], corners[(i + 1) % corners.len()]].map(|c| (c - p).as_dvec3().normalize());
        a.angle_between(b) * a.cross(b).normalize().y
    });
    (0.5 * radiance * edges.sum::<f64>()).abs()
}

#[test]
fn irradiance_under_polygonal_emitters() {
    // Both polygons face down: their corners run counter-clockwise seen from below.
    let quad = [
        Vec3::new(-0.5, 1.5, -0.5),
        Vec3::new(0.7, 1.5, -0.5),
        Vec3::new(0.7, 1.5, 0.6),
        Vec3::new(-0.5, 1.5, 0.6),
    ];
    let tilted = [
        Vec3::new(-1.0, 1.0, 0.2),
        Vec3::new(0.9, 2.5, -0.4),
        Vec3::new(0.1, 1.2, 1.4),
    ];
    let (rho, radiance) = (0.8, 3.0);
    for corners in [&quad[..], &tilted[..]] {
        let mut b = SceneBuilder::new();
        floor(&mut b, rho);
        add(&mut b, polygon(corners), material(0.0, radiance));
        let scene = b.build().unwrap().0;
        for p in [Vec3::ZERO, Vec3::new(1.5, 0.0, 0.7), Vec3::new(-0.4, 0.0, 0.9)] {
            let expected = rho as f64 / PI * lambert_irradiance(p, corners, radiance as f64);
            let got = floor_radiance(&scene, p, 4096);
            assert_means_within(p, got, Mean::exact(expected), 1e-4 * expected);
            assert!(got.error() < 2e-3 * expected, "{got}: the error is too large");
        }
    }
}

#[test]
fn the_back_of_an_emitter_is_dark() {
    let corners = [
        Vec3::new(-1.0, 1.5, -1.0),
        Vec3::new(-1.0, 1.5, 1.0),
        Vec3::new(1.0, 1.5, 1.0),
        Vec3::new(1.0, 1.5, -1.0),
    ];
    let mut b = SceneBuilder::new();
    floor(&mut b, 0.8);
    add(&mut b, polygon(&corners), material(0.0, 3.0));
    let scene = b.build().unwrap().0;
    assert_eq!(floor_radiance(&scene, Vec3::ZERO, 256).value, 0.0);
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn circle_of_confusion() {
    // A quad at depth 6 that is smaller than its blur, seen by a lens of radius 0.1 that is focused
    // at 2.
    let (lens, focus, depth, fov, height) = (0.1, 2.0, 6.0, 40.0f32, 128);
    let s = 0.05;
    let corners = [
        Vec3::new(-s, -s, -depth),
        Vec3::new(s, -s, -depth),
        Vec3::new(s, s, -depth),
        Vec3::new(-s, s, -depth),
    ];
    let mut b = SceneBuilder::new();
    add(&mut b, polygon(&corners), material(0.0, 1000.0));
    let scene = b.build().unwrap().0;
    let mut camera = pinhole(Vec3::ZERO, Vec3::NEG_Z, fov);
    (camera.lens_radius, camera.focus_distance) = (lens, focus);
    let film = render_film(&scene, camera, [height, height], 512, Some(0));

    // By similar triangles, a ray through the lens at the distance l from the axis is displaced by
    // l (z − f) / z in the plane of focus. The distance of this plane in pixels is f ×
    // pixels-per-unit.
    let pixels_per_unit = height as f64 / (2.0 * (0.5 * fov as f64).to_radians().tan());
    let radius = lens as f64 * (depth - focus) as f64 / (depth * focus) as f64 * pixels_per_unit;

    let center = height as f64 / 2.0;
    let (mut weight, mut second, mut farthest) = (0.0, 0.0, 0.0f64);
    for (pixel, sums) in film.pixels() {
        let (dx, dy) = (pixel.x as f64 + 0.5 - center, pixel.y as f64 + 0.5 - center);
        weight += sums.mean(0);
        second += sums.mean(0) * (dx * dx + dy * dy);
        if sums.mean(0) > 0.0 {
            farthest = farthest.max(dx.hypot(dy));
        }
    }
    // A uniform disk has E r² = R²/2. The size of the pixels adds 1/6, and the quad adds 2/3 of its
    // squared half-width.
    let source = s as f64 / depth as f64 * pixels_per_unit;
    let expected = radius * radius / 2.0 + 1.0 / 6.0 + 2.0 / 3.0 * source * source;
    assert!(
        (second / weight / expected - 1.0).abs() < 0.02,
        "E r² = {}, expected {expected}",
        second / weight
    );
    let edge = radius + source * 2f64.sqrt();
    assert!((farthest - edge).abs() < 1.0, "edge at {farthest}, expected {edge}");
}

/// The blur of a point has the shape of the aperture. A regular polygon with corners at distance R
/// has E r² = R²/6 (2 + cos 2π/n). A blurred point behind the plane of focus has the orientation of
/// the aperture.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn blades_shape_the_circle_of_confusion() {
    let (lens, focus, depth, fov, height) = (0.1, 2.0, 6.0, 40.0f32, 64);
    let s = 0.05;
    let corners = [[-s, -s], [s, -s], [s, s], [-s, s]].map(|[x, y]| Vec3::new(x, y, -depth));
    let mut b = SceneBuilder::new();
    add(&mut b, polygon(&corners), material(0.0, 1000.0));
    let scene = b.build().unwrap().0;
    let mut parameters = pinhole(Vec3::ZERO, Vec3::NEG_Z, fov);
    (parameters.lens_radius, parameters.focus_distance) = (lens, focus);
    let pixels_per_unit = height as f64 / (2.0 * (0.5 * fov as f64).to_radians().tan());
    let radius = lens as f64 * (depth - focus) as f64 / (depth * focus) as f64 * pixels_per_unit;
    let source = s as f64 / depth as f64 * pixels_per_unit;
    for blades in [3, 5, 6] {
        let resolution = UVec2::splat(height);
        let aperture = Aperture { blades, rotation: 90.0 };
        let camera = Camera::new(parameters, resolution).and_then(|camera| camera.with_aperture(aperture));
        let film = with_camera(&scene, camera.unwrap(), |world| {
            film_of(&path_tracer(world, Some(0)), resolution, budget(4096), 0)
        });
        let center = height as f64 / 2.0;
        let (mut weight, mut second, mut third) = (0.0, 0.0, 0.0);
        for (pixel, sums) in film.pixels() {
            let (x, y) = (pixel.x as f64 + 0.5 - center, center - pixel.y as f64 - 0.5);
            weight += sums.mean(0);
            second += sums.mean(0) * (x * x + y * y);
            third += sums.mean(0) * (3.0 * x * x * y - y * y * y);
        }
        let turn = 2.0 * PI / f64::from(blades);
        let expected = radius * radius / 6.0 * (2.0 + turn.cos()) + 1.0 / 6.0 + 2.0 / 3.0 * source * source;
        assert!(
            (second / weight / expected - 1.0).abs() < 0.02 * slack(),
            "{blades}: {}",
            second / weight
        );
        // For a triangle, E (x + iy)³ is a tenth of (x + iy)³ at its corners. At an upper corner (x
        // + iy)³ is −i R³.
        if blades == 3 {
            let expected = -radius.powi(3) / 10.0;
            assert!(
                (third / weight / expected - 1.0).abs() < 0.1 * slack(),
                "{}",
                third / weight / expected
            );
        }
    }
}

#[test]
fn objects_in_the_plane_of_focus_are_sharp() {
    let s = 0.2;
    let corners = [
        Vec3::new(-s, -s, -2.0),
        Vec3::new(s, -s, -2.0),
        Vec3::new(s, s, -2.0),
        Vec3::new(-s, s, -2.0),
    ];
    let mut b = SceneBuilder::new();
    add(&mut b, polygon(&corners), material(0.0, 1.0));
    let scene = b.build().unwrap().0;
    let sharp = pinhole(Vec3::ZERO, Vec3::NEG_Z, 40.0);
    let mut lens = sharp;
    (lens.lens_radius, lens.focus_distance) = (0.5, 2.0);
    let [a, b] = [sharp, lens].map(|c| render_film(&scene, c, [64, 64], 64, Some(0)).develop());
    let differ = a.rgb().zip(b.rgb()).filter(|(a, b)| (a[0] - b[0]).abs() > 0.02).count();
    assert!(differ <= 4, "{differ} pixels differ");
}

/// Across a straight edge between light and dark, the value of a pixel is the integral of its
/// filter up to the edge.
#[test]
fn filters_blur_an_edge_by_their_integral() {
    // The camera is at a height of 4, with a field of view of 90 degrees. Each of the 8 pixels is
    // one unit wide, so the edge at x = 0.3 is at 4.3 on the film.
    let mut b = SceneBuilder::new();
    let (left, right) = (-20.0, 0.3);
    let corner = |x, y| Vec3::new(x, y, 0.0);
    let lamp = [
        corner(left, -20.0),
        corner(right, -20.0),
        corner(right, 20.0),
        corner(left, 20.0),
    ];
    add(&mut b, polygon(&lamp), material(0.0, 1.0));
    let scene = b.build().unwrap().0;
    let resolution = UVec2::splat(8);
    let camera = Camera::new(pinhole(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 90.0), resolution).unwrap();
    let accel = backend(&scene);
    let accel: Backend = &accel;

    let gaussian = |x: f64| (-0.5 * (x / 0.5).powi(2)).exp() - (-4.5f64).exp();
    let harris = |x: f64| {
        let cosine = |k: f64| (PI * k * x / 1.5).cos();
        0.35875 + 0.48829 * cosine(1.0) + 0.14128 * cosine(2.0) + 0.01168 * cosine(3.0)
    };
    // Mitchell and Netravali 1988, eq. 8 with B = C = 1/3
    let mitchell = |x: f64| match x.abs() {
        x if x < 1.0 => 7.0 * x.powi(3) - 12.0 * x * x + 16.0 / 3.0,
        x => -7.0 / 3.0 * x.powi(3) + 12.0 * x * x - 20.0 * x + 32.0 / 3.0,
    };
    type Shape<'a> = (FilterKind, f64, &'a dyn Fn(f64) -> f64);
    let shapes: [Shape; 5] = [
        (FilterKind::Box, 0.5, &|_| 1.0),
        (FilterKind::Tent, 1.0, &|x: f64| 1.0 - x.abs()),
        (FilterKind::Gaussian, 1.5, &gaussian),
        (FilterKind::Mitchell, 2.0, &mitchell),
        (FilterKind::BlackmanHarris, 1.5, &harris),
    ];
    for (kind, radius, f) in shapes {
        let filter = Filter::new(kind, radius as f32);
        let selection = scene.light_selection(LightChoice::default());
        let world = World::new(&scene, &accel, &selection, &camera, &filter);
        let integrator = path_tracer(world, Some(0));
        let film = film_of(&integrator, resolution, 4096, 0);
        let integral = |to: f64| {
            let steps = 20_000;
            let x = |i: usize| -radius + (to + radius) * (i as f64 + 0.5) / steps as f64;
            (0..steps).map(|i| f(x(i))).sum::<f64>() * (to + radius)
        };
        let mut grey = 0;
        for (pixel, sums) in film.pixels() {
            let edge = (4.3 - (pixel.x as f64 + 0.5)).clamp(-radius, radius);
            let expected = integral(edge) / integral(radius);
            let got = Mean::new(sums.mean(0), sums.variance_of_mean(0).sqrt());
            grey += usize::from(got.error() > 1e-3);
            assert_means_within(
                format!("{kind:?}, column {}", pixel.x),
                got,
                Mean::exact(expected),
                1e-4,
            );
        }
        assert!(grey >= 8, "{kind:?}: {grey} pixels see the edge");
    }
}

/// Two plates are at a distance h. A ray of direction θ is free for the length h / cos θ. For
/// directions with cosine density, cos² θ is uniform. So the fraction of rays that are free for a
/// distance d is (h / d)², and half of the rays hit the other plate within √2 h.
#[test]
fn ambient_occlusion_between_plates() {
    const H: f32 = 1.5;
    let mut b = SceneBuilder::new();
    for y in [0.0, H] {
        let corners =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| Vec3::new(300.0 * x, y, 300.0 * z));
        add(&mut b, polygon(&corners), material(0.5, 0.0));
    }
    let (scene, _) = b.build().unwrap();
    let camera = pinhole(Vec3::new(0.0, 0.5 * H, 0.0), Vec3::new(0.0, 0.0, 1.0), 60.0);
    let resolution = UVec2::splat(32);
    with_world(&scene, camera, resolution, |world| {
        for distance in [0.5 * H, 1.4 * H, 2.0 * H] {
            let film = film_of(&AmbientOcclusion { world, distance }, resolution, 256, 0);
            assert_unbiased(
                &format!("within {distance}"),
                &film,
                f64::from(H / distance).powi(2).min(1.0),
            );
        }
        // The default distance is half of the median free length. 1024 directions give the median
        // with an error of a few percent.
        let usual = AmbientOcclusion::usual_distance(&world);
        let expected = H * std::f32::consts::FRAC_1_SQRT_2;
        assert!((usual / expected - 1.0).abs() < 0.08, "{usual}, expected {expected}");
    });
    // If most rays hit nothing, the distance is the diameter of the scene.
    let mut b = SceneBuilder::new();
    add(&mut b, panel(0.0, 1.0), material(0.5, 0.0));
    let (scene, _) = b.build().unwrap();
    with_world(&scene, from_front(), resolution, |world| {
        let diameter = 2.0 * scene.bounds().radius();
        assert_eq!(AmbientOcclusion::usual_distance(&world), diameter);
    });
}
