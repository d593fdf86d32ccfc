use super::{Estimator, IntegratorKind};
use crate::compare::CommonErrors;

impl Estimator {
    /// Which errors pixels of a picture have in common.
    pub fn common_errors(&self) -> CommonErrors {
        match self.kind {
            IntegratorKind::Path if self.reuse => CommonErrors::Tile,
            IntegratorKind::Path
            | IntegratorKind::Naive
            | IntegratorKind::Whitted
            | IntegratorKind::Distributed
            | IntegratorKind::Direct
            | IntegratorKind::AmbientOcclusion
            | IntegratorKind::Debug => CommonErrors::None,
            // Paths of lights fall on few pixels each; but photons within a fixed radius may reach many.
            IntegratorKind::VertexMerging if self.photon_radius.is_some() => CommonErrors::Sample,
            IntegratorKind::Light | IntegratorKind::Bidirectional | IntegratorKind::VertexMerging => CommonErrors::Tile,
            IntegratorKind::PrimarySpace | IntegratorKind::PathSpace | IntegratorKind::ProgressivePhotons => {
                CommonErrors::Sample
            }
            IntegratorKind::PhotonMap | IntegratorKind::IrradianceCache => CommonErrors::Picture,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_decide_which_errors_pixels_have_in_common() {
        let of = |kind, reuse, photon_radius| {
            let estimator = Estimator {
                kind,
                reuse,
                photon_radius,
                ..Estimator::default()
            };
            estimator.common_errors()
        };
        for (kind, reuse, radius, expected) in [
            (IntegratorKind::Path, true, None, CommonErrors::Tile),
            (IntegratorKind::Path, false, None, CommonErrors::None),
            (IntegratorKind::Direct, true, None, CommonErrors::None),
            (IntegratorKind::VertexMerging, true, None, CommonErrors::Tile),
            (IntegratorKind::VertexMerging, true, Some(0.1), CommonErrors::Sample),
            (IntegratorKind::ProgressivePhotons, true, None, CommonErrors::Sample),
            (IntegratorKind::PhotonMap, true, None, CommonErrors::Picture),
        ] {
            assert_eq!(of(kind, reuse, radius), expected);
        }
    }
}
