//! Albedos and previews of materials, for `embrasure explain`.
//!
//! Albedos are integrals over the samples of each lobe, weighted by flux. If textures vary a
//! material, its albedos are computed from its constant values.

use crate::bsdf::{Bsdf, Lobe, TransportMode};
use crate::camera::CameraParameters;
use crate::color::Spectrum;
use crate::geometry::Mesh;
use crate::material::Material;
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::cosine_hemisphere;
use crate::scene::{BuildError, Scene, SceneBuilder};
use crate::texture::{Texture, TextureId};
use std::array;
use std::f32::consts::{PI, TAU};

/// Number of sample points of an albedo integral. With this number, albedos have three correct
/// digits.
const POINTS: u32 = 1 << 14;
/// Columns and rows of the mesh of the sphere.
const GRID: [usize; 2] = [256, 128];

/// Albedo and probability of a lobe of a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct LobeAlbedo {
    /// The lobe.
    pub lobe: Lobe,
    /// Fraction of the flux that the lobe scatters: to a viewer along the normal, to a viewer at
    /// 60° to the normal, and in all directions for uniform light. The layers above the lobe absorb
    /// a part, which is subtracted, so the albedos of all lobes add up to [`directional_albedo`].
    pub albedo: [Spectrum; 3],
    /// Probability that the lobe is sampled: for a viewer along the normal, and for a viewer at 60°
    /// to the normal.
    pub probability: [f32; 2],
}

/// Albedos of all lobes of a BSDF for light on the front.
pub fn albedos(bsdf: &Bsdf) -> Vec<LobeAlbedo> {
    let views = [Vec3::Z, Vec3::new(0.75f32.sqrt(), 0.0, 0.5)];
    let probabilities = views.map(|wo| bsdf.lobe_probabilities(wo));
    let lobe = |(i, (place, lobe)): (usize, (usize, &Lobe))| {
        let scattered = |wo, u| scattered(bsdf, (place, lobe), wo, u);
        LobeAlbedo {
            lobe: *lobe,
            albedo: [
                integrate(|u| scattered(views[0], u)),
                integrate(|u| scattered(views[1], u)),
                integrate(|u| scattered(cosine_hemisphere(Vec2::new(u[3], u[4])), u)),
            ],
            probability: probabilities.each_ref().map(|p| p.get(i).copied().unwrap_or(0.0)),
        }
    };
    bsdf.places().enumerate().map(lobe).collect()
}

/// Directional albedo of `bsdf`, including its layers: the fraction of the flux from `wo` that is
/// scattered into any direction.
pub fn directional_albedo(bsdf: &Bsdf, wo: Vec3) -> Spectrum {
    integrate(|[u_lobe, u, v, ..]| {
        // `Importance` samples carry flux; refraction would scale radiance.
        let sample = bsdf.sample(wo, u_lobe, Vec2::new(u, v), TransportMode::Importance);
        sample.map_or(Spectrum::ZERO, |sample| sample.weight)
    })
}

/// One sample of the directional albedo of `lobe` for the direction `wo`: the fraction of the flux
/// from `wo` that the lobe scatters. The part that the layers of `bsdf` above the lobe absorb is
/// subtracted. `place` is the index of the lobe among the lobes of `bsdf`.
fn scattered(bsdf: &Bsdf, (place, lobe): (usize, &Lobe), wo: Vec3, [u_lobe, u, v, ..]: [f32; 5]) -> Spectrum {
    // `Importance` samples carry flux; refraction would scale radiance.
    let mode = TransportMode::Importance;
    if lobe.is_delta() {
        let directions = lobe.directions(wo, mode).into_iter().flatten();
        let directions = directions.map(|sample| bsdf.below_layers(place, lobe, wo, sample));
        return directions.fold(Spectrum::ZERO, |sum, s| sum + s.weight * s.pdf);
    }
    let sample = lobe.sample(wo, u_lobe, Vec2::new(u, v), mode);
    sample.map_or(Spectrum::ZERO, |s| bsdf.below_layers(place, lobe, wo, s).weight)
}

/// Mean of `f` over the unit cube of five dimensions. The points are an additive recurrence
/// (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences"): the steps are powers
/// of 1 / x, where x is the positive solution of x⁶ = x + 1.
fn integrate(f: impl Fn([f32; 5]) -> Spectrum) -> Spectrum {
    const ROOT: f64 = 1.134_724_138_401_519_4;
    let point = |i: u32| array::from_fn(|k| (0.5 + i as f64 * ROOT.powi(-1 - k as i32)).fract() as f32);
    let sum = (0..POINTS).fold([0.0; 3], |sum: [f64; 3], i| {
        let value = f(point(i)).to_array();
        array::from_fn(|c| sum[c] + value[c] as f64)
    });
    Spectrum::from(sum.map(|s| (s / POINTS as f64) as f32))
}

/// A sphere of the material, with texture coordinates, on a neutral floor below a lamp and a dim
/// sky. `textures` are the textures that the material's maps use.
pub fn preview_scene(
    mut builder: SceneBuilder,
    material: &Material,
    textures: &[Texture],
) -> Result<Scene, BuildError> {
    let subject = builder.add_material(material.clone())?;
    let matte = |diffuse, emission| Material {
        diffuse: Spectrum::splat(diffuse),
        emission: Spectrum::splat(emission),
        ..Material::default()
    };
    let floor = builder.add_material(matte(0.5, 0.0))?;
    let lamp = builder.add_material(matte(0.0, 15.0))?;
    builder.add_mesh(sphere(), subject)?;
    builder.add_mesh(
        rectangle(Vec3::new(0.0, -1.01, 0.0), 20.0 * Vec3::Z, 20.0 * Vec3::X),
        floor,
    )?;
    builder.add_mesh(rectangle(Vec3::new(-2.0, 4.0, 1.0), Vec3::X, Vec3::Z), lamp)?;
    builder.add_constant_light(Spectrum::splat(0.4))?;
    let ids: Vec<Option<TextureId>> = (0..textures.len() as u32).map(|i| Some(TextureId(i))).collect();
    builder.set_textures(textures.to_vec(), &ids);
    builder.build().map(|(scene, _)| scene)
}

/// Camera of the preview, which faces the sphere.
pub const PREVIEW_CAMERA: CameraParameters = CameraParameters {
    position: Vec3::new(0.0, 1.2, 5.0),
    look_at: Vec3::new(0.0, -0.1, 0.0),
    up: Vec3::Y,
    vertical_fov: 33.0,
    lens_radius: 0.0,
    focus_distance: 5.0,
};

/// The unit sphere as a mesh of longitude and latitude. The texture coordinate u goes around +y,
/// and v from the lowest to the highest point.
fn sphere() -> Mesh {
    let [columns, rows] = GRID;
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let uv = Vec2::new(column as f32 / columns as f32, row as f32 / rows as f32);
            let ((sin_phi, cos_phi), (sin, cos)) = ((TAU * uv.x).sin_cos(), (PI * uv.y).sin_cos());
            let n = Vec3::new(sin * sin_phi, -cos, sin * cos_phi);
            mesh.positions.push(n);
            mesh.normals.push(n.normalize_or(Vec3::Y));
            mesh.uvs.push(uv);
        }
    }
    let index = |column: usize, row: usize| (row * (columns + 1) + column) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [index(column, row), index(column + 1, row)];
            let [d, c] = [index(column, row + 1), index(column + 1, row + 1)];
            // At the poles, one of the two triangles has no area.
            if row > 0 {
                mesh.triangles.push([a, b, c]);
            }
            if row + 1 < rows {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    mesh
}

/// The rectangle `center` ± `u` ± `v`, with its front along `u` × `v`.
fn rectangle(center: Vec3, u: Vec3, v: Vec3) -> Mesh {
    Mesh {
        positions: vec![center - u - v, center + u - v, center + u + v, center - u + v],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{Dielectric, Lambert};
    use crate::geometry::PrimId;

    #[test]
    fn albedos_equal_closed_forms() {
        let close = |got: Spectrum, expected: f32| {
            let error = got.to_array().map(|v| (v - expected).abs());
            assert!(error.iter().all(|e| *e < 2e-3), "{got:?} for {expected}");
        };
        let matte = albedos(&Bsdf::Single(Lobe::Lambert(Lambert {
            albedo: Spectrum::splat(0.3),
        })));
        assert_eq!((matte.len(), matte[0].probability), (1, [1.0; 2]));
        matte[0].albedo.iter().for_each(|albedo| close(*albedo, 0.3));
        // Smooth glass absorbs no light, at any angle.
        let glass = albedos(&Bsdf::Single(Lobe::Dielectric(Dielectric {
            reflectance: Spectrum::ONE,
            transmittance: Spectrum::ONE,
            ior: 1.5,
        })));
        glass[0].albedo.iter().for_each(|albedo| close(*albedo, 1.0));
    }

    #[test]
    fn probabilities_sum_to_one() {
        let plastic = Material::metallic_roughness(Spectrum::rgb(0.6, 0.3, 0.2), 0.2, 0.4);
        let lobes = albedos(&plastic.bsdf());
        assert_eq!(lobes.len(), 2);
        for view in 0..2 {
            let sum: f32 = lobes.iter().map(|l| l.probability[view]).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{lobes:?}");
        }
        let total = lobes.iter().fold(Spectrum::ZERO, |sum, l| sum + l.albedo[2]);
        assert!(total.max_component() < 1.0 && total.max_component() > 0.3, "{total:?}");
    }

    #[test]
    fn the_sphere_looks_outwards() {
        let sphere = sphere();
        let prims = (0..sphere.triangles.len() as u32).map(PrimId);
        for prim in prims {
            let [a, b, c] = sphere.corners(prim);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{prim:?}");
        }
    }
}
