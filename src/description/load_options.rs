use super::{FileError, LoadOptions, SceneFile, named};
use crate::io::MtlDialect;
use crate::texture::TextureFilter;

impl LoadOptions {
    /// What `[render]` says of them.
    pub(super) fn of(file: &SceneFile) -> Result<Self, FileError> {
        let render = &file.render;
        let smooth = render.smooth.as_ref();
        if let Some(degrees) = smooth.filter(|degrees| !Self::is_angle(*degrees.get_ref())) {
            let error = file.error(degrees.span(), format!("smooth = {}", degrees.get_ref()));
            return Err(error.help("use a number above 0"));
        }
        Ok(Self {
            mtl_dialect: named(file, "mtl-dialect", &render.mtl_dialect, MtlDialect::NAMES)?.unwrap_or_default(),
            smooth: smooth.map(|degrees| *degrees.get_ref()),
            texture_filter: named(file, "texture-filter", &render.texture_filter, TextureFilter::NAMES)?
                .unwrap_or_default(),
            max_memory: None,
            strict: false,
        })
    }
}
