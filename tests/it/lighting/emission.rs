//! Emission sampling. Samples follow their densities, and their mean weight is the power of the
//! light. Light that is traced to a floor equals light that is sampled from the floor.

use super::lights::map;
use crate::chi_square::{chi_square, sidak};
use crate::support::statistics::{Mean, assert_means_within, assert_same_mean};
use crate::support::*;
use embrasure::camera::{Camera, CameraMotion, CameraParameters, Pose};
use embrasure::color::Spectrum;
use embrasure::film::{Filter, FilterKind};
use embrasure::geometry::{Facet, GeomId, Hit, InstanceId, Mesh, Placement, PrimId, triangle_area, triangle_normal};
use embrasure::light::*;
use embrasure::math::{Affine3A, Ball, Quat, UVec2, Vec2, Vec3};
use embrasure::sampler::{Dimension, Independent, SampleKey, Sampler};
use embrasure::scene::SceneBuilder;
use embrasure::texture::{Mapping, Texels, Texture, TextureId, Wrap};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;
use std::sync::OnceLock;

/// Time of all samples, and the bounding ball of the scene.
const TIME: f32 = 0.3;
const WORLD: Ball = Ball {
    center: Vec3::new(0.2, 0.1, -0.1),
    radius: 1.5,
};

const CORNERS: [Vec3; 3] = [
    Vec3::new(-0.4, 1.0, 0.3),
    Vec3::new(0.5, 1.2, -0.8),
    Vec3::new(1.1, 1.4, 0.9),
];
const UVS: [Vec2; 3] = [Vec2::new(0.1, 0.0), Vec2::new(0.9, 0.3), Vec2::new(0.2, 1.0)];

/// Two pairs of random numbers.
fn numbers(index: u32) -> [Vec2; 2] {
    let mut sampler = Independent::new(23);
    sampler.start(SampleKey::new(0, 0, index));
    [sampler.get_2d(Dimension::PIXEL), sampler.get_2d(Dimension::LENS)]
}

/// Texture that is black on the left. From there to the right all channels rise, blue the most.
fn textures() -> &'static [Texture] {
    static TEXTURES: OnceLock<[Texture; 1]> = OnceLock::new();
    TEXTURES.get_or_init(|| {
        let texel = |i: usize| {
            let x = ((i % 64) as f32 - 16.0).max(0.0) / 47.0;
            [0.5 * x, x * x, if x > 0.0 { x + 0.2 } else { 0.0 }]
        };
        let texels = (0..64 * 64).flat_map(texel).collect();
        [Texture::new(64, 64, 3, Texels::Floats(texels), Wrap::Clamp).unwrap()]
    })
}

/// Corners of a deforming triangle at the times 0 and 1, and its placement, which is mirrored and
/// moves.
fn motion() -> ([[Vec3; 3]; 2], Placement) {
    let close = [
        Vec3::new(-0.6, 1.1, 0.1),
        Vec3::new(0.3, 1.5, -0.7),
        Vec3::new(1.3, 1.2, 1.0),
    ];
    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0).into());
    let aside = Affine3A::from_translation(Vec3::new(0.4, 0.2, -0.1).into()) * mirror;
    ([CORNERS, close], Placement::Moving(vec![mirror, aside].into()))
}

/// Corners of the moving triangle at [`TIME`], counter-clockwise seen from its front.
fn moved() -> [Vec3; 3] {
    let ([open, close], placement) = motion();
    let [a, b, c] = [0, 1, 2].map(|i| placement.at(TIME).transform_point3a(open[i].lerp(close[i], TIME)));
    [a, c, b]
}

/// Diameter of the disc of the sun in degrees.
const SUN_ANGLE: f32 = 40.0;

/// A light, and the corners of its triangle if it is a triangle light.
struct Case {
    name: &'static str,
    light: Light,
    corners: Option<[Vec3; 3]>,
}

fn case(name: &'static str, light: impl Into<Light>, corners: Option<[Vec3; 3]>) -> Case {
    Case {
        name,
        light: light.into(),
        corners,
    }
}

fn cases() -> Vec<Case> {
    let color = Spectrum::rgb(3.0, 2.0, 5.0);
    let position = Vec3::new(0.3, 1.2, -0.2);
    let downwards = Vec3::new(0.3, -1.0, 0.2).normalize();
    let triangle = |sampling| AreaLight::from(TriangleLight::new(CORNERS, color, sampling));
    let moving = || {
        let (ends, placement) = motion();
        AreaLight::from(Box::new(MovingTriangle::new(
            ends,
            placement,
            color,
            TriangleSampling::Area,
        )))
    };
    let textured = |light: AreaLight| {
        let variation = Variation {
            uvs: UVS,
            emission: Some((TextureId(0), Mapping::default())),
            opacity: 1.0,
            opacity_map: None,
            alphas: [1.0; 3],
        };
        light.varied(variation, textures())
    };
    let spot = |cos_inner, cos_outer| {
        Light::Spot(SpotLight {
            position,
            direction: downwards,
            intensity: color,
            cos_inner,
            cos_outer,
        })
    };
    let rotation = Quat::from_rotation_x(0.7);
    vec![
        case("triangle", triangle(TriangleSampling::Area), Some(CORNERS)),
        case(
            "triangle by solid angle",
            triangle(TriangleSampling::SolidAngle),
            Some(CORNERS),
        ),
        case("moving triangle", moving(), Some(moved())),
        case(
            "textured triangle",
            textured(triangle(TriangleSampling::Area)),
            Some(CORNERS),
        ),
        case("textured, mirrored and moving", textured(moving()), Some(moved())),
        case(
            "point",
            Light::Point(PointLight {
                position,
                intensity: color,
            }),
            None,
        ),
        case("spot", spot(0.9, 0.7), None),
        case("spot without a rim", spot(0.95, 0.95), None),
        case("constant", Light::Constant(ConstantLight { radiance: color }), None),
        case(
            "directional",
            Light::Directional(DirectionalLight {
                direction: downwards,
                irradiance: color,
            }),
            None,
        ),
        case("sun", Light::Sun(SunLight::new(downwards, color, SUN_ANGLE)), None),
        case(
            "environment",
            Light::Environment(Box::new(EnvironmentLight::new(map(), 2.0, rotation))),
            None,
        ),
    ]
}

impl Case {
    fn sample(&self, index: u32) -> Option<Emission> {
        let [u_position, u_direction] = numbers(index);
        self.light
            .sample_emission(TIME, u_position, u_direction, textures(), &WORLD)
    }

    /// Similar light that is black nowhere, so that all samples can be counted.
    fn even(&self) -> Light {
        match &self.light {
            Light::Area(AreaLight::Textured(light)) => Light::from(light.at(TIME)),
            Light::Environment(light) => {
                let (scale, rotation) = light.placement();
                let (width, height) = (12, 6);
                let texel = |i: usize| Spectrum::splat(if i == 40 { 30.0 } else { 0.1 + (i % 5) as f32 });
                let texels = (0..width * height).map(texel).collect();
                let map = LatLongImage { width, height, texels };
                Light::Environment(Box::new(EnvironmentLight::new(map, scale, rotation)))
            }
            light => light.clone(),
        }
    }

    fn is_infinite(&self) -> bool {
        matches!(
            self.light,
            Light::Constant(_) | Light::Directional(_) | Light::Sun(_) | Light::Environment(_)
        )
    }
}

/// Index of the part of the light that contains the sample, of 16 equal parts. For an infinitely
/// distant light, these are parts of the disk in front of the scene. `None` if the point is neither
/// on the light nor on the disk.
fn part(case: &Case, e: &Emission) -> Option<usize> {
    const SLACK: f32 = 1e-5;
    if let Some([a, b, c]) = case.corners {
        // Compute barycentric coordinates from areas
        let n = (b - a).cross(c - a);
        let share = |p: Vec3, q: Vec3| (q - p).cross(e.p - p).dot(n) / n.length_squared();
        let [b1, b2] = [share(c, a), share(a, b)];
        let off = (e.p - a).dot(n.normalize()).abs();
        if off > SLACK || b1 < -SLACK || b2 < -SLACK || b1 + b2 > 1.0 + SLACK {
            return None;
        }
        // Strips of equal area parallel to an edge, each cut along lines through the opposite
        // corner
        let rest = (1.0 - b1).clamp(0.0, 1.0);
        let strip = ((1.0 - rest * rest) * 4.0) as usize;
        let along = (b2 / rest.max(1e-6) * 4.0) as usize;
        return Some(strip.min(3) * 4 + along.min(3));
    }
    if case.is_infinite() {
        // Position on the disk in front of the scene, perpendicular to the direction
        let to = e.p - WORLD.center;
        let is_before = (to.dot(e.w) + WORLD.radius).abs() < SLACK;
        let x = e.w.cross(Vec3::new(0.6, 0.0, 0.8)).normalize();
        let disk = Vec2::new(to.dot(x), to.dot(e.w.cross(x))) / WORLD.radius;
        if !is_before || disk.length() > 1.0 + SLACK {
            return None;
        }
        let ring = (disk.length_squared() * 4.0) as usize;
        let turn = ((disk.to_angle() as f64 / (2.0 * PI) + 0.5) * 4.0) as usize;
        return Some(ring.min(3) * 4 + turn.min(3));
    }
    // All samples of a point light are at a single point.
    let position = match &case.light {
        Light::Point(light) => light.position,
        Light::Spot(light) => light.position,
        _ => return None,
    };
    (e.p == position).then_some(0)
}

#[test]
fn triangle_emission_follows_its_density() {
    follow_their_densities(|case| case.corners.is_some());
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn point_emission_follows_its_density() {
    follow_their_densities(|case| case.corners.is_none() && !case.is_infinite());
}

#[test]
fn infinite_emission_follows_its_density() {
    follow_their_densities(Case::is_infinite);
}

/// Directions have the density of `emission_pdfs`. For each direction, positions are uniform.
fn follow_their_densities(of: impl Fn(&Case) -> bool) {
    let samples = budget(1_600_000).min(400_000);
    let cases: Vec<Case> = cases().into_iter().filter(of).collect();
    assert!(!cases.is_empty());
    let level = sidak(0.01, 2 * cases.len());
    for case in &cases {
        let light = case.even();
        let ng = case.corners.map_or(Vec3::ZERO, |[a, b, c]| triangle_normal(a, b, c));
        let is_delta = matches!(light, Light::Directional(_));
        let parts = if case.corners.is_some() || case.is_infinite() {
            16
        } else {
            1
        };
        // Sectors of directions: octants, each cut into three
        const SECTORS: usize = 24;
        let sector = |w: Vec3| {
            let octant = w.cmpge(Vec3::ZERO).bitmask() as usize;
            octant * 3
                + [w.x, w.y, w.z]
                    .map(f32::abs)
                    .iter()
                    .filter(|&&x| x > 0.6)
                    .count()
                    .min(2)
        };
        let mut counts = [[0.0; 16]; SECTORS];
        let sample = |i| {
            let [u_position, u_direction] = numbers(i);
            let e = light.sample_emission(TIME, u_position, u_direction, &[], &WORLD)?;
            let place = part(case, &e).unwrap_or_else(|| panic!("{}: {e:?} is elsewhere", case.name));
            counts[sector(e.w)][place] += 1.0;
            Some(e.w)
        };
        if is_delta {
            let mut sample = sample;
            assert!((0..samples).all(|i| sample(i).is_some()));
        } else {
            let pdf = |w| light.emission_pdfs(ng, w, TIME, &WORLD)[1] as f64;
            let has_edges = matches!(light, Light::Spot(_) | Light::Sun(_) | Light::Environment(_));
            let outcome = chi_square(samples, sample, pdf, has_edges);
            eprintln!("{}: directions {outcome:?}", case.name);
            assert!(outcome.p_value > level, "{}: {outcome:?}", case.name);
            assert!((outcome.integral - 1.0).abs() < 2e-3, "{}: {outcome:?}", case.name);
        }
        // Test positions, separately for each sector of directions
        let (mut statistic, mut freedom) = (0.0, 0.0);
        for counts in counts {
            let expected = counts.iter().sum::<f64>() / parts as f64;
            if expected >= 5.0 {
                statistic += counts[..parts]
                    .iter()
                    .map(|n| (n - expected).powi(2) / expected)
                    .sum::<f64>();
                freedom += (parts - 1) as f64;
            }
        }
        if freedom > 0.0 {
            let p_value = 1.0 - ChiSquared::new(freedom).unwrap().cdf(statistic);
            eprintln!("{}: places {p_value:.4} of {freedom} degrees", case.name);
            assert!(p_value > level, "{}: places {p_value}", case.name);
        }
    }
}

#[test]
fn emission_samples_have_the_queried_densities() {
    const SAMPLES: u32 = 20_000;
    for case in cases() {
        let (mut drawn, mut other) = (0, 0);
        for e in (0..SAMPLES).filter_map(|i| case.sample(i)) {
            drawn += 1;
            assert!(e.w.is_normalized(), "{}: {e:?}", case.name);
            let is_area = case.corners.is_some();
            assert_eq!(e.is_infinite, case.is_infinite(), "{}", case.name);
            assert_eq!(e.is_delta_position, !is_area && !e.is_infinite, "{}", case.name);
            assert_eq!(e.is_delta_direction, case.name == "directional");
            let asked = case.light.emission_pdfs(e.ng, e.w, TIME, &WORLD);
            assert_eq!(asked[0], e.pdf_position, "{}", case.name);
            let expected = match case.corners {
                Some([a, b, c]) => 1.0 / triangle_area(a, b, c),
                None if e.is_infinite => 1.0 / (PI * (WORLD.radius as f64).powi(2)),
                None => 1.0,
            };
            assert!(
                (e.pdf_position as f64 / expected - 1.0).abs() < 1e-5,
                "{}: {e:?}",
                case.name
            );
            // Rounding may select the neighbouring texel of an environment.
            other += u32::from((asked[1] / e.pdf_direction - 1.0).abs() > 1e-3);
            // The ray starts slightly above the front of the light
            if let Some(corners) = case.corners {
                let n = Facet::new(corners).normal();
                assert!(e.ng.distance(n) < 1e-5 && e.w.dot(n) > -1e-6, "{}: {e:?}", case.name);
                let height = (e.origin - e.p).dot(n);
                assert!(height > 0.0 && height < 1e-4, "{}: {e:?}", case.name);
            } else {
                assert!(e.origin == e.p && e.ng == if e.is_infinite { e.w } else { Vec3::ZERO });
                assert_eq!(e.cos(), 1.0);
            }
        }
        assert!(drawn > SAMPLES / 4, "{}: {drawn}", case.name);
        let is_map = case.name == "environment";
        assert!(
            other <= if is_map { SAMPLES / 500 } else { 0 },
            "{}: {other}",
            case.name
        );
    }
}

/// Means over all samples, for each channel.
fn mean(n: u32, value: impl Fn(u32) -> Spectrum) -> [Mean; 3] {
    let mut sums = [[0.0; 2]; 3];
    for i in 0..n {
        for (sum, v) in sums.iter_mut().zip(value(i).to_array()) {
            sum[0] += v as f64;
            sum[1] += (v as f64).powi(2);
        }
    }
    sums.map(|[sum, squares]| {
        let mean = sum / n as f64;
        Mean::new(mean, ((squares / n as f64 - mean * mean).max(0.0) / n as f64).sqrt())
    })
}

/// Power of the light: its colour integrated over area or directions on a fine grid, in each
/// channel.
fn power(case: &Case) -> [f64; 3] {
    let grid = |n: usize| (0..n * n).map(move |i| (Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32);
    let color = Spectrum::rgb(3.0, 2.0, 5.0).to_array().map(f64::from);
    let area = case.corners.map_or(0.0, |[a, b, c]| triangle_area(a, b, c));
    let disk = PI * (WORLD.radius as f64).powi(2);
    match &case.light {
        Light::Area(AreaLight::Triangle(_) | AreaLight::MovingTriangle(_)) => color.map(|c| PI * area * c),
        // `shaped_lights` tests these lights.
        Light::Area(AreaLight::Sphere(_) | AreaLight::Disk(_) | AreaLight::Rectangle(_)) => [f64::NAN; 3],
        Light::Area(AreaLight::Textured(light)) => {
            let (mut sum, mut n) = ([0.0; 3], 0.0);
            for p in grid(1000).filter(|p| p.x + p.y < 1.0) {
                n += 1.0;
                for (s, v) in sum.iter_mut().zip(light.color(p.x, p.y, textures()).to_array()) {
                    *s += v as f64;
                }
            }
            [0, 1, 2].map(|i| PI * area * color[i] * sum[i] / n)
        }
        Light::Point(_) => color.map(|c| 4.0 * PI * c),
        Light::Spot(light) => {
            // The smooth step has a point symmetry in the middle of the rim. The power is therefore
            // that of a spot light with a sharp rim at this cosine.
            let middle = 0.5 * (light.cos_inner + light.cos_outer) as f64;
            color.map(|c| 2.0 * PI * (1.0 - middle) * c)
        }
        Light::Constant(_) => color.map(|c| 4.0 * PI * disk * c),
        Light::Directional(_) => color.map(|c| disk * c),
        Light::Sun(_) => {
            let half = f64::from(0.5 * SUN_ANGLE).to_radians();
            color.map(|c| disk * 2.0 * (1.0 - half.cos()) / half.sin().powi(2) * c)
        }
        Light::Environment(light) => {
            let mut sum = [0.0; 3];
            let n = 1000;
            for u in grid(n) {
                let (z, phi) = (2.0 * u.x - 1.0, std::f32::consts::TAU * u.y);
                let r = (1.0 - z * z).sqrt();
                let radiance = light.radiance(Vec3::new(r * phi.cos(), r * phi.sin(), z));
                for (s, v) in sum.iter_mut().zip(radiance.to_array()) {
                    *s += v as f64 / (n * n) as f64;
                }
            }
            sum.map(|s| 4.0 * PI * disk * s)
        }
    }
}

#[test]
fn mean_emission_weight_is_the_power() {
    let samples = budget(800_000).min(200_000);
    for case in cases() {
        let means = mean(samples, |i| case.sample(i).map_or(Spectrum::ZERO, |e| e.weight()));
        let expected = power(&case);
        for (mean, expected) in means.into_iter().zip(expected) {
            assert_means_within(case.name, mean, Mean::exact(expected), 2e-4 * expected);
            assert!(
                mean.error() < 0.02 * expected,
                "{}: {mean}: the error is too large",
                case.name
            );
        }
        // Compare with the power that light selection estimates
        let luminance: f64 = means
            .iter()
            .zip([0.2126, 0.7152, 0.0722])
            .map(|(m, w)| m.value * w)
            .sum();
        let close = match case.light {
            Light::Area(AreaLight::MovingTriangle(_) | AreaLight::Textured(_)) => 0.25,
            _ => 0.03,
        };
        let chosen = case.light.power(WORLD.radius);
        assert!(
            (luminance / chosen - 1.0).abs() < close,
            "{}: {luminance} {chosen}",
            case.name
        );
    }
}

/// Light traced onto a patch of the floor equals light sampled from the patch.
#[test]
fn traced_light_matches_sampled_light_on_a_floor() {
    let samples = budget(1_200_000).min(300_000);
    let (middle, half) = (Vec2::new(0.1, -0.05), 0.4);
    let area: f32 = 4.0 * half * half;
    for case in cases() {
        let followed = mean(samples, |i| {
            let meet = |e: &Emission| {
                let t = -e.origin.y / e.w.y;
                let q = e.origin + t * e.w;
                let away = (Vec2::new(q.x, q.z) - middle).abs().max_element();
                e.w.y < 0.0 && t > 0.0 && away < half
            };
            let e = case.sample(i).filter(meet);
            e.map_or(Spectrum::ZERO, |e| e.weight() / area)
        });
        let sampled = mean(samples / 2, |i| {
            let [u_place, u] = numbers(i);
            let place = middle + half * (2.0 * u_place - 1.0);
            let p = Vec3::new(place.x, 0.0, place.y);
            let s = case.light.sample(p, TIME, u, textures());
            s.map_or(Spectrum::ZERO, |s| s.radiance * (s.wi.y.max(0.0) / s.pdf))
        });
        for c in 0..3 {
            let [a, b] = [followed[c], sampled[c]];
            assert_same_mean(format!("{} {c}, followed and sampled", case.name), a, b);
            let error = a.error().hypot(b.error());
            assert!(
                error < 0.02 * b.value,
                "{} {c}: {a} {b}: the error is too large",
                case.name
            );
        }
    }
}

/// Light traced from a lamp to a floor and then to a moving lens gives each pixel the same light as
/// camera rays.
#[test]
fn splats_match_camera_rays() {
    let size = UVec2::new(6, 4);
    let first = CameraParameters {
        position: Vec3::new(0.3, 1.0, 2.0),
        look_at: Vec3::new(0.1, 0.0, 0.0),
        up: Vec3::Y,
        vertical_fov: 50.0,
        lens_radius: 0.0,
        focus_distance: 1.5,
    };
    let close = Pose {
        position: Vec3::new(-0.3, 1.2, 1.8),
        look_at: Vec3::new(-0.1, 0.0, 0.1),
        up: Vec3::new(0.2, 1.0, 0.0),
    };
    let motion = CameraMotion {
        close: Some(close),
        shutter: [0.2, 0.9],
    };
    let lens = CameraParameters {
        lens_radius: 0.2,
        ..first
    };
    let cameras = [
        Camera::new(first, size).unwrap(),
        Camera::moving(lens, motion, size).unwrap(),
    ];
    let filters = [Filter::BOX, Filter::new(FilterKind::Mitchell, 2.0)];
    let lamp = Light::from(TriangleLight::new(CORNERS, Spectrum::ONE, TriangleSampling::Area));
    // The floor is large and has albedo 1
    const REFLECTED: f64 = 1.0 / PI;
    let samples = budget(1_600_000).min(400_000);
    let numbers = |i: u32| {
        let mut sampler = Independent::new(29);
        sampler.start(SampleKey::new(0, 0, i));
        [0, 1, 2, 3].map(|k| sampler.get_2d(Dimension::PIXEL.nth(k)))
    };
    let pixels = || (0..size.y).flat_map(|y| (0..size.x).map(move |x| Vec2::new(x as f32, y as f32)));
    for (camera, filter) in cameras.iter().zip(&filters) {
        let mut splats = vec![[0.0; 2]; pixels().count()];
        for i in 0..samples {
            let [u_position, u_direction, u_lens, u_time] = numbers(i);
            let time = camera.time(u_time.x);
            let Some(e) = lamp.sample_emission(time, u_position, u_direction, &[], &WORLD) else {
                continue;
            };
            let t = -e.p.y / e.w.y;
            if t <= 0.0 {
                continue;
            }
            let q = e.p + t * e.w;
            let lens = camera.lens_point(u_lens, time);
            let p = lens.p;
            let w = (q - p).normalize();
            let Some(seen) = camera.importance(p, w, time) else {
                continue;
            };
            // Compute the geometry term between floor and lens
            let g = w.y.abs() * w.dot(lens.normal) / q.distance_squared(p);
            let value = e.weight().mean() * g * seen.we * camera.lens_area();
            for (splat, pixel) in splats.iter_mut().zip(pixels()) {
                let v = (value * filter.eval(seen.film - pixel - 0.5)) as f64 * REFLECTED;
                *splat = [splat[0] + v, splat[1] + v * v];
            }
        }
        let n = samples as f64;
        let brightest = splats.iter().fold(0.0, |brightest: f64, s| brightest.max(s[0] / n));
        for (pixel, [sum, squares]) in pixels().zip(splats) {
            let splat = Mean::new(sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt());
            let [seen, ..] = mean(20_000, |i| {
                let [u_place, u_lens, u_time, u] = numbers(i);
                let (place, weight) = filter.sample(u_place);
                let time = camera.time(u_time.x);
                let ray = camera.ray(pixel + place, u_lens, time);
                let q = ray.at(-ray.origin.y / ray.direction.y);
                let s = lamp.sample(q, time, u, &[]).filter(|_| ray.direction.y < 0.0);
                s.map_or(Spectrum::ZERO, |s| {
                    s.radiance * (weight * s.wi.y.max(0.0) / s.pdf * REFLECTED as f32)
                })
            });
            assert_same_mean(format!("{pixel}, splatted and seen"), splat, seen);
            let error = splat.error().hypot(seen.error());
            assert!(
                error < 0.02 * brightest,
                "{pixel}: {splat} {seen}: the error is too large"
            );
        }
    }
}

/// The bounding ball contains moving objects at any time. Degenerate triangles do not change the
/// ball.
#[test]
fn bounding_ball_contains_moving_objects() {
    let mut b = SceneBuilder::new();
    let close = |mesh: Mesh, by: Vec3| Mesh {
        positions_close: mesh.positions.iter().map(|&p| 1.5 * p + by).collect(),
        ..mesh
    };
    let id = b.add_material(material(0.5, 1.0)).unwrap();
    b.add_mesh(close(panel(1.0, 0.5), Vec3::new(0.0, 3.0, 0.0)), id)
        .unwrap();
    let prototype = b
        .add_prototype(vec![(close(sphere(0.3, Vec3::X, 1), Vec3::ZERO), id)])
        .unwrap();
    // Rotations of one full turn in 16 steps
    let turn = |i: u32| Affine3A::from_rotation_z(std::f32::consts::TAU * i as f32 / 16.0);
    let around: Vec<Affine3A> = (0..=16).map(turn).collect();
    b.add_instance(prototype, Placement::Moving(around.into())).unwrap();
    let nothing = polygon(&[Vec3::X, Vec3::X, Vec3::X]);
    let nothing = b.add_prototype(vec![(nothing, id)]).unwrap();
    b.add_instance(nothing, Placement::Still(Affine3A::IDENTITY)).unwrap();
    let scene = b.build().unwrap().0;
    let ball = scene.ball();
    let (mut furthest, mut checked) = (0.0f32, 0);
    for (geom, inst) in [(GeomId(0), InstanceId::NONE), (GeomId(1), InstanceId(0))] {
        for prim in (0..scene.mesh(geom).triangles.len() as u32).map(PrimId) {
            let hit = Hit::at_corner(geom, prim, inst);
            for time in (0..=200).map(|i| i as f32 / 200.0) {
                let places = scene.corners(&hit, time);
                checked += 3;
                furthest = places.into_iter().fold(furthest, |f, p| f.max(p.distance(ball.center)));
            }
        }
    }
    assert!(checked > 10_000 && furthest <= ball.radius, "{furthest} {ball:?}");
    assert!(ball.radius < 2.0 * furthest, "{furthest} {ball:?}");
    let empty = SceneBuilder::new().build().unwrap().0.ball();
    assert_eq!((empty.center, empty.radius), (Vec3::ZERO, 1.0));
}

/// For emission, lights are selected by their power. The selection allocates no memory before its
/// first use.
#[test]
fn emission_selection_is_by_power() {
    let mut b = SceneBuilder::new();
    add(&mut b, panel(0.0, 1.0), material(0.5, 2.0));
    b.add_point_light(Vec3::Z, Spectrum::ONE).unwrap();
    b.add_point_light(Vec3::Z, Spectrum::ZERO).unwrap();
    b.add_constant_light(Spectrum::splat(0.25)).unwrap();
    let scene = b.build().unwrap().0;
    let before = scene.bytes();
    let selection = scene.emission_selection();
    assert_eq!(scene.bytes(), before + selection.bytes() as u64);
    assert!(selection.bytes() > 0);
    // A square of 4 m², a point, nothing, and the sky around a ball of radius √2
    let powers = [8.0 * PI, 4.0 * PI, 0.0, 4.0 * PI * PI * 2.0 * 0.25];
    let total: f64 = powers.iter().sum();
    for (id, power) in (0..).map(LightId).zip(powers) {
        let pmf = selection.pmf(id) as f64;
        assert!((pmf - power / total).abs() < 1e-5, "{id:?}: {pmf} {}", power / total);
        assert!(power > 0.0 || pmf == 0.0);
    }
    let (id, pmf) = selection.sample(0.99).unwrap();
    assert_eq!((id, pmf), (LightId(3), selection.pmf(id)));
}
