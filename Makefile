# Each target sets up what it needs in .venv; nothing else on the machine is touched.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO_OUT ?= runs/demo
INSTALLED := $(VENV)/.installed
BROWSER := $(VENV)/.browser
PLAYGROUND := $(VENV)/.playground
BENCHMARKS := $(VENV)/.benchmarks

.PHONY: demo studio test test-slow test-studio screenshots check format bench bench-demo bench-physics bench-checkpoints \
	bench-selection bench-studio quality continuum fronts paper clean

demo: $(INSTALLED)  ## train on MountainCar with an artificial user, choose, and save a policy (about a minute)
	$(BIN)/jmorl train --env mo-mountaincarcontinuous-v0 --method interactive --user A --out $(DEMO_OUT) --force
	$(BIN)/jmorl show $(DEMO_OUT)

studio: $(INSTALLED)  ## steer a run on MountainCar yourself, on a web page; the address is printed
	$(BIN)/jmorl studio --env mo-mountaincarcontinuous-v0

test: $(INSTALLED)  ## the test suite (a few minutes), the files spread over the cores
	$(BIN)/python -m pytest -n logical --maxprocesses 8 --dist loadfile

test-slow: $(PLAYGROUND)  ## the tests that take minutes each: physics, interrupted runs, learning
	$(BIN)/python -m pytest -m slow

test-studio: $(BROWSER)  ## the studio in a real browser, against real training runs (minutes)
	$(BIN)/python -m pytest -m studio

screenshots: $(BROWSER)  ## the pictures of the studio in the README, made by that test
	mkdir -p docs/studio
	STUDIO_SCREENSHOTS=docs/studio $(BIN)/python -m pytest -m studio -k from_the_start

check: $(INSTALLED)  ## lint, format and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(INSTALLED)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(INSTALLED)  ## speed and memory, beside morl-baselines; the first time it installs that (gigabytes) in .venv-peer
	$(BIN)/python -m benchmarks.speed

bench-demo: $(INSTALLED)  ## what a new user of the demo waits for, with nothing compiled and the second time (2 minutes)
	$(BIN)/python -m benchmarks.demo

bench-checkpoints: $(INSTALLED)  ## what checkpoints cost, as a share of a generation
	$(BIN)/python -m benchmarks.checkpoints

bench-selection: $(INSTALLED)  ## how long the search thinks about a generation, by the number of objectives
	$(BIN)/python -m benchmarks.selection

bench-studio: $(BROWSER)  ## how fast the studio answers, and what it costs the training
	$(BIN)/python -m benchmarks.studio

bench-physics: $(INSTALLED)  ## accuracy and speed of every runner's dynamics, beside MuJoCo and MJX (20 minutes)
	$(BIN)/python -m benchmarks.physics

quality: $(INSTALLED)  ## how good the found policies are against the exact front: 5 seeds, 3 users, 2 methods
	$(BIN)/python -m benchmarks.quality

continuum: $(BENCHMARKS)  ## what blending does to fronts, beside as many steps of training: half an hour
	$(BIN)/python -m benchmarks.continuum

fronts: $(INSTALLED)  ## fronts on the tasks of PGMORL's authors beside published ones: hours; goes on where it was interrupted
	$(BIN)/python -m benchmarks.fronts

paper: $(INSTALLED)  ## the paper's experiments in its units and in raw ones: hours; goes on where it was interrupted
	$(BIN)/jmorl paper

$(INSTALLED): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev,gymnasium,studio,video]'
	touch $@

$(BROWSER): $(INSTALLED) /usr/bin/chromium
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[browser-tests]'
	touch $@

$(PLAYGROUND): $(INSTALLED)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[playground]'
	touch $@

$(BENCHMARKS): $(INSTALLED)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[benchmarks]'
	touch $@

/usr/bin/chromium:
	@test "$$(id -u)" = 0 && command -v apt-get > /dev/null || \
		{ echo "the browser tests need $@: install Debian's package chromium" >&2; exit 1; }
	apt-get update -q && apt-get install -q -y --no-install-recommends chromium

clean:
	rm -rf $(VENV) .venv-peer build *.egg-info .mypy_cache .ruff_cache .pytest_cache
