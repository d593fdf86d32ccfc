//! Options that scene files and flags can set. Each group of options has one entry here, under the
//! section of the scene file to which it belongs.

use super::LoadParameters;
use crate::options::{
    BackgroundOptions, CameraOptions, Entry, FilterOptions, Input, IntegratorOptions, InvalidOption, LineOptions,
    OptionGroup, Parameter, PrintOptions, QualityOptions, SamplingOptions, SizeOptions, ToneOptions,
};

/// Interface of a group of options of any type.
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

/// Defines the struct [`SceneOptions`] from groups of options. Each section has the form `SECTION,
/// SECTION_mut { /// Doc. name: TYPE, … }`. The methods `SECTION` and `SECTION_mut` of the struct
/// list the groups of this section.
macro_rules! scene_options {
    ($($section:ident, $section_mut:ident { $(#[doc = $doc:literal] $group:ident: $ty:ty,)+ })+) => {
        /// Parameters of a scene file that flags can also set.
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

            /// For each group, the name of its section and its parameters.
            pub(crate) const GROUPS: &[(&'static str, &'static [Parameter])] =
                &[$($((stringify!($section), <$ty>::PARAMETERS)),+),+];
        }
    };
}

scene_options! {
    camera, camera_mut {
        /// View and lens.
        camera: CameraOptions,
    }
    image, image_mut {
        /// Size of the image.
        size: SizeOptions,
        /// Scale of the picture on paper.
        print: PrintOptions,
        /// Reconstruction filter.
        filter: FilterOptions,
        /// Background for camera rays that leave the scene.
        background: BackgroundOptions,
        /// Tone curve of PNG files.
        tone: ToneOptions,
        /// Lines along edges.
        lines: LineOptions,
    }
    render, render_mut {
        /// Sample counts, sampler and denoiser.
        sampling: SamplingOptions,
        /// Samples, noise level and denoiser together, for values that `sampling` does not set.
        quality: QualityOptions,
        /// The integrator and its parameters.
        integrator: IntegratorOptions,
        /// Reading of OBJ and MTL files.
        load: LoadParameters,
    }
}
