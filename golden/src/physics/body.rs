//! Body: the elastic cover, and the stress of a point force on its surface.
//!
//! ```text
//! half-space  b = 3 h² (Fx dx + Fy dy + Fz h) / (2π ρ⁵), ρ² = dx² + dy² + h²        layer: crate::physics::bonded::kernel
//! ```
//! | | shape | unit |
//! |---|---|---|
//! | in: offset, taxel − force | 2 | mm |
//! | in: force | 3 | N: x, y, normal |
//! | out: normal stress, compression positive | scalar | MPa |

use crate::physics::bonded::kernel::Kernel;
use crate::spec::scene::Medium;
use std::f64::consts::TAU;

/// The elastic body; h in mm.
pub enum Body {
    /// Infinitely deep.
    HalfSpace {
        /// Depth of the taxels.
        h: f64,
    },
    /// A layer bonded to a rigid base.
    Layer {
        /// Thickness.
        h: f64,
        /// Kernels for its Poisson ratio.
        kernel: Kernel,
    },
}

impl Body {
    /// The body of a medium; `h` in mm, above 0.
    pub fn new(medium: Medium, h: f64) -> Body {
        match medium {
            Medium::HalfSpace => Body::HalfSpace { h },
            Medium::BondedLayer { poisson } => Body::Layer { h, kernel: Kernel::new(poisson) },
        }
    }

    /// Stress in MPa of a point force at an offset, taxel − force.
    pub fn point_MPa(&self, [dx, dy]: [f64; 2], [fx, fy, fz]: [f64; 3]) -> f64 {
        match self {
            Body::HalfSpace { h } => {
                let square = dx * dx + dy * dy + h * h;
                3.0 * h * h * (fx * dx + fy * dy + fz * h) / (TAU * square * square * square.sqrt())
            }
            Body::Layer { h, kernel } => {
                let [normal, shear] = kernel.at(dx.hypot(dy) / h);
                (fz * normal + (fx * dx + fy * dy) / h * shear) / (h * h)
            }
        }
    }
}
