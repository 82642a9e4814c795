//! Routes of the server and their handlers.

use std::convert::Infallible;
use std::io::Write;
use std::sync::Arc;

use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, FromRequestParts, Path, Query, State};
use axum::http::header;
use axum::http::request::Parts;
use axum::middleware::from_fn_with_state;
use axum::response::sse::{self, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{delete, get, post};
use axum::{Json, Router};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use shellock_job::options::Offer;
use tokio_stream::wrappers::BroadcastStream;
use tokio_stream::{Stream, StreamExt};

use crate::bench::Bench;
use crate::guard::{guard, is_token};
use crate::jobs::{Event, Job, Jobs};
use crate::messages::{Divided, Judgement, Shown};
use crate::rate::Rate;
use crate::refusal::Refusal;
use crate::state::Studio;
use crate::{Address, MOST_BYTES, kit, page};

/// Largest body of requests other than models, bytes: labels of four million triangles.
const MOST_OTHER_BYTES: usize = 16 << 20;

type Answer<T> = Result<Json<T>, Refusal>;

/// Builds the router with all routes, behind the guard.
pub fn app(address: &Address, jobs: Arc<Jobs>, bench: Arc<Bench>) -> Router {
    tokio::spawn(Arc::clone(&jobs).run());
    let studio = Studio {
        address: Arc::new(address.clone()),
        rate: Arc::new(Rate::new()),
        bench,
        jobs,
    };
    Router::new()
        .route("/", get(page::index))
        .route("/{name}", get(page::file))
        .route("/api/project", get(project))
        .route("/api/options", get(options).put(choose))
        .route("/api/model", post(open).layer(DefaultBodyLimit::disable()))
        .route("/api/figure", post(open_figure))
        .route("/api/mesh", get(mesh))
        .route("/api/divide", post(divide))
        .route("/api/labels", get(labels).put(paint))
        .route("/api/judge", post(judge))
        .route("/api/cut", get(cut))
        .route("/api/mend", post(mend))
        .route("/api/mirror", post(mirror))
        .route("/api/key", post(place_key))
        .route("/api/make", post(make))
        .route("/api/jobs/{id}", delete(stop))
        .route("/api/events", get(events))
        .route("/api/kit.zip", get(archive))
        .route("/kit/{token}/{*name}", get(kit_file))
        .fallback(async || Refusal::not_found("there is nothing at this address"))
        .layer(DefaultBodyLimit::max(MOST_OTHER_BYTES))
        .layer(from_fn_with_state(studio.clone(), guard))
        .with_state(studio)
}

/// Runs slow work on a thread of its own, so that the server stays responsive.
async fn apart<T: Send + 'static>(
    studio: &Studio,
    work: impl FnOnce(&Bench) -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let bench = Arc::clone(&studio.bench);
    let done = tokio::task::spawn_blocking(move || work(&bench)).await;
    done.unwrap_or_else(|_| {
        Err(Refusal::unable(
            "the program failed at this step; your earlier work is kept",
        ))
    })
}

/// Name that a page gives itself, so that it knows its own changes when it hears of them.
struct PageName(String);

impl<S: Sync> FromRequestParts<S> for PageName {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let name = parts
            .headers
            .get("x-shellock-page")
            .and_then(|name| name.to_str().ok());
        Ok(Self(name.unwrap_or_default().to_owned()))
    }
}

/// Runs work as [`apart`] does, then tells all open pages that the project has changed.
async fn change<T: Send + 'static>(
    studio: &Studio,
    PageName(by): PageName,
    work: impl FnOnce(&Bench) -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let done = apart(studio, work).await?;
    studio.jobs.tell_project(by);
    Ok(done)
}

async fn project(State(studio): State<Studio>) -> Answer<Shown> {
    let jobs = studio.jobs.list();
    let project = apart(&studio, |bench| Ok(bench.project())).await?;
    Ok(Json(Shown {
        project,
        job: jobs.last().cloned(),
        jobs,
    }))
}

async fn options(State(studio): State<Studio>) -> Answer<Vec<Offer>> {
    apart(&studio, |bench| Ok(Json(bench.options()))).await
}

async fn choose(
    State(studio): State<Studio>,
    page: PageName,
    Json(changes): Json<Map<String, Value>>,
) -> Answer<Vec<Offer>> {
    change(&studio, page, move |bench| {
        bench.choose(&changes)?;
        Ok(Json(bench.options()))
    })
    .await
}

#[derive(Deserialize)]
struct Named {
    name: String,
}

async fn open(
    State(studio): State<Studio>,
    page: PageName,
    Query(named): Query<Named>,
    body: Body,
) -> Answer<Shown> {
    let file = store_body(&studio, body).await?;
    change(&studio, page, move |bench| {
        bench.open_file(&named.name, file.path())
    })
    .await?;
    project(State(studio)).await
}

/// Stores the body as a temporary file in the project's folder, deleted when dropped.
async fn store_body(studio: &Studio, body: Body) -> Result<tempfile::NamedTempFile, Refusal> {
    let unwritable = |e: std::io::Error| Refusal::unable(format!("the file could not be saved: {e}"));
    let mut file = tempfile::Builder::new()
        .prefix(".upload-")
        .tempfile_in(studio.bench.folder())
        .map_err(unwritable)?;
    let (mut chunks, mut n_bytes) = (body.into_data_stream(), 0);
    while let Some(chunk) = chunks.next().await {
        let chunk = chunk.map_err(|_| Refusal::wrong("the file did not arrive completely"))?;
        n_bytes += chunk.len() as u64;
        if n_bytes > MOST_BYTES {
            return Err(Refusal::too_large());
        }
        file.write_all(&chunk).map_err(unwritable)?;
    }
    file.flush().map_err(unwritable)?;
    Ok(file)
}

async fn open_figure(
    State(studio): State<Studio>,
    page: PageName,
    Json(named): Json<Named>,
) -> Answer<Shown> {
    change(&studio, page, move |bench| bench.open_figure(&named.name)).await?;
    project(State(studio)).await
}

fn bytes(bytes: Vec<u8>) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
}

async fn mesh(State(studio): State<Studio>) -> Result<Response, Refusal> {
    apart(&studio, |bench| bench.mesh()).await.map(bytes)
}

async fn divide(State(studio): State<Studio>, page: PageName) -> Answer<Divided> {
    change(&studio, page, |bench| bench.divide()).await.map(Json)
}

async fn labels(State(studio): State<Studio>) -> Result<Response, Refusal> {
    apart(&studio, |bench| bench.labels()).await.map(bytes)
}

async fn paint(State(studio): State<Studio>, page: PageName, body: Bytes) -> Answer<Divided> {
    change(&studio, page, move |bench| bench.paint(&body))
        .await
        .map(Json)
}

async fn judge(State(studio): State<Studio>) -> Answer<Judgement> {
    apart(&studio, |bench| bench.judge()).await.map(Json)
}

async fn cut(State(studio): State<Studio>) -> Result<Response, Refusal> {
    apart(&studio, |bench| bench.cut()).await.map(bytes)
}

async fn mend(State(studio): State<Studio>, page: PageName) -> Answer<Divided> {
    change(&studio, page, |bench| bench.mend()).await.map(Json)
}

async fn mirror(State(studio): State<Studio>, page: PageName) -> Answer<Divided> {
    change(&studio, page, |bench| bench.mirror()).await.map(Json)
}

#[derive(Deserialize)]
struct Place {
    at: [f64; 3],
}

async fn place_key(
    State(studio): State<Studio>,
    page: PageName,
    Json(place): Json<Place>,
) -> Answer<Vec<Offer>> {
    change(&studio, page, move |bench| {
        bench.place_key(place.at)?;
        Ok(Json(bench.options()))
    })
    .await
}

async fn make(State(studio): State<Studio>) -> Answer<Job> {
    apart(&studio, |bench| bench.can_make()).await?;
    studio.jobs.add().map(Json)
}

async fn stop(State(studio): State<Studio>, Path(id): Path<u64>) -> Answer<Job> {
    studio.jobs.stop(id).map(Json)
}

async fn events(State(studio): State<Studio>) -> Sse<impl Stream<Item = Result<sse::Event, Infallible>>> {
    let told = BroadcastStream::new(studio.jobs.events()).map(|event| {
        Ok(match event {
            Ok(Event::Job(job)) => sse::Event::default().event("job").data(json!(job).to_string()),
            Ok(Event::Project { by }) => project_event(&by),
            // After missed events, the page reloads all of the project.
            Err(_) => project_event(""),
        })
    });
    Sse::new(told).keep_alive(KeepAlive::default())
}

fn project_event(by: &str) -> sse::Event {
    sse::Event::default()
        .event("project")
        .data(json!({ "by": by }).to_string())
}

async fn archive(State(studio): State<Studio>) -> Result<Response, Refusal> {
    let packed = apart(&studio, |bench| kit::archive(&bench.kit_folder())).await?;
    let headers = [
        (header::CONTENT_TYPE, "application/zip"),
        (header::CONTENT_DISPOSITION, "attachment; filename=\"kit.zip\""),
    ];
    Ok((headers, packed).into_response())
}

async fn kit_file(
    State(studio): State<Studio>,
    Path((token, name)): Path<(String, String)>,
) -> Result<Response, Refusal> {
    if !is_token(&studio.address, &token) {
        return Err(Refusal::no_token());
    }
    let kind = kit::kind(&name);
    let read = apart(&studio, move |bench| {
        let path = kit::file(&bench.kit_folder(), &name)?;
        std::fs::read(path).map_err(|e| Refusal::unable(format!("the file cannot be read: {e}")))
    });
    Ok(([(header::CONTENT_TYPE, kind)], read.await?).into_response())
}
