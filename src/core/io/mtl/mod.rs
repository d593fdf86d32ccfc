//! MTL files: statements and materials (`section`), and textures (`map`).
//!
//! Programs disagree about the meaning of statements (`dialect`). `writer` finds the program that
//! wrote a library. `translate` replaces the statements by their meaning in that program. After
//! that, the materials are made.

mod dialect;
mod map;
mod reflectance;
mod section;
mod translate;
mod writer;

use super::statements::{place_of, possible_names, split_keyword, whole_statements, with_line_feeds};
use super::{FileError, Finding, Findings, MAX_PLACES, MAX_WRONG, Position, Severity};
use crate::color::Spectrum;
use crate::files::input::read_text;
use crate::material::Material;
use crate::math::{excerpt, excerpt_of_name, excerpt_of_path};
use crate::texture::Channel;
pub use dialect::MtlDialect;
pub use map::{MapSlot, MapStatement};
pub(super) use section::{Complaint, Section};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
pub use writer::Signature;
use writer::{Interpretation, Signatures};

/// Default diffuse reflectance of a surface.
const DEFAULT_DIFFUSE: f32 = 0.8;
/// Material, with the name `name`, for faces without a material.
pub fn default_material(name: &str) -> Material {
    Material {
        name: name.into(),
        diffuse: Spectrum::splat(DEFAULT_DIFFUSE),
        ..Material::default()
    }
}

/// Key for comparing the names of materials: the name in lower case, with one `_` for each run of
/// separators. Exporters replace characters: `Mat.1` and `mat_1` have the same key.
pub(super) fn key_of_name(name: &str) -> String {
    let mut key = String::with_capacity(name.len());
    for c in name.chars() {
        if c.is_alphanumeric() {
            key.extend(c.to_lowercase());
        } else if !key.ends_with('_') {
            key.push('_');
        }
    }
    key
}

/// Path of a library named in an OBJ file: relative to the OBJ's folder.
pub(crate) fn library_path(obj: &Path, name: &str) -> PathBuf {
    obj.parent().unwrap_or(Path::new("")).join(name)
}

/// A material of a file, and its texture statements.
#[derive(Clone, Debug)]
pub struct FileMaterial {
    /// The material as the library defines it.
    pub material: Material,
    /// Textures of the material.
    pub maps: Vec<MapRequest>,
    /// Library that defines the material.
    pub library: PathBuf,
    /// Line of the material's `newmtl`.
    pub line: usize,
    /// Statement that sets the opacity, if the library has such a statement.
    pub opacity: Option<OpacityStatement>,
}

/// Statement of a library that sets the opacity of a material.
#[derive(Clone, Copy, Debug)]
pub struct OpacityStatement {
    /// Line of the statement.
    pub line: usize,
    /// Advice on the flag with which the statement has another meaning, if it has one.
    pub other: Option<&'static str>,
}

impl FileMaterial {
    /// The default material, which no library defines.
    pub fn default_of(name: &str) -> Self {
        Self {
            material: default_material(name),
            maps: Vec::new(),
            library: PathBuf::new(),
            line: 0,
            opacity: None,
        }
    }

    /// Returns true if the material has a texture in `slot`.
    pub fn has_map(&self, slot: MapSlot) -> bool {
        self.maps.iter().any(|request| request.statement.slot == slot)
    }
}

/// A texture statement.
#[derive(Clone, Debug)]
pub struct MapRequest {
    /// Parsed statement.
    pub statement: MapStatement,
    /// Place of the statement, as an error without a message.
    pub place: FileError,
    /// True if `slot` is final. False for textures of libraries: the content of the picture then
    /// decides between height map and normal map.
    pub is_literal: bool,
    /// True if the texture is used only if its picture is a cut-out. The alpha of a colour texture
    /// is then used as opacity.
    pub if_cut_out: bool,
    /// File of the texture, if it was found.
    pub path: Option<PathBuf>,
}

impl MapRequest {
    /// The other possible slot of the texture: normal map instead of height map, or the reverse.
    /// The content of the picture decides between both slots. `None` if the slot does not depend on
    /// the content.
    pub fn other_slot(&self) -> Option<MapSlot> {
        let is_value = self.statement.mapping.channel.is_some_and(|c| c != Channel::Luminance);
        match self.statement.slot {
            _ if self.is_literal || is_value => None,
            MapSlot::Bump => Some(MapSlot::Normal),
            MapSlot::Normal => Some(MapSlot::Bump),
            _ => None,
        }
    }

    /// A warning about the texture, with its name and `words`.
    pub fn remark(&self, words: &str) -> FileError {
        let message = format!("texture `{}` {words}", excerpt_of_path(&self.statement.file));
        FileError {
            message,
            ..self.place.clone()
        }
    }
}

/// Data of an OBJ file that affect the reading of its libraries.
#[derive(Debug, Default)]
pub struct ObjContext {
    /// Program that wrote the OBJ file.
    pub signature: Option<Signature>,
    /// Names of used materials with a `#` that could begin a comment, such as `Paint #1`.
    pub whole_names: HashSet<String>,
    /// Names of materials that faces use; `None` if unknown.
    pub used: Option<HashSet<String>>,
    /// Keys (`key_of_name`) of the names in `used`; empty if names must be exact.
    pub used_keys: HashSet<String>,
}

impl ObjContext {
    /// Returns false if no face uses the material of this name.
    fn is_used(&self, name: &str) -> bool {
        let is_alike = || !self.used_keys.is_empty() && self.used_keys.contains(&key_of_name(name));
        self.used.as_ref().is_none_or(|used| used.contains(name) || is_alike())
    }
}

/// Materials of an MTL file, in the order of the file. `obj` has the data of the OBJ file that
/// names the library. A wrong value is replaced by the nearest valid one, or ignored.
pub fn load_mtl(path: &Path, obj: &ObjContext, options: LibraryOptions, findings: &mut Findings) -> Vec<FileMaterial> {
    let Some(text) = read_library(path, findings) else {
        return Vec::new();
    };
    let library = Library::new(&text, obj, options);
    let sections = library.sections(path, &text, findings);
    library.materials(path, sections, findings)
}

/// Statements of the format that have no effect: keyword in lower case, severity of the message,
/// and reason. The severity is a note if a path tracer computes the effect without the statement.
const IGNORED: [(&str, Severity, &str); 6] = [
    ("map_ka", Severity::Note, "ambient light is computed"),
    ("sharpness", Severity::Note, "reflections are computed"),
    ("map_aat", Severity::Note, "all textures are filtered"),
    (
        "refl",
        Severity::Warning,
        "reflections are computed, without pictures of them",
    ),
    (
        "map_refl",
        Severity::Warning,
        "reflections are computed, without pictures of them",
    ),
    ("decal", Severity::Warning, "pictures do not replace the material"),
];

/// Entry of [`IGNORED`] for the statement `key`. `None` if the statement is not in the list.
fn ignored(key: &str) -> Option<&'static (&'static str, Severity, &'static str)> {
    IGNORED.iter().find(|(known, ..)| key.eq_ignore_ascii_case(known))
}

/// Text of a library. `None` if it cannot be read.
pub(super) fn read_library(path: &Path, findings: &mut Findings) -> Option<String> {
    read_text(path, "the material library")
        .map(with_line_feeds)
        .map_err(|error| {
            let error = error.help_if_none("check the permissions of the file");
            findings.add(Severity::Error, "unreadable-file", error);
        })
        .ok()
}

/// A library in the interpretation of its writer and of the options.
pub(super) struct Library<'a> {
    dialect: MtlDialect,
    signature: Option<Signature>,
    obj: &'a ObjContext,
    is_blender: bool,
    /// Severity of a wrong value.
    pub wrong_severity: Severity,
}

/// Options for reading a library.
#[derive(Clone, Copy, Debug)]
pub struct LibraryOptions {
    /// Dialect of the library.
    pub dialect: MtlDialect,
    /// Severity of a wrong value.
    pub wrong_severity: Severity,
}

impl Default for LibraryOptions {
    fn default() -> Self {
        Self {
            dialect: MtlDialect::Auto,
            wrong_severity: Severity::Warning,
        }
    }
}

impl<'a> Library<'a> {
    /// A library with the text `text`. `obj` has the data of its OBJ file.
    pub fn new(text: &str, obj: &'a ObjContext, options: LibraryOptions) -> Self {
        let signature = Signature::find(text);
        let is_blender = match options.dialect {
            MtlDialect::Auto => signature.as_ref().is_some_and(|s| s.dialect == MtlDialect::Blender),
            dialect => dialect == MtlDialect::Blender,
        };
        Self {
            dialect: options.dialect,
            signature,
            obj,
            is_blender,
            wrong_severity: options.wrong_severity,
        }
    }

    /// A material without statements, whose `newmtl` is in line `line`.
    pub fn section(&self, name: &str, line: usize) -> Section {
        let max_clearcoat = if self.is_blender { translate::BLENDER_COAT } else { 1.0 };
        Section::new(name, line, max_clearcoat)
    }

    /// Adds a statement to a material. `whole` is the text after its keyword, including a comment.
    ///
    /// # Errors
    ///
    /// A value is wrong, as in [`Section::set`].
    pub fn read(
        &self,
        section: &mut Section,
        [key, rest]: [&str; 2],
        whole: Option<&str>,
        place: FileError,
    ) -> Result<Effect, Complaint> {
        let lower = key.to_ascii_lowercase();
        let line = place.position.map_or(0, |position| position.line);
        let Some(slot) = MapSlot::of_keyword(&lower, self.is_blender) else {
            let is_known = section.set(&lower, key, rest);
            if !matches!(is_known, Ok(false)) {
                section.lines.push((lower, line));
            }
            return Ok(if is_known? { Effect::Full } else { Effect::None });
        };
        let mut statement = MapStatement::parse(slot, rest).map_err(|message| {
            let help = "write options, then the name of a picture: map_Kd -s 2 2 wall.png";
            (format!("{key} has no effect, since {message}"), help)
        })?;
        let whole = whole.and_then(|whole| MapStatement::parse(slot, whole).ok());
        statement.whole_file = whole.map(|whole| whole.file);
        let ignored = statement.ignored.clone();
        // If a slot has several statements, the last statement is used.
        section.maps.retain(|m| m.statement.slot != slot);
        section.maps.push(MapRequest {
            statement,
            place,
            is_literal: false,
            if_cut_out: false,
            path: None,
        });
        Ok(Effect::Without(ignored))
    }

    /// Statements of each material, before their translation from the dialect of the library.
    pub fn sections(&self, path: &Path, text: &str, findings: &mut Findings) -> Vec<Section> {
        let mut sections: Vec<Section> = Vec::new();
        let mut skipped: Vec<(String, usize)> = Vec::new();
        let mut wrong = WrongStatements::default();
        let mut unknown: HashSet<String> = HashSet::new();
        let mut ignored_lines: HashMap<&str, Vec<usize>> = HashMap::new();
        for statement in whole_statements(text) {
            let ((key, rest), line, whole) = (split_keyword(&statement.text), statement.line, statement.whole_name());
            if key.eq_ignore_ascii_case("newmtl") {
                let is_used = |name: &&str| self.obj.whole_names.contains(*name);
                let whole = whole.and_then(|whole| possible_names(whole).find(is_used));
                sections.push(self.section(whole.unwrap_or(rest), line));
                continue;
            }
            // Statements before the first material have no effect.
            let Some(section) = sections.last_mut() else { continue };
            let place = FileError::new(path, "").at(Position::line(line));
            match self.read(section, [key, rest], whole, place) {
                Ok(Effect::Full) => {}
                Ok(Effect::Without(options)) => {
                    skipped.extend(options.into_iter().map(|option| (option.to_string(), line)));
                }
                Ok(Effect::None) => match ignored(key) {
                    Some((known, ..)) => ignored_lines.entry(known).or_default().push(line),
                    None if unknown.insert(key.to_string()) => skipped.push((key.to_string(), line)),
                    None => {}
                },
                Err(complaint) if self.reports_errors_of(section) => {
                    wrong.add(&section.name, complaint, || place_of(text, line, suspect(key, rest)));
                }
                Err(_) => {}
            }
        }
        wrong.report(path, self.wrong_severity, findings);
        for (key, severity, why) in &IGNORED {
            let Some(lines) = ignored_lines.get(key) else { continue };
            let message = match lines.len() {
                1 => format!("`{key}` has no effect: {why}"),
                count => format!("{count} statements `{key}` have no effect, the first in this line: {why}"),
            };
            let mut places = lines.iter().map(|&line| Position::line(line));
            let first = FileError::new(path, message).at(places.next().unwrap_or(Position::line(1)));
            let finding = Finding::new(*severity, "ignored-statement", first);
            findings.push(finding.repeated(lines.len() as u64, places));
        }
        if let Some((first, line)) = skipped.first() {
            let keys: Vec<_> = skipped.iter().map(|(key, _)| excerpt(key)).collect();
            let message = format!(
                "statements or options without effect: {}; the first in this line",
                keys.join(", ")
            );
            let error = FileError::new(path, message).at(place_of(text, *line, first));
            let others = skipped.iter().skip(1).map(|&(_, line)| Position::line(line));
            let finding = Finding::new(Severity::Warning, "unknown-keyword", error);
            findings.push(finding.repeated(skipped.len() as u64, others));
        }
        sections
    }

    /// Returns true if errors of the material are reported. Its faces must be used, or wrong
    /// statements must be errors.
    fn reports_errors_of(&self, section: &Section) -> bool {
        self.wrong_severity == Severity::Error || self.obj.is_used(&section.name)
    }

    /// Materials from the statements `sections`, after their translation from the dialect of the
    /// library.
    pub fn materials(&self, path: &Path, sections: Vec<Section>, findings: &mut Findings) -> Vec<FileMaterial> {
        let signatures = Signatures {
            library: self.signature.as_ref(),
            obj: self.obj.signature.as_ref(),
        };
        let reading = Interpretation::new(self.dialect, signatures, &sections);
        let mut is_read_otherwise = false;
        let mut idle: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        let mut materials = Vec::with_capacity(sections.len());
        for mut section in sections {
            // Report the dialect that was guessed if the literal reading gives another material.
            let slots = |section: &Section| section.maps.iter().map(|m| m.statement.slot).collect::<Vec<_>>();
            let by_letter = (section.material(Interpretation::LETTER.tr).0, slots(&section));
            section.translate(reading.writer);
            let (material, remarks) = section.material(reading.tr);
            let is_used = self.obj.is_used(&section.name);
            for key in section.idle_numbers(&material).into_iter().filter(|_| is_used) {
                idle.entry(key)
                    .or_default()
                    .push(section.line_of(&key.to_ascii_lowercase()));
            }
            is_read_otherwise |= by_letter != (material.clone(), slots(&section));
            for remark in remarks.into_iter().chain(section.assumed()).filter(|_| is_used) {
                let message = format!("material `{}`: {}", excerpt_of_name(&section.name), remark.words);
                let error = FileError::new(path, message);
                let error = match section.line_of(remark.key) {
                    // The tobj reader has no line numbers
                    0 => error,
                    line => error.at(Position::line(line)),
                };
                findings.add(remark.severity, remark.code, error);
            }
            materials.push(FileMaterial {
                material,
                opacity: section.opacity_statement(reading.tr),
                maps: section.maps,
                library: path.to_path_buf(),
                line: section.line,
            });
        }
        for (key, lines) in idle {
            let why = match key {
                "Ns" => "there is no highlight",
                "Ni" => "nothing refracts",
                _ => "ambient light is computed",
            };
            let number = lines.len() as u64;
            let users = match number {
                1 => "1 material has no effect".to_string(),
                _ => format!("{number} materials has no effect, the first in this line"),
            };
            let message = format!("{key} of {users}: {why}");
            let mut places = lines.into_iter().map(Position::line);
            if let Some(first) = places.next() {
                let error = FileError::new(path, message).at(first);
                findings.push(Finding::new(Severity::Note, "idle-number", error).repeated(number, places));
            }
        }
        let is_told = is_read_otherwise || reading.is_tr_changed;
        if let Some((line, words)) = reading.guess.filter(|_| is_told) {
            let error = FileError::new(path, words).at(Position::line(line));
            let help = "--mtl-dialect spec reads the file literally: Ks and Ns as a Phong lobe, Tr as transparency";
            findings.add(Severity::Note, "mtl-dialect", error.help(help));
        }
        materials
    }
}

/// Wrong statements of a library. Statements with equal errors are grouped.
#[derive(Default)]
struct WrongStatements {
    kinds: Vec<WrongStatement>,
    /// Number of wrong statements after the first `MAX_WRONG` kinds.
    unlisted: usize,
}

/// An error of a statement, and of statements of other materials with the same error.
struct WrongStatement {
    /// Name of the first material.
    material: String,
    complaint: Complaint,
    /// Number of statements with the error.
    count: u64,
    /// Positions of the first statements with the error.
    places: Vec<Position>,
}

impl WrongStatements {
    fn add(&mut self, material: &str, complaint: Complaint, place: impl Fn() -> Position) {
        if let Some(known) = self.kinds.iter_mut().find(|known| known.complaint == complaint) {
            known.count += 1;
            if known.places.len() <= MAX_PLACES {
                known.places.push(place());
            }
        } else if self.kinds.len() < MAX_WRONG {
            self.kinds.push(WrongStatement {
                material: material.into(),
                complaint,
                count: 1,
                places: vec![place()],
            });
        } else {
            self.unlisted += 1;
        }
    }

    fn report(self, path: &Path, severity: Severity, findings: &mut Findings) {
        for kind in self.kinds {
            let others = match kind.count - 1 {
                0 => String::new(),
                1 => " and another one".into(),
                n => format!(" and {n} others"),
            };
            let mut places = kind.places.into_iter();
            let Some(first) = places.next() else { continue };
            let ((message, help), name) = (kind.complaint, excerpt_of_name(&kind.material));
            let error = FileError::new(path, format!("material `{name}`{others}: {message}"));
            let finding = Finding::new(severity, "wrong-statement", error.at(first).help(help));
            findings.push(finding.repeated(kind.count, places));
        }
        findings.add_unlisted(severity, path, self.unlisted);
    }
}

/// The part of a statement that has an effect.
pub(super) enum Effect {
    /// The whole statement.
    Full,
    /// The whole statement except these options of a texture.
    Without(Vec<&'static str>),
    /// No part of the statement, because the keyword is unknown.
    None,
}

/// Word of a wrong statement that is probably the cause of the error: the first word that is not a
/// number. If there is no such word, the first word is returned, or the keyword if there are no
/// words.
fn suspect<'a>(key: &'a str, rest: &'a str) -> &'a str {
    let is_number = |word: &&str| word.parse().is_ok_and(|n: f32| n.is_finite() && n >= 0.0);
    let mut words = rest.split_whitespace();
    let wrong = words.clone().find(|word| !is_number(word));
    wrong.or_else(|| words.next()).unwrap_or(key)
}

#[cfg(test)]
mod dialect_tests;
#[cfg(test)]
mod tests;
