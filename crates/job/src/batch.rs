//! Names, records and tables of a batch of kits, for all programs that make one.

mod names;
mod record;
mod table;

pub use names::{ENDINGS, Entry, PAGE, RECORDS, models, record_file, record_name};
pub use record::{Record, Status, kit_is};
pub use table::files as tables;
