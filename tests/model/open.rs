//! `linkwright open`: which requests the server answers, and the page in a real browser.

use crate::browser::browser;
use crate::devtools::Page;
use crate::shell::TempFolder;
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Condition of a page that shows an analysis with its derivatives.
pub const SETTLED: &str = "document.documentElement.dataset.settled?.endsWith('differentiated')";

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
        Self::start_with(folder, file, &[])
    }

    fn start_with(folder: &Path, file: &str, options: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_linkwright"));
        command
            .args(["open", file, "--no-browser"])
            .args(options)
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
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

    /// The answer of the server to these bytes; `is_all` closes this direction after them, as if the client had ended.
    fn raw(&self, bytes: &[u8], is_all: bool) -> String {
        let mut stream = self.connect();
        // The server may close the connection before it has read all.
        drop(stream.write_all(bytes));
        if is_all {
            drop(stream.shutdown(Shutdown::Write));
        }
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
        let answer = self.raw(format!("{text}\r\n{body}").as_bytes(), false);
        let status = answer.get(9..12).and_then(|code| code.parse().ok()).unwrap_or(0);
        (status, answer.split_once("\r\n\r\n").map_or("", |parts| parts.1).to_owned())
    }

    pub fn get(&self, route: &str) -> Value {
        let (status, body) = self.request("GET", &format!("{}{route}", self.base), &[], "");
        assert_eq!(status, 200, "{route}: {body}");
        serde_json::from_str(&body).unwrap()
    }

    pub fn post(&self, route: &str, body: &Value) -> (u16, Value) {
        let path = format!("{}{route}", self.base);
        let (status, body) = self.request("POST", &path, &["content-type: application/json"], &body.to_string());
        (status, serde_json::from_str(&body).unwrap_or(Value::Null))
    }

    /// Sends an action to the run.
    pub fn act(&self, action: &Value) {
        assert_eq!(self.post("run", action).0, 200, "{action}");
    }

    /// The answer to a request for an analysis.
    fn analyze(&self, page: &str, revision: &Value, design: &Value, derivatives: bool) -> (u16, Value) {
        let request = json!({ "page": page, "revision": revision, "design": design, "derivatives": derivatives });
        self.post("analyze", &request)
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

/// Draws a limit on the first history, which becomes a constraint. Returns the number of constraints.
pub fn draw_limit(page: &mut Page) -> u64 {
    let count = 1 + page.value("document.querySelectorAll('.margin').length").as_u64().unwrap();
    page.click(".plot .tools button");
    let [x, y] = page.middle(".plot svg");
    page.drag([x - 60.0, y], [x + 60.0, y]);
    page.wait(&format!("document.querySelectorAll('.margin').length === {count}"));
    count
}

/// Output of `linkwright analyze --json`.
pub fn analyzed(place: &TempFolder, arguments: &[&str]) -> Value {
    serde_json::from_str(&place.run(&[&["analyze", "--json"][..], arguments].concat(), 0)).unwrap()
}

/// A folder with an example, and a server on this example.
pub fn served(folder: &str, example: &str) -> (TempFolder, Server) {
    let place = TempFolder::new(folder);
    place.example(example);
    let server = Server::start(&place.0, &format!("{example}.toml"));
    (place, server)
}

/// An example in a browser, once it is analysed; `None` without a browser.
pub fn shown(folder: &str, example: &str, size: [u32; 2]) -> Option<(TempFolder, Server, Page)> {
    let program = browser()?;
    let (place, server) = served(folder, example);
    let mut page = Page::open(&program, &place.0, size);
    page.show(&server.address());
    page.wait(SETTLED);
    Some((place, server, page))
}

pub fn start_design(model: &Value) -> Vec<f64> {
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
        let answer = server.raw(
            format!("GET {path} HTTP/1.1\r\nhost: {}\r\nconnection: close\r\n\r\n", server.host).as_bytes(),
            false,
        );
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
    let (_place, server) = served("open-many", "impact-absorber");
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
        let answer = server.raw(&bytes, true);
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
        let (status, answer) = server.analyze("a", &revision, &design, true);
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
    assert!(!server.raw(long.as_bytes(), true).starts_with("HTTP/1.1 200"));
    server.assert_alive("large requests");

    // A thousand connections at once that say nothing; then they leave.
    let open: Vec<TcpStream> = (0..1000).filter_map(|_| TcpStream::connect(&server.host).ok()).collect();
    assert!(open.len() > 500, "{}", open.len());
    drop(open);
    // A thousand requests from many threads: each is answered, or asked to retry later.
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
    let (place, server) = served("open-truth", "impact-absorber");
    let model = server.get("model");
    let analyze = |page: &str, revision: &Value, design: &[f64]| server.analyze(page, revision, &json!(design), true);
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
    let printed = analyzed(&place, &["impact-absorber"]);
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
    place.example("pendulum-chain");
    // A motion over 2 000 s instead of half a second.
    let text =
        place.read("pendulum-chain.toml").replace("to = 0.5", "to = 2000.0").replace("points = 51", "points = 50001");
    std::fs::write(place.0.join("long.toml"), text).unwrap();
    let server = Server::start(&place.0, "long.toml");
    let model = server.get("model");
    let ask = |damping: f64| server.analyze("p", &model["revision"], &json!([damping]), false);
    std::thread::scope(|scope| {
        let old = scope.spawn(|| ask(1.0));
        std::thread::sleep(Duration::from_millis(400));
        let new = scope.spawn(|| ask(2.0));
        assert_eq!(old.join().unwrap().0, 409);
        std::thread::sleep(Duration::from_millis(400));
        assert_eq!(server.post("cancel", &json!({ "page": "p" })).0, 200);
        assert_eq!(new.join().unwrap().0, 409);
    });
    server.assert_alive("stopped analyses");
}

/// A run that is closed while its start design is analysed does not come back.
#[test]
fn a_closed_run_stays_closed() {
    let place = TempFolder::new("open-closed");
    place.example("pendulum-chain");
    let text =
        place.read("pendulum-chain.toml").replace("to = 0.5", "to = 50.0").replace("points = 51", "points = 5001");
    std::fs::write(place.0.join("long.toml"), text).unwrap();
    let server = Server::start(&place.0, "long.toml");
    let design = start_design(&server.get("model"));
    let begun = Instant::now();
    server.act(&json!({ "action": "start", "design": design }));
    rests(&server, "Paused", |tries| tries == 0);
    let analysis = begun.elapsed();
    server.act(&json!({ "action": "start", "design": design }));
    server.act(&json!({ "action": "close" }));
    // The analysis of the closed run ends in this time.
    let closed = Instant::now();
    while closed.elapsed() < 2 * analysis + Duration::from_millis(500) {
        assert_eq!(server.get("run")["run"], Value::Null);
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A trial step that is stopped leaves the run as it was, at once; so does the analysis of a start, which leaves no run. Both can be done again.
#[test]
fn a_trial_step_is_stopped() {
    let place = TempFolder::new("open-stop");
    place.example("pendulum-chain");
    let text = place.read("pendulum-chain.toml").replace("to = 0.5", "to = 4.0").replace("points = 51", "points = 401");
    std::fs::write(place.0.join("long.toml"), text).unwrap();
    let server = Server::start(&place.0, "long.toml");
    let act = |action: &str| assert_eq!(server.post("run", &json!({ "action": action })).0, 200);
    let design = start_design(&server.get("model"));
    let start = || assert_eq!(server.post("run", &json!({ "action": "start", "design": design })).0, 200);
    let begun = Instant::now();
    start();
    let run = rests(&server, "Paused", |tries| tries == 0);
    let analysis = begun.elapsed();
    // A step takes more than the time of an analysis, for the derivatives and for the proposal.
    for (action, pause) in [("step", 0), ("run", 0), ("step", 10), ("run", 10)] {
        act(action);
        // Also before the worker has begun.
        std::thread::sleep(analysis * pause / 100);
        let stopped = Instant::now();
        act("stop");
        let after = rests(&server, "Paused", |tries| tries == 0);
        assert!(stopped.elapsed() < analysis, "{:?} of {analysis:?}", stopped.elapsed());
        assert_eq!((&after["cycles"], &after["fault"]), (&run["cycles"], &Value::Null));
    }
    // A worker that dies in the middle of a step is named, and the step can be done again.
    act("step");
    std::thread::sleep(analysis / 10);
    let tasks = std::fs::read_dir(format!("/proc/{}/task", server.process.id())).into_iter().flatten().flatten();
    let workers: String = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok()).collect();
    if !workers.is_empty() {
        let status = Command::new("kill").arg("-KILL").args(workers.split_whitespace()).status();
        assert!(status.unwrap().success());
        let after = wait(&server, "run", "a fault", |value| value["run"]["fault"].is_string())["run"].clone();
        assert!(after["fault"].as_str().unwrap().contains("ended unexpectedly"), "{}", after["fault"]);
        assert_eq!(after["cycles"], run["cycles"]);
        act("step");
    }
    rests(&server, "Paused", |tries| tries == 1);
    act("close");
    let folders = || std::fs::read_dir(place.0.join("out")).unwrap().count();
    let before = folders();
    for pause in [0, 10] {
        start();
        std::thread::sleep(analysis * pause / 100);
        act("stop");
        wait(&server, "run", "no run", |value| value["run"] == Value::Null);
        assert_eq!(folders(), before);
    }
    start();
    rests(&server, "Paused", |tries| tries == 0);
}

#[test]
fn the_server_keeps_the_budget_of_memory() {
    let place = TempFolder::new("open-budget");
    place.example("impact-absorber");
    let server = Server::start_with(&place.0, "impact-absorber.toml", &["--memory", "1k"]);
    let model = server.get("model");
    let (_, answer) = server.analyze("p", &model["revision"], &json!(start_design(&model)), false);
    assert!(answer.to_string().contains("of memory are needed"), "{answer}");
}

/// Objective and constraints are there also if the start cannot be analysed, and other designs can be. A program is not started for them.
#[test]
fn a_problem_does_not_need_its_start() {
    let place = TempFolder::new("open-start");
    place.example("shaper");
    let text = place
        .read("shaper.toml")
        .replace("start = 0.12, lower = 0.05, upper = 0.25", "start = 0.5, lower = 0.05, upper = 0.9");
    std::fs::write(place.0.join("fails.toml"), text).unwrap();
    let server = Server::start(&place.0, "fails.toml");
    let model = server.get("model");
    assert_eq!((&model["model"]["fault"], model["model"]["constraints"].as_array().unwrap().len()), (&Value::Null, 6));
    let analyze = |crank: f64| {
        let mut design = start_design(&model);
        design[0] = crank;
        server.analyze("p", &model["revision"], &json!(design), true).1
    };
    assert!(analyze(0.5)["error"].as_str().unwrap().contains("assembled"));
    let printed = analyzed(&place, &["shaper"]);
    let [found, exact] =
        [&analyze(0.12)["objective"], &printed["objective"]["value"]].map(|value| value.as_f64().unwrap());
    assert!((found - exact).abs() < 1e-9 * exact, "{found} and {exact}");

    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/programs/oscillator.toml");
    std::fs::copy(program, place.0.join("oscillator.toml")).unwrap();
    for options in [&["--allow-programs"][..], &[]] {
        let server = Server::start_with(&place.0, "oscillator.toml", options);
        let model = server.get("model")["model"].clone();
        assert!(model["objective"].is_object() && model["fault"].is_null(), "{model}");
    }
}

/// Over a sweep, plots and windows are in the unit of the axis, and a limit that is drawn on them in that of the file.
#[test]
fn limits_over_a_sweep_are_in_its_unit() {
    let place = TempFolder::new("open-sweep");
    // The unit of the last output is a label: it is a number.
    let labelled = "[[output]]\nname = \"labelled\"\nvalue = \"200*(length - tip.x)/length\"\nunit = \"mm\"\n";
    std::fs::write(place.0.join("lift.toml"), format!("{}\n{labelled}", crate::sweeps::LIFT)).unwrap();
    let server = Server::start(&place.0, "lift.toml");
    let model = server.get("model")["model"].clone();
    let of = |value: &Value| value.as_f64().unwrap();
    assert_eq!((&model["time"]["unit"], &model["time"]["variable"]), (&json!("mm"), &json!("lift")));
    assert!(
        (of(&model["time"]["points"][0]) + 80.0).abs() < 1e-9 && (of(&model["time"]["factor"]) - 1e-3).abs() < 1e-15
    );
    let window = &model["constraints"][0]["window"];
    assert!((of(&window[0]) + 40.0).abs() < 1e-9 && (of(&window[1]) - 60.0).abs() < 1e-9, "{window}");

    let Some(program) = browser() else { return };
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);
    // Level and sloped limits, of which the beginning is the margin: the largest values are 16.7 mm.
    let exact = 25.0 - 1e3 * (0.2 - (0.04f64 - 0.0064).sqrt());
    for output in ["back", "labelled"] {
        for last in [25.0, 30.0] {
            let text = page.text(&format!(
                "Promise.all([import('./editor.js'), fetch('model').then((answer) => answer.json())]).then(([{{ limitText }}, {{ text, model }}]) => \
                 limitText(text, model.outputs.find((one) => one.name === '{output}'), '≤', [[-80, 25], [80, {last}]], 6, model.time))"
            ));
            std::fs::write(place.0.join("drawn.toml"), text).unwrap();
            let printed = analyzed(&place, &["drawn"]);
            let margin = of(&printed["constraints"].as_array().unwrap().last().unwrap()["margin"]);
            assert!((margin - exact).abs() < 1e-4 * exact, "{output} {last}: {margin} and {exact}");
        }
    }
    page.click(".plot .tools button");
    let [x, y] = page.middle(".plot svg");
    page.drag([x - 60.0, y - 20.0], [x + 60.0, y + 20.0]);
    page.wait("document.querySelectorAll('.margin').length === 2");
    page.click("#save");
    page.wait("document.getElementById('save').disabled");
    let text = place.read("lift.toml");
    let drawn = text.split("drawn limit 1").nth(1).unwrap();
    // Its numbers are in metres: the history goes from 0 to 17 mm.
    let height: f64 = drawn.split("back - (").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(drawn.contains("*(lift ") && (0.0..0.03).contains(&height), "{drawn}");
    let number = |key: &str| -> f64 {
        let line = drawn.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_else(|| panic!("{drawn}"));
        line.trim_start_matches([' ', '=']).parse().unwrap()
    };
    let [from, to] = ["from", "to"].map(number);
    assert!(-0.08 <= from && from < to && to <= 0.08 && to - from < 0.15, "{from} {to}");
    place.run(&["analyze", "lift"], 0);
}

/// Waits until a value of the server has a property.
pub fn wait(server: &Server, route: &str, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    for _ in 0..3000 {
        let value = server.get(route);
        if is_so(&value) {
            return value;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("never: {what}\n{}", server.get(route))
}

/// The run, once it has this status and a suitable number of trial steps.
pub fn rests(server: &Server, status: &str, tries: impl Fn(usize) -> bool) -> Value {
    let cycles = |value: &Value| value["run"]["cycles"].as_array().map_or(0, |all| all.len());
    let found = wait(server, "run", &format!("the run is {status}"), |value| {
        value["run"]["status"] == status && cycles(value) > 0 && tries(cycles(value) - 1)
    });
    found["run"].clone()
}

/// Files that the model names are read from its folder, as `analyze` reads them, and again when they change; no others.
#[test]
fn a_model_of_several_files_is_shown() {
    let place = TempFolder::new("open-files");
    let model = "version = 2\ninclude = [\"steel.toml\"]\n[design.x]\nstart = 1\nlower = 0\nupper = 2\n[table.lift]\nfile = \"lift.csv\"\n\
        [[output]]\nname = \"f\"\nvalue = \"rho*lift(x)\"\n[objective]\nminimize = \"f\"\n";
    let steel = |rho: &str| {
        std::fs::write(place.0.join("steel.toml"), format!("version = 2\n[constants]\nrho = {rho}\n")).unwrap()
    };
    steel("10");
    std::fs::write(place.0.join("lift.csv"), "x, y\n0, 1\n1, 2\n2, 5\n").unwrap();
    std::fs::write(place.0.join("cam.toml"), model).unwrap();
    std::fs::write(place.0.parent().unwrap().join("outside.toml"), "version = 2\n[constants]\nrho = 5\n").unwrap();
    let server = Server::start(&place.0, "cam.toml");
    let shown = server.get("model");
    assert_eq!((&shown["errors"], &shown["text"]), (&json!([]), &json!(model)));
    let value = |revision: &Value| {
        let (status, answer) = server.analyze("one", revision, &json!([1]), false);
        assert_eq!(status, 200, "{answer}");
        answer["objective"].as_f64().unwrap_or_else(|| panic!("{answer}"))
    };
    assert_eq!(value(&shown["revision"]), 20.0);
    // A run begins with the files, too.
    server.act(&json!({ "action": "start", "design": [0.5] }));
    rests(&server, "Paused", |tries| tries == 0);
    assert!(place.read("out/cam/model.toml").contains("#@ file steel.toml"));
    // An edit of an included file shows; an error in it is named where the model names the file.
    steel("30");
    let next = wait(&server, "model", "edited", |value| value["revision"] != shown["revision"]);
    assert_eq!(value(&next["revision"]), 60.0);
    steel("\"30 kgg\"");
    let wrong = wait(&server, "model", "wrong", |value| value["errors"] != json!([]));
    let error = &wrong["errors"][0];
    assert!(error["message"].as_str().unwrap().starts_with("steel.toml:3: "), "{error}");
    assert_eq!((&error["line"], &error["column"]), (&json!(2), &json!(11)));
    // No path leaves the folder, in the text of a page neither.
    for name in ["../outside.toml", "/etc/passwd"] {
        let text = model.replace("steel.toml", name);
        assert_eq!(
            server.post("edit", &json!({ "text": text, "edited": server.get("model")["edited"], "base": "" })).0,
            200
        );
        let errors = server.get("model")["errors"].to_string();
        assert!(errors.contains("leaves the folder") && !errors.contains("root:"), "{errors}");
    }
}
