//! `linkwright open`: which requests the server answers, and the page in a real browser.

use crate::browser::browser;
use crate::devtools::Page;
use crate::shell::TempFolder;
use proptest::test_runner::{RngAlgorithm, TestRng};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A server on a model file.
pub struct Server {
    process: Child,
    /// Host and port.
    host: String,
    /// `/TOKEN/`.
    base: String,
}

impl Server {
    pub fn start(folder: &Path, file: &str) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_linkwright"));
        command.args(["open", file, "--no-browser"]).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut process = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("Open http://").unwrap_or_else(|| panic!("{line}"));
        let (host, rest) = address.split_once('/').unwrap();
        Self { process, host: host.to_owned(), base: format!("/{rest}") }
    }

    pub fn address(&self) -> String {
        format!("http://{}{}", self.host, self.base)
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        stream
    }

    /// What the server answers to these bytes.
    fn raw(&self, bytes: &[u8]) -> String {
        let mut stream = self.connect();
        // The server may close the connection before it has read all.
        drop(stream.write_all(bytes).and_then(|()| stream.shutdown(Shutdown::Write)));
        let mut answer = vec![];
        drop(stream.read_to_end(&mut answer));
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn request(&self, method: &str, path: &str, headers: &[&str], body: &str) -> (u16, String) {
        let length = body.len();
        let mut text = format!("{method} {path} HTTP/1.1\r\nconnection: close\r\ncontent-length: {length}\r\n");
        if !headers.iter().any(|header| header.starts_with("host:")) {
            text += &format!("host: {}\r\n", self.host);
        }
        headers.iter().for_each(|header| text += &format!("{header}\r\n"));
        let answer = self.raw(format!("{text}\r\n{body}").as_bytes());
        let status = answer.get(9..12).and_then(|code| code.parse().ok()).unwrap_or(0);
        (status, answer.split_once("\r\n\r\n").map_or("", |parts| parts.1).to_owned())
    }

    fn get(&self, route: &str) -> Value {
        let (status, body) = self.request("GET", &format!("{}{route}", self.base), &[], "");
        assert_eq!(status, 200, "{route}: {body}");
        serde_json::from_str(&body).unwrap()
    }

    fn post(&self, route: &str, body: &Value) -> (u16, Value) {
        let path = format!("{}{route}", self.base);
        let (status, body) = self.request("POST", &path, &["content-type: application/json"], &body.to_string());
        (status, serde_json::from_str(&body).unwrap_or(Value::Null))
    }

    /// The server answers, and knows its model.
    fn assert_alive(&self, what: &str) {
        assert!(self.get("model")["model"]["title"].is_string(), "after {what}");
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.process.kill());
        drop(self.process.wait());
    }
}

fn start_design(model: &Value) -> Vec<f64> {
    model["model"]["variables"].as_array().unwrap().iter().map(|v| v["start"].as_f64().unwrap()).collect()
}

#[test]
fn requests_that_are_not_from_the_page_are_refused() {
    let place = TempFolder::new("open-guard");
    place.example("impact-absorber");
    std::fs::write(place.0.join("secret.txt"), "a secret").unwrap();
    let server = Server::start(&place.0, "impact-absorber.toml");
    let model = format!("{}model", server.base);
    assert_eq!(server.request("GET", &model, &[], "").0, 200);

    // Every answer, also a refusal, has the headers that bind the page to itself.
    for path in [server.base.as_str(), "/", "/favicon.ico"] {
        let answer =
            server.raw(format!("GET {path} HTTP/1.1\r\nhost: {}\r\nconnection: close\r\n\r\n", server.host).as_bytes());
        for header in
            ["default-src 'none'", "frame-ancestors 'none'", "nosniff", "no-referrer", "no-store", "same-origin"]
        {
            assert!(answer.contains(header), "{path} lacks {header}: {answer}");
        }
        assert!(!answer.contains("access-control-allow"), "{answer}");
    }

    let refused = |method: &str, path: &str, headers: &[&str]| {
        let (status, body) = server.request(method, path, headers, "");
        assert!((400..500).contains(&status), "{method} {path} {headers:?}: {status}");
        assert!(!body.contains("absorber") && !body.contains("secret"), "{path}: {body}");
        status
    };
    // Without the token, or with another one.
    let other = format!("/{}/", "0".repeat(server.base.len() - 2));
    for token in ["/", "//", &other, &server.base[..10], &server.base.to_uppercase()] {
        refused("GET", &format!("{token}model"), &[]);
        refused("POST", &format!("{token}analyze"), &["content-type: application/json"]);
    }
    // From other sites, and by host names that lead here.
    for header in
        ["origin: http://evil.example", "origin: null", "sec-fetch-site: cross-site", "sec-fetch-site: same-site"]
    {
        assert_eq!(refused("GET", &model, &[header]), 403, "{header}");
    }
    let port = server.host.split(':').nth(1).unwrap();
    for host in ["evil.example", &format!("evil.example:{port}"), &format!("localhost:{port}"), "127.0.0.1"] {
        assert_eq!(refused("GET", &model, &[&format!("host: {host}")]), 421, "{host}");
    }
    // A form of another site can send text, and no JSON.
    assert_eq!(refused("POST", &format!("{}cancel", server.base), &["content-type: text/plain"]), 415);
    // Paths that lead to files.
    for path in [
        "../secret.txt",
        "%2e%2e/secret.txt",
        "..%2fsecret.txt",
        "/etc/passwd",
        "secret.txt",
        "impact-absorber.toml",
        ".//",
        "model/../secret.txt",
        "%00",
        "style.css/../../secret.txt",
    ] {
        refused("GET", &format!("{}{path}", server.base), &[]);
    }
    for method in ["PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "HEAD"] {
        refused(method, &model, &[]);
    }
    server.assert_alive("refused requests");
    // Nothing was written.
    let mut names: Vec<String> =
        std::fs::read_dir(&place.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["impact-absorber.toml", "secret.txt"]);
}

#[test]
fn malformed_large_and_many_requests_leave_the_server_running() {
    let place = TempFolder::new("open-many");
    place.example("impact-absorber");
    let server = Server::start(&place.0, "impact-absorber.toml");
    let good = format!(
        "POST {}analyze HTTP/1.1\r\nhost: {}\r\ncontent-type: application/json\r\ncontent-length: 90\r\n\r\n",
        server.base, server.host
    );
    let body = r#"{"page":"a","revision":1,"design":[0.5,0.5],"derivatives":false}"#;
    let whole = format!("{good}{body:<90}");
    let mut rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut counts = std::collections::BTreeMap::new();
    for k in 0..1000 {
        let mut bytes = whole.clone().into_bytes();
        for _ in 0..=rng.next_u32() % 8 {
            let at = rng.next_u32() as usize % bytes.len();
            match rng.next_u32() % 4 {
                0 => bytes[at] = rng.next_u32() as u8,
                1 => bytes.truncate(at.max(1)),
                2 => bytes.insert(at, rng.next_u32() as u8),
                _ => bytes.extend_from_within(at..),
            }
        }
        let answer = server.raw(&bytes);
        *counts.entry(answer.get(9..12).unwrap_or("closed").to_owned()).or_insert(0) += 1;
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 "), "{k}: {answer}");
        assert!(!answer.starts_with("HTTP/1.1 5"), "{k}: {answer}");
    }
    assert!(counts["400"] > 100, "{counts:?}");
    server.assert_alive("malformed requests");

    // JSON with wrong content.
    for wrong in [
        json!({}),
        json!([]),
        json!({ "page": "a", "revision": 1, "design": [0.5], "derivatives": true, "more": 1 }),
        json!({ "page": "x".repeat(65), "revision": 1, "design": [], "derivatives": true }),
    ] {
        assert_eq!(server.post("analyze", &wrong).0, 400, "{wrong}");
    }
    let revision = server.get("model")["revision"].clone();
    for design in [json!([]), json!([0.5]), json!([0.5, 0.5, 0.5]), json!([1e300, 0.5]), json!([-1.0, 0.5])] {
        let (status, answer) = server
            .post("analyze", &json!({ "page": "a", "revision": revision, "design": design, "derivatives": true }));
        assert!(status == 200 && answer["error"].is_string(), "{design}: {status} {answer}");
    }

    // 100 MB: refused by its length, and while it arrives.
    let head = |length: &str| {
        format!(
            "POST {}analyze HTTP/1.1\r\nhost: {}\r\ncontent-type: application/json\r\n{length}\r\n\r\n",
            server.base, server.host
        )
    };
    let mut stream = server.connect();
    drop(stream.write_all(head("content-length: 104857600").as_bytes()));
    let part = vec![b' '; 1 << 20];
    let sent = (0..100).take_while(|_| stream.write_all(&part).is_ok()).count();
    assert!(sent < 100, "all of 100 MB was read");
    let mut stream = server.connect();
    drop(stream.write_all(head("transfer-encoding: chunked").as_bytes()));
    let chunk = [format!("{:x}\r\n", part.len()).as_bytes(), &part, b"\r\n"].concat();
    let sent = (0..100).take_while(|_| stream.write_all(&chunk).is_ok()).count();
    assert!(sent < 100, "all of 100 MB was read");
    let long = format!("GET {} HTTP/1.1\r\nhost: {}\r\nx: {}\r\n\r\n", server.base, server.host, "y".repeat(1 << 20));
    assert!(!server.raw(long.as_bytes()).starts_with("HTTP/1.1 200"));
    server.assert_alive("large requests");

    // A thousand connections at once that say nothing; then they leave.
    let open: Vec<TcpStream> = (0..1000).filter_map(|_| TcpStream::connect(&server.host).ok()).collect();
    assert!(open.len() > 500, "{}", open.len());
    drop(open);
    // A thousand requests from many threads: each is answered or told to come again.
    let statuses: Vec<u16> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..50)
            .map(|_| {
                scope.spawn(|| {
                    (0..20)
                        .map(|_| server.request("GET", &format!("{}model", server.base), &[], "").0)
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    assert!(statuses.iter().all(|status| [0, 200, 503].contains(status)), "{statuses:?}");
    assert!(statuses.iter().filter(|status| **status == 200).count() > 100);
    std::thread::sleep(Duration::from_millis(500));
    server.assert_alive("a thousand at once");
}

/// Analyses of two pages do not disturb each other; an old revision is outdated; a file that changes is read again.
#[test]
fn the_file_is_the_truth_and_pages_are_independent() {
    let place = TempFolder::new("open-truth");
    place.example("impact-absorber");
    let server = Server::start(&place.0, "impact-absorber.toml");
    let model = server.get("model");
    let analyze = |page: &str, revision: &Value, design: &[f64]| {
        server.post("analyze", &json!({ "page": page, "revision": revision, "design": design, "derivatives": true }))
    };
    let design = start_design(&model);
    std::thread::scope(|scope| {
        let ask = |page: &'static str, k: f64| {
            scope.spawn({
                let (analyze, model) = (&analyze, &model);
                move || analyze(page, &model["revision"], &[k, 0.3])
            })
        };
        let (one, two) = (ask("one", 0.4), ask("two", 0.8));
        let [one, two] = [one, two].map(|thread| thread.join().unwrap());
        assert_eq!((one.0, one.1["design"][0].as_f64()), (200, Some(0.4)));
        assert_eq!((two.0, two.1["design"][0].as_f64()), (200, Some(0.8)));
    });
    let (status, record) = analyze("one", &model["revision"], &design);
    assert_eq!(status, 200, "{record}");
    // The objective is what the command prints.
    let printed: Value = serde_json::from_str(&place.run(&["analyze", "impact-absorber", "--json"], 0)).unwrap();
    assert_eq!(record["objective"], printed["objective"]["value"]);
    assert_eq!(record["constraints"][0]["margin"], printed["constraints"][0]["margin"]);

    // An edit elsewhere: first a wrong one, then a right one.
    let text = place.read("impact-absorber.toml");
    let edit = |new: &str| {
        let before = server.get("model")["news"].as_u64().unwrap();
        std::fs::write(place.0.join("impact-absorber.toml"), new).unwrap();
        let news = server.get(&format!("news?after={before}"));
        assert!(news["number"].as_u64().unwrap() > before);
        server.get("model")
    };
    let wrong = edit(&text.replace("at_most = 1.0", "at_mots = 1.0"));
    assert_eq!((&wrong["revision"], wrong["errors"].as_array().unwrap().len()), (&model["revision"], 1));
    let line = 1 + text[..text.find("at_most = 1.0").unwrap()].matches('\n').count();
    assert_eq!(wrong["errors"][0]["line"], line, "{wrong}");
    // The model in force is still the last good one.
    assert_eq!(analyze("one", &model["revision"], &design).1["objective"], record["objective"]);
    let right = edit(&text.replace("at_most = 1.0", "at_most = 0.9"));
    assert!(right["errors"].as_array().unwrap().is_empty());
    assert_ne!(right["revision"], model["revision"]);
    assert_eq!(analyze("one", &model["revision"], &design).0, 409);
    let margin = |record: &Value| record["constraints"][0]["margin"].as_f64().unwrap();
    let now = analyze("one", &right["revision"], &design).1;
    assert!((margin(&record) - margin(&now) - 0.1).abs() < 1e-12);
}

/// An analysis that takes long ends when a newer request of its page comes, or when it is cancelled; the server goes on.
#[test]
fn a_long_analysis_is_stopped() {
    let place = TempFolder::new("open-long");
    place.example("impact-absorber");
    let long = place.read("impact-absorber.toml").replace("points = 101", "points = 400001");
    std::fs::write(place.0.join("long.toml"), long).unwrap();
    let server = Server::start(&place.0, "long.toml");
    let model = server.get("model");
    let ask = |k: f64| {
        server.post(
            "analyze",
            &json!({ "page": "p", "revision": model["revision"], "design": [k, 0.3], "derivatives": true }),
        )
    };
    std::thread::scope(|scope| {
        let old = scope.spawn(|| ask(0.4));
        std::thread::sleep(Duration::from_millis(400));
        let new = scope.spawn(|| ask(0.5));
        assert_eq!(old.join().unwrap().0, 409);
        std::thread::sleep(Duration::from_millis(400));
        assert_eq!(server.post("cancel", &json!({ "page": "p" })).0, 200);
        assert_eq!(new.join().unwrap().0, 409);
    });
    server.assert_alive("stopped analyses");
}

/// Drags a slider: the margin changes, first the approximation, then the analysis; both agree for a small step.
#[test]
fn a_slider_moves_the_mechanism_and_its_margins() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("open-play");
    place.example("shaper");
    let server = Server::start(&place.0, "shaper.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1000]);
    page.show(&server.address());
    let settled = "document.documentElement.dataset.settled?.endsWith('differentiated')";
    page.wait(settled);
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
    let margins = "[...document.querySelectorAll('.margin')].map((e) => Number(e.dataset.margin))";
    let read = |page: &mut Page| -> Vec<f64> { serde_json::from_value(page.value(margins)).unwrap() };
    let before = read(&mut page);
    assert!(!before.is_empty());

    // The mechanism moves by itself, and the keyboard steps it.
    let frame = page.text("document.querySelector('#stage svg').dataset.frame");
    page.wait(&format!("document.querySelector('#stage svg').dataset.frame != {frame:?}"));

    // While the mouse holds the slider, the approximation is shown as what it is.
    let sliders = page.value("document.querySelectorAll('#sliders input[type=range]').length").as_u64().unwrap();
    assert!(sliders > 1);
    let from = page.middle("#sliders input[type=range]");
    page.value("(() => { const e = document.querySelector('#sliders input[type=range]'); const b = e.getBoundingClientRect(); \
        const part = (e.value - e.min) / (e.max - e.min); window.thumb = b.left + 8 + part * (b.width - 16); return 0; })()");
    let thumb = [page.value("window.thumb").as_f64().unwrap(), from[1]];
    let value = "Number(document.querySelector('#sliders input[type=range]').value)";
    let old = page.value(value).as_f64().unwrap();
    page.mouse("mousePressed", thumb);
    page.mouse("mouseMoved", [thumb[0] + 12.0, thumb[1]]);
    page.wait("document.querySelector('.margin[data-predicted]')");
    assert!(page.text("document.getElementById('legend').textContent").contains("approximation"));
    page.mouse("mouseReleased", [thumb[0] + 12.0, thumb[1]]);
    let moved = page.value(value).as_f64().unwrap();
    assert_ne!(moved, old);
    page.wait(&format!("{settled} && Number(document.documentElement.dataset.answered) > 1"));
    page.wait("!document.querySelector('.margin[data-predicted]')");
    let after = read(&mut page);
    assert!(before.iter().zip(&after).any(|(a, b)| a != b), "{before:?} and {after:?}");
    // The margins are those that the command computes.
    let name = page.text("document.querySelector('#sliders input[type=range]').dataset.variable");
    let at: f64 = page.value("Number(document.querySelector('#sliders input[type=number]').value)").as_f64().unwrap();
    let printed: Value =
        serde_json::from_str(&place.run(&["analyze", "shaper", "--json", "--at", &format!("{name}={at}")], 0)).unwrap();
    for (k, margin) in after.iter().enumerate() {
        let exact = printed["constraints"][k]["margin"].as_f64().unwrap();
        assert!((margin - exact).abs() <= 1e-5 * exact.abs().max(1e-3), "{margin} and {exact}");
    }

    // What the variable moves, with the keyboard; a pinned design stays in the table.
    page.value("document.querySelector('#sliders input[type=range]').focus()");
    page.wait("document.querySelectorAll('#bars .bar').length > 0 && document.querySelector('#stage .arrows path')");
    page.click("#pin");
    assert_eq!(page.value("document.querySelectorAll('#pins tbody tr').length"), 1);
    page.click("#reset");
    page.wait(&format!("{value} === {old}"));
    page.wait(settled);
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");

    // A file with an error, and the design on the sliders stays.
    let text = place.read("shaper.toml");
    std::fs::write(place.0.join("shaper.toml"), text.replacen("[design]", "[desing]", 1)).unwrap();
    page.wait("!document.getElementById('fault').hidden");
    assert!(page.text("document.getElementById('fault').textContent").contains("shaper.toml:"));
    std::fs::write(place.0.join("shaper.toml"), &text).unwrap();
    page.wait("document.getElementById('fault').hidden");

    // On a phone nothing is wider than the screen.
    let mut phone = Page::open(&program, &place.0, [390, 800]);
    phone.show(&server.address());
    phone.wait(settled);
    assert_eq!(phone.value("document.documentElement.scrollWidth > innerWidth"), false);
    if let Some(folder) = std::env::var_os("APP_PICTURES") {
        let folder = Path::new(&folder);
        for scheme in ["light", "dark"] {
            page.scheme(scheme);
            page.value("document.querySelector('#sliders input[type=range]').focus()");
            page.picture(&folder.join(format!("open-{scheme}.png")), true);
            phone.scheme(scheme);
            phone.picture(&folder.join(format!("open-phone-{scheme}.png")), false);
        }
    }
}
