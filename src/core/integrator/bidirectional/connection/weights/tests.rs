//! Tests of MIS weights. Weights computed in one pass equal the sum over all strategies of a path,
//! and densities along delta lobes are equal from both ends.

use super::super::{Merging, Subpaths};
use super::*;
use crate::accel::brute::BruteForce;
use crate::bsdf::Fresnel;
use crate::camera::{Camera, CameraParameters};
use crate::color::Spectrum;
use crate::film::Filter;
use crate::geometry::Mesh;
use crate::integrator::bidirectional::subpath::MAX_VERTICES;
use crate::integrator::{Heuristic, NullRaySink, Radii, Roulette, SearchRadius, World};
use crate::material::{Gloss, Material};
use crate::math::UVec2;
use crate::sampler::{Dimension, Independent, SampleKey, Sampler};
use crate::scene::SceneBuilder;

fn matte(diffuse: f32) -> Material {
    Material {
        name: "m".into(),
        diffuse: Spectrum::splat(diffuse),
        ..Material::default()
    }
}

fn add(b: &mut SceneBuilder, positions: &[[f32; 3]], triangles: &[[u32; 3]], material: Material) {
    let mesh = Mesh {
        positions: positions.iter().map(|&p| Vec3::from(p)).collect(),
        triangles: triangles.to_vec(),
        ..Mesh::default()
    };
    let id = b.add_material(material).unwrap();
    b.add_mesh(mesh, id).unwrap();
}

const QUAD: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

/// Calls `look` with connectors for a closed matte room with a lamp, a mirror and a glass prism:
/// one connector for each heuristic, with and without merging.
fn in_room(mut look: impl FnMut(&Connector<BruteForce>)) {
    let mut b = SceneBuilder::new();
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 2.0 } else { 0.0 });
    let sides = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    for side in sides {
        add(&mut b, &side.map(corner), &QUAD, matte(0.7));
    }
    let lamp = Material {
        emission: Spectrum::splat(3.0),
        ..matte(0.4)
    };
    let at = [[0.6, 1.9, 0.6], [1.4, 1.9, 0.6], [1.4, 1.9, 1.4], [0.6, 1.9, 1.4]];
    add(&mut b, &at, &QUAD, lamp);
    let mirror = Material {
        specular: Spectrum::splat(0.9),
        gloss: Gloss::Mirror(Fresnel::Full),
        ..matte(0.0)
    };
    let at = [[0.1, 0.1, 0.2], [0.1, 1.9, 0.1], [0.2, 1.9, 1.9], [0.1, 0.1, 1.8]];
    add(&mut b, &at, &QUAD, mirror);
    let glass = Material {
        transmission: Spectrum::ONE,
        ..matte(0.0)
    };
    let at = [[0.8, 0.2, 0.7], [1.5, 0.2, 0.8], [1.1, 0.2, 1.5], [1.1, 1.1, 1.0]];
    add(&mut b, &at, &[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], glass);
    let scene = b.build().unwrap().0;
    let accel = BruteForce::new(&scene);
    let parameters = CameraParameters {
        position: Vec3::new(1.8, 1.2, 1.7),
        look_at: Vec3::new(0.6, 0.7, 0.7),
        up: Vec3::Y,
        vertical_fov: 80.0,
        lens_radius: 0.01,
        focus_distance: 1.0,
    };
    let camera = Camera::new(parameters, UVec2::splat(16)).unwrap();
    let selection = scene.light_selection(crate::light_sampling::LightChoice::default());
    let world = World::new(&scene, &accel, &selection, &camera, &Filter::BOX);
    let ball = scene.ball();
    let radii = Radii::new(SearchRadius::Fixed(0.05), 1.0, &camera, &ball);
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        for merging in [
            None,
            Some(Merging {
                paths: 256.0,
                radii: &radii,
            }),
        ] {
            look(&Connector {
                merging,
                ..Connector::new(&world, heuristic, Roulette::after(u32::MAX), Some(6))
            });
        }
    }
}

fn each_sample(connector: &Connector<BruteForce>, count: u32, mut look: impl FnMut(&Subpaths)) {
    let mut sampler = Independent::new(3);
    for i in 0..count {
        let key = SampleKey::new(i % 16, i / 16 % 16, i / 256);
        sampler.start(key);
        let film = key.pixel().as_vec2() + sampler.get_2d(Dimension::PIXEL);
        let ray = connector.world.ray_through(film, 0.0, &sampler);
        look(&connector.subpaths(ray, &sampler, &mut NullRaySink));
    }
}

/// MIS weight computed as the sum over all strategies, vertex by vertex.
fn summed(
    connector: &Connector<BruteForce>,
    camera: &[PathVertex],
    light: &[PathVertex],
    light_hit: Option<LightHit>,
    is_merged: bool,
) -> f64 {
    let (s, t) = (light.len(), camera.len());
    let n = s + t;
    let end = &camera[t - 1];
    let densities = match light_hit {
        Some(light_hit) => connector.densities_at_light_hit(end, camera[..t - 1].last(), light_hit, 0.0),
        None => connector.densities(camera, light, is_merged, 0.0),
    };
    let at = |i: usize| if i < t { &camera[i] } else { &light[n - 1 - i] };

    // Compute the densities of each vertex from both ends
    let (mut from_camera, mut from_light) = ([0.0f64; MAX_VERTICES], [0.0f64; MAX_VERTICES]);
    let mut is_delta = [false; MAX_VERTICES];
    for i in 0..n {
        let [own, other] = [at(i).forward, at(i).reverse].map(f64::from);
        (from_camera[i], from_light[i]) = if i < t { (own, other) } else { (other, own) };
        is_delta[i] = at(i).is_delta && i != t - 1 && (i != t || is_merged);
    }
    from_light[t - 1] = densities.end.into();
    if t > 1 {
        from_light[t - 2] = densities.previous.into();
    }
    if s > 0 {
        from_camera[t] = densities.other.into();
    }
    if s > 1 {
        from_camera[t + 1] = densities.next.into();
    }
    let direct = match s {
        0..=2 => densities.direct,
        _ => connector.direct(at(n - 1), at(n - 2), Some(at(n - 2).direction_to(at(n - 3))), 0.0),
    };
    let sampled = direct as f64 / from_light[n - 1];
    let merged = |i: usize| match &connector.merging {
        Some(merging) if (1..n - 1).contains(&i) && !is_delta[i] => {
            let can_merge = at(i).surface().is_some_and(|surface| !surface.bsdf.is_delta());
            f64::from(u8::from(can_merge)) * merging.acceptance(at(i).p, 0.0) * from_light[i]
        }
        _ => 0.0,
    };
    let connected = |t: usize| match t {
        t if t < n && (is_delta[t - 1] || is_delta[t]) => 0.0,
        t if t == n - 1 => sampled,
        _ => 1.0,
    };

    // Density of another strategy, relative to the connection here
    let over_this = |other: usize| {
        let ratio = |i: usize| from_light[i] / from_camera[i];
        let before: f64 = (other..t).map(ratio).product();
        let after: f64 = (t..other).map(ratio).product();
        before / after
    };
    let raised = |density: f64| connector.heuristic.raised(density);
    let all = |other: usize| raised(over_this(other) * connected(other)) + raised(over_this(other) * merged(other - 1));
    let own = if is_merged { merged(t - 1) } else { connected(t) };
    raised(own) / (1..=n).map(all).sum::<f64>()
}

#[test]
fn one_pass_gives_the_sum_over_all_strategies() {
    let mut compared = [0; 3];
    in_room(|connector| {
        each_sample(connector, 512, |paths| {
            let mut assert_same = |(s, t): (usize, usize), light_hit: Option<LightHit>, is_merged: bool| {
                let (camera, light) = (&paths.camera[..t], &paths.light[..s]);
                let weight = connector.weight_of(camera, light, light_hit, 0.0, is_merged) as f64;
                let expected = summed(connector, camera, light, light_hit, is_merged);
                if expected.is_finite() {
                    let error = (weight - expected).abs();
                    assert!(
                        error <= 1e-6 * expected + 1e-30,
                        "({s}, {t}), {is_merged}: {weight}, {expected}"
                    );
                    compared[if light_hit.is_some() {
                        0
                    } else {
                        1 + usize::from(is_merged)
                    }] += 1;
                }
            };
            for t in 1..=paths.camera.len() {
                let end = paths.camera[t - 1].surface();
                if let Some(light) = end.and_then(|surface| {
                    let before = LightSampleContext::any_side(paths.camera[t - 2].p);
                    surface.emitted(connector.world, &before)
                }) {
                    let direct = paths.camera[t - 2].density_at(light.pdf, &paths.camera[t - 1]);
                    assert_same(
                        (0, t),
                        Some(LightHit {
                            light: light.id,
                            direct,
                        }),
                        false,
                    );
                }
                let can_connect = |vertex: &PathVertex| vertex.surface().is_none_or(|surface| !surface.bsdf.is_delta());
                for s in (1..=paths.light.len()).filter(|_| can_connect(&paths.camera[t - 1])) {
                    if can_connect(&paths.light[s - 1]) {
                        assert_same((s, t), None, false);
                    }
                    if connector.merging.is_some() && t > 1 {
                        assert_same((s, t), None, true);
                    }
                }
            }
        });
    });
    assert!(compared.iter().all(|&count| count > 200), "{compared:?}");
}

/// A path over mirrors and through glass between two matte surfaces has the same density from both
/// ends. The matte surfaces at both ends sample directions with a density proportional to the
/// cosine. A delta lobe changes the width of a beam, and the reverse lobe restores it.
#[test]
fn density_along_delta_lobes_is_equal_from_both_ends() {
    let (mut mirrors, mut refractions) = (0, 0);
    in_room(|connector| {
        each_sample(connector, 1024, |paths| {
            for path in [&paths.camera, &paths.light] {
                // Find chains of delta lobes between two matte vertices. The path continues after
                // the second one
                let mut start = 1;
                for end in 2..path.len().saturating_sub(1) {
                    if path[end].is_delta {
                        continue;
                    }
                    if !path[start].is_delta && end > start + 1 {
                        let back: f64 = path[start..end].iter().map(|vertex| vertex.reverse as f64).product();
                        let forth: f64 = path[start + 1..=end]
                            .iter()
                            .map(|vertex| vertex.forward as f64)
                            .product();
                        assert!((back / forth - 1.0).abs() < 1e-3, "{start} to {end}: {}", back / forth);
                        match end - start {
                            2 => mirrors += 1,
                            _ => refractions += 1,
                        }
                    }
                    start = end;
                }
            }
        });
    });
    assert!(mirrors > 100 && refractions > 100, "{mirrors}, {refractions}");
}
