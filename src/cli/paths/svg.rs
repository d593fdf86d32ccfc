//! Traces as a picture: the paths in the camera's view, and from the side.

use super::light_of;
use super::obj::{connections, paths, shadow_rays};
use super::trace::{Trace, VertexPlace};
use crate::cli::plot::{SvgTarget, color, svg_head};
use crate::geometry::GeomId;
use crate::math::{Bounds3, Vec2, Vec3, list};
use crate::scene::Scene;
use crate::session::Session;
use std::fmt::Write;

/// Width and height of a view, its margin, and the height of a line of the legend.
const VIEW: [f64; 2] = [440.0, 440.0];
const MARGIN: f64 = 10.0;
const LINE: f64 = 18.0;
/// Maximum number of triangles whose edges are drawn. For larger scenes the boxes of meshes are
/// drawn.
const MAX_TRIANGLES: u64 = 2000;
/// A view shows the whole scene if the size of the scene is at most this number times the size of
/// the paths.
const MUCH_LARGER: f32 = 4.0;
/// Maximum number of samples in the legend.
const MAX_LISTED: usize = 10;

/// Projection of points to two coordinates; `None` for points behind the viewer.
type Projection<'a> = &'a dyn Fn(Vec3) -> Option<[f64; 2]>;

/// SVG text of the picture.
pub(super) fn text(session: &Session, [x, y]: [u32; 2], samples: &[(u32, Vec<Trace>)]) -> String {
    let listed = samples.len().min(MAX_LISTED);
    let size = [
        2.0 * (VIEW[0] + MARGIN) + MARGIN,
        VIEW[1] + 60.0 + LINE * (listed + 2) as f64,
    ];
    let integrator = session.settings().chosen_integrator().name();
    let mut text = svg_head(
        size,
        &format!("Paths of the pixel {x},{y} by {integrator}"),
        SvgTarget::File,
    );
    let context = context(session.scene());

    // Draw the view of the camera
    let resolution = session.settings().resolution.as_vec2();
    let scale = (VIEW[0] as f32 / resolution.x).min(VIEW[1] as f32 / resolution.y);
    let of_film = |film: Vec2| {
        let place = (film - 0.5 * resolution) * scale;
        [f64::from(place.x) + 0.5 * VIEW[0], f64::from(place.y) + 0.5 * VIEW[1]]
    };
    let camera = session.world(&()).camera;
    let time = camera.shutter()[0];
    let seen = |p: Vec3| camera.film_of(p, time).map(of_film);
    let frame = of_film(Vec2::ZERO);
    begin(&mut text, "as the camera sees them", MARGIN);
    draw(&mut text, &seen, &context, samples);
    let [fx, fy] = of_film(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
    let _ = writeln!(
        text,
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"currentColor\" stroke-opacity=\"0.4\"/>\
         <circle cx=\"{fx:.1}\" cy=\"{fy:.1}\" r=\"5\" fill=\"none\" stroke=\"currentColor\"/>\n</svg>",
        frame[0],
        frame[1],
        VIEW[0] - 2.0 * frame[0],
        VIEW[1] - 2.0 * frame[1]
    );

    // Draw the view from the side, partly from above, without perspective
    let side = side_view(session, samples);
    begin(&mut text, "from the side, without perspective", VIEW[0] + 2.0 * MARGIN);
    draw(&mut text, &side, &context, samples);
    text += "</svg>\n";

    legend(&mut text, samples, VIEW[1] + 50.0, integrator);
    text + "</svg>\n"
}

/// Begins a view; `</svg>` ends it. Lines outside of the view are clipped.
fn begin(text: &mut String, name: &str, x: f64) {
    let [width, height] = VIEW;
    let _ = writeln!(
        text,
        "<text x=\"{x}\" y=\"18\" font-weight=\"bold\">{name}</text>\n<svg x=\"{x}\" y=\"26\" width=\"{width}\" height=\"{height}\">"
    );
}

/// Edges to draw: the edges of all triangles if the scene is small, else the edges of the meshes'
/// boxes.
fn context(scene: &Scene) -> Vec<[Vec3; 2]> {
    let mut edges = Vec::new();
    if scene.placed_triangle_count() <= MAX_TRIANGLES {
        for geom in scene.world_meshes() {
            let mesh = scene.mesh(GeomId(geom));
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                edges.extend([[a, b], [b, c], [c, a]]);
            }
        }
        return edges;
    }
    for geom in scene.world_meshes() {
        let bounds: Bounds3 = scene.mesh(GeomId(geom)).positions.iter().copied().collect();
        let corner = bounds.corners();
        for i in 0..8 {
            edges.extend(
                (0..3)
                    .filter(|axis| i >> axis & 1 == 0)
                    .map(|axis| [corner[i], corner[i | 1 << axis]]),
            );
        }
    }
    edges
}

/// Parallel projection with a view from the side, roughly perpendicular to the view direction of
/// the camera. The view contains all traces, but not the camera. It also contains the scene, if the
/// scene is not much larger.
fn side_view(session: &Session, samples: &[(u32, Vec<Trace>)]) -> impl Fn(Vec3) -> Option<[f64; 2]> {
    let camera = session.world(&()).camera;
    let resolution = session.settings().resolution.as_vec2();
    let time = camera.shutter()[0];
    let forward = camera.ray(0.5 * resolution, Vec2::splat(0.5), time).direction;
    let below = camera
        .ray(Vec2::new(0.5 * resolution.x, resolution.y), Vec2::splat(0.5), time)
        .direction;
    let down = (below - below.dot(forward) * forward).normalize_or(Vec3::NEG_Y);
    let across = forward.cross(down).normalize_or(Vec3::X);
    // Look from the side and a little from above
    let along = (across + 0.6 * down + 0.25 * forward).normalize();
    let horizontal = down.cross(along).normalize_or(forward);
    let vertical = along.cross(horizontal);
    let flat = move |p: Vec3| Vec2::new(p.dot(horizontal), p.dot(vertical));
    let vertices = samples
        .iter()
        .flat_map(|(_, traces)| traces)
        .flat_map(|trace| &trace.vertices);
    let places = vertices.filter(|vertex| !matches!(vertex.place, VertexPlace::Camera));
    let lit = samples
        .iter()
        .flat_map(|(_, traces)| lines(traces, |trace| shadow_rays(trace, false)))
        .flatten();
    let of_paths = extent(places.map(|vertex| vertex.p).chain(lit).map(flat));
    let bounds = session.scene().bounds();
    let of_scene = extent(bounds.corners().into_iter().map(flat));
    let (middle, extent) = match (of_paths, of_scene) {
        (Some((_, paths)), Some((middle, scene))) if scene < MUCH_LARGER * paths => (middle, scene),
        (Some(paths), _) => paths,
        (None, Some(scene)) => scene,
        (None, None) => (Vec2::ZERO, 1.0),
    };
    let scale = 0.92 * VIEW[0] as f32 / extent;
    move |p: Vec3| {
        let place = (flat(p) - middle) * scale;
        Some([f64::from(place.x) + 0.5 * VIEW[0], f64::from(place.y) + 0.5 * VIEW[1]])
    }
}

/// Centre and larger side of the rectangle around points; `None` without points.
fn extent(points: impl Iterator<Item = Vec2>) -> Option<(Vec2, f32)> {
    let around = |[low, high]: [Vec2; 2], p: Vec2| [low.min(p), high.max(p)];
    let [low, high] = points.fold([Vec2::INFINITY, Vec2::NEG_INFINITY], around);
    let side = (high - low).max_element();
    (side >= 0.0 && side.is_finite()).then(|| (0.5 * (low + high), side.max(f32::MIN_POSITIVE)))
}

fn draw(text: &mut String, view: Projection, context: &[[Vec3; 2]], samples: &[(u32, Vec<Trace>)]) {
    let edges: String = context.iter().filter_map(|edge| segment(view, *edge)).collect();
    let _ = writeln!(
        text,
        "<path d=\"{edges}\" stroke=\"currentColor\" stroke-opacity=\"0.18\" stroke-width=\"0.7\" fill=\"none\"/>"
    );
    for (i, (_, traces)) in samples.iter().enumerate() {
        let color = color(i);
        for (lines, style) in [
            (lines(traces, paths), "stroke-width=\"1.8\""),
            (
                lines(traces, |trace| shadow_rays(trace, false)),
                "stroke-width=\"1\" stroke-dasharray=\"5 3\"",
            ),
            (
                lines(traces, |trace| shadow_rays(trace, true)),
                "stroke-width=\"0.8\" stroke-dasharray=\"1 4\" stroke-opacity=\"0.7\"",
            ),
            (
                lines(traces, connections),
                "stroke-width=\"1\" stroke-dasharray=\"8 2 2 2\"",
            ),
        ] {
            let path: String = lines
                .iter()
                .flat_map(|line| line.windows(2))
                .filter_map(|ends| segment(view, [ends[0], ends[1]]))
                .collect();
            if !path.is_empty() {
                let _ = writeln!(text, "<path d=\"{path}\" stroke=\"{color}\" {style} fill=\"none\"/>");
            }
        }
        let dots = traces
            .iter()
            .flat_map(|trace| &trace.vertices)
            .filter_map(|vertex| view(vertex.p));
        for [x, y] in dots.filter(|place| is_near(*place)) {
            let _ = writeln!(text, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{color}\"/>");
        }
    }
}

/// Lines of all traces of a sample. `of` returns the lines of a trace.
fn lines(traces: &[Trace], of: impl Fn(&Trace) -> Vec<Vec<Vec3>>) -> Vec<Vec<Vec3>> {
    traces.iter().flat_map(of).collect()
}

/// Returns true if a point is near enough to the picture to be written.
fn is_near([x, y]: [f64; 2]) -> bool {
    x.abs() < 1e4 && y.abs() < 1e4
}

/// SVG path of a segment. The part behind the viewer is clipped.
fn segment(view: Projection, [a, b]: [Vec3; 2]) -> Option<String> {
    let (seen, unseen) = match (view(a), view(b)) {
        (Some(a), Some(b)) => return line([a, b]),
        (Some(_), None) => (a, b),
        (None, Some(_)) => (b, a),
        (None, None) => return None,
    };
    // Find the last visible point by bisection
    let [mut near, mut far] = [0.0f32, 1.0];
    for _ in 0..16 {
        let middle = 0.5 * (near + far);
        match view(seen.lerp(unseen, middle)) {
            Some(place) if is_near(place) => near = middle,
            _ => far = middle,
        }
    }
    line([view(seen)?, view(seen.lerp(unseen, near))?])
}

fn line(ends: [[f64; 2]; 2]) -> Option<String> {
    let [[ax, ay], [bx, by]] = ends;
    ends.into_iter()
        .all(is_near)
        .then(|| format!("M{ax:.1} {ay:.1}L{bx:.1} {by:.1}"))
}

/// Legend: the meaning of the lines, and the light of each sample.
fn legend(text: &mut String, samples: &[(u32, Vec<Trace>)], mut y: f64, integrator: &str) {
    let _ = writeln!(
        text,
        "<text x=\"{MARGIN}\" y=\"{y}\">{integrator}; full lines: paths, dashed: shadow rays that reach a light, dotted: occluded shadow rays, dash-dotted: connections</text>"
    );
    for (i, (sample, traces)) in samples.iter().enumerate().take(MAX_LISTED) {
        y += LINE;
        let light = list(&light_of(traces).to_array());
        let _ = writeln!(
            text,
            "<text x=\"{MARGIN}\" y=\"{y}\" fill=\"{}\">sample {sample}: radiance {light}</text>",
            color(i)
        );
    }
    if samples.len() > MAX_LISTED {
        let _ = writeln!(
            text,
            "<text x=\"{MARGIN}\" y=\"{}\">and {} more</text>",
            y + LINE,
            samples.len() - MAX_LISTED
        );
    }
}
