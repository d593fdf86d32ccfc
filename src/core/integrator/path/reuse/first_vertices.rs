//! First vertices of the paths of a group, and their connections to one end (the shared second
//! vertex of a path).

// Each loop indexes several arrays with the same index, so that the compiler vectorises it
#![allow(clippy::needless_range_loop)]

use super::end::End;
use crate::bsdf::{Bsdf, BsdfLanes, Lobe};
use crate::color::Spectrum;
use crate::geometry::{Side, offset_to, segment};
use crate::integrator::SAMPLES_AT_ONCE;
use crate::integrator::path::state::PathState;
use crate::integrator::path::strategy::Directions;
use crate::integrator::vertex::Vertex;
use crate::math::{LANES, Lane, Ray, Vec3, Vec3Lanes};
use std::f32::consts::FRAC_1_PI;

// Each sample of a group has one lane
const _: () = assert!(LANES == SAMPLES_AT_ONCE);

/// First vertex of a pixel's path. It is connected to the ends of all paths of the group.
pub(super) struct FirstVertex<'v> {
    pub vertex: Vertex<'v>,
    /// Throughput from the camera to the vertex, through mirrors and smooth glass.
    pub beta: Spectrum,
    /// Number of scattering events before the vertex.
    pub depth: u32,
}

impl<'v> FirstVertex<'v> {
    /// First vertex `vertex`, found by `path`.
    pub fn new(vertex: Vertex<'v>, path: &PathState) -> Self {
        Self {
            vertex,
            beta: path.beta,
            depth: path.depth,
        }
    }
}

/// First vertices of a group, stored in lanes for SIMD.
pub(super) struct FirstVertices<'f, 'v> {
    vertices: &'f [Option<FirstVertex<'v>>; SAMPLES_AT_ONCE],
    pub directions: Directions,
    p: Vec3Lanes,
    /// Shading normals.
    ns: Vec3Lanes,
    /// Unit geometric normals.
    ng: Vec3Lanes,
    /// Cosine of the direction to the viewer with the shading normal.
    wo_z: Lane,
    /// Origins of rays that leave on the front side, and of rays that leave on the back side.
    starts: [[Vec3; LANES]; 2],
    /// For matte vertices: throughput × BSDF by channel, and the density of a direction divided by
    /// the cosine of the direction. Both are 0 in lanes without a matte vertex.
    beta_f: [Lane; 3],
    pdf_over_cos: Lane,
    /// True for vertices that are not matte. They are evaluated separately.
    others: [bool; LANES],
    /// BSDFs of vertices that are not matte, and `true` for each lane whose BSDF is packed. The
    /// BSDFs are boxed because they are large, and matte scenes have none.
    bsdfs: Option<Box<BsdfLanes>>,
    is_packed: [bool; LANES],
}

/// Connections of first vertices to an end, stored in lanes.
pub(super) struct Connections {
    /// Unit directions from the first vertices to the end, world frame.
    pub w: Vec3Lanes,
    /// Cosines between the directions `w` and the shading normals.
    cos: Lane,
    /// Geometry term without visibility and without the cosine at the first vertex. It is 0 or
    /// negative if the vertex sees the back of the end, or if the end lies below the horizon of a
    /// normal of the vertex.
    geometry: Lane,
    /// Throughput from the end to the camera, per area at the end, by channel.
    beta: [Lane; 3],
    /// Density per area with which the first vertex finds the end; 0 if the vertex cannot find the
    /// end.
    pdf: Lane,
}

impl<'f, 'v> FirstVertices<'f, 'v> {
    /// First vertices `vertices` of a group. The paths of the group sample directions by
    /// `directions`.
    #[inline(always)]
    pub fn new(vertices: &'f [Option<FirstVertex<'v>>; SAMPLES_AT_ONCE], directions: Directions) -> Self {
        let mut first_vertices = Self {
            vertices,
            directions,
            p: Vec3Lanes::ZERO,
            ns: Vec3Lanes::splat(Vec3::Z),
            ng: Vec3Lanes::splat(Vec3::Z),
            wo_z: [0.0; LANES],
            starts: [[Vec3::ZERO; LANES]; 2],
            beta_f: [[0.0; LANES]; 3],
            pdf_over_cos: [0.0; LANES],
            others: [false; LANES],
            bsdfs: None,
            is_packed: [false; LANES],
        };
        for (i, first) in vertices.iter().enumerate() {
            let Some(FirstVertex { vertex, beta, .. }) = first else {
                continue;
            };
            first_vertices.p.set(i, vertex.point.p);
            first_vertices.ns.set(i, vertex.frame.normal());
            first_vertices.ng.set(i, vertex.point.ng);
            first_vertices.wo_z[i] = vertex.wo.z;
            first_vertices.starts[0][i] = offset_to(&vertex.point, Side::Front);
            first_vertices.starts[1][i] = offset_to(&vertex.point, Side::Back);
            match vertex.bsdf {
                Bsdf::Single(Lobe::Lambert(lobe)) if directions == Directions::Bsdf => {
                    if !lobe.albedo.is_black() {
                        set(&mut first_vertices.beta_f, i, *beta * (lobe.albedo * FRAC_1_PI));
                        first_vertices.pdf_over_cos[i] = FRAC_1_PI;
                    }
                }
                _ => first_vertices.others[i] = true,
            }
        }
        if first_vertices.others.contains(&true) {
            first_vertices.pack_bsdfs();
        }
        first_vertices
    }

    /// Packs the BSDFs of vertices that are not matte into lanes, if lanes support these BSDFs.
    #[inline(never)]
    fn pack_bsdfs(&mut self) {
        let vertices = self.vertices.iter().enumerate();
        let vertices = vertices.filter_map(|(i, first)| Some((i, &first.as_ref()?.vertex)));
        let mut of_lobes = vertices
            .filter(|(_, vertex)| Vertex::needs_view(vertex.bsdf))
            .peekable();
        if self.directions == Directions::Bsdf && of_lobes.peek().is_some() {
            let bsdfs = of_lobes.map(|(i, vertex)| (i, vertex.bsdf, vertex.wo));
            let lanes = self.bsdfs.insert(Box::new(BsdfLanes::empty()));
            self.is_packed = lanes.pack_each(bsdfs);
        }
    }

    /// First vertex of the path `i`, if the path has one.
    pub fn get(&self, i: usize) -> Option<&'f FirstVertex<'v>> {
        self.vertices[i].as_ref()
    }

    /// Computes the connections of all first vertices to `end`.
    #[inline(always)]
    pub fn connect_to(&self, end: &End, connections: &mut Connections) {
        // Compute directions, cosines and geometry terms
        let mut w = self.p.to(end.p);
        let squared = w.dot(&w);
        let mut inverse = [0.0; LANES];
        for i in 0..LANES {
            inverse[i] = 1.0 / squared[i].sqrt();
        }
        w.scale(&inverse);
        let cos = w.dot(&self.ns);
        let cos_facet = w.dot(&self.ng);
        let cos_end = w.dot(&Vec3Lanes::splat(end.n));
        let mut geometry = [0.0; LANES];
        for i in 0..LANES {
            let g = -cos_end[i] / squared[i];
            geometry[i] = if cos[i] * cos_facet[i] > 0.0 { g } else { 0.0 };
        }
        // Compute densities of matte vertices
        let mut pdf = [0.0; LANES];
        for i in 0..LANES {
            let density = cos[i].abs() * self.pdf_over_cos[i] * geometry[i];
            pdf[i] = if self.wo_z[i] * cos[i] > 0.0 { density } else { 0.0 };
        }
        (connections.w, connections.cos, connections.geometry, connections.pdf) = (w, cos, geometry, pdf);
        if self.others.contains(&true) {
            let beta_f = self.eval_others(connections);
            connections.finish(&beta_f);
        } else {
            connections.finish(&self.beta_f)
        }
    }

    /// Sets the densities of connections from vertices that are not matte. Returns throughput ×
    /// BSDF of all vertices.
    #[inline(never)]
    fn eval_others(&self, connections: &mut Connections) -> [Lane; 3] {
        let packed = self.bsdfs.as_ref().filter(|_| self.is_packed.contains(&true));
        let values = packed.map(|packed| {
            let mut lanes = Vec3Lanes::splat(Vec3::Z);
            for (i, first) in self.vertices.iter().enumerate().filter(|(i, _)| self.is_packed[*i]) {
                if let Some(first) = first {
                    lanes.set(i, first.vertex.frame.to_local(connections.w.get(i)));
                }
            }
            packed.eval_pdf(&lanes)
        });
        let mut beta_f = self.beta_f;
        for i in 0..LANES {
            let first = self.vertices[i].as_ref();
            let Some(FirstVertex { vertex, beta, .. }) =
                first.filter(|_| self.others[i] && connections.geometry[i] > 0.0)
            else {
                continue;
            };
            let (f, pdf) = match &values {
                Some(values) if self.is_packed[i] => values.get(i),
                _ => {
                    let wi = vertex.frame.to_local(connections.w.get(i));
                    self.directions.eval_pdf(vertex, wi)
                }
            };
            set(&mut beta_f, i, *beta * f);
            connections.pdf[i] = pdf * connections.geometry[i];
        }
        beta_f
    }

    /// Ray from the first vertex `i` to `end`, along its connection in `connections`.
    #[inline(always)]
    pub fn ray_to(&self, end: &End, connections: &Connections, i: usize) -> Ray {
        let is_front = Side::of(connections.cos[i]) == Side::Front;
        let start = self.starts[usize::from(!is_front)][i];
        // If the ray lies in an absorbing body, the first vertex or the end has the index of this
        // body
        let body = match &self.vertices[i] {
            Some(first) if !is_front && first.vertex.body > 0 => first.vertex.body,
            _ => end.vertex.body_towards(end.vertex.wo),
        };
        segment(start, end.p).when(end.vertex.point.time).within(body)
    }
}

impl Connections {
    /// Connections without any contribution.
    pub const NONE: Self = Self {
        w: Vec3Lanes::ZERO,
        cos: [0.0; LANES],
        geometry: [0.0; LANES],
        beta: [[0.0; LANES]; 3],
        pdf: [0.0; LANES],
    };

    /// Computes `beta` as the product of `beta_f` (throughput × BSDF), cosines and geometry terms.
    /// Sets the density to 0 for vertices that cannot find the end.
    #[inline(always)]
    fn finish(&mut self, beta_f: &[Lane; 3]) {
        for i in 0..LANES {
            let (g, pdf) = (self.geometry[i], self.pdf[i]);
            let finds = (g > 0.0) & (pdf > 0.0) & (pdf < f32::INFINITY);
            self.pdf[i] = if finds { pdf } else { 0.0 };
            let factor = self.cos[i].abs() * g;
            for (beta, f) in self.beta.iter_mut().zip(beta_f) {
                beta[i] = f[i] * factor;
            }
        }
    }

    /// Throughput from the end to the camera through the first vertex `i`, per area at the end, and
    /// the density per area with which this vertex finds the end. `None` if the vertex cannot find
    /// the end.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Option<(Spectrum, f32)> {
        let [r, g, b] = &self.beta;
        (self.pdf[i] > 0.0).then(|| (Spectrum::rgb(r[i], g[i], b[i]), self.pdf[i]))
    }
}

/// Sets the three channels of a lane.
#[inline(always)]
fn set(lanes: &mut [Lane; 3], lane: usize, value: Spectrum) {
    for (lanes, value) in lanes.iter_mut().zip(value.to_array()) {
        lanes[lane] = value;
    }
}
