//! Textures of several tiles (UDIM): tile 1001 + i + 10 j covers texture coordinates from (i, j) to
//! (i + 1, j + 1), for i from 0 to 9.
//!
//! All tiles are joined to one picture, so that lookups and levels are the same as for any texture.
//! A path with `<UDIM>` in place of the tile number in its file name means all tiles.

use super::FileError;
use super::picture::{Picture, PictureHeader, Samples};
use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Placeholder for the tile number in file names.
const MARKER: &str = "<UDIM>";
/// Spellings of the placeholder in libraries: `<UDIM>` and `<udim>` of Mari and Arnold, `%(UDIM)d`
/// of Houdini.
const SPELLINGS: [&str; 3] = [MARKER, "<udim>", "%(UDIM)d"];
/// Range of the numbers of tiles.
const NUMBERS: RangeInclusive<u32> = 1001..=1999;

/// The tiles of a texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tiles {
    /// Number and file of each tile, sorted.
    files: Vec<(u32, PathBuf)>,
}

/// Possible names of the tiles of `name`, by number. `None` if `name` has no placeholder for the
/// number.
pub fn tile_names(name: &str) -> Option<impl Iterator<Item = String>> {
    let spelling = SPELLINGS.into_iter().find(|spelling| name.contains(spelling))?;
    Some(NUMBERS.map(move |number| name.replacen(spelling, &number.to_string(), 1)))
}

/// Path that means all tiles, made from the path `found` of one tile. The tile number comes after
/// `.`, `_` or `-` and before a `.`. `None` if the name has no tile number.
pub fn path_of_tiles(found: &Path) -> Option<PathBuf> {
    let name = found.file_name()?.to_str()?;
    let mut ends = name.match_indices('.').map(|(end, _)| end).filter(|&end| end >= 5);
    let start = ends.find_map(|end| {
        let start = end - 4;
        let number: u32 = name.get(start..end)?.parse().ok()?;
        let is_apart = name.get(..start)?.ends_with(['.', '_', '-']);
        (is_apart && NUMBERS.contains(&number)).then_some(start)
    })?;
    Some(found.with_file_name(format!("{}{MARKER}{}", &name[..start], &name[start + 4..])))
}

impl Tiles {
    /// Tiles of a path with the placeholder in its name; `None` for other paths.
    pub fn of_path(path: &Path) -> Option<Self> {
        let (before, after) = path.file_name()?.to_str()?.split_once(MARKER)?;
        let folder = path
            .parent()
            .filter(|folder| *folder != Path::new(""))
            .unwrap_or(Path::new("."));
        let number = |file: &Path| -> Option<u32> {
            let name = file.file_name()?.to_str()?;
            let digits = name.strip_prefix(before)?.strip_suffix(after)?;
            digits
                .parse()
                .ok()
                .filter(|number| digits.len() == 4 && NUMBERS.contains(number))
        };
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let files = entries.map(|entry| path.with_file_name(entry.file_name()));
        let mut files: Vec<(u32, PathBuf)> = files.filter_map(|file| Some((number(&file)?, file))).collect();
        files.sort();
        Some(Self { files })
    }

    /// Files of the tiles.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(_, file)| file.as_path())
    }

    /// Number of the tile at the texture coordinates `u` and `v`; `None` outside the range of
    /// numbers.
    pub fn number_at(u: f32, v: f32) -> Option<u32> {
        let (column, row) = (u.floor(), v.floor());
        let is_tile = (0.0..10.0).contains(&column) && (0.0..100.0).contains(&row);
        is_tile.then(|| NUMBERS.start() + column as u32 + 10 * row as u32)
    }

    /// Returns true if tile `number` has a file.
    pub fn has(&self, number: u32) -> bool {
        self.files.iter().any(|(known, _)| *known == number)
    }

    /// Number of columns and rows of the smallest grid of tiles from tile 1001 that contains all
    /// tiles.
    pub fn size(&self) -> [u32; 2] {
        let places = self.files.iter().map(|(number, _)| place(*number));
        places.fold([1, 1], |[columns, rows], [i, j]| [columns.max(i + 1), rows.max(j + 1)])
    }

    /// Header of the picture of all tiles, if each tile has the header `one`.
    pub(super) fn header(&self, one: PictureHeader) -> PictureHeader {
        let [columns, rows] = self.size().map(u64::from);
        PictureHeader {
            width: columns * one.width,
            height: rows * one.height,
            ..one
        }
    }

    /// Reads the pictures of all tiles with `read` and joins them. Tiles without a file are white.
    pub(super) fn picture(
        &self,
        mut read: impl FnMut(&Path) -> Result<Picture, FileError>,
    ) -> Result<Picture, FileError> {
        let pictures: Vec<Picture> = self.files().map(&mut read).collect::<Result<_, _>>()?;
        let Some(first) = pictures.first() else {
            return Err(FileError::new(
                Path::new(MARKER),
                "no file of a tile of this texture exists",
            ));
        };
        for (picture, file) in pictures.iter().zip(self.files()) {
            let of = |picture: &Picture| {
                format!(
                    "{}x{} texels of {} channels",
                    picture.width, picture.height, picture.channels
                )
            };
            let is_alike = (picture.width, picture.height, picture.channels)
                == (first.width, first.height, first.channels)
                && std::mem::discriminant(&picture.samples) == std::mem::discriminant(&first.samples);
            if !is_alike {
                let message = format!("this tile has {}, but the first tile has {}", of(picture), of(first));
                return Err(FileError::new(file, message).help("save all tiles with one size and one format"));
            }
        }
        let places: Vec<[u32; 2]> = self.files.iter().map(|(number, _)| place(*number)).collect();
        let grid = Grid {
            size: self.size().map(|n| n as usize),
            tile: [first.width * first.channels, first.height],
        };
        macro_rules! joined {
            ($kind:ident, $white:expr) => {{
                let tiles = pictures.iter().map(|picture| match &picture.samples {
                    Samples::$kind(samples) => samples.as_slice(),
                    _ => &[],
                });
                Samples::$kind(grid.joined(places.iter().zip(tiles), $white))
            }};
        }
        let samples = match &first.samples {
            Samples::Bytes(_) => joined!(Bytes, u8::MAX),
            Samples::Shorts(_) => joined!(Shorts, u16::MAX),
            Samples::Floats(_) => joined!(Floats, 1.0),
        };
        Ok(Picture {
            width: grid.size[0] * first.width,
            height: grid.size[1] * first.height,
            channels: first.channels,
            samples,
            orientation: first.orientation,
        })
    }
}

/// Column and row of a tile.
fn place(number: u32) -> [u32; 2] {
    let index = number - NUMBERS.start();
    [index % 10, index / 10]
}

/// Grid of tiles. All tiles have the same size.
struct Grid {
    /// Number of columns and rows of tiles.
    size: [usize; 2],
    /// Number of samples in a row of a tile, and number of rows.
    tile: [usize; 2],
}

impl Grid {
    /// Samples of all tiles, the upper row of tiles first.
    fn joined<'a, T: Copy + 'a>(&self, tiles: impl Iterator<Item = (&'a [u32; 2], &'a [T])>, white: T) -> Vec<T> {
        let ([columns, rows], [width, height]) = (self.size, self.tile);
        let mut all = vec![white; columns * rows * width * height];
        for ([column, row], samples) in tiles {
            let top = (rows - 1 - *row as usize) * height;
            for (y, line) in samples.chunks_exact(width.max(1)).enumerate() {
                let start = ((top + y) * columns + *column as usize) * width;
                all[start..start + width].copy_from_slice(line);
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_tiles_are_recognised() {
        for name in ["a.<UDIM>.png", "a.<udim>.png", "a.%(UDIM)d.png"] {
            let names: Vec<String> = tile_names(name).unwrap().take(11).collect();
            assert_eq!((&*names[0], &*names[10]), ("a.1001.png", "a.1011.png"));
        }
        assert!(tile_names("a.1001.png").is_none());
        for (found, tiles) in [
            ("x/a_1001.png", Some("x/a_<UDIM>.png")),
            ("a.1012.tif", Some("a.<UDIM>.tif")),
            ("a-1001.v2.png", Some("a-<UDIM>.v2.png")),
            ("a1001.png", None),
            ("a_2001.png", None),
            ("1001.png", None),
            ("a_10010.png", None),
            ("é_1001.png", Some("é_<UDIM>.png")),
            ("aéé1.png", None),
        ] {
            assert_eq!(path_of_tiles(Path::new(found)), tiles.map(PathBuf::from), "{found}");
        }
        assert_eq!(Tiles::number_at(0.5, 0.5), Some(1001));
        assert_eq!(Tiles::number_at(1.5, 2.5), Some(1022));
        assert_eq!(Tiles::number_at(10.5, 0.0), None);
        assert_eq!(Tiles::number_at(f32::NAN, 0.0), None);
    }

    #[test]
    fn tiles_are_found_and_joined() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.1001.png", "a.1012.png", "a.101.png", "b.1001.png", "a.1003.jpg"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let tiles = Tiles::of_path(&folder.path().join("a.<UDIM>.png")).unwrap();
        assert_eq!((tiles.files().count(), tiles.size()), (2, [2, 2]));
        assert!(tiles.has(1012) && !tiles.has(1002));
        let mut number = 0;
        let picture = tiles.picture(|_| {
            number += 10;
            let samples = Samples::Bytes((1..5).map(|i| i + number).collect());
            Ok(Picture {
                width: 2,
                height: 2,
                channels: 1,
                samples,
                orientation: 1,
            })
        });
        let expected = [255, 255, 21, 22, 255, 255, 23, 24, 11, 12, 255, 255, 13, 14, 255, 255];
        assert_eq!(picture.unwrap().samples, Samples::Bytes(expected.to_vec()));
    }
}
