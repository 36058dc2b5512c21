//! The table as CSV, JSON lines and Parquet.

use super::Format;
use super::rows::{Row, kind_name};
use anyhow::Result;
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use std::io::Write;
use std::sync::Arc;

/// Writes the rows.
///
/// # Errors
/// Those of `to`.
pub(super) fn rows(to: impl Write + Send, format: Format, rows: &[Row]) -> Result<()> {
    match format {
        Format::Csv => csv(to, rows),
        Format::Jsonl => jsonl(to, rows),
        Format::Parquet => parquet(to, rows),
    }
}

const HEADER: [&str; 18] = [
    "light",
    "name",
    "kind",
    "x_m",
    "y_m",
    "z_m",
    "area_m2",
    "power_w",
    "max_contribution",
    "mean_contribution",
    "visible_fraction",
    "samples",
    "probability",
    "min_probability",
    "node",
    "mesh",
    "material",
    "triangle",
];

fn csv(to: impl Write, rows: &[Row]) -> Result<()> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(to);
    // Written here, and not taken from the rows, so that a table without rows has it too.
    writer.write_record(HEADER)?;
    for row in rows {
        writer.serialize(row)?;
    }
    writer.flush()?;
    Ok(())
}

fn jsonl(mut to: impl Write, rows: &[Row]) -> Result<()> {
    for row in rows {
        serde_json::to_writer(&mut to, row)?;
        to.write_all(b"\n")?;
    }
    to.flush()?;
    Ok(())
}

const SCHEMA: &str = "message lights {
    required int64 light;
    required binary name (UTF8);
    required binary kind (UTF8);
    optional float x_m;
    optional float y_m;
    optional float z_m;
    required float area_m2;
    required float power_w;
    required double max_contribution;
    required double mean_contribution;
    optional double visible_fraction;
    required int64 samples;
    required double probability;
    required double min_probability;
    required binary node (UTF8);
    required binary mesh (UTF8);
    required binary material (UTF8);
    required int64 triangle;
}";

fn parquet(to: impl Write + Send, rows: &[Row]) -> Result<()> {
    let schema = Arc::new(parse_message_type(SCHEMA)?);
    let properties = Arc::new(WriterProperties::builder().set_compression(Compression::SNAPPY).build());
    let mut file = SerializedFileWriter::new(to, schema, properties)?;
    columns(rows, file.next_row_group()?)?;
    file.close()?;
    Ok(())
}

fn columns<W: Write + Send>(rows: &[Row], group: SerializedRowGroupWriter<'_, W>) -> Result<()> {
    let mut columns = Columns { rows, group };
    columns.integers(|row| row.light)?;
    columns.texts(|row| &row.name)?;
    columns.texts(|row| kind_name(row.kind))?;
    columns.floats(|row| row.x_m, false)?;
    columns.floats(|row| row.y_m, false)?;
    columns.floats(|row| row.z_m, false)?;
    columns.floats(|row| Some(row.area_m2), true)?;
    columns.floats(|row| Some(row.power_w), true)?;
    columns.doubles(|row| Some(row.max_contribution), true)?;
    columns.doubles(|row| Some(row.mean_contribution), true)?;
    columns.doubles(|row| row.visible_fraction, false)?;
    columns.integers(|row| row.samples)?;
    columns.doubles(|row| Some(row.probability), true)?;
    columns.doubles(|row| Some(row.min_probability), true)?;
    columns.texts(|row| &row.node)?;
    columns.texts(|row| &row.mesh)?;
    columns.texts(|row| &row.material)?;
    columns.integers(|row| row.triangle)?;
    columns.group.close()?;
    Ok(())
}

/// Writes columns in the order of the schema.
struct Columns<'a, 'file, W: Write + Send> {
    rows: &'a [Row],
    group: SerializedRowGroupWriter<'file, W>,
}

impl<W: Write + Send> Columns<'_, '_, W> {
    fn column<T: parquet::data_type::DataType>(&mut self, values: &[T::T], levels: Option<&[i16]>) -> Result<()> {
        let mut column = self
            .group
            .next_column()?
            .ok_or_else(|| anyhow::anyhow!("more columns than the schema has"))?;
        column.typed::<T>().write_batch(values, levels, None)?;
        column.close()?;
        Ok(())
    }

    fn integers(&mut self, get: impl Fn(&Row) -> u64) -> Result<()> {
        let values: Vec<i64> = self
            .rows
            .iter()
            .map(|row| get(row).try_into().unwrap_or(i64::MAX))
            .collect();
        self.column::<Int64Type>(&values, None)
    }

    fn texts(&mut self, get: impl Fn(&Row) -> &str) -> Result<()> {
        let values: Vec<ByteArray> = self.rows.iter().map(|row| get(row).into()).collect();
        self.column::<ByteArrayType>(&values, None)
    }

    fn floats(&mut self, get: impl Fn(&Row) -> Option<f32>, required: bool) -> Result<()> {
        let values: Vec<f32> = self.rows.iter().filter_map(&get).collect();
        let levels = self.levels(|row| get(row).is_some(), required);
        self.column::<FloatType>(&values, levels.as_deref())
    }

    fn doubles(&mut self, get: impl Fn(&Row) -> Option<f64>, required: bool) -> Result<()> {
        let values: Vec<f64> = self.rows.iter().filter_map(&get).collect();
        let levels = self.levels(|row| get(row).is_some(), required);
        self.column::<DoubleType>(&values, levels.as_deref())
    }

    /// Parquet's definition levels: 1 where an optional value is there.
    fn levels(&self, there: impl Fn(&Row) -> bool, required: bool) -> Option<Vec<i16>> {
        (!required).then(|| self.rows.iter().map(|row| there(row).into()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::{Format, HEADER, Row, rows};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use scene::LightKind;

    fn table() -> Vec<Row> {
        let row = |light: u64, visible_fraction: Option<f64>| Row {
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
        assert_eq!(names, HEADER);
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
        assert_eq!(names.iter().collect::<Vec<_>>(), HEADER);
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
}
