# Settings
CXX         ?= g++
OPT         ?= -O3
# Any architecture gives the same bits; functions marked WISP_WIDE are compiled for wide vectors in any case.
ARCH        ?=
MULTIVERSION ?= -DWISP_MULTIVERSION
DATA        ?= ../shared/data
# What the bits rest on (checked at start-up by the self-test): IEEE arithmetic, never contracted.
IEEE         = -std=c++17 -ffp-contract=off -fno-fast-math
# g++ 12 for 64-bit ARM and s390x takes the box of volume_share() in photon_bricks.cpp for unread, and leaves it unwritten.
# Other compilers have no such analysis, nor the option.
UNREAD      := $(shell $(CXX) -fno-ipa-modref -E -x c++ /dev/null > /dev/null 2>&1 && echo -fno-ipa-modref)
BITS         = $(IEEE) $(UNREAD)
# Freedoms that change no bit: nobody reads errno or floating-point exceptions.
FREE         = -fno-math-errno -fno-trapping-math
WARN         = -Wall -Wextra -Wshadow -Wno-psabi
PACKAGES     = g++ make zlib1g-dev libglm-dev doctest-dev libstb-dev libmpfr-dev bsdextrautils perl

# No need to change anything below
B            = build
FLAGS        = $(BITS) $(FREE) $(OPT) $(ARCH) $(WARN)
CPPFLAGS     = -Iinclude -Isrc -MMD -MP
CORE_FLAGS   = $(FLAGS) $(MULTIVERSION) -fno-exceptions -fno-rtti
# The test build traps what the release saturates, and is small and quick to compile.
TEST_FLAGS   = $(BITS) $(FREE) -O2 $(ARCH) $(WARN) -DWISP_TRAP -DDOCTEST_CONFIG_SUPER_FAST_ASSERTS -DDATA='"$(DATA)"'
ARITHMETICS  = f32 f64 fixed

# Sources of any depth of folders, without their ending. A test that names WISP_ARITH is compiled once an arithmetic.
below        = $(patsubst $1/%.cpp,%,$(shell find $1 -name '*.cpp'))
CORE         = $(call below,src/core)
HOST         = $(call below,src/host)
TOLD         = $(patsubst test/%.cpp,%,$(shell grep -rl WISP_ARITH test --include='*.cpp'))
ONCE         = $(filter-out $(TOLD) fuzz/%_fuzz,$(call below,test))
FUZZ         = $(patsubst test/fuzz/%_fuzz.cpp,%,$(wildcard test/fuzz/*_fuzz.cpp))
CORE_O       = $(foreach a,$(ARITHMETICS),$(CORE:%=$B/core/$a/%.o))
HOST_O       = $(HOST:%=$B/host/%.o)
LIBRARY_O    = $(CORE_O) $(filter-out %/main.o,$(HOST_O))
TEST_O       = $(foreach a,$(ARITHMETICS),$(CORE:%=$B/test/core/$a/%.o) $(TOLD:%=$B/test/cases/$a/%.o)) \
               $(patsubst %,$B/test/host/%.o,$(filter-out %/main,$(HOST))) \
               $(ONCE:%=$B/test/cases/once/%.o) $(FUZZ:%=$B/test/fuzz/%.o)

all: $B/wisp $B/plume $B/wake $B/scene_source

$B/wisp: $(CORE_O) $(HOST_O)
	$(CXX) $(FLAGS) $^ -lz -o $@
$B/plume $B/wake $B/scene_source: $B/%: $B/tools/%.o $(filter-out %/main.o,$(HOST_O)) $(CORE_O)
	$(CXX) $(FLAGS) $^ -lz -o $@
$B/tests: $(TEST_O)
	$(CXX) $^ -lz -lmpfr -lgmp -o $@

define CORE_RULES
$B/core/$1/%.o: src/core/%.cpp
	@mkdir -p $$(@D)
	$$(CXX) $$(CPPFLAGS) $$(CORE_FLAGS) -DWISP_ARITH=$1 -c $$< -o $$@
$B/test/core/$1/%.o: src/core/%.cpp
	@mkdir -p $$(@D)
	$$(CXX) $$(CPPFLAGS) $$(TEST_FLAGS) -DWISP_ARITH=$1 -c $$< -o $$@
$B/test/cases/$1/%.o: test/%.cpp
	@mkdir -p $$(@D)
	$$(CXX) $$(CPPFLAGS) -Itest $$(TEST_FLAGS) -DWISP_ARITH=$1 -c $$< -o $$@
endef
$(foreach a,$(ARITHMETICS),$(eval $(call CORE_RULES,$a)))

$B/host/%.o: src/host/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) $(FLAGS) -DWISP_FLAGS='"$(BITS) $(OPT) $(ARCH)"' -c $< -o $@
$B/tools/%.o: tools/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) $(FLAGS) -c $< -o $@
$B/test/host/%.o: src/host/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) $(TEST_FLAGS) -c $< -o $@
$B/test/cases/once/%.o: test/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) -Itest $(TEST_FLAGS) -c $< -o $@
$B/test/fuzz/%.o: test/fuzz/%_fuzz.cpp
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) $(TEST_FLAGS) -DLLVMFuzzerTestOneInput=fuzz_$* -c $< -o $@
demo: $B/wisp
	$B/wisp render fixtures/wake.aff --frames 2 -o $B/demo.png
	@echo "the picture is $B/demo.png"

test: all $B/tests
	@tools/run_tests $B/tests

# Peers are built only where their packages are.
EMBREE_PEERS = $(foreach p,rays shadow_rays,$(ARITHMETICS:%=$B/peers/$(p)_%))
PEERS = $(if $(wildcard /usr/include/nanoflann.hpp),$B/peers/point_tree_f32 $B/peers/point_tree_f64) \
        $(if $(wildcard /usr/include/embree3/rtcore.h),$(EMBREE_PEERS))
$B/peers/point_tree_f32 $B/peers/point_tree_f64: $B/peers/point_tree_%: tools/peers/point_tree.cpp $B/core/%/geometry/point_kdtree.o
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) $(FLAGS) $(MULTIVERSION) -DWISP_ARITH=$* $< $B/core/$*/geometry/point_kdtree.o -o $@
define PEER_RULE
$(ARITHMETICS:%=$B/peers/$1_%): $B/peers/$1_%: tools/peers/$1.cpp $(LIBRARY_O)
	@mkdir -p $$(@D)
	$$(CXX) $$(CPPFLAGS) $$(FLAGS) $$(MULTIVERSION) -DWISP_ARITH=$$* $$< $$(LIBRARY_O) -lz -lembree3 -o $$@
endef
$(foreach p,rays shadow_rays,$(eval $(call PEER_RULE,$p)))
# SECTIONS: those to measure, all where it is not given.
bench: all $(PEERS)
	DATA=$(DATA) python3 tools/bench $(SECTIONS)
# What `make bench` measures errors against, where it is missing: two hours, resumed where it was stopped.
truth: all
	python3 tools/bench truth

# What these, `make hard-cases` and `make portability` have left as one page, build/report/index.html, and a look at it in
# Chromium. Debian's own Python has matplotlib.
report:
	DATA=$(DATA) /usr/bin/python3 tools/report/report.py
report-test: report
	/usr/bin/python3 tools/report/test.py
	node tools/report/check.mjs
report-deps:
	apt-get update -q
	apt-get install -y --no-install-recommends python3-matplotlib npm chromium
	npm install --no-save --prefix build/web playwright-core

# How direct converges to the reference; half an hour the first time, the reference's passes are kept.
convergence: $B/wisp
	tools/convergence
# Each hard case in each arithmetic, as a table, and as build/hard_cases.csv.
hard-cases: $B/tests
	tools/hard_cases

# Every shadow of SCENES random scenes, in each arithmetic: of exact, and of tracing.
SCENES ?= 3000
random-scenes: $B/tests
	WISP_SCENES=$(SCENES) $B/tests -tc="*: random scenes*"
# The recipes for many processes and machines, with kills, on a Slurm of its own: two minutes.
cluster: $B/wisp
	tools/cluster_test

# The goldens anew, as a difference to look at; nobody runs this to make a red test green.
golden: $B/wisp
	tools/golden $B/wisp > $B/goldens.txt
	-diff fixtures/goldens.txt $B/goldens.txt && echo "no golden changes"

# The goldens from other compilers and flags, and some of them on other processors, as a table; ROWS are those to run.
portability: $B/scene_source
	tools/portability $(ROWS)
portability-deps:
	apt-get update -q
	apt-get install -y --no-install-recommends $(PACKAGES) $$(tools/portability --packages $(ROWS))

# A program of scenes without files. Sources of the scenes come from this machine, whatever it is built for.
SCENE_direct     = demo.aff --smoke direct --irradiance none --size 40x40 --spp 1 --photons 20000
SCENE_grid       = grid.aff --smoke map --deposit exact --irradiance none
SCENE_irradiance = small.aff --irradiance adaptive --density-step 0.5 --size 24x16 --photons 10000
SCENE_paths      = wake.aff --reference --passes 0:2 --frames 3 --size 32x24 --spp 1
SCENE_map        = demo.aff --density-step 0.5 --size 40x40 --spp 1 --photons 20000
SCENE_passage    = wake.aff --frames 2 --size 64x48 --spp 1 --photons 20000
SCENE_glow       = glow.aff
SCENE_surfaces   = surfaces.aff --frames 3 --spp 1
SCENE_wake       = wake.aff --smoke direct --irradiance none --frames 1 --size 32x24 --spp 1 --photons 20000
PORTABLE         = direct grid irradiance paths surfaces wake
PAGE             = passage map surfaces irradiance grid glow
scenes: $(patsubst %,build/scenes/%.cpp,$(sort $(PORTABLE) $(PAGE)))
build/scenes/%.cpp: build/scene_source $(wildcard fixtures/*)
	@mkdir -p $(@D)
	build/scene_source portable_$* fixtures/$(SCENE_$*) > $@.part
	mv $@.part $@
$B/scenes/%.o: build/scenes/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) -Itools $(FLAGS) -c $< -o $@
$B/portable: $B/tools/portable.o $(PORTABLE:%=$B/scenes/%.o) $B/host/base/sha256.o $(CORE_O)
	$(CXX) $(FLAGS) $^ $(LINK) -o $@

# The core in a page of the web, build/web/index.html, and what clicks on it in Chromium.
web: scenes
	tools/web/build
web-test: web
	node tools/web/test.mjs
web-deps:
	apt-get update -q
	apt-get install -y --no-install-recommends $(PACKAGES) $$(tools/portability --packages wasm32) chromium $$(command -v npm > /dev/null || echo npm)
	npm install --no-save --prefix build/web playwright-core
$B/page.wasm: $B/tools/web/page.o $(PAGE:%=$B/scenes/%.o) $B/host/commands/inspection.o $B/host/base/sha256.o $(CORE_O)
	$(CXX) $(FLAGS) $^ $(LINK) -o $@

# The core on a Cortex-M3 in qemu: goldens, sizes, and no floating-point code in fixed point.
embedded: $B/scene_source
	@for a in $(ARITHMETICS); do tools/embedded/run $$a || exit 1; done

# Every reader under libFuzzer with address and undefined-behaviour checks, SECONDS each.
SECONDS ?= 60
SANITISED    = -O1 -g -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all
SANITISED_O  = $(patsubst %,$B/fuzz/host/%.o,$(filter-out %/main,$(HOST)))
$B/fuzz/host/%.o: src/host/%.cpp
	@mkdir -p $(@D)
	clang++ $(CPPFLAGS) $(IEEE) $(SANITISED) -DWISP_FLAGS='""' -c $< -o $@
fuzz: $(FUZZ:%=$B/fuzz/%)
	for f in $(FUZZ); do mkdir -p $B/fuzz/corpus/$$f && $B/fuzz/$$f -max_total_time=$(SECONDS) -max_len=65536 \
	    $B/fuzz/corpus/$$f test/corpus/$$f || exit 1; done
# An archive, so that a target has only those parts of the host that it needs, and none of them needs the core.
$B/fuzz/host.a: $(SANITISED_O)
	rm -f $@
	ar rcs $@ $^
$B/fuzz/%: test/fuzz/%_fuzz.cpp $B/fuzz/host.a
	clang++ -Iinclude -Isrc $(IEEE) -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all $^ -lz -o $@

deps:
	@echo "installing: $(PACKAGES)"
	apt-get update -q
	apt-get install -y --no-install-recommends $(PACKAGES)

clean:
	rm -rf $B

.PHONY: all demo test web web-test web-deps embedded convergence hard-cases random-scenes golden portability portability-deps scenes bench truth report report-test report-deps fuzz cluster deps clean
.SECONDARY:
-include $(shell find $B -name '*.d' 2>/dev/null)
