//! Options that a scene file and flags set. Each group is named here once, under the section of the scene file that sets it.

use super::LoadParameters;
use crate::options::{
    BackgroundOptions, CameraOptions, Entry, FilterOptions, Input, IntegratorOptions, InvalidOption, OptionGroup,
    Parameter, PrintOptions, QualityOptions, SamplingOptions, SizeOptions, ToneOptions,
};

/// A group of options, whichever it is.
pub(super) trait AnyGroup {
    fn parameters(&self) -> &'static [Parameter];
    fn set(&mut self, key: &str, input: Input) -> Option<Result<(), InvalidOption>>;
    fn entries(&self) -> Vec<Entry>;
}

impl<G: OptionGroup> AnyGroup for G {
    fn parameters(&self) -> &'static [Parameter] {
        G::PARAMETERS
    }

    fn set(&mut self, key: &str, input: Input) -> Option<Result<(), InvalidOption>> {
        OptionGroup::set(self, key, input)
    }

    fn entries(&self) -> Vec<Entry> {
        OptionGroup::entries(self)
    }
}

/// Defines [`SceneOptions`] of groups: `SECTION, SECTION_mut { /// Doc. name: TYPE, … }` for each section. Its methods `SECTION` and `SECTION_mut`
/// list the groups of that section.
macro_rules! scene_options {
    ($($section:ident, $section_mut:ident { $(#[doc = $doc:literal] $group:ident: $ty:ty,)+ })+) => {
        /// What a scene file says of parameters that flags set too.
        #[derive(Clone, Copy, Debug, Default)]
        pub struct SceneOptions {
            $($(#[doc = $doc] pub $group: $ty,)+)+
        }

        impl SceneOptions {
            $(
                #[doc = concat!("The groups that the section `[", stringify!($section), "]` sets.")]
                pub(super) fn $section(&self) -> Vec<&dyn AnyGroup> {
                    vec![$(&self.$group),+]
                }

                #[doc = concat!("The groups that the section `[", stringify!($section), "]` sets.")]
                pub(super) fn $section_mut(&mut self) -> Vec<&mut dyn AnyGroup> {
                    vec![$(&mut self.$group),+]
                }
            )+

            /// Each group as the name of its section and its parameters.
            pub(crate) const GROUPS: &[(&'static str, &'static [Parameter])] =
                &[$($((stringify!($section), <$ty>::PARAMETERS)),+),+];
        }
    };
}

scene_options! {
    camera, camera_mut {
        /// Where the picture is taken from.
        camera: CameraOptions,
    }
    image, image_mut {
        /// Size of the image.
        size: SizeOptions,
        /// Scale of the picture on paper.
        print: PrintOptions,
        /// Reconstruction filter.
        filter: FilterOptions,
        /// What camera rays see where they leave the scene.
        background: BackgroundOptions,
        /// How PNG files show the picture.
        tone: ToneOptions,
    }
    render, render_mut {
        /// Samples, and what computes them.
        sampling: SamplingOptions,
        /// Samples, noise level and denoiser together, where `sampling` does not say them.
        quality: QualityOptions,
        /// The integrator and its parameters.
        integrator: IntegratorOptions,
        /// How OBJ and MTL files are read.
        load: LoadParameters,
    }
}
