#include "core/image/image_source.h"

#include <fstream>
#include <iterator>

namespace strobe {
namespace {

/// Converts from a color space to the working space. Gray images become RGB, since gray in the color space
/// may have a tint in the working space.
void convert(const ColorEncoding& encoding, DecodedImage& image) {
    const std::vector<float>& v = image.values;
    std::vector<Rgb> colors(v.size() / size_t(image.channels));
    for (size_t i = 0; i < colors.size(); ++i)
        colors[i] = image.channels == 1 ? Rgb(v[i]) : Rgb(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    encoding.toWorking(colors);
    image.values.assign(&colors[0].x, &colors[0].x + 3 * colors.size());
    image.channels = 3;
}

} // namespace

std::unique_ptr<ImageReader> ImageSource::open(std::string& error) const {
    if (!memory)
        return imageLibrary().open(path, error);
    if (memory->file.empty())
        return imageLibrary().open(memory->bytes, error);
    std::ifstream file(memory->file, std::ios::binary);
    const auto bytes = std::make_shared<const std::vector<unsigned char>>(
        std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    auto reader = imageLibrary().open(*bytes, error);
    if (reader)
        reader->owned = bytes;
    return reader;
}

bool ImageSource::decode(DecodedImage& out, std::string& error) const {
    const auto file = open(error);
    if (!file)
        return false;
    if (file->width < 1 || file->height < 1 || int64_t(file->width) * file->height > kMaxImagePixels) {
        error = std::to_string(file->width) + " x " + std::to_string(file->height) +
                " pixels are more than an image may have, or none";
        return false;
    }
    const bool isAlpha = channels == TextureChannels::Alpha;
    int n = 0;
    const int first = firstChannel(*file, n);
    out = {file->width, file->height, n, {}};
    out.values.resize(size_t(file->width) * size_t(file->height) * size_t(n));
    if (!file->read(first, first + n, out.values.data(), error))
        return false;
    if (!isAlpha && encoding.kind == ColorEncoding::Space)
        convert(encoding, out);
    else if (!isAlpha && encoding.kind != ColorEncoding::Linear)
        for (float& v : out.values)
            v = encoding.decode(v);
    return true;
}

int ImageSource::firstChannel(const ImageReader& file, int& count) const {
    if (channels == TextureChannels::Alpha) {
        count = 1;
        return std::max(file.alphaChannel, 0);
    }
    const int colors = file.alphaChannel > 0 ? file.alphaChannel : file.channels;
    count = colors >= 3 ? 3 : 1;
    return 0;
}

std::string ImageSource::key(const std::string& name) const {
    const std::string encodings[] = {"linear", "srgb", "gamma " + std::to_string(encoding.gamma),
                                     "space " + encoding.space};
    return name + "|" + (channels == TextureChannels::Alpha ? "alpha" : encodings[encoding.kind]);
}

} // namespace strobe
