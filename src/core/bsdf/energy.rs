//! Multiple-scattering compensation of rough lobes.
//!
//! Microfacet models with single scattering lose the light that other facets block: 69 % at
//! roughness 1, along the normal. Rough lobes add the lost light in the reciprocal form of Kulla
//! and Conty (2017, "Revisiting Physically Based Shading at Imageworks"). A division by the albedo
//! would not be reciprocal. The form needs the energy loss towards each direction, and the
//! cosine-weighted mean of this loss.
//!
//! The loss and the mean are tabulated. They are computed by quadrature over the visible facets of
//! the lobes themselves. The axes are `√cos θ`, the roughness `√α` and, for dielectrics, `(η − 1) /
//! (η + 1)`. The values are nearly linear along these axes. A row for one roughness and index is
//! computed on first use, within 2 ms for a metal and 20 ms for glass. A fitted polynomial would be
//! faster, but it could not be checked against the lobe.
//!
//! Light of multiple scattering is sampled in proportion to its distribution. With cosine sampling
//! only, a sample at the horizon of a nearly smooth surface would weigh hundreds of times the mean.
//! For anisotropic facets, the tables for the geometric mean of `αx` and `αy` are used. The
//! remaining error is in docs/notebook/2026-11.md, "Energy of lobes".

use super::fresnel;
use super::ggx::Ggx;
use crate::math::{Vec2, Vec3, sin_cos_turns};
use std::array::from_fn;
use std::f32::consts::FRAC_1_PI;
use std::sync::OnceLock;

/// Number of nodes along roughness and along the cosine.
pub(super) const NODES: usize = 32;

/// Number of nodes along the index of refraction.
const INDEX_NODES: usize = 65;

/// Maximum index of refraction. Larger indices are clamped to this maximum, and small indices to
/// its inverse.
const LARGEST_ETA: f32 = 3.0;

/// Numbers of quadrature points over the visible facets. The first is for the azimuth. The second
/// is for the steps from facets that reflect light straight back to grazing facets.
const POINTS: [usize; 2] = [32, 48];

/// Tables of mirror facets, by roughness: the energy loss, and the albedo with each reflection
/// weighted by `(1 − cos)⁵`, where cos is the cosine between the direction and the normal of the
/// facet.
static MIRRORS: [OnceLock<[Row; 2]>; NODES] = [const { OnceLock::new() }; NODES];

/// Tables of refracting facets, by index and roughness: the energy loss, and the albedo of
/// reflection by single scattering.
static DIELECTRICS: [[OnceLock<[Row; 2]>; NODES]; INDEX_NODES] =
    [const { [const { OnceLock::new() }; NODES] }; INDEX_NODES];

/// Table of an energy (an energy loss or an albedo) by the cosine of the direction, for one
/// roughness. Values are interpolated between `N` rows of neighbouring nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnergyTable<const N: usize> {
    rows: [(&'static Row, f32); N],
}

/// Energy tables of rough conductors for a given roughness.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ConductorTables {
    /// Position of the roughness on the axis of nodes, in steps between nodes.
    place: f32,
}

/// Energy loss and albedo of a rough conductor towards one direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ConductorEnergy {
    /// Energy loss of single reflections.
    pub loss: f32,
    /// Cosine-weighted mean of `loss` over all directions.
    pub mean_loss: f32,
    /// Density per solid angle with which [`EnergyTable::sample`] samples this direction from the
    /// table of losses.
    pub loss_pdf: f32,
    /// Albedo of single reflections, each weighted by Schlick's `(1 − cos)⁵`, where cos is the
    /// cosine between the direction and the normal of the facet.
    pub grazing: f32,
}

impl ConductorTables {
    /// Tables for the roughness `√α`.
    #[inline(always)]
    pub fn new(roughness: f32) -> Self {
        Self {
            place: place(roughness, NODES),
        }
    }

    /// Tables of the energy loss of single reflections, and of [`ConductorEnergy::grazing`].
    pub fn loss_and_grazing(&self) -> [EnergyTable<2>; 2] {
        let (node, t) = cell(self.place, NODES);
        let (lower, upper) = (mirror_rows(node), mirror_rows(node + 1));
        [0, 1].map(|kind| EnergyTable {
            rows: [(&lower[kind], 1.0 - t), (&upper[kind], t)],
        })
    }

    /// Energy loss of single reflections.
    pub fn loss(&self) -> EnergyTable<2> {
        let [loss, _] = self.loss_and_grazing();
        loss
    }

    /// Energy towards a direction with the cosine `cos`.
    #[inline(always)]
    pub fn towards(&self, cos: f32) -> ConductorEnergy {
        let rows = ConductorRows::of(*self);
        let (node, step) = cell(place(cos.sqrt(), NODES), NODES);
        let between = |[lower, upper]: [f32; 2]| lower + step * (upper - lower);
        ConductorEnergy {
            loss: between(rows.loss(node)),
            mean_loss: rows.mean_loss,
            loss_pdf: cos * FRAC_1_PI * rows.loss_cell(node),
            grazing: between(rows.grazing(node)),
        }
    }
}

/// Rows of [`ConductorTables`] for a given roughness. They are found once and used for many
/// lookups.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConductorRows {
    lower: &'static [Row; 2],
    upper: &'static [Row; 2],
    /// Weight of the row `upper`. The row `lower` has the weight 1 − `t`.
    t: f32,
    /// Cosine-weighted mean of the energy loss of single reflections.
    pub mean_loss: f32,
}

impl ConductorRows {
    /// Rows of `tables`.
    #[inline(always)]
    pub fn of(tables: ConductorTables) -> Self {
        let (node, t) = cell(tables.place, NODES);
        let (lower, upper) = (mirror_rows(node), mirror_rows(node + 1));
        Self {
            lower,
            upper,
            t,
            mean_loss: (1.0 - t) * lower[0].mean + t * upper[0].mean,
        }
    }

    /// Energy loss of single reflections at the cosine nodes `node` and `node + 1`.
    #[inline(always)]
    pub fn loss(&self, node: usize) -> [f32; 2] {
        self.at(0, node)
    }

    /// Albedo of single reflections, each weighted by Schlick's `(1 − cos)⁵`, at the cosine nodes
    /// `node` and `node + 1`.
    #[inline(always)]
    pub fn grazing(&self, node: usize) -> [f32; 2] {
        self.at(1, node)
    }

    /// Mean of the loss between the cosine nodes `node` and `node + 1`, relative to the mean over
    /// all cosines.
    #[inline(always)]
    pub fn loss_cell(&self, node: usize) -> f32 {
        self.blend(self.lower[0].cells[node], self.upper[0].cells[node]) / self.mean_loss
    }

    #[inline(always)]
    fn at(&self, kind: usize, node: usize) -> [f32; 2] {
        let (lower, upper) = (&self.lower[kind].nodes, &self.upper[kind].nodes);
        [
            self.blend(lower[node], upper[node]),
            self.blend(lower[node + 1], upper[node + 1]),
        ]
    }

    #[inline(always)]
    fn blend(&self, lower: f32, upper: f32) -> f32 {
        lower + self.t * (upper - lower)
    }
}

/// Terms of a lobe that depend on one direction only, `wo` or `wi`; zero for lobes without these
/// terms.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DirectionTerms {
    /// Rough lobes: energy loss of single scattering towards the direction. Coated lobes:
    /// transmittance of the coat.
    pub share: f32,
    /// Rough lobes: density of sampling the direction for multiple scattering.
    pub several_pdf: f32,
    /// Rough conductors: energy of the facets towards the direction.
    pub energy: ConductorEnergy,
    /// Rough conductors: [`Ggx::stretched`] of the direction.
    pub stretched: f32,
}

/// Lookup of the energy of rough conductors towards one direction. The last result is cached,
/// because a coat and the base below the coat need the same energy.
#[derive(Debug)]
pub(super) struct EnergyLookup {
    cos: f32,
    last: Option<(ConductorTables, ConductorEnergy)>,
}

impl EnergyLookup {
    /// Lookup towards the unit direction `w`.
    #[inline(always)]
    pub fn new(w: Vec3) -> Self {
        Self {
            cos: w.z.abs(),
            last: None,
        }
    }

    /// Energy loss and albedo for the roughness `√α`.
    #[inline(always)]
    pub fn of(&mut self, roughness: f32) -> ConductorEnergy {
        let tables = ConductorTables::new(roughness);
        match self.last {
            Some((last, energy)) if last.place == tables.place => energy,
            _ => {
                let energy = tables.towards(self.cos);
                self.last = Some((tables, energy));
                energy
            }
        }
    }
}

/// Energy loss of single scattering by a rough dielectric. `eta` is the index beyond the surface,
/// relative to the side of the incident light.
pub(super) fn dielectric_loss(roughness: f32, eta: f32) -> EnergyTable<4> {
    dielectric_table(roughness, eta, 0)
}

/// Fraction of uniform light that a rough dielectric reflects by single scattering. `eta` is the
/// index as in [`dielectric_loss`].
pub(super) fn dielectric_reflected(roughness: f32, eta: f32) -> EnergyTable<4> {
    dielectric_table(roughness, eta, 1)
}

fn dielectric_table(roughness: f32, eta: f32, kind: usize) -> EnergyTable<4> {
    let (node, t) = cell(place(roughness, NODES), NODES);
    let x = 0.5 + 0.5 * index_coordinate(eta) / index_coordinate(LARGEST_ETA);
    let (index, s) = cell(place(x, INDEX_NODES), INDEX_NODES);
    EnergyTable {
        rows: [
            (&dielectric_rows(index, node)[kind], (1.0 - s) * (1.0 - t)),
            (&dielectric_rows(index, node + 1)[kind], (1.0 - s) * t),
            (&dielectric_rows(index + 1, node)[kind], s * (1.0 - t)),
            (&dielectric_rows(index + 1, node + 1)[kind], s * t),
        ],
    }
}

impl<const N: usize> EnergyTable<N> {
    /// Energy towards a direction with the cosine `cos`.
    #[inline(always)]
    pub fn towards(&self, cos: f32) -> f32 {
        self.blend(|row| row.at(cos))
    }

    /// Cosine-weighted mean of the energy `x` over all directions, `2 ∫ x cos d cos`.
    #[inline(always)]
    pub fn mean(&self) -> f32 {
        self.blend(|row| row.mean)
    }

    /// Samples a direction on the upper hemisphere, nearly in proportion to the energy times the
    /// cosine. The density is [`EnergyTable::pdf`].
    pub fn sample(&self, u: Vec2) -> Vec3 {
        // Find the cell that contains `u.x`, and the squared cosine at the position of `u.x` in the
        // cell
        let mut rest = u.x * self.mean();
        let mut cos2 = 1.0;
        for cell in 0..NODES - 1 {
            let [lower, upper] = [cell, cell + 1].map(|node| fourth_power(coordinate(node, NODES)));
            let mean = self.blend(|row| row.cells[cell]);
            let share = mean * (upper - lower);
            if rest < share {
                cos2 = lower + rest / mean;
                break;
            }
            rest -= share;
        }
        let r = (1.0 - cos2).max(0.0).sqrt();
        let (sin, cos) = sin_cos_turns(u.y);
        Vec3::new(r * cos, r * sin, cos2.sqrt())
    }

    /// Density of [`EnergyTable::sample`] per solid angle: the cosine density times the mean energy
    /// of the cell, divided by the mean energy of all cells.
    #[inline(always)]
    pub fn pdf(&self, cos: f32) -> f32 {
        let (cell, _) = cell(place(cos.sqrt(), NODES), NODES);
        cos * FRAC_1_PI * self.blend(|row| row.cells[cell]) / self.mean()
    }

    #[inline(always)]
    fn blend(&self, value: impl Fn(&Row) -> f32) -> f32 {
        self.rows.iter().map(|&(row, weight)| weight * value(row)).sum()
    }
}

/// Returns the energy of multiple reflections, as a fraction of the energy loss of single
/// reflections. Facets with mean reflectance `f` return `f² Ē (1 + f (1 − Ē) + …)`, where `1 − Ē`
/// is the mean loss `mean_missing`.
pub(super) fn several_reflections(f: f32, mean_missing: f32) -> f32 {
    f * f * (1.0 - mean_missing) / (1.0 - f * mean_missing)
}

fn mirror_rows(node: usize) -> &'static [Row; 2] {
    MIRRORS[node].get_or_init(|| {
        let rows = along_cosines(coordinate(node, NODES), |wo, facets, h, cos| {
            let weight = reflected(wo, facets, h, cos);
            [weight, weight * (1.0 - cos).powi(5)]
        });
        let [all, grazing] = [0, 1].map(|k| rows.map(|shares| shares[k]));
        [Row::new(all.map(missing)), Row::new(grazing.map(|x| x as f32))]
    })
}

fn dielectric_rows(index: usize, node: usize) -> &'static [Row; 2] {
    DIELECTRICS[index][node].get_or_init(|| {
        let x = (2.0 * coordinate(index, INDEX_NODES) - 1.0) * index_coordinate(LARGEST_ETA);
        let eta = (1.0 + x) / (1.0 - x);
        let rows = along_cosines(coordinate(node, NODES), |wo, facets, h, cos| {
            let (r, cos_t) = fresnel::dielectric(cos, eta);
            let wi = fresnel::refract(wo, h, cos, cos_t, eta);
            let passed = if wi.z < 0.0 { facets.visible(wi) } else { 0.0 };
            let reflected = r * reflected(wo, facets, h, cos);
            [reflected + (1.0 - r) * passed, reflected]
        });
        [
            Row::new(rows.map(|[share, _]| missing(share))),
            Row::new(rows.map(|[_, reflected]| reflected as f32)),
        ]
    })
}

/// Values of a quantity by cosine, for one roughness.
#[derive(Debug)]
pub(super) struct Row {
    nodes: [f32; NODES],
    /// Cosine-weighted means of the quantity between neighbouring nodes.
    cells: [f32; NODES - 1],
    /// Cosine-weighted mean over all directions.
    pub mean: f32,
}

impl Row {
    /// Row of the quantity that `value` returns for a cosine.
    pub fn of(value: impl Fn(f32) -> f32) -> Self {
        Self::new(from_fn(|node| value(coordinate(node, NODES).powi(2))))
    }

    fn new(nodes: [f32; NODES]) -> Self {
        let mut mean = 0.0;
        let cells = from_fn(|cell| {
            // Integrate 4 x s³ over s = √cos. The values x are linear in s, so Gauss-Legendre
            // quadrature with three points is exact.
            let half = 0.5 * 0.6f32.sqrt();
            let points = [(0.5 - half, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + half, 5.0 / 18.0)];
            let [lower, upper] = [cell, cell + 1].map(|node| coordinate(node, NODES));
            let sum = points.iter().fold(0.0, |sum, (t, weight)| {
                let s = lower + t * (upper - lower);
                sum + weight * (nodes[cell] + t * (nodes[cell + 1] - nodes[cell])) * 4.0 * (s * s * s)
            });
            mean += sum * (upper - lower);
            sum * (upper - lower) / (fourth_power(upper) - fourth_power(lower))
        });
        Self { nodes, cells, mean }
    }

    /// Interpolated value of the quantity at the cosine `cos`.
    #[inline(always)]
    pub fn at(&self, cos: f32) -> f32 {
        let (node, t) = cell(place(cos.sqrt(), NODES), NODES);
        (1.0 - t) * self.nodes[node] + t * self.nodes[node + 1]
    }
}

/// Coordinate of the `i`-th of `n` nodes in [0, 1].
pub(super) fn coordinate(i: usize, n: usize) -> f32 {
    i as f32 / (n - 1) as f32
}

// Do not use `powi`, because builds may multiply in different orders, which changes bits.
fn fourth_power(x: f32) -> f32 {
    x * x * (x * x)
}

/// Position of `x`, clamped to [0, 1], on an axis of `n` nodes, in steps.
#[inline(always)]
pub(super) fn place(x: f32, n: usize) -> f32 {
    // Unlike `clamp`, this expression maps NaN to 0.
    if x > 0.0 { x.min(1.0) * (n - 1) as f32 } else { 0.0 }
}

/// Returns the node before the position `place`, at most `n - 2`, and the offset of `place` from
/// this node in steps.
#[inline(always)]
pub(super) fn cell(place: f32, n: usize) -> (usize, f32) {
    let node = (place as usize).min(n - 2);
    (node, place - node as f32)
}

fn index_coordinate(eta: f32) -> f32 {
    (eta - 1.0) / (eta + 1.0)
}

/// Energy loss `1 - share`, at least the rounding error of 1, because lobes divide by the loss.
fn missing(share: f64) -> f32 {
    ((1.0 - share) as f32).max(f32::EPSILON)
}

/// Fraction of the light reflected by the facet `h` that is not shadowed; 0 below the horizon.
fn reflected(wo: Vec3, facets: Ggx, h: Vec3, cos: f32) -> f32 {
    let wi = 2.0 * cos * h - wo;
    if wi.z > 0.0 {
        facets.reflection_weight(wo, wi)
    } else {
        0.0
    }
}

/// Means of `value` over the facets visible from a direction, for each node of the cosine. `value`
/// gets the direction, the facets, the normal of a facet, and the cosine of this normal with the
/// direction.
///
/// Half of the azimuths is enough, because the other half is symmetric. Steps are short near
/// grazing facets. Only these facets lose light, and smooth surfaces have few of them.
fn along_cosines<const K: usize>(
    roughness: f32,
    value: impl Fn(Vec3, Ggx, Vec3, f32) -> [f32; K],
) -> [[f64; K]; NODES] {
    let facets = Ggx::new(Vec2::splat(roughness * roughness));
    let middle = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
    from_fn(|node| {
        let cos = coordinate(node, NODES).powi(2);
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let (mut sums, mut total) = ([0.0; K], 0.0);
        for j in 0..POINTS[1] {
            let step = middle(j, POINTS[1]);
            for i in 0..POINTS[0] {
                let u = Vec2::new(0.5 * middle(i, POINTS[0]), 1.0 - step * step);
                let h = facets.sample_visible(wo, u);
                let values = value(wo, facets, h, wo.dot(h).max(0.0));
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += (step * value) as f64;
                }
                total += step as f64;
            }
        }
        sums.map(|sum| sum / total)
    })
}

#[cfg(test)]
mod tests;
