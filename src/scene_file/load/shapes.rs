//! Reads the OBJ files of objects.

use super::{Finding, Loader, Severity};
use crate::io::Subdivision;
use crate::lint::ObjSource;
use crate::parameter::Value;
use crate::scene_file::file::SceneFile;
use crate::scene_file::levels::LEVELS;
use crate::scene_file::load_obj::load_obj;
use crate::scene_file::obj::ObjFile;
use crate::scene_file::object_section::ObjectSection;
use crate::scene_file::patches::PatchList;
use crate::scene_file::section::value;
use crate::scene_file::{FileError, Findings};
use std::collections::{BTreeMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// OBJ files of an object, at both ends of its motion.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Shapes {
    /// OBJ file at time 0.
    pub open: SubdividedFile,
    /// OBJ file at time 1, if it differs from the file at time 0.
    pub close: Option<SubdividedFile>,
    /// True if rays from the camera pass through the object.
    pub is_hidden: bool,
}

/// An OBJ file with the settings of its subdivision.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct SubdividedFile {
    pub path: PathBuf,
    /// Number of subdivision steps.
    pub steps: u32,
    /// Angle in degrees above which edges stay sharp, as the bits of its float.
    pub crease_angle: Option<u32>,
}

/// Maximum number of parts of an OBJ file whose names are compared with names of pictures.
const MAX_PART_NAMES: usize = 64;

impl Shapes {
    /// OBJ files of `object` in the scene file `file`.
    pub fn of(file: &SceneFile, object: &ObjectSection) -> Self {
        let parameters = &file.load.parameters;
        let shape = |name: &Spanned<PathBuf>| SubdividedFile {
            path: file.resolve(name.get_ref()),
            steps: file.subdivision_of(object).steps(),
            crease_angle: value(&object.crease_angle)
                .or(parameters.crease_angle())
                .map(f32::to_bits),
        };
        Self {
            open: shape(&object.obj),
            close: object.obj_close.as_ref().map(shape),
            is_hidden: value(&object.camera_visible) == Some(false),
        }
    }
}

impl Loader<'_> {
    /// Reads the OBJ files of all objects.
    pub(super) fn load_objects(&mut self) -> Vec<ObjSource> {
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
        self.load.may_emit = self.file.may_emit(&self.parts);
        self.part_fits = vec![false; self.load.parts.globs().count()];
        // Read a file that several objects use only once
        let mut objs: BTreeMap<SubdividedFile, ObjFile> = BTreeMap::new();
        let mut tried = HashSet::new();
        let mut sources = Vec::new();
        for (index, object) in self.file.object.iter().enumerate() {
            let Shapes { open, close, .. } = self.shapes[index].clone();
            let names = [Some(&object.obj), object.obj_close.as_ref()];
            let shapes: Vec<SubdividedFile> = [Some(open), close].into_iter().flatten().collect();
            for (shape, name) in shapes.iter().zip(names.into_iter().flatten()) {
                if !tried.insert(shape.clone()) {
                    continue;
                }
                let path = shape.path.clone();
                let is_read = self.files.contains(&path);
                match self.read_shape(shape) {
                    Err(error) => self.wrong("unreadable-file", self.named_here(error, &path, name.span())),
                    Ok(mut obj) => {
                        for (fits, glob) in self.part_fits.iter_mut().zip(self.load.parts.globs()) {
                            *fits |= obj.parts.parts().any(|part| obj.parts.fits(part, glob));
                        }
                        let parts = obj.parts.parts().take(MAX_PART_NAMES);
                        let names = parts.map(|part| obj.parts.name(part).into_owned());
                        self.part_names.insert(path.clone(), names.collect());
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
        self.report_levels();
        self.check_parts(&objs);
        for object in &self.file.made {
            if let Err(error) = self.add_made(object, &objs) {
                self.wrong("wrong-object", error);
            }
        }
        self.report_undefined();
        self.report_unmapped();
        self.report_offers();
        self.make_visible();
        self.lighten_black();
        self.cut_sections(&objs);
        sources
    }

    /// Adds a note if the number of subdivision steps of an object depends on the camera: the
    /// loader has no camera.
    fn report_levels(&mut self) {
        let Some((object, pixels)) = self.file.objects_by_pixels().next() else {
            return;
        };
        let text = Subdivision::Pixels(pixels).text();
        let message = format!(
            "subdivision {text} is not applied here, since the number of steps depends on the camera of a render"
        );
        let error = FileError::new(&self.file.resolve(object.obj.get_ref()), message);
        let error = error.help("use --subdivide 3 for a fixed number of steps");
        let count = self.file.objects_by_pixels().count() as u64;
        let finding = Finding::new(Severity::Note, LEVELS, error);
        self.findings.push(finding.repeated(count, []));
    }

    /// Reads the OBJ file of an object.
    fn read_shape(&mut self, shape: &SubdividedFile) -> Result<ObjFile, FileError> {
        let mut options = self.load.clone();
        options.parameters.subdivision = Some(Subdivision::Steps(shape.steps));
        options.parameters.crease_angle = shape.crease_angle.map(f32::from_bits);
        let is_told = self.files.contains(&shape.path);
        let mut again = Findings::default();
        let findings = if is_told { &mut again } else { &mut self.findings };
        load_obj(&shape.path, &options, self.allowance, self.observer, findings)
    }

    /// Adds to `error` the place in the scene file that names `path`, if the file cannot be read.
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
