/* EXR files of every kind against another implementation: OpenEXR's C++ classes have packing and unpacking code of their
 * own, beside the C library that we use.  What they write we read as they do, bit for bit: each compression, channels of
 * one type and of several, lines in either order, tiles of each level mode, parts, windows with and without whole tiles or
 * blocks, pixels that pack well and those that do not pack at all.  And what we write they read. */
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfThreading.h>
#include <ImfTiledOutputPart.h>

#include <malloc.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

extern "C" {
#include "io/exr.h"
}
#include "tests/unit/test.h"

namespace {

VolError err;

/* ---- Files in memory ----------------------------------------------------------------------------------------------- */

class Out : public Imf::OStream {
public:
    Out() : Imf::OStream("memory") {}
    void write(const char c[], int n) override
    {
        if (at + static_cast<size_t>(n) > bytes.size())
            bytes.resize(at + static_cast<size_t>(n));
        memcpy(bytes.data() + at, c, static_cast<size_t>(n));
        at += static_cast<size_t>(n);
    }
    uint64_t tellp() override { return at; }
    void seekp(uint64_t pos) override { at = pos; }
    std::vector<unsigned char> bytes;

private:
    size_t at = 0;
};

class In : public Imf::IStream {
public:
    In(const unsigned char *from, size_t n) : Imf::IStream("memory"), data(from), size(n) {}
    bool read(char c[], int n) override
    {
        if (static_cast<size_t>(n) > size - at)
            throw std::runtime_error("ends early");
        memcpy(c, data + at, static_cast<size_t>(n));
        at += static_cast<size_t>(n);
        return at < size;
    }
    uint64_t tellg() override { return at; }
    void seekg(uint64_t pos) override { at = pos; }

private:
    const unsigned char *data;
    size_t size, at = 0;
};

/* ---- What is written ----------------------------------------------------------------------------------------------- */

struct Storage {
    const char *name;
    int tile_x, tile_y; /* 0: lines */
    Imf::LevelMode levels;
    Imf::LineOrder order;
};

const Storage storages[] = {
    {"lines", 0, 0, Imf::ONE_LEVEL, Imf::INCREASING_Y},      {"lines upwards", 0, 0, Imf::ONE_LEVEL, Imf::DECREASING_Y},
    {"tiles", 8, 8, Imf::ONE_LEVEL, Imf::INCREASING_Y},      {"tiles upwards", 16, 5, Imf::ONE_LEVEL, Imf::DECREASING_Y},
    {"wide tiles", 64, 40, Imf::ONE_LEVEL, Imf::INCREASING_Y}, {"mipmap", 8, 4, Imf::MIPMAP_LEVELS, Imf::INCREASING_Y},
    {"ripmap", 7, 9, Imf::RIPMAP_LEVELS, Imf::RANDOM_Y},
};

struct Box {
    int x, y, width, height;
};

/* From the size of a block of B44 to several blocks of all compressions, whole and not. */
const Box boxes[] = {{0, 0, 1, 1}, {-3, 5, 4, 4}, {0, 0, 18, 9}, {-2, -40, 33, 70}, {100, 3, 5, 33}, {0, 0, 64, 32}};

/* A letter a channel: half, Linear half, float, unsigned. */
const char *const channel_sets[] = {"h", "f", "u", "ffff", "Lh", "hfu", "hLfuhhffu"};

const char *const contents[] = {"ramp", "flat with spots of noise", "any bits"};

struct Kind {
    Imf::Compression compression;
    Storage storage;
    Box box;
    std::string channels;
    int content;
};

const char *const compression_names[] = {"none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"};

std::string describe(const Kind &k)
{
    return std::string(compression_names[k.compression]) + ", " + k.storage.name + ", " + std::to_string(k.box.width) + "x" +
           std::to_string(k.box.height) + ", channels " + k.channels + ", " + contents[k.content];
}

uint32_t noise(uint32_t n)
{
    n = (n ^ 61U ^ (n >> 16)) * 9U;
    n = (n ^ (n >> 4)) * 0x27d4eb2dU;
    return n ^ (n >> 15);
}

/* Bits of pixel (x, y): of a half, a float or a whole number. */
uint32_t pixel_bits(char type, int content, uint32_t x, uint32_t y, uint32_t channel)
{
    uint32_t random = noise(x + 1000 * y + 100000 * channel);
    if (content == 2) /* infinities, NaN and denormal numbers, too */
        return type == 'f' || type == 'u' ? random : random & 0xffffU;
    double v = content == 0 ? 0.03 * x + 0.1 * y - 0.5 * channel : (x / 4 + y / 4) % 3 == 0 ? random * 1e-8 : 3.0;
    if (type == 'u')
        return static_cast<uint32_t>(static_cast<int64_t>(v * 1000));
    if (type == 'f') {
        float f = static_cast<float>(v);
        uint32_t bits;
        memcpy(&bits, &f, 4);
        return bits;
    }
    return half(static_cast<float>(v)).bits();
}

Imf::PixelType pixel_type(char letter)
{
    return letter == 'f' ? Imf::FLOAT : letter == 'u' ? Imf::UINT : Imf::HALF;
}

std::string channel_name(size_t i) { return std::string(1, static_cast<char>('A' + i)); }

Imath::Box2i window_of(const Box &b)
{
    return Imath::Box2i(Imath::V2i(b.x, b.y), Imath::V2i(b.x + b.width - 1, b.y + b.height - 1));
}

Imf::Header header_of(const Kind &k)
{
    Imf::Header header(window_of(k.box), window_of(k.box));
    header.compression() = k.compression;
    header.lineOrder() = k.storage.order;
    for (size_t i = 0; i < k.channels.size(); i++)
        header.channels().insert(channel_name(i),
                                 Imf::Channel(pixel_type(k.channels[i]), 1, 1, k.channels[i] == 'L'));
    if (k.storage.tile_x)
        header.setTileDescription(Imf::TileDescription(static_cast<unsigned>(k.storage.tile_x),
                                                       static_cast<unsigned>(k.storage.tile_y), k.storage.levels));
    header.setType(k.storage.tile_x ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
    return header;
}

/* Pixels of all channels, 4 bytes each (of halves the first 2), and how the library finds them. */
struct Planes {
    std::vector<std::vector<uint32_t>> planes;
    Imf::FrameBuffer frame;

    Planes(const Kind &k, bool halves_as_floats)
    {
        size_t width = static_cast<size_t>(k.box.width);
        for (size_t i = 0; i < k.channels.size(); i++)
            planes.emplace_back(width * static_cast<size_t>(k.box.height));
        for (size_t i = 0; i < k.channels.size(); i++) {
            Imf::PixelType type = pixel_type(k.channels[i]);
            frame.insert(channel_name(i), Imf::Slice::Make(type == Imf::HALF && halves_as_floats ? Imf::FLOAT : type,
                                                           planes[i].data(), window_of(k.box), 4, 4 * width));
        }
    }
};

void fill(const Kind &k, uint32_t seed, Planes &planes)
{
    for (uint32_t c = 0; c < k.channels.size(); c++)
        for (uint32_t y = 0, i = 0; y < static_cast<uint32_t>(k.box.height); y++)
            for (uint32_t x = 0; x < static_cast<uint32_t>(k.box.width); x++)
                planes.planes[c][i++] = pixel_bits(k.channels[c], k.content, x, y, c + seed);
}

/* Every level gets the pixels of the first. */
void write_part(Imf::MultiPartOutputFile &file, int index, const Kind &k, const Planes &planes)
{
    if (!k.storage.tile_x) {
        Imf::OutputPart part(file, index);
        part.setFrameBuffer(planes.frame);
        part.writePixels(k.box.height);
        return;
    }
    Imf::TiledOutputPart part(file, index);
    part.setFrameBuffer(planes.frame);
    for (int ly = 0; ly < part.numYLevels(); ly++)
        for (int lx = 0; lx < part.numXLevels(); lx++)
            if (k.storage.levels == Imf::RIPMAP_LEVELS || lx == ly)
                part.writeTiles(0, part.numXTiles(lx) - 1, 0, part.numYTiles(ly) - 1, lx, ly);
}

std::vector<unsigned char> write_file(const std::vector<Kind> &kinds)
{
    Out out;
    std::vector<Imf::Header> headers;
    for (size_t p = 0; p < kinds.size(); p++) {
        headers.push_back(header_of(kinds[p]));
        if (kinds.size() > 1) {
            headers.back().setName("part " + std::to_string(p));
            headers.back().displayWindow() = headers[0].displayWindow();
        }
    }
    {
        Imf::MultiPartOutputFile file(out, headers.data(), static_cast<int>(headers.size()));
        for (size_t p = 0; p < kinds.size(); p++) {
            Planes planes(kinds[p], false);
            fill(kinds[p], static_cast<uint32_t>(p), planes);
            write_part(file, static_cast<int>(p), kinds[p], planes);
        }
    }
    return out.bytes;
}

/* ---- What is read -------------------------------------------------------------------------------------------------- */

/* Their reader: floats and whole numbers. */
Planes read_theirs(const unsigned char *bytes, size_t size, int index, const Kind &k)
{
    In in(bytes, size);
    Imf::MultiPartInputFile file(in);
    Imf::InputPart part(file, index);
    Planes planes(k, true);
    part.setFrameBuffer(planes.frame);
    part.readPixels(k.box.y, k.box.y + k.box.height - 1);
    return planes;
}

bool same(uint32_t theirs, const VolChannel *ours, size_t i)
{
    float f;
    if (ours->store == VOL_PIXEL_UINT)
        return ours->data[i] == static_cast<float>(theirs) && vol_channel_value(ours, i) == theirs;
    memcpy(&f, &theirs, 4);
    return memcmp(&f, &ours->data[i], 4) == 0 || (std::isnan(f) && std::isnan(ours->data[i]));
}

void compare(const Kind &k, const Planes &theirs, const VolPart &ours)
{
    for (size_t c = 0; c < k.channels.size(); c++) {
        const VolChannel *channel = vol_part_channel(&ours, channel_name(c).c_str());
        for (size_t i = 0; channel && i < theirs.planes[c].size(); i++)
            if (!same(theirs.planes[c][i], channel, i)) {
                FAIL("%s: channel %zu, pixel %zu differs", describe(k).c_str(), c, i);
                return;
            }
        CHECK(channel != nullptr);
    }
}

bool is_dwa(const Kind &k)
{
    return k.compression == Imf::DWAA_COMPRESSION || k.compression == Imf::DWAB_COMPRESSION;
}

/* Both readers agree; what the C library cannot decode is refused and named. */
void check_file(const std::vector<Kind> &kinds)
{
    std::vector<unsigned char> file = write_file(kinds);
    VolBytes bytes = {file.data(), file.size()};
    VolImage image;
    VolStatus status = vol_exr_read(&bytes, "x", &image, &err);
    bool dwa = false;
    for (const Kind &k : kinds)
        dwa = dwa || is_dwa(k);
    if (status && dwa && strstr(err.text, "-compressed, which this build's OpenEXRCore cannot decode"))
        return;
    if (status) {
        FAIL("%s: %s", describe(kinds[0]).c_str(), err.text);
        return;
    }
    CHECK(image.part_count == kinds.size());
    for (size_t p = 0; p < kinds.size(); p++)
        compare(kinds[p], read_theirs(file.data(), file.size(), static_cast<int>(p), kinds[p]), image.parts[p]);
    vol_image_free(&image);
}

void sweep(Imf::Compression compression)
{
    for (const Storage &storage : storages)
        for (const Box &box : boxes)
            for (const char *channels : channel_sets)
                for (int content = 0; content < 3; content++)
                    check_file({{compression, storage, box, channels, content}});
}

void test_none(void) { sweep(Imf::NO_COMPRESSION); }
void test_rle(void) { sweep(Imf::RLE_COMPRESSION); }
void test_zips(void) { sweep(Imf::ZIPS_COMPRESSION); }
void test_zip(void) { sweep(Imf::ZIP_COMPRESSION); }
void test_piz(void) { sweep(Imf::PIZ_COMPRESSION); }
void test_pxr24(void) { sweep(Imf::PXR24_COMPRESSION); }
void test_b44(void) { sweep(Imf::B44_COMPRESSION); }
void test_b44a(void) { sweep(Imf::B44A_COMPRESSION); }
void test_dwa(void) { sweep(Imf::DWAA_COMPRESSION); }

/* Blocks of the size that they have in pictures. */
void test_wide(void)
{
    const Box box = {-7, 2, 1201, 70};
    for (int compression = 0; compression <= Imf::DWAB_COMPRESSION; compression++)
        for (int content = 0; content < 3; content++)
            for (int storage = 0; storage < 5; storage += 4)
                check_file({{static_cast<Imf::Compression>(compression), storages[storage], box, "hfu", content}});
}

/* Parts of different kinds in one file. */
void test_parts(void)
{
    for (int compression = 0; compression < Imf::DWAA_COMPRESSION; compression++)
        for (size_t i = 0; i < sizeof storages / sizeof *storages; i++) {
            std::vector<Kind> kinds;
            for (size_t p = 0; p < 3; p++)
                kinds.push_back({static_cast<Imf::Compression>((compression + static_cast<int>(p)) % Imf::DWAA_COMPRESSION),
                                 storages[(i + p) % (sizeof storages / sizeof *storages)], boxes[(i + p) % 6],
                                 channel_sets[(i * 2 + p) % 7], static_cast<int>((i + p) % 3)});
            check_file(kinds);
        }
}

/* Bytes changed or cut off: read or refused, and nothing worse. */
void test_damage(void)
{
    for (int compression = 0; compression <= Imf::DWAB_COMPRESSION; compression++)
        for (int storage = 0; storage < 6; storage++) {
            const Kind k = {static_cast<Imf::Compression>(compression), storages[storage], boxes[2], "hfu", 1};
            const std::vector<unsigned char> good = write_file({k});
            for (uint32_t round = 0; round < 200; round++) {
                std::vector<unsigned char> bad = good;
                uint32_t random = noise(round * 64 + static_cast<uint32_t>(compression * 8 + storage));
                bad[8 + random % (bad.size() - 8)] = static_cast<unsigned char>(random >> 24);
                if (round % 8 == 7)
                    bad.resize(random % bad.size());
                VolBytes bytes = {bad.data(), bad.size()};
                VolImage image;
                VolStatus status = vol_exr_read(&bytes, "x", &image, &err);
                CHECK(status == VOL_OK || status == VOL_BAD_INPUT);
                if (status == VOL_OK)
                    vol_image_free(&image);
            }
        }
}

/* Channels with fewer samples than pixels: refused and named, in any compression. */
void test_subsampled(void)
{
    for (int compression = 0; compression <= Imf::DWAB_COMPRESSION; compression++) {
        Kind k = {static_cast<Imf::Compression>(compression), storages[0], {0, 0, 16, 16}, "hh", 1};
        Imf::Header header = header_of(k);
        header.channels()["B"].xSampling = header.channels()["B"].ySampling = 2;
        Planes planes(k, false);
        fill(k, 0, planes);
        planes.frame["B"].xSampling = planes.frame["B"].ySampling = 2;
        Out out;
        {
            Imf::MultiPartOutputFile file(out, &header, 1);
            write_part(file, 0, k, planes);
        }
        VolBytes bytes = {out.bytes.data(), out.bytes.size()};
        VolImage image;
        CHECK(vol_exr_read(&bytes, "x", &image, &err) == VOL_BAD_INPUT);
        CHECK(strstr(err.text, "channel 'B' of part 0 is subsampled (2x2)"));
    }
}

/* ---- What we write ------------------------------------------------------------------------------------------------- */

void check_ours(const Kind &k, VolExrCompression compression)
{
    VolImage image = {};
    VolPart *part;
    VolBox2 window = {k.box.x, k.box.y, k.box.x + k.box.width - 1, k.box.y + k.box.height - 1};
    CHECK(!vol_image_add_part(&image, nullptr, window, window, &part, &err));
    for (uint32_t c = 0; c < k.channels.size(); c++) {
        char type = k.channels[c];
        VolChannel *channel;
        CHECK(!vol_part_add_channel(part, channel_name(c).c_str(),
                                    type == 'f'   ? VOL_PIXEL_FLOAT
                                    : type == 'u' ? VOL_PIXEL_UINT
                                                  : VOL_PIXEL_HALF,
                                    &channel, &err));
        for (uint32_t y = 0, i = 0; y < static_cast<uint32_t>(k.box.height); y++)
            for (uint32_t x = 0; x < static_cast<uint32_t>(k.box.width); x++, i++) {
                uint32_t bits = pixel_bits(type, k.content, x, y, c);
                if (type == 'f')
                    memcpy(&channel->data[i], &bits, 4);
                else /* whole numbers that a float holds; halves that are finite */
                    channel->data[i] = type == 'u' ? static_cast<float>(bits >> 8) : static_cast<float>(bits & 0x3ffU);
            }
    }
    VolBytes bytes;
    if (vol_exr_write(&image, compression, 2, &bytes, nullptr, &err))
        FAIL("%s: %s", describe(k).c_str(), err.text);
    else
        compare(k, read_theirs(bytes.data, bytes.size, 0, k), image.parts[0]);
    vol_bytes_free(&bytes);
    vol_image_free(&image);
}

void test_they_read_ours(void)
{
    static const Imf::Compression names[] = {Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
                                             Imf::PIZ_COMPRESSION};
    for (int compression = 0; compression < 4; compression++)
        for (const Box &box : boxes)
            for (const char *channels : channel_sets)
                for (int content = 0; content < 3; content++)
                    check_ours({names[compression], storages[0], box, channels, content},
                               static_cast<VolExrCompression>(compression));
}

} // namespace

int main()
{
    mallopt(M_MMAP_THRESHOLD, 64 << 20); /* or each file's buffers are mapped and unmapped anew */
    mallopt(M_TRIM_THRESHOLD, 64 << 20);
    Imf::setGlobalThreadCount(0);
    try {
        RUN(test_none);
        RUN(test_rle);
        RUN(test_zips);
        RUN(test_zip);
        RUN(test_piz);
        RUN(test_pxr24);
        RUN(test_b44);
        RUN(test_b44a);
        RUN(test_dwa);
        RUN(test_wide);
        RUN(test_parts);
        RUN(test_damage);
        RUN(test_subsampled);
        RUN(test_they_read_ours);
    } catch (const std::exception &e) {
        printf("Bail out! %s\n", e.what());
        return 1;
    }
    return test_end();
}
