//! Results: of one frame, and of frames in the order of time.

use std::sync::Arc;

use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::{FoundContact, Reconstruction as Solved};
use dermis_golden::spec::sensor::Sensor;
use numpy::{PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods};
use pyo3::exceptions::{PyIndexError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyDict, PyList};
use serde::Serialize;

use crate::arrays::{array, cube, grid, interleaved};
use crate::datasets;
use crate::errors::Errors;

/// JSON of a value.
///
/// # Errors
/// A number that JSON cannot represent: a defect of Dermis.
pub fn json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

/// A value as the dictionaries, lists and numbers of its JSON.
///
/// # Errors
/// As [`json`].
pub fn plain<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json(value)?,))
}

fn flags<'py>(py: Python<'py>, flags: &[Flag]) -> PyResult<Bound<'py, PyAny>> {
    plain(py, &flags)
}

/// One contact of a result.
#[pyclass(frozen, module = "dermis")]
pub struct Contact(FoundContact);

#[pymethods]
impl Contact {
    /// Centre of pressure in mm from the array's centre, shape (2,): x, y; None without compressive forces.
    #[getter]
    fn centre_mm<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.centre_mm.map(|centre| array(py, centre))
    }

    /// Ratio of shear to normal force, shape (2,): x, y.
    #[getter]
    fn mu<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.mu)
    }

    /// Standard deviation of mu, shape (2,); None where the estimator gives none.
    #[getter]
    fn mu_sigma<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.mu_sigma.map(|sigma| array(py, sigma))
    }

    /// Force in N, shape (3,): x, y, normal.
    #[getter]
    fn force_N<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.force_N)
    }

    /// Standard deviation of the force in N, shape (3,); None where the estimator gives none.
    #[getter]
    fn sigma_N<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.sigma_N().map(|sigma| array(py, sigma))
    }

    /// Standard deviation of the shear in N, shape (2,): x, y; also of an estimator that knows that of mu alone, from the normal
    /// force; None where the estimator gives none.
    #[getter]
    fn shear_sigma_N<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.shear_sigma_N.map(|sigma| array(py, sigma))
    }

    /// Covariance of mu, shape (2, 2); None where the estimator gives none.
    #[getter]
    fn mu_covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.0.mu_covariance.map(|[xx, xy, yy]| grid(py, &[xx, xy, xy, yy], [2, 2])).transpose()
    }

    /// Number of its taxels; None where the estimator lets contacts overlap.
    #[getter]
    fn taxels(&self) -> Option<usize> {
        self.0.taxels
    }

    fn __repr__(&self) -> String {
        let [x, y, normal] = self.0.force_N;
        let sigma = self.0.sigma_N().map_or("None".to_owned(), |[x, y, z]| format!("[{x:.3}, {y:.3}, {z:.3}]"));
        format!("Contact(force_N=[{x:.3}, {y:.3}, {normal:.3}], sigma_N={sigma})")
    }
}

/// The forces of one frame.
#[pyclass(frozen, module = "dermis")]
pub struct Reconstruction {
    result: Arc<Solved>,
    time_ns: Option<i64>,
    sensor: Sensor,
}

impl Reconstruction {
    /// A result on an array, whose last frame was acquired at `time_ns`.
    pub fn new(result: Arc<Solved>, time_ns: Option<i64>, sensor: &Sensor) -> Reconstruction {
        Reconstruction { result, time_ns, sensor: sensor.clone() }
    }
}

/// The contacts of a result, where it tells them apart.
fn contacts(result: &Solved) -> Option<Vec<Contact>> {
    result.contacts().map(|all| all.into_iter().map(Contact).collect())
}

#[pymethods]
impl Reconstruction {
    /// Name of the scene.
    #[getter]
    fn scene(&self) -> &str {
        &self.result.scene
    }

    /// Name of the frame.
    #[getter]
    fn frame(&self) -> &str {
        &self.result.frame
    }

    /// What computed it: "golden", "fixed" or "board".
    #[getter]
    fn engine(&self) -> &str {
        &self.result.engine
    }

    /// When the last of its frames was acquired, in ns, as it was handed in; None where it was not stated.
    #[getter]
    fn time_ns(&self) -> Option<i64> {
        self.time_ns
    }

    /// Force on each taxel in N, shape (rows, cols, 3): x, y, normal; None with output.forces = "resultants".
    #[getter]
    fn forces_N<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<f64>>>> {
        let forces = &self.result.forces_N;
        let given = !forces.fz.is_empty();
        given.then(|| cube(py, interleaved(forces).collect(), [self.sensor.rows, self.sensor.cols, 3])).transpose()
    }

    /// Sum of the forces in N, shape (3,): x, y, normal.
    #[getter]
    fn resultant_N<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.result.resultant_N)
    }

    /// Standard deviation of resultant_N in N, shape (3,); None where the estimator gives none.
    #[getter]
    fn sigma_N<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.result.sigma_N().map(|sigma| array(py, sigma))
    }

    /// Moment of the forces about the array's centre in N mm, shape (3,): about x, y, and the normal into the sensor; None where a
    /// device sends sums of subarrays.
    #[getter]
    fn moment_Nmm<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.result.extra.wrench.map(|wrench| array(py, wrench.moment_Nmm))
    }

    /// The contacts: with standard deviations of the force from the estimators with evidence; with
    /// partition.case = "contacts" of mu and of the shear, where the estimator has them; None where the contacts are not told
    /// apart.
    #[getter]
    fn contacts(&self) -> Option<Vec<Contact>> {
        contacts(&self.result)
    }

    /// Errors relative to the frame's known force; None where that is not known.
    #[getter]
    fn error(&self) -> Option<Errors> {
        self.result.error.map(Errors)
    }

    /// Limitations of the result, as the guide's page on robustness lists them.
    #[getter]
    fn flags<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        flags(py, &self.result.flags)
    }

    /// The figures behind the flags; one that was not computed is absent.
    #[getter]
    fn checks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        Ok(plain(py, &self.result.checks)?.cast_into::<PyDict>()?)
    }

    /// The result as `dermis reconstruct --json` prints it.
    fn to_json(&self) -> PyResult<String> {
        json(&*self.result)
    }

    /// The fields of `to_json` as dictionaries and lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        Ok(plain(py, &*self.result)?.cast_into::<PyDict>()?)
    }

    /// The result as a dataset of xarray, which must be installed; the package's guide lists its variables.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     xarray is not installed.
    fn to_xarray<'py>(own: &Bound<'py, Reconstruction>) -> PyResult<Bound<'py, PyAny>> {
        datasets::made("of_result", own, &own.get().sensor)
    }

    fn __repr__(&self) -> PyResult<String> {
        let [x, y, normal] = self.result.resultant_N;
        let flags = json(&self.result.flags)?;
        Ok(format!("Reconstruction(resultant_N=[{x:.3}, {y:.3}, {normal:.3}], flags={flags})"))
    }
}

/// The results of frames, in their order.
#[pyclass(frozen, module = "dermis")]
pub struct Reconstructions {
    results: Vec<Arc<Solved>>,
    /// When the last frame of each was acquired.
    times_ns: Vec<Option<i64>>,
    sensor: Sensor,
}

impl Reconstructions {
    /// Results on an array, and when the last frame of each was acquired.
    pub fn new(results: Vec<Arc<Solved>>, times_ns: Vec<Option<i64>>, sensor: &Sensor) -> Reconstructions {
        Reconstructions { results, times_ns, sensor: sensor.clone() }
    }

    fn one(&self, (result, time_ns): (&Arc<Solved>, &Option<i64>)) -> Reconstruction {
        Reconstruction::new(Arc::clone(result), *time_ns, &self.sensor)
    }

    fn timed(&self) -> impl Iterator<Item = (&Arc<Solved>, &Option<i64>)> {
        self.results.iter().zip(&self.times_ns)
    }
}

#[pymethods]
impl Reconstructions {
    fn __len__(&self) -> usize {
        self.results.len()
    }

    fn __getitem__(&self, index: isize) -> PyResult<Reconstruction> {
        let length = self.results.len();
        let counted = if index < 0 { index.checked_add_unsigned(length) } else { Some(index) };
        let place = counted.and_then(|index| usize::try_from(index).ok());
        let result = place.and_then(|index| self.timed().nth(index));
        let absent = || PyIndexError::new_err(format!("index {index} of {length} results"));
        result.map(|result| self.one(result)).ok_or_else(absent)
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let all: Vec<Reconstruction> = self.timed().map(|result| self.one(result)).collect();
        Ok(PyList::new(py, all)?.try_iter()?.into_any())
    }

    /// When the last frame of each result was acquired, in ns, shape (time,); None where one was not stated.
    #[getter]
    fn times_ns<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<i64>>> {
        let times: Option<Vec<i64>> = self.times_ns.iter().copied().collect();
        times.map(|times| PyArray1::from_vec(py, times))
    }

    /// Force on each taxel in N, shape (time, rows, cols, 3): x, y, normal; None with output.forces = "resultants".
    #[getter]
    fn forces_N<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray4<f64>>>> {
        if self.results.iter().any(|result| result.forces_N.fz.is_empty()) {
            return Ok(None);
        }
        let forces: Vec<f64> = self.results.iter().flat_map(|result| interleaved(&result.forces_N)).collect();
        let lengths = [self.results.len(), self.sensor.rows, self.sensor.cols, 3];
        PyArray1::from_vec(py, forces).reshape(lengths).map(Some)
    }

    /// Sum of the forces of each result in N, shape (time, 3): x, y, normal.
    #[getter]
    fn resultant_N<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let forces: Vec<f64> = self.results.iter().flat_map(|result| result.resultant_N).collect();
        grid(py, &forces, [self.results.len(), 3])
    }

    /// Standard deviation of resultant_N in N, shape (time, 3); NaN in the results that have none.
    #[getter]
    fn sigma_N<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let own = |result: &Arc<Solved>| result.sigma_N().unwrap_or([f64::NAN; 3]);
        let sigma: Vec<f64> = self.results.iter().flat_map(own).collect();
        grid(py, &sigma, [self.results.len(), 3])
    }

    /// The contacts of each result, as in Reconstruction.
    #[getter]
    fn contacts(&self) -> Vec<Option<Vec<Contact>>> {
        self.results.iter().map(|result| contacts(result)).collect()
    }

    /// The flags of each result.
    #[getter]
    fn flags<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.results.iter().map(|result| &result.flags).collect::<Vec<_>>())
    }

    /// The results as a dataset of xarray with an axis of time, as Reconstruction has it.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     xarray is not installed.
    fn to_xarray<'py>(own: &Bound<'py, Reconstructions>) -> PyResult<Bound<'py, PyAny>> {
        datasets::made("of_results", own, &own.get().sensor)
    }

    fn __repr__(&self) -> String {
        format!("Reconstructions({} of {}×{} taxels)", self.results.len(), self.sensor.rows, self.sensor.cols)
    }
}
