#include "textures/imagemap.h"

#include "core/image/texture_cache.h"
#include "textures/inputs.h"

#include <charconv>

namespace strobe {
namespace {

const ParamDef<FilePath> kFilename{"filename", {}, "image file"};
const ParamDef<std::string> kWrap{"wrap", "repeat", "outside the image: repeat, black or clamp"};
const ParamDef<float> kScale{"scale", 1.f, "factor of the values"};
const ParamDef<bool> kInvert{"invert", false, "use 1 - value"};
const ParamDef<float> kGamma{"gamma", 1.f, "pbrt-v2: linear = stored^gamma; v3: a bool, sRGB or linear",
                             nullptr, kPositive};
const ParamDef<std::string> kEncoding{
    "encoding", "",
    "of 8- and 16-bit files: sRGB (default in v4), linear (default in v2) or \"gamma 2.2\"; of all files: a "
    "color space of the OpenColorIO config"};
const ParamDef<std::string> kFilter{"filter", "EWA",
                                    "point and bilinear: no filtering; trilinear and EWA: by the footprint"};
const ParamDef<bool> kTrilinear{"trilinear", false, "accepted: filtered by the footprint all the same"};
const ParamDef<float> kMaxAnisotropy{"maxanisotropy", 8.f, "accepted: at most 16 are taken as needed"};

struct Settings {
    Wrap wrap = Wrap::Repeat;
    float scale = 1;
    bool invert = false, filtered = true, flipV = false;
};

class ImageMap : public Texture {
  public:
    ImageMap(std::shared_ptr<const TextureCache> cache, std::shared_ptr<const TextureCache::File> file,
             const Mapping2D& mapping, const Settings& settings)
        : m_cache(std::move(cache)), m_file(std::move(file)), m_mapping(mapping), m_settings(settings) {}

    Rgb rgb(const TextureQuery& q) const override {
        TexturePoint p = m_mapping.at(q);
        if (m_settings.flipV) {
            p.st.y = 1 - p.st.y;
            p.dstdx.y = -p.dstdx.y;
            p.dstdy.y = -p.dstdy.y;
        }
        if (!m_settings.filtered)
            p.dstdx = p.dstdy = V2f(0);
        return valueOf(m_cache->lookup(*m_file, p.st, p.dstdx, p.dstdy, m_settings.wrap));
    }
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const override {
        TexturePointSoA p;
        m_mapping.atSoA(q, begin, end, p);
        for (int i = begin; m_settings.flipV && i < end; ++i) {
            p.uv.y[i] = 1 - p.uv.y[i];
            p.duvdx.y[i] = -p.duvdx.y[i], p.duvdy.y[i] = -p.duvdy.y[i];
        }
        if (!m_settings.filtered)
            for (float* row : {p.duvdx.x, p.duvdx.y, p.duvdy.x, p.duvdy.y})
                std::fill(row + begin, row + end, 0.f);
        m_cache->lookupSoA(*m_file, p, begin, end, {m_settings.wrap, m_settings.wrap}, out);
        for (int i = begin; i < end; ++i)
            out.set(i, valueOf(out.at(i)));
    }
    bool needsFootprint() const override { return m_settings.filtered && m_mapping.hasFootprint(); }

  private:
    Rgb valueOf(const Rgb& stored) const {
        const Rgb c = stored * m_settings.scale;
        return m_settings.invert ? nonNegative(Rgb(1) - c) : c;
    }
    static Rgb nonNegative(const Rgb& c) {
        return {std::max(c.x, 0.f), std::max(c.y, 0.f), std::max(c.z, 0.f)};
    }
    std::shared_ptr<const TextureCache> m_cache;
    std::shared_ptr<const TextureCache::File> m_file;
    Mapping2D m_mapping;
    Settings m_settings;
};

Wrap wrapFrom(const ParamSet& params) {
    const std::string name = params.get(kWrap);
    if (name == "repeat")
        return Wrap::Repeat;
    if (name == "black")
        return Wrap::Black;
    if (name == "clamp")
        return Wrap::Clamp;
    throw Error(params.whereIs(kWrap), "unknown wrap \"" + name + "\" (known: repeat, black, clamp)");
}

bool isFiltered(const ParamSet& params) {
    const std::string name = params.get(kFilter);
    if (name == "point" || name == "bilinear")
        return false;
    if (name == "trilinear" || name == "EWA" || name == "ewa")
        return true;
    throw Error(params.whereIs(kFilter),
                "unknown filter \"" + name + "\" (known: point, bilinear, trilinear, EWA)");
}

ColorEncoding encodingFrom(const ParamSet& params, const BuildContext& context) {
    const std::string name = params.get(kEncoding);
    if (name == "sRGB")
        return {ColorEncoding::Srgb};
    if (name == "linear")
        return {};
    float gamma = 0;
    if (name.starts_with("gamma ")) {
        const auto [end, error] = std::from_chars(&name[6], name.data() + name.size(), gamma);
        if (error == std::errc() && end == name.data() + name.size() && gamma > 0)
            return {ColorEncoding::Gamma, gamma};
        throw Error(params.whereIs(kEncoding), "\"gamma\" is followed by a positive number");
    }
    try {
        return ColorEncoding::fromSpace(*context.colorConfig, name, params.whereIs(kEncoding));
    } catch (const Error& e) {
        throw Error(e.location, std::string("neither sRGB, linear nor gamma and a number; of ") + e.what());
    }
}

ColorEncoding transferFrom(const ParamSet& params, const BuildContext& context, const TextureArgs& args) {
    if (params.has(kEncoding))
        return encodingFrom(params, context);
    for (const Param& p : params.all())
        if (p.name == kGamma.name && p.type == ParamType::Bool) { // pbrt-v3
            const bool srgb = params.get(ParamDef<bool>{kGamma.name, true, ""});
            return {srgb ? ColorEncoding::Srgb : ColorEncoding::Linear};
        }
    if (params.has(kGamma)) {
        return {ColorEncoding::Gamma, params.get(kGamma), true};
    }
    const ColorEncoding usual{context.conventions == Conventions::PbrtV4 ? ColorEncoding::Srgb
                                                                         : ColorEncoding::Linear};
    if (args.isFloat) // numbers, of which a config's rules know nothing
        return usual;
    return ColorEncoding::fromFileRules(*context.colorConfig, params.get(kFilename).path,
                                        params.whereIs(kFilename), usual);
}

TexturePtr create(const ParamSet& params, const BuildContext& context, const TextureArgs& args) {
    const std::filesystem::path path = params.require(kFilename).path;
    params.get(kTrilinear);
    params.get(kMaxAnisotropy);
    const ColorEncoding transfer = transferFrom(params, context, args);
    Settings settings;
    settings.wrap = wrapFrom(params);
    settings.filtered = isFiltered(params);
    settings.invert = params.get(kInvert);
    settings.flipV = context.conventions == Conventions::PbrtV4;
    settings.scale = params.get(kScale);
    if (transfer.kind == ColorEncoding::Gamma && transfer.appliesToFloats) // pbrt-v2: (scale * stored)^gamma
        settings.scale = std::pow(std::max(settings.scale, 0.f), transfer.gamma);
    const Mapping2D mapping(params, context, args);
    const auto cache = context.textureCache ? context.textureCache : std::make_shared<TextureCache>();
    return std::make_shared<const ImageMap>(cache, cache->open(path, params.whereIs(kFilename), transfer),
                                            mapping, settings);
}

} // namespace

Plugin<TexturePtr, const TextureArgs&> imagemapTexturePlugin() {
    std::vector<ParamInfo> table{kFilename, kWrap,   kScale,     kInvert,       kGamma,
                                 kEncoding, kFilter, kTrilinear, kMaxAnisotropy};
    const std::vector<ParamInfo> mapping = mappingParams();
    table.insert(table.end(), mapping.begin(), mapping.end());
    return {"imagemap", "an image file", table, create};
}

} // namespace strobe
