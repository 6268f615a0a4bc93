# make demo           install what is missing, render the thesis study, simulate its participants, analyse, serve
# make demo SERVE=0   the same, but end instead of serving
# make test           install what is missing, run every test
# make setup          install what is missing, nothing else
# make clean          remove what was built; .venv stays
.DEFAULT_GOAL := help
.PHONY: help setup test demo clean

SERVE ?= 1
OUT ?= build/thesis
PARTICIPANTS ?= 20
SEED ?= 1
PORT ?= 8000
SUBDERMAL = .venv/bin/subdermal

help:
	@sed -n 's/^# //p' Makefile

setup:
	@tools/setup

test:
	@tools/setup test
	.venv/bin/python -m pytest

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

clean:
	rm -rf build *.egg-info
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
