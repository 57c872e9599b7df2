# The shared library, libwisp.so, and the Python package around it: `make wheel`, `make install-python`.
# Debian's own Python has numpy and pytest.
PYTHON      ?= /usr/bin/python3
# Position-independent objects, in a tree of their own. Nothing is visible but what the C interface declares; clones for wide
# vectors would be.
PIC          = -fPIC -fvisibility=hidden
SHARED_CORE_FLAGS = $(CORE_FLAGS) $(PIC)
SHARED_FLAGS = $(HOST_FLAGS) $(PIC)
$(foreach a,$(ARITHMETICS),$(eval $(call objects,shared/core/$a,src/core,CXX,SHARED_CORE_FLAGS,-DWISP_ARITH=$a)))
$(eval $(call objects,shared/c_api,src/c_api,CXX,SHARED_FLAGS))
$(eval $(call objects,shared/host,src/host,CXX,SHARED_FLAGS))
# Of the host: what the C interface shares with it, and what chooses settings.
SHARED_O     = $(foreach a,$(ARITHMETICS),$(CORE:%=$B/shared/core/$a/%.o)) $(C_API:%=$B/shared/c_api/%.o) \
               $(patsubst %,$B/shared/host/%.o,base/sha256 prepare/core_units prepare/extinction results/picture_bytes commands/defaults)
$B/libwisp.so: $(SHARED_O)
	@echo '{ global: wisp_*; local: *; };' > $B/libwisp.map
	$(call say,LD) $(CXX) $(FLAGS) -shared -Wl,--no-undefined -Wl,--version-script=$B/libwisp.map $^ -o $@
shared-library: $B/libwisp.so ## build/libwisp.so, the C interface (wisp/c_api.h) for other languages
wheel: $B/libwisp.so ## build/wisp-VERSION-*.whl, the Python package with its library
	@$(PYTHON) tools/python/build_wheel $(VERSION) $< $B
# The folder is that of PYTHON: /usr/local/lib/..., or in a virtual environment its own.
install-python: wheel ## the Python package where PYTHON=/usr/bin/python3 finds it, or its virtual environment, below DESTDIR=
	@folder="$(DESTDIR)$$($(PYTHON) -c 'import sysconfig; print(sysconfig.get_path("platlib"))')" && mkdir -p "$$folder" && \
	    $(PYTHON) -m zipfile -e $B/wisp-$(VERSION)-*.whl "$$folder" && echo "installed below $$folder"
python-test: wheel $B/wisp ## the Python package against the program, by pytest
	rm -rf $B/python && $(PYTHON) -m zipfile -e $B/wisp-$(VERSION)-*.whl $B/python
	PATH="$(abspath $B):$$PATH" PYTHONPATH=$(abspath $B/python) PYTHONDONTWRITEBYTECODE=1 \
	    $(PYTHON) -m pytest -q -p no:cacheprovider --import-mode=importlib tools/python
python-deps: ## as root: installs what that needs
	apt-get update -q
	apt-get install -y --no-install-recommends $(PACKAGES) python3-numpy python3-pytest
