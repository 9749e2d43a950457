/* What a run writes: prepared while it works, put in place together at its end, or not at all. */
#ifndef CMD_SHELL_OUTPUTS_H
#define CMD_SHELL_OUTPUTS_H

#include "io/out.h"

typedef struct Outputs {
    struct {
        VolOutput output;
        VolBytes bytes; /* of one that is written directly */
    } items[2];         /* the image and a plot, a report and an image */
    size_t count;
} Outputs;

/* Takes the bytes over, whatever comes of it. */
VolStatus outputs_add(Outputs *outputs, const char *path, VolBytes *bytes, VolOutOptions options, VolError *err);

bool outputs_some_are_direct(const Outputs *outputs);

/* What is written directly first: that can fail where a file that is prepared cannot. */
VolStatus outputs_commit_direct(Outputs *outputs, VolError *err);
VolStatus outputs_commit_files(Outputs *outputs, VolError *err);
void outputs_drop(Outputs *outputs);

#endif
