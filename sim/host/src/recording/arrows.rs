//! The forces of a result as arrows and lines that viewers draw.

use dermis_golden::data::frame::Forces;
use dermis_golden::data::recording::message::{Header, Marker, MarkerArray, Pose, Vector3};
use dermis_golden::result::reconstruct::{FoundContact, Reconstruction};
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::sensor::Sensor;

use super::METRES;

/// Stress that is drawn half a pitch long, where the scene states no full scale.
const REFERENCE_MPA: f64 = 0.1;
/// Diameters of an arrow's shaft and head over the pitch; the head's length is that of the viewer.
const ARROW: [f64; 3] = [0.15, 0.4, 0.0];
/// Width of a taxel's line over the pitch.
const LINE: [f64; 3] = [0.06, 0.0, 0.0];
/// Red, green, blue, opacity.
const ORANGE: [f32; 4] = [1.0, 0.45, 0.0, 1.0];
const BLUE: [f32; 4] = [0.2, 0.6, 1.0, 1.0];

/// How large forces are drawn: the same in all results of a scene.
pub struct Arrows {
    metres_per_N: f64,
    /// The smaller one in m.
    pitch: f64,
}

impl Arrows {
    /// The force of a taxel at full scale is half a pitch long.
    pub fn of(scene: &Scene) -> Arrows {
        let Sensor { pitch_x_mm, pitch_y_mm, .. } = scene.sensor;
        let pitch = pitch_x_mm.min(pitch_y_mm) * METRES;
        // MPa times mm².
        let reference_N = scene.input.full_scale_MPa.unwrap_or(REFERENCE_MPA) * pitch_x_mm * pitch_y_mm;
        Arrows { metres_per_N: 0.5 * pitch / reference_N, pitch }
    }

    /// An arrow per contact, from its centre of pressure, and a line per taxel; those of the result before are removed.
    pub fn markers(
        &self,
        sensor: &Sensor,
        result: &Reconstruction,
        contacts: &[FoundContact],
        header: &Header,
    ) -> MarkerArray {
        let marker = |ns: &str, id: usize, r#type, action, (scale, color): ([f64; 3], [f32; 4]), points| Marker {
            header: header.clone(),
            ns: ns.into(),
            id: id as i32,
            r#type,
            action,
            pose: Pose::default(),
            scale: scale.map(|share| share * self.pitch),
            color,
            lifetime: (0, 0),
            frame_locked: false,
            points,
            colors: Vec::new(),
            unused: Default::default(),
        };
        let mut markers = vec![marker("", 0, Marker::ARROW, Marker::DELETEALL, (ARROW, ORANGE), Vec::new())];
        for (index, contact) in contacts.iter().enumerate() {
            let Some(centre_mm) = contact.centre_mm else { continue };
            let points = self.line(centre_mm, contact.force_N).to_vec();
            markers.push(marker("contacts", index + 1, Marker::ARROW, Marker::ADD, (ARROW, ORANGE), points));
        }
        let Forces { fx, fy, fz } = &result.forces_N;
        let line = |taxel: usize| {
            let position_mm = sensor.position_mm(taxel / sensor.cols, taxel % sensor.cols);
            self.line(position_mm, [fx[taxel], fy[taxel], fz[taxel]])
        };
        let points: Vec<Vector3> = (0..fz.len()).flat_map(line).collect();
        if !points.is_empty() {
            markers.push(marker("taxels", 0, Marker::LINE_LIST, Marker::ADD, (LINE, BLUE), points));
        }
        MarkerArray { markers }
    }

    /// Start and end in m of a force in N on the surface.
    fn line(&self, [x, y]: [f64; 2], force_N: [f64; 3]) -> [Vector3; 2] {
        let start = [x * METRES, y * METRES, 0.0];
        [start, std::array::from_fn(|axis| start[axis] + force_N[axis] * self.metres_per_N)]
    }
}
