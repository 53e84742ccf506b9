//! Headless Chromium over the pipe of its DevTools protocol: commands and answers are JSON, each ended by a zero byte.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::fs::{mknodat, FileType, Mode, CWD};
use serde_json::{json, Value};

/// Longest wait for something to appear on a page.
const PATIENCE: Duration = Duration::from_secs(30);
/// Window width of a desktop.
pub const DESKTOP: u32 = 1280;
/// Window width of a phone in portrait format.
pub const PHONE: u32 = 360;

/// A browser with one page.
pub struct Browser {
    child: Child,
    commands: File,
    messages: BufReader<File>,
    sent: u64,
    session: Option<String>,
    /// Console messages and errors of the page so far.
    pub problems: Vec<Value>,
    /// Addresses that pages have requested since the domain `Network` is enabled, without data within the page.
    pub requests: Vec<String>,
    _work: tempfile::TempDir,
}

impl Browser {
    /// Opens a page.
    pub fn open(url: &str) -> Browser {
        let work = tempfile::tempdir().unwrap();
        let [commands, messages] = ["commands", "messages"].map(|name| work.path().join(name));
        for pipe in [&commands, &messages] {
            mknodat(CWD, pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        }
        // Chromium has the protocol's pipes as its descriptors 3 and 4.
        let script = "exec chromium --headless --no-sandbox --disable-gpu --remote-debugging-pipe \
                      --user-data-dir=\"$0\" about:blank 3<\"$1\" 4>\"$2\"";
        let mut command = Command::new("sh");
        command.arg("-c").arg(script).args([&work.path().join("profile"), &commands, &messages]);
        let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        // In the order in which the shell opens their other ends.
        let commands = File::options().write(true).open(commands).unwrap();
        let messages = BufReader::new(File::open(messages).unwrap());
        let (problems, requests, session, sent) = (Vec::new(), Vec::new(), None, 0);
        let mut browser = Browser { child, commands, messages, sent, session, problems, requests, _work: work };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}))["targetId"].clone();
        let attached = browser.call("Target.attachToTarget", json!({"targetId": target, "flatten": true}));
        browser.session = Some(attached["sessionId"].as_str().unwrap().to_owned());
        for domain in ["Runtime.enable", "Log.enable", "Page.enable"] {
            browser.call(domain, json!({}));
        }
        browser.go(url);
        browser
    }

    /// Opens another page, or the same again.
    pub fn go(&mut self, url: &str) {
        self.call("Page.navigate", json!({"url": url}));
        self.wait_for(&format!("document.readyState == 'complete' && location.href == '{url}'"));
    }

    /// Sets the width of the window, and whether the user has asked for a dark theme; the narrow one is a phone's.
    pub fn set(&mut self, width: u32, dark: bool) {
        let (scheme, mobile) = (if dark { "dark" } else { "light" }, width == PHONE);
        let size = json!({"width": width, "height": 780, "deviceScaleFactor": 1, "mobile": mobile});
        self.call("Emulation.setDeviceMetricsOverride", size);
        let media = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
        self.call("Emulation.setEmulatedMedia", media);
    }

    /// The result of a command.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.sent += 1;
        let mut command = json!({"id": self.sent, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            command["sessionId"] = session.as_str().into();
        }
        self.commands.write_all(format!("{command}\0").as_bytes()).unwrap();
        loop {
            let mut message = Vec::new();
            let bytes = self.messages.read_until(0, &mut message).unwrap();
            assert!(bytes > 0, "chromium, which `make setup` installs, has ended");
            let message: Value = serde_json::from_slice(&message[..bytes - 1]).unwrap();
            if message["id"] == self.sent {
                assert_eq!(message["error"], Value::Null, "{method}");
                return message["result"].clone();
            }
            let event = message["method"].as_str().unwrap_or_default();
            if ["Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"].contains(&event) {
                self.problems.push(message["params"].clone());
            }
            let address = message["params"]["request"]["url"].as_str().filter(|_| event == "Network.requestWillBeSent");
            self.requests.extend(address.filter(|address| !address.starts_with("data:")).map(str::to_owned));
        }
    }

    /// The value of an expression in the page, awaited.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let parameters = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let answer = self.call("Runtime.evaluate", parameters);
        assert_eq!(answer["exceptionDetails"], Value::Null, "{expression}");
        answer["result"]["value"].clone()
    }

    /// Waits until an expression in the page is true.
    pub fn wait_for(&mut self, expression: &str) {
        let begun = Instant::now();
        while self.evaluate(expression) != true {
            if begun.elapsed() > PATIENCE {
                let shown = self.evaluate("document.body.innerText");
                panic!("not within {PATIENCE:?}: {expression}; the page shows {shown}");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Ends its child processes too; killed if it does not answer.
        let close = json!({"id": 0, "method": "Browser.close"});
        let sent = self.commands.write_all(format!("{close}\0").as_bytes());
        let begun = Instant::now();
        while sent.is_ok() && matches!(self.child.try_wait(), Ok(None)) && begun.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
