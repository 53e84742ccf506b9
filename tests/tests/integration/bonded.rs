//! Nothing in the hardware knows the medium: the Verilog of a bonded layer is that of the half-space, where the words of the search
//! have the same widths, which follow from the matrices.

use std::collections::BTreeSet;

use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::{Medium, Scene};
use dermis_hdl::{generate, usage::total, Generated};
use dermis_tests::scene;

/// Formats that may differ: what a bit is worth, which is in no Verilog, and the widths of the search's words.
const EXPONENTS: [&str; 3] = ["inverse_exponent", "a_exponent", "force_exponent"];
const WIDTHS: [&str; 2] = ["search_bits", "sum_bits"];

/// The names of the formats that differ.
fn differing(models: [&Model; 2]) -> BTreeSet<String> {
    let [own, other] = models.map(|model| serde_json::to_value(model.formats()).unwrap());
    let fields = own.as_object().unwrap().iter();
    fields.filter(|(field, value)| other[field.as_str()] != **value).map(|(field, _)| field.clone()).collect()
}

/// The files that are no coefficients of the matrices, without the frames of the test bench.
fn verilog(generated: &Generated) -> Vec<(&str, &str)> {
    let design = |name: &str| name.ends_with(".v") || name.ends_with(".vlt");
    generated.files.iter().filter(|f| design(&f.name)).map(|f| (f.name.as_str(), f.text.as_str())).collect()
}

/// Models of a scene on both media.
fn both(scene: &Scene) -> [Model; 2] {
    [Medium::HalfSpace, Medium::BondedLayer { poisson: 0.48 }]
        .map(|medium| Model::new(&Scene { medium, ..scene.clone() }).unwrap())
}

#[test]
fn only_coefficients_and_their_widths_depend_on_the_medium() {
    let mut equal = 0;
    for name in ["sensor-1", "eight-by-eight"] {
        for mu_max in [0.6, 0.3, 0.0] {
            let mut scene = scene(name).0;
            (scene.search.mu_max, scene.search.network) = (mu_max, None);
            let [half_space, layer] = both(&scene);
            let found = differing([&half_space, &layer]);
            let known = |field: &String| [&EXPONENTS[..], &WIDTHS].concat().contains(&field.as_str());
            assert!(found.iter().all(known), "{name}, {mu_max}: {found:?}");
            let [own, other] = [&half_space, &layer].map(|model| &model.formats().search_bits);
            assert!(own.iter().zip(other).all(|(own, other)| own.abs_diff(*other) <= 1), "{own:?} {other:?}");
            let [text, wanted] = [&layer, &half_space].map(|model| generate(model).unwrap());
            let [used, before] = [&text, &wanted].map(|generated| total(&generated.usage));
            assert_eq!(
                (used.block_rams, used.multipliers),
                (before.block_rams, before.multipliers),
                "{name}, {mu_max}"
            );
            if !found.iter().any(|field| WIDTHS.contains(&field.as_str())) {
                assert_eq!(verilog(&text), verilog(&wanted), "{name}, {mu_max}");
                equal += 1;
            }
        }
    }
    assert_eq!(equal, 3, "scenes with words of the same widths");
}
