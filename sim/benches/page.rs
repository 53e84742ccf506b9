//! Time in which headless Chromium draws a picture of 20×20 taxels on the page of `dermis live`: script, style, layout and
//! paint on the page's thread, after 600 pictures, as many as ten seconds have.
//!
//! ```text
//! make bench, or: cargo bench --package dermis-sim --bench page
//! ```
//! The mean of the thread's processor time must be at most [`MOST_MS`]; the time on the clock has other programs in it too.

#[path = "../tests/program/browser.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod browser;

use std::net::TcpListener;
use std::sync::Arc;

use anyhow::{ensure, Context};
use browser::Browser;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::data::generator::{generate, random_contacts, Draw, Shapes};
use dermis_golden::estimate::float::Golden;
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::sensor::Sensor;
use dermis_host::stream::{Outcome, StreamAnswer};
use dermis_sim::live::{Newest, Server, Show};
use serde_json::json;

const MOST_MS: f64 = 8.0;
/// Pictures before the measurement, and in it.
const PICTURES: [usize; 2] = [600, 200];

/// Draws COUNT pictures, each different from the one before; their times on the clock in ms, ascending.
const DRAW: &str = "(async () => {
  const picture = await (await fetch('/newest?after=0')).json(), times = [], turned = structuredClone(picture);
  for (const all of [turned.truth, turned.result.forces_N]) {
    for (const axis of ['fx', 'fy', 'fz']) all[axis].reverse();
  }
  turned.stress_MPa.reverse();
  for (let k = 0; k < COUNT; k++) {
    await new Promise(requestAnimationFrame);
    const begun = performance.now();
    draw(k % 2 ? picture : turned, begun / 1e3);
    // Delivered after the frame is painted.
    await new Promise(painted => {
      const { port1, port2 } = new MessageChannel();
      port1.onmessage = painted;
      port2.postMessage(0);
    });
    times.push(performance.now() - begun);
  }
  return times.sort((a, b) => a - b);
})()";

fn main() -> anyhow::Result<()> {
    let sensor = Sensor { rows: 20, cols: 20, pitch_x_mm: 3.0, pitch_y_mm: 3.0, thickness_mm: 2.5 };
    let scene = Scene::of_sensor(&sensor, "20x20");
    let contacts = random_contacts(
        &sensor,
        Draw { count: 3, shapes: Shapes::Elliptic, slip: Slip::Full, touching: false, seed: 1 },
    );
    let frame = &generate("three contacts", &sensor, scene.medium, &contacts)?;
    let result = &Golden::reference(&scene)?.run(frame)?;
    let newest = Arc::new(Newest::default());
    let (sequence, line, dropped, received_s, answered_s) = (0, 1, 0, 0.0, 0.0);
    let frames = std::slice::from_ref(frame);
    let (estimator, estimator_change) = ("search", None);
    let answer = StreamAnswer {
        sequence,
        line,
        received_s,
        answered_s,
        times_ns: &[0],
        dropped,
        estimator,
        estimator_change,
        frames,
        result,
    };
    Show::new(&newest).outcome(&Outcome::Answer(answer))?;
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let url = format!("http://{}/", listener.local_addr()?);
    let server = Server::new(&scene, "bench", newest, None);
    std::thread::spawn(move || server.run(&listener, |text| eprintln!("{text}")));
    let mut browser = Browser::open(&url);
    browser.call("Performance.enable", json!({"timeDomain": "threadTicks"}));
    let [before, measured] = PICTURES.map(|count| DRAW.replace("COUNT", &count.to_string()));
    browser.evaluate(&before);
    let begun_s = busy_s(&mut browser)?;
    let times: Vec<f64> = serde_json::from_value(browser.evaluate(&measured)).context("times of the page")?;
    let mean_ms = 1e3 * (busy_s(&mut browser)? - begun_s) / times.len() as f64;
    let median_ms = times[times.len() / 2];
    println!("20×20 taxels, page: drawn in {mean_ms:.1} ms of its thread, {median_ms:.1} ms on the clock (median)");
    ensure!(mean_ms <= MOST_MS, "a picture takes {mean_ms:.1} ms of the page's thread, more than {MOST_MS}");
    Ok(())
}

/// Processor time of the page's thread so far, in seconds.
fn busy_s(browser: &mut Browser) -> anyhow::Result<f64> {
    let answer = browser.call("Performance.getMetrics", json!({}));
    let metrics = answer["metrics"].as_array().context("metrics")?;
    let busy = metrics.iter().find(|metric| metric["name"] == "TaskDuration").context("TaskDuration")?;
    busy["value"].as_f64().context("TaskDuration")
}
