//! The table of `dermis registers`.

use dermis_golden::wire::registers::{Field, REGISTERS};

use super::table::aligned;

/// A row per register, and one per field.
pub fn registers() -> String {
    let rows = REGISTERS.iter().flat_map(|register| {
        let own = [
            format!("0x{:02x}", register.address),
            format!("`{}`", register.name),
            String::new(),
            register.access.name().to_owned(),
            register.meaning.to_owned(),
        ];
        let field = |field: &Field| {
            let bits = match field.bits {
                1 => field.low.to_string(),
                bits => format!("{}:{}", field.low + bits - 1, field.low),
            };
            [String::new(), format!("`{}`", field.name), bits, String::new(), field.meaning.to_owned()]
        };
        [own.to_vec()].into_iter().chain(register.fields.iter().map(move |own| field(own).to_vec()))
    });
    aligned(5, &["address", "register, field", "bits", "access", "meaning"], rows.collect())
}
