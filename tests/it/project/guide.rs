//! The guide, the README and CONTRIBUTING: links resolve, scene files are valid, commands parse,
//! and short commands run.
//!
//! Code blocks of the language `console` contain commands. Blocks of `console` run here; blocks of
//! `console slow` run if `EMBRASURE_GUIDE=all` is set (`make test-guide`). Blocks of `console
//! other` need files or programs that a test lacks: their flags are parsed, and nothing runs. The
//! commands of a page run one after another in one folder with the `scenes` of the project. Renders
//! without a size are small, except if all blocks run or images are written. With
//! `EMBRASURE_WRITE_DOCS=1` the resulting images replace the images of the page.

use crate::support::program::{PROGRAM, words};
use embrasure::SceneFile;
use std::collections::{BTreeSet, HashMap};
use std::env::var_os;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Instant;
use tempfile::TempDir;

/// Maximum bytes of all images of the guide, of one image, and of the images in the README.
const MAX_OF_GUIDE: u64 = 4_500_000;
const MAX_OF_PICTURE: u64 = 200_000;
const MAX_OF_README: u64 = 500_000;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

struct Page {
    /// Path from the folder of the project, with `/`.
    name: String,
    text: String,
}

/// A fenced block of code.
struct Block {
    info: String,
    line: usize,
    text: String,
}

struct Link {
    line: usize,
    target: String,
    is_picture: bool,
}

fn files_below(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files_below(&path, extension, found);
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
}

/// All pages of the book, and the README and CONTRIBUTING.
fn pages() -> Vec<Page> {
    let mut paths = Vec::new();
    files_below(&root().join("docs"), "md", &mut paths);
    paths.sort();
    paths.extend(["README.md", "CONTRIBUTING.md"].map(|name| root().join(name)));
    let read = |path: PathBuf| Page {
        name: path.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/"),
        text: fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())),
    };
    paths.into_iter().map(read).collect()
}

impl Page {
    fn is_of_guide(&self) -> bool {
        self.name.starts_with("docs/guide/")
    }

    fn at(&self, line: usize) -> String {
        format!("{}:{line}", self.name)
    }

    /// The page with empty lines in place of its code blocks, and the blocks.
    fn parts(&self) -> (String, Vec<Block>) {
        let (mut prose, mut blocks) = (String::new(), Vec::new());
        let mut open: Option<(String, Block)> = None;
        for (i, line) in self.text.lines().enumerate() {
            let trimmed = line.trim_start();
            let fence: String = trimmed.chars().take_while(|&c| c == '`').collect();
            match &mut open {
                Some((end, _)) if trimmed.trim_end() == end => blocks.extend(open.take().map(|(_, block)| block)),
                Some((_, block)) => block.text += &format!("{trimmed}\n"),
                None if fence.len() >= 3 => {
                    let info = trimmed[fence.len()..].trim().to_string();
                    let text = String::new();
                    open = Some((
                        fence,
                        Block {
                            info,
                            line: i + 1,
                            text,
                        },
                    ));
                }
                None => prose += line,
            }
            prose.push('\n');
        }
        assert!(open.is_none(), "{}: a block of code without an end", self.name);
        (prose, blocks)
    }

    fn links(&self) -> Vec<Link> {
        let text: Vec<char> = without_code(&self.parts().0).0.chars().collect();
        let mut links = Vec::new();
        for i in 0..text.len().saturating_sub(1) {
            if (text[i], text[i + 1]) != (']', '(') {
                continue;
            }
            let mut depth = 0;
            let start = (0..=i).rev().find(|&k| {
                depth += i32::from(text[k] == ']') - i32::from(text[k] == '[');
                depth == 0
            });
            let Some(start) = start else { continue };
            links.push(Link {
                line: 1 + text[..i].iter().filter(|&&c| c == '\n').count(),
                target: text[i + 2..].iter().take_while(|&&c| c != ')').collect(),
                is_picture: start > 0 && text[start - 1] == '!',
            });
        }
        links
    }

    /// Anchors that mdBook creates for the headings.
    fn anchors(&self) -> BTreeSet<String> {
        let (prose, mut seen) = (self.parts().0, HashMap::new());
        let headings = prose.lines().filter(|line| line.starts_with('#'));
        let name = |line: &str| -> String {
            let text = line.trim_start_matches('#').trim();
            text.chars()
                .filter_map(|c| match c {
                    _ if c.is_alphanumeric() || c == '_' || c == '-' => Some(c.to_ascii_lowercase()),
                    _ => c.is_whitespace().then_some('-'),
                })
                .collect()
        };
        let numbered = |name: String| {
            let count = seen.entry(name.clone()).or_insert(0);
            *count += 1;
            if *count == 1 {
                name
            } else {
                format!("{name}-{}", *count - 1)
            }
        };
        headings.map(name).map(numbered).collect()
    }

    /// Target file of a relative link of this page, from the folder of the project.
    fn resolve(&self, target: &str) -> String {
        let mut path = PathBuf::from(&self.name);
        path.pop();
        for part in Path::new(target).components() {
            match part {
                Component::ParentDir => assert!(path.pop(), "{}: {target} leaves the project", self.name),
                Component::CurDir => {}
                part => path.push(part),
            }
        }
        path.to_str().unwrap().replace('\\', "/")
    }
}

/// The text with blanks in place of its code spans, and the code spans.
fn without_code(text: &str) -> (String, Vec<String>) {
    let (mut prose, mut spans, mut rest) = (String::new(), Vec::new(), text);
    while let Some(start) = rest.find('`') {
        let ticks: String = rest[start..].chars().take_while(|&c| c == '`').collect();
        let (before, after) = (&rest[..start], &rest[start + ticks.len()..]);
        prose += before;
        match after.find(&ticks) {
            Some(end) => {
                let span = &after[..end];
                prose.extend(span.chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
                spans.push(span.to_string());
                rest = &after[end + ticks.len()..];
            }
            None => {
                prose += &ticks;
                rest = after;
            }
        }
    }
    (prose + rest, spans)
}

/// Panics with a list of all faults, so that a page can be corrected at once.
fn assert_none(found: Vec<String>) {
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// Every page is in the table of contents. mdBook does not build other pages.
#[test]
fn every_page_is_in_the_table_of_contents() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let summary = Page {
        name: "docs/SUMMARY.md".into(),
        text: summary,
    };
    let mut listed: Vec<String> = summary
        .links()
        .iter()
        .map(|link| summary.resolve(&link.target))
        .collect();
    listed.sort();
    let book = pages()
        .into_iter()
        .map(|page| page.name)
        .filter(|name| name.starts_with("docs/"));
    let mut there: Vec<String> = book.filter(|name| name != "docs/SUMMARY.md").collect();
    there.sort();
    assert_eq!(listed, there);
}

/// Links within the project lead to existing files and headings. Pages of the book link only to the
/// book.
#[test]
fn links_and_references_resolve() {
    let (pages, mut wrong) = (pages(), Vec::new());
    for page in &pages {
        for Link { line, target, .. } in page.links() {
            let mut fail = |why: &str| wrong.push(format!("{}: {target}: {why}", page.at(line)));
            if let Some(doi) = target.strip_prefix("https://doi.org/") {
                if !is_doi(doi) {
                    fail("no DOI");
                }
                continue;
            }
            if target.contains("doi.org") || target.starts_with("doi:") {
                fail("write https://doi.org/10.…");
            }
            if target.contains("://") {
                continue;
            }
            let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let name = if path.is_empty() {
                page.name.clone()
            } else {
                page.resolve(path)
            };
            if !root().join(&name).exists() {
                fail("there is no such file");
            } else if page.name.starts_with("docs/") && !name.starts_with("docs/") {
                fail("the book does not have it");
            } else if !anchor.is_empty() {
                let other = pages.iter().find(|page| page.name == name);
                if !other.is_some_and(|page| page.anchors().contains(anchor)) {
                    fail("there is no such heading");
                }
            }
        }
        for line in page.text.lines().filter(|line| line.contains("{{#include ")) {
            let target = line.trim().trim_start_matches("{{#include ").trim_end_matches("}}");
            let (path, anchor) = target.split_once(':').unwrap_or((target, ""));
            let text = fs::read_to_string(root().join(page.resolve(path))).unwrap_or_default();
            let has = |mark: &str| anchor.is_empty() || text.contains(&format!("// {mark}: {anchor}\n"));
            if text.is_empty() || !has("ANCHOR") || !has("ANCHOR_END") {
                wrong.push(format!("{}: {line}: there is no such file or anchor", page.name));
            }
        }
    }
    assert_none(wrong);
}

/// Returns true if the text has the form of a DOI: `10.`, the number of a registrant, and a name.
fn is_doi(text: &str) -> bool {
    let Some((registrant, name)) = text.strip_prefix("10.").and_then(|rest| rest.split_once('/')) else {
        return false;
    };
    let is_number = (4..=9).contains(&registrant.len()) && registrant.bytes().all(|b| b.is_ascii_digit());
    is_number && !name.is_empty() && name.chars().all(|c| c.is_ascii_graphic())
}

#[test]
fn dois_have_a_form() {
    assert!(is_doi("10.1145/15886.15902") && is_doi("10.1111/1467-8659.00146"));
    for wrong in ["", "10.", "10.1145", "10.1145/", "10.x/1", "11.1145/1", "10.1145/a b"] {
        assert!(!is_doi(wrong), "{wrong}");
    }
}

/// Each image of README and guide has its command on the same page, and is small.
#[test]
fn pictures_have_their_commands() {
    let (mut wrong, mut of_guide) = (Vec::new(), BTreeSet::new());
    let shows = |page: &Page| page.is_of_guide() || page.name == "README.md";
    for page in pages().into_iter().filter(shows) {
        let links = page.links();
        let unlinked = |text: String, link: &Link| text.replace(&format!("({})", link.target), "");
        let text = links.iter().fold(page.text.clone(), unlinked);
        let has_commands = text.contains("embrasure ") || text.contains("make ");
        let mut sum = 0;
        for link in links.into_iter().filter(|link| link.is_picture) {
            let name = page.resolve(&link.target);
            let file = name.rsplit('/').next().unwrap();
            let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
            // Loops name their images with a variable: `depth-$d.png`.
            let in_a_loop = stem.rsplit_once('-').map(|(start, _)| format!("{start}-$"));
            // The lab names its curves after the comparison: `-o sets` makes `sets-curves.svg`.
            let of_a_lab = stem.strip_suffix("-curves").map(|prefix| format!("-o {prefix}"));
            let is_in_the_text = |name: Option<String>| name.is_some_and(|name| text.contains(&name));
            let is_made = text.contains(stem) || is_in_the_text(in_a_loop) || is_in_the_text(of_a_lab);
            if !has_commands || !is_made {
                wrong.push(format!("{}: no command on this page makes {file}", page.at(link.line)));
            }
            let bytes = fs::metadata(root().join(&name)).map_or(0, |file| file.len());
            sum += bytes;
            if name.starts_with("docs/guide/") && of_guide.insert((name.clone(), bytes)) && bytes > MAX_OF_PICTURE {
                wrong.push(format!("{name}: {bytes} bytes"));
            }
        }
        if page.name == "README.md" && sum > MAX_OF_README {
            wrong.push(format!("README.md: its pictures have {sum} bytes"));
        }
    }
    let sum: u64 = of_guide.iter().map(|(_, bytes)| bytes).sum();
    if sum > MAX_OF_GUIDE {
        wrong.push(format!("the pictures of the guide have {sum} bytes"));
    }
    assert_none(wrong);
}

/// TOML blocks are scene files, or parts of scene files.
#[test]
fn scene_file_snippets_are_read() {
    let (folder, mut wrong) = (tempfile::tempdir().unwrap(), Vec::new());
    let file = folder.path().join("snippet.toml");
    for page in pages() {
        for block in page.parts().1.into_iter().filter(|block| block.info == "toml") {
            let mut text = block.text;
            if !text.contains("version = ") {
                text = format!("version = 1\n{text}");
            }
            if !text.contains("[[object]]") {
                text += "\n[[object]]\nobj = \"room.obj\"\n";
            }
            fs::write(&file, &text).unwrap();
            if let Err(error) = SceneFile::load(&file) {
                wrong.push(format!("{}: {error}", page.at(block.line)));
            }
        }
    }
    assert_none(wrong);
}

/// Shell code that comes before a block whose commands are only parsed. The program gets `--help`
/// as its last flag, so it only parses the other flags. Errors go to the file `refused`. Other
/// programs do nothing.
const READ_ONLY: &str = r#"
mkdir -p textures/wood
embrasure() { "$PROGRAM" "$@" --help >help 2>said || echo "embrasure $*: $(cat said)" >>refused; echo >>count; }
make() { :; }
cargo() { :; }
ffmpeg() { :; }
"#;

/// The commands and flags of all blocks exist, with valid values.
#[test]
fn commands_are_understood() {
    let (folder, mut wrong, mut count) = (tempfile::tempdir().unwrap(), Vec::new(), 0);
    let lines = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap_or_default();
    for page in pages() {
        for block in page
            .parts()
            .1
            .into_iter()
            .filter(|block| block.info.starts_with("console"))
        {
            let script = format!("{READ_ONLY}{}", block.text);
            let mut shell = Command::new("sh");
            shell.args(["-uc", &script]).env("PROGRAM", PROGRAM);
            let out = shell.current_dir(folder.path()).stdin(Stdio::null()).output().unwrap();
            let refused = lines("refused");
            if !refused.is_empty() || !out.stderr.is_empty() {
                wrong.push(format!("{}: {refused}{}", page.at(block.line), words(&out)));
            }
            count += lines("count").len();
            let _ = fs::remove_file(folder.path().join("refused"));
            let _ = fs::remove_file(folder.path().join("count"));
        }
    }
    assert_none(wrong);
    assert!(count > 50, "{count} commands");
}

/// Shell code that makes renders small, unless they have a size, scale or crop, or compute single
/// pixels.
const SMALL: &str = r#"embrasure() {
    case "$*" in
        *--size*|*--scale*|*--crop*|*--pixel*) command embrasure "$@" ;;
        render*|lab*) command embrasure "$@" --size 96x72 ;;
        *) command embrasure "$@" ;;
    esac
}
"#;

/// The page of all methods has valid commands and existing tests. With `EMBRASURE_GUIDE=all` the
/// commands run.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn methods_have_commands_and_tests() {
    let text = fs::read_to_string(root().join("docs/guide/reference/methods.md")).unwrap();
    let (folder, mut wrong, mut count) = (folder_with_scenes(), Vec::new(), 0);
    for row in text.lines().filter(|line| line.contains("| `embrasure ")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, idea, command, _, test, _] = cells[..] else {
            wrong.push(format!("not four cells: {row}"));
            continue;
        };
        let (command, test) = (command.trim_matches('`'), test.trim_matches('`'));
        let mut shell = Command::new("sh");
        shell
            .args(["-uc", &format!("{READ_ONLY}{command}")])
            .env("PROGRAM", PROGRAM);
        shell.current_dir(folder.path()).stdin(Stdio::null()).output().unwrap();
        if let Ok(refused) = fs::read_to_string(folder.path().join("refused")) {
            wrong.push(format!("{idea}: {refused}"));
            fs::remove_file(folder.path().join("refused")).unwrap();
        } else if takes_slow() {
            let (start, out) = (Instant::now(), shell_in(folder.path(), &format!("{SMALL}{command}")));
            println!("{idea}: {:.1} s", start.elapsed().as_secs_f64());
            if !out.status.success() {
                wrong.push(format!("{idea}: {command}\n{}", words(&out)));
            }
        }
        // `module::test` or `module` of tests/it, or `src/file.rs: test`
        let (file, name) = match test.split_once(": ") {
            Some((file, name)) => (file.to_owned(), Some(name)),
            None => {
                let (module, name) = test.split_once("::").map_or((test, None), |(m, n)| (m, Some(n)));
                (file_of(module), name)
            }
        };
        let source = fs::read_to_string(root().join(&file)).unwrap_or_default();
        let is_there = |name: &str| source.contains("#[test]") && source.contains(&format!("fn {name}()"));
        if source.is_empty() || !name.is_none_or(is_there) {
            wrong.push(format!("{idea}: there is no test {test}"));
        }
        count += 1;
    }
    assert_none(wrong);
    assert!(count > 70, "{count} methods");
}

/// File of a module of tests/it, in the folder of its subject.
fn file_of(module: &str) -> String {
    let folders = fs::read_dir(root().join("tests/it")).unwrap().flatten();
    let files = folders.map(|folder| format!("tests/it/{}/{module}.rs", folder.file_name().to_string_lossy()));
    files
        .into_iter()
        .find(|file| root().join(file).exists())
        .unwrap_or_default()
}

/// Returns true if commands run that take more than a few seconds.
fn takes_slow() -> bool {
    var_os("EMBRASURE_GUIDE").is_some_and(|value| value == "all")
}

/// Runs the commands in `folder`, with the program of this build.
fn shell_in(folder: &Path, commands: &str) -> Output {
    let programs = Path::new(PROGRAM).parent().unwrap().to_path_buf();
    let others = var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(programs).chain(std::env::split_paths(&others))).unwrap();
    let mut shell = Command::new("sh");
    shell.args(["-euc", commands]).env("PATH", &path).current_dir(folder);
    shell.output().unwrap()
}

/// A folder with the scenes of the project.
fn folder_with_scenes() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scenes = folder.path().join("scenes");
    fs::create_dir(&scenes).unwrap();
    for entry in fs::read_dir(root().join("scenes")).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, scenes.join(path.file_name().unwrap())).unwrap();
    }
    folder
}

/// Runs the blocks of commands, page by page. In `make test`, renders without a size are small.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn commands_run() {
    let writes = var_os("EMBRASURE_WRITE_DOCS").is_some();
    let only = var_os("EMBRASURE_GUIDE_PAGE").map(|name| name.into_string().unwrap());
    let mut wrong = Vec::new();
    for page in pages() {
        let runs = |block: &Block| block.info == "console" || (takes_slow() && block.info == "console slow");
        let blocks: Vec<Block> = page.parts().1.into_iter().filter(runs).collect();
        if blocks.is_empty() || only.as_ref().is_some_and(|only| !page.name.contains(only)) {
            continue;
        }
        let folder = folder_with_scenes();
        for block in blocks {
            let start = Instant::now();
            let small = if takes_slow() || writes { "" } else { SMALL };
            let out = shell_in(folder.path(), &format!("{small}{}", block.text));
            println!("{}: {:.1} s", page.at(block.line), start.elapsed().as_secs_f64());
            if !out.status.success() {
                wrong.push(format!("{}:\n{}{}", page.at(block.line), block.text, words(&out)));
            }
        }
        for link in page.links().into_iter().filter(|link| writes && link.is_picture) {
            let name = page.resolve(&link.target);
            let made = folder.path().join(name.rsplit('/').next().unwrap());
            if made.exists() {
                fs::copy(made, root().join(&name)).unwrap();
            }
        }
    }
    assert_none(wrong);
}
