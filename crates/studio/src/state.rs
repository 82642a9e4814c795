//! State of the server that the guard and all handlers share.

use std::sync::Arc;

use crate::Address;
use crate::bench::Bench;
use crate::jobs::Jobs;
use crate::rate::Rate;

/// State shared by all handlers.
#[derive(Clone)]
pub struct Studio {
    pub address: Arc<Address>,
    pub rate: Arc<Rate>,
    pub bench: Arc<Bench>,
    pub jobs: Arc<Jobs>,
}
