//! Helpers that start the real program and read the files that it writes.

use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;
#[cfg(target_os = "linux")]
use std::time::Instant;
use tempfile::TempDir;

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_embrasure");

/// Names of all integrators on the command line.
pub const INTEGRATORS: &[&str] = &[
    "path",
    "naive",
    "one-sample",
    "area",
    "whitted",
    "distributed",
    "direct",
    "ao",
    "debug",
    "light",
    "bdpt",
    "pssmlt",
    "mlt",
    "sppm",
    "photon-map",
    "vcm",
    "irradiance-cache",
];

/// Default channels of an EXR image.
pub const CHANNELS: [&str; 15] = [
    "R",
    "G",
    "B",
    "albedo.R",
    "albedo.G",
    "albedo.B",
    "N.X",
    "N.Y",
    "N.Z",
    "Z",
    "emitted",
    "variance.R",
    "variance.G",
    "variance.B",
    "samples",
];

/// Temporary folder with `files`. Dropping the value deletes it. It is in a folder that only tests
/// use, because the program also searches the parent folder for missing files.
pub fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Temporary folder with a small scene: a lit floor in `s.toml`, `a.obj`, `a.mtl`.
pub fn lit_floor() -> TempDir {
    folder(&[
        (
            "a.mtl",
            "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\nv 1 1 -1\n\
             usemtl floor\nf 1 2 3 4\nusemtl lamp\nf 4 3 6 5\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.3, 0]\n\
             [image]\nwidth = 40\nheight = 24\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

/// Command that runs the program in `folder` without input, with its output captured.
pub fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).args(args);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Splits arguments at spaces.
pub fn split(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// Concatenates two lists of arguments.
pub fn joined<'a>(some: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [some, more].concat()
}

/// Runs the program and waits for its end.
pub fn run(folder: &Path, args: &[&str]) -> Output {
    command(folder, args).output().unwrap()
}

/// Runs the program and asserts that it succeeds.
pub fn done(folder: &Path, args: &[&str]) -> Output {
    let out = run(folder, args);
    assert_eq!(code(&out), 0, "{args:?}: {}", words(&out));
    out
}

/// Runs with a time limit in seconds, which may end the render before the first sample. Asserts
/// that no other error occurs.
pub fn limited(folder: &Path, args: &[&str], limit: f64) -> Output {
    let limit = format!("{limit}s");
    let args = joined(args, &["--time-limit", &limit]);
    let out = run(folder, &args);
    let is_early = code(&out) == 1 && words(&out).contains("before the first sample");
    assert!(is_early || code(&out) == 0, "{args:?}: {}", words(&out));
    out
}

/// Runs the program, asserts that the exit code is `expected`, and returns its messages.
pub fn refused(folder: &Path, args: &[&str], expected: i32) -> String {
    let out = run(folder, args);
    assert_eq!(code(&out), expected, "{args:?}: {}", words(&out));
    words(&out)
}

/// Exit code of a program that has ended.
pub fn code(output: &Output) -> i32 {
    output.status.code().expect("the program was killed")
}

/// Standard error: errors, warnings and progress.
pub fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Standard output.
pub fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Standard output, parsed as JSON.
pub fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", words(output)))
}

/// Parsed JSON file, for example of `--stats`.
pub fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Sends a signal to a process with the `kill` of the shell; not every machine has a `kill`
/// program.
pub fn signal(child: &Child, name: &str) {
    let kill = format!("kill -{name} {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
}

/// Waits until `child` has used the processor time `work`. A child that has used this time is at
/// work, even on a loaded machine.
#[cfg(target_os = "linux")]
pub fn wait_for_work(child: &Child, work: Duration) {
    let start = Instant::now();
    while processor_time(child) < work {
        assert!(start.elapsed() < Duration::from_secs(120), "no work is done");
        thread::sleep(Duration::from_millis(5));
    }
}

/// Waits for one second. By then the program is usually at work.
#[cfg(not(target_os = "linux"))]
pub fn wait_for_work(_: &Child, _: Duration) {
    thread::sleep(Duration::from_secs(1));
}

/// Processor time of `child` since its start; `Duration::MAX` if it has ended.
#[cfg(target_os = "linux")]
fn processor_time(child: &Child) -> Duration {
    /// Ticks per second (`man 5 proc`).
    const TICKS: u64 = 100;
    let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap();
    // The name is in parentheses and may contain blanks. The state is the first field behind the
    // name.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    if fields[0] == "Z" {
        return Duration::MAX;
    }
    let ticks: u64 = fields[11..13].iter().map(|field| field.parse::<u64>().unwrap()).sum();
    Duration::from_millis(1000 * ticks / TICKS)
}

/// Writes a greyscale PNG of one row.
pub fn write_grey_png(path: &Path, codes: &[u8]) {
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), codes.len() as u32, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(codes).unwrap();
}

/// Channel of an EXR file: position and size of its window, and bits of its pixels, row by row.
#[derive(PartialEq, Eq)]
struct Channel {
    min: [i32; 2],
    size: [usize; 2],
    bits: Vec<u32>,
}

/// All channels of an EXR file, by layer and name.
fn channels(path: &Path) -> BTreeMap<(usize, String), Channel> {
    let image = read_all_flat_layers_from_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut channels = BTreeMap::new();
    for (i, layer) in image.layer_data.into_iter().enumerate() {
        let (min, size) = (layer.attributes.layer_position, layer.size);
        for channel in layer.channel_data.list {
            let bits = match channel.sample_data {
                FlatSamples::F32(values) => values.into_iter().map(f32::to_bits).collect(),
                FlatSamples::F16(values) => values.into_iter().map(|v| v.to_bits().into()).collect(),
                FlatSamples::U32(values) => values,
            };
            let (min, size) = ([min.x(), min.y()], [size.x(), size.y()]);
            channels.insert((i, channel.name.to_string()), Channel { min, size, bits });
        }
    }
    channels
}

/// Asserts that two EXR files have the same channels with identical bits.
pub fn assert_same_bits(one: &Path, other: &Path) {
    let [a, b] = [one, other].map(channels);
    let what = format!("{} and {}", one.display(), other.display());
    assert!(a.keys().eq(b.keys()), "{what}: {:?} and {:?}", a.keys(), b.keys());
    for ((name, a), b) in a.iter().zip(b.values()) {
        assert_eq!((a.min, a.size), (b.min, b.size), "{what}: {name:?}");
        let Some(i) = a.bits.iter().zip(&b.bits).position(|(a, b)| a != b) else {
            continue;
        };
        let (x, y) = (i % a.size[0], i / a.size[0]);
        panic!(
            "{what}: {name:?} differs first at column {x}, row {y}: bits {:#x} and {:#x}",
            a.bits[i], b.bits[i]
        );
    }
}
