# make demo   a labelled sample dataset from the photographs in this repository
# make test   every test
# Both install the Debian packages they need if they are missing, and need nothing else but Rust.
#
# make experiment   whether the data teaches a detector: see experiments/README.md; make world makes its reality,
#                   make experiment-smoke runs all of it with tiny sizes
# make c   header, libraries and pkg-config file for C, in target/c or where PREFIX says
# make wheel   the package for Python, in target/wheel-out: one wheel for every Python from 3.10, built by maturin and zig
#
# make soak   100,000 damaged pictures; make fuzz   each reader of text and headers, a minute each

CARGO     := cargo
# Where cargo builds: target/, or what CARGO_TARGET_DIR or build.target-dir says; the scripts get the program by PETCOMP.
TARGET    := $(shell $(CARGO) metadata --format-version 1 --no-deps --offline 2>/dev/null | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
RELEASE   := $(or $(TARGET),target)/release
export PETCOMP := $(RELEASE)/petcomp
SUDO      := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
# Of HEIC the decoder itself, which is a package of its own from Debian 13 on.
DE265     := $(shell . /etc/os-release; [ "$$VERSION_ID" -ge 13 ] 2>/dev/null && echo libheif-plugin-libde265)
BUILD     := g++ pkg-config libopenimageio-dev libheif-dev $(DE265)
# What the pages of `petcomp studio` are tested in.
BROWSER   := chromium fonts-dejavu-core
BLENDER   := blender python3-numpy python3-venv
OUT       := demo
EXAMPLES  := target/example-output
REPORT    := target/report
PYTHON    := $(CURDIR)/target/python/bin/python
# What Blender's module for Python links.
BPY       := python3-venv libgl1 libsm6 libxi6 libxkbcommon0 libxrender1
# An S3 server for tests.
S3_SERVER := moto[s3] flask flask-cors
# What the tests of datasets and clusters ask.
TESTED_WITH := pycocotools webdataset trackeval kubernetes-validate $(S3_SERVER)
WORLD     := experiments/cache/world
# What the package for Python is tested with, in a virtual environment of its own.
PACKAGE   := target/package
PYTEST    := numpy pytest hypothesis mypy nbclient nbformat ipykernel
# Where `make c` installs, an absolute path as petcomp.pc needs it, below DESTDIR where a package is made; and the major
# version that programs ask for when they start.
PREFIX    := $(CURDIR)/target/c
override PREFIX := $(abspath $(patsubst ~/%,$(HOME)/%,$(PREFIX)))
DEST      := $(DESTDIR)$(PREFIX)
C_VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' crates/petcomp-c/Cargo.toml)
C_MAJOR   := $(firstword $(subst ., ,$(C_VERSION)))
# A manylinux wheel must not be larger.
MOST_WHEEL_MB := 15
BENCHES   := $(notdir $(basename $(wildcard tests/benches/*.rs)))
# Each set of features that stands alone; the first, empty one is the matte without a C++ compiler.
FEATURES  := "" pipeline markers oiio settle
# The sets that are documented: the default, all, and that of docs.rs.
DOCUMENTED := "" --all-features "--no-default-features --features markers,pipeline,settle"
PUBLISHED := petcomp petcomp-cli petcomp-store petcomp-studio

# Seconds for each door of fuzz/.
FUZZ      := 60

# What `make peers` compares with: Debian packages, and packages of Python. Those of PyTorch's size are left out; with
# `make peers PEERS_PYTHON="... yolov5"` YOLOv5 takes part too. CORE is the one processor that all of them run on.
PEERS        := blender python3-numpy python3-venv openimageio-tools ffmpeg
PEERS_PYTHON := numpy OpenEXR opencv-python-headless pymatting pybullet pycocotools
CORE         := 0

.PHONY: c valgrind python-package wheel world experiment experiment-smoke peers demo test examples lint bench golden formats python browser packages blender soak soak-dataset fuzz

demo: packages
	$(CARGO) build --release --locked -p petcomp-cli
	$(PETCOMP) demo -o $(OUT)

test: packages python valgrind browser
	PETCOMP_PYTHON=$(PYTHON) PROPTEST_RNG_SEED=1 $(CARGO) test --release --locked --workspace
	@for f in $(FEATURES); do \
	  echo "features [$$f] alone"; \
	  $(CARGO) check --release --locked -p petcomp --no-default-features --features "$$f" --lib --tests --quiet || exit 1; \
	done
	$(MAKE) examples
	@if [ -x $(PYTHON) ]; then \
	  $(PYTHON) tests/cluster/object_store.py $(PETCOMP) $(EXAMPLES)/demo/recipe.toml; \
	else echo "object stores are not tested"; fi
	$(MAKE) python-package
	experiments/run --smoke

# The reality of the experiments; it goes on where it stopped.
world:
	@$(call install,$(BPY))
	@[ -x $(WORLD)-python/bin/python ] || python3 -m venv $(WORLD)-python
	$(WORLD)-python/bin/python -m pip install --quiet -r experiments/world/requirements.txt
	$(WORLD)-python/bin/python experiments/world/make.py --out $(WORLD)

experiment: packages world
	$(CARGO) build --release --locked -p petcomp-cli
	experiments/run --headline

# Without PyTorch nothing is trained; without pip nothing is done. Either way it says so.
experiment-smoke: packages
	@$(call install,python3-venv)
	$(CARGO) build --release --locked -p petcomp-cli
	experiments/run --smoke

# Every program in examples/, the last one on two scenes of the sample recipe. They are built with the tests, whose
# features the library then has already.
examples: packages
	$(CARGO) test --release --locked --workspace --no-run --quiet
	rm -rf $(EXAMPLES) && mkdir -p $(EXAMPLES)
	$(RELEASE)/examples/cut_out tests/samples/bottles/b0002_0.png $(EXAMPLES)/cut_out.exr
	$(RELEASE)/examples/key_like_blender
	$(RELEASE)/examples/render_shot $(EXAMPLES)/shot.png
	$(RELEASE)/examples/own_generator $(EXAMPLES)/own
	$(PETCOMP) demo -q -n 2 -o $(EXAMPLES)/demo
	for k in 0 1; do \
	  $(PETCOMP) scene draw $(EXAMPLES)/demo/recipe.toml -k $$k -o $(EXAMPLES)/$$k.toml || exit 1; \
	done
	$(RELEASE)/examples/yolo_from_scenes $(EXAMPLES)/scenes $(EXAMPLES)/0.toml $(EXAMPLES)/1.toml

# 100,000 damaged pictures.
soak: packages
	$(CARGO) test --release --locked -p petcomp-cli --test io -- --ignored --nocapture sweep::soak

# Kills, a full disk and a Slurm of one machine; what comes out must be what an unbroken run gives.
soak-dataset: demo
	tests/soak/kill.sh $(OUT)/recipe.toml 200
	tests/soak/disk_full.sh $(OUT)/recipe.toml
	tests/cluster/slurm.sh $(OUT)/recipe.toml

# By cargo-fuzz where it is (`cargo install cargo-fuzz`), by seeds and chance otherwise. Without a sanitizer it needs
# nothing but coverage, which the stable compiler has too, when it is told to.
fuzz: packages
	@if $(CARGO) fuzz --version >/dev/null 2>&1; then \
	  for door in label recipe journal worker header data_yaml yolo_labels coco; do \
	    RUSTC_BOOTSTRAP=1 $(CARGO) fuzz run --sanitizer none $$door -- \
	      -max_total_time=$(FUZZ) -timeout=5 -rss_limit_mb=1024 || exit 1; \
	  done; \
	else \
	  echo "no cargo-fuzz here: seeds and chance instead"; \
	  $(CARGO) test --release --locked -p petcomp-cli --test io -- --ignored --nocapture fuzz::; \
	fi

lint: packages
	$(CARGO) fmt --check
	$(CARGO) clippy --release --locked --workspace --all-targets -- -D warnings
	@for f in $(DOCUMENTED); do \
	  RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --locked --no-deps --lib -p petcomp $$f || exit 1; \
	done
	$(CARGO) package --locked --no-verify --allow-dirty --quiet $(addprefix -p ,$(PUBLISHED))

# Only the tests that ask the programs that datasets are written for, and what those say.
formats: packages python
	PETCOMP_PYTHON=$(PYTHON) $(CARGO) test --release --locked --test formats -- --nocapture

# About ten minutes on two cores: what each stage takes (criterion, inputs made in code), then error against run time of
# every approximate stage on one page.
bench: packages
	$(CARGO) build --release --locked --bins
	$(CARGO) bench --locked -p petcomp $(addprefix --bench ,$(BENCHES)) -- --warm-up-time 1 --measurement-time 2
	$(RELEASE)/petcomp-report all -o $(REPORT)

# petcomp and other programs on the same input and core, by turns: target/peers/*.json and a table. What cannot be
# installed is named there as absent.
peers: packages
	@$(foreach package,$(PEERS),{ $(call install,$(package)); } || echo "$(package) cannot be installed";)
	@[ -x target/peers-python/bin/python ] || python3 -m venv target/peers-python
	@for package in $(PEERS_PYTHON); do \
	  target/peers-python/bin/python -m pip install --quiet --retries 1 $$package || echo "$$package cannot be installed"; \
	done
	$(CARGO) build --release --locked --bins --bench peers
	@code=0; for stage in matte camera warp convert render settle eval; do \
	  taskset -c $(CORE) target/peers-python/bin/python tests/benches/peers/$$stage.py -o target/peers \
	    --petcomp $(PETCOMP) --report $(RELEASE)/petcomp-report || code=1; \
	done; exit $$code

# Remakes every reference with the other programs; `git diff --stat golden` then shows whether they moved.
golden: blender
	golden/make.sh

# Everything that a C program needs; cargo-c does the same (`cargo cinstall -p petcomp-c`).
c: packages
	$(CARGO) build --release --locked -p petcomp-c
	install -d $(DEST)/include $(DEST)/lib/pkgconfig
	install -m 644 crates/petcomp-c/include/petcomp.h $(DEST)/include
	install -m 644 $(RELEASE)/libpetcomp_c.a $(DEST)/lib/libpetcomp.a
	install $(RELEASE)/libpetcomp_c.so $(DEST)/lib/libpetcomp.so.$(C_VERSION)
	strip --strip-unneeded $(DEST)/lib/libpetcomp.so.$(C_VERSION)
	ln -sf libpetcomp.so.$(C_VERSION) $(DEST)/lib/libpetcomp.so.$(C_MAJOR)
	ln -sf libpetcomp.so.$(C_MAJOR) $(DEST)/lib/libpetcomp.so
	sed 's|@PREFIX@|$(PREFIX)|; s|@VERSION@|$(C_VERSION)|' crates/petcomp-c/petcomp.pc.in > $(DEST)/lib/pkgconfig/petcomp.pc
	@echo "cc -I$(DEST)/include examples/c/sample.c -L$(DEST)/lib -lpetcomp -o sample"
	@echo "export LD_LIBRARY_PATH=$(DEST)/lib  # or, where PREFIX is /usr/local: sudo ldconfig"

# The tests of the package for Python, on the extension that was built with all other tests, packed as a wheel and
# installed into a fresh virtual environment. What cannot be installed is said, and its tests are skipped.
python-package: packages
	$(CARGO) test --release --locked --workspace --no-run --quiet
	python3 crates/petcomp-python/pack.py $(RELEASE)/deps/lib_petcomp.so $(PACKAGE)/wheel
	@$(call pytest_of,$(PACKAGE)/wheel)

# Compiles everything once more, for an old system (manylinux_2_28) and without OpenImageIO.
wheel:
	@$(call install,python3-venv)
	rm -rf target/wheel-out
	python3 -m venv $(PACKAGE)/maturin && $(PACKAGE)/maturin/bin/pip install --quiet --retries 1 "maturin[zig]>=1.9,<2"
	PATH="$(CURDIR)/$(PACKAGE)/maturin/bin:$$PATH" maturin build --locked --zig --compatibility manylinux_2_28 \
	  --target $$(uname -m)-unknown-linux-gnu -m crates/petcomp-python/Cargo.toml \
	  --target-dir $(CURDIR)/target/wheel -o $(CURDIR)/target/wheel-out
	@ls -l target/wheel-out
	@test $$(stat -c %s target/wheel-out/*.whl) -le $$(($(MOST_WHEEL_MB) * 1000000))
	@$(call pytest_of,target/wheel-out)

# For the tests that ask them; where one cannot be had its tests say so and pass. A longer list is fetched anew.
python:
	@[ "$$(cat target/python/packages 2>/dev/null)" = "$(TESTED_WITH)" ] || { \
	  ($(call install,python3-venv)) && python3 -m venv target/python && \
	  for package in $(TESTED_WITH); do \
	    $(PYTHON) -m pip install --quiet --retries 1 "$$package" || echo "$$package cannot be installed: its tests are skipped"; \
	  done && echo "$(TESTED_WITH)" > target/python/packages; } || \
	  echo "Python's packages cannot be installed: their tests are skipped"

# For the tests of petcomp studio; where it cannot be had they say so and pass.
browser:
	@{ $(call install,$(BROWSER)); } || echo "chromium cannot be installed: pages are not tested in a browser"

packages:
	@$(call install,$(BUILD))

blender:
	@$(call install,$(BLENDER))

# Looks at the memory of the C program in the tests; where it cannot be had they say so and run it alone.
valgrind:
	@($(call install,valgrind)) || echo "valgrind cannot be installed: nothing looks at the memory of a C program"

# Installs the wheel of a folder into a fresh virtual environment, and tests it there.
define pytest_of
$(call install,python3-venv); rm -rf $(PACKAGE)/python; \
if python3 -m venv $(PACKAGE)/python && $(PACKAGE)/python/bin/pip install --quiet --retries 1 $(PYTEST); then \
  $(PACKAGE)/python/bin/pip install --quiet --no-index $(1)/*.whl && \
  $(PACKAGE)/python/bin/python -m pytest -q -rs -p no:cacheprovider crates/petcomp-python/tests; \
else \
  echo "$(PYTEST) cannot be installed: the package for Python is not tested"; \
fi
endef

# Installs what dpkg does not list as installed, and says so.
define install
missing=""; \
for p in $(1); do dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
if [ -n "$$missing" ]; then \
  echo "installing Debian packages:$$missing"; \
  $(SUDO) apt-get update -qq && $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $$missing; \
fi
endef
