//! Settings: the scenes of the stability table, from well to extremely ill conditioned.
//!
//! | group | array | pitch | thickness | other |
//! |---|---|---|---|---|
//! | `thickness` | 8×8 | 1×1 mm | 0.1 … 10 mm | from 3 mm on with each kind of inverse |
//! | `poisson` | 8×8 | 1×1 mm | 1, 3 mm | bonded layer, ν 0.3 … 0.4999 |
//! | `size` | 2×2 … 48×48 | 1×1 mm | 2 mm | |
//! | `pitches` | 8×8 | 1:100 … 100:1 | 2 mm | |
//! | `50 digits` | 8×8 | 1×1 mm | 1, 3, 5, 10 mm | stress computed independently with 50 digits, `data/reference` |
//!
//! mu_max is [`MU_MAX`], for which every series converges within the hardware's degree; other fields have their
//! defaults.

use dermis_golden::data::frame::Frame;
use dermis_golden::spec::scene::{InverseKind, Medium, Scene};
use dermis_golden::spec::sensor::Sensor;

/// mu_max of the table's scenes.
pub const MU_MAX: f64 = 0.4;

/// Files of `data/reference` with their text.
const REFERENCES: [(&str, &str); 4] = [
    ("stiff-8x8-h1.json", include_str!("../../../data/reference/stiff-8x8-h1.json")),
    ("stiff-8x8-h3.json", include_str!("../../../data/reference/stiff-8x8-h3.json")),
    ("stiff-8x8-h5.json", include_str!("../../../data/reference/stiff-8x8-h5.json")),
    ("stiff-8x8-h10.json", include_str!("../../../data/reference/stiff-8x8-h10.json")),
];

/// One scene of the table.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The quantity varied.
    pub group: String,
    /// The scene.
    pub scene: Scene,
    /// Known forces with their stress for one shear; if `None`, the table's own Hertz pressure is used.
    pub frame: Option<Frame>,
}

impl Setting {
    /// A scene with the table's own Hertz pressure.
    pub fn new(group: impl Into<String>, scene: Scene) -> Setting {
        Setting { group: group.into(), scene, frame: None }
    }
}

/// All scenes of the table, in its order.
pub fn settings() -> Vec<Setting> {
    let mut all = Vec::new();
    let mut add = |group: &str, size: [usize; 2], pitch: [f64; 2], h: f64, medium: Medium, kind: InverseKind| {
        let sensor =
            Sensor { rows: size[0], cols: size[1], pitch_x_mm: pitch[0], pitch_y_mm: pitch[1], thickness_mm: h };
        let mut scene = Scene::of_sensor(&sensor, group);
        scene.search.mu_max = MU_MAX;
        scene.medium = medium;
        scene.inverse.kind = kind;
        all.push(Setting::new(group, scene));
    };
    let (half_space, tsvd) = (Medium::HalfSpace, InverseKind::Tsvd);
    for h in [0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0] {
        add("thickness", [8, 8], [1.0; 2], h, half_space, tsvd);
        if h >= 3.0 {
            add("thickness", [8, 8], [1.0; 2], h, half_space, InverseKind::Tikhonov);
            add("thickness", [8, 8], [1.0; 2], h, half_space, InverseKind::Exact);
        }
    }
    for h in [1.0, 3.0] {
        for poisson in [0.3, 0.45, 0.49, 0.499, 0.4999] {
            add("poisson", [8, 8], [1.0; 2], h, Medium::BondedLayer { poisson }, tsvd);
        }
    }
    for size in [[2, 2], [4, 4], [2, 48], [12, 12], [16, 16], [24, 24], [48, 48]] {
        add("size", size, [1.0; 2], 2.0, half_space, tsvd);
    }
    for pitch in [[10.0, 1.0], [1.0, 10.0], [100.0, 1.0], [1.0, 100.0], [0.2, 5.0], [5.0, 0.2]] {
        add("pitches", [8, 8], pitch, 2.0, half_space, tsvd);
    }
    all.extend(references().into_iter().map(|frame| {
        let mut scene = Scene::of_sensor(&frame.sensor, "50 digits");
        scene.search.mu_max = MU_MAX;
        Setting { frame: Some(frame), ..Setting::new("50 digits", scene) }
    }));
    all
}

/// Frames of known forces and shear with stress computed independently with 50 digits.
pub fn references() -> Vec<Frame> {
    // A file that cannot be parsed would be missing here; a test counts them.
    REFERENCES.into_iter().filter_map(|(name, text)| Frame::parse(name, text, None).ok()).collect()
}
