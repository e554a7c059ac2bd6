#include "core/image.h"

#include "core/atomic_file.h"
#include "core/guard.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cctype>
#include <set>

namespace strobe {

Transfer Transfer::of(const ColourConfig& config, const std::string& space, const Location& where) {
    ColourTransform toWorking = config.toWorking(space, where);
    return toWorking ? Transfer{Space, 1, true, space, std::move(toWorking)} : Transfer{};
}

Transfer Transfer::ofFile(const ColourConfig& config, const std::filesystem::path& file,
                          const Location& where, const Transfer& otherwise) {
    const std::string space = config.spaceOfFile(file, where);
    return space.empty() ? otherwise : of(config, space, where);
}

bool Transfer::changes(bool floats) const {
    return kind != Linear && (kind != Gamma || gamma != 1) && (ofFloats || !floats);
}

float Transfer::linear(float stored) const {
    return kind == Srgb    ? decodeSrgb(stored)
           : kind == Gamma ? std::pow(std::max(stored, 0.f), gamma)
                           : stored;
}

void checkImage(const std::filesystem::path& path, const Location& where) {
    static const std::set<std::string> plain{".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff",
                                             ".tx",  ".hdr", ".pfm", ".ppm",  ".pgm", ".tga",
                                             ".bmp", ".gif", ".dpx", ".webp"};
    if (!guardOf(where).confines())
        return;
    // OIIO would offer a file to every reader it has. Those of films follow references to other files.
    OIIO::attribute("try_all_readers", 0);
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (!plain.contains(extension))
        throw Error(where,
                    "the image " + path.string() + ": with --sandbox, no images of this kind are read");
    // In such names OIIO sees patterns for many files.
    const std::string name = path.string();
    for (const char* pattern : {"<", "%(", "##", "?"})
        if (name.find(pattern) != std::string::npos)
            throw Error(where,
                        "the image " + name + ": with --sandbox, its name must not contain " + pattern);
}

Image readImage(const std::filesystem::path& path, const Location& where, const Transfer& transfer) {
    const auto fail = [&](const std::string& reason) -> Error {
        return {where, "cannot read the image " + path.string() + ": " + reason};
    };
    checkImage(path, where);
    const auto input = OIIO::ImageInput::open(path.string());
    if (!input)
        throw fail(OIIO::geterror());
    const OIIO::ImageSpec spec = input->spec();
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1)
        throw fail("it is empty or not two-dimensional");
    const int n = spec.nchannels >= 3 ? 3 : 1;
    guardOf(where).require(uint64_t(spec.width) * uint64_t(spec.height) * (4 * uint64_t(n) + sizeof(Rgb)),
                           "the image " + path.string(), "make it smaller", where);
    Image image{spec.width, spec.height, {}};
    std::vector<float> values(size_t(spec.width) * spec.height * n);
    if (!input->read_image(0, 0, 0, n, OIIO::TypeDesc::FLOAT, values.data()))
        throw fail(input->geterror());
    const bool changes = transfer.changes(spec.format.is_floating_point());
    if (changes && transfer.kind != Transfer::Space)
        for (float& v : values)
            v = transfer.linear(v);
    image.pixels.resize(size_t(spec.width) * spec.height);
    for (size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = n == 1 ? Rgb(values[i]) : Rgb(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    if (changes && transfer.kind == Transfer::Space)
        transfer.toWorking(image.pixels);
    return image;
}

namespace {

[[noreturn]] void failWrite(const std::filesystem::path& path, const std::string& reason) {
    throw Error("cannot write " + path.string() + ": " + reason, ErrorKind::Output);
}

} // namespace

std::string readMetadata(const std::filesystem::path& path, const std::string& name) {
    const auto input = OIIO::ImageInput::open(path.string());
    if (!input) {
        OIIO::geterror(); // not to be met by who asks next
        return "";
    }
    return std::string(input->spec().get_string_attribute(name));
}

void writePng(const std::filesystem::path& path, Image image, const Metadata& metadata,
              const ColourTransform& view) {
    if (image.width < 1 || image.height < 1)
        failWrite(path, "the image is empty");
    if (view)
        view(image.pixels);
    std::vector<uint8_t> bytes;
    bytes.reserve(3 * image.pixels.size());
    for (const Rgb& pixel : image.pixels)
        for (const float v : {pixel.x, pixel.y, pixel.z}) {
            const float shown = std::max(0.f, std::min(v, 1.f));
            bytes.push_back(uint8_t(255 * (view ? shown : encodeSrgb(shown)) + 0.5f));
        }

    OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
    if (!view)
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
