use crate::camera::{CameraDescription, CameraError, CameraMotion, CameraParameters, Pose};
use crate::description::SceneFile;
use crate::io::FileError;
use crate::math::{Bounds3, Encode, UVec2, Vec3, encode_fields};
use toml::Spanned;

/// Vertical field of view, in degrees, where none is given.
const DEFAULT_FOV: f32 = 40.0;

/// What is said of the camera; where nothing is, it frames the scene from +z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraSettings {
    /// Centre of the lens.
    pub position: Option<Vec3>,
    /// The point in the middle of the image.
    pub look_at: Option<Vec3>,
    /// Up in the image; +y where nothing is said.
    pub up: Option<Vec3>,
    /// Degrees; 40 where nothing is said.
    pub vertical_fov: Option<f32>,
    /// Scene units; a pinhole where nothing is said.
    pub lens_radius: Option<f32>,
    /// Along the view axis; that of `look_at` where nothing is said.
    pub focus_distance: Option<f32>,
    /// `position` at time 1, if the camera moves.
    pub position_close: Option<Vec3>,
    /// `look_at` at time 1.
    pub look_at_close: Option<Vec3>,
    /// `up` at time 1.
    pub up_close: Option<Vec3>,
    /// When the shutter opens and closes, from 0 to 1.
    pub shutter: Option<[f32; 2]>,
}

encode_fields!(CameraSettings {
    position,
    look_at,
    up,
    vertical_fov,
    lens_radius,
    focus_distance,
    position_close,
    look_at_close,
    up_close,
    shutter,
});

impl CameraSettings {
    /// Those of the scene file.
    pub fn of(file: &SceneFile) -> Self {
        let Some(section) = &file.camera else {
            return Self::default();
        };
        let vector = |key: &Option<Spanned<[f32; 3]>>| key.as_ref().map(|v| Vec3::from(*v.get_ref()));
        let number = |key: &Option<Spanned<f32>>| key.as_ref().map(|v| *v.get_ref());
        Self {
            position: Some(Vec3::from(*section.position.get_ref())),
            look_at: Some(Vec3::from(*section.look_at.get_ref())),
            up: vector(&section.up),
            vertical_fov: number(&section.vertical_fov),
            lens_radius: number(&section.lens_radius),
            focus_distance: number(&section.focus_distance),
            position_close: vector(&section.position_close),
            look_at_close: vector(&section.look_at_close),
            up_close: vector(&section.up_close),
            shutter: section.shutter.as_ref().map(|s| *s.get_ref()),
        }
    }

    /// The camera for a scene within `bounds`.
    pub fn describe(&self, bounds: Bounds3, resolution: UVec2) -> CameraDescription {
        let fov = self.vertical_fov.unwrap_or(DEFAULT_FOV);
        let (position, look_at) = framing(bounds, fov, resolution);
        let position = self.position.unwrap_or(position);
        let look_at = self.look_at.unwrap_or(look_at);
        let parameters = CameraParameters {
            position,
            look_at,
            up: self.up.unwrap_or(Vec3::Y),
            vertical_fov: fov,
            lens_radius: self.lens_radius.unwrap_or(0.0),
            focus_distance: self.focus_distance.unwrap_or_else(|| distance(position, look_at)),
        };
        CameraDescription {
            motion: self.motion(&parameters),
            parameters,
        }
    }

    /// Whether both have the same bits: NaN is equal to NaN.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.encoded() == other.encoded()
    }

    /// How the camera of `parameters` moves and when it looks; `None` where nothing is said of it.
    fn motion(&self, parameters: &CameraParameters) -> Option<CameraMotion> {
        let moves = self.position_close.or(self.look_at_close).or(self.up_close).is_some();
        (moves || self.shutter.is_some()).then(|| CameraMotion {
            close: moves.then(|| Pose {
                position: self.position_close.unwrap_or(parameters.position),
                look_at: self.look_at_close.unwrap_or(parameters.look_at),
                up: self.up_close.unwrap_or(parameters.up),
            }),
            shutter: self.shutter.unwrap_or([0.0, 1.0]),
        })
    }
}

/// `error` as one of the key that is to blame, if the scene file has a camera.
pub(super) fn blame(file: &SceneFile, error: &CameraError) -> Option<FileError> {
    let section = file.camera.as_ref()?;
    let key = match error.parameter {
        "look_at" => Some(section.look_at.span()),
        "up" => section.up.as_ref().map(Spanned::span),
        "vertical_fov" => section.vertical_fov.as_ref().map(Spanned::span),
        "lens_radius" => section.lens_radius.as_ref().map(Spanned::span),
        "focus_distance" => section.focus_distance.as_ref().map(Spanned::span),
        "shutter" => section.shutter.as_ref().map(Spanned::span),
        "close" => {
            let keys = [&section.position_close, &section.look_at_close, &section.up_close];
            keys.into_iter().flatten().next().map(Spanned::span)
        }
        _ => None,
    };
    let span = key.unwrap_or_else(|| section.position.span());
    Some(file.error(span, error.to_string()).help("correct the [camera]"))
}

/// From where on the +z side, and looking where, a pinhole sees the whole sphere around `bounds`.
fn framing(bounds: Bounds3, vertical_fov: f32, resolution: UVec2) -> (Vec3, Vec3) {
    let look_at = bounds.center();
    let radius = Some(bounds.radius()).filter(|&r| r > 0.0).unwrap_or(1.0);
    // The narrower of the two fields of view must hold the sphere.
    let half = (0.5 * vertical_fov.clamp(1.0, 179.0)).to_radians();
    let aspect = resolution.x as f32 / resolution.y as f32;
    let narrow = if aspect < 1.0 {
        (half.tan() * aspect).atan()
    } else {
        half
    };
    (look_at + Vec3::Z * (radius / narrow.sin()), look_at)
}

/// Where a camera focuses that does not say where.
fn distance(position: Vec3, look_at: Vec3) -> f32 {
    Some(position.distance(look_at)).filter(|&d| d > 0.0).unwrap_or(1.0)
}
