//! The taxels of a result as points with their forces.

use dermis_golden::data::frame::Forces;
use dermis_golden::data::recording::message::{Header, PointCloud2, PointField};
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::sensor::Sensor;

use super::METRES;

/// Bytes of a point's value, of 64 bits.
const VALUE: usize = 8;
/// Bytes of a point's place: three values of 32 bits, and as many as bring the next one to a multiple of its size.
const PLACE: usize = 16;

/// The taxels as points.
pub struct Points {
    fields: Vec<PointField>,
    data: Vec<u8>,
    /// Whether no value is undefined.
    dense: bool,
}

impl Points {
    /// The taxels with what the result has of each; there are none where it has no force per taxel.
    pub fn new(sensor: &Sensor, result: &Reconstruction) -> Points {
        let Forces { fx, fy, fz } = &result.forces_N;
        let mut columns = vec![("fx", fx.clone()), ("fy", fy.clone()), ("fz", fz.clone())];
        columns.extend(ratios(sensor, result));
        let field = |name: &str, offset: usize, datatype| {
            let (name, offset) = (name.to_owned(), offset as u32);
            PointField { name, offset, datatype, count: 1 }
        };
        // Viewers require places of 32 bits.
        let places = ["x", "y", "z"].into_iter().enumerate();
        let mut fields: Vec<PointField> =
            places.map(|(index, name)| field(name, 4 * index, PointField::FLOAT32)).collect();
        for (index, (name, _)) in columns.iter().enumerate() {
            fields.push(field(name, PLACE + VALUE * index, PointField::FLOAT64));
        }
        let mut data = Vec::with_capacity(fz.len() * (PLACE + VALUE * columns.len()));
        for taxel in 0..fz.len() {
            let [x, y] = sensor.position_mm(taxel / sensor.cols, taxel % sensor.cols);
            for place in [x, y, 0.0, 0.0] {
                data.extend(((place * METRES) as f32).to_le_bytes());
            }
            columns.iter().for_each(|(_, values)| data.extend(values[taxel].to_le_bytes()));
        }
        let dense = columns.iter().all(|(_, values)| values.iter().all(|value| value.is_finite()));
        Points { fields, data, dense }
    }

    /// The message.
    pub fn cloud(&self, sensor: &Sensor, header: Header) -> PointCloud2<'_> {
        let [height, width] = [sensor.rows as u32, sensor.cols as u32];
        let row_step = (self.data.len() / sensor.rows) as u32;
        PointCloud2 {
            header,
            height,
            width,
            fields: self.fields.clone(),
            is_bigendian: false,
            point_step: row_step / width,
            row_step,
            data: &self.data,
            is_dense: self.dense,
        }
    }
}

/// Taxels with the same μ: which they are, μ, its standard deviation.
type Part = (Vec<usize>, [f64; 2], Option<[f64; 2]>);

/// μ of each taxel and its standard deviation, of its region or subarray, as far as the result has them; undefined for
/// taxels in none. The contacts of the estimator `evidence` overlap: theirs are not those of taxels.
fn ratios(sensor: &Sensor, result: &Reconstruction) -> Vec<(&'static str, Vec<f64>)> {
    if result.extra.contacts.is_some() {
        return Vec::new();
    }
    let parts: Vec<Part> = match &result.extra.regions {
        Some(regions) => regions.iter().map(|region| (region.taxels.clone(), region.mu, region.mu_sigma)).collect(),
        None => {
            let taxels = |row0: usize, col0: usize, rows: usize, cols: usize| {
                (0..rows * cols).map(|k| (row0 + k / cols) * sensor.cols + col0 + k % cols).collect()
            };
            let subarrays = result.subarrays.iter();
            subarrays.map(|part| (taxels(part.row0, part.col0, part.rows, part.cols), part.mu, part.mu_sigma)).collect()
        }
    };
    let mut columns: Vec<(&str, Vec<f64>)> = Vec::new();
    let mut column = |name, axis: usize, of: &dyn Fn([f64; 2], Option<[f64; 2]>) -> Option<[f64; 2]>| {
        if parts.iter().all(|(_, mu, sigma)| of(*mu, *sigma).is_none()) {
            return;
        }
        let mut values = vec![f64::NAN; sensor.taxels()];
        for (taxels, mu, sigma) in &parts {
            let Some(ratio) = of(*mu, *sigma) else { continue };
            taxels.iter().for_each(|taxel| values[*taxel] = ratio[axis]);
        }
        columns.push((name, values));
    };
    for (axis, name) in ["mu_x", "mu_y"].into_iter().enumerate() {
        column(name, axis, &|mu, _| Some(mu));
    }
    for (axis, name) in ["mu_sigma_x", "mu_sigma_y"].into_iter().enumerate() {
        column(name, axis, &|_, sigma| sigma);
    }
    columns
}
