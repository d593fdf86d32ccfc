//! Writes the input of a render as the text of a scene file, which users can edit and render again.
//!
//! serde writes the same sections that it reads, so a new key needs no change here. A key that
//! names a file must be in `SceneFile::paths_mut`, because paths are relative to the scene file in
//! which they are written. Numbers have enough digits to restore the same 32 bits.

use super::file::{HIDE, ONLY, TEXTURE_DIR};
use super::option_section::OptionSection;
use super::patches::Patch;
use super::section::Section;
use super::{FileError, Instances, LightSection, MapSection, MaterialSection, PartSection, SceneFile, SceneOptions};
use crate::camera::CameraDescription;
use crate::options::CameraOptions;
use std::collections::HashSet;
use std::fs;
use std::path::{Component, Path, PathBuf};
use toml::Spanned;

/// Version of the written format.
const VERSION: u32 = 1;

/// Maximum number of spellings of one glob: different texts that match the same names. Several
/// patches may have the same glob: patches of the file, and patches of flags.
const MAX_SPELLINGS: usize = 8;

/// A value without a place in a file.
fn spanned<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

impl LightSection {
    /// The light of a scene in which nothing emits: white from all directions.
    pub fn default_light() -> Self {
        Self::constant(0..0, [1.0; 3])
    }
}

impl SceneFile {
    /// Copy of this scene with `options` and `camera`, in which all patches are sections.
    ///
    /// # Errors
    ///
    /// An invalid patch.
    pub fn with(&self, options: &SceneOptions, camera: &CameraDescription) -> Result<Self, FileError> {
        let mut file = self.clone();
        file.version = Some(spanned(VERSION));
        file.options = SceneOptions {
            camera: CameraOptions::of(camera),
            ..*options
        };
        file.camera = OptionSection::of(&file.options.camera());
        file.image = OptionSection::of(&options.image());
        file.render = OptionSection::of(&options.render());
        file.texture_dirs = self.all_texture_dirs()?;
        [file.hide, file.only] = self.part_patterns();
        file.patch.0 = own_patches(self.patches()?, MaterialSection::set_over);
        file.part.0 = own_patches(self.part_patches()?, PartSection::set_over);
        for (_, section) in &mut file.patch.0 {
            section.patch = None;
        }
        file.material.retain(|_, section| !section.is_patch());
        Ok(file)
    }

    /// Text of a scene file at `path` that describes this scene. Paths in the text are relative to
    /// the folder of `path`. Returns an error if a path is not UTF-8.
    pub fn to_toml(&self, path: &Path) -> Result<String, FileError> {
        let mut file = self.clone();
        let folder = absolute(path.parent().unwrap_or(Path::new("")));
        let [files, maps] = self.folders();
        let (files_of, maps_of) = file.paths_mut();
        for name in files_of {
            *name = relocated(name, &files, &folder);
        }
        for name in maps_of {
            *name = relocated(name, &maps, &folder);
        }
        let dirs = self
            .texture_dirs
            .iter()
            .map(|dir| relocated(dir, Path::new(""), &folder));
        let dirs: Vec<String> = dirs.map(|dir| dir.display().to_string()).collect();
        if !dirs.is_empty() {
            file.render.set_strings(TEXTURE_DIR, dirs);
        }
        for (key, patterns) in [HIDE, ONLY].into_iter().zip(self.part_patterns()) {
            if !patterns.is_empty() {
                file.render.set_strings(key, patterns);
            }
        }
        toml::to_string(&file).map_err(|error| {
            let error = FileError::new(path, format!("cannot write the scene: {error}"));
            error.help("rename the files of the scene: their names must be UTF-8")
        })
    }

    /// Two folders to which paths are relative: the first for files of the scene, the second for
    /// textures of materials. Textures of a bare OBJ are relative to the folder of the OBJ file.
    fn folders(&self) -> [PathBuf; 2] {
        let of = |path: &Path| path.parent().unwrap_or(Path::new("")).to_path_buf();
        let whole = self.whole("").file;
        [self.resolve(Path::new("")), of(&whole)]
    }

    /// All paths in the scene file: first the paths of objects and lights, then the paths of
    /// textures.
    fn paths_mut(&mut self) -> (Vec<&mut PathBuf>, Vec<&mut PathBuf>) {
        let mut files = Vec::new();
        for object in &mut self.object {
            files.push(object.obj.get_mut());
            files.extend(object.obj_close.as_mut().map(Spanned::get_mut));
            if let Some(Instances::File(list)) = object.instances.as_mut().map(Spanned::get_mut) {
                files.push(list);
            }
        }
        for light in &mut self.light {
            files.extend(light.image.as_mut().map(Spanned::get_mut));
        }
        let patches = self.patch.0.iter_mut().map(|(_, section)| section);
        let parts = self.part.0.iter_mut().map(|(_, section)| &mut section.material);
        let sections = self.material.values_mut().chain(patches).chain(parts);
        let maps = sections
            .flat_map(MaterialSection::maps_mut)
            .filter_map(|(_, map)| map.as_mut());
        let textures = maps.filter_map(|map| match map.get_mut() {
            MapSection::Texture(texture) => Some(texture.file.get_mut()),
            MapSection::None => None,
        });
        (files, textures.collect())
    }
}

/// Patches as entries of a table with unique keys, in their order. Patches with equal globs get
/// different spellings of the glob.
fn own_patches<S: Clone>(patches: Vec<Patch<S>>, set_over: impl Fn(&mut S, S)) -> Vec<(Spanned<String>, S)> {
    let mut written: Vec<(Spanned<String>, S)> = Vec::new();
    let mut taken = HashSet::new();
    for patch in patches {
        let section = patch.section.into_owned();
        // Find a spelling of the glob that is not in use
        let mut spellings = (0..MAX_SPELLINGS).map(|copy| patch.glob.text(copy));
        let free = spellings.find(|text| taken.insert(text.clone()));
        match (free, written.last_mut()) {
            (None, Some((_, last))) => set_over(last, section),
            (free, _) => written.push((spanned(free.unwrap_or_default()), section)),
        }
    }
    written
}

/// Full path of the folder. Path components that do not exist are kept.
pub(super) fn absolute(folder: &Path) -> PathBuf {
    let folder = if folder == Path::new("") {
        Path::new(".")
    } else {
        folder
    };
    fs::canonicalize(folder)
        .or_else(|_| std::path::absolute(folder))
        .unwrap_or_else(|_| folder.to_path_buf())
}

/// Converts `path`, which is relative to the folder `from`, so that it is relative to the full path
/// `to`. An absolute path is returned unchanged.
pub(super) fn relocated(path: &Path, from: &Path, to: &Path) -> PathBuf {
    if path.is_absolute() {
        return path.to_path_buf();
    }
    let path = from.join(path);
    let (folder, Some(name)) = (path.parent().unwrap_or(Path::new("")), path.file_name()) else {
        return path;
    };
    let folder = absolute(folder);
    let common = folder
        .components()
        .zip(to.components())
        .take_while(|(a, b)| a == b)
        .count();
    if !folder.components().take(common).any(|part| part == Component::RootDir) {
        // The folder is on another drive: return the full path
        return folder.join(name);
    }
    let mut relative: PathBuf = to.components().skip(common).map(|_| Component::ParentDir).collect();
    relative.extend(folder.components().skip(common));
    relative.join(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_to_the_same_file() {
        let root = tempfile::tempdir().unwrap();
        let root = fs::canonicalize(root.path()).unwrap();
        fs::create_dir_all(root.join("a/b")).unwrap();
        fs::create_dir_all(root.join("c")).unwrap();
        for (path, from, to, expected) in [
            ("x.obj", "a", "a", "x.obj"),
            ("b/x.obj", "a", "a", "b/x.obj"),
            ("x.obj", "a", "c", "../a/x.obj"),
            ("../c/x.obj", "a", "c", "x.obj"),
            ("x.obj", "c", "a/b", "../../c/x.obj"),
            ("gone/x.png", "a", "c", "../a/gone/x.png"),
            ("old\\x.png", "a", "c", "../a/old\\x.png"),
        ] {
            let found = relocated(Path::new(path), &root.join(from), &root.join(to));
            assert_eq!(found, Path::new(expected), "{path} from {from} to {to}");
        }
        let full = root.join("a/x.obj");
        assert_eq!(relocated(&full, Path::new(""), &root), full);
    }

    /// Every key of every section is written and read back unchanged.
    #[test]
    fn written_scene_file_is_read_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        fs::write(&path, EVERY_KEY).unwrap();
        let file = SceneFile::load(&path).unwrap();
        let text = file.to_toml(&path).unwrap();
        // The order of keys does not matter.
        let [written, original]: [toml::Table; 2] = [&*text, EVERY_KEY].map(|text| toml::from_str(text).unwrap());
        assert_eq!(as_read(written.into()), as_read(original.into()), "{text}");
        fs::write(&path, &text).unwrap();
        assert_eq!(SceneFile::load(&path).unwrap().to_toml(&path).unwrap(), text);
    }

    /// Converts all numbers, also whole numbers, to 32-bit floats, and a grey to three numbers.
    fn as_read(value: toml::Value) -> toml::Value {
        match value {
            toml::Value::Float(number) => toml::Value::Float((number as f32).into()),
            toml::Value::Integer(number) => toml::Value::Float((number as f32).into()),
            toml::Value::Array(list) => toml::Value::Array(list.into_iter().map(as_read).collect()),
            toml::Value::Table(table) => {
                let entry = |(key, value): (String, toml::Value)| match (key.as_str(), value) {
                    ("specular", toml::Value::Float(grey)) => (key, as_read(vec![grey; 3].into())),
                    (_, value) => (key, as_read(value)),
                };
                toml::Value::Table(table.into_iter().map(entry).collect())
            }
            other => other,
        }
    }

    /// Keys that the text below does not have, because they exclude keys of the text. The tests of
    /// the sections cover these keys.
    const ALTERNATIVES: [&str; 14] = [
        "view",
        "elevation",
        "intrinsics",
        "distortion",
        "pose",
        "orbit",
        "stand",
        "yaw",
        "fov",
        "fisheye_fov",
        "fisheye_mapping",
        "focus_at",
        "f_stop",
        "sensor_height",
    ];

    const EVERY_KEY: &str = r#"version = 1
[camera]
position = [0.1, -2.5e-7, 16777216.0]
look_at = [0.0, 1.0, 3e30]
up = [0.0, 1.0, 0.0]
vertical_fov = 39.3077
projection = "orthographic"
stereo = "top-bottom"
eye_distance = 0.07
convergence = 3.0
ortho_height = 3.5
shift = [0.25, 0.5]
lens_radius = 0.1
aperture_blades = 6
aperture_rotation = 15.0
focus_distance = 4.3
position_close = [1.0, 2.0, 3.0]
look_at_close = [4.0, 5.0, 6.0]
up_close = [0.0, 0.0, 1.0]
shutter = [0.25, 0.75]
[image]
width = 640
height = 480
filter = "gaussian"
filter_radius = 1.7
exposure = -0.3
tone = "agx"
[render]
samples = 3
seed = 9223372036854775807
sampler = "halton"
max_depth = "none"
photon_radius = 0.1
smooth = 30.5
[[object]]
obj = "a b.obj"
name = "chair"
obj_close = "c.obj"
subdivision = 2
crease_angle = 30.0
instances = "places.txt"
[object.transform]
translate = [0.1, 0.2, 0.3]
rotate = [0.0, 90.0, 0.0]
scale = 2.5
[object.transform_close]
scale = [1.0, 2.0, 3.0]
[[object]]
obj = "d.obj"
matrix = [[1.0, 0.0, 0.0, 0.1], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
matrix_close = [[1.0, 0.0, 0.0, 0.2], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
instances = [[[1.0, 0.0, 0.0, 0.1], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]]
[material."tall.box"]
diffuse = [0.1, 0.2, 0.3]
specular = 0.1
model = "ggx"
exponent = 90.0
roughness = 0.3
metallic = 0.7
preset = "gold"
anisotropy = 0.1
anisotropy_rotation = 30.0
clearcoat = 0.2
clearcoat_roughness = 0.3
sheen = [0.1, 0.1, 0.2]
eta = [0.1, 0.2, 0.3]
k = [4.1, 2.4, 1.6]
transmission = [0.1, 0.0, 0.0]
ior = 1.45
abbe = 35.5
absorption = [0.1, 0.2, 0.3]
absorption_depth = 2.5
thin = true
emission = [1.5, 0.0, 0.0]
opacity = 0.9
camera_visible = false
diffuse_map = "wood.png"
specular_map = false
emission_map = "e.exr"
exponent_map = "n.png"
roughness_map = "r.png"
metallic_map = "m.png"
opacity_map = "o.png"
normal_map = "nn.png"
displacement_map = "h.png"
[material."tall.box".bump_map]
file = "b.png"
scale = [2.0, 3.0]
offset = [0.5, 0.0]
wrap = "mirror"
channel = "g"
base = 0.1
gain = 2.0
height = 0.25
midlevel = 0.5
[material.small]
patch = true
roughness = 0.1
[patch."Metal*"]
roughness = 0.2
[patch.'A\*b']
diffuse = [0.5, 0.5, 0.5]
[[light]]
type = "spot"
group = "key"
position = [0.0, 0.9, 0.0]
intensity = [1.0, 2.0, 3.0]
direction = [0.0, -1.0, 0.1]
look_at = [0.0, 0.0, 0.0]
angle = 30.0
falloff = 20.0
irradiance = [1.0, 1.0, 1.0]
radiance = [0.1, 0.1, 0.1]
image = "sky.hdr"
scale = 0.3
radius = 0.4
rotate = 45.0
[[light]]
type = "environment"
image = "sky.hdr"
rotate = [0.0, 45.0, 10.0]
[[section]]
axis = "-y"
value = 0.5
height = 1.5
normal = [0.0, 1.0, 0.5]
point = [0.0, 2.0, 0.0]
material = "floor"
[[light_group]]
name = "lamps"
materials = ["bulb", "tall.box"]
"#;

    /// A key that is added to a section must also be added to the text above.
    #[test]
    fn every_key_is_tried() {
        let page = include_str!("../../docs/guide/reference/scene-file.md");
        let keys = page.lines().filter_map(|line| line.strip_prefix("| `"));
        for line in keys {
            let cell = line.split(" | ").next().unwrap_or_default();
            let Some((section, _)) = cell.split_once('.') else {
                continue;
            };
            if !["camera", "object", "light", "section", "light_group", "material"].contains(&section) {
                continue;
            }
            let names = cell.split('`').filter(|name| name.contains('.'));
            for key in names.filter_map(|name| name.rsplit('.').next()) {
                assert!(
                    ALTERNATIVES.contains(&key)
                        || EVERY_KEY.contains(&format!("\n{key} ="))
                        || EVERY_KEY.contains(&format!(".{key}]")),
                    "{key}"
                );
            }
        }
    }
}
