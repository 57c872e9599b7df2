# Tests. A test that names WISP_ARITH is compiled once an arithmetic, all others once.
# The host computes with no fixed-point number, so its objects are the program's. They come last: a function that both have traps.
PER_ARITHMETIC := $(patsubst test/%.cpp,%,$(shell grep -rl WISP_ARITH test --include='*.cpp'))
FUZZ        := $(patsubst test/fuzz/%_fuzz.cpp,%,$(wildcard test/fuzz/*_fuzz.cpp))
ONCE        := $(filter-out $(PER_ARITHMETIC) $(FUZZ:%=fuzz/%_fuzz),$(call below,test))
TEST_O       = $(foreach a,$(ARITHMETICS),$(CORE:%=$B/test/core/$a/%.o) $(PER_ARITHMETIC:%=$B/test/cases/$a/%.o)) \
               $(C_API:%=$B/test/c_api/%.o) $(ONCE:%=$B/test/cases/once/%.o) \
               $(FUZZ:%=$B/test/cases/once/fuzz/%_fuzz.o) $(filter-out %/main.o,$(HOST_O))
$(foreach a,$(ARITHMETICS),$(eval $(call objects,test/core/$a,src/core,CXX,TEST_FLAGS,-DWISP_ARITH=$a)))
$(foreach a,$(ARITHMETICS),$(eval $(call objects,test/cases/$a,test,CXX,CASE_FLAGS,-DWISP_ARITH=$a)))
$(eval $(call objects,test/c_api,src/c_api,CXX,TEST_FLAGS))
$(eval $(call objects,test/cases/once,test,CXX,CASE_FLAGS))
# Their time is the core's, so that less is optimized of the cases themselves.
CASE_FLAGS   = -Itest $(TEST_FLAGS) -O1
# A fuzz target is a test of its corpus, too: as a function of its own name.
$B/test/cases/once/fuzz/%_fuzz.o: CASE_FLAGS += -DLLVMFuzzerTestOneInput=fuzz_$(patsubst %_fuzz,%,$(notdir $*))
$B/tests: $(TEST_O)
	$(call say,LD) $(CXX) $^ $(LIBS) -lmpfr -lgmp -o $@

# Published values of light transport are measured to a standard error of 2 %; where all tests run together, to 5 %; once a
# day, by `make physics`, to 0.3 %.
long-test: all $B/tests ## the tests of the suite "long", which `make test` leaves out: light against references; seven minutes
	@WISP_ROW_ERROR=0.02 tools/run_tests $B/tests -ts=long
random-scenes: $B/tests ## every shadow of SCENES=3000 random scenes in each arithmetic, against tracing
	WISP_SCENES=$(or $(SCENES),3000) $B/tests -tc="*: random scenes*"
random-smoke: $B/wisp ## SCENES=200 random smoke scenes by every method and arithmetic, against --reference; SEED=1, JOBS=1
	python3 tools/measure/random_smoke.py --wisp $B/wisp --seed $(or $(SEED),1) --scenes $(or $(SCENES),200) -j $(or $(JOBS),1)
faults: $B/wisp $B/faults.so ## wisp where memory, system calls, disks and processes fail, each in turn; ten minutes
	python3 tools/faults --build $B
$B/faults.so: tools/faults/preloaded.c
	$(call say,CC) $(CC) -O1 -Wall -Wextra -shared -fPIC $< -o $@
cluster: $B/wisp ## the recipes for many processes and machines, with kills, on a Slurm of its own; two minutes
	tools/cluster/cluster_test
nightly: ## what is checked once a day (.ci/nightly): all compilers and processors, fuzzing, faults, physics; installs, hours
	.ci/nightly

# By clang, which counts the conditions of the source; g++ counts the jumps of each form that a loop of lanes has.
COVERED      = -O1 -fprofile-instr-generate -fcoverage-mapping -Wno-c++20-extensions
coverage: ## lines and branches of src/ that all tests reach, by room, and those of the core that none reaches; needs clang-16 and llvm-16; an hour
	+$(MAKE) B=$B/coverage CXX=clang++-16 MULTIVERSION= INSTRUMENTED="$(COVERED)" all $B/coverage/tests $B/coverage/faults.so
	rm -rf $B/coverage/profiles
	-LLVM_PROFILE_FILE=$(abspath $B)/coverage/profiles/%8m tools/run_tests $B/coverage/tests
	llvm-profdata-16 merge -sparse $B/coverage/profiles/* -o $B/coverage/profile
	python3 tools/coverage $B/coverage/profile $B/coverage/tests $B/coverage/wisp

# Functions for wide vectors are chosen before the checks are set up, so there are none.
SANITISED    = -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all
CHECKS       = $(SANITISED) -fno-sanitize=vptr -D_GLIBCXX_ASSERTIONS
sanitize: ## all tests with checks of addresses, undefined behaviour and the library's assertions; an hour
	+$(MAKE) B=$B/sanitize MULTIVERSION= INSTRUMENTED="$(CHECKS)" all $B/sanitize/tests $B/sanitize/faults.so
	LSAN_OPTIONS=suppressions=$(CURDIR)/tools/build/leaks.supp:print_suppressions=0 tools/run_tests $B/sanitize/tests
analyse: ## clang-tidy over src/ (.clang-tidy), and gcc's -fanalyzer over what is C; needs clang-tidy; half an hour
	find src -name '*.cpp' | xargs -P $$(nproc) -I {} clang-tidy --quiet {} -- $(IEEE) -Iinclude -Isrc -DWISP_ARITH=fixed
	printf '%s\n' tools/faults/preloaded.c tools/examples/scene.c tools/peers/marcher.c | \
	    xargs -I {} $(CC) -fanalyzer -Werror -O1 -Iinclude -c {} -o /dev/null
mutants: ## whether tests notice SAMPLE=1000 changed operators and numbers of the core; needs python3-clang-14; an hour
	$(PYTHON) tools/mutants --build $B --data $(DATA) --sample $(or $(SAMPLE),1000)

SECONDS     ?= 60
FUZZ_CXX     = clang++
FUZZ_FLAGS   = $(IEEE) $(SANITISED) -fsanitize=fuzzer-no-link -DWISP_FLAGS='""'
$(eval $(call objects,fuzz/host,src/host,FUZZ_CXX,FUZZ_FLAGS))
$(eval $(call objects,fuzz/targets,test/fuzz,FUZZ_CXX,FUZZ_FLAGS))
# With SEED=N the inputs of a program are the same each time: from the same corpus, at the same addresses, whatever time each
# takes.
FOUND        = $B/fuzz/$(if $(SEED),seeded,corpus)
FUZZ_RUN     = $(if $(SEED),$(shell setarch -R true 2> /dev/null && echo setarch -R) $B/fuzz/{} -seed=$(SEED) -entropic=0,$B/fuzz/{})
fuzz: $(FUZZ:%=$B/fuzz/%) ## every reader under libFuzzer with address and undefined-behaviour checks, SECONDS=60 each; SEED=1
	$(if $(SEED),rm -rf $(FOUND))
	mkdir -p $(FUZZ:%=$(FOUND)/%)
	printf '%s\n' $(FUZZ) | xargs -P $$(nproc) -I {} \
	    $(FUZZ_RUN) -max_total_time=$(SECONDS) -max_len=65536 $(FOUND)/{} test/corpus/{}
# An archive, so that a target has only those parts of the host that it needs, and none of them needs the core.
$B/fuzz/host.a: $(patsubst %,$B/fuzz/host/%.o,$(filter-out %/main,$(HOST)))
	@rm -f $@
	$(call say,AR) ar rcs $@ $^
$(FUZZ:%=$B/fuzz/%): $B/fuzz/%: $B/fuzz/targets/%_fuzz.o $B/fuzz/host.a
	$(call say,LD) clang++ -fsanitize=fuzzer,address,undefined $^ -lz -o $@
