//! Calibrated cameras, compared with independent code for the camera models of OpenCV. The code
//! projects the point that a pixel sees. The projection must be the centre of the pixel.

use crate::support::program::*;
use crate::support::read_channel;
use tempfile::TempDir;

const SIZE: [usize; 2] = [64, 48];
/// Maximum distance of a projected point from the centre of its pixel, in pixels.
const TOLERANCE: f64 = 1e-3;

/// A closed box around the origin, whose faces emit light. All rays from inside hit the box.
pub(super) fn room() -> TempDir {
    let mut obj = String::from("mtllib a.mtl\nusemtl m\n");
    for i in 0..8 {
        let side = |bit: u32| if i >> bit & 1 == 0 { -9 } else { 9 };
        obj += &format!("v {} {} {}\n", side(0), side(1), side(2));
    }
    obj += "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";
    folder(&[
        ("a.obj", &obj),
        ("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n"),
        (
            "s.toml",
            "version = 1\n[image]\nwidth = 64\nheight = 48\n[render]\nsamples = 1\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

/// Transform from world to camera space: x right, y down, z forward.
#[derive(Clone, Copy)]
struct Extrinsics {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

impl Extrinsics {
    /// Extrinsics of a camera at the position `place`. The rotation is by `angle` in radians about
    /// `axis` (Rodrigues).
    fn new(axis: [f64; 3], angle: f64, place: [f64; 3]) -> Self {
        let length = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
        let [x, y, z] = axis.map(|a| a / length);
        let (sin, cos) = angle.sin_cos();
        let d = 1.0 - cos;
        let rotation = [
            [cos + x * x * d, x * y * d - z * sin, x * z * d + y * sin],
            [x * y * d + z * sin, cos + y * y * d, y * z * d - x * sin],
            [x * z * d - y * sin, y * z * d + x * sin, cos + z * z * d],
        ];
        let translation = rotation.map(|row| -(0..3).map(|i| row[i] * place[i]).sum::<f64>());
        Self { rotation, translation }
    }

    fn camera_point(&self, p: [f64; 3]) -> [f64; 3] {
        let along = |i: usize| (0..3).map(|j| self.rotation[i][j] * p[j]).sum::<f64>() + self.translation[i];
        [0, 1, 2].map(along)
    }

    /// Value of `--pose` in each of the three conventions.
    fn poses(&self) -> [String; 3] {
        let [a, b, c] = self.rotation;
        let [x, y, z] = self.translation;
        let row = |[p, q, r]: [f64; 3], s: f64, t: f64| format!("{},{},{},{}", s * p, s * q, s * r, s * t);
        let opencv = [row(a, 1.0, x), row(b, 1.0, y), row(c, 1.0, z)].join(",");
        let opengl = [row(a, 1.0, x), row(b, -1.0, y), row(c, -1.0, z)].join(",");
        // Inverse of the OpenGL matrix: the columns are the axes and the position.
        let place = [0, 1, 2].map(|i| -(a[i] * x + b[i] * y + c[i] * z));
        let rows = [0, 1, 2].map(|i| format!("{},{},{},{}", a[i], -b[i], -c[i], place[i]));
        [
            format!("opencv:{opencv}"),
            format!("opengl:{opengl},0,0,0,1"),
            format!("blender:{}", rows.join(",")),
        ]
    }
}

/// OpenCV's pinhole model. The equations are in the documentation of `projectPoints`.
fn pinhole([x, y, z]: [f64; 3], [k1, k2, p1, p2, k3]: [f64; 5]) -> [f64; 2] {
    let (x, y) = (x / z, y / z);
    let r2 = x * x + y * y;
    let radial = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
    [
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    ]
}

/// OpenCV's fisheye model. The equations are in its documentation.
fn fisheye([x, y, z]: [f64; 3], [k1, k2, k3, k4]: [f64; 4]) -> [f64; 2] {
    let across = x.hypot(y);
    let t = across.atan2(z);
    let distorted = t * (1.0 + k1 * t.powi(2) + k2 * t.powi(4) + k3 * t.powi(6) + k4 * t.powi(8));
    [x / across * distorted, y / across * distorted]
}

/// Renders the points seen by pixels, and compares their projections with the pixel centres.
fn assert_points_lead_back(
    folder: &TempDir,
    extrinsics: &Extrinsics,
    flags: &str,
    [fx, fy, cx, cy]: [f64; 4],
    project: impl Fn([f64; 3]) -> [f64; 2],
) {
    for pose in extrinsics.poses() {
        let args = format!("render s.toml -q -o t.exr --aov P --filter box --filter-radius 1e-5 {flags} --pose {pose}");
        done(folder.path(), &split(&args));
        let file = folder.path().join("t.exr");
        let [px, py, pz] = ["P.X", "P.Y", "P.Z"].map(|name| read_channel(&file, name));
        for i in 0..SIZE[0] * SIZE[1] {
            let [x, y] = project(extrinsics.camera_point([px[i], py[i], pz[i]].map(f64::from)));
            let center = [(i % SIZE[0]) as f64 + 0.5, (i / SIZE[0]) as f64 + 0.5];
            let distance = (fx * x + cx - center[0]).hypot(fy * y + cy - center[1]);
            assert!(
                distance < TOLERANCE,
                "{flags} --pose {pose}: pixel {center:?} is {distance} pixels off"
            );
        }
    }
}

#[test]
fn projected_points_lead_back_to_their_pixels() {
    let folder = room();
    let places = [
        Extrinsics::new([1.0, 2.0, -0.5], 0.7, [1.0, -2.0, 3.0]),
        Extrinsics::new([-0.3, 0.1, 1.0], 2.9, [-4.0, 0.5, 0.2]),
    ];
    let intrinsics = [55.0, 52.5, 30.25, 25.5];
    let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    for extrinsics in &places {
        for k in [
            [0.0; 5],
            [-0.2, 0.06, 0.004, -0.003, 0.01],
            [0.15, 0.03, -0.002, 0.005, 0.0],
        ] {
            let flags = format!("--intrinsics {} --distortion {}", list(&intrinsics), list(&k));
            assert_points_lead_back(&folder, extrinsics, &flags, intrinsics, |p| pinhole(p, k));
        }
        for k in [[0.0; 4], [0.06, -0.02, 0.008, -0.001]] {
            let intrinsics = [22.0, 21.0, 33.5, 22.25];
            let lists = format!("--intrinsics {} --distortion {}", list(&intrinsics), list(&k));
            let flags = format!("--projection fisheye {lists}");
            assert_points_lead_back(&folder, extrinsics, &flags, intrinsics, |p| fisheye(p, k));
        }
    }
}

/// Without distortion, and with the principal point in the centre, a calibrated camera equals a
/// perspective camera.
#[test]
fn centered_intrinsics_equal_a_perspective() {
    let folder = room();
    let camera = "render s.toml -q --spp 16 --denoise=off --position 1,2,3 --look-at 0,0,0";
    let focal = 24.0 / 20f64.to_radians().tan();
    done(folder.path(), &split(&format!("{camera} --fov 40 -o a.exr --aov P")));
    let flags = format!("--intrinsics {focal},{focal},32,24 -o b.exr --aov P");
    done(folder.path(), &split(&format!("{camera} {flags}")));
    for name in ["P.X", "P.Y", "P.Z"] {
        let [a, b] = ["a.exr", "b.exr"].map(|file| read_channel(&folder.path().join(file), name));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-4), "{name}");
    }
}

#[test]
fn scene_files_keep_calibrated_cameras() {
    let folder = room();
    let pose = "opencv:1,0,0,0,0,-1,0,0,0,0,-1,4";
    for projection in [
        "perspective --distortion=-0.2,0.06,0.004,-0.003,0.01",
        "fisheye --distortion 0.06,-0.02,0.008,-0.001",
        "fisheye",
    ] {
        let flags = format!("--intrinsics 50.5,51,31,24.5 --projection {projection}");
        let args = format!("render s.toml -q -o t.exr --pose {pose} {flags} --dump-scene d.toml");
        done(folder.path(), &split(&args));
        done(folder.path(), &split("render d.toml -q -o d.exr"));
        let at = |name: &str| folder.path().join(name);
        assert_same_bits(&at("t.exr"), &at("d.exr"));
    }
    // Set the camera by keys of the scene file
    let text = std::fs::read_to_string(folder.path().join("s.toml")).unwrap();
    let camera = "[camera]\npose = \"opencv: 1,0,0,0, 0,-1,0,0, 0,0,-1,4\"\nintrinsics = [50.5, 51, 31, 24.5]\n\
                  distortion = [0.06, -0.02, 0.008, -0.001]\nprojection = \"fisheye\"\n";
    std::fs::write(folder.path().join("k.toml"), text + camera).unwrap();
    done(folder.path(), &split("render k.toml -q -o k.exr"));
    let flags = "--intrinsics 50.5,51,31,24.5 --projection fisheye --distortion 0.06,-0.02,0.008,-0.001";
    done(
        folder.path(),
        &split(&format!("render s.toml -q -o t.exr --pose {pose} {flags}")),
    );
    assert_same_bits(&folder.path().join("t.exr"), &folder.path().join("k.exr"));
}

#[test]
fn impossible_calibrations_are_errors() {
    let folder = room();
    let pose = "--pose opencv:1,0,0,0,0,1,0,0,0,0,1,4";
    for (flags, words) in [
        ("--pose opencv:1,0,0,0,0,1,0,0,1,1,0,4", "singular matrix"),
        ("--pose opengl:1,0,0,0,0,1,0,0,0,0,-1,4", "mirrors"),
        ("--pose maya:1,0,0,0,0,1,0,0,0,0,-1,4", "opencv, opengl or blender"),
        ("--pose blender:1,2,3", "12 or 16 numbers"),
        ("--intrinsics 50,50,32", "two focal lengths"),
        ("--intrinsics 50,0,32,24", "focal lengths above 0"),
        ("--intrinsics 50,50,32,24 --distortion=-0.9,0,0,0,0", "it folds over"),
        ("--distortion 0.1,0,0,0", "needs `intrinsics`"),
        (
            "--projection fisheye --intrinsics 50,50,32,24 --distortion 0.1,0,0,0,0",
            "k1,k2,k3,k4",
        ),
        (
            "--projection panorama --intrinsics 50,50,32,24",
            "has no meaning in the projection `panorama`",
        ),
        ("--intrinsics 50,50,32,24 --fov 40", "cannot be used with"),
    ] {
        let pose = if flags.contains("--pose") { "" } else { pose };
        let output = run(
            folder.path(),
            &split(&format!("render s.toml -q -o t.png {pose} {flags}")),
        );
        assert_ne!(code(&output), 0, "{flags}");
        let said = crate::support::program::words(&output);
        assert!(said.contains(words), "{flags}: {said}");
    }
}
