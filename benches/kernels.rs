//! Measures warps, lobes, and closest hits by every backend: `cargo bench -p embrasure-benches
//! --bench kernels`.

use criterion::{Criterion, Throughput};
use embrasure::accel::Accel;
use embrasure::bsdf::{Blinn, Bsdf, Dielectric, Fresnel, Lambert, Lobe, Phong, TransportMode};
use embrasure::color::Spectrum;
use embrasure::math::{Vec2, Vec3};
use embrasure::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
use embrasure::sampling::warp;
use embrasure_benches::{at, bounces, scene};

/// Number of different inputs of a measurement, so that the CPU cannot learn the branches.
const INPUTS: u32 = 4096;

fn warps(c: &mut Criterion) {
    let inputs: Vec<Vec2> = (0..INPUTS).map(|i| at(i, 0)).collect();
    let mut group = c.benchmark_group("warp");
    group.throughput(Throughput::Elements(INPUTS as u64));
    let mut measure = |name: &str, warp: &dyn Fn(Vec2) -> Vec3| {
        group.bench_function(name, |b| b.iter(|| inputs.iter().map(|u| warp(*u)).sum::<Vec3>()));
    };
    measure("uniform_disk", &|u| warp::uniform_disk(u).extend(0.0).into());
    measure("cosine_hemisphere", &warp::cosine_hemisphere);
    measure("cosine_power_hemisphere", &|u| warp::cosine_power_hemisphere(u, 50.0));
    measure("uniform_sphere", &warp::uniform_sphere);
    measure("uniform_triangle", &|u| {
        let (b1, b2) = warp::uniform_triangle(u);
        Vec3::new(b1, b2, 0.0)
    });
    let mut sampler = Independent::new(0);
    sampler.start(SampleKey::new(1, 2, 3));
    measure("independent sampler", &|u| {
        let dimension = Dimension::bounce((u.x * 16.0) as u32, Bounce::Direction);
        sampler.get_2d(dimension).extend(0.0).into()
    });
}

fn lobes(c: &mut Criterion) {
    let reflectance = Spectrum::splat(0.5);
    let lobes = [
        ("lambert", Lobe::Lambert(Lambert { albedo: reflectance })),
        (
            "phong",
            Lobe::Phong(Phong {
                reflectance,
                exponent: 50.0,
            }),
        ),
        (
            "blinn",
            Lobe::Blinn(Blinn {
                reflectance,
                exponent: 50.0,
                fresnel: Fresnel::Dielectric { eta: 1.5 },
            }),
        ),
        (
            "dielectric",
            Lobe::Dielectric(Dielectric {
                reflectance,
                transmittance: reflectance,
                ior: 1.5,
            }),
        ),
    ];
    let direction = |i, k| warp::cosine_hemisphere(at(i, k));
    let inputs: Vec<(Vec3, Vec3, Vec2)> = (0..INPUTS)
        .map(|i| (direction(i, 1), direction(i, 2), at(i, 3)))
        .collect();
    let mut group = c.benchmark_group("lobe");
    group.throughput(Throughput::Elements(INPUTS as u64));
    for (name, lobe) in lobes {
        let bsdf = Bsdf::Single(lobe);
        group.bench_function(format!("{name} eval and pdf"), |b| {
            let value = |(wo, wi, _): &(Vec3, Vec3, Vec2)| bsdf.eval(*wo, *wi).mean() + bsdf.pdf(*wo, *wi);
            b.iter(|| inputs.iter().map(value).sum::<f32>());
        });
        group.bench_function(format!("{name} sample"), |b| {
            let sample = |(wo, _, u): &(Vec3, Vec3, Vec2)| bsdf.sample(*wo, 0.5, *u, TransportMode::Radiance);
            b.iter(|| inputs.iter().filter_map(sample).map(|s| s.pdf).sum::<f32>());
        });
    }
}

fn backends(c: &mut Criterion) {
    for triangles in [36, 100_000] {
        let scene = scene(triangles);
        let rays = bounces(&scene, 100_000);
        let mut group = c.benchmark_group(format!("{triangles} triangles"));
        group.throughput(Throughput::Elements(rays.len() as u64));
        let mut measure = |accel: &dyn Accel| {
            let name = accel.info().name;
            group.bench_function(format!("{name} closest"), |b| {
                b.iter(|| rays.iter().filter(|ray| accel.intersect(ray).is_some()).count());
            });
            group.bench_function(format!("{name} occlusion"), |b| {
                b.iter(|| rays.iter().filter(|ray| accel.occluded(ray)).count());
            });
        };
        #[cfg(feature = "embree")]
        measure(&embrasure::accel::embree::EmbreeAccel::new(&scene, 2).expect("Embree"));
        #[cfg(feature = "obvhs")]
        measure(&embrasure::accel::bvh::BvhAccel::new(&scene));
        if triangles == 36 {
            measure(&embrasure::accel::brute::BruteForce::new(&scene));
        }
    }
}

/// Compares the safe wrapper around Embree with a plain loop over the raw binding.
#[cfg(feature = "embree")]
fn wrapper(c: &mut Criterion) {
    use embrasure::accel::embree::{EmbreeAccel, raw_hits, raw_occlusions};
    use embrasure::math::Ray;
    use std::hint::black_box;
    for triangles in [36, 100_000] {
        let scene = scene(triangles);
        let rays: Vec<Ray> = bounces(&scene, 100_000);
        let accel = EmbreeAccel::new(&scene, 2).expect("Embree");
        let mut group = c.benchmark_group(format!("wrapper, {triangles} triangles"));
        group.throughput(Throughput::Elements(rays.len() as u64));
        let hits = |rays: &[Ray]| rays.iter().filter(|ray| accel.intersect(ray).is_some()).count();
        let occlusions = |rays: &[Ray]| rays.iter().filter(|ray| accel.occluded(ray)).count();
        assert_eq!(hits(&rays), raw_hits(&accel, &rays));
        group.bench_function("closest, raw", |b| b.iter(|| raw_hits(&accel, black_box(&rays))));
        group.bench_function("closest, wrapped", |b| b.iter(|| hits(black_box(&rays))));
        group.bench_function("occlusion, raw", |b| {
            b.iter(|| raw_occlusions(&accel, black_box(&rays)))
        });
        group.bench_function("occlusion, wrapped", |b| b.iter(|| occlusions(black_box(&rays))));
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    warps(&mut criterion);
    lobes(&mut criterion);
    backends(&mut criterion);
    #[cfg(feature = "embree")]
    wrapper(&mut criterion);
    criterion.final_summary();
}
