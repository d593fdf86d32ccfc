//! Helpers of several test programs: scenes made in code, renders, readers of images, shared files.

#![allow(dead_code, missing_docs)] // Each test program uses only a part of this module.

pub mod program;
pub mod statistics;

use embrasure::accel::Accel;
use embrasure::bsdf::Fresnel;
use embrasure::camera::{Camera, CameraParameters};
use embrasure::color::Spectrum;
use embrasure::compare::Errors;
use embrasure::film::{Film, Filter, Rect, RgbImage};
use embrasure::geometry::Mesh;
use embrasure::integrator::{
    Heuristic, ImportanceImage, ImportanceImageMaker, IterationIntegrator, PathIntegrator, ReusingPathIntegrator,
    Roulette, Strategy, World,
};
use embrasure::light_sampling::{LightChoice, SelectionMode};
use embrasure::material::{Gloss, Map, Material};
use embrasure::math::{UVec2, Vec2, Vec3};
use embrasure::pipeline::CompiledIntegrator;
use embrasure::render::{Observer, Outcome, Statistics, StopCondition, importance_image};
use embrasure::sampler::{Independent, RenderSampler, SamplerKind};
use embrasure::scene::{Scene, SceneBuilder};
use embrasure::scene_file::{SceneFile, load_scene};
use embrasure::texture::{Mapping, Texels, Texture, TextureId, Wrap};
use std::path::{Path, PathBuf};

/// Returns true if all values of two pictures agree within rounding errors of `f32` sums.
pub fn agree_within_rounding(a: &[f64], b: &[f64]) -> bool {
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-5 * (a.abs() + b.abs()) + 1e-9;
    a.len() == b.len() && a.iter().zip(b).all(is_near)
}

/// Number of samples, iterations or rays that a statistical test uses. It is `n` in `make
/// test-long`, which sets `EMBRASURE_ALL_SAMPLES`, a quarter of `n` in `make test-all`, and an
/// eighth of `n` in `make test`. A bound in standard errors is valid for all three numbers. An
/// absolute bound that was chosen for `n` must be multiplied by [`slack`].
pub fn budget(n: u32) -> u32 {
    n / share()
}

/// Standard error with the number of samples of [`budget`], divided by the error with all samples.
pub fn slack() -> f64 {
    f64::from(share()).sqrt()
}

/// Ratio of the number of all samples to the number of samples used.
fn share() -> u32 {
    match std::env::var_os("EMBRASURE_ALL_SAMPLES") {
        Some(_) => 1,
        None if cfg!(long) => 4,
        None => 8,
    }
}

/// Backend of this build, or brute force if there is no other.
#[cfg(feature = "embree")]
type BuiltAccel<'a> = embrasure::accel::embree::EmbreeAccel<'a>;
#[cfg(all(feature = "obvhs", not(feature = "embree")))]
type BuiltAccel<'a> = embrasure::accel::bvh::BvhAccel;
#[cfg(not(any(feature = "embree", feature = "obvhs")))]
type BuiltAccel<'a> = embrasure::accel::brute::BruteForce<'a>;

/// A backend behind dynamic dispatch. The integrators are compiled for this type.
pub type Backend<'a> = &'a dyn Accel;

/// The acceleration structure of `scene`.
pub fn backend(scene: &Scene) -> BuiltAccel<'_> {
    #[cfg(feature = "embree")]
    return BuiltAccel::new(scene, 2).expect("Embree");
    #[cfg(not(feature = "embree"))]
    return BuiltAccel::new(scene);
}

/// A scene, and how its lights are selected.
pub struct LitScene<'a> {
    scene: &'a Scene,
    choice: LightChoice,
}

impl<'a> From<&'a Scene> for LitScene<'a> {
    fn from(scene: &'a Scene) -> Self {
        (scene, LightChoice::default()).into()
    }
}

impl<'a> From<(&'a Scene, SelectionMode)> for LitScene<'a> {
    fn from((scene, mode): (&'a Scene, SelectionMode)) -> Self {
        let choice = LightChoice {
            mode,
            ..LightChoice::default()
        };
        (scene, choice).into()
    }
}

impl<'a> From<(&'a Scene, LightChoice)> for LitScene<'a> {
    fn from((scene, choice): (&'a Scene, LightChoice)) -> Self {
        Self { scene, choice }
    }
}

/// Calls `look` with the world of `scene`, seen by `camera`.
pub fn with_world<'a, T>(
    scene: impl Into<LitScene<'a>>,
    camera: CameraParameters,
    resolution: UVec2,
    look: impl FnOnce(World<Backend>) -> T,
) -> T {
    with_camera(scene, Camera::new(camera, resolution).unwrap(), look)
}

/// Calls `look` with the world of `scene`, seen by `camera`.
pub fn with_camera<'a, T>(scene: impl Into<LitScene<'a>>, camera: Camera, look: impl FnOnce(World<Backend>) -> T) -> T {
    let LitScene { scene, choice } = scene.into();
    let accel = backend(scene);
    let accel: Backend = &accel;
    let selection = scene.light_selection(choice);
    look(World::new(scene, &accel, &selection, &camera, &Filter::BOX))
}

/// Path tracer without path reuse and with one light sample. Tests change its fields.
pub fn path_tracer<A>(world: World<A>, max_depth: Option<u32>) -> PathIntegrator<A> {
    PathIntegrator {
        world,
        strategy: Strategy::default(),
        max_depth,
        roulette: Roulette::default(),
        light_samples: 1,
        clamp_indirect: None,
    }
}

/// The path tracer, with path reuse between pixels or without.
pub struct PathTracer<'a> {
    pub path: PathIntegrator<'a, Backend<'a>>,
    pub reuse: bool,
}

impl CompiledIntegrator for PathTracer<'_> {
    fn render(
        &self,
        sampler: &RenderSampler,
        film: &mut Film,
        stop: StopCondition,
        observer: &dyn Observer,
    ) -> (Outcome, Statistics) {
        let path = self.path;
        match self.reuse {
            true => ReusingPathIntegrator { path }.render(sampler, film, stop, observer),
            false => path.render(sampler, film, stop, observer),
        }
    }
}

/// Renders `scene` by the default path tracer, with seed 0.
pub fn render_film<'a>(
    scene: impl Into<LitScene<'a>>,
    camera: CameraParameters,
    size: [u32; 2],
    spp: u32,
    max_depth: Option<u32>,
) -> Film {
    let resolution = UVec2::from(size);
    with_world(scene, camera, resolution, |world| {
        film_of(&path_tracer(world, max_depth), resolution, spp, 0)
    })
}

/// Loads the scene of a TOML or OBJ file.
pub fn load(path: &Path) -> Scene {
    let file = match path.extension().is_some_and(|e| e == "toml") {
        true => SceneFile::load(path).unwrap(),
        false => SceneFile::of_obj(path),
    };
    load_scene(&file, SceneBuilder::new()).unwrap().scene
}

/// Loads a scene of the project by its file name.
pub fn own(name: &str) -> Scene {
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name))
}

/// Importance image for Metropolis chains, made in the same way as in a render.
pub fn rough_picture(world: World<Backend>, max_depth: u32) -> ImportanceImage {
    let maker = ImportanceImageMaker {
        world,
        heuristic: Heuristic::Power,
        max_depth: Some(max_depth),
        roulette: Roulette::default(),
    };
    importance_image(&maker, &Independent::new(0x7e57), &()).unwrap().0
}

/// Sampler of independent random numbers.
pub fn independent(seed: u64) -> RenderSampler {
    RenderSampler::Plain(SamplerKind::Independent.with_seed(seed, 0))
}

/// Sampler of the Sobol sequence.
pub fn sobol(seed: u64) -> RenderSampler {
    RenderSampler::Plain(SamplerKind::Sobol.with_seed(seed, 0))
}

/// Renders by any integrator, with independent samples.
pub fn film_of(integrator: &dyn CompiledIntegrator, resolution: UVec2, spp: u32, seed: u64) -> Film {
    film_by(&independent(seed), integrator, resolution, spp)
}

/// Renders by any sampler and integrator.
pub fn film_by(sampler: &RenderSampler, integrator: &dyn CompiledIntegrator, resolution: UVec2, spp: u32) -> Film {
    let mut film = Film::new(resolution, Rect::full(resolution));
    render_into(&mut film, integrator, sampler, spp);
    film
}

/// Renders with an integrator that has iterations. If the integrator separates its strategies, the
/// film has two parts for each strategy.
pub fn film_of_iterations(
    integrator: &(impl CompiledIntegrator + IterationIntegrator),
    resolution: UVec2,
    iterations: u32,
    seed: u64,
) -> Film {
    let mut film = Film::new(resolution, Rect::full(resolution)).with_parts(2 * integrator.strategies());
    render_into(&mut film, integrator, &independent(seed), iterations);
    film
}

/// Renders the missing samples or iterations of `film` up to `end`.
pub fn render_into(
    film: &mut Film,
    integrator: &dyn CompiledIntegrator,
    sampler: &RenderSampler,
    end: u32,
) -> Statistics {
    let (outcome, statistics) = integrator.render(sampler, film, StopCondition::at(end), &());
    assert_eq!((outcome, statistics.dropped), (Outcome::Complete, 0));
    statistics
}

/// Pinhole camera; `vertical_fov` in degrees.
pub fn pinhole(position: Vec3, look_at: Vec3, vertical_fov: f32) -> CameraParameters {
    let along_y = (look_at - position).cross(Vec3::Y).length() < 1e-3;
    CameraParameters {
        position,
        look_at,
        up: if along_y { Vec3::Z } else { Vec3::Y },
        vertical_fov,
        lens_radius: 0.0,
        focus_distance: 1.0,
    }
}

pub fn material(diffuse: f32, emission: f32) -> Material {
    Material {
        name: "m".into(),
        diffuse: Spectrum::splat(diffuse),
        emission: Spectrum::splat(emission),
        ..Material::default()
    }
}

/// Adds a mesh of one material.
pub fn add(builder: &mut SceneBuilder, mesh: Mesh, material: Material) {
    let id = builder.add_material(material).unwrap();
    builder.add_mesh(mesh, id).unwrap();
}

/// Convex polygon as a fan. Corners are counter-clockwise seen from the front.
pub fn polygon(corners: &[Vec3]) -> Mesh {
    Mesh {
        positions: corners.to_vec(),
        triangles: (1..corners.len() as u32 - 1).map(|i| [0, i, i + 1]).collect(),
        ..Mesh::default()
    }
}

/// Square in the plane z = `z`, centred on the z axis, of half width `half`, facing +z.
pub fn panel(z: f32, half: f32) -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(half * x, half * y, z);
    polygon(&[
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ])
}

/// Floor that only a mirror lights, and a camera above it. The mirror is level, and its normals are
/// tilted by `tilt` degrees.
pub fn floor_lit_by_a_mirror(tilt: f32) -> (Scene, CameraParameters) {
    // Square that faces up if `is_up`, otherwise down
    let square = |[x, y]: [f32; 2], half: f32, is_up: bool| {
        let corner = |u: f32, v: f32| Vec3::new(x + half * u, y, half * v);
        let mut corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(u, v)| corner(u, v));
        if !is_up {
            corners.reverse();
        }
        polygon(&corners)
    };
    let (sin, cos) = tilt.to_radians().sin_cos();
    let mirror = Mesh {
        normals: vec![Vec3::new(sin, -cos, 0.0); 4],
        ..square([-1.0, 2.0], 1.0, false)
    };
    let silver = Material {
        specular: Spectrum::ONE,
        gloss: Gloss::Mirror(Fresnel::Full),
        ..material(0.0, 0.0)
    };
    let mut b = SceneBuilder::new();
    add(&mut b, square([1.0, 0.0], 1.0, true), material(0.8, 0.0));
    add(&mut b, square([-1.0, 1.0], 0.8, true), material(0.0, 5.0));
    add(&mut b, mirror, silver);
    let camera = pinhole(Vec3::new(1.0, 3.0, 0.0), Vec3::new(1.001, 0.0, 0.0), 30.0);
    (b.build().unwrap().0, camera)
}

/// Box [-1, 1]³ seen from inside, with a lamp below its ceiling. The walls are flat. Their normal
/// map tilts normals by 45°, in four directions.
pub fn tilted_room() -> (Scene, CameraParameters) {
    let mut b = SceneBuilder::new();
    let (t, n) = (0.5f32.sqrt(), 0.5 + 0.5 * 0.5f32.sqrt());
    let tilts = [
        [0.5 + 0.5 * t, 0.5],
        [0.5 - 0.5 * t, 0.5],
        [0.5, 0.5 + 0.5 * t],
        [0.5, 0.5 - 0.5 * t],
    ];
    let texels = tilts.into_iter().flat_map(|[x, y]| [x, y, n]).collect();
    let texture = Texture::new(2, 2, 3, Texels::Floats(texels), Wrap::Repeat).unwrap();
    let normal = Map {
        texture: TextureId(0),
        mapping: Mapping::default(),
    };
    let mut wall = material(0.7, 0.0);
    wall.maps.normal = Some(normal);
    for triangle in room().triangles.chunks(2) {
        let [[p0, p2, p1], [_, p3, _]] = [triangle[0], triangle[1]].map(|t| t.map(|i| room().positions[i as usize]));
        let mesh = Mesh {
            uvs: [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)]
                .map(Vec2::from)
                .to_vec(),
            positions: vec![p0, p1, p2, p3],
            triangles: vec![[0, 2, 1], [0, 3, 2]],
            ..Mesh::default()
        };
        add(&mut b, mesh, wall.clone());
    }
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| Vec3::new(x, 0.8, z));
    add(&mut b, polygon(&corners), material(0.0, 5.0));
    b.set_textures(vec![texture], &[Some(TextureId(0))]);
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.9), Vec3::new(0.0, -0.1, -1.0), 80.0);
    (b.build().unwrap().0, camera)
}

/// Camera that views `panel(0, 1)` along −z; the panel fills the image.
pub fn from_front() -> CameraParameters {
    pinhole(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, 2.0 * 0.1f32.atan().to_degrees())
}

/// Box [-1, 1]³ whose faces point inwards.
pub fn room() -> Mesh {
    let positions = (0..8).map(|i| Vec3::new(sign(i), sign(i >> 1), sign(i >> 2))).collect();
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = quads
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, c, b], [a, d, c]])
        .collect();
    Mesh {
        positions,
        triangles,
        ..Mesh::default()
    }
}

fn sign(bit: usize) -> f32 {
    if bit & 1 == 1 { 1.0 } else { -1.0 }
}

/// Triangulated sphere: an octahedron subdivided `levels` times, facing outwards.
pub fn sphere(radius: f32, center: Vec3, levels: u32) -> Mesh {
    let octants = (0..8usize).map(|i| {
        let [x, y, z] = [Vec3::X * sign(i), Vec3::Y * sign(i >> 1), Vec3::Z * sign(i >> 2)];
        if sign(i) * sign(i >> 1) * sign(i >> 2) > 0.0 {
            [x, y, z]
        } else {
            [x, z, y]
        }
    });
    let mut faces: Vec<[Vec3; 3]> = octants.collect();
    for _ in 0..levels {
        let split = |[a, b, c]: [Vec3; 3]| {
            let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    Mesh {
        positions: faces.iter().flatten().map(|&p| center + radius * p).collect(),
        triangles: (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Mesh::default()
    }
}

/// z-scores of all pixels and channels against a known value.
pub fn z_scores(film: &Film, expected: f64) -> Vec<f64> {
    let pixels = film.pixels().map(|(_, a)| a);
    let z = pixels.flat_map(|a| {
        [0, 1, 2].map(|c| {
            let (error, variance) = (a.mean(c) - expected, a.variance_of_mean(c));
            assert!(error.is_finite() && variance >= 0.0, "{error} ± √{variance}");
            // A pixel without variance must have the exact value.
            if error == 0.0 { 0.0 } else { error / variance.sqrt() }
        })
    });
    z.collect()
}

/// Fails unless at most 0.4 % of the z-scores are beyond 3.5, and the mean is within 0.1 % of
/// `expected`, or within three standard errors if these are larger. An error of twice this size is
/// nearly always found.
pub fn assert_unbiased(what: &str, film: &Film, expected: f64) {
    let z = z_scores(film, expected);
    let beyond = z.iter().filter(|z| z.abs() > 3.5).count() as f64 / z.len() as f64;
    // P(|z| > 3.5) is 0.0005 for a normal variable. Means of a few hundred skewed samples have
    // heavier tails.
    assert!(
        beyond <= 0.004,
        "{what}: {:.2} % of the pixels are beyond 3.5 σ",
        100.0 * beyond
    );
    let (mean, error) = (film_mean(film, 0), film_error(film, 0));
    println!("{what}: mean {mean} ± {error}, expected {expected}");
    assert!(
        (mean - expected).abs() < (1e-3 * expected).max(3.0 * error),
        "{what}: mean {mean} ± {error}, expected {expected}"
    );
}

/// Mean of channel `c` over all pixels.
pub fn film_mean(film: &Film, c: usize) -> f64 {
    let means: Vec<f64> = film.pixels().map(|(_, a)| a.mean(c)).collect();
    means.iter().sum::<f64>() / means.len() as f64
}

/// Standard error of [`film_mean`].
pub fn film_error(film: &Film, c: usize) -> f64 {
    let v: Vec<f64> = film.pixels().map(|(_, a)| a.variance_of_mean(c)).collect();
    v.iter().sum::<f64>().sqrt() / v.len() as f64
}

/// Writes an 8-bit RGB PNG, `width` texels wide.
pub fn write_png(path: &Path, width: u32, texels: &[[u8; 3]]) {
    let file = std::fs::File::create(path).unwrap();
    let mut encoder = png::Encoder::new(file, width, texels.len() as u32 / width);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(texels.as_flattened()).unwrap();
}

/// Values of a channel of an EXR file.
pub fn read_channel(path: &Path, name: &str) -> Vec<f32> {
    use exr::prelude::*;
    let image = read_first_flat_layer_from_file(path).unwrap();
    let channel = image.layer_data.channel_data.list.iter().find(|c| c.name.eq(name));
    channel
        .unwrap_or_else(|| panic!("{} has no channel {name}", path.display()))
        .sample_data
        .values_as_f32()
        .collect()
}

/// Coverage of `name` in each pixel, read from the Cryptomatte layer `layer` with the manifest of
/// the file.
pub fn matte(path: &Path, layer: &str, name: &str) -> Vec<f32> {
    use exr::prelude::*;
    let file = read_first_flat_layer_from_file(path).unwrap();
    let attributes = &file.layer_data.attributes.other;
    let text = |key: &str| match attributes.get(&Text::from(key)) {
        Some(AttributeValue::Text(text)) => Some(text.to_string()),
        _ => None,
    };
    let keys = attributes.keys().map(Text::to_string);
    let mut prefixes = keys.filter_map(|k| k.strip_suffix("/name").map(str::to_string));
    let prefix = prefixes
        .find(|p| text(&format!("{p}/name")).as_deref() == Some(layer))
        .unwrap();
    assert_eq!(text(&format!("{prefix}/conversion")).unwrap(), "uint32_to_float32");
    let manifest: serde_json::Value = serde_json::from_str(&text(&format!("{prefix}/manifest")).unwrap()).unwrap();
    let id = u32::from_str_radix(manifest[name].as_str().unwrap(), 16).unwrap();
    let mut share = vec![0.0; read_channel(path, "R").len()];
    for level in 0..3 {
        for [id_channel, coverage] in [["R", "G"], ["B", "A"]] {
            let channel = |c: &str| read_channel(path, &format!("{layer}{level:02}.{c}"));
            for (share, (found, covered)) in share.iter_mut().zip(channel(id_channel).iter().zip(channel(coverage))) {
                *share += if found.to_bits() == id { covered } else { 0.0 };
            }
        }
    }
    share
}

/// Red, green and blue of an EXR file.
pub fn read_rgb(path: &Path) -> [Vec<f32>; 3] {
    ["R", "G", "B"].map(|name| read_channel(path, name))
}

/// relMSE, the error measure of the suite.
pub fn rel_mse(image: &[Vec<f32>; 3], reference: &[Vec<f32>; 3]) -> f64 {
    let joined = |image: &[Vec<f32>; 3]| RgbImage {
        width: image[0].len(),
        height: 1,
        pixels: (0..image[0].len()).map(|i| [0, 1, 2].map(|c| image[c][i])).collect(),
    };
    Errors::new(&joined(image), &joined(reference)).unwrap().rel_mse
}

/// Path of a file or folder below `../shared`, which has scenes outside of the project. Tests that
/// call this function have `#[cfg_attr(not(shared), ignore = "needs ../shared")]`; build.rs sets
/// that configuration.
pub fn shared(relative: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(relative);
    assert!(path.exists(), "{} is required here and missing", path.display());
    path
}

/// Path of the browser. Tests that call this function have `#[cfg_attr(not(chromium), ignore =
/// "needs chromium")]`; build.rs sets that configuration.
pub fn chromium() -> &'static Path {
    let Some(program) = option_env!("EMBRASURE_CHROMIUM") else {
        panic!(
            "EMBRASURE_REQUIRE_CHROMIUM is set, but there was no Chromium in PATH when the tests were built: install it, and `touch build.rs`"
        );
    };
    Path::new(program)
}

/// Box whose faces point outwards.
pub fn slab(center: Vec3, half: Vec3) -> Mesh {
    let mut mesh = room();
    mesh.positions.iter_mut().for_each(|p| *p = center + half * *p);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// Glass of refractive index 1.5 with `transmission` at each face of a body, or of a thin
/// dielectric if `thin`.
pub fn glass(transmission: [f32; 3], thin: bool) -> Material {
    Material {
        transmission: transmission.into(),
        thin,
        ..material(0.0, 0.0)
    }
}

/// Builder of a room lit by a lamp behind a coloured pane. Tests add objects.
pub fn room_below_a_pane() -> SceneBuilder {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    let mut lamp = panel(0.0, 0.5);
    lamp.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, 0.97, -p.y));
    lamp.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    add(&mut b, lamp, material(0.0, 4.0));
    let half = Vec3::new(0.8, 0.005, 0.8);
    add(
        &mut b,
        slab(Vec3::new(0.0, 0.6, 0.0), half),
        glass([0.95, 0.9, 0.7], false),
    );
    b
}

/// Room lit by a lamp behind a coloured pane, with thin glass, a filter, a mirror and a block.
/// Paths of every kind go through some of these objects.
pub fn glazed_room() -> Scene {
    use embrasure::material::Gloss;
    let mut b = room_below_a_pane();
    add(
        &mut b,
        slab(Vec3::new(0.1, -0.2, 0.1), Vec3::splat(0.3)),
        material(0.6, 0.0),
    );
    add(&mut b, panel(-0.3, 0.75), glass([0.8, 1.0, 0.9], true));
    let veil = Material {
        diffuse: Spectrum::splat(0.2),
        ior: 1.0,
        ..glass([0.3, 0.5, 0.6], true)
    };
    add(&mut b, panel(-0.5, 0.4), veil);
    let mirror = Material {
        specular: Spectrum::splat(0.9),
        gloss: Gloss::Mirror(embrasure::bsdf::Fresnel::Full),
        ..material(0.0, 0.0)
    };
    add(&mut b, panel(-0.9, 0.6), mirror);
    let (scene, report) = b.build().unwrap();
    assert_eq!(report.panes, 1);
    scene
}

/// Camera inside [`glazed_room`] that faces its panes and filters.
pub fn in_glazed_room() -> CameraParameters {
    pinhole(Vec3::new(0.0, 0.0, 0.95), Vec3::new(0.1, -0.1, -1.0), 80.0)
}

/// Room with a wide lamp and objects with every kind of lobe.
pub fn lobes_room() -> Scene {
    use embrasure::bsdf::Fresnel;
    use embrasure::material::Gloss;
    let grey = Spectrum::splat;
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    let quad = |y: f32, x: f32, z: f32, up: bool| {
        let corners = [
            Vec3::new(-x, y, -z),
            Vec3::new(-x, y, z),
            Vec3::new(x, y, z),
            Vec3::new(x, y, -z),
        ];
        let turned = [corners[0], corners[3], corners[2], corners[1]];
        polygon(if up { &corners } else { &turned })
    };
    add(&mut b, quad(0.98, 0.6, 0.6, false), material(0.0, 3.0));
    let phong = Material {
        specular: Spectrum::rgb(0.4, 0.5, 0.3),
        gloss: Gloss::Phong(20.0),
        ..material(0.3, 0.0)
    };
    add(&mut b, quad(-0.95, 0.9, 0.9, true), phong);
    let blinn = Material {
        specular: grey(0.6),
        gloss: Gloss::Blinn(12.0, Fresnel::Dielectric { eta: 1.8 }),
        ..material(0.3, 0.0)
    };
    add(&mut b, sphere(0.3, Vec3::new(-0.55, -0.6, -0.5), 2), blinn);
    let glass = Material {
        transmission: Spectrum::rgb(0.9, 1.0, 0.8),
        ..material(0.0, 0.0)
    };
    add(&mut b, sphere(0.3, Vec3::new(0.5, -0.6, -0.1), 2), glass);
    let gold = Fresnel::Conductor {
        eta: [0.14, 0.37, 1.44],
        k: [3.98, 2.39, 1.60],
    };
    let metal = Material {
        specular: Spectrum::ONE,
        gloss: Gloss::Blinn(30.0, gold),
        ..material(0.0, 0.0)
    };
    add(&mut b, sphere(0.25, Vec3::new(0.0, -0.1, -0.6), 2), metal);
    let mirror = Material {
        specular: grey(0.4),
        gloss: Gloss::Mirror(gold),
        ..material(0.4, 0.0)
    };
    add(&mut b, sphere(0.2, Vec3::new(0.6, 0.2, -0.7), 2), mirror);
    let veil = Material {
        transmission: grey(0.6),
        thin: true,
        ior: 1.3,
        ..material(0.3, 0.0)
    };
    add(
        &mut b,
        polygon(&[
            Vec3::new(-0.9, -0.4, 0.2),
            Vec3::new(-0.2, -0.4, 0.3),
            Vec3::new(-0.2, 0.4, 0.3),
            Vec3::new(-0.9, 0.4, 0.2),
        ]),
        veil,
    );
    b.build().unwrap().0
}
