//! A core as a component of IP-XACT (IEEE 1685-2014), from which tools take ports, bus interfaces, registers and files.
//!
//! ```text
//! ports of the top module, map of the registers, names of the files ──> <top>.xml
//! ```
//! A port belongs to the bus interface whose name it begins with; its name there is the rest, in capitals for AXI.

use dermis_golden::wire::registers::{Access, Field, Register, ADDRESS_BITS, REGISTERS, REGISTER_BITS};

use super::Bus;

/// A port of the top module: name, whether it is an output, width in bits, meaning.
pub(super) type TopPort = (String, bool, usize, String);

/// What a port of the top module is for, of those that begin with a name.
struct Interface {
    /// With what the names of its ports begin.
    prefix: &'static str,
    /// Vendor, library, name and version of its definition.
    definition: [&'static str; 4],
    is_master: bool,
    /// The registers are behind it.
    has_registers: bool,
}

/// AMBA's streams.
const STREAM: [&str; 4] = ["amba.com", "AMBA4", "AXI4Stream", "r0p0_1"];

impl Interface {
    /// The streams, and the bus of the registers.
    fn all(bus: Bus) -> [Interface; 3] {
        let stream = |prefix, is_master| Interface { prefix, definition: STREAM, is_master, has_registers: false };
        let (prefix, definition) = match bus {
            Bus::AxiLite => ("s_axil", ["amba.com", "AMBA4", "AXI4-Lite", "r0p0_0"]),
            Bus::Wishbone => ("wb", ["opencores.org", "bus", "wishbone", "b4"]),
        };
        let registers = Interface { prefix, definition, is_master: false, has_registers: true };
        [stream("s_axis", false), stream("m_axis", true), registers]
    }

    /// The name in the definition of a port of the top module, where it belongs to this interface.
    fn logical(&self, port: &str) -> Option<String> {
        let own = port.strip_prefix(self.prefix)?.strip_prefix('_')?;
        Some(if self.definition[0] == STREAM[0] { own.to_uppercase() } else { own.to_owned() })
    }

    fn xml(&self, ports: &[TopPort]) -> String {
        let Interface { prefix, definition: [vendor, library, name, version], is_master, has_registers } = self;
        let reference = |ending: &str| {
            format!("vendor=\"{vendor}\" library=\"{library}\" name=\"{name}{ending}\" version=\"{version}\"")
        };
        let map = |(port, ..): &TopPort| {
            let logical = of("logicalPort", text("name", &self.logical(port)?));
            Some(of("portMap", logical + &of("physicalPort", text("name", port))))
        };
        let maps: String = ports.iter().filter_map(map).collect();
        let types = format!("<ipxact:abstractionRef {}/>\n", reference("_rtl")) + &of("portMaps", maps);
        let mode = match (is_master, has_registers) {
            (true, _) => "<ipxact:master/>\n".to_owned(),
            (false, false) => "<ipxact:slave/>\n".to_owned(),
            (false, true) => of("slave", format!("<ipxact:memoryMapRef memoryMapRef=\"{MAP}\"/>\n")),
        };
        let own = text("name", prefix)
            + &format!("<ipxact:busType {}/>\n", reference(""))
            + &of("abstractionTypes", of("abstractionType", types))
            + &mode;
        of("busInterface", own)
    }
}

/// Name of the memory map.
const MAP: &str = "registers";

/// An element of content that is markup.
fn of(name: &str, content: String) -> String {
    format!("<ipxact:{name}>\n{content}</ipxact:{name}>\n")
}

/// An element of text.
fn text(name: &str, text: &str) -> String {
    let escaped = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    format!("<ipxact:{name}>{escaped}</ipxact:{name}>\n")
}

/// An element of a number.
fn number(name: &str, number: usize) -> String {
    text(name, &number.to_string())
}

fn field(access: Access, Field { name, low, bits, meaning }: &Field) -> String {
    let meaning = if meaning.is_empty() { String::new() } else { text("description", meaning) };
    let accessed = if access.is_written() { "read-write" } else { "read-only" };
    let cleared = if access == Access::ClearedByOne { text("modifiedWriteValue", "oneToClear") } else { String::new() };
    let places = number("bitOffset", *low) + &number("bitWidth", *bits);
    of("field", text("name", name) + &meaning + &places + &text("access", accessed) + &cleared)
}

fn register(register: &Register) -> String {
    let Register { name, address, access, meaning, .. } = register;
    let fields: String = register.parts().iter().map(|own| field(*access, own)).collect();
    let place = number("addressOffset", *address) + &number("size", REGISTER_BITS);
    of("register", text("name", name) + &text("description", meaning) + &place + &fields)
}

fn memory_map() -> String {
    let size = number("baseAddress", 0) + &number("range", 1 << ADDRESS_BITS) + &number("width", REGISTER_BITS);
    let block = text("name", "dermis") + &size + &REGISTERS.iter().map(register).collect::<String>();
    of("memoryMap", text("name", MAP) + &of("addressBlock", block) + &number("addressUnitBits", 8))
}

fn port((name, is_output, bits, meaning): &TopPort) -> String {
    let range = || of("vectors", of("vector", number("left", bits - 1) + &number("right", 0)));
    let range = if *bits > 1 { range() } else { String::new() };
    let wire = text("direction", if *is_output { "out" } else { "in" }) + &range;
    of("port", text("name", name) + &text("description", meaning) + &of("wire", wire))
}

/// The component of the core whose top module is `top` with these `ports`, and whose Verilog and memory files are among `files`.
pub(super) fn component<'f>(top: &str, bus: Bus, ports: &[TopPort], files: impl Iterator<Item = &'f str>) -> String {
    let interfaces = Interface::all(bus).map(|interface| interface.xml(ports)).concat();
    let view = text("name", "rtl") + &text("componentInstantiationRef", "verilog");
    let verilog = text("name", "verilog")
        + &text("language", "verilog")
        + &text("moduleName", top)
        + &of("fileSetRef", text("localName", "rtl"));
    let model = of("views", of("view", view))
        + &of("instantiations", of("componentInstantiation", verilog))
        + &of("ports", ports.iter().map(port).collect());
    let kind = |name: &str| match name.rsplit_once('.')?.1 {
        "v" => Some(text("fileType", "verilogSource")),
        "hex" => Some("<ipxact:fileType user=\"memory\">user</ipxact:fileType>\n".to_owned()),
        _ => None,
    };
    let own = |name: &str| {
        name.strip_prefix(top).is_some_and(|rest| rest.starts_with(['.', '_']) && !rest.starts_with("_tb"))
    };
    let file = |name: &str| Some(of("file", text("name", name) + &kind(name)?));
    let files: String = files.filter(|name| own(name)).filter_map(file).collect();
    let named = text("vendor", "dermis")
        + &text("library", "ip")
        + &text("name", top)
        + &text("version", env!("CARGO_PKG_VERSION"));
    let content = named
        + &of("busInterfaces", interfaces)
        + &of("memoryMaps", memory_map())
        + &of("model", model)
        + &of("fileSets", of("fileSet", text("name", "rtl") + &files));
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- Generated by `dermis build`; do not edit, build it again. -->\n\
         <ipxact:component xmlns:ipxact=\"http://www.accellera.org/XMLSchema/IPXACT/1685-2014\">\n{content}</ipxact:component>\n"
    )
}
