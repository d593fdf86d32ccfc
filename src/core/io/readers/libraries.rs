//! Material libraries read by both readers.

use super::plain::{NAMELESS, ObjNames, plain_mtl, plain_text, whole_names_of_mtl};
use super::{ComparedFile, Kind, Notes, Wrong};
use crate::io::input::Input;
use crate::io::mtl::{Library, ObjContext, Section, library_path};
use crate::io::obj::{ObjLibrary, find_libraries};
use crate::io::tobj_reader::{Materials, read_library, sections};
use crate::io::{Findings, LoadOptions};
use crate::math::excerpt;
use std::collections::BTreeSet;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The libraries of an OBJ file.
pub(super) struct Libraries {
    obj: PathBuf,
    /// The libraries by the rules of the own reader.
    found: Vec<ObjLibrary>,
    /// Each file with its rewritten text and its report.
    files: Vec<(PathBuf, String, ComparedFile)>,
}

impl Libraries {
    /// Finds the libraries of an OBJ file, and keeps of its names those that they define.
    pub fn find(obj: &Path, names: &mut ObjNames) -> Vec<ObjLibrary> {
        let found = find_libraries(obj, &names.libraries, names.uses_materials);
        let texts = found
            .iter()
            .filter_map(|library| library.path.as_ref())
            .filter_map(|path| {
                let text = plain_text(path, "the material library", &mut Notes::default());
                text.ok()
            });
        let defined: BTreeSet<String> = texts.flat_map(|text| whole_names_of_mtl(&text)).collect();
        names.whole_names.retain(|name| defined.contains(name));
        found
    }

    /// Compares the libraries `found`; notes where tobj does not find what the own reader finds.
    pub fn compare(
        obj: &Path,
        names: &ObjNames,
        found: Vec<ObjLibrary>,
        options: &LoadOptions,
        notes: &mut Notes,
    ) -> Self {
        let mut files: Vec<(PathBuf, String, ComparedFile)> = Vec::new();
        let mut lines: Vec<usize> = found.iter().map(|library| library.line).collect();
        lines.dedup();
        for line in lines {
            let here = found.iter().filter(|library| library.line == line);
            let found_here: Vec<&PathBuf> = here.filter_map(|library| library.path.as_ref()).collect();
            let name = names.libraries.iter().find(|name| name.line == line);
            let by_tobj = name
                .map(|name| library_path(obj, &name.text))
                .filter(|path| path.is_file());
            if found_here != by_tobj.iter().collect::<Vec<_>>() {
                notes.add(Kind::LibraryName, line);
            }
        }
        for path in found.iter().filter_map(|library| library.path.clone()) {
            if files.iter().all(|(known, ..)| *known != path) {
                let (text, report) = compare_library(&path, names, options);
                files.push((path, text, report));
            }
        }
        Self {
            obj: obj.to_path_buf(),
            found,
            files,
        }
    }

    /// Whether some library is read otherwise by tobj.
    pub fn have_notes(&self) -> bool {
        self.files.iter().any(|(.., report)| !report.explained.0.is_empty())
    }

    /// Returns true if tobj refuses a library in which the own reader finds a wrong statement.
    pub fn are_refused(&self) -> bool {
        let mut reports = self.files.iter().map(|(.., report)| report);
        reports.any(|report| report.refused_by_own.is_some() && report.refused_by_tobj.is_some())
    }

    /// What tobj reads of a library as it is, found by its very name.
    pub fn by_very_name(&self, name: &Path) -> Materials {
        let path = library_path(&self.obj, &name.to_string_lossy());
        let opened = Input::open(&path, "the material library").ok();
        let read = opened.and_then(|input| read_library(&mut BufReader::new(input)).ok());
        read.unwrap_or_else(|| Ok(Default::default()))
    }

    /// What tobj reads of the rewritten libraries of a statement, which has its line as a name.
    pub fn plain(&self, named: &Path) -> Materials {
        let line: Option<usize> = named.to_str().and_then(|line| line.parse().ok());
        let here = self.found.iter().filter(|library| Some(library.line) == line);
        let mut text = String::new();
        for path in here.filter_map(|library| library.path.as_ref()) {
            let known = self.files.iter().find(|(known, ..)| known == path);
            text += known.map_or("", |(_, text, _)| text);
        }
        read_library(&mut text.as_bytes()).unwrap_or_else(|_| Ok(Default::default()))
    }

    pub fn into_reports(self) -> impl Iterator<Item = ComparedFile> {
        self.files.into_iter().map(|(.., report)| report)
    }
}

/// Compares a library; also returns its rewritten text.
fn compare_library(path: &Path, names: &ObjNames, options: &LoadOptions) -> (String, ComparedFile) {
    let mut report = ComparedFile::new(path);
    let mut notes = Notes::default();
    let text = match plain_text(path, "the material library", &mut notes) {
        Ok(text) => text,
        Err(error) => {
            // Neither reader has it.
            let refusal = format!("{}: {}", error.place(), error.message);
            (report.refused_by_own, report.refused_by_tobj) = (Some(refusal.clone()), Some(refusal));
            return (String::new(), report);
        }
    };
    let plain = plain_mtl(&text, &names.whole_names, &mut notes);
    let context = ObjContext {
        whole_names: names.whole_names.iter().cloned().collect(),
        ..ObjContext::default()
    };
    let library = Library::new(&text, &context, options.library_options());
    let mut findings = Findings::default();
    let own = library.sections(path, &text, &mut findings);
    let wrong = Wrong::of(path, &findings);
    report.refused_by_own.clone_from(&wrong.first);
    let of_tobj = |read: Result<Materials, String>| -> Result<Vec<Section>, String> {
        let (materials, _) = read?.map_err(|error| error.to_string())?;
        Ok(sections(&library, path, &text, &materials, &mut Findings::default()))
    };
    let first = Input::open(path, "the material library").map_err(|error| error.message);
    let first = of_tobj(first.and_then(|input| read_library(&mut BufReader::new(input))));
    report.refused_by_tobj = first.as_ref().err().cloned();
    let read = match notes.0.is_empty() {
        true => first,
        false => {
            let read = of_tobj(read_library(&mut plain.as_bytes()));
            let is_same = |a: &Section, b: &Section| a.name == b.name && a.values() == b.values();
            if let (Ok(first), Ok(read)) = (&first, &read) {
                if first.len() == read.len() && first.iter().zip(read).all(|(a, b)| is_same(a, b)) {
                    notes = Notes::default();
                }
            }
            read
        }
    };
    match read {
        Err(refusal) if !wrong.is_wrong() => report.differs(0, format!("tobj refuses the library: {refusal}")),
        Err(_) => {}
        Ok(read) => {
            report.explained = notes;
            compare_sections(&own, &read, &wrong, &mut report);
        }
    }
    (plain, report)
}

fn compare_sections(own: &[Section], read: &[Section], wrong: &Wrong, report: &mut ComparedFile) {
    report.materials = own.len() as u64;
    if own.len() != read.len() {
        let message = format!("the own reader finds {} materials and tobj {}", own.len(), read.len());
        report.differs(0, message);
        return;
    }
    let ends = own.iter().skip(1).map(|section| section.line).chain([usize::MAX]);
    for ((own, read), end) in own.iter().zip(read).zip(ends) {
        if own.name != read.name && !(own.name.is_empty() && read.name.starts_with(NAMELESS)) {
            let message = format!(
                "the material is called `{}` and by tobj `{}`",
                excerpt(&own.name),
                excerpt(&read.name)
            );
            report.differs(own.line, message);
        }
        let (values, by_tobj) = (own.values(), read.values());
        let mut keys: Vec<&String> = values.keys().chain(by_tobj.keys()).collect();
        keys.sort_unstable();
        keys.dedup();
        for key in keys {
            let (a, b) = (values.get(key), by_tobj.get(key));
            if a == b {
                continue;
            }
            let line = own.line_of(&key.to_ascii_lowercase());
            if wrong.has(own.line..end) {
                report.explained.add(Kind::WrongStatement, line);
                continue;
            }
            let [a, b] = [a, b].map(|value| value.map_or("missing", String::as_str));
            let message = format!("material `{}`: {key} is {a} and by tobj {b}", excerpt(&own.name));
            report.differs(line, message);
        }
    }
}
