use super::args::MergeArgs;
use super::error::CliError;
use super::job::{all_threads, thread_pool, tone};
use super::keeper::{Progressed, write_state};
use super::run::prepare_images;
use crate::film::{Film, Rect};
use crate::io::{Description, FileError, Metadata, Output, SceneFile, describe_checkpoint, read_checkpoint};
use crate::math::UVec2;
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;

/// A part, by what its file says of itself.
struct Part {
    path: PathBuf,
    description: Description,
}

impl Part {
    fn samples(&self) -> Range<u32> {
        self.description.metadata.first_sample..self.description.metadata.end_sample
    }

    fn error(&self, message: String, help: &str) -> CliError {
        FileError::new(&self.path, message).help(help).into()
    }
}

/// Joins parts of a picture, and writes it.
pub(super) fn merge(args: &MergeArgs) -> Result<ExitCode, CliError> {
    let images = prepare_images(&args.output, tone(&SceneFile::default(), &args.tone)?)?;
    let checkpoint = args.checkpoint.as_deref().map(Output::prepare).transpose()?;
    let describe = |path: &PathBuf| {
        Ok(Part {
            path: path.clone(),
            description: describe_checkpoint(path)?,
        })
    };
    // Headers first: what does not fit together is refused before anything large is read.
    let mut parts: Vec<Part> = args.parts.iter().map(describe).collect::<Result<_, FileError>>()?;
    parts.sort_by_key(|part| {
        let corner = part.description.crop.min;
        (part.samples().start, corner.y, corner.x)
    });
    let Some((first, others)) = parts.split_first() else {
        return Err(CliError::Usage(
            "no parts given\n  help: name the files to merge".into(),
        ));
    };
    others.iter().try_for_each(|part| check_kinship(first, part))?;
    let whole = Whole::new(first, &parts);
    // A picture takes all samples; sums that are only kept may be a part of them.
    let wanted = match args.output.is_empty() {
        true => whole.samples.clone(),
        false => 0..whole.total,
    };
    let gaps = whole.check(&parts, wanted, args.allow_gaps)?;

    // The sums, in whatever order, are those of one render.
    let pool = thread_pool(args.threads.unwrap_or_else(all_threads))?;
    let merged = pool.install(|| whole.join(&parts, &first.description.metadata))?;
    let metadata = Metadata {
        first_sample: whole.samples.start,
        end_sample: whole.samples.end,
        total_samples: whole.total,
        render_seconds: merged.seconds,
        complete: !gaps,
        // Sums are raw.
        denoiser: None,
        ..first.description.metadata.clone()
    };
    let is_part = gaps || whole.crop != Rect::full(whole.resolution) || whole.samples != (0..whole.total);
    let with_error = metadata.settings.contains(" noise=");
    let mut failures: Vec<FileError> = Vec::new();
    pool.install(|| {
        failures.extend(checkpoint.and_then(|output| write_state(&output, &merged, &metadata).err()));
        failures.extend(merged.write(&merged.develop(with_error, &metadata), &images, is_part, &metadata));
    });
    if !failures.is_empty() {
        let words: Vec<String> = failures.iter().map(FileError::to_string).collect();
        return Err(CliError::Failed(words.join("\nerror: ")));
    }
    if !args.quiet {
        let Range { start, end } = whole.samples;
        eprintln!(
            "{} parts, samples {start}..{end} of {}x{} pixels, {:.1} s of rendering{}",
            parts.len(),
            whole.crop.size().x,
            whole.crop.size().y,
            merged.seconds,
            if gaps { ", with gaps" } else { "" }
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// An error where both are not of one picture.
fn check_kinship(first: &Part, other: &Part) -> Result<(), CliError> {
    let (a, b) = (&first.description, &other.description);
    let difference = match a.resolution == b.resolution {
        true => a.metadata.difference(&b.metadata),
        false => Some(format!("image size {} and {}", a.resolution, b.resolution)),
    };
    difference.map_or(Ok(()), |difference| {
        Err(other.error(
            format!(
                "not a part of the picture that {} is of: {difference}",
                first.path.display()
            ),
            "merge parts of one scene with the same settings, seed, program and backend",
        ))
    })
}

/// What the parts should give.
struct Whole {
    resolution: UVec2,
    /// The smallest rectangle around all parts.
    crop: Rect,
    samples: Range<u32>,
    /// Samples of a pixel of the whole picture.
    total: u32,
}

impl Whole {
    fn new(first: &Part, parts: &[Part]) -> Self {
        let around = |a: Rect, b: Rect| Rect {
            min: a.min.min(b.min),
            max: a.max.max(b.max),
        };
        let crops = parts.iter().map(|part| part.description.crop);
        let samples = || parts.iter().map(Part::samples);
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

    /// Whether anything of the samples `wanted` is missing, which is an error unless `allow_gaps`. An error where something is there twice.
    fn check(&self, parts: &[Part], wanted: Range<u32>, allow_gaps: bool) -> Result<bool, CliError> {
        let mut gap = None;
        if let Some(part) = parts.iter().find(|part| !part.description.metadata.complete) {
            gap = Some(part.error(
                "this part is not finished".into(),
                "render the rest of it by --resume, or merge what there is by --allow-gaps",
            ));
        }
        // Edges of crops cut the picture into cells, in each of which all pixels are in the same parts.
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
                let here: Vec<&Part> = parts.iter().filter(|p| p.description.crop.contains(corner)).collect();
                for pair in here.windows(2) {
                    let (a, b) = (pair[0].samples(), pair[1].samples());
                    if b.start < a.end {
                        return Err(pair[1].error(
                            format!(
                                "samples {}..{} of pixel {},{} are in {} too",
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
                        gap = Some(CliError::Failed(format!(
                            "samples {next}..{} of pixels {},{} to {},{} are in no part\n  help: render them \
                             (--samples {next}..{}), or merge what there is by --allow-gaps",
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

    /// All sums.
    fn join(&self, parts: &[Part], metadata: &Metadata) -> Result<Progressed, CliError> {
        let film = Film::starting_at(self.resolution, self.crop, self.samples.start);
        // All parts sum the same: that is a part of their settings.
        let mut merged = Progressed::of_film(film, metadata);
        for part in parts {
            let read = Progressed::of_checkpoint(&part.path, read_checkpoint(&part.path)?)?;
            merged.film.merge(&read.film);
            merged.statistics = merged.statistics.merge(read.statistics);
            merged.seconds += read.seconds;
        }
        Ok(merged)
    }
}
