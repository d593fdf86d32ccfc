//! Flags that change the light of a scene: `--env`, `--sun` and `--key-light`. They become changes
//! of the `[[light]]` sections of the scene file ([`LightChanges`]).

use crate::color::{Spectrum, WRITTEN_COLORS};
use crate::light::sky::SUN_IRRADIANCE;
use crate::light::sun_position;
use crate::options::nearest;
#[cfg(feature = "view")]
use crate::scene_file::LightSection;
use crate::scene_file::{Environment, LightChanges, Sun};
use toml::value::{Datetime, Offset};

/// Flags that change the light of the scene file.
#[derive(Clone, Debug, Default, clap::Args)]
pub(in crate::cli) struct LightFlags {
    /// Environment: an .hdr or .exr file, a colour, studio, sky or none
    #[arg(long, value_name = "FILE|COLOUR|studio|sky|none", value_parser = parse_env, help_heading = "Light")]
    pub env: Option<EnvFlag>,

    /// Add a sun: azimuth (0 is +z, 90 is +x), elevation, irradiance [default: 3]
    ///
    /// LATITUDE,LONGITUDE,TIME is the sun of a place at a time: degrees to the north and to the
    /// east, and a time such as 2026-06-21T15:00+02:00. A fourth number is the azimuth of north
    /// (default: 180).
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

/// Azimuth of north if none is given: −z, or +y if +z is up.
const NORTH: f64 = 180.0;

/// Parses `AZ,EL`, `AZ,EL,STRENGTH`, or a place and a time.
fn parse_sun(text: &str) -> Result<SunFlag, String> {
    let words: Vec<&str> = text.split(',').map(str::trim).collect();
    let of_place = match *words {
        [latitude, longitude, time] => Some(([latitude, longitude], time, None)),
        [latitude, longitude, time, north] => Some(([latitude, longitude], time, Some(north))),
        _ => None,
    };
    if let Some((place, time, north)) = of_place.filter(|(_, time, _)| time.contains(':')) {
        let at = sun_of_place(place, time, north)?;
        return Ok(SunFlag {
            written: text.into(),
            sun: Sun {
                at,
                strength: SUN_IRRADIANCE,
            },
        });
    }
    let (at, strength) = match numbers(text).as_deref() {
        Some(&[azimuth, elevation]) => ([azimuth, elevation], SUN_IRRADIANCE),
        Some(&[azimuth, elevation, strength]) => ([azimuth, elevation], strength),
        _ => {
            return Err(
                "azimuth and elevation in degrees are expected, as in -45,40, or with a strength, as in -45,40,3; or a place and a time, as in 52.5,13.4,2026-06-21T15:00+02:00".into(),
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

/// Azimuth and elevation of the sun at a place and a time, in degrees. The azimuth is an azimuth of
/// the scene, where north has the azimuth `north`.
fn sun_of_place(place: [&str; 2], time: &str, north: Option<&str>) -> Result<[f32; 2], String> {
    let degrees = |text: &str, max: f64| text.parse().ok().filter(|x: &f64| x.abs() <= max);
    let (Some(latitude), Some(longitude)) = (degrees(place[0], 90.0), degrees(place[1], 360.0)) else {
        return Err("a latitude from -90 to 90 and a longitude from -360 to 360 are expected before the time".into());
    };
    let Some(north) = north.map_or(Some(NORTH), |north| degrees(north, 360.0)) else {
        return Err("the azimuth of north, from -360 to 360, is expected after the time".into());
    };
    let Some(seconds) = unix_seconds(time) else {
        return Err(format!(
            "`{time}` is not a date and a time with the offset from universal time, such as 2026-06-21T15:00+02:00 or 2026-06-21T13:00Z"
        ));
    };
    let [from_north, elevation] = sun_position([latitude, longitude], seconds);
    if elevation <= 0.0 {
        return Err(format!(
            "the sun is below the horizon then (elevation {elevation:.1}): choose an hour of daylight"
        ));
    }
    let azimuth = (north - from_north + 180.0).rem_euclid(360.0) - 180.0;
    Ok([azimuth, elevation].map(|x| ((100.0 * x).round() / 100.0) as f32))
}

/// Seconds of universal time since 1970 of a date, a time and an offset as in RFC 3339. `None` for
/// other texts.
fn unix_seconds(text: &str) -> Option<f64> {
    let Datetime {
        date: Some(date),
        time: Some(time),
        offset: Some(offset),
    } = text.parse().ok()?
    else {
        return None;
    };
    let east = match offset {
        Offset::Z => 0,
        Offset::Custom { minutes } => i64::from(minutes),
    };
    // Days of the Gregorian calendar; the year begins in March, so that a leap day is its last day.
    let (month, day) = (i64::from(date.month), i64::from(date.day));
    let year = i64::from(date.year) - i64::from(month < 3);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let leap_days = year / 4 - year / 100 + year / 400;
    /// Days from March 1 of the year 0 to 1970-01-01.
    const EPOCH: i64 = 719_468;
    let days = 365 * year + leap_days + day_of_year - EPOCH;
    let minutes = 60 * i64::from(time.hour) + i64::from(time.minute) - east;
    Some((86400 * days + 60 * minutes) as f64 + f64::from(time.second.unwrap_or(0)))
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
    fn suns_of_places_have_the_azimuth_of_the_scene() {
        let at = |text: &str| parse_sun(text).map(|flag| flag.sun.at);
        // Berlin: the calculator of NOAA has the azimuth 227.4 and the elevation 54.0.
        let [azimuth, elevation] = at("52.52,13.4,2026-06-21T15:00+02:00").unwrap();
        assert!(
            (azimuth + 47.4).abs() < 0.5 && (elevation - 54.0).abs() < 0.5,
            "{azimuth},{elevation}"
        );
        assert_eq!(at("52.52, 13.4, 2026-06-21T13:00:00Z"), Ok([azimuth, elevation]));
        let [turned, _] = at("52.52,13.4,2026-06-21T15:00+02:00,90").unwrap();
        assert!((turned - (azimuth - 90.0)).abs() < 0.02, "{turned}");
        for wrong in [
            "52.52,13.4,2026-06-21T15:00",
            "52.52,13.4,15:00",
            "100,13.4,2026-06-21T15:00Z",
            "52.52,x,2026-06-21T15:00Z",
            "52.52,13.4,2026-06-21T15:00Z,west",
            "52.52,13.4,2026-06-21T15:00Z,90,3",
            "52.52,13.4,2026-06-21T01:00+02:00",
        ] {
            assert!(at(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_are_seconds_since_1970() {
        assert_eq!(unix_seconds("1970-01-01T00:00Z"), Some(0.0));
        assert_eq!(unix_seconds("2003-10-17T12:30:30-07:00"), Some(1_066_419_030.0));
        assert_eq!(unix_seconds("2024-02-29T00:00Z"), Some(1_709_164_800.0));
        assert_eq!(unix_seconds("2026-06-21 00:00Z"), Some(1_782_000_000.0));
        assert_eq!(unix_seconds("2026-06-21"), None);
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
