use super::*;
use crate::geometry::{PrimId, triangle_normal};
use crate::math::hash::mix;
use crate::math::{Vec2, Vec3};

/// A file that was read, and its warnings.
#[derive(Debug)]
struct Read {
    groups: Vec<Group>,
    materials: Vec<FileMaterial>,
    warnings: Vec<String>,
}

fn load_file(path: &Path, options: &LoadOptions) -> Result<Read, FileError> {
    let mut findings = Findings::default();
    let ObjFile { groups, materials, .. } = load_obj(path, options, Allowance::default(), &(), &mut findings)?;
    match findings.first_error() {
        Some(error) => Err(error.clone()),
        None => Ok(Read {
            groups,
            materials,
            warnings: findings.warnings().into_iter().map(|w| w.text).collect(),
        }),
    }
}

fn load(text: impl AsRef<[u8]>) -> Result<Read, FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.obj");
    fs::write(&path, text).unwrap();
    load_file(&path, &LoadOptions::default())
}

/// The mesh of a file of one material, read without a warning.
fn mesh(text: &str) -> Mesh {
    let mut file = load(text).unwrap();
    assert_eq!((file.groups.len(), &file.warnings), (1, &vec![]), "{text}");
    file.groups.remove(0).mesh
}

/// Positions of the corners of triangle `t`.
fn corners(mesh: &Mesh, t: u32) -> [Vec3; 3] {
    mesh.corners(PrimId(t))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn faces_are_grouped_by_material() {
    let text = format!("{SQUARE}f 1 2 3\nusemtl a\nf 1 2 3 4\no part\nusemtl b c\nf 1 2 3\nusemtl\ta\nf -4 -3 -2\n");
    let file = load(&text).unwrap();
    let summary: Vec<_> = file
        .groups
        .iter()
        .map(|g| (g.material.as_deref(), g.mesh.triangles.len()))
        .collect();
    assert_eq!(summary, [(None, 1), (Some("a"), 3), (Some("b c"), 1)]);
    let a = &file.groups[1].mesh;
    assert_eq!(corners(a, 1), [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(corners(a, 2)[..2], [Vec3::ZERO, Vec3::X]);
    // Vertices are shared within a group, and there are no more than it needs.
    let vertices: Vec<_> = file.groups.iter().map(|g| g.mesh.positions.len()).collect();
    assert_eq!(vertices, [3, 4, 3]);
}

#[test]
fn dialects_are_read() {
    let text = format!("\u{feff}{SQUARE}usemtl a # red\nf 1 2 3 # one\nf 1 2 \\\n3 4\nf 1 2\n");
    for text in [text.clone(), text.replace('\n', "\r\n"), text.replace('\n', "\r")] {
        let file = load(&text).unwrap();
        assert_eq!(file.groups[0].material.as_deref(), Some("a"));
        assert_eq!(file.groups[0].mesh.triangles.len(), 3);
        let warning = &file.warnings[0];
        assert!(warning.contains("t.obj:9: 1 faces of fewer than 3"), "{warning}");
    }
}

#[test]
fn numbers_are_read_as_written_in_the_wild() {
    let plain = mesh("v 1 0.5 -2000\nv 5 0 0\nv 0 0.25 0\nf 1 2 3\n");
    let texts = [
        "v +1 .5 -2e3\nv 5. -0 0e9\nv 0 25E-2 0\nf 1 2 3",
        "  v\t1.0  5e-1\t-2000.000 0.7\t\r\nv 5 0 0 1 0 0 1\nv 0 0.2500000000000000000000000000001 0\n\tf\t-3 +2  -1 ",
        "v 1 0.5 -2000\nv 5 0 0\nv 0 0.25 0\nfo 1 2 3 # old",
        "f 1// 2/ 3\nv 1 0.5 -2000\nv 5 0 0\nv 0 0.25 0\n",
    ];
    for text in texts {
        let mesh = mesh(text);
        assert_eq!(
            (mesh.triangles.len(), corners(&mesh, 0)),
            (1, corners(&plain, 0)),
            "{text}"
        );
    }
    let latin = load(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl Wei\xdf\nf 1 2 3\n").unwrap();
    assert_eq!(latin.groups[0].material.as_deref(), Some("Wei\u{fffd}"));
}

#[test]
fn polylines_and_points_are_no_faces() {
    let file = load(format!("{SQUARE}l 1 2 3 4\np 1\nf 1 2 3\n")).unwrap();
    assert_eq!((file.groups[0].mesh.triangles.len(), file.warnings.len()), (1, 0));
}

#[test]
fn what_is_not_read_is_said_once() {
    let curve = "vp 0.5\ncstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 1\nend\ndeg 3\n";
    let file = load(format!("{SQUARE}f 1 2 3\ns x\n{curve}s y\n")).unwrap();
    assert_eq!(file.warnings.len(), 2);
    assert!(
        file.warnings[0].contains("t.obj:6: 2 smoothing groups"),
        "{:?}",
        file.warnings
    );
    let unread = "t.obj:7: 7 statements have no effect (vp, cstype, deg, curv, parm, end), the first is here";
    assert!(file.warnings[1].contains(unread), "{:?}", file.warnings);
}

#[test]
fn concave_faces_are_cut_inside() {
    // Seen from the first corner, the fan of this arrow would lie outside.
    let mesh = mesh("v 4 3 0\nv 0 0 0\nv 4 -3 0\nv 1 0 0\nf 1 2 3 4\n");
    for t in 0..2 {
        let [p0, p1, p2] = corners(&mesh, t);
        assert_eq!(triangle_normal(p0, p1, p2), Vec3::Z);
    }
}

#[test]
fn corners_with_all_indices_the_same_are_one_vertex() {
    let text = format!("{SQUARE}vt 0 0\nvt 1 0.5 7\nvt .25\nvn 0 0 2\nvn 0 -3 0\n");
    let file = mesh(&format!(
        "{text}f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/1/1\nf 1/1/2 -3/-2/-2 4/2/1\n"
    ));
    assert_eq!(file.triangles, [[0, 1, 2], [0, 2, 3], [4, 1, 5]]);
    let uvs = [[0.0, 0.0], [1.0, 0.5], [0.25, 0.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.5]];
    assert_eq!(file.uvs, uvs.map(Vec2::from));
    assert_eq!(file.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Z, -Vec3::Y, Vec3::Z]);

    let (no_normals, no_uvs) = (
        mesh(&format!("{text}f 1/1 2/2 3/1\n")),
        mesh(&format!("{text}f 1//1 2//1 3//2\n")),
    );
    assert_eq!((no_normals.uvs.len(), no_normals.normals.len()), (3, 0));
    assert_eq!((no_uvs.uvs.len(), no_uvs.normals.len()), (0, 3));
    let plain = mesh(&format!("{text}f 1 2 3\n"));
    assert_eq!((plain.uvs.len(), plain.normals.len()), (0, 0));
}

#[test]
fn faces_without_normals_stay_flat_among_others() {
    let text = format!(
        "{SQUARE}v 0 0 1\nvt 1 1\nvn 0 1 1\nvn 0 0 0\nvn nan 0 1\nvn 1.#QNAN 0 1\nvt inf 0\n\
         f 1/1/1 2/1/1 3/1/1\nf 1 2 5\nf 1//2 3//1 4//3\nf 1 2 3\n"
    );
    let file = load(&text).unwrap();
    assert!(
        file.warnings[0].contains("t.obj:8: 3 normals are zero or not finite"),
        "{:?}",
        file.warnings
    );
    assert!(
        file.warnings[1].contains("t.obj:11: 1 texture coordinates"),
        "{:?}",
        file.warnings
    );
    let mesh = &file.groups[0].mesh;
    let given = Vec3::new(0.0, 0.5f32.sqrt(), 0.5f32.sqrt());
    let normals = |t: usize| mesh.triangles[t].map(|i| mesh.normals[i as usize]);
    assert!(normals(0).iter().all(|n| n.distance(given) < 1e-6));
    assert_eq!(normals(1), [-Vec3::Y; 3]);
    assert_eq!([normals(2)[0], normals(2)[2]], [Vec3::Z; 2]);
    assert!(normals(2)[1].distance(given) < 1e-6);
    assert_eq!(normals(3), [Vec3::Z; 3]);
    let uvs = |t: usize| mesh.triangles[t].map(|i| mesh.uvs[i as usize]);
    assert_eq!([uvs(0), uvs(1)], [[Vec2::ONE; 3], [Vec2::ZERO; 3]]);
    // A group of normals that are none is flat.
    let flat = load(format!("{SQUARE}vn 0 0 0\nf 1//1 2//1 3//1\n")).unwrap();
    assert!(flat.groups[0].mesh.normals.is_empty());
}

/// A cube from -1 to 1 as quads, each with the statement before it.
fn cube(before: [&str; 6]) -> String {
    let side = |bit: usize, i: usize| if i >> bit & 1 == 1 { 1 } else { -1 };
    let mut text: String = (0..8)
        .map(|i| format!("v {} {} {}\n", side(0, i), side(1, i), side(2, i)))
        .collect();
    let quads = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
    for (statement, quad) in before.iter().zip(quads) {
        text += &format!("{statement}\nf {quad}\n");
    }
    text
}

#[test]
fn smoothing_groups_share_normals() {
    // All sides in one group: normals along the diagonals, by symmetry.
    let round = mesh(&cube(["s 3", "", "", "", "", ""]));
    assert_eq!(round.positions.len(), 8);
    for (p, n) in round.positions.iter().zip(&round.normals) {
        assert!((*n * 3f32.sqrt() - *p).length() < 1e-6, "{n} at {p}");
    }
    for off in ["s off", "s 0", "s"] {
        assert!(mesh(&cube([off, "", "", "", "", ""])).normals.is_empty());
    }
    // Two groups of two sides, opposite ones that share no corner, and two sides in none: all are flat.
    let flat = mesh(&cube(["s 1", "s 1", "s 2", "s 2", "s off", "s off"]));
    assert_eq!(flat.triangles.len(), 12);
    for t in 0..12 {
        let facet = flat.facet(PrimId(t));
        let normals = flat.triangles[t as usize].map(|i| flat.normals[i as usize]);
        assert!(normals.iter().all(|n| n.distance(facet.normal()) < 1e-6), "{t}");
    }
}

#[test]
fn smoothing_goes_by_position_and_across_materials() {
    // A roof of two sides whose vertices and materials are their own: along the ridge both have the normal of the
    // middle.
    let roof = "v -1 0 0\nv 0 1 0\nv 0 1 1\nv -1 0 1\nv -0 1 0\nv 1 0 0\nv 1 0 1\nv 0 1 1\n\
                s 1\nusemtl a\nf 4 3 2 1\nusemtl b\nf 8 7 6 5\n";
    let file = load(roof).unwrap();
    assert_eq!(file.groups.len(), 2);
    for group in &file.groups {
        for (p, n) in group.mesh.positions.iter().zip(&group.mesh.normals) {
            let expected = Vec3::new(p.x, 1.0, 0.0).normalize();
            assert!(n.distance(expected) < 1e-6, "{n} at {p}");
        }
    }
    // Given normals stay.
    let given = load(roof.replace("s 1", "vn 0 0 1\ns 1").replace("8 7 6 5", "8 7//1 6 5//1")).unwrap();
    let n = &given.groups[1].mesh.normals;
    assert_eq!([n[1], n[3]], [Vec3::Z; 2]);
    assert!(n[0].distance(Vec3::Y) < 1e-6);
    assert!(given.groups[0].mesh.normals[1].distance(Vec3::Y) < 1e-6);
}

#[test]
fn a_missing_library_is_a_warning() {
    let file = load(format!("{SQUARE}mtllib gone.mtl\nusemtl a\nf 1 2 3\nmtllib gone.mtl\n")).unwrap();
    assert!(
        file.warnings[0].contains("t.obj:5: material library"),
        "{}",
        file.warnings[0]
    );
    assert_eq!(file.warnings.len(), 1);
    assert_eq!(file.groups[0].material.as_deref(), Some("a"));
}

#[test]
fn libraries_are_found() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("Lib")).unwrap();
    for name in ["a.mtl", "b c.mtl", "Lib/d.mtl", "e.mtl"] {
        let material = name.trim_end_matches(".mtl");
        fs::write(folder.path().join(name), format!("newmtl {material}\nKd 1\n")).unwrap();
    }
    // Materials that come, and number of warnings
    let cases: [(&str, &[&str], usize); 7] = [
        ("mtllib a.mtl e.mtl", &["a", "e"], 0),
        ("mtllib b c.mtl", &["b c"], 0),
        ("mtllib e.mtl b\\ c.mtl", &["e", "b c"], 0),
        ("mtllib ./a.mtl\nmtllib ./a.mtl", &["a"], 0),
        ("mtllib Lib\\d.mtl a.mtl", &["Lib/d", "a"], 0),
        ("mtllib LIB\\D.mtl", &["Lib/d"], 1),
        ("mtllib a.mtl x.mtl", &["a"], 1),
    ];
    for (line, names, warnings) in cases {
        let path = folder.path().join("t.obj");
        fs::write(&path, format!("{line}\n{SQUARE}f 1 2 3\n")).unwrap();
        let file = load_file(&path, &LoadOptions::default()).unwrap();
        let got: Vec<_> = file.materials.iter().map(|m| m.material.name.as_str()).collect();
        assert_eq!(got, names, "{line}");
        // Where the system ignores case, it is not wrong.
        let expected = if folder.path().join("LIB").exists() && line.contains("LIB") {
            0
        } else {
            warnings
        };
        assert_eq!(file.warnings.len(), expected, "{line}: {:?}", file.warnings);
        assert!(
            file.warnings.iter().all(|w| w.contains("t.obj:1: material library")),
            "{:?}",
            file.warnings
        );
    }
}

#[test]
fn broken_lines_are_named() {
    let cases = [
        ("f 1 2 9\n", 5, "9"),
        ("f 1 2 0\n", 5, "0"),
        ("f 1 2 -7\n", 5, "-7"),
        ("f 1 2 x\n", 5, "x"),
        ("vn 0 0 1\nf 1//4 2//1 3//1\n", 6, "1//4"),
        ("# c\nv 1 nan 0\nf 1 2 5\n", 6, "nan"),
        ("v 1 2\nf 1 2 3\n", 5, "v 1 2"),
        ("v 1 2 inf\nf 1 2 5\n", 5, "inf"),
        ("v 1 2 a\nf 1 2 3\n", 5, "a"),
        ("vn 0 1\nf 1 2 3\n", 5, "vn 0 1"),
        ("v 1 2 1e39\nf 1 2 3\n", 5, "1e39"),
        ("v 1 2 -1.#IND\nf 1 2 3\n", 5, "-1.#IND"),
        ("v 1,5 2 3\nf 1 2 3\n", 5, "1,5"),
        ("vt\nf 1 2 3\n", 5, "vt"),
        ("vt 0 x\nf 1 2 3\n", 5, "`x`"),
        ("f 1/1 2/1 3/1\n", 5, "1/1"),
        ("f 1/2/3/4 2 3\n", 5, "1/2/3/4"),
        ("f /1 2 3\n", 5, "/1"),
        ("f 1 2 99999999999999999999\n", 5, "99999999999999999999"),
        ("f 1 2 -9223372036854775808\n", 5, "-9223372036854775808"),
        ("f 1 2 \\\n x\nf y 1 2\n", 6, "x"),
        ("f 1 2 3\nf 1 2 9\nv 1\n", 6, "9"),
        ("f 1 2 \u{7}\n", 5, "`\u{fffd}`"),
    ];
    for (rest, line, value) in cases {
        let error = load(format!("{SQUARE}{rest}")).unwrap_err();
        assert_eq!(error.position.map(|p| p.line), Some(line), "{rest:?}: {error}");
        assert!(error.message.contains(value), "{rest:?}: {error}");
        assert!(error.help.is_some(), "{rest:?}: {error}");
    }
    let long = load(format!("{SQUARE}f 1 2 {}\n", "9x".repeat(100_000))).unwrap_err();
    assert!(
        long.message.chars().count() < 100 && long.message.contains("9x9x"),
        "{long}"
    );
}

#[test]
fn indices_mean_what_was_there_at_their_line() {
    // Relative ones count back from their line, absolute ones may point ahead.
    let file = mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -3 -2 -1\nf 1 5 4\nv 0 0 5\n");
    assert_eq!(corners(&file, 0), [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(corners(&file, 1), [Vec3::X, Vec3::Y, Vec3::Z]);
    assert_eq!(corners(&file, 2), [Vec3::ZERO, 5.0 * Vec3::Z, Vec3::Z]);
    let error = load("f -1 -2 -3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap_err();
    assert_eq!(
        error.help.unwrap(),
        "no `v` came before this line: use a positive index"
    );
}

#[test]
fn nothing_to_render_is_an_error() {
    for text in [
        "",
        "# only a comment\n",
        SQUARE,
        "\n\n\\",
        "\u{feff}",
        "mtllib\nusemtl\ns\nv",
    ] {
        let error = load(text).unwrap_err();
        assert!(
            error.message.contains("no faces") || text.ends_with('v'),
            "{text:?}: {error}"
        );
    }
}

#[test]
fn long_faces_are_cut_as_fans() {
    let n = polygon::MAX_CLIPPED + 1;
    let circle = |i: usize| {
        let (sin, cos) = (i as f64 / n as f64 * std::f64::consts::TAU).sin_cos();
        format!("v {cos} {sin} 0\n")
    };
    let text: String = (0..n).map(circle).collect();
    let corners: String = (1..=n).map(|i| format!(" {i}")).collect();
    let file = load(format!("{text}f{corners}\n")).unwrap();
    assert_eq!(file.groups[0].mesh.triangles.len(), n - 2);
    assert!(
        file.warnings[0].contains("t.obj:10002: 1 faces of more than 10000 corners"),
        "{:?}",
        file.warnings
    );
}

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
/// Those of a material.
type Triangles = (Option<String>, Vec<[Corner; 3]>);

/// A random file, plain and as someone might write it, and its triangles by material.
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
                // Three corners: how larger faces are cut is tested elsewhere.
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
                match groups.iter_mut().find(|g| g.0 == material) {
                    Some(group) => group.1.push(corners),
                    None => groups.push((material.clone(), vec![corners])),
                }
            }
            _ => {}
        }
    }
    (plain, wild, groups)
}

/// What comes of a text that is read in pieces of so many bytes.
fn read(text: &str, piece_bytes: usize) -> Result<Vec<Group>, FileError> {
    let mut outline = parse::parse(Path::new("t.obj"), &Pieces::count(text, piece_bytes), false, &|_| ())?;
    match outline.wrong.pop() {
        Some(last) => Err(outline.wrong.into_iter().next().unwrap_or(last)),
        None => Ok(into_groups(outline)),
    }
}

/// The same in words.
fn described(text: &str, piece_bytes: usize) -> String {
    read(text, piece_bytes).map_or_else(|error| error.to_string(), |groups| format!("{groups:?}"))
}

#[test]
fn random_files_have_the_triangles_they_were_made_of() {
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
        // Statements are on other lines, but say the same.
        let without_lines = |text: &str, piece_bytes| {
            let groups = read(text, piece_bytes).map(|mut groups| {
                groups.iter_mut().for_each(|g| g.line = 0);
                groups
            });
            format!("{groups:?}")
        };
        assert_eq!(without_lines(&plain, 1 << 20), without_lines(&wild, 1), "{wild}");
    }
}

#[test]
fn neither_pieces_nor_threads_change_a_bit() {
    let text: String = (0..50)
        .map(|i| random_file(i).1.replace('\u{feff}', "") + "s 1\n")
        .collect();
    let whole = described(&text, text.len());
    assert!(whole.len() > text.len(), "{whole}");
    for size in [0, 1, 17, 100, 1001, 4096] {
        assert_eq!(described(&text, size), whole, "pieces of {size} bytes");
    }
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| described(&text, 500)), whole, "{threads} threads");
    }
    // The first wrong line is the error, whichever piece is read first.
    let broken = format!("{text}f 1 2 x\n{text}f 1 2 y\n");
    let line = text.lines().count() + 1;
    for size in [1, 64, 5000, 1 << 20] {
        let error = read(&broken, size).unwrap_err();
        assert_eq!(error.position.unwrap().line, line);
    }
}

#[test]
fn damaged_files_do_no_harm() {
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
