//! Tables of `dermis block`.

use dermis_hdl::describe::BlockText;

use super::table::aligned;

/// The ports of a block.
pub fn ports(block: &BlockText) -> String {
    let row = |port: &dermis_hdl::describe::PortText| {
        let direction = if port.output { "out" } else { "in" };
        vec![
            format!("`{}`", port.name),
            direction.to_owned(),
            port.meaning.clone(),
            port.valid.clone(),
            port.bits.to_string(),
        ]
    };
    aligned(4, &["port", "direction", "meaning", "valid", "bits"], block.ports.iter().map(row).collect())
}

/// The described blocks, with the number of ports of those that the scene's engine has.
pub fn blocks(all: &[BlockText]) -> String {
    let row = |block: &BlockText| {
        let (name, path) = (format!("`{}`", block.name), format!("`{}`", block.instance));
        let ports = block.ports.len();
        vec![name, path, block.purpose.clone(), if ports > 0 { ports.to_string() } else { "–".to_owned() }]
    };
    aligned(3, &["block", "instance", "does", "ports"], all.iter().map(row).collect())
}
