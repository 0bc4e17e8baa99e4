//! The server: connections, routes and their limits.

use super::guard::{self, AccessControl};
use super::queue::Reply;
use super::session::{self, Saved, Session};
use super::stored;
use super::worker::WorkerRequest;
use anyhow::Context;
use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::net::Ipv4Addr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;
use tokio::time::{sleep, timeout};

/// Largest number of connections at a time; further ones are asked to retry later.
const CONNECTIONS: usize = 64;
/// Largest size of the body of a request in bytes: a model file of 2 MB as JSON.
const BODY: usize = 5 << 20;
/// Largest size of the head of a request in bytes.
const HEAD: usize = 32 << 10;
/// Time in which the head, and then the body, of a request has to arrive.
const ARRIVAL: Duration = Duration::from_secs(10);
/// Largest number of bytes of the name of a page.
const PAGE_NAME: usize = 64;
/// Longest wait for changes; a page then repeats its request.
const NEWS: Duration = Duration::from_secs(25);
/// Time between two checks of the model file.
const WATCH: Duration = Duration::from_millis(300);

/// The parts of the page with their types.
const FILES: &[(&str, &str, &str)] = &[
    ("", "text/html; charset=utf-8", include_str!("page/index.html")),
    (
        "style.css",
        "text/css; charset=utf-8",
        concat!(
            include_str!("../../report/page/page.css"),
            include_str!("../../report/animation/player.css"),
            include_str!("page/style.css")
        ),
    ),
    ("server.js", "text/javascript; charset=utf-8", include_str!("page/server.js")),
    ("frames.js", "text/javascript; charset=utf-8", include_str!("page/frames.js")),
    ("numbers.js", "text/javascript; charset=utf-8", include_str!("page/numbers.js")),
    ("predict.js", "text/javascript; charset=utf-8", include_str!("page/predict.js")),
    ("mechanism.js", "text/javascript; charset=utf-8", include_str!("page/mechanism.js")),
    ("plots.js", "text/javascript; charset=utf-8", include_str!("page/plots.js")),
    ("connection.js", "text/javascript; charset=utf-8", include_str!("page/connection.js")),
    ("zoom.js", "text/javascript; charset=utf-8", include_str!("page/zoom.js")),
    ("point.js", "text/javascript; charset=utf-8", include_str!("page/point.js")),
    ("elements.js", "text/javascript; charset=utf-8", include_str!("page/elements.js")),
    ("convergence.js", "text/javascript; charset=utf-8", include_str!("page/convergence.js")),
    ("race.js", "text/javascript; charset=utf-8", include_str!("page/race.js")),
    ("stored.js", "text/javascript; charset=utf-8", include_str!("page/stored.js")),
    ("study.js", "text/javascript; charset=utf-8", include_str!("page/study.js")),
    ("complete.js", "text/javascript; charset=utf-8", include_str!("page/complete.js")),
    ("run.js", "text/javascript; charset=utf-8", include_str!("page/run.js")),
    ("editor.js", "text/javascript; charset=utf-8", include_str!("page/editor.js")),
    ("main.js", "text/javascript; charset=utf-8", include_str!("page/main.js")),
];

/// A server at a port of the loopback address.
pub struct Server {
    listener: TcpListener,
    shared: Arc<Shared>,
}

struct Shared {
    guard: AccessControl,
    session: Session,
}

impl Server {
    /// Opens a port that the system chooses.
    pub async fn bind(session: Session) -> anyhow::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.context("cannot open a port for the page")?;
        let guard = AccessControl::new(listener.local_addr()?)?;
        Ok(Self { listener, shared: Arc::new(Shared { guard, session }) })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        self.shared.guard.address()
    }

    /// An address that leads to the page once.
    pub fn launch_address(&self) -> String {
        self.shared.guard.launch_address()
    }

    /// Answers requests until the process ends.
    pub async fn run(self) -> anyhow::Result<()> {
        let routes = Router::new().fallback(answer).with_state(self.shared.clone());
        let permits = Arc::new(Semaphore::new(CONNECTIONS));
        let watched = self.shared.clone();
        tokio::spawn(async move {
            loop {
                sleep(WATCH).await;
                watched.session.look_at_the_file();
            }
        });
        loop {
            // An error of one connection, or of too many open files, does not end the server.
            let Ok((stream, _)) = self.listener.accept().await else {
                sleep(Duration::from_millis(50)).await;
                continue;
            };
            let Ok(permit) = permits.clone().try_acquire_owned() else {
                turn_away(&stream);
                continue;
            };
            let service = TowerToHyperService::new(routes.clone());
            tokio::spawn(async move {
                let mut protocol = http1::Builder::new();
                protocol.timer(TokioTimer::new()).header_read_timeout(ARRIVAL).max_buf_size(HEAD);
                // A fault of the connection concerns its client only.
                drop(protocol.serve_connection(TokioIo::new(stream), service).await);
                drop(permit);
            });
        }
    }
}

/// Answers a connection beyond [`CONNECTIONS`] with the request to retry later.
fn turn_away(stream: &TcpStream) {
    drop(stream.try_write(
        b"HTTP/1.1 503 Service Unavailable\r\nretry-after: 1\r\ncontent-length: 0\r\nconnection: close\r\n\r\n",
    ));
}

/// Answers a request, or refuses it.
async fn answer(State(shared): State<Arc<Shared>>, request: Request) -> Response {
    let (head, body) = request.into_parts();
    let path = head.uri.path();
    let mut response = match shared.guard.admit(&head.method, path, &head.headers) {
        Ok(route) => match (head.method.as_str(), FILES.iter().find(|(name, ..)| *name == route)) {
            ("GET", Some((_, kind, text))) => {
                ([(header::CONTENT_TYPE, HeaderValue::from_static(kind))], *text).into_response()
            }
            ("GET", None) => get(&shared, route, head.uri.query().unwrap_or_default()).await,
            _ => match receive(body).await {
                Ok(body) => post(&shared, route, &body).await.unwrap_or_else(IntoResponse::into_response),
                Err(status) => status.into_response(),
            },
        },
        Err(status) => match shared.guard.exchange(path, &head.headers) {
            Some(place) => (StatusCode::SEE_OTHER, [(header::LOCATION, place)]).into_response(),
            None => status.into_response(),
        },
    };
    if response.status().is_client_error() {
        // The rest of a refused body is not read.
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    guard::protect(response.headers_mut());
    response
}

/// The body of a request as text.
async fn receive(body: Body) -> Result<String, StatusCode> {
    let bytes = timeout(ARRIVAL, to_bytes(body, BODY)).await.map_err(|_| StatusCode::REQUEST_TIMEOUT)?;
    let bytes = bytes.map_err(|_| StatusCode::PAYLOAD_TOO_LARGE)?;
    String::from_utf8(bytes.into()).map_err(|_| StatusCode::BAD_REQUEST)
}

fn json_text(text: String) -> Response {
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], text).into_response()
}

async fn get(shared: &Arc<Shared>, route: &str, query: &str) -> Response {
    let session = &shared.session;
    match route {
        "model" => json_text(session.model().to_string()),
        "run" => json_text(session.run().to_string()),
        "stored" => blocking(shared, |session| Ok(session.stored())).await,
        "news" => {
            let known = query.strip_prefix("after=").and_then(|number| number.parse::<u64>().ok());
            let mut news = session.news();
            // The end of the wait is not an error: the page asks again.
            drop(timeout(NEWS, news.wait_for(|number| Some(*number) != known)).await);
            let number = *news.borrow();
            json_text(json!({ "number": number }).to_string())
        }
        _ => StatusCode::NOT_FOUND.into_response(),
    }
}

/// The answer of work that reads many files.
async fn blocking(
    shared: &Arc<Shared>,
    work: impl FnOnce(&Session) -> anyhow::Result<Value> + Send + 'static,
) -> Response {
    let shared = shared.clone();
    match spawn_blocking(move || work(&shared.session)).await {
        Ok(Ok(value)) => json_text(value.to_string()),
        Ok(Err(error)) => done(Err(error)),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

/// A request for an analysis. Numbers and order of the design are those of the variables of the model.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnalysisRequest {
    /// Random name of the page, by which newer requests replace older ones.
    page: String,
    /// Revision of the model for which the design is meant.
    revision: u64,
    design: Vec<f64>,
    /// True if derivatives are wanted, too.
    derivatives: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cancel {
    page: String,
}

/// A rival of the run, with this preset.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RivalRequest {
    method: String,
}

/// A stored run or study.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredFolder {
    folder: String,
}

/// Two stored runs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunPair {
    folders: [String; 2],
}

/// The note about a stored run; an empty text removes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Note {
    folder: String,
    text: String,
}

/// A place in a text of the model, in UTF-16 units as browsers count.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TextPosition {
    text: String,
    at: usize,
}

/// Edited text of the model, and the hashes of the text that was edited and of the text on disk from which the edits began.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TextEdit {
    text: String,
    edited: String,
    base: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Save {
    /// Hash of the changed file that is to be replaced.
    over: Option<String>,
}

/// The answer to an action that returns nothing, or its error.
fn done(result: anyhow::Result<()>) -> Response {
    json_text(match result {
        Ok(()) => "{}".to_owned(),
        Err(error) => json!({ "error": guard::message(&error) }).to_string(),
    })
}

/// The content of a request.
fn parsed<T: DeserializeOwned>(body: &str) -> Result<T, StatusCode> {
    serde_json::from_str(body).map_err(|_| StatusCode::BAD_REQUEST)
}

async fn post(shared: &Arc<Shared>, route: &str, body: &str) -> Result<Response, StatusCode> {
    let session = &shared.session;
    Ok(match route {
        "analyze" => {
            let wanted: AnalysisRequest = parsed(body)?;
            if wanted.page.len() > PAGE_NAME {
                return Err(StatusCode::BAD_REQUEST);
            }
            let AnalysisRequest { page, revision, design, derivatives } = wanted;
            match session.analyze(revision, &page, WorkerRequest::Analyze { design, derivatives }).await {
                Reply::Line(line) => json_text(line),
                Reply::Outdated => StatusCode::CONFLICT.into_response(),
                Reply::Busy => StatusCode::TOO_MANY_REQUESTS.into_response(),
                Reply::Failed(why) => json_text(json!({ "error": why }).to_string()),
            }
        }
        "cancel" => {
            session.cancel(&parsed::<Cancel>(body)?.page);
            done(Ok(()))
        }
        "run" => {
            session.optimize(parsed(body)?);
            done(Ok(()))
        }
        "race" => done(session.race(parsed::<RivalRequest>(body)?.method)),
        "rival" => {
            session.steer_rival(parsed(body)?);
            done(Ok(()))
        }
        "stored-run" => {
            let StoredFolder { folder } = parsed(body)?;
            blocking(shared, move |_| stored::run(&folder)).await
        }
        "study" => {
            let StoredFolder { folder } = parsed(body)?;
            blocking(shared, move |session| session.study(&folder)).await
        }
        "differences" => {
            let RunPair { folders: [a, b] } = parsed(body)?;
            blocking(shared, move |_| stored::differences(&a, &b)).await
        }
        "note" => {
            let Note { folder, text } = parsed(body)?;
            blocking(shared, move |_| stored::write_note(&folder, &text).map(|()| json!({}))).await
        }
        "complete" => {
            let TextPosition { text, at } = parsed(body)?;
            json_text(session::completions(&text, at).to_string())
        }
        "edit" => {
            let TextEdit { text, edited, base } = parsed(body)?;
            match session.edit(text, &edited, base) {
                Ok(Some(edited)) => json_text(json!({ "edited": edited }).to_string()),
                Ok(None) => StatusCode::CONFLICT.into_response(),
                Err(error) => done(Err(error)),
            }
        }
        "save" => match session.save(parsed::<Save>(body)?.over.as_deref()) {
            Ok(Saved::Changed) => StatusCode::CONFLICT.into_response(),
            result => done(result.map(|_| ())),
        },
        "discard" => done(session.discard()),
        _ => StatusCode::NOT_FOUND.into_response(),
    })
}
