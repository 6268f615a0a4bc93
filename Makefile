# make demo           install what is missing, render the thesis study, simulate its participants, analyse, serve
# make demo SERVE=0   the same, but end instead of serving
# make test           install what is missing, check the style, run every test
# make test-bayes     install the sampler of `subdermal posterior` too, run its tests
# make test-cluster   install Dask's distributed too, run the tests of builds by several processes
# make test-parquet   install pyarrow too, run the tests of responses.parquet
# make test-postgres  install PostgreSQL and its driver, run the tests of the questionnaire over it
# make test-visibility  install ColorVideoVDP and torch too, run the tests of predicted visibility
# make setup          install what is missing, nothing else
# make bench          measure: tables of every benchmarks/*.py; make bench BENCH=photons for one alone
# make gallery        draw the pictures of docs/gallery.md again
# make pages          photograph the pages that docs/studies.md and docs/serving.md show again
# make translations   collect the messages of the pages into app/translations/*/*.po and compile them
# make clean          remove what was built; .venv stays
.DEFAULT_GOAL := help
.PHONY: help setup gallery pages test test-bayes test-cluster test-parquet test-postgres test-visibility demo bench translations clean

SERVE ?= 1
OUT ?= build/thesis
PARTICIPANTS ?= 20
SEED ?= 1
PORT ?= 8000
BENCH ?= $(sort $(basename $(notdir $(wildcard benchmarks/*.py))))
SUBDERMAL = .venv/bin/subdermal

help:
	@sed -n 's/^# //p' Makefile

setup:
	@tools/setup

test:
	@tools/setup test
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/python -m pytest --numprocesses $$(($$(getconf _NPROCESSORS_ONLN) + 1)) --maxprocesses 4 --dist loadfile

test-bayes:
	@tools/setup test
	.venv/bin/python -m pip --quiet --disable-pip-version-check install --no-deps \
		--require-hashes --only-binary :all: -r requirements-bayes.lock
	.venv/bin/python -m pytest tests/posterior

test-cluster:
	@tools/setup test
	.venv/bin/python -m pip --quiet --disable-pip-version-check install --no-deps \
		--require-hashes --only-binary :all: -r requirements-cluster.lock
	.venv/bin/python -m pytest tests/cluster

test-parquet:
	@tools/setup test
	.venv/bin/python -m pip --quiet --disable-pip-version-check install --no-deps \
		--require-hashes --only-binary :all: -r requirements-parquet.lock
	.venv/bin/python -m pytest tests/app/test_parquet.py tests/app/test_dashboard.py

test-postgres:
	@tools/setup test
	.venv/bin/python -m pip --quiet --disable-pip-version-check install --no-deps \
		--require-hashes --only-binary :all: -r requirements-postgres.lock
	tools/with-postgres .venv/bin/python -m pytest tests/app --ignore tests/app/test_browser.py

test-visibility:
	@tools/setup test
	.venv/bin/python -m pip --quiet --disable-pip-version-check install --no-deps \
		--require-hashes --only-binary :all: -r requirements-visibility.lock
	.venv/bin/python -m pytest tests/visibility tests/stimuli/test_visibility.py

demo: setup
	$(SUBDERMAL) build stimuli/studies/thesis.toml --out $(OUT)
	$(SUBDERMAL) simulate $(OUT) --participants $(PARTICIPANTS) --seed $(SEED)
	$(SUBDERMAL) analyse $(OUT)/simulated/responses.csv --study $(OUT) --out $(OUT)/simulated/report
ifeq ($(SERVE),0)
	@echo "questionnaire and dashboard: $(SUBDERMAL) serve $(OUT)"
	@echo "report: file://$(abspath $(OUT))/simulated/report/report.html"
else
	$(SUBDERMAL) serve $(OUT) --port $(PORT)
endif

bench: setup
	@for name in $(BENCH); do printf '\n== %s\n' "$$name"; PYTHONPATH=. .venv/bin/python "benchmarks/$$name.py" || exit 1; done

JPEG = .venv/bin/python -c 'import sys; from PIL import Image; Image.open(sys.argv[1]).convert("RGB").save(sys.argv[2], quality=90, optimize=True)'

# The commands of docs/gallery.md, in its order.
gallery: setup
	$(SUBDERMAL) build stimuli/studies/thesis.toml --out build/thesis
	$(SUBDERMAL) strip build/thesis --crop 270x270+830+540 --crop 270x300+1520+365 --out docs/close-up.png
	$(SUBDERMAL) compare thesis -t all -t golubev:samples=256 -f close-up --size 480x270 --crop 270x110+180+95 --walks 64 --set materials.head.tarsus=0 --set materials.head.lip_muscle=0 --set materials.head.nose_wing=0 --set materials.head.cartilage=0 --out docs/reference/close-up.png
	$(SUBDERMAL) compare docs/scenes/bars.toml -t deon_luebke:texturing=0 --against jimenez_gaussian:texturing=0 --size 480x270 --out docs/scenes/bars.png
	$(SUBDERMAL) compare docs/scenes/spots.toml -t jimenez_separable:jitter=false -t jimenez_separable -t golubev --against deon_luebke --size 480x180 --columns 2 --out docs/scenes/spots.png
	$(SUBDERMAL) render --scene docs/scenes/maps.toml -t golubev --size 1280x336 --out docs/scenes/maps.png
	$(SUBDERMAL) build stimuli/studies/spheres.toml --out build/spheres
	$(SUBDERMAL) strip build/spheres -f lamp -f behind -f environment --out build/spheres.png
	$(SUBDERMAL) build stimuli/studies/stone.toml --out build/stone
	$(SUBDERMAL) strip build/stone -f lamp -f behind -f two_lamps -f environment --out build/stone.png
	$(SUBDERMAL) illumination build/illumination --samples 128
	$(SUBDERMAL) redraw docs/figures --photons 3000000
	$(JPEG) build/spheres.png docs/scenes/spheres.jpg
	$(JPEG) build/stone.png docs/scenes/stone.jpg
	$(JPEG) build/illumination/gallery.png docs/illumination.jpg

# What docs/studies.md and docs/serving.md show of the questionnaire and of the dashboard.
pages:
	@tools/setup test
	$(SUBDERMAL) build docs/pages.toml --out build/pages
	rm -rf build/pages/simulated*
	$(SUBDERMAL) simulate build/pages --participants 60 --seed 7
	.venv/bin/python tools/pages build/pages

translations: setup
	mkdir -p build
	.venv/bin/pybabel -q extract -F app/translations/babel.cfg -k message -k lazy_gettext \
		--no-location --sort-output -o build/messages.pot .
	.venv/bin/pybabel -q update -i build/messages.pot -d app/translations --no-fuzzy-matching \
		--ignore-obsolete --no-wrap
	.venv/bin/pybabel -q compile -d app/translations

clean:
	rm -rf build *.egg-info
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
