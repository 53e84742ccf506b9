//! Plantar: measured foot pressure as squares of uniform pressure.
//!
//! The templates (`data/plantar`, MIT licence, Pataky et al. 2011) have 63 × 27 pixels in arbitrary units; a pixel
//! carries the fraction value / sum of the load. Before rotation, rows run along +y and columns along +x.

/// Pixels of a template: along the foot, across it.
const PIXELS: [usize; 2] = [63, 27];
/// Side of a pixel if no size is given: a foot of 258 mm.
const PIXEL_MM: f64 = 4.1;

/// A template.
pub(super) struct Foot(&'static str);

/// One square of uniform pressure.
pub(super) struct Pixel {
    /// Centre relative to that of the template.
    pub(super) centre_mm: [f64; 2],
    /// Half of width and length.
    pub(super) half_mm: [f64; 2],
    /// Fraction of the whole load.
    pub(super) share: f64,
}

impl Foot {
    /// The template of a contact's shape.
    pub(super) fn named(shape: &str) -> Option<Foot> {
        match shape {
            "plantar-left" | "plantar-template-MUN104L" => {
                Some(Foot(include_str!("../../../data/plantar/MUN104L.csv")))
            }
            "plantar-right" | "plantar-template-MUN104R" => {
                Some(Foot(include_str!("../../../data/plantar/MUN104R.csv")))
            }
            _ => None,
        }
    }

    /// Pressures, row-major.
    fn values(&self) -> Vec<f64> {
        self.0.split(['\n', ',', '\r']).filter_map(|text| text.trim().parse().ok()).collect()
    }
}

/// The loaded pixels of the named template, scaled to `size_mm` = [width, length], else of natural size.
pub(super) fn pixels(shape: &str, size_mm: &[f64]) -> Vec<Pixel> {
    let values = Foot::named(shape).map_or_else(Vec::new, |foot| foot.values());
    let [rows, cols] = PIXELS;
    let side = |count: usize, size: Option<&f64>| size.map_or(PIXEL_MM, |mm| mm / count as f64);
    let (width, length) = (side(cols, size_mm.first()), side(rows, size_mm.get(1)));
    let sum: f64 = values.iter().sum();
    let from_middle = |index: usize, count: usize| index as f64 - (count as f64 - 1.0) / 2.0;
    let pixel = |(index, value): (usize, &f64)| Pixel {
        centre_mm: [from_middle(index % cols, cols) * width, from_middle(index / cols, rows) * length],
        half_mm: [width / 2.0, length / 2.0],
        share: value / sum,
    };
    values.iter().enumerate().filter(|(_, value)| **value > 0.0).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_are_whole() {
        for name in ["plantar-left", "plantar-right"] {
            let values = Foot::named(name).unwrap().values();
            assert_eq!(values.len(), PIXELS[0] * PIXELS[1]);
            assert!(values.iter().all(|value| *value >= 0.0));
            let shares: f64 = pixels(name, &[]).iter().map(|pixel| pixel.share).sum();
            assert!((shares - 1.0).abs() < 1e-12);
        }
    }
}
