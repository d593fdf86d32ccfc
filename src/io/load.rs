use super::FileError;
use super::find_file::find_file;
use super::mtl::{MapRequest, MtlDialect, MtlMaterial, default_material};
use super::mtl_map::MapSlot;
use super::obj::{Group, ObjFile, load_obj};
use super::placement::{Place, place};
use super::scene_file::{ObjectSection, SceneFile};
use super::texture::{TextureKind, TextureRequest, load_textures};
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::material::{Map, Material, MaterialId};
use crate::math::Affine3A;
use crate::scene::{BuildError, PrototypeId, Scene, SceneBuilder, SceneReport};
use crate::texture::{Channel, TextureId};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Name of the material of faces that name none.
const DEFAULT_MATERIAL: &str = "default";
/// Unused materials that are named in warnings, each with its line; more of them are only counted.
const MAX_NAMED: usize = 100;

/// How files are read where their formats leave something open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// What `Tr` means.
    pub mtl_dialect: MtlDialect,
    /// Edges between facets that meet at less than so many degrees are smooth; `None` goes by the file's normals.
    pub smooth: Option<f32>,
}

/// A scene read from files.
#[derive(Debug)]
pub struct Loaded {
    /// The frozen scene.
    pub scene: Scene,
    /// What was missing, repaired or assumed, in sentences.
    pub warnings: Vec<String>,
}

/// Reads everything that `file` names and builds the scene with `builder`, which may hold parts and settings already.
pub fn load_scene(file: &SceneFile, builder: SceneBuilder) -> Result<Loaded, FileError> {
    let mut loader = Loader {
        file,
        builder,
        warnings: Vec::new(),
        used: HashMap::new(),
        textures: Vec::new(),
        asked: Vec::new(),
        prototypes: HashMap::new(),
        shared: HashSet::new(),
    };
    let mut seen = HashSet::new();
    for object in &file.object {
        if let Some(again) = seen.replace(loader.shapes(object)) {
            loader.shared.insert(again);
        }
    }
    // A file that several objects name is read once.
    let mut objs: BTreeMap<PathBuf, ObjFile> = BTreeMap::new();
    for object in &file.object {
        for name in [Some(&object.obj), object.obj_close.as_ref()].into_iter().flatten() {
            let path = file.resolve(name.get_ref());
            if let Entry::Vacant(entry) = objs.entry(path) {
                let read = load_obj(entry.key(), &file.options);
                let mut obj = read.map_err(|error| loader.named_here(error, entry.key(), name.span()))?;
                loader.warnings.append(&mut obj.warnings);
                entry.insert(obj);
            }
        }
        loader.add_object(object, &objs)?;
    }
    for light in &file.light {
        light.add_to(&mut loader.builder, file)?;
    }
    loader.warn_of_unused_materials();
    loader.load_textures();

    let (scene, report) = loader.builder.build().map_err(|e| scene_error(file, &e))?;
    loader.warnings.extend(report_warnings(&report));
    Ok(Loaded {
        scene,
        warnings: loader.warnings,
    })
}

struct Loader<'a> {
    file: &'a SceneFile,
    builder: SceneBuilder,
    warnings: Vec<String>,
    /// Materials handed to the builder, by the OBJ they come from (`None`: from the scene file) and name.
    used: HashMap<(Option<PathBuf>, String), MaterialId>,
    /// Textures that they ask for, and where they do so.
    textures: Vec<TextureRequest>,
    asked: Vec<MapRequest>,
    /// Prototypes by their files.
    prototypes: HashMap<Shapes, PrototypeId>,
    /// The files of several objects.
    shared: HashSet<Shapes>,
}

/// The files that an object's shape comes from: at time 0, and at time 1 where that is another one.
type Shapes = (PathBuf, Option<PathBuf>);

impl Loader<'_> {
    fn add_object(&mut self, object: &ObjectSection, objs: &BTreeMap<PathBuf, ObjFile>) -> Result<(), FileError> {
        let place = place(self.file, object)?;
        let shapes = self.shapes(object);
        let is_shared = self.shared.contains(&shapes);
        let path = &shapes.0;
        let refused = |error: BuildError| {
            FileError::new(path, error.to_string()).help("scale the object down, or export it again")
        };

        // What has one place stands in the world there; all else is kept once.
        let transform = match &place {
            _ if is_shared => None,
            Place::AsItIs => Some(None),
            Place::Once(transform) => Some(Some(*transform)),
            Place::Instances(_) => None,
        };
        if let Some(transform) = transform {
            for (mesh, material) in self.meshes_of(object, objs)? {
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
                let meshes = self.meshes_of(object, objs)?;
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

    fn shapes(&self, object: &ObjectSection) -> Shapes {
        let path = |name: &Spanned<PathBuf>| self.file.resolve(name.get_ref());
        (path(&object.obj), object.obj_close.as_ref().map(path))
    }

    /// The meshes of an object with their materials, as its files have them.
    fn meshes_of(
        &mut self,
        object: &ObjectSection,
        objs: &BTreeMap<PathBuf, ObjFile>,
    ) -> Result<Vec<(Mesh, MaterialId)>, FileError> {
        let (path, close) = self.shapes(object);
        let obj = &objs[&path];
        let mut meshes = Vec::with_capacity(obj.groups.len());
        for (i, group) in obj.groups.iter().enumerate() {
            let mut mesh = group.mesh.clone();
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
            meshes.push((mesh, self.material_of(group, &path, obj)?));
        }
        Ok(meshes)
    }

    /// The scene file's material of the group's name, else that of the OBJ's libraries, else the default one.
    fn material_of(&mut self, group: &Group, path: &Path, obj: &ObjFile) -> Result<MaterialId, FileError> {
        let name = group.material.as_deref().unwrap_or(DEFAULT_MATERIAL);
        let section = self.file.material.get_key_value(name);
        let source = section.is_none().then(|| path.to_path_buf());
        if let Some(&id) = self.used.get(&(source.clone(), name.to_string())) {
            return Ok(id);
        }
        let material = match section {
            Some((_, section)) => section.material(name, self.file)?,
            // The last definition of a name wins, as it would in a program that reads the file top to bottom.
            None => match obj.material(name) {
                Some(found) => self.textured(found),
                None => {
                    let default = default_material(name);
                    if let Some(name) = &group.material {
                        self.warnings.push(format!(
                            "{}: material `{name}` is not defined; it is rendered as `{DEFAULT_MATERIAL}` \
                             (diffuse {:.1})\n  help: define it in the MTL file, or as [material.\"{name}\"] in a scene file",
                            path.display(),
                            default.diffuse.max_component(),
                        ));
                    }
                    default
                }
            },
        };
        let id = self.builder.add_material(material).map_err(|error| match section {
            Some((key, _)) => self.file.error(key.span(), error.to_string()).help("correct the value"),
            None => FileError::new(path, error.to_string()).help("correct the material in its library"),
        })?;
        self.used.insert((source, name.to_string()), id);
        Ok(id)
    }

    /// The material of a library with maps that name requests for textures.
    fn textured(&mut self, found: &MtlMaterial) -> Material {
        let mut material = found.material.clone();
        for request in &found.maps {
            let statement = &request.statement;
            let folder = request.library.parent().unwrap_or(Path::new(""));
            let (kind, slot) = match statement.slot {
                MapSlot::Diffuse => (TextureKind::Color, &mut material.maps.diffuse),
                MapSlot::Specular => (TextureKind::Color, &mut material.maps.specular),
                MapSlot::Exponent => (TextureKind::Value(Channel::Luminance), &mut material.maps.exponent),
                MapSlot::Opacity => (TextureKind::Value(Channel::Opacity), &mut material.maps.opacity),
                MapSlot::Bump => (TextureKind::Value(Channel::Luminance), &mut material.maps.bump),
                MapSlot::Normal => (TextureKind::Normal, &mut material.maps.normal),
                MapSlot::Roughness => (TextureKind::Value(Channel::Luminance), &mut material.maps.roughness),
                MapSlot::Metallic => (TextureKind::Value(Channel::Luminance), &mut material.maps.metallic),
                MapSlot::Emission => {
                    self.warnings.push(request.remark("has no effect yet").to_string());
                    continue;
                }
            };
            let kind = match (kind, statement.mapping.channel) {
                (TextureKind::Value(_), Some(channel)) => TextureKind::Value(channel),
                _ => kind,
            };
            match find_file(folder, &statement.file) {
                Some(path) => {
                    *slot = Some(Map {
                        texture: TextureId(self.textures.len() as u32),
                        mapping: statement.mapping,
                    });
                    let wrap = statement.mapping.wrap;
                    self.textures.push(TextureRequest { path, kind, wrap });
                    self.asked.push(request.clone());
                }
                None => {
                    let missing = request.remark("is missing; the material's constant counts alone");
                    self.warnings.push(missing.help("put the file there").to_string());
                    if statement.slot == MapSlot::Diffuse && material.diffuse == Spectrum::ONE {
                        material.diffuse = default_material("").diffuse;
                    }
                }
            }
        }
        material
    }

    fn load_textures(&mut self) {
        let loaded = load_textures(&self.textures);
        self.warnings.extend(loaded.warnings);
        let mut ids = Vec::with_capacity(loaded.ids.len());
        for (result, request) in loaded.ids.into_iter().zip(&self.asked) {
            ids.push(
                result
                    .map_err(|error| {
                        let unread = request.remark("cannot be used; the material's constant counts alone");
                        self.warnings.push(format!("{unread}\n  {error}"));
                    })
                    .ok(),
            );
        }
        self.builder.set_textures(loaded.textures, &ids);
    }

    fn warn_of_unused_materials(&mut self) {
        let is_unused = |key: &&Spanned<String>| !self.used.contains_key(&(None, key.get_ref().clone()));
        let unused: Vec<&Spanned<String>> = self.file.material.keys().filter(is_unused).collect();
        for key in unused.iter().take(MAX_NAMED) {
            let warning = self
                .file
                .error(key.span(), format!("no face uses the material `{}`", key.get_ref()))
                .help("its name must be that of a `usemtl` line");
            self.warnings.push(warning.to_string());
        }
        if unused.len() > MAX_NAMED {
            let more = unused.len() - MAX_NAMED;
            self.warnings
                .push(format!("no face uses {more} other materials of the scene file"));
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

fn scene_error(file: &SceneFile, error: &BuildError) -> FileError {
    let path = file
        .object
        .first()
        .map(|o| o.obj.get_ref().as_path())
        .unwrap_or(Path::new(""));
    FileError::new(path, error.to_string()).help("leave some of it out")
}

fn report_warnings(report: &SceneReport) -> Vec<String> {
    let mut warnings = Vec::new();
    if report.degenerate_triangles > 0 {
        warnings.push(format!(
            "{} triangles have no area and are left out",
            report.degenerate_triangles
        ));
    }
    for (name, largest) in &report.scaled_materials {
        warnings.push(format!(
            "material `{name}` scatters {largest} of the light in some channel; all its lobes are divided by that"
        ));
    }
    if report.default_light {
        warnings
            .push("nothing in the scene emits light; it is lit by a constant white environment of radiance 1".into());
    }
    warnings
}
