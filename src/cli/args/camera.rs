//! Flags of the camera.

use super::flags::Flags;
use crate::math::DVec3;
use crate::options::{CameraOptions, OptionGroup};
use crate::session::CameraSettings;
use clap::error::Error;
use clap::{ArgMatches, Args, Command, FromArgMatches};

/// Two flags that exclude each other, although a scene file may have both keys.
/// [`CameraOptions::EXCLUSIVE`] has the pairs of keys that exclude each other as flags and in scene
/// files.
const EXCLUSIVE: [&str; 2] = ["focus_at", "focus_distance"];

/// Camera flags. A setting is guessed if neither a flag nor the scene file sets it.
#[derive(Clone, Debug, Default)]
pub(in crate::cli) struct CameraArgs(pub CameraOptions);

impl Args for CameraArgs {
    fn augment_args(command: Command) -> Command {
        let mut command = Flags::<CameraOptions>::augment_args(command);
        for [first, second] in CameraOptions::EXCLUSIVE.iter().chain([&EXCLUSIVE]) {
            let [first, second] = [first, second].map(|key| flag(key));
            command = command.mut_arg(first, |arg| arg.conflicts_with(second));
        }
        command.mut_arg(flag("yaw"), |arg| arg.requires(flag("stand")))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for CameraArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        Flags::from_arg_matches(matches).map(|Flags(options)| Self(options))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Name of the flag that sets the camera key `key`; empty for an unknown key.
fn flag(key: &str) -> String {
    let mut parameters = CameraOptions::PARAMETERS.iter();
    let parameter = parameters.find(|parameter| parameter.key == key);
    parameter.map_or_else(String::new, |parameter| parameter.flag())
}

impl CameraArgs {
    /// Applies these flags to the camera of the scene file. Positions in flags are OBJ coordinates.
    /// `origin` is the scene's origin in OBJ coordinates.
    pub fn apply(&self, camera: &mut CameraSettings, origin: DVec3) {
        let near = |position: DVec3| position - origin;
        let flags = self.0.placed();
        let flags = CameraOptions {
            position: flags.position.map(near),
            look_at: flags.look_at.map(near),
            ..flags
        };
        // A flag for the view replaces the position of the camera, but not the lens.
        let is_drawing = flags.elevation.is_some();
        if flags.view.is_some() || flags.orbit.is_some() || flags.stand.is_some() || is_drawing {
            camera.options = CameraOptions {
                view: None,
                elevation: None,
                orbit: None,
                stand: None,
                yaw: None,
                position: None,
                look_at: None,
                position_close: None,
                look_at_close: None,
                ..camera.options
            };
        }
        if is_drawing {
            (camera.projection, camera.ortho_height) = (None, None);
        }
        if flags.position.is_some() {
            camera.elevation = None;
            (camera.view, camera.orbit, camera.stand, camera.yaw) = (None, None, None, None);
        }
        if flags.look_at.is_some() {
            camera.yaw = None;
        }
        // The following keys all define the field of view, so a flag for one removes the others.
        if flags.intrinsics.is_some() {
            (
                camera.vertical_fov,
                camera.shift,
                camera.fisheye_fov,
                camera.fisheye_mapping,
            ) = (None, None, None, None);
        }
        if flags.vertical_fov.is_some() {
            (camera.intrinsics, camera.distortion) = (None, None);
        }
        if flags.focus_distance.is_some() {
            camera.focus_at = None;
        }
        // Both keys define the radius of the lens, so a flag for one removes the other.
        if flags.lens_radius.is_some() || flags.f_stop.is_some() {
            (camera.lens_radius, camera.f_stop) = (None, None);
        }
        camera.options = flags.or(camera.options);
    }
}
