#include "core/color/color_config.h"

#include "core/util/parallel.h"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <sstream>
#include <vector>

#if OCIO_VERSION_HEX < 0x02010000
#error "OpenColorIO 2.1 or newer is needed"
#endif

namespace strobe {

namespace OCIO = OCIO_NAMESPACE;

float encodeSrgb(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}
float decodeSrgb(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

namespace {

/// What configs call the working space. One that has none of these is asked for ACES2065-1 by its role.
constexpr std::array<const char*, 6> kWorkingNames = {
    kWorkingSpace,           "lin_rec709_scene",        "lin_srgb",
    "Linear Rec.709 (sRGB)", "Utility - Linear - sRGB", "Utility - Linear - Rec.709"};

/// The processor as a transform of ours, empty when it changes nothing. Without OpenColorIO's approximations
/// of powers and logarithms.
ColorTransform transformOf(const OCIO::ConstProcessorRcPtr& processor) {
    if (processor->isNoOp())
        return {};
    const OCIO::ConstCPUProcessorRcPtr cpu = processor->getOptimizedCPUProcessor(OCIO::OPTIMIZATION_LOSSLESS);
    return [cpu](std::span<Rgb> colors) {
        constexpr size_t kSome = 4096;
        parallelFor((colors.size() + kSome - 1) / kSome, [&](size_t i) {
            const std::span<Rgb> some =
                colors.subspan(i * kSome).first(std::min(kSome, colors.size() - i * kSome));
            OCIO::PackedImageDesc image(some.data(), long(some.size()), 1, 3);
            cpu->apply(image);
        });
    };
}

OCIO::TransformRcPtr builtin(const char* style, OCIO::TransformDirection direction) {
    const auto transform = OCIO::BuiltinTransform::Create();
    transform->setStyle(style);
    transform->setDirection(direction);
    return transform;
}

/// A config in use: one that has the working space under a name that we know.
struct LoadedConfig {
    OCIO::ConstConfigRcPtr config;
    std::string working; ///< the name
};

/// Adds the working space to a config that only says which of its spaces is ACES2065-1.
void addWorkingSpace(OCIO::Config& config) {
    const OCIO::ConstColorSpaceRcPtr aces = config.getColorSpace(OCIO::ROLE_INTERCHANGE_SCENE);
    const auto toReference = OCIO::GroupTransform::Create();
    toReference->appendTransform(
        builtin("UTILITY - ACES-AP1_to_LINEAR-REC709_BFD", OCIO::TRANSFORM_DIR_INVERSE));
    toReference->appendTransform(builtin("ACEScg_to_ACES2065-1", OCIO::TRANSFORM_DIR_FORWARD));
    if (const auto to = aces->getTransform(OCIO::COLORSPACE_DIR_TO_REFERENCE)) {
        toReference->appendTransform(to->createEditableCopy());
    } else if (const auto from = aces->getTransform(OCIO::COLORSPACE_DIR_FROM_REFERENCE)) {
        const auto back = OCIO::GroupTransform::Create();
        back->appendTransform(from->createEditableCopy());
        back->setDirection(OCIO::TRANSFORM_DIR_INVERSE);
        toReference->appendTransform(back);
    }
    const auto space = OCIO::ColorSpace::Create();
    space->setName(kWorkingSpace);
    space->setTransform(toReference, OCIO::COLORSPACE_DIR_TO_REFERENCE);
    config.addColorSpace(space);
}

LoadedConfig load(const std::string& file) {
    OCIO::ConstConfigRcPtr config;
    if (file.empty()) {
        std::istringstream text(builtinColorConfig());
        config = OCIO::Config::CreateFromStream(text);
    } else {
        config = OCIO::Config::CreateFromFile(file.c_str());
    }
    config->validate();
    for (const char* name : kWorkingNames)
        if (config->getColorSpace(name))
            return {config, name};
    if (config->hasRole(OCIO::ROLE_INTERCHANGE_SCENE)) {
        const OCIO::ConfigRcPtr copy = config->createEditableCopy();
        addWorkingSpace(*copy);
        return {copy, kWorkingSpace};
    }
    if (config->hasRole(OCIO::ROLE_SCENE_LINEAR))
        return {config, config->getCanonicalName(OCIO::ROLE_SCENE_LINEAR)};
    throw OCIO::Exception("it has neither a linear Rec. 709 space, as lin_rec709, nor one of the roles "
                          "aces_interchange and scene_linear");
}

std::vector<std::string> displaysOf(const OCIO::Config& config) {
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumDisplays(); ++i)
        names.emplace_back(config.getDisplay(i));
    return names;
}

std::vector<std::string> viewsOf(const OCIO::Config& config, const std::string& display) {
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumViews(display.c_str()); ++i)
        names.emplace_back(config.getView(display.c_str(), i));
    return names;
}

std::vector<std::string> looksOf(const OCIO::Config& config) {
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumLooks(); ++i)
        names.emplace_back(config.getLookNameByIndex(i));
    return names;
}

/// Not those of displays: files hold scenes.
std::vector<std::string> spacesOf(const OCIO::Config& config) {
    constexpr auto kScene = OCIO::SEARCH_REFERENCE_SPACE_SCENE;
    constexpr auto kActive = OCIO::COLORSPACE_ACTIVE;
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumColorSpaces(kScene, kActive); ++i)
        names.emplace_back(config.getColorSpaceNameByIndex(kScene, kActive, i));
    return names;
}

void require(const std::string& kind, const std::string& name, const std::vector<std::string>& known,
             const std::string& of) {
    if (std::find(known.begin(), known.end(), name) == known.end())
        throw Error(of + ": " + unknownName(kind, name, known), ErrorKind::Usage);
}

/// Looks are a list: commas or colons between, + or - before, | between those of which the first that works
/// is taken.
void requireLooks(const std::string& looks, const std::vector<std::string>& known, const std::string& of) {
    constexpr const char* kBetween = ",:|";
    for (size_t begin = 0; begin < looks.size();) {
        const size_t end = std::min(looks.find_first_of(kBetween, begin), looks.size());
        const std::string part = looks.substr(begin, end - begin);
        const size_t first = part.find_first_not_of(" +-"), last = part.find_last_not_of(' ');
        require("look", first == std::string::npos ? "" : part.substr(first, last + 1 - first), known, of);
        begin = end + 1;
    }
}

OCIO::ConstProcessorRcPtr viewProcessor(const LoadedConfig& loaded, const std::string& display,
                                        const std::string& view, const std::string& looks) {
    const auto transform = OCIO::DisplayViewTransform::Create();
    transform->setSrc(loaded.working.c_str());
    transform->setDisplay(display.c_str());
    transform->setView(view.c_str());
    const auto pipeline = OCIO::LegacyViewingPipeline::Create(); // knows how looks replace those of the view
    pipeline->setDisplayViewTransform(transform);
    pipeline->setLooksOverrideEnabled(!looks.empty());
    pipeline->setLooksOverride(looks.c_str());
    return pipeline->getProcessor(loaded.config, loaded.config->getCurrentContext());
}

} // namespace

struct ColorConfig::Impl {
    explicit Impl(std::string file)
        : file(std::move(file)), title(this->file.empty() ? "the built-in OpenColorIO config"
                                                          : "the OpenColorIO config \"" + this->file + "\"") {
    }
    const std::string file, title;
    std::once_flag once;
    LoadedConfig loaded;

    /// Runs `f(loaded)`; OpenColorIO's exceptions become errors of ours, at `where`.
    template <class F>
    auto with(const Location& where, const F& f) {
        try {
            std::call_once(once, [&] { loaded = load(file); });
            return f(loaded);
        } catch (const OCIO::Exception& e) {
            throw Error(where, title + ": " + e.what(), where ? ErrorKind::Scene : ErrorKind::Usage);
        }
    }
};

ColorConfig::ColorConfig(std::string file) : m_impl(std::make_unique<Impl>(std::move(file))) {}
ColorConfig::~ColorConfig() = default;

std::string ColorConfig::workingSpace() const {
    if (m_impl->file.empty())
        return kWorkingSpace;
    return m_impl->with({}, [](const LoadedConfig& loaded) { return loaded.working; });
}

ColorTransform ColorConfig::view(const ViewSettings& settings) const {
    return m_impl->with({}, [&](const LoadedConfig& loaded) {
        const OCIO::Config& config = *loaded.config;
        const std::string display = settings.display.empty() ? config.getDefaultDisplay() : settings.display;
        require("display", display, displaysOf(config), m_impl->title);
        const std::string view =
            settings.view.empty() ? config.getDefaultView(display.c_str()) : settings.view;
        require("view", view, viewsOf(config, display),
                "the display \"" + display + "\" of " + m_impl->title);
        requireLooks(settings.look, looksOf(config), m_impl->title);
        const ColorTransform shown = transformOf(viewProcessor(loaded, display, view, settings.look));
        return shown ? shown : [](std::span<Rgb>) {}; // as a raw view does
    });
}

ColorTransform ColorConfig::toWorking(const std::string& space, const Location& where) const {
    return m_impl->with(where, [&](const LoadedConfig& loaded) {
        if (!loaded.config->getColorSpace(space.c_str()))
            throw Error(where,
                        m_impl->title + ": " + unknownName("color space", space, spacesOf(*loaded.config)),
                        where ? ErrorKind::Scene : ErrorKind::Usage);
        return transformOf(loaded.config->getProcessor(space.c_str(), loaded.working.c_str()));
    });
}

std::string ColorConfig::spaceOfFile(const std::filesystem::path& path, const Location& where) const {
    if (m_impl->file.empty())
        return {}; // ours has no such rule
    return m_impl->with(where, [&](const LoadedConfig& loaded) -> std::string {
        const std::string name = path.generic_string();
        if (loaded.config->filepathOnlyMatchesDefaultRule(name.c_str()))
            return {};
        return loaded.config->getColorSpaceFromFilepath(name.c_str());
    });
}

} // namespace strobe
