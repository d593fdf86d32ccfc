use super::super::{Colors, Group, MaterialRules, PairSearch, into_groups};
use super::super::{chunk::DataSelection, counts::Chunks, parse};
use crate::geometry::triangle_normal;
use crate::io::FileError;
use crate::io::PartFilter;
use crate::math::hash::mix;
use crate::math::{Vec2, Vec3};
use std::path::Path;

/// Random numbers for the generator of files below.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 += 1;
        (mix(self.0) % sides as u64) as usize
    }

    fn pick<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.roll(of.len())]
    }
}

/// A corner: position, texture coordinates, normal.
type Corner = (Vec3, Option<Vec2>, Option<Vec3>);
/// Triangles of a material.
type Triangles = (Option<String>, Vec<[Corner; 3]>);

/// A random file in two forms, plain and irregularly formatted, and the triangles of the file by
/// material.
fn random_file(seed: u64) -> (String, String, Vec<Triangles>) {
    let mut dice = Dice(seed << 32);
    let (mut plain, mut wild) = (
        String::new(),
        String::from(dice.pick(&["", "\u{feff}", "# made by hand\n"])),
    );
    let mut groups: Vec<Triangles> = Vec::new();
    let mut material = None;
    let (mut v, mut vt, mut vn) = (Vec::new(), Vec::new(), Vec::new());
    let end = dice.pick(&["\n", "\r\n"]);
    let mut statement = |words: &[String], dice: &mut Dice| {
        plain += &words.join(" ");
        plain.push('\n');
        wild += dice.pick(&[
            "",
            "",
            " ",
            "\t",
            "\n",
            "# v 1 2\n",
            "g part\n",
            "l 1 2\n",
            "#f 1 2 3 \\\n",
        ]);
        for word in words {
            wild += word;
            wild += dice.pick(&[" ", " ", "  ", "\t", " \t ", "\\\n", " \\\r\n\t"]);
        }
        wild += dice.pick(&["", "", " # end", "#"]);
        wild += end;
    };
    for _ in 0..40 {
        let number = |dice: &mut Dice| dice.roll(2001) as f32 / 8.0 - 125.0;
        let written = |x: f32, dice: &mut Dice| match dice.roll(5) {
            0 => format!("{x:e}"),
            1 => format!("{x:.4}"),
            2 if x >= 0.0 => format!("+{x}"),
            3 if x.abs() < 1.0 => x.to_string().replacen("0.", ".", 1),
            _ => x.to_string(),
        };
        let words = |keyword: &str, numbers: &[f32], dice: &mut Dice| {
            let numbers = numbers.iter().map(|&x| written(x, dice));
            [keyword.to_string()].into_iter().chain(numbers).collect::<Vec<_>>()
        };
        match dice.roll(8) {
            0..3 => {
                let p = [0; 3].map(|_| number(&mut dice));
                v.push(Vec3::from(p));
                let mut words = words("v", &p, &mut dice);
                words.extend((0..dice.roll(4)).map(|_| "0.5".to_string()));
                statement(&words, &mut dice);
            }
            3 => {
                let uv = [number(&mut dice), number(&mut dice)];
                vt.push(Vec2::from(uv));
                statement(&words("vt", &uv, &mut dice), &mut dice);
            }
            4 => {
                let n = [number(&mut dice), number(&mut dice), 1.0];
                vn.push(Vec3::from(n).as_dvec3().normalize().as_vec3a());
                statement(&words("vn", &n, &mut dice), &mut dice);
            }
            5 => {
                let name = dice.pick(&["a", "b c", "Mat#2", "ä"]);
                material = Some(name.to_string());
                statement(&["usemtl".into(), name.into()], &mut dice);
            }
            _ if v.len() > 2 => {
                // All faces have three corners. Other tests check larger faces.
                let mut words = vec!["f".to_string()];
                let index = |count: usize, dice: &mut Dice| {
                    let i = dice.roll(count);
                    let written = if dice.roll(2) == 0 {
                        i as i64 - count as i64
                    } else {
                        i as i64 + 1
                    };
                    (i, written.to_string())
                };
                let (has_uv, has_normal) = (!vt.is_empty() && dice.roll(2) == 0, !vn.is_empty() && dice.roll(2) == 0);
                let corners = [0; 3].map(|_| {
                    let (i, mut word) = index(v.len(), &mut dice);
                    let mut corner = (v[i], None, None);
                    if has_uv {
                        let (i, text) = index(vt.len(), &mut dice);
                        corner.1 = Some(vt[i]);
                        word += &format!("/{text}");
                    }
                    if has_normal {
                        let (i, text) = index(vn.len(), &mut dice);
                        corner.2 = Some(vn[i]);
                        word += &format!("{}{text}", if has_uv { "/" } else { "//" });
                    }
                    words.push(word);
                    corner
                });
                statement(&words, &mut dice);
                // Faces with and without texture coordinates have groups of their own.
                let belongs =
                    |(name, faces): &&mut (_, Vec<[Corner; 3]>)| *name == material && faces[0][0].1.is_some() == has_uv;
                match groups.iter_mut().find(belongs) {
                    Some(group) => group.1.push(corners),
                    None => groups.push((material.clone(), vec![corners])),
                }
            }
            _ => {}
        }
    }
    (plain, wild, groups)
}

/// Groups of a text that is read in chunks of `chunk_bytes`.
fn read(text: &str, chunk_bytes: usize) -> Result<Vec<Group>, FileError> {
    let mut outline = parse::parse(
        Path::new("t.obj"),
        &Chunks::count(text, chunk_bytes),
        DataSelection::of_faces(&PartFilter::default()),
        &|_| (),
    )?;
    // First error of the file
    let wrong = std::mem::take(&mut outline.wrong).into_iter();
    match wrong.min_by_key(|error| error.position.map(|place| place.line)) {
        Some(error) => Err(error),
        None => Ok(into_groups(
            outline,
            Colors::default(),
            &MaterialRules::default(),
            PairSearch::default(),
        )
        .0),
    }
}

/// Debug text of a parsed file.
fn described(text: &str, chunk_bytes: usize) -> String {
    read(text, chunk_bytes).map_or_else(|error| error.to_string(), |groups| format!("{groups:?}"))
}

#[test]
fn random_file_has_its_expected_triangles() {
    for seed in 0..500 {
        let (plain, wild, expected) = random_file(seed);
        let groups = read(&wild, 100).unwrap_or_else(|e| panic!("{e}\n{wild}"));
        assert_eq!(groups.len(), expected.len(), "{wild}");
        for (group, (material, triangles)) in groups.iter().zip(&expected) {
            assert_eq!(
                (&group.material, group.mesh.triangles.len()),
                (material, triangles.len()),
                "{wild}"
            );
            let mesh = &group.mesh;
            let all: Vec<&Corner> = triangles.iter().flatten().collect();
            assert_eq!(mesh.uvs.is_empty(), all.iter().all(|c| c.1.is_none()));
            assert_eq!(mesh.normals.is_empty(), all.iter().all(|c| c.2.is_none()));
            for (triangle, corners) in mesh.triangles.iter().zip(triangles) {
                let [p0, p1, p2] = corners.map(|c| c.0);
                let flat = triangle_normal(p0, p1, p2);
                for (&i, &(p, uv, n)) in triangle.iter().zip(corners) {
                    let i = i as usize;
                    assert_eq!(mesh.positions[i], p, "{wild}");
                    assert!(mesh.uvs.is_empty() || mesh.uvs[i] == uv.unwrap_or(Vec2::ZERO), "{wild}");
                    let flat = if flat == Vec3::ZERO { Vec3::Z } else { flat };
                    assert!(
                        mesh.normals.is_empty() || mesh.normals[i] == n.unwrap_or(flat),
                        "{wild}"
                    );
                }
            }
        }
        // In the irregular form, statements are on other lines and name other parts, but have the
        // same meaning.
        let without_lines = |text: &str, chunk_bytes| {
            let groups = read(text, chunk_bytes).map(|mut groups| {
                for group in &mut groups {
                    group.line = 0;
                    group.mesh.set_parts(Vec::new());
                }
                groups
            });
            format!("{groups:?}")
        };
        assert_eq!(without_lines(&plain, 1 << 20), without_lines(&wild, 1), "{wild}");
    }
}

#[test]
fn result_does_not_depend_on_chunks_or_threads() {
    let text: String = (0..50)
        .map(|i| random_file(i).1.replace('\u{feff}', "") + "s 1\n")
        .collect();
    let whole = described(&text, text.len());
    assert!(whole.len() > text.len(), "{whole}");
    for size in [0, 1, 17, 100, 1001, 4096] {
        assert_eq!(described(&text, size), whole, "chunks of {size} bytes");
    }
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| described(&text, 500)), whole, "{threads} threads");
    }
    // The error names the first wrong line, for every size of chunks.
    let broken = format!("{text}f 1 2 x\n{text}f 1 2 y\n");
    let line = text.lines().count() + 1;
    for size in [1, 64, 5000, 1 << 20] {
        let error = read(&broken, size).unwrap_err();
        assert_eq!(error.position.unwrap().line, line);
    }
}

#[test]
fn damaged_file_does_not_panic() {
    let any = |dice: &mut Dice, of: &[u8]| of[dice.roll(of.len())];
    let mut refused = 0;
    for seed in 0..1000 {
        let mut dice = Dice(seed << 40);
        let mut text = random_file(seed % 100).1.into_bytes();
        for _ in 0..1 + dice.roll(6) {
            let at = dice.roll(text.len());
            match dice.roll(3) {
                0 => text[at] = any(&mut dice, b"0123456789/.-+e \t\\\n\r#fvtnsu\xff"),
                1 => drop(text.remove(at)),
                _ => text.insert(at, any(&mut dice, b"\\\n/- 9#f")),
            }
        }
        let text = String::from_utf8_lossy(&text);
        assert_eq!(described(&text, 1 << 20), described(&text, dice.roll(50)), "{text}");
        if let Err(error) = read(&text, 200) {
            assert!(error.position.is_some() && error.help.is_some(), "{error}");
            refused += 1;
        }
    }
    assert!((100..900).contains(&refused), "{refused} of 1000 are refused");
}
