# How a file is compiled: one rule for each kind of object, a line for each file.

# All cores, where nobody says -j. (make itself prefers what its command line says.)
ifeq ($(MAKELEVEL),0)
MAKEFLAGS   += -j$(shell nproc)
endif

# In front of a command: shows what it makes instead of the command, `CXX core/f32/photons/photon_map`. With V=1 the command.
say          = $(if $V,,@echo "$1 $(patsubst $B/%,%,$(@:.o=))" &&)

# $(call objects,FOLDER,SOURCES,COMPILER,FLAGS): the objects of a folder below $B; COMPILER and FLAGS name variables. What is
# to be installed is so before anything is compiled, and what is to be removed is gone.
define objects
$B/$1/%.o: $2/%.cpp | $(filter %deps clean,$(MAKECMDGOALS))
	@mkdir -p $$(@D)
	$$(call say,CXX) $$($3) $$(CPPFLAGS) $$($4) $5 -c $$< -o $$@
endef
$(foreach a,$(ARITHMETICS),$(eval $(call objects,core/$a,src/core,CXX,CORE_FLAGS,-DWISP_ARITH=$a)))
$(eval $(call objects,host,src/host,CXX,HOST_FLAGS))
$(eval $(call objects,c_api,src/c_api,CXX,CORE_FLAGS))
$(eval $(call objects,shared,src/c_api/shared,CXX,HOST_FLAGS))
$(eval $(call objects,tools,tools,CXX,TOOL_FLAGS))
HOST_FLAGS   = $(FLAGS) $(PIC) -DWISP_FLAGS='"$(BITS) $(OPT) $(ARCH)"'
TOOL_FLAGS   = -Itools $(FLAGS)
