#include "lights/light_image.h"

namespace strobe {
namespace {

/// Returns the index in [0, n) of a pixel that may lie outside; -1 if it is black.
int wrapped(int i, int n, Wrap wrap) {
    if (i >= 0 && i < n)
        return i;
    return wrap == Wrap::Black ? -1 : wrap == Wrap::Clamp ? std::clamp(i, 0, n - 1) : (i % n + n) % n;
}

} // namespace

Image readLightImage(const ParamSet& params, const ParamDef<FilePath>& def, const BuildContext& context) {
    const Location where = params.whereIs(def);
    const std::filesystem::path path = params.get(def).path;
    const ColorEncoding fallback{context.pbrtVersion < 4 ? ColorEncoding::Linear : ColorEncoding::Srgb};
    return readImage(path, where, ColorEncoding::fromFileRules(*context.colorConfig, path, where, fallback));
}

Rgb bilinear(const Image& image, const V2f& st, Wrap wrap) {
    const auto pixel = [&](int x, int y) {
        const int i = wrapped(x, image.width, wrap), j = wrapped(y, image.height, wrap);
        return i < 0 || j < 0 ? Rgb(0) : image.at(i, j);
    };
    const float x = st.x * float(image.width) - .5f, y = st.y * float(image.height) - .5f;
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const float dx = x - float(i), dy = y - float(j);
    return (pixel(i, j) * (1 - dx) + pixel(i + 1, j) * dx) * (1 - dy) +
           (pixel(i, j + 1) * (1 - dx) + pixel(i + 1, j + 1) * dx) * dy;
}

} // namespace strobe
