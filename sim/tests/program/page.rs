//! The report in a browser: headless Chromium opens the page in desktop and phone width, in light and dark theme. There
//! must be no console message, no missing picture, no clipped label, no horizontal overflow and no network request.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::{json, Value};

use super::browser::{Browser, DESKTOP, PHONE};

/// What is seen of the page: window, colours, pictures, labels.
const INSPECT: &str = r#"
(() => {
  const found = { unseen: [], pictures: 0, drawn: 0, labels: 0, cut: [] };
  document.querySelectorAll("details").forEach(details => { details.open = true; });
  for (const figure of document.querySelectorAll("figure")) {
    found.pictures += 1;
    const svg = figure.querySelector("svg"), box = svg.getBoundingClientRect();
    if (box.width > 100 && box.height > 50 && svg.querySelectorAll("rect,circle,polyline,polygon").length > 3) {
      found.drawn += 1;
    }
    for (const text of svg.querySelectorAll("text")) {
      const own = text.getBoundingClientRect();
      found.labels += 1;
      if (own.left < box.left - 1 || own.right > box.right + 1 || own.top < box.top - 1 || own.bottom > box.bottom + 1) {
        found.cut.push(figure.id + ": " + text.textContent.trim());
      }
    }
  }
  for (const head of document.querySelectorAll("table")) {
    const error = [...head.querySelectorAll("th")].find(cell => cell.textContent.includes("error"));
    if (error && error.getBoundingClientRect().right > innerWidth) found.unseen.push(head.id);
  }
  const style = getComputedStyle(document.body);
  found.page = style.backgroundColor;
  found.ink = style.color;
  found.window = innerWidth;
  found.width = document.documentElement.scrollWidth;
  found.small = Math.min(...[...document.querySelectorAll("svg text")].map(text => text.getBoundingClientRect().height));
  return found;
})()"#;

fn dermis(work: &Path, args: &[&str]) -> Output {
    // The Verilator cache is shared with the other tests.
    let build = Path::new(env!("CARGO_MANIFEST_DIR")).join("../build");
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(work).args(args).arg("--build-dir").arg(build).output().unwrap()
}

/// The findings of [`INSPECT`] at a width, in light or dark.
fn inspect(browser: &mut Browser, width: u32, dark: bool) -> Value {
    browser.set(width, dark);
    browser.evaluate(INSPECT)
}

#[test]
fn the_page_opens_in_desktop_and_phone_width_in_light_and_dark() {
    let work = tempfile::tempdir().unwrap();
    let report = dermis(work.path(), &["report", "eight-by-eight", "sensor-3", "--quick", "--out", "out"]);
    assert!(report.status.success(), "{}", String::from_utf8_lossy(&report.stderr));
    let path = work.path().join("out/report.html");
    let page = fs::read_to_string(&path).unwrap();
    assert!(!page.contains("http://") && !page.contains("https://"), "the page points elsewhere");
    // Of seven frames of sensor-3 two have one contact: no picture and no median has both kinds.
    for (id, frames) in [("one", "2 frames with one contact"), ("several", "5 frames with several contacts")] {
        assert!(page.contains(&format!("sensor-3: shear error, median of {frames}")), "{frames}");
        assert!(
            page.contains(&format!("id=\"margins-{id}\"")) && page.contains(&format!("id=\"stages-sensor-3-{id}\""))
        );
    }
    let pictures = fs::read_dir(work.path().join("out/report-pictures")).unwrap().count();
    let url = format!("file://{}", path.display());
    let mut browser = Browser::open(&url);
    browser.call("Network.enable", json!({}));
    browser.go(&url);
    let mut backgrounds = Vec::new();
    for (width, dark) in [(DESKTOP, false), (DESKTOP, true), (PHONE, false), (PHONE, true)] {
        let found = inspect(&mut browser, width, dark);
        let what = format!("{width} wide, dark {dark}: {found}");
        assert_eq!(found["cut"], Value::from(Vec::<u8>::new()), "{what}");
        // The first error of each table is in sight before its table is scrolled.
        assert_eq!(found["unseen"], Value::from(Vec::<u8>::new()), "{what}");
        assert_eq!(
            (found["pictures"].as_u64(), found["drawn"].as_u64()),
            (Some(pictures as u64), Some(pictures as u64)),
            "{what}"
        );
        assert!(found["labels"].as_u64().unwrap() > 100, "{what}");
        // Wide tables scroll within the page, which itself does not.
        assert!(found["width"].as_u64() <= found["window"].as_u64(), "{what}");
        // Smallest legible text.
        assert!(found["small"].as_f64().unwrap() >= 8.0, "{what}");
        assert_ne!(found["page"], found["ink"], "{what}");
        backgrounds.push(found["page"].clone());
        assert_eq!(found["window"], width, "{what}");
    }
    assert_eq!((&browser.problems, &browser.requests), (&Vec::<Value>::new(), &vec![url]));
    // A wide first column pushes the errors out of sight, which is found, as are a cut label, a request and a script's
    // error.
    let worse = work.path().join("out/worse.html");
    let mut pushed = page.replace("<th>sensor</th>", "<th style=\"min-width:30rem\">sensor</th>");
    pushed = pushed.replacen("<text ", "<text style=\"font-size:60px\" ", 1);
    pushed = pushed.replacen("</body>", "<img src=\"absent.png\" alt=\"\"><script>absent()</script></body>", 1);
    fs::write(&worse, pushed).unwrap();
    browser.go(&format!("file://{}", worse.display()));
    let found = inspect(&mut browser, PHONE, false);
    for part in ["unseen", "cut"] {
        assert_ne!(found[part], Value::from(Vec::<u8>::new()), "{part}: {found}");
    }
    assert!(browser.requests.iter().any(|url| url.ends_with("/absent.png")), "{:?}", browser.requests);
    assert!(browser.problems.iter().any(|problem| problem.to_string().contains("absent is not defined")));
    assert_eq!((&backgrounds[0], &backgrounds[1]), (&backgrounds[2], &backgrounds[3]));
    assert_ne!(backgrounds[0], backgrounds[1]);
}
