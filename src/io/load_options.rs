use super::{FileError, MtlDialect, SceneFile, named};
use crate::texture::TextureFilter;

/// How files are read where their formats leave something open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// What `Tr` means.
    pub mtl_dialect: MtlDialect,
    /// Edges between facets that meet at less than so many degrees are smooth; `None` goes by the file's normals.
    pub smooth: Option<f32>,
    /// How textures are looked up.
    pub texture_filter: TextureFilter,
    /// Bytes that reading may take at most; `None` for all there are.
    pub max_memory: Option<u64>,
}

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
        })
    }

    /// Whether edges can be smoothed by so many degrees.
    pub(crate) fn is_angle(degrees: f32) -> bool {
        degrees > 0.0 && degrees.is_finite()
    }
}
