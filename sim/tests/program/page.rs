//! The report in a browser: headless Chromium opens the page in desktop and phone width, in light and dark theme. There
//! must be no console message, no missing picture, no clipped label, no horizontal overflow and no network request.
//!
//! The page has no script; a copy of it gets one that inspects the page and writes its findings into the document.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// Script that inspects the page: window, colours, pictures, labels.
const INSPECT: &str = r#"
<script>
const found = { errors: [], unseen: [], pictures: 0, drawn: 0, labels: 0, cut: [] };
addEventListener("error", event => found.errors.push(String(event.message)));
addEventListener("load", () => {
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
  found.requests = performance.getEntriesByType("resource").map(entry => entry.name);
  const out = document.createElement("pre");
  out.id = "found";
  out.textContent = JSON.stringify(found);
  document.body.append(out);
});
</script>"#;

/// Window widths of a desktop and of a phone in portrait format. Headless windows are at least 500 wide, so that the
/// phone is an inline frame in a wider window.
const DESKTOP: u32 = 1280;
const PHONE: u32 = 360;

fn dermis(work: &Path, args: &[&str]) -> Output {
    // The Verilator cache is shared with the other tests.
    let build = Path::new(env!("CARGO_MANIFEST_DIR")).join("../build");
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(work).args(args).arg("--build-dir").arg(build).output().unwrap()
}

/// The findings of [`INSPECT`] in a copy of the page.
fn inspect(work: &Path, page: &str, width: u32, dark: bool) -> Value {
    let copy = work.join("copy.html");
    fs::write(&copy, page.replacen("</head>", &format!("{INSPECT}</head>"), 1)).unwrap();
    let opened = match width {
        PHONE => framed(work, &copy),
        _ => copy,
    };
    let mut command = Command::new("chromium");
    command.args([
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        "--allow-file-access-from-files",
    ]);
    command.arg(format!("--user-data-dir={}", work.join("profile").display()));
    command.args([format!("--window-size={DESKTOP},900"), "--virtual-time-budget=10000".into(), "--dump-dom".into()]);
    // 0 is dark, 1 is light.
    command.arg(format!("--blink-settings=preferredColorScheme={}", u8::from(!dark)));
    let output = command.arg(format!("file://{}", opened.display())).output();
    let output = output.expect("chromium, which `make setup` installs");
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!messages.contains("CONSOLE"), "{messages}");
    let dom = String::from_utf8(output.stdout).unwrap();
    let found = dom.split_once("<pre id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let found = found.unwrap_or_else(|| panic!("the page did not load: {messages}")).0;
    serde_json::from_str(&found.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")).unwrap()
}

/// A page with the copy in an inline frame of phone width, into which the frame's findings are copied.
fn framed(work: &Path, copy: &Path) -> PathBuf {
    let page = work.join("phone.html");
    let text = format!(
        "<!doctype html><title>phone</title><link rel=\"icon\" href=\"data:,\">\n\
         <iframe src=\"file://{}\" width=\"{PHONE}\" height=\"800\" style=\"border:0\"></iframe>\n\
         <script>addEventListener('load', () => {{\n\
         const inside = document.querySelector('iframe').contentDocument.getElementById('found');\n\
         document.body.append(document.importNode(inside, true)); }});</script>",
        copy.display()
    );
    fs::write(&page, text).unwrap();
    page
}

#[test]
fn the_page_opens_in_desktop_and_phone_width_in_light_and_dark() {
    let work = tempfile::tempdir().unwrap();
    let report = dermis(work.path(), &["report", "eight-by-eight", "sensor-3", "--quick", "--out", "out"]);
    assert!(report.status.success(), "{}", String::from_utf8_lossy(&report.stderr));
    let page = fs::read_to_string(work.path().join("out/report.html")).unwrap();
    assert!(!page.contains("http://") && !page.contains("https://"), "the page points elsewhere");
    // Of seven frames of sensor-3 two have one contact: no picture and no median has both kinds.
    for (id, frames) in [("one", "2 frames with one contact"), ("several", "5 frames with several contacts")] {
        assert!(page.contains(&format!("sensor-3: shear error, median of {frames}")), "{frames}");
        assert!(
            page.contains(&format!("id=\"margins-{id}\"")) && page.contains(&format!("id=\"stages-sensor-3-{id}\""))
        );
    }
    let pictures = fs::read_dir(work.path().join("out/report-pictures")).unwrap().count();
    let mut backgrounds = Vec::new();
    for (width, dark) in [(DESKTOP, false), (DESKTOP, true), (PHONE, false), (PHONE, true)] {
        let found = inspect(work.path(), &page, width, dark);
        let what = format!("{width} wide, dark {dark}: {found}");
        assert_eq!(
            (&found["errors"], &found["cut"]),
            (&Value::from(Vec::<u8>::new()), &Value::from(Vec::<u8>::new())),
            "{what}"
        );
        // The first error of each table is in sight before its table is scrolled.
        assert_eq!(found["unseen"], Value::from(Vec::<u8>::new()), "{what}");
        assert_eq!(
            (found["pictures"].as_u64(), found["drawn"].as_u64()),
            (Some(pictures as u64), Some(pictures as u64)),
            "{what}"
        );
        assert_eq!(found["requests"], Value::from(Vec::<u8>::new()), "{what}");
        assert!(found["labels"].as_u64().unwrap() > 100, "{what}");
        // Wide tables scroll within the page, which itself does not.
        assert!(found["width"].as_u64() <= found["window"].as_u64(), "{what}");
        // Smallest legible text.
        assert!(found["small"].as_f64().unwrap() >= 8.0, "{what}");
        assert_ne!(found["page"], found["ink"], "{what}");
        backgrounds.push(found["page"].clone());
        assert_eq!(found["window"].as_u64() == Some(u64::from(PHONE)), width == PHONE, "{what}");
    }
    // A wide first column pushes the errors out of sight, which is found.
    let pushed = page.replace("<th>sensor</th>", "<th style=\"min-width:30rem\">sensor</th>");
    assert_ne!(inspect(work.path(), &pushed, PHONE, false)["unseen"], Value::from(Vec::<u8>::new()));
    assert_eq!((&backgrounds[0], &backgrounds[1]), (&backgrounds[2], &backgrounds[3]));
    assert_ne!(backgrounds[0], backgrounds[1]);
}
