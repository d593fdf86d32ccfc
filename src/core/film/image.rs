//! Developed images: channels computed from the sums of a film.

use super::{Accumulator, Backing, Film, Rect, RgbImage, TileSums, views_of};
use crate::color::Spectrum;
use crate::math::UVec2;
use std::borrow::Cow;

/// Value of the channel `Z` without a surface. Finite, because some tools cannot read infinities.
pub const Z_BACKGROUND: f32 = 1e10;

/// A channel of an image, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name in the file, `layer.component`.
    pub name: Cow<'static, str>,
    /// Values of the crop's pixels.
    pub values: Vec<f32>,
}

/// A developed film: named channels of float32.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Size of the full image.
    pub resolution: UVec2,
    /// Size of a view. The image is a grid of views, which are denoised separately. If there is
    /// only one view, this is the size of the image.
    pub view: UVec2,
    /// Part of the image whose pixels the channels hold.
    pub crop: Rect,
    /// `R G B` first, then the auxiliary channels.
    pub channels: Vec<Channel>,
    /// Background behind the surfaces. `None` if the image has no coverage channels.
    pub backing: Option<Backing>,
}

/// Name of a channel, and the function that computes its value from a pixel's sums.
type Developer = (&'static str, fn(&Accumulator) -> f32);

const CHANNELS: [Developer; 15] = [
    ("R", |a| a.mean(0) as f32),
    ("G", |a| a.mean(1) as f32),
    ("B", |a| a.mean(2) as f32),
    ("albedo.R", |a| a.albedo(0)),
    ("albedo.G", |a| a.albedo(1)),
    ("albedo.B", |a| a.albedo(2)),
    ("N.X", |a| a.normal(0)),
    ("N.Y", |a| a.normal(1)),
    ("N.Z", |a| a.normal(2)),
    ("Z", |a| a.depth().unwrap_or(Z_BACKGROUND)),
    ("emitted", |a| a.emitted()),
    ("variance.R", |a| a.variance_of_mean(0) as f32),
    ("variance.G", |a| a.variance_of_mean(1) as f32),
    ("variance.B", |a| a.variance_of_mean(2) as f32),
    ("samples", |a| a.samples() as f32),
];

/// Channels with the names `names`. For each pixel, `develop` gets the sums of its tile and its
/// index in the tile, and appends the values of all channels, in the order of `names`.
pub(super) fn develop_channels(
    film: &Film,
    names: impl Iterator<Item = Cow<'static, str>>,
    develop: impl Fn(&TileSums, usize, &mut Vec<f32>),
) -> Vec<Channel> {
    let crop = film.crop();
    let channel = |name| Channel {
        name,
        values: vec![0.0; crop.area() as usize],
    };
    let mut channels: Vec<Channel> = names.map(channel).collect();
    if channels.is_empty() {
        return channels;
    }
    let mut values = Vec::with_capacity(channels.len());
    for tile in film.tiles() {
        let sums = tile.read();
        for (i, pixel) in tile.bounds().pixels().enumerate() {
            values.clear();
            develop(&sums, i, &mut values);
            let index = index(crop, pixel);
            for (channel, &value) in channels.iter_mut().zip(&values) {
                channel.values[index] = value;
            }
        }
    }
    channels
}

pub(super) fn develop_parts(film: &Film, names: &[String]) -> Vec<Channel> {
    let colors = |name: &String| ["R", "G", "B"].map(|color| Cow::from(format!("{name}.{color}")));
    develop_channels(film, names.iter().flat_map(colors), |sums, i, values| {
        let samples = sums.pixel(i).samples();
        let means = sums
            .part_sums(i)
            .iter()
            .map(|sum| [0, 1, 2].map(|c| sum.mean(c, samples) as f32));
        values.extend(means.take(names.len()).flatten());
    })
}

/// Index of `pixel` in the values of a channel that covers `crop`.
fn index(crop: Rect, pixel: UVec2) -> usize {
    let at = pixel - crop.min;
    at.y as usize * crop.size().x as usize + at.x as usize
}

impl Image {
    /// Names of the channels of a developed film, in order.
    pub fn channel_names() -> impl Iterator<Item = &'static str> {
        CHANNELS.iter().map(|&(name, _)| name)
    }

    /// The pixels of `crop`, a part of the image. Pixels that the image does not have are black.
    pub fn cropped(&self, crop: Rect) -> Self {
        let common = crop.intersection(self.crop);
        let pick = |values: &[f32]| -> Vec<f32> {
            let mut picked = vec![0.0; crop.area() as usize];
            for pixel in common.pixels() {
                picked[index(crop, pixel)] = values.get(index(self.crop, pixel)).copied().unwrap_or(0.0);
            }
            picked
        };
        let channel = |channel: &Channel| Channel {
            name: channel.name.clone(),
            values: pick(&channel.values),
        };
        Self {
            crop,
            channels: self.channels.iter().map(channel).collect(),
            ..*self
        }
    }

    /// Image with the first `count` channels of [`CHANNELS`], and with the coverage channels if the
    /// film sums a background.
    pub(super) fn from_film(film: &Film, count: usize) -> Self {
        let crop = film.crop();
        let mut channels: Vec<Channel> = CHANNELS
            .iter()
            .take(count)
            .map(|&(name, _)| Channel {
                name: name.into(),
                values: vec![0.0; crop.area() as usize],
            })
            .collect();
        for tile in film.tiles() {
            for (pixel, sums) in tile.read().iter() {
                let index = index(crop, pixel);
                for (channel, (_, develop)) in channels.iter_mut().zip(CHANNELS) {
                    channel.values[index] = develop(sums);
                }
            }
        }
        if let Some(backing) = film.backing() {
            let names = backing.channels().iter().map(|&name| name.into());
            channels.extend(develop_channels(film, names, |sums, i, values| {
                let coverage = sums.background()[i].coverage(sums.pixel(i).samples());
                match backing {
                    Backing::Transparent => values.push(Spectrum::from(coverage).luminance()),
                    Backing::Color(_) => values.extend(coverage),
                }
            }));
        }
        Self {
            resolution: film.resolution(),
            view: film.view_size(),
            crop,
            channels,
            backing: film.backing(),
        }
    }

    pub(super) fn error_map(film: &Film) -> Channel {
        let crop = film.crop();
        let mut values = vec![0.0; crop.area() as usize];
        for (tile, error) in film.tiles().iter().zip(film.tile_errors()) {
            let error = error.sqrt() as f32;
            for pixel in tile.bounds().pixels() {
                values[index(crop, pixel)] = error;
            }
        }
        Channel {
            name: "error".into(),
            values,
        }
    }

    /// Pixels of each view inside of the crop, row by row.
    pub fn views(&self) -> Vec<Rect> {
        let views = views_of(self.resolution, self.view).into_iter();
        views
            .map(|view| view.intersection(self.crop))
            .filter(|view| view.area() > 0)
            .collect()
    }

    /// Returns the pixels of `crop` as an image of one view. `crop` must be inside of the crop of
    /// this image.
    pub fn part(&self, crop: Rect) -> Self {
        let pick = |values: &[f32]| crop.pixels().map(|pixel| values[index(self.crop, pixel)]).collect();
        let channels = self.channels.iter().map(|channel| Channel {
            name: channel.name.clone(),
            values: pick(&channel.values),
        });
        Self {
            resolution: self.resolution,
            view: self.resolution,
            crop,
            channels: channels.collect(),
            backing: self.backing,
        }
    }

    /// Copies all channels of `part` into this image, to the pixels that `part` covers. If this
    /// image lacks a channel, the channel is added, with the value 1 in all other pixels.
    pub fn put_part(&mut self, part: &Self) {
        for channel in &part.channels {
            let place = self.channels.iter().position(|own| own.name == channel.name);
            let place = place.unwrap_or_else(|| {
                self.channels.push(Channel {
                    name: channel.name.clone(),
                    values: vec![1.0; self.crop.area() as usize],
                });
                self.channels.len() - 1
            });
            let own = &mut self.channels[place].values;
            for (pixel, &value) in part.crop.pixels().zip(&channel.values) {
                own[index(self.crop, pixel)] = value;
            }
        }
    }

    /// Channel with the name `name`.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|c| c.name == name)
    }

    /// Returns the background, and the coverage of each pixel for red, green and blue, row by row
    /// from the top. The channels `R G B` are the light in front of the background, plus the light
    /// of the background times 1 − coverage.
    pub fn coverage(&self) -> Option<(Backing, Vec<[f32; 3]>)> {
        let backing = self.backing?;
        Some((backing, self.triples(backing.channels())?))
    }

    /// Coverage before denoising. If the image is not denoised, this is [`Image::coverage`].
    pub fn raw_coverage(&self) -> Option<(Backing, Vec<[f32; 3]>)> {
        let backing = self.backing?;
        let raw = self.triples(backing.raw_channels());
        raw.map(|raw| (backing, raw)).or_else(|| self.coverage())
    }

    /// Values of three channels. If `names` has one name, its channel is used three times.
    fn triples(&self, names: &[&str]) -> Option<Vec<[f32; 3]>> {
        let channel = |c: usize| Some(&self.channel(names.get(c).or(names.first())?)?.values);
        let (r, g, b) = (channel(0)?, channel(1)?, channel(2)?);
        Some(r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect())
    }

    /// Linear red, green and blue of each pixel, row by row from the top.
    pub fn rgb(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.crop.area() as usize).map(|i| [0, 1, 2].map(|c| self.channels[c].values[i]))
    }
}

impl From<&Image> for RgbImage {
    /// Red, green and blue of the pixels of the crop, without the other channels.
    fn from(image: &Image) -> Self {
        let size = image.crop.size();
        Self {
            width: size.x as usize,
            height: size.y as usize,
            pixels: image.rgb().collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{FilmSample, SampleChange};

    #[test]
    fn pixels_of_a_crop_keep_their_positions() {
        let crop = Rect {
            min: UVec2::new(3, 5),
            max: UVec2::new(40, 27),
        };
        let mut film = Film::new(UVec2::new(64, 32), crop);
        for tile in film.tiles_mut() {
            for pixel in tile.bounds().pixels() {
                let mut block = tile.block();
                block.add(&FilmSample {
                    radiance: Spectrum::rgb(pixel.x as f32, pixel.y as f32, 1.0),
                    ..FilmSample::default()
                });
                tile.change(pixel, &block, SampleChange::Add);
            }
        }
        let image = film.develop();
        let expected: Vec<[f32; 3]> = crop.pixels().map(|p| [p.x as f32, p.y as f32, 1.0]).collect();
        assert_eq!(image.rgb().collect::<Vec<_>>(), expected);
        assert!(image.channel("samples").unwrap().values.iter().all(|&n| n == 1.0));
        assert!(image.channel("Z").unwrap().values.iter().all(|&z| z == Z_BACKGROUND));
    }
}
