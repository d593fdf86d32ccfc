use super::statements::statements;
use super::{FileError, Position};
use std::path::Path;

/// Names the first line of an OBJ file that cannot be right.
///
/// tobj says what is wrong but not where; this is run only once a file was refused, so it may take its time.
pub(super) fn blame(path: &Path, text: &str, error: Option<&tobj::LoadError>) -> FileError {
    let mut total = Counts::default();
    statements(text).for_each(|(_, statement)| total.count(&statement));
    let mut so_far = Counts::default();
    for (line, statement) in statements(text) {
        so_far.count(&statement);
        let problem = check_line(&statement, &so_far, &total);
        if let Some((message, help)) = problem {
            return FileError::new(path, message).at(Position::line(line)).help(help);
        }
    }
    let message = error.map_or("a coordinate is not finite".to_string(), |e| e.to_string());
    FileError::new(path, message).help("export the file again, or repair it in a modelling program")
}

/// Numbers of `v`, `vt` and `vn` lines.
#[derive(Clone, Copy, Default)]
struct Counts([i64; 3]);

const KINDS: [&str; 3] = ["v", "vt", "vn"];
const NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl Counts {
    fn count(&mut self, line: &str) {
        let keyword = line.split_whitespace().next();
        if let Some(kind) = KINDS.iter().position(|&k| keyword == Some(k)) {
            self.0[kind] += 1;
        }
    }
}

/// What is wrong with the line, and the remedy.
fn check_line(line: &str, so_far: &Counts, total: &Counts) -> Option<(String, String)> {
    let mut words = line.split_whitespace();
    match words.next()? {
        "v" => check_numbers(line, words, 3),
        "vn" => check_numbers(line, words, 3),
        "vt" => check_numbers(line, words, 1),
        "f" => words.find_map(|corner| check_corner(corner, so_far, total)),
        _ => None,
    }
}

fn check_numbers<'a>(line: &str, words: impl Iterator<Item = &'a str>, needed: usize) -> Option<(String, String)> {
    let mut count = 0;
    for word in words {
        match word.parse::<f32>() {
            Ok(x) if x.is_finite() => count += 1,
            Ok(_) => {
                return Some((
                    format!("`{word}` is no finite number"),
                    "write a finite coordinate".into(),
                ));
            }
            Err(_) => return Some((format!("`{word}` is no number"), "write a decimal number".into())),
        }
    }
    (count < needed).then(|| {
        let line = line.trim();
        (
            format!("{needed} numbers expected: `{line}`"),
            "complete the line".into(),
        )
    })
}

fn check_corner(corner: &str, so_far: &Counts, total: &Counts) -> Option<(String, String)> {
    for (kind, text) in corner.split('/').enumerate() {
        if kind >= 3 {
            return Some((
                format!("`{corner}` has too many parts"),
                "write v, v/vt, v//vn or v/vt/vn".into(),
            ));
        }
        if text.is_empty() && kind > 0 {
            continue;
        }
        let Ok(index) = text.parse::<i64>() else {
            return Some((
                format!("`{corner}` is no face corner"),
                "write v, v/vt, v//vn or v/vt/vn".into(),
            ));
        };
        let name = NAMES[kind];
        let (relative, absolute) = (so_far.0[kind], total.0[kind]);
        if index == 0 {
            return Some((format!("{name} index 0 in `{corner}`"), "OBJ indices start at 1".into()));
        }
        if index < -relative {
            let help = format!("{relative} came before this line: use -{relative} to -1, or a positive index");
            return Some((format!("{name} index {index} in `{corner}` is out of range"), help));
        }
        if index > absolute {
            let help = match absolute {
                0 => format!("the file has no `{}` line", KINDS[kind]),
                _ => format!("the file has {absolute} `{}` lines: use 1 to {absolute}", KINDS[kind]),
            };
            return Some((format!("{name} index {index} in `{corner}` is out of range"), help));
        }
    }
    None
}
