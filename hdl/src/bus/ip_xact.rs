//! A core, and the arbiter beside one, as components of IP-XACT (IEEE 1685-2014), from which tools take ports, bus interfaces, registers
//! and files.
//!
//! ```text
//! ports of the top module and their interfaces, map of the registers, names of the files ──> <top>.xml
//! ```

use dermis_golden::wire::registers::{Access, Field, Register, ADDRESS_BITS, REGISTERS, REGISTER_BITS};

use super::interfaces::{Interface, TopPort};
use crate::core_file::{LIBRARY, VENDOR};
use crate::manifest::GeneratedFile;

impl Interface {
    fn xml(&self, ports: &[TopPort]) -> String {
        let [vendor, library, name, version] = self.protocol.definition();
        let reference = |ending: &str| {
            format!("vendor=\"{vendor}\" library=\"{library}\" name=\"{name}{ending}\" version=\"{version}\"")
        };
        let (number, count) = self.part;
        let part = |bits: usize| match count {
            1 => String::new(),
            _ => of("partSelect", range((number + 1) * bits / count - 1, number * bits / count)),
        };
        let map = |(logical, (port, _, bits, _)): (String, &TopPort)| {
            let physical = text("name", port) + &part(*bits);
            of("portMap", of("logicalPort", text("name", &logical)) + &of("physicalPort", physical))
        };
        let maps: String = self.ports(ports).map(map).collect();
        let types = format!("<ipxact:abstractionRef {}/>\n", reference("_rtl")) + &of("portMaps", maps);
        let mode = match (self.is_master, self.has_registers()) {
            (true, _) => "<ipxact:master/>\n".to_owned(),
            (false, false) => "<ipxact:slave/>\n".to_owned(),
            (false, true) => of("slave", format!("<ipxact:memoryMapRef memoryMapRef=\"{MAP}\"/>\n")),
        };
        let own = text("name", &self.name)
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

/// The bits `left` to `right`.
fn range(left: usize, right: usize) -> String {
    of("range", number("left", left) + &number("right", right))
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

/// A set of files, of those of these endings the names and types.
fn file_set(name: &str, kinds: &[(&str, &str)], files: &[&str]) -> String {
    let file = |file: &&str| {
        let (_, kind) = kinds.iter().find(|(ending, _)| file.ends_with(ending))?;
        Some(of("file", text("name", file) + kind))
    };
    let own: String = files.iter().filter_map(file).collect();
    if own.is_empty() {
        return own;
    }
    of("fileSet", text("name", name) + &own)
}

/// The component of the module `top` with these `ports` and `interfaces`. Of `files` those are its own that synthesis reads; the timing
/// constraints are a set of files for themselves, because in a design around it they do not count.
pub(super) fn component(top: &str, interfaces: &[Interface], ports: &[TopPort], files: &[&str]) -> GeneratedFile {
    let view = text("name", "rtl") + &text("componentInstantiationRef", "verilog");
    let verilog = text("name", "verilog")
        + &text("language", "verilog")
        + &text("moduleName", top)
        + &of("fileSetRef", text("localName", "rtl"));
    let model = of("views", of("view", view))
        + &of("instantiations", of("componentInstantiation", verilog))
        + &of("ports", ports.iter().map(port).collect());
    let [verilog, constraints] = ["verilogSource", "SDC"].map(|kind| text("fileType", kind));
    let memory = "<ipxact:fileType user=\"memory\">user</ipxact:fileType>\n";
    let sets = file_set("rtl", &[(".v", &verilog), (".hex", memory)], files)
        + &file_set("constraints", &[(".sdc", &constraints)], files);
    let named = text("vendor", VENDOR)
        + &text("library", LIBRARY)
        + &text("name", top)
        + &text("version", env!("CARGO_PKG_VERSION"));
    let maps = match interfaces.iter().any(Interface::has_registers) {
        true => of("memoryMaps", memory_map()),
        false => String::new(),
    };
    let content = named
        + &of("busInterfaces", interfaces.iter().map(|interface| interface.xml(ports)).collect())
        + &maps
        + &of("model", model)
        + &of("fileSets", sets);
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- Generated by `dermis build`; do not edit, build it again. -->\n\
         <ipxact:component xmlns:ipxact=\"http://www.accellera.org/XMLSchema/IPXACT/1685-2014\">\n{content}</ipxact:component>\n"
    );
    GeneratedFile { name: format!("{top}.xml"), text }
}
