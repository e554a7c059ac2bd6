#include "core/image.h"

#include "core/atomic_file.h"

#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <Imath/half.h>

#include <set>

namespace strobe {

float encodeSrgb(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}
float decodeSrgb(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Image readImage(const std::filesystem::path& path, const Location& where, bool decode) {
    const auto fail = [&](const std::string& reason) -> Error {
        return {where, "cannot read the image " + path.string() + ": " + reason};
    };
    const auto input = OIIO::ImageInput::open(path.string());
    if (!input)
        throw fail(OIIO::geterror());
    const OIIO::ImageSpec spec = input->spec();
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1)
        throw fail("it is empty or not two-dimensional");
    const int n = spec.nchannels >= 3 ? 3 : 1;
    Image image{spec.width, spec.height, {}};
    std::vector<float> values(size_t(spec.width) * spec.height * n);
    if (!input->read_image(0, 0, 0, n, OIIO::TypeDesc::FLOAT, values.data()))
        throw fail(input->geterror());
    if (decode && !spec.format.is_floating_point())
        for (float& v : values)
            v = decodeSrgb(v);
    image.pixels.resize(size_t(spec.width) * spec.height);
    for (size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = n == 1 ? Rgb(values[i]) : Rgb(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    return image;
}

namespace {

[[noreturn]] void failWrite(const std::filesystem::path& path, const std::string& reason) {
    throw Error("cannot write " + path.string() + ": " + reason, ErrorKind::Output);
}

void insertMetadata(Imf::Header& header, const Metadata& metadata) {
    for (const auto& [name, value] : metadata) {
        if (const int* i = std::get_if<int>(&value))
            header.insert(name, Imf::IntAttribute(*i));
        else if (const float* f = std::get_if<float>(&value))
            header.insert(name, Imf::FloatAttribute(*f));
        else
            header.insert(name, Imf::StringAttribute(std::get<std::string>(value)));
    }
}

void checkExrArguments(const std::filesystem::path& path, const Window& data,
                       const std::vector<Channel>& channels) {
    if (data.width() < 1 || data.height() < 1)
        failWrite(path, "the image is empty");
    if (channels.empty())
        failWrite(path, "there are no channels");
    std::set<std::string> names;
    for (const Channel& channel : channels)
        if (channel.name.empty() || !names.insert(channel.name).second)
            failWrite(path, "channel name \"" + channel.name + "\" is empty or used twice");
}

/// A channel's values as halves; values beyond half's range become infinite, as OpenEXR does it.
std::vector<Imath::half> toHalf(const Channel& channel, size_t count) {
    std::vector<Imath::half> values(count);
    for (size_t i = 0; i < count; ++i)
        values[i] = Imath::half(channel.data[i * channel.stride]);
    return values;
}

std::string encodeExr(const Window& data, int fullWidth, int fullHeight, const std::vector<Channel>& channels,
                      const Metadata& metadata, bool half) {
    Imf::Header header(Imath::Box2i({0, 0}, {fullWidth - 1, fullHeight - 1}),
                       Imath::Box2i({data.x0, data.y0}, {data.x1 - 1, data.y1 - 1}));
    header.compression() = Imf::ZIP_COMPRESSION;
    insertMetadata(header, metadata);
    const Imf::PixelType type = half ? Imf::HALF : Imf::FLOAT;
    const size_t width = size_t(data.width()), count = width * size_t(data.height());
    std::vector<std::vector<Imath::half>> halves; // outlives the frame buffer
    Imf::FrameBuffer buffer;
    for (const Channel& channel : channels) {
        header.channels().insert(channel.name, Imf::Channel(type));
        const char* base = reinterpret_cast<const char*>(channel.data);
        size_t step = channel.stride * sizeof(float);
        if (half) {
            halves.push_back(toHalf(channel, count));
            base = reinterpret_cast<const char*>(halves.back().data());
            step = sizeof(Imath::half);
        }
        // OpenEXR addresses pixels by their coordinates, so the base is that of pixel (0, 0).
        const ptrdiff_t origin = ptrdiff_t(step) * (data.x0 + ptrdiff_t(width) * data.y0);
        buffer.insert(channel.name,
                      Imf::Slice(type, const_cast<char*>(base) - origin, step, step * width)); // only read
    }
    Imf::StdOSStream stream;
    {
        Imf::OutputFile file(stream, header); // its destructor completes the file
        file.setFrameBuffer(buffer);
        file.writePixels(data.height());
    }
    return stream.str();
}

} // namespace

void writeExr(const std::filesystem::path& path, const Window& data, int fullWidth, int fullHeight,
              const std::vector<Channel>& channels, const Metadata& metadata, bool half) {
    checkExrArguments(path, data, channels);
    std::string bytes; // made in memory: OpenEXR's destructors swallow the errors of a full disk
    try {
        bytes = encodeExr(data, fullWidth, fullHeight, channels, metadata, half);
    } catch (const std::exception& e) {
        failWrite(path, e.what());
    }
    writeFileAtomically(path, bytes);
}

std::string readMetadata(const std::filesystem::path& path, const std::string& name) {
    const auto input = OIIO::ImageInput::open(path.string());
    if (!input) {
        OIIO::geterror(); // not to be met by who asks next
        return "";
    }
    return std::string(input->spec().get_string_attribute(name));
}

void writePng(const std::filesystem::path& path, const Image& image, const Metadata& metadata) {
    if (image.width < 1 || image.height < 1)
        failWrite(path, "the image is empty");
    std::vector<uint8_t> bytes;
    bytes.reserve(3 * image.pixels.size());
    for (const Rgb& pixel : image.pixels)
        for (const float v : {pixel.x, pixel.y, pixel.z})
            bytes.push_back(uint8_t(255 * encodeSrgb(std::max(0.f, std::min(v, 1.f))) + 0.5f));

    OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    for (const auto& [name, value] : metadata)
        std::visit([&, &key = name](const auto& v) { spec.attribute(key, v); }, value);
    std::vector<unsigned char> encoded;
    OIIO::Filesystem::IOVecOutput memory(encoded);
    const auto output = OIIO::ImageOutput::create("png", &memory);
    if (!output)
        failWrite(path, OIIO::geterror());
    if (!output->open("image.png", spec) || !output->write_image(OIIO::TypeDesc::UINT8, bytes.data()) ||
        !output->close())
        failWrite(path, output->geterror());
    writeFileAtomically(path, {reinterpret_cast<const char*>(encoded.data()), encoded.size()});
}

} // namespace strobe
