//! Joins parts of a picture that were rendered separately.
//!
//! Headers are read first. The edges of all crops cut the picture into cells. In each cell, the
//! sample ranges of all parts that contain the cell must follow each other without gap or overlap.
//! Then the parts are read and added one after the other. Sums are exact (`film/fixed.rs`), so the
//! result is bit-identical to a single render.

use super::{Error, RenderState};
use crate::denoise::{DenoiseError, Denoiser};
use crate::files::Output;
use crate::film::{Film, Image, Rect};
use crate::io::{Description, FileError, Format, Metadata, describe_checkpoint, read_checkpoint};
use crate::math::UVec2;
use crate::options::Finish;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A part of a picture, as described by the header of its file.
#[derive(Clone, Debug)]
struct PicturePart {
    path: PathBuf,
    description: Description,
}

impl PicturePart {
    fn samples(&self) -> Range<u32> {
        self.description.metadata.first_sample..self.description.metadata.end_sample
    }

    fn error(&self, message: String, help: &str) -> Error {
        FileError::new(&self.path, message).help(help).into()
    }
}

/// Parts of one picture. Only their headers were read.
#[derive(Clone, Debug)]
pub struct PictureParts {
    /// Parts sorted by first sample and corner; never empty.
    parts: Vec<PicturePart>,
    extent: PartsExtent,
}

/// Result of joining the parts of a picture.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct JoinedPicture {
    /// Sums of all parts together.
    pub state: RenderState,
    /// Metadata of the joined parts.
    pub metadata: Metadata,
    /// True if some pixels or samples of the picture are missing.
    pub is_part: bool,
}

impl PictureParts {
    /// Reads only the headers of the files.
    ///
    /// # Errors
    ///
    /// A file is not a part of a picture, or the parts belong to different pictures.
    pub fn describe(paths: &[impl AsRef<Path>]) -> Result<Self, Error> {
        let describe = |path: &Path| {
            Ok(PicturePart {
                path: path.to_path_buf(),
                description: describe_checkpoint(path)?,
            })
        };
        let parts = paths.iter().map(|path| describe(path.as_ref()));
        let mut parts: Vec<PicturePart> = parts.collect::<Result<_, FileError>>()?;
        parts.sort_by_key(|part| {
            let corner = part.description.crop.min;
            (part.samples().start, corner.y, corner.x)
        });
        let Some((first, others)) = parts.split_first() else {
            let message = "no parts given\n  help: name the files to merge";
            return Err(Error::Refused(message.into()));
        };
        others.iter().try_for_each(|part| check_kinship(first, part))?;
        let extent = PartsExtent::new(first, &parts);
        Ok(Self { parts, extent })
    }

    /// Number of parts, as given to [`PictureParts::describe`].
    pub fn count(&self) -> usize {
        self.parts.len()
    }

    /// Denoiser, exposure and tone curve that were requested for the render of the first part.
    pub fn finish(&self) -> Finish {
        self.parts[0].description.metadata.finish()
    }

    /// Size of the whole picture.
    pub fn resolution(&self) -> UVec2 {
        self.extent.resolution
    }

    /// Size of one view of the picture: a face of a cube map, or the picture of an eye. The size of
    /// the whole picture if it has one view.
    pub fn view_size(&self) -> UVec2 {
        let Description {
            metadata, resolution, ..
        } = &self.parts[0].description;
        metadata.view_size(*resolution)
    }

    /// The smallest rectangle that contains all parts.
    pub fn crop(&self) -> Rect {
        self.extent.crop
    }

    /// Range of samples from the first sample to the last sample of all parts.
    pub fn samples(&self) -> Range<u32> {
        self.extent.samples.clone()
    }

    /// Joins the sums of all parts to the sums of one render. The order of the parts does not
    /// matter. The parts must contain all samples of the picture. If `is_enough` is true, samples
    /// before the first sample of all parts and after the last one may be missing.
    ///
    /// # Errors
    ///
    /// Samples are repeated, or files are damaged. Samples are missing or parts are unfinished,
    /// unless `allow_gaps` is true.
    pub fn join(&self, is_enough: bool, allow_gaps: bool) -> Result<JoinedPicture, Error> {
        let Self { parts, extent } = self;
        let wanted = if is_enough {
            extent.samples.clone()
        } else {
            0..extent.total
        };
        let has_gaps = extent.check(parts, wanted, allow_gaps)?;
        let state = extent.join(parts)?;
        let metadata = Metadata {
            first_sample: extent.samples.start,
            end_sample: extent.samples.end,
            total_samples: extent.total,
            render_seconds: state.seconds,
            complete: !has_gaps,
            // The sums belong to a picture that is not denoised
            denoiser: None,
            tone: None,
            ..parts[0].description.metadata.clone()
        };
        let is_all = extent.crop == Rect::full(extent.resolution) && extent.samples == (0..extent.total);
        Ok(JoinedPicture {
            state,
            metadata,
            is_part: has_gaps || !is_all,
        })
    }
}

impl JoinedPicture {
    /// The picture of the joined sums, without denoising.
    pub fn raw(&self) -> Image {
        let with_error = self.metadata.settings.contains(" noise=");
        self.state.develop(with_error, self.metadata.features.as_ref())
    }

    /// The picture of the joined sums, denoised according to `finish`. The denoiser is also written
    /// into [`JoinedPicture::metadata`]. Uses the threads of rayon's pool.
    ///
    /// # Errors
    ///
    /// Errors of the denoiser. The returned picture is then not denoised.
    pub fn develop(&mut self, finish: &Finish) -> (Image, Result<(), DenoiseError>) {
        let mut image = self.raw();
        let mut denoise = |denoiser: Denoiser| {
            let by = denoiser.version()?;
            denoiser.apply_with(&mut image, finish.denoise_radius)?;
            self.metadata.denoiser = Some(by);
            Ok(())
        };
        let done = finish.denoiser.map_or(Ok(()), &mut denoise);
        self.metadata.finish = finish.to_string();
        self.metadata.note_exposure(finish.tone, &image);
        (image, done)
    }

    /// Writes `image`, the result of [`JoinedPicture::develop`], to all `outputs`, and returns the
    /// errors. If pixels or samples are missing, EXR files also get the sums, so that further parts
    /// can be joined.
    #[must_use = "the errors name the files that were not written"]
    pub fn write(&self, image: &Image, outputs: &[(Format, Output)]) -> Vec<FileError> {
        self.state.write(image, outputs, self.is_part, &self.metadata)
    }
}

/// Returns an error if the parts are not of one picture.
fn check_kinship(first: &PicturePart, other: &PicturePart) -> Result<(), Error> {
    let (a, b) = (&first.description, &other.description);
    let difference = if a.resolution == b.resolution {
        a.metadata.difference(&b.metadata)
    } else {
        Some(format!("image size {} and {}", a.resolution, b.resolution))
    };
    difference.map_or(Ok(()), |difference| {
        Err(other.error(
            format!("belongs to another picture than {}: {difference}", first.path.display()),
            "merge parts of one scene with the same settings, seed, program and backend",
        ))
    })
}

/// Size of the picture, and region and samples that all parts cover together.
#[derive(Clone, Debug)]
struct PartsExtent {
    resolution: UVec2,
    /// The smallest rectangle that contains all parts.
    crop: Rect,
    samples: Range<u32>,
    /// Number of samples per pixel of the whole picture.
    total: u32,
}

impl PartsExtent {
    fn new(first: &PicturePart, parts: &[PicturePart]) -> Self {
        let around = |a: Rect, b: Rect| Rect {
            min: a.min.min(b.min),
            max: a.max.max(b.max),
        };
        let crops = parts.iter().map(|part| part.description.crop);
        let samples = || parts.iter().map(PicturePart::samples);
        Self {
            resolution: first.description.resolution,
            crop: crops.reduce(around).unwrap_or(first.description.crop),
            samples: samples().map(|s| s.start).min().unwrap_or(0)..samples().map(|s| s.end).max().unwrap_or(0),
            total: parts
                .iter()
                .map(|part| part.description.metadata.total_samples)
                .max()
                .unwrap_or(0),
        }
    }

    /// Returns true if any of the samples `wanted` is missing, or if a part is unfinished. Unless
    /// `allow_gaps` is true, this is an error. A repeated sample is always an error.
    fn check(&self, parts: &[PicturePart], wanted: Range<u32>, allow_gaps: bool) -> Result<bool, Error> {
        let mut gap = None;
        if let Some(part) = parts.iter().find(|part| !part.description.metadata.complete) {
            gap = Some(part.error(
                "this part is unfinished".into(),
                "finish it with --resume, or merge it with --allow-gaps",
            ));
        }
        // Divide the picture into cells at the edges of the crops. All pixels of a cell are in the
        // same parts.
        let edges = |of: fn(Rect) -> [u32; 2]| {
            let mut edges: Vec<u32> = parts.iter().flat_map(|part| of(part.description.crop)).collect();
            edges.sort_unstable();
            edges.dedup();
            edges
        };
        let (xs, ys) = (edges(|r| [r.min.x, r.max.x]), edges(|r| [r.min.y, r.max.y]));
        for y in ys.windows(2) {
            for x in xs.windows(2) {
                let corner = UVec2::new(x[0], y[0]);
                // Parts are sorted by their first samples.
                let here: Vec<&PicturePart> = parts.iter().filter(|p| p.description.crop.contains(corner)).collect();
                for pair in here.windows(2) {
                    let (a, b) = (pair[0].samples(), pair[1].samples());
                    if b.start < a.end {
                        return Err(pair[1].error(
                            format!(
                                "samples {}..{} of pixel {},{} are also in {}",
                                b.start,
                                b.end.min(a.end),
                                corner.x,
                                corner.y,
                                pair[0].path.display()
                            ),
                            "merge each part once",
                        ));
                    }
                }
                let ends = here.iter().map(|part| part.samples());
                let mut next = wanted.start;
                for samples in ends.chain(std::iter::once(wanted.end..wanted.end)) {
                    if samples.start > next && gap.is_none() {
                        gap = Some(Error::Failed(format!(
                            "samples {next}..{} of pixels {},{} to {},{} are missing from all parts\n  help: render them (--samples {next}..{}), or merge with --allow-gaps",
                            samples.start, x[0], y[0], x[1], y[1], samples.start
                        )));
                    }
                    next = samples.end;
                }
            }
        }
        match gap {
            Some(error) if !allow_gaps => Err(error),
            gap => Ok(gap.is_some()),
        }
    }

    /// Reads the parts from their files, and adds their sums.
    fn join(&self, parts: &[PicturePart]) -> Result<RenderState, Error> {
        let metadata = &parts[0].description.metadata;
        let view = metadata.view_size(self.resolution);
        let film = Film::of_views((self.resolution, view), self.crop, self.samples.start);
        // Take the channels of the first part: all parts have the same channels, because channels
        // belong to the settings
        let mut merged = RenderState::new(film, metadata.backing(), metadata.features.as_ref());
        for part in parts {
            let read = RenderState::of_checkpoint(read_checkpoint(&part.path)?)?;
            merged.film.merge(&read.film);
            merged.statistics = std::mem::take(&mut merged.statistics).merge(read.statistics);
            merged.seconds += read.seconds;
        }
        Ok(merged)
    }
}
