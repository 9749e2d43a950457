// Blosc behind a table of C functions.
#include <blosc.h>

extern "C" {
#include "adapters/blosc.h"
}

namespace {

bool decompress(const void *from, size_t size, void *to, size_t to_size)
{
    size_t holds = 0, takes = 0, block = 0;
    blosc_cbuffer_sizes(from, &holds, &takes, &block); // all 0 where its header makes no sense
    return holds == to_size && takes == size && blosc_decompress_ctx(from, to, to_size, 1) == static_cast<int>(to_size);
}

} // namespace

extern "C" __attribute__((visibility("default"))) const VolBloscAdapter pellucid_blosc_adapter;
const VolBloscAdapter pellucid_blosc_adapter = {"Blosc " BLOSC_VERSION_STRING, decompress};
