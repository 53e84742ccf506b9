//! Specimens of an array for which its hardware is made: those at the bounds of `hardware.table_range`.
//!
//! Widths and scales follow from the largest coefficients and norms of the matrices. A thicker cover has larger ones of Cz⁺, a
//! dead taxel changes those around it, most at the edge. The hardware serves whatever needs no wider word than these
//! specimens; [`requantised`](super::cases::requantised) checks it for each that is loaded.

use crate::spec::scene::Scene;
use crate::spec::sensor::Sensor;

/// The scene's array with the thinnest, a middle and the thickest cover, each without dead taxels, with one and with the most;
/// empty where all specimens have the same coefficients.
pub fn specimens(scene: &Scene) -> Vec<Scene> {
    let range = &scene.hardware.table_range;
    if !range.has_coefficients() {
        return Vec::new();
    }
    let covers = match range.thickness_mm {
        Some([least, most]) => vec![least, (least * most).sqrt(), most],
        None => vec![scene.sensor.thickness_mm],
    };
    let dead = match range.dead_taxels {
        0 => vec![scene.input.dead.clone()],
        most => dead_sets(&scene.sensor, most),
    };
    let specimen = |thickness_mm: f64, dead: &Vec<[usize; 2]>| {
        let mut specimen = scene.clone();
        specimen.sensor.thickness_mm = thickness_mm;
        specimen.input.dead.clone_from(dead);
        specimen
    };
    covers.iter().flat_map(|&cover| dead.iter().map(move |dead| specimen(cover, dead))).collect()
}

/// No dead taxel; one, and `most` next to one another, at a corner, in the middle of two edges and of the array; `most` far
/// from one another. Each set ascends.
fn dead_sets(sensor: &Sensor, most: usize) -> Vec<Vec<[usize; 2]>> {
    let (rows, cols) = (sensor.rows, sensor.cols);
    let all: Vec<[usize; 2]> = (0..rows * cols).map(|taxel| [taxel / cols, taxel % cols]).collect();
    let around = |[row, col]: [usize; 2], count: usize| {
        let mut nearest = all.clone();
        nearest.sort_by_key(|at| at[0].abs_diff(row).pow(2) + at[1].abs_diff(col).pow(2));
        nearest.truncate(count);
        nearest
    };
    let places = [[0, 0], [0, cols / 2], [rows / 2, 0], [rows / 2, cols / 2]];
    let mut sets: Vec<_> = places.iter().flat_map(|&place| [around(place, 1), around(place, most)]).collect();
    sets.push((0..most).map(|k| all[k * all.len() / most]).collect());
    sets.push(Vec::new());
    sets.iter_mut().for_each(|set| set.sort_unstable());
    sets.sort();
    sets.dedup();
    sets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let sensor = Sensor { rows: 3, cols: 4, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
        let sets = dead_sets(&sensor, 3);
        assert!(sets.contains(&vec![[0, 0], [0, 1], [1, 0]]) && sets.contains(&vec![[0, 0], [1, 0], [2, 0]]));
        assert!(sets.contains(&Vec::new()) && sets.iter().all(|set| set.len() <= 3));
        let mut scene = Scene::of_sensor(&sensor, "range");
        assert!(specimens(&scene).is_empty());
        scene.hardware.table_range.thickness_mm = Some([0.5, 2.0]);
        let covers: Vec<f64> = specimens(&scene).iter().map(|specimen| specimen.sensor.thickness_mm).collect();
        assert_eq!(covers, [0.5, 1.0, 2.0]);
        scene.hardware.table_range.dead_taxels = 3;
        assert_eq!(specimens(&scene).len(), 3 * sets.len());
    }
}
