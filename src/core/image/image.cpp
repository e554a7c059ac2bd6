#include "core/image/image.h"

#include "core/util/atomic_file.h"
#include "core/util/resource_policy.h"

#include <algorithm>
#include <cctype>
#include <limits>
#include <set>

namespace strobe {

ColorEncoding ColorEncoding::fromSpace(const ColorConfig& config, const std::string& space,
                                       const Location& where) {
    ColorTransform toWorking = config.toWorking(space, where);
    return toWorking ? ColorEncoding{Space, 1, true, space, std::move(toWorking)} : ColorEncoding{};
}

ColorEncoding ColorEncoding::fromFileRules(const ColorConfig& config, const std::filesystem::path& file,
                                           const Location& where, const ColorEncoding& fallback) {
    const std::string space = config.spaceOfFile(file, where);
    return space.empty() ? fallback : fromSpace(config, space, where);
}

bool ColorEncoding::hasEffect(bool isFloat) const {
    return kind != Linear && (kind != Gamma || gamma != 1) && (appliesToFloats || !isFloat);
}

float ColorEncoding::decode(float stored) const {
    return kind == Srgb    ? decodeSrgb(stored)
           : kind == Gamma ? std::pow(std::max(stored, 0.f), gamma)
                           : stored;
}

void checkImage(const std::filesystem::path& path, const Location& where) {
    static const std::set<std::string> allowed{".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff",
                                               ".tx",  ".hdr", ".pfm", ".ppm",  ".pgm", ".tga",
                                               ".bmp", ".gif", ".dpx", ".webp"};
    if (!resourcePolicyOf(where).restrictsFiles())
        return;
    // The readers of movie formats follow references to other files.
    imageLibrary().readByExtensionOnly();
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (!allowed.contains(extension))
        throw Error(where, "cannot read the image " + path.string() +
                               ": --sandbox does not allow this image format");
    // OpenImageIO expands these patterns to the names of several files.
    const std::string name = path.string();
    for (const char* pattern : {"<", "%(", "##", "?"})
        if (name.find(pattern) != std::string::npos)
            throw Error(where, "cannot read the image " + name + ": --sandbox does not allow " + pattern +
                                   " in its name");
}

Image readImage(const std::filesystem::path& path, const Location& where, const ColorEncoding& encoding) {
    const auto fail = [&](const std::string& reason) -> Error {
        return {where, "cannot read the image " + path.string() + ": " + reason};
    };
    checkImage(path, where);
    std::string error;
    const auto file = imageLibrary().open(path.string(), error);
    if (!file)
        throw fail(error);
    const int width = file->width, height = file->height;
    if (width < 1 || height < 1 || file->channels < 1 || file->depth > 1)
        throw fail("it is empty or not two-dimensional");
    const int n = file->channels >= 3 ? 3 : 1;
    resourcePolicyOf(where).requireMemory(uint64_t(width) * uint64_t(height) *
                                              (4 * uint64_t(n) + sizeof(Rgb)),
                                          "the image " + path.string(), "reduce its resolution", where);
    Image image{width, height, {}};
    std::vector<float> values(size_t(width) * size_t(height) * size_t(n));
    if (!file->read(0, n, values.data(), error))
        throw fail(error);
    const bool isEncoded = encoding.hasEffect(file->isFloat);
    if (isEncoded && encoding.kind != ColorEncoding::Space)
        for (float& v : values)
            v = encoding.decode(v);
    image.pixels.resize(size_t(width) * size_t(height));
    for (size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = n == 1 ? Rgb(values[i]) : Rgb(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    if (isEncoded && encoding.kind == ColorEncoding::Space)
        encoding.toWorking(image.pixels);
    return image;
}

namespace {

[[noreturn]] void failWrite(const std::filesystem::path& path, const std::string& reason) {
    throw Error("cannot write " + path.string() + ": " + reason, ErrorKind::Output);
}

} // namespace

std::string readMetadata(const std::filesystem::path& path, const std::string& name) {
    std::string error;
    const auto file = imageLibrary().open(path.string(), error);
    return file ? file->metadata(name) : "";
}

namespace {

/// Divides colors by alpha.
void unmultiply(Image& image, std::span<const float> alpha) {
    for (size_t i = 0; i < alpha.size(); ++i)
        if (alpha[i] > 0)
            image.pixels[i] = image.pixels[i] / alpha[i];
}

/// Scales values in [0,1] to the range of an integer type, and stores them with their alpha.
template <class T>
std::vector<T> toIntegers(const Image& image, std::span<const float> alpha, bool encodesSrgb) {
    constexpr float kMax = float(std::numeric_limits<T>::max());
    std::vector<T> values;
    values.reserve((alpha.empty() ? 3 : 4) * image.pixels.size());
    for (size_t i = 0; i < image.pixels.size(); ++i) {
        const Rgb& pixel = image.pixels[i];
        for (const float v : {pixel.x, pixel.y, pixel.z}) {
            const float shown = std::max(0.f, std::min(v, 1.f));
            values.push_back(T(kMax * (encodesSrgb ? encodeSrgb(shown) : shown) + 0.5f));
        }
        if (!alpha.empty())
            values.push_back(T(kMax * std::clamp(alpha[i], 0.f, 1.f) + 0.5f));
    }
    return values;
}

} // namespace

void writeImage(const std::filesystem::path& path, Image image, const Metadata& metadata,
                const ColorTransform& view, std::span<const float> alpha) {
    if (image.width < 1 || image.height < 1)
        failWrite(path, "the image is empty");
    const ImageFormat format = imageFormatOf(path).value_or(ImageFormat::Png);
    if (!hasAlpha(format))
        alpha = {};
    unmultiply(image, alpha);
    StoredPixels stored{image.width, image.height, alpha.empty() ? 3 : 4, {}};
    if (hasView(format) && view)
        view(image.pixels);
    if (format == ImageFormat::Hdr)
        stored.values = std::vector<float>(&image.pixels[0].x, &image.pixels[0].x + 3 * image.pixels.size());
    else if (format == ImageFormat::Tiff)
        stored.values = toIntegers<uint16_t>(image, alpha, !view);
    else
        stored.values = toIntegers<uint8_t>(image, alpha, !view);
    std::string error;
    const std::vector<unsigned char> encoded =
        imageLibrary().encode(format, stored, hasView(format) && !view, metadata, error);
    if (encoded.empty())
        failWrite(path, error);
    writeFileAtomically(path, {reinterpret_cast<const char*>(encoded.data()), encoded.size()});
}

} // namespace strobe
