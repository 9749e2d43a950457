// Blosc behind a table of C functions.
#include <blosc.h>

#include <algorithm>
#include <cstdlib>

extern "C" {
#include "adapters/blosc.h"
}

namespace {

// Blosc 1.21 works on through a null pointer where it gets no memory.  What it takes are a few blocks; they will come from
// what is given back here.
bool has_room(size_t block)
{
    void *volatile room = malloc(4 * block + 32768); // volatile: the compiler would leave it out
    free(room);
    return room != nullptr;
}

VolBloscResult decompress(const void *from, size_t size, void *to, size_t to_size)
{
    size_t holds = 0, takes = 0, block = 0;
    blosc_cbuffer_sizes(from, &holds, &takes, &block); // all 0 where its header makes no sense
    if (holds != to_size || takes != size)
        return VOL_BLOSC_DAMAGED;
    if (!has_room(std::min(block, to_size)))
        return VOL_BLOSC_NO_MEMORY;
    return blosc_decompress_ctx(from, to, to_size, 1) == static_cast<int>(to_size) ? VOL_BLOSC_DONE : VOL_BLOSC_DAMAGED;
}

} // namespace

extern "C" __attribute__((visibility("default"))) const VolBloscAdapter pellucid_blosc_adapter;
const VolBloscAdapter pellucid_blosc_adapter = {"Blosc " BLOSC_VERSION_STRING, decompress};
