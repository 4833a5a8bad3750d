// What petcomp needs of libheif: pictures of phones, out of memory.
#pragma once

#include "petcomp/cpp/oiio_shim.h"

namespace petcomp {

// Loads the decoders: later no file can be opened.
void start_heif();
rust::String heif_version();
std::unique_ptr<Reader> open_heif(rust::Slice<const uint8_t> bytes);

} // namespace petcomp
