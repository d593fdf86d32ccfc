//! The library gives the same results as the command line.

use crate::support::program::{assert_same_bits, done, folder, joined, read_json, split};
use crate::support::write_png;
use embrasure::accel::Accel;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::film::Film;
use embrasure::integrator::{SampleTracer, Sink, World};
use embrasure::material::BsdfSlot;
use embrasure::math::{UVec2, Vec3};
use embrasure::sampler::{Bounce, Dimension, SampleKey, Sampler};
use embrasure::sampling::warp::cosine_hemisphere;
use embrasure::scene::SceneBuilder;
use embrasure::{
    Aov, Backend, Error, ExrFormat, Format, IntegratorKind, LoadObserver, Observer, Outcome, Output, PictureParts,
    SceneFile, Session, Settings, read_checkpoint,
};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use tempfile::TempDir;

/// Two quads with a smooth edge between them. The MTL dialect decides how their material is read.
fn scene() -> TempDir {
    folder(&[
        ("a.mtl", "newmtl a\nKd 0.6 0.5 0.4\nKs 0.3 0.3 0.3\nNs 40\nTr 0\n"),
        (
            "a.obj",
            "mtllib a.mtl\nusemtl a\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 0.5 -2\nv 1 0.5 -2\nf 4 3 2 1\nf 1 2 6 5\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0.5, 2, 3]\nlook_at = [0, 0, -0.5]\n[image]\nwidth = 24\nheight = 16\n\
             [render]\nsamples = 128\nsmooth = 60.0\nmtl_dialect = \"max\"\ntexture_filter = \"bilinear\"\nseed = 7\n\
             [[light]]\ntype = \"point\"\nposition = [1, 2, 1]\nintensity = [9, 9, 9]\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

fn session(path: &Path, change: impl FnOnce(&mut Settings)) -> Result<Session, Error> {
    let file = SceneFile::load(path)?;
    let mut settings = Settings::of(&file);
    change(&mut settings);
    Session::load(&file, settings, &())
}

/// Observer that stops a render after a number of samples.
struct StopAfter(AtomicU64);

impl Observer for StopAfter {
    fn progress(&self, samples: u64) {
        let _ = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| {
            Some(n.saturating_sub(samples))
        });
    }

    fn should_stop(&self) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}

/// Observer that records the steps of loading, in their order.
#[derive(Default)]
struct Work(Mutex<Vec<String>>);

impl LoadObserver for Work {
    fn begin(&self, what: &str, _: u64) {
        let name = what.rsplit(['/', '\\']).next().unwrap_or(what);
        self.0.lock().unwrap().push(name.to_string());
    }

    fn advance(&self, _: u64) {}
}

/// A scene with a guessed light is built before and after the guess, but its files are read once.
#[test]
fn guessed_light_reads_files_once() {
    let folder = scene();
    let at = |name: &str| folder.path().join(name);
    write_png(&at("t.png"), 2, &[[200, 90, 30], [30, 90, 200], [0; 3], [255; 3]]);
    let library = "newmtl a\nKd 1\nmap_Kd t.png\nnewmtl dim\nKd 0.5\nKe 0.001 0.001 0.001\nd 0.5\n";
    std::fs::write(at("a.mtl"), library).unwrap();
    let obj = std::fs::read_to_string(at("a.obj")).unwrap();
    std::fs::write(at("a.obj"), obj + "usemtl dim\nf 1 4 5\n").unwrap();
    let load = |name: &str, guesses: bool| {
        let file = SceneFile::load(at(name)).unwrap();
        let mut settings = Settings::of(&file);
        settings.resolution = UVec2::splat(16);
        settings.guesses.light = guesses;
        settings.guesses.ground = guesses;
        let work = Work::default();
        let session = Session::load(&file, settings, &work).unwrap();
        let mut work = work.0.into_inner().unwrap();
        work.retain(|step| *step != "finding camera and light");
        (session, work)
    };
    std::fs::write(at("dark.toml"), "version = 1\n[[object]]\nobj = \"a.obj\"\n").unwrap();
    let (lit, work) = load("dark.toml", true);
    assert!(lit.light_guess().unwrap().starts_with("a studio"));
    let once = ["a.obj", "reading textures", "building the scene", "building the scene"];
    assert_eq!(work, once);
    // The scene equals the scene loaded from its written scene file.
    let text = lit.lit_file().unwrap().to_toml(&at("lit.toml")).unwrap();
    std::fs::write(at("lit.toml"), text).unwrap();
    let (again, work) = load("lit.toml", false);
    assert_eq!(work, once[..3]);
    assert_eq!(lit.scene().lights().len(), again.scene().lights().len());
    let names = |session: &Session| -> Vec<String> {
        let textures = session.scene().textures().len();
        let materials = session.scene().materials().iter().map(|m| m.name.clone());
        let objects = session.scene().objects().iter().cloned();
        materials.chain(objects).chain([textures.to_string()]).collect()
    };
    assert_eq!(names(&lit), names(&again));
    let kinds = |session: &Session| session.warnings().iter().map(|w| w.kind).collect::<Vec<_>>();
    assert_eq!(kinds(&lit), kinds(&again));
}

#[test]
fn library_gives_the_bits_of_the_program() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    done(
        folder.path(),
        &split("render s.toml -q -o program.exr --stats program.json"),
    );

    let session = session(&path("s.toml"), |_| {}).unwrap();
    assert_eq!(session.scene_hash(), read_json(&path("program.json"))["scene_hash"]);
    let renderer = session.renderer().unwrap();
    let mut state = renderer.start();
    assert_eq!(renderer.render(&mut state, &()), Outcome::Complete);
    let outputs = [(
        Format::Exr(ExrFormat::default()),
        Output::prepare(path("library.exr")).unwrap(),
    )];
    let failures = renderer.write(
        &state,
        &renderer.develop(&state),
        &outputs,
        &renderer.metadata(&state, true),
    );
    assert!(failures.is_empty(), "{failures:?}");
    assert_same_bits(&path("program.exr"), &path("library.exr"));
}

/// An integrator for ambient occlusion, written as in a program that uses the library.
struct Openness;

impl SampleTracer for Openness {
    fn sample<S: Sampler>(&self, world: &World<&dyn Accel>, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let slot = BsdfSlot::new();
        let Some(vertex) = world.first_vertex(key, sampler, &slot, out) else {
            return;
        };
        let mut wi = cosine_hemisphere(sampler.get_2d(Dimension::bounce(0, Bounce::Direction)));
        wi.z = wi.z.copysign(vertex.wo.z);
        let open = world.transmittance(&world.ray_along(&vertex, wi), out).color();
        out.radiance(open);
    }
}

/// An integrator of another crate gives results that are bit-identical to the results of the same
/// integrator in this crate: image, channels and variance.
#[test]
fn external_integrator_has_the_same_bits() {
    let folder = scene();
    let session = session(&folder.path().join("s.toml"), |settings| {
        settings.integrator.integrator = Some(IntegratorKind::AmbientOcclusion);
        settings.integrator.ao_distance = Some(1e6);
    });
    let session = session.unwrap();
    let renderer = session.renderer().unwrap();
    let (mut own, mut brought) = (renderer.start(), renderer.start());
    assert_eq!(renderer.render(&mut own, &()), Outcome::Complete);
    // The bits are also the same if the render is stopped and resumed
    let patience = StopAfter(AtomicU64::new(20_000));
    assert_eq!(
        renderer.render_with(&mut brought, &Openness, &patience),
        Outcome::Stopped
    );
    assert_eq!(renderer.render_with(&mut brought, &Openness, &()), Outcome::Complete);
    let picture = renderer.develop(&brought);
    assert_eq!(renderer.develop(&own), picture);
    assert_eq!(own.statistics.samples, brought.statistics.samples);
    let open = &picture.channels[0].values;
    assert!(
        open.iter().any(|&v| v > 0.0) && open.iter().any(|&v| v < 0.99),
        "{open:?}"
    );
}

/// A render that is stopped, written to a checkpoint and resumed many times is bit-identical to an
/// uninterrupted render
#[test]
fn stopped_render_resumes_to_the_same_bits() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    let session = session(&path("s.toml"), |settings| settings.threads = 2).unwrap();
    let renderer = session.renderer().unwrap();
    let (mut whole, mut state) = (renderer.start(), renderer.start());
    renderer.render(&mut whole, &());
    let mut stops = 0;
    let checkpoint = Output::prepare(path("c.exr")).unwrap();
    while renderer.render(&mut state, &StopAfter(AtomicU64::new(2000))) == Outcome::Stopped {
        stops += 1;
        state.keep(&checkpoint, &renderer.metadata(&state, false)).unwrap();
        state = renderer.resume(read_checkpoint(path("c.exr")).unwrap()).unwrap();
    }
    assert!(stops > 3, "{stops}");
    let sums = |film: &Film| film.pixels().map(|(_, sums)| sums).collect::<Vec<_>>();
    assert_eq!(sums(&whole.film), sums(&state.film));
    assert_eq!(state.statistics.samples, 128 * 24 * 16);

    // The program can also resume the checkpoint. A render with another seed cannot.
    let usual = split("render s.toml -q --checkpoint c.exr --resume -o program.exr");
    done(folder.path(), &joined(&usual, &[]));
    done(folder.path(), &split("render s.toml -q -o one.exr"));
    assert_same_bits(&path("program.exr"), &path("one.exr"));
    let other = self::session(&path("s.toml"), |settings| settings.seed = 8).unwrap();
    let refused = other
        .renderer()
        .unwrap()
        .resume(read_checkpoint(path("c.exr")).unwrap());
    let error = refused.unwrap_err().to_string();
    assert!(error.contains("c.exr") && error.contains("seed 7 and 8"), "{error}");
}

#[test]
fn invalid_settings_are_errors_before_rendering() {
    let folder = scene();
    let refused = |change: fn(&mut Settings), words: &[&str]| {
        let error = session(&folder.path().join("s.toml"), change)
            .err()
            .expect("settings that cannot be")
            .to_string();
        assert!(
            words.iter().all(|word| error.contains(word)) && error.contains("help:"),
            "{error}"
        );
    };
    refused(|s| s.spp = 0, &["spp 0"]);
    refused(|s| s.resolution.y = 0, &["size 24x0"]);
    refused(|s| s.part = Some(64..64), &["samples 64..64"]);
    refused(|s| s.noise = Some(f64::NAN), &["noise NaN"]);
    refused(
        |s| s.tone.exposure = embrasure::color::Exposure::Stops(f32::NAN),
        &["exposure NaN"],
    );
    refused(|s| s.integrator.branching = Some(0), &["branching 0"]);
    refused(|s| s.camera.vertical_fov = Some(200.0), &["vertical_fov"]);
    refused(|s| s.aovs = vec![Aov::Lights], &["lights", "[[light_group]]"]);
    let blind = |s: &mut Settings| {
        (s.integrator.integrator, s.aovs) = (Some(IntegratorKind::AmbientOcclusion), vec![Aov::Lights])
    };
    refused(blind, &["ao gathers no light"]);
    if !Backend::ALL.contains(&Backend::Obvhs) {
        refused(
            |s| s.backend = Backend::Obvhs,
            &["backend obvhs is not built in", "brute"],
        );
    }
}

/// A scene made in code shows the radiance of an unoccluded sky
#[test]
fn scenes_need_no_file() {
    let mut builder = SceneBuilder::new();
    builder.add_constant_light(Spectrum::rgb(0.5, 1.0, 2.0)).unwrap();
    let (scene, _) = builder.build().unwrap();
    let camera = CameraParameters {
        position: Vec3::ZERO,
        look_at: Vec3::Z,
        up: Vec3::Y,
        vertical_fov: 40.0,
        lens_radius: 0.0,
        focus_distance: 1.0,
    };
    let mut settings = Settings::default();
    settings.resolution = UVec2::new(5, 3);
    settings.spp = 4;
    let session = Session::new(scene, camera, settings).unwrap();
    let renderer = session.renderer().unwrap();
    let mut state = renderer.start();
    renderer.render(&mut state, &());
    let image = renderer.develop(&state);
    for (channel, radiance) in [("R", 0.5), ("G", 1.0), ("B", 2.0)] {
        assert!(image.channel(channel).unwrap().values.iter().all(|v| *v == radiance));
    }
}

/// A render stopped before its first sample has no image to write.
#[test]
fn render_without_samples_writes_no_image() {
    let folder = scene();
    let path = folder.path().join("keep.png");
    std::fs::write(&path, "good").unwrap();
    let session = session(&folder.path().join("s.toml"), |settings| {
        settings.integrator.integrator = Some(IntegratorKind::Bidirectional);
    })
    .unwrap();
    let renderer = session.renderer().unwrap();
    let mut state = renderer.start();
    assert_eq!(
        renderer.render(&mut state, &StopAfter(AtomicU64::new(0))),
        Outcome::Stopped
    );
    assert!(state.is_empty());
    let outputs = [(Format::of_path(&path).unwrap(), Output::prepare(&path).unwrap())];
    let write = |state: &embrasure::RenderState| {
        renderer.write(
            state,
            &renderer.develop(state),
            &outputs,
            &renderer.metadata(state, false),
        )
    };
    let failures = write(&state);
    assert!(
        failures.len() == 1 && failures[0].to_string().contains("no sample"),
        "{failures:?}"
    );
    assert_eq!(std::fs::read(&path).unwrap(), b"good");
    renderer.render(&mut state, &());
    assert!(!state.is_empty() && write(&state).is_empty());
}

/// Another build may compute other bits, so sums of samples that another build wrote are neither
/// resumed nor merged.
#[test]
fn sums_of_another_build_are_refused() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    let session = session(&path("s.toml"), |_| {}).unwrap();
    let renderer = session.renderer().unwrap();
    let mut state = renderer.start();
    renderer.render(&mut state, &());
    let keep = |name: &str, build: &str| {
        let mut metadata = renderer.metadata(&state, true);
        assert_eq!(metadata.build, embrasure::BUILD);
        metadata.build = build.into();
        state.keep(&Output::prepare(path(name)).unwrap(), &metadata).unwrap();
    };
    keep("own.exr", embrasure::BUILD);
    keep("other.exr", "0123456789ab");
    keep("unknown.exr", "");
    renderer.resume(read_checkpoint(path("own.exr")).unwrap()).unwrap();
    let error = renderer
        .resume(read_checkpoint(path("other.exr")).unwrap())
        .unwrap_err()
        .to_string();
    for word in ["other.exr", "build 0123456789ab", embrasure::BUILD, "help:"] {
        assert!(error.contains(word), "{error}");
    }
    let error = read_checkpoint(path("unknown.exr")).unwrap_err().to_string();
    assert!(
        error.contains("does not name the build") && error.contains("help:"),
        "{error}"
    );
    let error = PictureParts::describe(&[path("own.exr"), path("other.exr")])
        .unwrap_err()
        .to_string();
    assert!(error.contains("build") && error.contains("0123456789ab"), "{error}");
}
