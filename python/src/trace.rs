//! The stages of one frame: the integers of the hardware beside the same in floating point.

use dermis_report::{trace, ComparedWords};
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;

use crate::exceptions::input;
use crate::frame::{frames, Frames};
use crate::scene::Scene;

/// What one stage passes on for a frame, in integers and in floating point.
#[pyclass(frozen, module = "dermis")]
pub struct Stage {
    name: &'static str,
    bits: u32,
    words: Vec<i64>,
    floating: Vec<f64>,
    lsb: Vec<f64>,
}

#[pymethods]
impl Stage {
    /// Name of the stage; the guide has a page for each.
    #[getter]
    fn name(&self) -> &'static str {
        self.name
    }

    /// Unit of fixed, floating and lsb: "MPa", "N", or "1" for the ratio of shear to normal force.
    #[getter]
    fn unit(&self) -> &'static str {
        match self.name {
            "receive" | "normalise" | "fold" => "MPa",
            "search" => "1",
            _ => "N",
        }
    }

    /// Width of a word in bits, sign included.
    #[getter]
    fn bits(&self) -> u32 {
        self.bits
    }

    /// The integers, shape (words,), in the hardware's order.
    #[getter]
    fn words<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.words.to_pyarray(py)
    }

    /// What one step of each word is worth, shape (words,).
    #[getter]
    fn lsb<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.lsb.to_pyarray(py)
    }

    /// The integers as what they stand for, words * lsb, shape (words,).
    #[getter]
    fn fixed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.words.iter().zip(&self.lsb).map(|(word, lsb)| *word as f64 * lsb))
    }

    /// The same values in floating point, from the unquantised stress with unrounded matrices, shape (words,).
    #[getter]
    fn floating<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.floating.to_pyarray(py)
    }

    fn __repr__(&self) -> String {
        format!("Stage({:?}, {} words of {} bits, {})", self.name, self.words.len(), self.bits, self.unit())
    }
}

#[pymethods]
impl Scene {
    /// Compute every stage of the hardware for one frame, beside the same in floating point.
    ///
    /// The floating-point values start from the unquantised stress and take the exponents of the integers. Stage forces is
    /// computed at the integers' mu: it shows the error of the arithmetic alone; stage send shows arithmetic and search.
    ///
    /// Parameters
    /// ----------
    /// frame : array of shape (rows, cols), or Frame
    ///
    /// Returns
    /// -------
    /// list of Stage
    ///     In the order of the pipeline.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A frame of another shape; a scene without hardware, with averaged frames or a case chosen per frame.
    fn trace(&self, py: Python<'_>, frame: &Bound<'_, PyAny>) -> PyResult<Vec<Stage>> {
        let Frames { frames, single } = frames(self.spec(), frame)?;
        let one = frames.into_iter().next().filter(|_| single).ok_or_else(|| input("frame: wanted one frame"))?;
        let stages = py.detach(|| trace(self.spec(), &one)).map_err(input)?;
        let stage = |(name, bits, compared): (&'static str, u32, ComparedWords)| {
            let floating = compared.values.iter().zip(&compared.lsb).map(|(value, lsb)| value * lsb).collect();
            Stage { name, bits, words: compared.words, floating, lsb: compared.lsb }
        };
        Ok(stages.into_iter().map(stage).collect())
    }
}
