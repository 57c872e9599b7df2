# What is measured, and what peers are measured beside it. Peers are built only where their packages are.
EMBREE_PEERS = $(foreach p,rays shadow_rays,$(ARITHMETICS:%=$B/peers/$(p)_%))
PEERS        = $(if $(wildcard /usr/include/nanoflann.hpp),$B/peers/point_tree_f32 $B/peers/point_tree_f64) \
               $(if $(wildcard /usr/include/embree3/rtcore.h),$(EMBREE_PEERS)) $B/peers/marcher
$B/peers/marcher: tools/peers/marcher.c
	$(call say,CC) mkdir -p $(@D) && $(CC) -O3 -march=native $< -o $@ -lm
$(foreach a,$(ARITHMETICS),$(eval $(call objects,peers/$a,tools/peers,CXX,PEER_FLAGS,-DWISP_ARITH=$a)))
PEER_FLAGS   = $(FLAGS) $(MULTIVERSION)
$B/peers/point_tree_f32 $B/peers/point_tree_f64: $B/peers/point_tree_%: $B/peers/%/point_tree.o $B/core/%/geometry/point_kdtree.o
	$(call say,LD) $(CXX) $(FLAGS) $^ -o $@
$(foreach p,rays shadow_rays,$(eval $(ARITHMETICS:%=$B/peers/$p_%): $B/peers/$p_%: $B/peers/%/$p.o))
$(EMBREE_PEERS): $(LIBRARY_O)
	$(call say,LD) $(CXX) $(FLAGS) $(filter %.o,$^) $(LIBS) -lembree3 -o $@

bench: all $(PEERS) ## the speed figures, each with its error and what it is compared to; SECTIONS=some, QUICK=1: minutes for hours
	DATA=$(DATA) python3 tools/measure $(SECTIONS)
truth: all ## what `make bench` measures errors against, where it is missing; two hours, resumed where it was stopped
	python3 tools/measure truth
measured: ## fixtures/measured: the tables that `make bench` has left, as those of a release; README's figures by them
	python3 tools/measure/measured.py
# Debian's own Python has matplotlib.
report: ## build/report/index.html: what bench, hard-cases and portability have left, as one page
	DATA=$(DATA) /usr/bin/python3 tools/measure/report
report-test: report ## looks at that page in Chromium
	/usr/bin/python3 tools/measure/report/test.py
	node tools/measure/report/check.mjs
report-deps: ## as root: installs what the two need
	apt-get update -q
	apt-get install -y --no-install-recommends python3-matplotlib chromium $(NPM)
	npm install --no-save --prefix build/web playwright-core
convergence: $B/wisp ## how direct converges to the reference; half an hour the first time
	python3 tools/measure convergence
hard-cases: $B/tests ## each case of test/physics/hard_cases.txt in each arithmetic, as a table
	python3 tools/measure hard_cases
physics: $B/tests $B/wisp ## all rows of test/physics/transport.csv, to a standard error of ERROR=0.003; three quarters of an hour
	python3 tools/measure/physics.py
lessons: $B/wisp ## fixtures/lessons: runs them, checks their figures and answers, makes build/lessons/index.html; LESSON=06: one
	@python3 tools/lessons/test.py 2> $B/lessons.log || { cat $B/lessons.log; exit 1; }
	python3 tools/lessons --wisp $B/wisp --out $B/lessons $(LESSON)
