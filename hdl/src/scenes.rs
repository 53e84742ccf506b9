//! Small scenes for tests, and where their taxels are in the memories.

use dermis_golden::estimate::learned::{with_network, Training};
use dermis_golden::fixed::{CasePlan, Model};
use dermis_golden::spec::quads::Quads;
use dermis_golden::spec::scene::Scene;

/// The model of a sensor of `rows` × `cols` taxels; `more` is the rest of the scene file.
pub(crate) fn model(rows: usize, cols: usize, more: &str) -> Model {
    Model::new(&scene(rows, cols, more)).unwrap()
}

fn scene(rows: usize, cols: usize, more: &str) -> Scene {
    let text = format!(
        "name = \"small\"\n[sensor]\nrows = {rows}\ncols = {cols}\npitch_x_mm = 2.0\npitch_y_mm = 2.0\n\
         thickness_mm = 2.0\n{more}"
    );
    Scene::parse(&text, "small.toml").unwrap()
}

/// The model of such a sensor with a network of these hidden layers, hardly trained; `more` adds to table `[search]`.
pub(crate) fn learned(rows: usize, cols: usize, hidden: &[usize], more: &str) -> Model {
    let scene = scene(rows, cols, &format!("[search]\nestimator = \"network\"\n{more}"));
    let (scene, _file) = with_network(scene, &Training::trial(hidden)).unwrap();
    Model::new(&scene).unwrap()
}

/// Where a taxel of the array is.
pub(crate) struct Place {
    /// Index of its subarray.
    pub part: usize,
    /// Address of its quad, over all subarrays.
    pub quad: usize,
    /// Lane from which it is read.
    pub lane: usize,
    /// Lanes to which it is written, one bit each.
    pub mask: u8,
}

impl Place {
    /// Of the taxel of row-major index `taxel`.
    pub(crate) fn of(case: &CasePlan, taxel: usize) -> Place {
        let (layout, grid) = (case.layout(), case.grid());
        let (row, col) = (taxel / (layout.cols * grid.cols), taxel % (layout.cols * grid.cols));
        let part = row / layout.rows * grid.cols + col / layout.cols;
        let location = layout.locate(row % layout.rows, col % layout.cols);
        let quad = part * layout.len() + location.address;
        Place { part, quad, lane: location.lane, mask: location.mask }
    }

    /// Address and lane in a memory of words of `lanes` lanes.
    pub(crate) fn word(&self, lanes: usize) -> (usize, usize) {
        let lane = Quads::LANES * self.quad + self.lane;
        (lane / lanes, lane % lanes)
    }
}
