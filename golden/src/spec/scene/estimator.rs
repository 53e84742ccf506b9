//! Estimators by name: the algorithm of the floating-point model, `search.estimator`, and that of the hardware and its
//! bit-true model, `hardware.estimator`. A name is an algorithm, wherever it runs.
//!
//! | name | μ | forces at that μ |
//! |---|---|---|
//! | `search` | the maximum of the objective Π | the series p(μ) of Cz⁺b |
//! | `evidence` | the one that makes the stress most probable, [`crate::estimate::evidence`] | the most probable ones |
//! | `network` | that of a trained network, [`crate::estimate::learned`] | the series p(μ) of Cz⁺b |
//! | `evidence+network` | that of a trained network | the most probable ones |
//! | `combined` | evidence and network, weighted by their covariances | the most probable ones |

/// How forces are estimated from stress.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EstimatorKind {
    /// The μ that maximises the objective Π.
    Search,
    /// The μ that makes the stress most probable.
    Evidence,
    /// μ from a trained network; p from the series at that μ. This is what the hardware computes with a network.
    Network,
    /// The μ of a trained network, and the forces that are most probable at that μ.
    EvidenceNetwork,
    /// The μ of evidence and network combined by their covariances, and the most probable forces at that μ.
    Combined,
}

/// Values of `search.estimator` of earlier versions, and what takes their place.
pub(super) const FORMER_NAMES: [(&str, &str); 2] = [
    (
        "learned",
        "two fields now: search.estimator = \"evidence+network\" is what \"learned\" was in floating point, \
         hardware.estimator = \"network\" what it was in hardware",
    ),
    ("auto", "left out, so that Dermis chooses and says what it took, or one of the names of an algorithm"),
];

impl EstimatorKind {
    /// Every estimator of the floating-point model with its name.
    pub const NAMES: [(&'static str, EstimatorKind); 5] = [
        ("search", EstimatorKind::Search),
        ("evidence", EstimatorKind::Evidence),
        ("network", EstimatorKind::Network),
        ("evidence+network", EstimatorKind::EvidenceNetwork),
        ("combined", EstimatorKind::Combined),
    ];

    /// Those of the hardware.
    pub const HARDWARE_NAMES: [(&'static str, EstimatorKind); 2] =
        [("search", EstimatorKind::Search), ("network", EstimatorKind::Network)];

    /// Its name.
    pub fn name(self) -> &'static str {
        let named = Self::NAMES.iter().find(|(_, kind)| *kind == self);
        named.map_or("", |(name, _)| name)
    }

    /// Whether it evaluates a trained network, `search.network`.
    pub fn has_network(self) -> bool {
        !matches!(self, EstimatorKind::Search | EstimatorKind::Evidence)
    }

    /// Whether its forces are the most probable ones, [`crate::estimate::evidence`], which finds the contacts itself.
    pub fn has_evidence(self) -> bool {
        !matches!(self, EstimatorKind::Search | EstimatorKind::Network)
    }

    /// Whether only a network gives μ.
    pub fn mu_of_network(self) -> bool {
        matches!(self, EstimatorKind::Network | EstimatorKind::EvidenceNetwork)
    }

    /// The hardware's estimator nearest to this one.
    pub(super) fn in_hardware(self) -> EstimatorKind {
        if self.has_network() {
            EstimatorKind::Network
        } else {
            EstimatorKind::Search
        }
    }
}
