# `make help` says what there is to make. How it is made is below tools/build/.

# ---- Settings
CXX         ?= g++
OPT         ?= -O3
# Any architecture gives the same bits; functions marked WISP_MULTIVERSIONED are compiled for wide vectors in any case.
ARCH        ?=
MULTIVERSION ?= -DWISP_MULTIVERSION
# One set of objects, for programs and for libwisp.so; as hidden names, they take no instruction more.
PIC         ?= -fPIC -fvisibility=hidden
# LTO=-flto: the core is optimized when it is linked, as one source.
LTO         ?=
# Where everything is built, and where scenes and particles of others are, which some tests and `make bench` read.
B           ?= build
DATA        ?= ../shared/data
# V=1 shows whole commands.
V           ?=
PACKAGES     = g++ make python3 zlib1g-dev libglm-dev doctest-dev libstb-dev libtinyexr-dev libnanovdb-dev libmpfr-dev
# The package, where no other has brought npm.
NPM          = $$(command -v npm > /dev/null || echo npm)

# ---- Flags
# What the bits rest on (checked at start-up by the self-test): IEEE arithmetic, never contracted.
IEEE         = -std=c++17 -ffp-contract=off -fno-fast-math
# g++ 12 for 64-bit ARM and s390x takes the box of tent_volume() in photon_starts.cpp for unread, and leaves it unwritten.
# Other compilers have no such analysis, nor the option. Asked when the first file is compiled: `make deps` may install it.
UNREAD       = $(eval UNREAD := $(shell $(CXX) -fno-ipa-modref -E -x c++ /dev/null > /dev/null 2>&1 && echo -fno-ipa-modref))$(UNREAD)
BITS         = $(IEEE) $(UNREAD)
# Freedoms that change no bit: nobody reads errno or floating-point exceptions.
FREE         = -fno-math-errno -fno-trapping-math
WARN         = -Wall -Wextra -Wshadow -Wno-psabi
CPPFLAGS     = -Iinclude -Isrc -MMD -MP
FLAGS        = $(BITS) $(FREE) $(OPT) $(ARCH) $(WARN) $(INSTRUMENTED)
CORE_FLAGS   = $(FLAGS) $(MULTIVERSION) $(LTO) -fno-exceptions -fno-rtti $(PIC)
# The test build traps what the release saturates, and is small and quick to compile.
TEST_FLAGS   = $(BITS) $(FREE) -O2 $(ARCH) $(WARN) -DWISP_TRAP -DDOCTEST_CONFIG_SUPER_FAST_ASSERTS -DDATA='"$(DATA)"' \
               $(INSTRUMENTED)
ARITHMETICS  = f32 f64 fixed
# `make coverage` and `make sanitize` have flags here, for all that is compiled and linked.
INSTRUMENTED ?=
LIBS         = -lz $(INSTRUMENTED)

# ---- Sources of any depth of folders, without their ending
below        = $(patsubst $1/%.cpp,%,$(shell find $1 -name '*.cpp'))
CORE        := $(call below,src/core)
HOST        := $(call below,src/host)
C_API       := $(call below,src/c_api)
CORE_O       = $(foreach a,$(ARITHMETICS),$(CORE:%=$B/core/$a/%.o))
HOST_O       = $(HOST:%=$B/host/%.o)
# The C interface, and what it shares with the host: no heap, no exceptions.
C_API_O      = $(patsubst %,$B/c_api/%.o,$(filter-out shared/%,$(C_API))) $B/host/base/sha256.o $B/host/prepare/core_units.o
LIBRARY_O    = $(CORE_O) $(filter-out %/main.o,$(HOST_O))
# libopenvdb-dev and libboost-dev, where they are.
OPENVDB      = $(and $(wildcard /usr/include/openvdb/openvdb.h),$(wildcard /usr/include/boost/version.hpp))
PROGRAMS     = $B/wisp $B/plume $B/wake $B/scene_source $(if $(OPENVDB),$B/vdb_to_nvdb)

# ---- What a user makes
# A target's line of `make help` stands behind ##.
all: $(PROGRAMS) $B/libwisp.a ## build/wisp, the library, what makes the smoke of fixtures/; B=FOLDER builds elsewhere, V=1 shows commands
demo: $B/wisp ## the demo scene's picture, build/demo.png
	$(call say,RENDER) $B/wisp render fixtures/wake.aff --frames 2 -o $B/demo.png
	@echo "the picture is $B/demo.png"
test: all $B/tests $B/faults.so ## the tests, but for those of long-test; the last line counts them
	@tools/run_tests $B/tests -tse=long
golden: $B/wisp ## the goldens anew, as a difference to look at; nobody runs this to make a red test green
	tools/golden $B/wisp > $B/goldens.txt
	-diff fixtures/goldens.txt $B/goldens.txt && echo "no golden changes"
deps: ## as root: installs what the targets above need
	@echo "installing: $(PACKAGES)"
	apt-get update -q
	apt-get install -y --no-install-recommends $(PACKAGES)
clean: ## removes build/
	rm -rf $B
help: ## this list
	@sed -n 's/^\([a-z][a-z-]*\):[^#]* ## /\1 /p' $(filter-out %.d,$(MAKEFILE_LIST)) | while read -r name text; do printf '%-17s %s\n' "$$name" "$$text"; done

$B/wisp: $(CORE_O) $(HOST_O)
	$(call say,LD) $(CXX) $(FLAGS) $^ $(LIBS) -o $@
$B/plume $B/wake: $B/%: $B/tools/plume/%.o $(LIBRARY_O)
	$(call say,LD) $(CXX) $(FLAGS) $^ $(LIBS) -o $@
# Reads OpenVDB files for wisp.
$B/vdb_to_nvdb: $B/tools/vdb/vdb_to_nvdb.o
	$(call say,LD) $(CXX) $(FLAGS) $^ -Wl,--copy-dt-needed-entries -lopenvdb -ltbb -o $@
$B/scene_source: $B/tools/portability/scene_source.o $(LIBRARY_O)
	$(call say,LD) $(CXX) $(FLAGS) $^ $(LIBS) -o $@

include tools/build/compile.mk tools/build/test.mk tools/build/measure.mk tools/build/portable.mk tools/build/install.mk \
        tools/build/python.mk tools/build/announce.mk
.DEFAULT_GOAL = all
.PHONY: $(shell sed -n 's/^\([a-z][a-z-]*\):.* ## .*/\1/p' $(filter-out %.d,$(MAKEFILE_LIST))) scenes
.SECONDARY:
%.d: ; # compilers write them: built-in rules would link them from scenes of that name
-include $(shell find $B -type f -name '*.d' 2>/dev/null)
