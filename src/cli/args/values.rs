//! Parsers of flag values. They return a value, or a message with the expected form.

use std::path::PathBuf;

/// Parses `90`, `90s`, `10m` or `2h` to seconds.
pub(in crate::cli) fn parse_duration(text: &str) -> Result<f64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match &text[digits.len()..] {
        "" | "s" => 1.0,
        "m" => 60.0,
        "h" => 3600.0,
        _ => return Err("a time such as 90s, 10m or 2h is expected".into()),
    };
    let seconds = digits.parse().ok().map(|n: f64| n * unit);
    let good = seconds.filter(|s| s.is_finite() && *s > 0.0);
    good.ok_or_else(|| "a time above 0 is expected, such as 90s, 10m or 2h".into())
}

/// Parses a relative error such as `0.02` or `2%`. A number of 1 or more without the percent sign
/// is an error, because `2` is probably meant as 2 %. The minimum is checked later.
pub(in crate::cli) fn parse_level(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.strip_suffix('%') {
        Some(percent) => (percent, 0.01),
        None => (text, 1.0),
    };
    match number.trim().parse::<f64>() {
        Ok(n) if unit == 1.0 && n >= 1.0 => Err(format!("{n} means {:.0}%; for {n}% write {n}%", n * 100.0)),
        Ok(n) => Ok(n * unit),
        Err(_) => Err("a relative error such as 0.02 or 2% is expected".into()),
    }
}

/// Parses an address such as `localhost:14158`. The existence of the host is checked later.
pub(in crate::cli) fn parse_address(text: &str) -> Result<String, String> {
    let parts = text.rsplit_once(':').map(|(host, port)| (host, port.parse::<u16>()));
    match parts {
        Some((host, Ok(1..))) if !host.is_empty() => Ok(text.into()),
        _ => Err("a host and a port are expected, such as 127.0.0.1:14158".into()),
    }
}

/// Parses an existing folder.
pub(in crate::cli) fn parse_folder(text: &str) -> Result<PathBuf, String> {
    let folder = PathBuf::from(text);
    if folder.is_dir() {
        Ok(folder)
    } else {
        Err("an existing folder is expected".into())
    }
}

/// Parses a range of integers such as `0..64`, whose end is excluded.
pub(in crate::cli) fn parse_range(text: &str) -> Result<[u32; 2], String> {
    let ends = text
        .split_once("..")
        .map(|(a, b)| (a.trim().parse().ok(), b.trim().parse().ok()));
    match ends {
        Some((Some(first), Some(end))) if first < end => Ok([first, end]),
        _ => Err(
            "a range of samples is expected, such as 64..128 for the samples 64 to 127; --spp sets the number of samples".into(),
        ),
    }
}

/// Parses `500M`, `8G`, `8GB` or a number of bytes. Units are powers of 1000.
pub(in crate::cli) fn parse_bytes(text: &str) -> Result<u64, String> {
    let number = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match text[number.len()..].to_ascii_uppercase().as_str() {
        "" | "B" => 1.0,
        "K" | "KB" => 1e3,
        "M" | "MB" => 1e6,
        "G" | "GB" => 1e9,
        "T" | "TB" => 1e12,
        _ => return Err("a size such as 500M or 8G is expected".into()),
    };
    let bytes = number.parse().ok().map(|n: f64| n * unit);
    let good = bytes.filter(|bytes| *bytes >= 1.0 && *bytes < u64::MAX as f64);
    good.map(|bytes| bytes as u64)
        .ok_or_else(|| "a size above 0 is expected, such as 500M or 8G".into())
}

/// Parses the name of a scene file to write. The name must end in `.toml`, else the file could not
/// be rendered.
pub(in crate::cli) fn parse_scene_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_toml = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    if is_toml {
        Ok(path)
    } else {
        Err("the name of a .toml scene file is expected".into())
    }
}

/// Parses the name of an SVG picture to write.
pub(in crate::cli) fn parse_svg_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_svg = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
    if is_svg {
        Ok(path)
    } else {
        Err("the name of an .svg picture is expected".into())
    }
}

/// Parses the name of an output file for light paths: .svg, .obj or .json.
pub(in crate::cli) fn parse_paths_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_known = |extension: &std::ffi::OsStr| {
        ["svg", "obj", "json"]
            .iter()
            .any(|known| extension.eq_ignore_ascii_case(known))
    };
    if path.extension().is_some_and(is_known) {
        Ok(path)
    } else {
        Err("a name that ends in .svg, .obj or .json is expected".into())
    }
}

pub(in crate::cli) fn parse_share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|s| (0.0..=1.0).contains(s));
    share.ok_or_else(|| "a fraction from 0 to 1 is expected, such as 1e-4".into())
}

pub(in crate::cli) fn parse_height(text: &str) -> Result<f64, String> {
    let height = text.parse().ok().filter(|h: &f64| *h > 0.0 && h.is_finite());
    height.ok_or_else(|| "a height above 0 in scene units is expected, such as 1.2".into())
}

pub(in crate::cli) fn parse_chance(text: &str) -> Result<f64, String> {
    let chance = text.parse().ok().filter(|p| *p > 0.0 && *p < 1.0);
    chance.ok_or_else(|| "a probability between 0 and 1 is expected, such as 0.01".into())
}

pub(in crate::cli) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let size: Option<Vec<u32>> = text.split(['x', 'X']).map(|n| n.trim().parse().ok()).collect();
    match size.as_deref() {
        Some(&[width, height]) => Ok([width, height]),
        _ => Err("two whole numbers are expected, as in 640x480".into()),
    }
}

pub(in crate::cli) fn parse_list<T: std::str::FromStr + Copy, const N: usize>(text: &str) -> Result<[T; N], String> {
    let values: Option<Vec<T>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    values
        .and_then(|v| v.try_into().ok())
        .ok_or_else(|| format!("{N} numbers with commas between them are expected"))
}

pub(super) fn parse_radius(text: &str) -> Result<f32, String> {
    let radius = text.parse().ok().filter(|radius| (0.1..=50.0).contains(radius));
    radius.ok_or_else(|| "a number from 0.1 to 50 is expected".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_and_sizes() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        assert!(parse_size("640").is_err() && parse_size("-1x3").is_err() && parse_size("1x2x3").is_err());
        assert_eq!(parse_list::<f32, 3>("1, -2.5,3e1"), Ok([1.0, -2.5, 30.0]));
        assert!(parse_list::<f32, 3>("1,2").is_err());
    }

    #[test]
    fn levels_may_be_percentages() {
        assert_eq!((parse_level("0.02"), parse_level("-0.5")), (Ok(0.02), Ok(-0.5)));
        for text in ["5%", "5 %", "5.0%"] {
            assert!((parse_level(text).unwrap() - 0.05).abs() < 1e-12, "{text}");
        }
        assert!(parse_level("%").is_err() && parse_level("5%%").is_err() && parse_level("low").is_err());
        assert_eq!(parse_level("2"), Err("2 means 200%; for 2% write 2%".into()));
        assert_eq!(parse_level("150%"), Ok(1.5));
    }
}
