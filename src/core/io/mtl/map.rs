//! Texture statements of MTL (`map_Kd`, `map_Bump` and others): keywords, options and file names.

use crate::io::statements::possible_names;
use crate::math::{Vec2, excerpt};
use crate::texture::{Channel, Mapping, Wrap};

/// Maximum length of a file name in bytes.
const MAX_NAME: usize = 4096;

/// Use of a texture of an MTL file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapSlot {
    /// Diffuse reflectance.
    Diffuse,
    /// Specular reflectance.
    Specular,
    /// Radiance of a light.
    Emission,
    /// Exponent of Phong's lobe.
    Exponent,
    /// Roughness.
    Roughness,
    /// Metallic: fraction of metal, 0 to 1.
    Metallic,
    /// Opacity.
    Opacity,
    /// Height above the surface.
    Bump,
    /// Tangent-space normals.
    Normal,
    /// Heights for the displacement of the surface along its normal.
    Displacement,
}

/// A texture statement: the file, and its mapping on the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct MapStatement {
    /// Use of the texture.
    pub slot: MapSlot,
    /// Name of the file, as written.
    pub file: String,
    /// File name including the text after `#`, which may not be a comment: `wall #2.png`.
    pub whole_file: Option<String>,
    /// Mapping of the texture on the surface.
    pub mapping: Mapping,
    /// Options that have no effect in this program.
    pub ignored: Vec<&'static str>,
}

impl MapSlot {
    /// Slot of the keyword `key`, which is in lower case. Blender writes pictures of metallic as
    /// reflection maps (`refl`).
    pub fn of_keyword(key: &str, is_blender: bool) -> Option<Self> {
        Some(match key {
            "map_refl" | "refl" if is_blender => Self::Metallic,
            "map_kd" => Self::Diffuse,
            "map_ks" => Self::Specular,
            "map_ke" | "map_emissive" => Self::Emission,
            "map_ns" => Self::Exponent,
            "map_pr" => Self::Roughness,
            "map_pm" => Self::Metallic,
            "map_d" | "map_opacity" => Self::Opacity,
            "map_bump" | "bump" => Self::Bump,
            "disp" | "map_disp" => Self::Displacement,
            "norm" | "map_kn" | "map_norm" => Self::Normal,
            _ => return None,
        })
    }
}

impl MapStatement {
    /// Possible names of the file, the longest first.
    pub fn names(&self) -> impl Iterator<Item = &str> + Clone {
        let whole = self.whole_file.iter().flat_map(|whole| possible_names(whole));
        whole.chain([self.file.as_str()])
    }

    /// Parses the text after the keyword: options, and a name that may have blanks. Some exporters
    /// write the options after the name.
    ///
    /// # Errors
    ///
    /// A description of the error.
    pub fn parse(slot: MapSlot, rest: &str) -> Result<Self, String> {
        let mut map = Self {
            slot,
            file: String::new(),
            whole_file: None,
            mapping: Mapping::default(),
            ignored: Vec::new(),
        };
        let mut words = RemainingWords(rest);
        map.options(&mut words)?;
        let name = words.0.trim();
        // A text that is longer than `MAX_NAME` is not a name. Without this limit, it would be
        // parsed many times.
        let ends = name.match_indices(" -").filter(|_| name.len() <= MAX_NAME);
        let after = ends.map(|(end, _)| end).find_map(|end| {
            let (mut read, mut words) = (map.clone(), RemainingWords(&name[end..]));
            read.file = name[..end].trim().to_string();
            let is_all = read.options(&mut words).is_ok() && words.0.trim().is_empty();
            (is_all && !read.file.is_empty()).then_some(read)
        });
        map.file = name.to_string();
        if map.file.is_empty() {
            return Err("the file name of the texture is missing".into());
        }
        Ok(after.unwrap_or(map))
    }

    /// Parses the next options.
    fn options(&mut self, words: &mut RemainingWords) -> Result<(), String> {
        while let Some(option) = words.option() {
            match option {
                "-s" => self.mapping.scale = words.vector(option, 1.0)?,
                "-o" => self.mapping.offset = words.vector(option, 0.0)?,
                "-t" => {
                    words.vector(option, 0.0)?;
                    self.ignored.push("-t");
                }
                "-clamp" => {
                    self.mapping.wrap = if words.on_or_off(option)? {
                        Wrap::Clamp
                    } else {
                        Wrap::Repeat
                    }
                }
                "-blendu" | "-blendv" | "-cc" => {
                    words.on_or_off(option)?;
                }
                "-bm" => self.mapping.bump = words.number(option)?,
                "-mm" => (self.mapping.base, self.mapping.gain) = (words.number(option)?, words.number(option)?),
                "-boost" | "-texres" => {
                    words.number(option)?;
                }
                "-imfchan" => self.mapping.channel = Some(words.channel(option)?),
                "-type" => {
                    words.next();
                    self.ignored.push("-type");
                }
                // `-colorspace` has no effect, because the use of a texture determines its colour
                // space.
                "-colorspace" => {
                    words.next();
                    self.ignored.push("-colorspace");
                }
                _ => return Err(format!("`{}` is no texture option", excerpt(option))),
            }
        }
        Ok(())
    }
}

/// Remaining words of a statement.
struct RemainingWords<'a>(&'a str);

impl<'a> RemainingWords<'a> {
    fn next(&mut self) -> Option<&'a str> {
        let word = self.peek()?;
        self.0 = &self.0.trim_start()[word.len()..];
        Some(word)
    }

    fn peek(&self) -> Option<&'a str> {
        self.0.split_whitespace().next()
    }

    /// The next word, if it is an option: a `-` and a letter. File names do not begin in this way.
    fn option(&mut self) -> Option<&'a str> {
        let word = self.peek()?;
        let is_option = word
            .strip_prefix('-')
            .is_some_and(|name| name.starts_with(|c: char| c.is_ascii_alphabetic()));
        is_option.then(|| self.next()).flatten()
    }

    fn number(&mut self, option: &str) -> Result<f32, String> {
        let word = self.next().unwrap_or("");
        let number = word.parse().ok().filter(|n: &f32| n.is_finite());
        number.ok_or_else(|| needs(option, "a finite number", word))
    }

    /// Parses one to three numbers, of which textures use two. Missing numbers are `default`.
    fn vector(&mut self, option: &str, default: f32) -> Result<Vec2, String> {
        let u = self.number(option)?;
        let mut others = [default; 2];
        for other in &mut others {
            let Some(value) = self.peek().and_then(|word| word.parse().ok()) else {
                break;
            };
            *other = value;
            self.next();
        }
        let v = others[0];
        if v.is_finite() {
            Ok(Vec2::new(u, v))
        } else {
            Err(format!("`{option}` needs finite numbers, not `{u} {v}`"))
        }
    }

    fn on_or_off(&mut self, option: &str) -> Result<bool, String> {
        match self.next() {
            Some("on") => Ok(true),
            Some("off") => Ok(false),
            other => Err(needs(option, "`on` or `off`", other.unwrap_or(""))),
        }
    }

    fn channel(&mut self, option: &str) -> Result<Channel, String> {
        let word = self.next().unwrap_or("");
        let found = Channel::NAMES.iter().find(|(name, _)| *name == word);
        let channel = found.map(|(_, channel)| *channel);
        channel.ok_or_else(|| needs(option, "r, g, b, m, l or z", word))
    }
}

/// Error: the texture option `option` needs `what`, but `word` is given; empty if nothing is given.
fn needs(option: &str, what: &str, word: &str) -> String {
    match word {
        "" => format!("`{option}` needs {what}"),
        _ => format!("`{option}` needs {what}, not `{}`", excerpt(word)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(rest: &str) -> MapStatement {
        MapStatement::parse(MapSlot::Diffuse, rest).unwrap()
    }

    #[test]
    fn options_come_before_names_with_blanks() {
        let plain = map("textures\\old wall.png");
        assert_eq!(
            (plain.file.as_str(), plain.mapping.scale),
            ("textures\\old wall.png", Vec2::ONE)
        );
        let all = map("-s 2 3 1 -o 0.5 -clamp on -bm 0.2 -imfchan g -mm 0.1 2 -blendu off -texres 512 a b.png ");
        let expected = Mapping {
            scale: Vec2::new(2.0, 3.0),
            offset: Vec2::new(0.5, 0.0),
            wrap: Wrap::Clamp,
            channel: Some(Channel::Green),
            base: 0.1,
            gain: 2.0,
            bump: 0.2,
            flips_green: false,
        };
        assert_eq!((all.mapping, all.file.as_str()), (expected, "a b.png"));
        assert_eq!(map("-s 2 1.png").file, "1.png");
        assert_eq!(map("-1.png").file, "-1.png");
        assert_eq!(map("a -b.png").file, "a -b.png");
        assert_eq!(map("a -s 2 b.png").file, "a -s 2 b.png");
        assert_eq!(
            map("old wall.png -s 2 3 1 -clamp on"),
            map("-s 2 3 1 -clamp on old wall.png")
        );
        assert_eq!(map("-type sphere a.png").ignored, ["-type"]);
        let linear = map("-colorspace linear a.png");
        assert_eq!((&linear.ignored[..], &*linear.file), (&["-colorspace"][..], "a.png"));
    }

    #[test]
    fn invalid_statement_is_an_error_with_the_word() {
        for (rest, word) in [
            ("", "missing"),
            ("-s 2", "missing"),
            ("-s x a.png", "`-s` needs a finite number, not `x`"),
            ("-s inf a.png", "not `inf`"),
            ("-clamp 1 a.png", "`-clamp` needs `on` or `off`, not `1`"),
            ("-imfchan q a.png", "not `q`"),
            ("-bm", "-bm"),
            ("-huh a.png", "-huh"),
        ] {
            let error = MapStatement::parse(MapSlot::Bump, rest).unwrap_err();
            assert!(error.contains(word), "{rest}: {error}");
        }
    }
}
