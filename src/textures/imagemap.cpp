#include "textures/imagemap.h"

#include "core/image/texture_cache.h"
#include "textures/inputs.h"

#include <charconv>

namespace strobe {
namespace {

const ParamDef<FilePath> kFilename{"filename", {}, "image file"};
const ParamDef<std::string> kWrap{"wrap", "repeat", "values outside of the image: repeat, black or clamp"};
const ParamDef<float> kScale{"scale", 1.f, "scale of the values"};
const ParamDef<bool> kInvert{"invert", false, "use max(1 - value, 0) instead of the value"};
const ParamDef<float> kGamma{"gamma", 1.f,
                             "exponent of the stored values of all files (pbrt-v2); as a bool, for 8- and "
                             "16-bit files: true: sRGB, false: linear (pbrt-v3)",
                             nullptr, kPositive};
const ParamDef<std::string> kEncoding{
    "encoding", "",
    "encoding of 8- and 16-bit files: sRGB, linear or \"gamma NUMBER\"; or, for all files, a color space of "
    "the OpenColorIO config; default: see docs/output.md"};
const ParamDef<std::string> kFilter{
    "filter", "EWA", "trilinear and EWA: filtering over the footprint; point and bilinear: no filtering"};
const ParamDef<bool> kTrilinear{"trilinear", false, "accepted without effect: see \"filter\""};
const ParamDef<float> kMaxAnisotropy{"maxanisotropy", 8.f,
                                     "accepted without effect: the anisotropy is at most 16"};

struct Settings {
    Wrap wrap = Wrap::Repeat;
    float scale = 1;
    bool invert = false, isFiltered = true, flipV = false;
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
        if (!m_settings.isFiltered)
            p.dstdx = p.dstdy = V2f(0);
        return scaledAndInverted(m_cache->lookup(*m_file, p.st, p.dstdx, p.dstdy, m_settings.wrap));
    }
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const override {
        TexturePointSoA p;
        m_mapping.atSoA(q, begin, end, p);
        for (int i = begin; m_settings.flipV && i < end; ++i) {
            p.uv.y[i] = 1 - p.uv.y[i];
            p.duvdx.y[i] = -p.duvdx.y[i];
            p.duvdy.y[i] = -p.duvdy.y[i];
        }
        if (!m_settings.isFiltered)
            for (float* row : {p.duvdx.x, p.duvdx.y, p.duvdy.x, p.duvdy.y})
                std::fill(row + begin, row + end, 0.f);
        m_cache->lookupSoA(*m_file, p, begin, end, {m_settings.wrap, m_settings.wrap}, out);
        for (int i = begin; i < end; ++i)
            out.set(i, scaledAndInverted(out.at(i)));
    }
    bool needsFootprint() const override { return m_settings.isFiltered; }

  private:
    Rgb scaledAndInverted(const Rgb& stored) const {
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
        throw Error(params.whereIs(kEncoding), "\"gamma\" must be followed by a positive number");
    }
    try {
        return ColorEncoding::fromSpace(*context.colorConfig, name, params.whereIs(kEncoding));
    } catch (const Error& e) {
        throw Error(e.location, "\"encoding\" must be sRGB, linear, \"gamma NUMBER\" or a color space of " +
                                    std::string(e.what()));
    }
}

/// Returns the encoding from "encoding", "gamma", the rules of the OpenColorIO config, or the conventions.
ColorEncoding encodingOfFile(const ParamSet& params, const BuildContext& context, const TextureArgs& args) {
    if (params.has(kEncoding))
        return encodingFrom(params, context);
    for (const Param& p : params.all())
        if (p.name == kGamma.name && p.type == ParamType::Bool) { // pbrt-v3
            const bool srgb = params.get(ParamDef<bool>{kGamma.name, true, ""});
            return {srgb ? ColorEncoding::Srgb : ColorEncoding::Linear};
        }
    if (params.has(kGamma))
        return {ColorEncoding::Gamma, params.get(kGamma), true};
    const ColorEncoding defaultEncoding{context.conventions == Conventions::PbrtV4 ? ColorEncoding::Srgb
                                                                                   : ColorEncoding::Linear};
    if (args.isFloat) // the rules of a config apply to colors only
        return defaultEncoding;
    return ColorEncoding::fromFileRules(*context.colorConfig, params.get(kFilename).path,
                                        params.whereIs(kFilename), defaultEncoding);
}

TexturePtr create(const ParamSet& params, const BuildContext& context, const TextureArgs& args) {
    const std::filesystem::path path = params.require(kFilename).path;
    params.get(kTrilinear); // marks it as used
    params.get(kMaxAnisotropy);
    const ColorEncoding encoding = encodingOfFile(params, context, args);
    Settings settings;
    settings.wrap = parseWord<Wrap>(
        params, kWrap, {{"repeat", Wrap::Repeat}, {"black", Wrap::Black}, {"clamp", Wrap::Clamp}});
    settings.isFiltered = parseWord<bool>(
        params, kFilter,
        {{"point", false}, {"bilinear", false}, {"trilinear", true}, {"EWA", true}, {"ewa", true}});
    settings.invert = params.get(kInvert);
    settings.flipV = context.conventions == Conventions::PbrtV4;
    settings.scale = params.get(kScale);
    if (encoding.kind == ColorEncoding::Gamma && encoding.appliesToFloats) // pbrt-v2: (scale * stored)^gamma
        settings.scale = std::pow(std::max(settings.scale, 0.f), encoding.gamma);
    const Mapping2D mapping(params, context, args);
    const auto cache = context.textureCache ? context.textureCache : std::make_shared<TextureCache>();
    return std::make_shared<const ImageMap>(cache, cache->open(path, params.whereIs(kFilename), encoding),
                                            mapping, settings);
}

} // namespace

Plugin<TexturePtr, const TextureArgs&> imagemapTexturePlugin() {
    std::vector<ParamInfo> table{kFilename, kWrap,   kScale,     kInvert,       kGamma,
                                 kEncoding, kFilter, kTrilinear, kMaxAnisotropy};
    const std::vector<ParamInfo> mapping = mappingParams();
    table.insert(table.end(), mapping.begin(), mapping.end());
    return {"imagemap", "image file, filtered over the footprint", table, create};
}

} // namespace strobe
