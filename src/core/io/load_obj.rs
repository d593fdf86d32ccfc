//! OBJ files, read with the reader that the user chooses.

use super::normals::smooth_by_angle;
use super::obj::{self, ObjFile};
#[cfg(feature = "tobj")]
use super::tobj_reader;
use super::{FileError, Findings, LoadObserver, LoadOptions, ObjReader};
use crate::files::memory::Allowance;
use rayon::prelude::*;
use std::path::Path;

/// Reads an OBJ file and its libraries with the reader of the options, in the current rayon pool.
/// Returns an error only if the file cannot be used at all. Everything else that is wrong, missing
/// or assumed is added to the findings.
pub fn load_obj(
    path: &Path,
    options: &LoadOptions,
    allowance: Allowance,
    observer: &dyn LoadObserver,
    findings: &mut Findings,
) -> Result<ObjFile, FileError> {
    let mut file = match options.parameters.obj_reader() {
        ObjReader::Own => {
            let changes = obj::Changes {
                origin: obj::chosen_origin(path, options),
                moves_apart: true,
            };
            obj::read_obj(path, options, changes, allowance, observer, findings)?
        }
        ObjReader::Tobj if !options.parts.is_empty() => {
            let error = FileError::new(
                path,
                "the OBJ reader `tobj` reads no parts, which --hide, --only and [part] need",
            )
            .of_flag();
            return Err(error.help("use --obj-reader own"));
        }
        ObjReader::Tobj if options.parameters.subdivision().steps() > 0 => {
            let error =
                FileError::new(path, "the OBJ reader `tobj` reads no polygons, which subdivision needs").of_flag();
            return Err(error.help("use --obj-reader own"));
        }
        ObjReader::Tobj if options.parameters.line_width().is_some() => {
            let error = FileError::new(
                path,
                "the OBJ reader `tobj` reads no lines and points, which line_width renders",
            )
            .of_flag();
            return Err(error.help("use --obj-reader own"));
        }
        #[cfg(feature = "tobj")]
        ObjReader::Tobj => tobj_reader::read_obj(path, options, allowance, observer, findings)?,
        #[cfg(not(feature = "tobj"))]
        ObjReader::Tobj => {
            let error = FileError::new(path, "the OBJ reader `tobj` is not built in").of_flag();
            return Err(error.help("use --obj-reader own, or build with the feature tobj"));
        }
    };
    if let Some(degrees) = options.parameters.smooth() {
        file.groups
            .par_iter_mut()
            .for_each(|g| smooth_by_angle(&mut g.mesh, degrees));
    }
    Ok(file)
}
