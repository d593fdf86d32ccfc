//! Traces as JSON.

use super::trace::{Contribution, Technique, Trace, Vertex, VertexPlace};
use crate::bsdf::Lobe;
use crate::cli::info::{decimal, in_file};
use crate::color::Spectrum;
use crate::integrator::{EmissionRecord, LightSampleRecord, ScatteringRecord};
use crate::light::{Light, LightId};
use crate::math::Vec3;
use crate::scene::Scene;
use crate::session::Session;
use serde_json::{Map, Value, json};

pub(super) fn color(value: Spectrum) -> [f64; 3] {
    decimal(value.to_array())
}

fn vector(value: Vec3) -> [f64; 3] {
    decimal(value.to_array())
}

/// A number; `null` if it is not finite.
fn number(value: f32) -> f64 {
    decimal([value; 3])[0]
}

fn light(scene: &Scene, id: LightId) -> Value {
    let group = scene.light_groups().names().get(scene.light_groups().of(id)).cloned();
    let kind = scene.lights().get(id.0 as usize).map(|light| match light {
        Light::Area(_) => "surface",
        Light::Point(_) | Light::Spot(_) => "point",
        Light::Constant(_) | Light::Directional(_) | Light::Sun(_) | Light::Environment(_) => "background",
    });
    json!({ "id": id.0, "type": kind, "group": group })
}

/// Trace as JSON.
pub(super) fn trace(session: &Session, trace: &Trace) -> Value {
    json!({
        "from": match trace.key.y {
            y if y > i32::MAX as u32 => json!({ "chain": trace.key.x }),
            _ => json!({ "pixel": [trace.key.x, trace.key.y] }),
        },
        "filter_weight": number(trace.weight),
        "radiance": color(trace.sum()),
        "vertices": trace.vertices.iter().map(|v| vertex(session, v)).collect::<Vec<_>>(),
        "contributions": trace.contributions.iter().map(contribution).collect::<Vec<_>>(),
    })
}

fn vertex(session: &Session, vertex: &Vertex) -> Value {
    let (scene, origin) = (session.scene(), session.settings().camera.origin);
    let mut value = json!({
        "parent": vertex.parent,
        "position": in_file(vertex.p, origin),
        "beta": color(vertex.beta),
    });
    match vertex.place {
        VertexPlace::Camera => value["on"] = json!("camera"),
        VertexPlace::Light(id) => {
            value["on"] = json!("light");
            value["light"] = light(scene, id);
        }
        VertexPlace::Surface { hit, n, depth } => {
            value["on"] = json!("surface");
            value["depth"] = json!(depth);
            value["normal"] = json!(vector(n));
            value["distance"] = json!(number(hit.t));
            value["material"] = json!(scene.material(&hit).name);
            value["object"] = json!(scene.objects().get(scene.object(&hit) as usize));
            value["uv"] = json!(scene.uv(&hit).map(|uv| [uv.x, uv.y].map(number)));
            let bsdf = scene.bsdf_at(&hit, 0.0, 0.0);
            value["albedo"] = json!(color(bsdf.albedo()));
            value["lobes"] = json!(bsdf.lobes().map(Lobe::name).collect::<Vec<_>>());
            let texels = scene.texels_at(&hit).into_iter();
            let texels: Map<String, Value> = texels
                .map(|(key, texel)| (key.into(), texel.into_iter().map(number).collect()))
                .collect();
            if !texels.is_empty() {
                value["texels"] = Value::Object(texels);
            }
            value["mesh"] = json!(hit.geom.0);
            value["triangle"] = json!(hit.prim.0);
        }
    }
    let lists = [
        (
            "emission",
            vertex.emissions.iter().map(|e| emission(scene, e)).collect::<Vec<_>>(),
        ),
        (
            "light_samples",
            vertex.light_samples.iter().map(|s| light_sample(scene, s)).collect(),
        ),
        ("scattering", vertex.scatterings.iter().map(scattering).collect()),
        (
            "photons",
            vertex
                .photons
                .iter()
                .map(|(count, radius)| json!({ "count": count, "radius": number(*radius) }))
                .collect(),
        ),
    ];
    for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
        value[name] = json!(list);
    }
    value
}

fn emission(scene: &Scene, emission: &EmissionRecord) -> Value {
    json!({
        "light": light(scene, emission.light),
        "direction": vector(emission.direction),
        "scattering_pdf": number(emission.scattering_pdf),
        "light_pdf": number(emission.light_pdf),
        "mis_weight": number(emission.weight),
        "radiance": color(emission.radiance),
    })
}

fn light_sample(scene: &Scene, sample: &LightSampleRecord) -> Value {
    json!({
        "light": light(scene, sample.light),
        "direction": vector(sample.direction),
        "target": sample.target.map(vector),
        "probability": number(sample.pmf),
        "pdf": number(sample.pdf),
        "scattering_pdf": number(sample.scattering_pdf),
        "mis_weight": number(sample.weight),
        "f_cos": color(sample.f_cos),
        "radiance": color(sample.radiance),
        "transmittance": sample.transmittance.map(color),
    })
}

fn scattering(scattering: &ScatteringRecord) -> Value {
    json!({
        "direction": vector(scattering.direction),
        "lobe": scattering.lobe,
        "delta": scattering.is_delta,
        "pdf": number(scattering.pdf),
        "weight": color(scattering.weight),
        "eta": number(scattering.eta),
        "roulette": number(scattering.roulette),
    })
}

fn contribution(contribution: &Contribution) -> Value {
    let mut value = json!({
        "by": contribution.technique.name(),
        "radiance": color(contribution.radiance),
        "film": contribution.film.map(|film| [number(film.x), number(film.y)]),
        "vertex": contribution.vertex,
        "path": contribution.path,
    });
    match contribution.technique {
        Technique::Connection(s, t, weight, radiance) | Technique::Merging(s, t, weight, radiance) => {
            value["s"] = json!(s);
            value["t"] = json!(t);
            value["mis_weight"] = json!(number(weight));
            value["unweighted"] = json!(color(radiance));
        }
        Technique::Shared(owner, end) => {
            value["owner"] = json!(owner);
            value["end"] = json!(vector(end));
        }
        _ => {}
    }
    value
}
