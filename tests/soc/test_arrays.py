"""Several arrays on one core: generates the core, and an engine of each array alone, and runs arrays.py under Icarus."""

import os
import re
import shutil
import subprocess

import pytest
from dermis_litex import CoreError
from gateware import BehindArbiter, write_verilog
from test_cores import BUILD, DERMIS, HERE, environment, generate, icarus

ARRAYS = 4
VERSION = 7
STREAM = ["tdata", "tvalid", "tready", "tlast"]


@pytest.fixture(scope="module")
def arrays_scene():
    """The scene beside the tables of its arrays, which have zeros of their own and the same largest gain; and an engine of each."""
    folder = BUILD / "arrays"
    folder.mkdir(parents=True, exist_ok=True)
    scene = shutil.copy(HERE / "arrays.toml", folder)
    for array in range(ARRAYS):
        places = [(row, col) for row in range(4) for col in range(3)]
        lines = [f"{row},{col},{0.002 * array * (row - col)},{1 - 0.1 * array * (row > 0)}\n" for row, col in places]
        (folder / f"arrays-{array}.csv").write_text("row,col,offset,gain\n" + "".join(lines), encoding="utf-8")
        generate(folder / f"alone-{array}", scene=f"{scene}#{array}")
    image = [DERMIS, "load", scene, f"{scene}#0", "--tables-version", str(VERSION), "--out", folder / "first.tables"]
    subprocess.run(image, check=True, stdout=subprocess.DEVNULL)
    return scene


# The core behind its arbiter; the sender of each array has pins of its own.
BEHIND_ARBITER = """
module behind_arbiter (
    input wire aclk, input wire aresetn,
    {senders}
    output wire [63:0] m_axis_tdata, output wire [7:0] m_axis_tkeep, output wire [2:0] m_axis_tuser,
    output wire [5:0] m_axis_tid, output wire m_axis_tvalid, input wire m_axis_tready, output wire m_axis_tlast,
    {pins}
);
    wire [31:0] tdata;
    wire [3:0] tkeep;
    wire [5:0] tid;
    wire tvalid, tready, tlast;
    dermis_arrays_axi_arbiter arbiter (
        .aclk(aclk), .aresetn(aresetn),
        .s_axis_tdata({{{tdata}}}), .s_axis_tvalid({{{tvalid}}}), .s_axis_tready({{{tready}}}), .s_axis_tlast({{{tlast}}}),
        .m_axis_tdata(tdata), .m_axis_tkeep(tkeep), .m_axis_tid(tid),
        .m_axis_tvalid(tvalid), .m_axis_tready(tready), .m_axis_tlast(tlast)
    );
    dermis_arrays_axi core (
        .aclk(aclk), .aresetn(aresetn),
        .s_axis_tdata(tdata), .s_axis_tkeep(tkeep), .s_axis_tid(tid),
        .s_axis_tvalid(tvalid), .s_axis_tready(tready), .s_axis_tlast(tlast),
        .m_axis_tdata(m_axis_tdata), .m_axis_tkeep(m_axis_tkeep), .m_axis_tuser(m_axis_tuser), .m_axis_tid(m_axis_tid),
        .m_axis_tvalid(m_axis_tvalid), .m_axis_tready(m_axis_tready), .m_axis_tlast(m_axis_tlast),
        {connected}
    );
endmodule
"""


def behind_arbiter(core):
    """That module, with the pins of the bus as the module of the core has them."""
    head = core[core.index("module dermis_arrays_axi (") : core.index(");")]
    pins = re.findall(r"(?:in|out)put (?:wire|reg) (?:\[\d+:0\] )?s_axil_\w+", head)
    names = [pin.rsplit(" ", 1)[1] for pin in pins]
    sender = (
        "input wire [31:0] s{0}_axis_tdata, input wire s{0}_axis_tvalid, output wire s{0}_axis_tready, "
        "input wire s{0}_axis_tlast,"
    )
    return BEHIND_ARBITER.format(
        senders="\n    ".join(sender.format(array) for array in range(ARRAYS)),
        pins=",\n    ".join(pin.replace(" reg ", " wire ") for pin in pins),
        connected=",\n        ".join(f".{name}({name})" for name in names),
        **{of: ", ".join(f"s{array}_axis_{of}" for array in reversed(range(ARRAYS))) for of in STREAM},
    )


def simulate(scene, folder, change=lambda text: text, module="arrays", bus="axi", sinks=lambda all: all):
    generate(folder, "--bus", bus, "--stream-bits", "64", scene=scene)
    verilog = folder / f"dermis_arrays_{bus}.v"
    verilog.write_text(change(verilog.read_text(encoding="utf-8")), encoding="utf-8")
    alone = BUILD / "arrays/alone-{}/dermis_arrays_tb_beats.hex"
    more = {"DERMIS_ARRAYS": str(ARRAYS), "DERMIS_ALONE": str(alone)}
    more |= {"DERMIS_IMAGE": str(BUILD / "arrays/first.tables"), "DERMIS_VERSION": str(VERSION)}
    if "DERMIS_NIGHTLY" in os.environ:
        more["DERMIS_ROUNDS"] = "200"
    more = environment(bus, 64, BUILD / "arrays/alone-0/dermis_arrays_tb") | more
    if module == "arrays":
        return icarus(folder, "dermis_arrays_axi", [verilog], module, more)
    if bus == "wishbone":
        in_litex = BehindArbiter(folder)
        in_litex.arbiter.sinks = sinks(in_litex.arbiter.sinks)
        return icarus(folder, "behind_arbiter", write_verilog(in_litex, in_litex.pins(), folder, "behind_arbiter"), module, more)
    top = folder / "behind_arbiter.v"
    top.write_text(behind_arbiter(verilog.read_text(encoding="utf-8")), encoding="utf-8")
    arbiter = folder / "dermis_arrays_axi_arbiter.v"
    return icarus(folder, "behind_arbiter", [top, arbiter, verilog], module, more)


def test_arrays(arrays_scene):
    assert simulate(arrays_scene, BUILD / "arrays/axi") == (3, 0)


def test_each_array_has_a_sender_of_its_own(arrays_scene):
    assert simulate(arrays_scene, BUILD / "arrays/arbiter", module="arbiter") == (2, 0)


def test_each_array_has_a_sender_of_its_own_in_litex(arrays_scene):
    assert simulate(arrays_scene, BUILD / "arrays/litex", module="arbiter", bus="wishbone") == (2, 0)


def test_a_sender_of_another_array_is_found(arrays_scene):
    of_another = lambda sinks: sinks[::-1]
    tests, failed = simulate(arrays_scene, BUILD / "arrays/swapped", module="arbiter", bus="wishbone", sinks=of_another)
    assert tests == 2 and failed > 0


def test_a_core_of_one_array_has_no_arbiter(arrays_scene):
    generate(BUILD / "arrays/one", "--bus", "wishbone", scene=f"{arrays_scene}#0")
    with pytest.raises(CoreError, match="manifest.json: no core.arbiter, and hardware.arrays = 1"):
        BehindArbiter(BUILD / "arrays/one")


@pytest.mark.parametrize(
    "name, right, count, wrong",
    [
        # Zeros, gains and means of the first array are those of all; an image is written to the array of the next frame.
        ("place", "wire [5:0] place = {s_axis_tid, taxel};", 2, "wire [5:0] place = {2'd0, taxel};"),
        ("image", "{write_array, write_taxel}", 1, "{s_axis_tid, write_taxel}"),
    ],
)
def test_a_defect_is_found(arrays_scene, name, right, count, wrong):
    def change(text):
        assert text.count(right) == count, right
        return text.replace(right, wrong)

    tests, failed = simulate(arrays_scene, BUILD / f"arrays/defect-{name}", change)
    assert tests == 3 and failed > 0
