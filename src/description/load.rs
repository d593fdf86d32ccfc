//! Loading a scene: reads the files that a scene file names, and builds the scene. `inspect_scene` collects all findings, and `load_scene` ends with
//! the first error.

use super::find_file::{case_differs, find_file};
use super::light_group_section::idle_members;
use super::memory::Allowance;
use super::mtl::{FileMaterial, MapRequest, MapSlot, default_material};
use super::obj::{Group, ObjFile, load_obj};
use super::placement::{ObjectPlacement, place};
use super::scene_file::{Instances, ObjectSection, SceneFile};
use super::texture::{TextureKind, TextureRequest, load_textures_within};
use super::{FileError, Finding, Findings, LoadObserver, MemoryLimit, Position, Severity};
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::light::LightGroupId;
use crate::material::{Map, Material, MaterialId};
use crate::math::Affine3A;
use crate::scene::{BuildError, PrototypeId, Scene, SceneBuilder, SceneReport};
use crate::texture::{Channel, TextureId};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Name of the material of faces that name none.
pub const DEFAULT_MATERIAL: &str = "default";
/// Unused materials that are named in warnings, each with its line; more of them are only counted.
const MAX_NAMED: usize = 100;

/// A scene read from files.
#[derive(Debug)]
pub struct Loaded {
    /// The frozen scene.
    pub scene: Scene,
    /// What was missing, repaired or assumed, in sentences.
    pub warnings: Vec<String>,
    /// All files that were read; nothing may be written over them.
    pub files: Vec<PathBuf>,
}

/// What the files of a scene say, wrong or not.
#[derive(Debug)]
pub struct Inspection {
    /// The scene as far as it can be had: what is wrong is left out of it, or replaced by a default.
    pub scene: Option<Scene>,
    /// What is wrong, missing, repaired or assumed, in the order in which it was found.
    pub findings: Findings,
    /// The scene's materials, by their id.
    pub materials: Vec<MaterialSource>,
    /// The OBJ files that could be read.
    pub objs: Vec<ObjSource>,
    /// Files of the scene's textures, by their id.
    pub textures: Vec<PathBuf>,
    /// All files that were read; nothing may be written over them.
    pub files: Vec<PathBuf>,
}

/// Where a material of the scene is from.
#[derive(Clone, Debug)]
pub struct MaterialSource {
    /// Its name.
    pub name: String,
    /// The OBJ file whose faces use it; `None` where it is the scene file's and thus that of all of them.
    pub obj: Option<PathBuf>,
    /// Where it is defined; `None` for the default one.
    pub place: Option<(PathBuf, Position)>,
}

/// An OBJ file of the scene, and what its libraries define.
#[derive(Clone, Debug)]
pub struct ObjSource {
    /// The file.
    pub path: PathBuf,
    /// Names of materials, in the order of their libraries, with library and line.
    pub materials: Vec<(String, PathBuf, usize)>,
}

impl ObjSource {
    fn new(path: PathBuf, obj: &ObjFile) -> Self {
        let named = |m: &FileMaterial| (m.material.name.clone(), m.library.clone(), m.line);
        let materials = obj.materials.iter().map(named).collect();
        Self { path, materials }
    }
}

/// Reads everything that `file` names and builds the scene with `builder`, which may hold parts and settings already. What is wrong first is the
/// error.
pub fn load_scene(file: &SceneFile, builder: SceneBuilder) -> Result<Loaded, FileError> {
    load_scene_watched(file, builder, &())
}

/// The same; `observer` is told how far it is.
pub fn load_scene_watched(
    file: &SceneFile,
    builder: SceneBuilder,
    observer: &dyn LoadObserver,
) -> Result<Loaded, FileError> {
    let Inspection {
        scene, findings, files, ..
    } = Loader::new(file, builder, observer, false).load();
    let warnings = findings.warnings();
    match (findings.first_error(), scene) {
        (None, Some(scene)) => Ok(Loaded { scene, warnings, files }),
        (Some(error), _) => Err(error.clone()),
        (None, None) => Err(FileError::new(Path::new(""), "there is no scene")),
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
    /// How many objects have these files.
    copies: HashMap<Shapes, usize>,
    /// The last object for which a file is needed.
    last_use: HashMap<PathBuf, usize>,
    findings: Findings,
    /// Whether to go on after what is wrong.
    goes_on: bool,
    /// Materials handed to the builder, by the OBJ they come from (`None`: from the scene file) and name.
    used: HashMap<(Option<PathBuf>, String), MaterialId>,
    materials: Vec<MaterialSource>,
    /// Whether any material of this name emits, of those that are used.
    emits: HashMap<String, bool>,
    /// The group of lights that materials of this name are in.
    light_groups: HashMap<String, LightGroupId>,
    /// Textures that they ask for, and where they do so.
    textures: Vec<TextureRequest>,
    asked: Vec<MapRequest>,
    /// Files of those that were read, by their id in the scene.
    texture_files: Vec<PathBuf>,
    /// Prototypes by their files.
    prototypes: HashMap<Shapes, PrototypeId>,
    /// Files that were read, or tried.
    files: Vec<PathBuf>,
}

/// The files that an object's shape comes from: at time 0, and at time 1 where that is another one.
type Shapes = (PathBuf, Option<PathBuf>);

impl<'a> Loader<'a> {
    fn new(file: &'a SceneFile, builder: SceneBuilder, observer: &'a dyn LoadObserver, goes_on: bool) -> Self {
        let path = |name: &Spanned<PathBuf>| file.resolve(name.get_ref());
        let of = |object: &ObjectSection| (path(&object.obj), object.obj_close.as_ref().map(path));
        let shapes: Vec<Shapes> = file.object.iter().map(of).collect();
        let (mut copies, mut last_use) = (HashMap::new(), HashMap::new());
        for (index, (obj, close)) in shapes.iter().enumerate() {
            let copies = copies.entry((obj.clone(), close.clone())).or_insert(0);
            *copies += 1;
            // Copies share what the first one needs.
            if *copies == 1 {
                for path in [Some(obj), close.as_ref()].into_iter().flatten() {
                    last_use.insert(path.clone(), index);
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
            emits: HashMap::new(),
            light_groups: HashMap::new(),
            textures: Vec::new(),
            asked: Vec::new(),
            texture_files: Vec::new(),
            prototypes: HashMap::new(),
            files: file.path().into_iter().map(Path::to_path_buf).collect(),
        }
    }

    fn load(mut self) -> Inspection {
        let objs = self.load_parts();
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
            textures: self.texture_files,
            files: self.files,
        };
        let findings = &mut inspection.findings;
        if findings.first_error().is_some() && !self.goes_on {
            return inspection;
        }
        match self.builder.build() {
            Ok((scene, mut report)) => {
                // Where files are missing, nothing is known of lights.
                report.default_light &= scene.triangle_count() > 0 || findings.first_error().is_none();
                report_findings(self.file, &report, &inspection.materials, findings);
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

    fn load_parts(&mut self) -> Vec<ObjSource> {
        for section in &self.file.light_group {
            if let Err(error) = section.add_to(&mut self.builder, self.file, &mut self.light_groups) {
                self.wrong("wrong-light-group", error);
            }
        }
        // A file that several objects name is read once.
        let mut objs: BTreeMap<PathBuf, ObjFile> = BTreeMap::new();
        let mut tried = HashSet::new();
        let mut sources = Vec::new();
        for (index, object) in self.file.object.iter().enumerate() {
            let names: Vec<_> = [Some(&object.obj), object.obj_close.as_ref()]
                .into_iter()
                .flatten()
                .collect();
            for name in &names {
                let path = self.file.resolve(name.get_ref());
                if !tried.insert(path.clone()) {
                    continue;
                }
                match load_obj(
                    &path,
                    &self.file.load,
                    self.allowance,
                    self.observer,
                    &mut self.findings,
                ) {
                    Err(error) => self.wrong("unreadable-file", self.named_here(error, &path, name.span())),
                    Ok(obj) => {
                        self.files.push(path.clone());
                        self.files.extend(obj.libraries.iter().cloned());
                        sources.push(ObjSource::new(path.clone(), &obj));
                        self.allowance.kept += obj.groups.iter().map(|group| group.mesh.bytes() as u64).sum::<u64>();
                        objs.insert(path, obj);
                    }
                }
            }
            if self.is_over() {
                return sources;
            }
            if names
                .iter()
                .all(|name| objs.contains_key(&self.file.resolve(name.get_ref())))
            {
                if let Err(error) = self.add_object(index, object, &mut objs) {
                    self.wrong("wrong-object", error);
                }
            }
        }
        for light in &self.file.light {
            let image = light.image.as_ref().map(|image| self.file.resolve(image.get_ref()));
            self.files.extend(image);
            if let Err(error) = light.add_to(&mut self.builder, self.file, &mut self.allowance) {
                self.wrong("wrong-light", error);
            }
        }
        if let Some(ground) = &self.file.ground {
            if let Err(error) = self.builder.set_ground(ground.plane()) {
                self.wrong("wrong-ground", ground_error(self.file, &error));
            }
        }
        if !self.is_over() {
            self.warn_of_idle_materials();
            self.load_textures();
        }
        sources
    }

    fn wrong(&mut self, code: &'static str, error: FileError) {
        self.findings.add(Severity::Error, code, error);
    }

    /// Tells of a file that a render could do without.
    fn lacks(&mut self, code: &'static str, error: FileError) {
        self.findings.add(self.file.load.severity_of_lack(), code, error);
    }

    fn warn(&mut self, code: &'static str, error: FileError) {
        self.findings.add(Severity::Warning, code, error);
    }
}

impl Loader<'_> {
    fn add_object(
        &mut self,
        index: usize,
        object: &ObjectSection,
        objs: &mut BTreeMap<PathBuf, ObjFile>,
    ) -> Result<(), FileError> {
        if let Some(Instances::File(list)) = object.instances.as_ref().map(Spanned::get_ref) {
            self.files.push(self.file.resolve(list));
        }
        let place = place(self.file, object)?;
        let stem = object.obj.get_ref().file_stem().unwrap_or_default().to_string_lossy();
        self.builder.begin_object(object.name.as_deref().unwrap_or(&stem));
        let shapes = self.shapes[index].clone();
        let is_shared = self.copies.get(&shapes).is_some_and(|&copies| copies > 1);
        let path = &shapes.0;
        let refused = |error: BuildError| {
            FileError::new(path, error.to_string()).help(match error {
                BuildError::TooSmall { .. } => "scale its vertices up, and the matrices of its instances down",
                _ => "scale the object down, or export it again",
            })
        };

        // What has one place stands in the world there; all else is kept once.
        let transform = match &place {
            _ if is_shared => None,
            ObjectPlacement::AsItIs => Some(None),
            ObjectPlacement::Once(transform) => Some(Some(*transform)),
            ObjectPlacement::Instances(_) => None,
        };
        if let Some(transform) = transform {
            for (mesh, material) in self.meshes_of(index, object, objs)? {
                let mesh = match transform {
                    None => mesh,
                    Some(transform) => transformed(&mesh, transform),
                };
                self.builder.add_mesh(mesh, material).map_err(refused)?;
            }
            return Ok(());
        }
        let prototype = match self.prototypes.get(&shapes) {
            Some(&prototype) => prototype,
            None => {
                let meshes = self.meshes_of(index, object, objs)?;
                let prototype = self.builder.add_prototype(meshes).map_err(refused)?;
                self.prototypes.insert(shapes.clone(), prototype);
                prototype
            }
        };
        for placement in place.into_placements() {
            let added = self.builder.add_instance(prototype, placement);
            added.map_err(|error| {
                let refused = self.file.error(object.obj.span(), error.to_string());
                refused.help("correct the object's placement")
            })?;
        }
        Ok(())
    }

    /// The meshes of an object with their materials, as its files have them: taken out of `objs` where no later object needs them.
    fn meshes_of(
        &mut self,
        index: usize,
        object: &ObjectSection,
        objs: &mut BTreeMap<PathBuf, ObjFile>,
    ) -> Result<Vec<(Mesh, MaterialId)>, FileError> {
        let (path, close) = self.shapes[index].clone();
        let is_last = self.last_use.get(&path) == Some(&index) && close.as_ref() != Some(&path);
        let mut taken = Vec::new();
        if let Some(obj) = objs.get_mut(&path).filter(|_| is_last) {
            taken.extend(obj.groups.iter_mut().map(|group| std::mem::take(&mut group.mesh)));
        }
        let obj = &objs[&path];
        let mut taken = taken.into_iter();
        let mut meshes = Vec::with_capacity(obj.groups.len());
        for (i, group) in obj.groups.iter().enumerate() {
            let mut mesh = taken.next().unwrap_or_else(|| group.mesh.clone());
            if let (Some(close), Some(name)) = (&close, &object.obj_close) {
                let last = objs[close].groups.get(i).filter(|last| {
                    last.mesh.triangles == mesh.triangles && last.mesh.positions.len() == mesh.positions.len()
                });
                let Some(last) = last else {
                    let message = format!("{} has other faces than {}", close.display(), path.display());
                    let error = self.file.error(name.span(), message);
                    return Err(error.help("both must have the same faces in the same order; only vertices may move"));
                };
                mesh.positions_close = last.mesh.positions.clone();
                mesh.normals_close = last.mesh.normals.clone();
            }
            meshes.push((mesh, self.material_of(group, &path, obj)));
        }
        Ok(meshes)
    }

    /// The scene file's material of the group's name, else that of the OBJ's libraries, else the default one.
    fn material_of(&mut self, group: &Group, path: &Path, obj: &ObjFile) -> MaterialId {
        let file = self.file;
        let name = group.material.as_deref().unwrap_or(DEFAULT_MATERIAL);
        let section = file.material.get_key_value(name);
        let source = section.is_none().then(|| path.to_path_buf());
        if let Some(&id) = self.used.get(&(source.clone(), name.to_string())) {
            return id;
        }
        let (material, place) = match section {
            Some((key, section)) => {
                let here = file.error(key.span(), "");
                let place = here.position.map(|position| (here.file, position));
                match section.material(name, file) {
                    Ok(found) => (self.textured(&found), place),
                    Err(error) => {
                        self.wrong("wrong-material", error);
                        (default_material(name), place)
                    }
                }
            }
            // The last definition of a name wins, as it would in a program that reads the file top to bottom.
            None => match obj.material(name) {
                Some(found) => {
                    let place = (found.library.clone(), Position::line(found.line));
                    (self.textured(found), Some(place))
                }
                None => {
                    let default = default_material(name);
                    if let Some(name) = &group.material {
                        let message = format!(
                            "material `{name}` is not defined; it is rendered as `{DEFAULT_MATERIAL}` (diffuse {:.1})",
                            default.diffuse.max_component(),
                        );
                        let help = format!("define it in the MTL file, or as [material.\"{name}\"] in a scene file");
                        let error = FileError::new(path, message).at(Position::line(group.line));
                        self.warn("missing-material", error.help(help));
                    }
                    (default, None)
                }
            },
        };
        *self.emits.entry(name.to_string()).or_default() |= !material.emission_factor().is_black();
        let added = self.builder.add_material(material).or_else(|error| {
            let error = match section {
                Some((key, _)) => file.error(key.span(), error.to_string()).help("correct the value"),
                None => FileError::new(path, error.to_string()).help("correct the material in its library"),
            };
            self.wrong("wrong-material", error);
            self.builder.add_material(default_material(name))
        });
        // A default material is never refused.
        let id = added.unwrap_or(MaterialId(0));
        if let Some(&group) = self.light_groups.get(name) {
            self.builder.group_material(id, group);
        }
        self.used.insert((source.clone(), name.to_string()), id);
        self.materials.push(MaterialSource {
            name: name.to_string(),
            obj: source,
            place,
        });
        id
    }

    /// The material of a file with maps that name requests for textures.
    fn textured(&mut self, found: &FileMaterial) -> Material {
        let mut material = found.material.clone();
        for request in &found.maps {
            let statement = &request.statement;
            let folder = request.place.file.parent().unwrap_or(Path::new(""));
            let (kind, slot) = match statement.slot {
                MapSlot::Diffuse => (TextureKind::Color, &mut material.maps.diffuse),
                MapSlot::Specular => (TextureKind::Color, &mut material.maps.specular),
                MapSlot::Emission => (TextureKind::Color, &mut material.maps.emission),
                MapSlot::Exponent => (TextureKind::Value(Channel::Luminance), &mut material.maps.exponent),
                MapSlot::Opacity => (TextureKind::Value(Channel::Opacity), &mut material.maps.opacity),
                MapSlot::Bump => (TextureKind::Value(Channel::Luminance), &mut material.maps.bump),
                MapSlot::Normal => (TextureKind::Normal, &mut material.maps.normal),
                MapSlot::Roughness => (TextureKind::Value(Channel::Luminance), &mut material.maps.roughness),
                MapSlot::Metallic => (TextureKind::Value(Channel::Luminance), &mut material.maps.metallic),
            };
            let kind = match (kind, statement.mapping.channel) {
                (TextureKind::Value(_), Some(channel)) => TextureKind::Value(channel),
                _ => kind,
            };
            match find_file(folder, &statement.file) {
                Some(path) => {
                    if case_differs(folder, &statement.file, &path) || statement.file.contains('\\') {
                        let found = request.remark(&format!("is found as {}", path.display()));
                        let help = "write its name as it is: other programs and systems may not find it";
                        self.findings.add(Severity::Note, "other-case", found.help(help));
                    }
                    *slot = Some(Map {
                        texture: TextureId(self.textures.len() as u32),
                        mapping: statement.mapping,
                    });
                    let wrap = statement.mapping.wrap;
                    self.textures.push(TextureRequest { path, kind, wrap });
                    self.asked.push(request.clone());
                }
                None => {
                    let is_folder = folder.join(&statement.file).is_dir();
                    let (what, help) = match is_folder {
                        true => ("is a directory", "name a picture in it"),
                        false => ("is missing", "put the file there"),
                    };
                    let missing = request.remark(&format!("{what}; the material's constant counts alone"));
                    self.lacks("missing-texture", missing.help(help));
                    if statement.slot == MapSlot::Diffuse && material.diffuse == Spectrum::ONE {
                        material.diffuse = default_material("").diffuse;
                    }
                }
            }
        }
        material
    }

    fn load_textures(&mut self) {
        self.files
            .extend(self.textures.iter().map(|texture| texture.path.clone()));
        let loaded = match load_textures_within(&self.textures, self.allowance, self.observer) {
            Ok(loaded) => loaded,
            Err(error) => {
                let mut asked = self.asked.iter().zip(&self.textures);
                let request = asked
                    .find(|(_, texture)| texture.path == error.file)
                    .map(|(request, _)| request);
                let words = format!("cannot be used: {}: {}", error.place(), error.message);
                let placed = request.map(|request| FileError {
                    help: error.help.clone(),
                    ..request.remark(&words)
                });
                return self.wrong("memory", placed.unwrap_or(error));
            }
        };
        for warning in loaded.warnings {
            self.warn("bad-texels", warning);
        }
        let mut ids = Vec::with_capacity(loaded.ids.len());
        for ((result, request), file) in loaded.ids.into_iter().zip(&self.asked).zip(&self.textures) {
            // Ids are given in the order of the first requests.
            if matches!(result, Ok(TextureId(id)) if id as usize == self.texture_files.len()) {
                self.texture_files.push(file.path.clone());
            }
            if let Err(error) = &result {
                let (place, message) = (error.place(), &error.message);
                // What the system did not give may be sound: it is not replaced.
                let severity = match error.unreadable {
                    true => Severity::Error,
                    false => self.file.load.severity_of_lack(),
                };
                let instead = match severity {
                    Severity::Error => "",
                    _ => "; the material's constant counts alone",
                };
                let mut unread = request.remark(&format!("cannot be used{instead}: {place}: {message}"));
                unread.help.clone_from(&error.help);
                self.findings.add(severity, "unreadable-texture", unread);
            }
            ids.push(result.ok());
        }
        self.builder.set_textures(loaded.textures, &ids);
        self.builder.texture_filter(self.file.load.parameters.texture_filter());
    }

    /// Says which names of materials in the scene file are of no use.
    fn warn_of_idle_materials(&mut self) {
        let file = self.file;
        let is_unused = |key: &&Spanned<String>| !self.used.contains_key(&(None, key.get_ref().clone()));
        let unused: Vec<_> = file.material.keys().filter(is_unused).collect();
        let idle = idle_members(file, &self.emits);
        for key in unused.iter().take(MAX_NAMED) {
            let warning = file.error(key.span(), format!("no face uses the material `{}`", key.get_ref()));
            self.warn(
                "unused-material",
                warning.help("its name must be that of a `usemtl` line"),
            );
        }
        self.warn_of_more("unused-material", "no face uses", unused.len());
        for (name, why) in idle.iter().take(MAX_NAMED) {
            let message = format!("material `{}` is in a light group, but {why}", name.get_ref());
            let warning = file.error(name.span(), message);
            self.warn("idle-light-group", warning.help("correct the name, or take it out"));
        }
        self.warn_of_more("idle-light-group", "no light comes from", idle.len());
    }

    /// Says how many materials beyond those that were named `words` hold of.
    fn warn_of_more(&mut self, code: &'static str, words: &str, count: usize) {
        if count > MAX_NAMED {
            let more = count - MAX_NAMED;
            self.warn(code, self.file.whole(format!("{words} {more} other materials")));
        }
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

/// The mesh in its place. Mirroring transforms swap the winding, so that the front stays the front.
fn transformed(mesh: &Mesh, transform: Affine3A) -> Mesh {
    let mirrored = transform.matrix3.determinant() < 0.0;
    // Normals are planes: they go by the inverse transpose.
    let of_normals = transform.matrix3.inverse().transpose();
    Mesh {
        positions: mesh.positions.iter().map(|&p| transform.transform_point3a(p)).collect(),
        triangles: match mirrored {
            false => mesh.triangles.clone(),
            true => mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        },
        normals: mesh.normals.iter().map(|&n| (of_normals * n).normalize_or(n)).collect(),
        uvs: mesh.uvs.clone(),
        positions_close: mesh
            .positions_close
            .iter()
            .map(|&p| transform.transform_point3a(p))
            .collect(),
        normals_close: mesh
            .normals_close
            .iter()
            .map(|&n| (of_normals * n).normalize_or(n))
            .collect(),
    }
}

/// An error of the `[ground]`, at the key that it is about.
fn ground_error(file: &SceneFile, error: &BuildError) -> FileError {
    let span = file.ground.as_ref().and_then(|ground| ground.span_of(error));
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
        BuildError::BadPlacement { .. } => "correct the placement, or scale the object's own coordinates",
        BuildError::UnknownIrradiance | BuildError::TooManyLightsOfGround { .. } => {
            "render without it (--no-ground), or light the scene by an environment or by directional lights"
        }
        _ => "leave some of it out",
    })
}

fn report_findings(file: &SceneFile, report: &SceneReport, materials: &[MaterialSource], findings: &mut Findings) {
    if report.degenerate_triangles > 0 {
        let count = report.degenerate_triangles;
        let error = file.whole(format!("triangles that have no area and are left out: {count}"));
        findings.push(Finding::new(Severity::Warning, "degenerate-triangles", error).repeated(count, []));
    }
    let places: HashMap<&str, _> = materials.iter().map(|m| (m.name.as_str(), &m.place)).collect();
    for (name, largest) in &report.scaled_materials {
        let message = format!(
            "material `{name}` scatters {largest} of the light in some channel; all its lobes are divided by that"
        );
        let error = match places.get(name.as_str()) {
            Some(Some((path, position))) => FileError::new(path, message).at(*position),
            _ => file.whole(message),
        };
        findings.add(Severity::Warning, "scaled-material", error);
    }
    if report.default_light {
        let message = "nothing in the scene emits light; it is lit by a constant white environment of radiance 1";
        findings.add(Severity::Note, "default-light", file.whole(message));
    }
}
