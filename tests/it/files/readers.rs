//! Both readers of OBJ and MTL files agree on the files of the project, except for known
//! differences.

use crate::support::program::{done, folder, read_json, refused};
use embrasure::files::memory::Allowance;
use embrasure::geometry::triangle_normal;
use embrasure::io::load_obj::load_obj;
use embrasure::io::{Findings, LoadOptions, ObjReader};
use embrasure::prelude::{Vec2, Vec3};
use embrasure::scene::SceneBuilder;
use embrasure::scene_file::{SceneFile, load_scene};
use std::fs;
use std::path::{Path, PathBuf};

/// Content of an OBJ file as a reader returns it, sorted.
#[derive(Default)]
struct ObjContents {
    /// Positions of the corners of each triangle.
    positions: Vec<[Bits; 3]>,
    /// Triangles with the names of their materials.
    faces: Vec<([Bits; 3], Option<String>)>,
    /// Triangles with texture coordinates other than 0, and normals other than the normal of the
    /// triangle.
    corners: Vec<[Corner; 3]>,
    materials: Vec<String>,
}

type Bits = [u32; 3];
type Corner = (Bits, Option<[u32; 2]>, Option<Bits>);

fn bits(v: Vec3) -> Bits {
    v.to_array().map(f32::to_bits)
}

fn read(path: &Path, reader: ObjReader) -> Result<ObjContents, String> {
    let mut options = LoadOptions::default();
    options.parameters.obj_reader = Some(reader);
    let mut findings = Findings::default();
    let file = load_obj(path, &options, Allowance::default(), &(), &mut findings).map_err(|e| e.to_string())?;
    let mut read = ObjContents::default();
    for group in &file.groups {
        let mesh = &group.mesh;
        for triangle in &mesh.triangles {
            let corners @ [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            let flat = triangle_normal(a, b, c);
            let uv = |v: u32| mesh.uvs.get(v as usize).filter(|uv| **uv != Vec2::ZERO);
            let normal = |v: u32| mesh.normals.get(v as usize).filter(|n| **n != flat);
            let of_corner = |v: u32| {
                let uv = uv(v).map(|uv| uv.to_array().map(f32::to_bits));
                (bits(mesh.positions[v as usize]), uv, normal(v).map(|n| bits(*n)))
            };
            read.positions.push(corners.map(bits));
            read.faces.push((corners.map(bits), group.material.clone()));
            read.corners.push(triangle.map(of_corner));
        }
    }
    for found in &file.materials {
        let maps: Vec<_> = found.maps.iter().map(|map| &map.statement).collect();
        read.materials.push(format!("{:?} {maps:?}", found.material));
    }
    read.positions.sort_unstable();
    read.faces.sort_unstable();
    read.corners.sort_unstable();
    read.materials.sort_unstable();
    Ok(read)
}

/// The kind of difference between the readers; empty if they agree.
fn difference(path: &Path) -> &'static str {
    match (read(path, ObjReader::Own), read(path, ObjReader::Tobj)) {
        (Err(_), Err(_)) => "",
        (Ok(_), Err(_)) => "refused",
        (Err(_), Ok(_)) => "accepted",
        (Ok(own), Ok(tobj)) if own.positions != tobj.positions => "triangles",
        (Ok(own), Ok(tobj)) if own.faces != tobj.faces => "materials of faces",
        (Ok(own), Ok(tobj)) if own.corners != tobj.corners => "corners",
        (Ok(own), Ok(tobj)) if own.materials != tobj.materials => "materials",
        _ => "",
    }
}

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn readers_agree_on_the_projects_files() {
    // Files for which the readers differ, and the kinds of difference
    let known = [
        ("globe.obj", "corners", "corners with and without coordinates"),
        ("pawns.obj", "corners", "smoothing groups"),
        ("pool.obj", "corners", "corners with and without coordinates"),
        ("presets.obj", "materials of faces", "materials without a definition"),
        ("ground.obj", "materials of faces", "materials without a definition"),
    ];
    let all: Vec<PathBuf> = ["scenes", "tests/faults", "docs/gallery"]
        .iter()
        .flat_map(|f| files(f))
        .collect();
    let objs: Vec<&PathBuf> = all
        .iter()
        .filter(|path| path.extension().is_some_and(|e| e == "obj"))
        .collect();
    assert!(objs.len() >= 13, "{} files", objs.len());
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let differing = objs.iter().map(|path| (name(path), difference(path)));
    let differing: Vec<(String, &str)> = differing.filter(|(_, found)| !found.is_empty()).collect();
    let known: Vec<(String, &str)> = known.map(|(name, what, _)| (name.to_string(), what)).to_vec();
    assert_eq!(differing, known);
}

/// Kinds of difference between the readers. Each kind has statements that cause the difference, and
/// the words of the guide about it.
const DIFFERENCES: [(&str, &[(&str, &str)]); 6] = [
    (
        "",
        &[
            ("f 1/1/2 2/2/2 3/3/2\nf 1/1/1 2/2/1 3/3/1 4/4/1", ""),
            ("s 1\nf 1 2 3 4\ns off\nf 1 2 3", ""),
            ("g a # group\nf 1 2 3\no b\nf -4 -3 -2", ""),
            ("mtllib a.mtl\nusemtl red\nf 1 2 3\nusemtl blue\nf 2 3 4", ""),
        ],
    ),
    (
        "refused",
        &[
            ("f 1 2 \\\n 3 4", "continued lines"),
            ("f 1 2 3 # corner", "comments after statements"),
            ("usemtl\nf 1 2 3", "materials without a name"),
            ("mtllib a.mtl\nusemtl\tred\nf 1 2 3", "tabs before names"),
            ("f 1 2 5\no a\nf -4 2 -2\nv 5 5 5", "vertices of later lines"),
            ("v 2 4 6 1 2\nf 1 2 5", "five values of a vertex"),
            ("vt 0.5\nf 1/5 2/1 3/1", "one texture coordinate"),
            ("vn 1.#QNAN 0 1\nf 1//3 2//3 3//3", "words for NaN"),
            ("f\nf 1 x\nf 1 2 3", "faces of fewer than three corners"),
            ("v nan 0 0\nf 1 2 5\nf 1 2 3", "wrong coordinates"),
        ],
    ),
    (
        "triangles",
        &[
            ("v 0.2 0.2 0\nf 1 2 3 4\nf 2 5 4 1", "concave polygons"),
            (
                "mtllib a.mtl\nusemtl red\nf 1 2 3\nusemtl blue\nf 3 2 1",
                "fronts and backs at one place",
            ),
            ("v 2 4 6 2\nf 1 2 5", "weights of vertices"),
            ("fo 1 2 3\nf 1 2 4", "the old keyword fo"),
            ("l 1 2 3 4\nf 1 2 3", "lines of three and more points"),
        ],
    ),
    (
        "materials of faces",
        &[
            ("mtllib A.MTL\nusemtl red\nf 1 2 3", "libraries by another name"),
            ("mtllib gone.mtl\nusemtl red\nf 1 2 3", "libraries by another name"),
            (
                "usemtl red\nf 1 2 3\nmtllib a.mtl",
                "libraries after their materials are used",
            ),
            ("mtllib a.mtl\nusemtl gone\nf 1 2 3", "materials without a definition"),
            (
                "mtllib one.mtl\nf 1 2 3",
                "the only material of a library, of faces without one",
            ),
        ],
    ),
    (
        "corners",
        &[
            ("s 1\nf 1 2 3\nv 0 0 1\nf 1 4 5", "smoothing groups"),
            (
                "f 1/1 2/2 3/3\nf 1 2 3\nf 1//1 2//2 3//1",
                "corners with and without coordinates",
            ),
            ("vn 0 0 0\nf 1//3 2//2 3//2", "normals of length 0"),
            ("f 1/1 2/0 3/3\nf 1 2 3", "index 0"),
        ],
    ),
    (
        "materials",
        &[
            ("mtllib grey.mtl\nf 1 2 3", "colours of one number"),
            ("mtllib case.mtl\nf 1 2 3", "keywords of MTL in other case"),
            ("mtllib early.mtl\nf 1 2 3", "wrong statements before newmtl"),
        ],
    ),
];

#[test]
fn reader_differences_match_the_guide() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 0.1 0 1\n";
    let library = "newmtl red\nKd 1 0 0\nNs 10\nTf 1 0.5 0\nPr 0.3\nnewmtl blue\nmap_Kd -s 2 2 wall.png\n";
    let page = include_str!("../../../docs/guide/reference/obj-mtl.md");
    let cases = DIFFERENCES
        .iter()
        .flat_map(|(what, cases)| cases.iter().map(move |case| (*what, case)));
    for (what, (lines, reason)) in cases {
        let folder = folder(&[
            ("t.obj", &format!("{square}{lines}\n")),
            ("a.mtl", library),
            ("one.mtl", "newmtl red\nKd 1 0 0\n"),
            ("grey.mtl", "newmtl red\nKd 0.5\nnewmtl blue\nKd 0 0 1\n"),
            ("case.mtl", "NEWMTL red\nkd 1 0 0\nnewmtl blue\nKd 0 0 1\n"),
            (
                "early.mtl",
                "Ns x\nnewmtl red\nKd 0 1 0\nbump b.png\nnewmtl blue\nKd 0 0 1\n",
            ),
        ]);
        assert_eq!(difference(&folder.path().join("t.obj")), what, "{lines}");
        assert!(page.contains(reason), "{reason}");
    }
}

/// No input of the fuzz targets makes the reader by the crate `tobj` panic, and each error has
/// help.
#[test]
fn tobj_survives_the_fuzz_corpus() {
    let place = tempfile::tempdir().unwrap();
    let (obj, library) = (place.path().join("a.obj"), place.path().join("a.mtl"));
    let inputs = |kind: &str| {
        ["corpus", "findings"]
            .map(|name| files(&format!("tests/fuzz/{name}/{kind}")))
            .concat()
    };
    let mut count = 0;
    for (kind, to) in [("obj", &obj), ("mtl", &library)] {
        fs::write(&obj, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n").unwrap();
        for input in inputs(kind) {
            fs::copy(&input, to).unwrap();
            let mut file = SceneFile::of_obj(&obj);
            file.load.parameters.obj_reader = Some(ObjReader::Tobj);
            if let Err(error) = load_scene(&file, SceneBuilder::new()) {
                assert!(error.help.is_some(), "{}: {error}", input.display());
            }
            count += 1;
        }
    }
    assert!(count > 300, "{count} inputs");
}

/// A plain scene has the same hash with both readers. If tobj refuses a file, the error names the
/// other reader.
#[test]
fn both_readers_give_the_same_scene_hash() {
    let obj =
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3 4\nusemtl blue\nf 1 2 5\n";
    let folder = folder(&[
        ("a.obj", obj),
        ("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nKe 1 1 1\n"),
        ("c.obj", &format!("{obj}f 1 2 4 # triangle\n")),
    ]);
    let at = folder.path();
    let [own, tobj] = ["own", "tobj"].map(|reader| {
        let args = "render a.obj --spp 2 --size 16x16 -o x.exr --stats x.json -q --obj-reader";
        done(at, &[args.split(' ').collect(), vec![reader]].concat());
        read_json(&at.join("x.json"))["scene_hash"].clone()
    });
    assert_eq!(own, tobj);
    let said = refused(at, &["render", "c.obj", "--obj-reader", "tobj", "-o", "y.exr"], 1);
    assert!(said.contains("--obj-reader own"), "{said}");
}
