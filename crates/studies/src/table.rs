//! Named columns of numbers: reads and writes CSV, writes Markdown.

/// Columns of equal length, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Columns in order, each with its name and its values; NaN for missing values.
    pub columns: Vec<(String, Vec<f64>)>,
}

impl Table {
    /// Parses comma-separated numbers under one line of names. Blank lines are skipped; an empty field is a
    /// missing value.
    pub fn from_csv(text: &str) -> Result<Self, String> {
        let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
        let (_, names) = lines
            .next()
            .ok_or("the table is empty; the first line must name the columns")?;
        let mut columns: Vec<(String, Vec<f64>)> = names
            .split(',')
            .map(|n| (n.trim().to_owned(), Vec::new()))
            .collect();
        for (i, line) in lines {
            let fields: Vec<&str> = line.split(',').map(str::trim).collect();
            if fields.len() != columns.len() {
                let n = columns.len();
                return Err(format!(
                    "line {} has {} fields, but there are {n} columns",
                    i + 1,
                    fields.len()
                ));
            }
            for (field, (name, values)) in fields.iter().zip(&mut columns) {
                let value = if field.is_empty() {
                    Some(f64::NAN)
                } else {
                    field.parse().ok().filter(|v: &f64| v.is_finite())
                };
                values.push(value.ok_or(format!(
                    "line {}: \"{field}\" in column \"{name}\" is no number",
                    i + 1
                ))?);
            }
        }
        Ok(Self { columns })
    }

    /// Values of the column `name`; `None` if there is no such column.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.0 == name).map(|c| c.1.as_slice())
    }

    /// Writes the format that [`Self::from_csv`] reads, with the shortest decimals that give the same
    /// numbers.
    pub fn to_csv(&self) -> String {
        let names: Vec<&str> = self.columns.iter().map(|c| c.0.as_str()).collect();
        let rows = self.rows().map(|row| {
            row.map(|v| if v.is_nan() { String::new() } else { v.to_string() })
                .collect::<Vec<_>>()
                .join(",")
        });
        std::iter::once(names.join(","))
            .chain(rows)
            .map(|line| line + "\n")
            .collect()
    }

    /// Table of the rows without missing values.
    pub fn complete(&self) -> Self {
        let is_whole: Vec<bool> = self.rows().map(|mut row| row.all(f64::is_finite)).collect();
        let kept = |values: &[f64]| {
            values
                .iter()
                .zip(&is_whole)
                .filter(|(_, whole)| **whole)
                .map(|(v, _)| *v)
                .collect()
        };
        Self {
            columns: self
                .columns
                .iter()
                .map(|(name, values)| (name.clone(), kept(values)))
                .collect(),
        }
    }

    fn rows(&self) -> impl Iterator<Item = impl Iterator<Item = f64>> {
        let n_rows = self.columns.first().map_or(0, |c| c.1.len());
        (0..n_rows).map(|i| self.columns.iter().filter_map(move |c| c.1.get(i)).copied())
    }
}

/// Writes a Markdown table with these column heads.
pub fn markdown(head: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let rule = line(vec!["---"; head.len()]);
    let body = rows
        .iter()
        .map(|row| line(row.iter().map(String::as_str).collect()));
    [line(head.to_vec()), rule].into_iter().chain(body).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_table_reads_the_same() {
        let columns = vec![
            ("volume".to_owned(), vec![-0.1, 1e-300]),
            ("surface".to_owned(), vec![1.0 / 3.0, 2.0]),
        ];
        let table = Table { columns };
        assert_eq!(Table::from_csv(&table.to_csv()), Ok(table.clone()));
        assert_eq!(table.column("surface"), Some(&[1.0 / 3.0, 2.0][..]));
        assert_eq!(table.column("depth"), None);
    }

    #[test]
    fn a_missing_value_is_an_empty_field() {
        let table = Table::from_csv("a,b\n1,\n,2\n").unwrap();
        assert!(table.columns[0].1[1].is_nan() && table.columns[1].1[0].is_nan());
        assert_eq!(table.to_csv(), "a,b\n1,\n,2\n");
        assert_eq!(table.complete(), Table::from_csv("a,b\n").unwrap());
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let fault = |text: &str| Table::from_csv(text).unwrap_err();
        assert!(fault("").contains("empty"));
        assert!(fault("a,b\n1,2\n\n3\n").contains("line 4 has 1 fields"));
        assert!(fault("a,b\n1,x\n").contains("\"x\" in column \"b\""));
        assert!(fault("a\nNaN\n").contains("no number"));
    }

    #[test]
    fn markdown_has_a_rule_below_its_head() {
        assert_eq!(
            markdown(&["a", "b"], &[vec!["1".into(), "2".into()]]),
            "| a | b |\n| --- | --- |\n| 1 | 2 |\n"
        );
    }
}
