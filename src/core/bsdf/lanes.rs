//! BSDFs of sixteen vertices at once, as arrays whose loops the compiler vectorises.
//!
//! Path reuse connects the first vertices of a group of pixels to vertices of the paths of all
//! pixels of the group. Each connection evaluates a BSDF at both of its vertices. The usual
//! materials of exporters have a diffuse base under a coat of GGX facets, or are metals. This
//! module evaluates these BSDFs for sixteen connections in one pass. A loop over lanes has no
//! branch and no call. Only the energy lookups run lane by lane. The loops are also compiled for
//! AVX2, but without FMA, so that all processors return the same bits. Other BSDFs and single
//! vertices are evaluated by [`super::BsdfView`]. Lanes and views return equal values up to
//! rounding.

// Loops use one index for all arrays, so that the compiler can vectorise them.
#![allow(clippy::needless_range_loop)]

use super::energy::{ConductorRows, ConductorTables, NODES};
use super::{Bsdf, CoatedLambert, Lambert, Lobe, RoughConductor};
use crate::color::Spectrum;
use crate::math::{LANES, Lane, Vec2, Vec3, Vec3Lanes};
use multiversion::multiversion;
use std::f32::consts::{FRAC_1_PI, PI};

/// Values of BSDFs, cosine excluded, and densities per solid angle, one for each lane.
#[derive(Clone, Copy, Debug)]
pub struct ValueLanes {
    /// Value of the BSDF, by channel.
    f: [Lane; 3],
    /// Density of `wi`.
    pdf: Lane,
}

/// BSDFs for directions `wo`, one for each lane: a diffuse base, rough facets, or both.
#[derive(Clone, Debug)]
pub struct BsdfLanes {
    wo: Vec3Lanes,
    base: BaseLanes,
    facets: FacetLanes,
    /// Probabilities of choosing the base, and of choosing the facets.
    p: [Lane; 2],
    /// Transmittance of the coat towards `wo`. `loss` is the energy loss of single reflections
    /// towards `wo`.
    passed: Lane,
    loss: Lane,
    /// [`super::ggx::Ggx::stretched`] of `wo`.
    stretched: Lane,
}

/// Diffuse bases, one for each lane.
#[derive(Clone, Debug)]
struct BaseLanes {
    /// Albedo divided by π and by the mean transmittance of the coat, by channel.
    f: [Lane; 3],
    /// Mean of the channels of the albedo.
    albedo: Lane,
    /// 1 if the base is below a coat, else 0.
    is_coated: Lane,
    /// Reflectance of the coat along the normal, and fraction of the energy loss that multiple
    /// reflections return.
    coat: [Lane; 2],
}

/// GGX facets with Schlick's reflectance, one surface for each lane.
#[derive(Clone, Debug)]
struct FacetLanes {
    alpha: [Lane; 2],
    /// Factor of single reflections. `f0` is the reflectance along the normal, and `several` the
    /// factor of multiple reflections.
    reflectance: [Lane; 3],
    f0: [Lane; 3],
    several: [Lane; 3],
    rows: [ConductorRows; LANES],
}

/// Energy of the facets towards one direction for each lane.
struct EnergyLanes {
    loss: Lane,
    grazing: Lane,
    loss_pdf: Lane,
}

/// Parts of a BSDF that [`BsdfLanes`] supports.
struct Parts<'a> {
    base: Option<Base<'a>>,
    /// Facets, and rows of the energy tables for their roughness.
    facets: Option<(&'a RoughConductor, ConductorRows)>,
}

enum Base<'a> {
    Bare(&'a Lambert),
    Coated(&'a CoatedLambert),
}

impl<'a> Parts<'a> {
    /// Parts of `bsdf`. `None` if `bsdf` has other parts, or two parts of one kind. `None` also if
    /// the base has a coat, and there are no facets with the roughness of this coat.
    fn of(bsdf: &'a Bsdf) -> Option<Self> {
        if matches!(bsdf, Bsdf::Layered(_)) {
            return None;
        }
        let mut parts = Self {
            base: None,
            facets: None,
        };
        for lobe in bsdf.lobes() {
            match lobe {
                Lobe::Lambert(lobe) if parts.base.is_none() => parts.base = Some(Base::Bare(lobe)),
                Lobe::CoatedLambert(lobe) if parts.base.is_none() => parts.base = Some(Base::Coated(lobe)),
                Lobe::RoughConductor(lobe) if parts.facets.is_none() && lobe.is_schlick() => {
                    let rows = ConductorRows::of(ConductorTables::new(lobe.roughness()));
                    parts.facets = Some((lobe, rows));
                }
                _ => return None,
            }
        }
        match (&parts.base, parts.facets) {
            (Some(Base::Coated(base)), Some((facets, _))) => (base.roughness() == facets.roughness()).then_some(parts),
            (Some(Base::Coated(_)), None) => None,
            _ => Some(parts),
        }
    }
}

impl ValueLanes {
    /// Value and density in a lane below [`LANES`].
    #[inline(always)]
    pub fn get(&self, lane: usize) -> (Spectrum, f32) {
        let [r, g, b] = &self.f;
        (Spectrum::rgb(r[lane], g[lane], b[lane]), self.pdf[lane])
    }
}

impl BsdfLanes {
    /// Lanes of black BSDFs.
    pub fn empty() -> Self {
        let facets = FacetLanes {
            alpha: [[1.0; LANES]; 2],
            reflectance: [[0.0; LANES]; 3],
            f0: [[0.0; LANES]; 3],
            several: [[0.0; LANES]; 3],
            rows: [ConductorRows::of(ConductorTables::new(1.0)); LANES],
        };
        Self {
            wo: Vec3Lanes::splat(Vec3::Z),
            base: BaseLanes {
                f: [[0.0; LANES]; 3],
                albedo: [0.0; LANES],
                is_coated: [0.0; LANES],
                coat: [[0.0; LANES]; 2],
            },
            facets,
            p: [[0.0; LANES]; 2],
            passed: [0.0; LANES],
            loss: [0.0; LANES],
            stretched: [1.0; LANES],
        }
    }

    /// Sets `bsdf` and the directions `wo` in all lanes. Returns false if lanes do not support
    /// `bsdf`.
    #[inline(never)]
    pub fn pack(&mut self, bsdf: &Bsdf, wo: &Vec3Lanes) -> bool {
        let Some(parts) = Parts::of(bsdf) else { return false };
        for lane in 0..LANES {
            self.set_parameters(lane, &parts);
        }
        self.wo = *wo;
        see(self);
        true
    }

    /// Sets the BSDF and the direction `wo` of each lane from an item `(lane, bsdf, wo)` of
    /// `bsdfs`. Returns true for each lane whose BSDF is supported.
    pub fn pack_each<'a>(&mut self, bsdfs: impl Iterator<Item = (usize, &'a Bsdf, Vec3)>) -> [bool; LANES] {
        let mut is_packed = [false; LANES];
        for (lane, bsdf, wo) in bsdfs {
            if let Some(parts) = Parts::of(bsdf) {
                self.set_parameters(lane, &parts);
                self.wo.set(lane, wo);
                is_packed[lane] = true;
            }
        }
        see(self);
        is_packed
    }

    #[inline(always)]
    fn set_parameters(&mut self, lane: usize, parts: &Parts) {
        let (albedo, passed, is_coated, coat) = match &parts.base {
            None => (Spectrum::ZERO, 1.0, 0.0, [0.0; 2]),
            Some(Base::Bare(lobe)) => (lobe.albedo, 1.0, 0.0, [0.0; 2]),
            Some(Base::Coated(lobe)) => lobe.lane_parameters(),
        };
        let f = (albedo * (FRAC_1_PI / passed)).to_array();
        for (lanes, f) in self.base.f.iter_mut().zip(f) {
            lanes[lane] = f;
        }
        self.base.albedo[lane] = albedo.mean();
        self.base.is_coated[lane] = is_coated;
        for (lanes, coat) in self.base.coat.iter_mut().zip(coat) {
            lanes[lane] = coat;
        }
        let (alpha, [reflectance, f0, several]) = match parts.facets {
            None => (Vec2::ONE, [[0.0; 3]; 3]),
            Some((facets, rows)) => {
                self.facets.rows[lane] = rows;
                facets.lane_parameters()
            }
        };
        for (lanes, alpha) in self.facets.alpha.iter_mut().zip(alpha.to_array()) {
            lanes[lane] = alpha;
        }
        for c in 0..3 {
            self.facets.reflectance[c][lane] = reflectance[c];
            self.facets.f0[c][lane] = f0[c];
            self.facets.several[c][lane] = several[c];
        }
    }

    /// Values and densities for light from `wi`, as [`super::BsdfView::eval_pdf`].
    pub fn eval_pdf(&self, wi: &Vec3Lanes) -> ValueLanes {
        eval_pdf(self, wi)
    }
}

/// Computes the terms that depend on `wo` only.
#[multiversion(targets("x86_64+avx2"))]
fn see(lanes: &mut BsdfLanes) {
    let energy = lanes.facets.energy(&lanes.wo.z);
    lanes.passed = lanes.base.passed(&energy);
    lanes.stretched = lanes.facets.stretched(&lanes.wo);
    let FacetLanes {
        reflectance,
        f0,
        several,
        ..
    } = &lanes.facets;
    let mut mean_loss = [0.0; LANES];
    for (mean, rows) in mean_loss.iter_mut().zip(&lanes.facets.rows) {
        *mean = rows.mean_loss;
    }
    for i in 0..LANES {
        let (loss, grazing) = (energy.loss[i], energy.grazing[i]);
        let of = |c: usize| {
            reflectance[c][i] * (f0[c][i] * (1.0 - loss - grazing) + grazing)
                + several[c][i] * (PI * mean_loss[i] * loss)
        };
        let base = lanes.base.albedo[i] * lanes.passed[i];
        let facets = (of(0) + of(1) + of(2)) * (1.0 / 3.0);
        let total = base + facets;
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        lanes.p[0][i] = base * scale;
        lanes.p[1][i] = facets * scale;
    }
    lanes.loss = energy.loss;
}

/// Implementation of [`BsdfLanes::eval_pdf`].
#[multiversion(targets("x86_64+avx2"))]
fn eval_pdf(lanes: &BsdfLanes, wi: &Vec3Lanes) -> ValueLanes {
    let energy = lanes.facets.energy(&wi.z);
    let passed = lanes.base.passed(&energy);
    let stretched = lanes.facets.stretched(wi);
    let (wo, base, facets) = (&lanes.wo, &lanes.base, &lanes.facets);
    let mut values = ValueLanes {
        f: [[0.0; LANES]; 3],
        pdf: [0.0; LANES],
    };
    for i in 0..LANES {
        let (zo, zi) = (wo.z[i].abs(), wi.z[i].abs());
        // Compute the half vector, and its cosine with both directions
        let (x, y, z) = (wo.x[i] + wi.x[i], wo.y[i] + wi.y[i], wo.z[i] + wi.z[i]);
        let inverse = 1.0 / (x * x + y * y + z * z).sqrt();
        let (x, y, z) = (x * inverse, y * inverse, z * inverse);
        let cos = wo.x[i] * x + wo.y[i] * y + wo.z[i] * z;
        // Compute D of the facets, and the value and density of single reflections
        let (ax, ay) = (facets.alpha[0][i], facets.alpha[1][i]);
        let area = ax * ay;
        let (hx, hy, hz) = (x * ay, y * ax, z * area);
        let t = hx * hx + hy * hy + hz * hz;
        let d = area * area * area / (PI * t * t);
        let reflection = 0.5 * d / (zi * lanes.stretched[i] + zo * stretched[i]);
        let single_pdf = 0.5 * d / (zo + lanes.stretched[i]);
        let away = 1.0 - cos;
        let away = if away > 0.0 { away } else { 0.0 };
        let grazing = away * away * (away * away) * away;
        // Add the values and densities of all lobes
        let is_reflected = wo.z[i] * wi.z[i] > 0.0;
        let several = lanes.loss[i] * energy.loss[i];
        let below = lanes.passed[i] * passed[i];
        for c in 0..3 {
            let f0 = facets.f0[c][i];
            let single = facets.reflectance[c][i] * (f0 + (1.0 - f0) * grazing) * reflection;
            let f = base.f[c][i] * below + single + facets.several[c][i] * several;
            values.f[c][i] = if is_reflected { f } else { 0.0 };
        }
        let facets_pdf = (1.0 - lanes.loss[i]) * single_pdf + lanes.loss[i] * energy.loss_pdf[i];
        let pdf = lanes.p[0][i] * zi * FRAC_1_PI + lanes.p[1][i] * facets_pdf;
        values.pdf[i] = if is_reflected { pdf } else { 0.0 };
    }
    values
}

impl BaseLanes {
    /// Transmittance of the coat towards the directions of `energy`.
    #[inline(always)]
    fn passed(&self, energy: &EnergyLanes) -> Lane {
        let mut passed = [0.0; LANES];
        for i in 0..LANES {
            let (f0, several) = (self.coat[0][i], self.coat[1][i]);
            let (loss, grazing) = (energy.loss[i], energy.grazing[i]);
            passed[i] = 1.0 - self.is_coated[i] * (f0 * (1.0 - loss - grazing) + grazing + several * loss);
        }
        passed
    }
}

impl FacetLanes {
    /// [`super::ggx::Ggx::stretched`] of the directions.
    #[inline(always)]
    fn stretched(&self, w: &Vec3Lanes) -> Lane {
        let mut stretched = [0.0; LANES];
        for i in 0..LANES {
            let (x, y, z) = (self.alpha[0][i] * w.x[i], self.alpha[1][i] * w.y[i], w.z[i]);
            stretched[i] = (x * x + y * y + z * z).sqrt();
        }
        stretched
    }

    /// Energy towards directions with the cosines `z`.
    #[inline(always)]
    fn energy(&self, z: &Lane) -> EnergyLanes {
        // Compute the positions of the cosines on the axis of nodes, in steps
        let mut place = [0.0; LANES];
        for i in 0..LANES {
            let root = z[i].abs().sqrt();
            place[i] = if root < 1.0 { root } else { 1.0 } * (NODES - 1) as f32;
        }
        // Read the values at the nodes before and after each position, interpolated between the
        // rows of lower and higher roughness
        let mut loss = [[0.0; LANES]; 2];
        let mut grazing = [[0.0; LANES]; 2];
        let mut cells = [0.0; LANES];
        let mut step = [0.0; LANES];
        for i in 0..LANES {
            let node = (place[i] as usize).min(NODES - 2);
            step[i] = place[i] - node as f32;
            let rows = &self.rows[i];
            [loss[0][i], loss[1][i]] = rows.loss(node);
            [grazing[0][i], grazing[1][i]] = rows.grazing(node);
            cells[i] = rows.loss_cell(node);
        }
        let mut energy = EnergyLanes {
            loss: [0.0; LANES],
            grazing: [0.0; LANES],
            loss_pdf: [0.0; LANES],
        };
        for i in 0..LANES {
            energy.loss[i] = loss[0][i] + step[i] * (loss[1][i] - loss[0][i]);
            energy.grazing[i] = grazing[0][i] + step[i] * (grazing[1][i] - grazing[0][i]);
            energy.loss_pdf[i] = z[i].abs() * FRAC_1_PI * cells[i];
        }
        energy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::BsdfView;
    use crate::material::{Gloss, Material};

    fn direction(i: usize) -> Vec3 {
        let (phi, z) = (2.4 * i as f32, 0.02 + 0.97 * ((0.618 * i as f32) % 1.0));
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }

    fn materials() -> [Material; 5] {
        let of = |metallic, roughness, anisotropy| Material {
            diffuse: Spectrum::rgb(0.7, 0.5, 0.2),
            specular: Spectrum::ONE,
            gloss: Gloss::Metallic(metallic),
            roughness,
            anisotropy,
            ..Material::default()
        };
        let matte = Material {
            diffuse: Spectrum::rgb(0.1, 0.5, 0.9),
            ..Material::default()
        };
        [
            of(0.0, 0.5, 0.0),
            of(1.0, 0.35, 0.0),
            of(0.4, 0.8, 0.0),
            of(1.0, 0.6, 0.7),
            matte,
        ]
    }

    fn assert_same(found: (Spectrum, f32), expected: (Spectrum, f32), what: &str) {
        let (f, pdf) = found;
        let near = |a: f32, b: f32| (a - b).abs() <= 2e-4 * b.abs() + 1e-6;
        let is_near = f.to_array().iter().zip(expected.0.to_array()).all(|(&a, b)| near(a, b)) && near(pdf, expected.1);
        assert!(
            is_near,
            "{what}: {} {pdf}, expected {} {}",
            f.mean(),
            expected.0.mean(),
            expected.1
        );
    }

    /// Lanes and views return the same values, for directions on both sides of the surface.
    #[test]
    fn lanes_match_views() {
        let bsdfs = materials().map(|material| material.bsdf());
        let mut lanes = BsdfLanes::empty();
        for round in 0..40 {
            let side = |i: usize| if (i + round) % 5 == 0 { -1.0 } else { 1.0 };
            let wo: Vec<Vec3> = (0..LANES).map(|i| direction(i + 16 * round)).collect();
            let mut wi = Vec3Lanes::splat(Vec3::Z);
            let towards = |i: usize| direction(7 * i + round) * Vec3::new(1.0, 1.0, side(i));
            (0..LANES).for_each(|i| wi.set(i, towards(i)));
            // Set a different BSDF in each lane
            let each = |i: usize| &bsdfs[(i + round) % bsdfs.len()];
            let is_packed = lanes.pack_each((0..LANES).map(|i| (i, each(i), wo[i])));
            assert_eq!(is_packed, [true; LANES]);
            let values = lanes.eval_pdf(&wi);
            for (i, &wo) in wo.iter().enumerate() {
                let expected = BsdfView::new(each(i), wo).eval_pdf(towards(i));
                assert_same(values.get(i), expected, &format!("lane {i}, round {round}"));
            }
            // Set a single BSDF in all lanes, after the lanes held other BSDFs
            let one = &bsdfs[round % bsdfs.len()];
            let mut views = Vec3Lanes::splat(Vec3::Z);
            (0..LANES).for_each(|i| views.set(i, wo[i]));
            assert!(lanes.pack(one, &views));
            let values = lanes.eval_pdf(&wi);
            for (i, &wo) in wo.iter().enumerate() {
                let expected = BsdfView::new(one, wo).eval_pdf(towards(i));
                assert_same(values.get(i), expected, &format!("one BSDF, lane {i}, round {round}"));
            }
        }
    }

    /// BSDFs with other lobes are not supported.
    #[test]
    fn other_lobes_are_not_supported() {
        let glass = Material {
            transmission: Spectrum::ONE,
            roughness: 0.5,
            ..Material::default()
        };
        let coated = Material {
            clearcoat: 1.0,
            ..materials()[0].clone()
        };
        let wo = Vec3Lanes::splat(Vec3::Z);
        for material in [glass, coated] {
            let bsdf = material.bsdf();
            assert!(!BsdfLanes::empty().pack(&bsdf, &wo));
        }
    }
}
