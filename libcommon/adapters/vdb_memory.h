/* C++: streams over memory, for the OpenVDB adapter. */
#ifndef VOL_ADAPTERS_VDB_MEMORY_H
#define VOL_ADAPTERS_VDB_MEMORY_H

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <new>
#include <streambuf>
#include <utility>

namespace {

/* Reads a block in place. */
class InBuffer : public std::streambuf {
public:
    InBuffer(const unsigned char *data, size_t size)
    {
        char *begin = const_cast<char *>(reinterpret_cast<const char *>(data));
        setg(begin, begin, begin + size);
    }

protected:
    pos_type seekoff(off_type offset, std::ios_base::seekdir dir, std::ios_base::openmode) override
    {
        const off_type size = egptr() - eback();
        const off_type base = dir == std::ios_base::cur ? gptr() - eback() : dir == std::ios_base::end ? size : 0;
        const off_type at = base + offset;
        if (at < 0 || at > size)
            return pos_type(off_type(-1));
        setg(eback(), eback() + at, egptr());
        return pos_type(at);
    }
    pos_type seekpos(pos_type at, std::ios_base::openmode mode) override
    {
        return seekoff(off_type(at), std::ios_base::beg, mode);
    }
};

/* Grows by doubling; release() hands the block to the caller.
 *
 * OpenVDB stores a block bare, behind its negative length, where compression does not shrink it, but also where Blosc or
 * zlib got no memory: then the file would depend on that.  So bare blocks are measured again. */
class OutBuffer : public std::streambuf {
public:
    using Measure = std::function<size_t(const char *data, size_t size)>; /* bytes when compressed */
    OutBuffer(size_t most, Measure measure) : most_(most), measure_(std::move(measure)) {}
    OutBuffer(const OutBuffer &) = delete;
    OutBuffer &operator=(const OutBuffer &) = delete;
    ~OutBuffer() override { std::free(data_); }
    size_t size() const { return size_; }
    unsigned char *release()
    {
        unsigned char *data = data_;
        data_ = nullptr;
        return data;
    }

protected:
    std::streamsize xsputn(const char *from, std::streamsize count) override
    {
        const size_t n = static_cast<size_t>(count);
        make_room();
        if (bare_ && bare_ == n && measure_(from, n) < n)
            throw std::bad_alloc();
        bare_ = bare_length(from, n);
        if (n > capacity_ - size_)
            grow(size_ + n);
        std::memcpy(data_ + size_, from, n);
        size_ += n;
        return count;
    }
    int_type overflow(int_type c) override
    {
        if (traits_type::eq_int_type(c, traits_type::eof()))
            return traits_type::not_eof(c);
        const char one = traits_type::to_char_type(c);
        xsputn(&one, 1);
        return c;
    }
    pos_type seekoff(off_type offset, std::ios_base::seekdir dir, std::ios_base::openmode) override
    {
        return pos_type(dir == std::ios_base::cur && offset == 0 ? static_cast<off_type>(size_) : off_type(-1));
    }

private:
    /* The size of the bare block that follows if these bytes are a length. */
    static size_t bare_length(const char *from, size_t n)
    {
        int64_t length = 0;
        if (n == sizeof length)
            std::memcpy(&length, from, sizeof length);
        return length < 0 && length > INT32_MIN ? static_cast<size_t>(-length) : 0;
    }

    /* Before the next block: Blosc works on through a null pointer.  What it takes comes from what is given back here. */
    static void make_room()
    {
        void *volatile room = std::malloc(library_room); /* volatile: the compiler would leave it out */
        std::free(room);
        if (!room)
            throw std::bad_alloc();
    }
    void grow(size_t wanted)
    {
        if (wanted > most_)
            throw std::bad_alloc();
        const size_t capacity = std::max(wanted, std::min(most_, capacity_ > SIZE_MAX / 2 ? wanted : 2 * capacity_));
        void *grown = std::realloc(data_, capacity);
        if (!grown)
            throw std::bad_alloc();
        data_ = static_cast<unsigned char *>(grown);
        capacity_ = capacity;
    }
    static constexpr size_t library_room = 120000; /* below what goes back to the system at once */
    unsigned char *data_ = nullptr;
    size_t size_ = 0, capacity_ = 0, bare_ = 0;
    size_t most_;
    Measure measure_;
};

} // namespace

#endif
