//! Flipped bits under Verilator: every bit of state is found, faults that must be flagged are flagged, and a reset
//! always recovers.

use dermis_cosim::faults::{inject_faults, Shares};
use dermis_cosim::hardware::Hardware;
use dermis_golden::fixed::plan::storage::word_bits;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::state::StorageClass;
use dermis_report as report;
use dermis_tests::build_dir;

/// Few taxels and no search, so that the library with access to every signal is built quickly.
fn hardware() -> Hardware {
    let text = "name = \"faults\"\n[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 3.0\npitch_y_mm = 4.0\n\
                thickness_mm = 3.0\n[search]\nmu_max = 0.0\n";
    Hardware::new(Model::new(&Scene::parse(text, "faults").unwrap()).unwrap(), &build_dir()).unwrap()
}

#[test]
fn every_bit_is_found() {
    let hardware = hardware();
    let (memories, all) = (&hardware.generated.memories, &hardware.generated.state);
    let bits = |wanted: &dyn Fn(StorageClass) -> bool| -> usize {
        all.iter().filter(|element| wanted(element.class)).map(|element| element.words * element.bits).sum()
    };
    let listed: usize = memories.iter().map(|memory| memory.planned.words * memory.planned.bits).sum();
    assert_eq!(bits(&|class| class != StorageClass::Register), listed);
    assert_eq!(
        bits(&|class| class == StorageClass::Rom),
        hardware.model.storage().words() * word_bits(hardware.model.formats())
    );
    // Estimated without the registers inside memory blocks, and without memories in LUTs, such as the queue's.
    let estimated: usize = hardware.generated.usage.iter().map(|(_, usage)| usage.flip_flops).sum();
    let flip_flops = all.iter().filter(|element| element.class == StorageClass::Register && element.words == 1);
    let registers: usize = flip_flops.map(|element| element.bits).sum();
    println!("{registers} bits of registers, {estimated} flip-flops estimated");
    assert!(registers > estimated && registers < estimated + estimated / 4, "{registers}, estimated {estimated}");
}

#[test]
fn outcomes_add_up_and_a_reset_helps() {
    let rows = inject_faults(&hardware(), &[], 900, 1).unwrap();
    println!("{}", report::faults(&rows));
    for row in &rows {
        assert_eq!(row.harmless + row.detected + row.hang + row.silent, row.flips, "{row:?}");
        assert!(row.flips >= 15 && row.distinct_bits > 0 && row.not_recovered == 0, "{row:?}");
        assert!(row.large <= row.silent && (row.large == 0 || row.largest_error > 0.01), "{row:?}");
    }
    let of =
        |class: StorageClass, stage: &str| rows.iter().find(|row| row.class == class && row.stage == stage).unwrap();
    // A coefficient is read in every frame: the force words are wrong, and nothing flags it.
    let coefficients = of(StorageClass::Rom, "pass");
    assert!(4 * coefficients.silent > coefficients.flips && coefficients.detected == 0, "{coefficients:?}");
    // State of the handshake: a flip hangs the design or breaks the length of a frame.
    let control = ["send", "engine", "receive"].map(|stage| of(StorageClass::Register, stage));
    assert!(control.iter().any(|row| row.hang > 0) && control.iter().any(|row| row.detected > 0), "{control:?}");
    let shares = Shares::of(&rows, StorageClass::Rom).unwrap();
    assert!((shares.harmless + shares.detected + shares.hang + shares.silent - 1.0).abs() < 1e-9, "{shares:?}");
}
