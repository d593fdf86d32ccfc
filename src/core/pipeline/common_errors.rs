//! Correlation of an integrator's errors between pixels. The renderer writes this correlation to
//! image files as `embrasure.commonErrors`, and `compare/significance` reads it.

use crate::compare::CommonErrors;
use crate::options::{ChosenIntegrator, PathReuse};

impl ChosenIntegrator {
    /// Errors that pixels of an image have in common, for significance tests.
    pub fn common_errors(&self) -> CommonErrors {
        match self {
            _ if self.repeats_directions() => CommonErrors::Picture,
            Self::Path(settings) if settings.reuse == PathReuse::Pixels => CommonErrors::Tile,
            Self::Path(_)
            | Self::Naive(_)
            | Self::OneSample(_)
            | Self::Area(_)
            | Self::Whitted(_)
            | Self::Distributed(_)
            | Self::Direct(_)
            | Self::AmbientOcclusion(_)
            | Self::Debug(_) => CommonErrors::None,
            // A light path reaches few pixels, but photons within a fixed radius may reach many
            // pixels.
            Self::VertexMerging(settings) if settings.photon_radius.is_some() => CommonErrors::Sample,
            Self::Light(_) | Self::Bidirectional(_) | Self::VertexMerging(_) => CommonErrors::Tile,
            Self::PrimarySpace(_) | Self::PathSpace(_) | Self::ProgressivePhotons(_) => CommonErrors::Sample,
            Self::PhotonMap(_) | Self::IrradianceCache(_) => CommonErrors::Picture,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{IntegratorKind, IntegratorOptions};

    #[test]
    fn options_decide_which_errors_pixels_have_in_common() {
        use IntegratorKind::{Direct, Path, PhotonMap, ProgressivePhotons, VertexMerging};
        let of = |kind, reuse, photon_radius| {
            let options = IntegratorOptions {
                integrator: Some(kind),
                reuse: Some(reuse),
                photon_radius,
                ..IntegratorOptions::default()
            };
            ChosenIntegrator::new(&options).common_errors()
        };
        for (kind, reuse, radius, expected) in [
            (Path, PathReuse::Pixels, None, CommonErrors::Tile),
            (Path, PathReuse::None, None, CommonErrors::None),
            (Direct, PathReuse::Pixels, None, CommonErrors::None),
            (VertexMerging, PathReuse::Pixels, None, CommonErrors::Tile),
            (VertexMerging, PathReuse::Pixels, Some(0.1), CommonErrors::Sample),
            (ProgressivePhotons, PathReuse::Pixels, None, CommonErrors::Sample),
            (PhotonMap, PathReuse::Pixels, None, CommonErrors::Picture),
        ] {
            assert_eq!(of(kind, reuse, radius), expected);
        }
    }
}
