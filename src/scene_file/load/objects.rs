//! Adds the objects of a scene to the builder: meshes with materials and placements.

use super::{Loader, Shapes, SubdividedFile};
use crate::geometry::Mesh;
use crate::io::VertexColors;
use crate::material::MaterialId;
use crate::math::excerpt_of_name;
use crate::scene::BuildError;
use crate::scene_file::FileError;
use crate::scene_file::MadeObject;
use crate::scene_file::obj::{Group, ObjFile, Twins};
use crate::scene_file::object_section::{Instances, ObjectSection};
use crate::scene_file::placement::{ObjectPlacement, place};
use std::collections::BTreeMap;
use toml::Spanned;

impl Loader<'_> {
    pub(super) fn add_object(
        &mut self,
        index: usize,
        object: &ObjectSection,
        objs: &mut BTreeMap<SubdividedFile, ObjFile>,
    ) -> Result<(), FileError> {
        if let Some(Instances::File(list)) = object.instances.as_ref().map(Spanned::get_ref) {
            self.files.push(self.file.resolve(list));
        }
        let place = place(self.file, object)?;
        let stem = object.obj.get_ref().file_stem().unwrap_or_default().to_string_lossy();
        let name = object.name.as_ref().map(|name| name.get_ref().as_str());
        self.builder.begin_object(name.unwrap_or(&stem));
        let shapes = self.shapes[index].clone();
        let is_shared = self.copies.get(&shapes).is_some_and(|&copies| copies > 1);
        let path = &shapes.open.path;
        let refused = |error: BuildError| {
            FileError::new(path, error.to_string()).help(match error {
                BuildError::TooSmall { .. } => {
                    "scale the vertices of the object up, and the matrices of its instances down"
                }
                _ => "scale the object down, or export it again",
            })
        };

        // Objects with one placement are added in world space. Other objects are added once, as
        // prototypes.
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
                    Some(transform) => mesh.transformed(transform),
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

    /// Adds a mesh that was made in code. Its material may be in the libraries of `objs`.
    pub(super) fn add_made(
        &mut self,
        object: &MadeObject,
        objs: &BTreeMap<SubdividedFile, ObjFile>,
    ) -> Result<(), FileError> {
        self.builder.begin_object(&object.name);
        let group = Group {
            material: object.material.clone(),
            line: 0,
            rules: Vec::new(),
            mesh: Mesh::clone(&object.mesh),
            twins: Twins::default(),
        };
        let material = self.material_in(&group, objs);
        self.builder.add_mesh(group.mesh, material).map_err(|error| {
            let error = self
                .file
                .whole(format!("object `{}`: {error}", excerpt_of_name(&object.name)));
            error.help("correct the arrays of the mesh")
        })
    }

    /// Meshes of an object with their materials. The meshes are removed from `objs` if no later
    /// object needs them.
    fn meshes_of(
        &mut self,
        index: usize,
        object: &ObjectSection,
        objs: &mut BTreeMap<SubdividedFile, ObjFile>,
    ) -> Result<Vec<(Mesh, MaterialId)>, FileError> {
        let Shapes {
            open: shape,
            close,
            is_hidden,
        } = self.shapes[index].clone();
        let is_last = self.last_use.get(&shape) == Some(&index) && close.as_ref() != Some(&shape);
        let mut taken = Vec::new();
        if let Some(obj) = objs.get_mut(&shape).filter(|_| is_last) {
            taken.extend(obj.groups.iter_mut().map(|group| std::mem::take(&mut group.mesh)));
        }
        let (obj, path) = (&objs[&shape], shape.path.clone());
        let mut taken = taken.into_iter();
        let mut meshes = Vec::with_capacity(obj.groups.len());
        for (i, group) in obj.groups.iter().enumerate() {
            let mut mesh = taken.next().unwrap_or_else(|| group.mesh.clone());
            if let (Some(close), Some(name)) = (&close, &object.obj_close) {
                let last = objs[close].groups.get(i).filter(|last| {
                    last.mesh.triangles == mesh.triangles && last.mesh.positions.len() == mesh.positions.len()
                });
                let Some(last) = last else {
                    let message = format!(
                        "the faces of {} differ from those of {}",
                        close.path.display(),
                        path.display()
                    );
                    let error = self.file.error(name.span(), message);
                    return Err(
                        error.help("both files must have the same faces in the same order; only vertices may move")
                    );
                };
                mesh.positions_close = last.mesh.positions.clone();
                mesh.normals_close = last.mesh.normals.clone();
            }
            let material = self.material_of(group, &mesh, &path, obj);
            let is_auto = self.file.load.parameters.vertex_colors() == VertexColors::Auto;
            if is_auto && !mesh.colors.is_empty() && self.builder.has_diffuse_map(material) {
                mesh.colors = Vec::new();
            }
            let fronts = self.separate_twins(group, &mut mesh, material);
            meshes.push((mesh, material));
            meshes.extend(fronts.map(|fronts| (fronts, material)));
        }
        self.displace_object(&mut meshes, &path, shape.steps > 0)?;
        if is_hidden {
            for (_, material) in &mut meshes {
                *material = self.builder.hidden_material(*material);
            }
            self.list_materials();
        }
        Ok(meshes)
    }

    /// Moves the faces of lamps that lie on the back of each other apart, so that each side shows
    /// the face whose front it sees. Faces that are not opaque are removed from `mesh` and returned
    /// as another mesh, which rays from behind pass: light would else pass two surfaces.
    fn separate_twins(&self, group: &Group, mesh: &mut Mesh, material: MaterialId) -> Option<Mesh> {
        if group.twins.pairs.is_empty() {
            return None;
        }
        if mesh.alphas.is_empty() && self.builder.is_opaque_lamp(material) {
            group.twins.move_apart(mesh);
            return None;
        }
        let is_lamp = self.builder.is_lamp_without_transmission(material);
        is_lamp.then(|| group.twins.split_off(mesh))
    }
}
