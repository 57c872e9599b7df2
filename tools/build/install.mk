# What is installed, and what is given away: `make install`, `make dist`, `make deb`.
PREFIX      ?= /usr/local
DESTDIR     ?=
VERSION     := $(shell sed -n 's/.*version = "\(.*\)";/\1/p' src/host/base/version.h)
COMPLETIONS  = share/bash-completion/completions/wisp=$B/wisp.bash share/zsh/site-functions/_wisp=$B/wisp.zsh \
               share/fish/vendor_completions.d/wisp.fish=$B/wisp.fish
# NAME=FILE: names below $(PREFIX), and what is put there.
INSTALLED    = bin/wisp=$B/wisp $(if $(OPENVDB),libexec/wisp/vdb_to_nvdb=$B/vdb_to_nvdb) \
               lib/libwisp.a=$B/libwisp.a lib/pkgconfig/wisp.pc=$B/wisp.pc share/man/man1/wisp.1=$B/wisp.1 $(COMPLETIONS) \
               $(foreach header,$(wildcard include/wisp/*.h),$(header)=$(header))
to           = "$(DESTDIR)$(PREFIX)/$(firstword $(subst =, ,$1))"
from         = $(lastword $(subst =, ,$1))

# A line of a recipe for each pair.
define install_one
@install -D -m $(if $(filter bin/% libexec/%,$1),755,644) $(call from,$1) $(call to,$1)

endef
install: $(foreach pair,$(INSTALLED),$(call from,$(pair))) ## wisp and its library below PREFIX=/usr/local of DESTDIR=
	$(foreach pair,$(INSTALLED),$(call install_one,$(pair)))
# Folders of wisp's own go when they are empty.
uninstall: ## removes what `make install` with the same PREFIX put there
	@rm -f $(foreach pair,$(INSTALLED),$(call to,$(pair)))
	@rmdir $(call to,include/wisp) $(call to,libexec/wisp) 2> /dev/null || true
install-test: ## installs into a fresh prefix, builds tools/examples there, renders, uninstalls; and unpacks `make dist`
	+tools/install_test $B

# Objects of three arithmetics have the same names: they are added (q), not replaced.
$B/libwisp.a: $(CORE_O) $(C_API_O)
	@rm -f $@
	$(call say,AR) ar qcsD $@ $(sort $^)
# Where the prefix is follows from where this file is.
$B/wisp.pc: src/host/base/version.h tools/build/install.mk
	$(call say,PC) printf '%s\n' 'prefix=$${pcfiledir}/../..' '' 'Name: wisp' 'Version: $(VERSION)' \
	    'Description: deterministic renderer of smoke and animated triangles' \
	    'Cflags: -I$${prefix}/include' 'Libs: -L$${prefix}/lib -lwisp' > $@
$B/wisp.1: KIND = man
$B/wisp.bash $B/wisp.zsh $B/wisp.fish: KIND = $(subst .,,$(suffix $@))
$B/wisp.1 $B/wisp.bash $B/wisp.zsh $B/wisp.fish: tools/manual $B/wisp
	$(call say,MANUAL) tools/manual $(KIND) $B/wisp > $@.part && mv $@.part $@

# Files that git knows; without it all but what was made.
ARCHIVE      = wisp-$(VERSION)
made         = -path './$B' -o -path ./build -o -name __pycache__
files        = if [ -e .git ]; then git ls-files; else find . \( $(made) \) -prune -o -type f -print | cut -c3-; fi
dist: ## the sources as build/wisp-VERSION.tar.gz, the same bytes from the same files
	@mkdir -p $B
	$(call say,TAR) $(files) | LC_ALL=C sort | tar -c --no-recursion -T - --transform='s,^,$(ARCHIVE)/,' --format=ustar \
	    --mtime=2000-01-01T00:00Z --owner=0 --group=0 --numeric-owner --mode=u+w,go=u-w | gzip -9n > $B/$(ARCHIVE).tar.gz
deb: ## build/wisp_VERSION_ARCHITECTURE.deb, a Debian package of what `make install` puts below /usr
	+tools/debian/build $B $(VERSION)
