//! Stress: the integral of the continuous traction of all pieces with the kernel of a point force.
//!
//! b(taxel) = ∫ density(s) [Fz gn(d) + (F·d) gs(d)] dA, d = taxel − s. The domain of a piece is mapped from a rectangle
//! on which the integrand is analytic, and split until each patch is small relative to its distance from the taxel:
//!
//! ```text
//! Hertz:  ρ = sin φ   density dA = 3/2π cos² φ sin φ dφ dθ
//! disc:               density dA = 1/π ρ dρ dθ
//! square:             density dA = 1/4 dX dY
//! ```
//!
//! A tilt multiplies the density by 1 + tilt·(X, Y), X and Y being ±1 at the half-axes.
//!
//! With d = √(gap² + h²), the distance from the kernel's singularity, and half lengths of at most d/2, the error with N
//! nodes is E^(−2N), E = 2 + √5: with ten nodes 3e-13 of the largest integrand. Squares far away take fewer nodes.

use super::traction::{Piece, PressureShape};
use crate::physics::body::Body;
use crate::physics::bonded::kernel::REACH;
use crate::physics::gauss::rule;
use std::f64::consts::{FRAC_PI_2, PI};

/// Maximum number of nodes of a patch along each side.
const NODES: usize = 10;
/// Largest half length of a patch relative to its distance from the singularity.
const LONGEST: f64 = 0.5;
/// Largest half length of a patch on a layer in units of h: even far away the kernel varies on the scale of h.
const LONGEST_ON_LAYER: f64 = 1.5;
/// Natural logarithm of the allowed error.
const LN_ERROR: f64 = -30.0;

/// A rectangle in the parameters of a piece: [middle, half length] of each.
#[derive(Clone, Copy)]
struct Patch {
    u: [f64; 2],
    v: [f64; 2],
}

impl Patch {
    fn halves(self, along_u: bool) -> [Patch; 2] {
        [-1.0, 1.0].map(|side| {
            let half = |[middle, half]: [f64; 2]| [middle + side * half / 2.0, half / 2.0];
            if along_u {
                Patch { u: half(self.u), ..self }
            } else {
                Patch { v: half(self.v), ..self }
            }
        })
    }
}

impl Piece {
    /// The whole domain, split so that sines and cosines are smooth on each patch.
    fn patches(&self) -> Vec<Patch> {
        let quarters = (0..4).map(|k| [FRAC_PI_2 * (f64::from(k) + 0.5), FRAC_PI_2 / 2.0]);
        match self.form {
            PressureShape::Hertz => quarters.map(|v| Patch { u: [FRAC_PI_2 / 2.0; 2], v }).collect(),
            PressureShape::Disc => quarters.map(|v| Patch { u: [0.5; 2], v }).collect(),
            PressureShape::Square => vec![Patch { u: [0.0, 1.0], v: [0.0, 1.0] }],
        }
    }

    /// Position in mm, and density times area element.
    pub(super) fn map(&self, u: f64, v: f64) -> ([f64; 2], f64) {
        let (x, y, density) = match self.form {
            PressureShape::Hertz => {
                let (rho, cos) = u.sin_cos();
                (rho * v.cos(), rho * v.sin(), 1.5 / PI * cos * cos * rho)
            }
            PressureShape::Disc => (u * v.cos(), u * v.sin(), u / PI),
            PressureShape::Square => (u, v, 0.25),
        };
        let density = density * (1.0 + self.tilt[0] * x + self.tilt[1] * y);
        let (x, y) = (x * self.half_mm[0], y * self.half_mm[1]);
        let [cos, sin] = self.turn;
        ([self.centre_mm[0] + x * cos - y * sin, self.centre_mm[1] + x * sin + y * cos], density)
    }

    /// Upper bounds of a patch's half lengths in mm, along u and along v.
    fn extent(&self, patch: Patch) -> [f64; 2] {
        let longest = self.half_mm[0].max(self.half_mm[1]);
        let ([u, du], [_, dv]) = (patch.u, patch.v);
        match self.form {
            // The derivative of sin φ is largest at the inner end of the patch.
            PressureShape::Hertz => [longest * du * (u - du).cos(), longest * dv * (u + du).sin()],
            PressureShape::Disc => [longest * du, longest * dv * (u + du)],
            PressureShape::Square => [self.half_mm[0] * du, self.half_mm[1] * dv],
        }
    }
}

impl Body {
    /// Stress in MPa on a taxel at a position in mm, from all pieces.
    pub(super) fn stress_MPa(&self, taxel: [f64; 2], pieces: &[Piece]) -> f64 {
        let mut left = Vec::new();
        let mut sum = 0.0;
        for piece in pieces {
            left.extend(piece.patches());
            while let Some(patch) = left.pop() {
                sum += self.patch(taxel, piece, patch, &mut left);
            }
        }
        sum
    }

    /// The stress of a patch; or 0 if the patch is split and its halves are added to `left`.
    fn patch(&self, taxel: [f64; 2], piece: &Piece, patch: Patch, left: &mut Vec<Patch>) -> f64 {
        let (middle, _) = piece.map(patch.u[0], patch.v[0]);
        let extent = piece.extent(patch);
        let away = (taxel[0] - middle[0]).hypot(taxel[1] - middle[1]);
        let gap = (away - extent[0] - extent[1]).max(0.0);
        let (Body::HalfSpace { h } | Body::Layer { h, .. }) = self;
        let distance = gap.hypot(*h);
        let longest = match self {
            Body::HalfSpace { .. } => LONGEST * distance,
            Body::Layer { .. } if gap >= REACH * h => return 0.0,
            Body::Layer { .. } => (LONGEST * distance).min(LONGEST_ON_LAYER * h),
        };
        if extent[0] > longest || extent[1] > longest {
            left.extend(patch.halves(extent[0] > extent[1]));
            return 0.0;
        }
        let nodes = |half: f64| match (piece.form, self) {
            (PressureShape::Square, Body::HalfSpace { .. }) => {
                let ratio = distance / half;
                let log = (ratio + ratio.hypot(1.0)).ln();
                rule(((-0.5 * LN_ERROR / log).ceil() as usize).clamp(1, NODES))
            }
            _ => rule(NODES),
        };
        let (along_u, along_v) = (nodes(extent[0]), nodes(extent[1]));
        let mut sum = 0.0;
        for &(v, wv) in along_v {
            for &(u, wu) in along_u {
                let (place, density) = piece.map(patch.u[0] + u * patch.u[1], patch.v[0] + v * patch.v[1]);
                let offset = [taxel[0] - place[0], taxel[1] - place[1]];
                sum += wu * wv * density * self.point_MPa(offset, piece.force_N);
            }
        }
        sum * patch.u[1] * patch.v[1]
    }
}
