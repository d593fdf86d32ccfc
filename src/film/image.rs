use super::{Accumulator, Coverage, FeatureSums, Film, Rect, RgbImage};
use crate::math::UVec2;
use std::borrow::Cow;

/// What the channel `Z` holds where no surface was met; finite, because not every tool reads infinities.
pub const Z_BACKGROUND: f32 = 1e10;

/// One channel of an image, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name as in the file, `layer.component`.
    pub name: Cow<'static, str>,
    /// One value a pixel of the crop.
    pub values: Vec<f32>,
}

/// A developed film: named channels of float32.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Size of the full image.
    pub resolution: UVec2,
    /// The part of it that the channels cover.
    pub crop: Rect,
    /// `R G B` first, then the auxiliary channels.
    pub channels: Vec<Channel>,
}

/// A channel's name and how a pixel's sums give its value.
type Developer = (&'static str, fn(&Accumulator) -> f32);

const CHANNELS: [Developer; 14] = [
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
    ("variance.R", |a| a.variance_of_mean(0) as f32),
    ("variance.G", |a| a.variance_of_mean(1) as f32),
    ("variance.B", |a| a.variance_of_mean(2) as f32),
    ("samples", |a| a.samples() as f32),
];

/// Channels that are written where they are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// `P`: position in world space.
    Position,
    /// `uv`: texture coordinates.
    Uv,
    /// `motion`: way on the film while the shutter is open, in pixels, y upwards.
    Motion,
    /// `id`: which object and which material covers most of the pixel, counted from 1.
    Ids,
    /// Mattes of objects and materials (Friedman and Jones, Cryptomatte).
    Cryptomatte,
    /// `light_NAME`: the picture as the lights of each group alone light it.
    Lights,
    /// `strategy_sS_tT`, `unweighted_sS_tT`: what each strategy of a bidirectional method gives to the picture, and what it finds by itself.
    Strategies,
}

impl Aov {
    /// Each by the name that users type.
    pub const NAMES: &[(&str, Self)] = &[
        ("P", Self::Position),
        ("uv", Self::Uv),
        ("motion", Self::Motion),
        ("id", Self::Ids),
        ("cryptomatte", Self::Cryptomatte),
        ("lights", Self::Lights),
        ("strategies", Self::Strategies),
    ];

    /// Whether it shows what a camera ray meets first.
    pub fn is_of_surface(self) -> bool {
        !matches!(self, Self::Lights | Self::Strategies)
    }

    /// Number of its channels; 0 for parts of the light, which are as many as the scene and the method have.
    pub(super) fn channel_count(self) -> usize {
        match self {
            // Objects and materials, three pairs of ranks with two channels each
            Self::Cryptomatte => 24,
            _ => self.channels().len(),
        }
    }

    /// How the sums of a pixel give the channels.
    fn channels(self) -> &'static [FeatureDeveloper] {
        fn most(coverage: &Coverage) -> f32 {
            coverage.by_rank().first().map_or(0.0, |&(id, _)| id as f32 + 1.0)
        }
        match self {
            Self::Position => &[("P.X", |f| f.mean(0)), ("P.Y", |f| f.mean(1)), ("P.Z", |f| f.mean(2))],
            Self::Uv => &[("uv.U", |f| f.mean(3)), ("uv.V", |f| f.mean(4))],
            Self::Motion => &[("motion.X", |f| f.mean(5)), ("motion.Y", |f| f.mean(6))],
            Self::Ids => &[
                ("id.object", |f| most(&f.objects)),
                ("id.material", |f| most(&f.materials)),
            ],
            Self::Cryptomatte | Self::Lights | Self::Strategies => &[],
        }
    }
}

/// A channel's name and how a pixel's features give its value.
type FeatureDeveloper = (&'static str, fn(&FeatureSums) -> f32);

pub(super) fn develop_features(film: &Film, aovs: &[Aov]) -> Vec<Channel> {
    let developers = aovs.iter().flat_map(|aov| aov.channels());
    let values =
        |develop: fn(&FeatureSums) -> f32| film.crop().pixels().map(move |p| film.features(p).map_or(0.0, develop));
    let channels = developers.map(|&(name, develop)| Channel {
        name: name.into(),
        values: values(develop).collect(),
    });
    channels.collect()
}

pub(super) fn develop_parts(film: &Film, names: &[String]) -> Vec<Channel> {
    let mean = |pixel, part: usize, c| {
        let tile = film.tile_at(pixel)?;
        let sum = tile.part_sums(pixel).get(part)?;
        Some(sum.mean(c, tile.sums(pixel)?.samples()) as f32)
    };
    let channels = names.iter().enumerate().flat_map(|(part, name)| {
        ["R", "G", "B"].into_iter().enumerate().map(move |(c, color)| Channel {
            name: format!("{name}.{color}").into(),
            values: film.crop().pixels().map(|p| mean(p, part, c).unwrap_or(0.0)).collect(),
        })
    });
    channels.collect()
}

/// Where a channel of `crop` has the value of `pixel`.
fn index(crop: Rect, pixel: UVec2) -> usize {
    let at = pixel - crop.min;
    at.y as usize * crop.size().x as usize + at.x as usize
}

impl Image {
    /// Names of the channels that a film has when it is developed, in their order.
    pub fn channel_names() -> impl Iterator<Item = &'static str> {
        CHANNELS.iter().map(|&(name, _)| name)
    }

    /// The first `count` channels.
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
        for (pixel, sums) in film.pixels() {
            let index = index(crop, pixel);
            for (channel, (_, develop)) in channels.iter_mut().zip(CHANNELS) {
                channel.values[index] = develop(sums);
            }
        }
        Self {
            resolution: film.resolution(),
            crop,
            channels,
        }
    }

    pub(super) fn error_map(film: &Film) -> Channel {
        let crop = film.crop();
        let mut values = vec![0.0; crop.area() as usize];
        for tile in film.tiles() {
            let error = tile.error().sqrt() as f32;
            for pixel in tile.bounds().pixels() {
                values[index(crop, pixel)] = error;
            }
        }
        Channel {
            name: "error".into(),
            values,
        }
    }

    /// The channel called `name`.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|c| c.name == name)
    }

    /// Linear red, green and blue of each pixel, row by row from the top.
    pub fn rgb(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.crop.area() as usize).map(|i| [0, 1, 2].map(|c| self.channels[c].values[i]))
    }
}

impl From<&Image> for RgbImage {
    /// The picture alone, of the crop's size.
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
    use crate::film::Block;

    #[test]
    fn pixels_of_a_crop_land_where_they_belong() {
        let crop = Rect {
            min: UVec2::new(3, 5),
            max: UVec2::new(40, 27),
        };
        let mut film = Film::new(UVec2::new(64, 32), crop);
        for tile in film.tiles_mut() {
            for pixel in tile.bounds().pixels() {
                let value = Spectrum::rgb(pixel.x as f32, pixel.y as f32, 1.0);
                let mut block = Block::default();
                block.add(value, None);
                tile.sums_mut(pixel).unwrap().add(&block);
            }
        }
        let image = film.develop();
        let expected: Vec<[f32; 3]> = crop.pixels().map(|p| [p.x as f32, p.y as f32, 1.0]).collect();
        assert_eq!(image.rgb().collect::<Vec<_>>(), expected);
        assert!(image.channel("samples").unwrap().values.iter().all(|&n| n == 1.0));
        assert!(image.channel("Z").unwrap().values.iter().all(|&z| z == Z_BACKGROUND));
    }
}
