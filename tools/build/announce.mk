# What is to be done, and about how long it takes on cores like those of 2020.
ifeq ($(MAKELEVEL)$(findstring n,$(firstword -$(MAKEFLAGS))),0)
missing      = $(words $(filter-out $(wildcard $1),$1))
# Minutes at two seconds a file; the tests take as long as 240 files.
work         = $(shell expr $1 / 30 / $$(nproc) + 1)
GOALS       := $(or $(MAKECMDGOALS),all)
ifneq ($(filter all demo,$(GOALS)),)
count       := $(call missing,$(CORE_O) $(HOST_O))
ifneq ($(count),0)
$(info compiles $(count) files on $(shell nproc) cores: about $(call work,$(count)) min; `make help` lists what else there is)
endif
endif
ifneq ($(filter test,$(GOALS)),)
count       := $(call missing,$(CORE_O) $(HOST_O) $(TEST_O))
$(info compiles $(count) files and runs the tests on $(shell nproc) cores: about $(call work,$(shell expr $(count) + 240)) min)
endif
endif
