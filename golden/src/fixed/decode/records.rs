//! Records: sums that a device sends in place of forces per taxel, in physical units.

use crate::fixed::plan::contents::Plan;
use crate::fixed::stages::resultants::Record;
use crate::result::reconstruct::{Region, Resultant, Wrench};

/// The records of a frame.
pub struct Records {
    all: Vec<Record>,
    /// N per LSB of a force word.
    lsb_N: f64,
    /// Half of the pitch in mm, [x, y].
    half_pitch_mm: [f64; 2],
}

impl Records {
    /// The records in the beats of a device; `None` where it sends a force per taxel.
    pub fn new(plan: &Plan, beats: &[[i32; 3]], lsb_N: f64) -> Option<Records> {
        let summed = plan.summed()?;
        let sensor = &plan.scene.sensor;
        let all = beats.chunks(summed.beats()).filter_map(|beats| Record::of_beats(summed, beats)).collect();
        Some(Records { all, lsb_N, half_pitch_mm: [sensor.pitch_x_mm, sensor.pitch_y_mm].map(|pitch| pitch / 2.0) })
    }

    /// The sum of this index over all records, in N, the moments in N times half a pitch. Devices may send any words, so that a
    /// sum of integers could overflow.
    fn sum(&self, index: usize) -> f64 {
        self.all.iter().map(|own| own.sums[index] as f64 * self.lsb_N).sum()
    }

    /// Sum of the forces of the array in N, [x, y, normal].
    pub fn resultant_N(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.sum(axis))
    }

    /// The resultant of each record.
    pub fn resultants(&self) -> Vec<Resultant> {
        self.all.iter().map(|own| self.resultant(own)).collect()
    }

    fn resultant(&self, own: &Record) -> Resultant {
        let [fx, fy, fz, pressed, x, y, ..] = own.sums.map(|sum| sum as f64);
        let centre = [x * self.half_pitch_mm[0] / pressed, y * self.half_pitch_mm[1] / pressed];
        Resultant { force_N: [fx, fy, fz].map(|f| f * self.lsb_N), centre_mm: (pressed > 0.0).then_some(centre) }
    }

    /// The contact of each label but that of no contact; those that there are not have no taxels.
    pub fn regions(&self) -> Vec<Region> {
        let region = |own: &Record| Region { taxel_count: own.taxels, ..Region::of_resultant(self.resultant(own)) };
        self.all.iter().skip(1).map(region).collect()
    }

    /// The wrench of the whole array from the records of all labels: the sums are exact, so that it is that of the forces per
    /// taxel.
    pub fn wrench(&self) -> Wrench {
        let [half_x, half_y] = self.half_pitch_mm;
        let [x_fz, y_fz, x_fy, y_fx] = [6, 7, 8, 9].map(|index| self.sum(index));
        let moment_Nmm = [y_fz * half_y, -x_fz * half_x, x_fy * half_x - y_fx * half_y];
        Wrench { force_N: self.resultant_N(), moment_Nmm }
    }
}
