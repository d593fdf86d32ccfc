//! Recognition of the program that wrote a material library: by its leading comments, by the
//! comments of its OBJ file, or by typical statements.
//!
//! `translate` lists the statements of each program, with sources.

use super::dialect::{MtlDialect, TrMeaning, is_tr_opacity, visible_meaning};
use super::map::MapSlot;
use super::section::Section;
use crate::color::Spectrum;
use crate::math::{excerpt_of_name, significant};

/// One of the three exporters that Blender has had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlenderExport {
    /// Exporter up to Blender 2.79, for materials of Blender Internal.
    Internal,
    /// Exporter in Python, from Blender 2.80 on; included in versions before 4.
    Python,
    /// Exporter from Blender 3.1 on, which writes the version of Blender into the file. Before
    /// version 4, the specular level did not depend on the index of refraction.
    Native { before_4: bool },
}

/// Program that wrote a library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Writer {
    /// The format's definition: the file is read literally.
    Spec,
    /// An unknown program: the file is read literally, except highlights of exponent 0.
    Unknown,
    Blender(BlenderExport),
    Max,
    Maya,
    Sketchup,
    Cinema4d,
    Meshlab,
    Rhino,
    Wings3d,
    Threedfier,
    Assimp,
    /// An unknown program whose `Ks` and `Ns` are a highlight that reflects only lamps.
    Highlight,
}

/// Name of the program that wrote a file, from the leading comments of a library or of an OBJ file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// Dialect of the program.
    pub dialect: MtlDialect,
    /// Version of Blender, such as `3.6.0`, and its exporter, if the comment has a version.
    pub(super) version: Option<(String, BlenderExport)>,
    /// Line of the comment.
    pub line: usize,
}

impl Signature {
    /// Finds the program that is named in the comments before the first statement of `text`.
    pub fn find(text: &str) -> Option<Self> {
        let lines = text.lines().enumerate();
        let leading = lines.take_while(|(_, line)| {
            let line = line.trim_start();
            line.is_empty() || line.starts_with('#') || line.starts_with('\u{feff}')
        });
        let mut found = leading.filter_map(|(index, line)| Self::of_comment(&line.to_lowercase(), index + 1));
        found.next()
    }

    /// Finds the program that is named in `comment`, which is in lower case.
    fn of_comment(comment: &str, line: usize) -> Option<Self> {
        let has = |words: &[&str]| words.iter().any(|word| comment.contains(word));
        let has_word = |wanted: &str| comment.split(|c: char| !c.is_alphanumeric()).any(|word| word == wanted);
        let content = comment.trim_matches(|c: char| c.is_whitespace() || matches!(c, '#' | '\u{feff}'));
        let version = blender_version(content);
        let is_blender = version.is_some() || has(&["blender"]) && has(&["mtl file", "obj file"]);
        let dialect = if is_blender || content.starts_with("material count:") {
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
        } else if content == "rhino" || has_word("rhinoceros") {
            MtlDialect::Rhino
        } else if has(&["wings 3d", "wings3d"]) {
            MtlDialect::Wings3d
        } else if has_word("3dfier") {
            MtlDialect::Threedfier
        } else if has(&["open asset import library"]) || has_word("assimp") {
            MtlDialect::Assimp
        } else {
            return None;
        };
        Some(Self { dialect, version, line })
    }

    /// Returns true if a library without a comment may be written by the program that this
    /// signature of its OBJ file names. If not, the library was written by hand.
    fn fits(&self, sections: &[Section]) -> bool {
        match self.dialect {
            MtlDialect::Blender => sections.iter().all(has_statements_of_blender),
            // Maya and MeshLab give another meaning to `Tf` and `Tr`. With the values of another
            // program, everything could be invisible.
            MtlDialect::Maya => sections.iter().all(is_like_maya),
            MtlDialect::Meshlab => sections.iter().all(|section| section.dissolve.tr.is_none()),
            _ => true,
        }
    }
}

/// Version of Blender in a comment in lower case, and the exporter of that version.
///
/// Exporters in Python write `Blender v2.79 (sub 0) OBJ File`; the oldest wrote
/// `Blender3D v249 OBJ File`. The later exporter writes `Blender 3.6.0`.
fn blender_version(comment: &str) -> Option<(String, BlenderExport)> {
    let after = comment.strip_prefix("blender")?;
    let after = after.strip_prefix("3d").unwrap_or(after).trim_start();
    let (digits, is_python) = match after.strip_prefix('v') {
        Some(digits) => (digits, true),
        None => (after, false),
    };
    let end = digits.find(|c: char| !c.is_ascii_digit() && c != '.');
    let version = digits[..end.unwrap_or(digits.len())].trim_end_matches('.');
    let mut numbers = version.split('.').map(|number| number.parse::<u16>().ok());
    let major = u32::from(numbers.next()??);
    let minor = numbers.next().flatten().unwrap_or(0);
    let number = if major < 100 {
        100 * major + u32::from(minor)
    } else {
        major
    };
    let export = match number {
        ..280 => BlenderExport::Internal,
        _ if is_python => BlenderExport::Python,
        _ => BlenderExport::Native { before_4: number < 400 },
    };
    let name = match version.strip_prefix('2') {
        Some(minor) if major >= 100 => format!("2.{minor}"),
        _ => version.to_string(),
    };
    Some((name, export))
}

/// Interpretation of a library: the writer and the meaning of `Tr`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Interpretation {
    pub writer: Writer,
    pub tr: TrMeaning,
    /// True if `tr` is not the usual meaning of the writer, so that surfaces stay visible.
    pub is_tr_changed: bool,
    /// Line and description of the guess, for a message. `None` if the user chose the dialect, or
    /// if nothing was guessed.
    pub guess: Option<(usize, String)>,
}

/// The signatures of a library and of its OBJ file.
#[derive(Clone, Copy, Default)]
pub(super) struct Signatures<'a> {
    pub library: Option<&'a Signature>,
    pub obj: Option<&'a Signature>,
}

impl Interpretation {
    /// Interpretation of a library that is read literally.
    pub const LETTER: Self = Self {
        writer: Writer::Spec,
        tr: TrMeaning::Transparency,
        is_tr_changed: false,
        guess: None,
    };

    /// Interpretation of a library by `dialect`. If the dialect is `Auto`, it follows from
    /// signatures or typical statements.
    pub fn new(dialect: MtlDialect, signatures: Signatures, sections: &[Section]) -> Self {
        let is_auto = dialect == MtlDialect::Auto;
        let of_obj = signatures.obj.filter(|obj| obj.fits(sections));
        let signature = signatures.library.or(of_obj);
        let dialect = match dialect {
            MtlDialect::Auto => signature
                .map(|signature| signature.dialect)
                .or_else(|| habit_of(sections))
                .unwrap_or_default(),
            chosen => chosen,
        };
        // If the signature of the library has no version, use the version in the signature of the
        // OBJ file.
        let mut versions = [signatures.library, signatures.obj].into_iter().flatten();
        let version = versions.find_map(|signature| signature.version.as_ref());
        let writer = match dialect {
            MtlDialect::Auto => Writer::Unknown,
            MtlDialect::Spec => Writer::Spec,
            MtlDialect::Blender => Writer::Blender(match version {
                Some(&(_, export)) => export,
                None => BlenderExport::of_exponents(signature.is_some(), sections),
            }),
            MtlDialect::Max => Writer::Max,
            MtlDialect::Maya => Writer::Maya,
            MtlDialect::Sketchup => Writer::Sketchup,
            MtlDialect::Cinema4d => Writer::Cinema4d,
            MtlDialect::Meshlab => Writer::Meshlab,
            MtlDialect::Rhino => Writer::Rhino,
            MtlDialect::Wings3d => Writer::Wings3d,
            MtlDialect::Threedfier => Writer::Threedfier,
            MtlDialect::Assimp => Writer::Assimp,
            MtlDialect::Highlight => Writer::Highlight,
        };
        let dissolves: Vec<_> = sections.iter().map(|section| section.dissolve).collect();
        // Until 2023, MeshLab wrote the opacity as `Tr`, and since then the transparency.
        let is_late = !dissolves.is_empty() && dissolves.iter().all(|d| d.d.is_none() && d.tr == Some(0.0));
        let usual = match writer {
            Writer::Meshlab if !is_late => TrMeaning::Opacity,
            _ if is_auto && is_tr_opacity(&dissolves) => TrMeaning::Opacity,
            Writer::Max => TrMeaning::TransparencyFirst,
            _ => TrMeaning::Transparency,
        };
        let other = is_auto.then(|| visible_meaning(usual, &dissolves)).flatten();
        let tr = other.unwrap_or(usual);
        let guess = is_auto.then(|| match writer {
            Writer::Unknown | Writer::Highlight => guess_of_unknown((tr, other.is_some()), sections),
            writer => {
                let name = writer.name(version.map(|(version, _)| version.as_str()));
                let (line, source) = match (signatures.library, signature) {
                    (Some(own), _) => (own.line, format!("written by {name}")),
                    (None, Some(_)) => (1, format!("written by {name}, as its OBJ file says")),
                    (None, None) => {
                        let source = format!(
                            "recognised as a file of {name} by its typical statements, since it has no comment"
                        );
                        (1, source)
                    }
                };
                let mut words = vec![writer.meaning()];
                if writer == Writer::Meshlab || other.is_some() {
                    words.insert(0, tr.words(other.is_some()));
                }
                Some((line, format!("{source}; {}", words.join("; "))))
            }
        });
        Self {
            writer,
            tr,
            is_tr_changed: other.is_some(),
            guess: guess.flatten(),
        }
    }
}

/// Guesses about a library of an unknown program, in words, with the line of the first guess.
/// `tr` is the meaning of `Tr`. The flag is true if with the other meaning most materials would be
/// invisible.
fn guess_of_unknown((tr, is_visible): (TrMeaning, bool), sections: &[Section]) -> Option<(usize, String)> {
    let excess = excess_of(sections).map(|(section, sum)| {
        let name = excerpt_of_name(&section.name);
        let words = format!(
            "Kd + Ks of material `{name}` is {}, so the surface would reflect more light than it receives; Ks and Ns of this library are read as \
             the highlight of a dielectric",
            excess_in_words(sum)
        );
        (section.line_of("ks"), words)
    });
    let flat = sections.iter().find(|section| section.has_flat_highlight());
    let flat = flat.map(|section| (section.line_of("ns"), "Ks with Ns 0 is ignored".to_string()));
    let opaque = sections.iter().find(|section| section.is_transparent_by_mistake());
    let opaque = opaque.map(|section| {
        let name = excerpt_of_name(&section.name);
        let words = format!(
            "illum {} with Ni 1 would make the texture of material `{name}` invisible; the material is read as opaque, as in files of Maya",
            section.illum.unwrap_or(0)
        );
        (section.line_of("illum"), words)
    });
    let tr = (tr == TrMeaning::Opacity || is_visible).then(|| {
        let words = if is_visible {
            tr.words(true)
        } else {
            "`Tr` is read as opacity: as transparency it would contradict the other statements"
        };
        (1, words.to_string())
    });
    let guesses: Vec<_> = [tr, excess, flat, opaque].into_iter().flatten().collect();
    let &(line, _) = guesses.first()?;
    let words: Vec<_> = guesses.into_iter().map(|(_, words)| words).collect();
    Some((line, words.join("; ")))
}

impl Writer {
    /// Name of the program, with its version if known.
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
            (Self::Rhino, _) => "Rhino",
            (Self::Wings3d, _) => "Wings 3D",
            (Self::Threedfier, _) => "3dfier",
            (Self::Assimp, _) => "Assimp",
            (Self::Spec | Self::Unknown | Self::Highlight, _) => "an unknown program",
        };
        name.into()
    }

    /// Interpretation of the program's statements, as text for messages.
    fn meaning(self) -> &'static str {
        match self {
            Self::Spec | Self::Unknown => "the file is read literally",
            Self::Blender(_) => "Ks and Ns are read as specular level and roughness",
            Self::Max => "Ks and Ns are read as specular level and glossiness, and map_Kd replaces Kd",
            Self::Maya => "illum 4 is opaque, Tf is read as opacity, Ks and Ns as the highlight of a dielectric",
            Self::Sketchup => "its constant Ks is ignored",
            Self::Cinema4d => {
                "Ks and Ns are read as the highlight of a dielectric, and illum 7 without Tf, Ni and d is opaque"
            }
            Self::Meshlab | Self::Wings3d | Self::Threedfier | Self::Highlight => {
                "Ks and Ns are read as the highlight of a dielectric"
            }
            Self::Rhino | Self::Assimp => "Ks and Ns are read as the highlight of a dielectric, and Tf is ignored",
        }
    }
}

impl BlenderExport {
    /// Exporter of a library whose comments have no version, by the values of `Ns`.
    ///
    /// Blender Internal had whole numbers h from 1 to 511 for hardness, and its exporters wrote
    /// `Ns` = (h − 1)/0.51. The values 0 and 900 occur in both older exporters. Values of the
    /// exporter in Python end at 900. The roughness 0.5 of new materials is 225 in this exporter,
    /// and 250 in the later exporter.
    fn of_exponents(has_signature: bool, sections: &[Section]) -> Self {
        let exponents = || sections.iter().filter_map(|section| section.exponent);
        let is_near = |ns: f32, value: f32| (ns - value).abs() < 1e-3;
        let is_hardness = |ns: f32| is_near(ns * 0.51, (ns * 0.51).round());
        let is_telling = |ns: f32| !is_near(ns, 0.0) && !is_near(ns, 900.0);
        if exponents().all(is_hardness) && exponents().any(is_telling) {
            return Self::Internal;
        }
        let is_native = exponents().any(|ns| ns > 900.5 || is_near(ns, 250.0));
        if has_signature || !is_native && exponents().any(|ns| is_near(ns, 225.0) || is_near(ns, 324.0)) {
            Self::Python
        } else {
            Self::Native { before_4: true }
        }
    }
}

/// Dialect of the program whose typical statements all materials of a library have.
fn habit_of(sections: &[Section]) -> Option<MtlDialect> {
    let all = |is_so: fn(&Section) -> bool| !sections.is_empty() && sections.iter().all(is_so);
    if all(is_like_blender) && sections.iter().any(|s| s.specular == Some(Spectrum::splat(0.5))) {
        Some(MtlDialect::Blender)
    } else if all(is_like_maya) && sections.iter().any(shows_maya) {
        Some(MtlDialect::Maya)
    } else if all(is_like_sketchup) {
        Some(MtlDialect::Sketchup)
    } else if all(is_like_3dfier) {
        Some(MtlDialect::Threedfier)
    } else {
        excess_of(sections).map(|_| MtlDialect::Highlight)
    }
}

/// Maximum scattered fraction of the light on a surface, with a margin for rounding of `f32`.
const FULL: f32 = 1.0001;
/// Maximum scattered fraction of the light on a surface, with a margin for numbers that the file
/// has rounded.
const MAX_ROUNDING: f32 = 1.01;
/// Maximum reflectance of a dielectric along the normal; diamond has 0.17.
const MAX_DIELECTRIC: f32 = 0.2;

/// Text of a sum above 1, with enough digits to show that the sum is above 1.
fn excess_in_words(sum: f32) -> String {
    let digits = if sum < MAX_ROUNDING { 5 } else { 3 };
    significant(sum.into(), digits)
}

/// First material whose literal `Kd` and `Ks` reflect more light than they receive, and the sum of
/// both.
///
/// A library has one writer, so one such material shows that `Ks` is not a share of the light in
/// any material of the library. With a picture, the reflectance is lower than the value of `Kd` or
/// `Ks`, so the sum of these values may be above 1.
fn excess_of(sections: &[Section]) -> Option<(&Section, f32)> {
    let shines = |section: &&Section| {
        let is_given = section.specular.is_some_and(|ks| !ks.is_black());
        is_given && section.may_have_highlight() && !section.has_flat_highlight()
    };
    sections.iter().filter(shines).find_map(|section| {
        let (material, _) = section.material(TrMeaning::Transparency);
        let sum = (material.diffuse + material.specular).max_component();
        let has_picture = section.has_map(MapSlot::Diffuse) || section.has_map(MapSlot::Specular);
        let has_room = has_picture && material.specular.max_component() <= MAX_DIELECTRIC;
        (sum > FULL && !has_room).then_some((section, sum))
    })
}

/// Returns true if the material has the statements that all exporters of Blender write, in their
/// order. `Ke` is optional.
fn has_statements_of_blender(section: &Section) -> bool {
    let keys = section.lines.iter().map(|(key, _)| key.as_str());
    let keys = keys.filter(|key| *key != "ke" && !key.starts_with("map_"));
    keys.eq(["ns", "ka", "kd", "ks", "ni", "d", "illum"])
}

/// Returns true if `Ks` is grey, and `Ka` is 1 or metallic, as Blender writes them.
fn is_like_blender(section: &Section) -> bool {
    let is_grey = |color: Option<Spectrum>| color.is_some_and(|c| c == Spectrum::splat(c.max_component()));
    let is_metal = matches!(section.illum, Some(3 | 6));
    has_statements_of_blender(section)
        && is_grey(section.specular)
        && is_grey(section.ambient)
        && (is_metal || section.ambient == Some(Spectrum::ONE))
}

/// Returns true if the material has `illum 4` (literally glass), no index of refraction except 1,
/// no opacity and no metallic-roughness statements. Maya writes every surface in this way.
fn is_like_maya(section: &Section) -> bool {
    section.illum == Some(4)
        && section.ior.is_none_or(|ior| ior == 1.0)
        && !section.dissolve.is_given()
        && !section.is_physical()
}

/// Returns true if the material has the name of a shading group, or cannot be glass. Glass with
/// `Tf` and `Ni 1.00` or `Ni 0.00` would be invisible. Glass without `Tf` would scatter more light
/// than it receives.
fn shows_maya(section: &Section) -> bool {
    let name = section.name.trim_end_matches(|c: char| c.is_ascii_digit());
    let is_shading_group = name.ends_with("SG") || name == "initialShadingGroup";
    let is_unseen = section.filter.is_some() && (section.ior == Some(1.0) || section.has_no_ior);
    let has_filter = section.filter.is_some_and(|filter| filter != Spectrum::ONE);
    let (material, _) = section.material(TrMeaning::Transparency);
    let is_excess = (material.diffuse + material.transmission).max_component() > MAX_ROUNDING;
    is_shading_group || is_unseen || !has_filter && is_excess
}

/// Returns true if the material has the constant `Ks` of SketchUp, and neither `Ns` nor `illum`.
fn is_like_sketchup(section: &Section) -> bool {
    section.specular == Some(Spectrum::splat(0.33)) && section.exponent.is_none() && section.illum.is_none()
}

/// Returns true if all colours of the material are equal and it has `Ns 60` and `illum 2`, as in
/// the materials that 3dfier writes.
fn is_like_3dfier(section: &Section) -> bool {
    section.specular.is_some()
        && section.specular == section.diffuse
        && section.specular == section.ambient
        && (section.exponent, section.illum) == (Some(60.0), Some(2))
}
