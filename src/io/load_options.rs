use super::{MtlDialect, Severity};
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
    /// Bytes that the render, and reading its files, may take at most; `None` for what the system leaves.
    pub max_memory: Option<u64>,
    /// Whether files that are missing or cannot be used are errors where a render could do without them.
    pub strict: bool,
}

impl LoadOptions {
    /// How bad it is that a file is missing, or cannot be used, which a render could do without.
    pub(crate) fn severity_of_lack(&self) -> Severity {
        if self.strict {
            Severity::Error
        } else {
            Severity::Warning
        }
    }

    /// Whether edges can be smoothed by so many degrees.
    pub(crate) fn is_angle(degrees: f32) -> bool {
        degrees > 0.0 && degrees.is_finite()
    }
}
