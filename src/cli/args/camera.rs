//! The camera, as flags say it.

use super::flags::NameParser;
use super::values::parse_list;
use crate::guess::{Orbit, Stand, View};
use crate::math::{DVec3, Vec2, Vec3};
use crate::session::CameraSettings;

/// Camera flags. What neither flags nor the scene file set is guessed.
#[derive(Clone, Debug, Default, clap::Args)]
pub(in crate::cli) struct CameraArgs {
    /// View: front, back, left, right, top, iso or inside; auto chooses one [default: auto]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<View>::new(), conflicts_with_all = ["position", "orbit", "stand"])]
    view: Option<View>,

    /// Camera at azimuth AZ and elevation EL, degrees, at distance D [default: the scene fills the image]
    #[arg(long, value_name = "AZ,EL[,D]", value_parser = parse_orbit, allow_hyphen_values = true, conflicts_with_all = ["position", "stand"])]
    orbit: Option<Orbit>,

    /// Stand on the floor at X,Z (X,Y if z is up), eyes HEIGHT above it [default: 1.6 m]
    #[arg(long, value_name = "X,Z[,HEIGHT]", value_parser = parse_stand, allow_hyphen_values = true, conflicts_with = "position")]
    stand: Option<Stand>,

    /// Azimuth towards which --stand looks, degrees [default: the way that shows most]
    #[arg(
        long,
        value_name = "DEG",
        allow_hyphen_values = true,
        requires = "stand",
        conflicts_with = "look_at"
    )]
    yaw: Option<f32>,

    /// Camera position
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_list::<f64, 3>, allow_hyphen_values = true)]
    pub position: Option<[f64; 3]>,

    /// Point in the middle of the image
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_list::<f64, 3>, allow_hyphen_values = true)]
    look_at: Option<[f64; 3]>,

    /// Direction that is up in the image [default: 0,1,0, or guessed with the camera]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_list::<f32, 3>, allow_hyphen_values = true)]
    up: Option<[f32; 3]>,

    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    fov: Option<f32>,

    /// Radius of the lens in scene units; 0 is a pinhole [default: 0]
    #[arg(long, value_name = "R", allow_hyphen_values = true, conflicts_with = "f_stop")]
    lens_radius: Option<f32>,

    /// F-number: the lens radius is half the focal length over N
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    f_stop: Option<f32>,

    /// Height of the sensor in scene units, for --f-stop [default: 0.024, full frame in metres]
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    sensor_height: Option<f32>,

    /// Straight blades of the aperture, 3 to 32 [default: a disk]
    #[arg(long, value_name = "N")]
    aperture_blades: Option<u32>,

    /// Angle in degrees of the first corner between the blades [default: 0]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    aperture_rotation: Option<f32>,

    /// Distance along the view axis to the plane in focus [default: distance of --look-at]
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    focus_distance: Option<f32>,

    /// Focus on the surface at this pixel
    #[arg(long, value_name = "X,Y", value_parser = parse_list::<f32, 2>, conflicts_with = "focus_distance")]
    focus_at: Option<[f32; 2]>,

    /// Times at which the shutter opens and closes, 0 to 1 [default: 0,1]
    #[arg(long, value_name = "OPEN,CLOSE", value_parser = parse_list::<f32, 2>)]
    shutter: Option<[f32; 2]>,
}

impl CameraArgs {
    /// The flag `--view` alone.
    pub fn of_view(view: Option<View>) -> Self {
        Self {
            view,
            ..Self::default()
        }
    }

    /// The point of `--focus-at`.
    pub fn focus_at(&self) -> Option<Vec2> {
        self.focus_at.map(Vec2::from)
    }

    /// The camera of the scene file with these flags over it, whose positions are those of a file
    /// with the scene's origin at `origin`.
    pub fn apply(&self, camera: &mut CameraSettings, origin: DVec3) {
        let near = |position: [f64; 3]| (DVec3::from(position) - origin).as_vec3a();
        // A view replaces the place of the camera, not its lens.
        if self.view.is_some() || self.orbit.is_some() || self.stand.is_some() {
            *camera = CameraSettings {
                view: self.view,
                orbit: self.orbit,
                stand: self.stand,
                yaw: self.yaw,
                position: None,
                look_at: None,
                position_close: None,
                look_at_close: None,
                ..*camera
            };
        }
        if self.position.is_some() {
            (camera.view, camera.orbit, camera.stand, camera.yaw) = (None, None, None, None);
        }
        if self.look_at.is_some() {
            camera.yaw = None;
        }
        if self.focus_distance.is_some() {
            camera.focus_at = None;
        }
        // Each of the two says how large the lens is.
        if self.lens_radius.is_some() {
            camera.f_stop = None;
        }
        if self.f_stop.is_some() {
            camera.lens_radius = None;
        }
        camera.position = self.position.map(near).or(camera.position);
        camera.look_at = self.look_at.map(near).or(camera.look_at);
        camera.up = self.up.map(Vec3::from).or(camera.up);
        camera.vertical_fov = self.fov.or(camera.vertical_fov);
        camera.lens_radius = self.lens_radius.or(camera.lens_radius);
        camera.f_stop = self.f_stop.or(camera.f_stop);
        camera.sensor_height = self.sensor_height.or(camera.sensor_height);
        camera.aperture_blades = self.aperture_blades.or(camera.aperture_blades);
        camera.aperture_rotation = self.aperture_rotation.or(camera.aperture_rotation);
        camera.focus_distance = self.focus_distance.or(camera.focus_distance);
        camera.focus_at = self.focus_at().or(camera.focus_at);
        camera.shutter = self.shutter.or(camera.shutter);
    }
}

/// `30,20` or `30,20,4.5`.
fn parse_orbit(text: &str) -> Result<Orbit, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    Orbit::of(&numbers.unwrap_or_default()).map_err(String::from)
}

/// `2,-3` or `2,-3,1.7`.
fn parse_stand(text: &str) -> Result<Stand, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    Stand::of(&numbers.unwrap_or_default()).map_err(String::from)
}
