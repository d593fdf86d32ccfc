//! Checks that hold for any bytes of a file. The file is read or refused, without a panic. If it is
//! read, its content is valid and can be rendered. If it is refused, the error names a line that
//! exists. The fuzz targets and `tests/it/files/fuzz_corpus.rs` share these checks.

use embrasure::accel::brute::BruteForce;
use embrasure::camera::{Camera, CameraMotion, CameraParameters, Pose};
use embrasure::files::read_text;
use embrasure::film::{Film, Filter, Rect};
use embrasure::geometry::Mesh;
use embrasure::integrator::{PathIntegrator, ReusingPathIntegrator, Roulette, Strategy, World};
use embrasure::io::{
    FileError, MtlDialect, TextureKind, describe_checkpoint, load_texture, read_checkpoint, read_layers, read_rendering,
};
use embrasure::light_sampling::LightChoice;
use embrasure::math::{UVec2, Vec2, Vec3};
use embrasure::options::CameraOptions;
use embrasure::render::render;
use embrasure::sampler::Independent;
use embrasure::scene::{Scene, SceneBuilder};
use embrasure::scene_file::{LoadedScene, SceneFile, load_scene};
use embrasure::texture::{Channel, Texture, Wrap};
use std::fs;
use std::path::Path;

/// A kind of file that is read.
pub struct FileKind {
    /// Name of the fuzz target, and of the folders with its inputs.
    pub name: &'static str,
    /// Writes the files to which a file of this kind may refer.
    pub furnish: fn(&Path),
    /// Reads the bytes as a file of this kind, in the given folder. Panics if a check fails.
    pub check: fn(&Path, &[u8]),
}

/// All kinds of files.
pub const FILE_KINDS: [FileKind; 6] = [
    FileKind {
        name: "obj",
        furnish: furnish_scene,
        check: check_obj,
    },
    FileKind {
        name: "mtl",
        furnish: furnish_mtl,
        check: check_mtl,
    },
    FileKind {
        name: "scene",
        furnish: furnish_scene,
        check: check_scene_file,
    },
    FileKind {
        name: "texture",
        furnish: |_| {},
        check: check_texture,
    },
    FileKind {
        name: "environment",
        furnish: furnish_environment,
        check: check_environment,
    },
    FileKind {
        name: "rendering",
        furnish: |_| {},
        check: check_rendering,
    },
];

/// Maximum number of triangles of a scene that is rendered by brute force.
const MAX_RENDERED: u64 = 300;

// ---- The kinds of files -------------------------------------------------------------------------

fn check_obj(folder: &Path, bytes: &[u8]) {
    let path = folder.join("t.obj");
    write(&path, bytes);
    for smooth in [None, Some(40.0)] {
        let mut file = SceneFile::of_obj(&path);
        file.load.parameters.smooth = smooth;
        let Some(loaded) = check_load(&file, folder) else {
            return;
        };
        if let Some(expected) = count_triangles(bytes) {
            // Faces with a wrong vertex are skipped.
            let is_whole = loaded.warnings.iter().all(|warning| warning.kind != "wrong-statement");
            let found = triangles(&loaded);
            assert!(
                found == expected || !is_whole && found < expected,
                "{found} triangles, smooth: {smooth:?}"
            );
        }
        check_render(&loaded.scene, &CameraOptions::default());
    }
}

fn check_mtl(folder: &Path, bytes: &[u8]) {
    write(&folder.join("t.mtl"), bytes);
    // Read the file in the detected dialect, and in a second dialect, which the length of the file
    // selects
    let others = &MtlDialect::NAMES[1..];
    for (_, dialect) in [MtlDialect::NAMES[0], others[bytes.len() % others.len()]] {
        let mut file = SceneFile::of_obj(folder.join("t.obj"));
        file.load.parameters.mtl_dialect = Some(dialect);
        let Some(loaded) = check_load(&file, folder) else {
            return;
        };
        check_render(&loaded.scene, &CameraOptions::default());
    }
}

fn check_scene_file(folder: &Path, bytes: &[u8]) {
    let path = folder.join("t.toml");
    write(&path, bytes);
    match SceneFile::load(&path) {
        Ok(file) => {
            if let Some(loaded) = check_load(&file, folder) {
                check_render(&loaded.scene, &file.options.camera);
            }
        }
        Err(error) => check_error(&error, folder),
    }
}

/// Images of all formats have the same file name. The format is detected from the first bytes. TGA
/// has no typical first bytes, and is detected from the name. The last byte, which decoders ignore,
/// selects the kind of texture.
fn check_texture(folder: &Path, bytes: &[u8]) {
    let path = folder.join("t.tga");
    write(&path, bytes);
    let kind = match bytes.last().map_or(0, |last| last % 6) {
        0 => TextureKind::Normal,
        1 => TextureKind::Value(Channel::Opacity),
        2 => TextureKind::Value(Channel::Depth),
        3 => TextureKind::HeightsOrNormals,
        4 => TextureKind::NormalsOrHeights,
        _ => TextureKind::Color,
    };
    match load_texture(&path, kind, Wrap::Repeat) {
        Ok(texture) => check_texels(&texture, bytes.len()),
        Err(error) => check_error(&error, folder),
    }
}

fn check_environment(folder: &Path, bytes: &[u8]) {
    let is_exr = bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
    let name = if is_exr { "exr" } else { "hdr" };
    write(&folder.join("t").with_extension(name), bytes);
    let file = SceneFile::load(folder.join(name).with_extension("toml")).expect("a sound scene file");
    if let Some(loaded) = check_load(&file, folder) {
        check_render(&loaded.scene, &CameraOptions::default());
    }
}

/// Checks files that the program itself writes: checkpoints, parts, and images to compare.
fn check_rendering(folder: &Path, bytes: &[u8]) {
    let path = folder.join("t.exr");
    write(&path, bytes);
    match read_rendering(&path) {
        Ok(rendering) => {
            let pixels = rendering.window.area() as usize;
            assert_eq!(rendering.image.pixels.len(), pixels);
            assert!(rendering.window.is_inside(rendering.resolution));
        }
        Err(error) => check_error(&error, folder),
    }
    match read_layers(&path) {
        Ok(layers) => {
            for channel in layers.channels {
                assert_eq!(channel.values.len() as u64, channel.window.area());
                assert!(channel.window.is_inside(layers.resolution));
            }
        }
        Err(error) => check_error(&error, folder),
    }
    let described = describe_checkpoint(&path);
    match (read_checkpoint(&path), described) {
        (Ok(checkpoint), Ok(described)) => {
            assert_eq!(checkpoint.film.crop(), described.crop);
            assert_eq!(checkpoint.metadata, described.metadata);
        }
        (Ok(_), Err(error)) => panic!("what is read cannot be described: {error}"),
        (Err(error), _) => check_error(&error, folder),
    }
}

// ---- Other files --------------------------------------------------------------------------------

/// A tetrahedron whose faces have four materials.
const OBJ: &str = "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 3/3 2/2\n\
                   usemtl b\nf 1/1 2/2 4/3\nusemtl c\nf 1/1 4/2 3/3\nusemtl d\nf 2/1 3/2 4/3\n";
const MTL: &str = "newmtl a\nKd 0.5 0.6 0.7\nmap_Kd t.png\nnewmtl b\nKs 0.5\nNs 20\nnewmtl c\nKe 1 2 3\n";

fn furnish_mtl(folder: &Path) {
    write(&folder.join("t.obj"), OBJ.as_bytes());
    furnish_pictures(folder);
}

/// Writes the files that a scene file or an OBJ file (`t.obj`) may refer to.
fn furnish_scene(folder: &Path) {
    write(&folder.join("a.obj"), OBJ.as_bytes());
    write(&folder.join("b.obj"), OBJ.replace("1 0 0", "1 0.5 0").as_bytes());
    write(&folder.join("t.mtl"), MTL.as_bytes());
    write(
        &folder.join("t.txt"),
        b"1 0 0 0  0 1 0 0  0 0 1 2\n0 -1 0 3  1 0 0 0  0 0 1 0  0 0 0 1 # turned\n",
    );
    furnish_pictures(folder);
}

fn furnish_environment(folder: &Path) {
    write(&folder.join("a.obj"), b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for name in ["hdr", "exr"] {
        let text = format!(
            "version = 1\n[[object]]\nobj = \"a.obj\"\n[[light]]\ntype = \"environment\"\nimage = \"t.{name}\"\nscale = 2\nrotate = 30\n"
        );
        write(&folder.join(name).with_extension("toml"), text.as_bytes());
    }
}

fn furnish_pictures(folder: &Path) {
    write(&folder.join("t.png"), include_bytes!("corpus/texture/rgba.png"));
    write(&folder.join("t.hdr"), include_bytes!("corpus/texture/rgb.hdr"));
    write(&folder.join("t.exr"), include_bytes!("corpus/texture/depth.exr"));
}

fn write(path: &Path, bytes: &[u8]) {
    fs::write(path, bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

// ---- Checks -------------------------------------------------------------------------------------

/// Reads and builds the scene. Returns `None` if loading returns a valid error.
fn check_load(file: &SceneFile, folder: &Path) -> Option<LoadedScene> {
    match load_scene(file, SceneBuilder::new()) {
        Ok(loaded) => {
            loaded.scene.meshes().iter().for_each(check_mesh);
            loaded
                .warnings
                .iter()
                .for_each(|warning| check_place(&warning.text, folder));
            assert!(!loaded.scene.lights().is_empty());
            Some(loaded)
        }
        Err(error) => {
            check_error(&error, folder);
            None
        }
    }
}

fn check_mesh(mesh: &Mesh) {
    let vertices = mesh.positions.len();
    let indices = || mesh.triangles.iter().flatten();
    assert!(indices().all(|&i| (i as usize) < vertices), "an index is out of range");
    assert!(mesh.positions.iter().all(|p| p.is_finite()), "a position is not finite");
    assert!(
        mesh.uvs.iter().all(|uv| uv.is_finite()),
        "texture coordinates are not finite"
    );
    assert!(mesh.normals.iter().all(|n| n.is_normalized()), "a normal is not one");
    for attributes in [mesh.uvs.len(), mesh.normals.len()] {
        assert!(
            attributes == 0 || attributes == vertices,
            "{attributes} attributes of {vertices} vertices"
        );
    }
}

fn check_error(error: &FileError, folder: &Path) {
    assert!(
        !error.message.is_empty() && error.help.is_some(),
        "an error without a remedy: {error}"
    );
    check_place(&error.to_string(), folder);
}

/// Asserts that the line and the column of words like `FILE:3:5: message` exist.
fn check_place(words: &str, folder: &Path) {
    let Some(inside) = words.strip_prefix(folder.to_str().expect("a folder in UTF-8")) else {
        return;
    };
    let mut parts = inside.trim_start_matches('/').split(':');
    let name = parts.next().unwrap_or("");
    let path = folder.join(name);
    let text = match name.ends_with(".toml") {
        // Scene files are UTF-8 only.
        true => fs::read(&path)
            .ok()
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned()),
        false => read_text(&path, "the file").ok(),
    };
    let Some(mut text) = text else { return };
    if name.ends_with(".obj") && !text.contains('\n') {
        text = text.replace('\r', "\n");
    }
    let mut number = || parts.next().and_then(|part| part.parse::<usize>().ok());
    let Some(line) = number() else { return };
    let found = text.split('\n').nth(line.wrapping_sub(1));
    let found = found.unwrap_or_else(|| panic!("there is no such line: {words}"));
    if let Some(column) = number() {
        assert!(
            (1..=found.chars().count() + 1).contains(&column),
            "there is no such column: {words}"
        );
    }
}

fn check_texels(texture: &Texture, file_bytes: usize) {
    let (width, height) = texture.size();
    assert!(width > 0 && height > 0);
    // One byte of a file decodes to at most 1032 pixels. Each pixel has four floats, and there are
    // mip levels.
    assert!(
        texture.bytes() <= 32 * 1032 * file_bytes,
        "{} bytes for {file_bytes}",
        texture.bytes()
    );
    for (i, footprint) in [0.0, 0.3, 1e9].into_iter().enumerate() {
        let uv = Vec2::new(0.4 * i as f32, 0.9 - 0.3 * i as f32);
        assert!(texture.color(uv, footprint).is_valid());
        assert!(texture.value(uv, footprint) >= 0.0 && texture.value(uv, footprint).is_finite());
        assert!((0.0..=1.0).contains(&texture.alpha(uv, footprint)));
        assert!(texture.normal(uv, footprint).is_finite() && texture.gradient(uv, footprint).is_finite());
    }
}

/// Traces a few paths. Samples of extreme values may be dropped, but no pixel may be NaN or
/// infinite.
fn check_render(scene: &Scene, camera: &CameraOptions) {
    if scene.placed_triangle_count() > MAX_RENDERED {
        return;
    }
    let parameters = parameters(camera, scene);
    let motion = motion(camera, &parameters);
    let resolution = UVec2::splat(3);
    let Ok(camera) = Camera::moving(parameters, motion, resolution) else {
        return;
    };
    let accel = BruteForce::new(scene);
    let selection = scene.light_selection(LightChoice::default());
    let path = PathIntegrator {
        world: World::new(scene, &accel, &selection, &camera, &Filter::BOX),
        strategy: Strategy::default(),
        max_depth: Some(3),
        roulette: Roulette::default(),
        light_samples: 1,
        clamp_indirect: None,
    };
    let mut film = Film::new(resolution, Rect::full(resolution));
    render(&ReusingPathIntegrator { path }, &Independent::new(0), &mut film, 1, &());
    for (pixel, sums) in film.pixels() {
        let mean = [0, 1, 2].map(|c| sums.mean(c));
        assert!(mean.iter().all(|m| m.is_finite()), "pixel {pixel} is {mean:?}");
    }
}

fn framing(scene: &Scene) -> CameraParameters {
    let bounds = scene.bounds();
    let look_at = bounds.center();
    CameraParameters {
        position: look_at + Vec3::new(1.0, 1.5, 3.0) * bounds.radius(),
        look_at,
        up: Vec3::Y,
        vertical_fov: 40.0,
        lens_radius: 0.0,
        focus_distance: 1.0,
    }
}

fn parameters(camera: &CameraOptions, scene: &Scene) -> CameraParameters {
    let usual = framing(scene);
    CameraParameters {
        position: camera.position.map_or(usual.position, |position| position.as_vec3a()),
        look_at: camera.look_at.map_or(usual.look_at, |look_at| look_at.as_vec3a()),
        up: camera.up.unwrap_or(usual.up),
        vertical_fov: camera.vertical_fov.unwrap_or(usual.vertical_fov),
        lens_radius: camera.lens_radius.unwrap_or(usual.lens_radius),
        focus_distance: camera.focus_distance.unwrap_or(usual.focus_distance),
    }
}

fn motion(camera: &CameraOptions, parameters: &CameraParameters) -> CameraMotion {
    CameraMotion {
        close: Some(Pose {
            position: camera.position_close.unwrap_or(parameters.position),
            look_at: camera.look_at_close.unwrap_or(parameters.look_at),
            up: camera.up_close.unwrap_or(parameters.up),
        }),
        shutter: camera.shutter().0,
    }
}

/// Number of triangles of a scene, including triangles that were skipped because they have no area
/// or repeat others.
fn triangles(loaded: &LoadedScene) -> u64 {
    let skipped = |words: &str| -> u64 {
        let of = |text: &str| text.split(words).nth(1)?.rsplit(' ').next()?.parse::<u64>().ok();
        loaded.warnings.iter().filter_map(|w| of(&w.text)).sum()
    };
    loaded.scene.triangle_count()
        + skipped("triangles without area, skipped: ")
        + skipped("triangles that repeat others at the same place, skipped: ")
}

/// Number of triangles according to the text: the sum of (corners − 2) over all `f` statements.
/// `None` if the text is UTF-16, or has Unicode blanks.
fn count_triangles(bytes: &[u8]) -> Option<u64> {
    // This function cannot decode UTF-16, unlike the reader, so it does not count.
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) || bytes.iter().take(4).any(|&b| b == 0) {
        return None;
    }
    let text = String::from_utf8_lossy(bytes);
    if text.chars().any(|c| c.is_whitespace() && !c.is_ascii_whitespace()) {
        return None;
    }
    let ends = if text.contains('\n') { '\n' } else { '\r' };
    let mut total = 0;
    let mut statement: Vec<&str> = Vec::new();
    for line in text.trim_start_matches('\u{feff}').split(ends) {
        let words = line.split_ascii_whitespace();
        let mut words: Vec<&str> = words.take_while(|word| !word.starts_with('#')).collect();
        let goes_on = words.last().and_then(|word| word.strip_suffix('\\'));
        if let Some(start) = goes_on {
            words.pop();
            words.push(start);
        }
        statement.extend(words.into_iter().filter(|word| !word.is_empty()));
        if goes_on.is_none() {
            total += triangles_of(&statement);
            statement.clear();
        }
    }
    Some(total + triangles_of(&statement))
}

/// Number of triangles of a statement.
fn triangles_of(statement: &[&str]) -> u64 {
    match statement {
        ["f" | "fo", corners @ ..] => (corners.len() as u64).saturating_sub(2),
        _ => 0,
    }
}
