//! A browser driven over the DevTools protocol, through two pipes of the system.

use serde_json::{Value, json};
use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest wait for an answer or a condition; the machine may be busy.
const WAIT: Duration = Duration::from_secs(60);

/// A browser with one page.
pub struct Page {
    browser: Child,
    input: File,
    messages: Receiver<Value>,
    events: VecDeque<Value>,
    session: String,
    number: u64,
}

impl Page {
    /// Starts a browser with an empty page of this size. The folder receives its profile.
    pub fn open(program: &Path, folder: &Path, [width, height]: [u32; 2]) -> Self {
        let name = |what: &str| -> PathBuf { folder.join(format!("{what}-{width}")) };
        let (to, from) = (name("to-browser"), name("from-browser"));
        let made = Command::new("mkfifo").args([&to, &from]).status().unwrap();
        assert!(made.success(), "mkfifo failed");
        // The browser reads commands from descriptor 3 and writes answers to descriptor 4.
        let browser = Command::new("sh")
            .args(["-c", r#"to="$1"; from="$2"; shift 2; exec "$@" 3<"$to" 4>"$from""#, "sh"])
            .args([to.as_os_str(), from.as_os_str(), program.as_os_str()])
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"])
            .args(["--disable-component-update", "--disable-dev-shm-usage", "--hide-scrollbars", "--mute-audio"])
            .args(["--remote-debugging-pipe", "--force-device-scale-factor=1"])
            .arg(format!("--user-data-dir={}", name("profile").display()))
            .arg(format!("--window-size={width},{height}"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let input = File::options().write(true).open(&to).unwrap();
        let output = BufReader::new(File::open(&from).unwrap());
        let (sender, messages) = channel();
        std::thread::spawn(move || {
            for text in output.split(0).map_while(Result::ok) {
                if sender.send(serde_json::from_slice(&text).unwrap()).is_err() {
                    return;
                }
            }
        });
        let mut page = Self { browser, input, messages, events: VecDeque::new(), session: String::new(), number: 0 };
        let target = page.call("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let attached = page.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        page.session = attached["sessionId"].as_str().unwrap().to_owned();
        page.call("Page.enable", json!({}));
        page.resize([width, height]);
        page
    }

    /// Gives the page the size of a window, or of a phone.
    fn resize(&mut self, [width, height]: [u32; 2]) {
        let phone = width < 600;
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// Sends a command and returns its result.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.number += 1;
        let mut message = json!({ "id": self.number, "method": method, "params": parameters });
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        write!(self.input, "{message}\0").unwrap();
        self.input.flush().unwrap();
        loop {
            let mut answer = self.messages.recv_timeout(WAIT).unwrap_or_else(|e| panic!("{method}: {e}"));
            if answer["id"] == self.number {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].take();
            }
            self.events.push_back(answer);
            self.events.truncate(1000);
        }
    }

    /// Shows an address.
    pub fn show(&mut self, address: &str) {
        self.call("Page.navigate", json!({ "url": address }));
    }

    /// Dark or light colours.
    pub fn scheme(&mut self, name: &str) {
        let features = json!([{ "name": "prefers-color-scheme", "value": name }]);
        self.call("Emulation.setEmulatedMedia", json!({ "features": features }));
    }

    /// The value of an expression in the page.
    pub fn value(&mut self, expression: &str) -> Value {
        let wanted = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let mut result = self.call("Runtime.evaluate", wanted);
        assert!(result.get("exceptionDetails").is_none(), "{expression}: {result}");
        result["result"]["value"].take()
    }

    /// A text of the page.
    pub fn text(&mut self, expression: &str) -> String {
        let value = self.value(expression);
        value.as_str().map_or_else(|| value.to_string(), str::to_owned)
    }

    /// Waits until an expression is true.
    pub fn wait(&mut self, expression: &str) {
        let begin = Instant::now();
        // Before the page is there, the expression may have nothing to read.
        let tried = format!("(() => {{ try {{ return Boolean({expression}); }} catch {{ return false; }} }})()");
        while self.value(&tried) != true {
            if begin.elapsed() > WAIT {
                let state = self.text("document.querySelector('header') && JSON.stringify({...document.documentElement.dataset}) + document.querySelector('header').innerText");
                panic!("never: {expression}\n{state}");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The middle of an element on the screen, after it was scrolled into view.
    pub fn middle(&mut self, selector: &str) -> [f64; 2] {
        let expression = format!(
            "(() => {{ const e = document.querySelector({selector:?}); e.scrollIntoView({{ block: 'center', behavior: 'instant' }}); \
             const b = e.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; }})()"
        );
        let found: Vec<f64> = serde_json::from_value(self.value(&expression)).unwrap();
        [found[0] + found[2] / 2.0, found[1] + found[3] / 2.0]
    }

    /// Presses, moves or releases the mouse.
    pub fn mouse(&mut self, kind: &str, [x, y]: [f64; 2]) {
        let buttons = i32::from(kind != "mouseReleased");
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Presses and releases the mouse on an element that has come to rest. An analysis that ends meanwhile may still move it from under the mouse, and
    /// a button may not be enabled yet: then it is pressed again.
    pub fn click(&mut self, selector: &str) {
        let begin = Instant::now();
        let listen = format!(
            "(() => {{ window.wasPressed = false; document.querySelector({selector:?}).addEventListener('click', () => {{ \
             window.wasPressed = true; }}, {{ once: true }}); return 0; }})()"
        );
        let mut before = None;
        while begin.elapsed() < WAIT {
            let at = self.middle(selector);
            // A press beside a point chooses its neighbour, which may then cover it.
            if before.replace(at) == Some(at) {
                self.value(&listen);
                self.mouse("mousePressed", at);
                self.mouse("mouseReleased", at);
                if self.value("window.wasPressed") == true {
                    return;
                }
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("{selector} cannot be pressed");
    }

    /// Drags the mouse in ten steps.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.mouse("mousePressed", from);
        for step in 1..=10 {
            let part = f64::from(step) / 10.0;
            self.mouse("mouseMoved", [0, 1].map(|k| from[k] + part * (to[k] - from[k])));
        }
        self.mouse("mouseReleased", to);
    }

    /// Waits for ten frames of the screen: the page draws in the frames after a change.
    pub fn drawn(&mut self) {
        let frame = "new Promise((done) => requestAnimationFrame(() => done(0)))";
        self.value(&format!("(async () => {{ for (let k = 0; k < 10; k++) await {frame}; return 0; }})()"));
    }

    /// Pictures of a view, which begins with an element: on a desktop and on a phone, in light and dark colours. They are written to the
    /// folder APP_PICTURES; without it there are none. Nothing is wider than the screen.
    pub fn views(&mut self, name: &str, selector: &str) {
        for (device, size) in [("desktop", [1400, 1000]), ("phone", [390, 800])] {
            self.resize(size);
            for scheme in ["light", "dark"] {
                self.scheme(scheme);
                self.value(&format!("document.querySelector({selector:?}).scrollIntoView({{ behavior: 'instant' }})"));
                self.drawn();
                assert_eq!(self.value("document.documentElement.scrollWidth > innerWidth"), false, "{name}, {device}");
                if let Some(folder) = std::env::var_os("APP_PICTURES") {
                    let taken = self.call("Page.captureScreenshot", json!({ "format": "webp", "quality": 70 }));
                    let file = Path::new(&folder).join(format!("{name}-{device}-{scheme}.webp"));
                    std::fs::write(file, decoded(taken["data"].as_str().unwrap())).unwrap();
                }
            }
        }
        self.scheme("light");
        self.resize([1400, 1200]);
    }
}

/// The bytes of a text in base 64.
fn decoded(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u32> = text.bytes().filter(|c| *c != b'=').map(|c| u32::from(digit(c))).collect();
    let group = |part: &[u32]| {
        let bits = part.iter().enumerate().fold(0, |bits, (k, d)| bits | d << (18 - 6 * k));
        bits.to_be_bytes()[1..part.len()].to_vec()
    };
    digits.chunks(4).flat_map(group).collect()
}

impl Drop for Page {
    fn drop(&mut self) {
        drop(self.browser.kill());
        drop(self.browser.wait());
    }
}
