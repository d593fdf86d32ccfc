//! Lists of cameras: TOML files with one `[[camera]]` for each camera, and CSV files with one line
//! for each camera. They use the keys of `[camera]`, and the keys `name`, `width` and `height`.

use super::FileCamera;
use crate::files::read_text;
use crate::math::{UVec2, excerpt};
use crate::options::{CameraOptions, Input, OptionGroup, SizeOptions};
use crate::scene_file::option_section::OptionSection;
use crate::scene_file::overrides::Overrides;
use crate::scene_file::source::Source;
use crate::scene_file::unknown_key::unknown_key;
use crate::scene_file::{FileError, Position};
use serde::Deserialize;
use std::path::Path;

/// Keys of TOML and CSV lists that are not camera options.
const NAME: &str = "name";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    #[serde(default)]
    camera: Vec<OptionSection>,
}

fn camera(name: String, size: SizeOptions, options: CameraOptions) -> FileCamera {
    FileCamera {
        name,
        size: size.width.zip(size.height).map(UVec2::from),
        options,
        horizontal_fov: None,
    }
}

/// Reads the cameras of a TOML file.
pub(super) fn read_toml(path: &Path) -> Result<Vec<FileCamera>, FileError> {
    let text = read_text(path, "the file of cameras")?;
    let list: List = toml::from_str(&text).map_err(|error| {
        let place = error.span().map(|span| Position::of_byte(&text, span.start));
        let wrong =
            FileError::new(path, error.message().trim()).help("write a [[camera]] for each camera, with a `name`");
        match place {
            Some(place) => wrong.at(place),
            None => wrong,
        }
    })?;
    let source = Source::of_file(path, text, Overrides::default());
    let read = |(index, section): (usize, &OptionSection)| {
        let (mut options, mut size) = (CameraOptions::default(), SizeOptions::default());
        let result = section.read("camera", &source, &mut [&mut options, &mut size], &[NAME]);
        result.map_err(|(error, _)| error)?;
        let name = match section.strings(NAME) {
            None => index.to_string(),
            Some((strings, span)) => match strings.as_deref() {
                Some([name]) => name.to_string(),
                _ => return Err(source.error(span, "`name` is not a string").help("write it in quotes")),
            },
        };
        Ok(camera(name, size, options))
    };
    list.camera.iter().enumerate().map(read).collect()
}

/// Reads the cameras of a CSV file. The first line has the names of the columns: a key, or a key
/// with a component, such as `position.x`.
pub(super) fn read_csv(path: &Path) -> Result<Vec<FileCamera>, FileError> {
    let text = read_text(path, "the file of cameras")?;
    let damaged = |error: csv::Error| {
        let place = error.position().map(|place| Position::line(place.line() as usize));
        let wrong = FileError::new(path, error.to_string()).help("give each line as many cells as the first");
        match place {
            Some(place) => wrong.at(place),
            None => wrong,
        }
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let columns: Vec<String> = reader.headers().map_err(damaged)?.iter().map(Into::into).collect();
    let mut cameras = Vec::new();
    for row in reader.records() {
        let row = row.map_err(damaged)?;
        let line = row.position().map_or(0, |place| place.line() as usize);
        let wrong = |message: String, help: String| FileError::new(path, message).at(Position::line(line)).help(help);
        let (mut options, mut size) = (CameraOptions::default(), SizeOptions::default());
        let mut name = cameras.len().to_string();
        for (key, value) in values(&columns, &row) {
            if key == NAME {
                name = value;
                continue;
            }
            let input = Input::Flag(&value);
            let result = options.set(key, input).or_else(|| size.set(key, input));
            match result {
                Some(Ok(())) => {}
                Some(Err(error)) => return Err(wrong(format!("{key} = {}", excerpt(&value)), error.help)),
                None => {
                    let parameters = CameraOptions::PARAMETERS.iter().chain(SizeOptions::PARAMETERS);
                    let (message, help) = unknown_key(key, "camera", parameters.map(|p| p.key).chain([NAME]));
                    return Err(wrong(message, help));
                }
            }
        }
        cameras.push(camera(name, size, options));
    }
    Ok(cameras)
}

/// Keys and values of a line. Empty cells are left out, and the components of a key are joined.
fn values<'a>(columns: &'a [String], row: &csv::StringRecord) -> Vec<(&'a str, String)> {
    let mut values: Vec<(&str, String)> = Vec::new();
    for (column, cell) in columns.iter().zip(row).filter(|(_, cell)| !cell.is_empty()) {
        let (key, component) = column.split_once('.').unwrap_or((column, ""));
        match values
            .last_mut()
            .filter(|(last, _)| *last == key && !component.is_empty())
        {
            Some((_, value)) => *value += &format!(",{cell}"),
            None => values.push((key, cell.to_string())),
        }
    }
    values
}
