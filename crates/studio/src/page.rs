//! Files of the page; its script is built from `viewer/`.

use axum::extract::Path;
use axum::http::header;
use axum::response::{IntoResponse, Response};

use crate::refusal::Refusal;

const FILES: [(&str, &str, &str); 3] = [
    ("", "text/html; charset=utf-8", include_str!("../page/index.html")),
    (
        "studio.js",
        "text/javascript; charset=utf-8",
        include_str!("../page/studio.js"),
    ),
    (
        "studio.css",
        "text/css; charset=utf-8",
        include_str!("../page/studio.css"),
    ),
];

/// Handles `GET /`: the page itself.
pub async fn index() -> Response {
    file(Path(String::new())).await
}

/// Handles `GET /{name}`: a file of the page.
pub async fn file(Path(name): Path<String>) -> Response {
    match FILES.iter().find(|f| f.0 == name) {
        Some((_, kind, text)) => ([(header::CONTENT_TYPE, *kind)], *text).into_response(),
        None => Refusal::not_found("there is no such page").into_response(),
    }
}
