# Wants GNU make and a python3 of 3.10 or newer with its venv module; sets up the rest in .venv,
# with ROS 2 Jazzy from PyPI's wheels, or with the ROS that the shell has sourced.
PYTHON ?= python3
RUN_EXTRAS := viewer
EXTRAS := test,report,fit,viewer,replay,falls
# Processes of the tests, most of which wait: a half more than the cores of a quiet machine.
WORKERS ?= 3
VENV := .venv
BIN := $(VENV)/bin
PIP = $(BIN)/python -m pip --disable-pip-version-check
BRIEF = $$(test -t 2 || echo --quiet)
# pip's warnings are nothing to act on; what it says is shown where it fails.
UNWARNED = 2>$(VENV)/pip.log || { cat $(VENV)/pip.log >&2; exit 1; }

# 3.12, or old-3.8, or nothing; and the sourced ROS, or wheels.
VERSION := $(shell $(PYTHON) -c 'import sys; v = sys.version_info; \
	print(("" if v >= (3, 10) else "old-") + "%d.%d" % v[:2])' 2>/dev/null)
ROS := $(or $(ROS_DISTRO),wheels)
READY := $(VENV)/ready-$(VERSION)-$(ROS)
COMPILED := $(VENV)/compiled-$(VERSION)-$(ROS)
# What `make run` needs is there first; the rest, more than as much again, when a target needs it.
COMPLETE := $(VENV)/complete-$(VERSION)-$(ROS)

ifeq ($(ROS),wheels)
ROS_EXTRA := ,ros
else
VENV_FLAGS := --system-site-packages
endif

.PHONY: help run test pictures gallery lint slow soak bench hard report colcon users-versions clean
help: ## list of all targets
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 22

run: $(COMPILED) ## start node and page; arrow keys push; SCENE=crowd for another scene
	@$(BIN)/python -m ragdoll_ros.ros.run $(SCENE)

# A file's tests stay together: those of one ROS domain, and those that time, go one by one.
test: $(COMPLETE) $(COMPILED) chromium ## all tests except the slow ones
	@$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile

# For the tests of the page: of Playwright only the driver comes from PyPI. Where there is none to
# be had, those tests are skipped and say so.
CHROMIUM ?= chromium
AS_ROOT := $(shell test "$$(id -u)" = 0 || echo sudo -n) env DEBIAN_FRONTEND=noninteractive
.PHONY: chromium
chromium:
	@command -v $(CHROMIUM) >/dev/null || command -v google-chrome >/dev/null || { \
	  echo 'Installing chromium, in which the page is tested'; \
	  { $(AS_ROOT) apt-get update && $(AS_ROOT) apt-get install --yes --no-install-recommends \
	  chromium; } >/dev/null 2>&1 || echo 'That needs root and Debian: apt-get install chromium' >&2; }

pictures: $(COMPLETE) $(COMPILED) chromium ## draw the pictures of the page, into docs/
	@$(BIN)/python docs/viewer.py docs

gallery: $(COMPLETE) $(COMPILED) chromium ## draw the cards of the shipped scenes, measure their ticks
	@$(BIN)/python docs/gallery.py

lint: $(COMPLETE) ## ruff, and mypy on the public names
	@$(BIN)/python -m ruff check .
	@$(BIN)/python -m mypy

slow: $(COMPLETE) $(COMPILED) ## the slow tests: those that take minutes or measure time
	@$(BIN)/python -m pytest -m slow

soak: $(COMPILED) ## 864 000 ticks with pushes, resets, changes of scene: nothing may grow; 25 min
	@$(BIN)/python -m ragdoll_ros.ros.tools.soak

bench: $(COMPLETE) $(COMPILED) ## cost of ticks and their parts, crowds, swings, people and the page; 30 min
	@$(BIN)/python -m ragdoll_ros.ros.tools.bench
	@$(BIN)/python -m ragdoll_ros.ros.tools.crowd_bench
	@$(BIN)/python -m ragdoll_ros.accuracy.ledger
	@$(BIN)/python -m ragdoll_ros.accuracy.crowds
	@$(BIN)/python -m ragdoll_ros.physics.swing.bench
	@$(BIN)/python test/fit_cost.py
	@$(BIN)/python test/page_cost.py

report: $(COMPLETE) $(COMPILED) ## accuracy report against independent references, into docs/; 60 min
	@$(BIN)/python -m ragdoll_ros.accuracy.report.command --out docs

hard: $(COMPLETE) $(COMPILED) ## hard cases, each with its rule, as a table
	@$(BIN)/python -m ragdoll_ros.accuracy.report.hard

WORKSPACE := build/colcon
COLCON = PATH="$(CURDIR)/$(BIN):$$PATH" colcon --log-base $(WORKSPACE)/log
FOLDERS := --build-base $(WORKSPACE)/build --install-base $(WORKSPACE)/install
colcon: $(VENV)/colcon ## build and test as in a ROS workspace
	@$(COLCON) list --base-paths . | grep -F '(ros.ament_python)' || { $(COLCON) list --base-paths .; \
	  echo 'colcon takes ragdoll_ros for plain Python: package.xml has a fault' >&2; exit 1; }
	@$(COLCON) build --base-paths . $(FOLDERS)
	@$(COLCON) test --base-paths . $(FOLDERS) --event-handlers console_direct+ \
	  --return-code-on-test-failure
	@$(COLCON) test-result --test-result-base $(WORKSPACE)/build --verbose

users-versions: ## tests with Ubuntu 24.04's versions; builds PyBullet from source, 6 to 9 min
	@sh test/users_versions.sh $(if $(filter python3,$(PYTHON)),python3.12,$(PYTHON))

clean: ## remove everything that was built, including .venv
	rm -rf $(VENV) build install log dist *.egg-info .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(READY): setup.py pyproject.toml
	$(if $(VERSION),,$(error no $(PYTHON): apt install python3 python3-venv, or name one: \
	  make PYTHON=/path/to/python3))
	$(if $(filter old-%,$(VERSION)),$(error $(PYTHON) is Python $(VERSION:old-%=%); 3.10 or newer \
	  is needed: make PYTHON=/path/to/python3))
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo '$(PYTHON) lacks its venv module: apt install python3-venv make' >&2; exit 1; }
	@test $(ROS) = wheels || $(PYTHON) -c 'import rclpy' || { \
	  echo 'ROS $(ROS) is sourced, but $(PYTHON) ($(VERSION)) cannot import its rclpy:' >&2; \
	  echo 'use the Python of that ROS, make PYTHON=/usr/bin/python3, or a shell without ROS' >&2; \
	  exit 1; }
	@test $(ROS) = wheels || $(PYTHON) -c 'from rclpy.node import Node; \
	  Node.add_post_set_parameters_callback' 2>/dev/null || { \
	  echo 'ROS $(ROS) is sourced: Jazzy or newer is needed; or use a shell without ROS' >&2; \
	  exit 1; }
	@echo "Setting up $(VENV) with Python $(VERSION) and ROS 2 from" \
	  "$(if $(VENV_FLAGS),the sourced $(ROS),PyPI's Jazzy wheels); once, a few minutes at most"
	@test -e $@ || $(PYTHON) -m venv --clear $(VENV_FLAGS) $(VENV)
	@# The pip of Python 3.10 (22 to 23.0) can search for versions that agree for an hour.
	@$(PIP) install --quiet --upgrade pip $(UNWARNED)
	@# A sourced rclpy is built against the numpy beside it: that one stays.
	@$(if $(VENV_FLAGS),$(PIP) freeze,true) | grep '^numpy==' > $(VENV)/keep.txt || true
	@$(PIP) install --quiet --only-binary :all: pybullet 2>/dev/null || $(MAKE) pybullet-from-source
	@$(PIP) install $(BRIEF) --constraint $(VENV)/keep.txt --editable '.[$(RUN_EXTRAS)$(ROS_EXTRA)]' \
	  $(UNWARNED)
	@touch $@

$(COMPLETE): $(READY)
	@echo 'Installing what tests, reports and data sets need; once'
	@$(PIP) install $(BRIEF) --constraint $(VENV)/keep.txt --editable '.[$(EXTRAS)$(ROS_EXTRA)]' \
	  $(UNWARNED)
	@touch $@

# Once, and after a change, with a word on it: else the first programs that need it would.
$(COMPILED): $(READY) $(wildcard ragdoll_ros/physics/kernels/*.py ragdoll_ros/physics/kernels/*/*.py)
	@$(BIN)/python -m ragdoll_ros.physics.kernels >/dev/null
	@touch $@

.PHONY: pybullet-from-source
pybullet-from-source:
	@echo 'No ready-made PyBullet for Python $(VERSION): building it takes 6 to 9 minutes, once'
	@command -v c++ >/dev/null || { \
	  echo 'which needs a C++ compiler: apt install g++ python3-dev' >&2; exit 1; }
	@$(PYTHON) -c 'import os, sysconfig as s; open(os.path.join(s.get_path("include"), "Python.h"))' \
	  2>/dev/null || { echo "which needs Python's headers: apt install python3-dev" >&2; exit 1; }
	@$(PIP) install pybullet $(UNWARNED)

$(VENV)/colcon: $(COMPLETE)
	@$(PIP) install $(BRIEF) --constraint $(VENV)/keep.txt --editable '.[colcon]' $(UNWARNED)
	@touch $@
