/* OpenVDB behind a table of C functions: decodes and encodes trees.
 *
 * Root nodes are used without openvdb::Tree around them, which would start threads to count and to free; and without
 * io::File or io::Stream, which copy files to the temporary folder and read ahead.  Nothing of the main program is
 * linked; no exception leaves. */
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>
#include <openvdb/tree/Tree.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <type_traits>

#include "adapters/vdb_memory.h"

extern "C" {
#include "adapters/vdb_adapter.h"
}

namespace {

using openvdb::Coord;
using HalfTree = openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type;

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
        static std::once_flag once;
        std::call_once(once, [] { openvdb::initialize(); });
        return body();
    } catch (const std::bad_alloc &) {
        return fail(err, VOL_NOMEM, "out of memory");
    } catch (const std::ios_base::failure &) {
        return fail(err, VOL_BAD_INPUT, "its bytes end too early");
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
    static bool differ(const T &a, const T &b) { return !(a == b); }
};

template <typename T>
struct Value<openvdb::math::Vec3<T>> {
    using Component = T;
    static constexpr int components = 3;
    static double get(const openvdb::math::Vec3<T> &v, int c) { return static_cast<double>(v[c]); }
    static bool differ(const openvdb::math::Vec3<T> &a, const openvdb::math::Vec3<T> &b)
    {
        return !(a[0] == b[0] && a[1] == b[1] && a[2] == b[2]);
    }
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

/* ---- reading ----
 *
 * Topology is read here and not by the nodes' own readTopology(), which leaks when a block turns out to be damaged, and
 * whose half-read nodes cannot be destroyed. */

/* Damaged bytes are not always bools: those are read as bytes, with the arithmetic that OpenVDB has for bool. */
struct ByteOfBool {
    unsigned char byte = 0;
    ByteOfBool() = default;
    explicit ByteOfBool(int value) : byte(value != 0) {}
    ByteOfBool operator-() const { return ByteOfBool(byte == 0); }
    operator bool() const { return byte != 0; }
};

template <typename T>
using Stored = std::conditional_t<std::is_same<T, bool>::value, ByteOfBool, T>;

template <typename NodeT>
std::unique_ptr<NodeT> read_node(std::istream &in, const Coord &origin, const typename NodeT::ValueType &background,
                                 bool half)
{
    if constexpr (NodeT::LEVEL == 0) {
        auto leaf = std::make_unique<NodeT>(openvdb::PartialCreate(), origin, background);
        leaf->readTopology(in, half);
        return leaf;
    } else {
        using ChildT = typename NodeT::ChildNodeType;
        using StoredT = Stored<typename NodeT::ValueType>;
        auto node = std::make_unique<NodeT>(origin, background, false);
        typename NodeT::NodeMaskType children, active;
        children.load(in);
        active.load(in);
        std::unique_ptr<StoredT[]> values(new StoredT[NodeT::NUM_VALUES]);
        openvdb::io::readCompressedValues(in, values.get(), NodeT::NUM_VALUES, active, half);
        for (openvdb::Index n = 0; n < NodeT::NUM_VALUES; n++) {
            if (children.isOn(n))
                node->addChild(read_node<ChildT>(in, node->offsetToGlobalCoord(n), background, half).release());
            else
                node->addTile(n, values[n], active.isOn(n));
        }
        return node;
    }
}

/* Fills an empty root.  The stream holds a pointer to the background, for values that were left out as equal to it: at
 * first as stored, then that of the root. */
template <typename RootT>
void read_root(std::istream &in, bool half, RootT &root)
{
    using ChildT = typename RootT::ChildNodeType;
    using StoredT = Stored<typename RootT::ValueType>;
    int32_t buffers_per_tree, origin[3];
    openvdb::Index tiles, children;
    StoredT background, value;
    char active;
    const auto load = [&in](auto &to) { in.read(reinterpret_cast<char *>(&to), sizeof to); };
    load(buffers_per_tree);
    load(background);
    root.setBackground(background, false);
    openvdb::io::setGridBackgroundValuePtr(in, &background);
    load(tiles);
    load(children);
    while (tiles--) {
        load(origin);
        load(value);
        load(active);
        root.addTile(Coord(origin), value, active != 0);
    }
    while (children--) {
        load(origin);
        root.addChild(read_node<ChildT>(in, Coord(origin), root.background(), half).release());
    }
    openvdb::io::setGridBackgroundValuePtr(in, &root.background());
}

template <typename RootT>
class Walk {
public:
    using T = typename RootT::ValueType;
    using LeafT = typename RootT::LeafNodeType;
    using Component = typename Value<T>::Component;

    Walk(RootT &root, const VolVdbVisitor &visitor, void *user, VolError *err)
        : root_(root), background_(root.background()), visitor_(visitor), user_(user), err_(err)
    {
    }

    VolStatus run()
    {
        using ChildT = typename RootT::ChildNodeType;
        for (auto it = root_.beginChildAll(); it; ++it) {
            T value = background_;
            const Coord origin = it.getCoord();
            VolStatus status = VOL_OK;
            if (ChildT *child = it.probeChild(value)) {
                status = node(*child);
                delete root_.template stealNode<ChildT>(origin, background_, false);
            } else {
                status = tile(origin, ChildT::DIM, value, it.isValueOn());
            }
            if (status)
                return status;
        }
        return VOL_OK;
    }

private:
    template <typename NodeT>
    VolStatus node(NodeT &parent)
    {
        using ChildT = typename NodeT::ChildNodeType;
        for (openvdb::Index n = 0; n < NodeT::NUM_VALUES; n++) {
            const Coord origin = parent.offsetToGlobalCoord(n);
            VolStatus status = VOL_OK;
            if (parent.getChildMask().isOn(n)) {
                status = visit_child(*parent.getTable()[n].getChild());
                delete parent.template stealNode<ChildT>(origin, background_, false);
            } else {
                status = tile(origin, ChildT::DIM, parent.getTable()[n].getValue(), parent.getValueMask().isOn(n));
            }
            if (status)
                return status;
        }
        return VOL_OK;
    }

    template <typename NodeT>
    VolStatus visit_child(const NodeT &child)
    {
        if constexpr (NodeT::LEVEL == 0)
            return leaf(child);
        else
            return node(const_cast<NodeT &>(child));
    }

    VolStatus tile(const Coord &origin, openvdb::Index size, const T &value, bool active)
    {
        if (!visitor_.tile || (!active && !Value<T>::differ(value, background_)))
            return VOL_OK;
        double wide[3];
        widen(value, wide);
        return visitor_.tile(user_, origin.asPointer(), static_cast<int32_t>(size), wide, active, err_);
    }

    /* The leaf's own array where it has the type that is wanted, else converted into `scratch`. */
    template <typename Wanted>
    const Wanted *values(const LeafT &leaf, Wanted *scratch)
    {
        constexpr int components = Value<T>::components;
        if constexpr (std::is_same<Component, Wanted>::value)
            return reinterpret_cast<const Wanted *>(leaf.buffer().data());
        for (int n = 0; n < LEAF_VALUES; n++) {
            const T value = leaf.getValue(static_cast<openvdb::Index>(n));
            for (int c = 0; c < components; c++)
                scratch[n * components + c] = static_cast<Wanted>(Value<T>::get(value, c));
        }
        return scratch;
    }

    VolStatus leaf(const LeafT &leaf)
    {
        uint64_t active[8];
        for (openvdb::Index x = 0; x < 8; x++)
            active[x] = leaf.valueMask().template getWord<openvdb::Index64>(x);
        const int32_t *origin = leaf.origin().asPointer();
        if (visitor_.leaf_double)
            return visitor_.leaf_double(user_, origin, values<double>(leaf, doubles_), active, err_);
        if (visitor_.leaf_float)
            return visitor_.leaf_float(user_, origin, values<float>(leaf, floats_), active, err_);
        return VOL_OK;
    }

    RootT &root_;
    const T background_;
    const VolVdbVisitor &visitor_;
    void *user_;
    VolError *err_;
    float floats_[LEAF_VALUES * 3];
    double doubles_[LEAF_VALUES * 3];
};

template <typename TreeT>
VolStatus visit_as(const VolVdbTreeBytes &bytes, VolVdbGridInfo &info, const VolVdbVisitor &visitor, void *user,
                   VolError *err)
{
    using RootT = typename TreeT::RootNodeType;
    InBuffer buffer(bytes.data, bytes.size);
    std::istream in(&buffer);
    prepare(in, bytes);
    RootT root(openvdb::zeroVal<typename RootT::ValueType>());
    read_root(in, bytes.half, root);
    root.readBuffers(in, bytes.half);
    count_tree(root, info);
    VolStatus status = visitor.begin ? visitor.begin(user, &info, err) : VOL_OK;
    if (status)
        return status;
    auto walk = std::make_unique<Walk<RootT>>(root, visitor, user, err);
    return walk->run();
}

VolStatus visit(const VolVdbTreeBytes *tree, VolVdbGridInfo *info, const VolVdbVisitor *visitor, void *user,
                VolError *err)
{
    return guarded(err, [&] {
        static const struct {
            const char *type;
            VolStatus (*visit)(const VolVdbTreeBytes &, VolVdbGridInfo &, const VolVdbVisitor &, void *, VolError *);
        } types[] = {
            {"Tree_float_5_4_3", visit_as<openvdb::FloatTree>},   {"Tree_double_5_4_3", visit_as<openvdb::DoubleTree>},
            {"Tree_int32_5_4_3", visit_as<openvdb::Int32Tree>},   {"Tree_int64_5_4_3", visit_as<openvdb::Int64Tree>},
            {"Tree_bool_5_4_3", visit_as<openvdb::BoolTree>},     {"Tree_mask_5_4_3", visit_as<openvdb::MaskTree>},
            {"Tree_vec3s_5_4_3", visit_as<openvdb::Vec3STree>},   {"Tree_vec3d_5_4_3", visit_as<openvdb::Vec3DTree>},
            {"Tree_vec3i_5_4_3", visit_as<openvdb::Vec3ITree>},   {"Tree_half_5_4_3", visit_as<HalfTree>},
        };
        for (const auto &entry : types)
            if (std::strcmp(entry.type, tree->type) == 0)
                return entry.visit(*tree, *info, *visitor, user, err);
        return fail(err, VOL_BAD_INPUT, "its type is not one of numbers");
    });
}

/* Points are stored in several passes over the leaves, which the grid manages. */
VolStatus measure(const VolVdbTreeBytes *tree, size_t *size, VolError *err)
{
    return guarded(err, [&] {
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
    virtual void encode(uint32_t compression, VolVdbEncodedTree &out) const = 0;
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

    void encode(uint32_t compression, VolVdbEncodedTree &out) const override
    {
        OutBuffer buffer;
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

VolStatus tree_encode(const VolVdbTree *tree, uint32_t compression, VolVdbEncodedTree *out, VolError *err)
{
    return guarded(err, [&] {
        reinterpret_cast<const Builder *>(tree)->encode(compression, *out);
        return VOL_OK;
    });
}

} // namespace

extern "C" {
extern const VolVdbAdapter pellucid_vdb_adapter __attribute__((visibility("default")));
const VolVdbAdapter pellucid_vdb_adapter = {
    "OpenVDB " OPENVDB_LIBRARY_VERSION_STRING, visit, measure, tree_new, tree_free, tree_leaf, tree_tile, tree_encode,
};
}
