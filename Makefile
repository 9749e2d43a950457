# Pellucid: light and render volumes through pipes.  `make help` lists the targets.
# Non-recursive; objects under build/, programs in build/bin/.  Settings may be put into config.mak.
comma    := ,
-include config.mak

VERSION  := 0.1.0
PREFIX   ?= /usr/local
BINDIR   ?= $(PREFIX)/bin
LIBDIR   ?= $(PREFIX)/lib/pellucid
MANDIR   ?= $(PREFIX)/share/man
BUILD    ?= build
CC       ?= cc
CXX      ?= c++
# SAN=address,undefined or SAN=thread builds beside the ordinary objects.
SAN      ?=
ifneq ($(SAN),)
# Checks stand around nearly every operation of the ray kernels: at -O2 and -O3 the compiler takes over 40 minutes for
# them, at -O1 a few.
OPT      ?= -O1 -g1
OUT      := $(BUILD)/san-$(subst $(comma),-,$(SAN))
# VOL_FAULT=malloc:N makes the N-th allocation fail, C libraries' too: tests/fault
SANFLAGS := -fsanitize=$(SAN) -fno-sanitize-recover=all -fno-omit-frame-pointer -DVOL_FAULTS
else
OPT      ?= -O2 -g
OUT      := $(BUILD)
endif

V        ?= 0
Q        := $(if $(filter 1,$(V)),,@)

# Same input, same bytes: no contraction, no reassociation; fma only where the source says fma.
FLOAT    := -ffp-contract=off -fno-fast-math
WARN     := -Wall -Wextra -Wno-missing-field-initializers -Wno-psabi -Wshadow -Wconversion -Wvla -Wmissing-prototypes -Wstrict-prototypes -Werror
COMMON   := -Ilibcommon -I. $(FLOAT) -fvisibility=hidden -fno-common -pthread -fPIC -ffile-prefix-map=$(CURDIR)=. \
            $(SANFLAGS) -MMD -MP
CFLAGS_ALL   = -std=c17 -fexcess-precision=standard -D_POSIX_C_SOURCE=200809L -D_DEFAULT_SOURCE $(OPT) $(WARN) $(COMMON) $(CFLAGS)
CXXFLAGS_ALL = -std=c++17 $(OPT) -Wall -Wextra -Werror $(COMMON) $(CXXFLAGS)
LIBS     = -lOpenEXRCore -ldeflate -ljansson -lexpat -lz -lbz2 -llz4 -lm -ldl -pthread

EXR_CFLAGS ?= -isystem /usr/include/OpenEXR -isystem /usr/include/Imath
EXR_LIBS   ?= -lOpenEXR -lIex -lImath
VDB_CFLAGS ?= -isystem /usr/include/Imath
VDB_LIBS   ?= -lopenvdb -ltbb -lblosc -llz4
OIIO_CFLAGS ?= -isystem /usr/include/OpenEXR -isystem /usr/include/Imath
OIIO_LIBS  ?= -lOpenImageIO -lOpenImageIO_Util
VTK_CFLAGS ?= -isystem /usr/include/vtk-9.1
VTK_LIBS   ?= -lvtkIOCore-9.1 -lvtkCommonCore-9.1 -lvtksys-9.1

# ---- sources -------------------------------------------------------------------------------------------------------
LIB_SRC   := $(sort $(wildcard libcommon/*/*.c))
ifneq ($(shell uname -m),x86_64)
LIB_SRC   := $(filter-out %_avx2.c %_avx512.c,$(LIB_SRC))
endif
SHELL_SRC := $(sort $(wildcard cmd/shell/*.c))
PROGRAMS  := $(sort $(patsubst cmd/%.c,%,$(wildcard cmd/*.c)))
ADAPTERS  := $(sort $(patsubst libcommon/adapters/%.cc,%,$(wildcard libcommon/adapters/*.cc)))
UNITS     := $(sort $(basename $(notdir $(wildcard tests/unit/test_*.c tests/unit/test_*.cc))))
TOOLS     := $(sort $(patsubst tests/tools/%.c,%,$(wildcard tests/tools/*.c)))
SHIMS     := $(sort $(patsubst tests/shims/%.c,%,$(wildcard tests/shims/*.c)))
BENCHES   := $(sort $(patsubst tests/bench/%.c,%,$(wildcard tests/bench/*.c)))

LIB       := $(OUT)/libpellucid.a
LIB_OBJ   := $(LIB_SRC:%.c=$(OUT)/obj/%.o)
SHELL_OBJ := $(SHELL_SRC:%.c=$(OUT)/obj/%.o)
BINS      := $(PROGRAMS:%=$(OUT)/bin/%)
SOS       := $(ADAPTERS:%=$(OUT)/lib/pellucid/pellucid-%.so)
UNIT_BINS := $(UNITS:%=$(OUT)/tests/%)
TOOL_BINS := $(TOOLS:%=$(OUT)/tests/tools/%)
SHIM_SOS  := $(SHIMS:%=$(OUT)/tests/shims/%.so)
BENCH_BINS := $(BENCHES:%=$(OUT)/tests/bench/%)

# What the demo needs: no reader of foreign formats.
CORE_BINS := $(filter-out %/vol-import,$(BINS))
CORE_SOS  := $(filter-out %/pellucid-vtk.so,$(SOS))

.PHONY: all core demo test test-long bench bench-peers bench-tools lint install uninstall clean help deps deps-core unit-tests
.DELETE_ON_ERROR:
.DEFAULT_GOAL := all

all: $(BINS) $(SOS) ## build every program and adapter
core: $(CORE_BINS) $(CORE_SOS)

# ---- set-up --------------------------------------------------------------------------------------------------------
PKGS_CORE := gcc g++ make libc6-dev libopenexr-dev libopenvdb-dev libtbb-dev libblosc-dev libboost-dev libimath-dev \
             libopenimageio-dev libjansson-dev libexpat1-dev zlib1g-dev libdeflate-dev libbz2-dev liblz4-dev
PKGS_ALL  := $(PKGS_CORE) libvtk9-dev mandoc
deps-core:
	$(Q).ci/setup $(PKGS_CORE)
deps:
	$(Q).ci/setup $(PKGS_ALL)

# ---- rules ---------------------------------------------------------------------------------------------------------
# The source has the vectors; unrolling keeps them in registers.  With sanitizers at -O1 as well: see OPT.
LANES_OPT := $(if $(SAN),,-O3 -fno-tree-vectorize -funroll-loops)
$(OUT)/obj/%_avx2.o: CFLAGS += -mavx2 -mfma $(LANES_OPT)
$(OUT)/obj/%_avx512.o: CFLAGS += -mavx2 -mfma -mavx512f -mavx512dq -mavx512vl -mavx512bw -mprefer-vector-width=512 $(LANES_OPT)
$(OUT)/obj/libcommon/io/exr.o: CFLAGS += $(EXR_CFLAGS)
$(OUT)/obj/libcommon/io/exr_%.o: CFLAGS += $(EXR_CFLAGS)

$(OUT)/obj/%.o: %.c Makefile
	@mkdir -p $(@D)
	$(Q)$(CC) $(CFLAGS_ALL) -c -o $@ $<

$(LIB): $(LIB_OBJ)
	$(Q)rm -f $@ && ar rcsD $@ $^

$(OUT)/bin/%: $(OUT)/obj/cmd/%.o $(SHELL_OBJ) $(LIB)
	@mkdir -p $(@D)
	$(Q)$(CC) $(SANFLAGS) $(LDFLAGS) -o $@ $< $(SHELL_OBJ) $(LIB) $(LIBS)

$(OUT)/tests/%: $(OUT)/obj/tests/unit/%.o $(LIB)
	@mkdir -p $(@D)
	$(Q)$(CC) $(SANFLAGS) $(LDFLAGS) -o $@ $< $(LIB) $(LIBS)

# Tests against the C++ classes of OpenEXR.
$(OUT)/obj/tests/unit/%.o: tests/unit/%.cc Makefile
	@mkdir -p $(@D)
	$(Q)$(CXX) $(CXXFLAGS_ALL) $(EXR_CFLAGS) -c -o $@ $<

$(OUT)/tests/test_exr_sweep: $(OUT)/obj/tests/unit/test_exr_sweep.o $(LIB)
	@mkdir -p $(@D)
	$(Q)$(CXX) $(SANFLAGS) $(LDFLAGS) -o $@ $< $(LIB) $(LIBS) $(EXR_LIBS)

# Against Blosc itself.
$(OUT)/tests/test_blosc: LIBS += -lblosc

$(OUT)/tests/test_blosc_pack: $(OUT)/obj/tests/unit/test_blosc_pack.o $(LIB)
	@mkdir -p $(@D)
	$(Q)$(CXX) $(SANFLAGS) $(LDFLAGS) -o $@ $< $(LIB) $(LIBS)

$(OUT)/tests/tools/%: $(OUT)/obj/tests/tools/%.o $(LIB)
	@mkdir -p $(@D)
	$(Q)$(CC) $(SANFLAGS) $(LDFLAGS) -o $@ $< $(LIB) $(LIBS)

# For LD_PRELOAD; tests of sanitizer builds do without.
$(OUT)/tests/shims/%.so: tests/shims/%.c Makefile
	@mkdir -p $(@D)
	$(Q)$(CC) $(CFLAGS_ALL) -fno-sanitize=all -fvisibility=default -MF $(@:.so=.d) -shared -o $@ $< -ldl

# Three estimators in one file: as quickly compiled as can be.
$(OUT)/obj/tests/unit/test_traversal.o: CFLAGS += -O1

# What it counts are the limits of the machine, not of the optimiser.
$(OUT)/obj/tests/bench/roofline.o: CFLAGS += -O3

$(OUT)/tests/bench/%: $(OUT)/obj/tests/bench/%.o $(LIB)
	@mkdir -p $(@D)
	$(Q)$(CC) $(SANFLAGS) $(LDFLAGS) -o $@ $< $(LIB) $(LIBS)

ADAPTER_CFLAGS_vdb   = $(VDB_CFLAGS)
ADAPTER_LIBS_vdb     = $(VDB_LIBS)
ADAPTER_LIBS_blosc   = -lblosc
ADAPTER_CFLAGS_image = $(OIIO_CFLAGS)
ADAPTER_LIBS_image   = $(OIIO_LIBS)
ADAPTER_CFLAGS_vtk   = $(VTK_CFLAGS)
ADAPTER_LIBS_vtk     = $(VTK_LIBS)

$(OUT)/lib/pellucid/pellucid-%.so: libcommon/adapters/%.cc Makefile
	@mkdir -p $(@D) $(OUT)/obj/libcommon/adapters
	$(Q)$(CXX) $(CXXFLAGS_ALL) $(ADAPTER_CFLAGS_$*) -MF $(OUT)/obj/libcommon/adapters/$*.d -MT $@ -shared $(LDFLAGS) \
	    -o $@ $< $(ADAPTER_LIBS_$*)

.PRECIOUS: $(OUT)/obj/%.o
-include $(shell find $(OUT)/obj -name '*.d' 2>/dev/null)

# ---- what people run -----------------------------------------------------------------------------------------------
demo: deps-core ## set up, build, and render pictures from the data in examples/
	$(Q)$(MAKE) --no-print-directory core
	$(Q)$(MAKE) --no-print-directory -C examples demo BIN=$(abspath $(OUT))/bin

unit-tests: $(UNIT_BINS) $(TOOL_BINS) $(SHIM_SOS)

test: deps ## set up, build and run the tests (under 15 minutes on 2 cores)
	$(Q)$(MAKE) --no-print-directory all unit-tests
	$(Q)tests/run $(abspath $(OUT))

test-long: deps ## the tests that take longer
	$(Q)$(MAKE) --no-print-directory all unit-tests
	$(Q)tests/run --long $(abspath $(OUT))

bench-tools: $(BENCH_BINS) $(TOOL_BINS)

bench: ## limits of this machine, then seconds and errors on scenes (BENCH_QUICK=1: small pictures)
	$(Q)$(MAKE) --no-print-directory all bench-tools
	$(Q)tests/bench/run $(abspath $(OUT))

bench-peers: ## the same picture by other programs, where installed
	$(Q)$(MAKE) --no-print-directory all bench-tools
	$(Q)tests/bench/peers $(abspath $(OUT))

lint: ## man pages, shell scripts, banned functions
	$(Q)tests/lint

install: all ## into $(PREFIX), honouring DESTDIR
	install -d $(DESTDIR)$(BINDIR) $(DESTDIR)$(LIBDIR) $(DESTDIR)$(MANDIR)/man1 $(DESTDIR)$(MANDIR)/man5 $(DESTDIR)$(MANDIR)/man7
	install -m 755 $(BINS) $(DESTDIR)$(BINDIR)
	install -m 755 $(SOS) $(DESTDIR)$(LIBDIR)
	for s in 1 5 7; do for f in man/*.$$s; do [ ! -f "$$f" ] || install -m 644 "$$f" $(DESTDIR)$(MANDIR)/man$$s; done; done

uninstall: ## what install put there
	rm -f $(PROGRAMS:%=$(DESTDIR)$(BINDIR)/%) $(ADAPTERS:%=$(DESTDIR)$(LIBDIR)/pellucid-%.so)
	-rmdir $(DESTDIR)$(LIBDIR)
	for s in 1 5 7; do for f in man/*.$$s; do rm -f $(DESTDIR)$(MANDIR)/man$$s/$${f##*/}; done; done

clean: ## remove build/
	rm -rf $(BUILD)

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-12s %s\n", $$1, $$2 }' Makefile
	@echo "  variables: SAN=address,undefined  OPT='-O2 -g'  PREFIX=$(PREFIX)  DESTDIR=  BUILD=$(BUILD)  V=1"
