#include "core/color/color_config.h"

#include "core/math/hash.h"
#include "core/util/nearest_name.h"
#include "core/util/parallel.h"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <mutex>
#include <set>
#include <sstream>
#include <vector>

#if OCIO_VERSION_HEX < 0x02010000
#error "OpenColorIO 2.1 or newer is required"
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

/// Names of the working space in common configs. In a config that has none of them, the working space is
/// derived from ACES2065-1, which is found by its role.
constexpr std::array<const char*, 6> kWorkingSpaceNames = {
    kWorkingSpace,           "lin_rec709_scene",        "lin_srgb",
    "Linear Rec.709 (sRGB)", "Utility - Linear - sRGB", "Utility - Linear - Rec.709"};

/// Returns a ColorTransform that applies `processor`; empty if the processor is the identity. Does not use
/// OpenColorIO's approximations of powers and logarithms.
ColorTransform makeTransform(const OCIO::ConstProcessorRcPtr& processor) {
    if (processor->isNoOp())
        return {};
    const OCIO::ConstCPUProcessorRcPtr cpu = processor->getOptimizedCPUProcessor(OCIO::OPTIMIZATION_LOSSLESS);
    return [cpu](std::span<Rgb> colors) {
        constexpr size_t kTaskSize = 4096;
        parallelFor((colors.size() + kTaskSize - 1) / kTaskSize, [&](size_t i) {
            const std::span<Rgb> range =
                colors.subspan(i * kTaskSize).first(std::min(kTaskSize, colors.size() - i * kTaskSize));
            OCIO::PackedImageDesc image(range.data(), long(range.size()), 1, 3);
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

/// A config and the name of its working space.
struct LoadedConfig {
    OCIO::ConstConfigRcPtr config;
    std::string workingSpace;
};

/// Adds the working space to a config that defines the role aces_interchange (ACES2065-1).
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
        std::istringstream text(kBuiltinColorConfig);
        config = OCIO::Config::CreateFromStream(text);
    } else {
        config = OCIO::Config::CreateFromFile(file.c_str());
    }
    config->validate();
    for (const char* name : kWorkingSpaceNames)
        if (config->getColorSpace(name))
            return {config, name};
    if (config->hasRole(OCIO::ROLE_INTERCHANGE_SCENE)) {
        const OCIO::ConfigRcPtr copy = config->createEditableCopy();
        addWorkingSpace(*copy);
        return {copy, kWorkingSpace};
    }
    if (config->hasRole(OCIO::ROLE_SCENE_LINEAR))
        return {config, config->getCanonicalName(OCIO::ROLE_SCENE_LINEAR)};
    throw OCIO::Exception("it has neither a linear Rec. 709 space, such as lin_rec709, nor one of the roles "
                          "aces_interchange and scene_linear");
}

std::vector<std::string> displayNames(const OCIO::Config& config) {
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumDisplays(); ++i)
        names.emplace_back(config.getDisplay(i));
    return names;
}

std::vector<std::string> viewNames(const OCIO::Config& config, const std::string& display) {
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumViews(display.c_str()); ++i)
        names.emplace_back(config.getView(display.c_str(), i));
    return names;
}

std::vector<std::string> lookNames(const OCIO::Config& config) {
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumLooks(); ++i)
        names.emplace_back(config.getLookNameByIndex(i));
    return names;
}

/// Returns the names of the scene-referred color spaces; display spaces do not apply to files.
std::vector<std::string> sceneSpaceNames(const OCIO::Config& config) {
    constexpr auto kScene = OCIO::SEARCH_REFERENCE_SPACE_SCENE;
    constexpr auto kActive = OCIO::COLORSPACE_ACTIVE;
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumColorSpaces(kScene, kActive); ++i)
        names.emplace_back(config.getColorSpaceNameByIndex(kScene, kActive, i));
    return names;
}

/// Throws Error of kind Usage unless `name` is in `known`. The message starts with `owner`.
void requireName(const std::string& kind, const std::string& name, const std::vector<std::string>& known,
                 const std::string& owner) {
    if (std::find(known.begin(), known.end(), name) == known.end())
        throw Error(owner + ": " + unknownName(kind, name, known), ErrorKind::Usage);
}

/// Calls requireName for each name in `looks`, a list in OpenColorIO's syntax: names are separated by commas
/// or colons, may have a prefix + or -, and `|` separates alternatives.
void requireLooks(const std::string& looks, const std::vector<std::string>& known, const std::string& owner) {
    constexpr const char* kSeparators = ",:|";
    for (size_t begin = 0; begin < looks.size();) {
        const size_t end = std::min(looks.find_first_of(kSeparators, begin), looks.size());
        const std::string entry = looks.substr(begin, end - begin);
        const size_t first = entry.find_first_not_of(" +-");
        const size_t last = entry.find_last_not_of(' ');
        requireName("look", first == std::string::npos ? "" : entry.substr(first, last + 1 - first), known,
                    owner);
        begin = end + 1;
    }
}

OCIO::ConstProcessorRcPtr viewProcessor(const LoadedConfig& loaded, const std::string& display,
                                        const std::string& view, const std::string& looks) {
    const auto transform = OCIO::DisplayViewTransform::Create();
    transform->setSrc(loaded.workingSpace.c_str());
    transform->setDisplay(display.c_str());
    transform->setView(view.c_str());
    // The pipeline replaces the looks of the view by the given ones.
    const auto pipeline = OCIO::LegacyViewingPipeline::Create();
    pipeline->setDisplayViewTransform(transform);
    pipeline->setLooksOverrideEnabled(!looks.empty());
    pipeline->setLooksOverride(looks.c_str());
    return pipeline->getProcessor(loaded.config, loaded.config->getCurrentContext());
}

} // namespace

struct ColorConfig::Impl {
    Impl(std::string file, const std::string& origin)
        : file(std::move(file)),
          title(this->file.empty() ? "the built-in OpenColorIO config"
                                   : "the OpenColorIO config \"" + this->file + "\"" +
                                         (origin.empty() ? "" : ", given by " + origin)) {}
    const std::string file, title;
    std::once_flag once;
    LoadedConfig loaded;

    /// Loads the config on the first call and returns f(loaded). Turns exceptions of OpenColorIO into Error
    /// at `where`.
    template <class F>
    auto withConfig(const Location& where, const F& f) {
        try {
            std::call_once(once, [&] { loaded = load(file); });
            return f(loaded);
        } catch (const OCIO::Exception& e) {
            throw Error(where, title + ": " + e.what(), where ? ErrorKind::Scene : ErrorKind::Usage);
        }
    }
};

ColorConfig::ColorConfig(std::string file, const std::string& origin)
    : m_impl(std::make_unique<Impl>(std::move(file), origin)) {}
ColorConfig::~ColorConfig() = default;

std::string ColorConfig::workingSpace() const {
    if (m_impl->file.empty())
        return kWorkingSpace;
    return m_impl->withConfig({}, [](const LoadedConfig& loaded) { return loaded.workingSpace; });
}

ColorTransform ColorConfig::view(const ViewSettings& settings) const {
    return m_impl->withConfig({}, [&](const LoadedConfig& loaded) {
        const OCIO::Config& config = *loaded.config;
        const std::string display = settings.display.empty() ? config.getDefaultDisplay() : settings.display;
        requireName("display", display, displayNames(config), m_impl->title);
        const std::string view =
            settings.view.empty() ? config.getDefaultView(display.c_str()) : settings.view;
        requireName("view", view, viewNames(config, display),
                    "the display \"" + display + "\" of " + m_impl->title);
        requireLooks(settings.look, lookNames(config), m_impl->title);
        const ColorTransform shown = makeTransform(viewProcessor(loaded, display, view, settings.look));
        return shown ? shown : [](std::span<Rgb>) {}; // empty for a raw view
    });
}

ColorTransform ColorConfig::toWorking(const std::string& space, const Location& where) const {
    return m_impl->withConfig(where, [&](const LoadedConfig& loaded) {
        if (!loaded.config->getColorSpace(space.c_str()))
            throw Error(where,
                        m_impl->title + ": " +
                            unknownName("color space", space, sceneSpaceNames(*loaded.config)),
                        where ? ErrorKind::Scene : ErrorKind::Usage);
        return makeTransform(loaded.config->getProcessor(space.c_str(), loaded.workingSpace.c_str()));
    });
}

std::string ColorConfig::spaceOfFile(const std::filesystem::path& path, const Location& where) const {
    if (m_impl->file.empty())
        return {}; // the built-in config has only the default rule
    return m_impl->withConfig(where, [&](const LoadedConfig& loaded) -> std::string {
        const std::string name = path.generic_string();
        if (loaded.config->filepathOnlyMatchesDefaultRule(name.c_str()))
            return {};
        return loaded.config->getColorSpaceFromFilepath(name.c_str());
    });
}

namespace {

/// Adds the names of the files that a transform reads; null: none.
void addFileNames(const OCIO::ConstTransformRcPtr& transform, std::set<std::string>& names) {
    if (const auto file = OCIO_DYNAMIC_POINTER_CAST<const OCIO::FileTransform>(transform))
        names.insert(file->getSrc());
    if (const auto group = OCIO_DYNAMIC_POINTER_CAST<const OCIO::GroupTransform>(transform))
        for (int i = 0; i < group->getNumTransforms(); ++i)
            addFileNames(group->getTransform(i), names);
}

std::set<std::string> fileNames(const OCIO::Config& config) {
    std::set<std::string> names;
    for (int i = 0; i < config.getNumColorSpaces(OCIO::SEARCH_REFERENCE_SPACE_ALL, OCIO::COLORSPACE_ALL);
         ++i) {
        const auto space = config.getColorSpace(
            config.getColorSpaceNameByIndex(OCIO::SEARCH_REFERENCE_SPACE_ALL, OCIO::COLORSPACE_ALL, i));
        for (const auto direction : {OCIO::COLORSPACE_DIR_TO_REFERENCE, OCIO::COLORSPACE_DIR_FROM_REFERENCE})
            addFileNames(space->getTransform(direction), names);
    }
    for (int i = 0; i < config.getNumViewTransforms(); ++i) {
        const auto view = config.getViewTransform(config.getViewTransformNameByIndex(i));
        for (const auto direction :
             {OCIO::VIEWTRANSFORM_DIR_TO_REFERENCE, OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE})
            addFileNames(view->getTransform(direction), names);
    }
    for (const std::string& name : lookNames(config)) {
        addFileNames(config.getLook(name.c_str())->getTransform(), names);
        addFileNames(config.getLook(name.c_str())->getInverseTransform(), names);
    }
    return names;
}

uint64_t appendTextHash(uint64_t hash, std::string_view text) {
    for (const char c : text)
        hash = hashCombine(hash, uint8_t(c));
    return hash;
}

} // namespace

std::string ColorConfig::contentHash() const {
    if (m_impl->file.empty())
        return "";
    return m_impl->withConfig({}, [](const LoadedConfig& loaded) {
        std::ostringstream text;
        loaded.config->serialize(text);
        uint64_t hash = appendTextHash(0, text.str());
        for (const std::string& name : fileNames(*loaded.config)) {
            const char* path = loaded.config->getCurrentContext()->resolveFileLocation(name.c_str());
            std::ifstream file(path, std::ios::binary);
            hash = appendTextHash(hash, std::string{std::istreambuf_iterator<char>(file), {}});
        }
        std::ostringstream digits;
        digits << std::hex << hash;
        return digits.str();
    });
}

} // namespace strobe
