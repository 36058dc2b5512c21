//! A row per entry of what each cell has learned.

use super::write::{Columns, Row};
use anyhow::Result;
use light_cache::CellRecord;
use std::io::Write;

impl Row for CellRecord {
    const HEADER: &'static [&'static str] = &[
        "cell",
        "x_m",
        "y_m",
        "z_m",
        "size_m",
        "normal",
        "primary",
        "light",
        "lights",
        "probability",
        "visible_fraction",
        "samples",
        "age",
    ];

    const SCHEMA: &'static str = "message cells {
        required int64 cell;
        required float x_m;
        required float y_m;
        required float z_m;
        required float size_m;
        required binary normal (UTF8);
        required boolean primary;
        required int64 light;
        required int64 lights;
        required double probability;
        optional double visible_fraction;
        required int64 samples;
        required int64 age;
    }";

    fn columns<W: Write + Send>(columns: &mut Columns<'_, '_, W, Self>) -> Result<()> {
        columns.integers(|row| row.cell)?;
        columns.floats(|row| Some(row.x_m), true)?;
        columns.floats(|row| Some(row.y_m), true)?;
        columns.floats(|row| Some(row.z_m), true)?;
        columns.floats(|row| Some(row.size_m), true)?;
        columns.texts(|row| row.normal)?;
        columns.flags(|row| row.primary)?;
        columns.integers(|row| row.light.into())?;
        columns.integers(|row| row.lights.into())?;
        columns.doubles(|row| Some(row.probability), true)?;
        columns.doubles(|row| row.visible_fraction, false)?;
        columns.integers(|row| row.samples)?;
        columns.integers(|row| row.age)
    }
}
