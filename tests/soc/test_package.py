"""The script that packages a core for Vivado, run by an interpreter of Tcl with stand-ins for Vivado's commands (vivado.tcl): the IP has the
interfaces of the component of IP-XACT, and its files."""

import json
import subprocess

import pytest
from lxml import etree
from test_cores import BUILD, HERE, generate

TOP = "dermis_press_axi"
# Vivado's names of what AMBA's definitions are called in IP-XACT.
KINDS = {"AXI4Stream": "axis", "AXI4-Lite": "aximm"}


@pytest.fixture(scope="module")
def core():
    """Folder of a core."""
    folder = BUILD / "package"
    generate(folder, "--bus", "axi")
    return folder


def run(folder, script):
    """What the stand-ins write down of a script: a list of fields for each line."""
    (folder / "own.tcl").write_text(script, encoding="utf-8")
    # As Vivado's option -source: the script finds its own folder.
    run = f"source {HERE / 'vivado.tcl'}\nsource {folder / 'own.tcl'}\nclose $calls\n"
    (folder / "run.tcl").write_text(run, encoding="utf-8")
    done = subprocess.run(["yosys", "-q", "-p", "tcl run.tcl"], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(done.stderr)
    return [line.split("\t") for line in (folder / "calls.txt").read_text(encoding="utf-8").splitlines()]


def described(folder):
    """The interfaces of the component of IP-XACT, as the script states them, and the files of its design."""
    component = etree.parse(str(folder / f"{TOP}.xml"))
    interfaces = {}
    for own in component.iterfind(".//{*}busInterface"):
        pairs = zip(own.iterfind(".//{*}logicalPort/{*}name"), own.iterfind(".//{*}physicalPort/{*}name"))
        interfaces[own.findtext("{*}name")] = {
            "kind": f"interface:{KINDS[own.find('{*}busType').get('name')]}",
            "mode": "slave" if own.find("{*}master") is None else "master",
            "ports": {logical.text: physical.text for logical, physical in pairs},
        }
    files = [name.text for name in component.iterfind(".//{*}fileSet[1]/{*}file/{*}name")]
    return interfaces, files, component.findtext("{*}version")


def packaged(calls):
    """The interfaces of the IP, and their parameters."""
    interfaces, parameters = {}, {}
    for fields in calls:
        if fields[0] != "set":
            continue
        _, item, key, value = fields
        kind, *path = item.split(":")
        if kind == "bus":
            own = interfaces.setdefault(path[0], {"ports": {}})
            if key == "bus_type_vlnv":
                own["kind"] = value.removeprefix("xilinx.com:").removesuffix(":1.0")
            elif key == "interface_mode":
                own["mode"] = value
            elif key == "abstraction_type_vlnv":
                assert value == f"xilinx.com:{own['kind']}_rtl:1.0"
        elif kind == "port":
            interfaces[path[1]]["ports"][path[2]] = value
        elif kind == "parameter":
            parameters[path[1], path[2]] = value
    return interfaces, parameters


def check(folder, script):
    calls = run(folder, script)
    interfaces, files, version = described(folder)
    own, parameters = packaged(calls)
    clock = {"kind": "signal:clock", "mode": "slave", "ports": {"CLK": "aclk"}}
    reset = {"kind": "signal:reset", "mode": "slave", "ports": {"RST": "aresetn"}}
    assert own == interfaces | {"aclk": clock, "aresetn": reset}
    # The frequency is that of the clock in a design.
    assert parameters == {
        ("s_axil", "PROTOCOL"): "AXI4LITE",
        ("aclk", "ASSOCIATED_BUSIF"): ":".join(interfaces),
        ("aclk", "ASSOCIATED_RESET"): "aresetn",
        ("aresetn", "POLARITY"): "ACTIVE_LOW",
    }
    constraints = f"{TOP}_ooc.xdc"
    assert [fields[1] for fields in calls if fields[0] == "file"] == [f"file:{name}" for name in [*files, constraints]]
    assert (folder / constraints).read_bytes() == (folder / f"{TOP}.sdc").read_bytes()
    settings = {(fields[1], fields[2]): fields[3] for fields in calls if fields[0] == "set"}
    memories = [name for name in files if name.endswith(".hex")]
    assert memories and all(settings[f"file:{name}", "file_type"] == "Memory Initialization Files" for name in memories)
    assert settings[f"file:{constraints}", "used_in"].split() == ["synthesis", "implementation", "out_of_context"]
    assert settings["fileset:sources_1", "top"] == TOP
    assert f"{settings['core:own', 'version']}.{settings['core:own', 'core_revision']}" == version
    assert settings["bus:s_axil", "slave_memory_map_ref"] == "s_axil"
    assert int(settings["block:map:s_axil:registers", "range"]) >= 4096
    assert calls[-2:] == [["saved", "core:own"], ["closed"]]


def parameters_of_verilog(folder):
    """The parameters in the attributes of clock and reset, as Yosys reads them, and what these are said to be."""
    script = f"read_verilog {TOP}.v; proc; write_json own.json"
    subprocess.run(["yosys", "-q", "-p", script], check=True, cwd=folder)
    nets = json.loads((folder / "own.json").read_text(encoding="utf-8"))["modules"][TOP]["netnames"]
    attributes = {port: nets[port]["attributes"] for port in ["aclk", "aresetn"]}
    text = {port: own["X_INTERFACE_PARAMETER"].split(", ") for port, own in attributes.items()}
    parameters = {(port, *own.split(" ")[:1]): own.split(" ")[1] for port, all in text.items() for own in all}
    return parameters, {port: own["X_INTERFACE_INFO"] for port, own in attributes.items()}


def script_of(folder):
    return (folder / f"{TOP}_package.tcl").read_text(encoding="utf-8")


def test_the_ip_has_the_interfaces_of_ip_xact_and_the_files(core):
    check(core, script_of(core))


def test_the_verilog_has_the_same_parameters(core):
    parameters, infos = parameters_of_verilog(core)
    interfaces, stated = packaged(run(core, script_of(core)))
    assert parameters == {key: value for key, value in stated.items() if key[0] in infos}
    for port, info in infos.items():
        ((signal, _),) = interfaces[port]["ports"].items()
        assert info == f"xilinx.com:{interfaces[port]['kind']}:1.0 {port} {signal}"


@pytest.mark.parametrize(
    "right, wrong",
    [
        # An unknown command, an unknown property, a file that is not there, an interface that is there already.
        ("ipx::save_core", "ipx::save"),
        ("physical_name $port", "physical $port"),
        ("add_files -norecurse {dermis", "add_files -norecurse {dermi"),
        ("ipx::remove_all_bus_interface $core\n", ""),
        # A port of another interface, one that is missing, the wrong direction, a polarity, constraints that are always used.
        ("TLAST m_axis_tlast", "TLAST s_axis_tlast"),
        ("  TKEEP s_axis_tkeep\n", ""),
        ("interface:axis master", "interface:axis slave"),
        ("ACTIVE_LOW", "ACTIVE_HIGH"),
        ("implementation out_of_context", "implementation"),
    ],
)
def test_a_defect_is_found(core, right, wrong):
    text = script_of(core)
    assert right in text
    with pytest.raises((AssertionError, ValueError)):
        check(core, text.replace(right, wrong))


def test_a_bus_that_vivado_does_not_know_has_no_script_and_the_same_core_the_same_bytes(core):
    folder = BUILD / "package-wishbone"
    generate(folder, "--bus", "wishbone")
    assert (folder / "dermis_press_wishbone.xml").exists() and not list(folder.glob("*.tcl"))
    again = BUILD / "package-again"
    generate(again, "--bus", "axi")
    assert script_of(again) == script_of(core)
