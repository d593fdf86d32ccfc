//! A scene file as text and sections: reading, parsing, and properties that need no other file.
//! `inspect` finds all errors, for `embrasure check`. `source` adds places to errors.

mod changed_light;
mod cuts;
mod inspect;
#[cfg(test)]
mod tests;

use super::in_order::InOrder;
use super::input::read_bytes;
use super::light_changes::ChangedLight;
use super::obj::{file_axes, named_unit, origin_of};
use super::option_section::OptionSection;
use super::overrides::Overrides;
use super::source::Source;
use super::unknown_key::parser_error;
use super::{
    CutSection, FileError, GroundSection, LightGroupSection, LightSection, LoadOptions, MadeObject, MaterialSection,
    ObjectSection, PartSection, Position, SceneOptions,
};
use crate::guess::FileAxes;
use crate::io::Origin;
use crate::math::{DVec3, Vec3};
use crate::options::CameraOptions;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// A TOML scene file. Values are parsed, and their places are kept for messages. No other file is
/// read.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Version of the format: 1.
    pub(super) version: Option<Spanned<u32>>,
    /// Section `[camera]` as written in the file.
    #[serde(default, skip_serializing_if = "OptionSection::is_empty")]
    pub(super) camera: OptionSection,
    /// Section `[image]` as written in the file.
    #[serde(default, skip_serializing_if = "OptionSection::is_empty")]
    pub(super) image: OptionSection,
    /// Section `[render]` as written in the file.
    #[serde(default, skip_serializing_if = "OptionSection::is_empty")]
    pub(super) render: OptionSection,
    /// Options that the sections `[camera]`, `[image]` and `[render]` set.
    #[serde(skip)]
    pub options: SceneOptions,
    /// Objects from OBJ files.
    #[serde(default)]
    pub object: Vec<ObjectSection>,
    /// Materials by name. They replace or patch materials of the MTL files.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub material: BTreeMap<Spanned<String>, MaterialSection>,
    /// Patches of materials. The keys are globs of material names.
    #[serde(default, skip_serializing_if = "InOrder::is_empty")]
    pub patch: InOrder<MaterialSection>,
    /// Changes to parts of OBJ files. The keys are globs of part names.
    #[serde(default, skip_serializing_if = "InOrder::is_empty")]
    pub part: InOrder<PartSection>,
    /// Lights other than emitting triangles.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light: Vec<LightSection>,
    /// Plane that catches shadows, if any.
    pub ground: Option<GroundSection>,
    /// Planes that cut the scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub section: Vec<CutSection>,
    /// Groups of emitting materials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light_group: Vec<LightGroupSection>,
    /// Meshes made in code. They come after the meshes of the objects.
    #[serde(skip)]
    pub made: Vec<MadeObject>,
    /// Options for reading OBJ and MTL files.
    #[serde(skip)]
    pub load: LoadOptions,
    /// Folders to search for textures. They are searched before the folders of the key
    /// `render.texture_dir`.
    #[serde(skip)]
    pub texture_dirs: Vec<PathBuf>,
    /// Patterns of the names of hidden parts, in addition to the key `render.hide`.
    #[serde(skip)]
    pub hide: Vec<String>,
    /// Patterns of part names, in addition to the key `render.only`: only parts that match are
    /// shown.
    #[serde(skip)]
    pub only: Vec<String>,
    /// True if hidden parts are read as if they were shown. Guesses use this for rooms.
    #[serde(skip)]
    pub(super) shows_hidden_parts: bool,
    /// Changes that flags make to the light.
    #[serde(skip)]
    pub(super) changed_light: Option<Box<ChangedLight>>,
    /// Path and text of the file, and the keys that flags set.
    #[serde(skip)]
    pub(super) source: Source,
}

/// Key of `[render]`: folders to search for textures.
pub(super) const TEXTURE_DIR: &str = "texture_dir";
/// Key of `[render]`: patterns of the names of hidden parts.
pub(super) const HIDE: &str = "hide";
/// Key of `[render]`: patterns of part names. Only parts that match are shown.
pub(super) const ONLY: &str = "only";

impl SceneFile {
    /// Reads and parses a scene file. Errors about unknown keys and wrong types have their place in
    /// the file.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, FileError> {
        Self::load_with(path, &[])
    }

    /// Reads a scene file and replaces keys. Each text of `set` is `KEY=VALUE`: a dotted TOML key,
    /// and a TOML value or a plain string.
    ///
    /// # Errors
    ///
    /// Errors of [`SceneFile::load`]. An error in a key of `set` names the key.
    pub fn load_with(path: impl AsRef<Path>, set: &[String]) -> Result<Self, FileError> {
        let path = path.as_ref();
        Self::of_text(path, read(path)?, set)
    }

    /// Parses `text` as if it were the contents of the scene file `path`. Keys are set as in
    /// [`SceneFile::load_with`]. The file is not read.
    pub(crate) fn of_text(path: &Path, text: String, set: &[String]) -> Result<Self, FileError> {
        let overrides = read_overrides(path, set, &text)?;
        Self::parse(path, text, &overrides)
    }

    fn parse(path: &Path, text: String, overrides: &Overrides) -> Result<Self, FileError> {
        Self::parse_spanned(path, text, overrides).map_err(|(error, _)| error)
    }

    /// The parsed scene file, or an error with its byte in the text.
    fn parse_spanned(path: &Path, text: String, overrides: &Overrides) -> Result<Self, (FileError, Option<usize>)> {
        let mut file: Self = overrides.read(&text).map_err(|error| {
            let (mut message, mut help) = parser_error(error.message());
            let Some(start) = error.span().map(|span| span.start) else {
                return (FileError::new(path, message).help(help), None);
            };
            if let Some((section, name)) = overrides.dotted_material(&text, start) {
                message = format!("[{section}.{name}]: TOML reads the dot as a separator of keys");
                help = format!("quote a name with dots: [{section}.\"{name}\"]");
            }
            let error = match overrides.at(start) {
                Some(written) => FileError::new(path, format!("{written}: {message}")).of_flag(),
                None => FileError::new(path, message).at(Position::of_byte(&text, start)),
            };
            (error.help(help), Some(start))
        })?;
        file.source = Source::of_file(path, text, overrides.clone());
        match &file.version {
            Some(version) if *version.get_ref() == 1 => {}
            Some(version) => {
                let message = format!("unknown version {} of the scene format", version.get_ref());
                let error = file.error(version.span(), message);
                return Err((error.help("this program reads version = 1"), None));
            }
            None => {
                let error = FileError::new(path, "no `version` key").help("start the file with version = 1");
                return Err((error, None));
            }
        }
        file.check_camera().map_err(|error| (error, None))?;
        file.options = file.read_options().map_err(|(error, start)| (error, Some(start)))?;
        file.load.parameters = file.options.load;
        if file.object.is_empty() && path != Path::new(Self::MADE) {
            let error = FileError::new(path, "no [[object]] in this scene");
            return Err((error.help("add [[object]] with obj = \"FILE.obj\""), None));
        }
        Ok(file)
    }

    /// Path that errors show for a scene made in code.
    const MADE: &'static str = "<scene>";

    /// A scene without objects, for a program that adds its own meshes to [`SceneFile::made`].
    /// Paths in the keys of this scene are relative to the current folder.
    ///
    /// # Errors
    ///
    /// An invalid key or value of `set`. The texts of `set` are as in [`SceneFile::load_with`].
    pub fn in_code(set: &[String]) -> Result<Self, FileError> {
        let (path, text) = (Path::new(Self::MADE), "version = 1\n");
        Self::parse(path, text.into(), &read_overrides(path, set, text)?)
    }

    /// Copy of this scene in which the keys `set` replace keys of the file, as in
    /// [`SceneFile::load_with`]. Keys and patches that were set before are dropped.
    ///
    /// # Errors
    ///
    /// An invalid key or value; the error names it.
    pub fn with_keys(&self, set: &[String]) -> Result<Self, FileError> {
        let mut file = match (self.path(), self.object.first()) {
            (None, Some(object)) => Self::of_obj_with(object.obj.get_ref(), set)?,
            (Some(path), _) => {
                let text = self.source.text();
                Self::parse(path, text.into(), &read_overrides(path, set, text)?)?
            }
            (None, None) => Self::in_code(set)?,
        };
        file.made.clone_from(&self.made);
        Ok(file)
    }

    /// A scene of one OBJ file.
    pub fn of_obj(path: impl AsRef<Path>) -> Self {
        let path = path.as_ref();
        let object = ObjectSection::new(Spanned::new(0..0, path.to_path_buf()));
        Self {
            object: vec![object],
            source: Source::of_obj(path, Overrides::default()),
            ..Default::default()
        }
    }

    /// A scene of one OBJ file, with keys set as in [`SceneFile::load_with`].
    ///
    /// # Errors
    ///
    /// An invalid key or value; the error names it.
    pub fn of_obj_with(path: impl AsRef<Path>, set: &[String]) -> Result<Self, FileError> {
        let path = path.as_ref();
        let mut file = Self::of_obj(path);
        if !set.is_empty() {
            let text = "version = 1\n[[object]]\nobj = ''\n";
            let overrides = read_overrides(path, set, text)?;
            file = Self::parse(path, text.into(), &overrides)?;
            let object = &mut file.object[0];
            if object.obj.get_ref().as_os_str().is_empty() {
                object.obj = Spanned::new(0..0, path.to_path_buf());
            }
            file.source = Source::of_obj(object.obj.get_ref(), overrides);
        }
        Ok(file)
    }

    /// Computes the origin of the scene if the option `origin` is `auto`, or if the scene is a bare
    /// OBJ without this option.
    pub(crate) fn settle_origin(&mut self) {
        let is_wanted = match self.load.parameters.origin {
            None => !self.is_file(),
            given => given == Some(Origin::Auto),
        };
        if is_wanted {
            let origin = self
                .object
                .first()
                .map(|object| origin_of(&self.resolve(object.obj.get_ref())));
            let origin = origin.filter(|origin| *origin != DVec3::ZERO);
            self.load.parameters.origin = origin.map(Origin::At);
        }
    }

    /// Point in OBJ coordinates that is the origin of the scene.
    pub(crate) fn origin(&self) -> DVec3 {
        match self.load.parameters.origin {
            Some(Origin::At(origin)) => origin,
            _ => DVec3::ZERO,
        }
    }

    /// Axes according to the comments of the scene's OBJ file. The axes are unknown if the scene
    /// has several objects, or if the object has a `transform`.
    pub(crate) fn axes(&self) -> FileAxes {
        self.only_obj().map(|obj| file_axes(&obj)).unwrap_or_default()
    }

    /// Path of the only OBJ file, if the scene has one object without `transform`; else `None`.
    pub(crate) fn only_obj(&self) -> Option<PathBuf> {
        match self.object.as_slice() {
            [object] if object.transform.is_none() => Some(self.resolve(object.obj.get_ref())),
            _ => None,
        }
    }

    /// Returns an error if two camera keys exclude each other.
    fn check_camera(&self) -> Result<(), FileError> {
        if let (Some(span), None) = (self.camera.span_of("yaw"), self.camera.span_of("stand")) {
            let error = self.error(span, "`yaw` needs `stand`");
            return Err(error.help("add stand = [X, Z]"));
        }
        for [first, second] in CameraOptions::EXCLUSIVE {
            if let (Some(_), Some(span)) = (self.camera.span_of(first), self.camera.span_of(second)) {
                let error = self.error(span, format!("both `{first}` and `{second}` are given"));
                return Err(error.help("keep one of them"));
            }
        }
        Ok(())
    }

    /// Length in metres of one unit of the scene: from the option `unit`, or else from the comments
    /// of the OBJ file. `None` if the comments do not state the unit, if the scene has several
    /// objects, or if the object has a `transform`.
    pub(crate) fn unit(&self) -> Option<f32> {
        if let Some(metres) = self.load.parameters.unit().metres() {
            return Some(metres);
        }
        match self.object.as_slice() {
            [object] if object.transform.is_none() => named_unit(&self.resolve(object.obj.get_ref())),
            _ => None,
        }
    }

    /// Options of `[camera]`, `[image]` and `[render]`, or an error with its byte in the file.
    fn read_options(&self) -> Result<SceneOptions, (FileError, usize)> {
        let mut options = SceneOptions::default();
        self.camera
            .read("camera", &self.source, &mut options.camera_mut(), &[])?;
        self.image.read("image", &self.source, &mut options.image_mut(), &[])?;
        self.render.read(
            "render",
            &self.source,
            &mut options.render_mut(),
            &[TEXTURE_DIR, HIDE, ONLY],
        )?;
        let lists = [
            (
                TEXTURE_DIR,
                "the name of a folder",
                "write a folder, or a list: [\"maps\", \"textures\"]",
            ),
            (
                HIDE,
                "the name of a part",
                "write a name, or a list: [\"Chair*\", \"Lamp\"]",
            ),
            (
                ONLY,
                "the name of a part",
                "write a name, or a list: [\"Chair*\", \"Lamp\"]",
            ),
        ];
        for (key, meaning, help) in lists {
            if let Some((None, span)) = self.render.strings(key) {
                let error = self.error(span.clone(), format!("{key} is not {meaning}"));
                return Err((error.help(help), span.start));
            }
        }
        Ok(options)
    }

    /// Folders to search for textures, in the order of the search.
    ///
    /// # Errors
    ///
    /// A folder of the key `render.texture_dir` does not exist.
    pub(super) fn all_texture_dirs(&self) -> Result<Vec<PathBuf>, FileError> {
        let mut folders = self.texture_dirs.clone();
        if let Some((Some(names), span)) = self.render.strings(TEXTURE_DIR) {
            for name in names {
                let folder = self.resolve(Path::new(name));
                if !folder.is_dir() {
                    let error = self.error(span, format!("{TEXTURE_DIR}: there is no folder {}", folder.display()));
                    return Err(error.help("correct the name of the folder; it is relative to the scene file"));
                }
                folders.push(folder);
            }
        }
        Ok(folders)
    }

    /// Two lists of patterns of part names: parts to hide, and parts to show alone.
    pub(super) fn part_patterns(&self) -> [Vec<String>; 2] {
        [(&self.hide, HIDE), (&self.only, ONLY)].map(|(own, key)| {
            let written = self.render.strings(key).and_then(|(names, _)| names);
            let written = written.into_iter().flatten().map(|name| name.to_string());
            own.iter().cloned().chain(written).collect()
        })
    }

    /// Copy of this file in which no part is hidden. Parts that do not match the patterns of
    /// `only` stay hidden.
    pub(crate) fn with_hidden_parts(&self) -> Self {
        Self {
            shows_hidden_parts: true,
            ..self.clone()
        }
    }

    /// Returns true if a light or material is in a named light group.
    pub fn has_light_groups(&self) -> bool {
        !self.light_group.is_empty() || self.light.iter().any(|light| light.group.is_some())
    }

    /// Paths of the OBJ files of all objects, without repetitions, in the order of the objects.
    pub fn obj_files(&self) -> Vec<PathBuf> {
        let mut files = Vec::new();
        for object in &self.object {
            for name in [Some(&object.obj), object.obj_close.as_ref()].into_iter().flatten() {
                let path = self.resolve(name.get_ref());
                if !files.contains(&path) {
                    files.push(path);
                }
            }
        }
        files
    }

    /// Full path of `relative`, which is relative to the folder of the scene file.
    pub fn resolve(&self, relative: &Path) -> PathBuf {
        self.source.resolve(relative)
    }

    /// Returns true if the scene was made by [`SceneFile::in_code`].
    pub fn is_made(&self) -> bool {
        self.path() == Some(Path::new(Self::MADE))
    }

    /// Returns true for a scene file, false for a bare OBJ.
    pub fn is_file(&self) -> bool {
        self.source.path().is_some()
    }

    /// Path of the scene file; `None` for a bare OBJ.
    pub fn path(&self) -> Option<&Path> {
        self.source.path()
    }

    /// The contents of the scene file; empty for a bare OBJ.
    #[cfg(feature = "view")]
    pub(crate) fn text(&self) -> &str {
        self.source.text()
    }

    /// An error that points to the bytes `span` of the file.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> FileError {
        self.source.error(span, message)
    }

    /// Returns true if the patch of materials at the bytes `span` comes from a flag, and must match
    /// a material.
    pub(super) fn must_match(&self, span: &Range<usize>) -> bool {
        self.source.overrides.must_match(span.start)
    }

    /// An error that points to the camera key `key`; `None` if the file does not have the key.
    pub(crate) fn camera_error(&self, key: &str, message: &str) -> Option<FileError> {
        Some(self.error(self.camera.span_of(key)?, message))
    }

    /// Position of the camera, if the section `[camera]` has it.
    pub fn eye(&self) -> Option<Vec3> {
        self.options
            .camera
            .placed()
            .position
            .map(|position| position.as_vec3a())
    }

    /// An error that belongs to the whole scene, without a place in the file.
    pub fn whole(&self, message: impl Into<String>) -> FileError {
        self.source.whole(message)
    }

    /// Adds a span for values that the flag `written` sets, such as `--env sky`. Errors that point
    /// to this span name the flag.
    pub fn flag_span(&mut self, written: impl Into<String>) -> Range<usize> {
        let bytes = self.source.bytes();
        self.source.overrides.add_flag(bytes, written.into())
    }
}

fn read_overrides(path: &Path, set: &[String], text: &str) -> Result<Overrides, FileError> {
    Overrides::new(set, text.len()).map_err(|written| {
        let error = FileError::new(path, format!("--set {written}: expected KEY=VALUE"));
        error
            .of_flag()
            .help("KEY is a key of the scene file, as in render.max_depth=8 or 'camera.position=[0, 1, 4]'")
    })
}

fn read(path: &Path) -> Result<String, FileError> {
    let bytes = read_bytes(path, "the scene file").map_err(|error| error.help_if_none("check the path"))?;
    String::from_utf8(bytes).map_err(|e| {
        let (text, end) = (String::from_utf8_lossy(e.as_bytes()), e.utf8_error().valid_up_to());
        let error = FileError::new(path, "invalid UTF-8 from here on");
        error.at(Position::of_byte(&text, end)).help("save the file as UTF-8")
    })
}
