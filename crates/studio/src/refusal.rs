//! Answers to requests that are refused.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;
use shellock_job::Failure;

/// Reason why a request was not fulfilled, in words for the user.
#[derive(Debug, thiserror::Error)]
#[error("{words}")]
pub struct Refusal {
    status: StatusCode,
    words: String,
}

impl Refusal {
    fn new(status: StatusCode, words: impl Into<String>) -> Self {
        Self {
            status,
            words: words.into(),
        }
    }

    /// Refusal of a request that is impossible with the given input.
    pub fn wrong(words: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, words)
    }

    /// Refusal of a request for something that does not exist, or not yet.
    pub fn not_found(words: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, words)
    }

    /// Answer to a request that a later one has superseded. This is nobody's fault, so the status is that of
    /// success and the answer is `{"overtaken": true}`; the page asks again.
    pub fn overtaken() -> Self {
        Self::new(StatusCode::OK, "the pieces have changed in the meantime")
    }

    /// Refusal due to the machine, such as a full disk.
    pub fn unable(words: impl Into<String>) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, words)
    }

    pub(crate) fn stranger(words: &str) -> Self {
        Self::new(StatusCode::FORBIDDEN, words)
    }

    pub(crate) fn no_token() -> Self {
        let words = "this needs the token in the address that `shellock studio` printed";
        Self::new(StatusCode::UNAUTHORIZED, words)
    }

    pub(crate) fn too_large() -> Self {
        let words = format!(
            "files larger than {} MB are not accepted",
            crate::MOST_BYTES >> 20
        );
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, words)
    }

    pub(crate) fn too_many() -> Self {
        Self::new(
            StatusCode::TOO_MANY_REQUESTS,
            "too many requests at once: wait a moment",
        )
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let told = match self.status {
            StatusCode::OK => json!({ "overtaken": true }),
            _ => json!({ "error": self.words }),
        };
        (self.status, Json(told)).into_response()
    }
}

/// A choice that is refused.
impl From<Failure> for Refusal {
    fn from(failure: Failure) -> Self {
        let words = failure.to_string();
        match failure {
            Failure::Unwritable { .. } => Self::unable(words),
            _ => Self::wrong(words),
        }
    }
}
