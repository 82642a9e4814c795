//! Access control: only the page that this server opened may send requests.
//!
//! A foreign page in the same browser can send requests to this port, and a foreign name can be made to
//! resolve to it. So the host and the origin must be this server's own, and requests beyond the page itself
//! need the token. The rate of requests is limited.

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::Address;
use crate::refusal::Refusal;
use crate::state::Studio;

/// Length of a token in bytes: nobody guesses 256 bits.
const TOKEN_BYTES: usize = 32;
/// Policy of the studio's page, which loads nothing from other servers.
const PAGE_POLICY: &str = "default-src 'self'; img-src 'self' data: blob:; style-src 'self' \
                           'unsafe-inline'; frame-src 'self'; object-src 'none'; base-uri 'none'; \
                           form-action 'none'; frame-ancestors 'self'";
/// Policy of a kit's own page, which is self-contained.
const KIT_POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; style-src \
                          'unsafe-inline'; img-src data: blob:; font-src data:; frame-ancestors 'self'";

/// Generates a random token, in hexadecimal digits.
pub fn token() -> std::io::Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

/// Returns true if the given token is the right one. Constant time, so that the duration does not reveal
/// where they differ.
pub fn is_token(address: &Address, given: &str) -> bool {
    let (a, b) = (address.token.as_bytes(), given.as_bytes());
    a.len() == b.len() && a.iter().zip(b).fold(0, |differs, (x, y)| differs | (x ^ y)) == 0
}

/// Rejects requests that are not allowed, and adds the security headers to every answer.
pub async fn guard(State(studio): State<Studio>, request: Request, next: Next) -> Response {
    let path = request.uri().path().to_owned();
    let mut response = match refusal(&studio, &request) {
        Some(refusal) => refusal.into_response(),
        None => next.run(request).await,
    };
    let policy = if path.starts_with("/kit/") {
        KIT_POLICY
    } else {
        PAGE_POLICY
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn refusal(studio: &Studio, request: &Request) -> Option<Refusal> {
    let headers = request.headers();
    if !is_own(&studio.address, headers.get(header::HOST), "") {
        return Some(Refusal::stranger(
            "this server accepts requests to 127.0.0.1 only",
        ));
    }
    if headers.contains_key(header::ORIGIN)
        && !is_own(&studio.address, headers.get(header::ORIGIN), "http://")
    {
        return Some(Refusal::stranger(
            "this server accepts requests from its own page only",
        ));
    }
    if !studio.rate.admits() {
        return Some(Refusal::too_many());
    }
    let needs_token = request.uri().path().starts_with("/api/");
    if needs_token && !given_token(request, headers).is_some_and(|given| is_token(&studio.address, given)) {
        return Some(Refusal::no_token());
    }
    None
}

/// Returns true if a header names this server.
fn is_own(address: &Address, value: Option<&HeaderValue>, scheme: &str) -> bool {
    let given = value.and_then(|v| v.to_str().ok());
    let own = |name: &str| format!("{scheme}{name}:{}", address.port);
    given.is_some_and(|given| given == own("127.0.0.1") || given == own("localhost"))
}

/// Reads the token from the header, or from the query for requests that cannot set headers.
fn given_token<'a>(request: &'a Request, headers: &'a HeaderMap) -> Option<&'a str> {
    let bearer = headers.get(header::AUTHORIZATION).and_then(|v| v.to_str().ok());
    let in_header = bearer.and_then(|v| v.strip_prefix("Bearer "));
    let in_query = || {
        let query = request.uri().query()?;
        query.split('&').find_map(|pair| pair.strip_prefix("token="))
    };
    in_header.or_else(in_query)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_long_and_new_each_time() {
        let (a, b) = (token().unwrap(), token().unwrap());
        assert_eq!(a.len(), 2 * TOKEN_BYTES);
        assert_ne!(a, b);
        let address = Address {
            port: 1,
            token: a.clone(),
        };
        assert!(is_token(&address, &a));
        for wrong in [&b[..], "", &a[1..], &format!("{a}0")] {
            assert!(!is_token(&address, wrong));
        }
    }
}
