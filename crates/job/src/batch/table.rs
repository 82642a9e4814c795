//! Tables of a batch, for machines and for people.

use std::fmt::Write as _;

use shellock_render::escape;

use super::names::{PAGE, TABLE};
use super::record::{Record, Status};

const STYLE: &str = "body{font:15px/1.45 \
     system-ui,sans-serif;margin:24px;color:#26242b;background:#f8f7f5}table{border-collapse:collapse;\
     background:#fff}td,th{padding:6px 10px;border-bottom:1px solid \
     #e3e0dc;text-align:left;vertical-align:top}td.n{text-align:right;font-variant-numeric:\
     tabular-nums}img{width:240px;display:block}.verified{color:#1d7a46}.failed,.no-plan,.too-long,.\
     crashed{color:#c0322b}.refused{color:#8a5a06}small{color:#68646f}@media(prefers-color-scheme:\
     dark){body{background:#1d1c21;color:#ecebf0}table{background:#27262c}td,th{border-color:#3a3841}}";

/// Builds both tables, each with its file name.
pub fn files(records: &[Record]) -> Vec<(String, Vec<u8>)> {
    let files = [(TABLE, csv(records)), (PAGE, html(records))];
    files
        .map(|(name, text)| (name.to_owned(), text.into_bytes()))
        .to_vec()
}

fn csv(records: &[Record]) -> String {
    let mut text = "model,status,kit,pieces,seconds,peak_mb,volume_ratio,problems,warnings,said\n".to_owned();
    for r in records {
        let number = |x: Option<f64>, digits: usize| x.map_or(String::new(), |x| format!("{x:.digits$}"));
        let fields = [
            quote(&r.model),
            r.status.name().to_owned(),
            quote(&r.kit),
            r.pieces.map_or(String::new(), |n| n.to_string()),
            format!("{:.1}", r.seconds),
            number(r.peak_mb, 0),
            number(r.volume_ratio, 3),
            r.n_problems.to_string(),
            r.n_warnings.to_string(),
            quote(r.said.first().map_or("", |said| said)),
        ];
        text += &fields.join(",");
        text.push('\n');
    }
    text
}

/// Quotes a field as in RFC 4180, with an apostrophe before text that spreadsheets would take for a formula.
fn quote(text: &str) -> String {
    let text = text.replace(['\n', '\r'], " ");
    let is_formula = text.starts_with(['=', '+', '-', '@']);
    let text = if is_formula { format!("'{text}") } else { text };
    format!("\"{}\"", text.replace('"', "\"\""))
}

fn html(records: &[Record]) -> String {
    let mut rows = String::new();
    for r in records {
        let has_kit = matches!(r.status, Status::Verified | Status::Failed);
        let picture = if has_kit {
            let kit = address(&r.kit);
            format!(
                "<a href=\"{kit}/report.html\"><img loading=\"lazy\" alt=\"\" src=\"{kit}/pieces.png\"></a>"
            )
        } else {
            String::new()
        };
        let said: Vec<String> = r.said.iter().take(3).map(|said| escape(said)).collect();
        let _ = write!(
            rows,
            "<tr><td>{picture}</td><td>{}</td><td class=\"{s}\">{s}</td><td class=\"n\">{}</td><td \
             class=\"n\">{:.0}</td><td class=\"n\">{}</td><td \
             class=\"n\">{}</td><td><small>{}</small></td></tr>",
            escape(&r.model),
            r.pieces.map_or(String::new(), |n| n.to_string()),
            r.seconds,
            r.peak_mb.map_or(String::new(), |mb| format!("{mb:.0}")),
            r.n_problems + r.n_warnings,
            said.join("<br>"),
            s = r.status.name(),
        );
    }
    let n_verified = records.iter().filter(|r| r.status == Status::Verified).count();
    format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>Kits</title><style>{STYLE}</style><h1>{n_verified} of {} \
         models have a kit that passes every \
         check</h1><table><thead><tr><th>Kit<th>Model<th>Status<th>Pieces<th>Seconds<th>Memory, \
         MB<th>Warnings<th>First message</thead><tbody>{rows}</tbody></table></html>\n",
        records.len()
    )
}

/// Turns a path within the folder into a relative URL.
fn address(path: &str) -> String {
    let mut text = String::new();
    for byte in path.replace('\\', "/").bytes() {
        if byte.is_ascii_alphanumeric() || b"/._-".contains(&byte) {
            text.push(char::from(byte));
        } else {
            let _ = write!(text, "%{byte:02X}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_names_stay_text() {
        assert_eq!(quote("=1+\"a\"\nb"), "\"'=1+\"\"a\"\" b\"");
        assert_eq!(address("a b/\"><script>"), "a%20b/%22%3E%3Cscript%3E");
        assert_eq!(
            escape("<img src=x onerror=\"a\">"),
            "&lt;img src=x onerror=&quot;a&quot;&gt;"
        );
    }
}
