//! Numbers of subdivision steps that depend on the camera (`subdivision = "pixels:1.5"`). The
//! session computes these numbers from the edges of the objects before subdivision ([`Cage`]), and
//! writes them into a copy of the scene file.

use super::placement::place;
use super::section::value;
use super::{FileError, ObjectSection, SceneFile, WrittenSubdivision};
use crate::geometry::Placement;
use crate::io::{Cage, ObjReader, Subdivision};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use toml::Spanned;

/// Code of the note about objects whose number of subdivision steps depends on the camera.
pub(crate) const LEVELS: &str = "subdivision-by-pixels";

/// An object whose number of subdivision steps depends on the camera.
pub(crate) struct ObjectCage {
    /// Index of the object in the scene file.
    pub object: usize,
    /// Maximum length of an edge in pixels.
    pub pixels: f32,
    /// Edges before subdivision, at time 0.
    pub open: Arc<Cage>,
    /// Edges at time 1, if the vertices move.
    pub close: Option<Arc<Cage>>,
    /// Placements of all copies.
    pub placements: Vec<Placement>,
}

impl SceneFile {
    /// Subdivision of `object`, by its own key or by the option for all objects.
    pub(super) fn subdivision_of(&self, object: &ObjectSection) -> Subdivision {
        let own = value(&object.subdivision).map(|WrittenSubdivision(own)| own);
        own.unwrap_or(self.load.parameters.subdivision())
    }

    /// Objects whose number of subdivision steps depends on the camera, each with the maximum
    /// length of an edge in pixels.
    pub(super) fn objects_by_pixels(&self) -> impl Iterator<Item = (&ObjectSection, f32)> {
        let pixels_of = |object| Some((object, self.subdivision_of(object).pixels()?));
        self.object.iter().filter_map(pixels_of)
    }

    /// Returns true if the number of subdivision steps of an object depends on the camera.
    pub(crate) fn has_levels_by_pixels(&self) -> bool {
        self.objects_by_pixels().next().is_some()
    }

    /// Cages of the objects whose number of subdivision steps depends on the camera. An object
    /// with an error is left out: loading the scene finds the same error, and reports its place.
    ///
    /// # Errors
    ///
    /// A section `[part]` is invalid, the OBJ reader does not read polygons, or there is too little
    /// memory.
    pub(crate) fn cages(&self) -> Result<Vec<ObjectCage>, FileError> {
        if self.load.parameters.obj_reader() == ObjReader::Tobj {
            let error = self
                .whole("the OBJ reader `tobj` reads no polygons, which subdivision needs")
                .of_flag();
            return Err(error.help("use --obj-reader own"));
        }
        let mut options = self.load.clone();
        options.parts = self.part_filter(&self.part_patches()?);
        let mut known: BTreeMap<PathBuf, Option<Arc<Cage>>> = BTreeMap::new();
        let mut kept = 0;
        let mut read = |path: PathBuf| -> Result<Option<Arc<Cage>>, FileError> {
            if let Some(cage) = known.get(&path) {
                return Ok(cage.clone());
            }
            let cage = Cage::read(&path, &options, kept)?.map(Arc::new);
            kept += cage.as_ref().map_or(0, |cage| cage.bytes());
            known.insert(path, cage.clone());
            Ok(cage)
        };
        let mut cages = Vec::new();
        for (index, object) in self.object.iter().enumerate() {
            let Some(pixels) = self.subdivision_of(object).pixels() else {
                continue;
            };
            let open = read(self.resolve(object.obj.get_ref()))?;
            let close = object.obj_close.as_ref().map(|name| self.resolve(name.get_ref()));
            let close = close.map_or(Ok(None), &mut read)?;
            if let (Some(open), Ok(place)) = (open, place(self, object)) {
                cages.push(ObjectCage {
                    object: index,
                    pixels,
                    open,
                    close,
                    placements: place.into_placements(),
                });
            }
        }
        Ok(cages)
    }

    /// Copy of the scene file in which no number of subdivision steps depends on the camera.
    /// `levels` has the number of steps of an object by the object's index. If the number of an
    /// object depends on the camera and is not in `levels`, the object gets 0 steps.
    pub(crate) fn with_levels(&self, levels: &BTreeMap<usize, u32>) -> Self {
        let mut file = self.clone();
        for (index, object) in file.object.iter_mut().enumerate() {
            let level = levels.get(&index).copied();
            if level.is_some() || self.subdivision_of(object).pixels().is_some() {
                let level = WrittenSubdivision(Subdivision::Steps(level.unwrap_or(0)));
                object.subdivision = Some(Spanned::new(0..0, level));
            }
        }
        let of_all = &mut file.load.parameters.subdivision;
        *of_all = of_all.filter(|of_all| of_all.pixels().is_none());
        file.options.load.subdivision = *of_all;
        file
    }
}
