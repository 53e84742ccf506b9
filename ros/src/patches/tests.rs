//! Patch files, right and wrong ones.

use super::fields::{base, LOOPBACK, ROUTER};
use super::*;

const PATCH: &str = "[[patch]]\nname = \"thumb\"\nscene = \"sensor-1\"\nsource = \"udp://0.0.0.0:9000\"\n";

#[test]
fn what_a_file_leaves_out_has_defaults() {
    let PatchFile { node, patches } = PatchFile::parse(PATCH, Path::new("folder")).unwrap();
    assert_eq!((node.name.as_str(), node.namespace.as_str(), node.domain, node.queue), ("dermis", "/", 0, 2));
    assert_eq!((node.connect, node.listen), (vec![ROUTER.to_owned()], vec![LOOPBACK.to_owned()]));
    let patch = &patches[0];
    assert_eq!((patch.frame_id.as_str(), patch.engine), ("thumb", EngineName::Golden));
    assert_eq!(patch.origin, Origin::Lines(Source::Udp("0.0.0.0:9000".into())));
    assert_eq!(patch.text, Scene::text("sensor-1").unwrap());
}

#[test]
fn paths_are_relative_to_the_file() {
    let of = |source: &str| {
        let text = PATCH.replace("udp://0.0.0.0:9000", source);
        PatchFile::parse(&text, Path::new("folder")).unwrap().patches.remove(0).origin
    };
    assert_eq!(of("press.mcap"), Origin::Recording("folder/press.mcap".into()));
    assert_eq!(of("log.csv"), Origin::Lines(Source::Path("folder/log.csv".into())));
    assert_eq!(of("serial:/dev/ttyUSB0"), Origin::Lines(Source::Path("/dev/ttyUSB0".into())));
    assert_eq!(of("-"), Origin::Lines(Source::StandardInput));
}

#[test]
fn a_wrong_file_is_refused_with_line_field_and_value() {
    for (text, wanted) in [
        ("[node]\nport = 3\n", "line 2, node.port: unknown field port"),
        ("[node]\nlate_ms = nan\n", "node.late_ms = NaN is not allowed; it must be a number above 0"),
        ("[node]\nnamespace = \"hand\"\n", "node.namespace = \"hand\" is not allowed"),
        ("[node]\nconnect = [\"here\"]\n", "node.connect = \"here\" is not allowed"),
        ("[node]\nqueue = -1\n", "line 2, node.queue"),
    ] {
        let error = PatchFile::parse(&(text.to_owned() + PATCH), Path::new("")).unwrap_err().to_string();
        assert!(error.starts_with(wanted), "{error}");
    }
    let absent = PatchFile::load(Path::new("absent.toml")).unwrap_err();
    assert!(format!("{absent:#}").starts_with("absent.toml: "), "{absent:#}");
}

#[test]
fn a_patch_with_a_board_has_no_estimator_and_no_worker_of_the_others() {
    let board = |more: &str| PatchFile::parse(&format!("{PATCH}board = \"udp:192.168.1.50\"\n{more}"), Path::new(""));
    let file = board("").unwrap();
    assert_eq!((file.patches[0].fields.board.as_deref(), file.threads()), (Some("udp:192.168.1.50"), 0));
    for (more, wanted) in
        [("estimator = \"search\"\n", "patch[0].estimator"), ("engine = \"fixed\"\n", "patch[0].engine")]
    {
        let error = board(more).unwrap_err().to_string();
        assert!(error.starts_with(wanted) && error.contains("the board at udp:192.168.1.50"), "{error}");
    }
}

#[test]
fn angles_are_about_fixed_axes() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turned = |rpy_rad| Pose { parent: base(), xyz_m: [0.0; 3], rpy_rad }.quaternion();
    let right = std::f64::consts::FRAC_PI_2;
    for (rpy, wanted) in [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        ([right, 0.0, 0.0], [half, 0.0, 0.0, half]),
        ([0.0, right, 0.0], [0.0, half, 0.0, half]),
        ([right, 0.0, right], [0.5, 0.5, 0.5, 0.5]),
    ] {
        assert!(turned(rpy).iter().zip(wanted).all(|(own, wanted)| (own - wanted).abs() < 1e-12), "{rpy:?}");
    }
}
