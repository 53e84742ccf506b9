//! Contacts as dictionaries, with the keys that a frame file has.

use dermis_golden::data::frame::Contact;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{numbers, vector};
use crate::exceptions::input;

/// The keys.
const KEYS: [&str; 8] =
    ["shape", "centre_mm", "size_mm", "normal_N", "tangential_N", "kind_of_slip", "friction", "rotation_rad"];

/// The contacts of a list of dictionaries.
///
/// # Errors
/// `InputError` with number and key, for an unknown key or a value of another type.
pub fn contacts(list: &Bound<'_, PyAny>) -> PyResult<Vec<Contact>> {
    let items = list.try_iter().map_err(|_| input("contacts: wanted a list of dictionaries"))?;
    items.enumerate().map(|(index, item)| contact(index, &item?)).collect()
}

fn contact(index: usize, item: &Bound<'_, PyAny>) -> PyResult<Contact> {
    let wrong = || input(format!("contact {index}: wanted a dictionary with keys of {}", KEYS.join(", ")));
    let mut contact = Contact::default();
    for (key, value) in item.cast::<PyDict>().map_err(|_| wrong())?.iter() {
        let key: String = key.extract().map_err(|_| wrong())?;
        let name = format!("contact {index}: {key}");
        let text = || value.extract::<String>().map_err(|_| not(&name, &value, "text"));
        let number = || value.extract::<f64>().map_err(|_| not(&name, &value, "a number"));
        match key.as_str() {
            "shape" => contact.shape = Some(text()?),
            "centre_mm" => contact.centre_mm = Some(vector(&name, &value)?),
            "size_mm" => contact.size_mm = numbers(&name, &value)?.as_slice()?.to_vec(),
            "normal_N" => contact.normal_N = Some(number()?),
            "tangential_N" => contact.tangential_N = Some(vector(&name, &value)?),
            "kind_of_slip" => contact.kind_of_slip = Some(text()?),
            "friction" => contact.friction = Some(number()?),
            "rotation_rad" => contact.rotation_rad = Some(number()?),
            _ => return Err(input(format!("contact {index}: unknown key {key:?}; known: {}", KEYS.join(", ")))),
        }
    }
    Ok(contact)
}

fn not(name: &str, value: &Bound<'_, PyAny>, wanted: &str) -> PyErr {
    match value.repr() {
        Ok(shown) => input(format!("{name} = {shown} is not {wanted}")),
        Err(error) => error,
    }
}
