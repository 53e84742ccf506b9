//! `dermis check --rate`: the frames per second that this machine holds with each estimator of a scene.

use std::time::{Duration, Instant};

use anyhow::{anyhow, Result};
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::engine::{CheckPace, Engine, StreamChecks};
use dermis_golden::estimate::float::Golden;
use dermis_golden::spec::scene::Scene;

use dermis_flow::progress::Progress;
use dermis_host::engine::typed;
use dermis_host::stream::Faster;
use dermis_report::RateRow;

/// Time for which an estimator is measured; a result that is begun is completed.
const MEASURED: Duration = Duration::from_millis(300);
/// Frames of the moving contact, which are taken again and again: at their end it jumps back.
const MOMENTS: usize = 60;
/// Noise of the frames over the largest stress.
const NOISE: f64 = 1e-3;

/// Measures each estimator of a scene in a stream of one moving contact, without the cross-check: the scene's own, and those that
/// a stream takes where that does not keep up.
///
/// # Errors
/// A scene whose own estimator is refused, or on whose array no contact can be drawn.
pub(super) fn rates(scene: &Scene) -> Result<Vec<RateRow>> {
    // The drawn frames are stress already, one for each result.
    let mut plain = scene.clone();
    (plain.input.calibration, plain.input.tare, plain.input.average) = (None, None, 0);
    let frames = Press::new(Motion::Slide).of_frames(MOMENTS, NOISE).frames(&plain, 1)?;
    let own = Golden::new(&plain)?;
    let mut rows = vec![row(&own, &frames)?];
    for faster in Faster::of_scene(&plain) {
        let name = faster.name();
        rows.push(match faster.build() {
            Ok(engine) => row(&*engine, &frames)?,
            Err(error) => RateRow { estimator: name, refused: Some(error.to_string()), ..RateRow::default() },
        });
    }
    Ok(rows)
}

/// Measures one engine.
fn row(engine: &dyn Engine, frames: &[dermis_golden::data::frame::Frame]) -> Result<RateRow> {
    let estimator = engine.estimator().name();
    let _progress = Progress::start(&format!("{}: rate with {estimator}", engine.scene().name));
    let mut checks = StreamChecks::new(engine, CheckPace::Never);
    let (begun, mut times) = (Instant::now(), Vec::new());
    for frame in frames.iter().cycle() {
        let one = Instant::now();
        checks.next(engine, std::slice::from_ref(frame)).map_err(typed)?;
        times.push(one.elapsed());
        if begun.elapsed() >= MEASURED {
            break;
        }
    }
    let slowest = times.iter().max().ok_or_else(|| anyhow!("{estimator}: no frame"))?;
    Ok(RateRow {
        estimator,
        frames: times.len(),
        frames_per_s: times.len() as f64 / times.iter().sum::<Duration>().as_secs_f64(),
        slowest_ms: 1e3 * slowest.as_secs_f64(),
        refused: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_estimator_of_a_stream_has_a_rate() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let rows = rates(&scene).unwrap();
        let names: Vec<&str> = rows.iter().map(|row| row.estimator).collect();
        assert_eq!(names, ["combined", "network", "search"]);
        for row in &rows {
            let mean_ms = 1e3 / row.frames_per_s;
            assert!(row.frames > 0 && mean_ms <= row.slowest_ms && row.refused.is_none(), "{row:?}");
        }
        // A network that is not there is no error: a stream leaves it out.
        let mut absent = scene;
        absent.search.estimator = Some(dermis_golden::spec::scene::EstimatorKind::Evidence);
        absent.search.network = Some("absent.network".into());
        let rows = rates(&absent).unwrap();
        assert!(rows[1].refused.as_ref().is_some_and(|reason| reason.contains("absent.network")), "{rows:?}");
    }
}
