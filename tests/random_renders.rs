//! Renders of random combinations of scenes, materials, flags and integrators, with the real
//! program.
//!
//! Run k makes a small scene from the number k, and renders it. The render must end with a
//! documented exit code and without a panic. No image may contain NaN or infinity. Negative light
//! is allowed only with a filter with negative lobes, a debug view, or a shadow-catching ground.
//! `EMBRASURE_RANDOM_RENDERS=A..B` selects other runs (`make random-renders`). A single run is
//! `A..A+1`. `EMBRASURE_KEEP=DIR` keeps the files of failed runs. `EMBRASURE_PROGRAM=FILE` tests
//! another build.

mod support;

use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use std::fmt::Write;
use std::fs::{self, File};
use std::ops::Range;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use support::program::{INTEGRATORS, PROGRAM, read_json, refused, write_grey_png};

/// Range of runs in `make test`.
const USUAL: Range<u64> = 0..if cfg!(long) { 100 } else { 30 };
/// Time after which a run counts as hanging. Each run renders for at most `LIMIT`; a busy machine
/// needs more time for the rest.
const PATIENCE: Duration = Duration::from_secs(90);
const LIMIT: &str = "3s";

/// Random choices, by SplitMix64 (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    fn pick<'a, T: ?Sized>(&mut self, items: &[&'a T]) -> &'a T {
        items[self.below(items.len())]
    }

    /// Uniform number in [0, 1).
    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform number in [-1, 1).
    fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    fn point(&mut self, scale: f64) -> [f64; 3] {
        [(); 3].map(|()| scale * self.signed())
    }

    /// A reflectance, sometimes 0 or 1.
    fn colour(&mut self) -> String {
        let value = match self.below(8) {
            0 => [0.0; 3],
            1 => [1.0; 3],
            _ => [(); 3].map(|()| self.unit()),
        };
        value.map(|x| format!("{x:.4}")).join(" ")
    }
}

const MATERIALS: usize = 5;

/// Backends of this build; brute force only if there is no other.
fn backends() -> &'static [&'static str] {
    match (cfg!(feature = "embree"), cfg!(feature = "obvhs")) {
        (true, true) => &["embree", "obvhs"],
        (true, false) => &["embree"],
        (false, true) => &["obvhs"],
        (false, false) => &["brute"],
    }
}

/// Materials as exporters write them, and unusual materials.
fn library(random: &mut Random) -> String {
    let mut text = String::new();
    for i in 0..MATERIALS {
        let _ = writeln!(text, "newmtl m{i}\nKd {}", random.colour());
        let mut maybe = |chance: usize, line: &dyn Fn(&mut Random) -> String| {
            if random.one_in(chance) {
                let line = line(random);
                let _ = writeln!(text, "{line}");
            }
        };
        maybe(2, &|r| format!("Ks {}", r.colour()));
        maybe(2, &|r| format!("Ns {:.3}", 10f64.powf(5.0 * r.unit() - 1.0)));
        maybe(3, &|r| format!("illum {}", r.below(11)));
        maybe(4, &|r| format!("d {:.3}", r.pick(&[&0.0, &0.3, &0.999, &1.0])));
        maybe(6, &|r| format!("Tr {:.3}", r.unit()));
        maybe(4, &|r| format!("Tf {}", r.colour()));
        maybe(4, &|r| format!("Ni {:.3}", r.pick(&[&1.0, &1.0001, &1.5, &2.4, &0.7])));
        maybe(5, &|r| {
            format!("Ke {:.3} {:.3} {:.3}", 20.0 * r.unit(), 5.0 * r.unit(), r.unit())
        });
        maybe(5, &|r| format!("Pr {:.3}\nPm {}", r.unit(), r.below(2)));
        maybe(7, &|r| format!("Pc {:.3}\nPcr {:.3}", r.unit(), r.unit()));
        maybe(8, &|r| format!("Ps {:.3}", r.unit()));
        maybe(8, &|r| format!("aniso {:.3}\nanisor {:.3}", r.unit(), r.unit()));
        maybe(3, &|r| format!("map_Kd {}", r.pick(&["a.png", "b.png", "missing.png"])));
        maybe(4, &|r| format!("map_d {}", r.pick(&["a.png", "b.png"])));
        maybe(5, &|_| "map_Bump -bm 2 a.png".into());
        maybe(7, &|_| "norm b.png".into());
        maybe(9, &|_| "map_Ke a.png".into());
        maybe(9, &|_| "map_Pr b.png".into());
    }
    text
}

/// Triangles of size `scale`: random triangles, cards around the crown of a tree with normals that
/// point away from the crown, a closed box seen from inside, needles and slivers, or panels behind
/// each other.
fn mesh(random: &mut Random, scale: f64) -> String {
    let mut text = String::from("mtllib s.mtl\n");
    let mut vertices = 0;
    let has_normals = random.one_in(2);
    let is_outward = random.one_in(2);
    let normals_like = random.unit();
    let mut triangle = |text: &mut String, corners: [[f64; 3]; 3], random: &mut Random| {
        for corner in corners {
            let _ = writeln!(text, "v {} {} {}", corner[0], corner[1], corner[2]);
            let _ = writeln!(text, "vt {:.3} {:.3}", 2.0 * random.unit(), random.unit());
            let normal = match is_outward {
                true => corner.map(|x| x / scale + 0.01 * normals_like),
                false => random.point(1.0),
            };
            let _ = writeln!(text, "vn {:.5} {:.5} {:.5}", normal[0], normal[1], normal[2]);
        }
        let ids = [1, 2, 3].map(|k| vertices + k);
        vertices += 3;
        let ids = ids.map(|i| {
            if has_normals {
                format!("{i}/{i}/{i}")
            } else {
                format!("{i}/{i}")
            }
        });
        let _ = writeln!(text, "f {}", ids.join(" "));
    };
    for _ in 0..1 + random.below(3) {
        let _ = writeln!(text, "o part{}", random.below(3));
        let kind = random.below(5);
        let count = 1 + random.below(40);
        for i in 0..count {
            if i == 0 || random.one_in(4) {
                let _ = writeln!(text, "usemtl m{}", random.below(MATERIALS));
            }
            let center = random.point(0.7 * scale);
            let z = scale * (i as f64 / count as f64 - 0.5);
            let corners = match kind {
                0 => [(); 3].map(|()| random.point(scale)),
                1 => [(); 3].map(|()| {
                    let offset = random.point(0.25 * scale);
                    [0, 1, 2].map(|k| center[k] + offset[k])
                }),
                2 => [(); 3].map(|()| [0, 1, 2].map(|k| center[k] + 1e-6 * k as f64 * scale * random.signed())),
                3 => [[-scale, -scale, z], [2.0 * scale, -scale, z], [-scale, 2.0 * scale, z]],
                _ => {
                    // Make one of the twelve triangles of a box
                    let (axis, side, half) = ((i / 4) % 3, (i / 2) % 2, i % 2);
                    let at = |u: f64, v: f64| {
                        let mut p = [0.0; 3];
                        p[axis] = if side == 0 { -1.2 * scale } else { 1.2 * scale };
                        (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (1.2 * scale * u, 1.2 * scale * v);
                        p
                    };
                    match half {
                        0 => [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0)],
                        _ => [at(-1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
                    }
                }
            };
            triangle(&mut text, corners, random);
        }
    }
    text
}

/// A scene file for the mesh: camera, copies, motion, lights.
fn scene(random: &mut Random, scale: f64) -> String {
    let mut text = String::from("version = 1\n");
    if !random.one_in(4) {
        let [x, y, z] = random.point(3.0 * scale);
        let _ = writeln!(
            text,
            "[camera]\nposition = [{x:?}, {y:?}, {z:?}]\nlook_at = [0.0, 0.0, 0.0]"
        );
        let _ = writeln!(text, "vertical_fov = {:.2}", 10.0 + 100.0 * random.unit());
        if random.one_in(4) {
            let _ = writeln!(
                text,
                "lens_radius = {:?}\nfocus_distance = {:?}",
                0.1 * scale,
                2.0 * scale
            );
        }
        if random.one_in(6) {
            let _ = writeln!(text, "position_close = [{:?}, {y:?}, {z:?}]", x + 0.2 * scale);
        }
    }
    let _ = writeln!(text, "[[object]]\nobj = \"s.obj\"");
    if random.one_in(4) {
        let shift = scale * random.signed();
        let _ = writeln!(
            text,
            "instances = [[[1.0, 0.0, 0.0, {shift:?}], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]], \
             [[0.5, 0.0, 0.0, 0.0], [0.0, 0.0, -0.5, 0.0], [0.0, 0.5, 0.0, {shift:?}], [0.0, 0.0, 0.0, 1.0]]]"
        );
    } else if random.one_in(4) {
        let _ = writeln!(
            text,
            "transform = {{ rotate = [{:.1}, 20.0, 0.0], scale = 1.5 }}",
            90.0 * random.unit()
        );
    }
    for _ in 0..random.below(3) {
        let [x, y, z] = random.point(2.0 * scale);
        let power = scale * scale * 5.0;
        let light = match random.below(4) {
            0 => format!(
                "type = \"point\"\nposition = [{x:?}, {y:?}, {z:?}]\nintensity = [{power:?}, {power:?}, {power:?}]"
            ),
            1 => "type = \"directional\"\ndirection = [0.2, -1.0, 0.1]\nirradiance = [2.0, 2.0, 1.0]".into(),
            2 => format!(
                "type = \"spot\"\nposition = [{x:?}, {y:?}, {z:?}]\nlook_at = [0.0, 0.0, 0.0]\nangle = 30.0\nintensity = [{power:?}, {power:?}, {power:?}]"
            ),
            _ => "type = \"constant\"\nradiance = [0.5, 0.7, 1.0]".into(),
        };
        let _ = writeln!(text, "[[light]]\n{light}");
    }
    text
}

/// Random arguments of `render`.
fn flags(random: &mut Random) -> Vec<String> {
    let mut flags = vec![];
    let mut flag = |name: &str, value: String| flags.push(format!("--{name}={value}"));
    flag("size", format!("{}x{}", 1 + random.below(20), 1 + random.below(20)));
    flag("spp", (1 + random.below(8)).to_string());
    flag("time-limit", LIMIT.into());
    flag("seed", random.bits().to_string());
    flag("threads", (1 + random.below(3)).to_string());
    flag("integrator", random.pick(INTEGRATORS).into());
    flag("backend", random.pick(backends()).into());
    let choices: &[(&str, &[&str])] = &[
        ("max-depth", &["0", "1", "2", "5", "16", "none", "1000"]),
        ("roulette-depth", &["0", "1", "3", "100"]),
        (
            "sampler",
            &[
                "sobol",
                "zsobol",
                "halton",
                "hammersley",
                "cmj",
                "orthogonal",
                "stratified",
                "antithetic",
                "independent",
            ],
        ),
        (
            "directions",
            &[
                "bsdf",
                "cosine",
                "uniform",
                "perturbed-qmc",
                "perturbed-qmc-uniform",
                "fibonacci",
            ],
        ),
        ("direction-points", &["halton", "hammersley", "sobol"]),
        ("direction-perturbation", &["0", "1", "16"]),
        ("direction-scrambling", &["on", "off"]),
        (
            "roulette",
            &[
                "throughput",
                "luminance",
                "constant:0.5",
                "constant:0.9",
                "threshold:0.1",
            ],
        ),
        ("emission-coin", &["emitters", "every-hit"]),
        ("emission-probability", &["0.01", "0.5", "0.99"]),
        ("absorption", &["weight", "chance"]),
        ("direct-probability", &["0.01", "0.5", "0.99"]),
        ("direct", &["mis", "light", "none"]),
        ("mis", &["power", "balance"]),
        ("light-selection", &["place", "power", "auto", "uniform", "all"]),
        ("triangle-sampling", &["area", "solid-angle"]),
        ("reuse", &["pixels", "none"]),
        ("light-samples", &["1", "3", "16"]),
        ("branching", &["1", "4", "8"]),
        ("photons", &["1", "100", "10000"]),
        ("photon-radius", &["0.001", "0.1", "10"]),
        ("photon-count", &["2", "16", "1000"]),
        ("gather-rays", &["1", "4"]),
        ("cache-error", &["0.05", "0.3", "1"]),
        ("cache-rays", &["16", "256"]),
        ("metropolis-direct", &["ordinary", "metropolis"]),
        ("metropolis-target", &["relative", "luminance"]),
        ("chains", &["1", "4", "1000"]),
        ("bootstrap", &["1", "64", "5000"]),
        ("filter", &["box", "tent", "gaussian", "mitchell", "blackman-harris"]),
        ("texture-filter", &["mip", "bilinear"]),
        (
            "mtl-dialect",
            &[
                "auto",
                "spec",
                "blender",
                "max",
                "maya",
                "sketchup",
                "cinema4d",
                "meshlab",
                "rhino",
                "wings3d",
                "3dfier",
                "assimp",
                "highlight",
            ],
        ),
        ("smooth", &["1", "30", "180"]),
        (
            "aov",
            &["P", "uv,motion", "id", "cryptomatte", "lights", "all", "strategies"],
        ),
        ("compression", &["zip", "zips", "piz", "rle", "none"]),
        ("half", &["all", "picture"]),
        ("tone", &["srgb", "reinhard", "aces-narkowicz", "aces-hill", "agx"]),
        ("exposure", &["-10", "3.5"]),
        ("crop", &["0,0,1,1", "0,0,4,3", "2,1,9,9"]),
        ("denoise", &["atrous", "gaussian"]),
        ("shutter", &["0,0", "0.2,0.7"]),
        ("fov", &["1", "170"]),
        ("view", &["auto", "front", "top", "iso", "inside"]),
        ("up", &["0,0,1", "0,1,0"]),
        ("audit-rays", &["0.1"]),
        ("max-memory", &["1M", "4G"]),
        ("write-every", &["0.01s"]),
        ("ao-distance", &["0.1", "1000"]),
        ("debug-view", &["normals", "uv", "ids"]),
    ];
    for (name, values) in choices {
        if random.one_in(8) {
            flag(name, random.pick(values).into());
        }
    }
    if random.one_in(12) {
        flags.retain(|flag| !flag.starts_with("--spp="));
        flags.extend(["--noise=0.3".into(), "--spp=256".into()]);
    }
    for name in ["compact", "verbose"] {
        if random.one_in(12) {
            flags.push(format!("--{name}"));
        }
    }
    if random.one_in(6) {
        flags.extend([
            "--checkpoint=k.exr".into(),
            "--resume".into(),
            "--checkpoint-interval=0.01s".into(),
        ]);
    }
    flags
}

/// Renders the combination `k`. Returns the exit code, or a text about the fault.
fn fault(k: u64, folder: &Path) -> Result<i32, String> {
    let random = &mut Random(k);
    let scale = 10f64.powi([0, 0, 0, -3, 3, 6, -6][random.below(7)]);
    fs::write(folder.join("s.mtl"), library(random)).unwrap();
    fs::write(folder.join("s.obj"), mesh(random, scale)).unwrap();
    fs::write(folder.join("s.toml"), scene(random, scale)).unwrap();
    write_grey_png(&folder.join("a.png"), &[0, 255, 120, 0]);
    write_grey_png(&folder.join("b.png"), &[255, 0]);
    let name = if random.one_in(5) { "s.obj" } else { "s.toml" };
    let mut args = vec!["render".to_string(), name.into(), "-o".into(), "x.exr".into()];
    args.extend(["-o".into(), "x.png".into(), "--stats=x.json".into()]);
    args.extend(flags(random));
    fs::write(folder.join("command"), args.join(" ")).unwrap();

    outcome(folder, &args.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Runs the program. Returns the exit code, or a text about a wrong exit code or a fault of the
/// image `x.exr`.
fn outcome(folder: &Path, args: &[&str]) -> Result<i32, String> {
    // Write output to files, because a full pipe would hang the test.
    let program = std::env::var_os("EMBRASURE_PROGRAM").unwrap_or_else(|| PROGRAM.into());
    let mut command = Command::new(program);
    command.current_dir(folder).args(args).stdin(Stdio::null());
    let file = |name| File::create(folder.join(name)).unwrap();
    let mut child = command.stdout(file("stdout")).stderr(file("stderr")).spawn().unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            return Err(format!("still running after {PATIENCE:?}"));
        }
        thread::sleep(Duration::from_millis(5));
    };
    let words = fs::read_to_string(folder.join("stderr")).unwrap_or_else(|e| e.to_string());
    if words.contains("panicked") {
        return Err(format!("panic: {words}"));
    }
    match status.code() {
        Some(0) => {
            let path = folder.join("x.exr");
            let unsound = unsound(&path).or_else(|| match explains_negative_light(args, &words) {
                true => None,
                false => negative(&path),
            });
            unsound.map_or(Ok(0), Err)
        }
        Some(code @ (1 | 2)) if words.contains("error: ") => Ok(code),
        other => Err(format!("exit {other:?}: {words}")),
    }
}

/// Text about the first NaN of an image, or about the first infinity in a channel that must be
/// finite.
fn unsound(path: &Path) -> Option<String> {
    let image = match read_all_flat_layers_from_file(path) {
        Ok(image) => image,
        Err(error) => return Some(format!("{}: {error}", path.display())),
    };
    for layer in image.layer_data {
        for channel in layer.channel_data.list {
            // These channels may be infinite: the depth of rays that miss, and variances and errors
            // if there are too few samples
            let name = channel.name.to_string();
            let may_be_infinite = name == "Z" || name == "error" || name.starts_with("variance.");
            let is_sound = |x: f32| x.is_finite() || (may_be_infinite && x == f32::INFINITY);
            let bad = match channel.sample_data {
                FlatSamples::F32(values) => values.into_iter().find(|x| !is_sound(*x)),
                FlatSamples::F16(values) => values.into_iter().map(f32::from).find(|x| !is_sound(*x)),
                FlatSamples::U32(_) => None,
            };
            if let Some(bad) = bad {
                return Some(format!("channel {} holds {bad}", channel.name));
            }
        }
    }
    None
}

/// Returns true if negative light is documented for this command: with the Mitchell filter, with a
/// debug view, or with a ground, which `words` of the program mention.
fn explains_negative_light(args: &[&str], words: &str) -> bool {
    let by_flag = |arg: &&str| *arg == "--filter=mitchell" || arg.starts_with("--debug-view");
    args.iter().any(by_flag) || words.contains("catches shadows")
}

/// Text about the first negative value in a channel of light, if there is one.
fn negative(path: &Path) -> Option<String> {
    let image = read_all_flat_layers_from_file(path).ok()?;
    let mut channels = image.layer_data.into_iter().flat_map(|layer| layer.channel_data.list);
    channels.find_map(|channel| {
        let is_light = ["R", "G", "B"].iter().any(|name| channel.name.eq(name));
        let mut values = channel.sample_data.values_as_f32().filter(|_| is_light);
        let bad = values.find(|x| *x < 0.0)?;
        Some(format!("channel {} holds {bad}", channel.name))
    })
}

/// Parses a range of runs `A..B`.
fn range(text: &str) -> Option<Range<u64>> {
    let (start, end) = text.split_once("..")?;
    Some(start.parse().ok()?..end.parse().ok()?)
}

#[test]
fn random_renders_end_with_a_documented_code() {
    let runs = match std::env::var("EMBRASURE_RANDOM_RENDERS") {
        Ok(text) => range(&text).expect("EMBRASURE_RANDOM_RENDERS: A..B"),
        Err(_) => USUAL,
    };
    let (next, rendered) = (AtomicU64::new(runs.start), AtomicU64::new(0));
    let workers = thread::available_parallelism().map_or(2, usize::from);
    let work = || {
        let mut faults = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= runs.end {
                return faults;
            }
            let folder = tempfile::tempdir().unwrap();
            let outcome = fault(k, folder.path());
            rendered.fetch_add(u64::from(outcome == Ok(0)), Ordering::Relaxed);
            if let Err(what) = outcome {
                let arguments = fs::read_to_string(folder.path().join("command")).unwrap_or_default();
                let fault = format!("run {k}: {what}\n  embrasure {arguments}");
                eprintln!("{fault}");
                faults.push(fault);
                if let Some(kept) = std::env::var_os("EMBRASURE_KEEP") {
                    let to = Path::new(&kept).join(k.to_string());
                    fs::create_dir_all(&to).unwrap();
                    for entry in fs::read_dir(folder.path()).unwrap().flatten() {
                        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
                    }
                }
            }
        }
    };
    let faults: Vec<String> = thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    let (count, rendered) = (runs.end - runs.start, rendered.into_inner());
    assert!(
        faults.is_empty(),
        "{} of {count} runs:\n{}",
        faults.len(),
        faults.join("\n")
    );
    // Combinations that are refused test little, so most of the runs must render.
    println!("{rendered} of {count} runs rendered");
    assert!(
        count < 100 || 2 * rendered > count,
        "{rendered} of {count} runs rendered"
    );
}

/// Regression: cards with opacity maps and unrelated normals scattered rays to each other without
/// end, in every integrator.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn foliage_ends_by_every_integrator() {
    let faults = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults");
    let folder = tempfile::tempdir().unwrap();
    for backend in backends() {
        for integrator in INTEGRATORS {
            for scene in ["h.toml", "soup7.obj"] {
                let scene = faults.join(scene);
                let line = format!(
                    "--size 12x12 --spp 8 --backend {backend} --integrator {integrator} -q -o x.exr --stats x.json"
                );
                let args: Vec<&str> = ["render", scene.to_str().unwrap()]
                    .into_iter()
                    .chain(line.split(' '))
                    .collect();
                assert_eq!(outcome(folder.path(), &args), Ok(0), "{args:?}");
                assert_eq!(read_json(&folder.path().join("x.json"))["cut_walks"], 0, "{args:?}");
            }
        }
    }
}

/// Checks this test itself: an unknown command is a fault, and so is an image with a NaN.
#[test]
fn faults_of_images_are_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nan.exr");
    exr::prelude::write_rgb_file(&path, 2, 1, |x, _| {
        (if x == 0 { 1.0f32 } else { f32::NAN }, 0.0f32, 0.0f32)
    })
    .unwrap();
    assert!(unsound(&path).unwrap().contains("holds NaN"));
    assert!(unsound(&folder.path().join("absent.exr")).is_some());
    let path = folder.path().join("negative.exr");
    exr::prelude::write_rgb_file(&path, 2, 1, |x, _| {
        (1.0f32, if x == 0 { 0.0f32 } else { -1e-6 }, 0.0f32)
    })
    .unwrap();
    assert_eq!(unsound(&path), None);
    assert!(negative(&path).unwrap().starts_with("channel G holds -"));
    assert!(explains_negative_light(&["--filter=mitchell"], "") && !explains_negative_light(&["--filter=tent"], ""));
    refused(folder.path(), &["render", "absent.obj"], 1);
}
