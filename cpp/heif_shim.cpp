#include "petcomp/cpp/heif_shim.h"

#include <libheif/heif.h>
#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

#include "petcomp/src/io/worker/ffi.rs.h"

namespace petcomp {
namespace {

template <auto release>
struct Released {
    template <typename T>
    void operator()(T *it) const {
        release(it);
    }
};

using Context = std::unique_ptr<heif_context, Released<heif_context_free>>;
using Handle = std::unique_ptr<heif_image_handle, Released<heif_image_handle_release>>;
using Image = std::unique_ptr<heif_image, Released<heif_image_release>>;

void check(const heif_error &error) {
    if (error.code != heif_error_Ok)
        throw std::runtime_error(error.message);
}

// Codes of 9 to 16 bits at the full scale of 16.
void spread_to_16_bits(uint16_t *codes, size_t count, int bits) {
    const uint32_t most = (1u << bits) - 1;
    for (size_t i = 0; i < count; ++i)
        codes[i] = uint16_t((std::min<uint32_t>(codes[i], most) * 65535u + most / 2) / most);
}

// The first picture of a file, turned as the file says.
class HeifReader : public Reader {
  public:
    explicit HeifReader(rust::Slice<const uint8_t> bytes) : context_(heif_context_alloc()) {
        heif_context_set_max_decoding_threads(context_.get(), 0);
        check(heif_context_read_from_memory_without_copy(context_.get(), bytes.data(), bytes.size(), nullptr));
        heif_image_handle *handle = nullptr;
        check(heif_context_get_primary_image_handle(context_.get(), &handle));
        handle_.reset(handle);
        if (heif_image_handle_is_premultiplied_alpha(handle))
            throw std::runtime_error("premultiplied alpha, expected straight");
    }

    Layout layout() const override {
        Layout out;
        out.width = out.data_width = heif_image_handle_get_width(handle_.get());
        out.height = out.data_height = heif_image_handle_get_height(handle_.get());
        out.x = out.y = 0;
        for (const char *name : {"R", "G", "B"})
            out.channels.push_back(rust::String(name));
        if (has_alpha())
            out.channels.push_back(rust::String("A"));
        out.bytes = is_deep() ? 2 : 1;
        out.half = out.premultiplied = false;
        out.color_space = rust::String("sRGB");
        return out;
    }

    void read(const Layout &shape, rust::Slice<uint8_t> samples) const override {
        heif_image *decoded = nullptr;
        check(heif_decode_image(handle_.get(), &decoded, heif_colorspace_RGB, interleaved(), nullptr));
        const Image image(decoded);
        const size_t row = size_t(shape.data_width) * shape.channels.size() * size_t(shape.bytes);
        int stride = 0;
        const uint8_t *plane = heif_image_get_plane_readonly(image.get(), heif_channel_interleaved, &stride);
        const bool same_size = heif_image_get_width(image.get(), heif_channel_interleaved) == shape.data_width &&
                               heif_image_get_height(image.get(), heif_channel_interleaved) == shape.data_height;
        if (!plane || !same_size || stride < 0 || size_t(stride) < row || samples.size() != row * size_t(shape.data_height))
            throw std::length_error("pixels of another size than the file says");
        for (size_t y = 0; y < size_t(shape.data_height); ++y)
            std::memcpy(samples.data() + y * row, plane + y * size_t(stride), row);
        if (is_deep())
            spread_to_16_bits(reinterpret_cast<uint16_t *>(samples.data()), samples.size() / 2,
                              heif_image_get_bits_per_pixel_range(image.get(), heif_channel_interleaved));
    }

  private:
    bool has_alpha() const { return heif_image_handle_has_alpha_channel(handle_.get()); }
    bool is_deep() const { return heif_image_handle_get_luma_bits_per_pixel(handle_.get()) > 8; }

    heif_chroma interleaved() const {
        if (is_deep())
            return has_alpha() ? heif_chroma_interleaved_RRGGBBAA_LE : heif_chroma_interleaved_RRGGBB_LE;
        return has_alpha() ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB;
    }

    // In this order: the picture goes before its file.
    Context context_;
    Handle handle_;
};

} // namespace

rust::String heif_version() {
    std::string text = std::string("libheif ") + heif_get_version();
    // In later Debians it is a package of its own.
    if (!heif_have_decoder_for_format(heif_compression_HEVC))
        text += " without a decoder (package libheif-plugin-libde265)";
    return text;
}

void start_heif() { check(heif_init(nullptr)); }

std::unique_ptr<Reader> open_heif(rust::Slice<const uint8_t> bytes) { return std::make_unique<HeifReader>(bytes); }

} // namespace petcomp
