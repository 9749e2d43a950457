// OpenImageIO behind a table of C functions: pictures of other formats in, PNG out, all in memory.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <vector>

extern "C" {
#include "adapters/image.h"
}

namespace {

enum Result { done = 0, bad_input = 1, out_of_memory = 2 };

Result say(char *why, size_t size, const std::string &text)
{
    std::string line = text.substr(0, text.find('\n'));
    while (!line.empty() && line.back() == '.')
        line.pop_back();
    snprintf(why, size, "%s", line.empty() ? "cannot be decoded" : line.c_str());
    return bad_input;
}

// No exception may pass into C.
template <typename Function> int guarded(char *why, size_t size, Function function)
{
    try {
        return function();
    } catch (const std::bad_alloc &) {
        return out_of_memory;
    } catch (const std::system_error &e) { // threads
        return e.code() == std::errc::resource_unavailable_try_again ? out_of_memory : say(why, size, e.what());
    } catch (const std::exception &e) {
        return say(why, size, e.what());
    } catch (...) {
        return say(why, size, "unknown exception");
    }
}

// Integers keep their values (height images need metres, not fractions).
template <typename T> void widen(const std::vector<char> &native, float *to, size_t n)
{
    const T *from = reinterpret_cast<const T *>(native.data());
    for (size_t i = 0; i < n; i++)
        to[i] = static_cast<float>(from[i]);
}

bool widen(OIIO::TypeDesc type, const std::vector<char> &native, VolImageAdapterPixels *out, size_t n)
{
    switch (type.basetype) {
    case OIIO::TypeDesc::UINT8: widen<unsigned char>(native, out->data, n), out->scale = 255.0F; return true;
    case OIIO::TypeDesc::INT8: widen<signed char>(native, out->data, n), out->scale = 127.0F; return true;
    case OIIO::TypeDesc::UINT16: widen<unsigned short>(native, out->data, n), out->scale = 65535.0F; return true;
    case OIIO::TypeDesc::INT16: widen<short>(native, out->data, n), out->scale = 32767.0F; return true;
    case OIIO::TypeDesc::UINT32: widen<unsigned>(native, out->data, n), out->scale = 4294967296.0F; return true;
    case OIIO::TypeDesc::INT32: widen<int>(native, out->data, n), out->scale = 2147483648.0F; return true;
    case OIIO::TypeDesc::FLOAT: widen<float>(native, out->data, n), out->scale = 1.0F; return true;
    case OIIO::TypeDesc::DOUBLE: widen<double>(native, out->data, n), out->scale = 1.0F; return true;
    default: return false;
    }
}

// An image of n bytes is taken to hold at most this many times n: deflate reaches 1032, and one bit may become a byte.
constexpr double largest_expansion = 16384;

bool believable(const OIIO::ImageSpec &spec, size_t bytes)
{
    double pixels = static_cast<double>(spec.width) * spec.height * spec.depth;
    return spec.width > 0 && spec.height > 0 && spec.depth == 1 && spec.nchannels > 0 && spec.nchannels <= 64 &&
           pixels * static_cast<double>(spec.nchannels) <= largest_expansion * static_cast<double>(bytes);
}

int read_open(OIIO::ImageInput &input, const OIIO::ImageSpec &spec, size_t size, VolImageAdapterPixels *out, char *why,
              size_t why_size)
{
    if (!believable(spec, size))
        return say(why, why_size, "its header claims " + std::to_string(spec.width) + " x " +
                                      std::to_string(spec.height) + " pixels, too many for its bytes");
    OIIO::TypeDesc type = spec.format == OIIO::TypeDesc::HALF ? OIIO::TypeDesc(OIIO::TypeDesc::FLOAT) : spec.format;
    size_t n = static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height) * static_cast<size_t>(spec.nchannels);
    std::vector<char> native(n * type.size());
    if (!input.read_image(0, 0, 0, spec.nchannels, type, native.data()))
        return say(why, why_size, input.geterror());
    if (input.has_error()) // recovered from, which for us is damage
        return say(why, why_size, input.geterror());
    out->data = static_cast<float *>(malloc(n * sizeof(float)));
    if (!out->data)
        return out_of_memory;
    if (!widen(type, native, out, n)) {
        free(out->data);
        out->data = nullptr;
        return say(why, why_size, "pixels of a type that cannot be read");
    }
    out->width = spec.width;
    out->height = spec.height;
    out->channels = spec.nchannels;
    out->alpha = spec.alpha_channel;
    std::string space = spec.get_string_attribute("oiio:ColorSpace");
    bool integer = spec.format == OIIO::TypeDesc::UINT8 || spec.format == OIIO::TypeDesc::UINT16;
    out->encoded = integer && space != "Linear" && space != "linear";
    out->unassociated = spec.get_int_attribute("oiio:UnassociatedAlpha", 0);
    return done;
}

int read(const void *bytes, size_t size, const char *format, VolImageAdapterPixels *out, char *why, size_t why_size)
{
    return guarded(why, why_size, [&]() -> int {
        *out = {};
        OIIO::attribute("threads", 1);
        auto input = OIIO::ImageInput::create(format);
        if (!input)
            return say(why, why_size, OIIO::geterror());
        OIIO::Filesystem::IOMemReader memory(const_cast<void *>(bytes), size);
        OIIO::ImageSpec spec, config;
        config.attribute("oiio:UnassociatedAlpha", 1); // multiplying comes after decoding from sRGB
        if (!input->supports("ioproxy") || !input->set_ioproxy(&memory))
            return say(why, why_size, "this OpenImageIO cannot read them from memory");
        if (!input->open("memory", spec, config))
            return say(why, why_size, input->geterror());
        int result = read_open(*input, spec, size, out, why, why_size);
        input->close();
        return result;
    });
}

int encode_png(const unsigned char *rgb, int width, int height, unsigned char **out, size_t *out_size, char *why,
               size_t why_size)
{
    return guarded(why, why_size, [&]() -> int {
        auto output = OIIO::ImageOutput::create("png");
        if (!output)
            return say(why, why_size, OIIO::geterror());
        std::vector<unsigned char> file;
        OIIO::Filesystem::IOVecOutput memory(file);
        OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
        output->set_ioproxy(&memory);
        if (!output->open("memory.png", spec) || !output->write_image(OIIO::TypeDesc::UINT8, rgb) || !output->close())
            return say(why, why_size, output->geterror());
        *out = static_cast<unsigned char *>(malloc(file.size()));
        if (!*out)
            return out_of_memory;
        memcpy(*out, file.data(), file.size());
        *out_size = file.size();
        return done;
    });
}

} // namespace

extern "C" __attribute__((visibility("default"))) const VolImageAdapter pellucid_image_adapter;
const VolImageAdapter pellucid_image_adapter = {VOL_IMAGE_ADAPTER_VERSION, read, encode_png};
