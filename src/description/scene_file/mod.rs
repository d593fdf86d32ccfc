use super::in_order::InOrder;
use super::input::read_bytes;
use super::option_section::OptionSection;
use super::overrides::Overrides;
use super::unknown_key::parser_error;
use super::{
    CameraSection, FileError, GroundSection, LightGroupSection, LightSection, LoadOptions, LoadParameters,
    MaterialSection, Position,
};
use crate::options::{
    BackgroundOptions, FilterOptions, IntegratorOptions, QualityOptions, SamplingOptions, SizeOptions, ToneOptions,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use toml::Spanned;

/// A TOML scene file as it was written: values are read, places are kept for messages, nothing is looked up yet.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Version of the format; 1.
    pub(super) version: Option<Spanned<u32>>,
    /// Where the picture is taken from.
    pub camera: Option<CameraSection>,
    /// `[image]` as it was written.
    #[serde(default, skip_serializing_if = "OptionSection::is_empty")]
    pub(super) image: OptionSection,
    /// `[render]` as it was written.
    #[serde(default, skip_serializing_if = "OptionSection::is_empty")]
    pub(super) render: OptionSection,
    /// What both of them say.
    #[serde(skip)]
    pub options: SceneOptions,
    /// Geometry.
    #[serde(default)]
    pub object: Vec<ObjectSection>,
    /// Materials that replace those of the MTL files, by name, or patch them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub material: BTreeMap<Spanned<String>, MaterialSection>,
    /// Patches of materials, by globs of their names.
    #[serde(default, skip_serializing_if = "InOrder::is_empty")]
    pub patch: InOrder<MaterialSection>,
    /// Lights besides emitting triangles.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light: Vec<LightSection>,
    /// The plane that catches shadows, if there is one.
    pub ground: Option<GroundSection>,
    /// Groups of emitting materials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light_group: Vec<LightGroupSection>,
    /// How OBJ and MTL files are read.
    #[serde(skip)]
    pub load: LoadOptions,
    /// Folders in which textures are looked for before those of the key `render.texture_dir`.
    #[serde(skip)]
    pub texture_dirs: Vec<PathBuf>,
    /// The file itself; paths are relative to its folder.
    #[serde(skip)]
    path: PathBuf,
    /// Its text, for places in messages.
    #[serde(skip)]
    pub(super) text: String,
    /// Keys that are set over those of the file.
    #[serde(skip)]
    pub(super) overrides: Overrides,
    /// Bytes at which its lines start, once a place was asked for.
    #[serde(skip)]
    line_starts: OnceLock<Vec<usize>>,
}

/// What a scene file says of parameters that flags set too.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneOptions {
    /// Size of the image.
    pub size: SizeOptions,
    /// Reconstruction filter.
    pub filter: FilterOptions,
    /// What camera rays see where they leave the scene.
    pub background: BackgroundOptions,
    /// How PNG files show the picture.
    pub tone: ToneOptions,
    /// Samples, and what computes them.
    pub sampling: SamplingOptions,
    /// Samples, noise level and denoiser together, where `sampling` does not say them.
    pub quality: QualityOptions,
    /// The integrator and its parameters.
    pub integrator: IntegratorOptions,
    /// How OBJ and MTL files are read.
    pub load: LoadParameters,
}

/// `[[object]]`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSection {
    /// OBJ file, relative to the scene file.
    pub obj: Spanned<PathBuf>,
    /// What mattes call it; the OBJ's stem if this is left out.
    pub name: Option<String>,
    /// Placement in the world.
    pub transform: Option<Spanned<TransformSection>>,
    /// Placement as four rows of four, instead of `transform`.
    pub matrix: Option<Spanned<[[f32; 4]; 4]>>,
    /// Placement at time 1, if the object moves.
    pub transform_close: Option<Spanned<TransformSection>>,
    /// The same as four rows of four.
    pub matrix_close: Option<Spanned<[[f32; 4]; 4]>>,
    /// OBJ file of its shape at time 1, if that changes.
    pub obj_close: Option<Spanned<PathBuf>>,
    /// Where copies of it stand.
    pub instances: Option<Spanned<Instances>>,
}

/// `instances = …`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "instances must be a file name or a list of matrices, each four rows of four"
)]
pub enum Instances {
    /// A file with one placement a line.
    File(PathBuf),
    /// The placements.
    Matrices(Vec<[[f32; 4]; 4]>),
}

/// `transform = { … }`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TransformSection {
    /// Applied last.
    pub translate: Option<[f32; 3]>,
    /// Degrees about the fixed x, y and z axes, in that order.
    pub rotate: Option<[f32; 3]>,
    /// Applied first.
    pub scale: Option<Scale>,
}

/// One factor, or one for each axis.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged, expecting = "scale must be a number or three numbers")]
pub enum Scale {
    /// The same along all axes.
    Uniform(f32),
    /// Along x, y and z.
    Axes([f32; 3]),
}

impl SceneFile {
    /// Reads and parses a scene file; unknown keys and wrong types are errors with their place.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        Self::load_with(path, &[])
    }

    /// Reads a scene file with keys set over its own, each as `KEY=VALUE`: a dotted key of TOML, and a value of TOML or a plain string.
    ///
    /// # Errors
    ///
    /// Those of [`SceneFile::load`]. An error of a key that is set names it.
    pub fn load_with(path: &Path, set: &[String]) -> Result<Self, FileError> {
        let text = read(path)?;
        let overrides = read_overrides(path, set, &text)?;
        Self::parse(path, text, &overrides)
    }

    /// Reads a scene file as [`SceneFile::load_with`] does, and continues after errors: an entry or a section with an error is left out, and the rest
    /// is read again. Returns the rest, unless it is too little for a scene, and all errors.
    pub fn inspect(path: &Path, set: &[String]) -> (Option<Self>, Vec<FileError>) {
        let read = read(path).and_then(|text| Ok((read_overrides(path, set, &text)?, text)));
        let (overrides, mut text) = match read {
            Ok(read) => read,
            Err(error) => return (None, vec![error]),
        };
        let original = text.clone();
        let mut errors: Vec<FileError> = Vec::new();
        loop {
            let (error, start) = match Self::parse_spanned(path, text.clone(), &overrides) {
                Ok(mut file) => {
                    // Places are those of the whole file; blanks have kept them.
                    file.text = original;
                    return (Some(file), errors);
                }
                Err(refused) => refused,
            };
            let is_new = errors.iter().all(|known| known.position != error.position);
            if !is_new || errors.len() == MAX_ERRORS {
                return (None, errors);
            }
            errors.push(error);
            match start.and_then(|start| without_entry(&text, start)) {
                Some(shorter) => text = shorter,
                None => return (None, errors),
            }
        }
    }

    fn parse(path: &Path, text: String, overrides: &Overrides) -> Result<Self, FileError> {
        Self::parse_spanned(path, text, overrides).map_err(|(error, _)| error)
    }

    /// What the text says, or an error and the byte that it is about.
    fn parse_spanned(path: &Path, text: String, overrides: &Overrides) -> Result<Self, (FileError, Option<usize>)> {
        let mut file: Self = overrides.read(&text).map_err(|error| {
            let (mut message, mut help) = parser_error(error.message());
            let Some(start) = error.span().map(|span| span.start) else {
                return (FileError::new(path, message).help(help), None);
            };
            if let Some((section, name)) = overrides.dotted_material(&text, start) {
                message = format!("[{section}.{name}]: TOML takes a dot for the beginning of a key");
                help = format!("quote a name with dots: [{section}.\"{name}\"]");
            }
            let error = match overrides.at(start) {
                Some(written) => FileError::new(path, format!("{written}: {message}")).of_flag(),
                None => FileError::new(path, message).at(Position::of_byte(&text, start)),
            };
            (error.help(help), Some(start))
        })?;
        file.path = path.to_path_buf();
        file.text = text;
        file.overrides = overrides.clone();
        match &file.version {
            Some(version) if *version.get_ref() == 1 => {}
            Some(version) => {
                let message = format!("version {} of the scene format is not known", version.get_ref());
                let error = file.error(version.span(), message);
                return Err((error.help("this program reads version = 1"), None));
            }
            None => {
                let error = FileError::new(path, "no `version` key").help("start the file with version = 1");
                return Err((error, None));
            }
        }
        if let Some((span, message, help)) = file.camera.as_ref().and_then(CameraSection::contradiction) {
            return Err((file.error(span, message).help(help), None));
        }
        file.options = file.read_options().map_err(|(error, start)| (error, Some(start)))?;
        file.load.parameters = file.options.load;
        if file.object.is_empty() {
            let error = FileError::new(path, "no [[object]] in this scene");
            return Err((error.help("add [[object]] with obj = \"FILE.obj\""), None));
        }
        Ok(file)
    }

    /// The scene that consists of one OBJ file.
    pub fn of_obj(path: &Path) -> Self {
        let object = ObjectSection {
            obj: Spanned::new(0..0, path.to_path_buf()),
            name: None,
            transform: None,
            matrix: None,
            transform_close: None,
            matrix_close: None,
            obj_close: None,
            instances: None,
        };
        Self {
            object: vec![object],
            ..Default::default()
        }
    }

    /// The scene that consists of one OBJ file, with keys set as in [`SceneFile::load_with`].
    ///
    /// # Errors
    ///
    /// A key or value that a scene file cannot have; the error names it.
    pub fn of_obj_with(path: &Path, set: &[String]) -> Result<Self, FileError> {
        let mut file = Self::of_obj(path);
        if !set.is_empty() {
            let text = "version = 1\n[[object]]\nobj = ''\n";
            let overrides = read_overrides(path, set, text)?;
            file = Self::parse(path, text.into(), &overrides)?;
            let object = &mut file.object[0];
            if object.obj.get_ref().as_os_str().is_empty() {
                object.obj = Spanned::new(0..0, path.to_path_buf());
            }
            (file.path, file.text) = Default::default();
        }
        Ok(file)
    }

    /// What `[image]` and `[render]` say, or an error and the byte that it is about.
    fn read_options(&self) -> Result<SceneOptions, (FileError, usize)> {
        let mut options = SceneOptions::default();
        let SceneOptions {
            size,
            filter,
            background,
            tone,
            sampling,
            quality,
            integrator,
            load,
        } = &mut options;
        self.image
            .read("image", self, &mut [size, filter, background, tone], &[])?;
        self.render.read(
            "render",
            self,
            &mut [sampling, quality, integrator, load],
            &[TEXTURE_DIR],
        )?;
        if let Some((None, span)) = self.render.strings(TEXTURE_DIR) {
            let error = self.error(span.clone(), format!("{TEXTURE_DIR} is no name of a folder"));
            return Err((
                error.help("write a folder, or a list: [\"maps\", \"textures\"]"),
                span.start,
            ));
        }
        Ok(options)
    }

    /// Folders in which textures are looked for, in their order.
    ///
    /// # Errors
    ///
    /// A folder of the key `render.texture_dir` that is not there.
    pub(super) fn all_texture_dirs(&self) -> Result<Vec<PathBuf>, FileError> {
        let mut folders = self.texture_dirs.clone();
        if let Some((Some(names), span)) = self.render.strings(TEXTURE_DIR) {
            for name in names {
                let folder = self.resolve(Path::new(name));
                if !folder.is_dir() {
                    let error = self.error(span, format!("{TEXTURE_DIR}: there is no folder {}", folder.display()));
                    return Err(error.help("correct its name; it is relative to the scene file"));
                }
                folders.push(folder);
            }
        }
        Ok(folders)
    }

    /// Whether any light, or the emission of any material, is said to be in a group.
    pub fn has_light_groups(&self) -> bool {
        !self.light_group.is_empty() || self.light.iter().any(|light| light.group.is_some())
    }

    /// An error at bytes `span` of the file.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> FileError {
        if let Some(written) = self.overrides.at(span.start) {
            return self.whole(format!("{written}: {}", message.into())).of_flag();
        }
        FileError::new(&self.path, message).at(self.position(span.start))
    }

    /// The place of a byte: as [`Position::of_byte`] has it, without counting all lines anew. Far to the right in a long line it has no column.
    fn position(&self, byte: usize) -> Position {
        let starts = self.line_starts.get_or_init(|| {
            let ends = self.text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
            std::iter::once(0).chain(ends.map(|(end, _)| end + 1)).collect()
        });
        let lines_before = starts.partition_point(|&start| start <= byte.min(self.text.len())) - 1;
        let start = starts[lines_before];
        let place = match byte - start {
            0..=MAX_COLUMNS => Position::of_byte(&self.text[start..], byte - start),
            _ => Position::line(1),
        };
        Position {
            line: lines_before + 1,
            ..place
        }
    }

    /// The place of values that the flag `written` sets, such as `--env sky`: errors of them name it.
    pub fn flag_span(&mut self, written: impl Into<String>) -> Range<usize> {
        self.overrides.add_flag(self.text.len(), written.into())
    }

    /// Something about the scene as a whole.
    pub fn whole(&self, message: impl Into<String>) -> FileError {
        let obj = self.object.first().map(|o| o.obj.get_ref().as_path());
        let path = if self.is_file() { Some(self.path.as_path()) } else { obj };
        FileError::new(path.unwrap_or(Path::new("")), message)
    }

    /// A path in the scene file, which is relative to its folder.
    pub fn resolve(&self, relative: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(relative)
    }

    /// Whether this stands for a scene file rather than a bare OBJ.
    pub fn is_file(&self) -> bool {
        !self.path.as_os_str().is_empty()
    }

    /// The scene file itself; `None` for a bare OBJ.
    pub fn path(&self) -> Option<&Path> {
        self.is_file().then_some(&self.path)
    }
}

/// Key of `[render]`: folders in which textures are looked for.
pub(super) const TEXTURE_DIR: &str = "texture_dir";
/// Bytes of a line in which columns are counted: there may be an error of each word of a line, and lines may be megabytes.
const MAX_COLUMNS: usize = 1 << 12;
/// Errors of a scene file that are told.
const MAX_ERRORS: usize = 20;

fn read_overrides(path: &Path, set: &[String], text: &str) -> Result<Overrides, FileError> {
    Overrides::new(set, text.len()).map_err(|written| {
        let error = FileError::new(path, format!("--set {written}: no key with a value"));
        error.of_flag().help(
            "write a key of the scene file and its value, such as render.max_depth=8 or 'camera.position=[0, 1, 4]'",
        )
    })
}

fn read(path: &Path) -> Result<String, FileError> {
    let bytes = read_bytes(path, "the scene file").map_err(|error| error.help_if_none("check the path"))?;
    String::from_utf8(bytes).map_err(|e| {
        let (text, end) = (String::from_utf8_lossy(e.as_bytes()), e.utf8_error().valid_up_to());
        let error = FileError::new(path, "what begins here is no text in UTF-8");
        error.at(Position::of_byte(&text, end)).help("save the file as UTF-8")
    })
}

/// The text with blanks in place of the entry or the section that byte `start` belongs to, so that other bytes keep their places.
/// `None` where nothing was there.
fn without_entry(text: &str, start: usize) -> Option<String> {
    let before = text.get(..start)?;
    let begin = before.rfind('\n').map_or(0, |i| i + 1);
    let is_header = text[begin..].trim_start().starts_with('[');
    // An entry goes on until its brackets are closed, a section to the next one.
    let mut end = begin;
    let mut depth = 0i64;
    for line in text[begin..].split_inclusive('\n') {
        if is_header && end > begin && line.trim_start().starts_with('[') {
            break;
        }
        end += line.len();
        let count = |brackets: [char; 2]| line.matches(brackets).count() as i64;
        depth += count(['[', '{']) - count([']', '}']);
        if !is_header && depth <= 0 {
            break;
        }
    }
    let entry = &text[begin..end];
    if entry.trim().is_empty() {
        return None;
    }
    let blank = |byte: u8| if byte == b'\n' { '\n' } else { ' ' };
    let blanks: String = entry.bytes().map(blank).collect();
    Some(format!("{}{blanks}{}", &text[..begin], &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::MaxDepth;
    use std::fs;

    fn load(text: &str) -> Result<SceneFile, FileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        fs::write(&path, text).unwrap();
        SceneFile::load(&path)
    }

    const OBJECT: &str = "[[object]]\nobj = \"a.obj\"\n";

    #[test]
    fn every_key_of_the_format_is_read() {
        let file = load(
            r#"version = 1
[camera]
position = [0, 1, 2.5]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov = 39.3
lens_radius = 0.1
focus_distance = 4
[image]
width = 640
height = 480
filter = "box"
[render]
samples = 64
max_depth = "none"
integrator = "path"
sampler = "independent"
seed = 18446744073709551615
[[object]]
obj = "a b.obj"
transform = { translate = [0, 0, 1], rotate = [0, 90, 0], scale = 2.0 }
[[object]]
obj = "c.obj"
matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[material."tall box"]
diffuse = [0.7, 0.7, 0.7]
specular = [0.2, 0.2, 0.2]
exponent = 90.0
transmission = [0.0, 0.0, 0.0]
ior = 1.5
emission = [0.0, 0.0, 0.0]
[[light]]
type = "point"
position = [0.0, 0.9, 0.0]
intensity = [1.0, 1.0, 1.0]
"#,
        );
        let file = file.unwrap();
        assert_eq!(file.camera.unwrap().position.unwrap().get_ref()[2], 2.5);
        assert_eq!(file.options.integrator.max_depth, Some(MaxDepth(None)));
        assert_eq!(file.object.len(), 2);
        assert_eq!(file.material.keys().next().unwrap().get_ref(), "tall box");
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let cases = [
            (format!("version = 1\n{OBJECT}[image]\nwidht = 3\n"), 5, "widht"),
            (format!("version = 1\n{OBJECT}[image]\nwidth = \"a\"\n"), 5, "\"a\""),
            (format!("version = 1\n{OBJECT}[image]\nwidth = -3\n"), 5, "-3"),
            (
                format!("version = 1\n{OBJECT}[render]\nsamples = 3\nspp = 4\n"),
                6,
                "twice",
            ),
            (format!("version = 2\n{OBJECT}"), 1, "version 2"),
            (
                format!("version = 1\n{OBJECT}[render]\nmax_depth = \"deep\"\n"),
                5,
                "deep",
            ),
            ("version = 1\n[[object]\n".into(), 2, "]"),
        ];
        for (text, line, word) in cases {
            let error = load(&text).unwrap_err();
            assert_eq!(error.position.map(|p| p.line), Some(line), "{text}: {error}");
            assert!(error.message.contains(word), "{text}: {error}");
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        fs::write(&path, b"version = 1\n# \xc3\xa4\xc3\nx").unwrap();
        let error = SceneFile::load(&path).unwrap_err();
        assert_eq!(
            error.position.map(|p| (p.line, p.column)),
            Some((2, Some(4))),
            "{error}"
        );
        assert!(load(OBJECT).unwrap_err().message.contains("version"));
        assert!(load("version = 1\n").unwrap_err().message.contains("object"));
    }
}
