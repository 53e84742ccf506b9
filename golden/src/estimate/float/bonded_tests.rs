//! The golden engine on frames of a bonded layer, computed by finite elements and by Fourier transforms.

use crate::data::frame::Frame;
use crate::estimate::float::Golden;
use crate::result::flags::Flag;
use crate::spec::scene::{Medium, Scene};

/// Targets for contacts inside the array: medians of the tangential and of the normal error.
const TANGENTIAL_MEDIAN: f64 = 0.08;
const NORMAL_MEDIAN: f64 = 0.01;

/// Frame, tangential and normal error of every shipped single contact inside the array, reconstructed with the medium
/// of `read_as`.
fn errors(read_as: impl Fn(Medium) -> Medium) -> Vec<(String, Option<f64>, f64)> {
    let mut all = Vec::new();
    for name in ["sensor-1", "sensor-2", "eight-by-eight"] {
        for poisson in [0.40, 0.48] {
            let mut scene = Scene::builtin(name).unwrap();
            scene.medium = Medium::BondedLayer { poisson };
            let frames = Frame::shipped(&scene);
            scene.medium = read_as(scene.medium);
            let golden = Golden::reference(&scene).unwrap();
            for frame in frames {
                let result = golden.run(&frame).unwrap();
                let independent = frame.source.as_deref() != Some("bonded-layer-quadrature");
                if independent && !result.flags.contains(&Flag::LoadOutside) {
                    let errors = result.error.unwrap();
                    all.push((frame.id, errors.tangential, errors.normal.unwrap()));
                }
            }
        }
    }
    all
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    (values[(values.len() - 1) / 2] + values[values.len() / 2]) / 2.0
}

#[test]
fn single_contacts_inside_the_array_meet_their_targets() {
    let all = errors(|medium| medium);
    assert_eq!(all.len(), 8);
    assert!(median(all.iter().filter_map(|frame| frame.1)) <= TANGENTIAL_MEDIAN, "{all:?}");
    assert!(median(all.iter().map(|frame| frame.2)) <= NORMAL_MEDIAN, "{all:?}");
    // The cell model spreads the force of a punch of 1.4 mm radius over a cell of 4 mm: the only error above 1 %.
    let above: Vec<_> = all.iter().filter(|frame| frame.2 > NORMAL_MEDIAN).map(|frame| &frame.0).collect();
    assert_eq!(above, ["S2-bl48-small"]);
}

#[test]
fn the_half_space_does_not_stand_in_for_the_layer() {
    let all = errors(|_| Medium::HalfSpace);
    assert!(median(all.iter().filter_map(|frame| frame.1)) > 3.0 * TANGENTIAL_MEDIAN, "{all:?}");
}

#[test]
fn two_contacts_share_their_load_but_not_their_shear() {
    let mut scene = Scene::builtin("sensor-3").unwrap();
    scene.medium = Medium::BondedLayer { poisson: 0.48 };
    let golden = Golden::reference(&scene).unwrap();
    let frames = Frame::shipped(&scene);
    assert_eq!(frames.len(), 2);
    for frame in frames {
        let normal = golden.run(&frame).unwrap().error.unwrap().normal.unwrap();
        assert!(normal <= NORMAL_MEDIAN, "{}: {normal}", frame.id);
    }
}
