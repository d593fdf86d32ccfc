//! Flags that change the light of a scene: `--env`, `--sun` and `--key-light`. They become changes
//! of the `[[light]]` sections of the scene file ([`LightChanges`]).

use crate::color::{Spectrum, WRITTEN_COLORS};
use crate::light::sky::SUN_IRRADIANCE;
use crate::options::nearest;
#[cfg(feature = "view")]
use crate::scene_file::LightSection;
use crate::scene_file::{Environment, LightChanges, Sun};

/// Flags that change the light of the scene file.
#[derive(Clone, Debug, Default, clap::Args)]
pub(in crate::cli) struct LightFlags {
    /// Environment: an .hdr or .exr file, a colour, studio, sky or none
    #[arg(long, value_name = "FILE|COLOUR|studio|sky|none", value_parser = parse_env, help_heading = "Light")]
    pub env: Option<EnvFlag>,

    /// Add a sun: azimuth (0 is +z, 90 is +x), elevation, irradiance [default: 3]
    #[arg(
        long,
        value_name = "AZ,EL[,STRENGTH]",
        value_parser = parse_sun,
        allow_hyphen_values = true,
        help_heading = "Light"
    )]
    pub sun: Option<SunFlag>,

    /// Add a soft light from the camera's upper left, with this irradiance [default: 2]
    #[arg(
        long,
        value_name = "STRENGTH",
        value_parser = parse_strength,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "2",
        help_heading = "Light"
    )]
    pub key_light: Option<f32>,
}

/// Value of `--env`.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::cli) struct EnvFlag {
    written: String,
    env: Environment,
}

/// Value of `--sun`.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::cli) struct SunFlag {
    written: String,
    sun: Sun,
}

impl LightFlags {
    /// Changes that these flags make to the light of a scene file.
    pub fn changes(&self) -> LightChanges {
        LightChanges {
            env: self.env.as_ref().map(|EnvFlag { written, env }| {
                let env = match env {
                    // Make the path absolute. A path on the command line is relative to the current
                    // folder, but a path in a scene file is relative to the folder of the file.
                    Environment::File(path) => {
                        Environment::File(std::path::absolute(path).unwrap_or_else(|_| path.clone()))
                    }
                    other => other.clone(),
                };
                (env, format!("--env {written}"))
            }),
            sun: self
                .sun
                .as_ref()
                .map(|flag| (flag.sun, format!("--sun {}", flag.written))),
            key_light: self
                .key_light
                .map(|strength| (strength, format!("--key-light={strength}"))),
        }
    }

    /// Returns true if these flags replace `light`.
    #[cfg(feature = "view")]
    pub fn replaces(&self, light: &LightSection) -> bool {
        self.env.is_some() && light.is_environment()
    }
}

/// Parses a file, a colour, `studio`, `sky` or `none`. `none` is a black environment: the lamps are
/// then the only light.
fn parse_env(text: &str) -> Result<EnvFlag, String> {
    let env = match text {
        "studio" => Environment::Studio,
        "sky" => Environment::Sky,
        "none" | "off" => Environment::Color([0.0; 3]),
        _ => match Spectrum::of_text(text) {
            Some(color) => Environment::Color(color.to_array()),
            None if text.starts_with('#') || numbers(text).is_some() => {
                return Err(format!(
                    "a colour is expected, with finite numbers of 0 or more: {WRITTEN_COLORS}"
                ));
            }
            None if text.contains(['.', '/', '\\']) => Environment::File(text.into()),
            None => {
                let near = nearest(text, ["studio", "sky", "none"].into_iter().chain(Spectrum::names()));
                let near = near.map_or(String::new(), |near| format!("did you mean {near}? "));
                return Err(format!(
                    "{near}studio, sky, none, an .hdr or .exr file or a colour is expected: {WRITTEN_COLORS}"
                ));
            }
        },
    };
    Ok(EnvFlag {
        written: text.into(),
        env,
    })
}

/// Numbers separated by commas; `None` for other texts.
fn numbers(text: &str) -> Option<Vec<f32>> {
    text.split(',').map(|number| number.trim().parse().ok()).collect()
}

/// Parses `AZ,EL` or `AZ,EL,STRENGTH`.
fn parse_sun(text: &str) -> Result<SunFlag, String> {
    let (at, strength) = match numbers(text).as_deref() {
        Some(&[azimuth, elevation]) => ([azimuth, elevation], SUN_IRRADIANCE),
        Some(&[azimuth, elevation, strength]) => ([azimuth, elevation], strength),
        _ => {
            return Err(
                "azimuth and elevation in degrees are expected, as in -45,40, or with a strength, as in -45,40,3; the tutorial `Light a room` finds both for a time of day".into(),
            );
        }
    };
    if !at[0].is_finite() {
        return Err("the azimuth must be finite".into());
    }
    if !(at[1] > 0.0 && at[1] <= 90.0) {
        return Err("the elevation must be above 0 and at most 90 degrees".into());
    }
    if !(strength.is_finite() && strength >= 0.0) {
        return Err("the strength must be finite and 0 or more".into());
    }
    Ok(SunFlag {
        written: text.into(),
        sun: Sun { at, strength },
    })
}

fn parse_strength(text: &str) -> Result<f32, String> {
    let strength = text.parse().ok().filter(|s: &f32| s.is_finite() && *s >= 0.0);
    strength.ok_or_else(|| "an irradiance of 0 or more is expected, such as 2".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec3};
    use crate::options::CameraOptions;
    use crate::scene_file::{LightSection, SceneFile};
    use crate::session::CameraSettings;
    use std::path::Path;

    fn with(options: CameraOptions) -> CameraSettings {
        CameraSettings {
            options,
            ..CameraSettings::default()
        }
    }

    fn env(text: &str) -> Environment {
        parse_env(text).unwrap().env
    }

    #[test]
    fn environments_are_files_colours_and_words() {
        assert_eq!(env("studio"), Environment::Studio);
        assert_eq!(env("white"), Environment::Color([1.0; 3]));
        assert_eq!(env("none"), Environment::Color([0.0; 3]));
        assert_eq!(env("0.5"), Environment::Color([0.5; 3]));
        assert_eq!(env(".5"), Environment::Color([0.5; 3]));
        assert_eq!(env("1, 0.5,2e1"), Environment::Color([1.0, 0.5, 20.0]));
        assert_eq!(env("#ff0000"), Environment::Color([1.0, 0.0, 0.0]));
        assert_eq!(env("blue"), Environment::Color([0.0, 0.0, 1.0]));
        let Environment::Color(grey) = env("#808080") else {
            panic!()
        };
        assert!((grey[0] - 0.2158605).abs() < 1e-6);
        for file in ["a.hdr", "../b/c.exr", "sky.exr", "folder/sky"] {
            assert_eq!(env(file), Environment::File(file.into()));
        }
        for wrong in [
            "", "-1", "1,2", "nan", "inf", "#ffff", "#gg0000", "#+12345", "1,,2", "bleu",
        ] {
            assert!(parse_env(wrong).is_err(), "{wrong}");
        }
        assert!(parse_env("stduio").unwrap_err().contains("did you mean studio"));
    }

    #[test]
    fn suns_are_above_the_horizon() {
        let sun = parse_sun("-45, 30").unwrap();
        assert_eq!((sun.sun.at, sun.sun.strength), ([-45.0, 30.0], SUN_IRRADIANCE));
        assert_eq!(parse_sun("400,90,0").unwrap().sun.strength, 0.0);
        for wrong in [
            "1", "1,2,3,4", "a,b", "1,0", "1,-5", "1,91", "nan,5", "1,nan", "1,5,-1", "1,5,inf",
        ] {
            assert!(parse_sun(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_environment_of_the_file_is_replaced_and_other_lights_stay() {
        let mut file = SceneFile::of_obj(Path::new("a.obj"));
        for kind in [
            "constant",
            "sky",
            "point",
            "studio",
            "directional",
            "environment",
            "rectangle",
        ] {
            file.light.push(LightSection::of_type(kind, 0..0));
        }
        let flags = LightFlags {
            env: Some(parse_env("sky").unwrap()),
            sun: Some(parse_sun("90,30,2").unwrap()),
            key_light: Some(1.5),
        };
        let camera = with(CameraOptions {
            up: Some(Vec3::new(0.1, 0.2, 1.5)),
            ..CameraOptions::default()
        });
        file.change_light(flags.changes(), &camera.viewpoint());
        let kinds: Vec<&str> = file.light.iter().map(|light| light.kind.get_ref().as_str()).collect();
        assert_eq!(
            kinds,
            ["point", "directional", "rectangle", "sky", "directional", "directional"]
        );
        let [sky, sun, key] = &file.light[3..] else { panic!() };
        assert_eq!(sky.sun.as_ref().unwrap().get_ref(), &[90.0, 30.0]);
        assert_eq!(sky.up.as_ref().unwrap().get_ref(), &[0.0, 0.0, 1.0]);
        assert!(sun.direction.is_some());
        assert_eq!(key.irradiance.as_ref().unwrap().get_ref().0, [1.5; 3]);
        // The front of a studio faces the camera.
        let studio = LightFlags {
            env: Some(parse_env("studio").unwrap()),
            ..LightFlags::default()
        };
        for (position, front) in [(DVec3::new(5.0, 1.0, 0.0), 90.0), (DVec3::new(0.0, 9.0, 0.0), 0.0)] {
            let mut file = SceneFile::of_obj(Path::new("a.obj"));
            let camera = with(CameraOptions {
                position: Some(position),
                look_at: Some(DVec3::ZERO),
                ..CameraOptions::default()
            });
            file.change_light(studio.changes(), &camera.viewpoint());
            assert_eq!(file.light[0].front.as_ref().unwrap().get_ref(), &front);
        }
        // Errors name the flag that added the light.
        let error = file.error(sky.kind.span(), "no");
        assert_eq!(error.message, "--env sky: no");
        let error = file.error(key.kind.span(), "no");
        assert_eq!(error.message, "--key-light=1.5: no");
    }
}
