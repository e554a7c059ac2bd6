// Color spaces and display transforms. color_config.cpp is the only file that includes OpenColorIO.
#pragma once

#include "core/math/api.h"
#include "core/math/math.h"
#include "core/util/error.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace STROBE_API strobe {

/// The name of the working space in OpenColorIO configs: linear, Rec. 709 primaries, white point D65.
inline constexpr const char* kWorkingSpace = "lin_rec709";

/// Transforms colors in place. Thread-safe. An empty function is the identity.
using ColorTransform = std::function<void(std::span<Rgb>)>;

/// Returns the sRGB encoding of a linear value in [0,1].
float encodeSrgb(float linear);
/// Returns the linear value of an sRGB encoding in [0,1].
float decodeSrgb(float encoded);

/// A display transform, by the names of an OpenColorIO config. Empty names select the default display of the
/// config, the default view of the display, and the looks of the view.
struct ViewSettings {
    std::string display, view, look;
    bool isDefault() const { return display.empty() && view.empty() && look.empty(); }
};

/// An OpenColorIO config: a file or the built-in config. It is loaded on first use. Thread-safe. All
/// functions throw Error if the config cannot be loaded or has no element of the given name; the message
/// lists the known names. The kind is Scene if there is a location, else Usage.
class ColorConfig {
  public:
    /// `file`: the path of a config, in the form of $OCIO; if empty, the built-in config is used. `origin`:
    /// what gave the path, for messages, as "$OCIO".
    explicit ColorConfig(std::string file = {}, const std::string& origin = {});
    ~ColorConfig();
    ColorConfig(const ColorConfig&) = delete;
    ColorConfig& operator=(const ColorConfig&) = delete;

    /// Returns the name of the working space in this config.
    std::string workingSpace() const;
    /// Returns the transform from the working space to display values, which lie in [0,1] if the display can
    /// show them. Never empty.
    ColorTransform view(const ViewSettings& settings) const;
    /// Returns the transform from `space` (a name, an alias or a role) to the working space. Empty if it is
    /// the identity, as for data spaces.
    ColorTransform toWorking(const std::string& space, const Location& where) const;
    /// Returns the color space that the file rules of the config assign to a file of this name; an empty
    /// string if only the default rule matches.
    std::string spaceOfFile(const std::filesystem::path& path, const Location& where) const;

    /// Returns a hash of the config and of the files that it names; empty for the built-in config.
    std::string contentHash() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

/// The text of the built-in config.
extern const char* const kBuiltinColorConfig;

} // namespace strobe
