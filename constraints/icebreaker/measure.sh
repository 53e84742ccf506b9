#!/bin/sh
# Logic cells and clock of the serial engine on the iCE40UP5K: Yosys, then place and route.
#   constraints/icebreaker/measure.sh [SCENE [SEED]]
# Needs yosys and nextpnr-ice40; takes a few minutes.
set -e
scene=${1:-eight-by-eight}
seed=${2:-1}
here=$(cd "$(dirname "$0")" && pwd)
work=build/$scene/icebreaker
dermis=${DERMIS:-target/release/dermis}
mkdir -p "$work"
"$dermis" build "$scene" --target-board icebreaker --out "$work" >/dev/null
cp "$here/few_pins.v" "$work"
cd "$work"
top=$(sed -n 's/^ *"top": "\(.*\)",*$/\1/p' manifest.json)
code_bits=$(sed -n 's/^ *"code_bits": \([0-9]*\),*$/\1/p' manifest.json)
yosys -q -p "read_verilog -D ENGINE=$top -D CODE_BITS=$code_bits few_pins.v $top.v; synth_ice40 -dsp -abc2 -top few_pins -json few_pins.json; stat" >few_pins.txt 2>&1
grep -E 'SB_(LUT4|CARRY|MAC16|RAM40_4K|SPRAM256KA) ' few_pins.txt
nextpnr-ice40 --up5k --package sg48 --freq 24 --seed "$seed" --timing-allow-fail --json few_pins.json --asc few_pins.asc --report report.json >route.txt 2>&1
grep 'ICESTORM_LC:' route.txt
grep 'Max frequency' route.txt | tail -1
