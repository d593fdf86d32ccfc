//! Reads the files that a scene file names, and builds the scene. `inspect_scene` collects all
//! findings. `load_scene` ends at the first error.
//!
//! `shapes` reads OBJ files, `objects` places meshes, `materials` finds their materials, and
//! `textures` reads the pictures of materials.

mod beside;
mod cuts;
mod displacement;
mod library_mistakes;
mod materials;
mod named_maps;
mod normals_as_color;
mod objects;
mod parts;
mod picture_names;
mod picture_roles;
mod preview;
mod reports;
mod shapes;
mod texture_reports;
mod textures;
mod unmapped;
mod unseen;

use super::file::SceneFile;
use super::find_file::FileFinder;
use super::memory::Allowance;
use super::mtl::{FileMaterial, MapRequest};
use super::part_section::PartSection;
use super::patches::{Patch, PatchList};
use super::texture::TextureRequest;
use super::{FileError, Finding, Findings, LoadObserver, MemoryLimit, Severity, Warning};
use crate::io::LoadOptions;
use crate::light::LightGroupId;
use crate::lint::{DEFAULT_MATERIAL, Inspection, MaterialSource, ObjSource};
use crate::material::MaterialId;
use crate::scene::{PrototypeId, Scene, SceneBuilder, UnlitBuilder, lamp_name};
use materials::{UndefinedMaterials, UntexturedMaterials};
use named_maps::NamedMaps;
use reports::{ground_error, report_findings, scene_error};
use shapes::{Shapes, SubdividedFile};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use textures::MaterialTexture;
use unmapped::UnmappedTriangles;
use unseen::report_unseen;

/// A scene read from files.
#[derive(Debug)]
pub struct LoadedScene {
    /// The frozen scene.
    pub scene: Scene,
    /// Warnings about missing data, repairs and assumptions.
    pub warnings: Vec<Warning>,
    /// All files that were read. The program must not overwrite them.
    pub files: Vec<PathBuf>,
}

/// Reads all files that `file` names and builds the scene with `builder`. `builder` may already
/// have parts and settings. Returns the first error.
pub fn load_scene(file: &SceneFile, builder: SceneBuilder) -> Result<LoadedScene, FileError> {
    load_scene_watched(file, builder, &())
}

/// Like [`load_scene`], but reports the progress to `observer`.
pub fn load_scene_watched(
    file: &SceneFile,
    builder: SceneBuilder,
    observer: &dyn LoadObserver,
) -> Result<LoadedScene, FileError> {
    loaded_of(Loader::new(file, builder, observer, false).load())
}

/// The scene, or the first error.
fn loaded_of(inspection: Inspection) -> Result<LoadedScene, FileError> {
    let Inspection {
        scene, findings, files, ..
    } = inspection;
    let warnings = findings.warnings();
    match (findings.first_error(), scene) {
        (None, Some(scene)) => Ok(LoadedScene { scene, warnings, files }),
        (Some(error), _) => Err(error.clone()),
        (None, None) => Err(FileError::new(Path::new(""), "there is no scene")),
    }
}

/// Like [`load_scene_watched`], but also returns the data to build the scene again with other
/// lights.
pub(crate) fn load_scene_to_light(
    file: &SceneFile,
    builder: SceneBuilder,
    observer: &dyn LoadObserver,
) -> Result<(LoadedScene, UnlitScene), FileError> {
    let mut unlit = None;
    let loader = Loader::new(file, builder, observer, false);
    let loaded = loaded_of(loader.load_keeping(&mut unlit))?;
    let unlit = unlit.ok_or_else(|| FileError::new(Path::new(""), "there is no scene"))?;
    Ok((loaded, unlit))
}

/// A scene that was read, without its lights, ground, triangles and textures.
pub(crate) struct UnlitScene {
    builder: UnlitBuilder,
    findings: Findings,
    materials: Vec<MaterialSource>,
    textures: Vec<PathBuf>,
    files: Vec<PathBuf>,
}

impl UnlitScene {
    /// The scene with the lights and the ground of `file`, and with the triangles and textures of
    /// `scene`. Except for lights and ground, `file` must equal the scene file that was read
    /// before. Returns `None` if the triangles or textures of `scene` differ from the triangles or
    /// textures that were read before.
    pub fn lit(
        self,
        file: &SceneFile,
        scene: Scene,
        observer: &dyn LoadObserver,
    ) -> Result<Option<LoadedScene>, FileError> {
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

/// Reads a scene like [`load_scene`], but continues after errors.
pub fn inspect_scene(file: &SceneFile, builder: SceneBuilder) -> Inspection {
    Loader::new(file, builder, &(), true).load()
}

struct Loader<'a> {
    file: &'a SceneFile,
    builder: SceneBuilder,
    observer: &'a dyn LoadObserver,
    /// Memory that loading may still use.
    allowance: Allowance,
    /// OBJ files of each object.
    shapes: Vec<Shapes>,
    /// Number of objects that use the same OBJ files.
    copies: HashMap<Shapes, usize>,
    /// Index of the last object that needs a file. The file is dropped after this object.
    last_use: HashMap<SubdividedFile, usize>,
    findings: Findings,
    /// True if loading continues after errors.
    continues_after_errors: bool,
    /// Materials that were already added to the builder.
    used: HashMap<UsedMaterial, MaterialId>,
    materials: Vec<MaterialSource>,
    /// Patches of materials, from the scene file and from flags.
    patches: PatchList<'a>,
    /// True if a patch has changed a material.
    has_patched: bool,
    /// Patches of parts, from the scene file and from flags.
    parts: Vec<Patch<'a, PartSection>>,
    /// Names of used materials. The value is true if any used material of this name emits.
    emits: HashMap<String, bool>,
    /// Light group of each material name.
    light_groups: HashMap<String, LightGroupId>,
    /// Requests of materials for textures, in the order of the requests.
    textures: Vec<TextureRequest>,
    material_textures: Vec<MaterialTexture>,
    /// Folders to search for textures.
    texture_dirs: Vec<PathBuf>,
    finder: FileFinder,
    /// Textures that were found at a path other than the written path. The key has the file that
    /// names the textures, and the folder in which they were found.
    found_elsewhere: BTreeMap<(PathBuf, PathBuf), Vec<(MapRequest, PathBuf)>>,
    /// Missing textures with their uses. The key has the file that names the texture, and the
    /// texture's name.
    missing: BTreeMap<(PathBuf, String), Vec<texture_reports::MissingUse>>,
    /// Materials of each OBJ file that no library defines.
    undefined: BTreeMap<PathBuf, UndefinedMaterials>,
    /// Textures near each OBJ file, found by their names.
    named_maps: BTreeMap<PathBuf, NamedMaps>,
    /// Names of the first parts of each OBJ file.
    part_names: BTreeMap<PathBuf, Vec<String>>,
    /// Missing textures for which a picture with the name of the OBJ file is used, by the file that
    /// names them and by the picture.
    stand_ins: BTreeMap<(PathBuf, PathBuf), Vec<MapRequest>>,
    /// Colour textures in place of pictures that are normal maps: `None` inside if there is no such
    /// texture, and `None` for pictures that are no normal maps.
    normals_as_color: HashMap<PathBuf, Option<Option<PathBuf>>>,
    /// Height maps of materials that displace their surfaces.
    heights: HashMap<MaterialId, Option<displacement::DisplacementMap>>,
    /// Numbers of triangles without texture coordinates, by the OBJ file and the name of their
    /// textured material.
    unmapped: BTreeMap<(PathBuf, String), UnmappedTriangles>,
    /// Keys in `unmapped` of the materials for these triangles.
    unmapped_materials: HashMap<MaterialId, (PathBuf, String)>,
    /// Materials without texture of each OBJ file with texture coordinates.
    untextured: BTreeMap<PathBuf, UntexturedMaterials>,
    /// Options for reading OBJ files.
    load: LoadOptions,
    /// For each pattern of part names: true if it matches a part in any file.
    part_fits: Vec<bool>,
    /// Paths of the textures that were read. The index is the texture's id in the scene.
    texture_files: Vec<PathBuf>,
    /// Prototypes. The key has the OBJ files of the object.
    prototypes: HashMap<Shapes, PrototypeId>,
    /// All files that were read, or that could not be read.
    files: Vec<PathBuf>,
}

/// Key of a material in use. Materials of the same name differ by their OBJ file, or by patches of
/// parts.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct UsedMaterial {
    /// OBJ file from whose library the material comes; `None` if it comes from the scene file.
    obj: Option<PathBuf>,
    name: String,
    /// Indices of the part patches that change the material.
    parts: Vec<u32>,
    /// True if the material has textures, but the faces have no texture coordinates. Each texture
    /// is then replaced by its mean.
    lacks_uvs: bool,
}

impl<'a> Loader<'a> {
    fn new(
        file: &'a SceneFile,
        builder: SceneBuilder,
        observer: &'a dyn LoadObserver,
        continues_after_errors: bool,
    ) -> Self {
        let shapes: Vec<Shapes> = file.object.iter().map(|object| Shapes::of(file, object)).collect();
        let (mut copies, mut last_use) = (HashMap::new(), HashMap::new());
        for (index, shapes) in shapes.iter().enumerate() {
            let Shapes { open, close, .. } = shapes;
            let copies = copies.entry(shapes.clone()).or_insert(0);
            *copies += 1;
            // Copies use the data of the first object, so only the first object needs the files
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
            continues_after_errors,
            findings: Findings::default(),
            used: HashMap::new(),
            materials: Vec::new(),
            patches: PatchList::default(),
            has_patched: false,
            parts: Vec::new(),
            emits: HashMap::new(),
            light_groups: HashMap::new(),
            textures: Vec::new(),
            material_textures: Vec::new(),
            texture_dirs: Vec::new(),
            finder: FileFinder::default(),
            found_elsewhere: BTreeMap::new(),
            missing: BTreeMap::new(),
            undefined: BTreeMap::new(),
            named_maps: BTreeMap::new(),
            part_names: BTreeMap::new(),
            stand_ins: BTreeMap::new(),
            normals_as_color: HashMap::new(),
            heights: HashMap::new(),
            unmapped: BTreeMap::new(),
            unmapped_materials: HashMap::new(),
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

    /// Like [`Loader::load`], but also stores in `unlit` the data to build the scene again with
    /// other lights.
    fn load_keeping(mut self, unlit: &mut Option<UnlitScene>) -> Inspection {
        let objs = self.load_objects();
        let mut builder = self.builder.unlit();
        let (materials, findings) = (self.materials.len(), self.findings.iter().count());
        self.add_lights();
        let of_lights = findings..self.findings.iter().count();
        self.add_textures();
        builder.complete(&self.builder);
        *unlit = Some(UnlitScene {
            builder,
            findings: self.findings.without(of_lights),
            materials: self.materials[..materials].to_vec(),
            textures: self.texture_files.clone(),
            files: self.files.clone(),
        });
        self.finish(objs)
    }

    /// Builds the scene from the objects that were added, and returns it with all findings.
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
        if findings.first_error().is_some() && !self.continues_after_errors {
            return inspection;
        }
        self.builder.panes(self.file.load.parameters.panes());
        self.observer.begin("building the scene", 1);
        match self.builder.build() {
            Ok((scene, mut report)) => {
                // If there were errors, lights may be missing: do not report default light
                report.default_light &= scene.triangle_count() > 0 || findings.first_error().is_none();
                // A light section with an error is not in the scene: do not report default light
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

    /// Returns true if loading must end because of an error.
    fn is_over(&self) -> bool {
        !self.continues_after_errors && self.findings.first_error().is_some()
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
            // A light with a shape gets a material. Choose the name of this material
            let name = lamp_name(light.kind.get_ref());
            let here = self.file.error(light.kind.span(), "");
            let place = here.position.map(|position| (here.file, position));
            self.materials
                .resize_with(self.builder.material_count(), || MaterialSource {
                    name: name.clone(),
                    obj: None,
                    place: place.clone(),
                    found: FileMaterial::default_of(&name),
                });
        }
        if let Some(ground) = &self.file.ground {
            if let Err(error) = self.builder.set_ground(ground.plane()) {
                self.wrong("wrong-ground", ground_error(self.file, &error));
            }
        }
    }

    /// Reads the textures of all materials.
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
}
