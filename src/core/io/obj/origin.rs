//! Origin for a file whose vertices lie far from the origin of the file. Files of surveyors have
//! coordinates of a national grid in metres. For coordinates of several millions, the spacing of
//! 32-bit floats is too coarse for a building.

use super::open_regular;
use crate::io::{LoadOptions, Origin};
use crate::math::DVec3;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Vertices count as near the origin of the file if no absolute coordinate is above this number.
const NEAR: f64 = 2048.0;
/// Maximum number of bytes of a line that are read at once: a binary file is one long line.
const MAX_LINE: u64 = 1 << 16;
/// The origin is moved if a coordinate of the middle of the vertices is more than this multiple of
/// the size of the model.
const FAR: f64 = 500.0;

/// Number of places in a file, and number of bytes at each place, where vertices are read to find
/// out if most vertices are far from the origin. This is done if the first vertex is near the
/// origin.
const PLACES: u64 = 64;
const PLACE_BYTES: u64 = 1 << 12;
/// Maximum number of sampled vertices, and fraction of the samples that is left out at each end of
/// each axis.
const MAX_SAMPLES: usize = 1 << 16;
const TAIL: f64 = 0.1;

/// Origin to subtract from the vertices of an OBJ file. Zero unless most vertices lie far from the
/// file's origin. Each coordinate is a multiple of a power of ten that is at least the size of the
/// region in which most vertices lie.
pub fn origin_of(path: &Path) -> DVec3 {
    let Some(file) = open_regular(path) else {
        return DVec3::ZERO;
    };
    let mut bounds: Option<[DVec3; 2]> = None;
    let mut samples = Samples::default();
    let mut is_mostly_far = None;
    let (mut reader, mut line) = (BufReader::with_capacity(1 << 16, file), Vec::new());
    // Read up to the next line feed, but at most `MAX_LINE` bytes, which is more than any valid
    // line. If lines end with carriage returns only, these bytes contain many lines.
    while matches!(reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut line), Ok(1..)) {
        if line.contains(&0) {
            return DVec3::ZERO;
        }
        for p in line.split(|&byte| byte == b'\r').filter_map(vertex) {
            let [min, max] = bounds.unwrap_or([p, p]);
            let all = [min.min(p), max.max(p)];
            let is_near = all.iter().all(|corner| corner.abs().max_element() <= NEAR);
            if is_near && !*is_mostly_far.get_or_insert_with(|| is_mostly_far_in(path)) {
                return DVec3::ZERO;
            }
            bounds = Some(all);
            samples.add(p);
        }
        line.clear();
    }
    let mut origins = [bounds, samples.middle()].into_iter().flatten().map(origin_within);
    origins.find(|&origin| origin != DVec3::ZERO).unwrap_or(DVec3::ZERO)
}

/// Vertices that are evenly spread over a file.
#[derive(Default)]
struct Samples {
    all: Vec<DVec3>,
    /// Number of vertices that were added.
    count: usize,
    /// Step between two sampled vertices, minus 1. The step is a power of two, so this number is a
    /// bit mask.
    skipped: usize,
}

impl Samples {
    fn add(&mut self, p: DVec3) {
        if self.count & self.skipped == 0 {
            if self.all.len() == MAX_SAMPLES {
                let mut is_kept = false;
                self.all.retain(|_| {
                    is_kept = !is_kept;
                    is_kept
                });
                self.skipped = 2 * self.skipped + 1;
            }
            if self.count & self.skipped == 0 {
                self.all.push(p);
            }
        }
        self.count += 1;
    }

    /// Bounds of the samples along each axis. A fraction [`TAIL`] of the samples is left out at
    /// each end.
    fn middle(&self) -> Option<[DVec3; 2]> {
        let tail = (TAIL * self.all.len() as f64) as usize;
        let mut bounds = [DVec3::ZERO; 2];
        for axis in 0..3 {
            let mut sorted: Vec<f64> = self.all.iter().map(|p| p[axis]).collect();
            sorted.sort_unstable_by(f64::total_cmp);
            bounds[0][axis] = *sorted.get(tail)?;
            bounds[1][axis] = *sorted.get(sorted.len().checked_sub(1 + tail)?)?;
        }
        Some(bounds)
    }
}

/// Returns true if most vertices of a file lie far from the file's origin. Only a few vertices are
/// read.
fn is_mostly_far_in(path: &Path) -> bool {
    let Some(mut file) = open_regular(path) else {
        return false;
    };
    let length = file.metadata().map_or(0, |data| data.len());
    let mut counts = [0; 2];
    let mut bytes = Vec::new();
    for place in 0..PLACES {
        bytes.clear();
        let start = length / PLACES * place;
        let read = file
            .seek(SeekFrom::Start(start))
            .and_then(|_| file.by_ref().take(PLACE_BYTES).read_to_end(&mut bytes));
        if read.is_err() {
            return false;
        }
        // The first line may be incomplete.
        let mut lines = bytes.split(|&byte| matches!(byte, b'\r' | b'\n')).skip(1);
        if let Some(p) = lines.find_map(vertex) {
            counts[usize::from(p.abs().max_element() > NEAR)] += 1;
        }
    }
    counts[1] > counts[0]
}

/// Origin for vertices between `min` and `max`; zero unless all vertices lie far away.
fn origin_within([min, max]: [DVec3; 2]) -> DVec3 {
    let (middle, size) = (0.5 * (min + max), (max - min).max_element());
    if middle.abs().max_element() <= FAR * size.max(f64::from(f32::MIN_POSITIVE)) {
        return DVec3::ZERO;
    }
    let step = 10f64.powi(size.max(1.0).log10().ceil() as i32);
    (middle / step).round() * step
}

/// Point of the OBJ file `path` that becomes the origin.
pub(in crate::io) fn chosen_origin(path: &Path, options: &LoadOptions) -> DVec3 {
    match options.parameters.origin() {
        Origin::Off => DVec3::ZERO,
        Origin::Auto => origin_of(path),
        Origin::At(origin) => origin,
    }
}

/// Position in a line with a `v` statement, if it is finite.
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
    fn distant_file_has_an_origin() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        for (text, expected) in [
            (
                "v 512345.25 5412345.75 430\nv 512346.25 5412346.75 431\n",
                [512_346.0, 5_412_346.0, 431.0],
            ),
            // Files whose origin stays: vertices near the file's origin, a large model, near and
            // far vertices, and no valid vertex
            ("v 1 2 3\nv 4 5 6\n", [0.0; 3]),
            ("v 500000 0 0\nv -500000 0 0\n", [0.0; 3]),
            ("v 512345 5412345 430\nv 0 0 0\n", [0.0; 3]),
            ("vt 5000000 5000000\nvn 1 1 1\n", [0.0; 3]),
            ("v nan 5e9 5e9\nv 1e9\n", [0.0; 3]),
            ("v 512345 5412345 430\n\0\0\n", [0.0; 3]),
            // Lines that end with a carriage return only (classic Mac OS)
            (
                "v 512345.25 5412345.75 430\rv 512346.25 5412346.75 431\r",
                [512_346.0, 5_412_346.0, 431.0],
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(origin_of(&path).to_array(), expected, "{text}");
        }
        assert_eq!(origin_of(&folder.path().join("b.obj")), DVec3::ZERO);
        // Test files with vertices at two places, in both orders. The origin is near the place with
        // most vertices.
        let near = |n: u32| (0..n).map(|i| format!("v {} 2 3\n", i % 30)).collect::<String>();
        let far = |n: u32| {
            (0..n)
                .map(|i| format!("v {} 5412345.5 40\n", 512_300 + i % 30))
                .collect::<String>()
        };
        for (text, is_far) in [
            (near(50) + &far(2000), true),
            (far(2000) + &near(50), true),
            (near(2000) + &far(50), false),
            (far(50) + &near(2000), false),
        ] {
            std::fs::write(&path, &text).unwrap();
            let origin = origin_of(&path);
            assert_eq!(origin != DVec3::ZERO, is_far, "{origin}");
            let middle = DVec3::new(512_315.0, 5_412_345.5, 40.0);
            assert!(!is_far || origin.distance(middle) < 100.0, "{origin}");
        }
    }
}
