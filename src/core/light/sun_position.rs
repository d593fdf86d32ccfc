//! Position of the sun in the sky of a place, at a time.
//!
//! The formulas are the approximate algorithm of the Astronomical Almanac, with its refraction, as
//! published by Michalsky 1988, "The Astronomical Almanac's algorithm for approximate solar
//! position (1950–2050)". The error is at most 0.01° in these years.

/// Julian date of the epoch J2000.0 minus the Julian date of the Unix epoch, in days.
const J2000: f64 = 10957.5;

/// Azimuth and elevation of the sun in degrees. The azimuth is measured from north towards east,
/// from 0 to 360. The elevation includes refraction.
///
/// `latitude` and `longitude` are degrees, positive to the north and to the east. `unix_seconds`
/// are seconds of universal time since 1970-01-01.
pub fn sun_position([latitude, longitude]: [f64; 2], unix_seconds: f64) -> [f64; 2] {
    let days = unix_seconds / 86400.0 - J2000;
    // Ecliptic longitude from the mean longitude and the mean anomaly
    let mean_longitude = 280.460 + 0.985_647_4 * days;
    let anomaly = (357.528 + 0.985_600_3 * days).to_radians();
    let ecliptic = mean_longitude + 1.915 * anomaly.sin() + 0.020 * (2.0 * anomaly).sin();
    let (sin_ecliptic, cos_ecliptic) = ecliptic.to_radians().sin_cos();
    // Right ascension and declination
    let (sin_tilt, cos_tilt) = (23.439 - 0.000_000_4 * days).to_radians().sin_cos();
    let ascension = (cos_tilt * sin_ecliptic).atan2(cos_ecliptic);
    let declination = (sin_tilt * sin_ecliptic).asin();
    // Hour angle from the sidereal time, whose unit is hours
    let hours = unix_seconds.rem_euclid(86400.0) / 3600.0;
    let sidereal = 6.697_375 + 0.065_709_824_2 * days + hours + longitude / 15.0;
    let (sin_hour, cos_hour) = ((15.0 * sidereal).to_radians() - ascension).sin_cos();
    let (sin_declination, cos_declination) = declination.sin_cos();
    let (sin_latitude, cos_latitude) = latitude.to_radians().sin_cos();
    let height = sin_declination * sin_latitude + cos_declination * cos_latitude * cos_hour;
    let azimuth =
        (-cos_declination * sin_hour).atan2(sin_declination * cos_latitude - cos_declination * sin_latitude * cos_hour);
    let elevation = height.clamp(-1.0, 1.0).asin().to_degrees();
    [
        azimuth.to_degrees().rem_euclid(360.0),
        elevation + refraction(elevation),
    ]
}

/// Refraction in degrees at the true elevation `e`, in degrees.
fn refraction(e: f64) -> f64 {
    if e > -0.56 {
        3.51561 * (0.1594 + 0.0196 * e + 0.00002 * e * e) / (1.0 + 0.505 * e + 0.0845 * e * e)
    } else {
        0.56
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Example of Reda and Andreas 2004, "Solar position algorithm for solar radiation
    /// applications" (NREL/TP-560-34302, table A5.1): 2003-10-17, 12:30:30 at UTC−7. Their
    /// elevation includes a refraction of 0.016°, for the air pressure of the place.
    #[test]
    fn position_is_that_of_a_more_exact_algorithm() {
        let unix_seconds = 1_066_419_030.0;
        let [azimuth, elevation] = sun_position([39.742476, -105.1786], unix_seconds);
        assert!((azimuth - 194.34024).abs() < 0.02, "{azimuth}");
        assert!((elevation - 39.88838).abs() < 0.02, "{elevation}");
    }

    /// At an equinox the sun rises in the east and stands above the equator at noon. At the
    /// solstice of June it stands at the zenith of the tropic of Cancer.
    #[test]
    fn seasons_and_times_of_day_are_right() {
        // 2026-03-20, 14:46 is the equinox. Noon at the longitude 0 is about 12:07.
        let day = 1_773_964_800.0;
        let [_, noon] = sun_position([0.0, 0.0], day + 12.125 * 3600.0);
        assert!(noon > 89.8, "{noon}");
        let [azimuth, elevation] = sun_position([50.0, 0.0], day + 6.125 * 3600.0);
        assert!(
            (azimuth - 90.0).abs() < 1.0 && elevation.abs() < 1.0,
            "{azimuth} {elevation}"
        );
        let june = 1_782_000_000.0;
        let highest = (0..1440).map(|minute| sun_position([23.44, 0.0], june + 60.0 * f64::from(minute))[1]);
        assert!(highest.fold(0.0, f64::max) > 89.7);
    }
}
