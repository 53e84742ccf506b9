//! Reference values from independent programs, for tests: `data/reference/values.json`.

use serde::Deserialize;

/// Contents of the file.
#[derive(Deserialize)]
pub struct Values {
    pub influence: Vec<Cell>,
    pub family: Vec<Family>,
}

/// Influence of one cell at one offset; the coefficients are text of 17 digits.
#[derive(Debug, Deserialize)]
pub struct Cell {
    pub cell_x_mm: f64,
    pub cell_y_mm: f64,
    pub thickness_mm: f64,
    pub dx_mm: f64,
    pub dy_mm: f64,
    pub cx: String,
    pub cy: String,
    pub cz: String,
}

/// The polynomial of one shipped frame; vectors have their first ten entries.
#[derive(Deserialize)]
pub struct Family {
    pub sensor: String,
    pub frame: String,
    pub p0: Vec<f64>,
    pub p0_sum: f64,
    pub v10: Vec<f64>,
    pub v01: Vec<f64>,
    pub v21: Vec<f64>,
    pub at: Vec<At>,
}

/// The exact solution at one μ.
#[derive(Deserialize)]
pub struct At {
    pub mu: [f64; 2],
    pub p_first_ten: Vec<f64>,
    pub p_sum: f64,
    pub sparse_exact: f64,
}

/// Reads the file.
pub fn values() -> Values {
    serde_json::from_str(include_str!("../data/reference/values.json")).unwrap()
}
