//! Loading a scene: reads the files that a scene file names, and builds the scene. `inspect_scene` collects all findings, and `load_scene` ends with
//! the first error.
//!
//! `objects` places meshes, `materials` finds the material of each of them, and `textures` reads the pictures that materials ask for.

mod beside;
mod cuts;
mod displacement;
mod materials;
mod named_maps;
mod objects;
mod parts;
mod textures;
mod unseen;

use super::find_file::FileFinder;
use super::load_obj::load_obj;
use super::memory::Allowance;
use super::mtl::{FileMaterial, MapRequest};
use super::obj::ObjFile;
use super::object_section::ObjectSection;
use super::part_section::PartSection;
use super::patches::{Patch, PatchList};
use super::scene_file::SceneFile;
use super::section::value;
use super::texture::TextureRequest;
use super::{DEFAULT_LIGHT, FileError, Finding, Findings, LoadObserver, MemoryLimit, Severity, Warning};
use crate::geometry::MAX_STEPS;
use crate::io::LoadOptions;
use crate::light::LightGroupId;
use crate::lint::{DEFAULT_MATERIAL, Inspection, MaterialSource, ObjSource};
use crate::material::MaterialId;
use crate::math::{excerpt_of_name, significant};
use crate::scene::{
    BuildError, DISK_NAME, PrototypeId, RECTANGLE_NAME, SPHERE_NAME, Scene, SceneBuilder, SceneReport, UnlitBuilder,
};
use materials::{Undefined, Untextured};
use named_maps::NamedMaps;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use textures::AskedTexture;
use toml::Spanned;
use unseen::report_unseen;

/// A scene read from files.
#[derive(Debug)]
pub struct Loaded {
    /// The frozen scene.
    pub scene: Scene,
    /// Missing parts, repairs and assumptions.
    pub warnings: Vec<Warning>,
    /// All files that were read; nothing may be written over them.
    pub files: Vec<PathBuf>,
}

/// Reads everything that `file` names and builds the scene with `builder`, which may hold parts and settings already. What is wrong first is the
/// error.
pub fn load_scene(file: &SceneFile, builder: SceneBuilder) -> Result<Loaded, FileError> {
    load_scene_watched(file, builder, &())
}

/// [`load_scene`], whose progress `observer` receives.
pub fn load_scene_watched(
    file: &SceneFile,
    builder: SceneBuilder,
    observer: &dyn LoadObserver,
) -> Result<Loaded, FileError> {
    loaded_of(Loader::new(file, builder, observer, false).load())
}

/// The scene, or the first error.
fn loaded_of(inspection: Inspection) -> Result<Loaded, FileError> {
    let Inspection {
        scene, findings, files, ..
    } = inspection;
    let warnings = findings.warnings();
    match (findings.first_error(), scene) {
        (None, Some(scene)) => Ok(Loaded { scene, warnings, files }),
        (Some(error), _) => Err(error.clone()),
        (None, None) => Err(FileError::new(Path::new(""), "there is no scene")),
    }
}

/// [`load_scene_watched`], with what is needed to build the scene again in other light.
pub(crate) fn load_scene_to_light(
    file: &SceneFile,
    builder: SceneBuilder,
    observer: &dyn LoadObserver,
) -> Result<(Loaded, Unlit), FileError> {
    let mut unlit = None;
    let loader = Loader::new(file, builder, observer, false);
    let loaded = loaded_of(loader.load_keeping(&mut unlit))?;
    let unlit = unlit.ok_or_else(|| FileError::new(Path::new(""), "there is no scene"))?;
    Ok((loaded, unlit))
}

/// A scene that was read, without its lights, ground, triangles and textures.
pub(crate) struct Unlit {
    builder: UnlitBuilder,
    findings: Findings,
    materials: Vec<MaterialSource>,
    textures: Vec<PathBuf>,
    files: Vec<PathBuf>,
}

impl Unlit {
    /// The scene in the lights and on the ground of `file`, with triangles and textures of `scene`;
    /// `None` if these are not as they were read. All else of `file` is as in the first one.
    pub fn lit(self, file: &SceneFile, scene: Scene, observer: &dyn LoadObserver) -> Result<Option<Loaded>, FileError> {
        let Some(builder) = self.builder.with_parts_of(scene) else {
            return Ok(None);
        };
        let mut loader = Loader {
            findings: self.findings,
            materials: self.materials,
            texture_files: self.textures,
            files: self.files,
            ..Loader::new(file, builder, observer, false)
        };
        loader.add_lights();
        loaded_of(loader.finish(Vec::new())).map(Some)
    }
}

/// Reads the same in the same way, but goes on after what is wrong.
pub fn inspect_scene(file: &SceneFile, builder: SceneBuilder) -> Inspection {
    Loader::new(file, builder, &(), true).load()
}

struct Loader<'a> {
    file: &'a SceneFile,
    builder: SceneBuilder,
    observer: &'a dyn LoadObserver,
    /// Memory that reading may take.
    allowance: Allowance,
    /// The files of each object.
    shapes: Vec<Shapes>,
    /// Number of objects with these files.
    copies: HashMap<Shapes, usize>,
    /// The last object for which a file is needed.
    last_use: HashMap<Shape, usize>,
    findings: Findings,
    /// Whether to go on after what is wrong.
    goes_on: bool,
    /// Materials handed to the builder.
    used: HashMap<UsedMaterial, MaterialId>,
    materials: Vec<MaterialSource>,
    /// Patches of materials.
    patches: PatchList<'a>,
    /// Patches of parts.
    parts: Vec<Patch<'a, PartSection>>,
    /// Whether any material of this name emits, of those that are used.
    emits: HashMap<String, bool>,
    /// The group of lights that materials of this name are in.
    light_groups: HashMap<String, LightGroupId>,
    /// Textures that they ask for, and where they do so.
    textures: Vec<TextureRequest>,
    asked: Vec<AskedTexture>,
    /// Folders in which textures are looked for.
    texture_dirs: Vec<PathBuf>,
    finder: FileFinder,
    /// Textures that were found elsewhere than named, by the file that names them and their folder.
    found_elsewhere: BTreeMap<(PathBuf, PathBuf), Vec<(MapRequest, PathBuf)>>,
    /// Uses of textures that are nowhere, by the file that names them and their name.
    missing: BTreeMap<(PathBuf, String), Vec<textures::MissingUse>>,
    /// Materials of each OBJ file that no library defines.
    undefined: BTreeMap<PathBuf, Undefined>,
    /// Textures beside each OBJ file, by their names.
    named_maps: BTreeMap<PathBuf, NamedMaps>,
    /// Heights by which materials displace their surfaces.
    heights: HashMap<MaterialId, Option<displacement::Heights>>,
    /// Materials without any texture of each OBJ file with texture coordinates, and whether one of
    /// its materials has a texture.
    untextured: BTreeMap<PathBuf, Untextured>,
    /// How OBJ files are read.
    load: LoadOptions,
    /// Patterns of the names of parts that fit one in any file.
    part_fits: Vec<bool>,
    /// Files of those that were read, by their id in the scene.
    texture_files: Vec<PathBuf>,
    /// Prototypes by their files.
    prototypes: HashMap<Shapes, PrototypeId>,
    /// Files that were read, or tried.
    files: Vec<PathBuf>,
}

/// A material in use.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct UsedMaterial {
    /// The OBJ file that it comes from; `None` if it is the scene file's.
    obj: Option<PathBuf>,
    name: String,
    /// Indices of the patches of parts that change it.
    parts: Vec<u32>,
}

/// What an object's shape comes from.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Shapes {
    /// At time 0.
    open: Shape,
    /// At time 1, if that is another one.
    close: Option<Shape>,
    /// True if rays from the camera pass the object.
    is_hidden: bool,
}

/// An OBJ file, and how it is subdivided.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Shape {
    path: PathBuf,
    /// Steps of subdivision.
    steps: u32,
    /// Bits of the angle in degrees above which edges stay sharp.
    crease_angle: Option<u32>,
}

impl<'a> Loader<'a> {
    fn new(file: &'a SceneFile, builder: SceneBuilder, observer: &'a dyn LoadObserver, goes_on: bool) -> Self {
        let of = |object: &ObjectSection| {
            let shape = |name: &Spanned<PathBuf>| Shape {
                path: file.resolve(name.get_ref()),
                steps: value(&object.subdivision).unwrap_or(file.load.parameters.subdivision()),
                crease_angle: value(&object.crease_angle)
                    .or(file.load.parameters.crease_angle())
                    .map(f32::to_bits),
            };
            Shapes {
                open: shape(&object.obj),
                close: object.obj_close.as_ref().map(shape),
                is_hidden: value(&object.camera_visible) == Some(false),
            }
        };
        let shapes: Vec<Shapes> = file.object.iter().map(of).collect();
        let (mut copies, mut last_use) = (HashMap::new(), HashMap::new());
        for (index, shapes) in shapes.iter().enumerate() {
            let Shapes { open, close, .. } = shapes;
            let copies = copies.entry(shapes.clone()).or_insert(0);
            *copies += 1;
            // Copies share what the first one needs.
            if *copies == 1 {
                for shape in [Some(open), close.as_ref()].into_iter().flatten() {
                    last_use.insert(shape.clone(), index);
                }
            }
        }
        Self {
            file,
            builder,
            observer,
            allowance: Allowance {
                limit: MemoryLimit::of(file.load.max_memory),
                kept: 0,
            },
            shapes,
            copies,
            last_use,
            goes_on,
            findings: Findings::default(),
            used: HashMap::new(),
            materials: Vec::new(),
            patches: PatchList::default(),
            parts: Vec::new(),
            emits: HashMap::new(),
            light_groups: HashMap::new(),
            textures: Vec::new(),
            asked: Vec::new(),
            texture_dirs: Vec::new(),
            finder: FileFinder::default(),
            found_elsewhere: BTreeMap::new(),
            missing: BTreeMap::new(),
            undefined: BTreeMap::new(),
            named_maps: BTreeMap::new(),
            heights: HashMap::new(),
            untextured: BTreeMap::new(),
            load: file.load.clone(),
            part_fits: Vec::new(),
            texture_files: Vec::new(),
            prototypes: HashMap::new(),
            files: file
                .path()
                .filter(|_| !file.is_made())
                .map(Path::to_path_buf)
                .into_iter()
                .collect(),
        }
    }

    fn load(mut self) -> Inspection {
        let objs = self.load_objects();
        self.add_lights();
        self.add_textures();
        self.finish(objs)
    }

    /// [`Loader::load`], which keeps in `unlit` what building the scene again needs.
    fn load_keeping(mut self, unlit: &mut Option<Unlit>) -> Inspection {
        let objs = self.load_objects();
        let mut builder = self.builder.unlit();
        let (materials, findings) = (self.materials.len(), self.findings.iter().count());
        self.add_lights();
        let of_lights = findings..self.findings.iter().count();
        self.add_textures();
        builder.complete(&self.builder);
        *unlit = Some(Unlit {
            builder,
            findings: self.findings.without(of_lights),
            materials: self.materials[..materials].to_vec(),
            textures: self.texture_files.clone(),
            files: self.files.clone(),
        });
        self.finish(objs)
    }

    /// Builds the scene.
    fn finish(mut self, objs: Vec<ObjSource>) -> Inspection {
        let building = self.builder.building_bytes();
        if let Err(error) = self.allowance.check(Path::new(""), building) {
            let error = FileError {
                file: self.file.whole("").file,
                ..error
            };
            self.wrong("memory", error);
        }
        let mut inspection = Inspection {
            scene: None,
            findings: self.findings,
            materials: self.materials,
            objs,
            parts: self.load.parts,
            textures: self.texture_files,
            files: self.files,
        };
        let findings = &mut inspection.findings;
        if findings.first_error().is_some() && !self.goes_on {
            return inspection;
        }
        self.builder.panes(self.file.load.parameters.panes());
        self.observer.begin("building the scene", 1);
        match self.builder.build() {
            Ok((scene, mut report)) => {
                // Where files are missing, nothing is known of lights.
                report.default_light &= scene.triangle_count() > 0 || findings.first_error().is_none();
                // A light with an error is none of the scene.
                report.default_light &= self.file.light.is_empty();
                report.is_dark &= findings.first_error().is_none();
                report_findings(self.file, &report, &inspection.materials, findings);
                report_unseen(self.file, &scene, &report, &inspection.materials, findings);
                inspection.scene = Some(scene);
            }
            Err(error) => findings.add(Severity::Error, "scene", scene_error(self.file, &error)),
        }
        inspection
    }

    /// Whether something is wrong, and that ends it.
    fn is_over(&self) -> bool {
        !self.goes_on && self.findings.first_error().is_some()
    }

    /// Reads the files of objects.
    fn load_objects(&mut self) -> Vec<ObjSource> {
        match self.file.all_texture_dirs() {
            Ok(folders) => self.texture_dirs = folders,
            Err(error) => self.wrong("missing-folder", error),
        }
        for section in &self.file.light_group {
            if let Err(error) = section.add_to(&mut self.builder, &self.file.source, &mut self.light_groups) {
                self.wrong("wrong-light-group", error);
            }
        }
        match self.file.patches() {
            Ok(patches) => self.patches = PatchList::new(patches),
            Err(error) => self.wrong("wrong-material", error),
        }
        match self.file.part_patches() {
            Ok(parts) => self.parts = parts,
            Err(error) => self.wrong("wrong-part", error),
        }
        self.load.parts = self.file.part_filter(&self.parts);
        self.part_fits = vec![false; self.load.parts.globs().count()];
        // A file that several objects name is read once.
        let mut objs: BTreeMap<Shape, ObjFile> = BTreeMap::new();
        let mut tried = HashSet::new();
        let mut sources = Vec::new();
        for (index, object) in self.file.object.iter().enumerate() {
            let Shapes { open, close, .. } = self.shapes[index].clone();
            let names = [Some(&object.obj), object.obj_close.as_ref()];
            let shapes: Vec<Shape> = [Some(open), close].into_iter().flatten().collect();
            for (shape, name) in shapes.iter().zip(names.into_iter().flatten()) {
                if !tried.insert(shape.clone()) {
                    continue;
                }
                let path = shape.path.clone();
                let is_read = self.files.contains(&path);
                match self.read_shape(shape, object) {
                    Err(error) => self.wrong("unreadable-file", self.named_here(error, &path, name.span())),
                    Ok(mut obj) => {
                        for (fits, glob) in self.part_fits.iter_mut().zip(self.load.parts.globs()) {
                            *fits |= obj.parts.parts().any(|part| obj.parts.fits(part, glob));
                        }
                        let meshes = obj.groups.iter_mut().map(|group| &mut group.mesh);
                        self.builder.add_parts(std::mem::take(&mut obj.parts), meshes);
                        if !is_read {
                            self.files.push(path.clone());
                            self.files.extend(obj.libraries.iter().cloned());
                            sources.push(ObjSource::new(path, &obj));
                        }
                        self.allowance.kept += obj.groups.iter().map(|group| group.mesh.bytes() as u64).sum::<u64>();
                        objs.insert(shape.clone(), obj);
                    }
                }
            }
            if self.is_over() {
                return sources;
            }
            if shapes.iter().all(|shape| objs.contains_key(shape)) {
                if let Err(error) = self.add_object(index, object, &mut objs) {
                    self.wrong("wrong-object", error);
                }
            }
        }
        self.check_parts(&objs);
        for object in &self.file.made {
            if let Err(error) = self.add_made(object, &objs) {
                self.wrong("wrong-object", error);
            }
        }
        self.tell_of_undefined();
        self.tell_of_offers();
        self.make_visible();
        self.cut_sections(&objs);
        sources
    }

    /// Reads the OBJ file of an object.
    fn read_shape(&mut self, shape: &Shape, object: &ObjectSection) -> Result<ObjFile, FileError> {
        let subdivision = object.subdivision.as_ref().filter(|steps| *steps.get_ref() > MAX_STEPS);
        if let Some(steps) = subdivision {
            let message = format!("subdivision = {}", steps.get_ref());
            let error = self.file.error(steps.span(), message);
            return Err(error.help(format!("write a number of steps from 0 to {MAX_STEPS}")));
        }
        let mut options = self.load.clone();
        options.parameters.subdivision = Some(shape.steps);
        options.parameters.crease_angle = shape.crease_angle.map(f32::from_bits);
        let is_told = self.files.contains(&shape.path);
        let mut again = Findings::default();
        let findings = if is_told { &mut again } else { &mut self.findings };
        load_obj(&shape.path, &options, self.allowance, self.observer, findings)
    }

    /// Adds lights and the ground.
    fn add_lights(&mut self) {
        if self.is_over() {
            return;
        }
        for light in &self.file.light {
            let image = light.image.as_ref().map(|image| self.file.resolve(image.get_ref()));
            self.files.extend(image);
            if let Err(error) = light.add_to(
                &mut self.builder,
                &self.file.source,
                &mut self.allowance,
                &mut self.findings,
            ) {
                self.wrong("wrong-light", error);
            }
            // A lamp with a shape brings its material.
            let name = match light.kind.get_ref().as_str() {
                "sphere" => SPHERE_NAME,
                "disk" => DISK_NAME,
                _ => RECTANGLE_NAME,
            };
            let here = self.file.error(light.kind.span(), "");
            let place = here.position.map(|position| (here.file, position));
            self.materials
                .resize_with(self.builder.material_count(), || MaterialSource {
                    name: name.into(),
                    obj: None,
                    place: place.clone(),
                    found: FileMaterial::default_of(name),
                });
        }
        if let Some(ground) = &self.file.ground {
            if let Err(error) = self.builder.set_ground(ground.plane()) {
                self.wrong("wrong-ground", ground_error(self.file, &error));
            }
        }
    }

    /// Reads the textures.
    fn add_textures(&mut self) {
        if !self.is_over() {
            self.warn_of_idle_materials();
            self.load_textures();
        }
    }

    fn wrong(&mut self, code: &'static str, error: FileError) {
        self.findings.add(Severity::Error, code, error);
    }

    fn warn(&mut self, code: &'static str, error: FileError) {
        self.findings.add(Severity::Warning, code, error);
    }

    /// Says where the scene file names the file that could not be read.
    fn named_here(&self, error: FileError, path: &Path, span: Range<usize>) -> FileError {
        if error.position.is_some() || error.help.is_some() || !self.file.is_file() {
            return error.help_if_none("check the path");
        }
        let message = error.message.clone();
        self.file
            .error(span, format!("{}: {message}", path.display()))
            .help("check the path; it is relative to the scene file")
    }
}

/// An error of the `[ground]`, at the key that it is about.
fn ground_error(file: &SceneFile, error: &BuildError) -> FileError {
    let span = file.ground.as_ref().and_then(|ground| ground.place_of(error));
    let error = match span {
        Some(span) => file.error(span, error.to_string()),
        None => file.whole(error.to_string()),
    };
    error.help("correct the value, or leave the key out")
}

fn scene_error(file: &SceneFile, error: &BuildError) -> FileError {
    if matches!(error, BuildError::BadGround { .. }) {
        return ground_error(file, error);
    }
    file.whole(error.to_string()).help(match error {
        BuildError::TooSmall { .. } => {
            "scale it up, camera and lights too: `transform = { scale = ... }` of its objects"
        }
        BuildError::UnknownIrradiance | BuildError::TooManyLightsOfGround { .. } => {
            "use --no-ground, or light the scene with an environment or directional lights"
        }
        BuildError::BadPlacement { .. } => "correct the placement, or scale the object's own coordinates",
        _ => "split the scene, or remove a part of it",
    })
}

/// Sum of the shares of a surface up to which rounded statements may mean 1.
const MAX_ROUNDING: f32 = 1.01;

/// Reports what stands twice at one place.
fn report_repetitions(file: &SceneFile, report: &SceneReport, findings: &mut Findings) {
    for (code, noun, count) in [
        ("repeated-triangles", "triangles", report.repeated_triangles),
        ("repeated-instances", "instances", report.repeated_instances),
    ] {
        if count > 0 {
            let error = file.whole(format!("{noun} that repeat others at the same place, skipped: {count}"));
            findings.push(Finding::new(Severity::Warning, code, error).repeated(count, []));
        }
    }
    let emitters = report.coincident_emitters;
    if emitters.triangles > 0 {
        let noun = if emitters.triangles == 1 {
            "triangle lies"
        } else {
            "triangles lie"
        };
        let message = format!(
            "{} emitting {noun} on others: light sampling counts all of them, up to {} at one place, and rays find one",
            emitters.triangles, emitters.max_at_one_place
        );
        let error = file.whole(message).help("delete all but one of them");
        findings.add(Severity::Warning, "coincident-emitters", error);
    }
    if report.coincident_triangles > 0 {
        let count = report.coincident_triangles;
        let message = format!(
            "up to {count} triangles of different materials or objects lie at one place: each ray there is tested with all of them, and hits any of them"
        );
        let error = file.whole(message).help("delete all but one of them");
        findings.add(Severity::Warning, "coincident-triangles", error);
    }
}

fn report_findings(file: &SceneFile, report: &SceneReport, materials: &[MaterialSource], findings: &mut Findings) {
    if report.degenerate_triangles > 0 {
        let count = report.degenerate_triangles;
        let error = file.whole(format!("triangles without area, skipped: {count}"));
        findings.push(Finding::new(Severity::Warning, "degenerate-triangles", error).repeated(count, []));
    }
    let places: HashMap<&str, _> = materials.iter().map(|m| (m.name.as_str(), &m.place)).collect();
    // Statements have few digits.
    let told = report.scaled_materials.iter().filter(|(_, sum)| *sum > MAX_ROUNDING);
    for (name, sum) in told {
        let message = format!(
            "material `{}` reflects more light than it receives: {} times, in some channel; scaled to 1",
            excerpt_of_name(name),
            significant((*sum).into(), 4)
        );
        let error = match places.get(name.as_str()) {
            Some(Some((path, position))) => FileError::new(path, message).at(*position),
            _ => file.whole(message),
        };
        findings.add(Severity::Warning, "scaled-material", error);
    }
    if report.panes > 0 {
        let noun = if report.panes == 1 { "pane" } else { "panes" };
        let message = format!("Glass: {} {noun}, light passes straight", report.panes);
        let error = file
            .whole(message)
            .help("`panes = \"refract\"` in [render] keeps them as bodies");
        findings.add(Severity::Note, "glass-panes", error);
    }
    if report.rectangles > 0 {
        let noun = if report.rectangles == 1 {
            "rectangle"
        } else {
            "rectangles"
        };
        let message = format!(
            "Lights: {} {noun} of two triangles, each sampled as one light",
            report.rectangles
        );
        let error = file
            .whole(message)
            .help("`triangle_sampling = \"solid-angle\"` in [render] samples their triangles");
        findings.add(Severity::Note, "rectangle-lights", error);
    }
    report_repetitions(file, report, findings);
    if report.degenerate_emitters > 0 {
        let noun = match report.degenerate_emitters {
            1 => "1 emitting triangle has".into(),
            count => format!("{count} emitting triangles have"),
        };
        let error = file.whole(format!("{noun} no area in 32-bit floats, and gives no light"));
        let error = error.help("scale them up, move them closer to the origin, or use a sphere light");
        findings.add(Severity::Warning, "lost-emitter", error);
    }
    if report.is_dark {
        let error = file.whole("no light of the scene emits: the picture is black");
        let error =
            error.help("set their radiance, intensity or irradiance above 0, or remove them for the default light");
        findings.add(Severity::Warning, "no-light", error);
    }
    if report.default_light {
        let message = "nothing in the scene emits light; it is lit by a constant white environment of radiance 1";
        findings.add(Severity::Note, DEFAULT_LIGHT, file.whole(message));
    }
}
