//! Checkpoints: the complete state of a film in an EXR file, from which a render resumes.
//!
//! The state is a sequence of bytes: the packed sums of all tiles (`film/tile_sums.rs`). The bytes
//! fill integer channels `state.0000`, `state.0001`, … row by row, so that any program can show the
//! picture of the file. The value of a state channel at a pixel has no meaning of its own. The
//! header has a digest of all data. Nothing is compressed in addition: a checkpoint is written
//! often, and the bytes of packed sums are random. `files/output.rs` replaces the file atomically.
//!
//! A picture without the sums of its pixels cannot be resumed. `Renderer::resume` compares the
//! metadata of a checkpoint with the render.

use super::exr::{ExrFormat, Header, RowChannel, rows_of, write_rows};
use super::exr_text::text_attribute;
use super::header_limits::check_exr;
use super::{FileError, Metadata};
use crate::files::Output;
use crate::files::input::{CountingReader, Input, Position, ReadFailure};
use crate::files::memory::Allowance;
use crate::film::{Film, MAX_PARTS, Quantities, Rect};
use crate::math::{Encode, UVec2};
use ::exr::block;
use ::exr::block::lines::LineIndex;
use ::exr::meta::attribute::ChannelDescription;
use ::exr::meta::header::Header as ExrHeader;
use ::exr::prelude as exr;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Prefix of the channels that hold the bytes of the state. The index of the channel follows.
const PREFIX: &str = "state.";
/// Bytes of a value of a state channel.
const WORD: u64 = size_of::<u32>() as u64;
/// Name of the attribute with the digest of all data.
const DIGEST: &str = "embrasure.stateDigest";
/// Name of the attribute with the statistics.
const STATISTICS: &str = "embrasure.statistics";

/// Complete state of a render, written with the picture. A render can resume from the state. States
/// of several parts of a picture can be merged.
#[derive(Clone, Copy, Debug)]
pub struct State<'a> {
    /// Sums of the pixels.
    pub film: &'a Film,
    /// Statistics of the render, as text in a format of this program.
    pub statistics: &'a str,
}

/// Contents of a file with a [`State`].
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// Path of the file.
    pub path: PathBuf,
    /// Sums of the pixels.
    pub film: Film,
    /// Metadata of the render.
    pub metadata: Metadata,
    /// Statistics of the render.
    pub statistics: String,
}

impl State<'_> {
    /// Writes a checkpoint: the state, and the current picture as `R G B`. The file is not
    /// compressed, because it is written often.
    pub fn write(&self, output: &Output, metadata: &Metadata) -> Result<(), FileError> {
        let film = self.film;
        let mut picture = film.develop_picture();
        picture.channels.truncate(3);
        let mut channels = rows_of(&picture, &ExrFormat::default());
        channels.extend(self.channels());
        let header = Header {
            resolution: film.resolution(),
            crop: film.crop(),
            metadata: Some(metadata),
            camera: None,
            attributes: self.attributes(metadata),
            compression: exr::Compression::Uncompressed,
        };
        output.write(|writer| write_rows(writer, header, channels))
    }

    /// Channels that hold the bytes of the state: as many as are needed.
    pub(super) fn channels(&self) -> Vec<RowChannel<'_>> {
        let bytes = Arc::new(StateBytes::new(self.film));
        let crop = self.film.crop();
        let width = u64::from(crop.size().x);
        // With two channels, the first row has the whole start of the state.
        let count = bytes.length.div_ceil(WORD * crop.area()).max(2);
        let channels = (0..count).map(|i| {
            let bytes = bytes.clone();
            RowChannel {
                name: format!("{PREFIX}{i:04}"),
                kind: exr::SampleType::U32,
                fill: Box::new(move |row, values| {
                    bytes.copy((row as u64 * count + i) * WORD * width, values);
                    // The writer needs the words in the order of the machine.
                    swap_words(values);
                }),
            }
        });
        channels.collect()
    }

    pub(super) fn attributes(&self, metadata: &Metadata) -> Vec<(String, String)> {
        vec![
            (STATISTICS.into(), self.statistics.into()),
            (DIGEST.into(), self.digest(metadata)),
        ]
    }

    /// SHA-256 of all data that a resumed render uses, to detect damage.
    fn digest(&self, metadata: &Metadata) -> String {
        let crop = self.film.crop();
        let tiles = self.film.tiles().par_iter();
        let tiles: Vec<_> = tiles.map(|tile| Sha256::digest(tile.packed())).collect();
        let mut hash = Sha256::new();
        // The file stores rounded seconds, so the digest leaves the seconds out.
        let exact = Metadata {
            render_seconds: 0.0,
            ..metadata.clone()
        };
        let sink = &mut |bytes: &[u8]| hash.update(bytes);
        exact.encode(sink);
        self.film.resolution().encode(sink);
        crop.encode(sink);
        self.statistics.encode(sink);
        let Quantities {
            has_background,
            has_features,
            parts,
        } = self.film.quantities();
        hash.update([u8::from(has_background), u8::from(has_features)]);
        hash.update((parts as u64).to_le_bytes());
        for (tile, digest) in self.film.tiles().iter().zip(&tiles) {
            hash.update(tile.target().to_le_bytes());
            hash.update(digest);
        }
        format!("{:x}", hash.finalize())
    }
}

/// Changes words of 32 bits from the byte order of the state, the lowest byte first, to the byte
/// order of the machine, or back.
fn swap_words(bytes: &mut [u8]) {
    for word in bytes.chunks_exact_mut(4) {
        let value = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        word.copy_from_slice(&value.to_ne_bytes());
    }
}

/// Start of the state: the quantities of the film.
fn start_of_state(quantities: Quantities) -> [u8; START] {
    let [a, b, c, d] = (quantities.parts as u32).to_le_bytes();
    [
        a,
        b,
        c,
        d,
        quantities.has_background.into(),
        quantities.has_features.into(),
    ]
}

/// Quantities of a film whose state starts with `bytes`. `None` if the bytes are invalid.
fn quantities_of(bytes: [u8; START]) -> Option<Quantities> {
    let [parts @ .., background, features] = bytes;
    let quantities = Quantities {
        has_background: background == 1,
        has_features: features == 1,
        parts: u32::from_le_bytes(parts) as usize,
    };
    (quantities.parts <= MAX_PARTS && start_of_state(quantities) == bytes).then_some(quantities)
}

/// Number of bytes of [`start_of_state`].
const START: usize = 6;
/// Number of bytes before the packed sums of a tile: its target, and the number of its bytes.
const TILE_START: usize = 8;

/// The bytes of the state of a film: [`start_of_state`], then the tiles. Large films have packed
/// tiles, which are not copied.
struct StateBytes<'a> {
    quantities: Quantities,
    tiles: Vec<TileBytes<'a>>,
    /// Number of bytes.
    length: u64,
}

/// The bytes of the state of a tile.
struct TileBytes<'a> {
    /// Position of the first byte in the bytes of the film.
    start: u64,
    target: u32,
    packed: Cow<'a, [u8]>,
}

impl<'a> StateBytes<'a> {
    fn new(film: &'a Film) -> Self {
        let mut length = START as u64;
        let tiles = film.tiles().iter().map(|tile| {
            let (start, packed) = (length, tile.packed());
            length += (TILE_START + packed.len()) as u64;
            TileBytes {
                start,
                target: tile.target(),
                packed,
            }
        });
        Self {
            quantities: film.quantities(),
            tiles: tiles.collect(),
            length,
        }
    }

    /// Fills `values` with the bytes from the position `from` on, and with zeros after the end.
    fn copy(&self, from: u64, values: &mut [u8]) {
        values.fill(0);
        let end = from + values.len() as u64;
        let mut put = |start: u64, bytes: &[u8]| {
            let skipped = from.saturating_sub(start).min(bytes.len() as u64) as usize;
            let place = start.saturating_sub(from).min(values.len() as u64) as usize;
            let (bytes, values) = (&bytes[skipped..], &mut values[place..]);
            let count = bytes.len().min(values.len());
            values[..count].copy_from_slice(&bytes[..count]);
        };
        put(0, &start_of_state(self.quantities));
        let first = self.tiles.partition_point(|tile| tile.start <= from).saturating_sub(1);
        let tiles = self.tiles.iter().skip(first);
        for TileBytes { start, target, packed } in tiles.take_while(|tile| tile.start < end) {
            put(*start, &target.to_le_bytes());
            put(start + TILE_START as u64 / 2, &(packed.len() as u32).to_le_bytes());
            put(start + TILE_START as u64, packed);
        }
    }
}

/// Reads the bytes of a state, and sets the sums of the tiles of a film.
struct StateReader {
    film: Film,
    /// Bytes that were not yet read.
    bytes: Vec<u8>,
    /// Index of the next tile.
    next: usize,
}

impl StateReader {
    /// Sets all tiles whose bytes are complete. Returns `None` if they are not sums of these tiles.
    fn advance(&mut self) -> Option<()> {
        let mut rest = self.bytes.as_slice();
        while let Some(tile) = self.film.tiles_mut().get_mut(self.next) {
            let Some(([target, length], packed)) = numbers(rest) else {
                break;
            };
            let Some((packed, after)) = packed.split_at_checked(length as usize) else {
                break;
            };
            tile.set_target(target);
            tile.set_packed(packed)?;
            self.next += 1;
            rest = after;
        }
        let read = self.bytes.len() - rest.len();
        self.bytes.drain(..read);
        Some(())
    }

    /// The film, if all tiles were set and only zeros follow.
    fn finish(self) -> Option<Film> {
        let is_complete = self.next == self.film.tiles().len() && self.bytes.iter().all(|&byte| byte == 0);
        is_complete.then_some(self.film)
    }
}

/// Two numbers at the start of `bytes`, and the bytes after them.
fn numbers(bytes: &[u8]) -> Option<([u32; 2], &[u8])> {
    let ([a, b, c, d, e, f, g, h], rest) = bytes.split_first_chunk::<TILE_START>()?;
    Some(([[*a, *b, *c, *d], [*e, *f, *g, *h]].map(u32::from_le_bytes), rest))
}

/// Header of a file with a [`State`].
#[derive(Clone, Debug)]
pub struct Description {
    /// Size of the full image.
    pub resolution: UVec2,
    /// Part of the full image that the file holds.
    pub crop: Rect,
    /// Metadata of the render.
    pub metadata: Metadata,
}

/// Reads the header of the file, without its pixels.
pub fn describe_checkpoint(path: &Path) -> Result<Description, FileError> {
    let opened = OpenCheckpoint::new(path)?;
    Ok(Description {
        resolution: opened.resolution,
        crop: opened.crop,
        metadata: opened.metadata,
    })
}

/// Reads the file of a [`State`], either a checkpoint or a picture with its state. Returns an error
/// if the data differ from the digest in the header.
pub fn read_checkpoint(path: impl AsRef<Path>) -> Result<Checkpoint, FileError> {
    let path = path.as_ref();
    OpenCheckpoint::new(path)?.read(path)
}

/// First bytes of an EXR file (OpenEXR file layout, "Magic number").
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

fn damaged(path: &Path, error: &dyn std::fmt::Display) -> FileError {
    let mut magic = [0; 4];
    let begins = File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    if begins.is_ok() && magic != EXR_MAGIC {
        let message = "this is not an EXR file: only EXR files keep the sums of a render";
        return FileError::new(path, message).help("render the part again with -o PART.exr or --checkpoint PART.exr");
    }
    FileError::new(path, format!("this file is damaged: {error}")).help("use an earlier copy, or render it anew")
}

/// A file whose header has been read.
struct OpenCheckpoint {
    reader: block::reader::Reader<CountingReader<BufReader<Input>>>,
    /// Length of the file in bytes.
    length: u64,
    /// Position of the reader in the file.
    position: Position,
    failure: ReadFailure,
    resolution: UVec2,
    crop: Rect,
    /// For each channel of the file, its index among the channels of the state. `None` if the
    /// channel does not belong to the state.
    places: Vec<Option<usize>>,
    metadata: Metadata,
    statistics: String,
    digest: String,
}

impl OpenCheckpoint {
    fn new(path: &Path) -> Result<Self, FileError> {
        let input = Input::open(path, "the file").map_err(|error| error.help_if_none("check the path"))?;
        let (length, failure) = (input.length(), input.failure());
        let counted = CountingReader::new(input.buffered(path)?);
        let position = counted.position();
        let reader = block::read(counted, false);
        let reader = reader.map_err(|e| failure.or(path, damaged(path, &e)))?;
        check_exr(path, length, reader.meta_data())?;
        let header = reader
            .headers()
            .first()
            .ok_or_else(|| damaged(path, &"it has no layer"))?;
        let stateless = || {
            FileError::new(path, "this file holds a picture, but not the sums of its samples").help(
                "use a file from --checkpoint, or from -o with --samples or --crop; a picture without its sums cannot be resumed",
            )
        };
        let attributes = &header.own_attributes;
        let digest = text_attribute(attributes, DIGEST).ok_or_else(stateless)?;
        let statistics = text_attribute(attributes, STATISTICS).ok_or_else(stateless)?;
        let metadata = Metadata::of_attributes(attributes).ok_or_else(stateless)?;

        // Find the crop of the picture, and the channels of the state
        let (resolution, crop) = windows(header).ok_or_else(|| damaged(path, &"its windows are invalid"))?;
        let place = |channel: &ChannelDescription| {
            let is_word = channel.sample_type == exr::SampleType::U32;
            let name = channel.name.to_string();
            name.strip_prefix(PREFIX).filter(|_| is_word)?.parse().ok()
        };
        let places: Vec<Option<usize>> = header.channels.list.iter().map(place).collect();
        let mut indices: Vec<usize> = places.iter().flatten().copied().collect();
        indices.sort_unstable();
        if indices.is_empty() || !indices.iter().enumerate().all(|(i, &index)| i == index) {
            let error = FileError::new(path, "another version of this program wrote the sums of this file");
            return Err(error.help("use the version that wrote it, or render it anew"));
        }
        let min = match header.compression {
            exr::Compression::Uncompressed => crop.area() * WORD * indices.len() as u64,
            _ => crop.area() / 8,
        };
        if length < min {
            return Err(damaged(path, &"it is too short for its pixels"));
        }
        Ok(Self {
            resolution,
            crop,
            places,
            metadata,
            statistics,
            digest,
            reader,
            length,
            position,
            failure,
        })
    }

    /// Reads all rows.
    fn read(self, path: &Path) -> Result<Checkpoint, FileError> {
        let view = self.metadata.view_size(self.resolution);
        let meta = self.reader.meta_data().clone();
        let channels = meta.headers.first().map(|header| &header.channels);
        let channels = channels.ok_or_else(|| damaged(path, &"it has no layer"))?;
        let words = self.places.iter().flatten().count() as u64;
        let bytes = self.crop.area().saturating_mul(words * WORD + Film::EMPTY_BYTES);
        Allowance::of_system().check(path, bytes.max(Film::bytes(self.crop, 0)))?;

        let row_bytes = self.crop.size().x as usize * WORD as usize;
        let mut row = vec![0; words as usize * row_bytes];
        let mut state: Option<StateReader> = None;
        let last_channel = self.places.len() - 1;
        let unread = |error: ::exr::error::Error| self.failure.or(path, damaged(path, &error));
        let changed = || damaged(path, &"its contents have changed since they were written");
        for chunk in self.reader.all_chunks(false).map_err(unread)? {
            let chunk = chunk.map_err(unread)?;
            let block = block::UncompressedBlock::decompress_chunk(chunk, &meta, false);
            let block = block.map_err(|e| damaged(path, &e))?;
            for (bytes, line) in LineIndex::lines_in_block(block.index, channels) {
                let bytes = block.data.get(bytes);
                let bytes = bytes.ok_or_else(|| damaged(path, &"a block is too short"))?;
                let place = self.places[line.channel].map(|place| place * row_bytes);
                if let Some(values) = place.and_then(|place| row.get_mut(place..place + bytes.len())) {
                    values.copy_from_slice(bytes);
                }
                if line.channel < last_channel {
                    continue;
                }
                swap_words(&mut row);
                let reader = match &mut state {
                    Some(reader) => {
                        reader.bytes.extend(&row);
                        reader
                    }
                    None => {
                        let film = Film::of_views((self.resolution, view), self.crop, self.metadata.first_sample);
                        let (start, rest) = row.split_first_chunk().ok_or_else(changed)?;
                        let quantities = quantities_of(*start).ok_or_else(changed)?;
                        // The settings must have a background if, and only if, the film has sums of
                        // the background.
                        if self.metadata.backing().is_some() != quantities.has_background {
                            return Err(damaged(path, &"its sums do not match its settings"));
                        }
                        state.insert(StateReader {
                            film: film.with_quantities(quantities, self.metadata.backing()),
                            bytes: rest.to_vec(),
                            next: 0,
                        })
                    }
                };
                reader.advance().ok_or_else(changed)?;
            }
        }
        let film = state.and_then(StateReader::finish).ok_or_else(changed)?;
        check_end(path, self.position.get(), self.length)?;
        let state = State {
            film: &film,
            statistics: &self.statistics,
        };
        if self.metadata.build.is_empty() {
            let error = FileError::new(path, "this file does not name the build that wrote it");
            return Err(error.help("use the program that wrote it, or render it anew"));
        }
        if state.digest(&self.metadata) != self.digest {
            return Err(changed());
        }
        Ok(Checkpoint {
            path: path.to_path_buf(),
            film,
            metadata: self.metadata,
            statistics: self.statistics,
        })
    }
}

/// Returns an error if bytes follow the `end` of the last chunk. They are either a second file,
/// whose data would be lost, or the rest of a longer file after an interrupted copy.
fn check_end(path: &Path, end: u64, length: u64) -> Result<(), FileError> {
    let more = length.saturating_sub(end);
    if more == 0 {
        return Ok(());
    }
    let bytes = if more == 1 {
        "1 byte follows"
    } else {
        &format!("{more} bytes follow")
    };
    let message = format!("this file is damaged: {bytes} the end of its image at byte {end}");
    Err(FileError::new(path, message).help(format!(
        "copy it again; if it is two files in one, separate them: the first has {end} bytes (head -c {end})"
    )))
}

/// Size of the full image, and the part of the full image that the layer holds.
fn windows(header: &ExrHeader) -> Option<(UVec2, Rect)> {
    let unsigned = |x: i32, y: i32| Some(UVec2::new(u32::try_from(x).ok()?, u32::try_from(y).ok()?));
    let (size, layer) = (header.shared_attributes.display_window.size, header.layer_size);
    let resolution = UVec2::new(u32::try_from(size.x()).ok()?, u32::try_from(size.y()).ok()?);
    let at = header.own_attributes.layer_position;
    let min = unsigned(at.x(), at.y())?;
    let size = UVec2::new(u32::try_from(layer.x()).ok()?, u32::try_from(layer.y()).ok()?);
    let max = UVec2::new(min.x.checked_add(size.x)?, min.y.checked_add(size.y)?);
    let crop = Rect { min, max };
    crop.is_inside(resolution).then_some((resolution, crop))
}
