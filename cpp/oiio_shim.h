// What petcomp needs of OpenImageIO, shaped for Rust. Every function may throw: the bridge turns that into an error.
#pragma once

#include <OpenImageIO/oiioversion.h>
#include <exception>
#include <memory>

#include "rust/cxx.h"

// The bridge catches std::exception by itself and aborts on anything else; here anything else is an error too.
namespace rust {
namespace behavior {
template <typename Try, typename Fail>
static void trycatch(Try &&func, Fail &&fail) noexcept try {
    func();
} catch (const std::exception &e) {
    fail(e.what());
} catch (...) {
    fail("unknown C++ exception");
}
} // namespace behavior
} // namespace rust

OIIO_NAMESPACE_BEGIN
class ImageInput;
namespace Filesystem {
class IOMemReader;
}
OIIO_NAMESPACE_END

namespace petcomp {

struct Layout;
struct Note;

// A picture file that is open for reading.
class Reader {
  public:
    Reader(std::unique_ptr<OIIO::Filesystem::IOMemReader> bytes, std::unique_ptr<OIIO::ImageInput> input);
    ~Reader();
    OIIO::ImageInput &input() const { return *input_; }

  private:
    // In this order: the input is closed first.
    std::unique_ptr<OIIO::Filesystem::IOMemReader> bytes_;
    std::unique_ptr<OIIO::ImageInput> input_;
};

void start();
rust::String version();
std::unique_ptr<Reader> open(rust::Str path, rust::Str format, rust::Slice<const uint8_t> bytes);
Layout layout(const Reader &reader);
void read(const Reader &reader, rust::Slice<uint8_t> samples);
void write(rust::Str path, rust::Str format, const Layout &layout, rust::Slice<const uint8_t> samples,
           rust::Slice<const Note> notes);
void throw_an_int();

} // namespace petcomp
