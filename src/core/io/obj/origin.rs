//! The origin of a file that lies far from its own: surveyors write national grids in metres, whose
//! coordinates of millions have few steps of 32 bits across a building.

use super::open_regular;
use crate::io::{LoadOptions, Origin};
use crate::math::DVec3;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Largest coordinate of the first vertex up to which the file is not read further.
const NEAR: f64 = 2048.0;
/// Bytes of a line that are read at once: a binary file is one long line.
const MAX_LINE: u64 = 1 << 16;
/// Distance of the middle of a file from its origin, in its sizes, from which on it is far.
const FAR: f64 = 500.0;

/// The origin that is to be subtracted from the vertices of an OBJ file; zero unless all of it lies
/// far away. It is a multiple of a power of ten that is not smaller than the file's size.
pub fn origin_of(path: &Path) -> DVec3 {
    let Some(file) = open_regular(path) else {
        return DVec3::ZERO;
    };
    let mut bounds: Option<[DVec3; 2]> = None;
    let (mut reader, mut line) = (BufReader::with_capacity(1 << 16, file), Vec::new());
    // No line that counts is longer, whatever ends it.
    while matches!(reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut line), Ok(1..)) {
        if line.contains(&0) {
            return DVec3::ZERO;
        }
        for p in line.split(|&byte| byte == b'\r').filter_map(vertex) {
            let [min, max] = bounds.unwrap_or([p, p]);
            let all = [min.min(p), max.max(p)];
            if all.iter().all(|corner| corner.abs().max_element() <= NEAR) {
                return DVec3::ZERO;
            }
            bounds = Some(all);
        }
        line.clear();
    }
    let Some([min, max]) = bounds else {
        return DVec3::ZERO;
    };
    let (middle, size) = (0.5 * (min + max), (max - min).max_element());
    if middle.abs().max_element() <= FAR * size.max(f64::from(f32::MIN_POSITIVE)) {
        return DVec3::ZERO;
    }
    let step = 10f64.powi(size.max(1.0).log10().ceil() as i32);
    (middle / step).round() * step
}

/// The point that becomes the origin of the OBJ file `path`.
pub(in crate::io) fn chosen_origin(path: &Path, options: &LoadOptions) -> DVec3 {
    match options.parameters.origin() {
        Origin::Off => DVec3::ZERO,
        Origin::Auto => origin_of(path),
        Origin::At(origin) => origin,
    }
}

/// The position in a line with a `v` statement, if all of it is finite.
fn vertex(line: &[u8]) -> Option<DVec3> {
    let text = std::str::from_utf8(line.trim_ascii_start().strip_prefix(b"v")?).ok()?;
    text.starts_with([' ', '\t']).then_some(())?;
    let mut numbers = text.split_ascii_whitespace().map_while(|word| word.parse().ok());
    let p = DVec3::new(numbers.next()?, numbers.next()?, numbers.next()?);
    p.is_finite().then_some(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_far_away_have_an_origin() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        for (text, expected) in [
            (
                "v 512345.25 5412345.75 430\nv 512346.25 5412346.75 431\n",
                [512_346.0, 5_412_346.0, 431.0],
            ),
            // Near, large, mixed, and none
            ("v 1 2 3\nv 4 5 6\n", [0.0; 3]),
            ("v 500000 0 0\nv -500000 0 0\n", [0.0; 3]),
            ("v 512345 5412345 430\nv 0 0 0\n", [0.0; 3]),
            ("vt 5000000 5000000\nvn 1 1 1\n", [0.0; 3]),
            ("v nan 5e9 5e9\nv 1e9\n", [0.0; 3]),
            ("v 512345 5412345 430\n\0\0\n", [0.0; 3]),
            // Line ends of old programs
            (
                "v 512345.25 5412345.75 430\rv 512346.25 5412346.75 431\r",
                [512_346.0, 5_412_346.0, 431.0],
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(origin_of(&path).to_array(), expected, "{text}");
        }
        assert_eq!(origin_of(&folder.path().join("b.obj")), DVec3::ZERO);
    }
}
