//! Checkpoints: the complete state of a film in an EXR file, from which a render resumes.
//!
//! The state is a list of 32-bit words per pixel (`film/state.rs`). Each word is an integer
//! channel. Channels are written row by row, without a copy of the film. The header has a digest of
//! all data. Nothing is compressed: a checkpoint is written often, and half of the words are too
//! random to be compressed. `files/output.rs` replaces the file atomically.
//!
//! A picture without the sums of its pixels cannot be resumed. `Renderer::resume` compares the
//! metadata of a checkpoint with the render.

use super::exr::{Header, RowChannel, write_rows};
use super::exr_text::text_attribute;
use super::header_limits::check_exr;
use super::{FileError, Metadata};
use crate::files::Output;
use crate::files::input::{CountingReader, Input, Position, ReadFailure};
use crate::files::memory::Allowance;
use crate::film::{Accumulator, Film, MAX_PARTS, Rect, StateLayout};
use crate::math::{Encode, UVec2};
use ::exr::block;
use ::exr::block::lines::LineIndex;
use ::exr::meta::attribute::ChannelDescription;
use ::exr::meta::header::Header as ExrHeader;
use ::exr::prelude as exr;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Prefix of the channels that hold the words of a film ([`StateLayout::names`]).
const PREFIX: &str = "state.";
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
        let color = |(c, name): (usize, &str)| RowChannel {
            name: name.into(),
            kind: exr::SampleType::F32,
            fill: Box::new(move |row, bytes| {
                fill_row(film, row, bytes, |sums| (sums.mean(c) as f32).to_ne_bytes());
            }),
        };
        let mut channels: Vec<RowChannel> = ["R", "G", "B"].into_iter().enumerate().map(color).collect();
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

    /// Channels of the state, one for each word of a pixel.
    pub(super) fn channels(&self) -> Vec<RowChannel<'_>> {
        let rows = Arc::new(Rows::new(self.film));
        let names = rows.layout.names().into_iter().enumerate();
        let words = names.map(|(i, name)| {
            let rows = rows.clone();
            RowChannel {
                name: format!("{PREFIX}{name}"),
                kind: exr::SampleType::U32,
                fill: Box::new(move |row, bytes| rows.fill(row, i, bytes)),
            }
        });
        words.collect()
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
        let layout = StateLayout::of_film(self.film);
        let rows: Vec<_> = (0..crop.size().y as usize)
            .into_par_iter()
            .map(|row| {
                let words = words_of_row(self.film, &layout, row);
                let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
                Sha256::digest(&bytes)
            })
            .collect();
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
        rows.iter().for_each(|row| hash.update(row));
        format!("{:x}", hash.finalize())
    }
}

/// Words of all pixels of the row `row`, which is counted from the top of the crop.
fn words_of_row(film: &Film, layout: &StateLayout, row: usize) -> Vec<u32> {
    let mut words = Vec::new();
    for pixel in pixels_of_row(film.crop(), row) {
        if let Some(tile) = film.tile_at(pixel) {
            layout.append(tile, pixel, &mut words);
        }
    }
    words
}

/// Words of a film by row. The EXR writer requests the same row once for each channel. The words of
/// the last row are kept, so they are computed only once.
struct Rows<'a> {
    film: &'a Film,
    layout: StateLayout,
    /// Number of words per pixel.
    count: usize,
    /// Row of the last request, with its words.
    last: Mutex<(Option<usize>, Vec<u32>)>,
}

impl<'a> Rows<'a> {
    fn new(film: &'a Film) -> Self {
        let layout = StateLayout::of_film(film);
        Self {
            film,
            count: layout.names().len(),
            layout,
            last: Mutex::default(),
        }
    }

    /// Copies word `i` of each pixel of a row to `bytes`.
    fn fill(&self, row: usize, i: usize, bytes: &mut [u8]) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.0 != Some(row) {
            *last = (Some(row), words_of_row(self.film, &self.layout, row));
        }
        let words = last.1.iter().skip(i).step_by(self.count);
        for (bytes, word) in bytes.chunks_exact_mut(4).zip(words) {
            bytes.copy_from_slice(&word.to_ne_bytes());
        }
    }
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
    layout: StateLayout,
    /// For each channel of the file, the index of the word that the channel holds. `None` if the
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

        // Find the crop of the picture, and the word that each channel holds
        let (resolution, crop) = windows(header).ok_or_else(|| damaged(path, &"its windows are invalid"))?;
        let min = match header.compression {
            exr::Compression::Uncompressed => crop.area() * Accumulator::WORDS as u64,
            _ => crop.area() / 8,
        };
        if length < min {
            return Err(damaged(path, &"it is too short for its pixels"));
        }
        let word = |channel: &ChannelDescription| {
            let name = channel.name.to_string();
            let is_word = channel.sample_type == exr::SampleType::U32;
            name.strip_prefix(PREFIX).filter(|_| is_word).map(str::to_string)
        };
        let words: Vec<Option<String>> = header.channels.list.iter().map(word).collect();
        let names: Vec<String> = words.iter().flatten().cloned().collect();
        let layout = StateLayout::of_names(&names).ok_or_else(stateless)?;
        if layout.parts() > MAX_PARTS {
            return Err(damaged(path, &"it has too many light path channels"));
        }
        let names = layout.names();
        let place = |word: Option<String>| names.iter().position(|name| Some(name) == word.as_ref());
        let places = words.into_iter().map(place).collect();
        Ok(Self {
            resolution,
            crop,
            layout,
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
        let meta = self.reader.meta_data().clone();
        let channels = meta.headers.first().map(|header| &header.channels);
        let channels = channels.ok_or_else(|| damaged(path, &"it has no layer"))?;
        // The settings must have a background if, and only if, the film has sums of the background.
        let backing = self.metadata.backing();
        if backing.is_some() != self.layout.has_background() {
            return Err(damaged(path, &"its sums do not match its settings"));
        }
        let mut bytes = Film::bytes(self.crop) + Film::part_bytes(self.crop, self.layout.parts());
        if self.layout.has_background() {
            bytes += Film::coverage_bytes(self.crop);
        }
        if self.layout.has_features() {
            bytes += Film::feature_bytes(self.crop);
        }
        Allowance::of_system().check(path, bytes)?;
        let unread = |error: ::exr::error::Error| self.failure.or(path, damaged(path, &error));
        let view = self.metadata.view_size(self.resolution);
        let mut film = Film::of_views((self.resolution, view), self.crop, self.metadata.first_sample);
        let width = self.crop.size().x as usize;
        film = film.with_parts(self.layout.parts());
        if let Some(backing) = backing {
            film = film.with_backing(backing);
        }
        if self.layout.has_features() {
            film = film.with_features();
        }
        let mut words = vec![vec![0; self.layout.names().len()]; width];
        let last_channel = self.places.len() - 1;
        for chunk in self.reader.all_chunks(false).map_err(unread)? {
            let chunk = chunk.map_err(unread)?;
            let block = block::UncompressedBlock::decompress_chunk(chunk, &meta, false);
            let block = block.map_err(|e| damaged(path, &e))?;
            for (bytes, line) in LineIndex::lines_in_block(block.index, channels) {
                let bytes = block.data.get(bytes);
                let bytes = bytes.ok_or_else(|| damaged(path, &"a block is too short"))?;
                if let Some(place) = self.places[line.channel] {
                    for (words, bytes) in words.iter_mut().zip(bytes.chunks_exact(4)) {
                        words[place] = u32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                    }
                }
                if line.channel == last_channel {
                    put_row(&mut film, self.layout, line.position.y(), &words);
                }
            }
        }
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
            return Err(damaged(path, &"its contents have changed since they were written"));
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

fn put_row(film: &mut Film, layout: StateLayout, row: usize, words: &[Vec<u32>]) {
    for (pixel, words) in pixels_of_row(film.crop(), row).zip(words) {
        if let Some(tile) = film.tile_at_mut(pixel) {
            layout.put(tile, pixel, words);
        }
    }
}

fn pixels_of_row(crop: Rect, row: usize) -> impl Iterator<Item = UVec2> {
    let y = crop.min.y + row as u32;
    (crop.min.x..crop.max.x).map(move |x| UVec2::new(x, y))
}

/// Fills `bytes` with four bytes per pixel of the row `row` of `film`. `of` returns the bytes of a
/// pixel.
fn fill_row(film: &Film, row: usize, bytes: &mut [u8], of: impl Fn(&Accumulator) -> [u8; 4]) {
    for (bytes, pixel) in bytes.chunks_exact_mut(4).zip(pixels_of_row(film.crop(), row)) {
        if let Some(sums) = film.sums(pixel) {
            bytes.copy_from_slice(&of(sums));
        }
    }
}
