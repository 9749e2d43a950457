# The examples of Yang et al. 2012 (Y), figure by figure: each target makes out/NAME-*.exr and out/NAME-*.png.
# GALLERY.md shows them and says how long they take.
.SECONDARY:
.PHONY: gallery engine clip boundary kinds sliders depth spikes noise

gallery: engine clip boundary kinds sliders depth spikes noise ## the examples of Y, all of those below

engine: $(patsubst %,out/engine-%.png,classic unshaded hybrid adjusted) ## Y 4: one engine block, classic, unshaded and hybrid
clip: out/clip-classic.png out/clip-hybrid.png ## Y 5: a head cut in half, classic against hybrid
boundary: $(patsubst %,out/boundary-%.png,delta soft delta-edge soft-edge) ## Y 6: a delta isosurface against a soft boundary
kinds: $(patsubst %,out/kinds-%.png,a b c d e f) ## Y 8: kinds of particles and surfaces, one by one
sliders: $(patsubst %,out/sliders-%.png,b c d e f) ## Y 9: from particles alone to surfaces alone
depth: $(patsubst %,out/depth-%.png,220 22 7) ## Y 10: ever denser particles, the same surfaces
spikes: $(patsubst %,out/spikes-%.png,direct integrals full exact direct-error integrals-error full-error) ## Y 11: four estimators, one step
noise: out/noise-classic.png out/noise-hybrid.png ## what classic shading makes of noise

YANG := $(BIN)/vol-render -q --background $(NIGHT)
BLOCK := --size 400x400 --eye 300,-400,300 --look-at 0,5,-8 --up 0,0,1 --fov 24 --samples 2
HALF := --size 400x400 --eye -430,-160,30 --look-at 104,101,72 --up 0,0,-1 --fov 19 --clip 1,0,0,100 --samples 2

out/engine-%.exr: data/engine.vdb tf/engine-%.json $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(YANG) -t tf/engine-$*.json $(BLOCK) --stats out/engine-$*.stats -o $@ data/engine.vdb

# the last two before a bright background: what they hold does not scatter light
out/kinds-e.exr out/kinds-f.exr: BEHIND := --background 0.75,0.75,0.75
out/kinds-%.exr: data/engine.vdb tf/kinds-%.json $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(YANG) $(BEHIND) -t tf/kinds-$*.json $(BLOCK) --stats out/kinds-$*.stats -o $@ data/engine.vdb

out/clip-%.exr: data/head.vdb tf/clip-%.json $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(YANG) -t tf/clip-$*.json $(HALF) --stats out/clip-$*.stats -o $@ data/head.vdb

out/depth-%.exr: data/head.vdb tf/depth.json $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(YANG) -t tf/depth.json --particle-step $* $(HALF) --stats out/depth-$*.stats -o $@ data/head.vdb

# One ray per pixel: edges are what is compared.  The close-ups are few pixels, to be looked at enlarged.
SKULL := --eye -200,-300,-10 --up 0,0,-1
out/boundary-%.exr: data/head.vdb tf/boundary-%.json $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(YANG) -t tf/boundary-$*.json $(SKULL) --look-at 106,98,67 --fov 23 --size 400x400 --stats out/boundary-$*.stats -o $@ data/head.vdb

out/boundary-%-edge.exr: data/head.vdb tf/boundary-%.json $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(YANG) -t tf/boundary-$*.json $(SKULL) --look-at 76,78,52 --fov 7 --size 100x100 -o $@ data/head.vdb

# Y 9 (b) to (f): PARTICLE_STEP:SCALAR_STEP
out/sliders-b.exr: SLIDERS := 4:600
out/sliders-c.exr: SLIDERS := 4:40
out/sliders-d.exr: SLIDERS := 4:13
out/sliders-e.exr: SLIDERS := 12:13
out/sliders-f.exr: SLIDERS := 600:13
out/sliders-%.exr: data/hydrogen.vdb tf/sliders.json $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(YANG) -t tf/sliders.json --particle-step $(firstword $(subst :, ,$(SLIDERS))) --scalar-step $(lastword $(subst :, ,$(SLIDERS))) \
	    --size 400x400 --eye 290,-190,190 --look-at 63.5,63.5,63.5 --up 0,0,1 --fov 17 --samples 2 --stats out/sliders-$*.stats -o $@ data/hydrogen.vdb

out/spikes.vdb: $(BIN)/vol-gen yang.mk
	@mkdir -p out
	@$(BIN)/vol-gen field noise --size 64 --param frequency=0.8 --param octaves=1 --param value=1.2 -o $@

SPIKES := -t tf/spikes.json --size 400x400 --eye 2.4,1.8,3.4 --look-at 0,0,0 --fov 42
out/spikes-%.exr: out/spikes.vdb tf/spikes.json $(BIN)/vol-render yang.mk
	@$(YANG) $(SPIKES) --estimator $* --step 2v --stats out/spikes-$*.stats -o $@ $<

out/spikes-precise.exr: out/spikes.vdb tf/spikes.json $(BIN)/vol-render yang.mk
	@$(YANG) $(SPIKES) --precise --stats out/spikes-precise.stats -o $@ $<

# vol-diff says by exit 1 that they differ, which is what is wanted of it here
out/spikes-%-error.exr: out/spikes-%.exr out/spikes-precise.exr $(BIN)/vol-diff
	@$(BIN)/vol-diff -o $@ $(filter %.exr,$^) >out/spikes-$*.diff || [ $$? = 1 ]

out/noise-%.exr: tf/noise-%.json $(BIN)/vol-gen $(BIN)/vol-render yang.mk
	@mkdir -p out
	@$(BIN)/vol-gen field noise --size 64 --param frequency=12 --param octaves=2 --param value=0.02 | \
	    $(YANG) -t $< --size 400x400 --eye 3,2.2,4 --look-at 0,0,0 --fov 38 --samples 2 --stats out/noise-$*.stats -o $@
