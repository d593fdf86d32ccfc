//! The program that wrote a material library: its leading comments name it, or the habits of its statements show it.
//!
//! What the programs write, and where that is from, stands with the translation of each dialect in `translate`.

use super::dialect::{MtlDialect, TrMeaning, is_tr_opacity};
use super::section::Section;
use crate::color::Spectrum;

/// Exporter of Blender, of which there were three.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlenderExport {
    /// Up to 2.79, of materials of Blender Internal.
    Internal,
    /// From 2.80 on, written in Python; versions before 4 have it.
    Python,
    /// From 3.1 on, which writes the version of Blender; before 4 the specular level did not depend on the index of refraction.
    Native { before_4: bool },
}

/// Program that wrote a library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Writer {
    /// An unknown one: the file is read literally.
    Unknown,
    Blender(BlenderExport),
    Max,
    Maya,
    Sketchup,
    Cinema4d,
    Meshlab,
}

/// What the leading comments of a library say of its writer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Signature {
    pub dialect: MtlDialect,
    /// Version of Blender, such as `3.6.0`, where it is given.
    pub version: Option<String>,
    /// Line of the comment.
    pub line: usize,
}

impl Signature {
    /// The signature among the comments before the first material.
    pub fn find(text: &str) -> Option<Self> {
        let lines = text.lines().enumerate();
        let leading = lines.take_while(|(_, line)| {
            let line = line.trim_start();
            line.is_empty() || line.starts_with('#') || line.starts_with('\u{feff}')
        });
        let mut found = leading.filter_map(|(index, line)| Self::of_comment(&line.to_lowercase(), index + 1));
        found.next()
    }

    /// The signature in a comment in lower case.
    fn of_comment(comment: &str, line: usize) -> Option<Self> {
        let has = |words: &[&str]| words.iter().any(|word| comment.contains(word));
        let has_word = |wanted: &str| comment.split(|c: char| !c.is_alphanumeric()).any(|word| word == wanted);
        let dialect = if has(&["blender"]) && has(&["mtl file"]) {
            MtlDialect::Blender
        } else if has(&["3ds max", "3dsmax", "guruware", "max2mtl"]) {
            MtlDialect::Max
        } else if has(&["sketchup"]) {
            MtlDialect::Sketchup
        } else if has(&["cinema 4d", "cinema4d"]) || has_word("c4d") {
            MtlDialect::Cinema4d
        } else if has(&["meshlab", "vcglib"]) {
            MtlDialect::Meshlab
        } else if has_word("maya") {
            MtlDialect::Maya
        } else {
            return None;
        };
        let after = comment.split("blender ").nth(1).unwrap_or("");
        let version: String = after.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
        let version = Some(version).filter(|v| dialect == MtlDialect::Blender && v.starts_with(|c: char| c != '.'));
        Some(Self { dialect, version, line })
    }
}

/// How a library is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Reading {
    pub writer: Writer,
    pub tr: TrMeaning,
    /// Line and words of what was guessed; `None` where the user chose the dialect, or nothing was guessed.
    pub guess: Option<(usize, String)>,
}

impl Reading {
    /// The literal reading.
    pub const LETTER: Self = Self {
        writer: Writer::Unknown,
        tr: TrMeaning::Transparency,
        guess: None,
    };

    /// Reading of a library in the `dialect` that the user chose, or as its `signature` and the habits of its materials show it.
    pub fn new(dialect: MtlDialect, signature: Option<&Signature>, sections: &[Section]) -> Self {
        let is_auto = dialect == MtlDialect::Auto;
        let habit = || habit_of(sections).filter(|_| is_auto && signature.is_none());
        let dialect = match dialect {
            MtlDialect::Auto => signature.map(|s| s.dialect).or_else(habit).unwrap_or(MtlDialect::Spec),
            chosen => chosen,
        };
        let of_blender = signature.filter(|s| s.dialect == MtlDialect::Blender);
        let writer = match dialect {
            MtlDialect::Auto | MtlDialect::Spec => Writer::Unknown,
            MtlDialect::Blender => Writer::Blender(BlenderExport::of(of_blender, sections)),
            MtlDialect::Max => Writer::Max,
            MtlDialect::Maya => Writer::Maya,
            MtlDialect::Sketchup => Writer::Sketchup,
            MtlDialect::Cinema4d => Writer::Cinema4d,
            MtlDialect::Meshlab => Writer::Meshlab,
        };
        let dissolves: Vec<_> = sections.iter().map(|section| section.dissolve).collect();
        // MeshLab wrote opacity until 2023, and transparency since.
        let is_late = !dissolves.is_empty() && dissolves.iter().all(|d| d.d.is_none() && d.tr == Some(0.0));
        let tr = match writer {
            Writer::Meshlab if !is_late => TrMeaning::Opacity,
            _ if is_auto && is_tr_opacity(&dissolves) => TrMeaning::Opacity,
            Writer::Max => TrMeaning::TransparencyFirst,
            _ => TrMeaning::Transparency,
        };
        let line = signature.map_or(1, |s| s.line);
        let guess = is_auto.then(|| match writer {
            Writer::Unknown if tr == TrMeaning::Opacity => {
                Some("`Tr` is read as opacity: as transparency it would contradict the other statements".into())
            }
            Writer::Unknown => None,
            writer => {
                let name = writer.name(of_blender.and_then(|s| s.version.as_deref()));
                let source = match signature {
                    Some(_) => format!("written by {name}"),
                    None => format!("recognised as a file of {name} by its habits; it has no comment"),
                };
                Some(format!("{source}; {}", writer.meaning()))
            }
        });
        Self {
            writer,
            tr,
            guess: guess.flatten().map(|words| (line, words)),
        }
    }
}

impl Writer {
    /// Name of the program, with its version where that is known.
    fn name(self, version: Option<&str>) -> String {
        let name = match (self, version) {
            (Self::Blender(_), Some(version)) => return format!("Blender {version}"),
            (Self::Blender(BlenderExport::Internal), None) => "Blender 2.79 or older",
            (Self::Blender(BlenderExport::Python), None) => "Blender 2.8 to 3.6 (its exporter in Python)",
            (Self::Blender(BlenderExport::Native { .. }), None) => "Blender",
            (Self::Max, _) => "3ds Max",
            (Self::Maya, _) => "Maya",
            (Self::Sketchup, _) => "SketchUp",
            (Self::Cinema4d, _) => "Cinema 4D",
            (Self::Meshlab, _) => "MeshLab",
            (Self::Unknown, _) => "an unknown program",
        };
        name.into()
    }

    /// How its statements are read, in words.
    fn meaning(self) -> &'static str {
        match self {
            Self::Unknown => "the file is read literally",
            Self::Blender(_) => "Ks and Ns are read as specular level and roughness",
            Self::Max => "Ks and Ns are read as specular level and glossiness, and map_Kd replaces Kd",
            Self::Maya => "Tf is read as opacity, Ks and Ns as the highlight of a dielectric",
            Self::Sketchup => "its constant Ks is ignored",
            Self::Cinema4d => "Ks and Ns are read as the highlight of a dielectric",
            Self::Meshlab => "Tr is read as opacity, and Ks with Ns 0 is ignored",
        }
    }
}

impl BlenderExport {
    /// The exporter, by the version in the signature, or by the values of `Ns`.
    ///
    /// Blender Internal had whole numbers h from 1 to 511 for hardness, and its exporters wrote `Ns` = (h − 1)/0.51; 0 and 900 are values of both
    /// older exporters. The one in Python ends at 900, and the roughness 0.5 of new materials is 225 there and 250 later.
    fn of(signature: Option<&Signature>, sections: &[Section]) -> Self {
        let version = signature.and_then(|s| s.version.as_deref());
        let major: Option<u32> = version.and_then(|v| v.split('.').next()?.parse().ok());
        if let Some(major) = major {
            return Self::Native { before_4: major < 4 };
        }
        let exponents = || sections.iter().filter_map(|section| section.exponent);
        let is_near = |ns: f32, value: f32| (ns - value).abs() < 1e-3;
        let is_hardness = |ns: f32| is_near(ns * 0.51, (ns * 0.51).round());
        let is_telling = |ns: f32| !is_near(ns, 0.0) && !is_near(ns, 900.0);
        if exponents().all(is_hardness) && exponents().any(is_telling) {
            return Self::Internal;
        }
        let is_native = exponents().any(|ns| ns > 900.5 || is_near(ns, 250.0));
        match signature.is_some() || !is_native && exponents().any(|ns| is_near(ns, 225.0) || is_near(ns, 324.0)) {
            true => Self::Python,
            false => Self::Native { before_4: true },
        }
    }
}

/// The dialect that all materials of a library share by habit.
fn habit_of(sections: &[Section]) -> Option<MtlDialect> {
    let all = |is_so: fn(&Section) -> bool| !sections.is_empty() && sections.iter().all(is_so);
    if all(is_like_blender) && sections.iter().any(|s| s.specular == Some(Spectrum::splat(0.5))) {
        Some(MtlDialect::Blender)
    } else if all(is_like_maya) {
        Some(MtlDialect::Maya)
    } else if all(is_like_sketchup) {
        Some(MtlDialect::Sketchup)
    } else {
        None
    }
}

/// All exporters of Blender write these statements, in this order, and `Ke` among them; `Ks` is grey, and `Ka` is 1 or metallic.
fn is_like_blender(section: &Section) -> bool {
    let keys = section.lines.iter().map(|(key, _)| key.as_str());
    let keys = keys.filter(|key| *key != "ke" && !key.starts_with("map_"));
    let is_grey = |color: Option<Spectrum>| color.is_some_and(|c| c == Spectrum::splat(c.max_component()));
    let is_metal = matches!(section.illum, Some(3 | 6));
    keys.eq(["ns", "ka", "kd", "ks", "ni", "d", "illum"])
        && is_grey(section.specular)
        && is_grey(section.ambient)
        && (is_metal || section.ambient == Some(Spectrum::ONE))
}

/// Maya writes `illum 4`, glass by the letter, for every surface, and `Ni 1.00`, by which that glass could not be seen.
fn is_like_maya(section: &Section) -> bool {
    section.illum == Some(4)
        && section.filter.is_some()
        && section.ior == Some(1.0)
        && !section.dissolve.is_given()
        && !section.is_physical()
}

/// SketchUp writes one `Ks` for every surface, and neither `Ns` nor `illum`.
fn is_like_sketchup(section: &Section) -> bool {
    section.specular == Some(Spectrum::splat(0.33)) && section.exponent.is_none() && section.illum.is_none()
}
