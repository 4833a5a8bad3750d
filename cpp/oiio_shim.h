// What petcomp needs of OpenImageIO, and of libheif beside it, shaped for Rust. Every function may throw: the bridge turns that into an error.
#pragma once

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

namespace petcomp {

struct Layout;
struct Note;

// A picture file that is open for reading.
class Reader {
  public:
    virtual ~Reader() = default;
    virtual Layout layout() const = 0;
    virtual void read(const Layout &layout, rust::Slice<uint8_t> samples) const = 0;
};

void start();
rust::String version();
std::unique_ptr<Reader> open(rust::Str path, rust::Str format, rust::Slice<const uint8_t> bytes);
Layout layout(const Reader &reader);
void read(const Reader &reader, const Layout &layout, rust::Slice<uint8_t> samples);
void write(rust::Str path, rust::Str format, const Layout &layout, rust::Slice<const uint8_t> samples,
           rust::Slice<const Note> notes);
void throw_an_int();

} // namespace petcomp
