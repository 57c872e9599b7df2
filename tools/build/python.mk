# The shared library, libwisp.so, and the Python package around it: `make wheel`, `make install-python`.
# Debian's own Python has numpy and pytest.
PYTHON      ?= /usr/bin/python3
# Of the host: what the C interface shares with it, and what chooses settings.
SHARED_O     = $(CORE_O) $(C_API_O) $B/shared/choose.o \
               $(patsubst %,$B/host/%.o,prepare/extinction results/picture_bytes commands/defaults)
# Nothing is visible but what the C interface declares; clones for wide vectors would be.
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
