//! Files and sizes that would hang the program, use all memory or lose data. Each is an error with
//! help.

use crate::support::program::{assert_same_bits, code, command, done, folder, printed, run, split, words};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Time after which a run counts as hanging: many times the usual time.
const PATIENCE: Duration = Duration::from_secs(60);

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

/// A folder with `a.obj`, a square whose texture `a.png` is missing, and `s.toml`, a scene of a
/// square without a texture.
fn scene() -> TempDir {
    folder(&[
        ("a.mtl", "newmtl wall\nKd 1 1 1\nmap_Kd a.png\n"),
        (
            "a.obj",
            &format!("mtllib a.mtl\n{QUAD}usemtl wall\nf 1/1 2/2 3/3 4/4\n"),
        ),
        ("plain.obj", &format!("{QUAD}f 1 2 3 4\n")),
        ("s.toml", "version = 1\n[[object]]\nobj = \"plain.obj\"\n"),
    ])
}

/// Runs the program, and kills it if it hangs.
fn run_soon(folder: &Path, args: &[&str]) -> Output {
    let mut child = command(folder, args).spawn().unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{args:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.wait_with_output().unwrap()
}

/// Runs the program, and asserts that it fails with all words of `expected`.
fn refused(folder: &Path, line: &str, expected: &[&str]) {
    let out = run_soon(folder, &split(line));
    let said = words(&out);
    assert_eq!(code(&out), 1, "{line}: {said}");
    for word in expected.iter().chain(&["help:"]) {
        assert!(said.contains(word), "{line}: no `{word}` in {said}");
    }
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused() {
    use std::os::unix::fs::symlink;
    let folder = scene();
    let at = folder.path();
    let object = "version = 1\n[[object]]\nobj = ";
    for (name, text) in [
        ("list.toml", format!("{object}\"plain.obj\"\ninstances = \"x.txt\"\n")),
        ("close.toml", format!("{object}\"plain.obj\"\nobj_close = \"x.obj\"\n")),
        (
            "sky.toml",
            format!("{object}\"plain.obj\"\n[[light]]\ntype = \"environment\"\nimage = \"x.hdr\"\n"),
        ),
        (
            "exr-sky.toml",
            format!("{object}\"plain.obj\"\n[[light]]\ntype = \"environment\"\nimage = \"x.exr\"\n"),
        ),
        ("library.obj", format!("mtllib x.mtl\n{QUAD}usemtl wall\nf 1 2 3\n")),
    ] {
        fs::write(at.join(name), text).unwrap();
    }
    let runs = [
        "render x.obj -o o.exr",
        "render x.toml -o o.exr",
        "render a.obj -o o.exr",
        "render library.obj -o o.exr",
        "render list.toml -o o.exr",
        "render close.toml -o o.exr",
        "render sky.toml -o o.exr",
        "render exr-sky.toml -o o.exr",
        "render s.toml --checkpoint x.exr --resume -o o.exr",
        "merge x.exr x.exr -o o.exr",
        "compare x.exr x.png",
        "compare x.png x.png",
        "check x.obj",
    ];
    let names = ["x.obj", "x.toml", "x.mtl", "x.txt", "x.hdr", "x.exr", "x.png", "a.png"];
    for is_pipe in [true, false] {
        for name in names {
            let path = at.join(name);
            _ = fs::remove_file(&path);
            match is_pipe {
                true => assert!(Command::new("mkfifo").arg(&path).status().unwrap().success()),
                false => symlink("/dev/zero", &path).unwrap(),
            }
        }
        for line in runs {
            let out = run_soon(at, &split(line));
            let said = words(&out) + &printed(&out);
            assert_eq!(code(&out), 1, "{line}: {said}");
            for word in ["regular file", "help:"] {
                assert!(said.contains(word), "{line}: no `{word}` in {said}");
            }
            assert!(!at.join("o.exr").exists(), "{line}");
        }
    }
}

#[test]
fn folders_and_empty_files_are_errors() {
    let folder = scene();
    let at = folder.path();
    for name in ["d.obj", "a.png", "sky.hdr"] {
        fs::create_dir(at.join(name)).unwrap();
    }
    for (name, text) in [
        ("empty.obj", ""),
        ("empty.toml", ""),
        ("empty.hdr", ""),
        ("empty.exr", ""),
        (
            "sky.toml",
            "version = 1\n[[object]]\nobj = \"plain.obj\"\n[[light]]\ntype = \"environment\"\nimage = \"sky.hdr\"\n",
        ),
    ] {
        fs::write(at.join(name), text).unwrap();
    }
    for (line, word) in [
        ("render d.obj -o o.exr", "a directory"),
        ("render sky.toml -o o.exr", "a directory"),
        ("render - -o o.exr", "standard input"),
        ("compare - empty.exr", "standard input"),
        ("render empty.obj -o o.exr", "no faces"),
        ("render empty.toml -o o.exr", "`version`"),
        ("compare empty.exr empty.exr", "is empty"),
        ("merge empty.exr empty.exr -o o.exr", "is empty"),
    ] {
        refused(at, line, &[word]);
    }
    let out = done(at, &split("render a.obj --spp 1 --size 8x8 -o o.exr"));
    assert!(
        words(&out).contains("a.mtl:3: texture `a.png` is a directory"),
        "{}",
        words(&out)
    );
}

/// A missing texture is a warning. An unreadable texture is an error, because its content is
/// unknown. With `--strict`, missing, unreadable and damaged textures are errors.
#[test]
fn textures_that_cannot_be_read_are_errors() {
    let folder = scene();
    let at = folder.path();
    let render = "render a.obj --spp 1 --size 8x8 -o o.exr";
    let strict = &format!("{render} --strict");
    let out = done(at, &split(render));
    assert!(words(&out).contains("is missing"), "{}", words(&out));
    fs::remove_file(at.join("o.exr")).unwrap();
    refused(at, strict, &["a.mtl:3", "`a.png` is missing"]);

    fs::write(at.join("a.png"), "no picture").unwrap();
    let out = done(at, &split(render));
    assert!(words(&out).contains("constant is used"), "{}", words(&out));
    refused(at, strict, &["a.mtl:3", "cannot be used: ", "a.png"]);

    fs::write(at.join("b.obj"), format!("mtllib gone.mtl\n{QUAD}f 1 2 3\n")).unwrap();
    done(at, &split("render b.obj --spp 1 --size 8x8 -o o.exr"));
    refused(
        at,
        "render b.obj --strict -o o.exr",
        &["b.obj:1", "gone.mtl` is missing"],
    );

    // The system returns an error if `/proc/self/mem` is read from its start.
    #[cfg(target_os = "linux")]
    {
        fs::remove_file(at.join("a.png")).unwrap();
        std::os::unix::fs::symlink("/proc/self/mem", at.join("a.png")).unwrap();
        refused(at, render, &["a.mtl:3", "cannot be used: ", "a.png: cannot read it"]);
    }
}

/// Small files whose headers give images larger than memory. They are refused as soon as the header
/// is read.
#[test]
fn pictures_larger_than_memory_are_refused() {
    let folder = scene();
    let at = folder.path();
    // Write an image with one row of 30 million texels, in 100 kB
    let mut encoder = png::Encoder::new(fs::File::create(at.join("a.png")).unwrap(), 30_000_000, 1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::IDAT, &[0; 100_000]).unwrap();
    drop(writer);
    let hdr = [
        &b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 5000 +X 6000\n"[..],
        &[0; 100_000],
    ]
    .concat();
    fs::write(at.join("a.hdr"), hdr).unwrap();
    exr::prelude::write_rgb_file(at.join("a.exr"), 1000, 1000, |_, _| (1.0f32, 1.0f32, 1.0f32)).unwrap();
    for (limit, sky) in [("200M", "a.hdr"), ("20M", "a.exr")] {
        let text = format!(
            "version = 1\n[[object]]\nobj = \"plain.obj\"\n[[light]]\ntype = \"environment\"\nimage = \"{sky}\"\n"
        );
        fs::write(at.join("sky.toml"), text).unwrap();
        refused(
            at,
            &format!("render sky.toml --size 8x8 -o o.exr --max-memory {limit}"),
            &["sky.toml:6", sky, "--max-memory"],
        );
    }
    refused(
        at,
        "render a.obj --size 8x8 -o o.exr --max-memory 200M",
        &["a.mtl:3", "a.png", "takes about", "200.0 MB of --max-memory"],
    );
}

/// The memory of pixels (sums, channels, images) is checked before any work.
#[test]
fn pixels_beyond_memory_are_refused() {
    let folder = scene();
    let at = folder.path();
    refused(
        at,
        "render s.toml --size 60000x60000 --spp 1 -o o.exr",
        &["60000x60000 pixels", "GB", "--size"],
    );
    let render = "render s.toml --size 400x400 --spp 1 -o o.exr --max-memory 99M";
    done(at, &split(render));
    refused(at, &format!("{render} --aov P,uv,motion,id,cryptomatte"), &["99.0 MB"]);
}

/// If the system refuses memory (`ulimit -v`), the program reports an error at any stage.
#[cfg(target_os = "linux")]
#[test]
fn exhausted_memory_is_an_error() {
    let folder = scene();
    let at = folder.path();
    // Write a height field of 45,000 triangles
    let n = 150;
    let mut text = String::new();
    for i in 0..n * n {
        let (x, y) = (i % n, i / n);
        text += &format!("v {x} {y} {}\n", (x * y) % 7);
    }
    for i in (0..n * (n - 1)).filter(|i| i % n < n - 1) {
        text += &format!("f {} {} {} {}\n", i + 1, i + 2, i + n + 2, i + n + 1);
    }
    fs::write(at.join("hill.obj"), text).unwrap();
    let program = crate::support::program::PROGRAM;
    let backends = if cfg!(feature = "obvhs") { "obvhs" } else { "brute" };
    let limited = |megabytes: u32, arguments: &str| {
        let script = format!("ulimit -v {}; exec {program} {arguments}", megabytes * 1000);
        let mut shell = Command::new("sh");
        shell.current_dir(at).args(["-c", &script]).output().unwrap()
    };
    // The shared libraries of the program use a part of the limit. Open Image Denoise needs more.
    // Find the smallest limit at which the program starts.
    let start = (50..1000)
        .step_by(10)
        .find(|&megabytes| limited(megabytes, "--version").status.success());
    let start = start.expect("the program starts in 1 GB");
    let render = format!("render hill.obj --backend {backends} --threads 1 --size 700x700 --spp 1 -q -o o.exr");
    let mut failed = 0;
    for megabytes in [20, 70, 120, 170, 220, 270].map(|more| start + more) {
        let out = limited(megabytes, &render);
        let said = words(&out);
        assert!(
            matches!(out.status.code(), Some(0 | 1)),
            "{megabytes} MB: {:?}: {said}",
            out.status
        );
        if out.status.code() == Some(1) {
            failed += 1;
            assert!(said.contains("help:"), "{megabytes} MB: {said}");
        }
    }
    assert!(failed > 0);
    // The sums of this image need 13 GB
    let out = limited(4000, "render s.toml --size 8192x8192 --spp 1 -q -o o.exr");
    assert_eq!(code(&out), 1, "{}", words(&out));
    assert!(words(&out).contains("8192x8192 pixels"), "{}", words(&out));
}

/// Long scene files: a reader with quadratic time would take minutes.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn long_scene_files_are_read_in_time() {
    let folder = scene();
    let at = folder.path();
    const COUNT: usize = 100_000;
    let head = "version = 1\n[[object]]\nobj = \"plain.obj\"\n";
    let materials: String = (0..COUNT)
        .map(|i| format!("[material.m{i}]\ndiffuse = 0.5\n"))
        .collect();
    fs::write(
        at.join("m.toml"),
        format!("{head}{materials}").replace("= 0.5", "= [0.5, 0.5, 0.5]"),
    )
    .unwrap();
    let groups: String = (0..COUNT)
        .map(|i| format!("[[light_group]]\nname = \"g{i}\"\nmaterials = [\"m{i}\"]\n"))
        .collect();
    fs::write(at.join("g.toml"), format!("{head}{groups}")).unwrap();
    let names: Vec<String> = (0..COUNT).map(|i| format!("\"m{i}\"")).collect();
    let members = format!(
        "{head}[[light_group]]\nname = \"g\"\nmaterials = [{}]\n",
        names.join(",")
    );
    fs::write(at.join("n.toml"), members).unwrap();
    for file in ["m.toml", "n.toml"] {
        let out = run_soon(
            at,
            &split(&format!("render {file} --spp 1 --size 8x8 -o o.exr --warnings all")),
        );
        assert_eq!(code(&out), 0, "{}", words(&out));
        assert!(words(&out).contains("99900 other materials"), "{}", words(&out));
    }
    refused(at, "render g.toml --spp 1 --size 8x8 -o o.exr", &["light groups"]);
}

/// Bytes after the end of a part or checkpoint are an error, because they may be a second file that
/// was appended.
#[test]
fn bytes_behind_sums_are_refused() {
    let folder = scene();
    let at = folder.path();
    let render = "render s.toml --size 8x8 --spp 128 -q";
    done(at, &split(&format!("{render} --samples 0..64 -o 1.exr")));
    done(at, &split(&format!("{render} --samples 64..128 -o 2.exr")));
    done(at, &split(&format!("{render} --samples 0..64 --checkpoint c.exr")));
    let [first, second, checkpoint] = ["1.exr", "2.exr", "c.exr"].map(|name| fs::read(at.join(name)).unwrap());
    done(at, &split("merge 1.exr 2.exr -q -o whole.exr"));

    let end = |file: &[u8]| format!("the end of its image at byte {}", file.len());
    for (more, words) in [
        (&b"x"[..], "1 byte follows"),
        (&[0; 100], "100 bytes follow"),
        (&second, &format!("{} bytes follow", second.len())),
    ] {
        fs::write(at.join("1.exr"), [&first, more].concat()).unwrap();
        refused(
            at,
            "merge 1.exr 2.exr -o m.exr",
            &["1.exr: ", words, &end(&first), "head -c"],
        );
        fs::write(at.join("c.exr"), [&checkpoint, more].concat()).unwrap();
        let resume = format!("{render} --samples 0..64 --checkpoint c.exr --resume");
        refused(at, &resume, &["c.exr: ", words, &end(&checkpoint), "head -c"]);
    }
    assert!(!at.join("m.exr").exists());

    // Check the help of the error
    let cut = fs::read(at.join("1.exr")).unwrap();
    fs::write(at.join("1.exr"), &cut[..first.len()]).unwrap();
    done(at, &split("merge 1.exr 2.exr -q -o m.exr"));
    assert_same_bits(&at.join("m.exr"), &at.join("whole.exr"));
}

/// With brute force, the guess of the camera would take minutes before the first sample, so the
/// guess uses another backend.
#[test]
fn guess_with_brute_force_uses_a_fast_backend() {
    use embrasure::Backend;
    let fast = Backend::Brute.for_guesses();
    if fast == Backend::Brute {
        // Without another backend in this build there is nothing to test.
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("ball.obj"), ball(200)).unwrap();
    let guess = |backend: &str| {
        let line = format!(
            "render ball.obj --backend {backend} --size 4x4 --spp 1 --max-depth 1 --time-limit 1s -o {backend}.exr"
        );
        let out = run_soon(at, &split(&line));
        assert!([0, 1].contains(&code(&out)), "{}", words(&out));
        let said = words(&out);
        let camera = said.lines().find(|line| line.starts_with("camera: ")).map(String::from);
        camera.unwrap_or_else(|| panic!("{said}"))
    };
    assert_eq!(guess("brute"), guess(fast.name()));
}

/// A sphere of 2 `rows`² quadrilaterals.
fn ball(rows: u32) -> String {
    let columns = 2 * rows;
    let angle = |i: u32| std::f64::consts::PI * f64::from(i) / f64::from(rows);
    let mut text = String::new();
    for (row, column) in (0..=rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let (polar, azimuth) = (angle(row), angle(column));
        let (x, z) = (polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin());
        text += &format!("v {x:.6} {:.6} {z:.6}\n", polar.cos());
    }
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let next = (column + 1) % columns;
        let corner = |row: u32, column: u32| row * columns + column + 1;
        let corners = [(row, column), (row, next), (row + 1, next), (row + 1, column)];
        let corners = corners.map(|(row, column)| corner(row, column).to_string());
        text += &format!("f {}\n", corners.join(" "));
    }
    text
}

#[test]
fn utf16_is_read() {
    let folder = scene();
    let at = folder.path();
    let utf16 = |text: &str, mark: bool| -> Vec<u8> {
        let mark = mark.then_some(0xfeff);
        mark.into_iter()
            .chain(text.encode_utf16())
            .flat_map(u16::to_le_bytes)
            .collect()
    };
    let [obj, mtl] = ["a.obj", "a.mtl"].map(|name| fs::read_to_string(at.join(name)).unwrap());
    let hash = || {
        let out = done(at, &split("render a.obj --spp 1 --size 8x8 -o o.exr --stats o.json"));
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(at.join("o.json")).unwrap()).unwrap();
        assert!(words(&out).contains("a.mtl:3"), "{}", words(&out));
        stats["scene_hash"].clone()
    };
    let plain = hash();
    for mark in [true, false] {
        fs::write(at.join("a.obj"), utf16(&obj, mark)).unwrap();
        fs::write(at.join("a.mtl"), utf16(&mtl, mark)).unwrap();
        assert_eq!(hash(), plain);
    }
}

#[test]
fn odd_values_are_reported_exactly() {
    let folder = scene();
    let at = folder.path();
    for (scale, word) in [
        ("1e-30", "by about 1e-30"),
        ("0.0", "flattens"),
        ("1e30", "by about 1e30"),
    ] {
        let text = format!("version = 1\n[[object]]\nobj = \"plain.obj\"\ntransform = {{ scale = {scale} }}\n");
        fs::write(at.join("t.toml"), text).unwrap();
        refused(at, "render t.toml --spp 1 -o o.exr", &["t.toml:4", word]);
    }
    fs::write(
        at.join("a.mtl"),
        "newmtl wall\nKd 1 1 1\nNi 0\nmap_Kd -colorspace linear a.png\n",
    )
    .unwrap();
    let out = run(at, &split("check a.obj"));
    let said = printed(&out);
    assert_eq!(code(&out), 0, "{said}");
    for word in [
        "a.mtl:3: note: Ni of 1 material has no effect: nothing refracts",
        "a.mtl:4:8: warning: statements or options without effect: -colorspace",
        "`a.png` is missing",
    ] {
        assert!(said.contains(word), "no `{word}` in {said}");
    }

    // A material of the scene file replaces the library material that faces use. Both count as
    // used.
    fs::write(
        at.join("over.toml"),
        "version = 1\n[[object]]\nobj = \"a.obj\"\n[material.wall]\ndiffuse = [0.5, 0.5, 0.5]\n",
    )
    .unwrap();
    let said = printed(&run(at, &split("check over.toml")));
    assert!(!said.contains("no face uses"), "{said}");
}
