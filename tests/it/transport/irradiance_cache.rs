//! Irradiance caching: gradients against closed forms, and bias for different error settings. The
//! bits of a render depend only on its image settings.
#![cfg(feature = "embree")]

use crate::support::program::{assert_same_bits, done, folder, joined, refused, split, words};
use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::film::Film;
use embrasure::integrator::*;
use embrasure::material::Material;
use embrasure::math::{DVec3, UVec2, Vec3};
use embrasure::render::{Irradiance, Observer, Outcome};
use embrasure::sampler::{Dimension, SampleKey, Sampler, Sobol};
use embrasure::scene::{Scene, SceneBuilder};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use tempfile::TempDir;

const RESOLUTION: UVec2 = UVec2::new(48, 40);

/// Ward's error parameter and the number of rays of a record.
type Fineness = (f32, u32);
const USUAL: Fineness = (0.3, 1024);

/// Path tracer with the same settings as the cache.
fn path<'a>(world: World<'a, Backend<'a>>, max_depth: Option<u32>) -> PathIntegrator<'a, Backend<'a>> {
    PathIntegrator {
        light_samples: 2,
        ..path_tracer(world, max_depth)
    }
}

/// Renders `scene` with a cache of this fineness. Returns the film and the number of records.
fn cached(scene: &Scene, camera: CameraParameters, depth: u32, (error, rays): Fineness, spp: u32) -> (Film, usize) {
    with_world(scene, camera, RESOLUTION, |world| {
        let path = || path(world, Some(depth));
        let irradiance = Irradiance::new(RESOLUTION, 5);
        let maker = RecordMaker { path: path(), rays };
        let (outcome, statistics) = irradiance.fill(&maker, error, &());
        assert_eq!((outcome, statistics.dropped), (Outcome::Complete, 0));
        let cache = irradiance.cache().unwrap();
        let integrator = IrradianceCacheIntegrator { path: path(), cache };
        (film_by(&sobol(1), &integrator, RESOLUTION, spp), cache.len())
    })
}

/// Renders with the path tracer only.
fn by_paths(scene: &Scene, camera: CameraParameters, depth: u32, spp: u32) -> Film {
    with_world(scene, camera, RESOLUTION, |world| {
        film_by(&sobol(2), &path(world, Some(depth)), RESOLUTION, spp)
    })
}

/// Means over regions of 8 × 8 pixels, for each channel.
fn regions(film: &Film) -> Vec<f64> {
    let mut sums = vec![0.0; (RESOLUTION.x / 8 * (RESOLUTION.y / 8) * 3) as usize];
    for (pixel, sum) in film.pixels() {
        let region = pixel.y / 8 * (RESOLUTION.x / 8) + pixel.x / 8;
        for c in 0..3 {
            sums[region as usize * 3 + c] += sum.mean(c) / 64.0;
        }
    }
    sums
}

/// Root mean square of the relative differences of the regions. The denominator is the value of the
/// region in `b` plus a tenth of the mean.
fn difference(a: &Film, b: &Film) -> f64 {
    let (a, b) = (regions(a), regions(b));
    let count = a.len() as f64;
    let floor = 0.1 * b.iter().sum::<f64>() / count;
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| ((a - b) / (b + floor)).powi(2)).sum();
    (squares / count).sqrt()
}

/// Irradiance at `p` with normal `n` from a polygon of radiance 1 (Lambert). It is half of a sum
/// over the edges: the angle that the edge subtends, times the cosine between `n` and the normal of
/// the plane through `p` and the edge. The polygon must be above the horizon.
fn lambert(polygon: &[DVec3], p: DVec3, n: DVec3) -> f64 {
    let edges = (0..polygon.len()).map(|i| [polygon[i], polygon[(i + 1) % polygon.len()]]);
    let terms = edges.map(|[a, b]| {
        let (a, b) = ((a - p).normalize(), (b - p).normalize());
        a.dot(b).acos() * a.cross(b).normalize().dot(n)
    });
    0.5 * terms.sum::<f64>().abs()
}

/// An emitting rectangle above a plane, and nothing else. Irradiance, and its gradients for
/// translation and rotation, match the closed form.
#[test]
fn gradients_below_a_rectangle_match_closed_form() {
    let lamp = [[-0.3, -0.6], [1.1, -0.6], [1.1, 0.5], [-0.3, 0.5]].map(|[x, y]| DVec3::new(x, y, 0.8));
    let n = DVec3::Z;
    for p in [DVec3::ZERO, DVec3::new(-0.9, 0.3, 0.0), DVec3::new(1.5, 1.2, 0.0)] {
        // Compute the radiance along the rays
        let strata = Strata::new(40_000);
        let mut sampler = Sobol::new(3);
        let look = |index| {
            sampler.start(SampleKey::new(0, 0, index));
            let w = strata.direction(index, sampler.get_2d(Dimension::PIXEL));
            let distance = 0.8 / w.z;
            let q = p.as_vec3a() + w * distance;
            let is_lit = (-0.3..=1.1).contains(&q.x) && (-0.6..=0.5).contains(&q.y);
            match is_lit {
                true => HemisphereHit {
                    radiance: Spectrum::rgb(1.0, 2.0, 0.0),
                    distance,
                },
                false => HemisphereHit::NOTHING,
            }
        };
        let seen: Vec<HemisphereHit> = (0..strata.rays()).map(look).collect();
        let gathered = strata.gather(&seen);

        // Compare with differences of the closed form
        let h = 1e-4;
        let along = |d: DVec3| (lambert(&lamp, p + h * d, n) - lambert(&lamp, p - h * d, n)) / (2.0 * h);
        // A rotation about an axis changes the normal by axis × normal.
        let turned = |axis: DVec3, h: f64| lambert(&lamp, p, (n + h * axis.cross(n)).normalize());
        let about = |axis: DVec3| (turned(axis, h) - turned(axis, -h)) / (2.0 * h);
        let exact = lambert(&lamp, p, n);
        let [mx, my] = [along(DVec3::X), along(DVec3::Y)];
        let [tx, ty] = [about(DVec3::X), about(DVec3::Y)];
        println!("{p}: E {exact} {:?}", gathered.irradiance);
        for (c, factor) in [1.0, 2.0, 0.0].into_iter().enumerate() {
            let irradiance = gathered.irradiance.to_array()[c] as f64;
            assert!(
                (irradiance - factor * exact).abs() <= 2e-3 * factor * exact,
                "{irradiance}"
            );
            let moves = gathered.gradients.translational[c].as_dvec3();
            let turns = gathered.gradients.rotational[c].as_dvec3();
            println!("  by moves {moves}, exactly {mx} {my}; by turns {turns}, exactly {tx} {ty}");
            let [moved, turned] = [DVec3::new(mx, my, 0.0), DVec3::new(tx, ty, 0.0)].map(|g| factor * g);
            assert!(moves.distance(moved) <= 0.03 * moved.length(), "{moves} and {moved}");
            assert!(turns.distance(turned) <= 0.01 * turned.length(), "{turns} and {turned}");
        }
    }
}

/// Inside a convex box whose walls emit smoothly, no surface hides another. So differences between
/// strata come only from the variation of the emission.
#[test]
fn gradients_in_a_box_match_differences() {
    // The box is [-1, 1]² × [0, 2]. `radiance` is the emission of its walls, and `gather` traces
    // rays from a point of the floor
    let radiance = |q: Vec3| 1.0 + 0.5 * q.x;
    let gather = |p: Vec3, rays: u32| {
        let strata = Strata::new(rays);
        let mut sampler = Sobol::new(4);
        let look = |index| {
            sampler.start(SampleKey::new(0, 0, index));
            let w = strata.direction(index, sampler.get_2d(Dimension::PIXEL));
            // Find the first wall along the ray
            let to = |p: f32, w: f32, min: f32, max: f32| ((if w > 0.0 { max } else { min }) - p) / w;
            let distance = to(p.x, w.x, -1.0, 1.0).min(to(p.y, w.y, -1.0, 1.0)).min(2.0 / w.z);
            HemisphereHit {
                radiance: Spectrum::splat(radiance(p + w * distance)),
                distance,
            }
        };
        let seen: Vec<HemisphereHit> = (0..strata.rays()).map(look).collect();
        strata.gather(&seen)
    };
    let p = Vec3::new(0.3, 0.2, 0.0);
    let h = 0.02;
    let mean = |p| gather(p, 1_000_000).irradiance.mean();
    let difference = (mean(p + h * Vec3::X) - mean(p - h * Vec3::X)) / (2.0 * h);
    for rays in [1024, 30_000] {
        let [gradient, ..] = gather(p, rays).gradients.translational;
        println!("{rays} rays: {gradient}, by differences {difference}");
        assert!(
            (gradient.x / difference - 1.0).abs() < 0.05,
            "{gradient} and {difference}"
        );
        assert!(gradient.y.abs() < 0.06 * difference.abs(), "{gradient}");
    }
}

/// The radiance in the closed box is 2. With n scatterings it is 2 − 2⁻ⁿ. `max_depth` limits cached
/// light in the same way as paths.
#[test]
fn closed_box_has_the_exact_radiance() {
    let scene = own("closed-box.toml");
    let inside = pinhole(Vec3::new(0.4, 0.3, 0.6), Vec3::new(-1.0, -1.0, -1.0), 60.0);
    for depth in [64, 0, 1, 2, 3] {
        let expected = 2.0 - 0.5f64.powi(depth as i32);
        let (film, records) = cached(&scene, inside, depth, USUAL, 16);
        assert_eq!(records > 0, depth > 1);
        let mean = film_mean(&film, 0);
        let worst = regions(&film)
            .into_iter()
            .map(|r| (r / expected - 1.0).abs())
            .fold(0.0, f64::max);
        println!("depth {depth}: mean {mean} of {expected}, {records} records, regions within {worst:.4}");
        assert!((mean / expected - 1.0).abs() < 0.004, "depth {depth}: {mean}");
        assert!(worst < 0.02, "depth {depth}: {worst}");
    }
}

/// The bias relative to path tracing is below 1 % with the default settings, and smaller with finer
/// settings.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn bias_shrinks_with_finer_settings() {
    let scene = own("cornell-box.toml");
    let camera = pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0);
    let reference = by_paths(&scene, camera, 8, 1024);
    let of = |fineness: Fineness| {
        let (film, records) = cached(&scene, camera, 8, fineness, 64);
        let bias = film_mean(&film, 1) / film_mean(&reference, 1) - 1.0;
        let difference = difference(&film, &reference);
        println!("{fineness:?}: {records} records, bias {bias:.5}, regions differ by {difference:.5}");
        (bias, difference)
    };
    let (coarse, usual, fine) = (of((1.0, 256)), of(USUAL), of((0.15, 2048)));
    assert!(usual.0.abs() < 0.01 && usual.1 < 0.012, "{usual:?}");
    assert!(fine.0.abs() < 0.005 && fine.1 < 0.008, "{fine:?}");
    assert!(
        coarse.1 > 1.5 * usual.1 && usual.1 > fine.1,
        "{coarse:?} {usual:?} {fine:?}"
    );
}

/// Mirrors and glass show cached light. Scatterings at mirrors and glass count for the maximum
/// depth, so the cached light has fewer scatterings.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn mirrors_and_glass_agree_with_paths() {
    let mut builder = SceneBuilder::new();
    add(&mut builder, room(), material(0.6, 0.0));
    let lamp = panel(0.0, 0.6);
    let lamp_up = embrasure::geometry::Mesh {
        positions: lamp.positions.iter().map(|p| Vec3::new(p.x, 0.98, -p.y)).collect(),
        triangles: lamp.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        ..Default::default()
    };
    add(&mut builder, lamp_up, material(0.0, 2.0));
    let mirror = Material {
        specular: Spectrum::splat(0.9),
        gloss: embrasure::material::Gloss::Mirror(embrasure::bsdf::Fresnel::Full),
        ..material(0.0, 0.0)
    };
    add(&mut builder, panel(-0.95, 0.6), mirror);
    let pane = Material {
        transmission: Spectrum::ONE,
        thin: true,
        ..material(0.0, 0.0)
    };
    add(&mut builder, panel(0.3, 0.25), pane);
    let glossy = Material {
        specular: Spectrum::splat(0.4),
        ..material(0.4, 0.0)
    };
    add(&mut builder, sphere(0.25, Vec3::new(-0.5, -0.7, -0.2), 3), glossy);
    let scene = builder.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.2, -1.0), 80.0);
    for depth in [3, 12] {
        let reference = by_paths(&scene, camera, depth, 512);
        let (film, records) = cached(&scene, camera, depth, (0.1, 512), 64);
        let bias = film_mean(&film, 1) / film_mean(&reference, 1) - 1.0;
        let difference = difference(&film, &reference);
        println!("depth {depth}: {records} records, bias {bias:.5}, regions differ by {difference:.5}");
        assert!(bias.abs() < 0.005 && difference < 0.013, "{bias} {difference}");
    }
}

/// If a caustic lights records, they depend on a few of their rays, and the program warns. Records
/// of a matte room cause no warning.
#[test]
fn caustics_cause_a_warning_about_records() {
    let warns = |scene: &str| {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
        let folder = folder(&[]);
        let args = split("--integrator irradiance-cache --spp 1 --size 96x72 -o x.exr");
        let output = done(folder.path(), &joined(&["render", scene.to_str().unwrap()], &args));
        words(&output).contains("of the irradiance records get most of their light from a few rays")
    };
    assert!(warns("ring-caustic.toml"));
    assert!(!warns("cornell-box.toml"));
}

/// A convex white surface in a white sky has only direct light, so the cache contributes no light.
#[test]
fn white_furnace_radiance_is_one() {
    let camera = pinhole(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 40.0);
    let (film, _) = cached(&own("furnace.toml"), camera, 16, (0.3, 64), 64);
    assert_unbiased("furnace", &film, 1.0);
}

/// Observer that requests a stop at every few calls.
struct StoppingObserver(AtomicU64);

impl Observer for StoppingObserver {
    fn progress(&self, _: u64) {}

    fn should_stop(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) % 8 == 7
    }
}

/// Interruptions and the number of threads do not change the records.
#[test]
fn interrupted_filling_gives_the_same_records() {
    let scene = own("cornell-box.toml");
    let camera = pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0);
    with_world(&scene, camera, RESOLUTION, |world| {
        let maker = RecordMaker {
            path: path(world, Some(4)),
            rays: 32,
        };
        let records = |irradiance: &Irradiance| {
            let records = irradiance.cache().unwrap().records();
            assert!(records.len() > 50);
            let bits = |r: &Record| {
                (
                    r.p.to_array(),
                    r.radius.to_bits(),
                    r.irradiance.to_array().map(f32::to_bits),
                )
            };
            records.iter().map(bits).collect::<Vec<_>>()
        };
        let mut stops = 0;
        let mut all = Vec::new();
        for threads in [1, 3] {
            for observer in [StoppingObserver(AtomicU64::new(0)), StoppingObserver(AtomicU64::new(3))] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let irradiance = Irradiance::new(RESOLUTION, 7);
                while pool.install(|| irradiance.fill(&maker, 0.3, &observer)).0 == Outcome::Stopped {
                    assert!(irradiance.cache().is_none());
                    stops += 1;
                }
                all.push(records(&irradiance));
            }
        }
        assert!(stops > 10, "{stops}");
        assert!(all.iter().all(|records| *records == all[0]));
        let other = Irradiance::new(RESOLUTION, 8);
        other.fill(&maker, 0.3, &());
        assert!(records(&other) != all[0], "the seed makes no difference");
    });
}

/// A folder with `s.toml`: a room open to the front, with matte walls, a mirror and a lamp.
fn scene() -> TempDir {
    folder(&[
        (
            "a.mtl",
            "newmtl wall\nKd 0.6 0.5 0.4\nnewmtl mirror\nKs 0.8 0.8 0.8\nillum 3\nnewmtl lamp\nKd 0 0 0\nKe 9 9 9\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 2 1\nv 1 2 1\nv 1 2 -1\nv -1 2 -1\n\
             v -0.3 1.98 0.3\nv 0.3 1.98 0.3\nv 0.3 1.98 -0.3\nv -0.3 1.98 -0.3\n\
             usemtl wall\nf 1 2 3 4\nf 4 3 7 8\nf 1 4 8 5\nf 5 8 7 6\nusemtl mirror\nf 2 6 7 3\nusemtl lamp\nf 9 12 11 10\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 1, 0]\n\
             [image]\nwidth = 44\nheight = 30\n[render]\nintegrator = \"irradiance-cache\"\ncache_rays = 64\nsamples = 128\n\
             [[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

/// The number of threads, and crops, parts and interruptions of a render change no bit of the
/// image, because each render first fills the cache of the whole image.
#[test]
fn threads_crops_and_parts_change_no_bit() {
    let folder = scene();
    let usual = split("render s.toml -q");
    let render = |more: &str| done(folder.path(), &joined(&usual, &split(more)));
    let same = |one: &str| assert_same_bits(&folder.path().join(one), &folder.path().join("one.exr"));
    render("--threads 1 -o one.exr");
    render("--threads 3 -o three.exr");
    same("three.exr");
    // Render crops and sample ranges
    render("--crop 0,0,17,30 -o left.exr");
    render("--crop 17,0,44,30 --samples 0..64 -o first.exr");
    render("--crop 17,0,44,30 --samples 64..128 --threads 1 -o second.exr");
    done(
        folder.path(),
        &split("merge -q -o merged.exr second.exr left.exr first.exr"),
    );
    same("merged.exr");
    // A render that ends before the cache is complete writes neither an image nor a checkpoint. A
    // checkpoint of a later render can be resumed.
    let early = split("--checkpoint state.exr --time-limit 0.001s -o early.exr");
    let words = refused(folder.path(), &joined(&usual, &early), 1);
    assert!(
        words.contains("before the first sample") && words.contains("help:"),
        "{words}"
    );
    assert!(
        ["state.exr", "early.exr"]
            .iter()
            .all(|name| !folder.path().join(name).exists())
    );
    render("--checkpoint state.exr --resume --spp 100 -o later.exr");
    render("--checkpoint state.exr --resume -o whole.exr");
    same("whole.exr");
    // A checkpoint of a render with other settings is refused.
    for other in ["--cache-error 0.4", "--cache-rays 65", "--integrator path"] {
        let more = split(&format!("--checkpoint state.exr --resume {other}")).join(" ");
        let words = refused(folder.path(), &joined(&usual, &split(&more)), 1);
        assert!(words.contains("another render"), "{words}");
    }
}

#[test]
fn invalid_cache_options_are_errors() {
    let folder = scene();
    for (flags, words) in [
        ("--cache-error 0", "--cache-error 0"),
        ("--cache-error nan", "--cache-error nan"),
        ("--cache-error 1.5", "at most 1"),
        ("--cache-rays 15", "from 16"),
        ("--aov lights", "cannot separate light groups"),
    ] {
        let said = refused(folder.path(), &joined(&split("render s.toml"), &split(flags)), 2);
        assert!(said.contains(words) && said.contains("help:"), "{said}");
    }
}
