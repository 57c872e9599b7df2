# Programs of scenes without files. Sources of the scenes come from this machine, whatever the programs are built for.
portability: scenes ## the goldens from other compilers and processors, as a table; ROWS="aarch64 s390x": some of them
	+tools/portability/run $(ROWS)
portability-deps: ## as root: installs the compilers and emulators of ROWS
	apt-get update -q
	apt-get install -y --no-install-recommends $(PACKAGES) $$(tools/portability/run --packages $(ROWS))
embedded: scenes ## the core on a Cortex-M3 and a RISC-V in qemu: goldens, sizes, and no floating-point code in fixed point
	+for a in $(ARITHMETICS); do tools/embedded/run $$a && tools/embedded/run $$a rv32imac || exit 1; done
sizes: scenes ## code of programs that have some parts of the core, on a Cortex-M3: their pictures, limits, and that no other part is in them
	+tools/embedded/sizes $(ARITHMETIC)
web: ## the program in a page of the web, build/web/index.html
	+tools/web/build
web-test: web ## clicks through that page in Chromium
	node tools/web/test.mjs
web-deps: ## as root: installs what the two need
	apt-get update -q
	apt-get install -y --no-install-recommends $(PACKAGES) emscripten chromium $(NPM)
	npm install --no-save --prefix build/web playwright-core

# Names of the scenes of each program, and their objects; the program itself gets the names as X(NAME) X(NAME) ...
compiled    := $(foreach p,portable embedded,$(eval COMPILED_$p := $(shell tools/golden --compiled $p)))
scene_o      = $(COMPILED_$1:%=$B/scenes/%.o)
names        = -DWISP_SCENES='$(COMPILED_$1:%=X(%))'
scenes: $(patsubst %,build/scenes/%.cpp,$(sort $(COMPILED_portable) $(COMPILED_embedded)))
build/scenes/%.cpp: build/scene_source tools/golden $(wildcard fixtures/*)
	@mkdir -p $(@D)
	$(call say,SCENE) build/scene_source scene_$* fixtures/$$(tools/golden --words $*) > $@.part && mv $@.part $@
$(eval $(call objects,scenes,build/scenes,CXX,TOOL_FLAGS))
$B/tools/portability/portable.o: TOOL_FLAGS += $(call names,portable)
$B/tools/embedded/main.o $B/tools/portability/portable.o: fixtures/compiled_scenes.txt
$B/tools/embedded/main.o: TOOL_FLAGS += $(call names,embedded)

$B/portable: $B/tools/portability/portable.o $(call scene_o,portable) $B/host/base/sha256.o $(CORE_O)
	$(call say,LD) $(CXX) $(FLAGS) $^ $(LINK) -o $@
$B/wisp.js: $(CORE_O) $(HOST_O) $B/tools/web/zlib.o
	$(call say,LD) $(CXX) $(FLAGS) $^ $(LINK) -o $@
# One arithmetic, with what a board needs instead of an operating system: BOARD's memory, PROCESSOR, and LIBC.
$B/wisp.elf: $B/tools/embedded/main.o $B/tools/embedded/board.o $B/tools/embedded/$(PROCESSOR).o $(call scene_o,embedded) \
             $(CORE:%=$B/core/$(ARITHMETIC)/%.o) tools/embedded/$(BOARD).ld tools/embedded/sections.ld
	$(call say,LD) $(CXX) $(ARCH) -nostdlib -nostartfiles -T tools/embedded/$(BOARD).ld $(LINK) $(filter %.o,$^) $(LIBC) -lm -lgcc \
	    $(LIBC) -o $@
