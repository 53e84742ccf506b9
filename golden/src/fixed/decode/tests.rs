//! Each flag of a status reaches the result.

use super::*;
use crate::spec::scene::Scene;

/// The flags of a frame of eight-by-eight whose statuses are changed on the way.
fn flags(model: &Model, change: impl Fn(&mut Status)) -> Vec<Flag> {
    let frame = &Frame::shipped(&model.scene)[1..2];
    let trace = model.run(&model.readings(frame).unwrap());
    let changed = |mut status: Status| {
        change(&mut status);
        status.beats()
    };
    let status: Vec<[i32; 3]> = Status::all(&trace.status).flat_map(changed).collect();
    model.decode(frame, "fixed", &trace.beats, &status).unwrap().flags
}

#[test]
fn each_flag_of_a_status_is_in_the_result() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    let model = Model::new(&scene).unwrap();
    assert_eq!(flags(&model, |_| ()), []);
    for flag in Flag::ALL.into_iter().filter(|flag| flag.status_bit().is_some()) {
        assert_eq!(flags(&model, |status| status.raised = FlagSet::raised([(flag, true)])), [flag]);
    }
    assert_eq!(flags(&model, |status| status.condition = false), [Flag::ConditionUnmet]);
    assert_eq!(flags(&model, |status| status.found = false), [Flag::NoCompression]);
    assert_eq!(flags(&model, |status| status.rescale_saturations = 1), [Flag::Saturated]);
    assert_eq!(flags(&model, |status| status.force_saturations = 1), [Flag::Saturated]);
    // Without a search there was nothing to find.
    scene.search.mu_max = 0.0;
    let unsearched = Model::new(&scene).unwrap();
    assert_eq!(flags(&unsearched, |status| assert!(status.condition && !status.found)), []);
}
