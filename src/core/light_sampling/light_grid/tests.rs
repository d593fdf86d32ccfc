use super::*;
use crate::color::Spectrum;
use crate::light::{ConstantLight, DirectionalLight, PointLight, SpotLight, TriangleLight, TriangleSampling};
use crate::math::Vec2;
use crate::math::hash::{mix, unit_f32};

/// Pseudo-random numbers in [0, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 += 1;
        unit_f32(mix(self.0))
    }

    fn vector(&mut self) -> Vec3 {
        2.0 * Vec3::new(self.next(), self.next(), self.next()) - 1.0
    }
}

const BOX: Bounds3 = Bounds3 {
    min: Vec3::NEG_ONE,
    max: Vec3::ONE,
};

fn triangle(corners: [Vec3; 3]) -> Light {
    Light::from(TriangleLight::new(
        corners,
        Spectrum::splat(3.0),
        TriangleSampling::Area,
    ))
}

fn point(position: Vec3, intensity: f32) -> Light {
    Light::Point(PointLight {
        position,
        intensity: Spectrum::splat(intensity),
    })
}

fn grid(lights: &[Light]) -> LightGrid {
    let powers: Vec<f64> = lights.iter().map(|l| l.power(2.0)).collect();
    LightGrid::new(lights, &powers, BOX, 2.0).unwrap()
}

/// Triangles of all sizes and directions, points, spots, a sun and a sky. One light has no power.
fn mixed(count: usize, numbers: &mut Numbers) -> Vec<Light> {
    let mut lights: Vec<Light> = (0..count)
        .map(|i| match i % 4 {
            0 => point(numbers.vector(), 10f32.powf(3.0 * numbers.next())),
            1 => Light::Spot(SpotLight {
                position: numbers.vector(),
                direction: numbers.vector().normalize(),
                intensity: Spectrum::splat(5.0),
                cos_inner: 0.8,
                cos_outer: -0.2 + 0.9 * numbers.next(),
            }),
            _ => {
                let (p, size) = (numbers.vector(), 2.0 * numbers.next().powi(4));
                triangle([p, p + size * numbers.vector(), p + size * numbers.vector()])
            }
        })
        .collect();
    lights.push(point(Vec3::ZERO, 0.0));
    lights.push(Light::Directional(DirectionalLight {
        direction: Vec3::NEG_Y,
        irradiance: Spectrum::splat(2.0),
    }));
    lights.push(Light::Constant(ConstantLight {
        radiance: Spectrum::splat(0.1),
    }));
    lights
}

/// 1600 lamps over a plane, some of them directed downwards, and a sun and a sky. There are many
/// lamps around each cell of the grid near the plane.
fn plain(numbers: &mut Numbers) -> Vec<Light> {
    let mut lights = mixed(0, numbers);
    lights.extend((0..1600u32).map(|i| {
        let p = Vec3::new(0.05 * (i % 40) as f32 - 1.0, -0.5, 0.05 * (i / 40) as f32 - 1.0);
        match i % 3 {
            0 => triangle([p, p + 0.01 * Vec3::X, p + 0.01 * Vec3::Z]),
            _ => point(p, 0.5 + numbers.next()),
        }
    }));
    lights
}

/// Points at a light, invalid points, and distant points have probabilities that sum to 1.
#[test]
fn descents_have_probabilities_at_every_point() {
    let lights = plain(&mut Numbers(8));
    let grid = grid(&lights);
    let near = Vec3::new(0.05 * 7.0 - 1.0, -0.5, 0.05 * 9.0 - 1.0);
    assert!(grid.is_dense(near));
    for p in [
        near,
        near + 1e-30 * Vec3::X,
        near - 1e-3 * Vec3::Y,
        Vec3::ZERO,
        Vec3::NAN,
        Vec3::INFINITY,
        1e15 * Vec3::X,
    ] {
        for n in [Vec3::ZERO, Vec3::Y, Vec3::NEG_Y, Vec3::X] {
            let context = LightSampleContext { p, n };
            let pmf = |i: usize| f64::from(grid.pmf(&lights, &context, LightId(i as u32)));
            let sum: f64 = (0..lights.len()).map(pmf).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{p} {n}: {sum}");
            let (id, probability) = grid.sample(&lights, &context, 0.7).unwrap();
            assert_eq!(f64::from(probability), pmf(id.0 as usize), "{p} {n}");
        }
    }
}

fn scenes() -> Vec<(&'static str, Vec<Light>)> {
    let mut numbers = Numbers(7);
    let p = Vec3::new(0.3, 0.2, -0.4);
    let small = |p: Vec3| triangle([p, p + 1e-6 * Vec3::X, p + 1e-6 * Vec3::Y]);
    vec![
        ("one", vec![point(p, 2.0)]),
        ("one, and one without area", vec![triangle([p; 3]), point(p, 2.0)]),
        ("a few", mixed(9, &mut numbers)),
        ("many", mixed(700, &mut numbers)),
        (
            "in one place",
            (0..300).map(|i| point(p, 1.0 + (i % 5) as f32)).collect(),
        ),
        (
            "the same triangle",
            (0..100).map(|_| triangle([p, p + Vec3::X, p + Vec3::Z])).collect(),
        ),
        ("hardly any extent", (0..90).map(|_| small(numbers.vector())).collect()),
        (
            "outside of the scene",
            (0..90).map(|_| point(100.0 * numbers.vector(), 1.0)).collect(),
        ),
        ("at infinity", mixed(0, &mut numbers).into_iter().rev().collect()),
        ("a plain of lamps", plain(&mut numbers)),
    ]
}

fn context(numbers: &mut Numbers) -> LightSampleContext {
    let far = [0.2, 1.0, 1.0, 20.0][(4.0 * numbers.next()) as usize];
    let n = match numbers.next() {
        x if x < 0.2 => Vec3::ZERO,
        x if x < 0.4 => Vec3::NEG_Z,
        _ => numbers.vector().normalize(),
    };
    LightSampleContext {
        p: far * numbers.vector(),
        n,
    }
}

/// Probabilities sum to 1 and equal the frequencies of the lights.
#[test]
fn draws_have_their_probabilities() {
    let mut numbers = Numbers(1);
    for (name, lights) in scenes() {
        let grid = grid(&lights);
        for _ in 0..6 {
            let context = context(&mut numbers);
            let pmf = |i: usize| grid.pmf(&lights, &context, LightId(i as u32));
            let sum: f64 = (0..lights.len()).map(|i| pmf(i) as f64).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{name}: {sum}");
            const N: u32 = 1 << 16;
            let mut counts = vec![0u32; lights.len()];
            for k in 0..N {
                let (id, p) = grid.sample(&lights, &context, (k as f32 + 0.5) / N as f32).unwrap();
                counts[id.0 as usize] += 1;
                assert_eq!(p, pmf(id.0 as usize), "{name}");
            }
            // The numbers (k + ½) / N are evenly spaced, and the two intervals of a light (by power
            // and by place) have the length `pmf` together. They contain `pmf` · N of these
            // numbers, up to one number at each end.
            for (i, &count) in counts.iter().enumerate() {
                let expected = pmf(i) * N as f32;
                assert!((count as f32 - expected).abs() < 4.1, "{name} {i}: {count} {expected}");
            }
        }
    }
}

#[test]
fn lights_that_reach_a_point_have_positive_probability() {
    let mut numbers = Numbers(2);
    let mut sent = 0;
    for (name, lights) in scenes() {
        let grid = grid(&lights);
        for _ in 0..300 {
            let context = context(&mut numbers);
            for (i, light) in lights.iter().enumerate() {
                let pmf = grid.pmf(&lights, &context, LightId(i as u32));
                assert!((0.0..=1.0).contains(&pmf));
                let u = Vec2::new(numbers.next(), numbers.next());
                let Some(sample) = light.sample(context.p, 0.5, u, &[]) else {
                    continue;
                };
                if !sample.radiance.is_black() {
                    sent += 1;
                    assert!(pmf > 0.0, "{name} {i}: {light:?} at {context:?}");
                }
            }
        }
    }
    assert!(sent > 100_000);
}

/// Irradiance by a thousand point lights, without shadows: the choice by place has less than a
/// quarter of the variance of the choice by power.
#[test]
fn variance_is_far_below_that_by_power() {
    let mut numbers = Numbers(3);
    let lights: Vec<Light> = (0..1000)
        .map(|_| point(numbers.vector(), 0.5 + numbers.next()))
        .collect();
    let grid = grid(&lights);
    let powers: Vec<f64> = lights.iter().map(|l| l.power(2.0)).collect();
    let total: f64 = powers.iter().sum();
    let (mut by_place, mut by_power) = (0.0, 0.0);
    for _ in 0..300 {
        let context = LightSampleContext {
            p: numbers.vector(),
            n: numbers.vector().normalize(),
        };
        let irradiance: Vec<f64> = lights
            .iter()
            .map(|l| l.sample(context.p, 0.5, Vec2::ZERO, &[]).unwrap())
            .map(|s| (s.wi.dot(context.n).max(0.0) * s.radiance.max_component()) as f64)
            .collect();
        let sum: f64 = irradiance.iter().sum();
        let variance = |pmf: &dyn Fn(usize) -> f64| {
            let squares = irradiance.iter().enumerate().map(|(i, e)| e * e / pmf(i));
            squares.filter(|x| !x.is_nan()).sum::<f64>() / (sum * sum) - 1.0
        };
        by_place += variance(&|i| grid.pmf(&lights, &context, LightId(i as u32)) as f64);
        by_power += variance(&|i| powers[i] / total);
    }
    println!(
        "relative variance {:.3} by place, {:.3} by power",
        by_place / 300.0,
        by_power / 300.0
    );
    assert!(by_place < 0.25 * by_power, "{by_place} {by_power}");
}

/// Lamps at equal distances light a plane. The variance of the choice depends little on their
/// number. The triangles of one lamp do not make a cell dense.
#[test]
fn variance_does_not_grow_with_the_number_of_lamps() {
    let mut numbers = Numbers(6);
    let mut variance = |side: usize| {
        let half = 0.5 * side as f32;
        let lights: Vec<Light> = (0..side * side)
            .map(|i| [i % side, i / side].map(|i| i as f32 + 0.5 - half))
            .map(|[x, z]| point(Vec3::new(x, 0.4, z), 1.0))
            .collect();
        let powers: Vec<f64> = lights.iter().map(|l| l.power(2.0)).collect();
        let bounds = Bounds3 {
            min: Vec3::new(-half, 0.0, -half),
            max: Vec3::new(half, 0.5, half),
        };
        let grid = LightGrid::new(&lights, &powers, bounds, bounds.radius()).unwrap();
        let mut sum = 0.0;
        for _ in 0..40 {
            let context = LightSampleContext {
                p: Vec3::new(numbers.vector().x, 0.0, numbers.vector().x),
                n: Vec3::Y,
            };
            let irradiance = lights.iter().map(|l| {
                let sample = l.sample(context.p, 0.5, Vec2::ZERO, &[]).unwrap();
                f64::from(sample.wi.dot(context.n).max(0.0) * sample.radiance.max_component())
            });
            let irradiance: Vec<f64> = irradiance.collect();
            let total: f64 = irradiance.iter().sum();
            let squares = irradiance
                .iter()
                .enumerate()
                .map(|(i, e)| e * e / f64::from(grid.pmf(&lights, &context, LightId(i as u32))));
            sum += squares.sum::<f64>() / (total * total) - 1.0;
        }
        sum / 40.0
    };
    let [few, some, many] = [10, 40, 160].map(&mut variance);
    println!("relative variance {few:.3} of 100 lamps, {some:.3} of 1600, {many:.3} of 25600");
    assert!(many < 3.0 * few && few < 0.5, "{few} {many}");
    let triangles: Vec<Vec3> = (0..500).map(|i| Vec3::splat(1e-6 * i as f32)).collect();
    let centers = [triangles, vec![BOX.min, BOX.max]].concat();
    assert!(Grids::new(&centers, BOX, 2.0).dense_cells(&centers).is_empty());
}

#[test]
fn cells_hold_their_points() {
    let mut numbers = Numbers(4);
    let dense: Vec<Vec3> = (0..3000)
        .map(|i| Vec3::new(i as f32 / 1500.0 - 1.0, -1.0, 1.0))
        .collect();
    for lights in [vec![BOX.min, BOX.max], Vec::new(), vec![Vec3::ONE], dense] {
        for size in [1e-20, 1.0, 1e15] {
            let bounds = Bounds3 {
                min: Vec3::splat(-30.0 * size),
                max: Vec3::new(30.0, 3.0, 5.0) * size,
            };
            let scaled: Vec<Vec3> = lights.iter().map(|p| *p * size).collect();
            let grids = Grids::new(&scaled, bounds, bounds.radius());
            for i in 0..10_000 {
                let p = match i % 2 {
                    0 => bounds.center() + 0.5 * (bounds.max - bounds.min) * numbers.vector(),
                    _ => 2.0 * size * numbers.vector(),
                };
                let cell = grids.cell(p);
                assert!(cell < grids.len());
                let (center, radius) = grids.ball(cell);
                assert!(p.distance(center) <= 1.001 * radius, "{p} {center} {radius} {grids:?}");
            }
            // Invalid points get a cell, too.
            for p in [Vec3::NAN, Vec3::INFINITY, Vec3::NEG_INFINITY, Vec3::ZERO] {
                assert!(grids.cell(p) < grids.len());
            }
        }
    }
}

#[test]
fn normals_are_near_their_directions() {
    let mut numbers = Numbers(5);
    for _ in 0..10_000 {
        let n = numbers.vector().normalize();
        let near = normal_direction(normal_index(n));
        assert!(n.dot(near) > 0.84, "{n} {near}");
    }
    assert_eq!(normal_direction(normal_index(Vec3::ZERO)), Vec3::ZERO);
}
