//! Tables as CSV, JSON lines and Parquet.

use super::Format;
use anyhow::Result;
use parquet::basic::Compression;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use serde::Serialize;
use std::io::Write;
use std::sync::Arc;

/// A row of a table.
pub(super) trait Row: Serialize {
    /// Names of the columns, those of the fields.
    const HEADER: &'static [&'static str];
    /// Parquet's schema, with the same columns.
    const SCHEMA: &'static str;

    /// Writes all columns, in the order of the schema.
    ///
    /// # Errors
    /// Those of the file.
    fn columns<W: Write + Send>(columns: &mut Columns<'_, '_, W, Self>) -> Result<()>
    where
        Self: Sized;
}

/// Writes the rows.
///
/// # Errors
/// Those of `to`.
pub(super) fn rows<R: Row>(to: impl Write + Send, format: Format, rows: &[R]) -> Result<()> {
    match format {
        Format::Csv => csv(to, rows),
        Format::Jsonl => jsonl(to, rows),
        Format::Parquet => parquet(to, rows),
    }
}

fn csv<R: Row>(to: impl Write, rows: &[R]) -> Result<()> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(to);
    // Written here, and not taken from the rows, so that a table without rows has it too.
    writer.write_record(R::HEADER)?;
    for row in rows {
        writer.serialize(row)?;
    }
    writer.flush()?;
    Ok(())
}

fn jsonl<R: Row>(mut to: impl Write, rows: &[R]) -> Result<()> {
    for row in rows {
        serde_json::to_writer(&mut to, row)?;
        to.write_all(b"\n")?;
    }
    to.flush()?;
    Ok(())
}

fn parquet<R: Row>(to: impl Write + Send, rows: &[R]) -> Result<()> {
    let schema = Arc::new(parse_message_type(R::SCHEMA)?);
    let properties = Arc::new(WriterProperties::builder().set_compression(Compression::SNAPPY).build());
    let mut file = SerializedFileWriter::new(to, schema, properties)?;
    fill(rows, file.next_row_group()?)?;
    file.close()?;
    Ok(())
}

fn fill<W: Write + Send, R: Row>(rows: &[R], group: SerializedRowGroupWriter<'_, W>) -> Result<()> {
    let mut columns = Columns { rows, group };
    R::columns(&mut columns)?;
    columns.group.close()?;
    Ok(())
}

/// Writes columns in the order of the schema.
pub(super) struct Columns<'a, 'file, W: Write + Send, R> {
    rows: &'a [R],
    group: SerializedRowGroupWriter<'file, W>,
}

impl<W: Write + Send, R> Columns<'_, '_, W, R> {
    fn column<T: parquet::data_type::DataType>(&mut self, values: &[T::T], levels: Option<&[i16]>) -> Result<()> {
        let mut column = self
            .group
            .next_column()?
            .ok_or_else(|| anyhow::anyhow!("more columns than the schema has"))?;
        column.typed::<T>().write_batch(values, levels, None)?;
        column.close()?;
        Ok(())
    }

    pub(super) fn integers(&mut self, get: impl Fn(&R) -> u64) -> Result<()> {
        let values: Vec<i64> = self
            .rows
            .iter()
            .map(|row| get(row).try_into().unwrap_or(i64::MAX))
            .collect();
        self.column::<Int64Type>(&values, None)
    }

    pub(super) fn texts(&mut self, get: impl Fn(&R) -> &str) -> Result<()> {
        let values: Vec<ByteArray> = self.rows.iter().map(|row| get(row).into()).collect();
        self.column::<ByteArrayType>(&values, None)
    }

    pub(super) fn flags(&mut self, get: impl Fn(&R) -> bool) -> Result<()> {
        let values: Vec<bool> = self.rows.iter().map(get).collect();
        self.column::<BoolType>(&values, None)
    }

    pub(super) fn floats(&mut self, get: impl Fn(&R) -> Option<f32>, required: bool) -> Result<()> {
        let values: Vec<f32> = self.rows.iter().filter_map(&get).collect();
        let levels = self.levels(|row| get(row).is_some(), required);
        self.column::<FloatType>(&values, levels.as_deref())
    }

    pub(super) fn doubles(&mut self, get: impl Fn(&R) -> Option<f64>, required: bool) -> Result<()> {
        let values: Vec<f64> = self.rows.iter().filter_map(&get).collect();
        let levels = self.levels(|row| get(row).is_some(), required);
        self.column::<DoubleType>(&values, levels.as_deref())
    }

    /// Parquet's definition levels: 1 where an optional value is there.
    fn levels(&self, there: impl Fn(&R) -> bool, required: bool) -> Option<Vec<i16>> {
        (!required).then(|| self.rows.iter().map(|row| there(row).into()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::rows::LightRow;
    use super::{Format, Row, rows};
    use light_cache::CellRecord;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use scene::LightKind;

    fn table() -> Vec<LightRow> {
        let row = |light: u64, visible_fraction: Option<f64>| LightRow {
            light,
            name: format!("lamp, \"{light}\""),
            kind: LightKind::Point,
            x_m: visible_fraction.map(|_| 1.5),
            y_m: Some(2.0),
            z_m: Some(-3.0),
            area_m2: 0.0,
            power_w: 10.0,
            max_contribution: 0.25,
            mean_contribution: 0.125,
            visible_fraction,
            samples: 7,
            probability: 0.5,
            min_probability: 0.0025,
            node: "node".into(),
            mesh: String::new(),
            material: String::new(),
            triangle: 3,
        };
        vec![row(0, Some(0.75)), row(1, None)]
    }

    #[test]
    fn parquet_gives_back_what_was_written() {
        let mut file = tempfile::tempfile().expect("a temporary file");
        rows(&mut file, Format::Parquet, &table()).expect("writable");
        let reader = SerializedFileReader::new(file).expect("readable");
        let lines: Vec<_> = reader
            .get_row_iter(None)
            .expect("rows")
            .map(|row| row.expect("a row"))
            .collect();
        assert_eq!(lines.len(), 2);
        let names: Vec<&String> = lines[0].get_column_iter().map(|(name, _)| name).collect();
        assert_eq!(names, LightRow::HEADER);
        let text = |line: usize, column: usize| lines[line].get_column_iter().nth(column).map(|(_, f)| f.to_string());
        assert_eq!(text(0, 10).as_deref(), Some("0.75"));
        assert_eq!(text(1, 10).as_deref(), Some("null"));
        assert_eq!(text(1, 3).as_deref(), Some("null"));
        assert_eq!(text(1, 4).as_deref(), Some("2.0"));
    }

    #[test]
    fn csv_and_json_lines_say_the_same() {
        let (mut csv_bytes, mut json_bytes) = (Vec::new(), Vec::new());
        rows(&mut csv_bytes, Format::Csv, &table()).expect("writable");
        rows(&mut json_bytes, Format::Jsonl, &table()).expect("writable");
        let mut reader = csv::Reader::from_reader(&csv_bytes[..]);
        let names = reader.headers().expect("header").clone();
        assert_eq!(names.iter().collect::<Vec<_>>(), LightRow::HEADER);
        let records: Vec<csv::StringRecord> = reader.records().map(|r| r.expect("a record")).collect();
        let lines = String::from_utf8(json_bytes).expect("UTF-8");
        assert_eq!(records.len(), lines.lines().count());
        for (record, line) in records.iter().zip(lines.lines()) {
            let json: serde_json::Value = serde_json::from_str(line).expect("JSON");
            for (name, cell) in names.iter().zip(record) {
                match &json[name] {
                    serde_json::Value::Null => assert_eq!(cell, "", "{name}"),
                    serde_json::Value::String(text) => assert_eq!(cell, text, "{name}"),
                    number => assert_eq!(cell.parse::<f64>().ok(), number.as_f64(), "{name}"),
                }
            }
        }
    }

    #[test]
    fn cells_are_written_with_the_columns_of_their_fields() {
        let record = CellRecord {
            cell: 3,
            x_m: 1.0,
            y_m: 2.0,
            z_m: 3.0,
            size_m: 0.5,
            normal: "-y",
            primary: true,
            light: 17,
            lights: 4,
            probability: 0.25,
            visible_fraction: None,
            samples: 9,
            age: 12,
        };
        let mut csv = Vec::new();
        rows(&mut csv, Format::Csv, &[record]).expect("writable");
        let text = String::from_utf8(csv).expect("UTF-8");
        let expected = "3,1.0,2.0,3.0,0.5,-y,true,17,4,0.25,,9,12";
        assert_eq!(text, format!("{}\n{expected}\n", CellRecord::HEADER.join(",")));
        let json = serde_json::to_value(record).expect("serialisable");
        let mut names: Vec<&String> = json.as_object().expect("fields").keys().collect();
        let mut header = CellRecord::HEADER.to_vec();
        names.sort();
        header.sort_unstable();
        assert_eq!(names, header);
        let mut file = tempfile::tempfile().expect("a temporary file");
        rows(&mut file, Format::Parquet, &[record]).expect("writable");
        let reader = SerializedFileReader::new(file).expect("readable");
        let line = reader
            .get_row_iter(None)
            .expect("rows")
            .next()
            .expect("a row")
            .expect("whole");
        let names: Vec<&String> = line.get_column_iter().map(|(name, _)| name).collect();
        assert_eq!(names, CellRecord::HEADER);
    }
}
