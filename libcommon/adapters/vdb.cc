/* OpenVDB behind a table of C functions: encodes trees.
 *
 * Root nodes are used without openvdb::Tree around them, which would start threads to count and to free; and without
 * io::File or io::Stream, which copy files to the temporary folder and read ahead.  Nothing of the main program is
 * linked; no exception leaves. */
#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>
#include <openvdb/tree/Tree.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <system_error>
#include <type_traits>

#include "adapters/blosc_pack.h"
#include "adapters/vdb_memory.h"

extern "C" {
#include "adapters/vdb_adapter.h"
}

namespace {

using openvdb::Coord;

constexpr int LEAF_VALUES = 512;
constexpr uint32_t FILE_VERSION = 224;

VolStatus fail(VolError *err, VolStatus status, const char *why)
{
    std::snprintf(err->text, sizeof err->text, "%s", why);
    for (char *c = err->text; *c; c++)
        if (static_cast<unsigned char>(*c) < 0x20)
            *c = '?';
    return status;
}

/* Runs `body` and turns whatever it throws into a status. */
template <typename Body>
VolStatus guarded(VolError *err, const Body &body)
{
    try {
        return body();
    } catch (const std::bad_alloc &) {
        return fail(err, VOL_NOMEM, "out of memory");
    } catch (const std::ios_base::failure &) {
        return fail(err, VOL_BAD_INPUT, "its bytes end too early");
    } catch (const std::system_error &e) { // threads
        const bool refused = e.code() == std::errc::resource_unavailable_try_again;
        return fail(err, refused ? VOL_NOMEM : VOL_BAD_INPUT, e.what());
    } catch (const std::exception &e) {
        return fail(err, VOL_BAD_INPUT, e.what());
    } catch (...) {
        return fail(err, VOL_BAD_INPUT, "unknown failure in OpenVDB");
    }
}

/* ---- streams over memory ---- */

void prepare(std::istream &in, const VolVdbTreeBytes &tree)
{
    in.exceptions(std::ios_base::failbit | std::ios_base::badbit | std::ios_base::eofbit);
    openvdb::io::setVersion(in, openvdb::VersionId(openvdb::OPENVDB_LIBRARY_MAJOR_VERSION,
                                                       openvdb::OPENVDB_LIBRARY_MINOR_VERSION),
                            std::min(tree.version, FILE_VERSION));
    openvdb::io::setDataCompression(in, tree.compression);
}

/* ---- values ---- */

template <typename T>
struct Value {
    using Component = T;
    static constexpr int components = 1;
    static double get(const T &v, int) { return static_cast<double>(v); }
};

template <typename T>
struct Value<openvdb::math::Vec3<T>> {
    using Component = T;
    static constexpr int components = 3;
    static double get(const openvdb::math::Vec3<T> &v, int c) { return static_cast<double>(v[c]); }
};

template <typename T>
void widen(const T &v, double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = c < Value<T>::components ? Value<T>::get(v, c) : 0.0;
}

/* ---- what a tree holds ---- */

struct Box {
    int32_t lo[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, hi[3] = {INT32_MIN, INT32_MIN, INT32_MIN};
    void add(const int32_t from[3], const int32_t to[3])
    {
        for (int k = 0; k < 3; k++) {
            lo[k] = std::min(lo[k], from[k]);
            hi[k] = std::max(hi[k], to[k]);
        }
    }
};

/* Word x of a leaf's mask holds the 8 x 8 voxels of that x; bit 8 y + z. */
template <typename LeafT>
void count_leaf(const LeafT &leaf, VolVdbGridInfo &info, Box &box)
{
    uint64_t any = 0;
    int32_t x0 = 8, x1 = -1;
    for (int x = 0; x < 8; x++) {
        const uint64_t word = leaf.valueMask().template getWord<openvdb::Index64>(static_cast<openvdb::Index>(x));
        info.active_voxels += static_cast<uint64_t>(__builtin_popcountll(word));
        any |= word;
        if (word) {
            x0 = std::min(x0, x);
            x1 = x;
        }
    }
    info.leaves++;
    if (!any)
        return;
    unsigned columns = 0;
    for (int y = 0; y < 8; y++)
        columns |= static_cast<unsigned>(any >> (8 * y)) & 255u;
    const Coord o = leaf.origin();
    const int32_t from[3] = {o.x() + x0, o.y() + __builtin_ctzll(any) / 8, o.z() + __builtin_ctz(columns)};
    const int32_t to[3] = {o.x() + x1, o.y() + (63 - __builtin_clzll(any)) / 8, o.z() + 31 - __builtin_clz(columns)};
    box.add(from, to);
}

void count_tile(const Coord &origin, int32_t size, VolVdbGridInfo &info, Box &box)
{
    const int32_t from[3] = {origin.x(), origin.y(), origin.z()};
    const int32_t to[3] = {from[0] + (size - 1), from[1] + (size - 1), from[2] + (size - 1)};
    const uint64_t edge = static_cast<uint64_t>(size);
    info.active_voxels += edge * edge * edge;
    info.active_tiles++;
    box.add(from, to);
}

template <typename NodeT>
void count_node(const NodeT &node, VolVdbGridInfo &info, Box &box)
{
    if constexpr (NodeT::LEVEL == 0) {
        count_leaf(node, info, box);
    } else {
        for (auto it = node.beginValueOn(); it; ++it)
            count_tile(it.getCoord(), static_cast<int32_t>(NodeT::ChildNodeType::DIM), info, box);
        for (auto it = node.beginChildOn(); it; ++it)
            count_node(*it, info, box);
    }
}

template <typename RootT>
void count_tree(const RootT &root, VolVdbGridInfo &info)
{
    Box box;
    info.active_voxels = info.leaves = info.active_tiles = 0;
    widen(root.background(), info.background);
    for (auto it = root.cbeginValueOn(); it; ++it)
        count_tile(it.getCoord(), static_cast<int32_t>(RootT::ChildNodeType::DIM), info, box);
    for (auto it = root.cbeginChildOn(); it; ++it)
        count_node(*it, info, box);
    info.empty = info.active_voxels == 0;
    for (int k = 0; k < 3; k++) {
        info.box_min[k] = info.empty ? 0 : box.lo[k];
        info.box_max[k] = info.empty ? -1 : box.hi[k];
    }
}

/* ---- reading ---- */

/* Points are stored in several passes over the leaves, which the grid manages. */
VolStatus measure(const VolVdbTreeBytes *tree, size_t *size, VolError *err)
{
    return guarded(err, [&] {
        static const bool ready = (openvdb::initialize(), true); // only types by name need it
        (void)ready;
        InBuffer buffer(tree->data, tree->size);
        std::istream in(&buffer);
        auto meta = std::make_shared<openvdb::io::StreamMetadata>();
        openvdb::io::setStreamMetadataPtr(in, meta, false);
        prepare(in, *tree);
        const openvdb::GridBase::Ptr grid = openvdb::GridBase::createGrid(tree->type);
        grid->setSaveFloatAsHalf(tree->half);
        try {
            grid->readTopology(in);
            grid->readBuffers(in);
        } catch (const std::bad_alloc &) { /* of a length that no check has seen */
            return fail(err, VOL_BAD_INPUT, "its points are damaged, or want more memory than there is");
        }
        *size = static_cast<size_t>(in.tellg());
        return VOL_OK;
    });
}

/* ---- writing ---- */

/* One value of a tree from doubles; false where it does not fit. */
bool narrow(const double *from, bool half, float &to)
{
    to = static_cast<float>(from[0]);
    if (half)
        to = static_cast<float>(openvdb::math::half(to));
    return std::isfinite(to) || !std::isfinite(from[0]);
}

bool narrow(const double *from, bool, double &to)
{
    to = from[0];
    return true;
}

bool narrow(const double *from, bool, int32_t &to)
{
    if (!(from[0] >= -2147483648.0 && from[0] <= 2147483647.0))
        return false;
    to = static_cast<int32_t>(std::nearbyint(from[0]));
    return true;
}

bool narrow(const double *from, bool half, openvdb::Vec3f &to)
{
    return narrow(from, half, to[0]) && narrow(from + 1, half, to[1]) && narrow(from + 2, half, to[2]);
}

VolStatus unfit(VolError *err, const double *value)
{
    std::snprintf(err->text, sizeof err->text, "value %.9g does not fit the grid's type", value[0]);
    return VOL_BAD_INPUT;
}

class Builder {
public:
    virtual ~Builder() = default;
    virtual VolStatus leaf(const int32_t *origin, const float *floats, const double *doubles, const uint64_t *active,
                           VolError *err) = 0;
    virtual VolStatus tile(const int32_t *origin, int32_t size, const double *value, bool active, VolError *err) = 0;
    virtual void encode(uint32_t compression, size_t most, VolVdbEncodedTree &out) const = 0;
};

template <typename TreeT>
class TypedBuilder : public Builder {
    using RootT = typename TreeT::RootNodeType;
    using LeafT = typename TreeT::LeafNodeType;
    using T = typename TreeT::ValueType;

public:
    TypedBuilder(const T &background, bool half) : root_(background), half_(half) {}

    VolStatus leaf(const int32_t *origin, const float *floats, const double *doubles, const uint64_t *active,
                   VolError *err) override
    {
        constexpr int components = Value<T>::components;
        auto leaf = std::make_unique<LeafT>(Coord(origin), root_.background(), false);
        T *data = leaf->buffer().data();
        double wide[3];
        for (int n = 0; n < LEAF_VALUES; n++) {
            for (int c = 0; c < components; c++)
                wide[c] = floats ? static_cast<double>(floats[n * components + c]) : doubles[n * components + c];
            if (!narrow(wide, half_, data[n]))
                return unfit(err, wide);
        }
        typename LeafT::NodeMaskType mask;
        for (openvdb::Index x = 0; x < 8; x++)
            mask.template getWord<openvdb::Index64>(x) = active[x];
        leaf->setValueMask(mask);
        root_.addLeaf(leaf.release());
        return VOL_OK;
    }

    VolStatus tile(const int32_t *origin, int32_t size, const double *value, bool active, VolError *err) override
    {
        T narrowed = openvdb::zeroVal<T>();
        if (!narrow(value, half_, narrowed))
            return unfit(err, value);
        root_.addTile(size == 8 ? 1u : size == 128 ? 2u : 3u, Coord(origin), narrowed, active);
        return VOL_OK;
    }

    void encode(uint32_t compression, size_t most, VolVdbEncodedTree &out) const override
    {
        OutBuffer buffer(most, [compression, this](const char *data, size_t size) {
            const size_t value = half_ ? 2 * Value<T>::components : sizeof(T);
            return compression & openvdb::io::COMPRESS_BLOSC ? openvdb::io::bloscToStreamSize(data, value, size / value)
                                                             : openvdb::io::zipToStreamSize(data, size);
        });
        std::ostream os(&buffer);
        os.exceptions(std::ios_base::failbit | std::ios_base::badbit);
        openvdb::io::setDataCompression(os, compression);
        const int32_t buffers_per_tree = 1;
        os.write(reinterpret_cast<const char *>(&buffers_per_tree), sizeof buffers_per_tree);
        root_.writeTopology(os, half_);
        out.buffers = buffer.size();
        root_.writeBuffers(os, half_);
        count_tree(root_, out.info);
        out.size = buffer.size();
        out.data = buffer.release();
    }

private:
    RootT root_;
    bool half_;
};

template <typename TreeT>
Builder *make_builder(const double *background, bool half)
{
    typename TreeT::ValueType value = openvdb::zeroVal<typename TreeT::ValueType>();
    return narrow(background, half, value) ? new TypedBuilder<TreeT>(value, half) : nullptr;
}

VolStatus tree_new(VolVdbStore store, const double background[3], VolVdbTree **out, VolError *err)
{
    return guarded(err, [&] {
        Builder *builder = nullptr;
        switch (store) {
        case VOL_STORE_FLOAT: builder = make_builder<openvdb::FloatTree>(background, false); break;
        case VOL_STORE_HALF: builder = make_builder<openvdb::FloatTree>(background, true); break;
        case VOL_STORE_DOUBLE: builder = make_builder<openvdb::DoubleTree>(background, false); break;
        case VOL_STORE_INT32: builder = make_builder<openvdb::Int32Tree>(background, false); break;
        case VOL_STORE_VEC3S: builder = make_builder<openvdb::Vec3STree>(background, false); break;
        }
        *out = reinterpret_cast<VolVdbTree *>(builder);
        return builder ? VOL_OK : unfit(err, background);
    });
}

Builder &builder_of(VolVdbTree *tree) { return *reinterpret_cast<Builder *>(tree); }

void tree_free(VolVdbTree *tree) { delete reinterpret_cast<Builder *>(tree); }

VolStatus tree_leaf(VolVdbTree *tree, const int32_t origin[3], const float *floats, const double *doubles,
                    const uint64_t active[8], VolError *err)
{
    return guarded(err, [&] { return builder_of(tree).leaf(origin, floats, doubles, active, err); });
}

VolStatus tree_tile(VolVdbTree *tree, const int32_t origin[3], int32_t size, const double value[3], bool active,
                    VolError *err)
{
    return guarded(err, [&] { return builder_of(tree).tile(origin, size, value, active, err); });
}

VolStatus tree_encode(const VolVdbTree *tree, uint32_t compression, size_t most, VolVdbEncodedTree *out, VolError *err)
{
    return guarded(err, [&] {
        try {
            reinterpret_cast<const Builder *>(tree)->encode(compression, most, *out);
        } catch (const std::ios_base::failure &) { // memory is all that it is written to
            throw std::bad_alloc();
        }
        return VOL_OK;
    });
}

} // namespace

extern "C" {
extern const VolVdbAdapter pellucid_vdb_adapter __attribute__((visibility("default")));
const VolVdbAdapter pellucid_vdb_adapter = {
    "OpenVDB " OPENVDB_LIBRARY_VERSION_STRING, measure, tree_new, tree_free, tree_leaf, tree_tile, tree_encode,
};
}
