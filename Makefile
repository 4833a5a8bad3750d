# make demo   a labelled sample dataset from the photographs in this repository
# make test   every test
# Both install the Debian packages they need if they are missing, and need nothing else but Rust.

CARGO     := cargo
SUDO      := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
BUILD     := g++ pkg-config libopenimageio-dev
BLENDER   := blender python3-numpy python3-venv
OUT       := demo
PYTHON    := $(CURDIR)/target/python/bin/python
# Each set of features that stands alone; the first, empty one builds without a C++ compiler.
FEATURES  := "" markers oiio settle

.PHONY: demo test lint bench golden formats python packages blender

demo: packages
	$(CARGO) build --release --locked --bins
	target/release/petcomp demo -o $(OUT)

test: packages python
	PETCOMP_PYTHON=$(PYTHON) $(CARGO) test --release --locked
	@for f in $(FEATURES); do \
	  echo "tests with features [$$f] alone"; \
	  $(CARGO) test --release --locked --no-default-features --features "$$f" --lib --quiet || exit 1; \
	done

lint: packages
	$(CARGO) fmt --check
	$(CARGO) clippy --release --locked --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --locked --no-deps --lib

# Only the tests that ask the programs that datasets are written for, and what those say.
formats: packages python
	PETCOMP_PYTHON=$(PYTHON) $(CARGO) test --release --locked --test formats -- --nocapture

bench: packages
	$(CARGO) bench --locked

# Remakes every reference with the other programs; `git diff --stat golden` then shows whether they moved.
golden: blender
	golden/make.sh

# pycocotools and webdataset, for the tests that ask them; where they cannot be had the tests say so and pass.
python:
	@[ -x $(PYTHON) ] || { ($(call install,python3-venv)) && python3 -m venv target/python && \
	  $(PYTHON) -m pip install --quiet --retries 1 pycocotools webdataset; } || \
	  { rm -rf target/python; echo "pycocotools cannot be installed: its tests are skipped"; }

packages:
	@$(call install,$(BUILD))

blender:
	@$(call install,$(BLENDER))

# Installs what dpkg does not list as installed, and says so.
define install
missing=""; \
for p in $(1); do dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
if [ -n "$$missing" ]; then \
  echo "installing Debian packages:$$missing"; \
  $(SUDO) apt-get update -qq && $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $$missing; \
fi
endef
