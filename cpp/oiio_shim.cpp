#include "petcomp/cpp/oiio_shim.h"

#include "petcomp/cpp/heif_shim.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <stdexcept>
#include <string>

#include "petcomp/src/io/worker/ffi.rs.h"

namespace petcomp {
namespace {

using OIIO::ImageInput;
using OIIO::ImageOutput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;
using OIIO::Filesystem::IOMemReader;
using OIIO::Filesystem::IOProxy;

// Readers that petcomp asks for.
const char *const FORMATS[] = {"openexr", "png", "jpeg", "tiff", "hdr", "dpx", "cineon"};

// The library's own words, which can be missing.
[[noreturn]] void fail(std::string message, const char *otherwise) {
    throw std::runtime_error(message.empty() ? otherwise : message);
}

// Bytes and halves stay as they are, other integers become 16 bits of the same full scale, everything else float.
TypeDesc handed_over(const ImageSpec &spec) {
    switch (spec.format.basetype) {
    case TypeDesc::UINT8: return TypeDesc::UINT8;
    case TypeDesc::UINT16:
    case TypeDesc::INT8:
    case TypeDesc::INT16:
    case TypeDesc::UINT32:
    case TypeDesc::INT32:
    case TypeDesc::UINT64:
    case TypeDesc::INT64: return TypeDesc::UINT16;
    case TypeDesc::HALF: return TypeDesc::HALF;
    default: return TypeDesc::FLOAT;
    }
}

TypeDesc of_bytes(int bytes) {
    switch (bytes) {
    case 1: return TypeDesc::UINT8;
    case 2: return TypeDesc::UINT16;
    case 4: return TypeDesc::FLOAT;
    default: throw std::invalid_argument("samples of 1, 2 or 4 bytes expected");
    }
}

size_t bytes_of(const ImageSpec &spec, TypeDesc type) {
    return size_t(spec.width) * size_t(spec.height) * size_t(spec.nchannels) * type.size();
}

// OpenImageIO 2.4 crashes on damaged TIFF strips that it reads several at a time. Of planes it can only read whole strips:
// the decoders underneath go forwards, and the next row of the first plane lies before the last one of the others.
bool row_by_row(const ImageInput &input, const ImageSpec &spec) {
    const bool planes = spec.get_string_attribute("planarconfig") == "separate";
    return std::string(input.format_name()) == "tiff" && spec.tile_width == 0 && !planes;
}

// Of most transfers of DPX the library makes no colour space: their own name says what the codes are.
std::string color_space_of(const ImageSpec &spec) {
    const std::string space(spec.get_string_attribute("oiio:ColorSpace"));
    return space.empty() ? std::string(spec.get_string_attribute("dpx:Transfer")) : space;
}

class OiioReader : public Reader {
  public:
    OiioReader(std::unique_ptr<IOMemReader> bytes, std::unique_ptr<ImageInput> input)
        : bytes_(std::move(bytes)), input_(std::move(input)) {}
    Layout layout() const override;
    void read(const Layout &layout, rust::Slice<uint8_t> samples) const override;

  private:
    // In this order: the input is closed first.
    std::unique_ptr<IOMemReader> bytes_;
    std::unique_ptr<ImageInput> input_;
};

} // namespace

void start() {
    start_heif();
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    OIIO::attribute("try_all_readers", 0);
    // Whatever a reader loads when it is first made is loaded now: later no file can be opened.
    for (const char *format : FORMATS)
        ImageInput::create(format);
}

rust::String version() { return rust::String(OIIO_VERSION_STRING); }

std::unique_ptr<Reader> open(rust::Str path, rust::Str format, rust::Slice<const uint8_t> bytes) {
    if (std::string(format) == "heif")
        return open_heif(bytes);
    auto input = ImageInput::create(std::string(format));
    if (!input)
        fail(OIIO::geterror(), "no reader for this format");
    input->threads(1);
    // Alpha is handed over as the file has it: the library would multiply display-encoded values.
    ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    std::unique_ptr<IOMemReader> memory;
    if (input->supports("ioproxy")) {
        memory = std::make_unique<IOMemReader>(const_cast<uint8_t *>(bytes.data()), bytes.size());
        IOProxy *proxy = memory.get();
        config.attribute("oiio:ioproxy", TypeDesc::PTR, &proxy);
    }
    ImageSpec spec;
    if (!input->open(std::string(path), spec, config))
        fail(input->geterror(), "cannot be opened");
    return std::make_unique<OiioReader>(std::move(memory), std::move(input));
}

Layout OiioReader::layout() const {
    const ImageSpec spec = input_->spec(0, 0);
    if (spec.format == TypeDesc::UNKNOWN)
        fail(input_->geterror(), "no picture in it");
    if (spec.deep || spec.depth > 1 || spec.full_depth > 1)
        throw std::runtime_error("deep or volume data, expected flat pixels");
    Layout out;
    out.width = spec.full_width;
    out.height = spec.full_height;
    out.x = int64_t(spec.x) - spec.full_x;
    out.y = int64_t(spec.y) - spec.full_y;
    out.data_width = spec.width;
    out.data_height = spec.height;
    for (int c = 0; c < spec.nchannels; ++c)
        out.channels.push_back(std::string(spec.channel_name(c)));
    out.bytes = int32_t(handed_over(spec).size());
    out.half = handed_over(spec) == TypeDesc::HALF;
    out.color_space = color_space_of(spec);
    return out;
}

void OiioReader::read(const Layout &, rust::Slice<uint8_t> samples) const {
    ImageInput &input = *input_;
    const ImageSpec spec = input.spec(0, 0);
    const TypeDesc type = handed_over(spec);
    if (samples.size() != bytes_of(spec, type))
        throw std::length_error("buffer of another size than the picture");
    bool good = true;
    if (row_by_row(input, spec)) {
        const size_t row = samples.size() / size_t(spec.height);
        for (int y = 0; good && y < spec.height; ++y)
            good = input.read_scanlines(0, 0, spec.y + y, spec.y + y + 1, 0, 0, spec.nchannels, type,
                                        samples.data() + row * size_t(y));
    } else {
        good = input.read_image(0, 0, 0, spec.nchannels, type, samples.data());
    }
    if (!good)
        fail(input.geterror(), "cannot be decoded");
}

void write(rust::Str path, rust::Str format, const Layout &layout, rust::Slice<const uint8_t> samples,
           rust::Slice<const Note> notes) {
    const TypeDesc type = of_bytes(layout.bytes);
    ImageSpec spec(int(layout.width), int(layout.height), int(layout.channels.size()), type);
    if (samples.size() != bytes_of(spec, type))
        throw std::length_error("buffer of another size than the picture");
    spec.channelnames.clear();
    spec.alpha_channel = -1;
    for (const rust::String &name : layout.channels) {
        if (name == "A")
            spec.alpha_channel = int(spec.channelnames.size());
        spec.channelnames.emplace_back(name);
    }
    if (layout.half)
        spec.set_format(TypeDesc::HALF);
    if (!layout.premultiplied)
        spec.attribute("oiio:UnassociatedAlpha", 1);
    for (const Note &note : notes)
        spec.attribute(std::string(note.key), std::string(note.value));
    auto output = ImageOutput::create(std::string(format));
    if (!output)
        fail(OIIO::geterror(), "no writer for this format");
    output->threads(1);
    if (!output->open(std::string(path), spec) || !output->write_image(type, samples.data()) || !output->close())
        fail(output->geterror(), "cannot be written");
}

Layout layout(const Reader &reader) { return reader.layout(); }

void read(const Reader &reader, const Layout &layout, rust::Slice<uint8_t> samples) { reader.read(layout, samples); }

void throw_an_int() { throw 1; }

} // namespace petcomp
